// rl_retract_state.c: episodes of the task "retract": reset, step, observation, reward, and the scripted expert.
//
// The fat is at rest until it is grasped, and then again some time after it is released: such steps do not touch it.
// With `is_awake` the fat is stepped always, and a step that leaves it within REST_MOVE of its rest is taken back: the
// bytes are those of sleep (test_rl_retract). The particles of the rest state tremble by 0.2 nm in 2 minutes.
#include <math.h>
#include <string.h>

#include "rl/rl_retract_internal.h"

#define SETTLE_SPEED 1e-3  // m/s, of fat at rest
#define SETTLE_TIME 20.0   // s, at most
#define SETTLE_MORE \
    100  // steps that follow; from the 50th nothing but rounding moves the fat, 0.2 nm a step
#define REST_MOVE 1e-8     // m
#define STILL 5            // slow steps in a row after which released fat rests
#define CLEAR 0.001        // m, between the tip and the kidney or the table
#define AT_TARGET 0.002    // m, the tip is at p_T
#define SHAPE_LENGTH 0.1   // m, unit of distances in the potential of reward (b)
#define SHAPE_PLACE 0.03   // m, from the grasping place, where the quality of a place is 0
#define SHAPE_END 2.0      // of TE at the end
#define EXPERT_HIGH 0.012  // m, above the fat on the expert's way
#define EXPERT_BAND 0.004  // m, above EXPERT_HIGH, in which the expert keeps its height
#define EXPERT_NEAR 0.004  // m, from the place in the plane, where the expert goes down
#define EXPERT_PAST 0.014  // m, the expert pulls the fat past p_T, away from the endoscope, ..
#define EXPERT_OVER 0.010  // .. and above p_T, and lets it down to p_T
#define EXPERT_SIDE \
    0.010                 // m, on the endoscope's side of p_T the expert has the height EXPERT_OVER
#define EXPERT_SLIP 0.12  // share of random components of the expert's actions

// ---- the tip ----------------------------------------------------------------------------------------

static OmPose tip_pose(const OmRlRetract* t, const OmRlRetractState* s) {
    return (OmPose){om_add(s->now.tip, s->now.error), t->tip_q};
}

// Distance of the fat from its drawn surface to the middle of particles, or to the vertices of elements.
static double half_thickness(const OmRlRetract* t) { return 0.5 * t->def.thickness; }

int om__rl_nearest(const OmRlRetract* t, const OmRlRetractState* s, double* distance) {
    OmVec3 tip = om_add(s->now.tip, s->now.error);
    const double* x = om_tissue_x(s->tissue);
    const unsigned char* attached = om_tissue_attached(s->tissue);
    double best = INFINITY;
    int nearest = -1;
    for (int i = 0; i < t->nvert; ++i) {
        double d = om_norm2(om_sub(om_load3(x, i), tip));
        if (d < best && !attached[i]) best = d, nearest = i;
    }
    *distance = sqrt(best) - half_thickness(t);
    return nearest;
}

// Put the tip at p, but out of kidney and table and in the workspace; otherwise it stays. @return false: it stays
static bool put_tip(const OmRlRetract* t, OmRlRetractState* s, OmVec3 p) {
    OmVec3 n;
    p = om_max3(t->def.workspace_lo, om_min3(t->def.workspace_hi, p));
    double gap = om__rl_ground_distance(&t->ground, om_add(p, s->now.error), &n);
    gap -= t->ground.shift + CLEAR;
    if (gap < 0) p = om_madd(p, -gap, n);
    p = om_max3(t->def.workspace_lo, om_min3(t->def.workspace_hi, p));
    OmPose pose = {om_add(p, s->now.error), t->tip_q};
    bool is_reached = om_psm_inverse(&t->psm, pose, s->now.q, s->now.q) == OM_OK;
    if (is_reached) s->now.tip = p;
    return is_reached;
}

static void move_tip(const OmRlRetract* t, OmRlRetractState* s, const int* action) {
    OmVec3 p = s->now.tip;
    double* axis[3] = {&p.x, &p.y, &p.z};
    for (int k = 0; k < 3; ++k)
        *axis[k] += t->def.move * (action[k] == 2 ? 1 : action[k] == 1 ? -1 : 0);
    put_tip(t, s, p);
}

