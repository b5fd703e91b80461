// robot_instrument.c: an instrument or an arm from a file of the dVRK (sawIntuitiveResearchKit, share/tool/*.json,
// share/arm/*.json).
//
// The only file of the room that uses jansson. The files have comments, which JSON has not: blanks replace them, so
// that the lines of messages stay right. A wrist of the usual form has lengths of its own in OmPsm and a closed
// inverse; another one is kept as the rows of the file (robot_wrist.c).
#include <jansson.h>
#include <string.h>

#include "omentum/robot.h"

#define MAX_FILE 1000000  // bytes
#define NEAR 1e-4         // rad and m: files have four digits
#define MAX_ANGLE 7.0     // rad, of a limit
#define MAX_WRIST 0.1     // m
#define LEAST_DRAWN 1e-3  // m, of a wrist
#define MIN_SHAFT 0.35    // m
#define MAX_SHAFT 0.6     // m

// Bytes of the comment at `at`, 0 if there is none.
static size_t comment_length(const char* at, const char* end) {
    const char* p = at + 2;
    if (end - at < 2 || at[0] != '/') return 0;
    if (at[1] == '/') {
        while (p < end && *p != '\n') ++p;
        return (size_t)(p - at);
    }
    if (at[1] != '*') return 0;
    while (p < end && !(p[0] == '*' && p + 1 < end && p[1] == '/')) ++p;
    return (size_t)((p < end ? p + 2 : end) - at);
}

static void blank_comments(char* text, size_t size) {
    char* end = text + size;
    bool is_string = false;
    for (char* p = text; p < end; ++p) {
        if (is_string) {
            if (*p == '\\')
                ++p;
            else if (*p == '"')
                is_string = false;
            continue;
        }
        if (*p == '"') is_string = true;
        size_t n = comment_length(p, end);
        for (size_t k = 0; k < n; ++k)
            if (p[k] != '\n') p[k] = ' ';
        if (n > 0) p += n - 1;
    }
}

static OmStatus read_number(const char* name, const json_t* object, const char* where,
                            const char* key, double lo, double hi, double* value) {
    const json_t* v = json_object_get(object, key);
    OM_CHECK(json_is_number(v), OM_INVALID, "%s: %s has no number \"%s\"", name, where, key);
    *value = json_number_value(v);
    OM_CHECK(*value >= lo && *value <= hi, OM_INVALID, "%s: \"%s\" of %s is %g, outside %g to %g",
             name, key, where, *value, lo, hi);
    return OM_OK;
}

static OmStatus read_range(const char* name, const json_t* object, const char* where, double* lo,
                           double* hi) {
    OM_TRY(read_number(name, object, where, "qmin", -MAX_ANGLE, MAX_ANGLE, lo));
    OM_TRY(read_number(name, object, where, "qmax", -MAX_ANGLE, MAX_ANGLE, hi));
    OM_CHECK(*lo < *hi, OM_INVALID, "%s: qmin of %s is not below qmax", name, where);
    return OM_OK;
}

typedef struct Form {  // of a joint; NAN: any, which is read
    const char* name;
    double alpha, theta, d, offset;
} Form;

// The numbers of a joint that om_psm_forward has built in. `offset` and `a` receive those of the file.
static OmStatus read_joint(const char* name, const json_t* joint, const Form* form, double* offset,
                           double* a) {
    static const char* const key[4] = {"alpha", "theta", "D", "offset"};
    const double expected[4] = {form->alpha, form->theta, form->d, form->offset};
    double v[4];
    for (int f = 0; f < 4; ++f) {
        OM_TRY(read_number(name, joint, form->name, key[f], -10, 10, &v[f]));
        OM_CHECK(isnan(expected[f]) || fabs(v[f] - expected[f]) <= NEAR, OM_UNAVAILABLE,
                 "%s: \"%s\" of %s is %g; only arms with %g are supported", name, key[f],
                 form->name, v[f], expected[f]);
    }
    *offset = v[3];
    return read_number(name, joint, form->name, "A", 0, MAX_WRIST, a);
}

