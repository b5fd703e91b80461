// study_contact.c: the contact study from a definition to its report.
//
//   DIR/meshes/NNNNNN.vtu            a mesh, kept between runs of the program
//   DIR/truth/lesion-NN.json         displacement of a lesion, computed as the truth
//   DIR/runs/METHOD-NNNNNN-NN.json   one run: method, requested elements, lesion
//   DIR/report.html, study.json, runs.csv, errors.csv
//
// Each file is written atomically and contains a hash of everything it depends on. A file with the right
// hash is not computed again: a killed study continues with the run that was interrupted.
#include <float.h>
#include <math.h>
#include <string.h>

#include "omentum/shape_file.h"
#include "omentum/tissue.h"
#include "studies/study_cases.h"
#include "studies/study_internal.h"

#define COOKIE 0x57d1c027u
// Ratio of a mesh's elements to the triangles of its boundary that can be in contact.
#define SURFACE_NTET 6.555
#define VERSION 2  // part of the hash of a run, besides the definition
// Processor times for the estimate, s: of a truth with 4,000 elements, and of a run by an element.
#define SECONDS_TRUTH 22
#define SECONDS_ELEMENT 4e-4

OmStudyContactDef om_study_contact_default_def(const OmStudyBody* body, const char* out_dir) {
    OmStudyContactDef def = {
        .body = body,
        .out_dir = out_dir,
        .nresolution = 9,
        .resolution = {623, 1363, 2539, 4126, 7369, 12861, 26220, 105004, 176506},
        .has_method = {true, true, true},
        .depth = {0.010, 0.015, 0.020, 0.025, 0.030},
        .speed = 0.01,
        .time_step = 0.02,
        .material = {.young = 3000, .poisson = 0.45, .law = OM_NEO_HOOKEAN},
        .density = 1000,
        .rayleigh_mass = 0.1,
        .contact_ntri = 4000,
        .tolerance = 1e-3,
        .max_iterations = 400,
        .max_penetration = 0.0005,
        .truth_ntet = 35000,
        .lesion_ratio = 7.5,
        .probe_noise = 0.0007147,
        .pointer_noise = 0.000334,
        .seed = 1,
        .cookie = COOKIE,
    };
    return def;
}

// ---- the definition -------------------------------------------------------------------------------

static OmStatus validate(const OmStudyContactDef* def) {
    OM_CHECK(def->body, OM_INVALID, "contact study: no body");
    const StudyRange range[] = {{"nresolution", def->nresolution, 1, OM_STUDY_MAX_RESOLUTION},
                                {"nlesion", def->nlesion, 0, def->body->nlesion},
                                {"contact_ntri", def->contact_ntri, 100, 200000},
                                {"truth_ntet", def->truth_ntet, 800, 2000000},
                                {"speed", def->speed, DBL_MIN, 1},
                                {"time_step", def->time_step, DBL_MIN, 1},
                                {"tolerance", def->tolerance, DBL_MIN, 1},
                                {"max_penetration", def->max_penetration, DBL_MIN, 1},
                                {"lesion_ratio", def->lesion_ratio, DBL_MIN, 1e6}};
    OM_TRY(STUDY_CHECK("contact study", def, COOKIE, range));
    for (int i = 0; i < def->nresolution; ++i)
        OM_CHECK(def->resolution[i] >= 100 &&
                     (i == 0 || def->resolution[i] > def->resolution[i - 1]),
                 OM_INVALID, "contact study: resolution[%d] = %d; ascending numbers from 100 up", i,
                 def->resolution[i]);
    for (int i = 0; i < OM_STUDY_NDEPTH; ++i)
        OM_CHECK(def->depth[i] > 0 && (i == 0 || def->depth[i] > def->depth[i - 1]), OM_INVALID,
                 "contact study: depth[%d] = %g m; ascending numbers above 0", i, def->depth[i]);
    OM_CHECK(om__study_nstep(def, -1) <= OM_STUDY_MAX_STEP, OM_INVALID,
             "contact study: %d steps to the last depth; the limit is %d", om__study_nstep(def, -1),
             OM_STUDY_MAX_STEP);
    return om_material_validate(&def->material, "contact study: material");
}

int om__study_nlesion(const OmStudyContactDef* def) {
    return def->nlesion ? def->nlesion : def->body->nlesion;
}

