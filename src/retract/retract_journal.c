// retract_journal.c: the audit and the observations of a run while it lives.
//
// The recorder's folder appears when a run has ended, and a killed run leaves none: an audit must outlive a kill. So
// the files of the journal are written beside it, under a name that later runs do not clean.
#include "retract/retract_journal.h"

#include <errno.h>
#include <string.h>
#include <unistd.h>

#include "loop/loop_state.h"
#include "omentum/world_log.h"
#include "retract/retract_belief.h"

#define MAX_PROGRAM ((size_t)16 << 20)  // bytes

struct Journal {
    OmRecorder* recorder;  // null: a replay
    OmWorld* world;        // of the run
    OmWorld* recorded;     // around it; null: observations are not recorded
    OmAudit* audit;
    char dir[1200];  // "": nothing is written
    bool has_begun, has_ended;
    OmText scene, belief;
    char* program;  // null: the built-in one
    bool has_plan;  // made before the operation
};

// ---- texts ------------------------------------------------------------------------------------------------------

static OmStatus read_texts(const OmRetractDef* def, const Replay* replay, Journal* j) {
    size_t size;
    if (def->program) OM_TRY(om_file_read(def->program, MAX_PROGRAM, &j->program, &size));
    if (replay) return om_text_append(&j->belief, "%s", replay->belief);
    OM_TRY(om__scene_print_whole(def->scene, true, def->out_dir, &j->scene));
    return om__scene_print_whole(def->scene, false, def->out_dir, &j->belief);
}

// ---- creation ------------------------------------------------------------------------------------------------

static OmStatus save_text(const Journal* j, const char* name, const char* text) {
    char path[1300];
    OM_TRY(om_path_join(j->dir, name, path, sizeof path));
    return om_file_write(path, text, strlen(text));
}

// PLACE-unfinished, or PLACE-unfinished-2 and so on where a killed run left one.
static OmStatus make_dir(Journal* j) {
    char dir[sizeof j->dir];
    for (int k = 1; k < 1000; ++k) {
        char suffix[16] = "";
        if (k > 1) snprintf(suffix, sizeof suffix, "-%d", k);
        int n = snprintf(dir, sizeof dir, "%s-unfinished%s", j->recorder->folder.place, suffix);
        OM_CHECK(n < (int)sizeof dir, OM_INVALID, "%s: the path is too long",
                 j->recorder->folder.place);
        if (om_path_exists(dir)) continue;
        OM_TRY(om_path_make_dir(dir));
        strcpy(j->dir, dir);
        return OM_OK;
    }
    return om_error(OM_IO, "%s exists; remove the folders that killed runs left", dir);
}

static OmStatus write_begin(const OmRetractDef* def, const JournalTwin* twin, Journal* j) {
    char path[1300];
    OM_TRY(make_dir(j));
    OM_TRY(save_text(j, OM__SCENE_FILE, j->scene.str));
    OM_TRY(save_text(j, OM__BELIEF_FILE, j->belief.str));
    if (j->program) OM_TRY(save_text(j, OM__PROGRAM_FILE, j->program));
    if (def->preplan) {
        OM_TRY(om_path_join(j->dir, OM__PLAN_FILE, path, sizeof path));
        OM_TRY(om_preplan_save(def->preplan, path));
        j->has_plan = true;
    }
    if (!def->records_observations) return OM_OK;
    OM_TRY(om_path_join(j->dir, OM__SITE_FILE, path, sizeof path));
    OM_TRY(om__belief_save(twin->site, path));
    OM_TRY(om__seal_save(j->dir));
    OM_TRY(om_path_join(j->dir, OM__LOG_FILE, path, sizeof path));
    return om_world_create_recorded(j->world, path, &j->recorded);
}

