// test_base_blas.c: the BLAS has the number of threads of the open scopes, and its own after the last one.
#include <stdatomic.h>
#include <time.h>

#include "base/base_blas.h"
#include "omentum/base_job.h"
#include "test_common.h"

void openblas_set_num_threads(int n);

static void wait_briefly(void) { nanosleep(&(struct timespec){.tv_nsec = 100000}, NULL); }

static void set_and_restored(void** state) {
    (void)state;
    for (int own = 1; own <= 2; ++own) {  // the number of a program that uses the library
        openblas_set_num_threads(own);
        om__blas_begin(3 - own);
        assert_int_equal(om__blas_threads(), 3 - own);
        om__blas_begin(own);  // inside: that of the outer scope
        assert_int_equal(om__blas_threads(), 3 - own);
        om__blas_end();
        assert_int_equal(om__blas_threads(), 3 - own);
        om__blas_end();
        assert_int_equal(om__blas_threads(), own);
    }
}

typedef struct Work {
    int nthread;
    atomic_int *nopen, nwrong;
} Work;

// Many scopes: in each the number is the one requested, and no scope of another number is open.
static OmStatus open_scopes(void* ctx, const OmProgress* progress) {
    (void)progress;
    Work* w = ctx;
    for (int i = 0; i < 400; ++i) {
        om__blas_begin(w->nthread);
        atomic_fetch_add(&w->nopen[w->nthread], 1);
        if (om__blas_threads() != w->nthread || atomic_load(&w->nopen[3 - w->nthread]) != 0)
            atomic_fetch_add(&w->nwrong, 1);
        atomic_fetch_sub(&w->nopen[w->nthread], 1);
        om__blas_end();
    }
    return OM_OK;
}

static void several_threads(void** state) {
    (void)state;
    atomic_int nopen[3] = {0};
    Work work[4] = {{1, nopen}, {1, nopen}, {2, nopen}, {2, nopen}};
    OmJob* job[4];
    openblas_set_num_threads(2);
    for (int k = 0; k < 4; ++k) assert_ok(om_job_start(open_scopes, &work[k], &job[k]));
    for (int k = 0; k < 4; ++k) assert_ok(om_job_join(job[k]));
    for (int k = 0; k < 4; ++k) assert_int_equal(work[k].nwrong, 0);
    assert_int_equal(om__blas_threads(), 2);
}

typedef struct Beside {
    atomic_bool is_open, may_end;
} Beside;

static OmStatus hold_a_scope(void* ctx, const OmProgress* progress) {
    (void)progress;
    Beside* b = ctx;
    om__blas_begin(2);
    atomic_store(&b->is_open, true);
    while (!atomic_load(&b->may_end)) wait_briefly();
    om__blas_end();
    return OM_OK;
}

// Scopes of one number are open at the same time: this one begins while the job holds its own.
static void one_number_overlaps(void** state) {
    (void)state;
    Beside b = {0};
    OmJob* job;
    openblas_set_num_threads(1);
    assert_ok(om_job_start(hold_a_scope, &b, &job));
    while (!atomic_load(&b.is_open)) wait_briefly();
    om__blas_begin(2);
    assert_int_equal(om__blas_threads(), 2);
    om__blas_end();
    assert_int_equal(om__blas_threads(), 2);  // the job's is open
    atomic_store(&b.may_end, true);
    assert_ok(om_job_join(job));
    assert_int_equal(om__blas_threads(), 1);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(set_and_restored),
                                       cmocka_unit_test(several_threads),
                                       cmocka_unit_test(one_number_overlaps)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
