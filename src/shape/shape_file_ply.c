// shape_file_ply.c: PLY, text and binary of both byte orders.
//
// The header describes elements and their properties; properties that are not needed are skipped by
// their declared size. Vertices need x, y, z; faces a list vertex_indices (or vertex_index).
//
// Reference: G. Turk, The PLY Polygon File Format (1994).
#include <string.h>

#include "shape/shape_file_internal.h"

enum { MAX_PROPERTY = 64, MAX_ELEMENT = 16, MAX_CORNER = 4096 };

typedef enum Use { USE_NONE, USE_X, USE_Y, USE_Z, USE_NX, USE_NY, USE_NZ, USE_CORNERS } Use;

typedef struct Property {
    OmValueType type, count_type;  // count_type is OM_VALUE_NONE unless it is a list
    Use use;
} Property;

typedef struct Element {
    bool is_vertex, is_face;
    int count, nproperty;
    Property property[MAX_PROPERTY];
} Element;

typedef struct Header {
    bool is_text, is_swapped;
    int nelement;
    Element element[MAX_ELEMENT];
} Header;

static OmStatus read_type(OmScan* s, OmValueType* type) {
    static const struct {
        const char *name, *other;
        OmValueType type;
    } table[] = {{"char", "int8", OM_VALUE_I8},      {"uchar", "uint8", OM_VALUE_U8},
                 {"short", "int16", OM_VALUE_I16},   {"ushort", "uint16", OM_VALUE_U16},
                 {"int", "int32", OM_VALUE_I32},     {"uint", "uint32", OM_VALUE_U32},
                 {"float", "float32", OM_VALUE_F32}, {"double", "float64", OM_VALUE_F64}};
    OmWord w = om__read_word(s);
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
        if (!om__is_word(w, table[i].name) && !om__is_word(w, table[i].other)) continue;
        *type = table[i].type;
        return OM_OK;
    }
    return om__scan_error(s, "\"%.*s\" is no type of a property", w.len < 40 ? (int)w.len : 40,
                          w.str);
}

static OmStatus read_format(OmScan* s, Header* h) {
    OmWord w = om__read_word(s);
    h->is_text = om__is_word(w, "ascii");
    bool is_little = om__is_word(w, "binary_little_endian"),
         is_big = om__is_word(w, "binary_big_endian");
    if (!h->is_text && !is_little && !is_big)
        return om__scan_error(s, "\"%.*s\" is no format of a PLY file",
                              w.len < 40 ? (int)w.len : 40, w.str);
    h->is_swapped = is_little != om__is_little();
    return OM_OK;
}

static OmStatus read_element(OmScan* s, Header* h) {
    if (h->nelement == MAX_ELEMENT) return om__scan_error(s, "more than %d elements", MAX_ELEMENT);
    Element* e = &h->element[h->nelement++];
    OmWord name = om__read_word(s);
    memset(e, 0, sizeof *e);
    e->is_vertex = om__is_word(name, "vertex");
    e->is_face = om__is_word(name, "face");
    return om__read_count(s, "the number of an element", 0, &e->count);
}

static OmStatus read_property(OmScan* s, Header* h) {
    if (h->nelement == 0) return om__scan_error(s, "a property before the first element");
    Element* e = &h->element[h->nelement - 1];
    if (e->nproperty == MAX_PROPERTY)
        return om__scan_error(s, "more than %d properties", MAX_PROPERTY);
    Property* p = &e->property[e->nproperty++];
    memset(p, 0, sizeof *p);
    OmScan before = *s;
    if (om__is_word(om__read_word(s), "list")) {
        OM_TRY(read_type(s, &p->count_type));
        if (p->count_type >= OM_VALUE_F32)
            return om__scan_error(s, "the length of a list is a real number");
    } else {
        *s = before;
    }
    OM_TRY(read_type(s, &p->type));
    OmWord name = om__read_word(s);
    bool is_list = p->count_type != OM_VALUE_NONE;
    if (e->is_vertex && !is_list && name.len == 1 && name.str[0] >= 'x' && name.str[0] <= 'z')
        p->use = (Use)(USE_X + (name.str[0] - 'x'));
    if (e->is_vertex && !is_list && name.len == 2 && name.str[0] == 'n' && name.str[1] >= 'x' &&
        name.str[1] <= 'z')
        p->use = (Use)(USE_NX + (name.str[1] - 'x'));
    if (e->is_face && is_list &&
        (om__is_word(name, "vertex_indices") || om__is_word(name, "vertex_index")))
        p->use = USE_CORNERS;
    return OM_OK;
}

static OmStatus read_header(OmScan* s, Header* h, OmFileMesh* m) {
    bool has_format = false;
    memset(h, 0, sizeof *h);
    OM_CHECK(om__is_word(om__read_word(s), "ply"), OM_INVALID,
             "the file does not begin with \"ply\"");
    for (;;) {
        OmWord w = om__read_word(s);
        if (om__is_word(w, "end_header")) break;
        if (w.len == 0) return om__scan_error(s, "the header has no end_header");
        if (om__is_word(w, "format")) {
            OM_TRY(read_format(s, h));
            has_format = true;
        } else if (om__is_word(w, "element")) {
            OM_TRY(read_element(s, h));
        } else if (om__is_word(w, "property")) {
            OM_TRY(read_property(s, h));
        } else if (om__is_word(w, "comment") || om__is_word(w, "obj_info")) {
            OmWord comment = om__read_line(s);
            om__read_statement(m, comment.str, comment.len);
            continue;
        } else {
            return om__scan_error(s, "\"%.*s\" does not belong into a header",
                                  w.len < 40 ? (int)w.len : 40, w.str);
        }
        om__skip_line(s);
    }
    om__skip_line(s);
    OM_CHECK(has_format, OM_INVALID, "the header has no line \"format\"");
    return OM_OK;
}

