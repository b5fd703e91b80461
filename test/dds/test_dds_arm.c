// test_dds_arm.c: operating states and motions of a simulated arm: what is refused, how fast it moves, where it stops.
#include <string.h>

#include "dds/dds_arm.h"
#include "test_common.h"

#define DT 0.01

static Arm make_arm(bool is_home) {
    const OmPsm psm = om_psm_default(OM_PROGRASP, om_pose_identity());
    const double q[OM_PSM_NJOINT] = {0.1, -0.1, 0.12, 0.2, 0.1, -0.1};
    Arm arm;
    om__arm_init(&arm, &psm, om_psm_forward(&psm, q), q, 0.5);
    if (is_home) assert_ok(om__arm_command(&arm, "home"));
    return arm;
}

static OmPose moved(const Arm* arm, double x, double y, double z) {
    OmPose goal = arm->setpoint;
    goal.p = om_add(goal.p, om_vec3(x, y, z));
    return goal;
}

static LinkJoints joints_of(const double* q, int n) {
    LinkJoints j = {.nposition = n};
    memcpy(j.position, q, (size_t)n * sizeof *q);
    return j;
}

// Each row of the table, and what it does to is_homed.
static void states(void** unused) {
    (void)unused;
    static const struct {
        ArmMode mode;
        const char* command;
        int next;  // -1: refused
    } row[] = {{ARM_DISABLED, "enable", ARM_ENABLED},
               {ARM_DISABLED, "pause", -1},
               {ARM_DISABLED, "resume", -1},
               {ARM_DISABLED, "home", ARM_ENABLED},
               {ARM_ENABLED, "pause", ARM_PAUSED},
               {ARM_ENABLED, "disable", ARM_DISABLED},
               {ARM_ENABLED, "fault", ARM_FAULT},
               {ARM_ENABLED, "unhome", ARM_ENABLED},
               {ARM_PAUSED, "enable", -1},
               {ARM_PAUSED, "resume", ARM_ENABLED},
               {ARM_PAUSED, "home", -1},
               {ARM_PAUSED, "disable", ARM_DISABLED},
               {ARM_FAULT, "enable", -1},
               {ARM_FAULT, "resume", -1},
               {ARM_FAULT, "clear_fault", ARM_DISABLED},
               {ARM_FAULT, "home", -1}};
    for (size_t k = 0; k < sizeof row / sizeof *row; ++k) {
        Arm arm = make_arm(true);
        arm.mode = row[k].mode;
        const OmStatus status = om__arm_command(&arm, row[k].command);
        assert_int_equal(status, row[k].next < 0 ? OM_INVALID : OM_OK);
        assert_int_equal(arm.mode, row[k].next < 0 ? row[k].mode : (ArmMode)row[k].next);
    }
    Arm arm = make_arm(true);
    assert_true(arm.is_homed);
    assert_ok(om__arm_command(&arm, "unhome"));
    assert_false(arm.is_homed);
    assert_status(om__arm_command(&arm, "dance"), OM_INVALID);
}

// Before enabled and homed nothing moves.
static void not_ready(void** unused) {
    (void)unused;
    Arm arm = make_arm(false);
    const LinkJoints j = joints_of(arm.q, 6), jaw = joints_of((double[]){0.2}, 1);
    for (int k = 0; k < 2; ++k) {
        assert_status(om__arm_servo_cp(&arm, 0, moved(&arm, 0, 0, 0.001)), OM_INVALID);
        assert_status(om__arm_move_cp(&arm, 0, moved(&arm, 0, 0, 0.001)), OM_INVALID);
        assert_status(om__arm_servo_jp(&arm, 0, &j), OM_INVALID);
        assert_status(om__arm_move_jp(&arm, 0, &j), OM_INVALID);
        assert_status(om__arm_jaw(&arm, &jaw), OM_INVALID);
        assert_false(om__arm_step(&arm, 0, DT));
        assert_ok(om__arm_command(&arm, "enable"));  // enabled, but not homed
    }
    assert_ok(om__arm_command(&arm, "home"));
    assert_ok(om__arm_servo_cp(&arm, 0, moved(&arm, 0, 0, 0.001)));
}

