// test_fem_solid_shell.c: solid-shell hexahedra in the engine: forces are slopes of the energy, uniform strain is
// exact in any cell, steps see the same forces, and no shape but rigid motion is without stiffness. That the matrix is
// that of the prototype that was measured, test_fem_candidates tells.
#include "test_alloc.h"
#include "test_dense.h"
#include "test_element.h"

// `large` has as many cells as a batch: no element lies behind the last one, where a sanitizer sees reads too far.
static const int small[3] = {2, 1, 1}, large[3] = {4, 4, 1}, middle[3] = {3, 2, 1};

static void test_force_is_slope(void** context) {
    (void)context;
    check_force_is_slope(&shell_element, small);
}

static void test_step_sees_the_same(void** context) {
    (void)context;
    check_step_sees_the_same(&shell_element, small);
}

static void test_drag(void** context) {
    (void)context;
    check_drag(&shell_element, small);
}

static void test_workers(void** context) {
    (void)context;
    check_workers(&shell_element, large);
}

// Shaken by more than a cell, some parts end up within one another, where nothing here separates them.
static void test_inverted(void** context) {
    (void)context;
    check_inverted(&shell_element, middle, 0.015, 20, 1);
}

static void test_step_is_close(void** context) {
    (void)context;
    check_step_is_close(&shell_element);
}

// Cells of any shape whose edges stay within a fifth: moved corners.
static void distort(TestRig* r, OmRng* rng) {
    for (int k = 0; k < 3 * r->mesh.nvert; ++k)
        r->mesh.x[k] += (k % 3 == 2 ? 0.0005 : 0.002) * (2 * om_rng_uniform(rng) - 1);
}

static void distorted_start(TestRig* r, OmRng* rng, const int cells[3], OmMaterial material) {
    rig_box(r, om_vec3(0, 0, 0), om_vec3(0.01 * cells[0], 0.01 * cells[1], 0.005 * cells[2]),
            cells[0], cells[1], cells[2]);
    distort(r, rng);
    r->def.element = OM_ELEMENT_SHELL;
    r->def.material_default = material;
    r->def.rayleigh_mass = 0;
    r->def.density = 1e-9;
    r->def.gravity = om_vec3(0, 0, 0);
    rig_start(r);
}

// Under a uniform F every stress in distorted cells is that of linear tetrahedra, and the energies differ as the
// volumes do: faces of four corners are not flat.
static void test_uniform(void** context) {
    (void)context;
    for (int law = 0; law < NLAW; ++law) {
        OmRng rng = om_rng_init(5, 0);
        TestRig r, plain = {0};
        distorted_start(&r, &rng, middle, every_law[law]);
        assert_ok(om_tet_mesh_copy(&r.mesh, &plain.mesh));
        plain.def = r.def;
        plain.def.element = OM_ELEMENT_LINEAR;
        rig_start(&plain);
        double *x = om_alloc(3 * (size_t)r.mesh.nvert, sizeof *x),
               *a = om_alloc((size_t)r.mesh.ntet, sizeof *a),
               *b = om_alloc((size_t)r.mesh.ntet, sizeof *b), volume = 0;
        for (int e = 0; e < r.m->nelem; ++e) volume += om__fem_volume(r.m, e);
        volume /= om_tet_mesh_volume(&r.mesh);
        assert_near(volume, 1, 0.01);
        element_deform(&r, 0, x);
        assert_near_rel(element_energy(&r, x), volume * element_energy(&plain, x), 1e-9);
        for (int what = OM_VON_MISES; what <= OM_ENERGY_DENSITY; ++what) {
            assert_ok(om_tissue_get_measure(r.m, r.s, (OmTissueMeasure)what, a));
            assert_ok(om_tissue_get_measure(plain.m, plain.s, (OmTissueMeasure)what, b));
            for (int e = 0; e < r.mesh.ntet; ++e) assert_near_rel(a[e], b[e], 1e-8);
        }
        om_free(x), om_free(a), om_free(b);
        rig_done(&r);
        rig_done(&plain);
    }
}

