/// omentum/trial_preplan.h: the plan before the operation (floor 8; thesis 6.4.2).
///
/// Every grasping point that is not above a believed attachment, and in reach of its arm, is tried in the simulation of
/// the twin: grasp, pulls, and where the ROI is still hidden, both folds. No truth, no noise. Of the points that
/// expose the ROI the three of lowest largest force, of these the one of fewest actions is chosen. The loop follows
/// this plan first; what was tried is known to its planner (OmSituation.exposure).
///
///     OmPreplanDef def = om_preplan_default_def(&scene);
///     OmPreplan plan;
///     om_preplan_run(&def, NULL, &plan);
///     puts(plan.reason);
///     om_preplan_save(&plan, "plan.json");
#ifndef OMENTUM_TRIAL_PREPLAN_H
#define OMENTUM_TRIAL_PREPLAN_H

#include "omentum/plan.h"
#include "omentum/scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Why a grasping point was chosen, or why it was not: name, word in the plan file, sentence after "it".
#define OM_PREPLAN_VERDICT_TABLE(X)                                                            \
    X(OM_PREPLAN_CHOSEN, "chosen", "is chosen")                                                \
    X(OM_PREPLAN_MORE_ACTIONS, "more_actions", "exposes the ROI, but takes more actions")      \
    X(OM_PREPLAN_MORE_FORCE, "more_force", "exposes the ROI, but with more force")             \
    X(OM_PREPLAN_HIDDEN, "hidden", "leaves the ROI hidden up to the height limit")             \
    X(OM_PREPLAN_FORCE_LIMIT, "force_limit", "reaches the force limit before the ROI is seen") \
    X(OM_PREPLAN_ATTACHED, "attached", "is above attachment points")                           \
    X(OM_PREPLAN_NO_TISSUE, "no_tissue", "has no tissue to grasp")                             \
    X(OM_PREPLAN_OUT_OF_REACH, "out_of_reach", "is out of reach of its arm")

typedef enum OmPreplanVerdict {
#define OM_PREPLAN_VERDICT_ENUM(name, word, text) name,
    OM_PREPLAN_VERDICT_TABLE(OM_PREPLAN_VERDICT_ENUM)
#undef OM_PREPLAN_VERDICT_ENUM
        OM_PREPLAN_NVERDICT
} OmPreplanVerdict;

typedef struct OmPreplanPoint {  // a grasping point and the best that it reached
    int block, arm;              // arm -1: none
    OmPreplanVerdict verdict;
    bool is_tried;      // false: the fields below are 0
    bool exposes;       // the task's visibility was reached, and it stayed
    int npull;          // pulls before the fold, or until the ROI was exposed
    OmPlanVerb fold;    // OM_PLAN_MOVE_AWAY, OM_PLAN_MOVE_ROI; OM_PLAN_PULL: none
    double visibility;  // at its end, 0 to 1
    double force;       // N, largest pull; -1: the twin's engine has no forces
    int naction;        // as the loop counts: reach, grasp, each pull, each fold
    int nstep;          // of the twin, of all sequences tried
} OmPreplanPoint;

/// The result: a plain value, which may be copied.
typedef struct OmPreplan {
    char scene[OM_SCENE_NAME];
    int seed;
    int n;                                    // blocks along a side; there are n x n points
    OmPreplanPoint point[OM_PLAN_MAX_BLOCK];  // of each block
    int chosen;                               // its block, -1: nothing can be grasped
    bool is_exposing;                         // the chosen point reaches `visibility`
    double visibility;                        // that counts as exposed
    double force_limit;                       // N, at which pulls stopped; -1: none
    int ntried, nexposing;
    int64_t nstep;     // of the twin, all points
    char reason[256];  // one sentence: why this point, or the warning
} OmPreplan;

typedef struct OmPreplanDef {
    OmCookie cookie;
    const OmScene* scene;  // borrowed; only the twin's side of it is used
    int nworker;  // points in parallel; default 0: one a processor. The result does not depend on it
    int nlowest;  // of the exposing points this many of lowest force compete; default 3
    // A file that keeps each finished trial: after a cancellation or a kill the same call continues from there, with
    // the same result; null (default): none. It stays: remove it once the plan is saved. Trials of another scene,
    // other settings or another version are discarded with a warning. Borrowed.
    const char* trials;
} OmPreplanDef;

OM_API OmPreplanDef om_preplan_default_def(const OmScene* scene);

/// Try every grasping point and choose.
/// @param progress  called at steps of the twin, by any of the threads, one at a time
/// @return OM_OK, also if no point exposes the ROI: `is_exposing` is false and `reason` says so. OM_INVALID (a field,
///         a scene that cannot be run, or another file at `trials`); OM_NO_MEMORY; OM_IO; OM_CANCELLED
OM_API OmStatus om_preplan_run(const OmPreplanDef* def, const OmProgress* progress,
                               OmPreplan* plan);

/// The actions of the chosen point: reach, grasp, pulls, fold. Without a chosen point there are none.
OM_API void om_preplan_make_plan(const OmPreplan* preplan, OmPlan* plan);
/// What the points showed, for OmSituation.exposure; points that were not tried are unknown.
OM_API void om_preplan_get_exposure(const OmPreplan* preplan,
                                    OmExposure exposure[OM_PLAN_MAX_BLOCK]);
/// The word of a verdict in the plan file, and its sentence after "it".
OM_API const char* om_preplan_verdict_word(OmPreplanVerdict verdict);
OM_API const char* om_preplan_verdict_text(OmPreplanVerdict verdict);

/// Append the map of the grid as text: verdict, visibility, force and actions of every block.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_preplan_print(const OmPreplan* plan, OmText* text);
/// Write the plan file, JSON; its numbers have nine digits. A plan that was read writes the same file.
/// @return OM_OK; OM_IO; OM_NO_MEMORY
OM_API OmStatus om_preplan_save(const OmPreplan* plan, const char* path);
/// @return OM_OK; OM_INVALID (not a plan file: the message names the field); OM_IO; OM_NO_MEMORY. `plan` is unchanged
///         then
OM_API OmStatus om_preplan_load(const char* path, OmPreplan* plan);
/// The same from memory; `name` is the file's in messages.
/// @return as om_preplan_load, without OM_IO
OM_API OmStatus om_preplan_parse(const char* text, size_t size, const char* name, OmPreplan* plan);
/// Write the page with pictures of the map.
/// @return OM_OK; OM_IO; OM_NO_MEMORY
OM_API OmStatus om_preplan_save_report(const OmPreplan* plan, const char* path);

struct OmReport;
/// Add the maps of the grid to a page: visibility, force, actions.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_preplan_add_maps(const OmPreplan* plan, struct OmReport* page);

#ifdef __cplusplus
}
#endif
#endif
