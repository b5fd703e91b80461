// test_loop.c: the parts of the loop by hand, and what a run records against what it did.
#include <hdf5.h>

#include "test_files.h"
#include "test_json.h"

#include "loop_rig.h"

#include "loop/loop_state.h"
#include "omentum/retract.h"
#include "trial/trial_lift.h"

static void run(const OmScene* scene, const char* dir, OmRetractResult* r) {
    OmRetractDef def = om_retract_default_def(scene);
    def.out_dir = dir;
    assert_ok(om_retract_run(&def, NULL, r));
}

// ---- folds ----------------------------------------------------------------------------------------

// Away is +x by the length of the scene; a fold to the ROI ends by this length beyond it.
static void test_paths_of_folds(void** state) {
    (void)state;
    Grid grid = {.roi = {0.02, -0.01, 0.003}};
    OmVec3 d;
    double length;
    om__fold_path(&grid, 0.1, om_vec3(-0.01, 0.03, 0.05), OM_PLAN_MOVE_AWAY, &d, &length);
    assert_near(om_distance(d, om_vec3(1, 0, 0)), 0, 0);
    assert_near(length, 0.1, 0);
    om__fold_path(&grid, 0.1, om_vec3(-0.01, 0.03, 0.05), OM_PLAN_MOVE_ROI, &d, &length);
    assert_near(om_distance(d, om_vec3(0.6, -0.8, 0)), 0, 1e-15);
    assert_near(length, 0.05 + 0.1, 1e-15);
    om__fold_path(&grid, 0.1, om_vec3(0.02, -0.01, 0.05), OM_PLAN_MOVE_ROI, &d, &length);
    assert_near(length, 0, 0);  // right above it
}

// ---- the grid -------------------------------------------------------------------------------------

// A run that exposes nothing tries places all over the tissue, on a fine grid as on a coarse one.
static void test_a_fine_grid_does_not_stay_in_one_place(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    scene.tissue.cells = om_vec3(12, 12, 1);
    scene.tissue.world_cells = om_vec3(18, 18, 1);
    scene.attach.lo = om_vec3(0.05, -1, -1);  // the free part is 105 x 120 mm
    scene.roi.center = om_vec3(0, 0, 0);
    scene.task.grid = 10;
    scene.task.force_threshold = 0.1;  // grasps end by force
    scene.task.visibility = 1.0;
    scene.task.max_actions = 50;
    OmRetractResult r;
    run(&scene, NULL, &r);
    assert_int_equal(r.outcome, OM_RETRACT_GAVE_UP);
    int ngrasp = 0, block[64];
    for (int i = 0; i < r.naction; ++i)
        if (r.action[i].verb == OM_PLAN_GRASP) block[ngrasp++] = r.action[i].block;
    assert_true(ngrasp >= 6);
    for (int i = 0; i < ngrasp; ++i) {
        int near = 0;
        for (int k = 0; k < i; ++k) {
            double dx = 12.0 * (block[i] % 10 - block[k] % 10),
                   dy = 12.0 * (block[i] / 10 - block[k] / 10);
            near += hypot(dx, dy) < 21.6;
        }
        if (near >= 3) fail_msg("grasp %d has %d before it within 21.6 mm", i, near);
    }
    om_retract_result_done(&r);
}

// ---- trials ---------------------------------------------------------------------------------------

