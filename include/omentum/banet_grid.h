/// omentum/banet_grid.h: the grid of voxels around a body, and the input of BA-Net (room `banet`, floor 6).
///
/// Thesis 4.2. The rest surface of a body and the displacement measured on its visible part become five numbers a
/// voxel. The thesis has a grid of 64^3 cells with a side of 300 mm; ours has its voxel and covers the box of the
/// body. The axes are the principal axes of the surface: x the longest, z the thinnest direction.
///
///     om_banet_grid_fit(&surface, 0.3, &grid);
///     float* in = om_alloc(OM_BANET_NCHANNEL * om_grid_count(grid.dim), sizeof *in);
///     om_banet_voxelize(&grid, &surface, u, seen, in);
#ifndef OMENTUM_BANET_GRID_H
#define OMENTUM_BANET_GRID_H

#include "omentum/math_grid.h"
#include "omentum/shape.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_BANET_SIDE_CELL 64  // cells along the side of the thesis's grid
#define OM_BANET_MULTIPLE 16   // dim are multiples of this: four poolings
#define OM_BANET_MARGIN 2      // cells between the body and the border of the grid, at least
#define OM_BANET_CLIP 2.0      // largest signed distance in the input, voxels

/// Channels of the input. Lengths are in voxels, displacements along the axes of the grid.
enum {
    OM_BANET_DISTANCE,  // signed distance to the rest surface, negative inside, within +-OM_BANET_CLIP
    OM_BANET_UX,        // measured displacement
    OM_BANET_UY,
    OM_BANET_UZ,
    OM_BANET_SEEN,  // how well the place was seen, 0 to 1
    OM_BANET_NCHANNEL
};

typedef struct OmBanetGrid {
    OmPose pose_world_grid;  // origin at the centre of cell (0, 0, 0)
    double voxel;            // size of a cell, m: side / 64
    int dim[3];              // cells
} OmBanetGrid;

/// The smallest grid around a surface. The body is in the middle. Along x and y the third moment of the surface is
/// positive (of a symmetric surface the largest component of the axis is); z completes a right-handed frame.
/// @param side  of the thesis's grid, m: om_banet_default_side (0.3; 0.2 for bodies thinner than 6 mm)
/// @return OM_OK; OM_INVALID (side, no triangles, a vertex that is not finite, a grid above 2^24 cells)
OM_API OmStatus om_banet_grid_fit(const OmSurface* surface, double side, OmBanetGrid* grid);

/// Position of a point in cells: whole numbers are centres of cells.
OM_API OmVec3 om_banet_grid_local(const OmBanetGrid* grid, OmVec3 p_world);

/// The input of the network. A cell within a voxel of the surface has the mean displacement of the seen vertices
/// nearby (weights: a Gaussian of the distance times `seen`) and the mean of `seen` (weights: the Gaussian). A cell
/// without a seen vertex nearby has zeros.
/// @param surface  closed, at rest, inside the grid
/// @param u        measured displacement of the vertices, world axes, m              (nvert x 3)
/// @param seen     how well each vertex was seen, 0 to 1                                 (nvert)
/// @param in       (OM_BANET_NCHANNEL x dim[2] x dim[1] x dim[0])
/// @return OM_OK; OM_INVALID (the grid does not enclose the surface; a value is not finite or out of range);
///         OM_NO_MEMORY
OM_API OmStatus om_banet_voxelize(const OmBanetGrid* grid, const OmSurface* surface,
                                  const double* u, const double* seen, float* in);

/// The cell of each vertex, as an index into one channel; -1 outside of the grid.
OM_API void om_banet_find_cells(const OmBanetGrid* grid, const OmSurface* surface, int* cell);

#ifdef __cplusplus
}
#endif
#endif
