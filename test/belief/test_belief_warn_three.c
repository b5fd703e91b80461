// test_belief_warn_three.c: state 3 ends an unattended run.
#include "warn_rig.h"

// State 3 that no estimate answers ends an unattended run. A person may continue: the state then holds no more until it
// has fallen.
static void test_state_three(void** state) {
    (void)state;
    Course c;
    course_begin(&c, warn_scene(0.05e-3, 0.06e-3, 0.07e-3), true, false);
    tick_to_end(c.loop);
    const OmRetractResult* r = om_loop_result(c.loop);
    print_course(r);
    assert_int_equal(r->outcome, OM_RETRACT_HELD);
    assert_int_equal(r->hold, OM_HOLD_WARNING);
    assert_int_equal(c.seen.nhold, 1);
    printf("held after %.2f s\n", c.seen.lasted);
    assert_in_range((int)(1e3 * c.seen.lasted), 900, 2000);  // frames come every 0.1 s
    assert_true(c.seen.ntaken >= 1);
    course_end(&c);
    course_begin(&c, warn_scene(0.05e-3, 0.06e-3, 0.07e-3), true, true);
    while (om_loop_phase(c.loop) != OM_LOOP_HOLD) assert_ok(om_loop_tick(c.loop));
    assert_ok(give(c.loop, OM_LOOP_RESUME));
    for (int i = 0; i < 10; ++i) assert_ok(om_loop_tick(c.loop));
    assert_int_equal(c.seen.nhold, 1);
    // the tissue is let go; the operation continues, and holds again only where the state has fallen before
    const int most = test_is_slow() ? 1000 : 2;  // actions
    for (int i = 0; i < 20000 && om_loop_phase(c.loop) != OM_LOOP_ENDED; ++i) {
        if (om_loop_result(c.loop)->naction > most) break;
        assert_ok(om_loop_tick(c.loop));
        if (om_loop_phase(c.loop) == OM_LOOP_HOLD) assert_ok(give(c.loop, OM_LOOP_RESUME));
    }
    if (test_is_slow()) assert_int_equal(om_loop_phase(c.loop), OM_LOOP_ENDED);
    assert_int_not_equal(om_loop_result(c.loop)->outcome, OM_RETRACT_HELD);
    assert_true(om_loop_result(c.loop)->naction > (test_is_slow() ? 5 : most));
    course_end(&c);
}

// The truth learnt in state 3, the state falls, and no person is called.
static void test_state_three_is_answered(void** state) {
    (void)state;
    Course c;
    course_begin(&c, warn_scene(0.05e-3, 0.06e-3, 0.07e-3), false, false);
    while (om_loop_phase(c.loop) != OM_LOOP_ENDED && c.seen.state3 == 0)
        assert_ok(om_loop_tick(c.loop));
    assert_int_equal(c.seen.largest, 3);
    const double begin = om_loop_sample(c.loop).time;
    while (om_loop_phase(c.loop) != OM_LOOP_ENDED && om_loop_sample(c.loop).time < begin + 3)
        assert_ok(om_loop_tick(c.loop));
    const OmRetractResult* r = om_loop_result(c.loop);
    print_course(r);
    assert_int_not_equal(r->outcome, OM_RETRACT_HELD);
    assert_int_equal(c.seen.nhold, 0);
    assert_true(om_loop_warning(c.loop) < 3 && r->belief.nupdate >= 1);
    assert_int_equal(r->belief.update[0].stage, OM_UPDATE_ADOPTED);
    course_end(&c);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_state_three),
        cmocka_unit_test(test_state_three_is_answered),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
