/// omentum/tissue_material.h: laws of elasticity and their constants (floor 2).
///
/// A law of elasticity and its constants. With F the deformation gradient, J = det F, I1 = tr F^T F, I2 =
/// (I1^2 - |F^T F|^2) / 2, their isochoric parts I1bar = J^(-2/3) I1, I2bar = J^(-4/3) I2, and stretches
/// l_k the (signed) singular values of F; lambda, mu and K are Lame's constants and the bulk modulus of
/// `young` and `poisson` unless a field gives them. U(J) is a volumetric term (OmVolumetric).
///
///     OmMaterial tissue = {.young = 3000, .poisson = 0.45};                    // corotational
///     OmMaterial breast = {.young = 3000, .poisson = 0.45, .law = OM_NEO_HOOKEAN};
///
/// Logarithms and fractional powers are not defined for J <= 0. Below a limit, Taylor polynomials of second order
/// replace them: below J = 0.02 every term of ln J (a square of ln J counts as one term), below 0.2 the powers of J and
/// of stretches. So every law is twice continuously differentiable for every F, also for inverted elements, and its
/// forces act against inversion.
#ifndef OMENTUM_TISSUE_MATERIAL_H
#define OMENTUM_TISSUE_MATERIAL_H

#include "omentum/base.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_MAX_OGDEN 4
// Largest Poisson's ratio: nearer to 0.5 the bulk modulus exceeds 5,000 times the shear modulus.
#define OM_MAX_POISSON 0.4999
#define OM_LAW_LOG_FLOOR 0.02   // below this J, polynomials replace logarithms
#define OM_LAW_POWER_FLOOR 0.2  // below this J or stretch, polynomials replace powers

typedef enum OmLaw {
    OM_COROTATIONAL,  // linear elasticity rotated with the element: mu |S - I|^2 + lambda/2 tr(S - I)^2
    OM_LINEAR,        // small strain; valid for small rotations only
    OM_ST_VENANT_KIRCHHOFF,  // thesis (2.9): lambda/2 tr(E)^2 + mu |E|^2, E = (F^T F - I) / 2
    OM_NEO_HOOKEAN,          // (2.11) coupled: mu/2 (I1 - 3) - mu ln J + lambda/2 (ln J)^2
    OM_STABLE_NEO_HOOKEAN,  // Smith et al. 2018: mu/2 (I1 - 3) - mu (J - 1) + (lambda + mu)/2 (J - 1)^2
    OM_MOONEY_RIVLIN,       // c10 (I1bar - 3) + c01 (I2bar - 3) + U(J); neo-Hookean if both are 0
    OM_OGDEN,  // (2.12) sum_p mu_p / alpha_p (l1bar^alpha_p + l2bar^alpha_p + l3bar^alpha_p - 3) + U(J)
    OM_OGDEN_COUPLED,  // sum_p mu_p / alpha_p (l1^alpha_p + .. - 3) - sum_p mu_p ln J + U(J)
    OM_NLAW
} OmLaw;

typedef enum OmVolumetric {  // U(J) of OM_MOONEY_RIVLIN and the Ogden laws
    OM_VOLUME_LINEAR,        // K/2 (J - 1)^2
    OM_VOLUME_LOG,           // K/2 (ln J)^2
    OM_VOLUME_MIXED,         // K/4 (J^2 - 1 - 2 ln J)
    OM_NVOLUMETRIC
} OmVolumetric;

typedef struct OmMaterial {
    double young;             // Pa, > 0; default 3000
    double poisson;           // 0 to 0.4999; default 0.45
    OmLaw law;                // default OM_COROTATIONAL
    OmVolumetric volumetric;  // default OM_VOLUME_LINEAR
    double bulk;              // K, Pa, in [0, 1e12]; 0: from young and poisson
    double c10, c01;          // Pa, in [0, 1e12], Mooney-Rivlin; both 0: mu / 2 and 0
    int nterm;  // Ogden, at most OM_MAX_OGDEN; 0: one term, mu_1 = 2 mu / alpha, alpha_1 = 2
    // mu_p, Pa, at most 1e12, and alpha_p, at most 100: of the same sign, not 0
    double ogden_mu[OM_MAX_OGDEN], ogden_alpha[OM_MAX_OGDEN];
} OmMaterial;

OM_API const char* om_law_name(OmLaw law);  // "neo-hookean"; null if there is no such law
/// Find a law by its name, e.g. from a file.
/// @return OM_OK; OM_INVALID (the message has the nearest name)
OM_API OmStatus om_law_find(const char* name, OmLaw* law);
/// @param field  field of the definition that contains the material, for the message, e.g. "material[2]"
/// @return OM_OK; OM_INVALID (the message names the field and the range)
OM_API OmStatus om_material_validate(const OmMaterial* material, const char* field);
/// Lame's constants and bulk modulus, Pa; for a law with constants of its own, of its linearisation at rest.
OM_API void om_material_lame(const OmMaterial* material, double* lambda, double* mu, double* bulk);

#ifdef __cplusplus
}
#endif
#endif
