// test_solve_cg.c: block-Jacobi CG and Cholesky against a dense factor and against each other.
#include "solve/solve_common.h"
#include "test_common.h"

typedef struct Problem {  // a clamped box
    OmTetMesh mesh;
    OmBsr A;
    unsigned char* fixed;
    double *b, *x;
} Problem;

static void problem_init(Problem* p, int nx, int ny, int nz, const Elastic* el, int nrhs) {
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.1, 0.03, 0.03), nx, ny, nz, &p->mesh));
    assert_ok(om_bsr_create(p->mesh.nvert, p->mesh.ntet, 4, p->mesh.tet_vert, &p->A));
    assemble_elastic(&p->mesh, el, &p->A);
    size_t n = 3 * (size_t)p->mesh.nvert;
    p->fixed = om_calloc(n, 1);
    p->b = om_calloc(n * (size_t)nrhs, sizeof(double));
    p->x = om_calloc(n * (size_t)nrhs, sizeof(double));
    OmRng rng = om_rng_init(7, 0);
    for (size_t k = 0; k < n; ++k) p->fixed[k] = om_load3(p->mesh.x, (int)(k / 3)).x < 1e-9;
    for (size_t k = 0; k < n * (size_t)nrhs; ++k) p->b[k] = om_rng_range(&rng, -1, 1) * 1e-5;
}

static void problem_done(Problem* p) {
    om_tet_mesh_done(&p->mesh);
    om_bsr_destroy(&p->A);
    om_free(p->fixed);
    om_free(p->b);
    om_free(p->x);
}

static OmSolver* make_solver(const Problem* p, OmPreconditioner kind, double tolerance,
                             int nworker) {
    OmSolverDef def = om_solver_default_def();
    def.preconditioner = kind;
    def.tolerance = tolerance;
    def.max_iterations = 2000;
    def.nworker = nworker;
    OmSolver* S;
    assert_ok(om_solver_create(&def, &p->A, p->mesh.x, &S));
    om_solver_set_fixed(S, p->fixed);
    assert_ok(om_solver_refresh(S, &p->A));
    return S;
}

static double max_difference(const double* a, const double* b, size_t n) {
    double d = 0, s = 0;
    for (size_t i = 0; i < n; ++i) {
        d = fmax(d, fabs(a[i] - b[i]));
        s = fmax(s, fabs(b[i]));
    }
    return d / s;
}

static void cg_matches_cholesky(void** state) {
    (void)state;
    Elastic el = elastic_tissue();
    Problem p;
    problem_init(&p, 10, 3, 3, &el, 1);
    size_t n = 3 * (size_t)p.mesh.nvert;
    double* ref = om_calloc(n, sizeof(double));
    // Prescribed values that are not zero.
    for (size_t k = 0; k < n; ++k)
        if (p.fixed[k]) ref[k] = p.x[k] = 1e-3 * (double)(k % 5);
    OmSolver* chol = make_solver(&p, OM_CHOLESKY, 1e-3, 1);
    OmSolveInfo info;
    assert_ok(om_solver_solve(chol, &p.A, 1, p.b, ref, &info));
    assert_below(info.residual, 1e-12 * test_tol_scale());
    OmSolver* cg = make_solver(&p, OM_BLOCK_JACOBI, 1e-9, 2);
    assert_ok(om_solver_solve(cg, &p.A, 1, p.b, p.x, &info));
    assert_below(info.residual, 1e-9);
    // The condition number of this system is about 1e3.
    assert_below(max_difference(p.x, ref, n), 1e-6 * test_tol_scale());
    om_solver_destroy(chol);
    om_solver_destroy(cg);
    om_free(ref);
    problem_done(&p);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(cg_matches_cholesky)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
