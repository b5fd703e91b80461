/// omentum/shape_sdf.h: solids as voxels and as signed distance fields (room `shape`, floor 1).
///
/// A mask is a segmentation: one byte a voxel on a grid that may be oblique, anisotropic or left-handed.
/// A distance field lives on an axis-aligned grid of cubic cells in RAS metres, negative inside, so that
/// the same organ in space gives the same field whatever header its voxels came with.
///
///     om_mask_keep_parts(&mask, 6, 0, &nkept, &nfound);   // largest part
///     om_mask_fill_holes(&mask);
///     OmSdfDef def = om_sdf_default_def(0.0015);
///     om_sdf_from_mask(&mask, &def, &sdf);
///     double d = om_sdf_eval(&sdf, p, &normal);
#ifndef OMENTUM_SHAPE_SDF_H
#define OMENTUM_SHAPE_SDF_H

#include "omentum/math_grid.h"
#include "omentum/shape.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- masks ------------------------------------------------------------------------------------------

typedef struct OmMask {     // om_mask_done frees
    OmVoxelGrid grid;       // in RAS metres
    unsigned char* inside;  // 0 or 1 for each voxel
} OmMask;

/// All voxels outside, unit axes, origin 0.
/// @return OM_OK; OM_INVALID (a size below 1, or too large); OM_NO_MEMORY
OM_API OmStatus om_mask_init(OmMask* mask, int nx, int ny, int nz);
OM_API void om_mask_done(OmMask* mask);
OM_API int64_t om_mask_count(const OmMask* mask);
/// Volume of the inside voxels, m^3.
OM_API double om_mask_volume(const OmMask* mask);
/// Crop the grid to the inside voxels plus `pad` >= 0 layers of outside voxels on each side. Layers beyond the old
/// border are added; they close an organ that is cut by the border of the volume.
/// @return OM_OK; OM_INVALID (an empty mask); OM_NO_MEMORY, the mask is as before
OM_API OmStatus om_mask_crop(OmMask* mask, int pad);
/// Keep the largest connected part (`min_share` = 0), or all parts of at least `min_share` of the inside
/// voxels; connectivity is 6 or 26. The counts may be null.
/// @return OM_OK; OM_INVALID (connectivity is neither 6 nor 26); OM_NO_MEMORY
OM_API OmStatus om_mask_keep_parts(OmMask* mask, int connectivity, double min_share, int* nkept,
                                   int* nfound);
/// Voxels of the connected parts, the largest first, equal ones in the order of their first voxels.
/// @param size  receives the first `max` of them                    (max)
/// @return OM_OK, OM_NO_MEMORY, OM_INVALID: connectivity is neither 6 nor 26
OM_API OmStatus om_mask_list_parts(const OmMask* mask, int connectivity, int64_t* size, int max,
                                   int* nfound);
/// Keep the parts at these places of that order, counted from 1.
/// @return OM_OK, OM_NO_MEMORY, OM_INVALID: there is no such part, or connectivity is neither 6 nor 26
OM_API OmStatus om_mask_choose_parts(OmMask* mask, int connectivity, const int* rank, int nrank);
/// Fill cavities: outside voxels that are not connected over faces to the border of the grid become inside.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_mask_fill_holes(OmMask* mask);
/// Morphological closing by a ball of `radius` m, in space rather than in voxels. The grid needs outside layers of this
/// width around the inside (om_mask_crop).
/// @return OM_OK; OM_INVALID (a radius out of range); OM_NO_MEMORY
OM_API OmStatus om_mask_close(OmMask* mask, double radius);

// ---- signed distance fields ---------------------------------------------------------------------------

typedef struct OmSdf {  // om_sdf_done frees
    OmGrid grid;        // of the nodes
    float* d;           // signed distance at each node, m, negative inside
} OmSdf;

typedef struct OmSdfDef {
    OmCookie cookie;
    double spacing;  // grid step, m, > 0; no default
    double margin;   // the grid reaches this far beyond the surface, m, >= 0; default 3 spacings
    double smooth;   // masks: width of the Gaussian, voxels, 0.5-3; default 1.2
    int iterations;  // masks: rounds of volume correction, 0-100; default 8
    // Of functions: keep their values, do not measure distances; for a contour. Default
    // false.
    bool is_raw;
    int64_t max_node;  // larger grids are refused; default 2e8
    // Of surfaces: longer distances may be too long by a fraction of a step, m, >= 0; default INFINITY.
    double exact;
    // Of surfaces: the nodes to sample, which enclose the surface; spacing and margin are not used. A
    // surface too thin to enclose a node is then no error. Borrowed; default null.
    const OmGrid* grid;
} OmSdfDef;

