// cli_view_load.c: tissue without a scene: a tetrahedral mesh, or a patient model, as a scene of its own.
//
// Time step, radius of a grasp and elements are chosen by the mesh, so that a page answers at once: steps of 1/60 s,
// and quadratic elements only where they are few.
#include <math.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#include "cli_view.h"
#include "omentum/scene_model.h"
#include "omentum/shape_file.h"

#define FEW_TETS 1000  // quadratic elements of more take longer than 1/60 s a step
#define STEPS 60.0     // in a second
#define GRASP_SHARE \
    0.75  // of a mean edge: a grasp reaches a vertex wherever the surface is touched
#define CLUSTER_SHARE 1.5   // radius of a cluster over a mean edge
#define DISTANCE_SHARE 2.5  // of the endoscope from the tissue, over its half size

static bool has_end(const char* name, const char* end) {
    const size_t n = strlen(name), m = strlen(end);
    return n > m && strcasecmp(name + n - m, end) == 0;
}

static bool is_folder(const char* path) {
    struct stat info;
    return stat(path, &info) == 0 && S_ISDIR(info.st_mode);
}

// The kind of a file, and the path of a model's folder's patient.yaml.
static OmStatus find_kind(const char* name, char* path, size_t size, OmTissueSource* source) {
    *source = OM_SOURCE_SHEET;
    OM_CHECK(strlen(name) < size, OM_INVALID, "%s: the path is too long", name);
    strcpy(path, name);
    if (has_end(name, ".vtu") || has_end(name, ".vtk") || has_end(name, ".msh"))
        *source = OM_SOURCE_MESH;
    if (*source == OM_SOURCE_MESH) return OM_OK;
    static const char* const surface[] = {".stl", ".obj", ".ply", ".off", ".vtp"};
    for (size_t k = 0; k < sizeof surface / sizeof *surface; ++k)
        OM_CHECK(
            !has_end(name, surface[k]), OM_INVALID,
            "%s is a surface, and a hand needs tetrahedra: omentum model %s -o DIR makes them, then omentum view "
            "DIR --free",
            name, name);
    if (is_folder(name)) OM_TRY(om_path_join(name, "patient.yaml", path, size));
    if (is_folder(name) && !om_path_exists(path)) return OM_OK;
    bool is_patient = false;
    OM_TRY(om_cli_is_patient(path, &is_patient));
    if (is_patient) *source = OM_SOURCE_PATIENT;
    return OM_OK;
}

static OmStatus read_unit(const OmCliArgs* args, double* unit) {
    const char* word = om_cli_get(args, "--unit");
    *unit = 0;
    if (!word) return OM_OK;
    const bool is_m = strcmp(word, "m") == 0, is_cm = strcmp(word, "cm") == 0;
    OM_CHECK(is_m || is_cm || strcmp(word, "mm") == 0, OM_INVALID,
             "--unit: \"%s\" is none of mm, cm, m", word);
    *unit = is_m ? OM_UNIT_M : is_cm ? OM_UNIT_CM : OM_UNIT_MM;
    return OM_OK;
}

static OmStatus read_up(const OmCliArgs* args, OmVec3* up) {
    const char* word = om_cli_get(args, "--up");
    if (!word) return OM_OK;
    const char* axis = word[0] == '-' ? word + 1 : word;
    OM_CHECK(axis[0] >= 'x' && axis[0] <= 'z' && axis[1] == 0, OM_INVALID,
             "--up: \"%s\" is none of x, y, z, -x, -y, -z", word);
    const double way = word[0] == '-' ? -1 : 1;
    *up = om_vec3(axis[0] == 'x' ? way : 0, axis[0] == 'y' ? way : 0, axis[0] == 'z' ? way : 0);
    return OM_OK;
}

// The half diagonal, m.
static double measure(const OmTetMesh* mesh) {
    OmVec3 lo = om_load3(mesh->x, 0), hi = lo;
    for (int v = 1; v < mesh->nvert; ++v) {
        lo = om_min3(lo, om_load3(mesh->x, v));
        hi = om_max3(hi, om_load3(mesh->x, v));
    }
    return 0.5 * om_distance(lo, hi);
}