// Distorted cells under large strain: forces are slopes of the energy, and in balance.
static void test_distorted_slope(void** context) {
    (void)context;
    for (int law = 0; law < NLAW; ++law) {
        OmRng rng = om_rng_init(8, 0);
        TestRig r;
        distorted_start(&r, &rng, small, every_law[law]);
        size_t n = 3 * (size_t)r.mesh.nvert;
        double *x = om_alloc(n, sizeof *x), *f = om_alloc(n, sizeof *f), largest = 0;
        OmVec3 sum = {0, 0, 0};
        element_deform(&r, 0.0008, x);
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        assert_ok(om_tissue_get_internal_force(r.m, r.s, f));
        for (size_t k = 0; k < n; ++k) largest = fmax(largest, fabs(f[k]));
        double worst = worst_slope(&r, x, f, 1e-8);
        for (int i = 0; i < r.mesh.nvert; ++i) sum = om_add(sum, om_load3(f, i));
        printf("distorted, %s: force against slope %.2g of the largest\n",
               om_law_name(every_law[law].law), worst / largest);
        assert_below(worst, 2e-8 * largest);
        assert_near(om_norm(sum), 0, 1e-12 * largest);
        om_free(x), om_free(f);
        rig_done(&r);
    }
}

// Stiffness for every motion of a distorted cell but the six rigid ones, at rest; multigrid's bound of D^-1 A.
static void test_no_spurious_mode(void** context) {
    (void)context;
    static const int one[3] = {1, 1, 1};
    OmRng rng = om_rng_init(4, 0);
    double least = 1, most = 0;
    for (int trial = 0; trial < 40; ++trial) {
        TestRig r;
        double K[576], value[24], D[576] = {0}, scaled[576];
        distorted_start(&r, &rng, one, every_law[trial % 5]);
        assert_ok(om_tissue_begin_step(r.m, r.s, r.w, 1));
        const OmBsr* A = om_engine_matrix(r.w);
        for (int k = 0; k < 576; ++k) {
            int i = k / 24, j = k % 24, at = om_bsr_find(A, i / 3, j / 3);
            K[k] = (double)A->value[9 * at + 3 * (j % 3) + i % 3];
            if (i / 3 == j / 3) D[k] = K[k];
        }
        memcpy(scaled, K, sizeof K);
        test_jacobi(24, K, value);
        for (int k = 0; k < 6; ++k) assert_near(value[k], 0, 2e-6 * value[23]);
        assert_true(value[6] > 100 * fabs(value[5]));
        least = fmin(least, value[6] / value[23]);
        test_reduce_to_standard(24, D, scaled);
        test_jacobi(24, scaled, value);
        most = fmax(most, value[23]);
        rig_done(&r);
    }
    printf("smallest stiffness over the largest %.2g, largest eigenvalue of D^-1 K %.3g\n", least,
           most);
    assert_below(most, 7);  // SHELL_BOUND of tissue_step.c is 8: see test_iterations
}

// Multigrid's iterations for a sheet that sinks and is nearly incompressible: 909, and 1254 with a bound of 7.
static void test_iterations(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.12, 0.12, 0.008), 24, 24, 1);
    rig_attach_plane(&r, 0, 0);
    r.def.element = OM_ELEMENT_SHELL;
    r.def.solver.nworker = 1;
    r.def.material_default =
        (OmMaterial){.young = 20000, .poisson = 0.49, .law = OM_STABLE_NEO_HOOKEAN};
    rig_start(&r);
    int sum = 0;
    for (int step = 0; step < 8; ++step) {
        OmTissueReport report;
        assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, &report));
        sum += report.iterations;
    }
    printf("nu 0.49: %d iterations in 8 steps\n", sum);
    assert_below(sum, 1080);
    rig_done(&r);
}

