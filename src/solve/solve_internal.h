// solve_internal.h: shared by the files of the room.
//
// Vectors of the iterative solvers come in two layouts. One right-hand side: four floats a vertex, the
// fourth zero, so that a vertex is one 16-byte load. Eight at once: x, y, z of eight lanes each, 24
// floats, so that each value of A is loaded once for all. Rows are cut into chunks that depend on the
// matrix alone; a worker takes a run of chunks, and sums are added chunk by chunk: same bytes for any
// number of workers.
#ifndef OMENTUM_SOLVE_INTERNAL_H
#define OMENTUM_SOLVE_INTERNAL_H

#include "base/base_multiversion.h"
#include "omentum/solve.h"
#include "omentum/solve_eigen.h"

typedef struct OmCholesky OmCholesky;    // solve_cholmod.c
typedef struct OmLu OmLu;                // solve_umfpack.c, or solve_superlu.c
typedef struct OmMultigrid OmMultigrid;  // solve_multigrid.c

typedef struct OmInterp OmInterp;  // solve_multigrid.h
typedef struct OmDense OmDense;

#define OM_MAX_LANE 8

// Row i of A x, in double.
OM_INLINE OmVec3 om__row_product(const OmBsr* A, const double* x, int i) {
    double y0 = 0, y1 = 0, y2 = 0;
    for (int k = A->row_adr[i]; k < A->row_adr[i + 1]; ++k) {
        const float* v = A->value + 9 * (size_t)k;
        const double* xj = x + 3 * (size_t)A->col[k];
        y0 += (double)v[0] * xj[0] + (double)v[3] * xj[1] + (double)v[6] * xj[2];
        y1 += (double)v[1] * xj[0] + (double)v[4] * xj[1] + (double)v[7] * xj[2];
        y2 += (double)v[2] * xj[0] + (double)v[5] * xj[1] + (double)v[8] * xj[2];
    }
    return om_vec3(y0, y1, y2);
}

// Index of column j among the ascending columns col[lo .. hi), -1: not there.
OM_INLINE int om__find_column(const int* col, int lo, int hi, int j) {
    int end = hi;
    while (lo < hi) {
        int mid = lo + (hi - lo) / 2;
        if (col[mid] < j)
            lo = mid + 1;
        else
            hi = mid;
    }
    return lo < end && col[lo] == j ? lo : -1;
}

typedef struct OmRank {  // a member of a team and its rows of the matrix
    OmTeam* team;
    int rank, size;
    int begin, end;
    // direction of the next sweep over the matrix; a sweep starts at the end of the last one
    bool is_backward;
} OmRank;

typedef struct OmChunks {  // rows cut into pieces of about equal work
    int num;
    int* begin;  // first row of each chunk                                         (num + 1)
} OmChunks;

struct OmSolver {
    OmSolverDef def;
    double tolerance;  // def.tolerance unless it was replaced
    double reference;  // tolerance and residual are relative to this norm; 0: to that of b
    int nvert, nblock;
    bool is_ready;  // refreshed, and positive definite
    OmChunks chunks;
    unsigned char* fixed;  // prescribed degrees of freedom                         (nvert x 3)
    int nfixed_vert;       // vertices with one or more of them
    int* fixed_vert;       // ascending                                             (nvert)
    int* chunk_fixed;      // first of fixed_vert in each chunk                     (num + 1)
    float* free_mask;      // 1 where free, of fixed_vert                           (nvert x 4)
    float* dinv;           // inverses of diagonal blocks, zero where prescribed    (nvert x 9 + 3)
    int max_lane;          // 1 or 8
    double* xd;       // the iterate                                           (nvert x 3 x lanes)
    double* rd;       // its residual                                          (nvert x 3 x lanes)
    double* partial;  // sums of the chunks, one column a quantity and lane  (3 lanes + 2) x num
    // one block for the vectors below, also used as doubles (solve_double.c)
    float* vector;
    float *r, *u, *w, *p, *s, *x;  // CG vectors                                    (nvert x width)
    OmCholesky* cholesky;
    OmLu* lu;
    OmMultigrid* multigrid;
    size_t memory;  // bytes
};

// ---- solve_kernel.c, solve_kernel8.c: loops over rows [begin, end) -----------------------------------

