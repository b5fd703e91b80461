// fem_shell.h: solid-shell hexahedra, in double and in batches.
//
// The displacement of eight nodes is affine, with the mean gradient F of the cell, plus hourglass patterns h_j: xi eta,
// eta zeta, zeta xi and xi eta zeta, zeta through the thickness. With q_j = sum_a hour_ja x_a the share of pattern j
// (no affine map has one), R the rotation of F, and d = R^T q,
//
//     E = V/2 (W(F + R B d) + W(F - R B d)) + 1/2 d . k d
//
// W is any law, at two points above each other in the middle of the cell, where the patterns add the strain +- B d:
// bending follows the law. What else the patterns do within a cell has the stiffness k, 12 x 12. Both are those of a
// solid-shell with assumed transverse shear and thickness strain and seven enhanced strains at rest (fem_shell.c). So
// uniform strain is exact in any cell, thin cells do not lock, and the patterns keep their stiffness under compression,
// where enhanced strains alone are known to form hourglasses. R turns with x. With A = R^T P at a point, the patterns
// feel p = k d +- V/2 B^T sym(A), the torque on R is
//
//     t = sum_i d_i x p_i - sum over points of +- V/2 axial(A (B d)),  axial(M) = (M32 - M23, M13 - M31, M21 - M12),
//
// and with tau = (tr S I - S)^-1 t, S = R^T F, the force on node a is minus V P g_a + R (sum_i hour_ia p_i - tau x
// g_a), P the mean of both points. Where a corner would be crushed, the volume ratios J at the eight points of Gauss
// resist:
//
//     E += V/8 sum (lambda + mu)/2 (ln J/J0)^2  where J < J0 = 0.3,
//
// for k alone has no limit: cells beside a grasp stayed folded at a corner. Tried: one point and all of k at rest: a
// sheet that is lifted was 4.6 % too stiff, for neo-Hookean laws soften under tension. The tangents of the law at both
// points, turned with R: one linearisation is as near as with k at rest, and a step takes longer.
#ifndef OMENTUM_FEM_SHELL_H
#define OMENTUM_FEM_SHELL_H

#include "fem/fem_frame.h"

#define OM__SHELL_NODE 8
#define OM__SHELL_PAIR 28
#define OM__SHELL_FORCE (9 * OM__SHELL_PAIR)  // first float of the forces
#define OM__SHELL_CRUSHED 0.3                 // J0
#define OM__MIN_TURN 0.1                      // of the sum of two stretches that tau is divided by

typedef struct OmFemShell {          // an element, in double
    double volume;                   // m^3
    double grad[OM__SHELL_NODE][3];  // mean gradients of the shape functions at rest, 1/m
    double hour[4][OM__SHELL_NODE];  // of the patterns, 1
    double stiff[12][12];            // k, N/m; row 3 i + c is component c of pattern i
    double strain[6][12];            // B, 1/m; rows 11, 22, 33, 2 12, 2 13, 2 23
} OmFemShell;

/// The elements of a model; fem->shell and the lanes of fem->shells.
OmStatus om__fem_shell_make(const OmTissueModel* m, OmFem* fem);
/// What resists where J < J0: its energy over V mu is returned; slopes by x (24) and blocks of the pairs a < b, by
/// columns (28 x 9), projected, are added where not null.
/// @param F, q  of lane l: the mean gradient by columns, and the shares of the patterns
double om__fem_shell_resist(const OmTissueModel* m, int e, const V16 F[9], const V16 q[12], int l,
                            double* slope, double* block);
/// The same in double.
double om__fem_shell_resist_at(const OmTissueModel* m, int e, const double F[9], const double q[12],
                               double* slope, double* block);
/// Strains (11, 22, 33, 2 12, 2 13, 2 23) that the patterns, d of the head, add at the centroids of the six tetrahedra
/// of element e.
void om__fem_shell_strains(const OmTissueModel* m, int e, const double d[12], double strain[6][6]);

// ---- a batch ----------------------------------------------------------------------------------------

/// Nodes from 1 on relative to node 0; differences are taken in double.
OM__INLINE void gather_shell(const OmFemShells* s, const double* x, Lanes out[21]) {
    for (int l = 0; l < OM__LANE; ++l) {
        const double* x0 = x + 3 * (size_t)s->vert[0][l];
        for (int a = 1; a < OM__SHELL_NODE; ++a)
            for (int c = 0; c < 3; ++c)
                out[3 * (a - 1) + c][l] = (float)(x[3 * (size_t)s->vert[a][l] + (size_t)c] - x0[c]);
    }
}

