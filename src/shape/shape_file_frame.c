// shape_file_frame.c: the directions of x and y (RAS, LPS) and the unit that a file states.
//
// 3D Slicer writes "SPACE=LPS" or "SPACE=RAS" into the header of an STL, a comment of a PLY or OBJ, the title
// of a VTK file, or a field SPACE of a VTU. Files of omentum add "UNIT=mm", and a VTU has the fields
// metres_per_unit and is_lps.
#include <string.h>

#include "shape/shape_file_internal.h"

static const struct {
    const char* name;
    double unit;
} unit_table[] = {{"mm", OM_UNIT_MM}, {"cm", OM_UNIT_CM}, {"m", OM_UNIT_M}};

// The text after `key` where the key begins a word; null if it does not occur.
static const char* find_key(const char* text, size_t len, const char* key) {
    const size_t n = strlen(key);
    for (size_t i = 0; i + n <= len; i++) {
        bool is_inside =
            i > 0 && ((text[i - 1] >= 'A' && text[i - 1] <= 'Z') || text[i - 1] == '_');
        if (!is_inside && memcmp(text + i, key, n) == 0) return text + i + n;
    }
    return NULL;
}

void om__read_statement(OmFileMesh* m, const char* text, size_t len) {
    const char *end = text + len, *p = find_key(text, len, "SPACE=");
    if (p && end - p >= 3 && m->stated.space == OM_SPACE_NONE) {
        if (memcmp(p, "RAS", 3) == 0) m->stated.space = OM_SPACE_RAS;
        if (memcmp(p, "LPS", 3) == 0) m->stated.space = OM_SPACE_LPS;
    }
    p = find_key(text, len, "UNIT=");
    if (!p || m->stated.unit > 0) return;
    double unit = 0;
    for (size_t i = 0; i < sizeof unit_table / sizeof *unit_table; i++) {
        const size_t n = strlen(unit_table[i].name);
        bool is_it = (size_t)(end - p) >= n && memcmp(p, unit_table[i].name, n) == 0;
        if (is_it && ((size_t)(end - p) == n || p[n] < 'a' || p[n] > 'z'))
            unit = unit_table[i].unit;
    }
    if (unit > 0 || om_number_parse(&p, end, &unit)) om__state_unit(m, unit);
}

void om__state_unit(OmFileMesh* m, double unit) {
    if (isfinite(unit) && unit > 0) m->stated.unit = unit;
}

void om__frame_words(OmMeshFrame frame, char out[OM_FRAME_WORDS]) {
    char unit[OM_NUMBER_SIZE + 1];
    unit[om_number_write(unit, frame.unit)] = 0;
    for (size_t i = 0; i < sizeof unit_table / sizeof *unit_table; i++)
        if (frame.unit == unit_table[i].unit) snprintf(unit, sizeof unit, "%s", unit_table[i].name);
    snprintf(out, OM_FRAME_WORDS, "SPACE=%s UNIT=%s", frame.space == OM_SPACE_LPS ? "LPS" : "RAS",
             unit);
}

void om__turn_points(double* x, int nvert) {
    for (int i = 0; i < nvert; i++) {
        x[3 * (size_t)i] = -x[3 * (size_t)i];
        x[3 * (size_t)i + 1] = -x[3 * (size_t)i + 1];
    }
}

OmMeshFrame om_mesh_frame_join(OmMeshFrame given, OmMeshFrame stated) {
    OmMeshFrame frame = {given.unit > 0 ? given.unit : stated.unit, given.space};
    if (!(frame.unit > 0)) frame.unit = OM_UNIT_MM;
    if (frame.space == OM_SPACE_NONE) frame.space = stated.space;
    if (frame.space == OM_SPACE_NONE) frame.space = OM_SPACE_RAS;
    return frame;
}
