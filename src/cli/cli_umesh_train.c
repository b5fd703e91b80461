// cli_umesh_train.c: omentum umesh train.
#include <stdio.h>
#include <string.h>

#include "cli_common.h"
#include "omentum/umesh_net.h"

static const OmCliOption option[] = {
    {"--data", "-d", "DIR", "samples of omentum umesh generate"},
    {"--output", "-o", "DIR", "weights, report, and the checkpoint from which training continues"},
    {"--samples", NULL, "N", "use the first N samples", "all", NULL, 2, 100000000},
    {"--validation", NULL, "N", "the last N of these are for validation", "a tenth"},
    {"--channels", NULL, "N", "channels of the first level; each level doubles them",
     "16; thesis 128", NULL, 1, 256},
    {"--levels", NULL, "N", "levels below the first; each halves the grid", "3", NULL, 1, 6},
    {"--epochs", NULL, "N", "epochs", "100", NULL, 1, 1000000},
    {"--batch", NULL, "N", "samples a step", "4", NULL, 1, 1024},
    {"--rate", NULL, "R", "peak learning rate", "0.001", NULL, 1e-8, 1},
    {"--seed", NULL, "N", "seed of the weights and the order of samples", "1", NULL, 0, 2147483647},
    {"--bf16", NULL, NULL, "bfloat16 between layers: faster on processors that support it"},
    {"--workers", NULL, "N", "threads", "one per processor", NULL, 0, OM_MAX_WORKER},
    {"--quiet", "-q", NULL, "no progress"},
};

static const OmCliKey result_key[] = {
    {"epochs", "epochs"},
    {"steps", "steps of the optimizer"},
    {"validation_error_mm", "validation error of the best epoch"},
    {"linear_error_mm", "error of linear elasticity alone"},
};

static OmStatus read_def(const OmCliArgs* args, OmUmeshTrainDef* def) {
    int seed = (int)def->seed;
    OM_TRY(om_cli_get_int(args, "--validation", 1, def->data->nsample, &def->nvalid));
    OM_TRY(om_cli_int(args, "--channels", &def->base_channels));
    OM_TRY(om_cli_int(args, "--levels", &def->nlevel));
    OM_TRY(om_cli_int(args, "--epochs", &def->nepoch));
    OM_TRY(om_cli_int(args, "--batch", &def->batch));
    OM_TRY(om_cli_double(args, "--rate", &def->rate));
    OM_TRY(om_cli_int(args, "--seed", &seed));
    OM_TRY(om_cli_int(args, "--workers", &def->nworker));
    def->seed = (uint64_t)seed;
    if (om_cli_get(args, "--bf16")) def->type = OM_BF16;
    return OM_OK;
}

// The command line, for the metadata of the weights.
static void join_command(int argc, char** argv, char* out, size_t size) {
    int len = snprintf(out, size, "omentum umesh train");
    for (int i = 1; i < argc && len >= 0 && (size_t)len < size; ++i)
        len += snprintf(out + len, size - (size_t)len, " %s", argv[i]);
}

static OmStatus train(const OmCliArgs* args, const OmUmeshData* data) {
    char command[512];
    OmUmeshTrainSummary summary;
    OmUmeshTrainDef def = om_umesh_train_default_def(data, om_cli_get(args, "--output"));
    OM_TRY(read_def(args, &def));
    join_command(args->argc, args->argv, command, sizeof command);
    def.command = command;
    const OmProgress* progress = om_cli_progress(om_cli_get(args, "--quiet") != NULL);
    OM_TRY(om_umesh_train(&def, progress, &summary));
    om_cli_progress_done();
    om_cli_figure("epochs", summary.nepoch);
    om_cli_figure("steps", (double)summary.nstep);
    om_cli_figure("validation_error_mm", 1e3 * summary.valid_error);
    om_cli_figure("linear_error_mm", 1e3 * summary.linear_error);
    om_cli_path(def.out_dir);
    printf(
        "%s%d epochs, %lld steps, %.1f min; validation error %.4f mm (epoch %d), linear elasticity alone %.4f\n"
        "weights: %s/weights.safetensors\nreport: %s/report.html\n",
        summary.is_resumed ? "resumed: " : "", summary.nepoch, (long long)summary.nstep,
        summary.seconds / 60, 1e3 * summary.valid_error, summary.best_epoch,
        1e3 * summary.linear_error, def.out_dir, def.out_dir);
    return OM_OK;
}

int om_cli_umesh_train(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    int npositional, nsample = 0;
    OmUmeshData data;
    OmStatus status = om_cli_check(&args, 0, &npositional);
    if (status >= 0) status = om_cli_int(&args, "--samples", &nsample);
    if (status >= 0 && !(om_cli_get(&args, "--data") && om_cli_get(&args, "--output")))
        status = om_error(
            OM_INVALID, "give the folder of samples (-d DATA) and the folder of weights (-o DIR)");
    if (status < 0) {
        fprintf(stderr, "omentum umesh: %s\n", om_error_message());
        return OM_EXIT_USAGE;
    }
    const char* const input[] = {om_cli_get(&args, "--data")};
    status = om_cli_check_apart(om_cli_get(&args, "--output"), input, 1);
    if (status < 0) return om_cli_fail("umesh", status);
    status = om_umesh_data_load(input[0], nsample, &data);
    if (status < 0) return om_cli_fail("umesh", status);
    status = train(&args, &data);
    om_umesh_data_done(&data);
    return status < 0 ? om_cli_fail_kept("umesh", status) : OM_EXIT_OK;
}

const OmCliVerb om_cli_verb_umesh_train = {
    .name = "umesh train",
    .run = om_cli_umesh_train,
    .summary = "train a network on the samples",
    .usage = "omentum umesh train -d DATA -o DIR [options]",
    .about =
        "Trains the U-Net of thesis 3.6 on the samples in DATA. DIR receives weights.safetensors\n"
        "(everything that a prediction needs), report.html and metrics.csv. After an interruption the same\n"
        "command continues the training.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum umesh generate -o out/samples\n"
               "  omentum umesh train -d out/samples -o out/umesh\n"
               "  omentum umesh train -d out/samples -o out/wide --channels 64 --bf16",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
