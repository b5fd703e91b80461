// rl_train.c: the loop of a training.
//
//     collect horizon steps of all environments      rl_rollout.c
//     GAIL: discriminator, mixed rewards             rl_gail.c
//     advantages, epochs of descents                 rl_ppo.c
//     evaluation, the best policy is kept            rl_best.c
//     row of metrics, checkpoint                     rl_checkpoint.c
//
// Order and draws are functions of (seed, iteration), and networks run with one worker each: the bytes do not depend on
// the number of workers, nor on an interruption.
#include <math.h>
#include <string.h>

#include "rl/rl_internal.h"

#define COOKIE 0x726c7472u
#define FOLDER_KIND "learning"
enum { CLONE_EPOCHS = 200 };

const char* om_rl_method_name(OmRlMethod method) {
    static const char* const name[OM_RL_NMETHOD] = {"ppo", "gail", "clone"};
    return method >= 0 && method < OM_RL_NMETHOD ? name[method] : "?";
}

OmRlTrainDef om_rl_train_default_def(const OmRlTask* task, const char* out_dir) {
    return (OmRlTrainDef){.cookie = COOKIE,
                          .task = task,
                          .out_dir = out_dir,
                          .nstep = 1000000,
                          .nenv = 16,
                          .seed = 1,
                          .policy = om_rl_policy_default_def(task),
                          .horizon = 64,
                          .batch = 256,
                          .nepoch = 3,
                          .rate = 3e-4,
                          .gamma = 0.99,
                          .lambda = 0.95,
                          .clip = 0.2,
                          .clip_value = 0.2,
                          .entropy = 5e-3,
                          .sharpness = 1,
                          .value = 0.5,
                          .max_norm = 0.5,
                          .normalise_advantage = true,
                          .normalise_reward = true,
                          .weight_reward = 0.2,
                          .weight_gail = 0.8,
                          .gail_rate = 3e-4,
                          .gail_noise = 0.02,
                          .gail_epoch = 1,
                          .eval_nepisode = 32,
                          .eval_seed = 2000,
                          .checkpoint_period = 30};
}

static OmStatus check_range(const char* name, double value, double lo, double hi) {
    OM_CHECK(value >= lo && value <= hi, OM_INVALID, "training: %s is %g, outside %g to %g", name,
             value, lo, hi);
    return OM_OK;
}

static OmStatus check_def(const OmRlTrainDef* d) {
    const struct {
        const char* name;
        double value, lo, hi;
    } range[] = {{"method", d->method, 0, OM_RL_NMETHOD - 1},
                 {"nstep", (double)d->nstep, 1, 1e12},
                 {"nenv", d->nenv, 1, 65536},
                 {"horizon", d->horizon, 1, 65536},
                 {"batch", d->batch, 2, 1 << 20},
                 {"nepoch", d->nepoch, 1, 1000},
                 {"rate", d->rate, 0, 1},
                 {"sharpness", d->sharpness, 0.01, 100},
                 {"gamma", d->gamma, 0, 1},
                 {"lambda", d->lambda, 0, 1},
                 {"clip", d->clip, 1e-6, 10},
                 {"clip_value", d->clip_value, 0, 1e9},
                 {"entropy", d->entropy, 0, 10},
                 {"value", d->value, 0, 10},
                 {"max_norm", d->max_norm, 0, 1e9},
                 {"weight_reward", d->weight_reward, 0, 1e6},
                 {"weight_gail", d->weight_gail, 0, 1e6},
                 {"clone_epoch", d->clone_epoch, 0, 1e6},
                 {"clone_rate", d->clone_rate, 0, 1},
                 {"gail_rate", d->gail_rate, 0, 1},
                 {"gail_noise", d->gail_noise, 0, 10},
                 {"gail_epoch", d->gail_epoch, 1, 1000},
                 {"eval_period", d->eval_period, 0, 1e9},
                 {"eval_nepisode", d->eval_nepisode, 1, OM__RL_MAX_EPISODE},
                 {"eval_stop", d->eval_stop, 0, 1e9}};
    OM_CHECK(d->cookie == COOKIE, OM_INVALID, "training: begin with om_rl_train_default_def()");
    OM_CHECK(d->task, OM_INVALID, "training: no task");
    for (size_t i = 0; i < sizeof range / sizeof *range; ++i)
        OM_TRY(check_range(range[i].name, range[i].value, range[i].lo, range[i].hi));
    OM_CHECK((int64_t)d->nenv * d->horizon % d->batch == 0 &&
                 (int64_t)d->nenv * d->horizon < 1 << 30,
             OM_INVALID, "training: a batch of %d does not divide %d environments x %d steps",
             d->batch, d->nenv, d->horizon);
    OM_CHECK(d->method == OM_RL_PPO || d->demos, OM_INVALID, "training: %s needs demonstrations",
             om_rl_method_name(d->method));
    const OmRlTask* eval_task = d->eval_task ? d->eval_task : d->task;
    OM_CHECK(d->eval_stop == 0 || d->eval_period > 0, OM_INVALID,
             "training: eval_stop is %d, but there are no evaluations; set eval_period",
             d->eval_stop);
    OM_CHECK(d->eval_stop == 0 || isfinite(eval_task->target), OM_INVALID,
             "training: eval_stop is %d, but task %s has no target score", d->eval_stop,
             eval_task->name);
    return OM_OK;
}

