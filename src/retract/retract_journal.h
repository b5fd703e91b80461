// retract_journal.h: what a run writes while it lives, and what a replay takes from it.
#ifndef OMENTUM_RETRACT_JOURNAL_H
#define OMENTUM_RETRACT_JOURNAL_H

#include "omentum/record_audit.h"
#include "omentum/retract.h"
#include "record/record_internal.h"

#define OM__AUDIT_FILE "audit.jsonl"
#define OM__LOG_FILE "observations.log"
#define OM__SCENE_FILE "scene.yaml"    // complete, to run it again
#define OM__BELIEF_FILE "belief.yaml"  // without the truth
#define OM__SITE_FILE "belief.h5"      // the twin's site, of a run with observations
#define OM__PROGRAM_FILE "program.lp"  // only of a run with a program of its own
#define OM__PLAN_FILE "plan.json"      // only of a run with a plan before the operation
#define OM__SEAL_FILE "hashes.json"    // of the files above, of a run with observations
#define OM__MAX_AUDIT ((size_t)256 << 20)

// A command of the recorded run.
typedef struct ReplayCommand {
    int tick;
    OmLoopCommand command;
} ReplayCommand;

// What a replay takes from the audit of the recorded run, and what it leaves.
typedef struct Replay {
    const char* belief;  // text of OM__BELIEF_FILE
    const char* site;    // path of OM__SITE_FILE
    const char* log;     // path of the observations
    bool is_settled, is_attended, needs_approval, has_both_arms;
    double max_age;          // s
    bool is_ready_timed;     // estimates were adopted when they were ready, at `end_tick`
    int nestimate;           //
    int* end_tick;           // of each estimate, -1: none  (nestimate)
    int ncommand;            //
    ReplayCommand* command;  // in their order  (ncommand)
    OmText audit;            // all lines of the replay
    char failure[1024];      // why it ended early; "": it did not
} Replay;

typedef struct Journal Journal;

typedef struct JournalTwin {
    const OmSite* site;
    uint64_t network_hash;  // 0: none
} JournalTwin;

// The audit of a run, and its observations if `def` says so. A run writes them into PLACE-unfinished, beside its
// folder; at its end they go into the recorder's folder. A replay keeps the audit in memory.
// `recorder` is null for a replay, `replay` for a run. All are borrowed.
OmStatus om__journal_create(const OmRetractDef* def, OmRecorder* recorder, const Replay* replay,
                            OmWorld* world, OmPlanner* planner, const JournalTwin* twin,
                            Journal** journal);
// A run that has not begun leaves nothing.
void om__journal_destroy(Journal* journal);
OmWorld* om__journal_world(const Journal* journal);  // that the loop is to use
const char* om__journal_text(const Journal* journal);
// Listeners, to be called before the recorder. @return their number, at most 2
int om__journal_listeners(Journal* journal, OmLoopListener listener[2]);

// retract_seal.c: write OM__SEAL_FILE of the files that are in `dir`; compare them with it. A missing OM__SCENE_FILE is
// no change. @return OM_OK; OM_INVALID (a file was changed, added or removed: named); OM_IO; OM_NO_MEMORY
OmStatus om__seal_save(const char* dir);
OmStatus om__seal_check(const char* dir, bool* is_stated);

// retract.c: om_retract_run; with a replay, on its observations and without a truth.
OmStatus om__retract_run(const OmRetractDef* def, Replay* replay, const OmProgress* progress,
                         OmRetractResult* result);

#endif
