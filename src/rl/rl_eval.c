// rl_eval.c: episodes of a policy, of an expert, or of random actions.
//
// A vector of environments runs groups of episodes side by side. Each environment runs one episode and then waits for
// the next group. So memory does not grow with the number of episodes.
#include <math.h>
#include <string.h>

#include "rl/rl_internal.h"

#define COOKIE 0x6576616cu
enum { DRAWN = 100, GROUP = 64 };

OmRlEvalDef om_rl_eval_default_def(const OmRlTask* task, OmRlPolicy* policy) {
    return (OmRlEvalDef){.cookie = COOKIE, .task = task, .policy = policy, .seed = 1000};
}

void om_rl_eval_done(OmRlEval* e) {
    om_free(e->episode);
    om_free(e->ret);
    om_free(e->score);
    om_free(e->length);
    om_free(e->is_ended);
    om_free(e->info);
    *e = (OmRlEval){0};
}

typedef struct Running {
    const OmRlEvalDef* def;
    int n;             // episodes
    int nenv;          // environments
    int begin, count;  // episodes of the group
    OmRlVec* vec;
    OmRlActor* actor;
    float* obs;
    int *action, *length;
    OmRng* rng;
    double *sum, *info;
    bool *is_terminated, *is_truncated, *is_done;
} Running;

static OmStatus running_init(const OmRlEvalDef* def, int n, Running* r) {
    const OmRlTask* task = def->task;
    OmRlVecDef vec = om_rl_vec_default_def(task);
    r->def = def;
    r->n = n;
    r->nenv = vec.nenv = n < GROUP ? n : GROUP;
    vec.nworker = def->nworker;
    vec.seed = def->seed;
    vec.has_autoreset = false;
    OM_TRY(om_rl_vec_create(&vec, &r->vec));
    if (def->policy && !def->is_expert) OM_TRY(om_rl_actor_create(def->policy, r->nenv, &r->actor));
    OM_ALLOC(r->obs, (size_t)r->nenv * (size_t)task->nobservation);
    OM_ALLOC(r->action, (size_t)r->nenv * (size_t)task->naction);
    OM_ALLOC(r->length, r->nenv);
    OM_ALLOC(r->rng, r->nenv);
    OM_ALLOC(r->sum, r->nenv);
    OM_ALLOC(r->info, (size_t)r->nenv * OM_RL_MAX_INFO);
    OM_ALLOC(r->is_terminated, r->nenv);
    OM_ALLOC(r->is_truncated, r->nenv);
    OM_ALLOC(r->is_done, r->nenv);
    memset(r->obs, 0, (size_t)r->nenv * (size_t)task->nobservation * sizeof *r->obs);
    memset(r->action, 0, (size_t)r->nenv * (size_t)task->naction * sizeof *r->action);
    return OM_OK;
}

static OmStatus begin_group(Running* r, int begin, const OmProgress* progress) {
    const OmRlTask* task = r->def->task;
    const bool is_drawn = r->def->is_drawn || task->nstart == 0;
    r->begin = begin;
    r->count = r->n - begin < r->nenv ? r->n - begin : r->nenv;
    for (int i = 0; i < r->nenv; ++i) r->is_done[i] = i >= r->count;
    for (int i = 0; i < r->count; ++i) {
        OM_TRY(om_progress_report(progress, "episodes", begin, r->n));
        r->rng[i] = om_rng_init(r->def->seed, 0x6576616c00000000ull + (uint64_t)(begin + i));
        OM_TRY(om_rl_vec_reset_one(r->vec, i, is_drawn ? -1 : (begin + i) % task->nstart,
                                   r->obs + (ptrdiff_t)i * task->nobservation));
    }
    return OM_OK;
}

static void running_done(Running* r) {
    om_rl_vec_destroy(r->vec);
    om_rl_actor_destroy(r->actor);
    om_free(r->obs);
    om_free(r->action);
    om_free(r->length);
    om_free(r->rng);
    om_free(r->sum);
    om_free(r->info);
    om_free(r->is_terminated);
    om_free(r->is_truncated);
    om_free(r->is_done);
}

static OmStatus choose(Running* r) {
    const OmRlTask* task = r->def->task;
    if (r->actor)
        return om_rl_actor_act(r->actor, r->obs, r->def->is_random ? r->rng : NULL, r->action,
                               NULL);
    for (int i = 0; i < r->count; ++i) {
        int* a = r->action + (ptrdiff_t)i * task->naction;
        if (r->def->is_expert)
            OM_TRY(om_rl_vec_expert(r->vec, i, &r->rng[i], a));
        else
            for (int k = 0; k < task->naction; ++k)
                a[k] = (int)om_rng_below(&r->rng[i], (uint32_t)task->nchoice[k]);
    }
    return OM_OK;
}

