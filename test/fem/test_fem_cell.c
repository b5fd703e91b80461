// test_fem_cell.c: averaged strains (OmTissueDef.is_averaged): forces are slopes of the energy, uniform strain is
// exact, steps see the same forces, and beams and membranes of few cells bend as they should.
#include "test_alloc.h"
#include "test_materials.h"
#include "test_random.h"
#include "test_rig.h"

#include "fem/fem_internal.h"

static const OmVec3 lo = {0, 0, 0}, hi = {0.03, 0.02, 0.02};

// Two materials of one law, tissue and something stiffer.
static void start(TestRig* r, OmMaterial* two, OmMaterial material) {
    rig_box(r, lo, hi, 3, 2, 2);
    two[0] = two[1] = material;
    two[1].young = 9000;
    two[1].poisson = 0.2;
    two[1].bulk = 0;
    r->def.nmaterial = 2;
    r->def.material = two;
    for (int e = 0; e < r->mesh.ntet; ++e) r->mesh.tet_label[e] = e % 5 == 0;
    r->def.gravity = om_vec3(0, 0, 0);
    r->def.is_averaged = true;
    rig_start(r);
}

static void deform(const TestRig* r, double shake, double* x) {
    OmMat3 F = {{0.4, 0.9, 0.1}, {-1.0, 0.5, 0.2}, {0.1, -0.2, 1.2}};
    for (int i = 0; i < r->mesh.nvert; ++i)
        om_store3(x, i, om_mat3_apply(F, om_load3(r->mesh.x, i)));
    rig_shake(&r->mesh, NULL, shake, x);
}

static double elastic_at(const TestRig* r, const double* x) {
    OmTissueEnergy energy;
    assert_ok(om_tissue_set_x(r->m, r->s, x, NULL));
    assert_ok(om_tissue_get_energy(r->m, r->s, &energy));
    return energy.elastic;
}

// f = -dE/dx by central differences, every law, two materials; no resultant, no moment.
static void test_force_is_slope(void** context) {
    (void)context;
    for (int law = 0; law < NLAW; ++law) {
        TestRig r;
        OmMaterial two[2];
        start(&r, two, every_law[law]);
        size_t n = 3 * (size_t)r.mesh.nvert;
        double *x = om_alloc(n, sizeof *x), *f = om_alloc(n, sizeof *f), largest = 0, worst = 0;
        deform(&r, 0.0015, x);
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        assert_ok(om_tissue_get_internal_force(r.m, r.s, f));
        OmVec3 sum = {0, 0, 0}, moment = sum;
        for (int i = 0; i < r.mesh.nvert; ++i) {
            sum = om_add(sum, om_load3(f, i));
            moment = om_add(moment, om_cross(om_load3(x, i), om_load3(f, i)));
        }
        for (size_t k = 0; k < n; ++k) largest = fmax(largest, fabs(f[k]));
        for (size_t k = 0; k < n; ++k) {
            double place = x[k], step = 1e-7;
            x[k] = place + step;
            double above = elastic_at(&r, x);
            x[k] = place - step;
            double below = elastic_at(&r, x);
            x[k] = place;
            worst = fmax(worst, fabs(f[k] + (above - below) / (2 * step)));
        }
        printf("%s: force against slope %.2g of the largest\n", om_law_name(every_law[law].law),
               worst / largest);
        assert_below(worst, 2e-7 * largest);
        assert_near(om_norm(sum), 0, 1e-13 * largest);
        if (every_law[law].law != OM_LINEAR) assert_near(om_norm(moment), 0, 1e-14 * largest);
        om_free(x);
        om_free(f);
        rig_done(&r);
    }
}

