// fem_law.c: every law of tissue_material.h, with the first two derivatives of its energy.
//
// Most laws are sums of terms c A(F) q(J) + h(J), where A is I1, I2 or a sum of powers of stretches. With the
// cofactors C = dJ/dF,
//
//     P = sum c q dA + hJ C,                        hJ  = h' + sum c A q'
//     H = sum c q d2A + b C^T + C b^T + hJJ C C^T + hJ d2J,   b = sum c q' dA,  hJJ = h'' + sum c A q''
//
// so each term only adds to these sums, and the last line is written once. Sums over stretches are
// differentiated in the frame of the singular vectors: with l_k the stretches and p the summand,
// d2A = sum p''(l_k) D_k D_k^T + sum over pairs of (p'_i - p'_j)/(l_i - l_j) T T^T + (p'_i + p'_j)/(l_i + l_j)
// S S^T, T and S the symmetric and skew unit matrices of the pair. Bonet and Wood (2008), chapter 6; Smith, de
// Goes and Kim (2018).
//
// An odd function of stretches has a crease where l_i = -l_j (an element inverted and elongated at once): there
// the curvature of S is limited to MAX_CURVATURE times its size, so that every tangent is finite.
#include "fem/fem_law.h"

#include <string.h>

#define EQUAL_STRETCH 1e-5  // nearer ones share the derivative: both errors are then below 1e-10
#define MAX_CURVATURE 1e6

// ---- constants --------------------------------------------------------------------------------------

void om__law_init(const OmMaterial* m, OmLawParam* law) {
    *law = (OmLawParam){.law = m->law, .volumetric = m->volumetric};
    double bulk;
    om_material_lame(m, &law->lambda, &law->mu, &bulk);
    // The coupled Ogden law has stiffness 2 mu / 3 against volume in addition to U: the rest of lambda is in U.
    law->bulk = m->law == OM_OGDEN_COUPLED ? law->lambda : bulk;
    law->c10 = m->c10;
    law->c01 = m->c01;
    if (m->c10 + m->c01 <= 0) law->c10 = law->mu / 2;
    law->nterm = m->nterm;
    for (int p = 0; p < m->nterm; ++p) {
        law->a[p] = m->ogden_mu[p] / m->ogden_alpha[p];  // alpha is not 0: om_material_validate
        law->alpha[p] = m->ogden_alpha[p];
    }
    if (m->nterm == 0) {
        law->nterm = 1;
        law->a[0] = law->mu / 2;
        law->alpha[0] = 2;
    }
}

// ---- functions of one variable ----------------------------------------------------------------------

static OmJet continued(OmJet at, double x, double floor) {
    double t = x - floor;
    return (OmJet){at.f + t * (at.d + 0.5 * t * at.dd), at.d + t * at.dd, at.dd};
}

static OmJet jet_log(double x) {
    double b = x > OM_LAW_LOG_FLOOR ? x : OM_LAW_LOG_FLOOR;
    OmJet y = {log(b), 1 / b, -1 / (b * b)};
    return x < OM_LAW_LOG_FLOOR ? continued(y, x, OM_LAW_LOG_FLOOR) : y;
}

static OmJet jet_power(double x, double e) {
    double b = x > OM_LAW_POWER_FLOOR ? x : OM_LAW_POWER_FLOOR, f = pow(b, e);
    OmJet y = {f, e * f / b, e * (e - 1) * f / (b * b)};
    return x < OM_LAW_POWER_FLOOR ? continued(y, x, OM_LAW_POWER_FLOOR) : y;
}

// x^e as a factor of energies, above 0 everywhere: om__principal_eval has the same.
static OmJet jet_factor(double x, double e) {
    if (e <= 0 || x >= OM_LAW_POWER_FLOOR) return jet_power(x, e);
    OmJet g = jet_power(x, -e);  // at least that of the floor
    double y = 1 / g.f;
    return (OmJet){y, -g.d * y * y, (2 * g.d * g.d * y - g.dd) * y * y};
}

// c/2 (x - 1)^2
static OmJet jet_square(double c, double x) {
    return (OmJet){c / 2 * (x - 1) * (x - 1), c * (x - 1), c};
}

// c/2 (ln x)^2
static OmJet jet_log_square(double c, double x) {
    double b = x > OM_LAW_LOG_FLOOR ? x : OM_LAW_LOG_FLOOR, l = log(b);
    OmJet y = {c / 2 * l * l, c * l / b, c * (1 - l) / (b * b)};
    return x < OM_LAW_LOG_FLOOR ? continued(y, x, OM_LAW_LOG_FLOOR) : y;
}

