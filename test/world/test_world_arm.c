// test_world_arm.c: arms apart from their tissue: the same motions, and a tissue that follows at its own pace.
#include <string.h>

#include "test_alloc.h"
#include "test_field.h"

#define DT 0.01

typedef struct Apart {  // a world whose arms and tissue advance apart
    Field f;
    OmWorld* arms;
    void* block;
} Apart;

static void begin(Apart* s, OmScene scene) {
    setup(&s->f, scene);
    assert_ok(om_world_create_arms(s->f.world, &s->arms));
    assert_true(om_world_state_size(s->arms) < 2000);
    s->block = malloc(om_world_state_size(s->arms));
}

static void end(Apart* s) {
    free(s->block);
    om_world_destroy(s->arms);
    teardown(&s->f);
}

static void follow(Apart* s, double dt) {
    assert_ok(om_world_save(s->arms, s->block));
    assert_ok(om_world_set_arms(s->f.world, s->block));
    assert_ok(om_world_advance_tissue(s->f.world, dt));
    assert_ok(om_world_answer_arms(s->f.world, s->arms));
}

static OmObservation see(const Apart* s) {
    OmObservation obs = {0};
    assert_ok(om_world_observe(s->arms, 0, &obs));
    return obs;
}

// `nper` ticks of the arms for each step of the tissue.
static void advance(Apart* s, int nstep, int nper) {
    for (int i = 0; i < nstep; ++i) {
        for (int k = 0; k < nper; ++k) assert_ok(om_world_advance(s->arms, DT));
        follow(s, nper * DT);
    }
}

static void go(Apart* s, OmVec3 p_task) {
    const OmPose goal = {om_pose_apply(s->f.site.pose_world_task, p_task), see(s).arm[0].tip.q};
    assert_ok(om_world_move(s->arms, 0, goal, 0.1));
    for (int i = 0; i < 400 && see(s).arm[0].is_moving; ++i) advance(s, 1, 1);
    assert_false(see(s).arm[0].is_moving);
}

// A tissue that follows each tick makes one world of both: measured arms, noise and tissue are the same, to the bit.
static void test_together_they_are_the_world(void** state) {
    (void)state;
    Apart s;
    Field whole;
    OmScene scene = half_held();
    scene.world.tool_noise = 2e-4;
    scene.world.force_noise = 0.01;
    begin(&s, scene);
    setup(&whole, scene);
    const OmPose goal = to_world(&whole, 0, om_vec3(-0.04, -0.04, 0.03));
    OmWorld* moved[2] = {s.arms, whole.world};
    for (int k = 0; k < 2; ++k) {
        assert_ok(om_world_move(moved[k], 0, goal, 0.05));
        assert_ok(om_world_set_jaw(moved[k], 1, 0.5));
    }
    for (int i = 0; i < 50; ++i) {
        advance(&s, 1, 1);
        assert_ok(om_world_advance(whole.world, DT));
        const OmObservation a = see(&s), b = observe(&whole, 0), c = observe(&s.f, 0);
        assert_near(a.time, b.time, 0);
        assert_memory_equal(&a.arm[1].tip, &b.arm[1].tip, sizeof(OmPose));
        assert_memory_equal(a.arm[0].q, b.arm[0].q, sizeof a.arm[0].q);
        assert_near(a.arm[1].jaw, b.arm[1].jaw, 0);
        assert_near(a.arm[1].jaw_speed, b.arm[1].jaw_speed, 0);
        assert_memory_equal(&c.arm[0].tip, &b.arm[0].tip, sizeof(OmPose));
        assert_memory_equal(&c.arm[0].force, &b.arm[0].force, sizeof(OmVec3));
        assert_false(a.arm[0].has_wrench);
    }
    assert_true(om_body_hash(om_world_truth(s.f.world)) ==
                om_body_hash(om_world_truth(whole.world)));
    assert_null(om_world_truth(s.arms));
    assert_status(om_world_observe(s.arms, OM_OBSERVE_DEPTH, &(OmObservation){0}), OM_UNAVAILABLE);
    teardown(&whole);
    end(&s);
}

