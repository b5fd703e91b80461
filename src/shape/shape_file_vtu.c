// shape_file_vtu.c: reading VTK's XML files of unstructured grids (.vtu) and of surfaces and clouds (.vtp).
//
// The parser understands only the XML that such files use: tags with quoted attributes, comments, and
// text without tags. The arrays of a piece may come in any order, so a piece is first listed (position
// and type of each array) and decoded at its end. Arrays are text, base64 in place, or stand after the
// last tag (AppendedData, raw or base64). Each begins with its length or, compressed by zlib, with the
// table of its blocks:
//
//     [bytes] data                                                 in words of header_type
//     [blocks][block size][last size or 0][packed size ...] packed blocks
//
// Reference: VTK file formats, "XML file formats".
#include <limits.h>
#include <string.h>

#include "shape/shape_file_internal.h"

#define MAX_PACKING 1032  // zlib cannot pack tighter (1:1032)
#define MAX_FLAGS 256     // point arrays of bytes in one piece

typedef struct Tag {
    OmWord name;
    const char *attr, *attr_end;  // text of the attributes
    bool is_end, is_empty;        // </a>, <a/>
} Tag;

typedef struct Array {  // where a DataArray is
    OmWord name, type, format;
    int64_t ncomp, offset;
    const char* content;  // text after the tag
} Array;

typedef struct Piece {
    bool is_open;
    int npoint, ncell, nstrip;
    Array strip_connectivity, strip_offsets, normals;   // of .vtp
    Array points, connectivity, offsets, types, label;  // content is null if it is missing
    Array flags[MAX_FLAGS];
    int nflags;
} Piece;

typedef struct Vtu {
    OmScan s;
    bool is_poly;  // .vtp: cells are polygons and strips, without types
    bool is_swapped, is_compressed;
    OmValueType header_type;
    const char* appended;  // first byte after the underscore, null if there is none
    bool is_appended_base64;
    Piece piece;
} Vtu;

// ---- tags -------------------------------------------------------------------------------------------

static bool skip_past(OmScan* s, const char* str) {
    size_t len = strlen(str);
    for (; om__scan_left(s) >= len; s->p++) {
        if (memcmp(s->p, str, len) == 0) {
            s->p += len;
            return true;
        }
    }
    s->p = s->end;
    return false;
}

static bool is_name_char(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == ':' || c == '.';
}

// Find the next tag; text before it is skipped. False at the end of the file or in a damaged tag.
static bool next_tag(OmScan* s, Tag* tag) {
    for (;;) {
        const char* open = om__scan_left(s) ? memchr(s->p, '<', om__scan_left(s)) : NULL;
        if (!open) return false;
        s->p = open + 1;
        if (om__scan_left(s) >= 3 && memcmp(s->p, "!--", 3) == 0) {
            if (!skip_past(s, "-->")) return false;
        } else if (om__scan_left(s) && (*s->p == '?' || *s->p == '!')) {
            if (!skip_past(s, ">")) return false;
        } else {
            break;
        }
    }
    memset(tag, 0, sizeof *tag);
    if (om__scan_left(s) && *s->p == '/') {
        tag->is_end = true;
        s->p++;
    }
    tag->name.str = s->p;
    while (om__scan_left(s) && is_name_char(*s->p)) s->p++;
    tag->name.len = (size_t)(s->p - tag->name.str);
    tag->attr = s->p;
    char quote = 0;
    for (; om__scan_left(s); s->p++) {
        if (quote) {
            if (*s->p == quote) quote = 0;
        } else if (*s->p == '"' || *s->p == '\'') {
            quote = *s->p;
        } else if (*s->p == '>') {
            break;
        }
    }
    if (!om__scan_left(s)) return false;
    tag->attr_end = s->p;
    tag->is_empty = s->p > tag->attr && s->p[-1] == '/';
    s->p++;
    return true;
}

static bool find_attr(const Tag* tag, const char* name, OmWord* value) {
    OmScan s = om__scan(tag->attr, (size_t)(tag->attr_end - tag->attr));
    for (;;) {
        om__skip_blank(&s);
        OmWord key = {s.p, 0};
        while (om__scan_left(&s) && is_name_char(*s.p)) s.p++;
        key.len = (size_t)(s.p - key.str);
        om__skip_blank(&s);
        if (key.len == 0 || !om__scan_left(&s) || *s.p != '=') break;
        s.p++;
        om__skip_blank(&s);
        if (!om__scan_left(&s) || (*s.p != '"' && *s.p != '\'')) break;
        char quote = *s.p++;
        const char* close = om__scan_left(&s) ? memchr(s.p, quote, om__scan_left(&s)) : NULL;
        if (!close) break;
        *value = (OmWord){s.p, (size_t)(close - s.p)};
        s.p = close + 1;
        if (om__is_word(key, name)) return true;
    }
    *value = (OmWord){"", 0};
    return false;
}

