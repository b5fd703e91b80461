// test_solve_eigen.c: eigenpairs of sparse matrices against exact spectra and a dense Jacobi method.
#include "omentum/base_job.h"
#include "solve/solve_internal.h"
#include "test_alloc.h"
#include "test_dense.h"

#define PI 3.14159265358979323846

// The chain of n masses between two walls, springs of stiffness 1: eigenvalues 4 sin^2(p pi / (2 (n + 1))).
static void make_chain(int n, OmCsr* A) {
    int* row = om_alloc(3 * (size_t)n, sizeof(int));
    int* col = om_alloc(3 * (size_t)n, sizeof(int));
    double* value = om_alloc(3 * (size_t)n, sizeof(double));
    int num = 0;
    for (int i = 0; i < n; ++i)
        for (int d = -1; d <= 1; ++d) {
            if (i + d < 0 || i + d >= n) continue;
            row[num] = i;
            col[num] = i + d;
            value[num++] = d == 0 ? 2 : -1;
        }
    assert_ok(om_csr_init(n, num, row, col, value, A));
    om_free(row);
    om_free(col);
    om_free(value);
}

static void triplets_become_sorted_rows(void** state) {
    (void)state;
    const int row[6] = {2, 0, 2, 0, 2, 0}, col[6] = {0, 3, 2, 1, 0, 3};
    const double value[6] = {1, 2, 3, 4, 10, 20}, x[4] = {1, 2, 3, 4};
    const double dense[4][4] = {{0, 4, 0, 22}, {0}, {11, 0, 3, 0}, {0}};
    double y[4];
    OmCsr A;
    assert_ok(om_csr_init(4, 6, row, col, value, &A));
    assert_int_equal(A.row_adr[4], 4);
    for (int i = 0; i < 4; ++i) {
        double sum = 0;
        for (int j = 0; j < 4; ++j) {
            assert_near(om_csr_get(&A, i, j), dense[i][j], 0);
            sum += dense[i][j] * x[j];
        }
        for (int k = A.row_adr[i] + 1; k < A.row_adr[i + 1]; ++k)
            assert_true(A.col[k - 1] < A.col[k]);
        om_csr_apply(&A, x, y);
        assert_near(y[i], sum, 0);
    }
    assert_near(om_csr_get(&A, 4, 0), 0, 0);
    om_csr_done(&A);
    const int outside[1] = {4}, inside[1] = {0};
    const double nan[1] = {NAN};
    assert_status(om_csr_init(4, 1, outside, inside, value, &A), OM_INVALID);
    assert_status(om_csr_init(4, 1, inside, outside, value, &A), OM_INVALID);
    assert_status(om_csr_init(4, 1, inside, inside, nan, &A), OM_INVALID);
    assert_status(om_csr_init(0, 0, row, col, value, &A), OM_INVALID);
}

static void chain_has_its_exact_spectrum(void** state) {
    (void)state;
    enum { N = 300, K = 40 };
    OmCsr A;
    make_chain(N, &A);
    double lambda[K], *x = om_alloc(K * N, sizeof(double));
    OmEigenDef def = om_eigen_default_def(K, -1e-3);
    OmEigenInfo info;
    assert_ok(om_eigen_smallest(&def, &A, NULL, lambda, x, &info));
    assert_int_equal(info.npair, K);
    assert_true(info.nsolve > K);
    assert_below(info.residual, 1e-10);
    for (int p = 0; p < K; ++p) {
        double s = 2 * sin((p + 1) * PI / (2 * (N + 1)));
        assert_near(lambda[p], s * s, 1e-12);
        // the vector is sqrt(2 / (N + 1)) sin((p + 1)(i + 1) pi / (N + 1)), with the sign of its largest entry
        double dot = 0, largest = 0;
        for (int i = 0; i < N; ++i) {
            dot += x[p * N + i] * sqrt(2.0 / (N + 1)) * sin((p + 1) * (i + 1) * PI / (N + 1));
            if (fabs(x[p * N + i]) > fabs(largest)) largest = x[p * N + i];
        }
        assert_near(fabs(dot), 1, 1e-9);
        assert_true(largest > 0);
    }
    om_free(x);
    om_csr_done(&A);
}

typedef struct Pair {
    int n;
    OmCsr A, B;
    double *dense_a, *dense_b;
} Pair;

