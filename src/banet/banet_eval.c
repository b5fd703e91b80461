// banet_eval.c: calibration, threshold, and scores of a network on samples with a known truth.
//
// Calibration is Platt's (1999): probability = sigmoid(slope output + offset), fitted by Newton to the cross-entropy
// over all cells. One temperature alone (slope without offset) cannot undo that Dice draws outputs away from 0.5 by
// different amounts on both sides. The threshold of the file, for intersections of views, has the largest mean DSC
// (4.3) over samples; of thresholds that are nearly as good the lowest is taken, for its TPR (4.6).
//
// Scores are those of the set that om_banet_choose_threshold takes in each sample (doc/notes/banet.md).
#include <stdlib.h>
#include <string.h>

#include "banet/banet_net_internal.h"
#include "omentum/banet_fuse.h"

#define NTHRESHOLD 99
#define NEARLY 0.002  // of the mean DSC
#define MAX_NEWTON 50

// ---- outputs of samples -----------------------------------------------------------------------------

typedef struct Pass {
    OmBanetPredictor* predictor;
    float *in, *logit;
    double* ms;  // (n)
} Pass;

static void pass_done(Pass* p) {
    om_banet_predictor_destroy(p->predictor);
    om_free(p->in);
    om_free(p->logit);
    *p = (Pass){0};
}

static OmStatus pass_init(const OmBanetNet* net, const int dim[3], int nworker, Pass* p) {
    const size_t ncell = om_grid_count(dim);
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(p->in, OM_BANET_NCHANNEL * ncell);
    OM_ALLOC_DONE(p->logit, ncell);
    OM_TRY_DONE(om_banet_predictor_create(net, dim, nworker, &p->predictor));
done:
    if (status < 0) pass_done(p);
    return status;
}

static OmStatus run_sample(Pass* p, const OmBanetCells* cells, double* ms, float* logit,
                           unsigned char* truth) {
    int num = 0;
    OM_TRY(om_banet_cells_expand(cells, cells->grid.dim, NULL, 0, p->in, NULL, NULL));
    double begin = om_clock_now();
    OM_TRY(om__banet_predict_logit(p->predictor, p->in, p->logit));
    *ms = 1e3 * (om_clock_now() - begin);
    for (int i = 0; i < cells->ncell; ++i) {
        if (!(cells->kind[i] & OM_BANET_SURFACE)) continue;
        logit[num] = p->logit[cells->cell[i]];
        truth[num++] = (cells->kind[i] & OM_BANET_ATTACHED) != 0;
    }
    return OM_OK;
}

static bool is_same(const int a[3], const int b[3]) { return memcmp(a, b, 3 * sizeof *a) == 0; }

// All samples, those of one grid after another.
static OmStatus run_samples(const OmBanetNet* net, const OmBanetCells* sample, int nworker,
                            const OmProgress* progress, BanetOutputs* o) {
    OmStatus status = OM_OK;
    Pass pass = {0};
    int ndone = 0;
    for (int s = 0; s < o->n; ++s) {
        const int* dim = sample[s].grid.dim;
        bool is_first = true;
        for (int k = 0; k < s && is_first; ++k) is_first = !is_same(sample[k].grid.dim, dim);
        if (!is_first) continue;
        OM_TRY_DONE(pass_init(net, dim, nworker, &pass));
        for (int k = s; k < o->n; ++k) {
            if (!is_same(sample[k].grid.dim, dim)) continue;
            OM_TRY_DONE(run_sample(&pass, &sample[k], &o->ms[k], o->logit + o->begin[k],
                                   o->truth + o->begin[k]));
            OM_TRY_DONE(om_progress_report(progress, "predicting", ++ndone, o->n));
        }
        pass_done(&pass);
    }
done:
    pass_done(&pass);
    return status;
}

OmStatus om__banet_outputs_make(const OmBanetNet* net, const OmBanetData* data, int first, int n,
                                int nworker, const OmProgress* progress, BanetOutputs* o) {
    OmStatus status = OM_OK;
    *o = (BanetOutputs){0};
    OM_CHECK(n >= 1 && first >= 0 && n <= data->nsample - first, OM_INVALID,
             "banet: %d samples from %d on; the data have %d", n, first, data->nsample);
    OM_ALLOC_DONE(o->begin, n + 1);
    OM_ALLOC_DONE(o->ms, n);
    o->n = n;
    o->begin[0] = 0;
    for (int s = 0; s < n; ++s) {
        const OmBanetCells* cells = &data->sample[first + s];
        o->begin[s + 1] = o->begin[s];
        for (int i = 0; i < cells->ncell; ++i)
            o->begin[s + 1] += (cells->kind[i] & OM_BANET_SURFACE) != 0;
    }
    OM_CHECK_DONE(o->begin[n] > 0, OM_INVALID, "banet: no cell of the samples holds a vertex");
    OM_ALLOC_DONE(o->logit, o->begin[n]);
    OM_ALLOC_DONE(o->truth, o->begin[n]);
    OM_TRY_DONE(run_samples(net, data->sample + first, nworker, progress, o));
done:
    if (status < 0) om__banet_outputs_done(o);
    return status;
}

