// tissue_tie.c: forces between places of the tissue that need share no element.
//
// With p = sum w_a x_a and the force f - K (p_end - p_begin) on it, vertex a gets h w_a f - h^2 w_a K v_p on the
// right-hand side, and A the tie h^2 w_a w_b K (solve.h), beside its pattern.
#include "tissue/tissue_internal.h"

OmStatus om_tissue_add_tie(OmTissueWork* w, const int vert[4], const double weight[4], OmVec3 f,
                           OmMat3 K) {
    for (int a = 0; a < 4; ++a)
        OM_CHECK(vert[a] >= 0 && vert[a] < w->nvert, OM_INVALID,
                 "tissue: vertex %d of a tie is not one of the mesh's %d", vert[a], w->nvert);
    if (w->ntie == w->max_tie) {
        size_t max = 2 * (size_t)w->max_tie + 64;
        OmTissueTie* tie = om_realloc(w->tie, (size_t)w->max_tie, max, sizeof *tie);
        if (!tie) return OM_NO_MEMORY;
        w->tie = tie;
        w->max_tie = (int)max;
    }
    OmTissueTie* t = &w->tie[w->ntie++];
    for (int a = 0; a < 4; ++a) {
        t->vert[a] = vert[a];
        t->weight[a] = weight[a];
    }
    t->f = f;
    t->K = K;
    w->is_changed = true;
    return OM_OK;
}

static OmVec3 place_of(const OmTissueTie* t, const double* x) {
    OmVec3 p = {0, 0, 0};
    for (int a = 0; a < 4; ++a) p = om_madd(p, t->weight[a], om_load3(x, t->vert[a]));
    return p;
}

OmStatus om__ties_apply(const OmTissueState* s, OmTissueWork* w) {
    w->A.ties = NULL;
    if (w->ntie == 0) return OM_OK;
    if (!w->ties) OM_TRY(om_ties_create(w->nvert, &w->ties));
    om_ties_clear(w->ties);
    const double *v = om__state_array(s, OM__V), h = w->h;
    for (int k = 0; k < w->ntie; ++k) {
        const OmTissueTie* t = &w->tie[k];
        OmVec3 add = om_madd(om_scale(h, t->f), -h * h, om_mat3_apply(t->K, place_of(t, v)));
        for (int a = 0; a < 4; ++a) {
            OmVec3 b = om_load3(w->rhs, t->vert[a]);
            om_store3(w->rhs, t->vert[a], om_madd(b, t->weight[a], add));
        }
        OM_TRY(om_ties_add(w->ties, 4, t->vert, t->weight, om_mat3_scale(h * h, t->K)));
    }
    OM_TRY(om_ties_sum(w->ties));
    w->A.ties = w->ties;
    return OM_OK;
}

double om__ties_work(const OmTissueWork* w, const double* d) {
    double work = 0;
    for (int k = 0; k < w->ntie; ++k) {
        OmVec3 p = place_of(&w->tie[k], d);
        work += om_dot(om_sub(w->tie[k].f, om_mat3_apply(w->tie[k].K, p)), p);
    }
    return work;
}
