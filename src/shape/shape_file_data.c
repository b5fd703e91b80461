// shape_file_data.c: the contents of a mesh file, collected by its parser in growing arrays.
#include <limits.h>
#include <string.h>

#include "shape/shape_file_internal.h"

#define MAX_ITEM (INT_MAX / 4)  // so that 4 n is an int
#define MAX_SET 1024

void om__file_mesh_done(OmFileMesh* m) {
    om_free(m->x);
    om_free(m->normal);
    om_free(m->tri);
    om_free(m->tet);
    om_free(m->mid);
    om_free(m->label);
    for (int s = 0; s < m->nset; s++) om_free(m->set[s].vert);
    om_free(m->set);
    memset(m, 0, sizeof *m);
}

OmStatus om__grow(void* array, int* cap, int64_t need, size_t size) {
    if (need <= *cap) return OM_OK;
    OM_CHECK(need <= MAX_ITEM, OM_INVALID, "%lld items are too many: at most %d are read",
             (long long)need, MAX_ITEM);
    int64_t grown = *cap ? 2 * (int64_t)*cap : 64;
    if (grown < need) grown = need;
    if (grown > MAX_ITEM) grown = MAX_ITEM;
    void* old;
    memcpy(&old, array, sizeof old);  // *array is a pointer of any object type
    void* ptr = om_realloc(old, (size_t)*cap, (size_t)grown, size);
    if (!ptr) return OM_NO_MEMORY;
    memcpy(array, &ptr, sizeof ptr);
    *cap = (int)grown;
    return OM_OK;
}

OmStatus om__add_vert(OmFileMesh* m, const double x[3]) {
    OM_TRY(om__grow(&m->x, &m->xcap, (int64_t)m->nvert + 1, 3 * sizeof(double)));
    memcpy(m->x + 3 * (size_t)m->nvert++, x, 3 * sizeof(double));
    return OM_OK;
}

OmStatus om__add_normal(OmFileMesh* m, const double normal[3]) {
    OM_TRY(om__grow(&m->normal, &m->normalcap, m->nvert, 3 * sizeof(double)));
    while (m->nnormal < m->nvert) om_store3(m->normal, m->nnormal++, om_vec3(0, 0, 0));
    memcpy(m->normal + 3 * ((size_t)m->nvert - 1), normal, 3 * sizeof(double));
    return OM_OK;
}

OmStatus om__add_tri(OmFileMesh* m, int a, int b, int c) {
    OM_TRY(om__grow(&m->tri, &m->tricap, (int64_t)m->ntri + 1, 3 * sizeof(int)));
    int* t = m->tri + 3 * (size_t)m->ntri++;
    t[0] = a;
    t[1] = b;
    t[2] = c;
    return OM_OK;
}

OmStatus om__add_tet(OmFileMesh* m, const int vert[4]) {
    OM_TRY(om__grow(&m->tet, &m->tetcap, (int64_t)m->ntet + 1, 4 * sizeof(int)));
    memcpy(m->tet + 4 * (size_t)m->ntet++, vert, 4 * sizeof(int));
    return OM_OK;
}

OmStatus om__set_mid(OmFileMesh* m, const int mid[6]) {
    OM_TRY(om__grow(&m->mid, &m->midcap, m->ntet, 6 * sizeof(int)));
    for (; m->nmid < m->ntet; m->nmid++)
        for (int k = 0; k < 6; k++) m->mid[6 * (size_t)m->nmid + (size_t)k] = -1;
    memcpy(m->mid + 6 * ((size_t)m->ntet - 1), mid, 6 * sizeof(int));
    return OM_OK;
}

OmStatus om__set_label(OmFileMesh* m, int64_t label) {
    OM_CHECK(label >= INT_MIN && label <= INT_MAX, OM_INVALID,
             "the label of tetrahedron %d is no integer of 32 bits", m->ntet);
    OM_TRY(om__grow(&m->label, &m->labelcap, m->ntet, sizeof(int)));
    while (m->nlabel < m->ntet) m->label[m->nlabel++] = 0;
    m->label[m->ntet - 1] = (int)label;
    return OM_OK;
}

OmStatus om__add_polygon(OmFileMesh* m, const int* vert, int nvert) {
    for (int i = 2; i < nvert; i++) OM_TRY(om__add_tri(m, vert[0], vert[i - 1], vert[i]));
    return OM_OK;
}

