// match_acquisition.c: acquisitions as files.
#include <math.h>
#include <string.h>

#include "omentum/match_acquisition.h"
#include "omentum/scan_file.h"
#include "omentum/scene_yaml.h"
#include "omentum/world_cloud.h"
#include "omentum/world_series.h"

#define MM 1e-3
#define DEG (OM_PI / 180)
#define AT(type, member) offsetof(type, member)
#define COUNT(array) ((int)(sizeof(array) / sizeof *(array)))
#define QUATERNION_TOLERANCE 0.01  // of the length of an orientation: files are rounded

// ---- keys -------------------------------------------------------------------------------------------

typedef struct PoseItem {
    OmVec3 position;
    OmQuat orientation;
} PoseItem;

typedef struct CameraItem {
    PoseItem pose;
    int width, height;  // 0: there is no camera
    double fov;
    double focal[2], center[2], distortion[5];  // as OpenCV counts them; zero: an ideal pinhole
} CameraItem;

typedef struct ToolItem {
    int arm;
    PoseItem grasp, now;
    int grasp_frame;
    double radius;
} ToolItem;

typedef struct Keys {
    char cloud[512], series[512], rest[512];
    int frame, rest_frame;
    int unit, space, registered;
    double time, noise;
    CameraItem camera;
    ToolItem tool[OM_MAX_ARM];
    int ntool;
} Keys;

static const char* const unit_name[] = {"file", "m", "cm", "mm", NULL};
static const double unit_value[] = {0, OM_UNIT_M, OM_UNIT_CM, OM_UNIT_MM};
static const char* const space_name[] = {"file", "RAS", "LPS", NULL};
static const char* const registered_name[] = {"yes", "roughly", "no", NULL};
static const char* const arm_name[] = {"psm1", "psm2", NULL};

static const OmYamlField quaternion_field[] = {
    {"x", OM_YAML_DOUBLE, AT(OmQuat, x), .min = -1.1, .max = 1.1, .is_required = true},
    {"y", OM_YAML_DOUBLE, AT(OmQuat, y), .min = -1.1, .max = 1.1, .is_required = true},
    {"z", OM_YAML_DOUBLE, AT(OmQuat, z), .min = -1.1, .max = 1.1, .is_required = true},
    {"w", OM_YAML_DOUBLE, AT(OmQuat, w), .min = -1.1, .max = 1.1, .is_required = true},
};
static const OmYamlSchema quaternion_schema = {"orientation", quaternion_field, 4, NULL};

static const OmYamlField pose_field[] = {
    {"position_mm", OM_YAML_VEC3, AT(PoseItem, position), .min = -1e5, .max = 1e5, .scale = MM,
     .is_required = true},
    {"orientation", OM_YAML_STRUCT, AT(PoseItem, orientation), .sub = &quaternion_schema},
};
static const OmYamlSchema pose_schema = {"pose", pose_field, 2, NULL};

static const OmYamlField camera_field[] = {
    {"position_mm", OM_YAML_VEC3, AT(CameraItem, pose.position), .min = -1e5, .max = 1e5,
     .scale = MM, .is_required = true},
    {"orientation", OM_YAML_STRUCT, AT(CameraItem, pose.orientation), .sub = &quaternion_schema,
     .is_required = true},
    {"width", OM_YAML_INT, AT(CameraItem, width), .min = 1, .max = 8192, .is_required = true},
    {"height", OM_YAML_INT, AT(CameraItem, height), .min = 1, .max = 8192, .is_required = true},
    {"fov_deg", OM_YAML_DOUBLE, AT(CameraItem, fov), .min = 1, .max = 179, .scale = DEG,
     .is_required = true},
    {"focal_px", OM_YAML_NUMBERS, AT(CameraItem, focal), .capacity = 2, .min = 0, .max = 1e5},
    {"center_px", OM_YAML_NUMBERS, AT(CameraItem, center), .capacity = 2, .min = 0, .max = 8192},
    {"distortion", OM_YAML_NUMBERS, AT(CameraItem, distortion), .capacity = 5, .min = -1000,
     .max = 1000},
};
static const OmYamlSchema camera_schema = {"camera", camera_field, COUNT(camera_field), NULL};

