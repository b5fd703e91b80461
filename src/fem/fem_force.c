// fem_force.c: elastic forces, energy and measures, in double.
//
// Computes the same quantities as a step, but in double and from the state alone, element after element.
// Corotational: e = sym(R^T F) - I, s = 2 mu e + lambda tr(e) I, force on vertex a: -V R s g_a. Other
// laws: -V P g_a.
#include "fem/fem_quadratic.h"
#include "fem/fem_shell.h"

// See fem_rotation.h. Newton starts above the largest root and decreases to it.
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

typedef struct Element {  // at a quadrature point
    OmMat3 g;             // gradients of barycentric coordinates 1, 2, 3 as columns
    OmMat3 F;
    OmMat3 P;       // first Piola-Kirchhoff stress, Pa
    double energy;  // J/m^3
    double volume;  // at rest, m^3
    double L[4];    // barycentric coordinates of a point of a quadratic element
} Element;

static OmMat3 corotational_strain(OmMat3 F, OmMat3 R) {
    OmMat3 U = om_mat3_mul(om_mat3_transpose(R), F);
    OmMat3 e = om_mat3_scale(0.5, om_mat3_add(U, om_mat3_transpose(U)));
    return om_mat3_add(e, om_mat3_diag(om_vec3(-1, -1, -1)));
}

static OmMat3 corotational_stress(const OmMaterial* m, OmLawShare share, OmMat3 F, double* energy) {
    double lambda, mu, bulk;
    om__law_share(m, share, &lambda, &mu, &bulk);
    OmMat3 R = om__fem_rotation(F), e = corotational_strain(F, R);
    double t = om_mat3_trace(e), p = lambda * t, n = om_mat3_norm(e);
    *energy = mu * n * n + 0.5 * lambda * t * t;
    return om_mat3_mul(R, om_mat3_add(om_mat3_scale(2 * mu, e), om_mat3_diag(om_vec3(p, p, p))));
}

OmMat3 om__fem_eval_stress(const OmMaterial* m, OmLawShare share, OmMat3 F, double* energy) {
    if (m->law == OM_COROTATIONAL) return corotational_stress(m, share, F, energy);
    return om__law_stress(m, share, F, energy);
}

double om__fem_eval_energy(const OmMaterial* material, OmLawShare share, OmMat3 F) {
    double energy;
    om__fem_eval_stress(material, share, F, &energy);
    return energy;
}

static const int* nodes_of(const OmTissueModel* m, int e) {
    return om__elem_node(m) + m->nelem_node * (size_t)e;
}

// A share of the law of element e; of a quadratic one at barycentric coordinates L.
static Element look_inside(const OmTissueModel* m, const double* x, int e, OmLawShare share,
                           const double L[4]) {
    const OmFem* fem = m->data;
    const int* node = nodes_of(m, e);
    Element el = {.volume = om__fem_volume(m, e)};
    const double* g = fem->grad + 9 * (size_t)e;
    el.g = om_mat3_cols(om_load3(g, 0), om_load3(g, 1), om_load3(g, 2));
    OmVec3 y[4];
    for (int k = 0; k < 4 && !fem->mids; ++k) y[k] = om_load3(x, node[k]);
    if (fem->mids) om__point_vertices(x, node, L, y);
    memcpy(el.L, L, sizeof el.L);
    OmMat3 D = om_mat3_cols(om_sub(y[1], y[0]), om_sub(y[2], y[0]), om_sub(y[3], y[0]));
    el.F = om_mat3_mul(D, om_mat3_transpose(el.g));
    el.P = om__fem_eval_stress(om__fem_material(m, e), share, el.F, &el.energy);
    return el;
}

static Element look_at(const OmTissueModel* m, const double* x, int e, int point) {
    double L[4];
    om__point_at(point, L);
    if (!m->elem_node) return look_inside(m, x, e, OM_SHARE_WHOLE, L);
    Element el = look_inside(m, x, e, om__point_share(point), L);
    el.volume *= om__point_volume(point);
    return el;
}

// ---- shells -----------------------------------------------------------------------------------------

static OmMat3 strain_matrix(const double v[6]) {
    return om_mat3_cols(om_vec3(v[0], 0.5 * v[3], 0.5 * v[4]),
                        om_vec3(0.5 * v[3], v[1], 0.5 * v[5]),
                        om_vec3(0.5 * v[4], 0.5 * v[5], v[2]));
}

