// test_loop_slip.c: tissue slips out of the jaws: the closed jaw shows it, the twin releases it, the point counts as
// tried; and a twin that lies beside the truth.
#include "loop/loop_state.h"
#include "loop_rig.h"

typedef struct Seen {  // what a listener notes
    int nslip, nafter;
    int block[OM_PLAN_MAX_BLOCK];  // that slipped
    bool is_wrong;                 // a later plan grasps one of them, or the twin still holds it
    const Rig* rig;
} Seen;

static OmStatus on_action_end(void* ctx, const OmLoop* loop, const OmRetractAction* action) {
    (void)loop;
    Seen* s = ctx;
    if (action->outcome != OM_ACTION_SLIPPED) return OM_OK;
    s->block[s->nslip++] = action->block;
    s->is_wrong |= om_body_is_holding(s->rig->twin, action->arm);
    return OM_OK;
}

static OmStatus on_plan(void* ctx, const OmLoop* loop, const OmSituation* situation,
                        const OmPlan* plan) {
    (void)loop;
    Seen* s = ctx;
    for (int i = 0; i < s->nslip; ++i) {
        s->is_wrong |= plan->grasp_block == s->block[i] || situation->arm[0].in_hand >= 0;
        s->is_wrong |= !(situation->tried[s->block[i]] & OM_TRIED_GRASP);
    }
    s->nafter += s->nslip > 0;
    return OM_OK;
}

// One arm, and a weak grip: no block can be lifted far. Every point is grasped once.
static void test_a_weak_grip_slips(void** state) {
    (void)state;
    OmRetractResult result[2];
    OmScene scene = object_scene();
    scene.world.narm = 1;
    scene.world.grip_force = 1;
    scene.world.grip_friction = 0.12;
    scene.task.visibility = 1.0;
    scene.task.max_actions = 60;
    for (int run = 0; run < 2; ++run) {
        Rig g;
        rig_create(&g, scene);
        Seen seen = {.rig = &g};
        OmLoopListener listener = {
            .ctx = &seen, .on_action_end = on_action_end, .on_plan = on_plan};
        OmLoop* loop = make_loop(&g, &listener);
        tick_to_end(loop);
        const OmRetractResult* r = om_loop_result(loop);
        assert_true(r->effort.nslip >= 2 && seen.nslip >= 2 && seen.nafter >= 2 && !seen.is_wrong);
        assert_int_equal(r->effort.nslip, seen.nslip);
        assert_false(r->is_exposed);
        for (int i = 0; i < r->naction; ++i) {
            const OmRetractAction* a = &r->action[i];
            if (a->outcome != OM_ACTION_SLIPPED) continue;
            // The truth bore no more than the grip and one step beyond it: pull is the force less the weight carried.
            assert_true(a->force_world_max < 0.12 + 0.1);
            assert_true(i + 1 == r->naction || r->action[i + 1].is_replanned);
        }
        assert_int_equal(r->truth.ntorn, 0);
        assert_ok(om_loop_take_result(loop, &result[run]));
        om_loop_destroy(loop);
        rig_destroy(&g);
    }
    expect_same(&result[0], &result[1]);
    om_retract_result_done(&result[0]);
    om_retract_result_done(&result[1]);
}

// A firm grip is the same run as no slipping at all.
static void test_a_firm_grip_changes_nothing(void** state) {
    (void)state;
    OmRetractResult result[2];
    for (int run = 0; run < 2; ++run) {
        OmScene scene = object_scene();
        if (run) scene.world.grip_friction = 100, scene.world.tear_strength = 1e9;
        Rig g;
        rig_create(&g, scene);
        OmLoop* loop = make_loop(&g, NULL);
        tick_to_end(loop);
        assert_ok(om_loop_take_result(loop, &result[run]));
        om_loop_destroy(loop);
        rig_destroy(&g);
    }
    assert_true(result[0].is_exposed && result[1].effort.nslip == 0);
    expect_same(&result[0], &result[1]);
    om_retract_result_done(&result[0]);
    om_retract_result_done(&result[1]);
}

// The other arm's tissue slips while this arm moves, or while all arms keep still to look: injected into a stage.
static void test_reactions(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    const Stage stage[] = {STAGE_NEXT_ACTION, STAGE_CONSENT, STAGE_LOOK, STAGE_VERIFY, STAGE_HOLD};
    for (int k = 0; k < 5; ++k) {
        rig_start(&g);
        OmLoop* loop = make_loop(&g, NULL);
        while (loop->act.arm[0].in_hand < 0 && loop->act.arm[1].in_hand < 0)
            assert_ok(om_loop_tick(loop));
        const int arm = loop->act.arm[0].in_hand >= 0 ? 0 : 1, block = loop->act.arm[arm].in_hand;
        OmObservation obs = {0};
        assert_ok(om_world_observe(g.world, 0, &obs));
        assert_true(om_arm_is_holding(&obs.arm[arm]) && !om_arm_is_empty(&obs.arm[arm]));
        assert_ok(om__slip_watch(loop, &obs));
        assert_true(loop->act.arm[arm].in_hand == block && !loop->has_slipped);
        obs.arm[arm].jaw = 0;
        assert_ok(om__slip_watch(loop, &obs));
        assert_true(loop->act.arm[arm].in_hand == -1 && loop->act.arm[arm].at == -1 &&
                    loop->has_slipped);
        assert_true(!om_body_is_holding(g.twin, arm) && loop->belief.tried[block] & OM_TRIED_GRASP);
        loop->stage = stage[k];
        loop->held_stage = STAGE_NEXT_ACTION;
        loop->act.action.outcome = OM_ACTION_EXPOSED;
        assert_ok(om__slip_react(loop));
        assert_int_equal(loop->stage, k < 3 ? STAGE_PLAN : stage[k]);
        if (k == 3) assert_int_equal(loop->act.action.outcome, OM_ACTION_SLIPPED);
        if (k == 4) assert_int_equal(loop->held_stage, STAGE_PLAN);
        assert_int_equal(loop->result.effort.nslip, 1);
        om_loop_destroy(loop);
    }
    rig_destroy(&g);
}

// A twin that is registered 2 mm and 2 degrees beside the truth, and a ROI believed 3 mm beside its place: the arms
// expose the true one, and the picture and the truth agree on it.
static void test_a_wrong_place_is_exposed(void** state) {
    (void)state;
    OmScene scene = object_scene();
    scene.endoscope.width = 320, scene.endoscope.height = 240;
    scene.believed_roi.shift = om_vec3(0.002, -0.002, 0);
    scene.registration.shift = om_vec3(0.0015, 0.001, 0.0005);
    scene.registration.turn = om_vec3(0.01, -0.01, 0.03);
    Rig g;
    rig_create(&g, scene);
    OmLoop* loop = make_loop(&g, NULL);
    tick_to_end(loop);
    const OmRetractResult* r = om_loop_result(loop);
    if (!r->is_exposed) fail_msg("%s", r->reason);
    printf("misplaced twin: %.3f in the picture, %.3f in the truth\n", r->visibility_end,
           r->truth.visibility);
    assert_true(r->truth.visibility >= 0.8);
    assert_near(r->visibility_end, r->truth.visibility, 0.05);
    om_loop_destroy(loop);
    rig_destroy(&g);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_a_weak_grip_slips),
                                       cmocka_unit_test(test_a_firm_grip_changes_nothing),
                                       cmocka_unit_test(test_reactions),
                                       cmocka_unit_test(test_a_wrong_place_is_exposed)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
