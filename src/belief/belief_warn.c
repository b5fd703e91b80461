// belief_warn.c: the monitor's frames as evidence, and what the loop does with the decisions (6.4.5, 6.4.6; the tables
// of belief_decide.h).
//
// - A part of the tissue gives states 1 and 2, too (ours): 2 % of the points, still in the picture or the twin and
//   lifted in the other. The median of Alg. 5 notices little while most of a sheet lies still. Not in or after a fold.
// - The effect of an estimate on mu is measured once the twin has adopted it. An older warning is answered then.
//
// Rejected (figures in doc/notes/defras.md, "Warning states"):
// - quantiles of all distances or the median of moved points for the part: right and wrong beliefs overlap;
// - folds judged at rest, and with twice the limits: linear elements tipped over at another moment than the tissue;
// - a finer twin (8 mm), or the motion repeated in varied twins: right attachments still warned;
// - learning after force stops without a warning: estimates accepted by chance, 39 actions instead of 21.
#include "belief/belief_state.h"
#include "belief/belief_updater.h"

#define MEASURE_REST 0.3  // s after an adoption until mu shows its effect
#define FALL_LIMIT 2.0  // s more, while mu is above its first limit: freed tissue of the twin falls
#define SEEN_CHANGE 0.02  // of the ROI
#define SEEN_REST 0.5     // s without such a change until the next action

// ---- frames -------------------------------------------------------------------------------------------------

bool om__warn_is_due(const Belief* belief) {
    return belief->monitor && belief->act->tick > 0 &&
           om_monitor_is_due(belief->monitor, belief->clock_last + belief->task->time_step);
}

double om__warn_part(const Belief* belief) { return belief->frame.part - belief->warn.part_rest; }

// The effect of the last update, once the twin has adopted it, or at once if it was refused.
static void measure_update(Belief* belief, bool is_last_chance) {
    const double late = belief->act->time - belief->effect_time;
    const bool is_far = belief->frame.mu > belief->monitor_settings.limit[0];
    if (!belief->has_effect_due) return;
    OmRetractUpdate* u = &belief->record->update[belief->effect_update];
    const bool is_falling = is_far && late < FALL_LIMIT && belief->warn.state < 3;
    if ((late < 0 || is_falling) && !is_last_chance) return;
    u->mu_after = belief->frame.mu;
    u->part_after = om__warn_part(belief);
    belief->has_effect_due = false;
    belief->warning_action = belief->warn.state;  // an older warning has been answered
}

static void take_warning(Belief* belief, Warning next) {
    const int was = belief->warn.state;
    belief->warn = next;
    belief->act->warn_rate = om__warning_conduct(next, belief->act->time, false).rate;
    for (int s = was + 1; s <= next.state; ++s) ++belief->record->nwarning[s - 1];
    if (next.state > belief->warning_action) belief->warning_action = next.state;
}

static bool has_estimator(const Belief* belief) {
    return belief->updater && belief->updater->def.estimate;
}

bool om__warn_wants_estimate(const Belief* belief) {
    const bool is_asked = belief->updater->job || belief->has_effect_due;
    return !belief->monitor || (belief->warning_action > 0 && !is_asked);
}

static bool is_answering(const Belief* belief) {
    const bool is_busy = has_estimator(belief) && (belief->updater->job || belief->updater->is_due);
    return is_busy || belief->has_effect_due || om_match_adoption_is_active(belief->adoption);
}

// The arms stand, and an answer is awaited: a person may be called later.
static bool may_wait(const Belief* belief) {
    return belief->is_looking || (belief->is_learning && is_answering(belief));
}

static OmStatus tell_warning(const Belief* belief, int was) {
    if (was == belief->warn.state || !belief->host.on_warning) return OM_OK;
    return belief->host.on_warning(belief->host.ctx, was);
}

OmStatus om__warn_frame(Belief* belief, const OmObservation* obs) {
    OmBeliefRecord* r = belief->record;
    const int was = belief->warn.state;
    OM_TRY(om_monitor_frame(belief->monitor, obs, om_body_x(belief->twin),
                            om__act_is_holding(belief->act), &belief->frame));
    if (belief->frame.is_stale)
        om__belief_alarm(belief, OM_HOLD_STALE, "the depth picture is %.2f s old",
                         belief->frame.age);
    if (belief->max_age > 0 && belief->frame.is_blind && belief->frame.unseen > belief->max_age &&
        om__act_is_holding(belief->act))
        om__belief_alarm(belief, OM_HOLD_STALE,
                         "the depth camera has shown no tissue to compare with the twin for %.2f s",
                         belief->frame.unseen);
    const OmMonitorFrame* f = &belief->frame;
    const FrameEvidence evidence = {.time = belief->act->time,
                                    .part = f->part,
                                    .state = f->state,
                                    .holds = om__act_is_holding(belief->act),
                                    .verb = belief->act->action.plan.verb};
    take_warning(belief, om__warning_next(&belief->monitor_settings, belief->warn, &evidence));
    ++r->nmonitor;
    if (evidence.holds) r->mu_max = fmax(r->mu_max, f->mu);
    if (om__warning_conduct(belief->warn, belief->act->time, may_wait(belief)).calls_a_person)
        om__belief_alarm(belief, OM_HOLD_WARNING,
                         "the tissue is %.1f mm from where the twin expects it, and %.0f mm is the "
                         "limit: the twin does not describe this tissue",
                         1e3 * belief->frame.mu, 1e3 * belief->monitor_settings.limit[2]);
    measure_update(belief, false);
    return tell_warning(belief, was);
}

