/// omentum/shape_points.h: the nearest of many points (room `shape`, floor 1).
///
/// A k-d tree of a fixed set of points, built in O(n log n); a query takes about O(log n), from any number of threads.
/// Of equally near points a query returns the one with the smallest index.
///
///     om_point_tree_create(n, x, &tree);
///     int i = om_point_tree_find(tree, p, &distance);
///     om_point_tree_destroy(tree);
#ifndef OMENTUM_SHAPE_POINTS_H
#define OMENTUM_SHAPE_POINTS_H

#include "omentum/base.h"
#include "omentum/vec.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmPointTree OmPointTree;

/// @param x  (n x 3), m, copied
/// @return OM_OK; OM_INVALID (no points, or one that is not finite); OM_NO_MEMORY
OM_API OmStatus om_point_tree_create(int n, const double* x, OmPointTree** tree);
OM_API void om_point_tree_destroy(OmPointTree* tree);
/// Index of the point nearest to p, which must be finite.
/// @param distance  to it, m; may be null
OM_API int om_point_tree_find(const OmPointTree* tree, OmVec3 p, double* distance);
#define OM_MAX_NEAREST 64
/// Indices of the `num` points nearest to p, which must be finite; nearest first, equally near ones by index.
/// @param num    1 to OM_MAX_NEAREST
/// @param index  (num)
/// @return how many there are: num, or all points of a smaller tree
OM_API int om_point_tree_find_many(const OmPointTree* tree, OmVec3 p, int num, int* index);

/// Principal axes of some of the points, that of the smallest spread first: the normal of their plane.
/// @param point   their indices  (n)
/// @param mean    out, m
/// @param spread  out: sums of squares along the axes, m^2
OM_API OmMat3 om_points_axes(const double* x, int n, const int* point, OmVec3* mean,
                             OmVec3* spread);

#ifdef __cplusplus
}
#endif
#endif
