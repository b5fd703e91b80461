// nn_reference.h: every layer as plain loops in double, forward and backward: the second implementation.
#ifndef OMENTUM_NN_REFERENCE_H
#define OMENTUM_NN_REFERENCE_H

#include "omentum/nn.h"
#include "test_common.h"

typedef struct Reference {
    const OmNet* net;
    int batch;
    bool is_training;
    const float* param;
    double** value;  // (nlayer) outputs, NCDHW
    double** grad;   // (nlayer) derivatives by them
    double* dparam;
} Reference;

static inline int64_t ref_cells(OmNetShape s) { return (int64_t)s.d * s.h * s.w; }
static inline int64_t ref_values(OmNetShape s) { return s.c * ref_cells(s); }
static inline int64_t ref_at(OmNetShape s, int n, int c, int d, int h, int w) {
    return ((((int64_t)n * s.c + c) * s.d + d) * s.h + h) * s.w + w;
}

static inline void ref_create(const OmNet* net, int batch, bool is_training, const float* param,
                              Reference* r) {
    *r = (Reference){.net = net, .batch = batch, .is_training = is_training, .param = param};
    int n = om_net_layer_count(net);
    r->value = om_calloc((size_t)n, sizeof *r->value);
    r->grad = om_calloc((size_t)n, sizeof *r->grad);
    r->dparam = om_calloc(om_net_parameter_size(net), sizeof *r->dparam);
    for (int i = 0; i < n; ++i) {
        size_t size = (size_t)(batch * ref_values(om_net_layer(net, i)->shape));
        r->value[i] = om_calloc(size, sizeof(double));
        r->grad[i] = om_calloc(size, sizeof(double));
    }
}

static inline void ref_done(Reference* r) {
    for (int i = 0; i < om_net_layer_count(r->net); ++i) {
        om_free(r->value[i]);
        om_free(r->grad[i]);
    }
    om_free(r->value);
    om_free(r->grad);
    om_free(r->dparam);
}

static inline const float* ref_param(const Reference* r, int i) {
    return i < 0 ? NULL : r->param + om_net_parameter(r->net, i)->adr;
}
static inline double* ref_dparam(const Reference* r, int i) {
    return i < 0 ? NULL : r->dparam + om_net_parameter(r->net, i)->adr;
}

// The products of a convolution, one by one: y[out] += w x[in]. `what` 0: forward, 1: backward.
static inline void ref_conv(Reference* r, const OmLayer* l, int i, int what) {
    bool is_up = l->kind == OM_LAYER_CONV_UP;
    OmNetShape in = om_net_layer(r->net, l->input[0])->shape, out = l->shape;
    double *x = r->value[l->input[0]], *dx = r->grad[l->input[0]], *y = r->value[i],
           *dy = r->grad[i];
    const float *weight = ref_param(r, l->weight), *bias = ref_param(r, l->bias);
    double *dweight = ref_dparam(r, l->weight), *dbias = ref_dparam(r, l->bias);
    OmNetShape small = is_up ? in : out, large = is_up ? out : in;
    const int *K = l->kernel, *S = l->stride, *P = l->padding;
    for (int n = 0; n < r->batch; ++n)
        for (int o = 0; o < out.c; ++o) {
            for (int64_t s = 0; s < ref_cells(out) && bias; ++s) {
                int64_t at = ((int64_t)n * out.c + o) * ref_cells(out) + s;
                if (what == 0)
                    y[at] += (double)bias[o];
                else
                    dbias[o] += dy[at];
            }
            for (int c = 0; c < in.c; ++c)
                for (int d = 0; d < small.d; ++d)
                    for (int h = 0; h < small.h; ++h)
                        for (int w = 0; w < small.w; ++w)
                            for (int k = 0; k < K[0] * K[1] * K[2]; ++k) {
                                int kd = k / (K[1] * K[2]), kh = k / K[2] % K[1], kw = k % K[2];
                                int D = d * S[0] + kd - P[0], H = h * S[1] + kh - P[1];
                                int W = w * S[2] + kw - P[2];
                                if (D < 0 || H < 0 || W < 0 || D >= large.d || H >= large.h ||
                                    W >= large.w)
                                    continue;
                                int64_t from =
                                    is_up ? ref_at(in, n, c, d, h, w) : ref_at(in, n, c, D, H, W);
                                int64_t to =
                                    is_up ? ref_at(out, n, o, D, H, W) : ref_at(out, n, o, d, h, w);
                                int64_t tap =
                                    is_up ? (int64_t)c * out.c + o : (int64_t)o * in.c + c;
                                tap = tap * K[0] * K[1] * K[2] + k;
                                if (what == 0) {
                                    y[to] += (double)weight[tap] * x[from];
                                } else {
                                    dx[from] += (double)weight[tap] * dy[to];
                                    dweight[tap] += x[from] * dy[to];
                                }
                            }
        }
}