void om__warn_end(Belief* belief) { measure_update(belief, true); }

// ---- after an action ------------------------------------------------------------------------------------------

static bool is_lifted(const Belief* belief) {
    double lift = 0;
    if (!belief->updater) return false;
    for (int a = 0; a < OM_MAX_ARM; ++a)
        if (belief->act->arm[a].in_hand >= 0) lift = fmax(lift, belief->act->arm[a].lift);
    // a measured tip stops that far from its goal
    return lift >= belief->updater->def.settings.min_lift - 5e-4;
}

AfterStep om__warn_after(const Belief* belief, const OmPlanAction* next, AfterStep done) {
    const OmUpdater* u = belief->updater;
    const AfterEvidence e = {.verb = belief->act->action.plan.verb,
                             .outcome = belief->act->action.outcome,
                             .state = belief->warn.state,
                             .highest = belief->warning_action,
                             .has_monitor = belief->monitor != NULL,
                             .has_updater = u != NULL,
                             .has_estimator = has_estimator(belief),
                             .is_seen = belief->act->visibility >= belief->task->visibility,
                             .is_lifted = is_lifted(belief),
                             .is_answering = belief->has_effect_due || (u && u->job),
                             .is_due = u && u->is_due,
                             .has_dragged = belief->warn.has_dragged,
                             .continues = next && next->verb == OM_PLAN_PULL};
    return om__belief_after(&e, done);
}

// ---- learning -------------------------------------------------------------------------------------------------

bool om__warn_stops(const Belief* belief) {
    const bool is_moving =
        om__is_fold(belief->act->action.plan.verb) || belief->act->action.plan.verb == OM_PLAN_PULL;
    const bool stops = om__warning_conduct(belief->warn, belief->act->time, false).stops;
    return stops && is_moving && !belief->act->motion.is_easing;
}

void om__warn_note_update(Belief* belief, OmUpdateStage stage) {
    const OmBeliefRecord* r = belief->record;
    if (r->nupdate == 0 || !belief->monitor) return;
    measure_update(belief, true);
    belief->has_effect_due = om__act_is_holding(belief->act);  // tissue that was let go shows none
    belief->effect_update = r->nupdate - 1;
    belief->effect_time = belief->act->time;
    if (stage == OM_UPDATE_ADOPTED) belief->effect_time += OM_MATCH_ADOPT_TIME + MEASURE_REST;
}

void om__warn_begin_learning(Belief* belief) {
    belief->learn_begin = belief->act->time;
    belief->seen_last = belief->act->visibility;
    belief->seen_change = -HUGE_VAL;
}

// The ROI comes into view, or goes: the tissue still falls.
static bool is_view_changing(Belief* belief) {
    if (fabs(belief->act->visibility - belief->seen_last) > SEEN_CHANGE) {
        belief->seen_last = belief->act->visibility;
        belief->seen_change = belief->act->time;
    }
    return belief->act->time - belief->seen_change < SEEN_REST;
}

void om__warn_give_up(Belief* belief) {
    for (int a = 0; a < belief->act->narm; ++a) {
        ArmState* arm = &belief->act->arm[a];
        if (arm->in_hand < 0) continue;
        belief->tried[arm->in_hand] |= OM_TRIED_GRASP | OM_TRIED_MOVE_ROI | OM_TRIED_MOVE_AWAY;
        arm->is_max_force = true;
        belief->wants_plan = true;
    }
}

bool om__warn_is_learning(Belief* belief) {
    const bool is_stopped = om__warning_is_stopped(&belief->warn);
    const WaitEvidence e = {.state = belief->warn.state,
                            .is_stopped = is_stopped,
                            .waited = belief->act->time - belief->learn_begin,
                            .is_changing = !is_stopped && is_view_changing(belief),
                            .is_answering = is_answering(belief)};
    const WaitStep step = om__belief_wait(&e);
    if (step == WAIT_RELEASE) om__warn_give_up(belief);
    return step == WAIT_STAY;
}
