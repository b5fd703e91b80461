// test_solve_tie.c: terms outside the pattern against the same terms inside a larger pattern, solved with factors.
#include "solve/solve_problem.h"

enum { NX = 12, NY = 6, NTIE = 60 };

typedef struct Pair {  // two boxes, one above the other, with ties between their faces
    Problem p;
    OmTies* ties;
    OmBsr all;  // pattern of elements and ties, with the values of both
} Pair;

static void add_to_all(Pair* t, const int v[4], const double w[4], OmMat3 K) {
    for (int a = 0; a < 4; ++a)
        for (int b = 0; b < 4; ++b)
            om_bsr_add(&t->all, om_bsr_find(&t->all, v[a], v[b]), om_mat3_scale(w[a] * w[b], K));
}

// A box of two layers of cells; the vertices of its upper half are moved up, so that it is two boxes.
static void pair_init(Pair* t, double stiffness, int nrhs) {
    Elastic el = elastic_tissue();
    OmTetMesh box, *mesh = &t->p.mesh;
    *t = (Pair){0};
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.12, 0.06, 0.005), NX, NY, 1, &box));
    int n = box.nvert, ntet = box.ntet;
    *mesh = (OmTetMesh){.nvert = 2 * n, .ntet = 2 * ntet};
    mesh->x = om_calloc(6 * (size_t)n, sizeof(double));
    mesh->tet_vert = om_calloc(8 * (size_t)ntet, sizeof(int));
    for (int i = 0; i < 2 * n; ++i)
        om_store3(mesh->x, i, om_add(om_load3(box.x, i % n), om_vec3(0, 0, i < n ? 0 : 0.0052)));
    for (int k = 0; k < 8 * ntet; ++k)
        mesh->tet_vert[k] = box.tet_vert[k % (4 * ntet)] + (k < 4 * ntet ? 0 : n);
    assert_ok(om_bsr_create(mesh->nvert, mesh->ntet, 4, mesh->tet_vert, &t->p.A));
    assemble_elastic(mesh, &el, &t->p.A);
    t->p.n = 6 * (size_t)n;
    t->p.nrhs = nrhs;
    t->p.fixed = om_calloc(t->p.n, 1);
    t->p.b = om_calloc(t->p.n * (size_t)nrhs, sizeof(double));
    t->p.x = om_calloc(t->p.n * (size_t)nrhs, sizeof(double));
    OmRng rng = om_rng_init(7, 0);
    for (size_t k = 0; k < t->p.n; ++k)
        t->p.fixed[k] = (int)(k / 3) < n && om_load3(mesh->x, (int)(k / 3)).x < 1e-9;
    for (size_t k = 0; k < t->p.n * (size_t)nrhs; ++k) t->p.b[k] = om_rng_range(&rng, -1, 1) * 1e-5;

    // a vertex of the upper box's bottom against a triangle of the lower box's top, moved by a random amount
    int vert[NTIE][4], *elem = om_alloc((size_t)(2 * ntet + NTIE) * 4, sizeof(int));
    double weight[NTIE][4];
    OmMat3 K[NTIE];
    int row = NX + 1, top = row * (NY + 1);
    for (int k = 0; k < NTIE; ++k) {
        int i = (int)om_rng_range(&rng, 1, NX - 0.01), j = (int)om_rng_range(&rng, 0, NY - 0.01);
        int v = top + i + row * j;
        double b = om_rng_range(&rng, 0.05, 0.45), c = om_rng_range(&rng, 0.05, 0.45);
        const int corner[4] = {n + i + row * j, v, v + 1, v + row};
        const double w[4] = {1, -b, -c, b + c - 1};
        OmVec3 dir =
            om_normalize(om_vec3(om_rng_range(&rng, -0.3, 0.3), om_rng_range(&rng, -0.3, 0.3), 1));
        memcpy(vert[k], corner, sizeof corner);
        memcpy(weight[k], w, sizeof w);
        double own = (double)t->p.A.value[9 * (size_t)t->p.A.row_adr[corner[0]]];
        K[k] = om_mat3_scale(stiffness * own, om_mat3_outer(dir, dir));
    }
    memcpy(elem, mesh->tet_vert, 4 * (size_t)mesh->ntet * sizeof(int));
    memcpy(elem + 4 * (size_t)mesh->ntet, vert, sizeof vert);
    assert_ok(om_bsr_create(mesh->nvert, mesh->ntet + NTIE, 4, elem, &t->all));
    assemble_elastic(mesh, &el, &t->all);
    assert_ok(om_ties_create(mesh->nvert, &t->ties));
    for (int k = 0; k < NTIE; ++k) {
        add_to_all(t, vert[k], weight[k], K[k]);
        assert_ok(om_ties_add(t->ties, 4, vert[k], weight[k], K[k]));
    }
    assert_ok(om_ties_sum(t->ties));
    assert_int_equal(om_ties_count(t->ties), NTIE);
    t->p.A.ties = t->ties;
    om_free(elem);
    om_tet_mesh_done(&box);
}

static void pair_done(Pair* t) {
    om_ties_destroy(t->ties);
    om_bsr_destroy(&t->all);
    problem_done(&t->p);
}

static void product_is_that_of_all_blocks(void** state) {
    (void)state;
    Pair t;
    pair_init(&t, 30, 1);
    double *y = om_calloc(t.p.n, sizeof *y), *z = om_calloc(t.p.n, sizeof *z);
    for (int nworker = 1; nworker <= 3; ++nworker) {
        om_bsr_apply(&t.p.A, nworker, t.p.b, y);
        om_bsr_apply(&t.all, nworker, t.p.b, z);
        assert_below(max_difference(y, z, t.p.n), 1e-6);
    }
    om_free(y);
    om_free(z);
    pair_done(&t);
}

