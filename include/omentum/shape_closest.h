/// omentum/shape_closest.h: the nearest point on a surface of triangles (room `shape`, floor 1).
///
/// A tree of boxes around the triangles, built in O(n log n); a query takes about O(log n), from any number of threads.
/// Of equally near triangles a query returns the one with the smallest index.
///
///     om_surface_tree_create(&surface, &tree);
///     OmSurfacePoint q;
///     if (om_surface_tree_find(tree, p, NULL, INFINITY, &q)) ... q.tri, q.bary, q.x, q.distance ...
///     om_surface_tree_move(tree, x);  // moved vertices, the same triangles
///     om_surface_tree_destroy(tree);
#ifndef OMENTUM_SHAPE_CLOSEST_H
#define OMENTUM_SHAPE_CLOSEST_H

#include "omentum/shape.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The point of triangle abc nearest to p. A triangle may be flat.
/// @param bary  weights of a, b and c, each in [0, 1], with sum 1; may be null
OM_API OmVec3 om_triangle_closest(OmVec3 p, OmVec3 a, OmVec3 b, OmVec3 c, double bary[3]);

typedef struct OmSurfacePoint {  // a point on a surface
    int tri;                     // its triangle
    double bary[3];              // weights of the triangle's vertices
    OmVec3 x;                    // m
    double distance;             // from the point of the query, m
} OmSurfacePoint;

typedef struct OmSurfaceTree OmSurfaceTree;

/// @param surface  copied
/// @return OM_OK; OM_INVALID (no triangles, an index out of range, or a vertex that is not finite); OM_NO_MEMORY
OM_API OmStatus om_surface_tree_create(const OmSurface* surface, OmSurfaceTree** tree);
OM_API void om_surface_tree_destroy(OmSurfaceTree* tree);
/// New positions of the vertices. Boxes are refitted in O(n), so that queries stay right; they become slower if
/// triangles that were neighbours move apart. No query may run meanwhile.
/// @param x  of all vertices, m, finite                              (nvert x 3)
OM_API void om_surface_tree_move(OmSurfaceTree* tree, const double* x);
/// The nearest point on the triangles in use.
/// @param p         finite
/// @param use       nonzero for the triangles that may be found (ntri); null: all
/// @param max_distance  m; INFINITY: no limit
/// @param q         null if only the answer matters; unchanged if there is no such point
/// @return whether there is such a point within max_distance
OM_API bool om_surface_tree_find(const OmSurfaceTree* tree, OmVec3 p, const unsigned char* use,
                                 double max_distance, OmSurfacePoint* q);
/// As om_surface_tree_find, among triangles whose outward normal has a cosine above `min_cosine` with `normal`: on a
/// thin sheet the nearest triangle may be one of the other side. A flat triangle has no normal and is left out.
/// @param normal  unit
/// @return whether there is such a point within max_distance
OM_API bool om_surface_tree_find_facing(const OmSurfaceTree* tree, OmVec3 p, OmVec3 normal,
                                        double min_cosine, const unsigned char* use,
                                        double max_distance, OmSurfacePoint* q);

#ifdef __cplusplus
}
#endif
#endif
