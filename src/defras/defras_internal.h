// defras_internal.h: the state of the loop, shared by its stages.
#ifndef OMENTUM_DEFRAS_INTERNAL_H
#define OMENTUM_DEFRAS_INTERNAL_H

#include "omentum/defras_loop.h"
#include "omentum/match_adopt.h"
#include "omentum/world_cloud.h"

// The tissue cut into n x n blocks in the task frame; a block's grasping point is a vertex of the twin.
typedef struct Grid {
    int n;
    OmPose task;                  // pose_world_task
    OmVec3 half;                  // half extent of the tissue, m
    int vert[OM_PLAN_MAX_BLOCK];  // grasping point: a vertex of the twin's mesh, -1 no tissue there
    OmVec3 tip[OM_PLAN_MAX_BLOCK];         // the grasping point at rest, task frame, m
    double center[3 * OM_PLAN_MAX_BLOCK];  // of the blocks at rest, task frame, m
    int roi_block;
    OmVec3 roi;  // centre of the ROI, task frame, m
} Grid;

// The grasping point of a block now (defras_cloud.c).
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

// Decides when a motion stops because the ROI is exposed: at `wanted` plus the margin, or past a maximum above
// `wanted`.
typedef struct Watch {
    double wanted, margin;  // visibility
    double best;            // largest visibility in this motion
} Watch;

#define FOLD_STEP 0.010  // m, step of a fold beyond its nominal length
#define FOLD_GAIN 0.01   // visibility that each of these steps must gain
#define FALL_TIME 1.2    // s, wait for released tissue to fall
#define LOOK_EVERY 5     // ticks between looks through the endoscope

// What ends a motion that holds tissue (defras_motion.c).
#define SLOW_TIME 0.6     // s above the force limit, in one motion, after which the motion ends
#define OVER_FACTOR 1.5   // times the limit; above it a motion ends at once
#define EASE 0.9          // fraction of the limit to which the force is reduced after a force stop
#define MOTION_TIME 30.0  // s; a longer motion is an error

// When the ROI counts as exposed (defras_decide.c).
#define VISIBLE_TIME 0.5  // s for which the ROI must be seen without a break
#define VERIFY_LIMIT 1.5  // s, longest verification
#define MAX_CONTINUED 8   // commands of one action, counting those after the ROI closed

// The loop's data of one arm.
typedef struct ArmState {
    int at;                            // block that the arm was moved to, -1
    int in_hand;                       // block held, -1
    OmVec3 grasp_tip;                  // task frame, where the jaw closed
    OmVec3 fold_tip;                   // task frame, where the first fold of this grasp began
    OmPlanVerb fold;                   // the last fold of this grasp; OM_PLAN_PULL: there was none
    OmVec3 tip;                        // task frame, measured
    OmQuat q;                          // world frame, measured: motions keep it
    OmQuat q_straight;                 // from which the wrist was turned (defras_wrist.c)
    bool is_turned;                    // q_straight is set
    double joint[OM_PSM_NJOINT], jaw;  // measured, rad and m
    double lift;                       // m above grasp_tip while holding
    // m, world frame: the twin's grasped tissue lies this far beside the tip, and is drawn to it
    OmVec3 twin_off;
    bool is_closed;
    bool is_moving;
    bool is_max_force;
    bool is_at_top;  // a pull found no place above: joints, not max_height, limit this grasp
} ArmState;

// Sums of a least squares fit: measured pull = factor x pull of the twin.
typedef struct ForceSum {
    double measured, twin;  // N^2
    double time;            // s of measurements in it
} ForceSum;

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
    OmVec3 waypoint[3];  // of a reach, task frame, m
    OmVec3 tip;          // of a fold: where it began, task frame, m
    OmVec3 direction;    // of a fold, a unit vector in the task frame
    double length;       // of a fold, m
    double before;       // visibility before the current step of a fold
    bool may_turn;       // of a fold: none is in reach without a turn of the wrist
    double turn;         // of the wrist, rad, the largest of the action
    char turn_reason[64];
    OmActionOutcome outcome;
} Action;

#define OM_LOOP_MAX_PENDING 16  // commands within one tick

