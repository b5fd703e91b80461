// act_wrist.c: the wrist turns where a joint forbids the tool's usual orientation (ours; the thesis keeps it
// constant).
//
// A motion keeps the orientation of the tool if all joints stay within their limits on the whole way. Otherwise the
// tool turns about its tip, by the smallest multiple of 5 degrees whose whole way is in reach: first the turn that the
// goal needs is tried (om_psm_inverse_turned), then all turns. Orientation and position change in proportion, as the
// world moves. If there is no such turn, the motion is commanded as it would be without turns: the world refuses it, or
// stops where a joint ends it.
//
// A free tool turns back with its next motion, as soon as joints allow it. While tissue is held the turn stays, and
// held tissue turns with the tool: in the world by the tool's pose, in the twin by om__twin_pose. The twin's grasp by a
// tool that has not turned has the orientation of the task, to the same bytes as without this file.
//
// A fold does not turn the wrist while a shorter one is in reach without: it ends where the arm ends (act_action.c).
#include "act/act_state.h"

#define WAY_STEP 1e-3                    // m, between the points of a way that are looked at
#define WAY_TURN (OM_PI / 180.0)         // rad, the same
#define SAME_TURN (0.5 * OM_PI / 180.0)  // rad: a measured orientation nearer than this is back
#define TURN_STEP (5 * OM_PI / 180.0)    // rad, of the search
#define WIDE_LIMIT (4 * OM_PI)           // rad, or m: no joint passes it

OmQuat om__wrist_straight(const ArmState* arm) { return arm->is_turned ? arm->q_straight : arm->q; }

OmPose om__twin_pose(const Act* act, int arm, OmPose tip) {
    const ArmState* a = &act->arm[arm];
    OmPose pose = {tip.p, act->grid->task.q};
    if (!a->is_turned) return pose;
    const OmQuat turn = om_quat_mul(tip.q, om_quat_conj(a->q_straight));
    pose.q = om_quat_normalize(om_quat_mul(turn, pose.q));
    return pose;
}

bool om__wrist_reach(const OmPsm* psm, OmPose straight, double max_turn,
                     const double near[OM_PSM_NJOINT], double q[OM_PSM_NJOINT], OmQuat* turned) {
    OmPose pose;
    const bool is_in_reach =
        om_psm_inverse_turned(psm, straight, max_turn, near, q, &pose) == OM_OK;
    if (is_in_reach) *turned = pose.q;
    return is_in_reach;
}

// ---- ways -----------------------------------------------------------------------------------------------------

// A straight way of a tool, world frame.
typedef struct Way {
    const OmPsm* psm;
    const double* joint;  // at its begin
    OmPose from;
    OmVec3 goal;
} Way;

// All joints stay within their limits on the way to an orientation. Otherwise `*blocked` is the first place that is out
// of reach, in the orientation of the begin, and `near` has the joints before it.
static bool is_in_reach(const Way* w, OmQuat q, OmPose* blocked, double near[OM_PSM_NJOINT]) {
    const double length = om_distance(w->from.p, w->goal), angle = om_quat_angle(w->from.q, q);
    const int n = 1 + (int)ceil(fmax(length / WAY_STEP, angle / WAY_TURN));
    for (int i = 0; i < OM_PSM_NJOINT; ++i) near[i] = w->joint[i];
    for (int k = 1; k <= n; ++k) {
        const double part = (double)k / n;
        OmPose pose = {om_madd(w->from.p, part, om_sub(w->goal, w->from.p)), q};
        if (angle > 0) pose.q = om_quat_slerp(w->from.q, q, part);
        if (om_psm_inverse(w->psm, pose, near, near) == OM_OK) continue;
        *blocked = pose;
        return false;
    }
    return true;
}

// Say which joint forbids a pose: a pose that the closed form does not reach bends the wrist beyond 90 degrees.
static void explain(const OmPsm* psm, OmPose pose, const double near[OM_PSM_NJOINT], char* text,
                    size_t size) {
    OmPsm wide = *psm;
    double q[OM_PSM_NJOINT];
    for (int i = 0; i < OM_PSM_NJOINT; ++i) {
        wide.q_min[i] = -WIDE_LIMIT;
        wide.q_max[i] = WIDE_LIMIT;
    }
    int joint = 4;
    const bool is_known = om_psm_inverse(&wide, pose, near, q) == OM_OK;
    for (int i = OM_PSM_NJOINT - 1; is_known && i >= 0; --i)
        if (q[i] < psm->q_min[i] || q[i] > psm->q_max[i]) joint = i;
    snprintf(text, size, "joint %d (%s) would be outside its limit", joint + 1,
             om_psm_joint_name(joint));
}

