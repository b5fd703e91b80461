// scene_model.c: the pipeline from a file to a patient model.
//
//   read -> select -> clean -> distance field -> surface, mesh (or sheet) -> materials -> report
//
// A mesh of a label, of a surface or of a sheet is judged in both directions (scene_model_fit.c). A lattice whose edges
// are about as long as a sheet is thick loses half of it; where such edges are to be kept, the level is shifted until
// the mesh has the sheet's volume, and a warning says how far.
#include <math.h>
#include <stdarg.h>
#include <string.h>

#include "scene/scene_model_internal.h"

#define VOLUME_GOAL 0.001  // relative volume error at which the shifts end
#define VOLUME_LIMIT 0.02  // larger errors refine the edge, or give a warning
#define MAX_SHIFT 5        // shifts of the level for one edge length
#define MAX_REFINE 4       // refinements, each by a factor of 0.8
// Processor time for one element, s, measured on a liver of 0.1 to 6 million.
#define TET_SECONDS 4e-6
#define SAID_FROM 30  // s: a longer duration is logged before meshing
#define MAX_TET 2e7   // larger meshes are refused before meshing

static void append(char* text, size_t size, const char* format, va_list args) {
    const size_t len = strlen(text);
    vsnprintf(text + len, size - len, format, args);
}

void om__model_append(char* text, size_t size, const char* format, ...) {
    va_list args;
    va_start(args, format);
    append(text, size, format, args);
    va_end(args);
}

void om__model_warn(OmModelReport* report, const char* format, ...) {
    va_list args;
    va_start(args, format);
    if (report->warning[0]) om__model_append(report->warning, sizeof report->warning, "; ");
    append(report->warning, sizeof report->warning, format, args);
    va_end(args);
}

void om__model_note(OmModelReport* report, const char* format, ...) {
    va_list args;
    va_start(args, format);
    if (report->note[0]) om__model_append(report->note, sizeof report->note, "\n");
    append(report->note, sizeof report->note, format, args);
    va_end(args);
}

// ---- the def -------------------------------------------------------------------------------------------

static void base_name(const char* path, char* out, size_t size) {
    const char* slash = strrchr(path, '/');
    snprintf(out, size, "%s", slash ? slash + 1 : path);
    char* dot = strchr(out, '.');
    if (dot && dot != out) *dot = 0;
    om_text_make_plain(out, size);
}

OmModelDef om_model_default_def(const char* input, double edge) {
    OmModelDef def = {.cookie = OM__MODEL_COOKIE,
                      .volume = -1,
                      .min_share = 0.01,
                      .connectivity = 6,
                      .smooth = 1.2,
                      .max_volume_size = OM_VOLUME_MAX_SIZE,
                      .edge = edge,
                      .has_bending_test = true,
                      .refine = true};
    snprintf(def.input, sizeof def.input, "%s", input);
    base_name(input, def.name, sizeof def.name);
    snprintf(def.sheet.side, sizeof def.sheet.side, "anterior");
    def.sheet.bridge = 0.02;
    def.sheet.tumour_radius = 0.012;
    def.sheet.tumour_height = 0.003;
    def.sheet.nroi = 200;
    def.over.roi = -1;
    def.over.nroi = 200;
    snprintf(def.over.side, sizeof def.over.side, "anterior");
    return def;
}

static OmStatus check_material(const OmPatientMaterial* m) {
    OM_CHECK(om_text_is_plain(m->name, strlen(m->name), NULL), OM_INVALID,
             "material: the name \"%s\" is no UTF-8 or has a control character", m->name);
    OM_CHECK(m->young > 0 && isfinite(m->young), OM_INVALID,
             "material \"%s\": Young's modulus %g Pa must be positive", m->name, m->young);
    OM_CHECK(m->poisson >= 0 && m->poisson <= 0.4999, OM_INVALID,
             "material \"%s\": Poisson's ratio %g must be at least 0 and at most 0.4999", m->name,
             m->poisson);
    OM_CHECK(m->density > 0 && isfinite(m->density), OM_INVALID,
             "material \"%s\": density %g kg/m3 must be positive", m->name, m->density);
    return OM_OK;
}

