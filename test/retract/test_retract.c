// test_retract.c: whole retractions of small sheets: success, limits, failure, output, determinism.
#include <unistd.h>

#include "test_alloc.h"

#include "easy_scene.h"

#include "loop/loop_state.h"
#include "omentum/retract.h"
#include "omentum/trial_search.h"
#include "trial/trial_lift.h"

static void run(const OmScene* scene, int nworker, const char* dir, OmRetractResult* r) {
    OmRetractDef def = om_retract_default_def(scene);
    def.nworker = nworker;
    def.out_dir = dir;
    assert_ok(om_retract_run(&def, NULL, r));
}

static void test_a_free_corner_is_lifted(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    scene.endoscope.width = 120, scene.endoscope.height = 90;
    OmRetractResult r;
    run(&scene, 1, NULL, &r);
    if (!r.is_exposed) fail_msg("%s", r.reason);
    assert_true(r.visibility_start <= 0.05 && r.visibility_end >= 0.8);
    assert_true(r.truth.nvert >= 2 * r.twin.nvert);
    // The first actions are those of any retraction; the height limit is kept at every instant.
    assert_int_equal(r.action[0].verb, OM_PLAN_REACH);
    assert_int_equal(r.action[1].verb, OM_PLAN_GRASP);
    assert_int_equal(r.action[2].verb, OM_PLAN_PULL);
    for (int i = 0; i < r.nsample; ++i) {
        assert_true(r.sample[i].height <= scene.task.max_height + 2e-3);
        assert_true(r.sample[i].visibility >= 0 && r.sample[i].visibility <= 1);
        // in a picture of 120 x 90 pixels the ROI has some 34
        assert_near(r.sample[i].visibility, r.sample[i].visibility_world, 0.1);
        if (i) assert_true(r.sample[i].time > r.sample[i - 1].time);
    }
    for (int i = 1; i < r.naction; ++i)
        assert_true(r.action[i].begin >= r.action[i - 1].end - 1e-9);
    om_retract_result_done(&r);
}

static void test_same_bytes_with_one_or_two_workers(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    OmRetractResult a, b;
    run(&scene, 1, NULL, &a);
    run(&scene, 2, NULL, &b);
    assert_true(a.hash == b.hash && a.naction == b.naction);
    assert_true(a.visibility_end == b.visibility_end && a.twin.force == b.twin.force);
    om_retract_result_done(&a);
    om_retract_result_done(&b);
}

// The twin is another body than the world: made stiffer, the world ends elsewhere and the twin's forces stay.
static void test_the_truth_is_hidden_from_the_twin(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    scene.task.visibility = 1.0;  // so that both go on for the same actions
    scene.task.max_actions = 5;
    scene.world.tool_noise = 0;
    OmRetractResult a, b;
    run(&scene, 1, NULL, &a);
    scene.world.young_factor = 2;
    run(&scene, 1, NULL, &b);
    assert_true(a.hash != b.hash);
    assert_int_equal(a.nsample, b.nsample);
    double max = 0, apart = 0;
    for (int i = 0; i < a.nsample; ++i) {
        assert_near(a.sample[i].force, b.sample[i].force, 0);
        max = fmax(max, a.sample[i].force);
        apart = fmax(apart, b.sample[i].force_world - a.sample[i].force_world);
    }
    // The twin feels the pull, and the stiffer truth resists more.
    assert_true(max > 0.05);
    assert_true(b.truth.force > 1.1 * a.truth.force && apart > 0.02);
    om_retract_result_done(&a);
    om_retract_result_done(&b);
}

static void test_force_stops_a_pull(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    scene.task.force_threshold = 0.06;  // less than what its lift takes
    scene.task.max_actions = 10;
    scene.task.visibility = 1.0;
    OmRetractResult r;
    run(&scene, 1, NULL, &r);
    int nstop = 0;
    bool has_slowed = false;
    for (int i = 0; i < r.naction; ++i) nstop += r.action[i].outcome == OM_ACTION_FORCE;
    for (int i = 0; i < r.nsample; ++i) has_slowed |= r.sample[i].speed_rate < 1;
    assert_true(nstop > 0 && r.twin.nforce > 0 && has_slowed && r.nplan > 1);
    om_retract_result_done(&r);
}

