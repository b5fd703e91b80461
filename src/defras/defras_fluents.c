// defras_fluents.c: measurements to the fluents of Table 6.1 (compute_fluents, Alg. 4).
//
// Interpretation of the algorithm: a tool is at a block from the command to go there, not when the tool passes above.
// The height is measured from the point where the tissue was grasped, so that curved anatomy has the same limit
// everywhere.
#include <string.h>

#include "defras/defras_internal.h"

_Static_assert(OM_SCENE_MAX_GRID <= OM_PLAN_MAX_GRID, "blocks of a scene fit the planner's arrays");

// m: a measured tip stops that far from its goal. With 0.5 mm, noise of 0.2 mm led to a sixth pull of no length.
#define HEIGHT_TOLERANCE 1e-3

static int block_of(const Grid* g, OmVec3 p_task) {
    int ix = (int)floor((p_task.x + g->half.x) / (2 * g->half.x) * g->n);
    int iy = (int)floor((p_task.y + g->half.y) / (2 * g->half.y) * g->n);
    ix = ix < 0 ? 0 : ix >= g->n ? g->n - 1 : ix;
    iy = iy < 0 ? 0 : iy >= g->n ? g->n - 1 : iy;
    return iy * g->n + ix;
}

int om__grid_block_of(const Grid* g, OmVec3 p_world) {
    return block_of(g, om__to_task(g, p_world));
}

bool om__grid_has(const Grid* g, int block, OmVec3 p) {
    return fabs(p.x) <= g->half.x && fabs(p.y) <= g->half.y && block_of(g, p) == block;
}

OmStatus om__grid_build(const OmSceneTask* task, const OmSite* site, Grid* grid) {
    memset(grid, 0, sizeof *grid);
    // a scene need not come from a file
    OM_CHECK(task->grid >= 1 && task->grid <= OM_PLAN_MAX_GRID, OM_INVALID,
             "task: grid: %d is outside its range, 1 to %d", task->grid, OM_PLAN_MAX_GRID);
    grid->n = task->grid;
    grid->task = site->pose_world_task;
    grid->half = site->half_size;
    const OmMeshSet* top = om_tet_mesh_find_set(&site->mesh, "top");
    OM_CHECK(top, OM_INVALID, "the tissue has no set \"top\" to grasp");
    OmPose to_task = om_pose_inverse(grid->task);
    int nblock = grid->n * grid->n, ngrasp = 0;
    double best[OM_PLAN_MAX_BLOCK];
    for (int b = 0; b < nblock; ++b) {
        grid->vert[b] = -1;
        best[b] = INFINITY;
        OmVec3 c = om_vec3(((b % grid->n + 0.5) / grid->n * 2 - 1) * grid->half.x,
                           ((b / grid->n + 0.5) / grid->n * 2 - 1) * grid->half.y, 0);
        om_store3(grid->center, b, c);
    }
    for (int i = 0; i < top->nvert; ++i) {
        OmVec3 p = om_pose_apply(to_task, om_load3(site->mesh.x, top->vert[i]));
        int b = block_of(grid, p);
        OmVec3 c = om_load3(grid->center, b);
        double d = (p.x - c.x) * (p.x - c.x) + (p.y - c.y) * (p.y - c.y);
        if (d < best[b]) {
            best[b] = d;
            if (grid->vert[b] < 0) ++ngrasp;
            grid->vert[b] = top->vert[i];
        }
    }
    // The height of a block is that of its grasping point: distances are in space.
    for (int b = 0; b < nblock; ++b) {
        if (grid->vert[b] < 0) continue;
        grid->tip[b] = om_pose_apply(to_task, om_load3(site->mesh.x, grid->vert[b]));
        grid->center[3 * b + 2] = grid->tip[b].z;
    }
    OM_CHECK(ngrasp > 0, OM_INVALID, "no block of the tissue has a grasping point");
    grid->roi = om_pose_apply(to_task, site->roi_center);
    grid->roi_block = block_of(grid, grid->roi);
    return OM_OK;
}

