// test_rl_ppo.c: the losses of PPO, their gradients, a descent and GAE against Stable-Baselines3.
//
// rl_sb3_numbers.inc holds the numbers of Stable-Baselines3 on a batch made by formulas; tools/rl_sb3_numbers.py makes
// them. Every fifth derivative is compared. float on both sides: sums of 48 samples agree to some 1e-6.
#include "rl/rl_internal.h"
#include "test_alloc.h"

#include "rl_sb3_numbers.inc"

enum { NOBS = 7, WIDTH = 16, N = 48, NENV = 4, NACTION = 3, STRIDE = 5 };
static const int choices[NACTION] = {3, 2, 4};

static void wave(int n, double a, double b, double scale, float* out) {
    for (int i = 0; i < n; ++i) out[i] = (float)(scale * sin(a + b * i));
}

// A task without functions: only its sizes are read.
static OmRlTask plain_task(void) {
    return (OmRlTask){.name = "plain",
                      .nobservation = NOBS,
                      .naction = NACTION,
                      .nchoice = {3, 2, 4},
                      .max_step = 10};
}

static void set_weights(RlLearner* l) {
    for (int which = 0; which < 2; ++which) {
        const OmNet* net = om_rl_policy_net(l->policy, which ? OM_RL_CRITIC : OM_RL_ACTOR);
        float* param = om_rl_policy_parameters(l->policy, which ? OM_RL_CRITIC : OM_RL_ACTOR);
        for (int i = 0; i < om_net_parameter_count(net); ++i) {
            const OmNetParameter* p = om_net_parameter(net, i);
            int layer = 3 * which + i / 2;
            if (i % 2 == 0)
                wave((int)p->num, layer, 0.7, 0.3, param + p->adr);
            else
                wave((int)p->num, layer + 0.5, 1.3, 0.1, param + p->adr);
        }
    }
    assert_ok(om__rl_learner_update(l));
}

static void fill_batch(RlLearner* l) {
    wave(N * NOBS, 0.2, 0.9, 1.0, l->obs);
    for (int i = 0; i < N; ++i)
        for (int k = 0; k < NACTION; ++k) l->action[NACTION * i + k] = (3 * i + k) % choices[k];
    wave(N, 0.4, 1.1, 0.5, l->value);
    wave(N, 0.6, 1.7, 0.3, l->log_prob);
    for (int i = 0; i < N; ++i) l->log_prob[i] = (float)(-3.2 + (double)l->log_prob[i]);
    wave(N, 0.8, 2.1, 1.5, l->advantage);
    wave(N, 1.0, 2.7, 1.2, l->target);
}

static OmRlTrainDef def_of(const OmRlTask* task, double clip_value, double max_norm,
                           bool normalise) {
    OmRlTrainDef def = om_rl_train_default_def(task, NULL);
    def.nenv = N;
    def.horizon = 1;
    def.batch = N;
    def.policy.width = WIDTH;
    def.clip_value = clip_value;
    def.max_norm = max_norm;
    def.normalise_advantage = normalise;
    def.entropy = 0.01;
    return def;
}

static void compare(OmRlTrainDef def, const double* loss, const double* actor, int nactor,
                    const double* critic, int ncritic, const double* after) {
    RlLearner l = {0};
    RlLoss ours;
    assert_ok(om__rl_learner_init(&def, &l));
    set_weights(&l);
    fill_batch(&l);
    assert_ok(om__rl_learner_step(&l, 1e-3, &ours));
    assert_near(ours.policy, loss[0], 1e-6);
    assert_near(ours.value, loss[1], 1e-6);
    assert_near(ours.entropy, loss[2], 1e-6);
    assert_near(ours.divergence, loss[3], 1e-6);
    assert_near(ours.clip_fraction, loss[4], 1e-6);
    for (int i = 0; i < nactor; ++i) assert_near((double)l.grad[0][STRIDE * i], actor[i], 1e-6);
    for (int i = 0; i < ncritic; ++i) assert_near((double)l.grad[1][STRIDE * i], critic[i], 1e-6);
    // after a step of Adam of 1e-3: first weight of the actor, last bias of the critic
    const float* first = om_rl_policy_parameters(l.policy, OM_RL_ACTOR);
    const float* last = om_rl_policy_parameters(l.policy, OM_RL_CRITIC);
    size_t n = om_net_parameter_size(om_rl_policy_net(l.policy, OM_RL_CRITIC));
    assert_near((double)first[0], after[0], 1e-7);
    assert_near((double)last[n - 1], after[1], 1e-7);
    om__rl_learner_done(&l);
}