void om__banet_outputs_done(BanetOutputs* o) {
    om_free(o->begin);
    om_free(o->ms);
    om_free(o->logit);
    om_free(o->truth);
    *o = (BanetOutputs){0};
}

// ---- scores -----------------------------------------------------------------------------------------

// DSC and TPR of one sample; both are 1 where nothing is attached and nothing is found.
static void score(const OmBanetNet* net, const BanetOutputs* o, int s, double threshold,
                  double* dsc, double* tpr) {
    int64_t nboth = 0, nfound = 0, ntrue = 0;
    for (int64_t i = o->begin[s]; i < o->begin[s + 1]; ++i) {
        bool is_found = om__banet_probability(net, (double)o->logit[i]) >= threshold;
        nfound += is_found;
        ntrue += o->truth[i];
        nboth += is_found && o->truth[i];
    }
    *dsc = nfound + ntrue > 0 ? 2 * (double)nboth / (double)(nfound + ntrue) : 1;
    *tpr = ntrue > 0 ? (double)nboth / (double)ntrue : 1;
}

// Of one sample.
static OmStatus choose(const OmBanetNet* net, const BanetOutputs* o, int s, double* threshold) {
    const int64_t begin = o->begin[s], n = o->begin[s + 1] - begin;
    double* p;
    OM_ALLOC(p, n);
    for (int64_t i = 0; i < n; ++i) p[i] = om__banet_probability(net, (double)o->logit[begin + i]);
    OmStatus status = om_banet_choose_threshold((int)n, p, OM_BANET_NEARLY, threshold);
    om_free(p);
    return status;
}

static double mean_dsc(const OmBanetNet* net, const BanetOutputs* o, double threshold) {
    double sum = 0, dsc, tpr;
    for (int s = 0; s < o->n; ++s) {
        score(net, o, s, threshold, &dsc, &tpr);
        sum += dsc;
    }
    return sum / o->n;
}

// ---- calibration ------------------------------------------------------------------------------------

// Newton's step for slope and offset on the mean cross-entropy; its largest change.
static double calibrate_step(OmBanetNet* net, const BanetOutputs* o) {
    double g[2] = {0}, h[3] = {1e-9, 0, 1e-9};  // not singular where all outputs are equal
    const double count = (double)o->begin[o->n];
    for (int64_t i = 0; i < o->begin[o->n]; ++i) {
        double y = (double)o->logit[i], p = om__banet_probability(net, y);
        double e = (p - o->truth[i]) / count, w = p * (1 - p) / count;
        g[0] += e * y, g[1] += e;
        h[0] += w * y * y, h[1] += w * y, h[2] += w;
    }
    double det = h[0] * h[2] - h[1] * h[1];  // > 0 by Cauchy and Schwarz
    double slope = (h[2] * g[0] - h[1] * g[1]) / det, offset = (h[0] * g[1] - h[1] * g[0]) / det;
    double size = fmax(fabs(slope), fabs(offset)), share = size > 1 ? 1 / size : 1;
    net->slope = fmin(fmax(net->slope - share * slope, 1e-3), 100);
    net->offset = fmin(fmax(net->offset - share * offset, -100), 100);
    return share * size;
}

OmStatus om__banet_calibrate(OmBanetNet* net, const BanetOutputs* o) {
    double dsc[NTHRESHOLD], best = 0;
    net->slope = 1;
    net->offset = 0;
    for (int k = 0; k < MAX_NEWTON; ++k)
        if (calibrate_step(net, o) < 1e-6) break;
    OM_CHECK(isfinite(net->slope) && isfinite(net->offset), OM_INVALID,
             "banet: the outputs cannot be calibrated");
    for (int k = 0; k < NTHRESHOLD; ++k) {
        dsc[k] = mean_dsc(net, o, (k + 1.0) / (NTHRESHOLD + 1));
        best = fmax(best, dsc[k]);
    }
    int k = 0;
    while (dsc[k] < best - NEARLY) ++k;
    net->threshold = (k + 1.0) / (NTHRESHOLD + 1);
    return OM_OK;
}

