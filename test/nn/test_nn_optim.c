// test_nn_optim.c: Adam, AdamW and the schedules against the formulas of the papers, in double.
#include <sys/wait.h>

#include "omentum/nn_train.h"
#include "test_alloc.h"

// Two layers, with a batch norm between: entries that decay, entries that do not, running statistics.
static OmNet* small_net(int width) {
    OmNet* net;
    assert_ok(om_net_create(&net));
    int x = om_net_add_input(net, "input", (OmNetShape){3, 1, 1, 1});
    x = om_net_add_dense(net, "first", x, width);
    x = om_net_add_batch_norm(net, "norm", x);
    x = om_net_add_dense(net, "second", x, 2);
    assert_ok(om_net_finish(net, x));
    return net;
}

static void draw_gradient(const OmNet* net, uint64_t step, double size, float* grad) {
    OmRng rng = om_rng_init(11, step);
    for (int i = 0; i < om_net_parameter_count(net); ++i) {
        const OmNetParameter* p = om_net_parameter(net, i);
        for (int64_t k = p->adr; k < p->adr + p->num; ++k)
            grad[k] = p->is_trained ? (float)(size * om_rng_normal(&rng)) : 0;
    }
}

typedef struct Reference {  // the same in double
    double param[64], m[64], v[64], mean[64];
} Reference;

static void reference_step(const OmOptimDef* d, const OmNet* net, double rate, const float* grad,
                           int t, Reference* r) {
    double length = 0;
    for (size_t k = 0; k < om_net_parameter_size(net); ++k)
        length += (double)grad[k] * (double)grad[k];
    length = sqrt(length);
    double scale = d->clip_norm > 0 && length > d->clip_norm ? d->clip_norm / length : 1;
    double keep = fmin(d->average, (double)t / (9 + t));
    for (int i = 0; i < om_net_parameter_count(net); ++i) {
        const OmNetParameter* p = om_net_parameter(net, i);
        double decay = p->is_decayed ? d->weight_decay : 0;
        for (int64_t k = p->adr; k < p->adr + p->num && p->is_trained; ++k) {
            double g = scale * (double)grad[k];
            if (d->kind == OM_OPTIM_ADAM) g += decay * r->param[k];
            r->m[k] = d->beta1 * r->m[k] + (1 - d->beta1) * g;
            r->v[k] = d->beta2 * r->v[k] + (1 - d->beta2) * g * g;
            double m = r->m[k] / (1 - pow(d->beta1, t)), v = r->v[k] / (1 - pow(d->beta2, t));
            if (d->kind == OM_OPTIM_ADAMW) r->param[k] -= rate * decay * r->param[k];
            r->param[k] -= rate * m / (sqrt(v) + d->epsilon);
            r->mean[k] = t == 1 ? r->param[k] : keep * r->mean[k] + (1 - keep) * r->param[k];
        }
    }
}

static void compare_with_reference(OmOptimDef def) {
    OmNet* net = small_net(4);
    size_t n = om_net_parameter_size(net);
    assert_true(n <= 64);
    OmOptim* optim;
    Reference r = {0};
    float param[64], start[64], grad[64], mean[64];
    om_net_init_parameters(net, 3, param);
    memcpy(start, param, sizeof param);
    for (size_t k = 0; k < n; ++k) r.param[k] = (double)param[k];
    assert_ok(om_optim_create(&def, net, &optim));
    for (int t = 1; t <= 300; ++t) {
        double rate = 0.01 * (1 + cos(t * 0.01)), norm, length = 0;
        draw_gradient(net, (uint64_t)t, t < 100 ? 1 : 0.1, grad);
        for (size_t k = 0; k < n; ++k) length += (double)grad[k] * (double)grad[k];
        reference_step(&def, net, rate, grad, t, &r);
        assert_ok(om_optim_step(optim, rate, grad, param, &norm));
        assert_near_rel(norm, sqrt(length), 1e-14);
    }
    om_optim_get_average(optim, param, mean);
    for (int i = 0; i < om_net_parameter_count(net); ++i) {
        const OmNetParameter* p = om_net_parameter(net, i);
        for (int64_t k = p->adr; k < p->adr + p->num; ++k) {
            // 300 steps of 0.01, each rounded in float: 300 (2^-24 + 0.01 of a few 2^-24) at most, in practice a tenth
            if (p->is_trained) assert_near((double)param[k], r.param[k], 1e-5);
            if (!p->is_trained) assert_true(param[k] == start[k] && mean[k] == start[k]);
            if (p->is_trained && def.average > 0) assert_near((double)mean[k], r.mean[k], 1e-5);
            if (def.average <= 0) assert_true(mean[k] == param[k]);
        }
    }
    om_optim_destroy(optim);
    om_net_destroy(net);
}

