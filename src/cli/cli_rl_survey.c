// cli_rl_survey.c: omentum rl survey.
#include "cli_rl.h"
#include "omentum/rl_retract.h"

static const OmCliOption option[] = {
    OM_CLI_RL_TASK,
    {"--workers", NULL, "N", "threads; the result does not depend on it", "one per processor", NULL,
     0, OM_MAX_WORKER},
};

static const OmCliKey result_key[] = {
    {"near", "largest TE of a place in the third at the fixed side"},
    {"best", "largest TE of a place"},
    {"mean", "mean TE of all places"},
};

// Print the table and its figures.
static void print_survey(const OmRlSurvey* s) {
    double near = 0, best = 0, sum = 0;
    printf(
        "TE by grasping place; rows: mm from the fixed side, columns: mm from the middle\n      ");
    for (int j = 0; j < OM_RL_GRID; ++j) printf(" %6.1f", 1e3 * s->across[j]);
    for (int i = 0; i < OM_RL_GRID; ++i) {
        printf("\n%6.1f", 1e3 * s->along[i]);
        for (int j = 0; j < OM_RL_GRID; ++j) {
            double e = s->exposure[i][j];
            printf(" %6.2f", e);
            sum += e;
            if (e > best) best = e;
            if (3 * i < OM_RL_GRID && e > near) near = e;
        }
    }
    om_cli_figure("near", near);
    om_cli_figure("best", best);
    om_cli_figure("mean", sum / (OM_RL_GRID * OM_RL_GRID));
    printf("\nthird at the fixed side: at most %.2f; best place: %.2f\n", near, best);
}

int om_cli_rl_survey(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    int npositional, nworker = 0;
    OmRlTask* task = NULL;
    OmStatus status = om_cli_check(&args, 0, &npositional);
    if (status >= 0) status = om_cli_int(&args, "--workers", &nworker);
    if (status >= 0) status = om_cli_rl_task(&args, &task);
    if (status < 0) return om_cli_usage("rl survey");
    OmRlSurvey survey;
    status = om_rl_retract_survey(task, nworker, &survey);
    om_rl_task_destroy(task);
    if (status < 0) return om_cli_fail("rl survey", status);
    print_survey(&survey);
    return OM_EXIT_OK;
}

const OmCliVerb om_cli_verb_rl_survey = {
    .name = "rl survey",
    .run = om_cli_rl_survey,
    .summary = "tumour exposure by grasping place, by brute force",
    .usage = "omentum rl survey -t retract [options]",
    .about =
        "Grasps the fat of the task retract at 7 x 7 places, lifts it straight to p_T, and measures the\n"
        "exposure of the tumour (TE) in the endoscope's picture.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum rl survey -t retract\n  omentum rl survey -t retract -s tissue=thesis",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
