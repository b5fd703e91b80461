// trial_robust.h: the best plans again, in twins that differ a little from what is believed.
#ifndef OMENTUM_TRIAL_ROBUST_H
#define OMENTUM_TRIAL_ROBUST_H

#include "trial/trial_crew.h"
#include "trial/trial_kept.h"

// Stages of kept trials: the points, numbered by block, then each changed twin.
enum { KEPT_POINTS = 0, KEPT_CHANGES = 1 };

typedef struct KeptAgain {  // of a finished repetition in a changed twin
    double spread;          // m, see OmPreplanPoint
    double force;           // N, the largest
    int32_t is_held, is_exposing, is_alike, pad;
} KeptAgain;

// Repeat the `def->nagain` exposing points of lowest force in changed twins. Sets ntwin, ntwin_exposed, spread, warning
// and force_most of these points.
// @param crew   of the believed twin
// @param trace  of the best sequence of each block
// @param kept   finds finished repetitions, and receives new ones
OmStatus om__robust_run(const OmPreplanDef* def, Crew* crew, const Trace trace[OM_PLAN_MAX_BLOCK],
                        const Kept* kept, OmPreplan* plan, const OmProgress* progress);

// trial_preplan.c: the order of 6.4.2, lower force, then fewer actions, then the lower block
bool om__preplan_is_gentler(const OmPreplanPoint* a, const OmPreplanPoint* b);

#endif
