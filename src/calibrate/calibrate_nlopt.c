// calibrate_nlopt.c: NLopt's derivative-free searches. The only file that uses NLopt.
//
// SBPLX (a Subplex after Rowan 1990) is the default local stage: costs are sums of distances, which have
// kinks, and of simulations with contact, which have steps. BOBYQA (Powell 2009) is faster on smooth costs.
// NLopt receives twice the largest finite cost for an infinite one, since a model of the cost cannot
// contain infinity.
#include <math.h>
#include <nlopt.h>

#include "calibrate/calibrate_internal.h"

typedef struct Minimisation {
    OmSearch* s;
    nlopt_opt opt;
    double worst;  // largest finite cost so far
    OmStagnation stagnation;
    double best;
    int patience;
    OmStatus status;
    bool is_stagnant;
} Minimisation;

static double objective(unsigned n, const double* u, double* gradient, void* ctx) {
    (void)n, (void)gradient;
    Minimisation* m = ctx;
    double cost = INFINITY;
    m->status = om__search_one(m->s, u, &cost);
    if (m->status < 0) {
        nlopt_force_stop(m->opt);
        return 0;
    }
    if (isfinite(cost)) m->worst = fmax(m->worst, cost);
    m->best = fmin(m->best, cost);
    if (m->patience > 0 && om__search_is_stagnant(&m->stagnation, m->best, m->patience)) {
        m->is_stagnant = true;
        nlopt_force_stop(m->opt);
    }
    return isfinite(cost) ? cost : 2 * m->worst;
}

static nlopt_result set_up(nlopt_opt opt, Minimisation* m, const double* lo, const double* hi,
                           int max_eval) {
    const OmCalibrationDef* def = m->s->def;
    double step[OM_CALIBRATION_MAX_PARAM];
    for (int k = 0; k < m->s->n; ++k) step[k] = 0.25 * (hi[k] - lo[k]);
    nlopt_result r = nlopt_set_min_objective(opt, objective, m);
    if (r >= 0) r = nlopt_set_lower_bounds(opt, lo);
    if (r >= 0) r = nlopt_set_upper_bounds(opt, hi);
    if (r >= 0) r = nlopt_set_maxeval(opt, max_eval);
    if (r >= 0) r = nlopt_set_xtol_abs1(opt, def->tolerance);
    if (r >= 0) r = nlopt_set_initial_step(opt, step);
    return r;
}

static OmStatus minimise(Minimisation* m, const double* u0, const double* lo, const double* hi,
                         int max_eval, bool* is_done) {
    double u[OM_CALIBRATION_MAX_PARAM], cost;
    for (int k = 0; k < m->s->n; ++k) u[k] = fmin(fmax(u0[k], lo[k]), hi[k]);
    nlopt_result r = set_up(m->opt, m, lo, hi, max_eval);
    if (r >= 0) r = nlopt_optimize(m->opt, u, &cost);
    OM_TRY(m->status);
    OM_CHECK(r != NLOPT_OUT_OF_MEMORY, OM_NO_MEMORY, "NLopt is out of memory");
    // rounding that limits progress is a normal end, and so is our own stop
    bool is_end = r > 0 || r == NLOPT_ROUNDOFF_LIMITED || m->is_stagnant;
    OM_CHECK(is_end, OM_INVALID, "NLopt: %s: %s", nlopt_algorithm_name(nlopt_get_algorithm(m->opt)),
             nlopt_get_errmsg(m->opt) ? nlopt_get_errmsg(m->opt) : "failed");
    *is_done = r != NLOPT_MAXEVAL_REACHED;
    return OM_OK;
}

OmStatus om__calibrate_nlopt(OmSearch* s, OmNloptMethod method, const double* u0, const double* lo,
                             const double* hi, int max_eval, int patience, bool* is_done) {
    static const nlopt_algorithm algorithm[] = {NLOPT_GN_CRS2_LM, NLOPT_GN_ESCH, NLOPT_LN_SBPLX,
                                                NLOPT_LN_BOBYQA};
    // NLopt's BOBYQA refuses a single parameter
    nlopt_algorithm which = algorithm[method];
    if (which == NLOPT_LN_BOBYQA && s->n == 1) which = NLOPT_LN_SBPLX;
    Minimisation m = {.s = s, .worst = s->best >= 0 ? s->cost[s->best] : 0, .patience = patience};
    m.best = m.stagnation.mark = m.worst;
    m.opt = nlopt_create(which, (unsigned)s->n);
    OM_CHECK(m.opt, OM_NO_MEMORY, "NLopt is out of memory");
    nlopt_srand((unsigned long)s->def->seed);
    OmStatus status = minimise(&m, u0, lo, hi, max_eval, is_done);
    nlopt_destroy(m.opt);
    return status;
}
