// belief_fluents.c: measurements to the fluents of Table 6.1 (compute_fluents, Alg. 4).
//
// Interpretation of the algorithm: a tool is at a block from the command to go there, not when the tool passes above.
// The height is measured from the point where the tissue was grasped, so that curved anatomy has the same limit
// everywhere.
#include <string.h>

#include "belief/belief_state.h"

// m: a measured tip stops that far from its goal. With 0.5 mm, noise of 0.2 mm led to a sixth pull of no length.
#define HEIGHT_TOLERANCE 1e-3

// A grasp beside an exhausted block lifts almost the same tissue. On a fine grid all actions would be used in one
// place, so a block is postponed after MAX_NEAR_ATTEMPTS attempts within attempt_distance. One attempt is not enough:
// a grasp 15 mm beside it may expose the region. The planning stage halves the distance when only postponed blocks are
// left.
static bool is_postponed(const Belief* belief, int block) {
    const Grid* g = belief->grid;
    if (belief->attempt_distance <= 0 || (belief->tried[block] & OM_TRIED_GRASP)) return false;
    OmVec3 c = om_load3(g->center, block);
    int near = 0;
    for (int b = 0; b < g->n * g->n; ++b) {
        if (b == block || !belief->is_exhausted[b]) continue;
        OmVec3 d = om_sub(om_load3(g->center, b), c);
        near += hypot(d.x, d.y) < belief->attempt_distance;
    }
    return near >= MAX_NEAR_ATTEMPTS;
}

void om__sense_fluents(Belief* belief, OmSituation* s) {
    const Grid* g = belief->grid;
    om_situation_init(s, g->n, 2 * fmin(g->half.x, g->half.y) / g->n);
    s->center = g->center;
    belief->npostponed = 0;
    const uint8_t arms = (uint8_t)((1 << belief->act->narm) - 1);
    for (int b = 0; b < g->n * g->n; ++b) {
        s->is_fixed[b] = om__grid_is_fixed(belief->grid, belief->twin, b);
        s->is_above_roi[b] = b == g->roi_block;
        s->tried[b] = belief->tried[b];
        s->exposure[b] = belief->exposure[b];
        s->is_forbidden[b] = belief->is_forbidden[b];
        s->reachable[b] &= arms;
        if (g->vert[b] < 0 || belief->act->point[b].source == GRASP_NONE) s->reachable[b] = 0;
        if (om__cloud_is_spent(belief->act, b)) s->tried[b] |= OM_TRIED_GRASP;
        bool is_held = belief->act->arm[0].in_hand == b || belief->act->arm[1].in_hand == b;
        if (is_held || !is_postponed(belief, b)) continue;
        s->tried[b] |= OM_TRIED_GRASP;
        belief->npostponed += !s->is_fixed[b] && s->reachable[b];
    }
    s->is_visible = belief->is_exposed;
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        const ArmState* arm = &belief->act->arm[a];
        OmArmSituation* now = &s->arm[a];
        now->at = arm->at;
        now->in_hand = arm->in_hand;
        now->is_closed = arm->is_closed;
        bool is_holding = arm->in_hand >= 0;
        now->is_max_height = is_holding && (arm->is_at_top || arm->lift > belief->task->max_height -
                                                                              HEIGHT_TOLERANCE);
        now->is_max_force = is_holding && arm->is_max_force;
        double pulls = arm->lift / belief->task->pull_step;
        now->nlift = is_holding && pulls > 0 ? (int)(pulls + 0.5) : 0;
    }
}
