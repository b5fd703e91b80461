// tissue_point.c: forces on points inside elements.
//
// A point p = sum w_a x_a of a tetrahedron with the force f - K (p_end - p_begin) adds h w_a f - h^2 w_a K v_p to
// b at its vertices and h^2 w_a w_b K to the blocks of A between them, all of them in the pattern. Each block is saved
// before a change, and blocks are restored in reverse order, so clearing is exact.
#include <string.h>

#include "tissue/tissue_internal.h"

#define NBLOCK 16  // blocks of A changed by one point

OmStatus om_tissue_reserve_points(OmTissueWork* w, int npoint) {
    OM_CHECK(npoint >= 0 && npoint <= 10000000, OM_INVALID,
             "tissue: %d points to reserve; from 0 to 10 million", npoint);
    if (npoint <= w->max_point) return OM_OK;
    OmTissuePoint* point =
        om_realloc(w->point, (size_t)w->max_point, (size_t)npoint, sizeof *point);
    if (!point) return OM_NO_MEMORY;
    w->point = point;
    size_t old = NBLOCK * (size_t)w->max_point, num = NBLOCK * (size_t)npoint;
    OmTissueUndo* undo = om_realloc(w->undo, old, num, sizeof *undo);
    if (!undo) return OM_NO_MEMORY;
    w->undo = undo;
    w->max_point = npoint;
    return OM_OK;
}

OmStatus om_tissue_add_point_force(OmTissueWork* w, const int vert[4], const double weight[4],
                                   OmVec3 f, OmMat3 K) {
    OM_CHECK(w->npoint < w->max_point, OM_INVALID,
             "tissue: more than the %d points of om_tissue_reserve_points", w->max_point);
    OmTissuePoint* p = &w->point[w->npoint];
    p->has_K = om_mat3_norm(K) > 0;
    for (int a = 0; a < 4; ++a) {
        OM_CHECK(vert[a] >= 0 && vert[a] < w->nvert, OM_INVALID,
                 "tissue: vertex %d of a point is not one of the mesh's %d", vert[a], w->nvert);
        for (int b = 0; b < 4 && p->has_K; ++b) {
            int k = om_bsr_find(&w->A, vert[a], vert[b]);
            OM_CHECK(k >= 0, OM_INVALID,
                     "tissue: no element has both vertices %d and %d of a point", vert[a], vert[b]);
            p->block[4 * a + b] = k;
        }
    }
    memcpy(p->vert, vert, sizeof p->vert);
    memcpy(p->weight, weight, sizeof p->weight);
    p->f = f;
    p->K = K;
    w->is_changed |= p->has_K;
    ++w->npoint;
    return OM_OK;
}

// Save block k of A, then add m to it.
static void change_block(OmTissueWork* w, int k, OmMat3 m) {
    OmTissueUndo* u = &w->undo[w->nundo++];
    u->block = k;
    memcpy(u->value, w->A.value + 9 * (size_t)k, sizeof u->value);
    om_bsr_add(&w->A, k, m);
}

void om__points_apply(const OmTissueState* s, OmTissueWork* w) {
    const double *v = om__state_array(s, OM__V), h = w->h;
    for (int n = 0; n < w->npoint; ++n) {
        const OmTissuePoint* p = &w->point[n];
        OmVec3 v_p = {0, 0, 0};
        for (int a = 0; a < 4; ++a) v_p = om_madd(v_p, p->weight[a], om_load3(v, p->vert[a]));
        OmVec3 add = om_madd(om_scale(h, p->f), -h * h, om_mat3_apply(p->K, v_p));
        for (int a = 0; a < 4; ++a) {
            int i = p->vert[a];
            om_store3(w->rhs, i, om_madd(om_load3(w->rhs, i), p->weight[a], add));
            for (int b = 0; b < 4 && p->has_K; ++b) {
                double share = h * h * p->weight[a] * p->weight[b];
                if (share != 0) change_block(w, p->block[4 * a + b], om_mat3_scale(share, p->K));
            }
        }
    }
}

void om__points_undo(OmTissueWork* w) {
    while (w->nundo > 0) {
        const OmTissueUndo* u = &w->undo[--w->nundo];
        memcpy(w->A.value + 9 * (size_t)u->block, u->value, sizeof u->value);
    }
}
