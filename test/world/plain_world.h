// plain_world.h: a world without truth, cameras, joints, reset and snapshots: another kind than the simulated one.
//
// Tips are points that go straight to their goals. Tissue is a box at rest in the task frame: jaws that close inside it
// hold it, and what they hold uncovers the ROI in proportion to the distance from where it was grasped. All of it is
// known in closed form.
//
//     PlainWorld plain;
//     plain_world_init(&plain, &site, 2);
//     om_world_move(&plain.head, 0, goal, 0.02);
#ifndef OMENTUM_PLAIN_WORLD_H
#define OMENTUM_PLAIN_WORLD_H

#include <math.h>
#include <string.h>

#include "omentum/world.h"

#define PLAIN_JAW_SPEED 3.0                     // rad/s
#define PLAIN_JAW_GRASP (20.0 * OM_PI / 180.0)  // rad: tissue is held below it
#define PLAIN_JAW_TISSUE (5.0 * OM_PI / 180.0)  // rad: tissue stops the jaw here
#define PLAIN_JAW_START (40.0 * OM_PI / 180.0)  // rad
#define PLAIN_REACH 0.25                        // m, of a tip from the origin of the task
#define PLAIN_HIDDEN 0.01                       // m that held tissue moves before the ROI shows
#define PLAIN_OPEN 0.04                         // m from where on all of it is seen

typedef struct PlainArm {
    OmPose tip, goal;
    double speed, jaw, jaw_goal, jaw_speed;
    OmVec3 grasp;  // where it closed, world frame
    bool is_moving, is_holding;
} PlainArm;

typedef struct PlainWorld {
    OmWorld head;
    OmPose pose_task_world;
    OmVec3 half_size;
    PlainArm arm[OM_MAX_ARM];
    double time;
} PlainWorld;

static inline void plain_destroy(OmWorld* world) { (void)world; }

static inline OmStatus plain_move(OmWorld* world, int arm, OmPose goal, double speed) {
    PlainWorld* w = (PlainWorld*)world;
    double distance = om_norm(om_pose_apply(w->pose_task_world, goal.p));
    OM_CHECK(distance < PLAIN_REACH, OM_INVALID, "arm %d cannot reach %.0f mm", arm,
             1e3 * distance);
    PlainArm* a = &w->arm[arm];
    a->goal = goal, a->speed = speed, a->is_moving = true;
    return OM_OK;
}

static inline OmStatus plain_set_jaw(OmWorld* world, int arm, double angle) {
    ((PlainWorld*)world)->arm[arm].jaw_goal = angle;
    return OM_OK;
}

static inline void plain_stop(OmWorld* world, int arm) {
    ((PlainWorld*)world)->arm[arm].is_moving = false;
}

static inline bool plain_is_in_tissue(const PlainWorld* w, OmVec3 p_world) {
    OmVec3 p = om_pose_apply(w->pose_task_world, p_world), h = w->half_size;
    return fabs(p.x) <= h.x && fabs(p.y) <= h.y && p.z >= -0.001 && p.z <= 2 * h.z + 0.003;
}

static inline void plain_advance_arm(PlainWorld* w, PlainArm* a, double dt) {
    if (a->is_moving) {
        OmVec3 way = om_sub(a->goal.p, a->tip.p);
        double left = om_norm(way), step = a->speed * dt;
        a->is_moving = left > step;
        if (a->is_moving)
            a->tip.p = om_madd(a->tip.p, step / left, way);
        else
            a->tip = a->goal;
    }
    double before = a->jaw, limit = PLAIN_JAW_SPEED * dt;
    a->jaw += fmax(-limit, fmin(limit, a->jaw_goal - before));
    bool is_closed = a->jaw < PLAIN_JAW_GRASP;
    if (is_closed && before >= PLAIN_JAW_GRASP && plain_is_in_tissue(w, a->tip.p)) {
        a->is_holding = true;
        a->grasp = a->tip.p;
    }
    if (!is_closed) a->is_holding = false;
    a->jaw = fmax(a->jaw, a->is_holding ? PLAIN_JAW_TISSUE : 0);
    a->jaw_speed = (a->jaw - before) / dt;
}

static inline OmStatus plain_advance(OmWorld* world, double dt) {
    PlainWorld* w = (PlainWorld*)world;
    for (int a = 0; a < world->narm; ++a) plain_advance_arm(w, &w->arm[a], dt);
    w->time += dt;
    return OM_OK;
}

static inline double plain_visibility(const PlainWorld* w) {
    double share = 0;
    for (int a = 0; a < w->head.narm; ++a) {
        const PlainArm* arm = &w->arm[a];
        double moved = arm->is_holding ? om_distance(arm->tip.p, arm->grasp) : 0;
        share = fmax(share, (moved - PLAIN_HIDDEN) / (PLAIN_OPEN - PLAIN_HIDDEN));
    }
    return fmin(1, share);
}

static inline OmStatus plain_observe(OmWorld* world, unsigned what, OmObservation* obs) {
    PlainWorld* w = (PlainWorld*)world;
    om_observation_done(obs);
    obs->time = w->time;
    obs->narm = world->narm;
    for (int a = 0; a < world->narm; ++a) {
        const PlainArm* arm = &w->arm[a];
        obs->arm[a] = (OmArmObservation){.time = w->time,
                                         .tip = arm->tip,
                                         .jaw = arm->jaw,
                                         .jaw_speed = arm->jaw_speed,
                                         .jaw_goal = arm->jaw_goal,
                                         .is_moving = arm->is_moving};
    }
    if (what & OM_OBSERVE_VISIBILITY) {
        obs->endoscope.time = w->time;
        obs->visibility = plain_visibility(w);
    }
    return OM_OK;
}

/// Arms wait 70 mm above the long sides of the site's tissue, jaws open.
static inline void plain_world_init(PlainWorld* w, const OmSite* site, int narm) {
    static const OmWorldOps ops = {.destroy = plain_destroy,
                                   .move = plain_move,
                                   .set_jaw = plain_set_jaw,
                                   .stop = plain_stop,
                                   .advance = plain_advance,
                                   .observe = plain_observe};
    memset(w, 0, sizeof *w);
    w->head = (OmWorld){.ops = &ops, .narm = narm, .sources = OM_OBSERVE_VISIBILITY};
    w->pose_task_world = om_pose_inverse(site->pose_world_task);
    w->half_size = site->half_size;
    for (int a = 0; a < narm; ++a) {
        OmVec3 park = om_vec3(0, (a == 0 ? -1 : 1) * site->half_size.y, 0.07);
        w->arm[a].tip = om_pose_mul(site->pose_world_task, (OmPose){park, om_quat_identity()});
        w->arm[a].jaw = w->arm[a].jaw_goal = PLAIN_JAW_START;
    }
}

/// Make a simulated world look like a real one: the same field behind a table of its own, so that nothing finds its
/// truth or its tools, and without reset and snapshots. `table` is borrowed until the world is destroyed.
static inline void hide_truth(OmWorld* world, OmWorldOps* table) {
    *table = *world->ops;
    table->reset = NULL;
    table->state_size = NULL;
    table->save = NULL;
    table->restore = NULL;
    world->ops = table;
}

#endif
