// test_rl_vec.c: tasks, and environments side by side.
#include "omentum/rl.h"
#include "omentum/sense.h"
#include "test_alloc.h"

enum { NENV = 5, NSTEP = 700 };

static OmRlTask* task_of(const char* name) {
    OmRlTask* task;
    assert_ok(om_rl_task_create(name, NULL, 0, &task));
    return task;
}

static OmRlVec* vec_of(const OmRlTask* task, int nworker, uint64_t seed) {
    OmRlVecDef def = om_rl_vec_default_def(task);
    OmRlVec* vec;
    def.nenv = NENV;
    def.nworker = nworker;
    def.seed = seed;
    assert_ok(om_rl_vec_create(&def, &vec));
    return vec;
}

static void random_actions(const OmRlTask* task, OmRng* rng, int* action) {
    for (int i = 0; i < NENV * task->naction; ++i)
        action[i] = (int)om_rng_below(rng, (uint32_t)task->nchoice[i % task->naction]);
}

// A hash of all that a run of random actions gives.
static uint64_t run_hash(OmRlVec* vec, OmRng rng, int nstep, uint64_t hash) {
    const OmRlTask* task = om_rl_vec_task(vec);
    float obs[NENV * 16], final_obs[NENV * 16] = {0};
    double reward[NENV], info[NENV * OM_RL_MAX_INFO] = {0}, sum[NENV] = {0};
    bool is_terminated[NENV], is_truncated[NENV];
    int action[NENV * OM_RL_MAX_ACTION], length[NENV] = {0};
    for (int t = 0; t < nstep; ++t) {
        random_actions(task, &rng, action);
        assert_ok(om_rl_vec_step(
            vec, action,
            &(OmRlStep){obs, reward, is_terminated, is_truncated, final_obs, info, sum, length}));
        hash = om_hash(obs, sizeof *obs * (size_t)(NENV * task->nobservation), hash);
        hash = om_hash(final_obs, sizeof *obs * (size_t)(NENV * task->nobservation), hash);
        hash = om_hash(reward, sizeof reward, hash);
        hash = om_hash(info, sizeof info, hash);
        hash = om_hash(sum, sizeof sum, hash);
        hash = om_hash(length, sizeof length, hash);
        hash = om_hash(is_terminated, sizeof is_terminated, hash);
        hash = om_hash(is_truncated, sizeof is_truncated, hash);
    }
    return hash;
}

static void test_workers_and_resume(void** state) {
    (void)state;
    for (int k = 0; om_rl_task_kind(k); ++k) {
        const char* name = om_rl_task_kind(k)->name;  // own tests
        if (strcmp(name, "retract") == 0 || strcmp(name, "expose") == 0 ||
            strcmp(name, "press") == 0)
            continue;
        OmRlTask* task = task_of(om_rl_task_kind(k)->name);
        float obs[NENV * 16];
        uint64_t hash[4];
        assert_true(task->nobservation <= 16);
        for (int w = 0; w < 4; ++w) {
            OmRlVec* vec = vec_of(task, 1 << w, w < 3 ? 7 : 8);
            assert_ok(om_rl_vec_reset(vec, obs));
            hash[w] = run_hash(vec, om_rng_init(3, 0), NSTEP, OM_HASH_SEED);
            om_rl_vec_destroy(vec);
        }
        assert_true(hash[0] == hash[1] && hash[0] == hash[2]);
        assert_true(hash[0] != hash[3]);  // another seed

        // saved in the middle and continued by another object
        OmRlVec *a = vec_of(task, 1, 7), *b = vec_of(task, 2, 7), *c = vec_of(task, 1, 8);
        void* block = om_alloc(om_rl_vec_size(a), 1);
        assert_ok(om_rl_vec_reset(a, obs));
        run_hash(a, om_rng_init(3, 0), 37, OM_HASH_SEED);
        om_rl_vec_save(a, block);
        uint64_t straight = run_hash(a, om_rng_init(4, 0), NSTEP, OM_HASH_SEED);
        assert_ok(om_rl_vec_restore(b, block));
        assert_true(run_hash(b, om_rng_init(4, 0), NSTEP, OM_HASH_SEED) == straight);
        assert_status(om_rl_vec_restore(c, block), OM_INVALID);  // another seed
        om_free(block);
        om_rl_vec_destroy(a);
        om_rl_vec_destroy(b);
        om_rl_vec_destroy(c);
        om_rl_task_destroy(task);
    }
}

