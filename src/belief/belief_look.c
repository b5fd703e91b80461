// belief_look.c: the loop and its updater: acquisitions after actions, estimates started, adopted or refused.
//
// After an action that moved held tissue the arms keep still until the tissue rests (OmSceneUpdate.rest), and an
// acquisition is taken from a picture exposed at the end of this time; without an estimator, at once from the newest
// picture. With a monitor the arms wait for the estimate (belief_decide.h), else it runs beside the next actions. In
// the tick of its adoption the twin takes the new attachments; if they change the blocks that may be grasped, the loop
// makes a new plan after the current action. An arm that reaches for a block that is now attached stops at once.
#include <math.h>
#include <string.h>

#include "base/base_grow.h"
#include "belief/belief_state.h"
#include "belief/belief_updater.h"

#define LOOK_LIMIT 1.5  // s, longest wait for a picture beyond the rest

// ---- acquisitions ---------------------------------------------------------------------------------------

static OmUpdateEvent make_event(const Belief* belief, OmUpdateStage stage, int index) {
    return (OmUpdateEvent){.stage = stage,
                           .index = index,
                           .tick = belief->act->tick,
                           .time = belief->act->time,
                           .reason = ""};
}

// Attachments of the twin. While it adopts an estimate a spring that fades is none.
static OmStatus copy_attached(const Belief* belief, unsigned char** attached) {
    size_t n = (size_t)om_body_site(belief->twin)->mesh.nvert;
    OM_ALLOC(*attached, n);
    memcpy(*attached, om_body_attached(belief->twin), n);
    om_match_adoption_get_goal(belief->adoption, *attached);
    return OM_OK;
}

static OmStatus take(const Belief* belief, const OmObservation* obs) {
    OmPose tip[OM_MAX_ARM];
    unsigned char* attached;
    for (int a = 0; a < OM_MAX_ARM; ++a) tip[a] = om__twin_pose(belief->act, a, obs->arm[a].tip);
    OM_TRY(copy_attached(belief, &attached));
    OmStatus status =
        om__updater_take(belief->updater, obs, belief->act->time, tip, belief->twin, attached,
                         belief->warn.has_dragged, om__warn_wants_estimate(belief));
    om_free(attached);
    return status;
}

OmStatus om__look_take(Belief* belief, bool* needs_tick) {
    OmUpdater* u = belief->updater;
    const double rest = u->def.estimate ? u->def.settings.rest : 0;
    const double waited = belief->act->time - belief->look_begin,
                 tick = 0.5 * belief->task->time_step;
    *needs_tick = waited < rest - tick;
    if (*needs_tick) return OM_OK;
    OmObservation obs = {0};
    unsigned color = om_world_sources(belief->world) & OM_OBSERVE_COLOR;
    OM_TRY(om_world_observe(belief->world, OM_OBSERVE_DEPTH | color, &obs));
    const double seen = obs.rgbd.time - belief->time_origin - belief->look_begin;
    const bool is_good = !u->def.estimate || seen >= rest - tick;
    *needs_tick = !is_good && waited < rest + LOOK_LIMIT;
    OmStatus status = OM_OK;
    if (is_good) status = take(belief, &obs);
    om_observation_done(&obs);
    if (status < 0) return om_error_prefix(status, "acquisition at %.2f s", belief->act->time);
    belief->record->nacquisition = u->ntaken;
    if (!is_good) return OM_OK;  // without a picture of the rest: no acquisition
    OmUpdateEvent event = make_event(belief, OM_UPDATE_TAKEN, u->ntaken - 1);
    event.acquisition = &u->kept[u->nkept - 1]->data;
    return om__belief_tell(belief, &event);
}

void om__look_note_grasp(Belief* belief, int arm, OmPose pose_world_tip) {
    if (!belief->updater) return;
    om__updater_grasp(belief->updater, arm, pose_world_tip, belief->task->grasp_radius,
                      belief->twin);
}

OmStatus om__look_note_release(Belief* belief, int arm) {
    int nhold = 0;
    for (int a = 0; a < belief->act->narm; ++a) nhold += belief->act->arm[a].in_hand >= 0;
    if (nhold <= 1) om__warn_end(belief);  // of the last update, while tissue is held
    if (belief->updater) om__updater_release(belief->updater, arm);
    return OM_OK;
}

// ---- estimates ------------------------------------------------------------------------------------------

static int count(const unsigned char* attached, int n) {
    int sum = 0;
    for (int v = 0; v < n; ++v) sum += attached[v] != 0;
    return sum;
}

static OmStatus begin_record(Belief* belief) {
    const OmUpdater* u = belief->updater;
    OmBeliefRecord* r = belief->record;
    unsigned char* attached;
    OM_GROW(r->update, r->nupdate, belief->update_capacity, 16);
    OM_TRY(copy_attached(belief, &attached));
    r->update[r->nupdate++] =
        (OmRetractUpdate){.stage = OM_UPDATE_STARTED,
                          .nacquisition = u->nkept,
                          .start_tick = belief->act->tick,
                          .end_tick = -1,
                          .start = belief->act->time,
                          .mu_before = belief->monitor ? belief->frame.mu : (double)NAN,
                          .mu_after = NAN,
                          .part_before = belief->monitor ? om__warn_part(belief) : (double)NAN,
                          .part_after = NAN,
                          .nattached_before = count(attached, u->nvert)};
    om_free(attached);
    return OM_OK;
}

