// The description of a network, what it refuses, and runs: memory, determinism, dropout, running statistics.
#include "test_alloc.h"
#include "test_common.h"

#include "nn/nn_internal.h"
#include "nn/nn_reference.h"

static OmNetShape shape(int c, int d, int h, int w) {
    OmNetShape s = {c, d, h, w};
    return s;
}

static OmNet* create(OmNetShape in, int* x) {
    OmNet* net;
    assert_ok(om_net_create(&net));
    *x = om_net_add_input(net, "in", in);
    return net;
}

// ---- descriptions ---------------------------------------------------------------------------------------

static void test_unet(void** state) {
    (void)state;
    OmUnetDef def = om_unet_default_def(shape(3, 32, 24, 16), 3);
    OmNet *net, *same, *other;
    assert_ok(om_unet_create(&def, &net));
    assert_int_equal(om_net_parameter_size(net), 1401459);  // as counted by hand, level by level
    const OmNetParameter* p = om_net_parameter(net, om_net_find_parameter(net, "dec1.up.weight"));
    assert_non_null(p);
    const int dim[5] = {64, 32, 2, 2, 2};  // in, out
    assert_memory_equal(p->dim, dim, sizeof dim);
    p = om_net_parameter(net, om_net_find_parameter(net, "dec0.conv1.weight"));
    assert_int_equal(p->dim[1], 32);  // 16 skipped, 16 risen
    assert_int_equal(om_net_find_parameter(net, "dec0.conv1"), -1);
    int64_t at = 0;
    for (int i = 0; i < om_net_parameter_count(net); ++i) {
        p = om_net_parameter(net, i);
        assert_int_equal(p->adr, at);
        at += p->num;
        assert_int_equal(p->is_decayed, p->ndim > 1);
    }
    assert_int_equal(at, om_net_parameter_size(net));
    assert_int_equal(om_net_in_size(net), 3 * 32 * 24 * 16);
    assert_int_equal(om_net_out_size(net), 3 * 32 * 24 * 16);
    // The bottom of the thesis: 1,024 channels of 4 x 3 x 2.
    def.base_channels = 128;
    assert_ok(om_unet_create(&def, &other));
    p = om_net_parameter(other, om_net_find_parameter(other, "bottom.conv2.weight"));
    assert_int_equal(p->dim[0], 1024);
    def.base_channels = 16;
    assert_ok(om_unet_create(&def, &same));
    assert_true(om_net_hash(net) == om_net_hash(same));
    assert_true(om_net_hash(net) != om_net_hash(other));
    om_net_destroy(net);
    om_net_destroy(same);
    om_net_destroy(other);
}

// The type that is picked can be run here; only where /proc/cpuinfo names AMD and avx512_bf16 is it bfloat16.
static void test_fast_type(void** state) {
    (void)state;
    OmNetType type = om_net_fast_type();
    OmUnetDef def = om_unet_default_def(shape(3, 8, 8, 8), 3);
    OmNet* net;
    OmNetRun* run;
    assert_ok(om_unet_create(&def, &net));
    OmNetRunDef run_def = om_net_run_default_def(1);
    run_def.type = type;
    assert_ok(om_net_run_create(net, &run_def, &run));
    om_net_run_destroy(run);
    om_net_destroy(net);
    FILE* file = fopen("/proc/cpuinfo", "r");
    if (!file) return;
    bool is_amd = false, has_bf16 = false;
    char line[8192];
    while (fgets(line, sizeof line, file)) {
        is_amd |= strstr(line, "AuthenticAMD") != NULL;
        has_bf16 |= strstr(line, "avx512_bf16") != NULL;
    }
    fclose(file);
    assert_int_equal(type == OM_BF16, is_amd && has_bf16);
}