// Episode k of environment i does not depend on the environments beside it or on the episodes before it.
static void test_episodes(void** state) {
    (void)state;
    OmRlTask* task = task_of("cart-pole");
    OmRlVec* vec = vec_of(task, 1, 5);
    float obs[NENV * 4], first[NENV * 4], final_obs[NENV * 4];
    double reward[NENV], sum[NENV];
    bool is_terminated[NENV], is_truncated[NENV];
    int action[NENV] = {0}, length[NENV];
    assert_ok(om_rl_vec_reset(vec, obs));
    assert_ok(om_rl_vec_reset(vec, first));  // episode 1 of each
    assert_true(memcmp(obs, first, 4 * sizeof *obs) != 0);
    assert_true(memcmp(obs, obs + 4, 4 * sizeof *obs) != 0);  // of another environment
    om_rl_vec_destroy(vec);

    // pushed to the left, environment 0 loses its pole first; its next observation is the start of episode 1
    vec = vec_of(task, 1, 5);
    assert_ok(om_rl_vec_reset(vec, obs));
    int nstep = 0;
    do {
        assert_ok(om_rl_vec_step(
            vec, action,
            &(OmRlStep){obs, reward, is_terminated, is_truncated, final_obs, NULL, sum, length}));
        ++nstep;
    } while (!is_terminated[0]);
    assert_memory_equal(obs, first, 4 * sizeof *obs);
    assert_true(fabsf(final_obs[2]) > 0.2f && fabsf(obs[2]) <= 0.05f);
    assert_int_equal(length[0], nstep);
    assert_near(sum[0], nstep, 0);
    assert_false(is_truncated[0]);
    om_rl_vec_destroy(vec);
    om_rl_task_destroy(task);
}

// An episode that the task does not end is cut at the limit: truncated, not terminated.
static void test_truncation(void** state) {
    (void)state;
    OmRlTask* task = task_of("reach");
    OmRlVecDef def = om_rl_vec_default_def(task);
    OmRlVec* vec;
    float obs[7], final_obs[7];
    double sum = 0, reward, info = -1;
    bool is_terminated, is_truncated;
    int length = 0, action[3] = {0, 0, 0};
    def.nenv = 1;
    assert_ok(om_rl_vec_create(&def, &vec));
    assert_ok(om_rl_vec_reset(vec, obs));
    double want = 0;
    for (int t = 1; t <= task->max_step; ++t) {
        assert_ok(om_rl_vec_step(vec, action,
                                 &(OmRlStep){obs, &reward, &is_terminated, &is_truncated, final_obs,
                                             &info, &sum, &length}));
        want += reward;
        assert_false(is_terminated);
        assert_int_equal(is_truncated, t == task->max_step);
    }
    assert_int_equal(length, task->max_step);
    assert_near(sum, want, 1e-12);
    assert_near(info, 0, 0);
    for (int k = 0; k < 3; ++k) assert_near((double)final_obs[k], 0, 0);  // pushed into the corner
    assert_true(obs[0] > 0);                                              // a new start
    om_rl_vec_destroy(vec);
    om_rl_task_destroy(task);
}

