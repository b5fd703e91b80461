// nn_winograd.c: 3x3x3 convolutions with a quarter of the products (Winograd; Lavin and Gray 2016, F(4x4, 3x3)).
//
// Height and width are cut into tiles of 4 x 4 outputs, each of which reads 6 x 6 inputs. With the matrices below
//     Y = A^T [ (G g G^T) . (B^T x B) ] A
// for each pair of channels, summed over input channels and the three taps in depth between the transforms. So
// each of the 36 points of a transformed tile is a separate convolution along depth. oneDNN computes all as
// one convolution of 36 groups with a 3 x 1 x 1 kernel, where the tiles of a slice are its width:
//     x (n, c, d, h, w)  ->  v (n, 36 c, d, 1, tiles)  ->  m (n, 36 out, d, 1, tiles)  ->  y (n, out, d, h, w)
// 36 instead of 144 products a tile. The transforms' factors enlarge the sums: errors are some five times
// those of a plain sum in float. Not for bfloat16. Only for blocks of 16 channels: the loops work on rows of
// 16.
#include <math.h>
#include <string.h>

#include "base/base_multiversion.h"
#include "nn/nn_internal.h"

#define LANES OM_WINOGRAD_BLOCK
#define POINTS OM_WINOGRAD_POINTS

OmNetShape om__winograd_shape(OmNetShape s) {
    int tiles = ((s.h + 3) / 4) * ((s.w + 3) / 4);
    return (OmNetShape){POINTS * s.c, s.d, 1, tiles};
}

// ---- weights --------------------------------------------------------------------------------------------

// G g for three rows of lanes, `from` apart, to six, `step` apart.
static inline void weight_column(const float* g, int from, float* y, int step) {
    for (int l = 0; l < LANES; ++l) {
        float a = g[l], b = g[from + l], c = g[2 * from + l];
        float even = a + c, wide = a / 24 + c / 6;
        y[l] = a / 4;
        y[step + l] = -(even + b) / 6;
        y[2 * step + l] = -(even - b) / 6;
        y[3 * step + l] = wide + b / 12;
        y[4 * step + l] = wide - b / 12;
        y[5 * step + l] = c;
    }
}

typedef struct WeightLoop {
    const float* plain;
    float* to;
    int nout, nin;
    bool is_back;
} WeightLoop;

// Up to LANES pairs of channels side by side.
OM_MULTIVERSION static void weight_group(const WeightLoop* p, int64_t first, int num) {
    float g[27 * LANES] = {0}, half[18 * LANES], u[36 * LANES], out[36 * 3 * LANES];
    for (int l = 0; l < num; ++l) {
        // When the gradient goes back through the layer, the result's rows are its inputs and the
        // taps are reversed.
        int64_t pair = first + l;
        int64_t from = p->is_back ? pair % p->nout * p->nin + pair / p->nout : pair;
        const float* tap = p->plain + from * 27;
        for (int k = 0; k < 27; ++k) g[k * LANES + l] = tap[p->is_back ? 26 - k : k];
    }
    for (int kd = 0; kd < 3; ++kd) {
        for (int w = 0; w < 3; ++w)
            weight_column(g + (kd * 9 + w) * LANES, 3 * LANES, half + w * LANES, 3 * LANES);
        for (int i = 0; i < 6; ++i)
            weight_column(half + i * 3 * LANES, LANES, u + i * 6 * LANES, LANES);
        for (int k = 0; k < POINTS; ++k)
            for (int l = 0; l < LANES; ++l) out[(k * LANES + l) * 3 + kd] = u[k * LANES + l];
    }
    int64_t npair = (int64_t)p->nout * p->nin;
    for (int k = 0; k < POINTS; ++k)
        memcpy(p->to + (k * npair + first) * 3, out + k * LANES * 3, (size_t)num * 3 * sizeof *out);
}

// Index: group of pairs, in the order of the result.
static void weight_range(void* ctx, int begin, int end, int block) {
    (void)block;
    const WeightLoop* p = ctx;
    int64_t npair = (int64_t)p->nout * p->nin;
    for (int64_t k = begin; k < end; ++k) {
        int64_t first = k * LANES;
        weight_group(p, first, npair - first < LANES ? (int)(npair - first) : LANES);
    }
}

void om__winograd_weights(int nworker, const float* plain, int nout, int nin, bool is_back,
                          float* to) {
    WeightLoop loop = {plain, to, nout, nin, is_back};
    om_parallel_for(nworker, om_block_count(nout * nin, LANES), 16, weight_range, &loop);
}

// ---- inputs -----------------------------------------------------------------------------------------------

