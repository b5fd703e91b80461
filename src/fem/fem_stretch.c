// fem_stretch.c: first pass of a step for any law: stiffness blocks and forces by principal stretches.
//
// In the frame of F = U diag(s) V^T (fem_frame.h) the tangent is a 3x3 matrix H and three pairs
// (own, cross) (fem_principal.h), whose negative eigenvalues are set to zero: the matrix of a step is always
// positive semidefinite. With g_a the shape gradients turned by V^T, a block is V U k_ab U^T,
//
//     k_ab(i, i) = H_ii g_ai g_bi + sum_{j != i} own_ij g_aj g_bj
//     k_ab(i, j) = H_ij g_ai g_bj + cross_ij g_aj g_bi .
//
// Stress is computed from F itself where a short formula exists, because V carries some rounding. Elements whose
// U is not determined, whose H is not positive definite, or whose law has no short form use fem_principal.c in
// double, one by one.
//
// Everything is in units of mu; a batch has one law, ratios lambda / mu may differ.
#include "fem/fem_quadratic.h"
#include "fem/fem_rotation.h"
#include "fem/fem_shell.h"

#define PRESSED \
    1e-3F  // -U' of a wide part, over mu, from which on its H is not singular by rounding

// Is H positive definite?
OM__INLINE I16 is_positive(const V16 H[6]) {
    V16 minor = H[0] * H[1] - H[5] * H[5];
    V16 det =
        H[2] * minor - H[3] * (H[0] * H[3] - H[4] * H[5]) + H[4] * (H[5] * H[3] - H[1] * H[4]);
    return (H[0] > 0.0F) & (minor > 0.0F) & (det > 0.0F);
}

// ---- laws ---------------------------------------------------------------------------------------------------

// `shape` of the laws is 1, or 0 for the wide part of a law, which has lambda alone: its H is singular at rest, and in
// tension its geometric stiffness is below zero. Where tangents are projected (not `keeps`), that is left out, as is a
// U'' below zero, and under pressure it is kept if H is positive definite.
//
// W = shape I1 / 2 + U(J): stress from U'.
OM__INLINE void stress_by_volume(const V16 F[9], float shape, V16 dU, V16 P[9]) {
    V16 cof[9];
    for (int k = 0; k < 3; ++k) cross3(F + 3 * ((k + 1) % 3), F + 3 * ((k + 2) % 3), cof + 3 * k);
    for (int k = 0; k < 9; ++k) P[k] = shape * F[k] + dU * cof[k];
}

// The same with the tangent, from U' and U''.
OM__INLINE void by_volume(const V16 F[9], float shape, bool keeps, V16 dU, V16 ddU, V16 dU_stress,
                          Frame* f) {
    const V16* s = f->s;
    V16 c[3] = {s[1] * s[2], s[2] * s[0], s[0] * s[1]};
    I16 is_pressed = dU < -PRESSED;
    V16 geometric = keeps ? dU : select16(is_pressed, dU, splat16(0));
    if (!keeps) ddU = max16(ddU, splat16(0));  // U of neo-Hookean is concave beyond J = e
    for (int k = 0; k < 3; ++k) {
        f->H[k] = shape + ddU * c[k] * c[k];
        f->H[3 + k] = ddU * c[(k + 1) % 3] * c[(k + 2) % 3] + geometric * s[k];
        f->own[k] = splat16(shape);
        f->cross[k] = -dU * s[k];
    }
    if (!keeps) f->is_bad |= is_pressed & ~is_positive(f->H);
    stress_by_volume(F, shape, dU_stress, f->P);
}

OM__INLINE V16 determinant(const V16 F[9]) {
    V16 c[3];
    cross3(F + 3, F + 6, c);
    return dot3(F, c);
}

// U' and U'' of -shape ln J + ratio/2 (ln J)^2, continued below the barrier.
OM__INLINE V16 neo_volume(V16 J, V16 ratio, float shape, V16* ddU) {
    V16 b = max16(J, splat16((float)OM_LAW_LOG_FLOOR)), inv = 1.0F / b;
    V16 d = ratio * log16(b) - shape;
    *ddU = (ratio - d) * inv * inv;
    return d * inv + (J - b) * *ddU;
}

