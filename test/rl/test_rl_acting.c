// test_rl_acting.c: a policy of the task "approach" moves a tip in metres: boxes, steps, the goal.
#include "omentum/rl_acting.h"
#include "test_alloc.h"

#define POLICY "weights/approach.safetensors"

// The box has the stated side, each place is a step along the axes, and the way ends at the goal.
static void follow(OmRlActing* a, bool is_reach, OmVec3 tip, OmVec3 goal, double side) {
    const double step = 0.02 * side;
    int n = 0;
    for (; n < 400; ++n) {
        OmVec3 place;
        assert_ok(om_rl_acting_next(a, is_reach, n == 0, tip, goal, &place));
        assert_near(om_rl_acting_side(a), side, 1e-12);
        if (om_distance(place, goal) == 0) break;
        double way[3];
        om_store3(way, 0, om_sub(place, tip));
        for (int k = 0; k < 3; ++k)
            assert_near(fabs(fabs(way[k]) - step / 2), step / 2, 1e-12);  // 0 or one step
        tip = place;
    }
    print_message("%d places, the rest %.1f mm\n", n, 1e3 * om_distance(tip, goal));
    assert_true(n > 3 && n < 400);
    assert_below(om_distance(tip, goal), 1.5 * step);
}

static void test_motions(void** state) {
    (void)state;
    OmRlActing* a;
    assert_ok(om_rl_acting_load(POLICY, &a));
    // a short reach has the least side, a long one 1.5 times its longest side; a pull four times its length
    follow(a, true, om_vec3(0.03, -0.02, 0.06), om_vec3(0, 0.01, 0.01), 0.2);
    follow(a, true, om_vec3(0.2, 0, 0.08), om_vec3(0, 0.02, 0.02), 0.3);
    follow(a, false, om_vec3(0.01, 0.01, 0.01), om_vec3(0.01, 0.01, 0.05), 0.16);
    OmVec3 place, goal = om_vec3(0.001, 0, 0);
    assert_ok(om_rl_acting_next(a, false, true, om_vec3(0.0009, 0, 0), goal, &place));
    assert_near(om_rl_acting_side(a), 0.01, 1e-12);
    assert_near(om_distance(place, goal), 0, 0);
    om_rl_acting_destroy(a);
    om_rl_acting_destroy(NULL);
}

static void test_refused(void** state) {
    (void)state;
    OmRlActing* a;
    assert_status(om_rl_acting_load("weights/retract_ppo.safetensors", &a), OM_INVALID);
    assert_null(a);
    assert_non_null(strstr(om_error_message(), "omentum rl train -t approach"));
    assert_true(om_rl_acting_load("/nowhere", &a) < 0);
    assert_null(a);
}

static OmStatus load(void* ctx) {
    (void)ctx;
    OmRlActing* a;
    OmStatus status = om_rl_acting_load(POLICY, &a);
    om_rl_acting_destroy(a);
    return status;
}

static void test_memory(void** state) {
    (void)state;
    assert_true(test_failing_allocations(load, NULL, test_stride(5)) > 2);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_motions),
                                       cmocka_unit_test(test_refused),
                                       cmocka_unit_test(test_memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