// B^T x for a column of six rows of lanes, `step` floats apart in both.
static inline void input_column(const float* x, int step, float* y) {
    for (int l = 0; l < LANES; ++l) {
        float a = x[l], b = x[step + l], c = x[2 * step + l];
        float d = x[3 * step + l], e = x[4 * step + l], f = x[5 * step + l];
        float p = e - 4 * c, q = d - 4 * b, r = e - c, s = 2 * (d - b);
        y[l] = 4 * a - 5 * c + e;
        y[step + l] = p + q;
        y[2 * step + l] = p - q;
        y[3 * step + l] = r + s;
        y[4 * step + l] = r - s;
        y[5 * step + l] = 4 * b - 5 * d + f;
    }
}

typedef struct WinogradLoop {
    const OmBlocks *x, *v;  // x: the tensor; v: its transform
    const float* bias;      // or null
    // the activation as mean_slope y + half_jump |y|: no branch, vectors
    float mean_slope, half_jump;
} WinogradLoop;

// Transform one tile: its 6 x 6 cells from (h0, w0), zero outside, to the 36 points `stride` floats apart.
OM_MULTIVERSION static void input_tile(const float* slice, OmNetShape s, int h0, int w0, float* to,
                                       int64_t stride) {
    float x[36 * LANES], y[36 * LANES];
    for (int i = 0; i < 6; ++i)
        for (int k = 0; k < 6; ++k) {
            int h = h0 + i, w = w0 + k;
            bool is_in = h >= 0 && w >= 0 && h < s.h && w < s.w;
            const float* from = slice + ((int64_t)h * s.w + w) * LANES;
            float* at = x + (i * 6 + k) * LANES;
            if (is_in)
                for (int l = 0; l < LANES; ++l) at[l] = from[l];
            else
                for (int l = 0; l < LANES; ++l) at[l] = 0;
        }
    for (int k = 0; k < 6; ++k) input_column(x + k * LANES, 6 * LANES, y + k * LANES);
    for (int i = 0; i < 6; ++i) input_column(y + i * 6 * LANES, LANES, x + i * 6 * LANES);
    for (int p = 0; p < POINTS; ++p, to += stride)
        for (int l = 0; l < LANES; ++l) to[l] = x[p * LANES + l];
}

// Index: (sample, block of channels, slice of depth).
static void input_range(void* ctx, int begin, int end, int block) {
    (void)block;
    const WinogradLoop* p = ctx;
    OmNetShape s = p->x->shape;
    int nblock = om__blocks_count(p->x), tiles = p->v->shape.w, across = (s.w + 3) / 4;
    int64_t stride = (int64_t)nblock * s.d * tiles * LANES;  // between points
    for (int k = begin; k < end; ++k) {
        int d = k % s.d, b = k / s.d % nblock, n = k / s.d / nblock;
        const float* slice = (const float*)p->x->data + (int64_t)k * s.h * s.w * LANES;
        float* to = (float*)p->v->data + n * om__blocks_stride(p->v);
        to += ((int64_t)b * s.d + d) * tiles * LANES;
        for (int t = 0; t < tiles; ++t)
            input_tile(slice, s, t / across * 4 - 1, t % across * 4 - 1, to + t * LANES, stride);
    }
}

static void transform_input(int nworker, const OmBlocks* x, const OmBlocks* v) {
    WinogradLoop loop = {.x = x, .v = v};
    om_parallel_for(nworker, x->n * om__blocks_count(x) * x->shape.d, 4, input_range, &loop);
}

// ---- outputs ----------------------------------------------------------------------------------------------

// A^T m for a column of six rows, `step` floats apart in both; four rows of result.
static inline void output_column(const float* m, int step, float* y) {
    for (int l = 0; l < LANES; ++l) {
        float a = m[l], b = m[step + l], c = m[2 * step + l];
        float d = m[3 * step + l], e = m[4 * step + l], f = m[5 * step + l];
        float bc = b + c, b_c = b - c, de = d + e, d_e = d - e;
        y[l] = a + bc + de;
        y[step + l] = b_c + 2 * d_e;
        y[2 * step + l] = bc + 4 * de;
        y[3 * step + l] = b_c + 8 * d_e + f;
    }
}

// Transform one tile back: 4 x 4 cells at (h0, w0), only those inside.
OM_MULTIVERSION static void output_tile(const float* from, int64_t stride, const float bias[LANES],
                                        const WinogradLoop* p, int h0, int w0, float* slice) {
    float m[36 * LANES], y[24 * LANES], z[16 * LANES];
    OmNetShape s = p->x->shape;
    for (int i = 0; i < POINTS; ++i, from += stride)
        for (int l = 0; l < LANES; ++l) m[i * LANES + l] = from[l];
    for (int k = 0; k < 6; ++k) output_column(m + k * LANES, 6 * LANES, y + k * LANES);
    for (int i = 0; i < 4; ++i) output_column(y + i * 6 * LANES, LANES, z + i * 4 * LANES);
    for (int i = 0; i < 4 && h0 + i < s.h; ++i)
        for (int k = 0; k < 4 && w0 + k < s.w; ++k) {
            float* to = slice + ((int64_t)(h0 + i) * s.w + w0 + k) * LANES;
            const float* at = z + (i * 4 + k) * LANES;
            for (int l = 0; l < LANES; ++l) {
                float sum = at[l] + bias[l];
                to[l] = p->mean_slope * sum + p->half_jump * fabsf(sum);
            }
        }
}

