// trial_preplan_file.c: the plan file, JSON. The only file of the room that uses jansson.
//
// Written by OmJson with nine digits a number, read by jansson. Every field is checked against its range, so that a
// plan that was read can be followed without further checks.
#include <jansson.h>
#include <string.h>

#include "omentum/trial_preplan.h"

#define KIND "omentum plan before an operation"
#define MAX_SIZE ((size_t)1 << 22)

static const char* const fold_word[OM_PLAN_NVERB] = {
    [OM_PLAN_PULL] = "none", [OM_PLAN_MOVE_ROI] = "move_ROI", [OM_PLAN_MOVE_AWAY] = "move_away"};

// ---- writing ------------------------------------------------------------------------------------------------

static void write_point(OmJson* j, const OmPreplanPoint* p, int n) {
    om_json_open(j, NULL, '{');
    om_json_integer(j, "ix", p->block % n + 1);
    om_json_integer(j, "iy", p->block / n + 1);
    om_json_integer(j, "arm", p->arm + 1);
    om_json_string(j, "verdict", om_preplan_verdict_word(p->verdict));
    if (p->is_tried) {
        om_json_bool(j, "exposes", p->exposes);
        om_json_integer(j, "pulls", p->npull);
        om_json_string(j, "fold", fold_word[p->fold]);
        om_json_number(j, "visibility", p->visibility);
        om_json_number(j, "force_n", p->force);
        om_json_integer(j, "actions", p->naction);
        om_json_integer(j, "steps", p->nstep);
    }
    om_json_close(j, '}');
}

OmStatus om_preplan_save(const OmPreplan* plan, const char* path) {
    OmText text = {0};
    OmJson j = om_json_begin(&text);
    om_json_open(&j, NULL, '{');
    om_json_string(&j, "kind", KIND);
    om_json_string(&j, "scene", plan->scene);
    om_json_integer(&j, "seed", plan->seed);
    om_json_integer(&j, "grid", plan->n);
    om_json_number(&j, "visibility", plan->visibility);
    om_json_number(&j, "force_limit_n", plan->force_limit);
    om_json_integer(&j, "chosen", plan->chosen);
    om_json_bool(&j, "exposes", plan->is_exposing);
    om_json_string(&j, "reason", plan->reason);
    om_json_open(&j, "points", '[');
    for (int b = 0; b < plan->n * plan->n; ++b) write_point(&j, &plan->point[b], plan->n);
    om_json_close(&j, ']');
    om_json_close(&j, '}');
    return om_json_save(&j, path);
}

// ---- reading ------------------------------------------------------------------------------------------------

typedef struct Reader {
    const char* name;  // of the file
    int point;         // being read, from 1; 0: none
} Reader;

static OmStatus wrong(const Reader* r, const char* key, const char* want) {
    if (r->point > 0)
        return om_error(OM_INVALID, "%s: point %d: \"%s\": %s is needed", r->name, r->point, key,
                        want);
    return om_error(OM_INVALID, "%s: \"%s\": %s is needed", r->name, key, want);
}

static OmStatus read_int(const Reader* r, const json_t* o, const char* key, int min, int max,
                         int* value) {
    char want[64];
    const json_t* v = json_object_get(o, key);
    snprintf(want, sizeof want, "an integer from %d to %d", min, max);
    if (!json_is_integer(v) || json_integer_value(v) < min || json_integer_value(v) > max)
        return wrong(r, key, want);
    *value = (int)json_integer_value(v);
    return OM_OK;
}

static OmStatus read_number(const Reader* r, const json_t* o, const char* key, double min,
                            double max, double* value) {
    char want[64];
    const json_t* v = json_object_get(o, key);
    snprintf(want, sizeof want, "a number from %g to %g", min, max);
    if (!json_is_number(v)) return wrong(r, key, want);
    double x = json_number_value(v);
    if (!(x >= min && x <= max)) return wrong(r, key, want);
    *value = x;
    return OM_OK;
}

static OmStatus read_bool(const Reader* r, const json_t* o, const char* key, bool* value) {
    const json_t* v = json_object_get(o, key);
    if (!json_is_boolean(v)) return wrong(r, key, "true or false");
    *value = json_is_true(v);
    return OM_OK;
}

static OmStatus read_text(const Reader* r, const json_t* o, const char* key, char* text,
                          size_t size) {
    const json_t* v = json_object_get(o, key);
    if (!json_is_string(v) || json_string_length(v) >= size ||
        !om_text_is_plain(json_string_value(v), json_string_length(v), ""))
        return wrong(r, key, "a text");
    memcpy(text, json_string_value(v), json_string_length(v) + 1);
    return OM_OK;
}

static OmStatus read_word(const Reader* r, const json_t* o, const char* key,
                          const char* const* word, int count, int* index) {
    const json_t* v = json_object_get(o, key);
    for (*index = 0; json_is_string(v) && *index < count; ++*index)
        if (word[*index] && strcmp(word[*index], json_string_value(v)) == 0) return OM_OK;
    return wrong(r, key, "one of the words of a plan file");
}

