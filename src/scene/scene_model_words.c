// scene_model_words.c: attachments in words, as in the command line and in scene files.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "omentum/scene_model.h"

static OmStatus parse_number(const char* what, const char* text, double* value) {
    char* end;
    *value = strtod(text, &end);
    OM_CHECK(end != text && *end == 0 && isfinite(*value), OM_INVALID,
             "attachment: %s \"%s\" is not a number", what, text);
    return OM_OK;
}

static OmStatus copy_word(const char* what, const char* word, size_t len, char* to, size_t size) {
    OM_CHECK(len < size, OM_INVALID, "attachment: %s \"%.*s\" is too long", what, (int)len, word);
    memcpy(to, word, len);
    to[len] = 0;
    return OM_OK;
}

// WHERE [SHARE%] [seed N]
static OmStatus parse_where(char* words, OmAttachDef* a) {
    double value;
    char* rest;
    char* word = strtok_r(words, " ", &rest);
    OM_CHECK(word, OM_INVALID, "attachment: nothing follows the colon; say where, or leave it out");
    OM_TRY(copy_word("place", word, strlen(word), a->direction, sizeof a->direction));
    for (char* c = a->direction; *c; ++c) *c = *c == '/' ? ',' : *c;
    while ((word = strtok_r(NULL, " ", &rest)) != NULL) {
        if (strcmp(word, "%") == 0) continue;
        if (strcmp(word, "seed") == 0) {
            word = strtok_r(NULL, " ", &rest);
            OM_CHECK(word, OM_INVALID, "attachment: seed needs a number");
            OM_TRY(parse_number("seed", word, &value));
            OM_CHECK(value >= 0 && value == floor(value) && value < 1e15, OM_INVALID,
                     "attachment: seed %g is not a whole number", value);
            a->seed = (uint64_t)value;
            continue;
        }
        size_t len = strlen(word);
        if (len > 1 && word[len - 1] == '%') word[len - 1] = 0;
        OM_TRY(parse_number("share", word, &value));
        OM_CHECK(value > 0 && value <= 100, OM_INVALID,
                 "attachment: share %g %% is not above 0 and at most 100", value);
        a->share = value / 100;
    }
    return OM_OK;
}

OmStatus om_model_parse_attach(const char* text, OmAttachDef* a) {
    static const char* const face[] = {"border", "underside", "top"};
    char words[128];
    *a = (OmAttachDef){.share = 1.0, .seed = 1};
    OM_TRY(copy_word("text", text, strlen(text), words, sizeof words));
    char* where = strchr(words, ':');
    if (where) *where++ = 0;
    bool is_known = false;
    for (int i = 0; i < 3; ++i) is_known = is_known || strcmp(words, face[i]) == 0;
    const char* near = om_nearest_word(words, face, 3);
    OM_CHECK(is_known, OM_INVALID,
             "attachment: \"%s\" is no face%s%s%s; use border, underside or top", words,
             near ? ", did you mean \"" : "", near ? near : "", near ? "\"?" : "");
    OM_TRY(copy_word("face", words, strlen(words), a->face, sizeof a->face));
    return where ? parse_where(where, a) : OM_OK;
}