static void test_adam(void** state) {
    (void)state;
    OmOptimDef def = om_optim_default_def();
    def.kind = OM_OPTIM_ADAM;
    def.weight_decay = 0;
    compare_with_reference(def);
    def.weight_decay = 0.1;
    def.beta1 = 0.5;
    compare_with_reference(def);
}

static void test_adamw(void** state) {
    (void)state;
    OmOptimDef def = om_optim_default_def();
    compare_with_reference(def);
    def.weight_decay = 0.5;
    def.beta2 = 0.99;
    def.epsilon = 1e-3;
    compare_with_reference(def);
}

static void test_clipping_and_average(void** state) {
    (void)state;
    OmOptimDef def = om_optim_default_def();
    def.clip_norm = 0.5;
    def.average = 0.95;
    def.nworker = 2;
    compare_with_reference(def);
}

// The same steps by PyTorch, where python3 (or OM_PYTHON) has it: optimisers, clipping and one cycle.
static void test_pytorch(void** state) {
    (void)state;
    enum { NSTEP = 40, N = 16 };
    const struct {
        OmOptimKind kind;
        double decay, clip;
    } one[] = {{OM_OPTIM_ADAM, 0.1, 0}, {OM_OPTIM_ADAMW, 0.5, 0}, {OM_OPTIM_ADAMW, 0.01, 0.5}};
    const char* python = getenv("OM_PYTHON");
    char command[512];
    double theirs[3][N];
    snprintf(command, sizeof command, "%s test/nn/run_torch.py", python ? python : "python3");
    FILE* pipe = popen(command, "r");
    assert_non_null(pipe);
    int nread = 0;
    while (nread < 3 * N && fscanf(pipe, "%lf", &theirs[nread / N][nread % N]) == 1) ++nread;
    char rest[256];
    while (fgets(rest, sizeof rest, pipe)) continue;  // so that it never writes to a closed pipe
    int code = pclose(pipe);
    if (WIFEXITED(code) && WEXITSTATUS(code) == SKIP_TEST_CODE)
        test_skip("PyTorch is not importable by %s", python ? python : "python3");
    assert_int_equal(nread, 3 * N);
    OmNet* net;
    assert_ok(om_net_create(&net));
    int x = om_net_add_input(net, "input", (OmNetShape){3, 1, 1, 1});
    assert_ok(om_net_finish(net, om_net_add_dense(net, "only", x, 4)));
    assert_int_equal(om_net_parameter_size(net), N);
    OmSchedule schedule = om_schedule_one_cycle(0.1);
    for (int i = 0; i < 3; ++i) {
        OmOptimDef def = om_optim_default_def();
        OmOptim* optim;
        float param[N], grad[N];
        def.kind = one[i].kind;
        def.weight_decay = one[i].decay;
        def.clip_norm = one[i].clip;
        assert_ok(om_optim_create(&def, net, &optim));
        for (int k = 0; k < N; ++k) param[k] = (float)cos(k);
        for (int t = 0; t < NSTEP; ++t) {
            for (int k = 0; k < N; ++k) grad[k] = (float)(sin(1.7 * t + 2.3 * k) * (1 + 0.1 * k));
            assert_ok(
                om_optim_step(optim, om_schedule_rate(&schedule, t, NSTEP), grad, param, NULL));
        }
        // 40 steps rounded in float on both sides; theirs clips to norm / (norm + 1e-6)
        for (int k = 0; k < N; ++k) assert_near((double)param[k], theirs[i][k], 4e-6);
        om_optim_destroy(optim);
    }
    om_net_destroy(net);
}

