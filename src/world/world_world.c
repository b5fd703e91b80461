// world_world.c: what every kind of world shares: the table is called through here.
#include <string.h>

#include "omentum/world.h"

static OmStatus check_arm(int arm) {
    OM_CHECK(arm >= 0 && arm < OM_MAX_ARM, OM_INVALID, "arm is %d; 0 to %d", arm, OM_MAX_ARM - 1);
    return OM_OK;
}

OmStatus om_world_move(OmWorld* world, int arm, OmVec3 tip, double speed) {
    OM_TRY(check_arm(arm));
    OM_CHECK(om_is_finite3(tip), OM_INVALID, "goal of arm %d is not finite", arm);
    OM_CHECK(speed > 0 && isfinite(speed), OM_INVALID, "speed is %g m/s; must be positive", speed);
    return world->ops->move(world, arm, tip, speed);
}

OmStatus om_world_set_jaw(OmWorld* world, int arm, double angle) {
    OM_TRY(check_arm(arm));
    OM_CHECK(isfinite(angle), OM_INVALID, "jaw angle of arm %d is not finite", arm);
    return world->ops->set_jaw(world, arm, angle);
}

void om_world_stop(OmWorld* world, int arm) {
    if (check_arm(arm) == OM_OK) world->ops->stop(world, arm);
}

OmStatus om_world_advance(OmWorld* world, double dt) {
    OM_CHECK(dt > 0 && isfinite(dt), OM_INVALID, "time step is %g s; must be positive", dt);
    return world->ops->advance(world, dt);
}

OmStatus om_world_observe(OmWorld* world, unsigned what, OmObservation* observation) {
    return world->ops->observe(world, what, observation);
}

void om_world_destroy(OmWorld* world) {
    if (world) world->ops->destroy(world);
}

void om_observation_done(OmObservation* observation) {
    if (!observation) return;
    om_picture_done(&observation->image);
    om_free(observation->cloud);
    memset(observation, 0, sizeof *observation);
}
