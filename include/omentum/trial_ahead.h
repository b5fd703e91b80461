/// omentum/trial_ahead.h: look ahead before a new plan (floor 8; not in the thesis).
///
/// When the loop makes a new plan during the operation, the best grasping points of the logic program that are not yet
/// known are tried in snapshots of the twin: its present state, with the attachments believed now. What they show goes
/// into the facts of exposure (OmSituation.exposure), and the program decides. The twin is restored. The budget counts
/// steps, so that a run repeats to the byte.
///
///     OmAheadDef def = om_ahead_default_def(&scene, &twin_site);
///     OmAhead* ahead;   om_ahead_create(&def, twin, &ahead);
///     loop_def.ahead = ahead;  ...  om_ahead_destroy(ahead);      // after the loop
#ifndef OMENTUM_TRIAL_AHEAD_H
#define OMENTUM_TRIAL_AHEAD_H

#include "omentum/body.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_AHEAD_POINTS 3  // grasping points tried in the twin before a new plan

typedef struct OmAheadDef {
    OmCookie cookie;
    const OmScene* scene;  // borrowed until destroy: task and endoscope
    const OmSite* site;    // of the twin; borrowed until destroy
    int npoint;  // points tried for one plan, at most; default: the task's `ahead`, or 3 where this is 0
    int max_step;  // steps of the twin for one plan; default 5000
    // A point that exposes the ROI is repeated in a twin of half the modulus. If the ROI stays hidden there, the point
    // counts only if no other point is confirmed. Default true.
    bool is_repeated;
} OmAheadDef;

OM_API OmAheadDef om_ahead_default_def(const OmScene* scene, const OmSite* site);

/// Snapshots and the endoscope's view of the twin; for one loop at a time.
typedef struct OmAhead OmAhead;

/// @param twin  that of the loop
/// @return OM_OK; OM_INVALID (a field, or a twin of another site); OM_NO_MEMORY; OM_UNAVAILABLE (Embree failed)
OM_API OmStatus om_ahead_create(const OmAheadDef* def, const OmBody* twin, OmAhead** ahead);
OM_API void om_ahead_destroy(OmAhead* ahead);

#ifdef __cplusplus
}
#endif
#endif