// Random sparse symmetric A, and B = the identity + the same pattern, positive definite by its diagonal.
static void make_pair(int n, Pair* pair) {
    OmRng rng = om_rng_init(11, 0);
    int num = 0, *row = om_alloc((size_t)(n * n), sizeof(int)),
        *col = om_alloc((size_t)(n * n), sizeof(int));
    double* a = om_alloc((size_t)(n * n), sizeof(double));
    double* b = om_alloc((size_t)(n * n), sizeof(double));
    pair->n = n;
    pair->dense_a = om_calloc((size_t)(n * n), sizeof(double));
    pair->dense_b = om_calloc((size_t)(n * n), sizeof(double));
    for (int i = 0; i < n; ++i)
        for (int j = i; j < n; ++j) {
            if (j > i && om_rng_uniform(&rng) > 0.2) continue;
            for (int turn = 0; turn < (i == j ? 1 : 2); ++turn, ++num) {
                row[num] = turn ? j : i;
                col[num] = turn ? i : j;
                a[num] = turn ? a[num - 1] : om_rng_range(&rng, -1, 1);
                b[num] = turn ? b[num - 1] : i == j ? 2 : om_rng_range(&rng, -0.15, 0.15);
                pair->dense_a[row[num] * n + col[num]] = a[num];
                pair->dense_b[row[num] * n + col[num]] = b[num];
            }
        }
    assert_ok(om_csr_init(n, num, row, col, a, &pair->A));
    assert_ok(om_csr_init(n, num, row, col, b, &pair->B));
    om_free(row);
    om_free(col);
    om_free(a);
    om_free(b);
}
static void pair_done(Pair* pair) {
    om_csr_done(&pair->A);
    om_csr_done(&pair->B);
    om_free(pair->dense_a);
    om_free(pair->dense_b);
}

static void general_pair_matches_a_dense_method(void** state) {
    (void)state;
    enum { N = 30, K = 12 };
    Pair pair;
    double all[N], lambda[K], x[K * N], y[N];
    make_pair(N, &pair);
    test_reduce_to_standard(N, pair.dense_b, pair.dense_a);
    test_jacobi(N, pair.dense_a, all);
    OmEigenDef def = om_eigen_default_def(K, all[0] - 0.3);  // negative eigenvalues are eigenvalues
    assert_true(all[0] < 0);
    assert_ok(om_eigen_smallest(&def, &pair.A, &pair.B, lambda, x, NULL));
    for (int p = 0; p < K; ++p) {
        assert_near(lambda[p], all[p], 1e-11);
        om_csr_apply(&pair.B, x + p * N, y);
        for (int q = 0; q < K; ++q) {
            double dot = 0;
            for (int i = 0; i < N; ++i) dot += x[q * N + i] * y[i];
            assert_near(dot, p == q, 1e-10);
        }
    }
    // all but one pair, and the number of vectors given
    double most[N - 1], vectors[(N - 1) * N];
    def = om_eigen_default_def(N - 1, all[0] - 0.3);
    def.nbasis = N;
    assert_ok(om_eigen_smallest(&def, &pair.A, &pair.B, most, vectors, NULL));
    for (int p = 0; p < N - 1; ++p) assert_near(most[p], all[p], 1e-10);
    pair_done(&pair);
}

// Chains apart from each other: every eigenvalue comes as often as there are chains.
static void check_copies(int copies, int npair) {
    enum { M = 12 };
    int n = M * copies, num = 0;
    double* value = om_alloc(3 * (size_t)n, sizeof(double));
    double* x = om_alloc((size_t)(npair * n), sizeof(double));
    double lambda[100];
    int *row = om_alloc(3 * (size_t)n, sizeof(int)), *col = om_alloc(3 * (size_t)n, sizeof(int));
    for (int i = 0; i < n; ++i)
        for (int d = -1; d <= 1; ++d) {
            if (i + d < 0 || i + d >= n || (i + d) / M != i / M) continue;
            row[num] = i;
            col[num] = i + d;
            value[num++] = d == 0 ? 2 : -1;
        }
    OmCsr A;
    OmEigenInfo info;
    assert_ok(om_csr_init(n, num, row, col, value, &A));
    OmEigenDef def = om_eigen_default_def(npair, -0.01);
    assert_ok(om_eigen_smallest(&def, &A, NULL, lambda, x, &info));
    assert_below(info.residual, 1e-9);
    for (int p = 0; p < npair; ++p) {
        double s = 2 * sin((p / copies + 1) * PI / (2 * (M + 1)));
        assert_near(lambda[p], s * s, 1e-10);
        for (int q = 0; q <= p; ++q) {
            double dot = 0;
            for (int i = 0; i < n; ++i) dot += x[p * n + i] * x[q * n + i];
            assert_near(dot, p == q, 1e-8);
        }
    }
    om_csr_done(&A);
    om_free(row);
    om_free(col);
    om_free(value);
    om_free(x);
}

// One Lanczos vector does not find them: with 45 copies some were missing, and the call was OM_OK.
static void multiple_eigenvalues_are_all_found(void** state) {
    (void)state;
    check_copies(10, 25);
    check_copies(45, 60);
    check_copies(45, 30);
    check_copies(80, 100);
}

