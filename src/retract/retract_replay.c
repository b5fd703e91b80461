// retract_replay.c: a recorded run decided again, and the two audits compared.
//
// The head of the audit has the rules of the run, its other lines the commands of persons and the ticks of adopted
// estimates. record_audit.c writes these lines: each key stands in its line once, and text cannot imitate
// a key, since quotation marks inside of strings are escaped.
#include "omentum/retract_replay.h"

#include <stdlib.h>
#include <string.h>

#include "retract/retract_journal.h"

#define REPLAY_COOKIE 0x02e91a4
#define MAX_SCENE ((size_t)16 << 20)  // bytes

OmReplayDef om_replay_default_def(const char* dir) {
    return (OmReplayDef){.cookie = REPLAY_COOKIE, .dir = dir};
}

void om_replay_result_done(OmReplayResult* result) {
    if (!result) return;
    om_free(result->was);
    om_free(result->now);
    memset(result, 0, sizeof *result);
}

// ---- lines of an audit ---------------------------------------------------------------------------------------

// A line without its end; it points into the text.
typedef struct Line {
    const char* at;
    size_t len;
} Line;

static bool next_line(const char** text, Line* line) {
    if (!**text) return false;
    line->at = *text;
    line->len = strcspn(*text, "\n");
    *text += line->len + (line->at[line->len] == '\n');
    return true;
}

// The value behind a key, or null.
static const char* find_value(Line line, const char* key) {
    char mark[64];
    const int n = snprintf(mark, sizeof mark, "\"%s\": ", key);
    for (const char* p = line.at; p + n <= line.at + line.len; ++p) {
        if (*p == mark[0] && memcmp(p, mark, (size_t)n) == 0) return p + n;
    }
    return NULL;
}

static bool has_text(Line line, const char* key, const char* value) {
    const char* at = find_value(line, key);
    const size_t n = strlen(value);
    return at && at[0] == '"' && strncmp(at + 1, value, n) == 0 && at[1 + n] == '"';
}

static OmStatus get_number(Line line, const char* key, double* value) {
    const char* at = find_value(line, key);
    OM_CHECK(at && om_number_parse(&at, line.at + line.len, value), OM_INVALID,
             "the audit has a line without \"%s\"", key);
    return OM_OK;
}

static OmStatus get_int(Line line, const char* key, int* value) {
    int64_t v = 0;
    const char* at = find_value(line, key);
    OM_CHECK(at && om_integer_parse(&at, line.at + line.len, &v) && v >= 0 && v <= INT32_MAX,
             OM_INVALID, "the audit has a line without \"%s\"", key);
    *value = (int)v;
    return OM_OK;
}

// ---- what the replay needs -----------------------------------------------------------------------------------

static OmStatus read_head(Line line, Replay* r, int* grid) {
    int format;
    OM_CHECK(has_text(line, "event", "head"), OM_INVALID, "the audit does not begin with its head");
    OM_TRY(get_int(line, "format", &format));
    OM_CHECK(format == 1, OM_INVALID, "the audit has format %d; this program reads 1", format);
    OM_TRY(get_int(line, "grid", grid));
    OM_CHECK(*grid >= 1 && *grid <= OM_PLAN_MAX_GRID, OM_INVALID, "the audit's grid is %d", *grid);
    OM_TRY(get_number(line, "max_age_s", &r->max_age));
    const char* settled = find_value(line, "settled");
    const char* attended = find_value(line, "attended");
    const char* approval = find_value(line, "approval");
    const char* both = find_value(line, "both_arms");
    r->has_both_arms = both && both[0] == 't';
    r->is_settled = settled && settled[0] == 't';
    r->is_attended = attended && attended[0] == 't';
    r->needs_approval = approval && approval[0] == 't';
    r->is_ready_timed = has_text(line, "updates", "ready");
    return OM_OK;
}

static OmStatus read_block(Line line, int n, int* block) {
    const char* at = find_value(line, "block");
    const char* end = line.at + line.len;
    int64_t x = 0, y = 0;
    bool is_good = at && *at++ == '[' && om_integer_parse(&at, end, &x) && end - at > 2 &&
                   strncmp(at, ", ", 2) == 0;
    if (is_good) at += 2;
    is_good = is_good && om_integer_parse(&at, end, &y) && x >= 1 && x <= n && y >= 1 && y <= n;
    OM_CHECK(is_good, OM_INVALID, "the audit has a command without its block");
    *block = (int)((y - 1) * n + x - 1);
    return OM_OK;
}

