// trial_ahead.c: the best unknown grasping points, tried in snapshots of the twin before a new plan.
//
// Solve, try, solve again: the program names the point that it would grasp; if its exposure is not known, the point is
// tried and becomes a fact. If it exposes the ROI, it stays the best, and the others need not be tried; if it does
// not, the program names the next one. So at most `npoint` points are tried, by the program's own cost.
//
// Tissue in hand that the plan lets go is released first, and falls for FALL_TIME; attachments that are being adopted
// arrive meanwhile. A plan that continues with tissue in hand is left alone.
//
// A point that exposes the ROI is repeated in a twin of half the modulus, from the same state: a fold that needs the
// stiffness of the twin does not tip over in softer tissue. A point that is not confirmed counts as hidden while the
// program names further points, and exposes the ROI nevertheless if none of them is confirmed.
//
// Rejected: trying three points in each case. The program takes the nearest point that is not known to fail, so the
// second and third do not change the plan where the first exposes the ROI.
#include "omentum/trial_ahead.h"

#include <string.h>

#include "omentum/world.h"
#include "trial/trial_attempt.h"

#define AHEAD_COOKIE 0xa4ead0
#define AHEAD_STEPS 5000
#define SOFT 0.5  // modulus of the other twin

struct OmAhead {
    OmAheadDef def;
    // of the present call, borrowed
    OmPlanner* planner;
    AheadCount* count;
    Attempt attempt;       // owns view and lifted; body and grid are the belief's
    void *now, *released;  // snapshots of the twin
    void* adoption;        // of the belief's adoption, null before the first use
    OmSite soft_site;      // the site with another modulus; its arrays are the site's
    OmBody* soft;          // of soft_site, null: points are not repeated
    Trace trace[2];        // of the last attempt
    int fragile[OM_PLAN_MAX_BLOCK], nfragile;  // blocks that expose the ROI in the twin alone
};

OmAheadDef om_ahead_default_def(const OmScene* scene, const OmSite* site) {
    return (OmAheadDef){.cookie = AHEAD_COOKIE,
                        .scene = scene,
                        .site = site,
                        .npoint =
                            scene && scene->task.ahead > 0 ? scene->task.ahead : OM_AHEAD_POINTS,
                        .max_step = AHEAD_STEPS,
                        .is_repeated = true};
}

static OmStatus check_def(const OmAheadDef* def, const OmBody* twin) {
    OM_CHECK(def->cookie == AHEAD_COOKIE, OM_INVALID, "OmAheadDef was not made by default_def");
    OM_CHECK(def->scene && def->site, OM_INVALID, "OmAheadDef.scene or site is null");
    OM_CHECK(om_body_site(twin) == def->site, OM_INVALID,
             "OmAheadDef.site is not that of the twin");
    OM_CHECK(def->npoint >= 1 && def->max_step >= 1, OM_INVALID,
             "OmAheadDef: npoint is %d, max_step %d; 1 or more", def->npoint, def->max_step);
    return OM_OK;
}

OmStatus om_ahead_create(const OmAheadDef* def, const OmBody* twin, OmAhead** out) {
    *out = NULL;
    OM_TRY(check_def(def, twin));
    OmAhead* a = om_calloc(1, sizeof *a);
    if (!a) return OM_NO_MEMORY;
    const size_t size = om_body_state_size(twin);
    OmStatus status = om_view_create_of_body(def->scene, twin, &a->attempt.view);
    a->def = *def;
    a->now = om_alloc(1, size);
    a->released = om_alloc(1, size);
    a->attempt.lifted = om_alloc(1, size);
    if (status >= 0 && (!a->now || !a->released || !a->attempt.lifted)) status = OM_NO_MEMORY;
    for (int k = 0; k < OM_MAX_ARM; ++k) a->attempt.psm[k] = om_world_place_psm(def->site, k);
    a->attempt.trace = a->trace;
    a->soft_site = *def->site;
    a->soft_site.young *= SOFT;
    if (status >= 0 && def->is_repeated)
        status = om_body_create(def->scene, &a->soft_site, 1, &a->soft);
    if (status < 0) {
        om_ahead_destroy(a);
        return status;
    }
    *out = a;
    return OM_OK;
}

