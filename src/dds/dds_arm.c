// dds_arm.c: operating states and motions of a simulated arm, as a client of the dVRK meets them.
//
// servo_*: a goal for now. The setpoint goes to it at ARM_SPEED and OM_WORLD_MAX_TURN at most, in a straight line
// (servo_cp) or each joint for itself (servo_jp), and stops where no other goal comes for ARM_TIMEOUT. move_*: all
// joints begin and end together, on a cubic without speed at both ends: no straight line, as on the robot. A new
// command replaces the running one. The jaw is apart: its commands do not stop the arm, nor the arm's the
// jaw; hold, and a state other than enabled and homed, stop both.
#include "dds/dds_arm.h"

#include <string.h>

#define SLACK \
    (1 + 1e-9)  // a goal that is one tick away at the largest speed is reached, rounding or not

// rad/s and m/s of a joint, of servo_jp and move_*
static const double joint_speed[OM_PSM_NJOINT] = {0.6, 0.6, 0.15, 1.0, 1.0, 1.0};

void om__arm_init(Arm* arm, const OmPsm* psm, OmPose tip, const double q[6], double jaw) {
    *arm = (Arm){
        .psm = *psm, .setpoint = tip, .goal = tip, .ratio = 1, .jaw_goal = jaw, .jaw_stop = jaw};
    memcpy(arm->q, q, sizeof arm->q);
}

const char* om__arm_joint_name(int joint) {
    static const char* const name[] = {"yaw",  "pitch",       "insertion",
                                       "roll", "wrist_pitch", "wrist_yaw"};
    return name[joint];
}

// ---- operating states ---------------------------------------------------------------------------------------------

const char* om__arm_mode_name(ArmMode mode) {
    static const char* const name[ARM_NSTATE] = {"DISABLED", "ENABLED", "PAUSED", "FAULT"};
    return name[mode];
}

enum { KEEPS = -1, SETS = 1, CLEARS = 0 };  // what a command does to is_homed

// The state after a command, by the state before; -1: refused.
static const struct {
    const char* name;
    int next[ARM_NSTATE];  // of DISABLED, ENABLED, PAUSED, FAULT
    int homed;
} command_table[] = {
    {"enable", {ARM_ENABLED, ARM_ENABLED, -1, -1}, KEEPS},
    {"disable", {ARM_DISABLED, ARM_DISABLED, ARM_DISABLED, ARM_DISABLED}, KEEPS},
    {"pause", {-1, ARM_PAUSED, ARM_PAUSED, -1}, KEEPS},
    {"resume", {-1, ARM_ENABLED, ARM_ENABLED, -1}, KEEPS},
    {"home", {ARM_ENABLED, ARM_ENABLED, -1, -1}, SETS},
    {"unhome", {ARM_DISABLED, ARM_ENABLED, ARM_PAUSED, -1}, CLEARS},
    {"fault", {ARM_FAULT, ARM_FAULT, ARM_FAULT, ARM_FAULT}, KEEPS},
    {"clear_fault", {ARM_DISABLED, ARM_ENABLED, ARM_PAUSED, ARM_DISABLED}, KEEPS},
};

OmStatus om__arm_command(Arm* arm, const char* command) {
    for (size_t k = 0; k < sizeof command_table / sizeof *command_table; ++k) {
        if (strcmp(command, command_table[k].name) != 0) continue;
        const int next = command_table[k].next[arm->mode];
        OM_CHECK(next >= 0, OM_INVALID, "\"%s\" is refused in state %s", command,
                 om__arm_mode_name(arm->mode));
        arm->mode = (ArmMode)next;
        if (command_table[k].homed != KEEPS) arm->is_homed = command_table[k].homed == SETS;
        if (arm->mode != ARM_ENABLED || !arm->is_homed) om__arm_hold(arm);
        return OM_OK;
    }
    return om_error(OM_INVALID, "\"%.40s\" is no state command", command);
}

static OmStatus check_ready(const Arm* arm) {
    OM_CHECK(arm->mode == ARM_ENABLED, OM_INVALID, "the arm is %s; enable it first",
             om__arm_mode_name(arm->mode));
    OM_CHECK(arm->is_homed, OM_INVALID, "the arm is not homed; send \"home\" first");
    return OM_OK;
}

