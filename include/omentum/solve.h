/// omentum/solve.h: block-sparse symmetric systems of 3x3 blocks (floor 1).
///
/// A pattern is fixed once; values are refreshed every step; solvers are interchangeable: CG with block
/// Jacobi, CG with multigrid, or a sparse Cholesky factor (CHOLMOD). Matrices are float; residuals that
/// decide anything are recomputed in double.
///
///     om_bsr_create(nvert, nedge, edge, &A);          // pattern: diagonal plus both triangles
///     ... fill A.diag and A.offd ...
///     om_solver_create(&def, &A, x, &solver);         // x: vertex positions, for the multigrid
///     om_solver_refresh(solver, &A);                  // after each change of values
///     om_solver_solve(solver, &A, nrhs, b, x, &info);
#ifndef OMENTUM_SOLVE_H
#define OMENTUM_SOLVE_H

#include "omentum/base.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum OmPreconditioner { OM_BLOCK_JACOBI, OM_MULTIGRID, OM_CHOLESKY } OmPreconditioner;

typedef struct OmSolveInfo {  // what a solve did
    int iterations;           // CG iterations, the most of any right-hand side
    double residual;  // |b - A x| / |b|, recomputed in double, the largest of any right-hand side
} OmSolveInfo;

#ifdef __cplusplus
}
#endif
#endif
