// point_task.h: a task without tissue for tests of drives and traces: a point in a box of 0.2 m, with a gripper. A wall
// at x = 0.05 m stops it if `has_wall`. The score is 1 if the gripper was closed at a height below 0.01 m.
#ifndef OMENTUM_POINT_TASK_H
#define OMENTUM_POINT_TASK_H

#include <math.h>
#include <string.h>

#include "omentum/rl_drive.h"

#define POINT_SIDE 0.1
#define POINT_WALL 0.05

typedef struct PointState {
    double p[3];
    int is_closed, is_solved;
} PointState;

typedef struct PointTask {
    OmRlTask head;
    bool has_wall;
} PointTask;

static inline OmStatus point_create(const OmRlTask* task, void** state) {
    (void)task;
    *state = om_calloc(1, sizeof(PointState));
    return *state ? OM_OK : OM_NO_MEMORY;
}
static inline void point_destroy(const OmRlTask* task, void* state) {
    (void)task;
    om_free(state);
}
static inline OmStatus point_reset(const OmRlTask* task, void* state, OmRng rng, int start) {
    (void)task, (void)start;
    memset(state, 0, sizeof(PointState));
    ((PointState*)state)->p[0] = om_rng_range(&rng, -0.01, 0.01);
    return OM_OK;
}
static inline OmStatus point_step(const OmRlTask* task, void* state, const int* action,
                                  double* reward, bool* is_terminated) {
    PointState* s = state;
    for (int k = 0; k < 3; ++k) {
        s->p[k] += task->move * (action[k] == 2 ? 1 : action[k] == 1 ? -1 : 0);
        s->p[k] = fmax(-POINT_SIDE, fmin(POINT_SIDE, s->p[k]));
    }
    if (((const PointTask*)task)->has_wall) s->p[0] = fmin(s->p[0], POINT_WALL);
    s->is_closed = task->has_jaw && action[3];
    if (s->is_closed && s->p[2] < 0.01) s->is_solved = 1;
    *reward = -1;
    *is_terminated = false;
    return OM_OK;
}
static inline void point_observe(const OmRlTask* task, const void* state, float* obs) {
    (void)task;
    for (int k = 0; k < 3; ++k) obs[k] = (float)((const PointState*)state)->p[k];
}
static inline OmStatus point_info(const OmRlTask* task, void* state, double* value) {
    (void)task;
    value[0] = ((PointState*)state)->is_solved;
    return OM_OK;
}
static inline size_t point_size(const OmRlTask* task) {
    (void)task;
    return sizeof(PointState);
}
static inline void point_tip(const OmRlTask* task, const void* state, double tip[3]) {
    (void)task;
    memcpy(tip, ((const PointState*)state)->p, 3 * sizeof *tip);
}
static inline OmStatus point_place(const OmRlTask* task, void* state, const double tip[3]) {
    (void)task;
    for (int k = 0; k < 3; ++k)
        OM_CHECK(fabs(tip[k]) <= POINT_SIDE, OM_INVALID, "axis %d is outside the box", k);
    memcpy(((PointState*)state)->p, tip, 3 * sizeof *tip);
    return OM_OK;
}
static inline void point_steer(const OmRlTask* task, const void* state, const double to[3],
                               bool is_closed, int* action) {
    for (int k = 0; k < 3; ++k) {
        double way = to[k] - ((const PointState*)state)->p[k];
        action[k] = way > 0.5 * task->move ? 2 : way < -0.5 * task->move ? 1 : 0;
    }
    if (task->has_jaw) action[3] = is_closed;
}

static inline PointTask point_task(double move, int max_step, bool has_jaw) {
    static const OmRlTaskOps ops = {.state_create = point_create,
                                    .state_destroy = point_destroy,
                                    .reset = point_reset,
                                    .step = point_step,
                                    .observe = point_observe,
                                    .info = point_info,
                                    .state_size = point_size,
                                    .tip = point_tip,
                                    .place = point_place,
                                    .steer = point_steer};
    PointTask t = {.head = {.ops = &ops,
                            .name = "point",
                            .nobservation = 3,
                            .obs_lo = (float)(-2 * POINT_SIDE),
                            .obs_hi = (float)(2 * POINT_SIDE),
                            .naction = has_jaw ? 4 : 3,
                            .nchoice = {3, 3, 3, has_jaw ? 2 : 0},
                            .max_step = max_step,
                            .ninfo = 1,
                            .info_name = {"solved"},
                            .score_name = "solved",
                            .target = 1,
                            .period = 0.02,
                            .move = move,
                            .has_jaw = has_jaw}};
    return t;
}

#endif
