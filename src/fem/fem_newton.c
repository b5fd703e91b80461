// fem_newton.c: Newton's method for equilibrium at one load, optionally with inertia.
//
// The unknown x minimises  E(x) = W(x) + E_extra(x) - f_dead . x + inertia/2 |x - x_hat|_M^2.  Each iteration
// solves A dx = -dE/dx, with prescribed entries of dx given in the first one (fem_linear.c), then halves dx (by the
// parabola through the known values) until E falls; where a follower load leaves no E, or the fall is lost in its
// rounding (its terms cancel at rest), until the force along dx does (Hager and Zhang 2005). Where the follower load
// makes A unsymmetric, the norm of the residual must fall. Nocedal and Wright (2006), chapters 3 and 11.
//
// Slender bodies rotate: there whole steps, although the energy rises at first, are three times faster than
// halved steps. So whole steps are tried first; the result must be stable (A positive definite without
// modification) and not inverted, else the search restarts from the beginning with the line search. For contact
// (the solid's, or `extra`) it is the opposite: its stiffness changes from step to step, whole steps diverge,
// and the line search takes some ten steps.
#include <float.h>
#include <string.h>

#include "fem/fem_solid.h"

#define DIRECT_NODES 3000  // CHOLMOD is faster below
#define PLAIN_TURNS 8      // number of whole steps that may increase the residual
#define PATIENCE 4         // number of iterations in which the residual must fall
#define RUNAWAY 1e4        // times the residual after the first iteration
#define MAX_BACKTRACK 14
#define DESCENT 1e-4           // fraction of the predicted decrease that is required
#define SLOPE_LEFT 0.9         // fraction of the force along the step that may remain at its end
#define ENERGY_ROUNDING 1e-13  // of the energies that are summed

// ---- create -----------------------------------------------------------------------------------------

OmSolverDef om__newton_solver_def(const OmFemSolid* s) {
    OmSolverDef def = om_solver_default_def();
    def.preconditioner = s->mesh.nnode <= DIRECT_NODES ? OM_CHOLESKY : OM_MULTIGRID;
    def.max_iterations = 1000;
    def.nworker = s->nworker;
    // matrices of elements and of faces in contact are at most this many times their diagonal
    int nrow = s->mesh.nelem_node, ntouch = 2 * om__face_nnode(s->mesh.kind);
    def.row_bound = s->ncontact > 0 && ntouch > nrow ? ntouch : nrow;
    return def;
}

OmStatus om__newton_create(const OmFemSolid* s, const OmSolverDef* solver, OmFemNewton* N) {
    *N = (OmFemNewton){.solid = s, .solver_def = *solver};
    OmStatus status = OM_OK;
    size_t n = 3 * (size_t)s->mesh.nnode;
    OM_CHECK_DONE(
        solver->preconditioner != OM_LU, OM_INVALID,
        "OmSolverDef.preconditioner = OM_LU cannot tell a stable solid from an unstable one");
    OM_TRY_DONE(om_fem_matrix_create(s, &N->A));
    OM_TRY_DONE(om_solver_create(&N->solver_def, &N->A, s->mesh.x, &N->solver));
    double** array[] = {&N->x_hat, &N->dead, &N->r,       &N->dx,
                        &N->trial, &N->work, &N->scratch, &N->start};
    for (int k = 0; k < 8; ++k) OM_CALLOC_DONE(*array[k], n);
    OM_CALLOC_DONE(N->fixed, n);
    OM_ALLOC_DONE(N->own, 3 * n);
    for (int e = 0; e < s->mesh.nelem; ++e) {
        const OmLawParam* law = &s->law[s->mesh.elem_material[e]];
        N->energy_rounding += DBL_EPSILON * s->volume[e] * (law->mu + law->bulk);
    }
done:
    if (status < 0) om__newton_done(N);
    return status;
}

void om__newton_done(OmFemNewton* N) {
    om_solver_destroy(N->solver);
    om_solver_destroy(N->lu);
    om_bsr_destroy(&N->A);
    om_bsr_destroy(&N->B);
    double* array[] = {N->x_hat, N->dead, N->r, N->dx, N->trial, N->work, N->scratch, N->start};
    for (int k = 0; k < 8; ++k) om_free(array[k]);
    om_free(N->fixed);
    om_free(N->own);
    *N = (OmFemNewton){0};
}

OmStatus om__newton_set_load(OmFemNewton* N, const OmFemLoad* load) {
    size_t n = 3 * (size_t)N->solid->mesh.nnode;
    OM_TRY(om__fem_check_load(N->solid, load));
    N->load = load;
    for (size_t i = 0; i < n; ++i) N->fixed[i] = load->fixed && load->fixed[i] ? 1 : 0;
    memset(N->dead, 0, n * sizeof(double));
    om__fem_add_dead(N->solid, load, N->is_lumped, N->dead);
    om_solver_set_fixed(N->solver, N->fixed);
    return om__newton_prepare(N);
}

// ---- residual and energy ----------------------------------------------------------------------------

