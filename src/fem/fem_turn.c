// fem_turn.c: first pass of a step, over batches of elements: rotations and stresses.
//
// R is that of fem_rotation.h.
//
// Stress is t = mu (F' R^T + R F'^T - 2 I) + lambda (tr(F' R^T) - 3) I with F' = F + lag dF/dt, in world
// axes, so that an element pulls its vertex a with -V t b_a, b_a = R g_a.
#include <string.h>

#include "fem/fem_quadratic.h"
#include "fem/fem_rotation.h"

// Input of the second pass: 16 floats of gradients, 12 of stress columns; the fourth float of each column
// is unused, except in the first stress column, where it is lambda / mu.
// At a quadratic element's point, `root` is the root of its volume over the batch's, and `shape` 0 where only lambda
// counts.
OM__INLINE void make_turned(const OmFemTurn* t, float root, const float* ratio, float shape,
                            const OmFemBatch* batch, Lanes R[9], Lanes G[9],
                            Lanes out[OM__TURNED]) {
    for (int l = 0; l < OM__LANE; ++l) {
        float k = t->scale * (root * batch->root[l]);
        for (int r = 0; r < 3; ++r) {
            float sum = 0;
            for (int a = 0; a < 3; ++a) {
                float b =
                    k * (R[r][l] * batch->grad[3 * a][l] + R[3 + r][l] * batch->grad[3 * a + 1][l] +
                         R[6 + r][l] * batch->grad[3 * a + 2][l]);
                out[4 * (a + 1) + r][l] = b;
                sum += b;
            }
            out[r][l] = -sum;
        }
        float B[9];  // F' R^T
        for (int c = 0; c < 3; ++c)
            for (int r = 0; r < 3; ++r)
                B[3 * c + r] =
                    G[r][l] * R[c][l] + G[3 + r][l] * R[3 + c][l] + G[6 + r][l] * R[6 + c][l];
        float s = t->stress * (root * batch->root[l]);
        float trace = ratio[l] * (((B[0] - 1.0F) + (B[4] - 1.0F)) + (B[8] - 1.0F));
        float twice = 2.0F * shape;
        out[16][l] = s * (twice * (B[0] - 1.0F) + trace);
        out[21][l] = s * (twice * (B[4] - 1.0F) + trace);
        out[26][l] = s * (twice * (B[8] - 1.0F) + trace);
        s *= shape;
        out[17][l] = out[20][l] = s * (B[1] + B[3]);
        out[18][l] = out[24][l] = s * (B[2] + B[6]);
        out[22][l] = out[25][l] = s * (B[5] + B[7]);
        out[19][l] = ratio[l];
    }
}

OM_MULTIVERSION
void om__fem_turn(const OmFemTurn* t, int begin, int end) {
    Lanes d[9], w[9], F[9], G[9], R[9], out[OM__TURNED];
    int is_bad[OM__LANE];
    memset(out, 0, sizeof out);
    for (int k = begin; k < end; ++k) {
        const OmFemBatch* batch = &t->batch[k];
        gather_edges(t, batch, d, w);
        make_gradients(batch, t->lag, d, w, F, G);
        find_rotations(F, R, is_bad);
        int nbad = 0;
        for (int l = 0; l < OM__LANE; ++l) nbad += is_bad[l];
        if (nbad > 0) repair_rotations(F, R, is_bad);
        make_turned(t, 1.0F, batch->ratio, 1.0F, batch, R, G, out);
        float* turned = t->turned + (size_t)k * OM__LANE * OM__TURNED;
        for (int l = 0; l < OM__LANE; l += 4)
            for (int n = 0; n < OM__TURNED; n += 4)
                transpose4(&out[n][l], OM__LANE, turned + l * OM__TURNED + n, OM__TURNED);
    }
}

// ---- quadratic elements -----------------------------------------------------------------------------

// Blocks of a point's pairs of coordinates and forces on its vertices, from what make_turned gives; shape is 1, or 0
// where only lambda counts.
OM__INLINE void expand_turned(Lanes turned[OM__TURNED], float shape, Lanes block[90],
                              Lanes force[12]) {
    for (int p = 0; p < 10; ++p) {
        int i = 4 * om__point_pair[p][0], j = 4 * om__point_pair[p][1];
        V16 dot = splat16(0), ratio = load16(turned[19]);
        for (int r = 0; r < 3; ++r) dot += load16(turned[i + r]) * load16(turned[j + r]);
        for (int c = 0; c < 3; ++c)
            for (int r = 0; r < 3; ++r) {
                V16 own = load16(turned[i + r]) * load16(turned[j + c]),
                    other = load16(turned[i + c]) * load16(turned[j + r]);
                V16 K = ratio * own + shape * other;
                store16(block[9 * p + 3 * c + r], r == c ? K + shape * dot : K);
            }
    }
    for (int k = 0; k < 4; ++k)
        for (int r = 0; r < 3; ++r)
            store16(force[3 * k + r], -(load16(turned[16 + r]) * load16(turned[4 * k]) +
                                        load16(turned[20 + r]) * load16(turned[4 * k + 1]) +
                                        load16(turned[24 + r]) * load16(turned[4 * k + 2])));
}

OM_MULTIVERSION
void om__fem_turn_quadratic(const OmFemTurn* t, int begin, int end) {
    Lanes x[27], v[27], d[9], w[9], F[9], G[9], R[9], turned[OM__TURNED], block[90], force[12],
        out[OM__QUADRATIC];
    int is_bad[OM__LANE];
    memset(turned, 0, sizeof turned);
    for (int k = begin; k < end; ++k) {
        gather_nodes(&t->batch[k], &t->mids[k], t->x, x);
        gather_nodes(&t->batch[k], &t->mids[k], t->v, v);
        memset(out, 0, sizeof out);
        for (int q = 0; q < OM__POINTS; ++q) {
            bool is_wide = om__point_share(q) == OM_SHARE_WIDE;
            float shape = is_wide ? 0.0F : 1.0F, root = is_wide ? 2.0F : 1.0F;
            const float* ratio = is_wide ? t->mids[k].wide : t->batch[k].ratio;
            point_edges(x, q, d);
            point_edges(v, q, w);
            make_gradients(&t->batch[k], t->lag, d, w, F, G);
            find_rotations(F, R, is_bad);
            int nbad = 0;
            for (int l = 0; l < OM__LANE; ++l) nbad += is_bad[l];
            if (nbad > 0) repair_rotations(F, R, is_bad);
            make_turned(t, root, ratio, shape, &t->batch[k], R, G, turned);
            expand_turned(turned, shape, block, force);
            add_point(q, block, force, out);
        }
        store_quadratic(t, k, out);
    }
}
