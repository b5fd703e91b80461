// defras_act.c: from actions to motions (6.4.4), tick by tick, with the force watched (check_failure).
//
// One tick is one step of the world and of the twin. Every motion is a straight line of the tip. From SLOW_FROM of
// the force limit (the threshold less the margin) on the motion slows down, to SLOW_RATE at the limit; above it the
// tip all but stands still, and tissue that moves comes to rest. If the force stays above the limit for SLOW_TIME the
// arm goes back until the force is below the limit, and a new plan is made. At a quarter of the speed above the limit,
// and at full speed up to it, the force passed the limit by 8 to 30 %.
//
// A motion stops where the ROI is seen by a margin more than is wanted, or where more than is wanted is seen
// and it becomes less. A fold goes on beyond its nominal way while each step gains visibility and the force is
// below its limit; force, the arm's workspace and the gain end it.
#include <string.h>

#include "defras/defras_internal.h"

#define SLOW_TIME 0.6       // s above the limit, in one motion, after which it ends
#define OVER_FACTOR 1.5     // beyond this many thresholds there is no second chance
#define EASE 0.9            // share of the limit to which the force is let down after a force stop
#define HOLD_TIME 0.5       // s for which the ROI must be seen without a break
#define HOLD_LIMIT 1.5      // s that tissue still moving is given to come to that
#define DROP 0.01           // visibility below its best that tells that the best is over
#define APPROACH_TIME 30.0  // s, longest motion: a motion that does not end is a fault
#define CLEARANCE 0.025     // m, height over the tissue at which a free tool travels
#define JAW_OPEN (40.0 * OM_PI / 180.0)
#define JAW_CLOSED 0.0
#define GRIP_TIME 0.2  // s for the jaws to close or open
#define FALL_TIME 1.2  // s that released tissue is given to fall

static bool must_stop_for_force(const Loop* loop, int arm) {
    double limit = om__force_limit(&loop->scene->task);
    if (loop->force[arm] <= limit) return false;
    return loop->force[arm] > OVER_FACTOR * limit || loop->over_time > SLOW_TIME;
}

OmStatus om__loop_wait(Loop* loop, double seconds) {
    int n = (int)ceil(seconds / loop->scene->task.time_step);
    for (int i = 0; i < n; ++i) OM_TRY(om__loop_tick(loop));
    return OM_OK;
}

OmStatus om__loop_hold(Loop* loop) {
    double wanted = loop->scene->task.visibility, begin = loop->time, since = loop->time;
    while (!loop->is_exposed && loop->time - begin < HOLD_LIMIT) {
        OM_TRY(om__loop_tick(loop));
        if (loop->visibility < wanted) since = loop->time;
        loop->is_exposed = loop->time - since >= HOLD_TIME;
    }
    return OM_OK;
}

// ---- motions -----------------------------------------------------------------------------------------------

bool om__watch_stop(Watch* w, double visibility) {
    w->best = fmax(w->best, visibility);
    if (visibility < w->wanted) return false;
    return visibility >= fmin(1.0, w->wanted + w->margin) || visibility < w->best - DROP;
}

// After a force stop: back along the way, a pull down to where the tissue was grasped, until the force is below
// its limit.
static OmStatus ease(Loop* loop, int arm, OmVec3 from_task) {
    double limit = EASE * om__force_limit(&loop->scene->task), begin = loop->time;
    OmStatus status = om_world_move(loop->world, arm, om__goal_pose(loop, arm, from_task),
                                    SLOW_RATE * loop->scene->task.speed);
    if (status == OM_INVALID) return OM_OK;  // it stays where it is
    OM_TRY(status);
    do {
        OM_TRY(om__loop_tick(loop));
    } while (loop->arm[arm].is_moving && loop->force[arm] > limit &&
             loop->time - begin < APPROACH_TIME);
    om_world_stop(loop->world, arm);
    return OM_OK;
}

