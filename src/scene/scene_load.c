// scene_load.c: the keys of a scene file.
#include <string.h>

#include "omentum/image.h"
#include "omentum/scene.h"
#include "omentum/scene_yaml.h"
#include "omentum/tissue_material.h"
#include "scene/scene_site.h"

#define MM 1e-3
#define DEG (OM_PI / 180.0)
#define AT(type, member) offsetof(type, member)
#define COUNT(array) ((int)(sizeof(array) / sizeof *(array)))

static const char* const source_name[] = {"sheet", "mesh", "patient", "volume", NULL};
static const char* const attach_name[] = {"random_patch", "box", "set", NULL};

static const char* const engine_name[] = {"fem", "pbd", "xpbd", "springs", "chainmail", NULL};

// As OmLaw orders them.
static const char* const law_name[] = {
    "corotational",  "linear", "st-venant-kirchhoff", "neo-hookean", "stable-neo-hookean",
    "mooney-rivlin", "ogden",  "ogden-coupled",       NULL};
_Static_assert(COUNT(law_name) == OM_NLAW + 1, "every law has a name");

static const OmYamlField tissue_field[] = {
    {"source", OM_YAML_ENUM, AT(OmSceneTissue, source), .name = source_name, .is_required = true},
    {"model", OM_YAML_ENUM, AT(OmSceneTissue, model), .name = engine_name},
    {"size_mm", OM_YAML_VEC3, AT(OmSceneTissue, size), .min = 1, .max = 1000, .scale = MM},
    {"cells", OM_YAML_VEC3, AT(OmSceneTissue, cells), .min = 1, .max = 200},
    {"world_cells", OM_YAML_VEC3, AT(OmSceneTissue, world_cells), .min = 0, .max = 200},
    {"file", OM_YAML_STRING, AT(OmSceneTissue, file), .size = OM_SCENE_PATH},
    {"unit_mm", OM_YAML_DOUBLE, AT(OmSceneTissue, unit), .min = 1e-3, .max = 1e3, .scale = MM},
    {"up", OM_YAML_VEC3, AT(OmSceneTissue, up), .min = -1, .max = 1},
    {"view", OM_YAML_VEC3, AT(OmSceneTissue, view), .min = -1, .max = 1},
    {"law", OM_YAML_ENUM, AT(OmSceneTissue, law), .name = law_name},
    {"board", OM_YAML_BOOL, AT(OmSceneTissue, has_board)},
    {"averaged", OM_YAML_BOOL, AT(OmSceneTissue, is_averaged)},
    {"gravity", OM_YAML_DOUBLE, AT(OmSceneTissue, gravity), .min = 0, .max = 100},
    // what can be calibrated stands last: see NTISSUE_NUMBER
    {"young", OM_YAML_DOUBLE, AT(OmSceneTissue, young), .min = 1, .max = 1e9},
    {"poisson", OM_YAML_DOUBLE, AT(OmSceneTissue, poisson), .min = 0, .max = OM_MAX_POISSON},
    {"density", OM_YAML_DOUBLE, AT(OmSceneTissue, density), .min = 1, .max = 20000},
    {"rayleigh_mass", OM_YAML_DOUBLE, AT(OmSceneTissue, rayleigh_mass), .min = 0, .max = 1000},
    {"rayleigh_stiffness", OM_YAML_DOUBLE, AT(OmSceneTissue, rayleigh_stiffness), .min = 0,
     .max = 10},
    {"cluster_spacing_mm", OM_YAML_DOUBLE, AT(OmSceneTissue, cluster_spacing), .min = 0.1,
     .max = 1000, .scale = MM},
    {"cluster_radius_mm", OM_YAML_DOUBLE, AT(OmSceneTissue, cluster_radius), .min = 0.1,
     .max = 1000, .scale = MM},
    {"cluster_stiffness", OM_YAML_DOUBLE, AT(OmSceneTissue, cluster_stiffness), .min = 0, .max = 1},
};
static const OmYamlSchema tissue_schema = {"tissue", tissue_field, COUNT(tissue_field), NULL};

