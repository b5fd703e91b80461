// scene_load.c: read a scene file: defaults, and checks that involve several keys.
#include <string.h>

#include "omentum/image.h"
#include "omentum/tissue.h"
#include "scene/scene_keys.h"
#include "scene/scene_site.h"

#define MM 1e-3
#define DEG (OM_PI / 180.0)
#define COUNT(array) ((int)(sizeof(array) / sizeof *(array)))

OmScene om_scene_default(void) {
    OmScene s = {.name = "sheet", .seed = 1};
    s.tissue = (OmSceneTissue){.source = OM_SOURCE_SHEET,
                               .engine = "fem",
                               .size = {0.12, 0.12, 0.005},
                               .cells = {16, 16, 1},
                               .element = -1,
                               .unit = 1.0,
                               .up = {0, 0, 1},
                               .view = {-1, 0, 0},
                               .friction = -1,
                               .self_friction = -1,
                               .has_board = true,
                               .law = OM_NEO_HOOKEAN,
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
    s.believed = (OmSceneBelief){.ratio = 1, .share = 0.3, .stiffness = -1, .foundation = -1};
    s.roi = (OmSceneRoi){.is_random = true, .radius = 0.008, .margin = 0.005};
    s.endoscope = (OmSceneCamera){0.2, 45 * DEG, 60 * DEG, 640, 480, {0}, {0}, {0}};
    s.rgbd = (OmSceneCamera){0.3, 50 * DEG, 42 * DEG, 320, 240, {0}, {0}, {0}};
    s.organ = (OmSceneOrgan){
        .edge = 10 * MM, .young = 10000, .poisson = 0.45, .density = 1050, .foundation = 3e5};
    s.world = (OmSceneWorld){.young_factor = 0.85,
                             .density_factor = 1.0,
                             .law = -1,
                             .element = -1,
                             .poisson = -1,
                             .friction = -1,
                             .tool_noise = 0.2 * MM,
                             .has_depth_noise = true,
                             .narm = OM_MAX_ARM,
                             .force_noise = -1,
                             .grip_friction = -1,
                             .grip_force = 8};
    s.task = (OmSceneTask){.grid = 5,
                           .force_threshold = 1.59,
                           .watch_force = true,
                           .max_height = 0.05,
                           .pull_step = 0.01,
                           .visibility = 0.8,
                           .visibility_margin = 0.05,
                           .speed = 0.02,
                           .grasp_radius = 0.005,
                           .time_step = 0.02,
                           .max_actions = 150,
                           .retract = 0.1,
                           .wrist_turn = 45 * OM_PI / 180};
    s.update = (OmSceneUpdate){.latency = 0.6,
                               .keep = 3,
                               .min_lift = 0.01,
                               .rest = 0.3,
                               .network = "none",
                               .is_checked = true,
                               .registers = true};
    s.monitor = (OmSceneMonitor){.limit = {2 * MM, 4 * MM, 6 * MM},
                                 .hysteresis = 0.5 * MM,
                                 .rate = 30,
                                 .npoint = 1000,
                                 .part_limit = {4 * MM, 8 * MM},
                                 .part_share = 0.02};
    return s;
}

// Checks that involve several keys.
static OmStatus validate(const OmScene* s, const char* name) {
    OM_CHECK(s->attach.share_min <= s->attach.share_max, OM_INVALID,
             "%s: attachments: share_min %g exceeds share_max %g", name, s->attach.share_min,
             s->attach.share_max);
    const double pair[2][2] = {{s->attach.stiffness, s->attach.foundation},
                               {s->believed.stiffness, s->believed.foundation}};
    for (int k = 0; k < 2; ++k)
        OM_CHECK(pair[k][0] <= 0 || pair[k][1] <= 0, OM_INVALID,
                 "%s: %s: stiffness %g N/m and foundation %g N/m^3 exclude each other", name,
                 k ? "believed_attachments" : "attachments", pair[k][0], pair[k][1]);
    OM_CHECK(
        s->tissue.source == OM_SOURCE_SHEET ||
            (s->tissue.element != OM_ELEMENT_SHELL && s->world.element != OM_ELEMENT_SHELL),
        OM_INVALID,
        "%s: tissue: element: shell needs `source: sheet`; leave `element` out for other tissue",
        name);
    OM_CHECK(s->tissue.source == OM_SOURCE_SHEET || s->tissue.file[0], OM_INVALID,
             "%s: tissue: \"file\" is missing; source %s reads one", name,
             om__scene_source_name[s->tissue.source]);
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
    OM_CHECK(!s->attach.on_organ || s->organ.deforms != OM_IN_NONE, OM_INVALID,
             "%s: attachments: on_organ needs an organ that gives way; set organ: deforms: truth",
             name);
    OM_CHECK(!s->attach.on_organ || s->attach.foundation > 0 || s->attach.stiffness > 0, OM_INVALID,
             "%s: attachments: on_organ needs springs: give foundation (N/m^3) or stiffness (N/m)",
             name);
    OM_CHECK(!s->attach.on_organ || s->world.tear_strength <= 0, OM_UNAVAILABLE,
             "%s: attachments: springs on the organ do not tear; leave out on_organ or "
             "tear_strength",
             name);
    const double* limit = s->monitor.limit;
    OM_CHECK(limit[0] < limit[1] && limit[1] < limit[2], OM_INVALID,
             "%s: monitor: limits_mm must ascend", name);
    OM_CHECK(s->monitor.hysteresis < limit[0], OM_INVALID,
             "%s: monitor: hysteresis_mm %g must be below the first limit, %g", name,
             1e3 * s->monitor.hysteresis, 1e3 * limit[0]);
    const double* part = s->monitor.part_limit;
    OM_CHECK(part[0] < part[1] || (part[0] == 0 && part[1] == 0), OM_INVALID,
             "%s: monitor: part_limits_mm must ascend, or both be 0", name);
    OM_CHECK(part[0] == 0 || s->monitor.hysteresis < part[0], OM_INVALID,
             "%s: monitor: hysteresis_mm %g must be below the first of part_limits_mm, %g", name,
             1e3 * s->monitor.hysteresis, 1e3 * part[0]);
    const OmVec3* cells[2] = {&s->tissue.cells, &s->tissue.world_cells};
    for (int i = 0; i < 2; ++i) {
        OmVec3 c = *cells[i];
        OM_CHECK(c.x == floor(c.x) && c.y == floor(c.y) && c.z == floor(c.z), OM_INVALID,
                 "%s: tissue: %s: cell counts must be whole numbers", name,
                 i ? "world_cells" : "cells");
    }
    return om__scene_check_world(s, name);
}

OmCamera om_scene_camera_place(const OmSceneCamera* c, OmPose pose_world_camera) {
    bool has_center = c->center[0] != 0 || c->center[1] != 0;
    return (OmCamera){.pose_world_camera = pose_world_camera,
                      .width = c->width,
                      .height = c->height,
                      .fov = c->fov,
                      .near_m = 0.01,
                      .far_m = 2.0,
                      .lens = {.fx = c->focal[0],
                               .fy = c->focal[1],
                               .cx = has_center ? c->center[0] + 0.5 : 0,
                               .cy = has_center ? c->center[1] + 0.5 : 0,
                               .k1 = c->distortion[0],
                               .k2 = c->distortion[1],
                               .p1 = c->distortion[2],
                               .p2 = c->distortion[3],
                               .k3 = c->distortion[4]}};
}

static OmStatus check_camera(const OmSceneCamera* c, const char* title, const char* name) {
    OmCamera camera = om_scene_camera_place(c, (OmPose){.q = om_quat_identity()});
    OmStatus status = om_camera_check(&camera);
    if (status == OM_OK) return OM_OK;
    return om_error_prefix(status, "%s: %s: focal_px, center_px, distortion", name, title);
}

// ---- keys without effect --------------------------------------------------------------------------------------

// A key that differs from its default and has no effect on this source is a mistake of the user.
static OmStatus check_group(const OmYamlSchema* schema, const void* value, const void* plain,
                            int source, const char* name) {
    for (int i = 0; i < schema->nfield; ++i) {
        const OmYamlField* f = &schema->field[i];
        bool is_used = f->group == 0 || (f->group & OM__SCENE_IN(source));
        bool is_top = schema == &om__scene_schema;
        OM_CHECK(is_used || om_yaml_is_equal(f, value, plain), OM_INVALID,
                 "%s: %s%s%s has no effect on tissue of source %s; remove it", name,
                 is_top ? "" : schema->title, is_top ? "" : ": ", f->key,
                 om__scene_source_name[source]);
        if (!is_used || f->kind != OM_YAML_STRUCT) continue;
        OM_TRY(check_group(f->sub, (const char*)value + f->offset, (const char*)plain + f->offset,
                           source, name));
    }
    return OM_OK;
}

static OmStatus check_uses(const OmScene* s, const OmScene* plain, const char* name) {
    OM_TRY(check_group(&om__scene_schema, s, plain, s->tissue.source, name));
    OM_CHECK(s->tissue.source < OM_SOURCE_PATIENT || s->attach.kind == plain->attach.kind ||
                 s->attach.kind == OM_ATTACH_SET,
             OM_INVALID, "%s: attachments: a patient has its own; kind must be set", name);
    OM_CHECK(s->attach.kind == OM_ATTACH_BOX ||
                 (om_norm(s->attach.lo) == 0 && om_norm(s->attach.hi) == 0),
             OM_INVALID, "%s: attachments: lo_mm and hi_mm have no effect without kind: box", name);
    const OmSceneBelief* b = &s->believed;
    OM_CHECK(b->kind == OM_BELIEF_BOX || (om_norm(b->lo) == 0 && om_norm(b->hi) == 0), OM_INVALID,
             "%s: believed_attachments: lo_mm and hi_mm have no effect without kind: box", name);
    OM_CHECK(
        b->kind == OM_BELIEF_SAME || (om_norm(b->shift) == 0 && b->grow == 0 && b->ratio == 1),
        OM_INVALID,
        "%s: believed_attachments: shift_mm, grow_mm and ratio have no effect without kind: same",
        name);
    OM_CHECK(b->kind == OM_BELIEF_PATCH ||
                 (b->seed == plain->believed.seed && b->share == plain->believed.share),
             OM_INVALID,
             "%s: believed_attachments: seed and share have no effect without kind: random_patch",
             name);
    OM_CHECK(!s->roi.is_random || om_norm(s->roi.center) == 0, OM_INVALID,
             "%s: roi: center_mm has no effect on a random region; say random: false", name);
    return OM_OK;
}

OmStatus om_scene_parse(const char* text, size_t size, const char* name, OmScene* scene) {
    *scene = om_scene_default();
    OmScene whole = *scene;
    OmSceneTissue *t = &scene->tissue, plain = *t;
    t->young = t->poisson = t->density = -1;  // taken from the patient model
    OM_TRY(om_yaml_parse(text, size, name, &om__scene_schema, scene));
    if (t->source < OM_SOURCE_PATIENT) {
        if (t->young < 0) t->young = plain.young;
        if (t->poisson < 0) t->poisson = plain.poisson;
        if (t->density < 0) t->density = plain.density;
    }
    OM_TRY(validate(scene, name));
    OM_TRY(check_camera(&scene->endoscope, "endoscope", name));
    OM_TRY(check_camera(&scene->rgbd, "rgbd", name));
    OM_TRY(check_uses(scene, &whole, name));
    // A unit vector is not normalised again, so that a printed scene is read as the same scene.
    if (fabs(om_norm(t->up) - 1) > 1e-12) t->up = om_normalize(t->up);
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
        OM_TRY(om_yaml_load(root, &om__scene_calibrated_schema, scene));
        OM_TRY(validate(scene, root));
    }
    OM_TRY(om_path_join(dir, scene->data_root, root, sizeof root));
    snprintf(scene->data_root, sizeof scene->data_root, "%s", scene->data_root[0] ? root : dir);
    return OM_OK;
}
