// study_learning.c: trainings and evaluations of chapter 5.
//
// A training is a folder LEARNER-SEED of its own; scores are LEARNER-SEED-WORLD.csv, one line a start, behind the hash
// of the policy. Every evaluation is with moves of 0.5 mm.
// - PPO is trained with moves of 2 mm: a policy maps places to directions, and a training takes a quarter of the steps.
// - Demonstrations, GAIL and cloning have the moves of the evaluation: with 2 mm an expert takes three steps over the
//   last 6 mm and ten at p_T, and a policy that learns from these stops 7 mm short.
// - Bodies and the error of the tip are drawn (domain randomisation, 5.6). PPO learns the task first, then to bear
//   them.
// - The second part of PPO has a margin around the tumour, no weight of the entropy, a larger cost of a step, and a
//   growing sharpness: a policy that reaches its goal by its noise fails with its most probable actions.
//
// Rejected (doc/notes/rl_learning.md):
// - GAIL from random weights (0.0 to 0.8, from cloning 0.99), or with moves of 2 mm (0.363);
// - rewards -log(1 - D) or log D - log(1 - D): below 0.1;
// - PPO without drawn bodies: 0.02 to 0.36 on drawn bodies, with 0.97 in the task itself;
// - the second part without a larger cost of a step: drawn actions fall from 0.99 to 0.59;
// - the second part without the margin: 1.000 in the task, 0.094 to 0.937 in "reality";
// - an expert that flies 8 mm above the fat: 3 of 20 grasps beside the middle, GAIL 0.693 in "reality" (12 mm: 0.952);
// - another grasping place (goal_mm 65): 0.723 and 0.736 in "reality", with 75 mm 0.812.
#include <math.h>
#include <string.h>

#include "studies/study_cases.h"
#include "studies/study_learning_internal.h"
#include "studies/study_table.h"

#define COOKIE 0x57d1ea27u
// Processor times of a step for the estimate, s: of "retract", and of the tasks without tissue.
#define SECONDS_RETRACT 1.7e-3
#define SECONDS_STEP 5e-5
#define NSTEP_EPISODE 100
#define NDEMO 35  // demonstrations
#define RISE 0.9  // share of the rise of the return
enum { SIDE = 7, MAX_SETTING = 32, NAME = 64, FIRST_SEED = 1 };

const char* om_study_learner_name(OmStudyLearner learner) {
    static const char* const name[OM_NLEARNER] = {"ppo-thesis", "ppo", "gail", "clone"};
    return learner >= 0 && learner < OM_NLEARNER ? name[learner] : "?";
}

OmStudyLearningDef om_study_learning_default_def(const char* out_dir) {
    return (OmStudyLearningDef){.out_dir = out_dir,
                                .task = "retract",
                                .has = {true, true, true, true},
                                .nseed = 3,
                                .nstep = 262144,
                                .varied_nstep = 327680,
                                .gail_nstep = 32768,
                                .has_reality = true,
                                .cookie = COOKIE};
}

static OmStatus validate(const OmStudyLearningDef* d) {
    const StudyRange range[] = {{"nseed", d->nseed, 1, LEARNING_MAX_SEED},
                                {"varied_nstep", (double)d->varied_nstep, 0, 2e9},
                                {"nsetting", d->nsetting, 0, MAX_SETTING}};
    OM_TRY(STUDY_CHECK("learning study", d, COOKIE, range));
    OM_CHECK(d->task, OM_INVALID, "learning study: no task");
    return OM_OK;
}

// ---- tasks --------------------------------------------------------------------------------------------

typedef struct Settings {
    int n;
    OmRlSetting all[MAX_SETTING + 16];
} Settings;

static void add(Settings* s, int n, const OmRlSetting* more) {
    for (int i = 0; i < n; ++i) s->all[s->n++] = more[i];
}
#define ADD(s, list) add(s, (int)(sizeof(list) / sizeof *(list)), list)

// Bodies and errors of the tip, so that a policy bears what it does not know (5.6).
static const OmRlSetting varied[] = {{"variants", "6"},
                                     {"vary_thickness", "0.1"},
                                     {"vary_softness", "0.6"},
                                     {"vary_kidney_mm", "2"},
                                     {"tip_error_mm", "1.7"}};
enum { NVARIED = sizeof varied / sizeof *varied };