static OmStatus check_def(const OmModelDef* def) {
    OM_CHECK(def->cookie == OM__MODEL_COOKIE, OM_INVALID,
             "OmModelDef was not made by om_model_default_def");
    OM_CHECK(def->edge >= 1e-5 && def->edge <= 1, OM_INVALID,
             "edge: %g mm is outside 0.01 to 1000 mm", def->edge * 1e3);
    OM_CHECK(def->nlabel >= 0 && def->nlabel <= OM_MAX_LABEL, OM_INVALID,
             "label: %d labels; at most %d", def->nlabel, OM_MAX_LABEL);
    OM_CHECK(def->nlabel_name >= 0 && def->nlabel_name <= OM_MAX_LABEL - def->nlabel, OM_INVALID,
             "label: %d labels; at most %d", def->nlabel + def->nlabel_name, OM_MAX_LABEL);
    OM_CHECK(def->volume >= -1, OM_INVALID, "volume: %d; volumes count from 0", def->volume);
    OM_CHECK(def->npart >= 0 && def->npart <= OM_MAX_PART, OM_INVALID, "part: %d parts; at most %d",
             def->npart, OM_MAX_PART);
    OM_CHECK(!def->npart || !def->keep_all, OM_INVALID,
             "part: all parts are kept, and some are chosen: do one of both");
    OM_CHECK(!def->has_window || def->window_lo <= def->window_hi, OM_INVALID,
             "window: %g to %g is empty", def->window_lo, def->window_hi);
    OM_CHECK(def->threshold >= 0 && def->threshold <= 1 && !(def->threshold > 0 && def->has_window),
             OM_INVALID, "threshold: %g is outside 0 to 1, or beside a window", def->threshold);
    OM_CHECK(def->connectivity == 6 || def->connectivity == 26, OM_INVALID,
             "connectivity: %d; it can be 6 or 26", def->connectivity);
    OM_CHECK(def->min_share >= 0 && def->min_share <= 1, OM_INVALID,
             "min_share: %g is outside 0 to 1", def->min_share);
    OM_CHECK(def->close_radius >= 0 && def->close_radius <= 0.1, OM_INVALID,
             "close: %g mm is outside 0 to 100 mm", def->close_radius * 1e3);
    OM_CHECK(def->smooth >= 0.5 && def->smooth <= 3, OM_INVALID,
             "smooth: %g voxels is outside 0.5 to 3", def->smooth);
    OM_CHECK(def->unit >= 0 && isfinite(def->unit), OM_INVALID, "unit: %g m must be positive",
             def->unit);
    OM_CHECK(def->nmaterial >= 0 && def->nmaterial <= OM_MAX_MATERIAL, OM_INVALID,
             "material: %d materials; at most %d", def->nmaterial, OM_MAX_MATERIAL);
    for (int i = 0; i < def->nmaterial; i++) OM_TRY(check_material(&def->material[i]));
    OM_CHECK(def->over.nlabel >= 0 && def->over.nlabel <= OM_MAX_LABEL, OM_INVALID,
             "over: %d labels; at most %d", def->over.nlabel, OM_MAX_LABEL);
    OM_CHECK(def->over.nlabel == 0 || !(def->sheet.thickness > 0), OM_INVALID,
             "over and sheet exclude each other: a sheet is made, labelled tissue is there");
    OM_CHECK(
        (def->sheet.nattach == 0 || def->sheet.thickness > 0) &&
            (def->over.nattach == 0 || def->over.nlabel > 0),
        OM_INVALID,
        "attach: attachments in words belong to a sheet of fat or to tissue over an organ, and "
        "the model has neither; an organ alone is attached when it is simulated");
    OM_CHECK(def->name[0] && !strchr(def->name, '/') && def->name[0] != '.', OM_INVALID,
             "name: \"%s\" cannot be the name of a file", def->name);
    OM_CHECK(om_text_is_plain(def->name, strlen(def->name), NULL), OM_INVALID,
             "name: \"%s\" is no UTF-8 or has a control character", def->name);
    return OM_OK;
}

// ---- directions ------------------------------------------------------------------------------------------

OmStatus om_model_direction(const char* words, bool is_left, OmVec3* direction) {
    static const char* const name[] = {"right",    "left",     "anterior", "posterior",
                                       "superior", "inferior", "lateral",  "medial"};
    const double outward = is_left ? -1 : 1;  // +x is the patient's right
    const OmVec3 value[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0},       {0, -1, 0},
                            {0, 0, 1}, {0, 0, -1}, {outward, 0, 0}, {-outward, 0, 0}};
    *direction = om_vec3(0, 0, 0);
    for (size_t i = 0; i < sizeof name / sizeof *name; i++) {
        if (strcmp(words, name[i]) != 0) continue;
        *direction = value[i];
        return OM_OK;
    }
    double x, y, z;
    char rest;
    if (sscanf(words, "%lf,%lf,%lf%c", &x, &y, &z, &rest) == 3) {
        OmVec3 v = om_vec3(x, y, z);
        OM_CHECK(om_is_finite3(v) && om_norm(v) > 1e-12, OM_INVALID,
                 "direction \"%s\" has no length", words);
        *direction = om_normalize(v);
        return OM_OK;
    }
    const char* near = om_nearest_word(words, name, (int)(sizeof name / sizeof *name));
    return om_error(OM_INVALID,
                    "\"%s\" is no direction%s%s%s: use right, left, anterior, posterior, superior, "
                    "inferior, lateral, medial or x,y,z",
                    words, near ? " (did you mean \"" : "", near ? near : "", near ? "\"?)" : "");
}

