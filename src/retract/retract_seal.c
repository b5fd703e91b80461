// retract_seal.c: hashes of the files that a recorded run was made of: a replay notices a file that was changed.
//
// The replay decides from belief, program and plan, never from scene.yaml, which holds the truth. A person who changes
// scene.yaml and replays expects other decisions, so its bytes are compared, too; a folder without it still replays.
#include <string.h>

#include "omentum/scene_yaml.h"
#include "retract/retract_journal.h"

#define FORMAT 1
#define MAX_FILE ((size_t)4 << 30)  // bytes, as the site's
enum { NFILE = 5, DIGITS = 17 };

static const char* const file_name[NFILE] = {OM__SCENE_FILE, OM__BELIEF_FILE, OM__SITE_FILE,
                                             OM__PROGRAM_FILE, OM__PLAN_FILE};

typedef struct Seal {
    int format;
    char hash[NFILE][DIGITS];  // "": the run had no such file
} Seal;

#define SEAL_FIELD(name, i) \
    { name, OM_YAML_STRING, offsetof(Seal, hash) + (size_t)(i)*DIGITS, .size = DIGITS }
static const OmYamlField seal_field[] = {
    {"format", OM_YAML_INT, offsetof(Seal, format), FORMAT, FORMAT, .is_required = true},
    SEAL_FIELD(OM__SCENE_FILE, 0),
    SEAL_FIELD(OM__BELIEF_FILE, 1),
    SEAL_FIELD(OM__SITE_FILE, 2),
    SEAL_FIELD(OM__PROGRAM_FILE, 3),
    SEAL_FIELD(OM__PLAN_FILE, 4),
};
static const OmYamlSchema seal_schema = {"hashes", seal_field, NFILE + 1};

// "" if there is no such file.
static OmStatus hash_file(const char* dir, const char* name, char hash[DIGITS]) {
    char path[1300], *data;
    size_t size;
    hash[0] = '\0';
    OM_TRY(om_path_join(dir, name, path, sizeof path));
    if (!om_path_exists(path)) return OM_OK;
    OM_TRY(om_file_read(path, MAX_FILE, &data, &size));
    snprintf(hash, DIGITS, "%016llx", (unsigned long long)om_hash(data, size, OM_HASH_SEED));
    om_free(data);
    return OM_OK;
}

OmStatus om__seal_save(const char* dir) {
    char path[1300], hash[DIGITS];
    OmText text = {0};
    OmJson json = om_json_begin(&text);
    OmStatus status;
    om_json_open(&json, NULL, '{');
    om_json_integer(&json, "format", FORMAT);
    for (int i = 0; i < NFILE; ++i) {
        OM_TRY_DONE(hash_file(dir, file_name[i], hash));
        if (hash[0]) om_json_string(&json, file_name[i], hash);
    }
    om_json_close(&json, '}');
    OM_TRY_DONE(om_json_end(&json));
    OM_TRY_DONE(om_path_join(dir, OM__SEAL_FILE, path, sizeof path));
    status = om_file_write(path, text.str, text.len);
done:
    om_text_done(&text);
    return status;
}

OmStatus om__seal_check(const char* dir, bool* is_stated) {
    char path[1300], now[DIGITS];
    Seal seal = {0};
    OM_TRY(om_path_join(dir, OM__SEAL_FILE, path, sizeof path));
    *is_stated = om_path_exists(path);
    if (!*is_stated) return OM_OK;
    OM_TRY(om_yaml_load(path, &seal_schema, &seal));
    for (int i = 0; i < NFILE; ++i) {
        const bool may_be_gone = i == 0;
        OM_TRY(hash_file(dir, file_name[i], now));
        if (strcmp(now, seal.hash[i]) == 0 || (may_be_gone && !now[0])) continue;
        return om_error(
            OM_INVALID,
            "%s/%s was changed since the run was recorded (hash %s, now %s): a replay decides from the "
            "record alone; put the recorded file back, or run a changed scene anew by omentum retract "
            "%s/%s --record -o DIR",
            dir, file_name[i], seal.hash[i][0] ? seal.hash[i] : "none", now[0] ? now : "none", dir,
            OM__SCENE_FILE);
    }
    return OM_OK;
}
