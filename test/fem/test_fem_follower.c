// test_fem_follower.c: pressure that follows a surface with a free rim, which has no energy: its tangent, the rate of
// Newton's method, and a bar that curls up, against a beam computed on its own.
#include "test_alloc.h"
#include "test_follower.h"

#include "fem/fem_solid.h"

// ---- tangent ----------------------------------------------------------------------------------------

// A = -df/dx of the pressure against central differences, on faces of three, four and six nodes; not symmetric.
static void test_tangent(void** context) {
    (void)context;
    const OmElement kind[] = {OM_TET4, OM_HEX8, OM_TET10};
    for (int c = 0; c < 3; ++c) {
        TestSolid t = {.material = {.young = 1e4, .poisson = 0.3, .law = OM_NEO_HOOKEAN}};
        solid_box(&t, kind[c], om_vec3(0, 0, 0), om_vec3(0.03, 0.02, 0.01), 2, 2, 1);
        solid_start(&t);
        solid_keep_faces(&t, 2, 0.01);
        OmFemPressure push = solid_pressure(&t, om_vec3(0, 0, 0), 500);
        t.load.pressure = &push;
        t.load.npressure = 1;
        size_t n = 3 * (size_t)t.mesh.nnode;
        OmRng rng = om_rng_init(5, 0);
        for (size_t i = 0; i < n; ++i) t.x[i] += om_rng_range(&rng, -1e-3, 1e-3);
        OmBsr A;
        assert_ok(om_fem_matrix_create(t.solid, &A));
        om__fem_add_follower(&t.load, t.x, 0.7, NULL, &A);
        double *up = om_alloc(n, sizeof *up), *down = om_alloc(n, sizeof *down);
        double worst = 0, largest = 0, skew = 0, step = 1e-6;
        for (int j = 0; j < (int)n; ++j) {
            double keep = t.x[j];
            memset(up, 0, n * sizeof *up);
            memset(down, 0, n * sizeof *down);
            t.x[j] = keep + step;
            om__fem_add_follower(&t.load, t.x, 0.7, up, NULL);
            t.x[j] = keep - step;
            om__fem_add_follower(&t.load, t.x, 0.7, down, NULL);
            t.x[j] = keep;
            for (int i = 0; i < (int)n; ++i) {
                double difference = -(up[i] - down[i]) / (2 * step), a = 0, b = 0;
                int k = om_bsr_find(&A, i / 3, j / 3), m = om_bsr_find(&A, j / 3, i / 3);
                if (k >= 0) a = A.exact[9 * k + 3 * (j % 3) + i % 3];
                if (m >= 0) b = A.exact[9 * m + 3 * (i % 3) + j % 3];
                worst = fmax(worst, fabs(a - difference));
                largest = fmax(largest, fabs(a));
                skew = fmax(skew, fabs(a - b));
            }
        }
        printf("follower tangent, %s: %.1e of the largest entry, skew part %.2f\n",
               om_element_name(kind[c]), worst / largest, skew / largest);
        assert_below(worst, 1e-8 * largest);  // forces are quadratic in x: rounding alone
        assert_true(skew > 0.1 * largest);
        om_bsr_destroy(&A);
        om_free(up);
        om_free(down);
        solid_done(&t);
    }
}

// ---- rate of Newton's method ------------------------------------------------------------------------

static void test_iterations(void** context) {
    (void)context;
    OmVec3 tip, other;
    for (int n = 4; n <= 16; n *= 2) {
        int num = curl_bar(n, OM_CHOLESKY, &tip);
        assert_true(num <= 48);  // six a step
    }
    int num = curl_bar(8, OM_MULTIGRID, &other);  // GMRES to 1e-3: no longer quadratic, as quick
    assert_true(num <= 56);
}