// ---- commands -----------------------------------------------------------------------------------------------------

static OmStatus check_pose(OmPose* pose) {
    const OmQuat q = pose->q;
    const double norm = sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    OM_CHECK(om_is_finite3(pose->p) && isfinite(norm), OM_INVALID, "the goal is not finite");
    OM_CHECK(fabs(norm - 1) < 1e-3, OM_INVALID, "the goal's quaternion has length %g; must be 1",
             norm);
    if (fabs(norm - 1) > 1e-12) pose->q = om_quat_normalize(q);
    return OM_OK;
}

// The index that a joint's name stands for: "0" to "5", or the dVRK's; -1: none.
static int find_joint(const char* name) {
    if (name[0] >= '0' && name[0] < '0' + OM_PSM_NJOINT && name[1] == 0) return name[0] - '0';
    for (int i = 0; i < OM_PSM_NJOINT; ++i)
        if (strcmp(name, om__arm_joint_name(i)) == 0) return i;
    return -1;
}

// Positions by names in any order, or without names in the order of the joints.
static OmStatus read_joints(const Arm* arm, const LinkJoints* joints, double q[6]) {
    bool has[OM_PSM_NJOINT] = {false};
    const int n = arm->psm.njoint;
    OM_CHECK(joints->nposition == n, OM_INVALID, "%d positions; the arm has %d joints",
             joints->nposition, n);
    OM_CHECK(joints->nname == 0 || joints->nname == n, OM_INVALID, "%d names of joints; none or %d",
             joints->nname, n);
    for (int i = n; i < OM_PSM_NJOINT; ++i) q[i] = 0;
    for (int i = 0; i < n; ++i) {
        const int k = joints->nname > 0 ? find_joint(joints->name[i]) : i;
        OM_CHECK(k >= 0 && k < n, OM_INVALID, "\"%s\" is no joint", joints->name[i]);
        OM_CHECK(!has[k], OM_INVALID, "joint \"%s\" is named twice", joints->name[i]);
        OM_CHECK(isfinite(joints->position[i]), OM_INVALID, "%s is not finite",
                 om__arm_joint_name(k));
        has[k] = true;
        q[k] = joints->position[i];
    }
    for (int i = 0; i < n; ++i)
        OM_CHECK(q[i] >= arm->psm.q_min[i] - 1e-9 && q[i] <= arm->psm.q_max[i] + 1e-9, OM_INVALID,
                 "%s is %.4g, outside of its limits %.4g to %.4g", om__arm_joint_name(i), q[i],
                 arm->psm.q_min[i], arm->psm.q_max[i]);
    return OM_OK;
}

OmVec3 om__arm_turn(OmQuat from, OmQuat to) {
    const OmQuat d = om_quat_mul(to, om_quat_conj(from));
    const double s = sqrt(d.x * d.x + d.y * d.y + d.z * d.z), sign = d.w < 0 ? -1 : 1;
    // angle / sin(angle / 2): 2 where both vanish
    const double k = s > 1e-12 ? 2 * atan2(s, fabs(d.w)) / s : 2;
    return om_scale(sign * k, om_vec3(d.x, d.y, d.z));
}

OmStatus om__arm_reach(const Arm* arm, OmPose goal, double q[6], OmPose* reached) {
    return om_psm_inverse_nearest(&arm->psm, goal, arm->q, q, reached);
}

OmStatus om__arm_servo_cp(Arm* arm, double time, OmPose goal) {
    double q[OM_PSM_NJOINT];
    const bool is_free = arm->psm.njoint < OM_PSM_NJOINT;
    OM_TRY(check_ready(arm));
    OM_TRY(check_pose(&goal));
    if (is_free) OM_TRY(om__arm_reach(arm, goal, q, &goal));
    const double way = om_distance(goal.p, arm->setpoint.p);
    const double turn = om_quat_angle(goal.q, arm->setpoint.q);
    OM_CHECK(way <= ARM_MAX_STEP, OM_INVALID,
             "the goal is %.1f mm from the setpoint; at most %.0f mm: stream goals on the way, or "
             "use move_cp",
             1e3 * way, 1e3 * ARM_MAX_STEP);
    OM_CHECK(turn <= ARM_MAX_TURN, OM_INVALID,
             "the goal is turned by %.2f rad from the setpoint; at most %.1f", turn, ARM_MAX_TURN);
    if (!is_free) OM_TRY(om__arm_reach(arm, goal, q, &goal));
    arm->goal = goal;
    arm->heard = time;
    arm->motion = ARM_SERVO_CP;
    return OM_OK;
}

