// scene_site_belief.c: a twin whose region of interest lies beside the true one, and whose whole site is moved.
//
// On a board the region moves in the board's plane. On an organ each of its points moves along the organ: the shift,
// then back along the gradient of the distance field to the distance it had. The registration moves everything that
// was registered from pictures taken before the operation. Gravity turns with it: a robot knows the board or the
// patient to lie as planned. Were gravity kept, tissue without friction would slide down a board that is tilted by 1
// degree, in the twin alone.
#include "scene/scene_site.h"

#define MARGIN 0.02  // m, of the organ's distance field, as in scene_site_source.c
#define PROJECTIONS 3

// ---- the region of interest -----------------------------------------------------------------------------------

// A point of the ROI after the shift; `normal` may be null.
static OmVec3 shift_point(const OmSite* site, OmVec3 shift, OmVec3 p, OmVec3* normal) {
    OmVec3 q = om_add(p, shift), gradient;
    if (!site->has_organ) return q;
    double wanted = om_sdf_eval(&site->organ_sdf, p, NULL);
    for (int k = 0; k < PROJECTIONS; ++k) {
        double off = om_sdf_eval(&site->organ_sdf, q, &gradient) - wanted;
        double steep = om_norm(gradient);
        if (steep < 0.1) break;  // deep inside: no direction
        q = om_madd(q, -off / (steep * steep), gradient);
        if (normal) *normal = om_scale(1 / steep, gradient);
    }
    return q;
}

OmStatus om__site_shift_roi(const OmScene* scene, OmSite* site) {
    OmVec3 s = scene->believed_roi.shift;
    if (s.x == 0 && s.y == 0) return OM_OK;
    OmVec3 shift = om_quat_rotate(site->pose_world_task.q, om_vec3(s.x, s.y, 0));
    OmVec3 center = shift_point(site, shift, site->roi_center, NULL);
    OmVec3 c = om_pose_apply(om_pose_inverse(site->pose_world_task), center);
    OM_CHECK(fabs(c.x) <= site->half_size.x && fabs(c.y) <= site->half_size.y, OM_INVALID,
             "%s: believed_roi: shift_mm (%g, %g) leads to (%.0f, %.0f) mm, which is not under the "
             "tissue; it reaches %.0f and %.0f mm",
             om_scene_label(scene), 1e3 * s.x, 1e3 * s.y, 1e3 * c.x, 1e3 * c.y,
             1e3 * site->half_size.x, 1e3 * site->half_size.y);
    for (int i = 0; i < site->nroi; ++i) {
        OmVec3 n = om_load3(site->roi_n, i);
        om_store3(site->roi_x, i, shift_point(site, shift, om_load3(site->roi_x, i), &n));
        om_store3(site->roi_n, i, n);
    }
    for (int v = 0; v < site->roi.nvert; ++v)
        om_store3(site->roi.x, v, shift_point(site, shift, om_load3(site->roi.x, v), NULL));
    site->roi_center = center;
    return OM_OK;
}

// ---- registration -----------------------------------------------------------------------------------------------

static void move_points(OmPose motion, int n, double* x) {
    for (int i = 0; i < n; ++i) om_store3(x, i, om_pose_apply(motion, om_load3(x, i)));
}

OmStatus om_site_move(const OmScene* scene, OmSite* site, OmPose motion) {
    site->pose_world_task = om_pose_mul(motion, site->pose_world_task);
    move_points(motion, site->mesh.nvert, site->mesh.x);
    move_points(motion, site->roi.nvert, site->roi.x);
    move_points(motion, site->nroi, site->roi_x);
    move_points((OmPose){.q = motion.q}, site->nroi, site->roi_n);
    site->roi_center = om_pose_apply(motion, site->roi_center);
    site->gravity = om_quat_rotate(motion.q, site->gravity);
    if (!site->has_organ) return OM_OK;
    move_points(motion, site->organ.nvert, site->organ.x);
    OmSdfDef def = om_sdf_default_def(site->organ_sdf.grid.spacing);
    def.margin = MARGIN;
    om_sdf_done(&site->organ_sdf);
    OM_TRY(om_sdf_from_surface(&site->organ, &def, &site->organ_sdf));
    if (site->soft.nvert == 0) return OM_OK;
    om_tet_mesh_done(&site->soft);
    om_free(site->soft_spring);
    site->soft_spring = NULL;
    return om_site_mesh_organ(scene, site);
}

OmStatus om__site_register(const OmScene* scene, OmSite* site) {
    const OmSceneRegistration* r = &scene->registration;
    double angle = om_norm(r->turn);
    if (angle == 0 && om_norm(r->shift) == 0) return OM_OK;
    OmQuat turn =
        angle > 0 ? om_quat_axis_angle(om_scale(1 / angle, r->turn), angle) : om_quat_identity();
    OmPose task = om_pose_mul(site->pose_world_task, (OmPose){r->shift, turn});
    return om_site_move(scene, site, om_pose_mul(task, om_pose_inverse(site->pose_world_task)));
}
