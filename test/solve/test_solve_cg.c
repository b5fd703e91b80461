// test_solve_cg.c: every solver against a dense factor and against each other; honesty and failures.
#include "solve/solve_problem.h"

static const OmPreconditioner kinds[] = {OM_BLOCK_JACOBI, OM_MULTIGRID, OM_CHOLESKY};

// Gauss elimination of the free part, prescribed values moved to the right.
static void dense_solve(const Problem* p, const double* b, double* x) {
    size_t n = p->n;
    double* D = dense_matrix(&p->A);
    double* r = om_alloc(n, sizeof(double));
    for (size_t i = 0; i < n; ++i) {
        r[i] = p->fixed[i] ? x[i] : b[i];
        for (size_t j = 0; j < n && p->fixed[i]; ++j) D[i * n + j] = i == j ? 1 : 0;
    }
    for (size_t k = 0; k < n; ++k)
        for (size_t i = k + 1; i < n; ++i) {
            double f = D[i * n + k] / D[k * n + k];
            for (size_t j = k; j < n && f != 0.0; ++j) D[i * n + j] -= f * D[k * n + j];
            r[i] -= f * r[k];
        }
    for (size_t k = n; k-- > 0;) {
        for (size_t j = k + 1; j < n; ++j) r[k] -= D[k * n + j] * x[j];
        x[k] = r[k] / D[k * n + k];
    }
    om_free(D);
    om_free(r);
}

static void all_match_a_dense_solve(void** state) {
    (void)state;
    Elastic el = elastic_tissue();
    Problem p;
    problem_init(&p, beam_size(), 7, 3, 3, &el, 3);
    for (int i = 0; i < p.mesh.nvert; i += 7) p.fixed[3 * i + i % 3] = 1;  // single directions
    double* ref = om_calloc(3 * p.n, sizeof(double));
    for (size_t k = 0; k < 3 * p.n; ++k)
        if (p.fixed[k % p.n]) ref[k] = p.x[k] = 1e-3 * (double)(k % 5);
    for (size_t c = 0; c < 3; ++c) dense_solve(&p, p.b + c * p.n, ref + c * p.n);
    for (int k = 0; k < 3; ++k) {
        OmSolver* S = make_solver(&p, kinds[k], 1e-9, 2);
        OmSolveInfo info;
        for (size_t i = 0; i < 3 * p.n; ++i) p.x[i] = p.fixed[i % p.n] ? p.x[i] : 0.0;
        assert_ok(om_solver_solve(S, &p.A, 3, p.b, p.x, &info));
        assert_below(info.residual, 1e-9);
        // Residual times the condition number of this system, about 1e3.
        for (size_t c = 0; c < 3; ++c)
            assert_below(max_difference(p.x + c * p.n, ref + c * p.n, p.n),
                         1e-6 * test_tol_scale());
        for (size_t i = 0; i < 3 * p.n; ++i)
            if (p.fixed[i % p.n]) assert_true(p.x[i] == ref[i]);
        // A good guess is worth its iterations.
        assert_ok(om_solver_solve(S, &p.A, 3, p.b, p.x, &info));
        assert_int_equal(info.iterations, 0);
        om_solver_destroy(S);
    }
    om_free(ref);
    problem_done(&p);
}

// Solutions are linear: 1,024 times the load gives 1,024 times the answer, to the last bit, and in as many iterations.
static void solutions_are_linear(void** state) {
    (void)state;
    Elastic el = elastic_tissue();
    for (int k = 0; k < 2; ++k) {
        Problem p;
        problem_init(&p, beam_size(), 7, 3, 3, &el, 1);
        double sum = 0;
        for (size_t i = 0; i < p.n; ++i) sum += p.fixed[i] ? 0 : p.b[i] * p.b[i];
        for (size_t i = 0; i < p.n; ++i) p.b[i] /= sqrt(sum), p.x[i] = 0;
        double* once = om_alloc(p.n, sizeof *once);
        OmSolveInfo info[2];
        for (int turn = 0; turn < 2; ++turn) {
            OmSolver* S = make_solver(&p, kinds[k], 1e-9, 1);
            assert_ok(om_solver_solve(S, &p.A, 1, p.b, p.x, &info[turn]));
            om_solver_destroy(S);
            for (size_t i = 0; i < p.n && turn == 0; ++i)
                once[i] = p.x[i], p.b[i] *= 1024, p.x[i] = 0;
        }
        for (size_t i = 0; i < p.n; ++i) assert_true(p.x[i] == 1024 * once[i]);
        assert_int_equal(info[0].iterations, info[1].iterations);
        om_free(once);
        problem_done(&p);
    }
}

