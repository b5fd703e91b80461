// Looking ahead: points tried in snapshots of the twin, which is restored.
#include "linear_sheet.h"
#include "loop/loop_state.h"
#include "loop_rig.h"
#include "omentum/retract.h"
#include "omentum/trial_ahead.h"
#include "omentum/trial_preplan.h"
#include "test_alloc.h"

static Rig rig;

static OmAhead* make_ahead_with(int npoint, int max_step, bool is_repeated) {
    OmAheadDef def = om_ahead_default_def(&rig.scene, &rig.twin_site);
    OmAhead* ahead;
    def.is_repeated = is_repeated;
    def.npoint = npoint;
    def.max_step = max_step;
    assert_ok(om_ahead_create(&def, rig.twin, &ahead));
    return ahead;
}

static OmAhead* make_ahead(int npoint, int max_step) {
    return make_ahead_with(npoint, max_step, false);
}

static OmLoop* start_loop(OmAhead* ahead) {
    rig_start(&rig);
    OmLoopDef def = om_loop_default_def(&rig.scene.task, rig.world, rig.twin, rig.planner);
    def.truth = om_world_truth(rig.world);
    def.ahead = ahead;
    OmLoop* loop;
    assert_ok(om_loop_create(&def, &loop));
    return loop;
}

// Look ahead between two ticks, and compare the whole state of the twin.
static void look_ahead(OmLoop* loop) {
    const size_t size = om_body_state_size(rig.twin);
    void *before = malloc(size), *after = malloc(size);
    om__sense_fluents(&loop->belief, &loop->belief.situation);
    om_body_save(rig.twin, before);
    assert_ok(om__ahead_run(loop->ahead, &loop->belief, loop->planner, &loop->ahead_count));
    loop->result.twin.nahead = loop->ahead_count.npoint;
    loop->result.twin.nahead_step = loop->ahead_count.nstep;
    om_body_save(rig.twin, after);
    assert_memory_equal(before, after, size);
    free(before);
    free(after);
}

// From rest, what looking ahead shows is what the plan before shows, of the points that the program names.
static void facts_are_those_of_the_plan_before(void** state) {
    (void)state;
    static OmPreplan preplan;
    static OmPlan plan;
    OmPreplanDef def = om_preplan_default_def(&rig.scene);
    def.nworker = 1;
    assert_ok(om_preplan_run(&def, NULL, &preplan));
    OmAhead* ahead = make_ahead(3, 100000);
    OmLoop* loop = start_loop(NULL);
    assert_ok(om_loop_tick(loop));  // the arms are observed
    rig_start(&rig);
    loop->ahead = ahead;
    look_ahead(loop);
    int ntried = 0;
    for (int b = 0; b < 25; ++b) {
        const OmExposure* e = &loop->belief.exposure[b];
        if (!e->is_known) continue;
        const OmPreplanPoint* p = &preplan.point[b];
        assert_true(p->is_tried);
        assert_int_equal(e->exposes, p->exposes);
        assert_int_equal(e->npull, p->npull);
        assert_int_equal(e->fold, p->fold);
        ++ntried;
    }
    assert_true(ntried >= 1 && ntried <= 3);
    assert_int_equal(loop->result.twin.nahead, ntried);
    // the point that the program takes now is known, and exposes the ROI unless three were tried
    assert_ok(om_planner_solve(rig.planner, &loop->belief.situation, &plan));
    assert_true(loop->belief.exposure[plan.grasp_block].exposes || ntried == 3);
    om_loop_destroy(loop);
    om_ahead_destroy(ahead);
}

// In the middle of an operation, with tissue in hand at the end of its possibilities.
static void tissue_in_hand_stays_in_hand(void** state) {
    (void)state;
    OmAhead* ahead = make_ahead(2, 100000);
    OmLoop* loop = start_loop(NULL);
    while (loop->act.arm[0].in_hand < 0 || loop->act.arm[0].lift < 0.015)
        assert_ok(om_loop_tick(loop));
    const int held = loop->act.arm[0].in_hand;
    loop->ahead = ahead;
    look_ahead(loop);  // the plan continues with the tissue in hand
    assert_int_equal(loop->result.twin.nahead, 0);
    loop->belief.tried[held] = OM_TRIED_GRASP | OM_TRIED_MOVE_ROI | OM_TRIED_MOVE_AWAY;
    loop->act.arm[0].is_max_force = true;
    const int nbad = om_body_nbad(rig.twin);
    look_ahead(loop);
    assert_in_range(loop->result.twin.nahead, 1, 2);
    assert_true(om_body_is_holding(rig.twin, 0));
    assert_int_equal(loop->ahead_count.nbad, om_body_nbad(rig.twin) - nbad);
    assert_false(loop->belief.exposure[held].is_known);
    om_loop_destroy(loop);
    om_ahead_destroy(ahead);
}

static void the_budget_counts_steps(void** state) {
    (void)state;
    OmAhead* ahead = make_ahead(3, 10);
    OmLoop* loop = start_loop(NULL);
    assert_ok(om_loop_tick(loop));
    loop->ahead = ahead;
    look_ahead(loop);
    assert_int_equal(loop->result.twin.nahead, 0);
    assert_int_equal(loop->result.twin.nahead_step, 10);
    for (int b = 0; b < 25; ++b) assert_false(loop->belief.exposure[b].is_known);
    om_loop_destroy(loop);
    om_ahead_destroy(ahead);
}

