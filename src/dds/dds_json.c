// dds_json.c: files of frames, and commands of the UDP link. The only file of the room that uses jansson.
//
// A file of frames is an object with the list "frames": name, position_mm, quaternion_xyzw, points, rms_mm, max_mm. A
// command is an object with "arm" and at most one operation; dds_udp.h has the table.
#include <jansson.h>
#include <string.h>

#include "dds/dds_udp.h"
#include "omentum/dds.h"

#define MAX_FILE 1000000  // bytes

// ---- files of frames ----------------------------------------------------------------------------------------------

static OmStatus read_numbers(const char* path, const json_t* object, const char* key, int n,
                             double* x) {
    const json_t* list = json_object_get(object, key);
    OM_CHECK(json_array_size(list) == (size_t)n, OM_INVALID, "%s: \"%s\" is no list of %d numbers",
             path, key, n);
    for (int i = 0; i < n; ++i) {
        const json_t* v = json_array_get(list, (size_t)i);
        OM_CHECK(json_is_number(v) && isfinite(json_number_value(v)), OM_INVALID,
                 "%s: \"%s\" is no list of %d numbers", path, key, n);
        x[i] = json_number_value(v);
    }
    return OM_OK;
}

static OmStatus read_frame(const char* path, const json_t* object, OmDdsFrame* f) {
    const json_t* name = json_object_get(object, "name");
    double p[3], q[4];
    OM_CHECK(json_is_string(name) && json_string_length(name) > 0 &&
                 json_string_length(name) < sizeof f->name,
             OM_INVALID, "%s: a frame has no \"name\" of 1 to %zu letters", path,
             sizeof f->name - 1);
    snprintf(f->name, sizeof f->name, "%s", json_string_value(name));
    OM_TRY(read_numbers(path, object, "position_mm", 3, p));
    OM_TRY(read_numbers(path, object, "quaternion_xyzw", 4, q));
    const double norm = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    OM_CHECK(fabs(norm - 1) < 1e-3, OM_INVALID, "%s: \"quaternion_xyzw\" of %s has length %g", path,
             f->name, norm);
    f->pose_world_frame.p = om_scale(1e-3, om_load3(p, 0));
    f->pose_world_frame.q = om_quat_normalize((OmQuat){.w = q[3], .x = q[0], .y = q[1], .z = q[2]});
    f->npoint = (int)json_integer_value(json_object_get(object, "points"));
    f->rms = 1e-3 * json_number_value(json_object_get(object, "rms_mm"));
    f->max = 1e-3 * json_number_value(json_object_get(object, "max_mm"));
    return OM_OK;
}

static OmStatus read_frames(const char* path, const json_t* root, OmDdsFrame* frame, int* nframe) {
    const json_t* list = json_object_get(root, "frames");
    OM_CHECK(json_is_array(list), OM_INVALID, "%s: no list \"frames\"", path);
    const size_t n = json_array_size(list);
    OM_CHECK(n <= OM_DDS_MAX_FRAME, OM_INVALID, "%s: %zu frames; at most %d", path, n,
             OM_DDS_MAX_FRAME);
    for (size_t i = 0; i < n; ++i) {
        OM_TRY(read_frame(path, json_array_get(list, i), &frame[i]));
        for (size_t k = 0; k < i; ++k)
            OM_CHECK(strcmp(frame[k].name, frame[i].name) != 0, OM_INVALID,
                     "%s: frame %s is there twice", path, frame[i].name);
    }
    *nframe = (int)n;
    return OM_OK;
}

OmStatus om_dds_frames_parse(const char* text, size_t size, const char* name,
                             OmDdsFrame frame[OM_DDS_MAX_FRAME], int* nframe) {
    json_error_t error;
    *nframe = 0;
    json_t* root = json_loadb(text, size, JSON_REJECT_DUPLICATES, &error);
    OM_CHECK(root, OM_INVALID, "%s:%d: %s", name, error.line, error.text);
    const OmStatus status = read_frames(name, root, frame, nframe);
    json_decref(root);
    return status;
}

OmStatus om_dds_frames_load(const char* path, OmDdsFrame frame[OM_DDS_MAX_FRAME], int* nframe) {
    char* text;
    size_t size;
    *nframe = 0;
    OM_TRY(om_file_read(path, MAX_FILE, &text, &size));
    const OmStatus status = om_dds_frames_parse(text, size, path, frame, nframe);
    om_free(text);
    return status;
}

OmStatus om_dds_frames_save(const OmDdsFrame* frame, int nframe, const char* path) {
    OmText text = {0};
    OmJson json = om_json_begin(&text);
    om_json_open(&json, NULL, '{');
    om_json_open(&json, "frames", '[');
    for (int i = 0; i < nframe; ++i) {
        const OmPose* pose = &frame[i].pose_world_frame;
        const double p[3] = {1e3 * pose->p.x, 1e3 * pose->p.y, 1e3 * pose->p.z};
        const double q[4] = {pose->q.x, pose->q.y, pose->q.z, pose->q.w};
        om_json_open(&json, NULL, '{');
        om_json_string(&json, "name", frame[i].name);
        om_json_numbers(&json, "position_mm", p, 3);
        om_json_numbers(&json, "quaternion_xyzw", q, 4);
        om_json_integer(&json, "points", frame[i].npoint);
        om_json_number(&json, "rms_mm", 1e3 * frame[i].rms);
        om_json_number(&json, "max_mm", 1e3 * frame[i].max);
        om_json_close(&json, '}');
    }
    om_json_close(&json, ']');
    om_json_close(&json, '}');
    const OmStatus status = om_json_save(&json, path);
    om_text_done(&text);
    return status;
}

