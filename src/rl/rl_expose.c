// rl_expose.c: the task "expose": two arms lift the sheet of fat of task "retract" together.
//
// The scene is that of "retract" (its constant part is used, not repeated), with the soft clusters of the thesis by
// default: one arm exposes 0.7 of the tumour at most (`omentum rl survey -t retract -s tissue=thesis`), since the sheet
// sags on both sides of it. PSM1 stands on the side of -y, PSM2 mirrors it. Each arm has its own target beside p_T.
#include <math.h>
#include <string.h>

#include "rl/rl_internal.h"
#include "rl/rl_retract_internal.h"

#define NARM 2
#define APART 0.022        // m, of places and targets from the middle
#define HOLD 10            // steps that both tips stay at their targets until an episode ends
#define AT_TARGET 0.002    // m
#define CLEAR 0.001        // m, between a tip and the kidney or the table
#define TIPS_APART 0.008   // m, that the tips keep from each other
#define SHAPE_LENGTH 0.1   // m, unit of distances in the reward
#define SHAPE_PLACE 0.03   // m, from the grasping place, where the quality of a place is 0
#define SHAPE_STEP 0.002   // cost of a step
#define SHAPE_END 2.0      // of the exposure at the end
#define EXPERT_HIGH 0.008  // m, above the fat on the expert's way
#define EXPERT_NEAR 0.004  // m, from the place in the plane, where the expert goes down
#define EXPERT_SLIP 0.12   // share of random components of the expert's actions
#define NOBS (3 + 9 * NARM)

typedef struct OmRlExpose {
    OmRlTask head;
    OmRlTask* retract;  // owns the scene
    OmPsm psm[NARM];
    OmQuat tip_q[NARM];
    OmVec3 goal[NARM], target[NARM];
} OmRlExpose;

typedef struct Arm {
    OmVec3 tip;
    double q[OM_PSM_NJOINT];
    double along, across;  // place of the grasp in the flat sheet, m
    int is_holding;
} Arm;

typedef struct Episode {  // plain data of a state
    OmRng rng;
    Arm arm[NARM];
    double exposure, potential;
    int step, nhold, is_moved, padding;
} Episode;

typedef struct State {
    Episode now;
    OmRlRetractState* fat;  // tissue, work, contact and picture
} State;

static const OmRlExpose* expose_of(const OmRlTask* task) { return (const OmRlExpose*)task; }
static const OmRlRetract* scene_of(const OmRlTask* task) {
    return om__rl_retract(expose_of(task)->retract);
}

// ---- steps ------------------------------------------------------------------------------------------

static OmPose tip_pose(const OmRlExpose* e, const State* s, int arm) {
    return (OmPose){s->now.arm[arm].tip, e->tip_q[arm]};
}

static OmStatus take_joints(const OmRlExpose* e, int k, OmVec3 p, Arm* arm) {
    OmStatus status = om_psm_inverse(&e->psm[k], (OmPose){p, e->tip_q[k]}, arm->q, arm->q);
    if (status == OM_OK) arm->tip = p;
    return status;
}

// Keep the tip in the workspace, out of kidney and table, and off the other tip; otherwise it stays.
static void move_tip(const OmRlTask* task, State* s, int k, const int* action) {
    const OmRlExpose* e = expose_of(task);
    const OmRlRetract* t = scene_of(task);
    Arm* arm = &s->now.arm[k];
    OmVec3 p = arm->tip, n;
    double* axis[3] = {&p.x, &p.y, &p.z};
    for (int a = 0; a < 3; ++a)
        *axis[a] += t->def.move * (action[a] == 2 ? 1 : action[a] == 1 ? -1 : 0);
    p = om_max3(t->def.workspace_lo, om_min3(t->def.workspace_hi, p));
    double gap = om__rl_ground_distance(&t->ground, p, &n) - t->ground.shift - CLEAR;
    if (gap < 0) p = om_madd(p, -gap, n);
    p = om_max3(t->def.workspace_lo, om_min3(t->def.workspace_hi, p));
    if (om_distance(p, s->now.arm[1 - k].tip) < TIPS_APART) return;
    take_joints(e, k, p, arm);
}

// The vertex of the fat next to the tip of an arm.
static int nearest(const OmRlTask* task, State* s, int k, double* distance) {
    s->fat->now.tip = s->now.arm[k].tip;
    return om__rl_nearest(scene_of(task), s->fat, distance);
}

