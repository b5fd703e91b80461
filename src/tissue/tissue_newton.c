// tissue_newton.c: Newton's method on the incremental potential, for steps that one linearisation does not solve
// and for bodies at rest.
//
// With dv the velocity change of a step, implicit Euler is the stationary point of
//
//     Phi(dv) = 1/2 |dv|^2_M + h a/2 |v|^2_M + W(x) + springs - x . (f_ext + M g),   v = v0 + dv, x = x0 + h v
//
// (Radovitzky and Ortiz 1999); in statics the terms with M vanish and h is 1. The engine's tangent is projected, so
// the direction to the solution of the linearised problem is a descent direction of Phi, and a line search that halves
// the step until Phi falls enough (Armijo) always ends. Near the solution the exact tangent replaces the projected one,
// and convergence is quadratic; with the projected tangent the residual of a beam under its weight fell by a factor of
// 1.6 an iteration. In statics, iterations with the corotational law predict the solution first: large rotations cost
// that law few iterations, and without the predictor half of all iterations went into rotations.
// The unknown of the linearised problem is dv itself, A dv = A dv_k - grad Phi(dv_k), so the solver of the first
// linearisation (contact) can solve the next ones. Contact forces are not part of Phi: with contact, a step is halved
// only until no element inverts. grad Phi is computed in double: in float, the rounding of forces in balance is 1e-3
// of a soft body's weight.
#include <string.h>

#include "tissue/tissue_internal.h"

#define ARMIJO 1e-4
#define MIN_STEP (1.0 / 1024)
#define FORCING 0.03    // residual of a linear solve, relative to the residual before
#define NEAR 0.3        // relative to the norm at the beginning; below it the exact tangent is used
#define STALE 4         // iterations without a lower residual: the residual is at rounding level
#define USEFUL 1e-3     // relative to the residual's scale; the level of rounding must be below
#define ROUNDING 1e-15  // of positions, relative
// Of sum V mu: rounding of Phi. Smaller changes do not tell whether a step is good.
#define ENERGY_ROUNDING 1e-15
#define STILL 1e3      // a body with an initial residual below STILL times rounding is at rest
#define NPREDICT 8     // maximum iterations of the predictor
#define PREDICTED 0.1  // relative to the first change; below it the predictor has converged

// Phi at a velocity change, without elastic damping. Sets w->x_end, w->v_end and w->elastic for that velocity change.
static OmStatus eval_potential(const OmTissueModel* m, const OmTissueState* s, OmTissueWork* w,
                               const double* dv, double* potential) {
    double inertia = 0, damping = 0, work = 0, spring = 0, elastic;
    const double *x0 = om__state_array(s, OM__X), *v0 = om__state_array(s, OM__V);
    const double *anchor = om__state_array(s, OM__ANCHOR), *f = om__state_array(s, OM__F_EXT);
    const double* stiffness = om__state_stiffness(s);
    for (size_t n = 0; n < 3 * (size_t)w->nvert; ++n) {
        w->v_end[n] = v0[n] + dv[n];
        w->x_end[n] = x0[n] + w->h * w->v_end[n];
    }
    for (int i = 0; i < w->nvert; ++i) {
        OmVec3 x = om_load3(w->x_end, i);
        inertia += m->mass[i] * om_norm2(om_load3(dv, i));
        damping += m->mass[i] * om_norm2(om_load3(w->v_end, i));
        work += om_dot(om_madd(om_load3(f, i), m->mass[i], m->def.gravity),
                       om_sub(x, om_load3(m->mesh.x, i)));
        if (stiffness[i] > 0)
            spring += 0.5 * stiffness[i] * om_norm2(om_sub(x, om_load3(anchor, i)));
    }
    OM_TRY(m->engine->eval_balance(m, w, w->x_end, w->elastic, &elastic));
    spring += om__bonds_add(m, w->x_end, NULL, w->elastic);
    double moving = w->is_static ? 0 : 0.5 * inertia + 0.5 * w->h * m->def.rayleigh_mass * damping;
    *potential = moving + elastic + spring - work;
    return OM_OK;
}