// Go straight to a goal; stops early for force, height, or because the ROI is seen.
static OmStatus move_to(Loop* loop, int arm, OmVec3 goal_task, bool is_holding,
                        OmActionOutcome* outcome) {
    double speed = loop->scene->task.speed, commanded = -1;
    double gone = 0;  // s that the way so far would have taken at full speed
    loop->over_time = 0;
    ArmState* state = &loop->arm[arm];
    OmVec3 from = state->tip;
    bool is_pull = goal_task.x == from.x && goal_task.y == from.y;
    if (is_holding && is_pull) from.z = state->grasp_tip.z;
    Watch watch = {loop->scene->task.visibility, loop->margin, loop->visibility};
    *outcome = OM_ACTION_DONE;
    for (;;) {
        double rate = is_holding ? loop->rate : 1.0;
        if (rate != commanded) {
            OmStatus status =
                om_world_move(loop->world, arm, om__goal_pose(loop, arm, goal_task), rate * speed);
            if (status == OM_INVALID) {
                om_log(OM_LOG_INFO, "%s", om_error_message());
                om_world_stop(loop->world, arm);
                *outcome = OM_ACTION_UNREACHED;
                return OM_OK;
            }
            OM_TRY(status);
            commanded = rate;
        }
        OM_TRY(om__loop_tick(loop));
        if (is_holding && om__watch_stop(&watch, loop->visibility)) *outcome = OM_ACTION_EXPOSED;
        if (is_holding && must_stop_for_force(loop, arm)) {
            state->is_max_force = true;
            *outcome = OM_ACTION_FORCE;
        }
        if (*outcome != OM_ACTION_DONE) {
            om_world_stop(loop->world, arm);
            return *outcome == OM_ACTION_FORCE ? ease(loop, arm, from) : OM_OK;
        }
        if (!state->is_moving) return OM_OK;
        gone += rate * loop->scene->task.time_step;
        OM_CHECK(gone < APPROACH_TIME, OM_INVALID, "PSM%d did not reach its goal in %g s", arm + 1,
                 APPROACH_TIME);
    }
}

// Up, across, down: a free tool does not brush the tissue.
static OmStatus reach(Loop* loop, int arm, int block, OmActionOutcome* outcome) {
    int vert = loop->grid.vert[block];
    OmVec3 target = om__to_task(&loop->grid, om_load3(om_body_x(loop->twin), vert));
    double travel = fmax(loop->arm[arm].tip.z, target.z + CLEARANCE);
    OmVec3 way[3] = {om_vec3(loop->arm[arm].tip.x, loop->arm[arm].tip.y, travel),
                     om_vec3(target.x, target.y, travel), target};
    *outcome = OM_ACTION_DONE;
    for (int i = 0; i < 3 && *outcome == OM_ACTION_DONE; ++i) {
        OM_TRY(move_to(loop, arm, way[i], false, outcome));
    }
    loop->arm[arm].at = *outcome == OM_ACTION_DONE ? block : -1;
    loop->arm[arm].is_max_force = false;
    return OM_OK;
}

static OmStatus grasp(Loop* loop, int arm, int block, OmActionOutcome* outcome) {
    ArmState* state = &loop->arm[arm];
    OM_TRY(om_world_set_jaw(loop->world, arm, JAW_CLOSED));
    OM_TRY(om__loop_wait(loop, GRIP_TIME));
    OmObservation obs = {0};
    OM_TRY(om_world_observe(loop->world, 0, &obs));
    *outcome = OM_ACTION_EMPTY;
    if (obs.arm[arm].is_holding) {
        int nheld = 0;
        OmPose tip = {obs.arm[arm].tip.p, loop->grid.task.q};
        OmStatus status =
            om_body_grasp(loop->twin, arm, tip, loop->scene->task.grasp_radius, &nheld);
        if (status != OM_OK && status != OM_INVALID) return status;
        if (status == OM_OK) *outcome = OM_ACTION_DONE;
    }
    om_observation_done(&obs);
    if (*outcome == OM_ACTION_EMPTY) {
        OM_TRY(om_world_set_jaw(loop->world, arm, JAW_OPEN));
        return om__loop_wait(loop, GRIP_TIME);
    }
    state->in_hand = block;
    state->is_closed = true;
    state->grasp_tip = state->tip;
    state->is_max_force = false;
    return OM_OK;
}

