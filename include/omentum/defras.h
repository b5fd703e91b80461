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
    int cookie;
    const OmScene* scene;  // borrowed
    const char* out_dir;   // written whole or not at all; null: nothing is written
    const char* program;   // a logic program in place of the built-in one, or null
    int frame_every;       // a picture in the report every so many actions, 0 none; default 1
    int nworker;           // default 0: one a processor
} OmRetractDef;

OM_API OmRetractDef om_retract_default_def(const OmScene* scene);

typedef struct OmRetractSample {  // one instant of a run, every OM_RETRACT_SAMPLE s
    double time;                  // s
    double visibility;            // 0 to 1
    double force;                 // N, the larger of both arms: pull less the weight carried
    double height;      // m, the higher of the arms that hold tissue, over where it was grasped
    double speed_rate;  // 1, or less while slowed down by force
} OmRetractSample;

#define OM_RETRACT_SAMPLE 0.1  // s

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
    double visibility;  // at its end
    double force_max;   // N, during it
    bool is_replanned;  // a new plan starts with it
    int plan;           // which plan, from 0
} OmRetractAction;

typedef struct OmRetractResult {  // om_retract_result_done frees
    bool is_exposed;              // visibility reached the scene's limit
    char reason[256];             // one sentence: how it ended
    double visibility_start, visibility_end;
    double force_max;     // N
    int nforce;           // times the force rose above the threshold
    double time;          // s of the operation
    double wall_time;     // s it took here
    double twin_step_ms;  // mean wall time of a twin step
    int nplan;            // plans made
    double plan_ms_median, plan_ms_max;
    int naction;
    OmRetractAction* action;
    int nsample;
    OmRetractSample* sample;
    int twin_nvert, twin_ntet, world_nvert, world_ntet;
    uint64_t hash;  // of the truth's final state
} OmRetractResult;

/// @return OM_OK, also if the ROI was not exposed: the result says how it ended. OM_CANCELLED, OM_INVALID
///         (a scene that cannot be run), OM_IO (output), with nothing written
OM_API OmStatus om_retract_run(const OmRetractDef* def, const OmProgress* progress,
                               OmRetractResult* result);
OM_API void om_retract_result_done(OmRetractResult* result);

/// The force threshold of a scene (6.5.1): every grasping point of `nlayout` layouts (seeds 1, 2, ...) is
/// grasped and pulled to the height limit by the twin, measured forces ignored; epsilon is twice the median
/// of the largest pull of each run.
typedef struct OmForceCalibration {
    int nrun;                                            // grasps that held tissue
    double median, lower_quartile, upper_quartile, max;  // N, of the largest pulls
    double threshold;                                    // N, 2 x median
} OmForceCalibration;
OM_API OmStatus om_retract_calibrate_force(const OmScene* scene, int nlayout, int nworker,
                                           const OmProgress* progress,
                                           OmForceCalibration* calibration);

#ifdef __cplusplus
}
#endif
#endif
