// cli_plan.c: omentum plan: plan the arms' actions for a situation, and explain the plan.
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cli_common.h"
#include "cli_guard.h"
#include "omentum/plan.h"
#include "omentum/scene_yaml.h"

static const OmCliOption option[] = {
    {"--grid", NULL, "N", "blocks along a side of the tissue, without a situation file", "5", NULL,
     1, OM_PLAN_MAX_GRID},
    {"--roi", NULL, "X,Y", "the region of interest lies under this block; may be repeated"},
    {"--attached", NULL, "X,Y", "a block above attachment points; may be repeated"},
    {"--tried", NULL, "X,Y", "a block where a grasp failed; may be repeated"},
    {"--why", NULL, NULL, "explain the choice, and why others are worse or impossible"},
    {"--others", NULL, "N", "number of other grasping points to explain", "8, -1 all", NULL, -1,
     OM_PLAN_MAX_BLOCK},
    {"--horizon", NULL, "N", "largest number of steps of a plan", "12", NULL, 1,
     OM_PLAN_MAX_HORIZON},
    {"--max-pulls", NULL, "N", "pulls of 10 mm up to the height limit", "5", NULL, 1,
     OM_PLAN_MAX_HORIZON},
    {"--program", NULL, "FILE", "a logic program instead of the built-in one"},
    {"--time-limit", NULL, "S", "time limit in seconds of grounding, and of each solve", "10", "s",
     1e-3, 1e6},
    {"--memory-limit", NULL, "MB", "memory limit of grounding and solving", "2000", "MB", 50, 1e6},
    {"--json", NULL, NULL, "print the plan as JSON"},
    {"--example", NULL, NULL, "print an example of a situation file"},
    {"--print-program", NULL, NULL, "print the built-in logic program"},
};

static const OmCliKey result_key[] = {
    {"outcome", "plan, no plan, or time limit"},
    {"action", "verb, arm and block of each action, in order"},
    {"cost", "costs of the plan, by priority"},
    {"ground_ms, solve_ms", "time of clingo"},
};
#define TIME_LIMIT 10.0  // s, default of --time-limit
#define MEMORY_MB 2000   // default of --memory-limit

static const char example[] =
    "# The sensed situation. Blocks are (x, y), counted from 1; psm1 stands at the low y.\n"
    "grid: 5\n"
    "spacing_mm: 24\n"
    "# Seen from above, the row of y = 5 first:\n"
    "#   . free   A above attachments   R above the region of interest   B both   - out of reach\n"
    "tissue: |\n"
    "  . . . . .\n"
    "  . . . . .\n"
    "  . A R . .\n"
    "  . A A . .\n"
    "  . . . . .\n"
    "# Actions on a block that failed.\n"
    "tried:\n"
    "  - {x: 3, y: 3, grasp: true, fold_away: true, fold_towards: false}\n"
    "# An arm: the block it is at, whether it holds it, and its limits.\n"
    "psm1: {x: 3, y: 3, holds: true, pulls: 5, at_height_limit: true, above_force_limit: false}\n"
    "psm2: {gripper_closed: false}\n";

// ---- the situation file ------------------------------------------------------------------------------------

enum { MAX_PICTURE = 2048 };

typedef struct TriedEntry {
    int x, y;
    bool grasp, fold_away, fold_towards;
} TriedEntry;

typedef struct ArmEntry {
    int x, y, pulls;
    bool holds, gripper_closed, at_height_limit, above_force_limit;
} ArmEntry;

typedef struct Description {
    int grid;
    double spacing;
    char tissue[MAX_PICTURE];
    bool visible;
    TriedEntry tried[OM_PLAN_MAX_BLOCK];
    int ntried;
    ArmEntry arm[OM_MAX_ARM];
} Description;

static const OmYamlField tried_field[] = {
    {"x", OM_YAML_INT, offsetof(TriedEntry, x), .min = 1, .max = OM_PLAN_MAX_GRID,
     .is_required = true},
    {"y", OM_YAML_INT, offsetof(TriedEntry, y), .min = 1, .max = OM_PLAN_MAX_GRID,
     .is_required = true},
    {"grasp", OM_YAML_BOOL, offsetof(TriedEntry, grasp)},
    {"fold_away", OM_YAML_BOOL, offsetof(TriedEntry, fold_away)},
    {"fold_towards", OM_YAML_BOOL, offsetof(TriedEntry, fold_towards)},
};
static const OmYamlSchema tried_schema = {"tried", tried_field, 5};

