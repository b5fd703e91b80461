// defras_trial.h: grasps tried on a body alone, from its rest: what calibration and search share.
#ifndef OMENTUM_DEFRAS_TRIAL_H
#define OMENTUM_DEFRAS_TRIAL_H

#include "defras/defras_internal.h"

// One layout's tissue at rest, as the twin or as the truth has it.
typedef struct Trial {
    OmScene scene;  // with the layout's seed
    OmSite site;
    OmBody* body;
    OmView* view;
    Grid grid;
    void* rest;    // the settled state
    double speed;  // m/s, of the tip; default: the task's
} Trial;

// The tip and the pull of every step of a motion, to be repeated on another body.
typedef struct Trace {
    int n, capacity;
    OmVec3* tip;    // world frame, m
    double* force;  // N
} Trace;

// What a motion met on its way.
typedef struct Course {
    OmVec3 tip;         // where it ended, world frame, m
    double force;       // N, largest pull
    double visibility;  // largest share of the ROI seen
    double way;         // m gone
    bool is_stopped;    // by force
    Trace* trace;       // filled if not null
} Course;

// Messages belong to a thread: they are carried home.
typedef struct TrialOutcome {
    OmStatus status;
    char message[512];
} TrialOutcome;

OmStatus om__trial_create(const OmScene* scene, int seed, OmSiteRole role, int nworker,
                          Trial** trial);
void om__trial_destroy(Trial* trial);
// Back to rest and hold a block's grasping point; nheld 0: only attached tissue, or none, is in reach.
OmStatus om__trial_grasp(Trial* trial, int block, Course* course, int* nheld);
// Lift to the height limit; fold from where the tip is, as the loop does. `force_limit` N ends a motion
// (INFINITY: nothing does). Both add to the course: its largest force and visibility are of all motions.
OmStatus om__trial_lift(Trial* trial, double force_limit, Course* course);
OmStatus om__trial_fold(Trial* trial, OmPlanVerb verb, double force_limit, Course* course);
// Repeat a motion; `force` receives the pull at every step of the trace, N.
OmStatus om__trial_replay(Trial* trial, const Trace* trace, double* force);
void om__trace_done(Trace* trace);

#endif