OM__INLINE void neo_hookean(const V16 F[9], V16 ratio, float shape, bool keeps, Frame* f) {
    V16 ddU, unused;
    V16 dU = neo_volume(f->s[0] * f->s[1] * f->s[2], ratio, shape, &ddU);
    by_volume(F, shape, keeps, dU, ddU, neo_volume(determinant(F), ratio, shape, &unused), f);
}

OM__INLINE void stable_neo_hookean(const V16 F[9], V16 ratio, float shape, bool keeps, Frame* f) {
    V16 k = ratio + shape;
    by_volume(F, shape, keeps, k * (f->s[0] * f->s[1] * f->s[2] - 1.0F) - shape, k,
              k * (determinant(F) - 1.0F) - shape, f);
}

OM__INLINE void venant_stress(const V16 F[9], V16 ratio, float shape, V16 P[9]) {
    V16 S[9], trace = splat16(-3.0F);  // S = ratio/2 (I1 - 3) I + F^T F - I
    for (int k = 0; k < 3; ++k) trace += dot3(F + 3 * k, F + 3 * k);
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
            S[3 * c + r] = shape * dot3(F + 3 * r, F + 3 * c) +
                           (r == c ? 0.5F * ratio * trace - shape : splat16(0));
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
            P[3 * c + r] = F[r] * S[3 * c] + F[3 + r] * S[3 * c + 1] + F[6 + r] * S[3 * c + 2];
}

OM__INLINE void st_venant(const V16 F[9], V16 ratio, float shape, bool keeps, Frame* f) {
    const V16* s = f->s;
    V16 t = 0.5F * ratio * (s[0] * s[0] + s[1] * s[1] + s[2] * s[2] - 3.0F);
    if (!keeps) t = max16(t, splat16(0));
    for (int k = 0; k < 3; ++k) {
        V16 u = s[(k + 1) % 3], v = s[(k + 2) % 3];
        f->H[k] = t - shape + (ratio + 3.0F * shape) * s[k] * s[k];
        f->H[3 + k] = ratio * u * v;
        f->own[k] = t - shape + shape * u * u + shape * v * v;
        f->cross[k] = shape * u * v;
    }
    venant_stress(F, ratio, shape, f->P);
}

// Set negative eigenvalues of the pairs to zero; a not positive definite H is handled in double. That of a wide part is
// singular at rest, and positive semidefinite as its law made it.
OM__INLINE void project(Frame* f, bool is_wide) {
    for (int k = 0; k < 3; ++k) {
        V16 flip = max16(f->own[k] + f->cross[k], splat16(0)),
            twist = max16(f->own[k] - f->cross[k], splat16(0));
        f->own[k] = 0.5F * (flip + twist);
        f->cross[k] = 0.5F * (flip - twist);
    }
    if (is_wide) return;
    f->is_bad |= ~is_positive(f->H);
}

// ---- one element at a time ------------------------------------------------------------------------------------

static OmMat3 lane_matrix(const V16* m, int l) {
    return om_mat3_cols(om_vec3((double)m[0][l], (double)m[1][l], (double)m[2][l]),
                        om_vec3((double)m[3][l], (double)m[4][l], (double)m[5][l]),
                        om_vec3((double)m[6][l], (double)m[7][l], (double)m[8][l]));
}

static void set_lane_matrix(V16* m, int l, OmMat3 a) {
    const double e[9] = {a.cx.x, a.cx.y, a.cx.z, a.cy.x, a.cy.y, a.cy.z, a.cz.x, a.cz.y, a.cz.z};
    for (int k = 0; k < 9; ++k) m[k][l] = (float)e[k];
}

