// fem_grid_linear.c: prescribed displacements of a patch by linear elasticity.
//
// The nodes of a patch have prescribed displacements u_P, fixed nodes have none, all others are free of load. With C
// the compliance (columns of K^-1 for forces on the surface),
//
//     C_PP f = u_P,   u = C_:P f
//
// A solve costs a dense system of three times the patch's nodes and a sum of as many columns of C; C is computed once.
// It does not depend on Young's modulus. Its columns are kept in float: 90 MB for the phantom (2,866 nodes, 882 on the
// surface), so a solve takes the time to read its columns from memory. C_PP is read along columns, u is computed in
// blocks of rows.
#include <math.h>
#include <string.h>

#include "base/base_multiversion.h"
#include "fem/fem_grid_internal.h"

#define NBLOCK \
    64  // right-hand sides solved together; 24: 3.3 s for the phantom, 192: 3.2 s, 64: 2.9 s
#define MAX_BYTES ((size_t)2 << 30)
#define SHIFT 1e-6     // times the mean diagonal of C_PP is added to it: the rounding of floats
#define MAX_SIDE 3072  // unknowns of a patch
#define GRAIN 1024     // rows of u made together

struct OmFemGridLinear {
    int nnode, nsurface;
    int* surface;     // number of a surface node, or -1                  (nnode)
    float* response;  // m per unit of force              (3 nsurface x 3 nnode)
};

void om_fem_grid_linear_destroy(OmFemGridLinear* l) {
    if (!l) return;
    om_free(l->surface);
    om_free(l->response);
    om_free(l);
}

// ---- the compliance ---------------------------------------------------------------------------------

typedef struct Factor {
    OmFemSolid* solid;
    OmBsr K;
    OmSolver* solver;
    unsigned char* fixed;  //                                              (nnode x 3)
} Factor;

static void destroy_factor(Factor* f) {
    om_solver_destroy(f->solver);
    om_bsr_destroy(&f->K);
    om_fem_destroy(f->solid);
    om_free(f->fixed);
}

static OmStatus make_factor(const OmFemGrid* g, double poisson, int nworker, Factor* f) {
    // this modulus makes compliances of the order of one
    OmMaterial material = {.law = OM_LINEAR, .young = 1 / g->grid.spacing, .poisson = poisson};
    OmFemDef def = om_fem_default_def(&g->mesh, 1, &material);
    OmStatus status = OM_OK;
    int nfixed = 0;
    def.nworker = nworker;
    OM_TRY_DONE(om_fem_create(&def, &f->solid));
    OM_TRY_DONE(om_fem_matrix_create(f->solid, &f->K));
    OM_TRY_DONE(om_fem_eval_tangent(f->solid, g->mesh.x, &f->K));
    OM_ALLOC_DONE(f->fixed, 3 * (size_t)g->mesh.nnode);
    for (int i = 0; i < g->mesh.nnode; ++i) {
        memset(f->fixed + 3 * (size_t)i, g->fixed[i], 3);
        nfixed += g->fixed[i];
    }
    OM_CHECK_DONE(nfixed > 0, OM_INVALID, "grid: no node is fixed");
    OmSolverDef how = om_solver_default_def();
    how.preconditioner = OM_CHOLESKY;
    how.nworker = nworker;
    OM_TRY_DONE(om_solver_create(&how, &f->K, NULL, &f->solver));
    om_solver_set_fixed(f->solver, f->fixed);
    OM_TRY_DONE(om__grid_solved(om_solver_refresh(f->solver, &f->K)));
done:
    return status < 0 ? status : OM_OK;
}

