/// omentum/shape_file.h: files of meshes, surfaces and recordings of runs (room `shape`, floor 1).
///
/// Volume meshes: Gmsh .msh (1, 2.2, 4.1), VTK legacy .vtk, VTK XML .vtu. Surfaces: STL, OBJ, PLY, OFF,
/// and the triangles of volume files. Recordings: VTKHDF, which ParaView opens as a time series.
/// No mesh format has a place for unit and space (RAS or LPS). Files of ours and of 3D Slicer state them in
/// headers, comments or fields, and these are read; the caller's value replaces them.
///
///     OmTetMesh mesh;
///     OmStatus s = om_tet_mesh_load("liver.msh", OM_UNIT_MM, &mesh);  // now in metres
///     if (s == OM_OK) s = om_tet_mesh_save(&mesh, "liver.vtu", OM_UNIT_M);
///     if (s < 0) fprintf(stderr, "%s\n", om_error_message());
///     om_tet_mesh_done(&mesh);
#ifndef OMENTUM_SHAPE_FILE_H
#define OMENTUM_SHAPE_FILE_H

#include "omentum/shape.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_UNIT_M 1.0
#define OM_UNIT_CM 1e-2
#define OM_UNIT_MM 1e-3

typedef enum OmSpace {  // which way x and y point; inside it is RAS
    OM_SPACE_NONE,      // not stated
    OM_SPACE_RAS,       // +x right, +y anterior, +z superior
    OM_SPACE_LPS        // +x left, +y posterior, +z superior: DICOM, ITK, surfaces of 3D Slicer
} OmSpace;

typedef struct OmMeshFrame {  // of the numbers in a file; zero says nothing
    double unit;              // m per unit; 0: not stated
    OmSpace space;
} OmMeshFrame;

/// Unit and space of a file: those of the caller, else of the file, else millimetres and RAS.
OM_API OmMeshFrame om_mesh_frame_join(OmMeshFrame given, OmMeshFrame stated);

enum {                        // flags of loading
    OM_MESH_FLIP = 1,         // turn inverted tetrahedra around instead of refusing them
    OM_MESH_KEEP_UNUSED = 2,  // keep vertices that no element uses
    OM_MESH_DROP_FLAT = 4,    // drop tetrahedra of zero volume instead of refusing them
    OM_MESH_STRAIGHTEN = 8,   // leave out the nodes on curved edges instead of refusing them
    // of surfaces: keep triangles that name a vertex twice, for om_surface_repair, which counts and drops them
    OM_MESH_KEEP_DEGENERATE = 16,
};

// ---- loading ----------------------------------------------------------------------------------------

/// Read a tetrahedral mesh (.msh, .vtk, .vtu by extension). Other cells are ignored. Labels come from
/// Gmsh physical groups or the cell array `tet_label`; sets from named physical groups, or from point
/// arrays of bytes that hold only 0 and 1. Vertices that no tetrahedron uses are dropped. Of tetrahedra of ten nodes
/// the four vertices are read: each node on an edge must be within 0.1 % of its length from the midpoint.
/// shape_tet10.h keeps all nodes.
/// @param unit  length of one unit of the file, m, > 0
/// @return OM_OK, OM_IO, OM_NO_MEMORY, OM_INVALID: not such a file, no tetrahedra, a coordinate that is
///         not finite, an index out of range, an inverted, flat or curved element; the message says where
OM_API OmStatus om_tet_mesh_load(const char* path, double unit, OmTetMesh* mesh);
/// As om_tet_mesh_load, with OM_MESH_ flags.
/// @return OM_OK; OM_INVALID (the message names line or field); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_tet_mesh_load_flags(const char* path, double unit, unsigned flags,
                                       OmTetMesh* mesh);