static void output_range(void* ctx, int begin, int end, int block) {
    (void)block;
    const WinogradLoop* p = ctx;
    OmNetShape s = p->x->shape;
    int nblock = om__blocks_count(p->x), tiles = p->v->shape.w, across = (s.w + 3) / 4;
    int64_t stride = (int64_t)nblock * s.d * tiles * LANES;
    for (int k = begin; k < end; ++k) {
        int d = k % s.d, b = k / s.d % nblock, n = k / s.d / nblock;
        float *slice = (float*)p->x->data + (int64_t)k * s.h * s.w * LANES, bias[LANES];
        const float* from = (const float*)p->v->data + n * om__blocks_stride(p->v);
        from += ((int64_t)b * s.d + d) * tiles * LANES;
        for (int l = 0; l < LANES; ++l) bias[l] = p->bias ? p->bias[b * LANES + l] : 0;
        for (int t = 0; t < tiles; ++t)
            output_tile(from + t * LANES, stride, bias, p, t / across * 4, t % across * 4, slice);
    }
}

static void transform_output(int nworker, const OmBlocks* m, const float* bias, bool is_bent,
                             float slope, const OmBlocks* y) {
    float below = is_bent ? slope : 1;
    WinogradLoop loop = {y, m, bias, (1 + below) / 2, (1 - below) / 2};
    om_parallel_for(nworker, y->n * om__blocks_count(y) * y->shape.d, 4, output_range, &loop);
}

// ---- the gradient by the weights ------------------------------------------------------------------------
//
// dU = sum of (A dY A^T) . (B^T x B) over tiles and depth, which oneDNN's gradient of the grouped convolution
// gives, and dg = G^T dU G.

// A y for a column of four rows, `from` apart, to six, `step` apart.
static inline void grad_column(const float* g, int from, float* y, int step) {
    for (int l = 0; l < LANES; ++l) {
        float a = g[l], b = g[from + l], c = g[2 * from + l], d = g[3 * from + l];
        float even = a + c, odd = b + d, even4 = a + 4 * c, odd2 = 2 * b + 8 * d;
        y[l] = a;
        y[step + l] = even + odd;
        y[2 * step + l] = even - odd;
        y[3 * step + l] = even4 + odd2;
        y[4 * step + l] = even4 - odd2;
        y[5 * step + l] = d;
    }
}

// Transform one tile of 4 x 4 cells from (h0, w0), zero outside; adds the cells to `sum`.
OM_MULTIVERSION static void grad_tile(const float* slice, OmNetShape s, int h0, int w0, float* to,
                                      int64_t stride, float sum[LANES]) {
    float g[16 * LANES] = {0}, half[24 * LANES], z[36 * LANES];
    for (int i = 0; i < 4 && h0 + i < s.h; ++i)
        for (int k = 0; k < 4 && w0 + k < s.w; ++k) {
            const float* from = slice + ((int64_t)(h0 + i) * s.w + w0 + k) * LANES;
            float* at = g + (i * 4 + k) * LANES;
            for (int l = 0; l < LANES; ++l) {
                at[l] = from[l];
                sum[l] += from[l];
            }
        }
    for (int k = 0; k < 4; ++k) grad_column(g + k * LANES, 4 * LANES, half + k * LANES, 4 * LANES);
    for (int i = 0; i < 6; ++i) grad_column(half + i * 4 * LANES, LANES, z + i * 6 * LANES, LANES);
    for (int p = 0; p < POINTS; ++p, to += stride)
        for (int l = 0; l < LANES; ++l) to[l] = z[p * LANES + l];
}

typedef struct GradLoop {
    const OmBlocks *dy, *z;  // one sample
    float* slice;            // (blocks x depth x LANES)
} GradLoop;

// Index: (block of channels, slice of depth).
static void grad_range(void* ctx, int begin, int end, int block) {
    (void)block;
    const GradLoop* p = ctx;
    OmNetShape s = p->dy->shape;
    int tiles = p->z->shape.w, across = (s.w + 3) / 4;
    int64_t stride = (int64_t)om__blocks_count(p->dy) * s.d * tiles * LANES;
    for (int k = begin; k < end; ++k) {
        const float* slice = (const float*)p->dy->data + (int64_t)k * s.h * s.w * LANES;
        float *to = (float*)p->z->data + (int64_t)k * tiles * LANES, sum[LANES] = {0};
        for (int t = 0; t < tiles; ++t)
            grad_tile(slice, s, t / across * 4, t % across * 4, to + t * LANES, stride, sum);
        memcpy(p->slice + (int64_t)k * LANES, sum, sizeof sum);
    }
}

