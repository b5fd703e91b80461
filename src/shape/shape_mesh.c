// shape_mesh.c: creation and destruction of surfaces and tetrahedral meshes, named sets, box meshes, boundaries.
//
// A boundary face belongs to a single element. Faces are chained by their smallest vertex, so the
// partner of a face is found among a dozen others without sorting. Faces keep the order of their
// elements, so the result depends on the mesh alone.
#include "shape/shape_internal.h"

#include <limits.h>
#include <string.h>

#define POLL 65536  // faces between two polls for a request to stop

const int om__face_corner[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
const int om__face_opposite[4] = {3, 2, 0, 1};

OmStatus om_surface_init(OmSurface* surface, int nvert, int ntri) {
    memset(surface, 0, sizeof *surface);
    OM_CHECK(nvert >= 0 && ntri >= 0, OM_INVALID, "a surface of %d vertices and %d triangles",
             nvert, ntri);
    surface->x = om_calloc((size_t)nvert, 3 * sizeof(double));
    surface->tri_vert = om_calloc((size_t)ntri, 3 * sizeof(int));
    if (!surface->x || !surface->tri_vert) {
        om_surface_done(surface);
        return OM_NO_MEMORY;
    }
    surface->nvert = nvert;
    surface->ntri = ntri;
    return OM_OK;
}

void om_surface_done(OmSurface* surface) {
    if (!surface) return;
    om_free(surface->x);
    om_free(surface->tri_vert);
    memset(surface, 0, sizeof *surface);
}

OmStatus om_tet_mesh_init(OmTetMesh* mesh, int nvert, int ntet) {
    memset(mesh, 0, sizeof *mesh);
    OM_CHECK(nvert >= 0 && ntet >= 0, OM_INVALID, "a mesh of %d vertices and %d tetrahedra", nvert,
             ntet);
    mesh->x = om_calloc((size_t)nvert, 3 * sizeof(double));
    mesh->tet_vert = om_calloc((size_t)ntet, 4 * sizeof(int));
    mesh->tet_label = om_calloc((size_t)ntet, sizeof(int));
    if (!mesh->x || !mesh->tet_vert || !mesh->tet_label) {
        om_tet_mesh_done(mesh);
        return OM_NO_MEMORY;
    }
    mesh->nvert = nvert;
    mesh->ntet = ntet;
    return OM_OK;
}

void om_tet_mesh_done(OmTetMesh* mesh) {
    if (!mesh) return;
    for (int s = 0; s < mesh->nset; s++) om_free(mesh->set[s].vert);
    om_free(mesh->set);
    om_free(mesh->x);
    om_free(mesh->tet_vert);
    om_free(mesh->tet_label);
    memset(mesh, 0, sizeof *mesh);
}

OmStatus om_tet_mesh_copy(const OmTetMesh* mesh, OmTetMesh* out) {
    OM_TRY(om_tet_mesh_init(out, mesh->nvert, mesh->ntet));
    memcpy(out->x, mesh->x, (size_t)mesh->nvert * 3 * sizeof(double));
    memcpy(out->tet_vert, mesh->tet_vert, (size_t)mesh->ntet * 4 * sizeof(int));
    memcpy(out->tet_label, mesh->tet_label, (size_t)mesh->ntet * sizeof(int));
    for (int s = 0; s < mesh->nset; s++) {
        const OmMeshSet* set = &mesh->set[s];
        OmStatus status = om_tet_mesh_add_set(out, set->name, set->vert, set->nvert);
        if (status < 0) {
            om_tet_mesh_done(out);
            return status;
        }
    }
    return OM_OK;
}

static OmStatus join_sets(const OmTetMesh* a, const OmTetMesh* b, OmTetMesh* out) {
    for (int s = 0; s < a->nset + b->nset; ++s) {
        const OmMeshSet* set = s < a->nset ? &a->set[s] : &b->set[s - a->nset];
        const OmMeshSet* first = om_tet_mesh_find_set(a, set->name);
        if (s >= a->nset && first) continue;  // was joined with the first one
        const OmMeshSet* second = om_tet_mesh_find_set(b, set->name);
        int na = first ? first->nvert : 0, nb = second ? second->nvert : 0;
        int* vert = om_alloc((size_t)na + (size_t)nb, sizeof *vert);
        if (!vert) return OM_NO_MEMORY;
        for (int k = 0; k < na; ++k) vert[k] = first->vert[k];
        for (int k = 0; k < nb; ++k) vert[na + k] = second->vert[k] + a->nvert;
        OmStatus status = om_tet_mesh_add_set(out, set->name, vert, na + nb);
        om_free(vert);
        if (status < 0) return status;
    }
    return OM_OK;
}

OmStatus om_tet_mesh_join(const OmTetMesh* a, const OmTetMesh* b, OmTetMesh* out) {
    *out = (OmTetMesh){0};
    OM_CHECK((int64_t)a->nvert + b->nvert < INT32_MAX / 4 &&
                 (int64_t)a->ntet + b->ntet < INT32_MAX / 16,
             OM_INVALID, "meshes of %d and %d vertices are too large for one", a->nvert, b->nvert);
    OmTetMesh all;
    OM_TRY(om_tet_mesh_init(&all, a->nvert + b->nvert, a->ntet + b->ntet));
    memcpy(all.x, a->x, 3 * (size_t)a->nvert * sizeof(double));
    memcpy(all.x + 3 * (size_t)a->nvert, b->x, 3 * (size_t)b->nvert * sizeof(double));
    memcpy(all.tet_vert, a->tet_vert, 4 * (size_t)a->ntet * sizeof(int));
    for (size_t k = 0; k < 4 * (size_t)b->ntet; ++k)
        all.tet_vert[4 * (size_t)a->ntet + k] = b->tet_vert[k] + a->nvert;
    memcpy(all.tet_label, a->tet_label, (size_t)a->ntet * sizeof(int));
    memcpy(all.tet_label + a->ntet, b->tet_label, (size_t)b->ntet * sizeof(int));
    OmStatus status = join_sets(a, b, &all);
    if (status < 0)
        om_tet_mesh_done(&all);
    else
        *out = all;
    return status;
}

// ---- named sets -------------------------------------------------------------------------------------

// Sort and remove repeats with one flag per vertex: linear, and a set often has half the vertices of the mesh.
static OmStatus sorted_unique(int nmesh, const int* vert, int nvert, int** out, int* nout) {
    unsigned char* is_in = om_calloc((size_t)nmesh, 1);
    if (!is_in) return OM_NO_MEMORY;
    int count = 0;
    for (int i = 0; i < nvert; i++) {
        if (!is_in[vert[i]]) {
            is_in[vert[i]] = 1;
            count++;
        }
    }
    int* list = om_alloc((size_t)count, sizeof *list);
    if (list) {
        int n = 0;
        for (int v = 0; v < nmesh; v++) {
            if (is_in[v]) list[n++] = v;
        }
    }
    om_free(is_in);
    *out = list;
    *nout = count;
    return list ? OM_OK : OM_NO_MEMORY;
}

OmStatus om_tet_mesh_add_set(OmTetMesh* mesh, const char* name, const int* vert, int nvert) {
    OM_CHECK(name && name[0] && strlen(name) < OM_SET_NAME, OM_INVALID,
             "the name of a set must have 1 to %d characters", OM_SET_NAME - 1);
    OM_CHECK(om_text_is_plain(name, strlen(name), NULL), OM_INVALID,
             "the name of a set, \"%s\", is no UTF-8 or has a control character", name);
    OM_CHECK(nvert >= 0, OM_INVALID, "set %s has %d vertices", name, nvert);
    for (int i = 0; i < nvert; i++) {
        OM_CHECK(vert[i] >= 0 && vert[i] < mesh->nvert, OM_INVALID,
                 "set %s names vertex %d of a mesh of %d", name, vert[i], mesh->nvert);
    }
    int* list = NULL;
    int count = 0;
    OM_TRY(sorted_unique(mesh->nvert, vert, nvert, &list, &count));
    OmMeshSet* old = (OmMeshSet*)om_tet_mesh_find_set(mesh, name);
    if (old) {
        om_free(old->vert);
        old->vert = list;
        old->nvert = count;
        return OM_OK;
    }
    OmMeshSet* grown =
        om_realloc(mesh->set, (size_t)mesh->nset, (size_t)mesh->nset + 1, sizeof *grown);
    if (!grown) {
        om_free(list);
        return OM_NO_MEMORY;
    }
    mesh->set = grown;
    OmMeshSet* set = &grown[mesh->nset++];
    memset(set, 0, sizeof *set);
    memcpy(set->name, name, strlen(name) + 1);
    set->vert = list;
    set->nvert = count;
    return OM_OK;
}

const OmMeshSet* om_tet_mesh_find_set(const OmTetMesh* mesh, const char* name) {
    for (int s = 0; s < mesh->nset; s++) {
        if (strcmp(mesh->set[s].name, name) == 0) return &mesh->set[s];
    }
    return NULL;
}

// ---- boxes --------------------------------------------------------------------------------------------

// Kuhn's division of a cube: each order of the three axes is a path from corner 000 to corner 111,
// and one tetrahedron. For odd orders two corners are exchanged so that the volume is positive.
static const int kuhn_order[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1},
                                     {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};

static void box_cell(const int stride[3], int corner, int* tet) {
    for (int k = 0; k < 6; k++) {
        int v[4] = {corner, 0, 0, 0};
        for (int a = 0; a < 3; a++) v[a + 1] = v[a] + stride[kuhn_order[k][a]];
        bool is_odd = k >= 3;
        tet[4 * k] = v[0];
        tet[4 * k + 1] = is_odd ? v[2] : v[1];
        tet[4 * k + 2] = is_odd ? v[1] : v[2];
        tet[4 * k + 3] = v[3];
    }
}

OmStatus om_tet_mesh_box(OmVec3 lo, OmVec3 hi, int nx, int ny, int nz, OmTetMesh* mesh) {
    memset(mesh, 0, sizeof *mesh);
    OM_CHECK(nx > 0 && ny > 0 && nz > 0, OM_INVALID, "a box mesh of %d x %d x %d cells", nx, ny,
             nz);
    OM_CHECK(om_is_finite3(lo) && om_is_finite3(hi) && hi.x > lo.x && hi.y > lo.y && hi.z > lo.z,
             OM_INVALID, "a box mesh must have positive extent");
    double ncell = (double)nx * ny * nz;
    OM_CHECK(ncell * 6 < INT_MAX / 4, OM_INVALID, "a box mesh of %.0f cells is too large", ncell);
    OM_TRY(om_tet_mesh_init(mesh, (nx + 1) * (ny + 1) * (nz + 1), 6 * nx * ny * nz));
    OmVec3 size = om_sub(hi, lo);
    int v = 0;
    for (int k = 0; k <= nz; k++) {
        for (int j = 0; j <= ny; j++) {
            for (int i = 0; i <= nx; i++) {
                om_store3(mesh->x, v++,
                          om_vec3(lo.x + size.x * i / nx, lo.y + size.y * j / ny,
                                  lo.z + size.z * k / nz));
            }
        }
    }
    const int stride[3] = {1, nx + 1, (nx + 1) * (ny + 1)};
    int* tet = mesh->tet_vert;
    for (int k = 0; k < nz; k++) {
        for (int j = 0; j < ny; j++) {
            for (int i = 0; i < nx; i++) {
                box_cell(stride, i + stride[1] * j + stride[2] * k, tet);
                tet += 24;
            }
        }
    }
    return OM_OK;
}

// ---- boundary -------------------------------------------------------------------------------------------

static void face_of(const OmTetMesh* mesh, int face, int vert[3]) {
    const int* tet = &mesh->tet_vert[4 * (size_t)(face / 4)];
    for (int c = 0; c < 3; c++) vert[c] = tet[om__face_corner[face % 4][c]];
}

static void sort_three(int v[3]) {
    for (int pass = 0; pass < 2; pass++) {
        for (int c = 0; c < 2; c++) {
            if (v[c] > v[c + 1]) {
                int t = v[c];
                v[c] = v[c + 1];
                v[c + 1] = t;
            }
        }
    }
}

// Faces lie in buckets of their lowest vertex, the other two vertices of each as one key: a bucket is read in order.
OmStatus om__tet_neighbors(const OmTetMesh* mesh, int* neighbor) {
    OmStatus status = OM_OK;
    int *begin = NULL, *end = NULL, *bucket = NULL;
    uint64_t* key = NULL;
    OM_CHECK(mesh->ntet <= INT_MAX / 4, OM_INVALID, "%d tetrahedra are too many", mesh->ntet);
    const int nface = 4 * mesh->ntet;
    OM_CALLOC_DONE(begin, (size_t)mesh->nvert + 1);
    OM_ALLOC_DONE(end, mesh->nvert);
    OM_ALLOC_DONE(bucket, nface);
    OM_ALLOC_DONE(key, nface);
    for (int f = 0; f < nface; f++) {
        int v[3];
        face_of(mesh, f, v);
        begin[1 + (v[0] < v[1] ? (v[0] < v[2] ? v[0] : v[2]) : (v[1] < v[2] ? v[1] : v[2]))]++;
    }
    for (int v = 0; v < mesh->nvert; v++) begin[v + 1] += begin[v];
    memcpy(end, begin, (size_t)mesh->nvert * sizeof *end);
    for (int f = 0; f < nface; f++) {
        int v[3], partner = -1;
        if (f % POLL == 0) OM_TRY_DONE(om_stop_poll());
        face_of(mesh, f, v);
        sort_three(v);
        const uint64_t mine = (uint64_t)v[1] << 32 | (uint64_t)v[2];
        for (int i = begin[v[0]]; i < end[v[0]]; i++) {
            if (key[i] != mine) continue;
            OM_CHECK_DONE(partner < 0, OM_INVALID,
                          "element %d: face %d %d %d belongs to three elements", f / 4, v[0], v[1],
                          v[2]);
            partner = bucket[i];
        }
        bucket[end[v[0]]] = f;
        key[end[v[0]]++] = mine;
        neighbor[f] = partner < 0 ? -1 : partner / 4;
        if (partner >= 0) neighbor[partner] = f / 4;
    }
done:
    om_free(begin);
    om_free(end);
    om_free(bucket);
    om_free(key);
    return status;
}

OmStatus om_tet_mesh_boundary(const OmTetMesh* mesh, OmSurface* surface, int** surface_vert) {
    OmStatus status = OM_OK;
    int *neighbor = NULL, *number = NULL, *list = NULL, nface = 0, nvert = 0;
    memset(surface, 0, sizeof *surface);
    if (surface_vert) *surface_vert = NULL;
    OM_ALLOC_DONE(neighbor, 4 * (size_t)mesh->ntet);
    OM_TRY_DONE(om__tet_neighbors(mesh, neighbor));

    // number the vertices of the boundary in their order in the mesh
    OM_CALLOC_DONE(number, mesh->nvert);
    for (int f = 0; f < 4 * mesh->ntet; f++) {
        int v[3];
        if (neighbor[f] >= 0) continue;
        nface++;
        face_of(mesh, f, v);
        for (int c = 0; c < 3; c++) number[v[c]] = 1;
    }
    for (int v = 0; v < mesh->nvert; v++) nvert += number[v];
    OM_ALLOC_DONE(list, nvert);
    OM_TRY_DONE(om_surface_init(surface, nvert, nface));
    nvert = 0;
    for (int v = 0; v < mesh->nvert; v++) {
        if (!number[v]) continue;
        om_store3(surface->x, nvert, om_load3(mesh->x, v));
        list[nvert] = v;
        number[v] = nvert++;
    }

    // the triangles, in the order of their elements
    int* tri = surface->tri_vert;
    for (int f = 0; f < 4 * mesh->ntet; f++) {
        int v[3];
        if (neighbor[f] >= 0) continue;
        face_of(mesh, f, v);
        for (int c = 0; c < 3; c++) *tri++ = number[v[c]];
    }
    if (surface_vert) {
        *surface_vert = list;
        list = NULL;
    }
done:
    om_free(neighbor);
    om_free(number);
    om_free(list);
    return status;
}

// ---- checks and measures ----------------------------------------------------------------------------------

// Six times the signed volume of element e.
static double tet_det(const OmTetMesh* mesh, int e) {
    const int* v = &mesh->tet_vert[4 * (size_t)e];
    OmVec3 a = om_load3(mesh->x, v[0]);
    OmVec3 ab = om_sub(om_load3(mesh->x, v[1]), a);
    OmVec3 ac = om_sub(om_load3(mesh->x, v[2]), a);
    OmVec3 ad = om_sub(om_load3(mesh->x, v[3]), a);
    return om_dot(om_cross(ab, ac), ad);
}

OmStatus om_tet_mesh_validate(const OmTetMesh* mesh) {
    OM_CHECK(mesh->ntet > 0, OM_INVALID, "the mesh has no tetrahedra");
    for (int v = 0; v < mesh->nvert; v++) {
        OM_CHECK(om_is_finite3(om_load3(mesh->x, v)), OM_INVALID,
                 "vertex %d of the mesh has a coordinate that is not finite", v);
    }
    for (int e = 0; e < mesh->ntet; e++) {
        for (int c = 0; c < 4; c++) {
            int v = mesh->tet_vert[4 * (size_t)e + (size_t)c];
            OM_CHECK(v >= 0 && v < mesh->nvert, OM_INVALID,
                     "element %d names vertex %d of a mesh of %d vertices", e, v, mesh->nvert);
        }
        double det = tet_det(mesh, e);
        OM_CHECK(det > 0, OM_INVALID, "element %d is %s (volume %.3g m3)", e,
                 det < 0 ? "inverted" : "flat", det / 6);
    }
    for (int s = 0; s < mesh->nset; s++) {
        const OmMeshSet* set = &mesh->set[s];
        for (int i = 0; i < set->nvert; i++) {
            bool is_ascending = i == 0 || set->vert[i] > set->vert[i - 1];
            OM_CHECK(is_ascending && set->vert[i] >= 0 && set->vert[i] < mesh->nvert, OM_INVALID,
                     "set %s: entry %d (vertex %d) is out of range or out of order", set->name, i,
                     set->vert[i]);
        }
    }
    return OM_OK;
}

double om_tet_mesh_volume(const OmTetMesh* mesh) {
    double sum = 0;
    for (int e = 0; e < mesh->ntet; e++) sum += tet_det(mesh, e);
    return sum / 6;
}

double om_surface_volume(const OmSurface* surface) {
    if (surface->nvert == 0) return 0;
    double sum = 0;  // divergence theorem, from the first vertex, which keeps the numbers small
    OmVec3 o = om_load3(surface->x, 0);
    for (int t = 0; t < surface->ntri; t++) {
        const int* v = &surface->tri_vert[3 * (size_t)t];
        OmVec3 a = om_sub(om_load3(surface->x, v[0]), o);
        OmVec3 b = om_sub(om_load3(surface->x, v[1]), o);
        OmVec3 c = om_sub(om_load3(surface->x, v[2]), o);
        sum += om_dot(om_cross(a, b), c);
    }
    return sum / 6;
}
