// rl_cart_pole.c: a pole on a cart, pushed left or right.
//
// Barto, Sutton and Anderson 1983 with the numbers of Gymnasium's CartPole-v1: explicit Euler steps of 0.02 s, 10 N, a
// pole of half length 0.5 m and 0.1 kg on a cart of 1 kg. An episode ends at 12 degrees or 2.4 m, and is
// truncated at 500 steps. Reward 1 a step.
#include <math.h>

#include "rl/rl_internal.h"
#include "rl/rl_sketch.h"

#define GRAVITY 9.8
#define CART 1.0
#define POLE 0.1
#define HALF_LENGTH 0.5
#define FORCE 10.0
#define STEP 0.02
#define MAX_ANGLE (12 * 2 * 3.14159265358979323846 / 360)
#define MAX_POSITION 2.4
#define START 0.05

typedef struct State {
    double x, v, angle, rate;  // m, m/s, rad, rad/s
} State;

static OmStatus reset(const OmRlTask* task, void* state, OmRng rng, int start) {
    (void)task, (void)start;
    State* s = state;
    s->x = om_rng_range(&rng, -START, START);
    s->v = om_rng_range(&rng, -START, START);
    s->angle = om_rng_range(&rng, -START, START);
    s->rate = om_rng_range(&rng, -START, START);
    return OM_OK;
}

static OmStatus step(const OmRlTask* task, void* state, const int* action, double* reward,
                     bool* is_terminated) {
    (void)task;
    State* s = state;
    double c = cos(s->angle), n = sin(s->angle);
    double force = action[0] ? FORCE : -FORCE;
    double mass = CART + POLE;
    double push = (force + POLE * HALF_LENGTH * s->rate * s->rate * n) / mass;
    // the denominator is above HALF_LENGTH: c c POLE / mass is below 0.1
    double turn = (GRAVITY * n - c * push) / (HALF_LENGTH * (4.0 / 3.0 - POLE * c * c / mass));
    double speed_up = push - POLE * HALF_LENGTH * turn * c / mass;
    s->x += STEP * s->v;
    s->v += STEP * speed_up;
    s->angle += STEP * s->rate;
    s->rate += STEP * turn;
    *reward = 1;
    *is_terminated = fabs(s->x) > MAX_POSITION || fabs(s->angle) > MAX_ANGLE;
    return OM_OK;
}

static void observe(const OmRlTask* task, const void* state, float* obs) {
    (void)task;
    const State* s = state;
    obs[0] = (float)s->x;
    obs[1] = (float)s->v;
    obs[2] = (float)s->angle;
    obs[3] = (float)s->rate;
}

// A linear feedback, which balances for 500 steps; a tenth of the pushes is random.
static void expert(const OmRlTask* task, const void* state, OmRng* rng, int* action) {
    (void)task;
    const State* s = state;
    double lean = s->angle + 0.3 * s->rate + 0.05 * s->x + 0.1 * s->v;
    action[0] = lean > 0;
    if (om_rng_uniform(rng) < 0.1) action[0] = (int)om_rng_below(rng, 2);
}

// From the side: x to the right, the track of 2 x 2.4 m in the whole width.
static OmStatus render(const OmRlTask* task, void* state, OmPicture* picture) {
    (void)task;
    const State* s = state;
    OmRlSketch p;
    OM_TRY(om__rl_sketch_begin(om_vec3(0, -12, 1.2), om_vec3(0, 0, 0.5), 26, &p));
    OmPose cart = {om_vec3(s->x, 0, 0), om_quat_identity()};
    OmPose pole = {cart.p, om_quat_axis_angle(om_vec3(0, 1, 0), s->angle)};
    om__rl_sketch_box(&p, cart, om_vec3(-0.25, -0.15, -0.1), om_vec3(0.25, 0.15, 0.1),
                      OM_PART_TISSUE);
    om__rl_sketch_box(&p, pole, om_vec3(-0.04, -0.2, 0), om_vec3(0.04, -0.15, 2 * HALF_LENGTH),
                      OM_PART_ROI);
    om__rl_sketch_box(&p, om_pose_identity(), om_vec3(-MAX_POSITION, -0.3, -0.16),
                      om_vec3(MAX_POSITION, 0.3, -0.12), OM_PART_BOARD);
    return om__rl_sketch_end(&p, picture);
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
                                .render = render,
                                .expert = expert,
                                .state_size = state_size};

static const OmRlKey keys[] = {{OM_RL_KEY_LEFT, 0, 0, "push to the left"},
                               {'a', 0, 0, "push to the left"},
                               {'j', 0, 0, "push to the left"},
                               {OM_RL_KEY_RIGHT, 0, 1, "push to the right"},
                               {'d', 0, 1, "push to the right"},
                               {'l', 0, 1, "push to the right"}};

OmStatus om__rl_cart_pole_create(const OmRlSetting* setting, int nsetting, OmRlTask** task) {
    static const char* const known[] = {NULL};
    *task = NULL;
    if (nsetting > 0) return om__rl_setting_unknown("cart-pole", setting, known);
    OmRlTask* t = om_calloc(1, sizeof *t);
    if (!t) return OM_NO_MEMORY;
    *t = (OmRlTask){.ops = &ops,
                    .name = "cart-pole",
                    .nobservation = 4,
                    .obs_lo = -20,  // an episode ends below 10 m/s and 5 rad/s
                    .obs_hi = 20,
                    .naction = 1,
                    .nchoice = {2},
                    .max_step = 500,
                    .target = 475,
                    .key = keys,
                    .nkey = sizeof keys / sizeof *keys,
                    .rest = {-1},
                    .period = STEP};
    t->hash = om_hash(t->name, sizeof t->name, OM_HASH_SEED);
    *task = t;
    return OM_OK;
}
