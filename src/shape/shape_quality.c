// shape_quality.c: measures of a mesh: dihedral angles, edges, connected parts, closed surfaces.
#include "shape/shape_internal.h"

#include <limits.h>
#include <string.h>

// ---- dihedral angles ------------------------------------------------------------------------------------

// The ends of each edge, and the two corners opposite to it.
static const int edge_corner[6][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2},
                                      {1, 2, 0, 3}, {1, 3, 2, 0}, {2, 3, 0, 1}};

// The angle between the two faces that meet in each edge of element e, rad.
static void dihedral_angles(const OmTetMesh* mesh, int e, double angle[6]) {
    const int* v = &mesh->tet_vert[4 * (size_t)e];
    OmVec3 x[4];
    for (int c = 0; c < 4; c++) x[c] = om_load3(mesh->x, v[c]);
    for (int i = 0; i < 6; i++) {
        const int* c = edge_corner[i];
        OmVec3 axis = om_sub(x[c[1]], x[c[0]]);
        OmVec3 p = om_cross(axis, om_sub(x[c[2]], x[c[0]]));
        OmVec3 q = om_cross(axis, om_sub(x[c[3]], x[c[0]]));
        angle[i] = atan2(om_norm(om_cross(p, q)), om_dot(p, q));
    }
}

void om_tet_dihedral(const OmTetMesh* mesh, int e, double* smallest, double* largest) {
    double angle[6];
    dihedral_angles(mesh, e, angle);
    *smallest = *largest = angle[0];
    for (int i = 1; i < 6; i++) {
        *smallest = fmin(*smallest, angle[i]);
        *largest = fmax(*largest, angle[i]);
    }
}

static void measure_angles(const OmTetMesh* mesh, OmMeshQuality* q) {
    q->dihedral_min = OM_PI;
    for (int e = 0; e < mesh->ntet; e++) {
        double angle[6];
        dihedral_angles(mesh, e, angle);
        for (int i = 0; i < 6; i++) {
            q->dihedral_min = fmin(q->dihedral_min, angle[i]);
            q->dihedral_max = fmax(q->dihedral_max, angle[i]);
            int bin = (int)(angle[i] * (OM_DIHEDRAL_BIN / OM_PI));
            q->dihedral_bin[bin < OM_DIHEDRAL_BIN ? bin : OM_DIHEDRAL_BIN - 1]++;
        }
    }
}

// ---- edges --------------------------------------------------------------------------------------------------

// Distinct edges, chained by their smaller vertex.
static OmStatus measure_edges(const OmTetMesh* mesh, OmMeshQuality* q) {
    OmStatus status = OM_OK;
    int *head = NULL, *next = NULL, *other = NULL, n = 0;
    double sum = 0;
    OM_CHECK(mesh->ntet < INT_MAX / 6, OM_INVALID, "%d tetrahedra are too many", mesh->ntet);
    OM_ALLOC_DONE(head, mesh->nvert);
    OM_ALLOC_DONE(next, 6 * (size_t)mesh->ntet);
    OM_ALLOC_DONE(other, 6 * (size_t)mesh->ntet);
    for (int v = 0; v < mesh->nvert; v++) head[v] = -1;
    q->edge_min = mesh->ntet ? HUGE_VAL : 0;
    for (int e = 0; e < mesh->ntet; e++) {
        const int* v = &mesh->tet_vert[4 * (size_t)e];
        for (int i = 0; i < 6; i++) {
            int a = v[edge_corner[i][0]], b = v[edge_corner[i][1]], known = -1;
            int lower = a < b ? a : b, upper = a < b ? b : a;
            for (known = head[lower]; known >= 0 && other[known] != upper;) known = next[known];
            if (known >= 0) continue;
            other[n] = upper;
            next[n] = head[lower];
            head[lower] = n++;
            double length = om_distance(om_load3(mesh->x, a), om_load3(mesh->x, b));
            q->edge_min = fmin(q->edge_min, length);
            q->edge_max = fmax(q->edge_max, length);
            sum += length;
        }
    }
    q->edge_mean = n ? sum / n : 0;
done:
    om_free(head);
    om_free(next);
    om_free(other);
    return status;
}

// ---- closed surfaces ---------------------------------------------------------------------------------------------

// Half-edges chained by their smaller vertex; `forward` counts those from the smaller to the larger
// one, `back` the others.
typedef struct EdgeTable {
    int *head, *next, *other, *forward, *back;
    int n;
} EdgeTable;

