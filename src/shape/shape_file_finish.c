// shape_file_finish.c: check the contents of a file and build a valid mesh or surface.
//
// Nothing in a file is trusted: indices, coordinates, orientation are checked. Errors count elements from
// 1, as the files do.
#include <string.h>

#include "shape/shape_file_internal.h"

static OmStatus check_indices(const char* what, const int* vert, int nitem, int per_item,
                              int nvert) {
    for (int i = 0; i < nitem * per_item; i++) {
        OM_CHECK(vert[i] >= 0 && vert[i] < nvert, OM_INVALID,
                 "%s %d names vertex %d, the file has %d", what, i / per_item + 1, vert[i] + 1,
                 nvert);
    }
    return OM_OK;
}

static OmStatus check_positions(const OmFileMesh* m, double unit) {
    OM_CHECK(isfinite(unit) && unit > 0, OM_INVALID, "unit: %g m is no length", unit);
    for (int i = 0; i < m->nvert; i++) {
        OM_CHECK(om_is_finite3(om_scale(unit, om_load3(m->x, i))), OM_INVALID,
                 "vertex %d: a coordinate is not a finite number", i + 1);
    }
    return OM_OK;
}

// ---- nodes on edges -----------------------------------------------------------------------------------

#define STRAIGHT 1e-3  // of the length of an edge: what a node may be away from the midpoint

// Edges of a tetrahedron, in the order of their nodes.
static const int edge[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};

static OmStatus check_mids(const OmFileMesh* m) {
    for (int i = 0; i < 6 * m->nmid; i++)
        OM_CHECK(m->mid[i] >= -1 && m->mid[i] < m->nvert, OM_INVALID,
                 "tetrahedron %d names vertex %d, the file has %d", i / 6 + 1, m->mid[i] + 1,
                 m->nvert);
    return OM_OK;
}

static OmStatus check_straight(const OmFileMesh* m) {
    for (int i = 0; i < 6 * m->nmid; i++) {
        if (m->mid[i] < 0) continue;
        const int* tet = m->tet + 4 * (size_t)(i / 6);
        const int a = tet[edge[i % 6][0]], b = tet[edge[i % 6][1]];
        OmVec3 p = om_load3(m->x, a), q = om_load3(m->x, b);
        double off = om_distance(om_load3(m->x, m->mid[i]), om_lerp(p, q, 0.5));
        OM_CHECK(off <= STRAIGHT * om_distance(p, q), OM_INVALID,
                 "tetrahedron %d is curved: node %d is %.3g off the midpoint of the edge from "
                 "vertex %d to %d, whose length is %.3g; OM_MESH_STRAIGHTEN leaves such nodes out, "
                 "om_tet10_mesh_load keeps them",
                 i / 6 + 1, m->mid[i] + 1, off, a + 1, b + 1, om_distance(p, q));
    }
    return OM_OK;
}

// map[i]: new index of vertex i, -1 if no item uses it (its old index if all are kept, but for nodes of edges). Returns
// the new count.
static int number_used(const OmFileMesh* m, const int* vert, int count, bool keep_unused,
                       int* map) {
    const int nvert = m->nvert;
    for (int i = 0; i < nvert; i++) map[i] = keep_unused ? 0 : -1;
    for (int i = 0; keep_unused && i < 6 * m->nmid; i++)
        if (m->mid[i] >= 0) map[m->mid[i]] = -1;
    for (int i = 0; i < count; i++) map[vert[i]] = 0;
    int n = 0;
    for (int i = 0; i < nvert; i++)
        if (map[i] == 0) map[i] = n++;
    return n;
}

static void copy_positions(const OmFileMesh* m, const int* map, double unit, double* x) {
    for (int i = 0; i < m->nvert; i++)
        if (map[i] >= 0) om_store3(x, map[i], om_scale(unit, om_load3(m->x, i)));
}

// ---- tetrahedra ---------------------------------------------------------------------------------------

