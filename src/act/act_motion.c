// act_motion.c: one straight motion of a tip, one tick at a time, with the force watched (check_failure).
//
// A motion that holds tissue slows down from SLOW_FROM of the force limit on (the threshold less the margin), to
// SLOW_RATE at the limit; above it the tip almost stops (om__force_rate). It is commanded again when its speed
// changes. If the force stays above the limit for SLOW_TIME, the arm moves back until the force is below the limit,
// and a new plan is made. At a quarter of the speed above the limit, and at full speed up to it, the force passed the
// limit by 8 to 30 %.
//
// A motion stops when the visibility exceeds the wanted visibility by a margin, or when it falls after it was above the
// wanted visibility.
//
// An arm that does not follow is found by distance: the path commanded so far less the way made. A bound on time alone
// would be reached by slow motions near the force limit, too.
//
// Reaches and pulls may follow a motion law (OmMotionLaw): the arm is sent to the law's places one after the other. A
// motion that turns the wrist is straight, since the turn was chosen for the straight way.
#include <math.h>

#include "act/act_state.h"

#define RATE_STEP 0.125   // the rate changes in steps of this size
#define STILL_RATE 0.02   // fraction of the nominal speed above the limit
#define FOLLOW_LAG 0.015  // m, that an arm may be behind its command
#define DROP 0.01         // fall of the visibility that shows that its maximum is passed

OmStatus om__check_watch(const OmSceneTask* task, const OmTissueEngine* engine) {
    OM_CHECK(!task->watch_force || om_engine_capabilities(engine) & OM_ENGINE_FORCES, OM_INVALID,
             "task: the twin's engine \"%s\" has no forces in newtons, so the arms cannot stop at "
             "force_threshold; say watch_force: false to run without a force limit, or choose an "
             "engine with forces (fem, xpbd, springs)",
             engine->name);
    return OM_OK;
}

double om__force_rate(double force, double limit) {
    double slowing = fmax(0, (force / limit - SLOW_FROM) / (1 - SLOW_FROM));
    double rate = 1 - RATE_STEP * ceil((1 - SLOW_RATE) * fmin(slowing, 1) / RATE_STEP);
    return force > limit ? STILL_RATE : rate;
}

bool om__watch_stop(Watch* w, double visibility) {
    w->best = fmax(w->best, visibility);
    if (visibility < w->wanted) return false;
    return visibility >= fmin(1.0, w->wanted + w->margin) || visibility < w->best - DROP;
}

OmActionOutcome om__motion_outcome(Watch* watch, double visibility, double force, double limit,
                                   double over) {
    const bool is_seen = om__watch_stop(watch, visibility);
    if (force > limit && (force > OVER_FACTOR * limit || over > SLOW_TIME)) return OM_ACTION_FORCE;
    return is_seen ? OM_ACTION_EXPOSED : OM_ACTION_DONE;
}

static bool has_law(const Act* act) {
    const OmPlanAction* plan = &act->action.plan;
    bool is_known = plan->verb == OM_PLAN_REACH || plan->verb == OM_PLAN_PULL;
    return act->law.next && is_known && act->motion.arm == plan->arm;
}

// Where the arm is sent next: the goal, or the law's place.
static OmStatus aim(Act* act) {
    Motion* m = &act->motion;
    om__wrist_choose(act);
    m->last = act->arm[m->arm].tip;
    m->place = m->goal;
    if (has_law(act)) {  // the arm follows its command on each way by itself
        m->start = m->last;
        m->elapsed = 0;
    }
    if (m->turn > 0 || isfinite(m->turn_rate) || m->nplace >= OM_LAW_MOST) m->nplace = -1;
    if (m->nplace < 0) return OM_OK;
    const OmLoopMotion now = {m->arm, act->action.plan.verb, m->last, m->goal, m->nplace};
    OmVec3 place = m->goal;
    OM_TRY(act->law.next(act->law.ctx, &now, &place));
    if (om_distance(place, m->goal) < 1e-9) {  // the rest is straight
        m->nplace = -1;
        return OM_OK;
    }
    OM_CHECK(om_distance(place, m->last) <= OM_LAW_STEP, OM_INVALID,
             "the motion law gives a place %g mm from the tip; at most %g mm",
             1e3 * om_distance(place, m->last), 1e3 * OM_LAW_STEP);
    m->place = place;
    ++m->nplace;
    return OM_OK;
}