static uint64_t hash_numbers(uint64_t hash, const double* value, int n) {
    return om_hash(value, (size_t)n * sizeof *value, hash);
}

uint64_t om__study_hash_body(const OmStudyBody* body) {
    uint64_t hash = om_hash(body->name, sizeof body->name, OM_HASH_SEED);
    const double box[] = {body->lo.x, body->lo.y,   body->lo.z,   body->hi.x,
                          body->hi.y, body->hi.z,   body->up.x,   body->up.y,
                          body->up.z, body->half.x, body->half.y, body->half.z};
    hash = hash_numbers(hash, box, 12);
    if (body->is_file) {
        size_t n = om_grid_count(body->sdf.grid.dim);
        hash = om_hash(body->sdf.d, n * sizeof *body->sdf.d, hash);
        hash = hash_numbers(hash, body->attached, 3 * body->nattached);
    }
    return hash;
}

// Hash of body, material and path: inputs of both runs and truth.
uint64_t om__study_hash_task(const OmStudyContactDef* def) {
    const OmMaterial* m = &def->material;
    const double value[] = {VERSION, m->young, m->poisson, m->law,     m->volumetric, m->bulk,
                            m->c10,  m->c01,   m->nterm,   def->speed, def->time_step};
    uint64_t hash = hash_numbers(om__study_hash_body(def->body), value, 11);
    hash = hash_numbers(hash, m->ogden_mu, OM_MAX_OGDEN);
    hash = hash_numbers(hash, m->ogden_alpha, OM_MAX_OGDEN);
    return hash_numbers(hash, def->depth, OM_STUDY_NDEPTH);
}

static uint64_t hash_run(const OmStudyContactDef* def, int lesion) {
    const OmStudyLesion* l = &def->body->lesion[lesion];
    const double value[] = {
        def->density,   def->rayleigh_mass,  def->contact_ntri,    def->friction,
        def->tolerance, def->max_iterations, def->max_penetration, l->center.x,
        l->center.y,    l->center.z,         l->touch.x,           l->touch.y,
        l->touch.z,     l->normal.x,         l->normal.y,          l->normal.z};
    return hash_numbers(om__study_hash_task(def), value, 16);
}

// ---- running the study ----------------------------------------------------------------------------

OmStatus om__study_path(const OmStudyContactDef* def, char* out, size_t size, const char* format,
                        ...) {
    char name[128];
    va_list args;
    va_start(args, format);
    vsnprintf(name, sizeof name, format, args);
    va_end(args);
    return om_path_join(def->out_dir, name, out, size);
}

OmStatus om__study_get_mesh(const OmStudyContactDef* def, int ntet, OmTetMesh* mesh) {
    char path[1024];
    memset(mesh, 0, sizeof *mesh);
    OM_TRY(om__study_path(def, path, sizeof path, "meshes/%06d-%08x.vtu", ntet,
                          (unsigned)om__study_hash_body(def->body)));
    if (om_path_exists(path)) return om_tet_mesh_load(path, OM_UNIT_M, mesh);
    OM_TRY(om_study_body_mesh(def->body, ntet, def->nworker, mesh));
    OmStatus status = om_tet_mesh_save(mesh, path, OM_UNIT_M);
    if (status < 0) om_tet_mesh_done(mesh);
    return status;
}

OmStatus om__study_get_surface(const OmStudyContactDef* def, OmSurface* surface) {
    OmTetMesh mesh;
    memset(surface, 0, sizeof *surface);
    OM_TRY(om__study_get_mesh(def, (int)(SURFACE_NTET * def->contact_ntri), &mesh));
    OmStatus status = om_contact_surface_make(&mesh, def->contact_ntri, surface);
    om_tet_mesh_done(&mesh);
    return status;
}

static OmStatus open_folders(const OmStudyContactDef* def) {
    static const char* const name[] = {"meshes", "truth", "runs"};
    char path[1024];
    for (int i = 0; i < 3; ++i) {
        OM_TRY(om__study_path(def, path, sizeof path, "%s", name[i]));
        OM_TRY(om_path_make_dir(path));
    }
    return OM_OK;
}

