// robot_wrist.c: the inverse of an instrument whose roll and wrist are rows of a table: one to three joints.
//
// The angles theta of roll and wrist place the tip at c in frame 3, behind the insertion. |p| gives the insertion, and
// then yaw and pitch turn u = (c_x, c_y, c_z + insertion) to p, in closed form: the position is always exact. What is
// left is the angle between the orientation of the tip and the wanted one: least squares in theta, by Levenberg and
// Marquardt, with the derivative along which the position stays. An arm of six joints reaches an angle of 0; with
// fewer the smallest angle remains. Starts: the present angles, then a grid, since the angle has several minima.
#include <string.h>

#include "robot/robot_internal.h"

#define DEG (OM_PI / 180.0)
#define REACHED 1e-7  // rad: an orientation that is reached
#define NROLL 8       // starts: of the roll, in a turn
#define NBEND 3       // the same, of a joint of the wrist, between its limits

typedef struct Fit {
    double q[OM_PSM_NJOINT];
    double angle;    // rad, that the orientation is off
    bool is_inside;  // its joints are within their limits
} Fit;

typedef struct Goal {
    const OmPsm* psm;  // its base is the frame of the goal
    OmPose tip;
} Goal;

// Yaw, pitch and insertion for the position, at the other joints of q. @return false: out of reach
static bool solve_position(const Goal* g, double q[6]) {
    const OmPsm* psm = g->psm;
    OmPose at = om_pose_identity();
    for (int k = 3; k < psm->njoint; ++k)
        at = om_pose_mul(at, om__psm_row_pose(psm->row[k - 3], q[k]));
    const OmVec3 c = om_pose_mul(at, psm->pose_last_tip).p, p = g->tip.p;
    const double depth2 = om_norm2(p) - c.x * c.x - c.y * c.y;
    if (!(depth2 > 1e-18)) return false;
    const double uz = sqrt(depth2), across = hypot(c.x, uz);  // above 0, as uz is
    if (fabs(p.y) > across) return false;
    q[2] = uz - c.z - psm->insertion;
    // c_x cos(pitch) + u_z sin(pitch) = -p_y
    q[1] = asin(-p.y / across) - atan2(c.x, uz);
    const double vx = c.x * sin(q[1]) - uz * cos(q[1]);
    q[0] = remainder(atan2(p.z, p.x) - atan2(c.y, vx) - OM_PI / 2, 2 * OM_PI);
    return true;
}

// The rotation from the tip of q to the goal, as axis times angle.
static OmVec3 turn_left(const Goal* g, const double q[6]) {
    const OmQuat d = om_quat_mul(g->tip.q, om_quat_conj(om_psm_forward(g->psm, q).q));
    const OmVec3 v = om_vec3(d.x, d.y, d.z);
    const double s = om_norm(v), sign = d.w < 0 ? -1 : 1;
    // angle / sin(angle / 2): 2 where both vanish
    return om_scale(sign * (s > 1e-15 ? 2 * atan2(s, fabs(d.w)) / s : 2), v);
}

// M x = b, M by columns. @return false: singular
static bool solve3(const OmVec3 m[3], OmVec3 b, double x[3]) {
    const double det = om_dot(m[0], om_cross(m[1], m[2]));
    if (fabs(det) < 1e-18) return false;
    x[0] = om_dot(b, om_cross(m[1], m[2])) / det;
    x[1] = om_dot(m[0], om_cross(b, m[2])) / det;
    x[2] = om_dot(m[0], om_cross(m[1], b)) / det;
    return true;
}

// How the tip turns with each joint of roll and wrist while its position stays.
static bool find_turns(const OmPsm* psm, const double q[6], OmVec3 turn[3]) {
    double j[36];
    OmVec3 v[6], w[6];
    om_psm_jacobian(psm, q, j);
    for (int i = 0; i < 6; ++i) {
        v[i] = om_vec3(j[i], j[6 + i], j[12 + i]);
        w[i] = om_vec3(j[18 + i], j[24 + i], j[30 + i]);
    }
    for (int k = 0; k < 3; ++k) {
        double arm[3];
        if (!solve3(v, om_scale(-1, v[3 + k]), arm)) return false;
        turn[k] = w[3 + k];
        for (int i = 0; i < 3; ++i) turn[k] = om_madd(turn[k], arm[i], w[i]);
    }
    return true;
}

