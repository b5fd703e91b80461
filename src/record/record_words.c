// record_words.c: events of the loop as sentences.
//
// The loop decided by the same numbers: costs of the plan, the twin's force, the visibility that the camera
// gave. The truth of a simulated world has no part in them.
#include "omentum/record_words.h"

#include <string.h>

#include "loop/loop_state.h"

typedef struct Points {  // a set of blocks
    int n;               // of the grid
    int num;
    int block[OM_PLAN_MAX_BLOCK];
} Points;

static void add_point(Points* p, int block) { p->block[p->num++] = block; }

// "point (3,2)", "points (3,2) and (4,2)", "points (3,2), (4,2) and 3 more"
static OmStatus print_points(const Points* p, OmText* t) {
    enum { SHOWN = 6 };
    const int shown = p->num <= SHOWN + 1 ? p->num : SHOWN;
    OM_TRY(om_text_append(t, p->num == 1 ? "point" : "points"));
    for (int i = 0; i < shown; ++i) {
        const char* before = i == 0 ? " " : i + 1 == p->num ? " and " : ", ";
        OM_TRY(
            om_text_append(t, "%s(%d,%d)", before, p->block[i] % p->n + 1, p->block[i] / p->n + 1));
    }
    return shown < p->num ? om_text_append(t, " and %d more", p->num - shown) : OM_OK;
}

static OmStatus print_action(OmPlanVerb verb, int arm, int block, int n, OmText* t) {
    OmPlan plan = {.n = n, .naction = 1, .action[0] = {.verb = verb, .arm = arm, .block = block}};
    return om_plan_print_action(&plan, 0, t);
}

// ---- plans ---------------------------------------------------------------------------------------------------

// Points that may not be grasped, each under its first reason.
static OmStatus print_excluded(const OmLoop* loop, const OmSituation* s, OmText* t) {
    int nforbidden = 0, nfixed = 0, ntried = 0, nreach = 0;
    for (int b = 0; b < s->n * s->n; ++b) {
        if (loop->belief.is_forbidden[b])
            ++nforbidden;
        else if (!s->reachable[b])
            ++nreach;
        else if (s->is_fixed[b])
            ++nfixed;
        else if (s->tried[b] & OM_TRIED_GRASP)
            ++ntried;
    }
    const struct {
        int num;
        const char* why;
    } part[] = {{nforbidden, "forbidden by a person"},
                {nfixed, "over or beside an attachment"},
                {ntried, "tried without success or too near to such a point"},
                {nreach, "out of reach or without tissue"}};
    const char* before = " Ruled out:";
    for (int k = 0; k < 4; ++k) {
        if (part[k].num == 0) continue;
        OM_TRY(om_text_append(t, "%s %d %s", before, part[k].num, part[k].why));
        before = ",";
    }
    return before[0] == ',' ? om_text_append(t, ".") : OM_OK;
}

// A user's program may have other costs: then they are 0.
static OmStatus print_grasp(const OmPlan* plan, OmText* t) {
    const int n = plan->n, b = plan->grasp_block;
    const double roi = 0.1 * (double)plan->cost[1], fixed = -0.1 * (double)plan->cost[2];
    OM_TRY(
        om_text_append(t, "PSM%d grasps point (%d,%d)", plan->grasp_arm + 1, b % n + 1, b / n + 1));
    if (plan->cost[0] > 0) {
        if (roi > 0)
            OM_TRY(om_text_append(t, ", %.0f mm from the point over the region of interest", roi));
        else
            OM_TRY(om_text_append(t, ", which lies over the region of interest"));
        if (fixed > 0) OM_TRY(om_text_append(t, ", %.0f mm from the nearest attachment", fixed));
        if (plan->is_optimal)
            OM_TRY(om_text_append(t, "; no point that may be grasped is nearer to the region"));
    }
    return om_text_append(t, ".");
}

