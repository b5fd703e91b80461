// shape_file_off.c: surfaces in OFF, text.
#include "shape/shape_file_internal.h"

enum { MAX_CORNER = 4096 };

static void skip_comments(OmScan* s, OmFileMesh* m) {
    for (om__skip_blank(s); om__scan_left(s) > 0 && *s->p == '#'; om__skip_blank(s)) {
        OmWord comment = om__read_line(s);
        om__read_statement(m, comment.str, comment.len);
    }
}

OmStatus om__parse_off(const char* data, size_t size, OmFileMesh* m) {
    OmScan s = om__scan(data, size);
    int nvert, nface;
    int64_t nedge;
    skip_comments(&s, m);
    OM_CHECK(om__is_word(om__read_word(&s), "OFF"), OM_INVALID, "the file does not begin with OFF");
    skip_comments(&s, m);
    OM_TRY(om__read_count(&s, "the number of vertices", 6, &nvert));
    OM_TRY(om__read_count(&s, "the number of faces", 8, &nface));
    OM_TRY(om__read_int(&s, "the number of edges", 0, INT32_MAX, &nedge));
    for (int i = 0; i < nvert; i++) {
        double x[3];
        skip_comments(&s, m);
        for (int k = 0; k < 3; k++) OM_TRY(om__read_coord(&s, "a coordinate", &x[k]));
        OM_TRY(om__add_vert(m, x));
    }
    for (int f = 0; f < nface; f++) {
        int corner[MAX_CORNER];
        int64_t n, v;
        skip_comments(&s, m);
        OM_TRY(om__read_int(&s, "the number of corners", 1, MAX_CORNER, &n));
        for (int c = 0; c < n; c++) {
            OM_TRY(om__read_int(&s, "a corner", 0, (int64_t)nvert - 1, &v));
            corner[c] = (int)v;
        }
        OM_TRY(om__add_polygon(m, corner, (int)n));
        om__skip_line(&s);  // colours
    }
    return OM_OK;
}

// Write no comments: some readers of OFF do not support them.
OmStatus om__write_off(const OmSurface* surface, OmMeshFrame frame, OmText* text) {
    const double scale = 1 / frame.unit;
    OM_TRY(om_text_append(text, "OFF\n%d %d 0\n", surface->nvert, surface->ntri));
    for (int i = 0; i < surface->nvert; i++)
        OM_TRY(om__write_point(text, surface->x + 3 * (size_t)i, scale));
    for (int t = 0; t < surface->ntri; t++) {
        const int* v = surface->tri_vert + 3 * (size_t)t;
        OM_TRY(om_text_append(text, "3 %d %d %d\n", v[0], v[1], v[2]));
    }
    return OM_OK;
}
