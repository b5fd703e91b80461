/// omentum/plan.h: the task planner (floor 5).
///
/// Tissue retraction (thesis chapter 6, Table 6.1) as an answer set program, solved by clingo inside this process. The
/// tissue is an n x n grid of blocks. Sensing gives the fluents that hold (Alg. 4). The planner returns the shortest
/// plan for the best grasping point, proves that it is optimal, and explains it.
///
///     OmPlannerDef def = om_planner_default_def();
///     OmPlanner* planner;   om_planner_create(&def, &planner);
///     OmSituation now;      om_situation_init(&now, 5, 0.024);
///     now.is_above_roi[om_block_at(&now, 3, 3)] = true;
///     OmPlan plan;          OmStatus s = om_planner_solve(planner, &now, &plan);  // OM_OK or OM_UNSAT
///     OmText t = {0};       om_plan_print(&plan, &t);  ...  om_planner_destroy(planner);
#ifndef OMENTUM_PLAN_H
#define OMENTUM_PLAN_H

#include "omentum/base.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_PLAN_MAX_GRID 16  // blocks along one side of the tissue, at most
#define OM_PLAN_MAX_BLOCK (OM_PLAN_MAX_GRID * OM_PLAN_MAX_GRID)
#define OM_PLAN_MAX_HORIZON 64
#define OM_PLAN_NCOST 6  // objectives, the most important first; see OmPlan.cost

/// The actions of Table 6.1 with their names in the logic program.
#define OM_PLAN_VERB_TABLE(X)       \
    X(OM_PLAN_REACH, "reach")       \
    X(OM_PLAN_GRASP, "grasp")       \
    X(OM_PLAN_RELEASE, "release")   \
    X(OM_PLAN_PULL, "pull")         \
    X(OM_PLAN_MOVE_ROI, "move_ROI") \
    X(OM_PLAN_MOVE_AWAY, "move_away")

typedef enum OmPlanVerb {
#define OM_PLAN_VERB_ENUM(name, text) name,
    OM_PLAN_VERB_TABLE(OM_PLAN_VERB_ENUM)
#undef OM_PLAN_VERB_ENUM
        OM_PLAN_NVERB
} OmPlanVerb;

/// Actions on a block that did not expose the ROI; the next plan does not repeat them.
typedef enum OmTried {
    OM_TRIED_GRASP = 1,      // grasping and pulling it: it is not grasped again
    OM_TRIED_MOVE_ROI = 2,   // folding it towards the ROI
    OM_TRIED_MOVE_AWAY = 4,  // folding it away from the camera
} OmTried;

/// Result of trying a block in the simulation. The logic program uses it in place of its assumed law of exposure.
typedef struct OmExposure {
    bool is_known;    // default false; the other fields then have no meaning
    bool exposes;     // the ROI was exposed, and it stayed exposed
    int npull;        // pulls made before the fold, or until the ROI was exposed; 1 or more
    OmPlanVerb fold;  // OM_PLAN_MOVE_ROI, OM_PLAN_MOVE_AWAY; OM_PLAN_PULL: pulls alone
} OmExposure;

typedef struct OmArmSituation {  // one arm, as sensed
    int at;                      // block below the tool, -1 none: fluent at
    int in_hand;                 // block held, -1 none: fluent in_hand; then the gripper is closed
    bool is_closed;              // gripper below 20 degrees: fluent closed_gripper
    bool is_max_height;          // tool at the height limit: fluent max_height
    bool is_max_force;           // force above the threshold: fluent max_force
    int nlift;                   // pulls of 10 mm already made with the tissue held, 0 or more
} OmArmSituation;

/// The input of the planner from sensing (Alg. 4). A plain value that may be copied.
/// Block (ix, iy), counted from 1, has index (iy - 1) * n + ix - 1. x and y are those of the task frame; the arms are
/// on both sides of its x-z plane.
typedef struct OmSituation {
    int n;                                   // blocks along a side, 1 to OM_PLAN_MAX_GRID
    bool is_fixed[OM_PLAN_MAX_BLOCK];        // the block is above attachment points
    bool is_above_roi[OM_PLAN_MAX_BLOCK];    // the block is above the ROI; at least one is
    bool is_forbidden[OM_PLAN_MAX_BLOCK];    // a person forbade to grasp the block
    uint8_t reachable[OM_PLAN_MAX_BLOCK];    // bit a: arm a reaches the block
    uint8_t tried[OM_PLAN_MAX_BLOCK];        // bits OmTried
    OmArmSituation arm[OM_MAX_ARM];          // psm1, psm2
    OmExposure exposure[OM_PLAN_MAX_BLOCK];  // what trying each block in the simulation showed
    bool is_visible;                         // the ROI is seen: the plan is empty
    double spacing;                          // between centres of neighbouring blocks, m, > 0
    const double* center;  // of each block (n*n x 3), m, borrowed; null: a flat grid
} OmSituation;

/// An untouched tissue: nothing fixed, no ROI, arms open and away, blocks reachable by the arm on their side
/// (Alg. 4, line 5; psm1 the low y, psm2 the high y, the middle row of an odd grid by psm1).
OM_API void om_situation_init(OmSituation* situation, int n, double spacing);