static void test_initialisation(void** state) {
    (void)state;
    int x;
    OmNet* net = create(shape(16, 8, 8, 8), &x);
    x = om_net_add_conv(net, "a", x, om_net_conv(32, 3));
    x = om_net_add_batch_norm(net, "norm", x);
    x = om_net_add_activation(net, x, OM_RELU, 0);
    x = om_net_add_dense(net, "b", x, 4);
    assert_ok(om_net_finish(net, x));
    size_t n = om_net_parameter_size(net);
    float *p = om_alloc(n, 4), *q = om_alloc(n, 4);
    om_net_init_parameters(net, 5, p);
    om_net_init_parameters(net, 5, q);
    assert_memory_equal(p, q, n * 4);
    om_net_init_parameters(net, 6, q);
    assert_memory_not_equal(p, q, n * 4);
    // He: variance 2 / (16 27) before a ReLU, through the norm; 1 / (32 512) where nothing follows.
    const struct {
        const char* name;
        double variance;
    } row[] = {{"a.weight", 2.0 / 432}, {"b.weight", 1.0 / 16384}};
    for (int k = 0; k < 2; ++k) {
        const OmNetParameter* e = om_net_parameter(net, om_net_find_parameter(net, row[k].name));
        double sum = 0;
        for (int64_t i = 0; i < e->num; ++i) sum += (double)p[e->adr + i] * (double)p[e->adr + i];
        assert_near_rel(sum / (double)e->num, row[k].variance, 0.03);  // 13,824 draws and more
    }
    const OmNetParameter* var =
        om_net_parameter(net, om_net_find_parameter(net, "norm.running_var"));
    assert_false(var->is_trained);
    assert_true(p[var->adr] == 1);
    om_free(p);
    om_free(q);
    om_net_destroy(net);
}

// ---- refusals -------------------------------------------------------------------------------------------

// The net's failure says `part`; destroys it.
static void assert_refused(OmNet* net, int x, const char* part) {
    assert_status(om_net_finish(net, x), OM_INVALID);
    if (!strstr(om_error_message(), part))
        fail_msg("\"%s\" does not say \"%s\"", om_error_message(), part);
    om_net_destroy(net);
}

static void test_refused_layers(void** state) {
    (void)state;
    const int two[3] = {2, 2, 2}, zero[3] = {0}, three[3] = {3, 3, 3};
    const float mask[8] = {NAN};
    int x;
    OmNet* net = create(shape(3, 2, 2, 2), &x);
    x = om_net_add_conv(net, "wide", x, om_net_conv_strided(4, 5, 1, 1));
    assert_int_equal(x, -1);
    x = om_net_add_activation(net, x, OM_RELU, 0);  // nothing more is said
    assert_refused(net, x, "layer wide: its kernel of 5 is larger than the padded input of 4");
    net = create(shape(3, 2, 2, 2), &x);
    assert_refused(net, om_net_add_conv(net, "a", x, om_net_conv(0, 3)), "layer a: 0 channels");
    net = create(shape(3, 2, 2, 2), &x);
    assert_refused(net, om_net_add_conv(net, "a", x, om_net_conv_strided(2, 3, 0, 1)), "stride 0");
    net = create(shape(3, 2, 2, 2), &x);
    assert_refused(net, om_net_add_conv(net, "a", x, om_net_conv_strided(2, 3, 1, 3)), "padding 3");
    net = create(shape(3, 2, 2, 2), &x);
    assert_refused(net, om_net_add_conv(net, "in", x, om_net_conv(2, 1)), "already a layer");
    net = create(shape(3, 2, 2, 2), &x);
    assert_refused(net, om_net_add_conv(net, "a b", x, om_net_conv(2, 1)), "\"a b\"");
    net = create(shape(3, 2, 2, 2), &x);
    assert_refused(net, om_net_add_conv(net, "a", 7, om_net_conv(2, 1)), "input 7");
    net = create(shape(3, 2, 2, 2), &x);
    assert_refused(net, om_net_add_group_norm(net, "g", x, 2), "2 groups do not divide 3 channels");
    net = create(shape(3, 2, 2, 2), &x);
    assert_refused(net, om_net_add_group_norm(net, "g", x, 0), "groups");
    net = create(shape(3, 2, 2, 2), &x);
    assert_refused(net, om_net_add_max_pool(net, x, three, two, zero), "layer max_pool_1");
    net = create(shape(3, 2, 2, 2), &x);
    assert_refused(net, om_net_add_dropout(net, x, 1), "rate 1");
    net = create(shape(3, 2, 2, 2), &x);
    assert_refused(net, om_net_add_mask(net, x, mask), "value 0 is not finite");
    net = create(shape(3, 2, 2, 2), &x);
    assert_refused(net, om_net_add_activation(net, x, OM_LEAKY_RELU, 2), "slope 2");
    net = create(shape(3, 2, 2, 2), &x);
    assert_refused(net, om_net_add_input(net, "again", shape(1, 1, 1, 1)), "the only one");
    net = create(shape(3, 0, 2, 2), &x);
    assert_refused(net, x, "0 depth");
    net = create(shape(30000, 300, 300, 300), &x);
    assert_refused(net, x, "2^31");
    net = create(shape(3, 4, 4, 4), &x);
    int y = om_net_add_max_pool(net, x, two, two, zero);
    assert_refused(net, om_net_add_concat(net, 2, (int[]){x, y}),
                   "in is 4 x 4 x 4, but max_pool_1 is 2 x 2 x 2");
    net = create(shape(3, 4, 4, 4), &x);
    y = om_net_add_conv(net, "lost", x, om_net_conv(2, 1));
    assert_refused(net, om_net_add_conv(net, "a", x, om_net_conv(2, 1)), "layer lost");
    net = create(shape(3, 4, 4, 4), &x);
    assert_refused(net, 5, "output 5");
}