// Settings by size and number of the elements.
static void fit_scene(const OmTetMesh* mesh, OmScene* s) {
    const OmSite site = {.mesh = *mesh};
    const double half = measure(mesh), spacing = om_site_spacing(&site);
    s->task.time_step = 1 / STEPS;
    s->task.grasp_radius = fmax(s->task.grasp_radius, GRASP_SHARE * spacing);
    s->tissue.element = mesh->ntet <= FEW_TETS ? OM_ELEMENT_QUADRATIC : OM_ELEMENT_LINEAR;
    // clusters of engine pbd join particles that are farther apart than those of the scene's default
    const double radius = fmax(s->tissue.cluster_radius, CLUSTER_SHARE * spacing);
    s->tissue.cluster_spacing *= radius / s->tissue.cluster_radius;
    s->tissue.cluster_radius = radius;
    s->endoscope.distance = fmax(s->endoscope.distance, DISTANCE_SHARE * half);
}

static OmStatus load_mesh(const OmCliArgs* args, const char* path, OmScene* s) {
    OmMeshFrame given = {0}, stated = {0};
    OmTetMesh mesh;
    OM_TRY(read_unit(args, &given.unit));
    OM_TRY(read_up(args, &s->tissue.up));
    OM_TRY(om_tet_mesh_load_frame(path, given, 0, &mesh, &stated));
    s->tissue.unit = om_mesh_frame_join(given, stated).unit;
    fit_scene(&mesh, s);
    const double size = 2e3 * measure(&mesh);
    printf("%s: %d vertices, %d tetrahedra, %.3g mm across%s\n", path, mesh.nvert, mesh.ntet, size,
           size < 5 || size > 2000 ? ": is this its size? --unit says mm, cm or m" : "");
    om_tet_mesh_done(&mesh);
    return OM_OK;
}

static OmStatus load_patient(const OmCliArgs* args, const char* path, OmScene* s) {
    OmPatient patient;
    OM_CHECK(!om_cli_get(args, "--unit") && !om_cli_get(args, "--up"), OM_INVALID,
             "%s: a patient model has its own unit and its own up; leave out --unit and --up",
             path);
    OM_TRY(om_patient_load(path, &patient));
    fit_scene(&patient.mesh, s);
    s->tissue.young = s->tissue.poisson = s->tissue.density = -1;  // its own
    printf("%s: %d vertices, %d tetrahedra%s\n", path, patient.mesh.nvert, patient.mesh.ntet,
           patient.organ.nvert > 0 ? ", over an organ" : "");
    om_patient_done(&patient);
    return OM_OK;
}

// The last part of a path.
static void name_scene(const char* path, char* name, size_t size) {
    size_t n = strlen(path);
    while (n > 1 && path[n - 1] == '/') --n;
    size_t begin = n;
    while (begin > 0 && path[begin - 1] != '/') --begin;
    snprintf(name, size, "%.*s", (int)(n - begin < size - 1 ? n - begin : size - 1), path + begin);
}

OmStatus om_cli_view_load(const OmCliArgs* args, OmCliRetract* s, char* path, size_t size) {
    const char* name = om_cli_positional(args, 0);
    OmTissueSource source;
    OM_TRY(find_kind(name, path, size, &source));
    if (source == OM_SOURCE_SHEET) return OM_OK;
    OM_CHECK(om_path_exists(path), OM_IO, "%s: no such file", path);
    OM_CHECK(!om_cli_get(args, "--data") && !om_cli_get(args, "--layout"), OM_INVALID,
             "%s: --data and --layout are of scenes; leave them out", name);
    OM_CHECK(!om_cli_get(args, "--defras") && !om_cli_get(args, "--approve"), OM_INVALID,
             "%s has no task for a robot: leave out --defras and --approve", name);
    OmScene* scene = &s->scene;
    const char* slash = strrchr(path, '/');
    const char* file = slash ? slash + 1 : path;
    *scene = om_scene_default();
    OM_TRY(om_path_dir(path, scene->data_root, sizeof scene->data_root));
    OM_CHECK(strlen(file) < sizeof scene->tissue.file, OM_INVALID, "%s: the path is too long",
             path);
    strcpy(scene->tissue.file, file);
    name_scene(name, scene->name, sizeof scene->name);
    scene->tissue.source = source;
    scene->attach.kind = OM_ATTACH_SET;
    s->has_scene = true;
    return source == OM_SOURCE_MESH ? load_mesh(args, path, scene)
                                    : load_patient(args, path, scene);
}
