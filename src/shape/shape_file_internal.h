// shape_file_internal.h: shared by the readers and writers of mesh files.
#ifndef OMENTUM_SHAPE_FILE_INTERNAL_H
#define OMENTUM_SHAPE_FILE_INTERNAL_H

#include "omentum/shape_cloud.h"
#include "omentum/shape_tet10.h"

// ---- contents of a file before units and checks (shape_file_data.c) -----------------------------

typedef struct OmFileSet {  // a named group of vertices; repeats allowed
    char name[OM_SET_NAME];
    int *vert, nvert, cap;
} OmFileSet;

typedef struct OmFileMesh {
    double* x;  // in the file's unit (nvert x 3)
    int nvert, xcap;
    // of the first nnormal vertices, of any length, the others have none (nnormal x 3)
    double* normal;
    int nnormal, normalcap;
    int* tri;  // (ntri x 3); indices are checked when the mesh is built
    int ntri, tricap;
    int* tet;  // (ntet x 4)
    int ntet, tetcap;
    // nodes of the edges 01 12 02 03 13 23 of the first nmid tetrahedra, -1 of linear ones; the others are linear
    // (nmid x 6)
    int* mid;
    int nmid, midcap;
    int* label;  // of the first nlabel tetrahedra, the others have 0
    int nlabel, labelcap;
    OmFileSet* set;
    int nset, setcap;
    bool is_soup;        // triangles share no vertices yet (STL)
    OmMeshFrame stated;  // unit and directions that the file states
} OmFileMesh;

void om__file_mesh_done(OmFileMesh* m);
// Grow *array to at least `need` items of `size` bytes by doubling.
OmStatus om__grow(void* array, int* cap, int64_t need, size_t size);
OmStatus om__add_vert(OmFileMesh* m, const double x[3]);
// The normal of the vertex added last.
OmStatus om__add_normal(OmFileMesh* m, const double normal[3]);
OmStatus om__add_tri(OmFileMesh* m, int a, int b, int c);
OmStatus om__add_tet(OmFileMesh* m, const int vert[4]);
// Set the nodes on edges of the tetrahedron added last.
OmStatus om__set_mid(OmFileMesh* m, const int mid[6]);
// Set the label of the tetrahedron added last.
OmStatus om__set_label(OmFileMesh* m, int64_t label);
// Add a polygon as a fan of triangles.
OmStatus om__add_polygon(OmFileMesh* m, const int* vert, int nvert);
// The index of the set of that name; a new set if there is none.
OmStatus om__file_set(OmFileMesh* m, const char* name, size_t len, int* index);
OmStatus om__add_set_vert(OmFileMesh* m, int set, int vert);
// Add a cell by its VTK type: tetrahedra are used, of triangles (also quadratic) the vertices, polygons are
// split, other types are ignored. *is_tet is true if a tetrahedron was added.
OmStatus om__add_vtk_cell(OmFileMesh* m, int type, const int* vert, int nvert, bool* is_tet);
// A point array of bytes, for the vertices from `first` on: it becomes a set if all values are 0 or 1.
OmStatus om__add_point_flags(OmFileMesh* m, const char* name, size_t len, int first,
                             const int64_t* value, int count);

// ---- text (shape_file_scan.c) ---------------------------------------------------------------------

typedef struct OmScan {  // a file in memory and a position in it
    const char *start, *p, *end;
} OmScan;
typedef struct OmWord {  // letters of the file, not terminated
    const char* str;
    size_t len;
} OmWord;

