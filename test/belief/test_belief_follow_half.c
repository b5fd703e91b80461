// test_belief_follow_half.c: a fold that the twin learns or follows in part.
#include "warn_rig.h"

// What is learnt in a fold must explain most of the distance, otherwise the twin follows.
static void test_doubtful_fold(void** state) {
    (void)state;
    for (int k = 0; k < 2; ++k) {
        Course c;
        course_begin(&c, warn_scene(0.1e-3, 0.3e-3, 0.06), false, false);
        c.teacher.truth = om_world_truth(c.g.world);
        c.teacher.left = k ? 0.7 : 0.5;
        while (c.loop->act.arm[0].in_hand < 0) assert_ok(om_loop_tick(c.loop));
        c.loop->belief.warn.has_dragged = true;
        while (om_loop_result(c.loop)->belief.nupdate == 0 ||
               om_loop_result(c.loop)->belief.update[0].stage == OM_UPDATE_STARTED)
            assert_ok(om_loop_tick(c.loop));
        const OmRetractUpdate* u = &om_loop_result(c.loop)->belief.update[0];
        assert_int_equal(u->stage, k ? OM_UPDATE_FOLLOWED : OM_UPDATE_ADOPTED);
        assert_true((u->nattached_after == u->nattached_before) == k);
        if (k) assert_non_null(strstr(u->reason, "still 0.7 mm from the model, before 1.0 mm"));
        course_end(&c);
    }
}

// Where mu stays above its first limit the tissue is let go, whatever a fold would show in the twin.
static void test_half_a_follow(void** state) {
    (void)state;
    Course c;
    OmScene scene = warn_scene(0.15e-3, 0.3e-3, 0.06);
    scene.task.ahead = 3;
    course_begin(&c, scene, true, false);
    c.teacher.truth = om_world_truth(c.g.world);
    c.teacher.way = 0.3;
    while (c.loop->act.arm[0].in_hand < 0) assert_ok(om_loop_tick(c.loop));
    c.loop->belief.warn.has_dragged = true;
    tick_past_warning(c.loop, 1);
    const OmRetractResult* r = om_loop_result(c.loop);
    print_course(r);
    assert_true(r->belief.update[0].mu_after > 0.15e-3);
    assert_true(r->belief.update[0].mu_after < r->belief.update[0].mu_before);
    int i = 0;
    while (i + 1 < r->naction && r->action[i].outcome != OM_ACTION_WARNED) ++i;
    assert_true(i + 1 < r->naction);
    assert_int_equal(r->action[i + 1].verb, OM_PLAN_RELEASE);
    course_end(&c);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_doubtful_fold),
        cmocka_unit_test(test_half_a_follow),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
