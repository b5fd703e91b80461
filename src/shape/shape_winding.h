// shape_winding.h: generalised winding numbers of triangles, and the solid that they bound.
#ifndef OM_SHAPE_WINDING_H
#define OM_SHAPE_WINDING_H

#include "omentum/math_grid.h"
#include "omentum/shape.h"

typedef struct OmWindingNode {
    double lo[3], hi[3];
    OmVec3 center, normal;  // weighted by area; sum of the area vectors
    double radius;          // about the centre
    int begin, end;         // of `order`
    int right;              // right child, -1: a leaf; the left child is the next node
} OmWindingNode;

typedef struct OmWinding {  // a tree of triangles; om__winding_done frees
    int ntri, nnode;
    int* order;           // triangle of the surface    (ntri)
    double* corner;       // in the order of the tree   (ntri x 9)
    OmWindingNode* node;  //                            (nnode)
} OmWinding;

// A tree over the triangles `list` of a surface (null: all of them).
OmStatus om__winding_init(const OmSurface* s, const int* list, int nlist, OmWinding* w);
void om__winding_done(OmWinding* w);
// Sum of the solid angles over 4 pi: exact near the triangles, by dipoles of groups farther away (Barill 2018).
double om__winding_at(const OmWinding* w, OmVec3 p);

// The set where the winding number is positive, measured along n x n rays in each of three directions.
typedef struct OmSolidMeasure {
    double volume;    // where the winding number is above 0
    double overlap;   // counted once for each unit above 1
    double negative;  // where it is below 0
    OmVec3 place;     // in the longest overlap along a ray, else in the longest negative piece
} OmSolidMeasure;
OmStatus om__surface_measure(const OmSurface* s, int n, OmSolidMeasure* out);

// What the rays along three axes say about a node of a grid: how many see it inside (two or three set
// OM__NODE_INSIDE), and whether one saw a winding number that is neither 0 nor 1.
enum { OM__NODE_VOTES = 3, OM__NODE_INSIDE = 2, OM__NODE_FOLDED = 4 };
// The part of the surface that separates winding numbers above 0 from others, in pieces of at most two grid steps.
// Pieces without a folded node around are taken whole, pieces within the solid are left out; the others are looked at.
OmStatus om__surface_visible(const OmSurface* s, const OmGrid* grid, const unsigned char* node,
                             OmSurface* visible);

// Twice the signed area of (a, b, p) in a plane. If a and b are exchanged only the sign changes, bit by
// bit, and it is never zero: a ray through a shared edge crosses exactly one of its triangles.
static inline double om__edge_side(const double* x, int a, int b, int u, int w, double pu,
                                   double pw) {
    const double sign = a > b ? -1 : 1;
    const double *xa = &x[3 * (size_t)(a > b ? b : a)], *xb = &x[3 * (size_t)(a > b ? a : b)];
    double s = (xb[u] - xa[u]) * (pw - xa[w]) - (xb[w] - xa[w]) * (pu - xa[u]);
    return sign * (s != 0 ? s : 1e-300);
}

#endif
