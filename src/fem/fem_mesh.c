// fem_mesh.c: meshes of the general solid: from tetrahedra and boxes; their boundary; checks.
#include <stdlib.h>
#include <string.h>

#include "fem/fem_solid.h"

void om_fem_mesh_done(OmFemMesh* mesh) {
    if (!mesh) return;
    om_free(mesh->x);
    om_free(mesh->elem_node);
    om_free(mesh->elem_material);
    *mesh = (OmFemMesh){0};
}

void om_fem_faces_done(OmFemFaces* faces) {
    if (!faces) return;
    om_free(faces->face_node);
    om_free(faces->face_elem);
    *faces = (OmFemFaces){0};
}

static OmStatus init_mesh(OmFemMesh* mesh, OmElement kind, int nnode, int nelem) {
    int k = om__element_nnode(kind);
    *mesh = (OmFemMesh){.kind = kind, .nnode = nnode, .nelem = nelem, .nelem_node = k};
    mesh->x = om_calloc(3 * (size_t)nnode, sizeof(double));
    mesh->elem_node = om_calloc((size_t)nelem * (size_t)k, sizeof(int));
    mesh->elem_material = om_calloc((size_t)nelem, sizeof(int));
    if (mesh->x && mesh->elem_node && mesh->elem_material) return OM_OK;
    om_fem_mesh_done(mesh);
    return OM_NO_MEMORY;
}

OmStatus om_fem_mesh_join(const OmFemMesh* a, const OmFemMesh* b, OmFemMesh* mesh) {
    *mesh = (OmFemMesh){0};
    OM_CHECK(a->kind == b->kind, OM_INVALID, "om_fem_mesh_join: elements %s and %s, must be alike",
             om_element_name(a->kind), om_element_name(b->kind));
    OM_TRY(init_mesh(mesh, a->kind, a->nnode + b->nnode, a->nelem + b->nelem));
    size_t na = (size_t)a->nnode, nb = (size_t)b->nnode, ea = (size_t)a->nelem;
    size_t eb = (size_t)b->nelem, k = (size_t)a->nelem_node;
    memcpy(mesh->x, a->x, 3 * na * sizeof(double));
    memcpy(mesh->x + 3 * na, b->x, 3 * nb * sizeof(double));
    memcpy(mesh->elem_node, a->elem_node, ea * k * sizeof(int));
    for (size_t n = 0; n < eb * k; ++n) mesh->elem_node[ea * k + n] = a->nnode + b->elem_node[n];
    memcpy(mesh->elem_material, a->elem_material, ea * sizeof(int));
    memcpy(mesh->elem_material + ea, b->elem_material, eb * sizeof(int));
    return OM_OK;
}

// ---- from tetrahedra --------------------------------------------------------------------------------

