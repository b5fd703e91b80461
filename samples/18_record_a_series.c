// 18_record_a_series.c: record what the depth camera sees while the robot lifts a sheet, and scan the tissue later.
//
// Written: series/series.yaml with times, poses and arms, and two PNG files a frame. Pictures of a real camera in a
// folder of the same form are read the same way.
#include <stdio.h>

#include "omentum/omentum.h"

#define NFRAME 4

static OmStatus wait_for(OmWorld* world, double time) {
    for (int i = 0; i < (int)(time / 0.02); ++i) OM_TRY(om_world_advance(world, 0.02));
    return OM_OK;
}

// Close the jaw on a free corner.
static OmStatus grasp_corner(OmWorld* world, const OmSite* site, OmPose* goal) {
    OmVec3 half = site->half_size;
    OmObservation obs = {0};
    OM_TRY(om_world_observe(world, 0, &obs));
    *goal = obs.arm[0].tip;
    om_observation_done(&obs);
    goal->p =
        om_pose_apply(site->pose_world_task, om_vec3(-0.8 * half.x, -0.8 * half.y, 2 * half.z));
    OM_TRY(om_world_move(world, 0, *goal, 0.1));
    OM_TRY(wait_for(world, 1.5));
    OM_TRY(om_world_set_jaw(world, 0, 0));
    return wait_for(world, 0.3);
}

// A frame at each 10 mm of the lift. The first observation gives the camera of the series.
static OmStatus record(OmWorld* world, const OmSite* site) {
    OmSeries series = {0};
    OmObservation obs = {0};
    OmPose goal;
    OmStatus status = grasp_corner(world, site, &goal);
    for (int i = 0; i < NFRAME && status == OM_OK; ++i) {
        status = om_world_observe(world, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR, &obs);
        if (status == OM_OK && i == 0)
            status = om_series_begin("series", &obs.rgbd.camera, NULL, &series);
        if (status == OM_OK) status = om_series_append(&series, &obs);
        goal.p = om_add(goal.p, om_vec3(0, 0, 0.01));
        if (status == OM_OK) status = om_world_move(world, 0, goal, 0.03);
        if (status == OM_OK) status = wait_for(world, 0.6);
    }
    om_observation_done(&obs);
    om_series_done(&series);
    return status;
}

static OmStatus scan_all(const OmWorld* world, const OmSite* twin) {
    OmSeries series;
    OmObservation obs = {0};
    OmScan scan = {0};
    const OmScanDef def = om_scan_default_def(om_site_spacing(twin));
    const OmCloudDef space = om_cloud_default_def(world, twin);
    OM_TRY(om_series_load("series", &series));
    OmStatus status = OM_OK;
    for (int i = 0; i < series.nframe; ++i) {
        OM_TRY_DONE(om_series_get_frame(&series, i, NULL, &obs));
        OM_TRY_DONE(om_scan_from_observation(&def, &space, &obs, &scan));
        double top = 0;
        for (int k = 0; k < scan.npoint; ++k) top = fmax(top, scan.x[3 * k + 2]);
        printf("%.2f s: %d points, %d triangles, the highest %.0f mm over the board\n",
               obs.rgbd.time, scan.npoint, scan.ntri, 1e3 * top);
        om_scan_done(&scan);
    }
done:
    om_scan_done(&scan);
    om_observation_done(&obs);
    om_series_done(&series);
    return status;
}

int main(void) {
    OmScene scene = om_scene_default();
    scene.attach.kind = OM_ATTACH_BOX;  // held on the far half
    scene.attach.lo = om_vec3(0, -1, -1);
    scene.attach.hi = om_vec3(1, 1, 1);
    // A calibrated depth camera: fx, fy, the principal point, and the distortion k1 k2 p1 p2 k3, as OpenCV gives them.
    scene.rgbd = (OmSceneCamera){.distance = 0.3,
                                 .elevation = 50 * OM_PI / 180,
                                 .width = 320,
                                 .height = 240,
                                 .focal = {305, 304},
                                 .center = {158.2, 121.7},
                                 .distortion = {-0.12, 0.03, 4e-4, -6e-4, 0}};
    OmSite site = {0}, twin = {0};
    OmWorld* world = NULL;
    OmStatus status = OM_OK;
    OM_TRY_DONE(om_path_remove("series"));  // of an earlier run
    OM_TRY_DONE(om_site_build(&scene, OM_SITE_WORLD, NULL, &site));
    OM_TRY_DONE(om_site_build(&scene, OM_SITE_TWIN, NULL, &twin));
    OM_TRY_DONE(om_world_create_simulated(&scene, &site, 0, &world));
    OM_TRY_DONE(record(world, &site));
    OM_TRY_DONE(scan_all(world, &twin));
done:
    if (status < 0) fprintf(stderr, "%s\n", om_error_message());
    om_world_destroy(world);
    om_site_done(&site);
    om_site_done(&twin);
    return status < 0;
}
