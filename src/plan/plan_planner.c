// plan_planner.c: from a situation to a plan.
//
// The program is grounded once for a grid and the blocks each arm can be at. A new situation then only switches
// external atoms, and grounds a distance the first time it is sensed. A new control object is made when the grid
// changes, when an arm is at a block that it could not reach before, when too many old distances are stored, or when an
// exposure is known for the first time.
#include <limits.h>
#include <string.h>

#include "plan/plan_internal.h"

#define COOKIE 0x706c616e
#define HASH_SIZE 8192  // distance atoms, kept below a third full

// ---- slots: positions of the fluents of a situation in planner->fluent ----------------------------------

typedef enum FluentKind {
    FIXED,        // per block
    ABOVE_ROI,    // per block
    REACHABLE,    // per arm and block
    AT,           // per arm and block
    IN_HAND,      // per arm and block
    TRIED,        // per kind of try and block
    CLOSED,       // per arm
    MAX_HEIGHT,   // per arm
    MAX_FORCE,    // per arm
    LIFTED,       // per arm and number of pulls
    EXPOSES,      // per end (none, fold towards, fold away), block and number of pulls
    HIDDEN,       // per block
    FORBIDDEN,    // per block
    VISIBLE_ROI,  // one
    EXPLAIN,      // one
    BOTH_ARMS,    // one
    NFLUENT_KIND
} FluentKind;

static const char* const fluent_name[NFLUENT_KIND] = {
    "fixed",          "above_ROI",   "reachable", "at",       "in_hand", "tried",
    "closed_gripper", "max_height",  "max_force", "lifted",   "exposes", "hidden",
    "forbidden",      "visible_ROI", "explain",   "both_arms"};
static const char* const tried_name[3] = {"grasp", "move_ROI", "move_away"};
static const char* const end_name[3] = {"none", "move_ROI", "move_away"};

// Fluents of a kind; `item` is an arm or a kind of try, `unit` a block or a number of pulls.
static int slot(const OmPlanner* p, FluentKind kind, int item, int unit) {
    int nb = p->n * p->n, nlift = p->def.max_lift + 1, at = 0;
    const int count[NFLUENT_KIND] = {nb,
                                     nb,
                                     OM_MAX_ARM * nb,
                                     OM_MAX_ARM * nb,
                                     OM_MAX_ARM * nb,
                                     3 * nb,
                                     OM_MAX_ARM,
                                     OM_MAX_ARM,
                                     OM_MAX_ARM,
                                     OM_MAX_ARM * nlift,
                                     3 * nb * nlift,
                                     nb,
                                     nb,
                                     1,
                                     1,
                                     1};
    for (int k = 0; k < (int)kind; k++) at += count[k];
    if (kind == NFLUENT_KIND) return at;
    int stride = kind == LIFTED ? nlift : kind == EXPOSES ? nb * nlift : kind < CLOSED ? nb : 1;
    return at + item * stride + unit;
}

static int fluent_count(const OmPlanner* p) { return slot(p, NFLUENT_KIND, 0, 0); }

// ---- symbols -------------------------------------------------------------------------------------------------

const char* const om__plan_arm_name[OM_MAX_ARM] = {"psm1", "psm2"};
const char* const om__plan_verb_name[OM_PLAN_NVERB] = {
#define VERB_NAME(name, text) text,
    OM_PLAN_VERB_TABLE(VERB_NAME)
#undef VERB_NAME
};

OmSymbol om__plan_arm_symbol(int arm) { return om__asp_function(om__plan_arm_name[arm], NULL, 0); }

OmSymbol om__plan_block_symbol(int n, int block) {
    OmSymbol arg[2] = {om__asp_number(block % n + 1), om__asp_number(block / n + 1)};
    return om__asp_function("b", arg, 2);
}

static int block_of_symbol(int n, OmSymbol symbol) {
    const OmSymbol* arg;
    int narg;
    if (strcmp(om__asp_name(symbol, &arg, &narg), "b") != 0 || narg != 2) return -1;
    int ix = om__asp_number_of(arg[0]), iy = om__asp_number_of(arg[1]);
    if (ix < 1 || ix > n || iy < 1 || iy > n) return -1;
    return (iy - 1) * n + ix - 1;
}