static const OmYamlField model_field[] = {
    {"label", OM_YAML_INT, AT(OmSceneModel, label), .min = 1, .max = 65535},
    {"max_volume_gb", OM_YAML_DOUBLE, AT(OmSceneModel, max_volume), .min = 1e-3, .max = 64,
     .scale = 1e9},
    {"edge_mm", OM_YAML_DOUBLE, AT(OmSceneModel, edge), .min = 0.5, .max = 50, .scale = MM},
    {"world_edge_mm", OM_YAML_DOUBLE, AT(OmSceneModel, world_edge), .min = 0, .max = 50,
     .scale = MM},
    {"thickness_mm", OM_YAML_DOUBLE, AT(OmSceneModel, thickness), .min = 1, .max = 100,
     .scale = MM},
    {"side", OM_YAML_STRING, AT(OmSceneModel, side), .size = 64},
    {"half_length_mm", OM_YAML_DOUBLE, AT(OmSceneModel, half_length), .max = 500, .scale = MM},
    {"half_width_mm", OM_YAML_DOUBLE, AT(OmSceneModel, half_width), .max = 500, .scale = MM},
    {"attach", OM_YAML_STRING, AT(OmSceneModel, attach), .size = 64},
    {"tumour_radius_mm", OM_YAML_DOUBLE, AT(OmSceneModel, tumour_radius), .min = 1, .max = 100,
     .scale = MM},
    {"tumour_shift_mm", OM_YAML_VEC3, AT(OmSceneModel, tumour_shift), .scale = MM},
    {"tumour_range_mm", OM_YAML_VEC3, AT(OmSceneModel, tumour_range), .max = 100, .scale = MM},
    {"attach_turn_deg", OM_YAML_DOUBLE, AT(OmSceneModel, attach_turn), .max = 180, .scale = DEG},
};
static const OmYamlSchema model_schema = {"model", model_field, COUNT(model_field), NULL};

static const OmYamlField attach_field[] = {
    {"kind", OM_YAML_ENUM, AT(OmSceneAttach, kind), .name = attach_name, .is_required = true},
    {"share_min", OM_YAML_DOUBLE, AT(OmSceneAttach, share_min), .min = 0.01, .max = 0.95},
    {"share_max", OM_YAML_DOUBLE, AT(OmSceneAttach, share_max), .min = 0.01, .max = 0.95},
    {"lo_mm", OM_YAML_VEC3, AT(OmSceneAttach, lo), .scale = MM},
    {"hi_mm", OM_YAML_VEC3, AT(OmSceneAttach, hi), .scale = MM},
    {"stiffness", OM_YAML_DOUBLE, AT(OmSceneAttach, stiffness), .min = 0, .max = 1e9},
};
static const OmYamlSchema attach_schema = {"attachments", attach_field, COUNT(attach_field), NULL};

static const OmYamlField roi_field[] = {
    {"random", OM_YAML_BOOL, AT(OmSceneRoi, is_random)},
    {"center_mm", OM_YAML_VEC3, AT(OmSceneRoi, center), .scale = MM},
    {"radius_mm", OM_YAML_DOUBLE, AT(OmSceneRoi, radius), .min = 0.5, .max = 100, .scale = MM},
    {"margin_mm", OM_YAML_DOUBLE, AT(OmSceneRoi, margin), .min = 0, .max = 100, .scale = MM},
};
static const OmYamlSchema roi_schema = {"roi", roi_field, COUNT(roi_field), NULL};

static const OmYamlField camera_field[] = {
    {"distance_mm", OM_YAML_DOUBLE, AT(OmSceneCamera, distance), .min = 10, .max = 2000,
     .scale = MM},
    {"elevation_deg", OM_YAML_DOUBLE, AT(OmSceneCamera, elevation), .min = 1, .max = 90,
     .scale = DEG},
    {"fov_deg", OM_YAML_DOUBLE, AT(OmSceneCamera, fov), .min = 5, .max = 150, .scale = DEG},
    {"width", OM_YAML_INT, AT(OmSceneCamera, width), .min = 16, .max = 4096},
    {"height", OM_YAML_INT, AT(OmSceneCamera, height), .min = 16, .max = 4096},
};
static const OmYamlSchema camera_schema = {"camera", camera_field, COUNT(camera_field), NULL};

static const OmYamlField world_field[] = {
    {"young_factor", OM_YAML_DOUBLE, AT(OmSceneWorld, young_factor), .min = 0.1, .max = 10},
    {"density_factor", OM_YAML_DOUBLE, AT(OmSceneWorld, density_factor), .min = 0.1, .max = 10},
    {"tool_noise_mm", OM_YAML_DOUBLE, AT(OmSceneWorld, tool_noise), .min = 0, .max = 10,
     .scale = MM},
    {"depth_noise", OM_YAML_BOOL, AT(OmSceneWorld, has_depth_noise)},
};
static const OmYamlSchema world_schema = {"world", world_field, COUNT(world_field), NULL};

