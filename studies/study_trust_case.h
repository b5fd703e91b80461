// study_trust_case.h: acquisitions of lifted tissue, right ones and ones with a stated error.
//
// A truth is a sheet of the simulated world, held at a random patch (thesis 4.2.1), grasped near its border and lifted
// in steps: a picture before the tool touches it, and one at each height. Seed, share, place of the grasp and heights
// follow from the study's seed and the number of the truth. An error changes what a robot gets, as a wrong calibration,
// a wrong setting or another scene does; the tissue, the tools and the noise stay.
#ifndef OMENTUM_STUDY_TRUST_CASE_H
#define OMENTUM_STUDY_TRUST_CASE_H

#include "omentum/match.h"
#include "omentum/world.h"
#include "omentum/world_cloud.h"

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

#endif
