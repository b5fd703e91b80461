// robot_psm.c: kinematics of the da Vinci Research Kit's patient-side manipulator.
//
// Link i is Rx(alpha) Tx(a) Rz(theta) Tz(d) (modified Denavit-Hartenberg, Craig); the numbers are those of
// the dVRK's instrument files. The inverse has a closed form. The wrist yaw axis z6 is known from the
// wanted pose; shaft, wrist and tip lie in one plane with it: p = a x5 + r s with x5 normal to z6. So x5 is
// the direction of the part of p normal to z6, and r s = p - a x5 gives yaw, pitch and insertion; the
// remaining rotation gives roll and wrist.
#include <string.h>

#include "robot/robot_internal.h"

#define DEG (OM_PI / 180.0)

OmPsm om_psm_default(OmInstrument instrument, OmPose pose_world_rcm) {
    OmPsm psm = {.pose_world_rcm = pose_world_rcm,
                 .insertion = -0.4318,
                 .shaft = 0.4162,
                 .wrist = instrument == OM_LARGE_NEEDLE_DRIVER ? 0.0091 : 0.0107,
                 .q_min = {-1.588, -0.925025, 0.0, -4.53786, -1.39626, -1.39626},
                 .q_max = {1.588, 0.925025, 0.240, 4.53786, 1.39626, 1.39626},
                 .jaw_min = instrument == OM_LARGE_NEEDLE_DRIVER ? -0.698132 : -0.349066,
                 .jaw_max = 1.39626,
                 .njoint = OM_PSM_NJOINT,
                 .has_jaw = true,
                 .pose_last_tip = om_pose_identity()};
    return psm;
}

const char* om_psm_joint_name(int joint) {
    static const char* const name[] = {"yaw",  "pitch",       "insertion",
                                       "roll", "wrist pitch", "wrist yaw"};
    return joint >= 0 && joint < OM_PSM_NJOINT ? name[joint] : "";
}

static OmPose link_pose(OmPsmRow l) {
    OmQuat rx = om_quat_axis_angle(om_vec3(1, 0, 0), l.alpha);
    OmQuat rz = om_quat_axis_angle(om_vec3(0, 0, 1), l.theta);
    OmVec3 p = om_add(om_vec3(l.a, 0, 0), om_quat_rotate(rx, om_vec3(0, 0, l.d)));
    OmPose pose = {p, om_quat_mul(rx, rz)};
    return pose;
}

OmPose om__psm_row_pose(OmPsmRow row, double q) {
    row.theta += q;
    return link_pose(row);
}

static void make_links(const OmPsm* psm, const double q[6], OmPsmRow link[6]) {
    const double h = OM_PI / 2;
    link[0] = (OmPsmRow){h, 0, q[0] + h, 0};
    link[1] = (OmPsmRow){-h, 0, q[1] - h, 0};
    link[2] = (OmPsmRow){h, 0, 0, psm->insertion + q[2]};
    for (int k = 3; psm->has_rows && k < psm->njoint; ++k) {
        link[k] = psm->row[k - 3];
        link[k].theta += q[k];
    }
    if (psm->has_rows) return;
    link[3] = (OmPsmRow){0, 0, q[3], psm->shaft};
    link[4] = (OmPsmRow){-h, 0, q[4] - h, 0};
    link[5] = (OmPsmRow){-h, psm->wrist, q[5] - h, 0};
}

// The instrument's last rotation: rows (0 -1 0), (0 0 1), (-1 0 0).
static OmMat3 tip_rotation(void) {
    return om_mat3_cols(om_vec3(0, 0, -1), om_vec3(-1, 0, 0), om_vec3(0, 1, 0));
}

// Frames 1 to njoint in the world.
static void chain(const OmPsm* psm, const double q[6], OmPose frame[6]) {
    OmPsmRow link[6];
    make_links(psm, q, link);
    OmPose at = psm->pose_world_rcm;
    for (int i = 0; i < psm->njoint; ++i) {
        at = om_pose_mul(at, link_pose(link[i]));
        frame[i] = at;
    }
}

OmPose om_psm_forward(const OmPsm* psm, const double q[6]) {
    OmPose frame[6];
    chain(psm, q, frame);
    OmPose tip = {{0, 0, 0}, om_quat_from_mat3(tip_rotation())};
    if (psm->has_rows) tip = psm->pose_last_tip;
    OmPose pose = om_pose_mul(frame[psm->njoint - 1], tip);
    pose.q = om_quat_normalize(pose.q);
    return pose;
}

