// nn_loss.c: the loss functions of training and their derivatives.
//
// Values are summed in double: each block of cells (or of planes, for Dice) in order, then the blocks in order, so
// that any worker count gives the same bytes. A batch is samples x channels x cells; a block is a range of the
// samples' cells and runs over the channels of each. Dice needs its sums before its derivative and takes whole
// planes (one channel of one sample) instead.
//
// BCE of logits: max(y, 0) - y t + log(1 + exp(-|y|)), which neither overflows nor cancels.
#include <math.h>

#include "nn/nn_train_internal.h"

enum { MAX_BLOCK = 256, MIN_GRAIN = 1024 };

// Added under the root of the norm, so that the derivative stays finite where y = t; the loss error
// is smaller than this.
#define NORM_FLOOR 1e-24
#define DICE_SMOOTH 1.0
#define SLOPE_CHANNEL 64  // largest number of channels

typedef struct Work {
    OmLossKind kind;
    int64_t nchannel, ncell;
    int extent[3];  // width, height, depth
    const float *y, *t, *weight, *sample_weight;
    int64_t weight_step;    // from the weights of a sample to those of the next; 0: all alike
    const double* over;     // of each sample: 1 / the sum of its weights, 0 if that is 0; or null
    float* dy;              // derivative is added to it; or null
    double factor;          // of each cell's value in the loss, without the sample's weight
    double sum[MAX_BLOCK];  // one for each block
} Work;

OmLoss om_loss(OmLossKind kind) {
    OmLoss loss = {.nterm = 1};
    loss.term[0].kind = kind;
    loss.term[0].scale = 1;
    return loss;
}

static double sigmoid(double y) {
    return y >= 0 ? 1 / (1 + exp(-y)) : exp(y) / (1 + exp(y));  // the exponent is never positive
}

// Of a sample in a mean over samples; for a sum over its cells with weights of its own, over the sum of these.
static double weight_of(const Work* w, int64_t sample) {
    double weight = w->sample_weight ? (double)w->sample_weight[sample] : 1;
    bool is_mean = w->kind != OM_LOSS_DICE && w->over;
    return is_mean ? weight * w->over[sample] : weight;
}

static const float* cell_weights(const Work* w, int64_t sample) {
    return w->weight ? w->weight + sample * w->weight_step : NULL;
}

// ---- terms that are sums over cells -----------------------------------------------------------------

static double square_cells(const Work* w, int64_t at, const float* cell_weight, int count,
                           double factor) {
    double sum = 0;
    for (int i = 0; i < count; ++i) {
        double weight = cell_weight ? (double)cell_weight[i] : 1;
        if (weight == 0) continue;
        double e = (double)w->y[at + i] - (double)w->t[at + i];
        sum += weight * e * e;
        if (w->dy) w->dy[at + i] += (float)(2 * factor * weight * e);
    }
    return sum;
}

static double entropy_cells(const Work* w, int64_t at, const float* cell_weight, int count,
                            double factor) {
    double sum = 0;
    for (int i = 0; i < count; ++i) {
        double weight = cell_weight ? (double)cell_weight[i] : 1;
        if (weight == 0) continue;
        double y = (double)w->y[at + i], t = (double)w->t[at + i];
        sum += weight * (fmax(y, 0) - y * t + log1p(exp(-fabs(y))));
        if (w->dy) w->dy[at + i] += (float)(factor * weight * (sigmoid(y) - t));
    }
    return sum;
}

