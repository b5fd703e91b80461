// loop_stage.c: which stage may follow which, and the drawing of it in doc/defras.md (a test compares them).
//
// Every change of the stage goes through om__loop_go. An edge that is not in the table ends the run with an error.
#include <string.h>

#include "loop/loop_state.h"

static const char* const name[NSTAGE] = {
    [STAGE_BEGIN] = "BEGIN",     [STAGE_VERIFY] = "VERIFY",
    [STAGE_PLAN] = "PLAN",       [STAGE_NEXT_ACTION] = "NEXT_ACTION",
    [STAGE_ACTION] = "ACTION",   [STAGE_LOOK] = "LOOK",
    [STAGE_DOUBT] = "DOUBT",     [STAGE_LEARN] = "LEARN",
    [STAGE_CONSENT] = "CONSENT", [STAGE_HOLD] = "HOLD",
    [STAGE_ENDED] = "ENDED",
};

// In the order of the drawing. Beside these every stage may be left for HOLD and for ENDED, and HOLD leads back.
static const StageEdge edge[] = {
    {STAGE_BEGIN, STAGE_VERIFY, "the ROI is in view"},
    {STAGE_BEGIN, STAGE_PLAN, "it is not"},
    {STAGE_VERIFY, STAGE_PLAN, "it closed again, or an action ended its plan"},
    {STAGE_VERIFY, STAGE_NEXT_ACTION, "the motion continues, or the plan"},
    {STAGE_VERIFY, STAGE_ENDED, "it stayed in view: exposed, or nothing to do"},
    {STAGE_PLAN, STAGE_NEXT_ACTION, "a plan"},
    {STAGE_PLAN, STAGE_CONSENT, "a plan that a person must approve"},
    {STAGE_PLAN, STAGE_DOUBT, "none, and attachments may be doubted"},
    {STAGE_PLAN, STAGE_ENDED, "none, or too many actions"},
    {STAGE_NEXT_ACTION, STAGE_ACTION, "it begins"},
    {STAGE_NEXT_ACTION, STAGE_PLAN, "a person demands a new plan"},
    {STAGE_ACTION, STAGE_LOOK, "an acquisition"},
    {STAGE_ACTION, STAGE_LEARN, "an answer to a warning is awaited"},
    {STAGE_ACTION, STAGE_VERIFY, "the ROI is in view"},
    {STAGE_ACTION, STAGE_NEXT_ACTION, "as planned"},
    {STAGE_ACTION, STAGE_PLAN, "the end of the plan, or a limit"},
    {STAGE_LOOK, STAGE_LEARN, "an answer to a warning is awaited"},
    {STAGE_LOOK, STAGE_VERIFY, "the ROI is in view"},
    {STAGE_LOOK, STAGE_NEXT_ACTION, "as planned"},
    {STAGE_LOOK, STAGE_PLAN, "the end of the plan, or the tissue slipped"},
    {STAGE_LEARN, STAGE_VERIFY, "the ROI is in view"},
    {STAGE_LEARN, STAGE_NEXT_ACTION, "as planned"},
    {STAGE_LEARN, STAGE_PLAN, "the end of the plan, or what was learnt"},
    {STAGE_DOUBT, STAGE_PLAN, "the twin has freed what was doubted"},
    {STAGE_CONSENT, STAGE_NEXT_ACTION, "yes"},
    {STAGE_CONSENT, STAGE_PLAN, "no, or a person demands a new plan"},
};

const StageEdge* om__loop_edges(int* n) {
    *n = (int)(sizeof edge / sizeof *edge);
    return edge;
}

bool om__loop_may_follow(Stage from, Stage to) {
    int n;
    const StageEdge* e = om__loop_edges(&n);
    if (from == STAGE_ENDED) return false;
    if (to == STAGE_ENDED || from == STAGE_HOLD) return true;
    if (to == STAGE_HOLD) return true;
    for (int k = 0; k < n; ++k)
        if (e[k].from == from && e[k].to == to) return true;
    return false;
}

void om__loop_go(OmLoop* loop, Stage next) {
    const Stage was = loop->stage;
    if (!om__loop_may_follow(was, next) && !loop->astray[0])
        snprintf(loop->astray, sizeof loop->astray, "stage %s of the loop after %s: no such edge",
                 name[next], name[was]);
    loop->walked[was] |= 1u << next;
    loop->stage = next;
    loop->belief.is_looking = next == STAGE_LOOK;
    loop->belief.is_learning = next == STAGE_LEARN;
}

OmStatus om__loop_draw(OmText* text) {
    int n;
    const StageEdge* e = om__loop_edges(&n);
    for (int k = 0; k < n; ++k) {
        const bool is_first = k == 0 || e[k].from != e[k - 1].from;
        OM_TRY(om_text_append(text, "%-11s -> %-11s  %s\n", is_first ? name[e[k].from] : "",
                              name[e[k].to], e[k].when));
    }
    return om_text_append(text, "%-11s -> %-11s  %s\n%-11s -> %-11s  %s\n%-11s -> %-11s  %s\n",
                          "any", name[STAGE_HOLD], "a fault: the arms stop for a person", "",
                          name[STAGE_ENDED], "a person, or the program, ends the operation",
                          name[STAGE_HOLD], "the stage before",
                          "the person continues; an action is planned again");
}
