// act_state.h: the state of the arms, and what trying in the twin shares with it.
#ifndef OMENTUM_ACT_STATE_H
#define OMENTUM_ACT_STATE_H

#include <math.h>

#include "omentum/act.h"
#include "omentum/body.h"
#include "omentum/robot.h"
#include "omentum/scan.h"
#include "omentum/scene.h"
#include "omentum/world.h"
#include "omentum/world_cloud.h"

// ---- the grid of blocks (act_grid.c) -----------------------------------------------------------------------

// The tissue cut into n x n blocks in the task frame. A block's grasping point is a vertex of the twin, of shells the
// middle of a cell's upper face: they are held by the face under the tip, so at a vertex by one of four beside it.
typedef struct Grid {
    int n;
    OmPose task;                  // pose_world_task
    OmVec3 half;                  // half extent of the tissue, m
    int vert[OM_PLAN_MAX_BLOCK];  // of the twin's mesh, at the grasping point; -1: no tissue there
    // vertices whose middle is the grasping point; all four are `vert` but of shells
    int face[OM_PLAN_MAX_BLOCK][4];
    OmVec3 tip[OM_PLAN_MAX_BLOCK];         // the grasping point at rest, task frame, m
    double center[3 * OM_PLAN_MAX_BLOCK];  // of the blocks at rest, task frame, m
    int roi_block;
    OmVec3 roi;  // centre of the ROI, task frame, m
} Grid;

// m as a fraction of the tissue's smaller side: of the middle of a block from an attachment, at least. It has no effect
// on grids up to 5 x 5.
#define ATTACHMENT_DISTANCE 0.09

int om__grid_block_of(const Grid* grid, OmVec3 p_world);  // the nearest for a point outside
bool om__grid_has(const Grid* grid, int block, OmVec3 p_task);
double om__grid_length(const Grid* grid, double fraction);  // of the tissue's smaller side, m
OmStatus om__grid_build(const OmSceneTask* task, const OmSite* site, Grid* grid);
// A pull at the block would load an attachment at the place p: it lies below the block, or near its middle.
bool om__grid_loads(const Grid* grid, int block, OmVec3 p_world);
bool om__grid_is_fixed(const Grid* grid, const OmBody* body, int block);
// The same with attachments `attached` (nvert).
bool om__grid_is_fixed_by(const Grid* grid, const OmTetMesh* mesh, const unsigned char* attached,
                          int block);

// The grasping point of a block that has one, on a body with vertices x. World frame, m.
OmVec3 om__grid_point(const Grid* grid, const double* x, int block);

static inline OmVec3 om__to_task(const Grid* grid, OmVec3 p_world) {
    return om_pose_apply(om_pose_inverse(grid->task), p_world);
}

// ---- limits, the same for the arms and for trials in the twin -----------------------------------------------

#define FOLD_STEP 0.010  // m, step of a fold beyond its nominal length
#define FOLD_GAIN 0.01   // visibility that each of these steps must gain
#define FALL_TIME 1.2    // s, wait for released tissue to fall
#define LOOK_EVERY 5     // ticks between looks through the endoscope

// What ends a motion that holds tissue (act_motion.c).
#define SLOW_FROM 0.75    // fraction of the force limit above which a motion slows down
#define SLOW_RATE 0.25    // fraction of the nominal speed at the force limit
#define SLOW_TIME 0.6     // s above the force limit, in one motion, after which the motion ends
#define OVER_FACTOR 1.5   // times the limit; above it a motion ends at once
#define EASE 0.9          // fraction of the limit to which the force is reduced after a force stop
#define MOTION_TIME 30.0  // s; a longer motion is an error

// When the ROI counts as exposed.
#define VISIBLE_TIME 0.5  // s for which the ROI must be seen without a break
#define VERIFY_LIMIT 1.5  // s, longest verification
#define MAX_CONTINUED 8   // commands of one action, counting those after the ROI closed

#define JAW_OPEN (40.0 * OM_PI / 180.0)

// The force by the twin at which the arms act, N.
static inline double om__force_limit(const OmSceneTask* task) {
    return task->force_threshold - task->force_margin;
}
/// @return OM_OK; OM_INVALID (the task watches the force, and the engine has none in newtons)
OmStatus om__check_watch(const OmSceneTask* task, const OmTissueEngine* engine);
// Fraction of the nominal speed at a force: full speed up to a share of the limit, from there it falls in steps.
double om__force_rate(double force, double limit);

// Decides when a motion stops because the ROI is exposed: at `wanted` plus the margin, or past a maximum above
// `wanted`.
typedef struct Watch {
    double wanted, margin;  // visibility
    double best;            // largest visibility in this motion
} Watch;
// Add a look; true where a motion should stop because the ROI is exposed.
bool om__watch_stop(Watch* watch, double visibility);