static int shown(OmWord w) { return w.len < 40 ? (int)w.len : 40; }

static OmStatus attr_integer(const Vtu* v, const Tag* tag, const char* name, int64_t fallback,
                             int64_t* value) {
    OmWord w;
    *value = fallback;
    if (!find_attr(tag, name, &w)) return OM_OK;
    OmScan s = om__scan(w.str, w.len);
    om__skip_blank(&s);
    if (om_integer_parse(&s.p, s.end, value) && om__at_line_end(&s)) return OM_OK;
    return om__scan_error(&v->s, "attribute %s: a whole number is wanted, not \"%.*s\"", name,
                          shown(w), w.str);
}

// Resolve &amp; and other entities of a name; returns its length, 0 if it does not fit.
static size_t unescape(OmWord w, char out[OM_SET_NAME]) {
    static const struct {
        const char* name;
        char c;
    } table[] = {{"&amp;", '&'},  {"&lt;", '<'},   {"&gt;", '>'},
                 {"&quot;", '"'}, {"&#39;", '\''}, {"&apos;", '\''}};
    size_t n = 0;
    for (size_t i = 0; i < w.len;) {
        size_t used = 1;
        char c = w.str[i];
        for (size_t k = 0; c == '&' && k < sizeof table / sizeof table[0]; k++) {
            size_t len = strlen(table[k].name);
            if (w.len - i < len || memcmp(w.str + i, table[k].name, len) != 0) continue;
            c = table[k].c;
            used = len;
            break;
        }
        if (n + 1 >= OM_SET_NAME) return 0;
        out[n++] = c;
        i += used;
    }
    return n;
}

// ---- arrays -----------------------------------------------------------------------------------------

static OmValueType type_of(OmWord w) {
    static const char* const name[] = {"",       "Int8",  "UInt8",  "Int16",   "UInt16", "Int32",
                                       "UInt32", "Int64", "UInt64", "Float32", "Float64"};
    for (size_t i = 1; i < sizeof name / sizeof name[0]; i++)
        if (om__is_word(w, name[i])) return (OmValueType)i;
    return OM_VALUE_NONE;
}

static OmStatus read_header_word(const Vtu* v, OmByteStream* b, uint64_t* word) {
    unsigned char bytes[8];
    OM_TRY(om__stream_read(b, bytes, om__value_size(v->header_type)));
    *word = (uint64_t)om__load_integer(v->header_type, bytes, v->is_swapped);
    return OM_OK;
}

static OmStatus read_plain(const Vtu* v, OmByteStream* b, uint64_t size, unsigned char** out) {
    uint64_t stated;
    OM_TRY(read_header_word(v, b, &stated));
    OM_CHECK(stated == size, OM_INVALID, "it states %llu bytes, %llu are wanted",
             (unsigned long long)stated, (unsigned long long)size);
    OM_CHECK(size <= (size_t)(b->end - b->p) + 2, OM_INVALID,
             "it has %llu bytes, the file ends before", (unsigned long long)size);
    *out = om_alloc(size, 1);
    return *out ? om__stream_read(b, *out, size) : OM_NO_MEMORY;
}

static OmStatus inflate_blocks(OmByteStream* b, const uint64_t* packed, uint64_t nblock,
                               uint64_t block, uint64_t size, unsigned char* out) {
    OmStatus status = OM_OK;
    for (uint64_t i = 0; i < nblock && status == OM_OK; i++) {
        uint64_t wanted = i + 1 < nblock ? block : size - (nblock - 1) * block;
        OM_CHECK(packed[i] <= (size_t)(b->end - b->p) + 2, OM_INVALID,
                 "block %llu has %llu bytes, the file ends before", (unsigned long long)i + 1,
                 (unsigned long long)packed[i]);
        unsigned char* bytes = om_alloc(packed[i], 1);
        if (!bytes) return OM_NO_MEMORY;
        status = om__stream_read(b, bytes, packed[i]);
        if (status == OM_OK) status = om__inflate(bytes, packed[i], out + i * block, wanted);
        om_free(bytes);
    }
    return status;
}

