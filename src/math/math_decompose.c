// math_decompose.c: eigenvalues, singular values and the polar rotation of 3x3 matrices.
//
// Jacobi rotations instead of closed forms: the cubic formula loses half the digits when eigenvalues
// meet, and meshes are full of such elements. The singular values come from one-sided Jacobi on the
// columns, not from the eigenvalues of A^T A, which would square the condition number (Demmel and
// Veselic 1992). Inputs are scaled to unit size first, so that neither overflow nor underflow can occur.
// Inverted matrices give rotations: the sign goes to the smallest singular value (Irving et al. 2004).
#include <float.h>

#include "omentum/vec.h"

#define MAX_SWEEP 40

static double mat3_max_abs(OmMat3 m) {
    const double* p = &m.cx.x;
    double largest = 0.0;
    for (int i = 0; i < 9; ++i) largest = fmax(largest, fabs(p[i]));
    return largest;
}

// c, s with [c s; -s c]^T [app apq; apq aqq] [c s; -s c] diagonal (Golub and Van Loan, 8.4).
static void jacobi_rotation(double app, double apq, double aqq, double* c, double* s) {
    *c = 1.0;
    *s = 0.0;
    if (apq == 0.0) return;
    double tau = (aqq - app) / (2.0 * apq);
    double t = isfinite(tau) ? copysign(1.0, tau) / (fabs(tau) + sqrt(1.0 + tau * tau)) : 0.0;
    *c = 1.0 / sqrt(1.0 + t * t);
    *s = t * *c;
}

static void rotate_columns(OmVec3* p, OmVec3* q, double c, double s) {
    OmVec3 a = *p, b = *q;
    *p = om_sub(om_scale(c, a), om_scale(s, b));
    *q = om_add(om_scale(s, a), om_scale(c, b));
}

static void swap_columns_keep_rotation(OmVec3* p, OmVec3* q) {
    OmVec3 t = *p;
    *p = *q;
    *q = om_scale(-1.0, t);
}

void om_mat3_eigen_symmetric(OmMat3 a, OmVec3* w, OmMat3* v) {
    double scale = mat3_max_abs(a);
    *v = om_mat3_identity();
    *w = om_vec3(0, 0, 0);
    if (!(scale > 0.0) || !isfinite(scale)) return;
    double m[3][3] = {{a.cx.x / scale, a.cx.y / scale, a.cx.z / scale},
                      {a.cx.y / scale, a.cy.y / scale, a.cy.z / scale},
                      {a.cx.z / scale, a.cy.z / scale, a.cz.z / scale}};
    OmVec3* col[3] = {&v->cx, &v->cy, &v->cz};
    for (int sweep = 0; sweep < MAX_SWEEP; ++sweep) {
        double off = fabs(m[0][1]) + fabs(m[0][2]) + fabs(m[1][2]);
        if (off < 1e-18) break;
        for (int p = 0; p < 2; ++p) {
            for (int q = p + 1; q < 3; ++q) {
                double c, s;
                jacobi_rotation(m[p][p], m[p][q], m[q][q], &c, &s);
                for (int k = 0; k < 3; ++k) {  // columns, then rows
                    double kp = m[k][p], kq = m[k][q];
                    m[k][p] = c * kp - s * kq;
                    m[k][q] = s * kp + c * kq;
                }
                for (int k = 0; k < 3; ++k) {
                    double pk = m[p][k], qk = m[q][k];
                    m[p][k] = c * pk - s * qk;
                    m[q][k] = s * pk + c * qk;
                }
                rotate_columns(col[p], col[q], c, s);
            }
        }
    }
    double d[3] = {scale * m[0][0], scale * m[1][1], scale * m[2][2]};
    for (int pass = 0; pass < 2; ++pass) {
        for (int i = 0; i < 2; ++i) {
            if (d[i] <= d[i + 1]) continue;
            double t = d[i];
            d[i] = d[i + 1];
            d[i + 1] = t;
            swap_columns_keep_rotation(col[i], col[i + 1]);
        }
    }
    *w = om_vec3(d[0], d[1], d[2]);
}

// Complete u to a rotation where singular values vanish: those columns are free.
static void complete_rotation(OmVec3* u0, OmVec3* u1, OmVec3* u2, const double s[3]) {
    double tiny = 64 * DBL_EPSILON * s[0];
    *u0 = s[0] > 0.0 ? om_normalize(*u0) : om_vec3(1, 0, 0);
    *u1 = om_madd(*u1, -om_dot(*u0, *u1), *u0);
    *u1 = s[1] > tiny && om_norm(*u1) > 0.0 ? om_normalize(*u1) : om_orthogonal(*u0);
    *u2 = om_cross(*u0, *u1);
}

void om_mat3_svd(OmMat3 a, OmMat3* u, OmVec3* s, OmMat3* v) {
    double scale = mat3_max_abs(a);
    *u = om_mat3_identity();
    *v = om_mat3_identity();
    *s = om_vec3(0, 0, 0);
    if (!(scale > 0.0) || !isfinite(scale)) return;
    OmMat3 b = {om_vec3(a.cx.x / scale, a.cx.y / scale, a.cx.z / scale),
                om_vec3(a.cy.x / scale, a.cy.y / scale, a.cy.z / scale),
                om_vec3(a.cz.x / scale, a.cz.y / scale, a.cz.z / scale)};
    OmVec3* bc[3] = {&b.cx, &b.cy, &b.cz};
    OmVec3* vc[3] = {&v->cx, &v->cy, &v->cz};
    for (int sweep = 0; sweep < MAX_SWEEP; ++sweep) {
        bool is_done = true;
        for (int p = 0; p < 2; ++p) {
            for (int q = p + 1; q < 3; ++q) {
                double pp = om_norm2(*bc[p]), qq = om_norm2(*bc[q]), pq = om_dot(*bc[p], *bc[q]);
                if (fabs(pq) <= 1e-16 * sqrt(pp * qq)) continue;
                double c, sn;
                jacobi_rotation(pp, pq, qq, &c, &sn);
                rotate_columns(bc[p], bc[q], c, sn);
                rotate_columns(vc[p], vc[q], c, sn);
                is_done = false;
            }
        }
        if (is_done) break;
    }
    double d[3] = {om_norm(b.cx), om_norm(b.cy), om_norm(b.cz)};
    for (int pass = 0; pass < 2; ++pass) {
        for (int i = 0; i < 2; ++i) {
            if (d[i] >= d[i + 1]) continue;
            double t = d[i];
            d[i] = d[i + 1];
            d[i + 1] = t;
            swap_columns_keep_rotation(bc[i], bc[i + 1]);
            swap_columns_keep_rotation(vc[i], vc[i + 1]);
        }
    }
    OmVec3 last = b.cz;  // U S before completion: its third column gives the sign
    complete_rotation(&b.cx, &b.cy, &b.cz, d);
    *u = b;
    *s = om_vec3(scale * d[0], scale * d[1], scale * (om_dot(last, b.cz) < 0.0 ? -d[2] : d[2]));
}

OmMat3 om_mat3_polar(OmMat3 f) {
    OmMat3 u, v;
    OmVec3 s;
    om_mat3_svd(f, &u, &s, &v);
    return om_mat3_mul(u, om_mat3_transpose(v));
}
