// scene_site.c: build the operating site of a scene: mesh, frames, attachments, ROI.
//
// The truth is placed on the twin's mesh in every case. The world's mesh takes over attachments and ROI by nearest
// vertex, so that both meshes represent the same truth; then the twin's own attachments become the believed ones.
#include <math.h>
#include <string.h>

#include "omentum/tissue.h"
#include "scene/scene_site.h"

void om_site_done(OmSite* site) {
    if (!site) return;
    om_tet_mesh_done(&site->mesh);
    om_surface_done(&site->organ);
    om_sdf_done(&site->organ_sdf);
    om_tet_mesh_done(&site->soft);
    om_free(site->soft_spring);
    om_surface_done(&site->roi);
    om_free(site->roi_x);
    om_free(site->roi_n);
    om_free(site->attach_area);
    om_free(site->attach_spring);
    memset(site, 0, sizeof *site);
}

// ---- both roles --------------------------------------------------------------------------------------------

// The twin's mesh with the attachments of the truth.
static OmStatus build_truth(const OmScene* scene, const OmProgress* progress, OmSite* site) {
    OM_TRY(om__site_build_body(scene, OM_SITE_TWIN, progress, site));
    bool is_patient = scene->tissue.source >= OM_SOURCE_PATIENT;
    OM_CHECK(
        !is_patient || site->nroi > 0, OM_INVALID,
        "%s: the patient model %s has no region of interest to expose: build it as fat over an "
        "organ (`sheet`, or `over` with `roi`), or simulate it without a scene (omentum view; "
        "om_tissue_create, in Python Tissue(patient))",
        om_scene_label(scene), scene->tissue.file);
    if (!is_patient) OM_TRY(om__site_attach(scene, site));
    const OmMeshSet* held = om_tet_mesh_find_set(&site->mesh, "attachment");
    OM_CHECK(held && held->nvert > 0, OM_INVALID, "%s: attachments: nothing holds the tissue",
             om_scene_label(scene));
    OM_TRY(om__site_measure_attachments(0, site));
    return is_patient ? OM_OK : om__site_place_roi(scene, site);
}

static OmStatus build_twin(const OmScene* scene, const OmProgress* progress, OmSite* site) {
    OM_TRY(build_truth(scene, progress, site));
    OM_TRY(om__site_believe(scene, site));
    OM_TRY(om__site_measure_again(site));
    OM_TRY(om__site_shift_roi(scene, site));
    return om__site_register(scene, site);
}

// ---- the world's own mesh: at least twice the twin's vertices ---------------------------------------------------

#define WORLD_CELLS \
    1.5  // of the twin's, along each side; through the thickness of linear elements only
#define WORLD_EDGE 0.7  // of the twin's: a layer of cells has 1 / 0.7^2 = 2.04 times the vertices
// Edge of the world's mesh over the twin's. Vertices grow at most with the cube: 1 / 0.79^3 = 2.03.
#define LONGEST_EDGE 0.79
#define MAX_BUILDS 4

// Twice the vertices of a layer need sqrt(2) (n + 1) along a side.
static double finer_cells(double n) {
    return fmax(ceil(WORLD_CELLS * n), ceil(sqrt(2.0) * (n + 1)) - 1);
}

OmVec3 om__scene_world_cells(const OmScene* s) {
    OmVec3 n = s->tissue.world_cells, c = s->tissue.cells;
    const bool bends = om_scene_element(s, OM_SITE_WORLD) != OM_ELEMENT_LINEAR;
    return om_vec3(n.x > 0 ? n.x : finer_cells(c.x), n.y > 0 ? n.y : finer_cells(c.y),
                   n.z > 0 ? n.z
                   : bends ? c.z
                           : ceil(WORLD_CELLS * c.z));
}

double om__scene_world_edge(const OmSceneModel* m) {
    return m->world_edge > 0 ? m->world_edge : WORLD_EDGE * m->edge;
}

// Midpoints of all edges of the tetrahedra make a grid of half the cells.
static double count_nodes(OmTissueElement element, OmVec3 c) {
    double k = element == OM_ELEMENT_QUADRATIC ? 2 : 1;
    return (k * c.x + 1) * (k * c.y + 1) * (k * c.z + 1);
}

