// solve_cg.c: conjugate gradients in float inside iterative refinement in double.
//
// The whole solve runs in one team of threads. An iteration is the single-reduction form of Chronopoulos
// and Gear (1989), two barriers instead of three: s = A p is carried by recurrence, so the only product is
// w = A u with u = M^-1 r. What that and float cost in accuracy is repaired outside: when CG believes it
// has converged, the residual is recomputed in double and CG starts again from it if it was wrong. The
// vectors of CG are scaled by the norm of that residual, so b may have any magnitude.
#include <math.h>

#include "solve/solve_internal.h"

#define INNER_GAIN \
    1e-4  // what float CG is trusted to reduce the residual by before it is recomputed

typedef struct CgJob {
    OmSolver* S;
    const OmBsr* A;
    const double* b;
    double* x;
    OmStatus status;
    OmSolveInfo info;
} CgJob;

typedef struct Member {  // one thread of the team, and what it has to know
    CgJob* job;
    OmTeam* team;
    int begin, end;      // its chunks
    OmRank who;          // its place in the team, and its rows
    bool use_multigrid;  // false: block Jacobi
} Member;

// Sum column c of the chunks' partial results, always in the same order.
static double total(const OmSolver* S, int c) {
    double sum = 0;
    const double* partial = S->partial + c * S->chunks.num;
    for (int k = 0; k < S->chunks.num; ++k) sum += partial[k];
    return sum;
}

// ---- before and after -------------------------------------------------------------------------------

enum { HAS_PRESCRIBED = 0, HAS_GUESS = 1, HAS_BAD = 2 };  // columns of partial in `inspect`

// Copy the prescribed values (and the guess) of x to the iterate; say what there is.
static void inspect(const Member* m, bool with_guess) {
    OmSolver* S = m->job->S;
    const double *x = m->job->x, *b = m->job->b;
    for (int k = m->begin; k < m->end; ++k) {
        double found[3] = {0, 0, 0};
        size_t end = 3 * (size_t)S->chunks.begin[k + 1];
        for (size_t n = 3 * (size_t)S->chunks.begin[k]; n < end; ++n) {
            if (!isfinite(x[n]) || (!S->fixed[n] && !isfinite(b[n]))) found[HAS_BAD] = 1;
            if (x[n] != 0.0) found[S->fixed[n] ? HAS_PRESCRIBED : HAS_GUESS] = 1;
            S->xd[n] = S->fixed[n] || with_guess ? x[n] : 0.0;
        }
        for (int c = 0; c < 3; ++c) S->partial[c * S->chunks.num + k] = found[c];
    }
    om_team_barrier(m->team);
}

// |b - A xd| over the free degrees of freedom; rd holds the residual.
static double residual_norm(const Member* m, bool x_is_zero) {
    const CgJob* job = m->job;
    OmSolver* S = job->S;
    om_team_barrier(m->team);
    for (int k = m->begin; k < m->end; ++k)
        S->partial[k] = om__residual(S, x_is_zero ? NULL : job->A, job->b, S->chunks.begin[k],
                                     S->chunks.begin[k + 1], k);
    om_team_barrier(m->team);
    return sqrt(total(S, 0));
}

// r = rd / scale; x, p and s start at zero.
static void begin_cg(const Member* m, double scale) {
    OmSolver* S = m->job->S;
    double inv = 1.0 / scale;  // scale > 0: the caller stops at a zero residual
    for (int i = S->chunks.begin[m->begin]; i < S->chunks.begin[m->end]; ++i) {
        for (size_t c = 0; c < 4; ++c) {
            size_t n = 4 * (size_t)i + c;
            S->r[n] = c < 3 ? (float)(S->rd[3 * (size_t)i + c] * inv) : 0.0f;
            S->x[n] = S->p[n] = S->s[n] = 0.0f;
        }
    }
}

static void add_correction(const Member* m, double scale) {
    OmSolver* S = m->job->S;
    for (int i = S->chunks.begin[m->begin]; i < S->chunks.begin[m->end]; ++i)
        for (size_t c = 0; c < 3; ++c)
            S->xd[3 * (size_t)i + c] += scale * (double)S->x[4 * (size_t)i + c];
}

// ---- CG ---------------------------------------------------------------------------------------------

// u = M^-1 r
static void precondition(const Member* m) {
    OmSolver* S = m->job->S;
    if (m->use_multigrid)
        om__multigrid_apply(S, m->job->A, &m->who);
    else
        om__apply_blocks(S->dinv, S->r, S->u, m->who.begin, m->who.end);
}

// w = A u with zeros at prescribed rows, and the two sums r.u and u.w.
static void multiply(const Member* m) {
    OmSolver* S = m->job->S;
    for (int k = m->begin; k < m->end; ++k) {
        int begin = S->chunks.begin[k], end = S->chunks.begin[k + 1];
        OmCgSums sums = om__cg_multiply(m->job->A, S->r, S->u, S->w, begin, end);
        for (int f = S->chunk_fixed[k]; f < S->chunk_fixed[k + 1]; ++f)
            for (size_t c = 0; c < 4; ++c)
                S->w[4 * (size_t)S->fixed_vert[f] + c] *= S->free_mask[4 * (size_t)f + c];
        S->partial[k] = sums.ru;  // u is zero where w was cleared
        S->partial[S->chunks.num + k] = sums.uw;
    }
}

typedef enum CgEnd { CG_DONE, CG_INDEFINITE, CG_BROKEN, CG_NOT_FINITE } CgEnd;

