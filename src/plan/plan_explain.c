// plan_explain.c: why this plan: solve the program again with alternatives.
//
// The external atom `explain` allows the program to break rules, as few as possible. Each alternative is assumed
// and the program solved again. If the answer breaks no rule, its cost shows in which objective the alternative
// is worse. If it does, the broken rules are the reason, in the words of the program (rule/2). All reasons come
// from the program.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "plan/plan_internal.h"

#define MAX_RULE 64

typedef struct Rules {  // rule(name, "text") of the program
    int count;
    const char* name[MAX_RULE];
    const char* text[MAX_RULE];
} Rules;

typedef enum Verdict { BEST, WORSE, FORBIDDEN, IMPOSSIBLE } Verdict;

typedef struct Alternative {
    Verdict verdict;
    uint64_t broken;  // bit i: rule i forbids it
    OmPlan plan;      // the best plan with the alternative, breaking those rules
} Alternative;

static OmStatus list_rules(OmPlanner* p, Rules* r) {
    OmSymbol atom[MAX_RULE];
    const OmSymbol* arg;
    int narg, count;
    OM_TRY(om__asp_list(p->asp, "rule", 2, atom, MAX_RULE, &count));
    OM_CHECK(count <= MAX_RULE, OM_INVALID, "the logic program has %d rules by name; at most %d",
             count, MAX_RULE);
    r->count = count;
    for (int i = 0; i < count; i++) {
        (void)om__asp_name(atom[i], &arg, &narg);
        const OmSymbol* none;
        int nnone;
        const char* text = om__asp_text_of(arg[1]);
        r->name[i] = om__asp_name(arg[0], &none, &nnone);
        r->text[i] = text ? text : r->name[i];
    }
    return OM_OK;
}

// Solve with an atom assumed, and compare with the plan.
static OmStatus ask(OmPlanner* p, const OmSituation* s, const Rules* r, OmSymbol atom,
                    const OmPlan* plan, Alternative* out) {
    memset(out, 0, sizeof *out);
    if (!atom) return OM_NO_MEMORY;
    int32_t literal;
    OM_TRY(om__asp_find(p->asp, atom, &literal));
    out->verdict = IMPOSSIBLE;
    if (literal == 0) return OM_OK;
    OmStatus status = om__planner_search(p, s, &literal, 1, &out->plan);
    if (status == OM_UNSAT) return OM_OK;
    if (status != OM_OK) return status;
    for (int i = 0; i < p->answer.nsymbol; i++) {
        const OmSymbol *arg, *none;
        int narg, nnone;
        const char* name = om__asp_name(p->answer.symbol[i], &arg, &narg);
        if (strcmp(name, "broken") != 0 || narg != 1) continue;
        name = om__asp_name(arg[0], &none, &nnone);
        for (int k = 0; k < r->count; k++) {
            if (strcmp(name, r->name[k]) == 0) out->broken |= 1ull << k;
        }
    }
    bool is_same = memcmp(plan->cost, out->plan.cost, sizeof plan->cost) == 0 && plan->is_optimal;
    out->verdict = out->broken ? FORBIDDEN : is_same ? BEST : WORSE;
    return OM_OK;
}

// ---- sentences ------------------------------------------------------------------------------------------------

static OmStatus write_rules(const Rules* r, uint64_t broken, OmText* t) {
    const char* sep = "";
    for (int k = 0; k < r->count; k++) {
        if (!(broken >> k & 1)) continue;
        OM_TRY(om_text_append(t, "%s%s", sep, r->text[k]));
        sep = "; and ";
    }
    return OM_OK;
}

