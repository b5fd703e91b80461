// shape_weld.c: points that coincide: clusters within a tolerance, merged vertices, doubled faces of tetrahedra.
//
// Points are hashed by cells as wide as the tolerance. A point joins the first representative in the 27 cells around it
// that is near enough, else it represents itself; so a cell has few representatives, whatever the input.
#include <stdlib.h>
#include <string.h>

#include "base/base_union.h"
#include "omentum/shape_repair.h"
#include "shape/shape_internal.h"

static size_t cell_hash(const int64_t c[3]) {
    return (size_t)om_hash(c, 3 * sizeof *c, OM_HASH_SEED);
}

OmStatus om__points_cluster(const double* x, int n, const unsigned char* use, double tolerance,
                            int* rep) {
    OmStatus status = OM_OK;
    int *head = NULL, *next = NULL;
    size_t size = 64;
    while (size < (size_t)n) size *= 2;
    OM_ALLOC_DONE(head, size);
    OM_ALLOC_DONE(next, n);
    for (size_t i = 0; i < size; i++) head[i] = -1;
    for (int i = 0; i < n; i++) {
        rep[i] = i;
        if (use && !use[i]) continue;
        OmVec3 p = om_load3(x, i);
        // beyond 2^52 cells neighbours cannot be told apart anyway
        const double q[3] = {p.x / tolerance, p.y / tolerance, p.z / tolerance};
        int64_t cell[3];
        for (int a = 0; a < 3; a++) cell[a] = (int64_t)floor(fmax(-4e15, fmin(4e15, q[a])));
        int found = -1;
        for (int k = 0; k < 27; k++) {
            const int64_t at[3] = {cell[0] + k % 3 - 1, cell[1] + k / 3 % 3 - 1,
                                   cell[2] + k / 9 - 1};
            for (int r = head[cell_hash(at) & (size - 1)]; r >= 0; r = next[r])
                if ((found < 0 || r < found) && om_distance(p, om_load3(x, r)) <= tolerance)
                    found = r;
        }
        if (found >= 0) {
            rep[i] = found;
            continue;
        }
        int* first = &head[cell_hash(cell) & (size - 1)];
        next[i] = *first;
        *first = i;
    }
done:
    om_free(head);
    om_free(next);
    return status;
}

OmStatus om__surface_merge(OmSurface* s, double tolerance) {
    OmStatus status = OM_OK;
    int *rep = NULL, *map = NULL;
    OM_ALLOC_DONE(rep, s->nvert);
    OM_ALLOC_DONE(map, s->nvert);
    OM_TRY_DONE(om__points_cluster(s->x, s->nvert, NULL, tolerance, rep));
    for (int i = 0; i < s->nvert; i++) map[i] = -1;
    for (int i = 0; i < 3 * s->ntri; i++) {
        s->tri_vert[i] = rep[s->tri_vert[i]];
        map[s->tri_vert[i]] = 0;
    }
    int n = 0;
    for (int i = 0; i < s->nvert; i++) {
        if (map[i] < 0) continue;
        om_store3(s->x, n, om_load3(s->x, i));
        map[i] = n++;
    }
    for (int i = 0; i < 3 * s->ntri; i++) s->tri_vert[i] = map[s->tri_vert[i]];
    s->nvert = n;
done:
    om_free(rep);
    om_free(map);
    return status;
}

// ---- tetrahedra ----------------------------------------------------------------------------------------

typedef struct Face {
    int key[3];  // representatives, ascending
    int tri;     // of the boundary
} Face;

static int compare_faces(const void* a, const void* b) {
    const Face *p = a, *q = b;
    for (int c = 0; c < 3; c++)
        if (p->key[c] != q->key[c]) return p->key[c] < q->key[c] ? -1 : 1;
    return p->tri < q->tri ? -1 : p->tri > q->tri;
}

// The smallest index becomes the root.
static void join(int* parent, int a, int b) {
    a = om__find_root(parent, a), b = om__find_root(parent, b);
    if (a < b)
        parent[b] = a;
    else
        parent[a] = b;
}

static double weld_tolerance(const OmTetMesh* mesh, double tolerance) {
    OmVec3 lo = om_vec3(HUGE_VAL, HUGE_VAL, HUGE_VAL), hi = om_scale(-1, lo);
    double shortest = HUGE_VAL;
    for (int v = 0; v < mesh->nvert; v++) {
        lo = om_min3(lo, om_load3(mesh->x, v));
        hi = om_max3(hi, om_load3(mesh->x, v));
    }
    for (int e = 0; e < mesh->ntet; e++) {
        const int* v = mesh->tet_vert + 4 * (size_t)e;
        for (int a = 0; a < 4; a++)
            for (int b = a + 1; b < 4; b++)
                shortest =
                    fmin(shortest, om_distance(om_load3(mesh->x, v[a]), om_load3(mesh->x, v[b])));
    }
    if (!(tolerance > 0)) tolerance = 1e-6 * om_distance(lo, hi);
    return fmin(tolerance, 0.1 * shortest);
}

