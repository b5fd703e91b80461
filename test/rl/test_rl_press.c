// test_rl_press.c: the task "press": a lesion is found by pressing.
#include "omentum/rl.h"
#include "test_alloc.h"

static OmRlTask* shared;

static int setup(void** state) {
    (void)state;
    assert_ok(om_rl_task_create("press", NULL, 0, &shared));
    return 0;
}

static int teardown(void** state) {
    (void)state;
    om_rl_task_destroy(shared);
    return 0;
}

static void* make_state(void) {
    void* s;
    assert_ok(shared->ops->state_create(shared, &s));
    return s;
}

static uint64_t run(void* s, OmRng* rng, int nstep, double* sum, bool* is_end) {
    uint64_t hash = OM_HASH_SEED;
    *is_end = false;
    for (int k = 0; k < nstep && !*is_end; ++k) {
        int action[4];
        float obs[29];
        double reward;
        shared->ops->expert(shared, s, rng, action);
        assert_ok(shared->ops->step(shared, s, action, &reward, is_end));
        shared->ops->observe(shared, s, obs);
        for (int i = 0; i < 29; ++i) assert_true(isfinite(obs[i]));
        hash = om_hash(obs, sizeof obs, hash);
        *sum += reward;
    }
    return hash;
}

// The expert finds lesions in the middle and in corners; the reward is that of the distance.
static void test_expert_finds(void** state) {
    (void)state;
    void* s = make_state();
    const int start[] = {0, 12, 23};
    for (int k = 0; k < 3; ++k) {
        double value[OM_RL_MAX_INFO], sum = 0;
        bool is_end;
        OmRng rng = om_rng_init(5, (uint64_t)k);
        assert_ok(shared->ops->reset(shared, s, om_rng_init(1, 0), start[k]));
        run(s, &rng, 1000, &sum, &is_end);
        assert_true(is_end);
        assert_ok(shared->ops->info(shared, s, value));
        print_message("start %d: %.2f mm off, return %.2f\n", start[k], 1e3 * value[1], sum);
        assert_below(value[1], 0.005);
        assert_near(value[0], 1, 0);
        assert_true(sum > 0);
    }
    shared->ops->state_destroy(shared, s);
}

// Force of a press of 5 mm: above the lesion more than far from it, and of the size of Hertz's formula for a ball on a
// half space of the block's modulus, F = 4/3 E / (1 - nu^2) sqrt(R d^3), which a block of 30 mm on a board exceeds.
static void test_force(void** state) {
    (void)state;
    void* s = make_state();
    float obs[29];
    double force[2];
    for (int k = 0; k < 2; ++k) {
        assert_ok(shared->ops->reset(shared, s, om_rng_init(1, 0), k == 0 ? 0 : 12));
        for (int n = 0; n < test_count(25, 60); ++n) {
            double reward;
            bool is_end;
            // start 0: the lesion is at (-20, -20) mm, the ball presses at (0, 0)
            assert_ok(
                shared->ops->step(shared, s, (int[4]){0, 0, n < 8 ? 1 : 0, 0}, &reward, &is_end));
        }
        shared->ops->observe(shared, s, obs);
        force[k] = 0.5 * (double)obs[3];
    }
    double hertz = 4.0 / 3 * 3000 / (1 - 0.45 * 0.45) * sqrt(0.008 * pow(0.005, 3));
    print_message("far %.3f N, above the lesion %.3f N, Hertz %.3f N\n", force[0], force[1], hertz);
    assert_true(force[0] > 0.6 * hertz && force[0] < 2 * hertz);
    assert_true(force[1] > 1.3 * force[0]);
    // away from the tissue there is no force, and the tissue rests again
    double reward;
    bool is_end;
    for (int n = 0; n < test_count(30, 100); ++n)
        assert_ok(shared->ops->step(shared, s, (int[4]){0, 0, 2, 0}, &reward, &is_end));
    shared->ops->observe(shared, s, obs);
    assert_near(obs[3], 0, 0);
    shared->ops->state_destroy(shared, s);
}

// A place is felt by a press of 4 mm or more, in steps of 1 mm from 3 mm above: not by one of 3 mm, which has a force.
static void test_a_place_is_felt_deep(void** state) {
    (void)state;
    void* s = make_state();
    float obs[29];
    double reward;
    bool is_end;
    assert_ok(shared->ops->reset(shared, s, om_rng_init(1, 0), 12));
    for (int n = 1; n <= 8; ++n) {
        assert_ok(shared->ops->step(shared, s, (int[4]){0, 0, 1, 0}, &reward, &is_end));
        shared->ops->observe(shared, s, obs);
        if (n == 6) assert_true(obs[3] > 0);
        for (int k = 0; k < 25 && n <= 6; ++k) assert_near(obs[4 + k], 0, 0);
    }
    for (int k = 0; k < 25; ++k)  // the ball is over the middle of 5 x 5 places
        assert_near(obs[4 + k], k == 12 ? obs[3] : 0, 0);
    shared->ops->state_destroy(shared, s);
}

static void test_snapshots(void** state) {
    (void)state;
    void *a = make_state(), *b = make_state();
    unsigned char* block = om_alloc(shared->ops->state_size(shared), 1);
    assert_non_null(block);
    OmRng rng = om_rng_init(3, 0);
    double sum = 0;
    bool is_end;
    assert_ok(shared->ops->reset(shared, a, om_rng_init(4, 0), -1));
    run(a, &rng, 30, &sum, &is_end);
    shared->ops->save(shared, a, block);
    OmRng again = rng;
    uint64_t first = run(a, &rng, 10, &sum, &is_end);
    shared->ops->restore(shared, b, block);
    assert_true(run(b, &again, 10, &sum, &is_end) == first);
    om_free(block);
    shared->ops->state_destroy(shared, a);
    shared->ops->state_destroy(shared, b);
}

static OmStatus make_all(void* ctx) {
    (void)ctx;
    OmRlTask* task;
    void* s = NULL;
    OmStatus status = om_rl_task_create("press", NULL, 0, &task);
    if (status >= 0) status = task->ops->state_create(task, &s);
    if (status >= 0) task->ops->state_destroy(task, s);
    om_rl_task_destroy(task);
    return status;
}

static void test_memory(void** state) {
    (void)state;
    assert_true(test_failing_allocations(make_all, NULL, test_stride(3)) > 5);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_slow_test(test_expert_finds), cmocka_unit_test(test_force),
        cmocka_unit_test(test_a_place_is_felt_deep), cmocka_unit_test(test_snapshots),
        cmocka_unit_test(test_memory)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
