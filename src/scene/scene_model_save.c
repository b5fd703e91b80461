// scene_model_save.c: patient models as folders: patient.yaml, tissue.vtu, organ.ply, reports.
//
// A folder is written under a temporary name and renamed when it is complete (om_folder_begin).
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "omentum/scene_yaml.h"
#include "scene/scene_model_internal.h"

enum { MAX_ROI = 20000, MAX_SET = 256 };

// ---- patient.yaml ---------------------------------------------------------------------------------------

typedef struct RoiItem {
    OmVec3 point, normal;
} RoiItem;

typedef struct SetItem {
    char name[OM_SET_NAME];
    int nvert;
} SetItem;

typedef struct PatientFile {  // the values of the schema below
    char name[OM_NAME_LEN];
    char mesh[256];
    char organ[256];
    double organ_spacing;
    OmVec3 up, roi_center;
    double roi_radius;
    OmPatientMaterial material[OM_MAX_MATERIAL];
    int nmaterial;
    SetItem set[MAX_SET];
    int nset;
    int nroi;
    RoiItem roi_item[MAX_ROI];
} PatientFile;

static const OmYamlField material_field[] = {
    {"name", OM_YAML_STRING, offsetof(OmPatientMaterial, name), .size = OM_NAME_LEN,
     .is_required = true},
    {"label", OM_YAML_INT, offsetof(OmPatientMaterial, label), .min = -1, .max = 1e9},
    {"young", OM_YAML_DOUBLE, offsetof(OmPatientMaterial, young), .min = 1e-3, .max = 1e12,
     .is_required = true},
    {"poisson", OM_YAML_DOUBLE, offsetof(OmPatientMaterial, poisson), .min = 0, .max = 0.4999,
     .is_required = true},
    {"density", OM_YAML_DOUBLE, offsetof(OmPatientMaterial, density), .min = 1e-3, .max = 1e5,
     .is_required = true},
};
static void material_default(void* item) { ((OmPatientMaterial*)item)->label = -1; }
static const OmYamlSchema material_schema = {"material", material_field, 5, material_default};

static const OmYamlField roi_item_field[] = {
    {"point_mm", OM_YAML_VEC3, offsetof(RoiItem, point), .scale = 1e-3, .is_required = true},
    {"normal", OM_YAML_VEC3, offsetof(RoiItem, normal), .is_required = true},
};
static const OmYamlSchema roi_item_schema = {"roi point", roi_item_field, 2, NULL};

static const OmYamlField set_item_field[] = {
    {"name", OM_YAML_STRING, offsetof(SetItem, name), .size = OM_SET_NAME, .is_required = true},
    {"vertices", OM_YAML_INT, offsetof(SetItem, nvert), .min = 0, .max = 2e9, .is_required = true},
};
static const OmYamlSchema set_item_schema = {"set", set_item_field, 2, NULL};

static const OmYamlField patient_field[] = {
    {"name", OM_YAML_STRING, offsetof(PatientFile, name), .size = OM_NAME_LEN, .is_required = true},
    {"mesh", OM_YAML_STRING, offsetof(PatientFile, mesh), .size = 256, .is_required = true},
    {"organ", OM_YAML_STRING, offsetof(PatientFile, organ), .size = 256},
    {"organ_spacing_mm", OM_YAML_DOUBLE, offsetof(PatientFile, organ_spacing), .min = 1e-3,
     .max = 1e3, .scale = 1e-3},
    {"up", OM_YAML_VEC3, offsetof(PatientFile, up), .is_required = true},
    {"material", OM_YAML_LIST, offsetof(PatientFile, material), .size = sizeof(OmPatientMaterial),
     .sub = &material_schema, .count_offset = offsetof(PatientFile, nmaterial),
     .capacity = OM_MAX_MATERIAL, .is_required = true},
    {"set", OM_YAML_LIST, offsetof(PatientFile, set), .size = sizeof(SetItem),
     .sub = &set_item_schema, .count_offset = offsetof(PatientFile, nset), .capacity = MAX_SET},
    {"roi_center_mm", OM_YAML_VEC3, offsetof(PatientFile, roi_center), .scale = 1e-3},
    {"roi_radius_mm", OM_YAML_DOUBLE, offsetof(PatientFile, roi_radius), .min = 0, .max = 1e3,
     .scale = 1e-3},
    {"roi", OM_YAML_LIST, offsetof(PatientFile, roi_item), .size = sizeof(RoiItem),
     .sub = &roi_item_schema, .count_offset = offsetof(PatientFile, nroi), .capacity = MAX_ROI},
};
static const OmYamlSchema patient_schema = {"patient", patient_field,
                                            sizeof patient_field / sizeof *patient_field, NULL};

