// cli_banet_train.c: omentum banet train.
#include <stdio.h>
#include <string.h>

#include "cli_network.h"
#include "omentum/banet_net.h"

static const OmCliOption option[] = {
    OM_CLI_TRAIN("banet", "40", "32", "0.0007"),
    {"--more", NULL, "DIR", "another part of the same set, with larger numbers (generate --first)"},
    {"--samples", NULL, "N", "use the first N samples of each part", "all", NULL, 2, 100000000},
    {"--channels", NULL, "LIST",
     "channels of the five grids, the finest first; multiples of 16 are fast", "16,32,64,96,128"},
    {"--groups", NULL, "N", "groups of norm behind each convolution; 0: none", "0", NULL, 0, 256},
    {"--dropout", NULL, "P", "behind poolings and interpolations", "0.1; thesis 0.5", NULL, 0,
     0.95},
    {"--grid", NULL, "LIST", "cells of the grid in training, multiples of 16", "48,32,16"},
    {"--images", NULL, "N", "mirror images that a prediction averages", "4", NULL, 1, 8},
    {"--shell", NULL, "W", "weight in the loss of cells near the body that hold no vertex", "0.25",
     NULL, 0, 1},
    {"--start", NULL, "FILE", "weights of the same channels to begin with", "random ones"},
    {"--type", NULL, "NAME", "of values between layers, f32 or bf16", "the faster one here"},
    {"--mpi", NULL, NULL,
     "train on the ranks that mpirun or srun started; for builds with -DOM_WITH_MPI=ON"},
    {"--workers", NULL, "N", "threads, of each rank", "one per processor", NULL, 0, OM_MAX_WORKER},
};

static const OmCliKey result_key[] = {
    {"epochs", "epochs"},
    {"steps", "steps of the optimizer"},
    {"validation_dsc", "mean DSC over the validation samples"},
    {"validation_tpr", "mean TPR over the validation samples"},
    {"validation_ece", "expected calibration error over the validation samples"},
    {"threshold", "one threshold for all bodies, of intersections of views"},
};

// Numbers from 1 to 256 with commas between them.
static OmStatus read_list(const OmCliArgs* args, const char* name, int num, int* value) {
    const char* text = om_cli_get(args, name);
    if (!text) return OM_OK;
    const char* end = text + strlen(text);
    for (int k = 0; k < num; ++k) {
        int64_t v;
        bool is_ok = om_integer_parse(&text, end, &v) && v >= 1 && v <= 256;
        is_ok = is_ok && (k < num - 1 ? text < end && *text++ == ',' : text == end);
        OM_CHECK(is_ok, OM_INVALID, "%s %s: give %d numbers from 1 to 256 with commas", name,
                 om_cli_get(args, name), num);
        value[k] = (int)v;
    }
    return OM_OK;
}

static OmStatus read_type(const OmCliArgs* args, OmNetType* type) {
    const char* name = om_cli_get(args, "--type");
    *type = om_net_fast_type();
    if (!name) return OM_OK;
    OM_CHECK(strcmp(name, "f32") == 0 || strcmp(name, "bf16") == 0, OM_INVALID,
             "--type %s: f32 or bf16", name);
    *type = strcmp(name, "f32") == 0 ? OM_F32 : OM_BF16;
    return OM_OK;
}

static OmStatus read_def(const OmCliArgs* args, OmBanetTrainDef* def) {
    OM_TRY(read_list(args, "--channels", OM_BANET_NLEVEL, def->channel));
    OM_TRY(read_list(args, "--grid", 3, def->dim));
    OM_TRY(om_cli_int(args, "--groups", &def->ngroup));
    OM_TRY(om_cli_double(args, "--dropout", &def->dropout));
    OM_TRY(om_cli_int(args, "--images", &def->nimage));
    OM_TRY(om_cli_double(args, "--shell", &def->shell));
    OM_TRY(read_type(args, &def->type));
    def->start = om_cli_get(args, "--start");
    return OM_OK;
}