static void keep_episode(const Running* r, int i, OmRlEval* e) {
    const OmRlTask* task = r->def->task;
    const double* info = r->info + (ptrdiff_t)i * task->ninfo;
    const int score = om__rl_score_index(task), at = r->begin + i;
    e->ret[at] = r->sum[i];
    e->length[at] = r->length[i];
    e->is_ended[at] = r->is_terminated[i];
    e->score[at] = score < 0 ? r->sum[i] : info[score];
    for (int k = 0; k < task->ninfo; ++k) e->info[(ptrdiff_t)at * task->ninfo + k] = info[k];
}

static OmStatus run_group(Running* r, const OmProgress* progress, OmRlEval* e) {
    const OmRlTask* task = r->def->task;
    int left = r->count;
    while (left > 0) {
        OM_TRY(om_progress_report(progress, "episodes", r->begin + r->count - left, r->n));
        OM_TRY(choose(r));
        for (int i = 0; i < r->nenv; ++i)
            if (r->is_done[i]) r->action[(ptrdiff_t)i * task->naction] = OM_RL_WAIT;
        OM_TRY(om_rl_vec_step(r->vec, r->action,
                              &(OmRlStep){.obs = r->obs,
                                          .is_terminated = r->is_terminated,
                                          .is_truncated = r->is_truncated,
                                          .final_info = r->info,
                                          .final_return = r->sum,
                                          .final_length = r->length}));
        for (int i = 0; i < r->count; ++i) {
            if (r->is_done[i] || !(r->is_terminated[i] || r->is_truncated[i])) continue;
            keep_episode(r, i, e);
            r->is_done[i] = true;
            --left;
        }
    }
    return OM_OK;
}

static OmStatus run_all(Running* r, const OmProgress* progress, OmRlEval* e) {
    for (int begin = 0; begin < r->n; begin += GROUP) {
        OM_TRY(begin_group(r, begin, progress));
        OM_TRY(run_group(r, progress, e));
    }
    return OM_OK;
}

// Close the gaps of episodes that did not finish (of no step), and compute the figures.
static void summarise(int n, int ninfo, OmRlEval* e) {
    for (int i = 0; i < n; ++i) {
        const int at = e->nepisode;
        if (e->length[i] == 0) continue;
        e->episode[at] = i;
        e->ret[at] = e->ret[i];
        e->score[at] = e->score[i];
        e->length[at] = e->length[i];
        e->is_ended[at] = e->is_ended[i];
        for (int k = 0; k < ninfo; ++k)
            e->info[(ptrdiff_t)at * ninfo + k] = e->info[(ptrdiff_t)i * ninfo + k];
        e->mean_return += e->ret[at];
        e->mean_score += e->score[at];
        e->mean_length += e->length[at];
        e->min_score = at == 0 ? e->score[0] : fmin(e->min_score, e->score[at]);
        ++e->nepisode;
    }
    if (e->nepisode == 0) return;
    e->mean_return /= e->nepisode;
    e->mean_score /= e->nepisode;
    e->mean_length /= e->nepisode;
}

OmStatus om_rl_eval_run(const OmRlEvalDef* def, const OmProgress* progress, OmRlEval* eval) {
    Running r = {0};
    OmStatus status = OM_OK;
    *eval = (OmRlEval){0};
    OM_CHECK(def->cookie == COOKIE, OM_INVALID, "evaluation: begin with om_rl_eval_default_def()");
    OM_CHECK(def->nepisode >= 0 && def->nepisode <= OM__RL_MAX_EPISODE, OM_INVALID,
             "evaluation: nepisode is %d, outside 0 to %d", def->nepisode, OM__RL_MAX_EPISODE);
    if (def->policy) OM_TRY(om_rl_policy_check(def->policy, def->task));
    int n = def->nepisode;
    if (n == 0) n = def->task->nstart && !def->is_drawn ? def->task->nstart : DRAWN;
    OM_ALLOC_DONE(eval->episode, n);
    OM_ALLOC_DONE(eval->ret, n);
    OM_ALLOC_DONE(eval->score, n);
    OM_CALLOC_DONE(eval->length, n);
    OM_ALLOC_DONE(eval->is_ended, n);
    OM_ALLOC_DONE(eval->info, (size_t)n * (size_t)def->task->ninfo + 1);
    OM_TRY_DONE(running_init(def, n, &r));
    status = run_all(&r, progress, eval);
    if (status >= 0 || status == OM_CANCELLED) summarise(n, def->task->ninfo, eval);
done:
    running_done(&r);
    if (status < 0 && status != OM_CANCELLED) om_rl_eval_done(eval);
    return status;
}
