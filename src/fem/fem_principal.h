// fem_principal.h: laws of elasticity in principal stretches.
//
// With F = U diag(s) V^T, U and V rotations and s[2] negative where F is inverted, an isotropic law is a
// function W(s). In the frame of U and V its stress is diagonal, P[i] = dW/ds_i, and its tangent decouples
// (Smith, de Goes and Kim 2018, "Stable neo-Hookean flesh simulation", section 4): dP_ii = sum_j H_ij dF_jj,
// and for a pair (i, j) with k the third index dP_ij = own[k] dF_ij + cross[k] dF_ji, with own + cross =
// (P_i - P_j) / (s_i - s_j) the stiffness of a symmetric change and own - cross = (P_i + P_j) / (s_i + s_j)
// that of a rotation.
#ifndef OMENTUM_FEM_PRINCIPAL_H
#define OMENTUM_FEM_PRINCIPAL_H

#include "fem/fem_law.h"
#include "omentum/vec.h"

typedef struct OmPrincipal {
    double W;        // J/m^3
    double P[3];     // Pa
    double H[3][3];  // Pa
    double own[3], cross[3];
} OmPrincipal;

/// What selective integration evaluates at a point (fem_quadratic.h). lambda is 2 mu at most in the inner law, that is
/// Poisson's ratio 1/3; the wide part is the rest of the terms with lambda, or with K, and has no term with mu.
typedef enum OmLawShare { OM_SHARE_WHOLE, OM_SHARE_INNER, OM_SHARE_WIDE } OmLawShare;
#define OM__INNER_RATIO 2.0  // lambda / mu of the inner law, at most

/// Constants of a share, Pa: lambda and K, and mu, which is zero in the wide part.
void om__law_share(const OmMaterial* material, OmLawShare share, double* lambda, double* mu,
                   double* bulk);
/// Any law except OM_LINEAR, which is not a function of stretches.
void om__principal_eval(const OmMaterial* material, OmLawShare share, const double s[3],
                        OmPrincipal* out);
/// The nearest positive semidefinite tangent: negative eigenvalues to zero.
void om__principal_project(OmPrincipal* p);
/// First Piola-Kirchhoff stress and energy density at F, every law.
OmMat3 om__law_stress(const OmMaterial* material, OmLawShare share, OmMat3 F, double* energy);

#endif
