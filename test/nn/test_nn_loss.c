// test_nn_loss.c: losses against their formulas in plain loops, and their derivatives against differences.
#include "omentum/nn_train.h"
#include "test_common.h"

enum { NSAMPLE = 3, NCHANNEL = 2, NCELL = 24, N = NSAMPLE * NCHANNEL * NCELL };
static const OmNetShape shape = {NCHANNEL, 2, 3, 4};

static void draw(uint64_t seed, bool is_share, int n, float* out) {
    OmRng rng = om_rng_init(seed, 0);
    for (int i = 0; i < n; ++i)
        out[i] = (float)(is_share ? om_rng_uniform(&rng) : om_rng_normal(&rng));
}

static double share(double y) { return 1 / (1 + exp(-y)); }

// |grad (y - t)| of cell v of sample s.
static double plain_slope(const float* weight, const float* y, const float* t, int s, int v) {
    const int extent[3] = {shape.w, shape.h, shape.d}, step[3] = {1, shape.w, shape.w * shape.h};
    double square = 0;
    for (int axis = 0; axis < 3; ++axis) {
        bool is_last = v / step[axis] % extent[axis] == extent[axis] - 1;
        if (is_last || (weight && weight[v + step[axis]] == 0)) continue;
        for (int c = 0; c < NCHANNEL; ++c) {
            int i = (s * NCHANNEL + c) * NCELL + v, k = i + step[axis];
            double d = (double)y[k] - (double)t[k] - ((double)y[i] - (double)t[i]);
            square += d * d;
        }
    }
    return sqrt(square);
}

// The formulas of the header, one after the other.
static double plain(OmLossKind kind, const float* weight, const float* y, const float* t) {
    double sum = 0, total = 0;
    for (int s = 0; s < NSAMPLE; ++s)
        for (int v = 0; v < NCELL; ++v) {
            double w = weight ? (double)weight[v] : 1, square = 0, entropy = 0;
            for (int c = 0; c < NCHANNEL; ++c) {
                int i = (s * NCHANNEL + c) * NCELL + v;
                double yi = (double)y[i], ti = (double)t[i];
                square += (yi - ti) * (yi - ti);
                entropy -= ti * log(share(yi)) + (1 - ti) * log(1 - share(yi));
            }
            total += w;
            if (kind == OM_LOSS_MSE) sum += w * square / NCHANNEL;
            if (kind == OM_LOSS_NORM) sum += w * sqrt(square);
            if (kind == OM_LOSS_SLOPE) sum += w * plain_slope(weight, y, t, s, v);
            if (kind == OM_LOSS_BCE) sum += w * entropy / NCHANNEL;
        }
    if (kind != OM_LOSS_DICE) return sum / total;
    for (int plane = 0; plane < NSAMPLE * NCHANNEL; ++plane) {
        double both = 0, either = 0;
        for (int v = 0; v < NCELL; ++v) {
            double w = weight ? (double)weight[v] : 1;
            double p = share((double)y[plane * NCELL + v]), ti = (double)t[plane * NCELL + v];
            both += w * p * ti;
            either += w * (p + ti);
        }
        sum += 1 - (2 * both + 1) / (either + 1);
    }
    return sum / (NSAMPLE * NCHANNEL);
}

static void test_formulas(void** state) {
    (void)state;
    float y[N], t[N], weight[NCELL];
    draw(1, false, N, y);
    draw(2, true, N, t);
    draw(3, true, NCELL, weight);
    weight[5] = 0;
    for (int kind = 0; kind < OM_LOSS_NKIND; ++kind)
        for (int weighted = 0; weighted < 2; ++weighted) {
            OmLoss loss = om_loss((OmLossKind)kind);
            double value;
            loss.weight = weighted ? weight : NULL;
            assert_ok(om_loss_eval(&loss, NSAMPLE, shape, y, t, 1, &value, NULL));
            assert_near_rel(value, plain(loss.term[0].kind, loss.weight, y, t),
                            1e-13);  // sums in double
        }
    // A sum of all.
    OmLoss sum = {.nterm = OM_LOSS_NKIND, .weight = weight};
    double value, expected = 0;
    for (int kind = 0; kind < OM_LOSS_NKIND; ++kind) {
        sum.term[kind].kind = (OmLossKind)kind;
        sum.term[kind].scale = kind + 0.5;
        expected += (kind + 0.5) * plain((OmLossKind)kind, weight, y, t);
    }
    assert_ok(om_loss_eval(&sum, NSAMPLE, shape, y, t, 1, &value, NULL));
    assert_near_rel(value, expected, 1e-13);
}

