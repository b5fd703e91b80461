// dds_arm.h: an arm of the simulated robot: CRTK's operating states, and motions with their limits. No DDS here.
//
//     om__arm_init(&arm, &psm, tip, q);
//     om__arm_command(&arm, "home");
//     om__arm_servo_cp(&arm, time, goal);
//     if (om__arm_step(&arm, time, dt)) ...     // arm.setpoint is another one
#ifndef OMENTUM_DDS_ARM_H
#define OMENTUM_DDS_ARM_H

#include "dds/dds_link.h"

#define ARM_TIMEOUT 0.25   // s after which a servoed arm stops for want of another command
#define ARM_SPEED 0.25     // m/s, of the tip
#define ARM_MAX_STEP 0.05  // m from the setpoint to a servoed goal
#define ARM_MAX_TURN 0.5   // rad: the same

typedef enum ArmMode { ARM_DISABLED, ARM_ENABLED, ARM_PAUSED, ARM_FAULT, ARM_NSTATE } ArmMode;

typedef enum ArmMotion { ARM_HOLD, ARM_SERVO_CP, ARM_SERVO_JP, ARM_MOVE } ArmMotion;

typedef struct Arm {
    OmPsm psm;
    ArmMode mode;
    bool is_homed;
    ArmMotion motion;              // ARM_MOVE: busy
    OmPose setpoint;               // pose_world_tip
    double q[OM_PSM_NJOINT];       // joints of the setpoint
    OmPose goal;                   // of ARM_SERVO_CP, and of ARM_MOVE
    double from_q[OM_PSM_NJOINT];  // of ARM_MOVE
    double goal_q[OM_PSM_NJOINT];  // of ARM_SERVO_JP and ARM_MOVE
    double begin, duration;        // s, of ARM_MOVE
    double heard;                  // s, time of the last servoed goal, or sign of a move's client
    double patience;               // s without a sign, then ARM_MOVE stops; a new move: INFINITY
    double ratio;                  // of the speed of ARM_MOVE, above 0 to 1
    bool has_timed_out;            // of the last step: stopped before its goal
    double jaw_goal;               // rad
    double jaw_stop;               // rad, the goal of a jaw that has to stop now: as measured
} Arm;

void om__arm_init(Arm* arm, const OmPsm* psm, OmPose tip, const double q[OM_PSM_NJOINT],
                  double jaw);
// "DISABLED", "ENABLED", "PAUSED", "FAULT".
const char* om__arm_mode_name(ArmMode mode);
// A state_command: enable, disable, pause, resume, home, unhome, fault, clear_fault.
// @return OM_INVALID: an unknown command, or one that this state refuses
OmStatus om__arm_command(Arm* arm, const char* command);
// Commands of motion. @return OM_INVALID (not enabled and homed, not finite, out of reach, too far), nothing is changed
OmStatus om__arm_servo_cp(Arm* arm, double time, OmPose goal);
OmStatus om__arm_servo_jp(Arm* arm, double time, const LinkJoints* joints);
OmStatus om__arm_move_cp(Arm* arm, double time, OmPose goal);
OmStatus om__arm_move_jp(Arm* arm, double time, const LinkJoints* joints);
OmStatus om__arm_jaw(Arm* arm, const LinkJoints* joints);
// By the sign of the effort alone: below 0 the jaw closes, above 0 it opens, at 0 it stays. @return OM_INVALID
OmStatus om__arm_jaw_effort(Arm* arm, const LinkJoints* joints);
// Stop the arm and the jaw.
void om__arm_hold(Arm* arm);
// The share of the speed of moves to come. @return OM_INVALID: not above 0, or above 1
OmStatus om__arm_set_ratio(Arm* arm, double ratio);
// Advance the setpoint. @return whether it is another one
bool om__arm_step(Arm* arm, double time, double dt);
// The rotation from one orientation to another, as axis times angle (rad, at most pi), in their common frame.
OmVec3 om__arm_turn(OmQuat from, OmQuat to);
// The pose that the arm takes for a goal: of fewer than six joints the nearest orientation. @return OM_INVALID
OmStatus om__arm_reach(const Arm* arm, OmPose goal, double q[OM_PSM_NJOINT], OmPose* reached);
// Names of the joints, as the dVRK has them.
const char* om__arm_joint_name(int joint);

#endif
