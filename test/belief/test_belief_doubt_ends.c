// test_belief_doubt_ends.c: each point is grasped once, then the loop ends.
#include "warn_rig.h"

// Every estimate attaches everything: the tissue in hand is given up after a second doubt, each of the two points is
// grasped once, and the loop ends.
static void test_doubt_ends(void** state) {
    (void)state;
    Course c;
    begin_doubt(&c, doubt_scene(1.5), 20, 1000);  // nothing exposes it
    c.loop->task.max_height = 0.05;
    tick_to_end(c.loop);
    const OmRetractResult* r = om_loop_result(c.loop);
    print_course(r);
    int ngrasp = 0;
    for (int i = 0; i < r->naction; ++i) ngrasp += r->action[i].verb == OM_PLAN_GRASP;
    assert_int_equal(ngrasp, 2);
    assert_true(c.seen.ndoubt >= 1 && c.seen.ndoubt <= 4);
    assert_int_not_equal(r->outcome, OM_RETRACT_GAVE_UP);
    course_end(&c);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_doubt_ends),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