// -grad Phi at vertex i, for the last velocity change at which Phi was computed.
static OmVec3 downhill(const OmTissueModel* m, const OmTissueState* s, const OmTissueWork* w,
                       const double* dv, int i) {
    OmVec3 f = om_add(om_load3(w->elastic, i), om_load3(om__state_array(s, OM__F_EXT), i));
    f = om_madd(f, m->mass[i], m->def.gravity);
    double k = om__state_stiffness(s)[i];
    if (k > 0)
        f = om_madd(f, k,
                    om_sub(om_load3(om__state_array(s, OM__ANCHOR), i), om_load3(w->x_end, i)));
    if (w->is_static) return om_scale(w->h, f);
    f = om_madd(f, -m->def.rayleigh_mass * m->mass[i], om_load3(w->v_end, i));
    return om_madd(om_scale(w->h, f), -m->mass[i], om_load3(dv, i));
}

// |grad Phi| over free vertices, for the same velocity change.
static double norm_downhill(const OmTissueModel* m, const OmTissueState* s, const OmTissueWork* w,
                            const double* dv) {
    double sum = 0;
    for (int i = 0; i < w->nvert; ++i)
        if (!w->key[i]) sum += om_norm2(downhill(m, s, w, dv, i));
    return sqrt(sum);
}

// Assemble A at the last velocity change, and b such that A dv_next = b gives Newton's next iterate. norm: |grad Phi|
// over free vertices.
static OmStatus linearise(const OmTissueModel* m, const OmTissueState* s, OmTissueWork* w,
                          const double* dv, bool is_exact, double* norm) {
    double h = w->h, beta = w->is_static ? 0 : m->def.rayleigh_stiffness, sum = 0;
    OmAssembly at = {.x = w->x_end,
                     .v = w->v_end,
                     .mass = w->is_static ? 0 : 1 + h * m->def.rayleigh_mass,
                     .stiffness = h * h + h * beta,
                     .force = h,
                     .spring = h * h,
                     .is_exact = is_exact};
    om_tissue_clear_forces(w);
    OM_TRY(om__assemble(m, s, w, &at));
    for (int i = 0; i < w->nvert; ++i) {
        OmVec3 down = downhill(m, s, w, dv, i);
        if (!w->key[i]) sum += om_norm2(down);
        om_store3(w->b, i, down);
    }
    // A dv; elastic damping too is computed from A: h b K v = (A v - ...) h b / (h^2 + h b).
    om_bsr_apply(&w->A, m->def.solver.nworker, dv, w->trial);
    for (size_t n = 0; n < 3 * (size_t)w->nvert; ++n) w->b[n] += w->trial[n];
    if (beta > 0) {
        om_bsr_apply(&w->A, m->def.solver.nworker, w->v_end, w->trial);
        double share = beta / (h + beta);
        sum = 0;
        for (int i = 0; i < w->nvert; ++i) {
            double spring = h * h * om__state_stiffness(s)[i];
            OmVec3 Kv = om_madd(om_load3(w->trial, i), -(at.mass * m->mass[i] + spring),
                                om_load3(w->v_end, i));
            om_store3(w->b, i, om_madd(om_load3(w->b, i), -share, Kv));
            OmVec3 down = om_madd(downhill(m, s, w, dv, i), -share, Kv);
            if (!w->key[i]) sum += om_norm2(down);
        }
    }
    // A dv - rhs is -grad Phi: forces of tools and their work are computed from it.
    memcpy(w->rhs, w->b, 3 * (size_t)w->nvert * sizeof *w->rhs);
    w->is_stale = true;
    *norm = sqrt(sum);
    return OM_OK;
}

// |A (b - a)| over free vertices, and -(b - a) . A (b - a): at the solution of a linearised problem without
// contact these are |grad Phi| and the slope of Phi from a to b.
static double measure_way(const OmTissueModel* m, OmTissueWork* w, const double* a, const double* b,
                          double* slope) {
    double sum = 0;
    *slope = 0;
    for (size_t n = 0; n < 3 * (size_t)w->nvert; ++n) w->trial[n] = b[n] - a[n];
    om_bsr_apply(&w->A, m->def.solver.nworker, w->trial, w->v_end);
    for (int i = 0; i < w->nvert; ++i) {
        if (w->key[i]) continue;
        OmVec3 y = om_load3(w->v_end, i);
        sum += om_norm2(y);
        *slope -= om_dot(y, om_load3(w->trial, i));
    }
    return sqrt(sum);
}