/// Read a surface (.stl, .obj, .ply, .off, .vtp, .msh, .vtk, .vtu by extension). Polygons become fans, equal
/// vertices of an STL become one, degenerate triangles are dropped. From a volume file: its triangles,
/// or the boundary of its tetrahedra if it has none; of quadratic cells the vertices. Open and non-manifold surfaces
/// are read: check them.
/// @return OM_OK; OM_INVALID (the message names line or field); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_surface_load(const char* path, double unit, OmSurface* surface);
/// As om_surface_load, with OM_MESH_ flags.
/// @return OM_OK; OM_INVALID (the message names line or field); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_surface_load_flags(const char* path, double unit, unsigned flags,
                                      OmSurface* surface);

/// The same, with what is known of the file's numbers. Positions become RAS metres.
/// @param given   zero fields leave it to the file
/// @param stated  receives what the file says; may be null
/// @return OM_OK; OM_INVALID (the message names line or field); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_tet_mesh_load_frame(const char* path, OmMeshFrame given, unsigned flags,
                                       OmTetMesh* mesh, OmMeshFrame* stated);
typedef struct OmMeshReading {  // what om_tet_mesh_load_reading changed
    OmMeshFrame stated;         // what the file says
    int nturned;                // tetrahedra turned around (OM_MESH_FLIP)
    int first_turned;           // number of the first of them in the file, from 1; 0: none
    int nflat;                  // tetrahedra dropped (OM_MESH_DROP_FLAT)
    int nmid;         // nodes on edges that are left out; a node of two tetrahedra counts twice
    double mid_most;  // the most that one of them is away from the middle of its edge, m
} OmMeshReading;
/// As om_tet_mesh_load_frame, with an account of what was changed.
/// @return as om_tet_mesh_load_frame
OM_API OmStatus om_tet_mesh_load_reading(const char* path, OmMeshFrame given, unsigned flags,
                                         OmTetMesh* mesh, OmMeshReading* reading);
/// @return OM_OK; OM_INVALID (the message names line or field); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_surface_load_frame(const char* path, OmMeshFrame given, unsigned flags,
                                      OmSurface* surface, OmMeshFrame* stated);

// ---- checking ---------------------------------------------------------------------------------------

typedef struct OmSurfaceCheck {
    int nopen_edge;      // edges of one triangle: holes
    int nmanifold_edge;  // edges of three or more triangles
    int nflipped_edge;   // edges whose two triangles disagree on the outside
    int ncomponent;      // pieces connected by edges
    int neuler;          // V - E + F of the vertices in use; 2 for a sphere
    int first_edge[2];   // vertices of the first offending edge, -1 if none
    int first_tri;       // its triangle, -1 if none
} OmSurfaceCheck;

/// Count what keeps a surface from bounding a volume. OM_OK also for a bad surface.
/// @return OM_OK, whatever was found; OM_INVALID (a vertex that does not exist); OM_NO_MEMORY
OM_API OmStatus om_surface_check(const OmSurface* surface, OmSurfaceCheck* check);
/// OM_INVALID, with the first offending edge in the message, unless closed, manifold and consistent.
/// @return OM_OK; OM_INVALID (not closed: the message says what and where); OM_NO_MEMORY
OM_API OmStatus om_surface_require_closed(const OmSurface* surface);

// ---- saving -----------------------------------------------------------------------------------------

typedef enum OmArrayType {
    OM_ARRAY_DOUBLE,
    OM_ARRAY_FLOAT,
    OM_ARRAY_INT,
    OM_ARRAY_BYTE
} OmArrayType;

typedef struct OmMeshArray {  // values on the vertices or elements of a mesh; borrowed
    const char* name;
    OmArrayType type;   // of what `value` points at: double, float, int (32 bits), unsigned char
    int ncomp;          // components, 1 to 9
    bool is_cell;       // of elements, not of vertices
    const void* value;  // (nvert or ntet x ncomp)
} OmMeshArray;

/// Write a tetrahedral mesh with labels and sets: .vtu, .vtk, .msh (4.1). Whole or not at all.
/// @param unit  length of one unit of the file, m, > 0
/// @return OM_OK; OM_INVALID (an ending that names no format, a unit that is no length); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_tet_mesh_save(const OmTetMesh* mesh, const char* path, double unit);