// Three joints of an arm: their limits, the last A, and the offset that the forms leave open.
static OmStatus read_joints(const char* name, const json_t* joints, const Form form[3], int first,
                            OmPsm* psm, double* open, double* last_a) {
    OM_CHECK(json_array_size(joints) == 3, OM_UNAVAILABLE,
             "%s: \"joints\" has %zu joints; an arm has 3", name, json_array_size(joints));
    for (size_t k = 0; k < 3; ++k) {
        const json_t* joint = json_array_get(joints, k);
        double offset = 0, a = 0;
        OM_TRY(read_joint(name, joint, &form[k], &offset, &a));
        OM_CHECK(k == 2 || a <= NEAR, OM_UNAVAILABLE, "%s: \"A\" of %s is %g; only 0 is supported",
                 name, form[k].name, a);
        if (isnan(form[k].offset)) *open = offset;
        *last_a = a;
        OM_TRY(read_range(name, joint, form[k].name, &psm->q_min[(size_t)first + k],
                          &psm->q_max[(size_t)first + k]));
    }
    return OM_OK;
}

// Files have four digits: quarters of a turn are exact.
static double snap(double angle) {
    const double quarter = OM_PI / 2 * round(angle / (OM_PI / 2));
    return fabs(angle - quarter) <= NEAR ? quarter : angle;
}

static OmStatus read_row(const char* name, const json_t* joint, const char* where, OmPsmRow* row) {
    const char* type = json_string_value(json_object_get(joint, "type"));
    const char* mode = json_string_value(json_object_get(joint, "mode"));
    double offset = 0;
    OM_CHECK((!type || strcmp(type, "revolute") == 0) && (!mode || strcmp(mode, "active") == 0),
             OM_UNAVAILABLE,
             "%s: %s is %s and %s; only joints that turn and are driven are supported", name, where,
             type ? type : "revolute", mode ? mode : "active");
    OM_TRY(read_number(name, joint, where, "alpha", -MAX_ANGLE, MAX_ANGLE, &row->alpha));
    OM_TRY(read_number(name, joint, where, "A", -MAX_WRIST, MAX_WRIST, &row->a));
    OM_TRY(read_number(name, joint, where, "theta", -MAX_ANGLE, MAX_ANGLE, &row->theta));
    OM_TRY(read_number(name, joint, where, "D", -MAX_SHAFT, MAX_SHAFT, &row->d));
    OM_TRY(read_number(name, joint, where, "offset", -MAX_ANGLE, MAX_ANGLE, &offset));
    row->alpha = snap(row->alpha);
    row->theta = snap(row->theta + offset);
    return OM_OK;
}

// "tooltip_offset", four rows of four numbers: a rotation and a place.
static OmStatus read_tip(const char* name, const json_t* rows, OmPose* tip) {
    double m[4][4] = {{0}};
    for (size_t r = 0; r < 4; ++r)
        for (size_t c = 0; c < 4; ++c) {
            const json_t* v = json_array_get(json_array_get(rows, r), c);
            OM_CHECK(json_is_number(v), OM_INVALID,
                     "%s: \"tooltip_offset\" must be 4 rows of 4 numbers", name);
            m[r][c] = json_number_value(v);
        }
    const OmMat3 rot =
        om_mat3_cols(om_vec3(m[0][0], m[1][0], m[2][0]), om_vec3(m[0][1], m[1][1], m[2][1]),
                     om_vec3(m[0][2], m[1][2], m[2][2]));
    const OmMat3 square = om_mat3_mul(om_mat3_transpose(rot), rot);
    const double off = om_mat3_norm(om_mat3_add(square, om_mat3_scale(-1, om_mat3_identity())));
    const OmVec3 p = om_vec3(m[0][3], m[1][3], m[2][3]);
    OM_CHECK(off < 1e-3 && om_mat3_det(rot) > 0, OM_INVALID,
             "%s: \"tooltip_offset\" has no rotation in its first 3 columns", name);
    OM_CHECK(om_norm(p) <= MAX_WRIST, OM_INVALID, "%s: \"tooltip_offset\" is %g m away, above %g",
             name, om_norm(p), MAX_WRIST);
    *tip = (OmPose){p, om_quat_normalize(om_quat_from_mat3(rot))};
    return OM_OK;
}