// Reduce |r| from 1 to `target` in at most `max_iter` iterations; x is the correction.
static CgEnd run_cg(const Member* m, double target, int max_iter, int* iterations) {
    OmSolver* S = m->job->S;
    double gamma_old = 1, alpha_old = 1;
    int it = 0;
    CgEnd end = CG_DONE;
    precondition(m);
    om_team_barrier(m->team);
    for (; it < max_iter; ++it) {
        multiply(m);
        om_team_barrier(m->team);
        double gamma = total(S, 0), delta = total(S, 1);
        double beta = it > 0 ? gamma / gamma_old : 0.0;  // gamma_old > 0, checked below
        double curvature = delta - (it > 0 ? beta * gamma / alpha_old : 0.0);  // p.A p
        if (!isfinite(gamma) || !isfinite(delta)) {
            end = CG_NOT_FINITE;
            break;
        }
        if (gamma == 0.0) break;
        if (gamma < 0.0 || curvature <= 0.0) {
            end = it == 0 ? CG_INDEFINITE : CG_BROKEN;
            break;
        }
        double alpha = gamma / curvature;
        gamma_old = gamma;
        alpha_old = alpha;
        for (int k = m->begin; k < m->end; ++k)
            S->partial[2 * S->chunks.num + k] =
                om__cg_update(S, (float)alpha, (float)beta, !m->use_multigrid, S->chunks.begin[k],
                              S->chunks.begin[k + 1]);
        if (m->use_multigrid) precondition(m);
        om_team_barrier(m->team);
        if (total(S, 2) <= target * target) {
            ++it;
            break;
        }
    }
    *iterations += it;
    return end;
}

// ---- refinement -------------------------------------------------------------------------------------

// Every member computes the same numbers, so all take the same turns; the first one reports.
static OmStatus solve_member(Member* m, OmSolveInfo* info) {
    const OmSolver* S = m->job->S;
    inspect(m, false);
    bool has_prescribed = total(S, HAS_PRESCRIBED) > 0, has_guess = total(S, HAS_GUESS) > 0;
    if (total(S, HAS_BAD) > 0) return OM_INVALID;
    double scale = residual_norm(m, !has_prescribed), norm = scale;
    if (has_guess && scale > 0.0) {
        om_team_barrier(m->team);
        inspect(m, true);
        norm = residual_norm(m, false);
    }
    if (!isfinite(norm)) return OM_INVALID;  // the matrix is not finite
    double goal = S->def.tolerance * scale;
    bool is_indefinite = false;
    while (norm > goal && norm > 0.0 && info->iterations < S->def.max_iterations) {
        double target = fmax(0.9 * goal / norm, S->def.tolerance > 0 ? INNER_GAIN : 0.0);
        begin_cg(m, norm);
        CgEnd end = run_cg(m, target, S->def.max_iterations - info->iterations, &info->iterations);
        if (end == CG_NOT_FINITE) return OM_INVALID;
        if (end == CG_INDEFINITE) {  // the matrix, or only the preconditioner?
            is_indefinite = !m->use_multigrid;
            if (is_indefinite) break;
            m->use_multigrid = false;
            continue;
        }
        add_correction(m, norm);
        double last = norm;
        norm = residual_norm(m, false);
        if (!isfinite(norm)) return OM_INVALID;
        if (!(norm < 0.9 * last)) break;  // float can do no more
    }
    info->residual = scale > 0.0 ? norm / scale : 0.0;  // zero b: x is zero, and exact
    if (is_indefinite) return OM_NOT_SPD;
    return norm <= goal || S->def.tolerance == 0.0 ? OM_OK : OM_NOT_CONVERGED;
}

static void team_solve(void* ctx, OmTeam* team, int rank, int size) {
    CgJob* job = ctx;
    int n = job->S->chunks.num;
    Member m = {.job = job,
                .team = team,
                .begin = (int)((int64_t)n * rank / size),
                .end = (int)((int64_t)n * (rank + 1) / size),
                .use_multigrid = job->S->multigrid != NULL};
    const int* row = job->S->chunks.begin;
    m.who = (OmRank){team, rank, size, row[m.begin], row[m.end]};
    OmSolveInfo info = {0};
    OmStatus status = solve_member(&m, &info);
    if (rank == 0) {
        job->status = status;
        job->info = info;
    }
    if (status < 0 || status == OM_NOT_SPD) return;
    for (int k = 3 * job->S->chunks.begin[m.begin]; k < 3 * job->S->chunks.begin[m.end]; ++k)
        job->x[k] = job->S->xd[k];
}

OmStatus om__cg_solve(OmSolver* S, const OmBsr* A, const double* b, double* x, OmSolveInfo* info) {
    CgJob job = {.S = S, .A = A, .b = b, .x = x};
    om_parallel_team(S->def.nworker, team_solve, &job);
    *info = job.info;
    if (job.status == OM_INVALID)
        return om_error(OM_INVALID,
                        "solve: the right-hand side, the first guess or the matrix is not finite");
    if (job.status == OM_NOT_SPD)
        return om_error(OM_NOT_SPD, "solve: the matrix is not positive definite");
    if (job.status == OM_NOT_CONVERGED)
        return om_error(OM_NOT_CONVERGED, "solve: residual %.3g after %d iterations, wanted %.3g",
                        job.info.residual, job.info.iterations, S->def.tolerance);
    return job.status;
}