// What the loop does between two ticks.
typedef enum Stage {
    STAGE_BEGIN,        // wait for the first look
    STAGE_VERIFY,       // the arms keep still: does the ROI stay visible? waits
    STAGE_PLAN,         // make a plan
    STAGE_NEXT_ACTION,  // begin an action of the plan
    STAGE_ACTION,       // execute an action; waits
    STAGE_SETTLE,       // the arms keep still after a fold, before it is judged; waits
    STAGE_LOOK,         // the arms keep still before an acquisition; waits
    STAGE_DOUBT,        // the twin frees doubted attachments; waits
    STAGE_LEARN,        // the arms keep still until the twin has learnt; waits
    STAGE_CONSENT,      // a plan waits for a person; waits
    STAGE_HOLD,         // the loop waits for a person; waits
    STAGE_ENDED
} Stage;

struct OmLoop {
    OmSceneTask task;
    OmWorld* world;      // borrowed, as all up to the listeners
    OmBody* twin;        //
    OmBody* truth;       // null: none
    OmPlanner* planner;  //
    OmUpdater* updater;  // null: none
    OmRoiMeter* meter;   // null: the world shows no pictures and measures the visibility itself
    OmMonitor* monitor;  // null: none
    OmPreplan* preplan;  // owned; null: none
    OmAhead* ahead;      // null: none
    OmModulus* modulus;  // null: none
    OmMotionLaw law;     // of reaches and pulls; next null: straight lines
    int narm;            // of the world
    OmLoopListener listener[OM_LOOP_MAX_LISTENER];
    int nlistener;
    double wall_begin;  // s
    Grid grid;

    // set by commands
    bool is_paused;
    bool wants_plan;  // a new plan after the current action
    bool is_forbidden[OM_PLAN_MAX_BLOCK];
    bool is_corrected;   // the twin's attachments may differ from those of the plan
    double person_rate;  // of the speed of every motion
    bool is_ticking;     // commands wait for the end of the tick
    bool has_begun;      // listeners know
    bool has_failed;
    OmLoopCommand pending[OM_LOOP_MAX_PENDING];
    int npending;

    // set at creation
    bool is_attended, needs_approval;
    double max_age, max_lag;  // s, 0: not watched

    // computed by defras_hold.c
    OmHold alarm;          // raised and not yet followed by a hold
    char alarm_text[200];  // why
    OmHold hold;           // of STAGE_HOLD
    char hold_text[200];   // of the last hold
    Stage held_stage;      // in which it continues
    double clock_last;     // s, of the world
    double standing;       // s for which it did not advance
    double lag_origin;     // s of the wall clock at the time 0
    bool has_lag_origin;   //
    int nfailed_update;    // estimates in a row that ended in an error

    // computed by defras_warn.c
    OmMonitorFrame frame;  // the last one
    OmSceneMonitor monitor_settings;
    int warning;                    // state of Alg. 5, or of a part of the tissue
    int unsettled;                  // what it would be if a fold were judged while it moves
    double settle_begin;            // s, of STAGE_SETTLE
    double part_rest;               // m, OmMonitorFrame.part before the present grasp
    int part_state;                 // 0 to 2
    int fold_state;                 // by the limits of folds; 0 before a fold of this grasp
    int warning_action;             // largest during the current action
    double state3_begin;            // s, since when it is 3
    bool has_grasped;               // tissue, in this operation
    bool is_overruled;              // a person continues in state 3
    bool has_effect_due;            // of the last update on mu
    double effect_time;             // s, when to measure it
    int effect_update;              // which one
    double learn_begin;             // s, of STAGE_LEARN
    double seen_last, seen_change;  // visibility at its last change while learning, and when, s

    ForceSum force_sum;  // of defras_force.c

    // computed by defras_cloud.c
    bool has_cloud;  // set at creation: the world observes depth
    OmScanDef scan;
    OmCloudDef space;
    GraspPoint point[OM_PLAN_MAX_BLOCK];
    int point_tick;                       // of the last look at all blocks
    int nempty[OM_PLAN_MAX_BLOCK];        // times that a jaw closed on nothing there
    OmVec3 empty_tip[OM_PLAN_MAX_BLOCK];  // where, the last time, task frame, m

