// study_trust_internal.h: acquisitions of lifted tissue, right ones and ones with a stated error, and their results.
//
// A truth is a sheet of the simulated world, held at a random patch (thesis 4.2.1), grasped near its border and lifted
// in steps: a picture before the tool touches it, and one at each height. Seed, share, place of the grasp and heights
// follow from the study's seed and the number of the truth. An error changes what a robot gets, as a wrong calibration,
// a wrong setting or another scene does; the tissue, the tools and the noise stay.
#ifndef OMENTUM_STUDY_TRUST_INTERNAL_H
#define OMENTUM_STUDY_TRUST_INTERNAL_H

#include "omentum/match.h"
#include "omentum/world.h"
#include "omentum/world_cloud.h"
#include "studies/study_table.h"
#include "studies/study_trust.h"

#define TRUST_NLIFT 5  // pictures of lifted tissue of a truth

typedef enum TrustError {  // of one acquisition
    TRUST_RIGHT,
    TRUST_SHIFT,     // the camera stands beside its calibrated place: m
    TRUST_TILT,      // it is turned about the middle of what it sees: rad
    TRUST_AIM,       // it is turned about itself: rad
    TRUST_FOCAL,     // focal length over the true one
    TRUST_SCALE,     // depth over the true one: a wrong unit or scale
    TRUST_RANGE,     // distances along the ray stored as depth: no size
    TRUST_MISSING,   // a share of the picture without depth, as 0, 65.535 m or the far limit
    TRUST_MIRRORED,  // colour mirrored against depth, left to right or top to bottom
    TRUST_INVERSE,   // the inverse of the camera's pose
    TRUST_OPENGL,    // y up and z backwards
    TRUST_ORDER,     // the quaternion's w taken as x
    TRUST_OTHER,     // the picture shows other tissue: the sheet of another truth
    TRUST_NERROR
} TrustError;

extern const char* const om__trust_error_name[TRUST_NERROR];  // for files
// of the printed size; "": none
extern const char* const om__trust_error_unit[TRUST_NERROR];

typedef struct TrustShot {  // one picture of a truth
    double time;
    OmArmObservation arm[OM_MAX_ARM];
    float* depth;          // (pixels)
    unsigned char* color;  // (pixels x 3)
} TrustShot;

typedef struct TrustTruth {  // om__trust_truth_done frees; zero-initialise
    OmScene scene;           // the twin has no attachments
    OmSite twin;
    unsigned char* attached;  // the true attachments on the twin's mesh    (nvert of twin.mesh)
    OmPsm psm[OM_MAX_ARM];
    int arm;          // that lifts
    OmPose grasp;     // measured tip when the jaw closed
    OmCamera camera;  // of the depth camera
    double share;     // of the underside that is held
    TrustShot rest;   // before the tool touches the tissue
    TrustShot lift[TRUST_NLIFT];
    double height[TRUST_NLIFT];  // m
    int nlift;                   // fewer where the jaw lost the tissue
    int number;
    uint64_t hash;  // of all that it depends on
} TrustTruth;

#define TRUST_CELLS 10  // of the twin's sheet along a side

// Move the world and write the result into a file of `dir`, or read it from there. Several threads may call it at a
// time.
OmStatus om__trust_truth_get(uint64_t seed, int number, int cells, const char* dir, int nworker,
                             TrustTruth* truth);
void om__trust_truth_done(TrustTruth* truth);
// Hash of the scene of a truth.
OmStatus om__trust_scene_hash(uint64_t seed, int number, int cells, uint64_t* hash);

typedef struct TrustCase {
    TrustError error;
    double size;  // in SI
    OmVec3 axis;  // unit: direction or axis, camera frame
    int variant;  // of TRUST_MISSING: 0, 1, 2; of TRUST_MIRRORED: 0, 1
} TrustCase;

// Case `number` of `seed`: an error of the list, its size from harmless to gross.
TrustCase om__trust_case(uint64_t seed, int number);
// One acquisition of lift k with an error: scans of the lifted tissue and of the tissue at rest, and the grasp.
// `other`: what TRUST_OTHER shows. om_acquisition_done and om_scan_done(&rest) free.
OmStatus om__trust_acquire(const TrustTruth* truth, int k, const TrustCase* c,
                           const TrustTruth* other, OmAcquisition* acquisition, OmScan* rest);

// ---- results ----------------------------------------------------------------------------------------

#define TRUST_MAX_NODE 512  // of the twin's underside
// Raise it with every change of the method: results in folders are then made anew.
#define TRUST_METHOD 2
#define TRUST_QUICK_TRUTHS 4

typedef struct TrustUpdate {
    int is_there;  // 0: the case could not be made
    int is_accepted;
    int is_moved;     // a camera was corrected
    int cause;        // OmMatchCause, of the last acquisition
    int is_left_out;  // of two acquisitions: the wrong one
    double dice;      // of the estimated set, accepted or not
    double ms, judge_ms;
    char reason[256];  // of a refusal, else of a correction
    float probability[TRUST_MAX_NODE];
    unsigned char attached[TRUST_MAX_NODE];
} TrustUpdate;

typedef struct TrustResult {  // of one truth; the contents of its file
    int nnode, nlift;         // vertices of the underside; lifts with a picture
    double share;             // of the underside, held
    double height[TRUST_NLIFT];
    unsigned char truth[TRUST_MAX_NODE];
    TrustCase c[TRUST_NLIFT];
    TrustUpdate right[TRUST_NLIFT], wrong[TRUST_NLIFT];
    TrustUpdate two[TRUST_NLIFT - 1];  // lift k right, lift k + 1 of another truth
} TrustResult;

typedef struct Trust {
    const OmStudyTrustDef* def;
    const OmProgress* progress;
    uint64_t seed;
    int ntruth, cells;
    int nneeded, needed[OM_STUDY_TRUST_MAX_TRUTH + 1];  // truths, for missing results
    TrustResult* result;                                // (ntruth)
    OmStudyTrustSummary sum;
} Trust;

// Is the cause the one of this error?
bool om__trust_is_named(TrustError error, int cause);
// Accepted, and more Dice lost than allowed.
bool om__trust_is_bad(const TrustUpdate* update, const TrustUpdate* right);
// The summary of n results, but nnew.
OmStatus om__trust_summarise(int n, const TrustResult* result, OmStudyTrustSummary* summary);
// Add n vertices; sums stand in the fields until om__trust_reliability_end.
void om__trust_reliability_add(OmStudyReliability* r, int n, const float* probability,
                               const unsigned char* attached, const unsigned char* truth);
void om__trust_reliability_end(OmStudyReliability* r);

StudyGoals om__trust_goals(const OmStudyTrustSummary* sum);
OmStatus om__trust_write(const Trust* s);

#endif
