// test_rl_retract.c: the task "retract": scene, steps, rewards, sleep, snapshots.
#include "retract_rig.h"
#include "test_alloc.h"

enum { NENV = 4 };

static OmRlTask* shared;          // default settings
static OmRlTask* thesis_gripper;  // the thesis's reward, and an action for the gripper

static int setup(void** state) {
    (void)state;
    const OmRlSetting set[] = {{"reward", "thesis"}, {"gripper", "1"}};
    shared = make(NULL, 0);
    thesis_gripper = make(set, 2);
    return 0;
}

static int teardown(void** state) {
    (void)state;
    om_rl_task_destroy(shared);
    om_rl_task_destroy(thesis_gripper);
    return 0;
}

static uint64_t hash_of(const OmRlTask* task, const OmRlRetractState* s) {
    size_t size = task->ops->state_size(task);
    unsigned char* block = om_calloc(size, 1);
    assert_non_null(block);
    task->ops->save(task, s, block);
    uint64_t hash = om_hash(block, size, OM_HASH_SEED);
    om_free(block);
    return hash;
}

// Steps of random actions; a hash of observations and rewards.
static uint64_t run(const OmRlTask* task, OmRlRetractState* s, uint64_t seed, int nstep) {
    OmRng rng = om_rng_init(seed, 0);
    uint64_t hash = OM_HASH_SEED;
    bool is_end = false;
    for (int k = 0; k < nstep && !is_end; ++k) {
        int action[4];
        double reward;
        float obs[12];
        for (int a = 0; a < 3; ++a) action[a] = (int)om_rng_below(&rng, 3);
        action[3] = 1;
        assert_ok(task->ops->step(task, s, action, &reward, &is_end));
        assert_true(isfinite(reward));
        task->ops->observe(task, s, obs);
        for (int i = 0; i < 12; ++i) assert_true(isfinite(obs[i]) && fabsf(obs[i]) <= 1.5f);
        hash = om_hash(obs, sizeof obs, hash);
        hash = om_hash(&reward, sizeof reward, hash);
    }
    return hash;
}

// Until the expert ends the episode.
static int run_expert(const OmRlTask* task, OmRlRetractState* s, uint64_t seed) {
    OmRng rng = om_rng_init(seed, 1);
    bool is_end = false;
    int k = 0;
    for (; k < 2500 && !is_end; ++k) {
        int action[4];
        double reward;
        task->ops->expert(task, s, &rng, action);
        assert_ok(task->ops->step(task, s, action, &reward, &is_end));
    }
    return k;
}

// The expert grasps near the place of reward (b), pulls the fat past p_T and ends at p_T. That way also exposes the
// tumour under the softer fat of the thesis, where a straight way to p_T has a mean TE below 0.5.
static void test_expert(void** state) {
    (void)state;
    const OmRlSetting soft[] = {{"tissue", "thesis"}, {"tip_error_mm", "1.7"}};
    OmRlTask* thesis = test_is_slow() ? make(soft, 2) : NULL;
    double sum = 0, lowest = 1;
    for (int k = test_count(1, 0); k < test_count(2, 4); ++k) {
        const OmRlTask* task = k < 2 ? shared : thesis;
        const OmRlRetract* t = om__rl_retract(task);
        OmRlRetractState* s = make_state(task);
        OmRng rng = om_rng_init(40 + (uint64_t)k, 1);
        double past = 0, over = 0, info[OM_RL_MAX_INFO], reward;
        bool is_end = false;
        assert_ok(task->ops->reset(task, s, om_rng_init(7, (uint64_t)k), k % 2 ? 44 : 4));
        for (int i = 0; i < 900 && !is_end; ++i) {
            int action[4];
            task->ops->expert(task, s, &rng, action);
            assert_ok(task->ops->step(task, s, action, &reward, &is_end));
            past = fmax(past, s->now.tip.x - t->def.target.x);
            over = fmax(over, s->now.tip.z - t->def.target.z);
        }
        assert_ok(task->ops->info(task, s, info));
        printf("along %.1f across %.1f mm, past %.1f over %.1f mm, TE %.3f\n", 1e3 * s->now.along,
               1e3 * s->now.across, 1e3 * past, 1e3 * over, info[0]);
        assert_true(is_end);
        assert_below(om_distance(s->now.tip, t->def.target), 0.002);
        assert_true(past > 0.004 && over > 0.008);  // a slip may end the way past p_T
        // noise of the place, 3 mm on average, and 2 mm of tolerance, on a slope of about 45 degrees
        if (k < 2) assert_below(hypot(s->now.along - t->goal_along, s->now.across), 0.012);
        if (k < 2) lowest = fmin(lowest, info[0]);
        if (k >= 2) sum += info[0] / 2;
        task->ops->state_destroy(task, s);
    }
    om_rl_task_destroy(thesis);
    assert_true(lowest >= 0.95);
    if (thesis) assert_true(sum > 0.7);
}

