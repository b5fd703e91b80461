// test_act_apart.c: tools keep 8 mm apart.
#include <math.h>

#include "loop_rig.h"

#include "loop/loop_state.h"

// The distance of two tools by points on the axes of their capsules, 200 on each.
static double sampled_gap(const OmWorld* world, const OmObservation* obs) {
    OmPsmCapsule c[2][OM_PSM_NCAPSULE];
    double least = INFINITY;
    for (int a = 0; a < 2; ++a)
        om_psm_capsules(om_world_psm(world, a), obs->arm[a].q, obs->arm[a].jaw, c[a]);
    for (int i = 0; i < OM_PSM_NCAPSULE; ++i)
        for (int k = 0; k < OM_PSM_NCAPSULE; ++k)
            for (int s = 0; s <= 200; ++s)
                for (int t = 0; t <= 200; ++t) {
                    OmVec3 p = om_madd(c[0][i].a, s / 200.0, om_sub(c[0][i].b, c[0][i].a));
                    OmVec3 q = om_madd(c[1][k].a, t / 200.0, om_sub(c[1][k].b, c[1][k].a));
                    least = fmin(least, om_distance(p, q) - c[0][i].radius - c[1][k].radius);
                }
    return least;
}

// PSM2 stands where PSM1 must go: it makes room, the point is grasped, and the tools stay apart.
static void test_the_other_tool_is_in_the_way(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    rig_start(&g);
    OmLoop* loop = make_loop(&g, NULL);
    OmObservation obs = {0};
    // the first plan, and the point that it reaches for
    while (om_loop_phase(loop) != OM_LOOP_ACT) assert_ok(om_loop_tick(loop));
    const int block = om_loop_action(loop)->block;
    const OmVec3 target = om_pose_apply(loop->grid.task, loop->grid.tip[block]);
    om_loop_destroy(loop);
    rig_start(&g);
    assert_ok(om_world_observe(g.world, 0, &obs));
    OmVec3 up = om_quat_rotate(g.world_site.pose_world_task.q, om_vec3(0, 0, 1));
    OmPose above = {om_madd(target, 0.03, up), obs.arm[1].tip.q};
    assert_ok(om_world_move(g.world, 1, above, 0.1));
    do {
        assert_ok(om_world_advance(g.world, 0.02));
        assert_ok(om_world_observe(g.world, 0, &obs));
    } while (obs.arm[1].is_moving);
    loop = make_loop(&g, NULL);
    double least = INFINITY;
    for (int i = 0; i < 1500 && om_loop_phase(loop) != OM_LOOP_ENDED; ++i) {
        assert_ok(om_loop_tick(loop));
        assert_ok(om_world_observe(g.world, 0, &obs));
        if (i % 10 == 0) least = fmin(least, sampled_gap(g.world, &obs));
    }
    const OmRetractResult* r = om_loop_result(loop);
    printf("%s; tools at least %.1f mm apart\n", r->reason, 1e3 * least);
    assert_int_equal(r->action[0].outcome, OM_ACTION_DONE);
    assert_true(r->is_exposed);
    assert_int_equal(r->action[0].block, block);
    assert_true(least > 0.0075);  // measured joints have noise
    om_loop_destroy(loop);
    om_observation_done(&obs);
    rig_destroy(&g);
}

// A loop after its first tick, and what it saw of the arms.
static OmLoop* begin(Rig* g, OmObservation* obs) {
    rig_create(g, object_scene());
    rig_start(g);
    OmLoop* loop = make_loop(g, NULL);
    assert_ok(om_loop_tick(loop));
    assert_ok(om_world_observe(g->world, 0, obs));
    return loop;
}

// Against points on the capsules; away from the other tool every motion is allowed.
static void test_gap(void** state) {
    (void)state;
    Rig g;
    OmObservation obs = {0};
    OmLoop* loop = begin(&g, &obs);
    const OmVec3 a = obs.arm[0].tip.p, b = obs.arm[1].tip.p;
    const double parked = sampled_gap(g.world, &obs);
    assert_true(parked > 0.02);
    OmPose nearer = {om_madd(a, 0.9, om_sub(b, a)), obs.arm[0].tip.q};
    OmPose away = {om_madd(a, -0.1, om_sub(b, a)), obs.arm[0].tip.q};
    assert_true(om__tool_gap(&loop->act, 0, nearer) < 0.008 &&
                !om__is_apart(&loop->act, 0, nearer));
    assert_true(isinf(om__tool_gap(&loop->act, 0, away)) && om__is_apart(&loop->act, 0, away));
    for (double part = 0.1; part < 0.6; part += 0.1) {
        OmPose goal = {om_madd(a, part, om_sub(b, a)), obs.arm[0].tip.q};
        OmObservation there = obs;
        assert_ok(om_psm_inverse(om_world_psm(g.world, 0), goal, obs.arm[0].q, there.arm[0].q));
        const double gap = sampled_gap(g.world, &there), found = om__tool_gap(&loop->act, 0, goal);
        printf("%.0f %% of the way: %.2f mm, sampled %.2f mm\n", 100 * part, 1e3 * found,
               1e3 * gap);
        assert_true(found <= gap + 1e-4);
        assert_near(found, gap, 1e-3);
    }
    om_loop_destroy(loop);
    om_observation_done(&obs);
    rig_destroy(&g);
}

// A straight way past the other tool, whose end has room again: the narrow place counts. From 30 mm on one side of the
// other tip, 17 mm in front of it, to 25 mm on its other side.
static void test_the_whole_way_counts(void** state) {
    (void)state;
    Rig g;
    OmObservation obs = {0};
    OmLoop* loop = begin(&g, &obs);
    const OmPsm* psm = om_world_psm(g.world, 0);
    const OmVec3 b = obs.arm[1].tip.p, to_b = om_normalize(om_sub(b, obs.arm[0].tip.p));
    const OmVec3 up = om_quat_rotate(g.world_site.pose_world_task.q, om_vec3(0, 0, 1));
    const OmVec3 side = om_normalize(om_cross(up, to_b)), middle = om_madd(b, -0.017, to_b);
    const OmVec3 from = om_madd(middle, -0.03, side), end = om_madd(middle, 0.025, side);
    ArmState* arm = &loop->act.arm[0];
    double least = INFINITY, now = 0, last = 0;
    OmObservation there = obs;
    for (int k = 0; k <= 11; ++k) {  // each 5 mm
        const OmPose pose = {om_madd(from, k / 11.0, om_sub(end, from)), obs.arm[0].tip.q};
        assert_ok(om_psm_inverse(psm, pose, there.arm[0].q, there.arm[0].q));
        if (k == 0) memcpy(arm->joint, there.arm[0].q, sizeof arm->joint);
        last = sampled_gap(g.world, &there);
        least = fmin(least, last);
        if (k == 0) now = last;
    }
    arm->tip = om_pose_apply(om_pose_inverse(loop->grid.task), from);
    const OmPose goal = {end, obs.arm[0].tip.q};
    const double found = om__tool_gap(&loop->act, 0, goal);
    printf("gaps by samples: %.2f mm, then %.2f mm, at the end %.2f mm; found %.2f mm\n", 1e3 * now,
           1e3 * least, 1e3 * last, 1e3 * found);
    assert_true(least < 0.007 && last > 0.012 && last < now);
    assert_near(found, least, 1e-3);
    assert_false(om__is_apart(&loop->act, 0, goal));
    om_loop_destroy(loop);
    om_observation_done(&obs);
    rig_destroy(&g);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_gap),
        cmocka_unit_test(test_the_whole_way_counts),
        cmocka_unit_test(test_the_other_tool_is_in_the_way),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