static OmStatus start_estimate(Belief* belief) {
    OmUpdater* u = belief->updater;
    OM_TRY(begin_record(belief));
    OM_TRY(om__updater_start(u, belief->act->tick, belief->act->time));
    OmUpdateEvent event = make_event(belief, OM_UPDATE_STARTED, u->nestimate - 1);
    event.nacquisition = u->ngiven;
    return om__belief_tell(belief, &event);
}

// Complete the record of the last estimate, and tell the listeners.
static OmStatus end_record(Belief* belief, OmUpdateStage stage, const char* reason,
                           const unsigned char* was_attached) {
    const OmUpdater* u = belief->updater;
    const OmMatchEstimate* e = &u->estimate;
    OmRetractUpdate* r = &belief->record->update[belief->record->nupdate - 1];
    r->stage = stage;
    if (stage != OM_UPDATE_CANCELLED) om__warn_note_update(belief, stage);
    r->end_tick = stage == OM_UPDATE_CANCELLED ? -1 : belief->act->tick;
    r->end = belief->act->time;
    r->nattached_after = stage == OM_UPDATE_ADOPTED ? 0 : r->nattached_before;
    for (int v = 0; stage == OM_UPDATE_ADOPTED && v < e->nvert; ++v)
        r->nattached_after += e->attached[v] != 0;
    r->seen_share = e->seen_share;
    r->before_median = e->before_median, r->after_median = e->after_median;
    r->estimate_ms = stage == OM_UPDATE_CANCELLED ? (double)NAN : 1e3 * u->wall;
    snprintf(r->reason, sizeof r->reason, "%s", reason);
    OmUpdateEvent event = make_event(belief, stage, u->nestimate - 1);
    event.nacquisition = r->nacquisition;
    event.estimate = e->nvert > 0 ? e : NULL;
    event.reason = r->reason;
    event.was_attached = was_attached;
    return om__belief_tell(belief, &event);
}

static OmStatus check_estimate(const OmUpdater* u) {
    const OmMatchEstimate* e = &u->estimate;
    OM_CHECK(e->nvert == u->nvert && e->attached && e->stiffness, OM_INVALID,
             "the estimate has %d vertices, the twin has %d", e->nvert, u->nvert);
    return OM_OK;
}

static OmStatus adopt(Belief* belief) {
    OmUpdater* u = belief->updater;
    OmStatus status = OM_OK;
    unsigned char* was = NULL;
    OM_TRY_DONE(copy_attached(belief, &was));
    OM_TRY_DONE(om_match_adoption_begin(belief->adoption, belief->twin, u->estimate.attached,
                                        u->estimate.stiffness, OM_MATCH_ADOPT_TIME));
    om__updater_refresh(u);
    om__doubt_note(belief, u->estimate.attached, u->estimate.probability);
    om__belief_forget_exposure(belief);
    om__force_reset(belief);
    OM_TRY_DONE(end_record(belief, OM_UPDATE_ADOPTED, "", was));
done:
    om_free(was);
    return status;
}

// What a ripe estimate, or an error in its place, leads to.
static OmStatus judge(Belief* belief, bool has_failed) {
    const OmMatchEstimate* e = &belief->updater->estimate;
    if (!has_failed && e->is_accepted) return adopt(belief);
    return end_record(belief, OM_UPDATE_REFUSED, has_failed ? om_error_message() : e->reason, NULL);
}

static OmStatus end_estimate(Belief* belief) {
    OmUpdater* u = belief->updater;
    OmStatus status = om__updater_join(u);
    if (status == OM_OK && u->estimate.is_accepted) status = check_estimate(u);
    if (status == OM_NO_MEMORY) {
        om__updater_drop(u);
        return status;
    }
    belief->nfailed = status == OM_OK ? 0 : belief->nfailed + 1;
    if (belief->nfailed >= OM_LOOP_MAX_FAILED)
        om__belief_alarm(belief, OM_HOLD_UPDATE,
                         "%d estimates in a row failed, the last because %.120s", belief->nfailed,
                         om_error_message());
    status = judge(belief, status != OM_OK);
    om__updater_drop(u);
    return status;
}

OmStatus om__look_check(Belief* belief) {
    OmUpdater* u = belief->updater;
    if (!u || !u->def.estimate) return OM_OK;
    if (om__updater_is_ripe(u, belief->act->tick, belief->task->time_step))
        OM_TRY(end_estimate(belief));
    return OM_OK;
}

OmStatus om__look_start(Belief* belief) {
    OmUpdater* u = belief->updater;
    if (!u || !u->def.estimate || u->job || !u->is_due) return OM_OK;
    return start_estimate(belief);
}

OmStatus om__look_end(Belief* belief) {
    OmUpdater* u = belief->updater;
    if (!u || !u->job) return OM_OK;
    om__updater_cancel(u);
    return end_record(belief, OM_UPDATE_CANCELLED, "", NULL);
}

// The springs of freed vertices fade while the twin adopts an estimate: their blocks become free at the end of it.
bool om__look_is_outdated(const Belief* belief) {
    if (!belief->is_corrected) return false;
    for (int b = 0; b < belief->grid->n * belief->grid->n; ++b)
        if (om__grid_is_fixed(belief->grid, belief->twin, b) != belief->situation.is_fixed[b])
            return true;
    return false;
}

bool om__look_stops_reach(const Belief* belief) {
    const OmPlanAction* p = &belief->act->action.plan;
    return belief->is_corrected && p->verb == OM_PLAN_REACH &&
           !belief->situation.is_fixed[p->block] &&
           om__grid_is_fixed(belief->grid, belief->twin, p->block);
}
