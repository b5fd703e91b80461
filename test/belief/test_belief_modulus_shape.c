// test_belief_modulus_shape.c: the twin's Young's modulus from the shape of lifted tissue.
#include <math.h>
#include <string.h>

#include "loop_rig.h"
#include "test_alloc.h"

#include "loop/loop_state.h"
#include "omentum/belief_monitor.h"

typedef struct Truth {
    double young;     // of the truth, over the twin's
    double friction;  // of the truth; the twin has 0.1
    bool is_wrong;    // the twin does not know of the attachment
    bool learns;
    double limit;   // m, of state 1; 0: 2 mm
    int naction;    // at most; 0: 8
    double height;  // m, of pulls; 0: 50 mm
} Truth;

// World and twin have the same mesh: what Truth says is their only difference.
static void rig_create_same(Rig* g, const Truth* t) {
    static OmScene truth;
    OmScene scene = object_scene();
    scene.tissue.cells = om_vec3(10, 10, 1);
    scene.tissue.friction = 0.1;
    scene.tissue.young = 2000;
    scene.attach.lo.x = t->is_wrong ? -0.021 : 0.02;
    scene.task.speed = 0.02;
    scene.task.max_actions = t->naction > 0 ? t->naction : 8;
    scene.world.has_depth_noise = false;
    scene.rgbd.width = 160, scene.rgbd.height = 120;
    if (!test_is_slow()) scene.rgbd.width = 96, scene.rgbd.height = 72;
    if (t->height > 0) scene.task.max_height = t->height;
    scene.monitor.rate = 10;
    scene.monitor.region = OM_MONITOR_MOVED;
    if (t->limit > 0) {
        scene.monitor.limit[0] = t->limit;
        scene.monitor.hysteresis = 0.2 * t->limit;
    }
    scene.update.learns_modulus_by_shape = true;
    truth = scene;
    truth.tissue.friction = t->friction;
    if (t->is_wrong) scene.believed.kind = OM_BELIEF_NONE;
    rig_create_apart(g, scene, &truth, OM_SITE_TWIN, t->young, 1);
}

static OmRetractResult run(const Truth* t) {
    Rig g;
    rig_create_same(&g, t);
    OmModulus* modulus = NULL;
    OmMonitor* monitor;
    const OmMonitorDef wdef = om_monitor_default_def(&g.scene, g.world, &g.twin_site);
    assert_ok(om_monitor_create(&wdef, &monitor));
    const OmModulusDef mdef = om_modulus_default_def(&g.scene, &g.twin_site);
    assert_true(mdef.by_shape && !mdef.by_force);
    if (t->learns) assert_ok(om_modulus_create(&mdef, &modulus));
    OmLoopDef def = om_loop_default_def(&g.scene.task, g.world, g.twin, g.planner);
    def.truth = om_world_truth(g.world);
    def.monitor = monitor;
    def.modulus = modulus;
    OmLoop* loop;
    OmRetractResult r;
    assert_ok(om_loop_create(&def, &loop));
    tick_to_end(loop);
    assert_ok(om_loop_take_result(loop, &r));
    om_loop_destroy(loop);
    om_modulus_destroy(modulus);
    om_monitor_destroy(monitor);
    rig_destroy(&g);
    printf("truth %.2f, friction %.1f, %s: %d learnt, factor %.3f; mu %.2f mm, "
           "warnings %d %d %d; %s\n",
           t->young, t->friction, t->is_wrong ? "wrong attachments" : "right attachments",
           r.belief.nmodulus, r.belief.young_factor, 1e3 * r.belief.mu_max, r.belief.nwarning[0],
           r.belief.nwarning[1], r.belief.nwarning[2], r.reason);
    return r;
}

// The truth differs from the twin by its modulus alone: it is found without any force. A parabola through three
// moduli stands for the distance: a quarter of the modulus is its error here.
static void test_the_modulus_is_found(void** state) {
    (void)state;
    static const double young[] = {0.4, 3};
    for (int k = test_is_slow() ? 0 : 1; k < 2; ++k) {
        OmRetractResult r = run(&(Truth){.young = young[k], .friction = 0.1, .learns = true});
        assert_true(r.belief.nmodulus >= 1);
        assert_near(r.belief.young_factor, young[k], 0.25 * young[k]);
        om_retract_result_done(&r);
    }
}

// A modulus that is right is left alone, and so is one that is nearly right.
static void test_nothing_is_learnt_without_need(void** state) {
    (void)state;
    static const double young[] = {1, 1.13};
    for (int k = test_is_slow() ? 0 : 1; k < 2; ++k) {
        OmRetractResult r = run(&(Truth){.young = young[k], .friction = 0.1, .learns = true});
        assert_int_equal(r.belief.nmodulus, 0);
        om_retract_result_done(&r);
    }
}

// Once learnt, the modulus keeps mu below a limit that it exceeds otherwise.
static void test_the_twin_agrees_better(void** state) {
    (void)state;
    for (int learns = 0; learns < 2; ++learns) {
        OmRetractResult r = run(
            &(Truth){.young = 2, .friction = 0.1, .learns = learns, .limit = 1.5e-3, .naction = 4});
        assert_int_equal(r.belief.nwarning[0], learns ? 0 : 1);
        om_retract_result_done(&r);
    }
}

// An attachment that the twin does not know of raises the warning as without a modulus that is learnt.
static void test_an_attachment_still_warns(void** state) {
    (void)state;
    for (int learns = 0; learns < 2; ++learns) {
        OmRetractResult r = run(&(Truth){.young = 1,
                                         .friction = 0.1,
                                         .is_wrong = true,
                                         .learns = learns,
                                         .limit = 2e-4,
                                         .naction = 4});
        assert_int_equal(r.belief.nwarning[0], 1);
        om_retract_result_done(&r);
    }
}

static OmStatus make_modulus(void* ctx) {
    const Rig* g = ctx;
    OmModulus* modulus;
    const OmModulusDef def = om_modulus_default_def(&g->scene, &g->twin_site);
    OM_TRY(om_modulus_create(&def, &modulus));
    om_modulus_destroy(modulus);
    return OM_OK;
}

static void test_no_memory(void** state) {
    (void)state;
    Rig g;
    rig_create_same(&g, &(Truth){.young = 1, .friction = 0.1});
    printf("%d allocations failed\n", test_failing_allocations(make_modulus, &g, test_stride(3)));
    rig_destroy(&g);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_the_modulus_is_found),
                                       cmocka_unit_test(test_nothing_is_learnt_without_need),
                                       cmocka_slow_test(test_the_twin_agrees_better),
                                       cmocka_slow_test(test_an_attachment_still_warns),
                                       cmocka_unit_test(test_no_memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
