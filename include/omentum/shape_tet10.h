/// omentum/shape_tet10.h: meshes of quadratic tetrahedra and their files (room `shape`, floor 1).
///
/// A quadratic tetrahedron has ten nodes: its vertices and one on each edge, which may be off the midpoint: the edge is
/// then curved. Nodes are in VTK's order; the files of Gmsh have their own order, which readers and writers handle.
///
///     OmTet10Mesh mesh;
///     OmStatus s = om_tissue_make_tet10(model, om_tissue_x(state), &mesh);   // or om_tet10_mesh_load
///     if (s == OM_OK) s = om_tet10_mesh_save(&mesh, "bent.vtu", OM_UNIT_M);
///     om_tet10_mesh_done(&mesh);
#ifndef OMENTUM_SHAPE_TET10_H
#define OMENTUM_SHAPE_TET10_H

#include "omentum/shape_file.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmTet10Mesh {  // quadratic tetrahedra; om_tet10_mesh_done frees
    int nnode, nelem, nset;
    double* x;        // positions of nodes, m                                       (nnode x 3)
    int* elem_node;   // vertices as in OmTetMesh, then edges 01 12 02 03 13 23      (nelem x 10)
    int* elem_label;  // material label of each element, 0 if there is one           (nelem)
    OmMeshSet* set;   // of nodes                                                    (nset)
} OmTet10Mesh;

/// Allocate arrays for the counts; om_tet10_mesh_done frees them.
/// @return OM_OK; OM_INVALID (a negative count); OM_NO_MEMORY
OM_API OmStatus om_tet10_mesh_init(OmTet10Mesh* mesh, int nnode, int nelem);
OM_API void om_tet10_mesh_done(OmTet10Mesh* mesh);
/// The same tetrahedra with nodes at the midpoints of their edges; vertices keep their numbers. A midpoint is in the
/// sets that have both ends of its edge.
/// @return OM_OK; OM_INVALID (too many elements); OM_NO_MEMORY
OM_API OmStatus om_tet10_mesh_from_tet(const OmTetMesh* tet, OmTet10Mesh* mesh);
/// The same from the results of om_tet_mesh_refine_nodes, copied.
/// @param fine  its positions, labels and sets are used
/// @param node  (fine->ntet / 8 x 10)
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_tet10_mesh_from_nodes(const OmTetMesh* fine, const int* node, OmTet10Mesh* mesh);
/// Check indices, finite positions, and positive volumes of the tetrahedra of the vertices.
/// @return OM_OK; OM_INVALID (the message names the element or node)
OM_API OmStatus om_tet10_mesh_validate(const OmTet10Mesh* mesh);

/// Read tetrahedra of ten nodes (.msh, .vtk, .vtu), also curved ones. Labels, sets, unit and flags are as in
/// om_tet_mesh_load_frame. Nodes that no tetrahedron uses are dropped.
/// @param given  zero fields leave unit and space to the file
/// @return OM_OK, OM_IO, OM_NO_MEMORY, OM_INVALID: as om_tet_mesh_load, or a tetrahedron of four nodes
OM_API OmStatus om_tet10_mesh_load(const char* path, OmMeshFrame given, unsigned flags,
                                   OmTet10Mesh* mesh);
/// Write nodes, elements, labels and sets: .vtu, .vtk (cells of type 24), .msh (4.1, type 11). Whole or not at all.
/// @param unit  length of one unit of the file, m, > 0
/// @return OM_OK; OM_INVALID (an ending that names no format, a unit that is no length); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_tet10_mesh_save(const OmTet10Mesh* mesh, const char* path, double unit);
/// The same in a stated format, with further arrays on nodes and elements (.vtu and .vtk only; null if narray is 0).
/// @return OM_OK; OM_INVALID (a format, a unit or an array: the message says which); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_tet10_mesh_save_format(const OmTet10Mesh* mesh, const char* path, double unit,
                                          OmMeshFormat format, const OmMeshArray* array,
                                          int narray);
/// As om_recording_begin_scene, of quadratic tetrahedra: positions and arrays of every step are those of all nodes.
/// @return as om_recording_begin_scene; OM_INVALID (as om_tet10_mesh_validate)
OM_API OmStatus om_recording_begin_tet10(const char* path, const OmTet10Mesh* mesh,
                                         const char* mesh_name, const OmRecordedSurface* surface,
                                         int nsurface, const OmRecordingArrays* arrays,
                                         OmRecording** recording);

#ifdef __cplusplus
}
#endif
#endif
