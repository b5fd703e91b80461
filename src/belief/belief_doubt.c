// belief_doubt.c: what the loop does with uncertain attachments when no plan is left (ours).
//
// An estimate attaches what is attached as probably as not, also where no pull has shown anything (expected Dice
// coefficient), and rules out the points above it. When no point is left, the twin frees the least probable of its
// attachments: those up to the level at which one more point may be grasped. The force limit and the monitor watch the
// grasp that follows; the next estimate gives all of them new probabilities.
//
// Until an estimate is adopted, all of the first belief is as probable as not. Nothing is doubted before the first
// warning: without one nothing says that the belief is wrong. Never freed is what a person has marked, and what an
// estimate attaches below a block in hand, until one frees it: the pull itself has shown it. (Where it was freed, the
// arm pulled further at attached tissue, to 3.8 N in truth at 1.3 N of the twin.)
//
// Rejected (doc/notes/defras.md): to free what was free in some belief of the operation, then the first belief, then
// everything: a twin that knew no attachment before was then free as a whole, slid, and no estimate fitted any more.
#include <stdio.h>
#include <string.h>

#include "belief/belief_state.h"
#include "belief/belief_updater.h"

#define UNKNOWN 0.5  // probability of an attachment of which no estimate says anything

enum { SOURCE_PERSON = 1, SOURCE_PULL };  // of an attachment that is never doubted

OmStatus om__doubt_create(Belief* belief) {
    const size_t n = (size_t)om_body_site(belief->twin)->mesh.nvert;
    if (!belief->updater || !belief->updater->def.estimate) return OM_OK;
    OM_ALLOC(belief->probability, n);
    belief->source = om_calloc(n, 1);
    for (size_t v = 0; v < n; ++v) belief->probability[v] = UNKNOWN;
    return belief->source ? OM_OK : OM_NO_MEMORY;
}

static bool is_in_hand(const Belief* belief, int vert) {
    const OmVec3 x = om_load3(om_body_site(belief->twin)->mesh.x, vert);
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        const int block = belief->act->arm[a].in_hand;
        if (block >= 0 && om__grid_loads(belief->grid, block, x)) return true;
    }
    return false;
}

void om__doubt_note(Belief* belief, const unsigned char* attached, const double* probability) {
    const int n = om_body_site(belief->twin)->mesh.nvert;
    for (int v = 0; belief->source && v < n; ++v) {
        belief->probability[v] = probability ? probability[v] : UNKNOWN;
        if (attached[v] && belief->source[v] != SOURCE_PERSON && is_in_hand(belief, v))
            belief->source[v] = SOURCE_PULL;
        if (!attached[v] && belief->source[v] == SOURCE_PULL) belief->source[v] = 0;
    }
}

void om__doubt_mark(Belief* belief, int vert, bool is_attached) {
    if (belief->source) belief->source[vert] = is_attached ? SOURCE_PERSON : 0;
}

// The level up to which attachments must be freed until nothing holds a block; above 1: it may not be, or is free.
static double level_of(const Belief* belief, const unsigned char* was, int block) {
    const OmTetMesh* mesh = &om_body_site(belief->twin)->mesh;
    double level = -1;
    for (int v = 0; v < mesh->nvert; ++v)
        if (was[v] && om__grid_loads(belief->grid, block, om_load3(mesh->x, v)))
            level = fmax(level, belief->source[v] ? 2 : belief->probability[v]);
    return level < 0 ? 2 : level;
}

// The least level at which a point may be grasped that may not be now; above 1: there is none.
static double find_level(const Belief* belief, const unsigned char* was) {
    const OmSituation* s = &belief->situation;
    double least = 2;
    for (int b = 0; b < belief->grid->n * belief->grid->n; ++b)
        if (s->is_fixed[b] && s->reachable[b] && !s->is_forbidden[b] &&
            !((s->tried[b] | belief->tried[b]) & OM_TRIED_GRASP))
            least = fmin(least, level_of(belief, was, b));
    return least;
}

OmStatus om__doubt_free(Belief* belief, bool* is_changed) {
    const size_t n = (size_t)om_body_site(belief->twin)->mesh.nvert;
    *is_changed = false;
    if (!belief->source || belief->updater->nestimate == 0) return OM_OK;
    OmStatus status = OM_OK;
    unsigned char *was = NULL, *rest = NULL;
    OM_ALLOC_DONE(was, n);
    OM_ALLOC_DONE(rest, n);
    memcpy(was, om_body_attached(belief->twin), n);
    om_match_adoption_get_goal(belief->adoption, was);
    const double level = find_level(belief, was);
    if (level > 1) goto done;
    *is_changed = true;
    for (size_t v = 0; v < n; ++v)
        rest[v] = was[v] && (belief->source[v] || belief->probability[v] > level);
    // What stays is a part of what the twin has.
    OM_TRY_DONE(om_match_adoption_begin(belief->adoption, belief->twin, rest,
                                        om_body_attachment_stiffness(belief->twin),
                                        OM_MATCH_ADOPT_TIME));
    belief->is_corrected = true;
    om__belief_forget_exposure(belief);
    om__force_reset(belief);
    char reason[64];
    snprintf(reason, sizeof reason, "attachments that are at most %.0f %% probable", 100 * level);
    const OmMatchEstimate kept = {.nvert = (int)n, .attached = rest};
    const OmUpdateEvent event = {.stage = OM_UPDATE_DOUBTED,
                                 .index = belief->updater->nestimate - 1,
                                 .tick = belief->act->tick,
                                 .time = belief->act->time,
                                 .estimate = &kept,
                                 .reason = reason,
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