static int index_of_name(OmSymbol symbol, const char* const* name, int count) {
    const OmSymbol* arg;
    int narg;
    const char* s = om__asp_name(symbol, &arg, &narg);
    for (int i = 0; i < count; i++) {
        if (strcmp(s, name[i]) == 0) return i;
    }
    return -1;
}

// The atom of a fluent in the program's notation.
static OmSymbol fluent_symbol(const OmPlanner* p, FluentKind kind, int item, int unit) {
    OmSymbol zero = om__asp_number(0), arg[3];
    int narg = 0;
    switch (kind) {
    case FIXED:
    case ABOVE_ROI:
        arg[narg++] = om__plan_block_symbol(p->n, unit);
        arg[narg++] = zero;
        break;
    case REACHABLE:
    case AT:
    case IN_HAND:
        arg[narg++] = om__plan_arm_symbol(item);
        arg[narg++] = om__plan_block_symbol(p->n, unit);
        arg[narg++] = zero;
        break;
    case TRIED:
        arg[narg++] = om__asp_function(tried_name[item], NULL, 0);
        arg[narg++] = om__plan_block_symbol(p->n, unit);
        break;
    case CLOSED:
    case MAX_HEIGHT:
    case MAX_FORCE:
        arg[narg++] = om__plan_arm_symbol(item);
        arg[narg++] = zero;
        break;
    case EXPOSES:
        arg[narg++] = om__plan_block_symbol(p->n, unit / (p->def.max_lift + 1));
        arg[narg++] = om__asp_number(unit % (p->def.max_lift + 1));
        arg[narg++] = om__asp_function(end_name[item], NULL, 0);
        break;
    case HIDDEN:
    case FORBIDDEN: arg[narg++] = om__plan_block_symbol(p->n, unit); break;
    case LIFTED:
        arg[narg++] = om__plan_arm_symbol(item);
        arg[narg++] = om__asp_number(unit);
        arg[narg++] = zero;
        break;
    case VISIBLE_ROI: arg[narg++] = zero; break;
    default: break;
    }
    return om__asp_function(fluent_name[kind], arg, narg);
}

// ---- grounding ------------------------------------------------------------------------------------------------

// The arms that may be at a block: arms that reach it or are there, and at least the arm on its side.
static void pairs_of(const OmSituation* s, uint8_t* pair) {
    for (int b = 0; b < s->n * s->n; b++) {
        pair[b] = s->reachable[b] & ((1 << OM_MAX_ARM) - 1);
        for (int i = 0; i < OM_MAX_ARM; i++) {
            bool is_there = s->arm[i].at == b || s->arm[i].in_hand == b;
            if (is_there) pair[b] |= (uint8_t)(1 << i);
        }
        if (pair[b] == 0) pair[b] = 2 * (b / s->n) <= s->n - 1 ? 1 : 2;
    }
}

static uint64_t hash_centers(const OmSituation* s) {
    uint64_t h = om_hash(&s->n, sizeof s->n, OM_HASH_SEED);
    for (int b = 0; b < s->n * s->n; b++) {
        OmVec3 c = om__situation_center(s, b);
        h = om_hash(&c, sizeof c, h);
    }
    return h;
}

// Add pair/2 and, on request, metric/3 as facts.
static OmStatus write_facts(const OmPlanner* p, const OmSituation* s, OmText* text) {
    int n = p->n;
    for (int b = 0; b < n * n; b++) {
        for (int i = 0; i < OM_MAX_ARM; i++) {
            if (!(p->pair[b] >> i & 1)) continue;
            OM_TRY(om_text_append(text, "pair(%s,b(%d,%d)).", om__plan_arm_name[i], b % n + 1,
                                  b / n + 1));
        }
    }
    if (!p->def.has_all_distances) return OM_OK;
    bool mark[OM_PLAN_MAX_BLOCK] = {false};
    for (int b = 0; b < n * n; b++) {
        mark[b] = true;
        for (int c = 0; c < n * n; c++) {
            OM_TRY(om_text_append(text, "metric(b(%d,%d),b(%d,%d),%d).", c % n + 1, c / n + 1,
                                  b % n + 1, b / n + 1, om__situation_distance(s, c, mark)));
        }
        mark[b] = false;
    }
    return OM_OK;
}