// ---- meshing to a volume -------------------------------------------------------------------------------------

OmStatus om__boundary_area(const OmTetMesh* mesh, double* area) {
    OmSurface s;
    OM_TRY(om_tet_mesh_boundary(mesh, &s, NULL));
    *area = 0;
    for (int t = 0; t < s.ntri; t++) {
        const int* v = &s.tri_vert[3 * (size_t)t];
        OmVec3 a = om_load3(s.x, v[0]);
        OmVec3 n = om_cross(om_sub(om_load3(s.x, v[1]), a), om_sub(om_load3(s.x, v[2]), a));
        *area += 0.5 * om_norm(n);
    }
    om_surface_done(&s);
    return OM_OK;
}

// Mesh with one edge length; *error is the remaining volume error.
static OmStatus mesh_at_edge(const OmMeshTask* task, double volume, double edge,
                             const OmProgress* progress, OmTetMesh* mesh, double* level,
                             double* error) {
    OmStuffDef def = om_stuff_default_def(edge, task->fn, task->ctx, task->lo, task->hi);
    def.nworker = task->nworker;
    *level = 0;
    for (int it = 0;; it++) {
        double area;
        def.level = *level;
        *task->level = *level;
        OM_TRY(om_progress_report(progress, "meshing", it, MAX_SHIFT));
        OM_TRY(om_tet_mesh_stuff(&def, mesh));
        OmStatus status = om_tet_mesh_keep_parts(mesh, 0, NULL, NULL);
        const double missing = volume - om_tet_mesh_volume(mesh);
        *error = fabs(missing / volume);  // volume > 0
        if (status == OM_OK && *error > VOLUME_GOAL && it < MAX_SHIFT) {
            status = om__boundary_area(mesh, &area);
            double step = area > 0 ? missing / area : 0;
            double next = fmax(-0.5 * edge, fmin(0.5 * edge, *level + step));
            if (status == OM_OK && fabs(next - *level) > 1e-6 * edge) {
                *level = next;
                om_tet_mesh_done(mesh);
                continue;
            }
        }
        if (status < 0) om_tet_mesh_done(mesh);
        return status;
    }
}

OmStatus om__model_check_size(double volume, double edge) {
    const double ntet = OM__TET_DENSITY * volume / (edge * edge * edge);  // edge > 0 by check_def
    OM_CHECK(ntet < MAX_TET, OM_INVALID,
             "an edge of %.3g mm would make %.0f million tetrahedra, above %.0f million: use a "
             "larger edge",
             edge * 1e3, ntet * 1e-6, MAX_TET * 1e-6);
    if (TET_SECONDS * ntet > SAID_FROM)
        om_log(OM_LOG_WARNING,
               "an edge of %.3g mm makes about %.2g million tetrahedra, which take a minute of one "
               "processor for every 15 million, and as long again to write",
               edge * 1e3, ntet * 1e-6);
    return OM_OK;
}

OmStatus om__mesh_with_volume(const OmMeshTask* task, double volume, const OmProgress* progress,
                              OmTetMesh* mesh, OmModelReport* report) {
    double edge = task->edge, best = HUGE_VAL;
    OmStatus last = OM_OK;
    memset(mesh, 0, sizeof *mesh);
    for (int step = 0; step <= (task->refine ? MAX_REFINE : 0); step++, edge *= 0.8) {
        OmTetMesh trial;
        double level = 0, error = 0;
        last = mesh_at_edge(task, volume, edge, progress, &trial, &level, &error);
        // parts thinner than this edge were lost: the next edge may represent them
        if (last == OM_INVALID) continue;
        if (last < 0) break;
        if (error < best) {
            om_tet_mesh_done(mesh);
            *mesh = trial;
            best = error;
            report->edge = edge;
            report->level_shift = level;
            report->volume_error = error;
        } else {
            om_tet_mesh_done(&trial);
        }
        if (best <= VOLUME_LIMIT) break;
    }
    if (mesh->ntet == 0 || (last < 0 && last != OM_INVALID)) {
        om_tet_mesh_done(mesh);
        return last;
    }
    if (report->edge < task->edge) {
        om__model_warn(report, "parts are thinner than the edge of %.3g mm: meshed with %.3g mm",
                       task->edge * 1e3, report->edge * 1e3);
    }
    if (report->level_shift > 0.1 * task->voxel) {
        om__model_warn(report,
                       "its top and rims lie up to %.2g mm outside of the sheet, so that the mesh "
                       "has its volume",
                       report->level_shift * 1e3);
    }
    if (best > VOLUME_LIMIT) {
        om__model_warn(report, "the mesh's volume is %.1f %% off: use edges below %.3g mm",
                       best * 100, report->edge * 1e3);
    }
    return OM_OK;
}