// A state other than enabled and homed stops a motion, and the arm does not continue it afterwards.
static void stops(void** unused) {
    (void)unused;
    Arm arm = make_arm(true);
    assert_ok(om__arm_move_cp(&arm, 0, moved(&arm, 0, 0.02, 0)));
    assert_true(om__arm_step(&arm, 0, DT));
    assert_ok(om__arm_command(&arm, "pause"));
    assert_false(om__arm_step(&arm, DT, DT));
    assert_ok(om__arm_command(&arm, "resume"));
    assert_false(om__arm_step(&arm, 2 * DT, DT));
    assert_ok(om__arm_move_cp(&arm, 0, moved(&arm, 0, 0.02, 0)));
    assert_ok(om__arm_command(&arm, "unhome"));  // enabled still
    assert_false(om__arm_step(&arm, 0, DT));
}

static void refused(void** unused) {
    (void)unused;
    Arm arm = make_arm(true);
    OmPose goal = moved(&arm, NAN, 0, 0);
    assert_status(om__arm_servo_cp(&arm, 0, goal), OM_INVALID);
    assert_status(om__arm_move_cp(&arm, 0, goal), OM_INVALID);
    goal = moved(&arm, 0, 0, 0);
    goal.q = (OmQuat){0};
    assert_status(om__arm_servo_cp(&arm, 0, goal), OM_INVALID);
    assert_status(om__arm_servo_cp(&arm, 0, moved(&arm, 0, 0.051, 0)), OM_INVALID);  // a jump
    assert_ok(om__arm_servo_cp(&arm, 0, moved(&arm, 0, 0.049, 0)));
    assert_status(om__arm_move_cp(&arm, 0, moved(&arm, 0, 0, -0.3)), OM_INVALID);  // out of reach
    LinkJoints j = joints_of(arm.q, 6);
    j.nposition = 5;
    assert_status(om__arm_move_jp(&arm, 0, &j), OM_INVALID);
    j = joints_of(arm.q, 6);
    j.position[2] = 0.3;  // beyond 240 mm
    assert_status(om__arm_move_jp(&arm, 0, &j), OM_INVALID);
    j = joints_of((double[]){0.1, 0.2}, 2);
    assert_status(om__arm_jaw(&arm, &j), OM_INVALID);
    j = joints_of((double[]){NAN}, 1);
    assert_status(om__arm_jaw(&arm, &j), OM_INVALID);
    j.position[0] = -5;  // closes harder: to the limit
    assert_ok(om__arm_jaw(&arm, &j));
    assert_near(arm.jaw_goal, arm.psm.jaw_min, 0);
}

// Names in any order, of both kinds; unknown and double ones.
static void names(void** unused) {
    (void)unused;
    static const char* const order[2][6] = {
        {"wrist_yaw", "wrist_pitch", "roll", "insertion", "pitch", "yaw"},
        {"5", "4", "3", "2", "1", "0"}};
    for (int k = 0; k < 2; ++k) {
        Arm arm = make_arm(true);
        LinkJoints j = {.nposition = 6, .nname = 6};
        const double q[6] = {0.12, -0.11, 0.121, 0.21, 0.11, -0.12};
        for (int i = 0; i < 6; ++i) {
            snprintf(j.name[i], sizeof j.name[i], "%s", order[k][i]);
            j.position[i] = q[5 - i];
        }
        assert_ok(om__arm_move_jp(&arm, 0, &j));
        for (int i = 0; i < 6; ++i) assert_near(arm.goal_q[i], q[i], 0);
        strcpy(j.name[0], j.name[1]);
        assert_status(om__arm_move_jp(&arm, 0, &j), OM_INVALID);
        strcpy(j.name[0], "elbow");
        assert_status(om__arm_move_jp(&arm, 0, &j), OM_INVALID);
    }
}

