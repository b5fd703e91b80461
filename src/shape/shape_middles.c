// shape_middles.c: new vertices in the middle of edges.
#include "shape/shape_middles.h"

#include <string.h>

const int om__tet_edge[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

OmStatus om__mesh_add_middles(const OmTetMesh* mesh, int nedge, const int* end, OmTetMesh* fine) {
    unsigned char* is_in = om_alloc((size_t)mesh->nvert, 1);
    int* list = om_alloc((size_t)fine->nvert, sizeof *list);
    OmStatus status = is_in && list ? OM_OK : OM_NO_MEMORY;
    memcpy(fine->x, mesh->x, 3 * (size_t)mesh->nvert * sizeof *fine->x);
    for (int e = 0; e < nedge; ++e)
        om_store3(fine->x, mesh->nvert + e,
                  om_lerp(om_load3(mesh->x, end[2 * e]), om_load3(mesh->x, end[2 * e + 1]), 0.5));
    for (int s = 0; status == OM_OK && s < mesh->nset; ++s) {
        int n = mesh->set[s].nvert;
        memset(is_in, 0, (size_t)mesh->nvert);
        for (int i = 0; i < n; ++i) is_in[list[i] = mesh->set[s].vert[i]] = 1;
        for (int e = 0; e < nedge; ++e)
            if (is_in[end[2 * e]] && is_in[end[2 * e + 1]]) list[n++] = mesh->nvert + e;
        status = om_tet_mesh_add_set(fine, mesh->set[s].name, list, n);
    }
    om_free(is_in);
    om_free(list);
    return status;
}
