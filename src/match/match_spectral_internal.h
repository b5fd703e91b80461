// match_spectral_internal.h: shared by the files of functional maps.
#ifndef OM_MATCH_SPECTRAL_INTERNAL_H
#define OM_MATCH_SPECTRAL_INTERNAL_H

#include "omentum/match_spectral.h"

/// As om_laplacian_init, matrix and areas times `scale`.
OmStatus om__laplacian_init(int nvert, const double* x, int ntri, const int* tri_vert, double scale,
                            OmLaplacian* out);

// ---- match_spectral.c ---------------------------------------------------------------------------------

OmStatus om__spectral_check(const OmSpectralDef* def, const OmSpectralBasis* a,
                            const OmSpectralBasis* b);
/// Rows of a for the rows of b, -1 where unknown; `nknown` are known.
OmStatus om__spectral_rows(const OmSpectralBasis* a, const OmSpectralBasis* b, const int* map,
                           int* partner, int* nknown);
/// Functions of a that go with nb of b: up to the frequency of b's last one, and at least nb: a shape has more
/// functions than its part. INT32_MAX: more than the basis of a holds.
int om__spectral_count(const OmSpectralDef* def, const OmSpectralBasis* a, const OmSpectralBasis* b,
                       int nb);
/// C (nb x na) of the partners. Unknown ones leave the mean: then C solves the normal equations over the others.
OmStatus om__spectral_matrix(const OmSpectralBasis* a, const OmSpectralBasis* b, const int* partner,
                             int na, int nb, double* C);
/// Rows of a (nrow x nb) in the space of b's first nb functions.
void om__spectral_embed(const OmSpectralDef* def, const OmSpectralBasis* a,
                        const OmSpectralBasis* b, int na, int nb, const double* C, double* image);

// ---- match_neighbours.c: dense products ---------------------------------------------------------------

/// nearest[j]: the row of `a` (na x k) nearest to row j of `b` (nb x k); the first of equal ones. Rows lie k apart
/// in `a`, stride_b apart in `b`.
OmStatus om__nearest_rows(int na, const double* a, int nb, const double* b, int stride_b, int k,
                          int nworker, int* nearest);
/// C (m x n) = A^T B for A (rows x m, rows lie stride_a apart), B (rows x n).
void om__product_tn(int rows, int m, int n, const double* A, int stride_a, const double* B,
                    double* C);
/// C (rows x n) = scale A B^T for A (rows x m, rows lie stride_a apart), B (n x m).
void om__product_nt(int rows, int m, int n, double scale, const double* A, int stride_a,
                    const double* B, double* C);
/// Solve M x = r for nrhs right-hand sides by rows (nrhs x n), in place; M (n x n, symmetric, overwritten).
/// False: not positive definite.
bool om__dense_solve(int n, double* M, int nrhs, double* r);

#endif
