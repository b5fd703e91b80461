// study_hand.h: what the studies of lifted tissue share: an arm of the simulated world, kept pictures, scans.
#ifndef OMENTUM_STUDY_HAND_H
#define OMENTUM_STUDY_HAND_H

#include <time.h>

#include "omentum/scan_picture.h"
#include "omentum/world.h"
#include "omentum/world_cloud.h"

#define HAND_FAST 0.1    // m/s, to the tissue
#define HAND_SPEED 0.04  // m/s, of a lift
#define HAND_ABOVE 0.02  // m, before the jaw goes down to the tissue

typedef struct StudyHand {  // an arm that is driven as a robot drives it
    const char* name;       // of the case, for messages
    OmWorld* world;         // borrowed
    double dt;              // s, of a tick
    int arm;
    OmObservation obs;  // after the last tick; om_observation_done frees
} StudyHand;

// Let n ticks pass.
OmStatus om__hand_wait(StudyHand* h, int n);
// Move the tip to p, world frame, and wait for its arrival. OM_INVALID: it does not arrive.
OmStatus om__hand_go(StudyHand* h, OmVec3 p, double speed);
// Go with an open jaw to `above`, then to `at`, and close it.
OmStatus om__hand_close(StudyHand* h, OmVec3 above, OmVec3 at);
// The same. OM_INVALID: there is no tissue in the jaw.
OmStatus om__hand_grasp(StudyHand* h, OmVec3 above, OmVec3 at);
// N, pull on the tool.
OmStatus om__hand_force(const StudyHand* h, double* force);

// A kept picture of the depth camera as an observation; om_observation_done frees.
OmStatus om__hand_show(double time, const OmArmObservation arm[OM_MAX_ARM], int narm,
                       const OmCamera* camera, const float* depth, const unsigned char* color,
                       OmObservation* obs);
// The scan of an observation on the robot's own site, without the tools of `psm` (OM_MAX_ARM; null: none is known).
// spacing: m, of its points; 0: om_site_spacing.
OmStatus om__hand_scan(const OmObservation* obs, const OmSite* twin, const OmPsm* psm,
                       double spacing, OmScan* scan);
// Share of a surface's area that faces `eye`: an upper bound of the visible share. Vertex i is at x[vert[i]].
double om__hand_share_facing(const OmSurface* surface, const int* vert, const double* x,
                             OmVec3 eye);
// A surface with vertex i at x[vert[i]]; om_surface_done frees.
OmStatus om__hand_surface(const OmSurface* surface, const int* vert, const double* x,
                          OmSurface* out);
// Processor time of the program since `begin`, ms.
double om__processor_ms(clock_t begin);

#endif
