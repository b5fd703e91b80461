// calibrate_def.c: definitions, their validation, and the norms of errors.
#include <math.h>
#include <string.h>

#include "calibrate/calibrate_internal.h"

#define COOKIE 0x43414c42u

OmCalibrationDef om_calibration_default_def(OmCalibrationFn eval, void* ctx, int nerror) {
    OmCalibrationDef def = {.title = "Calibration",
                            .eval = eval,
                            .ctx = ctx,
                            .nerror = nerror,
                            .global = OM_GLOBAL_EVOLUTION,
                            .max_generations = 40,
                            .local = OM_LOCAL_SUBPLEX,
                            .local_range = 0.4,
                            .tolerance = 1e-3,
                            .patience = 8,
                            .unfit = 4,
                            .rise = 0.1,
                            .seed = 1,
                            .cookie = COOKIE};
    return def;
}

void om_calibration_add_param(OmCalibrationDef* def, const char* name, double lo, double hi,
                              double start, bool is_log) {
    int k = def->nparam++;
    if (k >= OM_CALIBRATION_MAX_PARAM) return;  // om_calibration_run refuses too many parameters
    OmCalibrationParam p = {.lo = lo, .hi = hi, .start = start, .is_log = is_log, .unit = 1};
    snprintf(p.name, sizeof p.name, "%s", name);
    def->param[k] = p;
}

// ---- validation -----------------------------------------------------------------------------------

static OmStatus check_param(const OmCalibrationDef* def, int k) {
    const OmCalibrationParam* p = &def->param[k];
    OM_CHECK(p->name[0], OM_INVALID, "param[%d].name is empty", k);
    for (int i = 0; i < k; ++i)
        OM_CHECK(strcmp(def->param[i].name, p->name) != 0, OM_INVALID,
                 "param[%d].name: two parameters are called \"%s\"", k, p->name);
    OM_CHECK(isfinite(p->lo) && isfinite(p->hi) && p->lo < p->hi, OM_INVALID,
             "param[%d] (%s): bounds %g to %g: lo must be below hi", k, p->name, p->lo, p->hi);
    OM_CHECK(p->start >= p->lo && p->start <= p->hi, OM_INVALID,
             "param[%d] (%s): start %g is outside its bounds, %g to %g", k, p->name, p->start,
             p->lo, p->hi);
    OM_CHECK(!p->is_log || p->lo > 0, OM_INVALID,
             "param[%d] (%s): a logarithm needs lo > 0, it is %g", k, p->name, p->lo);
    OM_CHECK(isfinite(p->unit) && p->unit > 0, OM_INVALID, "param[%d] (%s): unit %g must be > 0", k,
             p->name, p->unit);
    return OM_OK;
}

static OmStatus check_labels(const OmCalibrationDef* def) {
    OM_CHECK(def->nexperiment > 0 && def->experiment && def->nlandmark > 0 && def->landmark,
             OM_INVALID, "label needs the names of experiments and landmarks");
    for (int i = 0; i < def->nerror; ++i) {
        const OmCalibrationLabel* l = &def->label[i];
        OM_CHECK(l->experiment >= 0 && l->experiment < def->nexperiment && l->landmark >= 0 &&
                     l->landmark < def->nlandmark && isfinite(l->level),
                 OM_INVALID, "label[%d]: no such experiment, landmark or level", i);
    }
    return OM_OK;
}

static OmStatus check_search(const OmCalibrationDef* def) {
    OM_CHECK(def->global >= 0 && def->global < OM_NGLOBAL, OM_INVALID, "global: no such method, %d",
             (int)def->global);
    OM_CHECK(def->local >= 0 && def->local < OM_NLOCAL, OM_INVALID, "local: no such method, %d",
             (int)def->local);
    OM_CHECK(def->global != OM_GLOBAL_NONE || def->local != OM_LOCAL_NONE, OM_INVALID,
             "global and local are both none: nothing to do");
    OM_CHECK(def->population == 0 || (def->population >= 5 && def->population <= 10000), OM_INVALID,
             "population is %d: 0 or 5 to 10000", def->population);
    OM_CHECK((double)def->population * def->max_generations <= OM_CALIBRATION_MAX_EVALUATION,
             OM_INVALID,
             "population x generations is %d x %d; at most %d evaluations are possible: take fewer "
             "of either",
             def->population, def->max_generations, OM_CALIBRATION_MAX_EVALUATION);
    OM_CHECK(def->max_generations >= 1 && def->max_generations <= 100000, OM_INVALID,
             "max_generations is %d: 1 to 100000", def->max_generations);
    OM_CHECK(def->max_local >= 0 && def->max_local <= 1000000, OM_INVALID,
             "max_local is %d: 0 to 1000000", def->max_local);
    OM_CHECK(def->local_range > 0 && def->local_range <= 1, OM_INVALID,
             "local_range is %g: in (0, 1]", def->local_range);
    OM_CHECK(def->tolerance > 0 && def->tolerance < 1, OM_INVALID, "tolerance is %g: in (0, 1)",
             def->tolerance);
    OM_CHECK(def->patience >= 1, OM_INVALID, "patience is %d: at least 1", def->patience);
    OM_CHECK(def->unfit >= 1, OM_INVALID, "unfit is %g: at least 1", def->unfit);
    OM_CHECK(def->rise >= 0 && isfinite(def->rise), OM_INVALID, "rise is %g: at least 0",
             def->rise);
    return OM_OK;
}