static void test_refused_unets(void** state) {
    (void)state;
    OmNet* net;
    OmUnetDef def = om_unet_default_def(shape(3, 30, 24, 16), 3), zero = {0};
    assert_status(om_unet_create(&def, &net), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "depth 30 is no multiple of 4: pad the grid to 32"));
    assert_null(net);
    def = om_unet_default_def(shape(3, 4, 12, 4), 3);
    assert_status(om_unet_create(&def, &net), OM_INVALID);
    assert_non_null(
        strstr(om_error_message(), "4 x 12 x 4 is halved at most 2 times, nlevel is 3"));
    assert_null(net);
    assert_status(om_unet_create(&zero, &net), OM_INVALID);
    def = om_unet_default_def(shape(3, 32, 24, 16), 0);
    assert_status(om_unet_create(&def, &net), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "layer head"));
    def = om_unet_default_def(shape(3, 32, 24, 16), 3);
    def.norm = OM_LAYER_GROUP_NORM;
    def.ngroup = 5;
    assert_status(om_unet_create(&def, &net), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "layer enc0.norm1"));
}

static void test_refused_runs(void** state) {
    (void)state;
    int x;
    float in[8] = {0}, out[8], grad[8];
    OmNetRun* run;
    OmNet* net = create(shape(1, 2, 2, 2), &x);
    OmNetRunDef def = om_net_run_default_def(1), raw = {.batch = 1};
    assert_status(om_net_run_create(net, &def, &run), OM_INVALID);  // not finished
    x = om_net_add_conv(net, "a", x, om_net_conv(1, 1));
    assert_ok(om_net_finish(net, x));
    assert_int_equal(om_net_add_conv(net, "late", x, om_net_conv(1, 1)), -1);
    assert_status(om_net_run_create(net, &raw, &run), OM_INVALID);
    def.batch = 0;
    assert_status(om_net_run_create(net, &def, &run), OM_INVALID);
    def = om_net_run_default_def(1 << 30);
    assert_status(om_net_run_create(net, &def, &run), OM_INVALID);
    assert_null(run);
    def = om_net_run_default_def(1);
    assert_ok(om_net_run_create(net, &def, &run));
    assert_status(om_net_run_forward(run, in, out), OM_INVALID);  // no parameters
    assert_ok(om_net_run_set_parameters(run, in));
    assert_ok(om_net_run_forward(run, in, out));
    assert_status(om_net_run_backward(run, out, grad, NULL), OM_INVALID);  // not for training
    om_net_run_destroy(run);
    def.is_training = true;
    assert_ok(om_net_run_create(net, &def, &run));
    assert_ok(om_net_run_set_parameters(run, in));
    assert_status(om_net_run_backward(run, out, grad, NULL), OM_INVALID);  // no forward
    assert_ok(om_net_run_forward(run, in, out));
    assert_status(om_net_run_backward(run, out, grad, in), OM_INVALID);  // din not planned for
    assert_ok(om_net_run_backward(run, out, grad, NULL));
    om_net_run_destroy(run);
    om_net_run_destroy(NULL);
    om_net_destroy(net);
}

