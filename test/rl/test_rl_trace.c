// test_rl_trace.c: tables of a recorded robot's tip, and the moves that follow them.
#include "omentum/rl_trace.h"
#include "point_task.h"
#include "rl/rl_internal.h"
#include "test_alloc.h"

#define MOVE 0.0005

static OmStatus parse(const char* text, OmRlTrace* trace) {
    return om_rl_trace_parse(text, strlen(text), "robot.csv", trace);
}

static void test_tables(void** state) {
    (void)state;
    OmRlTrace t;
    assert_ok(
        parse("\xef\xbb\xbf# exported\r\ntime,frame,x, y ,\"z\",jaw\r\n0,1,0.01,-0.02,3e-2,1.2\r\n"
              "# a pause\n\n0.5,2,0.02,0,0.03,-0.1",
              &t));
    assert_true(t.n == 2 && t.has_jaw && t.line[0] == 3 && t.line[1] == 6);
    const double tip[6] = {0.01, -0.02, 0.03, 0.02, 0, 0.03};
    assert_memory_equal(t.tip, tip, sizeof tip);
    assert_near(t.time[1], 0.5, 0);
    assert_near(t.jaw[1], -0.1, 0);
    om_rl_trace_done(&t);
    assert_ok(parse("z,y,x,time\n3,2,1,1\n6,5,4,1.7e9\n", &t));  // any order; seconds since 1970
    assert_true(!t.has_jaw && t.n == 2);
    assert_near(t.tip[3], 4, 0);
    assert_near(t.tip[5], 6, 0);
    om_rl_trace_done(&t);
}

// Rows at both ends of the part are kept; a part with one row is refused, and nothing changes.
static void test_cut(void** state) {
    (void)state;
    OmRlTrace t;
    assert_ok(parse("time,x,y,z,jaw\n10,0,0,0,0\n11,1,2,3,0.1\n12,4,5,6,0.2\n13,7,8,9,0.3\n", &t));
    assert_status(om_rl_trace_cut(&t, 1.5, 2.5), OM_INVALID);
    assert_string_equal(
        om_error_message(),
        "robot.csv: 1 poses from 1.5 s to 2.5 s, a path needs at least two; it has 4 "
        "in 3.000 s");
    assert_status(om_rl_trace_cut(&t, (double)NAN, (double)NAN), OM_INVALID);
    assert_int_equal(t.n, 4);
    assert_ok(om_rl_trace_cut(&t, 1, 2));
    assert_true(t.n == 2 && t.line[0] == 3 && t.line[1] == 4);
    const double tip[6] = {1, 2, 3, 4, 5, 6};
    assert_memory_equal(t.tip, tip, sizeof tip);
    assert_near(t.time[0], 11, 0);
    assert_near(t.jaw[1], 0.2, 0);
    om_rl_trace_done(&t);
}

// Every refusal names file, line and field.
static void test_bad_tables(void** state) {
    (void)state;
    static const struct {
        const char *text, *message;
    } bad[] = {
        {"", "robot.csv: the table is empty"},
        {"# nothing\n\n", "the table is empty"},
        {"time,x,y\n0,0,0\n", "robot.csv:1: no column z"},
        {"t,x,y,z\n", "robot.csv:1: no column time"},
        {"time;x;y;z\n", "no column time"},
        {"time,x,y,z,x\n", "robot.csv:1: two columns are named x"},
        {"time,x,y,z\n", "at least two rows, the table has 0"},
        {"time,x,y,z\n0,0,0,0\n", "at least two rows, the table has 1"},
        {"time,x,y,z\n0,0,0\n", "robot.csv:2: 3 values under 4 column names"},
        {"time,x,y,z\n0,0,0,0,0\n", "robot.csv:2: 5 values under 4"},
        {"#\ntime,x,y,z\n0,0,a,0\n", "robot.csv:3: y: \"a\" is no number"},
        {"time,x,y,z\n0,0,,0\n", "robot.csv:2: y: \"\" is no number"},
        {"time,x,y,z\n0,nan,0,0\n", "robot.csv:2: x: \"nan\" is no number"},
        {"time,x,y,z\n0,0,0,inf\n", "robot.csv:2: z: \"inf\" is no number"},
        {"time,x,y,z\n0,45.2,0,0\n",
         "robot.csv:2: x is 45.2, at most 10: times are in s, positions in m"},
        {"time,x,y,z,jaw\n0,0,0,0,90\n", "robot.csv:2: jaw is 90, at most 4"},
        {"time,x,y,z\n1,0,0,0\n1,0,0,0\n", "robot.csv:3: time is 1 s, not after"},
        {"time,x,y,z\n1,0,0,0\n2,0,0,0\n0.5,0,0,0\n", "robot.csv:4: time is 0.5 s, not after"},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; ++k) {
        OmRlTrace t;
        assert_status(parse(bad[k].text, &t), OM_INVALID);
        if (!strstr(om_error_message(), bad[k].message))
            fail_msg("\"%s\" has no \"%s\"", om_error_message(), bad[k].message);
        assert_null(t.tip);
    }
    OmRlTrace t;
    assert_status(om_rl_trace_load("/nowhere/robot.csv", &t), OM_IO);
}

