// loop_slip.c: tissue that slips out of the jaws (the thesis assumes a firm grasp).
//
// An arm that held tissue and measures a jaw closed on nothing has lost it. The twin releases the tissue too, the jaw
// opens, and the grasping point counts as tried: the same jaws would slip there again. The plan ends, since each of its
// actions assumed the grasp, also where the other arm was moving; only a jaw completes its motion first.
#include "loop/loop_state.h"

static OmStatus lose_grasp(OmLoop* loop, int arm) {
    ArmState* state = &loop->act.arm[arm];
    om_body_release(loop->twin, arm);
    OM_TRY(om__look_note_release(&loop->belief, arm));
    loop->belief.tried[state->in_hand] |= OM_TRIED_GRASP;
    state->in_hand = state->at = -1;
    state->is_closed = state->is_max_force = false;
    loop->has_slipped = true;
    ++loop->result.effort.nslip;
    return om_world_set_jaw(loop->world, arm, JAW_OPEN);
}

OmStatus om__slip_watch(OmLoop* loop, const OmObservation* obs) {
    for (int a = 0; a < loop->act.narm; ++a)
        if (loop->act.arm[a].in_hand >= 0 && om_arm_is_empty(&obs->arm[a]))
            OM_TRY(lose_grasp(loop, a));
    return OM_OK;
}

OmStatus om__slip_react(OmLoop* loop) {
    if (!loop->has_slipped) return OM_OK;
    loop->has_slipped = false;
    if (loop->stage == STAGE_LOOK) {  // there is nothing to look at
        om__loop_go(loop, STAGE_PLAN);
        return OM_OK;
    }
    // The ROI may stay visible: the verification decides. If it closes, the motion is not continued.
    if (loop->stage == STAGE_VERIFY) loop->act.action.outcome = OM_ACTION_SLIPPED;
    return om__loop_drop_plan(loop, OM_ACTION_SLIPPED);
}