// With whole steps the residual of one load step falls as its square.
static void test_quadratic(void** context) {
    (void)context;
    TestSolid t = {.material = {.young = 1e5, .poisson = 0.3, .law = OM_NEO_HOOKEAN}};
    solid_box(&t, OM_HEX8, om_vec3(0, 0, 0), om_vec3(0.1, 0.02, 0.02), 4, 1, 1);
    solid_start(&t);
    solid_clamp(&t, 0, 0);
    solid_keep_faces(&t, 2, 0.02);
    OmFemPressure push = solid_pressure(&t, om_vec3(0, 0, 0), 200);
    t.load.pressure = &push;
    t.load.npressure = 1;
    solid_solve(&t, 1, 1e-9);
    const double* h = t.report.history;
    int last = t.report.nhistory - 1;
    while (last > 2 && h[last] < 1e-12) --last;  // rounding
    double order = log(h[last] / h[last - 1]) / log(h[last - 1] / h[last - 2]);
    printf("residuals %.1e, %.1e, %.1e N: order %.2f\n", h[last - 2], h[last - 1], h[last], order);
    assert_true(order > 1.8);
    solid_done(&t);
}

// ---- a beam that curls up ---------------------------------------------------------------------------

// Tip of an inextensible beam of length L and stiffness EI under q N/m that follows its normal (downward at rest),
// from the free end, where force and moment are zero, to the clamp. Loads and beam turn together, so the angle of the
// free end may be anything: all is turned back by the angle at the clamp. Runge and Kutta's method.
static void beam_rates(double q, double EI, const double s[6], double d[6]) {
    double c = cos(s[0]), n = sin(s[0]);
    d[0] = s[1] / EI;            // angle, by the moment (both along the way to the clamp)
    d[1] = s[3] * c - s[2] * n;  // moment, by the force across
    d[2] = -q * n;               // force: the load on what lies behind
    d[3] = q * c;
    d[4] = c;  // position
    d[5] = n;
}

static void beam_tip(double L, double q, double EI, double* x, double* z) {
    enum { STEPS = 2000 };
    double s[6] = {0}, k[4][6], mid[6], h = L / STEPS;
    const double part[4] = {0, 0.5, 0.5, 1};
    for (int i = 0; i < STEPS; ++i) {
        for (int m = 0; m < 4; ++m) {
            for (int c = 0; c < 6; ++c) mid[c] = s[c] + (m > 0 ? part[m] * h * k[m - 1][c] : 0);
            beam_rates(q, EI, mid, k[m]);
        }
        for (int c = 0; c < 6; ++c) s[c] += h / 6 * (k[0][c] + 2 * k[1][c] + 2 * k[2][c] + k[3][c]);
    }
    // from the clamp to the tip, the beam leaving the clamp along x
    double c = cos(s[0]), n = sin(s[0]);
    *x = c * s[4] + n * s[5];
    *z = fabs(c * s[5] - n * s[4]);
}

// A slender bar of quadratic tetrahedra, nu = 0: it differs from the beam by its thickness, shear and the law.
static void test_curled_beam(void** context) {
    (void)context;
    double L = 0.2, a = 0.005, young = 1e6, EI = young * a * a * a * a / 12;
    double pressure = 4 * EI / (L * L * L * a), x, z;
    TestSolid t = {.material = {.young = young, .poisson = 0, .law = OM_NEO_HOOKEAN}};
    solid_box(&t, OM_TET10, om_vec3(0, 0, -a / 2), om_vec3(L, a, a / 2), 40, 1, 1);
    solid_start(&t);
    solid_clamp(&t, 0, 0);
    solid_keep_faces(&t, 2, a / 2);
    OmFemPressure push = solid_pressure(&t, om_vec3(0, 0, 0), pressure);
    t.load.pressure = &push;
    t.load.npressure = 1;
    solid_solve(&t, 4, 1e-9);
    beam_tip(L, pressure * a, EI, &x, &z);
    OmVec3 tip = om_load3(t.x, solid_nearest(&t, om_vec3(L, a / 2, 0)));
    printf("curled bar: tip at (%.2f, %.2f) mm, beam (%.2f, %.2f) mm, %d iterations\n", 1e3 * tip.x,
           1e3 * tip.z, 1e3 * x, -1e3 * z, t.report.nnewton);
    assert_below(hypot(tip.x - x, tip.z + z), 0.01 * L);
    solid_done(&t);
}