// ---- grasp and tissue -------------------------------------------------------------------------------

OmStatus om__rl_grasp(const OmRlRetract* t, OmRlRetractState* s) {
    double distance;
    int i = om__rl_nearest(t, s, &distance);
    double radius = fmax(t->def.grasp_radius, distance + half_thickness(t) + 1e-6);
    OM_TRY(om_tissue_grasp(t->tissue, s->tissue, 0, tip_pose(t, s), radius, NULL));
    const double* rest = om_tissue_mesh(t->tissue)->x;
    s->now.along = t->fixed_x - rest[3 * (size_t)i];
    s->now.across = rest[3 * (size_t)i + 1];
    double off = hypot(s->now.along - t->goal_along, s->now.across);
    s->now.quality = fmax(0, 1 - off / SHAPE_PLACE);
    s->now.is_holding = s->now.is_moving = s->now.is_moved = true;
    s->now.nstill = 0;
    return OM_OK;
}

static void release(OmRlRetractState* s) {
    om_tissue_release(s->tissue, 0);
    s->now.is_holding = false;
    s->now.nhold = 0;
}

static double fastest(const OmRlRetract* t, const OmTissueState* tissue) {
    const double* v = om_tissue_v(tissue);
    double most = 0;
    for (int i = 0; i < t->nvert; ++i) most = fmax(most, om_norm2(om_load3(v, i)));
    return sqrt(most);
}

// Put fat that has not left its rest back.
static void take_back(const OmRlRetract* t, OmRlRetractState* s) {
    const double* x = om_tissue_x(s->tissue);
    for (int i = 0; i < 3 * t->nvert; ++i)
        if (!(fabs(x[i] - t->rest_x[i]) < REST_MOVE)) return;
    memcpy(s->tissue, t->rest, t->tissue_size);
    s->now.is_moved = false;
}

// Fat that is pulled beyond the friction of the jaws is free. Otherwise a tip that pulls fat which is caught between
// kidney and table stretches it 27 times, and the step in which it snaps back has no solution.
static OmStatus slip(const OmRlRetract* t, OmRlRetractState* s) {
    OmTissueForces f;
    OM_TRY(om_tissue_get_forces(t->tissue, s->tissue, &f));
    if (om_norm(f.grasp[0]) <= t->def.slip_force) return OM_OK;
    release(s);
    ++s->now.nslip;
    return OM_OK;
}

static OmStatus step_tissue(const OmRlRetract* t, OmRlRetractState* s) {
    OmContactReport report;
    if (!s->now.is_moving && !t->def.is_awake) return OM_OK;
    OM_TRY(om_tissue_move_grasp(s->tissue, 0, tip_pose(t, s)));
    OmStatus status =
        om_contact_step(s->contact, t->tissue, s->tissue, s->work, t->def.time_step, &report);
    if (status < 0) return status;
    if (report.tissue.ninverted > s->now.ninverted) s->now.ninverted = report.tissue.ninverted;
    if (s->now.is_holding && t->def.slip_force > 0) OM_TRY(slip(t, s));
    s->now.is_moved = true;
    if (!s->now.is_moving) take_back(t, s);
    s->now.exposure = om__rl_exposure(t, om_tissue_x(s->tissue), s->pixel);
    if (s->now.is_holding || !s->now.is_moving) return OM_OK;
    s->now.nstill = fastest(t, s->tissue) < SETTLE_SPEED ? s->now.nstill + 1 : 0;
    if (s->now.nstill >= STILL) s->now.is_moving = false;
    return OM_OK;
}

OmStatus om__rl_settle(OmRlRetract* t) {
    OmTissueState* tissue = NULL;
    OmTissueWork* work = NULL;
    OmContactWork* contact = NULL;
    OmStatus status = om_tissue_state_create(t->tissue, &tissue);
    if (status == OM_OK) status = om_tissue_work_create(t->tissue, &work);
    if (status == OM_OK) status = om_contact_work_create(t->contact, &contact);
    if (status == OM_OK)
        status = om_contact_settle(contact, t->tissue, tissue, work, t->def.time_step, SETTLE_SPEED,
                                   SETTLE_TIME);
    for (int k = 0; k < SETTLE_MORE && status >= 0 && t->def.tissue == OM_RL_CLUSTERS; ++k)
        status = om_contact_step(contact, t->tissue, tissue, work, t->def.time_step, NULL);
    if (status >= 0) {
        status = OM_OK;
        t->tissue_size = om_tissue_state_size(t->tissue);
        OM_ALLOC_DONE(t->rest, t->tissue_size);
        memcpy(t->rest, tissue, t->tissue_size);
        OM_ALLOC_DONE(t->rest_x, 3 * (size_t)t->nvert);
        memcpy(t->rest_x, om_tissue_x(tissue), 3 * (size_t)t->nvert * sizeof *t->rest_x);
    }
done:
    om_contact_work_destroy(contact);
    om_tissue_work_destroy(work);
    om_tissue_state_destroy(tissue);
    return status;
}

