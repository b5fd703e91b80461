// fem_grid_second.c: the forces of second order that linear elasticity leaves out.
//
// Stress of the neo-Hookean law W = mu/2 (I1 - 3 - 2 ln J) + lambda/2 (ln J)^2 in powers of H = grad u is
//
//     P = mu (H + H^T) + lambda tr H I  -  mu H^T H^T - lambda (tr(H H)/2 I + tr H H^T)  +  O(H^3)
//
// At the linear solution the terms of second order are not in balance. Their nodal forces determine the correction to
// first order (second-order elasticity), so a network that learns the correction gets them as input. They are cheap
// (one point an element) and smooth for any u, without the logarithms and inverses of the law; a network of ReLUs would
// need width to approximate products. NLANE elements are computed at a time, each quantity a vector over them.
#include <string.h>

#include "base/base_simd.h"
#include "fem/fem_grid_internal.h"

#define NLANE 8

// P2 of H, in units of mu.
OM_INLINE void find_stress(float lambda, V8 H[3][3], V8 P[3][3]) {
    const V8 trace = lambda * (H[0][0] + H[1][1] + H[2][2]);
    V8 square = {0};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            P[i][j] =
                -(H[0][i] * H[j][0] + H[1][i] * H[j][1] + H[2][i] * H[j][2]) - trace * H[j][i];
            square += H[i][j] * H[j][i];
        }
    for (int i = 0; i < 3; ++i) P[i][i] -= 0.5f * lambda * square;
}

static const float sign[2] = {-1, 1};

OM_MULTIVERSION void om_fem_grid_second_order(const OmFemGrid* g, double poisson, double size,
                                              const float* u, float* force) {
    const float lambda = (float)(2 * poisson / (1 - 2 * poisson));  // over mu
    // H = sum +-u / 4 h; force = +-P2 h^2 / 4, over mu h^2, times h / size
    const float grad = (float)(0.25 / g->grid.spacing),
                scale = (float)(-0.25 * g->grid.spacing / size);
    memset(force, 0, 3 * (size_t)g->mesh.nnode * sizeof *force);
    for (int first = 0; first < g->mesh.nelem; first += NLANE) {
        const int num = g->mesh.nelem - first < NLANE ? g->mesh.nelem - first : NLANE;
        const int* node = g->mesh.elem_node + 8 * (size_t)first;
        V8 H[3][3] = {{{0}}}, P[3][3];
        for (int a = 0; a < 8; ++a) {
            V8 value[3] = {{0}};
            for (int l = 0; l < num; ++l)
                for (int i = 0; i < 3; ++i)
                    value[i][l] = u[3 * (size_t)node[8 * l + a] + (size_t)i];
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j) H[i][j] += sign[om__grid_corner[a][j]] * value[i];
        }
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) H[i][j] *= grad;
        find_stress(lambda, H, P);
        for (int a = 0; a < 8; ++a)
            for (int i = 0; i < 3; ++i) {
                const int* corner = om__grid_corner[a];
                V8 value = scale * (sign[corner[0]] * P[i][0] + sign[corner[1]] * P[i][1] +
                                    sign[corner[2]] * P[i][2]);
                for (int l = 0; l < num; ++l)
                    force[3 * (size_t)node[8 * l + a] + (size_t)i] += value[l];
            }
    }
}
