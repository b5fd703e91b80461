/// omentum/math_grid.h: regular grids of points (room `math`, floor 0).
///
/// Two kinds of grid. An OmGrid has cubic cells along the axes of space: distance fields, hexahedra. An OmVoxelGrid may
/// be oblique, anisotropic or left-handed: volumes and masks, as their files define them. Both number their points in
/// the same order: point (i, j, k) has index i + dim[0] (j + dim[1] k). A cell has the index of its lowest corner.
///
///     for (int k = 0, n = 0; k < g.dim[2]; ++k)
///         for (int j = 0; j < g.dim[1]; ++j)
///             for (int i = 0; i < g.dim[0]; ++i, ++n) value[n] = f(om_grid_point(&g, i, j, k));
#ifndef OMENTUM_MATH_GRID_H
#define OMENTUM_MATH_GRID_H

#include "omentum/vec.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmGrid {  // cubic cells along the axes
    int dim[3];          // points
    double spacing;      // m, > 0
    OmVec3 origin;       // point (0, 0, 0), m
} OmGrid;

typedef struct OmVoxelGrid {  // parallel steps in any direction
    int dim[3];               // voxels
    OmMat3 axis;              // columns: step of i, j, k, m; not singular
    OmVec3 origin;            // centre of voxel (0, 0, 0), m
} OmVoxelGrid;

// ---- index and (i, j, k), from dim alone -------------------------------------------------------------

/// Number of points.
static inline size_t om_grid_count(const int dim[3]) {
    return (size_t)dim[0] * (size_t)dim[1] * (size_t)dim[2];
}
/// Index of point (i, j, k), which is inside the grid.
static inline size_t om_grid_index(const int dim[3], int i, int j, int k) {
    return (size_t)i + (size_t)dim[0] * ((size_t)j + (size_t)dim[1] * (size_t)k);
}
/// (i, j, k) of the point with this index.
static inline void om_grid_unpack(const int dim[3], size_t index, int at[3]) {
    const size_t nx = (size_t)dim[0], ny = (size_t)dim[1];
    at[0] = (int)(index % nx);
    at[1] = (int)(index / nx % ny);
    at[2] = (int)(index / (nx * ny));
}
/// Whether (i, j, k) is inside the grid.
static inline bool om_grid_has(const int dim[3], int i, int j, int k) {
    return i >= 0 && j >= 0 && k >= 0 && i < dim[0] && j < dim[1] && k < dim[2];
}
/// Differences of index between neighbours along the three axes.
static inline void om_grid_stride(const int dim[3], size_t stride[3]) {
    stride[0] = 1;
    stride[1] = (size_t)dim[0];
    stride[2] = (size_t)dim[0] * (size_t)dim[1];
}
/// Indices of the eight corners of a cell, in the order of OM_HEX8: counter-clockwise below, then above.
static inline void om_grid_corners(const int dim[3], size_t cell, size_t corner[8]) {
    const size_t y = (size_t)dim[0], z = y * (size_t)dim[1];
    const size_t step[8] = {0, 1, 1 + y, y, z, 1 + z, 1 + y + z, y + z};
    for (int a = 0; a < 8; ++a) corner[a] = cell + step[a];
}

// ---- (i, j, k) and positions ---------------------------------------------------------------------------

/// Position of point (i, j, k), m; outside of the grid, too.
static inline OmVec3 om_grid_point(const OmGrid* grid, int i, int j, int k) {
    return om_madd(grid->origin, grid->spacing, om_vec3(i, j, k));
}
/// Position of the last point, opposite to the origin, m.
static inline OmVec3 om_grid_end(const OmGrid* grid) {
    return om_grid_point(grid, grid->dim[0] - 1, grid->dim[1] - 1, grid->dim[2] - 1);
}
/// (i, j, k) of the nearest point of the grid whose coordinates are not above those of p.
static inline void om_grid_cell(const OmGrid* grid, OmVec3 p, int at[3]) {
    const double q[3] = {p.x - grid->origin.x, p.y - grid->origin.y, p.z - grid->origin.z};
    for (int c = 0; c < 3; ++c) {
        const double cell = floor(q[c] / grid->spacing);  // spacing > 0
        at[c] = !(cell > 0) ? 0 : cell > grid->dim[c] - 1 ? grid->dim[c] - 1 : (int)cell;
    }
}
/// Position of a point in steps of the grid, m: whole numbers are the centres of voxels.
static inline OmVec3 om_voxel_grid_point(const OmVoxelGrid* grid, OmVec3 ijk) {
    return om_add(grid->origin, om_mat3_apply(grid->axis, ijk));
}

#ifdef __cplusplus
}
#endif
#endif
