// scene_site.c: build the operating site of a scene: mesh, frames, attachments, ROI.
//
// The twin's site is built first in every case; the world's takes its attachments and ROI from it, by
// nearest vertex, so that both meshes represent the same hidden truth.
#include <string.h>

#include "omentum/shape_meshing.h"
#include "scene/scene_site.h"

void om_site_done(OmSite* site) {
    if (!site) return;
    om_tet_mesh_done(&site->mesh);
    om_surface_done(&site->organ);
    om_sdf_done(&site->organ_sdf);
    om_surface_done(&site->roi);
    om_free(site->roi_x);
    om_free(site->roi_n);
    memset(site, 0, sizeof *site);
}

// ---- attachments -------------------------------------------------------------------------------------------

static OmStatus attach_random_patch(const OmScene* scene, OmSite* site) {
    const OmMeshSet* under = om_tet_mesh_find_set(&site->mesh, "underside");
    OmRng rng = om_rng_init((uint64_t)scene->seed, 1);
    double share = om_rng_range(&rng, scene->attach.share_min, scene->attach.share_max);
    OmSurface surface = {0};
    int *vert = NULL, *of_mesh = NULL, *candidate = NULL, *patch = NULL;
    int ncandidate = 0, npatch = 0;
    OmStatus status = om_tet_mesh_boundary(&site->mesh, &surface, &vert);
    if (status < 0) goto done;
    OM_ALLOC_DONE(of_mesh, (size_t)site->mesh.nvert);
    OM_ALLOC_DONE(candidate, (size_t)under->nvert);
    for (int v = 0; v < site->mesh.nvert; ++v) of_mesh[v] = -1;
    for (int i = 0; i < surface.nvert; ++i) of_mesh[vert[i]] = i;
    for (int i = 0; i < under->nvert; ++i) {
        if (of_mesh[under->vert[i]] >= 0) candidate[ncandidate++] = of_mesh[under->vert[i]];
    }
    OmPatchDef def = om_patch_default_def(share, (uint64_t)scene->seed);
    OM_TRY_DONE(om_surface_random_patch(&surface, candidate, ncandidate, &def, &patch, &npatch));
    for (int i = 0; i < npatch; ++i) patch[i] = vert[patch[i]];
    status = om_tet_mesh_add_set(&site->mesh, "attachment", patch, npatch);
done:
    om_free(of_mesh);
    om_free(candidate);
    om_free(patch);
    om_free(vert);
    om_surface_done(&surface);
    return status;
}

static OmStatus attach_box(const OmScene* scene, OmSite* site) {
    const OmMeshSet* under = om_tet_mesh_find_set(&site->mesh, "underside");
    int *list, n = 0;
    OM_ALLOC(list, (size_t)under->nvert);
    OmPose task = om_pose_inverse(site->pose_world_task);
    OmVec3 lo = scene->attach.lo, hi = scene->attach.hi;
    for (int i = 0; i < under->nvert; ++i) {
        OmVec3 p = om_pose_apply(task, om_load3(site->mesh.x, under->vert[i]));
        bool is_in =
            p.x >= lo.x && p.x <= hi.x && p.y >= lo.y && p.y <= hi.y && p.z >= lo.z && p.z <= hi.z;
        if (is_in) list[n++] = under->vert[i];
    }
    OmStatus status =
        n > 0 ? om_tet_mesh_add_set(&site->mesh, "attachment", list, n)
              : om_error(OM_INVALID, "%s: attachments: the box holds no vertex of the underside",
                         scene->path);
    om_free(list);
    return status;
}

static OmStatus attach_tissue(const OmScene* scene, OmSite* site) {
    switch (scene->attach.kind) {
    case OM_ATTACH_RANDOM: return attach_random_patch(scene, site);
    case OM_ATTACH_BOX: return attach_box(scene, site);
    default:
        OM_CHECK(om_tet_mesh_find_set(&site->mesh, "attachment"), OM_INVALID,
                 "%s: attachments: the mesh has no set \"attachment\"", scene->path);
        return OM_OK;
    }
}

// The world's attachments: vertices of its underside whose nearest vertex of the twin's is attached.
static OmStatus copy_attachments(const OmSite* twin, OmSite* world) {
    const OmMeshSet* from = om_tet_mesh_find_set(&twin->mesh, "underside");
    const OmMeshSet* held = om_tet_mesh_find_set(&twin->mesh, "attachment");
    const OmMeshSet* to = om_tet_mesh_find_set(&world->mesh, "underside");
    unsigned char* is_held = om_calloc((size_t)twin->mesh.nvert, 1);
    int* list = om_alloc((size_t)to->nvert, sizeof *list);
    OmStatus status = is_held && list ? OM_OK : OM_NO_MEMORY;
    int n = 0;
    for (int i = 0; status == OM_OK && i < held->nvert; ++i) is_held[held->vert[i]] = 1;
    for (int i = 0; status == OM_OK && i < to->nvert; ++i) {
        OmVec3 p = om_load3(world->mesh.x, to->vert[i]);
        int nearest = -1;
        double best = INFINITY;
        for (int k = 0; k < from->nvert; ++k) {
            double d = om_norm2(om_sub(p, om_load3(twin->mesh.x, from->vert[k])));
            if (d < best) {
                best = d;
                nearest = from->vert[k];
            }
        }
        if (nearest >= 0 && is_held[nearest]) list[n++] = to->vert[i];
    }
    if (status == OM_OK) status = om_tet_mesh_add_set(&world->mesh, "attachment", list, n);
    om_free(is_held);
    om_free(list);
    return status;
}

