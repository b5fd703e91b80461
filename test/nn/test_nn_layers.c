// Every layer against plain loops in double, forward and backward, in random shapes; the loops against
// finite differences. Tolerances: a float sum of n products is off by some n^0.5 2^-24 of its parts, and
// bfloat16 keeps 8 bits of every value between layers.
#include "nn/nn_reference.h"

#define TOL_F32 2e-5   // of the largest value: sums of up to 2,000 products, Winograd not used
#define TOL_BF16 4e-2  // some roundings of 2^-9 one after the other, gradients through all layers

static int draw(OmRng* rng, int lo, int hi) {
    return lo + (int)om_rng_below(rng, (uint32_t)(hi - lo + 1));
}

static void fill(OmRng* rng, int64_t n, float* x) {
    for (int64_t i = 0; i < n; ++i) x[i] = (float)om_rng_range(rng, -1, 1);
}

// Values that no window holds twice: the largest is never in doubt, in bfloat16 neither.
static void fill_apart(OmRng* rng, int64_t n, float* x) {
    for (int64_t i = 0; i < n; ++i) x[i] = (float)((int)(i * 97 % 251) - 125) / 128;
    (void)rng;
}

// The largest difference over the largest value.
static double difference(int64_t n, const float* x, const double* ref) {
    double worst = 0, largest = 1e-3;
    for (int64_t i = 0; i < n; ++i) {
        if (!isfinite(x[i])) return INFINITY;
        worst = fmax(worst, fabs((double)x[i] - ref[i]));
        largest = fmax(largest, fabs(ref[i]));
    }
    return worst / largest;
}

typedef struct Trial {
    OmNetType type;
    OmNetLayout layout;
    int batch, nworker;
    bool is_apart;  // inputs for max pooling
    double tolerance;
} Trial;

static float* random_parameters(const OmNet* net, OmRng* rng) {
    size_t nparam = om_net_parameter_size(net);
    float* param = om_alloc(nparam, sizeof *param);
    om_net_init_parameters(net, om_rng_u32(rng), param);
    for (int i = 0; i < om_net_parameter_count(net); ++i) {  // biases and norms unlike 0 and 1
        const OmNetParameter* p = om_net_parameter(net, i);
        for (int64_t k = 0; k < p->num && !p->is_decayed; ++k)
            param[p->adr + k] += (float)om_rng_range(rng, -0.5, 0.5);
    }
    return param;
}

// Forward in inference and training, backward, against the loops. Destroys the net.
static void compare(OmNet* net, OmRng* rng, const Trial* t) {
    int64_t nin = t->batch * om_net_in_size(net), nout = t->batch * om_net_out_size(net);
    size_t nparam = om_net_parameter_size(net);
    float* param = random_parameters(net, rng);
    float *in = om_alloc((size_t)nin, 4), *out = om_alloc((size_t)nout, 4),
          *din = om_alloc((size_t)nin, 4);
    float *dout = om_alloc((size_t)nout, 4), *grad = om_alloc(nparam, 4);
    (t->is_apart ? fill_apart : fill)(rng, nin, in);
    fill(rng, nout, dout);
    for (int training = 0; training < 2; ++training) {
        OmNetRunDef def = om_net_run_default_def(t->batch);
        def.type = t->type;
        def.layout = t->layout;
        def.nworker = t->nworker;
        def.is_training = def.has_input_gradient = training;
        OmNetRun* run = NULL;
        assert_ok(om_net_run_create(net, &def, &run));
        assert_ok(om_net_run_set_parameters(run, param));
        Reference ref;
        ref_create(net, t->batch, training, param, &ref);
        for (int again = 0; again < 2; ++again) {  // what the first call left must not matter
            assert_ok(om_net_run_forward(run, in, out));
            assert_below(difference(nout, out, ref_forward(&ref, in)),
                         t->tolerance * test_tol_scale());
            if (!training) continue;
            memset(grad, 0xff, nparam * sizeof *grad);
            assert_ok(om_net_run_backward(run, dout, grad, din));
            ref_backward(&ref, dout);
            assert_below(difference(nin, din, ref.grad[0]), t->tolerance * test_tol_scale());
            for (int i = 0; i < om_net_parameter_count(net); ++i) {
                const OmNetParameter* p = om_net_parameter(net, i);
                double d = difference(p->num, grad + p->adr, ref.dparam + p->adr);
                if (!(d < t->tolerance * test_tol_scale()))
                    fail_msg("gradient by %s: %.3g of its largest", p->name, d);
            }
        }
        ref_done(&ref);
        om_net_run_destroy(run);
    }
    om_free(in);
    om_free(out);
    om_free(din);
    om_free(dout);
    om_free(grad);
    om_free(param);
    om_net_destroy(net);
}

