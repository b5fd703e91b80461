/// omentum/defras.h: tissue retraction on a simulated scene (floor 7; thesis chapter 6).
///
/// A run builds the world and the twin of a scene, runs the loop of defras_loop.h until it ends, and writes the record.
/// This is FRAS (6.5.1): grasping points by the planner's preference, no monitoring. The twin follows the measured
/// tools and estimates the forces that no sensor measures; its attachments are corrected during the run if the scene
/// says so.
///
///     OmRetractDef def = om_retract_default_def(&scene);
///     def.out_dir = "out/sheet";
///     OmRetractResult result;
///     om_retract_run(&def, NULL, &result);     // writes the report and the recording
///     om_retract_result_done(&result);
#ifndef OMENTUM_DEFRAS_H
#define OMENTUM_DEFRAS_H

#include "omentum/defras_loop.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_AHEAD_POINTS 3  // grasping points tried in the twin before a new plan

typedef struct OmRetractDef {
    OmCookie cookie;
    const OmScene* scene;  // borrowed
    const char* out_dir;   // written whole (om_folder_begin); null: nothing is written
    const char* program;   // a logic program in place of the built-in one, or null
    int frame_every;       // a picture in the report every so many actions, 0 none; default 1
    int nworker;           // default 0: one a processor
    // The plan before the operation; borrowed; default null: the planner makes the first one, too.
    const OmPreplan* preplan;
    // A person watches the loop (OmLoopDef.is_attended): called after every tick, and gives commands by
    // om_loop_command. An error ends the run. Default null.
    OmStatus (*supervise)(void* ctx, OmLoop* loop);
    void* supervise_ctx;
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
/// Switch on in a scene all that the loop can do: the monitor, updates with the installed network, learning of the
/// modulus by shape where the twin's engine has one, and OM_AHEAD_POINTS tried before a new plan. What the scene says
/// of the network and the points stays.
/// @return OM_OK; OM_INVALID (the scene's engine is unknown)
OM_API OmStatus om_retract_use_all(OmScene* scene);

/// Every written run has audit.jsonl (defras_audit.h) and scene.yaml, the complete scene of the run. They are in
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
/// and writes nothing.
/// @return as om_retract_run; OM_OK also for a scene whose ROI is in view or that has no plan
OM_API OmStatus om_retract_check(const OmRetractDef* def, const OmProgress* progress,
                                 OmRetractEstimate* estimate);

/// The force threshold of a scene (6.5.1): every grasping point of `nlayout` layouts (seeds 1, 2, ...) is
/// grasped by the twin, pulled to the height limit and, while the ROI is hidden, folded both ways, measured
/// forces ignored; epsilon is twice the median of the largest pull of each grasp. A fifth of the grasps is
/// repeated on the simulated truth: the margin is the 95 % quantile of how much more than the twin it bears while
/// the twin is between half the threshold and the threshold. A motion ends at twice the scene's threshold.
typedef struct OmForceCalibration {
    int nrun;                                            // grasps that held free tissue
    double median, lower_quartile, upper_quartile, max;  // N, of the largest pulls
    double threshold;                                    // N, 2 x median
    int nheld;           // grasps above attachments, which the threshold leaves out
    double held_median;  // N, of their largest pulls; 0: none
    double margin;       // N, for OmSceneTask.force_margin
    double more_median;  // N, the median of truth less twin
    int npair;           // instants at which truth and twin were compared
} OmForceCalibration;
/// Measure threshold and margin of a scene, as above.
/// @return OM_OK; OM_INVALID (no grasp succeeds, or half of the grasps reach twice the threshold);
///        OM_NO_MEMORY; OM_CANCELLED
OM_API OmStatus om_retract_calibrate_force(const OmScene* scene, int nlayout, int nworker,
                                           const OmProgress* progress,
                                           OmForceCalibration* calibration);

/// Can a layout be exposed at all? Try, from rest on the simulated truth, every sequence of the planner's actions for
/// one grasp (pulls until the ROI is exposed or to the height or force limit, then no fold, either fold, or both in
/// either order), for every grasping point that is not above an attachment; without noise and without tools in view.
typedef struct OmSearchResult {
    int ngrasp, nsequence;     // grasping points and sequences tried
    int nexposed;              // sequences that exposed the ROI
    int first_block;           // that the other arm holds meanwhile; -1: one arm
    double visibility;         // the largest of all sequences, 0 to 1
    double force;              // N, the largest pull of that sequence, in the truth
    int block;                 // grasping point of that sequence, -1: nothing can be grasped
    OmPlanVerb first, second;  // folds of that sequence; OM_PLAN_PULL: none
    int naction;  // fewest actions of a sequence that exposes the ROI, with reach and grasp; 0: none
} OmSearchResult;
/// @param force_limit  N; a motion ends there
/// @return OM_OK, also if nothing exposes the ROI; OM_INVALID (a scene that cannot be run); OM_NO_MEMORY;
///        OM_IO; OM_CANCELLED
OM_API OmStatus om_retract_search(const OmScene* scene, double force_limit, int nworker,
                                  const OmProgress* progress, OmSearchResult* result);
/// As om_retract_search. Where no sequence exposes the ROI, the `nfirst` grasps with the largest visibility are held by
/// one arm while the other tries every other block in the same way, until a pair exposes the ROI. The result then also
/// counts these sequences; if `first_block` is not -1, `naction` counts the actions of both arms.
/// @return as om_retract_search
OM_API OmStatus om_retract_search_both(const OmScene* scene, double force_limit, int nfirst,
                                       int nworker, const OmProgress* progress,
                                       OmSearchResult* result);

#ifdef __cplusplus
}
#endif
#endif