// Why the first plan is not the one made before the operation; nothing where it is, or where there was none.
static OmStatus print_plan_before(const OmLoop* loop, const OmSituation* s, OmText* t) {
    const OmPreplan* before = loop->preplan;
    if (!before || before->chosen < 0 || om_loop_preplan(loop) || loop->result.nplan != 1)
        return OM_OK;
    const int b = before->chosen;
    const char* why = "its arm cannot reach it";
    if (loop->belief.is_forbidden[b])
        why = "a person forbids it";
    else if (loop->act.point[b].source == GRASP_NONE)
        why = "the depth camera sees no tissue there";
    else if (s->is_fixed[b])
        why = "it lies over or beside an attachment";
    return om_text_append(
        t, "The plan made before the operation grasps (%d,%d) and is not followed: %s. ",
        b % s->n + 1, b / s->n + 1, why);
}

OmStatus om_words_plan(const OmLoop* loop, const OmSituation* s, const OmPlan* plan, OmText* t) {
    if (s->is_visible)
        return om_text_append(t, "The region of interest is seen: no plan is needed.");
    if (plan->naction == 0) {
        const char* why = plan->outcome == OM_TIMEOUT
                              ? "The planner found no plan within its budget."
                              : "No plan is left: no point may be grasped.";
        OM_TRY(om_text_append(t, "%s", why));
        return print_excluded(loop, s, t);
    }
    const OmPreplan* before = om_loop_preplan(loop);
    OM_TRY(print_plan_before(loop, s, t));
    if (before) {
        OM_TRY(om_text_append(t, "The plan made before the operation is followed: %s.",
                              before->reason));
    } else if (plan->grasp_block >= 0) {
        OM_TRY(print_grasp(plan, t));
    } else {
        const OmPlanAction* a = &plan->action[0];
        OM_TRY(om_text_append(t, "The tissue in hand is kept; next: "));
        OM_TRY(print_action(a->verb, a->arm, a->block, plan->n, t));
        OM_TRY(om_text_append(t, "."));
    }
    return print_excluded(loop, s, t);
}

// ---- actions -------------------------------------------------------------------------------------------------

static OmStatus print_stop(const OmLoop* loop, const OmRetractAction* a, OmText* t) {
    const OmSceneTask* task = &loop->task;
    const double seen = 100 * a->visibility;
    switch (a->outcome) {
    case OM_ACTION_DONE:
        return om_text_append(t, "done; %.0f %% of the region of interest is seen", seen);
    case OM_ACTION_EXPOSED:
        return om_text_append(
            t, "stopped, because the region of interest came into view: %.0f %% is seen", seen);
    case OM_ACTION_FORCE:
        return om_text_append(t,
                              "stopped, because the robot estimates %.2f N on the tissue, and "
                              "slowing down did not bring it below the limit of %.2f N",
                              a->force_max, om__force_limit(task));
    case OM_ACTION_HEIGHT:
        return om_text_append(t, "stopped at the largest height allowed, %.0f mm",
                              1e3 * task->max_height);
    case OM_ACTION_UNREACHED: return om_text_append(t, "not possible: the arm cannot reach there");
    case OM_ACTION_EMPTY: return om_text_append(t, "the jaws closed, but nothing is between them");
    case OM_ACTION_SLIPPED:
        return om_text_append(t, "stopped, because the tissue slipped out of the jaws");
    case OM_ACTION_OUTDATED:
        return om_text_append(
            t, "stopped, because the model has learnt that the tissue is attached there");
    case OM_ACTION_ABORTED:
        return om_text_append(t, "stopped, because the operation was ended by command");
    case OM_ACTION_WARNED:
        return om_text_append(t, "stopped, because the tissue is not where the model expects it");
    case OM_ACTION_REPLANNED:
        return om_text_append(t, "stopped, because a person demanded another plan");
    case OM_ACTION_HELD: return om_text_append(t, "stopped, because the robot waits for a person");
    }
    return OM_OK;
}

OmStatus om_words_action(const OmLoop* loop, const OmRetractAction* a, OmText* t) {
    OM_TRY(print_action(a->verb, a->arm, a->block, loop->grid.n, t));
    OM_TRY(om_text_append(t, ": "));
    OM_TRY(print_stop(loop, a, t));
    if (a->turn > 0)
        OM_TRY(om_text_append(t, ". The wrist turned by %.0f degrees: %s", a->turn * 180 / OM_PI,
                              loop->act.action.turn_reason));
    return om_text_append(t, ".");
}

