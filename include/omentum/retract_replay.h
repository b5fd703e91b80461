/// omentum/retract_replay.h: decide again from what a run recorded, and compare (floor 11).
///
/// A run with OmRetractDef.records_observations leaves its audit, its observations and the belief of the robot in its
/// folder. A replay builds twin, planner and updater from the belief, and feeds the loop with the observations alone:
/// there is no world, and no file that it decides from holds the truth. Commands of persons come from the audit. The
/// replay's audit must equal the run's, byte for byte. hashes.json of the folder has the hashes of scene.yaml and of
/// the files that the replay reads: none of them may have changed.
///
///     OmReplayDef def = om_replay_default_def("out/run");
///     OmReplayResult result;
///     om_retract_replay(&def, NULL, &result);
///     puts(result.reason);
///     om_replay_result_done(&result);
#ifndef OMENTUM_RETRACT_REPLAY_H
#define OMENTUM_RETRACT_REPLAY_H

#include "omentum/retract.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmReplayDef {
    OmCookie cookie;
    const char* dir;   // of the run
    const char* path;  // the replay's audit is written there; null (default): not written
    const struct OmEngineSet* engines;  // that the scene may name; null (default): those of OmScene
    int nworker;                        // default 0: one a processor
} OmReplayDef;

OM_API OmReplayDef om_replay_default_def(const char* dir);

typedef struct OmReplayResult {  // om_replay_result_done frees
    bool is_same;
    int nline;          // lines of the run's audit
    int ndecision;      // plans among them
    double time;        // s of the operation that was replayed
    int line;           // the first line that differs, counted from 1; 0: none
    char* was;          // this line in the run; "" behind its end
    char* now;          // in the replay
    char reason[1024];  // one sentence: the outcome
    char note[256];  // what could not be checked, because an older version made the record; else ""
} OmReplayResult;
OM_API void om_replay_result_done(OmReplayResult* result);

/// @return OM_OK, also if a decision differs; OM_INVALID (no recorded run in `dir`, a damaged log, a file that was
///         changed since, or a run that held because it was behind real time: the wall clock is not recorded); OM_IO;
///         OM_NO_MEMORY; OM_CANCELLED
OM_API OmStatus om_retract_replay(const OmReplayDef* def, const OmProgress* progress,
                                  OmReplayResult* result);

#ifdef __cplusplus
}
#endif
#endif
