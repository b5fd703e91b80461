// trial_search.c: can any grasp expose the ROI? Every sequence of the planner's motions, tried on the truth.
//
// For every grasping point that is not above an attachment, from rest: a lift to the height limit or the force limit;
// from there the fold away from the camera, the fold towards the ROI, and after each fold the other one. These
// are all sequences of actions that the planner has for one grasp (asp/tissue_retraction.lp). A lift is made of pulls
// and ends with the first pull that exposes the ROI, so that the fewest actions are known. Trials use the truth alone,
// without noise and without tools in the picture, and compare its own force with the threshold. If the search exposes
// nothing, no choice of the planner exposes the ROI from tissue at rest. The search for the fewest actions leaves out
// what cannot need fewer than a sequence that was found.
//
// With both arms, where one fails: the grasps with the largest visibility are made again by PSM1, which then keeps its
// tissue, and PSM2 tries every other block in the same way, at the place where the block now is. The first pair that
// exposes the ROI ends the search.
#include <string.h>

#include "omentum/trial_search.h"
#include "trial/trial_lift.h"

typedef struct Found {  // the sequence of a block with the largest visibility
    double visibility;  // -1: none
    int npull;
    OmPlanVerb first, second;
} Found;

typedef struct Search {
    const OmScene* scene;
    Trial* trial;
    double force_limit;
    bool wants_fewest;  // sequences that need no fewer actions are left out
    OmSearchResult* best;
    Found found[OM_PLAN_MAX_BLOCK];
    bool is_free[OM_PLAN_MAX_BLOCK];  // has tissue, and is not above an attachment
    int vert[OM_PLAN_MAX_BLOCK];      // of the truth, nearest to the grasping point at rest
    int ndone;                        // actions before the present grasp
    const OmProgress* progress;
    const char* stage;
    int istage, nstage;  // done, of all
} Search;

static OmStatus report(void* ctx) {
    const Search* s = ctx;
    return om_progress_report(s->progress, s->stage, s->istage, s->nstage);
}

// May a sequence of reach, grasp and n motions be the one with the fewest actions?
static bool is_worth(const Search* s, int n) {
    const OmSearchResult* r = s->best;
    return !s->wants_fewest || r->naction == 0 || s->ndone + 2 + n < r->naction;
}

// A sequence of reach, grasp, npull pulls and the folds.
static void keep(Search* s, int block, int npull, OmPlanVerb first, OmPlanVerb second,
                 const TrialResult* c) {
    OmSearchResult* r = s->best;
    const int naction = s->ndone + 2 + npull + (first != OM_PLAN_PULL) + (second != OM_PLAN_PULL);
    ++r->nsequence;
    if (c->visibility >= s->scene->task.visibility) {
        ++r->nexposed;
        if (r->naction == 0 || naction < r->naction) r->naction = naction;
    }
    Found* f = &s->found[block];
    if (c->visibility > f->visibility) *f = (Found){c->visibility, npull, first, second};
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
        if (c.visibility >= s->scene->task.visibility || !is_worth(s, npull + 2)) continue;
        OM_TRY_DONE(om__trial_second_fold(t, verb[1 - k], lift->tip, s->force_limit, &c));
        keep(s, block, npull, verb[k], verb[1 - k], &c);
    }
done:
    om_free(lifted);
    return status;
}

// Pulls and folds of tissue that was just grasped.
static OmStatus try_grasp(Search* s, int block, TrialResult c) {
    const OmSceneTask* task = &s->scene->task;
    int npull = 0;
    ++s->best->ngrasp;
    while (!c.is_stopped && c.visibility < task->visibility &&
           npull * task->pull_step < task->max_height - 1e-9) {
        if (!is_worth(s, npull + 1)) return OM_OK;
        OM_TRY(om__trial_pull(s->trial, npull++ * task->pull_step, s->force_limit, &c));
    }
    keep(s, block, npull, OM_PLAN_PULL, OM_PLAN_PULL, &c);
    const bool may_fold = c.visibility < task->visibility && is_worth(s, npull + 1);
    return may_fold ? try_folds(s, block, npull, &c) : OM_OK;
}

static OmStatus try_block(Search* s, int block) {
    TrialResult c = {0};
    int nheld;
    OM_TRY(om__trial_grasp(s->trial, block, &c, &nheld));
    return nheld > 0 ? try_grasp(s, block, c) : OM_OK;
}

// ---- both arms ----------------------------------------------------------------------------------------------------

// The vertex of the truth nearest to each grasping point at rest: its place moves with the tissue.
static void find_vertices(Search* s) {
    const Trial* t = s->trial;
    for (int b = 0; b < t->grid.n * t->grid.n; ++b) {
        const OmVec3 p = om_pose_apply(t->grid.task, t->grid.tip[b]);
        double nearest = INFINITY;
        om_body_restore(t->body, t->rest);
        for (int v = 0; s->is_free[b] && v < t->site.mesh.nvert; ++v) {
            const double d = om_distance(p, om_load3(om_body_x(t->body), v));
            if (d < nearest) s->vert[b] = v;
            nearest = fmin(nearest, d);
        }
    }
}

