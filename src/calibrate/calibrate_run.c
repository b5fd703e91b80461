// calibrate_run.c: the stages of a calibration (thesis Fig. 3.6): start, global, local, sensitivity, best.
//
// Only the journal is stored: a restarted calibration runs the same stages, which need the same evaluations
// in the same order, and the first of them are on file.
#include <math.h>
#include <string.h>

#include "calibrate/calibrate_internal.h"

#define SAID_FROM 1800.0  // s: a shorter search needs no estimate of its duration
// largest number of local searches; another one follows while the profiles find a better point
#define MAX_ROUND 3

// Hash of everything that determines the evaluations and their order.
static uint64_t hash_problem(const OmCalibrationDef* d) {
    uint64_t h = om_hash(&d->problem, sizeof d->problem, OM_HASH_SEED);
    for (int k = 0; k < d->nparam; ++k) {
        const OmCalibrationParam* p = &d->param[k];
        double v[] = {p->lo, p->hi, p->start, p->is_log};
        h = om_hash(p->name, strlen(p->name), h);
        h = om_hash(v, sizeof v, h);
    }
    double v[] = {d->norm_size, d->noise, d->local_range, d->tolerance, d->unfit, d->rise};
    int64_t n[] = {d->nparam,          d->nerror, d->norm,      d->global,   d->population,
                   d->max_generations, d->local,  d->max_local, d->patience, (int64_t)d->seed};
    h = om_hash(v, sizeof v, h);
    return om_hash(n, sizeof n, h);
}

static const double* best_point(const OmSearch* s) { return s->u + (size_t)s->best * (size_t)s->n; }

// ---- stages ---------------------------------------------------------------------------------------

static OmStatus run_start(OmSearch* s, OmCalibrationResult* r) {
    double u[OM_CALIBRATION_MAX_PARAM];
    for (int k = 0; k < s->n; ++k)
        u[k] = om__calibrate_to_unit(&s->def->param[k], s->def->param[k].start);
    om__search_begin(s, "start", 1);
    OM_TRY(om__search_batch(s, 1, u, r->error_start));
    r->cost_start = s->cost[0];
    return OM_OK;
}

// Estimate the remaining duration from the first evaluation and log it.
static void say_estimate(const OmSearch* s, double seconds) {
    const OmCalibrationDef* d = s->def;
    int np = d->population ? d->population : (int)fmax(12, 8 * s->n);
    int most_local = d->local == OM_LOCAL_NONE ? 0 : d->max_local ? d->max_local : 60 * s->n;
    double neval = (d->global == OM_GLOBAL_NONE ? 0.0 : (double)np * d->max_generations) +
                   most_local + (d->rise > 0 ? s->n * OM_CALIBRATION_NPROFILE : 0);
    double all = seconds * neval;
    if (s->nnew == 0 || all < SAID_FROM) return;  // evaluations from a journal take no time
    om_log(OM_LOG_WARNING,
           "one evaluation takes %.2g s: up to %.0f of them take up to %.3g hours; a smaller "
           "population, fewer generations, longer steps or a coarser mesh take less",
           seconds, neval, all / 3600);
}

static OmStatus run_global(OmSearch* s, OmCalibrationResult* r, bool* is_done) {
    const OmCalibrationDef* d = s->def;
    static const double lo[OM_CALIBRATION_MAX_PARAM];
    double hi[OM_CALIBRATION_MAX_PARAM], u0[OM_CALIBRATION_MAX_PARAM];
    int before = s->neval;
    if (d->global == OM_GLOBAL_EVOLUTION) {
        OM_TRY(om__calibrate_evolve(s, &r->ngeneration, is_done));
    } else if (d->global != OM_GLOBAL_NONE) {
        for (int k = 0; k < s->n; ++k) hi[k] = 1;
        memcpy(u0, s->u, (size_t)s->n * sizeof *u0);  // the start's coordinates
        int np = d->population ? d->population : (int)fmax(12, 8 * s->n);
        om__search_begin(s, "global search", np * d->max_generations);
        OM_TRY(om__calibrate_nlopt(s, d->global == OM_GLOBAL_CRS ? OM_NLOPT_CRS : OM_NLOPT_ESCH, u0,
                                   lo, hi, np * d->max_generations, np * d->patience, is_done));
    }
    r->nglobal = s->neval - before;
    r->cost_global = s->cost[s->best];
    OM_CHECK(isfinite(r->cost_global), OM_INVALID,
             "no parameters within the bounds gave a model, in %d evaluations", s->neval);
    return OM_OK;
}

