// solve_multigrid.h: parts of the multigrid preconditioner.
//
//   level 0: the caller's matrix            solve_grid.c      interpolation from a background grid
//   level 1: P^T A P on a grid of 2h        solve_galerkin.c  its pattern once, its values every refresh
//   level 2: ... 4h                         solve_dense.c     the last level, dense
//   last:    at most DENSE_VERTS nodes      solve_multigrid.c the V-cycle
#ifndef OMENTUM_SOLVE_MULTIGRID_H
#define OMENTUM_SOLVE_MULTIGRID_H

#include "solve/solve_internal.h"

#define OM_MG_MAX_LEVEL 12

// P: each fine vertex takes the values of up to four coarse nodes. The weight of an entry is diagonal, one
// number a direction, zero where the fine degree of freedom is prescribed.
struct OmInterp {
    int nfine, ncoarse, nentry;
    int* adr;             // entries of each fine vertex                            (nfine + 1)
    int* col;             // coarse node of each entry                              (nentry)
    float* base;          // weight before prescribed directions are cleared        (nentry)
    float* weight;        // weight in x, y, z, and a zero                          (nentry x 4)
    unsigned char* mask;  // prescribed directions of each fine vertex, a bit each  (nfine)
    int* t_adr;           // entries of each coarse node                            (ncoarse + 1)
    int* t_row;           // their fine vertices, ascending                         (nentry)
    int* t_entry;         // their entries                                          (nentry)
    // layers of grid cells along the longest side: rows of layers two apart have no common node
    int nlayer;
    int* layer_adr;  //                                                       (nlayer + 1)
    int* layer_row;  // fine vertices by layer                                (nfine)
};

// Addresses of A P and P^T (A P). Row i of A P has ap_num[i] coarse columns.
typedef struct OmGalerkin {
    int* ap_num;     //                                                       (nfine)
    int max_ap;      // the largest of any row
    int* slot_adr;   // slots of each fine row                                (nfine + 1)
    uint16_t* slot;  // column of A P for each block of A and entry of P, in order
    int* pos_adr;    // positions of each fine row                            (nfine + 1)
    uint16_t* pos;   // for each entry of P and column of A P: block within the coarse row
    // one row of A P for each worker   (nworker x max_ap x 12)
    float* scratch;
} OmGalerkin;

struct OmDense {  // inverse of the Cholesky factor, by rows
    int n;
    double* factor;   // U of A = U^T U                                       (n x n)
    double* inverse;  // of U^T, lower triangle                               (n x n)
    float* apply;     // the same in float                                    (n x n)
    float* y;         // work                                                 (n x 2 x lanes)
};

typedef struct OmLevel {
    int nvert;
    OmBsr A;              // level 0: empty, the caller's is used
    float* dinv;          // inverse diagonal blocks; level 0: the solver's   (nvert x 9 + 3)
    float theta, c1, c2;  // Chebyshev: d = D^-1 r / theta, then d = c1 d + c2 D^-1 r
    float *b, *x;         // level 0: r and u of CG                           (nvert x width)
    float *r, *d, *e;     // residual, correction, next correction            (nvert x width)
    OmInterp P;           // from the next level
    OmGalerkin G;
    OmTies* ties;  // of a coarse level; null before the first matrix with ties
} OmLevel;

struct OmMultigrid {
    int nlevel;  // the last one is dense
    OmLevel level[OM_MG_MAX_LEVEL];
    OmDense dense;
    float* wide;  // coarse blocks while they are summed              (most coarse blocks x 12)
};

/// Interpolation of points x (n x 3) from a grid of cells about h wide; `node` gets the coarse positions.
OmStatus om__grid_interpolate(int n, const double* x, double h, OmInterp* P, double** node,
                              size_t* memory);
void om__interp_done(OmInterp* P);
/// Lanes 1 where a direction of the mask is free; the fourth is zero.
extern const float om__mask_lanes[8][4];
#define OM_MASK_NONE 0
#define OM_MASK_ALL 7
/// fixed: (nfine x 3) or null.
void om__interp_mask(OmInterp* P, const unsigned char* fixed);

OmStatus om__galerkin_create(const OmBsr* A, const OmInterp* P, int nworker, OmGalerkin* G,
                             OmBsr* coarse, size_t* memory);
void om__galerkin_done(OmGalerkin* G);
/// Add P^T A P of the fine rows of one layer to `wide`: coarse blocks padded to 12 floats.
void om__galerkin_layer(const OmBsr* A, const OmInterp* P, const OmGalerkin* G, int layer,
                        float* scratch, const OmBsr* coarse, float* wide);
/// Blocks [begin, end) of wide to the values of the coarse matrix.
void om__galerkin_pack(const float* wide, OmBsr* coarse, int begin, int end);

OmStatus om__dense_create(int n, int lanes, OmDense* dense, size_t* memory);
void om__dense_done(OmDense* dense);
/// Factor a block matrix; directions without stiffness are left out.
void om__dense_refresh(OmDense* dense, const OmBsr* A);

#endif
