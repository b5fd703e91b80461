// solve_cg.c: conjugate gradients in float inside iterative refinement in double.
//
// The whole solve runs in one team of threads. An iteration is the single-reduction form of Chronopoulos
// and Gear (1989), two barriers instead of three: s = A p is updated by recurrence, so the only product is
// w = A u with u = M^-1 r. The recurrence and float lose accuracy, which the outer refinement restores:
// when CG seems to have converged, the residual is recomputed in double, and CG restarts from it if it is
// too large. The vectors of CG are scaled by the norm of that residual, so b may have any magnitude.
//
// A correction is kept only if it reduces the residual (or the energy, if the number of iterations is fixed
// and no residual is required). Where float no longer reduces the residual, CG in double continues
// (solve_double.c).
//
// One or eight right-hand sides ("lanes") are solved by the same code with different kernels. Lanes are
// independent: each has its own coefficients, and a converged lane waits for the others.
#include <limits.h>
#include <math.h>

#include "solve/solve_internal.h"

// Largest reduction of the residual by float CG before it is recomputed.
#define INNER_GAIN 1e-4
// A correction that leaves a larger fraction of the residual is the last one in float.
#define LEAST_GAIN 0.9
// This number of iterations in double with block Jacobi counts as one with multigrid. One with multigrid takes as long
// as three of them; eight let a sheet of flat elements converge at the default number of iterations.
#define CYCLE_COUNT 8

typedef struct CgJob {
    const OmKernels* K;
    OmSolver* S;
    const OmBsr* A;
    int nrhs;
    const double* b;
    double* x;
    OmStatus status;
    OmSolveInfo info;
    bool is_stopped;  // written by the first member before a barrier, read by all behind it
} CgJob;

typedef struct Member {  // one thread of the team and its data
    CgJob* job;
    OmTeam* team;
    int begin, end;              // its chunks
    OmRank who;                  // its index in the team, and its rows
    bool use_multigrid;          // false: block Jacobi
    int iterations;              // done so far
    double norm[OM_MAX_LANE];    // of the residual
    double goal[OM_MAX_LANE];    // the required norm
    bool is_open[OM_MAX_LANE];   // needs another round
    bool is_stuck[OM_MAX_LANE];  // not reduced by float
    double along[OM_MAX_LANE];   // the correction times the residual before it, over the norm
} Member;

// ---- before and after -------------------------------------------------------------------------------

enum { HAS_PRESCRIBED = 0, HAS_GUESS = 1, HAS_BAD = 2 };  // columns of partial in `inspect`

// Copy the prescribed values of x to the iterate, and the initial guess of lanes that have one; returns
// flags of the outcome.
static void inspect(const Member* m, const bool* has_guess) {
    const CgJob* job = m->job;
    OmSolver* S = job->S;
    size_t lanes = (size_t)job->K->lanes, stride = 3 * (size_t)S->nvert;
    for (int k = m->begin; k < m->end; ++k) {
        double found[3] = {0, 0, 0};
        size_t end = 3 * (size_t)S->chunks.begin[k + 1];
        for (size_t n = 3 * (size_t)S->chunks.begin[k]; n < end; ++n) {
            for (size_t q = 0; q < (size_t)job->nrhs; ++q) {
                double x = job->x[stride * q + n], b = S->fixed[n] ? 0 : job->b[stride * q + n];
                if (!isfinite(x) || !isfinite(b)) found[HAS_BAD] = 1;
                if (x != 0.0) found[S->fixed[n] ? HAS_PRESCRIBED : HAS_GUESS] = 1;
                S->xd[lanes * n + q] = S->fixed[n] || has_guess[q] ? x : 0.0;
            }
            for (size_t q = (size_t)job->nrhs; q < lanes; ++q) S->xd[lanes * n + q] = 0.0;
        }
        om__put_partial(S, 0, k, found, 3);
    }
    om_team_barrier(m->team);
}

