// scene_site_attach.c: attachments of the tissue, in truth and as the twin believes; stiffness by area.
//
// The truth is defined on the twin's mesh. The world's mesh takes it over by nearest vertex, and the twin's own set
// "attachment" becomes the believed one where the scene has another belief. An elastic foundation of modulus k (N/m^3)
// gives every attached vertex a spring of k times its share of the attached area; the shares of both meshes are scaled
// to the area of the truth on the twin's mesh, so that both have the same total stiffness.
#include <string.h>

#include "omentum/scene_vary.h"
#include "omentum/shape_meshing.h"
#include "scene/scene_site.h"

#define MIN_SPRING \
    1e-6  // N/m, where a vertex has no share of the area: next to nothing, but not held still

// ---- the truth ---------------------------------------------------------------------------------------------

// The vertices of a patch of the mesh, drawn among the n of `from`; the caller frees the list.
static OmStatus draw_patch(const OmTetMesh* mesh, const int* from, int n, const OmPatchDef* def,
                           int** list, int* nlist) {
    OmSurface surface = {0};
    int *vert = NULL, *of_mesh = NULL, *candidate = NULL, ncandidate = 0;
    OmPatchDef patch = *def;
    *list = NULL;
    OmStatus status = om_tet_mesh_boundary(mesh, &surface, &vert);
    if (status < 0) goto done;
    OM_ALLOC_DONE(of_mesh, (size_t)mesh->nvert);
    OM_ALLOC_DONE(candidate, (size_t)n);
    for (int v = 0; v < mesh->nvert; ++v) of_mesh[v] = -1;
    for (int i = 0; i < surface.nvert; ++i) of_mesh[vert[i]] = i;
    for (int i = 0; i < n; ++i)
        if (of_mesh[from[i]] >= 0) candidate[ncandidate++] = of_mesh[from[i]];
    if (patch.center >= 0) patch.center = of_mesh[patch.center];
    OM_TRY_DONE(om_surface_random_patch(&surface, candidate, ncandidate, &patch, list, nlist));
    for (int i = 0; i < *nlist; ++i) (*list)[i] = vert[(*list)[i]];
done:
    om_free(of_mesh);
    om_free(candidate);
    om_free(vert);
    om_surface_done(&surface);
    return status;
}

static OmStatus attach_random_patch(double share, int seed, OmSite* site) {
    const OmMeshSet* under = om_tet_mesh_find_set(&site->mesh, "underside");
    OmPatchDef def = om_patch_default_def(share, (uint64_t)seed);
    int *list, n;
    OM_TRY(draw_patch(&site->mesh, under->vert, under->nvert, &def, &list, &n));
    OmStatus status = om_tet_mesh_add_set(&site->mesh, "attachment", list, n);
    om_free(list);
    return status;
}

static double draw_share(const OmScene* scene) {
    OmRng rng = om_rng_init((uint64_t)scene->seed, 1);
    return om_rng_range(&rng, scene->attach.share_min, scene->attach.share_max);
}

// key: of the scene file, for the message.
static OmStatus attach_box(const OmScene* scene, OmVec3 lo, OmVec3 hi, const char* key,
                           OmSite* site) {
    const OmMeshSet* under = om_tet_mesh_find_set(&site->mesh, "underside");
    int *list, n = 0;
    OM_ALLOC(list, (size_t)under->nvert);
    OmPose task = om_pose_inverse(site->pose_world_task);
    for (int i = 0; i < under->nvert; ++i) {
        OmVec3 p = om_pose_apply(task, om_load3(site->mesh.x, under->vert[i]));
        bool is_in =
            p.x >= lo.x && p.x <= hi.x && p.y >= lo.y && p.y <= hi.y && p.z >= lo.z && p.z <= hi.z;
        if (is_in) list[n++] = under->vert[i];
    }
    OmStatus status = n > 0
                          ? om_tet_mesh_add_set(&site->mesh, "attachment", list, n)
                          : om_error(OM_INVALID, "%s: %s: the box holds no vertex of the underside",
                                     om_scene_label(scene), key);
    om_free(list);
    return status;
}

