// test_belief_doubt_first.c: after a warning the loop doubts the first belief, too.
#include "warn_rig.h"

// The first belief attaches the tissue under another point, which is free, and every estimate agrees and attaches all.
// After a warning, where no plan is left, the first belief is given up, and that point is grasped; unless a person has
// marked it.
static void doubt_first(bool is_marked) {
    Course c;
    OmScene scene = doubt_scene(1.5);  // nothing exposes it
    scene.believed.kind = OM_BELIEF_BOX;
    scene.believed.lo = om_vec3(-1, 0.01, -1), scene.believed.hi = om_vec3(-0.03, 1, 1);
    begin_doubt(&c, scene, 15, 1000);
    if (is_marked)
        assert_ok(om_loop_command(c.loop, &(OmLoopCommand){OM_LOOP_ATTACH, .block = 15}));
    const OmRetractResult* r = om_loop_result(c.loop);
    int ngrasp[25] = {0};
    // a quick run ends where the other point is grasped
    for (int n = 0; om_loop_phase(c.loop) != OM_LOOP_ENDED;) {
        if (!test_is_slow() && ngrasp[15] > 0) break;
        assert_ok(om_loop_tick(c.loop));
        for (; n < r->naction; ++n)
            if (r->action[n].verb == OM_PLAN_GRASP) ++ngrasp[r->action[n].block];
    }
    print_course(r);
    assert_int_equal(ngrasp[12], 1);
    assert_int_equal(ngrasp[15], !is_marked);
    assert_int_not_equal(r->outcome, OM_RETRACT_GAVE_UP);
    course_end(&c);
}

static void test_doubt_of_the_first_belief(void** state) {
    (void)state;
    doubt_first(false);
}

static void test_a_mark_is_not_doubted(void** state) {
    (void)state;
    doubt_first(true);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_doubt_of_the_first_belief),
        cmocka_unit_test(test_a_mark_is_not_doubted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
