// world_cloud.c: points on the tissue: the points of a depth picture without tools, fixed anatomy and far points.
//
// Points in capsules around a tool's shape (robot.h) are left out. The measured joints give the pose of the capsules,
// and a shift moves their tip to the measured tip: joints are exact, the position of the arm's base is not.
// Colour is not used here: wet tissue, tool and organ share white highlights. Scans use both (scan_picture.c).
#include <string.h>

#include "omentum/world_cloud.h"

#define CLOUD_COOKIE 0xc10d5eeu

OmCloudDef om_cloud_default_def(const OmWorld* world, const OmSite* site) {
    OmCloudDef def = {.cookie = CLOUD_COOKIE,
                      .site = site,
                      .clearance = 0.002,
                      .tool_margin = 0.002,
                      .reach = 0.06};
    for (int a = 0; world && a < OM_MAX_ARM; ++a) def.psm[a] = om_world_psm(world, a);
    return def;
}

static OmStatus check_def(const OmCloudDef* def) {
    OM_CHECK(def->cookie == CLOUD_COOKIE, OM_INVALID,
             "OmCloudDef was not made by om_cloud_default_def");
    OM_CHECK(def->site, OM_INVALID, "OmCloudDef.site is null");
    OM_CHECK(def->clearance >= 0 && isfinite(def->clearance), OM_INVALID,
             "OmCloudDef.clearance is %g m; 0 or more", def->clearance);
    OM_CHECK(def->tool_margin >= 0 && isfinite(def->tool_margin), OM_INVALID,
             "OmCloudDef.tool_margin is %g m; 0 or more", def->tool_margin);
    OM_CHECK(def->reach >= 0 && isfinite(def->reach), OM_INVALID,
             "OmCloudDef.reach is %g m; 0 or more", def->reach);
    return OM_OK;
}

OmStatus om_cloud_field_init(const OmCloudDef* def, const OmObservation* obs, OmScanField* field) {
    memset(field, 0, sizeof *field);
    OM_TRY(check_def(def));
    const OmSite* site = def->site;
    field->has_ground = site->has_ground;
    field->organ = site->has_organ ? &site->organ_sdf : NULL;
    field->clearance = def->clearance;
    field->tool_margin = def->tool_margin;
    field->pose_task_world = om_pose_inverse(site->pose_world_task);
    OmVec3 half = site->half_size;
    OmVec3 out = om_vec3(def->reach, def->reach, def->reach);
    field->lo = om_sub(om_vec3(-half.x, -half.y, 0), out);
    field->hi = om_add(om_vec3(half.x, half.y, 2 * half.z), out);
    field->has_every_tool = obs->narm > 0;
    for (int a = 0; a < obs->narm; ++a) {
        if (!def->psm[a]) field->has_every_tool = false;
        if (!def->psm[a]) continue;
        OmPsm psm = *def->psm[a];
        OmVec3 off = om_sub(obs->arm[a].tip.p, om_psm_forward(&psm, obs->arm[a].q).p);
        psm.pose_world_rcm.p = om_add(psm.pose_world_rcm.p, off);
        om_psm_capsules(&psm, obs->arm[a].q, obs->arm[a].jaw, &field->capsule[field->ncapsule]);
        field->ncapsule += OM_PSM_NCAPSULE;
    }
    return OM_OK;
}

OmStatus om_cloud_init(const OmCloudDef* def, const OmObservation* obs, OmCloud* cloud) {
    memset(cloud, 0, sizeof *cloud);
    OmScanField field;
    OM_TRY(om_cloud_field_init(def, obs, &field));
    OM_CHECK(obs->rgbd.depth, OM_INVALID, "the observation has no depth picture");
    const OmDepthPicture* picture = &obs->rgbd;
    size_t npixel = (size_t)picture->camera.width * (size_t)picture->camera.height;
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(cloud->x, 3 * npixel);
    OM_ALLOC_DONE(cloud->pixel, npixel);
    om_depth_to_cloud(&picture->camera, picture->depth, NULL, NULL, -1, cloud->x, NULL);
    // The points come in the order of pixels with depth; those on tissue move to the front.
    for (int i = 0, k = 0; i < (int)npixel; ++i) {
        float z = picture->depth[i];
        if (!(z > 0) || !isfinite(z)) continue;  // as om_depth_to_cloud
        OmVec3 p = om_load3(cloud->x, k++);
        if (om_scan_field_eval(&field, p) != OM_PLACE_FREE) continue;
        om_store3(cloud->x, cloud->n, p);
        cloud->pixel[cloud->n++] = i;
    }
    cloud->time = picture->time;
done:
    if (status < 0) om_cloud_done(cloud);
    return status;
}

void om_cloud_done(OmCloud* cloud) {
    if (!cloud) return;
    om_free(cloud->x);
    om_free(cloud->pixel);
    memset(cloud, 0, sizeof *cloud);
}

OmStatus om_scan_from_observation(const OmScanDef* def, const OmCloudDef* space,
                                  const OmObservation* obs, OmScan* scan) {
    memset(scan, 0, sizeof *scan);
    OmScanField field;
    OM_TRY(om_cloud_field_init(space, obs, &field));
    return om_scan_from_picture(def, &field, &obs->rgbd, scan);
}
