// test_rl_train.c: small tasks are learnt; a training does not depend on workers or interruptions; files.
#include "omentum/nn_store.h"
#include "omentum/rl_demo.h"
#include "omentum/rl_train.h"
#include "test_alloc.h"
#include "test_folder.h"

static OmRlTask* task_of(const char* name) {
    OmRlTask* task;
    assert_ok(om_rl_task_create(name, NULL, 0, &task));
    return task;
}

static OmRlEval eval_of(const OmRlTask* task, OmRlPolicy* policy) {
    OmRlEvalDef def = om_rl_eval_default_def(task, policy);
    OmRlEval eval;
    assert_ok(om_rl_eval_run(&def, NULL, &eval));
    return eval;
}

// An episode of random actions, step by step.
static double return_of(const OmRlTask* task, uint64_t seed, int episode, int* length) {
    OmRlVecDef def = om_rl_vec_default_def(task);
    OmRlVec* vec;
    OmRng rng = om_rng_init(seed, 0x6576616c00000000ull + (uint64_t)episode);
    float obs[16];
    bool is_terminated = false, is_truncated = false;
    double sum = 0, reward;
    def.nenv = 1;
    assert_ok(om_rl_vec_create(&def, &vec));
    assert_ok(om_rl_vec_reset_one(vec, 0, episode % task->nstart, obs));
    for (*length = 0; !is_terminated && !is_truncated; ++*length) {
        int action[3];
        for (int k = 0; k < task->naction; ++k)
            action[k] = (int)om_rng_below(&rng, (uint32_t)task->nchoice[k]);
        assert_ok(om_rl_vec_step(vec, action,
                                 &(OmRlStep){.obs = obs,
                                             .reward = &reward,
                                             .is_terminated = &is_terminated,
                                             .is_truncated = &is_truncated}));
        sum += reward;
    }
    om_rl_vec_destroy(vec);
    return sum;
}

// An evaluation runs groups of 64 episodes: each is what it would be alone, also in the second group.
static void test_groups_of_episodes(void** state) {
    (void)state;
    static const int episode[] = {0, 27, 63, 64, 69};
    OmRlTask* task = task_of("reach");
    OmRlEvalDef def = om_rl_eval_default_def(task, NULL);
    OmRlEval eval;
    def.nepisode = 70;
    assert_ok(om_rl_eval_run(&def, NULL, &eval));
    assert_int_equal(eval.nepisode, 70);
    for (size_t k = 0; k < sizeof episode / sizeof *episode; ++k) {
        int length;
        const double sum = return_of(task, def.seed, episode[k], &length);
        assert_near(eval.ret[episode[k]], sum, 1e-12);
        assert_int_equal(eval.length[episode[k]], length);
    }
    om_rl_eval_done(&eval);
    om_rl_task_destroy(task);
}

// Gymnasium calls CartPole-v1 solved at a mean return of 475 over 100 episodes.
static void test_cart_pole_is_solved(void** state) {
    (void)state;
    OmRlTask* task = task_of("cart-pole");
    OmRlTrainDef def = om_rl_train_default_def(task, NULL);
    OmRlTrainResult result;
    def.nstep = 130000;
    def.rate = 1e-3;
    assert_ok(om_rl_train_run(&def, NULL, &result));
    OmRlEval eval = eval_of(task, result.policy), nothing = eval_of(task, NULL);
    printf("cart-pole: return %.1f (random %.1f), %.1f s\n", eval.mean_return, nothing.mean_return,
           result.seconds);
    assert_int_equal(eval.nepisode, 100);
    assert_true(eval.mean_return >= 475);
    assert_below(nothing.mean_return, 50);
    om_rl_eval_done(&eval);
    om_rl_eval_done(&nothing);
    om_rl_train_result_done(&result);
    om_rl_task_destroy(task);
}