// The linear law does not use stretches: its frame is the world's.
static void linear_lane(const OmMaterial* m, OmLawShare share, double mu, const V16 F[9], int l,
                        Frame* f) {
    double energy, lambda, shape, bulk;
    OmMat3 P = om__law_stress(m, share, lane_matrix(F, l), &energy);
    om__law_share(m, share, &lambda, &shape, &bulk);
    set_lane_matrix(f->U, l, om_mat3_identity());
    set_lane_matrix(f->V, l, om_mat3_identity());
    set_lane_matrix(f->P, l, om_mat3_scale(1 / mu, P));
    for (int k = 0; k < 3; ++k) {
        f->H[k][l] = (float)((lambda + 2 * shape) / mu);
        f->H[3 + k][l] = (float)(lambda / mu);
        f->own[k][l] = f->cross[k][l] = (float)(shape / mu);
    }
}

static void principal_lane(const OmMaterial* m, OmLawShare share, double mu, const V16 F[9], int l,
                           bool is_exact, Frame* f) {
    OmMat3 U, V;
    OmVec3 s;
    OmPrincipal p;
    om_mat3_svd(lane_matrix(F, l), &U, &s, &V);
    const double stretch[3] = {s.x, s.y, s.z};
    om__principal_eval(m, share, stretch, &p);
    if (!is_exact) om__principal_project(&p);
    OmMat3 D = om_mat3_diag(om_vec3(p.P[0] / mu, p.P[1] / mu, p.P[2] / mu));
    set_lane_matrix(f->U, l, U);
    set_lane_matrix(f->V, l, V);
    set_lane_matrix(f->P, l, om_mat3_mul(U, om_mat3_mul(D, om_mat3_transpose(V))));
    for (int k = 0; k < 3; ++k) {
        f->s[k][l] = (float)stretch[k];
        f->H[k][l] = (float)(p.H[k][k] / mu);
        f->H[3 + k][l] = (float)(p.H[(k + 1) % 3][(k + 2) % 3] / mu);
        f->own[k][l] = (float)(p.own[k] / mu);
        f->cross[k][l] = (float)(p.cross[k] / mu);
    }
}

static void repair_lanes(const OmFemTurn* t, OmLawShare share, int batch, OmFemFamily family,
                         const V16 F[9], Frame* f) {
    for (int l = 0; l < OM__LANE && batch * OM__LANE + l < t->model->nelem; ++l) {
        OmMaterial m = *om__fem_material(t->model, batch * OM__LANE + l);
        if (!f->is_bad[l]) continue;
        double lambda, mu, bulk;
        om_material_lame(&m, &lambda, &mu, &bulk);
        if (family == OM__FAMILY_TURNED) m.law = OM_COROTATIONAL;
        if (m.law == OM_LINEAR)
            linear_lane(&m, share, mu, F, l, f);
        else
            principal_lane(&m, share, mu, F, l, t->is_exact, f);
    }
}

// ---- blocks and forces ----------------------------------------------------------------------------------------

// m = U m U^T
OM__INLINE void turn_block(const V16 U[9], const V16 m[9], V16 out[9]) {
    V16 a[9];  // U m
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
            a[3 * c + r] = U[r] * m[3 * c] + U[3 + r] * m[3 * c + 1] + U[6 + r] * m[3 * c + 2];
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
            out[3 * c + r] = a[r] * U[c] + a[3 + r] * U[3 + c] + a[6 + r] * U[6 + c];
}

