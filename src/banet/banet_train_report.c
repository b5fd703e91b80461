// banet_train_report.c: report.html of a training.
#include <math.h>
#include <string.h>

#include "banet/banet_net_internal.h"
#include "omentum/nn_train.h"
#include "omentum/report.h"

#define WORD 40
#define ZOOM 4    // pixels of a cell
#define NSHOWN 6  // validation samples in pictures
#define NPANEL 3

static void add_curves(const OmTrainResult* r, OmReport* report) {
    double* value = om_alloc(3 * (size_t)r->nepoch, sizeof *value);
    if (!value) return;
    double *epoch = value, *train = value + r->nepoch, *valid = value + 2 * (size_t)r->nepoch;
    for (int i = 0; i < r->nepoch; ++i) {
        epoch[i] = r->epoch[i].epoch;
        train[i] = r->epoch[i].train;
        valid[i] = 1 - r->epoch[i].valid;
    }
    OmReportChart chart = {.title = "Validation",
                           .x_label = "epoch",
                           .y_label = "mean DSC, probability 0.5 before calibration",
                           .series = {{"validation", epoch, valid, r->nepoch, false}},
                           .nseries = 1};
    om_report_chart(report, &chart);
    chart = (OmReportChart){.title = "Loss",
                            .x_label = "epoch",
                            .y_label = "1 - DSC + BCE (4.2)",
                            .series = {{"training", epoch, train, r->nepoch, false}},
                            .nseries = 1};
    om_report_chart(report, &chart);
    om_free(value);
}

static void add_reliability(const OmBanetEval* e, OmReport* report) {
    static const double diagonal[2] = {0, 1};
    OmReportChart chart = {
        .title = "Reliability",
        .x_label = "mean probability of a bin",
        .y_label = "share of attached cells",
        .series = {{"bins of equal count", e->bin_predicted, e->bin_true, OM_BANET_NBIN, false},
                   {"what it says", diagonal, diagonal, 2, false}},
        .nseries = 2,
        .has_range = true,
        .y_min = 0,
        .y_max = 1};
    om_report_chart(report, &chart);
}

static void add_facts(const OmTrainResult* result, const OmBanetNet* net, const OmBanetEval* e,
                      OmReport* report) {
    char fact[8][WORD];
    snprintf(fact[0], WORD, "%.3f", e->mean_dsc);
    snprintf(fact[1], WORD, "%.3f", e->dsc_quartile[1]);
    snprintf(fact[2], WORD, "%.1f %%", 1e2 * e->mean_tpr);
    snprintf(fact[3], WORD, "%.4f", e->ece);
    snprintf(fact[4], WORD, "%.2f", net->threshold);
    snprintf(fact[5], WORD, "%.1f ms", e->ms);
    snprintf(fact[6], WORD, "%lld", (long long)result->nstep);
    snprintf(fact[7], WORD, "%.1f min", result->seconds / 60);
    const char *value[8],
        *label[8] = {"mean DSC, validation",       "median DSC", "mean TPR",
                     "expected calibration error", "threshold",  "a prediction, median",
                     "steps of training",          "training"};
    for (int k = 0; k < 8; ++k) value[k] = fact[k];
    om_report_facts(report, value, label, 8);
}

// ---- pictures ---------------------------------------------------------------------------------------

// Seen displacement (relative to the largest), truth, and probability of a column of cells: 0 to 1, -1 beside the body.
static void find_columns(const OmBanetCells* cells, const float* probability, float* column) {
    const int* dim = cells->grid.dim;
    const size_t ncolumn = (size_t)dim[0] * (size_t)dim[1], num = (size_t)cells->ncell;
    float largest = 1e-6F;  // > 0
    for (size_t i = 0; i < NPANEL * ncolumn; ++i) column[i] = -1;
    for (size_t i = 0; i < num; ++i) {
        if (!(cells->kind[i] & OM_BANET_SURFACE)) continue;
        double square = 0;
        for (size_t c = OM_BANET_UX; c <= OM_BANET_UZ; ++c)
            square += (double)cells->value[c * num + i] * cells->value[c * num + i];
        const float value[NPANEL] = {(float)sqrt(square), (cells->kind[i] & OM_BANET_ATTACHED) != 0,
                                     probability[cells->cell[i]]};
        const size_t at = (size_t)cells->cell[i] % ncolumn;
        largest = fmaxf(largest, value[0]);
        for (size_t k = 0; k < NPANEL; ++k)
            column[k * ncolumn + at] = fmaxf(column[k * ncolumn + at], value[k]);
    }
    for (size_t i = 0; i < ncolumn; ++i)
        if (column[i] > 0) column[i] /= largest;
}

