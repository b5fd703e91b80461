// cli_banet_eval.c: omentum banet eval.
#include <stdio.h>
#include <string.h>

#include "cli_network.h"
#include "omentum/banet_net.h"

#define BAR_ECE 0.05

static const OmCliOption option[] = {
    {"--weights", "-w", "FILE", "of omentum banet train", "weights/banet.safetensors"},
    OM_CLI_EVAL,
    {"--output", "-o", "DIR", "folder for eval.json and samples.csv"},
    {"--quiet", "-q", NULL, "no progress"},
};

static const OmCliKey result_key[] = {
    {"samples", "number of predicted samples"},
    {"mean_dsc", "mean DSC"},
    {"median_dsc", "median DSC"},
    {"mean_tpr", "mean TPR"},
    {"median_tpr", "median TPR"},
    {"ece", "expected calibration error"},
    {"prediction_ms", "median time of a prediction"},
};

// ---- groups of samples ------------------------------------------------------------------------------

enum { ALL, EXACT, CAMERA, BOARD, TWO, FEW, NGROUP };
static const char* const group_name[NGROUP] = {"all",   "exact", "camera",
                                               "board", "two",   "visible_below_50"};
static const char* const group_text[NGROUP] = {"all samples", "exact displacement",
                                               "camera",      "on a board",
                                               "two regions", "less than half visible"};

static bool is_in(const OmBanetFacts* f, int group) {
    switch (group) {
    case EXACT: return !f->is_camera;
    case CAMERA: return f->is_camera;
    case BOARD: return f->has_board;
    case TWO: return f->nregion > 1;
    case FEW: return f->visible < 0.5;
    default: return true;
    }
}

typedef struct Group {
    int n;
    double dsc[3], tpr[3], mean_dsc, mean_tpr;  // quartiles
} Group;

static void find_quartiles(double* value, int n, double quartile[3]) {
    om_sort_doubles(value, n);
    for (int q = 0; q < 3; ++q) quartile[q] = om_quantile(value, n, 0.25 * (q + 1));
}

static OmStatus find_group(const OmBanetEval* e, const OmBanetCells* sample, int kind, Group* g) {
    double* value;
    *g = (Group){0};
    OM_ALLOC(value, 2 * e->n);
    for (int s = 0; s < e->n; ++s) {
        if (!is_in(&sample[s].fact, kind)) continue;
        value[g->n] = e->dsc[s];
        value[e->n + g->n++] = e->tpr[s];
        g->mean_dsc += e->dsc[s];
        g->mean_tpr += e->tpr[s];
    }
    if (g->n) {
        g->mean_dsc /= g->n;
        g->mean_tpr /= g->n;
        find_quartiles(value, g->n, g->dsc);
        find_quartiles(value + e->n, g->n, g->tpr);
    }
    om_free(value);
    return OM_OK;
}

// ---- files ------------------------------------------------------------------------------------------

static OmStatus write_json(const OmBanetEval* e, const Group* group, double threshold,
                           const char* dir) {
    char path[1024];
    OmText text = {0};
    OM_TRY(om_path_join(dir, "eval.json", path, sizeof path));
    OmJson json = om_json_begin(&text);
    om_json_open(&json, NULL, '{');
    om_json_integer(&json, "samples", e->n);
    om_json_integer(&json, "cells", e->ncell);
    om_json_number(&json, "threshold", threshold);
    om_json_number(&json, "ece", e->ece);
    om_json_numbers(&json, "bin_predicted", e->bin_predicted, OM_BANET_NBIN);
    om_json_numbers(&json, "bin_true", e->bin_true, OM_BANET_NBIN);
    om_json_number(&json, "prediction_ms_median", e->ms);
    for (int k = 0; k < NGROUP; ++k) {
        om_json_open(&json, group_name[k], '{');
        om_json_integer(&json, "samples", group[k].n);
        om_json_number(&json, "dsc_mean", group[k].mean_dsc);
        om_json_numbers(&json, "dsc_quartiles", group[k].dsc, 3);
        om_json_number(&json, "tpr_mean", group[k].mean_tpr);
        om_json_numbers(&json, "tpr_quartiles", group[k].tpr, 3);
        om_json_close(&json, '}');
    }
    om_json_close(&json, '}');
    return om_json_save(&json, path);
}

static OmStatus write_samples(const OmBanetEval* e, const OmBanetCells* sample, const char* dir) {
    char path[1024];
    OmText t = {0};
    OM_TRY(om_path_join(dir, "samples.csv", path, sizeof path));
    OmStatus status =
        om_text_append(&t, "sample,camera,board,regions,share,visible,largest_mm,dsc,tpr\n");
    for (int s = 0; s < e->n && status >= 0; ++s) {
        const OmBanetFacts* f = &sample[s].fact;
        status = om_text_append(&t, "%d,%d,%d,%d,%.4f,%.4f,%.2f,%.4f,%.4f\n", f->index,
                                f->is_camera, f->has_board, f->nregion, f->share, f->visible,
                                1e3 * f->max_u, e->dsc[s], e->tpr[s]);
    }
    if (status >= 0) status = om_file_write(path, t.str, t.len);
    om_text_done(&t);
    return status;
}