// The first objective in which the alternative is worse.
static OmStatus write_difference(const OmPlan* plan, const OmPlan* other, OmText* t) {
    int k = 0;
    while (k < OM_PLAN_NCOST - 1 && plan->cost[k] == other->cost[k]) k++;
    double worse = (double)(other->cost[k] - plan->cost[k]);
    switch (k) {
    case 0:
        return om_text_append(
            t, "it needs a new grasp, whereas the plan continues with the tissue in hand");
    case 1:
        return om_text_append(t,
                              "trying it in the simulation did not expose the region of interest");
    case 2:
        return om_text_append(t, "it is %.1f mm farther from the region of interest", worse / 10);
    case 3:
        return om_text_append(
            t, "it is as near to the region of interest but %.1f mm nearer to the attachments",
            worse / 10);
    case 4:
        return om_text_append(t, "the place is equally good, but it takes %.0f more action%s",
                              worse, worse == 1.0 ? "" : "s");
    default:
        return om_text_append(
            t, "it is equally good; the choice between equals follows a fixed order");
    }
}

static OmStatus write_alternative(const Rules* r, const OmPlan* plan, const Alternative* a,
                                  OmText* t) {
    switch (a->verdict) {
    case BEST: return om_text_append(t, "is the plan");
    case WORSE:
        OM_TRY(om_text_append(t, "allowed, but "));
        return write_difference(plan, &a->plan, t);
    case FORBIDDEN: OM_TRY(om_text_append(t, "forbidden: ")); return write_rules(r, a->broken, t);
    default: return om_text_append(t, "no action of the program achieves it");
    }
}

static OmStatus write_block(const OmSituation* s, int b, OmText* t) {
    return om_text_append(t, "(%d,%d)", b % s->n + 1, b / s->n + 1);
}

// "under (3,2), (4,2)": the first blocks of a set, then how many more.
static OmStatus write_set(const OmSituation* s, const bool* mark, OmText* t) {
    int count = 0;
    for (int b = 0; b < s->n * s->n; b++) {
        if (!mark[b] || ++count > 12) continue;
        OM_TRY(om_text_append(t, "%s", count > 1 ? ", " : ""));
        OM_TRY(write_block(s, b, t));
    }
    if (count == 0) return om_text_append(t, "none");
    return count > 12 ? om_text_append(t, " and %d more", count - 12) : OM_OK;
}

// What the simulation showed, of the blocks that were tried in it.
static OmStatus write_exposures(const OmSituation* s, OmText* t) {
    bool exposes[OM_PLAN_MAX_BLOCK], hides[OM_PLAN_MAX_BLOCK], is_any = false;
    for (int b = 0; b < s->n * s->n; b++) {
        const OmExposure* e = &s->exposure[b];
        exposes[b] = e->is_known && e->exposes;
        hides[b] = e->is_known && !e->exposes;
        is_any = is_any || e->is_known;
    }
    if (!is_any) return OM_OK;
    OM_TRY(om_text_append(t, ".\n  Exposes the region in the simulation: "));
    OM_TRY(write_set(s, exposes, t));
    OM_TRY(om_text_append(t, ".\n  Tried in the simulation in vain: "));
    return write_set(s, hides, t);
}

// Describe the fluents that are true.
static OmStatus write_fluents(const OmSituation* s, OmText* t) {
    bool tried[OM_PLAN_MAX_BLOCK];
    for (int b = 0; b < s->n * s->n; b++) tried[b] = s->tried[b] & OM_TRIED_GRASP;
    OM_TRY(om_text_append(t, "Sensed: the region of interest is %s; it lies under ",
                          s->is_visible ? "visible" : "hidden"));
    OM_TRY(write_set(s, s->is_above_roi, t));
    OM_TRY(om_text_append(t, ".\n  Above attachment points: "));
    OM_TRY(write_set(s, s->is_fixed, t));
    OM_TRY(om_text_append(t, ".\n  Grasped before in vain: "));
    OM_TRY(write_set(s, tried, t));
    bool is_any = false;
    for (int b = 0; b < s->n * s->n; b++) is_any = is_any || s->is_forbidden[b];
    if (is_any) {
        OM_TRY(om_text_append(t, ".\n  Forbidden by a person: "));
        OM_TRY(write_set(s, s->is_forbidden, t));
    }
    OM_TRY(write_exposures(s, t));
    for (int i = 0; i < OM_MAX_ARM; i++) {
        const OmArmSituation* a = &s->arm[i];
        OM_TRY(om_text_append(t, ".\n  PSM%d: ", i + 1));
        if (a->in_hand >= 0) {
            OM_TRY(om_text_append(t, "holds "));
            OM_TRY(write_block(s, a->in_hand, t));
        } else {
            OM_TRY(
                om_text_append(t, "holds nothing, gripper %s", a->is_closed ? "closed" : "open"));
        }
        if (a->is_max_height) OM_TRY(om_text_append(t, ", at its height limit"));
        if (a->is_max_force) OM_TRY(om_text_append(t, ", above the force limit"));
    }
    return om_text_append(t, ".\n");
}