static OmStatus begin_runs(Study* s) {
    const OmStudyContactDef* def = s->def;
    s->nlesion = om__study_nlesion(def);
    s->nrun = def->nresolution * OM_STUDY_NMETHOD * s->nlesion;
    s->run = om_calloc((size_t)s->nrun, sizeof *s->run);
    if (!s->run) return OM_NO_MEMORY;
    for (int i = 0; i < s->nrun; ++i) {
        StudyRun* run = &s->run[i];
        run->lesion = i % s->nlesion;
        run->method = i / s->nlesion % OM_STUDY_NMETHOD;
        run->resolution = def->resolution[i / s->nlesion / OM_STUDY_NMETHOD];
        snprintf(run->setup, sizeof run->setup, "%016llx",
                 (unsigned long long)hash_run(def, run->lesion));
        run->step = om_calloc(OM_STUDY_MAX_STEP, sizeof *run->step);
        if (!run->step) return OM_NO_MEMORY;
    }
    return OM_OK;
}

static OmStatus run_path(const Study* s, const StudyRun* run, char* path, size_t size) {
    return om__study_path(s->def, path, size, "runs/%s-%06d-%02d.json",
                          om__study_method_name[run->method], run->resolution, run->lesion + 1);
}

// Read the run's file if it is valid; otherwise compute the run again.
static OmStatus find_run(Study* s, StudyRun* run) {
    char path[1024];
    OM_TRY(run_path(s, run, path, sizeof path));
    if (!om_path_exists(path)) return OM_OK;
    OmStatus status = om__study_load_run(path, run);
    if (status == OM_OK) s->nfound++;
    return status == OM_NO_MEMORY ? status : OM_OK;
}

static OmStatus make_runs(Study* s, int resolution, StudyRun* run, int n) {
    const OmStudyContactDef* def = s->def;
    OmTetMesh mesh;
    StudyStage stage = {.probe = s->probe, .surface = &s->surface};
    OM_TRY(om__study_get_mesh(def, resolution, &mesh));
    OmStatus status = om__study_stage_create(def, &mesh, &stage);
    for (int i = 0; i < n && status == OM_OK; ++i) {
        if (run[i].nrecord || !def->has_method[run[i].method]) continue;
        char path[1024], what[96];
        snprintf(what, sizeof what, "%d elements, %s, lesion %d", mesh.ntet,
                 om__study_method_name[run[i].method], run[i].lesion + 1);
        status = om_progress_report(s->progress, what, s->nfound + s->nmade, s->nrun);
        if (status == OM_OK) status = om__study_press(&stage, &run[i]);
        if (status == OM_OK) status = run_path(s, &run[i], path, sizeof path);
        if (status == OM_OK) status = om__study_save_run(&run[i], path);
        s->nmade++;
    }
    om__study_stage_done(&stage);
    om_tet_mesh_done(&mesh);
    return status;
}

static OmStatus do_runs(Study* s) {
    const OmStudyContactDef* def = s->def;
    int n = OM_STUDY_NMETHOD * s->nlesion;
    for (int k = 0; k < def->nresolution; ++k) {
        bool is_missing = false;
        for (int i = 0; i < n; ++i) {
            OM_TRY(find_run(s, &s->run[k * n + i]));
            is_missing |= !s->run[k * n + i].nrecord && def->has_method[s->run[k * n + i].method];
        }
        if (is_missing) OM_TRY(make_runs(s, def->resolution[k], &s->run[k * n], n));
    }
    return OM_OK;
}

// ---- truth ----------------------------------------------------------------------------------------

static OmStatus truth_path(const Study* s, int lesion, char* path, size_t size) {
    return om__study_path(s->def, path, size, "truth/lesion-%02d.json", lesion + 1);
}

static OmStatus make_truth(Study* s, const bool* is_found) {
    StudyTruth* truth;
    OM_TRY(om__study_truth_create(s->def, s->probe, &truth));
    OmStatus status = OM_OK;
    for (int i = 0; i < s->nlesion && status == OM_OK; ++i) {
        char path[1024];
        if (is_found[i]) continue;
        status = om__study_truth_solve(truth, i, s->progress, &s->truth[i]);
        if (status == OM_OK) status = truth_path(s, i, path, sizeof path);
        if (status == OM_OK) status = om__study_save_truth(&s->truth[i], path);
        // rounded as in the file, so that the next start of the study has the same numbers
        if (status == OM_OK) status = om__study_load_truth(path, &s->truth[i]);
    }
    om__study_truth_destroy(truth);
    return status;
}

