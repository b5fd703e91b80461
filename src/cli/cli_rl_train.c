// cli_rl_train.c: omentum rl train.
#include <math.h>
#include <string.h>

#include "cli_rl.h"
#include "omentum/rl_demo.h"
#include "omentum/rl_train.h"

static const OmCliOption option[] = {
    OM_CLI_RL_TASK,
    {"--config", "-c", "FILE", "YAML with options by their names; the command line is stronger"},
    {"--output", "-o", "DIR", "policy, report, and the checkpoint from which training continues"},
    {"--method", "-m", "NAME", "ppo, gail or clone", "ppo"},
    {"--steps", "-n", "N", "steps of all environments together", "1000000", NULL, 1, 2e9},
    {"--seed", NULL, "N", "seed of the weights, the episodes and the actions", "1", NULL, 0,
     2147483647},
    {"--demos", "-d", "FILE", "demonstrations of omentum rl demo (gail, clone)"},
    {"--start", NULL, "FILE", "policy.safetensors whose weights are used at the start"},
    {"--environments", NULL, "N", "environments side by side", "16", NULL, 1, 65536},
    {"--horizon", NULL, "N", "steps of each environment an iteration", "64", NULL, 1, 65536},
    {"--batch", NULL, "N", "samples a descent", "256", NULL, 2, 1048576},
    {"--epochs", NULL, "N", "passes over the samples of an iteration", "3", NULL, 1, 1000},
    {"--rate", NULL, "R", "learning rate, falls linearly to 0", "0.0003", NULL, 0, 1},
    {"--gamma", NULL, "R", "discount", "0.99", NULL, 0, 1},
    {"--lambda", NULL, "R", "of generalised advantage estimation", "0.95", NULL, 0, 1},
    {"--clip", NULL, "R", "range of the ratio of probabilities", "0.2", NULL, 1e-6, 10},
    {"--clip-value", NULL, "R", "range of the change of the value; 0: none", "0.2", NULL, 0, 1e9},
    {"--entropy", NULL, "R", "weight of the entropy", "0.005", NULL, 0, 10},
    {"--sharpness", NULL, "R",
     "times the logits, little by little over the third quarter: above 1 drawn actions become the most probable ones",
     "1", NULL, 0.01, 100},
    {"--layers", NULL, "N", "hidden layers of actor and critic", "2", NULL, 1, 8},
    {"--width", NULL, "N", "units of a layer", "128", NULL, 1, 4096},
    {"--weight-reward", NULL, "R", "gail: weight of the task's reward", "0.2", NULL, 0, 1e6},
    {"--weight-gail", NULL, "R", "gail: weight of the discriminator's", "0.8", NULL, 0, 1e6},
    {"--clone-rate", NULL, "R", "learning rate of cloning", "that of --rate", NULL, 0, 1},
    {"--gail-rate", NULL, "R", "gail: learning rate of the discriminator", "0.0003", NULL, 0, 1},
    {"--gail-noise", NULL, "R", "gail: standard deviation added to its observations", "0.02", NULL,
     0, 10},
    {"--gail-actions", NULL, NULL, "gail: the discriminator sees actions beside observations"},
    {"--clone-epochs", NULL, "N", "epochs of cloning", "0; clone 200", NULL, 0, 1000000},
    {"--eval-period", NULL, "N",
     "iterations between evaluations of the most probable actions; the best policy is kept; 0: no "
     "evaluations, the last policy is kept",
     "0", NULL, 0, 1000000},
    {"--eval-episodes", NULL, "N", "episodes of an evaluation, from drawn starts", "32", NULL, 1,
     10000},
    {"--eval-seed", NULL, "N", "seed of these episodes", "2000", NULL, 0, 2147483647},
    {"--eval-set", NULL, "KEY=VALUE",
     "a setting of the task for evaluations, beside those of --set; may be repeated"},
    {"--eval-stop", NULL, "N",
     "stop after N evaluations in a row in which every episode reaches the task's target; 0: never",
     "0", NULL, 0, 1000000},
    {"--workers", NULL, "N", "threads; the result does not depend on it", "one per processor", NULL,
     0, OM_MAX_WORKER},
    {"--quiet", "-q", NULL, "no progress"},
};

static const OmCliKey result_key[] = {
    {"steps", "steps of all environments"},
    {"episodes", "finished episodes"},
    {"return", "mean return of the last 100 episodes"},
    {"score", "mean score of the last 100 episodes"},
    {"seconds", "of training, over all parts"},
    {"kept_step", "steps before the kept policy; 0: there were no evaluations"},
    {"eval_score", "mean score of the kept policy in its evaluation"},
    {"eval_lowest", "lowest score of it"},
};