static const OmYamlField task_field[] = {
    {"grid", OM_YAML_INT, AT(OmSceneTask, grid), .min = 2, .max = 20},
    {"force_threshold", OM_YAML_DOUBLE, AT(OmSceneTask, force_threshold), .min = 1e-3, .max = 1000},
    {"force_margin", OM_YAML_DOUBLE, AT(OmSceneTask, force_margin), .min = 0, .max = 1000},
    {"max_height_mm", OM_YAML_DOUBLE, AT(OmSceneTask, max_height), .min = 1, .max = 500,
     .scale = MM},
    {"pull_step_mm", OM_YAML_DOUBLE, AT(OmSceneTask, pull_step), .min = 1, .max = 100, .scale = MM},
    {"visibility", OM_YAML_DOUBLE, AT(OmSceneTask, visibility), .min = 0.01, .max = 1},
    {"speed_mm_s", OM_YAML_DOUBLE, AT(OmSceneTask, speed), .min = 0.1, .max = 500, .scale = MM},
    {"grasp_radius_mm", OM_YAML_DOUBLE, AT(OmSceneTask, grasp_radius), .min = 0.5, .max = 50,
     .scale = MM},
    {"time_step_ms", OM_YAML_DOUBLE, AT(OmSceneTask, time_step), .min = 1, .max = 100,
     .scale = 1e-3},
    {"max_actions", OM_YAML_INT, AT(OmSceneTask, max_actions), .min = 1, .max = 1000},
    {"retract_mm", OM_YAML_DOUBLE, AT(OmSceneTask, retract), .min = 1, .max = 500, .scale = MM},
};
static const OmYamlSchema task_schema = {"task", task_field, COUNT(task_field), NULL};

static const OmYamlField scene_field[] = {
    {"name", OM_YAML_STRING, AT(OmScene, name), .size = OM_SCENE_NAME, .is_required = true},
    {"data_root", OM_YAML_STRING, AT(OmScene, data_root), .size = OM_SCENE_PATH},
    {"calibrated", OM_YAML_STRING, AT(OmScene, calibrated), .size = OM_SCENE_PATH},
    {"seed", OM_YAML_INT, AT(OmScene, seed), .min = 0, .max = 2147483647},
    {"tissue", OM_YAML_STRUCT, AT(OmScene, tissue), .sub = &tissue_schema, .is_required = true},
    {"model", OM_YAML_STRUCT, AT(OmScene, model), .sub = &model_schema},
    {"attachments", OM_YAML_STRUCT, AT(OmScene, attach), .sub = &attach_schema},
    {"roi", OM_YAML_STRUCT, AT(OmScene, roi), .sub = &roi_schema},
    {"endoscope", OM_YAML_STRUCT, AT(OmScene, endoscope), .sub = &camera_schema},
    {"rgbd", OM_YAML_STRUCT, AT(OmScene, rgbd), .sub = &camera_schema},
    {"world", OM_YAML_STRUCT, AT(OmScene, world), .sub = &world_schema},
    {"task", OM_YAML_STRUCT, AT(OmScene, task), .sub = &task_schema},
};
static const OmYamlSchema scene_schema = {"scene", scene_field, COUNT(scene_field), NULL};

// What a calibration leaves: the numbers at the end of two of the tables, none of them required.
enum { NTISSUE_NUMBER = 8 };
static const OmYamlSchema calibrated_tissue_schema = {
    "tissue", tissue_field + COUNT(tissue_field) - NTISSUE_NUMBER, NTISSUE_NUMBER, NULL};
static const OmYamlSchema calibrated_attach_schema = {
    "attachments", attach_field + COUNT(attach_field) - 1, 1, NULL};
static const OmYamlField calibrated_field[] = {
    {"tissue", OM_YAML_STRUCT, AT(OmScene, tissue), .sub = &calibrated_tissue_schema},
    {"attachments", OM_YAML_STRUCT, AT(OmScene, attach), .sub = &calibrated_attach_schema},
};
static const OmYamlSchema calibrated_schema = {"calibration", calibrated_field,
                                               COUNT(calibrated_field), NULL};

