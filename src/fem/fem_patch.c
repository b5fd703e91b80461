// fem_patch.c: the elements around each edge of a tetrahedral mesh and their mean gradients.
//
// F of a patch is the mean of F of its elements, weighted by the sixth of their volume that belongs to the edge: a
// linear operator, F = sum x_a g_a^T with g_a = sum V_e / 6 g_e,a / V over elements that have node a. Bending
// costs less than in single elements, whose shear locks once volumes are free; there are no modes of zero energy,
// which means around nodes have (Liu and Nguyen, Smoothed finite element methods, 2010, chapter 7).
#include <string.h>

#include "fem/fem_solid.h"

static const int edge[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};

static int find_node(const OmPatches* P, int begin, int end, int node) {
    for (int a = begin; a < end; ++a)
        if (P->node[a] == node) return a;
    return -1;
}

// Nodes, gradients and materials of patch e from its elements.
static OmStatus fill_patch(const OmFemSolid* s, int e, const int* elem, int nelem, OmPatches* P,
                           int* npart) {
    int begin = P->adr[e], end = begin;
    double volume = 0;
    for (int m = 0; m < nelem; ++m) volume += s->volume[elem[m]] / 6;
    for (int m = 0; m < nelem; ++m) {
        const double* g = s->grad + 12 * (size_t)elem[m];
        double share = s->volume[elem[m]] / 6 / volume;  // volumes are positive
        for (int a = 0; a < 4; ++a) {
            int node = s->mesh.elem_node[4 * (size_t)elem[m] + (size_t)a];
            int at = find_node(P, begin, end, node);
            if (at < 0) {
                at = end++;
                P->node[at] = node;
                memset(P->grad + 3 * (size_t)at, 0, 3 * sizeof(double));
            }
            for (int c = 0; c < 3; ++c) P->grad[3 * at + c] += share * g[3 * a + c];
        }
        int material = s->mesh.elem_material[elem[m]], part = P->part_adr[e];
        while (part < *npart && P->material[part] != material) ++part;
        if (part == *npart) {
            P->material[part] = material;
            P->volume[part] = 0;
            ++*npart;
        }
        P->volume[part] += share * volume;
    }
    OM_CHECK(end - begin <= OM__MAX_PATCH, OM_INVALID,
             "OM_SMOOTHED: the elements around an edge have %d nodes, more than %d", end - begin,
             OM__MAX_PATCH);
    P->adr[e + 1] = end;
    P->part_adr[e + 1] = *npart;
    return OM_OK;
}

OmStatus om__fem_make_patches(const OmFemSolid* s, OmPatches* P) {
    OmStatus status = OM_OK;
    OmBsr graph = {0};
    int *number = NULL, *first = NULL, *elem = NULL, npart = 0;
    size_t nuse = 6 * (size_t)s->mesh.nelem;
    OM_TRY_DONE(om_bsr_create(s->mesh.nnode, s->mesh.nelem, 4, s->mesh.elem_node, &graph));
    OM_ALLOC_DONE(number, graph.nblock);
    OM_CALLOC_DONE(first, (size_t)graph.nedge + 2);
    OM_ALLOC_DONE(elem, nuse);
    for (int e = 0; e < graph.nedge; ++e)
        number[graph.edge_adr[2 * e]] = number[graph.edge_adr[2 * e + 1]] = e;
    // Elements of each edge: count, then list.
    for (int pass = 0; pass < 2; ++pass) {
        for (size_t m = 0; m < nuse; ++m) {
            const int* node = s->mesh.elem_node + 4 * (m / 6);
            int e = number[om_bsr_find(&graph, node[edge[m % 6][0]], node[edge[m % 6][1]])];
            if (pass == 0)
                ++first[e + 2];
            else
                elem[first[e + 1]++] = (int)(m / 6);
        }
        for (int e = 0; e < graph.nedge && pass == 0; ++e) first[e + 2] += first[e + 1];
    }
    P->num = graph.nedge;
    OM_CALLOC_DONE(P->adr, (size_t)P->num + 1);
    OM_CALLOC_DONE(P->part_adr, (size_t)P->num + 1);
    OM_ALLOC_DONE(P->node, 4 * nuse);
    OM_ALLOC_DONE(P->grad, 12 * nuse);
    OM_ALLOC_DONE(P->material, nuse);
    OM_ALLOC_DONE(P->volume, nuse);
    for (int e = 0; e < P->num; ++e)
        OM_TRY_DONE(fill_patch(s, e, elem + first[e], first[e + 1] - first[e], P, &npart));
    OM_TRY_DONE(om__fem_color(s->mesh.nnode, P->num, P->adr, 0, P->node, &P->colors));
done:
    om_bsr_destroy(&graph);
    om_free(number);
    om_free(first);
    om_free(elem);
    return status;
}

void om__fem_destroy_patches(OmPatches* P) {
    om_free(P->adr);
    om_free(P->part_adr);
    om_free(P->node);
    om_free(P->grad);
    om_free(P->material);
    om_free(P->volume);
    om_free(P->colors.adr);
    om_free(P->colors.cell);
    *P = (OmPatches){0};
}
