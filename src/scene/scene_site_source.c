// scene_site_source.c: the tissue sources of a site: a sheet, a mesh, a patient model, a CT.
#include <string.h>

#include "omentum/scene_model.h"
#include "omentum/shape_file.h"
#include "scene/scene_site.h"

// ---- frames ----------------------------------------------------------------------------------------------

// z = up, x = away from the endoscope, origin below the centre of the mesh.
static void place_task_frame(OmSite* site, OmVec3 up, OmVec3 view) {
    OmVec3 z = om_normalize(up);
    OmVec3 x = om_scale(-1, om_madd(view, -om_dot(view, z), z));
    x = om_norm(x) > 1e-6 ? om_normalize(x) : om_orthogonal(z);
    OmQuat q = om_quat_from_mat3(om_mat3_cols(x, om_cross(z, x), z));
    OmPose frame = {{0, 0, 0}, q};
    OmPose inverse = om_pose_inverse(frame);
    OmVec3 lo = om_vec3(INFINITY, INFINITY, INFINITY), hi = om_scale(-1, lo);
    for (int v = 0; v < site->mesh.nvert; ++v) {
        OmVec3 p = om_pose_apply(inverse, om_load3(site->mesh.x, v));
        lo = om_min3(lo, p);
        hi = om_max3(hi, p);
    }
    frame.p = om_quat_rotate(q, om_vec3(0.5 * (lo.x + hi.x), 0.5 * (lo.y + hi.y), lo.z));
    site->pose_world_task = site->pose_world_field = frame;
    site->half_size = om_scale(0.5, om_sub(hi, lo));
}

// Add sets "underside" and "top" to a mesh without them: boundary vertices by the direction of their normals.
static OmStatus name_faces(OmSite* site) {
    if (om_tet_mesh_find_set(&site->mesh, "underside") &&
        om_tet_mesh_find_set(&site->mesh, "top")) {
        return OM_OK;
    }
    OmSurface surface = {0};
    int *vert = NULL, *list = NULL;
    double* normal = NULL;
    OmStatus status = om_tet_mesh_boundary(&site->mesh, &surface, &vert);
    if (status < 0) goto done;
    OM_ALLOC_DONE(normal, 3 * (size_t)surface.nvert);
    OM_ALLOC_DONE(list, (size_t)surface.nvert);
    om_surface_normals(&surface, normal);
    OmVec3 up = om_quat_rotate(site->pose_world_task.q, om_vec3(0, 0, 1));
    for (int side = 0; side < 2; ++side) {
        int n = 0;
        for (int i = 0; i < surface.nvert; ++i) {
            double c = om_dot(up, om_load3(normal, i));
            if (side == 0 ? c < -0.3 : c > 0.3) list[n++] = vert[i];
        }
        OM_CHECK_DONE(n > 0, OM_INVALID, "tissue: no boundary vertex faces %s; check \"up\"",
                      side ? "up" : "down");
        OM_TRY_DONE(om_tet_mesh_add_set(&site->mesh, side ? "top" : "underside", list, n));
    }
done:
    om_free(normal);
    om_free(list);
    om_free(vert);
    om_surface_done(&surface);
    return status;
}

// ---- sources -------------------------------------------------------------------------------------------------

static OmStatus build_sheet(const OmScene* scene, OmSiteRole role, OmSite* site) {
    const OmSceneTissue* t = &scene->tissue;
    OmVec3 half = om_vec3(0.5 * t->size.x, 0.5 * t->size.y, 0);
    OmVec3 n = role == OM_SITE_TWIN ? t->cells : om__scene_world_cells(scene);
    OM_TRY(om_tet_mesh_box(om_scale(-1, half), om_vec3(half.x, half.y, t->size.z), (int)n.x,
                           (int)n.y, (int)n.z, &site->mesh));
    site->has_ground = t->has_board;
    place_task_frame(site, om_vec3(0, 0, 1), om_vec3(-1, 0, 0));
    return OM_OK;
}

// The folder of the scene's file.
static OmStatus data_path(const OmScene* scene, char* path, size_t size) {
    OM_TRY(om_path_join(scene->data_root, scene->tissue.file, path, size));
    OM_CHECK(
        om_path_exists(path), OM_IO,
        "%s: no such file; the scene's files are looked for in its data root, set by --data or "
        "data_root",
        path);
    return OM_OK;
}