// ---- runs -----------------------------------------------------------------------------------------------

// A small net with one layer of each kind; every allocation of the description and of a step may fail.
static OmStatus create_all_kinds(OmNet** out) {
    const int two[3] = {2, 2, 2}, zero[3] = {0};
    float mask[64];
    for (int i = 0; i < 64; ++i) mask[i] = (float)(i % 3);
    OmNet* net;
    OM_TRY(om_net_create(&net));
    int in = om_net_add_input(net, "in", shape(3, 4, 4, 4));
    int a = om_net_add_conv(net, "a", in, om_net_conv(16, 3));
    int x = om_net_add_activation(net, a, OM_LEAKY_RELU, 0.1f);
    x = om_net_add_batch_norm(net, "batch", x);
    x = om_net_add_max_pool(net, x, two, two, zero);
    x = om_net_add_dropout(net, x, 0.3f);
    int up = om_net_add_conv_up(net, "up", x, om_net_conv_strided(16, 2, 2, 0));
    x = om_net_add_upsample(net, x, two);
    x = om_net_add_concat(net, 3, (int[]){a, x, up});
    x = om_net_add_group_norm(net, "group", x, 4);
    x = om_net_add_mask(net, x, mask);
    x = om_net_add_dense(net, "dense", x, 5);
    x = om_net_add_activation(net, x, OM_TANH, 0);
    OmStatus status = om_net_finish(net, x);
    if (status < 0) {
        om_net_destroy(net);
        return status;
    }
    *out = net;
    return OM_OK;
}

static OmStatus create_and_step(void* ctx) {
    const OmNetRunDef* def = ctx;
    OmNet* net = NULL;
    OmNetRun* run = NULL;
    float *param = NULL, *grad = NULL, in[2 * 192] = {0}, out[2 * 5], din[2 * 192];
    OmStatus status = create_all_kinds(&net);
    if (status < 0) return status;
    OM_ALLOC_DONE(param, om_net_parameter_size(net));
    OM_ALLOC_DONE(grad, om_net_parameter_size(net));
    om_net_init_parameters(net, 1, param);
    OM_TRY_DONE(om_net_run_create(net, def, &run));
    OM_TRY_DONE(om_net_run_set_parameters(run, param));
    int64_t count = om_alloc_count();
    OM_TRY_DONE(om_net_run_forward(run, in, out));
    if (def->is_training) OM_TRY_DONE(om_net_run_backward(run, out, grad, din));
    assert_int_equal(om_alloc_count(), count);  // a step takes no memory
done:
    om_net_run_destroy(run);
    om_net_destroy(net);
    om_free(param);
    om_free(grad);
    return status;
}

static void test_allocations(void** state) {
    (void)state;
    OmNetRunDef def = om_net_run_default_def(2);
    def.nworker = 1;
    assert_true(test_failing_allocations(create_and_step, &def, 1) > 30);
    def.is_training = def.has_input_gradient = true;
    assert_true(test_failing_allocations(create_and_step, &def, 1) > 50);
}

typedef struct Step {
    OmNet* net;
    float *param, *in, *out, *dout, *grad;
    size_t nin, nout, nparam;
    OmNetRunDef def;
} Step;

static void step_create(OmNet* net, int batch, Step* s) {
    *s = (Step){.net = net, .def = om_net_run_default_def(batch)};
    s->nin = (size_t)(batch * om_net_in_size(net));
    s->nout = (size_t)(batch * om_net_out_size(net));
    s->nparam = om_net_parameter_size(net);
    s->param = om_alloc(s->nparam, 4);
    s->grad = om_calloc(s->nparam, 4);
    s->in = om_alloc(s->nin, 4);
    s->out = om_calloc(s->nout, 4);
    s->dout = om_alloc(s->nout, 4);
    om_net_init_parameters(net, 1, s->param);
    OmRng rng = om_rng_init(2, 3);
    for (size_t i = 0; i < s->nin; ++i) s->in[i] = (float)om_rng_normal(&rng);
    for (size_t i = 0; i < s->nout; ++i) s->dout[i] = (float)om_rng_normal(&rng);
}