// Is the smallest cost far above the noise?
static bool is_far(const OmSearch* s) {
    return s->def->noise > 0 && s->cost[s->best] > s->def->unfit * s->def->noise;
}

static OmStatus run_local(OmSearch* s, OmCalibrationResult* r, bool* is_done) {
    const OmCalibrationDef* d = s->def;
    if (d->local == OM_LOCAL_NONE) return OM_OK;
    double u[OM_CALIBRATION_MAX_PARAM], lo[OM_CALIBRATION_MAX_PARAM], hi[OM_CALIBRATION_MAX_PARAM];
    int before = s->neval, max_eval = d->max_local ? d->max_local : 60 * s->n;
    memcpy(u, best_point(s), (size_t)s->n * sizeof *u);
    for (int k = 0; k < s->n; ++k) {
        lo[k] = fmax(u[k] - 0.5 * d->local_range, 0);
        hi[k] = fmin(u[k] + 0.5 * d->local_range, 1);
    }
    om__search_begin(s, "local search", max_eval);
    OM_TRY(om__calibrate_nlopt(s, d->local == OM_LOCAL_BOBYQA ? OM_NLOPT_BOBYQA : OM_NLOPT_SBPLX, u,
                               lo, hi, max_eval, is_far(s) ? 10 * s->n : 0, is_done));
    r->nlocal += s->neval - before;
    return OM_OK;
}

// Error of the mesh at the best parameters, from one evaluation on a finer mesh. Elements of second order leave 1 /
// ratio^2 of their error on the finer mesh, so 1 / (1 - 1 / ratio^2) of the difference of the predictions is the whole
// error. The difference of the costs would not do: with the same parameters a finer mesh is as far from the
// observations as a mesh that is too stiff.
static OmStatus measure_mesh_error(OmSearch* s, OmCalibrationResult* r) {
    const OmCalibrationDef* d = s->def;
    if (!d->eval_finer) return OM_OK;
    double param[OM_CALIBRATION_MAX_PARAM], ratio = 1, min = s->cost[s->best];
    for (int k = 0; k < s->n; ++k)
        param[k] = om__calibrate_from_unit(&d->param[k], best_point(s)[k]);
    double* error = om_alloc(2 * (size_t)d->nerror, sizeof *error);
    if (!error) return OM_NO_MEMORY;
    om__search_begin(s, "finer mesh", 1);
    OmStatus status = d->eval_finer(d->ctx, param, s->nworker, error, &ratio);
    r->has_mesh = status == OM_OK && ratio > 1;
    if (r->has_mesh) {
        r->mesh_ratio = ratio;
        r->mesh_difference = om_calibration_norm_eval(d, d->nerror, error, error + d->nerror);
        r->mesh_cost = r->mesh_difference / (1 - 1 / (ratio * ratio));
        r->has_mesh = isfinite(r->mesh_cost);
        r->is_of_mesh = r->has_mesh && r->mesh_cost > (d->noise > 0 ? d->noise : min);
    }
    om_free(error);
    return status < 0 ? status : OM_OK;
}

