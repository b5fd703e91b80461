// test_fem_cell.c: averaged strains (OmTissueDef.is_averaged): forces are slopes of the energy, uniform strain is
// exact, steps see the same forces, and beams and membranes of few cells bend as they should.
#include "test_alloc.h"
#include "test_element.h"

static const int small[3] = {3, 2, 2}, large[3] = {6, 4, 4};

static void test_force_is_slope(void** context) {
    (void)context;
    check_force_is_slope(&averaged_element, small);
}

static void test_step_sees_the_same(void** context) {
    (void)context;
    check_step_sees_the_same(&averaged_element, small);
}

static void test_workers(void** context) {
    (void)context;
    check_workers(&averaged_element, large);
}

static void test_inverted(void** context) {
    (void)context;
    check_inverted(&averaged_element, large, 0.005, 5);
}

static void test_step_is_close(void** context) {
    (void)context;
    check_step_is_close(&linear_element);
    check_step_is_close(&averaged_element);
}

// Under a uniform F the energy and the forces are those of plain elements: cells, averages and hinges see nothing.
static void test_uniform(void** context) {
    (void)context;
    for (int law = 0; law < NLAW; ++law) {
        TestRig plain, r;
        OmMaterial two[2], same[2];
        element_start(&r, &averaged_element, small, two, every_law[law]);
        element_start(&plain, &averaged_element, small, same, every_law[law]);
        om_tissue_work_destroy(plain.w);
        om_tissue_state_destroy(plain.s);
        om_tissue_destroy(plain.m);
        plain.def.is_averaged = false;
        rig_start(&plain);
        size_t n = 3 * (size_t)r.mesh.nvert;
        double *x = om_alloc(n, sizeof *x), *f = om_alloc(n, sizeof *f),
               *g = om_alloc(n, sizeof *g);
        double largest = 0;
        element_deform(&r, 0, x);
        double energy = element_energy(&plain, x);
        assert_near_rel(element_energy(&r, x), energy, 1e-12);
        assert_ok(om_tissue_get_internal_force(r.m, r.s, f));
        assert_ok(om_tissue_get_internal_force(plain.m, plain.s, g));
        for (size_t k = 0; k < n; ++k) largest = fmax(largest, fabs(g[k]));
        for (size_t k = 0; k < n; ++k) assert_near(f[k], g[k], 1e-11 * largest);
        om_free(x);
        om_free(f);
        om_free(g);
        rig_done(&r);
        rig_done(&plain);
    }
}

// No allocation may fail unseen, and nothing is left behind.
static void test_no_memory(void** context) {
    (void)context;
    TestRig r;
    OmMaterial two[2];
    element_start(&r, &averaged_element, small, two, every_law[3]);
    assert_true(test_failing_allocations(rig_create_and_step, &r.def, 1) > 40);
    rig_done(&r);
}

// ---- bending ------------------------------------------------------------------------------------------

static void test_cantilever(void** context) {
    (void)context;
    static const double poisson[] = {0.3, 0.45, 0.49};
    for (int k = 0; k < 3; ++k) {
        double plain = cantilever_ratio(&linear_element, 4, poisson[k], OM_COROTATIONAL);
        double averaged = cantilever_ratio(&averaged_element, 4, poisson[k], OM_COROTATIONAL);
        double neo = cantilever_ratio(&averaged_element, 4, poisson[k], OM_STABLE_NEO_HOOKEAN);
        printf(
            "cantilever, 4 cells, nu %.2f: plain %+.1f %%, averaged %+.1f %%, stable neo-Hookean %+.1f %%\n",
            poisson[k], 100 * (plain - 1), 100 * (averaged - 1), 100 * (neo - 1));
        assert_near_rel(averaged, 1, 0.1);
        assert_near_rel(neo, 1, 0.1);
        assert_true(plain < 0.8);
    }
}

// ---- Cook's membrane ----------------------------------------------------------------------------------

#define COOK_PARTS 10  // of the load

typedef struct Cook {  // plane strain: x = 0 held, no vertex moves along z
    TestRig r;
    size_t n;
    double *load, *x, *f, *minus, *plus;
} Cook;

static bool is_cook_held(const Cook* c, size_t k) {
    return k % 3 == 2 || c->r.mesh.x[k - k % 3] < 1e-9;
}

// f at x, zero where held.
static void cook_force(Cook* c, const double* x, double* f) {
    assert_ok(om_tissue_set_x(c->r.m, c->r.s, x, NULL));
    assert_ok(om_tissue_get_internal_force(c->r.m, c->r.s, f));
    for (size_t k = 0; k < c->n; ++k)
        if (is_cook_held(c, k)) f[k] = 0;
}

