// world_series.c: recorded series: series.yaml, its checks, and its pictures.
//
// series.yaml is read by a schema; positions are in metres, quaternions in the order of ROS (x, y, z, w), a pose may
// also be a 4 x 4 matrix, and principal points count pixels as OpenCV does. The whole file is written anew for each
// frame: 10,000 frames are 4 MB.
#include <stddef.h>
#include <string.h>

#include "omentum/scene_yaml.h"
#include "omentum/world_series.h"

#define MAX_TEXT (64u << 20)  // bytes of series.yaml
#define UNIT_TOLERANCE 1e-3   // of the length of a quaternion, and of the axes of a matrix
#define DEFAULT_UNIT 1e-4     // m
#define MAX_PLACE 1000.0      // m
#define MAX_JOINT 100.0       // rad or m
#define MAX_JAW 4.0           // rad
#define MAX_TIME 1e12         // s
#define COUNT(array) (int)(sizeof(array) / sizeof *(array))

typedef struct PoseItem {
    OmVec3 position;
    double quaternion[4];  // x, y, z, w; zero: not given
    double matrix[16];     // by rows; zero: not given
} PoseItem;

typedef struct ArmItem {
    PoseItem tip;
    double joint[OM_PSM_NJOINT], jaw;
    int line;
} ArmItem;

typedef struct FrameItem {
    double time;
    PoseItem pose;
    char color[OM_SERIES_FILE], depth[OM_SERIES_FILE], right[OM_SERIES_FILE];
    int narm, line;
    ArmItem arm[OM_MAX_ARM];
} FrameItem;

typedef struct CameraItem {
    int width, height;
    double focal[2], center[2], distortion[5], near_m, far_m;
    PoseItem pose;  // of the right camera in the frame of the left one
} CameraItem;

typedef struct SeriesFile {  // the values of the schema below
    CameraItem camera, right;
    double depth_unit;
    int nframe;
    FrameItem frame[];  // new_file makes them
} SeriesFile;

#define POSE_FIELDS(type, member)                                                       \
    {"position", OM_YAML_VEC3, offsetof(type, member) + offsetof(PoseItem, position),   \
     .min = -MAX_PLACE, .max = MAX_PLACE},                                              \
        {"quaternion_xyzw",                                                             \
         OM_YAML_NUMBERS,                                                               \
         offsetof(type, member) + offsetof(PoseItem, quaternion),                       \
         .capacity = 4,                                                                 \
         .min = -1.01,                                                                  \
         .max = 1.01},                                                                  \
    {                                                                                   \
        "matrix", OM_YAML_NUMBERS, offsetof(type, member) + offsetof(PoseItem, matrix), \
            .capacity = 16, .min = -1000, .max = 1000                                   \
    }

static const OmYamlField arm_field[] = {
    POSE_FIELDS(ArmItem, tip),
    {"joints", OM_YAML_NUMBERS, offsetof(ArmItem, joint), .capacity = OM_PSM_NJOINT,
     .min = -MAX_JOINT, .max = MAX_JOINT, .is_required = true},
    {"jaw", OM_YAML_DOUBLE, offsetof(ArmItem, jaw), .min = -MAX_JAW, .max = MAX_JAW,
     .is_required = true},
};
static const OmYamlSchema arm_schema = {.title = "arm",
                                        .field = arm_field,
                                        .nfield = COUNT(arm_field),
                                        .line_offset = offsetof(ArmItem, line)};