static inline void ref_dense(Reference* r, const OmLayer* l, int i, int what) {
    int64_t nin = ref_values(om_net_layer(r->net, l->input[0])->shape);
    const float *weight = ref_param(r, l->weight), *bias = ref_param(r, l->bias);
    double *dweight = ref_dparam(r, l->weight), *dbias = ref_dparam(r, l->bias);
    for (int n = 0; n < r->batch; ++n)
        for (int o = 0; o < l->shape.c; ++o) {
            double *x = r->value[l->input[0]] + n * nin, *dx = r->grad[l->input[0]] + n * nin;
            double *y = &r->value[i][n * l->shape.c + o], dy = r->grad[i][n * l->shape.c + o];
            if (what == 0)
                *y += (double)bias[o];
            else
                dbias[o] += dy;
            for (int64_t k = 0; k < nin; ++k) {
                if (what == 0) {
                    *y += (double)weight[o * nin + k] * x[k];
                } else {
                    dx[k] += (double)weight[o * nin + k] * dy;
                    dweight[o * nin + k] += dy * x[k];
                }
            }
        }
}

static inline void ref_pool(Reference* r, const OmLayer* l, int i, int what) {
    OmNetShape in = om_net_layer(r->net, l->input[0])->shape, out = l->shape;
    const int *K = l->kernel, *S = l->stride, *P = l->padding;
    const double* x = r->value[l->input[0]];
    for (int64_t to = 0; to < r->batch * ref_values(out); ++to) {
        int w = (int)(to % out.w), h = (int)(to / out.w % out.h),
            d = (int)(to / out.w / out.h % out.d);
        int64_t plane = to / ref_cells(out), best = -1;
        for (int k = 0; k < K[0] * K[1] * K[2]; ++k) {
            int D = d * S[0] + k / (K[1] * K[2]) - P[0], H = h * S[1] + k / K[2] % K[1] - P[1];
            int W = w * S[2] + k % K[2] - P[2];
            if (D < 0 || H < 0 || W < 0 || D >= in.d || H >= in.h || W >= in.w) continue;
            int64_t at = ((plane * in.d + D) * in.h + H) * in.w + W;
            if (best < 0 || x[at] > x[best]) best = at;
        }
        if (what == 0)
            r->value[i][to] = x[best];
        else
            r->grad[l->input[0]][best] += r->grad[i][to];
    }
}

// The two cells and weights along one axis, centres kept, clamped at the ends.
static inline void ref_linear(int at, int scale, int extent, int cell[2], double weight[2]) {
    double x = (at + 0.5) / scale - 0.5;
    int lo = (int)floor(x);
    weight[1] = x - lo;
    weight[0] = 1 - weight[1];
    cell[0] = lo < 0 ? 0 : lo;
    cell[1] = lo + 1 >= extent ? extent - 1 : lo + 1;
}

static inline void ref_upsample(Reference* r, const OmLayer* l, int i, int what) {
    OmNetShape in = om_net_layer(r->net, l->input[0])->shape, out = l->shape;
    for (int64_t to = 0; to < r->batch * ref_values(out); ++to) {
        int at[3] = {(int)(to / out.w / out.h % out.d), (int)(to / out.w % out.h),
                     (int)(to % out.w)};
        const int extent[3] = {in.d, in.h, in.w};
        int cell[3][2];
        double weight[3][2];
        for (int k = 0; k < 3; ++k) ref_linear(at[k], l->scale[k], extent[k], cell[k], weight[k]);
        for (int k = 0; k < 8; ++k) {
            int a = k / 4, b = k / 2 % 2, c = k % 2;
            int64_t from =
                ((to / ref_cells(out) * in.d + cell[0][a]) * in.h + cell[1][b]) * in.w + cell[2][c];
            double f = weight[0][a] * weight[1][b] * weight[2][c];
            if (what == 0)
                r->value[i][to] += f * r->value[l->input[0]][from];
            else
                r->grad[l->input[0]][from] += f * r->grad[i][to];
        }
    }
}