// The world's mesh of tissue that comes as a mesh: longest edges halved until it has twice the vertices.
static OmStatus make_finer(OmTetMesh* mesh) {
    OM_CHECK(mesh->nvert < INT32_MAX / 2, OM_INVALID, "mesh of %d vertices: too many", mesh->nvert);
    return om_tet_mesh_bisect(mesh, 2 * mesh->nvert);
}

static OmStatus build_from_mesh(const OmScene* scene, OmSiteRole role, OmSite* site) {
    char path[OM_SCENE_PATH];
    OM_TRY(data_path(scene, path, sizeof path));
    OM_TRY(om_tet_mesh_load(path, scene->tissue.unit, &site->mesh));
    if (role == OM_SITE_WORLD) OM_TRY(make_finer(&site->mesh));
    site->has_ground = scene->tissue.has_board;
    place_task_frame(site, scene->tissue.up, scene->tissue.view);
    return OM_OK;
}

// Replace a patient's labels by indices of its materials: the material that names the label, or the default one.
static OmStatus take_materials(const OmScene* scene, const OmPatient* patient, OmSite* site) {
    _Static_assert(OM_MAX_MATERIAL <= OM_SITE_MATERIALS, "a site holds a patient's materials");
    site->nmaterial = patient->nmaterial;
    for (int k = 0; k < patient->nmaterial; ++k) {
        const OmPatientMaterial* from = &patient->material[k];
        OmSiteMaterial* m = &site->material[k];
        *m = (OmSiteMaterial){"", from->young, from->poisson, from->density};
        snprintf(m->name, sizeof m->name, "%s", from->name);
    }
    for (int e = 0; e < site->mesh.ntet; ++e) {
        int label = site->mesh.tet_label[e], k = om_patient_find_material(patient, label);
        OM_CHECK(k >= 0, OM_INVALID, "%s: the patient model %s has no material for label %d",
                 om_scene_label(scene), patient->name, label);
        site->mesh.tet_label[e] = k;
    }
    return OM_OK;
}

// Move mesh, materials, organ and ROI out of a patient model; the caller frees the rest.
static OmStatus take_patient(const OmScene* scene, OmPatient* patient, OmSite* site) {
    site->mesh = patient->mesh;
    memset(&patient->mesh, 0, sizeof patient->mesh);
    OM_TRY(take_materials(scene, patient, site));
    site->nroi = patient->nroi;
    site->roi_x = patient->roi_point;
    site->roi_n = patient->roi_normal;
    patient->roi_point = patient->roi_normal = NULL;
    site->roi_center = patient->roi_center;
    site->has_organ = patient->organ.nvert > 0;
    if (site->has_organ) {
        site->organ = patient->organ;
        memset(&patient->organ, 0, sizeof patient->organ);
        OmSdfDef def = om_sdf_default_def(patient->organ_spacing);
        def.margin = 0.02;
        OM_TRY(om_sdf_from_surface(&site->organ, &def, &site->organ_sdf));
        if (site->nroi > 0) OM_TRY(om__site_draw_roi(patient->roi_radius, site));
    }
    place_task_frame(site, patient->up, scene->tissue.view);
    return OM_OK;
}

