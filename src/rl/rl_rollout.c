// rl_rollout.c: the samples of an iteration.
//
// Random numbers of an action are a function of (seed, step, environment). Where the limit of steps ends an episode,
// the critic's value of its last observation is added to the reward: the episode would have continued. Rewards are
// divided by the standard deviation of the discounted return of all steps so far, summed in a fixed order, and clipped
// to 10.
#include <math.h>
#include <string.h>

#include "rl/rl_internal.h"

#define REWARD_LIMIT 10.0
#define ACTION_STREAM 0x61637400000000ull  // apart from the streams of episodes

OmStatus om__rl_rollout_init(const OmRlTrainDef* def, RlRollout* r) {
    const size_t n = (size_t)def->nenv, total = n * (size_t)def->horizon;
    const size_t nobs = (size_t)def->task->nobservation;
    r->nstep = def->horizon;
    r->nenv = def->nenv;
    OM_ALLOC(r->obs, total * nobs);
    OM_ALLOC(r->action, total * (size_t)def->task->naction);
    OM_ALLOC(r->log_prob, total);
    OM_ALLOC(r->value, total + n);
    OM_ALLOC(r->reward, total);
    OM_ALLOC(r->bonus, total);
    OM_ALLOC(r->is_end, total);
    OM_ALLOC(r->advantage, total);
    OM_ALLOC(r->target, total);
    OM_ALLOC(r->logit, n * OM_RL_MAX_CHOICE);
    r->final_obs = om_calloc(n * nobs, sizeof(float));  // all of it is read where an episode ends
    r->final_info = om_calloc(n * OM_RL_MAX_INFO, sizeof(double));
    if (!r->final_obs || !r->final_info) return OM_NO_MEMORY;
    OM_ALLOC(r->final_return, n);
    OM_ALLOC(r->final_length, n);
    OM_ALLOC(r->is_terminated, n);
    OM_ALLOC(r->is_truncated, n);
    return OM_OK;
}

void om__rl_rollout_done(RlRollout* r) {
    om_free(r->obs);
    om_free(r->action);
    om_free(r->log_prob);
    om_free(r->value);
    om_free(r->reward);
    om_free(r->bonus);
    om_free(r->is_end);
    om_free(r->advantage);
    om_free(r->target);
    om_free(r->logit);
    om_free(r->final_obs);
    om_free(r->final_return);
    om_free(r->final_info);
    om_free(r->final_length);
    om_free(r->is_terminated);
    om_free(r->is_truncated);
}

int om__rl_score_index(const OmRlTask* task) {
    for (int i = 0; task->score_name && i < task->ninfo; ++i)
        if (strcmp(task->info_name[i], task->score_name) == 0) return i;
    return -1;
}

// Episodes that ended in this step go into the means.
static void count_episodes(const OmRlTask* task, const RlRollout* r, RlCounters* c) {
    int score = om__rl_score_index(task);
    for (int i = 0; i < r->nenv; ++i) {
        if (!r->is_terminated[i] && !r->is_truncated[i]) continue;
        int at = (int)fmod(c->nepisode, RL_RECENT);
        c->ret[at] = r->final_return[i];
        c->length[at] = r->final_length[i];
        c->score[at] =
            score < 0 ? r->final_return[i] : r->final_info[(ptrdiff_t)i * task->ninfo + score];
        ++c->nepisode;
    }
}

// gamma V(last observation) where an episode was truncated.
static OmStatus add_bonus(RlLearner* l, const RlRollout* r, double* bonus) {
    bool has_any = false;
    memset(bonus, 0, (size_t)r->nenv * sizeof *bonus);
    for (int i = 0; i < r->nenv; ++i) has_any = has_any || r->is_truncated[i];
    if (!has_any) return OM_OK;
    OM_TRY(om_net_run_forward(l->judge, r->final_obs, r->logit));
    for (int i = 0; i < r->nenv; ++i)
        if (r->is_truncated[i]) bonus[i] = l->def->gamma * (double)r->logit[i];
    return OM_OK;
}

OmStatus om__rl_rollout_run(RlLearner* l, OmRlVec* vec, float* obs, RlCounters* c, RlRollout* r) {
    const OmRlTrainDef* def = l->def;
    const OmRlTask* task = def->task;
    const int nlogit = om_rl_task_nlogit(task), n = r->nenv;
    OM_TRY(om__rl_learner_update(l));
    for (int t = 0; t < r->nstep; ++t) {
        const ptrdiff_t at = (ptrdiff_t)t * n;
        int* action = r->action + at * task->naction;
        memcpy(r->obs + at * task->nobservation, obs,
               (size_t)n * (size_t)task->nobservation * sizeof *obs);
        OM_TRY(om_net_run_forward(l->judge, obs, r->value + at));
        OM_TRY(om_net_run_forward(l->act, obs, r->logit));
        for (int i = 0; i < n; ++i) {
            OmRng rng = om_rng_init(def->seed ^ ACTION_STREAM, (uint64_t)c->nstep + (uint64_t)i);
            double log_prob =
                om__rl_choice_draw(task->naction, task->nchoice, r->logit + (ptrdiff_t)i * nlogit,
                                   &rng, action + (ptrdiff_t)i * task->naction);
            OM_CHECK(isfinite(log_prob), OM_INVALID,
                     "the policy gives a value that is not finite; lower the learning rate");
            r->log_prob[at + i] = (float)log_prob;
        }
        OmRlStep out = {.obs = obs,
                        .reward = r->reward + at,
                        .is_terminated = r->is_terminated,
                        .is_truncated = r->is_truncated,
                        .final_obs = r->final_obs,
                        .final_info = r->final_info,
                        .final_return = r->final_return,
                        .final_length = r->final_length};
        OM_TRY(om_rl_vec_step(vec, action, &out));
        for (int i = 0; i < n; ++i) r->is_end[at + i] = r->is_terminated[i] || r->is_truncated[i];
        OM_TRY(add_bonus(l, r, r->bonus + at));
        count_episodes(task, r, c);
        c->nstep += n;
    }
    return om_net_run_forward(l->judge, obs, r->value + (ptrdiff_t)r->nstep * n);
}

// Welford's sums of the discounted returns.
static void add_return(RlCounters* c, double x) {
    double d = x - c->norm_mean;
    c->norm_count += 1;
    c->norm_mean += d / c->norm_count;
    c->norm_square += d * (x - c->norm_mean);
}

void om__rl_rollout_finish(const OmRlTrainDef* def, double* running, RlCounters* c, RlRollout* r) {
    for (int t = 0; t < r->nstep; ++t) {
        const ptrdiff_t at = (ptrdiff_t)t * r->nenv;
        for (int i = 0; def->normalise_reward && i < r->nenv; ++i) {
            running[i] = running[i] * def->gamma + r->reward[at + i];
            add_return(c, running[i]);
            if (r->is_end[at + i]) running[i] = 0;
        }
        double scale = 1;
        if (def->normalise_reward)
            scale = 1 / sqrt(c->norm_square / c->norm_count + 1e-8);  // count >= nenv > 0
        for (int i = 0; i < r->nenv; ++i) {
            double* x = &r->reward[at + i];
            *x *= scale;
            if (def->normalise_reward) *x = fmin(fmax(*x, -REWARD_LIMIT), REWARD_LIMIT);
            *x += r->bonus[at + i];
        }
    }
    om__rl_gae(r->nstep, r->nenv, def->gamma, def->lambda, r->reward, r->is_end, r->value,
               r->advantage, r->target);
}