// ---- evaluation -------------------------------------------------------------------------------------

typedef struct Cell {
    double probability;
    int64_t index;
    unsigned char truth;
} Cell;

static int compare(const void* a, const void* b) {
    const Cell *x = a, *y = b;
    if (x->probability != y->probability) return x->probability < y->probability ? -1 : 1;
    return x->index < y->index ? -1 : x->index > y->index;
}

OmStatus om_banet_reliability(int64_t n, const double* probability, const unsigned char* truth,
                              double predicted[OM_BANET_NBIN], double attached[OM_BANET_NBIN],
                              double* ece) {
    Cell* cell;
    *ece = 0;
    memset(predicted, 0, OM_BANET_NBIN * sizeof *predicted);
    memset(attached, 0, OM_BANET_NBIN * sizeof *attached);
    if (n == 0) return OM_OK;
    OM_ALLOC(cell, n);
    for (int64_t i = 0; i < n; ++i) cell[i] = (Cell){probability[i], i, truth[i]};
    qsort(cell, (size_t)n, sizeof *cell, compare);
    for (int b = 0; b < OM_BANET_NBIN; ++b) {
        const int64_t begin = n * b / OM_BANET_NBIN, end = n * (b + 1) / OM_BANET_NBIN;
        for (int64_t i = begin; i < end; ++i) {
            predicted[b] += cell[i].probability / (double)(end - begin);
            attached[b] += cell[i].truth / (double)(end - begin);
        }
        *ece += fabs(predicted[b] - attached[b]) * (double)(end - begin) / (double)n;
    }
    om_free(cell);
    return OM_OK;
}

static OmStatus fill_bins(const OmBanetNet* net, const BanetOutputs* o, OmBanetEval* e) {
    double* p;
    OM_ALLOC(p, e->ncell);
    for (int64_t i = 0; i < e->ncell; ++i) p[i] = om__banet_probability(net, (double)o->logit[i]);
    OmStatus status =
        om_banet_reliability(e->ncell, p, o->truth, e->bin_predicted, e->bin_true, &e->ece);
    om_free(p);
    return status;
}

static OmStatus find_quartiles(const double* value, int n, double quartile[3]) {
    double* sorted;
    OM_ALLOC(sorted, n);
    memcpy(sorted, value, (size_t)n * sizeof *sorted);
    om_sort_doubles(sorted, n);
    for (int q = 0; q < 3; ++q) quartile[q] = om_quantile(sorted, n, 0.25 * (q + 1));
    om_free(sorted);
    return OM_OK;
}

OmStatus om__banet_eval_outputs(const OmBanetNet* net, const BanetOutputs* o, OmBanetEval* e) {
    OmStatus status = OM_OK;
    double time[3];
    *e = (OmBanetEval){.n = o->n, .ncell = o->begin[o->n]};
    OM_ALLOC_DONE(e->dsc, o->n);
    OM_ALLOC_DONE(e->tpr, o->n);
    for (int s = 0; s < o->n; ++s) {
        double threshold;
        OM_TRY_DONE(choose(net, o, s, &threshold));
        score(net, o, s, threshold, &e->dsc[s], &e->tpr[s]);
        e->mean_dsc += e->dsc[s] / o->n;
        e->mean_tpr += e->tpr[s] / o->n;
    }
    OM_TRY_DONE(find_quartiles(e->dsc, o->n, e->dsc_quartile));
    OM_TRY_DONE(find_quartiles(e->tpr, o->n, e->tpr_quartile));
    OM_TRY_DONE(find_quartiles(o->ms, o->n, time));
    e->ms = time[1];
    OM_TRY_DONE(fill_bins(net, o, e));
done:
    if (status < 0) om_banet_eval_done(e);
    return status;
}

OmStatus om_banet_eval(const OmBanetNet* net, const OmBanetData* data, int first, int n,
                       int nworker, const OmProgress* progress, OmBanetEval* e) {
    BanetOutputs outputs;
    OmText note = {0};
    *e = (OmBanetEval){0};
    const OmStatus fits = om_banet_net_check(net, data->side, data, &note);
    om_text_done(&note);
    OM_TRY(fits);
    OM_TRY(om__banet_outputs_make(net, data, first, n, nworker, progress, &outputs));
    OmStatus status = om__banet_eval_outputs(net, &outputs, e);
    om__banet_outputs_done(&outputs);
    return status;
}

void om_banet_eval_done(OmBanetEval* e) {
    om_free(e->dsc);
    om_free(e->tpr);
    *e = (OmBanetEval){0};
}
