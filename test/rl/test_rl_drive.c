// test_rl_drive.c: one environment that a person drives: keys, episodes, demonstrations.
#include "omentum/rl_drive.h"
#include "point_task.h"
#include "test_alloc.h"

static OmRlTask* task_of(const char* name, const char* key, const char* value) {
    OmRlTask* task;
    OmRlSetting setting = {key, value};
    assert_ok(om_rl_task_create(name, &setting, key ? 1 : 0, &task));
    return task;
}

static OmRlDrive* drive_of(const OmRlTask* task, uint64_t seed) {
    OmRlDrive* drive;
    assert_ok(om_rl_drive_create(task, seed, &drive));
    return drive;
}

// A key of each direction moves the tip along its axis and no other; arrows and letters agree.
static void test_keys_of_a_tip(void** state) {
    (void)state;
    static const struct {
        const char* letters;
        int key, axis, sign;
    } way[6] = {{"wi", OM_RL_KEY_UP, 0, 1},      {"sk", OM_RL_KEY_DOWN, 0, -1},
                {"aj", OM_RL_KEY_LEFT, 1, 1},    {"dl", OM_RL_KEY_RIGHT, 1, -1},
                {"eo", OM_RL_KEY_PAGE_UP, 2, 1}, {"cm", OM_RL_KEY_PAGE_DOWN, 2, -1}};
    OmRlTask* task = task_of("retract", NULL, NULL);
    void* s;
    assert_ok(task->ops->state_create(task, &s));
    for (int k = 0; k < 18; ++k) {
        int key = k < 6 ? way[k].key : way[k % 6].letters[k / 6 - 1];
        int action[OM_RL_MAX_ACTION] = {2, 2, 2};
        double before[3], after[3], reward;
        bool is_end;
        assert_ok(task->ops->reset(task, s, om_rng_init(1, 0), 24));
        task->ops->tip(task, s, before);
        om_rl_task_rest(task, action);
        assert_true(om_rl_task_press(task, key, action));
        assert_ok(task->ops->step(task, s, action, &reward, &is_end));
        task->ops->tip(task, s, after);
        for (int a = 0; a < 3; ++a)
            assert_near(after[a] - before[a], a == way[k % 6].axis ? 0.0005 * way[k % 6].sign : 0,
                        1e-12);
    }
    int action[OM_RL_MAX_ACTION] = {0};
    assert_false(om_rl_task_press(task, 'g', action));  // no gripper
    assert_false(om_rl_task_press(task, 'q', action));
    task->ops->state_destroy(task, s);
    om_rl_task_destroy(task);
}

// A gripper keeps its last choice, and so does the push of the cart; a hand of "expose" moves its own arm.
static void test_keys_of_others(void** state) {
    (void)state;
    OmRlTask* task = task_of("retract", "gripper", "1");
    int action[OM_RL_MAX_ACTION] = {0};
    assert_true(om_rl_task_press(task, 'g', action));
    assert_true(om_rl_task_press(task, 'w', action));
    om_rl_task_rest(task, action);
    assert_true(action[0] == 0 && action[3] == 1);
    assert_true(om_rl_task_press(task, 'b', action));
    assert_int_equal(action[3], 0);
    om_rl_task_destroy(task);
    task = task_of("cart-pole", NULL, NULL);
    assert_true(om_rl_task_press(task, 'd', action));
    om_rl_task_rest(task, action);
    assert_int_equal(action[0], 1);
    om_rl_task_destroy(task);
    task = task_of("reach", NULL, NULL);
    om_rl_task_rest(task, action);
    assert_true(action[0] == 1 && action[1] == 1 && action[2] == 1);
    om_rl_task_destroy(task);
    task = task_of("expose", NULL, NULL);
    const int right[6] = {2, 0, 0, 0, 0, 0}, left[6] = {0, 0, 0, 2, 0, 0};
    om_rl_task_rest(task, action);
    assert_true(om_rl_task_press(task, OM_RL_KEY_UP, action));
    assert_memory_equal(action, right, sizeof right);
    om_rl_task_rest(task, action);
    assert_true(om_rl_task_press(task, 'w', action));
    assert_memory_equal(action, left, sizeof left);
    om_rl_task_destroy(task);
    task = task_of("press", NULL, NULL);
    const int here[4] = {0, 0, 0, 1};
    om_rl_task_rest(task, action);
    assert_true(om_rl_task_press(task, 'x', action));
    assert_memory_equal(action, here, sizeof here);
    om_rl_task_rest(task, action);
    assert_int_equal(action[3], 0);
    om_rl_task_destroy(task);
}