// What ends a motion that holds tissue, after a step: OM_ACTION_FORCE, OM_ACTION_EXPOSED; OM_ACTION_DONE: nothing.
// @param limit  N; INFINITY: none
// @param over   s of this motion above the limit
OmActionOutcome om__motion_outcome(Watch* watch, double visibility, double force, double limit,
                                   double over);

// Path of a fold of tissue held at `tip`: a unit vector along the board and a length, m, in the task frame. The length
// is 0 where the fold has no direction.
void om__fold_path(const Grid* grid, double retract, OmVec3 tip, OmPlanVerb verb, OmVec3* direction,
                   double* length);

// The arm reaches a pose, turned by at most max_turn about the tip; `turned` is then the orientation.
bool om__wrist_reach(const OmPsm* psm, OmPose straight, double max_turn,
                     const double near[OM_PSM_NJOINT], double q[OM_PSM_NJOINT], OmQuat* turned);

// ---- the state of the arms ---------------------------------------------------------------------------------

// The grasping point of a block now (act_point.c).
typedef enum GraspSource {
    GRASP_FILLED,    // the twin's: hidden from the depth camera, or there is none
    GRASP_AGREED,    // the twin's, where tissue was measured
    GRASP_MEASURED,  // measured, further than OM_CLOUD_AGREE from the twin's
    GRASP_NONE       // no tissue is there
} GraspSource;
typedef struct GraspPoint {
    OmVec3 tip;  // task frame, m; of GRASP_NONE the twin's
    GraspSource source;
    double off;  // m, from the twin's
} GraspPoint;

// One arm.
typedef struct ArmState {
    int at;                            // block that the arm was moved to, -1
    int in_hand;                       // block held, -1
    OmVec3 grasp_tip;                  // task frame, where the jaw closed
    OmVec3 fold_tip;                   // task frame, where the first fold of this grasp began
    OmPlanVerb fold;                   // the last fold of this grasp; OM_PLAN_PULL: there was none
    OmVec3 tip;                        // task frame, measured
    OmQuat q;                          // world frame, measured: motions keep it
    OmQuat q_straight;                 // from which the wrist was turned (act_wrist.c)
    bool is_turned;                    // q_straight is set
    double joint[OM_PSM_NJOINT], jaw;  // measured, rad and m
    double lift;                       // m above grasp_tip while holding
    // m, world frame: the twin's grasped tissue lies this far beside the tip, and is drawn to it
    OmVec3 twin_off;
    bool is_closed;
    bool is_moving;
    bool is_max_force;
    bool is_at_top;  // a pull found no place above, or raised the tip no further
} ArmState;

// One straight motion of a tip, from its first command to its end.
typedef struct Motion {
    int arm;
    OmVec3 goal, from;  // task frame, m; a force stop leads back to `from`
    bool is_holding;    // tissue is in hand: force and visibility may end the motion
    bool is_easing;     // the arm moves back after a force stop
    double commanded;   // fraction of the nominal speed, -1 before the first command
    double elapsed;     // s that the path so far takes at full speed
    double ease_begin;  // s
    bool may_turn;      // the wrist, where a joint forbids the orientation
    OmQuat q;           // orientation at the goal, world frame
    double turn;        // of the wrist, rad; 0: the orientation need not change
    double turn_rate;   // fraction of the nominal speed that the turn allows
    OmVec3 start;       // where the tip was at first, task frame, m
    OmVec3 place;       // where the arm is sent: the goal, or the next place of the motion law
    OmVec3 last;        // the tip when it was sent there
    int nplace;         // places of the law so far; -1: straight to the goal
    Watch watch;
    OmActionOutcome outcome;
} Motion;

// The current action: its step, and the wait or the motion of that step.
typedef struct Action {
    OmPlanAction plan;
    int step;            // counts from 0; its meaning depends on the verb
    int nwait;           // ticks left of a wait; 0: the step is a motion
    int nlook;           // at a jaw that still closes
    OmVec3 waypoint[3];  // of a reach, task frame, m
    OmVec3 tip;          // of a fold: where it began, task frame, m
    OmVec3 direction;    // of a fold, a unit vector in the task frame
    double length;       // of a fold, m
    double before;       // visibility before the current step of a fold
    double lift, rise;   // of a pull: m, over the grasp before it, and the way to its goal
    bool may_turn;       // of a fold: none is in reach without a turn of the wrist
    double turn;         // of the wrist, rad, the largest of the action
    char turn_reason[64];
    OmActionOutcome outcome;
} Action;

// What the loop must learn at once; each may be null.
typedef struct ActHost {
    void* ctx;
    void (*on_scan)(void* ctx, OmScan* scan);           // of the tissue; it may take the scan over
    void (*on_grasp)(void* ctx, int arm, OmPose tip);   // world and twin hold tissue
    OmStatus (*on_release)(void* ctx, int arm);         // the jaw opens
    void (*on_lag)(void* ctx, int arm, double behind);  // the arm does not follow its command, m
} ActHost;

