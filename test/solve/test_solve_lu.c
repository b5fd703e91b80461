// test_solve_lu.c: matrices that are not symmetric, by factors (UMFPACK) and by GMRES, against a dense solve.
#include "solve/solve_problem.h"

// A + a skew part: block (i, j) gets +-S, entry by entry at random, on the edges near the far end.
static void make_skew(const Problem* p, double size, OmBsr* B) {
    Elastic el = elastic_tissue();
    OmRng rng = om_rng_init(11, 0);
    assert_ok(om_bsr_create(p->mesh.nvert, p->mesh.ntet, 4, p->mesh.tet_vert, B));
    assert_ok(om_bsr_make_exact(B));
    assemble_elastic(&p->mesh, &el, B);
    for (int e = 0; e < B->nedge; ++e) {
        int i = B->edge_vert[2 * e];
        if (om_load3(p->mesh.x, i).x < 0.05) continue;
        double s = size * B->exact[9 * (size_t)B->row_adr[i]];
        OmVec3 a = {s * om_rng_range(&rng, -1, 1), s * om_rng_range(&rng, -1, 1), 0};
        OmMat3 m = om_mat3_outer(a, om_vec3(1, -0.5, 0.3));
        om_bsr_add(B, B->edge_adr[2 * e], m);
        om_bsr_add(B, B->edge_adr[2 * e + 1], om_mat3_scale(-1, om_mat3_transpose(m)));
    }
}

// Gauss elimination with the largest pivot of each column; the sign of the determinant.
static int dense_solve(const Problem* p, const OmBsr* B, double* x) {
    size_t n = p->n;
    double *D = om_calloc(n * n, sizeof *D), *r = om_alloc(n, sizeof *r);
    int sign = 1;
    for (int i = 0; i < B->nvert; ++i)
        for (int k = B->row_adr[i]; k < B->row_adr[i + 1]; ++k)
            for (size_t a = 0; a < 3; ++a)
                for (size_t c = 0; c < 3; ++c)
                    D[(3 * (size_t)i + a) * n + 3 * (size_t)B->col[k] + c] =
                        B->exact[9 * (size_t)k + 3 * c + a];
    for (size_t i = 0; i < n; ++i) {
        r[i] = p->b[i];
        for (size_t j = 0; j < n && p->fixed[i]; ++j) D[i * n + j] = i == j ? 1 : 0;
        if (p->fixed[i]) r[i] = x[i];
    }
    for (size_t k = 0; k < n; ++k) {
        size_t best = k;
        for (size_t i = k; i < n; ++i)
            if (fabs(D[i * n + k]) > fabs(D[best * n + k])) best = i;
        for (size_t j = 0; j < n && best != k; ++j) {
            double keep = D[k * n + j];
            D[k * n + j] = D[best * n + j];
            D[best * n + j] = keep;
        }
        double keep = r[k];
        r[k] = r[best];
        r[best] = best != k ? keep : r[best];
        if ((best != k) != (D[k * n + k] < 0)) sign = -sign;
        for (size_t i = k + 1; i < n; ++i) {
            double f = D[i * n + k] / D[k * n + k];
            for (size_t j = k; j < n && f != 0; ++j) D[i * n + j] -= f * D[k * n + j];
            r[i] -= f * r[k];
        }
    }
    for (size_t k = n; k-- > 0;) {
        for (size_t j = k + 1; j < n; ++j) r[k] -= D[k * n + j] * x[j];
        x[k] = r[k] / D[k * n + k];
    }
    om_free(D);
    om_free(r);
    return sign;
}

static void start(Problem* p) {
    Elastic el = elastic_tissue();
    problem_init(p, beam_size(), 7, 3, 3, &el, 1);
    for (int i = 0; i < p->mesh.nvert; i += 7) p->fixed[3 * i + i % 3] = 1;  // single directions
    for (size_t k = 0; k < p->n; ++k) p->x[k] = p->fixed[k] ? 1e-3 * (double)(k % 5) : 0;
}

static void factors_match_a_dense_solve(void** state) {
    (void)state;
    Problem p;
    start(&p);
    double *ref = om_alloc(p.n, sizeof *ref), *from = om_alloc(p.n, sizeof *from);
    memcpy(from, p.x, p.n * sizeof *from);
    for (int turn = 0; turn < 3; ++turn) {  // symmetric, skew, and with one direction unstable
        OmBsr B;
        OmSolveInfo info;
        make_skew(&p, turn == 1 ? 0.5 : 0, &B);
        if (turn == 2) om_bsr_add(&B, B.row_adr[100], om_mat3_diag(om_vec3(-1, 0, 0)));
        memcpy(ref, from, p.n * sizeof *ref);
        int sign = dense_solve(&p, &B, ref);
        assert_int_equal(sign, turn == 2 ? -1 : 1);
        OmSolverDef def = solver_def(OM_LU, 1e-9, 1);
        OmSolver* S;
        assert_ok(om_solver_create(&def, &B, NULL, &S));
        om_solver_set_fixed(S, p.fixed);
        assert_int_equal(om_solver_sign(S), 0);
        assert_ok(om_solver_refresh(S, &B));
        assert_int_equal(om_solver_sign(S), sign);
        memcpy(p.x, from, p.n * sizeof *from);
        assert_ok(om_solver_solve(S, &B, 1, p.b, p.x, &info));
        assert_below(info.residual, 1e-11);
        assert_below(max_difference(p.x, ref, p.n), 1e-11);  // condition number about 1e3
        om_solver_destroy(S);
        om_bsr_destroy(&B);
    }
    om_free(ref);
    om_free(from);
    problem_done(&p);
}

