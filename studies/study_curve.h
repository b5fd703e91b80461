/// studies/study_curve.h: what would more samples of BA-Net bring? A learning curve.
///
/// The network of thesis 4.2.1 is trained on the first samples of a data set, 1,100, 2,500 and so on, each time with
/// the same number of steps from the same start, and scored on the same validation samples, the last ones of the set.
/// Scores of samples of its own training beside them show what more samples cannot bring.
///
///     OmStudyCurveDef def = om_study_curve_default_def(&data, "out/curve");
///     om_study_curve_run(&def, progress, &summary);    // out/curve/report.html, study.json, nNNNNNN/..
#ifndef OMENTUM_STUDY_CURVE_H
#define OMENTUM_STUDY_CURVE_H

#include "omentum/banet_net.h"

#define OM_STUDY_CURVE_MAX 8
#define OM_STUDY_CURVE_GAIN \
    0.01  // of the mean DSC: what twice the samples should bring to be worth making

typedef struct OmStudyCurveDef {  // made by om_study_curve_default_def
    // A folder of each training, and the report. Trainings that are there are not repeated.
    const char* out_dir;
    // Settings of every training, but out_dir, ntrain and nepoch. Default: batches of 8, dropout 0.05, a tenth of the
    // samples for validation, at most 500.
    OmBanetTrainDef train;
    int nsize;
    // Training samples, ascending; default: those of 1,100, 2,500, 5,000, 10,000 that the data have beside the
    // validation samples, and all of them.
    int size[OM_STUDY_CURVE_MAX];
    int nstep;  // optimizer steps of each training, default 5,000
    OmCookie cookie;
} OmStudyCurveDef;

typedef struct OmStudyCurvePoint {
    int nsample, nepoch, best_epoch;
    double dsc, tpr, ece;  // of the validation samples, means
    double dsc_median;
    double dsc_trained;  // mean over the first 200 samples of the training
    double seconds;
} OmStudyCurvePoint;

typedef struct OmStudyCurveSummary {
    int npoint;
    OmStudyCurvePoint point[OM_STUDY_CURVE_MAX];
    double gain;  // of the mean DSC, by twice the samples, from the last two points; NaN from one
    bool is_saturated;  // gain below OM_STUDY_CURVE_GAIN
} OmStudyCurveSummary;

OmStudyCurveDef om_study_curve_default_def(const OmBanetData* data, const char* out_dir);
/// Train what is missing, score, and write the report.
OmStatus om_study_curve_run(const OmStudyCurveDef* def, const OmProgress* progress,
                            OmStudyCurveSummary* summary);

#endif