static const OmYamlField frame_field[] = {
    {"time", OM_YAML_DOUBLE, offsetof(FrameItem, time), .min = -MAX_TIME, .max = MAX_TIME,
     .is_required = true},
    POSE_FIELDS(FrameItem, pose),
    {"color", OM_YAML_STRING, offsetof(FrameItem, color), .size = OM_SERIES_FILE},
    {"depth", OM_YAML_STRING, offsetof(FrameItem, depth), .size = OM_SERIES_FILE},
    {"right", OM_YAML_STRING, offsetof(FrameItem, right), .size = OM_SERIES_FILE},
    {"arm", OM_YAML_LIST, offsetof(FrameItem, arm), .size = sizeof(ArmItem), .sub = &arm_schema,
     .count_offset = offsetof(FrameItem, narm), .capacity = OM_MAX_ARM},
};
static const OmYamlSchema frame_schema = {.title = "frame",
                                          .field = frame_field,
                                          .nfield = COUNT(frame_field),
                                          .line_offset = offsetof(FrameItem, line)};

static const OmYamlField camera_field[] = {
    {"width", OM_YAML_INT, offsetof(CameraItem, width), .min = 1, .max = 8192, .is_required = true},
    {"height", OM_YAML_INT, offsetof(CameraItem, height), .min = 1, .max = 8192,
     .is_required = true},
    {"focal_px", OM_YAML_NUMBERS, offsetof(CameraItem, focal), .capacity = 2, .min = 1e-3,
     .max = 1e6, .is_required = true},
    {"center_px", OM_YAML_NUMBERS, offsetof(CameraItem, center), .capacity = 2, .min = -0.5,
     .max = 8192, .is_required = true},
    {"distortion", OM_YAML_NUMBERS, offsetof(CameraItem, distortion), .capacity = 5, .min = -1000,
     .max = 1000},
    {"near_mm", OM_YAML_DOUBLE, offsetof(CameraItem, near_m), .min = 0, .max = 1e5, .scale = 1e-3},
    {"far_mm", OM_YAML_DOUBLE, offsetof(CameraItem, far_m), .min = 1e-3, .max = 1e6, .scale = 1e-3},
    POSE_FIELDS(CameraItem, pose),
};
static const OmYamlSchema camera_schema = {
    .title = "camera", .field = camera_field, .nfield = COUNT(camera_field)};

static const OmYamlField series_field[] = {
    {"camera", OM_YAML_STRUCT, offsetof(SeriesFile, camera), .sub = &camera_schema,
     .is_required = true},
    {"right", OM_YAML_STRUCT, offsetof(SeriesFile, right), .sub = &camera_schema},
    {"depth_unit_mm", OM_YAML_DOUBLE, offsetof(SeriesFile, depth_unit), .min = 1e-6, .max = 1000,
     .scale = 1e-3},
    {"frame", OM_YAML_LIST, offsetof(SeriesFile, frame), .size = sizeof(FrameItem),
     .sub = &frame_schema, .count_offset = offsetof(SeriesFile, nframe), .capacity = OM_SERIES_MAX},
};
static const OmYamlSchema series_schema = {
    .title = "series", .field = series_field, .nfield = COUNT(series_field)};

// Room for the values of a text of `size` bytes: its list of frames has at most one item a byte.
static SeriesFile* new_file(size_t size) {
    const size_t nframe = size < OM_SERIES_MAX ? size : OM_SERIES_MAX;
    return om_calloc(1, sizeof(SeriesFile) + nframe * sizeof(FrameItem));
}

// ---- reading ------------------------------------------------------------------------------------------------------

static bool is_zero(const double* v, int n) {
    for (int i = 0; i < n; ++i)
        if (v[i] != 0) return false;
    return true;
}

static OmStatus read_matrix(const double* m, const char* name, int line, const char* of,
                            OmPose* pose) {
    OmVec3 x = om_vec3(m[0], m[4], m[8]), y = om_vec3(m[1], m[5], m[9]),
           z = om_vec3(m[2], m[6], m[10]);
    OmVec3 off = om_sub(om_cross(x, y), z);
    bool is_rotation = fabs(om_norm(x) - 1) < UNIT_TOLERANCE && om_norm(off) < UNIT_TOLERANCE &&
                       fabs(om_norm(y) - 1) < UNIT_TOLERANCE && fabs(om_dot(x, y)) < UNIT_TOLERANCE;
    OM_CHECK(is_rotation && is_zero(m + 12, 3) && m[15] == 1, OM_INVALID,
             "%s:%d: %s: matrix is not a rigid motion; 16 numbers by rows, the last 0, 0, 0, 1, "
             "with columns of length 1 and translation in metres",
             name, line, of);
    pose->p = om_vec3(m[3], m[7], m[11]);
    pose->q = om_quat_from_mat3(om_mat3_cols(x, y, z));
    return OM_OK;
}

