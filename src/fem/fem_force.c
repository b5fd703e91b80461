// fem_force.c: elastic forces, energy and measures, in double.
//
// Computes the same quantities as a step, but in double and from the state alone, element after element.
// Corotational: e = sym(R^T F) - I, s = 2 mu e + lambda tr(e) I, force on vertex a: -V R s g_a. Other
// laws: -V P g_a.
#include "fem/fem_simd.h"

// See fem_turn.c. Newton starts above the largest root and decreases to it.
OmMat3 om__fem_rotation(OmMat3 F) {
    double norm = om_mat3_norm(F);
    if (!(norm > 1e-150)) return om_mat3_polar(F);
    OmMat3 a = om_mat3_scale(sqrt(3.0) / norm, F);
    OmMat3 cof = om_mat3_cols(om_cross(a.cy, a.cz), om_cross(a.cz, a.cx), om_cross(a.cx, a.cy));
    double J = om_dot(a.cx, cof.cx), cc = om_norm2(cof.cx) + om_norm2(cof.cy) + om_norm2(cof.cz);
    double f = 3, step = 1;
    for (int n = 0; n < 12 && fabs(step) > 1e-9; ++n) {
        double f2 = f * f;
        double dp = 4 * ((f2 - 3) * f - 2 * J);
        step = ((f2 - 6) * f2 - 8 * J * f + 9 - 4 * cc) / fmax(dp, 1e-3);
        f -= step;
    }
    double gap = (f * f - 3) * f - 2 * J;
    if (!(gap >= 0.05 && fabs(step) <= 1e-9)) return om_mat3_polar(F);
    OmMat3 C = om_mat3_mul(om_mat3_transpose(a), a);
    OmMat3 R = om_mat3_add(om_mat3_scale((f * f + 3) / gap, a), om_mat3_scale(2 * f / gap, cof));
    return om_mat3_add(R, om_mat3_scale(-2 / gap, om_mat3_mul(a, C)));
}

typedef struct Element {
    const int* vert;
    OmMat3 g;  // shape gradients of vertices 1, 2, 3 as columns
    OmMat3 F;
    OmMat3 P;       // first Piola-Kirchhoff stress, Pa
    double energy;  // J/m^3
    double volume;  // at rest, m^3
} Element;

static OmMat3 corotational_strain(OmMat3 F, OmMat3 R) {
    OmMat3 U = om_mat3_mul(om_mat3_transpose(R), F);
    OmMat3 e = om_mat3_scale(0.5, om_mat3_add(U, om_mat3_transpose(U)));
    return om_mat3_add(e, om_mat3_diag(om_vec3(-1, -1, -1)));
}

static OmMat3 corotational_stress(const OmMaterial* m, OmMat3 F, double* energy) {
    double lambda, mu, bulk;
    om_material_lame(m, &lambda, &mu, &bulk);
    OmMat3 R = om__fem_rotation(F), e = corotational_strain(F, R);
    double t = om_mat3_trace(e), p = lambda * t, n = om_mat3_norm(e);
    *energy = mu * n * n + 0.5 * lambda * t * t;
    return om_mat3_mul(R, om_mat3_add(om_mat3_scale(2 * mu, e), om_mat3_diag(om_vec3(p, p, p))));
}

double om__fem_eval_energy(const OmMaterial* material, OmMat3 F) {
    double energy;
    if (material->law == OM_COROTATIONAL)
        corotational_stress(material, F, &energy);
    else
        om__law_stress(material, F, &energy);
    return energy;
}

static Element look_at(const OmTissueModel* m, const double* x, int e) {
    Element el = {.vert = m->mesh.tet_vert + 4 * (size_t)e, .volume = m->volume[e]};
    const double* g = ((const OmFem*)m->data)->grad + 9 * (size_t)e;
    el.g = om_mat3_cols(om_load3(g, 0), om_load3(g, 1), om_load3(g, 2));
    OmVec3 o = om_load3(x, el.vert[0]);
    OmMat3 D = om_mat3_cols(om_sub(om_load3(x, el.vert[1]), o), om_sub(om_load3(x, el.vert[2]), o),
                            om_sub(om_load3(x, el.vert[3]), o));
    el.F = om_mat3_mul(D, om_mat3_transpose(el.g));
    const OmMaterial* material = om__fem_material(m, e);
    el.P = material->law == OM_COROTATIONAL ? corotational_stress(material, el.F, &el.energy)
                                            : om__law_stress(material, el.F, &el.energy);
    return el;
}