static OmStatus work_gripper(const OmRlTask* task, State* s, int k) {
    const OmRlRetract* t = scene_of(task);
    Arm* arm = &s->now.arm[k];
    double distance;
    if (arm->is_holding) return OM_OK;
    int i = nearest(task, s, k, &distance);
    if (distance > t->def.reach) return OM_OK;
    double radius = fmax(t->def.grasp_radius, distance + 0.5 * t->def.thickness + 1e-6);
    OmPose tip = tip_pose(expose_of(task), s, k);
    OmStatus status = om_tissue_grasp(t->tissue, s->fat->tissue, k, tip, radius, NULL);
    if (status == OM_INVALID) return OM_OK;  // the other arm holds all of this place
    if (status < 0) return status;
    const double* flat = om_tissue_mesh(t->tissue)->x;
    arm->along = t->fixed_x - flat[3 * (size_t)i];
    arm->across = flat[3 * (size_t)i + 1];
    arm->is_holding = s->now.is_moved = 1;
    return OM_OK;
}

static OmStatus step_tissue(const OmRlTask* task, State* s) {
    const OmRlRetract* t = scene_of(task);
    if (!s->now.is_moved) return OM_OK;
    for (int k = 0; k < NARM; ++k)
        OM_TRY(om_tissue_move_grasp(s->fat->tissue, k, tip_pose(expose_of(task), s, k)));
    OmStatus status = om_contact_step(s->fat->contact, t->tissue, s->fat->tissue, s->fat->work,
                                      t->def.time_step, NULL);
    if (status < 0) return status;
    s->now.exposure = om__rl_exposure(t, om_tissue_x(s->fat->tissue), s->fat->pixel);
    return OM_OK;
}

static double potential_of(const OmRlExpose* e, const Episode* now) {
    const OmRlRetract* t = om__rl_retract(e->retract);
    double sum = 2 * now->exposure;
    for (int k = 0; k < NARM; ++k) {
        const Arm* arm = &now->arm[k];
        if (!arm->is_holding) {
            sum -= om_distance(arm->tip, e->goal[k]) / SHAPE_LENGTH;
            continue;
        }
        double across = k == 0 ? -APART : APART;
        double off = hypot(arm->along - t->goal_along, arm->across - across);
        sum += 1 + 2 * fmax(0, 1 - off / SHAPE_PLACE);
        sum -= om_distance(arm->tip, e->target[k]) / SHAPE_LENGTH;
    }
    return sum;
}

static void close_tools(State* s) {
    for (int k = 0; k < NARM; ++k) s->fat->tool[k].is_closed = s->now.arm[k].is_holding;
}

static OmStatus look(const OmRlRetract* t, State* s) {
    close_tools(s);
    return om__rl_look(t, s->fat);
}

static OmStatus step(const OmRlTask* task, void* state, const int* action, double* reward,
                     bool* is_terminated) {
    const OmRlExpose* e = expose_of(task);
    State* s = state;
    bool is_there = true;
    for (int k = 0; k < NARM; ++k) move_tip(task, s, k, action + 3 * (size_t)k);
    for (int k = 0; k < NARM; ++k) OM_TRY(work_gripper(task, s, k));
    OM_TRY(step_tissue(task, s));
    for (int k = 0; k < NARM; ++k) {
        const Arm* arm = &s->now.arm[k];
        is_there &= arm->is_holding && om_distance(arm->tip, e->target[k]) <= AT_TARGET;
    }
    s->now.nhold = is_there ? s->now.nhold + 1 : 0;
    ++s->now.step;
    *is_terminated = s->now.nhold >= HOLD;
    double before = s->now.potential;
    s->now.potential = potential_of(e, &s->now);
    *reward = s->now.potential - before - SHAPE_STEP;
    if (*is_terminated) *reward += SHAPE_END * s->now.exposure;
    return look(scene_of(task), s);
}

// ---- the table --------------------------------------------------------------------------------------

static void destroy(OmRlTask* task) {
    OmRlExpose* e = (OmRlExpose*)task;
    om_rl_task_destroy(e->retract);
    om_free(e);
}

static void state_destroy(const OmRlTask* task, void* state) {
    State* s = state;
    if (!s) return;
    om__rl_retract_ops.state_destroy(expose_of(task)->retract, s->fat);
    om_free(s);
}

