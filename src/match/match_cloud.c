// match_cloud.c: the Laplacian of points without triangles (Sharp and Crane 2020, section 5.7).
//
// Each point and its nearest points are projected to its tangent plane; the Delaunay triangles at the point go into one
// heap of triangles, where a triangle of a flat region appears three times, once for each corner. The heap is neither
// manifold nor oriented, which the cover of match_laplacian.c allows; a third of its matrix is the Laplacian.
//
// The triangles at a point come from its Voronoi cell: a square cut by the bisector of each neighbour, nearest first.
// Two neighbours whose sides meet at a corner of the cell make a triangle, and the corner is its circumcentre. A corner
// with a side of the square makes none: this is a border of the cloud, or a triangle wider than the neighbourhood.
#include <math.h>
#include <string.h>

#include "match/match_spectral_internal.h"
#include "omentum/shape_points.h"

#define NEIGHBOUR 24
#define MAX_CORNER (NEIGHBOUR + 8)

typedef struct Cell {  // a convex polygon around 0
    int num;           // corners
    double x[MAX_CORNER], y[MAX_CORNER];
    int side[MAX_CORNER];  // neighbour of the side from corner k to k + 1; -1: of the square
} Cell;

static Cell square(double half) {
    return (Cell){.num = 4,
                  .x = {-half, half, half, -half},
                  .y = {-half, -half, half, half},
                  .side = {-1, -1, -1, -1}};
}

// Keep the part that is nearer to 0 than to q: x . q <= |q|^2 / 2.
static void cut(Cell* cell, double qx, double qy, int neighbour) {
    double over[MAX_CORNER], half = 0.5 * (qx * qx + qy * qy);
    bool is_cut = false;
    for (int k = 0; k < cell->num; ++k) {
        over[k] = cell->x[k] * qx + cell->y[k] * qy - half;
        is_cut = is_cut || over[k] > 0;
    }
    if (!is_cut || cell->num > MAX_CORNER - 2) return;  // room for rounding; never full
    Cell old = *cell;
    cell->num = 0;
    for (int k = 0; k < old.num; ++k) {
        int next = (k + 1) % old.num, n = cell->num;
        if (over[k] <= 0) {
            cell->x[n] = old.x[k];
            cell->y[n] = old.y[k];
            cell->side[n] = old.side[k];
            cell->num = ++n;
        }
        if ((over[k] <= 0) == (over[next] <= 0)) continue;
        double t = over[k] / (over[k] - over[next]);  // one is positive, one is not
        cell->x[n] = old.x[k] + t * (old.x[next] - old.x[k]);
        cell->y[n] = old.y[k] + t * (old.y[next] - old.y[k]);
        cell->side[n] = over[k] <= 0 ? neighbour : old.side[k];
        ++cell->num;
    }
}

// The normal given, or that of the plane through the neighbours.
static OmVec3 tangent_normal(const double* x, const double* normal, int i, int num,
                             const int* near) {
    if (normal && om_norm2(om_load3(normal, i)) > 0.25) return om_load3(normal, i);
    OmVec3 mean, spread;
    return om_points_axes(x, num, near, &mean, &spread).cx;
}

// Triangles at point i into tri_vert, at most NEIGHBOUR; returns how many.
static int star(const OmPointTree* tree, const double* x, const double* normal, int i,
                int* tri_vert) {
    int near[NEIGHBOUR + 1],
        num = om_point_tree_find_many(tree, om_load3(x, i), NEIGHBOUR + 1, near);
    OmVec3 p = om_load3(x, i), n = tangent_normal(x, normal, i, num, near);
    OmVec3 u = fabs(n.x) < 0.6 ? om_vec3(1, 0, 0) : om_vec3(0, 1, 0);
    u = om_sub(u, om_scale(om_dot(u, n), n));  // |n.u| < 0.8: not zero
    u = om_scale(1 / om_norm(u), u);
    OmVec3 w = om_cross(n, u);
    double reach = om_norm(om_sub(om_load3(x, near[num - 1]), p));
    Cell cell = square(reach);
    for (int k = 0; k < num && reach > 0; ++k) {
        OmVec3 d = om_sub(om_load3(x, near[k]), p);
        double qx = om_dot(d, u), qy = om_dot(d, w);
        if (qx * qx + qy * qy > 1e-12 * reach * reach) cut(&cell, qx, qy, near[k]);
    }
    int ntri = 0;
    for (int k = 0; k < cell.num; ++k) {
        int before = cell.side[(k + cell.num - 1) % cell.num], after = cell.side[k];
        if (before < 0 || after < 0) continue;
        tri_vert[3 * ntri] = i;
        tri_vert[3 * ntri + 1] = before;
        tri_vert[3 * ntri + 2] = after;
        ++ntri;
    }
    return ntri;
}

OmStatus om_laplacian_init_cloud(int npoint, const double* x, const double* normal,
                                 OmLaplacian* laplacian) {
    memset(laplacian, 0, sizeof *laplacian);
    OM_CHECK(npoint >= 3 && npoint < INT32_MAX / (12 * NEIGHBOUR), OM_INVALID,
             "Laplacian: a cloud of %d points", npoint);
    OmStatus status = OM_OK;
    OmPointTree* tree = NULL;
    int ntri = 0, *tri_vert = NULL;
    OM_TRY_DONE(om_point_tree_create(npoint, x, &tree));
    OM_ALLOC_DONE(tri_vert, 3 * (size_t)npoint * MAX_CORNER);
    for (int i = 0; i < npoint; ++i) ntri += star(tree, x, normal, i, tri_vert + 3 * (size_t)ntri);
    OM_CHECK_DONE(ntri > 0, OM_INVALID, "Laplacian: the points of the cloud lie on a line");
    OM_TRY_DONE(om__laplacian_init(npoint, x, ntri, tri_vert, 1.0 / 3, laplacian));
done:
    om_point_tree_destroy(tree);
    om_free(tri_vert);
    return status;
}