static bool is_row(OmPsmRow row, double alpha, double theta) {
    return fabs(row.alpha - alpha) <= NEAR && fabs(row.theta - theta) <= NEAR &&
           fabs(row.d) <= NEAR;
}

// Roll, wrist pitch, wrist yaw and tip of the form that has a closed inverse (robot_psm.c)?
static bool is_usual(const OmPsm* psm, bool has_tip) {
    const double h = OM_PI / 2;
    const OmQuat usual =
        om_quat_from_mat3(om_mat3_cols(om_vec3(0, 0, -1), om_vec3(-1, 0, 0), om_vec3(0, 1, 0)));
    return psm->njoint == 6 && is_row(psm->row[1], -h, -h) && fabs(psm->row[1].a) <= NEAR &&
           is_row(psm->row[2], -h, -h) && psm->row[2].a >= 0 &&
           (!has_tip || (om_norm(psm->pose_last_tip.p) <= NEAR &&
                         om_quat_angle(psm->pose_last_tip.q, usual) <= NEAR));
}

// Roll and the wrist. What the form leaves at its default is that of an instrument that was never read.
static OmStatus read_wrist(const char* name, const json_t* root, const json_t* joints, OmPsm* psm) {
    static const char* const where[3] = {"roll", "wrist pitch", "wrist yaw"};
    const json_t* tip = json_object_get(root, "tooltip_offset");
    const size_t n = json_array_size(joints);
    OM_CHECK(n >= 1 && n <= 3, OM_UNAVAILABLE,
             "%s: \"joints\" has %zu joints; an instrument has roll and at most two of a wrist",
             name, n);
    for (size_t k = 0; k < 3; ++k) {
        psm->row[k] = (OmPsmRow){0};
        psm->q_min[3 + k] = psm->q_max[3 + k] = 0;
        if (k >= n) continue;
        const json_t* joint = json_array_get(joints, k);
        OM_TRY(read_row(name, joint, where[k], &psm->row[k]));
        OM_TRY(read_range(name, joint, where[k], &psm->q_min[3 + k], &psm->q_max[3 + k]));
    }
    const OmPsmRow roll = psm->row[0];
    OM_CHECK(
        fabs(roll.alpha) <= NEAR && fabs(roll.a) <= NEAR && fabs(roll.theta) <= NEAR,
        OM_UNAVAILABLE,
        "%s: roll has \"alpha\" %g, \"A\" %g and an angle of %g at zero; only a roll about the shaft, "
        "with zeros, is supported",
        name, roll.alpha, roll.a, roll.theta);
    OM_CHECK(roll.d >= MIN_SHAFT && roll.d <= MAX_SHAFT, OM_UNAVAILABLE,
             "%s: \"D\" of roll is %g m; only shafts of %g to %g m are supported", name, roll.d,
             MIN_SHAFT, MAX_SHAFT);
    psm->njoint = 3 + (int)n;
    psm->shaft = roll.d;
    psm->pose_last_tip = om_pose_identity();
    if (tip) OM_TRY(read_tip(name, tip, &psm->pose_last_tip));
    psm->has_rows = !is_usual(psm, tip != NULL);
    OM_CHECK(tip || !psm->has_rows, OM_INVALID,
             "%s: no \"tooltip_offset\", which a wrist of this form needs", name);
    psm->wrist = psm->row[2].a;
    if (psm->has_rows) {
        double size = om_norm(psm->pose_last_tip.p);
        for (size_t k = 1; k < n; ++k) size += fabs(psm->row[k].a) + fabs(psm->row[k].d);
        psm->wrist = fmax(size, LEAST_DRAWN);
        return OM_OK;
    }
    for (size_t k = 0; k < 3; ++k) psm->row[k] = (OmPsmRow){0};
    psm->pose_last_tip = om_pose_identity();
    return OM_OK;
}

