// cli_umesh_train.c: omentum umesh train.
#include <stdio.h>
#include <string.h>

#include "cli_network.h"
#include "omentum/umesh_net.h"

static const OmCliOption option[] = {
    OM_CLI_TRAIN("umesh", "100", "4", "0.001"),
    {"--samples", NULL, "N", "use the first N samples", "all", NULL, 2, 100000000},
    {"--channels", NULL, "N", "channels of the first level; each level doubles them",
     "16; thesis 128", NULL, 1, 256},
    {"--levels", NULL, "N", "levels below the first; each halves the grid", "3", NULL, 1, 6},
    {"--bf16", NULL, NULL, "bfloat16 between layers: faster on processors that support it"},
    {"--workers", NULL, "N", "threads", "one per processor", NULL, 0, OM_MAX_WORKER},
};

static const OmCliKey result_key[] = {
    {"epochs", "epochs"},
    {"steps", "steps of the optimizer"},
    {"validation_error_mm", "validation error of the best epoch"},
    {"linear_error_mm", "error of linear elasticity alone"},
};

static OmStatus train(const OmCliArgs* args, const OmUmeshData* data) {
    OmUmeshTrainSummary summary;
    OmUmeshTrainDef def = om_umesh_train_default_def(data, om_cli_get(args, "--output"));
    OmCliTrain t = {data->nsample, &def.nvalid, &def.nepoch, &def.batch,
                    &def.nworker,  &def.rate,   &def.seed};
    OM_TRY(om_cli_read_train(args, "umesh train", &t));
    OM_TRY(om_cli_int(args, "--channels", &def.base_channels));
    OM_TRY(om_cli_int(args, "--levels", &def.nlevel));
    if (om_cli_get(args, "--bf16")) def.type = OM_BF16;
    def.command = t.command;
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
    int nsample = 0;
    OmUmeshData data;
    const int code = om_cli_begin_train(&args, "umesh", &nsample);
    if (code != OM_EXIT_OK) return code;
    OmStatus status = om_umesh_data_load(om_cli_get(&args, "--data"), nsample, &data);
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
