/// studies/study_phantoms.h: attachments of silicone phantoms that a robot lifts.
///
/// Four shapes are stitched to a board in three ways each, flat or over a capsule, grasped at four places and lifted by
/// steps of 10 mm in the simulated world: another mesh, another law and another stiffness than the twin, with friction,
/// arms in view, noise, and a camera that is 1 mm off. At every step the attachments are estimated by the network, by
/// the network over the last three steps, by physics, and by all of it together. The network's correspondence goes
/// through the twin that physics has corrected (OmBanetUpdateDef.is_corrected). Shapes, stitches, grasps and seeds are
/// fixed in the source and no method is developed with them; there are two other shapes for that.
///
///     OmStudyPhantomsDef def = om_study_phantoms_default_def("out/phantoms");
///     om_study_phantoms_run(&def, progress, &summary);    // out/phantoms/report.html, study.json, views.csv
#ifndef OMENTUM_STUDY_PHANTOMS_H
#define OMENTUM_STUDY_PHANTOMS_H

#include "omentum/banet_update.h"
#include "studies/study_match.h"

// Goals of OM_STUDY_PHANTOM_ALL: medians of all steps, and of several grasps.
#define OM_STUDY_PHANTOM_DSC 0.60
#define OM_STUDY_PHANTOM_TPR 0.80
#define OM_STUDY_PHANTOM_AVE 0.0005  // m, above that of the true attachments
#define OM_STUDY_PHANTOM_DSC_GRASPS 0.82
#define OM_STUDY_PHANTOM_TPR_GRASPS 0.80

typedef enum OmStudyPhantomWay {
    OM_STUDY_PHANTOM_NETWORK,  // of one step; of several grasps: the intersection, as the thesis
    OM_STUDY_PHANTOM_FUSION,  // the network over the last three steps; of several grasps: over them
    OM_STUDY_PHANTOM_PHYSICS,  // om_match_update
    OM_STUDY_PHANTOM_ALL,      // om_banet_update over the same steps: network, fusion and physics
    OM_STUDY_PHANTOM_NWAY
} OmStudyPhantomWay;

typedef enum OmStudyPhantomRow {  // of Table 4.2
    OM_STUDY_PHANTOM_CIRCLE,
    OM_STUDY_PHANTOM_CLOVER,
    OM_STUDY_PHANTOM_RECTANGLE,
    OM_STUDY_PHANTOM_DROP,
    OM_STUDY_PHANTOM_LIFT_20,
    OM_STUDY_PHANTOM_LIFT_40,
    OM_STUDY_PHANTOM_LIFT_60,
    OM_STUDY_PHANTOM_FLAT,
    OM_STUDY_PHANTOM_DEFORMED,
    // all grasps of a configuration, at the highest step up to 40 mm that each of them reaches
    OM_STUDY_PHANTOM_GRASPS,
    OM_STUDY_PHANTOM_TOTAL,  // ours: all steps
    OM_STUDY_PHANTOM_NROW
} OmStudyPhantomRow;

typedef struct OmStudyPhantomsDef {  // made by om_study_phantoms_default_def
    const char* out_dir;
    bool is_development;  // the two shapes for development instead of the four; default false
    bool is_quick;        // coarse meshes, and one configuration with two grasps; default false
    int ncase;  // configurations, default 0: all (24, or 12 for development); the first four are of all shapes
    int ngrasp;  // of each configuration at most; default 0: all
    // The network, as for om_banet_net_find: a file, "none", or null (default): the one that comes along, if any.
    // Without a network its ways are left out.
    const char* weights;
    double side;  // m, of the network's grid; default 0: om_banet_default_side
    // Another network in its place; null (default): none. Its name tells results apart.
    OmBanetEstimateFn estimate;
    void* estimate_ctx;         // borrowed; several threads may call with it at a time
    const char* estimate_name;  // default ""
    double threshold;           // of `estimate`, above 0, below 1; default 0.5
    int nworker;                // configurations at once, default 0: one a processor
    OmCookie cookie;
} OmStudyPhantomsDef;

typedef struct OmStudyPhantomScore {
    bool is_there;         // this build has the way
    int nrefused;          // without an estimate: no vertex is attached
    StudySample dsc, tpr;  // (4.3) and (4.6), 0 to 1, over the vertices of the underside
    // m, the twin with these attachments, lifted as the tissue was, against the points that the camera saw, less the
    // value at rest; and against the truth at all vertices of the volume (4.5)
    StudySample ave, volume;
} OmStudyPhantomScore;

typedef struct OmStudyPhantomResult {  // a row
    int n;                             // steps; of several grasps: configurations
    OmStudyPhantomScore same;          // the true attachments
    OmStudyPhantomScore by[OM_STUDY_PHANTOM_NWAY];
} OmStudyPhantomResult;

typedef struct OmStudyPhantomsSummary {
    int ncase, nlift, nview;  // configurations, lifts, steps
    int nnew_truth, nnew;     // lifts simulated now, configurations evaluated now
    bool has_network;
    int nlost;   // steps without correspondence: the network has no input and attaches nothing
    int nloose;  // solves of the protocol that did not reach the whole lift
    int nshort;  // lifts that ended before the free length: too much force, or the jaw lost the tissue
    StudySample rest;  // m, of the points at rest, one a lift
    OmStudyPhantomResult row[OM_STUDY_PHANTOM_NROW];
    bool is_met;  // the goals above
} OmStudyPhantomsSummary;

OmStudyPhantomsDef om_study_phantoms_default_def(const char* out_dir);
/// Make what is missing of lifts and estimates, then report.html, study.json and views.csv.
OmStatus om_study_phantoms_run(const OmStudyPhantomsDef* def, const OmProgress* progress,
                               OmStudyPhantomsSummary* summary);

#endif
