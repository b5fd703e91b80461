// belief_doubt.c: what the loop does with attachments that not every estimate has, when no plan is left (ours).
//
// An estimate that attaches too much rules out the points above it, also points that are free. When no point is left,
// the twin frees all vertices that were free in some belief of this operation: the first one, or an estimate. What
// remains is the intersection of the beliefs; the thesis (4.3.4) takes the intersection of the latest predictions for
// every update, where one estimate too few hides a true attachment. Here it is taken only where the loop would end. The
// force limit and the monitor watch the grasps that follow, and each later estimate narrows the intersection further.
//
// The intersection never frees what the first belief and all estimates have. Where another patch is believed, the
// points that expose the ROI often lie above the first belief, which no estimate corrects where no tissue was lifted.
// So where the intersection gives no new point, or is the one that was left before, the twin gives up the first belief,
// and keeps what the last estimate has beyond it; at last it gives up everything but what a person has marked. Each of
// the two once, and only after a warning: without one nothing says that the belief is wrong.
//
// No doubt frees what an estimate attaches below the block in hand: the pull itself has shown it. (Where it was freed,
// the arm pulled further at attached tissue, to 3.8 N in truth at 1.3 N of the twin.) So the action after a doubt is a
// release, and a grasp is doubted once.
//
// Rejected (doc/notes/defras.md): the first belief given up only where the intersection gives no new point (not exposed
// in 150 actions, now 82); tissue laid back before its release and the second fold from where the first began (11 of 17
// exposed as before, 10.0 N in truth).
#include <string.h>

#include "belief/belief_state.h"
#include "belief/belief_updater.h"

typedef enum Doubt { DOUBT_SOME, DOUBT_FIRST, DOUBT_ALL, NDOUBT } Doubt;
enum { SOURCE_FIRST = 1, SOURCE_PERSON, SOURCE_PULL };  // of an attachment

static const char* const doubted[NDOUBT] = {
    "attachments that not every estimate has",
    "the attachments that were believed before the operation",
    "all attachments but those that a person marked or a pull showed",
};

OmStatus om__doubt_create(Belief* belief) {
    const size_t n = (size_t)om_body_site(belief->twin)->mesh.nvert;
    if (!belief->updater || !belief->updater->def.estimate) return OM_OK;
    OM_ALLOC(belief->always, n);
    OM_ALLOC(belief->source, n);
    memcpy(belief->always, om_body_attached(belief->twin), n);
    for (size_t v = 0; v < n; ++v) belief->source[v] = belief->always[v] ? SOURCE_FIRST : 0;
    belief->has_narrowed = true;
    return OM_OK;
}

static bool is_in_hand(const Belief* belief, int vert) {
    const OmVec3 x = om_load3(om_body_site(belief->twin)->mesh.x, vert);
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        const int block = belief->act->arm[a].in_hand;
        if (block >= 0 && om__grid_loads(belief->grid, block, x)) return true;
    }
    return false;
}

void om__doubt_note(Belief* belief, const unsigned char* attached) {
    const int n = om_body_site(belief->twin)->mesh.nvert;
    for (int v = 0; belief->always && v < n; ++v) {
        belief->has_narrowed = belief->has_narrowed || (belief->always[v] && !attached[v]);
        belief->always[v] = belief->always[v] && attached[v];
        if (attached[v] && belief->source[v] != SOURCE_PERSON && is_in_hand(belief, v))
            belief->source[v] = SOURCE_PULL;
        if (!attached[v] && belief->source[v] == SOURCE_PULL) belief->source[v] = 0;
    }
}

void om__doubt_mark(Belief* belief, int vert, bool is_attached) {
    if (!belief->always) return;
    belief->always[vert] = is_attached;
    belief->source[vert] = is_attached ? SOURCE_PERSON : 0;
    belief->has_narrowed = true;
}