// Averaged strains: compute forces of all vertices, then select those of the mask.
static OmStatus add_cell_force(const OmTissueModel* m, const double* x, const unsigned char* mask,
                               double* force, OmVec3* sum) {
    OmStatus status = OM_OK;
    double *scratch = NULL, *all = NULL, energy;
    OM_ALLOC_DONE(scratch, om__cell_scratch_size(m));
    OM_ALLOC_DONE(all, 3 * (size_t)m->mesh.nvert);
    om__cell_balance(m, 1, x, scratch, all, &energy);
    for (int i = 0; i < m->mesh.nvert; ++i) {
        if (mask && !mask[i]) continue;
        *sum = om_add(*sum, om_load3(all, i));
        if (force) om_store3(force, i, om_add(om_load3(force, i), om_load3(all, i)));
    }
done:
    om_free(scratch);
    om_free(all);
    return status;
}

OmStatus om__fem_add_internal_force(const OmTissueModel* m, const double* x,
                                    const unsigned char* mask, double* force, OmVec3* sum) {
    if (((const OmFem*)m->data)->cells) return add_cell_force(m, x, mask, force, sum);
    for (int e = 0; e < m->mesh.ntet; ++e) {
        const int* v = m->mesh.tet_vert + 4 * (size_t)e;
        if (mask && !(mask[v[0]] | mask[v[1]] | mask[v[2]] | mask[v[3]])) continue;
        Element el = look_at(m, x, e);
        OmMat3 P = om_mat3_scale(-el.volume, el.P);
        OmVec3 f[4];
        f[1] = om_mat3_apply(P, el.g.cx);
        f[2] = om_mat3_apply(P, el.g.cy);
        f[3] = om_mat3_apply(P, el.g.cz);
        f[0] = om_scale(-1, om_add(om_add(f[1], f[2]), f[3]));
        for (int a = 0; a < 4; ++a) {
            if (mask && !mask[v[a]]) continue;
            *sum = om_add(*sum, f[a]);
            if (force) om_store3(force, v[a], om_add(om_load3(force, v[a]), f[a]));
        }
    }
    return OM_OK;
}

OmStatus om__fem_get_energy(const OmTissueModel* m, const double* x, double* energy) {
    *energy = 0;
    for (int e = 0; e < m->mesh.ntet && !((const OmFem*)m->data)->cells; ++e) {
        Element el = look_at(m, x, e);
        *energy += el.volume * el.energy;
    }
    if (!((const OmFem*)m->data)->cells) return OM_OK;
    OmStatus status = OM_OK;
    double *scratch = NULL, *force = NULL;
    OM_ALLOC_DONE(scratch, om__cell_scratch_size(m));
    OM_ALLOC_DONE(force, 3 * (size_t)m->mesh.nvert);
    om__cell_balance(m, 1, x, scratch, force, energy);
done:
    om_free(scratch);
    om_free(force);
    return status;
}

// ---- forces and energy by many workers --------------------------------------------------------------

#define NPART 64  // of the elements, each summed by one worker: the same sum for any number of them

typedef struct Balance {
    const OmTissueModel* m;
    const double* x;
    double* corner;  // forces of elements on their vertices                  (ntet x 4 x 3)
    double* force;
    double part[NPART];
} Balance;

static void balance_team(void* ctx, OmTeam* team, int rank, int size) {
    Balance* a = ctx;
    const OmFem* fem = a->m->data;
    int64_t ntet = a->m->mesh.ntet, nvert = a->m->mesh.nvert;
    for (int k = NPART * rank / size; k < NPART * (rank + 1) / size; ++k) {
        a->part[k] = 0;
        for (int e = (int)(ntet * k / NPART); e < (int)(ntet * (k + 1) / NPART); ++e) {
            Element el = look_at(a->m, a->x, e);
            a->part[k] += el.volume * el.energy;
            OmMat3 P = om_mat3_scale(-el.volume, el.P);
            OmVec3 f1 = om_mat3_apply(P, el.g.cx), f2 = om_mat3_apply(P, el.g.cy),
                   f3 = om_mat3_apply(P, el.g.cz);
            om_store3(a->corner, 4 * e, om_scale(-1, om_add(om_add(f1, f2), f3)));
            om_store3(a->corner, 4 * e + 1, f1);
            om_store3(a->corner, 4 * e + 2, f2);
            om_store3(a->corner, 4 * e + 3, f3);
        }
    }
    om_team_barrier(team);
    for (int i = (int)(nvert * rank / size); i < (int)(nvert * (rank + 1) / size); ++i) {
        OmVec3 f = {0, 0, 0};
        for (int at = fem->visit_adr[i]; at < fem->visit_adr[i + 1]; ++at)
            f = om_add(f, om_load3(a->corner, fem->visit[at].corner));
        om_store3(a->force, i, f);
    }
}