// The stress at the centroid of each tetrahedron: bent to a cylinder, E kappa z / (1 - nu^2) along it, nu of it across,
// none through the thickness. `skew` turns the sides of cells, which are then trapezoids.
static void check_bending_stress(double skew) {
    const int cells[3] = {3, 1, 1};
    const double kappa = 1e-4, young = 3000, nu = 0.45;
    TestRig r;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.03, 0.01, 0.005), cells[0], cells[1], cells[2]);
    for (int i = 0; i < r.mesh.nvert; ++i) {
        double* p = &r.mesh.x[3 * i];
        if (p[0] > 0.005 && p[0] < 0.025) p[0] += (p[0] < 0.015 ? 1 : -1) * skew * (p[1] - 0.005);
    }
    r.def.element = OM_ELEMENT_SHELL;
    r.def.material_default = (OmMaterial){.young = young, .poisson = nu, .law = OM_LINEAR};
    rig_start(&r);
    double *x = om_alloc(3 * (size_t)r.mesh.nvert, sizeof *x),
           *s = om_alloc((size_t)r.mesh.ntet, sizeof *s);
    for (int i = 0; i < r.mesh.nvert; ++i) {
        OmVec3 p = om_load3(r.mesh.x, i);
        double z = p.z - 0.0025, u = p.x - 0.015;
        om_store3(x, i, om_add(p, om_vec3(-kappa * z * u, 0, 0.5 * kappa * u * u)));
    }
    assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
    assert_ok(om_tissue_get_measure(r.m, r.s, OM_VON_MISES, s));
    double worst = 0, largest = 0;
    for (int e = 0; e < r.mesh.ntet; ++e) {
        double z = 0;
        for (int k = 0; k < 4; ++k)
            z += 0.25 * (r.mesh.x[3 * r.mesh.tet_vert[4 * e + k] + 2] - 0.0025);
        double along = young * kappa * fabs(z) / (1 - nu * nu), across = nu * along;
        double exact = sqrt(along * along + across * across - along * across);
        worst = fmax(worst, fabs(s[e] - exact));
        largest = fmax(largest, exact);
    }
    printf("bent to a cylinder, sides turned by %g: stress within %.2g of %.3g Pa\n", skew,
           worst / largest, largest);
    assert_below(worst, 1e-6 * largest);  // the squares of strains of 2.5e-7
    om_free(x), om_free(s);
    rig_done(&r);
}

static void test_bending_stress(void** context) {
    (void)context;
    check_bending_stress(0);
    check_bending_stress(0.5);
}

// No allocation may fail unseen, and nothing is left behind.
static void test_no_memory(void** context) {
    (void)context;
    TestRig r;
    OmMaterial two[2];
    element_start(&r, &shell_element, small, two, every_law[3]);
    assert_true(test_failing_allocations(rig_create_and_step, &r.def, 1) > 40);
    rig_done(&r);
}

// A corner pushed through its cell: the step does not say OM_OK.
static void test_says_inverted(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.01, 0.01, 0.005), 1, 1, 1);
    r.def.element = OM_ELEMENT_SHELL;
    rig_start(&r);
    double x[24];
    memcpy(x, r.mesh.x, sizeof x);
    x[2] = 0.02;  // the first corner, above the cell
    assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
    OmTissueReport report;
    assert_int_equal(om_tissue_step(r.m, r.s, r.w, 1e-6, &report), OM_NOT_CONVERGED);
    assert_true(report.ninverted > 0);
    rig_done(&r);
}

