// fem_stretch.c: first pass of a step for any law: stiffness blocks and forces by principal stretches.
//
// F = U diag(s) V^T by Jacobi rotations of F^T F (V) and orthonormal columns of F V (U), both proper rotations,
// the smallest s negative where F is inverted. In that frame the tangent is a 3x3 matrix H and three pairs
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

#define NSWEEP 4  // of Jacobi rotations; three leave 1e-5 for stretches of 3
#define PRESSED \
    1e-3F  // -U' of a wide part, over mu, from which on its H is not singular by rounding
#define MIN_RATIO 1e-3F  // middle stretch over the largest: below, U is not determined

// Symmetric 3x3 matrices: 00, 11, 22, then 12, 02, 01, so that 3 + k is the pair without k.
typedef struct Frame {
    V16 U[9], V[9], s[3];  // U and V by columns
    V16 H[6], own[3], cross[3];
    V16 P[9];  // first Piola-Kirchhoff stress, by columns
    I16 is_bad;
} Frame;

// ---- singular value decomposition -------------------------------------------------------------------------

// Turn columns p and q of V so that the entry pq of C vanishes; kp, kq are the other two of its entries.
OM__INLINE void rotate(V16* pp, V16* qq, V16* pq, V16* kp, V16* kq, V16* vp, V16* vq) {
    V16 h = *qq - *pp, d = *pq + *pq, hh = h * h + d * d + 1e-30F;
    V16 away = abs16(h) + hh * rsqrt16(hh);
    V16 t = select16(h < 0.0F, -d, d) / away;
    V16 c = rsqrt16(1.0F + t * t), s = t * c;
    *pp -= t * *pq;
    *qq += t * *pq;
    *pq = splat16(0);
    V16 a = *kp, b = *kq;
    *kp = c * a - s * b;
    *kq = s * a + c * b;
    for (int r = 0; r < 3; ++r) {
        a = vp[r];
        b = vq[r];
        vp[r] = c * a - s * b;
        vq[r] = s * a + c * b;
    }
}

OM__INLINE V16 dot3(const V16* a, const V16* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
OM__INLINE void cross3(const V16* a, const V16* b, V16* out) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

// The longer of two columns of B = F V first, those of V with them.
OM__INLINE void order(V16* B, V16* V, V16* n, int p, int q) {
    I16 swap = n[p] < n[q];
    V16 a = n[p];
    n[p] = select16(swap, n[q], a);
    n[q] = select16(swap, a, n[q]);
    for (int r = 0; r < 3; ++r) {
        a = B[3 * p + r];
        B[3 * p + r] = select16(swap, B[3 * q + r], a);
        B[3 * q + r] = select16(swap, a, B[3 * q + r]);
        a = V[3 * p + r];
        V[3 * p + r] = select16(swap, V[3 * q + r], a);
        V[3 * q + r] = select16(swap, a, V[3 * q + r]);
    }
}

OM__INLINE void decompose(const V16 F[9], Frame* f) {
    V16 C[6], B[9], n[3];
    V16* V = f->V;
    for (int k = 0; k < 3; ++k) {
        C[k] = dot3(F + 3 * k, F + 3 * k);
        C[3 + k] = dot3(F + 3 * ((k + 1) % 3), F + 3 * ((k + 2) % 3));
    }
    for (int k = 0; k < 9; ++k) V[k] = splat16(k % 4 == 0 ? 1.0F : 0.0F);
    for (int sweep = 0; sweep < NSWEEP; ++sweep) {
        rotate(&C[0], &C[1], &C[5], &C[4], &C[3], V, V + 3);
        rotate(&C[0], &C[2], &C[4], &C[5], &C[3], V, V + 6);
        rotate(&C[1], &C[2], &C[3], &C[5], &C[4], V + 3, V + 6);
    }
    for (int k = 0; k < 3; ++k) {
        for (int r = 0; r < 3; ++r)
            B[3 * k + r] = F[r] * V[3 * k] + F[3 + r] * V[3 * k + 1] + F[6 + r] * V[3 * k + 2];
        n[k] = dot3(B + 3 * k, B + 3 * k);
    }
    order(B, V, n, 0, 1);
    order(B, V, n, 0, 2);
    order(B, V, n, 1, 2);
    V16 inv = rsqrt16(n[0] + 1e-30F);
    f->s[0] = n[0] * inv;
    for (int r = 0; r < 3; ++r) f->U[r] = B[r] * inv;
    V16 along = dot3(f->U, B + 3);
    for (int r = 0; r < 3; ++r) B[3 + r] -= along * f->U[r];
    V16 n1 = dot3(B + 3, B + 3);
    inv = rsqrt16(n1 + 1e-30F);
    f->s[1] = n1 * inv;
    for (int r = 0; r < 3; ++r) f->U[3 + r] = B[3 + r] * inv;
    cross3(f->U, f->U + 3, f->U + 6);
    cross3(V, V + 3, V + 6);
    for (int r = 0; r < 3; ++r) B[6 + r] = F[r] * V[6] + F[3 + r] * V[7] + F[6 + r] * V[8];
    f->s[2] = dot3(f->U + 6, B + 6);
    f->is_bad = ~(f->s[1] > MIN_RATIO * f->s[0]);
}

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
// W = shape I1 / 2 + U(J): stress and tangent from U' and U''.
OM__INLINE void by_volume(const V16 F[9], float shape, bool keeps, V16 dU, V16 ddU, V16 dU_stress,
                          Frame* f) {
    const V16* s = f->s;
    V16 c[3] = {s[1] * s[2], s[2] * s[0], s[0] * s[1]}, cof[9];
    I16 is_pressed = dU < -PRESSED;
    V16 geometric = keeps ? dU : select16(is_pressed, dU, splat16(0));
    if (!keeps) ddU = max16(ddU, splat16(0));  // U of neo-Hookean is concave beyond J = e
    for (int k = 0; k < 3; ++k) {
        f->H[k] = shape + ddU * c[k] * c[k];
        f->H[3 + k] = ddU * c[(k + 1) % 3] * c[(k + 2) % 3] + geometric * s[k];
        f->own[k] = splat16(shape);
        f->cross[k] = -dU * s[k];
        cross3(F + 3 * ((k + 1) % 3), F + 3 * ((k + 2) % 3), cof + 3 * k);
    }
    if (!keeps) f->is_bad |= is_pressed & ~is_positive(f->H);
    for (int k = 0; k < 9; ++k) f->P[k] = shape * F[k] + dU_stress * cof[k];
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
    V16 S[9], trace = splat16(-3.0F);  // S = ratio/2 (I1 - 3) I + F^T F - I
    for (int k = 0; k < 3; ++k) trace += dot3(F + 3 * k, F + 3 * k);
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
            S[3 * c + r] = shape * dot3(F + 3 * r, F + 3 * c) +
                           (r == c ? 0.5F * ratio * trace - shape : splat16(0));
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
            f->P[3 * c + r] = F[r] * S[3 * c] + F[3 + r] * S[3 * c + 1] + F[6 + r] * S[3 * c + 2];
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
        f->H[k][l] = (float)(p.H[k][k] / mu);
        f->H[3 + k][l] = (float)(p.H[(k + 1) % 3][(k + 2) % 3] / mu);
        f->own[k][l] = (float)(p.own[k] / mu);
        f->cross[k][l] = (float)(p.cross[k] / mu);
    }
}

