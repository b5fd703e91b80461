// nn_norm.c: batch and group normalisation (Ioffe & Szegedy 2015; Wu & He 2018), forward and backward.
//
// Both are y = a x + b with a and b for each sample and channel. They differ in the group of values that has
// one mean and variance: a channel of all samples, or some channels of one sample. The sums over cells are
// computed for each (sample, channel) in pieces of fixed length, in double, and added within each group in a
// fixed order. Then one pass over the tensor applies the coefficients. The derivative has the same form, dx
// = p dy + q x + r: with z = (x - m) / s, M values in the group, A = sum w dy and Z = sum w dy z over them,
//     dx = (w dy - A / M - z Z / M) / s.
#include <math.h>
#include <string.h>

#include "base/base_multiversion.h"
#include "nn/nn_internal.h"

#define CELLS 1024  // of a piece
#define LANES 256   // channels at a time

OmStatus om__norm_create(const OmBlocks* x, const OmLayer* layer, OmNorm* norm) {
    OmStatus status = OM_OK;
    int c = x->shape.c;
    *norm = (OmNorm){.n = x->n, .c = c, .is_batch = layer->kind == OM_LAYER_BATCH_NORM};
    norm->epsilon = layer->epsilon;
    norm->ngroup = norm->is_batch ? c : layer->ngroup;
    norm->nchunk = om_block_count((int)om__net_cells(x->shape), CELLS);
    size_t nstat = (size_t)(norm->is_batch ? c : x->n * norm->ngroup),
           rows = (size_t)x->n * (size_t)c;
    OM_CALLOC_DONE(norm->mean, nstat);
    OM_CALLOC_DONE(norm->var, nstat);
    OM_CALLOC_DONE(norm->part, rows * (size_t)norm->nchunk * 2);
    OM_CALLOC_DONE(norm->coef, rows * 3);
done:
    if (status < 0) om__norm_done(norm);
    return status;
}

void om__norm_done(OmNorm* norm) {
    om_free(norm->mean);
    om_free(norm->var);
    om_free(norm->part);
    om_free(norm->coef);
    *norm = (OmNorm){0};
}

size_t om__norm_memory(const OmNorm* norm) {
    size_t rows = (size_t)norm->n * (size_t)norm->c;
    size_t nstat = norm->is_batch ? (size_t)norm->c : (size_t)norm->n * (size_t)norm->ngroup;
    return nstat * 16 + rows * (size_t)norm->nchunk * 16 + rows * 12;
}

// ---- sums over pieces -----------------------------------------------------------------------------------

typedef struct NormLoop {
    const OmNorm* norm;
    const OmBlocks *x, *dy, *to;  // dy is null where there is none
} NormLoop;

// Sums of (x, x^2) or, with dy, of (dy, dy x) over the cells of a piece, for `num` channels side by side.
OM_MULTIVERSION static void sum_piece(const NormLoop* p, int64_t at, int ncell, int num,
                                      double* sum0, double* sum1) {
    float bx[LANES], by[LANES];
    for (int c = 0; c < num; ++c) sum0[c] = sum1[c] = 0;
    for (int s = 0; s < ncell; ++s, at += p->x->block) {
        const float* x = om__blocks_read(p->x, at, num, bx);
        const float* y = p->dy ? om__blocks_read(p->dy, at, num, by) : x;
        for (int c = 0; c < num; ++c) {
            sum0[c] += (double)y[c];
            sum1[c] += (double)y[c] * (double)x[c];
        }
    }
}

// Index: (sample, block of channels, piece).
static void sum_range(void* ctx, int begin, int end, int block) {
    (void)block;
    const NormLoop* p = ctx;
    const OmBlocks* x = p->x;
    int npiece = p->norm->nchunk, nblock = om__blocks_count(x), B = x->block;
    int ncell = (int)om__net_cells(x->shape);
    for (int k = begin; k < end; ++k) {
        int piece = k % npiece, b = k / npiece % nblock, n = k / npiece / nblock;
        int first = piece * CELLS, count = ncell - first < CELLS ? ncell - first : CELLS;
        int width = x->shape.c - b * B < B ? x->shape.c - b * B : B;
        for (int lane = 0; lane < width; lane += LANES) {
            int num = width - lane < LANES ? width - lane : LANES;
            double sum[2][LANES];
            int64_t at = n * om__blocks_stride(x) + ((int64_t)b * ncell + first) * B + lane;
            sum_piece(p, at, count, num, sum[0], sum[1]);
            for (int c = 0; c < num; ++c) {
                int64_t row = (int64_t)n * x->shape.c + b * B + lane + c;
                double* part = p->norm->part + 2 * (row * npiece + piece);
                part[0] = sum[0][c];
                part[1] = sum[1][c];
            }
        }
    }
}