static const signed char linear_pair[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

OM__INLINE void make_blocks(const Frame* f, const V16 g[12], V16 scale, int npair,
                            const signed char (*pair)[2], Lanes* out) {
    for (int p = 0; p < npair; ++p) {
        const V16 *a = g + 3 * pair[p][0], *b = g + 3 * pair[p][1];
        V16 k[9], K[9], sb[3] = {scale * b[0], scale * b[1], scale * b[2]};
        for (int i = 0; i < 3; ++i) {
            int u = (i + 1) % 3, v = (i + 2) % 3;
            k[4 * i] = f->H[i] * a[i] * sb[i] + f->own[v] * a[u] * sb[u] + f->own[u] * a[v] * sb[v];
            k[3 * v + u] = f->H[3 + i] * a[u] * sb[v] + f->cross[i] * a[v] * sb[u];
            k[3 * u + v] = f->H[3 + i] * a[v] * sb[u] + f->cross[i] * a[u] * sb[v];
        }
        turn_block(f->U, k, K);
        for (int n = 0; n < 9; ++n) store16(out[9 * p + n], K[n]);
    }
}

// P + dP[rate], by columns.
OM__INLINE void make_stress(const Frame* f, const V16 rate[9], V16 dP[9]) {
    V16 a[9], G[9], T[9];  // a = U^T rate, G = a V
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r) a[3 * c + r] = dot3(f->U + 3 * r, rate + 3 * c);
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
            G[3 * c + r] =
                a[r] * f->V[3 * c] + a[3 + r] * f->V[3 * c + 1] + a[6 + r] * f->V[3 * c + 2];
    for (int i = 0; i < 3; ++i) {
        int u = (i + 1) % 3, v = (i + 2) % 3;
        T[4 * i] = f->H[i] * G[4 * i] + f->H[3 + v] * G[4 * u] + f->H[3 + u] * G[4 * v];
        T[3 * v + u] = f->own[i] * G[3 * v + u] + f->cross[i] * G[3 * u + v];
        T[3 * u + v] = f->own[i] * G[3 * u + v] + f->cross[i] * G[3 * v + u];
    }
    for (int c = 0; c < 3; ++c)  // U T V^T
        for (int r = 0; r < 3; ++r)
            a[3 * c + r] =
                f->U[r] * T[3 * c] + f->U[3 + r] * T[3 * c + 1] + f->U[6 + r] * T[3 * c + 2];
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
            dP[3 * c + r] =
                f->P[3 * c + r] + a[r] * f->V[c] + a[3 + r] * f->V[3 + c] + a[6 + r] * f->V[6 + c];
}

// -scale P g_a of the four vertices.
OM__INLINE void make_forces(const V16 P[9], const V16 grad[12], V16 scale, Lanes* out) {
    V16 sum[3] = {splat16(0), splat16(0), splat16(0)};
    for (int n = 1; n < 4; ++n)
        for (int r = 0; r < 3; ++r) {
            V16 force = -scale * (P[r] * grad[3 * n] + P[3 + r] * grad[3 * n + 1] +
                                  P[6 + r] * grad[3 * n + 2]);
            sum[r] -= force;
            store16(out[3 * n + r], force);
        }
    for (int r = 0; r < 3; ++r) store16(out[r], sum[r]);
}

// Corotational. R of fem_rotation.h has less rounding than U V^T.
OM__INLINE void turned_stress(const V16 F[9], V16 ratio, V16 P[9]) {
    Lanes Fl[9], R[9];
    int is_bad[OM__LANE], nbad = 0;
    for (int n = 0; n < 9; ++n) store16(Fl[n], F[n]);
    find_rotations(Fl, R, is_bad);
    for (int l = 0; l < OM__LANE; ++l) nbad += is_bad[l];
    if (nbad > 0) repair_rotations(Fl, R, is_bad);
    V16 trace = splat16(0);
    for (int c = 0; c < 3; ++c)
        trace +=
            F[c] * load16(R[c]) + F[3 + c] * load16(R[3 + c]) + F[6 + c] * load16(R[6 + c]) - 1.0F;
    for (int n = 0; n < 9; ++n) P[n] = 2.0F * (F[n] - load16(R[n])) + ratio * trace * load16(R[n]);
}

// With the geometric terms left out, as in fem_turn.c: the same in every frame.
OM__INLINE void corotational(const V16 F[9], V16 ratio, Frame* f) {
    turned_stress(F, ratio, f->P);
    for (int k = 0; k < 3; ++k) {
        f->H[k] = ratio + 2.0F;
        f->H[3 + k] = ratio;
        f->own[k] = f->cross[k] = splat16(1.0F);
    }
}

