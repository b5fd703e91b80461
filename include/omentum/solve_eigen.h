/// omentum/solve_eigen.h: sparse symmetric matrices of numbers, and their smallest eigenpairs (floor 1).
///
/// A x = lambda B x with A symmetric and B symmetric positive definite: modes of a surface (room `match`), buckling
/// and vibration. The method is shift-invert Lanczos with implicit restarts: ARPACK on sparse Cholesky factors.
///
///     om_csr_init(n, nentry, row, col, value, &A);       // triplets; equal places are added
///     OmEigenDef def = om_eigen_default_def(60, -1e-3);  // 60 pairs, the shift below the spectrum
///     om_eigen_smallest(&def, &A, &B, eigenvalue, eigenvector, &info);
///     om_csr_done(&A);
#ifndef OMENTUM_SOLVE_EIGEN_H
#define OMENTUM_SOLVE_EIGEN_H

#include "omentum/base.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmCsr {  // a square sparse matrix; om_csr_done frees
    int n;              // rows and columns
    int* row_adr;       // first entry of each row                        (n + 1)
    int* col;           // column of each entry, ascending in a row       (row_adr[n])
    double* value;      //                                                (row_adr[n])
} OmCsr;

/// A matrix from triplets. Entries with the same row and column are added, in their order; zeros stay.
/// @param row, col, value  (nentry); a symmetric matrix needs both triangles
/// @return OM_OK; OM_INVALID (a size below 1, an index out of range, a value that is not finite); OM_NO_MEMORY
OM_API OmStatus om_csr_init(int n, int nentry, const int* row, const int* col, const double* value,
                            OmCsr* A);
/// The diagonal matrix of `value` (n).
/// @return OM_OK; OM_INVALID (n below 1, a value that is not finite); OM_NO_MEMORY
OM_API OmStatus om_csr_init_diagonal(int n, const double* value, OmCsr* A);
OM_API void om_csr_done(OmCsr* A);
/// y = A x, (n) each, not the same array.
OM_API void om_csr_apply(const OmCsr* A, const double* x, double* y);
/// Entry (i, j); 0 if it is not stored.
OM_API double om_csr_get(const OmCsr* A, int i, int j);

typedef struct OmEigenDef {  // made by om_eigen_default_def
    int npair;               // eigenpairs, 1 to n - 1
    // Below the smallest eigenvalue: A - shift B must be positive definite. Best about as far below it as the
    // eigenvalues lie apart.
    double shift;
    double tolerance;  // relative to an eigenvalue's distance from the shift; default 1e-10
    int max_restarts;  // of a run, >= 1; default 300
    int nbasis;  // Lanczos vectors, npair < nbasis <= n; 0: min(n, max(2 npair, 20)); default 0
    OmCookie cookie;  // set by om_eigen_default_def
} OmEigenDef;

typedef struct OmEigenInfo {
    int npair;        // converged
    int nsolve;       // solves with A - shift B
    double residual;  // largest |A x - lambda B x| / |(lambda - shift) B x|
} OmEigenInfo;

OM_API OmEigenDef om_eigen_default_def(int npair, double shift);

/// The smallest eigenpairs of A x = lambda B x, ascending, every copy of a multiple eigenvalue included. The same
/// arguments give the same bytes if no other thread factors a large matrix at the time: the first vector is fixed, and
/// one thread works. ARPACK keeps state between calls, so calls from several threads wait for each other, and a call
/// inside om_parallel_for is refused.
/// @param B            symmetric positive definite, of the size of A; null: the identity
/// @param eigenvalue   (npair), ascending
/// @param eigenvector  (npair x n), x_i . B x_j = 1 if i = j, else 0; the largest entry of each is positive
/// @param info         may be null
/// @return OM_OK; OM_INVALID (def, sizes, a matrix that is not symmetric or not finite, B not positive definite, called
///         inside a parallel loop); OM_NO_MEMORY; OM_NOT_SPD (A - shift B is not positive definite; nothing written);
///         OM_NOT_CONVERGED (the info->npair pairs that converged come first, smaller ones may be missing; the rest is
///         zero)
OM_API OmStatus om_eigen_smallest(const OmEigenDef* def, const OmCsr* A, const OmCsr* B,
                                  double* eigenvalue, double* eigenvector, OmEigenInfo* info);

#ifdef __cplusplus
}
#endif
#endif
