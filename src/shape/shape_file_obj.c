// shape_file_obj.c: surfaces in Wavefront OBJ: vertices and faces are read, all other lines are ignored.
#include <string.h>

#include "shape/shape_file_internal.h"

enum { MAX_CORNER = 4096 };

// At the end of a line? A line that ends with a backslash continues on the next.
static bool at_obj_line_end(OmScan* s) {
    for (;;) {
        if (om__at_line_end(s)) return true;
        if (*s->p == '#') return true;
        if (*s->p != '\\') return false;
        s->p++;
        if (!om__at_line_end(s)) return false;  // a stray backslash: the number reader reports it
        om__skip_line(s);
    }
}

// "7", "7/1", "7/1/3", "7//3"; negative counts from the last vertex.
static OmStatus read_corner(OmScan* s, int nvert, int* vert) {
    int64_t v;
    OM_TRY(om__read_int(s, "a corner of a face", -(int64_t)nvert, INT32_MAX, &v));
    if (v == 0) return om__scan_error(s, "vertices are counted from 1, there is no vertex 0");
    *vert = (int)(v > 0 ? v - 1 : nvert + v);
    while (s->p < s->end && (*s->p == '/' || *s->p == '-' || (*s->p >= '0' && *s->p <= '9')))
        s->p++;
    return OM_OK;
}

static OmStatus parse_face(OmScan* s, OmFileMesh* m) {
    int corner[MAX_CORNER], n = 0;
    while (!at_obj_line_end(s)) {
        if (n == MAX_CORNER) return om__scan_error(s, "a face of more than %d corners", MAX_CORNER);
        OM_TRY(read_corner(s, m->nvert, &corner[n++]));
    }
    if (n < 3) return om__scan_error(s, "a face of %d corners", n);
    return om__add_polygon(m, corner, n);
}

OmStatus om__parse_obj(const char* data, size_t size, OmFileMesh* m) {
    OmScan s = om__scan(data, size);
    for (om__skip_blank(&s); om__scan_left(&s) > 0; om__skip_blank(&s)) {
        OmWord w = om__read_word(&s);
        if (om__is_word(w, "v")) {
            double x[3];
            for (int k = 0; k < 3; k++) OM_TRY(om__read_coord(&s, "a coordinate", &x[k]));
            OM_TRY(om__add_vert(m, x));
        } else if (om__is_word(w, "f")) {
            OM_TRY(parse_face(&s, m));
        } else if (w.str[0] == '#') {
            s.p = w.str;
            OmWord comment = om__read_line(&s);
            om__read_statement(m, comment.str, comment.len);
            continue;
        } else if (w.str[0] < 0x20 || w.str[0] > 0x7e) {
            return om__scan_error(&s, "this is not the text of an OBJ file");
        }
        // groups, materials, normals, lines ... are ignored
        while (!at_obj_line_end(&s)) om__read_word(&s);
        om__skip_line(&s);
    }
    return OM_OK;
}

OmStatus om__write_obj(const OmSurface* surface, OmMeshFrame frame, OmText* text) {
    const double scale = 1 / frame.unit;
    char words[OM_FRAME_WORDS];
    om__frame_words(frame, words);
    OM_TRY(om_text_append(text, "# omentum %s\n", words));
    for (int i = 0; i < surface->nvert; i++) {
        OM_TRY(om_text_append_raw(text, "v ", 2));
        OM_TRY(om__write_point(text, surface->x + 3 * (size_t)i, scale));
    }
    for (int t = 0; t < surface->ntri; t++) {
        const int* v = surface->tri_vert + 3 * (size_t)t;
        OM_TRY(om_text_append(text, "f %d %d %d\n", v[0] + 1, v[1] + 1, v[2] + 1));
    }
    return OM_OK;
}
