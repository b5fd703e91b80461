// rl_demo.c: demonstrations of a task by its scripted expert.
#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "rl/rl_internal.h"

enum { MAX_DEMO = 100000 };

void om_rl_demos_done(OmRlDemos* d) {
    om_free(d->adr);
    om_free(d->obs);
    om_free(d->action);
    om_free(d->reward);
    om_free(d->score);
    *d = (OmRlDemos){0};
}

OmStatus om_rl_demos_check(const OmRlDemos* d, const OmRlTask* task) {
    const bool is_named = d->task[0] != 0;
    OM_CHECK(!is_named || strcmp(d->task, task->name) == 0, OM_INVALID,
             "the demonstrations are of task %s, not of %s", d->task, task->name);
    OM_CHECK(d->nobservation == task->nobservation && d->naction == task->naction, OM_INVALID,
             "the demonstrations have observations of %d values and actions of %d components, the "
             "task has %d and %d",
             d->nobservation, d->naction, task->nobservation, task->naction);
    // without a name the choices are the largest numbers seen
    for (int k = 0; k < d->naction; ++k)
        OM_CHECK(is_named ? d->nchoice[k] == task->nchoice[k] : d->nchoice[k] <= task->nchoice[k],
                 OM_INVALID, "component %d of the demonstrations has %d choices, of the task %d", k,
                 d->nchoice[k], task->nchoice[k]);
    OM_CHECK(!d->meaning[0] || strcmp(d->meaning, task->meaning) == 0, OM_INVALID,
             "the demonstrations have the settings %s, the task has %s; record demonstrations with "
             "the settings of the task",
             d->meaning, task->meaning[0] ? task->meaning : "none");
    return OM_OK;
}

static void episode_done(OmRlDemoEpisode* e) {
    om_free(e->obs);
    om_free(e->action);
    om_free(e->reward);
}

typedef struct Watch {  // shared by the workers
    const OmProgress* progress;
    int ndone, ndemo;
    atomic_flag is_reporting;
    atomic_bool is_cancelled;
} Watch;

// After each step: an episode takes seconds. One worker at a time reports.
static OmStatus watch_step(Watch* w) {
    if (atomic_load(&w->is_cancelled)) return OM_CANCELLED;
    if (atomic_flag_test_and_set(&w->is_reporting)) return OM_OK;
    const OmStatus status = om_progress_report(w->progress, "demonstrations", w->ndone, w->ndemo);
    atomic_flag_clear(&w->is_reporting);
    if (status < 0) atomic_store(&w->is_cancelled, true);
    return status;
}

typedef struct Recording {
    const OmRlTask* task;
    uint64_t seed;
    int first;  // episode of block 0
    Watch* watch;
    OmRlDemoEpisode* episode;  // (ndemo)
    OmStatus* status;          // (ndemo)
} Recording;

// One episode of a vector of one environment: episode k is environment 0 of seed + k.
static OmStatus record_one(const Recording* r, int k) {
    const OmRlTask* task = r->task;
    OmRlDemoEpisode* e = &r->episode[k];
    OmRlVecDef def = om_rl_vec_default_def(task);
    OmRlVec* vec = NULL;
    OmStatus status;
    OmRng rng = om_rng_init(r->seed, 0x64656d6f00000000ull + (uint64_t)k);
    float* next = NULL;
    double info[OM_RL_MAX_INFO] = {0}, sum = 0;
    bool is_terminated = false, is_truncated = false;
    const size_t nobs = (size_t)task->nobservation, naction = (size_t)task->naction;
    def.nenv = 1;
    def.nworker = 1;
    def.seed = r->seed + (uint64_t)k;
    const size_t most = (size_t)task->max_step;
    OM_ALLOC_DONE(e->obs, most * nobs);
    OM_ALLOC_DONE(e->action, most * naction);
    OM_ALLOC_DONE(e->reward, most);
    OM_ALLOC_DONE(next, nobs);
    OM_TRY_DONE(om_rl_vec_create(&def, &vec));
    OM_TRY_DONE(om_rl_vec_reset(vec, next));
    while (!is_terminated && !is_truncated) {
        memcpy(e->obs + (size_t)e->n * nobs, next, nobs * sizeof *next);
        OM_TRY_DONE(om_rl_vec_expert(vec, 0, &rng, e->action + (size_t)e->n * naction));
        OM_TRY_DONE(om_rl_vec_step(vec, e->action + (size_t)e->n * naction,
                                   &(OmRlStep){.obs = next,
                                               .reward = e->reward + e->n,
                                               .is_terminated = &is_terminated,
                                               .is_truncated = &is_truncated,
                                               .final_info = info,
                                               .final_return = &sum}));
        ++e->n;
        OM_TRY_DONE(watch_step(r->watch));
    }
    e->score = om__rl_score_index(task) < 0 ? sum : info[om__rl_score_index(task)];
done:
    om_free(next);
    om_rl_vec_destroy(vec);
    return status;
}

