// test_rl_retract_settings.c: what the settings of the task "retract" do: errors, horizon, repeat, points, starts.
#include "omentum/rl_retract.h"
#include "rl/rl_retract_internal.h"
#include "test_common.h"

static OmRlTask* make(const OmRlSetting* setting, int n) {
    OmRlTask* task;
    assert_ok(om_rl_task_create("retract", setting, n, &task));
    return task;
}

static OmRlRetractState* make_state(const OmRlTask* task) {
    void* state;
    assert_ok(task->ops->state_create(task, &state));
    return state;
}

// The expert's steps until the end, at most n; how many of the last ones were at p_T with fat.
static int run_expert(const OmRlTask* task, OmRlRetractState* s, int n, bool* is_end) {
    const OmRlRetract* t = om__rl_retract(task);
    OmRng rng = om_rng_init(21, 0);
    int nthere = 0;
    *is_end = false;
    for (int k = 0; k < n && !*is_end; ++k) {
        int action[4] = {0, 0, 0, 1};
        double reward;
        if (nthere == 0) task->ops->expert(task, s, &rng, action);
        assert_ok(task->ops->step(task, s, action, &reward, is_end));
        bool is_there = s->now.is_holding && om_distance(s->now.tip, t->def.target) <= 0.002;
        nthere = is_there ? nthere + 1 : 0;
    }
    return nthere;
}

static void test_hold_and_starts(void** state) {
    (void)state;
    OmRlTask* task = make(NULL, 0);
    OmRlRetractState *a = make_state(task), *b = make_state(task);
    bool is_end;
    // an episode ends with the tenth step at p_T
    assert_ok(task->ops->reset(task, a, om_rng_init(3, 0), 45));
    assert_int_equal(run_expert(task, a, 2500, &is_end), 10);
    assert_true(is_end);
    // a start of the grid does not depend on the seed; drawn starts do, 9 to 15 mm above the fat
    const OmRlRetract* t = om__rl_retract(task);
    for (int k = 0; k < 49; k += 6) {
        assert_ok(task->ops->reset(task, a, om_rng_init(3, 0), k));
        assert_ok(task->ops->reset(task, b, om_rng_init(4, 0), k));
        assert_near(om_distance(a->now.tip, b->now.tip), 0, 0);
        double u = (k / 7 + 0.5) / 7, v = (k % 7 + 0.5) / 7;
        assert_near(a->now.tip.x, t->fat_hi.x - u * (t->fat_hi.x - t->fat_lo.x), 1e-12);
        assert_near(a->now.tip.y, t->fat_lo.y + v * (t->fat_hi.y - t->fat_lo.y), 1e-12);
    }
    double lo = 1, hi = 0;
    for (uint64_t k = 0; k < 200; ++k) {
        assert_ok(task->ops->reset(task, a, om_rng_init(5, k), -1));
        double gap = a->now.tip.z - om__rl_start_above(t, a->now.tip.x, a->now.tip.y, 0).z;
        lo = fmin(lo, gap), hi = fmax(hi, gap);
    }
    print_message("drawn starts: %.2f to %.2f mm above the fat\n", 1e3 * lo, 1e3 * hi);
    assert_true(lo >= 0.009 - 1e-9 && lo < 0.0095 && hi <= 0.015 + 1e-9 && hi > 0.0145);
    task->ops->state_destroy(task, a);
    task->ops->state_destroy(task, b);
    om_rl_task_destroy(task);
}

