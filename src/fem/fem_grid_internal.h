// fem_grid_internal.h: functions that the files of the grid solver share.
//
// Forces are divided by mu V / 8, with V the volume of a cell: a force is the sum of P grad N over the eight Gauss
// points. An array of deformation gradients has nine entries by rows, each for the eight points of an element.
#ifndef OMENTUM_FEM_GRID_INTERNAL_H
#define OMENTUM_FEM_GRID_INTERNAL_H

#include "omentum/fem_grid.h"

#define GRID_POINT 8             // Gauss points of an element
#define GRID_F (9 * GRID_POINT)  // floats of the deformation gradients of an element
#define GRID_MIN_VOLUME 0.05f    // below this det F the volume energy is continued as a parabola

// A linear system must be solved: a matrix that is not positive definite, or too large a residual, is an error.
static inline OmStatus om__grid_solved(OmStatus status) {
    return status > 0 ? om_error_prefix(OM_INVALID, "grid") : status;
}

// ---- fem_grid.c ---------------------------------------------------------------------------------------

// Position of each node of an element in its cell, 0 or 1 along the axes.
extern const int om__grid_corner[8][3];
// The six tetrahedra of an element around the diagonal from node 0 to node 6. They are the same in all cells, so faces
// of neighbours are cut along the same diagonal.
extern const int om__grid_tet[6][4];

// ---- fem_grid_element.c: the neo-Hookean law on the cells of a grid ------------------------------------

typedef struct GridElements {      // constant
    const OmFemGrid* grid;         // borrowed
    float lambda;                  // over mu
    float grad[8][3][GRID_POINT];  // gradients of the shape functions of the corners, 1/m
    float square[8][GRID_POINT];   // their squared norms
    int* use_adr;                  // elements that use a node                      (nnode + 1)
    int* use;                      // element * 8 + corner                          (8 nelem)
    int* color_adr;                // free nodes by color: nodes of a color share no element (9)
    int* color_node;
} GridElements;

OmStatus om__grid_check_poisson(double poisson);
OmStatus om__grid_elements_init(const OmFemGrid* grid, double poisson, GridElements* elements);
void om__grid_elements_done(GridElements* elements);
// Stiffness of an element at rest. (24 x 24)
void om__grid_rest_stiffness(const GridElements* elements, double* K);

// The functions below work on elements, or nodes, begin .. end - 1.

// F = start I + grad u. F: (nelem x GRID_F)
void om__grid_gradients(const GridElements* elements, const float* u, float start, float* F,
                        int begin, int end);
// Forces of the elements at their corners. (nelem x 24)
void om__grid_element_forces(const GridElements* elements, const float* F, float* force, int begin,
                             int end);
// Residual of each node: minus the sum of its elements' forces; 0 at fixed and masked nodes. (nnode x 3)
void om__grid_node_forces(const GridElements* elements, const unsigned char* mask,
                          const float* force, float* residual, int begin, int end);

// A direction E = scale[0] D + scale[1] S in the space of deformation gradients, with S = F - before.
typedef struct GridDirection {
    float *F, *before;  //                                                     (nelem x GRID_F)
    const float* D;
    float scale[2];
} GridDirection;

// Second variations of the energy by D and S: DD, DS, SS.
void om__grid_curvature(const GridDirection* direction, float lambda, int begin, int end,
                        double sum[3]);
// At F + length E: the derivative of the energy by `length`.
// @param keep      smallest allowed ratio of the new det F to the old one, where the old one is positive
// @param is_valid  whether every ratio is at least `keep`
double om__grid_slope(const GridDirection* direction, float lambda, float length, float keep,
                      int begin, int end, bool* is_valid);
// F += length E, before = F.
void om__grid_advance(const GridDirection* direction, float length, int begin, int end);
// The smallest det F.
float om__grid_min_volume(const float* F, int begin, int end);
// Mark the elements whose root mean square of |F - I| is above the limit.
void om__grid_find_strained(const float* F, float limit, unsigned char* is_strained, int begin,
                            int end);
// Mark the nodes that relaxation skips: masked nodes, and nodes without a strained element.
void om__grid_find_skipped(const GridElements* elements, const unsigned char* mask,
                           const unsigned char* is_strained, unsigned char* is_skipped, int begin,
                           int end);
// One Newton step of each of the nodes color_node[begin .. end - 1] in this order, without the skipped nodes; updates u
// and F.
void om__grid_relax(const GridElements* elements, const unsigned char* is_skipped, float* F,
                    float* u, int begin, int end);

// Derivatives of the energy by the position of one node: gradient, and second derivative (xx, yy, zz, xy, xz, yz).
void om__grid_node_eval(const GridElements* elements, int node, const float* F, float gradient[3],
                        float H[6]);
// step = -H^-1 gradient.
// @return the largest fraction of the step, up to 1, after which every positive det F keeps a fifth of its value
float om__grid_node_step(const GridElements* elements, int node, const float* F,
                         const float gradient[3], const float H[6], float step[3]);
// u += step at the node; updates F.
void om__grid_node_move(const GridElements* elements, int node, const float step[3], float* F,
                        float* u);

// ---- fem_grid_linear.c --------------------------------------------------------------------------------

// Scales of the patch's columns for which its nodes get the displacements u (nnode x 3). scale: (patch->num)
void om__grid_patch_solve(const OmFemGridPatch* patch, const float* u, double* scale);
// out += sign * sum of scale[k] column[k], for the unknowns begin .. end - 1.
void om__grid_patch_add(const OmFemGridPatch* patch, const double* scale, double sign, float* out,
                        int begin, int end);

// ---- fem_grid_coarse.c --------------------------------------------------------------------------------

typedef struct GridCoarse GridCoarse;  // constant

OmStatus om__grid_coarse_create(const GridElements* elements, int nworker, GridCoarse** coarse);
void om__grid_coarse_destroy(GridCoarse* coarse);
int om__grid_coarse_size(const GridCoarse* coarse);  // nodes
// The three steps of z = P A^-1 P^T r: restriction to the coarse grid, product with the inverse, interpolation.
// sum, answer: (size x 3); r, z: (nnode x 3)
void om__grid_coarse_restrict(const GridCoarse* coarse, const float* r, float* sum, int begin,
                              int end);
void om__grid_coarse_multiply(const GridCoarse* coarse, const float* sum, float* answer, int begin,
                              int end);
void om__grid_coarse_prolong(const GridCoarse* coarse, const float* answer, float* z, int begin,
                             int end);

#endif