static OmStatus release(Loop* loop, int arm, OmActionOutcome* outcome) {
    ArmState* state = &loop->arm[arm];
    OM_TRY(om_world_set_jaw(loop->world, arm, JAW_OPEN));
    om_body_release(loop->twin, arm);
    state->in_hand = -1;
    state->at = -1;
    state->is_closed = false;
    state->is_max_force = false;
    OM_TRY(om__loop_wait(loop, GRIP_TIME));
    // Clear of the tissue, which is given time to fall.
    OmVec3 up = om_add(state->tip, om_vec3(0, 0, CLEARANCE));
    OM_TRY(move_to(loop, arm, up, false, outcome));
    OM_TRY(om__loop_wait(loop, FALL_TIME));
    *outcome = OM_ACTION_DONE;
    return OM_OK;
}

// compute_target of Alg. 3: planar folds keep the height. Away from the camera goes the scene's `retract`;
// towards the ROI goes on as far beyond it, since a flap held right above the ROI hides it from every side.
void om__fold_way(const Grid* grid, double retract, OmVec3 tip, OmPlanVerb verb, OmVec3* direction,
                  double* length) {
    *direction = om_vec3(1, 0, 0);
    *length = retract;
    if (verb == OM_PLAN_MOVE_AWAY) return;
    OmVec3 to_roi = om_vec3(grid->roi.x - tip.x, grid->roi.y - tip.y, 0);
    double distance = om_norm(to_roi);
    *length = distance < 1e-3 ? 0 : distance + retract;  // right above it: no direction
    if (distance >= 1e-3) *direction = om_scale(1 / distance, to_roi);
}

// The nominal way, as much of it as the arm reaches; then further steps while each of them gains visibility.
static OmStatus fold(Loop* loop, int arm, OmPlanVerb verb, OmActionOutcome* outcome) {
    OmVec3 tip = loop->arm[arm].tip, direction;
    double way, before = loop->visibility;
    om__fold_way(&loop->grid, loop->scene->task.retract, tip, verb, &direction, &way);
    *outcome = OM_ACTION_UNREACHED;
    for (way -= FOLD_STEP; way > 0 && *outcome == OM_ACTION_UNREACHED; way -= FOLD_STEP) {
        OM_TRY(move_to(loop, arm, om_madd(tip, way, direction), true, outcome));
    }
    if (*outcome != OM_ACTION_DONE) return OM_OK;
    do {
        before = loop->visibility;
        OM_TRY(
            move_to(loop, arm, om_madd(loop->arm[arm].tip, FOLD_STEP, direction), true, outcome));
    } while (*outcome == OM_ACTION_DONE && !loop->is_over &&
             loop->visibility >= before + FOLD_GAIN);
    if (*outcome == OM_ACTION_UNREACHED) *outcome = OM_ACTION_DONE;  // the end of the workspace
    return OM_OK;
}

OmStatus om__execute_action(Loop* loop, const OmPlanAction* action, OmActionOutcome* outcome) {
    int arm = action->arm;
    ArmState* state = &loop->arm[arm];
    loop->force_action = loop->force_world_action = 0;
    switch (action->verb) {
    case OM_PLAN_REACH: return reach(loop, arm, action->block, outcome);
    case OM_PLAN_GRASP: return grasp(loop, arm, action->block, outcome);
    case OM_PLAN_RELEASE: return release(loop, arm, outcome);
    case OM_PLAN_PULL: {
        double top = state->grasp_tip.z + loop->scene->task.max_height;
        double z = fmin(state->tip.z + loop->scene->task.pull_step, top);
        return move_to(loop, arm, om_vec3(state->tip.x, state->tip.y, z), true, outcome);
    }
    default: return fold(loop, arm, action->verb, outcome);
    }
}