static OmStatus read_def(const OmCliArgs* args, OmRlTrainDef* d) {
    int seed = (int)d->seed, nstep = (int)d->nstep, eval_seed = (int)d->eval_seed;
    const char* method = om_cli_get(args, "--method");
    for (int i = 0; method && i < OM_RL_NMETHOD; ++i)
        if (strcmp(method, om_rl_method_name((OmRlMethod)i)) == 0) d->method = (OmRlMethod)i;
    OM_CHECK(!method || strcmp(method, om_rl_method_name(d->method)) == 0, OM_INVALID,
             "--method %s: give ppo, gail or clone", method);
    OM_TRY(om_cli_int(args, "--steps", &nstep));
    OM_TRY(om_cli_int(args, "--seed", &seed));
    OM_TRY(om_cli_int(args, "--environments", &d->nenv));
    OM_TRY(om_cli_int(args, "--horizon", &d->horizon));
    OM_TRY(om_cli_int(args, "--batch", &d->batch));
    OM_TRY(om_cli_int(args, "--epochs", &d->nepoch));
    OM_TRY(om_cli_int(args, "--layers", &d->policy.nlayer));
    OM_TRY(om_cli_int(args, "--width", &d->policy.width));
    OM_TRY(om_cli_int(args, "--clone-epochs", &d->clone_epoch));
    OM_TRY(om_cli_int(args, "--workers", &d->nworker));
    OM_TRY(om_cli_int(args, "--eval-period", &d->eval_period));
    OM_TRY(om_cli_int(args, "--eval-episodes", &d->eval_nepisode));
    OM_TRY(om_cli_int(args, "--eval-seed", &eval_seed));
    OM_TRY(om_cli_int(args, "--eval-stop", &d->eval_stop));
    d->eval_seed = (uint64_t)eval_seed;
    const struct {
        const char* name;
        double* value;
    } number[] = {{"--rate", &d->rate},
                  {"--sharpness", &d->sharpness},
                  {"--gamma", &d->gamma},
                  {"--lambda", &d->lambda},
                  {"--clip", &d->clip},
                  {"--clip-value", &d->clip_value},
                  {"--entropy", &d->entropy},
                  {"--weight-reward", &d->weight_reward},
                  {"--weight-gail", &d->weight_gail},
                  {"--clone-rate", &d->clone_rate},
                  {"--gail-rate", &d->gail_rate},
                  {"--gail-noise", &d->gail_noise}};
    for (size_t i = 0; i < sizeof number / sizeof *number; ++i)
        OM_TRY(om_cli_double(args, number[i].name, number[i].value));
    d->nstep = nstep;
    d->seed = d->policy.seed = (uint64_t)seed;
    d->gail_actions = om_cli_get(args, "--gail-actions") != NULL;
    d->demos = om_cli_get(args, "--demos");
    d->start = om_cli_get(args, "--start");
    OM_CHECK(d->out_dir, OM_INVALID, "give the folder of the training (-o DIR)");
    const char* const of_eval[] = {"--eval-episodes", "--eval-seed", "--eval-set", "--eval-stop"};
    for (int i = 0; i < 4 && d->eval_period == 0; ++i)
        OM_CHECK(!om_cli_get(args, of_eval[i]), OM_INVALID,
                 "%s has no effect without evaluations; give --eval-period N", of_eval[i]);
    OM_CHECK(d->method == OM_RL_PPO || d->demos, OM_INVALID,
             "%s needs demonstrations (-d FILE); omentum rl demo makes them",
             om_rl_method_name(d->method));
    return OM_OK;
}

// A line of the live curve every few seconds.
static void print_row(void* ctx, const OmRlTrainRow* r) {
    double *last = ctx, now = om_clock_now();
    if (now - *last < 10 && !isfinite(r->eval_score)) return;
    *last = now;
    fprintf(stderr, "%10lld steps  %6lld episodes", (long long)r->step, (long long)r->nepisode);
    if (isfinite(r->mean_return))
        fprintf(stderr, "  return %9.2f  score %7.3f", r->mean_return, r->mean_score);
    else
        fprintf(stderr, "  %-31s", "none has ended yet");  // as wide as return and score
    fprintf(stderr, "  entropy %6.3f  %6.1f s", r->entropy, r->seconds);
    if (isfinite(r->eval_score)) fprintf(stderr, "  evaluation %7.3f", r->eval_score);
    fprintf(stderr, "\n");
}

// The row of the kept policy.
static const OmRlTrainRow* kept_row(const OmRlTrainResult* r) {
    for (int i = 0; i < r->nrow; ++i)
        if (r->row[i].step == r->kept_step) return &r->row[i];
    return NULL;
}

