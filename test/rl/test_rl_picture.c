// test_rl_picture.c: the endoscope's picture as observation, and a policy with convolutions.
#include "omentum/rl_retract.h"
#include "omentum/rl_train.h"
#include "test_alloc.h"
#include "test_folder.h"

enum { SIDE = 40, NOBS = 3 * SIDE * SIDE };

static OmRlTask* shared;  // "retract", pictures of 40 x 40, noise, moves of 2 mm

static OmRlTask* make(const char* name, const OmRlSetting* setting, int n) {
    OmRlTask* task;
    assert_ok(om_rl_task_create(name, setting, n, &task));
    return task;
}

static int setup(void** state) {
    const OmRlSetting setting[] = {{"picture", "1"},
                                   {"picture_side", "40"},
                                   {"move_mm", "2"},
                                   {"max_step", "200"},
                                   {"camera_noise", "2"}};
    shared = make("retract", setting, 5);
    return make_dir(state);
}

static int teardown(void** state) {
    om_rl_task_destroy(shared);
    return remove_dir(state);
}

static void* make_state(const OmRlTask* task) {
    void* s;
    assert_ok(task->ops->state_create(task, &s));
    return s;
}

// ---- the observation ------------------------------------------------------------------------------------

// The observation is the picture of render, over 255.
static void check_picture(const OmRlTask* task, void* s) {
    static float obs[NOBS];
    OmPicture picture = {0};
    task->ops->observe(task, s, obs);
    assert_ok(task->ops->render(task, s, &picture));
    assert_int_equal(picture.width, task->picture_width);
    assert_int_equal(picture.height, task->picture_height);
    for (int i = 0; i < NOBS; ++i) assert_near(obs[i], (float)picture.pixel[i] / 255.0f, 1e-7);
    om_picture_done(&picture);
}

// Pixels of the observation with the tumour's colour.
static int count_tumour(const OmRlTask* task, void* s) {
    static float obs[NOBS];
    OmSenseRange range = om_sense_range(OM_PART_ROI);
    int n = 0;
    task->ops->observe(task, s, obs);
    for (int i = 0; i < SIDE * SIDE; ++i) {
        double hsv[3];
        unsigned char rgb[3];
        for (int c = 0; c < 3; ++c) rgb[c] = (unsigned char)lrintf(255 * obs[3 * i + c]);
        om_sense_hsv(rgb, hsv);
        n += om_sense_range_has(&range, hsv);
    }
    return n;
}

static void run_expert(const OmRlTask* task, void* s, uint64_t seed, int nstep) {
    OmRng rng = om_rng_init(seed, 0);
    bool is_end = false;
    for (int k = 0; k < nstep && !is_end; ++k) {
        int action[OM_RL_MAX_ACTION];
        double reward;
        task->ops->expert(task, s, &rng, action);
        assert_ok(task->ops->step(task, s, action, &reward, &is_end));
    }
}

// The tumour is hidden at the start and is in the picture after the expert has lifted the fat.
static void test_retract(void** state) {
    (void)state;
    void* s = make_state(shared);
    assert_int_equal(shared->nobservation, NOBS);
    assert_int_equal(shared->picture_width, SIDE);
    assert_ok(shared->ops->reset(shared, s, om_rng_init(3, 0), 45));
    check_picture(shared, s);
    assert_int_equal(count_tumour(shared, s), 0);
    run_expert(shared, s, 4, 200);
    check_picture(shared, s);
    double value[OM_RL_MAX_INFO];
    assert_ok(shared->ops->info(shared, s, value));
    assert_true(value[0] > 0.9);
    // a disc of 8 mm seen at 40 degrees: 16 mm x 10 mm of 166 mm at this distance, 40 pixels
    int n = count_tumour(shared, s);
    print_message("%d pixels of the tumour\n", n);
    assert_in_range(n, 4, 16);
    shared->ops->state_destroy(shared, s);
}