// Under a uniform F the energy and the forces are those of plain elements: cells, averages and hinges see nothing.
static void test_uniform(void** context) {
    (void)context;
    for (int law = 0; law < NLAW; ++law) {
        TestRig plain, r;
        OmMaterial two[2], same[2];
        start(&r, two, every_law[law]);
        start(&plain, same, every_law[law]);
        om_tissue_work_destroy(plain.w);
        om_tissue_state_destroy(plain.s);
        om_tissue_destroy(plain.m);
        plain.def.is_averaged = false;
        rig_start(&plain);
        size_t n = 3 * (size_t)r.mesh.nvert;
        double *x = om_alloc(n, sizeof *x), *f = om_alloc(n, sizeof *f),
               *g = om_alloc(n, sizeof *g);
        double largest = 0;
        deform(&r, 0, x);
        double energy = elastic_at(&plain, x);
        assert_near_rel(elastic_at(&r, x), energy, 1e-12);
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

// What a step sees in float is what is computed in double: b = h (f + ...) at rest and, moving, h f(x + h v) to
// first order in v.
static void test_step_sees_the_same(void** context) {
    (void)context;
    for (int law = 0; law < NLAW; ++law) {
        TestRig r;
        OmMaterial two[2];
        start(&r, two, every_law[law]);
        size_t n = 3 * (size_t)r.mesh.nvert;
        double *x = om_alloc(n, sizeof *x), *f = om_alloc(n, sizeof *f),
               *v = om_calloc(n, sizeof *v), *still = om_alloc(n, sizeof *still), largest = 0,
               worst = 0, moved = 0, h = 0.02;
        for (int i = 0; i < r.mesh.nvert; ++i) om_store3(x, i, om_load3(r.mesh.x, i));
        rig_shake(&r.mesh, NULL, 0.0008, x);
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        assert_ok(om_tissue_get_internal_force(r.m, r.s, f));
        assert_ok(om_tissue_begin_step(r.m, r.s, r.w, h));
        for (size_t k = 0; k < n; ++k) largest = fmax(largest, h * fabs(f[k]));
        for (size_t k = 0; k < n; ++k) worst = fmax(worst, fabs(r.w->b[k] - h * f[k]));
        memcpy(still, r.w->b, n * sizeof *still);
        // small velocities about the undeformed shape, where no tangent is projected
        OmRng rng = om_rng_init(8, 0);
        for (size_t k = 0; k < n; ++k) v[k] = 2e-4 * om_rng_normal(&rng);
        for (size_t k = 0; k < n; ++k) x[k] = r.mesh.x[k] + h * v[k];
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        assert_ok(om_tissue_get_internal_force(r.m, r.s, f));
        assert_ok(om_tissue_set_x(r.m, r.s, r.mesh.x, v));
        assert_ok(om_tissue_begin_step(r.m, r.s, r.w, h));
        double size = 0;
        for (size_t k = 0; k < n; ++k) size = fmax(size, h * fabs(f[k]));
        for (size_t k = 0; k < n; ++k) {
            double mass = om_tissue_mass(r.m)[k / 3];
            moved = fmax(moved, fabs(r.w->b[k] - h * f[k] + h * 0.1 * mass * v[k]));
        }
        printf("%s: float against double %.2g, moving %.2g of the largest\n",
               om_law_name(every_law[law].law), worst / largest, moved / size);
        assert_below(worst, 1e-5 * largest);
        assert_below(moved, 0.01 * size);  // strains of 4e-4, the second order
        om_free(x), om_free(f), om_free(v), om_free(still);
        rig_done(&r);
    }
}

// No allocation may fail unseen, and nothing is left behind.
static void test_no_memory(void** context) {
    (void)context;
    TestRig r;
    OmMaterial two[2];
    start(&r, two, every_law[3]);
    assert_true(test_failing_allocations(rig_create_and_step, &r.def, 1) > 40);
    rig_done(&r);
}

// The same bytes with any number of workers.
static void test_workers(void** context) {
    (void)context;
    static const OmLaw law[] = {OM_COROTATIONAL, OM_NEO_HOOKEAN};
    for (int k = 0; k < 2; ++k) {
        uint64_t hash = 0;
        for (int nworker = 1; nworker <= 8; nworker += nworker > 2 ? 5 : 1) {
            TestRig r;
            rig_box(&r, lo, hi, 6, 4, 4);
            rig_attach_plane(&r, 0, 0);
            r.def.material_default.law = law[k];
            r.def.is_averaged = true;
            r.def.solver.nworker = nworker;
            rig_start(&r);
            for (int step = 0; step < 5; ++step)
                assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, NULL));
            OmTissueReport report;
            assert_ok(om_tissue_find_rest(r.m, r.s, r.w, 1e-4, 20, &report));
            if (nworker == 1) hash = om_tissue_state_hash(r.s);
            assert_true(om_tissue_state_hash(r.s) == hash);
            rig_done(&r);
        }
    }
}

// A fifth of the vertices anywhere, one face held: all come back, and the energy ends at that of rest.
static void test_inverted(void** context) {
    (void)context;
    static const OmLaw law[] = {OM_COROTATIONAL, OM_NEO_HOOKEAN, OM_STABLE_NEO_HOOKEAN};
    for (int k = 0; k < 3; ++k) {
        TestRig r;
        rig_box(&r, lo, hi, 6, 4, 4);
        rig_attach_plane(&r, 0, 0);
        r.def.material_default.law = law[k];
        r.def.is_averaged = true;
        r.def.gravity = om_vec3(0, 0, 0);
        r.def.rayleigh_mass = 2;
        rig_start(&r);
        size_t n = 3 * (size_t)r.mesh.nvert;
        double *x = om_alloc(n, sizeof *x), *J = om_alloc((size_t)r.mesh.ntet, sizeof *J);
        memcpy(x, r.mesh.x, n * sizeof *x);
        rig_shake(&r.mesh, om_tissue_attached(r.s), 0.005, x);
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        assert_ok(om_tissue_get_measure(r.m, r.s, OM_VOLUME_RATIO, J));
        int ninverted = 0;
        for (int e = 0; e < r.mesh.ntet; ++e) ninverted += J[e] < 0;
        for (int step = 0; step < 250; ++step) {
            OmStatus status = om_tissue_step(r.m, r.s, r.w, 0.02, NULL);
            if (status < 0) fail_msg("%s", om_error_message());
        }
        assert_ok(om_tissue_get_measure(r.m, r.s, OM_VOLUME_RATIO, J));
        int left = 0;
        double far = 0;
        for (int e = 0; e < r.mesh.ntet; ++e) left += J[e] < 0;
        for (size_t i = 0; i < n; ++i) far = fmax(far, fabs(om_tissue_x(r.s)[i] - r.mesh.x[i]));
        printf("%s: %d of %d inverted at first, %d after 5 s, %.2g m from rest\n",
               om_law_name(law[k]), ninverted, r.mesh.ntet, left, far);
        assert_true(ninverted > r.mesh.ntet / 5);
        assert_int_equal(left, 0);
        assert_below(far, 1e-4);
        om_free(x);
        om_free(J);
        rig_done(&r);
    }
}

