// study_retraction_internal.h: shared by the files of the retraction study.
#ifndef OMENTUM_STUDY_RETRACTION_INTERNAL_H
#define OMENTUM_STUDY_RETRACTION_INTERNAL_H

#include "omentum/report.h"
#include "studies/study_retraction.h"
#include "studies/study_retraction_protocol.h"

#define RETRACTION_MAX_CASE                                                              \
    (2 * RETRACTION_NSCENARIO + RETRACTION_NPAIR + RETRACTION_NALARM + RETRACTION_NLAB + \
     RETRACTION_NKIDNEY)
#define RETRACTION_MAX_GRASP 12

typedef struct RetractionRun {  // contents of its file; zero-initialise
    OmRetractOutcome outcome;
    bool is_exposed, is_success;
    char reason[256];
    double visibility_start, visibility;  // by the judge, at the end
    double visibility_seen;               // by the controller
    double force, force_world;            // N, largest
    double epsilon;                       // N
    int nforce;                           // times the twin's force rose to the limit of the arms
    int nforce_world;                     // times the true force rose above epsilon
    int naction, nplan, nacquisition, nupdate, nadopted;
    int ntrigger, ngood;  // updates by the monitor; of which ended at mu <= 2 mm
    int nwarning[3];      // times the warning state rose to 1, 2, 3
    OmHold hold;
    double mu_max;  // m
    double time, wall_time, twin_step_ms, plan_ms;
    int ngrasp, grasp[RETRACTION_MAX_GRASP];  // blocks, in order
} RetractionRun;

typedef struct RetractionCeiling {  // an exhaustive search with the true attachments
    bool is_possible;
    OmSearchResult best;
} RetractionCeiling;

typedef struct RetractionResult {  // of a case
    RetractionCase c;
    bool is_asked;  // the user wants its part: missing runs are made; else they are only read
    bool has_ceiling, has_run[OM_RETRACTION_NROW];
    RetractionCeiling ceiling;
    RetractionRun run[OM_RETRACTION_NROW];
} RetractionResult;

typedef struct RetractionReplan {  // seconds of one plan, by grid and attached share
    double mean[OM_RETRACTION_NGRID][OM_RETRACTION_NSHARE];
    double sd[OM_RETRACTION_NGRID][OM_RETRACTION_NSHARE];
    int nunsat[OM_RETRACTION_NGRID][OM_RETRACTION_NSHARE];  // states without a plan
    int nstate;                                             // of each cell
} RetractionReplan;

typedef struct RetractionThreshold {
    OmForceCalibration force;
    int nlayout;
} RetractionThreshold;

typedef struct Retraction {
    const OmStudyRetractionDef* def;
    const OmProgress* progress;
    RetractionResult* result;  // (RETRACTION_MAX_CASE)
    int ncase;
    bool has_threshold, has_replan;
    RetractionThreshold threshold;
    RetractionReplan replan;
    OmStudyRetractionSummary sum;
} Retraction;

extern const char* const om__retraction_row_name[OM_RETRACTION_NROW];   // for files
extern const char* const om__retraction_row_title[OM_RETRACTION_NROW];  // for people

// Is this row a run of the case? Ablations are of scenarios and of the first 40 pairs that count.
bool om__retraction_is_wanted(const Retraction* s, const RetractionCase* c, OmRetractionRow row);
// Of a pair: does the belief matter, and is it possible? Other cases count always, and all of a quick study.
bool om__retraction_counts(const Retraction* s, const RetractionResult* r);
// Is there a search for the case? Of a pair only where the plan fails open loop.
bool om__retraction_is_searched(const RetractionResult* r);
// Does the search expose the case, or is a run of it a success? The search has one arm and one grasp.
bool om__retraction_is_possible(const RetractionResult* r);
// Read what the folder has, make what is missing, as many at once as there are workers.
OmStatus om__retraction_run_cases(Retraction* s);
// The plan before of a case; OM_IO: it is not in the folder.
OmStatus om__retraction_load_preplan(const Retraction* s, const RetractionCase* c, OmPreplan* plan);
OmStatus om__retraction_run_threshold(Retraction* s);
OmStatus om__retraction_run_replan(Retraction* s);
// A random state of Table 6.4: one block above the ROI, a share of the others fixed in a patch.
void om__retraction_random_state(int n, double share, int k, OmSituation* situation);
// The sheet from above: true and believed attachments, ROI, grasped blocks.
OmStatus om__retraction_draw(const RetractionCase* c, const RetractionRun* run, OmPicture* picture);
OmStatus om__retraction_write_report(const Retraction* s);
OmStatus om__retraction_write_json(const Retraction* s);

#endif