static OmStatus edge_table_init(const OmSurface* s, EdgeTable* t) {
    OmStatus status = OM_OK;
    memset(t, 0, sizeof *t);
    OM_CHECK(s->ntri < INT_MAX / 3, OM_INVALID, "%d triangles are too many", s->ntri);
    size_t nhalf = 3 * (size_t)s->ntri;
    OM_ALLOC_DONE(t->head, s->nvert);
    OM_ALLOC_DONE(t->next, nhalf);
    OM_ALLOC_DONE(t->other, nhalf);
    OM_CALLOC_DONE(t->forward, nhalf);
    OM_CALLOC_DONE(t->back, nhalf);
    for (int v = 0; v < s->nvert; v++) t->head[v] = -1;
    for (int f = 0; f < s->ntri; f++) {
        const int* v = &s->tri_vert[3 * (size_t)f];
        for (int c = 0; c < 3; c++) {
            int a = v[c], b = v[(c + 1) % 3];
            int lower = a < b ? a : b, upper = a < b ? b : a;
            int e = t->head[lower];
            while (e >= 0 && t->other[e] != upper) e = t->next[e];
            if (e < 0) {
                e = t->n++;
                t->other[e] = upper;
                t->next[e] = t->head[lower];
                t->head[lower] = e;
            }
            if (a < b)
                t->forward[e]++;
            else
                t->back[e]++;
        }
    }
done:
    return status;
}

static void edge_table_done(EdgeTable* t) {
    om_free(t->head);
    om_free(t->next);
    om_free(t->other);
    om_free(t->forward);
    om_free(t->back);
}

OmStatus om_surface_check_closed(const OmSurface* surface, int* euler) {
    OmStatus status = OM_OK;
    EdgeTable t = {0};
    OM_TRY_DONE(edge_table_init(surface, &t));
    if (euler) *euler = surface->nvert - t.n + surface->ntri;
    for (int v = 0; v < surface->nvert; v++) {
        for (int e = t.head[v]; e >= 0; e = t.next[e]) {
            OM_CHECK_DONE(t.forward[e] == 1 && t.back[e] == 1, OM_INVALID,
                          "the surface is not closed: edge %d-%d has %d triangles", v, t.other[e],
                          t.forward[e] + t.back[e]);
        }
    }
done:
    edge_table_done(&t);
    return status;
}

// ---- parts ------------------------------------------------------------------------------------------------------

// Number the parts that are connected by faces, in the order of their first element.
static OmStatus find_parts(const OmTetMesh* mesh, int* part, int* npart) {
    OmStatus status = OM_OK;
    int *neighbor = NULL, *stack = NULL;
    OM_ALLOC_DONE(neighbor, 4 * (size_t)mesh->ntet);
    OM_ALLOC_DONE(stack, mesh->ntet);
    OM_TRY_DONE(om__tet_neighbors(mesh, neighbor));
    *npart = 0;
    for (int e = 0; e < mesh->ntet; e++) part[e] = -1;
    for (int first = 0; first < mesh->ntet; first++) {
        if (part[first] >= 0) continue;
        int top = 0;
        stack[top++] = first;
        part[first] = *npart;
        while (top > 0) {
            int e = stack[--top];
            for (int f = 0; f < 4; f++) {
                int g = neighbor[4 * (size_t)e + (size_t)f];
                if (g < 0 || part[g] >= 0) continue;
                part[g] = *npart;
                stack[top++] = g;
            }
        }
        (*npart)++;
    }
done:
    om_free(neighbor);
    om_free(stack);
    return status;
}

static int renumber_set(OmMeshSet* set, const int* number) {
    int n = 0;
    for (int i = 0; i < set->nvert; i++) {
        if (number[set->vert[i]] >= 0) set->vert[n++] = number[set->vert[i]];
    }
    return set->nvert = n;
}

