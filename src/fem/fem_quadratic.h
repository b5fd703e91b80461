// fem_quadratic.h: tetrahedra of ten nodes in the first pass of a step.
//
// With barycentric coordinates L_k the shape function of vertex a is L_a (2 L_a - 1), that of the midpoint of edge ab
// 4 L_a L_b. Their gradients are c_k grad L_k, summed over the two (vertices: the one) coordinates k of a node, with
// c_a = 4 L_a - 1 at a vertex, c_a = 4 L_b and c_b = 4 L_a at a midpoint. So at a quadrature point the element is a
// linear tetrahedron whose vertices are y_k = sum over nodes of c_k x: F, stress, blocks and forces of that
// tetrahedron come from the kernels of linear elements, and the weights c distribute them to the ten nodes.
//
// Four points with L = (a, b, b, b) integrate second order exactly: 24 strains for the 24 ways to deform, so no shape
// is without stiffness. They evaluate the law with lambda at most 2 mu. What lambda has above that is evaluated once,
// at the centroid (selective integration, Hughes 1980, without its lack of stiffness in sheets of one layer): at nu =
// 0.45 a beam of one cell is 6 % too stiff, as at 0.3, and not 17 %. Tried: all of lambda at the centroid, a sheet of
// one layer is 16 % too soft. An element leaves the blocks of the 45 pairs of nodes n < m, pair (0, 1) first, then ten
// forces.
#ifndef OMENTUM_FEM_QUADRATIC_H
#define OMENTUM_FEM_QUADRATIC_H

#include "fem/fem_simd.h"

#define OM__POINTS 5                        // the last is the centroid
#define OM__POINT_NEAR 0.58541019662496852  // a = (5 + 3 sqrt 5) / 20
#define OM__POINT_FAR 0.13819660112501052   // b = (5 - sqrt 5) / 20
#define OM__QUAD_FORCE (45 * 9)             // first float of the forces

/// Barycentric coordinates of each node; -1: none.
static const signed char om__node_end[10][2] = {{0, -1}, {1, -1}, {2, -1}, {3, -1}, {0, 1},
                                                {0, 2},  {0, 3},  {1, 2},  {1, 3},  {2, 3}};
/// Midpoint of the edge between two vertices.
static const signed char om__edge_mid[4][4] = {
    {-1, 4, 5, 6}, {4, -1, 7, 8}, {5, 7, -1, 9}, {6, 8, 9, -1}};
/// Block of two coordinates of a point, from make_blocks; the transpose where k > l.
static const signed char om__point_block[4][4] = {
    {0, 1, 2, 3}, {1, 4, 5, 6}, {2, 5, 7, 8}, {3, 6, 8, 9}};
static const signed char om__point_pair[10][2] = {{0, 0}, {0, 1}, {0, 2}, {0, 3}, {1, 1},
                                                  {1, 2}, {1, 3}, {2, 2}, {2, 3}, {3, 3}};

/// The i-th weight of node n at barycentric coordinates L.
OM__INLINE double om__node_weight(int n, int i, const double L[4]) {
    const signed char* end = om__node_end[n];
    return n < 4 ? 4 * L[n] - 1 : 4 * L[end[1 - i]];
}

/// Barycentric coordinates of a quadrature point.
OM__INLINE void om__point_at(int q, double L[4]) {
    for (int k = 0; k < 4; ++k) L[k] = q == 4 ? 0.25 : k == q ? OM__POINT_NEAR : OM__POINT_FAR;
}

/// Which part of the law a point evaluates, and its share of the element's volume.
OM__INLINE OmLawShare om__point_share(int q) { return q < 4 ? OM_SHARE_INNER : OM_SHARE_WIDE; }
OM__INLINE double om__point_volume(int q) { return q < 4 ? 0.25 : 1.0; }

/// The linear tetrahedron of a point with coordinates L, in double: y of its vertices, from the element's nodes.
OM__INLINE void om__point_vertices(const double* x, const int node[10], const double L[4],
                                   OmVec3 y[4]) {
    for (int k = 0; k < 4; ++k) y[k] = (OmVec3){0, 0, 0};
    for (int n = 0; n < 10; ++n)
        for (int i = 0; i < (n < 4 ? 1 : 2); ++i) {
            int k = om__node_end[n][i];
            y[k] = om_madd(y[k], om__node_weight(n, i, L), om_load3(x, node[n]));
        }
}

