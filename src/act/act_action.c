// act_action.c: from actions to motions (6.4.4): each action is a sequence of motions and waits.
//
// An action advances by one tick at a time. Its steps are functions that begin the next motion or wait, or end the
// action. A fold is continued beyond its nominal length while each step gains visibility and the force is below its
// limit; force, the arm's workspace and the gain end it.
#include "act/act_state.h"

#define CLEARANCE 0.025  // m, height over the tissue at which a free tool travels
#define JAW_CLOSED 0.0
#define GRIP_TIME 0.3  // s for the jaws to close or open, and to come to rest
// A jaw that still closes then, as one does whose tissue is slower than time, is looked at again.
#define LOOK_TIME 0.1  // s
#define MAX_LOOK 20

const char* om_action_outcome_text(OmActionOutcome outcome) {
    switch (outcome) {
    case OM_ACTION_DONE: return "done";
    case OM_ACTION_EXPOSED: return "ROI exposed";
    case OM_ACTION_FORCE: return "stopped by force";
    case OM_ACTION_HEIGHT: return "stopped by height";
    case OM_ACTION_UNREACHED: return "out of reach";
    case OM_ACTION_EMPTY: return "nothing grasped";
    case OM_ACTION_SLIPPED: return "tissue slipped";
    case OM_ACTION_OUTDATED: return "stopped by an update";
    case OM_ACTION_ABORTED: return "aborted";
    case OM_ACTION_WARNED: return "stopped by a warning";
    case OM_ACTION_REPLANNED: return "stopped for a new plan";
    case OM_ACTION_HELD: return "stopped for a person";
    }
    return "";
}

const char* om_hold_text(OmHold hold) {
    switch (hold) {
    case OM_HOLD_NONE: return "none";
    case OM_HOLD_WARNING: return "warning";
    case OM_HOLD_STALE: return "stale";
    case OM_HOLD_LATE: return "late";
    case OM_HOLD_UPDATE: return "update";
    case OM_HOLD_PLANNER: return "planner";
    case OM_HOLD_TOOL: return "tool";
    case OM_HOLD_ARM: return "arm";
    }
    return "";
}

void om__act_init(Act* act, bool has_cloud) {
    act->narm = om_world_narm(act->world);
    for (int a = 0; a < OM_MAX_ARM; ++a) act->arm[a] = (ArmState){.at = -1, .in_hand = -1};
    act->has_cloud = has_cloud;
    act->scan = om_scan_default_def(om_site_spacing(om_body_site(act->twin)));
    act->space = om_cloud_default_def(act->world, om_body_site(act->twin));
    act->point_tick = -1;
    act->rate = act->warn_rate = act->person_rate = 1.0;
}

void om__act_stop(Act* act) {
    for (int a = 0; a < act->narm; ++a) om_world_stop(act->world, a);
}

// ---- steps ----------------------------------------------------------------------------------------------

typedef enum Next {
    NEXT_STEP,   // the next step of the action begins without a tick
    NEXT_TICK,   // a motion or a wait needs a tick
    NEXT_ACTION  // the action has ended
} Next;

static OmStatus begin_motion_of(Act* act, int arm, OmVec3 goal, bool is_holding, Next* next) {
    Action* a = &act->action;
    bool is_done;
    OM_TRY(om__motion_begin(act, arm, goal, is_holding, &is_done));
    if (is_done) a->outcome = act->motion.outcome;
    *next = is_done ? NEXT_STEP : NEXT_TICK;
    return OM_OK;
}

static OmStatus begin_motion(Act* act, OmVec3 goal, bool is_holding, Next* next) {
    return begin_motion_of(act, act->action.plan.arm, goal, is_holding, next);
}

static OmStatus begin_wait(Act* act, double seconds, Next* next) {
    act->action.nwait = (int)ceil(seconds / act->task->time_step);
    *next = act->action.nwait > 0 ? NEXT_TICK : NEXT_STEP;
    return OM_OK;
}

static void note_point(Act* act, const GraspPoint* point) {
    OmEffort* e = act->effort;
    if (point->source != GRASP_MEASURED) return;
    ++e->nmeasured;
    e->measured_off = fmax(e->measured_off, point->off);
}