static const OmYamlField tool_field[] = {
    {"arm", OM_YAML_ENUM, AT(ToolItem, arm), .name = arm_name, .is_required = true},
    {"grasp", OM_YAML_STRUCT, AT(ToolItem, grasp), .sub = &pose_schema},
    {"now", OM_YAML_STRUCT, AT(ToolItem, now), .sub = &pose_schema},
    {"grasp_frame", OM_YAML_INT, AT(ToolItem, grasp_frame), .min = 0, .max = OM_SERIES_MAX},
    {"radius_mm", OM_YAML_DOUBLE, AT(ToolItem, radius), .min = 0.1, .max = 100, .scale = MM},
};
static void set_tool_default(void* item) {
    ToolItem* tool = item;
    tool->grasp.orientation = tool->now.orientation = om_quat_identity();
    tool->grasp.position.x = tool->now.position.x = HUGE_VAL;  // not given
    tool->grasp_frame = -1;
}
static const OmYamlSchema tool_schema = {"tools", tool_field, COUNT(tool_field), set_tool_default};

static const OmYamlField key_field[] = {
    {"cloud", OM_YAML_STRING, AT(Keys, cloud), .size = 512},
    {"series", OM_YAML_STRING, AT(Keys, series), .size = 512},
    {"rest", OM_YAML_STRING, AT(Keys, rest), .size = 512},
    {"frame", OM_YAML_INT, AT(Keys, frame), .min = 0, .max = OM_SERIES_MAX},
    {"rest_frame", OM_YAML_INT, AT(Keys, rest_frame), .min = 0, .max = OM_SERIES_MAX},
    {"unit", OM_YAML_ENUM, AT(Keys, unit), .name = unit_name},
    {"space", OM_YAML_ENUM, AT(Keys, space), .name = space_name},
    {"registered", OM_YAML_ENUM, AT(Keys, registered), .name = registered_name},
    {"time", OM_YAML_DOUBLE, AT(Keys, time), .min = 0, .max = 1e9},
    {"noise_mm", OM_YAML_DOUBLE, AT(Keys, noise), .min = 0, .max = 100, .scale = MM},
    {"camera", OM_YAML_STRUCT, AT(Keys, camera), .sub = &camera_schema},
    {"tools", OM_YAML_LIST, AT(Keys, tool), .size = sizeof(ToolItem), .sub = &tool_schema,
     .count_offset = AT(Keys, ntool), .capacity = OM_MAX_ARM},
};
static const OmYamlSchema key_schema = {"acquisition", key_field, COUNT(key_field), NULL};

static const char example[] =
    "# One moment of an operation, for omentum update. Positions are millimetres in the world (a patient: RAS).\n"
    "cloud: lift.ply          # .ply .vtp .csv .stl .obj: the surface of the tissue, as a camera sees it\n"
    "# rest: rest.ply         # the tissue before the tools moved it, by the same camera: shows a wrong camera\n"
    "unit: mm                 # of the clouds: m, cm, mm, or file: what the cloud says, else millimetres\n"
    "space: RAS               # of the cloud: RAS, LPS, or file\n"
    "registered: yes          # yes: cloud, camera and tools are in the frame of the model;\n"
    "                         # roughly: up to 30 degrees and 30 mm off; no: in any other frame\n"
    "time: 12.5               # s\n"
    "noise_mm: 0.3            # standard deviation of a point along its ray; 0: not known\n"
    "camera:                  # may be left out; z forward, x right, y down\n"
    "  position_mm: [-140, 0, 160]\n"
    "  orientation: {x: 0.6446, y: -0.6446, z: 0.2906, w: -0.2906}\n"
    "  width: 640\n"
    "  height: 480\n"
    "  fov_deg: 50            # vertical; of a calibrated camera also, as OpenCV and ROS write them:\n"
    "  focal_px: [0, 0]       # fx, fy; 0: from fov_deg\n"
    "  center_px: [0, 0]      # cx, cy; 0: the middle\n"
    "  distortion: [0, 0, 0, 0, 0]  # k1, k2, p1, p2, k3\n"
    "tools:                   # those that hold tissue\n"
    "  - arm: psm1            # psm1 or psm2\n"
    "    grasp:               # tip when the jaw closed\n"
    "      position_mm: [-40, -35, 5]\n"
    "      orientation: {x: 0, y: 0, z: 0, w: 1}\n"
    "    now:                 # tip at the time of the cloud\n"
    "      position_mm: [-40, -35, 30]\n"
    "      orientation: {x: 0, y: 0, z: 0, w: 1}\n"
    "    radius_mm: 5         # of the grasp; left out: the scene's\n"
    "# Instead of a cloud, a frame of a recorded series of pictures: its camera and arms are known.\n"
    "# series: out/series     # the folder of series.yaml\n"
    "# frame: 12              # from 0\n"
    "# rest_frame: 0          # before the tools moved the tissue; left out: the first grasp_frame\n"
    "# tools:\n"
    "#   - {arm: psm1, grasp_frame: 3}  # the frame in which the jaw closed\n";

