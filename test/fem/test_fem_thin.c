// test_fem_thin.c: plates of quadratic tetrahedra, one layer, against exact solutions. The element is that of om_fem
// below a Poisson's ratio of 1/3 (test_fem_quadratic.c holds the engine to it), which can prescribe single directions.
#include "test_common.h"

#include "omentum/fem.h"
#include "omentum/solve_eigen.h"

#define SIDE 0.1
#define YOUNG 1e6
#define POISSON 0.3
#define PRESSURE 1e-3  // Pa, small: the law is linear

// Deflection in the middle of a square plate whose lateral faces are hard supported: there w and the displacement along
// the side are zero. A quarter of it, of n x n cells and one layer.
static double supported_plate(double thickness, int n) {
    OmFemMesh mesh;
    const int num[3] = {n, n, 1};
    double half = SIDE / 2;
    assert_ok(
        om_fem_mesh_box(OM_TET10, om_vec3(0, 0, 0), om_vec3(half, half, thickness), num, &mesh));
    OmMaterial material = {.young = YOUNG, .poisson = POISSON, .law = OM_LINEAR};
    OmFemDef def = om_fem_default_def(&mesh, 1, &material);
    OmFemSolid* solid;
    def.nworker = 1;
    assert_ok(om_fem_create(&def, &solid));
    size_t n3 = 3 * (size_t)mesh.nnode;
    unsigned char* fixed = om_calloc(n3, 1);
    double* x = om_alloc(n3, sizeof *x);
    int middle = -1;
    for (int i = 0; i < mesh.nnode; ++i) {
        OmVec3 p = om_load3(mesh.x, i);
        bool at_x = p.x<1e-9, at_y = p.y<1e-9, on_x = p.x> half - 1e-9, on_y = p.y> half - 1e-9;
        fixed[3 * i] = at_y || on_x;  // along the side, or in the plane of symmetry
        fixed[3 * i + 1] = at_x || on_y;
        fixed[3 * i + 2] = at_x || at_y;
        if (on_x && on_y && fabs(p.z - thickness / 2) < 1e-9) middle = i;
    }
    assert_true(middle >= 0);
    // the pressure as body force: its work is the same on a field that is constant through the thickness
    OmFemLoad load = {.body = {0, 0, -PRESSURE / thickness / 1000}, .fixed = fixed};
    OmFemStaticDef how = om_fem_static_default_def(solid);
    how.tolerance = 1e-7;
    how.solver.preconditioner = OM_CHOLESKY;
    memcpy(x, mesh.x, n3 * sizeof *x);
    if (om_fem_static_solve(solid, &load, &how, x, NULL, NULL) != OM_OK)
        fail_msg("%s", om_error_message());
    double w = mesh.x[3 * middle + 2] - x[3 * middle + 2];
    om_free(fixed), om_free(x);
    om_fem_destroy(solid);
    om_fem_mesh_done(&mesh);
    return w;
}

// Navier's series for Kirchhoff's plate, and what shear adds in Mindlin's: the same series over k G t (Marcus's theorem
// for hard supports).
static double exact_plate(double thickness, bool has_shear) {
    double D = YOUNG * pow(thickness, 3) / (12 * (1 - POISSON * POISSON)),
           shear = 5.0 / 6 * YOUNG / (2 * (1 + POISSON)) * thickness, w = 0;
    for (int m = 1; m < 80; m += 2)
        for (int n = 1; n < 80; n += 2) {
            double sign = (m + n) % 4 == 2 ? 1 : -1,
                   s = OM_PI * OM_PI * (m * m + n * n) / (SIDE * SIDE);
            double q = 16 * PRESSURE / (OM_PI * OM_PI * m * n);
            w += sign * q * (1 / (D * s * s) + (has_shear ? 1 / (shear * s) : 0));
        }
    return w;
}

static void test_supported_plate(void** context) {
    (void)context;
    static const double thickness[2] = {SIDE / 20, SIDE / 100};
    for (int k = 0; k < 2; ++k)
        for (int n = 5; n <= (test_is_slow() ? 20 : 10); n *= 2) {
            double exact = exact_plate(thickness[k], k == 0), w = supported_plate(thickness[k], n);
            printf("plate, thickness 1/%.0f of the side, cells of %.1f mm: %+.2f %%\n",
                   SIDE / thickness[k], 500 * SIDE / n, 100 * (w / exact - 1));
            if (n >= 10 || k == 0) assert_near_rel(w, exact, n < 20 ? 0.03 : 0.005);
        }
}