OmStatus om__fem_eval_balance(const OmTissueModel* m, OmTissueWork* w, const double* x,
                              double* force, double* energy) {
    OmFemWork* fw = w->data;
    if (((const OmFem*)m->data)->cells) {
        if (!fw->scratch) OM_ALLOC(fw->scratch, om__cell_scratch_size(m));
        om__cell_balance(m, fw->nworker, x, fw->scratch, force, energy);
        return OM_OK;
    }
    if (!fw->corner) fw->corner = om_alloc((size_t)m->mesh.ntet, 12 * sizeof(double));
    if (!fw->corner) return OM_NO_MEMORY;
    Balance a = {.m = m, .x = x, .corner = fw->corner, .force = force};
    om_parallel_team(fw->nworker, balance_team, &a);
    *energy = 0;
    for (int k = 0; k < NPART; ++k) *energy += a.part[k];
    return OM_OK;
}

// ---- measures -----------------------------------------------------------------------------------------

// Of P R^T (corotational) or of Cauchy's stress P F^T / J; of P R^T too where an element is nearly flat.
static double von_mises(const OmMaterial* m, const Element* el) {
    double J = om_mat3_det(el->F);
    bool is_true = m->law != OM_COROTATIONAL && J > 1e-6;
    OmMat3 s = is_true ? om_mat3_scale(1 / J, om_mat3_mul(el->P, om_mat3_transpose(el->F)))
                       : om_mat3_mul(el->P, om_mat3_transpose(om__fem_rotation(el->F)));
    double p = om_mat3_trace(s) / 3;
    OmMat3 d = om_mat3_add(s, om_mat3_diag(om_vec3(-p, -p, -p)));
    return sqrt(1.5 * (om_norm2(d.cx) + om_norm2(d.cy) + om_norm2(d.cz)));
}

static double measure_of(const OmMaterial* m, const Element* el, OmTissueMeasure measure) {
    OmMat3 u, v;
    OmVec3 s;
    switch (measure) {
    case OM_VON_MISES: return von_mises(m, el);
    case OM_PRINCIPAL_STRETCH: om_mat3_svd(el->F, &u, &s, &v); return s.x;
    case OM_STRAIN:
        om_mat3_eigen_symmetric(corotational_strain(el->F, om__fem_rotation(el->F)), &s, &v);
        return fabs(s.x) > fabs(s.z) ? s.x : s.z;
    case OM_VOLUME_RATIO: return om_mat3_det(el->F);
    case OM_ENERGY_DENSITY: return el->energy;
    }
    return 0;
}

OmStatus om__fem_get_measure(const OmTissueModel* m, const double* x, OmTissueMeasure measure,
                             double* value) {
    OmStatus status = OM_OK;
    double *scratch = NULL, *force = NULL, energy;
    const OmFemCells* cells = ((const OmFem*)m->data)->cells;
    if (cells) {
        OM_ALLOC_DONE(scratch, om__cell_scratch_size(m));
        OM_ALLOC_DONE(force, 3 * (size_t)m->mesh.nvert);
        om__cell_balance(m, 1, x, scratch, force, &energy);
    }
    for (int e = 0; e < m->mesh.ntet; ++e) {
        const OmMaterial* material = om__fem_material(m, e);
        Element el = look_at(m, x, e);
        if (cells && (measure == OM_VON_MISES || measure == OM_ENERGY_DENSITY)) {
            el.F = om__cell_mean(m, scratch, e, &el.energy);
            el.P = material->law == OM_COROTATIONAL ? corotational_stress(material, el.F, &energy)
                                                    : om__law_stress(material, el.F, &energy);
        }
        value[e] = measure_of(material, &el, measure);
    }
done:
    om_free(scratch);
    om_free(force);
    return status;
}