// A corner pushed into its cell and through it: what resists there has forces that are slopes, the same in floats.
static void test_crushed(void** context) {
    (void)context;
    static const double high[] = {0.004, 0.006, 0.008, 0.015};
    for (int k = 0; k < 8; ++k) {
        TestRig r;
        rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.01, 0.01, 0.005), 1, 1, 1);
        r.def.element = OM_ELEMENT_SHELL;
        r.def.material_default = every_law[k % 2 ? 0 : 3];
        r.def.rayleigh_mass = 0;
        r.def.gravity = om_vec3(0, 0, 0);
        rig_start(&r);
        double x[24], f[24], apart = 0, largest = 0;
        memcpy(x, r.mesh.x, sizeof x);
        x[2] = high[k / 2];
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        assert_ok(om_tissue_get_internal_force(r.m, r.s, f));
        assert_ok(om_tissue_begin_step(r.m, r.s, r.w, 1));
        OmTissueCheck check;
        om__fem_check(r.m, r.w, x, x, false, &check);
        assert_near_rel(check.elastic_end, element_energy(&r, x), 1e-5);
        for (int n = 0; n < 24; ++n) {
            apart = fmax(apart, fabs(f[n] - r.w->b[n]));
            largest = fmax(largest, fabs(f[n]));
        }
        double worst = worst_slope(&r, x, f, 1e-8);
        double drag = drag_error(&r, x);
        printf("corner at %g mm: slope %.2g, float %.2g, drag %.2g, energy %.3g J\n",
               1e3 * high[k / 2], worst / largest, apart / largest, drag, check.elastic_end);
        assert_below(drag, 1e-5);
        assert_below(worst, 1e-6 * largest);
        assert_below(apart, 1e-5 * largest);
        assert_int_equal(check.ninverted, high[k / 2] > 0.01);
        rig_done(&r);
    }
}

// What is no sheet of cells is refused with the reason.
static void test_refused(void** context) {
    (void)context;
    TestRig r;
    OmTissueModel* m = NULL;
    rig_box(&r, element_lo, element_hi, 2, 1, 1);
    r.def.element = OM_ELEMENT_SHELL;
    r.mesh.tet_label[7] = 1;
    assert_int_equal(om_tissue_create(&r.def, &m), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "cell 1 has tetrahedra of two labels, 0 and 1"));
    r.mesh.tet_label[7] = 0;
    for (int k = 0; k < 4; ++k) {  // another order of the same tetrahedra
        int v = r.mesh.tet_vert[k];
        r.mesh.tet_vert[k] = r.mesh.tet_vert[4 + k];
        r.mesh.tet_vert[4 + k] = v;
    }
    assert_int_equal(om_tissue_create(&r.def, &m), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "tetrahedra 0 to 5 are not a cell"));
    assert_true(m == NULL);
    om_tet_mesh_done(&r.mesh);
}

// Masses: an eighth of each cell.
static void test_mass(void** context) {
    (void)context;
    TestRig r;
    OmRng rng = om_rng_init(7, 0);
    distorted_start(&r, &rng, middle, every_law[0]);
    double sum = 0;
    for (int i = 0; i < r.mesh.nvert; ++i) sum += om_tissue_mass(r.m)[i];
    assert_near_rel(sum, 1e-9 * om_tet_mesh_volume(&r.mesh), 1e-12);
    double corner = 0;  // of the only cell of the first vertex
    for (int e = 0; e < 6; ++e) {
        OmTetMesh one = {
            .nvert = r.mesh.nvert, .ntet = 1, .x = r.mesh.x, .tet_vert = r.mesh.tet_vert + 4 * e};
        corner += om_tet_mesh_volume(&one);
    }
    assert_near_rel(om_tissue_mass(r.m)[0], 1e-9 * corner / 8, 1e-12);
    rig_done(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_uniform),
        cmocka_unit_test(test_distorted_slope),
        cmocka_unit_test(test_no_spurious_mode),
        cmocka_unit_test(test_bending_stress),
        cmocka_unit_test(test_no_memory),
        cmocka_unit_test(test_says_inverted),
        cmocka_unit_test(test_refused),
        cmocka_unit_test(test_iterations),
        cmocka_unit_test(test_mass),
        cmocka_unit_test(test_crushed),
        cmocka_unit_test(test_force_is_slope),
        cmocka_unit_test(test_step_sees_the_same),
        cmocka_unit_test(test_drag),
        cmocka_unit_test(test_workers),
        cmocka_unit_test(test_inverted),
        cmocka_unit_test(test_step_is_close),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