OmStatus om_acquisition_print_example(OmText* text) { return om_text_append(text, "%s", example); }

// ---- reading ----------------------------------------------------------------------------------------

static OmStatus make_pose(const PoseItem* item, const char* name, const char* what, OmPose* pose) {
    OmQuat q = item->orientation;
    double length = sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
    OM_CHECK(fabs(length - 1) < QUATERNION_TOLERANCE, OM_INVALID,
             "%s: %s: orientation has length %.4g; the length of a unit quaternion is 1", name,
             what, length);
    *pose = (OmPose){item->position, om_quat_normalize(q)};
    return OM_OK;
}

static OmStatus set_grasps(const Keys* k, const char* name, OmAcquisitionFile* file) {
    for (int i = 0; i < k->ntool; ++i) {
        const ToolItem* tool = &k->tool[i];
        OmMatchGrasp* grasp = &file->grasp[i];
        OM_CHECK(i == 0 || tool->arm != k->tool[0].arm, OM_INVALID,
                 "%s: tools: two are of arm %s; a tool has one grasp", name, arm_name[tool->arm]);
        bool has_grasp = isfinite(tool->grasp.position.x), has_now = isfinite(tool->now.position.x);
        grasp->arm = tool->arm;
        grasp->radius = tool->radius;
        file->grasp_frame[i] = tool->grasp_frame;
        if (tool->grasp_frame >= 0) {
            OM_CHECK(file->series[0] && !has_grasp && !has_now, OM_INVALID,
                     "%s: tools: grasp_frame needs a series, and replaces grasp and now", name);
            grasp->pose_world_grasp = grasp->pose_world_now = om_pose_identity();
            continue;
        }
        OM_CHECK(has_grasp && has_now, OM_INVALID,
                 "%s: tools: \"%s\" is missing: the pose of the tip %s", name,
                 has_grasp ? "now" : "grasp",
                 has_grasp ? "at the time of the cloud" : "when the jaw closed");
        OM_TRY(make_pose(&tool->grasp, name, "tools: grasp", &grasp->pose_world_grasp));
        OM_TRY(make_pose(&tool->now, name, "tools: now", &grasp->pose_world_now));
    }
    file->ngrasp = k->ntool;
    return OM_OK;
}

static OmStatus set_camera(const CameraItem* item, const char* name, OmAcquisitionFile* file) {
    const double *f = item->focal, *c = item->center, *d = item->distortion;
    bool has_center = c[0] != 0 || c[1] != 0;
    file->has_camera = item->width > 0;
    file->camera = (OmCamera){.width = item->width,
                              .height = item->height,
                              .fov = item->fov,
                              .near_m = 1e-3,
                              .far_m = 10,
                              .lens = {f[0], f[1], has_center ? c[0] + 0.5 : 0,
                                       has_center ? c[1] + 0.5 : 0, d[0], d[1], d[2], d[3], d[4]}};
    if (!file->has_camera) return OM_OK;
    OM_TRY(make_pose(&item->pose, name, "camera", &file->camera.pose_world_camera));
    OmStatus status = om_camera_check(&file->camera);
    return status < 0 ? om_error_prefix(status, "%s: camera", name) : status;
}

