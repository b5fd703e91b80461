// Threshold and margin of a scene: what the truth bears beyond the twin.
#include "easy_scene.h"
#include "omentum/trial_search.h"
#include "test_common.h"

// Without weight the pull of the truth is in proportion to its modulus, at every instant of lift and folds.
static void calibrate(double young_factor, OmForceCalibration* c) {
    OmScene s = easy_scene();
    s.tissue.density = 1;
    s.tissue.cells = om_vec3(6, 6, 1);
    s.tissue.world_cells = om_vec3(9, 9, 1);
    s.world.young_factor = young_factor;
    s.attach.lo.x = 0.01;
    s.task.grid = 5;
    s.task.speed = 0.2;
    s.task.max_height = 0.02;
    s.task.retract = 0.08;
    assert_ok(om_retract_calibrate_force(&s, 1, 1, NULL, c));
}

static void a_stiffer_truth_bears_more(void** state) {
    (void)state;
    OmForceCalibration soft, stiff;
    calibrate(1, &soft);
    calibrate(2, &stiff);
    print_message("epsilon %g N, %d instants, median %g and %g N, margin %g and %g N\n",
                  soft.threshold, soft.npair, soft.more_median, stiff.more_median, soft.margin,
                  stiff.margin);
    assert_true(soft.npair > 2);
    assert_int_equal(soft.npair, stiff.npair);  // the instants are the twin's
    assert_near(soft.threshold, stiff.threshold, 0);
    // the twin's median m is between half of epsilon and epsilon: truth - m, then 2 truth - m
    const double truth = stiff.more_median - soft.more_median;
    assert_near(truth - soft.more_median, 0.75 * soft.threshold, 0.25 * soft.threshold);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_stiffer_truth_bears_more)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