// ---- the session --------------------------------------------------------------------------------------

static int64_t iteration_size(const OmRlTrainDef* d) { return (int64_t)d->nenv * d->horizon; }

int64_t om__rl_count_iterations(const OmRlTrainDef* d) {
    if (d->method == OM_RL_CLONE) return 0;
    return (d->nstep + iteration_size(d) - 1) / iteration_size(d);
}

static OmStatus session_init(const OmRlTrainDef* def, RlSession* s) {
    OmRlVecDef vec = om_rl_vec_default_def(def->task);
    const int64_t most = om__rl_count_iterations(def) + 1;
    s->def = def;
    OM_CHECK(most < INT32_MAX, OM_INVALID, "training: more than 2^31 iterations");
    if (def->demos) {
        OM_TRY(om_rl_demos_load(def->demos, &s->demos));
        OM_TRY(om_rl_demos_check(&s->demos, def->task));
    }
    vec.nenv = def->nenv;
    vec.nworker = def->nworker;
    vec.seed = def->seed;
    OM_TRY(om_rl_vec_create(&vec, &s->vec));
    OM_TRY(om__rl_learner_init(def, &s->learner));
    OM_TRY(om__rl_rollout_init(def, &s->rollout));
    OM_TRY(om__rl_best_init(s));
    if (def->method == OM_RL_GAIL) OM_TRY(om__rl_judge_init(def, &s->judge));
    OM_ALLOC(s->obs, (size_t)def->nenv * (size_t)def->task->nobservation);
    s->running = om_calloc((size_t)def->nenv, sizeof *s->running);
    if (!s->running) return OM_NO_MEMORY;
    s->max_row = (int)most;
    OM_ALLOC(s->row, most);
    if (def->out_dir) OM_TRY(om__rl_checkpoint_load(s));
    if (s->is_resumed) {
        om_rl_vec_observe(s->vec, s->obs);
        if (s->judge.net) OM_TRY(om__rl_judge_update(&s->judge));
        return om__rl_learner_update(&s->learner);
    }
    return om_rl_vec_reset(s->vec, s->obs);
}

static void session_done(RlSession* s) {
    om_rl_demos_done(&s->demos);
    om_rl_vec_destroy(s->vec);
    om__rl_learner_done(&s->learner);
    om__rl_rollout_done(&s->rollout);
    om__rl_judge_done(&s->judge);
    om_rl_policy_destroy(s->best);
    om_free(s->obs);
    om_free(s->running);
    om_free(s->row);
}

// ---- an iteration -------------------------------------------------------------------------------------

static void gather(const RlRollout* r, const OmRlTask* task, const int* order, RlLearner* l) {
    const size_t nobs = (size_t)task->nobservation, naction = (size_t)task->naction;
    for (int i = 0; i < l->def->batch; ++i) {
        const size_t at = (size_t)order[i], to = (size_t)i;
        memcpy(l->obs + to * nobs, r->obs + at * nobs, nobs * sizeof *l->obs);
        memcpy(l->action + to * naction, r->action + at * naction, naction * sizeof *l->action);
        l->log_prob[i] = r->log_prob[at];
        l->value[i] = r->value[at];
        l->advantage[i] = r->advantage[at];
        l->target[i] = r->target[at];
    }
}

