// belief_warn.c: the monitor's frames as evidence, and what the loop does with the decisions (6.4.5, 6.4.6; the tables
// of belief_decide.h).
//
// - A part of the tissue gives states 1 and 2, too (ours): 2 % of the points, still in the picture or the twin and
//   lifted in the other. The median of Alg. 5 notices little while most of a sheet lies still. Not in or after a fold.
// - State 1 of a fold is judged at rest, after at most SETTLE_TIME, and folds have larger limits (ours): folded tissue
//   tips over at another moment than in the twin, whatever its attachments are.
// - The effect of an estimate on mu is measured once the twin has adopted it. An older warning is answered then.
//
// Rejected (figures in doc/notes/defras.md, "Warning states"):
// - quantiles of all distances or the median of moved points for the part: right and wrong beliefs overlap;
// - Alg. 5 alone in folds: all of six sheets with right attachments warned, now two;
// - all states of a fold at its end: two wrong beliefs pass 4 mm without learning and are held;
// - a finer twin (8 mm), or the motion repeated in varied twins: right attachments still warned;
// - learning after force stops without a warning: estimates accepted by chance, 39 actions instead of 21.
#include "belief/belief_state.h"
#include "belief/belief_updater.h"

#define SETTLE_TIME 1.5   // s after a fold, until it is judged
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
static OmStatus measure_update(Belief* belief, bool is_last_chance) {
    const double late = belief->act->time - belief->effect_time;
    const bool is_far = belief->frame.mu > belief->monitor_settings.limit[0];
    if (!belief->has_effect_due) return OM_OK;
    OmRetractUpdate* u = &belief->record->update[belief->effect_update];
    const bool may_fall = !u->is_followed && belief->warn.state < 3;
    const bool is_falling = is_far && late < FALL_LIMIT && may_fall;
    if ((late < 0 || is_falling) && !is_last_chance) return OM_OK;
    if (is_far && !is_last_chance && !u->is_followed) {
        OM_TRY(om__follow_begin(belief, &u->is_followed));
        belief->effect_time = belief->act->time + OM_MATCH_ADOPT_TIME + MEASURE_REST;
        if (u->is_followed) return om__look_notify_follow(belief);
    }
    if (u->is_followed && belief->frame.mu > u->mu_before && !is_last_chance) {  // it is worse
        OM_TRY(om_body_set_force(belief->twin, NULL));
        if (u->stage == OM_UPDATE_FOLLOWED) u->stage = OM_UPDATE_REFUSED;
        u->is_followed = false;
    }
    if (!is_last_chance) belief->has_increment = false;  // otherwise it may be that of a newer one
    u->mu_after = belief->frame.mu;
    u->part_after = om__warn_part(belief);
    belief->has_effect_due = false;
    belief->warning_action = belief->warn.state;  // an older warning has been answered
    return OM_OK;
}

static double limit_of_state_3(const Belief* belief) {
    const OmSceneMonitor* s = &belief->monitor_settings;
    return (belief->warn.has_dragged ? s->fold_factor : 1) * s->limit[2];
}

static void take_warning(Belief* belief, Warning next) {
    const int was = belief->warn.state;
    belief->warn = next;
    belief->act->warn_rate = om__warning_conduct(next, belief->act->time).rate;
    for (int s = was + 1; s <= next.state; ++s) ++belief->record->nwarning[s - 1];
    if (next.state > belief->warning_action) belief->warning_action = next.state;
}

static OmStatus tell_warning(const Belief* belief, int was) {
    if (was == belief->warn.state || !belief->host.on_warning) return OM_OK;
    return belief->host.on_warning(belief->host.ctx, was);
}

OmStatus om__warn_frame(Belief* belief, const OmObservation* obs) {
    OmBeliefRecord* r = belief->record;
    const int was = belief->warn.state;
    OM_TRY(om_monitor_frame(belief->monitor, obs, om_body_x(belief->twin), belief->has_grasped,
                            &belief->frame));
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
                                    .mu = f->mu,
                                    .part = f->part,
                                    .state = f->state,
                                    .holds = om__act_is_holding(belief->act),
                                    .verb = belief->act->action.plan.verb,
                                    .is_acting = belief->is_acting};
    take_warning(belief, om__warning_next(&belief->monitor_settings, belief->warn, &evidence));
    ++r->nmonitor;
    if (evidence.holds) r->mu_max = fmax(r->mu_max, f->mu);
    if (om__warning_conduct(belief->warn, belief->act->time).calls_a_person)
        om__belief_alarm(belief, OM_HOLD_WARNING,
                         "the tissue is %.1f mm from where the twin expects it, and %.0f mm is the "
                         "limit: the twin does not describe this tissue",
                         1e3 * belief->frame.mu, 1e3 * limit_of_state_3(belief));
    OM_TRY(measure_update(belief, false));
    return tell_warning(belief, was);
}