static void record_block(void* ctx, int begin, int end, int block) {
    (void)block;
    Recording* r = ctx;
    for (int k = r->first + begin; k < r->first + end; ++k) r->status[k] = record_one(r, k);
}

OmStatus om__rl_demos_alloc(int ndemo, int nstep, int nobservation, int naction, OmRlDemos* d) {
    d->ndemo = ndemo;
    d->nstep = nstep;
    d->nobservation = nobservation;
    d->naction = naction;
    OM_ALLOC(d->adr, ndemo + 1);
    OM_ALLOC(d->obs, (size_t)nstep * (size_t)nobservation);
    OM_ALLOC(d->action, (size_t)nstep * (size_t)naction);
    OM_ALLOC(d->reward, nstep);
    OM_ALLOC(d->score, ndemo);
    return OM_OK;
}

// The old arrays are freed when all new ones are complete.
OmStatus om__rl_demos_append(OmRlDemos* d, const OmRlTask* task, const OmRlDemoEpisode* e,
                             int nepisode) {
    const size_t nobs = (size_t)task->nobservation, naction = (size_t)task->naction;
    size_t at = (size_t)d->nstep, nstep = at;
    OmRlDemos all = {0};
    if (d->ndemo > 0) OM_TRY(om_rl_demos_check(d, task));
    for (int k = 0; k < nepisode; ++k) nstep += (size_t)e[k].n;
    OM_CHECK((double)nstep * (double)nobs < INT32_MAX && d->ndemo + nepisode <= MAX_DEMO,
             OM_INVALID, "demonstrations: too many steps; begin another file");
    OmStatus status = om__rl_demos_alloc(d->ndemo + nepisode, (int)nstep, task->nobservation,
                                         task->naction, &all);
    if (status < 0) {
        om_rl_demos_done(&all);
        return status;
    }
    memcpy(all.task, task->name, sizeof all.task);
    // a file that does not say what its steps mean says no more with another episode
    memcpy(all.meaning, d->ndemo > 0 ? d->meaning : task->meaning, sizeof all.meaning);
    memcpy(all.nchoice, task->nchoice, sizeof all.nchoice);
    if (d->ndemo > 0) {
        memcpy(all.adr, d->adr, (size_t)d->ndemo * sizeof *all.adr);
        memcpy(all.obs, d->obs, at * nobs * sizeof *all.obs);
        memcpy(all.action, d->action, at * naction * sizeof *all.action);
        memcpy(all.reward, d->reward, at * sizeof *all.reward);
        memcpy(all.score, d->score, (size_t)d->ndemo * sizeof *all.score);
    }
    for (int k = 0; k < nepisode; ++k) {
        const size_t n = (size_t)e[k].n;
        all.adr[d->ndemo + k] = (int)at;
        memcpy(all.obs + at * nobs, e[k].obs, n * nobs * sizeof *all.obs);
        memcpy(all.action + at * naction, e[k].action, n * naction * sizeof *all.action);
        memcpy(all.reward + at, e[k].reward, n * sizeof *all.reward);
        all.score[d->ndemo + k] = e[k].score;
        at += n;
    }
    all.adr[all.ndemo] = (int)at;
    om_rl_demos_done(d);
    *d = all;
    return OM_OK;
}

