// cli_study_methods.c: omentum study methods.
#include <stdio.h>

#include "cli_study.h"
#include "studies/study_methods.h"

static const OmCliOption option[] = {
    {"--output", "-o", "DIR", "folder of the study; finished results there are kept"},
    {"--weights", "-w", "FILE", "a network trained on the phantom",
     "the phantom's, weights/phantom.safetensors"},
    {"--truth-from", NULL, "DIR", "folder of a contact study: its truth and meshes are used"},
    {"--clusters", NULL, "MM,MM,K", "spacing, radius and stiffness of particles", "the thesis's"},
    {"--lesions-used", NULL, "N", "press over the first N lesions only", "10", NULL, 1, 20},
    {"--truth", NULL, "N", "elements of the quadratic truth", "12000", NULL, 1000, 1000000},
    {"--quick", NULL, NULL, "two lesions, a coarse truth, coarse particles"},
    OM_CLI_STUDY_OPTIONS,
};

static const OmCliKey result_key[] = {
    {"error_mm.*", "mean error of each method"},
    {"worst_gap_mm", "largest difference U-Mesh minus finite elements"},
    {"deformations", "compared"},
    {"outside", "deformations outside the range of the training"},
};

static OmStatus read_clusters(const OmCliArgs* args, double* cluster) {
    const char* text = om_cli_get(args, "--clusters");
    double value[3];
    char rest;
    if (!text) return OM_OK;
    OM_CHECK(
        sscanf(text, "%lf,%lf,%lf%c", &value[0], &value[1], &value[2], &rest) == 3 &&
            value[0] > 0 && value[1] > 0 && value[2] >= 0 && value[2] <= 1,
        OM_INVALID,
        "--clusters is \"%s\"; it must be spacing, radius (mm), stiffness (0 to 1), like 9.6,9.2,0.45",
        text);
    cluster[0] = 1e-3 * value[0];
    cluster[1] = 1e-3 * value[1];
    cluster[2] = value[2];
    return OM_OK;
}

static OmStatus read_def(const OmCliArgs* args, OmStudyMethodsDef* def) {
    int npositional;
    OM_TRY(om_cli_check(args, 0, &npositional));
    OM_CHECK(def->out_dir, OM_INVALID, "no output folder is given; add -o DIR");
    def->truth_dir = om_cli_get(args, "--truth-from");
    if (om_cli_get(args, "--quick")) {
        def->nlesion = 2;
        def->truth_ntet = 2000;
        def->fe_ntet = 1363;
        def->spacing = 0.008;
        def->settle = 0;
    }
    OM_TRY(read_clusters(args, def->cluster));
    OM_TRY(om_cli_int(args, "--lesions-used", &def->nlesion));
    OM_TRY(om_cli_int(args, "--truth", &def->truth_ntet));
    return om_cli_int(args, "--workers", &def->nworker);
}

static void print_result(const OmStudyMethodsSummary* r, const char* dir) {
    static const char* const name[] = {"finite elements", "particles", "U-Mesh", "rigid"};
    static const char* const key_name[] = {"error_mm.elements", "error_mm.particles",
                                           "error_mm.umesh", "error_mm.rigid"};
    for (int by = 0; by < OM_STUDY_NBY; ++by) om_cli_figure(key_name[by], 1e3 * r->by[by].mean);
    om_cli_figure("worst_gap_mm", 1e3 * r->worst_gap);
    om_cli_figure("deformations", r->ncount);
    om_cli_figure("outside", r->noutside);
    om_cli_path(dir);
    printf("%-16s %8s %10s %12s\n", "", "error", "a step", "stability");
    for (int by = 0; by < OM_STUDY_NBY; ++by)
        printf("%-16s %5.2f mm %7.2f ms %10.1f %%\n", name[by], 1e3 * r->by[by].mean, r->by[by].ms,
               100 * r->by[by].stability);
    printf(
        "U-Mesh minus finite elements: at most %+.2f mm over %d deformations; %d of these are outside the range of the "
        "training\n",
        1e3 * r->worst_gap, r->ncount, r->noutside);
    printf("criteria: %s\nreport: %s/report.html\n", r->is_met ? "met" : "missed", dir);
}

int om_cli_study_methods(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    OmStudyMethodsSummary summary;
    char weights[1024] = "";
    OmStudyMethodsDef def = om_study_methods_default_def(om_cli_get(&args, "--output"), weights);
    if (read_def(&args, &def) < 0) return om_cli_usage("study");
    const OmProgress* progress = om_cli_study_begin(&args);
    OmStatus status = om_cli_weights_path(&args, weights, sizeof weights);
    const char* const input[] = {weights};
    if (status == OM_OK) status = om_cli_check_apart(def.out_dir, input, 1);
    if (status == OM_OK) status = om_study_methods_run(&def, progress, &summary);
    if (status < 0) return om_cli_fail_kept("study", status);
    om_cli_progress_done();
    print_result(&summary, def.out_dir);
    return summary.is_met ? OM_EXIT_OK : OM_EXIT_FAILED;
}

const OmCliVerb om_cli_verb_study_methods = {
    .name = "study methods",
    .run = om_cli_study_methods,
    .summary = "finite elements, particles and a network, compared",
    .usage = "omentum study methods -o DIR [-w WEIGHTS] [options]",
    .about =
        "Thesis 3.8, Tables 3.5 to 3.7: a probe is pressed over the lesions of the breast phantom, and each\n"
        "method predicts their displacements. DIR receives report.html, study.json and errors.csv. Exit\n"
        "code 0: the network's error exceeds that of finite elements by at most 0.3 mm at every depth, and\n"
        "all paths were completed; 1: otherwise.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example =
        "  omentum study methods -o out/methods\n"
        "  omentum study methods -w out/umesh/weights.safetensors --truth-from out/contact -o out/methods \\\n"
        "      --truth 35000 --clusters 10.2,9.1,0.55",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
