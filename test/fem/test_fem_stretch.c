// test_fem_stretch.c: every law in the engine: forces are slopes of the energy, tangents those of forces, the
// matrix of a step is the projected tangent, rigid motion costs nothing, inverted elements come back.
#include "test_materials.h"
#include "test_random.h"
#include "test_rig.h"

#include "fem/fem_internal.h"
#include "fem/fem_principal.h"

static const OmVec3 lo = {0, 0, 0}, hi = {0.03, 0.02, 0.02};

static double inner(OmMat3 a, OmMat3 b) {
    return om_dot(a.cx, b.cx) + om_dot(a.cy, b.cy) + om_dot(a.cz, b.cz);
}

// dP for dF at F by the principal form.
static OmMat3 tangent(const OmMaterial* m, OmMat3 F, OmMat3 dF, bool is_projected) {
    OmMat3 U, V;
    OmVec3 s;
    OmPrincipal p;
    om_mat3_svd(F, &U, &s, &V);
    const double stretch[3] = {s.x, s.y, s.z};
    om__principal_eval(m, OM_SHARE_WHOLE, stretch, &p);
    if (is_projected) om__principal_project(&p);
    OmMat3 G = om_mat3_mul(om_mat3_transpose(U), om_mat3_mul(dF, V));
    const double g[3][3] = {
        {G.cx.x, G.cy.x, G.cz.x}, {G.cx.y, G.cy.y, G.cz.y}, {G.cx.z, G.cy.z, G.cz.z}};
    double t[3][3];
    for (int i = 0; i < 3; ++i) {
        t[i][i] = p.H[i][0] * g[0][0] + p.H[i][1] * g[1][1] + p.H[i][2] * g[2][2];
        for (int j = 0; j < 3; ++j)
            if (j != i) t[i][j] = p.own[3 - i - j] * g[i][j] + p.cross[3 - i - j] * g[j][i];
    }
    OmMat3 T = om_mat3_cols(om_vec3(t[0][0], t[1][0], t[2][0]), om_vec3(t[0][1], t[1][1], t[2][1]),
                            om_vec3(t[0][2], t[1][2], t[2][2]));
    return om_mat3_mul(U, om_mat3_mul(T, om_mat3_transpose(V)));
}

// Energy, stress and tangent agree at random F: near rotations, far from them, and inverted.
static void test_derivatives(void** context) {
    (void)context;
    OmRng rng = om_rng_init(11, 0);
    for (int k = 0; k < NLAW; ++k) {
        const OmMaterial* m = &every_law[k];
        if (m->law == OM_LINEAR) continue;  // has no principal form
        double worst_stress = 0, worst_tangent = 0;
        for (int trial = 0; trial < 200; ++trial) {
            double size = trial % 3 == 0 ? 0.01 : trial % 3 == 1 ? 0.3 : 0.6;
            OmMat3 F = om_mat3_add(random_rotation(&rng), random_mat3(&rng, size));
            OmMat3 U, V;
            OmVec3 s;
            om_mat3_svd(F, &U, &s, &V);
            // Ogden's energy has a crease where a stretch meets the opposite of another.
            if (s.z < 0 && fabs(s.y + s.z) < 0.05) continue;
            OmMat3 dF = random_mat3(&rng, 1);
            double above, below, energy, step = 1e-5;
            OmMat3 Pa =
                om__law_stress(m, OM_SHARE_WHOLE, om_mat3_add(F, om_mat3_scale(step, dF)), &above);
            OmMat3 Pb =
                om__law_stress(m, OM_SHARE_WHOLE, om_mat3_add(F, om_mat3_scale(-step, dF)), &below);
            OmMat3 P = om__law_stress(m, OM_SHARE_WHOLE, F, &energy);
            OmMat3 slope = om_mat3_scale(0.5 / step, om_mat3_add(Pa, om_mat3_scale(-1, Pb)));
            OmMat3 dP = tangent(m, F, dF, false);
            double size_P = om_mat3_norm(P) * om_mat3_norm(dF) + 3000 * om_mat3_norm(dF);
            double off_P = fabs(inner(P, dF) - (above - below) / (2 * step)) / size_P;
            double off_dP = om_mat3_norm(om_mat3_add(dP, om_mat3_scale(-1, slope))) /
                            (om_mat3_norm(dP) + 3000 * om_mat3_norm(dF));
            worst_stress = fmax(worst_stress, off_P);
            worst_tangent = fmax(worst_tangent, off_dP);
            // third derivatives of powers below a stretch of 0.3 are large: 1e-10 times some 1e4
            assert_near(off_P, 0, 2e-6);
            assert_near(off_dP, 0, 2e-6);
            assert_true(inner(dF, tangent(m, F, dF, true)) >= -1e-9 * 3000);
        }
        printf("%s: stress off by %.1e, tangent by %.1e\n", om_law_name(m->law), worst_stress,
               worst_tangent);
    }
}