static OmNetShape draw_shape(OmRng* rng, int most_channels, int lo, int hi) {
    OmNetShape s = {draw(rng, 1, most_channels), draw(rng, lo, hi), draw(rng, lo, hi),
                    draw(rng, lo, hi)};
    return s;
}

// Draws a network. In bfloat16 a value near zero often falls on the other side of a kink: smooth ones then.
typedef OmNet* (*MakeFn)(OmRng* rng, bool is_smooth);

static int add_activation(OmNet* net, OmRng* rng, int x, bool is_smooth) {
    OmActivation a = (OmActivation)draw(rng, is_smooth ? OM_TANH : OM_RELU, OM_SIGMOID);
    return om_net_add_activation(net, x, a, 0.2f);
}

static OmNet* finish(OmNet* net, int output) {
    OmStatus status = om_net_finish(net, output);
    if (status < 0) fail_msg("%s", om_error_message());
    return net;
}

static OmNetConv draw_conv(OmRng* rng, int max) {
    OmNetConv c = {.channels = draw(rng, 1, max), .has_bias = draw(rng, 0, 3) > 0};
    for (int k = 0; k < 3; ++k) {
        c.kernel[k] = draw(rng, 1, 3);
        c.stride[k] = draw(rng, 1, 2);
        c.padding[k] = draw(rng, 0, c.kernel[k] - 1);
    }
    return c;
}

static OmNet* make_conv(OmRng* rng, bool is_smooth) {
    OmNet* net;
    assert_ok(om_net_create(&net));
    int x = om_net_add_input(net, "in", draw_shape(rng, 20, 3, 7));
    x = om_net_add_conv(net, "a", x, draw_conv(rng, 36));
    if (draw(rng, 0, 1)) x = add_activation(net, rng, x, is_smooth);
    return finish(net, x);
}

// Where Winograd's transforms are used: whole blocks of channels, tiles that fit and that do not.
static OmNet* make_winograd(OmRng* rng, bool is_smooth) {
    (void)is_smooth;
    OmNet* net;
    assert_ok(om_net_create(&net));
    OmNetShape shape = {16 * draw(rng, 1, 2), draw(rng, 1, 3), draw(rng, 8, 11), draw(rng, 8, 11)};
    int x = om_net_add_input(net, "in", shape);
    OmNetConv conv = om_net_conv(16 * draw(rng, 1, 2), 3);
    conv.has_bias = draw(rng, 0, 1);
    x = om_net_add_conv(net, "a", x, conv);
    if (draw(rng, 0, 1))
        x = om_net_add_activation(net, x, (OmActivation)draw(rng, OM_RELU, OM_LEAKY_RELU), 0.2f);
    return finish(net, x);
}

// Small extents, for which oneDNN's gradient by the weights wants channels last.
static OmNet* make_small(OmRng* rng, bool is_smooth) {
    OmNet* net;
    assert_ok(om_net_create(&net));
    OmNetShape shape = {16 * draw(rng, 1, 2), draw(rng, 1, 2), draw(rng, 2, 3), draw(rng, 3, 4)};
    int x = om_net_add_input(net, "in", shape);
    x = om_net_add_conv(net, "a", x, om_net_conv(16 * draw(rng, 1, 2), 3));
    return finish(net, add_activation(net, rng, x, is_smooth));
}