static const OmYamlField arm_field[] = {
    {"x", OM_YAML_INT, offsetof(ArmEntry, x), .min = 1, .max = OM_PLAN_MAX_GRID},
    {"y", OM_YAML_INT, offsetof(ArmEntry, y), .min = 1, .max = OM_PLAN_MAX_GRID},
    {"pulls", OM_YAML_INT, offsetof(ArmEntry, pulls), .min = 0, .max = 1000},
    {"holds", OM_YAML_BOOL, offsetof(ArmEntry, holds)},
    {"gripper_closed", OM_YAML_BOOL, offsetof(ArmEntry, gripper_closed)},
    {"at_height_limit", OM_YAML_BOOL, offsetof(ArmEntry, at_height_limit)},
    {"above_force_limit", OM_YAML_BOOL, offsetof(ArmEntry, above_force_limit)},
};
static const OmYamlSchema arm_schema = {"arm", arm_field, 7};

static const OmYamlField description_field[] = {
    {"grid", OM_YAML_INT, offsetof(Description, grid), .min = 1, .max = OM_PLAN_MAX_GRID,
     .is_required = true},
    {"spacing_mm", OM_YAML_DOUBLE, offsetof(Description, spacing), .min = 0.1, .max = 1000,
     .scale = 1e-3},
    {"tissue", OM_YAML_STRING, offsetof(Description, tissue), .size = MAX_PICTURE,
     .has_lines = true, .is_required = true},
    {"visible", OM_YAML_BOOL, offsetof(Description, visible)},
    {"tried", OM_YAML_LIST, offsetof(Description, tried), .size = sizeof(TriedEntry),
     .sub = &tried_schema, .count_offset = offsetof(Description, ntried),
     .capacity = OM_PLAN_MAX_BLOCK},
    {"psm1", OM_YAML_STRUCT, offsetof(Description, arm[0]), .sub = &arm_schema},
    {"psm2", OM_YAML_STRUCT, offsetof(Description, arm[1]), .sub = &arm_schema},
};
static const OmYamlSchema description_schema = {"situation", description_field, 7};

// The map of the tissue: n rows of n characters, the row of the highest y first.
static OmStatus read_picture(const char* path, const char* picture, OmSituation* s) {
    int n = s->n, count = 0;
    for (const char* c = picture; *c; c++) {
        if (*c == ' ' || *c == '\n' || *c == '\t' || *c == '\r') continue;
        int row = count / n, b = count < n * n ? (n - 1 - row) * n + count % n : -1;
        OM_CHECK(b >= 0, OM_INVALID, "%s: tissue: more than %d x %d signs", path, n, n);
        OM_CHECK(strchr(".ARB-", *c), OM_INVALID,
                 "%s: tissue: \"%c\" in row %d, column %d; the signs are . A R B -", path, *c,
                 row + 1, count % n + 1);
        s->is_fixed[b] = *c == 'A' || *c == 'B';
        s->is_above_roi[b] = *c == 'R' || *c == 'B';
        if (*c == '-') s->reachable[b] = 0;
        count++;
    }
    OM_CHECK(count == n * n, OM_INVALID, "%s: tissue: %d signs; a grid of %d needs %d", path, count,
             n, n * n);
    return OM_OK;
}

static OmStatus block_of(const char* where, const char* what, const OmSituation* s, int x, int y,
                         int* block) {
    *block = om_block_at(s, x, y);
    OM_CHECK(*block >= 0, OM_INVALID, "%s%s: block (%d,%d) is outside of the grid of %d", where,
             what, x, y, s->n);
    return OM_OK;
}

static OmStatus read_file(const char* path, OmSituation* s) {
    OmStatus status = OM_OK;
    Description* d = om_calloc(1, sizeof *d);
    if (!d) return OM_NO_MEMORY;
    d->spacing = 0.024;
    OM_TRY_DONE(om_yaml_load(path, &description_schema, d));
    om_situation_init(s, d->grid, d->spacing);
    s->is_visible = d->visible;
    OM_TRY_DONE(read_picture(path, d->tissue, s));
    for (int i = 0; i < d->ntried; i++) {
        const TriedEntry* t = &d->tried[i];
        int b;
        OM_TRY_DONE(block_of(path, ": tried", s, t->x, t->y, &b));
        s->tried[b] |=
            (uint8_t)((t->grasp ? OM_TRIED_GRASP : 0) | (t->fold_towards ? OM_TRIED_MOVE_ROI : 0) |
                      (t->fold_away ? OM_TRIED_MOVE_AWAY : 0));
    }
    for (int i = 0; i < OM_MAX_ARM; i++) {
        const ArmEntry* e = &d->arm[i];
        const char* name = i == 0 ? ": psm1" : ": psm2";
        OmArmSituation* a = &s->arm[i];
        bool is_somewhere = e->x > 0 || e->y > 0;
        OM_CHECK_DONE(is_somewhere || !e->holds, OM_INVALID,
                      "%s%s: holds needs x and y of the block", path, name);
        if (is_somewhere) OM_TRY_DONE(block_of(path, name, s, e->x, e->y, &a->at));
        if (e->holds) a->in_hand = a->at;
        a->is_closed = e->gripper_closed || e->holds;
        a->is_max_height = e->at_height_limit;
        a->is_max_force = e->above_force_limit;
        a->nlift = e->pulls;
    }
done:
    om_free(d);
    return status;
}

