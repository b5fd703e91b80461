/// omentum/robot.h: the patient-side manipulator (PSM) of the da Vinci Research Kit (floor 2).
///
/// Six joints in modified Denavit-Hartenberg convention, as the dVRK's own files give them: yaw, pitch and
/// insertion about a remote centre of motion, then roll, wrist pitch and wrist yaw. At zero the shaft
/// points along -z of the base; z of the tip frame is the direction of the jaws. Instruments without wrist, or
/// with one joint of it, leave four or five: values of the others are 0.
///
///     OmPsm psm = om_psm_default(OM_PROGRASP, pose_world_rcm);
///     double q[6] = {0, 0, 0.1, 0, 0, 0};
///     OmPose pose_world_tip = om_psm_forward(&psm, q);
///     om_psm_inverse(&psm, pose_world_tip, q, q);
#ifndef OMENTUM_ROBOT_H
#define OMENTUM_ROBOT_H

#include "omentum/shape.h"
#include "omentum/vec.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_PSM_NJOINT 6

typedef enum OmInstrument {
    OM_LARGE_NEEDLE_DRIVER,  // large needle driver, 400006
    OM_PROGRASP              // 400093
} OmInstrument;

typedef struct OmPsmRow {  // Rx(alpha) Tx(a) Rz(theta + joint) Tz(d): rad, m
    double alpha, a, theta, d;
} OmPsmRow;

typedef struct OmPsm {
    OmPose pose_world_rcm;        // base frame at the remote centre of motion
    double insertion;             // m, of the carriage from the remote centre at zero; below 0
    double shaft;                 // m, length of the instrument up to the wrist pitch axis
    double wrist;                 // m, wrist pitch axis to wrist yaw axis; with rows: as drawn
    double q_min[OM_PSM_NJOINT];  // rad; m for the insertion
    double q_max[OM_PSM_NJOINT];
    double jaw_min, jaw_max;  // rad; 0 without a jaw
    int njoint;               // 4 to 6
    bool has_jaw;             //
    // An instrument of another form than shaft, wrist pitch and wrist yaw: roll and wrist are rows of its file
    bool has_rows;
    OmPsmRow row[3];       // (njoint - 3)
    OmPose pose_last_tip;  // in the frame of the last joint
} OmPsm;

OM_API OmPsm om_psm_default(OmInstrument instrument, OmPose pose_world_rcm);
/// Replace the instrument: roll and wrist, their limits, and the jaw, from a file of the dVRK's configuration
/// (share/tool/*.json, comments allowed): Classic, S and Si, with a wrist of two joints, of one, or none; without "jaw"
/// it has none. The snake-like wrists of 5 mm have more joints and are refused.
/// @return OM_OK; OM_INVALID (the message names the line or the key); OM_UNAVAILABLE (another form of roll or wrist);
///         OM_NO_MEMORY; OM_IO; psm is unchanged on error
OM_API OmStatus om_psm_load_instrument(const char* path, OmPsm* psm);
/// The same from memory; `name` is the file's in messages.
/// @return as om_psm_load_instrument, without OM_IO
OM_API OmStatus om_psm_parse_instrument(const char* text, size_t size, const char* name,
                                        OmPsm* psm);
/// Replace the arm under the instrument: limits of yaw, pitch and insertion, and where the insertion begins, from a
/// file of the dVRK's configuration (share/arm/PSM.json, PSM_Si.json). An S or Si instrument needs the arm PSM_Si.
/// @return as om_psm_load_instrument
OM_API OmStatus om_psm_load_arm(const char* path, OmPsm* psm);
/// The same from memory; `name` is the file's in messages.
/// @return as om_psm_load_instrument, without OM_IO
OM_API OmStatus om_psm_parse_arm(const char* text, size_t size, const char* name, OmPsm* psm);
/// "yaw", "pitch", "insertion", "roll", "wrist pitch", "wrist yaw".
OM_API const char* om_psm_joint_name(int joint);