// Above the force limit the arm goes back until the force is below it, and the tissue is folded instead of
// pulled before it is released (6.4.1).
static void test_fold_after_a_force_stop(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    scene.task.force_threshold = 0.06;
    scene.task.max_actions = 9;
    scene.task.visibility = 1.0;
    OmRetractResult r, m;
    run(&scene, 1, NULL, &r);
    int i = 0;
    while (i < r.naction && r.action[i].outcome != OM_ACTION_FORCE) ++i;
    assert_true(i + 1 < r.naction);
    assert_int_equal(r.action[i].verb, OM_PLAN_PULL);
    assert_int_equal(r.action[i + 1].verb, OM_PLAN_MOVE_ROI);
    assert_int_equal(r.action[i + 1].block, r.action[i].block);
    for (int k = 0; k < r.nsample; ++k) {  // eased when the next action begins
        bool is_then = fabs(r.sample[k].time - r.action[i + 1].begin) < 0.5 * OM_RETRACT_SAMPLE;
        if (is_then) assert_true(r.sample[k].force <= scene.task.force_threshold);
    }
    // A margin makes the arms act as a lower threshold would.
    scene.task.force_threshold = 3;
    scene.task.force_margin = 2.94;
    run(&scene, 1, NULL, &m);
    assert_int_equal(m.twin.nforce, r.twin.nforce);
    assert_int_equal(m.naction, r.naction);
    assert_int_equal(m.truth.nforce, 0);  // the truth stays below the threshold itself
    om_retract_result_done(&r);
    om_retract_result_done(&m);
}

// The truth's force is recorded beside the twin's, which alone decides.
static void test_both_forces_are_told(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    OmRetractResult r;
    run(&scene, 1, NULL, &r);
    double twin = 0, truth = 0, more = 0;
    for (int i = 0; i < r.nsample; ++i) {
        twin = fmax(twin, r.sample[i].force);
        truth = fmax(truth, r.sample[i].force_world);
        if (r.sample[i].force > 0)  // both bodies are held
            more = fmax(more, r.sample[i].force_world - r.sample[i].force);
    }
    assert_true(r.twin.force > 0.05 && r.truth.force > 0.05);
    assert_true(fabs(r.truth.force - r.twin.force) > 1e-3);
    assert_true(twin <= r.twin.force && truth <= r.truth.force && more <= r.truth.more);
    assert_true(twin > 0.8 * r.twin.force && truth > 0.8 * r.truth.force);
    for (int i = 0; i < r.naction; ++i) assert_true(r.action[i].force_world_max >= 0);
    om_retract_result_done(&r);
}

// A motion stops a margin above what is wanted, or once more than is wanted becomes less.
static void test_when_a_motion_stops(void** state) {
    (void)state;
    Watch w = {.wanted = 0.8, .margin = 0.05};
    assert_false(om__watch_stop(&w, 0.5));
    assert_false(om__watch_stop(&w, 0.81));
    assert_false(om__watch_stop(&w, 0.84));
    assert_true(om__watch_stop(&w, 0.82));  // past its best
    assert_false(om__watch_stop(&w, 0.79));
    w.best = 0;
    assert_true(om__watch_stop(&w, 0.86));
    w = (Watch){.wanted = 1.0, .margin = 0.05};
    assert_true(om__watch_stop(&w, 1.0));
}

// Exposed means: seen without a break for half a second, at the end.
static void test_exposed_is_held(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    OmRetractResult r;
    run(&scene, 1, NULL, &r);
    assert_true(r.is_exposed);
    int nheld = 0;
    for (int i = r.nsample - 1; i >= 0 && r.sample[i].time > r.time - 0.5; --i, ++nheld)
        assert_true(r.sample[i].visibility >= scene.task.visibility);
    assert_true(nheld >= 4);
    om_retract_result_done(&r);
}

// Less than nine tenths of the ROI in the picture, tissue or not: no run begins.
static void test_impossible_scenes_are_refused(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    OmRetractResult r;
    OmSearchResult search;
    scene.endoscope.fov = 18 * OM_PI / 180;
    OmRetractDef def = om_retract_default_def(&scene);
    assert_status(om_retract_run(&def, NULL, &r), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "outside the picture"));
    assert_non_null(strstr(om_error_message(), "fov_deg"));
    assert_status(om_retract_search(&scene, 3, 0, NULL, &search), OM_INVALID);
}