// Remove elements with keep[part] == 0 and unused vertices, in place.
static OmStatus drop_parts(OmTetMesh* mesh, const int* part, const unsigned char* keep) {
    int* number = om_alloc((size_t)mesh->nvert, sizeof *number);
    if (!number) return OM_NO_MEMORY;
    for (int v = 0; v < mesh->nvert; v++) number[v] = -1;
    int ntet = 0, nvert = 0;
    for (int e = 0; e < mesh->ntet; e++) {
        if (!keep[part[e]]) continue;
        for (int c = 0; c < 4; c++) {
            int v = mesh->tet_vert[4 * (size_t)e + (size_t)c];
            number[v] = 0;
            mesh->tet_vert[4 * (size_t)ntet + (size_t)c] = v;
        }
        mesh->tet_label[ntet++] = mesh->tet_label[e];
    }
    for (int v = 0; v < mesh->nvert; v++) {
        if (number[v] < 0) continue;
        om_store3(mesh->x, nvert, om_load3(mesh->x, v));
        number[v] = nvert++;
    }
    for (int i = 0; i < 4 * ntet; i++) mesh->tet_vert[i] = number[mesh->tet_vert[i]];
    for (int s = 0; s < mesh->nset; s++) renumber_set(&mesh->set[s], number);
    mesh->ntet = ntet;
    mesh->nvert = nvert;
    om_free(number);
    return OM_OK;
}

OmStatus om_tet_mesh_keep_parts(OmTetMesh* mesh, double min_share, int* nkept, int* nfound) {
    OmStatus status = OM_OK;
    int *part = NULL, *size = NULL, npart = 0, nkeep = 0;
    unsigned char* keep = NULL;
    OM_ALLOC_DONE(part, mesh->ntet);
    OM_TRY_DONE(find_parts(mesh, part, &npart));
    OM_CALLOC_DONE(size, npart);
    OM_CALLOC_DONE(keep, npart);
    int largest = 0;
    for (int e = 0; e < mesh->ntet; e++) size[part[e]]++;
    for (int p = 0; p < npart; p++) {
        if (size[p] > size[largest]) largest = p;
    }
    for (int p = 0; p < npart; p++) {
        keep[p] = p == largest || (min_share > 0 && size[p] >= min_share * mesh->ntet);
        nkeep += keep[p];
    }
    if (nkeep < npart) OM_TRY_DONE(drop_parts(mesh, part, keep));
    if (nkept) *nkept = nkeep;
    if (nfound) *nfound = npart;
done:
    om_free(part);
    om_free(size);
    om_free(keep);
    return status;
}

// ---- all measures -------------------------------------------------------------------------------------------

// Twice the number of edges between the boundary and the vertex furthest from it: a path through the mesh.
static int count_layers(const OmTetMesh* mesh, int nboundary, const int* boundary, int* depth) {
    int deepest = 0;
    for (int v = 0; v < mesh->nvert; v++) depth[v] = -1;
    for (int k = 0; k < nboundary; k++) depth[boundary[k]] = 0;
    for (bool is_growing = true; is_growing; deepest += is_growing) {
        is_growing = false;
        for (int e = 0; e < mesh->ntet; e++) {
            const int* v = mesh->tet_vert + 4 * (size_t)e;
            if (depth[v[0]] != deepest && depth[v[1]] != deepest && depth[v[2]] != deepest &&
                depth[v[3]] != deepest)
                continue;
            for (int a = 0; a < 4; a++) {
                if (depth[v[a]] >= 0) continue;
                depth[v[a]] = deepest + 1;
                is_growing = true;
            }
        }
    }
    return deepest > 0 ? 2 * deepest : 1;
}

OmStatus om_tet_mesh_quality(const OmTetMesh* mesh, OmMeshQuality* quality) {
    OmStatus status = OM_OK;
    OmSurface boundary = {0};
    int *part = NULL, *vert = NULL, *depth = NULL;
    memset(quality, 0, sizeof *quality);
    OM_TRY_DONE(om_tet_mesh_validate(mesh));
    OM_TRY_DONE(om_tet_mesh_boundary(mesh, &boundary, &vert));
    OM_ALLOC_DONE(part, mesh->ntet);
    OM_ALLOC_DONE(depth, mesh->nvert);
    OM_TRY_DONE(find_parts(mesh, part, &quality->npart));
    OM_TRY_DONE(om_stop_poll());
    quality->nlayer = count_layers(mesh, boundary.nvert, vert, depth);
    quality->nvert = mesh->nvert;
    quality->ntet = mesh->ntet;
    quality->nboundary_tri = boundary.ntri;
    quality->volume = om_tet_mesh_volume(mesh);
    OM_TRY_DONE(om_stop_poll());
    measure_angles(mesh, quality);
    OM_TRY_DONE(om_stop_poll());
    OM_TRY_DONE(measure_edges(mesh, quality));
    status = om_surface_check_closed(&boundary, &quality->euler);
    quality->is_manifold = status == OM_OK;
    if (status == OM_INVALID) status = OM_OK;
done:
    om_surface_done(&boundary);
    om_free(part);
    om_free(vert);
    om_free(depth);
    return status;
}
