// defras_warn.c: the loop and its monitor: what a warning state makes it do (Alg. 5, 6.4.5 and 6.4.6).
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
#include "defras/defras_internal.h"
#include "defras/defras_updater.h"

#define STATE_3_TIME 1.0  // s of state 3 until a person is called
#define SETTLE_TIME 1.5   // s after a fold, until it is judged
#define MEASURE_REST 0.3  // s after an adoption until mu shows its effect
#define FALL_LIMIT 2.0  // s more, while mu is above its first limit: freed tissue of the twin falls
#define SEEN_CHANGE 0.02  // of the ROI
#define SEEN_REST 0.5     // s without such a change until the next action
#define LEARN_LIMIT 8.0   // s, longest wait for an estimate, its adoption, and a following

// ---- frames -------------------------------------------------------------------------------------------------

bool om__warn_is_due(const OmLoop* loop) {
    return loop->monitor && loop->tick > 0 &&
           om_monitor_is_due(loop->monitor, loop->clock_last + loop->task.time_step);
}

static bool is_holding(const OmLoop* loop) {
    return loop->arm[0].in_hand >= 0 || loop->arm[1].in_hand >= 0;
}

double om__warn_part(const OmLoop* loop) { return loop->frame.part - loop->part_rest; }

// The effect of the last update, once the twin has adopted it, or at once if it was refused.
static OmStatus measure_update(OmLoop* loop, bool is_last_chance) {
    const double late = loop->time - loop->effect_time;
    const bool is_far = loop->frame.mu > loop->monitor_settings.limit[0];
    if (!loop->has_effect_due) return OM_OK;
    OmRetractUpdate* u = &loop->result.update[loop->effect_update];
    const bool may_fall = !u->is_followed && loop->warning < 3;
    const bool is_falling = is_far && late < FALL_LIMIT && may_fall;
    if ((late < 0 || is_falling) && !is_last_chance) return OM_OK;
    if (is_far && !is_last_chance && !u->is_followed) {
        OM_TRY(om__follow_begin(loop, &u->is_followed));
        loop->effect_time = loop->time + OM_MATCH_ADOPT_TIME + MEASURE_REST;
        if (u->is_followed) return om__look_notify_follow(loop);
    }
    if (u->is_followed && loop->frame.mu > u->mu_before && !is_last_chance) {  // it is worse
        OM_TRY(om_body_set_force(loop->twin, NULL));
        if (u->stage == OM_UPDATE_FOLLOWED) u->stage = OM_UPDATE_REFUSED;
        u->is_followed = false;
    }
    if (!is_last_chance) loop->has_increment = false;  // otherwise it may be that of a newer one
    u->mu_after = loop->frame.mu;
    u->part_after = om__warn_part(loop);
    loop->has_effect_due = false;
    loop->warning_action = loop->warning;  // an older warning has been answered
    return OM_OK;
}

static int imax(int a, int b) { return a > b ? a : b; }

static bool is_fold(const OmLoop* loop) {
    const OmPlanVerb verb = loop->action.plan.verb;
    return verb == OM_PLAN_MOVE_ROI || verb == OM_PLAN_MOVE_AWAY;
}

// The state by a part of the tissue, in pulls. Tissue that is folded drags over the board, in the truth otherwise than
// in the twin.
static void judge_part(OmLoop* loop) {
    const OmPlanVerb verb = loop->action.plan.verb;
    const bool holds = is_holding(loop);
    if (!holds) loop->part_rest = loop->frame.part;
    loop->has_dragged = holds && (loop->has_dragged || is_fold(loop));
    const bool is_pull = holds && !loop->has_dragged && verb == OM_PLAN_PULL;
    loop->part_state = is_pull ? om_monitor_next_part_state(&loop->monitor_settings,
                                                            loop->part_state, om__warn_part(loop))
                               : 0;
}

// The state of the last frame while tissue is held.
static int state_now(OmLoop* loop) {
    const OmSceneMonitor* s = &loop->monitor_settings;
    const int state = loop->has_dragged
                          ? om_monitor_next_fold_state(s, loop->fold_state, loop->frame.mu)
                          : loop->frame.state;
    loop->fold_state = loop->has_dragged ? state : 0;
    return is_holding(loop) ? imax(state, loop->part_state) : 0;
}

static double limit_of_state_3(const OmLoop* loop) {
    const OmSceneMonitor* s = &loop->monitor_settings;
    return (loop->has_dragged ? s->fold_factor : 1) * s->limit[2];
}

static void set_warning(OmLoop* loop, int warning) {
    const int was = loop->warning;
    loop->warning = warning;
    for (int s = was + 1; s <= warning; ++s) ++loop->result.nwarning[s - 1];
    loop->warning_action = imax(warning, loop->warning_action);
    if (warning < 3) loop->is_overruled = false;
    if (warning < 3 || was < 3) loop->state3_begin = loop->time;
}

// A fold that is not judged yet: it moves, or what it exposes is verified.
static bool is_folding(const OmLoop* loop) {
    const Stage s = loop->stage;
    return loop->monitor_settings.is_fold_at_rest && is_fold(loop) &&
           (s == STAGE_ACTION || s == STAGE_SETTLE || s == STAGE_VERIFY);
}