// The observations and rewards of a drive are those of a vector from the same start; what is kept is what was done.
static void test_episode_and_keep(void** state) {
    (void)state;
    enum { NSTEP = 9 };
    OmRlTask* task = task_of("reach", NULL, NULL);
    OmRlVecDef def = om_rl_vec_default_def(task);
    OmRlVec* vec;
    OmRlDrive* drive = drive_of(task, 1);
    OmRlDemos demos = {0}, read;
    float obs[NSTEP + 1][7];
    double reward[NSTEP], sum = 0;
    int action[NSTEP][OM_RL_MAX_ACTION];
    def.nenv = 1;
    assert_ok(om_rl_vec_create(&def, &vec));
    assert_ok(om_rl_vec_reset_one(vec, 0, 5, obs[0]));
    assert_ok(om_rl_drive_reset(drive, 5));
    for (int t = 0; t < NSTEP; ++t) {
        om_rl_task_rest(task, action[t]);
        om_rl_task_press(task, "wdecas"[t % 6], action[t]);
        assert_ok(
            om_rl_vec_step(vec, action[t], &(OmRlStep){.obs = obs[t + 1], .reward = &reward[t]}));
        assert_ok(om_rl_drive_step(drive, action[t]));
        sum += reward[t];
    }
    assert_int_equal(om_rl_drive_now(drive)->nstep, NSTEP);
    assert_near(om_rl_drive_now(drive)->sum, sum, 1e-15);
    assert_ok(om_rl_drive_keep(drive, &demos));
    assert_ok(om_rl_drive_reset(drive, 6));  // an episode that is dropped
    assert_ok(om_rl_drive_step(drive, action[0]));
    assert_ok(om_rl_drive_reset(drive, 5));
    assert_status(om_rl_drive_keep(drive, &demos), OM_INVALID);  // no step
    for (int t = 0; t < 3; ++t) assert_ok(om_rl_drive_step(drive, action[t]));
    assert_ok(om_rl_drive_keep(drive, &demos));
    assert_ok(om_rl_demos_check(&demos, task));
    assert_true(demos.ndemo == 2 && demos.nstep == NSTEP + 3);
    assert_true(demos.adr[0] == 0 && demos.adr[1] == NSTEP && demos.adr[2] == NSTEP + 3);
    for (int i = 0; i < demos.nstep; ++i) {
        int t = i < NSTEP ? i : i - NSTEP;
        assert_memory_equal(demos.obs + 7 * (size_t)i, obs[t], sizeof obs[t]);
        assert_memory_equal(demos.action + 3 * (size_t)i, action[t], 3 * sizeof(int));
        assert_near(demos.reward[i], reward[t], 0);
    }
    assert_near(demos.score[0], 0, 0);  // not reached

    char path[] = "/tmp/test_rl_drive_XXXXXX";
    close(mkstemp(path));
    remove(path);
    assert_ok(om_rl_demos_save(&demos, path));
    assert_ok(om_rl_demos_load(path, &read));
    assert_true(read.ndemo == 2 && read.nstep == demos.nstep);
    assert_memory_equal(read.action, demos.action, 3 * (size_t)demos.nstep * sizeof(int));
    om_rl_demos_done(&read);
    remove(path);

    // demonstrations of another task are not changed
    OmRlTask* other = task_of("cart-pole", NULL, NULL);
    OmRlDrive* cart = drive_of(other, 1);
    assert_ok(om_rl_drive_reset(cart, -1));
    assert_ok(om_rl_drive_step(cart, (int[1]){1}));
    assert_status(om_rl_drive_keep(cart, &demos), OM_INVALID);
    assert_int_equal(demos.ndemo, 2);
    om_rl_drive_destroy(cart);
    om_rl_task_destroy(other);
    om_rl_demos_done(&demos);
    om_rl_drive_destroy(drive);
    om_rl_vec_destroy(vec);
    om_rl_task_destroy(task);
}

