// tissue_newton.c: Newton's method on the incremental potential, for steps that one linearisation does not solve
// and for bodies at rest.
//
// With dv the velocity change of a step, implicit Euler is the stationary point of
//
//     Phi(dv) = m/2 |dv|^2_M + h a/2 |v|^2_M + W(x) + springs - x . (f_ext + M g),   v = v0 + dv, x = x0 + h v
//
// (Radovitzky and Ortiz 1999); at rest the terms with M vanish and h is 1. The engine's tangent is projected, so
// the step to the solution of the linearised problem goes down Phi, and halving it until Phi falls enough
// (Armijo) always ends. The linearised problem is posed for dv itself, A dv = A dv_k - grad Phi(dv_k): whoever
// solves the first one (contact) can solve the next. Its forces are not in Phi: then a step is halved only until
// it turns nothing inside out.
#include <string.h>

#include "tissue/tissue_engine.h"

#define ARMIJO 1e-4
#define MIN_STEP (1.0 / 1024)
#define FORCING 0.03  // of the norm that a linear solve leaves

// x_end and v_end of a velocity change.
static void move_to(const OmTissueState* s, OmTissueWork* w, const double* dv) {
    const double *x = om__state_array(s, OM__X), *v = om__state_array(s, OM__V);
    for (size_t n = 0; n < 3 * (size_t)w->nvert; ++n) {
        w->v_end[n] = v[n] + dv[n];
        w->x_end[n] = x[n] + w->h * w->v_end[n];
    }
}

// Phi, elastic damping left out.
static double eval_potential(const OmTissueModel* m, const OmTissueState* s, OmTissueWork* w,
                             const double* dv) {
    double inertia = 0, damping = 0, work = 0, spring = 0;
    const double *anchor = om__state_array(s, OM__ANCHOR), *f = om__state_array(s, OM__F_EXT);
    move_to(s, w, dv);
    for (int i = 0; i < w->nvert; ++i) {
        OmVec3 x = om_load3(w->x_end, i);
        inertia += m->mass[i] * om_norm2(om_load3(dv, i));
        damping += m->mass[i] * om_norm2(om_load3(w->v_end, i));
        work += om_dot(om_madd(om_load3(f, i), m->mass[i], m->def.gravity),
                       om_sub(x, om_load3(m->mesh.x, i)));
        if (om__is_spring(m) && om__state_attached(s)[i])
            spring += om_norm2(om_sub(x, om_load3(anchor, i)));
    }
    double elastic = m->engine->get_energy(m, w->x_end);
    double moving = w->is_static ? 0 : 0.5 * inertia + 0.5 * w->h * m->def.rayleigh_mass * damping;
    return moving + elastic + 0.5 * m->def.attachment_stiffness * spring - work;
}

// A at dv, and b so that A dv_next = b is Newton's next iterate; norm: of grad Phi over free vertices.
static OmStatus linearise_at(const OmTissueModel* m, const OmTissueState* s, OmTissueWork* w,
                             const double* dv, double* norm) {
    double h = w->h, damping = w->is_static ? 0 : m->def.rayleigh_stiffness, sum = 0;
    move_to(s, w, dv);
    OmAssembly at = {.x = w->x_end,
                     .v = w->v_end,
                     .mass = w->is_static ? 0 : 1 + h * m->def.rayleigh_mass,
                     .stiffness = h * h + h * damping,
                     .force = h,
                     .lag = damping,
                     .spring = h * h};
    om_tissue_clear_forces(w);
    OM_TRY(m->engine->assemble(m, s, w, &at));
    om_bsr_apply(&w->A, m->def.solver.nworker, dv, w->trial);
    for (int i = 0; i < w->nvert; ++i) {
        double mass = w->is_static ? 0 : m->mass[i];
        OmVec3 down = om_madd(om_load3(w->b, i), -mass, om_load3(dv, i));  // -grad Phi
        if (!w->key[i]) sum += om_norm2(down);
        om_store3(w->b, i, om_add(om_load3(w->trial, i), down));
    }
    w->is_stale = true;
    *norm = sqrt(sum);
    return OM_OK;
}

// |A (b - a)| over free vertices, and -(b - a) . A (b - a): at the solution of a linearised problem without
// contact these are |grad Phi| and its slope along the way.
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

