// shape_file_msh_write.c: writing Gmsh's .msh, versions 2.2 and 4.1, as text.
//
// Labels become physical groups of volumes. Named sets become physical groups of points: each vertex of a
// set is a point element. In 4.1 groups belong to entities, so there is one volume for every label and one
// point for every set. Elements keep their order, so a block ends where the label changes.
#include <stdlib.h>
#include <string.h>

#include "shape/shape_file_internal.h"

static OmStatus write_names(const OmTetMesh* mesh, OmText* text) {
    if (mesh->nset == 0) return OM_OK;
    OM_TRY(om_text_append(text, "$PhysicalNames\n%d\n", mesh->nset));
    for (int s = 0; s < mesh->nset; s++) {
        OM_CHECK(!strpbrk(mesh->set[s].name, "\r\n"), OM_INVALID,
                 "set %d: its name has a line end, which cannot stand in a .msh file", s);
        OM_TRY(om_text_append(text, "0 %d \"%s\"\n", s + 1, mesh->set[s].name));
    }
    return om_text_append(text, "$EndPhysicalNames\n");
}

static int64_t count_elements(const OmTetMesh* mesh) {
    int64_t n = mesh->ntet;
    for (int s = 0; s < mesh->nset; s++) n += mesh->set[s].nvert;
    return n;
}

// The type of tetrahedra, and a line with the nodes of one.
static int msh_type(const OmMeshOutput* out) { return out->ncell_node == 10 ? 11 : 4; }
static OmStatus write_cell(const OmMeshOutput* out, int e, OmText* text) {
    int node[10];
    const size_t n = (size_t)out->ncell_node;
    memcpy(node, out->cell_node + n * (size_t)e, n * sizeof *node);
    if (n == 10) om__swap_edges_of_msh(node);
    for (size_t i = 0; i < n; i++) OM_TRY(om_text_append(text, " %d", node[i] + 1));
    return om_text_append(text, "\n");
}

// ---- 2.2 --------------------------------------------------------------------------------------------

