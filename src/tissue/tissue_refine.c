// tissue_refine.c: Newton's direction where the engine's matrix is only an upper bound of the tangent (averaged
// strains).
//
// Conjugate gradients solve H d = r, where H is the exact tangent of the forces: H p is a central difference of forces
// in double, and an inexact solve with A is the preconditioner (hence the form of Polak and Ribiere). With A in place
// of H the convergence rate of Newton's method is 1 - H / A: at nu = 0.49 a tenth of the residual was left after 400
// iterations.
#include <string.h>

#include "tissue/tissue_internal.h"

#define MAX_ITERATIONS 60
#define PRECONDITIONED 0.1  // relative residual of a solve with A
#define REFINED 0.03        // relative residual of the solve with H
#define DIFFERENCE 1e-6     // largest displacement in a difference, relative to the body's size

enum { R, R_OLD, Z, P, HP, D, X, F_MINUS, F_PLUS, NARRAY };

static double* array_of(const OmTissueWork* w, int k) {
    return w->refine + (size_t)k * 3 * (size_t)w->nvert;
}

OmStatus om__refine_create(OmTissueWork* w) {
    w->refine = om_calloc((size_t)w->nvert, 3 * NARRAY * sizeof *w->refine);
    return w->refine ? OM_OK : OM_NO_MEMORY;
}

static double dot(const OmTissueWork* w, int a, int b) {
    double sum = 0;
    for (int i = 0; i < w->nvert; ++i)
        if (!w->key[i]) sum += om_dot(om_load3(array_of(w, a), i), om_load3(array_of(w, b), i));
    return sum;
}

// HP = H P about w->x_end.
static OmStatus apply_tangent(const OmTissueModel* m, const OmTissueState* s, OmTissueWork* w) {
    double *x = array_of(w, X), *p = array_of(w, P), *minus = array_of(w, F_MINUS),
           *plus = array_of(w, F_PLUS), largest = 0, energy, h = w->h;
    size_t n3 = 3 * (size_t)w->nvert;
    for (size_t n = 0; n < n3; ++n) largest = fmax(largest, fabs(p[n]));
    double step = largest > 0 ? DIFFERENCE * m->size / largest : 0;
    for (size_t n = 0; n < n3; ++n) x[n] = w->x_end[n] - step * p[n];
    OM_TRY(m->engine->eval_balance(m, w, x, minus, &energy));
    for (size_t n = 0; n < n3; ++n) x[n] = w->x_end[n] + step * p[n];
    OM_TRY(m->engine->eval_balance(m, w, x, plus, &energy));
    double stiffness = h * h + (w->is_static ? 0 : h * m->def.rayleigh_stiffness);
    double mass = w->is_static ? 0 : 1 + h * m->def.rayleigh_mass;
    for (int i = 0; i < w->nvert; ++i) {
        OmVec3 Kp = om_sub(om_load3(minus, i), om_load3(plus, i));
        double own = mass * m->mass[i] + h * h * om__state_stiffness(s)[i];
        OmVec3 y = om_scale(own, om_load3(p, i));
        if (step > 0) y = om_madd(y, stiffness / (2 * step), Kp);
        om_store3(array_of(w, HP), i, y);
    }
    return OM_OK;
}

// Z = A^-1 R, solved to PRECONDITIONED.
static OmStatus precondition(const OmTissueModel* m, OmTissueWork* w, OmTissueReport* report) {
    OmSolveInfo info = {0};
    memset(array_of(w, Z), 0, 3 * (size_t)w->nvert * sizeof(double));
    om_tissue_set_tolerance(w, PRECONDITIONED);
    OmStatus status = om_tissue_solve(m, w, 1, array_of(w, R), array_of(w, Z), &info);
    om_tissue_set_tolerance(w, 0);
    report->iterations += info.iterations;
    return status < 0 ? status : OM_OK;
}

OmStatus om__refine(const OmTissueModel* m, const OmTissueState* s, OmTissueWork* w,
                    OmTissueReport* report) {
    size_t n3 = 3 * (size_t)w->nvert;
    double *r = array_of(w, R), *old = array_of(w, R_OLD), *z = array_of(w, Z), *p = array_of(w, P),
           *Hp = array_of(w, HP), *d = array_of(w, D), gamma = 0, goal = 0;
    memset(d, 0, n3 * sizeof *d);
    memset(p, 0, n3 * sizeof *p);
    om_bsr_apply(&w->A, m->def.solver.nworker, w->from, r);
    for (size_t n = 0; n < n3; ++n) r[n] = w->b[n] - r[n];
    for (int k = 0; k < MAX_ITERATIONS; ++k) {
        double size = dot(w, R, R);
        if (k == 0) goal = REFINED * REFINED * size;
        if (size <= goal) break;
        OM_TRY(precondition(m, w, report));
        double now = dot(w, Z, R), beta = k > 0 ? fmax(now - dot(w, Z, R_OLD), 0) / gamma : 0;
        gamma = now;
        for (size_t n = 0; n < n3; ++n) p[n] = z[n] + beta * p[n];
        OM_TRY(apply_tangent(m, s, w));
        double curvature = dot(w, P, HP);
        // Negative curvature ends the iteration with the last d; in the first iteration d = z, a descent direction.
        if (!(curvature > 0)) {
            if (k == 0) memcpy(d, p, n3 * sizeof *d);
            break;
        }
        double alpha = dot(w, R, P) / curvature;
        memcpy(old, r, n3 * sizeof *r);
        for (size_t n = 0; n < n3; ++n) {
            d[n] += alpha * p[n];
            r[n] -= alpha * Hp[n];
        }
    }
    for (int i = 0; i < w->nvert; ++i)
        if (!w->key[i]) om_store3(w->dv, i, om_add(om_load3(w->from, i), om_load3(d, i)));
    w->is_fresh = false;
    return OM_OK;
}
