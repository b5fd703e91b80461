/// omentum/shape_skin.h: a smooth surface that rides on a coarse one (room `shape`, floor 1).
///
/// The coarse surface is the boundary of a body's mesh, and its vertices move. The smooth one is known at rest, as the
/// zero level of a distance field, or as points: an organ as the CT shows it. A skin maps places at rest to places now,
/// and back. Near the coarse surface it carries each place by the rotation and stretch of the triangles around it,
/// without stretch along their normals:
///
///     x = c + F (X - C),    F = sum bary F_vertex
///
/// with C, c a point of the coarse surface at rest and now, F_vertex the mean of the triangles around the vertex. So
/// the map is continuous along the surface, and exact where the body moves rigidly.
///
///     om_skin_create(&boundary, &skin);
///     om_skin_move(skin, x);                                      // in each step
///     if (om_skin_find(skin, p, 0.01, &q))  d = om_skin_eval(&q, &sdf, ring, &n);
///     om_skin_destroy(skin);
#ifndef OMENTUM_SHAPE_SKIN_H
#define OMENTUM_SHAPE_SKIN_H

#include "omentum/shape_closest.h"
#include "omentum/shape_sdf.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmSkin OmSkin;

typedef struct OmSkinPlace {  // a place near the coarse surface
    OmSurfacePoint on;        // the nearest point of the coarse surface
    OmVec3 rest;              // the place at rest, m
    OmMat3 F;  // how the skin is turned and stretched there; of om_skin_bind the identity
} OmSkinPlace;

/// @param rest  the coarse surface at rest, copied; closed or not, without flat triangles
/// @return OM_OK; OM_INVALID (no triangles, a flat triangle, an index out of range, not finite); OM_NO_MEMORY
OM_API OmStatus om_skin_create(const OmSurface* rest, OmSkin** skin);
OM_API void om_skin_destroy(OmSkin* skin);
/// New positions of the vertices, in O(n). No query may run meanwhile.
/// @param x  m, finite (nvert x 3)
OM_API void om_skin_move(OmSkin* skin, const double* x);
/// The place of a point that is near the moved coarse surface.
/// @return false: the surface is farther than max_distance, or it is flattened there
OM_API bool om_skin_find(const OmSkin* skin, OmVec3 p, double max_distance, OmSkinPlace* place);
/// Bind a point that is known at rest: om_skin_put then says where it is. To be called before the first
/// om_skin_move, or after one to the rest positions.
OM_API void om_skin_bind(const OmSkin* skin, OmVec3 rest, OmSkinPlace* place);
/// Where a bound point is now.
/// @param turn  out: F, which turns vectors along the surface; a normal turns by its inverse transposed, normalised.
///              May be null
OM_API OmVec3 om_skin_put(const OmSkin* skin, const OmSkinPlace* bound, OmMat3* turn);
/// Distance of a found place from the zero level of a field at rest, which the skin carries, and the unit normal now.
/// The field's gradient is a difference over `ring` on both sides: that of a sampled field jumps from cell to cell.
/// @param ring  m, above 0
/// @return m; 0, with the normal (0, 0, 1), where the field has no gradient
OM_API double om_skin_eval(const OmSkinPlace* place, const OmSdf* sdf, double ring, OmVec3* normal);

#ifdef __cplusplus
}
#endif
#endif
