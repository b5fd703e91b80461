// rl_reach.c: move a tip to a goal in a box.
//
// The motion of the robot in task "retract" without tissue: each axis moves by -1, 0 or +1 step (5.3 of the thesis),
// positions are in units of the box. Reward: minus the distance to the goal, as a share of the diagonal. The episode
// ends when the tip is within a step and a half of the goal; with fixed_horizon=1 it lasts until the limit of steps.
#include <math.h>
#include <string.h>

#include "omentum/vec.h"
#include "rl/rl_internal.h"
#include "rl/rl_sketch.h"

typedef struct Reach {
    OmRlTask head;
    double step;             // as a share of the box
    bool has_fixed_horizon;  // the goal does not end an episode
} Reach;

typedef struct State {
    OmVec3 p, goal;  // in the box [0, 1]^3
} State;

enum { NSIDE = 3 };  // starts of the evaluation along each axis, goal in the centre

static OmVec3 draw(OmRng* rng) {
    OmVec3 p;
    p.x = om_rng_uniform(rng);
    p.y = om_rng_uniform(rng);
    p.z = om_rng_uniform(rng);
    return p;
}

static OmStatus reset(const OmRlTask* task, void* state, OmRng rng, int start) {
    (void)task;
    State* s = state;
    s->goal = draw(&rng);
    s->p = draw(&rng);
    if (start >= 0) {
        s->goal = (OmVec3){0.5, 0.5, 0.5};
        s->p = (OmVec3){start % NSIDE / 2.0, start / NSIDE % NSIDE / 2.0,
                        start / (NSIDE * NSIDE) / 2.0};
    }
    return OM_OK;
}

static double move(double x, double step, int action) {
    return fmin(fmax(x + (action - 1) * step, 0), 1);
}

static OmStatus step(const OmRlTask* task, void* state, const int* action, double* reward,
                     bool* is_terminated) {
    const Reach* r = (const Reach*)task;
    State* s = state;
    s->p.x = move(s->p.x, r->step, action[0]);
    s->p.y = move(s->p.y, r->step, action[1]);
    s->p.z = move(s->p.z, r->step, action[2]);
    double distance = om_distance(s->p, s->goal);
    *reward = -distance / sqrt(3.0);
    *is_terminated = distance < 1.5 * r->step && !r->has_fixed_horizon;
    return OM_OK;
}

static void observe(const OmRlTask* task, const void* state, float* obs) {
    (void)task;
    const State* s = state;
    const double value[7] = {
        s->p.x, s->p.y, s->p.z, s->goal.x, s->goal.y, s->goal.z, om_distance(s->p, s->goal)};
    for (int i = 0; i < 7; ++i) obs[i] = (float)value[i];
}

static OmStatus info(const OmRlTask* task, void* state, double* value) {
    const Reach* r = (const Reach*)task;
    const State* s = state;
    value[0] = om_distance(s->p, s->goal) < 1.5 * r->step;
    return OM_OK;
}

// The box as one of 1 m, seen from -x; rods stand below tip and goal.
static OmStatus render(const OmRlTask* task, void* state, OmPicture* picture) {
    (void)task;
    const State* s = state;
    OmRlSketch p;
    OM_TRY(om__rl_sketch_begin(om_vec3(-1.6, 0.5, 1.7), om_vec3(0.5, 0.5, 0.4), 40, &p));
    om__rl_sketch_box(&p, om_pose_identity(), om_vec3(0, 0, -0.06), om_vec3(1, 1, -0.04),
                      OM_PART_BOARD);
    om__rl_sketch_ball(&p, s->p, 0.03, OM_PART_TOOL);
    om__rl_sketch_rod(&p, s->p, -0.04, 0.006, OM_PART_TOOL);
    om__rl_sketch_ball(&p, s->goal, 0.03, OM_PART_ROI);
    om__rl_sketch_rod(&p, s->goal, -0.04, 0.006, OM_PART_ROI);
    return om__rl_sketch_end(&p, picture);
}

// Straight along each axis; a fifth of the components is random.
static void expert(const OmRlTask* task, const void* state, OmRng* rng, int* action) {
    const Reach* r = (const Reach*)task;
    const State* s = state;
    const double d[3] = {s->goal.x - s->p.x, s->goal.y - s->p.y, s->goal.z - s->p.z};
    om__rl_straight(d, r->step, rng, action);
}

static size_t state_size(const OmRlTask* task) {
    (void)task;
    return sizeof(State);
}

static const OmRlTaskOps ops = {.destroy = om__rl_plain_destroy,
                                .state_create = om__rl_plain_state_create,
                                .state_destroy = om__rl_plain_state_destroy,
                                .reset = reset,
                                .step = step,
                                .observe = observe,
                                .info = info,
                                .render = render,
                                .expert = expert,
                                .state_size = state_size};

static const OmRlKey keys[] = {OM__RL_RIGHT_HAND("", 0, 0, 2), OM__RL_LEFT_HAND("", 0, 0, 2)};

OmStatus om__rl_reach_create(const OmRlSetting* setting, int nsetting, OmRlTask** task) {
    static const char* const known[] = {"step", "fixed_horizon", NULL};
    double size = 0.05, fixed_horizon = 0;
    *task = NULL;
    for (int i = 0; i < nsetting; ++i) {
        if (strcmp(setting[i].key, "step") == 0) {
            OM_TRY(om__rl_setting_number("reach", &setting[i], 1e-3, 0.2, &size));
        } else if (strcmp(setting[i].key, "fixed_horizon") == 0) {
            OM_TRY(om__rl_setting_number("reach", &setting[i], 0, 1, &fixed_horizon));
            OM_CHECK(fixed_horizon == 0 || fixed_horizon == 1, OM_INVALID,
                     "task reach: fixed_horizon is \"%s\", must be 0 or 1", setting[i].value);
        } else {
            return om__rl_setting_unknown("reach", &setting[i], known);
        }
    }
    Reach* r = om_calloc(1, sizeof *r);
    if (!r) return OM_NO_MEMORY;
    r->head = (OmRlTask){.ops = &ops,
                         .name = "reach",
                         .nobservation = 7,
                         .obs_hi = 1.75f,  // above the diagonal of the box
                         .naction = 3,
                         .nchoice = {3, 3, 3},
                         .max_step = (int)ceil(4 / size),
                         .nstart = NSIDE * NSIDE * NSIDE,
                         .ninfo = 1,
                         .info_name = {"reached"},
                         .score_name = "reached",
                         .target = 0.99,
                         .key = keys,
                         .nkey = sizeof keys / sizeof *keys,
                         .rest = {1, 1, 1},
                         .period = 0.05};
    r->step = size;
    r->has_fixed_horizon = fixed_horizon == 1;
    snprintf(r->head.meaning, sizeof r->head.meaning, "step=%.9g", size);
    r->head.hash = om_hash(r->head.name, sizeof r->head.name, OM_HASH_SEED);
    r->head.hash = om_hash(&size, sizeof size, r->head.hash);
    r->head.hash = om_hash(&fixed_horizon, sizeof fixed_horizon, r->head.hash);
    *task = &r->head;
    return OM_OK;
}
