// base_json.c: a streaming JSON writer; two blanks an indent level, short arrays of numbers on one line.
#include <math.h>
#include <string.h>

#include "omentum/base.h"

OmJson om_json_begin(OmText* text) {
    OmJson json = {.text = text, .status = OM_OK, .depth = 0};
    json.is_first[0] = true;
    return json;
}

static void put(OmJson* json, const char* str, size_t len) {
    if (json->status == OM_OK) json->status = om_text_append_raw(json->text, str, len);
}

static void put_escaped(OmJson* json, const char* str) {
    if (json->status == OM_OK) json->status = om_text_append_quoted(json->text, str);
}

static void begin_value(OmJson* json, const char* key) {
    if (json->depth > 0) {
        put(json, json->is_first[json->depth] ? "\n" : ",\n", json->is_first[json->depth] ? 1 : 2);
        for (int i = 0; i < json->depth; ++i) put(json, "  ", 2);
    }
    json->is_first[json->depth] = false;
    if (key) {
        put_escaped(json, key);
        put(json, ": ", 2);
    }
}

void om_json_open(OmJson* json, const char* key, char bracket) {
    begin_value(json, key);
    put(json, &bracket, 1);
    OM_ASSERT(json->depth < 31);
    json->is_first[++json->depth] = true;
}

void om_json_close(OmJson* json, char bracket) {
    OM_ASSERT(json->depth > 0);
    bool is_empty = json->is_first[json->depth--];
    if (!is_empty) {
        put(json, "\n", 1);
        for (int i = 0; i < json->depth; ++i) put(json, "  ", 2);
    }
    put(json, &bracket, 1);
}

void om_json_string(OmJson* json, const char* key, const char* value) {
    begin_value(json, key);
    put_escaped(json, value ? value : "");
}

static void put_number(OmJson* json, double value) {
    char number[40];
    if (isfinite(value))
        snprintf(number, sizeof number, "%.9g", value);
    else
        snprintf(number, sizeof number, "null");
    put(json, number, strlen(number));
}

void om_json_number(OmJson* json, const char* key, double value) {
    begin_value(json, key);
    put_number(json, value);
}

void om_json_integer(OmJson* json, const char* key, int64_t value) {
    begin_value(json, key);
    char number[32];
    snprintf(number, sizeof number, "%lld", (long long)value);
    put(json, number, strlen(number));
}

void om_json_bool(OmJson* json, const char* key, bool value) {
    begin_value(json, key);
    put(json, value ? "true" : "false", value ? 4 : 5);
}

void om_json_numbers(OmJson* json, const char* key, const double* value, int count) {
    begin_value(json, key);
    put(json, "[", 1);
    for (int i = 0; i < count; ++i) {
        if (i > 0) put(json, ", ", 2);
        put_number(json, value[i]);
    }
    put(json, "]", 1);
}

OmStatus om_json_end(OmJson* json) {
    put(json, "\n", 1);
    OM_ASSERT(json->depth == 0);
    return json->status;
}

OmStatus om_json_save(OmJson* json, const char* path) {
    OmStatus status = om_json_end(json);
    if (status == OM_OK) status = om_file_write(path, json->text->str, json->text->len);
    om_text_done(json->text);
    return status;
}