static OmStatus do_truth(Study* s) {
    bool is_found[OM_STUDY_MAX_LESION] = {false};
    int nfound = 0;
    s->truth = om_calloc((size_t)s->nlesion, sizeof *s->truth);
    if (!s->truth) return OM_NO_MEMORY;
    for (int i = 0; i < s->nlesion; ++i) {
        char path[1024];
        StudyTruthResult* t = &s->truth[i];
        t->lesion = i;
        snprintf(t->setup, sizeof t->setup, "%016llx",
                 (unsigned long long)om__study_hash_truth(s->def, i));
        OM_TRY(truth_path(s, i, path, sizeof path));
        if (om_path_exists(path)) {
            OmStatus status = om__study_load_truth(path, t);
            if (status == OM_NO_MEMORY) return status;
            is_found[i] = status == OM_OK;
        }
        nfound += is_found[i];
    }
    return nfound == s->nlesion ? OM_OK : make_truth(s, is_found);
}

// What the folder does not have; files of other settings count as there.
static OmStatus tell(const Study* s) {
    const OmStudyContactDef* def = s->def;
    double run_seconds = 0;
    int nrun = 0, ntruth = 0;
    char path[1024];
    for (int i = 0; i < s->nlesion; ++i) {
        OM_TRY(truth_path(s, i, path, sizeof path));
        ntruth += !om_path_exists(path);
    }
    for (int i = 0; i < s->nrun; ++i) {
        if (!def->has_method[s->run[i].method]) continue;
        OM_TRY(run_path(s, &s->run[i], path, sizeof path));
        if (om_path_exists(path)) continue;
        run_seconds += SECONDS_ELEMENT * s->run[i].resolution;
        ++nrun;
    }
    const double truth_seconds = SECONDS_TRUTH * pow(def->truth_ntet / 4000.0, 1.6);
    const StudyWork work[] = {{"truths", ntruth, truth_seconds, true},
                              {"runs", nrun, nrun ? run_seconds / nrun : 0, true}};
    return om__study_estimate_tell(work, 2, def->nworker, s->progress);
}

void om__study_close(Study* s) {
    om_free(s->truth);
    for (int i = 0; s->run && i < s->nrun; ++i) om_free(s->run[i].step);
    om_free(s->run);
    om_probe_destroy(s->probe);
    om_surface_done(&s->surface);
}

OmStatus om__study_open(const OmStudyContactDef* def, const OmProgress* progress, Study* s) {
    memset(s, 0, sizeof *s);
    s->def = def;
    s->progress = progress;
    OM_TRY(validate(def));
    OmProbeDef probe = om_probe_default_def(OM_PROBE_BOX);
    probe.size.x = PROBE_LONG;
    probe.size.y = PROBE_WIDE;
    probe.rounding = PROBE_ROUNDING;
    OM_TRY(open_folders(def));
    OM_TRY(begin_runs(s));
    OM_TRY(om_probe_create(&probe, &s->probe));
    OM_TRY(tell(s));
    OM_TRY(do_truth(s));
    OM_TRY(om__study_get_surface(def, &s->surface));
    return do_runs(s);
}

OmStatus om_study_contact_run(const OmStudyContactDef* def, const OmProgress* progress,
                              OmStudyContactSummary* summary) {
    memset(summary, 0, sizeof *summary);
    Study s;
    StudyScore* score = NULL;
    OmFolder folder = {0};
    OmStatus status;
    memset(&s, 0, sizeof s);
    s.def = def;
    OM_TRY_DONE(validate(def));
    OM_TRY_DONE(om_folder_open(def->out_dir, "contact study", &folder));
    OM_TRY_DONE(om__study_open(def, progress, &s));
    OM_CALLOC_DONE(score, 1);
    OM_TRY_DONE(om__study_score(&s, score));
    OM_TRY_DONE(om__study_write_files(&s, score));
    OM_TRY_DONE(om__study_write_report(&s, score));
    *summary = score->sum;
    status = OM_OK;
done:
    om_free(score);
    om__study_close(&s);
    om_folder_end(&folder);
    return status;
}
