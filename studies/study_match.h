/// studies/study_match.h: correspondence and attachments judged on cases with a known truth.
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

#include "studies/study_stats.h"

// ---- correspondence -------------------------------------------------------------------------------

// Goals of OM_STUDY_TRACKS on folds: errors (m), share of the points with an answer, processor time (ms).
#define OM_STUDY_COR_MEDIAN 0.002
#define OM_STUDY_COR_P90 0.005
#define OM_STUDY_COR_ANSWERED 0.8
#define OM_STUDY_COR_MS 60

typedef enum OmStudyWay {   // to find the material point of a seen point
    OM_STUDY_REST,          // nearest point of the rest shape
    OM_STUDY_ZOOMOUT,       // ZoomOut from it, the thesis's way
    OM_STUDY_ZOOMOUT_PART,  // the same, its variant for partial views
    OM_STUDY_TWIN,          // nearest point of a twin that has gone 70 % of the way
    OM_STUDY_VISIBLE,       // nearest point of the part of this twin that the camera would see
    OM_STUDY_LIVE,          // om_match_find_pairs from this twin
    OM_STUDY_TWIN_END,      // nearest visible point of a twin that has gone the whole way
    OM_STUDY_LIVE_END,      // om_match_find_pairs from that twin
    // the same from both, with the material points that were followed through the pictures on the way
    OM_STUDY_TRACKS,
    OM_STUDY_TRACKS_END,
    OM_STUDY_NWAY
} OmStudyWay;

typedef struct OmStudyCorrespondenceDef {  // made by om_study_correspondence_default_def
    const char* out_dir;
    bool is_quick;   // four cases on a coarse sheet; default false: all
    double spacing;  // m, of the points of a scan; default 2.5 mm: about 2,000 points
    int nworker;     // of simulations, default 0: one a processor; times are of one worker
    OmCookie cookie;
} OmStudyCorrespondenceDef;

typedef struct
    OmStudyWayResult {  // over points that moved by 5 mm or more, of all cases or of some
    int npoint;
    double answered;            // share of the points with an answer
    double median, p90, worst;  // m, in the rest shape, of those with an answer
    double ms;                  // processor time of a case, median
    int nlost;                  // cases that the way itself gave up: no answers
} OmStudyWayResult;

typedef struct OmStudyCorrespondenceSummary {
    int ncase, nnew;                      // cases, and those evaluated now
    OmStudyWayResult all[OM_STUDY_NWAY];  // all cases
    // folds of 135 degrees with a twin of the right attachments
    OmStudyWayResult fold[OM_STUDY_NWAY];
    // OM_STUDY_TRACKS on these folds: median 2 mm, 90 % 5 mm, answers for 80 % of the points, 60 ms
    bool is_met;
} OmStudyCorrespondenceSummary;

OmStudyCorrespondenceDef om_study_correspondence_default_def(const char* out_dir);
/// Make what is missing of truths and results, then report.html, study.json and errors.csv.
OmStatus om_study_correspondence_run(const OmStudyCorrespondenceDef* def,
                                     const OmProgress* progress,
                                     OmStudyCorrespondenceSummary* summary);

// ---- attachments ----------------------------------------------------------------------------------

// Goals: medians of single views and of three, and processor time of a single view (ms).
#define OM_STUDY_ATT_DSC 0.6
#define OM_STUDY_ATT_TPR 0.8
#define OM_STUDY_ATT_DSC3 0.75
#define OM_STUDY_ATT_TPR3 0.85
#define OM_STUDY_ATT_MS 300

#define OM_STUDY_NBIN 10  // of probability and of uncertainty

typedef enum OmStudyGuess {  // attachments given to the twin
    OM_STUDY_ZERO,           // none
    OM_STUDY_ALL,            // the whole underside
    OM_STUDY_SAME,           // those of the truth
    OM_STUDY_STILL,  // vertices that truly moved by less than 1 mm in one view: all that a view may tell
    OM_STUDY_STILL_THREE,  // the same in each of three views
    OM_STUDY_SINGLE,       // om_match_update from one view
    OM_STUDY_THREE,        // om_match_update from three views
    // the network from one view, with the correspondence through the twin that physics has corrected
    OM_STUDY_NETWORK,
    OM_STUDY_FUSION,       // ... its three views fused by log-odds
    OM_STUDY_CROSSING,     // ... its three views intersected, the thesis's way
    OM_STUDY_JOINT,        // om_banet_update, network and physics, from one view
    OM_STUDY_JOINT_THREE,  // ... from three views
    OM_STUDY_NGUESS
} OmStudyGuess;

typedef struct OmStudyAttachmentsDef {  // made by om_study_attachments_default_def
    const char* out_dir;
    bool is_quick;  // the first three layouts on a coarse sheet; default false: twelve
    // Set of layouts: 1 (default); 2: a second one, with which no method was developed; 3: for development
    int set;
    // as for om_banet_net_find: a file, "none", or null (default): the one that comes along, if any
    const char* network;
    int nworker;  // of simulations, default 0: one a processor; an update has one worker
    OmCookie cookie;
} OmStudyAttachmentsDef;

// Over views. Guesses from three views: over layouts, positions over views.
typedef struct OmStudyGuessResult {
    bool is_there;         // this build has it, and the weights if it needs them
    StudySample dsc, tpr;  // (4.3) and (4.6), 0 to 1, over the vertices of the underside
    StudySample ave, mve;  // (4.5) and (4.7), m: the moved twin against the truth
    // updates that were refused: the twin keeps its belief, no attachment, and dsc and tpr are 0
    int nrefused;
    int nlost;  // views without correspondence: the network says nothing of them
    double ms;  // processor time of an update, median
} OmStudyGuessResult;

typedef struct OmStudyAttachmentsSummary {
    int nlayout, nnew;  // layouts, and those evaluated now
    bool has_network;
    OmStudyGuessResult by[OM_STUDY_NGUESS];
    // Vertices by estimated probability of single views, and the share of them that is attached.
    int bin_count[OM_STUDY_NBIN];
    double bin_share[OM_STUDY_NBIN];
    // Vertices by uncertainty of single views, and the share of them that is wrong.
    int doubt_count[OM_STUDY_NBIN];
    double doubt_wrong[OM_STUDY_NBIN];
    // Medians: DSC 0.6 and TPR 80 % of single views, 0.75 and 85 % of three, 300 ms of a single view.
    bool is_met;
} OmStudyAttachmentsSummary;

OmStudyAttachmentsDef om_study_attachments_default_def(const char* out_dir);
/// Make what is missing of truths and results, then report.html, study.json and vertices.csv.
OmStatus om_study_attachments_run(const OmStudyAttachmentsDef* def, const OmProgress* progress,
                                  OmStudyAttachmentsSummary* summary);

#endif
