/// omentum/solve.h: block-sparse systems of 3x3 blocks, symmetric ones above all (floor 1).
///
/// The pattern is made once from the elements, values are written in each step. Solvers are interchangeable: CG with
/// block Jacobi, CG with multigrid, sparse Cholesky factors (CHOLMOD). A matrix that is not symmetric is solved with
/// sparse LU factors (UMFPACK), or by GMRES with a symmetric solver as preconditioner. Matrices are float; the
/// reported residual is recomputed in double from b - A x. If CG in float stagnates (very flat elements), CG in
/// double with block Jacobi continues.
///
///     om_bsr_create(nvert, ntet, 4, tet_vert, &A);    // every pair of vertices of an element
///     ... write A.value ...
///     OmSolverDef def = om_solver_default_def();
///     om_solver_create(&def, &A, x_rest, &solver);    // x_rest: vertex positions, for the multigrid
///     om_solver_refresh(solver, &A);                  // after each change of values
///     om_solver_solve(solver, &A, 1, b, x, &info);
#ifndef OMENTUM_SOLVE_H
#define OMENTUM_SOLVE_H

#include "omentum/base.h"
#include "omentum/vec.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- the matrix -----------------------------------------------------------------------------------

/// A symmetric matrix of 3x3 blocks, one row of blocks a vertex, both triangles stored.
///
/// Row i holds the blocks row_adr[i] .. row_adr[i + 1]: first the diagonal block (i, i), then the
/// neighbours in ascending order. Entry (3 i + r, 3 j + c) of block k is value[9 k + 3 c + r]: blocks
/// are stored by columns. A caller that writes block (i, j) also writes its transpose to (j, i), except for OM_LU and
/// om_solver_solve_gmres, which take any values in this pattern.
///
/// Assembly without atomics: give each thread rows, or edges. Edge e joins vertices i < j; its blocks
/// (i, j) and (j, i) are edge_adr[2 e] and edge_adr[2 e + 1], its vertices edge_vert[2 e], [2 e + 1];
/// edges are in ascending order of (i, j).
typedef struct OmBsr {
    int nvert;       // rows of blocks
    int nedge;       // pairs i < j
    int nblock;      // nvert + 2 nedge
    int* row_adr;    // first block of each row, the diagonal one             (nvert + 1)
    int* col;        // vertex of each block                                  (nblock)
    int* edge_vert;  // vertices i < j of each edge                           (nedge x 2)
    int* edge_adr;   // its blocks (i, j) and (j, i)                          (nedge x 2)
    float* value;    // blocks by columns, then 3 floats of padding           (nblock x 9 + 3)
    double* exact;   // the same in double, or null; used by Cholesky factors  (nblock x 9)
    const struct OmTies* ties;  // further terms, borrowed, summed; or null
} OmBsr;

/// The pattern that couples all vertices of each element (2: edges, 4: tetrahedra, 8: hexahedra).
/// Values are zero. Vertices outside every element keep a diagonal block.
/// @param elem_vert  vertices of the elements (nelem x nelem_vert)
/// @return OM_OK, OM_INVALID (index out of range), OM_NO_MEMORY
OM_API OmStatus om_bsr_create(int nvert, int nelem, int nelem_vert, const int* elem_vert, OmBsr* A);
OM_API void om_bsr_destroy(OmBsr* A);
/// Index of block (i, j), or -1 if it is not in the pattern.
OM_API int om_bsr_find(const OmBsr* A, int i, int j);
/// Blocks of every pair of local vertices: adr[(e nelem_vert + a) nelem_vert + b] is block (a, b) of
/// element e.
/// @return OM_OK, OM_INVALID (a pair is not in the pattern)
OM_API OmStatus om_bsr_find_elements(const OmBsr* A, int nelem, int nelem_vert,
                                     const int* elem_vert, int* adr);