static OmStatus read_pose(const PoseItem* item, const char* name, int line, const char* of,
                          OmPose* pose) {
    bool has_matrix = !is_zero(item->matrix, 16), has_turn = !is_zero(item->quaternion, 4);
    OM_CHECK(has_matrix != has_turn, OM_INVALID,
             "%s:%d: %s: its pose is %s; give position and quaternion_xyzw, or matrix", name, line,
             of, has_matrix ? "given twice" : "missing");
    if (has_matrix) return read_matrix(item->matrix, name, line, of, pose);
    const double* q = item->quaternion;
    double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    OM_CHECK(fabs(length - 1) < UNIT_TOLERANCE, OM_INVALID,
             "%s:%d: %s: quaternion_xyzw has length %g; 1 is a rotation", name, line, of, length);
    pose->p = item->position;
    // A unit quaternion is not normalised again, so that a series that is written again stays the same.
    double scale = fabs(length - 1) < 1e-12 ? 1 : 1 / length;
    pose->q = (OmQuat){.x = scale * q[0], .y = scale * q[1], .z = scale * q[2], .w = scale * q[3]};
    return OM_OK;
}

static OmStatus read_camera(const CameraItem* item, const char* name, const char* of,
                            OmCamera* camera) {
    const double* k = item->distortion;
    *camera = (OmCamera){.pose_world_camera = {.q = om_quat_identity()},
                         .width = item->width,
                         .height = item->height,
                         .near_m = item->near_m,
                         .far_m = item->far_m,
                         .lens = {item->focal[0], item->focal[1], item->center[0] + 0.5,
                                  item->center[1] + 0.5, k[0], k[1], k[2], k[3], k[4]}};
    OmStatus status = om_camera_check(camera);
    return status == OM_OK ? OM_OK : om_error_prefix(status, "%s: %s", name, of);
}

static OmStatus check_files(const FrameItem* f, const SeriesFile* file, const char* name) {
    OM_CHECK(f->color[0] || f->depth[0], OM_INVALID,
             "%s:%d: frame: no picture; give color, depth, or both", name, f->line);
    OM_CHECK(!f->right[0] || (f->color[0] && !f->depth[0]), OM_INVALID,
             "%s:%d: frame: right needs color, the left picture, and no depth", name, f->line);
    OM_CHECK(!f->right[0] || file->right.width > 0, OM_INVALID,
             "%s:%d: frame: right is given, but the series has no camera \"right\"", name, f->line);
    const char* part[3] = {f->color, f->depth, f->right};
    for (int i = 0; i < 3; ++i)
        OM_CHECK(part[i][0] != '/' && !strstr(part[i], ".."), OM_INVALID,
                 "%s:%d: frame: \"%s\" is not in the series' folder; give a name relative to it",
                 name, f->line, part[i]);
    return OM_OK;
}

static OmStatus read_frame(const SeriesFile* file, int i, const char* name, OmSeriesFrame* out) {
    const FrameItem* f = &file->frame[i];
    OM_CHECK(i == 0 || f->time > f[-1].time, OM_INVALID,
             "%s:%d: frame: time %g does not come after %g; frames are in the order of time", name,
             f->line, f->time, i ? f[-1].time : 0);
    OM_TRY(check_files(f, file, name));
    *out = (OmSeriesFrame){.time = f->time, .narm = f->narm};
    OM_TRY(read_pose(&f->pose, name, f->line, "frame", &out->pose_world_camera));
    memcpy(out->color, f->color, sizeof out->color);
    memcpy(out->depth, f->depth, sizeof out->depth);
    memcpy(out->right, f->right, sizeof out->right);
    for (int a = 0; a < f->narm; ++a) {
        const ArmItem* arm = &f->arm[a];
        OM_TRY(read_pose(&arm->tip, name, arm->line, "arm", &out->arm[a].tip));
        memcpy(out->arm[a].q, arm->joint, sizeof arm->joint);
        out->arm[a].jaw = out->arm[a].jaw_goal = arm->jaw;
        out->arm[a].time = f->time;
    }
    return OM_OK;
}

