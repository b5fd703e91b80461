// solve_solver.c: creation and use of a solver: definition, work vectors, prescribed degrees of
// freedom, diagonal blocks.
#include <math.h>
#include <string.h>

#include "solve/solve_internal.h"

#define COOKIE 0x50f7e501u
#define MIN_CHUNK_ROWS 48  // shorter chunks cost more in sums than they gain in balance
#define MAX_REFINE 4       // refinements of a direct solve
#define MAX_CHUNKS 64      // every worker adds all partial sums at every iteration

OmSolverDef om_solver_default_def(void) {
    return (OmSolverDef){.preconditioner = OM_MULTIGRID,
                         .max_iterations = 200,
                         .tolerance = 1e-3,
                         .nworker = 0,
                         .max_rhs = 1,
                         .row_bound = 4,
                         .cookie = COOKIE};
}

static OmStatus check_def(const OmSolverDef* def, const OmBsr* A, const double* x_rest) {
    OM_CHECK(def->cookie == COOKIE, OM_INVALID,
             "OmSolverDef was not made by om_solver_default_def");
    OM_CHECK(A && A->nvert > 0, OM_INVALID, "om_solver_create: the matrix has no rows");
    OM_CHECK(def->preconditioner >= OM_BLOCK_JACOBI && def->preconditioner <= OM_LU, OM_INVALID,
             "OmSolverDef.preconditioner = %d is none of OmPreconditioner",
             (int)def->preconditioner);
    OM_CHECK(def->max_iterations >= 1, OM_INVALID,
             "OmSolverDef.max_iterations = %d, must be at least 1", def->max_iterations);
    OM_CHECK(def->tolerance >= 0.0 && def->tolerance < 1.0, OM_INVALID,
             "OmSolverDef.tolerance = %g, must be in [0, 1)", def->tolerance);
    OM_CHECK(def->nworker >= 0, OM_INVALID, "OmSolverDef.nworker = %d, must not be negative",
             def->nworker);
    OM_CHECK(def->max_rhs >= 1 && def->max_rhs <= 8, OM_INVALID,
             "OmSolverDef.max_rhs = %d, must be in 1..8", def->max_rhs);
    OM_CHECK(def->row_bound >= 1 && def->row_bound <= 1000, OM_INVALID,
             "OmSolverDef.row_bound = %g, must be in 1..1000", def->row_bound);
    if (def->preconditioner != OM_MULTIGRID) return OM_OK;
    OM_CHECK(x_rest, OM_INVALID, "the multigrid preconditioner needs vertex positions (x_rest)");
    for (size_t n = 0; n < 3 * (size_t)A->nvert; ++n)
        OM_CHECK(isfinite(x_rest[n]), OM_INVALID, "position of vertex %d is not finite",
                 (int)(n / 3));
    return OM_OK;
}

// ---- create and destroy -----------------------------------------------------------------------------

// Allocate memory that counts as the solver's.
static void* take(OmSolver* S, size_t count, size_t size) {
    void* p = om_calloc(count, size);
    if (p) S->memory += count * size;
    return p;
}

// Cut the rows into chunks of about equal numbers of blocks.
static OmStatus cut_chunks(OmSolver* S, const OmBsr* A) {
    int num = S->nvert / MIN_CHUNK_ROWS;
    num = num < 1 ? 1 : num > MAX_CHUNKS ? MAX_CHUNKS : num;
    S->chunks.begin = take(S, (size_t)num + 1, sizeof(int));
    if (!S->chunks.begin) return OM_NO_MEMORY;
    S->chunks.num = num;
    int row = 0;
    for (int k = 0; k < num; ++k) {
        int64_t first = (int64_t)A->nblock * k / num;
        while (row < S->nvert && A->row_adr[row] < first) ++row;
        S->chunks.begin[k] = row;
    }
    S->chunks.begin[num] = S->nvert;
    return OM_OK;
}