static void test_search(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    scene.task.grid = 2;
    OmSearchResult found, none;
    assert_ok(om_retract_search(&scene, 3, 1, NULL, &found));
    assert_true(found.ngrasp > 0 && found.nexposed > 0 && found.visibility >= 0.8);
    assert_true(found.force > 0 && found.block >= 0);
    // reach, grasp, five pulls of 10 mm and two folds at most; a ROI of which little must be seen needs fewer
    OmScene little = scene;
    OmSearchResult less;
    little.task.visibility = 0.05;
    assert_ok(om_retract_search(&little, 3, 1, NULL, &less));
    printf("fewest actions: %d for 80 %% of the ROI, %d for 5 %%\n", found.naction, less.naction);
    assert_true(found.naction <= 9 && less.naction >= 3 && less.naction < found.naction);
    OmSearchResult fewest;
    assert_ok(om_retract_search_fewest(&scene, 3, 1, NULL, &fewest));
    printf("%d sequences in all, %d to find the fewest actions\n", found.nsequence,
           fewest.nsequence);
    assert_true(fewest.naction == found.naction && fewest.nexposed > 0);
    assert_true(fewest.nsequence < found.nsequence && fewest.ngrasp == found.ngrasp);
    assert_ok(om_retract_search_fewest(&little, 3, 1, NULL, &fewest));
    assert_int_equal(fewest.naction, less.naction);
    assert_ok(om_retract_search(&scene, 0.02, 1, NULL, &none));  // nothing may be lifted
    assert_int_equal(none.nexposed, 0);
    assert_int_equal(none.naction, 0);
    assert_int_equal(none.ngrasp, found.ngrasp);
    assert_ok(om_retract_search_fewest(&scene, 0.02, 1, NULL, &fewest));
    assert_true(fewest.nexposed == 0 && fewest.naction == 0);
    assert_int_equal(fewest.nsequence, none.nsequence);  // all of them
    assert_true(none.visibility < 0.8 && none.nsequence > 0);
    assert_ok(om_retract_search_both(&scene, 0.02, 0, 1, NULL, &less));  // no first grasp is held
    assert_true(less.nsequence == none.nsequence && less.first_block == -1);
    scene.attach.lo = om_vec3(-1, -1, -1);  // everything is attached
    assert_ok(om_retract_search(&scene, 3, 1, NULL, &none));
    assert_true(none.ngrasp == 0 && none.block == -1);
}

// Pulls of 10 mm, then the folds. OM_PLAN_PULL: none.
static void repeat(Trial* t, int npull, OmPlanVerb first, OmPlanVerb second, TrialResult* c) {
    for (int k = 0; k < npull; ++k) assert_ok(om__trial_pull(t, 0.01 * k, 3, c));
    const OmVec3 lifted = c->tip;
    if (first != OM_PLAN_PULL) assert_ok(om__trial_fold(t, first, 3, c));
    if (second != OM_PLAN_PULL) assert_ok(om__trial_second_fold(t, second, lifted, 3, c));
}

// The visibility of the pair that was found, repeated: PSM1 lifts by 20 mm and folds, and keeps its tissue while PSM2
// grasps the vertex that lay nearest to its point at rest.
static double repeat_pair(const OmScene* scene, const OmSearchResult* one,
                          const OmSearchResult* both) {
    Trial* t;
    TrialResult a = {0}, b = {0};
    int nheld, vert = 0;
    const int nfold = (one->first != OM_PLAN_PULL) + (one->second != OM_PLAN_PULL) +
                      (both->first != OM_PLAN_PULL) + (both->second != OM_PLAN_PULL);
    const int npull = both->naction - 6 - nfold;  // each arm reaches and grasps; PSM1 pulls twice
    assert_ok(om__trial_create(scene, scene->seed, OM_SITE_WORLD, 1, &t));
    const OmVec3 point = om_pose_apply(t->grid.task, t->grid.tip[both->block]);
    for (int v = 0; v < t->site.mesh.nvert; ++v) {
        const double* x = om_body_x(t->body);
        if (om_distance(point, om_load3(x, v)) < om_distance(point, om_load3(x, vert))) vert = v;
    }
    assert_ok(om__trial_grasp(t, both->first_block, &a, &nheld));
    repeat(t, 2, one->first, one->second, &a);
    t->arm = 1;
    assert_ok(om__trial_grasp_at(t, om_load3(om_body_x(t->body), vert), &b, &nheld));
    repeat(t, npull, both->first, both->second, &b);
    om__trial_destroy(t);
    return b.visibility;
}