OM_API OmSdfDef om_sdf_default_def(double spacing);
OM_API void om_sdf_done(OmSdf* sdf);

/// Negative inside; need not be a distance.
typedef double (*OmShapeFn)(void* ctx, OmVec3 p);

/// A smooth function of a mask, negative inside, in about the distance from its surface near it, m.
typedef struct OmMaskField OmMaskField;

/// The mask is smoothed such that each neighbourhood keeps its volume. With `spacing` below two voxels the function has
/// the sign of the mask at the centre of each voxel: parts, gaps, handles and holes one voxel wide are kept, and voxels
/// are connected over faces.
/// @param spacing     m: what is finer may be averaged; 0: nothing
/// @param smooth      width of the Gaussian, voxels, 0.5 to 3
/// @param iterations  rounds of volume correction, 0 to 100
/// @return OM_OK; OM_INVALID (an empty mask, or the message names the argument); OM_NO_MEMORY
OM_API OmStatus om_mask_field_create(const OmMask* mask, double spacing, double smooth,
                                     int iterations, OmMaskField** field);
OM_API void om_mask_field_destroy(OmMaskField* field);
/// An OmShapeFn; ctx is a const OmMaskField*.
OM_API double om_mask_field_eval(void* field, OmVec3 p);
/// A box that holds its zero level.
/// @return OM_OK; OM_INVALID (nothing is inside)
OM_API OmStatus om_mask_field_bounds(const OmMaskField* field, OmVec3* lo, OmVec3* hi);
/// Distance field of a mask. The mask is smoothed such that each neighbourhood keeps its volume (thin parts stay), then
/// the zero level is shifted such that the whole keeps the volume of the mask.
/// @return OM_OK; OM_INVALID (an empty mask, or the message names the field); OM_NO_MEMORY
OM_API OmStatus om_sdf_from_mask(const OmMask* mask, const OmSdfDef* def, OmSdf* sdf);
/// Distance field of the zero level of `fn` within [lo, hi] (which should hold all of it).
/// @return OM_OK; OM_INVALID (the message names the field); OM_NO_MEMORY
OM_API OmStatus om_sdf_from_function(OmShapeFn fn, void* ctx, OmVec3 lo, OmVec3 hi,
                                     const OmSdfDef* def, OmSdf* sdf);
/// Half an ellipsoid on its flat side, z = 0, around the origin: a distance to first order, m. Half-axes `half`.
OM_API double om_half_ellipsoid_eval(OmVec3 half, OmVec3 p);
/// Half-axes of the breast phantom: base 150 x 120 mm, height 72 mm, 0.68 litres. The thesis scans a CIRS 073 and
/// prints no dimension of it; the outline is ours.
#define OM_PHANTOM_HALF ((OmVec3){0.075, 0.060, 0.072})
/// Distance field of the solid of a closed surface: all points with a winding number above 0. Parts that overlap are
/// their union. Gaps are tolerated: there the generalised winding number decides, inside is above one half.
/// @return OM_OK; OM_INVALID (a surface that is not closed, or the message names the field); OM_NO_MEMORY
OM_API OmStatus om_sdf_from_surface(const OmSurface* surface, const OmSdfDef* def, OmSdf* sdf);
/// Distance at p, m, trilinear. Outside the grid: the value at the nearest point of the grid plus the distance to it.
/// `gradient` may be null; it is the exact derivative of the returned value, not normalised.
OM_API double om_sdf_eval(const OmSdf* sdf, OmVec3 p, OmVec3* gradient);
/// Opposite corners of the grid.
OM_API void om_sdf_bounds(const OmSdf* sdf, OmVec3* lo, OmVec3* hi);

/// Closed, oriented, manifold surface of the set {d < level} by marching cubes, with the cells cut by the
/// border of the grid capped. Ambiguous faces always separate the inside corners, so neighbours agree.
/// @return OM_OK, also where no point is at this level: an empty surface; OM_INVALID (too many triangles);
///        OM_NO_MEMORY
OM_API OmStatus om_surface_from_sdf(const OmSdf* sdf, double level, OmSurface* surface);

#ifdef __cplusplus
}
#endif
#endif
