// shape_file_vtk_write.c: writing VTK's legacy files, version 3.0, which every reader knows.
//
// Labels are a cell array, sets point arrays of bytes; all arrays stand in a FIELD. Names are written with
// %20 for a blank, and other characters alike, as VTK does.
#include <string.h>

#include "shape/shape_file_internal.h"

// Big-endian, and a line end.
static OmStatus write_binary(OmText* text, OmArrayType type, const void* value, size_t count) {
    const unsigned char* from = value;
    size_t size = om__array_size(type);
    char chunk[4096];
    size_t at = 0;
    for (size_t i = 0; i < count; i++, from += size) {
        for (size_t b = 0; b < size; b++)
            chunk[at++] = (char)from[om__is_little() ? size - 1 - b : b];
        if (at + 8 > sizeof chunk || i + 1 == count) {
            OM_TRY(om_text_append_raw(text, chunk, at));
            at = 0;
        }
    }
    return om_text_append_raw(text, "\n", 1);
}

static OmStatus write_values(OmText* text, bool is_text, OmArrayType type, const void* value,
                             size_t count, int ncomp) {
    if (is_text) return om__write_values(text, type, value, count, ncomp);
    return write_binary(text, type, value, count);
}

static OmStatus write_name(OmText* text, const char* name) {
    for (const char* p = name; *p; p++) {
        unsigned char c = (unsigned char)*p;
        bool is_plain = c > ' ' && c < 0x7f && c != '"' && c != '%';
        OM_TRY(is_plain ? om_text_append_raw(text, p, 1) : om_text_append(text, "%%%02X", c));
    }
    return OM_OK;
}

static OmStatus write_array(OmText* text, bool is_text, const OmMeshArray* a, int nitem) {
    static const char* const type[] = {"double", "float", "int", "unsigned_char"};
    OM_TRY(write_name(text, a->name));
    OM_TRY(om_text_append(text, " %d %d %s\n", a->ncomp, nitem, type[a->type]));
    return write_values(text, is_text, a->type, a->value, (size_t)nitem * (size_t)a->ncomp,
                        a->ncomp);
}

// ---- meshes -----------------------------------------------------------------------------------------

// Lists that begin with their length.
static OmStatus write_lists(OmText* text, bool is_text, const int* vert, int nitem, int per_item) {
    int* list;
    size_t row = (size_t)per_item + 1;
    OM_ALLOC(list, row * (size_t)nitem);
    for (int i = 0; i < nitem; i++) {
        list[row * (size_t)i] = per_item;
        memcpy(list + row * (size_t)i + 1, vert + (size_t)per_item * (size_t)i,
               (size_t)per_item * sizeof *vert);
    }
    OmStatus status =
        write_values(text, is_text, OM_ARRAY_INT, list, row * (size_t)nitem, (int)row);
    om_free(list);
    return status;
}

static OmStatus write_cells(OmText* text, bool is_text, const OmMeshOutput* out) {
    const int n = out->mesh->ntet, nnode = out->ncell_node;
    OM_TRY(om_text_append(text, "CELLS %d %lld\n", n, (nnode + 1) * (long long)n));
    OM_TRY(write_lists(text, is_text, out->cell_node, n, nnode));
    int* type;
    OM_ALLOC(type, n);
    for (int e = 0; e < n; e++) type[e] = om__vtk_tetra(nnode);
    OmStatus status = om_text_append(text, "CELL_TYPES %d\n", n);
    if (status == OM_OK) status = write_values(text, is_text, OM_ARRAY_INT, type, (size_t)n, 20);
    om_free(type);
    return status;
}

static int count_arrays(const OmMeshOutput* out, bool is_cell) {
    int n = 0;
    for (int i = 0; i < out->narray; i++) n += out->array[i].is_cell == is_cell;
    return n;
}

static OmStatus write_data(OmText* text, bool is_text, const OmMeshOutput* out) {
    const OmTetMesh* mesh = out->mesh;
    const OmMeshArray label = {"tet_label", OM_ARRAY_INT, 1, true, mesh->tet_label};
    OmStatus status = OM_OK;
    int npoint = mesh->nset + count_arrays(out, false);
    unsigned char* flag = NULL;
    OM_ALLOC_DONE(flag, mesh->nvert);
    OM_TRY_DONE(om_text_append(text, "CELL_DATA %d\nFIELD FieldData %d\n", mesh->ntet,
                               1 + count_arrays(out, true)));
    OM_TRY_DONE(write_array(text, is_text, &label, mesh->ntet));
    for (int i = 0; i < out->narray; i++)
        if (out->array[i].is_cell)
            OM_TRY_DONE(write_array(text, is_text, &out->array[i], mesh->ntet));
    if (npoint == 0) goto done;
    OM_TRY_DONE(om_text_append(text, "POINT_DATA %d\nFIELD FieldData %d\n", mesh->nvert, npoint));
    for (int s = 0; s < mesh->nset; s++) {
        const OmMeshArray a = {mesh->set[s].name, OM_ARRAY_BYTE, 1, false, flag};
        om__set_flags(&mesh->set[s], mesh->nvert, flag);
        OM_TRY_DONE(write_array(text, is_text, &a, mesh->nvert));
    }
    for (int i = 0; i < out->narray; i++)
        if (!out->array[i].is_cell)
            OM_TRY_DONE(write_array(text, is_text, &out->array[i], mesh->nvert));
done:
    om_free(flag);
    return status;
}

static OmStatus write_head(OmText* text, bool is_text, OmMeshFrame frame, const char* dataset) {
    char words[OM_FRAME_WORDS];
    om__frame_words(frame, words);
    return om_text_append(text, "# vtk DataFile Version 3.0\nomentum %s\n%s\nDATASET %s\n", words,
                          is_text ? "ASCII" : "BINARY", dataset);
}

static OmStatus write_points(OmText* text, bool is_text, const double* x, int nvert, double scale) {
    OM_TRY(om_text_append(text, "POINTS %d double\n", nvert));
    double* scaled = om__scaled_points(x, nvert, scale);
    if (!scaled) return OM_NO_MEMORY;
    OmStatus status = write_values(text, is_text, OM_ARRAY_DOUBLE, scaled, 3 * (size_t)nvert, 3);
    om_free(scaled);
    return status;
}

OmStatus om__write_vtk(const OmMeshOutput* out, bool is_text, OmText* text) {
    OM_TRY(write_head(text, is_text, out->frame, "UNSTRUCTURED_GRID"));
    OM_TRY(write_points(text, is_text, out->mesh->x, out->mesh->nvert, out->scale));
    OM_TRY(write_cells(text, is_text, out));
    return write_data(text, is_text, out);
}

// ---- surfaces ---------------------------------------------------------------------------------------

OmStatus om__write_surface_vtk(const OmSurface* surface, OmMeshFrame frame, OmText* text) {
    OM_TRY(write_head(text, false, frame, "POLYDATA"));
    OM_TRY(write_points(text, false, surface->x, surface->nvert, 1 / frame.unit));
    OM_TRY(om_text_append(text, "POLYGONS %d %lld\n", surface->ntri, 4 * (long long)surface->ntri));
    return write_lists(text, false, surface->tri_vert, surface->ntri, 3);
}