static void test_expose(void** state) {
    (void)state;
    const OmRlSetting setting[] = {{"picture", "1"}, {"picture_side", "40"}, {"move_mm", "2"}};
    OmRlTask* task = make("expose", setting, 3);
    void* s = make_state(task);
    assert_int_equal(task->nobservation, NOBS);
    assert_ok(task->ops->reset(task, s, om_rng_init(3, 0), -1));
    check_picture(task, s);
    run_expert(task, s, 5, 30);
    check_picture(task, s);
    task->ops->state_destroy(task, s);
    om_rl_task_destroy(task);
}

// The picture is a part of the snapshot.
static void test_snapshot(void** state) {
    (void)state;
    static float first[NOBS], second[NOBS];
    void *a = make_state(shared), *b = make_state(shared);
    assert_ok(shared->ops->reset(shared, a, om_rng_init(3, 1), 40));
    run_expert(shared, a, 6, 20);
    unsigned char* block = om_alloc(shared->ops->state_size(shared), 1);
    assert_non_null(block);
    shared->ops->save(shared, a, block);
    shared->ops->restore(shared, b, block);
    shared->ops->observe(shared, a, first);
    shared->ops->observe(shared, b, second);
    assert_memory_equal(first, second, sizeof first);
    run_expert(shared, a, 7, 20);
    run_expert(shared, b, 7, 20);
    shared->ops->observe(shared, a, first);
    shared->ops->observe(shared, b, second);
    assert_memory_equal(first, second, sizeof first);
    om_free(block);
    shared->ops->state_destroy(shared, a);
    shared->ops->state_destroy(shared, b);
}

static OmStatus look_once(void* ctx) {
    OmRlTask* task = ctx;
    void* s;
    double reward;
    bool is_end;
    OM_TRY(task->ops->state_create(task, &s));
    OmStatus status = task->ops->reset(task, s, om_rng_init(3, 0), 10);
    if (status == OM_OK) status = task->ops->step(task, s, (int[3]){1, 2, 0}, &reward, &is_end);
    task->ops->state_destroy(task, s);
    return status;
}

static void test_allocations(void** state) {
    (void)state;
    int nfail = test_failing_allocations(look_once, shared, test_stride(7));
    print_message("%d allocations failed\n", nfail);
    assert_true(nfail > 2);
}

// ---- the policy -----------------------------------------------------------------------------------------

static const float* parameter(OmRlPolicy* p, const char* name) {
    const OmNet* net = om_rl_policy_net(p, OM_RL_ACTOR);
    int i = om_net_find_parameter(net, name);
    assert_true(i >= 0);
    return om_rl_policy_parameters(p, OM_RL_ACTOR) + om_net_parameter(net, i)->adr;
}

// A convolution without padding; `in` is (height x width x nin) for the picture, (nin x height x width) behind it.
static int convolve(OmRlPolicy* p, int layer, int nin, int side, int kernel, int stride, int nout,
                    const double* in, double* out) {
    char name[2][32];
    snprintf(name[0], sizeof name[0], "actor.eye%d.weight", layer);
    snprintf(name[1], sizeof name[1], "actor.eye%d.bias", layer);
    const float *w = parameter(p, name[0]), *b = parameter(p, name[1]);
    int n = (side - kernel) / stride + 1;
    for (int o = 0; o < nout; ++o)
        for (int y = 0; y < n; ++y)
            for (int x = 0; x < n; ++x) {
                double sum = b[o];
                for (int c = 0; c < nin; ++c)
                    for (int j = 0; j < kernel; ++j)
                        for (int i = 0; i < kernel; ++i) {
                            int row = y * stride + j, column = x * stride + i;
                            double v = layer == 0 ? in[(row * side + column) * nin + c]
                                                  : in[(c * side + row) * side + column];
                            // (out, in, rows, columns, colours): the picture has one channel and 3 colours
                            int at = layer == 0 ? ((o * kernel + j) * kernel + i) * nin + c
                                                : ((o * nin + c) * kernel + j) * kernel + i;
                            sum += (double)w[at] * v;
                        }
                out[(o * n + y) * n + x] = fmax(0, sum);
            }
    return n;
}