// 6 times the volume over the cube of the longest edge from the first vertex: 0 flat, negative inverted.
static double orientation(const double* x, const int* v) {
    OmVec3 o = om_load3(x, v[0]);
    OmVec3 a = om_sub(om_load3(x, v[1]), o), b = om_sub(om_load3(x, v[2]), o);
    OmVec3 c = om_sub(om_load3(x, v[3]), o);
    double longest = fmax(om_norm(a), fmax(om_norm(b), om_norm(c)));
    if (!(longest > 0)) return 0;
    double s = 1 / longest;  // edges of length at most 1: the product neither over- nor underflows
    return om_dot(om_cross(om_scale(s, a), om_scale(s, b)), om_scale(s, c));
}

#define FLAT 1e-13  // rounding of the products of unit edges is 1e-16

static void swap(int* a, int* b) {
    int t = *a;
    *a = *b;
    *b = t;
}

// Select the elements to keep, and reorient them where the flags allow it, with all ten nodes if nnode is 10. Returns
// their number or an error.
static OmStatus orient(const OmFileMesh* m, unsigned flags, int nnode, int* tet, int* label,
                       int* ntet) {
    *ntet = 0;
    for (int e = 0; e < m->ntet; e++) {
        int v[10];
        memcpy(v, m->tet + 4 * (size_t)e, 4 * sizeof *v);
        if (nnode == 10) memcpy(v + 4, m->mid + 6 * (size_t)e, 6 * sizeof *v);
        double det = orientation(m->x, v);
        bool is_flat = fabs(det) <= FLAT;
        if (is_flat && flags & OM_MESH_DROP_FLAT) continue;
        OM_CHECK(!is_flat, OM_INVALID, "tetrahedron %d is flat: its volume is zero", e + 1);
        if (det < 0) {
            OM_CHECK(
                flags & OM_MESH_FLIP, OM_INVALID,
                "tetrahedron %d is inverted: its vertices 2 to 4 run clockwise seen from the first",
                e + 1);
            swap(&v[2], &v[3]);
            if (nnode == 10) swap(&v[5], &v[8]);  // edges 12 and 13
            if (nnode == 10) swap(&v[6], &v[7]);  // 02 and 03
        }
        memcpy(tet + (size_t)nnode * (size_t)*ntet, v, (size_t)nnode * sizeof *v);
        label[*ntet] = e < m->nlabel ? m->label[e] : 0;
        ++*ntet;
    }
    return OM_OK;
}

static OmStatus copy_sets(const OmFileMesh* m, const int* map, OmTetMesh* mesh) {
    int* list = om_alloc((size_t)m->nvert, sizeof *list);
    if (!list) return OM_NO_MEMORY;
    OmStatus status = OM_OK;
    unsigned char* is_in = NULL;
    OM_ALLOC_DONE(is_in, m->nvert);
    for (int s = 0; s < m->nset; s++) {
        int n = 0;
        memset(is_in, 0, (size_t)m->nvert);
        for (int i = 0; i < m->set[s].nvert; i++) {
            int v = m->set[s].vert[i];
            OM_CHECK_DONE(v >= 0 && v < m->nvert, OM_INVALID,
                          "set %s names vertex %d, the file has %d", m->set[s].name, v + 1,
                          m->nvert);
            if (map[v] >= 0 && !is_in[v]) list[n++] = map[v];
            is_in[v] = 1;
        }
        if (n > 0) OM_TRY_DONE(om_tet_mesh_add_set(mesh, m->set[s].name, list, n));
    }
done:
    om_free(is_in);
    om_free(list);
    return status;
}

static OmStatus check_tets(const OmFileMesh* m, double unit) {
    OM_CHECK(m->ntet > 0, OM_INVALID, "the file has no tetrahedra");
    OM_TRY(check_indices("tetrahedron", m->tet, m->ntet, 4, m->nvert));
    OM_TRY(check_mids(m));
    return check_positions(m, unit);
}

