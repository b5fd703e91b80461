// solve_gmres.c: GMRES for an unsymmetric matrix, with a symmetric solver as preconditioner.
//
// Flexible GMRES (Saad 1993), restarted: both the basis v_j and the preconditioned vectors z_j are stored, so that
// the preconditioner may be a solve by CG to a coarse tolerance, which is a different operator each time.
#include <math.h>
#include <string.h>

#include "solve/solve_internal.h"

#define NBASIS 30     // vectors until a restart
#define NRESTART 20   // at most
#define INNER 0.1     // tolerance of the symmetric solves
#define STALLED 0.99  // a cycle that leaves more than this fraction of the residual is the last

typedef struct Gmres {
    OmSolver* S;
    const OmBsr *A, *B;
    const double* b;
    size_t n;
    double *v, *z, *w;  // basis ((NBASIS + 1) x n), preconditioned (NBASIS x n), work (n)
    const double* x;    // input of the current product
    double* y;          // its output
    int iterations;     // of CG
} Gmres;

static double dot(const double* a, const double* b, size_t n) {
    double sum = 0;
    for (size_t i = 0; i < n; ++i) sum += a[i] * b[i];
    return sum;
}

static void product_rows(void* ctx, int begin, int end, int block) {
    (void)block;
    const Gmres* g = ctx;
    const OmBsr* B = g->B;
    for (int i = begin; i < end; ++i) {
        for (size_t r = 0; r < 3; ++r) {
            double y = 0;
            for (int k = B->row_adr[i]; k < B->row_adr[i + 1]; ++k) {
                const double* x = g->x + 3 * (size_t)B->col[k];
                for (size_t c = 0; c < 3; ++c) {
                    size_t at = 9 * (size_t)k + 3 * c + r;
                    y += (B->exact ? B->exact[at] : (double)B->value[at]) * x[c];
                }
            }
            size_t n = 3 * (size_t)i + r;
            g->y[n] = g->S->fixed[n] ? 0 : y;
        }
    }
}

// y = B x at free degrees of freedom.
static void multiply(Gmres* g, const double* x, double* y) {
    g->x = x;
    g->y = y;
    om_parallel_for(g->S->def.nworker, g->S->nvert, 64, product_rows, g);
}

// r = b - B x at free degrees of freedom; its norm.
static double residual(Gmres* g, const double* x, double* r) {
    multiply(g, x, r);
    for (size_t i = 0; i < g->n; ++i) r[i] = g->S->fixed[i] ? 0 : g->b[i] - r[i];
    return sqrt(dot(r, r, g->n));
}

// One cycle from v[0] of norm beta; improves x.
static OmStatus run_cycle(Gmres* g, double beta, double target, double* x) {
    double H[NBASIS + 1][NBASIS], cs[NBASIS], sn[NBASIS], rhs[NBASIS + 1] = {beta}, y[NBASIS];
    int num = 0;
    for (size_t i = 0; i < g->n; ++i) g->v[i] /= beta;
    while (num < NBASIS && fabs(rhs[num]) > target) {
        int j = num;
        double *v = g->v + (size_t)j * g->n, *z = g->z + (size_t)j * g->n, *w = v + g->n;
        OmSolveInfo inner;
        memset(z, 0, g->n * sizeof *z);
        OmStatus status = om_solver_solve(g->S, g->A, 1, v, z, &inner);
        if (status < 0 || status == OM_NOT_SPD) return status;
        g->iterations += inner.iterations;
        multiply(g, z, w);
        for (int i = 0; i <= j; ++i) {
            const double* vi = g->v + (size_t)i * g->n;
            H[i][j] = dot(vi, w, g->n);
            for (size_t k = 0; k < g->n; ++k) w[k] -= H[i][j] * vi[k];
        }
        double norm = sqrt(dot(w, w, g->n));
        OM_CHECK(isfinite(norm), OM_INVALID, "GMRES: the matrix has a value that is not finite");
        for (size_t k = 0; k < g->n && norm > 0; ++k) w[k] /= norm;
        for (int i = 0; i < j; ++i) {  // the rotations before, then one that clears `norm`
            double a = H[i][j], b = H[i + 1][j];
            H[i][j] = cs[i] * a + sn[i] * b;
            H[i + 1][j] = cs[i] * b - sn[i] * a;
        }
        double size = hypot(H[j][j], norm);
        if (!(size > 0)) break;  // z adds nothing
        cs[j] = H[j][j] / size;
        sn[j] = norm / size;
        H[j][j] = size;
        rhs[j + 1] = -sn[j] * rhs[j];
        rhs[j] *= cs[j];
        ++num;
        if (norm == 0) break;  // solved exactly
    }
    for (int i = num - 1; i >= 0; --i) {
        y[i] = rhs[i];
        for (int j = i + 1; j < num; ++j) y[i] -= H[i][j] * y[j];
        y[i] /= H[i][i];  // > 0: a size
    }
    for (int j = 0; j < num; ++j)
        for (size_t i = 0; i < g->n; ++i) x[i] += y[j] * g->z[(size_t)j * g->n + i];
    return OM_OK;
}

