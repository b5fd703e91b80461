// calibrate_problem_file.c: the keys of a problem file.
#include <math.h>
#include <string.h>

#include "calibrate/calibrate_problem_internal.h"
#include "omentum/scene_yaml.h"

#define MM 1e-3
#define AT(type, member) offsetof(type, member)
#define COUNT(array) ((int)(sizeof(array) / sizeof *(array)))

const SceneKey om__calibrate_scene_key[] = {
    {"tissue.young", AT(OmScene, tissue.young), 1, "young"},
    {"tissue.poisson", AT(OmScene, tissue.poisson), 1, "poisson"},
    {"tissue.density", AT(OmScene, tissue.density), 1, NULL},
    {"tissue.rayleigh_mass", AT(OmScene, tissue.rayleigh_mass), 1, "rayleigh_mass"},
    {"tissue.rayleigh_stiffness", AT(OmScene, tissue.rayleigh_stiffness), 1, "rayleigh_stiffness"},
    {"tissue.cluster_spacing_mm", AT(OmScene, tissue.cluster_spacing), MM, "cluster_spacing"},
    {"tissue.cluster_radius_mm", AT(OmScene, tissue.cluster_radius), MM, "cluster_radius"},
    {"tissue.cluster_stiffness", AT(OmScene, tissue.cluster_stiffness), 1, "cluster_stiffness"},
    {"attachments.stiffness", AT(OmScene, attach.stiffness), 1, NULL},
};
// In the order of the table above.
static const char* const key_name[] = {"tissue.young",
                                       "tissue.poisson",
                                       "tissue.density",
                                       "tissue.rayleigh_mass",
                                       "tissue.rayleigh_stiffness",
                                       "tissue.cluster_spacing_mm",
                                       "tissue.cluster_radius_mm",
                                       "tissue.cluster_stiffness",
                                       "attachments.stiffness",
                                       NULL};
_Static_assert(COUNT(key_name) == COUNT(om__calibrate_scene_key) + 1, "every key has a name");

// In the order of the enumerations.
static const char* const norm_name[] = {"mean", "square", "huber", "trimmed", NULL};
static const char* const global_name[] = {"none", "evolution", "crs", "esch", NULL};
static const char* const local_name[] = {"none", "subplex", "bobyqa", NULL};
static const char* const kind_name[] = {"rest", "press", "lift", NULL};
static const char* const method_name[] = {"penalty", "multipliers", "prescribed", NULL};
static const char* const shape_name[] = {"box", "sphere", "capsule", NULL};

static const OmYamlField param_field[] = {
    {"name", OM_YAML_ENUM, AT(ParamItem, name), .name = key_name, .is_required = true},
    {"min", OM_YAML_DOUBLE, AT(ParamItem, min), .is_required = true},
    {"max", OM_YAML_DOUBLE, AT(ParamItem, max), .is_required = true},
    {"start", OM_YAML_DOUBLE, AT(ParamItem, start)},
    {"log", OM_YAML_BOOL, AT(ParamItem, is_log)},
};
static void set_param_default(void* item) { ((ParamItem*)item)->start = NAN; }
static const OmYamlSchema param_schema = {"parameters", param_field, COUNT(param_field),
                                          set_param_default};

static const OmYamlField probe_field[] = {
    {"shape", OM_YAML_ENUM, AT(ProbeItem, shape), .name = shape_name},
    {"size_mm", OM_YAML_VEC3, AT(ProbeItem, size), .min = 0.1, .max = 1000, .scale = MM},
    {"radius_mm", OM_YAML_DOUBLE, AT(ProbeItem, radius), .min = 0.1, .max = 1000, .scale = MM},
    {"length_mm", OM_YAML_DOUBLE, AT(ProbeItem, length), .max = 1000, .scale = MM},
    {"rounding_mm", OM_YAML_DOUBLE, AT(ProbeItem, rounding), .max = 500, .scale = MM},
};
static const OmYamlSchema probe_schema = {"probe", probe_field, COUNT(probe_field), NULL};

static const OmYamlField path_field[] = {
    {"name", OM_YAML_STRING, AT(PathItem, name), .size = PATH_NAME, .is_required = true},
    {"kind", OM_YAML_ENUM, AT(PathItem, kind), .name = kind_name, .is_required = true},
    {"point_mm", OM_YAML_VEC3, AT(PathItem, point), .min = -1e4, .max = 1e4, .scale = MM},
    {"direction", OM_YAML_VEC3, AT(PathItem, direction), .min = -1e3, .max = 1e3},
    {"along", OM_YAML_VEC3, AT(PathItem, along), .min = -1e3, .max = 1e3},
    {"grasp_radius_mm", OM_YAML_DOUBLE, AT(PathItem, radius), .min = 0.1, .max = 100, .scale = MM},
    {"probe", OM_YAML_STRUCT, AT(PathItem, probe), .sub = &probe_schema},
    {"method", OM_YAML_ENUM, AT(PathItem, method), .name = method_name},
    {"contact_triangles", OM_YAML_INT, AT(PathItem, contact_ntri),
     .max = OM_CALIBRATION_MAX_TRIANGLE},
    {"friction", OM_YAML_DOUBLE, AT(PathItem, friction), .max = 10},
    {"speed_mm_s", OM_YAML_DOUBLE, AT(PathItem, speed), .min = 1e-3, .max = 1e4, .scale = MM},
    {"time_step_s", OM_YAML_DOUBLE, AT(PathItem, time_step), .min = 1e-4, .max = 100},
    {"settle_s", OM_YAML_DOUBLE, AT(PathItem, settle), .max = 1e4},
};
static void set_path_default(void* item) {
    PathItem* p = item;
    OmProbeDef probe = om_probe_default_def(OM_PROBE_BOX);
    p->direction = om_vec3(0, 0, -1);
    p->along = om_vec3(1, 0, 0);
    p->radius = 0.005;
    p->probe = (ProbeItem){OM_PROBE_BOX, probe.size, probe.radius, 0.05, probe.rounding};
    p->contact_ntri =
        // with fewer triangles edges are as long as the probe is wide, and it slips between vertices
        4000;
    p->speed = 0.01;
    p->time_step = 0.02;
}
static const OmYamlSchema path_schema = {"paths", path_field, COUNT(path_field), set_path_default};