static OmStatus state_create(const OmRlTask* task, void** state) {
    const OmRlExpose* e = expose_of(task);
    *state = NULL;
    State* s = om_calloc(1, sizeof *s);
    if (!s) return OM_NO_MEMORY;
    void* fat = NULL;
    OmStatus status = om__rl_retract_ops.state_create(e->retract, &fat);
    if (status < 0) {
        om_free(s);
        return status;
    }
    s->fat = fat;
    s->fat->ntool = NARM;
    for (int k = 0; k < NARM; ++k)
        s->fat->tool[k] = (OmRlTool){.psm = &e->psm[k], .q = s->now.arm[k].q};
    *state = s;
    return OM_OK;
}

// Each arm above its own half of the fat.
static OmStatus reset(const OmRlTask* task, void* state, OmRng rng, int start) {
    const OmRlExpose* e = expose_of(task);
    const OmRlRetract* t = scene_of(task);
    State* s = state;
    if (s->now.is_moved) memcpy(s->fat->tissue, t->rest, t->tissue_size);
    memset(&s->now, 0, sizeof s->now);
    s->now.rng = rng;
    for (int k = 0; k < NARM; ++k) {
        double u = om_rng_uniform(&s->now.rng), v = om_rng_uniform(&s->now.rng);
        if (start >= 0) {
            u = (start / OM_RL_GRID + 0.5) / OM_RL_GRID;
            v = (start % OM_RL_GRID + 0.5) / OM_RL_GRID;
        }
        double x = t->fat_hi.x - u * (t->fat_hi.x - t->fat_lo.x), y = (0.2 + 0.8 * v) * t->fat_hi.y;
        OmVec3 p = om__rl_start_above(t, x, k == 0 ? -y : y, t->def.start_height);
        OM_TRY(take_joints(e, k, p, &s->now.arm[k]));
    }
    s->now.exposure = t->rest_exposure;
    s->now.potential = potential_of(e, &s->now);
    return look(t, s);
}

static void observe(const OmRlTask* task, const void* state, float* obs) {
    const OmRlExpose* e = expose_of(task);
    const OmRlRetract* t = scene_of(task);
    const State* s = state;
    if (t->def.has_picture) {
        om__rl_put_picture(s->fat, obs);
        return;
    }
    obs = om__rl_put_point(t, t->q, obs);
    for (int k = 0; k < NARM; ++k) {
        const Arm* arm = &s->now.arm[k];
        obs = om__rl_put_point(t, arm->tip, obs);
        obs = om__rl_put_point(t, e->target[k], obs);
        *obs++ = (float)(om_distance(arm->tip, t->q) / t->d_max);
        *obs++ = (float)(om_distance(arm->tip, e->target[k]) / t->d_max);
        *obs++ = arm->is_holding ? 1 : 0;
    }
}

static OmStatus info(const OmRlTask* task, void* state, double* value) {
    State* s = state;
    close_tools(s);
    value[1] = s->now.arm[0].is_holding + s->now.arm[1].is_holding;
    OM_TRY(om__rl_measure_force(scene_of(task), s->fat, NARM, &value[2]));
    return om__rl_measure(scene_of(task), s->fat, value);
}

static OmStatus render(const OmRlTask* task, void* state, OmPicture* picture) {
    State* s = state;
    close_tools(s);
    return om__rl_render(scene_of(task), s->fat, picture);
}

// Each arm as the expert of "retract"; an arm that holds fat waits until the other one does.
static void expert(const OmRlTask* task, const void* state, OmRng* rng, int* action) {
    const OmRlExpose* e = expose_of(task);
    State copy = *(const State*)state;  // shares the fat
    const double move = scene_of(task)->def.move;
    bool is_both = copy.now.arm[0].is_holding && copy.now.arm[1].is_holding;
    for (int k = 0; k < NARM; ++k) {
        const Arm* arm = &copy.now.arm[k];
        OmVec3 way = om_sub(e->target[k], arm->tip);
        if (!arm->is_holding) {
            double gap;
            nearest(task, &copy, k, &gap);
            way = om_sub(e->goal[k], arm->tip);
            bool is_above = hypot(way.x, way.y) < EXPERT_NEAR;
            way.z = is_above ? -1 : gap < EXPERT_HIGH ? 1 : gap > 2 * EXPERT_HIGH ? -1 : 0;
        } else if (!is_both) {
            way = om_vec3(0, 0, 0);
        }
        int* a = action + 3 * (size_t)k;
        a[0] = om__rl_choice_towards(way.x, move);
        a[1] = om__rl_choice_towards(way.y, move);
        a[2] = om__rl_choice_towards(way.z, move);
        for (int c = 0; c < 3; ++c)
            if (om_rng_uniform(rng) < EXPERT_SLIP) a[c] = (int)om_rng_below(rng, 3);
    }
}

