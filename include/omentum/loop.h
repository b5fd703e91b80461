/// omentum/loop.h: the deliberative loop of tissue retraction, one tick at a time (floor 9; thesis chapter 6).
///
/// Sense, turn the measurements into fluents (Alg. 4), plan, act, until the endoscope sees the region of interest. The
/// world, the twin and the planner are handed in; the loop commands the arms of the world through observations alone.
/// A tick is one time step. Listeners record it, draw it, or stop it.
///
///     OmLoopDef def = om_loop_default_def(&scene.task, world, twin, planner);
///     OmLoop* loop;
///     om_loop_create(&def, &loop);
///     while (status == OM_OK && om_loop_phase(loop) != OM_LOOP_ENDED) status = om_loop_tick(loop);
///     puts(om_loop_result(loop)->reason);
///     om_loop_destroy(loop);
#ifndef OMENTUM_LOOP_H
#define OMENTUM_LOOP_H

#include "omentum/act.h"
#include "omentum/belief.h"
#include "omentum/body.h"
#include "omentum/plan.h"
#include "omentum/scene.h"
#include "omentum/trial_ahead.h"
#include "omentum/trial_preplan.h"
#include "omentum/world.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- the record of a loop ---------------------------------------------------------------------------------

typedef struct OmRetractSample {  // one instant
    double time;        // s since the operation began; the first tick ends at one time step
    double visibility;  // of the ROI, 0 to 1, as the robot measures it in the endoscope's picture
    double visibility_world;  // the same by rays in the simulated truth; NAN without a truth
    // N, the larger of both arms: pull less the weight carried, by the twin; of an arm that measures force the larger
    // of both. NAN: the twin has no forces
    double force;
    double force_world;  // N, the same in the simulated truth; NAN without a truth
    double height;       // m, the higher of the arms that hold tissue, over where it was grasped
    double speed_rate;   // 1, or less while slowed down by force
    double mu;           // m, OmMonitorFrame.mu of the last frame; NAN: there is none
    int warning;         // state of Alg. 5, 0 while nothing is held
} OmRetractSample;

#define OM_RETRACT_SAMPLE 0.1  // s between the samples of a result
#define OM_RETRACT_SLID 0.15   // see OmRetractResult.has_slid

typedef struct OmRetractAction {  // one executed action
    OmPlanVerb verb;
    int arm, block;     // block -1: none
    double begin, end;  // s of the operation
    OmActionOutcome outcome;
    double visibility;       // at its end
    double force_max;        // N, during it, as in OmRetractSample.force
    double force_world_max;  // N, during it, in the truth; NAN without a truth
    bool is_replanned;       // a new plan starts with it
    int plan;                // which plan, from 0
    double turn;  // rad, of the wrist, since a joint forbade the usual orientation; 0: none
} OmRetractAction;

typedef enum OmRetractOutcome {
    OM_RETRACT_EXPOSED,  // the arms exposed the ROI: visibility reached the scene's limit and stayed
    OM_RETRACT_IN_VIEW,    // the ROI was in view before any action: the scene hides nothing
    OM_RETRACT_GAVE_UP,    // the scene's number of actions was reached
    OM_RETRACT_NO_PLAN,    // no grasping point is left
    OM_RETRACT_CANCELLED,  // the program that runs the loop was cancelled
    OM_RETRACT_ABORTED,    // a person or a program aborted the operation
    OM_RETRACT_HELD        // the loop stopped for a person (OmHold), and there is none
} OmRetractOutcome;
/// One word, as run.json has it: "exposed", "in_view_at_start", "gave_up", "no_plan_left", "cancelled", "aborted",
/// "held".
OM_API const char* om_retract_outcome_text(OmRetractOutcome outcome);