typedef enum OmMeshFormat {
    OM_MESH_VTU,        // compressed, base64
    OM_MESH_VTU_ASCII,  // text, 17 digits
    OM_MESH_VTK,        // legacy binary
    OM_MESH_VTK_ASCII,
    OM_MESH_MSH41,  // Gmsh 4.1 text
    OM_MESH_MSH22,  // Gmsh 2.2 text
} OmMeshFormat;

/// The same in a stated format, with further arrays (.vtu and .vtk only; null if narray is 0).
/// @return OM_OK; OM_INVALID (a format, a unit or an array: the message says which); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_tet_mesh_save_format(const OmTetMesh* mesh, const char* path, double unit,
                                        OmMeshFormat format, const OmMeshArray* array, int narray);

/// Write a surface: .stl (binary), .obj, .ply (binary), .off, .vtk. Whole or not at all.
/// @return OM_OK; OM_INVALID (an ending that names no format, a unit that is no length); OM_IO
OM_API OmStatus om_surface_save(const OmSurface* surface, const char* path, double unit);

/// The same in a stated space. All but .msh and .off say unit and space, so that they are read again by them.
/// @param frame  unit > 0; OM_SPACE_NONE is RAS
/// @return OM_OK; OM_INVALID (an ending that names no format, a unit that is no length); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_tet_mesh_save_frame(const OmTetMesh* mesh, const char* path, OmMeshFrame frame);
/// @return OM_OK; OM_INVALID (an ending that names no format, a unit that is no length); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_surface_save_frame(const OmSurface* surface, const char* path,
                                      OmMeshFrame frame);

// ---- recordings -------------------------------------------------------------------------------------

/// A run as a time series: the elements once, positions and arrays at every step, SI units.
typedef struct OmRecording OmRecording;

typedef struct OmRecordingArrays {
    const OmMeshArray* array;
    int narray;
} OmRecordingArrays;

/// Start `path` (.vtkhdf) under a temporary name. The labels and sets of the mesh are constant arrays of
/// the recording. Arrays with a value are constant and copied; arrays whose value is null are given at
/// each step.
/// @param mesh  copied; its x is not recorded, each step brings its own
/// @return OM_OK; OM_INVALID (an array without name, or of more than 9 components); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_recording_begin(const char* path, const OmTetMesh* mesh,
                                   const OmMeshArray* array, int narray, OmRecording** recording);
typedef struct OmRecordedSurface {  // borrowed until om_recording_begin_scene returns
    const char* name;
    const OmSurface* surface;  // its x is not recorded
} OmRecordedSurface;
#define OM_RECORDING_MAX_SURFACE 15
/// The same with surfaces beside the mesh. Vertices and cells of all follow each other, those of the mesh first: so do
/// positions and values of every step and of every array. The cell array `part` is 0 for the mesh and 1, 2, .. for the
/// surfaces; the attribute `part_names` of the file says which is which. Sets are 0 on surfaces, and tet_label -1.
/// @param mesh_name  its name among the parts
/// @return as om_recording_begin; OM_INVALID (a surface without name, or too many)
OM_API OmStatus om_recording_begin_scene(const char* path, const OmTetMesh* mesh,
                                         const char* mesh_name, const OmRecordedSurface* surface,
                                         int nsurface, const OmRecordingArrays* arrays,
                                         OmRecording** recording);
/// Append one step.
/// @param time   s, larger than the last
/// @param x      vertex positions, of surfaces too, m (nvert x 3)
/// @param value  one pointer for each array that was given without value, in their order
/// @return OM_OK; OM_INVALID (time does not increase); OM_IO
OM_API OmStatus om_recording_add_step(OmRecording* recording, double time, const double* x,
                                      const void* const* value);
/// Finish: flush, fsync, rename to `path`. Frees the recording in every case.
/// @return OM_OK; OM_NO_MEMORY; OM_IO
OM_API OmStatus om_recording_end(OmRecording* recording);
/// Drop the recording and its temporary file. Null is fine.
OM_API void om_recording_abort(OmRecording* recording);

#ifdef __cplusplus
}
#endif
#endif