    // computed by defras_step.c
    ArmState arm[OM_MAX_ARM];
    double time_origin;  // s of the world's clock at which the operation begins
    double time;         // s of the operation
    int tick;
    double visibility;         // of the last look
    bool has_dragged;          // held tissue was folded since it was grasped
    bool has_slipped;          // an arm lost its tissue since the last decision
    double visibility_world;   // of the last look, in the truth, for the record alone; NAN unknown
    double look_age;           // s from the exposure of the last look's picture to its observation
    double force[OM_MAX_ARM];  // N, pull less weight, by the twin: the arms act on it
    double force_action;       // N, largest during the current action
    bool has_forces;           // the twin's engine has forces in newtons
    bool is_over;              // the force is above om__force_limit
    double over_time;          // s of the current motion above om__force_limit, without pauses
    double rate;               // fraction of the nominal speed
    // N, the larger of both arms in the truth, for the record alone; NAN unknown
    double force_world;
    int truth_nattached;        // vertices of the truth at the start
    double force_world_last;    // N, at the tick before
    double force_world_action;  // N, largest during the current action
    double twin_wall;           // s spent in the twin

    // computed by defras_loop.c
    Stage stage;
    OmPlan plan;
    OmSituation situation;
    int action_index;      // in the plan
    int ncontinued;        // times the current action was continued after the ROI closed
    double action_begin;   // s
    double margin;         // visibility above the wanted one at which a motion stops
    double verify_begin;   // s
    double visible_since;  // s, exposure from which on the ROI is seen without a break
    bool is_exposed;       // seen without a break for long enough
    uint8_t tried[OM_PLAN_MAX_BLOCK];
    // an attempt with all folds, or a force stop, exposed nothing
    bool is_exhausted[OM_PLAN_MAX_BLOCK];
    // m: a block with MAX_NEAR_ATTEMPTS exhausted blocks nearer than this is postponed; 0: no block is
    double attempt_distance;
    OmExposure exposure[OM_PLAN_MAX_BLOCK];  // what trying in the simulation showed
    bool is_preplan;                         // the current plan is the one made before
    int ahead_nbad;                          // steps with uncertain forces while looking ahead
    int npostponed;                          // blocks postponed by the last sensing
    Action action;
    Motion motion;

    // computed by defras_look.c
    double look_begin;          // s, since when the arms keep still
    OmMatchAdoption* adoption;  // of the twin; null without an updater
    unsigned char* always;      // attached in every belief of the operation, or null  (nvert)
    unsigned char* source;      // of defras_doubt.c: where attachments come from       (nvert)
    // of defras_follow.c
    double* increment;    // m, from the twin to the newest scan, or null  (nvert x 3)
    unsigned char* goal;  // scratch: attachments after the following      (nvert)
    bool has_increment;
    bool is_of_fold;    // the estimate under way, or the last one, is of tissue that was folded
    bool has_followed;  // since the grasp, and no fold was tried in the twin since
    bool is_waiting;    // the twin follows, and the arms keep still
    int doubt_grasp;    // grasps until the last doubt, -1: there was none
    int doubt;          // the strongest doubt until now
    bool has_narrowed;  // the intersection is not that of the last doubt

    // the record
    OmRetractResult result;
    int sample_capacity, action_capacity, update_capacity;
    double* plan_ms;  // of each plan made
    int plan_capacity;
};

#define OM__RETRACT_KIND "retraction run"  // of the recorder's folder

// Distances that do not depend on the grid, as fractions of the tissue's smaller side. They have no effect on grids up
// to 5 x 5.
#define ATTEMPT_DISTANCE 0.18     // of neighbouring attempts, initial value
#define MAX_NEAR_ATTEMPTS 3       // within that distance, before a block is postponed
#define ATTACHMENT_DISTANCE 0.09  // of the middle of a block from an attachment, minimum

// defras_loop.c
int om__count_attached(const OmBody* body);  // vertices; 0 without a body
/// @return OM_OK; OM_INVALID (the task watches the force, and the engine has none in newtons)
OmStatus om__check_watch(const OmSceneTask* task, const OmTissueEngine* engine);

// defras_fluents.c
int om__grid_block_of(const Grid* grid, OmVec3 p_world);  // the nearest for a point outside
bool om__grid_has(const Grid* grid, int block, OmVec3 p_task);
double om__grid_length(const Grid* grid, double fraction);  // of the tissue's smaller side, m
OmStatus om__grid_build(const OmSceneTask* task, const OmSite* site, Grid* grid);
bool om__grid_is_fixed(const Grid* grid, const OmBody* body, int block);
// The same with attachments `attached` (nvert).
bool om__grid_is_fixed_by(const Grid* grid, const OmTetMesh* mesh, const unsigned char* attached,
                          int block);