// Lifted without a limit, the tip ends at the height limit over its grasping point. What the tool feels is what the
// body gained elsewhere: at rest attachments bore `rest`, now they bear more; the difference is the pull.
static void test_trial_lift(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    scene.tissue.has_board = false;  // it hangs, and is stiff enough to stay where the tool comes
    scene.tissue.young = 3e6;
    scene.task.max_height = 0.01;
    Trial* t;
    assert_ok(om__trial_create(&scene, 1, OM_SITE_TWIN, 1, &t));
    OmBodyForces rest, now;
    assert_ok(om_body_get_forces(t->body, &rest));
    double weight = 0.12 * 0.12 * 0.005 * 1000 * 9.81;
    assert_near_rel(rest.attachment.z, weight, 0.05);  // what still swings
    Trace trace = {0};
    TrialResult c = {.trace = &trace};
    int nheld, block = 10;  // -x, middle
    assert_ok(om__trial_grasp(t, block, &c, &nheld));
    OmVec3 begin = c.tip;
    assert_true(nheld > 0);
    assert_near(om_distance(begin, om_pose_apply(t->grid.task, t->grid.tip[block])), 0, 1e-12);
    assert_ok(om__trial_lift(t, INFINITY, &c));
    assert_false(c.is_stopped);
    assert_near(c.length, 0.01, 1e-12);
    assert_near(om_distance(c.tip, om_add(begin, om_vec3(0, 0, 0.01))), 0, 1e-12);
    assert_int_equal(trace.n, 10 + 20);  // 0.2 s of motion and 0.4 s of rest in steps of 20 ms
    assert_ok(om_body_get_forces(t->body, &now));
    // No ground bears anything: the pull is the whole grasp.
    double last = trace.force[trace.n - 1];
    assert_near_rel(last, om_norm(now.grasp[0]), 1e-9);
    assert_true(fabs(last - om_norm(now.attachment)) > 0.02 * last);
    // A limit ends the lift at the step that passes it.
    TrialResult d = {0};
    assert_ok(om__trial_grasp(t, block, &d, &nheld));
    assert_ok(om__trial_lift(t, 0.5 * c.force, &d));
    assert_true(d.is_stopped && d.length < 0.01 && d.force > 0.5 * c.force);
    om__trace_done(&trace);
    om__trial_destroy(t);
}

// On a board: a tool carries weight that the board no longer bears, which is no pull.
static void test_trial_weight(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    scene.task.max_height = 0.03;
    Trial* t;
    assert_ok(om__trial_create(&scene, 1, OM_SITE_TWIN, 1, &t));
    Trace trace = {0};
    TrialResult c = {.trace = &trace};
    OmBodyForces now;
    int nheld;
    assert_ok(om__trial_grasp(t, 10, &c, &nheld));
    assert_ok(om__trial_lift(t, INFINITY, &c));
    assert_ok(om_body_get_forces(t->body, &now));
    assert_true(trace.force[trace.n - 1] < om_norm(now.grasp[0]) - 0.02);
    om__trace_done(&trace);
    om__trial_destroy(t);
}

// ---- runs -----------------------------------------------------------------------------------------

// Far above its limit a force ends the motion at once: the tip does not rise after it was seen.
static void test_stop_far_above_the_limit(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    scene.tissue.young = 3e5;  // a millimetre pulls by far too much
    scene.task.force_threshold = 0.05;
    scene.task.max_actions = 3;
    scene.task.visibility = 1.0;
    OmRetractResult r;
    run(&scene, NULL, &r);
    const OmRetractAction* a = &r.action[2];
    assert_int_equal(a->verb, OM_PLAN_PULL);
    assert_int_equal(a->outcome, OM_ACTION_FORCE);
    assert_true(a->force_max > 1.5 * 0.05);
    double highest = 0;
    for (int i = 0; i < r.nsample; ++i) highest = fmax(highest, r.sample[i].height);
    // At once: the 0.6 s that a smaller force is given would show in the time, and at any speed in the height.
    assert_true(highest < 0.004);
    assert_true(a->end - a->begin < 0.5);
    om_retract_result_done(&r);
}

