/// omentum/shape_meshing.h: tetrahedral meshes of implicit solids, and measures of meshes (room `shape`, floor 1).
///
/// Isosurface stuffing (Labelle & Shewchuk 2007): a body-centred cubic lattice is cut by the zero level of
/// a function; lattice points that a cut comes too close to are moved onto it. No element is inverted and
/// every dihedral angle is between 10.7 and 164.8 degrees, whatever the function; between edges of different
/// lengths, where some are finer, angles are smaller.
///
///     OmStuffDef def = om_stuff_default_def(0.004, sdf_fn, &sdf, lo, hi);
///     om_tet_mesh_stuff(&def, &mesh);
///     om_tet_mesh_quality(&mesh, &quality);
#ifndef OMENTUM_SHAPE_MESHING_H
#define OMENTUM_SHAPE_MESHING_H

#include "omentum/shape_sdf.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- meshing ------------------------------------------------------------------------------------------

typedef struct OmStuffDef {
    OmCookie cookie;
    double edge;    // mean length of an inner edge, m, > 0; no default
    OmShapeFn fn;   // negative inside; called from several threads
    void* ctx;      // borrowed
    OmVec3 lo, hi;  // the box that holds the solid, m
    double level;   // the surface is fn = level; default 0
    int max_tet;    // larger meshes are refused; default 20 million
    // Points where the mesh must be finer, borrowed: an element of the lattice that holds point i is at most as large
    // as those of a mesh with mean edge fine_edge[i]. Elements grow away from them. Default: none.
    int nfine;
    const double* fine;       // m                                                     (nfine x 3)
    const double* fine_edge;  // m, > 0                                                    (nfine)
    int nworker;              // 0: one a processor (the mesh does not depend on it); default 0
} OmStuffDef;

OM_API OmStuffDef om_stuff_default_def(double edge, OmShapeFn fn, void* ctx, OmVec3 lo, OmVec3 hi);
/// Mesh {fn < level}. OM_INVALID if it holds no lattice point.
/// @return OM_OK; OM_INVALID (the message names the field, or nothing is inside); OM_NO_MEMORY
OM_API OmStatus om_tet_mesh_stuff(const OmStuffDef* def, OmTetMesh* mesh);
/// An OmShapeFn on a distance field; ctx is a const OmSdf*.
OM_API double om_sdf_shape_fn(void* ctx, OmVec3 p);

/// Keep the largest part (`min_share` = 0), or all parts with at least the fraction `min_share` of the elements.
/// Parts are connected over faces. Unused vertices are removed, sets are renumbered. The counts may be null.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_tet_mesh_keep_parts(OmTetMesh* mesh, double min_share, int* nkept, int* nfound);

// ---- measures -------------------------------------------------------------------------------------------

#define OM_DIHEDRAL_BIN 18  // of 10 degrees

typedef struct OmMeshQuality {
    int nvert, ntet, nboundary_tri;
    double volume;                          // m^3
    double dihedral_min, dihedral_max;      // rad
    int64_t dihedral_bin[OM_DIHEDRAL_BIN];  // angles in [10 i, 10 (i + 1)) degrees
    double edge_min, edge_mean, edge_max;   // over distinct edges, m
    int npart;                              // parts connected over faces
    int euler;                              // Euler characteristic of the boundary
    int nlayer;  // elements through the thickest part: twice the edges to its middle, at least 1
    bool is_manifold;  // every boundary edge belongs to two boundary triangles
} OmMeshQuality;

/// Measure a mesh.
/// @return OM_OK; OM_INVALID (a mesh that om_tet_mesh_validate refuses); OM_NO_MEMORY
OM_API OmStatus om_tet_mesh_quality(const OmTetMesh* mesh, OmMeshQuality* quality);
/// Smallest and largest dihedral angle of element e, rad.
OM_API void om_tet_dihedral(const OmTetMesh* mesh, int e, double* smallest, double* largest);
/// Unit normals of the vertices, weighted by the angles of their triangles (nvert x 3).
OM_API void om_surface_normals(const OmSurface* surface, double* normal);
/// Check that each edge belongs to two triangles, in opposite directions; the message names the first other edge.
/// `euler` (V - E + F) may be null.
/// @return OM_OK; OM_INVALID (the message says where it is open); OM_NO_MEMORY
OM_API OmStatus om_surface_check_closed(const OmSurface* surface, int* euler);
/// Points spread evenly over a surface (systematic sampling by area): `n` positions and normals of their
/// triangles (n x 3 each; `normal` may be null). The triangles of `is_used` == 0 are left out (null: none).
/// @return OM_OK; OM_INVALID (no area to draw from)
OM_API OmStatus om_surface_sample(const OmSurface* surface, const unsigned char* is_used, int n,
                                  OmRng* rng, double* point, double* normal);

// ---- random patches, thesis eq. 4.1 -----------------------------------------------------------------------

typedef struct OmPatchDef {
    OmCookie cookie;
    double share;   // of the candidates that the patch takes, 0-1; no default
    uint64_t seed;  // no default
    int center;     // the point P, a surface vertex; -1 (default) draws one of the candidates
    double w_d[2];  // range of the weight of the geodesic distance over its largest value; 0.3-0.7
    double w_n[2];  // ... of the angle between the normals over pi; 1.0-1.5
    double w_p[2];  // ... of the noise, which runs over 0-1; 0.1-0.4
    // Wavelength of the noise, m; 0 (default): a quarter of the largest distance.
    double noise_length;
    // Normals of the surface's vertices, borrowed; null (default): computed anew for each patch.   (nvert x 3)
    const double* normal;
} OmPatchDef;

OM_API OmPatchDef om_patch_default_def(double share, uint64_t seed);
/// The vertices Q with the smallest D = w_d d(P, Q) + w_n n(P, Q) + w_p noise(Q), ascending, in `vert` (the
/// caller frees with om_free); geodesics run along edges. Candidates are surface vertices (null: all).
/// @return OM_OK; OM_INVALID (the message names the field or the candidate); OM_NO_MEMORY
OM_API OmStatus om_surface_random_patch(const OmSurface* surface, const int* candidate,
                                        int ncandidate, const OmPatchDef* def, int** vert,
                                        int* nvert);
/// Distances along edges from vertex `from`, m; HUGE_VAL where no path leads (nvert).
/// @return OM_OK; OM_INVALID (no such vertex); OM_NO_MEMORY
OM_API OmStatus om_surface_geodesic(const OmSurface* surface, int from, double* distance);
/// Gradient noise in [-1, 1] with features of size 1 (Perlin 2002, lattice hashed from the seed).
OM_API double om_noise_perlin(OmVec3 p, uint64_t seed);

#ifdef __cplusplus
}
#endif
#endif