static OmStatus read_all(const SeriesFile* file, const char* name, OmSeries* s) {
    OM_TRY(read_camera(&file->camera, name, "camera", &s->camera));
    s->depth_unit = file->depth_unit;
    s->has_right = file->right.width > 0;
    if (s->has_right) {
        OM_TRY(read_camera(&file->right, name, "right", &s->right));
        OM_TRY(read_pose(&file->right.pose, name, 1, "right", &s->right.pose_world_camera));
    }
    OM_ALLOC(s->frame, (size_t)(file->nframe > 0 ? file->nframe : 1));
    s->nframe = file->nframe;
    for (int i = 0; i < s->nframe; ++i) OM_TRY(read_frame(file, i, name, &s->frame[i]));
    return OM_OK;
}

OmStatus om_series_parse(const char* text, size_t size, const char* name, const char* dir,
                         OmSeries* series) {
    memset(series, 0, sizeof *series);
    OM_CHECK(strlen(dir) < sizeof series->dir, OM_INVALID, "%s: the folder's path is too long",
             name);
    SeriesFile* file = new_file(size);
    if (!file) return OM_NO_MEMORY;
    file->depth_unit = DEFAULT_UNIT;
    file->camera.near_m = file->right.near_m = 0.01;
    file->camera.far_m = file->right.far_m = 2;
    OmStatus status = om_yaml_parse(text, size, name, &series_schema, file);
    if (status == OM_OK) status = read_all(file, name, series);
    om_free(file);
    if (status < 0)
        om_series_done(series);
    else
        snprintf(series->dir, sizeof series->dir, "%s", dir);
    return status;
}

OmStatus om_series_load(const char* path, OmSeries* series) {
    char file[OM_SCENE_PATH], dir[OM_SCENE_PATH], extension[16], *text;
    size_t size;
    memset(series, 0, sizeof *series);
    om_path_extension(path, extension, sizeof extension);
    if (strcmp(extension, "yaml") == 0) {
        OM_TRY(om_path_dir(path, dir, sizeof dir));
        OM_TRY(om_path_join(".", path, file, sizeof file));
    } else {
        OM_TRY(om_path_join(path, "series.yaml", file, sizeof file));
        OM_TRY(om_path_join(path, ".", dir, sizeof dir));
    }
    OM_TRY(om_file_read(file, MAX_TEXT, &text, &size));
    OmStatus status = om_series_parse(text, size, file, dir, series);
    om_free(text);
    return status;
}

void om_series_done(OmSeries* series) {
    if (!series) return;
    om_free(series->frame);
    memset(series, 0, sizeof *series);
}

// ---- pictures -----------------------------------------------------------------------------------------------------

static OmStatus check_size(const char* path, int width, int height, const OmCamera* c) {
    OM_CHECK(width == c->width && height == c->height, OM_INVALID,
             "%s: %d x %d pixels, but the camera of series.yaml has %d x %d", path, width, height,
             c->width, c->height);
    return OM_OK;
}

static OmStatus load_picture(const OmSeries* s, const char* name, const OmCamera* c,
                             OmPicture* out) {
    char path[OM_SCENE_PATH];
    OM_TRY(om_path_join(s->dir, name, path, sizeof path));
    OM_TRY(om_picture_load_png(path, out));
    return check_size(path, out->width, out->height, c);
}

