// plan_internal.h: shared by the files of room plan.
//
//     plan_situation.c  the situation and its grid          plan_planner.c  situation -> atoms -> plan
//     plan_clingo.c     clingo behind our own types         plan_explain.c  why: solves again with alternatives
//     plan_text.c       the plan in words
#ifndef OM_PLAN_INTERNAL_H
#define OM_PLAN_INTERNAL_H

#include "omentum/plan.h"
#include "omentum/vec.h"

// ---- answer sets: the parts of clingo that we use -----------------------------------------------

#define OM_ASP_MAX_SYMBOL 512  // shown atoms of one answer
#define OM_ASP_MAX_COST 16     // levels of optimisation

typedef uint64_t OmSymbol;  // a ground term: number, name(arguments) or "text"
typedef struct OmAsp OmAsp;

typedef struct OmAspPart {  // a #program to ground, with its arguments
    const char* name;
    const OmSymbol* arg;
    int narg;
} OmAspPart;

typedef struct OmAspAnswer {
    bool has_model;
    bool is_final;  // the search ended: the model is an optimum, or none exists
    int nsymbol;
    OmSymbol symbol[OM_ASP_MAX_SYMBOL];  // shown atoms, in no order
    int ncost;
    int64_t cost[OM_ASP_MAX_COST];  // most important level first
} OmAspAnswer;

/// `arg`: options of gringo and clasp.
OmStatus om__asp_create(const char* const* arg, int narg, OmAsp** out);
void om__asp_destroy(OmAsp* asp);
/// Add program text, from a file or from memory. OM_INVALID with clingo's text, file, line and column.
OmStatus om__asp_load(OmAsp* asp, const char* path);
OmStatus om__asp_add(OmAsp* asp, const char* text);
OmStatus om__asp_ground(OmAsp* asp, const OmAspPart* part, int npart);
/// OM_OK with or without a model; `assume` are literals taken as true. OM_TIMEOUT: not final.
OmStatus om__asp_solve(OmAsp* asp, const int32_t* assume, int nassume, double time_limit,
                       OmAspAnswer* answer);
OmStatus om__asp_assign(OmAsp* asp, int32_t literal, bool value);
/// Literal of a ground atom; 0 if the program has no such atom.
OmStatus om__asp_find(OmAsp* asp, OmSymbol atom, int32_t* literal);
/// Literal of an external atom; 0 if the program declares no such atom.
OmStatus om__asp_find_external(OmAsp* asp, OmSymbol atom, int32_t* literal);
/// The ground atoms name/arity, up to `max` of them; *count is their total number.
OmStatus om__asp_list(OmAsp* asp, const char* name, int arity, OmSymbol* atom, int max, int* count);

OmSymbol om__asp_number(int value);
/// name(arg...); 0 with the message set if memory is out.
OmSymbol om__asp_function(const char* name, const OmSymbol* arg, int narg);
/// Parse a term: "reach(psm1,b(1,2),0)".
OmStatus om__asp_parse(const char* text, OmSymbol* symbol);
/// Name and arguments of a function symbol; narg is -1 for another symbol.
const char* om__asp_name(OmSymbol symbol, const OmSymbol** arg, int* narg);
int om__asp_number_of(OmSymbol symbol);        // -1 if it is not a number
const char* om__asp_text_of(OmSymbol symbol);  // null if it is not a text

// ---- the planner ----------------------------------------------------------------------------------

typedef struct OmFluent {  // an external atom of the ground program
    int32_t literal;       // 0: the program does not have it
    bool value;
} OmFluent;

typedef struct OmDistanceFluent {  // distance(block, roi or attachments, x, 0)
    int block, to, x;
    OmFluent fluent;
} OmDistanceFluent;

struct OmPlanner {
    OmPlannerDef def;
    char* program_path;               // owned copy; null: the built-in program
    OmAsp* asp;                       // null until the first ground program
    int n;                            // grid size of the ground program
    uint8_t pair[OM_PLAN_MAX_BLOCK];  // bit a: pair(arm a, block) is grounded
    bool has_exposure;                // known exposure is grounded
    uint64_t metric_hash;             // of the block centres of the grounded metric/3
    OmFluent* fluent;                 // see fluent_count in plan_planner.c
    OmDistanceFluent* distance;
    int ndistance, distance_cap;
    int* distance_hash;  // open addressing into `distance`, -1 empty
    OmAspAnswer answer;  // of the last solve
};

/// Ground missing parts and set every external atom from the situation.
OmStatus om__planner_sense(OmPlanner* planner, const OmSituation* s, bool is_explaining,
                           bool* is_reground);
/// Solve with literals assumed; fills plan from the answer. OM_OK, OM_UNSAT, OM_TIMEOUT or an error.
OmStatus om__planner_search(OmPlanner* planner, const OmSituation* s, const int32_t* assume,
                            int nassume, OmPlan* plan);

/// The symbols of the program: psm1, b(ix,iy).
OmSymbol om__plan_arm_symbol(int arm);
OmSymbol om__plan_block_symbol(int n, int block);

OmStatus om__situation_check(const OmSituation* s);
OmVec3 om__situation_center(const OmSituation* s, int block);
/// Distance in 0.1 mm from a block to the nearest block with `mark`; -1 if there is none.
int om__situation_distance(const OmSituation* s, int block, const bool* mark);

extern const char om__plan_program[];  // asp/tissue_retraction.lp, ended by zero
extern const char* const om__plan_verb_name[OM_PLAN_NVERB];
extern const char* const om__plan_arm_name[OM_MAX_ARM];

#endif
