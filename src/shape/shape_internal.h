// shape_internal.h: shared by the files of room `shape`.
#ifndef OM_SHAPE_INTERNAL_H
#define OM_SHAPE_INTERNAL_H

#include "omentum/shape_meshing.h"

enum { OM__SDF_COOKIE = 0x5d0f1e1d, OM__STUFF_COOKIE = 0x57f0ff, OM__PATCH_COOKIE = 0x9a7c4 };

// The faces of a positive element, each counter-clockwise seen from outside; face f is opposite to corner
// om__face_opposite[f].
extern const int om__face_corner[4][3];
extern const int om__face_opposite[4];

// neighbor[4 e + f]: the element on the other side of face f of element e, -1 at the boundary.
// OM_INVALID if a face belongs to three elements.
OmStatus om__tet_neighbors(const OmTetMesh* mesh, int* neighbor);

// The triangle corners (3 t + c) at each vertex: corner[adr[v]] .. corner[adr[v + 1] - 1]. The caller frees
// both with om_free, also after a failure.
OmStatus om__surface_corners(const OmSurface* surface, int** adr, int** corner);

// The axis along which the points x[order[k]], k in [begin, end), extend farthest.
int om__points_longest_side(const double* x, const int* order, int begin, int end);
// Hoare's selection: reorder order[begin .. end) so that order[middle] has its rank along `axis`, points before it have
// no larger coordinate, points after it no smaller one.
void om__points_select(const double* x, int* order, int begin, int end, int middle, int axis);

// Dimensions and origin of the grid over [lo, hi] and the margin; values are not set.
OmStatus om__sdf_grid(const OmSdfDef* def, OmVec3 lo, OmVec3 hi, OmSdf* sdf);
// Fill the nodes of a grid from a function, in parallel. OM_CANCELLED: a request to stop.
OmStatus om__sdf_sample(OmSdf* sdf, OmShapeFn fn, void* ctx);
// Turn a function with the right zero level into a signed distance. If `volume` > 0 the level is
// shifted so that the surface encloses this volume.
OmStatus om__sdf_redistance(OmSdf* sdf, double volume);
// Unsigned distance to a surface, into sdf->d.
OmStatus om__sdf_unsigned(const OmSurface* surface, double exact, OmSdf* sdf);
OmStatus om__sdf_check_def(const OmSdfDef* def);

// rep[i]: the first point within `tolerance` > 0 of point i that represents others; i itself if there is none, or if
// use[i] is 0 (a null `use`: all are used). O(n): points that represent others are farther apart than the tolerance.
OmStatus om__points_cluster(const double* x, int n, const unsigned char* use, double tolerance,
                            int* rep);
// Merge vertices within `tolerance` and drop vertices that no triangle uses; triangles stay, also those without area.
OmStatus om__surface_merge(OmSurface* surface, double tolerance);

#endif
