// study_sheet_internal.h: shared by the files of the sheet's calibration.
#ifndef OMENTUM_STUDY_SHEET_INTERNAL_H
#define OMENTUM_STUDY_SHEET_INTERNAL_H

#include "omentum/calibrate_problem.h"
#include "omentum/report.h"
#include "studies/study_sheet.h"

#define SHEET_REST OM_STUDY_NPINCH  // the path without a lift
#define SHEET_NPATH (OM_STUDY_NPINCH + 1)
#define SHEET_GOAL 0.002    // m, average error of the clouds
#define SHEET_THESIS 0.003  // m, the result of 5.4.1

typedef struct SheetErrors {  // m, means over the points of a cloud
    double at[OM_STUDY_NPINCH][OM_STUDY_NLIFT];
    double rest;  // of the cloud of the sheet at rest
} SheetErrors;

typedef struct SheetFold {  // a search that leaves out one pinch point
    int left_out;
    OmCalibrationProblem* problem;
    OmCalibrationDef search;
    OmCalibrationResult result;
    double seconds;
    SheetErrors error;  // on all clouds, with the parameters found
} SheetFold;

typedef struct Sheet {
    const OmStudySheetDef* def;
    const OmProgress* progress;
    OmCalibrationProblem* all;  // every path
    double thesis[OM_STUDY_NCLUSTER];
    SheetErrors thesis_error;
    double truth_seconds;  // 0: the clouds were read from files
    double eval_seconds;   // of one model along all paths
    int nfold;
    SheetFold fold[OM_STUDY_NPINCH];
} Sheet;

extern const double om__study_sheet_pinch[OM_STUDY_NPINCH][2];  // m, in the plane of the sheet
extern const char* const om__study_sheet_where[OM_STUDY_NPINCH];
extern const double om__study_sheet_lift[OM_STUDY_NLIFT];  // m

// Mean over the lifts of a pinch point, or over all pinch points except `but`; -1: over all.
double om__study_sheet_pinch_mean(const SheetErrors* e, int pinch);
double om__study_sheet_mean(const SheetErrors* e, int but);
// A path in the study's folder.
OmStatus om__study_sheet_path(const Sheet* s, const char* name, char* out, size_t size);
OmStatus om__study_sheet_add_pictures(const Sheet* s, OmReport* report);
OmStatus om__study_sheet_write_report(const Sheet* s, const OmStudySheetSummary* sum);
OmStatus om__study_sheet_write_json(const Sheet* s, const OmStudySheetSummary* sum);

#endif