OmStatus om__finish_tet_mesh(const OmFileMesh* m, double unit, unsigned flags, OmTetMesh* mesh) {
    OmStatus status = OM_OK;
    int *tet = NULL, *label = NULL, *map = NULL;
    int ntet = 0;
    memset(mesh, 0, sizeof *mesh);
    OM_TRY(check_tets(m, unit));
    if (!(flags & OM_MESH_STRAIGHTEN)) OM_TRY(check_straight(m));
    OM_ALLOC_DONE(tet, 4 * (size_t)m->ntet);
    OM_ALLOC_DONE(label, m->ntet);
    OM_ALLOC_DONE(map, m->nvert);
    OM_TRY_DONE(orient(m, flags, 4, tet, label, &ntet));
    OM_CHECK_DONE(ntet > 0, OM_INVALID, "all %d tetrahedra of the file are flat", m->ntet);

    int nvert = number_used(m, tet, 4 * ntet, flags & OM_MESH_KEEP_UNUSED, map);
    OM_TRY_DONE(om_tet_mesh_init(mesh, nvert, ntet));
    copy_positions(m, map, unit, mesh->x);
    for (int i = 0; i < 4 * ntet; i++) mesh->tet_vert[i] = map[tet[i]];
    memcpy(mesh->tet_label, label, (size_t)ntet * sizeof(int));
    OM_TRY_DONE(copy_sets(m, map, mesh));
    OM_TRY_DONE(om_tet_mesh_validate(mesh));
done:
    om_free(tet);
    om_free(label);
    om_free(map);
    if (status < 0) om_tet_mesh_done(mesh);
    return status;
}

void om__count_changes(const OmFileMesh* m, double unit, unsigned flags, OmMeshReading* reading) {
    for (int e = 0; e < m->ntet; e++) {
        const double det = orientation(m->x, m->tet + 4 * (size_t)e);
        const bool is_flat = fabs(det) <= FLAT;
        reading->nflat += is_flat && flags & OM_MESH_DROP_FLAT;
        if (is_flat || !(det < 0)) continue;
        if (reading->nturned++ == 0) reading->first_turned = e + 1;
    }
    for (int i = 0; i < 6 * m->nmid; i++) {
        if (m->mid[i] < 0) continue;
        const int* tet = m->tet + 4 * (size_t)(i / 6);
        OmVec3 p = om_load3(m->x, tet[edge[i % 6][0]]), q = om_load3(m->x, tet[edge[i % 6][1]]);
        double off = om_distance(om_load3(m->x, m->mid[i]), om_lerp(p, q, 0.5));
        reading->nmid++;
        reading->mid_most = fmax(reading->mid_most, unit * off);
    }
}

OmStatus om__finish_tet10_mesh(const OmFileMesh* m, double unit, unsigned flags,
                               OmTet10Mesh* mesh) {
    OmStatus status = OM_OK;
    OmTetMesh nodes = {0};  // for its sets
    int *map = NULL, *node = NULL, *label = NULL, nelem = 0;
    *mesh = (OmTet10Mesh){0};
    OM_TRY(check_tets(m, unit));
    for (int e = 0; e < m->ntet; e++)
        for (int k = 0; k < 6; k++)
            OM_CHECK(e < m->nmid && m->mid[6 * (size_t)e + (size_t)k] >= 0, OM_INVALID,
                     "tetrahedron %d has four nodes, ten are wanted; om_tet_mesh_load reads it",
                     e + 1);
    OM_ALLOC_DONE(map, m->nvert);
    OM_ALLOC_DONE(node, 10 * (size_t)m->ntet);
    OM_ALLOC_DONE(label, m->ntet);
    OM_TRY_DONE(orient(m, flags, 10, node, label, &nelem));
    OM_CHECK_DONE(nelem > 0, OM_INVALID, "all %d tetrahedra of the file are flat", m->ntet);
    nodes.nvert = number_used(m, node, 10 * nelem, false, map);
    OM_TRY_DONE(copy_sets(m, map, &nodes));
    OM_TRY_DONE(om_tet10_mesh_init(mesh, nodes.nvert, nelem));
    copy_positions(m, map, unit, mesh->x);
    for (int i = 0; i < 10 * nelem; i++) mesh->elem_node[i] = map[node[i]];
    memcpy(mesh->elem_label, label, (size_t)nelem * sizeof(int));
    mesh->nset = nodes.nset;
    mesh->set = nodes.set;
    nodes = (OmTetMesh){0};
    OM_TRY_DONE(om_tet10_mesh_validate(mesh));
done:
    om_free(map);
    om_free(node);
    om_free(label);
    om_tet_mesh_done(&nodes);
    if (status < 0) om_tet10_mesh_done(mesh);
    return status;
}

