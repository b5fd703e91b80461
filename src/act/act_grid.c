// act_grid.c: the tissue cut into blocks, S_B of Alg. 4, and the grasping point of each.
#include <string.h>

#include "act/act_state.h"

_Static_assert(OM_SCENE_MAX_GRID <= OM_PLAN_MAX_GRID, "blocks of a scene fit the planner's arrays");

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

bool om__grid_loads(const Grid* grid, int block, OmVec3 p_world) {
    OmVec3 c = om_load3(grid->center, block), p = om__to_task(grid, p_world);
    double clear = om__grid_length(grid, ATTACHMENT_DISTANCE);
    return block_of(grid, p) == block || hypot(p.x - c.x, p.y - c.y) < clear;
}

bool om__grid_is_fixed_by(const Grid* grid, const OmTetMesh* mesh, const unsigned char* attached,
                          int block) {
    for (int i = 0; i < mesh->nvert; ++i)
        if (attached[i] && om__grid_loads(grid, block, om_load3(mesh->x, i))) return true;
    return false;
}

bool om__grid_is_fixed(const Grid* grid, const OmBody* body, int block) {
    return om__grid_is_fixed_by(grid, &om_body_site(body)->mesh, om_body_attached(body), block);
}