OmStatus om_acquisition_parse(const char* text, size_t size, const char* name,
                              OmAcquisitionFile* file) {
    memset(file, 0, sizeof *file);
    Keys* k = om_calloc(1, sizeof *k);
    if (!k) return OM_NO_MEMORY;
    k->rest_frame = -1;
    OmStatus status = om_yaml_parse(text, size, name, &key_schema, k);
    if (status == OM_OK && (k->cloud[0] != 0) == (k->series[0] != 0))
        status = om_error(OM_INVALID, "%s: name one source: cloud or series", name);
    if (status == OM_OK && k->series[0] && k->camera.width > 0)
        status = om_error(OM_INVALID, "%s: camera: a series has its own", name);
    if (status == OM_OK && k->series[0] && k->rest[0])
        status = om_error(
            OM_INVALID,
            "%s: rest is of a cloud; of a series, name the frame of the tissue at rest: rest_frame: N",
            name);
    if (status == OM_OK && k->cloud[0] && k->rest_frame >= 0)
        status = om_error(
            OM_INVALID,
            "%s: rest_frame is of a series; of a cloud, name the cloud of the tissue at rest: rest: FILE",
            name);
    memcpy(file->series, k->series, sizeof file->series);
    if (status == OM_OK) status = set_grasps(k, name, file);
    if (status == OM_OK) status = set_camera(&k->camera, name, file);
    snprintf(file->path, sizeof file->path, "%s", name);
    memcpy(file->cloud, k->cloud, sizeof file->cloud);
    memcpy(file->rest, k->rest, sizeof file->rest);
    file->rest_frame = k->rest_frame;
    file->frame = (OmMeshFrame){unit_value[k->unit], (OmSpace)k->space};
    file->frame_index = k->frame;
    file->registered = k->registered;
    file->time = k->time;
    file->noise = k->noise;
    om_free(k);
    return status;
}

#define MAX_FILE (1 << 20)  // bytes of a file of keys

static OmStatus load_keys(const char* path, OmAcquisitionFile* file) {
    char* text;
    size_t size;
    OM_TRY(om_file_read(path, MAX_FILE, &text, &size));
    OmStatus status = om_acquisition_parse(text, size, path, file);
    om_free(text);
    return status;
}

static OmStatus load_cloud(const OmAcquisitionFile* file, const char* name, OmScan* scan) {
    char dir[512], path[1024];
    OM_TRY(om_path_dir(file->path, dir, sizeof dir));
    OM_TRY(om_path_join(dir, name, path, sizeof path));
    OmScanFileDef def = om_scan_file_default_def();
    def.frame = file->frame;
    def.noise = file->noise;
    def.has_eye = file->has_camera;
    def.eye = file->camera.pose_world_camera.p;
    OmStatus status = om_scan_load(path, &def, scan, NULL);
    if (status < 0) return om_error_prefix(status, "%s: cloud", file->path);
    scan->has_camera = file->has_camera;
    scan->camera = file->camera;
    return OM_OK;
}

// Room for the scan at rest.
static OmStatus add_rest(OmAcquisition* a, OmScan** rest) {
    *rest = om_calloc(1, sizeof **rest);
    if (!*rest) return OM_NO_MEMORY;
    a->rest = a->owned_rest = *rest;
    return OM_OK;
}

static OmStatus find_scan(const OmSite* site, const OmSeries* series, int frame, OmScan* scan) {
    OmObservation obs = {0};
    OM_TRY(om_series_get_frame(series, frame, NULL, &obs));
    const OmScanDef def = om_scan_default_def(om_site_spacing(site));
    const OmCloudDef space = om_cloud_default_def(NULL, site);
    OmStatus status = om_scan_from_observation(&def, &space, &obs, scan);
    om_observation_done(&obs);
    return status;
}