static OmStatus descend(RlSession* s, double rate, OmRlTrainRow* row) {
    const OmRlTrainDef* def = s->def;
    const int total = (int)iteration_size(def), nbatch = total / def->batch;
    const double num = (double)nbatch * def->nepoch;
    for (int epoch = 0; epoch < def->nepoch; ++epoch) {
        uint64_t index = (uint64_t)s->c.iteration * (uint64_t)def->nepoch + (uint64_t)epoch;
        om__rl_shuffle(def->seed + 11, index, total, s->learner.order);
        for (int b = 0; b < nbatch; ++b) {
            RlLoss loss;
            gather(&s->rollout, def->task, s->learner.order + (ptrdiff_t)b * def->batch,
                   &s->learner);
            OM_TRY(om__rl_learner_step(&s->learner, rate, &loss));
            row->loss_policy += loss.policy / num;
            row->loss_value += loss.value / num;
            row->entropy += loss.entropy / num;
            row->divergence += loss.divergence / num;
            row->clip_fraction += loss.clip_fraction / num;
        }
    }
    return OM_OK;
}

// Mean of the last episodes.
static double recent(const RlCounters* c, const double* ring) {
    double n = fmin(c->nepisode, RL_RECENT), sum = 0;
    for (int i = 0; i < (int)n; ++i) sum += ring[i];
    return n > 0 ? sum / n : (double)NAN;
}

// After each iteration of the third quarter: before it a policy learns by its noise.
static OmStatus sharpen(RlSession* s) {
    const double n = (double)om__rl_count_iterations(s->def), begin = floor(0.5 * n),
                 end = fmax(floor(0.75 * n), begin + 1);
    if (s->def->sharpness == 1 || s->c.iteration < begin || s->c.iteration >= end) return OM_OK;
    om__rl_policy_sharpen(s->learner.policy, pow(s->def->sharpness, 1 / (end - begin)));
    return om__rl_learner_update(&s->learner);
}

static OmStatus iterate(RlSession* s, double begin) {
    const OmRlTrainDef* def = s->def;
    const double done = s->c.iteration / (double)om__rl_count_iterations(def);
    OmRlTrainRow* row = &s->row[s->nrow];
    *row = (OmRlTrainRow){.right_demo = (double)NAN,
                          .right_policy = (double)NAN,
                          .eval_score = (double)NAN,
                          .eval_return = (double)NAN,
                          .eval_least = (double)NAN};
    row->rate = def->rate * (1 - done);
    OM_TRY(om__rl_rollout_run(&s->learner, s->vec, s->obs, &s->c, &s->rollout));
    if (s->judge.net)
        OM_TRY(om__rl_judge_run(&s->judge, &s->demos, (int64_t)s->c.iteration,
                                def->gail_rate * (1 - done), &s->rollout, &row->right_demo,
                                &row->right_policy));
    om__rl_rollout_finish(def, s->running, &s->c, &s->rollout);
    OM_TRY(descend(s, row->rate, row));
    OM_TRY(sharpen(s));
    ++s->c.iteration;
    row->step = (int64_t)s->c.nstep;
    row->nepisode = (int64_t)s->c.nepisode;
    row->mean_return = recent(&s->c, s->c.ret);
    row->mean_length = recent(&s->c, s->c.length);
    row->mean_score = recent(&s->c, s->c.score);
    row->seconds = s->c.seconds + om_clock_now() - begin;
    ++s->nrow;
    return OM_OK;
}

// ---- files --------------------------------------------------------------------------------------------

static OmStatus save_policy(const RlSession* s) {
    const OmRlTrainDef* def = s->def;
    const OmRlTrainRow* last = s->nrow > 0 ? &s->row[s->nrow - 1] : NULL;
    OmFacts facts = {0};
    char path[1024];
    OmStatus status = OM_OK;
    if (def->command) OM_TRY_DONE(om_facts_add(&facts, "command", "%s", def->command));
    OM_TRY_DONE(om_facts_add(&facts, "method", "%s", om_rl_method_name(def->method)));
    OM_TRY_DONE(om_facts_add(&facts, "seed", "%llu", (unsigned long long)def->seed));
    OM_TRY_DONE(om_facts_add(&facts, "steps", "%.0f", s->c.nstep));
    OM_TRY_DONE(
        om_facts_add(&facts, "task_settings", "%016llx", (unsigned long long)def->task->hash));
    if (last && isfinite(last->mean_return)) {
        OM_TRY_DONE(om_facts_add(&facts, "return", "%.6g", last->mean_return));
        OM_TRY_DONE(om_facts_add(&facts, "score", "%.6g", last->mean_score));
    }
    if (s->c.best_step > 0) {
        OM_TRY_DONE(om_facts_add(&facts, "kept_step", "%.0f", s->c.best_step));
        OM_TRY_DONE(om_facts_add(&facts, "eval_return", "%.6g", s->c.best_return));
        OM_TRY_DONE(om_facts_add(&facts, "eval_score", "%.6g", s->c.best_score));
    }
    OM_TRY_DONE(om_path_join(def->out_dir, "policy.safetensors", path, sizeof path));
    status = om_rl_policy_save(om__rl_best_policy(s), facts.pair, facts.n, path);
done:
    om_facts_done(&facts);
    return status;
}

