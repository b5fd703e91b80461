// loop_state.h: the state of the loop, shared by its stages.
#ifndef OMENTUM_LOOP_STATE_H
#define OMENTUM_LOOP_STATE_H

#include "act/act_state.h"
#include "belief/belief_state.h"
#include "omentum/loop.h"
#include "trial/trial_attempt.h"

#define OM_LOOP_MAX_PENDING 16  // commands within one tick

// What the loop does between two ticks.
typedef enum Stage {
    STAGE_BEGIN,        // wait for the first look
    STAGE_VERIFY,       // the arms keep still: does the ROI stay visible? waits
    STAGE_PLAN,         // make a plan
    STAGE_NEXT_ACTION,  // begin an action of the plan
    STAGE_ACTION,       // execute an action; waits
    STAGE_LOOK,         // the arms keep still before an acquisition; waits
    STAGE_DOUBT,        // the twin frees doubted attachments; waits
    STAGE_LEARN,        // the arms keep still until the twin has learnt; waits
    STAGE_CONSENT,      // a plan waits for a person; waits
    STAGE_HOLD,         // the loop waits for a person; waits
    STAGE_ENDED
} Stage;
enum { NSTAGE = STAGE_ENDED + 1 };

typedef struct StageEdge {
    Stage from, to;
    const char* when;
} StageEdge;

struct OmLoop {
    OmSceneTask task;
    OmWorld* world;      // borrowed, as all up to the listeners
    OmBody* twin;        //
    OmBody* truth;       // null: none
    OmPlanner* planner;  //
    OmRoiMeter* meter;   // null: the world shows no pictures and measures the visibility itself
    OmPreplan* preplan;  // owned; null: none
    OmAhead* ahead;      // null: none
    OmLoopListener listener[OM_LOOP_MAX_LISTENER];
    int nlistener;
    double wall_begin;  // s
    Grid grid;
    Act act;        // the arms, and what the last step measured
    Belief belief;  // what the robot believes, and why

    // set by commands
    bool is_paused;
    bool is_ticking;  // commands wait for the end of the tick
    bool has_begun;   // listeners know
    bool has_failed;
    OmLoopCommand pending[OM_LOOP_MAX_PENDING];
    int npending;

    // set at creation
    bool is_attended, needs_approval;
    double max_lag;  // s, 0: not watched

    // computed by loop_hold.c
    OmHold alarm;          // raised and not yet followed by a hold
    char alarm_text[200];  // why
    OmHold hold;           // of STAGE_HOLD
    char hold_text[200];   // of the last hold
    Stage held_stage;      // in which it continues
    double standing;       // s for which the world's clock did not advance
    double lag_origin;     // s of the wall clock at the time 0
    bool has_lag_origin;   //

    // computed by loop_step.c
    bool has_slipped;         // an arm lost its tissue since the last decision
    double visibility_world;  // of the last look, in the truth, for the record alone; NAN unknown
    double look_age;          // s from the exposure of the last look's picture to its observation
    double force_action;      // N, largest during the current action
    bool has_forces;          // the twin's engine has forces in newtons
    // N, the larger of both arms in the truth, for the record alone; NAN unknown
    double force_world;
    int truth_nattached;        // vertices of the truth at the start
    double force_world_last;    // N, at the tick before
    double force_world_action;  // N, largest during the current action
    double twin_wall;           // s spent in the twin

    // computed by loop_decide.c
    Stage stage;              // changed by om__loop_go alone
    unsigned walked[NSTAGE];  // a bit for each stage that followed this one
    char astray[80];          // which stage followed another one that it may not; "": none
    OmPlan plan;
    int action_index;      // in the plan
    double action_begin;   // s
    double verify_begin;   // s
    double visible_since;  // s, exposure from which on the ROI is seen without a break
    bool is_preplan;       // the current plan is the one made before
    AheadCount ahead_count;

    // the record
    OmRetractResult result;
    int sample_capacity, action_capacity;
    double* plan_ms;  // of each plan made
    int plan_capacity;
};

int om__count_attached(const OmBody* body);  // loop.c: vertices; 0 without a body

// loop_stage.c
void om__loop_go(OmLoop* loop, Stage next);
bool om__loop_may_follow(Stage from, Stage to);
// The edges between stages but those to HOLD and ENDED that every stage has, and back from HOLD.
const StageEdge* om__loop_edges(int* n);
OmStatus om__loop_draw(OmText* text);  // as doc/defras.md has it

// loop_slip.c: notice a slip in an observation; between two ticks, end what relied on the grasp.
OmStatus om__slip_watch(OmLoop* loop, const OmObservation* obs);
OmStatus om__slip_react(OmLoop* loop);

// loop_step.c: let one time step pass in the world and the twin, and measure.
OmStatus om__loop_step(OmLoop* loop);
OmRetractSample om__loop_sample(const OmLoop* loop);

// loop_decide.c
// After a tick: leave the stage if it has ended, until a stage waits for the next tick.
OmStatus om__loop_decide(OmLoop* loop);
OmStatus om__loop_plan(OmLoop* loop);
bool om__loop_moves_jaw(const OmLoop* loop);  // the current action grasps or releases
// The current plan is not followed further; its action under way ends with this outcome. A jaw completes its motion
// first.
OmStatus om__loop_drop_plan(OmLoop* loop, OmActionOutcome outcome);
// Record the action as ended; the loop then leaves STAGE_ACTION.
OmStatus om__loop_break_action(OmLoop* loop, OmActionOutcome outcome);
// End the loop between two actions or in the middle of one, at a command.
OmStatus om__loop_stop(OmLoop* loop, OmRetractOutcome outcome);

// loop_hold.c
// Stop and wait for a person after this tick. The first alarm of a tick counts.
void om__loop_alarm(OmLoop* loop, OmHold hold, const char* format, ...)
    __attribute__((format(printf, 3, 4)));
void om__loop_check_observation(OmLoop* loop, const OmObservation* obs, bool has_picture);
OmStatus om__loop_check_hold(OmLoop* loop);  // hold if there is an alarm
OmStatus om__loop_end_hold(OmLoop* loop);

// loop_command.c
OmStatus om__loop_check_command(const OmLoop* loop, const OmLoopCommand* command);
OmStatus om__loop_apply(OmLoop* loop, const OmLoopCommand* command);

// loop_notify.c: call a function of every listener that has it.
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
