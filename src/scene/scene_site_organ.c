// scene_site_organ.c: the organ under the tissue as a body that deforms.
//
// Its mesh may be coarse: contact, pictures and the ROI take the organ's smooth surface, which rides on the mesh
// (shape_skin.h). What lies behind the organ is not in the scene: springs by area stand for it.
#include "omentum/shape_closest.h"
#include "omentum/shape_meshing.h"
#include "scene/scene_site.h"

#define MIN_PART 0.01  // of the elements: smaller pieces are left out
#define LOST 0.5       // of an edge: a place of the surface farther from the mesh is warned of
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
    site->soft_foundation = foundation;
done:
    om_surface_done(&surface);
    om_free(vert);
    om_free(list);
    om_free(area);
    return status;
}

static OmStatus tree_of(const OmTetMesh* mesh, OmSurfaceTree** tree) {
    OmSurface surface;
    *tree = NULL;
    OM_TRY(om_tet_mesh_boundary(mesh, &surface, NULL));
    OmStatus status = om_surface_tree_create(&surface, tree);
    om_surface_done(&surface);
    return status;
}

// The surface of the organ under the tissue where the organ's mesh does not reach: no contact is felt there.
static OmStatus warn_of_loss(const OmScene* scene, const OmSite* site) {
    const double edge = scene->organ.edge;
    OmSurfaceTree *organ = NULL, *tissue = NULL;
    OmStatus status = OM_OK;
    double farthest = 0;
    OmVec3 at = {0, 0, 0};
    OM_TRY_DONE(tree_of(&site->soft, &organ));
    OM_TRY_DONE(tree_of(&site->mesh, &tissue));
    for (int i = 0; i < site->organ.nvert; ++i) {
        OmSurfacePoint q;
        OmVec3 p = om_load3(site->organ.x, i);
        if (!om_surface_tree_find(tissue, p, NULL, edge, NULL)) continue;
        if (!om_surface_tree_find(organ, p, NULL, INFINITY, &q) || q.distance <= farthest) continue;
        farthest = q.distance;
        at = p;
    }
    if (farthest > LOST * edge)
        om_log(OM_LOG_WARNING,
               "%s: organ: under the tissue its mesh does not reach (%.1f, %.1f, %.1f) mm, %.1f mm "
               "away, where the tissue is not felt; a smaller organ: edge_mm reaches further",
               om_scene_label(scene), 1e3 * at.x, 1e3 * at.y, 1e3 * at.z, 1e3 * farthest);
done:
    om_surface_tree_destroy(organ);
    om_surface_tree_destroy(tissue);
    return status;
}

void om__site_set_organ(const OmScene* scene, OmSite* site) {
    const OmSceneOrgan* o = &scene->organ;
    const OmMeshSet* held = om_tet_mesh_find_set(&site->soft, "attachment");
    site->soft_material = (OmSiteMaterial){"organ", o->young, o->poisson, o->density};
    for (int k = 0; held && k < held->nvert; ++k)
        site->soft_spring[k] *= o->foundation / site->soft_foundation;
    site->soft_foundation = o->foundation;
}

OmStatus om_site_mesh_organ(const OmScene* scene, OmSite* site) {
    const OmSceneOrgan* o = &scene->organ;
    if (!om_scene_has(o->deforms, site->role)) return OM_OK;
    OM_CHECK(site->has_organ, OM_INVALID, "%s: organ: no organ lies under the tissue",
             om_scene_label(scene));
    OmStatus status = mesh_organ(o->edge, site);
    if (status == OM_OK) status = hold_far_side(o->foundation, site);
    if (status == OM_OK) status = warn_of_loss(scene, site);
    om__site_set_organ(scene, site);
    return status < 0 ? om_error_prefix(status, "%s: organ", om_scene_label(scene)) : status;
}
