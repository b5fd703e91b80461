// fem_frame.h: the frame of principal stretches of sixteen deformation gradients.
//
// F = U diag(s) V^T by Jacobi rotations of F^T F (V) and orthonormal columns of F V (U), both proper rotations, the
// smallest s negative where F is inverted.
#ifndef OMENTUM_FEM_FRAME_H
#define OMENTUM_FEM_FRAME_H

#include "fem/fem_simd.h"

#define OM__SWEEPS 4          // of Jacobi rotations; three leave 1e-5 for stretches of 3
#define OM__MIN_MIDDLE 1e-3F  // middle stretch over the largest: below, U is not determined

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
    for (int sweep = 0; sweep < OM__SWEEPS; ++sweep) {
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
    f->is_bad = ~(f->s[1] > OM__MIN_MIDDLE * f->s[0]);
}

#endif
