// match_spectral_internal.h: shared by the files of functional maps.
#ifndef OM_MATCH_SPECTRAL_INTERNAL_H
#define OM_MATCH_SPECTRAL_INTERNAL_H

#include "omentum/match_spectral.h"

/// As om_laplacian_init, matrix and areas times `scale`.
OmStatus om__laplacian_init(int nvert, const double* x, int ntri, const int* tri_vert, double scale,
                            OmLaplacian* out);

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
