/// omentum/shape.h: surfaces, tetrahedral meshes, signed distance fields (floor 1).
///
/// The shape of a body, without its material. Lengths are metres in RAS world coordinates.
/// Readers and writers of mesh files are in shape_file.h.
#ifndef OMENTUM_SHAPE_H
#define OMENTUM_SHAPE_H

#include "omentum/base.h"
#include "omentum/vec.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_SET_NAME 64

typedef struct OmSurface {  // triangles; om_surface_done frees
    int nvert, ntri;
    double* x;      // vertex positions, m                                  (nvert x 3)
    int* tri_vert;  // vertices, counter-clockwise seen from outside        (ntri x 3)
} OmSurface;

typedef struct OmMeshSet {  // a named subset of vertices: attachments, ROI, grasped patch
    char name[OM_SET_NAME];
    int nvert;
    int* vert;  // ascending, no repeats                                      (nvert)
} OmMeshSet;

typedef struct OmTetMesh {  // linear tetrahedra; om_tet_mesh_done frees
    int nvert, ntet, nset;
    double* x;       // vertex positions, m                                  (nvert x 3)
    int* tet_vert;   // vertices; (b-a) x (c-a) . (d-a) > 0                  (ntet x 4)
    int* tet_label;  // material label of each element, 0 if there is one    (ntet)
    OmMeshSet* set;  //                                                      (nset)
} OmTetMesh;

/// Allocate arrays for the counts; om_surface_done frees them.
/// @return OM_OK; OM_INVALID (a negative count); OM_NO_MEMORY
OM_API OmStatus om_surface_init(OmSurface* surface, int nvert, int ntri);
OM_API void om_surface_done(OmSurface* surface);
/// Allocate arrays for the counts; om_tet_mesh_done frees them.
/// @return OM_OK; OM_INVALID (a negative count); OM_NO_MEMORY
OM_API OmStatus om_tet_mesh_init(OmTetMesh* mesh, int nvert, int ntet);
OM_API void om_tet_mesh_done(OmTetMesh* mesh);
/// Deep copy; `out` is overwritten.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_tet_mesh_copy(const OmTetMesh* mesh, OmTetMesh* out);
/// Two meshes as one, of two bodies: the vertices, tetrahedra and labels of `a` come first. Sets of one name are
/// joined.
/// @param out  overwritten
/// @return OM_OK; OM_INVALID (too many vertices); OM_NO_MEMORY
OM_API OmStatus om_tet_mesh_join(const OmTetMesh* a, const OmTetMesh* b, OmTetMesh* out);
/// Add a named set (copied, sorted, repeats dropped); replaces a set of the same name.
/// @return OM_OK; OM_INVALID (a name that is empty or too long, a vertex that does not exist); OM_NO_MEMORY
OM_API OmStatus om_tet_mesh_add_set(OmTetMesh* mesh, const char* name, const int* vert, int nvert);
/// The set of that name, or null.
OM_API const OmMeshSet* om_tet_mesh_find_set(const OmTetMesh* mesh, const char* name);
/// Box [lo, hi] of nx x ny x nz cells, each six Kuhn tetrahedra around the main diagonal. Vertex
/// (i, j, k) has index i + (nx + 1) (j + (ny + 1) k).
/// @return OM_OK; OM_INVALID (counts below 1, corners in the wrong order); OM_NO_MEMORY
OM_API OmStatus om_tet_mesh_box(OmVec3 lo, OmVec3 hi, int nx, int ny, int nz, OmTetMesh* mesh);
/// The cells of a mesh whose tetrahedra, six by six, are cut as those of a box; vertices may have moved. A cell has its
/// nodes counter-clockwise below, then above; the third axis is that with most faces on the boundary: through a sheet.
/// @param node  out: (ntet / 6 x 8), the caller frees it with om_free
/// @return OM_OK; OM_INVALID (the message names tetrahedra that are no cell); OM_NO_MEMORY
OM_API OmStatus om_tet_mesh_find_cells(const OmTetMesh* mesh, int** node);
/// Its boundary triangles, outward. If `surface_vert` is not null it receives the mesh vertex of every
/// surface vertex (caller frees with om_free).
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_tet_mesh_boundary(const OmTetMesh* mesh, OmSurface* surface, int** surface_vert);
/// Replace every tetrahedron by eight of the same volume; sets get the new vertices between theirs.
/// @return OM_OK; OM_INVALID (too many elements); OM_NO_MEMORY, the mesh is as before
OM_API OmStatus om_tet_mesh_refine(OmTetMesh* mesh);
/// Halve longest edges, each with all tetrahedra around it, until the mesh has min_nvert vertices: finer than the given
/// one, coarser than its refinement. The old vertices come first, tetrahedra keep their labels, and a new vertex joins
/// the sets that have both ends of its edge.
/// @return OM_OK (also where the mesh has as many already); OM_INVALID (no elements, too many vertices); OM_NO_MEMORY,
///         the mesh is as before
OM_API OmStatus om_tet_mesh_bisect(OmTetMesh* mesh, int min_nvert);
/// The eight of om_tet_mesh_refine, and the ten nodes of every old tetrahedron: its vertices, then the midpoints of its
/// edges 01 02 03 12 13 23. Tetrahedra 8 t .. 8 t + 7 of the new mesh fill tetrahedron t; of these, the first four have
/// its vertices, in order.
/// @param node  out: (ntet x 10), the caller frees it with om_free
/// @return as om_tet_mesh_refine
OM_API OmStatus om_tet_mesh_refine_nodes(OmTetMesh* mesh, int** node);
/// The vertices at the ends of the edge of each midpoint of om_tet_mesh_refine_nodes.
/// @param nvert  vertices of the old mesh: midpoints follow
/// @param end    out                                                          (midpoints x 2)
OM_API void om_tet_mesh_midpoint_ends(int ntet, const int* node, int nvert, int* end);
/// Check indices, finite positions, positive volumes; the message names the first offender.
/// @return OM_OK; OM_INVALID (the message names the element or vertex)
OM_API OmStatus om_tet_mesh_validate(const OmTetMesh* mesh);
/// Signed volume, m^3.
OM_API double om_tet_mesh_volume(const OmTetMesh* mesh);
OM_API double om_surface_volume(const OmSurface* surface);

#ifdef __cplusplus
}
#endif
#endif