static OmStatus load_depth(const OmSeries* s, const char* name, float* depth) {
    char path[OM_SCENE_PATH];
    uint16_t* value;
    int width, height;
    OM_TRY(om_path_join(s->dir, name, path, sizeof path));
    OM_TRY(om_picture_load_png16(path, &value, &width, &height));
    OmStatus status = check_size(path, width, height, &s->camera);
    for (int i = 0; status == OM_OK && i < width * height; ++i)
        depth[i] = (float)(s->depth_unit * value[i]);
    om_free(value);
    return status;
}

static OmStatus find_depth(const OmSeries* s, const OmSeriesFrame* f, const OmStereoDef* stereo,
                           OmDepthPicture* rgbd) {
    OmStatus status = OM_OK;
    OmPicture right = {0};
    OmStereoDef def = stereo ? *stereo : om_stereo_default_def();
    OmStereoPair pair = {rgbd->camera, s->right, &rgbd->color, &right};
    pair.right.pose_world_camera = om_pose_mul(f->pose_world_camera, s->right.pose_world_camera);
    OM_TRY_DONE(load_picture(s, f->right, &s->right, &right));
    OM_TRY_DONE(om_stereo_depth(&def, &pair, rgbd->depth, NULL));
done:
    om_picture_done(&right);
    return status;
}

static OmStatus load_frame(const OmSeries* s, const OmSeriesFrame* f, const OmStereoDef* stereo,
                           OmObservation* obs) {
    OmCamera camera = s->camera;
    camera.pose_world_camera = f->pose_world_camera;
    obs->time = f->time;
    obs->narm = f->narm;
    memcpy(obs->arm, f->arm, sizeof obs->arm);
    if (!f->depth[0] && !f->right[0]) {
        obs->endoscope.time = f->time;
        obs->endoscope.camera = camera;
        return load_picture(s, f->color, &camera, &obs->endoscope.color);
    }
    obs->rgbd.time = f->time;
    obs->rgbd.camera = camera;
    if (f->color[0]) OM_TRY(load_picture(s, f->color, &camera, &obs->rgbd.color));
    OM_ALLOC(obs->rgbd.depth, (size_t)camera.width * (size_t)camera.height);
    if (f->right[0]) return find_depth(s, f, stereo, &obs->rgbd);
    return load_depth(s, f->depth, obs->rgbd.depth);
}

OmStatus om_series_get_frame(const OmSeries* series, int i, const OmStereoDef* stereo,
                             OmObservation* observation) {
    om_observation_done(observation);
    OM_CHECK(i >= 0 && i < series->nframe, OM_INVALID, "%s: frame %d; the series has %d",
             series->dir, i, series->nframe);
    OmStatus status = load_frame(series, &series->frame[i], stereo, observation);
    if (status < 0) om_observation_done(observation);
    return status;
}

// ---- recording ----------------------------------------------------------------------------------------------------

static OmStatus print_numbers(OmText* t, const char* key, const double* v, int n) {
    OM_TRY(om_text_append(t, "%s: [", key));
    for (int i = 0; i < n; ++i) OM_TRY(om_text_append(t, "%s%.17g", i ? ", " : "", v[i]));
    return om_text_append(t, "]");
}

static OmStatus print_pose(OmText* t, OmPose p) {
    OM_TRY(print_numbers(t, "position", (double[3]){p.p.x, p.p.y, p.p.z}, 3));
    OM_TRY(om_text_append(t, ", "));
    return print_numbers(t, "quaternion_xyzw", (double[4]){p.q.x, p.q.y, p.q.z, p.q.w}, 4);
}