// 40 mm at 0.25 m/s are 16 steps in a straight line; without another goal the arm stops after 0.25 s.
static void servo(void** unused) {
    (void)unused;
    Arm arm = make_arm(true);
    const OmVec3 from = arm.setpoint.p;
    const OmPose goal = moved(&arm, 0, 0, -0.04);
    assert_ok(om__arm_servo_cp(&arm, 0, goal));
    int n = 0;
    while (om__arm_step(&arm, n * DT, DT) && n < 100) {
        ++n;
        assert_near(arm.setpoint.p.x, from.x, 1e-12);
        assert_near(om_distance(arm.setpoint.p, from), fmin(0.04, 0.0025 * n), 1e-9);
    }
    assert_int_equal(n, 16);
    assert_near(om_distance(arm.setpoint.p, goal.p), 0, 0);
    assert_ok(om__arm_servo_cp(&arm, 1, moved(&arm, 0, 0, 0.04)));
    assert_false(arm.has_timed_out);
    assert_false(om__arm_step(&arm, 1.26, DT));
    assert_true(arm.has_timed_out);
    assert_false(om__arm_step(&arm, 1.27, DT));
    assert_false(arm.has_timed_out);  // said once
    assert_int_equal(arm.motion, ARM_HOLD);
}

// A move ends at its goal to the last bit, in the time that the slowest joint needs, and not along a line.
static void move(void** unused) {
    (void)unused;
    Arm arm = make_arm(true);
    const OmPose goal = moved(&arm, 0.03, 0.02, -0.03);
    double q[6], longest = 0, turn = 0, off = 0;
    assert_ok(om_psm_inverse(&arm.psm, goal, arm.q, q));
    static const double limit[6] = {0.6, 0.6, 0.15, 1, 1, 1};
    for (int i = 0; i < 6; ++i) {
        longest = fmax(longest, fabs(q[i] - arm.q[i]) / limit[i]);
        turn += i == 2 ? 0 : fabs(q[i] - arm.q[i]);
    }
    const OmVec3 from = arm.setpoint.p, way = om_normalize(om_sub(goal.p, from));
    assert_ok(om__arm_move_cp(&arm, 0, goal));
    int n = 0;
    double q_before[6];
    for (; arm.motion == ARM_MOVE && n < 1000; ++n) {
        memcpy(q_before, arm.q, sizeof q_before);
        om__arm_step(&arm, n * DT, DT);
        for (int i = 0; i < 6; ++i)
            assert_below(fabs(arm.q[i] - q_before[i]), limit[i] * DT * 1.001);
        const OmVec3 d = om_sub(arm.setpoint.p, from);
        off = fmax(off, om_norm(om_madd(d, -om_dot(d, way), way)));
    }
    assert_int_equal(n, (int)ceil(1.5 * fmax(longest, turn) / DT));
    assert_near(om_distance(arm.setpoint.p, goal.p), 0, 0);
    assert_below(1e-5, off);  // m: a straight line has 0
}

// At a quarter of the speed a move takes four times as long.
static void ratio(void** unused) {
    (void)unused;
    Arm arm = make_arm(true), slow = make_arm(true);
    assert_status(om__arm_set_ratio(&slow, 0), OM_INVALID);
    assert_status(om__arm_set_ratio(&slow, 1.1), OM_INVALID);
    assert_status(om__arm_set_ratio(&slow, NAN), OM_INVALID);
    assert_ok(om__arm_set_ratio(&slow, 0.25));
    assert_ok(om__arm_move_cp(&arm, 0, moved(&arm, 0, 0.02, 0)));
    assert_ok(om__arm_move_cp(&slow, 0, moved(&slow, 0, 0.02, 0)));
    assert_near(slow.duration, 4 * arm.duration, 1e-12);
}