bool om__law_is_split(const OmLawParam* law) {
    return law->law != OM_COROTATIONAL && law->law != OM_LINEAR &&
           law->law != OM_ST_VENANT_KIRCHHOFF;
}

OmJet om__law_volume(const OmLawParam* law, double J) {
    OmJet log = jet_log(J);
    double K = law->bulk;
    if (law->law == OM_NEO_HOOKEAN) return jet_log_square(law->lambda, J);
    if (law->law == OM_STABLE_NEO_HOOKEAN) return jet_square(law->lambda + law->mu, J);
    switch (law->volumetric) {
    case OM_VOLUME_LOG: return jet_log_square(K, J);
    case OM_VOLUME_MIXED:
        return (OmJet){K / 4 * (J * J - 1 - 2 * log.f), K / 2 * (J - log.d), K / 2 * (1 - log.dd)};
    default: return jet_square(K, J);
    }
}

bool om__law_is_neo(const OmLawParam* law) {
    return law->law == OM_NEO_HOOKEAN || law->law == OM_STABLE_NEO_HOOKEAN;
}

OmJet om__law_neo_volume(const OmLawParam* law, double J) {
    OmJet U = om__law_volume(law, J);
    OmJet one = law->law == OM_NEO_HOOKEAN ? jet_log(J) : (OmJet){J - 1, 1, 0};
    return (OmJet){U.f - law->mu * one.f, U.d - law->mu * one.d, U.dd - law->mu * one.dd};
}

// ---- matrices ---------------------------------------------------------------------------------------

double om__law_det(const double F[9], double C[9]) {
    OmVec3 x = {F[0], F[1], F[2]}, y = {F[3], F[4], F[5]}, z = {F[6], F[7], F[8]};
    om_store3(C, 0, om_cross(y, z));
    om_store3(C, 1, om_cross(z, x));
    om_store3(C, 2, om_cross(x, y));
    return F[0] * C[0] + F[1] * C[1] + F[2] * C[2];
}

// d2J/dF_rc dF_sd = eps_rsk eps_cdl F_kl
void om__law_add_det2(const double F[9], double h, double H[81]) {
    for (int c = 0; c < 3; ++c) {
        for (int r = 0; r < 3; ++r) {
            int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
            double* row = H + 9 * (3 * c + r);
            row[3 * c1 + r1] += h * F[3 * c2 + r2];
            row[3 * c2 + r2] += h * F[3 * c1 + r1];
            row[3 * c2 + r1] -= h * F[3 * c1 + r2];
            row[3 * c1 + r2] -= h * F[3 * c2 + r1];
        }
    }
}

static void add_outer(double h, const double a[9], const double b[9], double H[81]) {
    for (int i = 0; i < 9; ++i)
        for (int j = 0; j < 9; ++j) H[9 * i + j] += h * a[i] * b[j];
}

// A^T B and A B^T
static void multiply_left(const double A[9], const double B[9], double out[9]) {
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
            out[3 * c + r] =
                A[3 * r] * B[3 * c] + A[3 * r + 1] * B[3 * c + 1] + A[3 * r + 2] * B[3 * c + 2];
}
static void multiply_right(const double A[9], const double B[9], double out[9]) {
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
            out[3 * c + r] = A[r] * B[c] + A[3 + r] * B[3 + c] + A[6 + r] * B[6 + c];
}

// ---- sums of terms ----------------------------------------------------------------------------------

typedef struct Sums {
    const double* F;
    OmLawOrder order;
    double J, C[9];
    double b[9];     // sum c q' dA
    double hJ, hJJ;  // factors of C and of C C^T
    OmLawValue* out;
} Sums;

static void add_volume(Sums* s, OmJet h) {
    s->out->W += h.f;
    s->hJ += h.d;
    s->hJJ += h.dd;
}

// c A q(J) without c q d2A, which the caller adds.
static void add_term(Sums* s, double c, double A, const double dA[9], OmJet q) {
    s->out->W += c * A * q.f;
    s->hJ += c * A * q.d;
    s->hJJ += c * A * q.dd;
    for (int i = 0; i < 9; ++i) {
        s->out->P[i] += c * q.f * dA[i];
        s->b[i] += c * q.d * dA[i];
    }
}

