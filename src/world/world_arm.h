// world_arm.h: the arms of a simulated world: what they are, how they move, what they measure. No tissue here.
#ifndef OMENTUM_WORLD_ARM_H
#define OMENTUM_WORLD_ARM_H

#include "omentum/world.h"

#define JAW_CLOSED (20.0 * OM_PI / 180.0)    // below: tissue is grasped (Alg. 4)
#define JAW_ON_TISSUE (5.0 * OM_PI / 180.0)  // tissue between the jaws stops them here

typedef struct ArmState {
    double q[OM_PSM_NJOINT];
    OmPose tip;        // pose_world_tip
    OmPose set, goal;  // the same, as the arm measures it, without tremor; of a motion
    double speed;      // m/s
    double jaw, jaw_goal, jaw_speed;  // rad, rad/s
    int nclose;                       // closings of the jaw in a world of om_world_create_arms
    bool is_moving;
} ArmState;

typedef struct SimState {  // all that changes but the tissue
    ArmState arm[OM_MAX_ARM];
    double time;     // s
    uint64_t nstep;  // for the noise of measured tips
} SimState;

// The constant error of an arm's calibration: where it measures its tip, less where the tip is, m.
OmVec3 om__world_arm_offset(const OmScene* scene, int index);
// As om_world_move: the arm steers by what it measures, it is at its goal when it measures itself there.
OmStatus om__world_arm_move(const OmScene* scene, const OmPsm* psm, int index, OmPose goal,
                            double speed, ArmState* arm);
void om__world_arm_set_jaw(const OmPsm* psm, double angle, ArmState* arm);
void om__world_arm_stop(ArmState* arm);
// Advance the tip; it stops at a point of the path that is out of reach.
void om__world_arm_step(const OmScene* scene, const OmPsm* psm, int index, double dt,
                        ArmState* arm);
// How hard a jaw closes, as a factor of the force at goal 0: more below it, twice at the most.
double om__world_arm_grip(const ArmState* arm);
// The angle of a jaw after `dt` where nothing is in its way, rad.
double om__world_arm_next_jaw(const ArmState* arm, double dt);
// What arms measure, without forces.
void om__world_arm_observe(const OmScene* scene, int narm, const SimState* now, OmObservation* obs);

// A world of arms alone. `psm`: (narm), copied.
OmStatus om__world_arms_create(const OmScene* scene, int narm, const OmPsm* const* psm,
                               const SimState* now, OmWorld** arms);
bool om__world_is_arms(const OmWorld* world);
// What the tissue says of an arm's closing `nclose`.
void om__world_arms_answer(OmWorld* arms, int index, int nclose, bool is_holding);

#endif
