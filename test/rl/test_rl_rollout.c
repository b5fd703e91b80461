// test_rl_rollout.c: samples of an iteration: truncation, normalised rewards, the mixture of GAIL.
#include "rl/rl_internal.h"
#include "test_common.h"

enum { NENV = 4 };

typedef struct Rig {
    OmRlTask* task;
    OmRlTrainDef def;
    OmRlVec* vec;
    RlLearner learner;
    RlRollout rollout;
    RlCounters c;
    float obs[NENV * 7];
    double running[NENV];
} Rig;

// An iteration as long as an episode of "reach", which a policy without training seldom ends before.
static void rig_init(Rig* r) {
    memset(r, 0, sizeof *r);
    assert_ok(om_rl_task_create("reach", NULL, 0, &r->task));
    r->def = om_rl_train_default_def(r->task, NULL);
    r->def.nenv = NENV;
    r->def.horizon = r->task->max_step;
    r->def.batch = NENV * 2;
    r->def.policy.width = 8;
    r->def.normalise_reward = false;
    OmRlVecDef vec = om_rl_vec_default_def(r->task);
    vec.nenv = NENV;
    assert_ok(om_rl_vec_create(&vec, &r->vec));
    assert_ok(om__rl_learner_init(&r->def, &r->learner));
    assert_ok(om__rl_rollout_init(&r->def, &r->rollout));
    assert_ok(om_rl_vec_reset(r->vec, r->obs));
    assert_ok(om__rl_rollout_run(&r->learner, r->vec, r->obs, &r->c, &r->rollout));
}

static void rig_done(Rig* r) {
    om__rl_learner_done(&r->learner);
    om__rl_rollout_done(&r->rollout);
    om_rl_vec_destroy(r->vec);
    om_rl_task_destroy(r->task);
}

// Where the limit of steps ends an episode, gamma V(last observation) is added to the reward, and only there.
static void test_truncation(void** state) {
    (void)state;
    Rig r;
    rig_init(&r);
    const int last = (r.def.horizon - 1) * NENV;
    float value[NENV];
    int ntruncated = 0;
    double reward[NENV];
    assert_ok(om_net_run_forward(r.learner.judge, r.rollout.final_obs, value));
    for (int i = 0; i < last; ++i) assert_near(r.rollout.bonus[i], 0, 0);
    for (int i = 0; i < NENV; ++i) {
        bool is_cut = r.rollout.is_truncated[i];
        ntruncated += is_cut;
        assert_near(r.rollout.bonus[last + i], is_cut ? 0.99 * (double)value[i] : 0, 1e-15);
        reward[i] = r.rollout.reward[last + i];
    }
    assert_true(ntruncated > 0);
    om__rl_rollout_finish(&r.def, r.running, &r.c, &r.rollout);
    for (int i = 0; i < NENV; ++i) {
        if (!r.rollout.is_truncated[i]) continue;
        double want = reward[i] + 0.99 * (double)value[i] - (double)r.rollout.value[last + i];
        assert_near((double)r.rollout.advantage[last + i], want, 1e-6);  // of floats
    }
    rig_done(&r);
}

// The scale of rewards: the standard deviation of the discounted returns, computed again by two passes.
static void test_normalised(void** state) {
    (void)state;
    Rig r;
    rig_init(&r);
    r.def.normalise_reward = true;
    const int total = r.def.horizon * NENV, last = total - NENV;
    double* ret = om_alloc((size_t)total, sizeof *ret);
    double running[NENV] = {0}, mean = 0, square = 0;
    const double reward = r.rollout.reward[last], bonus = r.rollout.bonus[last];
    for (int k = 0; k < total; ++k) {
        int i = k % NENV;
        ret[k] = running[i] = 0.99 * running[i] + r.rollout.reward[k];
        if (r.rollout.is_end[k]) running[i] = 0;
        mean += ret[k] / total;
    }
    for (int k = 0; k < total; ++k) square += (ret[k] - mean) * (ret[k] - mean);
    om__rl_rollout_finish(&r.def, r.running, &r.c, &r.rollout);
    assert_near_rel(r.rollout.reward[last], reward / sqrt(square / total + 1e-8) + bonus, 1e-12);
    om_free(ret);
    rig_done(&r);
}

// One environment, gamma 1/2, rewards 1, 2 and 4, an end after the second: the discounted returns are 1, 2.5 and 4,
// their variance 1.5. The next rollout continues the episode: 0.5 4 + 2 = 4, and the variance of all four 1.546875.
static void test_an_end_begins_a_return(void** state) {
    (void)state;
    OmRlTrainDef def = {.gamma = 0.5, .lambda = 1, .normalise_reward = true};
    double reward[3] = {1, 2, 4}, bonus[3] = {0}, running = 0;
    float value[4] = {0}, advantage[3], target[3];
    bool is_end[3] = {false, true, false};
    RlRollout r = {.nstep = 3,
                   .nenv = 1,
                   .value = value,
                   .reward = reward,
                   .bonus = bonus,
                   .is_end = is_end,
                   .advantage = advantage,
                   .target = target};
    RlCounters c = {0};
    om__rl_rollout_finish(&def, &running, &c, &r);
    assert_near(running, 4, 0);
    assert_near_rel(c.norm_mean, 2.5, 1e-15);
    assert_near_rel(reward[2], 4 / sqrt(1.5 + 1e-8), 1e-14);
    r.nstep = 1;
    reward[0] = 2;
    is_end[0] = false;
    om__rl_rollout_finish(&def, &running, &c, &r);
    assert_near(running, 4, 0);
    assert_near_rel(reward[0], 2 / sqrt(1.546875 + 1e-8), 1e-14);
}

