// test_match_laplacian.c: Laplacians of surfaces and clouds against exact spectra and properties.
#include "match/match_shapes.h"
#include "omentum/match_spectral.h"
#include "test_alloc.h"

// ---- properties -------------------------------------------------------------------------------------

// Symmetric, rows sum to 0, nothing positive off the diagonal.
static void check_matrix(const OmLaplacian* L) {
    const OmCsr* A = &L->stiffness;
    double area = 0;
    for (int i = 0; i < A->n; ++i) {
        double sum = 0, diagonal = om_csr_get(A, i, i);
        for (int k = A->row_adr[i]; k < A->row_adr[i + 1]; ++k) {
            sum += A->value[k];
            assert_near(A->value[k], om_csr_get(A, A->col[k], i), 1e-14 * diagonal);
            if (A->col[k] != i) assert_true(A->value[k] <= 0);
        }
        assert_near(sum, 0, 1e-13 * diagonal);
        assert_true(L->area[i] >= 0);
        area += L->area[i];
    }
    assert_near_rel(area, L->total_area, 1e-12);
}

static double surface_area(const OmSurface* s) {
    double area = 0;
    for (int t = 0; t < s->ntri; ++t) {
        OmVec3 a = om_load3(s->x, s->tri_vert[3 * t]);
        OmVec3 u = om_sub(om_load3(s->x, s->tri_vert[3 * t + 1]), a);
        area += 0.5 * om_norm(om_cross(u, om_sub(om_load3(s->x, s->tri_vert[3 * t + 2]), a)));
    }
    return area;
}

static OmStatus laplacian_of(const OmSurface* s, OmLaplacian* L) {
    return om_laplacian_init(s->nvert, s->x, s->ntri, s->tri_vert, L);
}

// The cotangent formula from positions, edge by edge: what the Laplacian is where every triangle is acute.
static void acute_triangles_have_the_plain_cotangents(void** state) {
    (void)state;
    OmSurface s;
    OmLaplacian L;
    shape_sphere(2, &s);
    assert_ok(laplacian_of(&s, &L));
    check_matrix(&L);
    assert_int_equal(L.nflip, 0);
    double* D = om_calloc((size_t)(s.nvert * s.nvert), sizeof(double));
    double* area = om_calloc((size_t)s.nvert, sizeof(double));
    for (int h = 0; h < 3 * s.ntri; ++h) {
        int base = h / 3 * 3, i = s.tri_vert[h], j = s.tri_vert[base + (h + 1) % 3],
            k = s.tri_vert[base + (h + 2) % 3];
        OmVec3 u = om_sub(om_load3(s.x, i), om_load3(s.x, k));
        OmVec3 v = om_sub(om_load3(s.x, j), om_load3(s.x, k));
        double w = 0.5 * om_dot(u, v) / om_norm(om_cross(u, v));
        D[i * s.nvert + i] += w;
        D[j * s.nvert + j] += w;
        D[i * s.nvert + j] -= w;
        D[j * s.nvert + i] -= w;
        area[i] += om_norm(om_cross(u, v)) / 6;
    }
    for (int i = 0; i < s.nvert; ++i) {
        assert_near_rel(L.area[i], area[i], 1e-12);
        for (int j = 0; j < s.nvert; ++j)
            assert_near(om_csr_get(&L.stiffness, i, j), D[i * s.nvert + j], 1e-11);
    }
    om_free(D);
    om_free(area);
    om_laplacian_done(&L);
    om_surface_done(&s);
}

// A flat sheet of thin, slanted triangles: away from the border a linear function has no Laplacian, whatever flips.
static void flips_keep_linear_functions(void** state) {
    (void)state;
    enum { N = 24 };
    OmSurface s;
    OmLaplacian L;
    shape_sheet(1, 1, N, N, 0.2, 3, &s);
    for (int i = 0; i < s.nvert; ++i) s.x[3 * i] += 2.5 * s.x[3 * i + 1];  // a shear of 68 degrees
    assert_ok(laplacian_of(&s, &L));
    check_matrix(&L);
    assert_true(L.nflip > 500);
    assert_near_rel(L.total_area, surface_area(&s), 1e-12);
    assert_near(L.added, 0, 0);
    double* f = om_alloc((size_t)s.nvert, sizeof(double));
    double* y = om_alloc((size_t)s.nvert, sizeof(double));
    for (int i = 0; i < s.nvert; ++i) f[i] = 3 * s.x[3 * i] - 2 * s.x[3 * i + 1];
    om_csr_apply(&L.stiffness, f, y);
    int margin = 6;
    for (int j = margin; j <= N - margin; ++j)
        for (int i = margin; i <= N - margin; ++i) assert_near(y[i + (N + 1) * j], 0, 1e-11);
    om_free(f);
    om_free(y);
    om_laplacian_done(&L);
    om_surface_done(&s);
}