OM__INLINE void make_law(OmFemFamily family, const V16 F[9], V16 ratio, float shape, bool keeps,
                         Frame* f) {
    switch (family) {
    case OM__FAMILY_NEO: neo_hookean(F, ratio, shape, keeps, f); break;
    case OM__FAMILY_STABLE: stable_neo_hookean(F, ratio, shape, keeps, f); break;
    case OM__FAMILY_VENANT: st_venant(F, ratio, shape, keeps, f); break;
    case OM__FAMILY_TURNED: corotational(F, ratio, f); break;
    default: st_venant(F, ratio, shape, keeps, f); f->is_bad = f->is_bad | -1;
    }
}

// The frame of a batch at a point, with stress and tangent.
OM__INLINE void make_frame(const OmFemTurn* t, OmLawShare share, int k, OmFemFamily family,
                           const V16 F[9], Frame* f) {
    bool is_wide = share == OM_SHARE_WIDE;
    V16 ratio = load16(is_wide ? t->mids[k].wide : t->batch[k].ratio);
    decompose(F, f);
    make_law(family, F, ratio, is_wide ? 0.0F : 1.0F, !is_wide || t->is_exact, f);
    if (!t->is_exact) project(f, is_wide);
    int nbad = 0;
    for (int l = 0; l < OM__LANE; ++l) nbad -= f->is_bad[l];
    if (nbad > 0) repair_lanes(t, share, k, family, F, f);
}

// The same from F and F'; gradients of its coordinates, and the same turned by V^T.
OM__INLINE void stretch_point(const OmFemTurn* t, OmLawShare share, int k, Lanes Fl[9], Lanes Gl[9],
                              Frame* f, V16 rate[9], V16 grad[12], V16 g[12]) {
    const OmFemBatch* batch = &t->batch[k];
    V16 F[9];
    for (int n = 0; n < 9; ++n) {
        F[n] = load16(Fl[n]);
        rate[n] = load16(Gl[n]) - F[n];  // lag dF/dt
        grad[3 + n] = load16(batch->grad[n]);
    }
    for (int r = 0; r < 3; ++r) grad[r] = -(grad[3 + r] + grad[6 + r] + grad[9 + r]);
    make_frame(t, share, k, batch->family, F, f);
    for (int n = 0; n < 4; ++n)
        for (int r = 0; r < 3; ++r) g[3 * n + r] = dot3(f->V + 3 * r, grad + 3 * n);
}

OM__INLINE void stretch_batch(const OmFemTurn* t, int k, Lanes out[OM__BLOCKED]) {
    const OmFemBatch* batch = &t->batch[k];
    Lanes d[9], w[9], Fl[9], Gl[9];
    gather_edges(t, batch, d, w);
    make_gradients(batch, t->lag, d, w, Fl, Gl);
    V16 rate[9], grad[12], g[12], P[9];
    Frame f;
    stretch_point(t, OM_SHARE_WHOLE, k, Fl, Gl, &f, rate, grad, g);
    V16 stiff = load16(batch->root) * load16(batch->root);  // V mu, zero in lanes that only fill up
    make_blocks(&f, g, stiff * (t->scale * t->scale), 6, linear_pair, out);
    make_stress(&f, rate, P);
    make_forces(P, grad, stiff * (t->scale * t->stress), out + 54);
}

OM_MULTIVERSION
void om__fem_stretch_quadratic(const OmFemTurn* t, int begin, int end) {
    Lanes x[27], v[27], d[9], w[9], F[9], G[9], block[90], force[12], out[OM__QUADRATIC];
    V16 rate[9], grad[12], g[12], P[9];
    Frame f;
    for (int k = begin; k < end; ++k) {
        const OmFemBatch* batch = &t->batch[k];
        V16 stiff = load16(batch->root) * load16(batch->root);
        gather_nodes(&t->batch[k], &t->mids[k], t->x, x);
        gather_nodes(&t->batch[k], &t->mids[k], t->v, v);
        memset(out, 0, sizeof out);
        for (int q = 0; q < OM__POINTS; ++q) {
            point_edges(x, q, d);
            point_edges(v, q, w);
            make_gradients(batch, t->lag, d, w, F, G);
            V16 size = stiff * (4.0F * (float)om__point_volume(q));
            stretch_point(t, om__point_share(q), k, F, G, &f, rate, grad, g);
            make_blocks(&f, g, size * (t->scale * t->scale), 10, om__point_pair, block);
            make_stress(&f, rate, P);
            make_forces(P, grad, size * (t->scale * t->stress), force);
            add_point(q, block, force, out);
        }
        store_quadratic(t, k, out);
    }
}