// States of Gymnasium 1.4's CartPole-v1 after 1, 10 and 20 actions from (0.01, -0.02, 0.03, 0.04).
// Without autoreset an environment keeps its last state and is refused until it is reset; its next episode is the one
// that autoreset begins.
static void test_without_autoreset(void** state) {
    (void)state;
    OmRlTask* task = task_of("cart-pole");
    OmRlVecDef def = om_rl_vec_default_def(task);
    OmRlVec *a, *b;
    float obs_a[2][4], obs_b[2][4], final_obs[2][4];
    bool done_a[2] = {false, false}, done_b[2];
    int right[2] = {1, 1}, rest[2] = {OM_RL_WAIT, OM_RL_WAIT};
    def.nenv = 2;
    assert_true(def.has_autoreset);
    assert_ok(om_rl_vec_create(&def, &a));
    def.has_autoreset = false;
    assert_ok(om_rl_vec_create(&def, &b));
    assert_ok(om_rl_vec_reset(a, obs_a[0]));
    assert_ok(om_rl_vec_reset(b, obs_b[0]));
    for (int t = 0; t < 100 && !done_a[0]; ++t) {  // until the pole of environment 0 falls
        right[1] = t % 2;
        assert_ok(om_rl_vec_step(
            a, right,
            &(OmRlStep){.obs = obs_a[0], .is_terminated = done_a, .final_obs = final_obs[0]}));
        assert_ok(om_rl_vec_step(b, right, &(OmRlStep){.obs = obs_b[0], .is_terminated = done_b}));
        assert_memory_equal(done_a, done_b, sizeof done_a);
    }
    assert_true(done_a[0] && !done_a[1]);
    assert_memory_equal(obs_b[0], final_obs[0],
                        sizeof obs_b[0]);  // the last state, not the next start
    assert_memory_equal(obs_b[1], obs_a[1], sizeof obs_b[1]);
    assert_status(om_rl_vec_step(b, right, &(OmRlStep){.obs = obs_b[0]}), OM_INVALID);
    assert_ok(om_rl_vec_step(b, rest, &(OmRlStep){.obs = obs_b[0], .is_terminated = done_b}));
    assert_false(done_b[0]);
    // a saved end is an end
    void* block = om_alloc(om_rl_vec_size(b), 1);
    om_rl_vec_save(b, block);
    assert_ok(om_rl_vec_reset_one(b, 0, -1, obs_b[0]));
    assert_memory_equal(obs_b[0], obs_a[0], sizeof obs_b[0]);
    assert_ok(om_rl_vec_step(b, right, &(OmRlStep){.obs = obs_b[0]}));
    assert_ok(om_rl_vec_restore(b, block));
    assert_status(om_rl_vec_step(b, right, &(OmRlStep){.obs = obs_b[0]}), OM_INVALID);
    om_free(block);

    // the seed of another vector
    om_rl_vec_set_seed(b, 5);
    assert_status(om_rl_vec_step(b, right, &(OmRlStep){.obs = obs_b[0]}), OM_INVALID);
    assert_ok(om_rl_vec_reset(b, obs_b[0]));
    om_rl_vec_destroy(a);
    def.seed = 5;
    assert_ok(om_rl_vec_create(&def, &a));
    assert_ok(om_rl_vec_reset(a, obs_a[0]));
    assert_memory_equal(obs_a, obs_b, sizeof obs_a);
    om_rl_vec_destroy(a);
    om_rl_vec_destroy(b);
    om_rl_task_destroy(task);
}

static void test_cart_pole_numbers(void** state) {
    (void)state;
    static const int action[20] = {1, 0, 0, 1, 1, 1, 0, 1, 1, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1};
    static const struct {
        int step;
        double value[4];
    } want[] = {
        {0, {0.009600000000000001, 0.17467919574755525, 0.030799999999999998, -0.2430687179600081}},
        {9,
         {0.04073852394524412, 0.3664394360194746, -0.0062427665089263805, -0.46146260875248174}},
        {19, {0.15721380134450405, 1.542026918097334, -0.16907815004436913, -2.3498850474720627}},
    };
    OmRlTask* task = task_of("cart-pole");
    double s[4] = {0.01, -0.02, 0.03, 0.04}, reward;
    bool is_terminated;
    void* env;
    assert_int_equal(task->ops->state_size(task), sizeof s);
    assert_ok(task->ops->state_create(task, &env));
    memcpy(env, s, task->ops->state_size(task));
    for (int t = 0, k = 0; t < 20; ++t) {
        assert_ok(task->ops->step(task, env, &action[t], &reward, &is_terminated));
        assert_false(is_terminated);
        if (k < 3 && t == want[k].step) {
            memcpy(s, env, task->ops->state_size(task));
            // the same formula in double, summed in another order
            for (int i = 0; i < 4; ++i) assert_near(s[i], want[k].value[i], 1e-13);
            ++k;
        }
    }
    task->ops->state_destroy(task, env);
    om_rl_task_destroy(task);
}

static void test_starts(void** state) {
    (void)state;
    OmRlTask* task = task_of("reach");
    OmRlVec* vec = vec_of(task, 1, 1);
    float obs[7], again[7];
    assert_ok(om_rl_vec_reset_one(vec, 0, 5, obs));
    assert_ok(om_rl_vec_reset_one(vec, 3, 5, again));
    assert_memory_equal(obs, again, sizeof obs);
    assert_near((double)obs[0], 1, 0);
    assert_near((double)obs[1], 0.5, 0);
    assert_near((double)obs[2], 0, 0);
    assert_status(om_rl_vec_reset_one(vec, 0, task->nstart, obs), OM_INVALID);
    assert_status(om_rl_vec_reset_one(vec, NENV, 0, obs), OM_INVALID);
    om_rl_vec_destroy(vec);
    om_rl_task_destroy(task);
}

