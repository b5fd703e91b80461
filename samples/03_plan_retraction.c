// 03_plan_retraction.c: what should the arms do? A situation as sensing would tell it, the plan, and why.
#include <stdio.h>

#include "omentum/omentum.h"

// A sheet of 120 mm seen as 5 x 5 blocks, held along one side, with the region of interest under it.
static void describe(OmSituation* now) {
    om_situation_init(now, 5, 0.024);
    for (int ix = 1; ix <= 5; ++ix) now->is_fixed[om_block_at(now, ix, 1)] = true;
    now->is_above_roi[om_block_at(now, 3, 4)] = true;
    now->is_above_roi[om_block_at(now, 3, 5)] = true;
}

static OmStatus plan_and_print(OmPlanner* planner, const OmSituation* now) {
    OmPlan plan;
    OmText text = {0};
    OmStatus status = om_planner_solve(planner, now, &plan);
    if (status == OM_OK || status == OM_UNSAT) {
        // No plan is an answer: the explanation says what forbids each grasping point.
        OmStatus written = status == OM_OK ? om_plan_print(&plan, &text)
                                           : om_text_append(&text, "There is no plan.\n");
        if (written == OM_OK) written = om_planner_explain(planner, now, &plan, 2, &text);
        if (written != OM_OK)
            status = written;
        else
            printf("%s", text.str);
    }
    om_text_done(&text);
    return status;
}

int main(void) {
    OmPlanner* planner = NULL;
    OmPlannerDef def = om_planner_default_def();
    OmStatus status = om_planner_create(&def, &planner);
    if (status == OM_OK) {
        OmSituation now;
        describe(&now);
        status = plan_and_print(planner, &now);
    }
    if (status == OM_OK) {
        // The grasp was made and did not help: the planner must find another.
        OmSituation later;
        describe(&later);
        later.tried[om_block_at(&later, 3, 4)] = OM_TRIED_GRASP;
        later.tried[om_block_at(&later, 3, 5)] = OM_TRIED_GRASP;
        printf("\nAfter both grasps above the region of interest have failed:\n");
        status = plan_and_print(planner, &later);
    }
    if (status != OM_OK) fprintf(stderr, "%s\n", om_error_message());
    om_planner_destroy(planner);
    return status == OM_OK ? 0 : 1;
}
