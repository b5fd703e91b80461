// rl_drive.c: one environment that is driven step by step, and keeps its episode.
#include "omentum/rl_drive.h"

#include <math.h>
#include <string.h>

#include "rl/rl_internal.h"

#define STREAM 0x6472697665000000ull  // of the episodes' random numbers

struct OmRlDrive {
    const OmRlTask* task;
    uint64_t seed;
    void* state;
    OmRlDriveNow now;
    int capacity;    // steps
    float* obs;      // before each step            (capacity x nobservation)
    int* action;     //                             (capacity x naction)
    double* reward;  //                             (capacity)
};

OmStatus om_rl_drive_create(const OmRlTask* task, uint64_t seed, OmRlDrive** drive) {
    *drive = NULL;
    OM_TRY(om__rl_check_bounds(task));
    OmRlDrive* d = om_calloc(1, sizeof *d);
    if (!d) return OM_NO_MEMORY;
    d->task = task;
    d->seed = seed;
    d->now = (OmRlDriveNow){.episode = -1, .is_over = true};
    OmStatus status = task->ops->state_create(task, &d->state);
    if (status < 0)
        om_free(d);
    else
        *drive = d;
    return status;
}

void om_rl_drive_destroy(OmRlDrive* d) {
    if (!d) return;
    d->task->ops->state_destroy(d->task, d->state);
    om_free(d->obs);
    om_free(d->action);
    om_free(d->reward);
    om_free(d);
}

OmStatus om_rl_drive_reset(OmRlDrive* d, int start) {
    OM_CHECK(start >= -1 && start<d->task->nstart, OM_INVALID, d->task->nstart> 0
                 ? "task %s has no start %d; its starts are 0 to %d"
                 : "task %s has no start %d; it has %d starts",
             d->task->name, start, d->task->nstart > 0 ? d->task->nstart - 1 : 0);
    int episode = d->now.episode + 1;
    d->now = (OmRlDriveNow){.episode = episode, .is_over = true};
    OM_TRY(d->task->ops->reset(d->task, d->state, om_rng_init(d->seed, STREAM + (uint64_t)episode),
                               start));
    d->now.is_over = false;
    return OM_OK;
}

// Memory for one more step.
static OmStatus grow(OmRlDrive* d) {
    const size_t old = (size_t)d->capacity, num = old ? 2 * old : 256;
    const size_t nobs = (size_t)d->task->nobservation, naction = (size_t)d->task->naction;
    if (d->now.nstep < d->capacity) return OM_OK;
    OM_CHECK(num < INT32_MAX / 2, OM_INVALID, "an episode of too many steps");
    float* obs = om_realloc(d->obs, old * nobs, num * nobs, sizeof *obs);
    if (obs) d->obs = obs;
    int* action = obs ? om_realloc(d->action, old * naction, num * naction, sizeof *action) : NULL;
    if (action) d->action = action;
    double* reward = action ? om_realloc(d->reward, old, num, sizeof *reward) : NULL;
    if (!reward) return OM_NO_MEMORY;
    d->reward = reward;
    d->capacity = (int)num;
    return OM_OK;
}

OmStatus om_rl_drive_step(OmRlDrive* d, const int* action) {
    const OmRlTask* task = d->task;
    const size_t n = (size_t)d->now.nstep;
    double reward = 0;
    bool is_terminated = false;
    OM_CHECK(!d->now.is_over, OM_INVALID, "the episode is over; reset comes before step");
    for (int k = 0; k < task->naction; ++k)
        OM_CHECK(action[k] >= 0 && action[k] < task->nchoice[k], OM_INVALID,
                 "action[%d] is %d, outside 0 to %d", k, action[k], task->nchoice[k] - 1);
    OM_TRY(grow(d));
    om__rl_observe(task, d->state, d->obs + n * (size_t)task->nobservation);
    memcpy(d->action + n * (size_t)task->naction, action, (size_t)task->naction * sizeof *action);
    OmStatus status = task->ops->step(task, d->state, action, &reward, &is_terminated);
    if (status >= 0 && !isfinite(reward))
        status = om_error(OM_INVALID, "task %s: a reward that is not finite", task->name);
    if (status < 0) {
        d->now.is_over = true;
        return status;
    }
    d->reward[n] = reward;
    d->now.sum += reward;
    ++d->now.nstep;
    d->now.is_terminated = is_terminated;
    d->now.is_over = is_terminated || d->now.nstep >= task->max_step;
    return OM_OK;
}

const OmRlDriveNow* om_rl_drive_now(const OmRlDrive* drive) { return &drive->now; }

const OmRlTask* om__rl_drive_task(const OmRlDrive* drive) { return drive->task; }

void* om__rl_drive_state(OmRlDrive* drive) { return drive->state; }

OmStatus om_rl_drive_info(OmRlDrive* d, double* value, double* score) {
    const int at = om__rl_score_index(d->task);
    if (d->task->ops->info && d->task->ninfo > 0)
        OM_TRY(d->task->ops->info(d->task, d->state, value));
    if (score) *score = at < 0 ? d->now.sum : value[at];
    return OM_OK;
}

OmStatus om_rl_drive_render(OmRlDrive* d, OmPicture* picture) {
    OM_CHECK(d->task->ops->render, OM_UNAVAILABLE, "task %s has no picture", d->task->name);
    return d->task->ops->render(d->task, d->state, picture);
}

OmStatus om_rl_drive_keep(OmRlDrive* d, OmRlDemos* demos) {
    double info[OM_RL_MAX_INFO] = {0}, score;
    OM_CHECK(d->now.nstep > 0, OM_INVALID, "the episode has no step");
    OM_TRY(om_rl_drive_info(d, info, &score));
    const OmRlDemoEpisode episode = {d->now.nstep, d->obs, d->action, d->reward, score};
    return om__rl_demos_append(demos, d->task, &episode, 1);
}