// A first step of Adam has the length of the rate, whatever the gradient's.
static void test_first_step(void** state) {
    (void)state;
    OmNet* net = small_net(4);
    OmOptimDef def = om_optim_default_def();
    OmOptim* optim;
    float param[64], start[64], grad[64];
    def.weight_decay = 0;
    om_net_init_parameters(net, 3, param);
    memcpy(start, param, sizeof param);
    draw_gradient(net, 1, 1e3, grad);
    assert_ok(om_optim_create(&def, net, &optim));
    assert_ok(om_optim_step(optim, 0.01, grad, param, NULL));
    for (int64_t k = 0; k < om_net_parameter(net, 0)->num; ++k)
        assert_near((double)start[k] - (double)param[k], grad[k] > 0 ? 0.01 : -0.01, 1e-6);
    om_optim_destroy(optim);
    om_net_destroy(net);
}

// Saved in the middle and continued by another object: the same bytes.
static void test_save_and_restore(void** state) {
    (void)state;
    OmNet* net = small_net(4);
    size_t n = om_net_parameter_size(net);
    for (int k = 0; k < 2; ++k) {
        OmOptimDef def = om_optim_default_def();
        OmOptim *a, *b;
        float param[64], other[64], grad[64], value[3 * 64];
        int64_t step;
        def.average = k ? 0.9 : 0;
        om_net_init_parameters(net, 3, param);
        assert_ok(om_optim_create(&def, net, &a));
        assert_ok(om_optim_create(&def, net, &b));
        assert_int_equal(om_optim_size(a), (k ? 3 : 2) * n);
        for (uint64_t t = 0; t < 20; ++t) {
            if (t == 7) {
                om_optim_save(a, &step, value);
                assert_int_equal(step, 7);
                memcpy(other, param, sizeof other);
                assert_ok(om_optim_restore(b, step, value));
                value[1] = NAN;
                assert_status(om_optim_restore(b, step, value), OM_INVALID);
                assert_status(om_optim_restore(b, -1, value), OM_INVALID);
            }
            draw_gradient(net, t, 1, grad);
            assert_ok(om_optim_step(a, 0.01, grad, param, NULL));
            if (t >= 7) assert_ok(om_optim_step(b, 0.01, grad, other, NULL));
        }
        assert_memory_equal(param, other, n * sizeof *param);
        om_optim_get_average(a, param, grad);
        om_optim_get_average(b, other, value);
        assert_memory_equal(grad, value, n * sizeof *param);
        om_optim_destroy(a);
        om_optim_destroy(b);
    }
    om_net_destroy(net);
}

static void test_gradient_not_finite(void** state) {
    (void)state;
    OmNet* net = small_net(4);
    OmOptimDef def = om_optim_default_def();
    OmOptim* optim;
    float param[64], start[64], grad[64];
    om_net_init_parameters(net, 3, param);
    memcpy(start, param, sizeof param);
    draw_gradient(net, 1, 1, grad);
    grad[2] = NAN;
    assert_ok(om_optim_create(&def, net, &optim));
    assert_status(om_optim_step(optim, 0.01, grad, param, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "step 1: the gradient is not finite"));
    assert_memory_equal(param, start, sizeof param);
    om_optim_destroy(optim);
    om_net_destroy(net);
}

static void test_any_worker_count(void** state) {
    (void)state;
    OmNet* net = small_net(20000);
    size_t n = om_net_parameter_size(net);
    float* grad = om_alloc(n, sizeof *grad);
    float* param[2] = {om_alloc(n, sizeof(float)), om_alloc(n, sizeof(float))};
    for (int run = 0; run < 2; ++run) {
        OmOptimDef def = om_optim_default_def();
        OmOptim* optim;
        def.clip_norm = 1;
        def.average = 0.9;
        def.nworker = run == 0 ? 1 : 5;
        om_net_init_parameters(net, 3, param[run]);
        assert_ok(om_optim_create(&def, net, &optim));
        for (uint64_t t = 0; t < 5; ++t) {
            draw_gradient(net, t, 1, grad);
            assert_ok(om_optim_step(optim, 0.01, grad, param[run], NULL));
        }
        om_optim_get_average(optim, param[run], grad);
        memcpy(param[run], grad, n * sizeof *grad);
        om_optim_destroy(optim);
    }
    assert_memory_equal(param[0], param[1], n * sizeof(float));
    om_free(grad);
    om_free(param[0]);
    om_free(param[1]);
    om_net_destroy(net);
}