// `at` is the first channel's value of the first cell; the next channel's value is ncell further.
static double norm_cells(const Work* w, int64_t at, const float* cell_weight, int count,
                         double factor) {
    double sum = 0;
    for (int i = 0; i < count; ++i) {
        double weight = cell_weight ? (double)cell_weight[i] : 1;
        if (weight == 0) continue;
        double square = NORM_FLOOR;
        for (int64_t c = 0, k = at + i; c < w->nchannel; ++c, k += w->ncell) {
            double e = (double)w->y[k] - (double)w->t[k];
            square += e * e;
        }
        double norm = sqrt(square);  // > 0 by NORM_FLOOR
        sum += weight * norm;
        if (!w->dy) continue;
        for (int64_t c = 0, k = at + i; c < w->nchannel; ++c, k += w->ncell)
            w->dy[k] += (float)(factor * weight * ((double)w->y[k] - (double)w->t[k]) / norm);
    }
    return sum;
}

// A range of cells of all samples: cut where a sample ends.
static void cell_block(void* ctx, int begin, int end, int block) {
    Work* w = ctx;
    double sum = 0;
    while (begin < end) {
        int64_t sample = begin / w->ncell, cell = begin % w->ncell;
        int64_t left = w->ncell - cell;
        int count = left < end - begin ? (int)left : end - begin;
        int64_t at = sample * w->nchannel * w->ncell + cell;
        double sample_weight = weight_of(w, sample), factor = w->factor * sample_weight;
        const float* cell_weight = cell_weights(w, sample);
        if (cell_weight) cell_weight += cell;
        if (w->kind == OM_LOSS_NORM) {
            sum += sample_weight * norm_cells(w, at, cell_weight, count, factor);
        } else {
            for (int64_t c = 0; c < w->nchannel; ++c, at += w->ncell)
                sum += sample_weight * (w->kind == OM_LOSS_MSE
                                            ? square_cells(w, at, cell_weight, count, factor)
                                            : entropy_cells(w, at, cell_weight, count, factor));
        }
        begin += count;
    }
    w->sum[block] = sum;
}

// ---- Dice -------------------------------------------------------------------------------------------

// 1 - n / d of one plane with n = 2 sum w p t + 1, d = sum w p + sum w t + 1 >= 1;
// d/dy = -w p (1 - p) (2 t d - n) / d^2
static double dice_plane(const Work* w, int64_t at, int64_t sample) {
    const float* cell_weight = cell_weights(w, sample);
    double both = 0, either = 0, sample_weight = weight_of(w, sample);
    for (int64_t i = 0; i < w->ncell; ++i) {
        double weight = cell_weight ? (double)cell_weight[i] : 1;
        if (weight == 0) continue;
        double p = sigmoid((double)w->y[at + i]), t = (double)w->t[at + i];
        both += weight * p * t;
        either += weight * (p + t);
    }
    double n = 2 * both + DICE_SMOOTH, d = either + DICE_SMOOTH;
    for (int64_t i = 0; w->dy && i < w->ncell; ++i) {
        double weight = cell_weight ? (double)cell_weight[i] : 1;
        if (weight == 0) continue;
        double p = sigmoid((double)w->y[at + i]), t = (double)w->t[at + i];
        w->dy[at + i] -=
            (float)(sample_weight * w->factor * weight * p * (1 - p) * (2 * t * d - n) / (d * d));
    }
    return sample_weight * (1 - n / d);
}

static void plane_block(void* ctx, int begin, int end, int block) {
    Work* w = ctx;
    double sum = 0;
    for (int plane = begin; plane < end; ++plane)
        sum += dice_plane(w, plane * w->ncell, plane / w->nchannel);
    w->sum[block] = sum;
}

// ---- slopes -----------------------------------------------------------------------------------------

// The differences of e = y - t to the next cells along width, height and depth, into difference[axis nchannel + c];
// 0 where there is none. The square of their length.
static double find_slope(const Work* w, int64_t at, int64_t cell, const bool has_next[3],
                         const int64_t step[3], double* difference) {
    double square = 0;
    for (int axis = 0; axis < 3; ++axis)
        for (int64_t c = 0; c < w->nchannel; ++c) {
            double* d = &difference[axis * w->nchannel + c];
            int64_t i = at + c * w->ncell + cell, next = i + step[axis];
            *d = 0;
            if (!has_next[axis]) continue;
            *d = ((double)w->y[next] - (double)w->t[next]) - ((double)w->y[i] - (double)w->t[i]);
            square += *d * *d;
        }
    return square;
}

