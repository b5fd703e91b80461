/// omentum/world.h: one interface to an operating field (floor 4).
///
/// A world is known by observations and moved by commands; a controller cannot distinguish a simulated field from a
/// real one. The simulated field has its own mesh and stiffness, and noise on measurements. It contains a body
/// (body.h); the robot's twin is another.
///
///     OmWorld* world;
///     om_world_create_simulated(&scene, &site, 0, &world);
///     om_world_reset(world);                               // tissue at rest
///     om_world_move(world, 0, pose_world_tip, 0.02);       // PSM1, at 20 mm/s
///     om_world_advance(world, 0.02);
///     om_world_observe(world, OM_OBSERVE_VISIBILITY, &obs);
///     om_world_destroy(world);
#ifndef OMENTUM_WORLD_H
#define OMENTUM_WORLD_H

#include "omentum/body.h"
#include "omentum/image.h"
#include "omentum/robot.h"
#include "omentum/scene.h"
#include "omentum/sense.h"
#include "omentum/vec.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- worlds ---------------------------------------------------------------------------------------------

typedef struct OmArmObservation {
    double time;              // s, of the measurement
    OmPose tip;               // measured pose_world_tip
    double q[OM_PSM_NJOINT];  // measured joints: yaw, pitch, insertion (m), roll, wrist; rad
    double jaw;               // measured opening, rad
    double jaw_speed;         // measured, rad/s; below 0: the jaw closes
    double jaw_goal;          // commanded opening, rad
    bool is_moving;           // a commanded motion of the tip is under way
    // Estimate of the load on the tip, world frame, N and N m; without an estimate has_wrench is false and both are 0.
    // A simulated arm has one if the scene sets `world: force_noise`; its torque is 0.
    bool has_wrench;
    OmVec3 force, torque;
} OmArmObservation;

/// Tissue between the jaws, from what an arm measures: the jaw is commanded closed, at rest, but open by more
/// than 3 degrees. False while the jaw moves, and while it is commanded to stay open.
OM_API bool om_arm_is_holding(const OmArmObservation* arm);

/// Nothing between the jaws: the jaw is commanded closed and rests there. An arm that held tissue has lost it.
OM_API bool om_arm_is_empty(const OmArmObservation* arm);

enum {                          // what to observe beside the arms
    OM_OBSERVE_VISIBILITY = 1,  // visible fraction of the ROI
    OM_OBSERVE_IMAGE = 2,       // the endoscope's picture
    OM_OBSERVE_DEPTH = 4,       // the depth camera's depth
    OM_OBSERVE_COLOR = 8,       // the depth camera's colour, with OM_OBSERVE_DEPTH
    OM_OBSERVE_WINDOW = 16      // the endoscope's picture inside om_world_set_window
};

typedef struct OmWorldPicture {  // of the endoscope
    double time;                 // s, of the exposure; also of `visibility`
    OmCamera camera;             // intrinsics and pose, of the whole picture
    OmWindow window;             // the part of it that `color` shows; width 0: all of it
    OmPicture color;             // RGB; empty: not observed
} OmWorldPicture;

/// Each source has its own time: in a real world a picture is older than the joints. No measurement names an object:
/// om_cloud_init (world_cloud.h) finds the points on the tissue from depth, joints and known anatomy.
typedef struct OmObservation {         // om_observation_done frees; zero-initialise
    double time;                       // s, of the world's clock
    int narm;                          //
    OmArmObservation arm[OM_MAX_ARM];  // (narm)
    // Visible fraction of the ROI, 0 to 1, at endoscope.time. A simulated world computes it exactly, by rays against
    // its true geometry: this is the judge's. A controller measures its own in the endoscope's picture, see OmRoiMeter
    // (world_cloud.h).
    double visibility;
    OmWorldPicture endoscope;
    OmDepthPicture rgbd;
} OmObservation;

typedef struct OmWorld OmWorld;

/// Functions of one kind of world; the interface to a real robot implements the same table. The functions below check
/// arguments before they call it: the arm exists, a goal is a pose, angle and speed are finite, dt is positive, and
/// `what` has only flags of `sources`. Functions marked optional may be null.
typedef struct OmWorldOps {
    void (*destroy)(OmWorld* world);
    OmStatus (*move)(OmWorld* world, int arm, OmPose goal, double speed);
    OmStatus (*set_jaw)(OmWorld* world, int arm, double angle);
    void (*stop)(OmWorld* world, int arm);
    OmStatus (*advance)(OmWorld* world, double dt);
    OmStatus (*observe)(OmWorld* world, unsigned what, OmObservation* observation);
    OmStatus (*reset)(OmWorld* world);                    // optional
    size_t (*state_size)(const OmWorld* world);           // optional, with save and restore
    void (*save)(const OmWorld* world, void* block);      //
    void (*restore)(OmWorld* world, const void* block);   //
    void (*set_window)(OmWorld* world, OmWindow window);  // optional; needed by OM_OBSERVE_WINDOW
} OmWorldOps;