// The experts reach their goal from drawn starts.
static void test_experts(void** state) {
    (void)state;
    OmRlTask* task = task_of("reach");
    OmRlVec* vec = vec_of(task, 1, 1);
    OmRng rng = om_rng_init(2, 0);
    float obs[NENV * 7];
    double reached[NENV], sum = 0;
    bool is_terminated[NENV], is_truncated[NENV];
    int action[NENV * 3], nepisode = 0;
    assert_ok(om_rl_vec_reset(vec, obs));
    for (int t = 0; t < 200; ++t) {
        for (int i = 0; i < NENV; ++i) assert_ok(om_rl_vec_expert(vec, i, &rng, action + 3 * i));
        assert_ok(om_rl_vec_step(
            vec, action, &(OmRlStep){obs, NULL, is_terminated, is_truncated, NULL, reached}));
        for (int i = 0; i < NENV; ++i)
            if (is_terminated[i] || is_truncated[i]) sum += reached[i], ++nepisode;
    }
    assert_true(nepisode > 10);
    assert_near(sum / nepisode, 1, 0);
    om_rl_vec_destroy(vec);
    om_rl_task_destroy(task);
}

// With a fixed horizon the tip is at the goal before the end, and every episode has max_step steps.
static void test_fixed_horizon(void** state) {
    (void)state;
    OmRlTask *task, *free_task = task_of("reach");
    assert_ok(om_rl_task_create("reach", &(OmRlSetting){"fixed_horizon", "1"}, 1, &task));
    assert_true(task->hash != free_task->hash);
    OmRlVec* vec = vec_of(task, 1, 1);
    OmRng rng = om_rng_init(2, 0);
    float obs[NENV * 7];
    bool is_terminated[NENV], is_truncated[NENV];
    int action[NENV * 3], nnear = 0;
    assert_ok(om_rl_vec_reset(vec, obs));
    for (int t = 1; t <= task->max_step; ++t) {
        for (int i = 0; i < NENV; ++i) assert_ok(om_rl_vec_expert(vec, i, &rng, action + 3 * i));
        assert_ok(om_rl_vec_step(vec, action, &(OmRlStep){obs, NULL, is_terminated, is_truncated}));
        for (int i = 0; i < NENV; ++i) {
            assert_false(is_terminated[i]);
            assert_int_equal(is_truncated[i], t == task->max_step);
            if (t < task->max_step) nnear += obs[7 * i + 6] < 1.5F * 0.05F;
        }
    }
    assert_true(nnear > NENV * task->max_step / 2);
    om_rl_vec_destroy(vec);
    om_rl_task_destroy(task);
    om_rl_task_destroy(free_task);
}

static void test_refused(void** state) {
    (void)state;
    OmRlTask *task, *other;
    OmRlVec* vec;
    float obs[NENV * 7];
    int action[NENV * 3] = {0};
    assert_status(om_rl_task_create("cartpole", NULL, 0, &task), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "did you mean cart-pole?"));
    assert_null(task);
    assert_status(om_rl_task_create("reach", &(OmRlSetting){"stop", "1"}, 1, &task), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "did you mean step?"));
    assert_status(om_rl_task_create("reach", &(OmRlSetting){"step", "x"}, 1, &task), OM_INVALID);
    assert_status(om_rl_task_create("reach", &(OmRlSetting){"step", "2"}, 1, &task), OM_INVALID);
    assert_status(om_rl_task_create("reach", &(OmRlSetting){"fixed_horizon", "0.5"}, 1, &task),
                  OM_INVALID);
    assert_non_null(strstr(om_error_message(), "fixed_horizon is \"0.5\", must be 0 or 1"));
    assert_ok(om_rl_task_create("reach", &(OmRlSetting){"step", "0.1"}, 1, &other));
    task = task_of("reach");
    assert_true(task->hash != other->hash);
    om_rl_task_destroy(other);
    OmRlVecDef raw = {.task = task}, none = om_rl_vec_default_def(task);
    assert_status(om_rl_vec_create(&raw, &vec), OM_INVALID);
    none.nenv = 0;
    assert_status(om_rl_vec_create(&none, &vec), OM_INVALID);
    vec = vec_of(task, 1, 1);
    assert_status(om_rl_vec_step(vec, action, &(OmRlStep){obs}), OM_INVALID);  // no reset
    assert_ok(om_rl_vec_reset(vec, obs));
    action[4] = 3;
    assert_status(om_rl_vec_step(vec, action, &(OmRlStep){obs}), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "environment 1: action[1] is 3"));
    om_rl_vec_destroy(vec);
    OmRlTaskOps ops = *task->ops;
    OmRlTask blind = *task;
    OmPicture picture = {0};
    ops.render = NULL;
    blind.ops = &ops;
    vec = vec_of(&blind, 1, 1);
    assert_status(om_rl_vec_render(vec, 0, &picture), OM_UNAVAILABLE);
    assert_null(picture.pixel);
    om_rl_vec_destroy(vec);
    om_rl_task_destroy(task);
}