static OmStatus run(Gmres* g, double tolerance, double* x, double* ratio) {
    for (size_t i = 0; i < g->n; ++i) x[i] = g->S->fixed[i] ? x[i] : 0;
    double scale = residual(g, x, g->v), norm = scale, last = INFINITY;
    OM_CHECK(isfinite(scale), OM_INVALID, "GMRES: the right-hand side or the matrix is not finite");
    for (int cycle = 0; cycle < NRESTART && norm > tolerance * scale && norm < STALLED * last;
         ++cycle) {
        last = norm;
        memcpy(g->w, x, g->n * sizeof *x);
        OM_TRY(run_cycle(g, norm, 0.9 * tolerance * scale, x));
        norm = residual(g, x, g->v);
        if (norm < last) continue;
        memcpy(x, g->w, g->n * sizeof *x);  // the best iterate
        norm = last;
    }
    *ratio = scale > 0 ? norm / scale : 0;
    return OM_OK;
}

OmStatus om_solver_solve_gmres(OmSolver* S, const OmBsr* A, const OmBsr* B, double tolerance,
                               const double* b, double* x, OmSolveInfo* info) {
    if (info) *info = (OmSolveInfo){0};
    OM_CHECK(A->nvert == S->nvert && B->nvert == S->nvert && B->nblock == A->nblock, OM_INVALID,
             "om_solver_solve_gmres: the matrices have not one pattern");
    OM_CHECK(!A->ties && !B->ties, OM_UNAVAILABLE, "GMRES: the matrix has ties");
    OM_CHECK(tolerance > 0 && tolerance < 1, OM_INVALID,
             "om_solver_solve_gmres: the tolerance is %g, must be in (0, 1)", tolerance);
    size_t n = 3 * (size_t)S->nvert;
    Gmres g = {.S = S, .A = A, .B = B, .b = b, .n = n};
    OmStatus status = OM_OK;
    double before = S->tolerance, reference = S->reference, ratio = 0;
    OM_ALLOC_DONE(g.v, (NBASIS + 1) * n);
    OM_ALLOC_DONE(g.z, NBASIS * n);
    OM_ALLOC_DONE(g.w, 2 * n);
    memcpy(g.w + n, x, n * sizeof *x);
    S->tolerance = INNER;
    S->reference = 0;
    status = run(&g, tolerance, x, &ratio);
    S->tolerance = before;
    S->reference = reference;
    if (status != OM_OK) memcpy(x, g.w + n, n * sizeof *x);
    if (info) *info = (OmSolveInfo){.iterations = g.iterations, .residual = ratio};
    if (status == OM_OK && ratio > tolerance)
        status = om_error(OM_NOT_CONVERGED, "GMRES: residual %.3g, wanted %.3g", ratio, tolerance);
done:
    om_free(g.v);
    om_free(g.z);
    om_free(g.w);
    return status;
}