// A weight is a sample's share of the mean over samples.
static void test_sample_weights(void** state) {
    (void)state;
    float y[N], t[N];
    const float weight[NSAMPLE] = {2, 0, 0.5F};
    draw(11, false, N, y);
    draw(12, true, N, t);
    for (int kind = 0; kind < OM_LOSS_NKIND; ++kind) {
        OmLoss loss = om_loss((OmLossKind)kind);
        double value, expected = 0;
        for (int s = 0; s < NSAMPLE; ++s) {
            int at = s * NCHANNEL * NCELL;
            assert_ok(om_loss_eval(&loss, 1, shape, y + at, t + at, 1, &value, NULL));
            expected += (double)weight[s] * value / NSAMPLE;
        }
        loss.sample_weight = weight;
        assert_ok(om_loss_eval(&loss, NSAMPLE, shape, y, t, 1, &value, NULL));
        assert_near_rel(value, expected, 1e-13);
    }
}

// Cells of samples with weights of their own: the mean over samples, each with its weights as those of all cells.
static void test_cell_weights(void** state) {
    (void)state;
    float y[N], t[N], weight[NSAMPLE * NCELL];
    draw(13, false, N, y);
    draw(14, true, N, t);
    draw(15, true, NSAMPLE * NCELL, weight);
    weight[3] = weight[NCELL + 7] = 0;
    for (int kind = 0; kind < OM_LOSS_NKIND; ++kind) {
        OmLoss loss = om_loss((OmLossKind)kind);
        double value, expected = 0;
        for (int s = 0; s < NSAMPLE; ++s) {
            int at = s * NCHANNEL * NCELL;
            loss.weight = weight + s * NCELL;
            assert_ok(om_loss_eval(&loss, 1, shape, y + at, t + at, 1, &value, NULL));
            expected += (s + 1) * value / NSAMPLE;
        }
        loss.weight = NULL;
        loss.cell_weight = weight;
        loss.sample_weight = (const float[]){1, 2, 3};
        assert_ok(om_loss_eval(&loss, NSAMPLE, shape, y, t, 1, &value, NULL));
        assert_near_rel(value, expected, 1e-13);
    }
    // A sample without weights adds nothing to a mean over cells, and its outputs may be anything.
    OmLoss loss = om_loss(OM_LOSS_BCE);
    double all, part;
    loss.weight = weight;
    assert_ok(om_loss_eval(&loss, 1, shape, y, t, 1, &part, NULL));
    loss.weight = NULL;
    memset(weight + NCELL, 0, 2 * NCELL * sizeof *weight);
    y[NCHANNEL * NCELL] = INFINITY;
    loss.cell_weight = weight;
    assert_ok(om_loss_eval(&loss, NSAMPLE, shape, y, t, 1, &all, NULL));
    assert_near_rel(all, part / NSAMPLE, 1e-13);
}

static void check_derivative(const OmLoss* loss, float* y, const float* t) {
    float dy[N];
    double value;
    assert_ok(om_loss_eval(loss, NSAMPLE, shape, y, t, 1, &value, dy));
    for (int i = 0; i < N; ++i) {
        double up, down;
        float at = y[i], above = at + 1e-3F, below = at - 1e-3F;
        y[i] = above;
        assert_ok(om_loss_eval(loss, NSAMPLE, shape, y, t, 1, &up, NULL));
        y[i] = below;
        assert_ok(om_loss_eval(loss, NSAMPLE, shape, y, t, 1, &down, NULL));
        y[i] = at;
        // The curvature's part is h^2 / 6 of a third derivative of about 1 / (samples channels cells); a norm near 0
        // bends more. dy itself is a float.
        double slope = (up - down) / ((double)above - (double)below);
        assert_near(slope * N, (double)dy[i] * N, 2e-5 * (1 + fabs(slope) * N));
    }
}

static void test_derivatives(void** state) {
    (void)state;
    float y[N], t[N], weight[NCELL], cell_weight[NSAMPLE * NCELL];
    draw(16, true, NSAMPLE * NCELL, cell_weight);
    draw(4, false, N, y);
    draw(5, true, N, t);
    draw(6, true, NCELL, weight);
    for (int kind = 0; kind < OM_LOSS_NKIND; ++kind) {
        OmLoss loss = om_loss((OmLossKind)kind);
        check_derivative(&loss, y, t);
        loss.weight = weight;
        loss.term[0].scale = 3;
        check_derivative(&loss, y, t);
        loss.sample_weight = (const float[]){2, 0, 0.5F};
        check_derivative(&loss, y, t);
        loss.weight = NULL;
        loss.cell_weight = cell_weight;
        check_derivative(&loss, y, t);
    }
    OmLoss both = {.nterm = 2, .term = {{OM_LOSS_DICE, 1}, {OM_LOSS_BCE, 0.5}}, .weight = weight};
    check_derivative(&both, y, t);
}