static OmStatus fill_response(const Factor* f, OmFemGridLinear* l) {
    size_t n = 3 * (size_t)l->nnode;
    double *b = NULL, *x = NULL;
    int column[NBLOCK], num = 0, total = 0;
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(b, NBLOCK * n);
    OM_ALLOC_DONE(x, NBLOCK * n);
    for (int dof = 0; dof < 3 * l->nnode; ++dof) {
        if (l->surface[dof / 3] >= 0) column[num++] = dof;
        if (num == 0 || (num < NBLOCK && dof + 1 < 3 * l->nnode)) continue;
        memset(b, 0, (size_t)num * n * sizeof *b);
        memset(x, 0, (size_t)num * n * sizeof *x);
        for (int k = 0; k < num; ++k) b[(size_t)k * n + (size_t)column[k]] = 1;
        OM_TRY_DONE(om__grid_solved(om_solver_solve(f->solver, &f->K, num, b, x, NULL)));
        for (int k = 0; k < num; ++k, ++total)
            for (size_t i = 0; i < n; ++i)
                l->response[(size_t)total * n + i] = (float)x[(size_t)k * n + i];
        num = 0;
    }
done:
    om_free(b);
    om_free(x);
    return status < 0 ? status : OM_OK;
}

OmStatus om_fem_grid_linear_create(const OmFemGrid* g, const unsigned char* is_surface,
                                   double poisson, int nworker, OmFemGridLinear** out) {
    *out = NULL;
    OM_TRY(om__grid_check_poisson(poisson));
    Factor f = {0};
    OmStatus status = OM_OK;
    OmFemGridLinear* l = om_calloc(1, sizeof *l);
    if (!l) return OM_NO_MEMORY;
    l->nnode = g->mesh.nnode;
    OM_ALLOC_DONE(l->surface, l->nnode);
    for (int i = 0; i < l->nnode; ++i) l->surface[i] = is_surface[i] ? l->nsurface++ : -1;
    size_t size = 9 * (size_t)l->nsurface * (size_t)l->nnode;
    OM_CHECK_DONE(
        size * sizeof(float) <= MAX_BYTES, OM_INVALID,
        "grid: the linear response of %d nodes, %d of them on the surface, needs %.1f GB; the limit "
        "is 2 GB: use fewer elements",
        l->nnode, l->nsurface, (double)size * sizeof(float) / 1e9);
    OM_ALLOC_DONE(l->response, size ? size : 1);
    OM_TRY_DONE(make_factor(g, poisson, nworker, &f));
    OM_TRY_DONE(fill_response(&f, l));
done:
    destroy_factor(&f);
    if (status < 0)
        om_fem_grid_linear_destroy(l);
    else
        *out = l;
    return status;
}

// ---- solves --------------------------------------------------------------------------------------

// A = L L^T in place (lower triangle by rows), with inverted pivots. A pivot that is not positive becomes 0, which
// leaves out its unknown.
static void factor_dense(double* A, int n) {
    for (int i = 0; i < n; ++i) {
        double* row = A + (size_t)i * (size_t)n;
        for (int j = 0; j <= i; ++j) {
            const double* other = A + (size_t)j * (size_t)n;
            double sum = row[j];
            for (int k = 0; k < j; ++k) sum -= row[k] * other[k];
            row[j] = j < i ? sum * other[j] : sum > 0 ? 1 / sqrt(sum) : 0;
        }
    }
}

static void solve_dense(const double* A, int n, double* x) {
    for (int i = 0; i < n; ++i) {
        const double* row = A + (size_t)i * (size_t)n;
        double sum = x[i];
        for (int k = 0; k < i; ++k) sum -= row[k] * x[k];
        x[i] = sum * row[i];
    }
    for (int i = n - 1; i >= 0; --i) {
        x[i] *= A[(size_t)i * (size_t)n + (size_t)i];
        for (int k = 0; k < i; ++k) x[k] -= A[(size_t)i * (size_t)n + (size_t)k] * x[i];
    }
}

