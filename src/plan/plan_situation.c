// plan_situation.c: the grid of blocks and their fluents.
#include <math.h>
#include <string.h>

#include "omentum/vec.h"
#include "plan/plan_internal.h"

void om_situation_init(OmSituation* s, int n, double spacing) {
    memset(s, 0, sizeof *s);
    s->n = n;
    s->spacing = spacing;
    for (int i = 0; i < OM_MAX_ARM; i++) s->arm[i] = (OmArmSituation){.at = -1, .in_hand = -1};
    for (int b = 0; b < OM_PLAN_MAX_BLOCK; b++) s->exposure[b].fold = OM_PLAN_PULL;
    if (n < 1 || n > OM_PLAN_MAX_GRID) return;  // om_planner_solve refuses other sizes
    // argmin over the arms of |y_arm - y_block|, arms at the same distance on either side
    for (int b = 0; b < n * n; b++) s->reachable[b] = 2 * (b / n) <= n - 1 ? 1 : 2;
}

int om_block_at(const OmSituation* s, int ix, int iy) {
    bool is_inside = ix >= 1 && ix <= s->n && iy >= 1 && iy <= s->n;
    return is_inside ? (iy - 1) * s->n + ix - 1 : -1;
}

OmVec3 om__situation_center(const OmSituation* s, int block) {
    if (s->center) return om_load3(s->center, block);
    return (OmVec3){(block % s->n) * s->spacing, (block / s->n) * s->spacing, 0.0};
}

int om__situation_distance(const OmSituation* s, int block, const bool* mark) {
    double best = HUGE_VAL;
    OmVec3 from = om__situation_center(s, block);
    for (int b = 0; b < s->n * s->n; b++) {
        if (mark[b]) best = fmin(best, om_norm(om_sub(om__situation_center(s, b), from)));
    }
    return isfinite(best) ? (int)lround(best * 1e4) : -1;
}

// One block of one arm's fluents.
static OmStatus check_block(const OmSituation* s, int arm, const char* field, int block) {
    int nblock = s->n * s->n;
    OM_CHECK(block >= -1 && block < nblock, OM_INVALID,
             "situation: arm[%d].%s is %d; blocks are 0 to %d, -1 for none", arm, field, block,
             nblock - 1);
    return OM_OK;
}

OmStatus om__situation_check(const OmSituation* s) {
    OM_CHECK(s, OM_INVALID, "situation: null");
    OM_CHECK(s->n >= 1 && s->n <= OM_PLAN_MAX_GRID, OM_INVALID,
             "situation: n is %d; the grid has 1 to %d blocks a side", s->n, OM_PLAN_MAX_GRID);
    OM_CHECK(isfinite(s->spacing) && s->spacing > 0 && s->spacing <= 1.0, OM_INVALID,
             "situation: spacing is %g m; it must be above 0 and at most 1", s->spacing);
    bool has_roi = false;
    for (int b = 0; b < s->n * s->n; b++) {
        const OmExposure* e = &s->exposure[b];
        bool is_end =
            e->fold == OM_PLAN_PULL || e->fold == OM_PLAN_MOVE_ROI || e->fold == OM_PLAN_MOVE_AWAY;
        OM_CHECK(!e->is_known || !e->exposes || (e->npull >= 1 && is_end), OM_INVALID,
                 "situation: exposure of block %d: %d pulls and action %d; at least 1 pull, then "
                 "a fold or OM_PLAN_PULL",
                 b, e->npull, (int)e->fold);
        has_roi = has_roi || s->is_above_roi[b];
        OmVec3 c = om__situation_center(s, b);
        OM_CHECK(
            fabs(c.x) < 1e2 && fabs(c.y) < 1e2 && fabs(c.z) < 1e2, OM_INVALID,
            "situation: center of block %d is (%g, %g, %g) m; it must be finite and within 100 m",
            b, c.x, c.y, c.z);
    }
    OM_CHECK(has_roi || s->is_visible, OM_INVALID,
             "situation: no block is above the ROI; set is_above_roi of the block it lies under");
    for (int i = 0; i < OM_MAX_ARM; i++) {
        OM_TRY(check_block(s, i, "at", s->arm[i].at));
        OM_TRY(check_block(s, i, "in_hand", s->arm[i].in_hand));
        OM_CHECK(s->arm[i].nlift >= 0, OM_INVALID,
                 "situation: arm[%d].nlift is %d; it counts pulls", i, s->arm[i].nlift);
    }
    return OM_OK;
}
