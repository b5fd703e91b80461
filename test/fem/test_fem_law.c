// test_fem_law.c: every law against differences of its energy, symmetry, and closed forms.
#include "test_common.h"
#include "test_materials.h"

#include "fem/fem_law.h"
#include "fem/fem_principal.h"

#define KAPPA 10000.0

// Ordinary, strong, nearly flat and inverted.
static void random_F(OmRng* rng, int kind, double F[9]) {
    double spread = kind == 0 ? 0.2 : 0.6;
    for (int i = 0; i < 9; ++i) F[i] = (i % 4 == 0) + spread * om_rng_range(rng, -1, 1);
    double squeeze = kind == 2 ? 0.03 : kind == 3 ? -0.6 : 1;
    for (int r = 0; r < 3; ++r) F[3 + r] *= squeeze;
}

static double largest(const double* a, int n) {
    double max = 0;
    for (int i = 0; i < n; ++i) max = fmax(max, fabs(a[i]));
    return max;
}

// An inverted and drawn out F lies on a crease of laws odd in the stretches: differences across it mean
// nothing.
static bool is_near_crease(const OmMaterial* m, const double F[9]) {
    bool is_odd = m->law == OM_COROTATIONAL || m->law == OM_OGDEN || m->law == OM_OGDEN_COUPLED;
    OmMat3 f = {{F[0], F[1], F[2]}, {F[3], F[4], F[5]}, {F[6], F[7], F[8]}}, u, v;
    OmVec3 s;
    om_mat3_svd(f, &u, &s, &v);
    return is_odd && s.y + s.z < 0.05;
}

static void test_differences(void** context) {
    (void)context;
    OmRng rng = om_rng_init(3, 1);
    double worst_stress = 0, worst_tangent = 0;
    for (int n = 0; n < 400 * NLAW; ++n) {
        const OmMaterial* m = &every_law[n % NLAW];
        OmLawParam law;
        OmLawValue at, hi, lo;
        double F[9], h = 3e-6;
        assert_ok(om_material_validate(m, "material"));
        om__law_init(m, &law);
        random_F(&rng, n / NLAW % 4, F);
        if (is_near_crease(m, F)) continue;
        om__law_eval(&law, F, OM_LAW_WHOLE, OM_LAW_TANGENT, &at);
        double stress = fmax(largest(at.P, 9), 1), tangent = largest(at.H, 81);
        for (int i = 0; i < 9; ++i) {
            double was = F[i];
            F[i] = was + h;
            om__law_eval(&law, F, OM_LAW_WHOLE, OM_LAW_STRESS, &hi);
            F[i] = was - h;
            om__law_eval(&law, F, OM_LAW_WHOLE, OM_LAW_STRESS, &lo);
            F[i] = was;
            double dW = (hi.W - lo.W) / (2 * h);
            worst_stress = fmax(worst_stress, fabs(dW - at.P[i]) / (stress + tangent * 1e-2));
            for (int j = 0; j < 9; ++j) {
                double dP = (hi.P[j] - lo.P[j]) / (2 * h);
                worst_tangent = fmax(worst_tangent, fabs(dP - at.H[9 * i + j]) / tangent);
                assert_near(at.H[9 * i + j], at.H[9 * j + i], 1e-10 * tangent);
            }
        }
    }
    printf("laws: P within %.2g of dW/dF, H within %.2g of dP/dF\n", worst_stress, worst_tangent);
    // h^2 of the third derivative (1 / l^3 at the floor of 0.1), rounding 1e-16 / h
    assert_below(worst_stress, 1e-6);
    assert_below(worst_tangent, 1e-6);
}

// Two derivatives are the same from both sides of either floor.
static void check_floor(const OmMaterial* m, double floor) {
    OmLawParam law;
    OmLawValue a, b;
    om__law_init(m, &law);
    double F[9] = {1, 0, 0, 0, 1, 0, 0, 0, floor * (1 + 1e-9)};
    om__law_eval(&law, F, OM_LAW_WHOLE, OM_LAW_TANGENT, &a);
    F[8] = floor * (1 - 1e-9);
    om__law_eval(&law, F, OM_LAW_WHOLE, OM_LAW_TANGENT, &b);
    double size = largest(a.H, 81);
    for (int i = 0; i < 81; ++i) assert_near(a.H[i], b.H[i], 1e-7 * size);
    assert_near(a.W, b.W, 1e-8 * size);
}