// |b - A xd| over the free degrees of freedom; rd holds the residual. False if it is not finite.
static bool residual_norms(Member* m, bool x_is_zero) {
    const CgJob* job = m->job;
    bool is_finite = true;
    om_team_barrier(m->team);
    for (int k = m->begin; k < m->end; ++k) {
        double rr[OM_MAX_LANE];
        job->K->residual(job->S, x_is_zero ? NULL : job->A, job->b, job->nrhs, k, rr);
        if (job->A->ties && !x_is_zero)
            om__ties_residual(job->A->ties, job->S, job->K->lanes, k, rr);
        om__put_partial(job->S, 0, k, rr, job->K->lanes);
    }
    om_team_barrier(m->team);
    for (int q = 0; q < job->nrhs; ++q) {
        m->norm[q] = sqrt(om__total(job->S, q));
        is_finite = is_finite && isfinite(m->norm[q]);
    }
    return is_finite;
}

// r = rd / norm in open lanes, zero in others; x, p and s start at zero.
static void begin_cg(const Member* m) {
    OmSolver* S = m->job->S;
    size_t lanes = (size_t)m->job->K->lanes, width = (size_t)m->job->K->width;
    double inv[OM_MAX_LANE];
    for (size_t q = 0; q < lanes; ++q) inv[q] = m->is_open[q] ? 1.0 / m->norm[q] : 0.0;
    for (size_t i = (size_t)m->who.begin; i < (size_t)m->who.end; ++i) {
        for (size_t c = 0; c < width; ++c) {
            S->r[width * i + c] = 0;
            S->x[width * i + c] = S->p[width * i + c] = S->s[width * i + c] = 0;
        }
        for (size_t c = 0; c < 3; ++c)
            for (size_t q = 0; q < lanes; ++q)
                S->r[width * i + lanes * c + q] = (float)(S->rd[lanes * (3 * i + c) + q] * inv[q]);
    }
}

// Sums of the correction times the residual, over the norm, of every lane.
static void project_correction(const Member* m) {
    OmSolver* S = m->job->S;
    size_t lanes = (size_t)m->job->K->lanes, width = (size_t)m->job->K->width;
    for (int k = m->begin; k < m->end; ++k) {
        double sum[OM_MAX_LANE] = {0};
        for (size_t i = (size_t)S->chunks.begin[k]; i < (size_t)S->chunks.begin[k + 1]; ++i)
            for (size_t c = 0; c < 3; ++c)
                for (size_t q = 0; q < lanes; ++q)
                    sum[q] +=
                        (double)S->x[width * i + lanes * c + q] * S->rd[lanes * (3 * i + c) + q];
        om__put_partial(S, 2 * (int)lanes, k, sum, (int)lanes);
    }
    om_team_barrier(m->team);
}

// xd += norm x in open lanes. The previous iterate is saved in the first vectors of CG; x is the last of them.
static void add_correction(Member* m) {
    OmSolver* S = m->job->S;
    double* before = (double*)S->vector;
    size_t lanes = (size_t)m->job->K->lanes, width = (size_t)m->job->K->width;
    if (S->tolerance == 0) {
        om_team_barrier(m->team);  // no member reads the partial sums of CG after this
        project_correction(m);
        for (size_t q = 0; q < lanes; ++q) m->along[q] = om__total(S, (int)(2 * lanes + q));
    }
    om_team_barrier(m->team);  // all members have left CG after this
    for (size_t i = (size_t)m->who.begin; i < (size_t)m->who.end; ++i)
        for (size_t c = 0; c < 3; ++c)
            for (size_t q = 0; q < lanes; ++q) {
                size_t at = lanes * (3 * i + c) + q;
                before[at] = S->xd[at];
                if (m->is_open[q])
                    S->xd[at] += m->norm[q] * (double)S->x[width * i + lanes * c + q];
            }
}

// Undo corrections that enlarged the residual; lanes that float has not reduced are stuck.
static void judge_correction(Member* m, const double* last) {
    OmSolver* S = m->job->S;
    const double* before = (const double*)S->vector;
    size_t lanes = (size_t)m->job->K->lanes;
    if (S->tolerance == 0) project_correction(m);
    for (size_t q = 0; q < (size_t)m->job->nrhs; ++q) {
        if (!m->is_open[q] || m->norm[q] < LEAST_GAIN * last[q]) continue;  // also if not a number
        m->is_stuck[q] = true;
        m->is_open[q] = false;
        double fall = 0;  // of the energy x.A x / 2 - b.x
        if (S->tolerance == 0) fall = m->along[q] + om__total(S, (int)(2 * lanes + q));
        if (m->norm[q] < last[q] || fall > 0) continue;
        m->norm[q] = last[q];
        for (size_t n = 3 * (size_t)m->who.begin; n < 3 * (size_t)m->who.end; ++n)
            S->xd[lanes * n + q] = before[lanes * n + q];
    }
    om_team_barrier(m->team);
}