void om_psm_jacobian(const OmPsm* psm, const double q[6], double jacobian[36]) {
    OmPose frame[6];
    chain(psm, q, frame);
    const OmPose last = frame[psm->njoint - 1];
    OmVec3 tip = psm->has_rows ? om_pose_apply(last, psm->pose_last_tip.p) : last.p;
    memset(jacobian, 0, 36 * sizeof *jacobian);
    for (int i = 0; i < psm->njoint; ++i) {
        OmVec3 z = om_quat_rotate(frame[i].q, om_vec3(0, 0, 1));
        bool is_prismatic = i == 2;
        OmVec3 v = is_prismatic ? z : om_cross(z, om_sub(tip, frame[i].p));
        OmVec3 w = is_prismatic ? om_vec3(0, 0, 0) : z;
        const double column[6] = {v.x, v.y, v.z, w.x, w.y, w.z};
        for (int r = 0; r < 6; ++r) jacobian[6 * r + i] = column[r];
    }
}

void om_psm_joint_torque(const OmPsm* psm, const double q[6], OmVec3 force, OmVec3 torque,
                         double effort[6]) {
    double j[36];
    om_psm_jacobian(psm, q, j);
    const double w[6] = {force.x, force.y, force.z, torque.x, torque.y, torque.z};
    for (int i = 0; i < 6; ++i) {
        effort[i] = 0;
        for (int r = 0; r < 6; ++r) effort[i] += j[6 * r + i] * w[r];
    }
}

// ---- inverse --------------------------------------------------------------------------------------------

static double wrap(double angle) { return remainder(angle, 2 * OM_PI); }

OmStatus om__psm_check_limits(const OmPsm* psm, OmVec3 tip_world, const double q[6]) {
    const double slack = 1e-9;  // rounding of the closed form
    for (int i = 0; i < 6; ++i) {
        if (q[i] >= psm->q_min[i] - slack && q[i] <= psm->q_max[i] + slack) continue;
        bool is_length = i == 2;
        double unit = is_length ? 1e3 : 1 / DEG;
        double limit = q[i] < psm->q_min[i] ? psm->q_min[i] : psm->q_max[i];
        return om_error(
            OM_INVALID,
            "point (%.1f, %.1f, %.1f) mm is out of the arm's reach: %s would be %.1f %s, its limit "
            "is %.1f",
            1e3 * tip_world.x, 1e3 * tip_world.y, 1e3 * tip_world.z, om_psm_joint_name(i),
            unit * q[i], is_length ? "mm" : "degrees", unit * limit);
    }
    return OM_OK;
}

OmStatus om_psm_inverse(const OmPsm* psm, OmPose pose_world_tip, const double q_near[6],
                        double q[6]) {
    if (psm->has_rows) return om__psm_inverse_rows(psm, pose_world_tip, 0, q_near, q);
    OmPose tip = om_pose_mul(om_pose_inverse(psm->pose_world_rcm), pose_world_tip);
    OmVec3 p = tip.p, p_world = pose_world_tip.p;
    OmMat3 r06 = om_mat3_mul(om_quat_to_mat3(tip.q), om_mat3_transpose(tip_rotation()));
    OmVec3 x5 = om_madd(p, -om_dot(p, r06.cz), r06.cz);
    OM_CHECK(
        om_norm(x5) > 1e-9, OM_INVALID,
        "point (%.1f, %.1f, %.1f) mm is singular: the wrist's axis passes through the remote centre",
        1e3 * p_world.x, 1e3 * p_world.y, 1e3 * p_world.z);
    x5 = om_normalize(x5);
    OmVec3 wrist = om_madd(p, -psm->wrist, x5);
    double r = om_norm(wrist);
    OM_CHECK(r > 1e-9, OM_INVALID,
             "point (%.1f, %.1f, %.1f) mm is out of the arm's reach: it is at the remote centre",
             1e3 * p_world.x, 1e3 * p_world.y, 1e3 * p_world.z);
    // s = (cos q1 sin q0, -sin q1, -cos q0 cos q1)
    OmVec3 s = om_scale(1 / r, wrist);
    double sol[6];
    sol[1] = asin(fmax(-1, fmin(1, -s.y)));
    sol[0] = atan2(s.x, -s.z);
    sol[2] = r - psm->insertion - psm->shaft;
    // The remaining rotation, of roll and wrist.
    OmMat3 rx90 = om_quat_to_mat3(om_quat_axis_angle(om_vec3(1, 0, 0), OM_PI / 2));
    OmPsm base = *psm;
    base.pose_world_rcm = om_pose_identity();
    double q3[6] = {sol[0], sol[1], sol[2], 0, 0, 0};
    OmPose frame[6];
    chain(&base, q3, frame);
    OmMat3 r03 = om_quat_to_mat3(frame[2].q);
    OmMat3 r36 = om_mat3_mul(om_mat3_transpose(r03), r06);
    // z6 = (cos q3 cos q4, sin q3 cos q4, -sin q4) in frame 3
    OmVec3 z6 = r36.cz;
    sol[4] = asin(fmax(-1, fmin(1, -z6.z)));
    sol[3] = atan2(z6.y, z6.x);
    OmMat3 r4 = om_quat_to_mat3(om_quat_axis_angle(om_vec3(0, 0, 1), sol[3]));
    OmMat3 r5 =
        om_mat3_mul(om_mat3_transpose(rx90),
                    om_quat_to_mat3(om_quat_axis_angle(om_vec3(0, 0, 1), sol[4] - OM_PI / 2)));
    OmVec3 x6 = om_mat3_apply_transposed(om_mat3_mul(r4, r5), r36.cx);
    sol[5] = wrap(atan2(-x6.z, x6.x) + OM_PI / 2);
    // The range of the roll is more than a turn: choose the angle nearest to the previous one.
    sol[3] += 2 * OM_PI * round((q_near[3] - sol[3]) / (2 * OM_PI));
    if (sol[3] > psm->q_max[3]) sol[3] -= 2 * OM_PI;
    if (sol[3] < psm->q_min[3]) sol[3] += 2 * OM_PI;
    OM_TRY(om__psm_check_limits(psm, p_world, sol));
    // A jaw that points back along the shaft: x5 was taken with the wrong sign, the other one bends the wrist further.
    OM_CHECK(om_distance(om_psm_forward(&base, sol).p, p) < 1e-6, OM_INVALID,
             "point (%.1f, %.1f, %.1f) mm: wrist pitch would be more than 90 degrees, its limit is "
             "%.1f",
             1e3 * p_world.x, 1e3 * p_world.y, 1e3 * p_world.z, psm->q_max[4] / DEG);
    memcpy(q, sol, sizeof sol);
    return OM_OK;
}