// ---- both roles --------------------------------------------------------------------------------------------

static OmStatus build_twin(const OmScene* scene, const OmProgress* progress, OmSite* site) {
    OM_TRY(om__site_build_body(scene, OM_SITE_TWIN, progress, site));
    bool is_patient = scene->tissue.source >= OM_SOURCE_PATIENT;
    if (!is_patient) OM_TRY(attach_tissue(scene, site));
    const OmMeshSet* held = om_tet_mesh_find_set(&site->mesh, "attachment");
    OM_CHECK(held && held->nvert > 0, OM_INVALID, "%s: attachments: nothing holds the tissue",
             scene->path);
    return is_patient ? OM_OK : om__site_place_roi(scene, site);
}

// ---- the world's own mesh: at least twice the twin's vertices ---------------------------------------------------

#define WORLD_CELLS 1.5  // of the twin's, along each side
#define WORLD_EDGE 0.7   // of the twin's: a layer of cells has 1 / 0.7^2 = 2.04 times the vertices
// Edge of the world's mesh over the twin's. Vertices grow at most with the cube: 1 / 0.79^3 = 2.03.
#define LONGEST_EDGE 0.79
#define MAX_BUILDS 4

OmVec3 om__scene_world_cells(const OmSceneTissue* t) {
    OmVec3 n = t->world_cells, c = t->cells;
    return om_vec3(n.x > 0 ? n.x : ceil(WORLD_CELLS * c.x), n.y > 0 ? n.y : ceil(WORLD_CELLS * c.y),
                   n.z > 0 ? n.z : ceil(WORLD_CELLS * c.z));
}

double om__scene_world_edge(const OmSceneModel* m) {
    return m->world_edge > 0 ? m->world_edge : WORLD_EDGE * m->edge;
}

OmStatus om__scene_check_world(const OmScene* s, const char* name) {
    if (s->tissue.source == OM_SOURCE_SHEET) {
        OmVec3 c = s->tissue.cells, w = om__scene_world_cells(&s->tissue);
        double twin = (c.x + 1) * (c.y + 1) * (c.z + 1), world = (w.x + 1) * (w.y + 1) * (w.z + 1);
        OM_CHECK(world >= 2 * twin, OM_INVALID,
                 "%s: tissue: world_cells [%g, %g, %g] make %.0f vertices, cells %.0f: the truth "
                 "needs at least twice as many; make world_cells finer or leave it out",
                 name, w.x, w.y, w.z, world, twin);
    }
    double edge = s->model.edge, longest = LONGEST_EDGE * edge;
    OM_CHECK(s->tissue.source != OM_SOURCE_VOLUME || s->model.world_edge <= longest, OM_INVALID,
             "%s: model: world_edge_mm %g is too near edge_mm %g: the truth needs at least twice "
             "the twin's vertices; say %.3g or leave it out",
             name, 1e3 * s->model.world_edge, 1e3 * edge, 1e3 * WORLD_EDGE * edge);
    return OM_OK;
}

// The world's mesh. If the scene gives no edge, the mesh is refined until it has at least `min` vertices.
static OmStatus build_world_body(const OmScene* scene, int min, const OmProgress* progress,
                                 OmSite* site) {
    OmScene s = *scene;
    bool is_open = s.tissue.source == OM_SOURCE_VOLUME && s.model.world_edge == 0;
    for (int build = 0;; ++build) {
        OM_TRY(om__site_build_body(&s, OM_SITE_WORLD, progress, site));
        if (site->mesh.nvert >= min) return OM_OK;
        double edge = om__scene_world_edge(&s.model);
        edge *= 0.98 * sqrt((double)site->mesh.nvert / min);
        OM_CHECK(is_open && build + 1 < MAX_BUILDS, OM_INVALID,
                 "%s: the world's mesh has %d vertices, the twin's %d: the truth needs at least "
                 "twice as many; leave world_edge_mm out or make it at most %.3g",
                 scene->path, site->mesh.nvert, min / 2, 1e3 * edge);
        s.model.world_edge = edge;
        om_site_done(site);
    }
}

static OmStatus build_world(const OmScene* scene, const OmProgress* progress, OmSite* site) {
    OmSite twin = {0};
    OM_TRY(om__scene_check_world(scene, scene->path));
    OmStatus status = build_twin(scene, progress, &twin);
    if (status == OM_OK) status = build_world_body(scene, 2 * twin.mesh.nvert, progress, site);
    if (status == OM_OK && !om_tet_mesh_find_set(&site->mesh, "attachment")) {
        status = copy_attachments(&twin, site);
    }
    if (status == OM_OK && site->nroi == 0) status = om__site_copy_roi(&twin, site);
    if (status == OM_OK) site->pose_world_task = twin.pose_world_task;
    om_site_done(&twin);
    return status;
}

OmStatus om_site_build(const OmScene* scene, OmSiteRole role, const OmProgress* progress,
                       OmSite* site) {
    memset(site, 0, sizeof *site);
    OmStatus status = role == OM_SITE_TWIN ? build_twin(scene, progress, site)
                                           : build_world(scene, progress, site);
    site->role = role;
    if (status < 0) om_site_done(site);
    return status;
}
