// scene_site_organ.c: the organ under the tissue as a body that deforms.
//
// Its mesh may be coarse: contact, pictures and the ROI take the organ's smooth surface, which rides on the mesh
// (shape_skin.h). What lies behind the organ is not in the scene: springs by area stand for it.
#include "omentum/shape_meshing.h"
#include "scene/scene_site.h"

#define MIN_PART 0.01  // of the elements: smaller pieces are left out
#define AWAY (-0.3)    // cosine of a normal against "up": the organ's far side, which is held

static OmStatus mesh_organ(double edge, OmSite* site) {
    OmVec3 lo, hi;
    om_sdf_bounds(&site->organ_sdf, &lo, &hi);
    OmStuffDef def = om_stuff_default_def(edge, om_sdf_shape_fn, &site->organ_sdf, lo, hi);
    OM_TRY(om_tet_mesh_stuff(&def, &site->soft));
    return om_tet_mesh_keep_parts(&site->soft, MIN_PART, NULL, NULL);
}

// Springs at the vertices of the far side, by the area of the triangles around them.
static OmStatus hold_far_side(double foundation, OmSite* site) {
    OmSurface surface = {0};
    int *vert = NULL, *list = NULL, n = 0;
    double* area = NULL;
    OmStatus status = OM_OK;
    OmVec3 up = om_quat_rotate(site->pose_world_task.q, om_vec3(0, 0, 1));
    OM_TRY_DONE(om_tet_mesh_boundary(&site->soft, &surface, &vert));
    OM_ALLOC_DONE(list, (size_t)surface.nvert);
    OM_CALLOC_DONE(area, (size_t)surface.nvert);
    OM_CALLOC_DONE(site->soft_spring, (size_t)surface.nvert);
    for (int t = 0; t < surface.ntri; ++t) {
        const int* v = surface.tri_vert + 3 * (size_t)t;
        OmVec3 a = om_load3(surface.x, v[0]);
        OmVec3 two =
            om_cross(om_sub(om_load3(surface.x, v[1]), a), om_sub(om_load3(surface.x, v[2]), a));
        if (om_dot(up, two) >= AWAY * om_norm(two)) continue;
        for (int k = 0; k < 3; ++k) area[v[k]] += om_norm(two) / 6;
    }
    for (int i = 0; i < surface.nvert; ++i) {
        if (area[i] == 0) continue;
        site->soft_spring[n] = foundation * area[i];
        list[n++] = vert[i];
    }
    OM_CHECK_DONE(n > 0, OM_INVALID, "no part of the organ looks away from the tissue");
    OM_TRY_DONE(om_tet_mesh_add_set(&site->soft, "attachment", list, n));
done:
    om_surface_done(&surface);
    om_free(vert);
    om_free(list);
    om_free(area);
    return status;
}

OmStatus om_site_mesh_organ(const OmScene* scene, OmSite* site) {
    const OmSceneOrgan* o = &scene->organ;
    if (!om_scene_has(o->deforms, site->role)) return OM_OK;
    OM_CHECK(site->has_organ, OM_INVALID, "%s: organ: no organ lies under the tissue",
             om_scene_label(scene));
    site->soft_material = (OmSiteMaterial){"organ", o->young, o->poisson, o->density};
    OmStatus status = mesh_organ(o->edge, site);
    if (status == OM_OK) status = hold_far_side(o->foundation, site);
    return status < 0 ? om_error_prefix(status, "%s: organ", om_scene_label(scene)) : status;
}
