// rl_vec.c: environments side by side.
//
// Each environment has its own state, counter of episodes and random stream, so blocks of environments may run on any
// worker. The random numbers of an episode come from Philox with the index (environment, episode). A message of an
// error is copied from the worker's thread; the error of the first environment is returned.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "rl/rl_internal.h"

#define COOKIE 0x726c7665u
enum { MESSAGE = 256, MAX_ENV = 65536 };

typedef struct Env {  // saved beside the bytes of the state
    int64_t episode;  // number of the present one; -1: none yet
    int64_t length;   // steps of the episode; -1: it is over, and not reset
    double sum;       // of its rewards
} Env;

typedef struct Failure {
    OmStatus status;
    char message[MESSAGE];
} Failure;

struct OmRlVec {
    OmRlVecDef def;
    void** state;      // (nenv)
    Env* env;          // (nenv)
    Failure* failure;  // (nenv)
};

typedef struct Head {  // of a saved block
    uint64_t task, seed;
    int64_t nenv, state_size;
} Head;

OmRlVecDef om_rl_vec_default_def(const OmRlTask* task) {
    return (OmRlVecDef){.cookie = COOKIE,
                        .task = task,
                        .nenv = 8,
                        .seed = 1,
                        .has_info = true,
                        .has_autoreset = true};
}

OmStatus om_rl_vec_create(const OmRlVecDef* def, OmRlVec** vec) {
    OmStatus status = OM_OK;
    *vec = NULL;
    OM_CHECK(def->cookie == COOKIE, OM_INVALID, "environments: begin with om_rl_vec_default_def()");
    OM_CHECK(def->task, OM_INVALID, "environments: no task");
    OM_TRY(om__rl_check_bounds(def->task));
    OM_CHECK(def->nenv > 0 && def->nenv <= MAX_ENV, OM_INVALID,
             "environments: nenv is %d, outside 1 to %d", def->nenv, MAX_ENV);
    OM_CHECK(def->nworker >= 0, OM_INVALID, "environments: nworker is %d", def->nworker);
    OmRlVec* v = om_calloc(1, sizeof *v);
    if (!v) return OM_NO_MEMORY;
    v->def = *def;
    OM_CALLOC_DONE(v->state, def->nenv);
    OM_CALLOC_DONE(v->env, def->nenv);
    OM_CALLOC_DONE(v->failure, def->nenv);
    for (int i = 0; i < def->nenv; ++i) {
        v->env[i].episode = -1;
        OM_TRY_DONE(def->task->ops->state_create(def->task, &v->state[i]));
    }
    *vec = v;
    v = NULL;
done:
    om_rl_vec_destroy(v);
    return status;
}

void om_rl_vec_destroy(OmRlVec* vec) {
    if (!vec) return;
    for (int i = 0; vec->state && i < vec->def.nenv; ++i)
        if (vec->state[i]) vec->def.task->ops->state_destroy(vec->def.task, vec->state[i]);
    om_free(vec->state);
    om_free(vec->env);
    om_free(vec->failure);
    om_free(vec);
}

const OmRlTask* om_rl_vec_task(const OmRlVec* vec) { return vec->def.task; }

int om_rl_vec_nenv(const OmRlVec* vec) { return vec->def.nenv; }

// ---- episodes -----------------------------------------------------------------------------------------

static OmStatus begin_episode(OmRlVec* v, int i, int start) {
    const OmRlTask* task = v->def.task;
    Env* e = &v->env[i];
    ++e->episode;
    e->length = 0;
    e->sum = 0;
    uint64_t index = (uint64_t)i << 40 | (uint64_t)e->episode;
    return task->ops->reset(task, v->state[i], om_rng_init(v->def.seed, index), start);
}

static void keep_failure(OmRlVec* v, int i, OmStatus status) {
    v->failure[i].status = status;
    if (status < 0) snprintf(v->failure[i].message, MESSAGE, "%s", om_error_message());
}

// The failure of the first environment.
static OmStatus first_failure(const OmRlVec* v) {
    for (int i = 0; i < v->def.nenv; ++i)
        if (v->failure[i].status < 0)
            return om_error(v->failure[i].status, "environment %d: %s", i, v->failure[i].message);
    return OM_OK;
}

typedef struct Call {
    OmRlVec* vec;
    const int* action;
    const OmRlStep* out;
    float* obs;
} Call;

