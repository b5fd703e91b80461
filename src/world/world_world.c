// world_world.c: the public functions of every kind of world: they check arguments and call the table.
#include <string.h>

#include "omentum/world.h"

#define JAW_EMPTY (3.0 * OM_PI / 180.0)  // rad: a jaw that rests below it is empty
#define JAW_STILL 0.05                   // rad/s: slower is at rest

static OmStatus check_arm(const OmWorld* world, int arm) {
    OM_CHECK(arm >= 0 && arm < world->narm, OM_INVALID, "arm is %d; this world has %d", arm,
             world->narm);
    return OM_OK;
}

bool om_arm_is_holding(const OmArmObservation* arm) {
    bool is_commanded = arm->jaw_goal < JAW_EMPTY;
    return is_commanded && arm->jaw > JAW_EMPTY && fabs(arm->jaw_speed) < JAW_STILL;
}

bool om_arm_is_empty(const OmArmObservation* arm) {
    bool is_commanded = arm->jaw_goal < JAW_EMPTY;
    return is_commanded && arm->jaw <= JAW_EMPTY && fabs(arm->jaw_speed) < JAW_STILL;
}

int om_world_narm(const OmWorld* world) { return world->narm; }
unsigned om_world_sources(const OmWorld* world) { return world->sources; }
const OmPsm* om_world_psm(const OmWorld* world, int arm) {
    return arm >= 0 && arm < world->narm ? world->psm[arm] : NULL;
}

OmStatus om_world_move(OmWorld* world, int arm, OmPose goal, double speed) {
    OM_TRY(check_arm(world, arm));
    OM_CHECK(om_is_finite3(goal.p), OM_INVALID, "goal of arm %d is not finite", arm);
    double norm =
        sqrt(goal.q.x * goal.q.x + goal.q.y * goal.q.y + goal.q.z * goal.q.z + goal.q.w * goal.q.w);
    OM_CHECK(fabs(norm - 1) < 1e-6, OM_INVALID,
             "goal of arm %d: its quaternion has length %g; must be 1", arm, norm);
    OM_CHECK(speed > 0 && isfinite(speed), OM_INVALID, "speed is %g m/s; must be positive", speed);
    return world->ops->move(world, arm, goal, speed);
}

OmStatus om_world_set_jaw(OmWorld* world, int arm, double angle) {
    OM_TRY(check_arm(world, arm));
    OM_CHECK(isfinite(angle), OM_INVALID, "jaw angle of arm %d is not finite", arm);
    return world->ops->set_jaw(world, arm, angle);
}

void om_world_stop(OmWorld* world, int arm) {
    if (check_arm(world, arm) == OM_OK) world->ops->stop(world, arm);
}

OmStatus om_world_advance(OmWorld* world, double dt) {
    OM_CHECK(dt > 0 && isfinite(dt), OM_INVALID, "time step is %g s; must be positive", dt);
    return world->ops->advance(world, dt);
}

OmStatus om_world_observe(OmWorld* world, unsigned what, OmObservation* observation) {
    static const char* const name[] = {"visibility", "endoscope", "depth", "depth camera's colour",
                                       "window of the endoscope"};
    const unsigned known = OM_OBSERVE_VISIBILITY | OM_OBSERVE_IMAGE | OM_OBSERVE_DEPTH |
                           OM_OBSERVE_COLOR | OM_OBSERVE_WINDOW;
    OM_CHECK(!(what & ~known), OM_INVALID, "no source has the flags 0x%x; known are 0x%x",
             what & ~known, known);
    for (int k = 0; k < 5; ++k) {
        bool is_missing = what & ~world->sources & (1u << k);
        OM_CHECK(!is_missing, OM_UNAVAILABLE, "this world has no source \"%s\"", name[k]);
    }
    return world->ops->observe(world, what, observation);
}

void om_world_set_window(OmWorld* world, OmWindow window) {
    if (world->ops->set_window) world->ops->set_window(world, window);
}

OmStatus om_world_reset(OmWorld* world) {
    OM_CHECK(world->ops->reset, OM_UNAVAILABLE, "this world cannot reset itself");
    return world->ops->reset(world);
}

// ---- snapshots ----------------------------------------------------------------------------------------------

static OmStatus check_snapshots(const OmWorld* world) {
    bool has_all = world->ops->state_size && world->ops->save && world->ops->restore;
    OM_CHECK(has_all, OM_UNAVAILABLE, "this world has no snapshots");
    return OM_OK;
}

size_t om_world_state_size(const OmWorld* world) {
    return check_snapshots(world) == OM_OK ? world->ops->state_size(world) : 0;
}

OmStatus om_world_save(const OmWorld* world, void* block) {
    OM_TRY(check_snapshots(world));
    world->ops->save(world, block);
    return OM_OK;
}

OmStatus om_world_restore(OmWorld* world, const void* block) {
    OM_TRY(check_snapshots(world));
    world->ops->restore(world, block);
    return OM_OK;
}

// ---- ends ---------------------------------------------------------------------------------------------------

void om_world_destroy(OmWorld* world) {
    if (world) world->ops->destroy(world);
}

void om_observation_done(OmObservation* observation) {
    if (!observation) return;
    om_picture_done(&observation->endoscope.color);
    om_picture_done(&observation->rgbd.color);
    om_free(observation->rgbd.depth);
    memset(observation, 0, sizeof *observation);
}