static OmStatus print_camera(OmText* t, const char* key, const OmCamera* c, bool has_pose) {
    OmLens l = om_camera_lens(c);
    OM_TRY(om_text_append(t, "%s: {width: %d, height: %d, near_mm: %.17g, far_mm: %.17g,\n  ", key,
                          c->width, c->height, 1e3 * c->near_m, 1e3 * c->far_m));
    OM_TRY(print_numbers(t, "focal_px", (double[2]){l.fx, l.fy}, 2));
    OM_TRY(om_text_append(t, ", "));
    OM_TRY(print_numbers(t, "center_px", (double[2]){l.cx - 0.5, l.cy - 0.5}, 2));
    OM_TRY(om_text_append(t, ",\n  "));
    OM_TRY(print_numbers(t, "distortion", (double[5]){l.k1, l.k2, l.p1, l.p2, l.k3}, 5));
    if (has_pose) OM_TRY(om_text_append(t, ",\n  "));
    if (has_pose) OM_TRY(print_pose(t, c->pose_world_camera));
    return om_text_append(t, "}\n");
}

static OmStatus print_file(OmText* t, const char* key, const char* name) {
    if (!name[0]) return OM_OK;
    OM_TRY(om_text_append(t, "    %s: ", key));
    OM_TRY(om_text_append_quoted(t, name));
    return om_text_append(t, "\n");
}

static OmStatus print_frame(OmText* t, const OmSeriesFrame* f) {
    const OmPose p = f->pose_world_camera;
    OM_TRY(om_text_append(t, "  - time: %.17g\n    ", f->time));
    OM_TRY(print_numbers(t, "position", (double[3]){p.p.x, p.p.y, p.p.z}, 3));
    OM_TRY(om_text_append(t, "\n    "));
    OM_TRY(print_numbers(t, "quaternion_xyzw", (double[4]){p.q.x, p.q.y, p.q.z, p.q.w}, 4));
    OM_TRY(om_text_append(t, "\n"));
    OM_TRY(print_file(t, "color", f->color));
    OM_TRY(print_file(t, "depth", f->depth));
    OM_TRY(print_file(t, "right", f->right));
    if (f->narm > 0) OM_TRY(om_text_append(t, "    arm:\n"));
    for (int a = 0; a < f->narm; ++a) {
        OM_TRY(om_text_append(t, "      - {"));
        OM_TRY(print_pose(t, f->arm[a].tip));
        OM_TRY(om_text_append(t, ",\n         "));
        OM_TRY(print_numbers(t, "joints", f->arm[a].q, OM_PSM_NJOINT));
        OM_TRY(om_text_append(t, ", jaw: %.17g}\n", f->arm[a].jaw));
    }
    return OM_OK;
}

// What is written must be read again: the ranges of the schema, by its own reader.
static OmStatus check_camera(const OmCamera* c, const char* of, bool has_pose) {
    OmText t = {0};
    OmStatus status = OM_OK;
    SeriesFile* file = NULL;
    OM_TRY_DONE(print_camera(&t, "camera", c, has_pose));
    file = new_file(t.len);
    if (!file) status = OM_NO_MEMORY;
    if (!file) goto done;
    OM_TRY_DONE(om_yaml_parse(t.str, t.len, of, &series_schema, file));
    OmPose pose;
    if (has_pose) OM_TRY_DONE(read_pose(&file->camera.pose, of, 1, "camera", &pose));
done:
    om_text_done(&t);
    om_free(file);
    return status;
}

static OmStatus save(const OmSeries* s) {
    OmText t = {0};
    OmStatus status = OM_OK;
    char path[OM_SCENE_PATH];
    OM_TRY_DONE(om_path_join(s->dir, "series.yaml", path, sizeof path));
    OM_TRY_DONE(om_text_append(
        &t,
        "# omentum series: metres, seconds, radians; poses map camera or tip to the world;\n"
        "# the centre of the first pixel is (0, 0); depth along z of the camera, 0: no return\n"));
    OM_TRY_DONE(print_camera(&t, "camera", &s->camera, false));
    if (s->has_right) OM_TRY_DONE(print_camera(&t, "right", &s->right, true));
    OM_TRY_DONE(om_text_append(&t, "depth_unit_mm: %.17g\n", 1e3 * s->depth_unit));
    OM_TRY_DONE(om_text_append(&t, s->nframe > 0 ? "frame:\n" : "frame: []\n"));
    for (int i = 0; i < s->nframe; ++i) OM_TRY_DONE(print_frame(&t, &s->frame[i]));
    OM_TRY_DONE(om_file_write(path, t.str, t.len));
done:
    om_text_done(&t);
    return status;
}