static void step_done(Step* s) {
    om_free(s->param);
    om_free(s->grad);
    om_free(s->in);
    om_free(s->out);
    om_free(s->dout);
    om_net_destroy(s->net);
}

static uint64_t step_hash(Step* s) {
    OmNetRun* run;
    assert_ok(om_net_run_create(s->net, &s->def, &run));
    assert_ok(om_net_run_set_parameters(run, s->param));
    assert_ok(om_net_run_forward(run, s->in, s->out));
    if (s->def.is_training) assert_ok(om_net_run_backward(run, s->dout, s->grad, NULL));
    om_net_run_destroy(run);
    return om_hash(s->grad, s->nparam * 4, om_hash(s->out, s->nout * 4, OM_HASH_SEED));
}

// The same bytes again at a fixed number of workers; the same values within rounding at another.
static void test_determinism(void** state) {
    (void)state;
    OmUnetDef def = om_unet_default_def(shape(3, 16, 8, 8), 3);
    def.norm = OM_LAYER_GROUP_NORM;
    def.dropout = 0.2f;
    OmNet* net;
    assert_ok(om_unet_create(&def, &net));
    Step s;
    step_create(net, 3, &s);
    s.def.is_training = true;
    for (int type = 0; type < (has_bf16() ? 2 : 1); ++type) {
        s.def.type = type ? OM_BF16 : OM_F32;
        float* one = om_alloc(s.nout, 4);
        for (int nworker = 1; nworker <= 2; ++nworker) {
            s.def.nworker = nworker;
            uint64_t first = step_hash(&s);
            assert_true(first == step_hash(&s));
            if (nworker == 1) memcpy(one, s.out, s.nout * 4);
        }
        for (size_t i = 0; i < s.nout; ++i)  // other blocking, other order of sums
            assert_near((double)s.out[i], (double)one[i], type ? 0.1 : 1e-4);
        om_free(one);
    }
    step_done(&s);
}

// Values are dropped as often as asked, kept ones grow, backward drops the same; a batch may be split.
static void test_dropout(void** state) {
    (void)state;
    const float rate = 0.3f;
    int x;
    OmNet* net = create(shape(20, 5, 4, 6), &x);
    x = om_net_add_dropout(net, x, rate);
    assert_ok(om_net_finish(net, x));
    Step s;
    step_create(net, 4, &s);
    s.def.is_training = s.def.has_input_gradient = true;
    OmNetRun* run;
    assert_ok(om_net_run_create(net, &s.def, &run));
    assert_ok(om_net_run_set_parameters(run, s.param));
    om_net_run_set_step(run, 9, 0);
    assert_ok(om_net_run_forward(run, s.in, s.out));
    float *din = om_alloc(s.nin, 4), *part = om_alloc(s.nout, 4);
    assert_ok(om_net_run_backward(run, s.dout, s.grad, din));
    size_t ndropped = 0;
    for (size_t i = 0; i < s.nin; ++i) {
        ndropped += s.out[i] == 0;
        float scale = s.out[i] == 0 ? 0 : 1 / (1 - rate);
        assert_near((double)s.out[i], (double)(scale * s.in[i]), 1e-6);
        assert_near((double)din[i], (double)(scale * s.dout[i]), 1e-6);
    }
    double n = (double)s.nin, sigma = sqrt(n * (double)rate * (1 - (double)rate));
    assert_near((double)ndropped, n * (double)rate, 5 * sigma);
    om_net_run_set_step(run, 10, 0);
    assert_ok(om_net_run_forward(run, s.in, part));
    assert_memory_not_equal(part, s.out, s.nout * 4);
    om_net_run_destroy(run);
    // The second half of the batch by another run.
    s.def.batch = 2;
    s.def.layout = OM_LAYOUT_BLOCKED;
    assert_ok(om_net_run_create(net, &s.def, &run));
    assert_ok(om_net_run_set_parameters(run, s.param));
    om_net_run_set_step(run, 9, 2);
    assert_ok(om_net_run_forward(run, s.in + s.nin / 2, part));
    assert_memory_equal(part, s.out + s.nout / 2, s.nout / 2 * 4);
    om_net_run_destroy(run);
    om_free(din);
    om_free(part);
    step_done(&s);
}