static void finish(Sums* s) {
    double *P = s->out->P, *H = s->out->H;
    for (int i = 0; i < 9; ++i) P[i] += s->hJ * s->C[i];
    if (s->order < OM_LAW_TANGENT) return;
    for (int i = 0; i < 9; ++i)
        for (int j = 0; j < 9; ++j)
            H[9 * i + j] += s->b[i] * s->C[j] + s->C[i] * s->b[j] + s->hJJ * s->C[i] * s->C[j];
    om__law_add_det2(s->F, s->hJ, H);
}

static const OmJet one = {1, 0, 0};

// c (I1 q(J) - 3): the constant is exact where q is 1.
static void add_I1(Sums* s, double c, OmJet q) {
    const double* F = s->F;
    double I1 = 0, dA[9];
    for (int i = 0; i < 9; ++i) {
        I1 += F[i] * F[i];
        dA[i] = 2 * F[i];
    }
    add_term(s, c, I1, dA, q);
    s->out->W -= 3 * c;
    for (int i = 0; i < 9 && s->order == OM_LAW_TANGENT; ++i) s->out->H[10 * i] += 2 * c * q.f;
}

// c (I2 q(J) - 3)
static void add_I2(Sums* s, double c, OmJet q) {
    const double* F = s->F;
    double I1 = 0, FtF[9], FFt[9], FFtF[9], square = 0, dA[9];
    multiply_left(F, F, FtF);
    multiply_right(F, F, FFt);
    multiply_left(FFt, F, FFtF);  // F F^T is symmetric
    for (int i = 0; i < 9; ++i) {
        I1 += F[i] * F[i];
        square += FtF[i] * FtF[i];
    }
    for (int i = 0; i < 9; ++i) dA[i] = 2 * (I1 * F[i] - FFtF[i]);
    add_term(s, c, 0.5 * (I1 * I1 - square), dA, q);
    s->out->W -= 3 * c;
    if (s->order < OM_LAW_TANGENT) return;
    double* H = s->out->H;
    for (int col = 0; col < 3; ++col) {
        for (int r = 0; r < 3; ++r) {
            for (int d = 0; d < 3; ++d) {
                for (int t = 0; t < 3; ++t) {
                    double v =
                        4 * F[3 * col + r] * F[3 * d + t] - 2 * F[3 * d + r] * F[3 * col + t];
                    if (r == t) v -= 2 * FtF[3 * col + d];
                    if (col == d) v -= 2 * FFt[3 * t + r];
                    if (r == t && col == d) v += 2 * I1;
                    H[9 * (3 * col + r) + 3 * d + t] += c * q.f * v;
                }
            }
        }
    }
}

// ---- functions of stretches -------------------------------------------------------------------------

typedef struct Frame {  // F = sum l_k u_k v_k^T, l[2] with the sign of det F
    double l[3];
    OmVec3 u[3], v[3];
} Frame;

static Frame frame_of(const double F[9]) {
    OmMat3 m = {{F[0], F[1], F[2]}, {F[3], F[4], F[5]}, {F[6], F[7], F[8]}}, U, V;
    OmVec3 l;
    om_mat3_svd(m, &U, &l, &V);
    return (Frame){{l.x, l.y, l.z}, {U.cx, U.cy, U.cz}, {V.cx, V.cy, V.cz}};
}

static void dyad(const Frame* f, int i, int j, double D[9]) {
    om_store3(D, 0, om_scale(f->v[j].x, f->u[i]));
    om_store3(D, 1, om_scale(f->v[j].y, f->u[i]));
    om_store3(D, 2, om_scale(f->v[j].z, f->u[i]));
}

// Symmetric (sign 1) or skew (-1) unit matrix of a pair.
static void pair_dyad(const Frame* f, int i, int j, double sign, double D[9]) {
    double a[9], b[9];
    dyad(f, i, j, a);
    dyad(f, j, i, b);
    for (int k = 0; k < 9; ++k) D[k] = sqrt(0.5) * (a[k] + sign * b[k]);
}

