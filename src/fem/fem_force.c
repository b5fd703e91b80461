// fem_force.c: elastic forces, energy and measures of corotational elements, in double.
//
// What a step computes in float, computed again from the state alone, element after element:
// e = sym(R^T F) - I, s = 2 mu e + lambda tr(e) I, force on vertex a: -V R s g_a.
#include "fem/fem_internal.h"

// See fem_turn.c. Newton starts above the largest root and so comes down to it.
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
    OmMat3 F, R;
    OmMat3 e;  // corotational strain
    double lambda, mu, volume, trace;
} Element;

static Element look_at(const OmTissueModel* m, const double* x, int e) {
    Element el = {.vert = m->mesh.tet_vert + 4 * (size_t)e, .volume = m->volume[e]};
    const double* g = ((const OmFem*)m->data)->grad + 9 * (size_t)e;
    el.g = om_mat3_cols(om_load3(g, 0), om_load3(g, 1), om_load3(g, 2));
    OmVec3 o = om_load3(x, el.vert[0]);
    OmMat3 D = om_mat3_cols(om_sub(om_load3(x, el.vert[1]), o), om_sub(om_load3(x, el.vert[2]), o),
                            om_sub(om_load3(x, el.vert[3]), o));
    el.F = om_mat3_mul(D, om_mat3_transpose(el.g));
    el.R = om__fem_rotation(el.F);
    OmMat3 U = om_mat3_mul(om_mat3_transpose(el.R), el.F);
    el.e = om_mat3_scale(0.5, om_mat3_add(U, om_mat3_transpose(U)));
    el.e.cx.x -= 1;
    el.e.cy.y -= 1;
    el.e.cz.z -= 1;
    el.trace = om_mat3_trace(el.e);
    om__fem_lame(m, e, &el.lambda, &el.mu);
    return el;
}

static OmMat3 stress_of(const Element* el) {
    double p = el->lambda * el->trace;
    return om_mat3_add(om_mat3_scale(2 * el->mu, el->e), om_mat3_diag(om_vec3(p, p, p)));
}

void om__fem_add_internal_force(const OmTissueModel* m, const double* x, const unsigned char* mask,
                                double* force, OmVec3* sum) {
    for (int e = 0; e < m->mesh.ntet; ++e) {
        const int* v = m->mesh.tet_vert + 4 * (size_t)e;
        if (mask && !(mask[v[0]] | mask[v[1]] | mask[v[2]] | mask[v[3]])) continue;
        Element el = look_at(m, x, e);
        OmMat3 P = om_mat3_scale(-el.volume, om_mat3_mul(el.R, stress_of(&el)));
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
}

static double energy_density(const Element* el) {
    double ee = om_norm2(el->e.cx) + om_norm2(el->e.cy) + om_norm2(el->e.cz);
    return el->mu * ee + 0.5 * el->lambda * el->trace * el->trace;
}

double om__fem_get_energy(const OmTissueModel* m, const double* x) {
    double sum = 0;
    for (int e = 0; e < m->mesh.ntet; ++e) {
        Element el = look_at(m, x, e);
        sum += el.volume * energy_density(&el);
    }
    return sum;
}

static double von_mises(const Element* el) {
    OmMat3 s = stress_of(el);
    double p = om_mat3_trace(s) / 3;
    OmMat3 d = om_mat3_add(s, om_mat3_diag(om_vec3(-p, -p, -p)));
    return sqrt(1.5 * (om_norm2(d.cx) + om_norm2(d.cy) + om_norm2(d.cz)));
}

static double measure_of(const Element* el, OmTissueMeasure measure) {
    OmMat3 u, v;
    OmVec3 s;
    switch (measure) {
    case OM_VON_MISES: return von_mises(el);
    case OM_PRINCIPAL_STRETCH: om_mat3_svd(el->F, &u, &s, &v); return s.x;
    case OM_STRAIN:
        om_mat3_eigen_symmetric(el->e, &s, &v);
        return fabs(s.x) > fabs(s.z) ? s.x : s.z;
    case OM_VOLUME_RATIO: return om_mat3_det(el->F);
    case OM_ENERGY_DENSITY: return energy_density(el);
    }
    return 0;
}

void om__fem_get_measure(const OmTissueModel* m, const double* x, OmTissueMeasure measure,
                         double* value) {
    for (int e = 0; e < m->mesh.ntet; ++e) {
        Element el = look_at(m, x, e);
        value[e] = measure_of(&el, measure);
    }
}