// A fold passes a limit that the pulls before it did not: its point is not grasped again, though the other fold was not
// tried. The limit falls while the fold is under way.
static void test_a_fold_above_the_limit(void** state) {
    (void)state;
    Rig g;
    OmScene scene = object_scene();
    scene.task.visibility = 1.5;  // no pull exposes it
    rig_create(&g, scene);
    OmLoop* loop = make_loop(&g, NULL);
    const OmRetractResult* r = om_loop_result(loop);
    while (om_loop_phase(loop) != OM_LOOP_ACT || loop->act.action.plan.verb != OM_PLAN_MOVE_ROI) {
        assert_true(om_loop_phase(loop) != OM_LOOP_ENDED);
        assert_ok(om_loop_tick(loop));
    }
    for (int i = 0; i < r->naction; ++i) assert_int_equal(r->action[i].outcome, OM_ACTION_DONE);
    const int block = loop->act.action.plan.block, n = r->naction;
    assert_int_equal(loop->belief.tried[block], 0);
    loop->task.force_threshold = 1e-3;
    while (r->naction == n) assert_ok(om_loop_tick(loop));
    assert_int_equal(r->action[n].verb, OM_PLAN_MOVE_ROI);
    assert_int_equal(r->action[n].outcome, OM_ACTION_FORCE);
    assert_int_equal(loop->belief.tried[block], OM_TRIED_MOVE_ROI | OM_TRIED_GRASP);
    assert_true(loop->belief.is_exhausted[block]);
    om_loop_destroy(loop);
    rig_destroy(&g);
}

// An arm that hangs 2 mm below every goal and measures itself there, as under a load that its controller does not hold.
static OmStatus low_move(OmWorld* world, int arm, OmPose goal, double speed);
static struct {
    const OmWorldOps* true_ops;
    OmWorldOps ops;
} low;

static OmStatus low_move(OmWorld* world, int arm, OmPose goal, double speed) {
    goal.p.z -= 0.002;
    return low.true_ops->move(world, arm, goal, speed);
}

// It ends a lift, too, though it never comes to the limit of 50 mm: a pull that raises nothing is the last.
static void test_a_lift_ends(void** state) {
    (void)state;
    Rig g;
    OmScene scene = object_scene();
    scene.task.visibility = 1.5;  // never: every point is lifted to its end
    scene.task.max_actions = 20;
    rig_create(&g, scene);
    low.true_ops = g.world->ops;
    low.ops = *low.true_ops;
    low.ops.move = low_move;
    g.world->ops = &low.ops;
    OmLoop* loop = make_loop(&g, NULL);
    tick_to_end(loop);
    const OmRetractResult* r = om_loop_result(loop);
    int most = 0;
    double top = 0;
    for (int i = 0, n = 0; i < r->naction; ++i) {
        n = r->action[i].verb == OM_PLAN_PULL ? n + 1 : 0;
        most = n > most ? n : most;
    }
    for (int i = 0; i < r->nsample; ++i) top = fmax(top, r->sample[i].height);
    printf("at most %d pulls of a lift, up to %.1f mm\n", most, 1e3 * top);
    om_loop_destroy(loop);
    g.world->ops = low.true_ops;
    rig_destroy(&g);
    assert_true(top < 0.049);  // further from the limit than the millimetre that counts as there
    assert_true(most >= 5 && most <= 7);  // 8 mm each, and one that raises nothing
}

// A motion slows down before its limit, so that the force hardly passes it; above the limit the tip stands still, and
// 0.6 s above it end the motion. Every tick is judged: the rate of a tick is decided by the force before it.
static void test_slower_before_a_stop(void** state) {
    (void)state;
    const double limit = 0.06;
    Rig g;
    OmScene scene = easy_scene();
    scene.task.force_threshold = limit;
    scene.task.max_actions = 8;
    scene.task.visibility = 1.0;
    rig_create(&g, scene);
    OmLoop* loop = make_loop(&g, NULL);
    const OmRetractResult* r = om_loop_result(loop);
    const double step = scene.task.speed * scene.task.time_step;
    OmRetractSample last = om_loop_sample(loop);
    double before = -1, above = -1;
    int nbetween = 0;
    while (r->naction == 0 || r->action[r->naction - 1].outcome != OM_ACTION_FORCE) {
        assert_true(om_loop_phase(loop) != OM_LOOP_ENDED);
        assert_ok(om_loop_tick(loop));
        const OmRetractSample s = om_loop_sample(loop);
        if (s.force > 0.75 * limit && before < 0) before = s.time;
        if (s.force > limit && above < 0) above = s.time;
        assert_true((s.speed_rate < 1) == (s.force > 0.75 * limit));
        nbetween += s.speed_rate > 0.25 && s.speed_rate < 1;
        // but for what the measured tip trembles: a hundredth of a millimetre along each axis
        if (last.force > 0)
            assert_true(s.height - last.height < fmax(s.speed_rate, last.speed_rate) * step + 6e-5);
        last = s;
    }
    const OmRetractAction* a = &r->action[r->naction - 1];
    // At full speed up to the limit, and a quarter of it above, it passed the limit by a fifth.
    assert_true(a->force_max > limit && a->force_max < 1.1 * limit);
    assert_true(before > 0 && above > before && nbetween > 0);
    assert_true(a->end - above > 0.6 - OM_RETRACT_SAMPLE);
    om_loop_destroy(loop);
    rig_destroy(&g);
}