static inline void ref_activation(Reference* r, const OmLayer* l, int i, int what) {
    for (int64_t k = 0; k < r->batch * ref_values(l->shape); ++k) {
        double x = r->value[l->input[0]][k], *y = &r->value[i][k], slope = (double)l->slope, f = 0;
        if (what == 0) {
            *y = l->activation == OM_TANH ? tanh(x) : x > 0 ? x : slope * x;
            if (l->activation == OM_SIGMOID) *y = 1 / (1 + exp(-x));
            continue;
        }
        f = l->activation == OM_TANH ? 1 - *y * *y : x > 0 ? 1 : slope;
        if (l->activation == OM_SIGMOID) f = *y * (1 - *y);
        r->grad[l->input[0]][k] += f * r->grad[i][k];
    }
}

// Mean and variance over what (n, c) shares them with; M their number.
static inline void ref_statistics(const Reference* r, const OmLayer* l, int n, int c,
                                  double stat[3]) {
    int width = l->kind == OM_LAYER_BATCH_NORM ? 1 : l->shape.c / l->ngroup,
        first = c / width * width;
    int n0 = l->kind == OM_LAYER_BATCH_NORM ? 0 : n,
        n1 = l->kind == OM_LAYER_BATCH_NORM ? r->batch : n + 1;
    double sum = 0, square = 0, count = 0;
    for (int pass = 0; pass < 2; ++pass)
        for (int m = n0; m < n1; ++m)
            for (int k = first; k < first + width; ++k)
                for (int64_t s = 0; s < ref_cells(l->shape); ++s) {
                    double x = r->value[l->input[0]]
                                       [((int64_t)m * l->shape.c + k) * ref_cells(l->shape) + s];
                    if (pass == 0)
                        sum += x, count += 1;
                    else
                        square += (x - sum / count) * (x - sum / count);
                }
    stat[0] = sum / count;
    stat[1] = square / count;
    stat[2] = count;
    if (l->kind == OM_LAYER_BATCH_NORM && !r->is_training) {
        stat[0] = (double)ref_param(r, l->mean)[c];
        stat[1] = (double)ref_param(r, l->variance)[c];
    }
}

// Backward the slow way: every output depends on every value that shares its statistics.
static inline void ref_norm(Reference* r, const OmLayer* l, int i, int what) {
    int64_t cells = ref_cells(l->shape);
    int width = l->kind == OM_LAYER_BATCH_NORM ? 1 : l->shape.c / l->ngroup;
    const float *weight = ref_param(r, l->weight), *bias = ref_param(r, l->bias);
    for (int n = 0; n < r->batch; ++n)
        for (int c = 0; c < l->shape.c; ++c) {
            double stat[3];
            ref_statistics(r, l, n, c, stat);
            double scale = 1 / sqrt(stat[1] + (double)l->epsilon);
            for (int64_t s = 0; s < cells; ++s) {
                int64_t at = ((int64_t)n * l->shape.c + c) * cells + s;
                double z = (r->value[l->input[0]][at] - stat[0]) * scale;
                if (what == 0) {
                    r->value[i][at] = (double)weight[c] * z + (double)bias[c];
                    continue;
                }
                double dy = r->grad[i][at], g = dy * (double)weight[c] * scale;
                ref_dparam(r, l->weight)[c] += dy * z;
                ref_dparam(r, l->bias)[c] += dy;
                r->grad[l->input[0]][at] += g;
                int n0 = l->kind == OM_LAYER_BATCH_NORM ? 0 : n;
                int n1 = l->kind == OM_LAYER_BATCH_NORM ? r->batch : n + 1;
                for (int m = n0; m < n1; ++m)
                    for (int k = c / width * width; k < c / width * width + width; ++k)
                        for (int64_t t = 0; t < cells; ++t) {
                            int64_t q = ((int64_t)m * l->shape.c + k) * cells + t;
                            double zq = (r->value[l->input[0]][q] - stat[0]) * scale;
                            r->grad[l->input[0]][q] -= g * (1 + z * zq) / stat[2];
                        }
            }
        }
}