// Literals of all fluents of the new ground program.
static OmStatus find_fluents(OmPlanner* p) {
    int nb = p->n * p->n, nlift = p->def.max_lift + 1;
    const struct {
        FluentKind kind;
        int nitem, first, nunit;
    } range[] = {{FIXED, 1, 0, nb},
                 {ABOVE_ROI, 1, 0, nb},
                 {REACHABLE, OM_MAX_ARM, 0, nb},
                 {AT, OM_MAX_ARM, 0, nb},
                 {IN_HAND, OM_MAX_ARM, 0, nb},
                 {TRIED, 3, 0, nb},
                 {CLOSED, OM_MAX_ARM, 0, 1},
                 {MAX_HEIGHT, OM_MAX_ARM, 0, 1},
                 {MAX_FORCE, OM_MAX_ARM, 0, 1},
                 {LIFTED, OM_MAX_ARM, 1, nlift},
                 {EXPOSES, 3, 0, nb * nlift},
                 {HIDDEN, 1, 0, nb},
                 {FORBIDDEN, 1, 0, nb},
                 {VISIBLE_ROI, 1, 0, 1},
                 {EXPLAIN, 1, 0, 1},
                 {BOTH_ARMS, 1, 0, 1}};
    for (size_t r = 0; r < sizeof range / sizeof range[0]; r++) {
        for (int item = 0; item < range[r].nitem; item++) {
            for (int unit = range[r].first; unit < range[r].nunit; unit++) {
                OmFluent* f = &p->fluent[slot(p, range[r].kind, item, unit)];
                OmSymbol atom = fluent_symbol(p, range[r].kind, item, unit);
                if (!atom) return OM_NO_MEMORY;
                OM_TRY(om__asp_find_external(p->asp, atom, &f->literal));
            }
        }
    }
    return OM_OK;
}

// distance(B1,B2,X,0) of all pairs, if the program has these as external atoms: all are true.
static OmStatus sense_all_distances(const OmPlanner* p, const OmSituation* s) {
    OmSymbol arg[4];
    bool mark[OM_PLAN_MAX_BLOCK] = {false};
    arg[3] = om__asp_number(0);
    for (int b = 0; b < p->n * p->n; b++) {
        mark[b] = true;
        for (int c = 0; c < p->n * p->n; c++) {
            int32_t literal;
            arg[0] = om__plan_block_symbol(p->n, c);
            arg[1] = om__plan_block_symbol(p->n, b);
            arg[2] = om__asp_number(om__situation_distance(s, c, mark));
            OmSymbol atom = om__asp_function("distance", arg, 4);
            if (!arg[0] || !arg[1] || !atom) return OM_NO_MEMORY;
            OM_TRY(om__asp_find_external(p->asp, atom, &literal));
            if (literal) OM_TRY(om__asp_assign(p->asp, literal, true));
        }
        mark[b] = false;
    }
    return OM_OK;
}

static void forget_ground(OmPlanner* p) {
    om__asp_destroy(p->asp);
    p->asp = NULL;
    om_free(p->fluent);
    p->fluent = NULL;
    p->ndistance = 0;
    for (int i = 0; i < HASH_SIZE; i++) p->distance_hash[i] = -1;
}

static bool is_any_known(const OmSituation* s) {
    for (int b = 0; b < s->n * s->n; b++)
        if (s->exposure[b].is_known) return true;
    return false;
}

