// fem_dynamic.c: implicit Euler and the implicit midpoint rule, fully converged, and central differences.
//
// Euler: M (x1 - x0 - h v0) / h^2 + M a (x1 - x0) / h + dW/dx(x1) = f, with mass damping a, is equilibrium with an
// inertia c |x - x_hat|^2 / 2 of c = 1 / h^2 + a / h. Midpoint: xm = (x0 + x1) / 2 is an Euler step of h / 2, and
// x1 = 2 xm - x0, v1 = 2 vm - v0: momenta are kept, energy to second order (Simo, Tarnow and Wong 1992).
// Central differences: v += h M^-1 (f - dW/dx) / (1 + a h / 2) with damping taken at the middle, x += h v.
#include <string.h>

#include "fem/fem_solid.h"

#define COOKIE 0x50f7f303u

struct OmFemDynamics {
    const OmFemSolid* solid;
    OmFemDynamicDef def;
    OmFemNewton newton;                   // dead, r and fixed are also used by central differences
    double *x, *target, *goal, *x0, *v0;  // of a step                                 (nnode x 3)
};

OmFemDynamicDef om_fem_dynamic_default_def(const OmFemSolid* solid) {
    return (OmFemDynamicDef){.integrator = OM_IMPLICIT_EULER,
                             .min_step = 1.0 / 64,
                             .max_newton = 30,
                             .tolerance = 1e-9,
                             .solver = om__newton_solver_def(solid),
                             .cookie = COOKIE};
}

static OmStatus check_def(const OmFemDynamicDef* def) {
    OM_CHECK(def->cookie == COOKIE, OM_INVALID,
             "OmFemDynamicDef was not made by om_fem_dynamic_default_def");
    OM_CHECK(def->integrator >= OM_IMPLICIT_EULER && def->integrator <= OM_CENTRAL_DIFFERENCE,
             OM_INVALID, "OmFemDynamicDef.integrator = %d is none of OmIntegrator",
             (int)def->integrator);
    OM_CHECK(def->integrator != OM_CENTRAL_DIFFERENCE || !def->is_consistent_mass, OM_INVALID,
             "OM_CENTRAL_DIFFERENCE needs the lumped mass");
    OM_CHECK(def->mass_damping >= 0 && isfinite(def->mass_damping), OM_INVALID,
             "OmFemDynamicDef.mass_damping = %g 1/s, must not be negative", def->mass_damping);
    OM_CHECK(def->min_step > 0 && def->min_step <= 1, OM_INVALID,
             "OmFemDynamicDef.min_step = %g, must be in (0, 1]", def->min_step);
    OM_CHECK(def->max_newton >= 1, OM_INVALID,
             "OmFemDynamicDef.max_newton = %d, must be at least 1", def->max_newton);
    OM_CHECK(def->tolerance > 0 && def->tolerance < 1, OM_INVALID,
             "OmFemDynamicDef.tolerance = %g, must be in (0, 1)", def->tolerance);
    return OM_OK;
}

OmStatus om_fem_dynamics_create(const OmFemSolid* s, const OmFemDynamicDef* def,
                                OmFemDynamics** out) {
    *out = NULL;
    OM_TRY(check_def(def));
    OmStatus status = OM_OK;
    size_t n = 3 * (size_t)s->mesh.nnode;
    OmFemDynamics* d = om_calloc(1, sizeof *d);
    if (!d) return OM_NO_MEMORY;
    d->solid = s;
    d->def = *def;
    OmSolverDef solver = def->solver;
    if (def->integrator == OM_CENTRAL_DIFFERENCE) solver.preconditioner = OM_BLOCK_JACOBI;
    OM_TRY_DONE(om__newton_create(s, &solver, &d->newton));
    d->newton.is_explicit = def->integrator == OM_CENTRAL_DIFFERENCE;
    d->newton.max_newton = def->max_newton;
    d->newton.tolerance = def->tolerance;
    d->newton.is_consistent = def->is_consistent_mass;
    d->newton.is_lumped = !def->is_consistent_mass;
    OM_ALLOC_DONE(d->x, n);
    OM_ALLOC_DONE(d->target, n);
    OM_ALLOC_DONE(d->goal, n);
    OM_ALLOC_DONE(d->x0, n);
    OM_ALLOC_DONE(d->v0, n);
    *out = d;
done:
    if (status < 0) om_fem_dynamics_destroy(d);
    return status;
}

