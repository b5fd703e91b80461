// trial_open.c: a plan carried out open loop, without a monitor or a second plan, to tell whether a wrong belief
// matters. A fold still ends by what is seen of the ROI, as its action does.
//
// The grasping point is where the twin has it, as for the arms. There are no tools, no noise and no second plan: what
// fails here fails because the tissue is held otherwise than believed, or is another material.
#include "omentum/trial_search.h"
#include "trial/trial_lift.h"

static OmStatus report(void* ctx) {
    const OmProgress* const* progress = ctx;
    return om_progress_report(*progress, "open loop", 0, 1);
}

static OmStatus carry_out(Trial* t, const OmPreplanPoint* p, OmOpenLoop* r) {
    TrialResult c = {0};
    int nheld;
    t->arm = p->arm;
    OM_TRY(om__trial_grasp(t, p->block, &c, &nheld));
    r->is_held = nheld > 0;
    r->naction = 2;
    if (!r->is_held) return OM_OK;
    for (int k = 0; k < p->npull; ++k)
        OM_TRY(om__trial_pull(t, k * t->scene.task.pull_step, INFINITY, &c));
    r->naction += p->npull;
    if (p->fold != OM_PLAN_PULL) {
        OM_TRY(om__trial_fold(t, p->fold, INFINITY, &c));
        ++r->naction;
    }
    OM_TRY(om__trial_hold(t, VISIBLE_TIME, &r->visibility, &c));
    r->is_exposed = r->visibility >= t->scene.task.visibility;
    r->force = c.force;
    return OM_OK;
}

OmStatus om_retract_open_loop(const OmScene* scene, const OmPreplan* plan, int nworker,
                              const OmProgress* progress, OmOpenLoop* result) {
    *result = (OmOpenLoop){.naction = 0};
    OM_CHECK(plan->n == scene->task.grid, OM_INVALID, "a plan of %d x %d blocks, the task has %d",
             plan->n, plan->n, scene->task.grid);
    OM_CHECK(plan->chosen >= 0, OM_INVALID, "the plan has no grasping point: %s", plan->reason);
    Trial* t;
    OM_TRY(om__trial_create(scene, scene->seed, OM_SITE_WORLD, nworker, &t));
    t->tick = report;
    t->tick_ctx = (void*)&progress;
    OmStatus status = carry_out(t, &plan->point[plan->chosen], result);
    om__trial_destroy(t);
    return status < 0 ? status : OM_OK;
}