OmStatus om_words_force(double factor, OmText* t) {
    return om_text_append(t,
                          " By the forces that the arms measure, the tissue pulls %.2f times as "
                          "hard as the model says; the robot now counts with this.",
                          factor);
}

// ---- updates -------------------------------------------------------------------------------------------------

// Blocks whose first attached vertex came, and those whose last one went; vertices of both kinds elsewhere.
static void compare_attached(const OmLoop* loop, const OmUpdateEvent* e, Points* gained,
                             Points* lost, int* nmore, int* nless) {
    const OmTetMesh* mesh = &om_body_site(loop->twin)->mesh;
    int before[OM_PLAN_MAX_BLOCK] = {0}, after[OM_PLAN_MAX_BLOCK] = {0};
    *gained = *lost = (Points){.n = loop->grid.n};
    *nmore = *nless = 0;
    for (int v = 0; v < mesh->nvert; ++v) {
        const bool was = e->was_attached[v] != 0, is = e->estimate->attached[v] != 0;
        if (!was && !is) continue;
        const int b = om__grid_block_of(&loop->grid, om_load3(mesh->x, v));
        before[b] += was;
        after[b] += is;
        *nmore += is && !was;
        *nless += was && !is;
    }
    for (int b = 0; b < loop->grid.n * loop->grid.n; ++b) {
        if (after[b] && !before[b]) add_point(gained, b);
        if (before[b] && !after[b]) add_point(lost, b);
    }
}

static OmStatus print_change(const OmLoop* loop, const OmUpdateEvent* e, OmText* t) {
    Points gained, lost;
    int nmore, nless;
    compare_attached(loop, e, &gained, &lost, &nmore, &nless);
    if (e->stage == OM_UPDATE_DOUBTED)
        OM_TRY(om_text_append(t, "No plan is left, so the robot doubts %s. ", e->reason));
    OM_TRY(om_text_append(t, "The model has changed: "));
    if (gained.num > 0) {
        OM_TRY(om_text_append(t, "the tissue is attached under "));
        OM_TRY(print_points(&gained, t));
        OM_TRY(om_text_append(t, lost.num > 0 ? ", and " : ""));
    }
    if (lost.num > 0) {
        OM_TRY(
            om_text_append(t, gained.num > 0 ? "it is free under " : "the tissue is free under "));
        OM_TRY(print_points(&lost, t));
    }
    if (gained.num == 0 && lost.num == 0)
        OM_TRY(om_text_append(t, "the border of the attachment moved within the same points"));
    return om_text_append(t, " (%d nodes attached that were free, %d freed).", nmore, nless);
}

OmStatus om_words_update(const OmLoop* loop, const OmUpdateEvent* e, OmText* t) {
    const OmMatchEstimate* m = e->estimate;
    const char* views = e->nacquisition == 1 ? "view" : "views";
    switch (e->stage) {
    case OM_UPDATE_TAKEN:
        return om_text_append(t, "The depth camera measured the lifted tissue, %d points.",
                              e->acquisition ? e->acquisition->scan.npoint : 0);
    case OM_UPDATE_STARTED:
        return om_text_append(t, "The attachments are estimated from %d %s.", e->nacquisition,
                              views);
    case OM_UPDATE_ADOPTED:
        OM_TRY(print_change(loop, e, t));
        return om_text_append(t,
                              " The seen surface was %.2f mm from the model, and is %.2f mm from "
                              "the new one (median).",
                              1e3 * m->before_median, 1e3 * m->after_median);
    case OM_UPDATE_REFUSED:
        return om_text_append(t, "The model is kept; the estimate from %d %s was refused: %s.",
                              e->nacquisition, views, e->reason);
    case OM_UPDATE_DOUBTED: return print_change(loop, e, t);
    case OM_UPDATE_CANCELLED:
        return om_text_append(t, "The model is kept: the operation ended before the estimate.");
    }
    return OM_OK;
}

// ---- warnings, persons, holds, the end -----------------------------------------------------------------------

