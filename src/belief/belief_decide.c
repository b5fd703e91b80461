// belief_decide.c: the tables of belief_decide.h.
#include "belief/belief_decide.h"

#include "act/act_state.h"

static int imax(int a, int b) { return a > b ? a : b; }

// ---- the state ------------------------------------------------------------------------------------------------

static Warning set_state(Warning w, int state, double time) {
    const int was = w.state;
    w.state = state;
    if (state < 3) w.is_overruled = false;
    if (state < 3 || was < 3) w.state3_begin = time;
    return w;
}

Warning om__warning_next(const OmSceneMonitor* s, Warning w, const FrameEvidence* e) {
    if (!e->holds) w.part_rest = e->part;
    // Tissue that is folded drags over the board, in the truth otherwise than in the twin.
    w.has_dragged = e->holds && (w.has_dragged || om__is_fold(e->verb));
    const bool is_pull = e->holds && !w.has_dragged && e->verb == OM_PLAN_PULL;
    w.part_state = is_pull ? om_monitor_next_part_state(s, w.part_state, e->part - w.part_rest) : 0;
    const int by_mu = w.has_dragged ? om_monitor_next_fold_state(s, w.fold_state, e->mu) : e->state;
    w.fold_state = w.has_dragged ? by_mu : 0;
    w.unsettled = e->holds ? imax(by_mu, w.part_state) : 0;
    const bool is_moving = s->is_fold_at_rest && om__is_fold(e->verb) && e->is_acting;
    return set_state(w, is_moving && w.state == 0 && w.unsettled == 1 ? 0 : w.unsettled, e->time);
}

Warning om__warning_settle(Warning w, double time) { return set_state(w, w.unsettled, time); }

Conduct om__warning_conduct(Warning w, double time) {
    return (Conduct){
        .rate = w.state >= 1 ? 0.5 : 1.0,
        .stops = w.state >= 2,
        .calls_a_person = om__warning_is_stopped(&w) && time - w.state3_begin >= STATE_3_TIME,
    };
}

// ---- after an action --------------------------------------------------------------------------------------------

// The outcome of a fold that exposes the ROI does not depend on what the twin shows.
static bool must_settle(const AfterEvidence* e) {
    return e->has_monitor && e->folds_rest && om__is_fold(e->verb) && e->unsettled > e->state &&
           !e->is_seen;
}

// An estimate under way answers a warning: its effect is awaited first.
static bool must_look(const AfterEvidence* e) {
    const bool is_moved = om__is_fold(e->verb) || e->verb == OM_PLAN_PULL;
    const bool waits_for_warnings = e->has_monitor && e->has_estimator;
    if (waits_for_warnings && (e->highest == 0 || e->is_answering)) return false;
    return e->has_updater && is_moved && e->is_lifted;
}

// A pull may run beside an estimate. A fold takes the tissue far from where the estimate saw it, and what follows the
// end of a plan, or a release, depends on what is learnt.
static bool must_learn(const AfterEvidence* e) {
    if (e->outcome == OM_ACTION_WARNED || (om__is_fold(e->verb) && e->state >= 2)) return true;
    return e->has_monitor && e->has_estimator && (e->is_answering || e->is_due) && !e->is_seen &&
           !e->continues;
}

AfterStep om__belief_after(const AfterEvidence* e, AfterStep done) {
    if (done < AFTER_SETTLE && must_settle(e)) return AFTER_SETTLE;
    if (done < AFTER_LOOK && must_look(e)) return AFTER_LOOK;
    if (done < AFTER_LEARN && must_learn(e)) return AFTER_LEARN;
    return AFTER_GO;
}

// ---- learning ---------------------------------------------------------------------------------------------------

WaitStep om__belief_wait(const WaitEvidence* e) {
    if (e->is_stopped) return WAIT_STAY;
    if (e->waited < LEARN_LIMIT && (e->is_changing || e->is_answering)) return WAIT_STAY;
    return e->state >= 2 ? WAIT_RELEASE : WAIT_GO;
}

Verdict om__belief_judge(const EstimateEvidence* e) {
    if (e->has_failed) return VERDICT_REFUSE;
    // A fold deviates for other reasons than attachments (belief_follow.c): an estimate must explain most of it.
    const bool is_doubtful =
        e->has_monitor && e->is_of_fold && e->has_shape && e->after_mean > CLEAR * e->before_mean;
    return !e->is_accepted || is_doubtful ? VERDICT_FOLLOW : VERDICT_ADOPT;
}
