// cli_rl_eval.c: omentum rl eval.
#include <math.h>
#include <string.h>

#include "cli_rl.h"
#include "omentum/rl_policy.h"

static const OmCliOption option[] = {
    OM_CLI_RL_TASK,
    {"--policy", "-p", "FILE", "policy.safetensors of omentum rl train"},
    {"--expert", NULL, NULL, "the task's scripted expert acts"},
    {"--random", NULL, NULL,
     "draw actions from the policy, not the most probable one; without a "
     "policy: random actions"},
    {"--episodes", "-n", "N", "episodes", "one from each start of the evaluation, or 100 drawn",
     NULL, 1, 10000},
    {"--drawn", NULL, NULL, "drawn starts instead of those of the evaluation: to choose settings"},
    {"--seed", NULL, "N", "seed of the episodes", "1000", NULL, 0, 2147483647},
    {"--output", "-o", "FILE", "table of the episodes, CSV"},
    {"--workers", NULL, "N", "threads; the result does not depend on it", "one per processor", NULL,
     0, OM_MAX_WORKER},
    {"--quiet", "-q", NULL, "no progress"},
};

static const OmCliKey result_key[] = {
    {"episodes", "number of episodes"}, {"return", "mean return"},         {"score", "mean score"},
    {"lowest_score", "lowest score"},   {"steps", "mean number of steps"},
};

static OmStatus print_table(const OmRlTask* task, const OmRlEval* e, OmText* text) {
    OM_TRY(om_text_append(text, "episode,return,score,steps,ended"));
    for (int k = 0; k < task->ninfo; ++k) OM_TRY(om_text_append(text, ",%s", task->info_name[k]));
    for (int i = 0; i < e->nepisode; ++i) {
        OM_TRY(om_text_append(text, "\n%d,%.9g,%.9g,%d,%d", e->episode[i], e->ret[i], e->score[i],
                              e->length[i], e->is_ended[i]));
        for (int k = 0; k < task->ninfo; ++k)
            OM_TRY(om_text_append(text, ",%.9g", e->info[(ptrdiff_t)i * task->ninfo + k]));
    }
    return om_text_append(text, "\n");
}

static OmStatus save_table(const OmRlTask* task, const OmRlEval* e, const char* path) {
    OmText text = {0};
    OmStatus status = print_table(task, e, &text);
    if (status >= 0) status = om_text_seal(&text);
    if (status >= 0) status = om_file_check_ours(path, NULL);
    if (status >= 0) status = om_file_write(path, text.str, text.len);
    if (status >= 0) om_cli_path(path);
    om_text_done(&text);
    return status;
}

// The scores of the starts, in rows of a square where their number is a square.
static void print_scores(const OmRlTask* task, const OmRlEvalDef* def, const OmRlEval* e) {
    int side = (int)lround(sqrt(e->nepisode));
    if (def->is_drawn || side * side != e->nepisode || e->nepisode != task->nstart || side > 16)
        return;
    for (int i = 0; i < e->nepisode; ++i)
        printf("%6.2f%s", e->score[i], i % side == side - 1 ? "\n" : "");
}

// What a user should know of the tissue before trusting the scores.
static void print_tissue(const OmRlTask* task, const OmRlEval* e) {
    for (int k = 0; k < task->ninfo; ++k) {
        const bool is_inverted = strcmp(task->info_name[k], "inverted") == 0;
        int nepisode = 0;
        double most = 0;
        if (!is_inverted && strcmp(task->info_name[k], "slips") != 0) continue;
        for (int i = 0; i < e->nepisode; ++i) {
            const double value = e->info[(ptrdiff_t)i * task->ninfo + k];
            nepisode += value > 0;
            if (value > most) most = value;
        }
        if (nepisode == 0) continue;
        printf("in %d of %d episodes ", nepisode, e->nepisode);
        if (is_inverted)
            printf("elements were inverted, at most %.0f in a step\n", most);
        else
            printf("the fat slipped out of the jaws, at most %.0f times\n", most);
    }
}