// Yaw, pitch and insertion.
static OmStatus read_arm(const char* name, const json_t* joints, OmPsm* psm) {
    const double h = OM_PI / 2;
    const Form form[3] = {
        {"yaw", h, 0, 0, h}, {"pitch", -h, 0, 0, -h}, {"insertion", h, 0, 0, NAN}};
    double a = 0;
    OM_TRY(read_joints(name, joints, form, 0, psm, &psm->insertion, &a));
    OM_CHECK(a <= NEAR, OM_UNAVAILABLE, "%s: \"A\" of insertion is %g; only 0 is supported", name,
             a);
    OM_CHECK(psm->insertion <= -MIN_SHAFT && psm->insertion >= -MAX_SHAFT, OM_UNAVAILABLE,
             "%s: \"offset\" of insertion is %g m; only %g to %g m are supported", name,
             psm->insertion, -MAX_SHAFT, -MIN_SHAFT);
    return OM_OK;
}

static OmStatus read_root(const char* name, const json_t* root, bool is_arm, OmPsm* psm) {
    const json_t* dh = json_object_get(root, "DH");
    const json_t* convention = json_object_get(dh, "convention");
    OM_CHECK(dh, OM_INVALID, "%s: no \"DH\": not an instrument of the dVRK", name);
    OM_CHECK(json_is_string(convention) && strcmp(json_string_value(convention), "modified") == 0,
             OM_UNAVAILABLE, "%s: \"convention\" must be \"modified\"", name);
    const json_t* joints = json_object_get(dh, "joints");
    if (is_arm) return read_arm(name, joints, psm);
    OM_TRY(read_wrist(name, root, joints, psm));
    const json_t* jaw = json_object_get(root, "jaw");
    psm->has_jaw = jaw != NULL;
    psm->jaw_min = psm->jaw_max = 0;
    return jaw ? read_range(name, jaw, "jaw", &psm->jaw_min, &psm->jaw_max) : OM_OK;
}

static OmStatus parse(const char* text, size_t size, const char* name, bool is_arm, OmPsm* psm) {
    OM_CHECK(size <= MAX_FILE, OM_INVALID, "%s: longer than %d bytes", name, MAX_FILE);
    char* copy = om_alloc(size + 1, 1);
    if (!copy) return OM_NO_MEMORY;
    memcpy(copy, text, size);
    blank_comments(copy, size);
    json_error_t error;
    json_t* root = json_loadb(copy, size, JSON_REJECT_DUPLICATES, &error);
    om_free(copy);
    OM_CHECK(root, OM_INVALID, "%s:%d: %s", name, error.line, error.text);
    OmPsm made = *psm;
    OmStatus status = read_root(name, root, is_arm, &made);
    json_decref(root);
    if (status == OM_OK) *psm = made;
    return status;
}

OmStatus om_psm_parse_instrument(const char* text, size_t size, const char* name, OmPsm* psm) {
    return parse(text, size, name, false, psm);
}

OmStatus om_psm_parse_arm(const char* text, size_t size, const char* name, OmPsm* psm) {
    return parse(text, size, name, true, psm);
}

static OmStatus load(const char* path, bool is_arm, OmPsm* psm) {
    char* text;
    size_t size;
    OM_TRY(om_file_read(path, MAX_FILE, &text, &size));
    OmStatus status = parse(text, size, path, is_arm, psm);
    om_free(text);
    return status;
}

OmStatus om_psm_load_instrument(const char* path, OmPsm* psm) { return load(path, false, psm); }
OmStatus om_psm_load_arm(const char* path, OmPsm* psm) { return load(path, true, psm); }