// Make a new control object with the program grounded for this situation.
static OmStatus ground(OmPlanner* p, const OmSituation* s) {
    OmStatus status = OM_OK;
    OmText facts = {0};
    char n[32], horizon[32], max_lift[32], seed[32], limit[32];
    forget_ground(p);
    p->n = s->n;
    pairs_of(s, p->pair);
    p->metric_hash = hash_centers(s);

    snprintf(n, sizeof n, "n=%d", p->n);
    snprintf(horizon, sizeof horizon, "horizon=%d", p->def.horizon);
    snprintf(max_lift, sizeof max_lift, "max_lift=%d", p->def.max_lift);
    snprintf(seed, sizeof seed, "--seed=%u", p->def.seed);
    snprintf(limit, sizeof limit, "--solve-limit=%d",
             p->def.conflict_limit > 0 ? p->def.conflict_limit : INT_MAX);
    p->has_exposure = p->has_exposure || is_any_known(s);
    const char* arg[] = {"-c",
                         n,
                         "-c",
                         horizon,
                         "-c",
                         max_lift,
                         "-c",
                         p->has_exposure ? "known=1" : "known=0",
                         seed,
                         limit,
                         "--opt-strategy=usc"};
    OM_TRY_DONE(om__asp_create(arg, (int)(sizeof arg / sizeof arg[0]), &p->asp));

    OM_TRY_DONE(write_facts(p, s, &facts));
    if (p->program_path) {
        OM_TRY_DONE(om__asp_load(p->asp, p->program_path));
    } else {
        OM_TRY_DONE(om__asp_add(p->asp, om__plan_program));
    }
    OM_TRY_DONE(om__asp_add(p->asp, facts.str));
    OM_TRY_DONE(om__asp_ground(p->asp, &(OmAspPart){"base", NULL, 0}, 1));
    OM_CALLOC_DONE(p->fluent, fluent_count(p));
    OM_TRY_DONE(find_fluents(p));
    if (p->def.has_all_distances) OM_TRY_DONE(sense_all_distances(p, s));
done:
    om_text_done(&facts);
    if (status < 0) forget_ground(p);
    return status;
}

// Does the ground program have every atom that this situation may need?
static bool is_grounded_for(const OmPlanner* p, const OmSituation* s) {
    if (!p->asp || p->n != s->n || p->ndistance > 6 * s->n * s->n + 64) return false;
    if (!p->has_exposure && is_any_known(s)) return false;
    if (p->def.has_all_distances && p->metric_hash != hash_centers(s)) return false;
    uint8_t pair[OM_PLAN_MAX_BLOCK];
    pairs_of(s, pair);
    for (int b = 0; b < s->n * s->n; b++) {
        if (pair[b] & ~p->pair[b]) return false;
    }
    return true;
}

// ---- distances: distance(block, roi or attachments, x, 0) -------------------------------------------------------

static const char* const to_name[2] = {"roi", "attachments"};

// Index of a distance atom, -1 if it is new; *at is its position in the hash table.
static int find_distance(const OmPlanner* p, int block, int to, int x, int* at) {
    const int key[4] = {block, to, x, 0};
    uint64_t h = om_hash(key, sizeof key, OM_HASH_SEED);
    for (*at = (int)(h % HASH_SIZE); p->distance_hash[*at] >= 0; *at = (*at + 1) % HASH_SIZE) {
        int i = p->distance_hash[*at];
        const OmDistanceFluent* d = &p->distance[i];
        if (d->block == block && d->to == to && d->x == x) return i;
    }
    return -1;
}

static OmStatus distance_symbol(const OmPlanner* p, const OmDistanceFluent* d, OmSymbol arg[4],
                                OmSymbol* atom) {
    arg[0] = om__plan_block_symbol(p->n, d->block);
    arg[1] = om__asp_function(to_name[d->to], NULL, 0);
    arg[2] = om__asp_number(d->x);
    arg[3] = om__asp_number(0);
    *atom = om__asp_function("distance", arg, 4);
    return arg[0] && arg[1] && *atom ? OM_OK : OM_NO_MEMORY;
}

// Add the new distances of this situation to the list; `value` is true for the current ones.
static void list_distances(OmPlanner* p, const OmSituation* s, bool* want) {
    for (int b = 0; b < s->n * s->n; b++) {
        for (int to = 0; to < 2; to++) {
            int x = om__situation_distance(s, b, to == 0 ? s->is_above_roi : s->is_fixed), at;
            if (x < 0) continue;
            int i = find_distance(p, b, to, x, &at);
            if (i < 0) {
                i = p->ndistance++;
                p->distance_hash[at] = i;
                p->distance[i] = (OmDistanceFluent){b, to, x, {0, false}};
            }
            want[i] = true;
        }
    }
}