// The jaw and the arm do not stop each other; hold stops both, and so does each state but enabled and homed.
static void jaw(void** unused) {
    (void)unused;
    Arm arm = make_arm(true);
    const LinkJoints j = joints_of((double[]){0.1}, 1);
    assert_ok(om__arm_move_cp(&arm, 0, moved(&arm, 0, 0.02, 0)));
    om__arm_step(&arm, 0, DT);
    assert_ok(om__arm_jaw(&arm, &j));
    assert_int_equal(arm.motion, ARM_MOVE);
    assert_true(om__arm_step(&arm, DT, DT));
    assert_near(arm.jaw_goal, 0.1, 0);
    arm.jaw_stop = 0.3;
    om__arm_hold(&arm);
    assert_false(om__arm_step(&arm, 2 * DT, DT));
    assert_near(arm.jaw_goal, 0.3, 0);
    static const char* const command[] = {"pause", "disable", "fault", "unhome", "home", "resume"};
    for (int k = 0; k < 6; ++k) {
        arm = make_arm(true);
        assert_ok(om__arm_jaw(&arm, &j));
        arm.jaw_stop = 0.3;
        assert_ok(om__arm_command(&arm, command[k]));
        assert_near(arm.jaw_goal, k < 4 ? 0.3 : 0.1, 0);
    }
}

// The sign as on the robot: a negative effort closes. The other sign would drop what a client holds.
static void jaw_effort(void** unused) {
    (void)unused;
    Arm arm = make_arm(true);
    LinkJoints j = {.neffort = 1, .effort = {-0.02}};
    arm.jaw_stop = 0.2;
    assert_ok(om__arm_jaw_effort(&arm, &j));
    assert_near(arm.jaw_goal, arm.psm.jaw_min, 0);
    assert_true(arm.jaw_goal <= 0);
    j.effort[0] = 0.015;
    assert_ok(om__arm_jaw_effort(&arm, &j));
    assert_near(arm.jaw_goal, arm.psm.jaw_max, 0);
    j.effort[0] = 0;
    assert_ok(om__arm_jaw_effort(&arm, &j));
    assert_near(arm.jaw_goal, 0.2, 0);
    j.effort[0] = NAN;
    assert_status(om__arm_jaw_effort(&arm, &j), OM_INVALID);
    j = (LinkJoints){.nposition = 1, .effort = {-1}};
    assert_status(om__arm_jaw_effort(&arm, &j), OM_INVALID);
    assert_near(arm.jaw_goal, 0.2, 0);
    arm = make_arm(false);
    j = (LinkJoints){.neffort = 1, .effort = {-1}};
    assert_status(om__arm_jaw_effort(&arm, &j), OM_INVALID);
}

// From any orientation a turn about an axis of the common frame; a quaternion and its negative are one orientation.
static void turn(void** unused) {
    (void)unused;
    const OmQuat from = om_quat_normalize((OmQuat){.w = 0.3, .x = -0.5, .y = 0.7, .z = 0.2});
    const double angle[] = {0, 1e-9, 0.3, -2.5, 3.1};
    for (int k = 0; k < 10; ++k) {
        const double a = angle[k / 2];
        const OmQuat d = {.w = cos(a / 2), .x = 0.6 * sin(a / 2), .z = 0.8 * sin(a / 2)};
        OmQuat to = om_quat_mul(d, from);
        if (k % 2) to = (OmQuat){.w = -to.w, .x = -to.x, .y = -to.y, .z = -to.z};
        const OmVec3 got = om__arm_turn(from, to);
        assert_near(om_distance(got, om_vec3(0.6 * a, 0, 0.8 * a)), 0, 1e-12);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(states),     cmocka_unit_test(not_ready), cmocka_unit_test(stops),
        cmocka_unit_test(refused),    cmocka_unit_test(names),     cmocka_unit_test(servo),
        cmocka_unit_test(move),       cmocka_unit_test(jaw),       cmocka_unit_test(ratio),
        cmocka_unit_test(jaw_effort), cmocka_unit_test(turn)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
