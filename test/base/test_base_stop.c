// A request to stop: asked now and then, kept until it is taken, of one thread; loops leave out what remains.
#include <pthread.h>
#include <time.h>

#include "omentum/base.h"
#include "test_common.h"

typedef struct Ask {
    int nask, stop_at;  // the call from which on it says true; 0: never
} Ask;

static bool ask(void* ctx) {
    Ask* a = ctx;
    ++a->nask;
    return a->stop_at > 0 && a->nask >= a->stop_at;
}

static void wait_ms(int ms) { nanosleep(&(struct timespec){.tv_nsec = 1000000L * ms}, NULL); }

// The first poll asks; polls within a period do not. True stays true without being asked again, until it is taken.
static void test_a_request_is_asked_for_now_and_then(void** state) {
    (void)state;
    Ask a = {0};
    assert_ok(om_stop_poll());
    assert_false(om_stop_is_set());
    om_stop_set(ask, &a);
    assert_true(om_stop_is_set());
    for (int k = 0; k < 1000; ++k) assert_ok(om_stop_poll());
    assert_true(a.nask >= 1 && a.nask < 10);  // microseconds
    wait_ms((int)(1100 * OM_STOP_PERIOD));
    const int before = a.nask;
    assert_ok(om_stop_poll());
    assert_int_equal(a.nask, before + 1);
    a.stop_at = 1;
    wait_ms((int)(1100 * OM_STOP_PERIOD));
    assert_status(om_stop_poll(), OM_CANCELLED);
    a.stop_at = 0;
    assert_status(om_stop_poll(), OM_CANCELLED);
    assert_int_equal(a.nask, before + 2);
    assert_true(om_stop_take());
    assert_false(om_stop_take());
    wait_ms((int)(1100 * OM_STOP_PERIOD));
    assert_ok(om_stop_poll());
    om_stop_set(NULL, NULL);
}

static void* poll_there(void* ctx) {
    *(OmStatus*)ctx = om_stop_poll();
    return NULL;
}

static void test_it_is_of_one_thread_and_ends_progress(void** state) {
    (void)state;
    Ask a = {.stop_at = 1};
    OmStatus there = OM_INVALID;
    pthread_t thread;
    om_stop_set(ask, &a);
    assert_status(om_progress_report(NULL, "reading", 0, 1), OM_CANCELLED);
    assert_int_equal(pthread_create(&thread, NULL, poll_there, &there), 0);
    pthread_join(thread, NULL);
    assert_int_equal(there, OM_OK);
    om_stop_set(NULL, NULL);
    assert_ok(om_progress_report(NULL, "reading", 0, 1));
}

enum { NITEM = 10007, GRAIN = 16, NBLOCK = (NITEM + GRAIN - 1) / GRAIN };

typedef struct Seen {
    int begin[NBLOCK], end[NBLOCK];
} Seen;

static void note(void* ctx, int begin, int end, int block) {
    Seen* seen = ctx;
    seen->begin[block] = begin;
    seen->end[block] = end;
}

static void note_slowly(void* ctx, int begin, int end, int block) {
    note(ctx, begin, end, block);
    wait_ms(1);
}

// The blocks are those of om_parallel_for; after a request some at the beginning are done, and none at the end.
static void test_a_loop_that_stops(void** state) {
    (void)state;
    static Seen plain, same, part;
    Ask a = {0};
    om_parallel_for(2, NITEM, GRAIN, note, &plain);
    om_stop_set(ask, &a);
    assert_ok(om_parallel_for_stop(2, NITEM, GRAIN, note, &same));
    assert_memory_equal(&plain, &same, sizeof plain);
    assert_int_equal(plain.end[NBLOCK - 1], NITEM);
    a.stop_at = a.nask + 2;
    assert_status(om_parallel_for_stop(2, NITEM, GRAIN, note_slowly, &part), OM_CANCELLED);
    assert_true(part.end[0] == GRAIN && part.end[NBLOCK - 1] == 0);
    om_stop_set(NULL, NULL);
    assert_ok(om_parallel_for_stop(2, NITEM, GRAIN, note, &part));
    assert_memory_equal(&plain, &part, sizeof plain);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_request_is_asked_for_now_and_then),
        cmocka_unit_test(test_it_is_of_one_thread_and_ends_progress),
        cmocka_unit_test(test_a_loop_that_stops),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
