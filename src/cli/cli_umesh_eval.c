// cli_umesh_eval.c: omentum umesh eval.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "cli_network.h"
#include "omentum/umesh_net.h"

#define BAR_MEAN 0.05   // mm, mean of all samples
#define BAR_WORST 0.25  // mm, of the worst of them
#define BAR_MS 3.0      // of a prediction, median

static const OmCliOption option[] = {
    {"--weights", "-w", "FILE", "of omentum umesh train",
     "the phantom's, weights/phantom.safetensors"},
    OM_CLI_EVAL,
    {"--output", "-o", "DIR", "folder for eval.json and errors.csv"},
    {"--tolerance", NULL, "MM", "of the refinement", "0.05", "mm", 1e-6, 100},
    {"--record", NULL, "FILE", "copy of the weights with these results in the metadata"},
};

static const OmCliKey result_key[] = {
    {"samples", "number of predicted samples"},
    {"mean_error_mm", "mean norm error"},
    {"worst_error_mm", "largest mean norm error of a sample"},
    {"network_mean_error_mm", "mean norm error without refinement"},
    {"prediction_ms", "median time of a prediction"},
};

static OmStatus write_json(const OmUmeshEval* e, const char* dir) {
    char path[1024];
    OmText text = {0};
    OM_TRY(om_path_join(dir, "eval.json", path, sizeof path));
    OmJson json = om_json_begin(&text);
    om_json_open(&json, NULL, '{');
    om_json_integer(&json, "samples", e->n);
    om_json_number(&json, "mean_error_mm", 1e3 * e->mean);
    om_json_number(&json, "sd_mm", 1e3 * e->sd);
    om_json_number(&json, "worst_mm", 1e3 * e->worst);
    om_json_integer(&json, "worst_sample", e->worst_sample);
    om_json_number(&json, "network_mean_error_mm", 1e3 * e->network_mean);
    om_json_number(&json, "network_worst_mm", 1e3 * e->network_worst);
    om_json_number(&json, "linear_alone_mean_error_mm", 1e3 * e->alone_mean);
    om_json_number(&json, "linear_alone_worst_mm", 1e3 * e->alone_worst);
    om_json_number(&json, "linear_mean_error_mm", 1e3 * e->linear_mean);
    om_json_number(&json, "linear_worst_mm", 1e3 * e->linear_worst);
    om_json_number(&json, "linear_ms_median", e->linear_ms);
    om_json_number(&json, "cycles_mean", e->mean_cycle);
    om_json_integer(&json, "cycles_max", e->max_cycle);
    om_json_integer(&json, "inverted", e->ninverted);
    om_json_integer(&json, "beyond_estimate", e->nbeyond);
    om_json_number(&json, "largest_displacement_mm", 1e3 * e->max_u);
    om_json_number(&json, "prediction_ms_median", e->ms_median);
    om_json_number(&json, "prediction_ms_min", e->ms_min);
    om_json_integer(&json, "inside", e->ninside);
    om_json_close(&json, '}');
    return om_json_save(&json, path);
}

static OmStatus write_errors(const OmUmeshEval* e, const OmUmeshSample* sample, const char* dir) {
    char path[1024];
    OmText t = {0};
    OM_TRY(om_path_join(dir, "errors.csv", path, sizeof path));
    OmStatus status = om_text_append(&t, "sample,press_mm,largest_mm,error_mm,score\n");
    for (int s = 0; s < e->n && status >= 0; ++s)
        status = om_text_append(&t, "%d,%.3f,%.3f,%.6f,%.4f\n", s, 1e3 * sample[s].press,
                                1e3 * sample[s].max_u, 1e3 * e->error[s], e->score[s]);
    if (status >= 0) status = om_file_write(path, t.str, t.len);
    om_text_done(&t);
    return status;
}

// Samples under a force, as in Algorithm 2, and samples with a moved probe.
static void print_kinds(const OmUmeshEval* e, const OmUmeshSample* sample) {
    static const char* const name[2] = {"under a force", "moved by the probe"};
    for (int kind = 0; kind < 2; ++kind) {
        double sum = 0, worst = 0;
        int num = 0;
        for (int s = 0; s < e->n; ++s) {
            if ((sample[s].press > 0) != kind) continue;
            sum += e->error[s];
            worst = fmax(worst, e->error[s]);
            ++num;
        }
        if (num)
            printf("  %d %s: %.4f mm, worst %.4f mm\n", num, name[kind], 1e3 * sum / num,
                   1e3 * worst);
    }
}

static int count_above(const OmUmeshEval* e) {
    int num = 0;
    for (int s = 0; s < e->n; ++s) num += 1e3 * e->error[s] > BAR_WORST;
    return num;
}

