/// omentum/shape_fit.h: how well a mesh represents a solid (room `shape`, floor 1).
///
/// Volume alone says little: what a mesh loses in one place may be added in another. A fit has the distances between
/// both surfaces in both directions, the topology of both, and each place where one holds more than the other.
///
///     OmShapeFit fit;
///     om_surface_from_mask(&label, &surface);
///     om_shape_fit_measure(&label, &surface, &mesh, tolerance, 0, &fit, NULL);
///     fit.to_mesh.max ... fit.solid.nhandle == fit.mesh.nhandle ... fit.loss[0].volume ...
#ifndef OMENTUM_SHAPE_FIT_H
#define OMENTUM_SHAPE_FIT_H

#include "omentum/shape_sdf.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Topology of the solid inside a closed surface: its Betti numbers. The Euler characteristic is npart - nhandle +
/// ncavity.
typedef struct OmTopology {
    int npart;    // connected over faces
    int nhandle;  // tunnels through it: 1 of a ring, 0 of a ball
    int ncavity;  // closed hollows
    // Parts that touch along an edge or at a corner count as apart there. False: the surface touches itself so.
    bool is_manifold;
} OmTopology;

/// @param surface  closed, outward
/// @return OM_OK; OM_INVALID (an edge with an odd number of triangles, or not as many in either direction);
///         OM_NO_MEMORY
OM_API OmStatus om_surface_topology(const OmSurface* surface, OmTopology* topology);
OM_API bool om_topology_is_equal(const OmTopology* a, const OmTopology* b);

/// Boundary of a mask: marching cubes of the voxel centres, vertices in the middle between inside and outside voxels.
/// Voxels are connected over faces, hollows over faces and edges. Nothing is smoothed: it is at most half a voxel
/// from the faces of the voxels.
/// @return OM_OK, also for an empty mask: an empty surface; OM_INVALID (too many triangles); OM_NO_MEMORY
OM_API OmStatus om_surface_from_mask(const OmMask* mask, OmSurface* surface);

typedef struct OmSurfaceGap {  // distance of one surface's points from another surface, m
    double mean, p95, max;     // p95: 95 % are nearer
    OmVec3 where;              // of the largest, on the first surface
} OmSurfaceGap;

/// Distances from the vertices and the middles of the triangles of `from` to `to`. Of more than 100,000 points every
/// n-th one is taken.
/// @param nworker  0: one a processor; the result does not depend on it
/// @return OM_OK; OM_INVALID (a surface without triangles, a vertex that is not finite); OM_NO_MEMORY
OM_API OmStatus om_surface_gap(const OmSurface* from, const OmSurface* to, int nworker,
                               OmSurfaceGap* gap);

typedef struct OmShapeLoss {  // a connected place where solid and mesh differ
    bool is_added;            // the mesh has it, the solid has not
    double volume;            // m^3
    OmVec3 where;             // its voxel farthest from the mesh's surface
    double depth;             // m, of this voxel from the mesh's surface
} OmShapeLoss;

#define OM_MAX_LOSS 8

typedef struct OmShapeFit {
    OmSurfaceGap to_mesh;    // from the solid's surface to the mesh's
    OmSurfaceGap to_solid;   // from the mesh's surface to the solid's
    OmTopology solid, mesh;  //
    // Places that differ by more than the tolerance, the largest first, of which OM_MAX_LOSS are kept.
    OmShapeLoss loss[OM_MAX_LOSS];
    int nloss;
    double lost, added;  // m^3, of all these places
    // Where the topology differs: a voxel, m, with which that of the mesh would change, if one was found.
    bool has_change;
    OmVec3 change;
} OmShapeFit;

typedef struct OmShapeWrong {  // voxels where a mesh should be finer; om_shape_wrong_done frees
    int n;
    double* x;  // their centres, m                                                       (n x 3)
} OmShapeWrong;
OM_API void om_shape_wrong_done(OmShapeWrong* wrong);

/// Compare a mesh with the solid of a mask.
/// @param solid      its boundary: om_surface_from_mask, or the surface that the mask was sampled from
/// @param tolerance  m: a place counts if one of its voxels is farther from the mesh's surface
/// @param wrong      out; may be null. Voxels of these places deeper than the tolerance; where the topology differs
/// also
///                   those with which it would change; where there are none of both, all that are nearly wrong
/// @return OM_OK; OM_INVALID (an empty mask or mesh, a surface that is not closed); OM_NO_MEMORY
OM_API OmStatus om_shape_fit_measure(const OmMask* mask, const OmSurface* solid,
                                     const OmTetMesh* mesh, double tolerance, int nworker,
                                     OmShapeFit* fit, OmShapeWrong* wrong);
/// Mark the voxels whose centres are inside the mesh.
/// @param inside  out: 0 or 1 (grid.dim)
/// @return OM_OK; OM_INVALID (a grid without volume)
OM_API OmStatus om_mask_from_tets(const OmTetMesh* mesh, const OmVoxelGrid* grid,
                                  unsigned char* inside);

#ifdef __cplusplus
}
#endif
#endif