// Demonstrations and the learners that use them have the moves of the evaluation.
static OmStatus make_train_task(const OmStudyLearningDef* d, OmStudyLearner learner, bool is_varied,
                                OmRlTask** task) {
    static const OmRlSetting coarse[] = {{"move_mm", "2"}, {"max_step", "150"}};
    static const OmRlSetting fine[] = {{"max_step", "700"}};
    static const OmRlSetting thesis[] = {{"reward", "thesis"}};
    static const OmRlSetting wide[] = {{"margin_mm", "10"}};
    static const OmRlSetting hasty[] = {{"step_cost", "0.02"}};
    const bool is_ppo = learner == OM_LEARNER_PPO;
    Settings s = {0};
    add(&s, d->nsetting, d->setting);
    if (!d->is_same_task && (is_ppo || learner == OM_LEARNER_THESIS)) ADD(&s, coarse);
    if (!d->is_same_task && learner >= OM_LEARNER_GAIL) ADD(&s, fine);
    if (learner == OM_LEARNER_THESIS) ADD(&s, thesis);
    if (!d->is_same_task && is_ppo) ADD(&s, wide);
    if (!d->is_same_task && is_ppo && is_varied) ADD(&s, hasty);
    if (!d->is_same_task && is_varied) ADD(&s, varied);
    return om_rl_task_create(d->task, s.all, s.n, task);
}

// Of the evaluations, with more settings.
static OmStatus make_eval_task(const OmStudyLearningDef* d, int nmore, const OmRlSetting* more,
                               OmRlTask** task) {
    static const OmRlSetting patient[] = {{"still", "100"}};
    Settings s = {0};
    add(&s, d->nsetting, d->setting);
    if (!d->is_same_task) ADD(&s, patient);
    add(&s, nmore, more);
    return om_rl_task_create(d->task, s.all, s.n, task);
}

static OmStatus path_of(const Learning* s, const char* name, char path[1024]) {
    return om_path_join(s->def->out_dir, name, path, 1024);
}

// ---- training -----------------------------------------------------------------------------------------

static OmStatus make_demos(const Learning* s, const OmProgress* progress, char path[1024]) {
    OmRlTask* task;
    OmRlDemos demos;
    OM_TRY(path_of(s, "demos.hdf5", path));
    if (om_path_exists(path)) return OM_OK;
    OM_TRY(make_train_task(s->def, OM_LEARNER_GAIL, true, &task));
    OmStatus status = om_rl_demos_record(task, NDEMO, FIRST_SEED, progress, &demos);
    if (status >= 0) {
        status = om_rl_demos_save(&demos, path);
        om_rl_demos_done(&demos);
    }
    om_rl_task_destroy(task);
    return status;
}

// Append the curve of a training to that of the run.
static OmStatus keep_curve(const OmRlTrainResult* result, LearningRun* run) {
    const int capacity = run->nrow + result->nrow + 1;
    const double done = run->nrow > 0 ? run->step[run->nrow - 1] : 0;
    double* step = om_realloc(run->step, (size_t)run->nrow, (size_t)capacity, sizeof *step);
    if (!step) return OM_NO_MEMORY;
    run->step = step;
    double* ret = om_realloc(run->ret, (size_t)run->nrow, (size_t)capacity, sizeof *ret);
    if (!ret) return OM_NO_MEMORY;
    run->ret = ret;
    run->seconds += result->seconds;
    for (int i = 0; i < result->nrow; ++i) {
        if (!isfinite(result->row[i].mean_return)) continue;
        run->step[run->nrow] = done + (double)result->row[i].step;
        run->ret[run->nrow++] = result->row[i].mean_return;
    }
    return OM_OK;
}

static void set_learner(const OmStudyLearningDef* d, OmStudyLearner learner, OmRlTrainDef* def) {
    def->nstep = d->nstep;
    def->rate = 7e-4;
    def->nepoch = 10;
    def->batch = 256;
    def->horizon = 64;
    def->nenv = 32;
    def->entropy = 1e-3;
    def->eval_nepisode = 96;
    if (learner == OM_LEARNER_GAIL) {
        def->method = OM_RL_GAIL;
        def->nenv = 16;
        def->nstep = d->gail_nstep;
        def->rate = 3e-5;
        def->horizon = 64;
        def->batch = 128;
        def->clip_value = 0;
        def->entropy = 0;
        def->clone_epoch = 100;
        def->clone_rate = 3e-4;
        def->eval_period = 0;
    }
    if (learner == OM_LEARNER_CLONE) def->method = OM_RL_CLONE;
}

