// shape_refine.c: uniform refinement, eight tetrahedra from one (Bey 1995).
//
// Every edge gets a new vertex at its midpoint. The octahedron between the four corner tetrahedra is
// cut along the shortest of its three diagonals, so that repeated refinement does not degenerate the
// elements.
#include <stdlib.h>
#include <string.h>

#include "shape/shape_middles.h"

typedef struct Edge {
    int a, b;  // a < b
} Edge;

static int compare_edge(const void* p, const void* q) {
    const Edge *e = p, *f = q;
    if (e->a != f->a) return e->a < f->a ? -1 : 1;
    return e->b < f->b ? -1 : e->b > f->b;
}

static Edge tet_edge(const int* tet, int i) {
    int a = tet[om__tet_edge[i][0]], b = tet[om__tet_edge[i][1]];
    Edge e = {a < b ? a : b, a < b ? b : a};
    return e;
}

// All edges once, ascending.
static OmStatus list_edges(const OmTetMesh* mesh, Edge** edge, int* nedge) {
    size_t n = 6 * (size_t)mesh->ntet, kept = 0;
    OM_ALLOC(*edge, n);
    for (int t = 0; t < mesh->ntet; ++t) {
        for (int i = 0; i < 6; ++i)
            (*edge)[6 * (size_t)t + (size_t)i] = tet_edge(&mesh->tet_vert[4 * t], i);
    }
    qsort(*edge, n, sizeof(Edge), compare_edge);
    for (size_t i = 0; i < n; ++i) {
        if (i == 0 || compare_edge(&(*edge)[kept - 1], &(*edge)[i]) != 0)
            (*edge)[kept++] = (*edge)[i];
    }
    *nedge = (int)kept;
    return OM_OK;
}

static double volume6(const double* x, const int v[4]) {
    OmVec3 a = om_load3(x, v[0]);
    OmVec3 ab = om_sub(om_load3(x, v[1]), a), ac = om_sub(om_load3(x, v[2]), a);
    return om_dot(om_cross(ab, ac), om_sub(om_load3(x, v[3]), a));
}

static void cut_tet(const double* x, const int corner[4], const int mid[6], int out[8][4]) {
    // Middles: 0 = 01, 1 = 02, 2 = 03, 3 = 12, 4 = 13, 5 = 23.
    static const int at_corner[4][3] = {{0, 1, 2}, {0, 3, 4}, {1, 3, 5}, {2, 4, 5}};
    for (int c = 0; c < 4; ++c) {
        out[c][0] = corner[c];
        for (int k = 0; k < 3; ++k) out[c][k + 1] = mid[at_corner[c][k]];
    }
    // Opposite midpoints, and the ring of the four others around each such diagonal.
    static const int diagonal[3][2] = {{0, 5}, {1, 4}, {2, 3}};
    static const int ring[3][4] = {{1, 2, 4, 3}, {0, 2, 5, 3}, {0, 1, 5, 4}};
    int best = 0;
    double shortest = HUGE_VAL;
    for (int d = 0; d < 3; ++d) {
        double len =
            om_distance(om_load3(x, mid[diagonal[d][0]]), om_load3(x, mid[diagonal[d][1]]));
        if (len < shortest * (1 - 1e-12)) {
            shortest = len;
            best = d;
        }
    }
    for (int k = 0; k < 4; ++k) {
        out[4 + k][0] = mid[diagonal[best][0]];
        out[4 + k][1] = mid[diagonal[best][1]];
        out[4 + k][2] = mid[ring[best][k]];
        out[4 + k][3] = mid[ring[best][(k + 1) % 4]];
    }
    for (int e = 0; e < 8; ++e) {
        if (volume6(x, out[e]) >= 0) continue;
        int t = out[e][2];
        out[e][2] = out[e][3];
        out[e][3] = t;
    }
}

OmStatus om_tet_mesh_refine(OmTetMesh* mesh) { return om_tet_mesh_refine_nodes(mesh, NULL); }

OmStatus om_tet_mesh_refine_nodes(OmTetMesh* mesh, int** node) {
    Edge* edge = NULL;
    int nedge = 0, *all = NULL;
    if (node) *node = NULL;
    OmTetMesh fine = {0};
    OmStatus status = OM_OK;
    OM_CHECK_DONE(mesh->ntet <= INT32_MAX / 32, OM_INVALID,
                  "mesh of %d tetrahedra is too large to refine", mesh->ntet);
    OM_TRY_DONE(list_edges(mesh, &edge, &nedge));
    OM_TRY_DONE(om_tet_mesh_init(&fine, mesh->nvert + nedge, 8 * mesh->ntet));
    OM_TRY_DONE(om__mesh_add_middles(mesh, nedge, &edge->a, &fine));
    if (node) OM_ALLOC_DONE(all, 10 * (size_t)mesh->ntet);
    for (int t = 0; t < mesh->ntet; ++t) {
        int mid[6];
        for (int i = 0; i < 6; ++i) {
            Edge key = tet_edge(&mesh->tet_vert[4 * t], i);
            const Edge* found = bsearch(&key, edge, (size_t)nedge, sizeof key, compare_edge);
            mid[i] = mesh->nvert + (int)(found - edge);
        }
        if (all) {
            memcpy(all + 10 * (size_t)t, &mesh->tet_vert[4 * t], 4 * sizeof(int));
            memcpy(all + 10 * (size_t)t + 4, mid, sizeof mid);
        }
        int(*out)[4] = (int(*)[4]) & fine.tet_vert[32 * (size_t)t];
        cut_tet(fine.x, &mesh->tet_vert[4 * t], mid, out);
        for (int k = 0; k < 8; ++k) fine.tet_label[8 * t + k] = mesh->tet_label[t];
    }
    om_tet_mesh_done(mesh);
    *mesh = fine;
    memset(&fine, 0, sizeof fine);
    if (node) *node = all;
    all = NULL;
done:
    om_free(all);
    om_tet_mesh_done(&fine);
    om_free(edge);
    return status;
}

void om_tet_mesh_midpoint_ends(int ntet, const int* node, int nvert, int* end) {
    for (int t = 0; t < ntet; ++t)
        for (int k = 0; k < 6; ++k)
            for (int side = 0; side < 2; ++side)
                end[2 * (node[10 * t + 4 + k] - nvert) + side] =
                    node[10 * t + om__tet_edge[k][side]];
}