// Line search: halve the step from w->from to w->dv until Phi falls enough. *share: fraction of the step that is
// taken. *potential: in: Phi at the beginning, out: at the end.
static OmStatus search_line(const OmTissueModel* m, const OmTissueState* s, OmTissueWork* w,
                            bool has_contact, double slope, double* potential, double* share) {
    size_t n3 = 3 * (size_t)w->nvert;
    double begin = *potential, t = 1,
           rounding = 1e-13 * fabs(begin) + ENERGY_ROUNDING * m->total_mu;
    for (;; t *= 0.5) {
        for (size_t n = 0; n < n3; ++n) w->trial[n] = w->from[n] + t * (w->dv[n] - w->from[n]);
        OM_TRY(eval_potential(m, s, w, w->trial, potential));
        bool is_last = t <= MIN_STEP;
        bool is_low = *potential <= begin + ARMIJO * t * slope + rounding;
        if (is_last || (has_contact ? !om__is_crushing(m, s, w, w->trial) : is_low)) break;
    }
    memcpy(w->dv, w->trial, n3 * sizeof *w->dv);
    *share = t;
    return OM_OK;
}

// Initial guess: the solution of the first linearisation, or the old velocity at free vertices.
static OmStatus choose_start(const OmTissueModel* m, const OmTissueState* s, OmTissueWork* w,
                             bool has_contact, double* potential) {
    for (int i = 0; i < w->nvert; ++i)
        om_store3(w->from, i, w->key[i] ? om_load3(w->dv, i) : om_vec3(0, 0, 0));
    if (!w->is_static) {
        double solved;
        OM_TRY(eval_potential(m, s, w, w->from, potential));
        OM_TRY(eval_potential(m, s, w, w->dv, &solved));
        bool is_solved = has_contact ? !om__is_crushing(m, s, w, w->dv) : solved < *potential;
        if (is_solved) memcpy(w->from, w->dv, 3 * (size_t)w->nvert * sizeof *w->dv);
        if (is_solved && !has_contact) {  // the last trial is the start
            *potential = solved;
            return OM_OK;
        }
    }
    return eval_potential(m, s, w, w->from, potential);
}

// A few iterations with the corotational law from w->from, in float: the result is near rest also for large rotations.
// It is kept if its potential is lower.
static OmStatus predict(const OmTissueModel* m, OmTissueState* s, OmTissueWork* w,
                        double* potential, OmTissueReport* report) {
    size_t n3 = 3 * (size_t)w->nvert;
    double first = 0, slope, predicted;
    memcpy(w->dv, w->from, n3 * sizeof *w->dv);
    memcpy(w->start, w->from, n3 * sizeof *w->dv);
    for (int k = 0; k < NPREDICT; ++k) {
        OmAssembly at = {.x = w->x_end,
                         .v = w->v_end,
                         .stiffness = w->h * w->h,
                         .force = w->h,
                         .spring = w->h * w->h,
                         .is_turned = true};
        for (size_t n = 0; n < n3; ++n) {
            w->v_end[n] = w->dv[n];
            w->x_end[n] = om__state_array(s, OM__X)[n] + w->h * w->dv[n];
        }
        OM_TRY(om__assemble(m, s, w, &at));
        om_bsr_apply(&w->A, m->def.solver.nworker, w->dv, w->trial);
        for (size_t n = 0; n < n3; ++n) w->b[n] += w->trial[n];
        w->is_stale = true;
        memcpy(w->from, w->dv, n3 * sizeof *w->dv);
        OM_TRY(om_tissue_solve_step(m, s, w, report));
        ++report->newton;
        double change = measure_way(m, w, w->from, w->dv, &slope);
        if (k == 0) first = change;
        if (!(change > PREDICTED * first)) break;
    }
    OM_TRY(eval_potential(m, s, w, w->dv, &predicted));
    bool is_better = predicted < *potential;
    memcpy(w->from, is_better ? w->dv : w->start, n3 * sizeof *w->dv);
    return eval_potential(m, s, w, w->from, potential);
}

// Solve the linearised problem at w->from until its residual is `left`, N. If the exact tangent is not positive
// definite, use the projected tangent.
static OmStatus solve_linearised(const OmTissueModel* m, OmTissueState* s, OmTissueWork* w,
                                 const OmNewton* newton, bool* is_exact, double left,
                                 OmTissueReport* report) {
    for (;;) {
        double norm;
        w->reference = left / fmax(m->def.solver.tolerance, 1e-12);
        OmStatus status = newton->fn ? newton->fn(newton->ctx, m, s, w, w->h, report)
                                     : om_tissue_solve_step(m, s, w, report);
        w->reference = 0;
        if (status >= 0 || !*is_exact) return status;
        *is_exact = false;
        memcpy(w->dv, w->from, 3 * (size_t)w->nvert * sizeof *w->dv);
        OM_TRY(linearise(m, s, w, w->from, false, &norm));
        if (!newton->fn) left = FORCING * norm;
    }
}