static OmStatus read_compressed(const Vtu* v, OmByteStream* b, uint64_t size, unsigned char** out) {
    uint64_t nblock, block, last, left = (uint64_t)(b->end - b->p);
    OM_TRY(read_header_word(v, b, &nblock));
    OM_TRY(read_header_word(v, b, &block));
    OM_TRY(read_header_word(v, b, &last));
    OM_CHECK(nblock <= left && block <= INT_MAX && last <= block, OM_INVALID,
             "the table of its compressed blocks is damaged");
    uint64_t stated = nblock == 0 ? 0 : last ? (nblock - 1) * block + last : nblock * block;
    OM_CHECK(stated == size, OM_INVALID, "it states %llu bytes, %llu are wanted",
             (unsigned long long)stated, (unsigned long long)size);
    OM_CHECK(size / MAX_PACKING <= left, OM_INVALID, "it has %llu bytes, the file ends before",
             (unsigned long long)size);
    uint64_t* packed = om_alloc(nblock, sizeof *packed);
    if (!packed) return OM_NO_MEMORY;
    OmStatus status = OM_OK;
    for (uint64_t i = 0; i < nblock && status == OM_OK; i++)
        status = read_header_word(v, b, &packed[i]);
    // the data after the table are a base64 stream of their own
    if (status == OM_OK) b->igroup = b->ngroup = 0;
    if (status == OM_OK && !(*out = om_alloc(size, 1))) status = OM_NO_MEMORY;
    if (status == OM_OK) status = inflate_blocks(b, packed, nblock, block, size, *out);
    om_free(packed);
    return status;
}

// Read values from text, one by one, into real or integer.
static OmStatus read_text_values(const Vtu* v, const Array* a, size_t count, double* real,
                                 int64_t* integer) {
    OmScan s = v->s;
    s.p = a->content;
    const char* end = memchr(s.p, '<', om__scan_left(&s));
    if (end) s.end = end;
    OM_CHECK(count <= om__scan_left(&s), OM_INVALID, "%zu values are wanted, its text is too short",
             count);
    for (size_t i = 0; i < count; i++) {
        if (real) {
            OM_TRY(om__read_double(&s, "a value", &real[i]));
        } else {
            OM_TRY(om__read_int(&s, "a value", INT64_MIN, INT64_MAX, &integer[i]));
        }
    }
    return OM_OK;
}

// Read `count` values into real or integer, whichever is not null (count items).
static OmStatus read_values(const Vtu* v, const Array* a, size_t count, double* real,
                            int64_t* integer) {
    OmValueType type = type_of(a->type);
    OM_CHECK(type != OM_VALUE_NONE, OM_INVALID, "its type \"%.*s\" is not known", shown(a->type),
             a->type.str);
    if (om__is_word(a->format, "ascii")) return read_text_values(v, a, count, real, integer);
    OmByteStream b = {(const unsigned char*)a->content, (const unsigned char*)v->s.end, true};
    if (om__is_word(a->format, "appended")) {
        OM_CHECK(v->appended, OM_INVALID, "the file has no AppendedData");
        OM_CHECK(a->offset >= 0 && a->offset <= v->s.end - v->appended, OM_INVALID,
                 "its offset %lld lies outside of the file", (long long)a->offset);
        b.p = (const unsigned char*)v->appended + a->offset;
        b.is_base64 = v->is_appended_base64;
    } else {
        OM_CHECK(om__is_word(a->format, "binary"), OM_INVALID, "its format \"%.*s\" is not known",
                 shown(a->format), a->format.str);
    }
    unsigned char* bytes = NULL;
    size_t size = om__value_size(type);
    OmStatus status = v->is_compressed ? read_compressed(v, &b, count * size, &bytes)
                                       : read_plain(v, &b, count * size, &bytes);
    for (size_t i = 0; i < count && status == OM_OK; i++) {
        if (real)
            real[i] = om__load_real(type, bytes + i * size, v->is_swapped);
        else
            integer[i] = om__load_integer(type, bytes + i * size, v->is_swapped);
    }
    om_free(bytes);
    return status;
}

