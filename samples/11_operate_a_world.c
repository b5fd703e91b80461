// 11_operate_a_world.c: a robot arm in a simulated operating field lifts a corner of tissue, seen through sensors only.
//
// A world is known by commands (move, jaw, stop) and observations (tool, jaw, picture, visibility). A real robot
// fills the same table of functions (OmWorldOps), so this program would drive it, too. Writes 11_operate_a_world.png.
#include <stdio.h>

#include "omentum/omentum.h"

#define TIME_STEP 0.02  // s
#define SPEED 0.03      // m/s

static OmStatus observe(OmWorld* world, unsigned what, OmObservation* seen) {
    om_observation_done(seen);
    return om_world_observe(world, what, seen);
}

// Go to p, orientation kept, and wait; the message says which joint forbids it, if one does.
static OmStatus go_to(OmWorld* world, OmVec3 p, OmObservation* seen) {
    OmPose goal = {p, seen->arm[0].tip.q};
    OmStatus status = om_world_move(world, 0, goal, SPEED);
    do {
        if (status >= 0) status = om_world_advance(world, TIME_STEP);
        if (status >= 0) status = observe(world, 0, seen);
    } while (status >= 0 && seen->arm[0].is_moving);
    return status;
}

static OmStatus set_jaw(OmWorld* world, double angle) {
    OmStatus status = om_world_set_jaw(world, 0, angle);
    for (int i = 0; i < 20 && status >= 0; ++i) status = om_world_advance(world, TIME_STEP);
    return status;
}

// Places are given in the frame of the task: z up, the origin under the middle of the tissue.
static OmStatus operate(OmWorld* world, const OmSite* site, OmObservation* seen) {
    const OmVec3 h = site->half_size;
    const OmVec3 corner = om_vec3(-0.8 * h.x, -0.8 * h.y, 2 * h.z);
    const OmVec3 way[] = {om_add(corner, om_vec3(0, 0, 0.02)), corner};
    const OmVec3 lifted = om_add(corner, om_vec3(0.05, 0.05, 0.04));
    OmStatus status = om_world_reset(world);        // tissue at rest
    if (status >= 0) status = set_jaw(world, 0.7);  // open
    if (status >= 0) status = observe(world, 0, seen);
    for (int i = 0; i < 2 && status >= 0; ++i)
        status = go_to(world, om_pose_apply(site->pose_world_task, way[i]), seen);
    if (status >= 0) status = set_jaw(world, 0);  // closes on the tissue at the tip
    if (status >= 0) status = observe(world, OM_OBSERVE_VISIBILITY, seen);
    if (status < 0) return status;
    printf("%.1f s: jaw closed, tissue %s, %.0f %% of the region of interest seen\n", seen->time,
           om_arm_is_holding(&seen->arm[0]) ? "held" : "not held", 100 * seen->visibility);
    status = go_to(world, om_pose_apply(site->pose_world_task, lifted), seen);
    if (status >= 0)
        status = observe(world, OM_OBSERVE_VISIBILITY | OM_OBSERVE_IMAGE | OM_OBSERVE_DEPTH, seen);
    if (status < 0) return status;
    // No pixel says what it shows: tools and still anatomy, which the robot knows, are left out.
    OmCloudDef def = om_cloud_default_def(world, site);
    OmCloud cloud;
    status = om_cloud_init(&def, seen, &cloud);
    if (status < 0) return status;
    printf("%.1f s: lifted and folded, %.0f %% seen, %d points on the tissue by the depth camera\n",
           seen->time, 100 * seen->visibility, cloud.n);
    om_cloud_done(&cloud);
    return om_picture_save_png(&seen->endoscope.color, "11_operate_a_world.png");
}

int main(void) {
    OmScene scene = om_scene_default();
    scene.roi.is_random = false;
    scene.roi.center = om_vec3(-0.025, -0.025, 0);  // near the corner, on the board
    scene.tissue.cells = om_vec3(8, 8, 1);          // smaller than by default: some seconds
    OmSite site = {0};
    OmWorld* world = NULL;
    OmObservation seen = {0};
    OmStatus status = om_site_build(&scene, OM_SITE_WORLD, NULL, &site);
    if (status == OM_OK) status = om_world_create_simulated(&scene, &site, 0, &world);
    if (status == OM_OK) status = operate(world, &site, &seen);
    if (status < 0) fprintf(stderr, "%s\n", om_error_message());
    bool is_exposed = om_arm_is_holding(&seen.arm[0]) && seen.visibility > 0.8;
    om_observation_done(&seen);
    om_world_destroy(world);
    om_site_done(&site);
    return status >= 0 && is_exposed ? 0 : 1;
}