// A part of a training, in the folder NAME of the study. `start`: a policy to begin with, or null. A part of PPO with
// drawn bodies is the second one, with its own number of steps and rate, and keeps the policy of its best evaluation.
static OmStatus train_part(const Learning* s, OmStudyLearner learner, int seed, const char* name,
                           bool is_varied, const char* demos, const char* start,
                           const OmProgress* progress, LearningRun* run, OmRlTrainResult* result) {
    const OmStudyLearningDef* d = s->def;
    char dir[1024];
    OmRlTask *task, *choice_task = NULL;  // of the evaluations that choose a policy
    OM_TRY(path_of(s, name, dir));
    OM_TRY(make_train_task(d, learner, is_varied, &task));
    OmRlTrainDef def = om_rl_train_default_def(task, dir);
    OmStatus status = OM_OK;
    set_learner(d, learner, &def);
    def.nworker = d->nworker;
    def.seed = def.policy.seed = (uint64_t)seed;
    def.start = start;
    const bool is_last = is_varied || d->varied_nstep == 0;
    if (learner == OM_LEARNER_PPO && is_last) def.eval_period = 16;
    if (learner == OM_LEARNER_PPO && is_varied) {
        def.nstep = d->varied_nstep;
        def.rate = 5e-4;
        def.entropy = 0;
        def.sharpness = 32;
    }
    if (def.method != OM_RL_PPO) def.demos = demos;
    if (def.eval_period > 0)
        OM_TRY_DONE(make_eval_task(d, d->is_same_task ? 0 : NVARIED, varied, &choice_task));
    def.eval_task = choice_task;
    OM_TRY_DONE(om_rl_train_run(&def, progress, result));
    status = keep_curve(result, run);
done:
    om_rl_task_destroy(choice_task);
    om_rl_task_destroy(task);
    return status < 0 ? om_error_prefix(status, "%s", name) : status;
}

// PPO learns the task, then to bear drawn bodies: both at once fail from some seeds.
static OmStatus train(const Learning* s, OmStudyLearner learner, int seed, const char* demos,
                      const OmProgress* progress, LearningRun* run, OmRlTrainResult* result) {
    char name[NAME], plain[2 * NAME], start[1024];
    const bool has_two = learner == OM_LEARNER_PPO && s->def->varied_nstep > 0;
    snprintf(name, sizeof name, "%s-%d", om_study_learner_name(learner), seed);
    if (has_two) {
        snprintf(plain, sizeof plain, "%s-plain/policy.safetensors", name);
        OM_TRY(path_of(s, plain, start));
        snprintf(plain, sizeof plain, "%s-plain", name);
        OM_TRY(train_part(s, learner, seed, plain, false, demos, NULL, progress, run, result));
        om_rl_train_result_done(result);
    }
    const bool is_varied = has_two || learner == OM_LEARNER_GAIL || learner == OM_LEARNER_CLONE;
    return train_part(s, learner, seed, name, is_varied, demos, has_two ? start : NULL, progress,
                      run, result);
}

// ---- evaluation ---------------------------------------------------------------------------------------

static uint64_t policy_hash(OmRlPolicy* policy, const OmRlTask* task) {
    size_t n = om_net_parameter_size(om_rl_policy_net(policy, OM_RL_ACTOR));
    const float* param = om_rl_policy_parameters(policy, OM_RL_ACTOR);
    return om_hash(param, n * sizeof *param, task->hash);
}

static OmStatus save_scores(const char* path, uint64_t hash, int n, const double* score) {
    OmText text = {0};
    OmStatus status = om_text_append(&text, "# policy %016llx\n", (unsigned long long)hash);
    for (int i = 0; i < n && status >= 0; ++i) status = om_text_append(&text, "%.17g\n", score[i]);
    if (status >= 0) status = om_file_write(path, text.str, text.len);
    om_text_done(&text);
    return status;
}

// Scores of this policy from an earlier run; false: there are none.
static bool load_scores(const char* path, uint64_t hash, int n, double* score) {
    char *data, head[64];
    size_t size;
    if (!om_path_exists(path) || om_file_read(path, 1 << 20, &data, &size) < 0) return false;
    int len = snprintf(head, sizeof head, "# policy %016llx\n", (unsigned long long)hash);
    const char *at = data + len, *end = data + size;
    bool is_good = size > (size_t)len && memcmp(data, head, (size_t)len) == 0;
    for (int i = 0; i < n && is_good; ++i) {
        is_good = om_number_parse(&at, end, &score[i]) && isfinite(score[i]) && at < end;
        ++at;
    }
    om_free(data);
    return is_good;
}