// Of the twin, and the forces on which the arms act.
typedef struct OmTwinRecord {
    double force;  // N, largest, as in OmRetractSample; NAN if its engine has no forces
    int nforce;    // times the force rose to where the arms act: threshold less margin
    double shift;  // m, mean displacement of the vertices while it came to rest
    int nadded;  // vertices that were attached to it, for it slid off without them (om_retract_run)
    // rad and m, by which the model was moved before the operation onto the tissue at rest (om_retract_run); 0: not
    double turned, shifted;
    char unregistered
        [256];  // why the tissue at rest does not fit the model; "": it does, or it was not asked
    int nbad;   // steps with inverted elements, unsettled contact or energy gained
    int nvert, ntet;
    double step_ms;       // mean wall time of a step
    int nahead;           // grasping points tried by looking ahead
    int64_t nahead_step;  // steps that this took
} OmTwinRecord;

// Of the simulated truth, for evaluation alone. Without a truth numbers are NAN, counts 0.
typedef struct OmTruthRecord {
    double visibility;  // of the ROI at the end, by rays: this one judges
    double force;       // N, largest
    double more, less;  // N, largest excess over the twin's force at one instant, and below it
    int nforce;         // times the force rose above the threshold
    int ntorn;          // attached vertices that tore off
    double shift;       // m, as of the twin
    int nbad;           // the same
    int nvert, ntet;
} OmTruthRecord;

typedef struct OmRetractResult {              // om_retract_result_done frees
    OmRetractOutcome outcome;                 //
    bool is_exposed;                          // the outcome is OM_RETRACT_EXPOSED
    char reason[256];                         // one sentence: how it ended
    double visibility_start, visibility_end;  // as the robot measures it
    OmEffort effort;                          // of the arms
    OmBeliefRecord belief;                    // what the robot learnt
    OmTwinRecord twin;
    OmTruthRecord truth;
    double time;       // s of the operation
    double wall_time;  // s it took here
    int nplan;         // plans made
    double plan_ms_median, plan_ms_max;
    int naction;
    OmRetractAction* action;
    int nsample;
    OmRetractSample* sample;
    OmHold hold;   // the last one; OM_HOLD_NONE: there was none
    int nhold;     // times that the loop held
    int ncommand;  // of a person or a program, but pause and resume
    // The tissue comes to rest on its ground before the operation begins.
    bool is_settled;  // twin and world were at rest when the operation began
    bool has_slid;  // one of the shifts exceeds OM_RETRACT_SLID of the tissue's smaller half extent
    uint64_t hash;  // of the truth's final state; of the twin's without a truth
} OmRetractResult;
OM_API void om_retract_result_done(OmRetractResult* result);

// ---- listeners --------------------------------------------------------------------------------------------

typedef struct OmLoop OmLoop;
typedef struct OmLoopCommand OmLoopCommand;

/// Functions that the loop calls; each may be null. A negative status ends the tick with this error. A listener may
/// read the loop and command it (a command takes effect at the end of the tick); it does not tick or destroy the loop.
typedef struct OmLoopListener {
    void* ctx;  // first argument of every function; borrowed
    OmStatus (*on_begin)(void* ctx, const OmLoop* loop);  // before the first tick
    OmStatus (*on_tick)(void* ctx, const OmLoop* loop, const OmRetractSample* now);
    OmStatus (*on_plan)(void* ctx, const OmLoop* loop, const OmSituation* situation,
                        const OmPlan* plan);  // also of a plan without actions
    OmStatus (*on_action_begin)(void* ctx, const OmLoop* loop, const OmPlanAction* action);
    OmStatus (*on_action_end)(void* ctx, const OmLoop* loop, const OmRetractAction* action);
    OmStatus (*on_end)(void* ctx, const OmLoop* loop, const OmRetractResult* result);
    OmStatus (*on_update)(void* ctx, const OmLoop* loop, const OmUpdateEvent* event);
    OmStatus (*on_command)(void* ctx, const OmLoop* loop, const OmLoopCommand* command);
    OmStatus (*on_hold)(void* ctx, const OmLoop* loop, OmHold hold, const char* reason);
    // the warning state changed from `was` to om_loop_warning
    OmStatus (*on_warning)(void* ctx, const OmLoop* loop, int was, const OmMonitorFrame* frame);
} OmLoopListener;

// ---- the loop -----------------------------------------------------------------------------------------------

#define OM_LOOP_MAX_LISTENER 8