// Refuse a count of values that no file of this size can hold, compressed or not.
static OmStatus check_plausible(const Vtu* v, size_t count) {
    size_t size = (size_t)(v->s.end - v->s.start);
    OM_CHECK(count / MAX_PACKING <= size, OM_INVALID,
             "the piece states %zu values, a file of %zu bytes cannot hold them", count, size);
    return OM_OK;
}

static OmStatus read_integers(const Vtu* v, const Array* a, const char* name, size_t count,
                              int64_t** value) {
    *value = NULL;
    OM_CHECK(a->content, OM_INVALID, "the piece has no array \"%s\"", name);
    OM_TRY(check_plausible(v, count));
    *value = om_alloc(count, sizeof **value);
    if (!*value) return OM_NO_MEMORY;
    OmStatus status = read_values(v, a, count, NULL, *value);
    if (status == OM_OK) return OM_OK;
    om_free(*value);
    *value = NULL;
    return om_error_prefix(status, "array \"%s\"", name);
}

// ---- pieces -----------------------------------------------------------------------------------------

static OmStatus take_points(const Vtu* v, OmFileMesh* m) {
    const Array* a = &v->piece.points;
    size_t count = 3 * (size_t)v->piece.npoint;
    OM_CHECK(a->content, OM_INVALID, "the piece has no array of points");
    OM_CHECK(a->ncomp == 3, OM_INVALID, "the points have %lld components, 3 are wanted",
             (long long)a->ncomp);
    OM_TRY(check_plausible(v, count));
    double* x = om_alloc(count, sizeof *x);
    if (!x) return OM_NO_MEMORY;
    OmStatus status = read_values(v, a, count, x, NULL);
    if (status < 0) om_error_prefix(status, "points");
    for (int i = 0; i < v->piece.npoint && status == OM_OK; i++)
        status = om__add_vert(m, x + 3 * (size_t)i);
    om_free(x);
    return status;
}

// Normals of the points that were added last.
static OmStatus take_normals(const Vtu* v, int base, OmFileMesh* m) {
    size_t count = 3 * (size_t)v->piece.npoint;
    OM_TRY(check_plausible(v, count));
    double* normal = om_alloc(count, sizeof *normal);
    if (!normal) return OM_NO_MEMORY;
    OmStatus status = read_values(v, &v->piece.normals, count, normal, NULL);
    if (status < 0) om_error_prefix(status, "normals");
    double last[3] = {0, 0, 0};
    if (status == OM_OK) status = om__add_normal(m, last);  // room for all, zero before `base`
    if (status == OM_OK) memcpy(m->normal + 3 * (size_t)base, normal, count * sizeof *normal);
    om_free(normal);
    return status;
}

// Append the corners of all cells as vertices of the mesh.
static OmStatus number_corners(const Piece* p, int base, const int64_t* vert, int64_t count,
                               int** corner) {
    OM_ALLOC(*corner, count);
    for (int64_t i = 0; i < count; i++) {
        OM_CHECK(vert[i] >= 0 && vert[i] < p->npoint, OM_INVALID,
                 "array \"connectivity\": entry %lld names point %lld, the piece has %d",
                 (long long)i, (long long)vert[i], p->npoint);
        (*corner)[i] = base + (int)vert[i];
    }
    return OM_OK;
}

static OmStatus check_offsets(const int64_t* offset, int n, int64_t* last) {
    *last = 0;
    for (int c = 0; c < n; c++) {
        OM_CHECK(offset[c] >= *last && offset[c] <= INT_MAX, OM_INVALID,
                 "array \"offsets\": entry %d is %lld, the one before %lld", c,
                 (long long)offset[c], (long long)*last);
        *last = offset[c];
    }
    return OM_OK;
}

// Polygons, or strips of triangles: their corners and where each ends.
static OmStatus take_polygons(const Vtu* v, int base, int n, bool is_strip, OmFileMesh* m) {
    const Piece* p = &v->piece;
    const Array* offsets = is_strip ? &p->strip_offsets : &p->offsets;
    const Array* connectivity = is_strip ? &p->strip_connectivity : &p->connectivity;
    OmStatus status = OM_OK;
    int64_t *offset = NULL, *vert = NULL, last;
    int* corner = NULL;
    bool is_tet;
    OM_TRY_DONE(read_integers(v, offsets, "offsets", (size_t)n, &offset));
    OM_TRY_DONE(check_offsets(offset, n, &last));
    OM_TRY_DONE(read_integers(v, connectivity, "connectivity", (size_t)last, &vert));
    OM_TRY_DONE(number_corners(p, base, vert, last, &corner));
    for (int c = 0; c < n; c++) {
        int first = c > 0 ? (int)offset[c - 1] : 0;
        OM_TRY_DONE(
            om__add_vtk_cell(m, is_strip ? 6 : 7, corner + first, (int)offset[c] - first, &is_tet));
    }
done:
    om_free(corner);
    om_free(offset);
    om_free(vert);
    return status;
}