// ---- frequencies --------------------------------------------------------------------------------------

#define NMODE 12  // six rigid motions and six shapes

// Squared angular frequencies of a free body with lumped masses, ascending.
static void free_modes(OmVec3 size, const int num[3], double lambda[NMODE]) {
    OmFemMesh mesh;
    assert_ok(om_fem_mesh_box(OM_TET10, om_vec3(0, 0, 0), size, num, &mesh));
    OmMaterial material = {.young = YOUNG, .poisson = POISSON, .law = OM_LINEAR};
    OmFemDef def = om_fem_default_def(&mesh, 1, &material);
    OmFemSolid* solid;
    def.nworker = 1;
    assert_ok(om_fem_create(&def, &solid));
    OmBsr K;
    assert_ok(om_fem_matrix_create(solid, &K));
    assert_ok(om_fem_eval_tangent(solid, mesh.x, &K));
    int n = 3 * mesh.nnode, *row = om_alloc(9 * (size_t)K.nblock, sizeof *row),
        *col = om_alloc(9 * (size_t)K.nblock, sizeof *col), at = 0;
    double *value = om_alloc(9 * (size_t)K.nblock, sizeof *value),
           *mass = om_alloc((size_t)n, sizeof *mass);
    for (int i = 0; i < mesh.nnode; ++i)
        for (int k = K.row_adr[i]; k < K.row_adr[i + 1]; ++k)
            for (int c = 0; c < 9; ++c, ++at) {
                row[at] = 3 * i + c % 3;
                col[at] = 3 * K.col[k] + c / 3;
                value[at] = K.exact[9 * k + c];
            }
    for (int i = 0; i < n; ++i) mass[i] = om_fem_mass(solid)[i / 3];
    OmCsr A, B;
    assert_ok(om_csr_init(n, at, row, col, value, &A));
    assert_ok(om_csr_init_diagonal(n, mass, &B));
    double* shape = om_alloc((size_t)NMODE * (size_t)n, sizeof *shape);
    OmEigenDef how = om_eigen_default_def(NMODE, -1);
    if (om_eigen_smallest(&how, &A, &B, lambda, shape, NULL) != OM_OK)
        fail_msg("%s", om_error_message());
    om_csr_done(&A), om_csr_done(&B);
    om_free(row), om_free(col), om_free(value), om_free(mass), om_free(shape);
    om_bsr_destroy(&K);
    om_fem_destroy(solid);
    om_fem_mesh_done(&mesh);
}

// A free square plate of 100 x 100 x 2.5 mm in cells of 5 mm: exactly six rigid motions, then the frequencies of
// Leissa's thin plate, nu = 0.3 (Leissa 1973, "The free vibration of rectangular plates", a^2 omega sqrt(rho t / D));
// shear, which he leaves out, takes 1 %.
static void test_free_plate(void** context) {
    (void)context;
    static const double leissa[6] = {13.489, 19.789, 24.432, 35.024, 35.024, 61.526};
    double thickness = SIDE / 40, lambda[NMODE];
    const int n = test_is_slow() ? 20 : 10, num[3] = {n, n, 1};
    free_modes(om_vec3(SIDE, SIDE, thickness), num, lambda);
    double D = YOUNG * pow(thickness, 3) / (12 * (1 - POISSON * POISSON)),
           unit = sqrt(D / (1000 * thickness)) / (SIDE * SIDE);
    for (int k = 0; k < 6; ++k) assert_near(lambda[k], 0, 1e-5 * lambda[6]);
    for (int k = 0; k < 6; ++k) {
        double omega = sqrt(lambda[6 + k]) / unit;
        printf("free plate, cells of %g mm, shape %d: %.3f, thin plate %.3f (%+.1f %%)\n",
               1e3 * SIDE / n, k + 1, omega, leissa[k], 100 * (omega / leissa[k] - 1));
        assert_near_rel(omega, leissa[k], 0.03);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_supported_plate),
                                       cmocka_unit_test(test_free_plate)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
