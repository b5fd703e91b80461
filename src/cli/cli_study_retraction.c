// cli_study_retraction.c: omentum study retraction, in parts.
#include <stdio.h>
#include <string.h>

#include "cli_study.h"
#include "studies/study_retraction.h"

static const OmCliOption option[] = {
    {"--output", "-o", "DIR", "folder of the study; finished runs there are kept"},
    {"--part", NULL, "PART",
     "scenarios, threshold, replanning, laboratory, random, kidney, ablations, alarms or searches",
     "all but the kidney"},
    {"--quick", NULL, NULL, "a coarse sheet and a few cases of every part: under a minute"},
    {"--cases", NULL, "N", "the first N scenarios, pairs, sheets or laboratory cases", "all", NULL,
     0, 1000},
    {"--first", NULL, "N", "random, ablations and alarms: the first pair or sheet, from 0", "0",
     NULL, 0, 99},
    {"--seed", NULL, "COMMIT",
     "random, ablations, alarms: cases drawn from the hash of the sources (here), a commit or a hash; or development",
     "the published ones"},
    {"--draw", NULL, "N", "of --seed: one of three draws", "1", NULL, 1, OM_STUDY_NDRAW},
    {"--draws", NULL, "FILE", "table to which a draw that was run is appended",
     "doc/draws.csv of the checkout"},
    {"--data", NULL, "DIR", "kidney: the folder that holds ct_abdomen"},
    OM_CLI_STUDY_OPTIONS,
};

static const OmCliKey result_key[] = {
    {"success", "scenarios that DEFRAS exposed with a true force of at most 1.2 epsilon"},
    {"possible", "scenarios that the search or a run exposes"},
    {"runs", "runs and searches of the parts"},
    {"new_runs", "of which were made now"},
    {"epsilon_n", "force threshold of the scenarios"},
    {"replan_ms", "processor time of one plan on 5 x 5 blocks, 30 % attached"},
};

static OmStatus read_part(const char* name, int* parts) {
    static const char* const part[] = {"scenarios",  "threshold", "replanning",
                                       "laboratory", "random",    "kidney",
                                       "ablations",  "alarms",    "searches"};
    const int n = sizeof part / sizeof *part;
    for (int i = 0; i < n; ++i)
        if (strcmp(name, part[i]) == 0) {
            *parts = 1 << i;
            return OM_OK;
        }
    const char* near = om_nearest_word(name, part, n);
    return om_error(OM_INVALID, "--part \"%s\" is unknown; %s%s", name, near ? "did you mean " : "",
                    near ? near : "--help has the parts");
}

static OmStatus read_def(const OmCliArgs* args, OmStudyRetractionDef* def) {
    int npositional;
    OM_TRY(om_cli_check(args, 0, &npositional));
    OM_CHECK(def->out_dir, OM_INVALID, "no output folder is given; add -o DIR");
    const char* part = om_cli_get(args, "--part");
    if (part) OM_TRY(read_part(part, &def->parts));
    def->data = om_cli_get(args, "--data");
    def->is_quick = om_cli_get(args, "--quick") != NULL;
    OM_TRY(om_cli_int(args, "--cases", &def->ncase));
    OM_TRY(om_cli_int(args, "--first", &def->first));
    return om_cli_int(args, "--workers", &def->nworker);
}

static void print_group(const char* title, const OmRetractionScore* score) {
    static const char* const row[OM_RETRACTION_NROW] = {
        "DEFRAS",        "FRAS, believed", "FRAS, true",    "no plan before",
        "no monitoring", "no learning",    "no look-ahead", "no check",
        "no network",    "one arm",        "open loop"};
    for (int i = 0; i < OM_RETRACTION_NROW; ++i) {
        const OmRetractionScore* r = &score[i];
        if (r->nrun == 0) continue;
        printf("%s, %s: %d of %d exposed, %d of the %d possible; %.0f %%, %.3g actions, %.3g force "
               "events, %.2f epsilon by the twin, %.2f in truth\n",
               title, row[i], r->nsuccess, r->nrun, r->nsuccess_possible, r->npossible,
               100 * r->visibility, r->actions, r->events, r->force, r->force_world);
    }
}

