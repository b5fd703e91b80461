/// omentum/study_match.h: correspondence and attachments judged on cases with a known truth (floor 8).
///
/// Thesis 4.3 and 4.4, with cases of our own: a sheet of the simulated world is folded and pulled by the arms and seen
/// by the depth camera. The truth has another mesh and another stiffness than the twin. The study of correspondence
/// compares ways to find the material point of each seen point. The study of attachments gives om_match_update one or
/// three views of twelve layouts. Cases, seeds and grasping points are fixed in the source.
///
///     OmStudyCorrespondenceDef def = om_study_correspondence_default_def("out/correspondence");
///     om_study_correspondence_run(&def, progress, &summary);    // out/correspondence/report.html, study.json
#ifndef OMENTUM_STUDY_MATCH_H
#define OMENTUM_STUDY_MATCH_H

#include "omentum/base.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- correspondence -------------------------------------------------------------------------------

typedef enum OmStudyWay {   // to find the material point of a seen point
    OM_STUDY_REST,          // nearest point of the rest shape
    OM_STUDY_ZOOMOUT,       // ZoomOut from it, the thesis's way
    OM_STUDY_ZOOMOUT_PART,  // the same, its variant for partial views
    OM_STUDY_TWIN,          // nearest point of a twin that has gone 70 % of the way
    OM_STUDY_VISIBLE,       // nearest point of the part of this twin that the camera would see
    OM_STUDY_LIVE,          // om_match_find_pairs from this twin
    OM_STUDY_TWIN_END,      // nearest visible point of a twin that has gone the whole way
    OM_STUDY_LIVE_END,      // om_match_find_pairs from that twin
    OM_STUDY_NWAY
} OmStudyWay;

typedef struct OmStudyCorrespondenceDef {  // made by om_study_correspondence_default_def
    // For truths, results and report. Parts that exist already are not computed again.
    const char* out_dir;
    bool is_quick;   // four cases on a coarse sheet; default false: all
    double spacing;  // m, of the points of a scan; default 2.5 mm: about 2,000 points
    int nworker;     // of simulations, default 0: one a processor; times are of one worker
    OmCookie cookie;
} OmStudyCorrespondenceDef;

typedef struct
    OmStudyWayResult {  // over points that moved by 5 mm or more, of all cases or of some
    bool is_there;      // the way was tried
    int npoint;
    double answered;            // share of the points with an answer
    double median, p90, worst;  // m, in the rest shape, of those with an answer
    double ms;                  // processor time of a case, median
} OmStudyWayResult;

typedef struct OmStudyCorrespondenceSummary {
    int ncase, nnew;                      // cases, and those evaluated now
    OmStudyWayResult all[OM_STUDY_NWAY];  // all cases
    // folds of 135 degrees with a twin of the right attachments
    OmStudyWayResult fold[OM_STUDY_NWAY];
    // OM_STUDY_LIVE on these folds: median 3 mm, 90 % 8 mm, answers for 80 % of the points, 60 ms
    bool is_met;
} OmStudyCorrespondenceSummary;

OM_API OmStudyCorrespondenceDef om_study_correspondence_default_def(const char* out_dir);
/// Make what is missing of truths and results, then report.html, study.json and errors.csv.
/// @return OM_OK (whether or not the goal is met); OM_INVALID (the message names the field, or the folder of another
///         study); OM_IO; OM_NO_MEMORY; OM_CANCELLED (what is finished stays)
OM_API OmStatus om_study_correspondence_run(const OmStudyCorrespondenceDef* def,
                                            const OmProgress* progress,
                                            OmStudyCorrespondenceSummary* summary);

#ifdef __cplusplus
}
#endif
#endif
