// fem_principal.c: energies of all laws and their derivatives by principal stretches, in double.
//
// Every law here is a sum of terms in I1, I2, J and powers of stretches; each term adds its derivatives. Terms
// that few laws need cost little: the SIMD pass (fem_stretch.c) has its own short forms of the common laws.
#include "fem/fem_principal.h"

#include "omentum/vec.h"

typedef struct Taylor {  // a function of one variable with two derivatives
    double f, d, dd;
} Taylor;

// The second-order Taylor polynomial about the floor.
static Taylor continue_below(Taylor at, double x, double floor) {
    double t = x - floor;
    Taylor y = {at.f + t * (at.d + 0.5 * t * at.dd), at.d + t * at.dd, at.dd};
    return y;
}

static Taylor power_of(double x, double q) {
    double b = fmax(x, OM_LAW_POWER_FLOOR), f = pow(b, q);
    Taylor y = {f, q * f / b, q * (q - 1) * f / (b * b)};
    return x < OM_LAW_POWER_FLOOR ? continue_below(y, x, OM_LAW_POWER_FLOOR) : y;
}

// x^q as a factor of energies, which must stay above 0: for q > 0 it continues below the floor as 1 / x^-q
// does. Its Taylor polynomial is below 0 where x is, and an inverted element would gain energy without bound.
static Taylor factor_of(double x, double q) {
    if (q <= 0 || x >= OM_LAW_POWER_FLOOR) return power_of(x, q);
    Taylor g = power_of(x, -q);  // at least that of the floor
    double y = 1 / g.f;
    return (Taylor){y, -g.d * y * y, (2 * g.d * g.d * y - g.dd) * y * y};
}

// k1 ln J + k2 (ln J)^2, continued as a whole: the square of a continued logarithm would be a polynomial of
// twelfth degree in positions, under which deeply inverted elements explode.
static Taylor logs_of(double k1, double k2, double J) {
    double b = fmax(J, OM_LAW_LOG_FLOOR), l = log(b), inv = 1 / b, d = k1 + 2 * k2 * l;
    Taylor y = {(k1 + k2 * l) * l, d * inv, (2 * k2 - d) * inv * inv};
    return J < OM_LAW_LOG_FLOOR ? continue_below(y, J, OM_LAW_LOG_FLOOR) : y;
}

static Taylor volumetric(const OmMaterial* m, double K, double J) {
    if (m->volumetric == OM_VOLUME_LINEAR)
        return (Taylor){K / 2 * (J - 1) * (J - 1), K * (J - 1), K};
    if (m->volumetric == OM_VOLUME_LOG) return logs_of(0, K / 2, J);
    Taylor y = logs_of(-K / 2, 0, J);
    return (Taylor){y.f + K / 4 * (J * J - 1), y.d + K / 2 * J, y.dd + K / 2};
}

typedef struct Stretches {
    const double* s;
    double J, c[3];       // determinant, cofactors
    double I1, I2, m[3];  // invariants, dI2/ds
} Stretches;

// Add U(J).
static void add_volume(OmPrincipal* p, const Stretches* a, Taylor U) {
    p->W += U.f;
    for (int i = 0; i < 3; ++i) {
        p->P[i] += U.d * a->c[i];
        for (int j = 0; j < 3; ++j) p->H[i][j] += U.dd * a->c[i] * a->c[j];
        int j = (i + 1) % 3, k = (i + 2) % 3;
        p->H[i][j] += U.d * a->s[k];
        p->H[i][k] += U.d * a->s[j];
        p->cross[i] -= U.d * a->s[i];
    }
}

// Add A(J) (I1 - 3) minus its constant part: A(J) I1 - 3 A(1) is zero at rest, where A(1) = scale.
static void add_first(OmPrincipal* p, const Stretches* a, double scale, Taylor A) {
    p->W += scale * (A.f * a->I1 - 3);
    for (int i = 0; i < 3; ++i) {
        p->P[i] += scale * (2 * A.f * a->s[i] + A.d * a->I1 * a->c[i]);
        p->own[i] += scale * 2 * A.f;
        p->cross[i] -= scale * A.d * a->I1 * a->s[i];
        for (int j = 0; j < 3; ++j)
            p->H[i][j] += scale * (2 * A.d * (a->s[i] * a->c[j] + a->s[j] * a->c[i]) +
                                   A.dd * a->I1 * a->c[i] * a->c[j] +
                                   (i == j ? 2 * A.f : A.d * a->I1 * a->s[3 - i - j]));
    }
}

