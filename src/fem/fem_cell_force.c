// fem_cell_force.c: energy, forces and means of averaged strains, in double; fem_cell.c has the method.
//
// With M symmetric under the volumes, the averaged volumetric term gives a cell p = V M M U'(M M t), and its stress
// times volume is S = V P + p dt/dF - 1/4 sum Q, Q = a mu V_e (F_e - mean F_c) of its elements. Forces are -S g of
// the cells and -Q g of the elements.
#include <string.h>

#include "fem/fem_internal.h"

// Parts of cells and elements, each summed by one worker: the same sum for any number of workers.
#define NPART 64

typedef struct Scratch {
    double *F, *S;      // deformation gradient; stress times volume      (ncell x 9)
    double* Q;          //                                                (ntet x 9)
    double* w;          // energy density                                 (ncell)
    double *t, *a, *b;  // measure of volume and its averages           (ncell)
    double* part;       // sums                                    (NPART)
} Scratch;

static Scratch lay_out(const OmTissueModel* m, double* memory) {
    size_t n = (size_t)((const OmFem*)m->data)->cells->ncell;
    Scratch s = {.F = memory};
    s.S = s.F + 9 * n;
    s.Q = s.S + 9 * n;
    s.w = s.Q + 9 * (size_t)m->mesh.ntet;
    s.t = s.w + n;
    s.a = s.t + n;
    s.b = s.a + n;
    s.part = s.b + n;
    return s;
}

size_t om__cell_scratch_size(const OmTissueModel* m) {
    size_t n = (size_t)((const OmFem*)m->data)->cells->ncell;
    return 22 * n + 9 * (size_t)m->mesh.ntet + NPART;
}

static OmMat3 load_mat(const double* a, int k) {
    return om_mat3_cols(om_load3(a, 3 * k), om_load3(a, 3 * k + 1), om_load3(a, 3 * k + 2));
}
static void store_mat(double* a, int k, OmMat3 m) {
    om_store3(a, 3 * k, m.cx);
    om_store3(a, 3 * k + 1, m.cy);
    om_store3(a, 3 * k + 2, m.cz);
}

// a + b g^T
static OmMat3 add_dyad(OmMat3 a, OmVec3 b, OmVec3 g) {
    return om_mat3_cols(om_madd(a.cx, g.x, b), om_madd(a.cy, g.y, b), om_madd(a.cz, g.z, b));
}

// The measure of volume at F, and its derivative.
static double volume_measure(const OmMaterial* material, OmMat3 F, OmMat3* D) {
    switch (material->law) {
    case OM_COROTATIONAL:
        *D = om__fem_rotation(F);
        return om_mat3_trace(om_mat3_mul(om_mat3_transpose(*D), F)) - 3;
    case OM_LINEAR: *D = om_mat3_identity(); return om_mat3_trace(F) - 3;
    case OM_ST_VENANT_KIRCHHOFF: {
        double n = om_mat3_norm(F);
        *D = F;
        return 0.5 * (n * n - 3);
    }
    default:
        *D = om_mat3_cols(om_cross(F.cy, F.cz), om_cross(F.cz, F.cx), om_cross(F.cx, F.cy));
        return om_dot(F.cx, D->cx) - 1;
    }
}

static OmMat3 inner_stress(const OmMaterial* material, OmMat3 F, double* energy) {
    if (material->law != OM_COROTATIONAL)
        return om__law_stress(material, OM_SHARE_WHOLE, F, energy);
    double lambda, mu, bulk;
    om_material_lame(material, &lambda, &mu, &bulk);
    OmMat3 R = om__fem_rotation(F), U = om_mat3_mul(om_mat3_transpose(R), F);
    OmMat3 e = om_mat3_scale(0.5, om_mat3_add(U, om_mat3_transpose(U)));
    e = om_mat3_add(e, om_mat3_diag(om_vec3(-1, -1, -1)));
    double t = om_mat3_trace(e), p = lambda * t, n = om_mat3_norm(e);
    *energy = mu * n * n + 0.5 * lambda * t * t;
    return om_mat3_mul(R, om_mat3_add(om_mat3_scale(2 * mu, e), om_mat3_diag(om_vec3(p, p, p))));
}