// Ends: by the task, by the limit; refused calls change nothing; episode k depends on seed and k alone.
static void test_ends(void** state) {
    (void)state;
    OmRlTask* task = task_of("cart-pole", NULL, NULL);
    OmRlDrive *drive = drive_of(task, 3), *again = drive_of(task, 3);
    const OmRlDriveNow* now = om_rl_drive_now(drive);
    OmPicture picture = {0};
    const int right = 1, wrong = 2;
    assert_status(om_rl_drive_step(drive, &right), OM_INVALID);
    assert_status(om_rl_drive_reset(drive, 0), OM_INVALID);  // it has no starts
    assert_ok(om_rl_drive_reset(drive, -1));
    assert_status(om_rl_drive_step(drive, &wrong), OM_INVALID);
    assert_true(now->nstep == 0 && now->episode == 0);
    while (!now->is_over) assert_ok(om_rl_drive_step(drive, &right));
    assert_true(now->is_terminated && now->nstep > 5 && now->nstep < 15);
    assert_near(now->sum, now->nstep, 0);
    assert_status(om_rl_drive_step(drive, &right), OM_INVALID);
    double score = 0;
    assert_ok(om_rl_drive_info(drive, NULL, &score));  // no infos
    assert_near(score, now->sum, 0);
    assert_ok(om_rl_drive_render(drive, &picture));
    assert_int_equal(picture.width, 84);
    om_picture_done(&picture);

    // a dropped episode counts, its steps do not matter
    OmRlDemos a = {0}, b = {0};
    assert_ok(om_rl_drive_reset(drive, -1));
    assert_ok(om_rl_drive_step(drive, &right));
    assert_ok(om_rl_drive_keep(drive, &a));
    assert_ok(om_rl_drive_reset(again, -1));
    assert_ok(om_rl_drive_reset(again, -1));
    assert_ok(om_rl_drive_step(again, &right));
    assert_ok(om_rl_drive_keep(again, &b));
    assert_memory_equal(a.obs, b.obs, 4 * sizeof *a.obs);
    om_rl_demos_done(&a);
    om_rl_demos_done(&b);
    om_rl_drive_destroy(drive);
    om_rl_drive_destroy(again);
    om_rl_task_destroy(task);

    PointTask point = point_task(0.001, 300, false);  // more steps than the first block of memory
    drive = drive_of(&point.head, 1);
    now = om_rl_drive_now(drive);
    assert_status(om_rl_drive_render(drive, &picture), OM_UNAVAILABLE);
    assert_ok(om_rl_drive_reset(drive, -1));
    while (!now->is_over) assert_ok(om_rl_drive_step(drive, (int[3]){0, 2, 1}));
    assert_true(now->nstep == 300 && !now->is_terminated);
    assert_ok(om_rl_drive_keep(drive, &a));
    for (int i = 0; i < 100; ++i) assert_near((double)a.obs[3 * i + 1], 0.001 * i, 1e-8);
    om_rl_demos_done(&a);
    om_rl_drive_destroy(drive);
}

static OmStatus drive_and_keep(void* ctx) {
    OmRlDrive* drive = NULL;
    OmRlDemos demos = {0};
    OmStatus status;
    OM_TRY_DONE(om_rl_drive_create(ctx, 1, &drive));
    for (int e = 0; e < 2; ++e) {
        OM_TRY_DONE(om_rl_drive_reset(drive, -1));
        for (int t = 0; t < 300; ++t) OM_TRY_DONE(om_rl_drive_step(drive, (int[3]){0, 2, 1}));
        OM_TRY_DONE(om_rl_drive_keep(drive, &demos));
    }
done:
    om_rl_demos_done(&demos);
    om_rl_drive_destroy(drive);
    return status;
}

static void test_memory(void** state) {
    (void)state;
    PointTask point = point_task(0.001, 400, false);
    assert_true(test_failing_allocations(drive_and_keep, &point.head, 1) > 15);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_keys_of_a_tip),    cmocka_unit_test(test_keys_of_others),
        cmocka_unit_test(test_episode_and_keep), cmocka_unit_test(test_ends),
        cmocka_unit_test(test_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
