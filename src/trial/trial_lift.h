// trial_lift.h: trial grasps on one body, each from its state at rest; for calibration and search.
#ifndef OMENTUM_TRIAL_LIFT_H
#define OMENTUM_TRIAL_LIFT_H

#include "trial/trial_attempt.h"

// The tissue of one layout at rest: the twin's body or the truth's.
typedef struct Trial {
    OmScene scene;  // with the layout's seed
    OmSite site;
    OmBody* body;
    OmView* view;
    Grid grid;
    void* rest;     // the settled state
    double speed;   // m/s, of the tip; default: the task's
    double enough;  // share of the ROI seen that ends a lift or fold; default infinity
    int arm;        // that grasps and moves; default 0
    OmStatus (*tick)(void* ctx);  // called before each step; below 0 ends the trial; may be null
    void* tick_ctx;
} Trial;

// Result of the motions of one trial.
typedef struct TrialResult {
    OmVec3 tip;         // at the end, world frame, m
    double force;       // N, largest pull of an arm
    double visibility;  // largest share of the ROI seen
    double length;      // m covered
    bool is_stopped;    // the force limit ended the last motion
    bool is_enough;     // or it ended as enough of the ROI was seen
    Trace* trace;       // filled if not null
} TrialResult;

// Error messages are per thread: a worker copies its own here.
typedef struct TrialOutcome {
    OmStatus status;
    char message[512];
} TrialOutcome;

OmStatus om__trial_create(const OmScene* scene, int seed, OmSiteRole role, int nworker,
                          Trial** trial);
void om__trial_destroy(Trial* trial);
// Restore the state at rest and grasp a block; nheld 0: only attached tissue, or none, is in reach.
OmStatus om__trial_grasp(Trial* trial, int block, TrialResult* course, int* nheld);
// Grasp at a tip from the present state, world frame; the other arm keeps its tissue.
OmStatus om__trial_grasp_at(Trial* trial, OmVec3 tip, TrialResult* course, int* nheld);
// Lift to the height limit; one pull of a lift that has come to `height`, m, and a rest after the last; fold from the
// present tip, as the loop does. A force above `force_limit`, N, ends a motion (INFINITY: no limit). All update the
// result: its force and visibility are the largest of all motions.
OmStatus om__trial_lift(Trial* trial, double force_limit, TrialResult* course);
OmStatus om__trial_pull(Trial* trial, double height, double force_limit, TrialResult* course);
OmStatus om__trial_fold(Trial* trial, OmPlanVerb verb, double force_limit, TrialResult* course);
// The same fold after another one that began at `lifted`, world frame: first back to there, on the way it came, without
// a limit.
OmStatus om__trial_second_fold(Trial* trial, OmPlanVerb verb, OmVec3 lifted, double force_limit,
                               TrialResult* course);
// Keep the tip still; `least` receives the smallest share of the ROI seen meanwhile.
OmStatus om__trial_hold(Trial* trial, double seconds, double* least, TrialResult* course);
#define TRIAL_WRONG 10
// Bring the tip to n places, a step each; `force` receives the pull at each, N, NaN where the step is not right. The
// motion is over where the pull exceeds `most`, N: the rest of `force` is that pull; or after TRIAL_WRONG steps in a
// row that are not right (tissue is jammed in a fold, such a step takes seconds): the rest is NaN.
OmStatus om__trial_replay(Trial* trial, int n, const OmVec3* tip, double most, double* force,
                          bool* is_over);

// trial_calibrate.c: the largest limit, N, for which 95 % of what the truth bears while the twin bears between
// SLOW_FROM of it and all of it is at most the threshold; 0: there is none. `scratch` has room for n.
double om__trial_limit(int n, const double* twin, const double* truth, double threshold,
                       double* scratch);

#endif