static OmStatus take_cells(const Vtu* v, int base, OmFileMesh* m) {
    const Piece* p = &v->piece;
    OmStatus status = OM_OK;
    int64_t *offset = NULL, *type = NULL, *vert = NULL, *label = NULL, last = 0;
    int* corner = NULL;
    OM_TRY_DONE(read_integers(v, &p->offsets, "offsets", (size_t)p->ncell, &offset));
    OM_TRY_DONE(read_integers(v, &p->types, "types", (size_t)p->ncell, &type));
    OM_TRY_DONE(check_offsets(offset, p->ncell, &last));
    OM_TRY_DONE(read_integers(v, &p->connectivity, "connectivity", (size_t)last, &vert));
    if (p->label.content && p->label.ncomp == 1)
        OM_TRY_DONE(read_integers(v, &p->label, "tet_label", (size_t)p->ncell, &label));
    OM_TRY_DONE(number_corners(p, base, vert, last, &corner));
    last = 0;
    for (int c = 0; c < p->ncell; c++) {
        bool is_tet;
        int vtk_type = type[c] >= 0 && type[c] < 256 ? (int)type[c] : 0;
        status = om__add_vtk_cell(m, vtk_type, corner + last, (int)(offset[c] - last), &is_tet);
        if (status == OM_OK && is_tet && label) status = om__set_label(m, label[c]);
        if (status < 0) {
            om_error_prefix(status, "cell %d", c);
            goto done;
        }
        last = offset[c];
    }
done:
    om_free(corner);
    om_free(offset);
    om_free(type);
    om_free(vert);
    om_free(label);
    return status;
}

static OmStatus take_piece(const Vtu* v, OmFileMesh* m) {
    const Piece* p = &v->piece;
    if (p->npoint == 0 && p->ncell == 0 && p->nstrip == 0) return OM_OK;
    int base = m->nvert;
    OM_TRY(take_points(v, m));
    if (p->normals.content && p->npoint > 0) OM_TRY(take_normals(v, base, m));
    if (v->is_poly) {
        if (p->ncell > 0) OM_TRY(take_polygons(v, base, p->ncell, false, m));
        return p->nstrip > 0 ? take_polygons(v, base, p->nstrip, true, m) : OM_OK;
    }
    if (p->ncell > 0) OM_TRY(take_cells(v, base, m));
    for (int i = 0; i < p->nflags; i++) {
        char name[OM_SET_NAME], where[OM_SET_NAME + 16];
        int64_t* value;
        size_t len = unescape(p->flags[i].name, name);
        snprintf(where, sizeof where, "%.*s", (int)len, name);
        OM_TRY(read_integers(v, &p->flags[i], where, (size_t)p->npoint, &value));
        OmStatus status = om__add_point_flags(m, name, len, base, value, p->npoint);
        om_free(value);
        OM_TRY(status);
    }
    return OM_OK;
}

static OmStatus open_piece(Vtu* v, const Tag* tag) {
    int64_t npoint, ncell, nstrip = 0;
    OM_TRY(attr_integer(v, tag, "NumberOfPoints", -1, &npoint));
    if (v->is_poly) {
        OM_TRY(attr_integer(v, tag, "NumberOfPolys", 0, &ncell));
        OM_TRY(attr_integer(v, tag, "NumberOfStrips", 0, &nstrip));
    } else {
        OM_TRY(attr_integer(v, tag, "NumberOfCells", -1, &ncell));
    }
    if (npoint < 0 || npoint > INT_MAX / 4 || ncell < 0 || ncell > INT_MAX / 4 || nstrip < 0 ||
        nstrip > INT_MAX / 4) {
        return om__scan_error(&v->s, "a piece of %lld points and %lld cells", (long long)npoint,
                              (long long)ncell);
    }
    memset(&v->piece, 0, sizeof v->piece);
    v->piece.is_open = true;
    v->piece.npoint = (int)npoint;
    v->piece.ncell = (int)ncell;
    v->piece.nstrip = (int)nstrip;
    return OM_OK;
}