// G^T m for six rows of lanes, `from` apart, to three, `step` apart.
static inline void tap_column(const float* m, int from, float* y, int step) {
    for (int l = 0; l < LANES; ++l) {
        float b = m[from + l], c = m[2 * from + l], d = m[3 * from + l], e = m[4 * from + l];
        float even = (b + c) / 6, wide = d + e;
        y[l] = m[l] / 4 - even + wide / 24;
        y[step + l] = (c - b) / 6 + (d - e) / 12;
        y[2 * step + l] = wide / 6 - even + m[5 * from + l];
    }
}

typedef struct TapLoop {
    const float* from;  // (36, pairs, 3)
    float* to;          // (pairs, 27); results are added to it
    int npair;
} TapLoop;

// Up to LANES pairs of channels side by side.
OM_MULTIVERSION static void tap_group(const TapLoop* p, int first, int num) {
    float m[36 * LANES], half[18 * LANES], g[9 * LANES];
    for (int kd = 0; kd < 3; ++kd) {
        for (int k = 0; k < POINTS; ++k) {
            const float* from = p->from + ((int64_t)k * p->npair + first) * 3 + kd;
            for (int l = 0; l < LANES; ++l) m[k * LANES + l] = l < num ? from[l * 3] : 0;
        }
        for (int k = 0; k < 6; ++k)
            tap_column(m + k * LANES, 6 * LANES, half + k * LANES, 6 * LANES);
        for (int i = 0; i < 3; ++i)
            tap_column(half + i * 6 * LANES, LANES, g + i * 3 * LANES, LANES);
        for (int l = 0; l < num; ++l)
            for (int k = 0; k < 9; ++k)
                p->to[((int64_t)(first + l) * 3 + kd) * 9 + k] += g[k * LANES + l];
    }
}

static void tap_range(void* ctx, int begin, int end, int block) {
    (void)block;
    const TapLoop* p = ctx;
    for (int k = begin; k < end; ++k) {
        int first = k * LANES;
        tap_group(p, first, p->npair - first < LANES ? p->npair - first : LANES);
    }
}

OmStatus om__winograd_gradient(int nworker, const OmDetour* w, OmKernel* weights, OmKernel* store,
                               const OmBlocks* x, const OmBlocks* dy, float* slice, float* staging,
                               float* dweight, float* dbias) {
    int nin = x->shape.c, nout = dy->shape.c, depth = dy->shape.d, nslice = nout / LANES * depth;
    memset(dweight, 0, (size_t)nout * (size_t)nin * 27 * sizeof *dweight);
    if (dbias) memset(dbias, 0, (size_t)nout * sizeof *dbias);
    OM_TRY(om__kernel_bind(store, OM_SLOT_DST, staging));
    for (int n = 0; n < x->n; ++n) {
        OmBlocks xn = *x, dyn = *dy;
        xn.n = dyn.n = 1;
        xn.data = (float*)x->data + n * om__blocks_stride(x);
        dyn.data = (float*)dy->data + n * om__blocks_stride(dy);
        transform_input(nworker, &xn, &w->in);
        om_parallel_for(nworker, nslice, 4, grad_range, &(GradLoop){&dyn, &w->out, slice});
        OM_TRY(om__kernel_run(weights));
        OM_TRY(om__kernel_run(store));
        TapLoop taps = {staging, dweight, nout * nin};
        om_parallel_for(nworker, om_block_count(taps.npair, LANES), 16, tap_range, &taps);
        for (int c = 0; c < nout && dbias; ++c) {
            double sum = 0;
            for (int d = 0; d < depth; ++d)
                sum += (double)slice[((int64_t)(c / LANES) * depth + d) * LANES + c % LANES];
            dbias[c] += (float)sum;
        }
    }
    return OM_OK;
}

// ---- the three passes ------------------------------------------------------------------------------------

OmStatus om__winograd_run(int nworker, const OmDetour* w, OmKernel* kernel, const OmBlocks* x,
                          const float* bias, bool is_bent, float slope, const OmBlocks* y) {
    OmBlocks xn = *x, yn = *y;
    xn.n = yn.n = 1;
    for (int n = 0; n < x->n; ++n) {
        xn.data = (float*)x->data + n * om__blocks_stride(x);
        yn.data = (float*)y->data + n * om__blocks_stride(y);
        transform_input(nworker, &xn, &w->in);
        OM_TRY(om__kernel_run(kernel));
        transform_output(nworker, &w->out, bias, is_bent, slope, &yn);
    }
    return OM_OK;
}
