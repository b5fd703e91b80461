// test_belief_modulus.c: the twin's Young's modulus, learnt from measured pulls.
#include <math.h>
#include <string.h>

#include "loop_rig.h"
#include "test_alloc.h"

typedef struct Truth {
    double young;   // of the truth, over the twin's
    double noise;   // N, of the sensors; below 0: none
    bool is_wrong;  // the twin does not know of the attachment
    bool learns;
    int naction;  // at most; 0: 12
} Truth;

// World and twin have the same mesh: the modulus is their only difference, and the attachments where they are wrong.
static void rig_create_same(Rig* g, const Truth* t) {
    static OmScene truth;
    OmScene scene = object_scene();
    scene.attach.lo.x = -0.021;
    scene.task.speed = 0.02;
    scene.task.max_actions = t->naction > 0 ? t->naction : 12;
    scene.world.force_noise = t->noise;
    truth = scene;
    if (t->is_wrong) scene.believed.kind = OM_BELIEF_NONE;
    rig_create_apart(g, scene, &truth, OM_SITE_TWIN, t->young, 1);
}

static OmRetractResult run(const Truth* t) {
    Rig g;
    rig_create_same(&g, t);
    OmModulus* modulus = NULL;
    const OmModulusDef mdef = om_modulus_default_def(&g.scene, &g.twin_site);
    OmLoopDef def = om_loop_default_def(&g.scene.task, g.world, g.twin, g.planner);
    if (t->learns) assert_ok(om_modulus_create(&mdef, &modulus));
    def.truth = om_world_truth(g.world);
    def.modulus = modulus;
    OmLoop* loop;
    OmRetractResult r;
    assert_ok(om_loop_create(&def, &loop));
    tick_to_end(loop);
    assert_ok(om_loop_take_result(loop, &r));
    om_loop_destroy(loop);
    om_modulus_destroy(modulus);
    rig_destroy(&g);
    printf("truth %.2f, %s: %d learnt, factor %.3f; force factor %.2f; %s\n", t->young,
           t->is_wrong ? "wrong attachments" : "right attachments", r.belief.nmodulus,
           r.belief.young_factor, r.belief.force_factor, r.reason);
    return r;
}

// The truth differs from the twin by its modulus alone: it is found, from pulls that are not proportional to it.
static void test_the_modulus_is_found(void** state) {
    (void)state;
    static const double young[] = {0.4, 0.6, 1.5, 2.5};
    for (int k = 0; k < 4; ++k) {
        OmRetractResult r = run(&(Truth){.young = young[k], .noise = 0.02, .learns = true});
        assert_true(r.belief.nmodulus >= 1);
        assert_near(r.belief.young_factor, young[k], 0.1 * young[k]);
        assert_true(fabs(r.belief.force_factor - 1) < 0.25);  // little is left to correct
        om_retract_result_done(&r);
    }
}

// A modulus that is right is left alone, and so is one whose effect is small.
static void test_nothing_is_learnt_without_need(void** state) {
    (void)state;
    static const double young[] = {1, 0.95};
    for (int k = 0; k < 2; ++k) {
        OmRetractResult r = run(&(Truth){.young = young[k], .noise = 0.05, .learns = true});
        assert_int_equal(r.belief.nmodulus, 0);
        assert_near(r.belief.young_factor, 1, 0);
        om_retract_result_done(&r);
    }
}

// One pull is not enough: a second stretch of motion must agree.
static void test_one_stretch_is_not_enough(void** state) {
    (void)state;
    OmRetractResult one = run(&(Truth){.young = 2.5, .noise = 0.02, .learns = true, .naction = 3});
    OmRetractResult two = run(&(Truth){.young = 2.5, .noise = 0.02, .learns = true, .naction = 4});
    assert_int_equal(one.action[2].verb, OM_PLAN_PULL);
    assert_int_equal(one.belief.nmodulus, 0);
    assert_int_equal(two.belief.nmodulus, 1);
    om_retract_result_done(&one);
    om_retract_result_done(&two);
}

// What an attachment does that the twin does not know of is not explained by a modulus, whatever the true one is.
static void test_an_attachment_is_no_modulus(void** state) {
    (void)state;
    static const double young[] = {0.4, 0.6, 1, 1.5, 2.5};
    for (int k = 0; k < 5; k += test_is_slow() ? 1 : 4) {
        OmRetractResult r =
            run(&(Truth){.young = young[k], .noise = 0.02, .is_wrong = true, .learns = true});
        assert_int_equal(r.belief.nmodulus, 0);
        om_retract_result_done(&r);
    }
}