OmStatus om_series_begin(const char* dir, const OmCamera* camera, const OmCamera* right,
                         OmSeries* series) {
    char path[OM_SCENE_PATH];
    memset(series, 0, sizeof *series);
    OM_TRY(om_camera_check(camera));
    if (right) OM_TRY(om_camera_check(right));
    OM_TRY(check_camera(camera, "the camera of a series", false));
    if (right) OM_TRY(check_camera(right, "the right camera of a series", true));
    OM_TRY(om_path_join(dir, "series.yaml", path, sizeof path));
    OM_CHECK(!om_path_exists(path), OM_INVALID, "%s holds a series; give another folder", dir);
    OM_TRY(om_path_make_dir(dir));
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(series->frame, OM_SERIES_MAX);
    snprintf(series->dir, sizeof series->dir, "%s", dir);
    series->camera = *camera;
    series->has_right = right != NULL;
    if (right) series->right = *right;
    series->depth_unit = DEFAULT_UNIT;
    series->capacity = OM_SERIES_MAX;
    OM_TRY_DONE(save(series));
done:
    if (status < 0) om_series_done(series);
    return status;
}

static bool is_same_camera(const OmCamera* a, const OmCamera* b) {
    OmLens l = om_camera_lens(a), m = om_camera_lens(b);
    return a->width == b->width && a->height == b->height && memcmp(&l, &m, sizeof l) == 0;
}

static bool is_within(const double* v, int n, double most) {
    for (int i = 0; i < n; ++i)
        if (!(fabs(v[i]) <= most)) return false;
    return true;
}

static OmStatus check_pose(OmPose p, const char* of, const OmSeries* s, double time) {
    OM_CHECK(isfinite(p.q.w + p.q.x + p.q.y + p.q.z) && om_is_finite3(p.p), OM_INVALID,
             "%s: the pose of the %s at time %g is not finite", s->dir, of, time);
    double length = sqrt(p.q.w * p.q.w + p.q.x * p.q.x + p.q.y * p.q.y + p.q.z * p.q.z);
    OM_CHECK(fabs(length - 1) < UNIT_TOLERANCE, OM_INVALID,
             "%s: the %s at time %g has a quaternion of length %g; 1 is a rotation", s->dir, of,
             time, length);
    OM_CHECK(is_within((double[3]){p.p.x, p.p.y, p.p.z}, 3, MAX_PLACE), OM_INVALID,
             "%s: the %s at time %g is at (%g, %g, %g) m; at most %g", s->dir, of, time, p.p.x,
             p.p.y, p.p.z, MAX_PLACE);
    return OM_OK;
}

static OmStatus check_arms(const OmSeries* s, double time, const OmObservation* obs) {
    OM_CHECK(obs->narm >= 0 && obs->narm <= OM_MAX_ARM, OM_INVALID, "%s: %d arms; 0 to %d", s->dir,
             obs->narm, OM_MAX_ARM);
    for (int a = 0; a < obs->narm; ++a) {
        const OmArmObservation* arm = &obs->arm[a];
        OM_TRY(check_pose(arm->tip, "tip of a tool", s, time));
        OM_CHECK(is_within(arm->q, OM_PSM_NJOINT, MAX_JOINT) && is_within(&arm->jaw, 1, MAX_JAW),
                 OM_INVALID, "%s: a joint of arm %d at time %g is beyond %g, or its jaw beyond %g",
                 s->dir, a, time, MAX_JOINT, MAX_JAW);
    }
    return OM_OK;
}