static OmStatus take_vectors(OmSolver* S) {
    size_t n = (size_t)S->nvert, num = (size_t)S->chunks.num;
    S->fixed = take(S, 3 * n, 1);
    S->fixed_vert = take(S, n, sizeof(int));
    S->chunk_fixed = take(S, num + 1, sizeof(int));
    size_t lanes = (size_t)S->max_lane, width = lanes > 1 ? 3 * lanes : 4;
    S->xd = take(S, 3 * n * lanes, sizeof(double));
    S->rd = take(S, 3 * n * lanes, sizeof(double));
    if (!S->fixed || !S->fixed_vert || !S->chunk_fixed || !S->xd || !S->rd) return OM_NO_MEMORY;
    if (S->def.preconditioner >= OM_CHOLESKY) return OM_OK;
    S->free_mask = take(S, 4 * n, sizeof(float));
    S->dinv = take(S, 9 * n + 3, sizeof(float));
    S->partial = take(S, (3 * lanes + 2) * num, sizeof(double));
    size_t stride = (width * n + 15) / 16 * 16;
    S->vector = take(S, 6 * stride, sizeof(float));
    if (!S->vector) return OM_NO_MEMORY;
    float** vector[] = {&S->r, &S->u, &S->w, &S->p, &S->s, &S->x};
    for (size_t k = 0; k < 6; ++k) *vector[k] = S->vector + k * stride;
    return S->free_mask && S->dinv && S->partial ? OM_OK : OM_NO_MEMORY;
}

OmStatus om_solver_create(const OmSolverDef* def, const OmBsr* A, const double* x_rest,
                          OmSolver** solver) {
    *solver = NULL;
    OM_TRY(check_def(def, A, x_rest));
    OmSolver* S = om_calloc(1, sizeof *S);
    if (!S) return OM_NO_MEMORY;
    OmStatus status = OM_OK;
    S->memory = sizeof *S;
    S->def = *def;
    S->tolerance = def->tolerance;
    S->nvert = A->nvert;
    S->nblock = A->nblock;
    S->max_lane = def->max_rhs > 1 && def->preconditioner < OM_CHOLESKY ? OM_MAX_LANE : 1;
    OM_TRY_DONE(cut_chunks(S, A));
    OM_TRY_DONE(take_vectors(S));
    if (def->preconditioner == OM_CHOLESKY)
        OM_TRY_DONE(om__cholesky_create(A, def->nworker == 1, &S->cholesky));
    if (def->preconditioner == OM_LU) OM_TRY_DONE(om__lu_create(A, &S->lu));
    if (def->preconditioner == OM_MULTIGRID)
        OM_TRY_DONE(om__multigrid_create(A, x_rest, om_worker_count(def->nworker),
                                         S->max_lane > 1 ? 24 : 4, def->row_bound, &S->multigrid,
                                         &S->memory));
    *solver = S;
done:
    if (status < 0) om_solver_destroy(S);
    return status;
}

void om_solver_destroy(OmSolver* S) {
    if (!S) return;
    om__cholesky_destroy(S->cholesky);
    om__lu_destroy(S->lu);
    om__multigrid_destroy(S->multigrid);
    om_free(S->chunks.begin);
    om_free(S->fixed);
    om_free(S->fixed_vert);
    om_free(S->chunk_fixed);
    om_free(S->free_mask);
    om_free(S->dinv);
    om_free(S->xd);
    om_free(S->rd);
    om_free(S->partial);
    om_free(S->vector);
    om_free(S);
}

size_t om_solver_memory(const OmSolver* S) { return S->memory; }

// ---- refresh ----------------------------------------------------------------------------------------

void om_solver_set_reference(OmSolver* S, double norm) {
    S->reference = norm > 0.0 && isfinite(norm) ? norm : 0.0;
}

void om_solver_set_tolerance(OmSolver* S, double tolerance) {
    S->tolerance = tolerance > 0.0 && tolerance < 1.0 ? tolerance : S->def.tolerance;
}