// ---- surfaces ------------------------------------------------------------------------------------------

// same[i]: the first vertex at exactly the position of vertex i. Open addressing; -0 and 0 are equal.
static OmStatus merge_equal(const OmFileMesh* m, int* same) {
    size_t size = 64;
    while (size < 2 * (size_t)m->nvert) size *= 2;
    int* table = om_alloc(size, sizeof *table);
    if (!table) return OM_NO_MEMORY;
    for (size_t i = 0; i < size; i++) table[i] = -1;
    for (int i = 0; i < m->nvert; i++) {
        OmVec3 p = om_load3(m->x, i);
        double key[3] = {p.x + 0.0, p.y + 0.0, p.z + 0.0};  // -0 + 0 is 0
        size_t at = (size_t)om_hash(key, sizeof key, OM_HASH_SEED) & (size - 1);
        while (table[at] >= 0) {
            OmVec3 q = om_load3(m->x, table[at]);
            if (p.x == q.x && p.y == q.y && p.z == q.z) break;
            at = (at + 1) & (size - 1);
        }
        if (table[at] < 0) table[at] = i;
        same[i] = table[at];
    }
    om_free(table);
    return OM_OK;
}

// A file of tetrahedra without triangles: their boundary.
static OmStatus finish_boundary(const OmFileMesh* m, double unit, unsigned flags,
                                OmSurface* surface) {
    OmTetMesh mesh;
    flags |= OM_MESH_FLIP | OM_MESH_DROP_FLAT | OM_MESH_STRAIGHTEN;
    OM_TRY(om__finish_tet_mesh(m, unit, flags, &mesh));
    OmStatus status = om_tet_mesh_boundary(&mesh, surface, NULL);
    om_tet_mesh_done(&mesh);
    if (status == OM_OK && surface->ntri == 0) {
        om_surface_done(surface);
        return om_error(OM_INVALID, "the tetrahedra have no outer face: they occur twice");
    }
    return status;
}

OmStatus om__finish_surface(const OmFileMesh* m, double unit, unsigned flags, OmSurface* surface) {
    OmStatus status = OM_OK;
    int *tri = NULL, *map = NULL;
    int ntri = 0;
    memset(surface, 0, sizeof *surface);
    if (m->ntri == 0 && m->ntet > 0) return finish_boundary(m, unit, flags, surface);
    OM_CHECK(m->ntri > 0, OM_INVALID, "the file has no triangles");
    OM_TRY(check_indices("triangle", m->tri, m->ntri, 3, m->nvert));
    OM_TRY(check_positions(m, unit));
    OM_ALLOC_DONE(tri, 3 * (size_t)m->ntri);
    OM_ALLOC_DONE(map, m->nvert);
    memcpy(tri, m->tri, 3 * (size_t)m->ntri * sizeof(int));
    if (m->is_soup) {
        OM_TRY_DONE(merge_equal(m, map));
        for (int i = 0; i < 3 * m->ntri; i++) tri[i] = map[tri[i]];
    }
    // triangles with a repeated vertex have no area, and removing them disconnects nothing
    for (int t = 0; t < m->ntri; t++) {
        const int* v = tri + 3 * (size_t)t;
        const bool is_degenerate = v[0] == v[1] || v[1] == v[2] || v[2] == v[0];
        if (is_degenerate && !(flags & OM_MESH_KEEP_DEGENERATE)) continue;
        memmove(tri + 3 * (size_t)ntri++, v, 3 * sizeof(int));
    }
    OM_CHECK_DONE(ntri > 0, OM_INVALID, "all %d triangles of the file are degenerate", m->ntri);

    bool keep = flags & OM_MESH_KEEP_UNUSED && !m->is_soup;
    int nvert = number_used(m, tri, 3 * ntri, keep, map);
    OM_TRY_DONE(om_surface_init(surface, nvert, ntri));
    copy_positions(m, map, unit, surface->x);
    for (int i = 0; i < 3 * ntri; i++) surface->tri_vert[i] = map[tri[i]];
done:
    om_free(tri);
    om_free(map);
    if (status < 0) om_surface_done(surface);
    return status;
}
