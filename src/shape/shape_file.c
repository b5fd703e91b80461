// shape_file.c: mesh and surface files: parser and writer chosen by the extension; checks of surfaces.
//
// A file is read whole, parsed from memory into growing arrays (shape_file_data.c), checked and turned
// into a mesh (shape_file_finish.c). A file is first written into memory and then saved in one operation.
#include <string.h>

#include "base/base_union.h"
#include "shape/shape_file_internal.h"

#define MAX_FILE ((size_t)1 << 34)

// ---- loading --------------------------------------------------------------------------------------------

typedef struct Reader {
    const char* ext;
    OmParseFn* parse;
    OmFileKind least;  // the file may be read as this kind and the later ones
} Reader;

static const Reader reader[] = {
    {"msh", om__parse_msh, OM_FILE_TETS},    {"vtk", om__parse_vtk, OM_FILE_TETS},
    {"vtu", om__parse_vtu, OM_FILE_TETS},    {"stl", om__parse_stl, OM_FILE_SURFACE},
    {"obj", om__parse_obj, OM_FILE_SURFACE}, {"ply", om__parse_ply, OM_FILE_SURFACE},
    {"off", om__parse_off, OM_FILE_SURFACE}, {"vtp", om__parse_vtp, OM_FILE_SURFACE},
    {"csv", om__parse_csv, OM_FILE_CLOUD},
};

OmStatus om__parse_file(const char* path, OmFileKind kind, OmFileMesh* m) {
    static const char* const what[] = {"mesh of tetrahedra", "surface", "point cloud"};
    static const char* const read[] = {".msh, .vtk and .vtu",
                                       ".stl, .obj, .ply, .off, .vtp, .msh, .vtk and .vtu",
                                       ".ply, .vtp, .csv, .stl, .obj, .off, .msh, .vtk and .vtu"};
    char ext[16];
    char* data = NULL;
    size_t size = 0;
    const Reader* found = NULL;
    memset(m, 0, sizeof *m);
    om_path_extension(path, ext, sizeof ext);
    for (size_t i = 0; i < sizeof reader / sizeof reader[0]; i++)
        if (strcmp(ext, reader[i].ext) == 0 && reader[i].least <= kind) found = &reader[i];
    OM_CHECK(found, OM_INVALID, "\"%s\" is not a %s by its name; %s are read", ext, what[kind],
             read[kind]);
    OM_TRY(om_file_read(path, MAX_FILE, &data, &size));
    OmStatus status = found->parse(data, size, m);
    om_free(data);
    if (status < 0) om__file_mesh_done(m);
    return status;
}

OmMeshFrame om__place_points(OmFileMesh* m, OmMeshFrame given, OmMeshFrame* stated) {
    OmMeshFrame frame = om_mesh_frame_join(given, m->stated);
    if (stated) *stated = m->stated;
    if (frame.space == OM_SPACE_LPS) om__turn_points(m->x, m->nvert);
    if (frame.space == OM_SPACE_LPS) om__turn_points(m->normal, m->nnormal);
    return frame;
}

OmStatus om_tet_mesh_load_reading(const char* path, OmMeshFrame given, unsigned flags,
                                  OmTetMesh* mesh, OmMeshReading* reading) {
    OmFileMesh m;
    memset(mesh, 0, sizeof *mesh);
    memset(reading, 0, sizeof *reading);
    OmStatus status = om__parse_file(path, OM_FILE_TETS, &m);
    if (status == OM_OK) {
        OmMeshFrame frame = om__place_points(&m, given, &reading->stated);
        status = om__finish_tet_mesh(&m, frame.unit, flags, mesh);
        if (status == OM_OK) om__count_changes(&m, frame.unit, flags, reading);
        om__file_mesh_done(&m);
    }
    return status < 0 && status != OM_IO ? om_error_prefix(status, "%s", path) : status;
}

OmStatus om_tet_mesh_load_frame(const char* path, OmMeshFrame given, unsigned flags,
                                OmTetMesh* mesh, OmMeshFrame* stated) {
    OmMeshReading reading;
    OmStatus status = om_tet_mesh_load_reading(path, given, flags, mesh, &reading);
    if (stated) *stated = reading.stated;
    if (status == OM_OK && reading.nmid > 0)
        om_log(OM_LOG_INFO, "%s: the vertices of tetrahedra of ten nodes are read, %s", path,
               flags & OM_MESH_STRAIGHTEN ? "the nodes on their edges are left out"
                                          : "the nodes on their edges are the midpoints");
    return status;
}

OmStatus om__check_unit(const char* path, double unit) {
    OM_CHECK(isfinite(unit) && unit > 0, OM_INVALID, "%s: unit: %g m is no length", path, unit);
    return OM_OK;
}

