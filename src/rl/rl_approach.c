// rl_approach.c: the motions of the acting module of chapter 6: a tip comes down on tissue, or pulls (6.3, 6.4.4).
//
// Positions are shares of a box, and each axis moves by -1, 0 or +1 step. In half of the episodes the goal is a place
// on tissue: below a cone around it, which rises by its distance in the plane up to HIGH, a free tip would touch the
// tissue that it is to grasp, and each step there costs. In the other half the tip holds tissue, and the way is free.
// Reward: minus the distance to the goal as a share of the diagonal, minus COST for each step of depth below the cone.
// The episode ends when the tip is within a step and a half of the goal.
#include <math.h>
#include <string.h>

#include "omentum/vec.h"
#include "rl/rl_internal.h"

#define HIGH 0.125    // share of the box above the goal, at which a tip travels freely
#define GOAL_LO 0.15  // of the goal's height where it is on tissue
#define GOAL_HI 0.60  //
#define COST 0.3
#define NEAR 0.2  // share of the box: ways beyond it are observed as 1

typedef struct Approach {
    OmRlTask head;
    double step;  // share of the box
} Approach;

typedef struct State {
    OmVec3 p, goal;     // in the box [0, 1]^3
    double deepest;     // below the cone in this episode
    int64_t is_tissue;  // the goal is on tissue
} State;

enum { NSIDE = 3 };  // starts of the evaluation along each axis

// Lowest place of the tip here.
static double cone(const State* s, double x, double y) {
    if (!s->is_tissue) return 0;
    return s->goal.z + fmin(HIGH, hypot(x - s->goal.x, y - s->goal.y));
}

static OmStatus reset(const OmRlTask* task, void* state, OmRng rng, int start) {
    (void)task;
    State* s = state;
    *s = (State){0};
    double u[7];
    for (int k = 0; k < 7; ++k) u[k] = om_rng_uniform(&rng);
    s->is_tissue = start >= 0 || u[6] < 0.5;
    s->goal = om_vec3(u[0], u[1], s->is_tissue ? GOAL_LO + (GOAL_HI - GOAL_LO) * u[2] : u[2]);
    if (start >= 0) {
        s->goal = om_vec3(0.5, 0.5, 0.3);
        for (int k = 0, n = start; k < 3; ++k, n /= NSIDE) u[3 + k] = n % NSIDE / (NSIDE - 1.0);
    }
    double low = cone(s, u[3], u[4]);
    s->p = om_vec3(u[3], u[4], low + (1 - low) * u[5]);
    return OM_OK;
}

static double move(double x, double step, int action) {
    return fmin(fmax(x + (action - 1) * step, 0), 1);
}

static OmStatus step(const OmRlTask* task, void* state, const int* action, double* reward,
                     bool* is_terminated) {
    const Approach* a = (const Approach*)task;
    State* s = state;
    s->p.x = move(s->p.x, a->step, action[0]);
    s->p.y = move(s->p.y, a->step, action[1]);
    s->p.z = move(s->p.z, a->step, action[2]);
    double distance = om_distance(s->p, s->goal);
    double depth = fmax(0, cone(s, s->p.x, s->p.y) - s->p.z);
    s->deepest = fmax(s->deepest, depth);
    *reward = -distance / sqrt(3.0) - COST * fmin(depth / a->step, 3);
    *is_terminated = distance < 1.5 * a->step;
    return OM_OK;
}

void om_rl_approach_observe(const double* p, const double* goal, bool is_tissue, float* obs) {
    double square = 0;
    for (int k = 0; k < 3; ++k) {
        double way = goal[k] - p[k];
        square += way * way;
        obs[k] = (float)p[k];
        obs[3 + k] = (float)fmin(fmax(way / NEAR, -1), 1);
    }
    obs[6] = (float)sqrt(square);
    obs[7] = is_tissue ? 1 : 0;
}

static void observe(const OmRlTask* task, const void* state, float* obs) {
    (void)task;
    const State* s = state;
    const double p[3] = {s->p.x, s->p.y, s->p.z}, goal[3] = {s->goal.x, s->goal.y, s->goal.z};
    om_rl_approach_observe(p, goal, s->is_tissue, obs);
}

static OmStatus info(const OmRlTask* task, void* state, double* value) {
    const Approach* a = (const Approach*)task;
    const State* s = state;
    bool is_there = om_distance(s->p, s->goal) < 1.5 * a->step;
    value[1] = s->deepest;
    value[0] = is_there && s->deepest <= 1.5 * a->step;
    return OM_OK;
}

// Straight along each axis, but not below the cone; a fifth of the components is random.
static void expert(const OmRlTask* task, const void* state, OmRng* rng, int* action) {
    const Approach* a = (const Approach*)task;
    const State* s = state;
    double d[3] = {s->goal.x - s->p.x, s->goal.y - s->p.y, s->goal.z - s->p.z};
    double gap = s->p.z - cone(s, s->p.x, s->p.y);
    if (s->is_tissue && gap < a->step && hypot(d[0], d[1]) > a->step) d[2] = gap < 0 ? 1 : 0;
    om__rl_straight(d, a->step, rng, action);
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
                                .expert = expert,
                                .state_size = state_size};

static const OmRlKey keys[] = {OM__RL_RIGHT_HAND("", 0, 0, 2), OM__RL_LEFT_HAND("", 0, 0, 2)};

OmStatus om__rl_approach_create(const OmRlSetting* setting, int nsetting, OmRlTask** task) {
    static const char* const known[] = {"step", NULL};
    double size = 0.02;
    *task = NULL;
    for (int i = 0; i < nsetting; ++i) {
        if (strcmp(setting[i].key, known[0]) != 0)
            return om__rl_setting_unknown("approach", &setting[i], known);
        OM_TRY(om__rl_setting_number("approach", &setting[i], 1e-3, 0.1, &size));
    }
    Approach* a = om_calloc(1, sizeof *a);
    if (!a) return OM_NO_MEMORY;
    a->head = (OmRlTask){.ops = &ops,
                         .name = "approach",
                         .nobservation = OM_RL_NAPPROACH,
                         .obs_lo = -1,
                         .obs_hi = 1.75f,  // above the diagonal of the box
                         .naction = 3,
                         .nchoice = {3, 3, 3},
                         .max_step = (int)ceil(4 / size),
                         .nstart = NSIDE * NSIDE * NSIDE,
                         .ninfo = 2,
                         .info_name = {"reached", "deepest"},
                         .score_name = "reached",
                         .target = 0.99,
                         .key = keys,
                         .nkey = sizeof keys / sizeof *keys,
                         .rest = {1, 1, 1}};
    a->step = size;
    snprintf(a->head.meaning, sizeof a->head.meaning, "step=%.9g", size);
    a->head.hash = om_hash(a->head.name, sizeof a->head.name, OM_HASH_SEED);
    a->head.hash = om_hash(&size, sizeof size, a->head.hash);
    *task = &a->head;
    return OM_OK;
}