static OmStatus append_quoted(OmText* t, const char* key, const char* value) {
    OM_TRY(om_text_append(t, "%s: ", key));
    OM_TRY(om_text_append_quoted(t, value));
    return om_text_append(t, "\n");
}

static OmStatus append_vec3(OmText* t, const char* key, OmVec3 v, double scale) {
    return om_text_append(t, "%s: [%.9g, %.9g, %.9g]\n", key, scale * v.x, scale * v.y,
                          scale * v.z);
}

static OmStatus append_yaml(OmText* t, const OmPatient* p) {
    OM_TRY(om_text_append(t, "# omentum patient model; RAS: +x right, +y anterior, +z superior\n"));
    OM_TRY(append_quoted(t, "name", p->name));
    // of the files beside this one
    const char* space = p->file_space == OM_SPACE_LPS ? "LPS" : "RAS";
    OM_TRY(om_text_append(
        t, "mesh: tissue.vtu        # metres, %s; sets are its 0/1 point arrays\n", space));
    if (p->organ.ntri > 0) {
        OM_TRY(om_text_append(t, "organ: organ.ply        # metres, %s; what the tissue lies on\n",
                              space));
        OM_TRY(om_text_append(t, "organ_spacing_mm: %.9g\n", p->organ_spacing * 1e3));
    }
    OM_TRY(append_vec3(t, "up", p->up, 1));
    OM_TRY(
        om_text_append(t, "material:               # Pa, kg/m3; label -1: all other elements\n"));
    for (int i = 0; i < p->nmaterial; i++) {
        const OmPatientMaterial* m = &p->material[i];
        OM_TRY(append_quoted(t, "  - name", m->name));
        OM_TRY(om_text_append(
            t, "    label: %d\n    young: %.9g\n    poisson: %.9g\n    density: %.9g\n", m->label,
            m->young, m->poisson, m->density));
    }
    if (p->mesh.nset > 0) OM_TRY(om_text_append(t, "set:\n"));
    for (int i = 0; i < p->mesh.nset; i++) {
        OM_TRY(append_quoted(t, "  - name", p->mesh.set[i].name));
        OM_TRY(om_text_append(t, "    vertices: %d\n", p->mesh.set[i].nvert));
    }
    if (p->nroi == 0) return OM_OK;
    OM_TRY(append_vec3(t, "roi_center_mm", p->roi_center, 1e3));
    OM_TRY(om_text_append(t, "roi_radius_mm: %.9g\nroi:\n", p->roi_radius * 1e3));
    for (int i = 0; i < p->nroi; i++) {
        OmVec3 x = om_scale(1e3, om_load3(p->roi_point, i)), n = om_load3(p->roi_normal, i);
        OM_TRY(om_text_append(t, "  - {point_mm: [%.9g, %.9g, %.9g], normal: [%.9g, %.9g, %.9g]}\n",
                              x.x, x.y, x.z, n.x, n.y, n.z));
    }
    return OM_OK;
}

// ---- report.json ------------------------------------------------------------------------------------------

static void add_place(OmJson* j, const char* name, OmVec3 x) {
    om_json_open(j, name, '[');
    om_json_number(j, NULL, x.x * 1e3);
    om_json_number(j, NULL, x.y * 1e3);
    om_json_number(j, NULL, x.z * 1e3);
    om_json_close(j, ']');
}