static void bad_triangles_are_defined(void** state) {
    (void)state;
    // a square of four triangles; then vertex 5 on an edge, 6 and 7 at one place, 8 unused
    const double x[27] = {0, 0,   0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0.5, 0.5,
                          0, 0.5, 0, 0, 0, 0, 1, 0, 0, 1, 9, 9, 9};
    const int v[39] = {0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4,  // the square
                       0, 1, 4,                             // one again
                       1, 0, 4,                             // and the other way round
                       0, 5, 1,                             // no area
                       2, 2, 3,                             // two equal vertices
                       0, 1, 6, 0, 7, 6, 0, 1, 7,  // equal places, four triangles at edge 0 1
                       3, 2, 4, 2, 3, 4};
    OmLaplacian L;
    assert_ok(om_laplacian_init(9, x, 13, v, &L));
    check_matrix(&L);
    assert_true(L.added > 0 && L.added < 1e-4);
    assert_near(L.area[8], 0, 0);
    assert_near(L.total_area, 1 + 4 * 0.25 + 2 * 0.5, 1e-2);
    // the shortest edge is `added`, a 1e-5th of the others: cotangents of 1e5
    for (int k = 0; k < L.stiffness.row_adr[9]; ++k) assert_below(fabs(L.stiffness.value[k]), 1e6);
    om_laplacian_done(&L);
    // what is refused
    const int outside[3] = {0, 1, 9}, flat[3] = {0, 5, 1}, one[3] = {2, 2, 2};
    double nan[27];
    memcpy(nan, x, sizeof x);
    nan[4] = NAN;
    assert_status(om_laplacian_init(9, x, 1, outside, &L), OM_INVALID);
    assert_status(om_laplacian_init(9, x, 1, flat, &L), OM_INVALID);
    assert_status(om_laplacian_init(9, x, 1, one, &L), OM_INVALID);
    assert_status(om_laplacian_init(9, nan, 4, v, &L), OM_INVALID);
    assert_status(om_laplacian_init(9, x, 0, v, &L), OM_INVALID);
    assert_status(om_laplacian_init_cloud(2, x, NULL, &L), OM_INVALID);
    assert_status(om_laplacian_init_cloud(9, nan, NULL, &L), OM_INVALID);
    const double line[9] = {0, 0, 0, 1, 0, 0, 2, 0, 0}, point[9] = {0};
    assert_status(om_laplacian_init_cloud(3, line, NULL, &L), OM_INVALID);
    assert_status(om_laplacian_init_cloud(3, point, NULL, &L), OM_INVALID);
}

// One triangle with an obtuse angle at 2. The long edge of its cover is flipped to a loop at 2, and the two others then
// lie between sides of one triangle: their weights are half the tangents of the angles at 0 and 1.
static void obtuse_triangle_is_flipped_within_its_cover(void** state) {
    (void)state;
    const double x[9] = {0, 0, 0, 4, 0, 0, 1, 0.5, 0};
    const int v[3] = {0, 1, 2};
    OmLaplacian L;
    assert_ok(om_laplacian_init(3, x, 1, v, &L));
    check_matrix(&L);
    assert_int_equal(L.nflip, 1);
    assert_near(om_csr_get(&L.stiffness, 0, 1), 0, 1e-12);
    assert_near(om_csr_get(&L.stiffness, 0, 2), -0.5 * 0.5 / 1, 1e-12);
    assert_near(om_csr_get(&L.stiffness, 1, 2), -0.5 * 0.5 / 3, 1e-12);
    assert_near(L.total_area, 1, 1e-12);
    om_laplacian_done(&L);
}

// Heaps of triangles between random points, many of them equal or on one line.
static void random_heaps_have_a_laplacian(void** state) {
    (void)state;
    for (uint64_t seed = 0; seed < 300; ++seed) {
        OmRng rng = om_rng_init(seed, 7);
        double x[36];
        int v[90], nvert = 4 + (int)om_rng_below(&rng, 9), ntri = 1 + (int)om_rng_below(&rng, 30);
        double scale = pow(10, om_rng_range(&rng, -4, 4));
        for (int i = 0; i < 3 * nvert; ++i)
            x[i] = scale * (seed % 2 ? om_rng_uniform(&rng) : floor(3 * om_rng_uniform(&rng)));
        for (int i = 0; i < 3 * ntri; ++i) v[i] = (int)om_rng_below(&rng, (uint32_t)nvert);
        OmLaplacian L;
        OmStatus status = om_laplacian_init(nvert, x, ntri, v, &L);
        if (status == OM_INVALID) continue;  // no triangle with an area
        assert_int_equal(status, OM_OK);
        check_matrix(&L);
        om_laplacian_done(&L);
    }
}

