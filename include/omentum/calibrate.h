/// omentum/calibrate.h: parameters of a model identified from observations (floor 5).
///
/// A calibration is a set of named parameters with bounds, and a function from parameters to errors: distances between
/// model and observation for each experiment, level and landmark (thesis (3.15), (5.2)). The search follows Fig. 3.6: a
/// global evolutionary stage, then a direct search in 40 % of the range around the best. Each evaluation is written
/// to a journal, so a killed search resumes and gives the same bytes. At the end a sensitivity analysis names the
/// parameters that the data do not determine. calibrate_tissue.h evaluates tissue models.
///
///     OmCalibrationDef def = om_calibration_default_def(eval, ctx, nerror);
///     om_calibration_add_param(&def, "young", 500, 50000, 3000, true);
///     def.noise = 0.0008, def.out_dir = "out";
///     OmCalibrationResult result;
///     om_calibration_run(&def, NULL, &result);                 // result.best[0], out/report.html
///     om_calibration_result_done(&result);
#ifndef OMENTUM_CALIBRATE_H
#define OMENTUM_CALIBRATE_H

#include "omentum/base.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_CALIBRATION_MAX_PARAM 8
#define OM_CALIBRATION_NAME 48
#define OM_CALIBRATION_MAX_STEP 20000         // of one path: settling, and again on the way
#define OM_CALIBRATION_MAX_EVALUATION 100000  // of the global search

// ---- the problem ------------------------------------------------------------------------------------

typedef struct OmCalibrationParam {
    char name[OM_CALIBRATION_NAME];  // the key in a scene: "tissue.young", "pbd.radius_mm"
    double lo, hi;                   // bounds, SI, lo < hi
    double start;                    // first guess, between lo and hi
    bool is_log;                     // search on a logarithmic scale; lo > 0
    double unit;                     // the unit of the name in SI: 1e-3 for "_mm"; default 1
} OmCalibrationParam;

typedef struct OmCalibrationLabel {  // meaning of one error, for the report
    int experiment;                  // index into def.experiment
    int landmark;                    // index into def.landmark
    double level;                    // deformation there, m
} OmCalibrationLabel;

/// Write the errors of the model with parameters `param` (nparam) into `error` (nerror), m, each >= 0. Several threads
/// call this at once. The errors may depend on `param` and ctx only, not on `nworker`, the number of threads that the
/// call may use.
/// @return OM_OK; a positive status: no model has these parameters (the cost is infinite); a negative status ends the
///         calibration
typedef OmStatus (*OmCalibrationFn)(void* ctx, const double* param, int nworker, double* error);

/// Difference of the model's answer with these parameters from its answer on a finer mesh, in the order and
/// measure of the errors: it tells how much of the best parameters is the mesh's own.
/// @param ratio  out: edges of the mesh that is calibrated over those of the finer one, above 1
/// @return as OmCalibrationFn; a positive status: it cannot be told
typedef OmStatus (*OmCalibrationFinerFn)(void* ctx, const double* param, int nworker, double* error,
                                         double* ratio);

typedef enum OmCalibrationNorm {  // the cost, m, of errors e
    OM_NORM_MEAN,                 // mean of e: (3.15), (5.2)
    OM_NORM_SQUARE,               // root of the mean of e^2
    OM_NORM_HUBER,                // root of the mean of: e^2 up to s = norm_size, 2 s e - s^2 above
    OM_NORM_TRIMMED,  // mean without the largest errors; norm_size is the fraction left out
    OM_NNORM
} OmCalibrationNorm;

typedef enum OmCalibrationGlobal {
    OM_GLOBAL_NONE,  // start at def.param[].start: fine-tuning (thesis 3.5.1)
    OM_GLOBAL_EVOLUTION,  // differential evolution, current-to-pbest/1/bin, a generation evaluated at once
    OM_GLOBAL_CRS,   // NLopt's controlled random search, one evaluation at a time
    OM_GLOBAL_ESCH,  // NLopt's evolutionary strategy, one evaluation at a time
    OM_NGLOBAL
} OmCalibrationGlobal;

typedef enum OmCalibrationLocal {
    OM_LOCAL_NONE,
    OM_LOCAL_SUBPLEX,  // NLopt's SBPLX: simplex searches in subspaces, for costs with kinks
    OM_LOCAL_BOBYQA,  // NLopt's BOBYQA: quadratic models; fewer evaluations where the cost is smooth
    OM_NLOCAL
} OmCalibrationLocal;