OmScan om__scan(const char* data, size_t size);
size_t om__scan_left(const OmScan* s);
// The line number of the position, from 1; counted on each call.
int om__scan_line(const OmScan* s);
void om__skip_blank(OmScan* s);   // blanks and line ends
void om__skip_space(OmScan* s);   // blanks of this line
void om__skip_line(OmScan* s);    // to the start of the next line
bool om__at_line_end(OmScan* s);  // skips blanks first
OmWord om__read_word(OmScan* s);  // skips blanks and line ends first; length 0 at the end
OmWord om__read_line(OmScan* s);  // the rest of this line, blanks around it cut off
bool om__is_word(OmWord w, const char* str);
bool om__is_word_nocase(OmWord w, const char* str);
// Set an error for the current line: "line 12: ...".
OmStatus om__scan_error(const OmScan* s, const char* format, ...) OM_PRINTF(2, 3);
OmStatus om__read_double(OmScan* s, const char* what, double* v);
// Read a finite number; otherwise an error with the line.
OmStatus om__read_coord(OmScan* s, const char* what, double* v);
OmStatus om__read_int(OmScan* s, const char* what, int64_t lo, int64_t hi, int64_t* v);
// Read a count of items of at least `least` bytes each; the rest of the file must be able to hold them.
OmStatus om__read_count(OmScan* s, const char* what, size_t min, int* count);
OmStatus om__check_count(const OmScan* s, const char* what, int64_t count, size_t min);
// The next n bytes, or null with the message set.
const unsigned char* om__read_bytes(OmScan* s, const char* what, uint64_t n);

// ---- binary values (shape_file_scan.c) ------------------------------------------------------------

typedef enum OmValueType {
    OM_VALUE_NONE,
    OM_VALUE_I8,
    OM_VALUE_U8,
    OM_VALUE_I16,
    OM_VALUE_U16,
    OM_VALUE_I32,
    OM_VALUE_U32,
    OM_VALUE_I64,
    OM_VALUE_U64,
    OM_VALUE_F32,
    OM_VALUE_F64,
} OmValueType;
size_t om__value_size(OmValueType type);
bool om__is_little(void);
// Real numbers that are not integers become INT64_MIN, which is no valid index.
double om__load_real(OmValueType type, const unsigned char* bytes, bool is_swapped);
int64_t om__load_integer(OmValueType type, const unsigned char* bytes, bool is_swapped);

// ---- base64 and zlib (shape_file_bytes.c) ----------------------------------------------------------

typedef struct OmByteStream {  // plain or base64 bytes, read in order
    const unsigned char *p, *end;
    bool is_base64;
    unsigned char group[3];
    // bytes of the current group of four letters, and how many of them were read
    int ngroup, igroup;
} OmByteStream;
OmStatus om__stream_read(OmByteStream* s, void* out, size_t n);
// Inflate one zlib block to exactly out_size bytes.
OmStatus om__inflate(const void* data, size_t size, void* out, size_t out_size);
// Deflate into a block that the caller frees with om_free.
OmStatus om__deflate(const void* data, size_t size, unsigned char** out, size_t* out_size);

// ---- unit and space (shape_file_frame.c) -------------------------------------------------------------

#define OM_FRAME_WORDS 64
// Look for "SPACE=LPS" and "UNIT=mm" in a comment or title; the first ones count.
void om__read_statement(OmFileMesh* m, const char* text, size_t len);
void om__state_unit(OmFileMesh* m, double unit);
// "SPACE=RAS UNIT=mm"
void om__frame_words(OmMeshFrame frame, char out[OM_FRAME_WORDS]);
// Convert positions between RAS and LPS, in place.
void om__turn_points(double* x, int nvert);

// ---- formats --------------------------------------------------------------------------------------

typedef OmStatus OmParseFn(const char* data, size_t size, OmFileMesh* m);
OmParseFn om__parse_msh, om__parse_vtk, om__parse_vtu, om__parse_stl, om__parse_obj, om__parse_off,
    om__parse_ply, om__parse_vtp, om__parse_csv;
