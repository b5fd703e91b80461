// test_world_plain.c: worlds without truth: one in closed form, and the simulated one with its truth hidden.
#include "plain_world.h"
#include "test_field.h"

#define STEP 0.02  // s

static OmArmObservation arm_of(OmWorld* world, int arm) {
    OmObservation obs = {0};
    assert_ok(om_world_observe(world, 0, &obs));
    return obs.arm[arm];
}

static double look(OmWorld* world) {
    OmObservation obs = {0};
    assert_ok(om_world_observe(world, OM_OBSERVE_VISIBILITY, &obs));
    return obs.visibility;
}

static void go(OmWorld* world, int arm, OmVec3 p, double speed) {
    OmPose goal = {p, arm_of(world, arm).tip.q};
    assert_ok(om_world_move(world, arm, goal, speed));
    for (int i = 0; i < 500 && arm_of(world, arm).is_moving; ++i)
        assert_ok(om_world_advance(world, STEP));
    assert_near(om_distance(arm_of(world, arm).tip.p, p), 0, 1e-9);
}

static void close_jaw(OmWorld* world, int arm) {
    assert_ok(om_world_set_jaw(world, arm, 0));
    for (int i = 0; i < 15; ++i) assert_ok(om_world_advance(world, STEP));
}

static void check_no_truth(OmWorld* world) {
    OmPicture picture = {0};
    assert_null(om_world_truth(world));
    assert_null(om_world_tool(world, 0));
    assert_status(om_world_render(world, 64, 48, &picture), OM_UNAVAILABLE);
    assert_status(om_world_reset(world), OM_UNAVAILABLE);
    assert_int_equal(om_world_state_size(world), 0);
}

static void test_a_foreign_world_obeys_the_same_calls(void** state) {
    (void)state;
    OmSite site = {
        .pose_world_task = {om_vec3(0.1, 0.2, 0.3), om_quat_axis_angle(om_vec3(0, 0, 1), 0.5)},
        .half_size = om_vec3(0.06, 0.06, 0.0025)};
    PlainWorld plain;
    plain_world_init(&plain, &site, 1);
    OmWorld* world = &plain.head;
    check_no_truth(world);
    assert_int_equal(om_world_narm(world), 1);
    assert_null(om_world_psm(world, 0));
    OmObservation obs = {0};
    assert_status(om_world_observe(world, OM_OBSERVE_DEPTH, &obs), OM_UNAVAILABLE);
    assert_status(om_world_observe(world, OM_OBSERVE_VISIBILITY | 64, &obs), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "0x40"));
    assert_status(om_world_observe(world, 1U << 31, &obs), OM_INVALID);
    plain.head.sources |= 32;  // nor may a world make up flags
    assert_status(om_world_observe(world, 32, &obs), OM_INVALID);
    plain.head.sources &= ~32U;
    assert_status(om_world_set_jaw(world, 1, 0), OM_INVALID);
    OmPose far_away = {om_vec3(1, 1, 1), om_quat_identity()};
    assert_status(om_world_move(world, 0, far_away, 0.02), OM_INVALID);
    OmVec3 corner = om_pose_apply(site.pose_world_task, om_vec3(-0.048, -0.048, 0.005));
    OmVec3 above = om_add(corner, om_vec3(0, 0, 0.025)), high = om_add(corner, om_vec3(0, 0, 0.05));
    go(world, 0, above, 0.1);
    close_jaw(world, 0);
    OmArmObservation empty = arm_of(world, 0);
    assert_false(om_arm_is_holding(&empty));
    assert_ok(om_world_set_jaw(world, 0, 0.7));
    for (int i = 0; i < 15; ++i) assert_ok(om_world_advance(world, STEP));
    go(world, 0, corner, 0.1);
    close_jaw(world, 0);
    OmArmObservation full = arm_of(world, 0);
    assert_true(om_arm_is_holding(&full));
    assert_near(look(world), 0, 0);
    go(world, 0, above, 0.1);
    assert_near(look(world), 0.5, 1e-9);  // 25 mm: half of 10 to 40
    go(world, 0, high, 0.1);
    assert_near(look(world), 1, 0);
    om_world_destroy(world);
}

// With its truth hidden a simulated world measures the same as before.
static void test_a_hidden_truth_changes_no_measurement(void** state) {
    (void)state;
    Field open, hidden;
    OmWorldOps table;
    setup(&open, half_held());
    setup(&hidden, half_held());
    OmBody* truth = om_world_truth(hidden.world);
    hide_truth(hidden.world, &table);
    check_no_truth(hidden.world);
    assert_true(om_world_psm(hidden.world, 0) != NULL);
    Field* both[2] = {&open, &hidden};
    uint64_t seen[2];
    for (int k = 0; k < 2; ++k) {
        grasp_at(both[k], 0, om_vec3(-0.048, -0.048, 0.005));
        assert_true(is_holding(both[k], 0));
        OmObservation obs = observe(both[k], om_world_sources(both[k]->world));
        seen[k] = om_hash(&obs.arm[0].tip, sizeof obs.arm[0].tip, OM_HASH_SEED);
        seen[k] = hash_pictures(&obs, seen[k]);
        om_observation_done(&obs);
    }
    assert_true(seen[0] == seen[1]);
    assert_true(om_body_hash(truth) == om_body_hash(om_world_truth(open.world)));
    teardown(&open);
    teardown(&hidden);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_foreign_world_obeys_the_same_calls),
        cmocka_unit_test(test_a_hidden_truth_changes_no_measurement),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
