/// omentum/belief_update.h: attachments of the twin corrected while the loop runs (floor 7; thesis 4.3, 6.4.6).
///
/// After an action that moved held tissue the loop takes an acquisition: a scan of the tissue, the tools at the grasp
/// and now, and the twin's positions. One job in the background estimates the attachments from the last acquisitions.
/// An accepted estimate is adopted by the twin without a jump, and the loop makes a new plan where it changes the
/// blocks that may be grasped. At the end
/// of a lift an acquisition is taken as evidence for a fold. A refused estimate leaves the twin unchanged.
///
///     OmMatch* match;                                       // om_match_create; used by the job alone from now on
///     OmUpdateDef def = om_update_default_def(&scene, world, &twin_site);
///     def.estimate = om_update_estimate_by_match;
///     def.estimate_ctx = match;
///     OmUpdater* updater;
///     om_updater_create(&def, &updater);
///     loop_def.updater = updater;                           // OmLoopDef of loop.h
///     ... tick the loop to its end, destroy it ...
///     om_updater_destroy(updater);
#ifndef OMENTUM_BELIEF_UPDATE_H
#define OMENTUM_BELIEF_UPDATE_H

#include "omentum/banet_update.h"
#include "omentum/match.h"
#include "omentum/scene.h"
#include "omentum/world.h"
#include "omentum/world_cloud.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Estimate the attachments from acquisitions. Called in a thread of its own, one call at a time; the acquisitions do
/// not change meanwhile. `estimate` is zero at first; om_match_estimate_done frees it, also after an error.
/// @return OM_OK (the estimate says whether it is accepted); any other status but OM_NO_MEMORY counts as a refusal,
///         with the error message as its reason
typedef OmStatus (*OmEstimateFn)(void* ctx, int nacquisition, const OmAcquisition* acquisition,
                                 const OmProgress* progress, OmMatchEstimate* estimate);
/// om_match_update_with, an OmEstimateFn, with the attachments of the newest acquisition as present ones. `ctx` is an
/// OmMatch of the twin's site.
/// @return as om_match_update
OM_API OmStatus om_update_estimate_by_match(void* ctx, int nacquisition,
                                            const OmAcquisition* acquisition,
                                            const OmProgress* progress, OmMatchEstimate* estimate);

/// om_banet_update, an OmEstimateFn. `ctx` is an OmBanetUpdater of the twin's site.
/// @return as om_banet_update
OM_API OmStatus om_update_estimate_by_banet(void* ctx, int nacquisition,
                                            const OmAcquisition* acquisition,
                                            const OmProgress* progress, OmMatchEstimate* estimate);

typedef enum OmUpdateTiming {  // the tick in which the twin adopts an estimate
    // A fixed time after the estimate was started. The loop waits in this tick for an estimate that takes longer, so
    // that a run repeats to the byte at any speed of the machine.
    OM_UPDATE_AFTER_LATENCY,
    OM_UPDATE_WHEN_READY,  // the first tick after the estimate is complete
    OM_UPDATE_REPLAYED     // the ticks of a record, OmUpdateDef.replay_tick
} OmUpdateTiming;

typedef struct OmUpdateDef {
    OmCookie cookie;
    OmScanDef scan;          // how the tissue is found in pictures
    OmCloudDef space;        // and where it can be; its site is borrowed
    OmSceneUpdate settings;  // latency, number of acquisitions, smallest lift, rest
    // Default null: acquisitions are taken, for listeners, and nothing is estimated. The arms do not wait then, and the
    // newest picture is taken, which may be from before the end of the action.
    OmEstimateFn estimate;
    void* estimate_ctx;  // borrowed by the job
    // Default OM_UPDATE_AFTER_LATENCY in a world that waits or has snapshots, otherwise OM_UPDATE_WHEN_READY.
    OmUpdateTiming timing;
    // OmRetractUpdate.end_tick of each estimate of the recorded run, below 0: never taken; copied  (nreplay)
    const int* replay_tick;
    int nreplay;
} OmUpdateDef;

/// @param site  of the twin; borrowed
OM_API OmUpdateDef om_update_default_def(const OmScene* scene, const OmWorld* world,
                                         const OmSite* site);

/// The acquisitions of one loop and its job. One loop at a time may use it.
typedef struct OmUpdater OmUpdater;
/// @return OM_OK; OM_INVALID (a field); OM_NO_MEMORY
OM_API OmStatus om_updater_create(const OmUpdateDef* def, OmUpdater** updater);
/// After the loop. A job that still runs is cancelled and joined.
OM_API void om_updater_destroy(OmUpdater* updater);

typedef enum OmUpdateStage {
    OM_UPDATE_TAKEN,      // an acquisition was taken
    OM_UPDATE_STARTED,    // an estimate was started
    OM_UPDATE_ADOPTED,    // the twin begins to adopt an estimate
    OM_UPDATE_REFUSED,    // the attachments are kept
    OM_UPDATE_CANCELLED,  // the loop ended before the tick of adoption
    // No plan was left: the twin frees what was not attached in every belief of the operation, or, if that gives no
    // new point after a warning, the first belief, at last everything that no person has marked
    OM_UPDATE_DOUBTED
} OmUpdateStage;
/// One word, as run.json has it: "taken", "started", "adopted", "refused", "cancelled" or "doubted".
OM_API const char* om_update_stage_text(OmUpdateStage stage);

typedef struct OmUpdateEvent {  // for OmLoopListener.on_update; pointers are valid during the call
    OmUpdateStage stage;
    int index;  // of the acquisition if it was taken, otherwise of the estimate; both count from 0
    int tick;   // of the loop
    double time;                       // s of the operation
    const OmAcquisition* acquisition;  // taken; otherwise null
    int nacquisition;  // that the estimate is made from; 0 if an acquisition was taken
    // adopted, or refused with a result; of doubt the number of vertices and `attached`; otherwise null
    const OmMatchEstimate* estimate;
    const char* reason;  // of a refusal; what is doubted; otherwise ""
    // attachments of the twin before an adoption or a doubt; otherwise null  (nvert)
    const unsigned char* was_attached;
} OmUpdateEvent;

#ifdef __cplusplus
}
#endif
#endif
