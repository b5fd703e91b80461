// cli_rl_demo.c: omentum rl demo.
#include "cli_rl.h"
#include "omentum/rl_demo.h"

static const OmCliOption option[] = {
    OM_CLI_RL_TASK,
    {"--output", "-o", "FILE", "demonstrations, HDF5 as robomimic has it"},
    {"--number", "-n", "N", "demonstrations", "35", NULL, 1, 100000},
    {"--seed", NULL, "N", "seed of the starts and the expert's noise", "1", NULL, 0, 2147483647},
    {"--quiet", "-q", NULL, "no progress"},
};

static const OmCliKey result_key[] = {
    {"demonstrations", "number of demonstrations"},
    {"steps", "of all demonstrations"},
    {"score", "mean score"},
};

static OmStatus record(const OmCliArgs* args, const OmRlTask* task) {
    const char* path = om_cli_get(args, "--output");
    int number = 35, seed = 1;
    OmRlDemos demos;
    OM_TRY(om_cli_int(args, "--number", &number));
    OM_TRY(om_cli_int(args, "--seed", &seed));
    OM_TRY(om_file_check_ours(path, "omentum demonstrations"));
    om_cli_clean_beside(path);
    const OmProgress* progress = om_cli_progress(om_cli_get(args, "--quiet") != NULL);
    OM_TRY(om_rl_demos_record(task, number, (uint64_t)seed, progress, &demos));
    om_cli_progress_done();
    OmStatus status = om_rl_demos_save(&demos, path);
    double sum = 0;
    for (int k = 0; k < demos.ndemo; ++k) sum += demos.score[k];
    if (status >= 0) {
        om_cli_figure("demonstrations", demos.ndemo);
        om_cli_figure("steps", demos.nstep);
        om_cli_figure("score", sum / demos.ndemo);  // ndemo > 0
        om_cli_path(path);
        printf("%d demonstrations, %d steps, mean score %.3f: %s\n", demos.ndemo, demos.nstep,
               sum / demos.ndemo, path);
    }
    om_rl_demos_done(&demos);
    return status;
}

int om_cli_rl_demo(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    int npositional;
    OmRlTask* task = NULL;
    OmStatus status = om_cli_check(&args, 0, &npositional);
    if (status >= 0) status = om_cli_rl_task(&args, &task);
    if (status >= 0 && !om_cli_get(&args, "--output"))
        status = om_error(OM_INVALID, "give the file of demonstrations (-o FILE)");
    if (status < 0) {
        fprintf(stderr, "omentum rl demo: %s\n", om_error_message());
        om_rl_task_destroy(task);
        return OM_EXIT_USAGE;
    }
    status = record(&args, task);
    om_rl_task_destroy(task);
    return status < 0 ? om_cli_fail("rl demo", status) : OM_EXIT_OK;
}

const OmCliVerb om_cli_verb_rl_demo = {
    .name = "rl demo",
    .run = om_cli_rl_demo,
    .summary = "record demonstrations of a task by its scripted expert",
    .usage = "omentum rl demo -t TASK -o FILE [options]",
    .about =
        "The expert acts with the noise of a person, from drawn starts. FILE is HDF5 in the layout of\n"
        "robomimic; omentum rl train reads it for gail and clone.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum rl demo -t reach -o out/demos.hdf5",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
