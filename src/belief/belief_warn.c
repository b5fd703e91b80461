// belief_warn.c: the loop and its monitor: what a warning state makes it do (Alg. 5, 6.4.5 and 6.4.6).
//
// state 1: held tissue moves at half its speed; an acquisition after the action; the estimate runs beside a pull that
//          follows, and is awaited before anything else
// state 2: motions stop; an acquisition; the arms keep still until the twin has adopted the estimate; a new plan
// state 3: motions stop; a person decides if the state lasts for STATE_3_TIME (a fold tips over within 0.6 s)
//
// - A part of the tissue gives states 1 and 2, too (ours): 2 % of the points, still in the picture or the twin and
//   lifted in the other. The median of Alg. 5 notices little while most of a sheet lies still. Not in or after a fold.
// - State 1 of a fold is judged at rest, after at most SETTLE_TIME, and folds have larger limits (ours): folded tissue
//   tips over at another moment than in the twin, whatever its attachments are.
// - An acquisition answers a warning of the present twin: none is taken while an estimate runs or its effect is
//   awaited.
// - A state counts while tissue is held. If the second limit is still exceeded after learning, or the estimate was
//   refused, the tissue is released. Before the next action the view of the ROI must rest.
//
// Rejected (figures in doc/notes/defras.md, "Warning states"):
// - quantiles of all distances or the median of moved points for the part: right and wrong beliefs overlap;
// - Alg. 5 alone in folds: all of six sheets with right attachments warned, now two;
// - all states of a fold at its end: two wrong beliefs pass 4 mm without learning and are held;
// - a finer twin (8 mm), or the motion repeated in varied twins: right attachments still warned;
// - learning after force stops without a warning: estimates accepted by chance, 39 actions instead of 21.
#include "belief/belief_state.h"
#include "belief/belief_updater.h"

#define STATE_3_TIME 1.0  // s of state 3 until a person is called
#define SETTLE_TIME 1.5   // s after a fold, until it is judged
#define MEASURE_REST 0.3  // s after an adoption until mu shows its effect
#define FALL_LIMIT 2.0  // s more, while mu is above its first limit: freed tissue of the twin falls
#define SEEN_CHANGE 0.02  // of the ROI
#define SEEN_REST 0.5     // s without such a change until the next action
#define LEARN_LIMIT 8.0   // s, longest wait for an estimate, its adoption, and a following

// ---- frames -------------------------------------------------------------------------------------------------

bool om__warn_is_due(const Belief* belief) {
    return belief->monitor && belief->act->tick > 0 &&
           om_monitor_is_due(belief->monitor, belief->clock_last + belief->task->time_step);
}

double om__warn_part(const Belief* belief) { return belief->frame.part - belief->part_rest; }

// The effect of the last update, once the twin has adopted it, or at once if it was refused.
static OmStatus measure_update(Belief* belief, bool is_last_chance) {
    const double late = belief->act->time - belief->effect_time;
    const bool is_far = belief->frame.mu > belief->monitor_settings.limit[0];
    if (!belief->has_effect_due) return OM_OK;
    OmRetractUpdate* u = &belief->record->update[belief->effect_update];
    const bool may_fall = !u->is_followed && belief->warning < 3;
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
    belief->warning_action = belief->warning;  // an older warning has been answered
    return OM_OK;
}

static int imax(int a, int b) { return a > b ? a : b; }

static bool is_fold(const Belief* belief) {
    const OmPlanVerb verb = belief->act->action.plan.verb;
    return verb == OM_PLAN_MOVE_ROI || verb == OM_PLAN_MOVE_AWAY;
}

// The state by a part of the tissue, in pulls. Tissue that is folded drags over the board, in the truth otherwise than
// in the twin.
static void judge_part(Belief* belief) {
    const OmPlanVerb verb = belief->act->action.plan.verb;
    const bool holds = om__act_is_holding(belief->act);
    if (!holds) belief->part_rest = belief->frame.part;
    belief->has_dragged = holds && (belief->has_dragged || is_fold(belief));
    const bool is_pull = holds && !belief->has_dragged && verb == OM_PLAN_PULL;
    belief->part_state = is_pull
                             ? om_monitor_next_part_state(&belief->monitor_settings,
                                                          belief->part_state, om__warn_part(belief))
                             : 0;
}