OmScene om_scene_default(void) {
    OmScene s = {.name = "sheet", .seed = 1};
    s.tissue = (OmSceneTissue){.source = OM_SOURCE_SHEET,
                               .size = {0.12, 0.12, 0.005},
                               .cells = {20, 20, 1},
                               .unit = 1.0,
                               .up = {0, 0, 1},
                               .view = {-1, 0, 0},
                               .has_board = true,
                               .law = OM_STABLE_NEO_HOOKEAN,
                               .young = 3000,
                               .poisson = 0.45,
                               .density = 1000,
                               .rayleigh_mass = 0.1,
                               .rayleigh_stiffness = 0.01,
                               .gravity = 9.81,
                               .cluster_spacing = 0.0127,
                               .cluster_radius = 0.0095,
                               .cluster_stiffness = 0.361};
    s.model = (OmSceneModel){.label = 1,
                             .max_volume = (double)OM_VOLUME_MAX_SIZE,
                             .edge = 0.005,
                             .thickness = 0.008,
                             .side = "anterior",
                             .attach = "border:medial 25 %",
                             .tumour_radius = 0.008};
    s.attach = (OmSceneAttach){.kind = OM_ATTACH_RANDOM, .share_min = 0.1, .share_max = 0.5};
    s.roi = (OmSceneRoi){.is_random = true, .radius = 0.008, .margin = 0.005};
    s.endoscope = (OmSceneCamera){0.2, 45 * DEG, 60 * DEG, 640, 480};
    s.rgbd = (OmSceneCamera){0.3, 50 * DEG, 42 * DEG, 320, 240};
    s.world = (OmSceneWorld){0.85, 1.0, 0.2 * MM, true};
    s.task = (OmSceneTask){.grid = 5,
                           .force_threshold = 2.55,
                           .max_height = 0.05,
                           .pull_step = 0.01,
                           .visibility = 0.8,
                           .speed = 0.02,
                           .grasp_radius = 0.005,
                           .time_step = 0.02,
                           .max_actions = 150,
                           .retract = 0.1};
    return s;
}

// What a range of one key cannot tell.
static OmStatus validate(const OmScene* s, const char* name) {
    OM_CHECK(s->attach.share_min <= s->attach.share_max, OM_INVALID,
             "%s: attachments: share_min %g exceeds share_max %g", name, s->attach.share_min,
             s->attach.share_max);
    OM_CHECK(s->tissue.source == OM_SOURCE_SHEET || s->tissue.file[0], OM_INVALID,
             "%s: tissue: \"file\" is missing; source %s reads one", name,
             source_name[s->tissue.source]);
    OM_CHECK(s->task.force_margin < s->task.force_threshold, OM_INVALID,
             "%s: task: force_margin %g leaves nothing of force_threshold %g", name,
             s->task.force_margin, s->task.force_threshold);
    OM_CHECK(om_norm(s->tissue.up) > 0.5, OM_INVALID, "%s: tissue: up must have length 1", name);
    OM_CHECK(s->tissue.cluster_radius >= 0.5 * s->tissue.cluster_spacing, OM_INVALID,
             "%s: tissue: cluster_radius_mm %g is less than half of cluster_spacing_mm %g", name,
             1e3 * s->tissue.cluster_radius, 1e3 * s->tissue.cluster_spacing);
    OM_CHECK(s->model.world_edge == 0 || s->model.world_edge >= 0.5 * MM, OM_INVALID,
             "%s: model: world_edge_mm %g is outside its range, 0.5 to 50; leave it out for 0.7 of "
             "edge_mm",
             name, 1e3 * s->model.world_edge);
    const OmVec3* cells[2] = {&s->tissue.cells, &s->tissue.world_cells};
    for (int i = 0; i < 2; ++i) {
        OmVec3 c = *cells[i];
        OM_CHECK(c.x == floor(c.x) && c.y == floor(c.y) && c.z == floor(c.z), OM_INVALID,
                 "%s: tissue: %s: cell counts must be whole numbers", name,
                 i ? "world_cells" : "cells");
    }
    return om__scene_check_world(s, name);
}

// ---- what a scene sets and nothing would use -----------------------------------------------------------------

#define IN(source) (1u << (source))
#define MADE (IN(OM_SOURCE_SHEET) | IN(OM_SOURCE_MESH))  // tissue without an anatomy of its own
#define READ (IN(OM_SOURCE_MESH) | IN(OM_SOURCE_PATIENT) | IN(OM_SOURCE_VOLUME))
#define USE(member, key, sources) \
    { key, offsetof(OmScene, member), sizeof(((OmScene*)0)->member), sources }