typedef struct Job {
    const OmTissueModel* m;
    const OmFemCells* c;
    const double* x;
    Scratch s;
    double* force;
} Job;

static void eval_cell(const Job* j, int k) {
    const OmFemCells* c = j->c;
    OmVec3 o = om_load3(j->x, c->vert[k]);
    OmMat3 F = om_mat3_diag(om_vec3(0, 0, 0)), D;
    for (int at = c->adr[k]; at < c->adr[k + 1]; ++at)
        F = add_dyad(F, om_sub(om_load3(j->x, c->entry[at].index), o), om_load3(c->grad, at));
    const OmMaterial* material = &c->inner[c->material[k]];
    OmMat3 P = inner_stress(material, F, &j->s.w[k]);
    j->s.t[k] = volume_measure(material, F, &D);
    store_mat(j->s.F, k, F);
    store_mat(j->s.S, k, om_mat3_scale(c->volume[k], P));
}

static OmMat3 tet_gradient(const Job* j, int e, OmMat3* g) {
    const int* v = j->m->mesh.tet_vert + 4 * (size_t)e;
    *g = load_mat(((const OmFem*)j->m->data)->grad, e);
    OmVec3 o = om_load3(j->x, v[0]);
    OmMat3 D = om_mat3_cols(om_sub(om_load3(j->x, v[1]), o), om_sub(om_load3(j->x, v[2]), o),
                            om_sub(om_load3(j->x, v[3]), o));
    return om_mat3_mul(D, om_mat3_transpose(*g));
}

static OmMat3 mean_gradient(const OmFemCells* c, const Scratch* s, int e) {
    OmMat3 F = load_mat(s->F, c->tet_cell[4 * (size_t)e]);
    for (size_t a = 1; a < 4; ++a)
        F = om_mat3_add(F, load_mat(s->F, c->tet_cell[4 * (size_t)e + a]));
    return om_mat3_scale(0.25, F);
}

// Q of an element; its energy is returned.
static double eval_hinge(const Job* j, int e) {
    double lambda, mu;
    om__fem_lame(j->m, e, &lambda, &mu);
    OmMat3 g, F = tet_gradient(j, e, &g);
    OmMat3 d = om_mat3_add(F, om_mat3_scale(-1, mean_gradient(j->c, &j->s, e)));
    double k = OM__HINGE * mu * j->m->volume[e], n = om_mat3_norm(d);
    store_mat(j->s.Q, e, om_mat3_scale(k, d));
    return 0.5 * k * n * n;
}

// (W in)_k
static double spread(const OmFemCells* c, const double* in, int k) {
    double sum = 0;
    for (int at = c->near_adr[k]; at < c->near_adr[k + 1]; ++at)
        sum += c->weight[at] * in[c->near[at]];
    return sum;
}

static void finish_cell(const Job* j, int k) {
    const OmFemCells* c = j->c;
    OmMat3 D, S = load_mat(j->s.S, k), Q = om_mat3_diag(om_vec3(0, 0, 0));
    if (c->has_wide) {
        volume_measure(&c->inner[c->material[k]], load_mat(j->s.F, k), &D);
        S = om_mat3_add(S, om_mat3_scale(spread(c, j->s.t, k), D));
    }
    for (int at = c->tet_adr[k]; at < c->tet_adr[k + 1]; ++at)
        Q = om_mat3_add(Q, load_mat(j->s.Q, c->tet[at]));
    store_mat(j->s.S, k, om_mat3_add(S, om_mat3_scale(-0.25, Q)));
}