static OmStatus evaluate(Learning* s, OmStudyLearner learner, int seed, int world,
                         const OmRlTask* task, OmRlPolicy* policy, const OmProgress* progress) {
    char name[NAME], path[1024];
    LearningRun* run = &s->run[learner][seed - FIRST_SEED];
    OmRlEval eval = {0};
    OmStatus status;
    snprintf(name, sizeof name, "%s-%d-%s.csv", om_study_learner_name(learner), seed,
             world ? "reality" : "training");
    OM_TRY(path_of(s, name, path));
    OmRlEvalDef def = om_rl_eval_default_def(task, policy);
    def.nworker = s->def->nworker;
    def.nepisode = s->nstart;
    const uint64_t hash = policy_hash(policy, task);
    OM_ALLOC_DONE(run->score[world], s->nstart);
    status = OM_OK;
    if (load_scores(path, hash, s->nstart, run->score[world])) goto done;
    OM_TRY_DONE(om_rl_eval_run(&def, progress, &eval));
    memcpy(run->score[world], eval.score, (size_t)s->nstart * sizeof *eval.score);
    status = save_scores(path, hash, s->nstart, run->score[world]);
done:
    if (status < 0) {  // no scores
        om_free(run->score[world]);
        run->score[world] = NULL;
    }
    om_rl_eval_done(&eval);
    return status;
}

static OmStatus run_one(Learning* s, OmStudyLearner learner, int k, const char* demos,
                        const OmRlTask* task, const OmProgress* progress) {
    LearningRun* run = &s->run[learner][k];
    OmRlTrainResult result;
    OM_TRY(train(s, learner, FIRST_SEED + k, demos, progress, run, &result));
    OmStatus status = evaluate(s, learner, FIRST_SEED + k, 0, task, result.policy, progress);
    om_rl_train_result_done(&result);
    run->is_there = status >= 0;
    return status;
}

static OmStatus run_reality(Learning* s, OmStudyLearner learner, int k, const OmRlTask* task,
                            const OmProgress* progress) {
    char name[NAME], dir[1024], path[1024];
    OmRlPolicy* policy;
    snprintf(name, sizeof name, "%s-%d", om_study_learner_name(learner), FIRST_SEED + k);
    OM_TRY(path_of(s, name, dir));
    OM_TRY(om_path_join(dir, "policy.safetensors", path, sizeof path));
    OM_TRY(om_rl_policy_load(path, &policy));
    OmStatus status = evaluate(s, learner, FIRST_SEED + k, 1, task, policy, progress);
    om_rl_policy_destroy(policy);
    return status;
}

// ---- summary ------------------------------------------------------------------------------------------

double om__learning_mean(const Learning* s, const LearningRun* run, int world, int begin, int end) {
    double sum = 0;
    if (!run->score[world] || end > s->nstart) return (double)NAN;
    for (int i = begin; i < end; ++i) sum += run->score[world][i];
    return sum / (end - begin);
}

// The first step at which the return has risen by 90 % of its whole rise.
static double rise_of(const LearningRun* run) {
    if (run->nrow < 2) return (double)NAN;
    double first = run->ret[0], last = run->ret[run->nrow - 1];
    for (int i = 0; i < run->nrow; ++i)
        if (run->ret[i] >= first + RISE * (last - first)) return run->step[i];
    return (double)NAN;
}

static void add_run(const Learning* s, const LearningRun* run, double share, OmStudyLearning* r) {
    bool is_square = s->nstart == SIDE * SIDE;
    double least[LEARNING_WORLD] = {INFINITY, INFINITY};
    for (int w = 0; w < LEARNING_WORLD; ++w)
        for (int i = 0; run->score[w] && i < s->nstart; ++i)
            least[w] = fmin(least[w], run->score[w][i]);
    const double mean = om__learning_mean(s, run, 0, 0, s->nstart);
    r->lowest = r->is_there ? fmin(r->lowest, least[0]) : least[0];
    r->least_mean = r->is_there ? fmin(r->least_mean, mean) : mean;
    r->mean += share * mean;
    // rows whose middle lies in the third at the fixed side, and in the third far from it
    r->near_third += is_square ? share * om__learning_mean(s, run, 0, 0, 2 * SIDE) : (double)NAN;
    r->far_third +=
        is_square ? share * om__learning_mean(s, run, 0, 5 * SIDE, SIDE * SIDE) : (double)NAN;
    r->reality_mean += share * om__learning_mean(s, run, 1, 0, s->nstart);
    r->reality_lowest += run->score[1] ? share * least[1] : (double)NAN;
    r->steps90 += share * rise_of(run);
    r->seconds += share * run->seconds;
    r->is_there = true;
}