// The state of the last frame while tissue is held.
static int state_now(Belief* belief) {
    const OmSceneMonitor* s = &belief->monitor_settings;
    const int state = belief->has_dragged
                          ? om_monitor_next_fold_state(s, belief->fold_state, belief->frame.mu)
                          : belief->frame.state;
    belief->fold_state = belief->has_dragged ? state : 0;
    return om__act_is_holding(belief->act) ? imax(state, belief->part_state) : 0;
}

static double limit_of_state_3(const Belief* belief) {
    const OmSceneMonitor* s = &belief->monitor_settings;
    return (belief->has_dragged ? s->fold_factor : 1) * s->limit[2];
}

static OmStatus tell_warning(const Belief* belief, int was) {
    return belief->host.on_warning ? belief->host.on_warning(belief->host.ctx, was) : OM_OK;
}

static void set_warning(Belief* belief, int warning) {
    const int was = belief->warning;
    belief->warning = warning;
    belief->act->warn_rate = warning >= 1 ? 0.5 : 1.0;
    for (int s = was + 1; s <= warning; ++s) ++belief->record->nwarning[s - 1];
    belief->warning_action = imax(warning, belief->warning_action);
    if (warning < 3) belief->is_overruled = false;
    if (warning < 3 || was < 3) belief->state3_begin = belief->act->time;
}

// A fold that is not judged yet: it moves, or what it exposes is verified.
static bool is_folding(const Belief* belief) {
    return belief->monitor_settings.is_fold_at_rest && is_fold(belief) && belief->is_acting;
}

OmStatus om__warn_frame(Belief* belief, const OmObservation* obs) {
    OmBeliefRecord* r = belief->record;
    const int was = belief->warning;
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
    judge_part(belief);
    belief->unsettled = state_now(belief);
    const bool is_early = is_folding(belief) && was == 0 && belief->unsettled == 1;
    set_warning(belief, is_early ? 0 : belief->unsettled);
    ++r->nmonitor;
    if (om__act_is_holding(belief->act)) r->mu_max = fmax(r->mu_max, belief->frame.mu);
    if (belief->warning == 3 && !belief->is_overruled &&
        belief->act->time - belief->state3_begin >= STATE_3_TIME)
        om__belief_alarm(belief, OM_HOLD_WARNING,
                         "the tissue is %.1f mm from where the twin expects it, and %.0f mm is the "
                         "limit: the twin does not describe this tissue",
                         1e3 * belief->frame.mu, 1e3 * limit_of_state_3(belief));
    OM_TRY(measure_update(belief, false));
    OM_TRY(om__modulus_frame(belief, obs));
    return was == belief->warning ? OM_OK : tell_warning(belief, was);
}

OmStatus om__warn_end(Belief* belief) { return measure_update(belief, true); }

// ---- folds ----------------------------------------------------------------------------------------------------

// The outcome of a fold that exposes the ROI does not depend on what the twin shows.
bool om__warn_must_settle(const Belief* belief) {
    return belief->monitor && belief->monitor_settings.is_fold_at_rest && is_fold(belief) &&
           belief->unsettled > belief->warning &&
           belief->act->visibility < belief->task->visibility;
}

void om__warn_begin_settling(Belief* belief) { belief->settle_begin = belief->act->time; }

OmStatus om__warn_settle(Belief* belief, bool* needs_tick) {
    const int was = belief->warning;
    *needs_tick = belief->unsettled > was && belief->act->time - belief->settle_begin < SETTLE_TIME;
    if (*needs_tick || belief->unsettled <= was) return OM_OK;
    set_warning(belief, belief->unsettled);
    return tell_warning(belief, was);
}

bool om__warn_must_learn(const Belief* belief) {
    return belief->act->action.outcome == OM_ACTION_WARNED ||
           (is_fold(belief) && belief->warning >= 2);
}

// ---- learning -------------------------------------------------------------------------------------------------

bool om__warn_stops(const Belief* belief) {
    const bool is_moving = is_fold(belief) || belief->act->action.plan.verb == OM_PLAN_PULL;
    return (belief->warning >= 2 || belief->has_followed) && is_moving &&
           !belief->act->motion.is_easing;
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
    const bool has_time = belief->act->time - belief->learn_begin < LEARN_LIMIT;
    const bool is_busy = u && u->def.estimate && (u->job || u->is_due);
    if (belief->warning == 3 && !belief->is_overruled)
        return true;  // a person is called, or the state falls
    if (has_time && is_view_changing(belief)) return true;
    if (has_time &&
        (is_busy || om_match_adoption_is_active(belief->adoption) || belief->has_effect_due))
        return true;
    if (belief->warning >= 2) om__warn_give_up(belief);
    return false;
}