OmStatus om__scene_check_world(const OmScene* s, const char* name) {
    if (s->tissue.source == OM_SOURCE_SHEET) {
        OmVec3 w = om__scene_world_cells(s);
        double twin = count_nodes(om_scene_element(s, OM_SITE_TWIN), s->tissue.cells),
               world = count_nodes(om_scene_element(s, OM_SITE_WORLD), w);
        OM_CHECK(world >= 2 * twin, OM_INVALID,
                 "%s: tissue: world_cells [%g, %g, %g] make %.0f nodes, cells %.0f: the truth "
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

// The world's mesh. If the scene gives no edge, the mesh is refined until it has at least `min` vertices. That a sheet
// has enough nodes is checked already.
static OmStatus build_world_body(const OmScene* scene, int min, const OmProgress* progress,
                                 OmSite* site) {
    OmScene s = *scene;
    bool is_open = s.tissue.source == OM_SOURCE_VOLUME && s.model.world_edge == 0;
    for (int build = 0;; ++build) {
        OM_TRY(om__site_build_body(&s, OM_SITE_WORLD, progress, site));
        if (site->mesh.nvert >= min || s.tissue.source == OM_SOURCE_SHEET) return OM_OK;
        double edge = om__scene_world_edge(&s.model);
        edge *= 0.98 * sqrt((double)site->mesh.nvert / min);
        OM_CHECK(is_open && build + 1 < MAX_BUILDS, OM_INVALID,
                 "%s: the world's mesh has %d vertices, the twin's %d: the truth needs at least "
                 "twice as many; leave world_edge_mm out or make it at most %.3g",
                 om_scene_label(scene), site->mesh.nvert, min / 2, 1e3 * edge);
        s.model.world_edge = edge;
        om_site_done(site);
    }
}

static OmStatus build_world(const OmScene* scene, const OmProgress* progress, OmSite* site) {
    OmSite twin = {0};
    OM_TRY(om__scene_check_world(scene, om_scene_label(scene)));
    OmStatus status = build_truth(scene, progress, &twin);
    if (status == OM_OK) status = build_world_body(scene, 2 * twin.mesh.nvert, progress, site);
    if (status == OM_OK && !om_tet_mesh_find_set(&site->mesh, "attachment")) {
        status = om__site_copy_attachments(&twin, site);
    }
    if (status == OM_OK) status = om__site_measure_attachments(om_site_attached_area(&twin), site);
    if (status == OM_OK && site->nroi == 0) status = om__site_copy_roi(&twin, site);
    if (status == OM_OK) site->pose_world_task = site->pose_world_field = twin.pose_world_task;
    om_site_done(&twin);
    return status;
}

OmStatus om_site_build(const OmScene* scene, OmSiteRole role, const OmProgress* progress,
                       OmSite* site) {
    memset(site, 0, sizeof *site);
    OmStatus status = role == OM_SITE_TWIN ? build_twin(scene, progress, site)
                                           : build_world(scene, progress, site);
    site->role = role;
    site->element = om_scene_element(scene, role);
    om__site_set_stiffness(scene, site);
    const OmMeshSet* held = om_tet_mesh_find_set(&site->mesh, "attachment");
    if (status == OM_OK && site->attach_foundation > 0 && held && held->nvert > 0 &&
        !(om_site_attached_area(site) > 0))
        status = om_error(OM_INVALID,
                          "%s: attachments: foundation: the %d attached vertices have no area (no "
                          "triangle of the surface has all its corners among them); give stiffness "
                          "instead",
                          om_scene_label(scene), held->nvert);
    if (status == OM_OK) status = om_site_mesh_organ(scene, site);
    if (status < 0) om_site_done(site);
    return status;
}

// ---- a mesh or a patient alone ---------------------------------------------------------------------------------

enum { LEAST_HELD = 3 };  // vertices that hold a body against any turn

static OmStatus hold_lowest(OmSite* site) {
    const OmPose task = om_pose_inverse(site->pose_world_task);
    const int n = site->mesh.nvert;
    double *height = NULL, *sorted = NULL;
    int *list = NULL, nlist = 0;
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(height, (size_t)n);
    OM_ALLOC_DONE(sorted, (size_t)n);
    OM_ALLOC_DONE(list, (size_t)n);
    for (int v = 0; v < n; ++v)
        sorted[v] = height[v] = om_pose_apply(task, om_load3(site->mesh.x, v)).z;
    om_sort_doubles(sorted, n);
    const double layer = sorted[0] + 0.5 * om_site_spacing(site);
    const double top = fmax(layer, sorted[n < LEAST_HELD ? n - 1 : LEAST_HELD - 1]);
    for (int v = 0; v < n; ++v)
        if (height[v] <= top) list[nlist++] = v;
    status = om_tet_mesh_add_set(&site->mesh, "attachment", list, nlist);
done:
    om_free(height);
    om_free(sorted);
    om_free(list);
    return status;
}

static OmStatus build_tissue(const OmScene* scene, const OmProgress* progress, OmSite* site,
                             bool* holds_lowest) {
    OM_CHECK(scene->tissue.source == OM_SOURCE_MESH || scene->tissue.source == OM_SOURCE_PATIENT,
             OM_INVALID, "%s: tissue: source is neither a mesh nor a patient",
             om_scene_label(scene));
    OM_TRY(om__site_build_body(scene, OM_SITE_TWIN, progress, site));
    const OmMeshSet* held = om_tet_mesh_find_set(&site->mesh, "attachment");
    *holds_lowest = !held || held->nvert == 0;
    if (*holds_lowest) OM_TRY(hold_lowest(site));
    site->has_ground = *holds_lowest && !site->has_organ;
    OM_TRY(om__site_measure_attachments(0, site));
    om__site_set_stiffness(scene, site);
    return om_site_mesh_organ(scene, site);
}

OmStatus om_site_build_tissue(const OmScene* scene, const OmProgress* progress, OmSite* site,
                              bool* holds_lowest) {
    bool is_lowest = false;
    memset(site, 0, sizeof *site);
    OmStatus status = build_tissue(scene, progress, site, &is_lowest);
    if (status < 0) om_site_done(site);
    if (holds_lowest) *holds_lowest = is_lowest;
    return status;
}

double om_site_spacing(const OmSite* site) {
    const OmTetMesh* mesh = &site->mesh;
    static const unsigned char pair[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
    double sum = 0;
    for (int e = 0; e < mesh->ntet; ++e)
        for (int k = 0; k < 6; ++k) {
            const int* v = mesh->tet_vert + 4 * (size_t)e;
            sum += om_distance(om_load3(mesh->x, v[pair[k][0]]), om_load3(mesh->x, v[pair[k][1]]));
        }
    return mesh->ntet > 0 ? sum / (6.0 * mesh->ntet) : 0;
}