// The actor against plain loops: the most probable action, and its probability.
static void test_network(void** state) {
    (void)state;
    enum { WIDTH = 8 };
    static double a[32 * 100], b[64 * 100], c[64 * 100], in[NOBS];
    static float obs[NOBS];
    OmRlPolicyDef def = om_rl_policy_default_def(shared);
    assert_int_equal(def.picture_width, SIDE);
    def.nlayer = 1;
    def.width = WIDTH;
    OmRlPolicy* p;
    assert_ok(om_rl_policy_create(&def, &p));
    OmRng rng = om_rng_init(8, 0);
    for (int i = 0; i < NOBS; ++i) in[i] = obs[i] = (float)om_rng_uniform(&rng);
    int n = convolve(p, 0, 3, SIDE, 8, 4, 32, in, a);
    assert_int_equal(n, 9);
    n = convolve(p, 1, 32, n, 4, 2, 64, a, b);
    n = convolve(p, 2, 64, n, 3, 1, 64, b, c);
    assert_int_equal(n, 1);
    double hidden[WIDTH], log_prob = 0;
    const float *w = parameter(p, "actor.0.weight"), *bias = parameter(p, "actor.0.bias");
    for (int k = 0; k < WIDTH; ++k) {
        hidden[k] = bias[k];
        for (int i = 0; i < 64; ++i) hidden[k] += (double)w[64 * k + i] * c[i];
        hidden[k] = fmax(0, hidden[k]);
    }
    w = parameter(p, "actor.head.weight"), bias = parameter(p, "actor.head.bias");
    for (int axis = 0; axis < 3; ++axis) {
        double most = -INFINITY, sum = 0;
        for (int choice = 0; choice < 3; ++choice) {
            int o = 3 * axis + choice;
            double logit = bias[o];
            for (int k = 0; k < WIDTH; ++k) logit += (double)w[WIDTH * o + k] * hidden[k];
            most = fmax(most, logit);
            sum += exp(logit);
        }
        log_prob += most - log(sum);
    }
    OmRlActor* actor;
    int action[3];
    float got;
    assert_ok(om_rl_actor_create(p, 1, &actor));
    assert_ok(om_rl_actor_act(actor, obs, NULL, action, &got));
    print_message("log of the probability %.9f, by loops %.9f\n", (double)got, log_prob);
    assert_true(fabs(log_prob + 3 * log(3)) > 1e-5);  // the actions are not equally probable
    assert_near(got, log_prob, 1e-6);
    om_rl_actor_destroy(actor);
    om_rl_policy_destroy(p);
}

static void test_file(void** state) {
    (void)state;
    const char* path = in_dir("picture.safetensors");
    OmRlPolicy *p, *q;
    OmRlPolicyDef def = om_rl_policy_default_def(shared);
    def.width = 8;
    assert_ok(om_rl_policy_create(&def, &p));
    assert_ok(om_rl_policy_save(p, NULL, 0, path));
    assert_ok(om_rl_policy_load(path, &q));
    assert_int_equal(om_rl_policy_def(q)->picture_width, SIDE);
    assert_int_equal(om_rl_policy_def(q)->picture_height, SIDE);
    size_t n = om_net_parameter_size(om_rl_policy_net(p, OM_RL_CRITIC));
    assert_memory_equal(om_rl_policy_parameters(p, OM_RL_CRITIC),
                        om_rl_policy_parameters(q, OM_RL_CRITIC), n * sizeof(float));
    assert_ok(om_rl_policy_save_onnx(q, in_dir("picture.onnx")));
    assert_ok(om_rl_policy_check(q, shared));
    OmRlTask other = *shared;  // the same number of values, another picture
    other.picture_width = 80, other.picture_height = 20;
    assert_status(om_rl_policy_check(q, &other), OM_INVALID);
    om_rl_policy_destroy(q);
    om_rl_policy_destroy(p);
    def.picture_width = 80, def.picture_height = 20;
    assert_status(om_rl_policy_create(&def, &p), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "80 x 20"));
    def.picture_width = def.picture_height = 84;
    assert_status(om_rl_policy_create(&def, &p), OM_INVALID);
}