// Weight of the task's reward alone, and of the discriminator's alone: log D is below 0.
static void test_mixture(void** state) {
    (void)state;
    OmRlDemos demos;
    for (int k = 0; k < 2; ++k) {
        Rig r;
        RlJudge judge = {0};
        double right[2];
        rig_init(&r);
        r.def.weight_reward = k ? 0 : 0.5;
        r.def.weight_gail = k ? 2 : 0;
        const int total = r.def.horizon * NENV;
        double* before = om_alloc((size_t)total, sizeof *before);
        memcpy(before, r.rollout.reward, (size_t)total * sizeof *before);
        assert_ok(om_rl_demos_record(r.task, 5, 1, NULL, &demos));
        assert_ok(om__rl_judge_init(&r.def, &judge));
        assert_ok(om__rl_judge_run(&judge, &demos, 0, 1e-3, &r.rollout, &right[0], &right[1]));
        for (int i = 0; i < total; ++i) {
            if (k == 0) assert_near(r.rollout.reward[i], 0.5 * before[i], 0);
            if (k == 1) assert_true(r.rollout.reward[i] < 0 && r.rollout.reward[i] >= -20);
        }
        // after 40 descents it distinguishes some of them
        assert_true(right[0] + right[1] > 1);
        om__rl_judge_done(&judge);
        om_rl_demos_done(&demos);
        om_free(before);
        rig_done(&r);
    }
}

// A weight whose input is always 0 has no gradient: it only decays, by 1 - rate 1e-3 at each of the descents.
static void test_decay(void** state) {
    (void)state;
    enum { MAX_WIDTH = 8 };
    const double rate = 0.1;
    Rig r;
    RlJudge judge = {0};
    OmRlDemos demos;
    double right[2];
    float before[MAX_WIDTH];
    rig_init(&r);
    r.def.gail_noise = 0;
    const int total = r.def.horizon * NENV, nobs = r.task->nobservation;
    assert_ok(om_rl_demos_record(r.task, 5, 1, NULL, &demos));
    for (int i = 0; i < demos.nstep; ++i) demos.obs[i * nobs] = 0;
    for (int i = 0; i < total; ++i) r.rollout.obs[i * nobs] = 0;
    assert_ok(om__rl_judge_init(&r.def, &judge));
    const OmNetParameter* first = om_net_parameter(judge.net, 0);
    assert_int_equal(first->num, MAX_WIDTH * judge.nin);
    const float* w = judge.param + first->adr;  // (width x nin)
    for (int k = 0; k < MAX_WIDTH; ++k) before[k] = w[k * judge.nin];
    assert_ok(om__rl_judge_run(&judge, &demos, 0, rate, &r.rollout, &right[0], &right[1]));
    const double keep = pow(1 - rate * 1e-3, r.def.gail_epoch * (total / r.def.batch));
    assert_below(keep, 0.999);
    for (int k = 0; k < MAX_WIDTH; ++k)  // 1e-5: roundings of floats, 6e-8 for each descent
        assert_near_rel((double)w[k * judge.nin], keep * (double)before[k], 1e-5);
    om__rl_judge_done(&judge);
    om_rl_demos_done(&demos);
    rig_done(&r);
}

// Weights of 0: the logit is the last bias b everywhere, and log D = -log(1 + exp(-b)), but not below -10.
static void test_log_d(void** state) {
    (void)state;
    static const struct {
        float bias;
        double log_d;
    } row[] = {
        {3, -0.048587351573742}, {-5, -5.006715348489118}, {-9.5f, -9.50007484902863}, {-50, -10}};
    for (size_t k = 0; k < sizeof row / sizeof *row; ++k) {
        Rig r;
        RlJudge judge = {0};
        OmRlDemos demos;
        double right[2];
        rig_init(&r);
        r.def.weight_reward = 0;
        r.def.weight_gail = 2;
        assert_ok(om_rl_demos_record(r.task, 5, 1, NULL, &demos));
        assert_ok(om__rl_judge_init(&r.def, &judge));
        memset(judge.param, 0, om_net_parameter_size(judge.net) * sizeof *judge.param);
        const OmNetParameter* last =
            om_net_parameter(judge.net, om_net_parameter_count(judge.net) - 1);
        assert_int_equal(last->num, 1);
        judge.param[last->adr] = row[k].bias;
        assert_ok(om__rl_judge_run(&judge, &demos, 0, 0, &r.rollout, &right[0], &right[1]));
        for (int i = 0; i < r.def.horizon * NENV; ++i)
            assert_near_rel(r.rollout.reward[i], 2 * row[k].log_d, 1e-12);
        om__rl_judge_done(&judge);
        om_rl_demos_done(&demos);
        rig_done(&r);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_truncation), cmocka_unit_test(test_normalised),
        cmocka_unit_test(test_mixture),    cmocka_unit_test(test_decay),
        cmocka_unit_test(test_log_d),      cmocka_unit_test(test_an_end_begins_a_return),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