void om_ahead_destroy(OmAhead* a) {
    if (!a) return;
    om_view_destroy(a->attempt.view);
    om_free(a->attempt.lifted);
    om_free(a->now);
    om_free(a->released);
    om_free(a->adoption);
    om_body_destroy(a->soft);
    for (int k = 0; k < 2; ++k) om__trace_done(&a->trace[k]);
    om_free(a);
}

// ---- snapshots ----------------------------------------------------------------------------------------------

static OmStatus save(OmAhead* a, const Belief* belief) {
    if (belief->adoption && !a->adoption) {
        a->adoption = om_alloc(1, om_match_adoption_state_size(belief->adoption));
        if (!a->adoption) return OM_NO_MEMORY;
    }
    om_body_save(belief->twin, a->now);
    if (belief->adoption) om_match_adoption_save(belief->adoption, a->adoption);
    return OM_OK;
}

// After trials of nstep steps.
static void restore(OmAhead* a, Belief* belief, int nbad, int nstep) {
    om_body_restore(belief->twin, a->now);
    if (belief->adoption) om_match_adoption_restore(belief->adoption, a->adoption);
    a->count->nbad += om_body_nbad(belief->twin) - nbad;
    a->count->nstep += nstep;
    if (nstep > 0 && belief->host.on_pause) belief->host.on_pause(belief->host.ctx);
}

// The arms, a bit each, that hold tissue which the plan lets go.
static unsigned find_released(const OmPlanner* planner, const OmPlan* plan) {
    unsigned arms = om_planner_has_both_arms(planner) ? 0 : ~0u;
    for (int k = 0; k < plan->naction; ++k)
        if (plan->action[k].verb == OM_PLAN_RELEASE) arms |= 1u << plan->action[k].arm;
    return arms;
}

// From the present state: open the jaws of these arms and let the tissue fall.
static OmStatus release(OmAhead* a, Belief* belief, unsigned arms, int* nstep) {
    om_body_restore(belief->twin, a->now);
    if (belief->adoption) om_match_adoption_restore(belief->adoption, a->adoption);
    bool is_held = false,
         is_adopting = belief->adoption && om_match_adoption_is_active(belief->adoption);
    for (int k = 0; k < OM_MAX_ARM; ++k) {
        if (!(arms >> k & 1)) continue;
        is_held |= om_body_is_holding(belief->twin, k);
        om_body_release(belief->twin, k);
    }
    const double dt = belief->task->time_step;
    for (double t = 0; (is_held || is_adopting) && t < FALL_TIME; t += dt, ++*nstep) {
        OmBodyReport report;
        if (belief->adoption) OM_TRY(om_match_adoption_step(belief->adoption, belief->twin, dt));
        OmStatus status = om_body_step(belief->twin, dt, &report);
        if (status < 0) return status;
    }
    om_body_save(belief->twin, a->released);
    return OM_OK;
}

// ---- points -------------------------------------------------------------------------------------------------

static void prepare(OmAhead* a, const Belief* belief, AheadCount* count) {
    Attempt* t = &a->attempt;
    a->count = count;
    t->task = belief->task;
    t->grid = belief->grid;
    t->body = belief->twin;
    t->has_forces = om_engine_capabilities(om_body_engine(belief->twin)) & OM_ENGINE_FORCES;
    const double limit = om__force_limit(belief->task) / belief->record->force_factor;
    t->force_limit = belief->task->watch_force ? limit : HUGE_VAL;
    for (int k = 0; k < OM_MAX_ARM; ++k) t->q[k] = om__wrist_straight(&belief->act->arm[k]);
}