// How well the mesh bends, and a warning where it does not. The error falls about as the edge.
static OmStatus measure_bending(const OmPatient* patient, OmModelReport* report) {
    OM_TRY(om_patient_find_bending_error(patient, &report->bending_error));
    if (report->bending_error > OM_BENDING_LIMIT)
        om__model_warn(
            report,
            "bending error of this mesh: %.0f %% with quadratic elements, above %.0f %%; "
            "use edges below %.2g mm",
            100 * report->bending_error, 100 * OM_BENDING_LIMIT,
            1e3 * report->quality.edge_mean * OM_BENDING_LIMIT / report->bending_error);
    return OM_OK;
}

// ---- the organ as tissue ---------------------------------------------------------------------------------------

static OmStatus mesh_organ(const OmModelDef* def, OmBody* body, const OmProgress* progress,
                           OmPatient* patient, OmModelReport* report) {
    if (body->has_mesh) {  // a volume mesh is used without remeshing
        patient->mesh = body->mesh;
        memset(&body->mesh, 0, sizeof body->mesh);
        report->edge = 0;
        report->mesh_volume = om_tet_mesh_volume(&patient->mesh);
        return OM_OK;
    }
    OM_TRY(om__mesh_solid(def, body, progress, patient, report));
    OM_TRY(om_progress_report(progress, "labels", 0, 1));
    om__body_label_elements(def, body, &patient->mesh);
    return OM_OK;
}

static OmStatus refuse_loss(const OmModelDef* def, const OmModelReport* report) {
    char text[1024];
    if (!report->has_loss || def->allow_loss) return OM_OK;
    om_model_describe_loss(report, text, sizeof text);
    return om_error(OM_INVALID, "%s: %s; or allow the loss", def->input[0] ? def->input : def->name,
                    text);
}

static void default_materials(const OmModelDef* def, OmPatient* patient) {
    memcpy(patient->material, def->material, sizeof patient->material);
    patient->nmaterial = def->nmaterial;
    if (patient->nmaterial > 0) return;
    // adipose tissue and a soft organ; density of fat and of water
    const bool is_sheet = def->sheet.thickness > 0 || def->over.nlabel > 0;
    OmPatientMaterial m = {.label = -1, .young = is_sheet ? 3000 : 5000, .poisson = 0.45};
    m.density = is_sheet ? 920 : 1060;
    snprintf(m.name, sizeof m.name, "%s", is_sheet ? "adipose tissue" : "soft tissue");
    patient->material[0] = m;
    patient->nmaterial = 1;
}

// Distance of the mesh's boundary to the solid: of a mesh that was made here, of its fit; of one from a file, to its
// distance field, at vertices and centres of triangles.
static OmStatus surface_error(const OmBody* body, const OmTetMesh* mesh, OmModelReport* report) {
    OmSurface s;
    if (report->has_fit) {
        report->surface_error_mean = report->fit.to_solid.mean;
        report->surface_error_max = report->fit.to_solid.max;
        return OM_OK;
    }
    OM_TRY(om_tet_mesh_boundary(mesh, &s, NULL));
    double sum = 0;
    for (int i = 0; i < s.nvert + s.ntri; i++) {
        OmVec3 x;
        if (i < s.nvert) {
            x = om_load3(s.x, i);
        } else {
            const int* v = &s.tri_vert[3 * (size_t)(i - s.nvert)];
            x = om_add(om_load3(s.x, v[0]), om_add(om_load3(s.x, v[1]), om_load3(s.x, v[2])));
            x = om_scale(1.0 / 3, x);
        }
        double d = fabs(om_sdf_eval(&body->sdf, x, NULL));
        sum += d;
        report->surface_error_max = fmax(report->surface_error_max, d);
    }
    report->surface_error_mean = s.nvert ? sum / (s.nvert + s.ntri) : 0;
    om_surface_done(&s);
    return OM_OK;
}