// ---- reward -----------------------------------------------------------------------------------------

static double potential_of(const OmRlRetract* t, const OmRlEpisode* e) {
    if (!e->is_holding) return -om_distance(e->tip, t->goal) / SHAPE_LENGTH;
    return 1 + 2 * e->quality + 2 * e->exposure - om_distance(e->tip, t->def.target) / SHAPE_LENGTH;
}

static double reward_of(const OmRlRetract* t, OmRlEpisode* e, bool is_end) {
    if (t->def.reward == OM_RL_REWARD_THESIS) {
        OmVec3 to = e->is_holding ? t->def.target : t->q;
        return -0.5 * om_distance(e->tip, to) / t->d_max - (e->is_holding ? 0 : 0.5);
    }
    double before = e->potential;
    e->potential = potential_of(t, e);
    return e->potential - before - t->def.step_cost + (is_end ? SHAPE_END * e->exposure : 0);
}

// ---- the table --------------------------------------------------------------------------------------

static OmStatus state_create(const OmRlTask* task, void** state) {
    const OmRlRetract* t = om__rl_retract(task);
    *state = NULL;
    OmRlRetractState* s = om_calloc(1, sizeof *s);
    if (!s) return OM_NO_MEMORY;
    OmStatus status = om_tissue_state_create(t->tissue, &s->tissue);
    if (status == OM_OK) status = om_tissue_work_create(t->tissue, &s->work);
    if (status == OM_OK) status = om_contact_work_create(t->contact, &s->contact);
    if (status == OM_OK) OM_ALLOC_DONE(s->pixel, 3 * (size_t)t->nvert);
    if (status == OM_OK && t->def.has_picture)
        status = om_picture_init(&s->seen, t->def.picture_width, t->def.picture_height, 3);
    if (status == OM_OK) memcpy(s->tissue, t->rest, t->tissue_size);
    s->tool[0] = (OmRlTool){.psm = &t->psm, .q = s->now.q};
    s->ntool = 1;
done:
    if (status == OM_OK)
        *state = s;
    else
        om__rl_retract_ops.state_destroy(task, s);
    return status;
}

static void state_destroy(const OmRlTask* task, void* state) {
    (void)task;
    OmRlRetractState* s = state;
    if (!s) return;
    om__rl_view_drop(s);
    om_contact_work_destroy(s->contact);
    om_tissue_work_destroy(s->work);
    om_tissue_state_destroy(s->tissue);
    om_picture_done(&s->seen);
    om_free(s->pixel);
    om_free(s);
}

OmVec3 om__rl_start_above(const OmRlRetract* t, double x, double y, double height) {
    OmVec3 n, p = om_vec3(x, y, t->def.workspace_hi.z);
    double gap;
    double top = 0;
    for (int i = 0; i < t->nvert; ++i) {
        OmVec3 v = om_load3(t->rest_x, i);
        if (hypot(v.x - x, v.y - y) < 0.004) top = fmax(top, v.z);
    }
    while ((gap = om__rl_ground_distance(&t->ground, p, &n) - t->ground.shift) > 1e-4 && p.z > top)
        p.z -= 0.5 * gap;
    p.z = fmax(p.z, top) + height;
    return om_max3(t->def.workspace_lo, om_min3(t->def.workspace_hi, p));
}

// Mean length of a normal vector is sigma sqrt(8 / pi).
OmVec3 om__rl_draw_error(double mean, OmRng* rng) {
    double sigma = mean / sqrt(8 / OM_PI);
    double e[3] = {om_rng_normal(rng), om_rng_normal(rng), om_rng_normal(rng)};
    return om_scale(sigma, om_vec3(e[0], e[1], e[2]));
}