static void give_solution(const Member* m) {
    const CgJob* job = m->job;
    size_t lanes = (size_t)job->K->lanes, stride = 3 * (size_t)job->S->nvert;
    for (size_t q = 0; q < (size_t)job->nrhs; ++q)
        for (size_t n = 3 * (size_t)m->who.begin; n < 3 * (size_t)m->who.end; ++n)
            job->x[stride * q + n] = job->S->xd[lanes * n + q];
}

// ---- CG ---------------------------------------------------------------------------------------------

// u = M^-1 r
static void precondition(Member* m) {
    const CgJob* job = m->job;
    if (m->use_multigrid)
        om__multigrid_apply(job->K, job->S, job->A, &m->who);
    else
        job->K->apply_blocks(job->S->dinv, job->S->r, job->S->u, m->who.begin, m->who.end);
}

// w = A u with zeros at prescribed rows, and the two sums r.u and u.w.
static void multiply(Member* m) {
    const CgJob* job = m->job;
    OmSolver* S = job->S;
    size_t lanes = (size_t)job->K->lanes, width = (size_t)job->K->width;
    for (int n = 0; n < m->end - m->begin; ++n) {
        int k = m->who.is_backward ? m->end - 1 - n : m->begin + n;
        double sums[2 * OM_MAX_LANE];
        int begin = S->chunks.begin[k], end = S->chunks.begin[k + 1];
        job->K->multiply(job->A, S, begin, end, sums);
        if (job->A->ties) om__ties_multiply(job->A->ties, job->K, S, begin, end, sums);
        for (int f = S->chunk_fixed[k]; f < S->chunk_fixed[k + 1]; ++f)
            for (size_t c = 0; c < 3; ++c)
                for (size_t q = 0; q < lanes; ++q)
                    S->w[width * (size_t)S->fixed_vert[f] + lanes * c + q] *=
                        S->free_mask[4 * (size_t)f + c];
        om__put_partial(S, 0, k, sums, 2 * job->K->lanes);  // u is zero where w was cleared
    }
    m->who.is_backward = !m->who.is_backward;
}

typedef struct Lane {  // coefficients of one right-hand side
    bool is_running;
    double target;  // of r.r
    double gamma_old, alpha_old;
} Lane;

// alpha and beta of a lane from its sums; with alpha zero the lane does not change.
static OmCgEnd next_coefficients(Lane* lane, double gamma, double delta, bool is_first,
                                 float* alpha, float* beta) {
    *alpha = *beta = 0;
    if (!lane->is_running) return OM_CG_DONE;
    if (!isfinite(gamma) || !isfinite(delta)) return OM_CG_NOT_FINITE;
    double b = is_first ? 0.0 : gamma / lane->gamma_old;  // gamma_old > 0, checked below
    double curvature = delta - (is_first ? 0.0 : b * gamma / lane->alpha_old);  // p.A p
    if (gamma <= 0.0 || curvature <= 0.0) {
        lane->is_running = false;  // solved exactly, or to the precision of float
        return is_first && gamma != 0.0 ? OM_CG_INDEFINITE : OM_CG_DONE;
    }
    lane->gamma_old = gamma;
    lane->alpha_old = gamma / curvature;
    *alpha = (float)lane->alpha_old;
    *beta = (float)b;
    return OM_CG_DONE;
}

static bool any_running(const Lane* lane, int lanes) {
    for (int q = 0; q < lanes; ++q)
        if (lane[q].is_running) return true;
    return false;
}

