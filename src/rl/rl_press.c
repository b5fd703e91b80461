// rl_press.c: the task "press": find a stiff lesion in a block of tissue by pressing on it (thesis, chapter 3).
//
// A block of 120 x 120 x 30 mm, 3 kPa, lies on a board. Elements within 11 mm of a point 10 mm below the middle of its
// top have 60 kPa. The robot sees a window of 50 x 50 mm of the top; the window is drawn in each episode, so that the
// lesion is anywhere in its middle 40 x 40 mm. One model serves all episodes. XPBD gives forces in newtons; no gravity
// (assumption 6 of 3.3.2), so that the rest shape is the state at rest.
#include <math.h>
#include <string.h>

#include "omentum/contact_tool.h"
#include "omentum/pbd.h"
#include "omentum/tissue.h"
#include "rl/rl_internal.h"
#include "rl/rl_sketch.h"

#define HALF 0.060      // m, of the block
#define HEIGHT 0.030    // m
#define DEPTH 0.010     // m, of the lesion's centre
#define LESION 0.011    // m, its radius
#define BALL 0.008      // m, radius of the probe
#define WINDOW 0.025    // m, half side of the window
#define OFFSET 0.020    // m, of the lesion from the middle of the window, at most
#define UP 0.003        // m, of the ball's lowest point above the top, at most
#define DOWN 0.005      // m, below it
#define MOVE 0.001      // m, of a step along an axis
#define FELT 0.004      // m, a place counts as felt from this depth
#define TIME_STEP 0.02  // s
#define SIDE 5          // places along a side of the window
#define NPLACE (SIDE * SIDE)
#define FORCE 0.5        // N, unit of forces in the observation
#define FOUND 0.005      // m
#define REST_SPEED 1e-3  // m/s, of tissue that rests again
#define COST 0.0005      // of a step

typedef struct OmRlPress {
    OmRlTask head;
    OmTissueModel* tissue;
    OmTissueState* rest;
    OmProbe* ball;
} OmRlPress;

typedef struct Episode {  // plain data of a state
    OmVec3 p;             // lowest point of the ball from the middle of the window's top, m
    double lesion[2];     // from the middle of the window, m
    double felt[NPLACE];  // N, largest force at each place; 0: not yet pressed
    double force;         // N, on the ball in the last step
    int is_moving;        // the tissue is not at rest
    int is_over;
} Episode;

typedef struct State {
    Episode now;
    OmTissueState* tissue;
    OmTissueWork* work;
} State;

static const OmRlPress* press_of(const OmRlTask* task) { return (const OmRlPress*)task; }

// Centre of place k from the middle of the window.
static double place_at(int k) { return 2 * WINDOW * ((k + 0.5) / SIDE - 0.5); }

static int place_of(double x) {
    int k = (int)((x + WINDOW) / (2 * WINDOW) * SIDE);
    return k < 0 ? 0 : k >= SIDE ? SIDE - 1 : k;
}

// ---- steps ------------------------------------------------------------------------------------------

static OmPose ball_pose(const Episode* now) {
    OmVec3 p =
        om_vec3(now->p.x - now->lesion[0], now->p.y - now->lesion[1], HEIGHT + now->p.z + BALL);
    return (OmPose){p, om_quat_identity()};
}

static void move_ball(Episode* now, const int* action) {
    double* axis[3] = {&now->p.x, &now->p.y, &now->p.z};
    for (int k = 0; k < 3; ++k) *axis[k] += MOVE * (action[k] == 2 ? 1 : action[k] == 1 ? -1 : 0);
    now->p.x = fmin(WINDOW, fmax(-WINDOW, now->p.x));
    now->p.y = fmin(WINDOW, fmax(-WINDOW, now->p.y));
    now->p.z = fmin(UP, fmax(-DOWN, now->p.z));
}

static bool is_slow(const OmRlPress* t, const OmTissueState* tissue) {
    const double* v = om_tissue_v(tissue);
    for (int i = 0; i < om_tissue_mesh(t->tissue)->nvert; ++i)
        if (!(om_norm2(om_load3(v, i)) < REST_SPEED * REST_SPEED)) return false;
    return true;
}