// ---- learning -------------------------------------------------------------------------------------------

static OmRlTrainDef small_def(const OmRlTask* task) {
    OmRlTrainDef def = om_rl_train_default_def(task, NULL);
    def.nstep = 128;
    def.nenv = 4;
    def.horizon = 16;
    def.batch = 32;
    def.nepoch = 1;
    def.policy.width = 16;
    def.nworker = 1;
    return def;
}

static int64_t count_changed(OmRlPolicy* a, OmRlPolicy* b, const char* name) {
    const OmNet* net = om_rl_policy_net(a, OM_RL_ACTOR);
    int64_t n = 0, num = om_net_parameter(net, om_net_find_parameter(net, name))->num;
    for (int64_t i = 0; i < num; ++i) n += parameter(a, name)[i] != parameter(b, name)[i];
    print_message("%s: %lld of %lld changed\n", name, (long long)n, (long long)num);
    return n;
}

// Two iterations: finite losses, every layer changes, the same bytes with two workers.
static void test_learning(void** state) {
    (void)state;
    static const char* const layer[] = {"actor.eye0.weight", "actor.eye1.bias", "actor.eye2.weight",
                                        "actor.0.bias", "actor.head.weight"};
    OmRlTrainResult result[2];
    OmRlTrainDef def = small_def(shared);
    OmRlPolicy* begin;
    assert_ok(om_rl_policy_create(&def.policy, &begin));
    for (int k = 0; k < 2; ++k) {
        def.nworker = 1 + k;
        assert_ok(om_rl_train_run(&def, NULL, &result[k]));
        assert_int_equal(result[k].nrow, 2);
        const OmRlTrainRow* row = &result[k].row[1];
        assert_true(isfinite(row->loss_policy) && isfinite(row->loss_value));
        assert_true(row->entropy > 0 && row->entropy <= 3 * log(3) + 1e-6);
    }
    for (int k = 0; k < 5; ++k) assert_true(count_changed(begin, result[0].policy, layer[k]) > 0);
    size_t n = om_net_parameter_size(om_rl_policy_net(begin, OM_RL_ACTOR));
    assert_memory_equal(om_rl_policy_parameters(result[0].policy, OM_RL_ACTOR),
                        om_rl_policy_parameters(result[1].policy, OM_RL_ACTOR), n * sizeof(float));
    om_rl_policy_destroy(begin);
    for (int k = 0; k < 2; ++k) om_rl_train_result_done(&result[k]);
}

// A small picture is read by a perceptron. Sizes out of range, and points beside a picture, are refused.
static void test_settings(void** state) {
    (void)state;
    const OmRlSetting small[] = {{"picture", "1"}, {"picture_side", "21"}};
    OmRlTask* task;
    if (test_is_slow()) {
        task = make("retract", small, 2);
        assert_int_equal(task->nobservation, 3 * 21 * 21);
        assert_int_equal(om_rl_policy_default_def(task).picture_width, 0);
        om_rl_task_destroy(task);
    }
    const struct {
        OmRlSetting setting[2];
        const char* words;
    } wrong[] = {{{{"picture", "1"}, {"picture_side", "7"}}, "picture_side is 7"},
                 {{{"picture", "1"}, {"picture_side", "8.5"}}, "whole number"},
                 {{{"picture", "1"}, {"points", "3"}}, "npoint must be 0"},
                 {{{"picture", "2"}, {"points", "0"}}, "picture is 2"}};
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; ++k) {
        assert_status(om_rl_task_create("retract", wrong[k].setting, 2, &task), OM_INVALID);
        assert_non_null(strstr(om_error_message(), wrong[k].words));
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_retract),  cmocka_slow_test(test_expose),
        cmocka_unit_test(test_snapshot), cmocka_unit_test(test_allocations),
        cmocka_unit_test(test_network),  cmocka_unit_test(test_file),
        cmocka_unit_test(test_learning), cmocka_unit_test(test_settings)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