// The best sequence of a block again, by PSM1, which then keeps its tissue.
static OmStatus repeat_first(Search* s, int block, const Found* f) {
    Trial* t = s->trial;
    TrialResult c = {0};
    int nheld;
    t->arm = 0;
    OM_TRY(om__trial_grasp(t, block, &c, &nheld));
    for (int k = 0; k < f->npull; ++k)
        OM_TRY(om__trial_pull(t, k * s->scene->task.pull_step, s->force_limit, &c));
    const OmVec3 lifted = c.tip;
    if (f->first != OM_PLAN_PULL) OM_TRY(om__trial_fold(t, f->first, s->force_limit, &c));
    if (f->second != OM_PLAN_PULL)
        OM_TRY(om__trial_second_fold(t, f->second, lifted, s->force_limit, &c));
    s->ndone = 2 + f->npull + (f->first != OM_PLAN_PULL) + (f->second != OM_PLAN_PULL);
    return OM_OK;
}

// Every other block by PSM2, until a sequence exposes the ROI.
static OmStatus try_seconds(Search* s, int first, const void* held) {
    Trial* t = s->trial;
    t->arm = 1;
    for (int b = 0; b < t->grid.n * t->grid.n && s->best->nexposed == 0; ++b) {
        TrialResult c = {0};
        int nheld;
        if (!s->is_free[b] || b == first) continue;
        om_body_restore(t->body, held);
        OM_TRY(om__trial_grasp_at(t, om_load3(om_body_x(t->body), s->vert[b]), &c, &nheld));
        if (nheld > 0) OM_TRY(try_grasp(s, b, c));
    }
    return OM_OK;
}

// The first grasps with the largest visibility, best first.
static OmStatus search_pairs(Search* s, int nfirst) {
    Trial* t = s->trial;
    Found found[OM_PLAN_MAX_BLOCK];
    OmStatus status = OM_OK;
    void* held = om_alloc(1, om_body_state_size(t->body));
    OM_CHECK_DONE(held, OM_NO_MEMORY, "out of memory for a snapshot");
    find_vertices(s);
    memcpy(found, s->found, sizeof found);
    for (int k = 0; k < nfirst && s->best->nexposed == 0; ++k) {
        int first = -1;
        for (int b = 0; b < t->grid.n * t->grid.n; ++b)
            if (found[b].visibility >= 0 &&
                (first < 0 || found[b].visibility > found[first].visibility))
                first = b;
        if (first < 0) break;
        s->stage = "searching with both arms", s->istage = k, s->nstage = nfirst;
        OM_TRY_DONE(report(s));
        OM_TRY_DONE(repeat_first(s, first, &found[first]));
        om_body_save(t->body, held);
        s->best->first_block = first;
        OM_TRY_DONE(try_seconds(s, first, held));
        found[first].visibility = -1;
    }
done:
    om_free(held);
    return status;
}

// ---- public ---------------------------------------------------------------------------------------------------------

static OmStatus search(const OmScene* scene, double force_limit, int nfirst, bool wants_fewest,
                       int nworker, const OmProgress* progress, OmSearchResult* result) {
    *result = (OmSearchResult){.block = -1, .first_block = -1};
    OM_CHECK(force_limit > 0, OM_INVALID, "force limit of %g N; must be positive", force_limit);
    Search s = {
        .scene = scene, .force_limit = force_limit, .wants_fewest = wants_fewest, .best = result};
    for (int b = 0; b < OM_PLAN_MAX_BLOCK; ++b) s.found[b].visibility = -1;
    OmSite site = {0};
    OmBody* twin = NULL;  // has the attachments that the planner knows
    OmStatus status = om_site_build(scene, OM_SITE_TWIN, progress, &site);
    if (status < 0) return status;
    OM_TRY_DONE(om_world_check_visible(scene, &site));
    OM_TRY_DONE(om_body_create(scene, &site, nworker, &twin));
    OM_TRY_DONE(om__trial_create(scene, scene->seed, OM_SITE_WORLD, nworker, &s.trial));
    int nblock = scene->task.grid * scene->task.grid;
    s.progress = progress, s.stage = "searching", s.nstage = nblock;
    s.trial->tick = report, s.trial->tick_ctx = &s;
    for (int b = 0; b < nblock; ++b) {
        s.istage = b;
        OM_TRY_DONE(report(&s));
        const Grid* g = &s.trial->grid;
        s.is_free[b] = g->vert[b] >= 0 && !om__grid_is_fixed(g, twin, b);
        if (s.is_free[b]) OM_TRY_DONE(try_block(&s, b));
    }
    if (result->nexposed == 0 && nfirst > 0) OM_TRY_DONE(search_pairs(&s, nfirst));
done:
    om__trial_destroy(s.trial);
    om_body_destroy(twin);
    om_site_done(&site);
    return status;
}

OmStatus om_retract_search(const OmScene* scene, double force_limit, int nworker,
                           const OmProgress* progress, OmSearchResult* result) {
    return search(scene, force_limit, 0, false, nworker, progress, result);
}

OmStatus om_retract_search_both(const OmScene* scene, double force_limit, int nfirst, int nworker,
                                const OmProgress* progress, OmSearchResult* result) {
    return search(scene, force_limit, nfirst, false, nworker, progress, result);
}

OmStatus om_retract_search_fewest(const OmScene* scene, double force_limit, int nworker,
                                  const OmProgress* progress, OmSearchResult* result) {
    return search(scene, force_limit, 0, true, nworker, progress, result);
}