static void add_gap(OmJson* j, const char* name, const OmSurfaceGap* gap) {
    om_json_open(j, name, '{');
    om_json_number(j, "mean_mm", gap->mean * 1e3);
    om_json_number(j, "p95_mm", gap->p95 * 1e3);
    om_json_number(j, "max_mm", gap->max * 1e3);
    add_place(j, "max_at_mm", gap->where);
    om_json_close(j, '}');
}

static void add_topology(OmJson* j, const char* name, const OmTopology* topology) {
    om_json_open(j, name, '{');
    om_json_integer(j, "parts", topology->npart);
    om_json_integer(j, "handles", topology->nhandle);
    om_json_integer(j, "cavities", topology->ncavity);
    om_json_bool(j, "is_manifold", topology->is_manifold);
    om_json_close(j, '}');
}

static void add_fit(OmJson* j, const OmModelReport* r) {
    const OmShapeFit* fit = &r->fit;
    om_json_open(j, "fit", '{');
    om_json_bool(j, "has_loss", r->has_loss);
    om_json_string(j, "of", om__model_fit_name(r));  // in keys it is called "label"
    add_gap(j, "label_to_mesh", &fit->to_mesh);
    add_gap(j, "mesh_to_label", &fit->to_solid);
    add_topology(j, "label", &fit->solid);
    add_topology(j, "mesh", &fit->mesh);
    om_json_number(j, "missing_ml", fit->lost * 1e6);
    om_json_number(j, "too_much_ml", fit->added * 1e6);
    if (fit->has_change) add_place(j, "topology_differs_at_mm", fit->change);
    om_json_integer(j, "places_found", fit->nloss);
    om_json_open(j, "places", '[');
    for (int i = 0; i < fit->nloss && i < OM_MAX_LOSS; i++) {
        om_json_open(j, NULL, '{');
        om_json_string(j, "kind", fit->loss[i].is_added ? "too much" : "missing");
        om_json_number(j, "volume_ml", fit->loss[i].volume * 1e6);
        add_place(j, "at_mm", fit->loss[i].where);
        om_json_number(j, "depth_mm", fit->loss[i].depth * 1e3);
        om_json_close(j, '}');
    }
    om_json_close(j, ']');
    om_json_close(j, '}');
}

static OmStatus append_json(OmText* t, const OmPatient* p, const OmModelReport* r) {
    const OmMeshQuality* q = &r->quality;
    const double deg = 180 / OM_PI;
    OmJson j = om_json_begin(t);
    om_json_open(&j, NULL, '{');
    om_json_string(&j, "name", p->name);
    om_json_integer(&j, "nvert", q->nvert);
    om_json_integer(&j, "ntet", q->ntet);
    om_json_integer(&j, "nboundary_tri", q->nboundary_tri);
    om_json_integer(&j, "npart", q->npart);
    om_json_integer(&j, "euler", q->euler);
    om_json_bool(&j, "is_manifold", q->is_manifold);
    om_json_number(&j, "edge_asked_mm", r->edge * 1e3);
    om_json_number(&j, "edge_min_mm", q->edge_min * 1e3);
    om_json_number(&j, "edge_mean_mm", q->edge_mean * 1e3);
    om_json_number(&j, "edge_max_mm", q->edge_max * 1e3);
    om_json_number(&j, "dihedral_min_deg", q->dihedral_min * deg);
    om_json_number(&j, "dihedral_max_deg", q->dihedral_max * deg);
    om_json_open(&j, "dihedral_histogram_10deg", '[');
    for (int i = 0; i < OM_DIHEDRAL_BIN; i++) om_json_integer(&j, NULL, q->dihedral_bin[i]);
    om_json_close(&j, ']');
    if (r->selected[0]) {
        om_json_string(&j, "selected", r->selected);
        om_json_integer(&j, "label_voxels", r->nvoxel);
        om_json_number(&j, "label_volume_ml", r->label_volume * 1e6);
        om_json_number(&j, "label_error_percent", r->label_error * 100);
        om_json_number(&j, "left_out_ml", r->left_out * 1e6);
        om_json_number(&j, "filled_ml", r->filled * 1e6);
        om_json_open(&j, "part_volumes_ml", '[');
        for (int i = 0; i < r->npart_mask && i < OM_MAX_PART; i++)
            om_json_number(&j, NULL, r->part_volume[i] * 1e6);
        om_json_close(&j, ']');
    }
    om_json_number(&j, "organ_mask_volume_ml", r->mask_volume * 1e6);
    om_json_number(&j, "tissue_volume_ml", q->volume * 1e6);
    om_json_number(&j, "organ_surface_volume_ml", r->surface_volume * 1e6);
    om_json_number(&j, "volume_error_percent", r->volume_error * 100);
    om_json_number(&j, "surface_error_mean_mm", r->surface_error_mean * 1e3);
    om_json_number(&j, "surface_error_max_mm", r->surface_error_max * 1e3);
    om_json_number(&j, "surface_error_voxel", r->surface_error_voxel);
    om_json_number(&j, "level_shift_mm", r->level_shift * 1e3);
    if (r->has_fit) add_fit(&j, r);
    om_json_integer(&j, "elements_through_thickness", r->quality.nlayer);
    om_json_number(&j, "bending_error_percent", 100 * r->bending_error);
    om_json_integer(&j, "parts_found", r->npart_mask);
    om_json_integer(&j, "parts_kept", r->npart_kept);
    om_json_integer(&j, "capped_voxels", r->ncapped);
    om_json_open(&j, "sets", '{');
    for (int s = 0; s < p->mesh.nset; s++)
        om_json_integer(&j, p->mesh.set[s].name, p->mesh.set[s].nvert);
    om_json_close(&j, '}');
    om_json_integer(&j, "roi_points", p->nroi);
    om_json_number(&j, "seconds", r->seconds);
    om_json_string(&j, "note", r->note);
    om_json_string(&j, "warning", r->warning);
    om_json_close(&j, '}');
    return om_json_end(&j);
}

