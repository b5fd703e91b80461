// shape_bisect.c: a finer mesh with a given number of vertices, by halving edges (Rivara 1984, longest edges).
//
// An edge is terminal if it is the longest one of every tetrahedron around it (of edges of equal length, the one of the
// smaller vertices). Halving it cuts each of these in two and leaves the mesh conforming. No tetrahedron has two such
// edges, so a round halves many: the longest ones, down to SHARE of the longest of all.
#include <stdlib.h>
#include <string.h>

#include "shape/shape_middles.h"

#define SHARE 0.7  // of the longest terminal edge: shorter ones wait for a later round

typedef struct Edge {
    int a, b;  // a < b
    int tet;
    double length2;
} Edge;

static int compare_ends(const void* p, const void* q) {
    const Edge *e = p, *f = q;
    if (e->a != f->a) return e->a < f->a ? -1 : 1;
    if (e->b != f->b) return e->b < f->b ? -1 : 1;
    return (e->tet > f->tet) - (e->tet < f->tet);
}

static int compare_length(const void* p, const void* q) {
    const Edge *e = p, *f = q;
    if (e->length2 != f->length2) return e->length2 > f->length2 ? -1 : 1;
    return compare_ends(p, q);
}

static bool has_same_ends(const Edge* e, const Edge* f) { return e->a == f->a && e->b == f->b; }

static Edge edge_of(const OmTetMesh* mesh, int t, int k) {
    const int* v = &mesh->tet_vert[4 * (size_t)t];
    int a = v[om__tet_edge[k][0]], b = v[om__tet_edge[k][1]];
    Edge e = {a < b ? a : b, a < b ? b : a, t, 0};
    e.length2 = om_norm2(om_sub(om_load3(mesh->x, e.a), om_load3(mesh->x, e.b)));
    return e;
}

// The terminal edges, longest first: all edges sorted by their ends, each run of equal ends compared with the longest
// edges of its tetrahedra. `all` has room for 6 ntet, the terminal ones come first.
static int find_terminal(const OmTetMesh* mesh, Edge* all, Edge* longest) {
    int nall = 6 * mesh->ntet, num = 0;
    for (int t = 0; t < mesh->ntet; ++t) {
        for (int k = 0; k < 6; ++k) {
            Edge e = all[6 * t + k] = edge_of(mesh, t, k);
            if (k == 0 || compare_length(&e, &longest[t]) < 0) longest[t] = e;
        }
    }
    qsort(all, (size_t)nall, sizeof *all, compare_ends);
    for (int i = 0, end; i < nall; i = end) {
        bool is_terminal = true;
        for (end = i; end < nall && has_same_ends(&all[end], &all[i]); ++end)
            is_terminal &= has_same_ends(&longest[all[end].tet], &all[i]);
        if (is_terminal) all[num++] = all[i];
    }
    qsort(all, (size_t)num, sizeof *all, compare_length);
    return num;
}

// Append copies of the tetrahedra around halved edges: the old one keeps end a, the new one end b. `mid` has the new
// vertex of each edge, in the order of `edge`, which is sorted by ends.
static int cut_tets(const OmTetMesh* mesh, const Edge* edge, int nedge, const Edge* longest,
                    OmTetMesh* fine) {
    int ntet = mesh->ntet;
    for (int t = 0; t < mesh->ntet; ++t) {
        Edge key = longest[t];
        const Edge* found = NULL;
        for (int lo = 0, hi = nedge; lo < hi && !found;) {
            int m = lo + (hi - lo) / 2;
            if (has_same_ends(&edge[m], &key))
                found = &edge[m];
            else if (edge[m].a < key.a || (edge[m].a == key.a && edge[m].b < key.b))
                lo = m + 1;
            else
                hi = m;
        }
        if (!found) continue;
        int *old = &fine->tet_vert[4 * (size_t)t], *add = &fine->tet_vert[4 * (size_t)ntet];
        memcpy(add, old, 4 * sizeof *add);
        for (int k = 0; k < 4; ++k) {
            if (old[k] == found->b) old[k] = mesh->nvert + (int)(found - edge);
            if (add[k] == found->a) add[k] = mesh->nvert + (int)(found - edge);
        }
        fine->tet_label[ntet++] = mesh->tet_label[t];
    }
    return ntet;
}

// One round: at most `most` of the longest terminal edges.
static OmStatus halve(OmTetMesh* mesh, int most) {
    OmTetMesh fine = {0};
    Edge *all = NULL, *longest = NULL;
    int* end = NULL;
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(all, 6 * (size_t)mesh->ntet);
    OM_ALLOC_DONE(longest, mesh->ntet);
    int num = find_terminal(mesh, all, longest), nedge = 0;
    while (nedge < num && nedge < most && all[nedge].length2 >= SHARE * SHARE * all[0].length2)
        ++nedge;
    qsort(all, (size_t)nedge, sizeof *all, compare_ends);
    OM_ALLOC_DONE(end, 2 * (size_t)nedge);
    OM_TRY_DONE(om_tet_mesh_init(&fine, mesh->nvert + nedge, 2 * mesh->ntet));
    memcpy(fine.tet_vert, mesh->tet_vert, 4 * (size_t)mesh->ntet * sizeof *fine.tet_vert);
    memcpy(fine.tet_label, mesh->tet_label, (size_t)mesh->ntet * sizeof *fine.tet_label);
    for (int e = 0; e < nedge; ++e) end[2 * e] = all[e].a, end[2 * e + 1] = all[e].b;
    OM_TRY_DONE(om__mesh_add_middles(mesh, nedge, end, &fine));
    fine.ntet = cut_tets(mesh, all, nedge, longest, &fine);
    om_tet_mesh_done(mesh);
    *mesh = fine;
    memset(&fine, 0, sizeof fine);
done:
    om_tet_mesh_done(&fine);
    om_free(all);
    om_free(longest);
    om_free(end);
    return status;
}

OmStatus om_tet_mesh_bisect(OmTetMesh* mesh, int min_nvert) {
    OmTetMesh fine = {0};
    OM_CHECK(mesh->ntet > 0, OM_INVALID, "mesh without tetrahedra: nothing to bisect");
    OM_CHECK(min_nvert <= INT32_MAX / 64, OM_INVALID, "%d vertices are too many", min_nvert);
    OM_TRY(om_tet_mesh_copy(mesh, &fine));
    OmStatus status = OM_OK;
    while (status == OM_OK && fine.nvert < min_nvert) {
        if (fine.ntet > INT32_MAX / 64)
            status =
                om_error(OM_INVALID, "mesh of %d tetrahedra is too large to bisect", fine.ntet);
        else
            status = halve(&fine, min_nvert - fine.nvert);
    }
    if (status == OM_OK) {
        om_tet_mesh_done(mesh);
        *mesh = fine;
        return OM_OK;
    }
    om_tet_mesh_done(&fine);
    return status;
}