static OmStatus read_command(Line line, int grid, ReplayCommand* out) {
    OM_TRY(get_int(line, "tick", &out->tick));
    OmLoopCommand* c = &out->command;
    *c = (OmLoopCommand){.kind = OM_LOOP_NCOMMAND, .block = -1};
    for (int k = 0; k < OM_LOOP_NCOMMAND; ++k)
        if (has_text(line, "command", om_loop_command_text((OmLoopCommandKind)k)))
            c->kind = (OmLoopCommandKind)k;
    OM_CHECK(c->kind != OM_LOOP_NCOMMAND, OM_INVALID, "the audit has an unknown command");
    if (find_value(line, "block")) OM_TRY(read_block(line, grid, &c->block));
    const char* value = find_value(line, "value");
    if (c->kind != OM_LOOP_SLOW) return OM_OK;
    bool is_good =
        value && *value++ == '"' && om_number_parse(&value, line.at + line.len, &c->value);
    OM_CHECK(is_good, OM_INVALID, "the audit has a command without its value");
    return OM_OK;
}

// The tick at which an estimate was adopted or refused.
static OmStatus read_update(Line line, Replay* r, int most) {
    int index;
    if (!has_text(line, "stage", "adopted") && !has_text(line, "stage", "refused")) return OM_OK;
    OM_TRY(get_int(line, "index", &index));
    OM_CHECK(index < most, OM_INVALID, "the audit has an estimate %d", index);
    if (index < r->nestimate) return OM_OK;
    for (; r->nestimate <= index; ++r->nestimate) r->end_tick[r->nestimate] = -1;
    return get_int(line, "tick", &r->end_tick[index]);
}

static int count_events(const char* text, const char* event) {
    int num = 0;
    for (Line line; next_line(&text, &line);) num += has_text(line, "event", event);
    return num;
}

static OmStatus read_audit(const char* text, Replay* r) {
    Line line;
    int grid;
    const int nupdate = count_events(text, "update"), ncommand = count_events(text, "command");
    OM_CHECK(next_line(&text, &line), OM_INVALID, "the audit is empty");
    OM_TRY(read_head(line, r, &grid));
    OM_ALLOC(r->end_tick, (size_t)nupdate + 1);
    OM_ALLOC(r->command, (size_t)ncommand + 1);
    while (next_line(&text, &line)) {
        OM_CHECK(!has_text(line, "hold", "late"), OM_INVALID,
                 "the run held because it was behind real time: the wall clock is not recorded, so "
                 "a replay cannot do the same");
        if (has_text(line, "event", "command"))
            OM_TRY(read_command(line, grid, &r->command[r->ncommand++]));
        else if (has_text(line, "event", "update"))
            OM_TRY(read_update(line, r, nupdate));
    }
    return OM_OK;
}

// ---- the comparison ------------------------------------------------------------------------------------------

static OmStatus copy_line(Line line, char** out) {
    OM_ALLOC(*out, line.len + 1);
    memcpy(*out, line.at, line.len);
    (*out)[line.len] = '\0';
    return OM_OK;
}

static OmStatus compare(const char* was, const Replay* r, OmReplayResult* result) {
    const char* now = r->audit.str ? r->audit.str : "";
    Line a, b;
    result->ndecision = count_events(was, "plan");
    for (int line = 1;; ++line) {
        bool has_a = next_line(&was, &a), has_b = next_line(&now, &b);
        if (!has_a && !has_b) break;
        if (has_a) ++result->nline;
        if (result->line || (has_a && has_b && a.len == b.len && memcmp(a.at, b.at, a.len) == 0))
            continue;
        result->line = line;
        OM_TRY(copy_line(has_a ? a : (Line){"", 0}, &result->was));
        OM_TRY(copy_line(has_b ? b : (Line){"", 0}, &result->now));
    }
    result->is_same = result->line == 0 && !r->failure[0];
    return OM_OK;
}

static void print_reason(const char* dir, const Replay* r, OmReplayResult* result) {
    char* out = result->reason;
    const size_t size = sizeof result->reason;
    if (result->is_same)
        snprintf(
            out, size,
            "%.400s: decided again from its observations: all %d lines are the same, %d plans in %.1f s",
            dir, result->nline, result->ndecision, result->time);
    else if (r->failure[0])
        snprintf(out, size, "%.300s: the replay ended early, after line %d of the audit: %.500s",
                 dir, result->line - 1, r->failure);
    else
        snprintf(out, size, "%.400s: line %d of the audit differs", dir, result->line);
}