// Shorten the way from w->from to w->dv until it goes down far enough; the share that is left.
static double search_line(const OmTissueModel* m, const OmTissueState* s, OmTissueWork* w,
                          bool has_contact, double slope) {
    size_t n3 = 3 * (size_t)w->nvert;
    double begin = has_contact ? 0 : eval_potential(m, s, w, w->from), t = 1;
    for (; t > MIN_STEP; t *= 0.5) {
        for (size_t n = 0; n < n3; ++n) w->trial[n] = w->from[n] + t * (w->dv[n] - w->from[n]);
        if (has_contact ? !om__is_crushing(m, s, w, w->trial)
                        : eval_potential(m, s, w, w->trial) <=
                              begin + ARMIJO * t * slope + 1e-13 * fabs(begin))
            break;
    }
    memcpy(w->dv, w->trial, n3 * sizeof *w->dv);
    return t;
}

// Where to begin: at the solution of the first linearisation, or with free vertices going on as they were.
static void choose_start(const OmTissueModel* m, const OmTissueState* s, OmTissueWork* w,
                         bool has_contact) {
    for (int i = 0; i < w->nvert; ++i)
        om_store3(w->from, i, w->key[i] ? om_load3(w->dv, i) : om_vec3(0, 0, 0));
    if (w->is_static) return;
    bool is_better = has_contact
                         ? !om__is_crushing(m, s, w, w->dv)
                         : eval_potential(m, s, w, w->dv) < eval_potential(m, s, w, w->from);
    if (is_better) memcpy(w->from, w->dv, 3 * (size_t)w->nvert * sizeof *w->dv);
}

OmStatus om__newton(const OmTissueModel* m, OmTissueState* s, OmTissueWork* w,
                    const OmNewton* newton, OmTissueReport* report) {
    bool has_contact = newton->fn != NULL;
    double scale = newton->scale, norm = 0, slope, t = 1;
    choose_start(m, s, w, has_contact);
    for (int k = 0; k <= newton->max_iterations; ++k) {
        OM_TRY(linearise_at(m, s, w, w->from, &norm));
        if (k == 0 && !(scale > 0)) scale = norm;
        if (!has_contact) report->newton_residual = scale > 0 ? norm / scale : 0;
        memcpy(w->dv, w->from, 3 * (size_t)w->nvert * sizeof *w->dv);
        w->is_fresh = false;
        if (!has_contact && norm <= newton->tolerance * scale) return OM_OK;
        if (k == newton->max_iterations) break;
        w->reference = FORCING / fmax(m->def.solver.tolerance, 1e-12) * norm;
        OmStatus status = has_contact ? newton->fn(newton->ctx, m, s, w, w->h, report)
                                      : om_tissue_solve_step(m, s, w, report);
        w->reference = 0;
        if (status < 0) return status;
        norm = measure_way(m, w, w->from, w->dv, &slope);
        t = search_line(m, s, w, has_contact, slope);
        ++report->newton;
        if (has_contact) {
            report->newton_residual = scale > 0 ? norm / scale : 0;
            if (t == 1 && norm <= newton->tolerance * scale) return OM_OK;
        }
        memcpy(w->from, w->dv, 3 * (size_t)w->nvert * sizeof *w->dv);
        if (t <= MIN_STEP) break;
    }
    return om_error(OM_NOT_CONVERGED, "tissue: residual %.3g after %d iterations of Newton",
                    report->newton_residual, report->newton);
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
    memcpy(w->backup, s, s->size);
    memset(om__state_array(s, OM__V), 0, 3 * (size_t)w->nvert * sizeof(double));
    w->is_static = true;
    OmStatus status = om_tissue_begin_step(m, s, w, 1);
    OmNewton newton = {.tolerance = tolerance, .max_iterations = max_iterations};
    if (status >= 0) status = om__newton(m, s, w, &newton, report);
    double time = s->time;
    OmStatus end = status < 0 ? status : om_tissue_end_step(m, s, w);
    w->is_static = false;
    w->h = 0;
    if (end < 0) {
        memcpy((void*)s, w->backup, s->size);
        return end;
    }
    s->time = time;
    report->substeps = 1;
    memset(om__state_array(s, OM__V), 0, 3 * (size_t)w->nvert * sizeof(double));
    return status;
}