OmStatus om_tet_mesh_load_flags(const char* path, double unit, unsigned flags, OmTetMesh* mesh) {
    memset(mesh, 0, sizeof *mesh);
    OM_TRY(om__check_unit(path, unit));
    return om_tet_mesh_load_frame(path, (OmMeshFrame){unit, OM_SPACE_NONE}, flags, mesh, NULL);
}

OmStatus om_tet_mesh_load(const char* path, double unit, OmTetMesh* mesh) {
    return om_tet_mesh_load_flags(path, unit, 0, mesh);
}

OmStatus om_surface_load_frame(const char* path, OmMeshFrame given, unsigned flags,
                               OmSurface* surface, OmMeshFrame* stated) {
    OmFileMesh m;
    memset(surface, 0, sizeof *surface);
    OmStatus status = om__parse_file(path, OM_FILE_SURFACE, &m);
    if (status == OM_OK) {
        OmMeshFrame frame = om__place_points(&m, given, stated);
        status = om__finish_surface(&m, frame.unit, flags, surface);
        om__file_mesh_done(&m);
    }
    return status < 0 && status != OM_IO ? om_error_prefix(status, "%s", path) : status;
}

OmStatus om_surface_load_flags(const char* path, double unit, unsigned flags, OmSurface* surface) {
    memset(surface, 0, sizeof *surface);
    OM_TRY(om__check_unit(path, unit));
    return om_surface_load_frame(path, (OmMeshFrame){unit, OM_SPACE_NONE}, flags, surface, NULL);
}

OmStatus om_surface_load(const char* path, double unit, OmSurface* surface) {
    return om_surface_load_flags(path, unit, 0, surface);
}

// ---- saving ---------------------------------------------------------------------------------------------

size_t om__array_size(OmArrayType type) {
    static const size_t size[] = {sizeof(double), sizeof(float), sizeof(int), 1};
    return size[type];
}

OmStatus om__check_arrays(const OmMeshArray* array, int narray) {
    OM_CHECK(narray >= 0 && (narray == 0 || array), OM_INVALID, "%d arrays", narray);
    for (int i = 0; i < narray; i++) {
        const OmMeshArray* a = &array[i];
        OM_CHECK(a->name && a->name[0] && strlen(a->name) < OM_SET_NAME, OM_INVALID,
                 "array %d: its name must have 1 to %d letters", i, OM_SET_NAME - 1);
        OM_CHECK(!strpbrk(a->name, "\"<>&/ \n\t"), OM_INVALID,
                 "array \"%s\": blanks, quotes, slashes and brackets cannot stand in its name",
                 a->name);
        OM_CHECK(a->ncomp >= 1 && a->ncomp <= 9, OM_INVALID,
                 "array %s: %d components, 1 to 9 are written", a->name, a->ncomp);
        OM_CHECK((unsigned)a->type <= OM_ARRAY_BYTE, OM_INVALID, "array %s: type %d", a->name,
                 (int)a->type);
    }
    return OM_OK;
}

OmStatus om__write_point(OmText* text, const double* x, double scale) {
    char line[3 * OM_NUMBER_SIZE + 4];
    int n = 0;
    for (int c = 0; c < 3; c++) {
        n += om_number_write(line + n, x[c] * scale);
        line[n++] = c < 2 ? ' ' : '\n';
    }
    return om_text_append_raw(text, line, (size_t)n);
}

OmStatus om__write_values(OmText* text, OmArrayType type, const void* value, size_t count,
                          int ncomp) {
    for (size_t i = 0; i < count; i++) {
        char word[OM_NUMBER_SIZE + 1];
        int n;
        switch (type) {
        case OM_ARRAY_DOUBLE: n = om_number_write(word, ((const double*)value)[i]); break;
        case OM_ARRAY_FLOAT: n = om_number_write(word, (double)((const float*)value)[i]); break;
        case OM_ARRAY_INT: n = snprintf(word, sizeof word, "%d", ((const int*)value)[i]); break;
        default: n = snprintf(word, sizeof word, "%d", ((const unsigned char*)value)[i]); break;
        }
        word[n++] = (i + 1) % (size_t)ncomp && i + 1 < count ? ' ' : '\n';
        OM_TRY(om_text_append_raw(text, word, (size_t)n));
    }
    return OM_OK;
}

double* om__scaled_points(const double* x, int nvert, double scale) {
    double* scaled = om_alloc(3 * (size_t)nvert, sizeof *scaled);
    for (int i = 0; scaled && i < 3 * nvert; i++) scaled[i] = x[i] * scale;
    return scaled;
}