// The smallest turn whose whole way is in reach, about the axes of om_psm_inverse_turned: to the faces, edges and
// corners of a cube. Of turns of the same size the one that changes the angles of the joints least.
static bool search(const Way* w, OmQuat straight, double max_turn, OmQuat* turned) {
    const int nturn = (int)floor(max_turn / TURN_STEP + 1e-9);
    double best = INFINITY, joint[OM_PSM_NJOINT];
    for (int k = 1; k <= nturn && isinf(best); ++k) {
        for (int a = 0; a < 27; ++a) {
            const OmVec3 axis = om_vec3(a % 3 - 1, a / 3 % 3 - 1, a / 9 - 1);
            if (om_norm2(axis) == 0) continue;
            const OmQuat q =
                om_quat_mul(straight, om_quat_axis_angle(om_normalize(axis), k * TURN_STEP));
            OmPose blocked;
            double change = 0;
            if (!is_in_reach(w, q, &blocked, joint)) continue;
            for (int i = 0; i < OM_PSM_NJOINT; ++i)
                change += i == 2 ? 0 : (joint[i] - w->joint[i]) * (joint[i] - w->joint[i]);
            if (change < best) best = change, *turned = q;
        }
    }
    return isfinite(best);
}

// ---- the choice -----------------------------------------------------------------------------------------------

static void take(Act* act, const Way* w, OmQuat q) {
    Motion* m = &act->motion;
    const double angle = om_quat_angle(w->from.q, q), speed = act->task->speed;
    m->q = q;
    if (angle > 0)
        m->turn_rate = om_distance(w->from.p, w->goal) * OM_WORLD_MAX_TURN / (angle * speed);
}

// A turn from the usual orientation, told of in the record of the action.
static void take_turn(Act* act, const Way* w, OmQuat straight, OmQuat q, const OmPose* blocked,
                      const double near[OM_PSM_NJOINT]) {
    ArmState* arm = &act->arm[act->motion.arm];
    take(act, w, q);
    arm->is_turned = true;
    arm->q_straight = straight;
    act->motion.turn = om_quat_angle(straight, q);
    explain(w->psm, *blocked, near, act->action.turn_reason, sizeof act->action.turn_reason);
}

void om__wrist_choose(Act* act) {
    Motion* m = &act->motion;
    ArmState* arm = &act->arm[m->arm];
    const OmPsm* psm = om_world_psm(act->world, m->arm);
    m->q = arm->q;
    m->turn_rate = INFINITY;
    m->turn = 0;
    if (!psm || !(act->task->wrist_turn > 0)) return;
    const OmQuat straight = om__wrist_straight(arm);
    if (arm->is_turned && !m->is_holding && om_quat_angle(arm->q, straight) < SAME_TURN)
        arm->is_turned = false;
    const Way way = {psm,
                     arm->joint,
                     {om_psm_forward(psm, arm->joint).p, arm->q},
                     om_pose_apply(act->grid->task, m->goal)};
    OmPose blocked, other;
    double near[OM_PSM_NJOINT], q[OM_PSM_NJOINT];
    if (arm->is_turned && !m->is_holding && is_in_reach(&way, straight, &blocked, near)) {
        take(act, &way, straight);
        return;
    }
    if (is_in_reach(&way, arm->q, &blocked, near) || !m->may_turn) return;
    OmQuat turned;
    double last[OM_PSM_NJOINT];
    const OmPose goal = {way.goal, straight};
    const bool is_turned = om__wrist_reach(psm, goal, act->task->wrist_turn, near, q, &turned) &&
                           is_in_reach(&way, turned, &other, last);
    if (is_turned || search(&way, straight, act->task->wrist_turn, &turned))
        take_turn(act, &way, straight, turned, &blocked, near);
}
