/// studies/study_retraction.h: the experiments of thesis chapter 6 on tissue retraction.
///
/// Scenarios: eight sheets, each with fewer and with more attachments than believed, by DEFRAS and by FRAS (6.5.2,
/// Tables 6.2 and 6.3). Threshold: epsilon of 6.5.1. Replanning: Table 6.4. Random: 100 pairs of a layout and a belief;
/// a pair counts, and is run, if the plan made with the believed attachments fails when it is carried out without
/// looking, and a search with the true ones succeeds. Laboratory: a silicone sheet (6.5.3, Table 6.5). Kidney: wrong
/// beliefs on the scene of a patient. Ablations: DEFRAS without one module each. Alarms: 100 sheets with right
/// attachments and every other error. Searches: what is possible, for scenarios and the laboratory. Every run is a
/// folder with its own report; a finished run is not made again.
///
///     OmStudyRetractionDef def = om_study_retraction_default_def("out/retraction");
///     OmStudyRetractionSummary summary;
///     om_study_retraction_run(&def, progress, &summary);   // out/retraction/report.html, study.json
#ifndef OMENTUM_STUDY_RETRACTION_H
#define OMENTUM_STUDY_RETRACTION_H

#include "omentum/retract.h"
#include "omentum/trial_search.h"
#include "studies/study_draw.h"

typedef enum OmStudyRetractionPart {  // bits of OmStudyRetractionDef.parts
    OM_RETRACTION_SCENARIOS = 1,
    OM_RETRACTION_THRESHOLD = 2,
    OM_RETRACTION_REPLANNING = 4,
    OM_RETRACTION_LABORATORY = 8,
    OM_RETRACTION_RANDOM = 16,
    OM_RETRACTION_KIDNEY = 32,
    OM_RETRACTION_ABLATIONS = 64,
    OM_RETRACTION_ALARMS = 128,
    OM_RETRACTION_SEARCHES = 256
} OmStudyRetractionPart;

typedef enum OmRetractionRow {  // how a case is run
    OM_RETRACTION_DEFRAS,       // every module
    OM_RETRACTION_FRAS,         // no module of DEFRAS; the twin has the believed attachments
    OM_RETRACTION_FRAS_TRUE,    // the same; the twin has the true attachments
    OM_RETRACTION_NO_PREPLAN,   // DEFRAS without a plan before
    OM_RETRACTION_NO_MONITOR,   // without monitoring: learning after each action instead
    OM_RETRACTION_NO_LEARNING,  // without learning
    OM_RETRACTION_NO_AHEAD,     // without look-ahead
    OM_RETRACTION_NO_CHECK,  // estimates are adopted even if the twin is no closer to what the camera sees
    OM_RETRACTION_NO_NETWORK,  // learning by physics alone
    OM_RETRACTION_ONE_ARM,     // PSM1 alone
    OM_RETRACTION_OPEN_LOOP,   // the plan before, carried out without looking
    OM_RETRACTION_NROW
} OmRetractionRow;

typedef struct OmStudyRetractionDef {  // made by om_study_retraction_default_def
    // For runs, searches and report. Parts that exist already are not computed again.
    const char* out_dir;
    int parts;         // OmStudyRetractionPart, added; default: all but the kidney
    int ncase;         // the first N scenarios, pairs, sheets or laboratory cases; default 0: all
    int first;         // random, ablations and alarms: the first pair or sheet, from 0; default 0
    const char* data;  // folder that holds ct_abdomen, needed for the kidney; default null
    bool is_quick;     // a coarse sheet, few cases; default false
    // Of random pairs, their ablations and alarms; default: the published numbers.
    OmStudyDraw draw;
    // Table to which a judged draw is appended when it was run; null: none
    const char* draws;
    int nworker;  // runs at a time, of one thread each; default 0: one a processor
    OmCookie cookie;
} OmStudyRetractionDef;

// Of one row over the cases of a part; medians are NAN where nrun is 0.
typedef struct OmRetractionScore {
    int nrun;
    int npossible;          // runs whose case the search exposes, or any run of the study
    int nunknown;           // of the others: not searched
    int nsuccess;           // exposed by the judge, true force at most 1.2 epsilon
    int nsuccess_possible;  // of the possible ones
    double visibility, visibility_mean, actions, events;  // medians, and a mean
    double force, force_world;  // medians of F_max / epsilon, by the twin and by the truth
    double more_actions;        // median, actions above the search's, of successes
    int nforce;                 // runs whose true force was above 1.2 epsilon
    int nheld;                  // runs that waited for a person
    int nheld_alone;            // of these, where the search exposes the ROI
    int ntrigger, ngood;        // updates that were triggered, and that ended at mu <= 2 mm
    int nfalse;                 // runs with right attachments and a warning
} OmRetractionScore;

#define OM_RETRACTION_NGRID 6   // 5 to 10 blocks along a side
#define OM_RETRACTION_NSHARE 4  // 10, 30, 50, 70 % attached

typedef struct
    OmRetractionDifference {  // a row against DEFRAS, over the counting pairs that both were run on
    int npair;
    int defras_only, other_only;  // of these, where one alone succeeds
    double actions;  // median of its actions less those of DEFRAS, where both succeed; NAN: nowhere
} OmRetractionDifference;

typedef struct OmRetractionPairs {  // does a wrong belief matter?
    int ndrawn;                     // pairs whose plan was carried out open loop
    int nharmless;                  // it succeeded
    int nimpossible;                // it failed, and so does the search with the true attachments
    int ncounting;                  // it failed, and the search succeeds: these are run
} OmRetractionPairs;

typedef struct OmStudyRetractionSummary {
    OmRetractionPairs pairs;
    OmRetractionDifference difference[OM_RETRACTION_NROW];  // random pairs
    int nrun, nnew;                                         // runs and searches, and those made now
    double epsilon;                                         // N, of the scenarios
    OmRetractionScore scenario[OM_RETRACTION_NROW], random[OM_RETRACTION_NROW];
    OmRetractionScore laboratory[OM_RETRACTION_NROW], kidney[OM_RETRACTION_NROW];
    OmRetractionScore alarm[OM_RETRACTION_NROW];
    OmForceCalibration force;  // of part threshold; nrun 0: not measured
    // s of processor time, mean and standard deviation of one plan; NAN: not measured
    double replan[OM_RETRACTION_NGRID][OM_RETRACTION_NSHARE];
    double replan_sd[OM_RETRACTION_NGRID][OM_RETRACTION_NSHARE];
} OmStudyRetractionSummary;

OmStudyRetractionDef om_study_retraction_default_def(const char* out_dir);
/// Make what is missing of runs and searches, then report.html and study.json of all parts that are in the folder.
/// @return OM_OK; OM_INVALID (the message names the field, or the folder of another study); OM_IO; OM_NO_MEMORY;
///         OM_CANCELLED (what is finished stays)
OmStatus om_study_retraction_run(const OmStudyRetractionDef* def, const OmProgress* progress,
                                 OmStudyRetractionSummary* summary);

#endif