// F of a shell, by columns, and the shares of the patterns, q (12).
static OmMat3 split_element(const OmTissueModel* m, const double* x, int e, OmVec3 q[4]) {
    const OmFemShell* s = &((const OmFem*)m->data)->shell[e];
    const int* node = nodes_of(m, e);
    OmMat3 F = om_mat3_scale(0, om_mat3_identity());
    for (int i = 0; i < 4; ++i) q[i] = (OmVec3){0, 0, 0};
    for (int a = 1; a < OM__SHELL_NODE; ++a) {  // relative to the first node
        OmVec3 d = om_sub(om_load3(x, node[a]), om_load3(x, node[0]));
        F = om_mat3_add(F, om_mat3_outer(d, om_load3(s->grad[a], 0)));
        for (int i = 0; i < 4; ++i) q[i] = om_madd(q[i], s->hour[i][a], d);
    }
    return F;
}

// d = R^T q, p = k d, e = B d as a matrix; the energy of k, J.
static double push_element(const OmFemShell* s, OmMat3 R, const OmVec3 q[4], double d[12],
                           double p[12], OmMat3* e) {
    double energy = 0, v[6];
    for (int i = 0; i < 4; ++i) om_store3(d, i, om_mat3_apply_transposed(R, q[i]));
    for (int r = 0; r < 12; ++r) {
        p[r] = 0;
        for (int c = 0; c < 12; ++c) p[r] += s->stiff[r][c] * d[c];
        energy += 0.5 * d[r] * p[r];
    }
    for (int r = 0; r < 6; ++r) {
        v[r] = 0;
        for (int c = 0; c < 12; ++c) v[r] += s->strain[r][c] * d[c];
    }
    *e = strain_matrix(v);
    return energy;
}

// The rotation of F, with the frame of its stretches.
static OmMat3 turn_element(const OmMaterial* m, OmMat3 F, OmMat3* V, OmVec3* stretch) {
    OmMat3 U;
    om_mat3_svd(F, &U, stretch, V);
    return m->law == OM_LINEAR ? om_mat3_identity() : om_mat3_mul(U, om_mat3_transpose(*V));
}

// A point of a shell: p and the torque on R get its share; returns the first Piola-Kirchhoff stress.
static OmMat3 eval_shell_point(const OmMaterial* material, const OmFemShell* s, OmMat3 F, OmMat3 R,
                               OmMat3 e, double side, double p[12], OmVec3* torque,
                               double* density) {
    OmMat3 at = om_mat3_add(F, om_mat3_scale(side, om_mat3_mul(R, e)));
    OmMat3 P = om__fem_eval_stress(material, OM_SHARE_WHOLE, at, density);
    OmMat3 A = om_mat3_mul(om_mat3_transpose(R), P), M = om_mat3_mul(A, e);
    const double stress[6] = {A.cx.x,
                              A.cy.y,
                              A.cz.z,
                              0.5 * (A.cx.y + A.cy.x),
                              0.5 * (A.cx.z + A.cz.x),
                              0.5 * (A.cy.z + A.cz.y)};
    double half = 0.5 * side * s->volume;
    for (int v = 0; v < 6; ++v)
        for (int n = 0; n < 12; ++n) p[n] += half * s->strain[v][n] * stress[v];
    *torque = om_madd(*torque, -half, om_vec3(M.cy.z - M.cz.y, M.cz.x - M.cx.z, M.cx.y - M.cy.x));
    return P;
}

// Energy, J, of what keeps corners from being crushed; its forces are added.
static double resist_element(const OmTissueModel* m, int e, OmMat3 F, const OmVec3 q[4],
                             OmVec3 f[10]) {
    double Fl[9], ql[12], slope[24] = {0}, lambda, mu;
    om__fem_lame(m, e, &lambda, &mu);
    double unit = om__fem_volume(m, e) * mu;
    om_store3(Fl, 0, F.cx), om_store3(Fl, 1, F.cy), om_store3(Fl, 2, F.cz);
    for (int i = 0; i < 4; ++i) om_store3(ql, i, q[i]);
    double energy = om__fem_shell_resist_at(m, e, Fl, ql, slope, NULL);
    for (int a = 0; a < OM__SHELL_NODE; ++a) f[a] = om_madd(f[a], -unit, om_load3(slope, a));
    return unit * energy;
}