OmStatus om__arm_servo_jp(Arm* arm, double time, const LinkJoints* joints) {
    double q[OM_PSM_NJOINT];
    OM_TRY(check_ready(arm));
    OM_TRY(read_joints(arm, joints, q));
    const double way = om_distance(om_psm_forward(&arm->psm, q).p, arm->setpoint.p);
    OM_CHECK(way <= ARM_MAX_STEP, OM_INVALID,
             "the goal is %.1f mm from the setpoint; at most %.0f mm: stream goals on the way, or "
             "use move_jp",
             1e3 * way, 1e3 * ARM_MAX_STEP);
    memcpy(arm->goal_q, q, sizeof q);
    arm->heard = time;
    arm->motion = ARM_SERVO_JP;
    return OM_OK;
}

// The time of a cubic whose largest speed is 1.5 of its mean: no joint is faster than its limit, and the tip does not
// turn faster than a world turns it.
static void begin_move(Arm* arm, double time, OmPose goal, const double q[6]) {
    double longest = 0, turn = 0;
    for (int i = 0; i < OM_PSM_NJOINT; ++i) {
        const double way = fabs(q[i] - arm->q[i]);
        longest = fmax(longest, way / joint_speed[i]);
        if (i != 2) turn += way;
    }
    memcpy(arm->from_q, arm->q, sizeof arm->from_q);
    memcpy(arm->goal_q, q, sizeof arm->goal_q);
    arm->goal = goal;
    arm->begin = arm->heard = time;
    arm->patience = INFINITY;
    arm->duration = 1.5 * fmax(longest, turn / OM_WORLD_MAX_TURN) / arm->ratio;
    arm->motion = ARM_MOVE;
}

OmStatus om__arm_move_cp(Arm* arm, double time, OmPose goal) {
    double q[OM_PSM_NJOINT];
    OM_TRY(check_ready(arm));
    OM_TRY(check_pose(&goal));
    OM_TRY(om__arm_reach(arm, goal, q, &goal));
    begin_move(arm, time, goal, q);
    return OM_OK;
}

OmStatus om__arm_move_jp(Arm* arm, double time, const LinkJoints* joints) {
    double q[OM_PSM_NJOINT];
    OM_TRY(check_ready(arm));
    OM_TRY(read_joints(arm, joints, q));
    begin_move(arm, time, om_psm_forward(&arm->psm, q), q);
    return OM_OK;
}

static OmStatus check_jaw(const Arm* arm) {
    OM_CHECK(arm->psm.has_jaw, OM_INVALID, "the instrument has no jaw");
    return check_ready(arm);
}

OmStatus om__arm_jaw(Arm* arm, const LinkJoints* joints) {
    OM_TRY(check_jaw(arm));
    OM_CHECK(joints->nposition == 1, OM_INVALID, "%d positions; a jaw has one", joints->nposition);
    OM_CHECK(isfinite(joints->position[0]), OM_INVALID, "the jaw's angle is not finite");
    arm->jaw_goal = fmax(arm->psm.jaw_min, fmin(arm->psm.jaw_max, joints->position[0]));
    return OM_OK;
}

OmStatus om__arm_jaw_effort(Arm* arm, const LinkJoints* joints) {
    OM_TRY(check_jaw(arm));
    OM_CHECK(joints->neffort == 1, OM_INVALID, "%d efforts; a jaw has one", joints->neffort);
    const double effort = joints->effort[0];
    OM_CHECK(isfinite(effort), OM_INVALID, "the jaw's effort is not finite");
    if (effort == 0)
        arm->jaw_goal = arm->jaw_stop;
    else
        arm->jaw_goal = effort < 0 ? arm->psm.jaw_min : arm->psm.jaw_max;
    return OM_OK;
}