typedef struct Act {
    // borrowed
    const OmSceneTask* task;
    const Grid* grid;
    OmWorld* world;
    OmBody* twin;
    OmEffort* effort;  // counted
    ActHost host;
    int narm;         // of the world
    OmMotionLaw law;  // of reaches and pulls; next null: straight lines

    // of the last step, by the loop
    double time;  // s of the operation
    int tick;
    double visibility;         // of the last look
    double force[OM_MAX_ARM];  // N, pull less weight, by the twin
    bool is_over;              // the force is above om__force_limit
    double over_time;          // s of the current motion above it, without pauses
    double rate;               // fraction of the nominal speed, by the force
    double warn_rate;          // the same of motions that hold tissue, by the warning state
    double person_rate;        // the same of every motion, by a person
    double margin;             // visibility above the wanted one at which a motion stops
    int ncontinued;            // times the current action was continued after the ROI closed

    ArmState arm[OM_MAX_ARM];
    Action action;
    Motion motion;

    // computed by act_point.c
    bool has_cloud;  // set by om__act_init: the world observes depth
    OmScanDef scan;
    OmCloudDef space;
    GraspPoint point[OM_PLAN_MAX_BLOCK];
    int point_tick;                       // of the last look at all blocks
    int nempty[OM_PLAN_MAX_BLOCK];        // times that a jaw closed on nothing there
    OmVec3 empty_tip[OM_PLAN_MAX_BLOCK];  // where, the last time, task frame, m
} Act;

// ---- actions (act_action.c) ----------------------------------------------------------------------------------

// Of arms that hold nothing. The caller has set what is borrowed but the number of arms.
void om__act_init(Act* act, bool has_cloud);
// An action of a plan. Each function sets is_done if the action has ended: its outcome is in act->action.
OmStatus om__action_begin(Act* act, const OmPlanAction* plan, bool* is_done);
OmStatus om__action_check(Act* act, bool* is_done);  // after a tick
void om__act_stop(Act* act);                         // all arms

static inline bool om__is_fold(OmPlanVerb verb) {
    return verb == OM_PLAN_MOVE_AWAY || verb == OM_PLAN_MOVE_ROI;
}

static inline bool om__act_is_holding(const Act* act) {
    return act->arm[0].in_hand >= 0 || act->arm[1].in_hand >= 0;
}

// ---- motions (act_motion.c) ----------------------------------------------------------------------------------

// A straight motion to a goal in the task frame. Each function sets is_done if the motion has ended: its outcome is in
// act->motion.
OmStatus om__motion_begin(Act* act, int arm, OmVec3 goal, bool is_holding, bool* is_done);
OmStatus om__motion_check(Act* act, bool* is_done);  // after a tick
// The arm was stopped by a pause: command the motion again. A goal out of reach ends it at the next check.
OmStatus om__motion_resume(Act* act);

// A goal of an arm in the world frame with the orientation that it has.
static inline OmPose om__goal_pose(const Act* act, int arm, OmVec3 p_task) {
    return (OmPose){om_pose_apply(act->grid->task, p_task), act->arm[arm].q};
}

// ---- tools (act_wrist.c, act_apart.c) -------------------------------------------------------------------------

// Choose the orientation at the end of the current motion, from where the arm was last measured.
void om__wrist_choose(Act* act);
OmQuat om__wrist_straight(const ArmState* arm);  // the orientation without turns, world frame
// The pose of an arm's grasp in the twin, of a measured tip; world frame.
OmPose om__twin_pose(const Act* act, int arm, OmPose tip);

// Least distance of the arm's tool from the other one on a straight way to a goal, m; INFINITY where it grows from now
// on, or is not known.
double om__tool_gap(const Act* act, int arm, OmPose goal);
bool om__is_apart(const Act* act, int arm, OmPose goal);  // far enough
// The other tool is free and too near to a way through `n` points of the task frame.
bool om__needs_room(const Act* act, int arm, const OmVec3* waypoint, int n);
OmVec3 om__aside(const Act* act, int arm);  // where a free tool makes room, task frame, m

// ---- grasping points (act_point.c) ------------------------------------------------------------------------------

// Look at the tissue: the grasping points of all blocks (-1), or of one of them, which keeps its point where no tissue
// is seen.
OmStatus om__cloud_look(Act* act, int block);
// The twin grasps the material that the jaw holds at `tip`.
// @return OM_OK; OM_INVALID (it has no free tissue near there)
OmStatus om__cloud_grasp_twin(Act* act, int arm, int block, OmPose tip);
double om__cloud_draw_time(const Act* act, int arm);  // s until it is at the tip
void om__cloud_draw(Act* act, int arm);               // in every step
void om__cloud_note_empty(Act* act, int arm, int block);
bool om__cloud_is_spent(const Act* act, int block);  // a jaw would close on nothing again

#endif
