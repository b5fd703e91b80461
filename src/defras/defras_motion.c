// defras_motion.c: one straight motion of a tip, one tick at a time, with the force watched (check_failure).
//
// A motion that holds tissue slows down near the force limit (defras_step.c) and is commanded again when its speed
// changes. If the force stays above the limit for SLOW_TIME, the arm moves back until the force is below the limit,
// and a new plan is made. At a quarter of the speed above the limit, and at full speed up to it, the force passed the
// limit by 8 to 30 %.
//
// A motion stops when the visibility exceeds the wanted visibility by a margin, or when it falls after it was above the
// wanted visibility.
//
// Reaches and pulls may follow a motion law (OmMotionLaw): the arm is sent to the law's places one after the other. A
// motion that turns the wrist is straight, since the turn was chosen for the straight way.
#include <math.h>

#include "defras/defras_internal.h"

#define DROP 0.01  // fall of the visibility that shows that its maximum is passed

bool om__watch_stop(Watch* w, double visibility) {
    w->best = fmax(w->best, visibility);
    if (visibility < w->wanted) return false;
    return visibility >= fmin(1.0, w->wanted + w->margin) || visibility < w->best - DROP;
}

static bool must_stop_for_force(const OmLoop* loop, int arm) {
    if (!loop->task.watch_force) return false;
    double limit = om__force_limit(&loop->task);
    if (loop->force[arm] <= limit) return false;
    return loop->force[arm] > OVER_FACTOR * limit || loop->over_time > SLOW_TIME;
}

static bool has_law(const OmLoop* loop) {
    const OmPlanAction* plan = &loop->action.plan;
    bool is_known = plan->verb == OM_PLAN_REACH || plan->verb == OM_PLAN_PULL;
    return loop->law.next && is_known && loop->motion.arm == plan->arm;
}

