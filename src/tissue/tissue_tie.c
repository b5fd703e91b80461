// tissue_tie.c: forces between places of the tissue that need share no element, and bonds, springs that stay.
//
// With p = sum w_a x_a and the force f - K (p_end - p_begin) on it, vertex a gets h w_a f - h^2 w_a K v_p on the
// right-hand side, and A the tie h^2 w_a w_b K (solve.h), beside its pattern. Bonds are a part of every assembly, as
// the springs of attachments are; forces that a method adds come and go with each solve.
#include <string.h>

#include "base/base_grow.h"
#include "tissue/tissue_internal.h"

// ---- bonds ------------------------------------------------------------------------------------------

#define AT_REST 1e-9  // of the model's size: distance of the two places of a bond at rest

OmStatus om_tissue_make_bonds(const OmTetMesh* mesh, int nvert, const int* vert, int tet_begin,
                              int tet_end, double stiffness, OmTissueBond* bond) {
    OM_CHECK(tet_begin >= 0 && tet_begin < tet_end && tet_end <= mesh->ntet, OM_INVALID,
             "bonds: tetrahedra %d to %d of a mesh of %d", tet_begin, tet_end, mesh->ntet);
    for (int k = 0; k < nvert; ++k) {
        OM_CHECK(vert[k] >= 0 && vert[k] < mesh->nvert, OM_INVALID,
                 "bonds: vertex %d is not one of the mesh's %d", vert[k], mesh->nvert);
        OmVec3 p = om_load3(mesh->x, vert[k]);
        double best = -INFINITY, bary[4];
        for (int t = tet_begin; t < tet_end; ++t) {
            const int* v = mesh->tet_vert + 4 * (size_t)t;
            bool is_own = v[0] == vert[k] || v[1] == vert[k] || v[2] == vert[k] || v[3] == vert[k];
            OM_CHECK(!is_own, OM_INVALID, "bonds: vertex %d belongs to the other body", vert[k]);
            double least = om__barycentric(mesh->x, v, p, bary);
            if (!(least > best)) continue;
            best = least;
            bond[k] = (OmTissueBond){.vert = {vert[k], v[0], v[1], v[2], v[3]},
                                     .weight = {1, -bary[0], -bary[1], -bary[2], -bary[3]},
                                     .stiffness = stiffness};
        }
    }
    return OM_OK;
}

static OmVec3 bond_place(const OmTissueBond* b, const double* x) {
    OmVec3 p = {0, 0, 0};
    for (int a = 0; a < OM_BOND_VERT; ++a) p = om_madd(p, b->weight[a], om_load3(x, b->vert[a]));
    return p;
}

static OmStatus check_bond(const OmTissueModel* m, double size, int k) {
    const OmTissueBond* b = &m->bond[k];
    double sum = 0;
    for (int a = 0; a < OM_BOND_VERT; ++a) {
        OM_CHECK(b->vert[a] >= 0 && b->vert[a] < m->ncorner, OM_INVALID,
                 "tissue: bond[%d]: vertex %d is not one of the mesh's %d", k, b->vert[a],
                 m->ncorner);
        sum += b->weight[a];
    }
    OM_CHECK(b->stiffness > 0 && b->stiffness <= OM__MAX_STIFFNESS, OM_INVALID,
             "tissue: bond[%d].stiffness is %g N/m; it must be above 0 and at most %g", k,
             b->stiffness, OM__MAX_STIFFNESS);
    double apart = om_norm(bond_place(b, m->mesh.x));
    OM_CHECK(fabs(sum) <= 1e-9 && apart <= AT_REST * size, OM_INVALID,
             "tissue: bond[%d]: its weights sum to %g, and its places are %g m apart at rest; both "
             "must be 0",
             k, sum, apart);
    return OM_OK;
}