// Two channels of known mean and variance.
static void test_statistics(void** state) {
    (void)state;
    int x;
    OmNet* net = create(shape(2, 1, 1, 4), &x);
    x = om_net_add_batch_norm(net, "n", x);
    assert_ok(om_net_finish(net, x));
    Step s;
    step_create(net, 1, &s);
    const float in[8] = {1, 2, 3, 4, 10, 10, 10, 10};
    memcpy(s.in, in, sizeof in);
    s.def.is_training = true;
    OmNetRun* run;
    assert_ok(om_net_run_create(net, &s.def, &run));
    assert_ok(om_net_run_set_parameters(run, s.param));
    assert_ok(om_net_run_forward(run, s.in, s.out));
    om_net_run_update_statistics(run, s.param);
    const float* mean =
        s.param + om_net_parameter(net, om_net_find_parameter(net, "n.running_mean"))->adr;
    const float* var =
        s.param + om_net_parameter(net, om_net_find_parameter(net, "n.running_var"))->adr;
    assert_near((double)mean[0], 0.25, 1e-7);                  // 0.9 x 0 + 0.1 x 2.5
    assert_near((double)mean[1], 1, 1e-7);                     //
    assert_near((double)var[0], 0.9 + 0.1 * 5.0 / 3.0, 1e-6);  // of n - 1
    assert_near((double)var[1], 0.9, 1e-6);
    assert_near((double)s.out[0], -1.5 / sqrt(1.25 + 1e-5), 1e-6);
    assert_near((double)s.out[4], 0, 1e-3);  // 10 less 10, times 1 / sqrt(1e-5), in float
    om_net_run_destroy(run);
    s.def.is_training = false;  // what was learnt is used, not the batch
    assert_ok(om_net_run_create(net, &s.def, &run));
    assert_ok(om_net_run_set_parameters(run, s.param));
    assert_ok(om_net_run_forward(run, s.in, s.out));
    assert_near((double)s.out[0], 0.75 / sqrt((double)var[0] + 1e-5), 1e-6);
    om_net_run_destroy(run);
    step_done(&s);
}

// Convolution commutes with shifts: an impulse moved by two cells moves the answer by two.
static void test_shift(void** state) {
    (void)state;
    int x;
    OmNet* net = create(shape(2, 10, 10, 10), &x);
    x = om_net_add_conv(net, "a", x, om_net_conv(16, 3));
    x = om_net_add_activation(net, x, OM_RELU, 0);
    x = om_net_add_conv(net, "b", x, om_net_conv(1, 3));
    assert_ok(om_net_finish(net, x));
    Step s;
    step_create(net, 1, &s);
    memset(s.in, 0, s.nin * 4);
    OmNetRun* run;
    assert_ok(om_net_run_create(net, &s.def, &run));
    assert_ok(om_net_run_set_parameters(run, s.param));
    float* moved = om_alloc(s.nout, 4);
    s.in[4 * 100 + 4 * 10 + 4] = 1;
    assert_ok(om_net_run_forward(run, s.in, s.out));
    s.in[4 * 100 + 4 * 10 + 4] = 0;
    s.in[4 * 100 + 4 * 10 + 6] = 1;
    assert_ok(om_net_run_forward(run, s.in, moved));
    for (int d = 2; d < 8; ++d)
        for (int h = 2; h < 8; ++h)
            for (int w = 2; w < 6; ++w)
                assert_near((double)moved[d * 100 + h * 10 + w + 2],
                            (double)s.out[d * 100 + h * 10 + w], 1e-6);
    om_free(moved);
    om_net_run_destroy(run);
    step_done(&s);
}

// Memory of inference is planned: a deep chain needs that of two tensors, not of all.
static void test_memory(void** state) {
    (void)state;
    size_t size[2];
    for (int k = 0; k < 2; ++k) {
        int x;
        OmNet* net = create(shape(16, 16, 16, 16), &x);
        for (int i = 0; i < (k ? 20 : 3); ++i) {
            char name[16];
            snprintf(name, sizeof name, "c%d", i);
            x = om_net_add_conv(net, name, x, om_net_conv(16, 1));
        }
        assert_ok(om_net_finish(net, x));
        OmNetRunDef def = om_net_run_default_def(1);
        def.nworker = 1;
        OmNetRun* run;
        assert_ok(om_net_run_create(net, &def, &run));
        size[k] = run->memory_size;
        assert_true(om_net_run_memory(run) > run->memory_size);
        om_net_run_destroy(run);
        om_net_destroy(net);
    }
    assert_true(size[1] == size[0]);
}