// ---- the replay ----------------------------------------------------------------------------------------------

typedef struct Files {  // of the run
    char log[1200], program[1200], plan[1200], site[1200];
    char *audit, *belief;
    bool has_program, has_plan, is_sealed;
    OmPreplan preplan;
} Files;

static OmStatus read_files(const char* dir, Files* f) {
    char path[1200];
    size_t size;
    OM_TRY(om_path_join(dir, OM__LOG_FILE, f->log, sizeof f->log));
    OM_CHECK(om_path_exists(f->log), OM_INVALID,
             "%s has no %s; record a run by omentum retract --record", dir, OM__LOG_FILE);
    OM_TRY(om__seal_check(dir, &f->is_sealed));
    OM_TRY(om_path_join(dir, OM__PROGRAM_FILE, f->program, sizeof f->program));
    f->has_program = om_path_exists(f->program);
    OM_TRY(om_path_join(dir, OM__PLAN_FILE, f->plan, sizeof f->plan));
    f->has_plan = om_path_exists(f->plan);
    if (f->has_plan) OM_TRY(om_preplan_load(f->plan, &f->preplan));
    OM_TRY(om_path_join(dir, OM__AUDIT_FILE, path, sizeof path));
    OM_TRY(om_file_read(path, OM__MAX_AUDIT, &f->audit, &size));
    OM_CHECK(strlen(f->audit) == size, OM_INVALID, "%s holds a zero byte", path);
    OM_TRY(om_path_join(dir, OM__SITE_FILE, f->site, sizeof f->site));
    OM_TRY(om_path_join(dir, OM__BELIEF_FILE, path, sizeof path));
    return om_file_read(path, MAX_SCENE, &f->belief, &size);
}

static OmStatus replay_files(const OmReplayDef* def, const Files* f, OmScene* scene, Replay* r,
                             const OmProgress* progress, OmReplayResult* result) {
    OmRetractResult run;
    OmStatus status = read_audit(f->audit, r);
    if (status < 0) return om_error_prefix(status, "%s", def->dir);
    OM_TRY(om_scene_parse(f->belief, strlen(f->belief), OM__BELIEF_FILE, scene));
    if (def->engines) scene->engines = def->engines;
    r->belief = f->belief;
    r->site = f->site;
    r->log = f->log;
    OmRetractDef again = om_retract_default_def(scene);
    again.program = f->has_program ? f->program : NULL;
    again.preplan = f->has_plan ? &f->preplan : NULL;
    again.nworker = def->nworker;
    status = om__retract_run(&again, r, progress, &run);
    // A replay that departs from the log fails with OM_IO: the audit so far says where.
    if (status < 0 && (status != OM_IO || !r->audit.len)) return status;
    result->time = status < 0 ? 0 : run.time;
    om_retract_result_done(&run);
    if (def->path && r->audit.str) OM_TRY(om_file_write(def->path, r->audit.str, r->audit.len));
    OM_TRY(compare(f->audit, r, result));
    print_reason(def->dir, r, result);
    if (!f->is_sealed)
        snprintf(result->note, sizeof result->note,
                 "the record has no " OM__SEAL_FILE
                 ", as older versions made it: whether " OM__SCENE_FILE
                 " was changed since is not known");
    return OM_OK;
}

OmStatus om_retract_replay(const OmReplayDef* def, const OmProgress* progress,
                           OmReplayResult* result) {
    memset(result, 0, sizeof *result);
    OM_CHECK(def->cookie == REPLAY_COOKIE, OM_INVALID, "OmReplayDef was not made by default_def");
    OM_CHECK(def->dir, OM_INVALID, "OmReplayDef.dir is null");
    Files* files = NULL;
    Replay replay = {.belief = NULL};
    OmScene* scene = NULL;
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(scene, 1);
    OM_CALLOC_DONE(files, 1);
    OM_TRY_DONE(read_files(def->dir, files));
    OM_TRY_DONE(replay_files(def, files, scene, &replay, progress, result));
done:
    om_text_done(&replay.audit);
    om_free(replay.end_tick);
    om_free(replay.command);
    if (files) {
        om_free(files->audit);
        om_free(files->belief);
    }
    om_free(files);
    om_free(scene);
    if (status < 0) om_replay_result_done(result);
    return status;
}