// The observation of a frame, its scan, and the tips of the tools then and in the frame of the grasp.
static OmStatus read_series(const OmAcquisitionFile* file, const OmSite* site,
                            const OmSeries* series, OmAcquisition* a) {
    int at = file->frame_index, rest_at = file->rest_frame;
    for (int i = 0; i < a->ngrasp && file->rest_frame < 0; ++i) {
        int then = file->grasp_frame[i];
        if (then >= 0 && (rest_at < 0 || then < rest_at)) rest_at = then;
    }
    OM_TRY(find_scan(site, series, at, &a->scan));
    if (rest_at >= 0 && rest_at != at) {
        OmScan* rest;
        OM_TRY(add_rest(a, &rest));
        OM_CHECK(rest_at < series->nframe, OM_INVALID, "%s %d; the series has %d frames",
                 file->rest_frame < 0 ? "tools: grasp_frame" : "rest_frame", rest_at,
                 series->nframe);
        OM_TRY(find_scan(site, series, rest_at, rest));
    }
    a->time = a->scan.time;
    for (int i = 0; i < a->ngrasp; ++i) {
        OmMatchGrasp* grasp = &a->grasp[i];
        int then = file->grasp_frame[i];
        if (then < 0) continue;
        OM_CHECK(then < series->nframe, OM_INVALID,
                 "tools: grasp_frame %d; the series has %d frames", then, series->nframe);
        OM_CHECK(grasp->arm < series->frame[then].narm && grasp->arm < series->frame[at].narm,
                 OM_INVALID, "tools: the series has no %s", arm_name[grasp->arm]);
        grasp->pose_world_grasp = series->frame[then].arm[grasp->arm].tip;
        grasp->pose_world_now = series->frame[at].arm[grasp->arm].tip;
    }
    return OM_OK;
}

static OmStatus load_series(const OmAcquisitionFile* file, const OmSite* site, OmAcquisition* a) {
    char dir[512], path[1024];
    OmSeries series;
    OM_CHECK(site, OM_INVALID, "%s: series: without a site the tissue cannot be found in pictures",
             file->path);
    OM_TRY(om_path_dir(file->path, dir, sizeof dir));
    OM_TRY(om_path_join(dir, file->series, path, sizeof path));
    OmStatus status = om_series_load(path, &series);
    if (status >= 0) {
        status = read_series(file, site, &series, a);
        om_series_done(&series);
    }
    return status < 0 ? om_error_prefix(status, "%s", file->path) : status;
}

static OmStatus load_points(const OmAcquisitionFile* file, OmAcquisition* a) {
    OM_TRY(load_cloud(file, file->cloud, &a->scan));
    a->time = a->scan.time = file->time;
    if (!file->rest[0]) return OM_OK;
    OmScan* rest;
    OM_TRY(add_rest(a, &rest));
    return load_cloud(file, file->rest, rest);
}

OmStatus om_acquisition_load(const char* path, const OmSite* site, OmAcquisitionFile* file,
                             OmAcquisition* acquisition) {
    memset(acquisition, 0, sizeof *acquisition);
    OmAcquisitionFile own;
    if (!file) file = &own;
    OM_TRY(load_keys(path, file));
    acquisition->ngrasp = file->ngrasp;
    memcpy(acquisition->grasp, file->grasp, sizeof file->grasp);
    OmStatus status =
        file->series[0] ? load_series(file, site, acquisition) : load_points(file, acquisition);
    if (status < 0) om_acquisition_done(acquisition);
    return status;
}

void om_acquisition_done(OmAcquisition* acquisition) {
    if (!acquisition) return;
    om_scan_done(&acquisition->scan);
    om_scan_done(acquisition->owned_rest);
    om_free(acquisition->owned_rest);
    memset(acquisition, 0, sizeof *acquisition);
}

static void move_scan(OmPose pose_new_old, OmScan* scan) {
    for (int i = 0; i < scan->npoint; ++i) {
        om_store3(scan->x, i, om_pose_apply(pose_new_old, om_load3(scan->x, i)));
        om_store3(scan->normal, i, om_quat_rotate(pose_new_old.q, om_load3(scan->normal, i)));
    }
    scan->camera.pose_world_camera = om_pose_mul(pose_new_old, scan->camera.pose_world_camera);
}

void om_acquisition_move(OmAcquisition* acquisition, OmPose pose_new_old) {
    move_scan(pose_new_old, &acquisition->scan);
    if (acquisition->owned_rest) move_scan(pose_new_old, acquisition->owned_rest);
    for (int i = 0; i < acquisition->ngrasp; ++i) {
        OmMatchGrasp* grasp = &acquisition->grasp[i];
        grasp->pose_world_grasp = om_pose_mul(pose_new_old, grasp->pose_world_grasp);
        grasp->pose_world_now = om_pose_mul(pose_new_old, grasp->pose_world_now);
    }
}