OmStatus om_fem_mesh_from_tet(const OmTetMesh* tet, OmElement kind, OmFemMesh* mesh) {
    static const int edge[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
    *mesh = (OmFemMesh){0};
    OM_CHECK(kind == OM_TET4 || kind == OM_TET10, OM_INVALID,
             "om_fem_mesh_from_tet makes OM_TET4 or OM_TET10, not %d", (int)kind);
    OM_CHECK(tet->nvert > 0 && tet->ntet > 0, OM_INVALID, "the mesh has no tetrahedra");
    OmStatus status = OM_OK;
    OmBsr graph = {0};
    int *number = NULL, nedge = 0;
    // The edges, numbered in ascending order of their vertices, are those of the coupling graph.
    OM_TRY_DONE(om_bsr_create(tet->nvert, tet->ntet, 4, tet->tet_vert, &graph));
    if (kind == OM_TET10) nedge = graph.nedge;
    OM_ALLOC_DONE(number, graph.nblock);
    for (int e = 0; e < graph.nedge; ++e)
        number[graph.edge_adr[2 * e]] = number[graph.edge_adr[2 * e + 1]] = tet->nvert + e;
    OM_TRY_DONE(init_mesh(mesh, kind, tet->nvert + nedge, tet->ntet));
    memcpy(mesh->x, tet->x, 3 * (size_t)tet->nvert * sizeof(double));
    for (int e = 0; e < nedge; ++e) {
        OmVec3 a = om_load3(tet->x, graph.edge_vert[2 * e]);
        OmVec3 b = om_load3(tet->x, graph.edge_vert[2 * e + 1]);
        om_store3(mesh->x, tet->nvert + e, om_lerp(a, b, 0.5));
    }
    for (int t = 0; t < tet->ntet; ++t) {
        int* node = mesh->elem_node + (size_t)t * (size_t)mesh->nelem_node;
        const int* vert = tet->tet_vert + 4 * (size_t)t;
        memcpy(node, vert, 4 * sizeof *node);
        for (int e = 0; e < 6 && kind == OM_TET10; ++e)
            node[4 + e] = number[om_bsr_find(&graph, vert[edge[e][0]], vert[edge[e][1]])];
        mesh->elem_material[t] = tet->tet_label ? tet->tet_label[t] : 0;
    }
done:
    om_bsr_destroy(&graph);
    om_free(number);
    if (status < 0) om_fem_mesh_done(mesh);
    return status;
}

OmStatus om_fem_mesh_from_tet10(const OmTet10Mesh* tet, OmFemMesh* mesh) {
    *mesh = (OmFemMesh){0};
    OM_TRY(om_tet10_mesh_validate(tet));
    OM_TRY(init_mesh(mesh, OM_TET10, tet->nnode, tet->nelem));
    memcpy(mesh->x, tet->x, 3 * (size_t)tet->nnode * sizeof *mesh->x);
    memcpy(mesh->elem_node, tet->elem_node, 10 * (size_t)tet->nelem * sizeof(int));
    memcpy(mesh->elem_material, tet->elem_label, (size_t)tet->nelem * sizeof(int));
    OmStatus status = om_fem_mesh_validate(mesh);
    if (status < 0) om_fem_mesh_done(mesh);
    return status;
}

OmStatus om_fem_mesh_from_nodes(const OmTetMesh* fine, const int* node, OmFemMesh* mesh) {
    if (!node) return om_fem_mesh_from_tet(fine, OM_TET4, mesh);
    OmTet10Mesh tet;
    *mesh = (OmFemMesh){0};
    OM_TRY(om_tet10_mesh_from_nodes(fine, node, &tet));
    OmStatus status = om_fem_mesh_from_tet10(&tet, mesh);
    om_tet10_mesh_done(&tet);
    return status;
}

OmStatus om_fem_mesh_get_tet10(const OmFemMesh* mesh, const double* x, OmTet10Mesh* tet) {
    *tet = (OmTet10Mesh){0};
    OM_CHECK(mesh->kind == OM_TET10, OM_INVALID, "elements %s, quadratic tetrahedra are wanted",
             om_element_name(mesh->kind));
    OM_TRY(om_tet10_mesh_init(tet, mesh->nnode, mesh->nelem));
    memcpy(tet->x, x ? x : mesh->x, 3 * (size_t)mesh->nnode * sizeof *tet->x);
    memcpy(tet->elem_node, mesh->elem_node, 10 * (size_t)mesh->nelem * sizeof(int));
    memcpy(tet->elem_label, mesh->elem_material, (size_t)mesh->nelem * sizeof(int));
    return OM_OK;
}

// ---- boxes and grids --------------------------------------------------------------------------------

static void cell_nodes(const int dim[3], int i, int j, int k, int node[8]) {
    static const int step[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                   {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    for (int a = 0; a < 8; ++a)
        node[a] =
            i + step[a][0] + (dim[0] + 1) * (j + step[a][1] + (dim[1] + 1) * (k + step[a][2]));
}

OmStatus om_fem_mesh_box(OmElement kind, OmVec3 lo, OmVec3 hi, const int num[3], OmFemMesh* mesh) {
    *mesh = (OmFemMesh){0};
    OM_CHECK(om_element_name(kind), OM_INVALID, "element kind %d is none of OmElement", (int)kind);
    OM_CHECK(num[0] > 0 && num[1] > 0 && num[2] > 0 &&
                 (double)num[0] * (double)num[1] * (double)num[2] < 1e8,
             OM_INVALID, "a box of %d x %d x %d cells cannot be", num[0], num[1], num[2]);
    OM_CHECK(om_is_finite3(lo) && om_is_finite3(hi) && lo.x < hi.x && lo.y < hi.y && lo.z < hi.z,
             OM_INVALID, "the corners of the box are not in order");
    if (kind == OM_TET4 || kind == OM_TET10) {
        OmTetMesh tet;
        OM_TRY(om_tet_mesh_box(lo, hi, num[0], num[1], num[2], &tet));
        OmStatus status = om_fem_mesh_from_tet(&tet, kind, mesh);
        om_tet_mesh_done(&tet);
        return status;
    }
    int nx = num[0] + 1, ny = num[1] + 1, nz = num[2] + 1, n = 0;
    OM_TRY(init_mesh(mesh, kind, nx * ny * nz, num[0] * num[1] * num[2]));
    for (int k = 0; k < nz; ++k)
        for (int j = 0; j < ny; ++j)
            for (int i = 0; i < nx; ++i, ++n)
                om_store3(mesh->x, n,
                          om_vec3(lo.x + (hi.x - lo.x) * i / num[0],
                                  lo.y + (hi.y - lo.y) * j / num[1],
                                  lo.z + (hi.z - lo.z) * k / num[2]));
    int* node = mesh->elem_node;
    for (int k = 0; k < num[2]; ++k)
        for (int j = 0; j < num[1]; ++j)
            for (int i = 0; i < num[0]; ++i, node += 8) cell_nodes(num, i, j, k, node);
    return OM_OK;
}

// ---- boundary ---------------------------------------------------------------------------------------

typedef struct FaceKey {  // three smallest nodes of a face name it
    int node[3];
    int elem, face;
} FaceKey;

static int compare_keys(const void* a, const void* b) {
    const FaceKey *p = a, *q = b;
    for (int k = 0; k < 3; ++k)
        if (p->node[k] != q->node[k]) return p->node[k] < q->node[k] ? -1 : 1;
    return p->elem != q->elem ? (p->elem < q->elem ? -1 : 1) : p->face - q->face;
}
static int compare_places(const void* a, const void* b) {
    const FaceKey *p = a, *q = b;
    return p->elem != q->elem ? (p->elem < q->elem ? -1 : 1) : p->face - q->face;
}

static void keep_smallest(FaceKey* key, int nlocal, const int* local, const int* node) {
    int sorted[4], n = nlocal == 4 ? 4 : 3;
    for (int a = 0; a < n; ++a) {
        int v = node[local[a]], b = a;
        for (; b > 0 && sorted[b - 1] > v; --b) sorted[b] = sorted[b - 1];
        sorted[b] = v;
    }
    memcpy(key->node, sorted, sizeof key->node);
}

OmStatus om_fem_mesh_boundary(const OmFemMesh* mesh, OmFemFaces* faces) {
    *faces = (OmFemFaces){0};
    int local[6], nlocal = 0, num = 0, kept = 0;
    OmStatus status = OM_OK;
    FaceKey* key = NULL;
    OM_ALLOC_DONE(key, 6 * (size_t)mesh->nelem);
    for (int e = 0; e < mesh->nelem; ++e) {
        const int* node = mesh->elem_node + (size_t)e * (size_t)mesh->nelem_node;
        for (int f = 0; om__element_face(mesh->kind, f, local, &nlocal); ++f, ++num) {
            keep_smallest(&key[num], nlocal, local, node);
            key[num].elem = e, key[num].face = f;
        }
    }
    qsort(key, (size_t)num, sizeof *key, compare_keys);
    for (int n = 0, m; n < num; n = m) {
        for (m = n + 1; m < num && memcmp(key[m].node, key[n].node, sizeof key[n].node) == 0;) ++m;
        if (m == n + 1) key[kept++] = key[n];
    }
    qsort(key, (size_t)kept, sizeof *key, compare_places);
    faces->nface = kept;
    faces->nface_node = nlocal;
    OM_ALLOC_DONE(faces->face_node, (size_t)kept * (size_t)nlocal);
    OM_ALLOC_DONE(faces->face_elem, kept);
    for (int n = 0; n < kept; ++n) {
        const int* node = mesh->elem_node + (size_t)key[n].elem * (size_t)mesh->nelem_node;
        om__element_face(mesh->kind, key[n].face, local, &nlocal);
        for (int a = 0; a < nlocal; ++a) faces->face_node[n * nlocal + a] = node[local[a]];
        faces->face_elem[n] = key[n].elem;
    }
done:
    om_free(key);
    if (status < 0) om_fem_faces_done(faces);
    return status;
}

// ---- checks -----------------------------------------------------------------------------------------

OmStatus om_fem_mesh_validate(const OmFemMesh* mesh) {
    OM_CHECK(om_element_name(mesh->kind), OM_INVALID, "element kind %d is none of OmElement",
             (int)mesh->kind);
    int k = om__element_nnode(mesh->kind);
    OM_CHECK(mesh->nelem_node == k, OM_INVALID, "elements %s have %d nodes, nelem_node is %d",
             om_element_name(mesh->kind), k, mesh->nelem_node);
    OM_CHECK(mesh->nnode > 0 && mesh->nelem > 0, OM_INVALID, "the mesh has no elements");
    for (int i = 0; i < mesh->nnode; ++i)
        OM_CHECK(om_is_finite3(om_load3(mesh->x, i)), OM_INVALID,
                 "position of node %d is not finite", i);
    OmRule rule;
    om__element_rule(mesh->kind, false, &rule);
    for (int e = 0; e < mesh->nelem; ++e) {
        const int* node = mesh->elem_node + (size_t)e * (size_t)k;
        for (int a = 0; a < k; ++a)
            OM_CHECK(node[a] >= 0 && node[a] < mesh->nnode, OM_INVALID,
                     "element %d names node %d, but there are %d nodes", e, node[a], mesh->nnode);
        for (int q = 0; q < rule.npoint; ++q) {
            double N[OM_MAX_ELEM_NODE], dN[3 * OM_MAX_ELEM_NODE];
            om__element_shape(mesh->kind, rule.xi[q], N, dN);
            double det = om_mat3_det(om__element_jacobian(k, dN, mesh->x, node));
            OM_CHECK(det > 0 && isfinite(1 / det), OM_INVALID,
                     "element %d has volume %g m^3 at rest; it must be positive", e, det);
        }
    }
    return OM_OK;
}