void om__sense_fluents(OmLoop* loop, OmSituation* situation);

// defras_cloud.c
// Look at the tissue: the grasping points of all blocks (-1), or of one of them, which keeps its point where no tissue
// is seen.
OmStatus om__cloud_look(OmLoop* loop, int block);
// The twin grasps the material that the jaw holds at `tip`.
// @return OM_OK; OM_INVALID (it has no free tissue near there)
OmStatus om__cloud_grasp_twin(OmLoop* loop, int arm, int block, OmPose tip);
double om__cloud_draw_time(const OmLoop* loop, int arm);  // s until it is at the tip
void om__cloud_draw(OmLoop* loop, int arm);               // in every step
void om__cloud_note_empty(OmLoop* loop, int arm, int block);
bool om__cloud_is_spent(const OmLoop* loop, int block);  // a jaw would close on nothing again

// defras_rest.c: let the twin come to rest. One that slides off gets more attachments, *nadded vertices.
// @return as om_body_settle
OmStatus om__rest_settle(const OmScene* scene, OmBody* twin, int* nadded);
double om__rest_shift(const OmBody* body);  // mean displacement from the patient model, m

// The force by the twin at which the arms act, N.
static inline double om__force_limit(const OmSceneTask* task) {
    return task->force_threshold - task->force_margin;
}

// A goal of an arm in the world frame with the orientation that it has.
static inline OmPose om__goal_pose(const OmLoop* loop, int arm, OmVec3 p_task) {
    return (OmPose){om_pose_apply(loop->grid.task, p_task), loop->arm[arm].q};
}
static inline OmVec3 om__to_task(const Grid* grid, OmVec3 p_world) {
    return om_pose_apply(om_pose_inverse(grid->task), p_world);
}

#define SLOW_RATE 0.25  // fraction of the nominal speed at the force limit

// Fraction of the nominal speed at a force: full speed up to SLOW_FROM of the limit, from there it falls in steps.
double om__force_rate(double force, double limit);

#define JAW_OPEN (40.0 * OM_PI / 180.0)

// defras_slip.c: notice a slip in an observation; between two ticks, end what relied on the grasp.
OmStatus om__slip_watch(OmLoop* loop, const OmObservation* obs);
OmStatus om__slip_react(OmLoop* loop);

// defras_step.c: let one time step pass in the world and the twin, and measure.
OmStatus om__loop_step(OmLoop* loop);
OmRetractSample om__loop_sample(const OmLoop* loop);

// defras_act.c
// Path of a fold of tissue held at `tip`: a unit vector along the board and a length, m, in the task frame. The length
// is 0 where the fold has no direction.
void om__fold_path(const Grid* grid, double retract, OmVec3 tip, OmPlanVerb verb, OmVec3* direction,
                   double* length);
// An action of a plan. Each function sets is_done if the action has ended: its outcome is in loop->action.
OmStatus om__action_begin(OmLoop* loop, const OmPlanAction* plan, bool* is_done);
OmStatus om__action_check(OmLoop* loop, bool* is_done);  // after a tick

// defras_motion.c
// Add a look; true where a motion should stop because the ROI is exposed.
bool om__watch_stop(Watch* watch, double visibility);
// A straight motion to a goal in the task frame. Each function sets is_done if the motion has ended: its outcome is in
// loop->motion.
OmStatus om__motion_begin(OmLoop* loop, int arm, OmVec3 goal, bool is_holding, bool* is_done);
OmStatus om__motion_check(OmLoop* loop, bool* is_done);  // after a tick

// The arm was stopped by a pause: command the motion again. A goal out of reach ends it at the next check.
OmStatus om__motion_resume(OmLoop* loop);

// defras_wrist.c
// Choose the orientation at the end of the current motion, from where the arm was last measured.
void om__wrist_choose(OmLoop* loop);
OmQuat om__wrist_straight(const ArmState* arm);  // the orientation without turns, world frame
// The pose of an arm's grasp in the twin, of a measured tip; world frame.
OmPose om__twin_pose(const OmLoop* loop, int arm, OmPose tip);
// The arm reaches a pose, turned by at most max_turn about the tip; `turned` is then the orientation.
bool om__wrist_reach(const OmPsm* psm, OmPose straight, double max_turn,
                     const double near[OM_PSM_NJOINT], double q[OM_PSM_NJOINT], OmQuat* turned);

