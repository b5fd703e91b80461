// world_motion.c: one step of a straight motion, the same in a simulated world and in one behind topics.
#include <math.h>

#include "omentum/world.h"

#define SAME_ANGLE 1e-9   // rad: below it an orientation is kept
#define SLACK (1 + 1e-9)  // a goal one step away is reached, also where rounding makes it longer

OmPose om_world_straight_step(OmPose from, OmPose goal, double speed, double dt, bool* is_there) {
    const OmVec3 way = om_sub(goal.p, from.p);
    const double left = om_norm(way), step = speed * dt, turn = OM_WORLD_MAX_TURN * dt;
    double angle = om_quat_angle(from.q, goal.q);
    if (angle < SAME_ANGLE) angle = 0;
    *is_there = left <= step && angle <= turn * SLACK;
    if (*is_there) return goal;
    OmPose next = goal;
    double part = left > step ? step / left : 1;  // of the distance that is left
    if (part * angle > turn) part = turn / angle;
    next.p = om_madd(from.p, part, way);
    if (angle > 0) next.q = om_quat_slerp(from.q, goal.q, part);
    return next;
}