// ---- following ----------------------------------------------------------------------------------------

// A table of n rows through smooth random places; a pause of `npause` rows at every tenth row.
static void make_path(uint64_t seed, int n, int npause, OmText* text) {
    OmRng rng = om_rng_init(seed, 0);
    double a[3][3], b[3][3];
    for (int k = 0; k < 9; ++k) {
        a[k / 3][k % 3] = om_rng_range(&rng, -0.02, 0.02);
        b[k / 3][k % 3] = om_rng_range(&rng, 0, 6);
    }
    double time = 0;
    assert_ok(om_text_append(text, "time,x,y,z\n"));
    for (int i = 0; i < n; ++i)
        for (int r = 0; r < (i % 10 == 9 ? 1 + npause : 1); ++r, time += 0.01) {
            double p[3] = {0, 0, 0}, s = (double)i / n;
            for (int k = 0; k < 9; ++k)
                p[k % 3] += a[k / 3][k % 3] * sin((1 + k / 3) * (3 * s + b[k / 3][k % 3]));
            assert_ok(om_text_append(text, "%.17g,%.17g,%.17g,%.17g\n", time, p[0], p[1], p[2]));
        }
}

static double distance_to_segment(const double* a, const double* b, const double* p) {
    OmVec3 A = om_load3(a, 0), way = om_sub(om_load3(b, 0), A), to = om_sub(om_load3(p, 0), A);
    double l = om_norm2(way), s = l > 0 ? fmin(1, fmax(0, om_dot(to, way) / l)) : 0;
    return om_norm(om_sub(to, om_scale(s, way)));
}

// Largest distance of the points of p from the nearest place of the path q.
static double one_sided(const double* p, int np, const double* q, int nq) {
    double most = 0;
    for (int i = 0; i < np; ++i) {
        double least = INFINITY;
        for (int k = 0; k + 1 < nq; ++k)
            least = fmin(least, distance_to_segment(q + 3 * k, q + 3 * k + 3, p + 3 * i));
        most = fmax(most, least);
    }
    return most;
}

// Tips before each step, and the last one.
static int get_tips(const PointTask* task, OmRlDrive* drive, double* tip, int* action) {
    OmRlDemos d = {0};
    assert_ok(om_rl_drive_keep(drive, &d));
    memcpy(action, d.action, (size_t)d.nstep * (size_t)d.naction * sizeof *action);
    double p[3] = {(double)d.obs[0], (double)d.obs[1], (double)d.obs[2]};
    for (int i = 0; i <= d.nstep; ++i) {
        memcpy(tip + 3 * i, p, sizeof p);
        for (int k = 0; k < 3 && i < d.nstep; ++k) {
            int a = d.action[i * d.naction + k];
            p[k] += task->head.move * (a == 2 ? 1 : a == 1 ? -1 : 0);
        }
    }
    int n = d.nstep;
    om_rl_demos_done(&d);
    return n;
}