// ---- shells ---------------------------------------------------------------------------------------------------

static const signed char shell_pair[OM__SHELL_PAIR][2] = {
    {0, 1}, {0, 2}, {0, 3}, {0, 4}, {0, 5}, {0, 6}, {0, 7}, {1, 2}, {1, 3}, {1, 4},
    {1, 5}, {1, 6}, {1, 7}, {2, 3}, {2, 4}, {2, 5}, {2, 6}, {2, 7}, {3, 4}, {3, 5},
    {3, 6}, {3, 7}, {4, 5}, {4, 6}, {4, 7}, {5, 6}, {5, 7}, {6, 7}};

static void stress_lanes(const OmFemTurn* t, int batch, const V16 F[9], V16 P[9]) {
    for (int l = 0; l < OM__LANE && batch * OM__LANE + l < t->model->nelem; ++l) {
        const OmMaterial* m = om__fem_material(t->model, batch * OM__LANE + l);
        double lambda, mu, bulk, energy;
        om_material_lame(m, &lambda, &mu, &bulk);
        OmMat3 stress = om__fem_eval_stress(m, OM_SHARE_WHOLE, lane_matrix(F, l), &energy);
        set_lane_matrix(P, l, om_mat3_scale(1 / mu, stress));
    }
}

// Stress at a point of the shells of a batch.
OM__INLINE void shell_stress(const OmFemTurn* t, int k, OmFemFamily family, const V16 F[9],
                             V16 P[9]) {
    V16 ratio = load16(t->batch[k].ratio), unused;
    switch (family) {
    case OM__FAMILY_NEO:
        stress_by_volume(F, 1.0F, neo_volume(determinant(F), ratio, 1.0F, &unused), P);
        break;
    case OM__FAMILY_STABLE:
        stress_by_volume(F, 1.0F, (ratio + 1.0F) * (determinant(F) - 1.0F) - 1.0F, P);
        break;
    case OM__FAMILY_TURNED: turned_stress(F, ratio, P); break;
    case OM__FAMILY_VENANT: venant_stress(F, ratio, 1.0F, P); break;
    default:
        for (int n = 0; n < 9; ++n) P[n] = splat16(0);
        stress_lanes(t, k, F, P);
    }
}

// Stress at both points: the mean, what the patterns feel, p, and the torque on R.
OM__INLINE void shell_points(const OmFemTurn* t, int k, OmFemFamily family, const V16 F[9],
                             const V16 R[9], const V16 e[6], V16 mean[9], V16 p[12],
                             V16 torque[3]) {
    static const signed char row[3] = {0, 0, 1}, col[3] = {1, 2, 2};
    V16 sym[9], at[9], P[9], A[9], M[9], stress[6];
    symmetric_shell(e, sym);
    for (int n = 0; n < 9; ++n) mean[n] = splat16(0);
    for (int n = 0; n < 3; ++n) torque[n] = splat16(0);
    for (int side = -1; side < 2; side += 2) {
        float half = 0.5F * (float)side;
        point_of_shell(F, R, e, (float)side, at);
        shell_stress(t, k, family, at, P);
        for (int c = 0; c < 3; ++c)  // R^T P
            for (int r = 0; r < 3; ++r) A[3 * c + r] = dot3(R + 3 * r, P + 3 * c);
        for (int v = 0; v < 3; ++v) {
            stress[v] = A[4 * v];
            stress[3 + v] = 0.5F * (A[3 * col[v] + row[v]] + A[3 * row[v] + col[v]]);
        }
        pull_patterns(&t->shells[k], stress, splat16(half), p);
        for (int c = 0; c < 3; ++c)
            for (int r = 0; r < 3; ++r)
                M[3 * c + r] =
                    A[r] * sym[3 * c] + A[3 + r] * sym[3 * c + 1] + A[6 + r] * sym[3 * c + 2];
        torque[0] -= half * (M[5] - M[7]);
        torque[1] -= half * (M[6] - M[2]);
        torque[2] -= half * (M[1] - M[3]);
        for (int n = 0; n < 9; ++n) mean[n] += 0.5F * P[n];
    }
}