static void sum_all(int nworker, const OmNorm* norm, const OmBlocks* x, const OmBlocks* dy) {
    NormLoop loop = {norm, x, dy, NULL};
    int count = x->n * om__blocks_count(x) * norm->nchunk;
    om_parallel_for(nworker, count, 1, sum_range, &loop);
}

// The two sums of one (sample, channel).
static void row_sums(const OmNorm* norm, int n, int c, double sum[2]) {
    const double* part = norm->part + 2 * ((int64_t)n * norm->c + c) * norm->nchunk;
    sum[0] = sum[1] = 0;
    for (int k = 0; k < norm->nchunk; ++k) {
        sum[0] += part[2 * k];
        sum[1] += part[2 * k + 1];
    }
}

static int stat_of(const OmNorm* norm, int n, int c) {
    return norm->is_batch ? c : n * norm->ngroup + c / (norm->c / norm->ngroup);
}

// Number of values with one common mean.
static double count_of(const OmNorm* norm, const OmBlocks* x) {
    int64_t ncell = om__net_cells(x->shape);
    return (double)(norm->is_batch ? norm->n * ncell : norm->c / norm->ngroup * ncell);
}

void om__norm_measure(int nworker, OmNorm* norm, const OmBlocks* x) {
    sum_all(nworker, norm, x, NULL);
    int nstat = norm->is_batch ? norm->c : norm->n * norm->ngroup;
    double count = count_of(norm, x);
    for (int k = 0; k < nstat; ++k) norm->mean[k] = norm->var[k] = 0;
    for (int n = 0; n < norm->n; ++n)
        for (int c = 0; c < norm->c; ++c) {
            double sum[2];
            row_sums(norm, n, c, sum);
            norm->mean[stat_of(norm, n, c)] += sum[0] / count;
            norm->var[stat_of(norm, n, c)] += sum[1] / count;
        }
    for (int k = 0; k < nstat; ++k)
        norm->var[k] = fmax(0, norm->var[k] - norm->mean[k] * norm->mean[k]);
}

// ---- applying -------------------------------------------------------------------------------------------

// to = coef0 x + coef1, or with dy coef0 dy + coef1 x + coef2, of one cell after another.
OM_MULTIVERSION static void apply_piece(const NormLoop* p, int64_t at, int ncell, int num,
                                        const float coef[3][LANES]) {
    float bx[LANES], by[LANES], bt[LANES];
    for (int s = 0; s < ncell; ++s, at += p->x->block) {
        const float* x = om__blocks_read(p->x, at, num, bx);
        float* to = om__blocks_place(p->to, at, bt);
        if (p->dy) {
            const float* dy = om__blocks_read(p->dy, at, num, by);
            for (int c = 0; c < num; ++c)
                to[c] = coef[0][c] * dy[c] + coef[1][c] * x[c] + coef[2][c];
        } else {
            for (int c = 0; c < num; ++c) to[c] = coef[0][c] * x[c] + coef[1][c];
        }
        om__blocks_write(p->to, at, num, to);
    }
}

static void apply_range(void* ctx, int begin, int end, int block) {
    (void)block;
    const NormLoop* p = ctx;
    const OmBlocks* x = p->x;
    int npiece = p->norm->nchunk, nblock = om__blocks_count(x), B = x->block;
    int ncell = (int)om__net_cells(x->shape);
    for (int k = begin; k < end; ++k) {
        int piece = k % npiece, b = k / npiece % nblock, n = k / npiece / nblock;
        int first = piece * CELLS, count = ncell - first < CELLS ? ncell - first : CELLS;
        for (int lane = 0; lane < B; lane += LANES) {
            int num = B - lane < LANES ? B - lane : LANES;
            float coef[3][LANES];
            for (int c = 0; c < num; ++c) {  // unused channels stay zero
                int channel = b * B + lane + c;
                const float* row = p->norm->coef + 3 * ((int64_t)n * x->shape.c + channel);
                for (int i = 0; i < 3; ++i) coef[i][c] = channel < x->shape.c ? row[i] : 0;
            }
            int64_t at = n * om__blocks_stride(x) + ((int64_t)b * ncell + first) * B + lane;
            apply_piece(p, at, count, num, (const float(*)[LANES])coef);
        }
    }
}

