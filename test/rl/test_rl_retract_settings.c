// test_rl_retract_settings.c: what the settings of the task "retract" do: errors, horizon, repeat, points, starts.
#include "retract_rig.h"

static OmRlTask* shared;  // default settings
static OmRlTask* other;   // a cost of steps, and an end for a tip that stands

static int setup(void** state) {
    (void)state;
    const OmRlSetting set[] = {{"step_cost", "0.02"}, {"still", "20"}};
    shared = make(NULL, 0);
    other = make(set, 2);
    return 0;
}

static int teardown(void** state) {
    (void)state;
    om_rl_task_destroy(shared);
    om_rl_task_destroy(other);
    return 0;
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
    OmRlTask* task = shared;
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
}

static void test_horizon_repeat_points(void** state) {
    (void)state;
    const OmRlSetting set[] = {
        {"fixed_horizon", "1"}, {"repeat", "3"}, {"points", "5"}, {"gripper", "1"}};
    OmRlTask* task = make(set, 4);
    const OmRlRetract* t = om__rl_retract(task);
    OmRlRetractState* s = make_state(task);
    assert_int_equal(task->max_step, 834);
    assert_int_equal(task->naction, 4);
    assert_int_equal(task->nobservation, 27);
    assert_true(task->hash != shared->hash);
    assert_ok(task->ops->reset(task, s, om_rng_init(3, 0), 24));
    OmVec3 before = s->now.tip;
    double reward;
    bool is_end;
    assert_ok(task->ops->step(task, s, (int[4]){1, 0, 2, 1}, &reward, &is_end));
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

// The cost of a step is part of reward (b).
static void test_step_cost(void** state) {
    (void)state;
    OmRlTask* task[2] = {shared, other};
    double reward[2];
    for (int n = 0; n < 2; ++n) {
        OmRlRetractState* s = make_state(task[n]);
        bool is_end;
        assert_ok(task[n]->ops->reset(task[n], s, om_rng_init(3, 0), 24));
        assert_ok(task[n]->ops->step(task[n], s, (int[3]){2, 1, 0}, &reward[n], &is_end));
        task[n]->ops->state_destroy(task[n], s);
    }
    assert_near(reward[0] - reward[1], 0.018, 1e-12);
}

// It is not part of reward (a).
static void test_step_cost_of_the_thesis(void** state) {
    (void)state;
    const OmRlSetting set[] = {{"reward", "thesis"}, {"step_cost", "0.02"}};
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
    assert_near(reward[0], reward[1], 1e-12);
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
    OmRlTask* task = other;
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
}

// The tip stands at p_T, out of reach of the fat: steps there count only with fat in the gripper.
static void test_a_tip_without_fat(void** state) {
    (void)state;
    const OmRlRetract* t = om__rl_retract(shared);
    OmRlRetractState* s = make_state(shared);
    double reward, distance;
    bool is_end;
    assert_ok(shared->ops->reset(shared, s, om_rng_init(3, 0), 10));
    s->now.tip = t->def.target;
    om__rl_nearest(t, s, &distance);
    assert_true(distance > t->def.reach);
    assert_ok(shared->ops->step(shared, s, (int[3]){0, 0, 0}, &reward, &is_end));
    assert_below(om_distance(s->now.tip, t->def.target), 0.002);
    assert_true(!s->now.is_holding && !is_end);
    assert_int_equal(s->now.nhold, 0);
    assert_ok(om__rl_grasp(t, s));
    assert_ok(shared->ops->step(shared, s, (int[3]){0, 0, 0}, &reward, &is_end));
    assert_int_equal(s->now.nhold, 1);
    shared->ops->state_destroy(shared, s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_hold_and_starts),  cmocka_unit_test(test_horizon_repeat_points),
        cmocka_unit_test(test_step_cost),        cmocka_slow_test(test_step_cost_of_the_thesis),
        cmocka_unit_test(test_errors),           cmocka_unit_test(test_still),
        cmocka_unit_test(test_a_tip_without_fat)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