// ---- a batch ----------------------------------------------------------------------------------------

/// Nodes from 1 on relative to vertex 0; differences are taken in double.
OM__INLINE void gather_nodes(const OmFemBatch* b, const OmFemMids* mids, const double* x,
                             Lanes out[27]) {
    for (int l = 0; l < OM__LANE; ++l) {
        const double* x0 = x + 3 * (size_t)b->vert[0][l];
        for (int n = 1; n < 10; ++n) {
            size_t i = 3 * (size_t)(n < 4 ? b->vert[n][l] : mids->vert[n - 4][l]);
            for (size_t c = 0; c < 3; ++c)
                out[3 * (size_t)(n - 1) + c][l] = (float)(x[i + c] - x0[c]);
        }
    }
}

/// Edges y_k - y_0 of the linear tetrahedron of point q, as gather_edges gives them.
OM__INLINE void point_edges(Lanes in[27], int q, Lanes d[9]) {
    double L[4];
    om__point_at(q, L);
    for (int c = 0; c < 3; ++c) {
        V16 y[4];
        for (int k = 0; k < 4; ++k) {
            V16 sum = splat16(0);
            for (int j = 0; j < 4; ++j)
                if (j != k)
                    sum += load16(in[3 * (om__edge_mid[k][j] - 1) + c]) * (4.0F * (float)L[j]);
            if (k > 0) sum += load16(in[3 * (k - 1) + c]) * (4.0F * (float)L[k] - 1.0F);
            y[k] = sum;
        }
        for (int k = 1; k < 4; ++k) store16(d[3 * (k - 1) + c], y[k] - y[0]);
    }
}

/// Add what point q leaves, blocks of its ten pairs of coordinates and forces on its four vertices, to the nodes.
OM__INLINE void add_point(int q, Lanes block[90], Lanes force[12], Lanes out[OM__QUADRATIC]) {
    float weight[10][2];
    double L[4];
    om__point_at(q, L);
    for (int n = 0; n < 10; ++n)
        for (int i = 0; i < (n < 4 ? 1 : 2); ++i) weight[n][i] = (float)om__node_weight(n, i, L);
    for (int n = 0, pair = 0; n < 10; ++n)
        for (int m = n + 1; m < 10; ++m, ++pair) {
            V16 K[9];
            for (int c = 0; c < 9; ++c) K[c] = load16(out[9 * pair + c]);
            for (int i = 0; i < (n < 4 ? 1 : 2); ++i)
                for (int j = 0; j < (m < 4 ? 1 : 2); ++j) {
                    int k = om__node_end[n][i], l = om__node_end[m][j];
                    Lanes* b = &block[9 * om__point_block[k][l]];
                    float w = weight[n][i] * weight[m][j];
                    if (k <= l)
                        for (int c = 0; c < 9; ++c) K[c] += w * load16(b[c]);
                    else
                        for (int c = 0; c < 9; ++c) K[c] += w * load16(b[3 * (c % 3) + c / 3]);
                }
            for (int c = 0; c < 9; ++c) store16(out[9 * pair + c], K[c]);
        }
    for (int n = 0; n < 10; ++n)
        for (int i = 0; i < (n < 4 ? 1 : 2); ++i)
            for (int r = 0; r < 3; ++r) {
                float* f = out[OM__QUAD_FORCE + 3 * n + r];
                store16(f, load16(f) + weight[n][i] * load16(force[3 * om__node_end[n][i] + r]));
            }
}

/// The elements of a batch leave their records.
OM__INLINE void store_quadratic(const OmFemTurn* t, int batch, Lanes out[OM__QUADRATIC]) {
    float* left = t->turned + (size_t)batch * OM__LANE * OM__QUADRATIC;
    for (int l = 0; l < OM__LANE; l += 4)
        for (int n = 0; n < OM__QUADRATIC; n += 4)
            transpose4(&out[n][l], OM__LANE, left + l * OM__QUADRATIC + n, OM__QUADRATIC);
}

#endif