OmStatus om__bonds_copy(const OmTissueDef* def, OmTissueModel* m) {
    m->def.bond = NULL;  // borrowed until here
    OM_CHECK(def->nbond >= 0 && (def->nbond == 0 || def->bond), OM_INVALID,
             "tissue: nbond is %d, and bond is null or the count negative", def->nbond);
    if (def->nbond == 0) return OM_OK;
    OM_CHECK(om__has_matrix(m) && def->solver.preconditioner < OM_CHOLESKY, OM_UNAVAILABLE,
             "tissue: bonds need an engine with a matrix, and CG as its solver");
    OM_ALLOC(m->bond, def->nbond);
    m->nbond = def->nbond;
    memcpy(m->bond, def->bond, (size_t)m->nbond * sizeof *m->bond);
    double size = 0;
    for (int i = 0; i < m->ncorner; ++i)
        size = fmax(size, om_distance(om_load3(m->mesh.x, i), om_load3(m->mesh.x, 0)));
    for (int k = 0; k < m->nbond; ++k) OM_TRY(check_bond(m, size, k));
    return OM_OK;
}

double om__bonds_add(const OmTissueModel* m, const double* x, const unsigned char* mask,
                     double* force) {
    double energy = 0;
    for (int k = 0; k < m->nbond; ++k) {
        const OmTissueBond* b = &m->bond[k];
        OmVec3 p = bond_place(b, x);
        energy += 0.5 * b->stiffness * om_norm2(p);
        for (int a = 0; a < OM_BOND_VERT && force; ++a) {
            int i = b->vert[a];
            if (mask && !mask[i]) continue;
            om_store3(force, i, om_madd(om_load3(force, i), -b->weight[a] * b->stiffness, p));
        }
    }
    return energy;
}

OmVec3 om_tissue_bond_force(const OmTissueModel* m, const OmTissueState* s, int k) {
    if (k < 0 || k >= m->nbond) return om_vec3(0, 0, 0);
    return om_scale(-m->bond[k].stiffness, bond_place(&m->bond[k], om__state_array(s, OM__X)));
}

static OmStatus add_bonds(const OmTissueModel* m, double factor, OmTies* ties) {
    for (int k = 0; k < m->nbond; ++k) {
        const OmTissueBond* b = &m->bond[k];
        OmMat3 K = om_mat3_scale(factor * b->stiffness, om_mat3_identity());
        OM_TRY(om_ties_add(ties, OM_BOND_VERT, b->vert, b->weight, K));
    }
    return OM_OK;
}

OmStatus om__assemble(const OmTissueModel* m, const OmTissueState* s, OmTissueWork* w,
                      const OmAssembly* at) {
    OM_TRY(m->engine->assemble(m, s, w, at));
    w->A.ties = NULL;
    if (m->nbond == 0) return OM_OK;
    if (!w->bonds) OM_TRY(om_ties_create(w->nvert, &w->bonds));
    om_ties_clear(w->bonds);
    OM_TRY(add_bonds(m, at->spring, w->bonds));
    OM_TRY(om_ties_sum(w->bonds));
    w->A.ties = w->bonds;
    for (int k = 0; k < m->nbond; ++k) {
        const OmTissueBond* b = &m->bond[k];
        OmVec3 p = om_madd(bond_place(b, at->x), at->spring_lag, bond_place(b, at->v));
        for (int a = 0; a < OM_BOND_VERT; ++a)
            om_store3(
                w->b, b->vert[a],
                om_madd(om_load3(w->b, b->vert[a]), -at->force * b->weight[a] * b->stiffness, p));
    }
    return OM_OK;
}

// ---- forces of a method -----------------------------------------------------------------------------

OmStatus om_tissue_add_tie(OmTissueWork* w, const int vert[4], const double weight[4], OmVec3 f,
                           OmMat3 K) {
    for (int a = 0; a < 4; ++a)
        OM_CHECK(vert[a] >= 0 && vert[a] < w->nvert, OM_INVALID,
                 "tissue: vertex %d of a tie is not one of the mesh's %d", vert[a], w->nvert);
    OM_GROW(w->tie, w->ntie, w->max_tie, 64);
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

OmStatus om__ties_apply(const OmTissueModel* m, const OmTissueState* s, OmTissueWork* w) {
    w->A.ties = w->bonds;
    if (w->ntie == 0) return OM_OK;
    if (!w->ties) OM_TRY(om_ties_create(w->nvert, &w->ties));
    om_ties_clear(w->ties);
    const double *v = om__state_array(s, OM__V), h = w->h;
    OM_TRY(add_bonds(m, h * h, w->ties));
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