// ---- values -------------------------------------------------------------------------------------------------

static OmStatus read_value(OmScan* s, const Header* h, OmValueType type, double* v) {
    if (h->is_text) return om__read_double(s, "a property", v);
    const unsigned char* bytes = om__read_bytes(s, "a property", om__value_size(type));
    if (!bytes) return OM_INVALID;
    *v = om__load_real(type, bytes, h->is_swapped);
    return OM_OK;
}

static OmStatus read_list(OmScan* s, const Header* h, const Property* p, OmFileMesh* m) {
    int corner[MAX_CORNER];
    double n, v;
    OM_TRY(read_value(s, h, p->count_type, &n));
    OM_CHECK(n >= 0 && n <= (p->use == USE_CORNERS ? MAX_CORNER : 1e9) && floor(n) == n, OM_INVALID,
             "a list of %g entries", n);
    for (int i = 0; i < (int)n; i++) {
        OM_TRY(read_value(s, h, p->type, &v));
        if (p->use != USE_CORNERS) continue;
        OM_CHECK(v >= 0 && v < INT32_MAX && floor(v) == v, OM_INVALID, "face %d: %g is no vertex",
                 m->ntri + 1, v);
        corner[i] = (int)v;
    }
    return p->use == USE_CORNERS ? om__add_polygon(m, corner, (int)n) : OM_OK;
}

static OmStatus read_item(OmScan* s, const Header* h, const Element* e, OmFileMesh* m) {
    double x[6] = {0}, v;  // position and normal
    bool has_normal = false;
    for (int k = 0; k < e->nproperty; k++) {
        const Property* p = &e->property[k];
        if (p->count_type != OM_VALUE_NONE) {
            OM_TRY(read_list(s, h, p, m));
            continue;
        }
        OM_TRY(read_value(s, h, p->type, &v));
        if (p->use >= USE_X && p->use <= USE_NZ) x[p->use - USE_X] = v;
        has_normal |= p->use >= USE_NX && p->use <= USE_NZ;
    }
    if (!e->is_vertex) return OM_OK;
    OM_TRY(om__add_vert(m, x));
    return has_normal ? om__add_normal(m, x + 3) : OM_OK;
}

static OmStatus check_vertex(const Element* e) {
    int seen = 0;
    for (int k = 0; k < e->nproperty; k++)
        if (e->property[k].use >= USE_X && e->property[k].use <= USE_Z)
            seen |= 1 << e->property[k].use;
    OM_CHECK(seen == (1 << USE_X | 1 << USE_Y | 1 << USE_Z), OM_INVALID,
             "vertices need properties x, y and z");
    return OM_OK;
}

OmStatus om__parse_ply(const char* data, size_t size, OmFileMesh* m) {
    OmScan s = om__scan(data, size);
    Header h;
    OM_TRY(read_header(&s, &h, m));
    for (int i = 0; i < h.nelement; i++) {
        const Element* e = &h.element[i];
        if (e->is_vertex) OM_TRY(check_vertex(e));
        OM_CHECK(e->nproperty > 0 || e->count == 0, OM_INVALID, "an element without properties");
        for (int k = 0; k < e->count; k++) OM_TRY(read_item(&s, &h, e, m));
    }
    return OM_OK;
}

// ---- writing ------------------------------------------------------------------------------------------------

static void put_bits(unsigned char* out, uint64_t bits, int n) {
    for (int i = 0; i < n; i++) out[i] = (unsigned char)(bits >> 8 * i);
}

static OmStatus write_vector(OmText* text, const double* v, double scale) {
    unsigned char record[24];
    for (int c = 0; c < 3; c++) {
        double scaled = v[c] * scale;
        uint64_t bits;
        memcpy(&bits, &scaled, sizeof bits);
        put_bits(record + 8 * c, bits, 8);
    }
    return om_text_append_raw(text, (const char*)record, sizeof record);
}

OmStatus om__write_cloud_ply(const OmPointCloud* cloud, OmMeshFrame frame, OmText* text) {
    char words[OM_FRAME_WORDS];
    om__frame_words(frame, words);
    OM_TRY(om_text_append(
        text,
        "ply\nformat binary_little_endian 1.0\ncomment omentum %s\nelement vertex %d\n"
        "property double x\nproperty double y\nproperty double z\n%selement face %d\n"
        "property list uchar int vertex_indices\nend_header\n",
        words, cloud->npoint,
        cloud->normal ? "property double nx\nproperty double ny\nproperty double nz\n" : "",
        cloud->ntri));
    for (size_t i = 0; i < (size_t)cloud->npoint; i++) {
        OM_TRY(write_vector(text, cloud->x + 3 * i, 1 / frame.unit));
        if (cloud->normal) OM_TRY(write_vector(text, cloud->normal + 3 * i, 1));
    }
    for (int t = 0; t < cloud->ntri; t++) {
        unsigned char record[13] = {3};
        for (int c = 0; c < 3; c++)
            put_bits(record + 1 + 4 * c, (uint32_t)cloud->tri_vert[3 * (size_t)t + (size_t)c], 4);
        OM_TRY(om_text_append_raw(text, (const char*)record, sizeof record));
    }
    return OM_OK;
}

OmStatus om__write_ply(const OmSurface* surface, OmMeshFrame frame, OmText* text) {
    const OmPointCloud cloud = {.npoint = surface->nvert,
                                .ntri = surface->ntri,
                                .x = surface->x,
                                .tri_vert = surface->tri_vert};
    return om__write_cloud_ply(&cloud, frame, text);
}