typedef struct OmCalibrationDef {     // made by om_calibration_default_def
    const char* title;                // of the report; default "Calibration"
    OmCalibrationFn eval;             //
    void* ctx;                        // borrowed
    OmCalibrationFinerFn eval_finer;  // with the same ctx, after each local stage; default null
    // Hash of everything that eval depends on besides the parameters; a journal of another hash is
    // refused. Default 0.
    uint64_t problem;
    int nparam;  // 1 to OM_CALIBRATION_MAX_PARAM
    OmCalibrationParam param[OM_CALIBRATION_MAX_PARAM];
    int nerror;                       // >= 1
    const OmCalibrationLabel* label;  // borrowed; default null: no table of errors   (nerror)
    int nexperiment, nlandmark;
    const char* const* experiment;  // names, borrowed                               (nexperiment)
    const char* const* landmark;    // names, borrowed                                 (nlandmark)
    OmCalibrationNorm norm;         // default OM_NORM_MEAN
    double norm_size;  // Huber: m, default 0: twice the noise; trimmed: share, default 0: 0.2
    double noise;      // cost of a perfect model, m; default 0: not known
    OmCalibrationGlobal global;  // default OM_GLOBAL_EVOLUTION
    int population;              // default 0: 8 for each parameter, at least 12
    int max_generations;         // default 40
    OmCalibrationLocal local;    // default OM_LOCAL_SUBPLEX
    int max_local;               // evaluations; default 0: 60 for each parameter
    double local_range;  // fraction of the range around the start, (0, 1]; default 0.4 (3.5.1)
    double tolerance;    // of a parameter relative to its range, ends the local stage; default 1e-3
    int patience;        // generations without 1 % of progress that end the global stage; default 8
    double unfit;        // stagnation above unfit * noise means: the model cannot fit; default 4
    // Sensitivity: the relative rise of the cost that bounds an interval. Where the cost is below
    // the noise, the rise is relative to the noise instead. Default 0.1; 0: no sensitivity.
    double rise;
    uint64_t seed;        // default 1
    int nworker;          // default 0: one for each processor
    const char* out_dir;  // for journal and report; default null: no files, no resuming
    OmCookie cookie;
} OmCalibrationDef;

OM_API OmCalibrationDef om_calibration_default_def(OmCalibrationFn eval, void* ctx, int nerror);
/// Add a parameter. om_calibration_run reports too many parameters.
OM_API void om_calibration_add_param(OmCalibrationDef* def, const char* name, double lo, double hi,
                                     double start, bool is_log);
/// Cost of errors by the norm of `def`; infinite if an error is not finite. OM_NORM_TRIMMED needs the scratch array
/// `sorted` (n).
OM_API double om_calibration_norm_eval(const OmCalibrationDef* def, int n, const double* error,
                                       double* sorted);

// ---- the outcome ------------------------------------------------------------------------------------

#define OM_CALIBRATION_NPROFILE 17  // points of a profile, the optimum in the middle

typedef struct OmCalibrationProfile {   // the cost along one parameter, the others at the optimum
    double x[OM_CALIBRATION_NPROFILE];  // ascending, SI
    double cost[OM_CALIBRATION_NPROFILE];
    double lo, hi;  // interval in which the cost rises by less than def.rise
    // The same with the error of the mesh, result.mesh_cost, added as squares to what bounds lo and hi. Equal to them
    // where the mesh hardly matters.
    double mesh_lo, mesh_hi;
    bool is_open_lo, is_open_hi;  // the interval ends at the bound of the parameter
    // Another parameter that compensates a change of this one, or -1: the cost hardly rises along the valley of both,
    // their correlation partner_rho exceeds 0.95. partner_rho is 0 without partner.
    double partner_rho;
    int partner;
    bool is_determined;  // the interval is closed on both sides, and there is no partner
} OmCalibrationProfile;

typedef enum OmCalibrationOutcome {
    OM_CALIBRATED,          // the local stage (or the global one alone) reached its tolerance
    OM_CALIBRATION_BUDGET,  // the largest number of evaluations was reached
    OM_CALIBRATION_UNFIT    // stagnation far above the noise: the model cannot fit
} OmCalibrationOutcome;

typedef struct OmCalibrationResult {  // om_calibration_result_done frees
    OmCalibrationOutcome outcome;
    int nparam, nerror;
    int neval, nnew;  // all evaluations; those made by this call
    int nglobal, nlocal,
        nprofile;  // evaluations by stage, besides one at the start and one at the end
    int ngeneration;
    double best[OM_CALIBRATION_MAX_PARAM];  // SI
    double cost_start, cost_global, cost;   // m
    double *error_start, *error;            // at start and best, m                 (nerror)
    double* trace;                          // cost of every evaluation in order    (neval)
    bool has_profile;
    // What the best parameters owe to the mesh: with them a finer one shows something else, by mesh_difference; all of
    // the mesh's error is mesh_cost, extrapolated for elements of second order.
    bool has_mesh;
    double mesh_ratio, mesh_difference, mesh_cost;  // edges over the finer ones; m
    bool is_of_mesh;  // mesh_cost exceeds the noise, or the cost where that is not known
    OmCalibrationProfile profile[OM_CALIBRATION_MAX_PARAM];
} OmCalibrationResult;

/// Search, analyse the sensitivity, and write out_dir/report.html, calibration.json and calibrated.yaml. The journal
/// out_dir/journal.jsonl has one line for each evaluation, in the same order for any number of workers.
/// The folder is one that grows (om_folder_open): a file there that omentum did not write is never replaced.
/// @return OM_OK; OM_NOT_CONVERGED (budget); OM_UNSAT (unfit): result is complete for all three; OM_INVALID
///         (the message names the field, or the journal of another problem); OM_IO; OM_NO_MEMORY;
///         OM_CANCELLED (the journal keeps all evaluations); errors of eval
OM_API OmStatus om_calibration_run(const OmCalibrationDef* def, const OmProgress* progress,
                                   OmCalibrationResult* result);
OM_API void om_calibration_result_done(OmCalibrationResult* result);

#ifdef __cplusplus
}
#endif
#endif