static OmStatus keep(const RlSession* s) {
    char path[1024];
    OM_TRY(om_path_join(s->def->out_dir, "policy.onnx", path, sizeof path));
    OM_TRY(om_rl_policy_save_onnx(om__rl_best_policy(s), path));
    return om__rl_save_report(s);
}

// The checkpoint's seconds include the present part of the training.
static OmStatus save(RlSession* s, double* begin) {
    const double now = om_clock_now();
    s->c.seconds += now - *begin;
    *begin = now;
    if (!s->def->out_dir) return OM_OK;
    OM_TRY(om__rl_checkpoint_save(s));
    return save_policy(s);
}

static OmStatus clone(RlSession* s, const OmProgress* progress) {
    const OmRlTrainDef* def = s->def;
    int nepoch = def->clone_epoch;
    if (def->method == OM_RL_CLONE && nepoch == 0) nepoch = CLONE_EPOCHS;
    if (def->method == OM_RL_PPO || s->c.clone_epoch >= nepoch) return OM_OK;
    double loss = 0, right = 0;
    OM_TRY(om__rl_clone(&s->learner, &s->demos, 0, nepoch, progress, &loss, &right));
    s->c.clone_epoch = nepoch;
    if (def->method != OM_RL_CLONE) return OM_OK;
    s->row[s->nrow++] = (OmRlTrainRow){.step = (int64_t)nepoch * s->demos.nstep,
                                       .mean_return = (double)NAN,
                                       .mean_length = (double)NAN,
                                       .mean_score = (double)NAN,
                                       .loss_policy = loss,
                                       .rate = def->rate,
                                       .right_demo = right,
                                       .right_policy = (double)NAN,
                                       .eval_score = (double)NAN,
                                       .eval_return = (double)NAN,
                                       .eval_least = (double)NAN};
    return OM_OK;
}

static OmStatus loop(RlSession* s, const OmProgress* progress) {
    const OmRlTrainDef* def = s->def;
    double begin = om_clock_now(), last = begin;
    OM_TRY(clone(s, progress));
    // an evaluation that was cancelled is repeated before the next iteration
    while (!om__rl_best_is_over(s) || om__rl_best_is_due(s)) {
        OmStatus status = om_progress_report(progress, "learning", s->c.nstep, (double)def->nstep);
        if (status >= 0 && !om__rl_best_is_due(s)) status = iterate(s, begin);
        if (status >= 0) status = om__rl_best_run(s, progress);
        if (status == OM_CANCELLED) {
            OM_TRY(save(s, &begin));
            return om_error(OM_CANCELLED, "cancelled at step %.0f", s->c.nstep);
        }
        OM_TRY(status);
        if (def->on_row) def->on_row(def->ctx, &s->row[s->nrow - 1]);
        if (def->out_dir && om_clock_now() - last >= def->checkpoint_period) {
            OM_TRY(save(s, &begin));
            last = om_clock_now();
        }
    }
    return save(s, &begin);
}

void om_rl_train_result_done(OmRlTrainResult* r) {
    om_rl_policy_destroy(r->policy);
    om_free(r->row);
    *r = (OmRlTrainResult){0};
}

OmStatus om_rl_train_run(const OmRlTrainDef* def, const OmProgress* progress,
                         OmRlTrainResult* result) {
    RlSession s = {0};
    OmFolder folder = {0};
    OmStatus status = OM_OK;
    *result = (OmRlTrainResult){0};
    OM_TRY(check_def(def));
    if (def->out_dir) OM_TRY(om_folder_open(def->out_dir, FOLDER_KIND, &folder));
    OM_TRY_DONE(session_init(def, &s));
    OM_TRY_DONE(loop(&s, progress));
    if (def->out_dir) OM_TRY_DONE(keep(&s));
    *result = (OmRlTrainResult){.policy = om__rl_best_policy(&s),
                                .row = s.row,
                                .nrow = s.nrow,
                                .is_resumed = s.is_resumed,
                                .kept_step = (int64_t)s.c.best_step,
                                .seconds = s.c.seconds};
    if (s.c.best_step > 0)
        s.best = NULL;
    else
        s.learner.policy = NULL;
    s.row = NULL;
done:
    om_folder_end(&folder);
    session_done(&s);
    return status;
}