static double slope_sample(const Work* w, int64_t sample, double* difference) {
    const int* n = w->extent;
    const int64_t step[3] = {1, n[0], (int64_t)n[0] * n[1]}, at = sample * w->nchannel * w->ncell;
    const float* cell_weight = cell_weights(w, sample);
    double sum = 0, factor = w->factor * weight_of(w, sample);
    for (int64_t cell = 0; cell < w->ncell; ++cell) {
        const int64_t place[3] = {cell % n[0], cell / n[0] % n[1], cell / step[2]};
        double weight = cell_weight ? (double)cell_weight[cell] : 1;
        bool has_next[3];
        if (weight == 0) continue;
        for (int axis = 0; axis < 3; ++axis)
            has_next[axis] =
                place[axis] + 1 < n[axis] && !(cell_weight && cell_weight[cell + step[axis]] == 0);
        double norm = sqrt(find_slope(w, at, cell, has_next, step, difference) + NORM_FLOOR);
        sum += weight * norm;
        if (!w->dy) continue;
        for (int axis = 0; axis < 3; ++axis)
            for (int64_t c = 0; c < w->nchannel && has_next[axis]; ++c) {
                int64_t i = at + c * w->ncell + cell;
                float g = (float)(factor * weight * difference[axis * w->nchannel + c] / norm);
                w->dy[i] -= g;
                w->dy[i + step[axis]] += g;
            }
    }
    return sum * weight_of(w, sample);
}

// Whole samples, because a cell adds to the derivatives of its neighbours.
static void sample_block(void* ctx, int begin, int end, int block) {
    Work* w = ctx;
    double sum = 0, difference[3 * SLOPE_CHANNEL];
    for (int sample = begin; sample < end; ++sample) sum += slope_sample(w, sample, difference);
    w->sum[block] = sum;
}

// ---- the sum ----------------------------------------------------------------------------------------

OmStatus om__loss_check(const OmLoss* loss, int nsample, OmNetShape shape, double* weight_sum) {
    OM_CHECK(loss->nterm >= 1 && loss->nterm <= OM_LOSS_MAX_TERM, OM_INVALID,
             "loss: %d terms, 1 to %d are possible", loss->nterm, OM_LOSS_MAX_TERM);
    for (int i = 0; i < loss->nterm; ++i) {
        int kind = (int)loss->term[i].kind;
        double scale = loss->term[i].scale;
        OM_CHECK(kind >= 0 && kind < OM_LOSS_NKIND, OM_INVALID, "loss: term %d: no kind %d", i,
                 kind);
        OM_CHECK(scale > 0 && isfinite(scale), OM_INVALID,
                 "loss: term %d: scale is %g, must be above 0", i, scale);
    }
    OM_CHECK(shape.c > 0 && shape.d > 0 && shape.h > 0 && shape.w > 0 && nsample > 0, OM_INVALID,
             "loss: %d samples of %d x %d x %d x %d", nsample, shape.c, shape.d, shape.h, shape.w);
    int64_t ncell = (int64_t)shape.d * shape.h * shape.w;
    OM_CHECK(ncell <= INT32_MAX / nsample && shape.c <= INT32_MAX / nsample, OM_INVALID,
             "loss: a batch of %d samples of %lld cells is too large", nsample, (long long)ncell);
    for (int i = 0; loss->sample_weight && i < nsample; ++i)
        OM_CHECK(loss->sample_weight[i] >= 0 && isfinite(loss->sample_weight[i]), OM_INVALID,
                 "loss: sample_weight %d is %g", i, (double)loss->sample_weight[i]);
    OM_CHECK(!loss->weight || !loss->cell_weight, OM_INVALID,
             "loss: weight and cell_weight exclude each other");
    *weight_sum = loss->weight ? 0 : (double)ncell;
    for (int64_t i = 0; loss->weight && i < ncell; ++i) {
        double weight = (double)loss->weight[i];
        OM_CHECK(weight >= 0 && isfinite(weight), OM_INVALID, "loss: weight %lld is %g",
                 (long long)i, weight);
        *weight_sum += weight;
    }
    OM_CHECK(*weight_sum > 0, OM_INVALID, "loss: all weights are 0");
    for (int i = 0; i < loss->nterm; ++i)
        OM_CHECK(loss->term[i].kind != OM_LOSS_SLOPE || shape.c <= SLOPE_CHANNEL, OM_INVALID,
                 "loss: slopes of %d channels, at most %d are possible", shape.c, SLOPE_CHANNEL);
    return OM_OK;
}