// Add scale (A(J) I2 - 3).
static void add_second(OmPrincipal* p, const Stretches* a, double scale, Taylor A) {
    p->W += scale * (A.f * a->I2 - 3);
    for (int i = 0; i < 3; ++i) {
        int u = (i + 1) % 3, v = (i + 2) % 3;
        p->P[i] += scale * (A.f * a->m[i] + A.d * a->I2 * a->c[i]);
        p->own[i] += scale * 2 * A.f * a->s[i] * a->s[i];
        p->cross[i] -= scale * (2 * A.f * a->s[u] * a->s[v] + A.d * a->I2 * a->s[i]);
        for (int j = 0; j < 3; ++j) {
            double second = i == j ? 2 * (a->I1 - a->s[i] * a->s[i]) : 4 * a->s[i] * a->s[j];
            p->H[i][j] += scale * (A.f * second + A.d * (a->m[i] * a->c[j] + a->m[j] * a->c[i]) +
                                   A.dd * a->I2 * a->c[i] * a->c[j] +
                                   (i == j ? 0 : A.d * a->I2 * a->s[3 - i - j]));
        }
    }
}

// Add mu / alpha (A(J) sum_i s_i^alpha - 3).
static void add_ogden(OmPrincipal* p, const Stretches* a, double mu, double alpha, Taylor A) {
    Taylor f[3];
    double scale = mu / alpha, sum = 0;
    for (int i = 0; i < 3; ++i) {
        f[i] = power_of(a->s[i], alpha);
        sum += f[i].f;
    }
    p->W += scale * (A.f * sum - 3);
    for (int i = 0; i < 3; ++i) {
        int u = (i + 1) % 3, v = (i + 2) % 3;
        p->P[i] += scale * (A.f * f[i].d + A.d * sum * a->c[i]);
        // The slopes between two stretches; where they coincide, the derivative there. A stretch and
        // its negative coincide in inverted elements, where the energy has a crease.
        double less = a->s[u] - a->s[v], more = a->s[u] + a->s[v];
        double flip = fabs(less) > 1e-5 ? (f[u].d - f[v].d) / less : 0.5 * (f[u].dd + f[v].dd);
        double twist = (f[u].d + f[v].d) / (fabs(more) > 1e-3 ? more : copysign(1e-3, more));
        p->own[i] += scale * A.f * 0.5 * (flip + twist);
        p->cross[i] += scale * (A.f * 0.5 * (flip - twist) - A.d * sum * a->s[i]);
        for (int j = 0; j < 3; ++j)
            p->H[i][j] += scale * (A.d * (f[i].d * a->c[j] + f[j].d * a->c[i]) +
                                   A.dd * sum * a->c[i] * a->c[j] +
                                   (i == j ? A.f * f[i].dd : A.d * sum * a->s[3 - i - j]));
    }
}

static void add_st_venant(OmPrincipal* p, const Stretches* a, double lambda, double mu) {
    double t = 0.5 * lambda * (a->I1 - 3), sum4 = 0;
    for (int i = 0; i < 3; ++i) {
        double s = a->s[i], u = a->s[(i + 1) % 3], v = a->s[(i + 2) % 3];
        sum4 += (s * s - 1) * (s * s - 1);
        p->P[i] += t * s + mu * (s * s - 1) * s;
        p->own[i] += t - mu + mu * (u * u + v * v);
        p->cross[i] += mu * u * v;
        for (int j = 0; j < 3; ++j)
            p->H[i][j] += lambda * s * a->s[j] + (i == j ? t + mu * (3 * s * s - 1) : 0);
    }
    p->W += lambda / 8 * (a->I1 - 3) * (a->I1 - 3) + mu / 4 * sum4;
}

static void add_corotational(OmPrincipal* p, const Stretches* a, double lambda, double mu) {
    double trace = a->s[0] + a->s[1] + a->s[2] - 3;
    p->W += lambda / 2 * trace * trace;
    for (int i = 0; i < 3; ++i) {
        double e = a->s[i] - 1, more = a->s[(i + 1) % 3] + a->s[(i + 2) % 3];
        double twist = 2 * mu + (2 * lambda * trace - 4 * mu) /
                                    (fabs(more) > 1e-3 ? more : copysign(1e-3, more));
        p->W += mu * e * e;
        p->P[i] += 2 * mu * e + lambda * trace;
        p->own[i] += mu + 0.5 * twist;
        p->cross[i] += mu - 0.5 * twist;
        for (int j = 0; j < 3; ++j) p->H[i][j] += lambda + (i == j ? 2 * mu : 0);
    }
}

void om__law_share(const OmMaterial* m, OmLawShare share, double* lambda, double* mu, double* K) {
    om_material_lame(m, lambda, mu, K);
    if (share == OM_SHARE_WHOLE) return;
    double wide = fmax(*lambda - OM__INNER_RATIO * *mu, 0);
    *lambda = share == OM_SHARE_WIDE ? wide : *lambda - wide;
    *K = share == OM_SHARE_WIDE ? wide : *K - wide;
    if (share == OM_SHARE_WIDE) *mu = 0;
}