OmStatus om__warn_frame(OmLoop* loop, const OmObservation* obs) {
    OmRetractResult* r = &loop->result;
    const int was = loop->warning;
    OM_TRY(om_monitor_frame(loop->monitor, obs, om_body_x(loop->twin), loop->has_grasped,
                            &loop->frame));
    if (loop->frame.is_stale)
        om__loop_alarm(loop, OM_HOLD_STALE, "the depth picture is %.2f s old", loop->frame.age);
    if (loop->max_age > 0 && loop->frame.is_blind && loop->frame.unseen > loop->max_age &&
        is_holding(loop))
        om__loop_alarm(loop, OM_HOLD_STALE,
                       "the depth camera has shown no tissue to compare with the twin for %.2f s",
                       loop->frame.unseen);
    judge_part(loop);
    loop->unsettled = state_now(loop);
    const bool is_early = is_folding(loop) && was == 0 && loop->unsettled == 1;
    set_warning(loop, is_early ? 0 : loop->unsettled);
    ++r->nmonitor;
    if (is_holding(loop)) r->mu_max = fmax(r->mu_max, loop->frame.mu);
    if (loop->warning == 3 && !loop->is_overruled &&
        loop->time - loop->state3_begin >= STATE_3_TIME)
        om__loop_alarm(loop, OM_HOLD_WARNING,
                       "the tissue is %.1f mm from where the twin expects it, and %.0f mm is the "
                       "limit: the twin does not describe this tissue",
                       1e3 * loop->frame.mu, 1e3 * limit_of_state_3(loop));
    OM_TRY(measure_update(loop, false));
    OM_TRY(om__modulus_frame(loop, obs));
    return was == loop->warning ? OM_OK : om__loop_notify_warning(loop, was);
}

OmStatus om__warn_end(OmLoop* loop) { return measure_update(loop, true); }

double om__warn_rate(const OmLoop* loop) { return loop->warning >= 1 ? 0.5 : 1.0; }

// ---- folds ----------------------------------------------------------------------------------------------------

// The outcome of a fold that exposes the ROI does not depend on what the twin shows.
bool om__warn_must_settle(const OmLoop* loop) {
    return loop->monitor && loop->stage == STAGE_ACTION && is_folding(loop) &&
           loop->unsettled > loop->warning && loop->visibility < loop->task.visibility;
}

void om__warn_begin_settling(OmLoop* loop) {
    loop->stage = STAGE_SETTLE;
    loop->settle_begin = loop->time;
}

OmStatus om__warn_settle(OmLoop* loop, bool* needs_tick) {
    const int was = loop->warning;
    *needs_tick = loop->unsettled > was && loop->time - loop->settle_begin < SETTLE_TIME;
    if (*needs_tick || loop->unsettled <= was) return OM_OK;
    set_warning(loop, loop->unsettled);
    return om__loop_notify_warning(loop, was);
}

bool om__warn_must_learn(const OmLoop* loop) {
    return loop->action.outcome == OM_ACTION_WARNED || (is_fold(loop) && loop->warning >= 2);
}

// ---- learning -------------------------------------------------------------------------------------------------

bool om__warn_stops(const OmLoop* loop) {
    const bool is_moving = is_fold(loop) || loop->action.plan.verb == OM_PLAN_PULL;
    return (loop->warning >= 2 || loop->has_followed) && is_moving && !loop->motion.is_easing;
}

OmStatus om__warn_note_update(OmLoop* loop, OmUpdateStage stage) {
    OmRetractResult* r = &loop->result;
    if (r->nupdate == 0) return OM_OK;
    r->update[r->nupdate - 1].is_followed = stage == OM_UPDATE_FOLLOWED;
    if (!loop->monitor) return OM_OK;
    OM_TRY(measure_update(loop, true));
    const bool has_effect = stage == OM_UPDATE_ADOPTED || stage == OM_UPDATE_FOLLOWED;
    loop->has_effect_due = true;
    loop->effect_update = r->nupdate - 1;
    loop->effect_time = loop->time + (has_effect ? OM_MATCH_ADOPT_TIME + MEASURE_REST : 0);
    return OM_OK;
}

void om__warn_begin_learning(OmLoop* loop) {
    loop->stage = STAGE_LEARN;
    loop->learn_begin = loop->time;
    loop->seen_last = loop->visibility;
    loop->seen_change = -HUGE_VAL;
}

// The ROI comes into view, or goes: the tissue still falls.
static bool is_view_changing(OmLoop* loop) {
    if (fabs(loop->visibility - loop->seen_last) > SEEN_CHANGE) {
        loop->seen_last = loop->visibility;
        loop->seen_change = loop->time;
    }
    return loop->time - loop->seen_change < SEEN_REST;
}

void om__warn_give_up(OmLoop* loop) {
    for (int a = 0; a < loop->narm; ++a) {
        ArmState* arm = &loop->arm[a];
        if (arm->in_hand < 0) continue;
        loop->tried[arm->in_hand] |= OM_TRIED_GRASP | OM_TRIED_MOVE_ROI | OM_TRIED_MOVE_AWAY;
        arm->is_max_force = true;
        loop->wants_plan = true;
    }
}

bool om__warn_is_learning(OmLoop* loop) {
    const OmUpdater* u = loop->updater;
    const bool has_time = loop->time - loop->learn_begin < LEARN_LIMIT;
    const bool is_busy = u && u->def.estimate && (u->job || u->is_due);
    if (loop->warning == 3 && !loop->is_overruled)
        return true;  // a person is called, or the state falls
    if (has_time && is_view_changing(loop)) return true;
    if (has_time &&
        (is_busy || om_match_adoption_is_active(loop->adoption) || loop->has_effect_due))
        return true;
    if (loop->warning >= 2) om__warn_give_up(loop);
    return false;
}
