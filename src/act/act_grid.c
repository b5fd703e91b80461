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

static OmVec3 middle(const int v[4], const double* x) {
    return om_scale(0.25, om_add(om_add(om_load3(x, v[0]), om_load3(x, v[1])),
                                 om_add(om_load3(x, v[2]), om_load3(x, v[3]))));
}

OmVec3 om__grid_point(const Grid* g, const double* x, int block) {
    return middle(g->face[block], x);
}

// The faces of shells all of whose vertices are on top.
static OmStatus find_faces(const OmSite* site, const OmMeshSet* top, int** face, int* n) {
    unsigned char* is_top = om_calloc((size_t)site->mesh.nvert, 1);
    OmStatus status = is_top ? om_tet_mesh_find_cells(&site->mesh, face) : OM_NO_MEMORY;
    for (int i = 0; is_top && i < top->nvert; ++i) is_top[top->vert[i]] = 1;
    for (int f = 0; status == OM_OK && f < site->mesh.ntet / 3; ++f) {  // below and above each cell
        int v[4];
        memcpy(v, *face + 4 * (size_t)f, sizeof v);
        if (!is_top[v[0]] || !is_top[v[1]] || !is_top[v[2]] || !is_top[v[3]]) continue;
        memcpy(*face + 4 * (size_t)(*n)++, v, sizeof v);
    }
    om_free(is_top);
    return status;
}

// Places where tissue may be grasped: the vertices on top, of shells the faces there.  (n x 4)
static OmStatus find_places(const OmSite* site, int** face, int* n) {
    const OmMeshSet* top = om_tet_mesh_find_set(&site->mesh, "top");
    OM_CHECK(top, OM_INVALID, "the tissue has no set \"top\" to grasp");
    if (site->element == OM_ELEMENT_SHELL) return find_faces(site, top, face, n);
    *n = top->nvert;
    OM_ALLOC(*face, 4 * (size_t)top->nvert);
    for (int k = 0; k < 4 * top->nvert; ++k) (*face)[k] = top->vert[k / 4];
    return OM_OK;
}

// The place nearest to the middle of each block, seen from above.
static int choose_places(Grid* grid, const OmSite* site, int n, const int* face) {
    const OmPose to_task = om_pose_inverse(grid->task);
    const double* x = site->mesh.x;
    double best[OM_PLAN_MAX_BLOCK];
    int ngrasp = 0;
    for (int i = 0; i < n; ++i) {
        const int* v = face + 4 * (size_t)i;
        OmVec3 p = om_pose_apply(to_task, middle(v, x));
        int b = block_of(grid, p);
        OmVec3 c = om_load3(grid->center, b);
        double d = (p.x - c.x) * (p.x - c.x) + (p.y - c.y) * (p.y - c.y);
        if (grid->vert[b] >= 0 && d >= best[b]) continue;
        best[b] = d;
        ngrasp += grid->vert[b] < 0;
        memcpy(grid->face[b], v, sizeof grid->face[b]);
        grid->vert[b] = v[0];
    }
    return ngrasp;
}

OmStatus om__grid_build(const OmSceneTask* task, const OmSite* site, Grid* grid) {
    memset(grid, 0, sizeof *grid);
    // a scene need not come from a file
    OM_CHECK(task->grid >= 1 && task->grid <= OM_PLAN_MAX_GRID, OM_INVALID,
             "task: grid: %d is outside its range, 1 to %d", task->grid, OM_PLAN_MAX_GRID);
    grid->n = task->grid;
    grid->task = site->pose_world_task;
    grid->half = site->half_size;
    OmPose to_task = om_pose_inverse(grid->task);
    int nblock = grid->n * grid->n, n = 0, *face = NULL;
    for (int b = 0; b < nblock; ++b) {
        grid->vert[b] = -1;
        OmVec3 c = om_vec3(((b % grid->n + 0.5) / grid->n * 2 - 1) * grid->half.x,
                           ((b / grid->n + 0.5) / grid->n * 2 - 1) * grid->half.y, 0);
        om_store3(grid->center, b, c);
    }
    OM_TRY(find_places(site, &face, &n));
    const int ngrasp = choose_places(grid, site, n, face);
    om_free(face);
    // The height of a block is that of its grasping point: distances are in space.
    for (int b = 0; b < nblock; ++b) {
        if (grid->vert[b] < 0) continue;
        grid->tip[b] = om_pose_apply(to_task, om__grid_point(grid, site->mesh.x, b));
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