static void test_reach_is_solved(void** state) {
    (void)state;
    OmRlTask* task = task_of("reach");
    OmRlTrainDef def = om_rl_train_default_def(task, NULL);
    OmRlTrainResult result;
    def.nstep = 80000;
    def.rate = 1e-3;
    assert_ok(om_rl_train_run(&def, NULL, &result));
    OmRlEval eval = eval_of(task, result.policy);
    printf("reach: reached %.3f, %.1f steps, %.1f s\n", eval.mean_score, eval.mean_length,
           result.seconds);
    assert_int_equal(eval.nepisode, 27);
    assert_near(eval.min_score, 1, 0);
    // straight: the longest side of the way / step, 10 from a corner or an edge to 1.5 steps from the goal
    assert_below(eval.mean_length, 13);
    om_rl_eval_done(&eval);
    om_rl_train_result_done(&result);
    om_rl_task_destroy(task);
}

// ---- the same bytes -----------------------------------------------------------------------------------

static uint64_t policy_hash(OmRlPolicy* p) {
    uint64_t hash = OM_HASH_SEED;
    for (int i = 0; i < 2; ++i) {
        OmRlNet which = i ? OM_RL_CRITIC : OM_RL_ACTOR;
        size_t n = om_net_parameter_size(om_rl_policy_net(p, which));
        hash = om_hash(om_rl_policy_parameters(p, which), n * sizeof(float), hash);
    }
    return hash;
}

typedef struct Stop {  // cancels at the n-th report
    int left;
} Stop;

static bool stop_report(void* ctx, const char* stage, double done, double total) {
    (void)stage, (void)done, (void)total;
    return ((Stop*)ctx)->left-- > 0;
}

static OmRlTrainDef small_def(const OmRlTask* task, const char* out, OmRlMethod method,
                              const char* demos) {
    OmRlTrainDef def = om_rl_train_default_def(task, out);
    def.method = method;
    def.demos = demos;
    def.nstep = 4096;
    def.nenv = 8;
    def.horizon = 32;
    def.batch = 64;
    def.policy.width = 16;
    def.checkpoint_period = 0;
    if (method == OM_RL_GAIL) {
        def.clone_epoch = 2;
        def.gail_actions = true;
    }
    return def;
}

static void write_demos(const OmRlTask* task, int ndemo, const char* path) {
    OmRlDemos demos;
    assert_ok(om_rl_demos_record(task, ndemo, 1, NULL, &demos));
    assert_ok(om_rl_demos_save(&demos, path));
    om_rl_demos_done(&demos);
}

// One worker, three workers, and a training that is cancelled three times give one policy.
static void test_workers_and_interruptions(void** state) {
    (void)state;
    char demos[512];
    snprintf(demos, sizeof demos, "%s", in_dir("demos.hdf5"));
    OmRlTask* task = task_of("reach");
    write_demos(task, 6, demos);
    for (int method = 0; method < 2; ++method) {
        uint64_t hash[3];
        for (int k = 0; k < 3; ++k) {
            char out[600];
            snprintf(out, sizeof out, "%s/%d_%d", dir, method, k);
            OmRlTrainDef def =
                small_def(task, k < 2 ? NULL : out, (OmRlMethod)method, method ? demos : NULL);
            OmRlTrainResult result;
            def.nworker = k == 1 ? 3 : 1;
            Stop stop;
            const OmProgress progress = {stop_report, &stop};
            for (int part = 0; k == 2 && part < 3; ++part) {
                stop.left = 4;
                assert_status(om_rl_train_run(&def, &progress, &result), OM_CANCELLED);
            }
            assert_ok(om_rl_train_run(&def, NULL, &result));
            assert_int_equal(result.is_resumed, k == 2);
            assert_int_equal(result.nrow, 16);
            assert_int_equal(result.row[15].step, 4096);
            if (method) assert_true(isfinite(result.row[15].right_demo));
            hash[k] = policy_hash(result.policy);
            om_rl_train_result_done(&result);
            if (k < 2) continue;
            // finished: the same call gives it again; other settings are refused
            assert_ok(om_rl_train_run(&def, NULL, &result));
            assert_true(policy_hash(result.policy) == hash[2]);
            om_rl_train_result_done(&result);
            def.gamma = 0.98;
            assert_status(om_rl_train_run(&def, NULL, &result), OM_INVALID);
            assert_non_null(strstr(om_error_message(), "other settings"));
        }
        assert_true(hash[0] == hash[1]);
        assert_true(hash[0] == hash[2]);
    }
    om_rl_task_destroy(task);
}

// ---- demonstrations -----------------------------------------------------------------------------------