static void repair_lanes(const OmFemTurn* t, OmLawShare share, int batch, const V16 F[9],
                         Frame* f) {
    for (int l = 0; l < OM__LANE && batch * OM__LANE + l < t->model->nelem; ++l) {
        const OmMaterial* m = om__fem_material(t->model, batch * OM__LANE + l);
        if (!f->is_bad[l]) continue;
        double lambda, mu, bulk;
        om_material_lame(m, &lambda, &mu, &bulk);
        if (m->law == OM_LINEAR)
            linear_lane(m, share, mu, F, l, f);
        else
            principal_lane(m, share, mu, F, l, t->is_exact, f);
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

OM__INLINE void make_law(OmFemFamily family, const V16 F[9], V16 ratio, float shape, bool keeps,
                         Frame* f) {
    switch (family) {
    case OM__FAMILY_NEO: neo_hookean(F, ratio, shape, keeps, f); break;
    case OM__FAMILY_STABLE: stable_neo_hookean(F, ratio, shape, keeps, f); break;
    case OM__FAMILY_VENANT: st_venant(F, ratio, shape, keeps, f); break;
    default: st_venant(F, ratio, shape, keeps, f); f->is_bad = f->is_bad | -1;
    }
}

// The frame of a batch at a point, from F and F'; gradients of its coordinates, and the same turned by V^T.
OM__INLINE void stretch_point(const OmFemTurn* t, OmLawShare share, int k, Lanes Fl[9], Lanes Gl[9],
                              Frame* f, V16 rate[9], V16 grad[12], V16 g[12]) {
    const OmFemBatch* batch = &t->batch[k];
    bool is_wide = share == OM_SHARE_WIDE;
    V16 F[9], ratio = load16(is_wide ? t->mids[k].wide : batch->ratio);
    for (int n = 0; n < 9; ++n) {
        F[n] = load16(Fl[n]);
        rate[n] = load16(Gl[n]) - F[n];  // lag dF/dt
        grad[3 + n] = load16(batch->grad[n]);
    }
    for (int r = 0; r < 3; ++r) grad[r] = -(grad[3 + r] + grad[6 + r] + grad[9 + r]);
    decompose(F, f);
    make_law(batch->family, F, ratio, is_wide ? 0.0F : 1.0F, !is_wide || t->is_exact, f);
    if (!t->is_exact) project(f, is_wide);
    int nbad = 0;
    for (int l = 0; l < OM__LANE; ++l) nbad -= f->is_bad[l];
    if (nbad > 0) repair_lanes(t, share, k, F, f);
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
