// defras_slip.c: tissue that slips out of the jaws (the thesis assumes a firm grasp).
//
// An arm that held tissue and measures a jaw closed on nothing has lost it. The twin releases the tissue too, the jaw
// opens, and the grasping point counts as tried: the same jaws would slip there again. The plan ends, since each of its
// actions assumed the grasp, also where the other arm was moving; only a jaw completes its motion first.
#include "defras/defras_internal.h"

static OmStatus lose_grasp(OmLoop* loop, int arm) {
    ArmState* state = &loop->arm[arm];
    om_body_release(loop->twin, arm);
    om__look_note_release(loop, arm);
    loop->tried[state->in_hand] |= OM_TRIED_GRASP;
    state->in_hand = state->at = -1;
    state->is_closed = state->is_max_force = false;
    loop->has_slipped = true;
    ++loop->result.nslip;
    return om_world_set_jaw(loop->world, arm, JAW_OPEN);
}

OmStatus om__slip_watch(OmLoop* loop, const OmObservation* obs) {
    for (int a = 0; a < loop->narm; ++a)
        if (loop->arm[a].in_hand >= 0 && om_arm_is_empty(&obs->arm[a])) OM_TRY(lose_grasp(loop, a));
    return OM_OK;
}

static bool moves_jaw(const OmLoop* loop) {
    OmPlanVerb verb = loop->action.plan.verb;
    return verb == OM_PLAN_GRASP || verb == OM_PLAN_RELEASE;
}

OmStatus om__slip_react(OmLoop* loop) {
    if (!loop->has_slipped) return OM_OK;
    loop->has_slipped = false;
    switch (loop->stage) {
    case STAGE_ACTION:
        if (moves_jaw(loop)) break;
        for (int a = 0; a < loop->narm; ++a) om_world_stop(loop->world, a);
        OM_TRY(om__loop_break_action(loop, OM_ACTION_SLIPPED));
        loop->stage = STAGE_PLAN;
        return OM_OK;
    case STAGE_NEXT_ACTION:
    case STAGE_CONSENT:
    case STAGE_LOOK: loop->stage = STAGE_PLAN; return OM_OK;
    // The ROI may stay visible: the verification decides. If it closes, the motion is not continued.
    case STAGE_VERIFY: loop->action.outcome = OM_ACTION_SLIPPED; break;
    case STAGE_HOLD:
        if (loop->held_stage == STAGE_NEXT_ACTION || loop->held_stage == STAGE_CONSENT)
            loop->held_stage = STAGE_PLAN;
        break;
    default: break;
    }
    loop->wants_plan = true;
    return OM_OK;
}
