// shape_file_vtk.c: reading VTK's legacy files: unstructured grids and polygons, text and binary.
//
// A file is a list of keywords, each followed by its values. Values that are not needed must still be read
// to find the next keyword. Binary values are big-endian and begin on the line after the keyword. A cell
// is a list that begins with its length; from version 5 on there are offsets and one list of all corners.
//
// Reference: VTK file formats, "Simple legacy formats".
#include <limits.h>
#include <string.h>

#include "shape/shape_file_internal.h"

typedef struct Cells {
    int64_t* offset;  // first entry of each cell in corner, and the end of the last (ncell + 1)
    int* corner;
    int ncell;
} Cells;

typedef struct Vtk {
    OmScan s;
    OmFileMesh* m;
    bool is_text, is_v5, is_grid, has_types;
    Cells cells;    // of the grid
    int* tet_cell;  // the cell of each tetrahedron
    int tet_cellcap;
    int ndata;  // number of cells or points of the current CELL_DATA or POINT_DATA
    bool is_cell_data, is_point_data;
} Vtk;

typedef struct Values {  // destination of values; null: they are skipped
    double* real;
    int64_t* integer;
} Values;

static int shown(OmWord w) { return w.len < 40 ? (int)w.len : 40; }

// ---- values -----------------------------------------------------------------------------------------

typedef struct Type {
    const char* name;
    OmValueType type;
} Type;

static const Type type_table[] = {
    {"unsigned_char", OM_VALUE_U8},
    {"char", OM_VALUE_I8},
    {"signed_char", OM_VALUE_I8},
    {"unsigned_short", OM_VALUE_U16},
    {"short", OM_VALUE_I16},
    {"unsigned_int", OM_VALUE_U32},
    {"int", OM_VALUE_I32},
    {"unsigned_long", OM_VALUE_U64},
    {"long", OM_VALUE_I64},
    {"float", OM_VALUE_F32},
    {"double", OM_VALUE_F64},
    {"vtktypeint8", OM_VALUE_I8},
    {"vtktypeuint8", OM_VALUE_U8},
    {"vtktypeint16", OM_VALUE_I16},
    {"vtktypeuint16", OM_VALUE_U16},
    {"vtktypeint32", OM_VALUE_I32},
    {"vtktypeuint32", OM_VALUE_U32},
    {"vtktypeint64", OM_VALUE_I64},
    {"vtktypeuint64", OM_VALUE_U64},
    {"vtktypefloat32", OM_VALUE_F32},
    {"vtktypefloat64", OM_VALUE_F64},
    {"vtkidtype", OM_VALUE_I32},  // written with 32 bits
    {"bit", OM_VALUE_NONE},       // eight to a byte; only skipped
};

static OmStatus read_type(Vtk* v, OmValueType* type) {
    OmWord w = om__read_word(&v->s);
    *type = OM_VALUE_NONE;
    for (size_t i = 0; i < sizeof type_table / sizeof type_table[0]; i++) {
        if (!om__is_word_nocase(w, type_table[i].name)) continue;
        *type = type_table[i].type;
        return OM_OK;
    }
    return om__scan_error(&v->s, "values of type \"%.*s\" are not read", shown(w), w.str);
}

static OmStatus read_text(Vtk* v, int64_t count, Values out) {
    for (int64_t i = 0; i < count; i++) {
        if (out.real)
            OM_TRY(om__read_double(&v->s, "a value", &out.real[i]));
        else if (out.integer)
            OM_TRY(om__read_int(&v->s, "a value", INT64_MIN, INT64_MAX, &out.integer[i]));
        else if (om__read_word(&v->s).len == 0)
            return om__scan_error(&v->s, "the file ends within its values");
    }
    return OM_OK;
}

// The count was checked with check_values.
static OmStatus read_values(Vtk* v, OmValueType type, int64_t count, Values out) {
    if (v->is_text) return read_text(v, count, out);
    om__skip_line(&v->s);
    size_t size = om__value_size(type), n = (size_t)count;
    const unsigned char* bytes =
        om__read_bytes(&v->s, "values", type == OM_VALUE_NONE ? (n + 7) / 8 : n * size);
    if (!bytes) return OM_INVALID;
    bool is_swapped = om__is_little();
    for (size_t i = 0; i < n && type != OM_VALUE_NONE; i++) {
        if (out.real) out.real[i] = om__load_real(type, bytes + i * size, is_swapped);
        if (out.integer) out.integer[i] = om__load_integer(type, bytes + i * size, is_swapped);
    }
    return OM_OK;
}