// Arms that do not measure force learn nothing: the run is the one without.
static void test_without_sensors(void** state) {
    (void)state;
    OmRetractResult with = run(&(Truth){.young = 2.5, .noise = -1, .learns = true});
    OmRetractResult without = run(&(Truth){.young = 2.5, .noise = -1});
    assert_int_equal(with.belief.nmodulus, 0);
    expect_same(&with, &without);
    om_retract_result_done(&with);
    om_retract_result_done(&without);
}

// A body that is given a modulus moves as one that was made with it.
static void test_a_body_takes_a_modulus(void** state) {
    (void)state;
    const OmScene scene = object_scene();
    OmSite site, other;
    OmBody *changed, *made;
    OmBodyReport report;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &other));
    other.young *= 0.3;
    assert_ok(om_body_create(&scene, &site, 1, &changed));
    assert_ok(om_body_create(&scene, &other, 1, &made));
    for (int i = 0; i < 10; ++i) assert_true(om_body_step(changed, 0.02, &report) >= 0);
    void* now = malloc(om_body_state_size(changed));
    om_body_save(changed, now);
    om_body_restore(made, now);
    assert_status(om_body_set_young(changed, &scene, 0), OM_INVALID);
    assert_status(om_body_set_young(changed, &scene, NAN), OM_INVALID);
    assert_ok(om_body_set_young(changed, &scene, 0.3));
    assert_true(om_body_hash(changed) == om_body_hash(made));
    assert_true(om_body_site(changed) == &site);
    for (int i = 0; i < 10; ++i) {
        assert_true(om_body_step(changed, 0.02, &report) >= 0);
        assert_true(om_body_step(made, 0.02, &report) >= 0);
    }
    assert_true(om_body_hash(changed) == om_body_hash(made));
    // and not as one that kept its modulus
    assert_ok(om_body_set_young(changed, &scene, 1));
    om_body_restore(changed, now);
    for (int i = 0; i < 10; ++i) assert_true(om_body_step(changed, 0.02, &report) >= 0);
    assert_true(om_body_hash(changed) != om_body_hash(made));
    free(now);
    om_body_destroy(changed);
    om_body_destroy(made);
    om_site_done(&site);
    om_site_done(&other);
}

typedef struct Parts {
    OmScene scene;
    OmSite site;
    OmBody* body;
} Parts;

static OmStatus create_and_set(void* ctx) {
    Parts* p = ctx;
    const uint64_t before = om_body_hash(p->body);
    const OmModulusDef def = om_modulus_default_def(&p->scene, &p->site);
    OmModulus* modulus;
    OmStatus status = om_modulus_create(&def, &modulus);
    if (status < 0) assert_null(modulus);
    om_modulus_destroy(modulus);
    if (status >= 0) status = om_body_set_young(p->body, &p->scene, 0.5);
    assert_true(om_body_hash(p->body) == before);
    return status;
}

static void test_no_memory(void** state) {
    (void)state;
    Parts p = {.scene = object_scene()};
    p.scene.tissue.cells = om_vec3(3, 3, 1);
    assert_ok(om_site_build(&p.scene, OM_SITE_TWIN, NULL, &p.site));
    assert_ok(om_body_create(&p.scene, &p.site, 1, &p.body));
    const int nfail = test_failing_allocations(create_and_set, &p, test_stride(2));
    printf("%d allocations failed\n", nfail);
    assert_true(nfail > 10);
    om_body_destroy(p.body);
    om_site_done(&p.site);
}

// A definition that was not made by default_def, and an engine without a modulus.
static void test_refusals(void** state) {
    (void)state;
    OmScene scene = object_scene();
    OmSite site;
    OmModulus* modulus;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    assert_status(om_modulus_create(&(OmModulusDef){.scene = &scene, .site = &site}, &modulus),
                  OM_INVALID);
    OmModulusDef def = om_modulus_default_def(&scene, NULL);
    assert_status(om_modulus_create(&def, &modulus), OM_INVALID);
    snprintf(scene.tissue.engine, sizeof scene.tissue.engine, "pbd");
    def = om_modulus_default_def(&scene, &site);
    assert_status(om_modulus_create(&def, &modulus), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "\"pbd\""));
    om_site_done(&site);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_an_attachment_is_no_modulus),
        cmocka_unit_test(test_nothing_is_learnt_without_need),
        cmocka_unit_test(test_the_modulus_is_found),
        cmocka_unit_test(test_one_stretch_is_not_enough),
        cmocka_unit_test(test_without_sensors),
        cmocka_unit_test(test_a_body_takes_a_modulus),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