// What trying the chosen block in the simulation showed.
static OmStatus write_choice_exposure(const OmExposure* e, OmText* t) {
    if (!e->is_known) return OM_OK;
    if (!e->exposes)
        return om_text_append(t, "Trying it in the simulation did not expose the region of "
                                 "interest; no point that may expose it is allowed.\n");
    return om_text_append(t, "In the simulation %d pull%s%s exposed the region of interest.\n",
                          e->npull, e->npull == 1 ? "" : "s",
                          e->fold == OM_PLAN_MOVE_AWAY  ? " and a fold away from the camera"
                          : e->fold == OM_PLAN_MOVE_ROI ? " and a fold towards it"
                                                        : "");
}

static OmStatus write_choice(const OmSituation* s, const OmPlan* plan, OmText* t) {
    if (s->is_visible)
        return om_text_append(t, "The region of interest is visible: nothing is to be done.\n");
    if (plan->outcome == OM_UNSAT)
        return om_text_append(t, "No plan exposes the region of interest.\n");
    if (plan->naction == 0) return om_text_append(t, "No plan was found in the time given.\n");
    OM_TRY(om_text_append(
        t, "The plan has %d action%s%s.\n", plan->naction, plan->naction == 1 ? "" : "s",
        plan->is_optimal ? ", and no better plan exists" : "; a better one may exist"));
    if (plan->grasp_block < 0) return om_text_append(t, "It continues with the tissue in hand.\n");
    OM_TRY(om_text_append(t, "It grasps "));
    OM_TRY(write_block(s, plan->grasp_block, t));
    OM_TRY(om_text_append(
        t, " with PSM%d, the allowed point nearest to the region of interest (%.1f mm)",
        plan->grasp_arm + 1, (double)plan->cost[2] / 10));
    if (plan->cost[3] != 0)
        OM_TRY(om_text_append(t, " and, among those, farthest from the attachments (%.1f mm)",
                              (double)-plan->cost[3] / 10));
    OM_TRY(om_text_append(t, ".\n"));
    return write_choice_exposure(&s->exposure[plan->grasp_block], t);
}

// ---- questions --------------------------------------------------------------------------------------------------

// Alternatives for the first action with tissue in hand.
static OmStatus explain_first(OmPlanner* p, const OmSituation* s, const Rules* r,
                              const OmPlan* plan, OmText* t) {
    static const OmPlanVerb verb[4] = {OM_PLAN_PULL, OM_PLAN_MOVE_AWAY, OM_PLAN_MOVE_ROI,
                                       OM_PLAN_RELEASE};
    static const char* const words[4] = {"to pull", "to fold away from the camera",
                                         "to fold towards the region of interest",
                                         "to open the gripper"};
    for (int i = 0; i < OM_MAX_ARM; i++) {
        if (s->arm[i].in_hand < 0) continue;
        OM_TRY(om_text_append(t, "Other first actions of PSM%d\n", i + 1));
        for (int k = 0; k < 4; k++) {
            OmSymbol arg[3] = {om__asp_function(om__plan_verb_name[verb[k]], NULL, 0),
                               om__plan_arm_symbol(i), om__asp_number(0)};
            Alternative a;
            OmStatus status = ask(p, s, r, om__asp_function("do", arg, 3), plan, &a);
            if (status != OM_OK) return status;
            OM_TRY(om_text_append(t, "  %s: ", words[k]));
            OM_TRY(write_alternative(r, plan, &a, t));
            OM_TRY(om_text_append(t, ".\n"));
        }
    }
    return OM_OK;
}