static void test_scene(void** state) {
    (void)state;
    const OmRlRetract* t = om__rl_retract(shared);
    assert_int_equal(t->nvert, 900);
    assert_int_equal(shared->nobservation, 12);
    assert_int_equal(shared->naction, 3);
    assert_int_equal(shared->max_step, 2500);
    assert_int_equal(shared->nstart, 49);
    assert_near(t->rest_exposure, 0, 0);
    // q is on the kidney: the implicit function says so, not the field
    OmRlKidney k = t->def.kidney;
    OmVec3 p = om_sub(t->q, k.center);
    double f = pow((p.x - k.bend * p.y * p.y) / k.half.x, 2) + pow(p.y / k.half.y, 2) +
               pow(p.z / k.half.z, 2);
    assert_near(f, 1, 0.01);
    // no particle is deeper in kidney or table than its radius
    for (int i = 0; i < t->nvert; ++i) {
        OmVec3 n;
        double d = om__rl_ground_distance(&t->ground, om_load3(t->rest_x, i), &n);
        assert_true(d - t->ground.shift > 0.0010);
    }
}

// Fat at rest hides the tumour; fat with the same pixels, but behind the tumour, hides nothing.
static void test_exposure(void** state) {
    (void)state;
    const OmRlRetract* t = om__rl_retract(shared);
    static double x[2700], pixel[2700];
    OmVec3 eye = t->def.endoscope.pose_world_camera.p;
    for (int i = 0; i < t->nvert; ++i)
        om_store3(x, i, om_madd(eye, 1.5, om_sub(om_load3(t->rest_x, i), eye)));
    assert_near(om__rl_exposure(t, t->rest_x, pixel), 0, 0);
    assert_near(om__rl_exposure(t, x, pixel), 1, 0);
}

// Distance and normal of the field against the implicit function on rays from the centre.
static void test_ground(void** state) {
    (void)state;
    const OmRlGround* g = &om__rl_retract(shared)->ground;
    OmRng rng = om_rng_init(7, 0);
    OmVec3 up;
    assert_near(om__rl_ground_distance(g, om_vec3(0.2, 0, 0.01), &up) - g->shift, 0.01, 1e-12);
    assert_near(om__rl_ground_distance(g, om_vec3(0, 0.2, -0.01), &up) - g->shift, -0.01, 1e-12);
    assert_near(up.z, 1, 0);
    for (int n = 0; n < 200; ++n) {
        OmVec3 way = om_normalize(om_vec3(om_rng_normal(&rng), om_rng_normal(&rng),
                                          0.2 + fabs(om_rng_normal(&rng)))),
               normal;
        double lo = 0, hi = 0.08;
        for (int k = 0; k < 50; ++k) {  // where the ray leaves the kidney
            double s = 0.5 * (lo + hi), y = s * way.y;
            double x = (s * way.x - g->kidney.bend * y * y) / g->kidney.half.x;
            double f = x * x + pow(y / g->kidney.half.y, 2) + pow(s * way.z / g->kidney.half.z, 2);
            if (f < 1)
                lo = s;
            else
                hi = s;
        }
        OmVec3 p = om_madd(g->kidney.center, lo, way);
        double d = om__rl_ground_distance(g, p, &normal) - g->shift;
        assert_near(d, 0, 2e-4);
        assert_near(om_norm(normal), 1, 1e-9);
        d = om__rl_ground_distance(g, om_madd(p, 0.005, normal), &normal) - g->shift;
        assert_near(d, 0.005, 3e-4);
    }
}