OmStatus om__site_attach(const OmScene* scene, OmSite* site) {
    const OmSceneAttach* a = &scene->attach;
    switch (a->kind) {
    case OM_ATTACH_RANDOM: return attach_random_patch(draw_share(scene), scene->seed, site);
    case OM_ATTACH_BOX: return attach_box(scene, a->lo, a->hi, "attachments", site);
    default:
        OM_CHECK(om_tet_mesh_find_set(&site->mesh, "attachment"), OM_INVALID,
                 "%s: attachments: the mesh has no set \"attachment\"", om_scene_label(scene));
        return OM_OK;
    }
}

// ---- regions of the underside --------------------------------------------------------------------------------

typedef struct Region {  // attached vertices of a site's mesh
    const OmTetMesh* mesh;
    const OmMeshSet* under;
    unsigned char* is_in;  // nonzero where attached                                  (nvert)
} Region;

static OmStatus region_of(const OmSite* site, Region* r) {
    const OmMeshSet* held = om_tet_mesh_find_set(&site->mesh, "attachment");
    *r = (Region){&site->mesh, om_tet_mesh_find_set(&site->mesh, "underside"), NULL};
    r->is_in = om_calloc((size_t)site->mesh.nvert, 1);
    if (!r->is_in) return OM_NO_MEMORY;
    for (int i = 0; held && i < held->nvert; ++i) r->is_in[held->vert[i]] = 1;
    return OM_OK;
}

// Is the vertex of the underside nearest to p attached?
static bool is_inside(const Region* r, OmVec3 p) {
    int nearest = -1;
    double best = INFINITY;
    for (int k = 0; k < r->under->nvert; ++k) {
        double d = om_norm2(om_sub(p, om_load3(r->mesh->x, r->under->vert[k])));
        if (d < best) {
            best = d;
            nearest = r->under->vert[k];
        }
    }
    return nearest >= 0 && r->is_in[nearest];
}

// Distance from p to the nearest vertex of the underside that is attached, or that is not.
static double distance_to(const Region* r, OmVec3 p, bool is_attached) {
    double best = INFINITY;
    for (int k = 0; k < r->under->nvert; ++k) {
        int i = r->under->vert[k];
        if ((r->is_in[i] != 0) == is_attached)
            best = fmin(best, om_distance(p, om_load3(r->mesh->x, i)));
    }
    return best;
}

OmStatus om__site_copy_attachments(const OmSite* twin, OmSite* world) {
    const OmMeshSet* to = om_tet_mesh_find_set(&world->mesh, "underside");
    Region r;
    OM_TRY(region_of(twin, &r));
    OmStatus status = OM_OK;
    int *list = NULL, n = 0;
    OM_ALLOC_DONE(list, (size_t)to->nvert);
    for (int i = 0; i < to->nvert; ++i)
        if (is_inside(&r, om_load3(world->mesh.x, to->vert[i]))) list[n++] = to->vert[i];
    status = om_tet_mesh_add_set(&world->mesh, "attachment", list, n);
done:
    om_free(r.is_in);
    om_free(list);
    return status;
}

// ---- the belief ----------------------------------------------------------------------------------------------

// The region of the truth, shifted in the task frame and grown (above 0) or shrunk (below 0).
static OmStatus change_region(const OmScene* scene, OmSite* site) {
    const OmSceneBelief* b = &scene->believed;
    OmVec3 shift = om_quat_rotate(site->pose_world_task.q, om_vec3(b->shift.x, b->shift.y, 0));
    Region r;
    OM_TRY(region_of(site, &r));
    OmStatus status = OM_OK;
    int *list = NULL, n = 0;
    OM_ALLOC_DONE(list, (size_t)r.under->nvert);
    for (int k = 0; k < r.under->nvert; ++k) {
        OmVec3 p = om_sub(om_load3(site->mesh.x, r.under->vert[k]), shift);
        bool is_in = is_inside(&r, p);
        if (b->grow > 0) is_in = is_in || distance_to(&r, p, true) <= b->grow;
        if (b->grow < 0) is_in = is_in && distance_to(&r, p, false) > -b->grow;
        if (is_in) list[n++] = r.under->vert[k];
    }
    OM_CHECK_DONE(
        n > 0, OM_INVALID,
        "%s: believed_attachments: shift_mm and grow_mm leave no vertex of the underside; "
        "say kind: none if the twin is to have no attachment",
        om_scene_label(scene));
    status = om_tet_mesh_add_set(&site->mesh, "attachment", list, n);
done:
    om_free(r.is_in);
    om_free(list);
    return status;
}