// Residual caused by rounding of positions: A / h x to 2e-16, at every free vertex.
static double norm_of_rounding(const OmTissueState* s, const OmTissueWork* w) {
    const double* x = om__state_array(s, OM__X);
    double sum = 0;
    for (int i = 0; i < w->nvert; ++i) {
        const float* d = w->A.value + 9 * (size_t)w->A.row_adr[i];
        double k = ((double)d[0] + (double)d[4] + (double)d[8]) / 3;
        if (!w->key[i]) sum += k * k * om_norm2(om_load3(x, i));
    }
    return ROUNDING / w->h * sqrt(sum);
}

typedef struct Progress {  // of the residual over iterations
    double best;
    int nstale;
} Progress;

// True if the residual has stopped falling, at a level low enough for a useful step.
static bool is_at_floor(Progress* p, double norm, double scale) {
    p->nstale = norm < 0.9 * p->best ? 0 : p->nstale + 1;
    p->best = fmin(p->best, norm);
    return p->nstale >= STALE && norm <= USEFUL * scale;
}

static OmStatus stop_at_floor(OmNewton* newton, const OmTissueReport* report) {
    newton->is_at_floor = true;
    return om_error(
        OM_NOT_CONVERGED,
        "tissue: residual %.3g after %d iterations of Newton falls no more (rounding, or a "
        "contact that comes and goes); newton_tolerance %.3g cannot be met",
        report->newton_residual, report->newton, newton->tolerance);
}

OmStatus om__newton(const OmTissueModel* m, OmTissueState* s, OmTissueWork* w, OmNewton* newton,
                    OmTissueReport* report) {
    bool has_contact = newton->fn != NULL, is_exact = false;
    double scale = newton->scale, norm = 0, slope, potential, t = 1;
    Progress progress = {.best = INFINITY};
    OM_CHECK(m->engine->eval_balance, OM_UNAVAILABLE,
             "tissue: engine \"%s\" has no energy for Newton's method", m->engine->name);
    OM_TRY(choose_start(m, s, w, has_contact, &potential));
    if (!(scale > 0)) scale = norm_downhill(m, s, w, w->from);
    if (newton->predicts) OM_TRY(predict(m, s, w, &potential, report));
    for (int k = 0; k <= newton->max_iterations; ++k) {
        // With contact the forces of the last solve remain in A and rhs: the guard needs them.
        bool is_last = k == newton->max_iterations || t <= MIN_STEP || om__is_spent(m, w);
        OM_TRY(om_stop_poll());
        if (has_contact && is_last) break;
        OM_TRY(linearise(m, s, w, w->from, is_exact, &norm));
        if (!has_contact) report->newton_residual = scale > 0 ? norm / scale : 0;
        memcpy(w->dv, w->from, 3 * (size_t)w->nvert * sizeof *w->dv);
        w->is_fresh = false;
        double rounding = norm_of_rounding(s, w),
               enough = fmax(newton->tolerance * scale, rounding);
        bool is_at_rest = scale <= STILL * rounding;  // the body is at rest already
        bool is_enough = norm <= newton->tolerance * scale || (is_at_rest && norm <= enough);
        if (!has_contact && is_enough) return OM_OK;
        if (!has_contact && norm <= enough) return stop_at_floor(newton, report);
        if (!has_contact && is_at_floor(&progress, norm, scale))
            return stop_at_floor(newton, report);
        if (k > 0 && newton->share > 0) {
            newton->guard = om__guard_step(m, s, w, newton->share, false);
            newton->is_guarded = !newton->guard.is_bad && newton->guard.ninverted == 0;
            if (newton->is_guarded) return OM_OK;
            for (size_t n = 0; n < 3 * (size_t)w->nvert; ++n)
                w->v_end[n] /= w->h;  // velocities again
        }
        if (is_last) break;
        // Contact forces appear only in the linearised problem, so only its residual measures the balance of forces.
        // Each linear solve therefore reaches the tolerance; with looser solves the active set cycled.
        double left = has_contact ? 0.5 * enough : FORCING * norm;
        OmStatus status = solve_linearised(m, s, w, newton, &is_exact, left, report);
        if (status < 0) return status;
        norm = measure_way(m, w, w->from, w->dv, &slope);
        OM_TRY(search_line(m, s, w, has_contact, slope, &potential, &t));
        is_exact = t == 1 && norm < NEAR * scale;
        ++report->newton;
        if (has_contact) {
            report->newton_residual = scale > 0 ? norm / scale : 0;
            bool is_met = t == 1 && status == OM_OK && norm <= enough;
            if (is_met && (is_at_rest || norm <= newton->tolerance * scale)) return OM_OK;
            if (is_met) return stop_at_floor(newton, report);
            if (is_at_floor(&progress, norm, scale)) return stop_at_floor(newton, report);
        }
        memcpy(w->from, w->dv, 3 * (size_t)w->nvert * sizeof *w->dv);
    }
    return om_error(OM_NOT_CONVERGED, "tissue: residual %.3g after %d iterations of Newton",
                    report->newton_residual, report->newton);
}

