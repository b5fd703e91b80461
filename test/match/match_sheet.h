// match_sheet.h: the sheet of the tests of room match, held on one side.
#ifndef OMENTUM_MATCH_SHEET_H
#define OMENTUM_MATCH_SHEET_H

#include "test_common.h"

#include "linear_sheet.h"
#include "omentum/scene.h"
#include "omentum/sense.h"

// A sheet of n x n x 1 cells; its underside is attached where x is below -20 mm.
static inline void build_sheet(int n, OmScene* scene, OmSite* site) {
    *scene = linear_sheet();
    scene->tissue.cells = om_vec3(n, n, 1);
    scene->attach = (OmSceneAttach){
        .kind = OM_ATTACH_BOX, .lo = {-1, -1, -1}, .hi = {-0.02, 1, 1}, .share_max = 0.5};
    scene->roi.is_random = false;
    scene->roi.center = om_vec3(0.03, 0, 0);
    assert_ok(om_site_build(scene, OM_SITE_TWIN, NULL, site));
}

// A camera that looks at the origin.
static inline OmCamera camera_at(OmVec3 eye) {
    OmPose pose = om_pose_look_at(eye, om_vec3(0, 0, 0), om_vec3(0, 1, 0));
    return (OmCamera){.pose_world_camera = pose,
                      .width = 320,
                      .height = 240,
                      .fov = 0.6,
                      .near_m = 0.01,
                      .far_m = 2};
}

#endif
