/// omentum/record.h: a listener of the loop that writes its record (floor 10).
///
/// A folder with report.html, run.json, run.vtkhdf and frames. It is written under a temporary name and appears when
/// the loop has ended. The recording shows the truth, or the twin in a world without one.
///
///     OmRecorderDef def = om_recorder_default_def("out/run", &scene, world, twin, planner);
///     OmRecorder* recorder;
///     om_recorder_create(&def, &recorder);
///     OmLoopListener listener = om_recorder_listener(recorder);   // for OmLoopDef.listener
///     ...                                                         // tick the loop to its end
///     om_recorder_destroy(recorder);                              // without an end nothing is left
#ifndef OMENTUM_RECORD_H
#define OMENTUM_RECORD_H

#include "omentum/loop.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmRecorderDef {
    OmCookie cookie;
    const char* out_dir;   // written whole (om_folder_begin); copied
    const OmScene* scene;  // borrowed, as all below
    OmWorld* world;        //
    OmBody* twin;          //
    OmPlanner* planner;    // explains the plans
    OmBody* truth;         // default null: none
    int frame_every;       // a picture every so many actions, 0 none; default 1
    int orbit;             // pictures of orbit.png, see OmRetractDef; default 0: none is written
    // write the acquisitions of the loop's updater to out_dir/acquisitions; default false
    bool records_acquisitions;
    bool has_recording;  // write run.vtkhdf; default true; false where several threads record runs
} OmRecorderDef;

OM_API OmRecorderDef om_recorder_default_def(const char* out_dir, const OmScene* scene,
                                             OmWorld* world, OmBody* twin, OmPlanner* planner);

typedef struct OmRecorder OmRecorder;
/// @return OM_OK; OM_INVALID (a field); OM_IO; OM_NO_MEMORY
OM_API OmStatus om_recorder_create(const OmRecorderDef* def, OmRecorder** recorder);
/// Removes the temporary folder of a loop that has not ended.
OM_API void om_recorder_destroy(OmRecorder* recorder);
/// The record of a loop that was aborted or cancelled does not replace a folder in its place; it gets a name beside it.
/// @return the functions of the recorder; `ctx` is borrowed until the recorder is destroyed
OM_API OmLoopListener om_recorder_listener(OmRecorder* recorder);
/// The folder of the record, once the loop has ended; valid until the recorder is destroyed.
OM_API const char* om_recorder_place(const OmRecorder* recorder);

#ifdef __cplusplus
}
#endif
#endif