// c q(J) sum p(l_k), p given as jets at the stretches; less `constant`.
static void add_stretches(Sums* s, double c, const Frame* f, const OmJet p[3], OmJet q) {
    double dA[9] = {0}, D[9], A = 0;
    for (int k = 0; k < 3; ++k) {
        A += p[k].f;
        dyad(f, k, k, D);
        for (int i = 0; i < 9; ++i) dA[i] += p[k].d * D[i];
        if (s->order == OM_LAW_TANGENT) add_outer(c * q.f * p[k].dd, D, D, s->out->H);
    }
    add_term(s, c, A, dA, q);
    if (s->order < OM_LAW_TANGENT) return;
    for (int i = 0; i < 3; ++i) {
        int j = (i + 1) % 3;
        double li = f->l[i], lj = f->l[j], size = fabs(li) + fabs(lj), sum = li + lj;
        bool is_equal = fabs(li - lj) <= EQUAL_STRETCH * size;
        double flip = is_equal ? 0.5 * (p[i].dd + p[j].dd) : (p[i].d - p[j].d) / (li - lj);
        // order of the stretches: |sum| is the difference of two lengths where F is inverted
        double min = fmax(size, 1.0) / MAX_CURVATURE;
        double twist = (p[i].d + p[j].d) / (fabs(sum) > min ? sum : sum < 0 ? -min : min);
        pair_dyad(f, i, j, 1, D);
        add_outer(c * q.f * flip, D, D, s->out->H);
        pair_dyad(f, i, j, -1, D);
        add_outer(c * q.f * twist, D, D, s->out->H);
    }
}

static void add_ogden(Sums* s, const OmLawParam* law, bool is_isochoric) {
    Frame f = frame_of(s->F);
    for (int t = 0; t < law->nterm; ++t) {
        OmJet p[3], q = one;
        for (int k = 0; k < 3; ++k) p[k] = jet_power(f.l[k], law->alpha[t]);
        if (is_isochoric) q = jet_factor(s->J, -law->alpha[t] / 3);
        add_stretches(s, law->a[t], &f, p, q);
        s->out->W -= 3 * law->a[t];
    }
}

// mu |S - I|^2 + lambda/2 (tr S - 3)^2
static void add_corotational(Sums* s, const OmLawParam* law) {
    Frame f = frame_of(s->F);
    double trace = f.l[0] + f.l[1] + f.l[2] - 3, R[9] = {0}, D[9];
    OmJet p[3];
    for (int k = 0; k < 3; ++k) {
        double e = f.l[k] - 1;
        // sum of mu e^2 + lambda trace e: gradient and curvature at fixed trace
        p[k] = (OmJet){law->mu * e * e, 2 * law->mu * e + law->lambda * trace, 2 * law->mu};
        dyad(&f, k, k, D);
        for (int i = 0; i < 9; ++i) R[i] += D[i];
    }
    add_stretches(s, 1, &f, p, one);
    s->out->W += law->lambda / 2 * trace * trace;
    if (s->order == OM_LAW_TANGENT) add_outer(law->lambda, R, R, s->out->H);
}

// ---- laws of strain ---------------------------------------------------------------------------------

static void add_svk(Sums* s, const OmLawParam* law) {
    const double* F = s->F;
    double E[9], S[9], trace = 0, square = 0;
    multiply_left(F, F, E);
    for (int i = 0; i < 9; ++i) {
        E[i] = 0.5 * (E[i] - (i % 4 == 0 ? 1 : 0));
        square += E[i] * E[i];
    }
    trace = E[0] + E[4] + E[8];
    for (int i = 0; i < 9; ++i) S[i] = 2 * law->mu * E[i] + (i % 4 == 0 ? law->lambda * trace : 0);
    s->out->W += law->lambda / 2 * trace * trace + law->mu * square;
    double FS[9], St[9] = {S[0], S[3], S[6], S[1], S[4], S[7], S[2], S[5], S[8]};
    multiply_right(F, St, FS);
    for (int i = 0; i < 9; ++i) s->out->P[i] += FS[i];
    if (s->order < OM_LAW_TANGENT) return;
    // dP = dF S + F (lambda tr(dE) I + mu (dF^T F + F^T dF))
    double FFt[9];
    multiply_right(F, F, FFt);
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
            for (int d = 0; d < 3; ++d)
                for (int t = 0; t < 3; ++t) {
                    double v = law->lambda * F[3 * c + r] * F[3 * d + t] +
                               law->mu * F[3 * d + r] * F[3 * c + t];
                    if (r == t) v += S[3 * c + d];
                    if (c == d) v += law->mu * FFt[3 * t + r];
                    s->out->H[9 * (3 * c + r) + 3 * d + t] += v;
                }
}