// ---- spectra ----------------------------------------------------------------------------------------

static double worst_error(const OmSpectralBasis* basis, const double* exact) {
    double worst = fabs(basis->eigenvalue[0]) / exact[1];
    for (int p = 1; p < basis->npair; ++p)
        worst = fmax(worst, fabs(basis->eigenvalue[p] / exact[p] - 1));
    return worst;
}

static double sphere_error(int level, int npair) {
    OmSurface s;
    OmSpectralBasis basis;
    double exact[64];
    for (int l = 0, p = 0; p < npair; ++l)
        for (int m = -l; m <= l && p < npair; ++m) exact[p++] = l * (l + 1);
    shape_sphere(level, &s);
    assert_ok(om_spectral_basis_init(&s, npair, &basis));
    double error = worst_error(&basis, exact);
    om_spectral_basis_done(&basis);
    om_surface_done(&s);
    return error;
}

static void sphere_has_its_exact_spectrum(void** state) {
    (void)state;
    double coarse = sphere_error(3, 25), fine = sphere_error(4, 25);
    print_message(
        "sphere, 25 eigenvalues l (l + 1): error %.4f with 642 vertices, %.4f with 2,562\n", coarse,
        fine);
    assert_below(fine, 0.008);
    assert_near(log2(coarse / fine), 2, 0.1);  // the order, edges being halved
}

// pi^2 (m^2 / w^2 + n^2 / h^2), ascending
static void rectangle_spectrum(double w, double h, int npair, double* exact) {
    double all[900];
    for (int m = 0; m < 30; ++m)
        for (int n = 0; n < 30; ++n)
            all[30 * m + n] = PI * PI * (m * m / (w * w) + n * n / (h * h));
    om_sort_doubles(all, 900);
    memcpy(exact, all, (size_t)npair * sizeof *exact);
}

static double square_error(int n) {
    OmSurface s;
    OmSpectralBasis basis;
    double exact[30];
    rectangle_spectrum(1, 1, 30, exact);
    shape_sheet(1, 1, n, n, 0.25, 5, &s);
    assert_ok(om_spectral_basis_init(&s, 30, &basis));
    assert_near_rel(basis.total_area, 1, 1e-9);
    double error = worst_error(&basis, exact);
    om_spectral_basis_done(&basis);
    om_surface_done(&s);
    return error;
}

static void open_square_has_its_exact_spectrum(void** state) {
    (void)state;
    double coarse = square_error(16), fine = square_error(32);
    print_message(
        "square, 30 eigenvalues pi^2 (m^2 + n^2): error %.4f with 289 vertices, %.4f with 1,089\n",
        coarse, fine);
    assert_below(fine, 0.04);
    assert_near(log2(coarse / fine), 2, 0.25);
}

// Three unit squares at one common edge: functions that are 0 there come twice, at (m + 1/2) pi, the others once.
static void three_sheets_at_an_edge_have_their_exact_spectrum(void** state) {
    (void)state;
    enum { N = 20, K = 24, SHEET = N * (N + 1), NVERT = (N + 1) + 3 * SHEET };
    OmSurface s;
    assert_ok(om_surface_init(&s, NVERT, 3 * 2 * N * N));
    for (int j = 0; j <= N; ++j) om_store3(s.x, j, om_vec3(0, 0, j / (double)N));
    int t = 0;
    for (int p = 0; p < 3; ++p) {
        double c = cos(2 * PI * p / 3), w = sin(2 * PI * p / 3);
        for (int i = 1; i <= N; ++i)
            for (int j = 0; j <= N; ++j)
                om_store3(s.x, (N + 1) + p * SHEET + (i - 1) * (N + 1) + j,
                          om_vec3(c * i / N, w * i / N, j / (double)N));
        for (int i = 0; i < N; ++i)
            for (int j = 0; j < N; ++j) {
                int a = i == 0 ? j : (N + 1) + p * SHEET + (i - 1) * (N + 1) + j;
                int d = (N + 1) + p * SHEET + i * (N + 1) + j;
                const int v[6] = {a, d, a + 1, d, d + 1, a + 1};
                memcpy(s.tri_vert + 3 * t, v, sizeof v);
                t += 2;
            }
    }
    double all[3 * 400], exact[K];
    int num = 0;
    for (int m = 0; m < 20; ++m)
        for (int n = 0; n < 20; ++n) {
            all[num++] = PI * PI * (m * m + n * n);
            all[num++] = PI * PI * ((m + 0.5) * (m + 0.5) + n * n);
            all[num++] = PI * PI * ((m + 0.5) * (m + 0.5) + n * n);
        }
    om_sort_doubles(all, num);
    memcpy(exact, all, sizeof exact);
    OmSpectralBasis basis;
    assert_ok(om_spectral_basis_init(&s, K, &basis));
    double error = worst_error(&basis, exact);
    print_message("three squares at an edge, %d eigenvalues: error %.4f\n", K, error);
    assert_below(error, 0.02);
    om_spectral_basis_done(&basis);
    om_surface_done(&s);
}