// 0: stay, 1: backward, 2: forward, by 0.5 mm.
static void test_action(void** state) {
    (void)state;
    OmRlRetractState* s = make_state(shared);
    const double way[3] = {0, -0.0005, 0.0005};
    for (int a = 0; a < 27; ++a) {
        assert_ok(shared->ops->reset(shared, s, om_rng_init(3, 0), 24));
        OmVec3 before = s->now.tip;
        int action[3] = {a % 3, a / 3 % 3, a / 9};
        double reward;
        bool is_end;
        assert_ok(shared->ops->step(shared, s, action, &reward, &is_end));
        assert_near(s->now.tip.x - before.x, way[action[0]], 1e-12);
        assert_near(s->now.tip.y - before.y, way[action[1]], 1e-12);
        assert_near(s->now.tip.z - before.z, way[action[2]], 1e-12);
        assert_false(is_end);
    }
    shared->ops->state_destroy(shared, s);
}

// An open gripper that goes down stops 1 mm above the kidney, and its path does not enter it.
static void test_tip_stays_out(void** state) {
    (void)state;
    OmRlTask* task = thesis_gripper;
    const OmRlRetract* t = om__rl_retract(task);
    OmRlRetractState* s = make_state(task);
    OmVec3 n;
    double lowest = 1, reward;
    bool is_end;
    assert_ok(task->ops->reset(task, s, om_rng_init(3, 0), 24));
    for (int k = 0; k < 120; ++k) {
        assert_ok(task->ops->step(task, s, (int[4]){0, 0, 1, 0}, &reward, &is_end));
        lowest = fmin(lowest, om__rl_ground_distance(&t->ground, s->now.tip, &n) - t->ground.shift);
    }
    print_message("lowest %.4f mm\n", 1e3 * lowest);
    assert_near(lowest, 0.001, 5e-5);
    task->ops->state_destroy(task, s);
}

// Reward (a) from the formula of 5.4.2 and numbers of the scene written here.
static void test_thesis_reward(void** state) {
    (void)state;
    OmRlTask* task = thesis_gripper;
    OmRlRetractState* s = make_state(task);
    assert_ok(task->ops->reset(task, s, om_rng_init(3, 0), 10));
    const double d_max = sqrt(0.110 * 0.110 + 0.110 * 0.110 + 0.108 * 0.108);
    int action[4] = {0, 0, 0, 1};
    double reward;
    bool is_end;
    assert_ok(task->ops->step(task, s, action, &reward, &is_end));
    OmVec3 p = s->now.tip, q = om__rl_retract(task)->q;
    double d = sqrt(pow(p.x - q.x, 2) + pow(p.y - q.y, 2) + pow(p.z - q.z, 2));
    assert_near(reward, -0.5 * d / d_max - 0.5, 1e-12);
    assert_near(q.x, -0.020, 1e-12);
    assert_near(q.z, 0.0421, 2e-4);
    action[2] = 1;
    for (int k = 0; k < 100 && !s->now.is_holding; ++k)
        assert_ok(task->ops->step(task, s, action, &reward, &is_end));
    assert_true(s->now.is_holding);
    p = s->now.tip;
    d = sqrt(pow(p.x - 0, 2) + pow(p.y, 2) + pow(p.z - 0.095, 2));
    assert_near(reward, -0.5 * d / d_max, 1e-12);
    task->ops->state_destroy(task, s);
}

// The sum of reward (b) over an episode is the difference of its potential, the cost of steps, and twice the exposure.
static void test_our_reward(void** state) {
    (void)state;
    OmRlRetractState* s = make_state(shared);
    assert_ok(shared->ops->reset(shared, s, om_rng_init(3, 0), 45));
    const OmRlRetract* t = om__rl_retract(shared);
    double first = -om_distance(s->now.tip, t->goal) / 0.1, sum = 0;
    OmRng rng = om_rng_init(9, 0);
    bool is_end = false;
    int n = 0;
    for (; n < 2500 && !is_end; ++n) {
        int action[3];
        double reward;
        shared->ops->expert(shared, s, &rng, action);
        assert_ok(shared->ops->step(shared, s, action, &reward, &is_end));
        sum += reward;
    }
    assert_true(is_end);
    double off = hypot(s->now.along - 0.075, s->now.across) / 0.03, e = s->now.exposure;
    double last = 1 + 2 * fmax(0, 1 - off) + 2 * e - om_distance(s->now.tip, t->def.target) / 0.1;
    assert_near(sum, last - first - 0.002 * n + 2 * e, 1e-9);
    // the judge's exposure is of a picture, that of the reward is of points
    double value[OM_RL_MAX_INFO];
    assert_ok(shared->ops->info(shared, s, value));
    assert_true(value[0] >= 0.9);
    assert_near(value[0], e, 0.1);
    assert_near(value[1], 1, 0);
    shared->ops->state_destroy(shared, s);
}