// The path of the tip and that of the table are nowhere farther apart than what is reported, and that is less than the
// half diagonal of a cube of two moves; pauses and the speed of the robot do not change the moves.
static void test_random_paths(void** state) {
    (void)state;
    static double tip[3 * 5001], tip2[3 * 5001];
    static int action[3 * 5000], action2[3 * 5000];
    PointTask task = point_task(MOVE, 5000, false);
    OmRlDrive* drive;
    assert_ok(om_rl_drive_create(&task.head, 1, &drive));
    for (uint64_t seed = 0; seed < 40; ++seed) {
        OmText text = {0};
        OmRlTrace t;
        OmRlFollow f;
        const int n = seed % 2 ? 400 : 20;  // steps of 0.2 mm, and of some mm
        make_path(seed, n, 0, &text);
        assert_ok(parse(text.str, &t));
        assert_ok(om_rl_trace_follow(&t, 0.01, drive, &f));
        assert_near(f.score, 0, 0);
        int nstep = get_tips(&task, drive, tip, action);
        assert_int_equal(nstep, f.nstep);
        double apart =
            fmax(one_sided(t.tip, t.n, tip, nstep + 1), one_sided(tip, nstep + 1, t.tip, t.n));
        // the observations are floats
        if (!(apart <= f.deviation + 1e-8 && f.deviation <= sqrt(3) * MOVE))
            fail_msg("seed %d: %g apart, %g reported", (int)seed, apart, f.deviation);
        // the end: within half a move of the last row; then 20 steps that stay
        for (int k = 0; k < 3; ++k)
            assert_true(fabs(tip[3 * nstep + k] - t.tip[3 * (t.n - 1) + k]) <= 0.5 * MOVE + 1e-8);
        for (int i = 3 * (nstep - 20); i < 3 * nstep; ++i) assert_int_equal(action[i], 0);
        for (int i = 0; i < nstep - 20; ++i)
            assert_true(action[3 * i] || action[3 * i + 1] || action[3 * i + 2]);
        om_rl_trace_done(&t);
        om_text_done(&text);

        make_path(seed, n, 7, &text);
        assert_ok(parse(text.str, &t));
        assert_ok(om_rl_trace_follow(&t, 0.01, drive, &f));
        assert_int_equal(get_tips(&task, drive, tip2, action2), nstep);
        assert_memory_equal(action, action2, 3 * (size_t)nstep * sizeof *action);
        om_rl_trace_done(&t);
        om_text_done(&text);
    }
    om_rl_drive_destroy(drive);
}

// Along one axis, 3 mm: six moves, the tip never leaves the path.
static void test_straight(void** state) {
    (void)state;
    PointTask task = point_task(MOVE, 100, false);
    OmRlDrive* drive;
    OmRlTrace t;
    OmRlFollow f;
    double tip[3 * 101];
    int action[300];
    assert_ok(om_rl_drive_create(&task.head, 1, &drive));
    assert_ok(parse("time,x,y,z\n0,0.01,0.02,0.03\n9,0.01,0.02,0.027\n", &t));
    assert_ok(om_rl_trace_follow(&t, 1e-6, drive, &f));
    assert_near(f.deviation, 0, 1e-12);
    assert_int_equal(f.nstep, 26);
    assert_int_equal(get_tips(&task, drive, tip, action), 26);
    for (int i = 0; i < 6; ++i)
        assert_true(action[3 * i] == 0 && action[3 * i + 1] == 0 && action[3 * i + 2] == 1);
    om_rl_trace_done(&t);
    om_rl_drive_destroy(drive);
}

// The gripper closes at the lowest place and opens on the way; each change is a step of its own, where the row is.
static void test_gripper(void** state) {
    (void)state;
    static const char table[] =
        "time,x,y,z,jaw\n0,0,0,0.02,1\n1,0,0,0.005,1\n2,0,0,0.005,0.1\n3,0,0,0.02,0.1\n"
        "4,0.003,0,0.02,0.1\n5,0.003,0,0.02,0.5\n6,0.003,0,0.025,0.5\n";
    PointTask task = point_task(MOVE, 1000, true);
    OmRlDrive* drive;
    OmRlTrace t;
    OmRlFollow f;
    static double tip[3 * 1001];
    static int action[4000];
    assert_ok(om_rl_drive_create(&task.head, 1, &drive));
    assert_ok(parse(table, &t));
    assert_ok(om_rl_trace_follow(&t, 0.001, drive, &f));
    assert_near(f.score, 1, 0);
    assert_int_equal(f.nstep, 30 + 1 + 30 + 6 + 1 + 10 + 20);
    get_tips(&task, drive, tip, action);
    for (int i = 0; i < f.nstep; ++i) assert_int_equal(action[4 * i + 3], i >= 30 && i < 67);
    assert_near(tip[3 * 30 + 2], 0.005, 1e-8);  // where it closes
    assert_near(tip[3 * 67], 0.003, 1e-8);      // where it opens
    om_rl_trace_done(&t);

    // closed from the first row
    assert_ok(parse("time,x,y,z,jaw\n0,0,0,0.02,0\n1,0,0,0.019,0\n", &t));
    assert_ok(om_rl_trace_follow(&t, 0.001, drive, &f));
    assert_int_equal(f.nstep, 1 + 2 + 20);
    get_tips(&task, drive, tip, action);
    for (int i = 0; i < f.nstep; ++i) assert_int_equal(action[4 * i + 3], 1);
    om_rl_trace_done(&t);

    // a gripper needs the column
    assert_ok(parse("time,x,y,z\n0,0,0,0.02\n1,0,0,0.019\n", &t));
    assert_status(om_rl_trace_follow(&t, 0.001, drive, &f), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "robot.csv: the task has a gripper"));
    om_rl_trace_done(&t);
    om_rl_drive_destroy(drive);
}

