// fem_simd.h: four floats at a time, in the compiler's portable vector types, and the start of both
// first passes: the deformation gradients of a batch.
#ifndef OMENTUM_FEM_SIMD_H
#define OMENTUM_FEM_SIMD_H

#include <string.h>

#include "base/base_simd.h"
#include "fem/fem_internal.h"

/// Four rows `from` floats apart to four columns `to` floats apart.
OM__INLINE void transpose4(const float* in, int from, float* out, int to) {
    V4 a = load4(in), b = load4(in + from), c = load4(in + 2 * from), d = load4(in + 3 * from);
    V4 ab = __builtin_shufflevector(a, b, 0, 4, 1, 5),
       cd = __builtin_shufflevector(c, d, 0, 4, 1, 5);
    V4 AB = __builtin_shufflevector(a, b, 2, 6, 3, 7),
       CD = __builtin_shufflevector(c, d, 2, 6, 3, 7);
    store4(out, __builtin_shufflevector(ab, cd, 0, 1, 4, 5));
    store4(out + to, __builtin_shufflevector(ab, cd, 2, 3, 6, 7));
    store4(out + 2 * to, __builtin_shufflevector(AB, CD, 0, 1, 4, 5));
    store4(out + 3 * to, __builtin_shufflevector(AB, CD, 2, 3, 6, 7));
}

// ---- a batch of elements ----------------------------------------------------------------------------

typedef float Lanes[OM__LANE];

/// Edges of the elements and their rates, as floats: differences are taken in double.
OM__INLINE void gather_edges(const OmFemTurn* t, const OmFemBatch* batch, Lanes d[9], Lanes w[9]) {
    for (int l = 0; l < OM__LANE; ++l) {
        const double *x0 = t->x + 3 * (size_t)batch->vert[0][l],
                     *v0 = t->v + 3 * (size_t)batch->vert[0][l];
        for (int k = 0; k < 3; ++k) {
            const double *x = t->x + 3 * (size_t)batch->vert[k + 1][l],
                         *v = t->v + 3 * (size_t)batch->vert[k + 1][l];
            for (int c = 0; c < 3; ++c) {
                d[3 * k + c][l] = (float)(x[c] - x0[c]);
                w[3 * k + c][l] = (float)(v[c] - v0[c]);
            }
        }
    }
}

/// F, and F' = F + lag dF/dt, by columns.
OM__INLINE void make_gradients(const OmFemBatch* batch, float lag, Lanes d[9], Lanes w[9],
                               Lanes F[9], Lanes G[9]) {
    for (int l = 0; l < OM__LANE; ++l)
        for (int c = 0; c < 3; ++c) {
            float g0 = batch->grad[c][l], g1 = batch->grad[3 + c][l], g2 = batch->grad[6 + c][l];
            for (int r = 0; r < 3; ++r) {
                float f = d[r][l] * g0 + d[3 + r][l] * g1 + d[6 + r][l] * g2;
                float rate = w[r][l] * g0 + w[3 + r][l] * g1 + w[6 + r][l] * g2;
                F[3 * c + r][l] = f;
                G[3 * c + r][l] = f + lag * rate;
            }
        }
}

#endif
