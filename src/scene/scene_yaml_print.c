// scene_yaml_print.c: print a struct as YAML, and a schema as a table of keys, from the fields that
// the reader uses.
#include <float.h>
#include <stdlib.h>
#include <string.h>

#include "omentum/scene_yaml.h"

#define COMMENT_COLUMN 34
#define NUMBER_LEN 40

static const void* at(const OmYamlField* f, const void* value) {
    return (const char*)value + f->offset;
}

static double scale_of(const OmYamlField* f) { return f->scale != 0.0 ? f->scale : 1.0; }

static bool has_range(const OmYamlField* f) { return f->min != 0.0 || f->max != 0.0; }

bool om_yaml_is_equal(const OmYamlField* f, const void* a, const void* b) {
    const void *p = at(f, a), *q = at(f, b);
    switch (f->kind) {
    case OM_YAML_DOUBLE: return *(const double*)p == *(const double*)q;
    case OM_YAML_INT:
    case OM_YAML_ENUM: return *(const int*)p == *(const int*)q;
    case OM_YAML_BOOL: return *(const bool*)p == *(const bool*)q;
    case OM_YAML_STRING: return strncmp(p, q, f->size) == 0;
    case OM_YAML_VEC3: {
        OmVec3 d = om_sub(*(const OmVec3*)p, *(const OmVec3*)q);
        return d.x == 0 && d.y == 0 && d.z == 0;
    }
    case OM_YAML_NUMBERS:
        for (int i = 0; i < f->capacity; ++i)
            if (((const double*)p)[i] != ((const double*)q)[i]) return false;
        return true;
    case OM_YAML_STRUCT:
        for (int i = 0; i < f->sub->nfield; ++i)
            if (!om_yaml_is_equal(&f->sub->field[i], p, q)) return false;
        return true;
    case OM_YAML_LIST: break;
    }
    const char *m = (const char*)a + f->count_offset, *n = (const char*)b + f->count_offset;
    int count = *(const int*)m;
    if (count != *(const int*)n) return false;
    for (int k = 0; k < count; ++k) {
        size_t item = (size_t)k * f->size;
        for (int i = 0; i < f->sub->nfield; ++i)
            if (!om_yaml_is_equal(&f->sub->field[i], (const char*)p + item, (const char*)q + item))
                return false;
    }
    return true;
}

// ---- values ------------------------------------------------------------------------------------------------

// The shortest text that the reader converts to exactly these bits: text times scale.
static void print_number(double si, double scale, char* out) {
    double v = si / scale, near[3] = {v, nextafter(v, -DBL_MAX), nextafter(v, DBL_MAX)};
    for (int k = 0; k < 3; ++k) {
        for (int digits = 1; digits <= 17; ++digits) {
            snprintf(out, NUMBER_LEN, "%.*g", digits, near[k]);
            bool is_plain = !strchr(out, 'e') || fabs(v) >= 1e7 || fabs(v) < 1e-4;
            if (is_plain && strtod(out, NULL) * scale == si) return;
        }
    }
}

static bool is_given(const OmYamlField* f, const void* value) {
    if (f->kind == OM_YAML_ENUM) return *(const int*)at(f, value) >= 0;
    if (f->kind != OM_YAML_DOUBLE || !has_range(f)) return true;
    double si = *(const double*)at(f, value), tiny = 1e-12 * fabs(si);
    return si >= f->min * scale_of(f) - tiny && si <= f->max * scale_of(f) + tiny;
}

// Always quoted, so that no text is read as a number or a keyword.
static OmStatus print_string(const char* str, OmText* text) {
    OM_TRY(om_text_append(text, "\""));
    for (const char* c = str; *c; ++c) {
        if (*c == '"' || *c == '\\')
            OM_TRY(om_text_append(text, "\\%c", *c));
        else if ((unsigned char)*c < 0x20 || *c == 0x7f)
            OM_TRY(om_text_append(text, "\\x%02x", (unsigned char)*c));
        else
            OM_TRY(om_text_append(text, "%c", *c));
    }
    return om_text_append(text, "\"");
}

static OmStatus print_numbers(const OmYamlField* f, const double* value, OmText* text) {
    char number[NUMBER_LEN];
    for (int i = 0; i < f->capacity; ++i) {
        print_number(value[i], scale_of(f), number);
        OM_TRY(om_text_append(text, "%s%s", i ? ", " : "[", number));
    }
    return om_text_append(text, "]");
}

static OmStatus print_value(const OmYamlField* f, const void* value, OmText* text) {
    char number[3][NUMBER_LEN];
    const void* p = at(f, value);
    switch (f->kind) {
    case OM_YAML_DOUBLE:
        print_number(*(const double*)p, scale_of(f), number[0]);
        return om_text_append(text, "%s", number[0]);
    case OM_YAML_INT: return om_text_append(text, "%d", *(const int*)p);
    case OM_YAML_BOOL: return om_text_append(text, "%s", *(const bool*)p ? "true" : "false");
    case OM_YAML_STRING: return print_string(p, text);
    case OM_YAML_ENUM: return om_text_append(text, "%s", f->name[*(const int*)p]);
    case OM_YAML_VEC3: {
        OmVec3 v = *(const OmVec3*)p;
        print_number(v.x, scale_of(f), number[0]);
        print_number(v.y, scale_of(f), number[1]);
        print_number(v.z, scale_of(f), number[2]);
        return om_text_append(text, "[%s, %s, %s]", number[0], number[1], number[2]);
    }
    case OM_YAML_NUMBERS: return print_numbers(f, p, text);
    default: return om_error(OM_INVALID, "%s: lists are not printed", f->key);
    }
}