// tau: the torque on R, turned to the frame, over sums of two stretches, and back.
OM__INLINE void make_torque(const OmFemShells* s, const Frame* f, const V16 d[12], const V16 p[12],
                            V16 t[3], V16 tau[3]) {
    V16 one[3], frame[3];
    for (int i = 0; i < 4; ++i) {
        cross3(d + 3 * i, p + 3 * i, one);
        for (int r = 0; r < 3; ++r) t[r] += one[r];
    }
    for (int k = 0; k < 3; ++k) {
        V16 sum = f->s[(k + 1) % 3] + f->s[(k + 2) % 3];
        frame[k] =
            load16(s->turns) * dot3(f->V + 3 * k, t) / max16(sum, splat16((float)OM__MIN_TURN));
    }
    for (int r = 0; r < 3; ++r)
        tau[r] = f->V[r] * frame[0] + f->V[3 + r] * frame[1] + f->V[6 + r] * frame[2];
}

// Entries of b of the eight nodes: -(V P g_a + R (sum_i hour_ia p_i - tau x g_a)).
OM__INLINE void shell_forces(const OmFemShells* s, const V16 P[9], const V16 R[9], const V16 p[12],
                             const V16 tau[3], V16 scale, Lanes* out) {
    for (int a = 0; a < OM__SHELL_NODE; ++a) {
        V16 g[3], inner[3], twist[3];
        for (int c = 0; c < 3; ++c) g[c] = load16(s->grad[3 * a + c]);
        cross3(tau, g, twist);
        for (int r = 0; r < 3; ++r) {
            inner[r] = -twist[r];
            for (int i = 0; i < 4; ++i) inner[r] += load16(s->hour[8 * i + a]) * p[3 * i + r];
        }
        for (int r = 0; r < 3; ++r)
            store16(out[3 * a + r],
                    -scale * (P[r] * g[0] + P[3 + r] * g[1] + P[6 + r] * g[2] + R[r] * inner[0] +
                              R[3 + r] * inner[1] + R[6 + r] * inner[2]));
    }
}

// A lane with a corner that is nearly crushed. Its stiffness drags, too: without that it would be added inertia, which
// has no energy in the balance of a step (fem_shell.h).
static void add_resistance(const OmFemTurn* t, int k, int l, const V16 F[9], const V16 q[12],
                           Lanes out[OM__SHELL]) {
    double slope[3 * OM__SHELL_NODE] = {0}, block[OM__SHELL_FORCE] = {0},
                     root = (double)t->batch[k].root[l], scale = (double)t->scale * root * root;
    const int(*vert)[OM__LANE] = t->shells[k].vert;
    om__fem_shell_resist(t->model, k * OM__LANE + l, F, q, l, slope, block);
    for (int a = 0, at = 0; a < OM__SHELL_NODE; ++a)
        for (int b = a + 1; b < OM__SHELL_NODE; ++b, at += 9)
            for (int n = 0; n < 9; ++n) {  // the rows of the matrix have the sum 0
                const double *va = t->v + 3 * vert[a][l], *vb = t->v + 3 * vert[b][l];
                double K = (double)t->lag * block[at + n];
                slope[3 * a + n % 3] += K * (vb[n / 3] - va[n / 3]);
                slope[3 * b + n / 3] += K * (va[n % 3] - vb[n % 3]);
            }
    for (int n = 0; n < OM__SHELL_FORCE; ++n)
        out[n][l] += (float)(scale * (double)t->scale * block[n]);
    for (int n = 0; n < 3 * OM__SHELL_NODE; ++n)
        out[OM__SHELL_FORCE + n][l] -= (float)(scale * (double)t->stress * slope[n]);
}

