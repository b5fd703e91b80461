// view_hand.c: lines of a page, by a table of words and of what follows each.
#include "omentum/view_hand.h"

#include <math.h>
#include <string.h>

#include "omentum/tissue_material.h"

typedef enum Rest { NOTHING, POINT, NUMBER, NAME } Rest;  // what follows a word

static const struct {
    const char* word;
    Rest rest;
    double min, max;  // of a number
} verb[OM_HAND_NVERB] = {
    [OM_HAND_GRASP] = {"grasp", POINT},
    [OM_HAND_PRESS] = {"press", POINT},
    [OM_HAND_MOVE] = {"move", POINT},
    [OM_HAND_RELEASE] = {"release", NOTHING},
    [OM_HAND_PAUSE] = {"pause", NOTHING},
    [OM_HAND_GO] = {"go", NOTHING},
    [OM_HAND_STEP] = {"step", NOTHING},
    [OM_HAND_RESET] = {"reset", NOTHING},
    [OM_HAND_YOUNG] = {"young", NUMBER, 0.1, 10},
    [OM_HAND_POISSON] = {"poisson", NUMBER, 0, OM_MAX_POISSON},
    [OM_HAND_PROBE] = {"probe", NUMBER, OM_HAND_MIN_RADIUS, OM_HAND_MAX_RADIUS},
    [OM_HAND_LAW] = {"law", NAME},
    [OM_HAND_ELEMENT] = {"element", NAME},
    [OM_HAND_ENGINE] = {"engine", NAME},
};

const char* om_hand_verb_text(OmHandVerb v) {
    return (int)v >= 0 && v < OM_HAND_NVERB ? verb[v].word : NULL;
}

static void skip_blanks(const char** at) { *at += strspn(*at, " "); }

// The next number, or NAN.
static double read_number(const char** at) {
    double value;
    skip_blanks(at);
    return om_number_parse(at, *at + strlen(*at), &value) ? value : (double)NAN;
}

static OmStatus read_rest(const char* at, OmHandLine* line) {
    const char* word = verb[line->verb].word;
    const double min = verb[line->verb].min, max = verb[line->verb].max;
    skip_blanks(&at);
    switch (verb[line->verb].rest) {
    case POINT:
        line->at.x = read_number(&at);
        line->at.y = read_number(&at);
        line->at.z = read_number(&at);
        OM_CHECK(om_norm(line->at) < OM_HAND_REACH, OM_INVALID,
                 "%s needs a point: three numbers in m, such as %s 0 0.01 0.005", word, word);
        break;
    case NUMBER:
        line->value = read_number(&at);
        OM_CHECK(line->value >= min && line->value <= max, OM_INVALID,
                 "%s needs a number from %g to %g", word, min, max);
        break;
    case NAME: {
        const size_t n = strcspn(at, " ");
        OM_CHECK(n > 0 && n < OM_HAND_NAME, OM_INVALID, "%s needs a name", word);
        memcpy(line->name, at, n);
        at += n;
        break;
    }
    default: break;
    }
    skip_blanks(&at);
    OM_CHECK(*at == 0, OM_INVALID, "\"%.40s\" is too much behind %s", at, word);
    return OM_OK;
}

OmStatus om_hand_line_parse(const char* text, OmHandLine* line) {
    *line = (OmHandLine){0};
    skip_blanks(&text);
    const size_t n = strcspn(text, " ");
    for (int v = 0; v < OM_HAND_NVERB; ++v) {
        if (strlen(verb[v].word) != n || memcmp(verb[v].word, text, n) != 0) continue;
        line->verb = (OmHandVerb)v;
        return read_rest(text + n, line);
    }
    return om_error(
        OM_INVALID,
        "\"%.40s\" is no command here; say grasp, press, move, release, pause, go, step, reset, young, "
        "poisson, probe, law, element or engine",
        text);
}