static OmStatus check_values(Vtk* v, const char* what, OmValueType type, int64_t count) {
    size_t min = v->is_text ? 2 : type == OM_VALUE_NONE ? 0 : om__value_size(type);
    return om__check_count(&v->s, what, count, min);
}

static OmStatus read_integers(Vtk* v, const char* what, OmValueType type, int64_t count,
                              int64_t** out) {
    *out = NULL;
    OM_TRY(check_values(v, what, type, count));
    int64_t* value = om_alloc((size_t)count, sizeof *value);
    if (!value) return OM_NO_MEMORY;
    OmStatus status = read_values(v, type, count, (Values){.integer = value});
    if (status < 0)
        om_free(value);
    else
        *out = value;
    return status;
}

// ---- points and cells -------------------------------------------------------------------------------

static OmStatus read_points(Vtk* v) {
    OmValueType type;
    int64_t count;
    OM_CHECK(v->m->nvert == 0, OM_INVALID, "line %d: POINTS come twice", om__scan_line(&v->s));
    OM_TRY(om__read_int(&v->s, "the number of points", 0, INT_MAX / 4, &count));
    OM_TRY(read_type(v, &type));
    OM_TRY(check_values(v, "coordinates", type, 3 * count));
    double* x = om_alloc(3 * (size_t)count, sizeof *x);
    if (!x) return OM_NO_MEMORY;
    OmStatus status = read_values(v, type, 3 * count, (Values){.real = x});
    for (int64_t i = 0; i < count && status == OM_OK; i++) status = om__add_vert(v->m, x + 3 * i);
    om_free(x);
    return status;
}

static void cells_done(Cells* c) {
    om_free(c->offset);
    om_free(c->corner);
    memset(c, 0, sizeof *c);
}

static OmStatus take_corner(int64_t value, int* corner) {
    OM_CHECK(value >= 0 && value < INT_MAX, OM_INVALID, "a cell names vertex %lld",
             (long long)value);
    *corner = (int)value;
    return OM_OK;
}

// "3 a b c  4 a b c d ..."
static OmStatus read_listed_cells(Vtk* v, int64_t ncell, int64_t size, Cells* c) {
    OmStatus status = OM_OK;
    int64_t* list;
    int64_t at = 0, n = 0;
    OM_TRY(read_integers(v, "entries of cells", OM_VALUE_I32, size, &list));
    OM_CHECK_DONE(ncell <= size, OM_INVALID, "%lld cells in %lld entries", (long long)ncell,
                  (long long)size);
    OM_ALLOC_DONE(c->offset, ncell + 1);
    OM_ALLOC_DONE(c->corner, size);
    for (int i = 0; i < ncell; i++) {
        OM_CHECK_DONE(at < size && list[at] >= 0 && list[at] < size - at, OM_INVALID,
                      "cell %d has more corners than the list of cells", i);
        int64_t end = at + 1 + list[at];
        c->offset[i] = n;
        for (at++; at < end; at++) OM_TRY_DONE(take_corner(list[at], &c->corner[n++]));
    }
    c->offset[ncell] = n;
    c->ncell = (int)ncell;
done:
    om_free(list);
    return status;
}

// Version 5: OFFSETS type, values; CONNECTIVITY type, values.
static OmStatus read_offset_cells(Vtk* v, int64_t noffset, int64_t ncorner, Cells* c) {
    OmStatus status = OM_OK;
    OmValueType type;
    int64_t* list = NULL;
    if (!om__is_word_nocase(om__read_word(&v->s), "OFFSETS"))
        return om__scan_error(&v->s, "OFFSETS are wanted");
    OM_TRY(read_type(v, &type));
    OM_TRY_DONE(read_integers(v, "offsets", type, noffset, &c->offset));
    if (!om__is_word_nocase(om__read_word(&v->s), "CONNECTIVITY")) {
        status = om__scan_error(&v->s, "CONNECTIVITY is wanted");
        goto done;
    }
    OM_TRY_DONE(read_type(v, &type));
    OM_TRY_DONE(read_integers(v, "corners", type, ncorner, &list));
    OM_ALLOC_DONE(c->corner, ncorner);
    for (int64_t i = 0; i < ncorner; i++) OM_TRY_DONE(take_corner(list[i], &c->corner[i]));
    for (int64_t i = 0; i < noffset; i++)
        OM_CHECK_DONE(c->offset[i] >= (i ? c->offset[i - 1] : 0) && c->offset[i] <= ncorner,
                      OM_INVALID, "offset %lld of the cells is %lld", (long long)i,
                      (long long)c->offset[i]);
    c->ncell = noffset > 0 ? (int)noffset - 1 : 0;
done:
    om_free(list);
    return status;
}