// The second fold of a grasp begins where the first one began, which did not expose the ROI and led elsewhere.
static void test_a_second_fold(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    scene.attach.lo.x = 0.04;
    scene.roi.center = om_vec3(0.05, 0, 0);  // never seen
    Rig g;
    rig_create(&g, scene);
    OmLoop* loop = make_loop(&g, NULL);
    OmVec3 begin[2] = {{0}}, end = {0};
    OmPlanVerb verb[2] = {OM_PLAN_PULL, OM_PLAN_PULL};
    for (int n = 0; n < 2;) {
        assert_true(om_loop_phase(loop) != OM_LOOP_ENDED);
        assert_ok(om_loop_tick(loop));
        const Action* a = &loop->act.action;
        const bool is_fold = a->plan.verb == OM_PLAN_MOVE_AWAY || a->plan.verb == OM_PLAN_MOVE_ROI;
        if (n == 1 && a->plan.verb == verb[0]) end = loop->act.arm[a->plan.arm].tip;
        if (!is_fold || a->step == 0 || (n == 1 && a->plan.verb == verb[0])) continue;
        verb[n] = a->plan.verb;
        begin[n++] = a->tip;
    }
    assert_true(om_distance(end, begin[0]) > 0.02);
    assert_true(om_distance(begin[1], begin[0]) < 1.5e-3);  // noise of the tip, and a step
    om_loop_destroy(loop);
    rig_destroy(&g);
}

// A pull rises by one step, in the time that the speed takes.
static void test_pulls_are_steps(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    scene.task.visibility = 1.0;
    scene.task.max_actions = 4;
    OmRetractResult r;
    run(&scene, NULL, &r);
    for (int k = 2; k < 4; ++k) {
        const OmRetractAction* a = &r.action[k];
        assert_int_equal(a->verb, OM_PLAN_PULL);
        assert_int_equal(a->outcome, OM_ACTION_DONE);
        assert_near(a->end - a->begin, 0.01 / 0.05, 0.041);  // two ticks, to see that it ended
        assert_int_equal(a->plan, 0);
        for (int i = 0; i < r.nsample; ++i)
            if (r.sample[i].time <= a->end) assert_true(r.sample[i].height < 0.01 * (k - 1) + 1e-3);
    }
    om_retract_result_done(&r);
}

static float* read_set(hid_t file, const char* name, size_t count) {
    float* value = malloc(count * sizeof *value);
    hid_t set = H5Dopen2(file, name, H5P_DEFAULT);
    assert_true(set >= 0);
    hid_t space = H5Dget_space(set);
    assert_true(H5Sget_simple_extent_npoints(space) >= (hssize_t)count);
    hsize_t zero[2] = {0, 0}, size[2] = {count, 1};
    int rank = H5Sget_simple_extent_ndims(space);
    if (rank == 2) size[0] = count / 3, size[1] = 3;
    H5Sselect_hyperslab(space, H5S_SELECT_SET, zero, NULL, size, NULL);
    hid_t memory = H5Screate_simple(rank, size, NULL);
    assert_true(H5Dread(set, H5T_NATIVE_FLOAT, memory, space, H5P_DEFAULT, value) >= 0);
    H5Sclose(memory);
    H5Sclose(space);
    H5Dclose(set);
    return value;
}