// Eleven right-hand sides of very different size, one zero, with prescribed values, guesses in some.
static void many_together_match_one_by_one(void** state) {
    (void)state;
    Elastic el = elastic_tissue();
    Problem p;
    enum { NRHS = 11 };
    problem_init(&p, beam_size(), 12, 4, 4, &el, NRHS);
    for (int i = 0; i < p.mesh.nvert; i += 9) p.fixed[3 * i + i % 3] = 1;
    for (size_t q = 0; q < NRHS; ++q)
        for (size_t i = 0; i < p.n; ++i)
            p.b[q * p.n + i] *= q == 2 ? 0 : pow(10, 3.0 * (double)q - 12);
    double* start = om_calloc(NRHS * p.n, sizeof(double));
    double* ref = om_calloc(NRHS * p.n, sizeof(double));
    for (size_t k = 0; k < NRHS * p.n; ++k) {
        bool has_guess = k / p.n == 5, has_prescribed = k / p.n > 6;
        start[k] = p.fixed[k % p.n] ? (has_prescribed ? 1e-3 : 0) : (has_guess ? 1e-4 : 0);
    }
    for (int k = 0; k < 2; ++k) {
        OmSolverDef def = solver_def(kinds[k], 1e-8, 2);
        OmSolveInfo info;
        OmSolver* one = make_solver(&p, kinds[k], 1e-8, 1);
        memcpy(ref, start, NRHS * p.n * sizeof(double));
        assert_ok(om_solver_solve(one, &p.A, NRHS, p.b, ref, &info));
        uint64_t first = 0;
        for (int nworker = 1; nworker <= 3; ++nworker) {
            OmSolver* S;
            def.max_rhs = 8;
            def.nworker = nworker;
            assert_ok(om_solver_create(&def, &p.A, p.mesh.x, &S));
            om_solver_set_fixed(S, p.fixed);
            assert_ok(om_solver_refresh(S, &p.A));
            memcpy(p.x, start, NRHS * p.n * sizeof(double));
            assert_ok(om_solver_solve(S, &p.A, NRHS, p.b, p.x, &info));
            assert_true(info.residual <= 1e-8);
            for (size_t q = 0; q < NRHS; ++q) {
                if (q == 2)
                    for (size_t i = 0; i < p.n; ++i) assert_true(p.x[q * p.n + i] == 0.0);
                else  // both to 1e-8, times the condition number, about 1e3
                    assert_below(max_difference(p.x + q * p.n, ref + q * p.n, p.n), 1e-5);
            }
            uint64_t hash = om_hash(p.x, NRHS * p.n * sizeof(double), OM_HASH_SEED);
            if (nworker == 1) first = hash;
            assert_true(hash == first);
            // A bad number in the last one: none changes.
            double keep = p.b[NRHS * p.n - 1];
            p.b[NRHS * p.n - 1] = (double)NAN;
            memcpy(p.x, start, NRHS * p.n * sizeof(double));
            assert_status(om_solver_solve(S, &p.A, NRHS, p.b, p.x, &info), OM_INVALID);
            assert_true(memcmp(p.x, start, NRHS * p.n * sizeof(double)) == 0);
            p.b[NRHS * p.n - 1] = keep;
            om_solver_destroy(S);
        }
        om_solver_destroy(one);
    }
    om_free(start);
    om_free(ref);
    problem_done(&p);
}