static OmStatus read_cells(Vtk* v, Cells* c) {
    int64_t n, size;
    OM_TRY(om__read_int(&v->s, "the number of cells", 0, INT_MAX / 4, &n));
    OM_TRY(om__read_int(&v->s, "the size of the cells", 0, INT_MAX / 4, &size));
    OmStatus status =
        v->is_v5 ? read_offset_cells(v, n, size, c) : read_listed_cells(v, n, size, c);
    if (status < 0) cells_done(c);
    return status;
}

// All cells of one kind: polygons, strips.
static OmStatus read_faces(Vtk* v, int vtk_type) {
    Cells c = {0};
    bool is_tet;
    OM_TRY(read_cells(v, &c));
    OmStatus status = OM_OK;
    for (int i = 0; i < c.ncell && status == OM_OK && vtk_type; i++)
        status = om__add_vtk_cell(v->m, vtk_type, c.corner + c.offset[i],
                                  (int)(c.offset[i + 1] - c.offset[i]), &is_tet);
    cells_done(&c);
    return status;
}

static OmStatus take_cell(Vtk* v, int cell, int64_t type) {
    const Cells* c = &v->cells;
    bool is_tet;
    OmStatus status =
        om__add_vtk_cell(v->m, type >= 0 && type < 256 ? (int)type : 0, c->corner + c->offset[cell],
                         (int)(c->offset[cell + 1] - c->offset[cell]), &is_tet);
    if (status < 0) return om_error_prefix(status, "cell %d", cell);
    if (!is_tet) return OM_OK;
    OM_TRY(om__grow(&v->tet_cell, &v->tet_cellcap, v->m->ntet, sizeof(int)));
    v->tet_cell[v->m->ntet - 1] = cell;
    return OM_OK;
}

static OmStatus read_cell_types(Vtk* v) {
    int64_t n, *type;
    OM_TRY(om__read_int(&v->s, "the number of types", 0, INT_MAX / 4, &n));
    OM_CHECK(!v->has_types && n == v->cells.ncell, OM_INVALID, "line %d: %lld types of %d cells",
             om__scan_line(&v->s), (long long)n, v->cells.ncell);
    OM_TRY(read_integers(v, "types of cells", OM_VALUE_I32, n, &type));
    OmStatus status = OM_OK;
    for (int i = 0; i < n && status == OM_OK; i++) status = take_cell(v, i, type[i]);
    om_free(type);
    v->has_types = true;
    return status;
}

// ---- arrays -----------------------------------------------------------------------------------------

// VTK writes names with %20 for a blank, and other characters alike.
static size_t decode_name(OmWord w, char out[OM_SET_NAME]) {
    size_t n = 0;
    for (size_t i = 0; i < w.len; i++) {
        int c = (unsigned char)w.str[i], value = 0;
        for (size_t k = 1; c == '%' && k <= 2 && i + k < w.len; k++) {
            char h = w.str[i + k];
            int digit = h >= '0' && h <= '9'   ? h - '0'
                        : h >= 'A' && h <= 'F' ? h - 'A' + 10
                        : h >= 'a' && h <= 'f' ? h - 'a' + 10
                                               : -1;
            if (digit < 0) break;
            value = 16 * value + digit;
            if (k == 2) {
                c = value;
                i += 2;
            }
        }
        if (n + 1 >= OM_SET_NAME) return 0;
        out[n++] = (char)c;
    }
    return n;
}

static OmStatus take_labels(Vtk* v, const int64_t* value) {
    OmFileMesh* m = v->m;
    OM_CHECK(v->ndata == v->cells.ncell, OM_INVALID, "%d labels of %d cells", v->ndata,
             v->cells.ncell);
    OM_TRY(om__grow(&m->label, &m->labelcap, m->ntet, sizeof(int)));
    for (int e = 0; e < m->ntet; e++) {
        int64_t label = value[v->tet_cell[e]];
        OM_CHECK(label >= INT_MIN && label <= INT_MAX, OM_INVALID,
                 "the label of cell %d is no integer of 32 bits", v->tet_cell[e]);
        m->label[e] = (int)label;
    }
    m->nlabel = m->ntet;
    return OM_OK;
}