static OmStatus step_tissue(const OmRlPress* t, State* s, OmPose begin) {
    Episode* now = &s->now;
    bool is_near = now->p.z <= 0;
    now->force = 0;
    if (!is_near && !now->is_moving) return OM_OK;
    OmTissueObstacle ball = om_probe_obstacle(t->ball, begin, ball_pose(now), 0);
    OmStatus status =
        om_tissue_step_among(t->tissue, s->tissue, s->work, TIME_STEP, 1, &ball, NULL);
    if (status < 0) return status;
    now->force = fmax(0, -ball.force.z);
    now->is_moving = is_near || !is_slow(t, s->tissue);
    if (!now->is_moving) memcpy(s->tissue, t->rest, om_tissue_state_size(t->tissue));
    return OM_OK;
}

static double distance_to_lesion(const Episode* now) {
    return hypot(now->p.x - now->lesion[0], now->p.y - now->lesion[1]);
}

static OmStatus step(const OmRlTask* task, void* state, const int* action, double* reward,
                     bool* is_terminated) {
    const OmRlPress* t = press_of(task);
    State* s = state;
    Episode* now = &s->now;
    OmPose begin = ball_pose(now);
    move_ball(now, action);
    OM_TRY(step_tissue(t, s, begin));
    double* felt = &now->felt[place_of(now->p.y) * SIDE + place_of(now->p.x)];
    if (now->p.z <= -FELT) *felt = fmax(*felt, now->force);
    *reward = -COST;
    *is_terminated = action[3] == 1;
    now->is_over = *is_terminated;
    if (*is_terminated) *reward += fmax(-1, 1 - distance_to_lesion(now) / (2 * FOUND));
    return OM_OK;
}

// ---- the table --------------------------------------------------------------------------------------

static void destroy(OmRlTask* task) {
    OmRlPress* t = (OmRlPress*)task;
    om_tissue_state_destroy(t->rest);
    om_tissue_destroy(t->tissue);
    om_probe_destroy(t->ball);
    om_free(t);
}

static void state_destroy(const OmRlTask* task, void* state) {
    (void)task;
    State* s = state;
    if (!s) return;
    om_tissue_work_destroy(s->work);
    om_tissue_state_destroy(s->tissue);
    om_free(s);
}

static OmStatus state_create(const OmRlTask* task, void** state) {
    const OmRlPress* t = press_of(task);
    *state = NULL;
    State* s = om_calloc(1, sizeof *s);
    if (!s) return OM_NO_MEMORY;
    OmStatus status = om_tissue_state_create(t->tissue, &s->tissue);
    if (status >= 0) status = om_tissue_work_create(t->tissue, &s->work);
    if (status < 0)
        state_destroy(task, s);
    else
        *state = s;
    return status;
}

static OmStatus reset(const OmRlTask* task, void* state, OmRng rng, int start) {
    const OmRlPress* t = press_of(task);
    State* s = state;
    memset(&s->now, 0, sizeof s->now);
    memcpy(s->tissue, t->rest, om_tissue_state_size(t->tissue));
    for (int k = 0; k < 2; ++k) {
        s->now.lesion[k] = om_rng_range(&rng, -OFFSET, OFFSET);
        int at = k == 0 ? start % SIDE : start / SIDE;
        if (start >= 0) s->now.lesion[k] = OFFSET * (2.0 * at / (SIDE - 1) - 1);
    }
    s->now.p = om_vec3(0, 0, UP);
    return OM_OK;
}

static void observe(const OmRlTask* task, const void* state, float* obs) {
    (void)task;
    const Episode* now = &((const State*)state)->now;
    *obs++ = (float)(now->p.x / WINDOW);
    *obs++ = (float)(now->p.y / WINDOW);
    *obs++ = (float)(now->p.z / DOWN);
    *obs++ = (float)(now->force / FORCE);
    for (int k = 0; k < NPLACE; ++k) *obs++ = (float)(now->felt[k] / FORCE);
}

static OmStatus info(const OmRlTask* task, void* state, double* value) {
    (void)task;
    const Episode* now = &((const State*)state)->now;
    value[1] = distance_to_lesion(now);
    value[0] = now->is_over && value[1] <= FOUND;
    return OM_OK;
}