static void print_result(const OmStudyRetractionSummary* s, const char* dir) {
    const OmRetractionScore* d = &s->scenario[OM_RETRACTION_DEFRAS];
    om_cli_figure("success", d->nsuccess);
    om_cli_figure("possible", d->npossible);
    om_cli_figure("runs", s->nrun);
    om_cli_figure("new_runs", s->nnew);
    om_cli_figure("epsilon_n", s->epsilon);
    om_cli_figure("replan_ms", 1e3 * s->replan[0][1]);
    om_cli_path(dir);
    print_group("scenarios", s->scenario);
    print_group("laboratory", s->laboratory);
    if (s->pairs.ndrawn > 0)
        printf("random pairs: %d drawn; in %d a wrong belief does no harm, %d are not possible, %d "
               "count\n",
               s->pairs.ndrawn, s->pairs.nharmless, s->pairs.nimpossible, s->pairs.ncounting);
    print_group("random pairs", s->random);
    print_group("kidney", s->kidney);
    print_group("right attachments", s->alarm);
    if (s->alarm[OM_RETRACTION_DEFRAS].nrun > 0)
        printf("false alarms: %d of %d runs\n", s->alarm[OM_RETRACTION_DEFRAS].nfalse,
               s->alarm[OM_RETRACTION_DEFRAS].nrun);
    if (s->force.nrun > 0)
        printf("epsilon: %.2f N over %d grasps; the study uses %.2f N\n", s->force.threshold,
               s->force.nrun, s->epsilon);
    if (s->replan[0][0] >= 0)
        printf("a plan on 5 x 5 blocks takes %.1f ms, on 10 x 10 %.1f ms\n", 1e3 * s->replan[0][1],
               1e3 * s->replan[OM_RETRACTION_NGRID - 1][1]);
    printf("%d runs (%d new)\nreport: %s/report.html\n", s->nrun, s->nnew, dir);
}

int om_cli_study_retraction(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    OmStudyRetractionDef def = om_study_retraction_default_def(om_cli_get(&args, "--output"));
    char table[1024];
    if (read_def(&args, &def) < 0 ||
        om_cli_study_draw(&args, &def.draw, table, sizeof table, &def.draws) < 0)
        return om_cli_usage("study");
    om_log_set_sink(NULL, NULL);  // warnings of single runs are in their reports
    OmStudyRetractionSummary summary;
    const OmProgress* progress = om_cli_study_begin(&args);
    OmStatus status = om_study_retraction_run(&def, progress, &summary);
    om_cli_progress_done();
    if (status < 0) return om_cli_fail_kept("study", status);
    print_result(&summary, def.out_dir);
    const OmRetractionScore* d = &summary.scenario[OM_RETRACTION_DEFRAS];
    return d->nsuccess_possible == d->npossible ? OM_EXIT_OK : OM_EXIT_FAILED;
}

const OmCliVerb om_cli_verb_study_retraction = {
    .name = "study retraction",
    .run = om_cli_study_retraction,
    .summary = "retraction with wrong beliefs: DEFRAS, FRAS and what is possible",
    .usage = "omentum study retraction -o DIR [options]",
    .about =
        "The experiments of thesis chapter 6. Eight sheets, each with fewer and with more attachments than\n"
        "believed, are retracted by DEFRAS and by FRAS. Further parts: the force threshold, re-planning\n"
        "times, a silicone sheet, 100 random pairs, a kidney, DEFRAS without one module each, false alarms\n"
        "on 100 sheets with right attachments, and exhaustive searches that tell what is possible. DIR\n"
        "receives report.html, study.json and one folder per run; after an interruption the same command\n"
        "continues the study. Exit code 0: every scenario that can be exposed was exposed; 1: one was not.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum study retraction --quick -o out/quick\n"
               "  omentum study retraction --part scenarios -o out/retraction\n"
               "  omentum study retraction --part kidney --data /path/to/data -o out/retraction",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