// The vertex of the region that is farthest from the rest of the underside; any one if the region is all of it.
static int find_deepest(const Region* r) {
    int deepest = -1;
    double most = -1;
    for (int k = 0; k < r->under->nvert; ++k) {
        int v = r->under->vert[k];
        double d = r->is_in[v] ? distance_to(r, om_load3(r->mesh->x, v), false) : -1;
        if (d <= most) continue;
        most = d;
        deepest = v;
    }
    return deepest;
}

// Below 1 attached vertices with the lowest D of (4.1) stay; above 1 free vertices of the underside with the lowest D
// are added. So a smaller region lies in a larger one.
static OmStatus scale_region(const OmScene* scene, double ratio, int seed, OmSite* site) {
    OmStatus status = OM_OK;
    Region r;
    int *from = NULL, *taken = NULL, *list = NULL, nfrom = 0, ntaken = 0, n = 0, nheld = 0;
    OM_TRY(region_of(site, &r));
    OM_ALLOC_DONE(from, (size_t)r.under->nvert);
    OM_ALLOC_DONE(list, (size_t)r.under->nvert);
    for (int k = 0; k < r.under->nvert; ++k) nheld += r.is_in[r.under->vert[k]] != 0;
    for (int k = 0; k < r.under->nvert; ++k) {
        int v = r.under->vert[k];
        if ((r.is_in[v] != 0) == (ratio < 1)) from[nfrom++] = v;
        if (r.is_in[v] && ratio > 1) list[n++] = v;
    }
    double want = ratio < 1 ? ratio * nheld : (ratio - 1) * nheld;
    if (nfrom > 0 && nheld > 0) {
        OmPatchDef def = om_patch_default_def(fmin(1, want / nfrom), (uint64_t)seed);
        def.center = find_deepest(&r);
        OM_TRY_DONE(draw_patch(&site->mesh, from, nfrom, &def, &taken, &ntaken));
    }
    for (int i = 0; i < ntaken; ++i) list[n++] = taken[i];
    OM_CHECK_DONE(
        n > 0, OM_INVALID,
        "%s: believed_attachments: ratio %g leaves no vertex of the %d that are attached; "
        "say kind: none if the twin is to have no attachment",
        om_scene_label(scene), ratio, nheld);
    om_sort_ints(list, n);
    status = om_tet_mesh_add_set(&site->mesh, "attachment", list, n);
done:
    om_free(r.is_in);
    om_free(from);
    om_free(taken);
    om_free(list);
    return status;
}

OmStatus om__site_believe(const OmScene* scene, OmSite* site) {
    const OmSceneBelief* b = &scene->believed;
    switch (b->kind) {
    case OM_BELIEF_NONE: return om_tet_mesh_add_set(&site->mesh, "attachment", NULL, 0);
    case OM_BELIEF_BOX: return attach_box(scene, b->lo, b->hi, "believed_attachments", site);
    case OM_BELIEF_PATCH: return attach_random_patch(b->share, b->seed, site);
    default: break;
    }
    if (om_norm(b->shift) > 0 || b->grow != 0) OM_TRY(change_region(scene, site));
    return b->ratio == 1 ? OM_OK : scale_region(scene, b->ratio, scene->seed, site);
}

// ---- stiffness -------------------------------------------------------------------------------------------------