static OmStatus read_array_tag(const Vtu* v, const Tag* tag, Array* a) {
    *a = (Array){.content = v->s.p};
    find_attr(tag, "Name", &a->name);
    find_attr(tag, "type", &a->type);
    find_attr(tag, "format", &a->format);
    OM_TRY(attr_integer(v, tag, "NumberOfComponents", 1, &a->ncomp));
    return attr_integer(v, tag, "offset", 0, &a->offset);
}

// Fields of the whole file: is_lps and metres_per_unit are numbers; SPACE is a string, of 3D Slicer and of older
// files of ours. Other fields are ignored, and so are these if their type differs.
static OmStatus read_field(const Vtu* v, const Tag* tag, OmFileMesh* m) {
    Array a;
    OmStatus status = OM_OK;
    OM_TRY(read_array_tag(v, tag, &a));
    if (om__is_word(a.name, "SPACE") && om__is_word(a.type, "String")) {
        int64_t code[4];  // three letters and the final zero
        a.type = (OmWord){"UInt8", 5};
        status = read_values(v, &a, 4, NULL, code);
        char text[] = "SPACE=...";
        for (int i = 0; status == OM_OK && i < 3; i++) text[6 + i] = (char)code[i];
        if (status == OM_OK && code[3] == 0) om__read_statement(m, text, sizeof text - 1);
    } else if (om__is_word(a.name, "is_lps") && om__is_word(a.type, "Int32")) {
        int64_t is_lps = -1;
        status = read_values(v, &a, 1, NULL, &is_lps);
        const char* text = is_lps == 1 ? "SPACE=LPS" : "SPACE=RAS";
        if (status == OM_OK && (is_lps == 0 || is_lps == 1))
            om__read_statement(m, text, strlen(text));
    } else if (om__is_word(a.name, "metres_per_unit") && om__is_word(a.type, "Float64")) {
        double unit;
        status = read_values(v, &a, 1, &unit, NULL);
        if (status == OM_OK) om__state_unit(m, unit);
    }
    return status == OM_NO_MEMORY ? status : OM_OK;
}

static OmStatus list_array(Vtu* v, const Tag* tag, OmWord section) {
    Piece* p = &v->piece;
    Array a;
    OM_TRY(read_array_tag(v, tag, &a));
    OmValueType type = type_of(a.type);
    if (om__is_word(section, "Points")) {
        p->points = a;
    } else if (v->is_poly) {
        bool is_strip = om__is_word(section, "Strips"), is_poly = om__is_word(section, "Polys");
        bool is_offsets = om__is_word(a.name, "offsets");
        if (is_offsets || om__is_word(a.name, "connectivity")) {
            if (is_poly) *(is_offsets ? &p->offsets : &p->connectivity) = a;
            if (is_strip) *(is_offsets ? &p->strip_offsets : &p->strip_connectivity) = a;
        }
        if (om__is_word(section, "PointData") && om__is_word_nocase(a.name, "normals") &&
            a.ncomp == 3)
            p->normals = a;
    } else if (om__is_word(section, "Cells")) {
        if (om__is_word(a.name, "connectivity")) p->connectivity = a;
        if (om__is_word(a.name, "offsets")) p->offsets = a;
        if (om__is_word(a.name, "types")) p->types = a;
    } else if (om__is_word(section, "CellData")) {
        if (om__is_word(a.name, "tet_label")) p->label = a;
    } else if (om__is_word(section, "PointData") && a.ncomp == 1 && a.name.len > 0 &&
               (type == OM_VALUE_U8 || type == OM_VALUE_I8)) {
        if (p->nflags == MAX_FLAGS)
            return om__scan_error(&v->s, "more than %d point arrays of bytes", MAX_FLAGS);
        p->flags[p->nflags++] = a;
    }
    return OM_OK;
}

// ---- the file ---------------------------------------------------------------------------------------