static size_t state_size(const OmRlTask* task) {
    const OmRlRetract* t = scene_of(task);
    return sizeof(Episode) + t->tissue_size + om__rl_picture_size(t);
}

static void save(const OmRlTask* task, const void* state, void* block) {
    const OmRlRetract* t = scene_of(task);
    const State* s = state;
    char* at = block;
    memcpy(at, &s->now, sizeof s->now);
    memcpy(at + sizeof s->now, s->fat->tissue, t->tissue_size);
    if (t->def.has_picture)
        memcpy(at + sizeof s->now + t->tissue_size, s->fat->seen.pixel, om__rl_picture_size(t));
}

static void restore(const OmRlTask* task, void* state, const void* block) {
    const OmRlRetract* t = scene_of(task);
    State* s = state;
    const char* at = block;
    memcpy(&s->now, at, sizeof s->now);
    memcpy(s->fat->tissue, at + sizeof s->now, t->tissue_size);
    if (t->def.has_picture)
        memcpy(s->fat->seen.pixel, at + sizeof s->now + t->tissue_size, om__rl_picture_size(t));
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

// ---- creation ---------------------------------------------------------------------------------------

// PSM1 stands at the right of the picture.
static const OmRlKey keys[] = {OM__RL_RIGHT_HAND("PSM1 ", 0, 1, 2),
                               OM__RL_LEFT_HAND("PSM2 ", 3, 1, 2)};

static void fill_head(OmRlExpose* e) {
    OmRlTask* h = &e->head;
    *h = (OmRlTask){.ops = &ops,
                    .name = "expose",
                    .nobservation = NOBS,
                    .obs_lo = -OM__RL_FAR,
                    .obs_hi = OM__RL_FAR,
                    .naction = 3 * NARM,
                    .max_step = e->retract->max_step,
                    .nstart = OM_RL_GRID * OM_RL_GRID,
                    .ninfo = 3,
                    .info_name = {"exposure", "grasped", "force"},
                    .score_name = "exposure",
                    .target = 0.95,
                    .key = keys,
                    .nkey = sizeof keys / sizeof *keys,
                    .period = e->retract->period};
    for (int k = 0; k < 3 * NARM; ++k) h->nchoice[k] = 3;
    if (e->retract->picture_width > 0) {
        h->nobservation = e->retract->nobservation;
        h->obs_lo = e->retract->obs_lo;
        h->obs_hi = e->retract->obs_hi;
        h->picture_width = e->retract->picture_width;
        h->picture_height = e->retract->picture_height;
    }
    memcpy(h->meaning, e->retract->meaning, sizeof h->meaning);
    memcpy(h->values, e->retract->values, sizeof h->values);
    h->hash = om_hash(e->goal, sizeof e->goal, e->retract->hash);
}

static OmStatus fill(OmRlExpose* e) {
    const OmRlRetract* t = om__rl_retract(e->retract);
    for (int k = 0; k < NARM; ++k) {
        double side = k == 0 ? -1 : 1;
        OM_TRY(om__rl_place_psm(&t->def, side, &e->psm[k], &e->tip_q[k]));
        e->goal[k] = om__rl_rest_place(t, t->goal_along, side * APART);
        e->target[k] = om_add(t->def.target, om_vec3(0, side * APART, 0));
    }
    fill_head(e);
    return OM_OK;
}

OmStatus om__rl_expose_create(const OmRlSetting* setting, int nsetting, OmRlTask** task) {
    static const char* const known[] = {"tissue",  "max_step",     "move_mm", "start_height_mm",
                                        "picture", "picture_side", NULL};
    OmRlSetting all[8] = {{"tissue", "thesis"}};
    *task = NULL;
    OM_CHECK(nsetting <= 7, OM_INVALID, "task expose has 6 settings, %d are given", nsetting);
    for (int k = 0; k < nsetting; ++k) {
        int n = 0;
        while (known[n] && strcmp(known[n], setting[k].key) != 0) ++n;
        if (!known[n]) return om__rl_setting_unknown("expose", &setting[k], known);
        all[1 + k] = setting[k];
    }
    OmRlExpose* e = om_calloc(1, sizeof *e);
    if (!e) return OM_NO_MEMORY;
    OmStatus status = om__rl_retract_create(all, 1 + nsetting, &e->retract);
    if (status >= 0) status = fill(e);
    if (status < 0) {
        destroy(&e->head);
        return status;
    }
    *task = &e->head;
    return OM_OK;
}