static double eval_shell(const OmTissueModel* m, const double* x, int e, OmVec3 f[10]) {
    const OmFemShell* s = &((const OmFem*)m->data)->shell[e];
    const OmMaterial* material = om__fem_material(m, e);
    OmVec3 q[4], stretch, t = {0, 0, 0};
    OmMat3 F = split_element(m, x, e, q), V, R = turn_element(material, F, &V, &stretch), strain;
    double d[12], p[12], density[2], energy = push_element(s, R, q, d, p, &strain);
    OmMat3 P = eval_shell_point(material, s, F, R, strain, 1, p, &t, &density[0]);
    P = om_mat3_add(P, eval_shell_point(material, s, F, R, strain, -1, p, &t, &density[1]));
    for (int i = 0; i < 4; ++i) t = om_add(t, om_cross(om_load3(d, i), om_load3(p, i)));
    t = om_mat3_apply_transposed(V, t);
    t = om_mat3_apply(V, om_vec3(t.x / fmax(stretch.y + stretch.z, OM__MIN_TURN),
                                 t.y / fmax(stretch.z + stretch.x, OM__MIN_TURN),
                                 t.z / fmax(stretch.x + stretch.y, OM__MIN_TURN)));
    for (int a = 0; a < OM__SHELL_NODE; ++a) {
        OmVec3 g = om_load3(s->grad[a], 0), inner = {0, 0, 0};
        for (int i = 0; i < 4; ++i) inner = om_madd(inner, s->hour[i][a], om_load3(p, i));
        if (material->law != OM_LINEAR) inner = om_sub(inner, om_cross(t, g));
        f[a] =
            om_madd(om_scale(-1, om_mat3_apply(R, inner)), -0.5 * s->volume, om_mat3_apply(P, g));
    }
    energy += resist_element(m, e, F, q, f);
    return 0.5 * s->volume * (density[0] + density[1]) + energy;
}

// The law of a shell at the centroids of its six tetrahedra: F there is that of its mean gradient and of the strain of
// the patterns.
static void look_at_shell(const OmTissueModel* m, const double* x, int e, Element el[6]) {
    const OmFemShell* s = &((const OmFem*)m->data)->shell[e];
    const OmMaterial* material = om__fem_material(m, e);
    OmVec3 q[4], stretch;
    OmMat3 F = split_element(m, x, e, q), V, R = turn_element(material, F, &V, &stretch), unused;
    double d[12], p[12], strain[6][6];
    push_element(s, R, q, d, p, &unused);
    om__fem_shell_strains(m, e, d, strain);
    for (int k = 0; k < 6; ++k) {
        el[k] = (Element){.F = om_mat3_add(F, om_mat3_mul(R, strain_matrix(strain[k]))),
                          .volume = s->volume / 6};
        el[k].P = om__fem_eval_stress(material, OM_SHARE_WHOLE, el[k].F, &el[k].energy);
    }
}

// ---- elements -----------------------------------------------------------------------------------------

// Forces of element e on its nodes, from all its points; its energy, J, is returned.
static double eval_element(const OmTissueModel* m, const double* x, int e, OmVec3 f[10]) {
    const OmFem* fem = m->data;
    double energy = 0;
    if (fem->shell) return eval_shell(m, x, e, f);
    for (int n = 0; n < 10; ++n) f[n] = (OmVec3){0, 0, 0};
    for (int q = 0; q < fem->npoint; ++q) {
        Element el = look_at(m, x, e, q);
        energy += el.volume * el.energy;
        OmMat3 P = om_mat3_scale(-el.volume, el.P);
        OmVec3 of[4] = {{0, 0, 0},
                        om_mat3_apply(P, el.g.cx),
                        om_mat3_apply(P, el.g.cy),
                        om_mat3_apply(P, el.g.cz)};
        of[0] = om_scale(-1, om_add(om_add(of[1], of[2]), of[3]));
        for (int k = 0; k < 4 && !fem->mids; ++k) f[k] = of[k];
        for (int n = 0; n < 10 && fem->mids; ++n)
            for (int i = 0; i < (n < 4 ? 1 : 2); ++i)
                f[n] = om_madd(f[n], om__node_weight(n, i, el.L), of[om__node_end[n][i]]);
    }
    return energy;
}