/// One smoothing step: r_out = r - A d, d_out = c1 d + c2 dinv r_out, x += d_out. d_out may be null: then
/// only the residual. r may be r_out; d may not be d_out.
typedef struct OmSmooth {
    const float* r;
    float* r_out;
    const float* d;
    float *d_out, *x;
    float c1, c2;
} OmSmooth;

typedef struct OmKernels {
    int lanes, width;  // right-hand sides, floats a vertex
    /// w = A u; sums: r.u of each lane, then u.w of each lane
    void (*multiply)(const OmBsr* A, const OmSolver* S, int begin, int end, double* sums);
    /// p = u + beta p, s = w + beta s, x += alpha p, r -= alpha s, and optionally u = dinv r; rr: r.r
    void (*update)(OmSolver* S, const float* alpha, const float* beta, bool apply_blocks, int begin,
                   int end, double* rr);
    /// u = dinv r
    void (*apply_blocks)(const float* dinv, const float* r, float* u, int begin, int end);
    /// rd = b - A xd at free degrees of freedom, zero at prescribed ones. Null A: rd = b. rr: rd.rd
    void (*residual)(OmSolver* S, const OmBsr* A, const double* b, int nrhs, int chunk, double* rr);
    void (*smooth)(const OmBsr* A, const float* dinv, const OmSmooth* s, int begin, int end);
    /// The first step from x = 0: d_out = x = c2 dinv r.
    void (*smooth_first)(const float* dinv, const OmSmooth* s, int begin, int end);
    /// b of coarse nodes = P^T r
    void (*restrict_rows)(const OmInterp* P, const float* r, float* b, int begin, int end);
    /// d = P x_coarse, x += d
    void (*prolong_rows)(const OmInterp* P, const float* xc, float* d, float* x, int begin,
                         int end);
    /// x = A^-1 b on the coarsest level
    void (*dense_solve)(OmDense* dense, const float* b, float* x);
} OmKernels;
extern const OmKernels om__kernels_one, om__kernels_eight;

/// Clear the prescribed entries of rows of one chunk of rd.
void om__clear_fixed(OmSolver* S, int lanes, int chunk);

/// Inverse of a symmetric block restricted to its free part; zero elsewhere. False unless positive definite.
bool om__invert_block(const float* v, const unsigned char* fixed, float* out);

// ---- solve_multigrid.c ------------------------------------------------------------------------------

/// width: floats a vertex of the vectors; bound: OmSolverDef.row_bound.
OmStatus om__multigrid_create(const OmBsr* A, const double* x_rest, int nworker, int width,
                              double bound, OmMultigrid** mg, size_t* memory);
void om__multigrid_destroy(OmMultigrid* mg);
void om__multigrid_set_fixed(OmMultigrid* mg, const unsigned char* fixed);
/// @return OM_OK; OM_NO_MEMORY, OM_INVALID (ties)
OmStatus om__multigrid_refresh(OmMultigrid* mg, const OmBsr* A, int nworker);
/// S->u = M^-1 S->r by one V-cycle, called by every member of a team with its rows of level 0. Rows of
/// other members may be unfinished at return.
void om__multigrid_apply(const OmKernels* K, const OmSolver* S, const OmBsr* A, OmRank* who);

// ---- solve_tie.c ------------------------------------------------------------------------------------

/// As om_ties_sum, with an upper bound of the eigenvalues of D^-1 A for the smoother's D.
OmStatus om__ties_sum(OmTies* ties, double bound);
/// The ties of the next level: P^T T P. They are not summed.
OmStatus om__ties_coarsen(const OmTies* fine, const OmInterp* P, OmTies* coarse);
/// What the ties add in rows [begin, end) to OmKernels.multiply, smooth and residual, called after these.
void om__ties_multiply(const OmTies* ties, const OmKernels* K, const OmSolver* S, int begin,
                       int end, double* sums);
void om__ties_smooth(const OmTies* ties, const OmKernels* K, const float* dinv, const OmSmooth* s,
                     int begin, int end);
void om__ties_residual(const OmTies* ties, OmSolver* S, int lanes, int chunk, double* rr);
/// y += T x in rows [begin, end).
void om__ties_add_rows(const OmTies* ties, const double* x, double* y, int begin, int end);
/// Diagonal block of row i for the smoother, by columns; null: none.
const float* om__ties_diagonal(const OmTies* ties, int i);
/// dense += T, (n x n) by rows.
void om__ties_add_dense(const OmTies* ties, int n, double* dense);