/// Index of block (ix, iy), both counted from 1; -1 outside of the grid.
OM_API int om_block_at(const OmSituation* situation, int ix, int iy);

typedef struct OmPlanAction {
    OmPlanVerb verb;
    int arm;    // 0: psm1, 1: psm2
    int block;  // -1 for release
    int time;   // step of the plan, from 0
} OmPlanAction;

typedef struct OmPlan {
    OmStatus outcome;  // OM_OK, OM_UNSAT or OM_TIMEOUT, as om_planner_solve returned
    int n;             // grid of the situation it was made for
    int naction;       // 0 when the ROI is already visible, and when there is no plan
    OmPlanAction action[OM_PLAN_MAX_HORIZON];  // in order of time
    int grasp_block;  // block that is newly grasped; -1 if the plan continues with a held block
    int grasp_arm;    // the arm that grasps it, -1
    // By priority: new grasps; new grasps of blocks known not to expose the ROI; distance of the grasp from the ROI in
    // 0.1 mm; minus its distance from the attachments in 0.1 mm; number of actions; order of preference between equal
    // plans. All 0 for a user's program with another number of levels.
    int64_t cost[OM_PLAN_NCOST];
    bool is_optimal;     // no better plan exists within the horizon
    bool is_reground;    // the program was grounded for this plan, not only solved again
    double ground_time;  // s, to adapt the ground program to the situation
    double solve_time;   // s
} OmPlan;

typedef struct OmPlannerDef {
    OmCookie cookie;
    int horizon;          // time steps a plan may take; default 12, range 1 to OM_PLAN_MAX_HORIZON
    int max_lift;         // pulls of 10 mm from the tissue to the height limit; default 5 (50 mm)
    const char* program;  // a file in place of the built-in asp/tissue_retraction.lp; null
    uint32_t seed;  // of clasp; default 1. The optimum is unique, so plans do not depend on it
    // For a user's program: also add facts metric(B1,B2,X) for all pairs of blocks, and set the external atoms
    // distance(B1,B2,X,0) if the program declares them. Default false: only distances to the ROI and to attachments.
    bool has_all_distances;
    // An arm may keep its tissue up while the other one grasps and pulls; default false: it lets go first.
    bool has_both_arms;
    // Conflicts of the search that a solve may take, 0: no limit; default 100000. The same situations give the same
    // plans on a machine of any speed.
    int conflict_limit;
    // s that a solve may take as well; default 0: no limit. With it plans depend on the speed of the machine. Grounding
    // has no limit: a program of one's own that describes too many atoms, or infinitely many, does not return.
    // `omentum plan` grounds in a child process for that.
    double time_limit;
} OmPlannerDef;

OM_API OmPlannerDef om_planner_default_def(void);

/// clingo and its ground program, kept between plans; for one thread at a time.
typedef struct OmPlanner OmPlanner;

/// @return OM_OK; OM_INVALID (a field, or the program: clingo's text with file, line and column); OM_IO;
///         OM_NO_MEMORY
OM_API OmStatus om_planner_create(const OmPlannerDef* def, OmPlanner** planner);
OM_API void om_planner_destroy(OmPlanner* planner);
/// OmPlannerDef.has_both_arms of this planner.
OM_API bool om_planner_has_both_arms(const OmPlanner* planner);

/// The best plan for the situation. Only parts that are new since the last plan are grounded.
/// @return OM_OK; OM_UNSAT (no plan within the horizon: plan is empty, om_planner_explain gives the reason);
///         OM_TIMEOUT (plan is the best found so far, not proven, or empty); OM_INVALID (a field of the
///         situation); OM_NO_MEMORY
OM_API OmStatus om_planner_solve(OmPlanner* planner, const OmSituation* situation, OmPlan* plan);

/// The name in the logic program of an action, and of an arm: "psm1" or "psm2".
OM_API const char* om_plan_verb_text(OmPlanVerb verb);
OM_API const char* om_plan_arm_text(int arm);
/// Append the plan as text, one line for each action: "1. PSM1 reaches grasping point (3,2)".
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_plan_print(const OmPlan* plan, OmText* text);
/// Append the text of one action, without number or line end: "PSM1 reaches grasping point (3,2)".
/// @return OM_OK; OM_INVALID (no such action); OM_NO_MEMORY
OM_API OmStatus om_plan_print_action(const OmPlan* plan, int action, OmText* text);

/// Append an explanation: the fluents that decided, and for each other grasping point the rule that forbids it or its
/// higher cost. Each answer comes from the program itself, solved again with that point forced.
/// @param plan    of om_planner_solve for this situation, also after OM_UNSAT
/// @param nother  number of other grasping points to explain, the nearest to the ROI first; -1: all
/// @return OM_OK; OM_INVALID (plan and situation do not fit); OM_TIMEOUT; OM_NO_MEMORY
OM_API OmStatus om_planner_explain(OmPlanner* planner, const OmSituation* situation,
                                   const OmPlan* plan, int nother, OmText* text);

/// Text of the built-in logic program, as a start for a user's own.
OM_API const char* om_planner_program(void);

#ifdef __cplusplus
}
#endif
#endif