// Reduce |r| of open lanes from 1 to target; x is the correction.
static OmCgEnd run_cg(Member* m) {
    CgJob* job = m->job;
    OmSolver* S = job->S;
    int lanes = job->K->lanes;
    Lane lane[OM_MAX_LANE] = {{0}};
    for (int q = 0; q < job->nrhs; ++q) {
        double target = S->tolerance > 0 ? fmax(0.9 * m->goal[q] / m->norm[q], INNER_GAIN) : 0.0;
        lane[q] = (Lane){.is_running = m->is_open[q], .target = target * target};
    }
    precondition(m);
    om_team_barrier(m->team);
    for (int it = 0; m->iterations < S->def.max_iterations && any_running(lane, lanes); ++it) {
        float alpha[OM_MAX_LANE], beta[OM_MAX_LANE];
        multiply(m);
        if (m->who.rank == 0) job->is_stopped = om_stop_poll() != OM_OK;
        om_team_barrier(m->team);
        if (job->is_stopped) return OM_CG_STOPPED;
        for (int q = 0; q < lanes; ++q) {
            OmCgEnd end = next_coefficients(&lane[q], om__total(S, q), om__total(S, lanes + q),
                                            it == 0, &alpha[q], &beta[q]);
            if (end != OM_CG_DONE) return end;
        }
        if (!any_running(lane, lanes)) break;
        ++m->iterations;
        for (int k = m->begin; k < m->end; ++k) {
            double rr[OM_MAX_LANE];
            job->K->update(S, alpha, beta, !m->use_multigrid, S->chunks.begin[k],
                           S->chunks.begin[k + 1], rr);
            om__put_partial(S, 2 * lanes, k, rr, lanes);
        }
        // The preconditioner is not needed after the last update: check convergence first if that is cheap.
        if (m->use_multigrid) {
            om_team_barrier(m->team);
            for (int q = 0; q < lanes; ++q)
                if (om__total(S, 2 * lanes + q) <= lane[q].target) lane[q].is_running = false;
            if (!any_running(lane, lanes) || m->iterations >= S->def.max_iterations) break;
            precondition(m);
        }
        om_team_barrier(m->team);
        for (int q = 0; q < lanes && !m->use_multigrid; ++q)
            if (om__total(S, 2 * lanes + q) <= lane[q].target) lane[q].is_running = false;
    }
    return OM_CG_DONE;
}

// ---- refinement -------------------------------------------------------------------------------------

// The lanes that need another round.
static bool open_lanes(Member* m) {
    bool any = false;
    for (int q = 0; q < OM_MAX_LANE; ++q) {
        m->is_open[q] = m->is_open[q] && m->norm[q] > m->goal[q] && m->norm[q] > 0.0;
        any = any || m->is_open[q];
    }
    return any && m->iterations < m->job->S->def.max_iterations;
}

// Residuals of the initial guess and of zero, and from them the required norms.
static OmStatus begin_solve(Member* m, double* scale) {
    const OmSolver* S = m->job->S;
    inspect(m, m->is_open);  // no lane is open yet
    bool has_prescribed = om__total(S, HAS_PRESCRIBED) > 0, has_guess = om__total(S, HAS_GUESS) > 0;
    if (om__total(S, HAS_BAD) > 0) return OM_INVALID;
    if (!residual_norms(m, !has_prescribed)) return OM_INVALID;
    for (int q = 0; q < m->job->nrhs; ++q) {
        m->is_open[q] = m->norm[q] > 0.0;  // else x = 0 is exact
        scale[q] = m->is_open[q] && S->reference > 0.0 ? S->reference : m->norm[q];
        m->goal[q] = S->tolerance * scale[q];
    }
    if (!has_guess) return OM_OK;
    om_team_barrier(m->team);
    inspect(m, m->is_open);
    return residual_norms(m, false) ? OM_OK : OM_INVALID;
}

// Rounds of CG in float, each starting from the residual in double of the last round.
static void refine(Member* m) {
    double last[OM_MAX_LANE];
    while (open_lanes(m)) {
        begin_cg(m);
        OmCgEnd end = run_cg(m);
        if (end == OM_CG_STOPPED) return;
        // is the matrix not positive definite, or only the preconditioner?
        if (end != OM_CG_DONE && m->use_multigrid) {
            m->use_multigrid = false;
            om_team_barrier(m->team);
            continue;
        }
        if (end != OM_CG_DONE) {  // is the matrix not positive definite, or only in float?
            for (int q = 0; q < m->job->nrhs; ++q) m->is_stuck[q] = m->is_stuck[q] || m->is_open[q];
            om_team_barrier(m->team);
            return;
        }
        for (int q = 0; q < m->job->nrhs; ++q) last[q] = m->norm[q];
        add_correction(m);
        residual_norms(m, false);
        judge_correction(m, last);
    }
}