typedef struct Balance {
    double energy;    // J
    double rounding;  // of it, J
    double residual;  // norm of r at free degrees of freedom, N
    double scale;     // norm of loads, reactions and inertia, N
} Balance;

// r = dE/dx at x and its norms.
static OmStatus eval_balance(OmFemNewton* N, const double* x, double share, double* r, Balance* b) {
    const OmFemSolid* s = N->solid;
    size_t n = 3 * (size_t)s->mesh.nnode;
    double energy, extra = 0, work = 0, inertia = 0, loads = 0, reactions = 0;
    OM_TRY(om_fem_eval_force(s, x, r, &energy));
    b->residual = 0;
    for (size_t i = 0; i < n; ++i) N->work[i] = share * N->dead[i];
    om__fem_add_follower(N->load, x, share, N->work, NULL);
    for (size_t i = 0; i < n; ++i) {
        r[i] -= N->work[i];
        work += share * N->dead[i] * (x[i] - s->mesh.x[i]);
        if (!N->fixed[i]) loads += N->work[i] * N->work[i];
    }
    if (N->inertia > 0) {
        for (size_t i = 0; i < n; ++i) N->scratch[i] = x[i] - N->x_hat[i];
        om_fem_apply_mass(s, N->is_consistent, N->scratch, N->work);
        for (size_t i = 0; i < n; ++i) {
            double f = N->inertia * N->work[i];
            inertia += 0.5 * f * N->scratch[i];
            r[i] += f;
            if (!N->fixed[i]) loads += f * f;
        }
    }
    if (N->load->extra)
        OM_TRY(N->load->extra->eval(N->load->extra->ctx, x, share, &extra, r, NULL));
    for (size_t i = 0; i < n; ++i) {
        double square = r[i] * r[i];
        if (N->fixed[i])
            reactions += square;
        else
            b->residual += square;
    }
    b->energy = energy + extra + inertia - work;
    b->rounding = ENERGY_ROUNDING * (fabs(energy) + fabs(extra) + fabs(inertia) + fabs(work));
    b->residual = sqrt(b->residual);
    b->scale = sqrt(loads + reactions);
    return OM_OK;
}

OmStatus om__newton_residual(OmFemNewton* N, const double* x, double share, double* r,
                             double* scale) {
    Balance b;
    OM_TRY(eval_balance(N, x, share, r, &b));
    *scale = b.scale;
    return OM_OK;
}

// ---- line search ------------------------------------------------------------------------------------

// x += a dx with the first a = 1, .. that lowers the norm of the residual, whose slope along dx is itself with a
// minus. Where none does, x stays.
static OmStatus reduce_residual(OmFemNewton* N, double share, double* x, Balance* b) {
    size_t n = 3 * (size_t)N->solid->mesh.nnode;
    Balance now = *b;
    double a = 1, before = b->residual * b->residual;
    for (int turn = 0; turn < MAX_BACKTRACK; ++turn) {
        for (size_t i = 0; i < n; ++i) N->trial[i] = x[i] + a * N->dx[i];
        OM_TRY(eval_balance(N, N->trial, share, N->r, &now));
        if (N->is_plain ? isfinite(now.residual)
                        : now.residual <= (1 - DESCENT * a) * b->residual) {
            memcpy(x, N->trial, n * sizeof *x);
            *b = now;
            return OM_OK;
        }
        double rise = now.residual * now.residual - before;
        double next = isfinite(rise) ? before * a * a / (rise + 2 * before * a) : 0;
        a = fmin(fmax(next, 0.1 * a), 0.5 * a);
    }
    return eval_balance(N, x, share, N->r, b);
}

// x += a dx with the first a = 1, .. that lowers the energy, or the force along dx where energies differ by
// rounding only; r and b follow.
static OmStatus search_line(OmFemNewton* N, double share, double* x, Balance* b) {
    size_t n = 3 * (size_t)N->solid->mesh.nnode;
    bool has_energy = !om__fem_has_follower(N->load);
    double slope = 0, a = 1;
    Balance now = *b;
    if (N->is_unsymmetric) return reduce_residual(N, share, x, b);
    for (size_t i = 0; i < n; ++i) slope += N->r[i] * N->dx[i];
    for (int turn = 0; turn < MAX_BACKTRACK; ++turn) {
        for (size_t i = 0; i < n; ++i) N->trial[i] = x[i] + a * N->dx[i];
        OM_TRY(eval_balance(N, N->trial, share, N->r, &now));
        double rise = now.energy - b->energy, noise = b->rounding + now.rounding, end = 0;
        for (size_t i = 0; i < n; ++i) end += N->r[i] * N->dx[i];
        bool is_lower = has_energy && rise <= DESCENT * a * slope + noise;
        bool is_slack = fabs(end) <= SLOPE_LEFT * fabs(slope);
        bool is_good = is_lower || (is_slack && (!has_energy || rise <= N->energy_rounding));
        if ((is_good || N->is_plain) && isfinite(now.residual)) break;
        double next = 0.5 * a;
        if (has_energy && isfinite(rise) && rise - slope * a > 0)
            next = -slope * a * a / (2 * (rise - slope * a));
        if (!has_energy && isfinite(end) && end > slope) next = a * slope / (slope - end);
        a = fmin(fmax(next, 0.1 * a), 0.5 * a);
    }
    memcpy(x, N->trial, n * sizeof *x);
    *b = now;
    return OM_OK;
}