/// The mean gradient, by columns, and the shares of the patterns.
OM__INLINE void split_shell(const OmFemShells* s, Lanes node[21], V16 F[9], V16 q[12]) {
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) F[3 * c + r] = splat16(0);
        for (int i = 0; i < 4; ++i) q[3 * i + r] = splat16(0);
        for (int a = 1; a < OM__SHELL_NODE; ++a) {
            V16 x = load16(node[3 * (a - 1) + r]);
            for (int c = 0; c < 3; ++c) F[3 * c + r] += x * load16(s->grad[3 * a + c]);
            for (int i = 0; i < 4; ++i) q[3 * i + r] += x * load16(s->hour[8 * i + a]);
        }
    }
}

/// The smallest det of dx / dX at the middle and the points of Gauss of each cell, with the slopes of a parallelepiped
/// that has the mean gradients.
OM__INLINE V16 least_ratio(const OmFemShells* s, const V16 F[9], const V16 q[12]) {
    // slopes of xi, eta, zeta: of the functions that are -1 and 1 at their nodes
    static const float sign[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                     {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
    V16 slope[9], at[9], cof[3], J = splat16(0);
    for (int n = 0; n < 9; ++n) {
        slope[n] = splat16(0);
        for (int a = 0; a < OM__SHELL_NODE; ++a)
            slope[n] += sign[a][n / 3] * load16(s->grad[3 * a + n % 3]);
    }
    for (int n = 0; n < 9; ++n) {
        float g = n < 8 ? 0.57735027F : 0.0F, x = g * sign[n % 8][0], y = g * sign[n % 8][1],
              z = g * sign[n % 8][2];
        const float dh[4][3] = {{y, x, 0}, {0, z, y}, {z, 0, x}, {y * z, z * x, x * y}};
        for (int c = 0; c < 3; ++c)
            for (int r = 0; r < 3; ++r) {
                at[3 * c + r] = F[3 * c + r];
                for (int j = 0; j < 4; ++j)
                    for (int i = 0; i < 3; ++i)
                        at[3 * c + r] += q[3 * j + r] * (dh[j][i] * slope[3 * i + c]);
            }
        cross3(at + 3, at + 6, cof);
        V16 ratio = dot3(at, cof);
        J = n == 0 ? ratio : select16(ratio < J, ratio, J);
        J = select16(ratio == ratio, J, ratio);  // not a number stays
    }
    return J;
}

/// R = U V^T, by columns; the identity where the law is linear.
OM__INLINE void turn_of(const OmFemShells* s, const V16 U[9], const V16 V[9], V16 R[9]) {
    V16 turns = load16(s->turns);
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r) {
            V16 sum = U[r] * V[c] + U[3 + r] * V[3 + c] + U[6 + r] * V[6 + c];
            R[3 * c + r] = select16(turns > 0.5F, sum, splat16(r == c ? 1.0F : 0.0F));
        }
}

/// d = R^T q, p = k d over V mu, and e = B d.
OM__INLINE void push_patterns(const OmFemShells* s, const V16 R[9], const V16 q[12], V16 d[12],
                              V16 p[12], V16 e[6]) {
    for (int i = 0; i < 4; ++i)
        for (int r = 0; r < 3; ++r) {
            d[3 * i + r] = dot3(R + 3 * r, q + 3 * i);
            p[3 * i + r] = splat16(0);
        }
    for (int i = 0, at = 0; i < 4; ++i)
        for (int j = i; j < 4; ++j)
            for (int c = 0; c < 3; ++c)
                for (int r = 0; r < 3; ++r, ++at) {
                    V16 k = load16(s->stiff[at]);
                    p[3 * i + r] += k * d[3 * j + c];
                    if (i != j) p[3 * j + c] += k * d[3 * i + r];
                }
    for (int v = 0; v < 6; ++v) {
        e[v] = splat16(0);
        for (int n = 0; n < 12; ++n) e[v] += load16(s->strain[12 * v + n]) * d[n];
    }
}

/// p += scale B^T s, with s of the work s . de.
OM__INLINE void pull_patterns(const OmFemShells* s, const V16 stress[6], V16 scale, V16 p[12]) {
    for (int v = 0; v < 6; ++v)
        for (int n = 0; n < 12; ++n) p[n] += scale * load16(s->strain[12 * v + n]) * stress[v];
}

/// The strain e as a matrix, by columns.
OM__INLINE void symmetric_shell(const V16 e[6], V16 sym[9]) {
    for (int v = 0; v < 3; ++v) sym[4 * v] = e[v];
    sym[1] = sym[3] = 0.5F * e[3];
    sym[2] = sym[6] = 0.5F * e[4];
    sym[5] = sym[7] = 0.5F * e[5];
}

/// F + side R e.
OM__INLINE void point_of_shell(const V16 F[9], const V16 R[9], const V16 e[6], float side,
                               V16 out[9]) {
    V16 sym[9];
    symmetric_shell(e, sym);
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
            out[3 * c + r] = F[3 * c + r] + side * (R[r] * sym[3 * c] + R[3 + r] * sym[3 * c + 1] +
                                                    R[6 + r] * sym[3 * c + 2]);
}

#endif