static void test_demos(void** state) {
    (void)state;
    char path[512];
    OmRlDemos a, b;
    snprintf(path, sizeof path, "%s", in_dir("demos.hdf5"));
    OmRlTask *task = task_of("reach"), *other = task_of("cart-pole");
    assert_ok(om_rl_demos_record(task, 11, 3, NULL, &a));
    assert_ok(om_rl_demos_save(&a, path));
    assert_ok(om_rl_demos_load(path, &b));
    assert_string_equal(a.task, b.task);
    assert_string_equal(a.meaning, "step=0.05");
    assert_string_equal(b.meaning, a.meaning);
    assert_int_equal(a.ndemo, b.ndemo);
    assert_int_equal(a.nstep, b.nstep);
    assert_memory_equal(a.adr, b.adr, 12 * sizeof(int));
    assert_memory_equal(a.obs, b.obs, (size_t)a.nstep * 7 * sizeof(float));
    assert_memory_equal(a.action, b.action, (size_t)a.nstep * 3 * sizeof(int));
    assert_memory_equal(a.reward, b.reward, (size_t)a.nstep * sizeof(double));
    assert_memory_equal(a.score, b.score, 11 * sizeof(double));
    assert_memory_equal(a.nchoice, b.nchoice, sizeof a.nchoice);
    assert_ok(om_rl_demos_check(&b, task));
    assert_status(om_rl_demos_check(&b, other), OM_INVALID);
    om_rl_demos_done(&b);
    // starts are varied
    assert_true(memcmp(a.obs, a.obs + 7 * a.adr[1], 7 * sizeof(float)) != 0);
    // the first demonstrations do not depend on the number of demonstrations
    assert_ok(om_rl_demos_record(task, 9, 3, NULL, &b));
    assert_memory_equal(a.obs, b.obs, (size_t)b.nstep * 7 * sizeof(float));
    om_rl_demos_done(&b);
    assert_status(om_rl_demos_parse("nothing", 7, "a text", &b), OM_INVALID);
    om_rl_demos_done(&a);
    om_rl_task_destroy(task);
    om_rl_task_destroy(other);
}

static bool stop_after(void* ctx, const char* stage, double done, double total) {
    (void)stage, (void)done, (void)total;
    return --*(int*)ctx >= 0;
}

static void assert_same_demos(const OmRlDemos* a, const OmRlDemos* b) {
    assert_int_equal(a->ndemo, b->ndemo);
    assert_int_equal(a->nstep, b->nstep);
    assert_memory_equal(a->adr, b->adr, ((size_t)a->ndemo + 1) * sizeof(int));
    assert_memory_equal(a->obs, b->obs, (size_t)(a->nstep * a->nobservation) * sizeof(float));
    assert_memory_equal(a->action, b->action, (size_t)(a->nstep * a->naction) * sizeof(int));
    assert_memory_equal(a->reward, b->reward, (size_t)a->nstep * sizeof(double));
    assert_memory_equal(a->score, b->score, (size_t)a->ndemo * sizeof(double));
    assert_true(a->is_partial == b->is_partial && a->seed == b->seed);
}

