// umesh_train_report.c: report.html of a training.
#include <math.h>

#include "omentum/nn_train.h"
#include "omentum/report.h"
#include "umesh/umesh_internal.h"
#include "umesh/umesh_net_internal.h"

#define WORD 40
#define THESIS_ERROR 0.052  // mm, Table 3.3

static void add_curves(const OmTrainResult* r, OmReport* report) {
    double* value = om_alloc(3 * (size_t)r->nepoch, sizeof *value);
    if (!value) return;
    double *epoch = value, *train = value + r->nepoch, *valid = value + 2 * (size_t)r->nepoch;
    for (int i = 0; i < r->nepoch; ++i) {
        epoch[i] = r->epoch[i].epoch;
        train[i] = r->epoch[i].train;
        valid[i] = 1e3 * r->epoch[i].valid;
    }
    OmReportChart chart = {.title = "Validation error",
                           .x_label = "epoch",
                           .y_label = "mean norm error, mm",
                           .series = {{"validation", epoch, valid, r->nepoch, false}},
                           .nseries = 1,
                           .is_log_y = true,
                           .has_limit = true,
                           .limit = THESIS_ERROR,
                           .limit_name = "thesis, on its test samples"};
    om_report_chart(report, &chart);
    chart =
        (OmReportChart){.title = "Loss",
                        .x_label = "epoch",
                        .y_label = "mean norm errors of values and, three times, of differences",
                        .series = {{"training", epoch, train, r->nepoch, false}},
                        .nseries = 1,
                        .is_log_y = true};
    om_report_chart(report, &chart);
    om_free(value);
}

static void add_facts(const OmTrainResult* result, const OmUmeshEval* eval, OmReport* report) {
    char fact[8][WORD];
    snprintf(fact[0], WORD, "%.3f mm", 1e3 * eval->network_mean);
    snprintf(fact[1], WORD, "%.3f mm", 1e3 * eval->network_worst);
    snprintf(fact[2], WORD, "%.3f mm", 1e3 * eval->mean);
    snprintf(fact[3], WORD, "%.3f mm", 1e3 * eval->worst);
    snprintf(fact[4], WORD, "%.1f mm", 1e3 * eval->max_u);
    snprintf(fact[5], WORD, "%.2f ms", eval->ms_median);
    snprintf(fact[6], WORD, "%lld", (long long)result->nstep);
    snprintf(fact[7], WORD, "%.1f min", result->seconds / 60);
    const char *value[8],
        *label[8] = {"mean norm error, validation",
                     "the worst of these samples",
                     eval->mean_cycle > 0 ? "refined" : "not refined: another law",
                     "the worst of these",
                     "largest displacement of a node",
                     "a prediction, median",
                     "steps of training",
                     "training"};
    for (int k = 0; k < 8; ++k) value[k] = fact[k];
    om_report_facts(report, value, label, 8);
}

// What was asked, what came out, and how good it is: by the error over the largest displacement.
static void add_question(const OmUmeshEval* eval, OmReport* report) {
    char text[400];
    const double share = eval->max_u > 0 ? 100 / eval->max_u : 0;
    int n = snprintf(
        text, sizeof text,
        "Asked: a network that predicts how the organ deforms under a probe. Came out: on %d samples that it did "
        "not learn from, a mean error of %.3f mm, %.2f %% of the largest displacement",
        eval->n, 1e3 * eval->network_mean, share * eval->network_mean);
    if (eval->mean_cycle > 0)
        n += snprintf(text + n, sizeof text - (size_t)n,
                      ", and %.3f mm after its refinement to equilibrium", 1e3 * eval->mean);
    snprintf(text + n, sizeof text - (size_t)n,
             ". The thesis's network of 2,174 elements has a mean error of 0.052 mm.");
    om_report_paragraph(report, text);
}

OmStatus om__umesh_report_training(const OmUmeshTrainDef* def, const OmUmeshNet* net,
                                   const OmTrainResult* result, const OmUmeshEval* eval) {
    char path[1024], subtitle[160], text[640];
    OM_TRY(om_path_join(def->out_dir, "report.html", path, sizeof path));
    snprintf(subtitle, sizeof subtitle, "%d elements, %d nodes, grid of %d x %d x %d points",
             net->grid.fem.mesh.nelem, net->grid.fem.mesh.nnode, net->grid.fem.grid.dim[0],
             net->grid.fem.grid.dim[1], net->grid.fem.grid.dim[2]);
    OmReport report;
    om_report_begin(&report, "U-Mesh: training", subtitle);
    add_question(eval, &report);
    add_facts(result, eval, &report);
    om_report_heading(&report, "How it learned");
    add_curves(result, &report);
    om_report_heading(&report, "What it is");
    snprintf(
        text, sizeof text,
        "U-Net of %d levels from %d channels, %zu weights; %d samples to learn from and %d to choose the "
        "epoch (%d of %d), drawn with seed %llu. Errors are mean norm errors (3.17) over the nodes that are not "
        "held, of the samples kept for validation: they chose the epoch, so they flatter it a little. A data "
        "set of another seed is the test: omentum umesh eval. The test for inputs unlike training takes %d of these %d "
        "samples for known.",
        net->nlevel, net->base_channels, om_net_parameter_size(net->net),
        def->data->nsample - def->nvalid, def->nvalid, result->best_epoch, result->nepoch,
        (unsigned long long)def->seed, eval->ninside, eval->n);
    om_report_paragraph(&report, text);
    return om_report_save(&report, path);
}
