// defras_doubt.c: what the loop does with attachments that not every estimate has, when no plan is left (ours).
//
// An estimate that attaches too much rules out the points above it, also points that are free. When no point is left,
// the twin frees all vertices that were free in some belief of this operation: the first one, or an estimate. What
// remains is the intersection of the beliefs; the thesis (4.3.4) takes the intersection of the latest predictions for
// every update, where one estimate too few hides a true attachment. Here it is taken only where the loop would end. The
// force limit and the monitor watch the grasps that follow, and each later estimate narrows the intersection further.
// Where the intersection gives no new point, the loop ends as before.
//
// An estimate may attach the same again while the tissue of one grasp is held: random pair 1026 of the retraction study
// learnt and doubted 60 times in pulls of one point. A second doubt without a grasp in between gives up the tissue in
// hand; each grasp is then doubted twice at most, and the points that may be grasped are finite in number.
//
// Tried at f821946 and left out. Where another patch is believed, the points that expose the ROI often lie above the
// first belief, which is never doubted where no tissue was lifted: random pair 1057 is exposed by 12 sequences from
// there and by 4 others. So (a) where no plan was left the first belief was freed, what the last estimate had beyond it
// stayed, and at last everything was freed; (b) tissue was laid back to where it was grasped before it was let go, and
// the second fold began where the first one had begun, as in the twin's trials. Development pairs 2606 (with b alone)
// and 2617 were exposed, before none of them. Of the 17 random pairs with a release or two folds 11 were exposed, as
// before: 1017, 1037 and 1057 for the first time, 1006, 1067 and 1086 no more, after 150 actions; 1026 with 10.0 N in
// truth, more than 3 epsilon. A twin without attachments refuses nearly every estimate: 46 of 155 updates ended at
// 2 mm, before 43 of 74.
#include <string.h>

#include "defras/defras_internal.h"
#include "defras/defras_updater.h"

OmStatus om__doubt_create(OmLoop* loop) {
    const size_t n = (size_t)om_body_site(loop->twin)->mesh.nvert;
    if (!loop->updater || !loop->updater->def.estimate) return OM_OK;
    OM_ALLOC(loop->always, n);
    memcpy(loop->always, om_body_attached(loop->twin), n);
    loop->doubt_grasp = -1;
    return OM_OK;
}

void om__doubt_note(OmLoop* loop, const unsigned char* attached) {
    const int n = om_body_site(loop->twin)->mesh.nvert;
    for (int v = 0; loop->always && v < n; ++v) loop->always[v] = loop->always[v] && attached[v];
}

void om__doubt_mark(OmLoop* loop, int vert, bool is_attached) {
    if (loop->always) loop->always[vert] = is_attached;
}

// A point that may be grasped with the intersection, and not with the twin's attachments.
static bool has_new_point(const OmLoop* loop) {
    const OmSituation* s = &loop->situation;
    for (int b = 0; b < loop->grid.n * loop->grid.n; ++b)
        if (s->is_fixed[b] && s->reachable[b] && !s->is_forbidden[b] &&
            !((s->tried[b] | loop->tried[b]) & OM_TRIED_GRASP) &&
            !om__grid_is_fixed_by(&loop->grid, &om_body_site(loop->twin)->mesh, loop->always, b))
            return true;
    return false;
}

OmStatus om__doubt_free(OmLoop* loop, bool* is_changed) {
    const size_t n = (size_t)om_body_site(loop->twin)->mesh.nvert;
    *is_changed = false;
    if (!loop->always) return OM_OK;
    if (loop->doubt_grasp == loop->updater->ngrasp) om__warn_give_up(loop);
    *is_changed = has_new_point(loop);
    if (!*is_changed) return OM_OK;
    loop->doubt_grasp = loop->updater->ngrasp;
    OmStatus status = OM_OK;
    unsigned char* was = NULL;
    OM_ALLOC_DONE(was, n);
    memcpy(was, om_body_attached(loop->twin), n);
    om_match_adoption_get_goal(loop->adoption, was);
    // The intersection is a part of what the twin has.
    OM_TRY_DONE(om_match_adoption_begin(loop->adoption, loop->twin, loop->always,
                                        om_body_attachment_stiffness(loop->twin),
                                        OM_MATCH_ADOPT_TIME));
    loop->is_corrected = true;
    om__loop_forget_exposure(loop);
    om__force_reset(loop);
    loop->stage = STAGE_DOUBT;
    const OmMatchEstimate rest = {.nvert = (int)n, .attached = loop->always};
    const OmUpdateEvent event = {.stage = OM_UPDATE_DOUBTED,
                                 .index = loop->updater->nestimate - 1,
                                 .tick = loop->tick,
                                 .time = loop->time,
                                 .estimate = &rest,
                                 .reason = "",
                                 .was_attached = was};
    OM_TRY_DONE(om__loop_notify_update(loop, &event));
done:
    om_free(was);
    return status;
}

bool om__doubt_is_over(const OmLoop* loop) { return !om_match_adoption_is_active(loop->adoption); }