OmStatus om__arm_set_ratio(Arm* arm, double ratio) {
    OM_CHECK(ratio > 0 && ratio <= 1, OM_INVALID, "the ratio is %g; above 0, to 1", ratio);
    arm->ratio = ratio;
    return OM_OK;
}

void om__arm_hold(Arm* arm) {
    arm->motion = ARM_HOLD;
    arm->jaw_goal = arm->jaw_stop;
}

// ---- motion -------------------------------------------------------------------------------------------------------

// Part of the way to the goal that the limits allow in `dt`; 1: the goal.
static double part_of_way(const Arm* arm, double dt) {
    const double way = om_distance(arm->goal.p, arm->setpoint.p);
    const double turn = om_quat_angle(arm->setpoint.q, arm->goal.q);
    double part = 1;
    if (way > ARM_SPEED * dt * SLACK) part = ARM_SPEED * dt / way;
    if (turn * part > OM_WORLD_MAX_TURN * dt * SLACK) part = OM_WORLD_MAX_TURN * dt / turn;
    return part;
}

// Towards the goal; at a pose out of reach the arm stops.
static void step_servo_cp(Arm* arm, double dt) {
    const double part = part_of_way(arm, dt);
    OmPose next = arm->goal;
    if (part < 1) {
        next.p = om_madd(arm->setpoint.p, part, om_sub(arm->goal.p, arm->setpoint.p));
        next.q = om_quat_slerp(arm->setpoint.q, arm->goal.q, part);
    }
    if (om__arm_reach(arm, next, arm->q, &next) == OM_OK)
        arm->setpoint = part < 1 ? next : arm->goal;
    else
        arm->motion = ARM_HOLD;
}

static void step_servo_jp(Arm* arm, double dt) {
    for (int i = 0; i < OM_PSM_NJOINT; ++i) {
        const double most = joint_speed[i] * dt;
        arm->q[i] += fmax(-most, fmin(most, arm->goal_q[i] - arm->q[i]));
    }
    arm->setpoint = om_psm_forward(&arm->psm, arm->q);
}

static void step_move(Arm* arm, double time) {
    const double t = arm->duration > 0 ? (time - arm->begin) / arm->duration : 1;
    if (t >= 1) {
        memcpy(arm->q, arm->goal_q, sizeof arm->q);
        arm->setpoint = arm->goal;
        arm->motion = ARM_HOLD;
        return;
    }
    const double s = t * t * (3 - 2 * t);
    for (int i = 0; i < OM_PSM_NJOINT; ++i)
        arm->q[i] = arm->from_q[i] + s * (arm->goal_q[i] - arm->from_q[i]);
    arm->setpoint = om_psm_forward(&arm->psm, arm->q);
}

static bool is_at_goal(const Arm* arm) {
    const bool is_pose = arm->motion == ARM_SERVO_CP;
    return is_pose ? memcmp(&arm->setpoint, &arm->goal, sizeof arm->goal) == 0
                   : memcmp(arm->q, arm->goal_q, sizeof arm->q) == 0;
}

bool om__arm_step(Arm* arm, double time, double dt) {
    const OmPose before = arm->setpoint;
    const bool is_servo = arm->motion == ARM_SERVO_CP || arm->motion == ARM_SERVO_JP;
    const double patience = is_servo ? ARM_TIMEOUT : arm->patience;
    const bool is_late = arm->motion != ARM_HOLD && time - arm->heard > patience;
    arm->has_timed_out = is_late && !is_at_goal(arm);
    if (is_late) arm->motion = ARM_HOLD;
    if (arm->motion == ARM_SERVO_CP) step_servo_cp(arm, dt);
    if (arm->motion == ARM_SERVO_JP) step_servo_jp(arm, dt);
    if (arm->motion == ARM_MOVE) step_move(arm, time + dt);
    return memcmp(&before, &arm->setpoint, sizeof before) != 0;
}