// 1 / the sum of the weights of each sample's cells.
static OmStatus sum_weights(const OmLoss* loss, int nsample, int64_t ncell, double* over) {
    for (int s = 0; s < nsample; ++s) {
        const float* weight = loss->cell_weight + s * ncell;
        double sum = 0;
        for (int64_t i = 0; i < ncell; ++i) {
            OM_CHECK(weight[i] >= 0 && isfinite(weight[i]), OM_INVALID,
                     "loss: cell_weight %lld of sample %d is %g", (long long)i, s,
                     (double)weight[i]);
            sum += (double)weight[i];
        }
        over[s] = sum > 0 ? 1 / sum : 0;
    }
    return OM_OK;
}

static void eval_term(Work* w, OmLossKind kind, double scale, int nsample, double weight_sum,
                      int nworker, double* value) {
    bool is_dice = kind == OM_LOSS_DICE, is_slope = kind == OM_LOSS_SLOPE;
    int n = is_dice ? nsample * (int)w->nchannel : is_slope ? nsample : (int)(nsample * w->ncell);
    int grain = om_block_count(n, MAX_BLOCK);
    if (!is_dice && !is_slope && grain < MIN_GRAIN) grain = MIN_GRAIN;
    double over = is_dice ? n : nsample * weight_sum;
    if (kind == OM_LOSS_MSE || kind == OM_LOSS_BCE) over *= (double)w->nchannel;
    w->kind = kind;
    w->factor = scale / over;
    om_parallel_for(nworker, n, grain,
                    is_dice    ? plane_block
                    : is_slope ? sample_block
                               : cell_block,
                    w);
    double sum = 0;
    for (int i = 0; i < om_block_count(n, grain); ++i) sum += w->sum[i];
    *value += w->factor * sum;
}

OmStatus om_loss_eval(const OmLoss* loss, int nsample, OmNetShape shape, const float* y,
                      const float* t, int nworker, double* value, float* dy) {
    double weight_sum, *over = NULL;
    OmStatus status = OM_OK;
    *value = 0;
    OM_TRY(om__loss_check(loss, nsample, shape, &weight_sum));
    int64_t ncell = (int64_t)shape.d * shape.h * shape.w;
    if (loss->cell_weight) {
        OM_ALLOC(over, nsample);
        OM_TRY_DONE(sum_weights(loss, nsample, ncell, over));
        weight_sum = 1;
    }
    Work w = {.nchannel = shape.c,
              .ncell = ncell,
              .extent = {shape.w, shape.h, shape.d},
              .y = y,
              .t = t,
              .weight = loss->cell_weight ? loss->cell_weight : loss->weight,
              .weight_step = loss->cell_weight ? ncell : 0,
              .over = over,
              .sample_weight = loss->sample_weight,
              .dy = dy};
    for (int64_t i = 0; dy && i < nsample * shape.c * ncell; ++i) dy[i] = 0;
    for (int k = 0; k < loss->nterm; ++k)
        eval_term(&w, loss->term[k].kind, loss->term[k].scale, nsample, weight_sum, nworker, value);
done:
    om_free(over);
    return status;
}