OmStatus om_psm_inverse_nearest(const OmPsm* psm, OmPose pose_world_tip, const double q_near[6],
                                double q[6], OmPose* reached) {
    const bool is_free = psm->njoint < OM_PSM_NJOINT;
    OM_TRY(is_free ? om__psm_inverse_rows(psm, pose_world_tip, OM_PI, q_near, q)
                   : om_psm_inverse(psm, pose_world_tip, q_near, q));
    *reached = pose_world_tip;
    if (is_free) reached->q = om_psm_forward(psm, q).q;
    return OM_OK;
}

#define TURN_STEP (5 * OM_PI / 180)

// Squared change of the angles, to choose among turns of the same size.
static double change_of(const double q[6], const double q_near[6]) {
    double sum = 0;
    for (int i = 0; i < 6; ++i) sum += i == 2 ? 0 : (q[i] - q_near[i]) * (q[i] - q_near[i]);
    return sum;
}

// Turns about 26 axes: the directions to the faces, edges and corners of a cube around the tip.
OmStatus om_psm_inverse_turned(const OmPsm* psm, OmPose pose_world_tip, double max_turn,
                               const double q_near[6], double q[6], OmPose* turned) {
    if (psm->njoint < OM_PSM_NJOINT) {
        OM_TRY(om__psm_inverse_rows(psm, pose_world_tip, max_turn, q_near, q));
        *turned = (OmPose){pose_world_tip.p, om_psm_forward(psm, q).q};
        return OM_OK;
    }
    const OmStatus straight = om_psm_inverse(psm, pose_world_tip, q_near, q);
    if (straight == OM_OK) *turned = pose_world_tip;
    if (straight != OM_INVALID || !(max_turn > 0)) return straight;
    char message[256];
    snprintf(message, sizeof message, "%s", om_error_message());
    const int nturn = (int)floor(fmin(max_turn, OM_PI) / TURN_STEP + 1e-9);
    double best = INFINITY, near[6];
    memcpy(near, q_near, sizeof near);  // q may be q_near
    for (int k = 1; k <= nturn && isinf(best); ++k) {
        for (int a = 0; a < 27; ++a) {
            const OmVec3 axis = om_vec3(a % 3 - 1, a / 3 % 3 - 1, a / 9 - 1);
            if (om_norm2(axis) == 0) continue;
            OmPose pose = pose_world_tip;
            double sol[6];
            pose.q = om_quat_mul(pose.q, om_quat_axis_angle(om_normalize(axis), k * TURN_STEP));
            if (om_psm_inverse(psm, pose, near, sol) != OM_OK || change_of(sol, near) >= best)
                continue;
            best = change_of(sol, near);
            memcpy(q, sol, sizeof sol);
            *turned = pose;
        }
    }
    return isinf(best) ? om_error(OM_INVALID, "%s", message) : OM_OK;
}