OmStatus om__fem_add_internal_force(const OmTissueModel* m, const double* x,
                                    const unsigned char* mask, double* force, OmVec3* sum) {
    for (int e = 0; e < m->nelem; ++e) {
        const int* v = nodes_of(m, e);
        bool is_asked = !mask;
        for (int a = 0; a < m->nelem_node && !is_asked; ++a) is_asked = mask[v[a]];
        if (!is_asked) continue;
        OmVec3 f[10];
        eval_element(m, x, e, f);
        for (int a = 0; a < m->nelem_node; ++a) {
            if (mask && !mask[v[a]]) continue;
            *sum = om_add(*sum, f[a]);
            if (force) om_store3(force, v[a], om_add(om_load3(force, v[a]), f[a]));
        }
    }
    return OM_OK;
}

OmStatus om__fem_get_energy(const OmTissueModel* m, const double* x, double* energy) {
    *energy = 0;
    OmVec3 f[10];
    for (int e = 0; e < m->nelem; ++e) *energy += eval_element(m, x, e, f);
    return OM_OK;
}

// ---- forces and energy by many workers --------------------------------------------------------------

#define NPART 64  // of the elements, each summed by one worker: the same sum for any number of them

typedef struct Balance {
    const OmTissueModel* m;
    const double* x;
    double* corner;  // forces of elements on their nodes           (nelem x nelem_node x 3)
    double* force;
    double part[NPART];
} Balance;

static void balance_team(void* ctx, OmTeam* team, int rank, int size) {
    Balance* a = ctx;
    const OmFem* fem = a->m->data;
    int64_t nelem = a->m->nelem, nvert = a->m->mesh.nvert;
    int per = a->m->nelem_node;
    for (int k = NPART * rank / size; k < NPART * (rank + 1) / size; ++k) {
        a->part[k] = 0;
        for (int e = (int)(nelem * k / NPART); e < (int)(nelem * (k + 1) / NPART); ++e) {
            OmVec3 f[10];
            a->part[k] += eval_element(a->m, a->x, e, f);
            for (int n = 0; n < per; ++n) om_store3(a->corner, per * e + n, f[n]);
        }
    }
    om_team_barrier(team);
    for (int i = (int)(nvert * rank / size); i < (int)(nvert * (rank + 1) / size); ++i) {
        OmVec3 f = {0, 0, 0};
        for (int at = fem->visit_adr[i]; at < fem->visit_adr[i + 1]; ++at)
            f = om_add(f, om_load3(a->corner, fem->visit ? fem->visit[at].corner
                                                         : fem->large_visit[at].corner));
        om_store3(a->force, i, f);
    }
}

OmStatus om__fem_eval_balance(const OmTissueModel* m, OmTissueWork* w, const double* x,
                              double* force, double* energy) {
    OmFemWork* fw = w->data;
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

// Element `tet` of the mesh: of a quadratic element the eighth with these four nodes, at its centroid, with the wide
// part of the law of the whole element.
static Element look_at_tet(const OmTissueModel* m, const double* x, int tet) {
    double L[4] = {0, 0, 0, 0};
    if (!m->elem_node) return look_at(m, x, tet, 0);
    const int *node = nodes_of(m, tet / 8), *vert = m->mesh.tet_vert + 4 * (size_t)tet;
    for (int k = 0; k < 4; ++k) {
        int n = 0;
        while (node[n] != vert[k]) ++n;
        L[om__node_end[n][0]] += n < 4 ? 0.25 : 0.125;
        if (n >= 4) L[om__node_end[n][1]] += 0.125;
    }
    Element el = look_inside(m, x, tet / 8, OM_SHARE_INNER, L), wide = look_at(m, x, tet / 8, 4);
    el.P = om_mat3_add(el.P, wide.P);
    el.energy += wide.energy;
    return el;
}

OmStatus om__fem_get_measure(const OmTissueModel* m, const double* x, OmTissueMeasure measure,
                             double* value) {
    bool is_shell = ((const OmFem*)m->data)->shell != NULL;
    Element el[6];
    for (int e = 0; e < m->mesh.ntet; ++e) {
        const OmMaterial* material = om__fem_material(m, e / m->ntet_per);
        if (is_shell && e % 6 == 0) look_at_shell(m, x, e / 6, el);
        if (!is_shell) el[0] = look_at_tet(m, x, e);
        value[e] = measure_of(material, &el[is_shell ? e % 6 : 0], measure);
    }
    return OM_OK;
}