static void reported_residual_is_true(void** state) {
    (void)state;
    Elastic el = elastic_tissue();
    Problem p;
    problem_init(&p, beam_size(), 16, 5, 5, &el, 1);
    double* y = om_alloc(p.n, sizeof(double));
    for (int k = 0; k < 6; ++k) {
        OmSolverDef def = solver_def(kinds[k % 2], k < 2 ? 0 : k < 4 ? 1e-3 : 1e-8, 2);
        if (k < 2) def.max_iterations = 5;
        OmSolver* S;
        assert_ok(om_solver_create(&def, &p.A, p.mesh.x, &S));
        om_solver_set_fixed(S, p.fixed);
        assert_ok(om_solver_refresh(S, &p.A));
        memset(p.x, 0, p.n * sizeof(double));
        OmSolveInfo info;
        assert_ok(om_solver_solve(S, &p.A, 1, p.b, p.x, &info));
        om_bsr_apply(&p.A, 1, p.x, y);
        double rr = 0, bb = 0;
        for (size_t i = 0; i < p.n; ++i) {
            if (p.fixed[i]) continue;
            rr += (p.b[i] - y[i]) * (p.b[i] - y[i]);
            bb += p.b[i] * p.b[i];
        }
        assert_near_rel(info.residual, sqrt(rr / bb), 1e-6);  // sums in another order
        if (k < 2)
            assert_int_equal(info.iterations, 5);
        else
            assert_true(info.residual <= def.tolerance);
        om_solver_destroy(S);
    }
    om_free(y);
    problem_done(&p);
}

static void same_bytes_with_any_workers(void** state) {
    (void)state;
    Elastic el = elastic_tissue();
    Problem p;
    problem_init(&p, beam_size(), 19, 6, 6, &el, 1);
    for (int k = 0; k < 2; ++k) {
        uint64_t first = 0;
        for (int nworker = 1; nworker <= 8; nworker += nworker < 3 ? 1 : 5) {
            OmSolver* S = make_solver(&p, kinds[k], 1e-2, nworker);
            for (size_t i = 0; i < p.n; ++i) p.x[i] = p.fixed[i] ? 1e-4 * (double)(i % 7) : 0.0;
            assert_ok(om_solver_solve(S, &p.A, 1, p.b, p.x, NULL));
            uint64_t hash = om_hash(p.x, p.n * sizeof(double), OM_HASH_SEED);
            if (nworker == 1) first = hash;
            assert_true(hash == first);
            // And again with the same solver.
            for (size_t i = 0; i < p.n; ++i) p.x[i] = p.fixed[i] ? 1e-4 * (double)(i % 7) : 0.0;
            assert_ok(om_solver_refresh(S, &p.A));
            assert_ok(om_solver_solve(S, &p.A, 1, p.b, p.x, NULL));
            assert_true(om_hash(p.x, p.n * sizeof(double), OM_HASH_SEED) == first);
            om_solver_destroy(S);
        }
    }
    problem_done(&p);
}

static void indefinite_matrices_are_refused(void** state) {
    (void)state;
    Elastic el = elastic_tissue();
    Problem p;
    problem_init(&p, beam_size(), 6, 3, 3, &el, 1);
    for (int k = 0; k < 3; ++k) {
        OmSolverDef def = solver_def(kinds[k], 1e-6, 1);
        OmSolver* S;
        assert_ok(om_solver_create(&def, &p.A, p.mesh.x, &S));
        // A diagonal block that is not positive definite.
        assemble_elastic(&p.mesh, &el, &p.A);
        om_bsr_add(&p.A, p.A.row_adr[40], om_mat3_diag(om_vec3(0, -1, 0)));
        assert_status(om_solver_refresh(S, &p.A), OM_NOT_SPD);
        assert_status(om_solver_solve(S, &p.A, 1, p.b, p.x, NULL), OM_INVALID);
        // Blocks that are, in a matrix that is not: off-diagonal blocks blown up.
        assemble_elastic(&p.mesh, &el, &p.A);
        for (int e = 0; e < 18 * p.A.nedge; ++e) p.A.value[9 * p.A.edge_adr[e / 9] + e % 9] *= 4.0f;
        for (size_t i = 0; i < p.n; ++i) p.x[i] = 0.25;
        OmStatus status = om_solver_refresh(S, &p.A);
        if (k < 2) {
            assert_int_equal(status, OM_OK);
            status = om_solver_solve(S, &p.A, 1, p.b, p.x, NULL);
        }
        // CG may also end at the limit of what it can do; it must not claim success.
        assert_true(status == OM_NOT_SPD || (k < 2 && status == OM_NOT_CONVERGED));
        // Back to a good matrix.
        assemble_elastic(&p.mesh, &el, &p.A);
        assert_ok(om_solver_refresh(S, &p.A));
        memset(p.x, 0, p.n * sizeof(double));
        assert_ok(om_solver_solve(S, &p.A, 1, p.b, p.x, NULL));
        om_solver_destroy(S);
    }
    problem_done(&p);
}

