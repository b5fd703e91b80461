// umesh_refine_internal.h: what the files of the refinement share.
//
// Forces are over mu V / 8, V the volume of a cell: sums over the eight Gauss points of P grad N. All arrays of a
// deformation gradient have its nine entries by rows, each for the eight points of an element.
#ifndef OMENTUM_UMESH_REFINE_INTERNAL_H
#define OMENTUM_UMESH_REFINE_INTERNAL_H

#include "umesh/umesh_net_internal.h"

#define REFINE_POINT 8               // Gauss points of an element
#define REFINE_F (9 * REFINE_POINT)  // floats of its deformation gradients
#define REFINE_LEAST 0.05f           // below this det F the energy goes on as a parabola

// ---- umesh_element.c: the neo-Hookean law on the cells of a grid --------------------------------------

typedef struct UmeshElements {       // constant
    const OmUmeshGrid* grid;         // borrowed
    float lambda;                    // over mu
    float grad[8][3][REFINE_POINT];  // of the shape functions of the corners, 1/m
    float square[8][REFINE_POINT];   // of their norms
    int* use_adr;                    // elements that use a node                      (nnode + 1)
    int* use;                        // element * 8 + corner                      (8 nelem)
    int* color_adr;                  // free nodes by color: two of one share no element     (9)
    int* color_node;
} UmeshElements;

OmStatus om__umesh_elements_init(const OmUmeshGrid* grid, double poisson, UmeshElements* elements);
void om__umesh_elements_done(UmeshElements* elements);
// Stiffness of an element at rest. (24 x 24)
void om__umesh_rest_stiffness(const UmeshElements* elements, double* K);

// All that follow are for elements, or nodes, begin .. end - 1.

// F += the gradient of u, begun from `start` on the diagonal. F: (nelem x REFINE_F)
void om__umesh_gradients(const UmeshElements* elements, const float* u, float start, float* F,
                         int begin, int end);
// Forces of elements on their corners. (nelem x 24)
void om__umesh_element_forces(const UmeshElements* elements, const float* F, float* force,
                              int begin, int end);
// What drives nodes, by all of their elements; 0 where they are held or masked. (nnode x 3)
void om__umesh_node_forces(const UmeshElements* elements, const unsigned char* mask,
                           const float* force, float* drive, int begin, int end);
// Where to go from F: E = share[0] D + share[1] S, S = F - before.
typedef struct UmeshWay {
    float *F, *before;  //                                                   (nelem x REFINE_F)
    const float* D;
    float share[2];
} UmeshWay;

// Second variations of the energy by D and S: DD, DS, SS.
void om__umesh_curvature(const UmeshWay* way, float lambda, int begin, int end, double sum[3]);
// At F + length E: the slope of the energy by `length`, and whether no det F that is positive falls below `keep` of
// itself.
double om__umesh_slope(const UmeshWay* way, float lambda, float length, float keep, int begin,
                       int end, bool* is_open);
// F += length E, before = F.
void om__umesh_advance(const UmeshWay* way, float length, int begin, int end);
// The least det F.
float om__umesh_least_volume(const float* F, int begin, int end);
// Elements where the root mean square of |F - I| is above the limit.
void om__umesh_find_strained(const float* F, float limit, unsigned char* is_strained, int begin,
                             int end);
// Nodes that are masked, or of no strained element.
void om__umesh_find_still(const UmeshElements* elements, const unsigned char* mask,
                          const unsigned char* is_strained, unsigned char* is_still, int begin,
                          int end);
// One Newton step of each of the nodes color_node[begin .. end - 1], one after the other, but for those
// that are still; u and F with it.
void om__umesh_relax(const UmeshElements* elements, const unsigned char* is_still, float* F,
                     float* u, int begin, int end);

// Derivatives of the energy by the place of one node: the gradient, and the matrix (xx, yy, zz, xy, xz, yz).
void om__umesh_node_look(const UmeshElements* elements, int node, const float* F, float gradient[3],
                         float H[6]);
// step = -H^-1 gradient. @return the share of it that leaves every positive det F a fifth of itself
float om__umesh_node_step(const UmeshElements* elements, int node, const float* F,
                          const float gradient[3], const float H[6], float step[3]);
void om__umesh_node_move(const UmeshElements* elements, int node, const float step[3], float* F,
                         float* u);

// ---- umesh_coarse.c -----------------------------------------------------------------------------------

OmStatus om__umesh_coarse_create(const UmeshElements* elements, int nworker, UmeshCoarse** coarse);
void om__umesh_coarse_destroy(UmeshCoarse* coarse);
int om__umesh_coarse_size(const UmeshCoarse* coarse);  // nodes
// The three steps of z = P A^-1 P^T r: what nodes of the coarse grid gather, their answer, and what nodes get.
// sum, answer: (size x 3); r, z: (nnode x 3)
void om__umesh_coarse_restrict(const UmeshCoarse* coarse, const float* r, float* sum, int begin,
                               int end);
void om__umesh_coarse_multiply(const UmeshCoarse* coarse, const float* sum, float* answer,
                               int begin, int end);
void om__umesh_coarse_prolong(const UmeshCoarse* coarse, const float* answer, float* z, int begin,
                              int end);

#endif