static const OmYamlField search_field[] = {
    {"norm", OM_YAML_ENUM, AT(SearchItem, norm), .name = norm_name},
    {"huber_mm", OM_YAML_DOUBLE, AT(SearchItem, huber), .min = 1e-6, .max = 1e3, .scale = MM},
    {"trim", OM_YAML_DOUBLE, AT(SearchItem, trim), .min = 0, .max = 0.9},
    {"noise_mm", OM_YAML_DOUBLE, AT(SearchItem, noise), .max = 1e3, .scale = MM},
    {"force_mm_per_n", OM_YAML_DOUBLE, AT(SearchItem, force_scale), .min = 1e-6, .max = 1e6,
     .scale = MM},
    {"global", OM_YAML_ENUM, AT(SearchItem, global), .name = global_name},
    {"population", OM_YAML_INT, AT(SearchItem, population), .max = 10000},
    {"generations", OM_YAML_INT, AT(SearchItem, generations), .min = 1, .max = 100000},
    {"local", OM_YAML_ENUM, AT(SearchItem, local), .name = local_name},
    {"local_evaluations", OM_YAML_INT, AT(SearchItem, local_evaluations), .max = 1000000},
    {"local_range", OM_YAML_DOUBLE, AT(SearchItem, local_range), .min = 1e-3, .max = 1},
    {"tolerance", OM_YAML_DOUBLE, AT(SearchItem, tolerance), .min = 1e-9, .max = 0.5},
    {"patience", OM_YAML_INT, AT(SearchItem, patience), .min = 1, .max = 100000},
    {"unfit", OM_YAML_DOUBLE, AT(SearchItem, unfit), .min = 1, .max = 1e6},
    {"rise", OM_YAML_DOUBLE, AT(SearchItem, rise), .max = 100},
    {"seed", OM_YAML_INT, AT(SearchItem, seed), .max = 2147483647},
};
static const OmYamlSchema search_schema = {"search", search_field, COUNT(search_field), NULL};

static const OmYamlField problem_field[] = {
    {"title", OM_YAML_STRING, AT(ProblemFile, title), .size = 128},
    {"scene", OM_YAML_STRING, AT(ProblemFile, scene), .size = OM_SCENE_PATH, .is_required = true},
    {"observations", OM_YAML_STRING, AT(ProblemFile, observations), .size = OM_SCENE_PATH,
     .is_required = true},
    {"parameters", OM_YAML_LIST, AT(ProblemFile, param), .size = sizeof(ParamItem),
     .sub = &param_schema, .count_offset = AT(ProblemFile, nparam),
     .capacity = OM_CALIBRATION_MAX_PARAM, .is_required = true},
    {"paths", OM_YAML_LIST, AT(ProblemFile, path), .size = sizeof(PathItem), .sub = &path_schema,
     .count_offset = AT(ProblemFile, npath), .capacity = OM_CALIBRATION_MAX_PATH,
     .is_required = true},
    {"search", OM_YAML_STRUCT, AT(ProblemFile, search), .sub = &search_schema},
};
static const OmYamlSchema problem_schema = {"calibration", problem_field, COUNT(problem_field),
                                            NULL};

static OmStatus check(const ProblemFile* f, const char* path) {
    OM_CHECK(f->nparam > 0, OM_INVALID, "%s: parameters: the list is empty", path);
    OM_CHECK(f->npath > 0, OM_INVALID, "%s: paths: the list is empty", path);
    for (int i = 0; i < f->nparam; ++i)
        OM_CHECK(f->param[i].min < f->param[i].max, OM_INVALID,
                 "%s: parameters: %s: min %g is not below max %g", path, key_name[f->param[i].name],
                 f->param[i].min, f->param[i].max);
    for (int p = 0; p < f->npath; ++p)
        for (int q = 0; q < p; ++q)
            OM_CHECK(strcmp(f->path[p].name, f->path[q].name) != 0, OM_INVALID,
                     "%s: paths: two have the name \"%s\"", path, f->path[p].name);
    OM_CHECK(f->search.norm != OM_NORM_HUBER || f->search.huber > 0 || f->search.noise > 0,
             OM_INVALID, "%s: search: norm huber needs huber_mm or noise_mm", path);
    return OM_OK;
}

OmStatus om__calibrate_read_problem(const char* path, ProblemFile* f) {
    memset(f, 0, sizeof *f);
    OmCalibrationDef def = om_calibration_default_def(NULL, NULL, 0);
    snprintf(f->title, sizeof f->title, "%s", def.title);
    f->search = (SearchItem){.global = (int)def.global,
                             .local = (int)def.local,
                             .force_scale = 0.01,
                             .generations = def.max_generations,
                             .patience = def.patience,
                             .seed = (int)def.seed,
                             .local_range = def.local_range,
                             .tolerance = def.tolerance,
                             .unfit = def.unfit,
                             .rise = def.rise};
    OM_TRY(om_yaml_load(path, &problem_schema, f));
    return check(f, path);
}