void om__set_flags(const OmMeshSet* set, int nvert, unsigned char* flag) {
    memset(flag, 0, (size_t)nvert);
    for (int i = 0; i < set->nvert; i++) flag[set->vert[i]] = 1;
}

OmStatus om__save_mesh(const OmMeshOutput* out, const char* path, OmMeshFormat format) {
    OmText text = {0};
    OmStatus status = OM_OK;
    OM_TRY(om__check_arrays(out->array, out->narray));
    for (int i = 0; i < out->narray; i++)
        OM_CHECK(out->array[i].value, OM_INVALID, "array %s: it has no values", out->array[i].name);
    switch (format) {
    case OM_MESH_VTU: status = om__write_vtu(out, false, &text); break;
    case OM_MESH_VTU_ASCII: status = om__write_vtu(out, true, &text); break;
    case OM_MESH_VTK: status = om__write_vtk(out, false, &text); break;
    case OM_MESH_VTK_ASCII: status = om__write_vtk(out, true, &text); break;
    case OM_MESH_MSH41: status = om__write_msh(out, true, &text); break;
    case OM_MESH_MSH22: status = om__write_msh(out, false, &text); break;
    default: status = om_error(OM_INVALID, "mesh format %d", (int)format);
    }
    if (status == OM_OK) status = om_file_write(path, text.str, text.len);
    om_text_done(&text);
    return status;
}

static OmStatus save_mesh(const OmTetMesh* mesh, const char* path, OmMeshFrame frame,
                          OmMeshFormat format, const OmMeshArray* array, int narray) {
    const OmMeshOutput out = {mesh, mesh->tet_vert, 4, frame, 1 / frame.unit, array, narray};
    return om__save_mesh(&out, path, format);
}

OmStatus om_tet_mesh_save_format(const OmTetMesh* mesh, const char* path, double unit,
                                 OmMeshFormat format, const OmMeshArray* array, int narray) {
    OM_TRY(om__check_unit(path, unit));
    OM_TRY(om_tet_mesh_validate(mesh));
    return save_mesh(mesh, path, (OmMeshFrame){unit, OM_SPACE_RAS}, format, array, narray);
}

// A copy of positions in LPS.
static double* turned_points(const double* x, int nvert) {
    double* turned = om__scaled_points(x, nvert, 1);
    if (turned) om__turn_points(turned, nvert);
    return turned;
}

OmStatus om__find_format(const char* path, OmMeshFormat* format) {
    static const struct {
        const char* ext;
        OmMeshFormat format;
    } table[] = {{"vtu", OM_MESH_VTU}, {"vtk", OM_MESH_VTK}, {"msh", OM_MESH_MSH41}};
    char ext[16];
    om_path_extension(path, ext, sizeof ext);
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
        if (strcmp(ext, table[i].ext) != 0) continue;
        *format = table[i].format;
        return OM_OK;
    }
    return om_error(OM_INVALID,
                    "%s: \"%s\" is no format of a mesh; .vtu, .vtk and .msh are written", path,
                    ext);
}

OmStatus om_tet_mesh_save_frame(const OmTetMesh* mesh, const char* path, OmMeshFrame frame) {
    OmMeshFormat format = OM_MESH_VTU;
    OM_TRY(om__find_format(path, &format));
    OM_TRY(om__check_unit(path, frame.unit));
    OM_TRY(om_tet_mesh_validate(mesh));
    OmTetMesh turned = *mesh;
    if (frame.space == OM_SPACE_LPS) {
        turned.x = turned_points(mesh->x, mesh->nvert);
        if (!turned.x) return OM_NO_MEMORY;
    }
    OmStatus status = save_mesh(&turned, path, frame, format, NULL, 0);
    if (frame.space == OM_SPACE_LPS) om_free(turned.x);
    return status;
}

OmStatus om_tet_mesh_save(const OmTetMesh* mesh, const char* path, double unit) {
    return om_tet_mesh_save_frame(mesh, path, (OmMeshFrame){unit, OM_SPACE_RAS});
}

OmStatus om_surface_save_frame(const OmSurface* surface, const char* path, OmMeshFrame frame) {
    typedef OmStatus WriteFn(const OmSurface*, OmMeshFrame, OmText*);
    static const struct {
        const char* ext;
        WriteFn* write;
    } table[] = {{"stl", om__write_stl},
                 {"obj", om__write_obj},
                 {"ply", om__write_ply},
                 {"off", om__write_off},
                 {"vtk", om__write_surface_vtk}};
    char ext[16];
    WriteFn* write = NULL;
    om_path_extension(path, ext, sizeof ext);
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++)
        if (strcmp(ext, table[i].ext) == 0) write = table[i].write;
    OM_CHECK(write, OM_INVALID,
             "%s: \"%s\" is no format of a surface; .stl, .obj, .ply, .off and .vtk are written",
             path, ext);
    OM_TRY(om__check_unit(path, frame.unit));
    OmText text = {0};
    OmSurface turned = *surface;
    if (frame.space == OM_SPACE_LPS) {
        turned.x = turned_points(surface->x, surface->nvert);
        if (!turned.x) return OM_NO_MEMORY;
    }
    OmStatus status = write(&turned, frame, &text);
    if (frame.space == OM_SPACE_LPS) om_free(turned.x);
    if (status == OM_OK) status = om_file_write(path, text.str, text.len);
    om_text_done(&text);
    return status;
}