static inline void ref_concat(Reference* r, const OmLayer* l, int i, int what) {
    int64_t cells = ref_cells(l->shape), first = 0;
    for (int k = 0; k < l->ninput; ++k) {
        int64_t num = ref_values(om_net_layer(r->net, l->input[k])->shape);
        for (int n = 0; n < r->batch; ++n)
            for (int64_t v = 0; v < num; ++v) {
                int64_t to = (int64_t)n * l->shape.c * cells + first + v, from = n * num + v;
                if (what == 0)
                    r->value[i][to] = r->value[l->input[k]][from];
                else
                    r->grad[l->input[k]][from] += r->grad[i][to];
            }
        first += num;
    }
}

static inline void ref_mask(Reference* r, const OmLayer* l, int i, int what) {
    for (int64_t k = 0; k < r->batch * ref_values(l->shape); ++k) {
        double m = (double)l->mask[k % ref_cells(l->shape)];
        if (what == 0)
            r->value[i][k] = m * r->value[l->input[0]][k];
        else
            r->grad[l->input[0]][k] += m * r->grad[i][k];
    }
}

static inline void ref_layer(Reference* r, int i, int what) {
    const OmLayer* l = om_net_layer(r->net, i);
    switch (l->kind) {
    case OM_LAYER_INPUT: break;
    case OM_LAYER_CONV:
    case OM_LAYER_CONV_UP: ref_conv(r, l, i, what); break;
    case OM_LAYER_UPSAMPLE: ref_upsample(r, l, i, what); break;
    case OM_LAYER_MAX_POOL: ref_pool(r, l, i, what); break;
    case OM_LAYER_DENSE: ref_dense(r, l, i, what); break;
    case OM_LAYER_ACTIVATION: ref_activation(r, l, i, what); break;
    case OM_LAYER_BATCH_NORM:
    case OM_LAYER_GROUP_NORM: ref_norm(r, l, i, what); break;
    case OM_LAYER_CONCAT: ref_concat(r, l, i, what); break;
    case OM_LAYER_MASK: ref_mask(r, l, i, what); break;
    default: fail_msg("layer %s has no reference", l->name);
    }
}

/// The output as doubles: a view of r.
static inline const double* ref_forward(Reference* r, const float* in) {
    int n = om_net_layer_count(r->net);
    for (int i = 0; i < n; ++i) {
        size_t size = (size_t)(r->batch * ref_values(om_net_layer(r->net, i)->shape));
        memset(r->value[i], 0, size * sizeof(double));
        if (i == 0)
            for (size_t k = 0; k < size; ++k) r->value[0][k] = (double)in[k];
        ref_layer(r, i, 0);
    }
    return r->value[om_net_output(r->net)];
}

/// Fills dparam and grad[0].
static inline void ref_backward(Reference* r, const float* dout) {
    int n = om_net_layer_count(r->net), output = om_net_output(r->net);
    memset(r->dparam, 0, om_net_parameter_size(r->net) * sizeof *r->dparam);
    for (int i = 0; i < n; ++i) {
        size_t size = (size_t)(r->batch * ref_values(om_net_layer(r->net, i)->shape));
        memset(r->grad[i], 0, size * sizeof(double));
        if (i == output)
            for (size_t k = 0; k < size; ++k) r->grad[i][k] = (double)dout[k];
    }
    for (int i = n - 1; i > 0; --i) ref_layer(r, i, 1);
}

/// Does oneDNN have bfloat16 on this processor? Says so once if not.
static inline bool has_bf16(void) {
    static int answer = -1;
    if (answer >= 0) return answer;
    OmNet* net;
    OmNetRun* run;
    assert_ok(om_net_create(&net));
    int x = om_net_add_input(net, "in", (OmNetShape){4, 1, 1, 1});
    assert_ok(om_net_finish(net, om_net_add_dense(net, "a", x, 4)));
    OmNetRunDef def = om_net_run_default_def(1);
    def.type = OM_BF16;
    OmStatus status = om_net_run_create(net, &def, &run);
    if (status != OM_OK) {
        assert_int_equal(status, OM_UNAVAILABLE);
        print_message("no bfloat16 on this processor: tested in float\n");
    }
    om_net_run_destroy(run);
    om_net_destroy(net);
    answer = status == OM_OK;
    return answer == 1;
}

#endif