// A bound that was not measured, a NaN, is not missed.
static void judge(OmStudyLearner learner, const char* what, double value, bool is_high,
                  double bound, OmStudyLearningSummary* r) {
    if (is_high ? !(value < bound) : !(value >= bound)) return;
    r->is_met = false;
    const size_t n = strlen(r->missed);
    snprintf(r->missed + n, sizeof r->missed - n, "%s%s: %s %.3f, bound %.2f", n > 0 ? "; " : "",
             om_study_learner_name(learner), what, value, bound);
}

static void summarise(const Learning* s, OmStudyLearningSummary* r) {
    *r = (OmStudyLearningSummary){.is_met = true};
    for (int l = 0; l < OM_NLEARNER; ++l) {
        int n = 0;
        for (int k = 0; k < s->def->nseed; ++k) n += s->run[l][k].is_there;
        for (int k = 0; k < s->def->nseed && n > 0; ++k)
            if (s->run[l][k].is_there) add_run(s, &s->run[l][k], 1.0 / n, &r->by[l]);
    }
    const OmStudyLearning* a = &r->by[OM_LEARNER_THESIS];
    if (a->is_there) {
        judge(OM_LEARNER_THESIS, "third at the fixed side", a->near_third, false, 0.3, r);
        judge(OM_LEARNER_THESIS, "far third", a->far_third, true, 0.7, r);
    }
    for (int l = OM_LEARNER_PPO; l <= OM_LEARNER_GAIL; ++l) {
        const OmStudyLearning* b = &r->by[l];
        const OmStudyLearner learner = (OmStudyLearner)l;
        if (!b->is_there) continue;
        judge(learner, "mean of a seed", b->least_mean, true, 0.95, r);
        judge(learner, "lowest start", b->lowest, true, 0.8, r);
        judge(learner, "mean in \"reality\"", b->reality_mean, true,
              learner == OM_LEARNER_PPO ? 0.90 : 0.93, r);
    }
}

static OmStatus save_json(const Learning* s, const OmStudyLearningSummary* r) {
    OmText text = {0};
    OmJson j = om__json(&text);
    om__put(&j, "study %s|task %s|seeds %d|steps %lld|is_met? %d|missed %s", "learning",
            s->def->task, s->def->nseed, (long long)s->def->nstep, r->is_met, r->missed);
    for (int l = 0; l < OM_NLEARNER; ++l) {
        const OmStudyLearning* b = &r->by[l];
        if (!b->is_there) continue;
        om_json_open(&j, om_study_learner_name((OmStudyLearner)l), '{');
        om__put(&j,
                "mean %f|least_mean %f|lowest %f|near_third %f|far_third %f|reality_mean %f|"
                "reality_lowest %f|steps_to_90_percent %f|seconds %f",
                b->mean, b->least_mean, b->lowest, b->near_third, b->far_third, b->reality_mean,
                b->reality_lowest, b->steps90, b->seconds);
        om_json_open(&j, "scores", '[');
        for (int k = 0; k < s->def->nseed; ++k)
            if (s->run[l][k].is_there) om_json_numbers(&j, NULL, s->run[l][k].score[0], s->nstart);
        om_json_close(&j, ']');
        om_json_close(&j, '}');
    }
    return om__study_save_json(s->def->out_dir, &j, OM_OK);
}

static void learning_done(Learning* s) {
    for (int l = 0; l < OM_NLEARNER; ++l)
        for (int k = 0; k < LEARNING_MAX_SEED; ++k) {
            LearningRun* run = &s->run[l][k];
            om_free(run->step);
            om_free(run->ret);
            for (int w = 0; w < LEARNING_WORLD; ++w) om_free(run->score[w]);
        }
}