OmStatus om_surface_save(const OmSurface* surface, const char* path, double unit) {
    return om_surface_save_frame(surface, path, (OmMeshFrame){unit, OM_SPACE_RAS});
}

// ---- checking -------------------------------------------------------------------------------------------

typedef struct Edge {  // chained by its smaller vertex
    int other, next;
    // triangles that use the edge from the smaller to the larger vertex, and back
    int nforward, nback;
    int tri;  // the first of them
} Edge;

static void add_edge(Edge* edge, int* nedge, int* head, int a, int b, int tri) {
    int lo = a < b ? a : b, hi = a < b ? b : a, e = head[lo];
    while (e >= 0 && edge[e].other != hi) e = edge[e].next;
    if (e < 0) {
        e = (*nedge)++;
        edge[e] = (Edge){hi, head[lo], 0, 0, tri};
        head[lo] = e;
    }
    if (a == lo)
        edge[e].nforward++;
    else
        edge[e].nback++;
}

static void count_edge(OmSurfaceCheck* check, int from, const Edge* e) {
    int n = e->nforward + e->nback;
    check->nopen_edge += n == 1;
    check->nmanifold_edge += n > 2;
    check->nflipped_edge += n == 2 && e->nforward != 1;
    bool is_bad = n != 2 || e->nforward != 1;
    if (is_bad && check->first_tri < 0) {
        check->first_edge[0] = from;
        check->first_edge[1] = e->other;
        check->first_tri = e->tri;
    }
}

OmStatus om_surface_check(const OmSurface* surface, OmSurfaceCheck* check) {
    OmStatus status = OM_OK;
    Edge* edge = NULL;
    int *head = NULL, *parent = NULL, nedge = 0, nused = 0;
    *check = (OmSurfaceCheck){.first_edge = {-1, -1}, .first_tri = -1};
    for (int i = 0; i < 3 * surface->ntri; i++)
        OM_CHECK(surface->tri_vert[i] >= 0 && surface->tri_vert[i] < surface->nvert, OM_INVALID,
                 "triangle %d names vertex %d of a surface of %d", i / 3, surface->tri_vert[i],
                 surface->nvert);
    OM_ALLOC_DONE(edge, 3 * (size_t)surface->ntri);
    OM_ALLOC_DONE(head, surface->nvert);
    OM_ALLOC_DONE(parent, surface->nvert);
    for (int i = 0; i < surface->nvert; i++) head[i] = parent[i] = -1;
    for (int t = 0; t < surface->ntri; t++) {
        const int* v = surface->tri_vert + 3 * (size_t)t;
        for (int c = 0; c < 3; c++) {
            if (parent[v[c]] < 0) {
                parent[v[c]] = v[c];
                nused++;
                check->ncomponent++;
            }
            add_edge(edge, &nedge, head, v[c], v[(c + 1) % 3], t);
        }
        for (int c = 1; c < 3; c++) {
            int a = om__find_root(parent, v[0]), b = om__find_root(parent, v[c]);
            if (a != b) check->ncomponent--;
            parent[a] = b;
        }
    }
    for (int i = 0; i < surface->nvert; i++)
        for (int e = head[i]; e >= 0; e = edge[e].next) count_edge(check, i, &edge[e]);
    check->neuler = nused - nedge + surface->ntri;
done:
    om_free(edge);
    om_free(head);
    om_free(parent);
    return status;
}

OmStatus om_surface_require_closed(const OmSurface* surface) {
    OmSurfaceCheck c;
    OM_TRY(om_surface_check(surface, &c));
    OM_CHECK(surface->ntri > 0, OM_INVALID, "the surface has no triangles");
    OM_CHECK(
        c.first_tri < 0, OM_INVALID,
        "the surface does not bound a volume: open edges %d, edges of three or more triangles %d, edges "
        "whose triangles disagree on the outside %d; the first joins vertices %d and %d of triangle %d",
        c.nopen_edge, c.nmanifold_edge, c.nflipped_edge, c.first_edge[0], c.first_edge[1],
        c.first_tri);
    return OM_OK;
}