OmStatus om__journal_create(const OmRetractDef* def, OmRecorder* recorder, const Replay* replay,
                            OmWorld* world, OmPlanner* planner, const JournalTwin* twin,
                            Journal** journal) {
    char path[1300];
    OmStatus status = OM_OK;
    *journal = NULL;
    Journal* j = om_calloc(1, sizeof *j);
    if (!j) return OM_NO_MEMORY;
    j->recorder = recorder;
    j->world = world;
    OM_TRY_DONE(read_texts(def, replay, j));
    OmAuditDef audit = om_audit_default_def(planner);
    if (recorder) {
        OM_TRY_DONE(write_begin(def, twin, j));
        OM_TRY_DONE(om_path_join(j->dir, OM__AUDIT_FILE, path, sizeof path));
        audit.path = path;
    }
    audit.scene_text = j->belief.str;
    if (j->program) audit.program = j->program;
    audit.network_hash = twin->network_hash;
    OM_TRY_DONE(om_audit_create(&audit, &j->audit));
    if (recorder) recorder->audit = j->audit;
    *journal = j;
    j = NULL;
done:
    om__journal_destroy(j);
    return status;
}

// The run's folder has the audit.
static bool is_in_place(const Journal* j) {
    char path[1300];
    return j->has_ended && !j->recorder->folder.path[0] &&
           om_path_join(om_recorder_place(j->recorder), OM__AUDIT_FILE, path, sizeof path) >= 0 &&
           om_path_exists(path);
}

void om__journal_destroy(Journal* j) {
    if (!j) return;
    om_audit_destroy(j->audit);
    om_world_destroy(j->recorded);
    if (j->dir[0] && (!j->has_begun || is_in_place(j))) om_path_remove(j->dir);
    om_text_done(&j->scene);
    om_text_done(&j->belief);
    om_free(j->program);
    om_free(j);
}

OmWorld* om__journal_world(const Journal* j) { return j->recorded ? j->recorded : j->world; }

const char* om__journal_text(const Journal* j) { return om_audit_text(j->audit); }

// ---- begin and end -------------------------------------------------------------------------------------------

static OmStatus on_begin(void* ctx, const OmLoop* loop) {
    (void)loop;
    ((Journal*)ctx)->has_begun = true;
    return OM_OK;
}

// A second name in the recorder's folder: the first one goes when the folder is in its place.
static OmStatus add_name(const Journal* j, const char* name) {
    char from[1300], to[1300];
    OM_TRY(om_path_join(j->dir, name, from, sizeof from));
    OM_TRY(om_path_join(j->recorder->folder.path, name, to, sizeof to));
    bool is_good = link(from, to) == 0 || rename(from, to) == 0;
    OM_CHECK(is_good, OM_IO, "%s cannot be moved: %s", from, strerror(errno));
    return OM_OK;
}

// The audit is complete. The recorder, which is called next, puts its folder into its place.
static OmStatus on_end(void* ctx, const OmLoop* loop, const OmRetractResult* result) {
    (void)loop, (void)result;
    Journal* j = ctx;
    if (!j->recorder) return OM_OK;
    if (j->recorded) {
        OM_TRY(om_world_log_end(j->recorded));
        OM_TRY(add_name(j, OM__LOG_FILE));
        OM_TRY(add_name(j, OM__SITE_FILE));
        OM_TRY(add_name(j, OM__SEAL_FILE));
    }
    OM_TRY(add_name(j, OM__AUDIT_FILE));
    OM_TRY(add_name(j, OM__SCENE_FILE));
    OM_TRY(add_name(j, OM__BELIEF_FILE));
    if (j->program) OM_TRY(add_name(j, OM__PROGRAM_FILE));
    if (j->has_plan) OM_TRY(add_name(j, OM__PLAN_FILE));
    j->has_ended = true;
    return OM_OK;
}

int om__journal_listeners(Journal* j, OmLoopListener listener[2]) {
    listener[0] = om_audit_listener(j->audit);
    listener[1] = (OmLoopListener){.ctx = j, .on_begin = on_begin, .on_end = on_end};
    return 2;
}