OmStatus om_fem_grid_patch_init(const OmFemGridLinear* l, const unsigned char* mask,
                                OmFemGridPatch* p) {
    size_t n = 3 * (size_t)l->nnode;
    int num = 0;
    OmStatus status = OM_OK;
    *p = (OmFemGridPatch){0};
    for (int i = 0; i < l->nnode; ++i) num += mask[i] && l->surface[i] >= 0 ? 3 : 0;
    if (num == 0 || num > MAX_SIDE) return OM_OK;  // an empty patch: u = 0
    OM_ALLOC_DONE(p->factor, (size_t)num * (size_t)num);
    OM_ALLOC_DONE(p->column, num);
    OM_ALLOC_DONE(p->dof, num);
    for (int i = 0; i < l->nnode; ++i)
        for (int c = 0; c < 3 && mask[i] && l->surface[i] >= 0; ++c, ++p->num) {
            p->column[p->num] = l->response + (3 * (size_t)l->surface[i] + (size_t)c) * n;
            p->dof[p->num] = 3 * i + c;
        }
    double mean = 0;
    for (int i = 0; i < num; ++i) mean += (double)p->column[i][p->dof[i]] / num;
    for (int i = 0; i < num; ++i)
        for (int j = 0; j <= i; ++j)
            p->factor[(size_t)i * (size_t)num + (size_t)j] =
                (double)p->column[i][p->dof[j]] + (i == j ? SHIFT * mean : 0);
    factor_dense(p->factor, num);
done:
    if (status < 0) om_fem_grid_patch_done(p);
    return status;
}

void om_fem_grid_patch_done(OmFemGridPatch* p) {
    om_free(p->factor);
    om_free((void*)p->column);
    om_free(p->dof);
    *p = (OmFemGridPatch){0};
}

void om__grid_patch_solve(const OmFemGridPatch* p, const float* u, double* scale) {
    for (int k = 0; k < p->num; ++k) scale[k] = (double)u[p->dof[k]];
    solve_dense(p->factor, p->num, scale);
}

// Four columns at once: `out` is read and written a quarter as often.
OM_MULTIVERSION void om__grid_patch_add(const OmFemGridPatch* p, const double* scale, double sign,
                                        float* out, int begin, int end) {
    int k = 0;
    for (; k + 4 <= p->num; k += 4) {
        const float *a = p->column[k], *b = p->column[k + 1];
        const float *c = p->column[k + 2], *d = p->column[k + 3];
        const float sa = (float)(sign * scale[k]), sb = (float)(sign * scale[k + 1]);
        const float sc = (float)(sign * scale[k + 2]), sd = (float)(sign * scale[k + 3]);
        for (int i = begin; i < end; ++i)
            out[i] += (sa * a[i] + sb * b[i]) + (sc * c[i] + sd * d[i]);
    }
    for (; k < p->num; ++k) {
        const float* a = p->column[k];
        const float sa = (float)(sign * scale[k]);
        for (int i = begin; i < end; ++i) out[i] += sa * a[i];
    }
}

typedef struct Sum {
    const OmFemGridPatch* patch;
    const double* scale;
    float* out;
} Sum;

static void sum_rows(void* ctx, int begin, int end, int block) {
    const Sum* s = ctx;
    (void)block;
    om__grid_patch_add(s->patch, s->scale, 1, s->out, begin, end);
}

OmStatus om_fem_grid_linear_eval(const OmFemGridLinear* l, const OmFemGridPatch* p, const float* u,
                                 int nworker, float* out) {
    int n = 3 * l->nnode;
    double* scale;
    memset(out, 0, (size_t)n * sizeof *out);
    OM_ALLOC(scale, p->num ? p->num : 1);
    om__grid_patch_solve(p, u, scale);
    Sum sum = {p, scale, out};
    om_parallel_for(nworker, n, GRAIN, sum_rows, &sum);
    om_free(scale);
    return OM_OK;
}

OmStatus om_fem_grid_linear_solve(const OmFemGridLinear* l, const unsigned char* mask,
                                  const float* u, int nworker, float* out) {
    OmFemGridPatch p;
    OM_TRY(om_fem_grid_patch_init(l, mask, &p));
    OmStatus status = om_fem_grid_linear_eval(l, &p, u, nworker, out);
    om_fem_grid_patch_done(&p);
    return status;
}
