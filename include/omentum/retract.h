/// omentum/retract.h: tissue retraction on a simulated scene (floor 11; thesis chapter 6).
///
/// A run builds the world and the twin of a scene, runs the loop of loop.h until it ends, and writes the record.
/// This is FRAS (6.5.1): grasping points by the planner's preference, no monitoring. The twin follows the measured
/// tools and estimates the forces that no sensor measures; its attachments are corrected during the run if the scene
/// says so.
///
///     OmRetractDef def = om_retract_default_def(&scene);
///     def.out_dir = "out/sheet";
///     OmRetractResult result;
///     om_retract_run(&def, NULL, &result);     // writes the report and the recording
///     om_retract_result_done(&result);
#ifndef OMENTUM_RETRACT_H
#define OMENTUM_RETRACT_H

#include "omentum/dds.h"
#include "omentum/loop.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmRetractDef {
    OmCookie cookie;
    const OmScene* scene;  // borrowed
    const char* out_dir;   // written whole (om_folder_begin); null: nothing is written
    const char* program;   // a logic program in place of the built-in one, or null
    int frame_every;       // a picture in the report every so many actions, 0 none; default 1
    // Pictures of orbit.png, an animated PNG: the end of the run in a simulated world, from a camera that goes once
    // round the endoscope in 5 s; 2 to 100, default 0: none is written
    int orbit;
    int nworker;  // default 0: one a processor
    // The plan before the operation; borrowed; default null: the planner makes the first one, too.
    const OmPreplan* preplan;
    // A person watches the loop (OmLoopDef.is_attended): called after every tick, and gives commands by
    // om_loop_command. An error ends the run. Default null.
    OmStatus (*supervise)(void* ctx, OmLoop* loop);
    void* supervise_ctx;
    struct OmViewServer* server;  // publishes the run (view_server.h); borrowed; default null
    // Send tools and the tissue's surface by OpenIGTLink on TCP, 127.0.0.1, as OmDdsRobotDef.igtl_port; default 0: not
    int igtl_port;
    // A robot over DDS in place of a simulated field; its `site` is set by the run; borrowed; default null
    const OmDdsWorldDef* robot;
    OmMotionLaw law;      // OmLoopDef.law; not with records_observations; default: straight lines
    bool has_both_arms;   // OmPlannerDef.has_both_arms; default false
    bool needs_approval;  // each plan waits for the person; default false
    // Write every acquisition to out_dir/acquisitions (om_acquisition_save); default false. The run is unchanged.
    bool records_acquisitions;
    // Write run.vtkhdf; default true. False where several threads of a program make runs: HDF5 is for one thread.
    bool has_recording;
    // Write all that the loop observes to out_dir/observations.log, for om_retract_replay; default false. Depth is then
    // rounded to 0.1 mm before the loop gets it (world_log.h).
    bool records_observations;
} OmRetractDef;

OM_API OmRetractDef om_retract_default_def(const OmScene* scene);
/// Switch on in a scene what DEFRAS does: the monitor, updates with the installed network, and OM_AHEAD_POINTS tried
/// before a new plan. What the scene says of the network and the points stays.
OM_API void om_retract_use_all(OmScene* scene);

/// Every written run has audit.jsonl (record_audit.h) and scene.yaml, the complete scene of the run. They are in
/// OUT_DIR-unfinished until the run ends, and stay there if it is killed or fails after its begin.
/// @return OM_OK, also if the ROI was not exposed: the result says how it ended. OM_INVALID (a scene that
///         cannot be run), OM_IO (output), with nothing written; OM_CANCELLED, and if the operation had begun, the
///         record so far is in out_dir, or beside it if something stands there: the message names the folder
OM_API OmStatus om_retract_run(const OmRetractDef* def, const OmProgress* progress,
                               OmRetractResult* result);

typedef struct OmRetractEstimate {  // of a run that has not begun
    int twin_nvert, twin_ntet, world_nvert, world_ntet;
    int twin_norgan, world_norgan;        // vertices of an organ that gives way; 0: it is rigid
    int twin_nattached, world_nattached;  // vertices, of the twin without nadded
    int nadded;  // vertices of the twin that were attached beside these, so that it does not slide off
    // of the model on the tissue at rest, where the scene learns; else zeros
    OmMatchVerdict registration;
    // blocks of the grid; those with a grasping point that is not above an attachment
    int nblock, ngrasp;
    double visibility;  // of the ROI before any action, 0 to 1
    bool is_settled;    // as in OmRetractResult
    bool has_slid;      //
    int nplanned;       // actions of the first plan; 0: none is found
    double begin_time;  // s to build, settle and plan
    // s of computing for one of operation, measured over OM_RETRACT_CHECK_TIME at rest
    double time_rate;
    // memory that the report's pictures take if every action of the scene is used
    double picture_bytes;
} OmRetractEstimate;
#define OM_RETRACT_CHECK_TIME 0.5  // s
/// Do what om_retract_run does before the first action, and estimate the rest. Checks that `out_dir` can be written,
/// and writes nothing. No robot is asked: the check takes place in the simulated field of the scene.
/// @return as om_retract_run; OM_OK also for a scene whose ROI is in view or that has no plan
OM_API OmStatus om_retract_check(const OmRetractDef* def, const OmProgress* progress,
                                 OmRetractEstimate* estimate);

#ifdef __cplusplus
}
#endif
#endif