static void test_refused(void** state) {
    (void)state;
    OmNet* net = small_net(4);
    OmOptim* optim;
    OmOptimDef bad[7];
    for (int i = 0; i < 7; ++i) bad[i] = om_optim_default_def();
    bad[0].beta1 = 1;
    bad[1].beta2 = -0.1;
    bad[2].epsilon = 0;
    bad[3].weight_decay = -1;
    bad[4].clip_norm = INFINITY;
    bad[5].average = 1;
    bad[6].cookie = 0;
    const char* names[7] = {"beta1",     "beta2",   "epsilon",    "weight_decay",
                            "clip_norm", "average", "default_def"};
    for (int i = 0; i < 7; ++i) {
        assert_status(om_optim_create(&bad[i], net, &optim), OM_INVALID);
        assert_non_null(strstr(om_error_message(), names[i]));
        assert_null(optim);
    }
    om_net_destroy(net);
}

static OmStatus create(void* net) {
    OmOptimDef def = om_optim_default_def();
    OmOptim* optim;
    def.average = 0.9;
    OmStatus status = om_optim_create(&def, net, &optim);
    om_optim_destroy(optim);
    return status;
}

static void test_no_memory(void** state) {
    (void)state;
    OmNet* net = small_net(4);
    assert_true(test_failing_allocations(create, net, 1) >= 4);
    om_net_destroy(net);
}

// ---- schedules ------------------------------------------------------------------------------------------

// torch.optim.lr_scheduler.OneCycleLR(max_lr=0.1, total_steps=10), by its formula: 0.004 up to 0.1 in steps 0 to 2,
// down to 0.004 / 10^4 in steps 2 to 9, each by half a cosine.
static void test_one_cycle(void** state) {
    (void)state;
    OmSchedule s = om_schedule_one_cycle(0.1);
    const double pi = acos(-1.0);
    for (int step = 0; step < 10; ++step) {
        double expected = step <= 2 ? 0.1 + (0.004 - 0.1) / 2 * (1 + cos(pi * step / 2))
                                    : 4e-7 + (0.1 - 4e-7) / 2 * (1 + cos(pi * (step - 2) / 7));
        assert_near_rel(om_schedule_rate(&s, step, 10), expected, 1e-12);
    }
}

static void test_cosine(void** state) {
    (void)state;
    OmSchedule s = om_schedule_cosine(2, 0.1);
    for (int step = 0; step < 10; ++step)  // the first of 100 steps is a tenth of the way up
        assert_near_rel(om_schedule_rate(&s, step, 100), 2 * (step + 1) / 10.0, 1e-14);
    assert_near_rel(om_schedule_rate(&s, 10, 100), 2, 1e-15);
    assert_near(om_schedule_rate(&s, 99, 100), 0, 1e-15);
    double before = 3;
    for (int step = 10; step < 100; ++step) {
        double rate = om_schedule_rate(&s, step, 100);
        assert_below(rate, before);
        // the midpoint has the mean of points at equal distances from it
        assert_near(rate + om_schedule_rate(&s, 109 - step, 100), 2, 1e-14);
        before = rate;
    }
    s = om_schedule_constant(0.3);
    assert_near(om_schedule_rate(&s, 0, 100), 0.3, 0);
    assert_near(om_schedule_rate(&s, 99, 100), 0.3, 0);
    s = om_schedule_one_cycle(0.1);
    for (int nstep = 1; nstep < 6; ++nstep)  // too short for a cycle, but numbers
        for (int step = 0; step < nstep; ++step) {
            double rate = om_schedule_rate(&s, step, nstep);
            assert_true(rate > 0 && rate <= 0.1);
        }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_adam),
        cmocka_unit_test(test_adamw),
        cmocka_unit_test(test_clipping_and_average),
        cmocka_unit_test(test_pytorch),
        cmocka_unit_test(test_first_step),
        cmocka_unit_test(test_save_and_restore),
        cmocka_unit_test(test_gradient_not_finite),
        cmocka_unit_test(test_any_worker_count),
        cmocka_unit_test(test_refused),
        cmocka_unit_test(test_no_memory),
        cmocka_unit_test(test_one_cycle),
        cmocka_unit_test(test_cosine),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