struct OmWorld {  // head of every kind of world
    const OmWorldOps* ops;
    int narm;                      // 1 to OM_MAX_ARM
    unsigned sources;              // OM_OBSERVE_ flags that the world can observe
    const OmPsm* psm[OM_MAX_ARM];  // calibrated kinematics; null: not known
    bool waits;  // its time stands still between two advances, though it has no snapshots
};

/// Number of arms: arms of a world are counted from 0.
OM_API int om_world_narm(const OmWorld* world);
/// OM_OBSERVE_ flags that the world can observe.
OM_API unsigned om_world_sources(const OmWorld* world);
/// Calibrated kinematics of an arm: with the measured joints they give the pose of the tool. Null: not known.
OM_API const OmPsm* om_world_psm(const OmWorld* world, int arm);
/// The arm, 0 or 1, of a simulated world at a site, and its parked tip (pose_world_tip); the robot knows both.
OM_API OmPsm om_world_place_psm(const OmSite* site, int arm);
OM_API OmPose om_world_place_tip(const OmSite* site, int arm);
/// Command a straight motion of the tip at `speed` m/s; returns at once. The orientation turns in proportion to the
/// distance covered; where it would turn faster than OM_WORLD_MAX_TURN, the tip is slower.
/// @param goal  pose_world_tip, a unit quaternion
/// @return OM_OK; OM_INVALID (no such arm, a goal that is not a pose or is out of reach: the message names
///         the joint)
OM_API OmStatus om_world_move(OmWorld* world, int arm, OmPose goal, double speed);
#define OM_WORLD_MAX_TURN 1.0  // rad/s
/// For an implementation of `move`: the pose after `dt` seconds of a straight motion at `speed` m/s. The slower of
/// translation and rotation limits it.
/// @param is_there  out: the pose is the goal
OM_API OmPose om_world_straight_step(OmPose from, OmPose goal, double speed, double dt,
                                     bool* is_there);
/// Command the jaw angle, rad. Below 20 degrees the jaw grasps the tissue at the tip, above it releases the tissue.
/// Tissue stops a simulated jaw at 5 degrees; without tissue the jaw closes to 0.
/// @return OM_OK; OM_INVALID (no such arm, an angle that is not finite)
OM_API OmStatus om_world_set_jaw(OmWorld* world, int arm, double angle);
OM_API void om_world_stop(OmWorld* world, int arm);
/// Advance the world by `dt` seconds.
/// @return OM_OK; OM_INVALID (dt out of range); errors of the world, of a simulated one those of om_body_step and,
///         where a jaw closes on tissue, of om_tissue_get_forces
OM_API OmStatus om_world_advance(OmWorld* world, double dt);
/// Observe the arms, and OM_OBSERVE_ flags `what` beside them.
/// @return OM_OK; OM_INVALID (`what` has other flags); OM_UNAVAILABLE (the world has no such source: the message names
///         it); errors of the world
OM_API OmStatus om_world_observe(OmWorld* world, unsigned what, OmObservation* observation);
/// The part of the endoscope's picture that OM_OBSERVE_WINDOW observes from now on; at first, and for a window of
/// width 0, the whole picture. A simulated world renders this part only. No effect on a world without this source.
OM_API void om_world_set_window(OmWorld* world, OmWindow window);
OM_API void om_world_destroy(OmWorld* world);
OM_API void om_observation_done(OmObservation* observation);

/// Bring the world to its start: arms parked and still, tissue at rest, time 0. A simulated world is not at rest before
/// its first reset, which lets the tissue settle; a later reset returns to the same state.
/// @return OM_OK; OM_NOT_CONVERGED (at the start, but the tissue still moves after OM_WORLD_SETTLE_TIME);
///         OM_UNAVAILABLE (a person must prepare this world); errors of om_body_settle
OM_API OmStatus om_world_reset(OmWorld* world);
#define OM_WORLD_SETTLE_TIME 3.0    // s, at most
#define OM_WORLD_SETTLE_SPEED 1e-3  // m/s, of vertices: slower is at rest
/// Size of a snapshot in bytes; 0: this world has none.
OM_API size_t om_world_state_size(const OmWorld* world);
/// Copy everything that changes, except om_body_nbad, into a block of om_world_state_size bytes.
/// @return OM_OK; OM_UNAVAILABLE (this world has no snapshots)
OM_API OmStatus om_world_save(const OmWorld* world, void* block);
/// Return to a snapshot of the same world. All later states and measurements are equal to the last bit, also noise.
/// @return OM_OK; OM_UNAVAILABLE (this world has no snapshots)
OM_API OmStatus om_world_restore(OmWorld* world, const void* block);

/// A simulated operating field. Scene and site (of role OM_SITE_WORLD) are borrowed until destroy.
/// @param nworker  threads of the tissue, 0: one a processor; the outcome does not depend on it
/// @return OM_OK; OM_INVALID (the message names the field of the scene); OM_NO_MEMORY; OM_UNAVAILABLE (Embree
///        failed)
OM_API OmStatus om_world_create_simulated(const OmScene* scene, const OmSite* site, int nworker,
                                          OmWorld** world);