static void test_horizon_repeat_points(void** state) {
    (void)state;
    const OmRlSetting set[] = {{"fixed_horizon", "1"}, {"repeat", "3"}, {"points", "5"}};
    OmRlTask* task = make(set, 3);
    const OmRlRetract* t = om__rl_retract(task);
    OmRlRetractState* s = make_state(task);
    assert_int_equal(task->max_step, 834);
    assert_ok(task->ops->reset(task, s, om_rng_init(3, 0), 24));
    OmVec3 before = s->now.tip;
    double reward;
    bool is_end;
    assert_ok(task->ops->step(task, s, (int[3]){1, 0, 2}, &reward, &is_end));
    assert_near(s->now.tip.x - before.x, -0.0015, 1e-12);
    assert_near(s->now.tip.z - before.z, 0.0015, 1e-12);
    float obs[27];
    task->ops->observe(task, s, obs);
    for (int k = 0; k < 5; ++k) {
        OmVec3 p = om_load3(om_tissue_x(s->tissue), t->point_vert[k]);
        assert_near(obs[12 + 3 * k], 2 * (p.x + 0.085) / 0.110 - 1, 1e-6);
        assert_near(obs[13 + 3 * k], 2 * (p.y + 0.055) / 0.110 - 1, 1e-6);
        assert_near(obs[14 + 3 * k], 2 * (p.z - 0.002) / 0.108 - 1, 1e-6);
    }
    assert_near(obs[2], 2 * (s->now.tip.z - 0.002) / 0.108 - 1, 1e-6);
    assert_ok(task->ops->reset(task, s, om_rng_init(3, 0), 45));
    assert_true(run_expert(task, s, 200, &is_end) > 20);
    assert_false(is_end);
    task->ops->state_destroy(task, s);
    om_rl_task_destroy(task);
}

// Fat slips out of the jaws beyond a force. Weight lifted off the kidney exceeds it: never held after a step beyond it.
static void test_slip(void** state) {
    (void)state;
    const OmRlSetting set[] = {{"tissue", "elements"}, {"slip_n", "0.08"}};
    double most[2] = {0, 0};
    for (int k = 0; k < 2; ++k) {
        OmRlTask* task = make(set, 2 - k);
        const OmRlRetract* t = om__rl_retract(task);
        OmRlRetractState* s = make_state(task);
        OmRng rng = om_rng_init(7, 1);
        int nloss = 0;
        assert_ok(task->ops->reset(task, s, om_rng_init(3, 0), 45));
        for (int i = 0; i < 100; ++i) {
            int action[3] = {0, 0, 2};
            double reward, info[OM_RL_MAX_INFO];
            bool is_end;
            const bool was_holding = s->now.is_holding;
            OmTissueForces f;
            if (!was_holding && s->now.nslip == 0) task->ops->expert(task, s, &rng, action);
            assert_ok(task->ops->step(task, s, action, &reward, &is_end));
            nloss += was_holding && !s->now.is_holding;
            assert_ok(om_tissue_get_forces(t->tissue, s->tissue, &f));
            if (s->now.is_holding) most[k] = fmax(most[k], om_norm(f.grasp[0]));
            if (i < 99) continue;
            assert_ok(task->ops->info(task, s, info));
            assert_int_equal(info[4], nloss);
            assert_int_equal(nloss > 0, k == 0);
        }
        task->ops->state_destroy(task, s);
        om_rl_task_destroy(task);
    }
    print_message("largest force held: %.3f N with slips, %.3f N without\n", most[0], most[1]);
    assert_true(most[0] <= 0.08 && most[1] > 0.12);
    const OmRlSetting bad[] = {{"slip_n", "1"}};
    OmRlTask* task;
    assert_status(om_rl_task_create("retract", bad, 1, &task), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "clusters have no forces"));
}

// The cost of a step is part of reward (b) alone.
static void test_step_cost(void** state) {
    (void)state;
    for (int k = 0; k < 2; ++k) {
        const OmRlSetting set[] = {{"reward", k ? "thesis" : "exposure"}, {"step_cost", "0.02"}};
        double reward[2];
        for (int n = 0; n < 2; ++n) {
            OmRlTask* task = make(set, 1 + n);
            OmRlRetractState* s = make_state(task);
            bool is_end;
            assert_ok(task->ops->reset(task, s, om_rng_init(3, 0), 24));
            assert_ok(task->ops->step(task, s, (int[3]){2, 1, 0}, &reward[n], &is_end));
            task->ops->state_destroy(task, s);
            om_rl_task_destroy(task);
        }
        assert_near(reward[0] - reward[1], k ? 0 : 0.018, 1e-12);
    }
}