// ---- where there is an energy -----------------------------------------------------------------------

// A plate whose rim is held: the skew parts cancel, the symmetric solver serves, and Newton's method is as quick.
static void test_held_rim(void** context) {
    (void)context;
    TestSolid t = {.material = {.young = 1e5, .poisson = 0.3, .law = OM_NEO_HOOKEAN}};
    solid_box(&t, OM_HEX8, om_vec3(0, 0, 0), om_vec3(0.1, 0.1, 0.01), 10, 10, 2);
    solid_start(&t);
    for (int axis = 0; axis < 2; ++axis)
        for (int side = 0; side < 2; ++side) solid_clamp(&t, axis, 0.1 * side);
    solid_keep_faces(&t, 2, 0);
    OmFemPressure push = solid_pressure(&t, om_vec3(0, 0, 0), 3000);
    t.load.pressure = &push;
    t.load.npressure = 1;
    solid_solve(&t, 2, 1e-9);
    OmVec3 u = solid_displacement(&t, solid_nearest(&t, om_vec3(0.05, 0.05, 0.005)));
    printf("plate with a held rim: rises %.2f mm, %d iterations\n", 1e3 * u.z, t.report.nnewton);
    assert_true(u.z > 0.005);
    assert_true(t.report.nnewton <= 16);
    solid_done(&t);
}

// ---- memory -----------------------------------------------------------------------------------------

typedef struct Small {
    OmFemMesh mesh;
    OmPreconditioner solver;
} Small;

static OmStatus small_bend(void* ctx) {
    const Small* small = ctx;
    OmMaterial material = {.young = 3000, .poisson = 0.3, .law = OM_NEO_HOOKEAN};
    OmFemDef def = om_fem_default_def(&small->mesh, 1, &material);
    OmFemSolid* solid;
    OmFemFaces faces;
    def.nworker = 1;
    OM_TRY(om_fem_create(&def, &solid));
    OmStatus status = om_fem_mesh_boundary(&small->mesh, &faces);
    unsigned char fixed[24] = {0};
    double x[24];
    memcpy(x, small->mesh.x, sizeof x);
    for (int i = 0; i < 12; ++i) fixed[i] = 1;  // the lower face
    for (int f = 0; status == OM_OK && f < faces.nface; ++f) {
        const int* node = faces.face_node + 4 * f;
        bool is_side = true;
        for (int a = 0; a < 4; ++a) is_side &= small->mesh.x[3 * node[a]] > 0.05;
        if (is_side) memmove(faces.face_node, node, 4 * sizeof *node);
    }
    if (status == OM_OK) {
        OmFemPressure push = {
            .nface = 1, .nface_node = 4, .face_node = faces.face_node, .pressure = 50};
        OmFemLoad load = {.fixed = fixed, .npressure = 1, .pressure = &push};
        OmFemStaticDef how = om_fem_static_default_def(solid);
        how.solver.preconditioner = small->solver;
        how.solver.nworker = 1;
        status = om_fem_static_solve(solid, &load, &how, x, NULL, NULL);
        om_fem_faces_done(&faces);
    }
    om_fem_destroy(solid);
    return status;
}

static void test_memory(void** context) {
    (void)context;
    Small small;
    const int num[3] = {1, 1, 1};
    assert_ok(om_fem_mesh_box(OM_HEX8, om_vec3(0, 0, 0), om_vec3(0.1, 0.1, 0.1), num, &small.mesh));
    small.solver = OM_CHOLESKY;
    assert_true(test_failing_allocations(small_bend, &small, 1) > 40);
    small.solver = OM_BLOCK_JACOBI;
    assert_true(test_failing_allocations(small_bend, &small, 1) > 40);
    om_fem_mesh_done(&small.mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_tangent),   cmocka_unit_test(test_iterations),
        cmocka_unit_test(test_quadratic), cmocka_unit_test(test_curled_beam),
        cmocka_unit_test(test_held_rim),  cmocka_unit_test(test_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