static void test_floor(void** context) {
    (void)context;
    for (int n = 0; n < NLAW; ++n) {
        check_floor(&every_law[n], OM_LAW_POWER_FLOOR);
        check_floor(&every_law[n], OM_LAW_LOG_FLOOR);
    }
}

// The header's formula holds down to its floor, not below; its limits of constants are those of the check.
static void test_documented_limits(void** context) {
    (void)context;
    OmMaterial m = {.young = 3000, .poisson = 0.45, .law = OM_NEO_HOOKEAN};
    OmLawParam law;
    double lambda, mu, bulk;
    om__law_init(&m, &law);
    om_material_lame(&m, &lambda, &mu, &bulk);
    for (int below = 0; below < 2; ++below) {
        double J = OM_LAW_LOG_FLOOR * (below ? 0.8 : 1.001), l = log(J);
        double F[9] = {1, 0, 0, 0, 1, 0, 0, 0, J};
        OmLawValue at;
        om__law_eval(&law, F, OM_LAW_WHOLE, OM_LAW_STRESS, &at);
        double W = mu / 2 * (2 + J * J - 3) - mu * l + lambda / 2 * l * l;
        assert_true((fabs(at.W - W) < 1e-12 * W) == !below);
    }
    const struct {
        double young, poisson;
        OmStatus status;
    } one[] = {{3000, 0, OM_OK},        {3000, OM_MAX_POISSON, OM_OK},
               {1e12, 0.3, OM_OK},      {3000, OM_MAX_POISSON + 1e-9, OM_INVALID},
               {3000, 0.5, OM_INVALID}, {3000, -1e-9, OM_INVALID},
               {0, 0.3, OM_INVALID},    {1.001e12, 0.3, OM_INVALID}};
    for (int k = 0; k < 8; ++k) {
        m.young = one[k].young;
        m.poisson = one[k].poisson;
        assert_status(om_material_validate(&m, "material"), one[k].status);
    }
}

static void test_extremes(void** context) {
    (void)context;
    const double scale[] = {0, 1e-8, -1, -5, 30};
    for (int n = 0; n < NLAW * 5; ++n) {
        OmLawParam law;
        OmLawValue a;
        double F[9] = {scale[n % 5], 0, 0, 0, 1, 0, 0, 0, scale[n % 5]};
        om__law_init(&every_law[n / 5], &law);
        om__law_eval(&law, F, OM_LAW_WHOLE, OM_LAW_TANGENT, &a);
        assert_true(isfinite(a.W) && isfinite(largest(a.P, 9)) && isfinite(largest(a.H, 81)));
        for (int i = 0; i < 81; ++i) assert_true(isfinite(a.H[i]));
    }
}