// A margin of 6 mm around the tumour of 8 mm: the points of a tumour of 14 mm. TE is that of the tumour alone.
static void test_margin(void** state) {
    (void)state;
    OmRlTask* task[3];
    OmRlRetractState* s[3];
    const OmRlSetting set[] = {{"margin_mm", "6"}};
    OmRlRetractDef def = om_rl_retract_default_def();
    task[0] = make(set, 1);
    def.tumour_radius = om__rl_retract(task[0])->def.tumour_radius + 0.006;
    assert_ok(om_rl_retract_create(&def, &task[1]));
    task[2] = make(NULL, 0);
    double info[3][OM_RL_MAX_INFO], reward;
    for (int k = 0; k < 3; ++k) {
        s[k] = make_state(task[k]);
        assert_ok(task[k]->ops->reset(task[k], s[k], om_rng_init(3, 0), 45));
    }
    OmRng rng = om_rng_init(21, 0);
    double worst = 0;
    int npart = 0, nless = 0;
    bool is_end = false;
    for (int n = 0; n < 600 && !is_end; ++n) {
        int action[3];
        double e[3];
        task[0]->ops->expert(task[0], s[0], &rng, action);
        for (int k = 0; k < 3; ++k) {
            assert_ok(task[k]->ops->step(task[k], s[k], action, &reward, &is_end));
            e[k] = s[k]->now.exposure;
        }
        worst = fmax(worst, fabs(e[0] - e[1]));
        npart += e[1] > 0.05 && e[1] < 0.95;
        nless += e[0] < e[2];
    }
    for (int k = 0; k < 3; k += 2) assert_ok(task[k]->ops->info(task[k], s[k], info[k]));
    print_message("largest difference %.3f; %d steps with a part, %d with less than the tumour\n",
                  worst, npart, nless);
    // a tumour is 1 mm higher in its middle: an edge of fat moves by 1 mm of 28 mm, pi / 4 of which are a disc
    assert_true(worst <= 0.04 && npart >= 5 && nless >= 5);
    assert_near(info[0][0], info[2][0], 0);
    for (int k = 0; k < 3; ++k) {
        task[k]->ops->state_destroy(task[k], s[k]);
        om_rl_task_destroy(task[k]);
    }
}

// Errors of "reality": a mean tip error, noise of the picture, a kidney beside its believed place.
static void test_errors(void** state) {
    (void)state;
    const OmRlSetting set[] = {
        {"tip_error_mm", "1.7"}, {"camera_noise", "8"}, {"kidney_shift_x_mm", "2"}};
    OmRlTask* task = make(set, 3);
    const OmRlRetract* t = om__rl_retract(task);
    OmRlRetractState* s = make_state(task);
    assert_near(om_distance(t->true_q, om_add(t->q, om_vec3(0.002, 0, 0))), 0, 1e-12);
    assert_near(t->q.x, -0.020, 1e-12);
    double sum = 0;
    for (uint64_t k = 0; k < 1000; ++k) {
        assert_ok(task->ops->reset(task, s, om_rng_init(6, k), 24));
        sum += om_norm(s->now.error);
    }
    assert_near(sum / 1000, 0.0017, 0.00008);  // 3 sigma of the mean: 0.07 mm
    // two pictures of one scene, in two steps: their difference has twice the variance
    OmPicture a = {0}, b = {0};
    double reward, square = 0;
    bool is_end;
    assert_ok(task->ops->render(task, s, &a));
    assert_ok(task->ops->step(task, s, (int[3]){0, 0, 0}, &reward, &is_end));
    assert_ok(task->ops->render(task, s, &b));
    int n = 84 * 84 * 3, num = 0;
    assert_int_equal(a.width * a.height * a.nchannel, n);
    for (int i = 0; i < n; ++i) {
        if (a.pixel[i] < 40 || a.pixel[i] > 215) continue;  // values that noise cannot cut
        square += pow(a.pixel[i] - b.pixel[i], 2), ++num;
    }
    print_message("noise of the picture %.2f\n", sqrt(square / num / 2));
    assert_near(sqrt(square / num / 2), 8, 0.8);
    om_picture_done(&a);
    om_picture_done(&b);
    task->ops->state_destroy(task, s);
    om_rl_task_destroy(task);
}

