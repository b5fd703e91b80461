// dds_frames.c: where a robot's frames are, from points that it touched, and their file.
//
// The only file of the room that uses jansson. The file is an object with the list "frames": name, position_mm,
// quaternion_xyzw, points, rms_mm, max_mm.
#include <jansson.h>
#include <string.h>

#include "omentum/dds.h"

#define MAX_FILE 1000000  // bytes
#define MIN_POINTS 4      // of three the residuals say nothing
#define MIN_SPREAD 0.005  // m, rms distance of the points from the nearest line

// ---- from points ----------------------------------------------------------------------------------------------

static OmVec3 centre_of(const double* x, int n) {
    OmVec3 sum = om_vec3(0, 0, 0);
    for (int i = 0; i < n; ++i) sum = om_add(sum, om_load3(x, i));
    return om_scale(1.0 / n, sum);
}

// The columns of `u` are left singular vectors of the sum of a b^T, those of `v` the right ones.
static OmMat3 rotation_of(OmMat3 h) {
    OmMat3 u, v;
    OmVec3 s;
    om_mat3_svd(h, &u, &s, &v);
    OmMat3 r = om_mat3_mul(v, om_mat3_transpose(u));
    if (om_mat3_det(r) > 0) return r;
    v.cz = om_scale(-1, v.cz);  // no mirror
    return om_mat3_mul(v, om_mat3_transpose(u));
}

static OmMat3 outer(OmVec3 a, OmVec3 b) {
    return om_mat3_cols(om_scale(b.x, a), om_scale(b.y, a), om_scale(b.z, a));
}

static OmMat3 add(OmMat3 a, OmMat3 b) {
    return om_mat3_cols(om_add(a.cx, b.cx), om_add(a.cy, b.cy), om_add(a.cz, b.cz));
}

OmStatus om_dds_frame_fit(const double* x_frame, const double* x_world, int n, OmDdsFrame* frame,
                          int* worst) {
    *worst = -1;
    OM_CHECK(n >= MIN_POINTS, OM_INVALID, "%d points; at least %d", n, MIN_POINTS);
    for (int i = 0; i < 3 * n; ++i)
        OM_CHECK(isfinite(x_frame[i]) && isfinite(x_world[i]), OM_INVALID, "point %d is not finite",
                 i / 3 + 1);
    const OmVec3 a0 = centre_of(x_frame, n), b0 = centre_of(x_world, n);
    OmMat3 h = {0}, spread = {0};
    for (int i = 0; i < n; ++i) {
        const OmVec3 a = om_sub(om_load3(x_frame, i), a0), b = om_sub(om_load3(x_world, i), b0);
        h = add(h, outer(a, b));
        spread = add(spread, outer(b, b));
    }
    OmVec3 w;
    OmMat3 v;
    om_mat3_eigen_symmetric(spread, &w, &v);
    const double off_line = sqrt(fmax(0, w.x + w.y) / n);
    OM_CHECK(
        off_line >= MIN_SPREAD, OM_INVALID,
        "the points are within %.1f mm (rms) of one line, which leaves the turn about it open: "
        "touch points in two directions, %.0f mm apart or more",
        1e3 * off_line, 1e3 * MIN_SPREAD);
    const OmQuat q = om_quat_normalize(om_quat_from_mat3(rotation_of(h)));
    frame->pose_world_frame = (OmPose){om_sub(b0, om_quat_rotate(q, a0)), q};
    frame->npoint = n;
    frame->rms = frame->max = 0;
    for (int i = 0; i < n; ++i) {
        const double off = om_distance(om_pose_apply(frame->pose_world_frame, om_load3(x_frame, i)),
                                       om_load3(x_world, i));
        frame->rms += off * off / n;
        if (off >= frame->max) frame->max = off, *worst = i;
    }
    frame->rms = sqrt(frame->rms);
    return OM_OK;
}

// ---- files ----------------------------------------------------------------------------------------------------

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