static void test_known_values(void** state) {
    (void)state;
    const OmNetShape one = {1, 1, 1, 2};
    float y[2] = {80, -80}, t[2] = {1, 0}, dy[2];
    double value;
    OmLoss dice = om_loss(OM_LOSS_DICE), bce = om_loss(OM_LOSS_BCE), norm = om_loss(OM_LOSS_NORM);
    // Sure and right, sure and wrong, and nothing where nothing is.
    assert_ok(om_loss_eval(&dice, 1, one, y, t, 1, &value, dy));
    assert_near(value, 0, 1e-15);
    assert_ok(om_loss_eval(&bce, 1, one, y, t, 1, &value, dy));
    assert_near(value, 0, 1e-15);
    y[0] = -2000, y[1] = 2000;  // exp overflows here
    assert_ok(om_loss_eval(&bce, 1, one, y, t, 1, &value, dy));
    assert_near(value, 2000, 0);
    assert_near((double)dy[0], -0.5, 0);
    assert_near((double)dy[1], 0.5, 0);
    y[1] = -2000, t[0] = 0;
    assert_ok(om_loss_eval(&dice, 1, one, y, t, 1, &value, dy));
    assert_near(value, 0, 0);
    // |(3, 4)| is 5, and where nothing differs the norm is flat
    const OmNetShape pair = {2, 1, 1, 1};
    float a[2] = {3, 4}, b[2] = {0, 0};
    assert_ok(om_loss_eval(&norm, 1, pair, a, b, 1, &value, dy));
    assert_near(value, 5, 1e-15 * 5);
    assert_near((double)dy[0], 0.6, 6e-8);  // half a unit in the last place of a float
    assert_ok(om_loss_eval(&norm, 1, pair, b, b, 1, &value, dy));
    assert_near(value, 0, 1e-11);
    assert_near((double)dy[0], 0, 0);
}

static void test_any_worker_count(void** state) {
    (void)state;
    const OmNetShape large = {3, 16, 24, 17};
    const int n = 4 * 3 * 16 * 24 * 17;
    float* y = om_alloc((size_t)n, sizeof *y);
    float* t = om_alloc((size_t)n, sizeof *t);
    float* dy[2] = {om_alloc((size_t)n, sizeof **dy), om_alloc((size_t)n, sizeof **dy)};
    draw(7, false, n, y);
    draw(8, true, n, t);
    OmLoss all = {
        .nterm = 4,
        .term = {{OM_LOSS_MSE, 1}, {OM_LOSS_NORM, 1}, {OM_LOSS_DICE, 1}, {OM_LOSS_BCE, 1}}};
    double value[2];
    assert_ok(om_loss_eval(&all, 4, large, y, t, 1, &value[0], dy[0]));
    for (int nworker = 2; nworker <= 8; nworker += 3) {
        assert_ok(om_loss_eval(&all, 4, large, y, t, nworker, &value[1], dy[1]));
        assert_memory_equal(&value[0], &value[1], sizeof value[0]);
        assert_memory_equal(dy[0], dy[1], (size_t)n * sizeof **dy);
    }
    om_free(y);
    om_free(t);
    om_free(dy[0]);
    om_free(dy[1]);
}

static void test_refused(void** state) {
    (void)state;
    float y[N] = {0}, weight[NCELL] = {0};
    double value;
    OmLoss loss = om_loss(OM_LOSS_MSE);
    loss.weight = weight;
    assert_status(om_loss_eval(&loss, NSAMPLE, shape, y, y, 1, &value, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "all weights are 0"));
    weight[3] = -1;
    assert_status(om_loss_eval(&loss, NSAMPLE, shape, y, y, 1, &value, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "weight 3 is -1"));
    loss = om_loss(OM_LOSS_MSE);
    loss.sample_weight = (const float[]){1, NAN, 1};
    assert_status(om_loss_eval(&loss, NSAMPLE, shape, y, y, 1, &value, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "sample_weight 1 is nan"));
    loss = om_loss(OM_LOSS_MSE);
    float cell_weight[NSAMPLE * NCELL] = {[NCELL + 2] = -2};
    loss.cell_weight = cell_weight;
    assert_status(om_loss_eval(&loss, NSAMPLE, shape, y, y, 1, &value, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "cell_weight 2 of sample 1 is -2"));
    loss.weight = weight;
    assert_status(om_loss_eval(&loss, NSAMPLE, shape, y, y, 1, &value, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "exclude each other"));
    loss = om_loss((OmLossKind)77);
    assert_status(om_loss_eval(&loss, NSAMPLE, shape, y, y, 1, &value, NULL), OM_INVALID);
    loss = om_loss(OM_LOSS_MSE);
    loss.term[0].scale = 0;
    assert_status(om_loss_eval(&loss, NSAMPLE, shape, y, y, 1, &value, NULL), OM_INVALID);
    loss.nterm = 0;
    assert_status(om_loss_eval(&loss, NSAMPLE, shape, y, y, 1, &value, NULL), OM_INVALID);
    loss = om_loss(OM_LOSS_MSE);
    assert_status(om_loss_eval(&loss, 0, shape, y, y, 1, &value, NULL), OM_INVALID);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_formulas),         cmocka_unit_test(test_sample_weights),
        cmocka_unit_test(test_derivatives),      cmocka_unit_test(test_known_values),
        cmocka_unit_test(test_any_worker_count), cmocka_unit_test(test_refused),
        cmocka_unit_test(test_cell_weights),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
