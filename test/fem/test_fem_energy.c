// test_fem_energy.c: corotational elements at one state: forces are slopes of the energy, rigid motion costs
// nothing, rotations are the nearest ones, the matrix of a step is the slope of the forces.
#include "test_random.h"
#include "test_rig.h"

#include "fem/fem_internal.h"

static const OmVec3 lo = {0, 0, 0}, hi = {0.03, 0.02, 0.02};

static double distance(OmMat3 a, OmMat3 b) {
    return om_mat3_norm(om_mat3_add(a, om_mat3_scale(-1, b)));
}

// Places that are far from rest, with elements turned, stretched and squeezed by tens of per cent.
static double* deformed(const TestRig* r) {
    double* x = om_alloc(3 * (size_t)r->mesh.nvert, sizeof *x);
    OmMat3 F = {{0.4, 0.9, 0.1}, {-1.0, 0.5, 0.2}, {0.1, -0.2, 1.2}};
    for (int i = 0; i < r->mesh.nvert; ++i)
        om_store3(x, i, om_mat3_apply(F, om_load3(r->mesh.x, i)));
    rig_shake(&r->mesh, NULL, 0.0015, x);
    return x;
}

// f = -dE/dx by central differences. The energy is about 1e-4 J and sums of rounding 1e-16 of it; with
// steps of 1e-7 m these leave 1e-13 N, the third derivative leaves about 1e-8 of the force.
static void test_force_is_slope(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, lo, hi, 3, 2, 2);
    OmMaterial material[2] = {{.young = 3000, .poisson = 0.45}, {.young = 9000, .poisson = 0.1}};
    r.def.nmaterial = 2;
    r.def.material = material;
    for (int e = 0; e < r.mesh.ntet; ++e) r.mesh.tet_label[e] = e % 3 == 0;
    r.def.gravity = om_vec3(0, 0, 0);
    rig_start(&r);
    double* x = deformed(&r);
    double* f = om_calloc(3 * (size_t)r.mesh.nvert, sizeof *f);
    assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
    assert_ok(om_tissue_get_internal_force(r.m, r.s, f));
    double largest = 0, step = 1e-7;
    for (int n = 0; n < 3 * r.mesh.nvert; ++n) largest = fmax(largest, fabs(f[n]));
    for (int n = 0; n < 3 * r.mesh.nvert; ++n) {
        OmTissueEnergy above, below;
        double place = x[n];
        x[n] = place + step;
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        assert_ok(om_tissue_get_energy(r.m, r.s, &above));
        x[n] = place - step;
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        assert_ok(om_tissue_get_energy(r.m, r.s, &below));
        x[n] = place;
        assert_near(f[n], -(above.elastic - below.elastic) / (2 * step), 1e-7 * largest);
    }
    om_free(x);
    om_free(f);
    rig_done(&r);
}

// Turned and moved as a whole: no energy, no force, no stress, in double and in the float of a step.
static void test_rigid_motion(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, lo, hi, 3, 2, 2);
    r.def.gravity = om_vec3(0, 0, 0);
    rig_start(&r);
    size_t n = 3 * (size_t)r.mesh.nvert;
    double *x = om_alloc(n, sizeof *x), *f = om_alloc(n, sizeof *f);
    double* stress = om_alloc((size_t)r.mesh.ntet, sizeof *stress);
    OmRng rng = om_rng_init(3, 0);
    for (int trial = 0; trial < 20; ++trial) {
        OmMat3 R = random_rotation(&rng);
        for (int i = 0; i < r.mesh.nvert; ++i)
            om_store3(x, i,
                      om_add(om_vec3(0.3, -0.2, 0.1), om_mat3_apply(R, om_load3(r.mesh.x, i))));
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        OmTissueEnergy energy;
        assert_ok(om_tissue_get_energy(r.m, r.s, &energy));
        assert_near(energy.elastic, 0, 1e-20);
        assert_ok(om_tissue_get_internal_force(r.m, r.s, f));
        assert_ok(om_tissue_get_measure(r.m, r.s, OM_VON_MISES, stress));
        // strains are 1e-14 at x of 0.3 m and edges of 10 mm; area 1e-4 m^2, stiffness 1e4 Pa
        for (size_t k = 0; k < n; ++k) assert_near(f[k], 0, 1e-13);
        for (int e = 0; e < r.mesh.ntet; ++e) assert_near(stress[e], 0, 1e-9);
        assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, NULL));
        // float strains are 1e-7: 1e-7 of 1e4 Pa on 1e-4 m^2 moves 1e-6 kg by 4e-8 m at most
        for (size_t k = 0; k < n; ++k) assert_near(om_tissue_x(r.s)[k], x[k], 4e-8);
    }
    om_free(x);
    om_free(f);
    om_free(stress);
    rig_done(&r);
}