// Episodes begin .. ndemo - 1 into r->episode, in groups whose seeds do not depend on `begin`.
static OmStatus record_all(const Recording* r, int begin, int ndemo) {
    enum { GROUP = 8 };
    for (int end; begin < ndemo; begin = end) {
        const int group = begin - begin % GROUP;
        end = group + GROUP < ndemo ? group + GROUP : ndemo;
        r->watch->ndone = begin;
        OM_TRY(watch_step(r->watch));
        Recording part = *r;
        part.first = begin - group;
        part.seed = r->seed + (uint64_t)group;
        part.episode = r->episode + group;
        part.status = r->status + group;
        om_parallel_for(0, end - begin, 1, record_block, &part);
        OM_CHECK(!atomic_load(&r->watch->is_cancelled), OM_CANCELLED,
                 "cancelled during demonstrations");
        for (int k = begin; k < end; ++k)
            if (r->status[k] < 0)
                return om_error(r->status[k], "demonstration %d of task %s failed", k,
                                r->task->name);
    }
    return OM_OK;
}

static OmStatus check_partial(const OmRlDemos* d, const OmRlTask* task, int ndemo, uint64_t seed) {
    if (d->ndemo == 0) return OM_OK;
    OM_CHECK(d->is_partial && d->seed == seed, OM_INVALID,
             "the demonstrations are not of a recording that was cancelled, with seed %llu",
             (unsigned long long)seed);
    OM_CHECK(d->ndemo <= ndemo, OM_INVALID,
             "there are %d demonstrations already, more than the number %d", d->ndemo, ndemo);
    return om_rl_demos_check(d, task);
}

OmStatus om_rl_demos_continue(const OmRlTask* task, int ndemo, uint64_t seed,
                              const OmProgress* progress, OmRlDemos* demos) {
    Watch watch = {.progress = progress, .ndemo = ndemo, .is_reporting = ATOMIC_FLAG_INIT};
    Recording r = {.task = task, .seed = seed, .watch = &watch};
    OmStatus status = OM_OK;
    const int begin = demos->ndemo;
    int end = begin;
    OM_CHECK(ndemo > 0 && ndemo <= MAX_DEMO, OM_INVALID, "demonstrations: ndemo is %d", ndemo);
    OM_CHECK(task->ops->expert, OM_UNAVAILABLE, "task %s has no expert", task->name);
    OM_TRY(check_partial(demos, task, ndemo, seed));
    OM_CALLOC_DONE(r.episode, ndemo);
    OM_ALLOC_DONE(r.status, ndemo);
    for (int k = 0; k < ndemo; ++k) r.status[k] = OM_CANCELLED;
    const OmStatus outcome = record_all(&r, begin, ndemo);
    status = outcome;
    if (outcome < 0 && outcome != OM_CANCELLED) goto done;
    while (end < ndemo && r.status[end] >= 0) ++end;
    if (end > begin) {
        OM_TRY_DONE(om__rl_demos_append(demos, task, r.episode + begin, end - begin));
        status = outcome;
    }
    demos->is_partial = outcome < 0 && end > 0;
    demos->seed = demos->is_partial ? seed : 0;
done:
    for (int k = 0; r.episode && k < ndemo; ++k) episode_done(&r.episode[k]);
    om_free(r.episode);
    om_free(r.status);
    return status;
}

OmStatus om_rl_demos_record(const OmRlTask* task, int ndemo, uint64_t seed,
                            const OmProgress* progress, OmRlDemos* demos) {
    *demos = (OmRlDemos){0};
    OmStatus status = om_rl_demos_continue(task, ndemo, seed, progress, demos);
    if (status < 0) om_rl_demos_done(demos);
    return status;
}