static void bad_numbers_leave_x_alone(void** state) {
    (void)state;
    Elastic el = elastic_tissue();
    Problem p;
    problem_init(&p, beam_size(), 6, 3, 3, &el, 1);
    for (int k = 0; k < 3; ++k) {
        OmSolver* S = make_solver(&p, kinds[k], 1e-6, 2);
        double keep = p.b[p.n - 1];
        for (int bad = 0; bad < 2; ++bad) {
            p.b[p.n - 1] = bad ? (double)NAN : (double)INFINITY;
            for (size_t i = 0; i < p.n; ++i) p.x[i] = 1e-3;
            assert_status(om_solver_solve(S, &p.A, 1, p.b, p.x, NULL), OM_INVALID);
            for (size_t i = 0; i < p.n; ++i) assert_true(p.x[i] == 1e-3);
        }
        p.b[p.n - 1] = keep;
        p.x[7] = (double)NAN;
        assert_status(om_solver_solve(S, &p.A, 1, p.b, p.x, NULL), OM_INVALID);
        assert_true(p.x[8] == 1e-3);
        // A matrix with a NaN on and off the diagonal.
        for (int off = 0; off < 2; ++off) {
            assemble_elastic(&p.mesh, &el, &p.A);
            int k0 = off ? p.A.edge_adr[200] : p.A.row_adr[30];
            int k1 = off ? p.A.edge_adr[201] : k0;
            p.A.value[9 * k0 + 4] = p.A.value[9 * k1 + 4] = NAN;
            for (size_t i = 0; i < p.n; ++i) p.x[i] = p.fixed[i] ? 0 : 1e-3;
            OmStatus status = om_solver_refresh(S, &p.A);
            if (status == OM_OK) status = om_solver_solve(S, &p.A, 1, p.b, p.x, NULL);
            assert_int_equal(status, OM_INVALID);
            assert_true(p.x[p.n - 1] == 1e-3);
        }
        assemble_elastic(&p.mesh, &el, &p.A);
        om_solver_destroy(S);
    }
    problem_done(&p);
}

static void nothing_to_do(void** state) {
    (void)state;
    Elastic el = elastic_tissue();
    Problem p;
    problem_init(&p, beam_size(), 6, 3, 3, &el, 1);
    for (int k = 0; k < 3; ++k) {
        OmSolver* S = make_solver(&p, kinds[k], 1e-6, 2);
        OmSolveInfo info;
        // Zero right-hand side: x is zero at once, even from another guess.
        memset(p.b, 0, p.n * sizeof(double));
        for (size_t i = 0; i < p.n; ++i) p.x[i] = p.fixed[i] ? 0 : 1;
        assert_ok(om_solver_solve(S, &p.A, 1, p.b, p.x, &info));
        assert_int_equal(info.iterations, 0);
        for (size_t i = 0; i < p.n; ++i) assert_true(p.x[i] == 0.0);
        // Everything prescribed.
        unsigned char* all = om_alloc(p.n, 1);
        memset(all, 1, p.n);
        om_solver_set_fixed(S, all);
        assert_status(om_solver_solve(S, &p.A, 1, p.b, p.x, &info), OM_INVALID);  // not refreshed
        assert_ok(om_solver_refresh(S, &p.A));
        for (size_t i = 0; i < p.n; ++i) p.x[i] = 2;
        assert_ok(om_solver_solve(S, &p.A, 1, p.b, p.x, &info));
        for (size_t i = 0; i < p.n; ++i) assert_true(p.x[i] == 2.0);
        // Nothing prescribed, and tiny numbers: the mass holds the body.
        om_solver_set_fixed(S, NULL);
        assert_ok(om_solver_refresh(S, &p.A));
        for (size_t i = 0; i < p.n; ++i) {
            p.b[i] = 1e-30 * (double)(i % 11);
            p.x[i] = 0;
        }
        assert_ok(om_solver_solve(S, &p.A, 1, p.b, p.x, &info));
        assert_true(info.residual <= 1e-6);
        om_free(all);
        om_solver_destroy(S);
    }
    problem_done(&p);
}