// Ground the new distances and set all of them.
static OmStatus sense_distances(OmPlanner* p, const OmSituation* s) {
    OmStatus status = OM_OK;
    int first = p->ndistance;
    bool* want = om_calloc((size_t)p->distance_cap, sizeof *want);
    OmAspPart* part = NULL;
    OmSymbol* arg = NULL;
    OM_CHECK_DONE(want, OM_NO_MEMORY, "%s", om_error_message());
    list_distances(p, s, want);

    int nnew = p->ndistance - first;
    OM_ALLOC_DONE(part, nnew);
    OM_ALLOC_DONE(arg, 4 * nnew);
    OmSymbol atom;
    for (int i = 0; i < nnew; i++) {
        OM_TRY_DONE(distance_symbol(p, &p->distance[first + i], &arg[4 * i], &atom));
        part[i] = (OmAspPart){"sensed_distance", &arg[4 * i], 3};
    }
    if (nnew > 0) OM_TRY_DONE(om__asp_ground(p->asp, part, nnew));
    for (int i = 0; i < p->ndistance; i++) {
        OmDistanceFluent* d = &p->distance[i];
        if (i >= first) {
            OM_TRY_DONE(distance_symbol(p, d, arg, &atom));
            OM_TRY_DONE(om__asp_find_external(p->asp, atom, &d->fluent.literal));
        }
        if (d->fluent.value == want[i] || d->fluent.literal == 0) continue;
        OM_TRY_DONE(om__asp_assign(p->asp, d->fluent.literal, want[i]));
        d->fluent.value = want[i];
    }
done:
    om_free(want);
    om_free(part);
    om_free(arg);
    return status;
}

// ---- sensing: the situation into external atoms --------------------------------------------------------------------

static void write_exposure(const OmPlanner* p, const OmSituation* s, bool* want) {
    for (int b = 0; b < s->n * s->n; b++) {
        const OmExposure* e = &s->exposure[b];
        if (!e->is_known) continue;
        if (!e->exposes) {
            want[slot(p, HIDDEN, 0, b)] = true;
            continue;
        }
        int npull = e->npull < p->def.max_lift ? e->npull : p->def.max_lift;
        int end = e->fold == OM_PLAN_MOVE_ROI ? 1 : e->fold == OM_PLAN_MOVE_AWAY ? 2 : 0;
        want[slot(p, EXPOSES, end, b * (p->def.max_lift + 1) + npull)] = true;
    }
}

// Compute the value of every fluent (Alg. 4).
static void write_fluents(const OmPlanner* p, const OmSituation* s, bool is_explaining,
                          bool* want) {
    for (int b = 0; b < s->n * s->n; b++) {
        want[slot(p, FIXED, 0, b)] = s->is_fixed[b];
        want[slot(p, FORBIDDEN, 0, b)] = s->is_forbidden[b];
        want[slot(p, ABOVE_ROI, 0, b)] = s->is_above_roi[b];
        for (int i = 0; i < OM_MAX_ARM; i++)
            want[slot(p, REACHABLE, i, b)] = s->reachable[b] >> i & 1;
        for (int k = 0; k < 3; k++) want[slot(p, TRIED, k, b)] = s->tried[b] >> k & 1;
    }
    for (int i = 0; i < OM_MAX_ARM; i++) {
        const OmArmSituation* a = &s->arm[i];
        int at = a->at >= 0 ? a->at : a->in_hand;
        if (at >= 0) want[slot(p, AT, i, at)] = true;
        if (a->in_hand >= 0) want[slot(p, IN_HAND, i, a->in_hand)] = true;
        want[slot(p, CLOSED, i, 0)] = a->is_closed || a->in_hand >= 0;
        want[slot(p, MAX_HEIGHT, i, 0)] = a->is_max_height;
        want[slot(p, MAX_FORCE, i, 0)] = a->is_max_force;
        // the sensed limit decides, not the number of pulls: one more pull may reach it
        int nlift = a->nlift < p->def.max_lift ? a->nlift : p->def.max_lift - 1;
        if (nlift > 0) want[slot(p, LIFTED, i, nlift)] = true;
    }
    write_exposure(p, s, want);
    want[slot(p, VISIBLE_ROI, 0, 0)] = s->is_visible;
    want[slot(p, EXPLAIN, 0, 0)] = is_explaining;
    want[slot(p, BOTH_ARMS, 0, 0)] = p->def.has_both_arms;
}

