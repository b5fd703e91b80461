// belief_follow.c: the twin follows a picture that no attachments explain (ours).
//
// In a fold the twin may lie apart from the tissue although its attachments are right, because the flap tips over at
// another moment. No estimate of attachments lowers that distance.
//
// The shape that the job has brought onto the newest scan (OmMatchEstimate.shape) is kept as an increment: from the
// twin of that acquisition if the estimate is refused, or from the twin at rest with the new attachments if adopted.
// After a refusal the twin follows it at once; after an adoption only if mu stays above its first limit when the effect
// is measured. The tools keep still meanwhile. Then forces hold the twin until the tissue is released. Attachments that
// an estimate has learnt in a fold must explain most of the distance (om__belief_judge).
//
// Before the loop continues with this grasp, both folds are tried in the twin from there (om__ahead_fold): a fold
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

#include "belief/belief_state.h"
#include "belief/belief_updater.h"

OmStatus om__follow_create(Belief* belief) {
    const size_t n = (size_t)om_body_site(belief->twin)->mesh.nvert;
    if (!belief->updater || !belief->updater->def.estimate) return OM_OK;
    OM_ALLOC(belief->increment, 3 * n);
    OM_ALLOC(belief->goal, n);
    return OM_OK;
}

void om__follow_keep(Belief* belief, bool is_adopted) {
    const OmUpdater* u = belief->updater;
    const OmMatchEstimate* e = &u->estimate;
    const size_t n = 3 * (size_t)u->nvert, stride = 3 * (size_t)e->nnode;
    const double* from = NULL;
    belief->has_increment = false;
    if (!belief->increment || !e->has_shape || !e->shape || e->nnode < u->nvert || u->ngiven == 0)
        return;
    if (is_adopted)
        from =
            e->x && e->nacquisition == u->ngiven ? e->x + (size_t)(u->ngiven - 1) * stride : NULL;
    else
        from = u->given[u->ngiven - 1]->x_twin;
    if (!from) return;
    belief->has_increment = true;
    for (size_t i = 0; i < n; ++i) {
        belief->increment[i] = e->shape[i] - from[i];
        if (!isfinite(belief->increment[i])) belief->has_increment = false;
    }
}

OmStatus om__follow_begin(Belief* belief, bool* has_begun) {
    const bool is_holding = om__act_is_holding(belief->act);
    *has_begun = false;
    if (!belief->has_increment || !is_holding || !belief->is_of_fold) return OM_OK;
    if (!om_body_engine(belief->twin)->has_springs) return OM_OK;
    if (om_match_adoption_is_active(belief->adoption))
        return OM_OK;  // a person has marked attachments
    belief->has_increment = false;
    OM_TRY(om_match_adoption_follow(belief->adoption, belief->twin, belief->increment,
                                    OM_MATCH_ADOPT_TIME));
    om__force_reset(belief);
    om__act_stop(belief->act);
    belief->is_waiting = belief->has_followed = *has_begun = true;
    return OM_OK;
}

OmStatus om__follow_drop(Belief* belief) {
    belief->has_followed = belief->has_increment = belief->is_waiting = false;
    return om_match_adoption_stop(belief->adoption, belief->twin);
}

bool om__follow_is_fixed(const Belief* belief, int block) {
    if (!belief->goal || !om_match_adoption_is_following(belief->adoption))
        return om__grid_is_fixed(belief->grid, belief->twin, block);
    om_match_adoption_get_goal(belief->adoption, belief->goal);
    return om__grid_is_fixed_by(belief->grid, &om_body_site(belief->twin)->mesh, belief->goal,
                                block);
}
