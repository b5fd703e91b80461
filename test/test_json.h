// test_json.h: a small reader of written JSON, apart from what wrote it: values by key, in the order of the file.
#ifndef OMENTUM_TEST_JSON_H
#define OMENTUM_TEST_JSON_H

#include "test_common.h"

typedef struct Json {
    const char* text;
    size_t at;
} Json;

/// The value of the next "key"; `json` moves on to it. Fails where there is none.
static inline const char* json_value(Json* json, const char* key) {
    char quoted[80];
    snprintf(quoted, sizeof quoted, "\"%s\": ", key);
    const char* from = json->text + json->at;
    const char* found = strstr(from, quoted);
    if (!found) fail_msg("no key %s from here on: %.60s", key, from);
    json->at += (size_t)(found - from) + strlen(quoted);
    return json->text + json->at;
}

static inline double json_number(Json* json, const char* key) {
    const char* text = json_value(json, key);
    char* end;
    double value = strtod(text, &end);
    if (end == text) fail_msg("%s is not a number: %.30s", key, text);
    return value;
}

static inline bool json_bool(Json* json, const char* key) {
    const char* text = json_value(json, key);
    bool is_true = strncmp(text, "true", 4) == 0;
    if (!is_true && strncmp(text, "false", 5) != 0) fail_msg("%s: %.30s", key, text);
    return is_true;
}

/// Fails unless the next "key" is the string `wanted`.
static inline void json_is(Json* json, const char* key, const char* wanted) {
    const char* text = json_value(json, key);
    size_t n = strlen(wanted);
    if (*text != '"' || strncmp(text + 1, wanted, n) != 0 || text[1 + n] != '"')
        fail_msg("%s is %.60s, not \"%s\"", key, text, wanted);
}

#endif