// Local search (shorter where the model hardly fits) and profiles (none where it does not fit), repeated
// where a profile found a better point.
static OmStatus run_refinement(OmSearch* s, OmCalibrationResult* r, bool* is_done) {
    for (int round = 0; round < MAX_ROUND; ++round) {
        OM_TRY(run_local(s, r, is_done));
        if (s->def->rise == 0 || (*is_done && is_far(s))) return OM_OK;
        double cost = s->cost[s->best];
        int before = s->neval;
        OM_TRY(measure_mesh_error(s, r));
        double limit = om__calibrate_limit(s->def, s->cost[s->best]);
        double mesh_limit = r->is_of_mesh ? hypot(limit, r->mesh_cost) : 0;
        OM_TRY(om__calibrate_profile(s, mesh_limit, r->profile));
        r->nprofile += s->neval - before;
        r->has_profile = true;
        if (s->cost[s->best] > 0.99 * cost) return OM_OK;
    }
    return OM_OK;
}

static OmStatus run_stages(OmSearch* s, OmCalibrationResult* r) {
    bool is_done = false;
    double start = om_clock_now();
    OM_TRY(run_start(s, r));
    say_estimate(s, om_clock_now() - start);
    OM_TRY(run_global(s, r, &is_done));
    OM_TRY(run_refinement(s, r, &is_done));
    r->outcome = !is_done    ? OM_CALIBRATION_BUDGET
                 : is_far(s) ? OM_CALIBRATION_UNFIT
                             : OM_CALIBRATED;
    double u[OM_CALIBRATION_MAX_PARAM];
    memcpy(u, best_point(s), (size_t)s->n * sizeof *u);
    om__search_begin(s, "best", 1);
    return om__search_batch(s, 1, u, r->error);
}

// ---- the whole calibration ------------------------------------------------------------------------

static OmStatus fill_result(OmSearch* s, OmCalibrationResult* r) {
    r->neval = s->neval;
    r->nnew = s->nnew;
    r->cost = s->cost[s->best];
    for (int k = 0; k < s->n; ++k)
        r->best[k] = om__calibrate_from_unit(&s->def->param[k], best_point(s)[k]);
    OM_ALLOC(r->trace, s->neval);
    memcpy(r->trace, s->cost, (size_t)s->neval * sizeof *r->trace);
    return OM_OK;
}

OmStatus om_calibration_run(const OmCalibrationDef* def, const OmProgress* progress,
                            OmCalibrationResult* result) {
    memset(result, 0, sizeof *result);
    OM_TRY(om__calibrate_check(def));
    OmStatus status;
    OmFolder folder = {0};
    OmSearch s = {
        .def = def, .progress = progress, .n = def->nparam, .nworker = def->nworker, .best = -1};
    result->nparam = def->nparam;
    result->nerror = def->nerror;
    s.journal.fd = -1;
    if (def->out_dir) OM_TRY_DONE(om_folder_open(def->out_dir, "calibration", &folder));
    OM_TRY_DONE(om__journal_open(&s.journal, def->out_dir, def, hash_problem(def)));
    OM_CALLOC_DONE(result->error_start, def->nerror);
    OM_CALLOC_DONE(result->error, def->nerror);
    OM_TRY_DONE(run_stages(&s, result));
    OM_TRY_DONE(fill_result(&s, result));
    if (def->out_dir) OM_TRY_DONE(om__calibrate_report(def, result));
    if (result->outcome == OM_CALIBRATION_BUDGET) status = OM_NOT_CONVERGED;
    if (result->outcome == OM_CALIBRATION_UNFIT) status = OM_UNSAT;
done:
    om__journal_close(&s.journal);
    om_folder_end(&folder);
    om_free(s.u);
    om_free(s.cost);
    if (status < 0) om_calibration_result_done(result);
    return status;
}

void om_calibration_result_done(OmCalibrationResult* result) {
    if (!result) return;
    om_free(result->error_start);
    om_free(result->error);
    om_free(result->trace);
    memset(result, 0, sizeof *result);
}