// run.vtkhdf has the truth, which is heavier than the twin: before any grasp the attachments carry its weight.
static void expect_recorded_forces(const char* path, int nvert, double weight) {
    hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    assert_true(file >= 0);
    float* force = read_set(file, "VTKHDF/PointData/force_N", 3 * (size_t)nvert);
    double sum = 0;
    for (int i = 0; i < nvert; ++i) sum += (double)force[3 * i + 2];
    assert_near_rel(sum, weight, 0.05);  // what still moves
    free(force);
    H5Fclose(file);
}

static void read_names(hid_t file, char* names, size_t size) {
    hid_t root = H5Gopen2(file, "VTKHDF", H5P_DEFAULT);
    hid_t a = H5Aopen(root, "part_names", H5P_DEFAULT), type = H5Aget_type(a);
    assert_true(H5Tget_size(type) <= size && H5Aread(a, type, names) >= 0);
    H5Tclose(type);
    H5Aclose(a);
    H5Gclose(root);
}

// All that is seen is recorded: tissue, region of interest and both tools, with displacements from the first step in
// metres and stresses in the tissue alone.
static void expect_recorded_scene(const char* path, int nvert, int ntet) {
    hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    assert_true(file >= 0);
    char names[128] = "";
    read_names(file, names, sizeof names);
    assert_string_equal(names, "0 tissue, 1 region of interest, 2 psm1, 3 psm2");
    float* all = read_set(file, "VTKHDF/NumberOfPoints", 1);
    float* ncell = read_set(file, "VTKHDF/NumberOfCells", 1);
    const size_t n = (size_t)all[0], cells = (size_t)ncell[0];
    hid_t steps = H5Dopen2(file, "VTKHDF/Steps/Values", H5P_DEFAULT), space = H5Dget_space(steps);
    const size_t nstep = (size_t)H5Sget_simple_extent_npoints(space);
    H5Sclose(space);
    H5Dclose(steps);
    assert_true(nstep > 3 && n > (size_t)nvert && cells > (size_t)ntet);
    float* x = read_set(file, "VTKHDF/Points", 3 * n * nstep);
    float* moved = read_set(file, "VTKHDF/PointData/displacement_m", 3 * n * nstep);
    float* part = read_set(file, "VTKHDF/CellData/part", cells);
    float* stress = read_set(file, "VTKHDF/CellData/von_mises_Pa", cells * nstep);
    float* corner =
        read_set(file, "VTKHDF/Connectivity", 4 * (size_t)ntet + 3 * (cells - (size_t)ntet));
    const size_t last = nstep - 1;
    double max[4] = {0};  // displacements of the last step, by parts
    int nstressed = 0;
    for (size_t i = 0; i < 3 * n; ++i)  // floats of positions within a metre
        assert_near(moved[3 * n * last + i], x[3 * n * last + i] - x[i], 3e-7);
    for (size_t c = 0; c < cells; ++c) {
        const int k = (int)part[c];
        assert_true(k >= 0 && k <= 3 && (k == 0) == (c < (size_t)ntet));
        const size_t at = k == 0 ? 4 * c : 4 * (size_t)ntet + 3 * (c - (size_t)ntet);
        const size_t v = (size_t)corner[at];
        for (int i = 0; i < 3; ++i)
            max[k] = fmax(max[k], fabs((double)moved[3 * (n * last + v) + (size_t)i]));
        if (k == 0) nstressed += stress[cells * last + c] > 1;
        if (k > 0) assert_true(stress[cells * last + c] == 0);
    }
    assert_true(max[0] > 0.005 && max[0] < 0.2);  // lifted
    assert_true(max[1] == 0);                     // still
    assert_true(max[2] > 0.005);                  // the arm that lifts
    assert_true(nstressed > ntet / 10);
    float* list[] = {all, ncell, x, moved, part, stress, corner};
    for (size_t i = 0; i < sizeof list / sizeof *list; ++i) free(list[i]);
    H5Fclose(file);
}