/// Also keep the values in double, for statics of full precision. A caller that writes `value` must then write `exact`,
/// too.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_bsr_make_exact(OmBsr* A);
/// All values to zero.
OM_API void om_bsr_zero(OmBsr* A);
/// Add a 3x3 matrix to block k; springs and contacts add to block row_adr[i], before the refresh.
static inline void om_bsr_add(OmBsr* A, int k, OmMat3 m) {
    float* v = A->value + 9 * (size_t)k;
    const double e[9] = {m.cx.x, m.cx.y, m.cx.z, m.cy.x, m.cy.y, m.cy.z, m.cz.x, m.cz.y, m.cz.z};
    for (int n = 0; n < 9; ++n) v[n] = (float)((double)v[n] + e[n]);
    for (int n = 0; n < 9 && A->exact; ++n) A->exact[9 * (size_t)k + (size_t)n] += e[n];
}
/// y = A x, summed in double. x, y: (nvert x 3), not the same array.
OM_API void om_bsr_apply(const OmBsr* A, int nworker, const double* x, double* y);

// ---- ties ------------------------------------------------------------------------------------------

/// Terms between vertices that share no element: of a contact between two surfaces, of a spring between two bodies. A
/// tie adds w_a w_b K to block (a, b) for every two of its vertices. A matrix with ties (OmBsr.ties) is solved by CG;
/// OM_CHOLESKY, OM_LU and om_solver_solve_gmres refuse it.
typedef struct OmTies OmTies;

/// @param nvert  rows of the matrix
/// @return OM_OK; OM_INVALID; OM_NO_MEMORY
OM_API OmStatus om_ties_create(int nvert, OmTies** ties);
OM_API void om_ties_destroy(OmTies* ties);
OM_API void om_ties_clear(OmTies* ties);
/// @param num     vertices, 1 to 256; different ones
/// @param K       symmetric positive semidefinite
/// @return OM_OK; OM_INVALID (a vertex out of range); OM_NO_MEMORY
OM_API OmStatus om_ties_add(OmTies* ties, int num, const int* vert, const double* weight, OmMat3 K);
/// Sum the ties by rows: after the last om_ties_add and before the matrix is used.
/// @return OM_OK; OM_INVALID (too many); OM_NO_MEMORY
OM_API OmStatus om_ties_sum(OmTies* ties);
OM_API int om_ties_count(const OmTies* ties);
/// y += row i of the ties times x (nvert x 3).
OM_API void om_ties_apply_row(const OmTies* ties, const double* x, int i, OmVec3* y);
OM_API size_t om_ties_memory(const OmTies* ties);

// ---- solvers --------------------------------------------------------------------------------------

typedef enum OmPreconditioner {
    OM_BLOCK_JACOBI,  // CG with the inverses of the diagonal blocks
    OM_MULTIGRID,     // CG with one V-cycle; needs vertex positions
    OM_CHOLESKY,      // no CG: CHOLMOD factors A in double; the reference, and for small models
    OM_LU             // no CG: UMFPACK factors A in double; A need not be symmetric
} OmPreconditioner;

typedef struct OmSolverDef {          // made by om_solver_default_def
    OmPreconditioner preconditioner;  // default OM_MULTIGRID
    // Largest number of CG iterations in a solve, >= 1; default 200. If multigrid fails and block Jacobi continues,
    // eight of its iterations count as one; such a solve may take four times as long.
    int max_iterations;
    // Stop at |b - A x| <= tolerance |b|, in [0, 1); 0: always max_iterations. Default 1e-3.
    double tolerance;
    int nworker;  // threads, 0 is one per processor; default 0
    int max_rhs;  // right-hand sides that will share one sweep over A, 1..8; default 1
    // Of OM_MULTIGRID: an upper bound of the eigenvalues of D^-1 A, where D is the diagonal blocks.
    // Default 4, right for linear tetrahedra; the number of nodes of an element is always enough.
    double row_bound;
    OmCookie cookie;  // set by om_solver_default_def
} OmSolverDef;

typedef struct OmSolveInfo {  // outcome of a solve
    int iterations;           // CG iterations, the most of any right-hand side; 0 for factors
    double residual;  // |b - A x| / |b|, recomputed in double, the largest of any right-hand side
} OmSolveInfo;

/// A solver for one pattern: symbolic data, factors, work vectors. For one thread at a time.
typedef struct OmSolver OmSolver;