// Negative eigenvalues of the chain minus a multiple of the identity.
static void negative_eigenvalues_are_counted(void** state) {
    (void)state;
    enum { N = 50 };
    for (int exact = 0; exact <= N; exact += 5) {
        OmCsr A;
        int num;
        make_chain(N, &A);
        double s = 2 * sin((exact + 0.5) * PI / (2 * (N + 1)));  // between two eigenvalues
        for (int i = 0; i < N; ++i)
            for (int k = A.row_adr[i]; k < A.row_adr[i + 1]; ++k)
                if (A.col[k] == i) A.value[k] -= s * s;
        assert_ok(om__count_negative(&A, &num));
        assert_int_equal(num, exact);
        om_csr_done(&A);
    }
}

static void second_run_gives_the_same_bytes(void** state) {
    (void)state;
    enum { N = 200, K = 20 };
    OmCsr A, other;
    make_chain(N, &A);
    make_chain(N / 2, &other);
    double lambda[2][K], *x = om_alloc(2 * K * N, sizeof(double));
    OmEigenDef def = om_eigen_default_def(K, -1e-3);
    assert_ok(om_eigen_smallest(&def, &A, NULL, lambda[0], x, NULL));
    // another problem in between: ARPACK keeps state between its calls
    assert_ok(om_eigen_smallest(&def, &other, NULL, lambda[1], x + K * N, NULL));
    assert_ok(om_eigen_smallest(&def, &A, NULL, lambda[1], x + K * N, NULL));
    assert_memory_equal(lambda[0], lambda[1], sizeof lambda[0]);
    assert_memory_equal(x, x + K * N, K * N * sizeof(double));
    om_free(x);
    om_csr_done(&A);
    om_csr_done(&other);
}

typedef struct Task {
    OmCsr A;
    int npair;
    double lambda[20], x[20 * 200];
} Task;

static OmStatus solve_task(void* ctx, const OmProgress* progress) {
    (void)progress;
    Task* task = ctx;
    OmEigenDef def = om_eigen_default_def(task->npair, -1e-3);
    for (int run = 0; run < 20; ++run)
        OM_TRY(om_eigen_smallest(&def, &task->A, NULL, task->lambda, task->x, NULL));
    return OM_OK;
}

// Three threads with problems of different sizes: each result is that of a call alone.
static void callers_of_several_threads_wait(void** state) {
    (void)state;
    enum { N = 3 };
    Task* task = om_calloc(2 * N, sizeof *task);
    OmJob* job[N];
    for (int k = 0; k < N; ++k) {
        make_chain(200 - 50 * k, &task[k].A);
        task[k].npair = 20 - 5 * k;
        task[N + k] = task[k];
        assert_ok(solve_task(&task[N + k], NULL));
    }
    for (int k = 0; k < N; ++k) assert_ok(om_job_start(solve_task, &task[k], &job[k]));
    for (int k = 0; k < N; ++k) assert_ok(om_job_join(job[k]));
    for (int k = 0; k < N; ++k) {
        assert_memory_equal(task[k].lambda, task[N + k].lambda, sizeof task[k].lambda);
        assert_memory_equal(task[k].x, task[N + k].x, sizeof task[k].x);
        om_csr_done(&task[k].A);
    }
    om_free(task);
}

static void call_inside_a_loop(void* ctx, int begin, int end, int block) {
    (void)begin, (void)end;
    OmCsr A;
    double lambda[2], x[40];
    make_chain(20, &A);
    OmEigenDef def = om_eigen_default_def(2, -1e-3);
    ((OmStatus*)ctx)[block] = om_eigen_smallest(&def, &A, NULL, lambda, x, NULL);
    om_csr_done(&A);
}

