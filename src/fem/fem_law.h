// fem_law.h: laws of elasticity as functions of F, in double: energy, stress and tangent.
//
// Matrices of the law are nine numbers by columns: F[3 c + r] is row r, column c. The tangent is
// H[9 a + b] = d2W / dF[a] dF[b], symmetric.
#ifndef OMENTUM_FEM_LAW_H
#define OMENTUM_FEM_LAW_H

#include "omentum/tissue_material.h"
#include "omentum/vec.h"

// Below these values, terms continue as Taylor polynomials of second order (positive powers of J that are factors,
// as reciprocals of such polynomials: they stay above 0). The value for logarithms is lower, because logarithms
// keep elements from inverting: with 0.2 crushed elements at the edge of a probe inverted, with 0.1 two of 177,000
// decreased to J = 0.006 and inverted for any step; with 0.02 they stay above 0.03.

typedef struct OmLawParam {  // constants of a law, ready for use
    OmLaw law;
    OmVolumetric volumetric;
    double lambda, mu;       // Pa
    double bulk;             // K of U(J), Pa
    double c10, c01;         // Pa
    int nterm;               // Ogden
    double a[OM_MAX_OGDEN];  // mu_p / alpha_p, Pa
    double alpha[OM_MAX_OGDEN];
} OmLawParam;

typedef enum OmLawPart {
    OM_LAW_WHOLE,
    OM_LAW_SHAPE  // without the volumetric term, which om__law_volume evaluates
} OmLawPart;

typedef enum OmLawOrder { OM_LAW_ENERGY, OM_LAW_STRESS, OM_LAW_TANGENT } OmLawOrder;

typedef struct OmLawValue {
    double W;      // J/m^3
    double P[9];   // dW/dF, first Piola-Kirchhoff, Pa
    double H[81];  // dP/dF, Pa
} OmLawValue;

typedef struct OmJet {  // a function of one variable with two derivatives
    double f, d, dd;
} OmJet;

void om__law_init(const OmMaterial* material, OmLawParam* law);
/// Evaluates up to derivative `order`. Finite for every finite F.
void om__law_eval(const OmLawParam* law, const double F[9], OmLawPart part, OmLawOrder order,
                  OmLawValue* out);
/// Has the law a term in J alone that can be split off?
bool om__law_is_split(const OmLawParam* law);
/// That term, U(J), of a law that is split.
OmJet om__law_volume(const OmLawParam* law, double J);
/// Is W = mu/2 (I1 - 3) + f(J)? And f.
bool om__law_is_neo(const OmLawParam* law);
OmJet om__law_neo_volume(const OmLawParam* law, double J);
/// The nearest positive semidefinite tangent of an isotropic law at F: in the frame of the singular vectors H
/// is a 3 x 3 and three 2 x 2 matrices, whose negative eigenvalues become zero.
void om__law_project(const double F[9], double H[81]);

/// Determinant, its derivative C = dJ/dF (the cofactors), and h times its second derivative added to H.
double om__law_det(const double F[9], double C[9]);
void om__law_add_det2(const double F[9], double h, double H[81]);

#endif