// ---- options -------------------------------------------------------------------------------------------------

// Read every use of an option that names a block.
static OmStatus read_blocks(const OmCliArgs* args, const char* name, OmSituation* s,
                            bool* is_marked) {
    const char* text;
    for (int k = 0; (text = om_cli_get_nth(args, name, k)); k++) {
        int x, y, end = 0, b;
        bool is_pair = sscanf(text, "%d,%d%n", &x, &y, &end) == 2 && text[end] == 0;
        OM_CHECK(is_pair, OM_INVALID, "option %s: \"%s\" is not a block; write it as 3,2", name,
                 text);
        OM_TRY(block_of("option ", name, s, x, y, &b));
        is_marked[b] = true;
    }
    return OM_OK;
}

static OmStatus read_options(const OmCliArgs* args, OmSituation* s) {
    int grid = 5;
    const char* path = om_cli_positional(args, 0);
    if (path) {
        OM_CHECK(!om_cli_get(args, "--grid"), OM_INVALID,
                 "option --grid: the situation file gives the grid");
        OM_TRY(read_file(path, s));
    } else {
        OM_TRY(om_cli_int(args, "--grid", &grid));
        OM_CHECK(
            om_cli_get(args, "--roi"), OM_INVALID,
            "no situation is given: add a file (omentum plan --example prints one) or --roi X,Y");
        om_situation_init(s, grid, 0.12 / grid);
    }
    bool tried[OM_PLAN_MAX_BLOCK] = {false};
    OM_TRY(read_blocks(args, "--roi", s, s->is_above_roi));
    OM_TRY(read_blocks(args, "--attached", s, s->is_fixed));
    OM_TRY(read_blocks(args, "--tried", s, tried));
    for (int b = 0; b < s->n * s->n; b++) s->tried[b] |= tried[b] ? OM_TRIED_GRASP : 0;
    return OM_OK;
}

// ---- output -----------------------------------------------------------------------------------------------------

static OmStatus write_json(const OmPlan* plan, OmStatus outcome, OmText* text) {
    static const char* const cost_name[OM_PLAN_NCOST] = {"grasps",      "hidden",  "roi",
                                                         "attachments", "actions", "order"};
    OmJson j = om_json_begin(text);
    om_json_open(&j, NULL, '{');
    om_json_string(&j, "outcome",
                   outcome == OM_OK      ? "plan"
                   : outcome == OM_UNSAT ? "no plan"
                                         : "time limit");
    om_json_bool(&j, "is_optimal", plan->is_optimal);
    om_json_open(&j, "action", '[');
    for (int i = 0; i < plan->naction; i++) {
        const OmPlanAction* a = &plan->action[i];
        om_json_open(&j, NULL, '{');
        om_json_string(&j, "verb", om_plan_verb_text(a->verb));
        om_json_string(&j, "arm", om_plan_arm_text(a->arm));
        if (a->block >= 0) om_json_integer(&j, "x", a->block % plan->n + 1);
        if (a->block >= 0) om_json_integer(&j, "y", a->block / plan->n + 1);
        om_json_close(&j, '}');
    }
    om_json_close(&j, ']');
    om_json_open(&j, "cost", '{');
    for (int k = 0; k < OM_PLAN_NCOST; k++) om_json_integer(&j, cost_name[k], plan->cost[k]);
    om_json_close(&j, '}');
    om_json_number(&j, "ground_ms", plan->ground_time * 1e3);
    om_json_number(&j, "solve_ms", plan->solve_time * 1e3);
    om_json_close(&j, '}');
    OM_TRY(om_json_end(&j));
    return om_text_append(text, "\n");
}