// A ROI beside the middle, low pulls: no grasp exposes it, but a second grasp does while the best first one is held.
static void test_search_with_both_arms(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    OmSearchResult one, both;
    scene.task.grid = 3;
    scene.task.max_height = 0.02;
    scene.task.retract = 0.01;
    scene.task.speed *= 2;
    scene.roi.center = om_vec3(0, -0.006, 0);
    assert_ok(om_retract_search(&scene, 3, 1, NULL, &one));
    assert_true(one.nexposed == 0 && one.naction == 0 && one.first_block == -1);
    assert_ok(om_retract_search_both(&scene, 3, 2, 1, NULL, &both));
    printf("one arm: %.0f %%; both: %.0f %% with %d and %d, %d actions, %d more sequences\n",
           100 * one.visibility, 100 * both.visibility, both.first_block, both.block, both.naction,
           both.nsequence - one.nsequence);
    assert_true(one.visibility < 0.8 && both.visibility >= 0.8 && both.nexposed >= 1);
    assert_int_equal(both.first_block, one.block);
    assert_true(both.block >= 0 && both.block != both.first_block);
    // each arm: reach, grasp, one or two pulls, at most two folds
    assert_in_range(both.naction, 7, 12);
    assert_true(both.nsequence > one.nsequence && both.nsequence <= 4 * one.nsequence);
    assert_near(repeat_pair(&scene, &one, &both), both.visibility, 0);
    if (!test_is_slow()) return;
    // a ROI that one arm exposes needs no second one
    scene.roi.center = easy_scene().roi.center;
    assert_ok(om_retract_search(&scene, 3, 1, NULL, &one));
    assert_ok(om_retract_search_both(&scene, 3, 2, 1, NULL, &both));
    assert_true(one.nexposed > 0 && both.nexposed == one.nexposed && both.first_block == -1);
    assert_true(both.naction == one.naction && both.block == one.block);
}

static void test_what_cannot_be_done_is_an_answer(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    scene.attach.lo = om_vec3(-1, -1, -1);  // everything is attached
    OmRetractResult r;
    run(&scene, 1, NULL, &r);
    assert_false(r.is_exposed);
    assert_non_null(strstr(r.reason, "no plan is left"));
    om_retract_result_done(&r);
}

// A ROI that nothing hides is no success of the arms: its own outcome, whether the tissue lies beside it or slid off.
static void test_roi_in_view_at_the_start(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    OmRetractResult r;
    run(&scene, 1, NULL, &r);
    assert_int_equal(r.outcome, OM_RETRACT_EXPOSED);
    assert_true(r.is_exposed && r.is_settled && !r.has_slid);
    assert_true(r.twin.shift < 1e-3 && r.truth.shift < 1e-3);  // a sheet on its board
    om_retract_result_done(&r);
    scene.roi.center = om_vec3(-0.059, -0.059, 0);  // three quarters of it lie beside the sheet
    scene.task.visibility = 0.4;
    run(&scene, 1, NULL, &r);
    assert_int_equal(r.outcome, OM_RETRACT_IN_VIEW);
    assert_true(!r.is_exposed && !r.has_slid && r.naction == 0 && r.visibility_start >= 0.4);
    assert_non_null(strstr(r.reason, "before any action"));
    om_retract_result_done(&r);
    // Without its board the sheet falls until it hangs from one edge: its middle, 40 mm from there, by more than that.
    scene = easy_scene();
    scene.tissue.has_board = false;
    scene.attach.lo.x = 0.04;
    run(&scene, 1, NULL, &r);
    assert_int_equal(r.outcome, OM_RETRACT_IN_VIEW);
    assert_true(!r.is_exposed && r.has_slid && r.twin.shift > 0.04 && r.truth.shift > 0.04);
    assert_true(r.twin.shift < 0.12 && r.truth.shift < 0.12);
    assert_non_null(strstr(r.reason, "slid off by"));
    om_retract_result_done(&r);
}

static void test_output_is_whole(void** state) {
    (void)state;
    static const char* const file[] = {"report.html", "view.html", "run.json", "run.vtkhdf",
                                       "frames/000.png"};
    char dir[] = "/tmp/om_retract_XXXXXX", out[64], path[128];
    assert_non_null(mkdtemp(dir));
    snprintf(out, sizeof out, "%s/run", dir);
    OmScene scene = easy_scene();
    OmRetractResult r;
    for (int k = 0; k < 2; ++k) {  // the second run replaces the first
        run(&scene, 1, out, &r);
        om_retract_result_done(&r);
        for (int i = 0; i < 5; ++i) {
            snprintf(path, sizeof path, "%s/%s", out, file[i]);
            assert_true(om_path_exists(path));
        }
    }
    // Nothing but the run is left beside it.
    assert_int_equal(rmdir(dir), -1);
    assert_ok(om_path_remove(out));
    assert_int_equal(rmdir(dir), 0);
}

static bool cancel_soon(void* ctx, const char* stage, double done, double total) {
    (void)stage, (void)done, (void)total;
    return ++*(int*)ctx < 20;
}

