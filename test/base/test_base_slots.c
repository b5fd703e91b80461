// test_base_slots.c: slots are taken from the lowest on, and a thread without one sleeps until one is given back.
#include <stdatomic.h>
#include <time.h>

#include "base/base_slots.h"
#include "omentum/base_job.h"
#include "test_alloc.h"

static void wait_briefly(void) { nanosleep(&(struct timespec){.tv_nsec = 100000}, NULL); }

static void lowest_free_one(void** state) {
    (void)state;
    OmSlots* s;
    assert_ok(om__slots_create(3, &s));
    for (int k = 0; k < 3; ++k) assert_int_equal(om__slots_take(s), k);
    om__slots_give(s, 1);
    assert_int_equal(om__slots_take(s), 1);
    om__slots_give(s, 2);
    om__slots_give(s, 0);
    assert_int_equal(om__slots_take(s), 0);
    assert_int_equal(om__slots_take(s), 2);
    om__slots_destroy(s);
    om__slots_destroy(NULL);
}

typedef struct Taker {
    OmSlots* slots;
    atomic_bool is_started;
    atomic_int slot;
    double seconds;  // of processor time, between request and slot
} Taker;

static double own_time(void) {
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static OmStatus take_one(void* ctx, const OmProgress* progress) {
    (void)progress;
    Taker* t = ctx;
    const double begin = own_time();
    atomic_store(&t->is_started, true);
    atomic_store(&t->slot, om__slots_take(t->slots));
    t->seconds = own_time() - begin;
    return OM_OK;
}

// A thread that waits 20 ms takes no processor time, and gets the slot that is given back.
static void sleeps_until_given(void** state) {
    (void)state;
    Taker t = {.slot = -1};
    OmJob* job;
    assert_ok(om__slots_create(2, &t.slots));
    om__slots_take(t.slots);
    om__slots_take(t.slots);
    assert_ok(om_job_start(take_one, &t, &job));
    while (!atomic_load(&t.is_started)) wait_briefly();
    for (int k = 0; k < 200; ++k) wait_briefly();
    assert_int_equal(atomic_load(&t.slot), -1);
    om__slots_give(t.slots, 1);
    assert_ok(om_job_join(job));
    assert_int_equal(atomic_load(&t.slot), 1);
    assert_below(t.seconds, 0.005);
    om__slots_destroy(t.slots);
}

typedef struct Shared {
    OmSlots* slots;
    atomic_int owner[2];  // threads that hold this slot
    atomic_int nwrong;
} Shared;

static void use_slots(void* ctx, int begin, int end, int block) {
    (void)block;
    Shared* s = ctx;
    for (int i = begin; i < end; ++i) {
        int k = om__slots_take(s->slots);
        if (atomic_fetch_add(&s->owner[k], 1) != 0) atomic_fetch_add(&s->nwrong, 1);
        atomic_fetch_sub(&s->owner[k], 1);
        om__slots_give(s->slots, k);
    }
}

// Four workers and two slots: never two owners.
static void one_owner(void** state) {
    (void)state;
    Shared s = {0};
    assert_ok(om__slots_create(2, &s.slots));
    om_parallel_for(4, 4000, 10, use_slots, &s);
    assert_int_equal(s.nwrong, 0);
    om__slots_destroy(s.slots);
}

static OmStatus create(void* ctx) {
    (void)ctx;
    OmSlots* s;
    OmStatus status = om__slots_create(5, &s);
    om__slots_destroy(s);
    return status;
}

static void memory(void** state) {
    (void)state;
    assert_int_equal(test_failing_allocations(create, NULL, 1), 1);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(lowest_free_one),
                                       cmocka_unit_test(sleeps_until_given),
                                       cmocka_unit_test(one_owner), cmocka_unit_test(memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
