// plan_text.c: the plan as text.
#include "plan/plan_internal.h"

const char* om_plan_verb_text(OmPlanVerb verb) { return om__plan_verb_name[verb]; }

const char* om_plan_arm_text(int arm) { return om__plan_arm_name[arm]; }

OmStatus om_plan_print_action(const OmPlan* plan, int action, OmText* text) {
    OM_CHECK(action >= 0 && action < plan->naction, OM_INVALID, "plan: no action %d among %d",
             action, plan->naction);
    const OmPlanAction* a = &plan->action[action];
    int ix = a->block >= 0 ? a->block % plan->n + 1 : 0,
        iy = a->block >= 0 ? a->block / plan->n + 1 : 0;
    switch (a->verb) {
    case OM_PLAN_REACH:
        return om_text_append(text, "PSM%d reaches grasping point (%d,%d)", a->arm + 1, ix, iy);
    case OM_PLAN_GRASP:
        return om_text_append(text, "PSM%d grasps the tissue at (%d,%d)", a->arm + 1, ix, iy);
    case OM_PLAN_RELEASE: return om_text_append(text, "PSM%d opens its gripper", a->arm + 1);
    case OM_PLAN_PULL: return om_text_append(text, "PSM%d pulls (%d,%d) up", a->arm + 1, ix, iy);
    case OM_PLAN_MOVE_ROI:
        return om_text_append(text, "PSM%d folds (%d,%d) towards the region of interest",
                              a->arm + 1, ix, iy);
    default:
        return om_text_append(text, "PSM%d folds (%d,%d) away from the camera", a->arm + 1, ix, iy);
    }
}

OmStatus om_plan_print(const OmPlan* plan, OmText* text) {
    for (int i = 0; i < plan->naction; i++) {
        OM_TRY(om_text_append(text, "%d. ", i + 1));
        OM_TRY(om_plan_print_action(plan, i, text));
        OM_TRY(om_text_append(text, "\n"));
    }
    return OM_OK;
}
