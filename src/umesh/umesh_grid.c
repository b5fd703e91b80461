// umesh_grid.c: active cells of a regular grid as a mesh, and the way between its nodes and the points of
// the network.
//
//     points  0 1 2 3 4 5 6 7     x  padding          an element has the eight points of its cell,
//             x x o-o-o-o x x     o  node             and the cell the index of its lowest one
//             x o-o-o-o-o-o x     -  cell
#include <string.h>

#include "umesh/umesh_internal.h"

void om_umesh_grid_done(OmUmeshGrid* grid) {
    if (!grid) return;
    om_fem_mesh_done(&grid->mesh);
    om_free(grid->cell_elem);
    om_free(grid->point_node);
    om_free(grid->node_point);
    om_free(grid->fixed);
    om_free(grid->is_skin);
    om_free(grid->skin_x);
    *grid = (OmUmeshGrid){0};
}

// ---- making it --------------------------------------------------------------------------------------

const int om__umesh_corner[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                    {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};

static void cell_points(const int dim[3], int cell, int point[8]) {
    for (int a = 0; a < 8; ++a) {
        const int* step = om__umesh_corner[a];
        point[a] = cell + step[0] + dim[0] * (step[1] + dim[1] * step[2]);
    }
}

// The last point of a row begins no cell.
static bool is_cell(const int dim[3], int point) {
    return point % dim[0] < dim[0] - 1 && point / dim[0] % dim[1] < dim[1] - 1 &&
           point / (dim[0] * dim[1]) < dim[2] - 1;
}

static OmStatus number_nodes(OmUmeshGrid* g, const unsigned char* active) {
    int point[8];
    OmFemMesh* m = &g->mesh;
    *m = (OmFemMesh){.kind = OM_HEX8, .nelem_node = 8};
    for (int p = 0; p < g->npoint; ++p) g->point_node[p] = g->cell_elem[p] = -1;
    for (int c = 0; c < g->npoint; ++c) {
        if (!active[c]) continue;
        OM_CHECK(is_cell(g->dim, c), OM_INVALID, "umesh: cell %d is on the border of the grid", c);
        cell_points(g->dim, c, point);
        g->cell_elem[c] = m->nelem++;
        for (int a = 0; a < 8; ++a) g->point_node[point[a]] = 0;
    }
    OM_CHECK(m->nelem > 0, OM_INVALID, "umesh: the grid has no active cell");
    for (int p = 0; p < g->npoint; ++p)
        if (g->point_node[p] == 0) g->point_node[p] = m->nnode++;
    return OM_OK;
}

static OmStatus fill_mesh(OmUmeshGrid* g) {
    OmFemMesh* m = &g->mesh;
    OM_ALLOC(m->x, 3 * (size_t)m->nnode);
    OM_ALLOC(m->elem_node, 8 * (size_t)m->nelem);
    m->elem_material = om_calloc((size_t)m->nelem, sizeof(int));
    if (!m->elem_material) return OM_NO_MEMORY;
    OM_ALLOC(g->node_point, m->nnode);
    for (int p = 0; p < g->npoint; ++p) {
        int i = p % g->dim[0], j = p / g->dim[0] % g->dim[1], k = p / (g->dim[0] * g->dim[1]);
        int node = g->point_node[p], point[8];
        if (node >= 0) {
            g->node_point[node] = p;
            om_store3(m->x, node, om_madd(g->origin, g->spacing, om_vec3(i, j, k)));
        }
        if (g->cell_elem[p] < 0) continue;
        cell_points(g->dim, p, point);
        for (int a = 0; a < 8; ++a)
            m->elem_node[8 * (size_t)g->cell_elem[p] + (size_t)a] = g->point_node[point[a]];
    }
    return OM_OK;
}

OmStatus om__umesh_grid_init(const OmUmeshFrame* frame, const unsigned char* active,
                             OmUmeshGrid* g) {
    *g = (OmUmeshGrid){.spacing = frame->spacing, .origin = frame->origin, .up = frame->up};
    memcpy(g->dim, frame->dim, sizeof g->dim);
    OmStatus status = OM_OK;
    g->npoint = g->dim[0] * g->dim[1] * g->dim[2];
    OM_ALLOC_DONE(g->cell_elem, g->npoint);
    OM_ALLOC_DONE(g->point_node, g->npoint);
    OM_TRY_DONE(number_nodes(g, active));
    OM_TRY_DONE(fill_mesh(g));
    OM_CALLOC_DONE(g->fixed, g->mesh.nnode);
    OM_CALLOC_DONE(g->is_skin, g->mesh.nnode);
    OM_CALLOC_DONE(g->skin_x, 3 * (size_t)g->mesh.nnode);
    OM_TRY_DONE(om_fem_mesh_validate(&g->mesh));
done:
    if (status < 0) om_umesh_grid_done(g);
    return status;
}

OmStatus om__umesh_grid_find_skin(OmUmeshGrid* g) {
    OmFemFaces faces;
    OM_TRY(om_fem_mesh_boundary(&g->mesh, &faces));
    memset(g->is_skin, 0, (size_t)g->mesh.nnode);
    for (int n = 0; n < faces.nface * faces.nface_node; ++n)
        if (!g->fixed[faces.face_node[n]]) g->is_skin[faces.face_node[n]] = 1;
    om_fem_faces_done(&faces);
    return OM_OK;
}

uint64_t om__umesh_grid_hash(const OmUmeshGrid* g) {
    size_t nnode = (size_t)g->mesh.nnode;
    const double where[7] = {g->spacing, g->origin.x, g->origin.y, g->origin.z,
                             g->up.x,    g->up.y,     g->up.z};
    uint64_t h = om_hash(g->dim, sizeof g->dim, OM_HASH_SEED);
    h = om_hash(where, sizeof where, h);
    h = om_hash(g->cell_elem, (size_t)g->npoint * sizeof(int), h);
    h = om_hash(g->fixed, nnode, h);
    h = om_hash(g->is_skin, nnode, h);
    return om_hash(g->skin_x, 3 * nnode * sizeof(double), h);
}

// ---- patches ----------------------------------------------------------------------------------------

OmUmeshPatch om_umesh_patch_default(OmVec3 center, OmVec3 normal, OmVec3 along) {
    return (OmUmeshPatch){center, normal, along, {0.050, 0.010, 0.010}};
}

int om_umesh_patch_select(const OmUmeshGrid* g, const OmUmeshPatch* patch, unsigned char* mask) {
    OmVec3 across = om_cross(patch->normal, patch->along);
    int num = 0;
    for (int i = 0; i < g->mesh.nnode; ++i) {
        OmVec3 r = om_sub(om_load3(g->skin_x, i), patch->center);
        mask[i] = g->is_skin[i] && fabs(om_dot(r, patch->along)) <= 0.5 * patch->size[0] &&
                  fabs(om_dot(r, across)) <= 0.5 * patch->size[1] &&
                  fabs(om_dot(r, patch->normal)) <= patch->size[2];
        num += mask[i];
    }
    return num;
}

// ---- nodes and points -------------------------------------------------------------------------------

void om_umesh_scatter(const OmUmeshGrid* g, const float* u, const unsigned char* mask, float* out) {
    size_t npoint = (size_t)g->npoint;
    memset(out, 0, 3 * npoint * sizeof *out);
    for (int i = 0; i < g->mesh.nnode; ++i) {
        if (mask && !mask[i]) continue;
        float* to = out + g->node_point[i];
        for (size_t c = 0; c < 3; ++c) to[c * npoint] = u[3 * (size_t)i + c];
    }
}

void om_umesh_gather(const OmUmeshGrid* g, const float* in, float* u) {
    for (int i = 0; i < g->mesh.nnode; ++i)
        for (size_t c = 0; c < 3; ++c)
            u[3 * (size_t)i + c] = in[c * (size_t)g->npoint + (size_t)g->node_point[i]];
}