/// Pose of the tip for joint values (rad, m); limits are not looked at.
OM_API OmPose om_psm_forward(const OmPsm* psm, const double q[OM_PSM_NJOINT]);
/// d(tip)/dq: rows linear velocity (m) then angular velocity (rad), world frame, row-major 6 x 6.
OM_API void om_psm_jacobian(const OmPsm* psm, const double q[OM_PSM_NJOINT], double jacobian[36]);
/// Joint values that bring the tip to a pose, in closed form; of roll angles a turn apart, the one nearest
/// to `q_near`. With rows of a file, by least squares to 1e-7 rad, in closed form but for the orientation.
/// @return OM_OK; OM_INVALID: no such values within the limits, the message names the joint, what it would
///         need and its limit, or how far an arm of fewer than six joints is off this orientation; q is unchanged
OM_API OmStatus om_psm_inverse(const OmPsm* psm, OmPose pose_world_tip,
                               const double q_near[OM_PSM_NJOINT], double q[OM_PSM_NJOINT]);
/// As om_psm_inverse; an arm of fewer than six joints takes the nearest orientation that it reaches at the point.
/// @param reached  the pose that q gives: with six joints the wanted one
/// @return as om_psm_inverse; q and reached are unchanged on error
OM_API OmStatus om_psm_inverse_nearest(const OmPsm* psm, OmPose pose_world_tip,
                                       const double q_near[OM_PSM_NJOINT], double q[OM_PSM_NJOINT],
                                       OmPose* reached);
/// As om_psm_inverse, for a tool whose orientation is not important: where a joint forbids the pose, the wrist is
/// turned about the tip, by the smallest multiple of 5 degrees that the limits allow; an arm of fewer than six joints
/// takes the nearest orientation.
/// @param max_turn  rad, 0 to pi
/// @param turned    the pose that q gives: the same point, the same orientation if no turn is needed
/// @return OM_OK; OM_INVALID: no turn of at most max_turn helps; the message is that of the pose itself; q and turned
///         are unchanged
OM_API OmStatus om_psm_inverse_turned(const OmPsm* psm, OmPose pose_world_tip, double max_turn,
                                      const double q_near[OM_PSM_NJOINT], double q[OM_PSM_NJOINT],
                                      OmPose* turned);
/// Joint torques (N m; N for the insertion) that hold a force and torque of the tip on its surroundings:
/// J^T w, w = (force, torque) in the world frame.
OM_API void om_psm_joint_torque(const OmPsm* psm, const double q[OM_PSM_NJOINT], OmVec3 force,
                                OmVec3 torque, double effort[OM_PSM_NJOINT]);

/// The first vertices and triangles of om_psm_surface are the shaft, the others wrist and jaws.
enum { OM_PSM_SHAFT_NVERT = 24, OM_PSM_SHAFT_NTRI = 44 };

/// The shape of shaft, wrist and open jaws for a picture; world frame, always the same triangles.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_psm_surface(const OmPsm* psm, const double q[OM_PSM_NJOINT], double jaw,
                               OmSurface* surface);
/// The same for a surface that om_psm_surface made: only positions are written.
OM_API void om_psm_surface_update(const OmPsm* psm, const double q[OM_PSM_NJOINT], double jaw,
                                  OmSurface* surface);

#define OM_PSM_NCAPSULE 4
typedef struct OmPsmCapsule {  // points within `radius` of the segment from a to b; world frame, m
    OmVec3 a, b;
    double radius;
} OmPsmCapsule;
/// Capsules that enclose the shape of om_psm_surface: shaft, wrist and two jaws.
OM_API void om_psm_capsules(const OmPsm* psm, const double q[OM_PSM_NJOINT], double jaw,
                            OmPsmCapsule capsule[OM_PSM_NCAPSULE]);

#ifdef __cplusplus
}
#endif
#endif
