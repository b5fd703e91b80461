// umesh_second.c: what drives the body away from the linear answer.
//
// Stress of the neo-Hookean law W = mu/2 (I1 - 3 - 2 ln J) + lambda/2 (ln J)^2 in powers of H = grad u is
//
//     P = mu (H + H^T) + lambda tr H I  -  mu H^T H^T - lambda (tr(H H)/2 I + tr H H^T)  +  O(H^3)
//
// Its second order, at the linear answer, is unbalanced: the nodal forces that it makes are to first order what the
// correction answers (second-order elasticity). They are cheap (one point an element) and smooth in u whatever u is,
// without the logarithms and inverses of the law itself; a network of ReLUs would have to spend its width on products.
// Elements are taken NLANE at a time, each quantity an array over them.
#include <string.h>

#include "umesh/umesh_internal.h"
#include "umesh/umesh_net_internal.h"

#define NLANE 8

typedef float Lanes[NLANE];

static void add(Lanes to, const Lanes from, int is_above) {
    float sign = is_above ? 1 : -1;
    for (int l = 0; l < NLANE; ++l) to[l] += sign * from[l];
}

// P2 of H, in units of mu.
static void find_stress(float lambda, Lanes H[3][3], Lanes P[3][3]) {
    Lanes trace, square = {0};
    for (int l = 0; l < NLANE; ++l) trace[l] = lambda * (H[0][0][l] + H[1][1][l] + H[2][2][l]);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            for (int l = 0; l < NLANE; ++l) {
                P[i][j][l] = -H[0][i][l] * H[j][0][l] - H[1][i][l] * H[j][1][l] -
                             H[2][i][l] * H[j][2][l] - trace[l] * H[j][i][l];
                square[l] += H[i][j][l] * H[j][i][l];
            }
    for (int i = 0; i < 3; ++i)
        for (int l = 0; l < NLANE; ++l) P[i][i][l] -= 0.5f * lambda * square[l];
}

void om__umesh_second_order(const OmUmeshGrid* g, double poisson, double size, const float* u,
                            float* force) {
    float lambda = (float)(2 * poisson / (1 - 2 * poisson));  // over mu
    // H = sum +-u / 4 h; what comes out is +-P2 h^2 / 4, over mu h^2, times h / size
    float grad = (float)(0.25 / g->spacing), share = (float)(-0.25 * g->spacing / size);
    memset(force, 0, 3 * (size_t)g->mesh.nnode * sizeof *force);
    for (int first = 0; first < g->mesh.nelem; first += NLANE) {
        int num = g->mesh.nelem - first < NLANE ? g->mesh.nelem - first : NLANE;
        const int* node = g->mesh.elem_node + 8 * (size_t)first;
        Lanes H[3][3] = {{{0}}}, P[3][3], value = {0};
        for (int a = 0; a < 8; ++a)
            for (int i = 0; i < 3; ++i) {
                for (int l = 0; l < num; ++l) value[l] = grad * u[3 * node[8 * l + a] + i];
                for (int j = 0; j < 3; ++j) add(H[i][j], value, om__umesh_corner[a][j]);
            }
        find_stress(lambda, H, P);
        for (int a = 0; a < 8; ++a)
            for (int i = 0; i < 3; ++i) {
                memset(value, 0, sizeof value);
                for (int j = 0; j < 3; ++j) add(value, P[i][j], om__umesh_corner[a][j]);
                for (int l = 0; l < num; ++l) force[3 * node[8 * l + a] + i] += share * value[l];
            }
    }
}