// ---- iterations -------------------------------------------------------------------------------------

static bool note_residual(const OmFemNewton* N, const Balance* b, OmFemReport* report) {
    report->force_scale = b->scale;
    report->residual = b->scale > 0 ? b->residual / b->scale : 0;
    if (report->nhistory < 32) report->history[report->nhistory++] = b->residual;
    return b->residual <= N->tolerance * b->scale || b->residual <= N->rounding;
}

static bool set_prescribed(OmFemNewton* N, const double* target, const double* x) {
    bool moves = false;
    for (size_t i = 0; i < 3 * (size_t)N->solid->mesh.nnode; ++i) {
        N->dx[i] = N->fixed[i] ? target[i] - x[i] : 0;
        moves = moves || N->dx[i] != 0;
    }
    return moves;
}

// Nothing had to be done: is the state at rest stable?
static OmStatus look_at_tangent(OmFemNewton* N, double share, const double* x,
                                OmFemReport* report) {
    if (N->inertia > 0) return OM_OK;
    OmStatus status = om__newton_step(N, x, share, report);
    if (status == OM_NOT_CONVERGED) N->is_repaired = true;
    report->reason[0] = 0;
    return status < 0 ? status : OM_OK;
}

// Iterations with whole steps (is_plain) or with line search.
static OmStatus iterate(OmFemNewton* N, double share, const double* target, double* x,
                        OmFemReport* report) {
    size_t n = 3 * (size_t)N->solid->mesh.nnode;
    Balance b;
    double before[PATIENCE] = {INFINITY};  // residuals of the last iterations
    bool is_trial = N->is_plain && !N->is_plain_only;
    double first = 0;  // residual after the first iteration
    report->nhistory = 0;
    report->reason[0] = 0;
    N->rounding = 0;
    OM_TRY(eval_balance(N, x, share, N->r, &b));
    bool is_moved = set_prescribed(N, target, x);
    if (!is_moved && note_residual(N, &b, report)) return look_at_tangent(N, share, x, report);
    for (int turn = 0; turn < N->max_newton; ++turn) {
        OmStatus status = om__newton_step(N, x, share, report);
        if (status != OM_OK) return status;
        ++report->nnewton;
        if (is_moved) {  // energies can be compared only after the prescribed nodes are in place
            for (size_t i = 0; i < n; ++i) x[i] = N->fixed[i] ? target[i] : x[i] + N->dx[i];
            OM_TRY(eval_balance(N, x, share, N->r, &b));
            memset(N->dx, 0, n * sizeof *N->dx);
            is_moved = false;
        } else {
            OM_TRY(search_line(N, share, x, &b));
        }
        if (turn == 0) first = b.residual;
        if (!(b.residual <= (N->is_plain ? RUNAWAY * first : DBL_MAX))) {
            snprintf(report->reason, sizeof report->reason, "Newton's method ran away");
            return OM_NOT_CONVERGED;
        }
        double* last = &before[turn % PATIENCE];
        if (is_trial && turn >= PLAIN_TURNS && b.residual > 0.7 * *last) break;
        *last = b.residual;
        if (note_residual(N, &b, report)) return OM_OK;
        OM_TRY(om_progress_report(N->progress, "load", report->load, 1));
    }
    snprintf(report->reason, sizeof report->reason,
             "the residual is %.3g of the loads after %d iterations of Newton's method",
             report->residual, N->max_newton);
    return OM_NOT_CONVERGED;
}

OmStatus om__newton_solve(OmFemNewton* N, double share, const double* target, double* x,
                          const double* guess, OmFemReport* report) {
    size_t n = 3 * (size_t)N->solid->mesh.nnode;
    memcpy(N->start, x, n * sizeof *x);
    bool is_rough = N->load->extra || N->solid->ncontact > 0;
    if (!is_rough || N->is_plain_only) {
        if (guess) memcpy(x, guess, n * sizeof *x);
        N->is_plain = true;
        OmStatus status = iterate(N, share, target, x, report);
        bool is_done =
            status == OM_OK && !N->is_repaired && om_fem_eval_volume(N->solid, x, NULL) > 0;
        report->is_unstable = N->is_repaired;
        if (status < 0 || is_done || N->is_plain_only) return status;
        memcpy(x, N->start, n * sizeof *x);
        // A shorter load step is faster than a line search on the norm of the residual.
        if (N->is_unsymmetric) return OM_NOT_CONVERGED;
    } else if (guess) {
        Balance here, there;
        OM_TRY(eval_balance(N, x, share, N->r, &here));
        OM_TRY(eval_balance(N, guess, share, N->r, &there));
        if (there.energy < here.energy) memcpy(x, guess, n * sizeof *x);
    }
    N->is_plain = false;
    OmStatus status = iterate(N, share, target, x, report);
    report->is_unstable = N->is_repaired;
    return status;
}
