// 16_scan_the_tissue.c: from the pictures of a depth camera to a surface of the tissue, and to a file.
//
// The robot lifts a corner of a sheet, and its depth camera takes a picture. A click on the tissue teaches its colours.
// Written: scan.ply (points, normals, triangles), and scan.png: the picture, and what every pixel shows.
#include <stdio.h>
#include <string.h>

#include "omentum/omentum.h"

// Close the jaw on a free corner and lift it.
static OmStatus lift_corner(OmWorld* world, const OmSite* site) {
    OmVec3 half = site->half_size;
    OmObservation obs = {0};
    OM_TRY(om_world_observe(world, 0, &obs));
    OmPose goal = obs.arm[0].tip;
    om_observation_done(&obs);
    goal.p =
        om_pose_apply(site->pose_world_task, om_vec3(-0.8 * half.x, -0.8 * half.y, 2 * half.z));
    OM_TRY(om_world_move(world, 0, goal, 0.1));
    for (int i = 0; i < 75; ++i) OM_TRY(om_world_advance(world, 0.02));
    OM_TRY(om_world_set_jaw(world, 0, 0));
    for (int i = 0; i < 15; ++i) OM_TRY(om_world_advance(world, 0.02));
    goal.p = om_pose_apply(site->pose_world_task, om_vec3(-0.3 * half.x, -0.4 * half.y, 0.045));
    OM_TRY(om_world_move(world, 0, goal, 0.03));
    for (int i = 0; i < 75; ++i) OM_TRY(om_world_advance(world, 0.02));
    return OM_OK;
}

// The colour picture beside its classes: tissue orange, tools blue, other things green, unknown black.
static OmStatus save_picture(const OmPicture* color, const OmScan* scan, const char* path) {
    static const unsigned char shade[4][3] = {
        {0, 0, 0}, {235, 160, 60}, {80, 130, 220}, {40, 90, 80}};
    OmPicture both;
    OM_TRY(om_picture_init(&both, 2 * color->width, color->height, 3));
    for (int i = 0; i < color->width * color->height; ++i) {
        unsigned char* left = both.pixel + 3 * (i + i / color->width * color->width);
        memcpy(left, color->pixel + 3 * i, 3);
        memcpy(left + 3 * color->width, shade[scan->pixel[i]], 3);
    }
    OmStatus status = om_picture_save_png(&both, path);
    om_picture_done(&both);
    return status;
}

static OmStatus scan_tissue(OmWorld* world, const OmSite* twin, const OmObservation* obs,
                            OmScan* scan) {
    // A click on the middle of the sheet.
    OmScanDef def = om_scan_default_def(om_site_spacing(twin));
    const OmCloudDef space = om_cloud_default_def(world, twin);
    double u, v;
    OmVec3 middle = om_pose_apply(twin->pose_world_task, om_vec3(0, 0, 2 * twin->half_size.z));
    if (!om_camera_project(&obs->rgbd.camera, middle, &u, &v))
        return om_error(OM_INVALID, "the sheet is not in the picture");
    const OmScanRegion click = {.u = u, .v = v, .radius = 10};
    OM_TRY(om_scan_learn_range(&obs->rgbd.color, &click, &def.tissue));
    printf("hue of the tissue: %.0f to %.0f degrees\n", def.tissue.hue_min, def.tissue.hue_max);
    return om_scan_from_observation(&def, &space, obs, scan);
}

int main(void) {
    OmScene scene = om_scene_default();
    scene.attach.kind = OM_ATTACH_BOX;  // held on the far half
    scene.attach.lo = om_vec3(0, -1, -1);
    scene.attach.hi = om_vec3(1, 1, 1);
    OmSite site = {0}, twin = {0};
    OmWorld* world = NULL;
    OmObservation obs = {0};
    OmScan scan = {0}, back = {0};
    OmSurface model = {0};
    OmScanFileDef file = om_scan_file_default_def();
    OmStatus status = OM_OK;
    OM_TRY_DONE(om_site_build(&scene, OM_SITE_WORLD, NULL, &site));
    OM_TRY_DONE(om_site_build(&scene, OM_SITE_TWIN, NULL, &twin));
    OM_TRY_DONE(om_world_create_simulated(&scene, &site, 0, &world));
    OM_TRY_DONE(lift_corner(world, &site));
    OM_TRY_DONE(om_world_observe(world, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR, &obs));
    OM_TRY_DONE(scan_tissue(world, &twin, &obs, &scan));
    printf("%d points, %d triangles, %.2f mm of noise\n", scan.npoint, scan.ntri, 1e3 * scan.noise);

    // A file keeps the scan. Before a scan is used, check that it can show the model.
    OM_TRY_DONE(om_scan_save(&scan, "scan.ply", (OmMeshFrame){OM_UNIT_MM, OM_SPACE_RAS}));
    OM_TRY_DONE(save_picture(&obs.rgbd.color, &scan, "scan.png"));
    OM_TRY_DONE(om_scan_load("scan.ply", &file, &back, NULL));
    OM_TRY_DONE(om_tet_mesh_boundary(&twin.mesh, &model, NULL));
    OM_TRY_DONE(om_scan_check_model(&back, &model, 0.05, NULL));
    printf("scan.ply fits the model\n");
done:
    if (status < 0) fprintf(stderr, "%s\n", om_error_message());
    om_scan_done(&scan);
    om_scan_done(&back);
    om_surface_done(&model);
    om_observation_done(&obs);
    om_world_destroy(world);
    om_site_done(&site);
    om_site_done(&twin);
    return status < 0;
}
