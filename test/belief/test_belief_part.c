// test_belief_part.c: the part of the tissue that does not follow a pull, and a twin without warnings.
#include "warn_rig.h"

// Without a difference of more than the first limit nothing is learnt, and nothing slows down.
static void test_no_warning(void** state) {
    (void)state;
    Course c;
    course_begin(&c, warn_scene(0.02, 0.05, 0.06), false, false);
    tick_to_end(c.loop);
    const OmRetractResult* r = om_loop_result(c.loop);
    assert_true(r->is_exposed && r->belief.nmonitor > 20);
    assert_int_equal(c.seen.nwarning, 0);
    assert_int_equal(c.seen.ntaken, 0);
    assert_int_equal(r->belief.nupdate, 0);
    assert_true(r->belief.mu_max > 0.3e-3 && r->belief.mu_max < 0.02);
    course_end(&c);
}

// A part of the tissue that does not follow the pull is noticed while mu is below its first limit. The truth learnt, it
// does follow.
static void test_a_part(void** state) {
    (void)state;
    Course c;
    OmScene scene = warn_scene(0.02, 0.05, 0.06);
    scene.monitor.part_limit[0] = 1e-3, scene.monitor.part_limit[1] = 2e-3;
    scene.monitor.hysteresis = 0.1e-3;
    // beside the attachments: the first lifts do not expose it
    scene.roi.center = om_vec3(-0.02, -0.03, 0);
    course_begin(&c, scene, false, false);
    // a quick run ends with the first update
    while (om_loop_phase(c.loop) != OM_LOOP_ENDED &&
           (test_is_slow() || om_loop_result(c.loop)->belief.nupdate == 0 ||
            !isfinite(om_loop_result(c.loop)->belief.update[0].mu_after)))
        assert_ok(om_loop_tick(c.loop));
    const OmRetractResult* r = om_loop_result(c.loop);
    print_course(r);
    if (test_is_slow()) assert_true(r->is_exposed);
    assert_int_equal(c.seen.largest, 2);
    assert_int_equal(c.seen.nmove_in_learning, 0);
    assert_true(r->belief.nupdate >= 1);
    assert_int_equal(r->belief.update[0].stage, OM_UPDATE_ADOPTED);
    assert_true(r->belief.update[0].mu_after < 0.5 * r->belief.update[0].mu_before);
    assert_true(r->belief.update[0].part_after < r->belief.update[0].part_before);
    course_end(&c);
}

// The same pulls as if the tissue had been folded before: it was dragged over the board, and its part is not judged.
static void test_a_part_after_a_fold(void** state) {
    (void)state;
    Course c;
    OmScene scene = warn_scene(0.02, 0.05, 0.06);
    scene.monitor.part_limit[0] = 1e-3, scene.monitor.part_limit[1] = 2e-3;
    scene.monitor.hysteresis = 0.1e-3;
    course_begin(&c, scene, false, false);
    while (c.loop->act.arm[0].in_hand < 0) assert_ok(om_loop_tick(c.loop));
    c.loop->belief.warn.has_dragged = true;
    double part = 0;
    for (bool is_pulling = true; is_pulling;) {
        assert_ok(om_loop_tick(c.loop));
        const OmPlanVerb verb = c.loop->act.action.plan.verb;
        is_pulling = c.loop->act.arm[0].in_hand >= 0 && om_loop_phase(c.loop) != OM_LOOP_ENDED;
        is_pulling = is_pulling && verb != OM_PLAN_MOVE_ROI && verb != OM_PLAN_MOVE_AWAY;
        part = fmax(part, om__warn_part(&c.loop->belief));
        assert_int_equal(om_loop_warning(c.loop), 0);
    }
    assert_true(part > 2e-3);  // it would have warned
    course_end(&c);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_no_warning),
        cmocka_unit_test(test_a_part),
        cmocka_unit_test(test_a_part_after_a_fold),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