static void apply_all(int nworker, const NormLoop* loop) {
    int count = loop->x->n * om__blocks_count(loop->x) * loop->norm->nchunk;
    om_parallel_for(nworker, count, 1, apply_range, (void*)loop);
}

void om__norm_apply(int nworker, OmNorm* norm, const OmBlocks* x, const float* weight,
                    const float* bias, const OmBlocks* y) {
    for (int n = 0; n < norm->n; ++n)
        for (int c = 0; c < norm->c; ++c) {
            int k = stat_of(norm, n, c);
            // epsilon > 0
            double a = (double)weight[c] / sqrt(norm->var[k] + (double)norm->epsilon);
            float* coef = norm->coef + 3 * ((int64_t)n * norm->c + c);
            coef[0] = (float)a;
            coef[1] = (float)((double)bias[c] - a * norm->mean[k]);
            coef[2] = 0;
        }
    apply_all(nworker, &(NormLoop){norm, x, NULL, y});
}

// ---- derivatives ------------------------------------------------------------------------------------------

// Sums of w dy and w dy z over one group, for the (n, c) with c in [c0, c1), n in [n0, n1).
static void shared_sums(const OmNorm* norm, const float* weight, const int n_range[2],
                        const int c_range[2], double scale, double sum[2]) {
    sum[0] = sum[1] = 0;
    for (int n = n_range[0]; n < n_range[1]; ++n)
        for (int c = c_range[0]; c < c_range[1]; ++c) {
            double s[2];
            row_sums(norm, n, c, s);
            sum[0] += (double)weight[c] * s[0];
            sum[1] += (double)weight[c] * (s[1] - norm->mean[stat_of(norm, n, c)] * s[0]) * scale;
        }
}

static void set_gradient_coefs(OmNorm* norm, const float* weight, double count) {
    int nstat = norm->is_batch ? norm->c : norm->n * norm->ngroup;
    int width = norm->is_batch ? 1 : norm->c / norm->ngroup;
    for (int k = 0; k < nstat; ++k) {
        int n_range[2] = {0, norm->n}, c_range[2] = {k, k + 1};
        if (!norm->is_batch) {
            n_range[0] = k / norm->ngroup;
            n_range[1] = n_range[0] + 1;
            c_range[0] = k % norm->ngroup * width;
            c_range[1] = c_range[0] + width;
        }
        double scale = 1 / sqrt(norm->var[k] + (double)norm->epsilon), sum[2];
        shared_sums(norm, weight, n_range, c_range, scale, sum);
        double q = -scale * scale * sum[1] / count;
        for (int n = n_range[0]; n < n_range[1]; ++n)
            for (int c = c_range[0]; c < c_range[1]; ++c) {
                float* coef = norm->coef + 3 * ((int64_t)n * norm->c + c);
                coef[0] = (float)(scale * (double)weight[c]);
                coef[1] = (float)q;
                coef[2] = (float)(-scale * sum[0] / count - q * norm->mean[k]);
            }
    }
}

void om__norm_backward(int nworker, OmNorm* norm, const OmBlocks* x, const OmBlocks* dy,
                       const float* weight, const OmBlocks* dx, float* dweight, float* dbias) {
    sum_all(nworker, norm, x, dy);
    for (int c = 0; c < norm->c; ++c) {
        double dw = 0, db = 0;
        for (int n = 0; n < norm->n; ++n) {
            double s[2];
            int k = stat_of(norm, n, c);
            row_sums(norm, n, c, s);
            db += s[0];
            dw += (s[1] - norm->mean[k] * s[0]) / sqrt(norm->var[k] + (double)norm->epsilon);
        }
        dweight[c] = (float)dw;
        dbias[c] = (float)db;
    }
    if (!dx) return;
    set_gradient_coefs(norm, weight, count_of(norm, x));
    apply_all(nworker, &(NormLoop){norm, x, dy, dx});
}