// ---- clouds -----------------------------------------------------------------------------------------

static void sphere_cloud_has_nearly_the_exact_spectrum(void** state) {
    (void)state;
    enum { N = 2000, K = 16 };
    double* x = om_alloc(3 * N, sizeof(double));
    OmRng rng = om_rng_init(4, 0);
    for (int i = 0; i < N; ++i) {  // Fibonacci's points, each moved by a part of their distance
        double z = 1 - (2 * i + 1.0) / N, r = sqrt(1 - z * z), a = i * PI * (3 - sqrt(5));
        OmVec3 p = om_vec3(r * cos(a), r * sin(a), z);
        for (int c = 0; c < 3; ++c) (&p.x)[c] += om_rng_range(&rng, -0.01, 0.01);
        om_store3(x, i, om_normalize(p));
    }
    OmScan scan = {.npoint = N, .x = x};
    OmSpectralBasis basis;
    double exact[K], given;
    for (int l = 0, p = 0; p < K; ++l)
        for (int m = -l; m <= l && p < K; ++m) exact[p++] = l * (l + 1);
    scan.normal = x;  // the normals of the unit sphere
    assert_ok(om_spectral_basis_init_scan(&scan, K, &basis));
    given = worst_error(&basis, exact);
    assert_near_rel(basis.total_area, 4 * PI, 0.01);
    om_spectral_basis_done(&basis);
    scan.normal = NULL;
    assert_ok(om_spectral_basis_init_scan(&scan, K, &basis));
    double found = worst_error(&basis, exact);
    print_message(
        "cloud of 2,000 points of the sphere, %d eigenvalues: error %.4f, %.4f without normals\n",
        K, given, found);
    assert_below(given, 0.02);
    assert_below(found, 0.02);
    om_spectral_basis_done(&basis);
    om_free(x);
}

static void square_cloud_has_nearly_the_exact_spectrum(void** state) {
    (void)state;
    enum { K = 20 };
    OmSurface s;
    OmLaplacian L;
    OmSpectralBasis basis;
    double exact[K];
    rectangle_spectrum(1, 1, K, exact);
    shape_sheet(1, 1, 30, 30, 0.3, 8, &s);
    assert_ok(om_laplacian_init_cloud(s.nvert, s.x, NULL, &L));
    check_matrix(&L);
    assert_near_rel(L.total_area, 1, 0.01);
    om_laplacian_done(&L);
    OmScan scan = {.npoint = s.nvert, .x = s.x};
    assert_ok(om_spectral_basis_init_scan(&scan, K, &basis));
    double error = worst_error(&basis, exact);
    print_message("cloud of 961 points of the square, %d eigenvalues: error %.4f\n", K, error);
    assert_below(error, 0.03);
    om_spectral_basis_done(&basis);
    om_surface_done(&s);
}

static OmStatus cloud_once(void* ctx) {
    const OmSurface* s = ctx;
    OmLaplacian L;
    OM_TRY(om_laplacian_init_cloud(s->nvert, s->x, NULL, &L));
    om_laplacian_done(&L);
    OM_TRY(laplacian_of(s, &L));
    om_laplacian_done(&L);
    return OM_OK;
}

static void every_failing_allocation_is_told(void** state) {
    (void)state;
    OmSurface s;
    shape_sheet(1, 1, 5, 5, 0.2, 1, &s);
    assert_true(test_failing_allocations(cloud_once, &s, 1) >= 20);
    om_surface_done(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(acute_triangles_have_the_plain_cotangents),
        cmocka_unit_test(flips_keep_linear_functions),
        cmocka_unit_test(bad_triangles_are_defined),
        cmocka_unit_test(obtuse_triangle_is_flipped_within_its_cover),
        cmocka_unit_test(random_heaps_have_a_laplacian),
        cmocka_unit_test(sphere_has_its_exact_spectrum),
        cmocka_unit_test(open_square_has_its_exact_spectrum),
        cmocka_unit_test(three_sheets_at_an_edge_have_their_exact_spectrum),
        cmocka_unit_test(sphere_cloud_has_nearly_the_exact_spectrum),
        cmocka_unit_test(square_cloud_has_nearly_the_exact_spectrum),
        cmocka_unit_test(every_failing_allocation_is_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
