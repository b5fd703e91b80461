// test_rl_retract_vary.c: episodes with bodies drawn around the def.
#include "retract_rig.h"

// Bodies keep to their ranges, episodes draw all of them, and an episode is that of its body's own task.
static void test_variants(void** state) {
    (void)state;
    const int nbody = test_count(2, 3);
    const OmRlSetting set[] = {{"variants", nbody == 2 ? "2" : "3"},
                               {"vary_thickness", "0.1"},
                               {"vary_softness", "0.4"},
                               {"vary_kidney_mm", "2"}};
    OmRlRetractDef def = om_rl_retract_default_def();
    def.vary_thickness = 0.1, def.vary_softness = 0.4, def.vary_kidney = 0.002,
    def.nvariant = nbody;
    double lo = 1, hi = 0, soft = 1, far = 0, mean = 0;
    for (int k = 0; k < 200; ++k) {
        OmRlRetractDef d = om__rl_draw_body(&def, k);
        lo = fmin(lo, d.thickness), hi = fmax(hi, d.thickness);
        soft = fmin(soft, d.cluster_stiffness);
        far = fmax(far, om_norm(d.kidney_shift));
        mean += om_norm(d.kidney_shift) / 200;
        assert_near(d.young / 20000, d.cluster_stiffness, 1e-12);
    }
    assert_true(lo >= 0.0027 && lo < 0.00275 && hi <= 0.0033 && hi > 0.00325);
    assert_true(soft >= 0.6 && soft < 0.62 && far <= 0.002 + 1e-15 && far > 0.0019);
    assert_near(mean, 0.002 * 2 / 3, 0.0001);  // uniform over a disc; 3 sigma of the mean

    OmRlTask *task = make(set, 4), *own[3];
    void *a, *b[3], *c;
    for (int k = 0; k < nbody; ++k) {
        OmRlRetractDef d = om__rl_draw_body(&def, k);
        assert_ok(om_rl_retract_create(&d, &own[k]));
        assert_ok(own[k]->ops->state_create(own[k], &b[k]));
    }
    assert_ok(task->ops->state_create(task, &a));
    assert_ok(task->ops->state_create(task, &c));
    int drawn[3] = {0}, ncompared[3] = {0};
    size_t size = task->ops->state_size(task);
    void *block = om_alloc(size, 1), *again = om_alloc(size, 1);
    assert_true(block && again);
    for (uint64_t episode = 0; episode < 90; ++episode) {
        float x[12], y[12], z[12];
        double reward[2];
        bool is_end;
        int body = -1;
        assert_ok(task->ops->reset(task, a, om_rng_init(8, episode), 31));
        task->ops->observe(task, a, x);
        for (int k = 0; k < nbody; ++k) {  // heights of the starts differ: the fat rests elsewhere
            assert_ok(own[k]->ops->reset(own[k], b[k], om_rng_init(8, episode), 31));
            own[k]->ops->observe(own[k], b[k], y);
            if (memcmp(x, y, sizeof x) == 0) body = k;
        }
        assert_in_range(body, 0, nbody - 1);
        ++drawn[body];
        if (++ncompared[body] > test_count(1, 2)) continue;  // episodes of this body
        OmRng rng = om_rng_init(9, episode), same = rng;
        for (int n = 0; n < 60; ++n) {
            int act[4], other[4];
            task->ops->expert(task, a, &rng, act);
            own[body]->ops->expert(own[body], b[body], &same, other);
            assert_memory_equal(act, other, 3 * sizeof *act);
            if (n == 40) task->ops->save(task, a, block);
            assert_ok(task->ops->step(task, a, act, &reward[0], &is_end));
            assert_ok(own[body]->ops->step(own[body], b[body], act, &reward[1], &is_end));
            assert_near(reward[0], reward[1], 0);
            if (n == 40) {  // another state continues from the block
                task->ops->observe(task, a, x);
                task->ops->restore(task, c, block);
                task->ops->save(task, c, again);
                assert_memory_equal(again, block, size);
                assert_ok(task->ops->step(task, c, act, &reward[1], &is_end));
                task->ops->observe(task, c, z);
                assert_memory_equal(x, z, sizeof x);
            }
        }
        double info[2][OM_RL_MAX_INFO];
        assert_ok(task->ops->info(task, a, info[0]));
        assert_ok(own[body]->ops->info(own[body], b[body], info[1]));
        for (int k = 0; k < task->ninfo; ++k)  // clusters have no forces: NaN
            if (!isnan(info[0][k]) || !isnan(info[1][k])) assert_near(info[0][k], info[1][k], 0);
    }
    print_message("episodes of the bodies: %d %d %d\n", drawn[0], drawn[1], drawn[2]);
    // 30 of three bodies, 45 of two, deviation 4.5
    for (int k = 0; k < nbody; ++k) assert_in_range(drawn[k], 90 / nbody - 15, 90 / nbody + 15);
    om_free(block);
    om_free(again);
    task->ops->state_destroy(task, a);
    task->ops->state_destroy(task, c);
    for (int k = 0; k < nbody; ++k) {
        own[k]->ops->state_destroy(own[k], b[k]);
        om_rl_task_destroy(own[k]);
    }
    // the survey needs one body
    OmRlSurvey survey;
    assert_int_equal(om_rl_retract_survey(task, 1, &survey), OM_INVALID);
    om_rl_task_destroy(task);
    const OmRlSetting none[] = {{"variants", "0"}};
    assert_int_equal(om_rl_task_create("retract", none, 1, &task), OM_INVALID);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_variants)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