/// Replace arm and instrument of one arm of a simulated world, before its first step; where its base is stays.
/// @param tool  jaw, joints and limits count; pose_world_rcm does not
/// @return OM_OK; OM_INVALID (no such arm, a world that has advanced, or no joints for the place of the tip);
///         OM_UNAVAILABLE (not a simulated world); the world is unchanged on error
OM_API OmStatus om_world_set_tool(OmWorld* world, int arm, const OmPsm* tool);
/// The arms of a simulated world apart from its tissue, for a program whose arms must keep time while the tissue steps
/// in another thread, as a robot does: a world without sources, whose arms move, measure and end where those of `world`
/// are now. It has snapshots. A jaw that closes waits for the tissue's answer near the angle at which tissue stops it.
///
///     om_world_create_arms(world, &arms);
///     om_world_advance(arms, dt); om_world_observe(arms, 0, &obs);   // one thread, as often as it likes
///     om_world_save(arms, block);                                    //
///     om_world_set_arms(world, block);                               // the thread of the tissue, with its block
///     om_world_advance_tissue(world, dt_tissue);                     //
///     om_world_answer_arms(world, arms);                             // while neither of both is at work
///
/// @return OM_OK; OM_UNAVAILABLE (not a simulated world); OM_NO_MEMORY
OM_API OmStatus om_world_create_arms(const OmWorld* world, OmWorld** arms);
/// Put the arms of a simulated world, and its clock, where a snapshot of its arms has them. The tissue is unchanged.
/// @return OM_OK; OM_UNAVAILABLE (not a simulated world)
OM_API OmStatus om_world_set_arms(OmWorld* world, const void* block);
/// Advance the tissue alone by `dt` seconds: jaws that have closed grasp it, open ones let go, tips pull it, at
/// 0.25 m/s and 5 rad/s at most, where the arms are ahead. The clock of the world stays that of its arms.
/// @return as om_world_advance; OM_UNAVAILABLE (not a simulated world)
OM_API OmStatus om_world_advance_tissue(OmWorld* world, double dt);
/// Let the arms know which of them hold tissue.
/// @return OM_OK; OM_UNAVAILABLE (`world` is not simulated); OM_INVALID (`arms` are not of om_world_create_arms)
OM_API OmStatus om_world_answer_arms(const OmWorld* world, OmWorld* arms);
/// The endoscope of a scene: intrinsics, and its pose at a site.
OM_API OmCamera om_world_endoscope(const OmScene* scene, const OmSite* site);
/// The endoscope's view of the ROI over fixed anatomy and tissue, without tools: for trials of motions on a body alone.
typedef struct OmView OmView;
/// @param site  borrowed until destroy
/// @return OM_OK; OM_NO_MEMORY; OM_UNAVAILABLE (Embree failed)
OM_API OmStatus om_view_create(const OmScene* scene, const OmSite* site, OmView** view);
/// The same of a body's own surface, for positions of om_body_x: of quadratic elements with the midpoints of edges. An
/// organ that deforms and the ROI on it are where the last positions put them.
/// @param body  its site is borrowed until destroy
/// @return as om_view_create
OM_API OmStatus om_view_create_of_body(const OmScene* scene, const OmBody* body, OmView** view);
OM_API void om_view_destroy(OmView* view);
/// @param x  vertex positions of the site's or the body's mesh, m (nvert x 3); null: without tissue, for the largest
///           visibility that a retraction can reach
/// @return OM_OK; OM_NO_MEMORY; OM_UNAVAILABLE (Embree failed)
OM_API OmStatus om_view_look(OmView* view, const double* x, OmVisibility* visibility);
/// Check that the ROI could be seen with the tissue removed.
/// @return OM_OK; OM_INVALID if less than OM_WORLD_MIN_VISIBLE of the ROI, or less than the task's own
///         `visibility`, could be seen: the message names the reason and the remedy; OM_NO_MEMORY
OM_API OmStatus om_world_check_visible(const OmScene* scene, const OmSite* site);
#define OM_WORLD_MIN_VISIBLE 0.9
/// The true body of a simulated world, for recordings and evaluation; null for any other world.
OM_API OmBody* om_world_truth(OmWorld* world);
/// Where an arm of a simulated world measures itself, without tremor (pose_world_tip): the start of its next motion.
/// @return false, and the identity, for a world that is not simulated or without that arm
OM_API bool om_world_setpoint(const OmWorld* world, int arm, OmPose* setpoint);
/// Shaft, wrist and jaws of an arm at the current pose; the triangles never change. Valid until the next call; null for
/// a world that is not simulated.
OM_API const OmSurface* om_world_tool(OmWorld* world, int arm);
/// The endoscope's view of a simulated world at any size, for reports.
/// @return OM_OK; OM_INVALID (a size out of range); OM_NO_MEMORY; OM_UNAVAILABLE (not a simulated world)
OM_API OmStatus om_world_render(OmWorld* world, int width, int height, OmPicture* picture);
/// The same from any camera.
/// @return OM_OK; OM_INVALID (the camera); OM_NO_MEMORY; OM_UNAVAILABLE (not a simulated world)
OM_API OmStatus om_world_render_from(OmWorld* world, const OmCamera* camera, OmPicture* picture);

#ifdef __cplusplus
}
#endif
#endif
