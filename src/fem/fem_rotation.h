// fem_rotation.h: the rotations of sixteen deformation gradients.
//
// R is the rotation that maximises f = tr(R^T F) = s1 + s2 +- s3. f is the largest root
// of the quartic f^4 - 2 |F|^2 f^2 - 8 J f + 2 |F^T F|^2 - |F|^4 (Lin, Chitalu and Komura 2022, "Isotropic
// ARAP energy using Cauchy-Green invariants", eq. 9), found by Newton from above, sqrt(3) |F|; then
//
//     R = df/dF = ((f^2 + |F|^2) F + 2 f cof F - 2 F F^T F) / (f^3 - |F|^2 f - 2 J)
//
// The denominator is 2 (s1 + s2)(s2 +- s3)(s3 +- s1): positive for inverted elements too, zero only where
// R is not unique. Lanes near zero, or where Newton has not converged, use the SVD in double. R is a
// function of x alone: a restored state replays to the same bytes. Tried and rejected: warm-started
// quaternions (Mueller 2016), whose R depends on earlier steps.
#ifndef OMENTUM_FEM_ROTATION_H
#define OMENTUM_FEM_ROTATION_H

#include "fem/fem_simd.h"

#define OM__ROTATION_NEWTON 5
#define OM__MIN_GAP 0.05F            // denominator of R where |F|^2 = 3; 16 at F = I
#define OM__MAX_ROTATION_STEP 1e-4F  // of the last Newton step

// R of every lane; is_bad where it needs the SVD.
OM__INLINE void find_rotations(Lanes F[9], Lanes R[9], int is_bad[OM__LANE]) {
    for (int l = 0; l < OM__LANE; ++l) {
        float a[9], cof[9], C[9];
        float norm2 = 1e-30F;
        for (int k = 0; k < 9; ++k) norm2 += F[k][l] * F[k][l];
        float scale = sqrtf(3.0F / norm2);
        for (int k = 0; k < 9; ++k) a[k] = scale * F[k][l];
        for (int c = 0; c < 3; ++c) {
            int p = 3 * ((c + 1) % 3), q = 3 * ((c + 2) % 3);
            cof[3 * c] = a[p + 1] * a[q + 2] - a[p + 2] * a[q + 1];
            cof[3 * c + 1] = a[p + 2] * a[q] - a[p] * a[q + 2];
            cof[3 * c + 2] = a[p] * a[q + 1] - a[p + 1] * a[q];
        }
        float J = a[0] * cof[0] + a[1] * cof[1] + a[2] * cof[2];
        float cc = 0;
        for (int k = 0; k < 9; ++k) cc += cof[k] * cof[k];
        // p(f) = f^4 - 6 f^2 - 8 J f + 9 - 4 |cof|^2, from f = 3.
        float f = 3.0F, step = 0.0F, constant = 9.0F - 4.0F * cc;
        for (int n = 0; n < OM__ROTATION_NEWTON; ++n) {
            float f2 = f * f;
            float p = (f2 - 6.0F) * f2 - 8.0F * J * f + constant;
            float dp = 4.0F * ((f2 - 3.0F) * f - 2.0F * J);
            step = p / (dp > 1e-3F ? dp : 1e-3F);
            f -= step;
        }
        for (int c = 0; c < 3; ++c)
            for (int r = 0; r < 3; ++r)
                C[3 * c + r] =
                    a[3 * c] * a[3 * r] + a[3 * c + 1] * a[3 * r + 1] + a[3 * c + 2] * a[3 * r + 2];
        float gap = (f * f - 3.0F) * f - 2.0F * J;
        float inv = 1.0F / (gap > OM__MIN_GAP ? gap : OM__MIN_GAP);
        float kF = (f * f + 3.0F) * inv, kcof = 2.0F * f * inv, kC = -2.0F * inv;
        for (int c = 0; c < 3; ++c)
            for (int r = 0; r < 3; ++r)
                R[3 * c + r][l] =
                    kF * a[3 * c + r] + kcof * cof[3 * c + r] +
                    kC * (a[r] * C[3 * c] + a[3 + r] * C[3 * c + 1] + a[6 + r] * C[3 * c + 2]);
        is_bad[l] = !(gap >= OM__MIN_GAP) | !(fabsf(step) <= OM__MAX_ROTATION_STEP);
    }
}

// Degenerate lanes, one by one in double.
OM__INLINE void repair_rotations(Lanes F[9], Lanes R[9], const int is_bad[OM__LANE]) {
    for (int l = 0; l < OM__LANE; ++l) {
        if (!is_bad[l]) continue;
        double f[9];
        for (int k = 0; k < 9; ++k) f[k] = (double)F[k][l];
        OmMat3 r = om_mat3_polar(om_mat3_cols(om_vec3(f[0], f[1], f[2]), om_vec3(f[3], f[4], f[5]),
                                              om_vec3(f[6], f[7], f[8])));
        const double e[9] = {r.cx.x, r.cx.y, r.cx.z, r.cy.x, r.cy.y,
                             r.cy.z, r.cz.x, r.cz.y, r.cz.z};
        for (int k = 0; k < 9; ++k) R[k][l] = (float)e[k];
    }
}

#endif