static void eval_force(const Job* j, int i) {
    const OmFemCells* c = j->c;
    const OmFem* fem = j->m->data;
    OmVec3 f = {0, 0, 0};
    for (int at = c->t_adr[i]; at < c->t_adr[i + 1]; ++at)
        f = om_sub(f, om_mat3_apply(load_mat(j->s.S, c->t_entry[at].index),
                                    om_load3(c->grad, c->t_from[at])));
    for (int at = fem->visit_adr[i]; at < fem->visit_adr[i + 1]; ++at) {
        int e = fem->visit[at].corner / 4, a = fem->visit[at].corner % 4;
        OmMat3 g = load_mat(fem->grad, e);
        OmVec3 own = a == 1 ? g.cx : a == 2 ? g.cy : g.cz;
        if (a == 0) own = om_scale(-1, om_add(om_add(g.cx, g.cy), g.cz));
        f = om_sub(f, om_mat3_apply(load_mat(j->s.Q, e), own));
    }
    om_store3(j->force, i, f);
}

static int share(int n, int k, int of) { return (int)((int64_t)n * k / of); }

static void balance_team(void* ctx, OmTeam* team, int rank, int size) {
    const Job* j = ctx;
    const OmFemCells* c = j->c;
    const Scratch* s = &j->s;
    int n = c->ncell, begin = share(n, rank, size), end = share(n, rank + 1, size);
    for (int k = begin; k < end; ++k) eval_cell(j, k);
    om_team_barrier(team);
    for (int p = NPART * rank / size; p < NPART * (rank + 1) / size; ++p) {
        s->part[p] = 0;
        for (int e = share(j->m->mesh.ntet, p, NPART); e < share(j->m->mesh.ntet, p + 1, NPART);
             ++e)
            s->part[p] += eval_hinge(j, e);
    }
    if (c->has_wide) {
        for (int k = begin; k < end; ++k) s->a[k] = spread(c, s->t, k) / c->volume[k];
        om_team_barrier(team);
        for (int k = begin; k < end; ++k) s->b[k] = spread(c, s->a, k) / c->volume[k];
        om_team_barrier(team);
        for (int k = begin; k < end; ++k) {
            OmJet U = om__cell_wide(c, c->material[k], s->b[k]);
            s->w[k] += U.f;
            s->a[k] = U.d;
        }
        om_team_barrier(team);
        for (int k = begin; k < end; ++k) s->t[k] = spread(c, s->a, k) / c->volume[k];
    }
    om_team_barrier(team);
    for (int p = NPART * rank / size; p < NPART * (rank + 1) / size; ++p)
        for (int k = share(n, p, NPART); k < share(n, p + 1, NPART); ++k)
            s->part[p] += c->volume[k] * s->w[k];
    for (int k = begin; k < end; ++k) finish_cell(j, k);
    om_team_barrier(team);
    int nvert = j->m->mesh.nvert;
    for (int i = share(nvert, rank, size); i < share(nvert, rank + 1, size); ++i) eval_force(j, i);
}

void om__cell_balance(const OmTissueModel* m, int nworker, const double* x, double* scratch,
                      double* force, double* energy) {
    Job j = {m, ((const OmFem*)m->data)->cells, x, lay_out(m, scratch), force};
    om_parallel_team(nworker, balance_team, &j);
    *energy = 0;
    for (int p = 0; p < NPART; ++p) *energy += j.s.part[p];
}

OmMat3 om__cell_mean(const OmTissueModel* m, const double* scratch, int e, double* energy) {
    const OmFemCells* c = ((const OmFem*)m->data)->cells;
    Scratch s = lay_out(m, (double*)(uintptr_t)scratch);
    double lambda, mu;
    om__fem_lame(m, e, &lambda, &mu);
    double k = OM__HINGE * mu, n = om_mat3_norm(load_mat(s.Q, e)) / (k * m->volume[e]);
    *energy = 0.5 * k * n * n;
    for (size_t a = 0; a < 4; ++a) *energy += 0.25 * s.w[c->tet_cell[4 * (size_t)e + a]];
    return mean_gradient(c, &s, e);
}
