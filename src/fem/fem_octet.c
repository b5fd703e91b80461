// fem_octet.c: forces and tangents of hexahedra of neo-Hookean laws, eight elements at a time, one a lane.
//
// W = mu/2 (I1 - 3) + f(J). With g_a the rest gradient of shape function a and C = dJ/dF,
//
//     force on node a  w (mu F g_a + f' C g_a)
//     block (a, b)  w (mu g_a.g_b I + f'' (C g_a)(C g_b)^T + f' [F (g_a x g_b)]_x)
//
// where [v]_x is the skew matrix s(0,1) = v2, s(0,2) = -v1, s(1,2) = v0: the second derivative of the volume of a
// parallelepiped by two edges. The general code builds 81 numbers of d2W/dF2 and multiplies them by gradients
// twice. Lanes are independent, so an element's numbers do not depend on its neighbours in the batch.
#include <string.h>

#include "base/base_simd.h"
#include "fem/fem_solid.h"

bool om__octet_fits(const OmFemSolid* s) {
    bool fits = s->mesh.kind == OM_HEX8 && s->locking == OM_LOCKING_NONE && s->npoint == 8;
    for (int k = 0; k < s->nmaterial; ++k) fits = fits && om__law_is_neo(&s->law[k]);
    return fits;
}

typedef struct Point {  // of eight elements
    D8 g[8][3];         // rest gradients
    D8 F[3][3];         // columns
    D8 C[3][3];
    D8 energy, d, dd;  // w W, w f', w f''
    D8 mu;             // w mu
} Point;

// Missing elements are replaced by the last one.
static inline size_t lane_elem(const int* elem, int num, int lane) {
    return (size_t)elem[lane < num ? lane : num - 1];
}

static inline void load_nodes(const OmFemSolid* s, const int* elem, int num, const double* x,
                              D8 at[8][3]) {
    for (int l = 0; l < 8; ++l) {
        const int* node = s->mesh.elem_node + 8 * lane_elem(elem, num, l);
        for (int a = 0; a < 8; ++a)
            for (int c = 0; c < 3; ++c) at[a][c][l] = x[3 * (size_t)node[a] + (size_t)c];
    }
}

static inline void load_point(const OmFemSolid* s, const int* elem, int num, size_t q, D8 at[8][3],
                              Point* p) {
    for (int l = 0; l < 8; ++l) {
        const double* g = s->grad + 24 * (8 * lane_elem(elem, num, l) + q);
        for (int a = 0; a < 8; ++a)
            for (int c = 0; c < 3; ++c) p->g[a][c][l] = g[3 * a + c];
    }
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r) {
            D8 sum = splat8d(0);
            for (int a = 0; a < 8; ++a) sum += at[a][r] * p->g[a][c];
            p->F[c][r] = sum;
        }
    for (int c = 0; c < 3; ++c) {  // cross products of the other two columns
        D8 *y = p->F[(c + 1) % 3], *z = p->F[(c + 2) % 3];
        for (int r = 0; r < 3; ++r)
            p->C[c][r] = y[(r + 1) % 3] * z[(r + 2) % 3] - y[(r + 2) % 3] * z[(r + 1) % 3];
    }
    D8 J = p->F[0][0] * p->C[0][0] + p->F[0][1] * p->C[0][1] + p->F[0][2] * p->C[0][2];
    D8 square = splat8d(-3);
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r) square += p->F[c][r] * p->F[c][r];
    for (int l = 0; l < 8; ++l) {
        size_t e = lane_elem(elem, num, l);
        const OmLawParam* law = &s->law[s->mesh.elem_material[e]];
        double w = s->weight[8 * e + q];
        OmJet f = om__law_neo_volume(law, J[l]);
        p->energy[l] = w * (law->mu / 2 * square[l] + f.f);
        p->d[l] = w * f.d;
        p->dd[l] = w * f.dd;
        p->mu[l] = w * law->mu;
    }
}

OM_MULTIVERSION void om__octet_force(const OmFemSolid* s, const int* elem, int num, const double* x,
                                     double fe[8][24], double energy[8]) {
    D8 at[8][3], f[8][3] = {0}, sum = splat8d(0);
    Point p;
    load_nodes(s, elem, num, x, at);
    for (size_t q = 0; q < 8; ++q) {
        load_point(s, elem, num, q, at, &p);
        sum += p.energy;
        for (int a = 0; a < 8; ++a)
            for (int r = 0; r < 3; ++r)
                for (int c = 0; c < 3; ++c)
                    f[a][r] += (p.mu * p.F[c][r] + p.d * p.C[c][r]) * p.g[a][c];
    }
    for (int l = 0; l < num; ++l) {
        energy[l] = sum[l];
        for (int a = 0; a < 8; ++a)
            for (int r = 0; r < 3; ++r) fe[l][3 * a + r] = f[a][r][l];
    }
}

// Contribution of one point to the blocks (a, b), a <= b, by columns.
static inline void add_blocks(const Point* p, D8 K[36][9]) {
    D8 Cg[8][3], Fg[8][3];
    for (int a = 0; a < 8; ++a)
        for (int r = 0; r < 3; ++r) {
            Cg[a][r] = p->C[0][r] * p->g[a][0] + p->C[1][r] * p->g[a][1] + p->C[2][r] * p->g[a][2];
            Fg[a][r] = p->dd * Cg[a][r];
        }
    for (int a = 0, n = 0; a < 8; ++a)
        for (int b = a; b < 8; ++b, ++n) {
            const D8 *ga = p->g[a], *gb = p->g[b];
            D8* k = K[n];
            D8 dot = p->mu * (ga[0] * gb[0] + ga[1] * gb[1] + ga[2] * gb[2]);
            for (int c = 0; c < 3; ++c) {
                for (int r = 0; r < 3; ++r) k[3 * c + r] += Fg[a][r] * Cg[b][c];
                k[4 * c] += dot;
            }
            if (a == b) continue;
            D8 x = p->d * (ga[1] * gb[2] - ga[2] * gb[1]),
               y = p->d * (ga[2] * gb[0] - ga[0] * gb[2]);
            D8 z = p->d * (ga[0] * gb[1] - ga[1] * gb[0]);
            D8 v0 = p->F[0][0] * x + p->F[1][0] * y + p->F[2][0] * z;
            D8 v1 = p->F[0][1] * x + p->F[1][1] * y + p->F[2][1] * z;
            D8 v2 = p->F[0][2] * x + p->F[1][2] * y + p->F[2][2] * z;
            k[3] += v2, k[1] -= v2;  // row 0, column 1; and its opposite
            k[6] -= v1, k[2] += v1;
            k[7] += v0, k[5] -= v0;
        }
}

OM_MULTIVERSION void om__octet_tangent(const OmFemSolid* s, const int* elem, int num,
                                       const double* x, double block[8][36][9]) {
    D8 at[8][3], K[36][9];
    Point p;
    memset(K, 0, sizeof K);
    load_nodes(s, elem, num, x, at);
    for (size_t q = 0; q < 8; ++q) {
        load_point(s, elem, num, q, at, &p);
        add_blocks(&p, K);
    }
    for (int n = 0; n < 36; ++n)
        for (int i = 0; i < 9; ++i)
            for (int l = 0; l < num; ++l) block[l][n][i] = K[n][i][l];
}
