// cli_study_trust.c: omentum study trust.
#include <stdio.h>
#include <string.h>

#include "cli_study.h"
#include "studies/study_trust.h"

static const OmCliOption option[] = {
    {"--output", "-o", "DIR", "folder of the study; finished results there are kept"},
    {"--truths", NULL, "N", "lifted sheets, of five acquisitions each", "100", NULL, 1,
     OM_STUDY_TRUST_MAX_TRUTH},
    {"--quick", NULL, NULL, "at most four truths, on a coarse sheet: under a minute"},
    {"--seed", NULL, "COMMIT",
     "cases drawn from the hash of the sources (here), of a commit, or a hash; or development",
     "development"},
    {"--draw", NULL, "N", "of --seed: one of three draws", "1", NULL, 1, OM_STUDY_NDRAW},
    {"--draws", NULL, "FILE", "table to which a draw that was run is appended",
     "doc/draws.csv of the checkout"},
    OM_CLI_STUDY_OPTIONS,
};

static const OmCliKey result_key[] = {
    {"right", "right acquisitions"},
    {"right_refused", "of which were refused"},
    {"wrong", "acquisitions with one error"},
    {"bad", "of which were accepted with a Dice more than 0.15 below that of the right data"},
    {"ece", "expected calibration error of the probabilities of accepted updates"},
    {"brier", "their Brier score"},
    {"dice", "median Dice of accepted right acquisitions"},
    {"processor_ms", "processor time of an update, median"},
};

static OmStatus read_def(const OmCliArgs* args, OmStudyTrustDef* def) {
    int npositional;
    OM_TRY(om_cli_check(args, 0, &npositional));
    OM_CHECK(def->out_dir, OM_INVALID, "no output folder is given; add -o DIR");
    def->is_quick = om_cli_get(args, "--quick") != NULL;
    OM_TRY(om_cli_int(args, "--truths", &def->ntruth));
    return om_cli_int(args, "--workers", &def->nworker);
}

static void print_result(const OmStudyTrustSummary* s, const char* dir) {
    om_cli_figure("right", s->nright);
    om_cli_figure("right_refused", s->nright_refused);
    om_cli_figure("wrong", s->nwrong);
    om_cli_figure("bad", s->nbad);
    om_cli_figure("ece", s->all.ece);
    om_cli_figure("brier", s->all.brier);
    om_cli_figure("dice", s->dice_right);
    om_cli_figure("processor_ms", s->ms);
    om_cli_path(dir);
    printf("right data: %d of %d refused, median Dice %.2f, %.0f ms an update\n", s->nright_refused,
           s->nright, s->dice_right, s->ms);
    for (int i = 0; i < OM_STUDY_TRUST_NKIND; ++i) {
        const OmStudyTrustKind* k = &s->kind[i];
        printf("%-9s %3d cases: %3d accepted, %3d corrected, %3d refused (%3d with the right "
               "cause), %d bad\n",
               k->name, k->n, k->nclean, k->ncorrected, k->nrefused, k->nnamed, k->nbad);
    }
    printf("wrong data: %d of %d bad, %d refused, median Dice of the accepted %.2f\n", s->nbad,
           s->nwrong, s->nwrong_refused, s->dice_wrong);
    printf("with a right one: other tissue left out or refused in %d of %d, %d bad\n", s->ntwo_out,
           s->ntwo, s->ntwo_bad);
    printf("calibration error %.3f (right data %.3f), Brier %.3f (attached or not: %.3f)\n",
           s->all.ece, s->right.ece, s->all.brier, s->all.brier_hard);
    printf("the goal of 2 bad of 500, %g %% refused and a calibration error of %g is %s\n",
           100 * OM_STUDY_TRUST_REFUSED, OM_STUDY_TRUST_ECE, s->is_met ? "met" : "missed");
    printf("report: %s/report.html\n", dir);
}

int om_cli_study_trust(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    OmStudyTrustDef def = om_study_trust_default_def(om_cli_get(&args, "--output"));
    char table[1024];
    if (read_def(&args, &def) < 0 ||
        om_cli_study_draw(&args, &def.draw, table, sizeof table, &def.draws) < 0)
        return om_cli_usage("study");
    om_log_set_sink(NULL, NULL);  // a wrong acquisition may warn
    OmStudyTrustSummary summary;
    const OmProgress* progress = om_cli_study_begin(&args);
    OmStatus status = om_study_trust_run(&def, progress, &summary);
    om_cli_progress_done();
    if (status < 0) return om_cli_fail_kept("study", status);
    print_result(&summary, def.out_dir);
    return summary.is_met ? OM_EXIT_OK : OM_EXIT_FAILED;
}

const OmCliVerb om_cli_verb_study_trust = {
    .name = "study trust",
    .run = om_cli_study_trust,
    .summary = "right and wrong depth pictures: which update of the attachments is accepted",
    .usage = "omentum study trust -o DIR [options]",
    .about =
        "Sheets of the simulated world are lifted to five heights. Each picture updates the attachments of a\n"
        "twin as it is, and with one error of a list: a camera that is shifted or turned, a wrong focal\n"
        "length, scale or convention of depth, missing depth, colour mirrored, a wrong pose, other tissue. The\n"
        "report counts by kind which are accepted, corrected and refused, and judges the probabilities. DIR\n"
        "receives report.html, study.json, cases.csv and two files per truth (3 MB); after an interruption the\n"
        "same command continues the study. Exit code 0: at most 2 of 500 wrong acquisitions are accepted with\n"
        "a Dice more than 0.15 below that of the right data, at most 1 % of the right ones is refused, and the\n"
        "expected calibration error is at most 0.05; 1: one of these is missed.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum study trust --quick -o out/quick\n"
               "  omentum study trust -o out/trust\n"
               "  omentum study trust --seed here -o out/judged",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