// A tip that stands ends the episode after `still` steps; one that moves in 2 mm does too; one that leaves does not.
static void test_still(void** state) {
    (void)state;
    const OmRlSetting set[] = {{"still", "20"}};
    OmRlTask* task = make(set, 1);
    OmRlRetractState* s = make_state(task);
    for (int kind = 0; kind < 3; ++kind) {
        int n = 0, there = 0;
        bool is_end = false;
        assert_ok(task->ops->reset(task, s, om_rng_init(3, 0), 10));
        // six steps of 0.5 mm away, then: stand; go back and forth by 0.5 mm; go back and forth by 5 mm
        for (; n < 100 && !is_end; ++n) {
            double reward;
            int way = kind == 0 ? 0 : kind == 1 ? 1 + n % 2 : 1 + n / 10 % 2;
            if (n < 6) way = 2;
            assert_ok(task->ops->step(task, s, (int[3]){0, way, 0}, &reward, &is_end));
        }
        there = n;
        // the ball begins at the fifth step, 2.5 mm from the start
        assert_int_equal(there, kind == 2 ? 100 : 25);
        assert_true(is_end == (kind < 2));
    }
    task->ops->state_destroy(task, s);
    om_rl_task_destroy(task);
}

// Bodies keep to their ranges, episodes draw all of them, and an episode is that of its body's own task.
static void test_variants(void** state) {
    (void)state;
    const OmRlSetting set[] = {{"variants", "3"},
                               {"vary_thickness", "0.1"},
                               {"vary_softness", "0.4"},
                               {"vary_kidney_mm", "2"}};
    OmRlRetractDef def = om_rl_retract_default_def();
    def.vary_thickness = 0.1, def.vary_softness = 0.4, def.vary_kidney = 0.002, def.nvariant = 3;
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
    for (int k = 0; k < 3; ++k) {
        OmRlRetractDef d = om__rl_draw_body(&def, k);
        assert_ok(om_rl_retract_create(&d, &own[k]));
        assert_ok(own[k]->ops->state_create(own[k], &b[k]));
    }
    assert_ok(task->ops->state_create(task, &a));
    assert_ok(task->ops->state_create(task, &c));
    int drawn[3] = {0};
    size_t size = task->ops->state_size(task);
    void* block = om_alloc(size, 1);
    assert_non_null(block);
    for (uint64_t episode = 0; episode < 90; ++episode) {
        float x[12], y[12], z[12];
        double reward[2];
        bool is_end;
        int body = -1;
        assert_ok(task->ops->reset(task, a, om_rng_init(8, episode), 31));
        task->ops->observe(task, a, x);
        for (int k = 0; k < 3; ++k) {  // heights of the starts differ: the fat rests elsewhere
            assert_ok(own[k]->ops->reset(own[k], b[k], om_rng_init(8, episode), 31));
            own[k]->ops->observe(own[k], b[k], y);
            if (memcmp(x, y, sizeof x) == 0) body = k;
        }
        assert_in_range(body, 0, 2);
        ++drawn[body];
        if (episode >= 6) continue;
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
                assert_ok(task->ops->step(task, c, act, &reward[1], &is_end));
                task->ops->observe(task, c, z);
                assert_memory_equal(x, z, sizeof x);
            }
        }
        double info[2][OM_RL_MAX_INFO];
        assert_ok(task->ops->info(task, a, info[0]));
        assert_ok(own[body]->ops->info(own[body], b[body], info[1]));
        for (int k = 0; k < task->ninfo; ++k) assert_near(info[0][k], info[1][k], 0);
    }
    print_message("episodes of the bodies: %d %d %d\n", drawn[0], drawn[1], drawn[2]);
    for (int k = 0; k < 3; ++k) assert_in_range(drawn[k], 15, 45);  // 30, deviation 4.5
    om_free(block);
    task->ops->state_destroy(task, a);
    task->ops->state_destroy(task, c);
    for (int k = 0; k < 3; ++k) {
        own[k]->ops->state_destroy(own[k], b[k]);
        om_rl_task_destroy(own[k]);
    }
    om_rl_task_destroy(task);
    // the survey needs one body
    OmRlSurvey survey;
    const OmRlSetting two[] = {{"variants", "2"}};
    task = make(two, 1);
    assert_int_equal(om_rl_retract_survey(task, 1, &survey), OM_INVALID);
    om_rl_task_destroy(task);
    const OmRlSetting none[] = {{"variants", "0"}};
    assert_int_equal(om_rl_task_create("retract", none, 1, &task), OM_INVALID);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_hold_and_starts),
                                       cmocka_unit_test(test_horizon_repeat_points),
                                       cmocka_unit_test(test_slip),
                                       cmocka_unit_test(test_step_cost),
                                       cmocka_unit_test(test_margin),
                                       cmocka_unit_test(test_errors),
                                       cmocka_unit_test(test_still),
                                       cmocka_unit_test(test_variants)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