// Random actions of several tasks stay inside of the bounds, so that nothing is cut.
static void test_bounds_of_observations(void** state) {
    (void)state;
    const char* const names[] = {"reach", "approach", "cart-pole", "press"};
    for (int n = 0; n < 4; ++n) {
        OmRlTask* task = task_of(names[n]);
        OmRlVec* vec = vec_of(task, 1, 1);
        OmRng rng = om_rng_init(5, 0);
        int action[NENV * OM_RL_MAX_ACTION];
        float obs[NENV * 32];
        bool has_closed_end = n < 2;  // 0 and -1 are values of the box
        assert_true(task->nobservation <= 32);
        assert_ok(om_rl_vec_reset(vec, obs));
        for (int t = 0; t < 60; ++t) {
            for (int i = 0; i < NENV * task->nobservation; ++i) {
                assert_true(obs[i] < task->obs_hi && obs[i] >= task->obs_lo);
                assert_true(obs[i] > task->obs_lo || has_closed_end);
            }
            random_actions(task, &rng, action);
            assert_ok(om_rl_vec_step(vec, action, &(OmRlStep){obs}));
        }
        om_rl_vec_destroy(vec);
        om_rl_task_destroy(task);
    }
}

// Tighter bounds cut what is beyond them, and nothing else; a missing bound is refused.
static void test_an_observation_is_cut(void** state) {
    (void)state;
    OmRlTask *task = task_of("cart-pole"),
             tight = *task;  // without settings: its head is all of it
    tight.obs_lo = -0.5f;
    tight.obs_hi = 0.25f;
    OmRlVec *wide = vec_of(task, 1, 1), *cut = vec_of(&tight, 1, 1);
    int ncut = 0, action[NENV];
    float a[NENV * 4], b[NENV * 4];
    OmRng rng = om_rng_init(5, 0);
    assert_ok(om_rl_vec_reset(wide, a));
    assert_ok(om_rl_vec_reset(cut, b));
    for (int t = 0; t < 60; ++t) {
        for (int i = 0; i < NENV * 4; ++i) {
            double expected = a[i] < -0.5f ? -0.5 : a[i] > 0.25f ? 0.25 : (double)a[i];
            assert_near(b[i], expected, 0);
            ncut += a[i] != b[i];
        }
        random_actions(task, &rng, action);
        assert_ok(om_rl_vec_step(wide, action, &(OmRlStep){a}));
        assert_ok(om_rl_vec_step(cut, action, &(OmRlStep){b}));
    }
    assert_true(ncut > 50);
    om_rl_vec_destroy(wide);
    om_rl_vec_destroy(cut);
    tight.obs_lo = tight.obs_hi = 0;
    OmRlVecDef def = om_rl_vec_default_def(&tight);
    assert_status(om_rl_vec_create(&def, &wide), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "set obs_lo below obs_hi"));
    om_rl_task_destroy(task);
}

// Pixels of a part, and their mean place in the picture.
static int find_part(const OmPicture* p, OmSensePart part, double* u, double* v) {
    int n = 0;
    *u = *v = 0;
    for (int j = 0; j < p->height; ++j)
        for (int i = 0; i < p->width; ++i) {
            if (om_sense_part_of(p->pixel + 3 * ((size_t)j * (size_t)p->width + (size_t)i)) != part)
                continue;
            ++n, *u += i, *v += j;
        }
    if (n > 0) *u /= n, *v /= n;
    return n;
}