static OmNet* make_conv_up(OmRng* rng, bool is_smooth) {
    OmNet* net;
    assert_ok(om_net_create(&net));
    int x = om_net_add_input(net, "in", draw_shape(rng, 20, 3, 5));
    OmNetConv conv = draw_conv(rng, 36);
    for (int k = 0; k < 3 && draw(rng, 0, 1);
         ++k) {  // windows side by side have a way of their own
        conv.stride[k] = conv.kernel[k];
        conv.padding[k] = 0;
        conv.channels = draw(rng, 0, 1) ? 16 : conv.channels;
    }
    x = om_net_add_conv_up(net, "a", x, conv);
    if (draw(rng, 0, 1)) x = add_activation(net, rng, x, is_smooth);
    return finish(net, x);
}

static OmNet* make_upsample(OmRng* rng, bool is_smooth) {
    (void)is_smooth;
    OmNet* net;
    assert_ok(om_net_create(&net));
    int x = om_net_add_input(net, "in", draw_shape(rng, 20, 1, 5));
    const int scale[3] = {draw(rng, 1, 3), draw(rng, 1, 3), draw(rng, 1, 3)};
    return finish(net, om_net_add_upsample(net, x, scale));
}

static OmNet* make_pool(OmRng* rng, bool is_smooth) {
    (void)is_smooth;
    OmNet* net;
    assert_ok(om_net_create(&net));
    int x = om_net_add_input(net, "in", draw_shape(rng, 20, 4, 7)), window[3][3];
    for (int k = 0; k < 3; ++k) {
        window[0][k] = draw(rng, 1, 3);
        window[1][k] = draw(rng, 1, 2);
        window[2][k] = draw(rng, 0, window[0][k] / 2);
    }
    return finish(net, om_net_add_max_pool(net, x, window[0], window[1], window[2]));
}

static OmNet* make_dense(OmRng* rng, bool is_smooth) {
    OmNet* net;
    assert_ok(om_net_create(&net));
    OmNetShape shape = draw_shape(rng, 20, 1, 3);
    if (draw(rng, 0, 1)) shape.d = shape.h = shape.w = 1;
    int x = om_net_add_input(net, "in", shape);
    if (draw(rng, 0, 1) && shape.d > 1) x = om_net_add_conv(net, "conv", x, om_net_conv(5, 1));
    x = om_net_add_dense(net, "a", x, draw(rng, 1, 40));
    x = add_activation(net, rng, x, is_smooth);
    return finish(net, om_net_add_dense(net, "b", x, draw(rng, 1, 8)));
}

static OmNet* make_norm(OmRng* rng, bool is_smooth) {
    (void)is_smooth;
    OmNet* net;
    assert_ok(om_net_create(&net));
    OmNetShape shape = draw_shape(rng, 5, 2, 3);
    shape.c *= 4;
    int x = om_net_add_input(net, "in", shape);
    x = draw(rng, 0, 1) ? om_net_add_batch_norm(net, "norm", x)
                        : om_net_add_group_norm(net, "norm", x, 1 << draw(rng, 0, 2));
    return finish(net, om_net_add_activation(net, x, OM_TANH, 0));
}

// Concatenations of odd widths, one of a tensor with itself, and a tensor read many times.
static OmNet* make_concat(OmRng* rng, bool is_smooth) {
    (void)is_smooth;
    OmNet* net;
    assert_ok(om_net_create(&net));
    OmNetShape shape = draw_shape(rng, 20, 2, 4);
    float mask[64];
    fill(rng, 64, mask);
    int x = om_net_add_input(net, "in", shape);
    int a = om_net_add_conv(net, "a", x, om_net_conv(draw(rng, 0, 1) ? 16 : draw(rng, 1, 20), 1));
    int b = om_net_add_conv(net, "b", a, om_net_conv(draw(rng, 0, 1) ? 32 : draw(rng, 1, 20), 1));
    int m = om_net_add_mask(net, b, mask);
    int c = om_net_add_concat(net, 3, (int[]){a, m, b});
    int d = om_net_add_concat(net, 2, (int[]){c, c});
    if (draw(rng, 0, 1)) d = om_net_add_conv(net, "c", d, om_net_conv(3, 1));
    return finish(net, d);
}