// Up, across, down, so that a free tool does not touch the tissue.
static OmStatus step_reach(Act* act, Next* next) {
    Action* a = &act->action;
    ArmState* state = &act->arm[a->plan.arm];
    if (a->step == 0) {
        OM_TRY(om__cloud_look(act, a->plan.block));
        const GraspPoint* point = &act->point[a->plan.block];
        OmVec3 target = point->tip;
        note_point(act, point);
        double travel = fmax(state->tip.z, target.z + CLEARANCE);
        a->waypoint[0] = om_vec3(state->tip.x, state->tip.y, travel);
        a->waypoint[1] = om_vec3(target.x, target.y, travel);
        a->waypoint[2] = target;
        a->step = act->law.next ? 3 : 1;  // a law finds its own way over the tissue
        const int other = 1 - a->plan.arm;
        if (om__needs_room(act, a->plan.arm, a->waypoint, 3))
            return begin_motion_of(act, other, om__aside(act, other), false, next);
    }
    if (a->step < 4 && a->outcome == OM_ACTION_DONE)
        return begin_motion(act, a->waypoint[a->step++ - 1], false, next);
    state->at = a->outcome == OM_ACTION_DONE ? a->plan.block : -1;
    state->is_max_force = false;
    *next = NEXT_ACTION;
    return OM_OK;
}

// The twin grasps, too; if it has no tissue near the measured tip, its arm grasps nothing.
static OmStatus grasp_with_twin(Act* act, bool* is_closing) {
    Action* a = &act->action;
    int arm = a->plan.arm;
    OmObservation obs = {0};
    OM_TRY(om_world_observe(act->world, 0, &obs));
    OmStatus status = OM_OK;
    a->outcome = OM_ACTION_EMPTY;
    *is_closing = !om_arm_is_holding(&obs.arm[arm]) && !om_arm_is_empty(&obs.arm[arm]);
    if (om_arm_is_holding(&obs.arm[arm])) {
        const OmPose tip = om__twin_pose(act, arm, obs.arm[arm].tip);
        status = om__cloud_grasp_twin(act, arm, a->plan.block, tip);
        if (status == OM_OK) a->outcome = OM_ACTION_DONE;
        if (status == OM_OK && act->host.on_grasp) act->host.on_grasp(act->host.ctx, arm, tip);
    }
    om_observation_done(&obs);
    return status == OM_INVALID ? OM_OK : status;
}

static OmStatus step_grasp(Act* act, Next* next) {
    Action* a = &act->action;
    ArmState* state = &act->arm[a->plan.arm];
    *next = NEXT_ACTION;
    if (a->step == 0) {
        a->step = 1;
        OM_TRY(om_world_set_jaw(act->world, a->plan.arm, JAW_CLOSED));
        return begin_wait(act, GRIP_TIME, next);
    }
    if (a->step == 2) return OM_OK;  // no tissue was grasped, and the jaws are open; or it is held
    bool is_closing;
    OM_TRY(grasp_with_twin(act, &is_closing));
    if (is_closing && a->nlook++ < MAX_LOOK) return begin_wait(act, LOOK_TIME, next);
    a->step = 2;
    if (a->outcome == OM_ACTION_EMPTY) {
        om__cloud_note_empty(act, a->plan.arm, a->plan.block);
        state->at = -1;  // the next grasp follows a new reach
        OM_TRY(om_world_set_jaw(act->world, a->plan.arm, JAW_OPEN));
        return begin_wait(act, GRIP_TIME, next);
    }
    state->in_hand = a->plan.block;
    state->is_closed = true;
    state->grasp_tip = state->tip;
    state->fold = OM_PLAN_PULL;
    state->is_max_force = state->is_at_top = false;
    const double wait = om__cloud_draw_time(act, a->plan.arm);
    return wait > 0 ? begin_wait(act, wait, next) : OM_OK;
}

// Open, rise clear of the tissue, wait until the tissue has fallen.
static OmStatus step_release(Act* act, Next* next) {
    Action* a = &act->action;
    ArmState* state = &act->arm[a->plan.arm];
    switch (a->step++) {
    case 0:
        OM_TRY(om_world_set_jaw(act->world, a->plan.arm, JAW_OPEN));
        om_body_release(act->twin, a->plan.arm);
        if (act->host.on_release) OM_TRY(act->host.on_release(act->host.ctx, a->plan.arm));
        state->in_hand = -1;
        state->at = -1;
        state->is_closed = false;
        state->is_max_force = false;
        return begin_wait(act, GRIP_TIME, next);
    case 1: return begin_motion(act, om_add(state->tip, om_vec3(0, 0, CLEARANCE)), false, next);
    case 2: return begin_wait(act, FALL_TIME, next);
    default:
        a->outcome = OM_ACTION_DONE;
        *next = NEXT_ACTION;
        return OM_OK;
    }
}

static OmStatus step_pull(Act* act, Next* next) {
    Action* a = &act->action;
    const ArmState* state = &act->arm[a->plan.arm];
    *next = NEXT_ACTION;
    if (a->step++ > 0) return OM_OK;
    double top = state->grasp_tip.z + act->task->max_height;
    double z = fmin(state->tip.z + act->task->pull_step, top);
    a->lift = state->lift;
    a->rise = z - state->tip.z;
    return begin_motion(act, om_vec3(state->tip.x, state->tip.y, z), true, next);
}

