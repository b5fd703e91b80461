// fuzz_trial_preplan.c: the reader of plan files.
#include <math.h>

#include "fuzz_common.h"
#include "omentum/trial_preplan.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static OmPreplan plan;
    static OmPlan actions;
    OmStatus status = om_preplan_parse((const char*)data, size, "fuzz.json", &plan);
    if (status != OM_OK) {
        FUZZ_EXPECT(status < 0 && om_error_message()[0] != '\0');
        return 0;
    }
    // What was accepted keeps its promises.
    int n = plan.n * plan.n;
    FUZZ_EXPECT(plan.n >= 1 && plan.n <= OM_PLAN_MAX_GRID && plan.chosen >= -1 && plan.chosen < n);
    FUZZ_EXPECT(memchr(plan.scene, 0, sizeof plan.scene) &&
                memchr(plan.reason, 0, sizeof plan.reason));
    for (int b = 0; b < n; ++b) {
        const OmPreplanPoint* p = &plan.point[b];
        FUZZ_EXPECT(p->block == b && p->arm >= -1 && p->arm < OM_MAX_ARM);
        FUZZ_EXPECT(isfinite(p->force) && p->visibility >= 0 && p->visibility <= 1);
        FUZZ_EXPECT(!p->is_tried || (p->arm >= 0 && p->npull >= 1));
        FUZZ_EXPECT((p->verdict == OM_PREPLAN_CHOSEN) == (b == plan.chosen));
    }
    om_preplan_make_plan(&plan, &actions);
    FUZZ_EXPECT(actions.naction >= 0 && actions.naction <= OM_PLAN_MAX_HORIZON);
    FUZZ_EXPECT((actions.naction > 0) == (plan.chosen >= 0));
    return 0;
}
