// cli_study_curve.c: omentum study curve.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "cli_study.h"
#include "studies/study_curve.h"

static const OmCliOption option[] = {
    {"--data", "-d", "DIR", "samples of omentum banet generate"},
    {"--output", "-o", "DIR", "folder of the study; finished trainings there are kept"},
    {"--sizes", NULL, "LIST", "training samples, ascending",
     "those of 1100,2500,5000,10000 that DATA has"},
    {"--validation", NULL, "N", "the last N samples are for validation", "a tenth, at most 500",
     NULL, 1, 100000},
    {"--steps", NULL, "N", "steps of each training", "5000", NULL, 1, 100000000},
    {"--batch", NULL, "N", "samples a step", "8", NULL, 1, 1024},
    {"--rate", NULL, "R", "peak learning rate", "0.0007", NULL, 1e-8, 1},
    {"--start", NULL, "FILE", "weights to begin with", "random ones"},
    OM_CLI_STUDY_OPTIONS,
};

static const OmCliKey result_key[] = {
    {"points", "trainings"},
    {"dsc", "mean DSC over the validation samples, of the largest"},
    {"gain", "of the mean DSC by twice the samples, from the last two trainings; none from one"},
};

static OmStatus read_sizes(const char* text, OmStudyCurveDef* def) {
    if (!text) return OM_OK;
    const char *at = text, *end = text + strlen(text);
    bool is_ok = true;
    for (def->nsize = 0; is_ok && def->nsize < OM_STUDY_CURVE_MAX;) {
        int64_t v;
        is_ok = om_integer_parse(&at, end, &v) && v >= 1 && v <= 100000000;
        if (is_ok) def->size[def->nsize++] = (int)v;
        if (!is_ok || at == end || *at != ',') break;
        ++at;
    }
    OM_CHECK(is_ok && at == end, OM_INVALID, "--sizes %s: give up to %d numbers with commas", text,
             OM_STUDY_CURVE_MAX);
    return OM_OK;
}

static OmStatus read_def(const OmCliArgs* args, OmStudyCurveDef* def) {
    OM_TRY(om_cli_int(args, "--validation", &def->train.nvalid));
    OM_TRY(om_cli_int(args, "--steps", &def->nstep));
    OM_TRY(om_cli_int(args, "--batch", &def->train.batch));
    OM_TRY(om_cli_double(args, "--rate", &def->train.rate));
    OM_TRY(om_cli_int(args, "--workers", &def->train.nworker));
    def->train.start = om_cli_get(args, "--start");
    return read_sizes(om_cli_get(args, "--sizes"), def);
}

static OmStatus check(const OmCliArgs* args) {
    int npositional;
    OM_TRY(om_cli_check(args, 0, &npositional));
    OM_CHECK(om_cli_get(args, "--data") && om_cli_get(args, "--output"), OM_INVALID,
             "give the folder of samples (-d DATA) and the folder of the study (-o DIR)");
    return OM_OK;
}

static void print_result(const OmStudyCurveSummary* s, const char* dir) {
    om_cli_figure("points", s->npoint);
    om_cli_figure("dsc", s->point[s->npoint - 1].dsc);
    if (isfinite(s->gain)) om_cli_figure("gain", s->gain);
    om_cli_path(dir);
    for (int k = 0; k < s->npoint; ++k) {
        const OmStudyCurvePoint* p = &s->point[k];
        printf(
            "%6d samples, %3d epochs: DSC %.3f (median %.3f), TPR %.1f %%, calibration error %.3f; samples of the "
            "training %.3f\n",
            p->nsample, p->nepoch, p->dsc, p->dsc_median, 100 * p->tpr, p->ece, p->dsc_trained);
    }
    if (isfinite(s->gain)) printf("twice the samples bring %+.3f of the mean DSC\n", s->gain);
    printf("report: %s/report.html\n", dir);
}

int om_cli_study_curve(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    const char *folder = om_cli_get(&args, "--data"), *output = om_cli_get(&args, "--output");
    OmBanetData data = {0};
    OmStudyCurveSummary summary;
    if (check(&args) < 0) return om_cli_usage("study");
    OmStatus status = om_cli_check_apart(output, &folder, 1);
    if (status >= 0) status = om_banet_data_load(folder, 0, &data);
    if (status < 0) return om_cli_fail("study", status);
    OmStudyCurveDef def = om_study_curve_default_def(&data, output);
    if (read_def(&args, &def) < 0) {
        om_banet_data_done(&data);
        return om_cli_usage("study");
    }
    status = om_study_curve_run(&def, om_cli_study_begin(&args), &summary);
    om_cli_progress_done();
    if (status >= 0) print_result(&summary, output);
    om_banet_data_done(&data);
    return status < 0 ? om_cli_fail_kept("study", status) : OM_EXIT_OK;
}

const OmCliVerb om_cli_verb_study_curve = {
    .name = "study curve",
    .run = om_cli_study_curve,
    .summary = "BA-Net by the number of its training samples: would more samples help?",
    .usage = "omentum study curve -d DATA -o DIR [options]",
    .about =
        "The network that finds attachments is trained on the first samples of DATA, each time more of them,\n"
        "with the same number of steps, and scored on the same validation samples. DIR receives report.html,\n"
        "study.json and a folder for each training; after an interruption the same command continues.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example =
        "  omentum banet generate -o out/samples\n"
        "  omentum study curve -d out/samples -o out/curve\n"
        "  omentum study curve -d out/samples -o out/short --sizes 250,500,1000 --steps 1000",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