static double* deformed(const TestRig* r, bool is_small) {
    double* x = om_alloc(3 * (size_t)r->mesh.nvert, sizeof *x);
    OmMat3 F = {{0.4, 0.9, 0.1}, {-1.0, 0.5, 0.2}, {0.1, -0.2, 0.9}};
    if (is_small)
        F = om_mat3_cols(om_vec3(1.01, 0.01, 0), om_vec3(0, 0.99, 0), om_vec3(0, 0.02, 1));
    for (int i = 0; i < r->mesh.nvert; ++i)
        om_store3(x, i, om_mat3_apply(F, om_load3(r->mesh.x, i)));
    rig_shake(&r->mesh, NULL, is_small ? 1e-5 : 0.0015, x);
    return x;
}

// y = K d of the projected elements, in double, from the principal form.
static void apply_elements(const TestRig* r, const OmMaterial* m, const double* x, const double* d,
                           double* y) {
    const double* grad = ((const OmFem*)r->m->data)->grad;
    memset(y, 0, 3 * (size_t)r->mesh.nvert * sizeof *y);
    for (int e = 0; e < r->mesh.ntet; ++e) {
        const int* v = r->mesh.tet_vert + 4 * (size_t)e;
        OmMat3 F = om_mat3_diag(om_vec3(0, 0, 0)), dF = F;
        OmVec3 g[4] = {{0, 0, 0}};
        for (int a = 1; a < 4; ++a) {
            g[a] = om_load3(grad + 9 * (size_t)e, a - 1);
            g[0] = om_sub(g[0], g[a]);
        }
        for (int a = 0; a < 4; ++a) {
            F = om_mat3_add(F, om_mat3_outer(om_load3(x, v[a]), g[a]));
            dF = om_mat3_add(dF, om_mat3_outer(om_load3(d, v[a]), g[a]));
        }
        double ea, eb;
        OmMat3 dP = tangent(m, F, dF, true);
        if (m->law == OM_LINEAR)
            dP = om_mat3_add(om__law_stress(m, OM_SHARE_WHOLE, om_mat3_add(F, dF), &ea),
                             om_mat3_scale(-1, om__law_stress(m, OM_SHARE_WHOLE, F, &eb)));
        for (int a = 0; a < 4; ++a)
            om_store3(y, v[a],
                      om_madd(om_load3(y, v[a]), r->m->volume[e], om_mat3_apply(dP, g[a])));
    }
}

// A = (1 + h a) M + (h^2 + h b) K, b = h f - h (h + b) K v - h a M v, K projected, from floats.
static void check_step(const OmMaterial* material, bool is_small) {
    TestRig r;
    const double h = 0.02, alpha = 2, beta = 0.03;
    rig_box(&r, lo, hi, 3, 2, 2);
    r.def.material_default = *material;
    r.def.rayleigh_mass = alpha;
    r.def.rayleigh_stiffness = beta;
    r.def.gravity = om_vec3(0, 0, 0);
    rig_start(&r);
    size_t n = 3 * (size_t)r.mesh.nvert;
    double *x = deformed(&r, is_small), *v = om_calloc(n, sizeof *v), *d = om_calloc(n, sizeof *d);
    double *y = om_alloc(n, sizeof *y), *Kd = om_alloc(n, sizeof *Kd), *f = om_alloc(n, sizeof *f);
    rig_shake(&r.mesh, NULL, 0.05, v);
    rig_shake(&r.mesh, NULL, 1, d);
    assert_ok(om_tissue_set_x(r.m, r.s, x, v));
    assert_ok(om_tissue_begin_step(r.m, r.s, r.w, h));
    assert_ok(om_tissue_apply(r.m, r.w, 1, d, y));
    apply_elements(&r, material, x, d, Kd);
    double size = 0, off = 0, size_b = 0, off_b = 0;
    for (size_t k = 0; k < n; ++k) {
        double mass = om_tissue_mass(r.m)[k / 3];
        double expected = (1 + h * alpha) * mass * d[k] + (h * h + h * beta) * Kd[k];
        size = fmax(size, fabs(expected));
        off = fmax(off, fabs(expected - y[k]));
    }
    apply_elements(&r, material, x, v, Kd);
    assert_ok(om_tissue_get_internal_force(r.m, r.s, f));
    for (size_t k = 0; k < n; ++k) {
        double mass = om_tissue_mass(r.m)[k / 3];
        double expected = h * f[k] - h * (h + beta) * Kd[k] - h * alpha * mass * v[k];
        size_b = fmax(size_b, fabs(expected));
        off_b = fmax(off_b, fabs(expected - r.w->b[k]));
    }
    printf("%s, %s: matrix off by %.1e, right-hand side by %.1e\n", om_law_name(material->law),
           is_small ? "small" : "large", off / size, off_b / size_b);
    // Floats, 6e-8 a term; stretches of the frame carry some 1e-6.
    assert_below(off, 1e-5 * size);
    assert_below(off_b, 1e-5 * size_b);
    om_free(x);
    om_free(v);
    om_free(d);
    om_free(y);
    om_free(Kd);
    om_free(f);
    rig_done(&r);
}