// ---- solve_cg.c -------------------------------------------------------------------------------------

/// Sum of column c of the chunks' partial results, always in the same order.
static inline double om__total(const OmSolver* S, int c) {
    double sum = 0;
    const double* partial = S->partial + c * S->chunks.num;
    for (int k = 0; k < S->chunks.num; ++k) sum += partial[k];
    return sum;
}
static inline void om__put_partial(OmSolver* S, int column, int chunk, const double* value,
                                   int num) {
    for (int c = 0; c < num; ++c) S->partial[(column + c) * S->chunks.num + chunk] = value[c];
}

typedef enum OmCgEnd { OM_CG_DONE, OM_CG_INDEFINITE, OM_CG_NOT_FINITE, OM_CG_STOPPED } OmCgEnd;

/// Solve for nrhs <= S->max_lane right-hand sides together.
OmStatus om__cg_solve(OmSolver* S, const OmBsr* A, int nrhs, const double* b, double* x,
                      OmSolveInfo* info);

// ---- solve_double.c ---------------------------------------------------------------------------------

typedef struct OmLane {           // one right-hand side of several, and the chunks of a member
    int index, num;               // of the lanes of xd and rd
    int first_chunk, last_chunk;  // [first, last)
} OmLane;

/// CG in double with block Jacobi from xd and its residual rd, called by every member of a team, until |r| <= goal
/// or max_iterations are done. Then xd is the iterate with the smallest residual, the first one included; rd is
/// undefined. Overwrites the float vectors.
OmCgEnd om__cg_double(OmSolver* S, const OmBsr* A, const OmRank* who, const OmLane* lane,
                      double goal, int max_iterations, int* iterations);

// ---- solve_cholmod.c --------------------------------------------------------------------------------

OmStatus om__cholesky_create(const OmBsr* A, bool is_single, OmCholesky** chol);
/// The factor of a matrix of numbers, of which the upper triangle is read. It uses one thread always. OM_NOT_SPD: null.
OmStatus om__cholesky_create_csr(const OmCsr* A, OmCholesky** chol);
/// Negative eigenvalues of a matrix of numbers: the negative pivots of L D L^T, without exchanges of rows.
/// @return OM_OK; OM_NOT_SPD (a pivot is 0: nothing is known); OM_NO_MEMORY
OmStatus om__count_negative(const OmCsr* A, int* num);
void om__cholesky_destroy(OmCholesky* chol);
OmStatus om__cholesky_refresh(OmCholesky* chol, const OmBsr* A, const unsigned char* fixed);
/// b: nrhs columns of 3 nvert, or of n for a matrix of numbers, overwritten with the solution.
OmStatus om__cholesky_solve(OmCholesky* chol, int nrhs, double* b);

/// An order of the rows in which a factor of the symmetric pattern fills little; order[new] = old (3 nvert).
OmStatus om__find_order(const OmBsr* A, int* order);

// ---- solve_rows.c -----------------------------------------------------------------------------------

/// Blocks of row i left of the diagonal one.
int om__row_count_lower(const OmBsr* A, int i);
/// Block m of row i in ascending order of columns; nlower: of om__row_count_lower.
int om__row_block(const OmBsr* A, int i, int m, int nlower);
/// The numbers of A by rows with ascending columns (9 nblock); prescribed degrees of freedom are of the identity.
/// @return OM_OK; OM_INVALID (a value is not finite)
OmStatus om__rows_write(const OmBsr* A, const unsigned char* fixed, double* out);

// ---- solve_umfpack.c, or solve_superlu.c ------------------------------------------------------------

OmStatus om__lu_create(const OmBsr* A, OmLu** lu);
void om__lu_destroy(OmLu* lu);
/// OM_NOT_SPD: singular.
OmStatus om__lu_refresh(OmLu* lu, const OmBsr* A, const unsigned char* fixed);
/// b: nrhs columns of 3 nvert, overwritten with the solution.
OmStatus om__lu_solve(OmLu* lu, int nrhs, double* b);
/// 1 or -1: the sign of the determinant.
int om__lu_sign(const OmLu* lu);

#endif