#define LEN(a) ((int)(sizeof(a) / sizeof((a)[0])))
#define COMPARE(k, clip_value, max_norm, normalise)                                              \
    compare(def_of(&task, clip_value, max_norm, normalise), loss_##k, actor_##k, LEN(actor_##k), \
            critic_##k, LEN(critic_##k), after_##k)

static void test_against_sb3(void** state) {
    (void)state;
    OmRlTask task = plain_task();
    COMPARE(0, 0.0, 1e9, false);
    COMPARE(1, 0.2, 1e9, true);
    COMPARE(2, 0.2, 0.1, true);  // the gradient is shortened to 0.1
}

static void test_gae(void** state) {
    (void)state;
    float reward[N], value[N + NENV], advantage[N], target[N];
    double r[N];
    bool is_end[N];
    wave(N, 0.3, 0.8, 1.0, reward);
    wave(N, 0.7, 0.6, 0.8, value);
    wave(NENV, 0.9, 0.5, 0.7, value + N);
    for (int i = 0; i < N; ++i) {
        r[i] = (double)reward[i];
        is_end[i] = i % 7 == 3;
    }
    om__rl_gae(N / NENV, NENV, 0.95, 0.9, r, is_end, value, advantage, target);
    for (int i = 0; i < N; ++i) {
        assert_near((double)advantage[i], gae_advantage[i], 1e-6);
        assert_near((double)target[i], gae_target[i], 1e-6);
    }
}

// The derivative of the cloning loss against differences.
static void test_clone_gradient(void** state) {
    (void)state;
    OmRlTask task = plain_task();
    OmRlPolicyDef def = om_rl_policy_default_def(&task);
    enum { NLOGIT = 9, M = 3 };
    float logit[M * NLOGIT], d[M * NLOGIT], ignored[M * NLOGIT];
    int action[M * NACTION] = {0, 1, 2, 2, 0, 3, 1, 1, 1};
    double right;
    wave(M * NLOGIT, 0.1, 1.9, 1.5, logit);
    om__rl_clone_loss(&def, M, action, logit, d, &right);
    for (int i = 0; i < M * NLOGIT; ++i) {
        const float h = 1e-2f, keep = logit[i];
        logit[i] = keep + h;
        double up = om__rl_clone_loss(&def, M, action, logit, ignored, &right);
        logit[i] = keep - h;
        double down = om__rl_clone_loss(&def, M, action, logit, ignored, &right);
        logit[i] = keep;
        // h^2 / 6 of a third derivative below 1
        assert_near((double)d[i], (up - down) / (2 * (double)h), 5e-5);
    }
}

// A training multiplies the logits by the sharpness. With a learning rate of 0 nothing else changes: its last layer is
// that of the start times the factor, for odd and even numbers of iterations.
static void test_sharpness(void** state) {
    (void)state;
    OmRlTask* task;
    const char* path = "sharpness.safetensors";
    assert_ok(om_rl_task_create("reach", NULL, 0, &task));
    for (int niteration = 5; niteration <= 8; niteration += 3) {
        OmRlTrainDef def = om_rl_train_default_def(task, NULL);
        OmRlTrainResult result;
        OmRlPolicy* start;
        def.nenv = 4, def.horizon = 16, def.batch = 64;
        def.nstep = (int64_t)niteration * 64;
        def.rate = 0;
        def.sharpness = 3;
        def.policy.width = WIDTH;
        assert_ok(om_rl_policy_create(&def.policy, &start));
        const OmNet* net = om_rl_policy_net(start, OM_RL_ACTOR);
        float* before = om_rl_policy_parameters(start, OM_RL_ACTOR);
        wave((int)om_net_parameter_size(net), 0.3, 0.7, 0.2, before);  // biases too
        assert_ok(om_rl_policy_save(start, NULL, 0, path));
        def.start = path;
        assert_ok(om_rl_train_run(&def, NULL, &result));
        const float* after = om_rl_policy_parameters(result.policy, OM_RL_ACTOR);
        int nhead = 0;
        for (int k = 0; k < om_net_parameter_count(net); ++k) {
            const OmNetParameter* q = om_net_parameter(net, k);
            const bool is_head = strncmp(q->name, "actor.head", 10) == 0;
            for (int64_t i = q->adr; i < q->adr + q->num; ++i)
                assert_near((double)after[i], (is_head ? 3 : 1) * (double)before[i],
                            1e-6 * fabs((double)after[i]));
            nhead += is_head;
        }
        assert_int_equal(nhead, 2);
        om_rl_policy_destroy(start);
        om_rl_train_result_done(&result);
    }
    remove(path);
    om_rl_task_destroy(task);
}

// Frequencies of drawn choices, and the most probable one.
static void test_choices(void** state) {
    (void)state;
    const int nchoice[2] = {3, 2};
    const float logit[5] = {0.5f, -1.0f, 1.0f, 2.0f, 2.0f};
    double p[3], sum = 0;
    int count[5] = {0}, action[2];
    OmRng rng = om_rng_init(5, 0);
    enum { NDRAW = 20000 };
    for (int i = 0; i < NDRAW; ++i) {
        om__rl_choice_draw(2, nchoice, logit, &rng, action);
        ++count[action[0]];
        ++count[3 + action[1]];
    }
    for (int j = 0; j < 3; ++j) sum += p[j] = exp((double)logit[j]);
    // four standard deviations of a share of 20000
    for (int j = 0; j < 3; ++j) assert_near(count[j] / (double)NDRAW, p[j] / sum, 4 * 0.0035);
    assert_near(count[3] / (double)NDRAW, 0.5, 4 * 0.0035);
    double log_prob = om__rl_choice_draw(2, nchoice, logit, NULL, action);
    assert_int_equal(action[0], 2);
    assert_int_equal(action[1], 0);
    assert_near(log_prob, log(p[2] / sum / 2), 1e-12);
    // far apart: no overflow
    om__rl_choice_log(2, (float[2]){1000, -1000}, p);
    assert_near(p[0], 0, 0);
    assert_near(p[1], -2000, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_against_sb3),    cmocka_unit_test(test_gae),
        cmocka_unit_test(test_clone_gradient), cmocka_unit_test(test_sharpness),
        cmocka_unit_test(test_choices),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