int om_patient_find_material(const OmPatient* p, int label) {
    int other = -1;
    for (int i = p->nmaterial - 1; i >= 0; i--)
        if (p->material[i].label < 0) other = i;
    for (int i = 0; i < p->nmaterial; i++)
        if (p->material[i].label == label) return i;
    return other;
}

OmStatus om__patient_check_materials(const OmPatient* p) {
    for (int e = 0; e < p->mesh.ntet; e++) {
        OM_CHECK(om_patient_find_material(p, p->mesh.tet_label[e]) >= 0, OM_INVALID,
                 "no material for label %d (element %d); label -1 stands for all others",
                 p->mesh.tet_label[e], e);
    }
    return OM_OK;
}

OmStatus om_model_build(const OmModelDef* def, const OmProgress* progress, OmPatient* patient,
                        OmModelReport* report) {
    return om_model_build_volume(def, NULL, progress, patient, report);
}

OmStatus om_model_build_volume(const OmModelDef* def, const OmVolume* volume,
                               const OmProgress* progress, OmPatient* patient,
                               OmModelReport* report) {
    OmStatus status = OM_OK;
    OmBody body = {0};
    OmModelReport local;
    const bool is_reported = report != NULL;
    if (!report) report = &local;
    memset(patient, 0, sizeof *patient);
    memset(report, 0, sizeof *report);
    report->bending_error = NAN;
    double start = om_clock_now();
    OM_TRY_DONE(check_def(def));
    if (def->sheet.thickness > 0) OM_TRY_DONE(om__sheet_check(def, report));
    const bool is_sheet = def->sheet.thickness > 0;
    double margin = is_sheet
                        ? def->sheet.thickness + def->sheet.gap + def->sheet.bridge + 3 * def->edge
                        : def->edge;
    OM_TRY_DONE(om__body_load(def, margin, progress, volume, &body, report));
    snprintf(patient->name, sizeof patient->name, "%s", def->name);
    default_materials(def, patient);

    OM_TRY_DONE(om_progress_report(progress, "surface", 0, 1));
    OM_TRY_DONE(om_surface_from_sdf(&body.sdf, 0, &patient->organ));
    patient->organ_spacing = body.sdf.grid.spacing;
    report->surface_volume = om_surface_volume(&patient->organ);
    patient->up = om_vec3(0, 1, 0);

    if (is_sheet) {
        OM_TRY_DONE(om__sheet_build(def, &body, progress, patient, report));
    } else {
        OM_TRY_DONE(mesh_organ(def, &body, progress, patient, report));
    }
    OM_TRY_DONE(refuse_loss(def, report));
    OM_TRY_DONE(om_progress_report(progress, "surface error", 0, 1));
    OM_TRY_DONE(surface_error(&body, &patient->mesh, report));
    if (!is_sheet) {
        om_surface_done(&patient->organ);  // it is the tissue itself, not the organ below it
        if (def->over.nlabel > 0)
            OM_TRY_DONE(om__over_build(def, volume, progress, patient, report));
    }
    OM_TRY_DONE(om__patient_check_materials(patient));
    OM_TRY_DONE(om_progress_report(progress, "quality", 0, 1));
    OM_TRY_DONE(om_tet_mesh_quality(&patient->mesh, &report->quality));
    if (report->label_volume > 0) {
        double built = is_sheet ? report->surface_volume : report->quality.volume;
        report->label_error = built / report->label_volume - 1;
    }
    if (report->ncapped > 0) {
        om__model_warn(report, "the volume cuts the organ: %d voxels on its border were capped",
                       report->ncapped);
    }
    if (is_reported && def->has_bending_test) {
        OM_TRY_DONE(om_progress_report(progress, "bending", 0, 1));
        OM_TRY_DONE(measure_bending(patient, report));
    }
    if (!report->quality.is_manifold) {
        om__model_warn(report, "the boundary touches itself in single edges");
    }
    report->seconds = om_clock_now() - start;
done:
    om__body_done(&body);
    if (status < 0) om_patient_done(patient);
    return status;
}

void om_patient_done(OmPatient* patient) {
    if (!patient) return;
    om_tet_mesh_done(&patient->mesh);
    om_surface_done(&patient->organ);
    om_free(patient->roi_point);
    om_free(patient->roi_normal);
    om_free(patient->gap);
    om_surface_done(&patient->missed);
    memset(patient, 0, sizeof *patient);
}