OM_MULTIVERSION
void om__fem_stretch_shell(const OmFemTurn* t, int begin, int end) {
    Lanes node[21], out[OM__SHELL];
    V16 F[9], rate[9], q[12], w[12], d[12], p[12], drag[12], e[6], torque[3], tau[3], g[24], P[9],
        R[9];
    Frame f;
    memset(out, 0, sizeof out);
    for (int k = begin; k < end; ++k) {
        const OmFemBatch* batch = &t->batch[k];
        const OmFemShells* s = &t->shells[k];
        V16 stiff = load16(batch->root) * load16(batch->root);
        gather_shell(s, t->v, node);
        split_shell(s, node, rate, w);
        for (int n = 0; n < 9; ++n) rate[n] *= t->lag;
        for (int n = 0; n < 12; ++n) w[n] *= t->lag;
        gather_shell(s, t->x, node);
        split_shell(s, node, F, q);
        OmFemFamily family = t->is_turned ? OM__FAMILY_TURNED : batch->family;
        make_frame(t, OM_SHARE_WHOLE, k, family, F, &f);
        turn_of(s, f.U, f.V, R);
        push_patterns(s, R, q, d, p, e);
        shell_points(t, k, family, F, R, e, f.P, p, torque);
        make_torque(s, &f, d, p, torque, tau);
        push_patterns(s, R, w, d, drag, e);
        V16 trace = load16(batch->ratio) * (e[0] + e[1] + e[2]);
        for (int v = 0; v < 6; ++v) e[v] = v < 3 ? trace + 2.0F * e[v] : e[v];
        pull_patterns(s, e, splat16(1.0F), drag);
        for (int n = 0; n < 12; ++n) p[n] += drag[n];
        make_stress(&f, rate, P);
        shell_forces(s, P, R, p, tau, stiff * (t->scale * t->stress), out + OM__SHELL_FORCE);
        for (int a = 0; a < OM__SHELL_NODE; ++a) {
            V16 grad[3] = {load16(s->grad[3 * a]), load16(s->grad[3 * a + 1]),
                           load16(s->grad[3 * a + 2])};
            for (int r = 0; r < 3; ++r) g[3 * a + r] = dot3(f.V + 3 * r, grad);
        }
        V16 size = stiff * (t->scale * t->scale);
        make_blocks(&f, g, size, OM__SHELL_PAIR, shell_pair, out);
        for (int n = 0; n < OM__SHELL_PAIR; ++n) {
            V16 own[9], turned[9];
            for (int c = 0; c < 9; ++c) own[c] = size * load16(s->block[9 * n + c]);
            turn_block(R, own, turned);
            for (int c = 0; c < 9; ++c) store16(out[9 * n + c], load16(out[9 * n + c]) + turned[c]);
        }
        V16 J = least_ratio(s, F, q);
        for (int l = 0; l < OM__LANE && k * OM__LANE + l < t->model->nelem; ++l)
            if (!(J[l] >= (float)OM__SHELL_CRUSHED)) add_resistance(t, k, l, F, q, out);
        float* left = t->turned + (size_t)k * OM__LANE * OM__SHELL;
        for (int l = 0; l < OM__LANE; l += 4)
            for (int n = 0; n < OM__SHELL; n += 4)
                transpose4(&out[n][l], OM__LANE, left + l * OM__SHELL + n, OM__SHELL);
    }
}

OM_MULTIVERSION
void om__fem_stretch(const OmFemTurn* t, int begin, int end) {
    Lanes out[OM__BLOCKED];
    memset(out, 0, sizeof out);
    for (int k = begin; k < end; ++k) {
        stretch_batch(t, k, out);
        float* turned = t->turned + (size_t)k * OM__LANE * OM__BLOCKED;
        for (int l = 0; l < OM__LANE; l += 4)
            for (int n = 0; n < OM__BLOCKED; n += 4)
                transpose4(&out[n][l], OM__LANE, turned + l * OM__BLOCKED + n, OM__BLOCKED);
    }
}