OmStatus om__add_vtk_cell(OmFileMesh* m, int type, const int* vert, int nvert, bool* is_tet) {
    enum { TRIANGLE = 5, STRIP = 6, POLYGON = 7, QUAD = 9, TETRA = 10 };
    enum { TRIANGLE_QUADRATIC = 22, TETRA_QUADRATIC = 24 };
    *is_tet = false;
    switch (type) {
    case TETRA:
    case TETRA_QUADRATIC:
        OM_CHECK(nvert == (type == TETRA ? 4 : 10), OM_INVALID, "a tetrahedron of %d vertices",
                 nvert);
        *is_tet = true;
        OM_TRY(om__add_tet(m, vert));
        return type == TETRA ? OM_OK : om__set_mid(m, vert + 4);
    case TRIANGLE:
    case TRIANGLE_QUADRATIC:
        OM_CHECK(nvert == (type == TRIANGLE ? 3 : 6), OM_INVALID, "a triangle of %d vertices",
                 nvert);
        return om__add_tri(m, vert[0], vert[1], vert[2]);
    case QUAD:
    case POLYGON: return om__add_polygon(m, vert, nvert);
    case STRIP:
        for (int i = 2; i < nvert; i++) {
            int odd = i & 1;  // every second triangle has the opposite orientation
            OM_TRY(om__add_tri(m, vert[i - 2 + odd], vert[i - 1 - odd], vert[i]));
        }
        return OM_OK;
    default: return OM_OK;
    }
}

// ---- sets -------------------------------------------------------------------------------------------

// Files come from any program: control characters in names are escaped here, once for all formats.
static OmStatus plain_name(const char* name, size_t len, char out[OM_SET_NAME]) {
    OmText text = {0};
    OmStatus status = om_text_append_plain(&text, name, len);
    if (status == OM_OK && text.len >= OM_SET_NAME)
        status = om_error(OM_INVALID,
                          "the name of a set has too many characters that must be escaped, %zu "
                          "letters instead of %d: \"%.80s\"",
                          text.len, OM_SET_NAME - 1, text.str);
    if (status == OM_OK) memcpy(out, text.str, text.len + 1);
    om_text_done(&text);
    return status;
}

OmStatus om__file_set(OmFileMesh* m, const char* name, size_t len, int* index) {
    OM_CHECK(len > 0 && len < OM_SET_NAME, OM_INVALID,
             "the name of a set has %zu letters, 1 to %d are read: \"%.*s\"", len, OM_SET_NAME - 1,
             len < 80 ? (int)len : 80, name);
    char plain[OM_SET_NAME];
    OM_TRY(plain_name(name, len, plain));
    for (*index = 0; *index < m->nset; ++*index)
        if (strcmp(m->set[*index].name, plain) == 0) return OM_OK;
    OM_CHECK(m->nset < MAX_SET, OM_INVALID, "more than %d named sets", MAX_SET);
    OM_TRY(om__grow(&m->set, &m->setcap, m->nset + 1, sizeof *m->set));
    OmFileSet* set = &m->set[m->nset++];
    memset(set, 0, sizeof *set);
    memcpy(set->name, plain, sizeof plain);
    return OM_OK;
}

OmStatus om__add_set_vert(OmFileMesh* m, int set, int vert) {
    OmFileSet* s = &m->set[set];
    OM_TRY(om__grow(&s->vert, &s->cap, (int64_t)s->nvert + 1, sizeof(int)));
    s->vert[s->nvert++] = vert;
    return OM_OK;
}

// An array of zeros and ones is a set; any other array of bytes is ignored.
OmStatus om__add_point_flags(OmFileMesh* m, const char* name, size_t len, int first,
                             const int64_t* value, int count) {
    if (len == 0 || len >= OM_SET_NAME || memchr(name, 0, len)) return OM_OK;
    for (int i = 0; i < count; i++) {
        if (value[i] != 0 && value[i] != 1) return OM_OK;
    }
    int set;
    OM_TRY(om__file_set(m, name, len, &set));
    for (int i = 0; i < count; i++) {
        if (value[i]) OM_TRY(om__add_set_vert(m, set, first + i));
    }
    return OM_OK;
}