double om__grid_length(const Grid* g, double fraction) {
    return fraction * 2 * fmin(g->half.x, g->half.y);
}

// The block is above an attachment, or nearer to one than ATTACHMENT_DISTANCE: a pull there would load the attachment.
bool om__grid_is_fixed_by(const Grid* grid, const OmTetMesh* mesh, const unsigned char* attached,
                          int block) {
    OmPose task = om_pose_inverse(grid->task);
    OmVec3 c = om_load3(grid->center, block);
    double clear = om__grid_length(grid, ATTACHMENT_DISTANCE);
    for (int i = 0; i < mesh->nvert; ++i) {
        if (!attached[i]) continue;
        OmVec3 p = om_pose_apply(task, om_load3(mesh->x, i));
        if (block_of(grid, p) == block || hypot(p.x - c.x, p.y - c.y) < clear) return true;
    }
    return false;
}

bool om__grid_is_fixed(const Grid* grid, const OmBody* body, int block) {
    return om__grid_is_fixed_by(grid, &om_body_site(body)->mesh, om_body_attached(body), block);
}

// A grasp beside an exhausted block lifts almost the same tissue. On a fine grid all actions would be used in one
// place, so a block is postponed after MAX_NEAR_ATTEMPTS attempts within attempt_distance. One attempt is not enough:
// a grasp 15 mm beside it may expose the region. The planning stage halves the distance when only postponed blocks are
// left.
static bool is_postponed(const OmLoop* loop, int block) {
    const Grid* g = &loop->grid;
    if (loop->attempt_distance <= 0 || (loop->tried[block] & OM_TRIED_GRASP)) return false;
    OmVec3 c = om_load3(g->center, block);
    int near = 0;
    for (int b = 0; b < g->n * g->n; ++b) {
        if (b == block || !loop->is_exhausted[b]) continue;
        OmVec3 d = om_sub(om_load3(g->center, b), c);
        near += hypot(d.x, d.y) < loop->attempt_distance;
    }
    return near >= MAX_NEAR_ATTEMPTS;
}

void om__sense_fluents(OmLoop* loop, OmSituation* s) {
    const Grid* g = &loop->grid;
    om_situation_init(s, g->n, 2 * fmin(g->half.x, g->half.y) / g->n);
    s->center = g->center;
    loop->npostponed = 0;
    const uint8_t arms = (uint8_t)((1 << loop->narm) - 1);
    for (int b = 0; b < g->n * g->n; ++b) {
        s->is_fixed[b] = om__follow_is_fixed(loop, b);
        s->is_above_roi[b] = b == g->roi_block;
        s->tried[b] = loop->tried[b];
        s->exposure[b] = loop->exposure[b];
        s->is_forbidden[b] = loop->is_forbidden[b];
        s->reachable[b] &= arms;
        if (g->vert[b] < 0 || loop->point[b].source == GRASP_NONE) s->reachable[b] = 0;
        if (om__cloud_is_spent(loop, b)) s->tried[b] |= OM_TRIED_GRASP;
        bool is_held = loop->arm[0].in_hand == b || loop->arm[1].in_hand == b;
        if (is_held || !is_postponed(loop, b)) continue;
        s->tried[b] |= OM_TRIED_GRASP;
        loop->npostponed += !s->is_fixed[b] && s->reachable[b];
    }
    s->is_visible = loop->is_exposed;
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        const ArmState* arm = &loop->arm[a];
        OmArmSituation* now = &s->arm[a];
        now->at = arm->at;
        now->in_hand = arm->in_hand;
        now->is_closed = arm->is_closed;
        bool is_holding = arm->in_hand >= 0;
        now->is_max_height =
            is_holding && (arm->is_at_top || arm->lift > loop->task.max_height - HEIGHT_TOLERANCE);
        now->is_max_force = is_holding && arm->is_max_force;
        double pulls = arm->lift / loop->task.pull_step;
        now->nlift = is_holding && pulls > 0 ? (int)(pulls + 0.5) : 0;
    }
}
