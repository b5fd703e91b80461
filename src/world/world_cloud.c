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

OmStatus om_cloud_field_init(const OmCloudDef* def, const OmObservation* obs, OmCloudField* field) {
    memset(field, 0, sizeof *field);
    OM_TRY(check_def(def));
    field->def = *def;
    field->pose_task_world = om_pose_inverse(def->site->pose_world_task);
    OmVec3 half = def->site->half_size;
    OmVec3 out = om_vec3(def->reach, def->reach, def->reach);
    field->lo = om_sub(om_vec3(-half.x, -half.y, 0), out);
    field->hi = om_add(om_vec3(half.x, half.y, 2 * half.z), out);
    for (int a = 0; a < obs->narm; ++a) {
        if (!def->psm[a]) continue;
        OmPsm psm = *def->psm[a];
        OmVec3 off = om_sub(obs->arm[a].tip.p, om_psm_forward(&psm, obs->arm[a].q).p);
        psm.pose_world_rcm.p = om_add(psm.pose_world_rcm.p, off);
        om_psm_capsules(&psm, obs->arm[a].q, obs->arm[a].jaw, &field->capsule[field->ncapsule]);
        field->ncapsule += OM_PSM_NCAPSULE;
    }
    return OM_OK;
}

static bool is_on_tool(const OmCloudField* f, OmVec3 p) {
    for (int k = 0; k < f->ncapsule; ++k) {
        const OmPsmCapsule* c = &f->capsule[k];
        OmVec3 axis = om_sub(c->b, c->a), from = om_sub(p, c->a);
        double length2 = om_norm2(axis);  // > 0: a jaw or shaft has a length
        double t = fmax(0, fmin(1, om_dot(from, axis) / length2));
        double reach = c->radius + f->def.tool_margin;
        if (om_norm2(om_sub(from, om_scale(t, axis))) < reach * reach) return true;
    }
    return false;
}

OmCloudPlace om_cloud_field_eval(const OmCloudField* f, OmVec3 p) {
    const OmSite* site = f->def.site;
    if (is_on_tool(f, p)) return OM_PLACE_TOOL;
    OmVec3 at = om_pose_apply(f->pose_task_world, p);
    if (at.x < f->lo.x || at.y < f->lo.y || at.z < f->lo.z) return OM_PLACE_FAR;
    if (at.x > f->hi.x || at.y > f->hi.y || at.z > f->hi.z) return OM_PLACE_FAR;
    double clearance = f->def.clearance;
    if (site->has_ground && at.z < clearance) return OM_PLACE_FIXED;
    if (site->has_organ && om_sdf_eval(&site->organ_sdf, p, NULL) < clearance)
        return OM_PLACE_FIXED;
    return OM_PLACE_FREE;
}

OmStatus om_cloud_init(const OmCloudDef* def, const OmObservation* obs, OmCloud* cloud) {
    memset(cloud, 0, sizeof *cloud);
    OmCloudField field;
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
        if (om_cloud_field_eval(&field, p) != OM_PLACE_FREE) continue;
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
