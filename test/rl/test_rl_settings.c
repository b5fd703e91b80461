// test_rl_settings.c: a policy states the settings of its training; they make the same task, and others are named.
//
// The hash of a task, which has every setting and the fat at rest bit by bit, is independent of the texts.
#include <math.h>

#include "test_alloc.h"
#include "test_files.h"

#include "rl/rl_internal.h"

static OmRlTask* make(const char* name, const OmRlSetting* setting, int n) {
    OmRlTask* task;
    assert_ok(om_rl_task_create(name, setting, n, &task));
    return task;
}

static OmRlPolicy* policy_of(const OmRlTask* task) {
    OmRlPolicyDef def = om_rl_policy_default_def(task);
    OmRlPolicy* policy;
    def.width = 4;
    assert_ok(om_rl_policy_create(&def, &policy));
    return policy;
}

// Through a file.
static OmRlPolicy* again(OmRlPolicy* policy) {
    const char* path = temp_path("rl_settings.safetensors");
    OmRlPolicy* back;
    assert_ok(om_rl_policy_save(policy, NULL, 0, path));
    assert_ok(om_rl_policy_load(path, &back));
    om_rl_policy_destroy(policy);
    remove(path);
    return back;
}

static void expect_difference(const OmRlPolicy* policy, const OmRlTask* task, const char* want) {
    OmText text = {0};
    assert_ok(om_rl_policy_differ(policy, task, &text));
    assert_string_equal(text.str ? text.str : "", want);
    om_text_done(&text);
}

// The task of the values alone, without the words that it was made with.
static OmRlTask* task_of_values(const OmRlTask* task) {
    OmRlSetting setting[64];
    char text[OM_RL_SETTINGS];
    int n = 0;
    strcpy(text, task->values);
    for (char* at = text; *at; ++n) {
        char *equal = strchr(at, '='), *end = strchr(at, '\n');
        assert_true(n < 64 && equal && end && equal < end);
        *equal = *end = '\0';
        setting[n] = (OmRlSetting){at, equal + 1};
        at = end + 1;
    }
    return make(task->name, setting, n);
}

static void test_the_same_task(void** state) {
    (void)state;
    static const OmRlSetting odd[] = {
        {"world", "reality"},   {"thickness_mm", "3.3333333333333335"},
        {"tissue", "clusters"}, {"slip_n", "0"},
        {"repeat", "3"},        {"reward", "thesis"}};
    static const OmRlSetting step[] = {{"step", "0.1"}};
    static const struct {
        const char* name;
        const OmRlSetting* setting;
        int n;
    } made[] = {
        {"retract", odd, 6}, {"reach", step, 1}, {"approach", step, 1}, {"cart-pole", NULL, 0}};
    for (size_t k = 0; k < sizeof made / sizeof *made; ++k) {
        OmRlTask *task = make(made[k].name, made[k].setting, made[k].n), *same;
        OmRlPolicy* policy = again(policy_of(task));
        assert_true(om_rl_policy_is_stated(policy));
        assert_ok(om_rl_policy_task(policy, NULL, 0, &same));
        assert_true(same->hash == task->hash);
        assert_string_equal(same->values, task->values);
        expect_difference(policy, same, "");
        om_rl_task_destroy(same);
        if (k == 0) {
            same = task_of_values(task);
            assert_true(same->hash == task->hash);
            om_rl_task_destroy(same);
        }
        om_rl_policy_destroy(policy);
        om_rl_task_destroy(task);
    }
}

static void test_another_task_is_named(void** state) {
    (void)state;
    static const OmRlSetting coarse[] = {{"move_mm", "2"}, {"max_step", "150"}};
    static const OmRlSetting fine[] = {{"move_mm", "0.5"}, {"repeat", "4"}};
    static const OmRlSetting unknown[] = {{"mov_mm", "0.5"}};
    OmRlTask *task = make("retract", coarse, 2), *other;
    OmRlPolicy* policy = policy_of(task);
    assert_non_null(strstr(task->values, "\nself_collision=0\n"));
    // what is not given is the policy's: max_step; a default of the program that training had: repeat
    assert_ok(om_rl_policy_task(policy, fine, 2, &other));
    assert_int_equal(other->max_step, (150 + 3) / 4);
    expect_difference(policy, other, "move_mm 2 (here 0.5), repeat 1 (here 4)");
    // trained further on the other task
    om__rl_policy_set_task(policy, other);
    expect_difference(policy, other, "");
    expect_difference(policy, task, "move_mm 0.5 (here 2), repeat 4 (here 1)");
    om_rl_task_destroy(other);
    assert_status(om_rl_policy_task(policy, unknown, 1, &other), OM_INVALID);
    assert_null(other);
    om_rl_policy_destroy(policy);
    // an old file
    OmRlPolicyDef def = om_rl_policy_default_def(task);
    def.settings[0] = def.values[0] = '\0';
    assert_ok(om_rl_policy_create(&def, &policy));
    policy = again(policy);
    assert_false(om_rl_policy_is_stated(policy));
    expect_difference(policy, task, "");
    om_rl_policy_destroy(policy);
    om_rl_task_destroy(task);
}

// World "reality" makes the fat thinner by a factor: given again, it is used once.
static void test_a_word_given_again_is_used_once(void** state) {
    (void)state;
    static const OmRlSetting reality[] = {
        {"world", "reality"}, {"tissue", "clusters"}, {"slip_n", "0"}};
    OmRlTask *task = make("retract", reality, 3), *same;
    OmRlPolicy* policy = policy_of(task);
    assert_ok(om_rl_policy_task(policy, reality, 1, &same));
    assert_true(same->hash == task->hash);
    om_rl_task_destroy(same);
    om_rl_policy_destroy(policy);
    om_rl_task_destroy(task);
}

static OmStatus create_again(void* ctx) {
    OmRlTask* task;
    OM_TRY(om_rl_policy_task(ctx, NULL, 0, &task));
    om_rl_task_destroy(task);
    return OM_OK;
}

static void test_texts_and_memory(void** state) {
    (void)state;
    char text[12] = "", path[OM_RL_SETTINGS + 8];
    assert_ok(om__rl_settings_add(text, sizeof text, "a", "1"));
    assert_ok(om__rl_settings_add(text, sizeof text, "long", "1"));  // 11 bytes and the end
    assert_status(om__rl_settings_add(text, sizeof text, "b", "2"), OM_INVALID);
    assert_string_equal(text, "a=1\nlong=1\n");
    text[4] = '\0';
    assert_status(om__rl_settings_add(text, sizeof text, "b", "2\n3"), OM_INVALID);
    memset(path, 'x', sizeof path);
    path[sizeof path - 1] = '\0';
    const OmRlSetting far[] = {{"step", path}};
    OmRlTask* task;
    assert_status(om_rl_task_create("reach", far, 1, &task), OM_INVALID);
    assert_null(task);
    const OmRlSetting step[] = {{"step", "0.1"}};
    task = make("reach", step, 1);
    OmRlPolicy* policy = policy_of(task);
    assert_true(test_failing_allocations(create_again, policy, 1) >= 2);
    om_rl_policy_destroy(policy);
    om_rl_task_destroy(task);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_same_task),
        cmocka_unit_test(test_another_task_is_named),
        cmocka_unit_test(test_a_word_given_again_is_used_once),
        cmocka_unit_test(test_texts_and_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