// ---- saving -------------------------------------------------------------------------------------------------

typedef OmStatus (*AppendFn)(OmText*, const OmPatient*, const OmModelReport*);

static OmStatus append_patient(OmText* t, const OmPatient* p, const OmModelReport* r) {
    (void)r;
    return append_yaml(t, p);
}

static OmStatus write_text(const OmPatient* p, const OmModelReport* r, AppendFn append,
                           const char* dir, const char* name) {
    OmText t = {0};
    char path[1024];
    OmStatus status = om_path_join(dir, name, path, sizeof path);
    if (status == OM_OK) status = append(&t, p, r);
    if (status == OM_OK) status = om_file_write(path, t.str, t.len);
    om_text_done(&t);
    return status;
}

static OmStatus write_all(const OmPatient* p, const OmModelReport* r, const char* dir) {
    char path[1024];
    OM_TRY(om_path_join(dir, "tissue.vtu", path, sizeof path));
    const OmMeshFrame frame = {OM_UNIT_M, p->file_space};
    OM_TRY(om_tet_mesh_save_frame(&p->mesh, path, frame));
    if (p->organ.ntri > 0) {
        OM_TRY(om_path_join(dir, "organ.ply", path, sizeof path));
        OM_TRY(om_surface_save_frame(&p->organ, path, frame));
    }
    OM_TRY(write_text(p, r, append_patient, dir, "patient.yaml"));
    if (!r) return OM_OK;
    OM_TRY(write_text(p, r, append_json, dir, "report.json"));
    OM_TRY(om_path_join(dir, "report.html", path, sizeof path));
    return om__model_save_page(p, r, path);
}

OmStatus om_patient_save(const OmPatient* patient, const OmModelReport* report, const char* dir) {
    OmFolder folder;
    OM_CHECK(patient->nroi <= MAX_ROI, OM_INVALID, "%d points of interest; at most %d",
             patient->nroi, MAX_ROI);
    OM_TRY(om_folder_begin(dir, OM_PATIENT_KIND, &folder));
    OmStatus status = write_all(patient, report, folder.path);
    if (status == OM_OK) status = om_folder_commit(&folder);
    om_folder_end(&folder);
    return status;
}

// ---- loading ------------------------------------------------------------------------------------------------