static OmStatus read_point(const Reader* r, const json_t* o, int n, OmPreplanPoint* p) {
    const char* word[OM_PREPLAN_NVERDICT];
    int ix, iy, arm, index;
    for (int k = 0; k < OM_PREPLAN_NVERDICT; ++k)
        word[k] = om_preplan_verdict_word((OmPreplanVerdict)k);
    *p = (OmPreplanPoint){.block = r->point - 1, .fold = OM_PLAN_PULL};
    OM_TRY(read_int(r, o, "ix", 1, n, &ix));
    OM_TRY(read_int(r, o, "iy", 1, n, &iy));
    if ((iy - 1) * n + ix - 1 != p->block) return wrong(r, "ix", "the order of the grid");
    OM_TRY(read_int(r, o, "arm", 0, OM_MAX_ARM, &arm));
    p->arm = arm - 1;
    OM_TRY(read_word(r, o, "verdict", word, OM_PREPLAN_NVERDICT, &index));
    p->verdict = (OmPreplanVerdict)index;
    p->is_tried = p->verdict <= OM_PREPLAN_FORCE_LIMIT;
    if (!p->is_tried) return OM_OK;
    if (arm == 0) return wrong(r, "arm", "an arm");
    OM_TRY(read_bool(r, o, "exposes", &p->exposes));
    OM_TRY(read_int(r, o, "pulls", 1, OM_PLAN_MAX_HORIZON, &p->npull));
    OM_TRY(read_word(r, o, "fold", fold_word, OM_PLAN_NVERB, &index));
    p->fold = (OmPlanVerb)index;
    OM_TRY(read_number(r, o, "visibility", 0, 1, &p->visibility));
    OM_TRY(read_number(r, o, "force_n", -1, 1e6, &p->force));
    OM_TRY(read_int(r, o, "actions", 3, 10000, &p->naction));
    return read_int(r, o, "steps", 0, 1 << 30, &p->nstep);
}

// The chosen point is the one with this verdict, and the only one.
static OmStatus check_choice(const Reader* r, const OmPreplan* plan) {
    for (int b = 0; b < plan->n * plan->n; ++b) {
        bool is_chosen = plan->point[b].verdict == OM_PREPLAN_CHOSEN;
        if (is_chosen != (b == plan->chosen))
            return wrong(r, "chosen", "the point with this verdict");
    }
    bool exposes = plan->chosen >= 0 && plan->point[plan->chosen].exposes;
    if (exposes != plan->is_exposing) return wrong(r, "exposes", "the value of the chosen point");
    return OM_OK;
}

static OmStatus read_plan(Reader* r, const json_t* root, OmPreplan* plan) {
    char kind[64];
    OM_TRY(read_text(r, root, "kind", kind, sizeof kind));
    if (strcmp(kind, KIND) != 0) return wrong(r, "kind", "\"" KIND "\"");
    OM_TRY(read_text(r, root, "scene", plan->scene, sizeof plan->scene));
    OM_TRY(read_int(r, root, "seed", 0, 2147483647, &plan->seed));
    OM_TRY(read_int(r, root, "grid", 1, OM_PLAN_MAX_GRID, &plan->n));
    OM_TRY(read_number(r, root, "visibility", 0, 1, &plan->visibility));
    OM_TRY(read_number(r, root, "force_limit_n", -1, 1e6, &plan->force_limit));
    OM_TRY(read_int(r, root, "chosen", -1, plan->n * plan->n - 1, &plan->chosen));
    OM_TRY(read_bool(r, root, "exposes", &plan->is_exposing));
    OM_TRY(read_text(r, root, "reason", plan->reason, sizeof plan->reason));
    const json_t* points = json_object_get(root, "points");
    if (!json_is_array(points) || json_array_size(points) != (size_t)(plan->n * plan->n))
        return wrong(r, "points", "a list of a point for every block");
    for (int b = 0; b < plan->n * plan->n; ++b) {
        r->point = b + 1;
        OM_TRY(read_point(r, json_array_get(points, (size_t)b), plan->n, &plan->point[b]));
        plan->ntried += plan->point[b].is_tried;
        plan->nexposing += plan->point[b].exposes;
        plan->nstep += plan->point[b].nstep;
    }
    r->point = 0;
    return check_choice(r, plan);
}

OmStatus om_preplan_parse(const char* text, size_t size, const char* name, OmPreplan* plan) {
    json_error_t error;
    json_t* root = json_loadb(text, size, JSON_REJECT_DUPLICATES, &error);
    if (!root && json_error_code(&error) == json_error_out_of_memory)
        return om_error(OM_NO_MEMORY, "out of memory for %s", name);
    OM_CHECK(root, OM_INVALID, "%s: line %d: not JSON: %s", name, error.line, error.text);
    Reader reader = {.name = name};
    OmPreplan read = {0};
    OmStatus status = read_plan(&reader, root, &read);
    json_decref(root);
    if (status == OM_OK) *plan = read;
    return status;
}

OmStatus om_preplan_load(const char* path, OmPreplan* plan) {
    char* text;
    size_t size;
    OM_TRY(om_file_read(path, MAX_SIZE, &text, &size));
    OmStatus status = om_preplan_parse(text, size, path, plan);
    om_free(text);
    return status;
}