static OmStatus look(const OmRlRetract* t, OmRlRetractState* s) {
    s->tool[0].is_closed = s->now.is_closed;
    return om__rl_look(t, s);
}

static OmStatus reset(const OmRlTask* task, void* state, OmRng rng, int start) {
    const OmRlRetract* t = om__rl_retract(task);
    OmRlRetractState* s = state;
    bool was_moved = s->now.is_moved;
    memset(&s->now, 0, sizeof s->now);  // padding too: snapshots are compared by bytes
    s->now.rng = rng;
    OmRng* r = &s->now.rng;
    double u = om_rng_uniform(r), v = om_rng_uniform(r);
    if (start >= 0) {
        u = (start / OM_RL_GRID + 0.5) / OM_RL_GRID;
        v = (start % OM_RL_GRID + 0.5) / OM_RL_GRID;
    }
    double height = t->def.start_height;
    if (start < 0) height += om_rng_range(r, -0.25, 0.25) * t->def.start_height;
    OmVec3 lo = t->fat_lo, hi = t->fat_hi;
    s->now.tip = om__rl_start_above(t, hi.x - u * (hi.x - lo.x), lo.y + v * (hi.y - lo.y), height);
    s->now.place = s->now.tip;
    s->now.error = om__rl_draw_error(t->def.tip_error, r);
    if (was_moved) memcpy(s->tissue, t->rest, t->tissue_size);
    s->now.exposure = t->rest_exposure;
    OM_TRY(om_psm_inverse(&t->psm, tip_pose(t, s), s->now.q, s->now.q));
    s->now.potential = potential_of(t, &s->now);
    return look(t, s);
}

// The gripper closes where fat is within reach, or at the wish of the fourth action.
static OmStatus work_gripper(const OmRlRetract* t, OmRlRetractState* s, const int* action) {
    bool is_wanted = !t->def.has_gripper || action[3] == 1;
    if (s->now.is_holding) {
        if (!is_wanted) release(s);
        s->now.is_closed = is_wanted;
        return OM_OK;
    }
    double distance;
    om__rl_nearest(t, s, &distance);
    bool is_near = distance <= t->def.reach;
    s->now.is_closed = t->def.has_gripper ? is_wanted : is_near;
    return is_wanted && is_near ? om__rl_grasp(t, s) : OM_OK;
}

static void count_still(OmRlEpisode* e) {
    bool is_there = om_distance(e->tip, e->place) <= AT_TARGET;
    e->nplace = is_there ? e->nplace + 1 : 0;
    if (!is_there) e->place = e->tip;
}

static bool is_over(const OmRlRetract* t, const OmRlEpisode* e) {
    if (t->def.has_fixed_horizon) return false;
    return e->nhold >= t->def.hold || (t->def.still > 0 && e->nplace >= t->def.still);
}

static OmStatus step(const OmRlTask* task, void* state, const int* action, double* reward,
                     bool* is_terminated) {
    const OmRlRetract* t = om__rl_retract(task);
    OmRlRetractState* s = state;
    *reward = 0;
    *is_terminated = false;
    for (int k = 0; k < t->def.repeat && !*is_terminated; ++k) {
        move_tip(t, s, action);
        OM_TRY(work_gripper(t, s, action));
        OM_TRY(step_tissue(t, s));
        bool is_there = s->now.is_holding && om_distance(s->now.tip, t->def.target) <= AT_TARGET;
        s->now.nhold = is_there ? s->now.nhold + 1 : 0;
        ++s->now.step;
        count_still(&s->now);
        *is_terminated = is_over(t, &s->now);
        *reward += reward_of(t, &s->now, *is_terminated);
    }
    return look(t, s);
}

float* om__rl_put_point(const OmRlRetract* t, OmVec3 p, float* obs) {
    OmVec3 lo = t->def.workspace_lo, hi = t->def.workspace_hi;
    *obs++ = (float)(2 * (p.x - lo.x) / (hi.x - lo.x) - 1);
    *obs++ = (float)(2 * (p.y - lo.y) / (hi.y - lo.y) - 1);
    *obs++ = (float)(2 * (p.z - lo.z) / (hi.z - lo.z) - 1);
    return obs;
}

