// test_rl_weights.c: the trained policies expose the tumour; untrained networks do not.
#include "omentum/rl_policy.h"
#include "test_common.h"

enum { NSTART = 3 };

// Scores from starts in the rows at the fixed side, in the middle, and far from it.
static void run(OmRlPolicy* policy, const OmRlTask* task, double* score) {
    static const int start[NSTART] = {9, 24, 40};
    OmRlVecDef def = om_rl_vec_default_def(task);
    OmRlVec* vec;
    OmRlActor* actor;
    float obs[NSTART * 16];
    int action[NSTART * 3];
    double info[NSTART * OM_RL_MAX_INFO] = {0};
    bool is_done[NSTART] = {false}, is_terminated[NSTART], is_truncated[NSTART];
    def.nenv = NSTART;
    assert_ok(om_rl_vec_create(&def, &vec));
    assert_ok(om_rl_actor_create(policy, NSTART, &actor));
    for (int i = 0; i < NSTART; ++i)
        assert_ok(om_rl_vec_reset_one(vec, i, start[i], obs + (ptrdiff_t)i * task->nobservation));
    for (int left = NSTART; left > 0;) {
        assert_ok(om_rl_actor_act(actor, obs, NULL, action, NULL));
        for (int i = 0; i < NSTART; ++i)
            if (is_done[i]) action[i * 3] = OM_RL_WAIT;
        assert_ok(om_rl_vec_step(vec, action,
                                 &(OmRlStep){.obs = obs,
                                             .is_terminated = is_terminated,
                                             .is_truncated = is_truncated,
                                             .final_info = info}));
        for (int i = 0; i < NSTART; ++i) {
            if (is_done[i] || !(is_terminated[i] || is_truncated[i])) continue;
            score[i] = info[(ptrdiff_t)i * task->ninfo];
            is_done[i] = true;
            --left;
        }
    }
    om_rl_actor_destroy(actor);
    om_rl_vec_destroy(vec);
}

static void test_policies(void** state) {
    (void)state;
    static const char* const file[] = {"weights/retract_ppo.safetensors",
                                       "weights/retract_gail.safetensors"};
    // an episode that ends neither by success nor soon is cut, to keep the test short
    const OmRlSetting setting[] = {{"max_step", "600"}};
    OmRlTask* task;
    assert_ok(om_rl_task_create("retract", setting, 1, &task));
    for (int k = 0; k < test_count(1, 2); ++k) {
        OmRlPolicy *policy, *untrained;
        double score[NSTART];
        assert_ok(om_rl_policy_load(file[k], &policy));
        assert_ok(om_rl_policy_check(policy, task));
        run(policy, task, score);
        printf("%s: TE %.3f %.3f %.3f\n", file[k], score[0], score[1], score[2]);
        for (int i = 0; i < NSTART; ++i) assert_true(score[i] >= 0.8);
        if (k == 0 && test_is_slow()) {
            assert_ok(om_rl_policy_create(om_rl_policy_def(policy), &untrained));
            run(untrained, task, score);
            printf("untrained: TE %.3f %.3f %.3f\n", score[0], score[1], score[2]);
            for (int i = 0; i < NSTART; ++i) assert_true(score[i] < 0.5);
            om_rl_policy_destroy(untrained);
        }
        om_rl_policy_destroy(policy);
    }
    om_rl_task_destroy(task);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_policies)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