// The window from -x and above: the block, of which the lesion cannot be seen, and the ball on its arm.
static OmStatus render(const OmRlTask* task, void* state, OmPicture* picture) {
    const OmRlPress* t = press_of(task);
    const State* s = state;
    OmVec3 top = om_vec3(-s->now.lesion[0], -s->now.lesion[1], HEIGHT), ball = ball_pose(&s->now).p;
    OmRlSketch p;
    OM_TRY(om__rl_sketch_begin(om_add(top, om_vec3(-0.11, 0, 0.09)), top, 34, &p));
    om__rl_sketch_mesh(&p, om_tissue_mesh(t->tissue), om_tissue_x(s->tissue), OM_PART_TISSUE);
    for (int k = 0; k < 4; ++k) {  // the corners of the window
        OmVec3 corner = om_vec3(k & 1 ? WINDOW : -WINDOW, k & 2 ? WINDOW : -WINDOW, 0);
        om__rl_sketch_ball(&p, om_add(top, corner), 0.001, OM_PART_HELD);
    }
    om__rl_sketch_ball(&p, ball, BALL, OM_PART_TOOL);
    om__rl_sketch_rod(&p, ball, ball.z + 0.06, 0.002, OM_PART_SHAFT);
    return om__rl_sketch_end(&p, picture);
}

// ---- the expert -------------------------------------------------------------------------------------

// The next place in rows to and fro that was not pressed; -1: none.
static int next_place(const Episode* now) {
    for (int j = 0; j < SIDE; ++j)
        for (int i = 0; i < SIDE; ++i) {
            int k = j * SIDE + (j % 2 == 0 ? i : SIDE - 1 - i);
            if (!(now->felt[k] > 0)) return k;
        }
    return -1;
}

// Where the lesion is felt: places weighed by the square of their force above the median.
static OmVec3 guess(const Episode* now) {
    double sorted[NPLACE], sum = 0, x = 0, y = 0;
    memcpy(sorted, now->felt, sizeof sorted);
    om_sort_doubles(sorted, NPLACE);
    for (int k = 0; k < NPLACE; ++k) {
        double w = fmax(0, now->felt[k] - om_quantile(sorted, NPLACE, 0.7));
        w *= w;
        sum += w, x += w * place_at(k % SIDE), y += w * place_at(k / SIDE);
    }
    return sum > 0 ? om_vec3(x / sum, y / sum, 0) : om_vec3(0, 0, 0);
}

static int choice_towards(double way) { return way > 0.5 * MOVE ? 2 : way < -0.5 * MOVE ? 1 : 0; }

// Press every place once, then go where the lesion is felt and say so. A hand slips in a tenth of its motions.
static void expert(const OmRlTask* task, const void* state, OmRng* rng, int* action) {
    (void)task;
    const Episode* now = &((const State*)state)->now;
    int k = next_place(now);
    OmVec3 to = k < 0 ? guess(now) : om_vec3(place_at(k % SIDE), place_at(k / SIDE), 0);
    double x = to.x - now->p.x, y = to.y - now->p.y;
    bool is_above = fabs(x) <= 0.5 * MOVE && fabs(y) <= 0.5 * MOVE, is_free = now->p.z > MOVE;
    action[0] = is_free ? choice_towards(x) : 0;
    action[1] = is_free ? choice_towards(y) : 0;
    action[2] = is_above && k >= 0 ? 1 : is_free ? 0 : 2;
    action[3] = is_above && k < 0;
    if (action[3] == 0 && om_rng_uniform(rng) < 0.1)
        action[om_rng_below(rng, 2)] = is_free ? (int)om_rng_below(rng, 3) : 0;
}

// ---- snapshots, creation ----------------------------------------------------------------------------

static size_t state_size(const OmRlTask* task) {
    return sizeof(Episode) + om_tissue_state_size(press_of(task)->tissue);
}

static void save(const OmRlTask* task, const void* state, void* block) {
    const State* s = state;
    memcpy(block, &s->now, sizeof s->now);
    memcpy((char*)block + sizeof s->now, s->tissue, om_tissue_state_size(press_of(task)->tissue));
}

static void restore(const OmRlTask* task, void* state, const void* block) {
    State* s = state;
    memcpy(&s->now, block, sizeof s->now);
    memcpy(s->tissue, (const char*)block + sizeof s->now,
           om_tissue_state_size(press_of(task)->tissue));
}