// A new frame with its time, pose and arms; it counts only after series.yaml has it.
static OmStatus begin_frame(OmSeries* s, double time, OmPose pose, const OmObservation* obs,
                            OmSeriesFrame** frame) {
    int n = s->nframe;
    OM_CHECK(n < s->capacity, OM_INVALID,
             "%s: no more than %d frames fit; a series that was read gets none", s->dir,
             s->capacity);
    OM_CHECK(fabs(time) <= MAX_TIME && (n == 0 || time > s->frame[n - 1].time), OM_INVALID,
             "%s: time %g of a frame does not come after %g, or is beyond %g", s->dir, time,
             n ? s->frame[n - 1].time : 0, MAX_TIME);
    OM_TRY(check_pose(pose, "camera", s, time));
    if (obs) OM_TRY(check_arms(s, time, obs));
    *frame = &s->frame[n];
    **frame = (OmSeriesFrame){.time = time, .pose_world_camera = pose};
    if (!obs) return OM_OK;
    (*frame)->narm = obs->narm;
    memcpy((*frame)->arm, obs->arm, sizeof obs->arm);
    return OM_OK;
}

static OmStatus end_frame(OmSeries* s) {
    ++s->nframe;
    OmStatus status = save(s);
    if (status < 0) --s->nframe;
    return status;
}

static OmStatus save_color(const OmSeries* s, const OmPicture* p, const OmCamera* c,
                           const char* kind, char* name) {
    char path[OM_SCENE_PATH];
    OM_CHECK(p->width == c->width && p->height == c->height, OM_INVALID,
             "%s: a picture of %d x %d pixels, its camera has %d x %d", s->dir, p->width, p->height,
             c->width, c->height);
    snprintf(name, OM_SERIES_FILE, "%06d_%s.png", s->nframe, kind);
    OM_TRY(om_path_join(s->dir, name, path, sizeof path));
    return om_picture_save_png(p, path);
}

static OmStatus save_depth(const OmSeries* s, const float* depth, char* name) {
    char path[OM_SCENE_PATH];
    uint16_t* value = NULL;
    OmStatus status = OM_OK;
    int w = s->camera.width, h = s->camera.height;
    snprintf(name, OM_SERIES_FILE, "%06d_depth.png", s->nframe);
    OM_TRY(om_path_join(s->dir, name, path, sizeof path));
    OM_ALLOC_DONE(value, (size_t)w * (size_t)h);
    for (int i = 0; i < w * h; ++i) {
        double count = (double)depth[i] / s->depth_unit + 0.5;
        value[i] = count >= 1 && count < 65536 ? (uint16_t)count : 0;  // NaN: 0
    }
    OM_TRY_DONE(om_picture_save_png16(value, w, h, path));
done:
    om_free(value);
    return status;
}

OmStatus om_series_append(OmSeries* s, const OmObservation* obs) {
    const OmDepthPicture* p = &obs->rgbd;
    OmSeriesFrame* f = NULL;
    OM_CHECK(p->depth, OM_INVALID, "%s: the observation has no depth picture", s->dir);
    OM_CHECK(is_same_camera(&p->camera, &s->camera), OM_INVALID,
             "%s: the depth camera is not the one that the series began with", s->dir);
    OM_TRY(begin_frame(s, p->time, p->camera.pose_world_camera, obs, &f));
    OM_TRY(save_depth(s, p->depth, f->depth));
    if (p->color.pixel) OM_TRY(save_color(s, &p->color, &s->camera, "color", f->color));
    return end_frame(s);
}

OmStatus om_series_append_stereo(OmSeries* s, double time, OmPose pose_world_camera,
                                 const OmPicture* left, const OmPicture* right,
                                 const OmObservation* observation) {
    OmSeriesFrame* f = NULL;
    OM_CHECK(s->has_right, OM_INVALID, "%s: the series began without a right camera", s->dir);
    OM_TRY(begin_frame(s, time, pose_world_camera, observation, &f));
    OM_TRY(save_color(s, left, &s->camera, "left", f->color));
    OM_TRY(save_color(s, right, &s->right, "right", f->right));
    return end_frame(s);
}