OM_API OmSolverDef om_solver_default_def(void);
/// @param A       the pattern; its values are not read, and it is not referenced afterwards
/// @param x_rest  vertex positions, m (nvert x 3); null unless OM_MULTIGRID
/// @return OM_OK, OM_INVALID (a field of def, positions not finite), OM_NO_MEMORY
OM_API OmStatus om_solver_create(const OmSolverDef* def, const OmBsr* A, const double* x_rest,
                                 OmSolver** solver);
OM_API void om_solver_destroy(OmSolver* solver);
/// Prescribe degrees of freedom: their rows and columns leave the system, and a solve keeps the given x there. May be
/// called at any time (grasp, release); takes effect at the next refresh.
/// @param fixed  nonzero where prescribed (nvert x 3); null frees all
OM_API void om_solver_set_fixed(OmSolver* solver, const unsigned char* fixed);
/// In later solves, divide residuals by `norm` instead of |b|. Stiff penalties make |b| large, which would loosen the
/// tolerance. 0 (default): |b|. Not used by OM_CHOLESKY.
OM_API void om_solver_set_reference(OmSolver* solver, double norm);
/// Read new values of A: invert diagonal blocks, compute coarse matrices, or factorise. Allocates only inside CHOLMOD,
/// and where A has more ties than before.
/// @param A  the pattern of create
/// @return OM_OK, OM_NOT_SPD (a pivot is not positive; OM_LU: singular; solve refuses until the next refresh),
///         OM_INVALID (a value is not finite), OM_UNAVAILABLE (factors of a matrix with ties), OM_NO_MEMORY (ties)
OM_API OmStatus om_solver_refresh(OmSolver* solver, const OmBsr* A);
/// The same after a few stiff terms (contacts) were added or removed: only diagonal blocks are inverted again, coarse
/// matrices stay. This changes the number of iterations, not the solution. OM_CHOLESKY factorises.
/// @return OM_OK; OM_INVALID (another pattern); OM_NOT_SPD (a diagonal block)
OM_API OmStatus om_solver_refresh_diagonal(OmSolver* solver, const OmBsr* A);
/// The sign of the determinant of an OM_LU solver's matrix, 1 or -1; 0 for the others, and if not refreshed.
OM_API int om_solver_sign(const OmSolver* solver);
/// Replace def.tolerance in later solves; outside (0, 1) it is def.tolerance again.
OM_API void om_solver_set_tolerance(OmSolver* solver, double tolerance);
/// Solve A x = b for the free degrees of freedom.
/// @param A     as at the last refresh
/// @param nrhs  right-hand sides, any number >= 1; taken max_rhs at a time
/// @param b     (nrhs x nvert x 3); its entries at fixed degrees of freedom are not used
/// @param x     in: first guess, and the prescribed values; out: the solution (nrhs x nvert x 3)
/// @param info  may be null. The residual is relative to |b - A x_fixed| over free degrees of freedom,
///              x_fixed being x with zeros at the free ones
/// @return OM_OK; OM_NOT_CONVERGED (x is the best iterate: its residual is not larger than that of the first guess).
///         With tolerance 0 always OM_OK, and the energy x.A x / 2 - b.x is not larger than at the first guess;
///         OM_NOT_SPD (x unchanged); OM_INVALID (b or x not finite, not refreshed; x unchanged)
OM_API OmStatus om_solver_solve(OmSolver* solver, const OmBsr* A, int nrhs, const double* b,
                                double* x, OmSolveInfo* info);
/// Solve B x = b for a B that is not symmetric, by GMRES (flexible; Saad 1993) with this solver as preconditioner.
/// @param A          a symmetric approximation of B, as at the last refresh
/// @param B          the pattern of A, any values; `exact` is used if it is there
/// @param tolerance  of |b - B x| over that of the prescribed values alone, in (0, 1)
/// @param b, x       one right-hand side, as in om_solver_solve; zero is the first guess
/// @return as om_solver_solve; OM_NO_MEMORY (60 vectors are taken for the time of the call)
OM_API OmStatus om_solver_solve_gmres(OmSolver* solver, const OmBsr* A, const OmBsr* B,
                                      double tolerance, const double* b, double* x,
                                      OmSolveInfo* info);
/// Bytes held by the solver, work vectors and coarse levels included, CHOLMOD's factor not.
OM_API size_t om_solver_memory(const OmSolver* solver);

#ifdef __cplusplus
}
#endif
#endif
