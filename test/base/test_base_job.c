// Background jobs: they run beside the caller, report, can be cancelled, and bring their message along.
#include <stdatomic.h>
#include <time.h>

#include "omentum/base_job.h"
#include "test_alloc.h"
#include "test_common.h"

typedef struct Work {
    atomic_int stage;  // set by the job: 1 at half of it, 2 at its end
    atomic_bool may_continue;
    double sum;
} Work;

static void wait_briefly(void) { nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL); }

static OmStatus add_up(void* ctx, const OmProgress* progress) {
    Work* w = ctx;
    for (int i = 0; i < 1000; ++i) {
        w->sum += i;
        OM_TRY(om_progress_report(progress, "adding", i + 1, 1000));
        if (i == 499) {
            atomic_store(&w->stage, 1);
            while (!atomic_load(&w->may_continue)) wait_briefly();
        }
    }
    atomic_store(&w->stage, 2);
    return OM_OK;
}

static void runs_beside_its_caller(void** state) {
    (void)state;
    Work w = {0};
    OmJob* job;
    assert_ok(om_job_start(add_up, &w, &job));
    while (atomic_load(&w.stage) < 1) wait_briefly();
    assert_false(om_job_is_finished(job));
    assert_near(om_job_progress(job), 0.5, 1e-15);
    atomic_store(&w.may_continue, true);
    while (!om_job_is_finished(job)) wait_briefly();
    assert_near(om_job_progress(job), 1, 0);
    assert_ok(om_job_join(job));
    assert_int_equal(w.stage, 2);
    assert_near(w.sum, 499500, 0);
}

static void stops_when_cancelled(void** state) {
    (void)state;
    Work w = {0};
    OmJob* job;
    assert_ok(om_job_start(add_up, &w, &job));
    while (atomic_load(&w.stage) < 1) wait_briefly();
    om_job_cancel(job);
    atomic_store(&w.may_continue, true);
    assert_status(om_job_join(job), OM_CANCELLED);
    assert_string_equal(om_error_message(), "cancelled during adding");
    assert_int_equal(w.stage, 1);
    assert_near(w.sum, 125250, 0);  // 0 + ... + 500: the first report after the request ends it
}

static OmStatus fail_with_number(void* ctx, const OmProgress* progress) {
    (void)progress;
    return om_error(OM_INVALID, "job %d failed", *(int*)ctx);
}

static void messages_reach_the_joining_thread(void** state) {
    (void)state;
    OmJob* job[8];
    int number[8];
    for (int k = 0; k < 8; ++k) {
        number[k] = k;
        assert_ok(om_job_start(fail_with_number, &number[k], &job[k]));
    }
    for (int k = 7; k >= 0; --k) {
        char expected[32];
        snprintf(expected, sizeof expected, "job %d failed", k);
        assert_status(om_job_join(job[k]), OM_INVALID);
        assert_string_equal(om_error_message(), expected);
    }
    assert_ok(om_job_join(NULL));
}

static OmStatus nothing(void* ctx, const OmProgress* progress) {
    (void)ctx, (void)progress;
    return OM_NOT_CONVERGED;
}

static OmStatus start_and_join(void* ctx) {
    (void)ctx;
    OmJob* job;
    OmStatus status = om_job_start(nothing, NULL, &job);
    if (status < 0) assert_null(job);
    return status < 0 ? status : om_job_join(job);
}

static void outcomes_and_memory(void** state) {
    (void)state;
    int64_t alive = om_alloc_alive();
    assert_status(start_and_join(NULL), OM_NOT_CONVERGED);
    assert_int_equal(om_alloc_alive(), alive);
    assert_true(test_failing_allocations(start_and_join, NULL, 1) >= 1);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(runs_beside_its_caller),
        cmocka_unit_test(stops_when_cancelled),
        cmocka_unit_test(messages_reach_the_joining_thread),
        cmocka_unit_test(outcomes_and_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
