// shape_file_stl.c: STL, binary and text.
//
// Both kinds of file may begin with "solid". A file is binary if its length fits its triangle count, or if
// it does not begin with "solid".
#include <string.h>

#include "shape/shape_file_internal.h"

#define HEADER 84  // 80 letters and the count
#define RECORD 50  // 12 floats and two bytes

static OmStatus parse_binary(OmScan* s, OmFileMesh* m) {
    const unsigned char* head = om__read_bytes(s, "the header", HEADER);
    if (!head) return OM_INVALID;
    om__read_statement(m, (const char*)head, 80);
    int64_t count = om__load_integer(OM_VALUE_U32, head + 80, !om__is_little());
    OM_CHECK((uint64_t)count <= om__scan_left(s) / RECORD, OM_INVALID,
             "the header states %lld triangles, the file holds %zu: it is cut short or no STL file",
             (long long)count, om__scan_left(s) / RECORD);
    for (int64_t t = 0; t < count; t++) {
        const unsigned char* record = om__read_bytes(s, "a triangle", RECORD);
        if (!record) return OM_INVALID;
        for (int c = 0; c < 3; c++) {
            double x[3];
            for (int k = 0; k < 3; k++)
                x[k] = om__load_real(OM_VALUE_F32, record + 12 + 12 * c + 4 * k, !om__is_little());
            OM_TRY(om__add_vert(m, x));
        }
        OM_TRY(om__add_tri(m, m->nvert - 3, m->nvert - 2, m->nvert - 1));
    }
    return OM_OK;
}

static OmStatus expect(OmScan* s, const char* word) {
    OmScan before = *s;
    OmWord w = om__read_word(s);
    if (om__is_word_nocase(w, word)) return OM_OK;
    om__skip_blank(&before);
    return om__scan_error(&before, "\"%s\" is wanted, not \"%.*s\"", word,
                          w.len < 40 ? (int)w.len : 40, w.str);
}

static OmStatus parse_facet(OmScan* s, OmFileMesh* m) {
    double x[3];
    OM_TRY(expect(s, "normal"));
    om__skip_line(s);  // normals are computed from the vertices; those of the file are often nan
    OM_TRY(expect(s, "outer"));
    OM_TRY(expect(s, "loop"));
    for (int c = 0; c < 3; c++) {
        OM_TRY(expect(s, "vertex"));
        for (int k = 0; k < 3; k++) OM_TRY(om__read_coord(s, "a coordinate", &x[k]));
        OM_TRY(om__add_vert(m, x));
    }
    OM_TRY(expect(s, "endloop"));
    OM_TRY(expect(s, "endfacet"));
    return om__add_tri(m, m->nvert - 3, m->nvert - 2, m->nvert - 1);
}

static OmStatus parse_text(OmScan* s, OmFileMesh* m) {
    for (;;) {
        OmScan before = *s;
        OmWord w = om__read_word(s);
        if (w.len == 0) return OM_OK;
        if (om__is_word_nocase(w, "solid") || om__is_word_nocase(w, "endsolid")) {
            OmWord name = om__read_line(s);
            om__read_statement(m, name.str, name.len);
        } else if (om__is_word_nocase(w, "facet")) {
            OM_TRY(parse_facet(s, m));
        } else {
            om__skip_blank(&before);
            return om__scan_error(&before, "\"facet\" is wanted, not \"%.*s\"",
                                  w.len < 40 ? (int)w.len : 40, w.str);
        }
    }
}

OmStatus om__parse_stl(const char* data, size_t size, OmFileMesh* m) {
    OmScan s = om__scan(data, size);
    m->is_soup = true;
    bool is_binary = size < 5 || memcmp(data, "solid", 5) != 0;
    if (size >= HEADER) {
        int64_t n =
            om__load_integer(OM_VALUE_U32, (const unsigned char*)data + 80, !om__is_little());
        is_binary = is_binary || (uint64_t)n * RECORD + HEADER == size;
    }
    return is_binary ? parse_binary(&s, m) : parse_text(&s, m);
}

static void put_float(unsigned char* out, double value) {
    float f = (float)value;
    uint32_t bits;
    memcpy(&bits, &f, sizeof bits);
    for (int i = 0; i < 4; i++) out[i] = (unsigned char)(bits >> 8 * i);
}

OmStatus om__write_stl(const OmSurface* surface, OmMeshFrame frame, OmText* text) {
    const double scale = 1 / frame.unit;
    unsigned char head[HEADER] = {0};
    char words[OM_FRAME_WORDS];
    om__frame_words(frame, words);
    snprintf((char*)head, 80, "omentum %s", words);
    for (int i = 0; i < 4; i++) head[80 + i] = (unsigned char)((unsigned)surface->ntri >> 8 * i);
    OM_TRY(om_text_append_raw(text, (const char*)head, sizeof head));
    for (int t = 0; t < surface->ntri; t++) {
        unsigned char record[RECORD] = {0};
        OmVec3 p[3];
        for (int c = 0; c < 3; c++)
            p[c] =
                om_scale(scale, om_load3(surface->x, surface->tri_vert[3 * (size_t)t + (size_t)c]));
        OmVec3 n = om_cross(om_sub(p[1], p[0]), om_sub(p[2], p[0]));
        double len = om_norm(n);
        if (len > 0) n = om_scale(1 / len, n);
        const OmVec3 row[4] = {n, p[0], p[1], p[2]};
        for (int r = 0; r < 4; r++) {
            put_float(record + 12 * r, row[r].x);
            put_float(record + 12 * r + 4, row[r].y);
            put_float(record + 12 * r + 8, row[r].z);
        }
        OM_TRY(om_text_append_raw(text, (const char*)record, sizeof record));
    }
    return OM_OK;
}
