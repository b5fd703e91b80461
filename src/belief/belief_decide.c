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
    return set_state(w, e->holds ? imax(e->state, w.part_state) : 0, e->time);
}

Conduct om__warning_conduct(Warning w, double time, bool may_wait) {
    const double most = may_wait ? LEARN_LIMIT : STATE_3_TIME;
    return (Conduct){
        .rate = w.state >= 1 ? 0.5 : 1.0,
        .stops = w.state >= 2,
        .calls_a_person = om__warning_is_stopped(&w) && time - w.state3_begin >= most,
    };
}

// ---- after an action --------------------------------------------------------------------------------------------

// An estimate under way answers a warning: its effect is awaited first. A look at the end of each lift is evidence for
// later: folded tissue may lie in several ways with the same attachments, and friction tells which.
static bool must_look(const AfterEvidence* e) {
    const bool is_pull = e->verb == OM_PLAN_PULL, is_moved = is_pull || om__is_fold(e->verb);
    if (!e->has_updater || !is_moved || !e->is_lifted) return false;
    if (!e->has_monitor || !e->has_estimator) return true;
    if (e->highest > 0 && !e->is_answering) return true;
    return is_pull && !e->has_dragged && !e->continues && !e->is_seen;
}

// What follows depends on what is learnt: the next pull, too, for an estimate may attach what is in hand.
static bool must_learn(const AfterEvidence* e) {
    if (e->outcome == OM_ACTION_WARNED || (om__is_fold(e->verb) && e->state >= 2)) return true;
    return e->has_monitor && e->has_estimator && (e->is_answering || e->is_due) && !e->is_seen;
}

AfterStep om__belief_after(const AfterEvidence* e, AfterStep done) {
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