// Stopped again and again, through a file each time, and continued within a group of 8: the steps of one recording.
static void test_demos_continue(void** state) {
    (void)state;
    char path[512];
    snprintf(path, sizeof path, "%s", in_dir("part.hdf5"));
    OmRlTask *task = task_of("reach"), *other = task_of("approach");
    OmRlDemos whole, part = {0}, copy;
    assert_ok(om_rl_demos_record(task, 11, 3, NULL, &whole));
    int left = 0, nstop = 0, nkept = 0;
    const OmProgress progress = {stop_after, &left};
    OmStatus status;
    for (int more = 0;; more += 20) {  // several workers report less often than each step
        const int before = part.ndemo;
        left = more;
        status = om_rl_demos_continue(task, 11, 3, &progress, &part);
        if (status != OM_CANCELLED) break;
        assert_true(part.ndemo >= before && part.is_partial == (part.ndemo > 0));
        ++nstop;
        if (part.ndemo == 0) continue;
        ++nkept;
        assert_ok(om_rl_demos_save(&part, path));
        assert_ok(om_rl_demos_load(path, &copy));
        assert_same_demos(&copy, &part);
        om_rl_demos_done(&part);
        part = copy;
    }
    assert_ok(status);
    assert_true(nstop > 0 && nkept < nstop);
    assert_same_demos(&part, &whole);
    // a whole recording is not continued
    assert_status(om_rl_demos_continue(task, 12, 3, NULL, &part), OM_INVALID);
    om_rl_demos_done(&part);
    for (int begin = 5; begin <= 8; begin += 3) {
        assert_ok(om_rl_demos_record(task, begin, 3, NULL, &part));
        part.is_partial = true;
        part.seed = 3;
        // of another seed, another task, or more than are wanted
        assert_status(om_rl_demos_continue(task, 11, 4, NULL, &part), OM_INVALID);
        assert_status(om_rl_demos_continue(other, 11, 3, NULL, &part), OM_INVALID);
        assert_status(om_rl_demos_continue(task, begin - 1, 3, NULL, &part), OM_INVALID);
        left = 0;  // at once: they stay
        assert_status(om_rl_demos_continue(task, 11, 3, &progress, &part), OM_CANCELLED);
        assert_int_equal(part.ndemo, begin);
        assert_ok(om_rl_demos_continue(task, 11, 3, NULL, &part));
        assert_same_demos(&part, &whole);
        om_rl_demos_done(&part);
    }
    om_rl_demos_done(&whole);
    om_rl_task_destroy(task);
    om_rl_task_destroy(other);
}

// A cancelled evaluation has the finished episodes, each as in the whole evaluation.
static void test_eval_stopped(void** state) {
    (void)state;
    OmRlTask* task = task_of("reach");
    OmRlEvalDef def = om_rl_eval_default_def(task, NULL);
    OmRlEval whole, part;
    double sum = 0, least = 1e9;
    def.is_expert = true;
    def.nepisode = 70;
    assert_ok(om_rl_eval_run(&def, NULL, &whole));
    int left = 64 + 12;  // a report before each reset, then one before each step
    OmProgress progress = {stop_after, &left};
    assert_status(om_rl_eval_run(&def, &progress, &part), OM_CANCELLED);
    int nshort = 0;
    for (int k = 0; k < 64; ++k) nshort += whole.length[k] <= 12;
    assert_in_range(nshort, 1, 63);
    assert_int_equal(part.nepisode, nshort);
    for (int k = 0; k < part.nepisode; ++k) {
        const int at = part.episode[k];
        assert_true(k == 0 || at > part.episode[k - 1]);
        assert_true(part.length[k] <= 12 && part.length[k] == whole.length[at]);
        assert_near(part.ret[k], whole.ret[at], 0);
        assert_near(part.score[k], whole.score[at], 0);
        assert_near(part.info[k], whole.info[at], 0);
        assert_int_equal(whole.episode[at], at);
        sum += part.ret[k];
        least = fmin(least, part.score[k]);
    }
    assert_near(part.mean_return, sum / nshort, 1e-12);
    assert_near(part.min_score, least, 0);
    om_rl_eval_done(&part);
    left = 64;  // before the first step
    assert_status(om_rl_eval_run(&def, &progress, &part), OM_CANCELLED);
    assert_int_equal(part.nepisode, 0);
    om_rl_eval_done(&part);
    om_rl_eval_done(&whole);
    om_rl_task_destroy(task);
}

// Demonstrations of other moves are refused by file; the message names both settings.
static void test_demos_of_other_moves(void** state) {
    (void)state;
    const OmRlSetting twice = {"step", "0.1"};
    char path[512];
    snprintf(path, sizeof path, "%s", in_dir("demos.hdf5"));
    OmRlTask *task = task_of("reach"), *coarse;
    OmRlDemos d;
    OmRlTrainResult result;
    assert_ok(om_rl_task_create("reach", &twice, 1, &coarse));
    write_demos(task, 3, path);
    OmRlTrainDef def = small_def(coarse, NULL, OM_RL_GAIL, path);
    assert_status(om_rl_train_run(&def, NULL, &result), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "step=0.05"));
    assert_non_null(strstr(om_error_message(), "step=0.1"));
    assert_ok(om_rl_demos_load(path, &d));
    assert_ok(om_rl_demos_check(&d, task));
    assert_status(om_rl_demos_check(&d, coarse), OM_INVALID);
    d.meaning[0] = 0;  // a file that does not say
    assert_ok(om_rl_demos_check(&d, coarse));
    om_rl_demos_done(&d);
    om_rl_task_destroy(task);
    om_rl_task_destroy(coarse);
}

