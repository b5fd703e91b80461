// trial_attempt.h: one grasping point tried on a body of the twin, as the loop would do it.
#ifndef OMENTUM_TRIAL_ATTEMPT_H
#define OMENTUM_TRIAL_ATTEMPT_H

#include "belief/belief_state.h"
#include "omentum/trial_ahead.h"
#include "omentum/trial_preplan.h"

// The tip and the pull of every step of a motion, to be repeated on another body.
typedef struct Trace {
    int n, capacity;
    OmVec3* tip;    // world frame, m
    double* force;  // N
    int fold_step;  // at which a fold began, of a sequence with a fold
} Trace;

// trial_lift.c
OmStatus om__trace_add(Trace* trace, OmVec3 tip, double force);
void om__trace_done(Trace* trace);

// What an attempt needs. All but the limits is borrowed; the body is stepped.
typedef struct Attempt {
    const OmSceneTask* task;
    const Grid* grid;
    OmBody* body;  // the arm of an attempt has nothing in hand
    OmView* view;
    OmPsm psm[OM_MAX_ARM];  // reach
    OmQuat q[OM_MAX_ARM];   // orientation of the tools, world frame; motions keep it
    void* lifted;           // om_body_state_size bytes, scratch
    double force_limit;     // N, INFINITY: none
    bool has_forces;
    int max_step;  // of the body; 0: no limit
    // null, or two of the caller: of the best sequence, which is replaced, and scratch
    Trace* trace;
    // called before each step of the body; below 0 ends the attempt; may be null
    OmStatus (*tick)(void* ctx);
    void* tick_ctx;
} Attempt;

typedef struct AttemptResult {
    bool is_cut;       // max_step ended it: nothing is known
    bool is_held;      // tissue was grasped
    bool is_in_reach;  // of the arm
    bool is_forced;    // the force limit ended the pulls
    bool exposes;
    int npull;
    OmPlanVerb fold;  // OM_PLAN_PULL: none
    double visibility, force;
    int naction;
    int nstep;
} AttemptResult;

// One step with the tip of an arm at a place, world frame; `force` receives the pull, N, where the engine has forces.
OmStatus om__attempt_step(const Attempt* attempt, int arm, OmVec3 tip, double* force);
// Grasp a block from the body's present state, pull, and fold where the ROI is still hidden. The body is left in any
// state.
OmStatus om__attempt_run(const Attempt* attempt, int arm, int block, AttemptResult* result);
// After the path of a sequence, repeated on this body, left the ROI hidden: what the loop would do, which continues the
// last motion. A fold continues to its length, pulls to the height limit. The body has tissue in hand.
// @param fold   of the sequence, OM_PLAN_PULL: none
// @param trace  of the sequence
OmStatus om__attempt_continue(const Attempt* attempt, OmPlanVerb fold, int arm, const Trace* trace,
                              bool* exposes, int* nstep);

// trial_ahead.c
typedef struct AheadCount {  // of one operation
    int npoint;              // points tried
    int64_t nstep;           // steps of the twin that this took
    int nbad;                // of them, steps with uncertain forces
} AheadCount;
// Before a new plan, after the fluents: try the best unknown grasping points in snapshots of the twin, and make facts
// of them. Nothing happens if `ahead` is null.
OmStatus om__ahead_run(OmAhead* ahead, Belief* belief, OmPlanner* planner, AheadCount* count);
// trial_preplan.c: choose among the points that were tried; sets verdicts, counts and the reason.
void om__preplan_choose(OmPreplan* plan, int nlowest);

#endif
