/// omentum/defras.h: the deliberative loop of tissue retraction (floor 6; thesis chapter 6).
///
/// Sense, turn what is sensed into fluents (Alg. 4), plan, act, until the endoscope sees the region of
/// interest. This is FRAS (6.5.1): grasping points by the planner's preference, no monitoring or learning.
/// A twin, moved by the measured tools, tells the forces that no sensor measures.
///
///     OmRetractDef def = om_retract_default_def(&scene);
///     def.out_dir = "out/sheet";
///     OmRetractResult result;
///     om_retract_run(&def, NULL, &result);     // writes the report and the recording
///     om_retract_result_done(&result);
#ifndef OMENTUM_DEFRAS_H
#define OMENTUM_DEFRAS_H

#include "omentum/plan.h"
#include "omentum/scene.h"
#include "omentum/world.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmRetractDef {
    OmCookie cookie;
    const OmScene* scene;  // borrowed
    const char* out_dir;   // written whole (om_folder_begin); null: nothing is written
    const char* program;   // a logic program in place of the built-in one, or null
    int frame_every;       // a picture in the report every so many actions, 0 none; default 1
    int nworker;           // default 0: one a processor
} OmRetractDef;

OM_API OmRetractDef om_retract_default_def(const OmScene* scene);

typedef struct OmRetractSample {  // one instant of a run, every OM_RETRACT_SAMPLE s
    double time;                  // s
    double visibility;            // 0 to 1
    double force;        // N, by the twin, the larger of both arms: pull less the weight carried
    double force_world;  // N, the same in the simulated truth; NAN in a world without one
    double height;       // m, the higher of the arms that hold tissue, over where it was grasped
    double speed_rate;   // 1, or less while slowed down by force
} OmRetractSample;

#define OM_RETRACT_SAMPLE 0.1  // s
#define OM_RETRACT_SLID 0.15   // see OmRetractResult.has_slid

typedef enum OmActionOutcome {
    OM_ACTION_DONE,       // it ended as planned
    OM_ACTION_EXPOSED,    // the ROI came into view on the way
    OM_ACTION_FORCE,      // stopped: force above the threshold, even when slowed down
    OM_ACTION_HEIGHT,     // stopped: the height limit
    OM_ACTION_UNREACHED,  // the arm could not go there
    OM_ACTION_EMPTY       // no tissue between the jaws
} OmActionOutcome;
OM_API const char* om_action_outcome_text(OmActionOutcome outcome);

typedef struct OmRetractAction {  // one executed action
    OmPlanVerb verb;
    int arm, block;     // block -1: none
    double begin, end;  // s
    OmActionOutcome outcome;
    double visibility;       // at its end
    double force_max;        // N, during it, by the twin
    double force_world_max;  // N, during it, in the truth; NAN without one
    bool is_replanned;       // a new plan starts with it
    int plan;                // which plan, from 0
} OmRetractAction;

typedef enum OmRetractOutcome {
    OM_RETRACT_EXPOSED,  // the arms exposed the ROI: visibility reached the scene's limit and stayed
    OM_RETRACT_IN_VIEW,   // the ROI was in view before any action: the scene hides nothing
    OM_RETRACT_GAVE_UP,   // the scene's number of actions was reached
    OM_RETRACT_NO_PLAN,   // no grasping point is left
    OM_RETRACT_CANCELLED  // in the record of a run that was cancelled
} OmRetractOutcome;
/// One word, as run.json has it: "exposed", "in_view_at_start", "gave_up", "no_plan_left", "cancelled".
OM_API const char* om_retract_outcome_text(OmRetractOutcome outcome);

typedef struct OmRetractResult {  // om_retract_result_done frees
    OmRetractOutcome outcome;     //
    bool is_exposed;              // the outcome is OM_RETRACT_EXPOSED
    char reason[256];             // one sentence: how it ended
    double visibility_start, visibility_end;
    // Forces: the arms see those of the twin alone. The truth's are for judging; NAN in a world without one.
    double force_max;        // N, by the twin
    double force_world_max;  // N, in the truth
    double force_more;       // N, largest excess of the truth over the twin at one instant
    double force_less;       // N, the most by which it fell short
    int nforce;        // times the twin's force rose to where the arms act: threshold less margin
    int nforce_world;  // times the truth's force rose above the threshold
    double time;       // s of the operation
    double wall_time;  // s it took here
    double twin_step_ms;  // mean wall time of a twin step
    int nplan;            // plans made
    double plan_ms_median, plan_ms_max;
    int naction;
    OmRetractAction* action;
    int nsample;
    OmRetractSample* sample;
    // The tissue comes to rest on its ground before the operation begins.
    bool is_settled;                 // twin and truth were at rest when the operation began
    double twin_shift, world_shift;  // m, mean displacement of the vertices until then
    bool has_slid;  // one of the shifts exceeds OM_RETRACT_SLID of the tissue's smaller half extent
    int twin_nbad, world_nbad;  // steps with inverted elements, unsettled contact or energy gained
    int twin_nvert, twin_ntet, world_nvert, world_ntet;
    uint64_t hash;  // of the truth's final state
} OmRetractResult;