void om_fem_dynamics_destroy(OmFemDynamics* d) {
    if (!d) return;
    if (d->newton.solid) om__newton_done(&d->newton);
    om_free(d->x);
    om_free(d->target);
    om_free(d->goal);
    om_free(d->x0);
    om_free(d->v0);
    om_free(d);
}

// One implicit step from motion; prescribed nodes move to d->target.
static OmStatus implicit_step(OmFemDynamics* d, double h, OmFemMotion* m, OmFemReport* report) {
    OmFemNewton* N = &d->newton;
    size_t n = 3 * (size_t)d->solid->mesh.nnode;
    bool is_midpoint = d->def.integrator == OM_IMPLICIT_MIDPOINT;
    double k = is_midpoint ? 0.5 * h : h, a = d->def.mass_damping;
    N->inertia = 1 / (k * k) + a / k;
    for (size_t i = 0; i < n; ++i) {
        N->x_hat[i] = m->x[i] + k * m->v[i] / (1 + a * k);
        d->x[i] = m->x[i];
        if (is_midpoint) d->target[i] = 0.5 * (m->x[i] + d->target[i]);
    }
    OmStatus status = om__newton_solve(N, 1, d->target, d->x, NULL, report);
    if (status != OM_OK) return status;
    for (size_t i = 0; i < n; ++i) {
        double v = (d->x[i] - m->x[i]) / k;
        m->x[i] = is_midpoint ? 2 * d->x[i] - m->x[i] : d->x[i];
        m->v[i] = is_midpoint ? 2 * v - m->v[i] : v;
    }
    m->time += h;
    return OM_OK;
}

static OmStatus explicit_step(OmFemDynamics* d, const OmFemLoad* load, double h, OmFemMotion* m) {
    OmFemNewton* N = &d->newton;
    const OmFemSolid* s = d->solid;
    double* f = N->trial;
    double a = d->def.mass_damping, extra = 0;
    OM_TRY(om_fem_eval_force(s, m->x, N->r, NULL));
    memcpy(f, N->dead, 3 * (size_t)s->mesh.nnode * sizeof *f);
    om__fem_add_follower(load, m->x, 1, f, NULL);
    if (load->extra) OM_TRY(load->extra->eval(load->extra->ctx, m->x, 1, &extra, N->r, NULL));
    bool is_finite = true;
    for (int i = 0; i < 3 * s->mesh.nnode; ++i) {
        double push = (f[i] - N->r[i]) / s->mass[i / 3];
        double v = ((1 - 0.5 * a * h) * m->v[i] + h * push) / (1 + 0.5 * a * h);
        if (N->fixed[i]) v = (d->target[i] - m->x[i]) / h;
        d->x[i] = m->x[i] + h * v;
        N->dx[i] = v;
        is_finite = is_finite && isfinite(d->x[i]);
    }
    OM_CHECK(is_finite, OM_INVALID,
             "the explicit step of %g s is not stable: see om_fem_eval_stable_step", h);
    memcpy(m->x, d->x, 3 * (size_t)s->mesh.nnode * sizeof *f);
    memcpy(m->v, N->dx, 3 * (size_t)s->mesh.nnode * sizeof *f);
    m->time += h;
    return OM_OK;
}