// Forces of an isolated body sum to zero and have no moment, whatever its shape.
static void test_no_resultant(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, lo, hi, 3, 2, 2);
    rig_start(&r);
    double* x = deformed(&r);
    double* f = om_alloc(3 * (size_t)r.mesh.nvert, sizeof *f);
    assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
    assert_ok(om_tissue_get_internal_force(r.m, r.s, f));
    OmVec3 sum = {0, 0, 0}, moment = {0, 0, 0};
    double size = 0;
    for (int i = 0; i < r.mesh.nvert; ++i) {
        sum = om_add(sum, om_load3(f, i));
        moment = om_add(moment, om_cross(om_load3(x, i), om_load3(f, i)));
        size += om_norm(om_load3(f, i));
    }
    assert_near(om_norm(sum), 0, 1e-14 * size);
    assert_near(om_norm(moment), 0, 1e-14 * size * om_norm(hi));
    om_free(x);
    om_free(f);
    rig_done(&r);
}

// R of the invariants against R of the SVD; both for F = R S with det S of either sign.
static void test_nearest_rotation(void** context) {
    (void)context;
    OmRng rng = om_rng_init(5, 0);
    for (int trial = 0; trial < 2000; ++trial) {
        OmMat3 F = trial % 2 ? random_mat3(&rng, 1)
                             : om_mat3_add(random_rotation(&rng), random_mat3(&rng, 0.2));
        OmMat3 u, v, R = om__fem_rotation(F);
        OmVec3 s;
        om_mat3_svd(F, &u, &s, &v);
        assert_near(om_mat3_det(R), 1, 1e-9);
        assert_near(distance(om_mat3_mul(om_mat3_transpose(R), R), om_mat3_identity()), 0, 1e-9);
        // tr(R^T F) is the largest there is: s1 + s2 + sign(det F) s3
        double best = s.x + s.y + (om_mat3_det(F) < 0 ? -1 : 1) * fabs(s.z);
        assert_near_rel(om_mat3_trace(om_mat3_mul(om_mat3_transpose(R), F)), best, 1e-9);
    }
    // where it is not unique: still some rotation
    const OmMat3 odd[] = {om_mat3_diag(om_vec3(0, 0, 0)),      om_mat3_diag(om_vec3(-1, -1, -1)),
                          om_mat3_diag(om_vec3(1, 0, 0)),      om_mat3_diag(om_vec3(1, 1, -1)),
                          om_mat3_diag(om_vec3(1e-200, 0, 0)), om_mat3_diag(om_vec3(1e100, 1, 0))};
    for (size_t k = 0; k < sizeof odd / sizeof *odd; ++k) {
        OmMat3 R = om__fem_rotation(odd[k]);
        assert_near(distance(om_mat3_mul(om_mat3_transpose(R), R), om_mat3_identity()), 0, 1e-9);
        assert_near(om_mat3_det(R), 1, 1e-9);
    }
}

