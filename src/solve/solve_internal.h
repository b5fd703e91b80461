// solve_internal.h: what the files of the room share.
//
// Vectors of the iterative solvers hold four floats a vertex, the fourth zero, so that a vertex is one
// 16-byte load. Rows are cut into chunks that depend on the matrix alone; a worker takes a run of chunks,
// and sums are added chunk by chunk: same bytes for any number of workers.
#ifndef OMENTUM_SOLVE_INTERNAL_H
#define OMENTUM_SOLVE_INTERNAL_H

#include "base/base_multiversion.h"
#include "omentum/solve.h"

typedef struct OmCholesky OmCholesky;    // solve_cholmod.c
typedef struct OmMultigrid OmMultigrid;  // solve_multigrid.c

typedef struct OmRank {  // a member of a team and its rows of the matrix
    OmTeam* team;
    int rank, size;
    int begin, end;
} OmRank;

typedef struct OmChunks {  // rows cut into pieces of about equal work
    int num;
    int* begin;  // first row of each                                              (num + 1)
} OmChunks;

struct OmSolver {
    OmSolverDef def;
    int nvert, nblock;
    bool is_ready;  // refreshed, and positive definite
    OmChunks chunks;
    unsigned char* fixed;  // prescribed degrees of freedom                         (nvert x 3)
    int nfixed_vert;       // vertices with one or more of them
    int* fixed_vert;       // ascending                                             (nvert)
    int* chunk_fixed;      // first of fixed_vert in each chunk                     (num + 1)
    float* free_mask;      // 1 where free, of fixed_vert                           (nvert x 4)
    float* dinv;           // inverses of diagonal blocks, zero where prescribed    (nvert x 9 + 3)
    double* xd;            // the iterate                                           (nvert x 3)
    double* rd;            // its residual                                          (nvert x 3)
    double* partial;       // sums of the chunks, one column a quantity             (3 x num)
    float *x, *r, *u, *w, *p, *s;  // CG vectors                                    (nvert x 4)
    OmCholesky* cholesky;
    OmMultigrid* multigrid;
    size_t memory;  // bytes
};

// ---- solve_kernel.c: loops over rows [begin, end) ---------------------------------------------------

typedef struct OmCgSums {
    double ru, uw;  // r.u and u.w
} OmCgSums;
/// w = A u
OmCgSums om__cg_multiply(const OmBsr* A, const float* r, const float* u, float* w, int begin,
                         int end);
/// p = u + beta p, s = w + beta s, x += alpha p, r -= alpha s, and then u = dinv r if asked; returns r.r
double om__cg_update(OmSolver* S, float alpha, float beta, bool apply_blocks, int begin, int end);
/// u = dinv r
void om__apply_blocks(const float* dinv, const float* r, float* u, int begin, int end);
/// rd = b - A xd at free degrees of freedom, zero at prescribed ones; returns rd.rd. Null A: rd = b.
double om__residual(OmSolver* S, const OmBsr* A, const double* b, int begin, int end, int chunk);

/// One smoothing step: r_out = r - A d, d_out = c1 d + c2 dinv r_out, x += d_out. d_out may be null: then
/// only the residual. r may be r_out; d may not be d_out.
typedef struct OmSmooth {
    const float* r;
    float* r_out;
    const float* d;
    float *d_out, *x;
    float c1, c2;
} OmSmooth;
void om__smooth(const OmBsr* A, const float* dinv, const OmSmooth* s, int begin, int end);
/// The first step from x = 0: d_out = x = c2 dinv r.
void om__smooth_first(const float* dinv, const OmSmooth* s, int begin, int end);

/// Inverse of a symmetric block restricted to its free part; zero elsewhere. False unless positive definite.
bool om__invert_block(const float* v, const unsigned char* fixed, float* out);

// ---- solve_multigrid.c ------------------------------------------------------------------------------

OmStatus om__multigrid_create(const OmBsr* A, const double* x_rest, int nworker, OmMultigrid** mg,
                              size_t* memory);
void om__multigrid_destroy(OmMultigrid* mg);
void om__multigrid_set_fixed(OmMultigrid* mg, const unsigned char* fixed);
void om__multigrid_refresh(OmMultigrid* mg, const OmBsr* A, int nworker);
/// S->u = M^-1 S->r by one V-cycle, called by every member of a team with its rows of level 0. The rows of
/// others may be unfinished at return.
void om__multigrid_apply(const OmSolver* S, const OmBsr* A, const OmRank* who);

// ---- solve_cg.c -------------------------------------------------------------------------------------

OmStatus om__cg_solve(OmSolver* S, const OmBsr* A, const double* b, double* x, OmSolveInfo* info);

// ---- solve_cholmod.c --------------------------------------------------------------------------------

OmStatus om__cholesky_create(const OmBsr* A, OmCholesky** chol);
void om__cholesky_destroy(OmCholesky* chol);
OmStatus om__cholesky_refresh(OmCholesky* chol, const OmBsr* A, const unsigned char* fixed);
/// b: nrhs columns of 3 nvert, overwritten with the solution.
OmStatus om__cholesky_solve(OmCholesky* chol, int nrhs, double* b);

#endif