// Join the vertices of two faces, if one is the other one turned around and no vertex is shared twice.
static bool join_pair(const OmSurface* s, const int* rep, const int* vert, const Face* f,
                      int* parent) {
    const int *a = s->tri_vert + 3 * (size_t)f[0].tri, *b = s->tri_vert + 3 * (size_t)f[1].tri;
    int turn = 0;
    while (turn < 3 && rep[a[0]] != rep[b[turn]]) turn++;
    if (turn == 3 || rep[a[1]] != rep[b[(turn + 2) % 3]]) return false;
    for (int c = 0; c < 3; c++) join(parent, vert[a[c]], vert[b[(turn + 3 - c) % 3]]);
    return true;
}

// Number the roots and move everything of the mesh to them.
static OmStatus merge_roots(OmTetMesh* mesh, int* parent, int* map) {
    OmStatus status = OM_OK;
    OmTetMesh out = {0};
    int *list = NULL, n = 0;
    for (int v = 0; v < mesh->nvert; v++)
        if (om__find_root(parent, v) == v) map[v] = n++;
    for (int v = 0; v < mesh->nvert; v++) map[v] = map[om__find_root(parent, v)];
    OM_TRY_DONE(om_tet_mesh_init(&out, n, mesh->ntet));
    OM_ALLOC_DONE(list, mesh->nvert);
    for (int v = 0; v < mesh->nvert; v++)
        if (parent[v] == v) om_store3(out.x, map[v], om_load3(mesh->x, v));
    for (int i = 0; i < 4 * mesh->ntet; i++) out.tet_vert[i] = map[mesh->tet_vert[i]];
    memcpy(out.tet_label, mesh->tet_label, (size_t)mesh->ntet * sizeof(int));
    for (int s = 0; s < mesh->nset; s++) {
        for (int i = 0; i < mesh->set[s].nvert; i++) list[i] = map[mesh->set[s].vert[i]];
        OM_TRY_DONE(om_tet_mesh_add_set(&out, mesh->set[s].name, list, mesh->set[s].nvert));
    }
    OM_TRY_DONE(om_tet_mesh_validate(&out));
    om_tet_mesh_done(mesh);
    *mesh = out;
    out = (OmTetMesh){0};
done:
    om_tet_mesh_done(&out);
    om_free(list);
    return status;
}

OmStatus om_tet_mesh_weld(OmTetMesh* mesh, double tolerance, OmTetMeshWeld* report) {
    OmStatus status = OM_OK;
    OmTetMeshWeld local;
    OmSurface s = {0};
    int *vert = NULL, *rep = NULL, *parent = NULL, *map = NULL;
    Face* face = NULL;
    if (!report) report = &local;
    *report = (OmTetMeshWeld){0};
    OM_TRY(om_tet_mesh_validate(mesh));
    OM_TRY_DONE(om_tet_mesh_boundary(mesh, &s, &vert));
    tolerance = weld_tolerance(mesh, tolerance);
    if (!(tolerance > 0)) goto done;
    OM_ALLOC_DONE(rep, s.nvert);
    OM_ALLOC_DONE(face, s.ntri);
    OM_ALLOC_DONE(parent, mesh->nvert);
    OM_ALLOC_DONE(map, mesh->nvert);
    OM_TRY_DONE(om__points_cluster(s.x, s.nvert, NULL, tolerance, rep));
    for (int t = 0; t < s.ntri; t++) {
        face[t].tri = t;
        for (int c = 0; c < 3; c++) face[t].key[c] = rep[s.tri_vert[3 * t + c]];
        om_sort_ints(face[t].key, 3);
    }
    qsort(face, (size_t)s.ntri, sizeof *face, compare_faces);
    for (int v = 0; v < mesh->nvert; v++) parent[v] = v;
    int first = s.ntri;
    for (int begin = 0, end; begin < s.ntri; begin = end) {
        for (end = begin + 1;
             end < s.ntri && memcmp(face[begin].key, face[end].key, sizeof face[begin].key) == 0;)
            end++;
        // a face of three elements is no crack
        if (end - begin != 2 || !join_pair(&s, rep, vert, face + begin, parent)) continue;
        report->nface++;
        if (face[begin].tri < first) first = face[begin].tri;
    }
    if (report->nface == 0) goto done;
    const int* v = s.tri_vert + 3 * (size_t)first;
    report->first = om_scale(
        1.0 / 3, om_add(om_load3(s.x, v[0]), om_add(om_load3(s.x, v[1]), om_load3(s.x, v[2]))));
    const int before = mesh->nvert;
    OM_TRY_DONE(merge_roots(mesh, parent, map));
    report->nvert = before - mesh->nvert;
done:
    om_surface_done(&s);
    om_free(vert);
    om_free(rep);
    om_free(face);
    om_free(parent);
    om_free(map);
    return status;
}