static void observe(const OmRlTask* task, const void* state, float* obs) {
    const OmRlRetract* t = om__rl_retract(task);
    const OmRlRetractState* s = state;
    if (t->def.has_picture) {
        om__rl_put_picture(s, obs);
        return;
    }
    obs = om__rl_put_point(t, s->now.tip, obs);
    obs = om__rl_put_point(t, t->q, obs);
    obs = om__rl_put_point(t, t->def.target, obs);
    *obs++ = (float)(om_distance(s->now.tip, t->q) / t->d_max);
    *obs++ = (float)(om_distance(s->now.tip, t->def.target) / t->d_max);
    *obs++ = s->now.is_holding ? 1 : 0;
    const double* x = om_tissue_x(s->tissue);
    for (int k = 0; k < t->def.npoint; ++k)
        obs = om__rl_put_point(t, om_load3(x, t->point_vert[k]), obs);
}

// Of clusters nothing is known: they have no forces.
OmStatus om__rl_measure_force(const OmRlRetract* t, const OmRlRetractState* s, int narm,
                              double* force) {
    *force = NAN;
    if (t->def.tissue != OM_RL_ELEMENTS) return OM_OK;
    OmTissueForces f;
    OM_TRY(om_tissue_get_forces(t->tissue, s->tissue, &f));
    *force = 0;
    for (int k = 0; k < narm; ++k) *force = fmax(*force, om_norm(f.grasp[k]));
    return OM_OK;
}

static OmStatus info(const OmRlTask* task, void* state, double* value) {
    OmRlRetractState* s = state;
    s->tool[0].is_closed = s->now.is_closed;
    value[1] = s->now.is_holding;
    value[2] = s->now.along;
    value[3] = s->now.across;
    value[4] = s->now.nslip;
    value[5] = s->now.ninverted;
    OM_TRY(om__rl_measure_force(om__rl_retract(task), s, 1, &value[6]));
    return om__rl_measure(om__rl_retract(task), s, value);
}

static OmStatus render(const OmRlTask* task, void* state, OmPicture* picture) {
    OmRlRetractState* s = state;
    s->tool[0].is_closed = s->now.is_closed;
    return om__rl_render(om__rl_retract(task), s, picture);
}

// ---- the expert -------------------------------------------------------------------------------------

// The way with fat, a function of the tip alone, so that a policy can learn it: up on the endoscope's side of p_T, past
// p_T at EXPERT_OVER above it, and back down; a slip on the way past p_T ends it. Fat that was pulled farther stays
// farther back: with the softer clusters of the thesis (tissue=thesis, tip error 1.7 mm, 8 episodes without slips) the
// mean TE is 0.93, by a straight way 0.46.
static OmVec3 expert_way(const OmRlRetract* t, OmVec3 tip) {
    const OmVec3 p = t->def.target, room = om_sub(t->def.workspace_hi, p), off = om_sub(tip, p);
    const double step = t->def.move, past = fmin(EXPERT_PAST, room.x),
                 over = fmin(EXPERT_OVER, room.z);
    OmVec3 to = om_vec3(0, 0, 0);
    if (om_norm(off) <= AT_TARGET || fmin(past, over) < 2 * AT_TARGET) return om_sub(to, off);
    if (off.x < -EXPERT_SIDE)
        to = om_vec3(-EXPERT_SIDE + step, 0, over);
    else if (off.x < -AT_TARGET && off.z < over - step)
        to = om_vec3(off.x, 0, over);
    else if (off.x < past - step && off.z >= over - step)
        to = om_vec3(past, 0, off.z);
    return om_sub(to, off);
}