static const struct {
    const char* key;
    size_t offset, size;
    unsigned sources;  // that use it
} use_table[] = {
    USE(tissue.size, "tissue: size_mm", IN(OM_SOURCE_SHEET)),
    USE(tissue.cells, "tissue: cells", IN(OM_SOURCE_SHEET)),
    USE(tissue.world_cells, "tissue: world_cells", IN(OM_SOURCE_SHEET)),
    USE(tissue.file, "tissue: file", READ),
    USE(tissue.unit, "tissue: unit_mm", IN(OM_SOURCE_MESH)),
    USE(tissue.up, "tissue: up", IN(OM_SOURCE_MESH)),
    USE(tissue.view, "tissue: view", READ),
    USE(tissue.has_board, "tissue: board", MADE),
    USE(model, "model", IN(OM_SOURCE_VOLUME)),
    USE(attach.share_min, "attachments: share_min", MADE),
    USE(attach.share_max, "attachments: share_max", MADE),
    USE(attach.lo, "attachments: lo_mm", MADE),
    USE(attach.hi, "attachments: hi_mm", MADE),
    USE(roi, "roi", MADE),
};

// Keys that differ from the default and have no effect are mistakes of the one who wrote them.
static OmStatus check_uses(const OmScene* s, const OmScene* plain, const char* name) {
    for (int i = 0; i < COUNT(use_table); ++i) {
        size_t at = use_table[i].offset;
        bool is_set = memcmp((const char*)s + at, (const char*)plain + at, use_table[i].size) != 0;
        OM_CHECK(!is_set || (use_table[i].sources & IN(s->tissue.source)), OM_INVALID,
                 "%s: %s has no effect on tissue of source %s; remove it", name, use_table[i].key,
                 source_name[s->tissue.source]);
    }
    OM_CHECK(s->tissue.source < OM_SOURCE_PATIENT || s->attach.kind == plain->attach.kind ||
                 s->attach.kind == OM_ATTACH_SET,
             OM_INVALID, "%s: attachments: a patient has its own; kind must be set", name);
    OM_CHECK(s->attach.kind == OM_ATTACH_BOX ||
                 (om_norm(s->attach.lo) == 0 && om_norm(s->attach.hi) == 0),
             OM_INVALID, "%s: attachments: lo_mm and hi_mm have no effect without kind: box", name);
    OM_CHECK(!s->roi.is_random || om_norm(s->roi.center) == 0, OM_INVALID,
             "%s: roi: center_mm has no effect on a random region; say random: false", name);
    return OM_OK;
}

OmStatus om_scene_parse(const char* text, size_t size, const char* name, OmScene* scene) {
    *scene = om_scene_default();
    OmScene whole;
    memcpy(&whole, scene, sizeof whole);
    OmSceneTissue *t = &scene->tissue, plain = *t;
    t->young = t->poisson = t->density = -1;  // the patient's own
    OM_TRY(om_yaml_parse(text, size, name, &scene_schema, scene));
    if (t->source < OM_SOURCE_PATIENT) {
        if (t->young < 0) t->young = plain.young;
        if (t->poisson < 0) t->poisson = plain.poisson;
        if (t->density < 0) t->density = plain.density;
    }
    OM_TRY(validate(scene, name));
    OM_TRY(check_uses(scene, &whole, name));
    scene->tissue.up = om_normalize(scene->tissue.up);
    return OM_OK;
}

OmStatus om_scene_load(const char* path, OmScene* scene) {
    char* text;
    size_t size;
    OM_TRY(om_file_read(path, 4u << 20, &text, &size));
    OmStatus status = om_scene_parse(text, size, path, scene);
    om_free(text);
    OM_TRY(status);
    snprintf(scene->path, sizeof scene->path, "%s", path);
    char dir[OM_SCENE_PATH], root[OM_SCENE_PATH];
    OM_TRY(om_path_dir(path, dir, sizeof dir));
    if (scene->calibrated[0]) {
        OM_TRY(om_path_join(dir, scene->calibrated, root, sizeof root));
        OM_TRY(om_yaml_load(root, &calibrated_schema, scene));
        OM_TRY(validate(scene, root));
    }
    OM_TRY(om_path_join(dir, scene->data_root, root, sizeof root));
    snprintf(scene->data_root, sizeof scene->data_root, "%s", scene->data_root[0] ? root : dir);
    return OM_OK;
}