// run.json, read by other code than wrote it, says what the run did.
static void test_run_json(void** state) {
    (void)state;
    char dir[] = "/tmp/om_loop_XXXXXX", out[64], path[128];
    assert_non_null(mkdtemp(dir));
    snprintf(out, sizeof out, "%s/run", dir);
    OmScene scene = easy_scene();
    scene.task.visibility = 1.0;
    scene.task.max_actions = 7;
    scene.task.force_threshold = 0.3;
    scene.world.density_factor = 1.5;
    OmRetractResult r;
    run(&scene, out, &r);
    snprintf(path, sizeof path, "%s/run.json", out);
    char* text;
    size_t size;
    assert_ok(om_file_read(path, 1 << 22, &text, &size));
    Json json = {text, 0};
    static const char* const verb[] = {"reach", "grasp", "release", "pull"};
    assert_near(json_number(&json, "visibility_start"), r.visibility_start, 1e-8);
    assert_near(json_number(&json, "visibility_end"), r.visibility_end, 1e-8);
    assert_near(json_number(&json, "visibility_world_end"), r.truth.visibility, 1e-8);
    assert_near(json_number(&json, "force_max_n"), r.twin.force, 1e-8);
    assert_near(json_number(&json, "force_world_max_n"), r.truth.force, 1e-8);
    assert_near(json_number(&json, "force_threshold_n"), 0.3, 1e-12);
    assert_near(json_number(&json, "times_above_force_limit"), r.twin.nforce, 0);
    json_value(&json, "actions");
    int nasymmetric = 0;
    for (int i = 0; i < r.naction; ++i) {
        const OmRetractAction* a = &r.action[i];
        if (a->verb < 4) json_is(&json, "action", verb[a->verb]);
        json_is(&json, "arm", a->arm == 0 ? "psm1" : "psm2");
        if (a->block >= 0) {
            int x = (int)json_number(&json, "block_x"), y = (int)json_number(&json, "block_y");
            assert_int_equal((y - 1) * 5 + x - 1, a->block);  // x runs first, both from 1
            assert_true(x >= 1 && x <= 5 && y >= 1 && y <= 5);
            nasymmetric += x != y;
        }
        assert_near(json_number(&json, "begin_s"), a->begin, 1e-6);
        assert_near(json_number(&json, "end_s"), a->end, 1e-6);
        assert_true(a->end > a->begin);
        assert_near(json_number(&json, "visibility"), a->visibility, 1e-8);
        assert_near(json_number(&json, "force_max_n"), a->force_max, 1e-8);
        assert_near(json_number(&json, "force_world_max_n"), a->force_world_max, 1e-8);
        assert_near(json_number(&json, "plan"), a->plan + 1, 0);
    }
    assert_true(nasymmetric > 0);
    json_value(&json, "samples");
    for (int i = 0; i < r.nsample; ++i) {
        const OmRetractSample* s = &r.sample[i];
        assert_near(json_number(&json, "time_s"), s->time, 1e-6);
        assert_near(json_number(&json, "visibility"), s->visibility, 1e-8);
        assert_near(json_number(&json, "force_n"), s->force, 1e-8);
        const char* world = json_value(&json, "force_world_n");
        if (isfinite(s->force_world)) assert_near(strtod(world, NULL), s->force_world, 1e-8);
        assert_near(json_number(&json, "height_m"), s->height, 1e-8);
        assert_near(json_number(&json, "speed_rate"), s->speed_rate, 0);
    }
    om_free(text);
    snprintf(path, sizeof path, "%s/run.vtkhdf", out);
    expect_recorded_forces(path, r.truth.nvert, 1.5 * 0.12 * 0.12 * 0.005 * 1000 * 9.81);
    expect_recorded_scene(path, r.truth.nvert, r.truth.ntet);
    om_retract_result_done(&r);
    assert_ok(om_path_remove(dir));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_paths_of_folds),
        cmocka_slow_test(test_a_fine_grid_does_not_stay_in_one_place),
        cmocka_unit_test(test_trial_lift),
        cmocka_unit_test(test_trial_weight),
        cmocka_unit_test(test_stop_far_above_the_limit),
        cmocka_unit_test(test_slower_before_a_stop),
        cmocka_unit_test(test_a_fold_above_the_limit),
        cmocka_unit_test(test_pulls_are_steps),
        cmocka_unit_test(test_a_lift_ends),
        cmocka_unit_test(test_a_second_fold),
        cmocka_unit_test(test_run_json),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