static void reset_block(void* ctx, int begin, int end, int block) {
    (void)block;
    const Call* c = ctx;
    const OmRlTask* task = c->vec->def.task;
    for (int i = begin; i < end; ++i) {
        OmStatus status = begin_episode(c->vec, i, -1);
        if (status >= 0)
            om__rl_observe(task, c->vec->state[i], c->obs + (ptrdiff_t)i * task->nobservation);
        keep_failure(c->vec, i, status);
    }
}

OmStatus om_rl_vec_reset(OmRlVec* vec, float* obs) {
    Call call = {.vec = vec, .obs = obs};
    om_parallel_for(vec->def.nworker, vec->def.nenv, 1, reset_block, &call);
    return first_failure(vec);
}

void om_rl_vec_set_seed(OmRlVec* vec, uint64_t seed) {
    vec->def.seed = seed;
    for (int i = 0; i < vec->def.nenv; ++i) vec->env[i].episode = -1;
}

static OmStatus check_env(const OmRlVec* vec, int env) {
    OM_CHECK(env >= 0 && env < vec->def.nenv, OM_INVALID, "no environment %d of %d", env,
             vec->def.nenv);
    return OM_OK;
}

OmStatus om_rl_vec_reset_one(OmRlVec* vec, int env, int start, float* obs) {
    const OmRlTask* task = vec->def.task;
    OM_TRY(check_env(vec, env));
    OM_CHECK(start >= -1 && start < task->nstart, OM_INVALID, "task %s has no start %d", task->name,
             start);
    OM_TRY(begin_episode(vec, env, start));
    om__rl_observe(task, vec->state[env], obs);
    return OM_OK;
}

// ---- steps --------------------------------------------------------------------------------------------

// The last observation, infos, return and length of an episode; then the next episode, with autoreset.
static OmStatus end_episode(const Call* c, int i) {
    OmRlVec* v = c->vec;
    const OmRlTask* task = v->def.task;
    const OmRlStep* out = c->out;
    if (out->final_obs)
        om__rl_observe(task, v->state[i], out->final_obs + (ptrdiff_t)i * task->nobservation);
    if (out->final_return) out->final_return[i] = v->env[i].sum;
    if (out->final_length) out->final_length[i] = (int)v->env[i].length;
    if (out->final_info && v->def.has_info && task->ops->info)
        OM_TRY(task->ops->info(task, v->state[i], out->final_info + (ptrdiff_t)i * task->ninfo));
    if (v->def.has_autoreset) return begin_episode(v, i, -1);
    v->env[i].length = -1;
    return OM_OK;
}

static OmStatus step_one(const Call* c, int i) {
    OmRlVec* v = c->vec;
    const OmRlTask* task = v->def.task;
    const OmRlStep* out = c->out;
    double reward = 0;
    bool is_terminated = false;
    const int* action = c->action + (ptrdiff_t)i * task->naction;
    bool is_waiting = action[0] == OM_RL_WAIT;
    if (!is_waiting) {
        OM_TRY(task->ops->step(task, v->state[i], action, &reward, &is_terminated));
        ++v->env[i].length;
    }
    OM_CHECK(isfinite(reward), OM_INVALID, "task %s: a reward that is not finite", task->name);
    v->env[i].sum += reward;
    bool is_truncated = !is_waiting && !is_terminated && v->env[i].length >= task->max_step;
    if (out->reward) out->reward[i] = reward;
    if (out->is_terminated) out->is_terminated[i] = is_terminated;
    if (out->is_truncated) out->is_truncated[i] = is_truncated;
    if (is_terminated || is_truncated) OM_TRY(end_episode(c, i));
    if (out->obs) om__rl_observe(task, v->state[i], out->obs + (ptrdiff_t)i * task->nobservation);
    return OM_OK;
}

static void step_block(void* ctx, int begin, int end, int block) {
    (void)block;
    const Call* c = ctx;
    for (int i = begin; i < end; ++i) keep_failure(c->vec, i, step_one(c, i));
}