typedef struct OmLoopDef {
    OmCookie cookie;
    const OmSceneTask* task;  // limits, speeds and grid; copied
    OmWorld* world;      // borrowed, at its start (om_world_reset); its clock may show any time
    OmBody* twin;        // borrowed, at rest
    OmPlanner* planner;  // borrowed
    OmBody* truth;       // borrowed; recorded, never acted on; default null: there is none
    const OmLoopListener* listener;  // called in this order; copied
    int nlistener;                   // default 0, at most OM_LOOP_MAX_LISTENER
    // Corrects the twin's attachments; borrowed until the loop is destroyed; default null. The world must observe
    // depth.
    OmUpdater* updater;
    // The plan before the operation, of the same grid; copied; default null. It is followed first, and what it tried is
    // known to the planner until the twin's attachments change.
    const OmPreplan* preplan;
    // Grasping points are the twin's alone, also where the depth camera sees the tissue elsewhere; default false.
    bool is_by_twin;
    OmAhead* ahead;   // tries grasping points of the twin before a new plan; borrowed; default null
    OmMotionLaw law;  // of reaches and pulls; default: straight lines
    // Compares the twin with the depth camera; borrowed; default null. The world must observe depth. With a monitor
    // acquisitions are taken in warning states 1 and 2 alone (Alg. 5), without one after every pull and fold.
    OmMonitor* monitor;
    // A person watches: a hold waits for OM_LOOP_RESUME or OM_LOOP_ABORT. Default false: a hold ends the loop.
    bool is_attended;
    bool needs_approval;  // each plan waits for OM_LOOP_APPROVE or OM_LOOP_REJECT; default false
    // s: the loop holds when a measurement is older, or when the world's clock stands still for longer; default 0.2;
    // 0: not watched
    double max_age;
    // s by which the operation may be behind the clock on the wall, for a world that does not wait, as a real robot;
    // default 0: not watched
    double max_lag;
    bool is_settled;  // twin and world are at rest; default true; recorded in the result
    int nadded;  // vertices attached to a twin that slid off; default 0; recorded in the result
    // rad and m, of the model before the operation, and why not; default 0, null; recorded in the result
    double turned, shifted;
    const char* unregistered;
    double wall_begin;  // om_clock_now() from which OmRetractResult.wall_time counts; default: now
} OmLoopDef;

OM_API OmLoopDef om_loop_default_def(const OmSceneTask* task, OmWorld* world, OmBody* twin,
                                     OmPlanner* planner);

typedef enum OmLoopPhase {
    OM_LOOP_BEGIN,    // before the first look
    OM_LOOP_VERIFY,   // the ROI is seen: the arms keep still; does it stay visible?
    OM_LOOP_PLAN,     // between two actions; only listeners see it
    OM_LOOP_ACT,      // an action is under way
    OM_LOOP_LOOK,     // the arms keep still until the tissue rests; then an acquisition is taken
    OM_LOOP_LEARN,    // the arms keep still until the twin has learnt from it
    OM_LOOP_CONSENT,  // a plan waits for OM_LOOP_APPROVE
    OM_LOOP_HOLD,     // the arms keep still: a person must say how to go on
    OM_LOOP_ENDED     // the result is complete
} OmLoopPhase;

typedef enum OmLoopCommandKind {
    OM_LOOP_PAUSE,  // the arms stop; time of world and twin advances, the plan does not
    // The action continues from where it stopped; a look at the ROI begins again. After a hold a new plan is made.
    OM_LOOP_RESUME,
    OM_LOOP_ABORT,    // the arms stop and stay, no jaw opens; the loop ends as OM_RETRACT_ABORTED
    OM_LOOP_CANCEL,   // the same, as OM_RETRACT_CANCELLED
    OM_LOOP_SLOW,     // all motions at `value` of the speed they would have, above 0 to 1
    OM_LOOP_FORBID,   // `block` is not grasped any more; an arm on its way there stops
    OM_LOOP_ALLOW,    // `block` may be grasped again, also where it was tried without success
    OM_LOOP_ATTACH,   // the tissue under `block` is attached: the twin and the planner take it over
    OM_LOOP_FREE,     // the tissue under `block` is not attached
    OM_LOOP_REPLAN,   // the current action stops, and a new plan is made
    OM_LOOP_APPROVE,  // the plan that waits may begin
    OM_LOOP_REJECT,  // it may not: its grasping point is forbidden, or its fold, and a new plan is made
    OM_LOOP_NCOMMAND
} OmLoopCommandKind;
/// One word: "pause", "go", "abort", "cancel", "slow", "forbid", "allow", "attach", "free", "plan", "yes", "no".
OM_API const char* om_loop_command_text(OmLoopCommandKind kind);