static void add_linear(Sums* s, const OmLawParam* law) {
    const double* F = s->F;
    double trace = F[0] + F[4] + F[8] - 3;
    s->out->W += law->lambda / 2 * trace * trace;
    for (int c = 0; c < 3; ++c) {
        for (int r = 0; r < 3; ++r) {
            int i = 3 * c + r, j = 3 * r + c;
            double e = 0.5 * (F[i] + F[j]) - (r == c ? 1 : 0);
            s->out->W += law->mu * e * e;
            s->out->P[i] += 2 * law->mu * e + (r == c ? law->lambda * trace : 0);
            if (s->order < OM_LAW_TANGENT) continue;
            s->out->H[9 * i + i] += law->mu;
            s->out->H[9 * i + j] += law->mu;
            for (int k = 0; k < 9 && r == c; k += 4) s->out->H[9 * i + k] += law->lambda;
        }
    }
}

// ---- all laws ---------------------------------------------------------------------------------------

void om__law_eval(const OmLawParam* law, const double F[9], OmLawPart part, OmLawOrder order,
                  OmLawValue* out) {
    Sums s = {.F = F, .order = order, .out = out};
    out->W = 0;
    memset(out->P, 0, sizeof out->P);
    if (order == OM_LAW_TANGENT) memset(out->H, 0, sizeof out->H);
    s.J = om__law_det(F, s.C);
    OmJet log = jet_log(s.J);
    double mu = law->mu;
    switch (law->law) {
    case OM_LINEAR: add_linear(&s, law); break;
    case OM_ST_VENANT_KIRCHHOFF: add_svk(&s, law); break;
    case OM_NEO_HOOKEAN:
        add_I1(&s, mu / 2, one);
        add_volume(&s, (OmJet){-mu * log.f, -mu * log.d, -mu * log.dd});
        break;
    case OM_STABLE_NEO_HOOKEAN:
        add_I1(&s, mu / 2, one);
        add_volume(&s, (OmJet){-mu * (s.J - 1), -mu, 0});
        break;
    case OM_MOONEY_RIVLIN:
        add_I1(&s, law->c10, jet_power(s.J, -2.0 / 3));
        if (law->c01 > 0) add_I2(&s, law->c01, jet_power(s.J, -4.0 / 3));
        break;
    case OM_OGDEN: add_ogden(&s, law, true); break;
    case OM_OGDEN_COUPLED:
        add_ogden(&s, law, false);
        for (int p = 0; p < law->nterm; ++p) {
            double m = law->a[p] * law->alpha[p];
            add_volume(&s, (OmJet){-m * log.f, -m * log.d, -m * log.dd});
        }
        break;
    default: add_corotational(&s, law);
    }
    if (part == OM_LAW_WHOLE && om__law_is_split(law)) add_volume(&s, om__law_volume(law, s.J));
    if (order >= OM_LAW_STRESS) finish(&s);
}

// ---- projection -------------------------------------------------------------------------------------

// H += change of the eigenvalue of the unit matrix D.
static void raise(double eigenvalue, const double D[9], double H[81]) {
    if (eigenvalue < 0) add_outer(-eigenvalue, D, D, H);
}

static double form(const double a[9], const double H[81], const double b[9]) {
    double sum = 0;
    for (int i = 0; i < 9; ++i) {
        double h = 0;
        for (int j = 0; j < 9; ++j) h += H[9 * i + j] * b[j];
        sum += a[i] * h;
    }
    return sum;
}

void om__law_project(const double F[9], double H[81]) {
    Frame f = frame_of(F);
    double D[3][9], E[9], B[3][3], was[81];
    memcpy(was, H, sizeof was);
    // stretches
    for (int k = 0; k < 3; ++k) dyad(&f, k, k, D[k]);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) B[i][j] = form(D[i], was, D[j]);
    OmMat3 m = {
        {B[0][0], B[0][1], B[0][2]}, {B[0][1], B[1][1], B[1][2]}, {B[0][2], B[1][2], B[2][2]}};
    OmVec3 w, *col;
    OmMat3 V;
    om_mat3_eigen_symmetric(m, &w, &V);
    const double value[3] = {w.x, w.y, w.z};
    for (int k = 0; k < 3; ++k) {
        col = k == 0 ? &V.cx : k == 1 ? &V.cy : &V.cz;
        for (int i = 0; i < 9; ++i) E[i] = col->x * D[0][i] + col->y * D[1][i] + col->z * D[2][i];
        raise(value[k], E, H);
    }
    // pairs: the symmetric and skew matrices are eigenvectors of an isotropic law
    for (int i = 0; i < 3; ++i) {
        for (int sign = -1; sign <= 1; sign += 2) {
            pair_dyad(&f, i, (i + 1) % 3, sign, E);
            raise(form(E, was, E), E, H);
        }
    }
}
