// defras_doubt.c: what the loop does with attachments that not every estimate has, when no plan is left (ours).
//
// An estimate that attaches too much rules out the points above it, also points that are free. When no point is left,
// the twin frees all vertices that were free in some belief of this operation: the first one, or an estimate. What
// remains is the intersection of the beliefs; the thesis (4.3.4) takes the intersection of the latest predictions for
// every update, where one estimate too few hides a true attachment. Here it is taken only where the loop would end. The
// force limit and the monitor watch the grasps that follow, and each later estimate narrows the intersection further.
//
// An estimate may attach the same again while the tissue of one grasp is held. A second doubt without a grasp in
// between releases the tissue in hand; each grasp is then doubted twice at most, so the operation ends.
//
// The intersection never frees what the first belief and all estimates have. Where another patch is believed, the
// points that expose the ROI often lie above the first belief, which no estimate corrects where no tissue was lifted.
// So where the intersection gives no new point, or is the one that was left before, the twin gives up the first belief,
// and keeps what the last estimate has beyond it; at last it gives up everything but what a person has marked. Each of
// the two once, and only after a warning: without one nothing says that the belief is wrong.
//
// Rejected (doc/notes/defras.md): the first belief given up only where the intersection gives no new point (not exposed
// in 150 actions, now 82); tissue laid back before its release and the second fold from where the first began (11 of 17
// exposed as before, 10.0 N in truth).
#include <string.h>

#include "defras/defras_internal.h"
#include "defras/defras_updater.h"

typedef enum Doubt { DOUBT_SOME, DOUBT_FIRST, DOUBT_ALL, NDOUBT } Doubt;
enum { SOURCE_FIRST = 1, SOURCE_PERSON = 2 };  // of an attachment

static const char* const doubted[NDOUBT] = {
    "attachments that not every estimate has",
    "the attachments that were believed before the operation",
    "all attachments but those that a person marked",
};

OmStatus om__doubt_create(OmLoop* loop) {
    const size_t n = (size_t)om_body_site(loop->twin)->mesh.nvert;
    if (!loop->updater || !loop->updater->def.estimate) return OM_OK;
    OM_ALLOC(loop->always, n);
    OM_ALLOC(loop->source, n);
    memcpy(loop->always, om_body_attached(loop->twin), n);
    for (size_t v = 0; v < n; ++v) loop->source[v] = loop->always[v] ? SOURCE_FIRST : 0;
    loop->doubt_grasp = -1;
    loop->has_narrowed = true;
    return OM_OK;
}

void om__doubt_note(OmLoop* loop, const unsigned char* attached) {
    const int n = om_body_site(loop->twin)->mesh.nvert;
    for (int v = 0; loop->always && v < n; ++v) {
        loop->has_narrowed = loop->has_narrowed || (loop->always[v] && !attached[v]);
        loop->always[v] = loop->always[v] && attached[v];
    }
}

void om__doubt_mark(OmLoop* loop, int vert, bool is_attached) {
    if (!loop->always) return;
    loop->always[vert] = is_attached;
    loop->source[vert] = is_attached ? SOURCE_PERSON : 0;
    loop->has_narrowed = true;
}

// A point that may be grasped with the attachments `rest`, and not with those of the twin.
static bool has_new_point(const OmLoop* loop, const unsigned char* rest) {
    const OmSituation* s = &loop->situation;
    for (int b = 0; b < loop->grid.n * loop->grid.n; ++b)
        if (s->is_fixed[b] && s->reachable[b] && !s->is_forbidden[b] &&
            !((s->tried[b] | loop->tried[b]) & OM_TRIED_GRASP) &&
            !om__grid_is_fixed_by(&loop->grid, &om_body_site(loop->twin)->mesh, rest, b))
            return true;
    return false;
}

// What stays of the attachments `was` of the twin.
static void make_rest(const OmLoop* loop, Doubt doubt, const unsigned char* was,
                      unsigned char* rest) {
    const int n = om_body_site(loop->twin)->mesh.nvert;
    for (int v = 0; v < n; ++v) {
        const bool stays = doubt == DOUBT_SOME    ? loop->always[v]
                           : doubt == DOUBT_FIRST ? loop->source[v] != SOURCE_FIRST
                                                  : loop->source[v] == SOURCE_PERSON;
        rest[v] = was[v] && stays;
    }
}

// The least doubt that gives a new point; NDOUBT: none. The first belief is doubted after a warning, and once: also
// where an intersection that was taken before is left again, for the estimates since then have taught nothing.
static Doubt choose(const OmLoop* loop, const unsigned char* was, unsigned char* rest) {
    const bool is_warned = loop->updater->nestimate > 0;
    make_rest(loop, DOUBT_SOME, was, rest);
    const bool has_some = has_new_point(loop, rest);
    if (has_some && loop->has_narrowed) return DOUBT_SOME;
    for (int k = DOUBT_FIRST; k < NDOUBT && is_warned; ++k) {
        if (k <= loop->doubt || (has_some && k == DOUBT_ALL)) continue;
        make_rest(loop, (Doubt)k, was, rest);
        if (has_new_point(loop, rest)) return (Doubt)k;
    }
    make_rest(loop, DOUBT_SOME, was, rest);
    return has_some ? DOUBT_SOME : NDOUBT;
}

OmStatus om__doubt_free(OmLoop* loop, bool* is_changed) {
    const size_t n = (size_t)om_body_site(loop->twin)->mesh.nvert;
    *is_changed = false;
    if (!loop->always) return OM_OK;
    if (loop->doubt_grasp == loop->updater->ngrasp) om__warn_give_up(loop);
    OmStatus status = OM_OK;
    unsigned char *was = NULL, *rest = NULL;
    OM_ALLOC_DONE(was, n);
    OM_ALLOC_DONE(rest, n);
    memcpy(was, om_body_attached(loop->twin), n);
    om_match_adoption_get_goal(loop->adoption, was);
    const Doubt doubt = choose(loop, was, rest);
    if (doubt == NDOUBT) goto done;
    *is_changed = true;
    if (doubt > DOUBT_SOME) loop->doubt = doubt;
    loop->has_narrowed = false;
    memcpy(loop->always, rest, n);
    loop->doubt_grasp = loop->updater->ngrasp;
    // What stays is a part of what the twin has.
    OM_TRY_DONE(om_match_adoption_begin(loop->adoption, loop->twin, loop->always,
                                        om_body_attachment_stiffness(loop->twin),
                                        OM_MATCH_ADOPT_TIME));
    loop->is_corrected = true;
    om__loop_forget_exposure(loop);
    om__force_reset(loop);
    loop->stage = STAGE_DOUBT;
    const OmMatchEstimate kept = {.nvert = (int)n, .attached = loop->always};
    const OmUpdateEvent event = {.stage = OM_UPDATE_DOUBTED,
                                 .index = loop->updater->nestimate - 1,
                                 .tick = loop->tick,
                                 .time = loop->time,
                                 .estimate = &kept,
                                 .reason = doubted[doubt],
                                 .was_attached = was};
    OM_TRY_DONE(om__loop_notify_update(loop, &event));
done:
    om_free(was);
    om_free(rest);
    return status;
}

bool om__doubt_is_over(const OmLoop* loop) { return !om_match_adoption_is_active(loop->adoption); }