// A file of another tool: steps and arrays alone. It is used if observations and actions are those of the task.
static void test_demos_of_another_tool(void** state) {
    (void)state;
    enum { N = 5, NOBS = 7 };
    const float obs[N * NOBS] = {0};
    const int num = N;
    char path[512];
    snprintf(path, sizeof path, "%s", in_dir("other.hdf5"));
    OmRlTask *task = task_of("reach"), *other = task_of("approach");
    for (int most = 2; most <= 3; ++most) {  // choices of reach are 0, 1, 2
        const float action[3 * N] = {0, 1, 2, 1, 1, 1, 0, 0, 0, 1, (float)most, 0, 1, 2, 2};
        OmStoreWriter* w;
        OmRlDemos d;
        assert_ok(om_store_begin("omentum demonstrations", 1, &w));
        om_store_group(w, "data");
        om_store_group(w, "data/demo_0");
        om_store_group(w, "data/demo_0/obs");
        om_store_value(w, "data/demo_0@num_samples", OM_STORE_I32, 0, &num);
        om_store_array(w, "data/demo_0/obs/state", OM_STORE_F32, (int[3]){N, NOBS}, 64, NULL, obs);
        om_store_array(w, "data/demo_0/actions", OM_STORE_F32, (int[3]){N, 3}, 64, NULL, action);
        assert_ok(om_store_save(w, path));
        assert_ok(om_rl_demos_load(path, &d));
        assert_string_equal(d.task, "");
        assert_string_equal(d.meaning, "");
        assert_status(om_rl_demos_check(&d, task), most == 2 ? OM_OK : OM_INVALID);
        if (most == 3) assert_non_null(strstr(om_error_message(), "has 4 choices, of the task 3"));
        assert_status(om_rl_demos_check(&d, other), OM_INVALID);
        assert_non_null(strstr(om_error_message(), "7 values"));
        om_rl_demos_done(&d);
    }
    om_rl_task_destroy(task);
    om_rl_task_destroy(other);
}

static void test_clone(void** state) {
    (void)state;
    char demos[512];
    snprintf(demos, sizeof demos, "%s", in_dir("demos.hdf5"));
    OmRlTask* task = task_of("reach");
    write_demos(task, 35, demos);
    OmRlTrainDef def = om_rl_train_default_def(task, NULL);
    OmRlTrainResult result;
    def.method = OM_RL_CLONE;
    assert_status(om_rl_train_run(&def, NULL, &result), OM_INVALID);  // no demonstrations
    def.demos = demos;
    def.rate = 1e-3;
    assert_ok(om_rl_train_run(&def, NULL, &result));
    // The most probable actions may circle around the goal, as the demonstrations do not show the way back.
    OmRlEvalDef how = om_rl_eval_default_def(task, result.policy);
    OmRlEval eval;
    how.is_random = true;
    assert_ok(om_rl_eval_run(&how, NULL, &eval));
    printf("clone: reached %.3f, right %.3f\n", eval.mean_score, result.row[0].right_demo);
    assert_true(eval.mean_score > 0.9);
    assert_int_equal(task->ninfo, 1);  // "reached", the score
    for (int i = 0; i < eval.nepisode; ++i) assert_near(eval.info[i], eval.score[i], 0);
    assert_true(result.row[0].right_demo > 0.7);  // of the expert's components, 0.87 are not random
    om_rl_eval_done(&eval);
    om_rl_train_result_done(&result);
    om_rl_task_destroy(task);
}