OmStatus om__relinearise(const OmTissueModel* m, OmTissueState* s, OmTissueWork* w,
                         OmTissueReport* report) {
    const double *x = om__state_array(s, OM__X), *v = om__state_array(s, OM__V);
    double h = w->h, beta = m->def.rayleigh_stiffness;
    for (size_t n = 0; n < 3 * (size_t)w->nvert; ++n) {
        w->v_end[n] = v[n] + w->dv[n];
        w->x_end[n] = x[n] + h * w->v_end[n];
    }
    OmAssembly at = {.x = w->x_end,
                     .v = w->v_end,
                     .mass = 1 + h * m->def.rayleigh_mass,
                     .stiffness = h * h + h * beta,
                     .force = h,
                     .lag = beta,
                     .spring = h * h};
    om_tissue_clear_forces(w);
    OM_TRY(om__assemble(m, s, w, &at));
    om_bsr_apply(&w->A, m->def.solver.nworker, w->dv, w->trial);
    for (int i = 0; i < w->nvert; ++i) {
        OmVec3 b = om_madd(om_load3(w->b, i), -m->mass[i], om_load3(w->dv, i));
        om_store3(w->b, i, om_add(b, om_load3(w->trial, i)));
    }
    w->is_stale = true;
    ++report->newton;
    return om_tissue_solve_step(m, s, w, report);
}

double om__newton_scale(const OmTissueModel* m, OmTissueWork* w) {
    double slope;
    for (int i = 0; i < w->nvert; ++i)
        om_store3(w->from, i, w->key[i] ? om_load3(w->dv, i) : om_vec3(0, 0, 0));
    return measure_way(m, w, w->from, w->dv, &slope);
}

OmStatus om_tissue_find_rest(const OmTissueModel* m, OmTissueState* s, OmTissueWork* w,
                             double tolerance, int max_iterations, OmTissueReport* report) {
    OmTissueReport local;
    if (!report) report = &local;
    *report = (OmTissueReport){0};
    OM_CHECK(tolerance > 0 && tolerance < 1 && max_iterations >= 1, OM_INVALID,
             "tissue: tolerance is %g and max_iterations %d; the first must be in (0, 1), the "
             "second at least 1",
             tolerance, max_iterations);
    double time = s->time;
    w->work = INT64_MIN;  // max_iterations alone bounds it
    memcpy(w->backup, s, om__state_bytes(s));
    memset(om__state_array(s, OM__V), 0, 3 * (size_t)w->nvert * sizeof(double));
    w->is_static = true;
    OmStatus status = om_tissue_begin_step(m, s, w, 1);
    OmNewton newton = {.tolerance = tolerance, .max_iterations = max_iterations, .predicts = true};
    if (status >= 0) status = om__newton(m, s, w, &newton, report);
    report->ninverted = status < 0 ? 0 : om__guard_step(m, s, w, 1, true).ninverted;
    OmStatus end = status < 0 ? status : om_tissue_end_step(m, s, w);
    w->is_static = false;
    w->h = 0;
    if (end < 0) {
        memcpy((void*)s, w->backup, om__state_bytes(s));
        return end;
    }
    s->time = time;
    report->substeps = 1;
    memset(om__state_array(s, OM__V), 0, 3 * (size_t)w->nvert * sizeof(double));
    if (report->ninverted > 0)
        return om_error(OM_NOT_CONVERGED, "tissue: %d elements are inverted at rest: " OM__INVERTED,
                        report->ninverted);
    return status;
}
