// belief_state.h: what the robot believes during an operation, and how evidence changes it.
#ifndef OMENTUM_BELIEF_STATE_H
#define OMENTUM_BELIEF_STATE_H

#include "act/act_state.h"
#include "belief/belief_decide.h"
#include "belief/belief_updater.h"
#include "omentum/belief.h"
#include "omentum/match_adopt.h"

// Sums of a least squares fit: measured pull = factor x pull of the twin.
typedef struct ForceSum {
    double measured, twin;  // N^2
    double time;            // s of measurements in it
} ForceSum;

// What the loop must learn at once; each may be null.
typedef struct BeliefHost {
    void* ctx;
    OmStatus (*on_update)(void* ctx, const OmUpdateEvent* event);
    OmStatus (*on_warning)(void* ctx, int was);                    // the warning state changed
    void (*on_alarm)(void* ctx, OmHold hold, const char* reason);  // a person must decide
    void (*on_pause)(void* ctx);  // the arms stood still while this computed
} BeliefHost;

typedef struct Belief {
    // borrowed
    const OmSceneTask* task;
    const Grid* grid;
    OmWorld* world;
    OmBody* twin;
    Act* act;
    OmUpdater* updater;      // null: none
    OmMonitor* monitor;      // null: none
    OmBeliefRecord* record;  // written
    BeliefHost host;
    double max_age;      // s, of a picture; 0: not watched
    double time_origin;  // s of the world's clock at which the operation begins
    double clock_last;   // s, of the world

    // what was tried, and what trying in the simulation showed: facts of the planner (belief_fluents.c)
    OmSituation situation;  // of the last sensing
    uint8_t tried[OM_PLAN_MAX_BLOCK];
    // an attempt with all folds, or a force stop, exposed nothing
    bool is_exhausted[OM_PLAN_MAX_BLOCK];
    bool is_forbidden[OM_PLAN_MAX_BLOCK];  // by a person
    OmExposure exposure[OM_PLAN_MAX_BLOCK];
    // m: a block with MAX_NEAR_ATTEMPTS exhausted blocks nearer than this is postponed; 0: no block is
    double attempt_distance;
    int npostponed;     // blocks postponed by the last sensing
    bool is_exposed;    // the ROI was seen without a break for long enough
    bool is_corrected;  // the twin's attachments may differ from those of the plan
    bool wants_plan;    // a new plan after the current action

    // the warning state (belief_warn.c)
    OmMonitorFrame frame;  // the last one
    OmSceneMonitor monitor_settings;
    Warning warn;
    int warning_action;   // largest state during the current action that nothing has answered
    bool has_effect_due;  // of the last update on mu
    double effect_time;   // s, when to measure it
    int effect_update;    // which one
    double learn_begin;   // s, since when the arms wait for what is learnt
    double seen_last, seen_change;  // visibility at its last change while learning, and when, s

    ForceSum force_sum;  // belief_force.c
    // N, pull that each arm measures, without its noise; 0: it holds nothing, or measures none
    OmVec3 felt[OM_MAX_ARM];

    // acquisitions and estimates (belief_look.c)
    double look_begin;  // s, since when the arms keep still
    // the arms stand: for a picture; for what is learnt (set by the loop)
    bool is_looking, is_learning;
    OmMatchAdoption* adoption;  // of the twin
    int nfailed;                // estimates in a row that ended in an error
    int update_capacity;        // of the record

    // belief_doubt.c
    double* probability;    // of being attached, by the last estimate    (nvert)
    unsigned char* source;  // above 0: is never doubted; null: nothing is  (nvert)
} Belief;

// ---- belief.c ----------------------------------------------------------------------------------------------

// Begin an operation of a belief whose borrowed fields are set, and all others zero.
// @param exposure  what the plan before showed (OM_PLAN_MAX_BLOCK), null: nothing is known
OmStatus om__belief_begin(Belief* belief, const OmExposure* exposure);
void om__belief_done(Belief* belief);
OmStatus om__belief_tell(const Belief* belief, const OmUpdateEvent* event);
void om__belief_alarm(const Belief* belief, OmHold hold, const char* format, ...)
    __attribute__((format(printf, 3, 4)));