// To the grasping place above the fat, down until it is grasped, past p_T and back to it. A person's hand wanders: the
// place is off by some mm that are the same through an episode, and components of the action slip.
static void expert(const OmRlTask* task, const void* state, OmRng* rng, int* action) {
    const OmRlRetract* t = om__rl_retract(task);
    const OmRlRetractState* s = state;
    OmRng own = s->now.rng;
    own.counter[1] += 0x20000u;
    own.used = 4;
    OmVec3 goal = om_madd(t->goal, 1, om__rl_draw_error(0.003, &own)), tip = s->now.tip;
    OmVec3 way = expert_way(t, tip);
    if (!s->now.is_holding) {
        way = om_sub(goal, tip);
        double gap;
        om__rl_nearest(t, s, &gap);
        if (hypot(way.x, way.y) < EXPERT_NEAR)
            way.z = -1;
        else
            way.z = gap < EXPERT_HIGH ? 1 : gap > EXPERT_HIGH + EXPERT_BAND ? -1 : 0;
    }
    action[0] = om__rl_choice_towards(way.x, t->def.move);
    action[1] = om__rl_choice_towards(way.y, t->def.move);
    action[2] = om__rl_choice_towards(way.z, t->def.move);
    for (int k = 0; k < 3; ++k)
        if (om_rng_uniform(rng) < EXPERT_SLIP) action[k] = (int)om_rng_below(rng, 3);
    if (t->def.has_gripper) action[3] = 1;
}

// ---- a recorded robot -------------------------------------------------------------------------------

static void tip(const OmRlTask* task, const void* state, double tip[3]) {
    (void)task;
    om_store3(tip, 0, ((const OmRlRetractState*)state)->now.tip);
}

static OmStatus place(const OmRlTask* task, void* state, const double tip[3]) {
    const OmRlRetract* t = om__rl_retract(task);
    OmRlRetractState* s = state;
    OmVec3 p = om_load3(tip, 0), lo = t->def.workspace_lo, hi = t->def.workspace_hi;
    OM_CHECK(p.x >= lo.x && p.y >= lo.y && p.z >= lo.z && p.x <= hi.x && p.y <= hi.y && p.z <= hi.z,
             OM_INVALID,
             "the tip at (%g, %g, %g) m is outside the workspace, (%g, %g, %g) to (%g, %g, %g)",
             p.x, p.y, p.z, lo.x, lo.y, lo.z, hi.x, hi.y, hi.z);
    OM_CHECK(put_tip(t, s, p), OM_INVALID,
             "the tip at (%g, %g, %g) m is out of reach of the instrument", p.x, p.y, p.z);
    s->now.potential = potential_of(t, &s->now);
    return look(t, s);
}

static void steer(const OmRlTask* task, const void* state, const double to[3], bool is_closed,
                  int* action) {
    const OmRlRetractState* s = state;
    OmVec3 way = om_sub(om_load3(to, 0), s->now.tip);
    action[0] = om__rl_choice_towards(way.x, task->move);
    action[1] = om__rl_choice_towards(way.y, task->move);
    action[2] = om__rl_choice_towards(way.z, task->move);
    if (task->has_jaw) action[3] = is_closed;
}

// ---- snapshots --------------------------------------------------------------------------------------

static size_t state_size(const OmRlTask* task) {
    const OmRlRetract* t = om__rl_retract(task);
    return sizeof(OmRlEpisode) + t->tissue_size + om__rl_picture_size(t);
}

static void save(const OmRlTask* task, const void* state, void* block) {
    const OmRlRetract* t = om__rl_retract(task);
    const OmRlRetractState* s = state;
    unsigned char* at = block;
    memcpy(at, &s->now, sizeof s->now);
    memcpy(at + sizeof s->now, s->tissue, t->tissue_size);
    if (t->def.has_picture)
        memcpy(at + sizeof s->now + t->tissue_size, s->seen.pixel, om__rl_picture_size(t));
}

static void restore(const OmRlTask* task, void* state, const void* block) {
    const OmRlRetract* t = om__rl_retract(task);
    OmRlRetractState* s = state;
    const unsigned char* at = block;
    memcpy(&s->now, at, sizeof s->now);
    memcpy(s->tissue, at + sizeof s->now, t->tissue_size);
    if (t->def.has_picture)
        memcpy(s->seen.pixel, at + sizeof s->now + t->tissue_size, om__rl_picture_size(t));
}

const OmRlTaskOps om__rl_retract_ops = {.destroy = om__rl_retract_destroy,
                                        .state_create = state_create,
                                        .state_destroy = state_destroy,
                                        .reset = reset,
                                        .step = step,
                                        .observe = observe,
                                        .info = info,
                                        .render = render,
                                        .expert = expert,
                                        .tip = tip,
                                        .place = place,
                                        .steer = steer,
                                        .state_size = state_size,
                                        .save = save,
                                        .restore = restore};