OmStatus om_words_command(const OmLoop* loop, const OmLoopCommand* c, OmText* t) {
    const int n = loop->grid.n, x = c->block % n + 1, y = c->block / n + 1;
    switch (c->kind) {
    case OM_LOOP_PAUSE: return om_text_append(t, "A person paused the robot.");
    case OM_LOOP_RESUME: return om_text_append(t, "A person let the robot continue.");
    case OM_LOOP_ABORT: return om_text_append(t, "A person aborted the operation.");
    case OM_LOOP_CANCEL: return om_text_append(t, "The program that runs the robot was cancelled.");
    case OM_LOOP_SLOW:
        return om_text_append(t, "A person set the speed to %.0f %%.", 100 * c->value);
    case OM_LOOP_FORBID: return om_text_append(t, "A person forbade point (%d,%d).", x, y);
    case OM_LOOP_ALLOW: return om_text_append(t, "A person allowed point (%d,%d).", x, y);
    case OM_LOOP_ATTACH:
        return om_text_append(t, "A person marked the tissue under point (%d,%d) as attached.", x,
                              y);
    case OM_LOOP_FREE:
        return om_text_append(t, "A person marked the tissue under point (%d,%d) as free.", x, y);
    case OM_LOOP_REPLAN: return om_text_append(t, "A person demanded a new plan.");
    case OM_LOOP_APPROVE: return om_text_append(t, "A person approved the plan.");
    case OM_LOOP_REJECT: return om_text_append(t, "A person rejected the plan.");
    case OM_LOOP_NCOMMAND: break;
    }
    return OM_OK;
}

OmStatus om_words_warning(const OmLoop* loop, int was, const OmMonitorFrame* f, OmText* t) {
    static const char* const act[4] = {"The robot works at its usual speed",
                                       "The robot works at half its speed and measures again",
                                       "The robot stops, measures, and plans anew",
                                       "The robot stops; if this lasts, it waits for a person"};
    const int now = om_loop_warning(loop);
    const bool is_held = om__act_is_holding(&loop->act);
    if (!is_held) return om_text_append(t, "Warning %d ends: no tissue is held.", was);
    if (now == 0)
        OM_TRY(om_text_append(t, "Warning %d ends", was));
    else
        OM_TRY(om_text_append(t, "Warning %d, after %d", now, was));
    const bool is_part = loop->belief.warn.part_state > f->state;
    OM_TRY(om_text_append(t, ": %s is %.1f mm from where the model expects it. ",
                          is_part ? "a part of the tissue" : "the tissue",
                          1e3 * (is_part ? om__warn_part(&loop->belief) : f->mu)));
    return om_text_append(t, "%s.", act[now < 0 || now > 3 ? 3 : now]);
}

OmStatus om_words_hold(OmHold hold, const char* reason, OmText* t) {
    static const char* const remedy[] = {
        [OM_HOLD_NONE] = "",
        [OM_HOLD_WARNING] = "Compare the tissue with the model before the robot continues.",
        [OM_HOLD_STALE] = "Check the cameras and their connection.",
        [OM_HOLD_LATE] = "The computer is too slow for this model.",
        [OM_HOLD_UPDATE] = "The robot cannot learn the attachments; mark them by hand.",
        [OM_HOLD_PLANNER] = "Allow or forbid points, or end the operation.",
        [OM_HOLD_TOOL] = "Check this arm and its connection.",
        [OM_HOLD_ARM] = "Check whether the arm is blocked."};
    return om_text_append(t, "The robot waits for a person: %s. %s", reason, remedy[hold]);
}

OmStatus om_words_end(const OmRetractResult* r, OmText* t) {
    const double seen = 100 * r->visibility_end;
    switch (r->outcome) {
    case OM_RETRACT_EXPOSED:
        return om_text_append(
            t, "The region of interest is exposed: %.0f %% is seen, after %d actions in %.1f s.",
            seen, r->naction, r->time);
    case OM_RETRACT_IN_VIEW:
        return om_text_append(
            t, "The region of interest was in view before any action: %.0f %% is seen.", seen);
    default:
        return om_text_append(t, "The region of interest is not exposed, %.0f %% is seen: %s.",
                              seen, r->reason);
    }
}