OmStatus om__site_measure_attachments(double total, OmSite* site) {
    const OmMeshSet* held = om_tet_mesh_find_set(&site->mesh, "attachment");
    const OmMeshSet* under = om_tet_mesh_find_set(&site->mesh, "underside");
    OmSurface surface = {0};
    unsigned char* is_face = NULL;
    double *area = NULL, sum = 0;
    int *vert = NULL, nheld = held ? held->nvert : 0, noutside = 0;
    OmStatus status = om_tet_mesh_boundary(&site->mesh, &surface, &vert);
    if (status < 0) goto done;
    OM_CALLOC_DONE(is_face, (size_t)site->mesh.nvert);
    OM_CALLOC_DONE(area, (size_t)site->mesh.nvert);
    OM_CALLOC_DONE(site->attach_area, (size_t)nheld);
    OM_CALLOC_DONE(site->attach_spring, (size_t)nheld);
    // The face that attachments are part of: the underside, or else the attached vertices.
    for (int k = 0; under && k < under->nvert; ++k) is_face[under->vert[k]] = 1;
    for (int k = 0; k < nheld; ++k) noutside += !is_face[held->vert[k]];
    if (noutside > 0) memset(is_face, 0, (size_t)site->mesh.nvert);
    for (int k = 0; noutside > 0 && k < nheld; ++k) is_face[held->vert[k]] = 1;
    for (int t = 0; t < surface.ntri; ++t) {
        const int* v = surface.tri_vert + 3 * (size_t)t;
        if (!is_face[vert[v[0]]] || !is_face[vert[v[1]]] || !is_face[vert[v[2]]]) continue;
        OmVec3 a = om_load3(surface.x, v[0]), b = om_sub(om_load3(surface.x, v[1]), a);
        double third = om_norm(om_cross(b, om_sub(om_load3(surface.x, v[2]), a))) / 6;
        for (int k = 0; k < 3; ++k) area[vert[v[k]]] += third;
    }
    for (int k = 0; k < nheld; ++k) sum += area[held->vert[k]];
    double scale = total > 0 && sum > 0 ? total / sum : 1;
    for (int k = 0; k < nheld; ++k) site->attach_area[k] = scale * area[held->vert[k]];
done:
    om_free(is_face);
    om_free(area);
    om_free(vert);
    om_surface_done(&surface);
    return status;
}

double om_site_attached_area(const OmSite* site) {
    const OmMeshSet* held = om_tet_mesh_find_set(&site->mesh, "attachment");
    double sum = 0;
    for (int k = 0; site->attach_area && k < held->nvert; ++k) sum += site->attach_area[k];
    return sum;
}

void om__site_set_stiffness(const OmScene* scene, OmSite* site) {
    const OmMeshSet* held = om_tet_mesh_find_set(&site->mesh, "attachment");
    const OmSceneBelief* b = &scene->believed;
    double stiffness = scene->attach.stiffness, foundation = scene->attach.foundation;
    if (site->role == OM_SITE_TWIN && (b->stiffness >= 0 || b->foundation >= 0)) {
        stiffness = fmax(b->stiffness, 0);
        foundation = fmax(b->foundation, 0);
    }
    site->attach_stiffness = stiffness;
    site->attach_foundation = foundation;
    for (int k = 0; site->attach_spring && held && k < held->nvert; ++k) {
        double by_area = fmax(foundation * site->attach_area[k], MIN_SPRING);
        site->attach_spring[k] = foundation > 0 ? by_area : stiffness;
    }
}

// ---- other attachments --------------------------------------------------------------------------------------------

OmStatus om__site_measure_again(OmSite* site) {
    om_free(site->attach_area);
    om_free(site->attach_spring);
    site->attach_area = site->attach_spring = NULL;
    return om__site_measure_attachments(0, site);
}

OmStatus om_site_scale_attachments(const OmScene* scene, double ratio, int seed, OmSite* site) {
    const OmMeshSet* held = om_tet_mesh_find_set(&site->mesh, "attachment");
    OM_CHECK(ratio > 0 && isfinite(ratio), OM_INVALID, "attachments: ratio is %g; above 0", ratio);
    if (!held || held->nvert == 0 || ratio == 1) return OM_OK;
    OM_TRY(scale_region(scene, ratio, seed, site));
    OM_TRY(om__site_measure_again(site));
    om__site_set_stiffness(scene, site);
    return OM_OK;
}