// The mesh must have the sets that the file names; otherwise it belongs to another model.
static OmStatus check_sets(const PatientFile* file, const OmTetMesh* mesh) {
    for (int i = 0; i < file->nset; i++) {
        const OmMeshSet* set = om_tet_mesh_find_set(mesh, file->set[i].name);
        if (!set && file->set[i].nvert == 0) continue;
        OM_CHECK(set, OM_INVALID, "set: %s has no set \"%s\"", file->mesh, file->set[i].name);
        OM_CHECK(set->nvert == file->set[i].nvert, OM_INVALID,
                 "set: \"%s\" has %d vertices in %s, not %d", set->name, set->nvert, file->mesh,
                 file->set[i].nvert);
    }
    return OM_OK;
}

// Check that every element has a material, the organ bounds a volume, and the region lies on it.
static OmStatus check_patient(const OmPatient* p) {
    OM_TRY(om__patient_check_materials(p));
    if (p->organ.nvert > 0) {
        OmStatus status = om_surface_require_closed(&p->organ);
        if (status < 0) return om_error_prefix(status, "organ");
    }
    double allowed = 0.005 + 2 * p->organ_spacing;
    for (int i = 0; i < p->nroi && p->organ.nvert > 0; i++) {
        double nearest = HUGE_VAL;
        OmVec3 x = om_load3(p->roi_point, i);
        for (int v = 0; v < p->organ.nvert; v++) {
            nearest = fmin(nearest, om_norm2(om_sub(om_load3(p->organ.x, v), x)));
        }
        OM_CHECK(sqrt(nearest) <= allowed, OM_INVALID,
                 "roi: point %d lies %.3g mm from the organ's surface", i, sqrt(nearest) * 1e3);
    }
    return OM_OK;
}

static OmStatus fill_patient(const PatientFile* file, const char* dir, OmPatient* p) {
    char path[1024];
    memcpy(p->name, file->name, sizeof p->name);
    memcpy(p->material, file->material, sizeof p->material);
    p->nmaterial = file->nmaterial;
    p->organ_spacing = file->organ_spacing;
    OM_CHECK(om_norm(file->up) > 1e-6, OM_INVALID, "up must be a direction");
    p->up = om_normalize(file->up);
    p->roi_center = file->roi_center;
    p->roi_radius = file->roi_radius;
    OM_TRY(om_path_join(dir, file->mesh, path, sizeof path));
    OM_TRY(om_tet_mesh_load(path, OM_UNIT_M, &p->mesh));
    OM_TRY(check_sets(file, &p->mesh));
    if (file->organ[0]) {
        OM_TRY(om_path_join(dir, file->organ, path, sizeof path));
        OM_TRY(om_surface_load(path, OM_UNIT_M, &p->organ));
    }
    OM_ALLOC(p->roi_point, 3 * (size_t)file->nroi);
    OM_ALLOC(p->roi_normal, 3 * (size_t)file->nroi);
    p->nroi = file->nroi;
    for (int i = 0; i < p->nroi; i++) {
        OM_CHECK(om_norm(file->roi_item[i].normal) > 1e-6, OM_INVALID,
                 "roi: the normal of point %d has no length", i);
        om_store3(p->roi_point, i, file->roi_item[i].point);
        om_store3(p->roi_normal, i, om_normalize(file->roi_item[i].normal));
    }
    return OM_OK;
}

OmStatus om_patient_load(const char* path, OmPatient* patient) {
    char dir[1024];
    memset(patient, 0, sizeof *patient);
    PatientFile* file = om_calloc(1, sizeof *file);
    if (!file) return OM_NO_MEMORY;
    file->organ_spacing = 0.002;
    OmStatus status = om_yaml_load(path, &patient_schema, file);
    if (status == OM_OK) {
        status = om_path_dir(path, dir, sizeof dir);
        if (status == OM_OK) status = fill_patient(file, dir, patient);
        if (status == OM_OK) status = check_patient(patient);
        if (status < 0) om_error_prefix(status, "%s", path);
    }
    om_free(file);
    if (status < 0) om_patient_done(patient);
    return status;
}
