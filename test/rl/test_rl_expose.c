// test_rl_expose.c: the task "expose": two arms lift what one cannot.
#include "omentum/rl.h"
#include "test_alloc.h"

static OmRlTask* shared;

static int setup(void** state) {
    (void)state;
    assert_ok(om_rl_task_create("expose", NULL, 0, &shared));
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

// At most nstep steps of the expert; a hash of observations and rewards.
static uint64_t run(void* s, OmRng* rng, int nstep, bool* is_end) {
    uint64_t hash = OM_HASH_SEED;
    *is_end = false;
    for (int k = 0; k < nstep && !*is_end; ++k) {
        int action[6];
        float obs[21];
        double reward;
        shared->ops->expert(shared, s, rng, action);
        assert_ok(shared->ops->step(shared, s, action, &reward, is_end));
        shared->ops->observe(shared, s, obs);
        for (int i = 0; i < 21; ++i) assert_true(isfinite(obs[i]) && fabsf(obs[i]) <= 1.5f);
        hash = om_hash(obs, sizeof obs, hash);
        hash = om_hash(&reward, sizeof reward, hash);
    }
    return hash;
}

static void test_expert_exposes(void** state) {
    (void)state;
    void* s = make_state();
    assert_int_equal(shared->nobservation, 21);
    assert_int_equal(shared->naction, 6);
    assert_ok(shared->ops->reset(shared, s, om_rng_init(1, 0), 36));
    double value[OM_RL_MAX_INFO];
    assert_ok(shared->ops->info(shared, s, value));
    assert_near(value[0], 0, 0);
    assert_near(value[1], 0, 0);
    OmRng rng = om_rng_init(2, 0);
    bool is_end;
    run(s, &rng, 2500, &is_end);
    assert_true(is_end);
    assert_ok(shared->ops->info(shared, s, value));
    assert_true(value[0] >= 0.9);
    assert_near(value[1], 2, 0);
    shared->ops->state_destroy(shared, s);
}

// A snapshot in the lift, restored into another environment, gives the same bytes; so does a reset.
static void test_snapshots(void** state) {
    (void)state;
    void *a = make_state(), *b = make_state();
    unsigned char* block = om_alloc(shared->ops->state_size(shared), 1);
    assert_non_null(block);
    OmRng rng = om_rng_init(3, 0);
    bool is_end;
    assert_ok(shared->ops->reset(shared, a, om_rng_init(4, 0), 45));
    uint64_t first = run(a, &rng, 120, &is_end);
    shared->ops->save(shared, a, block);
    OmRng again = rng;
    uint64_t second = run(a, &rng, 60, &is_end);
    shared->ops->restore(shared, b, block);
    assert_true(run(b, &again, 60, &is_end) == second);
    OmRng anew = om_rng_init(3, 0);
    assert_ok(shared->ops->reset(shared, b, om_rng_init(4, 0), 45));
    assert_true(run(b, &anew, 120, &is_end) == first);
    om_free(block);
    shared->ops->state_destroy(shared, a);
    shared->ops->state_destroy(shared, b);
}

static void test_settings(void** state) {
    (void)state;
    OmRlTask* task;
    assert_status(om_rl_task_create("expose", &(OmRlSetting){"repeat", "4"}, 1, &task), OM_INVALID);
    assert_null(task);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_expert_exposes),
                                       cmocka_unit_test(test_snapshots),
                                       cmocka_unit_test(test_settings)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