// Every preconditioner of CG, one and eight right-hand sides, against factors of the matrix with all blocks.
static void solutions_are_those_of_factors(void** state) {
    (void)state;
    for (int nrhs = 1; nrhs <= 3; nrhs += 2) {
        Pair t;
        pair_init(&t, 100, nrhs);
        OmSolverDef def = solver_def(OM_CHOLESKY, 1e-10, 1);
        OmSolver* S;
        assert_ok(om_solver_create(&def, &t.all, NULL, &S));
        om_solver_set_fixed(S, t.p.fixed);
        assert_ok(om_solver_refresh(S, &t.all));
        double* exact = om_calloc(t.p.n * (size_t)nrhs, sizeof *exact);
        assert_ok(om_solver_solve(S, &t.all, nrhs, t.p.b, exact, NULL));
        om_solver_destroy(S);
        for (int kind = OM_BLOCK_JACOBI; kind <= OM_MULTIGRID; ++kind) {
            def = solver_def((OmPreconditioner)kind, 1e-8, 2);
            def.max_rhs = nrhs;
            OmSolveInfo info;
            assert_ok(om_solver_create(&def, &t.p.A, t.p.mesh.x, &S));
            om_solver_set_fixed(S, t.p.fixed);
            assert_ok(om_solver_refresh(S, &t.p.A));
            memset(t.p.x, 0, t.p.n * (size_t)nrhs * sizeof *t.p.x);
            assert_ok(om_solver_solve(S, &t.p.A, nrhs, t.p.b, t.p.x, &info));
            assert_below(max_difference(t.p.x, exact, t.p.n * (size_t)nrhs),
                         1e-4);  // blocks are rounded apart
            om_solver_destroy(S);
        }
        om_free(exact);
        pair_done(&t);
    }
}

// Iterations to 1e-3 of multigrid: with ties in matrices of their own, and with them in a larger pattern.
static void ties_cost_few_iterations(void** state) {
    (void)state;
    const double stiffness[3] = {1, 100, 1000};
    for (int n = 0; n < 3; ++n) {
        Pair t;
        pair_init(&t, stiffness[n], 1);
        OmSolverDef def = solver_def(OM_MULTIGRID, 1e-3, 1);
        OmSolveInfo info[3];
        for (int k = 0; k < 3; ++k) {  // without ties, as ties, in the pattern
            const OmBsr* A = k < 2 ? &t.p.A : &t.all;
            OmSolver* S;
            t.p.A.ties = k == 1 ? t.ties : NULL;
            assert_ok(om_solver_create(&def, A, t.p.mesh.x, &S));
            om_solver_set_fixed(S, t.p.fixed);
            assert_ok(om_solver_refresh(S, A));
            memset(t.p.x, 0, t.p.n * sizeof *t.p.x);
            assert_ok(om_solver_solve(S, A, 1, t.p.b, t.p.x, &info[k]));
            om_solver_destroy(S);
        }
        printf("stiffness %g: %d iterations without ties, %d with them, %d in the pattern\n",
               stiffness[n], info[0].iterations, info[1].iterations, info[2].iterations);
        assert_below(info[1].iterations, 1.1 * info[2].iterations + 3);
        pair_done(&t);
    }
}

// Same bytes for any number of workers; ties may be taken away and come back.
static void workers_give_the_same_bytes(void** state) {
    (void)state;
    Pair t;
    pair_init(&t, 100, 1);
    double* first = om_calloc(t.p.n, sizeof *first);
    for (int nworker = 1; nworker <= 8; nworker *= 2) {
        OmSolver* S = make_solver(&t.p, OM_MULTIGRID, 1e-6, nworker);
        t.p.A.ties = NULL;
        assert_ok(om_solver_refresh(S, &t.p.A));
        assert_ok(om_solver_solve(S, &t.p.A, 1, t.p.b, t.p.x, NULL));
        t.p.A.ties = t.ties;
        assert_ok(om_solver_refresh(S, &t.p.A));
        memset(t.p.x, 0, t.p.n * sizeof *t.p.x);
        assert_ok(om_solver_solve(S, &t.p.A, 1, t.p.b, t.p.x, NULL));
        if (nworker == 1) memcpy(first, t.p.x, t.p.n * sizeof *first);
        assert_memory_equal(first, t.p.x, t.p.n * sizeof *first);
        om_solver_destroy(S);
    }
    om_free(first);
    pair_done(&t);
}

static void factors_refuse_ties(void** state) {
    (void)state;
    Pair t;
    pair_init(&t, 100, 1);
    OmSolverDef def = solver_def(OM_CHOLESKY, 1e-10, 1);
    OmSolver* S;
    OmTies* none;
    const int bad[1] = {-1};
    const double one[1] = {1};
    assert_ok(om_solver_create(&def, &t.p.A, NULL, &S));
    assert_status(om_solver_refresh(S, &t.p.A), OM_UNAVAILABLE);
    om_solver_destroy(S);
    assert_status(om_ties_add(t.ties, 1, bad, one, om_mat3_identity()), OM_INVALID);
    assert_status(om_ties_create(-1, &none), OM_INVALID);
    pair_done(&t);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(product_is_that_of_all_blocks),
        cmocka_unit_test(solutions_are_those_of_factors),
        cmocka_unit_test(ties_cost_few_iterations),
        cmocka_unit_test(workers_give_the_same_bytes),
        cmocka_unit_test(factors_refuse_ties),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
