// defras_doubt.c: what the loop frees when no plan is left (ours).
//
// Attachments rule out the points above them. When no point is left, some of them may be wrong:
//
// 1. What was believed at first, if the monitor has warned. That belief was wrong where tissue was lifted, and nothing
//    has confirmed it elsewhere: points above it were never grasped. What the last adopted estimate has beyond it
//    stays. Development pair 2617 of the retraction study (another patch believed) is exposed from nine points, eight
//    of them above its first belief; with the intersection alone no plan was left after 143 actions. Once.
//    The beliefs of 2 then begin with what stays: with the first one among them nothing remained, and in random pairs
//    1006 and 1067 every estimate from a twin without attachments was refused.
// 2. Vertices that were free in some belief of this operation: the first one, or an estimate. An estimate that attaches
//    too much also rules out points that are free. What remains is the intersection of the beliefs; the thesis (4.3.4)
//    takes the intersection of the latest predictions for every update, where one estimate too few hides a true
//    attachment. Each later estimate narrows it further.
// 3. After 1, all of them. From such a twin estimates are refused where the whole sheet moves otherwise than it, but
//    pulls still show what is free: random pair 1017 was exposed so.
//
// The force limit and the monitor watch the grasps that follow. What a person has marked as attached stays. Where
// neither gives a new point, the loop ends.
//
// An estimate may attach the same again while the tissue of one grasp is held: random pair 1026 of the retraction study
// learnt and doubted 60 times in pulls of one point. A second doubt without a grasp in between gives up the tissue in
// hand; each grasp is then doubted twice at most, and the points that may be grasped are finite in number.
#include <string.h>

#include "defras/defras_internal.h"
#include "defras/defras_updater.h"

static int count_vertices(const OmLoop* loop) { return om_body_site(loop->twin)->mesh.nvert; }

OmStatus om__doubt_create(OmLoop* loop) {
    const size_t n = (size_t)count_vertices(loop);
    Doubt* d = &loop->doubt;
    if (!loop->updater || !loop->updater->def.estimate) return OM_OK;
    d->memory = om_calloc(5 * n, 1);
    if (!d->memory) return OM_NO_MEMORY;
    d->first = d->memory;
    d->last = d->first + n;
    d->always = d->last + n;
    d->marked = d->always + n;
    d->rest = d->marked + n;
    memcpy(d->first, om_body_attached(loop->twin), n);
    memcpy(d->always, d->first, n);
    d->grasp = -1;
    return OM_OK;
}

void om__doubt_destroy(OmLoop* loop) { om_free(loop->doubt.memory); }

void om__doubt_note(OmLoop* loop, const unsigned char* attached) {
    Doubt* d = &loop->doubt;
    for (int v = 0; d->memory && v < count_vertices(loop); ++v) {
        d->last[v] = attached[v];
        d->always[v] = d->always[v] && attached[v];
    }
}

void om__doubt_mark(OmLoop* loop, int vert, bool is_attached) {
    Doubt* d = &loop->doubt;
    if (!d->memory) return;
    d->last[vert] = d->always[vert] = d->marked[vert] = is_attached;
}

// A point that may be grasped with `rest`, and not with the twin's attachments.
static bool has_new_point(const OmLoop* loop) {
    const OmSituation* s = &loop->situation;
    for (int b = 0; b < loop->grid.n * loop->grid.n; ++b)
        if (s->is_fixed[b] && s->reachable[b] && !s->is_forbidden[b] &&
            !((s->tried[b] | loop->tried[b]) & OM_TRIED_GRASP) &&
            !om__grid_is_fixed_by(&loop->grid, &om_body_site(loop->twin)->mesh, loop->doubt.rest,
                                  b))
            return true;
    return false;
}

// Choose what remains attached. Null: nothing that is freed gives a new point; otherwise what is doubted, in words.
static const char* choose_rest(OmLoop* loop) {
    Doubt* d = &loop->doubt;
    const int n = count_vertices(loop);
    if (!d->has_freed_first && loop->monitor && loop->result.nupdate > 0) {
        for (int v = 0; v < n; ++v) d->rest[v] = d->marked[v] || (d->last[v] && !d->first[v]);
        d->has_freed_first = has_new_point(loop);
        if (d->has_freed_first) memcpy(d->always, d->rest, (size_t)n);
        if (d->has_freed_first) return "what it believed at first";
    }
    memcpy(d->rest, d->always, (size_t)n);
    if (has_new_point(loop)) return "attachments that not every estimate has";
    memcpy(d->rest, d->marked, (size_t)n);
    return d->has_freed_first && has_new_point(loop) ? "all that it has learnt" : NULL;
}

OmStatus om__doubt_free(OmLoop* loop, bool* is_changed) {
    const size_t n = (size_t)count_vertices(loop);
    Doubt* d = &loop->doubt;
    *is_changed = false;
    if (!d->memory) return OM_OK;
    if (d->grasp == loop->updater->ngrasp) om__warn_give_up(loop);
    const char* reason = choose_rest(loop);
    if (!reason) return OM_OK;
    *is_changed = true;
    d->grasp = loop->updater->ngrasp;
    OmStatus status = OM_OK;
    unsigned char* was = NULL;
    OM_ALLOC_DONE(was, n);
    memcpy(was, om_body_attached(loop->twin), n);
    om_match_adoption_get_goal(loop->adoption, was);
    for (size_t v = 0; v < n; ++v) d->rest[v] = d->rest[v] && was[v];  // nothing new is attached
    OM_TRY_DONE(om_match_adoption_begin(loop->adoption, loop->twin, d->rest,
                                        om_body_attachment_stiffness(loop->twin),
                                        OM_MATCH_ADOPT_TIME));
    loop->is_corrected = true;
    om__loop_forget_exposure(loop);
    om__force_reset(loop);
    loop->stage = STAGE_DOUBT;
    const OmMatchEstimate rest = {.nvert = (int)n, .attached = d->rest};
    const OmUpdateEvent event = {.stage = OM_UPDATE_DOUBTED,
                                 .index = loop->updater->nestimate - 1,
                                 .tick = loop->tick,
                                 .time = loop->time,
                                 .estimate = &rest,
                                 .reason = reason,
                                 .was_attached = was};
    OM_TRY_DONE(om__loop_notify_update(loop, &event));
done:
    om_free(was);
    return status;
}

bool om__doubt_is_over(const OmLoop* loop) { return !om_match_adoption_is_active(loop->adoption); }