OmStatus om__calibrate_check(const OmCalibrationDef* def) {
    OM_CHECK(def->cookie == COOKIE, OM_INVALID,
             "the definition was not made by om_calibration_default_def");
    OM_CHECK(def->eval, OM_INVALID, "eval is null");
    OM_CHECK(def->nparam >= 1 && def->nparam <= OM_CALIBRATION_MAX_PARAM, OM_INVALID,
             "nparam is %d: 1 to %d", def->nparam, OM_CALIBRATION_MAX_PARAM);
    OM_CHECK(def->nerror >= 1, OM_INVALID, "nerror is %d: there is no observation", def->nerror);
    OM_CHECK(def->norm >= 0 && def->norm < OM_NNORM, OM_INVALID, "norm: no such norm, %d",
             (int)def->norm);
    OM_CHECK(isfinite(def->noise) && def->noise >= 0, OM_INVALID, "noise is %g: at least 0",
             def->noise);
    OM_CHECK(def->norm != OM_NORM_HUBER || def->norm_size > 0 || def->noise > 0, OM_INVALID,
             "the Huber norm needs norm_size or noise");
    OM_CHECK(def->norm != OM_NORM_TRIMMED || (def->norm_size >= 0 && def->norm_size < 1),
             OM_INVALID, "norm_size is %g: of the trimmed norm in [0, 1)", def->norm_size);
    for (int k = 0; k < def->nparam; ++k) OM_TRY(check_param(def, k));
    if (def->label) OM_TRY(check_labels(def));
    return check_search(def);
}

// ---- search coordinates ---------------------------------------------------------------------------

double om__calibrate_from_unit(const OmCalibrationParam* p, double u) {
    if (u <= 0) return p->lo;
    if (u >= 1) return p->hi;
    double v = p->is_log ? p->lo * exp(u * log(p->hi / p->lo)) : p->lo + u * (p->hi - p->lo);
    return fmin(fmax(v, p->lo), p->hi);
}

double om__calibrate_to_unit(const OmCalibrationParam* p, double v) {
    double u = p->is_log ? log(v / p->lo) / log(p->hi / p->lo) : (v - p->lo) / (p->hi - p->lo);
    return fmin(fmax(u, 0), 1);
}

// ---- norms ----------------------------------------------------------------------------------------

double om_calibration_norm_eval(const OmCalibrationDef* def, int n, const double* error,
                                double* sorted) {
    double sum = 0, s = def->norm_size > 0 ? def->norm_size : 2 * def->noise;
    for (int i = 0; i < n; ++i)
        if (!isfinite(error[i])) return INFINITY;
    switch (def->norm) {
    case OM_NORM_SQUARE:
        for (int i = 0; i < n; ++i) sum += error[i] * error[i];
        return sqrt(sum / n);
    case OM_NORM_HUBER:
        for (int i = 0; i < n; ++i)
            sum += error[i] <= s ? 0.5 * error[i] * error[i] / s : error[i] - 0.5 * s;
        return sum / n;
    case OM_NORM_TRIMMED: {
        double trimmed = def->norm_size > 0 ? def->norm_size : 0.2;
        int kept = n - (int)(trimmed * n);  // at least 1: trimmed < 1
        memcpy(sorted, error, (size_t)n * sizeof *sorted);
        om_sort_doubles(sorted, n);
        for (int i = 0; i < kept; ++i) sum += sorted[i];
        return sum / kept;
    }
    default:
        for (int i = 0; i < n; ++i) sum += error[i];
        return sum / n;
    }
}