static void test_refused(void** state) {
    (void)state;
    PointTask task = point_task(MOVE, 60, false);
    OmRlDrive* drive;
    OmRlTrace t;
    OmRlFollow f;
    assert_ok(om_rl_drive_create(&task.head, 1, &drive));
    // a row outside the box
    assert_ok(parse("time,x,y,z\n0,0,0,0\n1,0,0.09,0\n2,0,0.2,0\n3,0,0,0\n", &t));
    assert_status(om_rl_trace_follow(&t, 0.001, drive, &f), OM_INVALID);
    assert_string_equal(om_error_message(), "robot.csv:4: axis 1 is outside the box");
    // of a recording, with two more
    snprintf(t.topic, sizeof t.topic, "/PSM1/measured_cp");
    t.line[2] = 40;
    t.tip[3] = t.tip[0] = 0.3;
    assert_status(om_rl_trace_follow(&t, 0.001, drive, &f), OM_INVALID);
    assert_string_equal(
        om_error_message(),
        "robot.csv: message 2 of /PSM1/measured_cp: axis 0 is outside the box. So are 3 of 4 poses, "
        "the first at 0.000 s and the last at 2.000 s after the begin");
    om_rl_trace_done(&t);
    // 35 mm are 70 moves of 0.5 mm
    assert_ok(parse("time,x,y,z\n0,0,0,0\n1,0,0.035,0\n", &t));
    assert_status(om_rl_trace_follow(&t, 0.001, drive, &f), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "at most 60 steps"));
    om_rl_trace_done(&t);
    // a wall at 50 mm: the tip slides along it within the bound, and is refused beyond it
    task.has_wall = true;
    assert_ok(parse("time,x,y,z\n0,0.048,0,0\n1,0.051,0.003,0\n2,0.048,0.006,0\n", &t));
    assert_ok(om_rl_trace_follow(&t, 0.0015, drive, &f));
    assert_true(f.deviation > 0.0009 && f.deviation < 0.0015);
    assert_status(om_rl_trace_follow(&t, 0.0007, drive, &f), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "robot.csv:"));
    assert_non_null(strstr(om_error_message(), "mm from the path, at most 0.70 mm"));
    assert_status(om_rl_trace_follow(&t, 0, drive, &f), OM_INVALID);
    om_rl_drive_destroy(drive);
    // a task without a tip
    OmRlTask* cart;
    assert_ok(om_rl_task_create("cart-pole", NULL, 0, &cart));
    assert_ok(om_rl_drive_create(cart, 1, &drive));
    assert_status(om_rl_trace_follow(&t, 0.001, drive, &f), OM_UNAVAILABLE);
    om_rl_drive_destroy(drive);
    om_rl_task_destroy(cart);
    om_rl_trace_done(&t);
}

// A recorded lift exposes the tumour of the real task; its path through the kidney is refused.
static void test_retract(void** state) {
    (void)state;
    OmRlTask* task;
    OmRlSetting move = {"move_mm", "2"};
    OmRlDrive* drive;
    OmRlTrace t;
    OmRlFollow f;
    double info[OM_RL_MAX_INFO];
    assert_ok(om_rl_task_create("retract", &move, 1, &task));
    assert_ok(om_rl_drive_create(task, 1, &drive));
    assert_ok(parse(
        "time,x,y,z\n0,-0.05,0.004,0.04\n1,-0.046,0.001,0.022\n2,-0.02,0.002,0.075\n3,0,0,0.095\n",
        &t));
    assert_ok(om_rl_trace_follow(&t, 0.004, drive, &f));
    assert_ok(om_rl_drive_info(drive, info, NULL));
    assert_true(f.is_terminated && f.nstep < 80);
    assert_near(info[1], 1, 0);  // grasped
    assert_true(f.score >= 0.95 && f.deviation <= sqrt(3) * 0.002);
    om_rl_trace_done(&t);
    assert_ok(parse("time,x,y,z\n0,-0.05,0,0.04\n1,-0.01,0,0.02\n", &t));
    assert_status(om_rl_trace_follow(&t, 0.004, drive, &f), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "from the path"));
    om_rl_trace_done(&t);
    assert_ok(parse("time,x,y,z\n0,-0.05,0,0.04\n1,-0.05,0,0.2\n", &t));
    assert_status(om_rl_trace_follow(&t, 0.004, drive, &f), OM_INVALID);
    assert_non_null(strstr(om_error_message(),
                           "robot.csv:3: the tip at (-0.05, 0, 0.2) m is outside the workspace"));
    om_rl_trace_done(&t);
    om_rl_drive_destroy(drive);
    om_rl_task_destroy(task);
}