// ---- writing ----------------------------------------------------------------------------------------

static OmStatus add_pose(OmText* t, const char* indent, OmPose pose) {
    OM_TRY(om_text_append(t, "%sposition_mm: [%.17g, %.17g, %.17g]\n", indent, pose.p.x / MM,
                          pose.p.y / MM, pose.p.z / MM));
    return om_text_append(t, "%sorientation: {x: %.17g, y: %.17g, z: %.17g, w: %.17g}\n", indent,
                          pose.q.x, pose.q.y, pose.q.z, pose.q.w);
}

static OmStatus add_camera(OmText* t, const OmCamera* camera) {
    OmLens lens = camera->lens;
    bool has_center = lens.cx != 0 || lens.cy != 0;
    OM_TRY(om_text_append(t, "camera:\n"));
    OM_TRY(add_pose(t, "  ", camera->pose_world_camera));
    OM_TRY(om_text_append(t, "  width: %d\n  height: %d\n  fov_deg: %.17g\n", camera->width,
                          camera->height, camera->fov / DEG));
    if (lens.fx == 0) return OM_OK;
    return om_text_append(t,
                          "  focal_px: [%.17g, %.17g]\n  center_px: [%.17g, %.17g]\n"
                          "  distortion: [%.17g, %.17g, %.17g, %.17g, %.17g]\n",
                          lens.fx, lens.fy, has_center ? lens.cx - 0.5 : 0,
                          has_center ? lens.cy - 0.5 : 0, lens.k1, lens.k2, lens.p1, lens.p2,
                          lens.k3);
}

static OmStatus add_keys(OmText* t, const OmAcquisition* a, const char* cloud, const char* rest) {
    OM_TRY(om_text_append(t, "cloud: "));
    OM_TRY(om_text_append_quoted(t, cloud));
    if (a->rest) {
        OM_TRY(om_text_append(t, "\nrest: "));
        OM_TRY(om_text_append_quoted(t, rest));
    }
    OM_TRY(om_text_append(t, "\nregistered: yes\ntime: %.17g\nnoise_mm: %.17g\n", a->time,
                          a->scan.noise / MM));
    if (a->scan.has_camera) OM_TRY(add_camera(t, &a->scan.camera));
    if (a->ngrasp > 0) OM_TRY(om_text_append(t, "tools:\n"));
    for (int i = 0; i < a->ngrasp; ++i) {
        const OmMatchGrasp* grasp = &a->grasp[i];
        OM_TRY(om_text_append(t, "  - arm: %s\n    grasp:\n", arm_name[grasp->arm]));
        OM_TRY(add_pose(t, "      ", grasp->pose_world_grasp));
        OM_TRY(om_text_append(t, "    now:\n"));
        OM_TRY(add_pose(t, "      ", grasp->pose_world_now));
        if (grasp->radius > 0)
            OM_TRY(om_text_append(t, "    radius_mm: %.17g\n", grasp->radius / MM));
    }
    return OM_OK;
}

OmStatus om_acquisition_save(const OmAcquisition* acquisition, const char* path) {
    char cloud[1024], rest[1024];
    size_t len = strlen(path);
    OM_CHECK(len > 5 && len + 5 < sizeof cloud && strcmp(path + len - 5, ".yaml") == 0, OM_INVALID,
             "an acquisition is written to a file whose name ends in .yaml, not to \"%s\"", path);
    snprintf(cloud, sizeof cloud, "%.*s.ply", (int)len - 5, path);
    snprintf(rest, sizeof rest, "%.*s-rest.ply", (int)len - 5, path);
    const OmMeshFrame frame = {OM_UNIT_M, OM_SPACE_RAS};
    OM_TRY(om_scan_save(&acquisition->scan, cloud, frame));
    if (acquisition->rest) OM_TRY(om_scan_save(acquisition->rest, rest, frame));
    const char *slash = strrchr(cloud, '/'), *rest_slash = strrchr(rest, '/');
    OmText text = {0};
    OmStatus status =
        add_keys(&text, acquisition, slash ? slash + 1 : cloud, rest_slash ? rest_slash + 1 : rest);
    if (status == OM_OK) status = om_file_write(path, text.str, text.len);
    om_text_done(&text);
    return status;
}