// A reset after any episode gives the state of a new environment, and a restored state gives the same bytes.
static void test_snapshots(void** state) {
    (void)state;
    OmRlRetractState *a = make_state(shared), *b = make_state(shared);
    assert_ok(shared->ops->reset(shared, a, om_rng_init(3, 1), 40));
    run_expert(shared, a, 4);
    assert_true(a->now.is_moved);
    assert_ok(shared->ops->reset(shared, a, om_rng_init(3, 2), -1));
    assert_ok(shared->ops->reset(shared, b, om_rng_init(3, 2), -1));
    assert_true(hash_of(shared, a) == hash_of(shared, b));
    // half an episode, a snapshot into the other environment, the other half
    OmRng rng = om_rng_init(5, 0);
    for (int k = 0;
         k < 400 && a->now.nhold == 0 && a->now.step < 400 && !(a->now.is_holding && k % 50 == 0);
         ++k) {
        int action[3];
        double reward;
        bool is_end;
        shared->ops->expert(shared, a, &rng, action);
        assert_ok(shared->ops->step(shared, a, action, &reward, &is_end));
    }
    assert_true(a->now.is_holding);
    unsigned char* block = om_alloc(shared->ops->state_size(shared), 1);
    assert_non_null(block);
    shared->ops->save(shared, a, block);
    uint64_t first = run(shared, a, 6, 100);
    shared->ops->restore(shared, b, block);
    assert_true(run(shared, b, 6, 100) == first);
    assert_true(hash_of(shared, a) == hash_of(shared, b));
    om_free(block);
    shared->ops->state_destroy(shared, a);
    shared->ops->state_destroy(shared, b);
}

static uint64_t run_vec(int nworker, int nstep) {
    OmRlVecDef def = om_rl_vec_default_def(shared);
    def.nenv = NENV;
    def.nworker = nworker;
    OmRlVec* vec;
    assert_ok(om_rl_vec_create(&def, &vec));
    float obs[NENV * 12];
    double reward[NENV];
    int action[NENV * 3];
    uint64_t hash = OM_HASH_SEED;
    assert_ok(om_rl_vec_reset(vec, obs));
    OmRng rng = om_rng_init(11, 0);
    for (int k = 0; k < nstep; ++k) {
        for (int i = 0; i < NENV; ++i)
            assert_ok(om_rl_vec_expert(vec, i, &rng, action + 3 * (size_t)i));
        assert_ok(om_rl_vec_step(vec, action, &(OmRlStep){.obs = obs, .reward = reward}));
        hash = om_hash(obs, sizeof obs, hash);
        hash = om_hash(reward, sizeof reward, hash);
    }
    om_rl_vec_destroy(vec);
    return hash;
}

static void test_workers(void** state) {
    (void)state;
    om_worker_force(true);
    const int nstep = test_count(60, 200);
    uint64_t one = run_vec(1, nstep);
    assert_true(run_vec(2, nstep) == one);
    if (test_is_slow()) assert_true(run_vec(4, nstep) == one);
    om_worker_force(false);
}

// Random steps: every value is finite (checked by run), also of the fat.
static void test_random(void** state) {
    (void)state;
    OmRlRetractState* s = make_state(shared);
    assert_ok(shared->ops->reset(shared, s, om_rng_init(3, 0), 38));
    run(shared, s, 12, test_count(400, 2500));
    if (test_is_slow()) assert_true(s->now.is_holding);
    const double* x = om_tissue_x(s->tissue);
    for (int i = 0; i < 2700; ++i) assert_true(fabs(x[i]) < 0.3);
    shared->ops->state_destroy(shared, s);
}