typedef enum OmFileKind { OM_FILE_TETS, OM_FILE_SURFACE, OM_FILE_CLOUD } OmFileKind;
// Read a file by the parser of its extension, if this kind has it.
OmStatus om__parse_file(const char* path, OmFileKind kind, OmFileMesh* m);
// Turn the positions (and normals) to RAS, in the unit of the file; returns the frame that was assumed.
OmMeshFrame om__place_points(OmFileMesh* m, OmMeshFrame given, OmMeshFrame* stated);
// Parse a file, or memory (for the fuzz targets), and build the mesh.
OmStatus om__finish_tet_mesh(const OmFileMesh* m, double unit, unsigned flags, OmTetMesh* mesh);
// What om__finish_tet_mesh, which must have succeeded, changed.
void om__count_changes(const OmFileMesh* m, double unit, unsigned flags, OmMeshReading* reading);
OmStatus om__finish_tet10_mesh(const OmFileMesh* m, double unit, unsigned flags, OmTet10Mesh* mesh);
// Nodes, labels and sets of the mesh as those of linear tetrahedra, without tet_vert; borrowed.
OmTetMesh om__tet10_view(const OmTet10Mesh* mesh);
OmStatus om__finish_surface(const OmFileMesh* m, double unit, unsigned flags, OmSurface* surface);

typedef struct OmMeshOutput {  // input of a writer
    const OmTetMesh* mesh;     // its tet_vert is not used
    const int* cell_node;      // nodes of the tetrahedra, of ten as in VTK  (ntet x ncell_node)
    int ncell_node;            // 4 or 10
    OmMeshFrame frame;         // frame of the file; the mesh is already in this space
    double scale;              // of positions: 1 / unit
    const OmMeshArray* array;
    int narray;
} OmMeshOutput;
// Gmsh counts the nodes of the edges 23 and 13 of a tetrahedron in this order, VTK the other way round.
static inline void om__swap_edges_of_msh(int node[10]) {
    int last = node[9];
    node[9] = node[8];
    node[8] = last;
}
// VTK's type of a tetrahedron of 4 or 10 nodes.
static inline unsigned char om__vtk_tetra(int nnode) { return nnode == 10 ? 24 : 10; }
OmStatus om__check_unit(const char* path, double unit);
// The format of a mesh by the extension.
OmStatus om__find_format(const char* path, OmMeshFormat* format);
OmStatus om__save_mesh(const OmMeshOutput* out, const char* path, OmMeshFormat format);
OmStatus om__write_msh(const OmMeshOutput* out, bool is_msh41, OmText* text);
OmStatus om__write_vtk(const OmMeshOutput* out, bool is_text, OmText* text);
OmStatus om__write_vtu(const OmMeshOutput* out, bool is_text, OmText* text);
OmStatus om__write_surface_vtk(const OmSurface* surface, OmMeshFrame frame, OmText* text);
OmStatus om__write_stl(const OmSurface* surface, OmMeshFrame frame, OmText* text);
OmStatus om__write_obj(const OmSurface* surface, OmMeshFrame frame, OmText* text);
OmStatus om__write_off(const OmSurface* surface, OmMeshFrame frame, OmText* text);
OmStatus om__write_ply(const OmSurface* surface, OmMeshFrame frame, OmText* text);
// Positions and normals of the cloud are already in this space.
OmStatus om__write_cloud_ply(const OmPointCloud* cloud, OmMeshFrame frame, OmText* text);
OmStatus om__write_cloud_vtp(const OmPointCloud* cloud, OmMeshFrame frame, OmText* text);
OmStatus om__write_cloud_csv(const OmPointCloud* cloud, OmMeshFrame frame, OmText* text);
// "x y z\n" with 17 digits each
OmStatus om__write_point(OmText* text, const double* x, double scale);
// Append values as text, ncomp per line.
OmStatus om__write_values(OmText* text, OmArrayType type, const void* value, size_t count,
                          int ncomp);
// Positions in the file's unit (nvert x 3); the caller frees with om_free.
double* om__scaled_points(const double* x, int nvert, double scale);
// 1 where a vertex is in the set (nvert)
void om__set_flags(const OmMeshSet* set, int nvert, unsigned char* flag);
size_t om__array_size(OmArrayType type);
OmStatus om__check_arrays(const OmMeshArray* array, int narray);

#endif
