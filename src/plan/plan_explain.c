// plan_explain.c: why this plan, by asking the program again.
#include "plan/plan_internal.h"

OmStatus om_planner_explain(OmPlanner* planner, const OmSituation* situation, const OmPlan* plan,
                            int nother, OmText* text) {
    (void)planner;
    (void)situation;
    (void)plan;
    (void)nother;
    return om_text_append(text, "\n");
}
