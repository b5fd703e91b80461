// cli_study_sheet.c: omentum study sheet-calibration.
#include <stdio.h>

#include "cli_common.h"
#include "omentum/study_sheet.h"

static const OmCliOption option[] = {
    {"--output", "-o", "DIR", "folder of the study; what is finished there is not done again"},
    {"--quick", NULL, NULL, "coarse particles and elements, few evaluations: under a minute"},
    {"--leave-one-out", NULL, NULL, "hold out each of the five pinch points in turn"},
    {"--seed", NULL, "N", "of the search (default 1)"},
    {"--workers", NULL, "N", "threads (default: one a processor)"},
    {"--quiet", "-q", NULL, "no progress"},
    {"--help", "-h", NULL, "this text"},
};

static void print_help(const OmCliArgs* args) {
    printf(
        "omentum study sheet-calibration: particles calibrated on a sheet that a depth camera watched\n\n"
        "Usage: omentum study sheet-calibration -o DIR [options]\n\n"
        "The experiment of thesis 5.4.1: a 90 x 90 mm sheet of 3 mm, fixed on one side, is lifted at five pinch\n"
        "points by 10, 20 and 30 mm; spacing, radius and stiffness of the clusters are found from the point\n"
        "clouds of four and judged on the fifth. Finite elements stand for the silicone. DIR receives report.html,\n"
        "study.json, clouds.csv and a folder a search: started again after it was stopped, it goes on where it\n"
        "was. Exit code 0: the average error, also of the unseen pinch point, is at most 2 mm; 1: it is not.\n");
    om_cli_print_options(args);
    printf("\nExamples:\n"
           "  omentum study sheet-calibration --quick -o out/quick\n"
           "  omentum study sheet-calibration -o out/sheet\n"
           "  omentum study sheet-calibration --leave-one-out -o out/sheet\n");
}

static OmStatus read_def(const OmCliArgs* args, OmStudySheetDef* def) {
    int npositional, seed = (int)def->seed;
    OM_TRY(om_cli_check(args, 1, &npositional));
    OM_CHECK(def->out_dir, OM_INVALID, "no output folder is given; add -o DIR");
    if (om_cli_get(args, "--quick")) {
        def->cells = 10;
        def->world_cells = 14;
        def->population = 6;
        def->generations = 3;
        def->local_evaluations = 15;
        def->rise = 0;
    }
    def->has_all_folds = om_cli_get(args, "--leave-one-out") != NULL;
    OM_TRY(om_cli_get_int(args, "--seed", 0, 2147483647, &seed));
    def->seed = (uint64_t)seed;
    return om_cli_get_int(args, "--workers", 0, OM_MAX_WORKER, &def->nworker);
}

static void print_result(const OmStudySheetSummary* r, const char* dir) {
    printf("all clouds: %.2f mm with the thesis's parameters, %.2f mm with those found\n",
           1e3 * r->thesis, 1e3 * r->found);
    printf("pinch points that no search saw: %.2f mm, %.2f mm\n", 1e3 * r->unseen_thesis,
           1e3 * r->unseen_found);
    printf("spacing %.3g mm, radius %.3g mm, stiffness %.3g\n", 1e3 * r->best[0], 1e3 * r->best[1],
           r->best[2]);
    printf("%d evaluations (%d new); the goal of 2 mm for both is %s\n", r->neval, r->nnew,
           r->is_met ? "met" : "missed");
    printf("report: %s/report.html\n", dir);
}

int om_cli_study_sheet(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    if (om_cli_get(&args, "--help")) {
        print_help(&args);
        return OM_EXIT_OK;
    }
    OmStudySheetDef def = om_study_default_sheet_def(om_cli_get(&args, "--output"));
    if (read_def(&args, &def) < 0) {
        fprintf(stderr, "omentum study: %s\n", om_error_message());
        return OM_EXIT_USAGE;
    }
    om_log_set_sink(NULL, NULL);  // warnings about parameters that are merely tried
    OmStudySheetSummary summary;
    const OmProgress* progress = om_cli_progress(om_cli_get(&args, "--quiet") != NULL);
    OmStatus status = om_study_run_sheet(&def, progress, &summary);
    om_cli_progress_done();
    if (status < 0) return om_cli_fail_kept("study", status);
    print_result(&summary, def.out_dir);
    return summary.is_met ? OM_EXIT_OK : OM_EXIT_FAILED;
}