struct OmLoopCommand {
    OmLoopCommandKind kind;
    int block;     // of OM_LOOP_FORBID, _ALLOW, _ATTACH, _FREE; index as in OmSituation
    double value;  // of OM_LOOP_SLOW
};

/// Read a command as a person types it: a word of om_loop_command_text or its first letters, then the block as two
/// numbers "3 2", counted from 1, or the speed: "forbid 3 2", "slow 0.5", "go".
/// @param n  blocks along a side of the grid
/// @return OM_OK; OM_INVALID (the message says what is possible)
OM_API OmStatus om_loop_command_parse(const char* text, int n, OmLoopCommand* command);

/// @return OM_OK; OM_INVALID (a field of the definition or of the task, a world that does not observe visibility,
///         tissue without grasping points, an updater of another twin or a world without depth for it); OM_NO_MEMORY
OM_API OmStatus om_loop_create(const OmLoopDef* def, OmLoop** loop);
/// In any phase. The world keeps its last commands: abort before, to stop the arms.
OM_API void om_loop_destroy(OmLoop* loop);
/// Advance world and twin by one time step, then decide what the arms do in the next one. A tick in which an action
/// ends may also make the next plan. After an error the loop can only be destroyed.
/// @return OM_OK; OM_INVALID (the loop has ended or failed, or a motion does not end); errors of the world, the twin,
///         the planner and the listeners
OM_API OmStatus om_loop_tick(OmLoop* loop);
/// Takes effect at once; within a listener, at the end of the tick. A jaw that opens or closes completes its motion.
/// @return OM_OK, also if the loop is already in that condition; OM_INVALID (no such command, too many within one tick,
///         or the loop has ended or failed); errors of the world and of listeners
OM_API OmStatus om_loop_command(OmLoop* loop, const OmLoopCommand* command);

OM_API OmLoopPhase om_loop_phase(const OmLoop* loop);
OM_API bool om_loop_is_paused(const OmLoop* loop);
/// Why the loop holds, in phase OM_LOOP_HOLD; otherwise OM_HOLD_NONE.
OM_API OmHold om_loop_hold(const OmLoop* loop);
OM_API const char* om_loop_hold_reason(const OmLoop* loop);  // of the last hold, or ""
OM_API int om_loop_warning(const OmLoop* loop);              // state of Alg. 5, 0 to 3
OM_API int om_loop_grid(const OmLoop* loop);                 // blocks along a side
OM_API int om_loop_ntick(const OmLoop* loop);                // ticks so far
OM_API OmRetractSample om_loop_sample(const OmLoop* loop);   // of the last tick
/// Force by the twin, N: 0 for an arm that holds nothing; NAN for every arm if the twin's engine has no forces.
OM_API double om_loop_force(const OmLoop* loop, int arm);
OM_API const OmPlan*
om_loop_plan(const OmLoop* loop);  // the current plan; naction 0 before the first
/// The plan before the operation while the current plan is that one; otherwise null.
OM_API const OmPreplan* om_loop_preplan(const OmLoop* loop);
/// The current action, or null; valid until the next tick.
OM_API const OmPlanAction* om_loop_action(const OmLoop* loop);
/// The result so far; hash and times of planning are complete in phase OM_LOOP_ENDED. Valid until the next tick.
OM_API const OmRetractResult* om_loop_result(const OmLoop* loop);
/// Move the result out of a loop that has ended or failed: the caller frees it, and the loop's result becomes empty.
/// @return OM_OK; OM_INVALID (the loop still runs, or a listener calls: `result` is empty, the loop is unchanged)
OM_API OmStatus om_loop_take_result(OmLoop* loop, OmRetractResult* result);

#ifdef __cplusplus
}
#endif
#endif