// The tip of "reach" moves in the picture as its keys say: a to the left, e up; w makes it smaller. The pole of
// "cart-pole" leans to the side of its angle.
static void test_pictures(void** state) {
    (void)state;
    OmRlTask* task = task_of("reach");
    OmRlVec* vec = vec_of(task, 1, 1);
    float obs[NENV * 7];
    double u[2], v[2];
    const int move[3][3] = {{2, 1, 1}, {1, 2, 1}, {1, 1, 2}};  // away, left, up
    assert_ok(om_rl_vec_reset(vec, obs));
    for (int k = 0; k < 3; ++k) {
        int n[2], action[3 * NENV] = {OM_RL_WAIT, 0, 0, OM_RL_WAIT, 0, 0, OM_RL_WAIT, 0, 0,
                                      OM_RL_WAIT, 0, 0, OM_RL_WAIT};
        OmPicture p = {.width = 200, .height = 160};
        assert_ok(om_rl_vec_reset_one(vec, 0, 0, obs));  // in the corner
        assert_ok(om_rl_vec_render(vec, 0, &p));
        assert_true(p.width == 200 && p.height == 160);
        n[0] = find_part(&p, OM_PART_TOOL, &u[0], &v[0]);
        om_picture_done(&p);
        memcpy(action, move[k], sizeof move[k]);
        for (int t = 0; t < 8; ++t) assert_ok(om_rl_vec_step(vec, action, &(OmRlStep){obs}));
        p = (OmPicture){0};
        assert_ok(om_rl_vec_render(vec, 0, &p));
        assert_true(p.width == 84 && p.height == 84);
        om_picture_done(&p);
        p = (OmPicture){.width = 200, .height = 160};
        assert_ok(om_rl_vec_render(vec, 0, &p));
        n[1] = find_part(&p, OM_PART_TOOL, &u[1], &v[1]);
        om_picture_done(&p);
        assert_true(n[0] > 20 && n[1] > 20);
        if (k == 0) assert_true(n[1] < n[0] && v[1] < v[0]);
        if (k == 1) assert_true(u[1] < u[0] - 10 && fabs(v[1] - v[0]) < 3);
        if (k == 2) assert_true(v[1] < v[0] - 10);
    }
    om_rl_vec_destroy(vec);
    om_rl_task_destroy(task);
    task = task_of("cart-pole");
    void* s;
    assert_ok(task->ops->state_create(task, &s));
    for (int k = 0; k < 2; ++k) {
        OmPicture p = {.width = 300, .height = 300};
        memcpy(s, (double[4]){1, 0, k == 0 ? 0.2 : -0.2, 0}, 4 * sizeof(double));
        assert_ok(task->ops->render(task, s, &p));
        assert_true(find_part(&p, OM_PART_ROI, &u[0], &v[0]) > 20);
        assert_true(find_part(&p, OM_PART_TISSUE, &u[1], &v[1]) > 20);
        assert_true(u[1] > 160 && v[0] < v[1]);  // right of the middle; the pole is above the cart
        assert_true(k == 0 ? u[0] > u[1] + 3 : u[0] < u[1] - 3);
        om_picture_done(&p);
    }
    task->ops->state_destroy(task, s);
    om_rl_task_destroy(task);
}

static OmStatus make(void* ctx) {
    (void)ctx;
    OmRlTask* task = NULL;
    OmRlVec* vec = NULL;
    OmStatus status = om_rl_task_create("reach", NULL, 0, &task);
    if (status >= 0) {
        OmRlVecDef def = om_rl_vec_default_def(task);
        status = om_rl_vec_create(&def, &vec);
    }
    om_rl_vec_destroy(vec);
    om_rl_task_destroy(task);
    return status;
}

static void test_memory(void** state) {
    (void)state;
    assert_true(test_failing_allocations(make, NULL, 1) >= 5);
    OmRlTask* task = task_of("cart-pole");
    OmRlVec* vec = vec_of(task, 1, 1);
    float obs[NENV * 4];
    assert_ok(om_rl_vec_reset(vec, obs));
    test_count_begin();
    run_hash(vec, om_rng_init(1, 0), 100, OM_HASH_SEED);
    assert_int_equal(test_count_end(), 0);  // a step allocates nothing
    om_rl_vec_destroy(vec);
    om_rl_task_destroy(task);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_workers_and_resume),
        cmocka_unit_test(test_episodes),
        cmocka_unit_test(test_bounds_of_observations),
        cmocka_unit_test(test_an_observation_is_cut),
        cmocka_unit_test(test_pictures),
        cmocka_unit_test(test_truncation),
        cmocka_unit_test(test_without_autoreset),
        cmocka_unit_test(test_cart_pole_numbers),
        cmocka_unit_test(test_starts),
        cmocka_unit_test(test_experts),
        cmocka_unit_test(test_fixed_horizon),
        cmocka_unit_test(test_refused),
        cmocka_unit_test(test_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