OmStatus om__planner_sense(OmPlanner* p, const OmSituation* s, bool is_explaining,
                           bool* is_reground) {
    *is_reground = !is_grounded_for(p, s);
    if (*is_reground) OM_TRY(ground(p, s));
    int nfluent = fluent_count(p);
    OmStatus status = OM_OK;
    bool* want = om_calloc((size_t)nfluent, sizeof *want);
    if (!want) return OM_NO_MEMORY;
    write_fluents(p, s, is_explaining, want);
    for (int i = 0; i < nfluent; i++) {
        OmFluent* f = &p->fluent[i];
        if (f->value == want[i]) continue;
        int kind = 0;
        while (kind + 1 < NFLUENT_KIND && slot(p, (FluentKind)(kind + 1), 0, 0) <= i) kind++;
        // a user's program need not have the facts of the simulation
        if (!f->literal && (kind == EXPOSES || kind == HIDDEN)) continue;
        OM_CHECK_DONE(
            f->literal, OM_INVALID,
            "the logic program has no external atom %s for a sensed fluent; declare it as "
            "asp/tissue_retraction.lp does",
            fluent_name[kind]);
        OM_TRY_DONE(om__asp_assign(p->asp, f->literal, want[i]));
        f->value = want[i];
    }
    OM_TRY_DONE(sense_distances(p, s));
done:
    om_free(want);
    if (status < 0) forget_ground(p);  // only a part of the atoms is set
    return status;
}

// ---- solving ----------------------------------------------------------------------------------------------------

// Parse reach(psm1,b(3,2),0) and similar atoms; false for other shown atoms.
static bool read_action(int n, OmSymbol symbol, OmPlanAction* a) {
    const OmSymbol* arg;
    int narg, verb = index_of_name(symbol, om__plan_verb_name, OM_PLAN_NVERB);
    (void)om__asp_name(symbol, &arg, &narg);
    if (verb < 0 || narg != (verb == OM_PLAN_RELEASE ? 2 : 3)) return false;
    a->verb = (OmPlanVerb)verb;
    a->arm = index_of_name(arg[0], om__plan_arm_name, OM_MAX_ARM);
    a->block = narg == 3 ? block_of_symbol(n, arg[1]) : -1;
    a->time = om__asp_number_of(arg[narg - 1]);
    return a->arm >= 0 && a->time >= 0;
}

static void read_plan(const OmPlanner* p, OmPlan* plan) {
    const OmAspAnswer* answer = &p->answer;
    for (int i = 0; i < answer->nsymbol && plan->naction < OM_PLAN_MAX_HORIZON; i++) {
        OmPlanAction a;
        if (!read_action(p->n, answer->symbol[i], &a)) continue;
        int at = plan->naction++;  // insert by time
        for (; at > 0 && plan->action[at - 1].time > a.time; at--)
            plan->action[at] = plan->action[at - 1];
        plan->action[at] = a;
        if (a.verb == OM_PLAN_GRASP) {
            plan->grasp_block = a.block;
            plan->grasp_arm = a.arm;
        }
    }
    // levels of the program: broken rules, grasps, hidden, roi, attachments, actions, order
    bool has_all = answer->ncost == OM_PLAN_NCOST + 1;
    for (int k = 0; k < OM_PLAN_NCOST && has_all; k++) plan->cost[k] = answer->cost[k + 1];
}

