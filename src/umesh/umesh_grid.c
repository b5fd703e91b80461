// umesh_grid.c: the surface of a grid, patches on it, conversion between values of nodes and of points.
#include <string.h>

#include "umesh/umesh_internal.h"

void om_umesh_grid_done(OmUmeshGrid* grid) {
    if (!grid) return;
    om_fem_grid_done(&grid->fem);
    om_free(grid->is_surface);
    om_free(grid->surface_x);
    *grid = (OmUmeshGrid){0};
}

// ---- creation ---------------------------------------------------------------------------------------

OmStatus om__umesh_grid_init(const OmGrid* points, OmVec3 up, const unsigned char* active,
                             OmUmeshGrid* g) {
    *g = (OmUmeshGrid){.up = up};
    OmStatus status = OM_OK;
    OM_TRY_DONE(om_fem_grid_init(points, active, &g->fem));
    OM_CALLOC_DONE(g->is_surface, g->fem.mesh.nnode);
    OM_CALLOC_DONE(g->surface_x, 3 * (size_t)g->fem.mesh.nnode);
done:
    if (status < 0) om_umesh_grid_done(g);
    return status;
}

OmStatus om__umesh_grid_find_surface(OmUmeshGrid* g) {
    OmFemFaces faces;
    OM_TRY(om_fem_mesh_boundary(&g->fem.mesh, &faces));
    memset(g->is_surface, 0, (size_t)g->fem.mesh.nnode);
    for (int n = 0; n < faces.nface * faces.nface_node; ++n)
        if (!g->fem.fixed[faces.face_node[n]]) g->is_surface[faces.face_node[n]] = 1;
    om_fem_faces_done(&faces);
    return OM_OK;
}

uint64_t om__umesh_grid_hash(const OmUmeshGrid* g) {
    size_t nnode = (size_t)g->fem.mesh.nnode;
    const double where[7] = {g->fem.grid.spacing,
                             g->fem.grid.origin.x,
                             g->fem.grid.origin.y,
                             g->fem.grid.origin.z,
                             g->up.x,
                             g->up.y,
                             g->up.z};
    uint64_t h = om_hash(g->fem.grid.dim, sizeof g->fem.grid.dim, OM_HASH_SEED);
    h = om_hash(where, sizeof where, h);
    h = om_hash(g->fem.cell_elem, (size_t)g->fem.npoint * sizeof(int), h);
    h = om_hash(g->fem.fixed, nnode, h);
    h = om_hash(g->is_surface, nnode, h);
    return om_hash(g->surface_x, 3 * nnode * sizeof(double), h);
}

// ---- patches ----------------------------------------------------------------------------------------

OmUmeshPatch om_umesh_patch_default(OmVec3 center, OmVec3 normal, OmVec3 along) {
    return (OmUmeshPatch){center, normal, along, {0.050, 0.010, 0.010}};
}

int om_umesh_patch_select(const OmUmeshGrid* g, const OmUmeshPatch* patch, unsigned char* mask) {
    OmVec3 across = om_cross(patch->normal, patch->along);
    int num = 0;
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        OmVec3 r = om_sub(om_load3(g->surface_x, i), patch->center);
        mask[i] = g->is_surface[i] && fabs(om_dot(r, patch->along)) <= 0.5 * patch->size[0] &&
                  fabs(om_dot(r, across)) <= 0.5 * patch->size[1] &&
                  fabs(om_dot(r, patch->normal)) <= patch->size[2];
        num += mask[i];
    }
    return num;
}

// ---- nodes and points -------------------------------------------------------------------------------

void om_umesh_scatter(const OmUmeshGrid* g, const float* u, const unsigned char* mask, float* out) {
    size_t npoint = (size_t)g->fem.npoint;
    memset(out, 0, 3 * npoint * sizeof *out);
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        if (mask && !mask[i]) continue;
        float* to = out + g->fem.node_point[i];
        for (size_t c = 0; c < 3; ++c) to[c * npoint] = u[3 * (size_t)i + c];
    }
}

void om_umesh_gather(const OmUmeshGrid* g, const float* in, float* u) {
    for (int i = 0; i < g->fem.mesh.nnode; ++i)
        for (size_t c = 0; c < 3; ++c)
            u[3 * (size_t)i + c] = in[c * (size_t)g->fem.npoint + (size_t)g->fem.node_point[i]];
}
