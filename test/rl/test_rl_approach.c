// test_rl_approach.c: the task "approach", and the policy that carries out motions of `omentum retract`.
#include <math.h>

#include "omentum/rl_policy.h"
#include "omentum/vec.h"
#include "test_common.h"

static OmRlTask* task;

static int setup(void** state) {
    (void)state;
    return om_rl_task_create("approach", NULL, 0, &task);
}

static int teardown(void** state) {
    (void)state;
    om_rl_task_destroy(task);
    return 0;
}

// Values of an observation written by hand.
static void test_observation(void** state) {
    (void)state;
    float obs[OM_RL_NAPPROACH];
    om_rl_approach_observe((double[3]){0.1, 0.2, 0.9}, (double[3]){0.2, 0.5, 0.3}, true, obs);
    const double expected[OM_RL_NAPPROACH] = {0.1, 0.2, 0.9, 0.5, 1, -1, sqrt(0.01 + 0.09 + 0.36),
                                              1};
    assert_int_equal(task->nobservation, OM_RL_NAPPROACH);
    for (int i = 0; i < OM_RL_NAPPROACH; ++i) assert_near(obs[i], expected[i], 1e-6);
    om_rl_approach_observe((double[3]){0, 0, 0}, (double[3]){0, 0, 0}, false, obs);
    assert_near(obs[7], 0, 0);
}

// From a corner of the box, on the cone, the tip goes down until it is below the cone: the
// cost begins there, and the episode does not count as reached.
static void test_cone(void** state) {
    (void)state;
    void* s;
    float obs[OM_RL_NAPPROACH];
    double value[OM_RL_MAX_INFO], reward;
    bool is_end = false;
    assert_ok(task->ops->state_create(task, &s));
    assert_ok(task->ops->reset(task, s, om_rng_init(1, 0), 2));  // x = 1, y = 0, lowest
    task->ops->observe(task, s, obs);
    // 0.5 beside the goal the cone has its full height, 0.125 above 0.3
    assert_near(obs[2], 0.425, 1e-6);
    assert_ok(task->ops->step(task, s, (int[3]){1, 1, 1}, &reward, &is_end));
    double distance = sqrt(0.25 + 0.25 + 0.125 * 0.125);
    assert_near(reward, -distance / sqrt(3.0), 1e-9);
    assert_ok(task->ops->step(task, s, (int[3]){1, 1, 0}, &reward, &is_end));
    distance = sqrt(0.25 + 0.25 + 0.105 * 0.105);
    assert_near(reward, -distance / sqrt(3.0) - 0.3, 1e-9);  // one step below
    for (int k = 0; k < 4; ++k)
        assert_ok(task->ops->step(task, s, (int[3]){1, 1, 0}, &reward, &is_end));
    distance = sqrt(0.25 + 0.25 + 0.025 * 0.025);
    assert_near(reward, -distance / sqrt(3.0) - 0.9, 1e-9);  // at most three
    for (int k = 0; k < 40 && !is_end; ++k)                  // straight to the goal
        assert_ok(task->ops->step(task, s, (int[3]){0, 2, k < 1 ? 0 : 1}, &reward, &is_end));
    assert_true(is_end);
    assert_ok(task->ops->info(task, s, value));
    assert_near(value[0], 0, 0);
    assert_true(value[1] > 0.09);
    task->ops->state_destroy(task, s);
}

static OmRlEval evaluate(OmRlPolicy* policy, int nepisode, bool is_expert) {
    OmRlEvalDef def = om_rl_eval_default_def(task, policy);
    OmRlEval eval;
    def.nepisode = nepisode;
    def.is_expert = is_expert;
    assert_ok(om_rl_eval_run(&def, NULL, &eval));
    return eval;
}

static void test_expert(void** state) {
    (void)state;
    OmRlEval eval = evaluate(NULL, 100, true);
    assert_true(eval.mean_score >= 0.95);
    om_rl_eval_done(&eval);
}

// The policy of weights/ comes down from above; an untrained network does not arrive.
static void test_policy(void** state) {
    (void)state;
    OmRlPolicy *policy, *untrained;
    assert_ok(om_rl_policy_load("weights/approach.safetensors", &policy));
    assert_ok(om_rl_policy_check(policy, task));
    OmRlEval starts = evaluate(policy, 0, false), drawn = evaluate(policy, 200, false);
    print_message("27 starts: reached %.3f, %.1f steps; 200 drawn: %.3f, %.1f steps\n",
                  starts.mean_score, starts.mean_length, drawn.mean_score, drawn.mean_length);
    assert_near(starts.min_score, 1, 0);
    assert_true(drawn.mean_score >= 0.97);
    assert_ok(om_rl_policy_create(om_rl_policy_def(policy), &untrained));
    OmRlEval none = evaluate(untrained, 0, false);
    assert_true(none.mean_score < 0.3);
    om_rl_eval_done(&starts);
    om_rl_eval_done(&drawn);
    om_rl_eval_done(&none);
    om_rl_policy_destroy(untrained);
    om_rl_policy_destroy(policy);
}

static void test_refused(void** state) {
    (void)state;
    OmRlTask* other;
    assert_status(om_rl_task_create("approach", &(OmRlSetting){"step", "0.5"}, 1, &other),
                  OM_INVALID);
    assert_non_null(strstr(om_error_message(), "step is 0.5"));
    assert_status(om_rl_task_create("approach", &(OmRlSetting){"stepp", "1"}, 1, &other),
                  OM_INVALID);
    assert_non_null(strstr(om_error_message(), "did you mean step?"));
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_observation),
                                       cmocka_unit_test(test_cone), cmocka_unit_test(test_expert),
                                       cmocka_unit_test(test_policy),
                                       cmocka_unit_test(test_refused)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