// Where the arm is sent next: the goal, or the law's place.
static OmStatus aim(OmLoop* loop) {
    Motion* m = &loop->motion;
    om__wrist_choose(loop);
    m->last = loop->arm[m->arm].tip;
    m->place = m->goal;
    if (has_law(loop)) {  // the arm follows its command on each way by itself
        m->start = m->last;
        m->elapsed = 0;
    }
    if (m->turn > 0 || isfinite(m->turn_rate) || m->nplace >= OM_LAW_MOST) m->nplace = -1;
    if (m->nplace < 0) return OM_OK;
    const OmLoopMotion now = {m->arm, loop->action.plan.verb, m->last, m->goal, m->nplace};
    OmVec3 place = m->goal;
    OM_TRY(loop->law.next(loop->law.ctx, &now, &place));
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
static OmStatus command(OmLoop* loop, bool* is_done) {
    Motion* m = &loop->motion;
    double rate = loop->person_rate * (m->is_holding ? loop->rate * om__warn_rate(loop) : 1.0);
    *is_done = false;
    if (rate == m->commanded) return OM_OK;
    if (m->commanded < 0) OM_TRY(aim(loop));
    OmPose goal = om__goal_pose(loop, m->arm, m->place);
    if (loop->arm[m->arm].is_turned) goal.q = m->q;
    OmStatus status = OM_OK;
    if (m->commanded < 0 && !om__is_apart(loop, m->arm, goal))
        status = om_error(OM_INVALID, "PSM%d would come too near to the other tool", m->arm + 1);
    else
        status = om_world_move(loop->world, m->arm, goal, rate * loop->task.speed);
    if (status == OM_INVALID && m->nplace >= 0) {  // the law's place is out of reach
        m->nplace = -1;
        m->commanded = -1;
        return command(loop, is_done);
    }
    if (status == OM_INVALID) {
        om_log(OM_LOG_INFO, "%s", om_error_message());
        om_world_stop(loop->world, m->arm);
        m->outcome = OM_ACTION_UNREACHED;
        *is_done = true;
        return OM_OK;
    }
    if (status < 0) return status;
    m->commanded = rate;
    loop->action.turn = fmax(loop->action.turn, m->turn);
    return OM_OK;
}

static bool is_fold(OmPlanVerb verb) {
    return verb == OM_PLAN_MOVE_AWAY || verb == OM_PLAN_MOVE_ROI;
}

OmStatus om__motion_begin(OmLoop* loop, int arm, OmVec3 goal, bool is_holding, bool* is_done) {
    const ArmState* state = &loop->arm[arm];
    loop->over_time = 0;
    loop->motion = (Motion){.arm = arm,
                            .goal = goal,
                            .from = state->tip,
                            .start = state->tip,
                            .is_holding = is_holding,
                            .may_turn = !is_fold(loop->action.plan.verb) || loop->action.may_turn,
                            .commanded = -1,
                            .watch = {loop->task.visibility, loop->margin, loop->visibility},
                            .outcome = OM_ACTION_DONE};
    loop->motion.nplace = has_law(loop) ? 0 : -1;
    bool is_pull = goal.x == state->tip.x && goal.y == state->tip.y;
    if (is_holding && is_pull) loop->motion.from.z = state->grasp_tip.z;
    return command(loop, is_done);
}

// After a force stop: back along the path, a pull down to the height of its grasp.
static OmStatus command_easing(OmLoop* loop, bool* is_done) {
    Motion* m = &loop->motion;
    m->is_easing = true;
    m->ease_begin = loop->time;
    OmStatus status = om_world_move(loop->world, m->arm, om__goal_pose(loop, m->arm, m->from),
                                    loop->person_rate * SLOW_RATE * loop->task.speed);
    *is_done = status == OM_INVALID;  // out of reach: the arm keeps its place
    return *is_done ? OM_OK : status;
}

OmStatus om__motion_resume(OmLoop* loop) {
    bool is_done;
    Motion* m = &loop->motion;
    loop->result.path += om_distance(m->last, loop->arm[m->arm].tip);
    m->commanded = -1;
    return m->is_easing ? command_easing(loop, &is_done) : command(loop, &is_done);
}

static bool check_easing(OmLoop* loop) {
    const Motion* m = &loop->motion;
    double limit = EASE * om__force_limit(&loop->task);
    if (loop->arm[m->arm].is_moving && loop->force[m->arm] > limit &&
        loop->time - m->ease_begin < MOTION_TIME)
        return false;
    om_world_stop(loop->world, m->arm);
    return true;
}

OmStatus om__motion_check(OmLoop* loop, bool* is_done) {
    Motion* m = &loop->motion;
    ArmState* state = &loop->arm[m->arm];
    if (m->is_easing) {
        *is_done = check_easing(loop);
        return OM_OK;
    }
    if (m->is_holding && om__watch_stop(&m->watch, loop->visibility))
        m->outcome = OM_ACTION_EXPOSED;
    if (m->is_holding && must_stop_for_force(loop, m->arm)) {
        state->is_max_force = true;
        m->outcome = OM_ACTION_FORCE;
    }
    *is_done = m->outcome != OM_ACTION_DONE || !state->is_moving;
    if (*is_done) loop->result.path += om_distance(m->last, state->tip);
    if (*is_done && m->outcome == OM_ACTION_DONE && m->nplace >= 0) {  // at a place of the law
        m->commanded = -1;
        return command(loop, is_done);
    }
    if (m->outcome != OM_ACTION_DONE) {
        om_world_stop(loop->world, m->arm);
        return m->outcome == OM_ACTION_FORCE ? command_easing(loop, is_done) : OM_OK;
    }
    if (*is_done) return OM_OK;
    m->elapsed += fmin(m->commanded, m->turn_rate) * loop->task.time_step;
    om__loop_check_follow(loop);
    OM_CHECK(m->elapsed < MOTION_TIME, OM_INVALID, "PSM%d did not reach its goal in %g s",
             m->arm + 1, MOTION_TIME);
    return command(loop, is_done);
}