static OmStatus train(const OmCliArgs* args, const OmBanetData* data, const OmTrainGroup* group) {
    OmBanetTrainSummary s;
    OmBanetTrainDef def = om_banet_train_default_def(data, om_cli_get(args, "--output"));
    OmCliTrain t = {data->nsample, &def.nvalid, &def.nepoch, &def.batch,
                    &def.nworker,  &def.rate,   &def.seed};
    OM_TRY(om_cli_read_train(args, "banet train", &t));
    OM_TRY(read_def(args, &def));
    def.command = t.command;
    const bool is_first = !group || group->rank == 0;  // the rank that reports
    def.group = group;
    const OmProgress* progress = om_cli_progress(!is_first || om_cli_get(args, "--quiet"));
    OM_TRY(om_banet_train(&def, progress, &s));
    om_cli_progress_done();
    if (!is_first) return OM_OK;
    om_cli_figure("epochs", s.nepoch);
    om_cli_figure("steps", (double)s.nstep);
    om_cli_figure("validation_dsc", s.dsc);
    om_cli_figure("validation_tpr", s.tpr);
    om_cli_figure("validation_ece", s.ece);
    om_cli_figure("threshold", s.threshold);
    om_cli_path(def.out_dir);
    printf("%s%d epochs, %lld steps, %.1f min; epoch %d is the best\n"
           "validation: DSC %.3f, TPR %.1f %%, expected calibration error %.3f; threshold %.2f\n"
           "weights: %s/weights.safetensors\nreport: %s/report.html\n",
           s.is_resumed ? "resumed: " : "", s.nepoch, (long long)s.nstep, s.seconds / 60,
           s.best_epoch, s.dsc, 1e2 * s.tpr, s.ece, s.threshold, def.out_dir, def.out_dir);
    return OM_OK;
}

// The samples of --data and --more.
static OmStatus load(const OmCliArgs* args, int nsample, OmBanetData* data) {
    const char* dir = om_cli_get(args, "--more");
    OmBanetData more;
    OM_TRY(om_banet_data_load(om_cli_get(args, "--data"), nsample, data));
    if (!dir) return OM_OK;
    OM_TRY(om_banet_data_load(dir, nsample, &more));
    OmStatus status = om_banet_data_join(data, &more);
    om_banet_data_done(&more);
    return status;
}

int om_cli_banet_train(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    int nsample = 0;
    OmBanetData data = {0};
    OmStatus status = OM_OK;
    const int code = om_cli_begin_train(&args, "banet", &nsample);
    if (code != OM_EXIT_OK) return code;
    OmTrainGroup ranks = {0};
    const bool has_ranks = om_cli_get(&args, "--mpi") != NULL;
    if (has_ranks) status = om_train_group_begin_mpi(&ranks);
    if (status < 0) return om_cli_fail("banet", status);
    const OmTrainGroup* group = has_ranks ? &ranks : NULL;
    status = load(&args, nsample, &data);
    status = om_train_group_agree(group, status);  // the others would wait for this rank
    if (status >= 0) status = train(&args, &data, group);
    om_banet_data_done(&data);
    if (has_ranks) om_train_group_end_mpi(&ranks);
    return status < 0 ? om_cli_fail_kept("banet", status) : OM_EXIT_OK;
}

const OmCliVerb om_cli_verb_banet_train = {
    .name = "banet train",
    .run = om_cli_banet_train,
    .summary = "train the network on the samples",
    .usage = "omentum banet train -d DATA -o DIR [options]",
    .about =
        "Trains the U-Net of thesis 4.2.1 on the samples in DATA. DIR receives weights.safetensors\n"
        "(everything that a prediction needs), report.html and metrics.csv. After an interruption the same\n"
        "command continues the training.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum banet generate -o out/samples\n"
               "  omentum banet train -d out/samples -o out/banet\n"
               "  omentum banet train -d out/samples -o out/small --samples 500 --epochs 10",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
