/// omentum/act.h: how the arms carry out the actions of a plan (floor 6; thesis 6.4.4).
///
/// An action is a sequence of straight motions and waits, advanced one tick at a time by the loop (loop.h). Here is
/// what a user of the loop sees of it: how an action ended, the effort, and a motion law in place of straight lines.
#ifndef OMENTUM_ACT_H
#define OMENTUM_ACT_H

#include "omentum/plan.h"
#include "omentum/vec.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum OmActionOutcome {
    OM_ACTION_DONE,       // it ended as planned
    OM_ACTION_EXPOSED,    // the ROI came into view during the motion
    OM_ACTION_FORCE,      // stopped: force above the threshold, even when slowed down
    OM_ACTION_HEIGHT,     // stopped: the height limit
    OM_ACTION_UNREACHED,  // the arm could not go there
    OM_ACTION_EMPTY,      // no tissue between the jaws
    OM_ACTION_SLIPPED,    // stopped: tissue slipped out of the jaws
    OM_ACTION_OUTDATED,   // stopped: by an update of the twin the block is attached
    OM_ACTION_ABORTED,    // a command ended the loop during the action
    OM_ACTION_WARNED,     // stopped: the tissue is not where the twin expects it (Alg. 5, state 2)
    OM_ACTION_REPLANNED,  // stopped: a person demanded a new plan, or forbade the block
    OM_ACTION_HELD        // stopped: the loop holds (OmHold)
} OmActionOutcome;
OM_API const char* om_action_outcome_text(OmActionOutcome outcome);

// A point at which a jaw closed on nothing is tried again where a new look shows the tissue elsewhere, so often in all.
#define OM_ACT_MAX_EMPTY 3
#define OM_CLOUD_AGREE 0.003  // m; a measured grasping point further from the twin's is another one

typedef struct OmEffort {  // of the arms, in one operation
    // m, way of both tips in reaches, pulls and folds, between measured places
    double path;
    int nslip;   // grasps that slipped
    int nempty;  // times that a jaw closed on nothing
    // Reaches to tissue that the depth camera sees, more than OM_CLOUD_AGREE from where the twin has it.
    int nmeasured;
    double measured_off;  // m, the largest such distance
    int ndrawn;  // grasps at which the twin's tissue was not at the tip, and was drawn to it
} OmEffort;

typedef enum OmHold {  // why the arms stop and wait for a person
    OM_HOLD_NONE,      // they do not
    OM_HOLD_WARNING,   // state 3 of Alg. 5: the twin does not describe this tissue
    OM_HOLD_STALE,     // the picture, or the world's clock, is older than OmLoopDef.max_age
    OM_HOLD_LATE,      // the twin is behind real time by more than OmLoopDef.max_lag
    OM_HOLD_UPDATE,    // estimates of the attachments failed OM_LOOP_MAX_FAILED times in a row
    OM_HOLD_PLANNER,   // the planner found no plan within its budget
    OM_HOLD_TOOL,      // an arm is not measured
    OM_HOLD_ARM        // an arm does not follow its command
} OmHold;
/// One word: "none", "warning", "stale", "late", "update", "planner", "tool", "arm".
OM_API const char* om_hold_text(OmHold hold);

// ---- the motions of reaches and pulls ------------------------------------------------------------------------

typedef struct OmLoopMotion {  // a motion under way; positions in m, task frame: z is up
    int arm;
    OmPlanVerb verb;  // OM_PLAN_REACH: the tool is free; OM_PLAN_PULL: it holds tissue
    OmVec3 tip;       // as measured
    OmVec3 goal;      // where it ends
    int nplace;       // places that the law has given so far
} OmLoopMotion;

/// A motion law in place of straight lines (6.3), such as a trained policy. Force, visibility, distances between tools
/// and the supervision of a motion stay those of the loop.
typedef struct OmMotionLaw {
    void* ctx;  // borrowed
    /// The next place of the tip, at most OM_LAW_STEP from it; the goal: the rest of the way is straight.
    /// A negative status ends the run with this error.
    OmStatus (*next)(void* ctx, const OmLoopMotion* motion, OmVec3* place);
} OmMotionLaw;
#define OM_LAW_STEP 0.02  // m
// After so many places the rest of the way is straight; also where the arm cannot go to the law's place.
#define OM_LAW_MOST 400

#ifdef __cplusplus
}
#endif
#endif