// Trainings without a policy in the folder, and evaluations in "reality".
static OmStatus tell(const Learning* s, const OmProgress* progress) {
    const OmStudyLearningDef* d = s->def;
    const double step = strcmp(d->task, "retract") == 0 ? SECONDS_RETRACT : SECONDS_STEP;
    double seconds = 0;
    int n = 0, nreality = 0;
    for (int k = 0; k < d->nseed; ++k)
        for (int l = 0; l < OM_NLEARNER; ++l) {
            char name[NAME + 32];
            snprintf(name, sizeof name, "%s-%d/policy.safetensors",
                     om_study_learner_name((OmStudyLearner)l), FIRST_SEED + k);
            if (!d->has[l]) continue;
            nreality += d->has_reality;
            if (om__study_has_file(d->out_dir, name)) continue;
            ++n;
            if (l == OM_LEARNER_THESIS) seconds += step * (double)d->nstep;
            if (l == OM_LEARNER_PPO) seconds += step * (double)(d->nstep + d->varied_nstep);
            if (l == OM_LEARNER_GAIL) seconds += step * (double)d->gail_nstep;
        }
    const StudyWork work[] = {
        {"trainings", n, n ? seconds / n : 0, true},
        {"evaluations in \"reality\"", nreality, s->nstart * NSTEP_EPISODE * step, true}};
    return om__study_estimate_tell(work, 2, d->nworker, progress);
}

// Scores do not depend on the reward, so all policies act in one task.
static OmStatus run_training(Learning* s, const OmProgress* progress) {
    const OmStudyLearningDef* d = s->def;
    char demos[1024];
    OmRlTask* task;
    OM_TRY(make_eval_task(d, 0, NULL, &task));
    s->nstart = task->nstart > 0 ? task->nstart : 100;
    s->score_name = task->score_name ? task->score_name : "return";
    OmStatus status = tell(s, progress);
    if (status >= 0) status = make_demos(s, progress, demos);
    for (int k = 0; k < d->nseed && status >= 0; ++k)
        for (int l = 0; l < OM_NLEARNER && status >= 0; ++l)
            if (d->has[l]) status = run_one(s, (OmStudyLearner)l, k, demos, task, progress);
    om_rl_task_destroy(task);  // score_name is a constant of the kind of task
    return status;
}

// GAIL and PPO first: they have bounds. A simulation that fails under one policy does not keep the others from being
// evaluated; the first failure is returned, and its message.
static OmStatus run_all_reality(Learning* s, const OmRlTask* task, const OmProgress* progress,
                                char message[512]) {
    static const OmStudyLearner order[OM_NLEARNER] = {OM_LEARNER_GAIL, OM_LEARNER_PPO,
                                                      OM_LEARNER_CLONE, OM_LEARNER_THESIS};
    OmStatus status = OM_OK;
    for (int i = 0; i < OM_NLEARNER * s->def->nseed && status != OM_CANCELLED; ++i) {
        const OmStudyLearner learner = order[i / s->def->nseed];
        const int k = i % s->def->nseed;
        if (!s->def->has[learner]) continue;
        const OmStatus one = run_reality(s, learner, k, task, progress);
        if (one >= 0 || (status < 0 && one != OM_CANCELLED)) continue;
        status = one;
        snprintf(message, 512, "%s-%d in \"reality\": %s", om_study_learner_name(learner),
                 FIRST_SEED + k, om_error_message());
    }
    return status;
}

static OmStatus finish(Learning* s, bool is_complete, OmStudyLearningSummary* summary) {
    summarise(s, summary);
    summary->is_met = summary->is_met && is_complete;
    OM_TRY(save_json(s, summary));
    return om__learning_report(s, summary);
}

// Takes longer; the report is there already. What failed is not met.
static OmStatus add_reality(Learning* s, const OmProgress* progress,
                            OmStudyLearningSummary* summary) {
    static const OmRlSetting reality = {"world", "reality"};
    char message[512] = "";
    OmRlTask* task;
    OM_TRY(make_eval_task(s->def, 1, &reality, &task));
    const OmStatus status = run_all_reality(s, task, progress, message);
    om_rl_task_destroy(task);
    OM_TRY(finish(s, status >= 0, summary));
    return status < 0 ? om_error(status, "%s", message) : OM_OK;
}

OmStatus om_study_learning_run(const OmStudyLearningDef* def, const OmProgress* progress,
                               OmStudyLearningSummary* summary) {
    Learning* s = NULL;
    OmFolder folder = {0};
    OmStatus status = OM_OK;
    *summary = (OmStudyLearningSummary){0};
    OM_TRY(validate(def));
    OM_CALLOC_DONE(s, 1);
    s->def = def;
    OM_TRY_DONE(om_folder_open(def->out_dir, "learning study", &folder));
    OM_TRY_DONE(run_training(s, progress));
    OM_TRY_DONE(finish(s, true, summary));
    if (def->has_reality) status = add_reality(s, progress, summary);
done:
    om_folder_end(&folder);
    if (s) learning_done(s);
    om_free(s);
    return status;
}