// At rest: no energy, no stress, and the tangent of linear elasticity.
static void test_rest(void** context) {
    (void)context;
    for (int n = 0; n < NLAW; ++n) {
        OmLawParam law, linear;
        OmLawValue a, b;
        double lambda, mu, bulk;
        om__law_init(&every_law[n], &law);
        om_material_lame(&every_law[n], &lambda, &mu, &bulk);
        linear = (OmLawParam){.law = OM_LINEAR, .lambda = lambda, .mu = mu};
        const double I[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
        om__law_eval(&law, I, OM_LAW_WHOLE, OM_LAW_TANGENT, &a);
        om__law_eval(&linear, I, OM_LAW_WHOLE, OM_LAW_TANGENT, &b);
        assert_near(a.W, 0, 1e-12 * bulk);
        for (int i = 0; i < 9; ++i) assert_near(a.P[i], 0, 1e-12 * bulk);
        for (int i = 0; i < 81; ++i) assert_near(a.H[i], b.H[i], 1e-11 * bulk);
    }
}

// W(R F Q) = W(F), and the volumetric term is what the parts differ by.
static void test_invariance(void** context) {
    (void)context;
    OmRng rng = om_rng_init(5, 2);
    for (int n = 0; n < 100 * NLAW; ++n) {
        const OmMaterial* m = &every_law[n % NLAW];
        OmLawParam law;
        OmLawValue a, b, shape;
        double F[9], G[9], C[9];
        om__law_init(m, &law);
        random_F(&rng, 0, F);
        om__law_eval(&law, F, OM_LAW_WHOLE, OM_LAW_STRESS, &a);
        if (om__law_is_split(&law)) {
            double J = om__law_det(F, C);
            OmJet U = om__law_volume(&law, J);
            om__law_eval(&law, F, OM_LAW_SHAPE, OM_LAW_STRESS, &shape);
            assert_near_rel(a.W, shape.W + U.f, 1e-12);
            for (int i = 0; i < 9; ++i) assert_near(a.P[i], shape.P[i] + U.d * C[i], 1e-10 * KAPPA);
        }
        if (m->law == OM_LINEAR) continue;
        OmMat3 f = {{F[0], F[1], F[2]}, {F[3], F[4], F[5]}, {F[6], F[7], F[8]}};
        OmMat3 R = om_quat_to_mat3(om_quat_axis_angle(om_vec3(1, 2, -1), om_rng_range(&rng, 0, 6)));
        OmMat3 Q = om_quat_to_mat3(om_quat_axis_angle(om_vec3(2, 0, 1), om_rng_range(&rng, 0, 6)));
        OmMat3 g = om_mat3_mul(R, om_mat3_mul(f, Q));
        om_store3(G, 0, g.cx), om_store3(G, 1, g.cy), om_store3(G, 2, g.cz);
        om__law_eval(&law, G, OM_LAW_WHOLE, OM_LAW_ENERGY, &b);
        assert_near(a.W, b.W, 1e-12 * (fabs(a.W) + KAPPA));
    }
}

// ---- closed forms -----------------------------------------------------------------------------------

static void eval_diag(const OmMaterial* m, double l1, double l2, double l3, OmLawValue* out) {
    OmLawParam law;
    om__law_init(m, &law);
    double F[9] = {l1, 0, 0, 0, l2, 0, 0, 0, l3};
    om__law_eval(&law, F, OM_LAW_WHOLE, OM_LAW_TANGENT, out);
}

// dW/dl1 at principal stretches, written out by hand from tissue_material.h.
static double stress_by_hand(const OmMaterial* m, double l1, double l2, double l3) {
    double lambda, mu, K, J = l1 * l2 * l3, I1 = l1 * l1 + l2 * l2 + l3 * l3;
    om_material_lame(m, &lambda, &mu, &K);
    double I2 = l1 * l1 * l2 * l2 + l2 * l2 * l3 * l3 + l3 * l3 * l1 * l1;
    double U = 0;
    if (m->law == OM_OGDEN_COUPLED) K = m->bulk;
    if (m->volumetric == OM_VOLUME_LINEAR) U = K * (J - 1);
    if (m->volumetric == OM_VOLUME_LOG) U = K * log(J) / J;
    if (m->volumetric == OM_VOLUME_MIXED) U = K / 2 * (J - 1 / J);
    double tr = l1 + l2 + l3 - 3, E1 = (l1 * l1 - 1) / 2, sum = 0;
    int nterm = m->nterm > 0 ? m->nterm : 1;
    switch (m->law) {
    case OM_COROTATIONAL:
    case OM_LINEAR: return 2 * mu * (l1 - 1) + lambda * tr;
    case OM_ST_VENANT_KIRCHHOFF: return l1 * (2 * mu * E1 + lambda * (I1 - 3) / 2);
    case OM_NEO_HOOKEAN: return mu * l1 - mu / l1 + lambda * log(J) / l1;
    case OM_STABLE_NEO_HOOKEAN: return mu * l1 - mu * l2 * l3 + (lambda + mu) * (J - 1) * l2 * l3;
    case OM_MOONEY_RIVLIN: {
        double c10 = m->c10 + m->c01 > 0 ? m->c10 : mu / 2, c01 = m->c01;
        double dI1 = pow(J, -2.0 / 3) * (2 * l1 - 2.0 / 3 * I1 / l1);
        double dI2 = pow(J, -4.0 / 3) * (2 * l1 * (l2 * l2 + l3 * l3) - 4.0 / 3 * I2 / l1);
        return c10 * dI1 + c01 * dI2 + U * l2 * l3;
    }
    default:
        for (int p = 0; p < nterm; ++p) {
            double a = m->nterm > 0 ? m->ogden_alpha[p] : 2, c = m->nterm > 0 ? m->ogden_mu[p] : mu;
            if (m->law == OM_OGDEN_COUPLED) {
                sum += c * (pow(l1, a) - 1) / l1;
                continue;
            }
            double q = pow(J, -a / 3), mean = (pow(l1, a) + pow(l2, a) + pow(l3, a)) / 3;
            sum += c * q * (pow(l1, a) - mean) / l1;
        }
        return sum + U * l2 * l3;
    }
}

static void test_uniaxial_biaxial(void** context) {
    (void)context;
    for (int n = 0; n < NLAW; ++n) {
        for (double l = 0.6; l < 1.8; l += 0.1) {
            OmLawValue a;
            eval_diag(&every_law[n], l, 0.9, 0.9, &a);  // pulled or pressed along one axis
            assert_near(a.P[0], stress_by_hand(&every_law[n], l, 0.9, 0.9), 1e-10 * KAPPA);
            assert_near(a.P[4], stress_by_hand(&every_law[n], 0.9, l, 0.9), 1e-10 * KAPPA);
            eval_diag(&every_law[n], l, l, 1 / l, &a);  // along two
            assert_near(a.P[0], stress_by_hand(&every_law[n], l, l, 1 / l), 1e-10 * KAPPA);
            assert_near(a.P[8], stress_by_hand(&every_law[n], 1 / l, l, l), 1e-10 * KAPPA);
            for (int i = 0; i < 9; ++i)
                if (i % 4) assert_near(a.P[i], 0, 1e-10 * KAPPA);
        }
    }
}

// Simple shear x += g y: J = 1, and each law's shear stress P_xy has a short form.
static void test_simple_shear(void** context) {
    (void)context;
    for (int n = 0; n < NLAW; ++n) {
        const OmMaterial* m = &every_law[n];
        double lambda, mu, K;
        om_material_lame(m, &lambda, &mu, &K);
        for (double g = -1; g < 1.05; g += 0.25) {
            OmLawParam law;
            OmLawValue a;
            double F[9] = {1, 0, 0, g, 1, 0, 0, 0, 1}, expected = 0;
            om__law_init(m, &law);
            om__law_eval(&law, F, OM_LAW_WHOLE, OM_LAW_STRESS, &a);
            // stretches l, 1 / l with l - 1 / l = g; dl/dg = l / (l + 1 / l)
            double l = 0.5 * (g + sqrt(g * g + 4)), dl = l / (l + 1 / l), sum = l + 1 / l;
            switch (m->law) {
            case OM_COROTATIONAL:
                expected = dl * (2 * mu * (l - 1) - 2 * mu * (1 / l - 1) / (l * l)) +
                           lambda * (sum - 2) * dl * (1 - 1 / (l * l));
                break;
            case OM_LINEAR: expected = mu * g; break;
            case OM_ST_VENANT_KIRCHHOFF:
                expected = mu * g * (1 + g * g) + lambda / 2 * g * g * g;
                break;
            case OM_OGDEN:
            case OM_OGDEN_COUPLED:
                for (int p = 0; p < law.nterm; ++p)
                    expected += dl * law.a[p] * law.alpha[p] *
                                (pow(l, law.alpha[p] - 1) - pow(l, -law.alpha[p] - 1));
                break;
            default: expected = mu * g;  // I1 = I2 = 3 + g^2
            }
            assert_near(a.P[3], expected, 1e-10 * KAPPA);
        }
    }
}

// No F, however inverted, has less energy than rest: there is nowhere to fall without end.
static void test_least_energy(void** context) {
    (void)context;
    OmRng rng = om_rng_init(9, 4);
    for (int k = 0; k < NLAW; ++k) {
        OmLawParam law;
        OmLawValue a;
        double min = INFINITY;
        om__law_init(&every_law[k], &law);
        for (int n = 0; n < 3000; ++n) {
            double F[9], spread = n % 3 == 0 ? 0.3 : n % 3 == 1 ? 1.5 : 6;
            for (int i = 0; i < 9; ++i) F[i] = (i % 4 == 0) + spread * om_rng_range(&rng, -1, 1);
            om__law_eval(&law, F, OM_LAW_WHOLE, OM_LAW_ENERGY, &a);
            min = fmin(min, a.W);
        }
        printf("%s: least energy %.3g J/m^3\n", om_law_name(law.law), min);
        assert_true(min >= -1e-9 * KAPPA);
    }
}

// Projected: no eigenvalue below zero, and unchanged where there was none.
static void test_projection(void** context) {
    (void)context;
    OmRng rng = om_rng_init(8, 4);
    for (int n = 0; n < 200 * NLAW; ++n) {
        OmLawParam law;
        OmLawValue a, b;
        double F[9];
        om__law_init(&every_law[n % NLAW], &law);
        random_F(&rng, n % 4, F);
        om__law_eval(&law, F, OM_LAW_WHOLE, OM_LAW_TANGENT, &a);
        b = a;
        om__law_project(F, b.H);
        double size = largest(a.H, 81), before = INFINITY;
        for (int k = 0; k < 60; ++k) {
            double v[9], form_a = 0, form_b = 0, norm = 0;
            for (int i = 0; i < 9; ++i) v[i] = om_rng_range(&rng, -1, 1), norm += v[i] * v[i];
            for (int i = 0; i < 9; ++i)
                for (int j = 0; j < 9; ++j) {
                    form_a += v[i] * a.H[9 * i + j] * v[j];
                    form_b += v[i] * b.H[9 * i + j] * v[j];
                }
            before = fmin(before, form_a / norm);
            assert_true(form_b >= -1e-10 * size * norm);
            assert_true(form_b >= form_a - 1e-10 * size * norm);
        }
        double change = 0;
        for (int i = 0; i < 81; ++i) change = fmax(change, fabs(a.H[i] - b.H[i]));
        if (before < 0) assert_true(change > 0);
    }
}

// The engine's laws, written in principal stretches, are the same.
static void test_engine_laws(void** context) {
    (void)context;
    OmRng rng = om_rng_init(12, 6);
    double worst = 0;
    for (int n = 0; n < 200 * NLAW; ++n) {
        const OmMaterial* m = &every_law[n % NLAW];
        OmLawParam law;
        OmLawValue a;
        double F[9], energy;
        om__law_init(m, &law);
        random_F(&rng, n / NLAW % 4, F);
        om__law_eval(&law, F, OM_LAW_WHOLE, OM_LAW_STRESS, &a);
        OmMat3 f = {{F[0], F[1], F[2]}, {F[3], F[4], F[5]}, {F[6], F[7], F[8]}};
        OmMat3 P = om__law_stress(m, OM_SHARE_WHOLE, f, &energy);
        double size = fmax(largest(a.P, 9), 1e3);
        for (int c = 0; c < 3; ++c) {
            OmVec3 col = c == 0 ? P.cx : c == 1 ? P.cy : P.cz;
            worst = fmax(worst, om_distance(col, om_load3(a.P, c)) / size);
        }
        worst = fmax(worst, fabs(energy - a.W) / size);
    }
    printf("laws of the engine: within %.2g\n", worst);
    assert_below(worst, 1e-10);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_differences),
        cmocka_unit_test(test_floor),
        cmocka_unit_test(test_documented_limits),
        cmocka_unit_test(test_extremes),
        cmocka_unit_test(test_rest),
        cmocka_unit_test(test_invariance),
        cmocka_unit_test(test_uniaxial_biaxial),
        cmocka_unit_test(test_simple_shear),
        cmocka_unit_test(test_projection),
        cmocka_unit_test(test_engine_laws),
        cmocka_unit_test(test_least_energy),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