// Steps of fat that nothing touches give the bytes of sleep.
static void test_sleep(void** state) {
    (void)state;
    OmRlTask* awake = make(&(OmRlSetting){"awake", "1"}, 1);
    OmRlRetractState *a = make_state(shared), *b = make_state(awake);
    assert_ok(shared->ops->reset(shared, a, om_rng_init(3, 0), 45));
    assert_ok(awake->ops->reset(awake, b, om_rng_init(3, 0), 45));
    OmRng rng = om_rng_init(13, 0);
    int nasleep = 0;
    for (int k = 0; k < test_count(60, 300); ++k) {
        int action[3];
        double ra, rb;
        bool is_end;
        shared->ops->expert(shared, a, &rng, action);
        assert_ok(shared->ops->step(shared, a, action, &ra, &is_end));
        assert_ok(awake->ops->step(awake, b, action, &rb, &is_end));
        assert_near(ra, rb, 0);
        nasleep += !a->now.is_holding;
        assert_true(hash_of(shared, a) == hash_of(awake, b));
        if (is_end) break;
    }
    assert_true(nasleep > 10 && a->now.is_holding);
    shared->ops->state_destroy(shared, a);
    awake->ops->state_destroy(awake, b);
    om_rl_task_destroy(awake);
}

// With a gripper action fat that is released comes to rest again, and sleeps there.
static void test_release(void** state) {
    (void)state;
    OmRlTask* task = thesis_gripper;
    OmRlRetractState* s = make_state(task);
    assert_ok(task->ops->reset(task, s, om_rng_init(3, 0), 31));
    double reward;
    bool is_end;
    for (int k = 0; k < 60; ++k)  // an open gripper grasps nothing
        assert_ok(task->ops->step(task, s, (int[4]){0, 0, 1, 0}, &reward, &is_end));
    assert_false(s->now.is_holding || s->now.is_moved);
    assert_ok(task->ops->step(task, s, (int[4]){0, 0, 0, 1}, &reward, &is_end));
    assert_true(s->now.is_holding);
    for (int k = 0; k < 60; ++k)
        assert_ok(task->ops->step(task, s, (int[4]){0, 0, 2, 1}, &reward, &is_end));
    assert_true(s->now.is_holding && s->now.is_moving);
    assert_ok(task->ops->step(task, s, (int[4]){0, 0, 0, 0}, &reward, &is_end));
    assert_false(s->now.is_holding);
    for (int k = 0; k < 500 && s->now.is_moving; ++k)
        assert_ok(task->ops->step(task, s, (int[4]){0, 0, 0, 0}, &reward, &is_end));
    assert_false(s->now.is_moving);
    uint64_t hash = om_tissue_state_hash(s->tissue);
    assert_ok(task->ops->step(task, s, (int[4]){0, 0, 0, 0}, &reward, &is_end));
    assert_true(om_tissue_state_hash(s->tissue) == hash);
    task->ops->state_destroy(task, s);
}

static void test_settings(void** state) {
    (void)state;
    OmRlTask* task;
    assert_int_equal(om_rl_task_create("retract", &(OmRlSetting){"rewards", "thesis"}, 1, &task),
                     OM_INVALID);
    assert_non_null(strstr(om_error_message(), "reward"));
    assert_int_equal(om_rl_task_create("retract", &(OmRlSetting){"repeat", "1.5"}, 1, &task),
                     OM_INVALID);
    assert_int_equal(om_rl_task_create("retract", &(OmRlSetting){"hold", "0"}, 1, &task),
                     OM_INVALID);
    assert_null(task);
    if (!test_is_slow()) return;  // as test_horizon_repeat_points of test_rl_retract_settings.c
    const OmRlSetting set[] = {{"repeat", "5"}, {"gripper", "1"}, {"points", "4"}};
    task = make(set, 3);
    assert_int_equal(task->max_step, 500);
    assert_int_equal(task->naction, 4);
    assert_int_equal(task->nobservation, 24);
    assert_true(task->hash != shared->hash);
    om_rl_task_destroy(task);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_scene),         cmocka_unit_test(test_expert),
        cmocka_unit_test(test_exposure),      cmocka_unit_test(test_ground),
        cmocka_unit_test(test_action),        cmocka_unit_test(test_tip_stays_out),
        cmocka_unit_test(test_thesis_reward), cmocka_unit_test(test_our_reward),
        cmocka_unit_test(test_snapshots),     cmocka_unit_test(test_workers),
        cmocka_unit_test(test_random),        cmocka_unit_test(test_sleep),
        cmocka_unit_test(test_release),       cmocka_unit_test(test_settings),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