// f = K^-1 f: K column by column from differences of forces, eliminated without pivots.
static void cook_newton(Cook* c) {
    int nfree = 0, *free_dof = om_alloc(c->n, sizeof *free_dof);
    for (size_t k = 0; k < c->n; ++k)
        if (!is_cook_held(c, k)) free_dof[nfree++] = (int)k;
    size_t n = (size_t)nfree;
    double *K = om_alloc(n * n, sizeof *K), step = 1e-9;
    for (size_t j = 0; j < n; ++j) {
        double place = c->x[free_dof[j]];
        c->x[free_dof[j]] = place - step;
        cook_force(c, c->x, c->minus);
        c->x[free_dof[j]] = place + step;
        cook_force(c, c->x, c->plus);
        c->x[free_dof[j]] = place;
        for (size_t i = 0; i < n; ++i)
            K[n * i + j] = (c->minus[free_dof[i]] - c->plus[free_dof[i]]) / (2 * step);
    }
    for (size_t k = 0; k < n; ++k) {
        for (size_t i = k + 1; i < n; ++i) {
            double m = K[n * i + k] / K[n * k + k];
            for (size_t j = k; j < n; ++j) K[n * i + j] -= m * K[n * k + j];
            c->f[free_dof[i]] -= m * c->f[free_dof[k]];
        }
    }
    for (size_t k = n; k-- > 0;) {
        double sum = c->f[free_dof[k]];
        for (size_t j = k + 1; j < n; ++j) sum -= K[n * k + j] * c->f[free_dof[j]];
        c->f[free_dof[k]] = sum / K[n * k + k];
    }
    om_free(K);
    om_free(free_dof);
}

// f: what is out of balance under a share of the load; its norm over that of the load.
static double cook_residual(Cook* c, double share) {
    double sum = 0, whole = 0;
    cook_force(c, c->x, c->f);
    for (size_t k = 0; k < c->n; ++k) {
        c->f[k] += share * c->load[k];
        sum += c->f[k] * c->f[k];
        whole += c->load[k] * c->load[k];
    }
    return sqrt(sum / whole);
}

// u_y of (48, 60), mm; as test_fem_cook.c, whose reference it is: 6.8914 mm at nu = 0.499.
static double cook(int n, double nu, bool is_averaged) {
    Cook c;
    rig_box(&c.r, om_vec3(0, 0, 0), om_vec3(1, 1, 1), n, n, 1);
    c.n = 3 * (size_t)c.r.mesh.nvert;
    double traction = 100 / 16e-6, worst = 1;
    for (int i = 0; i < c.r.mesh.nvert; ++i) {
        OmVec3 p = om_load3(c.r.mesh.x, i);
        double low = 44 * p.x, high = 44 + 16 * p.x;
        om_store3(c.r.mesh.x, i, om_scale(1e-3, om_vec3(48 * p.x, low + (high - low) * p.y, p.z)));
    }
    rig_attach_plane(&c.r, 0, 0);
    c.r.def.material_default =
        (OmMaterial){.young = 240.565e6 * (1 + nu) / 1.499, .poisson = nu, .law = OM_MOONEY_RIVLIN};
    c.r.def.is_averaged = is_averaged;
    rig_start(&c.r);
    double** array[] = {&c.load, &c.x, &c.f, &c.minus, &c.plus};
    for (int k = 0; k < 5; ++k) *array[k] = om_calloc(c.n, sizeof(double));
    // the loaded face: 16 mm by 1 mm, trapezoids
    for (int i = 0; i < c.r.mesh.nvert; ++i) {
        OmVec3 p = om_load3(c.r.mesh.x, i);
        if (p.x < 48e-3 - 1e-9) continue;
        bool is_end = p.y < 44e-3 + 1e-9 || p.y > 60e-3 - 1e-9;
        c.load[3 * i + 1] = traction * 16e-6 / n * (is_end ? 0.25 : 0.5);
    }
    memcpy(c.x, c.r.mesh.x, c.n * sizeof *c.x);
    for (int part = 1; part <= COOK_PARTS; ++part) {
        double share = (double)part / COOK_PARTS;
        worst = cook_residual(&c, share);
        for (int it = 0; it < 20 && worst > 1e-6; ++it) {
            cook_newton(&c);
            for (size_t k = 0; k < c.n; ++k) c.x[k] += c.f[k];
            worst = cook_residual(&c, share);
        }
        assert_below(worst, 1e-6);
    }
    double u = 0;
    for (int i = 0; i < c.r.mesh.nvert; ++i) {
        OmVec3 p = om_load3(c.r.mesh.x, i);
        if (p.x > 48e-3 - 1e-9 && p.y > 60e-3 - 1e-9 && p.z < 1e-9)
            u = 1e3 * (c.x[3 * i + 1] - p.y);
    }
    for (int k = 0; k < 5; ++k) om_free(*array[k]);
    rig_done(&c.r);
    return u;
}

static void test_cook(void** context) {
    (void)context;
    double reference = 6.891409184641067;
    double coarse = cook(4, 0.499, true), plain = cook(4, 0.499, false);
    printf("Cook, nu 0.499: 4 cells: plain %.4f mm (%+.1f %%), averaged %.4f mm (%+.1f %%)\n",
           plain, 100 * (plain / reference - 1), coarse, 100 * (coarse / reference - 1));
    assert_true(plain < 0.4 * reference);
    assert_near_rel(coarse, reference, 0.15);
    if (!test_is_slow()) return;
    double averaged = cook(8, 0.499, true);
    printf("8 cells: averaged %.4f mm (%+.1f %%)\n", averaged, 100 * (averaged / reference - 1));
    assert_near_rel(averaged, reference, 0.05);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_force_is_slope),
        cmocka_unit_test(test_uniform),
        cmocka_unit_test(test_step_sees_the_same),
        cmocka_unit_test(test_no_memory),
        cmocka_unit_test(test_workers),
        cmocka_unit_test(test_inverted),
        cmocka_unit_test(test_step_is_close),
        cmocka_unit_test(test_cantilever),
        cmocka_unit_test(test_cook),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
