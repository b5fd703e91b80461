// robot_instrument.c: an instrument from a file of the dVRK (sawIntuitiveResearchKit, share/tool/*.json).
//
// The only file of the room that uses jansson. The files have comments, which JSON has not: blanks replace them, so
// that the lines of messages stay right. om_psm_forward has one form of wrist: a file with another one is refused.
#include <jansson.h>
#include <string.h>

#include "omentum/robot.h"

#define MAX_FILE 1000000  // bytes
#define LENGTH 0.4162     // m, of the shaft, as in robot_psm.c
#define NEAR 1e-4         // rad and m: files have four digits
#define MAX_ANGLE 7.0     // rad, of a limit
#define MAX_WRIST 0.1     // m

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

// Roll, wrist pitch and wrist yaw, in the form that om_psm_forward has.
static OmStatus read_joints(const char* name, const json_t* joints, OmPsm* psm) {
    static const char* const joint_name[3] = {"roll", "wrist pitch", "wrist yaw"};
    static const char* const fixed[4] = {"alpha", "theta", "D", "offset"};
    const double h = OM_PI / 2;
    const double expected[3][4] = {{0, 0, LENGTH, 0}, {-h, 0, 0, -h}, {-h, 0, 0, -h}};
    OM_CHECK(json_array_size(joints) == 3, OM_INVALID,
             "%s: \"joints\" has %zu joints; an instrument with a wrist has 3", name,
             json_array_size(joints));
    for (size_t k = 0; k < 3; ++k) {
        const json_t* joint = json_array_get(joints, k);
        double v = 0;
        for (int f = 0; f < 4; ++f) {
            OM_TRY(read_number(name, joint, joint_name[k], fixed[f], -10, 10, &v));
            OM_CHECK(fabs(v - expected[k][f]) <= NEAR, OM_UNAVAILABLE,
                     "%s: \"%s\" of %s is %g; only wrists with %g are supported", name, fixed[f],
                     joint_name[k], v, expected[k][f]);
        }
        OM_TRY(read_number(name, joint, joint_name[k], "A", 0, MAX_WRIST, &v));
        OM_CHECK(k == 2 || v <= NEAR, OM_UNAVAILABLE,
                 "%s: \"A\" of %s is %g; only wrists with 0 are supported", name, joint_name[k], v);
        if (k == 2) psm->wrist = v;
        OM_TRY(read_range(name, joint, joint_name[k], &psm->q_min[3 + k], &psm->q_max[3 + k]));
    }
    return OM_OK;
}

static OmStatus read_root(const char* name, const json_t* root, OmPsm* psm) {
    const json_t* dh = json_object_get(root, "DH");
    const json_t* convention = json_object_get(dh, "convention");
    OM_CHECK(dh, OM_INVALID, "%s: no \"DH\": not an instrument of the dVRK", name);
    OM_CHECK(json_is_string(convention) && strcmp(json_string_value(convention), "modified") == 0,
             OM_UNAVAILABLE, "%s: \"convention\" must be \"modified\"", name);
    OM_TRY(read_joints(name, json_object_get(dh, "joints"), psm));
    return read_range(name, json_object_get(root, "jaw"), "jaw", &psm->jaw_min, &psm->jaw_max);
}

OmStatus om_psm_parse_instrument(const char* text, size_t size, const char* name, OmPsm* psm) {
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
    OmStatus status = read_root(name, root, &made);
    json_decref(root);
    if (status == OM_OK) *psm = made;
    return status;
}

OmStatus om_psm_load_instrument(const char* path, OmPsm* psm) {
    char* text;
    size_t size;
    OM_TRY(om_file_read(path, MAX_FILE, &text, &size));
    OmStatus status = om_psm_parse_instrument(text, size, path, psm);
    om_free(text);
    return status;
}
