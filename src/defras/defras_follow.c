// defras_follow.c: the twin follows a picture that no attachments explain (ours).
//
// In a fold the twin may lie apart from the tissue although its attachments are right, because the flap tips over at
// another moment. No estimate of attachments lowers that distance.
//
// The shape that the job has brought onto the newest scan (OmMatchEstimate.shape) is kept as an increment: from the
// twin of that acquisition if the estimate is refused, or from the twin at rest with the new attachments if adopted.
// After a refusal the twin follows it at once; after an adoption only if mu stays above its first limit when the effect
// is measured. The tools keep still meanwhile. Then forces hold the twin until the tissue is released. Attachments that
// an estimate has learnt in a fold must explain most of the distance (is_doubtful in defras_look.c).
//
// Before the loop continues with this grasp, both folds are tried in the twin from there (om__loop_ahead_held): a fold
// that exposes nothing there is not made. Where neither exposes the ROI, or mu is still above its first limit, the
// tissue is released.
//
// Only in folds, and in pulls after a fold of the same grasp: tissue that deviates in a pull is held by attachments
// that the twin does not know. Attachments come first, because forces explain any picture and say nothing about other
// tissue.
//
// Rejected (doc/notes/defras.md): to continue without trials in the twin (three of eight development cases not
// exposed); to continue above the first limit of mu (two cases held at 2.7 mm).
#include <math.h>
#include <string.h>

#include "defras/defras_internal.h"
#include "defras/defras_updater.h"

OmStatus om__follow_create(OmLoop* loop) {
    const size_t n = (size_t)om_body_site(loop->twin)->mesh.nvert;
    if (!loop->updater || !loop->updater->def.estimate) return OM_OK;
    OM_ALLOC(loop->increment, 3 * n);
    OM_ALLOC(loop->goal, n);
    return OM_OK;
}

void om__follow_keep(OmLoop* loop, bool is_adopted) {
    const OmUpdater* u = loop->updater;
    const OmMatchEstimate* e = &u->estimate;
    const size_t n = 3 * (size_t)u->nvert, stride = 3 * (size_t)e->nnode;
    const double* from = NULL;
    loop->has_increment = false;
    if (!loop->increment || !e->has_shape || !e->shape || e->nnode < u->nvert || u->ngiven == 0)
        return;
    if (is_adopted)
        from =
            e->x && e->nacquisition == u->ngiven ? e->x + (size_t)(u->ngiven - 1) * stride : NULL;
    else
        from = u->given[u->ngiven - 1]->x_twin;
    if (!from) return;
    loop->has_increment = true;
    for (size_t i = 0; i < n; ++i) {
        loop->increment[i] = e->shape[i] - from[i];
        if (!isfinite(loop->increment[i])) loop->has_increment = false;
    }
}

OmStatus om__follow_begin(OmLoop* loop, bool* has_begun) {
    const bool is_holding = loop->arm[0].in_hand >= 0 || loop->arm[1].in_hand >= 0;
    *has_begun = false;
    if (!loop->has_increment || !is_holding || !loop->is_of_fold) return OM_OK;
    if (!om_body_engine(loop->twin)->has_springs) return OM_OK;
    if (om_match_adoption_is_active(loop->adoption))
        return OM_OK;  // a person has marked attachments
    loop->has_increment = false;
    OM_TRY(
        om_match_adoption_follow(loop->adoption, loop->twin, loop->increment, OM_MATCH_ADOPT_TIME));
    om__force_reset(loop);
    om__modulus_drop(loop);
    om__loop_stop_arms(loop);
    loop->is_waiting = loop->has_followed = *has_begun = true;
    return OM_OK;
}

OmStatus om__follow_drop(OmLoop* loop) {
    loop->has_followed = loop->has_increment = loop->is_waiting = false;
    return om_match_adoption_stop(loop->adoption, loop->twin);
}

OmStatus om__follow_check(OmLoop* loop, bool* waits) {
    const bool was_waiting = loop->is_waiting;
    *waits = loop->is_waiting = was_waiting && om_match_adoption_is_following(loop->adoption);
    const bool is_in_motion = loop->stage == STAGE_ACTION && loop->action.nwait == 0;
    const bool is_over = was_waiting && !*waits && is_in_motion && !loop->is_paused;
    return is_over && !om__warn_stops(loop) ? om__motion_resume(loop) : OM_OK;
}

OmStatus om__follow_judge(OmLoop* loop) {
    const bool has_followed = loop->has_followed;
    loop->has_followed = false;
    if (!has_followed || loop->visibility >= loop->task.visibility) return OM_OK;
    if (loop->frame.mu > loop->monitor_settings.limit[0]) {  // not even forces explain the picture
        om__warn_give_up(loop);
        return OM_OK;
    }
    for (int arm = 0; arm < loop->narm; ++arm) {
        const int block = loop->arm[arm].in_hand;
        bool exposes[2];  // away from the camera, towards the ROI
        if (block < 0) continue;
        OM_TRY(om__loop_ahead_held(loop, arm, exposes));
        loop->wants_plan = true;
        if (!exposes[0]) loop->tried[block] |= OM_TRIED_MOVE_AWAY;
        if (!exposes[1]) loop->tried[block] |= OM_TRIED_MOVE_ROI;
        if (!exposes[0] && !exposes[1]) om__warn_give_up(loop);
    }
    return OM_OK;
}

bool om__follow_is_fixed(const OmLoop* loop, int block) {
    if (!loop->goal || !om_match_adoption_is_following(loop->adoption))
        return om__grid_is_fixed(&loop->grid, loop->twin, block);
    om_match_adoption_get_goal(loop->adoption, loop->goal);
    return om__grid_is_fixed_by(&loop->grid, &om_body_site(loop->twin)->mesh, loop->goal, block);
}