static OmStatus read_array(Vtk* v, OmWord name, OmValueType type, int64_t ncomp, int64_t ntuple) {
    char set[OM_SET_NAME];
    size_t len = decode_name(name, set);
    OM_CHECK(ncomp >= 0 && ncomp <= INT_MAX / 4, OM_INVALID, "an array of %lld components",
             (long long)ncomp);
    int64_t count = ncomp * ntuple, *value;
    bool is_label = v->is_cell_data && v->is_grid && om__is_word(name, "tet_label");
    bool is_flags = v->is_point_data && (type == OM_VALUE_U8 || type == OM_VALUE_I8);
    if (ncomp != 1 || ntuple != v->ndata || (!is_label && !is_flags)) {
        OM_TRY(check_values(v, "values", type, count));
        return read_values(v, type, count, (Values){0});
    }
    OM_TRY(read_integers(v, "values", type, count, &value));
    OmStatus status = OM_OK;
    if (is_label)
        status = take_labels(v, value);
    else if (v->ndata == v->m->nvert)
        status = om__add_point_flags(v->m, set, len, 0, value, v->ndata);
    om_free(value);
    return status;
}

// METADATA: skip to the next empty line.
static void skip_metadata(Vtk* v) {
    om__skip_line(&v->s);
    while (om__scan_left(&v->s) && om__read_line(&v->s).len > 0) continue;
}

// FIELD name n, then n times: name ncomp ntuple type values
static OmStatus read_field(Vtk* v) {
    int64_t narray, ncomp, ntuple;
    OmValueType type;
    om__read_word(&v->s);
    OM_TRY(om__read_int(&v->s, "the number of arrays", 0, INT_MAX, &narray));
    for (int64_t i = 0; i < narray; i++) {
        OmWord name = om__read_word(&v->s);
        if (om__is_word(name, "METADATA")) {
            skip_metadata(v);
            name = om__read_word(&v->s);
        }
        if (om__is_word(name, "NULL_ARRAY")) continue;
        OM_TRY(om__read_int(&v->s, "the components of an array", 0, INT_MAX / 4, &ncomp));
        OM_TRY(om__read_int(&v->s, "the tuples of an array", 0, INT_MAX / 4, &ntuple));
        OM_TRY(read_type(v, &type));
        OM_TRY(read_array(v, name, type, ncomp, ntuple));
    }
    return OM_OK;
}

// SCALARS name type [ncomp], and a line LOOKUP_TABLE name
static OmStatus read_scalars(Vtk* v) {
    OmValueType type;
    int64_t ncomp = 1;
    OmWord name = om__read_word(&v->s);
    OM_TRY(read_type(v, &type));
    if (!om__at_line_end(&v->s))
        OM_TRY(om__read_int(&v->s, "the components of scalars", 1, 4, &ncomp));
    OmScan before = v->s;
    if (om__is_word_nocase(om__read_word(&v->s), "LOOKUP_TABLE"))
        om__read_word(&v->s);
    else
        v->s = before;
    return read_array(v, name, type, ncomp, v->ndata);
}

static OmStatus read_vectors(Vtk* v, int64_t ncomp) {
    OmValueType type;
    OmWord name = om__read_word(&v->s);
    OM_TRY(read_type(v, &type));
    return read_array(v, name, type, ncomp, v->ndata);
}

// TEXTURE_COORDINATES name dim type; COLOR_SCALARS name n and LOOKUP_TABLE name size have no type:
// bytes in binary files.
static OmStatus read_counted(Vtk* v, bool has_type, bool is_table) {
    OmValueType type = OM_VALUE_U8;
    int64_t n;
    OmWord name = om__read_word(&v->s);
    OM_TRY(om__read_int(&v->s, "the components of an array", 0, INT_MAX / 16, &n));
    if (has_type) OM_TRY(read_type(v, &type));
    if (!is_table) return read_array(v, (OmWord){name.str, 0}, type, n, v->ndata);
    OM_TRY(check_values(v, "colours", type, 4 * n));
    return read_values(v, type, 4 * n, (Values){0});
}

static OmStatus begin_data(Vtk* v, bool is_cell) {
    int64_t n;
    OM_TRY(om__read_int(&v->s, "the number of tuples", 0, INT_MAX / 4, &n));
    v->ndata = (int)n;
    v->is_cell_data = is_cell;
    v->is_point_data = !is_cell;
    return OM_OK;
}

// ---- the file ---------------------------------------------------------------------------------------