// At rest A = (1 + h a) M + (h^2 + h b) K with K = -df/dx; forces by differences in double, A in float.
static void test_matrix_is_slope(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, lo, hi, 3, 2, 2);
    r.def.rayleigh_mass = 2;
    r.def.rayleigh_stiffness = 0.03;
    rig_start(&r);
    size_t n = 3 * (size_t)r.mesh.nvert;
    double *x = om_alloc(n, sizeof *x), *d = om_calloc(n, sizeof *d), *y = om_alloc(n, sizeof *y);
    double *fa = om_alloc(n, sizeof *fa), *fb = om_alloc(n, sizeof *fb);
    double h = 0.02, step = 1e-8;
    rig_shake(&r.mesh, NULL, 1, d);
    assert_ok(om_tissue_begin_step(r.m, r.s, r.w, h));
    assert_ok(om_tissue_apply(r.m, r.w, 1, d, y));
    for (size_t k = 0; k < n; ++k) x[k] = r.mesh.x[k] + step * d[k];
    assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
    assert_ok(om_tissue_get_internal_force(r.m, r.s, fa));
    for (size_t k = 0; k < n; ++k) x[k] = r.mesh.x[k] - step * d[k];
    assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
    assert_ok(om_tissue_get_internal_force(r.m, r.s, fb));
    double largest = 0;
    for (size_t k = 0; k < n; ++k) largest = fmax(largest, fabs(y[k]));
    for (size_t k = 0; k < n; ++k) {
        double Kd = -(fa[k] - fb[k]) / (2 * step);
        double expected = (1 + h * 2) * om_tissue_mass(r.m)[k / 3] * d[k] + (h * h + h * 0.03) * Kd;
        assert_near(y[k], expected, 2e-6 * largest);  // floats: 6e-8 a term, some tens of them
    }
    om_free(x);
    om_free(d);
    om_free(y);
    om_free(fa);
    om_free(fb);
    rig_done(&r);
}

// Measures of a homogeneous stretch along x by 1.1, nu = 0: stress E e, energy E e^2 / 2.
static void test_measures(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, lo, hi, 3, 2, 2);
    r.def.material_default.poisson = 0;
    rig_start(&r);
    double* x = om_alloc(3 * (size_t)r.mesh.nvert, sizeof *x);
    double* value = om_alloc((size_t)r.mesh.ntet, sizeof *value);
    memcpy(x, r.mesh.x, 3 * (size_t)r.mesh.nvert * sizeof *x);
    for (int i = 0; i < r.mesh.nvert; ++i) x[3 * i] *= 1.1;
    assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
    const double expected[] = {300, 1.1, 0.1, 1.1, 0.5 * 3000 * 0.01};
    for (int k = OM_VON_MISES; k <= OM_ENERGY_DENSITY; ++k) {
        assert_ok(om_tissue_get_measure(r.m, r.s, (OmTissueMeasure)k, value));
        for (int e = 0; e < r.mesh.ntet; ++e) assert_near_rel(value[e], expected[k], 1e-9);
    }
    assert_status(om_tissue_get_measure(r.m, r.s, (OmTissueMeasure)99, value), OM_INVALID);
    om_free(x);
    om_free(value);
    rig_done(&r);
}

// Stretched by 1.2 along x and held across it, neo-Hookean tissue has Cauchy stresses mu / J (b - 1) beside a pressure:
// von Mises' stress is mu / 1.2 (1.44 - 1), the largest strain 0.2.
static void test_true_stress(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, lo, hi, 3, 2, 2);
    r.def.material_default = (OmMaterial){.law = OM_NEO_HOOKEAN, .young = 3900, .poisson = 0.3};
    rig_start(&r);
    double* x = om_alloc(3 * (size_t)r.mesh.nvert, sizeof *x);
    double* value = om_alloc((size_t)r.mesh.ntet, sizeof *value);
    memcpy(x, r.mesh.x, 3 * (size_t)r.mesh.nvert * sizeof *x);
    for (int i = 0; i < r.mesh.nvert; ++i) x[3 * i] *= 1.2;
    assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
    double mu = 1500, lambda = 2250, log_J = log(1.2);
    const double expected[] = {mu / 1.2 * 0.44, 1.2, 0.2, 1.2,
                               mu / 2 * 0.44 - mu * log_J + lambda / 2 * log_J * log_J};
    for (int k = OM_VON_MISES; k <= OM_ENERGY_DENSITY; ++k) {
        assert_ok(om_tissue_get_measure(r.m, r.s, (OmTissueMeasure)k, value));
        for (int e = 0; e < r.mesh.ntet; ++e) assert_near_rel(value[e], expected[k], 1e-9);
    }
    om_free(x);
    om_free(value);
    rig_done(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_force_is_slope),  cmocka_unit_test(test_rigid_motion),
        cmocka_unit_test(test_no_resultant),    cmocka_unit_test(test_nearest_rotation),
        cmocka_unit_test(test_matrix_is_slope), cmocka_unit_test(test_measures),
        cmocka_unit_test(test_true_stress),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