// defras_look.c: nothing happens without an updater
bool om__look_is_due(const OmLoop* loop);  // after an action
// Take an acquisition, or set needs_tick until the tissue rests.
OmStatus om__look_take(OmLoop* loop, bool* needs_tick);
void om__look_note_grasp(OmLoop* loop, int arm, OmPose pose_world_tip);
OmStatus om__look_note_release(OmLoop* loop, int arm);
OmStatus om__look_notify_follow(OmLoop* loop);  // of an adopted estimate
OmStatus om__look_check(OmLoop* loop);  // after a step: adopt or refuse an estimate that is ripe
OmStatus om__look_start(OmLoop* loop);  // after decisions: start an estimate from new acquisitions
OmStatus om__look_end(OmLoop* loop);    // cancel an estimate that runs
bool om__look_is_outdated(
    const OmLoop* loop);  // other blocks are attached than when the plan was made
bool om__look_stops_reach(const OmLoop* loop);  // the arm reaches for a block that is now attached

// defras_decide.c
// The twin is not the one in which blocks were tried.
void om__loop_forget_exposure(OmLoop* loop);

// defras_ahead.c: before a new plan, after the fluents: try the best unknown grasping points in snapshots of the twin,
// and make facts of them. Nothing without OmLoopDef.ahead.
OmStatus om__loop_ahead(OmLoop* loop);
// The twin has this factor on its modulus now.
OmStatus om__ahead_set_young(OmAhead* ahead, double factor);
// After a tick: leave the stage if it has ended, until a stage waits for the next tick.
OmStatus om__loop_decide(OmLoop* loop);
OmStatus om__loop_plan(OmLoop* loop);
void om__loop_stop_arms(OmLoop* loop);
bool om__loop_moves_jaw(const OmLoop* loop);  // the current action grasps or releases
// The current plan is not followed further; its action under way ends with this outcome. A jaw completes its motion
// first.
OmStatus om__loop_drop_plan(OmLoop* loop, OmActionOutcome outcome);
// Record the action as ended; the loop then leaves STAGE_ACTION.
OmStatus om__loop_break_action(OmLoop* loop, OmActionOutcome outcome);
// End the loop between two actions or in the middle of one, at a command.
OmStatus om__loop_stop(OmLoop* loop, OmRetractOutcome outcome);

// defras_doubt.c
OmStatus om__doubt_create(OmLoop* loop);
void om__doubt_note(OmLoop* loop, const unsigned char* attached);  // an adopted estimate
void om__doubt_mark(OmLoop* loop, int vert, bool is_attached);     // by a person
// When no plan is left: begin to free what is doubted, in STAGE_DOUBT, if a point can be grasped then.
OmStatus om__doubt_free(OmLoop* loop, bool* is_changed);
bool om__doubt_is_over(const OmLoop* loop);

// defras_apart.c
// Least distance of the arm's tool from the other one on a straight way to a goal, m; INFINITY where it grows from now
// on, or is not known.
double om__tool_gap(const OmLoop* loop, int arm, OmPose goal);
bool om__is_apart(const OmLoop* loop, int arm, OmPose goal);  // far enough
// The other tool is free and too near to a way through `n` points of the task frame.
bool om__needs_room(const OmLoop* loop, int arm, const OmVec3* waypoint, int n);
OmVec3 om__aside(const OmLoop* loop, int arm);  // where a free tool makes room, task frame, m

// defras_hold.c
// Stop and wait for a person after this tick. The first alarm of a tick counts.
void om__loop_alarm(OmLoop* loop, OmHold hold, const char* format, ...)
    __attribute__((format(printf, 3, 4)));
void om__loop_check_observation(OmLoop* loop, const OmObservation* obs, bool has_picture);
void om__loop_check_follow(OmLoop* loop);    // of the current motion
OmStatus om__loop_check_hold(OmLoop* loop);  // hold if there is an alarm
OmStatus om__loop_end_hold(OmLoop* loop);