void om_solver_set_fixed(OmSolver* S, const unsigned char* fixed) {
    for (size_t n = 0; n < 3 * (size_t)S->nvert; ++n) S->fixed[n] = fixed && fixed[n] ? 1 : 0;
    S->is_ready = false;
    S->nfixed_vert = 0;
    for (int k = 0; k < S->chunks.num; ++k) {
        S->chunk_fixed[k] = S->nfixed_vert;
        for (int i = S->chunks.begin[k]; i < S->chunks.begin[k + 1]; ++i) {
            const unsigned char* f = S->fixed + 3 * (size_t)i;
            if (!(f[0] || f[1] || f[2])) continue;
            if (S->free_mask)
                for (size_t c = 0; c < 3; ++c)
                    S->free_mask[4 * (size_t)S->nfixed_vert + c] = f[c] ? 0.0f : 1.0f;
            S->fixed_vert[S->nfixed_vert++] = i;
        }
    }
    S->chunk_fixed[S->chunks.num] = S->nfixed_vert;
    if (S->multigrid) om__multigrid_set_fixed(S->multigrid, S->fixed);
}

bool om__invert_block(const float* v, const unsigned char* fixed, float* out) {
    double a[3][3];
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
            a[r][c] = fixed[r] || fixed[c] ? (r == c ? 1.0 : 0.0) : (double)v[3 * c + r];
    double c00 = a[1][1] * a[2][2] - a[1][2] * a[2][1];
    double c01 = a[1][2] * a[2][0] - a[1][0] * a[2][2];
    double c02 = a[1][0] * a[2][1] - a[1][1] * a[2][0];
    double det = a[0][0] * c00 + a[0][1] * c01 + a[0][2] * c02;
    double minor = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    bool is_spd = a[0][0] > 0.0 && minor > 0.0 && det > 0.0;
    double s = is_spd ? 1.0 / det : 0.0;
    double inv[3][3] = {
        {c00, c01, c02},
        {c01, a[0][0] * a[2][2] - a[0][2] * a[2][0], a[0][1] * a[2][0] - a[0][0] * a[2][1]},
        {c02, a[0][1] * a[2][0] - a[0][0] * a[2][1], minor}};
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
            out[3 * c + r] = fixed[r] || fixed[c] ? 0.0f : (float)(s * inv[r][c]);
    return is_spd;
}

typedef struct Refresh {
    OmSolver* S;
    const OmBsr* A;
} Refresh;

static void invert_chunk(void* ctx, int begin, int end, int block) {
    (void)end, (void)block;
    const Refresh* f = ctx;
    OmSolver* S = f->S;
    double bad = 0;  // 1: not positive definite, 2: not finite
    for (int i = S->chunks.begin[begin]; i < S->chunks.begin[begin + 1]; ++i) {
        const float* v = f->A->value + 9 * (size_t)f->A->row_adr[i];
        const float* tie = f->A->ties ? om__ties_diagonal(f->A->ties, i) : NULL;
        float both[9];
        for (int c = 0; c < 9 && tie; ++c) both[c] = v[c] + tie[c];
        if (tie) v = both;
        if (om__invert_block(v, S->fixed + 3 * (size_t)i, S->dinv + 9 * (size_t)i)) continue;
        float sum = 0;
        for (int c = 0; c < 9; ++c) sum += v[c] * 0.0f;
        bad = fmax(bad, sum == 0.0f ? 1 : 2);
    }
    S->partial[begin] = bad;
}

static OmStatus invert_diagonal(OmSolver* S, const OmBsr* A) {
    Refresh f = {S, A};
    om_parallel_for(S->def.nworker, S->chunks.num, 1, invert_chunk, &f);
    double bad = 0;
    for (int k = 0; k < S->chunks.num; ++k) bad = fmax(bad, S->partial[k]);
    OM_CHECK(bad < 2, OM_INVALID, "om_solver_refresh: a diagonal block is not finite");
    OM_CHECK(bad < 1, OM_NOT_SPD, "om_solver_refresh: a diagonal block is not positive definite");
    return OM_OK;
}