// Least squares from the roll and the wrist of q.
static bool fit_from(const Goal* g, double q[6]) {
    const int n = g->psm->njoint - 3;
    double damping = 1e-3;
    if (!solve_position(g, q)) return false;
    OmVec3 left = turn_left(g, q);
    for (int step = 0; step < 100 && damping < 1e9 && om_norm(left) > 1e-14; ++step) {
        OmVec3 turn[3], m[3];
        double way[3], size = 0, next[6];
        if (!find_turns(g->psm, q, turn)) return false;
        for (int k = n; k < 3; ++k) turn[k] = om_vec3(0, 0, 0);
        const OmVec3 b =
            om_vec3(om_dot(turn[0], left), om_dot(turn[1], left), om_dot(turn[2], left));
        for (int k = 0; k < 3; ++k) {
            double column[3];
            for (int i = 0; i < 3; ++i) column[i] = om_dot(turn[i], turn[k]) + (i == k) * damping;
            m[k] = om_load3(column, 0);
        }
        memcpy(next, q, sizeof next);
        bool is_better = solve3(m, b, way);
        for (int k = 0; is_better && k < n; ++k) next[3 + k] += way[k], size += way[k] * way[k];
        is_better = is_better && solve_position(g, next);
        const OmVec3 after = is_better ? turn_left(g, next) : left;
        is_better = is_better && om_norm2(after) < om_norm2(left);
        damping = is_better ? fmax(0.1 * damping, 1e-15) : 10 * damping;
        if (!is_better) continue;
        memcpy(q, next, sizeof next);
        left = after;
        if (size < 1e-28) break;
    }
    return true;
}

static double wrap_near(double angle, double near, double lo, double hi) {
    angle += 2 * OM_PI * round((near - angle) / (2 * OM_PI));
    if (angle > hi) angle -= 2 * OM_PI;
    if (angle < lo) angle += 2 * OM_PI;
    return angle;
}

static bool fit(const Goal* g, const double start[3], const double q_near[6], Fit* f) {
    const OmPsm* psm = g->psm;
    *f = (Fit){.q = {0, 0, 0, start[0], start[1], start[2]}};
    for (int k = psm->njoint; k < OM_PSM_NJOINT; ++k) f->q[k] = 0;
    if (!fit_from(g, f->q)) return false;
    f->angle = om_norm(turn_left(g, f->q));
    f->is_inside = true;
    for (int k = 3; k < psm->njoint; ++k)
        f->q[k] = wrap_near(f->q[k], q_near[k], psm->q_min[k], psm->q_max[k]);
    for (int k = 0; k < psm->njoint; ++k)
        f->is_inside =
            f->is_inside && f->q[k] >= psm->q_min[k] - 1e-9 && f->q[k] <= psm->q_max[k] + 1e-9;
    return true;
}

static double way_between(const double a[6], const double b[6]) {
    double sum = 0;
    for (int k = 0; k < OM_PSM_NJOINT; ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
    return sum;
}

// Joints within their limits first, then the smaller angle, then the shorter way.
static bool is_better(const Fit* a, const Fit* b, const double q_near[6]) {
    if (a->is_inside != b->is_inside) return a->is_inside;
    if (fabs(a->angle - b->angle) > REACHED) return a->angle < b->angle;
    return way_between(a->q, q_near) < way_between(b->q, q_near);
}

static bool search(const Goal* g, const double q_near[6], Fit* best) {
    const OmPsm* psm = g->psm;
    bool is_there = fit(g, q_near + 3, q_near, best);
    if (is_there && best->is_inside && best->angle <= REACHED) return true;
    const int n4 = psm->njoint > 4 ? NBEND : 1, n5 = psm->njoint > 5 ? NBEND : 1;
    for (int i = 0; i < NROLL * n4 * n5; ++i) {
        Fit f;
        const double share[2] = {(0.5 + i / NROLL % n4) / n4, (0.5 + i / NROLL / n4) / n5};
        double start[3] = {2 * OM_PI * (i % NROLL) / NROLL - OM_PI, 0, 0};
        for (int k = 0; k < 2; ++k)
            start[1 + k] = psm->q_min[4 + k] + share[k] * (psm->q_max[4 + k] - psm->q_min[4 + k]);
        if (!fit(g, start, q_near, &f)) continue;
        if (!is_there || is_better(&f, best, q_near)) *best = f;
        is_there = true;
    }
    return is_there;
}

OmStatus om__psm_inverse_rows(const OmPsm* psm, OmPose pose_world_tip, double max_turn,
                              const double q_near[6], double q[6]) {
    OmPsm base = *psm;
    base.pose_world_rcm = om_pose_identity();
    const Goal goal = {&base, om_pose_mul(om_pose_inverse(psm->pose_world_rcm), pose_world_tip)};
    const OmVec3 p = pose_world_tip.p;
    Fit best;
    OM_CHECK(
        search(&goal, q_near, &best), OM_INVALID,
        "point (%.1f, %.1f, %.1f) mm is out of the arm's reach: it is too near to the remote centre",
        1e3 * p.x, 1e3 * p.y, 1e3 * p.z);
    OM_TRY(om__psm_check_limits(psm, p, best.q));
    OM_CHECK(best.angle <= fmax(max_turn, REACHED), OM_INVALID,
             "point (%.1f, %.1f, %.1f) mm: the arm has %d joints with this instrument, and of this "
             "orientation it reaches the nearest one %.2f degrees off",
             1e3 * p.x, 1e3 * p.y, 1e3 * p.z, psm->njoint, best.angle / DEG);
    memcpy(q, best.q, sizeof best.q);
    return OM_OK;
}