// A point that may be grasped with the attachments `rest`, and not with those of the twin.
static bool has_new_point(const Belief* belief, const unsigned char* rest) {
    const OmSituation* s = &belief->situation;
    for (int b = 0; b < belief->grid->n * belief->grid->n; ++b)
        if (s->is_fixed[b] && s->reachable[b] && !s->is_forbidden[b] &&
            !((s->tried[b] | belief->tried[b]) & OM_TRIED_GRASP) &&
            !om__grid_is_fixed_by(belief->grid, &om_body_site(belief->twin)->mesh, rest, b))
            return true;
    return false;
}

// What stays of the attachments `was` of the twin.
static void make_rest(const Belief* belief, Doubt doubt, const unsigned char* was,
                      unsigned char* rest) {
    const int n = om_body_site(belief->twin)->mesh.nvert;
    for (int v = 0; v < n; ++v) {
        const int from = belief->source[v];
        const bool stays = doubt == DOUBT_SOME    ? belief->always[v]
                           : doubt == DOUBT_FIRST ? from != SOURCE_FIRST
                                                  : from == SOURCE_PERSON;
        rest[v] = was[v] && (stays || from == SOURCE_PULL);
    }
}

// The least doubt that gives a new point; NDOUBT: none. The first belief is doubted after a warning, and once: also
// where an intersection that was taken before is left again, for the estimates since then have taught nothing.
static Doubt choose(const Belief* belief, const unsigned char* was, unsigned char* rest) {
    const bool is_warned = belief->updater->nestimate > 0;
    make_rest(belief, DOUBT_SOME, was, rest);
    const bool has_some = has_new_point(belief, rest);
    if (has_some && belief->has_narrowed) return DOUBT_SOME;
    for (int k = DOUBT_FIRST; k < NDOUBT && is_warned; ++k) {
        if (k <= belief->doubt || (has_some && k == DOUBT_ALL)) continue;
        make_rest(belief, (Doubt)k, was, rest);
        if (has_new_point(belief, rest)) return (Doubt)k;
    }
    make_rest(belief, DOUBT_SOME, was, rest);
    return has_some ? DOUBT_SOME : NDOUBT;
}

OmStatus om__doubt_free(Belief* belief, bool* is_changed) {
    const size_t n = (size_t)om_body_site(belief->twin)->mesh.nvert;
    *is_changed = false;
    if (!belief->always) return OM_OK;
    OmStatus status = OM_OK;
    unsigned char *was = NULL, *rest = NULL;
    OM_ALLOC_DONE(was, n);
    OM_ALLOC_DONE(rest, n);
    memcpy(was, om_body_attached(belief->twin), n);
    om_match_adoption_get_goal(belief->adoption, was);
    const Doubt doubt = choose(belief, was, rest);
    if (doubt == NDOUBT) goto done;
    *is_changed = true;
    if (doubt > DOUBT_SOME) belief->doubt = doubt;
    belief->has_narrowed = false;
    memcpy(belief->always, rest, n);
    // What stays is a part of what the twin has.
    OM_TRY_DONE(om_match_adoption_begin(belief->adoption, belief->twin, belief->always,
                                        om_body_attachment_stiffness(belief->twin),
                                        OM_MATCH_ADOPT_TIME));
    belief->is_corrected = true;
    om__belief_forget_exposure(belief);
    om__force_reset(belief);
    const OmMatchEstimate kept = {.nvert = (int)n, .attached = belief->always};
    const OmUpdateEvent event = {.stage = OM_UPDATE_DOUBTED,
                                 .index = belief->updater->nestimate - 1,
                                 .tick = belief->act->tick,
                                 .time = belief->act->time,
                                 .estimate = &kept,
                                 .reason = doubted[doubt],
                                 .was_attached = was};
    OM_TRY_DONE(om__belief_tell(belief, &event));
done:
    om_free(was);
    om_free(rest);
    return status;
}

bool om__doubt_is_over(const Belief* belief) {
    return !om_match_adoption_is_active(belief->adoption);
}
