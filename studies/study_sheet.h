/// studies/study_sheet.h: particles calibrated on a sheet that a depth camera watched.
///
/// Thesis 5.4.1: a sheet of 90 x 90 x 3 mm, held on one side, is lifted at five pinch points to three heights and
/// seen by a depth camera; spacing, radius and stiffness of the clusters of a position based model are found
/// from the point clouds (5.2). Here finite elements of another mesh take the place of the silicone, one pinch
/// point is held out of the search, and the report says what the parameters are worth there.
///
///     OmStudySheetDef def = om_study_sheet_default_def("out/sheet");
///     OmStudySheetSummary summary;
///     om_study_sheet_run(&def, progress, &summary);        // out/sheet/report.html, study.json
#ifndef OMENTUM_STUDY_SHEET_H
#define OMENTUM_STUDY_SHEET_H

#include "omentum/base.h"

#define OM_STUDY_NPINCH 5    // N of (5.2)
#define OM_STUDY_NLIFT 3     // L: 10, 20, 30 mm
#define OM_STUDY_NCLUSTER 3  // parameters: spacing, radius, stiffness

typedef struct OmStudySheetDef {  // made by om_study_sheet_default_def
    const char* out_dir;
    int cells;              // of the model along a side, 10 to 60; default 20: 882 particles
    int world_cells;        // of the finite elements along a side, 10 to 80; default 30
    int population;         // of the global stage, 5 to 1000; default 16
    int generations;        // of the global stage, 1 to 1000; default 10
    int local_evaluations;  // of the local stage, 1 to 10000; default 180
    // Relative rise of the error that bounds the interval of a parameter; default 0.1; 0: no
    // intervals.
    double rise;
    bool has_all_folds;  // hold out each pinch point in turn; default false: the first one only
    uint64_t seed;       // of the search, below 2^31; default 1
    int nworker;         // default 0: one a processor
    OmCookie cookie;
} OmStudySheetDef;

typedef struct OmStudySheetSummary {  // errors: m, mean over the points of the clouds
    int nfold;                        // searches: pinch points that were held out
    int neval, nnew;                  // evaluations of all of them, and those made now
    double floor;                     // of the sheet at rest: the part of the measure itself
    double thesis, found;  // all 15 clouds: the thesis's parameters, those of the first search
    // clouds of pinch points held out, by the search that did not see them
    double unseen_thesis, unseen_found;
    double best[OM_STUDY_NCLUSTER];  // of the first search: spacing, radius (m), stiffness
    bool is_met;                     // found and unseen_found at most 2 mm
} OmStudySheetSummary;

OmStudySheetDef om_study_sheet_default_def(const char* out_dir);
/// Make what is missing of clouds and searches, then report.html and study.json.
OmStatus om_study_sheet_run(const OmStudySheetDef* def, const OmProgress* progress,
                            OmStudySheetSummary* summary);

#endif