static OmStatus eval(const OmCliArgs* args, int nsample, int nworker, bool* is_met) {
    OmUmeshNet* net = NULL;
    OmUmeshData data = {0};
    OmUmeshEval e = {0};
    OmFolder folder = {0};
    const char *dir = om_cli_get(args, "--output"), *record = om_cli_get(args, "--record");
    char weights[1024];
    double tolerance = 1e3 * OM_UMESH_TOLERANCE;
    OmStatus status;
    OM_TRY(om_cli_double(args, "--tolerance", &tolerance));
    OM_TRY(om_cli_weights_path(args, weights, sizeof weights));
    const char* const input[] = {om_cli_get(args, "--data"), weights};
    OM_TRY(om_cli_check_apart(dir, input,
                              1));  // weights may be in the folder: they are not overwritten
    OM_TRY(om_cli_check_apart(record, input, 2));
    if (record) OM_TRY(om_file_check_ours(record, "omentum-umesh"));
    om_cli_clean_beside(record);
    OM_TRY(om_umesh_net_load(weights, &net));
    OM_TRY_DONE(om_cli_eval_folder(dir, OM_UMESH_NET_KIND, false, &folder));
    OM_TRY_DONE(om_umesh_data_load(om_cli_get(args, "--data"), nsample, &data));
    OM_TRY_DONE(om_umesh_eval(net, &data, 0, data.nsample, 1e-3 * tolerance, nworker, &e));
    OM_TRY_DONE(om_cli_eval_folder(dir, OM_UMESH_NET_KIND, true, &folder));
    if (dir) OM_TRY_DONE(write_json(&e, dir));
    if (dir) OM_TRY_DONE(write_errors(&e, data.sample, dir));
    if (record) OM_TRY_DONE(om_umesh_record_test(net, &data, &e, record));
    om_cli_figure("samples", e.n);
    om_cli_figure("mean_error_mm", 1e3 * e.mean);
    om_cli_figure("worst_error_mm", 1e3 * e.worst);
    om_cli_figure("network_mean_error_mm", 1e3 * e.network_mean);
    om_cli_figure("prediction_ms", e.ms_median);
    if (dir) om_cli_path(dir);
    printf("%d samples, displacements up to %.1f mm\n", e.n, 1e3 * e.max_u);
    printf("mean norm error %.4f mm (sd %.4f), worst sample %.4f mm (number %d)\n", 1e3 * e.mean,
           1e3 * e.sd, 1e3 * e.worst, e.worst_sample);
    print_kinds(&e, data.sample);
    printf("the network alone: %.4f mm, worst %.4f; linear elasticity alone: %.4f mm, worst %.4f\n",
           1e3 * e.network_mean, 1e3 * e.network_worst, 1e3 * e.alone_mean, 1e3 * e.alone_worst);
    printf("the network alone leaves %.1f %% of the error of linear elasticity alone\n",
           1e2 * e.network_mean / fmax(e.alone_mean, 1e-12));
    if (e.mean_cycle > 0) {
        printf("refined by %.1f cycles, at most %d\n", e.mean_cycle, e.max_cycle);
        printf(
            "linear elasticity, refined without the network: %.4f mm, worst %.4f; %.2f ms (median)\n",
            1e3 * e.linear_mean, 1e3 * e.linear_worst, e.linear_ms);
        printf(
            "refined, %d are farther than %g mm off, %d farther than estimated and the tolerance, %d inverted\n",
            count_above(&e), BAR_WORST, e.nbeyond, e.ninverted);
    } else {
        printf("not refined: the samples have another law, or the grid is too large\n");
    }
    printf("a prediction: %.2f ms (median; %.2f to %.2f)\n", e.ms_median, e.ms_min, e.ms_max);
    printf("similar to the training data: %d of %d samples\n", e.ninside, e.n);
    *is_met = 1e3 * e.mean <= BAR_MEAN && 1e3 * e.worst <= BAR_WORST;
    printf("the bars: mean %g mm %s, worst %g mm %s, median %g ms %s\n", BAR_MEAN,
           1e3 * e.mean <= BAR_MEAN ? "met" : "MISSED", BAR_WORST,
           1e3 * e.worst <= BAR_WORST ? "met" : "MISSED", BAR_MS,
           e.ms_median <= BAR_MS ? "met" : "MISSED");
done:
    om_folder_end(&folder);
    om_umesh_eval_done(&e);
    om_umesh_data_done(&data);
    om_umesh_net_destroy(net);
    return status;
}

int om_cli_umesh_eval(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    int nsample = 0, nworker = 0;
    bool is_met = false;
    const int code = om_cli_begin_eval(&args, "umesh", &nsample, &nworker);
    if (code != OM_EXIT_OK) return code;
    OmStatus status = eval(&args, nsample, nworker, &is_met);
    if (status < 0) return om_cli_fail("umesh", status);
    return is_met ? OM_EXIT_OK : OM_EXIT_FAILED;
}

const OmCliVerb om_cli_verb_umesh_eval = {
    .name = "umesh eval",
    .run = om_cli_umesh_eval,
    .summary = "compare predictions with samples that were not used for training",
    .usage = "omentum umesh eval -d DATA [-w WEIGHTS] [options]",
    .about =
        "Mean norm errors (thesis, equation 3.17) over the free nodes, and the time of a prediction.\n"
        "Exit code 0: a mean of 0.05 mm or less and no sample above 0.25 mm; 1: more.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum umesh generate --samples 200 --seed 2 -o out/test\n"
               "  omentum umesh eval -w out/umesh/weights.safetensors -d out/test",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
