// solve_common.h: what the tests and the benchmark of `solve` share: a box of tetrahedra and a plain
// assembler of M + h^2 K for linear elasticity, written for reading, not for speed.
#ifndef OMENTUM_SOLVE_COMMON_H
#define OMENTUM_SOLVE_COMMON_H

#include "omentum/shape.h"
#include "omentum/solve.h"

typedef struct Elastic {  // material and step
    double young, poisson, density, h;
    double mass_share;                            // 1: dynamics, 0: statics
    double (*stiffer)(const double* x, void* c);  // factor on young at a centroid; null is 1
    void* ctx;
} Elastic;

static inline Elastic elastic_tissue(void) {
    return (Elastic){.young = 3e3, .poisson = 0.45, .density = 1000, .h = 0.02, .mass_share = 1};
}

// Gradients of the four shape functions (columns of g) and the volume.
static inline double tet_gradients(const OmTetMesh* mesh, int e, OmVec3 g[4]) {
    const int* v = mesh->tet_vert + 4 * (size_t)e;
    OmVec3 a = om_load3(mesh->x, v[0]);
    OmVec3 e1 = om_sub(om_load3(mesh->x, v[1]), a), e2 = om_sub(om_load3(mesh->x, v[2]), a),
           e3 = om_sub(om_load3(mesh->x, v[3]), a);
    double det = om_dot(om_cross(e1, e2), e3);
    g[1] = om_scale(1 / det, om_cross(e2, e3));
    g[2] = om_scale(1 / det, om_cross(e3, e1));
    g[3] = om_scale(1 / det, om_cross(e1, e2));
    g[0] = om_scale(-1, om_add(g[1], om_add(g[2], g[3])));
    return det / 6;
}

// A = M + h^2 K of small-strain linear elasticity.
static inline void assemble_elastic(const OmTetMesh* mesh, const Elastic* el, OmBsr* A) {
    om_bsr_zero(A);
    for (int e = 0; e < mesh->ntet; ++e) {
        const int* v = mesh->tet_vert + 4 * (size_t)e;
        OmVec3 g[4], c = {0};
        double volume = tet_gradients(mesh, e, g);
        for (int a = 0; a < 4; ++a) c = om_madd(c, 0.25, om_load3(mesh->x, v[a]));
        double young = el->young * (el->stiffer ? el->stiffer(&c.x, el->ctx) : 1);
        double s = el->h * el->h * volume;
        double lambda = young * el->poisson / ((1 + el->poisson) * (1 - 2 * el->poisson));
        double mu = young / (2 * (1 + el->poisson));
        for (int a = 0; a < 4; ++a) {
            for (int b = 0; b < 4; ++b) {
                OmMat3 k = om_mat3_add(om_mat3_scale(s * lambda, om_mat3_outer(g[a], g[b])),
                                       om_mat3_scale(s * mu, om_mat3_outer(g[b], g[a])));
                double d = s * mu * om_dot(g[a], g[b]);
                if (a == b) d += el->mass_share * el->density * volume / 4;
                k = om_mat3_add(k, om_mat3_diag(om_vec3(d, d, d)));
                om_bsr_add(A, om_bsr_find(A, v[a], v[b]), k);
            }
        }
    }
}

#endif