// The tissue steps once in eight ticks. Its answer to a jaw that closes comes late: the jaw does not pass the angle of
// tissue before, is not at rest, and does not jump back. The tissue then hangs on the tip.
static void test_a_slow_tissue_is_grasped(void** state) {
    (void)state;
    Apart s;
    begin(&s, half_held());
    go(&s, om_vec3(-0.048, -0.048, 0.005));
    assert_ok(om_world_set_jaw(s.arms, 0, 0));
    OmArmObservation arm = see(&s).arm[0];
    const double on_tissue = 5 * OM_PI / 180;
    for (int i = 0; i < 200; ++i) {  // it closes slowly, and is at rest at no time
        const double before = arm.jaw;
        assert_ok(om_world_advance(s.arms, DT));
        arm = see(&s).arm[0];
        assert_true(arm.jaw <= before && arm.jaw >= on_tissue);
        assert_true(arm.jaw_speed < -0.05 && !om_arm_is_holding(&arm));
    }
    follow(&s, DT);
    advance(&s, 4, 8);
    arm = see(&s).arm[0];
    assert_near(arm.jaw, on_tissue, 1e-12);
    assert_true(om_arm_is_holding(&arm));
    const OmBody* truth = om_world_truth(s.f.world);
    int held = 0;
    while (om_body_held_by(truth)[held] != 0) ++held;
    const OmVec3 from = om_load3(om_body_x(truth), held), tip = arm.tip.p;
    const OmPose up = {om_add(tip, om_vec3(0, 0, 0.02)), arm.tip.q};
    assert_ok(om_world_move(s.arms, 0, up, 0.05));
    for (int i = 0; i < 64; ++i) assert_ok(om_world_advance(s.arms, DT));
    follow(&s, DT);  // 20 mm at once: the tissue comes after at 0.25 m/s
    assert_near(om_load3(om_body_x(truth), held).z - from.z, 0.0025, 5e-4);
    void* kept = malloc(om_world_state_size(s.f.world));  // a snapshot has what the tissue follows
    assert_ok(om_world_save(s.f.world, kept));
    follow(&s, DT);
    const OmVec3 once = om_load3(om_body_x(truth), held);
    assert_ok(om_world_restore(s.f.world, kept));
    follow(&s, DT);
    assert_near(om_distance(once, om_load3(om_body_x(truth), held)), 0, 0);
    free(kept);
    for (int i = 0; i < 12; ++i) follow(&s, DT);
    const OmVec3 way = om_sub(om_load3(om_body_x(truth), held), from);
    assert_near(om_distance(see(&s).arm[0].tip.p, up.p), 0, 1e-12);
    assert_near(way.z, 0.02, 1e-3);
    // it opens and closes 30 mm away, unseen between two steps: it lets go, and holds there what is there, nothing
    assert_ok(om_world_set_jaw(s.arms, 0, 0.6));
    for (int i = 0; i < 30; ++i) assert_ok(om_world_advance(s.arms, DT));
    assert_ok(om_world_move(s.arms, 0, (OmPose){om_add(up.p, om_vec3(0, 0, 0.03)), up.q}, 0.2));
    for (int i = 0; i < 30; ++i) assert_ok(om_world_advance(s.arms, DT));
    assert_ok(om_world_set_jaw(s.arms, 0, 0));
    for (int i = 0; i < 30; ++i) assert_ok(om_world_advance(s.arms, DT));
    assert_true(om_body_is_holding(truth, 0));
    follow(&s, DT);
    assert_false(om_body_is_holding(truth, 0));
    advance(&s, 20, 1);
    arm = see(&s).arm[0];
    assert_near(arm.jaw, 0, 0);
    assert_true(om_arm_is_empty(&arm));
    end(&s);
}

static OmStatus make_arms(void* ctx) {
    OmWorld* arms;
    OmStatus status = om_world_create_arms(((Field*)ctx)->world, &arms);
    om_world_destroy(arms);
    return status;
}

static void test_arms_are_of_a_simulated_world(void** state) {
    (void)state;
    Field f;
    OmWorld *arms, *none;
    setup(&f, half_held());
    assert_ok(om_world_create_arms(f.world, &arms));
    assert_status(om_world_create_arms(arms, &none), OM_UNAVAILABLE);
    assert_null(none);
    assert_status(om_world_set_arms(arms, &f), OM_UNAVAILABLE);
    assert_status(om_world_advance_tissue(arms, DT), OM_UNAVAILABLE);
    assert_status(om_world_advance_tissue(f.world, 0), OM_INVALID);
    assert_status(om_world_answer_arms(arms, arms), OM_UNAVAILABLE);
    assert_status(om_world_answer_arms(f.world, f.world), OM_INVALID);
    om_world_destroy(arms);
    teardown(&f);
}

static void test_memory_runs_out(void** state) {
    (void)state;
    Field f;
    setup(&f, half_held());
    assert_true(test_failing_allocations(make_arms, &f, 1) == 1);
    teardown(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_together_they_are_the_world),
        cmocka_unit_test(test_a_slow_tissue_is_grasped),
        cmocka_unit_test(test_arms_are_of_a_simulated_world),
        cmocka_unit_test(test_memory_runs_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
