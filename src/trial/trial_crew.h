// trial_crew.h: trials on many bodies of one model, all from one snapshot at rest.
#ifndef OMENTUM_TRIAL_CREW_H
#define OMENTUM_TRIAL_CREW_H

#include "base/base_slots.h"
#include "trial/trial_attempt.h"

typedef struct Worker {  // what one trial needs for itself
    OmBodyWork* work;
    Attempt attempt;  // owns body, view and lifted
} Worker;

typedef struct Crew {
    const OmScene* scene;  // borrowed
    OmSite site;
    Grid grid;
    OmBodyModel* model;
    void* rest;  // the settled state
    Worker* worker;
    int nworker;
    OmSlots* free;  // workers without a trial
} Crew;

// Bodies of a site, which the crew takes over also on an error, and their state at rest.
OmStatus om__crew_create(Crew* crew, const OmScene* scene, OmSite* site, int nworker);
void om__crew_done(Crew* crew);

// One trial, number i, by a worker whose body is in the state at rest.
typedef OmStatus (*CrewJob)(void* ctx, Worker* worker, int i);
// Make n trials in parallel. The result of a trial must depend on i alone.
// @return OM_OK; the first error of a trial; OM_CANCELLED
OmStatus om__crew_run(Crew* crew, int n, CrewJob job, void* ctx, const OmProgress* progress,
                      const char* stage);

#endif