static OmStatus write_msh22(const OmMeshOutput* out, OmText* text) {
    const OmTetMesh* mesh = out->mesh;
    int64_t number = 0;
    OM_TRY(om_text_append(text, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"));
    OM_TRY(write_names(mesh, text));
    OM_TRY(om_text_append(text, "$Nodes\n%d\n", mesh->nvert));
    for (int i = 0; i < mesh->nvert; i++) {
        OM_TRY(om_text_append(text, "%d ", i + 1));
        OM_TRY(om__write_point(text, mesh->x + 3 * (size_t)i, out->scale));
    }
    OM_TRY(om_text_append(text, "$EndNodes\n$Elements\n%lld\n", (long long)count_elements(mesh)));
    for (int s = 0; s < mesh->nset; s++) {
        for (int i = 0; i < mesh->set[s].nvert; i++) {
            OM_TRY(om_text_append(text, "%lld 15 2 %d %d %d\n", (long long)++number, s + 1, s + 1,
                                  mesh->set[s].vert[i] + 1));
        }
    }
    for (int e = 0; e < mesh->ntet; e++) {
        OM_TRY(om_text_append(text, "%lld %d 2 %d 1", (long long)++number, msh_type(out),
                              mesh->tet_label[e]));
        OM_TRY(write_cell(out, e, text));
    }
    return om_text_append(text, "$EndElements\n");
}

// ---- 4.1 --------------------------------------------------------------------------------------------

typedef struct Volume {  // the entity of a label
    int label;
    OmVec3 lo, hi;
} Volume;

static int compare_volumes(const void* a, const void* b) {
    int x = ((const Volume*)a)->label, y = ((const Volume*)b)->label;
    return (x > y) - (x < y);
}

static int find_volume(const Volume* volume, int nvolume, int label) {
    Volume key = {.label = label};
    const Volume* v = bsearch(&key, volume, (size_t)nvolume, sizeof key, compare_volumes);
    return (int)(v - volume);
}

// One volume per label, ascending, with the bounding boxes of their elements. The caller frees.
static OmStatus list_volumes(const OmMeshOutput* out, Volume** volume, int* nvolume) {
    const OmTetMesh* mesh = out->mesh;
    const OmVec3 far = om_vec3(HUGE_VAL, HUGE_VAL, HUGE_VAL);
    int n = 0;
    Volume* list;
    OM_ALLOC(list, mesh->ntet);
    for (int e = 0; e < mesh->ntet; e++)
        if (e == 0 || mesh->tet_label[e] != mesh->tet_label[e - 1])
            list[n++] = (Volume){mesh->tet_label[e], far, om_scale(-1, far)};
    qsort(list, (size_t)n, sizeof *list, compare_volumes);
    *nvolume = 0;
    for (int i = 0; i < n; i++)
        if (i == 0 || list[i].label != list[*nvolume - 1].label) list[(*nvolume)++] = list[i];
    for (int e = 0; e < mesh->ntet; e++) {
        Volume* v = &list[find_volume(list, *nvolume, mesh->tet_label[e])];
        for (int k = 0; k < out->ncell_node; k++) {
            const int node = out->cell_node[(size_t)out->ncell_node * (size_t)e + (size_t)k];
            OmVec3 p = om_scale(out->scale, om_load3(mesh->x, node));
            v->lo = om_vec3(fmin(v->lo.x, p.x), fmin(v->lo.y, p.y), fmin(v->lo.z, p.z));
            v->hi = om_vec3(fmax(v->hi.x, p.x), fmax(v->hi.y, p.y), fmax(v->hi.z, p.z));
        }
    }
    *volume = list;
    return OM_OK;
}

static OmStatus write_entities(const OmMeshOutput* out, const Volume* volume, int nvolume,
                               OmText* text) {
    const OmTetMesh* mesh = out->mesh;
    OM_TRY(om_text_append(text, "$Entities\n%d 0 0 %d\n", mesh->nset, nvolume));
    for (int s = 0; s < mesh->nset; s++) {
        OmVec3 p = om_vec3(0, 0, 0);
        if (mesh->set[s].nvert > 0)
            p = om_scale(out->scale, om_load3(mesh->x, mesh->set[s].vert[0]));
        OM_TRY(om_text_append(text, "%d %.9g %.9g %.9g 1 %d\n", s + 1, p.x, p.y, p.z, s + 1));
    }
    for (int i = 0; i < nvolume; i++) {
        const Volume* v = &volume[i];
        OM_TRY(om_text_append(text, "%d %.9g %.9g %.9g %.9g %.9g %.9g ", i + 1, v->lo.x, v->lo.y,
                              v->lo.z, v->hi.x, v->hi.y, v->hi.z));
        // also 0: meshio requires a group for all entities or none
        OM_TRY(om_text_append(text, "1 %d 0\n", v->label));
    }
    return om_text_append(text, "$EndEntities\n");
}

static OmStatus write_nodes(const OmMeshOutput* out, OmText* text) {
    int n = out->mesh->nvert;
    OM_TRY(om_text_append(text, "$Nodes\n1 %d 1 %d\n3 1 0 %d\n", n, n, n));
    for (int i = 0; i < n; i++) OM_TRY(om_text_append(text, "%d\n", i + 1));
    for (int i = 0; i < n; i++)
        OM_TRY(om__write_point(text, out->mesh->x + 3 * (size_t)i, out->scale));
    return om_text_append(text, "$EndNodes\n");
}

// The end of the run of equal labels that begins at e.
static int run_end(const OmTetMesh* mesh, int e) {
    int end = e + 1;
    while (end < mesh->ntet && mesh->tet_label[end] == mesh->tet_label[e]) end++;
    return end;
}

static OmStatus write_elements(const OmMeshOutput* out, const Volume* volume, int nvolume,
                               OmText* text) {
    const OmTetMesh* mesh = out->mesh;
    long long number = 0, total = (long long)count_elements(mesh);
    int nblock = 0;
    for (int s = 0; s < mesh->nset; s++) nblock += mesh->set[s].nvert > 0;
    for (int e = 0; e < mesh->ntet; e = run_end(mesh, e)) nblock++;
    OM_TRY(om_text_append(text, "$Elements\n%d %lld 1 %lld\n", nblock, total, total));
    for (int s = 0; s < mesh->nset; s++) {
        if (mesh->set[s].nvert == 0) continue;
        OM_TRY(om_text_append(text, "0 %d 15 %d\n", s + 1, mesh->set[s].nvert));
        for (int i = 0; i < mesh->set[s].nvert; i++)
            OM_TRY(om_text_append(text, "%lld %d\n", ++number, mesh->set[s].vert[i] + 1));
    }
    for (int e = 0; e < mesh->ntet;) {
        int end = run_end(mesh, e), entity = find_volume(volume, nvolume, mesh->tet_label[e]) + 1;
        OM_TRY(om_text_append(text, "3 %d %d %d\n", entity, msh_type(out), end - e));
        for (; e < end; e++) {
            OM_TRY(om_text_append(text, "%lld", ++number));
            OM_TRY(write_cell(out, e, text));
        }
    }
    return om_text_append(text, "$EndElements\n");
}

static OmStatus write_msh41(const OmMeshOutput* out, OmText* text) {
    Volume* volume = NULL;
    int nvolume = 0;
    OM_TRY(om_text_append(text, "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"));
    OM_TRY(write_names(out->mesh, text));
    OM_TRY(list_volumes(out, &volume, &nvolume));
    OmStatus status = write_entities(out, volume, nvolume, text);
    if (status == OM_OK) status = write_nodes(out, text);
    if (status == OM_OK) status = write_elements(out, volume, nvolume, text);
    om_free(volume);
    return status;
}

OmStatus om__write_msh(const OmMeshOutput* out, bool is_msh41, OmText* text) {
    OM_CHECK(out->narray == 0, OM_INVALID, "array %s: .msh files hold no arrays, .vtu and .vtk do",
             out->array[0].name);
    return is_msh41 ? write_msh41(out, text) : write_msh22(out, text);
}