// ---- commands -----------------------------------------------------------------------------------------------------

static const struct {
    const char* key;
    UdpKind kind;
    int n;  // numbers; 0: none
} operation[] = {
    {"servo_cp", UDP_SERVO_CP, 7},  {"move_cp", UDP_MOVE_CP, 7}, {"servo_jp", UDP_SERVO_JP, 6},
    {"move_jp", UDP_MOVE_JP, 6},    {"jaw", UDP_JAW, 1},         {"hold", UDP_HOLD, 0},
    {"state_command", UDP_STATE, 0}};

static OmStatus read_operation(const json_t* value, int k, UdpCommand* c) {
    c->kind = operation[k].kind;
    c->n = operation[k].n;
    if (c->kind == UDP_STATE) {
        OM_CHECK(json_is_string(value) && json_string_length(value) < sizeof c->text, OM_INVALID,
                 "\"state_command\" is no word");
        snprintf(c->text, sizeof c->text, "%s", json_string_value(value));
        return OM_OK;
    }
    if (c->kind == UDP_HOLD) return OM_OK;
    if (c->n == 1 && json_is_number(value)) {
        c->x[0] = json_number_value(value);
        return OM_OK;
    }
    // an arm may have fewer joints: it counts them
    const bool is_joints = c->kind == UDP_SERVO_JP || c->kind == UDP_MOVE_JP;
    const size_t n = json_array_size(value);
    if (is_joints && n >= 4 && n < OM_PSM_NJOINT) c->n = (int)n;
    OM_CHECK(n == (size_t)c->n, OM_INVALID, "\"%s\" is no list of %d numbers", operation[k].key,
             c->n);
    for (int i = 0; i < c->n; ++i) {
        const json_t* v = json_array_get(value, (size_t)i);
        OM_CHECK(json_is_number(v), OM_INVALID, "\"%s\" is no list of %d numbers", operation[k].key,
                 c->n);
        c->x[i] = json_number_value(v);
    }
    return OM_OK;
}

static OmStatus read_command(const json_t* root, UdpCommand* c) {
    const json_t* arm = json_object_get(root, "arm");
    OM_CHECK(json_is_object(root), OM_INVALID, "a command is an object");
    OM_CHECK(json_is_string(arm) && json_string_length(arm) < sizeof c->arm, OM_INVALID,
             "a command has no \"arm\", as \"PSM1\"");
    snprintf(c->arm, sizeof c->arm, "%s", json_string_value(arm));
    OM_CHECK(json_object_size(root) <= 2, OM_INVALID,
             "a command has \"arm\" and at most one operation");
    if (json_object_size(root) == 1) return OM_OK;
    for (int k = 0; k < (int)(sizeof operation / sizeof *operation); ++k) {
        const json_t* value = json_object_get(root, operation[k].key);
        if (value) return read_operation(value, k, c);
    }
    return om_error(OM_INVALID,
                    "unknown operation; known: servo_cp, move_cp, servo_jp, move_jp, jaw, hold, "
                    "state_command");
}

OmStatus om__udp_parse(const char* data, size_t size, UdpCommand* command) {
    json_error_t error;
    *command = (UdpCommand){.kind = UDP_ASK};
    json_t* root = json_loadb(data, size, JSON_REJECT_DUPLICATES, &error);
    OM_CHECK(root, OM_INVALID, "no JSON: %s", error.text);
    UdpCommand read = {.kind = UDP_ASK};
    const OmStatus status = read_command(root, &read);
    json_decref(root);
    if (status == OM_OK) *command = read;
    return status;
}

// ---- answers ------------------------------------------------------------------------------------------------------

static void add_pose(OmJson* json, const char* key, OmPose p) {
    const double x[7] = {p.p.x, p.p.y, p.p.z, p.q.x, p.q.y, p.q.z, p.q.w};
    om_json_numbers(json, key, x, 7);
}

void om__udp_print_arm(OmJson* json, const char* name, const Arm* arm,
                       const OmArmObservation* seen) {
    const double force[3] = {seen->force.x, seen->force.y, seen->force.z};
    om_json_open(json, name, '{');
    om_json_string(json, "state", om__arm_mode_name(arm->mode));
    om_json_bool(json, "is_homed", arm->is_homed);
    om_json_bool(json, "is_busy", arm->motion == ARM_MOVE);
    add_pose(json, "measured_cp", seen->tip);
    add_pose(json, "setpoint_cp", arm->setpoint);
    om_json_numbers(json, "measured_js", seen->q, arm->psm.njoint);
    if (arm->psm.has_jaw) om_json_number(json, "jaw", seen->jaw);
    if (seen->has_wrench) om_json_numbers(json, "force", force, 3);
    om_json_close(json, '}');
}
