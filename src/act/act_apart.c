// act_apart.c: the tools keep apart (6.4.4): a straight motion that would bring one tool nearer than TOOL_GAP to the
// other is not begun. A free tool that stands in the way of a reach makes room first.
//
// Shaft, wrist and jaws of both tools are capsules at their joints: of the arm that moves along the path, of the other
// where it was last measured, since one arm moves at a time. A world whose kinematics are not known is not checked.
#include "act/act_state.h"

#define TOOL_GAP 0.008     // m
#define ASIDE_HEIGHT 0.07  // m over the tissue, at the edge of the arm's own side
#define PATH_STEP 0.005    // m, between the places of the path that are looked at

// Squared distance of two segments, each clamped to the other (Ericson, Real-Time Collision Detection, 5.1.9).
static double segment_distance2(OmVec3 a, OmVec3 b, OmVec3 c, OmVec3 d) {
    const OmVec3 u = om_sub(b, a), v = om_sub(d, c), r = om_sub(a, c);
    const double uu = om_norm2(u), vv = om_norm2(v), vr = om_dot(v, r), ur = om_dot(u, r);
    const double uv = om_dot(u, v), det = uu * vv - uv * uv;
    double s = det > 1e-18 ? fmax(0, fmin(1, (uv * vr - ur * vv) / det)) : 0;
    double t = vv > 1e-18 ? (uv * s + vr) / vv : 0;
    t = fmax(0, fmin(1, t));
    s = uu > 1e-18 ? fmax(0, fmin(1, (uv * t - ur) / uu)) : 0;
    const OmVec3 gap = om_add(r, om_sub(om_scale(s, u), om_scale(t, v)));
    return om_norm2(gap);
}

// Of the nearest two capsules, m; below 0 where they overlap.
static double tool_gap(const OmPsmCapsule p[OM_PSM_NCAPSULE],
                       const OmPsmCapsule q[OM_PSM_NCAPSULE]) {
    double least = INFINITY;
    for (int i = 0; i < OM_PSM_NCAPSULE; ++i)
        for (int k = 0; k < OM_PSM_NCAPSULE; ++k)
            least = fmin(least, sqrt(segment_distance2(p[i].a, p[i].b, q[k].a, q[k].b)) -
                                    p[i].radius - q[k].radius);
    return least;
}

// Least gap on a straight way, world frame; the joints before it are those measured.
static double way_gap(const Act* act, int arm, OmVec3 from, OmPose goal) {
    const int other = 1 - arm;
    if (act->narm < 2) return INFINITY;
    const OmPsm *psm = om_world_psm(act->world, arm), *still = om_world_psm(act->world, other);
    if (!psm || !still) return INFINITY;
    const ArmState *a = &act->arm[arm], *b = &act->arm[other];
    OmPsmCapsule obstacle[OM_PSM_NCAPSULE], tool[OM_PSM_NCAPSULE];
    om_psm_capsules(still, b->joint, b->jaw, obstacle);
    const int n = 1 + (int)ceil(om_distance(from, goal.p) / PATH_STEP);
    om_psm_capsules(psm, a->joint, a->jaw, tool);
    const double now = tool_gap(tool, obstacle);
    double least = INFINITY, q[OM_PSM_NJOINT];
    for (int i = 0; i < OM_PSM_NJOINT; ++i) q[i] = a->joint[i];
    for (int k = 1; k <= n; ++k) {
        OmPose pose = {om_madd(from, (double)k / n, om_sub(goal.p, from)), goal.q};
        if (om_psm_inverse(psm, pose, q, q) < 0) break;  // out of reach: the world says so
        om_psm_capsules(psm, q, a->jaw, tool);
        least = fmin(least, tool_gap(tool, obstacle));
    }
    // a motion that leads away from the other tool is always allowed
    return least >= now ? (double)INFINITY : least;
}

double om__tool_gap(const Act* act, int arm, OmPose goal) {
    return way_gap(act, arm, om_pose_apply(act->grid->task, act->arm[arm].tip), goal);
}

bool om__needs_room(const Act* act, int arm, const OmVec3* waypoint, int n) {
    if (act->narm < 2 || act->arm[1 - arm].in_hand >= 0) return false;
    OmVec3 from = om_pose_apply(act->grid->task, act->arm[arm].tip);
    for (int i = 0; i < n; ++i) {
        const OmPose goal = om__goal_pose(act, arm, waypoint[i]);
        if (way_gap(act, arm, from, goal) < TOOL_GAP) return true;
        from = goal.p;
    }
    return false;
}

OmVec3 om__aside(const Act* act, int arm) {
    const OmVec3 half = act->grid->half, tip = act->arm[arm].tip;
    return om_vec3(tip.x, arm == 0 ? -half.y : half.y, fmax(tip.z, 2 * half.z + ASIDE_HEIGHT));
}

bool om__is_apart(const Act* act, int arm, OmPose goal) {
    return om__tool_gap(act, arm, goal) >= TOOL_GAP;
}