// A beam of 100 x 30 x 30 mm released under a tenth of its weight, half a second: tip after each step.
static void fall(bool is_averaged, int max_newton, double* tip, double* gain) {
    TestRig r;
    rig_box(&r, lo, om_vec3(0.1, 0.03, 0.03), 10, 3, 3);
    rig_attach_plane(&r, 0, 0);
    r.def.is_averaged = is_averaged;
    r.def.gravity = om_vec3(0, 0, -0.981);
    r.def.max_newton = max_newton;
    r.def.newton_tolerance = 1e-4;
    rig_start(&r);
    *gain = 0;
    for (int step = 0; step < 25; ++step) {
        OmTissueEnergy e;
        OmStatus status = om_tissue_step(r.m, r.s, r.w, 0.02, NULL);
        if (status != OM_OK) fail_msg("%s", om_error_message());
        assert_ok(om_tissue_get_energy(r.m, r.s, &e));
        double rest = -0.981 * r.m->total_mass * 0.015;
        *gain = fmax(*gain, e.elastic + e.kinetic + e.gravity + rest);
        tip[step] = om_tissue_x(r.s)[3 * r.mesh.nvert - 1] - r.mesh.x[3 * r.mesh.nvert - 1];
    }
    rig_done(&r);
}

// One linearisation, whose matrix is an upper bound of the tangent, against Newton's method: as near as with
// plain elements, whose matrix is the tangent; no energy from nowhere.
static void test_step_is_close(void** context) {
    (void)context;
    for (int averaged = 0; averaged < 2; ++averaged) {
        double one[25], many[25], gain, none, worst = 0;
        fall(averaged, 1, one, &gain);
        fall(averaged, 30, many, &none);
        for (int k = 0; k < 25; ++k) worst = fmax(worst, fabs(one[k] - many[k]));
        printf(
            "falling beam, %s: tip %.3f mm, one linearisation differs by %.3f mm, energy gained %.2g J\n",
            averaged ? "averaged" : "plain", 1e3 * many[24], 1e3 * worst, gain);
        assert_below(worst, 0.03 * fabs(many[24]));
        assert_below(gain, 1e-9);
    }
}

// ---- bending ------------------------------------------------------------------------------------------

// Deflection of a cantilever five times as long as high under its own weight over Timoshenko's, as in
// test_fem_static.c.
static double cantilever_ratio(int cells, double nu, OmLaw law, bool is_averaged) {
    TestRig r;
    double L = 0.1, a = 0.02, young = 3e6, g = 9.81;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(L, a, a), 5 * cells, cells, cells);
    rig_attach_plane(&r, 0, 0);
    r.def.material_default = (OmMaterial){.young = young, .poisson = nu, .law = law};
    r.def.gravity = om_vec3(0, 0, -g);
    r.def.is_averaged = is_averaged;
    rig_start(&r);
    OmTissueReport report;
    OmStatus status = om_tissue_find_rest(r.m, r.s, r.w, 1e-4, 30, &report);
    if (status != OM_OK) fail_msg("%s", om_error_message());
    double w = 0;
    int num = 0;
    for (int i = 0; i < r.mesh.nvert; ++i) {
        if (r.mesh.x[3 * i] < L - 1e-9) continue;
        w += r.mesh.x[3 * i + 2] - om_tissue_x(r.s)[3 * i + 2];
        ++num;
    }
    rig_done(&r);
    double load = 1000 * g * a * a, inertia = a * a * a * a / 12;
    double k = 10 * (1 + nu) / (12 + 11 * nu), shear = young / (2 * (1 + nu));
    double beam = load * pow(L, 4) / (8 * young * inertia) + load * L * L / (2 * k * shear * a * a);
    return w / num / beam;
}

static void test_cantilever(void** context) {
    (void)context;
    static const double poisson[] = {0.3, 0.45, 0.49};
    for (int k = 0; k < 3; ++k) {
        double plain = cantilever_ratio(4, poisson[k], OM_COROTATIONAL, false);
        double averaged = cantilever_ratio(4, poisson[k], OM_COROTATIONAL, true);
        double neo = cantilever_ratio(4, poisson[k], OM_STABLE_NEO_HOOKEAN, true);
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