// Plan and print; the outcome is OM_OK, OM_UNSAT or OM_TIMEOUT.
static OmStatus plan_and_print(const OmCliArgs* args, OmStatus* outcome) {
    OmPlannerDef def = om_planner_default_def();
    OmSituation s;
    OmPlan plan;
    OmPlanner* planner = NULL;
    OmText text = {0};
    OmStatus status = OM_OK;
    int nother = 8;
    double memory_mb = MEMORY_MB;
    def.time_limit = TIME_LIMIT;
    def.program = om_cli_get(args, "--program");
    OM_TRY(om_cli_int(args, "--horizon", &def.horizon));
    OM_TRY(om_cli_int(args, "--max-pulls", &def.max_lift));
    OM_TRY(om_cli_double(args, "--time-limit", &def.time_limit));
    OM_TRY(om_cli_int(args, "--others", &nother));
    OM_TRY(om_cli_double(args, "--memory-limit", &memory_mb));
    OM_TRY(read_options(args, &s));
    if (def.program && om_path_exists(def.program)) {  // clingo would block on a pipe
        FILE* program;
        OM_TRY(om_file_open(def.program, &program, NULL));
        fclose(program);
    }

    // grounding, and a solve that ends by its own limit
    om_cli_guard_alarm(2 * def.time_limit + 0.5);
    OM_TRY_DONE(om_planner_create(&def, &planner));
    OM_TRY_DONE(om_planner_solve(planner, &s, &plan));
    *outcome = status;
    bool is_explained =
        om_cli_get(args, "--why") || (status == OM_UNSAT && !om_cli_get(args, "--json"));
    if (om_cli_get(args, "--json")) {
        OM_TRY_DONE(write_json(&plan, *outcome, &text));
    } else {
        OM_TRY_DONE(om_plan_print(&plan, &text));
    }
    int nsolve = (nother >= 0 ? nother : OM_PLAN_MAX_BLOCK) + 2;
    om_cli_guard_alarm(nsolve * def.time_limit + 0.5);
    if (is_explained) OM_TRY_DONE(om_planner_explain(planner, &s, &plan, nother, &text));
    if (text.str) fputs(text.str, stdout);
done:
    if (status == OM_NO_MEMORY)
        om_error(OM_NO_MEMORY,
                 "the logic program needs more than %g MB: reduce its atoms, or raise "
                 "--memory-limit",
                 memory_mb);
    om_planner_destroy(planner);
    om_text_done(&text);
    return status;
}

static int run_plan(void* ctx) {
    OmStatus outcome = OM_OK, status = plan_and_print(ctx, &outcome);
    if (status < 0) return om_cli_fail("plan", status);
    if (outcome == OM_TIMEOUT) fprintf(stderr, "omentum plan: %s\n", om_error_message());
    return outcome == OM_OK ? OM_EXIT_OK : OM_EXIT_FAILED;
}

int om_cli_plan(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    int npositional;
    OmStatus status = om_cli_check(&args, 1, &npositional);
    if (status < 0) {
        om_cli_fail("plan", status);
        return OM_EXIT_USAGE;
    }
    if (om_cli_get(&args, "--example") || om_cli_get(&args, "--print-program")) {
        fputs(om_cli_get(&args, "--example") ? example : om_planner_program(), stdout);
        return OM_EXIT_OK;
    }
    double memory_mb = MEMORY_MB;
    status = om_cli_double(&args, "--memory-limit", &memory_mb);
    if (status < 0) return om_cli_fail("plan", status);
    OmCliGuard guard = {
        .verb = "plan",
        .run = run_plan,
        .ctx = &args,
        .memory = 1e6 * memory_mb,
        .too_long =
            "the time limit is reached before the logic program is grounded or explained: give it fewer "
            "atoms (an infinite program has no end), or raise --time-limit",
        .died =
            "clingo ended the program: most often a logic program needs more memory than --memory-limit, or "
            "its terms are nested too deep"};
    return om_cli_guard_run(&guard);
}

const OmCliVerb om_cli_verb_plan = {
    .name = "plan",
    .run = om_cli_plan,
    .summary = "plan a retraction for a situation, and explain it",
    .usage = "omentum plan [SITUATION.yaml] [options]",
    .about =
        "Plans with clingo how the arms expose the region of interest in a situation. Exit code 1: no plan\n"
        "exposes the region of interest; the reasons are printed.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum plan --roi 3,3 --attached 3,3 --attached 2,3 --why\n"
               "  omentum plan --example > situation.yaml && omentum plan situation.yaml --why",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
    .has_own_json = true,
};