static const OmRlTaskOps ops = {.destroy = destroy,
                                .state_create = state_create,
                                .state_destroy = state_destroy,
                                .reset = reset,
                                .step = step,
                                .observe = observe,
                                .info = info,
                                .render = render,
                                .expert = expert,
                                .state_size = state_size,
                                .save = save,
                                .restore = restore};

// The underside is fixed; label 1 is the lesion.
static OmStatus make_mesh(OmTetMesh* mesh) {
    OM_TRY(om_tet_mesh_box(om_vec3(-HALF, -HALF, 0), om_vec3(HALF, HALF, HEIGHT), 16, 16, 4, mesh));
    for (int k = 0; k < mesh->ntet; ++k) {
        OmVec3 middle = {0, 0, 0};
        for (int c = 0; c < 4; ++c)
            middle =
                om_madd(middle, 0.25, om_load3(mesh->x, mesh->tet_vert[4 * (size_t)k + (size_t)c]));
        mesh->tet_label[k] = om_distance(middle, om_vec3(0, 0, HEIGHT - DEPTH)) < LESION;
    }
    int n = 0, *fixed = om_alloc((size_t)mesh->nvert, sizeof *fixed);
    if (!fixed) return OM_NO_MEMORY;
    for (int i = 0; i < mesh->nvert; ++i)
        if (mesh->x[3 * (size_t)i + 2] < 1e-9) fixed[n++] = i;
    OmStatus status = om_tet_mesh_add_set(mesh, "attachment", fixed, n);
    om_free(fixed);
    return status;
}

static OmStatus fill(OmRlPress* t) {
    OmTetMesh mesh = {0};
    OmStatus status = make_mesh(&mesh);
    if (status >= 0) {
        const OmMaterial material[2] = {{.young = 3000, .poisson = 0.45},
                                        {.young = 60000, .poisson = 0.45}};
        OmPbdDef pbd = om_pbd_default_def(OM_PBD_ELASTIC);
        pbd.collision_distance = 0;
        OmTissueDef def = om_tissue_default_def(om_xpbd_engine(), &mesh);
        def.options = &pbd;
        def.nmaterial = 2;
        def.material = material;
        def.gravity = om_vec3(0, 0, 0);
        def.solver.nworker = 1;
        status = om_tissue_create(&def, &t->tissue);
    }
    om_tet_mesh_done(&mesh);
    if (status < 0) return status;
    OmProbeDef ball = om_probe_default_def(OM_PROBE_SPHERE);
    ball.radius = BALL;
    OM_TRY(om_probe_create(&ball, &t->ball));
    return om_tissue_state_create(t->tissue, &t->rest);
}

static const OmRlKey keys[] = {OM__RL_RIGHT_HAND("", 0, 1, 2),
                               OM__RL_LEFT_HAND("", 0, 1, 2),
                               {'x', 3, 1, "the lesion is here; ends the episode"}};

OmStatus om__rl_press_create(const OmRlSetting* setting, int nsetting, OmRlTask** task) {
    static const char* const known[] = {"max_step", NULL};
    double max_step = 1000;
    *task = NULL;
    for (int k = 0; k < nsetting; ++k) {
        if (strcmp(setting[k].key, known[0]) != 0)
            return om__rl_setting_unknown("press", &setting[k], known);
        OM_TRY(om__rl_setting_number("press", &setting[k], 1, 1e9, &max_step));
    }
    OmRlPress* t = om_calloc(1, sizeof *t);
    if (!t) return OM_NO_MEMORY;
    t->head = (OmRlTask){.ops = &ops,
                         .name = "press",
                         .nobservation = 4 + NPLACE,
                         .obs_lo = -2,  // of positions
                         .obs_hi = 20,  // 10 N
                         .naction = 4,
                         .nchoice = {3, 3, 3, 2},
                         .max_step = (int)max_step,
                         .nstart = NPLACE,
                         .ninfo = 2,
                         .info_name = {"found", "distance"},
                         .score_name = "found",
                         .target = 0.9,
                         .key = keys,
                         .nkey = sizeof keys / sizeof *keys,
                         .period = TIME_STEP};
    OmStatus status = fill(t);
    if (status < 0) {
        destroy(&t->head);
        return status;
    }
    t->head.hash = om_hash(om_tissue_mesh(t->tissue)->x, 1000, (uint64_t)max_step);
    *task = &t->head;
    return OM_OK;
}