static void a_run_repeats(void** state) {
    (void)state;
    OmRetractResult result[2];
    OmAhead* ahead = make_ahead(3, 3000);
    for (int k = 0; k < 2; ++k) {
        OmLoop* loop = start_loop(ahead);
        tick_to_end(loop);
        assert_ok(om_loop_take_result(loop, &result[k]));
        om_loop_destroy(loop);
    }
    expect_same(&result[0], &result[1]);
    assert_true(result[0].twin.nahead > 0 && result[0].is_exposed);
    assert_int_equal(result[0].twin.nahead, result[1].twin.nahead);
    assert_int_equal(result[0].twin.nahead_step, result[1].twin.nahead_step);
    om_retract_result_done(&result[0]);
    om_retract_result_done(&result[1]);
    om_ahead_destroy(ahead);
}

// Soft tissue: (1,3) exposes the ROI in the twin, but not at half the modulus; (2,2) does at both. `only`: nothing but
// (1,3) may be grasped.
static OmExposure look_at(bool is_repeated, bool is_only, OmPlan* plan, bool* is_kept, int* n) {
    OmAhead* ahead = make_ahead_with(3, 100000, is_repeated);
    OmLoop* loop = start_loop(NULL);
    assert_ok(om_loop_tick(loop));
    rig_start(&rig);
    loop->ahead = ahead;
    for (int k = 0; k < 25; ++k) loop->belief.is_forbidden[k] = k != 10 && (k != 6 || is_only);
    look_ahead(loop);
    assert_ok(om_planner_solve(rig.planner, &loop->belief.situation, plan));
    const OmExposure e = loop->belief.situation.exposure[10];
    *is_kept = loop->belief.exposure[10].is_known;
    *n = loop->result.twin.nahead;
    om_loop_destroy(loop);
    om_ahead_destroy(ahead);
    return e;
}

static void a_point_that_needs_stiffness_is_left(void** state) {
    (void)state;
    const Rig kept = rig;
    OmScene scene = easy_scene();
    OmPlan plan;
    bool is_kept;
    int n;
    scene.tissue.young = 750;
    rig_create(&rig, scene);
    OmExposure e = look_at(false, false, &plan, &is_kept, &n);
    assert_true(e.is_known && e.exposes && is_kept && n == 1 && plan.grasp_block == 10);
    e = look_at(true, false, &plan, &is_kept, &n);
    assert_true(e.is_known && !e.exposes && !is_kept && n == 2 && plan.grasp_block == 6);
    e = look_at(true, true, &plan, &is_kept, &n);  // nothing is better
    assert_true(e.is_known && e.exposes && is_kept && n == 1 && plan.grasp_block == 10);
    rig_destroy(&rig);
    rig = kept;
}

static OmStatus create_once(void* ctx) {
    OmAheadDef def = om_ahead_default_def(&rig.scene, &rig.twin_site);
    OmAhead** ahead = ctx;
    OM_TRY(om_ahead_create(&def, rig.twin, ahead));
    om_ahead_destroy(*ahead);
    return OM_OK;
}

static void every_allocation_may_fail(void** state) {
    (void)state;
    OmAhead* ahead;
    assert_true(test_failing_allocations(create_once, &ahead, 1) > 3);
}

static void a_wrong_definition_is_refused(void** state) {
    (void)state;
    OmAhead* ahead;
    OmAheadDef def = {0};
    assert_status(om_ahead_create(&def, rig.twin, &ahead), OM_INVALID);
    assert_null(ahead);
    def = om_ahead_default_def(&rig.scene, &rig.world_site);
    assert_status(om_ahead_create(&def, rig.twin, &ahead), OM_INVALID);
    def = om_ahead_default_def(&rig.scene, &rig.twin_site);
    def.npoint = 0;
    assert_status(om_ahead_create(&def, rig.twin, &ahead), OM_INVALID);
    om_ahead_destroy(NULL);
}

static int begin(void** state) {
    (void)state;
    rig_create(&rig, easy_scene());
    return 0;
}

static int end(void** state) {
    (void)state;
    rig_destroy(&rig);
    return 0;
}

// What the scene says of the network and of the number of points stays.
static void everything_is_switched_on(void** state) {
    (void)state;
    OmScene scene = linear_sheet();
    assert_false(scene.monitor.is_enabled || scene.update.is_enabled);
    om_retract_use_all(&scene);
    assert_true(scene.monitor.is_enabled && scene.update.is_enabled);
    assert_int_equal(scene.task.ahead, 3);
    assert_string_equal(scene.update.network, "installed");
    scene = linear_sheet();
    scene.task.ahead = 5;
    strcpy(scene.update.network, "mine");
    om_retract_use_all(&scene);
    assert_int_equal(scene.task.ahead, 5);
    assert_string_equal(scene.update.network, "mine");
}

int main(void) {
    const struct CMUnitTest tests[] = {

        cmocka_unit_test(facts_are_those_of_the_plan_before),
        cmocka_unit_test(tissue_in_hand_stays_in_hand),
        cmocka_unit_test(a_point_that_needs_stiffness_is_left),
        cmocka_unit_test(the_budget_counts_steps),
        cmocka_unit_test(a_run_repeats),
        cmocka_unit_test(every_allocation_may_fail),
        cmocka_unit_test(a_wrong_definition_is_refused),
        cmocka_unit_test(everything_is_switched_on),
    };
    return cmocka_run_group_tests(tests, begin, end);
}
