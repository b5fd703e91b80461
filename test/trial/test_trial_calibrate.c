// Threshold and margin of a scene: what the truth bears beyond the twin.
#include "easy_scene.h"
#include "omentum/trial_search.h"
#include "test_common.h"
#include "trial/trial_lift.h"

// Without weight the pull of the truth is in proportion to its modulus, at every instant of lift and folds.
static OmStatus calibrate_seen(double visibility, double young_factor, const double young[2],
                               OmForceCalibration* c) {
    OmScene s = easy_scene();
    s.task.visibility = visibility;
    s.tissue.density = 1;

    s.tissue.cells = om_vec3(6, 6, 1);
    s.tissue.world_cells = om_vec3(9, 9, 1);
    s.world.young_factor = young_factor;
    s.attach.lo.x = 0.01;
    s.task.grid = 5;
    s.task.speed = 0.2;
    s.task.max_height = 0.02;
    s.task.retract = 0.08;
    return om_retract_calibrate_force(&s, young, 1, 1, NULL, c);
}

// No motion ends as the ROI is seen.
static void calibrate(double young_factor, const double young[2], OmForceCalibration* c) {
    assert_ok(calibrate_seen(1.5, young_factor, young, c));
}

static void a_stiffer_truth_bears_more(void** state) {
    (void)state;
    OmForceCalibration soft, stiff, drawn, one;
    calibrate(1, NULL, &soft);
    calibrate(7, (const double[2]){2, 2},
              &stiff);  // a range of one value: the scene's does not count
    if (test_is_slow()) {
        calibrate(2, NULL, &one);
        assert_memory_equal(&one, &stiff, sizeof one);
        // the only layout gets the share 0.309 of a range
        calibrate(0.5 * pow(4, 0.5 * 0.6180339887498949), NULL, &one);
        calibrate(7, (const double[2]){0.5, 2}, &drawn);
        assert_near_rel(drawn.margin, one.margin, 1e-12);
        assert_near_rel(drawn.more_median, one.more_median, 1e-12);
    }
    print_message("epsilon %g N, %d instants, median %g and %g N, margin %g and %g N\n",
                  soft.threshold, soft.npair, soft.more_median, stiff.more_median, soft.margin,
                  stiff.margin);
    assert_near(soft.threshold, stiff.threshold, 0);  // of the twin alone
    assert_true(soft.npair >= 10 && stiff.npair >= 10);
    assert_true(stiff.margin > soft.margin && stiff.more_median > soft.more_median);
}

// A run ends its motions where the ROI is seen, so it pulls less: too little here to tell of the truth.
static void motions_end_where_the_roi_is_seen(void** state) {
    (void)state;
    OmForceCalibration seen, all;
    calibrate(1, NULL, &all);
    assert_status(calibrate_seen(0.1, 1, NULL, &seen), OM_INVALID);
    print_message("epsilon %g N, without an end %g N\n", seen.threshold, all.threshold);
    assert_true(seen.threshold < 0.95 * all.threshold && seen.nrun == all.nrun);
}

// The truth bears 1.6 times as much, at each of 1,000 pulls up to the threshold: of the pulls between 3/4 L and L
// 95 % are below (0.75 + 0.95 * 0.25) L, where the truth bears 1.58 L.
static void the_limit_keeps_the_truth_below_the_threshold(void** state) {
    (void)state;
    enum { N = 1000 };
    double twin[N], truth[N], scratch[N];
    const double epsilon = 1.32;
    for (int i = 0; i < N; ++i) {
        twin[i] = epsilon * (i + 0.5) / N;
        truth[i] = 1.6 * twin[i];
    }
    assert_near(om__trial_limit(N, twin, truth, epsilon, scratch), epsilon * 0.63, 1e-12);
    for (int i = 0; i < N; ++i) truth[i] = 0.9 * twin[i];
    assert_near(om__trial_limit(N, twin, truth, epsilon, scratch), epsilon, 0);
    for (int i = 0; i < N; ++i) truth[i] = 1.1 * epsilon;  // whatever the twin bears
    assert_near(om__trial_limit(N, twin, truth, epsilon, scratch), 0, 0);
    assert_near(om__trial_limit(9, twin, twin, epsilon, scratch), 0, 0);  // too few
}

// Once the pull exceeds what is wanted, the body is left alone, and the rest of the instants bear that pull.
static void a_motion_ends_at_a_pull(void** state) {
    (void)state;
    enum { N = 30 };
    OmScene s = easy_scene();
    s.attach.lo.x = 0.01;
    Trial* t;
    assert_ok(om__trial_create(&s, 1, OM_SITE_TWIN, 1, &t));
    TrialResult c = {0};
    OmVec3 tip[N];
    double all[N], most[N];
    int nheld, block = 0, k = 0;
    bool is_over;
    while (t->grid.vert[block] < 0 || om__grid_is_fixed(&t->grid, t->body, block)) ++block;
    for (int pass = 0; pass < 2; ++pass) {
        assert_ok(om__trial_grasp(t, block, &c, &nheld));
        assert_true(nheld > 0);
        for (int i = 0; i < N; ++i) tip[i] = om_add(c.tip, om_vec3(0, 0, 1e-3 * (i + 1)));
        const double limit = pass ? 0.5 * all[N - 1] : 1e9;
        assert_ok(om__trial_replay(t, N, tip, limit, pass ? most : all, &is_over));
        assert_int_equal(is_over, pass);
    }
    while (all[k] <= 0.5 * all[N - 1]) ++k;
    assert_true(k > 2 && k < N - 2);
    assert_memory_equal(all, most, (size_t)(k + 1) * sizeof *all);
    for (int i = k; i < N; ++i) assert_near(most[i], all[k], 0);
    om__trial_destroy(t);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_stiffer_truth_bears_more),
        cmocka_unit_test(motions_end_where_the_roi_is_seen),
        cmocka_unit_test(the_limit_keeps_the_truth_below_the_threshold),
        cmocka_unit_test(a_motion_ends_at_a_pull),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
