// cli_study_calibration.c: omentum study calibration.
#include <stdio.h>

#include "cli_study.h"
#include "studies/study.h"

static const OmCliOption option[] = {
    {"--output", "-o", "DIR", "folder of the study; finished results there are kept"},
    {"--quick", NULL, NULL, "three lesions, coarse particles and truth, few evaluations"},
    {"--lesions-used", NULL, "N", "use the first N lesions of the breast", "all ten", NULL, 2, 20},
    {"--tune-on", NULL, "N", "lesion for the fine-tuning; the others are the test", "1"},
    {"--truth", NULL, "N", "elements of the breast's quadratic truth", "12000", NULL, 1000,
     1000000},
    {"--truth-from", NULL, "DIR", "folder of a contact study: its truth of the breast is used"},
    OM_CLI_STUDY_OPTIONS,
};

static const OmCliKey result_key[] = {
    {"unseen_particles_mm", "error on unseen lesions, with tuned parameters"},
    {"unseen_gel_mm", "the same, with the parameters of the gel"},
    {"unseen_elements_mm", "the same, of finite elements"},
    {"unseen_rigid_mm", "the same, of a rigid body"},
    {"evaluations", "simulations in all"},
};

// Few lesions, coarse particles and searches of a few evaluations.
static void make_quick(OmStudyCalibrationDef* def) {
    def->nlesion = 3;
    def->spacing = 0.008;
    def->settle = 0;
    def->population = 6;
    def->max_generations = 2;
    def->max_local = 10;
    def->has_sensitivity = false;
    def->truth_ntet = 1000;
    def->gel_truth_ntet = 2000;
    def->fe_ntet = 1363;
    def->contact_ntri = 2000;
}

static OmStatus read_def(const OmCliArgs* args, OmStudyCalibrationDef* def) {
    int tuned = 1, npositional;
    OM_TRY(om_cli_check(args, 0, &npositional));
    OM_CHECK(def->out_dir, OM_INVALID, "no output folder is given; add -o DIR");
    if (om_cli_get(args, "--quick")) make_quick(def);
    OM_TRY(om_cli_int(args, "--lesions-used", &def->nlesion));
    OM_TRY(om_cli_get_int(args, "--tune-on", 1, def->nlesion, &tuned));
    def->tuned = tuned - 1;
    def->truth_dir = om_cli_get(args, "--truth-from");
    OM_TRY(om_cli_int(args, "--truth", &def->truth_ntet));
    return om_cli_int(args, "--workers", &def->nworker);
}

static void print_result(const OmStudyCalibrationSummary* r, const char* dir) {
    om_cli_figure("unseen_particles_mm", 1e3 * r->unseen[OM_FIT_TUNED]);
    om_cli_figure("unseen_gel_mm", 1e3 * r->unseen[OM_FIT_GEL]);
    om_cli_figure("unseen_elements_mm", 1e3 * r->unseen[OM_FIT_PRESCRIBED]);
    om_cli_figure("unseen_rigid_mm", 1e3 * r->unseen[OM_FIT_RIGID]);
    om_cli_figure("evaluations", r->neval);
    om_cli_path(dir);
    printf("gel: spacing %.2f mm, radius %.2f mm, stiffness %.3f; error %.2f mm\n", 1e3 * r->gel[0],
           1e3 * r->gel[1], r->gel[2], 1e3 * r->gel_error);
    printf("breast: spacing %.2f mm, radius %.2f mm, stiffness %.3f; error %.2f mm, %.2f before\n",
           1e3 * r->tuned[0], 1e3 * r->tuned[1], r->tuned[2], 1e3 * r->tuned_error,
           1e3 * r->tuned_start);
    printf("unseen lesions: particles %.2f mm (gel's parameters %.2f), finite elements %.2f, "
           "rigid %.2f\n",
           1e3 * r->unseen[OM_FIT_TUNED], 1e3 * r->unseen[OM_FIT_GEL],
           1e3 * r->unseen[OM_FIT_PRESCRIBED], 1e3 * r->unseen[OM_FIT_RIGID]);
    printf("%d evaluations (%d new); criterion: %s\nreport: %s/report.html\n", r->neval, r->nnew,
           r->is_met ? "met" : "missed", dir);
}

int om_cli_study_calibration(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    OmStudyCalibrationSummary summary;
    OmStudyCalibrationDef def = om_study_calibration_default_def(om_cli_get(&args, "--output"));
    if (read_def(&args, &def) < 0) return om_cli_usage("study");
    const OmProgress* progress = om_cli_study_begin(&args);
    OmStatus status = om_study_calibration_run(&def, progress, &summary);
    if (status < 0) return om_cli_fail_kept("study", status);
    om_cli_progress_done();
    print_result(&summary, def.out_dir);
    return summary.is_met ? OM_EXIT_OK : OM_EXIT_FAILED;
}

const OmCliVerb om_cli_verb_study_calibration = {
    .name = "study calibration",
    .run = om_cli_study_calibration,
    .summary = "particles calibrated on gel, tested on a breast",
    .usage = "omentum study calibration -o DIR [options]",
    .about =
        "The experiment of thesis 3.5.1: cluster parameters of particles are searched on a box of gel with\n"
        "three beads, fine-tuned on one lesion of the breast phantom and tested on the others; the truth is\n"
        "computed by finite elements. DIR receives report.html, study.json, errors.csv and one folder per\n"
        "search. After an interruption the same command continues the study. Exit code 0: the error on\n"
        "unseen lesions is at most 1.5 times that of finite elements; 1: it is larger.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example =
        "  omentum study calibration --quick -o out/quick\n"
        "  omentum study calibration -o out/calibration\n"
        "  omentum study calibration --tune-on 4 -o out/calibration-4\n"
        "  omentum study calibration --truth-from out/contact --truth 35000 -o out/calibration",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
