// defras_search.c: can any grasp expose the ROI? Every sequence of the planner's motions, tried on the truth.
//
// For every grasping point that is not above an attachment, from rest: a lift to the height limit or the force limit;
// from there the fold away from the camera, the fold towards the ROI, and each fold followed by the other one. These
// are all sequences of actions that the planner has for one grasp (asp/tissue_retraction.lp). A lift is made of pulls
// and ends with the first pull that exposes the ROI, so that the fewest actions are known. Trials use the truth alone,
// without noise and without tools in the picture, and compare its own force with the threshold. If the search exposes
// nothing, no choice of the planner exposes the ROI from tissue at rest.
#include <string.h>

#include "defras/defras_trial.h"
#include "omentum/defras.h"

typedef struct Search {
    const OmScene* scene;
    Trial* trial;
    double force_limit;
    OmSearchResult* best;
} Search;

// A sequence of reach, grasp, npull pulls and the folds.
static void keep(Search* s, int block, int npull, OmPlanVerb first, OmPlanVerb second,
                 const TrialResult* c) {
    OmSearchResult* r = s->best;
    const int naction = 2 + npull + (first != OM_PLAN_PULL) + (second != OM_PLAN_PULL);
    ++r->nsequence;
    if (c->visibility >= s->scene->task.visibility) {
        ++r->nexposed;
        if (r->naction == 0 || naction < r->naction) r->naction = naction;
    }
    if (c->visibility <= r->visibility) return;
    r->visibility = c->visibility;
    r->force = c->force;
    r->block = block;
    r->first = first;
    r->second = second;
}

// Both folds from a lifted state, each followed by the other.
static OmStatus try_folds(Search* s, int block, int npull, const TrialResult* lift) {
    static const OmPlanVerb verb[2] = {OM_PLAN_MOVE_AWAY, OM_PLAN_MOVE_ROI};
    Trial* t = s->trial;
    OmStatus status = OM_OK;
    void* lifted = om_alloc(1, om_body_state_size(t->body));
    OM_CHECK_DONE(lifted, OM_NO_MEMORY, "out of memory for a snapshot");
    om_body_save(t->body, lifted);
    for (int k = 0; k < 2; ++k) {
        TrialResult c = *lift;
        if (k) om_body_restore(t->body, lifted);
        OM_TRY_DONE(om__trial_fold(t, verb[k], s->force_limit, &c));
        keep(s, block, npull, verb[k], OM_PLAN_PULL, &c);
        if (c.visibility >= s->scene->task.visibility) continue;
        OM_TRY_DONE(om__trial_fold(t, verb[1 - k], s->force_limit, &c));
        keep(s, block, npull, verb[k], verb[1 - k], &c);
    }
done:
    om_free(lifted);
    return status;
}

static OmStatus try_block(Search* s, int block) {
    TrialResult c = {0};
    const OmSceneTask* task = &s->scene->task;
    int nheld, npull = 0;
    OM_TRY(om__trial_grasp(s->trial, block, &c, &nheld));
    if (nheld == 0) return OM_OK;
    ++s->best->ngrasp;
    while (!c.is_stopped && c.visibility < task->visibility &&
           npull * task->pull_step < task->max_height - 1e-9)
        OM_TRY(om__trial_pull(s->trial, npull++ * task->pull_step, s->force_limit, &c));
    keep(s, block, npull, OM_PLAN_PULL, OM_PLAN_PULL, &c);
    return c.visibility < task->visibility ? try_folds(s, block, npull, &c) : OM_OK;
}

OmStatus om_retract_search(const OmScene* scene, double force_limit, int nworker,
                           const OmProgress* progress, OmSearchResult* result) {
    *result = (OmSearchResult){.block = -1};
    OM_CHECK(force_limit > 0, OM_INVALID, "force limit of %g N; must be positive", force_limit);
    Search s = {.scene = scene, .force_limit = force_limit, .best = result};
    OmSite site = {0};
    OmBody* twin = NULL;  // has the attachments that the planner knows
    OmStatus status = om_site_build(scene, OM_SITE_TWIN, progress, &site);
    if (status < 0) return status;
    OM_TRY_DONE(om_world_check_visible(scene, &site));
    OM_TRY_DONE(om_body_create(scene, &site, nworker, &twin));
    OM_TRY_DONE(om__trial_create(scene, scene->seed, OM_SITE_WORLD, nworker, &s.trial));
    int nblock = scene->task.grid * scene->task.grid;
    for (int b = 0; b < nblock; ++b) {
        OM_TRY_DONE(om_progress_report(progress, "searching", b, nblock));
        const Grid* g = &s.trial->grid;
        if (g->vert[b] < 0 || om__grid_is_fixed(g, twin, b)) continue;
        OM_TRY_DONE(try_block(&s, b));
    }
done:
    om__trial_destroy(s.trial);
    om_body_destroy(twin);
    om_site_done(&site);
    return status;
}