// CG in double for stuck lanes, with the remaining iterations. If multigrid has used all, half as many more are
// allowed.
static OmStatus rescue(Member* m) {
    OmSolver* S = m->job->S;
    int budget = S->def.max_iterations - m->iterations, max = 0;
    if (S->multigrid && S->tolerance > 0 && budget < S->def.max_iterations / 2)
        budget = S->def.max_iterations / 2;
    if (S->multigrid) budget = budget < INT_MAX / CYCLE_COUNT ? CYCLE_COUNT * budget : INT_MAX;
    OmCgEnd end = OM_CG_DONE;
    if (budget <= 0) return OM_OK;
    if (!residual_norms(m, false)) return OM_INVALID;  // some corrections were taken back
    for (int q = 0; q < m->job->nrhs; ++q) {
        OmLane lane = {q, m->job->K->lanes, m->begin, m->end};
        double last = INFINITY;
        int done = 0;
        while (m->is_stuck[q] && m->norm[q] > m->goal[q] && m->norm[q] < LEAST_GAIN * last) {
            int num;
            last = m->norm[q];
            end =
                om__cg_double(S, m->job->A, &m->who, &lane, 0.9 * m->goal[q], budget - done, &num);
            if (end == OM_CG_NOT_FINITE) return OM_INVALID;
            if (end == OM_CG_INDEFINITE) return OM_NOT_SPD;
            done += num;
            if (!residual_norms(m, false)) return OM_INVALID;
        }
        max = done > max ? done : max;
    }
    m->iterations += max;
    return OM_OK;
}

// Every member computes the same numbers and takes the same branches; the first one reports.
static OmStatus solve_member(Member* m, OmSolveInfo* info) {
    const OmSolver* S = m->job->S;
    double scale[OM_MAX_LANE] = {0};
    bool is_stuck = false, is_converged = true;
    OmStatus status = begin_solve(m, scale);
    if (status != OM_OK) return status;
    refine(m);
    if (m->job->is_stopped) return OM_CANCELLED;
    for (int q = 0; q < m->job->nrhs; ++q) {
        if (S->multigrid && S->tolerance > 0 && m->is_open[q])  // the iterations are used up
            m->is_stuck[q] = m->norm[q] > m->goal[q];
        is_stuck = is_stuck || m->is_stuck[q];
    }
    if (is_stuck) status = rescue(m);
    if (status != OM_OK) return status;
    for (int q = 0; q < m->job->nrhs; ++q) {
        is_converged = is_converged && m->norm[q] <= m->goal[q];
        if (scale[q] > 0.0) info->residual = fmax(info->residual, m->norm[q] / scale[q]);
    }
    info->iterations = m->iterations;
    return is_converged || S->tolerance == 0.0 ? OM_OK : OM_NOT_CONVERGED;
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
    if (status >= 0 && status != OM_NOT_SPD) give_solution(&m);
}

OmStatus om__cg_solve(OmSolver* S, const OmBsr* A, int nrhs, const double* b, double* x,
                      OmSolveInfo* info) {
    CgJob job = {.K = nrhs > 1 ? &om__kernels_eight : &om__kernels_one,
                 .S = S,
                 .A = A,
                 .nrhs = nrhs,
                 .b = b,
                 .x = x};
    om_parallel_team(S->def.nworker, team_solve, &job);
    *info = job.info;
    if (job.status == OM_INVALID)
        return om_error(OM_INVALID,
                        "solve: the right-hand side, the first guess or the matrix is not finite");
    if (job.status == OM_NOT_SPD)
        return om_error(OM_NOT_SPD, "solve: the matrix is not positive definite");
    if (job.status == OM_NOT_CONVERGED)
        return om_error(OM_NOT_CONVERGED, "solve: residual %.3g after %d iterations, wanted %.3g",
                        job.info.residual, job.info.iterations, S->tolerance);
    return job.status;
}