// Six draws meet every pair of number type and layout, and both numbers of workers; the slow run takes all.
static void try_layers(MakeFn make, bool is_apart, int most) {
    const int count = test_count(6, most);
    for (int i = 0; i < count; ++i) {
        OmRng rng = om_rng_init(7, (uint64_t)i);
        Trial t = {.type = i % 3 == 2 && has_bf16() ? OM_BF16 : OM_F32, .is_apart = is_apart};
        t.layout = (OmNetLayout)(i % 2 ? OM_LAYOUT_CHANNELS_LAST : OM_LAYOUT_AUTO);
        t.batch = 1 + i / 2 % 3;
        t.nworker = 1 + i / 3 % 2;
        t.tolerance = t.type == OM_F32 ? TOL_F32 : TOL_BF16;
        compare(make(&rng, t.type == OM_BF16), &rng, &t);
    }
}

static void test_conv(void** state) { (void)state, try_layers(make_conv, false, 24); }
static void test_winograd(void** state) {
    (void)state;
    for (int i = 0; i < test_count(2, 8); ++i) {
        OmRng rng = om_rng_init(9, (uint64_t)i);
        Trial t = {.layout = OM_LAYOUT_BLOCKED, .batch = 1 + i % 2, .nworker = 1 + i / 2 % 2};
        t.tolerance = 1e-4;  // the transforms multiply by up to 8 and subtract again
        compare(make_winograd(&rng, false), &rng, &t);
    }
}
static void test_small(void** state) { (void)state, try_layers(make_small, false, 12); }
static void test_conv_up(void** state) { (void)state, try_layers(make_conv_up, false, 24); }
static void test_upsample(void** state) { (void)state, try_layers(make_upsample, false, 18); }
static void test_pool(void** state) { (void)state, try_layers(make_pool, true, 24); }
static void test_dense(void** state) { (void)state, try_layers(make_dense, false, 24); }
static void test_norm(void** state) { (void)state, try_layers(make_norm, false, 24); }
static void test_concat(void** state) { (void)state, try_layers(make_concat, false, 24); }

// ---- the U-Net ------------------------------------------------------------------------------------------

// 12 x 4 x 20 points: below the second level 3 x 1 x 5, and nothing is even; at three levels 8 x 4 x 12 keeps two axes.
static void try_odd_unet(OmNetShape in, int nlevel, const Trial* t) {
    OmRng rng = om_rng_init(5, (uint64_t)nlevel);
    OmUnetDef def = om_unet_default_def(in, 3);
    def.nlevel = nlevel;
    def.base_channels = 4;
    def.activation = OM_LEAKY_RELU;
    OmNet* net;
    assert_ok(om_unet_create(&def, &net));
    compare(net, &rng, t);
}

static void try_unet(OmLayerKind norm, OmActivation activation, const Trial* t) {
    OmRng rng = om_rng_init(3, (uint64_t)norm);
    OmUnetDef def = om_unet_default_def((OmNetShape){3, 8, 4, 4}, 3);
    float mask[8 * 4 * 4];
    for (int i = 0; i < 128; ++i) mask[i] = (float)(i % 5 != 0);
    def.nlevel = 2;
    def.base_channels = test_count(8, 16);
    def.activation = activation;
    def.norm = norm;
    def.mask = mask;
    OmNet* net;
    assert_ok(om_unet_create(&def, &net));
    compare(net, &rng, t);
}