static OmStatus build_from_volume(const OmScene* scene, OmSiteRole role, const OmProgress* progress,
                                  OmPatient* patient) {
    const OmSceneModel* m = &scene->model;
    char path[OM_SCENE_PATH];
    OM_TRY(data_path(scene, path, sizeof path));
    double edge = role == OM_SITE_TWIN ? m->edge : om__scene_world_edge(m);
    OmModelDef def = om_model_default_def(path, edge);
    snprintf(def.name, sizeof def.name, "%s", scene->name);
    def.label[def.nlabel++] = m->label;
    def.max_volume_size = (uint64_t)m->max_volume;
    def.sheet.thickness = m->thickness;
    def.sheet.keep_edge = def.allow_loss = true;  // the scene's edges set the time of a run
    snprintf(def.sheet.side, sizeof def.sheet.side, "%s", m->side);
    def.sheet.half_length = m->half_length;
    def.sheet.half_width = m->half_width;
    def.sheet.tumour_radius = m->tumour_radius;
    def.sheet.tumour_shift[0] = m->tumour_shift.x;
    def.sheet.tumour_shift[1] = m->tumour_shift.y;
    OM_TRY(om_model_parse_attach(m->attach, &def.sheet.attach[def.sheet.nattach++]));
    if (scene->seed > 0) {  // both roles draw the same numbers
        OmRng rng = om_rng_init((uint64_t)scene->seed, 3);
        def.sheet.tumour_shift[0] += om_rng_range(&rng, -m->tumour_range.x, m->tumour_range.x);
        def.sheet.tumour_shift[1] += om_rng_range(&rng, -m->tumour_range.y, m->tumour_range.y);
        def.sheet.attach[0].turn = om_rng_range(&rng, -m->attach_turn, m->attach_turn);
    }
    OmModelReport report;
    OM_TRY(om_model_build(&def, progress, patient, &report));
    if (!report.has_loss) return OM_OK;
    char text[1024];
    om_model_describe_loss(&report, text, sizeof text);
    char* first = strchr(text, ';');  // the places by size, a part of the sentence for each
    char* second = first ? strchr(first + 1, ';') : NULL;
    if (second) *second = 0;
    om_log(OM_LOG_WARNING, "%s: %s: %s; a smaller model: edge_mm loses less", om_scene_label(scene),
           role == OM_SITE_TWIN ? "the twin" : "the simulated truth", text);
    return OM_OK;
}

static OmStatus build_from_patient(const OmScene* scene, OmSiteRole role,
                                   const OmProgress* progress, OmSite* site) {
    OmPatient patient = {0};
    OmStatus status;
    if (scene->tissue.source == OM_SOURCE_VOLUME) {
        status = build_from_volume(scene, role, progress, &patient);
    } else {
        char path[OM_SCENE_PATH];
        status = data_path(scene, path, sizeof path);
        if (status == OM_OK) status = om_patient_load(path, &patient);
        if (status == OM_OK && role == OM_SITE_WORLD) status = make_finer(&patient.mesh);
    }
    if (status == OM_OK) status = take_patient(scene, &patient, site);
    om_patient_done(&patient);
    return status;
}

// Mesh, frames and named faces; attachments and ROI only where the source has its own.
OmStatus om__site_build_body(const OmScene* scene, OmSiteRole role, const OmProgress* progress,
                             OmSite* site) {
    const OmSceneTissue* t = &scene->tissue;
    switch (t->source) {
    case OM_SOURCE_SHEET: OM_TRY(build_sheet(scene, role, site)); break;
    case OM_SOURCE_MESH: OM_TRY(build_from_mesh(scene, role, site)); break;
    default: OM_TRY(build_from_patient(scene, role, progress, site)); break;
    }
    OM_TRY(name_faces(site));
    site->role = role;
    om_site_set_numbers(scene, site);
    OmVec3 up = om_quat_rotate(site->pose_world_task.q, om_vec3(0, 0, 1));
    site->gravity = om_scale(-t->gravity, up);
    return om_tet_mesh_validate(&site->mesh);
}

// ---- numbers -------------------------------------------------------------------------------------------------

void om_site_set_numbers(const OmScene* scene, OmSite* site) {
    const OmSceneTissue* t = &scene->tissue;
    bool is_world = site->role == OM_SITE_WORLD, has_own = site->nmaterial > 0;
    double young = t->young < 0 && has_own ? site->material[0].young : t->young;
    double density = t->density < 0 && has_own ? site->material[0].density : t->density;
    site->young = young * (is_world ? scene->world.young_factor : 1.0);
    site->density = density * (is_world ? scene->world.density_factor : 1.0);
    site->poisson = is_world && scene->world.poisson >= 0 ? scene->world.poisson : t->poisson;
    om__site_set_stiffness(scene, site);
    if (site->soft.nvert > 0) om__site_set_organ(scene, site);
}

OmSiteMaterial om_site_get_material(const OmSite* site, int label) {
    OmSiteMaterial m = {"", site->young, site->poisson, site->density};
    if (site->nmaterial == 0) return m;
    const OmSiteMaterial *own = &site->material[label], *first = &site->material[0];
    memcpy(m.name, own->name, sizeof m.name);
    if (label > 0) {  // modulus and density of the first material are above 0
        m.young *= own->young / first->young;
        m.density *= own->density / first->density;
    }
    if (m.poisson < 0) m.poisson = own->poisson;
    return m;
}
