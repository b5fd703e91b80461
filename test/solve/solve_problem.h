// solve_problem.h: a box with prescribed vertices and right-hand sides, for the tests of `solve`.
#ifndef OMENTUM_SOLVE_PROBLEM_H
#define OMENTUM_SOLVE_PROBLEM_H

#include "solve/solve_common.h"
#include "test_common.h"

typedef struct Problem {
    OmTetMesh mesh;
    OmBsr A;
    size_t n;  // degrees of freedom
    int nrhs;
    unsigned char* fixed;
    double *b, *x;
} Problem;

// The face x = 0 is prescribed; the right-hand sides are random.
static inline void problem_init(Problem* p, OmVec3 size, int nx, int ny, int nz, const Elastic* el,
                                int nrhs) {
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), size, nx, ny, nz, &p->mesh));
    assert_ok(om_bsr_create(p->mesh.nvert, p->mesh.ntet, 4, p->mesh.tet_vert, &p->A));
    assemble_elastic(&p->mesh, el, &p->A);
    p->n = 3 * (size_t)p->mesh.nvert;
    p->nrhs = nrhs;
    p->fixed = om_calloc(p->n, 1);
    p->b = om_calloc(p->n * (size_t)nrhs, sizeof(double));
    p->x = om_calloc(p->n * (size_t)nrhs, sizeof(double));
    OmRng rng = om_rng_init(7, 0);
    for (size_t k = 0; k < p->n; ++k) p->fixed[k] = om_load3(p->mesh.x, (int)(k / 3)).x < 1e-9;
    for (size_t k = 0; k < p->n * (size_t)nrhs; ++k) p->b[k] = om_rng_range(&rng, -1, 1) * 1e-5;
}

static inline void problem_done(Problem* p) {
    om_tet_mesh_done(&p->mesh);
    om_bsr_destroy(&p->A);
    om_free(p->fixed);
    om_free(p->b);
    om_free(p->x);
}

static inline OmVec3 beam_size(void) { return om_vec3(0.1, 0.03, 0.03); }

// The far end pulled sideways: the load of the lift scene.
static inline void pull_end(Problem* p) {
    OmVec3 hi = om_load3(p->mesh.x, p->mesh.nvert - 1);
    for (int i = 0; i < p->mesh.nvert; ++i)
        om_store3(p->b, i, om_vec3(0, 0, om_load3(p->mesh.x, i).x > hi.x - 1e-9 ? 1e-3 : 0));
}

static inline OmSolverDef solver_def(OmPreconditioner kind, double tolerance, int nworker) {
    OmSolverDef def = om_solver_default_def();
    def.preconditioner = kind;
    def.tolerance = tolerance;
    def.max_iterations = 3000;
    def.nworker = nworker;
    return def;
}

static inline OmSolver* make_solver(const Problem* p, OmPreconditioner kind, double tolerance,
                                    int nworker) {
    OmSolverDef def = solver_def(kind, tolerance, nworker);
    OmSolver* S;
    assert_ok(om_solver_create(&def, &p->A, p->mesh.x, &S));
    om_solver_set_fixed(S, p->fixed);
    assert_ok(om_solver_refresh(S, &p->A));
    return S;
}

/// max |a - b| / max |b|
static inline double max_difference(const double* a, const double* b, size_t n) {
    double d = 0, s = 0;
    for (size_t i = 0; i < n; ++i) {
        d = fmax(d, fabs(a[i] - b[i]));
        s = fmax(s, fabs(b[i]));
    }
    return d / s;
}

// Entry by entry, for dense references.
static inline double* dense_matrix(const OmBsr* A) {
    size_t n = 3 * (size_t)A->nvert;
    double* D = om_calloc(n * n, sizeof(double));
    for (int i = 0; i < A->nvert; ++i)
        for (int k = A->row_adr[i]; k < A->row_adr[i + 1]; ++k)
            for (size_t r = 0; r < 3; ++r)
                for (size_t c = 0; c < 3; ++c)
                    D[(3 * (size_t)i + r) * n + 3 * (size_t)A->col[k] + c] =
                        (double)A->value[9 * (size_t)k + 3 * c + r];
    return D;
}

#endif