static void test_unet(void** state) {
    (void)state;
    if (!test_is_slow()) {
        try_unet(OM_LAYER_GROUP_NORM, OM_LEAKY_RELU,
                 &(Trial){.batch = 2, .nworker = 2, .tolerance = 1e-4});
        try_odd_unet((OmNetShape){3, 12, 4, 20}, 2,
                     &(Trial){.batch = 1, .nworker = 1, .tolerance = 1e-4});
        return;
    }
    try_unet(0, OM_LEAKY_RELU, &(Trial){.batch = 2, .nworker = 2, .tolerance = 1e-4});
    try_unet(OM_LAYER_BATCH_NORM, OM_TANH, &(Trial){.batch = 2, .nworker = 2, .tolerance = 1e-4});
    try_unet(OM_LAYER_GROUP_NORM, OM_TANH, &(Trial){.batch = 1, .nworker = 1, .tolerance = 1e-4});
    try_odd_unet((OmNetShape){3, 12, 4, 20}, 2,
                 &(Trial){.batch = 2, .nworker = 2, .tolerance = 1e-4});
    try_odd_unet((OmNetShape){3, 8, 4, 12}, 3,
                 &(Trial){.batch = 1, .nworker = 1, .tolerance = 1e-4});
    if (!has_bf16()) return;
    try_unet(0, OM_TANH, &(Trial){.batch = 1, .type = OM_BF16, .nworker = 2, .tolerance = 0.1});
}

// ---- the loops themselves -------------------------------------------------------------------------------

// dparam and grad[0] against central differences of the sum of dout * output, along random directions.
static void check_reference(MakeFn make, int index, bool is_apart) {
    OmRng rng = om_rng_init(11, (uint64_t)index);
    OmNet* net = make(&rng, true);
    int batch = 2;
    int64_t nin = batch * om_net_in_size(net), nout = batch * om_net_out_size(net);
    size_t nparam = om_net_parameter_size(net);
    float* param = random_parameters(net, &rng);
    float *in = om_alloc((size_t)nin, 4), *dout = om_alloc((size_t)nout, 4);
    (is_apart ? fill_apart : fill)(&rng, nin, in);
    fill(&rng, nout, dout);
    Reference ref;
    ref_create(net, batch, true, param, &ref);
    ref_forward(&ref, in);
    ref_backward(&ref, dout);
    for (int turn = 0; turn < 20; ++turn) {
        bool is_input = nparam == 0 || turn % 2;
        size_t at = om_rng_below(&rng, (uint32_t)(is_input ? (size_t)nin : nparam));
        float *x = is_input ? &in[at] : &param[at], old = *x;
        double exact = is_input ? ref.grad[0][at] : ref.dparam[at], sum[2];
        float side[2];
        for (int k = 0; k < 2; ++k) {
            side[k] = *x = old + (k ? 1e-3f : -1e-3f);
            const double* out = ref_forward(&ref, in);
            sum[k] = 0;
            for (int64_t i = 0; i < nout; ++i) sum[k] += (double)dout[i] * out[i];
        }
        *x = old;
        double slope = (sum[1] - sum[0]) / ((double)side[1] - (double)side[0]);
        assert_near(slope, exact, 2e-4 * (1 + fabs(exact)));  // third derivatives times 1e-6 / 6
    }
    ref_done(&ref);
    om_free(in);
    om_free(dout);
    om_free(param);
    om_net_destroy(net);
}

static void test_reference(void** state) {
    (void)state;
    for (int i = 0; i < test_count(1, 4); ++i) {
        check_reference(make_conv_up, i, false);
        check_reference(make_upsample, i, false);
        check_reference(make_pool, i, true);
        check_reference(make_norm, i, false);
        check_reference(make_concat, i, false);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_conv),      cmocka_unit_test(test_winograd),
        cmocka_unit_test(test_small),     cmocka_unit_test(test_conv_up),
        cmocka_unit_test(test_upsample),  cmocka_unit_test(test_pool),
        cmocka_unit_test(test_dense),     cmocka_unit_test(test_norm),
        cmocka_unit_test(test_concat),    cmocka_unit_test(test_unet),
        cmocka_unit_test(test_reference),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