// After a cancellation: the figures and the table of the finished episodes, if there are any.
static OmStatus evaluate(const OmCliArgs* args, const OmRlTask* task, OmRlPolicy* policy,
                         bool* is_good, bool* is_partial) {
    OmRlEval e = {0};
    int seed = 1000;
    OmStatus status = OM_OK;
    OmRlEvalDef def = om_rl_eval_default_def(task, policy);
    OM_TRY_DONE(om_cli_int(args, "--episodes", &def.nepisode));
    OM_TRY_DONE(om_cli_int(args, "--seed", &seed));
    OM_TRY_DONE(om_cli_int(args, "--workers", &def.nworker));
    def.seed = (uint64_t)seed;
    def.is_drawn = om_cli_get(args, "--drawn") != NULL;
    def.is_random = om_cli_get(args, "--random") != NULL;
    def.is_expert = om_cli_get(args, "--expert") != NULL;
    const OmStatus outcome =
        om_rl_eval_run(&def, om_cli_progress(om_cli_get(args, "--quiet") != NULL), &e);
    om_cli_progress_done();
    status = outcome;
    if (outcome < 0 && e.nepisode == 0) goto done;
    status = OM_OK;
    if (om_cli_get(args, "--output"))
        OM_TRY_DONE(save_table(task, &e, om_cli_get(args, "--output")));
    om_cli_figure("episodes", e.nepisode);
    om_cli_figure("return", e.mean_return);
    om_cli_figure("score", e.mean_score);
    om_cli_figure("lowest_score", e.min_score);
    om_cli_figure("steps", e.mean_length);
    print_scores(task, &def, &e);
    printf("%d %sepisodes: %s %.3f, lowest %.3f; return %.2f, %.1f steps\n", e.nepisode,
           outcome < 0 ? "finished " : "", task->score_name ? task->score_name : "return",
           e.mean_score, e.min_score, e.mean_return, e.mean_length);
    print_tissue(task, &e);
    *is_partial = outcome < 0;
    if (*is_partial)
        OM_TRY_DONE(om_error(outcome,
                             "cancelled; the figures are partial, of the %d finished episodes",
                             e.nepisode));
    *is_good = !(e.mean_score < task->target);
    if (!*is_good) om_cli_reason("the mean score is below the task's target");
done:
    om_rl_eval_done(&e);
    return status;
}

int om_cli_rl_eval(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    const char* path = NULL;
    int npositional;
    OmRlTask* task = NULL;
    OmRlPolicy* policy = NULL;
    bool is_good = true, is_partial = false;
    OmStatus status = om_cli_check(&args, 0, &npositional);
    if (status >= 0) path = om_cli_get(&args, "--policy");
    if (status >= 0 && !path && !om_cli_get(&args, "--expert") && !om_cli_get(&args, "--random"))
        status = om_error(OM_INVALID, "give a policy (-p FILE), --expert or --random");
    if (status < 0) return om_cli_usage("rl eval");
    if (path) status = om_rl_policy_load(path, &policy);
    if (status < 0) return om_cli_fail("rl eval", status);
    status =
        path ? om_cli_rl_policy_task(&args, policy, path, &task) : om_cli_rl_task(&args, &task);
    if (status < 0) {
        om_rl_task_destroy(task);
        om_rl_policy_destroy(policy);
        return om_cli_usage("rl eval");
    }
    status = evaluate(&args, task, policy, &is_good, &is_partial);
    om_rl_task_destroy(task);
    om_rl_policy_destroy(policy);
    if (is_partial) {
        fprintf(stderr, "omentum rl eval: %s\n", om_error_message());
        return OM_EXIT_CANCELLED;
    }
    if (status < 0) return om_cli_fail("rl eval", status);
    return is_good ? OM_EXIT_OK : OM_EXIT_FAILED;
}

const OmCliVerb om_cli_verb_rl_eval = {
    .name = "rl eval",
    .run = om_cli_rl_eval,
    .summary = "run episodes of a policy, of an expert or of random actions",
    .usage = "omentum rl eval -t TASK -p FILE [options]",
    .about =
        "Runs one episode from each start of the task's evaluation, or drawn ones. The policy takes the\n"
        "most probable action. Task and settings that are not given are those that it was trained with; a warning\n"
        "names each that is another one. Exit code 1: the mean score is below the task's target. When it is\n"
        "stopped, it gives the figures of the finished episodes.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum rl eval -t reach -p out/reach/policy.safetensors\n"
               "  omentum rl eval -t reach --expert -n 200 -o out/expert.csv",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