OmStatus om__warn_end(Belief* belief) { return measure_update(belief, true); }

// ---- after an action ------------------------------------------------------------------------------------------

static bool has_estimator(const Belief* belief) {
    return belief->updater && belief->updater->def.estimate;
}

static bool is_lifted(const Belief* belief) {
    double lift = 0;
    if (!belief->updater) return false;
    for (int a = 0; a < OM_MAX_ARM; ++a)
        if (belief->act->arm[a].in_hand >= 0) lift = fmax(lift, belief->act->arm[a].lift);
    // a measured tip stops that far from its goal
    return lift >= belief->updater->def.settings.min_lift - 5e-4;
}

AfterStep om__warn_after(const Belief* belief, bool continues, AfterStep done) {
    const OmUpdater* u = belief->updater;
    const AfterEvidence e = {.verb = belief->act->action.plan.verb,
                             .outcome = belief->act->action.outcome,
                             .state = belief->warn.state,
                             .unsettled = belief->warn.unsettled,
                             .highest = belief->warning_action,
                             .has_monitor = belief->monitor != NULL,
                             .has_updater = u != NULL,
                             .has_estimator = has_estimator(belief),
                             .folds_rest = belief->monitor_settings.is_fold_at_rest,
                             .is_seen = belief->act->visibility >= belief->task->visibility,
                             .is_lifted = is_lifted(belief),
                             .is_answering = belief->has_effect_due || (u && u->job),
                             .is_due = u && u->is_due,
                             .continues = continues};
    return om__belief_after(&e, done);
}

void om__warn_begin_settling(Belief* belief) { belief->settle_begin = belief->act->time; }

OmStatus om__warn_settle(Belief* belief, bool* needs_tick) {
    const int was = belief->warn.state;
    const double time = belief->act->time;
    *needs_tick = belief->warn.unsettled > was && time - belief->settle_begin < SETTLE_TIME;
    if (*needs_tick || belief->warn.unsettled <= was) return OM_OK;
    take_warning(belief, om__warning_settle(belief->warn, time));
    return tell_warning(belief, was);
}

// ---- learning -------------------------------------------------------------------------------------------------

bool om__warn_stops(const Belief* belief) {
    const bool is_moving =
        om__is_fold(belief->act->action.plan.verb) || belief->act->action.plan.verb == OM_PLAN_PULL;
    const bool stops = om__warning_conduct(belief->warn, belief->act->time).stops;
    return (stops || belief->has_followed) && is_moving && !belief->act->motion.is_easing;
}

OmStatus om__warn_note_update(Belief* belief, OmUpdateStage stage) {
    OmBeliefRecord* r = belief->record;
    if (r->nupdate == 0) return OM_OK;
    r->update[r->nupdate - 1].is_followed = stage == OM_UPDATE_FOLLOWED;
    if (!belief->monitor) return OM_OK;
    OM_TRY(measure_update(belief, true));
    const bool has_effect = stage == OM_UPDATE_ADOPTED || stage == OM_UPDATE_FOLLOWED;
    belief->has_effect_due = true;
    belief->effect_update = r->nupdate - 1;
    belief->effect_time = belief->act->time + (has_effect ? OM_MATCH_ADOPT_TIME + MEASURE_REST : 0);
    return OM_OK;
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
    const OmUpdater* u = belief->updater;
    const bool is_busy = has_estimator(belief) && (u->job || u->is_due);
    const bool is_stopped = om__warning_is_stopped(&belief->warn);
    const WaitEvidence e = {.state = belief->warn.state,
                            .is_stopped = is_stopped,
                            .waited = belief->act->time - belief->learn_begin,
                            .is_changing = !is_stopped && is_view_changing(belief),
                            .is_answering = is_busy ||
                                            om_match_adoption_is_active(belief->adoption) ||
                                            belief->has_effect_due};
    const WaitStep step = om__belief_wait(&e);
    if (step == WAIT_RELEASE) om__warn_give_up(belief);
    return step == WAIT_STAY;
}