// |b - B x| over the free directions, in double.
static double residual_of(const Problem* p, const OmBsr* B, const double* x) {
    double sum = 0;
    for (int i = 0; i < B->nvert; ++i)
        for (size_t a = 0; a < 3; ++a) {
            double r = p->b[3 * (size_t)i + a];
            for (int k = B->row_adr[i]; k < B->row_adr[i + 1]; ++k)
                for (size_t c = 0; c < 3; ++c)
                    r -= B->exact[9 * (size_t)k + 3 * c + a] * x[3 * (size_t)B->col[k] + c];
            sum += p->fixed[3 * (size_t)i + a] ? 0 : r * r;
        }
    return sqrt(sum);
}

static void gmres_matches_factors(void** state) {
    (void)state;
    Problem p;
    start(&p);
    double* ref = om_alloc(p.n, sizeof *ref);
    double* from = om_alloc(p.n, sizeof *from);
    memcpy(from, p.x, p.n * sizeof *from);
    for (int turn = 0; turn < 4; ++turn) {
        OmPreconditioner kind[] = {OM_MULTIGRID, OM_BLOCK_JACOBI};
        OmBsr B;
        OmSolveInfo info;
        make_skew(&p, turn < 2 ? 0.1 : 1, &B);
        memcpy(ref, from, p.n * sizeof *ref);
        dense_solve(&p, &B, ref);
        OmSolver* S = make_solver(&p, kind[turn % 2], 1e-3, 2);
        memcpy(p.x, from, p.n * sizeof *from);
        assert_ok(om_solver_solve_gmres(S, &p.A, &B, 1e-10, p.b, p.x, &info));
        print_message("GMRES, skew part %g: %d iterations of CG, residual %.1e\n",
                      turn < 2 ? 0.1 : 1.0, info.iterations, info.residual);
        assert_true(info.residual <= 1e-10);
        // What it says is left is left, beside what there was; the residual itself is rounded to 1e-15 of b.
        assert_near(residual_of(&p, &B, p.x) / residual_of(&p, &B, from), info.residual,
                    0.1 * info.residual + 1e-14);
        assert_below(max_difference(p.x, ref, p.n), 1e-7);
        uint64_t hash = om_hash(p.x, p.n * sizeof *p.x, OM_HASH_SEED);
        om_solver_destroy(S);
        S = make_solver(&p, kind[turn % 2], 1e-3, 1);
        memcpy(p.x, from, p.n * sizeof *from);
        assert_ok(om_solver_solve_gmres(S, &p.A, &B, 1e-10, p.b, p.x, &info));
        assert_true(om_hash(p.x, p.n * sizeof *p.x, OM_HASH_SEED) == hash);
        // Refusals do not change x.
        memcpy(p.x, from, p.n * sizeof *from);
        assert_status(om_solver_solve_gmres(S, &p.A, &B, 0, p.b, p.x, &info), OM_INVALID);
        B.exact[9 * (size_t)B.row_adr[90] + 4] = (double)NAN;
        assert_status(om_solver_solve_gmres(S, &p.A, &B, 1e-3, p.b, p.x, &info), OM_INVALID);
        assert_true(memcmp(p.x, from, p.n * sizeof *from) == 0);
        om_solver_destroy(S);
        om_bsr_destroy(&B);
    }
    om_free(ref);
    om_free(from);
    problem_done(&p);
}

static void singular_matrices_are_refused(void** state) {
    (void)state;
    Problem p;
    start(&p);
    OmBsr B;
    make_skew(&p, 0.5, &B);
    for (int k = B.row_adr[60]; k < B.row_adr[61]; ++k)
        memset(B.exact + 9 * (size_t)k, 0, 9 * sizeof *B.exact);  // a row of zeros
    p.fixed[180] = 0;
    OmSolverDef def = solver_def(OM_LU, 1e-9, 1);
    OmSolver* S;
    assert_ok(om_solver_create(&def, &B, NULL, &S));
    assert_status(om_solver_refresh(S, &B), OM_NOT_SPD);
    assert_status(om_solver_solve(S, &B, 1, p.b, p.x, NULL), OM_INVALID);
    B.exact[0] = (double)NAN;
    assert_status(om_solver_refresh(S, &B), OM_INVALID);
    om_solver_destroy(S);
    om_bsr_destroy(&B);
    problem_done(&p);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(factors_match_a_dense_solve),
                                       cmocka_unit_test(gmres_matches_factors),
                                       cmocka_unit_test(singular_matrices_are_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
