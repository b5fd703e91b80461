// calibrate_internal.h: what the files of the room share.
#ifndef OMENTUM_CALIBRATE_INTERNAL_H
#define OMENTUM_CALIBRATE_INTERNAL_H

#include "omentum/calibrate.h"

OmStatus om__calibrate_check(const OmCalibrationDef* def);

// Searches run in coordinates from 0 to 1 between the bounds, of the logarithm where is_log.
double om__calibrate_from_unit(const OmCalibrationParam* p, double u);
double om__calibrate_to_unit(const OmCalibrationParam* p, double v);

// ---- the journal ----------------------------------------------------------------------------------

/// A JSON line an evaluation, after a line that names the problem. What is there already is handed out in order,
/// then lines are added. A last line that was cut off is dropped.
typedef struct OmJournal {
    int fd;  // -1: there is no file
    char path[1024];
    int nparam, nerror;
    int nold;       // evaluations found
    double* param;  // (nold x nparam)
    double* cost;   // (nold)
    char** error;   // text of its list of errors, null without (nold)
    char* text;     // the file
} OmJournal;

/// @param problem  hash of all that decides about the evaluations and their order
OmStatus om__journal_open(OmJournal* j, const char* dir, const OmCalibrationDef* def,
                          uint64_t problem);
void om__journal_close(OmJournal* j);
/// Evaluation k is on file: its cost, and its errors where `error` is not null.
/// @return OM_OK; OM_INVALID (it has other parameters, or no errors)
OmStatus om__journal_get(const OmJournal* j, int k, const double* param, double* cost,
                         double* error);
/// Append evaluation k. `error` may be null.
OmStatus om__journal_put(const OmJournal* j, int k, const char* stage, const double* param,
                         double cost, const double* error);

// ---- evaluations ----------------------------------------------------------------------------------

typedef struct OmSearch {
    const OmCalibrationDef* def;
    const OmProgress* progress;
    OmJournal journal;
    int n;        // parameters
    int nworker;  // as def has it
    int neval, nnew, cap;
    double* u;     // of all evaluations                     (cap x n)
    double* cost;  //                                           (cap)
    int best;      // the evaluation of least cost, the first of equals
    const char* stage;
    int stage_begin, stage_total;  // for progress
} OmSearch;

/// Name what comes next; `total` evaluations at most.
void om__search_begin(OmSearch* s, const char* stage, int total);
/// Evaluate n points at once; the costs are s->cost[s->neval - n ...]. Where `error` is not null it receives the
/// errors (n x nerror) and the journal keeps them.
OmStatus om__search_batch(OmSearch* s, int n, const double* u, double* error);
/// Evaluate one, with all workers.
OmStatus om__search_one(OmSearch* s, const double* u, double* cost);

/// Has the best cost not fallen by 1 % for long?
typedef struct OmStagnation {
    double mark;  // the cost last seen to be progress
    int still;    // looks since
} OmStagnation;
/// One look; true after `patience` of them without progress.
bool om__search_is_stagnant(OmStagnation* g, double cost, int patience);

// ---- stages ---------------------------------------------------------------------------------------

/// Differential evolution until stagnation, a population that has become one, or max_generations.
OmStatus om__calibrate_evolve(OmSearch* s, int* ngeneration, bool* is_done);

typedef enum OmNloptMethod {
    OM_NLOPT_CRS,
    OM_NLOPT_ESCH,
    OM_NLOPT_SBPLX,
    OM_NLOPT_BOBYQA
} OmNloptMethod;
/// Minimise from u0 in the box [lo, hi] of search coordinates.
/// @param patience  evaluations without 1 % of progress that end it; 0: none do
/// @param is_done   it ended by its tolerance or by stagnation
OmStatus om__calibrate_nlopt(OmSearch* s, OmNloptMethod method, const double* u0, const double* lo,
                             const double* hi, int max_eval, int patience, bool* is_done);

/// The cost that counts as risen from the least: c^2 + ((1 + rise)^2 - 1) max(c, noise)^2, squared.
double om__calibrate_limit(const OmCalibrationDef* def, double min);
/// Profiles along each parameter around the best evaluation, then pairs of parameters.
/// @param mesh_limit  cost that bounds the intervals with the error of the mesh, where it exceeds the other limit
OmStatus om__calibrate_profile(OmSearch* s, double mesh_limit, OmCalibrationProfile* profile);
/// Evaluations that it makes at most.
int om__calibrate_profile_count(int nparam);

/// report.html, calibration.json and calibrated.yaml.
OmStatus om__calibrate_report(const OmCalibrationDef* def, const OmCalibrationResult* result);

#endif