// ---- the verb ---------------------------------------------------------------------------------------

static void print(const OmBanetEval* e, const Group* group, double threshold) {
    printf(
        "%d samples, %lld cells of their surfaces, each cut where its expected DSC is greatest (one threshold: "
        "%.2f); median (quartiles), mean\n",
        e->n, (long long)e->ncell, threshold);
    for (int k = 0; k < NGROUP; ++k) {
        const Group* g = &group[k];
        if (g->n)
            printf("%5d %-24s DSC %.3f (%.3f-%.3f) %.3f   TPR %5.1f (%.1f-%.1f) %.1f %%\n", g->n,
                   group_text[k], g->dsc[1], g->dsc[0], g->dsc[2], g->mean_dsc, 1e2 * g->tpr[1],
                   1e2 * g->tpr[0], 1e2 * g->tpr[2], 1e2 * g->mean_tpr);
    }
    printf("predicted");
    for (int b = 0; b < OM_BANET_NBIN; ++b) printf(" %5.3f", e->bin_predicted[b]);
    printf("\nattached ");
    for (int b = 0; b < OM_BANET_NBIN; ++b) printf(" %5.3f", e->bin_true[b]);
    printf("\nexpected calibration error %.4f (%s %g); a prediction: %.1f ms (median)\n", e->ece,
           e->ece <= BAR_ECE ? "at most" : "MISSED", BAR_ECE, e->ms);
}

// What the network was trained on, and reasons to trust it less here.
static OmStatus print_network(const OmBanetNet* net, const OmBanetData* data) {
    OmText text = {0}, note = {0};
    OmStatus status = om_banet_net_describe(net, &text);
    if (status == OM_OK) status = om_banet_net_check(net, data->side, data, &note);
    if (status == OM_OK) printf("network: %s\n", text.str);
    for (const char* line = note.str; status == OM_OK && line && *line;) {
        const int n = (int)strcspn(line, "\n");
        printf("note: the network: %.*s\n", n, line);
        line += n + 1;
    }
    om_text_done(&text);
    om_text_done(&note);
    return status;
}

static OmStatus eval(const OmCliArgs* args, int nsample, int nworker) {
    OmBanetNet* net = NULL;
    OmBanetData data = {0};
    OmBanetEval e = {0};
    OmFolder folder = {0};
    Group group[NGROUP];
    const char *dir = om_cli_get(args, "--output"), *path = om_cli_get(args, "--data");
    const OmProgress* progress = om_cli_progress(om_cli_get(args, "--quiet") != NULL);
    OmStatus status;
    OM_TRY(om_cli_check_apart(dir, &path, 1));
    OM_TRY(om_banet_net_load(om_cli_get(args, "--weights"), &net));
    OM_TRY_DONE(om_cli_eval_folder(dir, OM_BANET_NET_KIND, false, &folder));
    OM_TRY_DONE(om_banet_data_load(path, nsample, &data));
    OM_TRY_DONE(om_banet_eval(net, &data, 0, data.nsample, nworker, progress, &e));
    om_cli_progress_done();
    for (int k = 0; k < NGROUP; ++k) OM_TRY_DONE(find_group(&e, data.sample, k, &group[k]));
    OM_TRY_DONE(om_cli_eval_folder(dir, OM_BANET_NET_KIND, true, &folder));
    if (dir) OM_TRY_DONE(write_json(&e, group, om_banet_net_threshold(net), dir));
    if (dir) OM_TRY_DONE(write_samples(&e, data.sample, dir));
    om_cli_figure("samples", e.n);
    om_cli_figure("mean_dsc", e.mean_dsc);
    om_cli_figure("median_dsc", e.dsc_quartile[1]);
    om_cli_figure("mean_tpr", e.mean_tpr);
    om_cli_figure("median_tpr", e.tpr_quartile[1]);
    om_cli_figure("ece", e.ece);
    om_cli_figure("prediction_ms", e.ms);
    if (dir) om_cli_path(dir);
    print(&e, group, om_banet_net_threshold(net));
    status = print_network(net, &data);
done:
    om_folder_end(&folder);
    om_banet_eval_done(&e);
    om_banet_data_done(&data);
    om_banet_net_destroy(net);
    return status;
}

int om_cli_banet_eval(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    int nsample = 0, nworker = 0;
    const int code = om_cli_begin_eval(&args, "banet", &nsample, &nworker);
    if (code != OM_EXIT_OK) return code;
    OmStatus status = eval(&args, nsample, nworker);
    return status < 0 ? om_cli_fail("banet", status) : OM_EXIT_OK;
}

const OmCliVerb om_cli_verb_banet_eval = {
    .name = "banet eval",
    .run = om_cli_banet_eval,
    .summary = "compare predictions with samples that were not used for training",
    .usage = "omentum banet eval -d DATA [-w WEIGHTS] [options]",
    .about =
        "DSC (thesis, equation 4.3) and TPR (4.6) over the cells that hold a vertex of the surface, and whether\n"
        "probabilities mean what they say: 15 bins of equal count, with the share of attached cells in each.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum banet generate --test test -o out/test\n"
               "  omentum banet eval -w out/banet/weights.safetensors -d out/test",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