static void print_result(const OmRlTrainDef* def, const OmRlTrainResult* r) {
    const OmRlTrainRow *row = &r->row[r->nrow - 1], *kept = kept_row(r);
    om_cli_figure("steps", (double)row->step);
    om_cli_figure("episodes", (double)row->nepisode);
    om_cli_figure("return", row->mean_return);
    om_cli_figure("score", row->mean_score);
    om_cli_figure("seconds", r->seconds);
    om_cli_figure("kept_step", (double)r->kept_step);
    if (kept) {
        om_cli_figure("eval_score", kept->eval_score);
        om_cli_figure("eval_lowest", kept->eval_least);
    }
    om_cli_path(def->out_dir);
    printf("%s%lld steps, %lld episodes, %.1f min", r->is_resumed ? "resumed: " : "",
           (long long)row->step, (long long)row->nepisode, r->seconds / 60);
    if (row->nepisode > 0)
        printf("; last 100 episodes: return %.2f, score %.3f", row->mean_return, row->mean_score);
    if (kept)
        printf("\nkept: the policy after %lld steps; evaluation: score %.3f, lowest %.3f",
               (long long)kept->step, kept->eval_score, kept->eval_least);
    printf("\npolicy: %s/policy.safetensors\nreport: %s/report.html\n", def->out_dir, def->out_dir);
}

// A file of another tool may not say what its steps mean.
static void note_meaning(const OmRlTrainDef* def) {
    OmRlDemos demos;
    if (!def->demos || !def->task->meaning[0] || om_rl_demos_load(def->demos, &demos) < 0) return;
    if (!demos.meaning[0])
        fprintf(
            stderr,
            "omentum rl train: %s does not say its settings; those of the task are assumed: %s\n",
            def->demos, def->task->meaning);
    om_rl_demos_done(&demos);
}

static OmStatus train(const OmCliArgs* args, const OmRlTask* task, const OmRlTask* eval_task) {
    char command[1024];
    double last = 0;
    OmRlTrainResult result;
    OmRlTrainDef def = om_rl_train_default_def(task, om_cli_get(args, "--output"));
    OM_TRY(read_def(args, &def));
    def.eval_task = eval_task;
    om_cli_command(args, "rl train", command, sizeof command);
    def.command = command;
    bool is_quiet = om_cli_get(args, "--quiet") != NULL;
    note_meaning(&def);
    if (!is_quiet) def.on_row = print_row;
    def.ctx = &last;
    OM_TRY(om_rl_train_run(&def, om_cli_progress(is_quiet), &result));
    om_cli_progress_done();
    print_result(&def, &result);
    om_rl_train_result_done(&result);
    return OM_OK;
}

int om_cli_rl_train(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    int npositional;
    OmRlTask *task = NULL, *eval_task = NULL;
    OmCliRlWords words;
    OmStatus status = om_cli_rl_config(&args, &words);
    if (status >= 0) status = om_cli_check(&args, 0, &npositional);
    if (status >= 0 && om_cli_get(&args, "--task") &&
        strcmp(om_cli_get(&args, "--task"), "list") == 0) {
        om_cli_rl_list();
        return OM_EXIT_OK;
    }
    if (status >= 0) status = om_cli_rl_task(&args, &task);
    if (status >= 0) {
        OmRlTrainDef def = om_rl_train_default_def(task, om_cli_get(&args, "--output"));
        status = read_def(&args, &def);
    }
    if (status >= 0) status = om_cli_rl_more(&args, "--eval-set", &eval_task);
    if (status < 0) {
        om_rl_task_destroy(task);
        return om_cli_usage("rl train");
    }
    const char* const input[] = {om_cli_get(&args, "--demos"), om_cli_get(&args, "--start")};
    status = om_cli_check_apart(om_cli_get(&args, "--output"), input, 2);
    if (status >= 0) status = train(&args, task, eval_task);
    om_rl_task_destroy(eval_task);
    om_rl_task_destroy(task);
    return status < 0 ? om_cli_fail_kept("rl train", status) : OM_EXIT_OK;
}

const OmCliVerb om_cli_verb_rl_train = {
    .name = "rl train",
    .run = om_cli_rl_train,
    .summary = "train a policy: PPO, GAIL or behaviour cloning",
    .usage = "omentum rl train -t TASK -o DIR [options]",
    .about =
        "Trains a policy of a task (thesis, chapter 5). DIR receives policy.safetensors, policy.onnx (the\n"
        "actor), metrics.csv and report.html. After an interruption the same command continues the training\n"
        "and ends with the same bytes.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum rl train -t reach -n 80000 --rate 0.001 -o out/reach\n"
               "  omentum rl train -t retract -s move_mm=2 -s max_step=150 --eval-period 16 \\\n"
               "      --eval-set move_mm=0.5 --eval-set max_step=700 -o out/retract\n"
               "  omentum rl demo -t reach -n 35 -o out/demos.hdf5\n"
               "  omentum rl train -t reach -m gail -d out/demos.hdf5 -n 80000 -o out/gail",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
