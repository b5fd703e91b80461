// cli_umesh_train.c: omentum umesh train.
#include <stdio.h>
#include <string.h>

#include "cli_common.h"
#include "omentum/umesh_net.h"

static const OmCliOption option[] = {
    {"--data", "-d", "DIR", "samples of omentum umesh generate"},
    {"--output", "-o", "DIR", "weights, report, and what training needs to go on"},
    {"--samples", NULL, "N", "use the first N samples (default: all)"},
    {"--validation", NULL, "N", "of these, the last N choose the epoch (default: a tenth)"},
    {"--channels", NULL, "N", "of the first level, doubled by each (default 16; thesis 128)"},
    {"--levels", NULL, "N", "halvings of the grid (default 3)"},
    {"--epochs", NULL, "N", "passes through the samples (default 100)"},
    {"--batch", NULL, "N", "samples a step (default 4)"},
    {"--rate", NULL, "R", "peak of the learning rate (default 0.001)"},
    {"--seed", NULL, "N", "of weights and order (default 1)"},
    {"--bf16", NULL, NULL, "values between layers in 16 bits: faster on processors that have it"},
    {"--workers", NULL, "N", "threads (default: one a processor)"},
    {"--quiet", "-q", NULL, "no progress"},
    {"--help", "-h", NULL, "this text"},
};

static void print_help(const OmCliArgs* args) {
    printf(
        "omentum umesh train: a network learns how one organ deforms\n\n"
        "Usage: omentum umesh train -d DATA -o DIR [options]\n\n"
        "The U-Net of thesis 3.6 is trained on the samples in DATA. DIR receives weights.safetensors (with all\n"
        "that a prediction needs), report.html and metrics.csv. Stopped at any moment, the same command goes on\n"
        "where it was.\n");
    om_cli_print_options(args);
    printf("\nExamples:\n"
           "  omentum umesh generate -o out/samples\n"
           "  omentum umesh train -d out/samples -o out/umesh\n"
           "  omentum umesh train -d out/samples -o out/wide --channels 64 --bf16\n");
}

static OmStatus read_def(const OmCliArgs* args, OmUmeshTrainDef* def) {
    int seed = (int)def->seed;
    OM_TRY(om_cli_get_int(args, "--validation", 1, def->data->nsample, &def->nvalid));
    OM_TRY(om_cli_get_int(args, "--channels", 1, 256, &def->base_channels));
    OM_TRY(om_cli_get_int(args, "--levels", 1, 6, &def->nlevel));
    OM_TRY(om_cli_get_int(args, "--epochs", 1, 1000000, &def->nepoch));
    OM_TRY(om_cli_get_int(args, "--batch", 1, 1024, &def->batch));
    OM_TRY(om_cli_get_double(args, "--rate", 1e-8, 1, &def->rate));
    OM_TRY(om_cli_get_int(args, "--seed", 0, 2147483647, &seed));
    OM_TRY(om_cli_get_int(args, "--workers", 0, OM_MAX_WORKER, &def->nworker));
    def->seed = (uint64_t)seed;
    if (om_cli_get(args, "--bf16")) def->type = OM_BF16;
    return OM_OK;
}

// What was typed, for the file of weights.
static void join_command(int argc, char** argv, char* out, size_t size) {
    int len = snprintf(out, size, "omentum umesh train");
    for (int i = 1; i < argc && len >= 0 && (size_t)len < size; ++i)
        len += snprintf(out + len, size - (size_t)len, " %s", argv[i]);
}

static OmStatus train(const OmCliArgs* args, const OmUmeshData* data) {
    char command[512];
    OmUmeshTrainSummary summary;
    OmUmeshTrainDef def = om_umesh_default_train_def(data, om_cli_get(args, "--output"));
    OM_TRY(read_def(args, &def));
    join_command(args->argc, args->argv, command, sizeof command);
    def.command = command;
    const OmProgress* progress = om_cli_progress(om_cli_get(args, "--quiet") != NULL);
    OM_TRY(om_umesh_train(&def, progress, &summary));
    om_cli_progress_done();
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
    if (om_cli_get(&args, "--help")) {
        print_help(&args);
        return OM_EXIT_OK;
    }
    int npositional, nsample = 0;
    OmUmeshData data;
    OmStatus status = om_cli_check(&args, 0, &npositional);
    if (status >= 0) status = om_cli_get_int(&args, "--samples", 2, 100000000, &nsample);
    if (status >= 0 && !(om_cli_get(&args, "--data") && om_cli_get(&args, "--output")))
        status = om_error(OM_INVALID,
                          "give the folder of samples (-d DATA) and that of the weights (-o DIR)");
    if (status < 0) {
        fprintf(stderr, "omentum umesh: %s\n", om_error_message());
        return OM_EXIT_USAGE;
    }
    const char* const input[] = {om_cli_get(&args, "--data")};
    status = om_cli_check_apart(om_cli_get(&args, "--output"), input, 1);
    if (status < 0) return om_cli_fail("umesh", status);
    status = om_umesh_load_data(input[0], nsample, &data);
    if (status < 0) return om_cli_fail("umesh", status);
    status = train(&args, &data);
    om_umesh_data_done(&data);
    return status < 0 ? om_cli_fail_kept("umesh", status) : OM_EXIT_OK;
}
