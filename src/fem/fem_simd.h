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

// ---- a batch of cells -----------------------------------------------------------------------------------

/// F, and F' = F + lag dF/dt, by columns, of OM__LANE cells from `first` on; the last cell repeats.
OM__INLINE void gather_cells(const OmFemTurn* t, int first, Lanes F[9], Lanes G[9]) {
    const OmFemCells* c = t->cells;
    for (int l = 0; l < OM__LANE; ++l) {
        int k = first + l < c->ncell ? first + l : c->ncell - 1;
        const double *x0 = t->x + 3 * (size_t)c->vert[k], *v0 = t->v + 3 * (size_t)c->vert[k];
        V4 f[3] = {splat4(0), splat4(0), splat4(0)}, w[3] = {splat4(0), splat4(0), splat4(0)};
        for (int at = c->adr[k]; at < c->adr[k + 1]; ++at) {
            const OmFemEntry* n = &c->entry[at];
            const double *x = t->x + 3 * (size_t)n->index, *v = t->v + 3 * (size_t)n->index;
            V4 dx = {(float)(x[0] - x0[0]), (float)(x[1] - x0[1]), (float)(x[2] - x0[2]), 0};
            V4 dv = {(float)(v[0] - v0[0]), (float)(v[1] - v0[1]), (float)(v[2] - v0[2]), 0};
            for (int col = 0; col < 3; ++col) {
                f[col] += dx * splat4(n->g[col]);
                w[col] += dv * splat4(n->g[col]);
            }
        }
        for (int col = 0; col < 3; ++col)
            for (int r = 0; r < 3; ++r) {
                F[3 * col + r][l] = f[col][r];
                G[3 * col + r][l] = f[col][r] + t->lag * w[col][r];
            }
    }
}

/// Twelve rows of lanes, columns of four, to the records of the batch's cells.
OM__INLINE void store_cells(const OmFemTurn* t, int first, int place, Lanes in[12]) {
    for (int l = 0; l < OM__LANE; l += 4)
        for (int n = 0; n < 12; n += 4)
            transpose4(&in[n][l], OM__LANE,
                       t->cell + (size_t)OM__CELLED * (size_t)(first + l) + place + n, OM__CELLED);
}

/// Means of the cells of a batch of elements: F becomes the mean, and `apart` G minus the mean of F'.
OM__INLINE void take_means(const OmFemTurn* t, int first, Lanes F[9], Lanes G[9], Lanes apart[9]) {
    for (int l = 0; l < OM__LANE; ++l) {
        int e = first + l < t->model->mesh.ntet ? first + l : t->model->mesh.ntet - 1;
        const int* cell = t->cells->tet_cell + 4 * (size_t)e;
        V4 f[3] = {splat4(0), splat4(0), splat4(0)}, g[3] = {splat4(0), splat4(0), splat4(0)};
        for (int a = 0; a < 4; ++a) {
            const float* record = t->cell + (size_t)OM__CELLED * (size_t)cell[a];
            for (int col = 0; col < 3; ++col) {
                f[col] += load4(record + OM__CELL_F + 4 * col);
                g[col] += load4(record + OM__CELL_G + 4 * col);
            }
        }
        for (int col = 0; col < 3; ++col)
            for (int r = 0; r < 3; ++r) {
                F[3 * col + r][l] = 0.25F * f[col][r];
                apart[3 * col + r][l] = G[3 * col + r][l] - 0.25F * g[col][r];
            }
    }
}

/// What the cells of elements [first, first + OM__LANE) get of their hinges: k d, N m.
OM__INLINE void store_hinges(const OmFemTurn* t, int first, Lanes k, Lanes d[9]) {
    Lanes out[12];
    memset(out, 0, sizeof out);
    for (int col = 0; col < 3; ++col)
        for (int r = 0; r < 3; ++r)
            for (int l = 0; l < OM__LANE; ++l) out[4 * col + r][l] = k[l] * d[3 * col + r][l];
    for (int l = 0; l < OM__LANE; l += 4)
        for (int n = 0; n < 12; n += 4)
            transpose4(&out[n][l], OM__LANE, t->hinge + 12 * (size_t)(first + l) + n, 12);
}

/// The force of cells at vertex i.
OM__INLINE V4 gather_cell_force(const OmFemCells* c, const float* cell, int i) {
    V4 f = splat4(0);
    for (int at = c->t_adr[i]; at < c->t_adr[i + 1]; ++at) {
        const OmFemEntry* n = &c->t_entry[at];
        const float* S = cell + (size_t)OM__CELLED * (size_t)n->index + OM__CELL_P;
        f -= load4(S) * splat4(n->g[0]) + load4(S + 4) * splat4(n->g[1]) +
             load4(S + 8) * splat4(n->g[2]);
    }
    return f;
}

#endif