// compute_target of Alg. 3: a fold keeps the height. Its length is `retract` away from the camera; towards the ROI it
// ends `retract` beyond the ROI, since a flap directly above the ROI hides it from every side.
void om__fold_path(const Grid* grid, double retract, OmVec3 tip, OmPlanVerb verb, OmVec3* direction,
                   double* length) {
    *direction = om_vec3(1, 0, 0);
    *length = retract;
    if (verb == OM_PLAN_MOVE_AWAY) return;
    OmVec3 to_roi = om_vec3(grid->roi.x - tip.x, grid->roi.y - tip.y, 0);
    double distance = om_norm(to_roi);
    *length = distance < 1e-3 ? 0 : distance + retract;  // directly above the ROI: no direction
    if (distance >= 1e-3) *direction = om_scale(1 / distance, to_roi);
}

// Tissue that a fold has carried away is no longer between its grasp and the ROI: the other fold would stretch it. So
// the other fold begins where the first one of this grasp began, as in the plan before and the search.
static bool must_go_back(const Act* act, const ArmState* state) {
    return act->ncontinued == 0 && state->fold != OM_PLAN_PULL &&
           state->fold != act->action.plan.verb;
}

// Move by the nominal length, or as far as the arm reaches; then by further steps while each gains visibility.
static OmStatus step_fold(Act* act, Next* next) {
    Action* a = &act->action;
    ArmState* state = &act->arm[a->plan.arm];
    *next = NEXT_ACTION;
    if (a->step == 0 && must_go_back(act, state)) {
        state->fold = a->plan.verb;
        return begin_motion(act, state->fold_tip, true, next);
    }
    if (a->step == 0 && (a->outcome == OM_ACTION_EXPOSED || a->outcome == OM_ACTION_FORCE))
        return OM_OK;  // on the way back
    if (a->step == 0) {
        a->step = 1;
        if (state->fold == OM_PLAN_PULL) state->fold_tip = state->tip;
        state->fold = a->plan.verb;
        a->tip = state->tip;
        om__fold_path(act->grid, act->task->retract, a->tip, a->plan.verb, &a->direction,
                      &a->length);
        a->outcome = OM_ACTION_UNREACHED;
    }
    if (a->step == 1 && a->outcome == OM_ACTION_UNREACHED) {
        a->length -= FOLD_STEP;
        if (a->length <= 0 && a->may_turn) return OM_OK;
        if (a->length <= 0) {  // nothing of it is in reach: again, with turns of the wrist
            a->may_turn = true;
            a->step = 0;
            return step_fold(act, next);
        }
        OmVec3 goal = om_madd(a->tip, a->length, a->direction);
        return begin_motion(act, goal, true, next);
    }
    bool has_gained = a->step == 1 || (!act->is_over && act->visibility >= a->before + FOLD_GAIN);
    if (a->outcome == OM_ACTION_DONE && has_gained) {
        a->step = 2;
        a->before = act->visibility;
        return begin_motion(act, om_madd(state->tip, FOLD_STEP, a->direction), true, next);
    }
    if (a->outcome == OM_ACTION_UNREACHED) a->outcome = OM_ACTION_DONE;  // end of the workspace
    return OM_OK;
}

// Take steps until one needs a tick or the action has ended.
static OmStatus take_steps(Act* act, bool* is_done) {
    Next next = NEXT_STEP;
    while (next == NEXT_STEP) {
        switch (act->action.plan.verb) {
        case OM_PLAN_REACH: OM_TRY(step_reach(act, &next)); break;
        case OM_PLAN_GRASP: OM_TRY(step_grasp(act, &next)); break;
        case OM_PLAN_RELEASE: OM_TRY(step_release(act, &next)); break;
        case OM_PLAN_PULL: OM_TRY(step_pull(act, &next)); break;
        default: OM_TRY(step_fold(act, &next)); break;
        }
    }
    *is_done = next == NEXT_ACTION;
    return OM_OK;
}

OmStatus om__action_begin(Act* act, const OmPlanAction* plan, bool* is_done) {
    act->action = (Action){.plan = *plan, .outcome = OM_ACTION_DONE};
    return take_steps(act, is_done);
}

OmStatus om__action_check(Act* act, bool* is_done) {
    Action* a = &act->action;
    *is_done = false;
    if (a->nwait > 0) {
        if (--a->nwait > 0) return OM_OK;
    } else {
        bool has_arrived;
        OM_TRY(om__motion_check(act, &has_arrived));
        if (!has_arrived) return OM_OK;
        a->outcome = act->motion.outcome;
    }
    return take_steps(act, is_done);
}