/// @return OM_OK, also if the ROI was not exposed: the result says how it ended. OM_INVALID (a scene that
///         cannot be run), OM_IO (output), with nothing written; OM_CANCELLED, and if the operation had begun, the
///         record so far is in out_dir, or beside it if something stands there: the message names the folder
OM_API OmStatus om_retract_run(const OmRetractDef* def, const OmProgress* progress,
                               OmRetractResult* result);
OM_API void om_retract_result_done(OmRetractResult* result);

typedef struct OmRetractEstimate {  // of a run that has not begun
    int twin_nvert, twin_ntet, world_nvert, world_ntet;
    int twin_nattached, world_nattached;  // vertices
    int nblock,
        ngrasp;  // blocks of the grid; those with a grasping point that is not above an attachment
    double visibility;  // of the ROI before any action, 0 to 1
    bool is_settled;    // as in OmRetractResult
    bool has_slid;      //
    int nplanned;       // actions of the first plan; 0: none is found
    double begin_time;  // s, it took to build, settle and plan
    double
        time_rate;  // s of computing for one of operation, measured over OM_RETRACT_CHECK_TIME at rest
    double
        picture_bytes;  // memory that the report's pictures take if every action of the scene is used
} OmRetractEstimate;
#define OM_RETRACT_CHECK_TIME 0.5  // s
/// All that om_retract_run does before the first action, and an estimate of the rest. Writes nothing; whether
/// `out_dir` can be written is checked.
/// @return as om_retract_run; OM_OK also for a scene whose ROI is in view or that has no plan
OM_API OmStatus om_retract_check(const OmRetractDef* def, const OmProgress* progress,
                                 OmRetractEstimate* estimate);

/// The force threshold of a scene (6.5.1): every grasping point of `nlayout` layouts (seeds 1, 2, ...) is
/// grasped by the twin, pulled to the height limit and, while the ROI is hidden, folded both ways, measured
/// forces ignored; epsilon is twice the median of the largest pull of each grasp. A fifth of the grasps is
/// repeated on the simulated truth: the margin is the 95 % quantile of how much more than the twin it bears while
/// the twin is between half the threshold and the threshold. A motion ends at twice the scene's threshold.
typedef struct OmForceCalibration {
    int nrun;                                            // grasps that held tissue
    double median, lower_quartile, upper_quartile, max;  // N, of the largest pulls
    double threshold;                                    // N, 2 x median
    double margin;                                       // N, for OmSceneTask.force_margin
    double more_median;                                  // N, the median of truth less twin
    int npair;  // instants at which truth and twin were compared
} OmForceCalibration;
/// Measure threshold and margin of a scene, as above.
/// @return OM_OK; OM_INVALID (no grasp succeeds, or half of the grasps reach twice the threshold);
///        OM_NO_MEMORY; OM_CANCELLED
OM_API OmStatus om_retract_calibrate_force(const OmScene* scene, int nlayout, int nworker,
                                           const OmProgress* progress,
                                           OmForceCalibration* calibration);

/// Whether a layout can be exposed at all: every sequence of the planner's actions for one grasp (lift to the
/// height or force limit, then no fold, either fold, or one after the other), for every grasping point that is
/// not above an attachment, tried from rest on the simulated truth, without noise and without tools in view.
typedef struct OmSearchResult {
    int ngrasp, ncourse;       // grasping points and sequences tried
    int nexposed;              // sequences that exposed the ROI
    double visibility;         // the most that any of them showed, 0 to 1
    double force;              // N, the largest pull of that one, in the truth
    int block;                 // its grasping point, -1: nothing can be grasped
    OmPlanVerb first, second;  // its folds; OM_PLAN_PULL: none
} OmSearchResult;
/// @param force_limit  N; a motion ends there
/// @return OM_OK, also if nothing exposes the ROI; OM_INVALID (a scene that cannot be run); OM_NO_MEMORY;
///        OM_IO; OM_CANCELLED
OM_API OmStatus om_retract_search(const OmScene* scene, double force_limit, int nworker,
                                  const OmProgress* progress, OmSearchResult* result);

#ifdef __cplusplus
}
#endif
#endif