static void test_step(void** context) {
    (void)context;
    for (int k = 0; k < NLAW; ++k) {
        if (every_law[k].law == OM_COROTATIONAL) continue;  // test_fem_energy.c has its own matrix
        check_step(&every_law[k], true);
        check_step(&every_law[k], false);
    }
}

// Turned and moved as a whole: no force; a step in floats moves nothing by more than 4e-8 m.
static void test_rigid_motion(void** context) {
    (void)context;
    OmRng rng = om_rng_init(3, 0);
    for (int k = 0; k < NLAW; ++k) {
        if (every_law[k].law == OM_LINEAR) continue;
        TestRig r;
        rig_box(&r, lo, hi, 3, 2, 2);
        r.def.gravity = om_vec3(0, 0, 0);
        r.def.material_default = every_law[k];
        rig_start(&r);
        size_t n = 3 * (size_t)r.mesh.nvert;
        double *x = om_alloc(n, sizeof *x), *f = om_alloc(n, sizeof *f), max = 0;
        for (int trial = 0; trial < 10; ++trial) {
            OmMat3 R = random_rotation(&rng);
            for (int i = 0; i < r.mesh.nvert; ++i)
                om_store3(x, i,
                          om_add(om_vec3(0.3, -0.2, 0.1), om_mat3_apply(R, om_load3(r.mesh.x, i))));
            assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
            assert_ok(om_tissue_get_internal_force(r.m, r.s, f));
            for (size_t j = 0; j < n; ++j) assert_near(f[j], 0, 1e-12);
            assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, NULL));
            for (size_t j = 0; j < n; ++j) max = fmax(max, fabs(om_tissue_x(r.s)[j] - x[j]));
        }
        printf("%s: a rigid motion moves by %.1e m\n", om_law_name(every_law[k].law), max);
        assert_below(max, 4e-8);
        om_free(x);
        om_free(f);
        rig_done(&r);
    }
}

// Vertices thrown about until elements are inverted, one face held: all turn back to rest. Thrown twice as far,
// corotational elements still do; a neo-Hookean body can end in a knot, at rest with no element inverted.
static void test_inverted_recover(void** context) {
    (void)context;
    for (int k = 0; k < NLAW; ++k) {
        if (every_law[k].law == OM_LINEAR || every_law[k].law == OM_ST_VENANT_KIRCHHOFF) continue;
        bool is_wild = every_law[k].law == OM_COROTATIONAL;
        TestRig r;
        rig_box(&r, lo, hi, 3, 2, 2);
        rig_attach_plane(&r, 0, 0);
        r.def.gravity = om_vec3(0, 0, 0);
        r.def.rayleigh_mass = 5;
        r.def.material_default = every_law[k];
        rig_start(&r);
        size_t n = 3 * (size_t)r.mesh.nvert;
        double* x = om_alloc(n, sizeof *x);
        double* J = om_alloc((size_t)r.mesh.ntet, sizeof *J);
        memcpy(x, r.mesh.x, n * sizeof *x);
        rig_shake(&r.mesh, om_tissue_attached(r.s), is_wild ? 0.02 : 0.01, x);
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        assert_ok(om_tissue_get_measure(r.m, r.s, OM_VOLUME_RATIO, J));
        int ninverted = 0, nleft = 0, nbad = 0;
        for (int e = 0; e < r.mesh.ntet; ++e) ninverted += J[e] < 0;
        assert_true((is_wild ? 4 : 6) * ninverted > r.mesh.ntet);
        for (int step = 0; step < 400; ++step)
            nbad += om_tissue_step(r.m, r.s, r.w, 0.02, NULL) < 0;
        assert_ok(om_tissue_get_measure(r.m, r.s, OM_VOLUME_RATIO, J));
        double off = 0;
        for (int e = 0; e < r.mesh.ntet; ++e) nleft += fabs(J[e] - 1) > 1e-3;
        for (size_t j = 0; j < n; ++j) off = fmax(off, fabs(om_tissue_x(r.s)[j] - r.mesh.x[j]));
        printf("%s: %d of %d inverted, after 8 s %d, %.1e m from rest, %d steps failed\n",
               om_law_name(every_law[k].law), ninverted, r.mesh.ntet, nleft, off, nbad);
        assert_int_equal(nbad, 0);
        assert_int_equal(nleft, 0);
        assert_below(off, 1e-6);
        om_free(x);
        om_free(J);
        rig_done(&r);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_derivatives),
        cmocka_unit_test(test_step),
        cmocka_unit_test(test_rigid_motion),
        cmocka_unit_test(test_inverted_recover),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