// The discriminator alone, without the task's reward, teaches the way to the goal.
static void test_gail(void** state) {
    (void)state;
    char demos[512];
    snprintf(demos, sizeof demos, "%s", in_dir("demos.hdf5"));
    OmRlTask* task = task_of("reach");
    write_demos(task, 35, demos);
    OmRlTrainDef def = om_rl_train_default_def(task, NULL);
    OmRlTrainResult result;
    def.method = OM_RL_GAIL;
    def.demos = demos;
    def.nstep = 80000;
    def.rate = 1e-3;
    def.weight_reward = 0;
    def.weight_gail = 1;
    assert_ok(om_rl_train_run(&def, NULL, &result));
    OmRlEval eval = eval_of(task, result.policy);
    printf("gail: reached %.3f, %.1f steps, %.1f s; right %.2f %.2f\n", eval.mean_score,
           eval.mean_length, result.seconds, result.row[result.nrow - 1].right_demo,
           result.row[result.nrow - 1].right_policy);
    assert_true(eval.mean_score > 0.9);
    om_rl_eval_done(&eval);
    om_rl_train_result_done(&result);
    om_rl_task_destroy(task);
}

// ---- files --------------------------------------------------------------------------------------------

static void test_policy_file(void** state) {
    (void)state;
    char path[512];
    OmRlPolicy *p, *q;
    snprintf(path, sizeof path, "%s", in_dir("policy.safetensors"));
    OmRlTask *task = task_of("reach"), *other = task_of("cart-pole");
    OmRlPolicyDef def = om_rl_policy_default_def(task);
    def.nlayer = 3;
    def.width = 9;
    def.activation = OM_RELU;
    assert_ok(om_rl_policy_create(&def, &p));
    assert_ok(om_rl_policy_save(p, &(OmTextPair){"note", "a"}, 1, path));
    assert_ok(om_rl_policy_load(path, &q));
    assert_true(policy_hash(p) == policy_hash(q));
    assert_int_equal(om_rl_policy_def(q)->nlayer, 3);
    assert_int_equal(om_rl_policy_def(q)->activation, OM_RELU);
    assert_ok(om_rl_policy_check(q, task));
    assert_status(om_rl_policy_check(q, other), OM_INVALID);
    om_rl_policy_destroy(q);
    snprintf(path, sizeof path, "%s", in_dir("policy.onnx"));
    assert_ok(om_rl_policy_save_onnx(p, path));
    om_rl_policy_destroy(p);
    assert_status(om_rl_policy_load(path, &q), OM_INVALID);
    om_rl_task_destroy(task);
    om_rl_task_destroy(other);
}

static OmStatus train_small(void* ctx) {
    OmRlTrainDef def = small_def(ctx, NULL, OM_RL_PPO, NULL);
    OmRlTrainResult result;
    def.nstep = 256;
    OmStatus status = om_rl_train_run(&def, NULL, &result);
    om_rl_train_result_done(&result);
    return status;
}

static void test_memory(void** state) {
    (void)state;
    OmRlTask* task = task_of("reach");
    assert_true(test_failing_allocations(train_small, task, test_stride(3)) > 20);
    om_rl_task_destroy(task);
}

static void test_refused(void** state) {
    (void)state;
    OmRlTask* task = task_of("reach");
    OmRlTrainResult result;
    OmRlTrainDef def = om_rl_train_default_def(task, NULL), raw = {.task = task};
    assert_status(om_rl_train_run(&raw, NULL, &result), OM_INVALID);
    def.batch = 100;
    assert_status(om_rl_train_run(&def, NULL, &result), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "does not divide"));
    def.batch = 256;
    def.gamma = 1.5;
    assert_status(om_rl_train_run(&def, NULL, &result), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "gamma is 1.5"));
    def.gamma = (double)NAN;
    assert_status(om_rl_train_run(&def, NULL, &result), OM_INVALID);
    om_rl_task_destroy(task);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_groups_of_episodes),
        cmocka_slow_test(test_cart_pole_is_solved),
        cmocka_unit_test(test_reach_is_solved),
        cmocka_unit_test(test_workers_and_interruptions),
        cmocka_unit_test(test_demos),
        cmocka_unit_test(test_demos_continue),
        cmocka_unit_test(test_eval_stopped),
        cmocka_unit_test(test_demos_of_other_moves),
        cmocka_unit_test(test_demos_of_another_tool),
        cmocka_unit_test(test_clone),
        cmocka_slow_test(test_gail),
        cmocka_unit_test(test_policy_file),
        cmocka_unit_test(test_memory),
        cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests(tests, make_dir, remove_dir);
}