void om__principal_eval(const OmMaterial* m, OmLawShare share, const double s[3], OmPrincipal* p) {
    Stretches a = {.s = s, .J = s[0] * s[1] * s[2]};
    double lambda, mu, K;
    om__law_share(m, share, &lambda, &mu, &K);
    bool has_shape = share != OM_SHARE_WIDE;
    for (int i = 0; i < 3; ++i) {
        double u = s[(i + 1) % 3], v = s[(i + 2) % 3];
        a.c[i] = u * v;
        a.I1 += s[i] * s[i];
        a.I2 += u * u * v * v;
        a.m[i] = 2 * s[i] * (u * u + v * v);
    }
    *p = (OmPrincipal){0};
    const Taylor one = {1, 0, 0};
    int nterm = m->nterm > 0 ? m->nterm : 1;
    switch (m->law) {
    case OM_ST_VENANT_KIRCHHOFF: add_st_venant(p, &a, lambda, mu); break;
    case OM_NEO_HOOKEAN:
        add_first(p, &a, mu / 2, one);
        add_volume(p, &a, logs_of(-mu, lambda / 2, a.J));
        break;
    case OM_STABLE_NEO_HOOKEAN: {
        double t = a.J - 1, k = lambda + mu;
        add_first(p, &a, mu / 2, one);
        add_volume(p, &a, (Taylor){-mu * t + k / 2 * t * t, -mu + k * t, k});
        break;
    }
    case OM_MOONEY_RIVLIN: {
        double c10 = m->c10 + m->c01 > 0 ? m->c10 : mu / 2;
        if (has_shape) add_first(p, &a, c10, power_of(a.J, -2.0 / 3));
        if (has_shape && m->c01 > 0) add_second(p, &a, m->c01, power_of(a.J, -4.0 / 3));
        add_volume(p, &a, volumetric(m, K, a.J));
        break;
    }
    case OM_OGDEN:
    case OM_OGDEN_COUPLED:
        for (int n = 0; n < nterm && has_shape; ++n) {
            double alpha = m->nterm > 0 ? m->ogden_alpha[n] : 2;
            double mu_n = m->nterm > 0 ? m->ogden_mu[n] : mu;
            bool is_coupled = m->law == OM_OGDEN_COUPLED;
            add_ogden(p, &a, mu_n, alpha, is_coupled ? one : factor_of(a.J, -alpha / 3));
            if (is_coupled) add_volume(p, &a, logs_of(-mu_n, 0, a.J));
        }
        add_volume(p, &a, volumetric(m, m->law == OM_OGDEN_COUPLED ? lambda : K, a.J));
        break;
    default: add_corotational(p, &a, lambda, mu);
    }
}

void om__principal_project(OmPrincipal* p) {
    for (int k = 0; k < 3; ++k) {
        double flip = fmax(p->own[k] + p->cross[k], 0), twist = fmax(p->own[k] - p->cross[k], 0);
        p->own[k] = 0.5 * (flip + twist);
        p->cross[k] = 0.5 * (flip - twist);
    }
    OmMat3 H = {om_vec3(p->H[0][0], p->H[1][0], p->H[2][0]),
                om_vec3(p->H[0][1], p->H[1][1], p->H[2][1]),
                om_vec3(p->H[0][2], p->H[1][2], p->H[2][2])};
    OmVec3 e;
    OmMat3 Q;
    om_mat3_eigen_symmetric(H, &e, &Q);
    if (e.x >= 0 && e.y >= 0 && e.z >= 0) return;
    OmMat3 D = om_mat3_diag(om_vec3(fmax(e.x, 0), fmax(e.y, 0), fmax(e.z, 0)));
    H = om_mat3_mul(Q, om_mat3_mul(D, om_mat3_transpose(Q)));
    const OmVec3 col[3] = {H.cx, H.cy, H.cz};
    for (int j = 0; j < 3; ++j) {
        p->H[0][j] = col[j].x;
        p->H[1][j] = col[j].y;
        p->H[2][j] = col[j].z;
    }
}

static OmMat3 linear_stress(double lambda, double mu, OmMat3 F, double* energy) {
    OmMat3 e = om_mat3_scale(0.5, om_mat3_add(F, om_mat3_transpose(F)));
    e = om_mat3_add(e, om_mat3_diag(om_vec3(-1, -1, -1)));
    double t = om_mat3_trace(e), n = om_mat3_norm(e);
    *energy = mu * n * n + lambda / 2 * t * t;
    return om_mat3_add(om_mat3_scale(2 * mu, e),
                       om_mat3_diag(om_vec3(lambda * t, lambda * t, lambda * t)));
}