// The path of the last attempt, in the other twin: is the ROI exposed at its end, or after the last motion continues?
static OmStatus repeat(OmAhead* a, Belief* belief, int arm, int block, OmPlanVerb fold, int* nstep,
                       bool* exposes) {
    Attempt soft = a->attempt;
    OmVisibility v;
    double force;
    int nheld;
    soft.body = a->soft;
    *exposes = false;
    om_body_restore(a->soft, a->released);
    const OmVec3 p = om__grid_point(belief->grid, om_body_x(a->soft), block);
    OmStatus status = om_body_grasp(a->soft, arm, (OmPose){p, belief->grid->task.q},
                                    belief->task->grasp_radius, &nheld);
    if (status == OM_INVALID) return OM_OK;  // all tissue in reach is attached
    OM_TRY(status);
    for (int k = 0; k < a->trace[0].n; ++k)
        OM_TRY(om__attempt_step(&soft, arm, a->trace[0].tip[k], &force));
    *nstep += a->trace[0].n;
    OM_TRY(om_view_look(soft.view, om_body_x(a->soft), &v));
    *exposes = v.nseen >= belief->task->visibility * v.npoint;
    if (*exposes) return OM_OK;
    return om__attempt_continue(&soft, fold, arm, &a->trace[0], exposes, nstep);
}

static void set_exposure(Belief* belief, int block, bool exposes) {
    belief->exposure[block].exposes = exposes;
    belief->situation.exposure[block] = belief->exposure[block];
}

// The result of a point becomes a fact. False: the budget ended first, and nothing is known.
static OmStatus try_point(OmAhead* a, Belief* belief, int arm, int block, int* nstep,
                          bool* is_known) {
    AttemptResult r;
    a->attempt.max_step = a->def.max_step - *nstep;
    *is_known = false;
    if (a->attempt.max_step <= 0) return OM_OK;
    om_body_restore(belief->twin, a->released);
    OM_TRY(om__attempt_run(&a->attempt, arm, block, &r));
    *nstep += r.nstep;
    if (r.is_cut) return OM_OK;
    *is_known = true;
    const int most = (int)ceil(belief->task->max_height / belief->task->pull_step - 1e-9);
    int npull = r.npull < 1 ? 1 : r.npull > most ? most : r.npull;
    belief->exposure[block] = (OmExposure){true, r.exposes, npull, r.fold};
    set_exposure(belief, block, r.exposes);
    ++a->count->npoint;
    if (!r.exposes || !a->soft) return OM_OK;
    bool exposes;
    OM_TRY(repeat(a, belief, arm, block, r.fold, nstep, &exposes));
    if (!exposes) a->fragile[a->nfragile++] = block;
    set_exposure(belief, block, exposes);
    return OM_OK;
}

// Points that the other twin does not confirm hide the ROI, for this plan, if another point exposes it in both;
// otherwise they are the best that is known.
static void judge_fragile(OmAhead* a, Belief* belief, bool has_better) {
    for (int i = 0; i < a->nfragile; ++i) {
        const int b = a->fragile[i];
        if (has_better)
            belief->exposure[b].is_known = false;  // of the loop; the situation keeps it hidden
        else
            set_exposure(belief, b, true);
    }
}

static OmStatus try_points(OmAhead* a, Belief* belief, int* nstep) {
    bool is_released = false, is_known = true, has_better = false;
    unsigned released = 0;
    a->nfragile = 0;
    for (int k = 0; k < a->def.npoint && is_known; ++k) {
        OmPlan plan;
        OmStatus status = om_planner_solve(a->planner, &belief->situation, &plan);
        if (status < 0) return status;
        const int block = plan.grasp_block;
        if (status != OM_OK || block < 0 || belief->exposure[block].is_known) break;
        const unsigned arms = find_released(a->planner, &plan);
        if (!is_released || arms != released) OM_TRY(release(a, belief, arms, nstep));
        is_released = true;
        released = arms;
        OM_TRY(try_point(a, belief, plan.grasp_arm, block, nstep, &is_known));
        has_better |= is_known && belief->exposure[block].exposes;
    }
    judge_fragile(a, belief, has_better);
    return OM_OK;
}

OmStatus om__ahead_run(OmAhead* a, Belief* belief, OmPlanner* planner, AheadCount* count) {
    if (!a || belief->situation.is_visible) return OM_OK;
    const int nbad = om_body_nbad(belief->twin);
    int nstep = 0;
    prepare(a, belief, count);
    a->planner = planner;
    OM_TRY(save(a, belief));
    OmStatus status = try_points(a, belief, &nstep);
    restore(a, belief, nbad, nstep);
    return status;
}