// The twin is not the one in which blocks were tried.
void om__belief_forget_exposure(Belief* belief);

// ---- facts of the planner (belief_fluents.c) -----------------------------------------------------------------

// Distances that do not depend on the grid, as fractions of the tissue's smaller side. They have no effect on grids up
// to 5 x 5.
#define ATTEMPT_DISTANCE 0.18  // of neighbouring attempts, initial value
#define MAX_NEAR_ATTEMPTS 3    // within that distance, before a block is postponed

void om__sense_fluents(Belief* belief, OmSituation* situation);

// ---- the twin at rest (belief_rest.c) -------------------------------------------------------------------------

// Let the twin come to rest. One that slides off gets more attachments, *nadded vertices.
// @return as om_body_settle
OmStatus om__rest_settle(const OmScene* scene, OmBody* twin, int* nadded);
double om__rest_shift(const OmBody* body);  // mean displacement from the patient model, m

// ---- warnings (belief_warn.c): nothing happens without a monitor ------------------------------------------------

double
om__warn_part(const Belief* belief);  // m, OmMonitorFrame.part less its value before the grasp
bool om__warn_is_due(const Belief* belief);  // a frame, in the step that follows
OmStatus om__warn_frame(Belief* belief, const OmObservation* obs);
void om__warn_end(Belief* belief);  // at a release, and at the end: the effect of the last update
bool om__warn_stops(const Belief* belief);  // the current motion must stop
// When an action has ended, or the step `done` after it: what comes next.
// @param next  the plan's next action, null: none
AfterStep om__warn_after(const Belief* belief, const OmPlanAction* next, AfterStep done);
// Does an acquisition that is taken now want an estimate? With a monitor only a warning does.
bool om__warn_wants_estimate(const Belief* belief);
void om__warn_note_update(Belief* belief, OmUpdateStage stage);
void om__warn_begin_learning(Belief* belief);
bool om__warn_is_learning(Belief* belief);  // false: the arms need not wait any more
void om__warn_give_up(Belief* belief);  // arms that hold tissue must release it: no pull, no fold

// ---- acquisitions and estimates (belief_look.c): nothing happens without an updater -----------------------------

// Take an acquisition, or set needs_tick until the tissue rests.
OmStatus om__look_take(Belief* belief, bool* needs_tick);
void om__look_note_grasp(Belief* belief, int arm, OmPose pose_world_tip);
OmStatus om__look_note_release(Belief* belief, int arm);
OmStatus om__look_check(Belief* belief);  // after a step: adopt or refuse an estimate that is ripe
OmStatus
om__look_start(Belief* belief);         // after decisions: start an estimate from new acquisitions
OmStatus om__look_end(Belief* belief);  // cancel an estimate that runs
// Other blocks are attached than when the plan was made.
bool om__look_is_outdated(const Belief* belief);
bool om__look_stops_reach(
    const Belief* belief);  // the arm reaches for a block that is now attached

// ---- doubts (belief_doubt.c) -------------------------------------------------------------------------------------

OmStatus om__doubt_create(Belief* belief);
// An adopted estimate; `probability` may be null.
void om__doubt_note(Belief* belief, const unsigned char* attached, const double* probability);
void om__doubt_mark(Belief* belief, int vert, bool is_attached);  // by a person
// When no plan is left: begin to free what is doubted, if a point can be grasped then.
OmStatus om__doubt_free(Belief* belief, bool* is_changed);
bool om__doubt_is_over(const Belief* belief);

// ---- forces (belief_force.c) ---------------------------------------------------------------------------------------

void om__force_add(Belief* belief, const OmObservation* obs, const OmBodyForces* twin);
void om__force_reset(Belief* belief);

#endif