static OmStatus read_file_tag(Vtu* v, const Tag* tag) {
    OmWord w;
    find_attr(tag, "type", &w);
    const char* wanted = v->is_poly ? "PolyData" : "UnstructuredGrid";
    OM_CHECK(om__is_word(w, wanted), OM_INVALID, "VTKFile is of type \"%.*s\", %s is wanted",
             shown(w), w.str, wanted);
    v->is_swapped = !om__is_little();
    if (find_attr(tag, "byte_order", &w)) {
        bool is_big = om__is_word(w, "BigEndian");
        OM_CHECK(is_big || om__is_word(w, "LittleEndian"), OM_INVALID,
                 "byte_order \"%.*s\" is not known", shown(w), w.str);
        v->is_swapped = is_big == om__is_little();
    }
    v->header_type = OM_VALUE_U32;
    if (find_attr(tag, "header_type", &w)) {
        v->header_type = type_of(w);
        OM_CHECK(v->header_type == OM_VALUE_U32 || v->header_type == OM_VALUE_U64, OM_INVALID,
                 "header_type \"%.*s\" is not known", shown(w), w.str);
    }
    v->is_compressed = find_attr(tag, "compressor", &w) && w.len > 0;
    OM_CHECK(!v->is_compressed || om__is_word(w, "vtkZLibDataCompressor"), OM_INVALID,
             "compressor \"%.*s\" is not read; save the file with zlib or uncompressed", shown(w),
             w.str);
    return OM_OK;
}

// Appended data may hold any byte, also brackets: find them before the tags are read.
static OmStatus find_appended(Vtu* v) {
    OmScan s = v->s;
    Tag tag;
    while (next_tag(&s, &tag)) {
        if (tag.is_end || !om__is_word(tag.name, "AppendedData")) continue;
        OmWord encoding;
        find_attr(&tag, "encoding", &encoding);
        v->is_appended_base64 = om__is_word(encoding, "base64");
        OM_CHECK(v->is_appended_base64 || om__is_word(encoding, "raw"), OM_INVALID,
                 "AppendedData of encoding \"%.*s\"", shown(encoding), encoding.str);
        om__skip_blank(&s);
        OM_CHECK(om__scan_left(&s) && *s.p == '_', OM_INVALID,
                 "AppendedData do not begin with an underscore");
        v->appended = s.p + 1;
        break;
    }
    return OM_OK;
}

static bool is_section(OmWord name) {
    static const char* const section[] = {"PointData", "CellData", "Points", "Cells", "FieldData",
                                          "Polys",     "Strips",   "Verts",  "Lines"};
    for (size_t i = 0; i < sizeof section / sizeof section[0]; i++)
        if (om__is_word(name, section[i])) return true;
    return false;
}

static OmStatus read_tags(Vtu* v, OmFileMesh* m) {
    OmWord section = {"", 0};
    int npiece = 0;
    Tag tag;
    while (next_tag(&v->s, &tag)) {
        if (om__is_word(tag.name, "AppendedData")) break;
        if (om__is_word(tag.name, "Piece")) {
            if (!tag.is_end) OM_TRY(open_piece(v, &tag));
            if ((tag.is_end || tag.is_empty) && v->piece.is_open) {
                OM_TRY(take_piece(v, m));
                v->piece.is_open = false;
                npiece++;
            }
        } else if (om__is_word(tag.name, "DataArray")) {
            if (!tag.is_end && v->piece.is_open) OM_TRY(list_array(v, &tag, section));
            if (!tag.is_end && om__is_word(section, "FieldData")) OM_TRY(read_field(v, &tag, m));
        } else if (is_section(tag.name)) {
            section = tag.is_end ? (OmWord){"", 0} : tag.name;
        }
    }
    OM_CHECK(!v->piece.is_open, OM_INVALID, "the file ends inside of a piece: it is cut short");
    OM_CHECK(npiece > 0, OM_INVALID, "the file has no piece");
    return OM_OK;
}

static OmStatus parse(const char* data, size_t size, bool is_poly, OmFileMesh* m) {
    Tag tag;
    Vtu* v = om_calloc(1, sizeof *v);
    if (!v) return OM_NO_MEMORY;
    OmStatus status = OM_OK;
    v->s = om__scan(data, size);
    v->is_poly = is_poly;
    OM_CHECK_DONE(next_tag(&v->s, &tag) && om__is_word(tag.name, "VTKFile"), OM_INVALID,
                  "this is no VTK XML file: it does not begin with a tag VTKFile");
    OM_TRY_DONE(read_file_tag(v, &tag));
    OM_TRY_DONE(find_appended(v));
    OM_TRY_DONE(read_tags(v, m));
done:
    om_free(v);
    return status;
}

OmStatus om__parse_vtu(const char* data, size_t size, OmFileMesh* m) {
    return parse(data, size, false, m);
}

OmStatus om__parse_vtp(const char* data, size_t size, OmFileMesh* m) {
    return parse(data, size, true, m);
}