// Command the motion if its rate has changed. A goal out of reach ends the motion.
static OmStatus command(Act* act, bool* is_done) {
    Motion* m = &act->motion;
    double rate = act->person_rate * (m->is_holding ? act->rate * act->warn_rate : 1.0);
    *is_done = false;
    if (rate == m->commanded) return OM_OK;
    if (m->commanded < 0) OM_TRY(aim(act));
    OmPose goal = om__goal_pose(act, m->arm, m->place);
    if (act->arm[m->arm].is_turned) goal.q = m->q;
    OmStatus status = OM_OK;
    if (m->commanded < 0 && !om__is_apart(act, m->arm, goal))
        status = om_error(OM_INVALID, "PSM%d would come too near to the other tool", m->arm + 1);
    else
        status = om_world_move(act->world, m->arm, goal, rate * act->task->speed);
    if (status == OM_INVALID && m->nplace >= 0) {  // the law's place is out of reach
        m->nplace = -1;
        m->commanded = -1;
        return command(act, is_done);
    }
    if (status == OM_INVALID) {
        om_log(OM_LOG_INFO, "%s", om_error_message());
        om_world_stop(act->world, m->arm);
        m->outcome = OM_ACTION_UNREACHED;
        *is_done = true;
        return OM_OK;
    }
    if (status < 0) return status;
    m->commanded = rate;
    act->action.turn = fmax(act->action.turn, m->turn);
    return OM_OK;
}

OmStatus om__motion_begin(Act* act, int arm, OmVec3 goal, bool is_holding, bool* is_done) {
    const ArmState* state = &act->arm[arm];
    act->over_time = 0;
    act->motion = (Motion){.arm = arm,
                           .goal = goal,
                           .from = state->tip,
                           .start = state->tip,
                           .is_holding = is_holding,
                           .may_turn = !om__is_fold(act->action.plan.verb) || act->action.may_turn,
                           .commanded = -1,
                           .watch = {act->task->visibility, act->margin, act->visibility},
                           .outcome = OM_ACTION_DONE};
    act->motion.nplace = has_law(act) ? 0 : -1;
    bool is_pull = goal.x == state->tip.x && goal.y == state->tip.y;
    if (is_holding && is_pull) act->motion.from.z = state->grasp_tip.z;
    return command(act, is_done);
}

// After a force stop: back along the path, a pull down to the height of its grasp.
static OmStatus command_easing(Act* act, bool* is_done) {
    Motion* m = &act->motion;
    m->is_easing = true;
    m->ease_begin = act->time;
    OmStatus status = om_world_move(act->world, m->arm, om__goal_pose(act, m->arm, m->from),
                                    act->person_rate * SLOW_RATE * act->task->speed);
    *is_done = status == OM_INVALID;  // out of reach: the arm keeps its place
    return *is_done ? OM_OK : status;
}

OmStatus om__motion_resume(Act* act) {
    bool is_done;
    Motion* m = &act->motion;
    act->effort->path += om_distance(m->last, act->arm[m->arm].tip);
    m->commanded = -1;
    return m->is_easing ? command_easing(act, &is_done) : command(act, &is_done);
}

static bool check_easing(Act* act) {
    const Motion* m = &act->motion;
    double limit = EASE * om__force_limit(act->task);
    if (act->arm[m->arm].is_moving && act->force[m->arm] > limit &&
        act->time - m->ease_begin < MOTION_TIME)
        return false;
    om_world_stop(act->world, m->arm);
    return true;
}

static void check_follow(const Act* act) {
    const Motion* m = &act->motion;
    const double expected = m->elapsed * act->task->speed;
    const double made = om_distance(act->arm[m->arm].tip, m->start);
    if (expected - made > FOLLOW_LAG && act->host.on_lag)
        act->host.on_lag(act->host.ctx, m->arm, expected - made);
}

OmStatus om__motion_check(Act* act, bool* is_done) {
    Motion* m = &act->motion;
    ArmState* state = &act->arm[m->arm];
    if (m->is_easing) {
        *is_done = check_easing(act);
        return OM_OK;
    }
    if (m->is_holding) {
        const double limit = act->task->watch_force ? om__force_limit(act->task) : (double)INFINITY;
        const OmActionOutcome outcome = om__motion_outcome(
            &m->watch, act->visibility, act->force[m->arm], limit, act->over_time);
        if (outcome != OM_ACTION_DONE) m->outcome = outcome;  // else a goal may be out of reach
        state->is_max_force = state->is_max_force || outcome == OM_ACTION_FORCE;
    }
    *is_done = m->outcome != OM_ACTION_DONE || !state->is_moving;
    if (*is_done) act->effort->path += om_distance(m->last, state->tip);
    if (*is_done && m->outcome == OM_ACTION_DONE && m->nplace >= 0) {  // at a place of the law
        m->commanded = -1;
        return command(act, is_done);
    }
    if (m->outcome != OM_ACTION_DONE) {
        om_world_stop(act->world, m->arm);
        return m->outcome == OM_ACTION_FORCE ? command_easing(act, is_done) : OM_OK;
    }
    if (*is_done) return OM_OK;
    m->elapsed += fmin(m->commanded, m->turn_rate) * act->task->time_step;
    check_follow(act);
    OM_CHECK(m->elapsed < MOTION_TIME, OM_INVALID, "PSM%d did not reach its goal in %g s",
             m->arm + 1, MOTION_TIME);
    return command(act, is_done);
}