// Random lives: nothing that lives together overlaps, and what never does shares.
static void test_plan(void** state) {
    (void)state;
    OmRng rng = om_rng_init(1, 1);
    for (int turn = 0; turn < 50; ++turn) {
        OmPiece piece[40];
        size_t size, max = 0;
        for (int i = 0; i < 40; ++i) {
            int begin = (int)om_rng_below(&rng, 50);
            piece[i] =
                (OmPiece){om_rng_below(&rng, 5000), begin, begin + (int)om_rng_below(&rng, 6), 0};
        }
        assert_ok(om__plan_pieces(40, piece, &size));
        for (int i = 0; i < 40; ++i) {
            assert_true(piece[i].at % 64 == 0 && piece[i].at + piece[i].bytes <= size);
            for (int k = 0; k < i; ++k) {
                bool together = piece[i].begin <= piece[k].end && piece[k].begin <= piece[i].end;
                bool apart = piece[i].at + piece[i].bytes <= piece[k].at ||
                             piece[k].at + piece[k].bytes <= piece[i].at;
                assert_true(!together || apart);
            }
        }
        for (int step = 0; step < 56; ++step) {
            size_t alive = 0;
            for (int i = 0; i < 40; ++i)
                if (piece[i].begin <= step && step <= piece[i].end)
                    alive += (piece[i].bytes + 63) / 64 * 64;
            max = alive > max ? alive : max;
        }
        assert_true((double)size <= 1.5 * (double)max);
    }
}

// No layer of a U-Net falls back to oneDNN's reference code, a hundred times slower: grids of all proportions.
static void test_fast_kernels(void** state) {
    (void)state;
    if (om__engine_block(OM_F32) != 16 || !has_bf16()) return;  // said of AVX-512 only
    const OmNetShape grid[] = {
        {3, 32, 24, 16}, {3, 16, 24, 32}, {3, 16, 16, 16}, {3, 24, 32, 8}, {3, 8, 32, 24}};
    for (int k = 0; k < 5; ++k)
        for (int turn = 0; turn < 4; ++turn) {
            OmUnetDef unet = om_unet_default_def(grid[k], 3);
            OmNet* net;
            assert_ok(om_unet_create(&unet, &net));
            OmNetRunDef def = om_net_run_default_def(turn % 2 ? 4 : 1);
            def.type = turn / 2 ? OM_BF16 : OM_F32;
            def.is_training = turn % 2;
            def.nworker = 1;
            OmNetRun* run;
            assert_ok(om_net_run_create(net, &def, &run));
            for (int i = 0; i < run->nop; ++i) {
                const OmOp* op = &run->op[i];
                const OmKernel* all[] = {op->forward, op->data, op->weights};
                for (int pass = 0; pass < 3; ++pass)
                    if (strncmp(om__kernel_name(all[pass]), "ref", 3) == 0)
                        fail_msg("%s on %d x %d x %d, type %d, pass %d: %s", op->layer->name,
                                 grid[k].d, grid[k].h, grid[k].w, (int)def.type, pass,
                                 om__kernel_name(all[pass]));
            }
            om_net_run_destroy(run);
            om_net_destroy(net);
        }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_unet),           cmocka_unit_test(test_initialisation),
        cmocka_unit_test(test_refused_layers), cmocka_unit_test(test_refused_unets),
        cmocka_unit_test(test_refused_runs),   cmocka_unit_test(test_allocations),
        cmocka_unit_test(test_determinism),    cmocka_unit_test(test_dropout),
        cmocka_unit_test(test_statistics),     cmocka_unit_test(test_shift),
        cmocka_unit_test(test_memory),         cmocka_unit_test(test_fast_kernels),
        cmocka_unit_test(test_plan),           cmocka_unit_test(test_fast_type),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