OmStatus om__planner_search(OmPlanner* p, const OmSituation* s, const int32_t* assume, int nassume,
                            OmPlan* plan) {
    memset(plan, 0, sizeof *plan);
    plan->n = s->n;
    plan->grasp_block = plan->grasp_arm = -1;
    OmStatus status = om__asp_solve(p->asp, assume, nassume, p->def.time_limit, &p->answer);
    if (status < 0) return status;
    if (p->answer.has_model) read_plan(p, plan);
    plan->is_optimal = p->answer.has_model && p->answer.is_final;
    plan->outcome = status == OM_OK && !p->answer.has_model ? OM_UNSAT : status;
    return plan->outcome;
}

// ---- public -------------------------------------------------------------------------------------------------------

OmPlannerDef om_planner_default_def(void) {
    return (OmPlannerDef){
        .cookie = COOKIE, .horizon = 12, .max_lift = 5, .seed = 1, .conflict_limit = 100000};
}

OmStatus om_planner_create(const OmPlannerDef* def, OmPlanner** out) {
    *out = NULL;
    OM_CHECK(def && def->cookie == COOKIE, OM_INVALID,
             "planner: def must come from om_planner_default_def");
    OM_CHECK(def->horizon >= 1 && def->horizon <= OM_PLAN_MAX_HORIZON, OM_INVALID,
             "planner: horizon is %d; it must be 1 to %d", def->horizon, OM_PLAN_MAX_HORIZON);
    OM_CHECK(def->max_lift >= 1 && def->max_lift <= OM_PLAN_MAX_HORIZON, OM_INVALID,
             "planner: max_lift is %d; it must be 1 to %d", def->max_lift, OM_PLAN_MAX_HORIZON);
    OM_CHECK(def->conflict_limit >= 0, OM_INVALID, "planner: conflict_limit is %d; 0 or more",
             def->conflict_limit);
    OM_CHECK(!def->program || om_path_exists(def->program), OM_IO, "%s: no such logic program",
             def->program);
    OmStatus status = OM_OK;
    OmPlanner* p = om_calloc(1, sizeof *p);
    if (!p) return OM_NO_MEMORY;
    p->def = *def;
    p->distance_cap = 8 * OM_PLAN_MAX_BLOCK + 64;  // 6 n^2 + 64 known and 2 n^2 new
    OM_ALLOC_DONE(p->distance, p->distance_cap);
    OM_ALLOC_DONE(p->distance_hash, HASH_SIZE);
    if (def->program) {
        size_t size = strlen(def->program) + 1;
        OM_ALLOC_DONE(p->program_path, size);
        memcpy(p->program_path, def->program, size);
        p->def.program = p->program_path;
    }
    // check on the smallest tissue that the program parses and grounds
    OmSituation smallest;
    om_situation_init(&smallest, 1, 0.01);
    OM_TRY_DONE(ground(p, &smallest));
    *out = p;
done:
    if (status < 0) om_planner_destroy(p);
    return status;
}

void om_planner_destroy(OmPlanner* p) {
    if (!p) return;
    om__asp_destroy(p->asp);
    om_free(p->fluent);
    om_free(p->distance);
    om_free(p->distance_hash);
    om_free(p->program_path);
    om_free(p);
}

bool om_planner_has_both_arms(const OmPlanner* p) { return p->def.has_both_arms; }

OmStatus om_planner_solve(OmPlanner* p, const OmSituation* s, OmPlan* plan) {
    memset(plan, 0, sizeof *plan);
    plan->grasp_block = plan->grasp_arm = -1;
    OM_TRY(om__situation_check(s));
    bool is_reground;
    double start = om_clock_now();
    OM_TRY(om__planner_sense(p, s, false, &is_reground));
    double sensed = om_clock_now();
    OmStatus status = om__planner_search(p, s, NULL, 0, plan);
    plan->is_reground = is_reground;
    plan->ground_time = sensed - start;
    plan->solve_time = om_clock_now() - sensed;
    if (status == OM_UNSAT) {
        return om_error(OM_UNSAT,
                        "no plan of up to %d steps exposes the region of interest from here",
                        p->def.horizon);
    }
    return status == OM_TIMEOUT
               ? om_error(OM_TIMEOUT, "planning took more than %d conflicts, or %g s",
                          p->def.conflict_limit, p->def.time_limit)
               : status;
}

const char* om_planner_program(void) { return om__plan_program; }