static void limits_are_reported(void** state) {
    (void)state;
    Elastic el = elastic_tissue();
    Problem p;
    problem_init(&p, beam_size(), 16, 5, 5, &el, 1);
    OmSolverDef def = solver_def(OM_BLOCK_JACOBI, 1e-6, 1);
    def.max_iterations = 7;
    OmSolver* S;
    OmSolveInfo info;
    assert_ok(om_solver_create(&def, &p.A, NULL, &S));
    assert_ok(om_solver_refresh(S, &p.A));
    assert_status(om_solver_solve(S, &p.A, 1, p.b, p.x, &info), OM_NOT_CONVERGED);
    assert_int_equal(info.iterations, 7);
    assert_true(info.residual > 1e-6);
    assert_status(om_solver_solve(S, &p.A, 0, p.b, p.x, &info), OM_INVALID);
    om_solver_destroy(S);
    om_solver_destroy(NULL);

    OmSolverDef raw = {0};
    assert_status(om_solver_create(&raw, &p.A, NULL, &S), OM_INVALID);
    assert_null(S);
    def.preconditioner = OM_MULTIGRID;
    assert_status(om_solver_create(&def, &p.A, NULL, &S), OM_INVALID);
    p.mesh.x[5] = (double)NAN;
    assert_status(om_solver_create(&def, &p.A, p.mesh.x, &S), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "vertex 1"));
    def.preconditioner = OM_BLOCK_JACOBI;
    def.max_rhs = 9;
    assert_status(om_solver_create(&def, &p.A, NULL, &S), OM_INVALID);
    problem_done(&p);
}

// ---- memory -----------------------------------------------------------------------------------------

static int allowed;  // allocations until one fails

static void* failing_alloc(void* ctx, size_t size, size_t align) {
    (void)ctx;
    if (allowed-- <= 0) return NULL;
    return aligned_alloc(align, (size + align - 1) / align * align);
}

static void failing_free(void* ctx, void* ptr) {
    (void)ctx;
    free(ptr);
}

static void every_allocation_may_fail(void** state) {
    (void)state;
    const OmAllocator allocator = {failing_alloc, failing_free, NULL};
    om_allocator_set(&allocator);
    allowed = 1 << 30;
    Elastic el = elastic_tissue();
    Problem p;
    problem_init(&p, beam_size(), 12, 4, 4, &el, 1);
    int64_t alive = om_alloc_alive();
    for (int k = 0; k < 3; ++k) {
        OmSolverDef def = solver_def(kinds[k], 1e-6, 1);
        OmStatus status = OM_NO_MEMORY;
        int count = 0;
        for (; status != OM_OK; ++count) {
            OmSolver* S;
            OmBsr A;
            allowed = count;
            status = om_bsr_create(p.mesh.nvert, p.mesh.ntet, 4, p.mesh.tet_vert, &A);
            if (status == OM_OK) status = om_solver_create(&def, &A, p.mesh.x, &S);
            assert_true(status == OM_OK || status == OM_NO_MEMORY);
            if (status == OM_OK) om_solver_destroy(S);
            om_bsr_destroy(&A);
            assert_int_equal(om_alloc_alive(), alive);
        }
        assert_true(count > 8);
    }
    allowed = 1 << 30;
    problem_done(&p);
    om_allocator_set(NULL);
}

static void solving_allocates_nothing(void** state) {
    (void)state;
    Elastic el = elastic_tissue();
    Problem p;
    problem_init(&p, beam_size(), 12, 4, 4, &el, 2);
    for (int k = 0; k < 3; ++k) {
        OmSolver* S = make_solver(&p, kinds[k], 1e-6, 2);
        int64_t count = om_alloc_count();
        om_solver_set_fixed(S, NULL);
        assert_ok(om_solver_refresh(S, &p.A));
        assert_ok(om_solver_solve(S, &p.A, 2, p.b, p.x, NULL));
        assert_int_equal(om_alloc_count(), count);
        assert_true(om_solver_memory(S) > 3 * p.n);
        om_solver_destroy(S);
    }
    problem_done(&p);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(all_match_a_dense_solve),
                                       cmocka_unit_test(solutions_are_linear),
                                       cmocka_unit_test(many_together_match_one_by_one),
                                       cmocka_unit_test(reported_residual_is_true),
                                       cmocka_unit_test(same_bytes_with_any_workers),
                                       cmocka_unit_test(indefinite_matrices_are_refused),
                                       cmocka_unit_test(bad_numbers_leave_x_alone),
                                       cmocka_unit_test(nothing_to_do),
                                       cmocka_unit_test(limits_are_reported),
                                       cmocka_unit_test(every_allocation_may_fail),
                                       cmocka_unit_test(solving_allocates_nothing)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