static void paint(const int dim[3], const float* column, OmPicture* picture) {
    for (int y = 0; y < picture->height; ++y)
        for (int x = 0; x < picture->width; ++x) {
            const int panel = x / ZOOM / (dim[0] + 1), i = x / ZOOM % (dim[0] + 1), j = y / ZOOM;
            unsigned char* pixel =
                picture->pixel + 3 * ((size_t)y * (size_t)picture->width + (size_t)x);
            float v = i < dim[0] ? column[(panel * dim[1] + j) * dim[0] + i] : -1;
            pixel[0] = v < 0 ? 255 : (unsigned char)(225 - 205 * v);
            pixel[1] = v < 0 ? 255 : (unsigned char)(228 - 150 * v);
            pixel[2] = v < 0 ? 255 : (unsigned char)(232 - 80 * v);
        }
}

static OmStatus add_picture(const OmBanetNet* net, const OmBanetCells* cells, double dsc,
                            OmReport* report) {
    const int* dim = cells->grid.dim;
    const size_t ncell = om_grid_count(dim);
    OmBanetPredictor* p = NULL;
    OmPicture picture = {0};
    float *in = NULL, *probability = NULL, *column = NULL;
    char caption[160];
    OmStatus status;
    OM_TRY_DONE(om_banet_predictor_create(net, dim, 0, &p));
    OM_ALLOC_DONE(in, OM_BANET_NCHANNEL * ncell);
    OM_ALLOC_DONE(probability, ncell);
    OM_ALLOC_DONE(column, NPANEL * (size_t)dim[0] * (size_t)dim[1]);
    OM_TRY_DONE(om_picture_init(&picture, ZOOM * NPANEL * (dim[0] + 1), ZOOM * dim[1], 3));
    OM_TRY_DONE(om_banet_cells_expand(cells, dim, NULL, 0, in, NULL, NULL));
    OM_TRY_DONE(om_banet_predict(p, in, probability));
    find_columns(cells, probability, column);
    paint(dim, column, &picture);
    snprintf(caption, sizeof caption, "Sample %d, way (%c), %.0f %% seen: DSC %.2f",
             cells->fact.index, cells->fact.is_camera ? 'b' : 'a', 1e2 * cells->fact.visible, dsc);
    om_report_picture(report, &picture, caption);
done:
    om_picture_done(&picture);
    om_banet_predictor_destroy(p);
    om_free(in);
    om_free(probability);
    om_free(column);
    return status;
}

// ---- the report -------------------------------------------------------------------------------------

// What was asked, what came out, and how good it is.
static void add_question(const OmBanetEval* eval, OmReport* report) {
    char text[400];
    snprintf(
        text, sizeof text,
        "Asked: a network that finds attachments from the displacement of the seen surface. Came out: on %d samples "
        "that it did not learn from, a mean DSC of %.2f and a mean TPR of %.0f %%, with probabilities off by %.1f %% "
        "in the mean. The thesis's network has 0.82 and 86 %% on samples of its own.",
        eval->n, eval->mean_dsc, 100 * eval->mean_tpr, 100 * eval->ece);
    om_report_paragraph(report, text);
}

OmStatus om__banet_report_training(const OmBanetTrainDef* def, const OmBanetNet* net,
                                   const OmTrainResult* result, const OmBanetEval* eval) {
    char path[1024], subtitle[160], text[640];
    const int first = def->data->nsample - def->nvalid;
    OM_TRY(om_path_join(def->out_dir, "report.html", path, sizeof path));
    snprintf(subtitle, sizeof subtitle, "%d samples, %zu weights", first, om_banet_net_size(net));
    OmReport report;
    om_report_begin(&report, "BA-Net: training", subtitle);
    add_question(eval, &report);
    add_facts(result, net, eval, &report);
    om_report_heading(&report, "Training");
    add_curves(result, &report);
    om_report_heading(&report, "Probabilities");
    add_reliability(eval, &report);
    om_report_heading(&report, "Samples");
    om_report_paragraph(
        &report,
        "From above, largest value of a column of surface cells: measured displacement, true "
        "attachments, probability.");
    OmStatus status = OM_OK;
    for (int k = 0; k < NSHOWN && k < def->nvalid && status >= 0; ++k)
        status = add_picture(net, &def->data->sample[first + k], eval->dsc[k], &report);
    om_report_heading(&report, "Settings");
    snprintf(
        text, sizeof text,
        "Channels %d, %d, %d, %d, %d, groups of norm %d, dropout %g, batch %d, rate %g; epoch %d of %d was the "
        "best. %d validation samples chose epoch, calibration and threshold, which flatters these figures a "
        "little. A data set of another seed is the test: omentum banet eval.",
        def->channel[0], def->channel[1], def->channel[2], def->channel[3], def->channel[4],
        def->ngroup, def->dropout, def->batch, def->rate, result->best_epoch, result->nepoch,
        def->nvalid);
    om_report_paragraph(&report, text);
    if (status < 0) {
        om_report_done(&report);
        return status;
    }
    return om_report_save(&report, path);
}