static OmStatus refresh(OmSolver* S, const OmBsr* A, bool is_whole) {
    S->is_ready = false;
    OM_CHECK(
        A->nvert == S->nvert && A->nblock == S->nblock, OM_INVALID,
        "om_solver_refresh: the matrix has %d rows and %d blocks, the solver was made for %d and %d",
        A->nvert, A->nblock, S->nvert, S->nblock);
    OM_CHECK(!A->ties || (!S->cholesky && !S->lu), OM_UNAVAILABLE,
             "om_solver_refresh: the matrix has ties, which need a preconditioner of CG");
    OM_TRY(om_stop_poll());
    OmStatus status = S->cholesky ? om__cholesky_refresh(S->cholesky, A, S->fixed)
                      : S->lu     ? om__lu_refresh(S->lu, A, S->fixed)
                                  : invert_diagonal(S, A);
    if (status == OM_OK && S->multigrid && is_whole)
        status = om__multigrid_refresh(S->multigrid, A, S->def.nworker);
    S->is_ready = status == OM_OK;
    return status;
}

OmStatus om_solver_refresh(OmSolver* S, const OmBsr* A) { return refresh(S, A, true); }

int om_solver_sign(const OmSolver* S) { return S->lu && S->is_ready ? om__lu_sign(S->lu) : 0; }

OmStatus om_solver_refresh_diagonal(OmSolver* S, const OmBsr* A) {
    return refresh(S, A, !S->is_ready);
}

// ---- solve ------------------------------------------------------------------------------------------

static bool is_finite_system(const OmSolver* S, int nrhs, const double* b, const double* x) {
    size_t n = 3 * (size_t)S->nvert;
    for (int k = 0; k < nrhs; ++k)
        for (size_t i = 0; i < n; ++i)
            if (!isfinite(x[n * (size_t)k + i]) ||
                (!S->fixed[i] && !isfinite(b[n * (size_t)k + i])))
                return false;
    return true;
}

// rd = b - A xd and its norm, with the values that were factored.
static double serial_residual(OmSolver* S, const OmBsr* A, const double* b) {
    double sum = 0;
    for (int k = 0; k < S->chunks.num && !A->exact; ++k) {
        double rr;
        om__kernels_one.residual(S, A, b, 1, k, &rr);
        if (A->ties) om__ties_residual(A->ties, S, 1, k, &rr);
        sum += rr;
    }
    for (int i = 0; i < S->nvert && A->exact; ++i) {
        double y[3] = {0, 0, 0};
        for (int k = A->row_adr[i]; k < A->row_adr[i + 1]; ++k) {
            const double *a = A->exact + 9 * (size_t)k, *x = S->xd + 3 * (size_t)A->col[k];
            for (int r = 0; r < 3; ++r) y[r] += a[r] * x[0] + a[r + 3] * x[1] + a[r + 6] * x[2];
        }
        for (size_t r = 0; r < 3; ++r) {
            size_t n = 3 * (size_t)i + r;
            S->rd[n] = S->fixed[n] ? 0 : b[n] - y[r];
            sum += S->rd[n] * S->rd[n];
        }
    }
    return sqrt(sum);
}

static OmStatus solve_factors(OmSolver* S, int nrhs, double* b) {
    return S->lu ? om__lu_solve(S->lu, nrhs, b) : om__cholesky_solve(S->cholesky, nrhs, b);
}

// The residual where all free unknowns are 0, and the fixed ones as in x; without prescribed values it is b.
static double start_residual(OmSolver* S, const OmBsr* A, const double* b, const double* x) {
    size_t n = 3 * (size_t)S->nvert;
    bool is_zero = true;
    double sum = 0;
    for (size_t i = 0; i < n; ++i) {
        S->xd[i] = S->fixed[i] ? x[i] : 0.0;
        is_zero = is_zero && S->xd[i] == 0.0;
    }
    if (!is_zero) return serial_residual(S, A, b);
    for (size_t i = 0; i < n; ++i) {
        S->rd[i] = S->fixed[i] ? 0.0 : b[i];
        sum += S->rd[i] * S->rd[i];
    }
    return sqrt(sum);
}