// Implicit steps, halved where they fail; prescribed nodes move uniformly over the whole of h.
static OmStatus cut_steps(OmFemDynamics* d, double h, OmFemMotion* m, OmFemReport* report) {
    const double* goal = d->goal;
    size_t n = 3 * (size_t)d->solid->mesh.nnode;
    double done = 0, part = 1, begin = m->time;
    while (done < 1) {
        double next = fmin(done + part, 1);
        for (size_t i = 0; i < n; ++i)
            d->target[i] = next < 1 ? d->x0[i] + next * (goal[i] - d->x0[i]) : goal[i];
        OmStatus status = implicit_step(d, (next - done) * h, m, report);
        if (status < 0) return status;
        if (status == OM_OK) {
            done = next;
            ++report->nstep;
            continue;
        }
        ++report->ncut;
        part *= 0.5;
        if (part < d->def.min_step)
            return om_error(OM_NOT_CONVERGED, "the step stopped at %g of %g s: %s", done * h, h,
                            report->reason);
    }
    m->time = begin + h;
    report->load = 1;
    return OM_OK;
}

OmStatus om_fem_step(OmFemDynamics* d, const OmFemLoad* load, double h, OmFemMotion* m,
                     OmFemReport* out) {
    OmFemReport report = {.load = 1};
    OmFemNewton* N = &d->newton;
    const double* rest = d->solid->mesh.x;
    size_t n = 3 * (size_t)d->solid->mesh.nnode;
    OM_CHECK(h > 0 && isfinite(h), OM_INVALID, "om_fem_step: the step is %g s, must be above 0", h);
    for (size_t i = 0; i < n; ++i)
        OM_CHECK(isfinite(m->x[i]) && isfinite(m->v[i]), OM_INVALID,
                 "om_fem_step: position or velocity of node %d is not finite", (int)(i / 3));
    OM_TRY(om__newton_set_load(N, load));
    memcpy(d->x0, m->x, n * sizeof *d->x0);
    memcpy(d->v0, m->v, n * sizeof *d->v0);
    double time = m->time;
    // target of prescribed nodes; free entries are not used
    for (size_t i = 0; i < n; ++i)
        d->target[i] = N->fixed[i] ? rest[i] + (load->goal ? load->goal[i] : 0) : m->x[i];
    OmStatus status;
    if (d->def.integrator == OM_CENTRAL_DIFFERENCE) {
        status = explicit_step(d, load, h, m);
    } else {
        memcpy(d->goal, d->target, n * sizeof *d->goal);
        status = cut_steps(d, h, m, &report);
    }
    if (status < 0) {
        memcpy(m->x, d->x0, n * sizeof *d->x0);
        memcpy(m->v, d->v0, n * sizeof *d->v0);
        m->time = time;
    }
    if (out) {
        report.min_volume = om_fem_eval_volume(d->solid, m->x, NULL);
        *out = report;
    }
    return status;
}

double om_fem_eval_momentum(const OmFemSolid* s, bool is_consistent, const OmFemMotion* m,
                            OmVec3* linear, OmVec3* angular) {
    size_t k = (size_t)s->mesh.nelem_node;
    OmVec3 p = {0, 0, 0}, L = {0, 0, 0};
    double energy = 0;
    for (int i = 0; i < s->mesh.nnode && !is_consistent; ++i) {
        OmVec3 v = om_load3(m->v, i);
        p = om_madd(p, s->mass[i], v);
        L = om_madd(L, s->mass[i], om_cross(om_load3(m->x, i), v));
        energy += 0.5 * s->mass[i] * om_norm2(v);
    }
    for (size_t n = 0; n < (size_t)s->mesh.nelem * k * k && is_consistent; ++n) {
        int a = s->mesh.elem_node[n / k], b = s->mesh.elem_node[n / (k * k) * k + n % k];
        OmVec3 v = om_load3(m->v, b);
        p = om_madd(p, s->elem_mass[n], v);
        L = om_madd(L, s->elem_mass[n], om_cross(om_load3(m->x, a), v));
        energy += 0.5 * s->elem_mass[n] * om_dot(om_load3(m->v, a), v);
    }
    if (linear) *linear = p;
    if (angular) *angular = L;
    return energy;
}
