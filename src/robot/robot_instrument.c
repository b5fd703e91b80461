// robot_instrument.c: an instrument or an arm from a file of the dVRK (sawIntuitiveResearchKit, share/tool/*.json,
// share/arm/*.json).
//
// The only file of the room that uses jansson. The files have comments, which JSON has not: blanks replace them, so
// that the lines of messages stay right. om_psm_forward has one form of wrist: a file with another one is refused.
#include <jansson.h>
#include <string.h>

#include "omentum/robot.h"

#define MAX_FILE 1000000  // bytes
#define NEAR 1e-4         // rad and m: files have four digits
#define MAX_ANGLE 7.0     // rad, of a limit
#define MAX_WRIST 0.1     // m
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

// The numbers of a joint that om_psm_forward has built in. `d`, `offset` and `a` receive those of the file.
static OmStatus read_joint(const char* name, const json_t* joint, const Form* form, double* d,
                           double* offset, double* a) {
    static const char* const key[4] = {"alpha", "theta", "D", "offset"};
    const double expected[4] = {form->alpha, form->theta, form->d, form->offset};
    double v[4];
    for (int f = 0; f < 4; ++f) {
        OM_TRY(read_number(name, joint, form->name, key[f], -10, 10, &v[f]));
        OM_CHECK(isnan(expected[f]) || fabs(v[f] - expected[f]) <= NEAR, OM_UNAVAILABLE,
                 "%s: \"%s\" of %s is %g; only wrists and arms with %g are supported", name, key[f],
                 form->name, v[f], expected[f]);
    }
    *d = v[2];
    *offset = v[3];
    return read_number(name, joint, form->name, "A", 0, MAX_WRIST, a);
}

// Three joints from `first` on: their limits, the last A, and what the forms leave open, D or offset.
static OmStatus read_joints(const char* name, const json_t* joints, const Form form[3], int first,
                            OmPsm* psm, double* open, double* last_a) {
    OM_CHECK(json_array_size(joints) == 3, OM_UNAVAILABLE,
             "%s: \"joints\" has %zu joints; an arm has 3, and so has an instrument with a wrist",
             name, json_array_size(joints));
    for (size_t k = 0; k < 3; ++k) {
        const json_t* joint = json_array_get(joints, k);
        double d = 0, offset = 0, a = 0;
        OM_TRY(read_joint(name, joint, &form[k], &d, &offset, &a));
        OM_CHECK(k == 2 || a <= NEAR, OM_UNAVAILABLE, "%s: \"A\" of %s is %g; only 0 is supported",
                 name, form[k].name, a);
        if (isnan(form[k].d)) *open = d;
        if (isnan(form[k].offset)) *open = offset;
        *last_a = a;
        OM_TRY(read_range(name, joint, form[k].name, &psm->q_min[(size_t)first + k],
                          &psm->q_max[(size_t)first + k]));
    }
    return OM_OK;
}

// Roll, wrist pitch and wrist yaw.
static OmStatus read_wrist(const char* name, const json_t* joints, OmPsm* psm) {
    const double h = OM_PI / 2;
    const Form form[3] = {
        {"roll", 0, 0, NAN, 0}, {"wrist pitch", -h, 0, 0, -h}, {"wrist yaw", -h, 0, 0, -h}};
    OM_TRY(read_joints(name, joints, form, 3, psm, &psm->shaft, &psm->wrist));
    OM_CHECK(psm->shaft >= MIN_SHAFT && psm->shaft <= MAX_SHAFT, OM_UNAVAILABLE,
             "%s: \"D\" of roll is %g m; only shafts of %g to %g m are supported", name, psm->shaft,
             MIN_SHAFT, MAX_SHAFT);
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
    OM_TRY(read_wrist(name, joints, psm));
    return read_range(name, json_object_get(root, "jaw"), "jaw", &psm->jaw_min, &psm->jaw_max);
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