// ---- YAML --------------------------------------------------------------------------------------------------

static OmStatus print_range(const OmYamlField* f, OmText* text) {
    if (f->kind == OM_YAML_ENUM) {
        for (int i = 0; f->name[i]; ++i)
            OM_TRY(om_text_append(text, "%s%s", i ? ", " : "", f->name[i]));
        return OM_OK;
    }
    bool is_number = f->kind == OM_YAML_DOUBLE || f->kind == OM_YAML_INT ||
                     f->kind == OM_YAML_VEC3 || f->kind == OM_YAML_NUMBERS;
    if (!is_number || !has_range(f)) return OM_OK;
    char min[NUMBER_LEN], max[NUMBER_LEN];
    print_number(f->min, 1, min);
    print_number(f->max, 1, max);
    return om_text_append(text, "%s to %s", min, max);
}

// Comment after a value, from a fixed column on: meaning; unit; range.
static OmStatus print_comment(const OmYamlField* f, size_t line, OmText* text) {
    if (!f->help) return OM_OK;
    int blank = COMMENT_COLUMN - (int)(text->len - line);
    OM_TRY(om_text_append(text, "%*s# %s", blank > 1 ? blank : 1, "", f->help));
    if (f->unit) OM_TRY(om_text_append(text, "; %s", f->unit));
    size_t before = text->len;
    OM_TRY(om_text_append(text, f->unit ? ", " : "; "));
    size_t separator = text->len;
    OM_TRY(print_range(f, text));
    if (text->len == separator) {  // there is none
        text->len = before;
        text->str[before] = 0;
    }
    return OM_OK;
}

static OmStatus print_fields(const OmYamlSchema* schema, const void* value,
                             const OmYamlPrint* options, bool is_off, int depth, OmText* text) {
    for (int i = 0; i < schema->nfield; ++i) {
        const OmYamlField* f = &schema->field[i];
        bool is_left_out = is_off || (f->group && options->group && !(f->group & options->group));
        if (is_left_out && !options->shows_others) continue;
        if (!is_given(f, value) && !options->is_commented) continue;
        size_t line = text->len;
        bool is_comment = is_left_out || !is_given(f, value);
        OM_TRY(om_text_append(text, "%s%*s%s:", is_comment ? "# " : "", 2 * depth, "", f->key));
        if (f->kind != OM_YAML_STRUCT && is_given(f, value)) {
            OM_TRY(om_text_append(text, " "));
            OM_TRY(print_value(f, value, text));
        }
        if (options->is_commented) OM_TRY(print_comment(f, line, text));
        OM_TRY(om_text_append(text, "\n"));
        if (f->kind == OM_YAML_STRUCT)
            OM_TRY(print_fields(f->sub, at(f, value), options, is_left_out, depth + 1, text));
    }
    return OM_OK;
}

OmStatus om_yaml_print(const OmYamlSchema* schema, const void* value, const OmYamlPrint* options,
                       OmText* text) {
    return print_fields(schema, value, options, false, 0, text);
}

// ---- the page ----------------------------------------------------------------------------------------------

static const char* kind_text(const OmYamlField* f) {
    switch (f->kind) {
    case OM_YAML_DOUBLE: return "number";
    case OM_YAML_INT: return "whole number";
    case OM_YAML_BOOL: return "true, false";
    case OM_YAML_STRING: return "text";
    case OM_YAML_VEC3: return "[x, y, z]";
    case OM_YAML_NUMBERS: return "list of numbers";
    case OM_YAML_ENUM: return "one of";
    default: return "list";
    }
}

static OmStatus print_groups(const OmYamlField* f, const char* const* group, OmText* text) {
    if (f->group == 0) return om_text_append(text, "all");
    bool is_first = true;
    for (int i = 0; group[i]; ++i) {
        if (!(f->group & (1u << i))) continue;
        OM_TRY(om_text_append(text, "%s%s", is_first ? "" : ", ", group[i]));
        is_first = false;
    }
    return OM_OK;
}

static OmStatus print_default(const OmYamlField* f, const void* plain, OmText* text) {
    if (f->is_required) return om_text_append(text, "required");
    if (!is_given(f, plain)) return om_text_append(text, "not given");
    if (f->kind == OM_YAML_STRING && !((const char*)at(f, plain))[0])
        return om_text_append(text, "none");
    return print_value(f, plain, text);
}

OmStatus om_yaml_print_keys(const OmYamlSchema* schema, const void* plain, const char* const* group,
                            OmText* text) {
    OM_TRY(om_text_append(text, "| key | value | unit | range | default | %smeaning |\n",
                          group ? "sources | " : ""));
    OM_TRY(om_text_append(text, "|---|---|---|---|---|---|%s\n", group ? "---|" : ""));
    for (int i = 0; i < schema->nfield; ++i) {
        const OmYamlField* f = &schema->field[i];
        if (f->kind == OM_YAML_STRUCT) continue;
        OM_TRY(om_text_append(text, "| `%s` | %s | %s | ", f->key, kind_text(f),
                              f->unit ? f->unit : ""));
        OM_TRY(print_range(f, text));
        OM_TRY(om_text_append(text, " | "));
        OM_TRY(print_default(f, plain, text));
        OM_TRY(om_text_append(text, " | "));
        if (group) {
            OM_TRY(print_groups(f, group, text));
            OM_TRY(om_text_append(text, " | "));
        }
        OM_TRY(om_text_append(text, "%s |\n", f->help ? f->help : ""));
    }
    return OM_OK;
}
