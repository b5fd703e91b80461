// calibrate_internal.h: shared by the files of the room.
#ifndef OMENTUM_CALIBRATE_INTERNAL_H
#define OMENTUM_CALIBRATE_INTERNAL_H

#include "omentum/calibrate.h"

OmStatus om__calibrate_check(const OmCalibrationDef* def);

// Searches use coordinates from 0 to 1 between the bounds (of the logarithm where is_log).
double om__calibrate_from_unit(const OmCalibrationParam* p, double u);
double om__calibrate_to_unit(const OmCalibrationParam* p, double v);

// ---- the journal ----------------------------------------------------------------------------------

/// A file with a line that identifies the problem, then one JSON line per evaluation. Evaluations on file are
/// read in order, then new lines are appended. An incomplete last line is removed.
typedef struct OmJournal {
    int fd;  // -1: no file
    char path[1024];
    int nparam, nerror;
    int nold;       // evaluations found
    double* param;  // (nold x nparam)
    double* cost;   // (nold)
    char** error;   // JSON text of the list of errors, null if there is none
    char* text;     // the file
} OmJournal;

/// @param problem  hash of everything that determines the evaluations and their order
OmStatus om__journal_open(OmJournal* j, const char* dir, const OmCalibrationDef* def,
                          uint64_t problem);
void om__journal_close(OmJournal* j);
/// Read evaluation k from the file: its cost, and its errors where `error` is not null.
/// @return OM_OK; OM_INVALID (other parameters are on file, or the errors are missing)
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
    int nworker;  // the value of def
    int neval, nnew, cap;
    double* u;     // of all evaluations                     (cap x n)
    double* cost;  //                                           (cap)
    int best;      // the evaluation of smallest cost, the first of equals
    const char* stage;
    int stage_begin, stage_total;  // for progress
} OmSearch;

/// Begin stage `name`; it has at most `total` evaluations.
void om__search_begin(OmSearch* s, const char* stage, int total);
/// Evaluate n points at once; the costs are s->cost[s->neval - n ...]. Where `error` is not null it receives the
/// errors (n x nerror), and they are written to the journal.
OmStatus om__search_batch(OmSearch* s, int n, const double* u, double* error);
/// Evaluate one point, with all workers.
OmStatus om__search_one(OmSearch* s, const double* u, double* cost);

/// Detects stagnation: the best cost has not fallen by 1 % for a number of checks.
typedef struct OmStagnation {
    double mark;  // cost at the last progress
    int still;    // checks since then
} OmStagnation;
/// One check; true after `patience` checks without progress.
bool om__search_is_stagnant(OmStagnation* g, double cost, int patience);

// ---- stages ---------------------------------------------------------------------------------------

/// Differential evolution until stagnation, convergence of the population, or max_generations.
OmStatus om__calibrate_evolve(OmSearch* s, int* ngeneration, bool* is_done);

typedef enum OmNloptMethod {
    OM_NLOPT_CRS,
    OM_NLOPT_ESCH,
    OM_NLOPT_SBPLX,
    OM_NLOPT_BOBYQA
} OmNloptMethod;
/// Minimise from u0 in the box [lo, hi] of search coordinates.
/// @param patience  the search ends after this many evaluations without 1 % of progress; 0: it does not
/// @param is_done   true: it ended by its tolerance or by stagnation
OmStatus om__calibrate_nlopt(OmSearch* s, OmNloptMethod method, const double* u0, const double* lo,
                             const double* hi, int max_eval, int patience, bool* is_done);

/// Squared cost above which the cost counts as risen: c^2 + ((1 + rise)^2 - 1) max(c, noise)^2, c
/// the smallest cost.
double om__calibrate_limit(const OmCalibrationDef* def, double min);
/// Profiles along each parameter around the best evaluation, then pairs of parameters.
/// @param mesh_limit  cost that bounds the intervals including the mesh error, where it exceeds the other limit
OmStatus om__calibrate_profile(OmSearch* s, double mesh_limit, OmCalibrationProfile* profile);
/// Largest number of evaluations of om__profile_run.
int om__calibrate_profile_count(int nparam);

/// Write report.html, calibration.json and calibrated.yaml.
OmStatus om__calibrate_report(const OmCalibrationDef* def, const OmCalibrationResult* result);

#endif