static void wrong_arguments_are_refused(void** state) {
    (void)state;
    enum { N = 20 };
    OmCsr A, B, small;
    double lambda[N], x[N * N], mass[N];
    for (int i = 0; i < N; ++i) mass[i] = i == 7 ? 0 : 1;
    make_chain(N, &A);
    make_chain(N - 1, &small);
    assert_ok(om_csr_init_diagonal(N, mass, &B));
    OmEigenDef none = {0}, good = om_eigen_default_def(3, -1e-3), def = good;
    assert_status(om_eigen_smallest(&none, &A, NULL, lambda, x, NULL), OM_INVALID);
    assert_status(om_eigen_smallest(&good, &A, &B, lambda, x, NULL), OM_INVALID);
    assert_status(om_eigen_smallest(&good, &A, &small, lambda, x, NULL), OM_INVALID);
    const int bad_count[3] = {0, N, -1};
    for (int k = 0; k < 3; ++k, def = good) {
        def.npair = bad_count[k];
        assert_status(om_eigen_smallest(&def, &A, NULL, lambda, x, NULL), OM_INVALID);
    }
    const int bad_basis[3] = {3, N + 1, -1};
    for (int k = 0; k < 3; ++k, def = good) {
        def.nbasis = bad_basis[k];
        assert_status(om_eigen_smallest(&def, &A, NULL, lambda, x, NULL), OM_INVALID);
    }
    def.shift = NAN;
    assert_status(om_eigen_smallest(&def, &A, NULL, lambda, x, NULL), OM_INVALID);
    def = good;
    def.tolerance = 0;
    assert_status(om_eigen_smallest(&def, &A, NULL, lambda, x, NULL), OM_INVALID);
    def = good;
    def.max_restarts = 0;
    assert_status(om_eigen_smallest(&def, &A, NULL, lambda, x, NULL), OM_INVALID);
    A.value[1] += 0.5;  // no longer symmetric
    assert_status(om_eigen_smallest(&good, &A, NULL, lambda, x, NULL), OM_INVALID);
    A.value[1] = NAN;
    assert_status(om_eigen_smallest(&good, &A, NULL, lambda, x, NULL), OM_INVALID);
    OmStatus inside[2] = {OM_OK, OM_OK};
    om_parallel_for(2, 2, 1, call_inside_a_loop, inside);
    assert_int_equal(inside[0], OM_INVALID);
    assert_int_equal(inside[1], OM_INVALID);
    om_csr_done(&A);
    om_csr_done(&B);
    om_csr_done(&small);
}

static void outcomes_are_told(void** state) {
    (void)state;
    enum { N = 400, K = 12 };
    OmCsr A;
    make_chain(N, &A);
    double lambda[K] = {7}, *x = om_alloc(K * N, sizeof(double));
    OmEigenInfo info;
    OmEigenDef def = om_eigen_default_def(K, 0.5);  // inside the spectrum
    assert_status(om_eigen_smallest(&def, &A, NULL, lambda, x, &info), OM_NOT_SPD);
    assert_near(lambda[0], 7, 0);
    assert_non_null(strstr(om_error_message(), "shift 0.5"));
    def = om_eigen_default_def(K, -10);  // so far below that 1 / (lambda - shift) are almost equal
    def.nbasis = K + 1;
    def.max_restarts = 2;
    assert_status(om_eigen_smallest(&def, &A, NULL, lambda, x, &info), OM_NOT_CONVERGED);
    assert_true(info.npair < K);
    for (int p = info.npair; p < K; ++p) assert_near(lambda[p], 0, 0);
    // more restarts, until some pairs have converged: further runs find the others
    def = om_eigen_default_def(K, -1e-4);
    def.nbasis = K + 2;
    info.npair = 0;
    OmStatus status = OM_OK;
    for (def.max_restarts = 1; info.npair == 0 && def.max_restarts < 100; ++def.max_restarts)
        status = om_eigen_smallest(&def, &A, NULL, lambda, x, &info);
    assert_status(status, OM_OK);
    assert_int_equal(info.npair, K);
    assert_below(info.residual, 1e-7);
    for (int p = 0; p < K; ++p) {
        double square = 0;
        for (int i = 0; i < N; ++i) square += x[p * N + i] * x[p * N + i];
        assert_near(square, p < info.npair, 1e-9);
        assert_int_equal(lambda[p] != 0, p < info.npair);
    }
    om_free(x);
    om_csr_done(&A);
}

static OmStatus solve_once(void* ctx) {
    enum { N = 40, K = 5 };
    const OmCsr* A = ctx;
    double lambda[K], x[K * N], one[N];
    OmCsr B;
    for (int i = 0; i < N; ++i) one[i] = 1;
    OM_TRY(om_csr_init_diagonal(N, one, &B));
    OmEigenDef def = om_eigen_default_def(K, -1e-3);
    OmStatus status = om_eigen_smallest(&def, A, &B, lambda, x, NULL);
    om_csr_done(&B);
    return status;
}

static void every_failing_allocation_is_told(void** state) {
    (void)state;
    OmCsr A;
    make_chain(40, &A);
    assert_true(test_failing_allocations(solve_once, &A, 1) >= 20);
    om_csr_done(&A);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(triplets_become_sorted_rows),
        cmocka_unit_test(chain_has_its_exact_spectrum),
        cmocka_unit_test(general_pair_matches_a_dense_method),
        cmocka_unit_test(multiple_eigenvalues_are_all_found),
        cmocka_unit_test(negative_eigenvalues_are_counted),
        cmocka_unit_test(second_run_gives_the_same_bytes),
        cmocka_unit_test(callers_of_several_threads_wait),
        cmocka_unit_test(wrong_arguments_are_refused),
        cmocka_unit_test(outcomes_are_told),
        cmocka_unit_test(every_failing_allocation_is_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