// mu F + U'(J) cof F for W = mu/2 (I1 - 3) + U(J).
static OmMat3 volume_stress(double mu, Taylor U, OmMat3 F, OmMat3 cof, double* energy) {
    double I1 = om_norm2(F.cx) + om_norm2(F.cy) + om_norm2(F.cz);
    *energy = mu / 2 * (I1 - 3) + U.f;
    return om_mat3_add(om_mat3_scale(mu, F), om_mat3_scale(U.d, cof));
}

// c10 (A I1 - 3) + c01 (B I2 - 3) + U(J), A and B powers of J; dI2/dF = 2 (I1 F - F F^T F).
static OmMat3 mooney_stress(const OmMaterial* m, const double c[2], double K, OmMat3 F, OmMat3 cof,
                            double* energy) {
    double J = om_dot(F.cx, cof.cx);
    Taylor A = power_of(J, -2.0 / 3), U = volumetric(m, K, J);
    double I1 = om_norm2(F.cx) + om_norm2(F.cy) + om_norm2(F.cz), by_F = 2 * c[0] * A.f;
    double by_cof = U.d + c[0] * A.d * I1;
    *energy = U.f + c[0] * (A.f * I1 - 3);
    if (c[1] == 0) return om_mat3_add(om_mat3_scale(by_F, F), om_mat3_scale(by_cof, cof));
    Taylor B = power_of(J, -4.0 / 3);
    double I2 = om_norm2(cof.cx) + om_norm2(cof.cy) + om_norm2(cof.cz), by_cube = 2 * c[1] * B.f;
    *energy += c[1] * (B.f * I2 - 3);
    by_F += by_cube * I1;
    by_cof += c[1] * B.d * I2;
    OmMat3 cube = om_mat3_mul(F, om_mat3_mul(om_mat3_transpose(F), F));
    OmMat3 P = om_mat3_add(om_mat3_scale(by_F, F), om_mat3_scale(by_cof, cof));
    return om_mat3_add(P, om_mat3_scale(-by_cube, cube));
}

OmMat3 om__law_stress(const OmMaterial* m, OmLawShare share, OmMat3 F, double* energy) {
    double lambda, mu, bulk;
    om__law_share(m, share, &lambda, &mu, &bulk);
    OmMat3 cof = om_mat3_cols(om_cross(F.cy, F.cz), om_cross(F.cz, F.cx), om_cross(F.cx, F.cy));
    double J = om_dot(F.cx, cof.cx);
    // The common laws straight from F.
    if (m->law == OM_LINEAR) return linear_stress(lambda, mu, F, energy);
    if (m->law == OM_NEO_HOOKEAN) {
        return volume_stress(mu, logs_of(-mu, lambda / 2, J), F, cof, energy);
    }
    if (m->law == OM_STABLE_NEO_HOOKEAN) {
        double t = J - 1, k = lambda + mu;
        Taylor U = {(k / 2 * t - mu) * t, k * t - mu, 0};
        return volume_stress(mu, U, F, cof, energy);
    }
    if (m->law == OM_ST_VENANT_KIRCHHOFF) {
        OmMat3 E = om_mat3_scale(0.5, om_mat3_mul(om_mat3_transpose(F), F));
        E = om_mat3_add(E, om_mat3_diag(om_vec3(-0.5, -0.5, -0.5)));
        double t = om_mat3_trace(E), n = om_mat3_norm(E), p = lambda * t;
        *energy = mu * n * n + lambda / 2 * t * t;
        return om_mat3_mul(F,
                           om_mat3_add(om_mat3_scale(2 * mu, E), om_mat3_diag(om_vec3(p, p, p))));
    }
    if (m->law == OM_MOONEY_RIVLIN) {
        bool has_shape = share != OM_SHARE_WIDE;
        double c10 = m->c10 + m->c01 > 0 ? m->c10 : mu / 2;
        const double c[2] = {has_shape ? c10 : 0, has_shape ? m->c01 : 0};
        return mooney_stress(m, c, bulk, F, cof, energy);
    }
    OmMat3 U, V;
    OmVec3 s;
    OmPrincipal p;
    om_mat3_svd(F, &U, &s, &V);
    const double stretch[3] = {s.x, s.y, s.z};
    om__principal_eval(m, share, stretch, &p);
    *energy = p.W;
    OmMat3 D = om_mat3_diag(om_vec3(p.P[0], p.P[1], p.P[2]));
    return om_mat3_mul(U, om_mat3_mul(D, om_mat3_transpose(V)));
}