// The demonstration of a recorded robot, written to a file and read again: its actions from the first place of the path
// take the tip along the path once more, as near as before.
static void test_replay(void** state) {
    (void)state;
    static const char* const file = "test_rl_trace_replay.hdf5";
    OmRlTask* task;
    OmRlSetting move = {"move_mm", "2"};
    OmRlDrive *drive, *again;
    OmRlTrace t;
    OmRlFollow f;
    OmRlDemos demos = {0};
    assert_ok(om_rl_task_create("retract", &move, 1, &task));
    assert_ok(om_rl_drive_create(task, 1, &drive));
    assert_ok(parse("time,x,y,z\n0,-0.05,0.004,0.04\n1,-0.046,0.001,0.022\n2,-0.02,0.002,0.075\n"
                    "3,0,0,0.095\n",
                    &t));
    assert_ok(om_rl_trace_follow(&t, 0.004, drive, &f));
    assert_ok(om_rl_drive_keep(drive, &demos));
    assert_ok(om_rl_demos_save(&demos, file));
    om_rl_demos_done(&demos);
    assert_ok(om_rl_demos_load(file, &demos));
    remove(file);
    assert_ok(om_rl_demos_check(&demos, task));
    assert_int_equal(demos.nstep, f.nstep);
    assert_ok(om_rl_drive_create(task, 1, &again));
    assert_ok(om_rl_drive_reset(again, -1));
    assert_ok(task->ops->place(task, om__rl_drive_state(again), t.tip));
    double* tip = malloc(3 * ((size_t)demos.nstep + 1) * sizeof *tip);
    for (int i = 0; i <= demos.nstep; ++i) {
        task->ops->tip(task, om__rl_drive_state(again), tip + 3 * i);
        if (i < demos.nstep) assert_ok(om_rl_drive_step(again, demos.action + i * demos.naction));
    }
    assert_below(one_sided(tip, demos.nstep + 1, t.tip, t.n), f.deviation + 1e-12);
    assert_below(one_sided(t.tip, t.n, tip, demos.nstep + 1), f.deviation + 1e-12);
    assert_true(om_rl_drive_now(again)->is_terminated);
    free(tip);
    om_rl_demos_done(&demos);
    om_rl_trace_done(&t);
    om_rl_drive_destroy(drive);
    om_rl_drive_destroy(again);
    om_rl_task_destroy(task);
}

static OmStatus follow_once(void* ctx) {
    OmRlDrive* drive = NULL;
    OmRlTrace t = {0};
    OmRlFollow f;
    OmStatus status;
    OM_TRY_DONE(parse("time,x,y,z\n0,0,0,0\n1,0,0.035,0\n", &t));
    OM_TRY_DONE(om_rl_drive_create(ctx, 1, &drive));
    OM_TRY_DONE(om_rl_trace_follow(&t, 0.001, drive, &f));
done:
    om_rl_trace_done(&t);
    om_rl_drive_destroy(drive);
    return status;
}

static void test_memory(void** state) {
    (void)state;
    PointTask task = point_task(MOVE, 100, false);
    assert_int_equal(test_failing_allocations(follow_once, &task.head, 1), 9);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_tables),     cmocka_unit_test(test_cut),
        cmocka_unit_test(test_bad_tables), cmocka_unit_test(test_random_paths),
        cmocka_unit_test(test_straight),   cmocka_unit_test(test_gripper),
        cmocka_unit_test(test_refused),    cmocka_unit_test(test_retract),
        cmocka_unit_test(test_replay),     cmocka_unit_test(test_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