OmStatus om_rl_vec_step(OmRlVec* vec, const int* action, const OmRlStep* out) {
    const OmRlTask* task = vec->def.task;
    for (int i = 0; i < vec->def.nenv; ++i) {
        bool is_waiting = action[(ptrdiff_t)i * task->naction] == OM_RL_WAIT;
        OM_CHECK(vec->env[i].episode >= 0, OM_INVALID, "environment %d: reset comes before step",
                 i);
        OM_CHECK(vec->env[i].length >= 0 || is_waiting, OM_INVALID,
                 "environment %d: its episode is over; reset it", i);
        for (int k = 0; k < task->naction && !is_waiting; ++k) {
            int a = action[(ptrdiff_t)i * task->naction + k];
            OM_CHECK(a >= 0 && a < task->nchoice[k], OM_INVALID,
                     "environment %d: action[%d] is %d, outside 0 to %d", i, k, a,
                     task->nchoice[k] - 1);
        }
    }
    Call call = {.vec = vec, .action = action, .out = out};
    om_parallel_for(vec->def.nworker, vec->def.nenv, 1, step_block, &call);
    return first_failure(vec);
}

// ---- one environment ----------------------------------------------------------------------------------

OmStatus om_rl_vec_info(OmRlVec* vec, int env, double* value) {
    const OmRlTask* task = vec->def.task;
    OM_TRY(check_env(vec, env));
    OM_CHECK(task->ops->info, OM_INVALID, "task %s has no infos", task->name);
    return task->ops->info(task, vec->state[env], value);
}

OmStatus om_rl_vec_render(OmRlVec* vec, int env, OmPicture* picture) {
    const OmRlTask* task = vec->def.task;
    OM_TRY(check_env(vec, env));
    OM_CHECK(task->ops->render, OM_UNAVAILABLE, "task %s has no picture", task->name);
    return task->ops->render(task, vec->state[env], picture);
}

OmStatus om_rl_vec_expert(OmRlVec* vec, int env, OmRng* rng, int* action) {
    const OmRlTask* task = vec->def.task;
    OM_TRY(check_env(vec, env));
    OM_CHECK(task->ops->expert, OM_UNAVAILABLE, "task %s has no expert", task->name);
    task->ops->expert(task, vec->state[env], rng, action);
    return OM_OK;
}

void om_rl_vec_observe(const OmRlVec* vec, float* obs) {
    const OmRlTask* task = vec->def.task;
    for (int i = 0; i < vec->def.nenv; ++i)
        om__rl_observe(task, vec->state[i], obs + (ptrdiff_t)i * task->nobservation);
}

// ---- saving -------------------------------------------------------------------------------------------

static Head head_of(const OmRlVec* v) {
    return (Head){.task = v->def.task->hash,
                  .seed = v->def.seed,
                  .nenv = v->def.nenv,
                  .state_size = (int64_t)v->def.task->ops->state_size(v->def.task)};
}

size_t om_rl_vec_size(const OmRlVec* vec) {
    Head head = head_of(vec);
    return sizeof head + (size_t)vec->def.nenv * (sizeof(Env) + (size_t)head.state_size);
}

static void save_state(const OmRlTask* task, const void* state, void* block) {
    if (task->ops->save)
        task->ops->save(task, state, block);
    else
        memcpy(block, state, task->ops->state_size(task));
}

static void restore_state(const OmRlTask* task, void* state, const void* block) {
    if (task->ops->restore)
        task->ops->restore(task, state, block);
    else
        memcpy(state, block, task->ops->state_size(task));
}

void om_rl_vec_save(const OmRlVec* vec, void* block) {
    const OmRlTask* task = vec->def.task;
    Head head = head_of(vec);
    unsigned char* at = block;
    memcpy(at, &head, sizeof head);
    at += sizeof head;
    for (int i = 0; i < vec->def.nenv; ++i) {
        memcpy(at, &vec->env[i], sizeof(Env));
        save_state(task, vec->state[i], at + sizeof(Env));
        at += sizeof(Env) + (size_t)head.state_size;
    }
}

OmStatus om_rl_vec_restore(OmRlVec* vec, const void* block) {
    const OmRlTask* task = vec->def.task;
    Head head = head_of(vec), saved;
    const unsigned char* at = block;
    memcpy(&saved, at, sizeof saved);
    OM_CHECK(memcmp(&saved, &head, sizeof head) == 0, OM_INVALID,
             "environments: saved with another task, seed or number of environments");
    at += sizeof head;
    for (int i = 0; i < vec->def.nenv; ++i) {
        memcpy(&vec->env[i], at, sizeof(Env));
        restore_state(task, vec->state[i], at + sizeof(Env));
        at += sizeof(Env) + (size_t)head.state_size;
    }
    return OM_OK;
}