// Residual of a direct solve; if it is too large, corrections are added as long as they reduce it.
static OmStatus refine_direct(OmSolver* S, const OmBsr* A, const double* b, double* x,
                              double* residual) {
    size_t n = 3 * (size_t)S->nvert;
    double scale = start_residual(S, A, b, x), last = INFINITY;
    for (int turn = 0; turn < MAX_REFINE; ++turn) {
        for (size_t i = 0; i < n; ++i) S->xd[i] = x[i];
        if (turn > 0) {  // rd holds the residual of x
            OM_TRY(solve_factors(S, 1, S->rd));
            for (size_t i = 0; i < n; ++i) S->xd[i] += S->fixed[i] ? 0.0 : S->rd[i];
        }
        double norm = serial_residual(S, A, b);
        if (turn > 0 && !(norm < last)) break;
        for (size_t i = 0; i < n; ++i) x[i] = S->xd[i];
        last = norm;
        if (norm <= S->tolerance * scale || S->tolerance == 0.0) break;
    }
    *residual = scale > 0.0 ? last / scale : 0.0;
    return OM_OK;
}

// Right-hand sides, with the prescribed values at the rows of the identity, are solved in place in x.
static OmStatus solve_direct(OmSolver* S, const OmBsr* A, int nrhs, const double* b, double* x,
                             OmSolveInfo* info) {
    OM_CHECK(is_finite_system(S, nrhs, b, x), OM_INVALID,
             "solve: the right-hand side or the first guess is not finite");
    size_t n = 3 * (size_t)S->nvert;
    for (int k = 0; k < nrhs; ++k) {
        double* xk = x + n * (size_t)k;
        start_residual(S, A, b + n * (size_t)k, xk);
        for (size_t i = 0; i < n; ++i) xk[i] = S->fixed[i] ? xk[i] : S->rd[i];
    }
    OM_TRY(solve_factors(S, nrhs, x));
    for (int k = 0; k < nrhs; ++k) {
        double residual;
        OM_TRY(refine_direct(S, A, b + n * (size_t)k, x + n * (size_t)k, &residual));
        info->residual = fmax(info->residual, isfinite(residual) ? residual : (double)INFINITY);
    }
    if (info->residual <= S->tolerance || S->tolerance == 0.0) return OM_OK;
    return om_error(OM_NOT_CONVERGED, "solve: the factors leave a residual of %.3g, wanted %.3g",
                    info->residual, S->tolerance);
}

OmStatus om_solver_solve(OmSolver* S, const OmBsr* A, int nrhs, const double* b, double* x,
                         OmSolveInfo* info) {
    OmSolveInfo worst = {0}, one;
    if (info) *info = worst;
    OM_CHECK(S->is_ready, OM_INVALID, "om_solver_solve: the solver was not refreshed");
    OM_CHECK(A->nvert == S->nvert && A->nblock == S->nblock, OM_INVALID,
             "om_solver_solve: another matrix than the one of the refresh");
    OM_CHECK(nrhs >= 1, OM_INVALID, "om_solver_solve: %d right-hand sides", nrhs);
    OM_CHECK(nrhs == 1 || is_finite_system(S, nrhs, b, x), OM_INVALID,
             "solve: a right-hand side or a first guess is not finite");
    OM_TRY(om_stop_poll());
    size_t n = 3 * (size_t)S->nvert;
    OmStatus result = OM_OK;
    bool is_direct = S->cholesky || S->lu;
    for (int k = 0, num; k < nrhs && !is_direct; k += num) {
        num = nrhs - k < S->max_lane ? nrhs - k : S->max_lane;
        OmStatus status = om__cg_solve(S, A, num, b + n * (size_t)k, x + n * (size_t)k, &one);
        OM_TRY(status);
        if (status == OM_NOT_SPD) return status;
        if (status != OM_OK) result = status;
        if (one.iterations > worst.iterations) worst.iterations = one.iterations;
        worst.residual = fmax(worst.residual, one.residual);
    }
    if (is_direct) result = solve_direct(S, A, nrhs, b, x, &worst);
    if (info) *info = worst;
    return result;
}