// The record so far is kept; what stands in the place stays, and the record gets a name beside it.
static void test_cancelling_keeps_the_record(void** state) {
    (void)state;
    static const char* const file[] = {"report.html", "view.html", "run.json", "run.vtkhdf",
                                       "frames/000.png"};
    char dir[] = "/tmp/om_retract_XXXXXX", out[64];
    assert_non_null(mkdtemp(dir));
    snprintf(out, sizeof out, "%s/run", dir);
    OmScene scene = easy_scene();
    OmRetractDef def = om_retract_default_def(&scene);
    def.out_dir = out;
    int calls = 0;
    OmProgress progress = {cancel_soon, &calls};
    OmRetractResult r;
    int64_t alive = om_alloc_alive();
    for (int k = 0; k < 2; ++k) {
        calls = 0;
        assert_status(om_retract_run(&def, &progress, &r), OM_CANCELLED);
        assert_int_equal(om_alloc_alive(), alive);
        const char* place = strstr(om_error_message(), "the record so far is in ");
        assert_non_null(place);
        char kept[128], path[160];
        snprintf(kept, sizeof kept, "%s", place + strlen("the record so far is in "));
        assert_true((strcmp(kept, out) == 0) == (k == 0));
        for (int i = 0; i < 5; ++i) {
            snprintf(path, sizeof path, "%s/%s", kept, file[i]);
            assert_true(om_path_exists(path));
        }
        char* json;
        size_t size;
        snprintf(path, sizeof path, "%s/run.json", kept);
        assert_ok(om_file_read(path, 1 << 20, &json, &size));
        assert_non_null(strstr(json, "\"outcome\": \"cancelled after "));
        assert_non_null(strstr(json, "\"status\": \"cancelled\""));
        assert_non_null(strstr(json, "\"exposed\": false"));
        om_free(json);
        if (k) assert_ok(om_path_remove(kept));
    }
    calls = -1000000;  // not cancelled: the whole run takes the place of the part
    assert_ok(om_retract_run(&def, &progress, &r));
    om_retract_result_done(&r);
    assert_ok(om_path_remove(out));
    assert_int_equal(rmdir(dir), 0);  // no temporary folder
}

static void test_wrong_defs_are_refused(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    OmRetractResult r;
    OmRetractDef def = om_retract_default_def(NULL);
    assert_status(om_retract_run(&def, NULL, &r), OM_INVALID);
    def = om_retract_default_def(&scene);
    def.program = "/nonexistent/program.lp";
    assert_true(om_retract_run(&def, NULL, &r) < 0);
    assert_non_null(strstr(om_error_message(), "program.lp"));
    def = om_retract_default_def(&scene);
    def.out_dir = "/proc/omentum-cannot-be-here";
    assert_status(om_retract_run(&def, NULL, &r), OM_IO);
}

static void test_calibration(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    scene.task.grid = 2;
    scene.task.max_height = 0.02;
    scene.task.visibility_margin = 1;  // no motion ends as the ROI is seen
    OmForceCalibration a, b;
    assert_ok(om_retract_calibrate_force(&scene, NULL, 2, 1, NULL, &a));
    assert_int_equal(a.nrun, 4);  // of 2 x 2 blocks in two layouts: half of the sheet is held
    assert_int_equal(a.nheld, 4);
    assert_true(a.held_median > 1.5 * a.median);
    if (test_is_slow()) {
        assert_ok(om_retract_calibrate_force(&scene, NULL, 2, 2, NULL, &b));
        assert_memory_equal(&a, &b, sizeof a);
    }
    assert_true(a.lower_quartile <= a.median && a.median <= a.upper_quartile &&
                a.upper_quartile <= a.max);
    assert_near(a.threshold, 2 * a.median, 1e-12);
    assert_true(a.median > 0.01 && a.max < 20);
    assert_true(a.npair >= 0 && a.margin >= 0 && a.margin >= a.more_median);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_output_is_whole),
        cmocka_unit_test(test_roi_in_view_at_the_start),
        cmocka_unit_test(test_cancelling_keeps_the_record),
        cmocka_unit_test(test_search_with_both_arms),
        cmocka_unit_test(test_same_bytes_with_one_or_two_workers),
        cmocka_unit_test(test_fold_after_a_force_stop),
        cmocka_unit_test(test_search),
        cmocka_unit_test(test_force_stops_a_pull),
        cmocka_unit_test(test_the_truth_is_hidden_from_the_twin),
        cmocka_unit_test(test_calibration),
        cmocka_unit_test(test_when_a_motion_stops),
        cmocka_unit_test(test_both_forces_are_told),
        cmocka_unit_test(test_exposed_is_held),
        cmocka_unit_test(test_a_free_corner_is_lifted),
        cmocka_unit_test(test_wrong_defs_are_refused),
        cmocka_unit_test(test_what_cannot_be_done_is_an_answer),
        cmocka_unit_test(test_impossible_scenes_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