typedef struct Near {
    int block, distance;
} Near;

static int compare_near(const void* a, const void* b) {
    const Near *x = a, *y = b;
    if (x->distance != y->distance) return x->distance < y->distance ? -1 : 1;
    return (x->block > y->block) - (x->block < y->block);
}

// Other grasping points one by one, the nearest to the ROI first.
static OmStatus explain_blocks(OmPlanner* p, const OmSituation* s, const Rules* r,
                               const OmPlan* plan, int nother, OmText* t) {
    int nblock = s->n * s->n, said = 0;
    Near near[OM_PLAN_MAX_BLOCK];
    for (int b = 0; b < nblock; b++)
        near[b] = (Near){b, om__situation_distance(s, b, s->is_above_roi)};
    qsort(near, (size_t)nblock, sizeof near[0], compare_near);
    OM_TRY(
        om_text_append(t, "Other grasping points, the nearest to the region of interest first:\n"));
    for (int i = 0; i < nblock && (nother < 0 || said < nother); i++) {
        if (near[i].block == plan->grasp_block) continue;
        OmSymbol block = om__plan_block_symbol(s->n, near[i].block);
        Alternative a;
        OmStatus status = ask(p, s, r, om__asp_function("chosen", &block, 1), plan, &a);
        if (status != OM_OK) return status;
        OM_TRY(om_text_append(t, "  "));
        OM_TRY(write_block(s, near[i].block, t));
        OM_TRY(om_text_append(t, ": "));
        OM_TRY(write_alternative(r, plan, &a, t));
        OM_TRY(om_text_append(t, ".\n"));
        said++;
    }
    return nblock - 1 > said
               ? om_text_append(t, "  (%d more were not examined)\n", nblock - 1 - said)
               : OM_OK;
}

// No plan exists: list the blocks by the rule that forbids them.
static OmStatus explain_unsat(OmPlanner* p, const OmSituation* s, const Rules* r,
                              const OmPlan* plan, OmText* t) {
    uint64_t broken[OM_PLAN_MAX_BLOCK];
    int nblock = s->n * s->n;
    for (int b = 0; b < nblock; b++) {
        OmSymbol block = om__plan_block_symbol(s->n, b);
        Alternative a;
        OmStatus status = ask(p, s, r, om__asp_function("chosen", &block, 1), plan, &a);
        if (status != OM_OK) return status;
        broken[b] = a.broken;
    }
    for (int b = 0; b < nblock; b++) {
        bool is_first = true, mark[OM_PLAN_MAX_BLOCK] = {false};
        for (int c = 0; c < b; c++) is_first = is_first && broken[c] != broken[b];
        if (!is_first) continue;
        for (int c = b; c < nblock; c++) mark[c] = broken[c] == broken[b];
        OM_TRY(om_text_append(t, "Grasping "));
        OM_TRY(write_set(s, mark, t));
        OM_TRY(om_text_append(t, ": forbidden, since "));
        OM_TRY(write_rules(r, broken[b], t));
        OM_TRY(om_text_append(t, ".\n"));
    }
    return OM_OK;
}

OmStatus om_planner_explain(OmPlanner* p, const OmSituation* s, const OmPlan* plan, int nother,
                            OmText* text) {
    OM_TRY(om__situation_check(s));
    OM_CHECK(plan->naction == 0 || plan->n == s->n, OM_INVALID,
             "explain: the plan is for a grid of %d, the situation has %d", plan->n, s->n);
    OM_TRY(write_choice(s, plan, text));
    OM_TRY(write_fluents(s, text));
    if (s->is_visible) return OM_OK;
    bool is_reground;
    Rules rules = {0};
    OM_TRY(om__planner_sense(p, s, true, &is_reground));
    OM_TRY(list_rules(p, &rules));
    OmStatus status = explain_first(p, s, &rules, plan, text);
    if (status != OM_OK) return status;
    return plan->outcome == OM_UNSAT ? explain_unsat(p, s, &rules, plan, text)
                                     : explain_blocks(p, s, &rules, plan, nother, text);
}