// defras_warn.c: nothing happens without a monitor
double om__warn_part(const OmLoop* loop);  // m, OmMonitorFrame.part less its value before the grasp
bool om__warn_is_due(const OmLoop* loop);  // a frame, in the step that follows
OmStatus om__warn_frame(OmLoop* loop, const OmObservation* obs);
OmStatus om__warn_end(OmLoop* loop);       // at the end of the loop: the effect of the last update
double om__warn_rate(const OmLoop* loop);  // fraction of the speed of motions that hold tissue
bool om__warn_stops(const OmLoop* loop);   // the current motion must stop
bool om__warn_must_settle(const OmLoop* loop);  // a fold has ended that is still to be judged
void om__warn_begin_settling(OmLoop* loop);
OmStatus om__warn_settle(OmLoop* loop,
                         bool* needs_tick);    // during STAGE_SETTLE: judge the fold at its end
bool om__warn_must_learn(const OmLoop* loop);  // after an action: STAGE_LEARN follows
OmStatus om__warn_note_update(OmLoop* loop, OmUpdateStage stage);
void om__warn_begin_learning(OmLoop* loop);
void om__warn_give_up(OmLoop* loop);      // arms that hold tissue must release it: no pull, no fold
bool om__warn_is_learning(OmLoop* loop);  // false: STAGE_LEARN is over

// defras_follow.c: nothing happens without an estimator
OmStatus om__follow_create(OmLoop* loop);
void om__follow_keep(OmLoop* loop,
                     bool is_adopted);  // the way to the scan of the estimate just joined
// Begin to follow it, if there is one and tissue is held. The arms stop.
OmStatus om__follow_begin(OmLoop* loop, bool* has_begun);
OmStatus om__follow_drop(OmLoop* loop);  // the tissue is released
// After each step: *waits while the twin follows; then the stopped motion continues.
OmStatus om__follow_check(OmLoop* loop, bool* waits);
// At the end of learning, if the twin followed: what the twin does not expose is not tried with this grasp.
OmStatus om__follow_judge(OmLoop* loop);
bool om__follow_is_fixed(const OmLoop* loop, int block);  // as om__grid_is_fixed of the twin

// defras_ahead.c: does a fold of the tissue in hand, away from the camera or towards the ROI, expose it in the twin?
// Neither, where this cannot be tried: no look ahead, its budget, a turned wrist.
OmStatus om__loop_ahead_held(OmLoop* loop, int arm, bool exposes[2]);

// defras_force.c
void om__force_add(OmLoop* loop, const OmObservation* obs, const OmBodyForces* twin);
void om__force_reset(OmLoop* loop);

// defras_modulus.c: nothing happens without OmLoopDef.modulus
OmStatus om__modulus_begin(OmModulus* modulus);  // of a loop
// After a step of the twin: record it, and take the next step of a change of the modulus.
OmStatus om__modulus_step(OmLoop* loop, const OmObservation* obs, const OmBodyForces* twin);
OmStatus om__modulus_learn(OmLoop* loop);             // after an action that moved held tissue
OmStatus om__modulus_tell_match(const OmLoop* loop);  // before an estimate starts
OmStatus om__modulus_frame(OmLoop* loop, const OmObservation* obs);  // after a frame of the monitor
void om__modulus_drop(OmLoop* loop);  // the twin's attachments change: the record says nothing

// defras_command.c
OmStatus om__loop_check_command(const OmLoop* loop, const OmLoopCommand* command);
OmStatus om__loop_apply(OmLoop* loop, const OmLoopCommand* command);

// defras_notify.c: call a function of every listener that has it.
OmStatus om__loop_notify_begin(OmLoop* loop);
OmStatus om__loop_notify_tick(const OmLoop* loop);
OmStatus om__loop_notify_plan(const OmLoop* loop);
OmStatus om__loop_notify_action_begin(const OmLoop* loop);
OmStatus om__loop_notify_action_end(const OmLoop* loop);
OmStatus om__loop_notify_end(const OmLoop* loop);
OmStatus om__loop_notify_command(const OmLoop* loop, const OmLoopCommand* command);
OmStatus om__loop_notify_warning(const OmLoop* loop, int was);
OmStatus om__loop_notify_hold(const OmLoop* loop, OmHold hold, const char* reason);
OmStatus om__loop_notify_update(const OmLoop* loop, const OmUpdateEvent* event);

#endif