static OmStatus read_head(Vtk* v) {
    static const char magic[] = "# vtk DataFile Version ";
    double version;
    OmWord line = om__read_line(&v->s);
    OM_CHECK(line.len >= sizeof magic && memcmp(line.str, magic, sizeof magic - 1) == 0, OM_INVALID,
             "this is no VTK legacy file: it does not begin with \"%.22s\"", magic);
    const char* number = line.str + sizeof magic - 1;
    OM_CHECK(om_number_parse(&number, line.str + line.len, &version), OM_INVALID,
             "line 1: the version is no number");
    v->is_v5 = version >= 5;
    OmWord title = om__read_line(&v->s);
    om__read_statement(v->m, title.str, title.len);
    OmWord form = om__read_word(&v->s);
    v->is_text = om__is_word_nocase(form, "ASCII");
    if (!v->is_text && !om__is_word_nocase(form, "BINARY"))
        return om__scan_error(&v->s, "ASCII or BINARY is wanted, not \"%.*s\"", shown(form),
                              form.str);
    return OM_OK;
}

static OmStatus read_dataset(Vtk* v) {
    OmWord w = om__read_word(&v->s);
    v->is_grid = om__is_word_nocase(w, "UNSTRUCTURED_GRID");
    if (v->is_grid || om__is_word_nocase(w, "POLYDATA")) return OM_OK;
    return om__scan_error(&v->s, "DATASET \"%.*s\" is not read; UNSTRUCTURED_GRID and POLYDATA are",
                          shown(w), w.str);
}

static OmStatus read_grid_cells(Vtk* v) {
    OM_CHECK(!v->cells.offset, OM_INVALID, "line %d: CELLS come twice", om__scan_line(&v->s));
    return read_cells(v, &v->cells);
}

static OmStatus read_keyword(Vtk* v, OmWord w) {
    enum { STRIP = 6, POLYGON = 7 };
    if (om__is_word_nocase(w, "DATASET")) return read_dataset(v);
    if (om__is_word_nocase(w, "POINTS")) return read_points(v);
    if (om__is_word_nocase(w, "CELLS")) return read_grid_cells(v);
    if (om__is_word_nocase(w, "CELL_TYPES")) return read_cell_types(v);
    if (om__is_word_nocase(w, "POLYGONS")) return read_faces(v, POLYGON);
    if (om__is_word_nocase(w, "TRIANGLE_STRIPS")) return read_faces(v, STRIP);
    if (om__is_word_nocase(w, "VERTICES") || om__is_word_nocase(w, "LINES"))
        return read_faces(v, 0);
    if (om__is_word_nocase(w, "CELL_DATA")) return begin_data(v, true);
    if (om__is_word_nocase(w, "POINT_DATA")) return begin_data(v, false);
    if (om__is_word_nocase(w, "FIELD")) return read_field(v);
    if (om__is_word_nocase(w, "SCALARS")) return read_scalars(v);
    if (om__is_word_nocase(w, "VECTORS") || om__is_word_nocase(w, "NORMALS"))
        return read_vectors(v, 3);
    if (om__is_word_nocase(w, "TENSORS")) return read_vectors(v, 9);
    if (om__is_word_nocase(w, "TENSORS6")) return read_vectors(v, 6);
    if (om__is_word_nocase(w, "GLOBAL_IDS") || om__is_word_nocase(w, "PEDIGREE_IDS"))
        return read_vectors(v, 1);
    if (om__is_word_nocase(w, "TEXTURE_COORDINATES")) return read_counted(v, true, false);
    if (om__is_word_nocase(w, "COLOR_SCALARS")) return read_counted(v, false, false);
    if (om__is_word_nocase(w, "LOOKUP_TABLE")) return read_counted(v, false, true);
    if (om__is_word_nocase(w, "METADATA")) {
        skip_metadata(v);
        return OM_OK;
    }
    return om__scan_error(&v->s, "keyword \"%.*s\" is not known", shown(w), w.str);
}

OmStatus om__parse_vtk(const char* data, size_t size, OmFileMesh* m) {
    Vtk v = {.s = om__scan(data, size), .m = m};
    OmStatus status = read_head(&v);
    while (status == OM_OK) {
        OmWord w = om__read_word(&v.s);
        if (w.len == 0) break;
        status = read_keyword(&v, w);
    }
    if (status == OM_OK && v.cells.ncell > 0 && !v.has_types)
        status = om_error(OM_INVALID, "the file has cells but no CELL_TYPES: it is cut short");
    cells_done(&v.cells);
    om_free(v.tet_cell);
    return status;
}
