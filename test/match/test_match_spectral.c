// test_match_spectral.c: functional maps on sheets whose true correspondence is known.
#include "match/match_shapes.h"
#include "match/match_spectral_internal.h"
#include "test_alloc.h"

// A sheet of 60 x 36 mm, which is rolled into an arc without stretching: b has other triangles than a. If has_cut, its
// right upper corner is cut off, so that no symmetry is left. The material point of b's vertex i is flat[3 i].
typedef struct Case {
    OmSurface a, b;
    double* flat;
    OmSpectralBasis basis_a, basis_b;
    int* map;
} Case;

static bool is_cut(OmVec3 p) { return p.x + 1.5 * p.y > 0.09; }

static void cut_corner(OmSurface* s) {
    int num = 0;
    for (int t = 0; t < s->ntri; ++t) {
        const int* v = s->tri_vert + 3 * t;
        bool is_out = false;
        for (int k = 0; k < 3; ++k) is_out = is_out || is_cut(om_load3(s->x, v[k]));
        if (!is_out) memmove(s->tri_vert + 3 * num++, v, 3 * sizeof *v);
    }
    s->ntri = num;
}

static void make_case(int nx, double share, bool has_cut, Case* c) {
    memset(c, 0, sizeof *c);
    shape_sheet(0.06, 0.036, 40, 24, 0.2, 1, &c->a);
    shape_sheet(0.06 * share, 0.036, nx, 22, 0.25, 2, &c->b);
    if (has_cut) cut_corner(&c->a);
    if (has_cut) cut_corner(&c->b);
    size_t n = (size_t)c->b.nvert;
    c->flat = om_alloc(3 * n, sizeof(double));
    c->map = om_alloc(n, sizeof(int));
    memcpy(c->flat, c->b.x, 3 * n * sizeof(double));
    double radius = 0.02;
    for (size_t i = 0; i < n; ++i) {
        double angle = c->b.x[3 * i] / radius;
        c->b.x[3 * i] = radius * sin(angle);
        c->b.x[3 * i + 2] = radius * (1 - cos(angle));
    }
}
static void case_done(Case* c) {
    om_surface_done(&c->a);
    om_surface_done(&c->b);
    om_spectral_basis_done(&c->basis_a);
    om_spectral_basis_done(&c->basis_b);
    om_free(c->flat);
    om_free(c->map);
}

// Mean distance from the material point of b's vertices to that of their partners in a, mm.
static double map_error(const Case* c) {
    double sum = 0;
    int num = 0;
    for (int i = 0; i < c->b.nvert; ++i) {
        if (c->basis_b.row[i] < 0) continue;
        assert_in_range(c->map[i], 0, c->a.nvert - 1);
        sum += om_distance(om_load3(c->flat, i), om_load3(c->a.x, c->map[i]));
        ++num;
    }
    return 1e3 * sum / num;
}

// The nearest material point, and the same moved by noise of 6 mm.
static void disturb_map(Case* c, double noise) {
    OmRng rng = om_rng_init(9, 0);
    double* x = om_alloc(3 * (size_t)c->b.nvert, sizeof(double));
    for (int i = 0; i < c->b.nvert; ++i) {
        OmVec3 p = om_load3(c->flat, i);
        p.x += noise * om_rng_normal(&rng);
        p.y += noise * om_rng_normal(&rng);
        om_store3(x, i, p);
    }
    assert_ok(om_spectral_map_from_nearest(&c->basis_a, c->a.x, &c->basis_b, x, c->map));
    om_free(x);
}

// Mean distance from the material point of b's vertices to the points on a's triangles, mm.
static double surface_error(const Case* c, const OmSpectralDef* def) {
    int* tri = om_alloc((size_t)c->b.nvert, sizeof(int));
    double* bary = om_alloc(3 * (size_t)c->b.nvert, sizeof(double));
    double sum = 0;
    int num = 0;
    assert_ok(om_spectral_map_to_surface(def, &c->basis_a, &c->a, &c->basis_b, c->map, tri, bary));
    for (int i = 0; i < c->b.nvert; ++i) {
        if (c->basis_b.row[i] < 0) {
            assert_int_equal(tri[i], -1);
            continue;
        }
        OmVec3 p = om_vec3(0, 0, 0);
        double total = 0;
        assert_in_range(tri[i], 0, c->a.ntri - 1);
        for (int k = 0; k < 3; ++k) {
            p = om_madd(p, bary[3 * i + k], om_load3(c->a.x, c->a.tri_vert[3 * tri[i] + k]));
            total += bary[3 * i + k];
            assert_true(bary[3 * i + k] >= -1e-12);
        }
        assert_near(total, 1, 1e-12);
        sum += om_distance(om_load3(c->flat, i), p);
        ++num;
    }
    om_free(tri);
    om_free(bary);
    return 1e3 * sum / num;
}

static void zoomout_finds_the_rolled_sheet(void** state) {
    (void)state;
    Case c;
    OmSpectralReport report;
    make_case(37, 1, true, &c);
    assert_ok(om_spectral_basis_init(&c.a, 60, &c.basis_a));
    assert_ok(om_spectral_basis_init(&c.b, 60, &c.basis_b));
    disturb_map(&c, 0.006);
    double before = map_error(&c);
    OmSpectralDef def = om_spectral_default_def();
    assert_ok(om_spectral_zoomout(&def, &c.basis_a, &c.basis_b, c.map, &report));
    double after = map_error(&c);
    double smooth = surface_error(&c, &def);
    print_message("rolled sheet: mean error %.2f mm before, %.2f mm after, %.2f mm on triangles; "
                  "vertices 1.5 mm apart\n",
                  before, after, smooth);
    assert_below(smooth, 0.33);
    assert_true(before > 5);
    assert_below(after, 1);
    assert_int_equal(report.nround, 11);
    assert_int_equal(report.npair_a, 60);
    assert_below(report.orthogonality, 0.15);
    case_done(&c);
}

static void zoomout_finds_a_part_of_the_sheet(void** state) {
    (void)state;
    Case c;
    OmSpectralReport report;
    make_case(20, 0.55, true, &c);
    assert_ok(om_spectral_basis_init(&c.a, 120, &c.basis_a));
    assert_ok(om_spectral_basis_init(&c.b, 40, &c.basis_b));
    disturb_map(&c, 0.006);
    double before = map_error(&c);
    OmSpectralDef def = om_spectral_default_def();
    def.last = 40;
    assert_ok(om_spectral_zoomout(&def, &c.basis_a, &c.basis_b, c.map, NULL));
    double whole = map_error(&c);
    disturb_map(&c, 0.006);
    def.is_partial = true;
    assert_ok(om_spectral_zoomout(&def, &c.basis_a, &c.basis_b, c.map, &report));
    double slanted = map_error(&c);
    // the part itself as the model: what a twin predicts to be visible
    unsigned char* is_seen = om_alloc((size_t)c.a.nvert, 1);
    for (int i = 0; i < c.a.nvert; ++i) is_seen[i] = c.a.x[3 * i] <= 0.034;
    om_spectral_basis_done(&c.basis_a);
    assert_ok(om_spectral_basis_init_part(&c.a, is_seen, 40, &c.basis_a));
    disturb_map(&c, 0.006);
    def.is_partial = false;
    assert_ok(om_spectral_zoomout(&def, &c.basis_a, &c.basis_b, c.map, NULL));
    double part = map_error(&c);
    for (int i = 0; i < c.b.nvert; ++i) assert_true(c.basis_b.row[i] < 0 || is_seen[c.map[i]]);
    print_message(
        "55 %% of the sheet: mean error %.2f mm before, %.2f after; %.2f with a slanted matrix "
        "of %d x %d; %.2f against the part\n",
        before, whole, slanted, report.npair_b, report.npair_a, part);
    assert_true(report.npair_a > 1.4 * report.npair_b && report.npair_a < 2.2 * report.npair_b);
    assert_below(slanted, 1.5);
    assert_below(part, 1.5);
    assert_below(slanted, 0.5 * whole);
    om_free(is_seen);
    case_done(&c);
}

static void landmarks_give_a_first_map(void** state) {
    (void)state;
    Case c;
    make_case(37, 1, false, &c);
    assert_ok(om_spectral_basis_init(&c.a, 60, &c.basis_a));
    assert_ok(om_spectral_basis_init(&c.b, 60, &c.basis_b));
    disturb_map(&c, 0);
    const int mark_b[4] = {5, 250, 500, 600};
    int mark_a[4];
    for (int k = 0; k < 4; ++k) mark_a[k] = c.map[mark_b[k]];
    assert_ok(om_spectral_map_from_landmarks(&c.basis_a, &c.basis_b, 15, 4, mark_a, mark_b, c.map));
    double before = map_error(&c);
    OmSpectralDef def = om_spectral_default_def();
    assert_ok(om_spectral_zoomout(&def, &c.basis_a, &c.basis_b, c.map, NULL));
    double after = map_error(&c);
    assert_ok(om_spectral_map_from_landmarks(&c.basis_a, &c.basis_b, 15, 0, NULL, NULL, c.map));
    double none = map_error(&c);
    print_message(
        "rectangle, four landmarks: mean error %.2f mm, after ZoomOut %.2f; without %.2f\n", before,
        after, none);
    assert_below(before, 3);
    assert_below(after, 1);
    assert_true(none > 10);  // a rectangle lies on itself in four ways
    const int outside[4] = {0, 1, c.a.nvert, 2};
    assert_status(
        om_spectral_map_from_landmarks(&c.basis_a, &c.basis_b, 15, 4, outside, mark_b, c.map),
        OM_INVALID);
    assert_status(
        om_spectral_map_from_landmarks(&c.basis_a, &c.basis_b, 61, 4, mark_a, mark_b, c.map),
        OM_INVALID);
    case_done(&c);
}

// A basis of 80 functions beside one of 60 gives the map of 60 beside 60.
static void landmarks_need_no_bases_of_one_size(void** state) {
    (void)state;
    Case c;
    OmSpectralBasis more = {0};
    make_case(37, 1, true, &c);
    assert_ok(om_spectral_basis_init(&c.b, 60, &c.basis_a));
    assert_ok(om_spectral_basis_init(&c.b, 60, &c.basis_b));
    assert_ok(om_spectral_basis_init(&c.b, 80, &more));
    const int mark[3] = {5, 250, 500};
    int same = 0, *map = om_alloc((size_t)c.b.nvert, sizeof *map);
    assert_non_null(map);
    assert_ok(om_spectral_map_from_landmarks(&c.basis_a, &c.basis_b, 15, 3, mark, mark, c.map));
    assert_ok(om_spectral_map_from_landmarks(&more, &c.basis_b, 15, 3, mark, mark, map));
    for (int i = 0; i < c.b.nvert; ++i) same += map[i] == c.map[i];
    print_message("bases of 80 and 60 functions: %d of %d points as with 60\n", same, c.b.nvert);
    assert_true(same >= 0.99 * c.b.nvert);  // eigenvectors to the tolerance of ARPACK
    om_free(map);
    om_spectral_basis_done(&more);
    case_done(&c);
}

// Of the identity the matrix is the identity; of a map that is known in part, nearly.
static void identity_has_the_identity_matrix(void** state) {
    (void)state;
    enum { K = 12 };
    Case c;
    double C[K * K];
    make_case(37, 1, true, &c);
    assert_ok(om_spectral_basis_init(&c.b, 20, &c.basis_a));
    assert_ok(om_spectral_basis_init(&c.b, 20, &c.basis_b));
    for (int i = 0; i < c.b.nvert; ++i) c.map[i] = i;
    for (int turn = 0; turn < 2; ++turn) {
        for (int i = 0; i < c.b.nvert && turn == 1; i += 3) c.map[i] = -1;
        assert_ok(om_spectral_get_matrix(&c.basis_a, &c.basis_b, c.map, K, K, C));
        for (int i = 0; i < K * K; ++i) assert_near(C[i], i / K == i % K, turn == 0 ? 1e-9 : 1e-4);
    }
    OmSpectralDef def = om_spectral_default_def();
    assert_ok(om_spectral_map_from_matrix(&def, &c.basis_a, &c.basis_b, K, K, C, c.map));
    for (int i = 0; i < c.b.nvert; ++i) assert_int_equal(c.map[i], c.basis_b.row[i] < 0 ? -1 : i);
    case_done(&c);
}

static void neighbours_are_those_of_a_plain_search(void** state) {
    (void)state;
    enum { NA = 301, NB = 77, K = 45, STRIDE = 50 };
    double* a = om_alloc(NA * K, sizeof(double));
    double* b = om_alloc(NB * STRIDE, sizeof(double));
    int nearest[NB], again[NB];
    OmRng rng = om_rng_init(2, 0);
    for (int i = 0; i < NA * K; ++i) a[i] = om_rng_normal(&rng);
    for (int i = 0; i < NB * STRIDE; ++i) b[i] = om_rng_normal(&rng);
    memcpy(a + 300 * K, a + 20 * K, K * sizeof *a);  // equal rows: the first counts
    memcpy(b + 5 * STRIDE, a + 20 * K, K * sizeof *a);
    assert_ok(om__nearest_rows(NA, a, NB, b, STRIDE, K, 1, nearest));
    for (int j = 0; j < NB; ++j) {
        int best = 0;
        double smallest = INFINITY;
        for (int i = 0; i < NA; ++i) {
            double d = 0;
            for (int k = 0; k < K; ++k) d += pow(a[i * K + k] - b[j * STRIDE + k], 2);
            if (d >= smallest) continue;
            smallest = d;
            best = i;
        }
        assert_int_equal(nearest[j], best);
    }
    assert_int_equal(nearest[5], 20);
    for (int nworker = 2; nworker <= 8; nworker *= 2) {
        assert_ok(om__nearest_rows(NA, a, NB, b, STRIDE, K, nworker, again));
        assert_memory_equal(nearest, again, sizeof nearest);
    }
    om_free(a);
    om_free(b);
}

// Squared distance in spectral space from row j of b to a point of a triangle of a; C (k x k) by rows.
static double spectral_distance(const Case* c, const double* C, int k, int j, const int* corner,
                                const double* bary) {
    double sum = 0;
    for (int p = 0; p < k; ++p) {
        double at = 0;
        for (int v = 0; v < 3; ++v)
            for (int q = 0; q < k; ++q)
                at += bary[v] * C[p * k + q] *
                      c->basis_a.phi[c->basis_a.row[corner[v]] * c->basis_a.npair + q];
        sum += pow(at - c->basis_b.phi[j * c->basis_b.npair + p], 2);
    }
    return sum;
}

static void points_are_the_nearest_of_a_plain_search(void** state) {
    (void)state;
    enum { K = 10, GRID = 80 };
    Case c;
    double C[K * K];
    make_case(20, 1, true, &c);
    assert_ok(om_spectral_basis_init(&c.a, K, &c.basis_a));
    assert_ok(om_spectral_basis_init(&c.b, K, &c.basis_b));
    disturb_map(&c, 0.002);
    OmSpectralDef def = om_spectral_default_def();
    def.first = 5;
    def.last = K;
    int* tri = om_alloc((size_t)c.b.nvert, sizeof(int));
    double* bary = om_alloc(3 * (size_t)c.b.nvert, sizeof(double));
    assert_ok(om_spectral_get_matrix(&c.basis_a, &c.basis_b, c.map, K, K, C));
    assert_ok(om_spectral_map_to_surface(&def, &c.basis_a, &c.a, &c.basis_b, c.map, tri, bary));
    for (int j = 3; j < c.basis_b.nrow; j += 40) {
        int i = c.basis_b.vert[j];
        const int* t = c.a.tri_vert;
        double found = spectral_distance(&c, C, K, j, t + 3 * tri[i], bary + 3 * i), best = 1e300;
        for (int n = 0; n < c.a.ntri; ++n, t += 3) {
            if (t[0] != c.map[i] && t[1] != c.map[i] && t[2] != c.map[i]) continue;
            for (int u = 0; u <= GRID; ++u)
                for (int v = 0; u + v <= GRID; ++v) {
                    const double w[3] = {u / (double)GRID, v / (double)GRID,
                                         (GRID - u - v) / (double)GRID};
                    best = fmin(best, spectral_distance(&c, C, K, j, t, w));
                }
        }
        assert_true(found <= best + 1e-12);
        assert_near_rel(found, best, 0.02);  // the grid is fine
    }
    om_free(tri);
    om_free(bary);
    case_done(&c);
}

static void map_does_not_depend_on_the_workers(void** state) {
    (void)state;
    Case c;
    make_case(37, 1, true, &c);
    assert_ok(om_spectral_basis_init(&c.a, 60, &c.basis_a));
    assert_ok(om_spectral_basis_init(&c.b, 60, &c.basis_b));
    size_t n = (size_t)c.b.nvert;
    int* first = om_alloc(3 * n, sizeof(int));
    double* bary = om_alloc(6 * n, sizeof(double));
    for (int nworker = 1; nworker <= 8; nworker *= 2) {
        OmSpectralDef def = om_spectral_default_def();
        def.nworker = nworker;
        disturb_map(&c, 0.006);
        assert_ok(om_spectral_zoomout(&def, &c.basis_a, &c.basis_b, c.map, NULL));
        if (nworker == 1) memcpy(first, c.map, (size_t)c.b.nvert * sizeof(int));
        assert_memory_equal(first, c.map, (size_t)c.b.nvert * sizeof(int));
        int k = nworker > 1;
        assert_ok(om_spectral_map_to_surface(&def, &c.basis_a, &c.a, &c.basis_b, c.map,
                                             first + (size_t)(1 + k) * n,
                                             bary + (size_t)k * 3 * n));
        if (k == 0) continue;
        assert_memory_equal(first + n, first + 2 * n, n * sizeof(int));
        assert_memory_equal(bary, bary + 3 * n, 3 * n * sizeof(double));
    }
    om_free(first);
    om_free(bary);
    case_done(&c);
}

// A sheet with 40 crumbs beside it: without their rows one eigenvalue is 0; of a surface every piece counts.
static void crumbs_of_a_scan_have_no_row(void** state) {
    (void)state;
    enum { CRUMBS = 40, K = 60 };
    OmSurface sheet;
    OmScan scan;
    OmSpectralBasis whole, with;
    shape_sheet(0.06, 0.036, 25, 15, 0.2, 1, &sheet);
    assert_ok(om_scan_init(sheet.nvert + 3 * CRUMBS, sheet.ntri + CRUMBS, &scan));
    memcpy(scan.x, sheet.x, 24 * (size_t)sheet.nvert);
    memcpy(scan.tri_vert, sheet.tri_vert, 12 * (size_t)sheet.ntri);
    for (int i = 0; i < 3 * CRUMBS; ++i) {
        om_store3(scan.x, sheet.nvert + i,
                  om_vec3(0.003 * (i / 3) + 0.001 * (i % 3 == 1), -0.01 - 0.001 * (i % 3 == 2), 0));
        scan.tri_vert[3 * sheet.ntri + i] = sheet.nvert + i;
    }
    assert_ok(om_spectral_basis_init(&sheet, K, &whole));
    assert_ok(om_spectral_basis_init_scan(&scan, K, &with));
    assert_int_equal(with.nrow, sheet.nvert);
    for (int i = 0; i < scan.npoint; ++i) assert_int_equal(with.row[i], i < sheet.nvert ? i : -1);
    assert_near_rel(with.total_area, whole.total_area, 1e-12);
    for (int p = 1; p < K; ++p) assert_near_rel(with.eigenvalue[p], whole.eigenvalue[p], 1e-8);
    om_spectral_basis_done(&with);
    OmSurface all = {
        .nvert = scan.npoint, .ntri = scan.ntri, .x = scan.x, .tri_vert = scan.tri_vert};
    assert_ok(om_spectral_basis_init(&all, K, &with));
    assert_int_equal(with.nrow, scan.npoint);
    assert_near(with.eigenvalue[CRUMBS] * with.total_area, 0, 1e-6);
    assert_true(with.eigenvalue[CRUMBS + 1] * with.total_area > 1);
    om_spectral_basis_done(&with);
    om_spectral_basis_done(&whole);
    om_scan_done(&scan);
    om_surface_done(&sheet);
}

static void wrong_arguments_are_refused(void** state) {
    (void)state;
    Case c;
    double C[400];
    make_case(10, 0.5, true, &c);
    assert_status(om_spectral_basis_init(&c.b, 0, &c.basis_b), OM_INVALID);
    assert_status(om_spectral_basis_init(&c.b, c.b.nvert, &c.basis_b), OM_INVALID);
    assert_null(c.basis_b.phi);
    OmScan empty = {0};
    assert_status(om_spectral_basis_init_scan(&empty, 5, &c.basis_b), OM_INVALID);
    assert_ok(om_spectral_basis_init(&c.a, 30, &c.basis_a));
    assert_ok(om_spectral_basis_init(&c.b, 20, &c.basis_b));
    disturb_map(&c, 0);
    OmSpectralDef none = {0}, good = om_spectral_default_def(), def;
    good.last = 20;
    const OmSpectralDef bad[6] = {
        none,
        {.first = 0, .last = 20, .step = 5, .cookie = good.cookie},
        {.first = 10, .last = 9, .step = 5, .cookie = good.cookie},
        {.first = 10, .last = 21, .step = 5, .cookie = good.cookie},
        {.first = 10, .last = 20, .step = 0, .cookie = good.cookie},
        // 18 of a half need more than 30 of the whole
        {.first = 18, .last = 20, .step = 5, .is_partial = true, .cookie = good.cookie}};
    for (int k = 0; k < 6; ++k)
        assert_status(om_spectral_zoomout(&bad[k], &c.basis_a, &c.basis_b, c.map, NULL),
                      OM_INVALID);
    int kept = c.map[3];
    c.map[3] = c.a.nvert;
    assert_status(om_spectral_zoomout(&good, &c.basis_a, &c.basis_b, c.map, NULL), OM_INVALID);
    assert_int_equal(c.map[3], c.a.nvert);
    assert_status(om_spectral_get_matrix(&c.basis_a, &c.basis_b, c.map, 5, 5, C), OM_INVALID);
    c.map[3] = kept;
    assert_status(om_spectral_get_matrix(&c.basis_a, &c.basis_b, c.map, 31, 5, C), OM_INVALID);
    int* tri = om_alloc((size_t)c.b.nvert, sizeof(int));
    double* bary = om_alloc(3 * (size_t)c.b.nvert, sizeof(double));
    assert_status(
        om_spectral_map_to_surface(&bad[3], &c.basis_a, &c.a, &c.basis_b, c.map, tri, bary),
        OM_INVALID);
    assert_status(om_spectral_map_to_surface(&good, &c.basis_a, &c.b, &c.basis_b, c.map, tri, bary),
                  OM_INVALID);
    om_free(tri);
    om_free(bary);
    assert_ok(om_spectral_get_matrix(&c.basis_a, &c.basis_b, c.map, 20, 20, C));
    C[7] = NAN;
    def = good;
    assert_status(om_spectral_map_from_matrix(&def, &c.basis_a, &c.basis_b, 20, 20, C, c.map),
                  OM_INVALID);
    for (int i = 0; i < c.b.nvert; ++i) c.map[i] = -1;
    assert_status(om_spectral_zoomout(&good, &c.basis_a, &c.basis_b, c.map, NULL), OM_INVALID);
    assert_status(om_spectral_get_matrix(&c.basis_a, &c.basis_b, c.map, 5, 5, C), OM_INVALID);
    c.flat[4] = NAN;
    assert_status(om_spectral_map_from_nearest(&c.basis_a, c.a.x, &c.basis_b, c.flat, c.map),
                  OM_INVALID);
    case_done(&c);
}

static OmStatus map_once(void* ctx) {
    Case* c = ctx;
    OmStatus status = OM_OK;
    OmSpectralBasis a = {0}, b = {0};
    OmSpectralDef def = om_spectral_default_def();
    def.last = 15;
    const int mark[2] = {3, 40};
    unsigned char all[4000];
    memset(all, 1, sizeof all);
    OM_TRY_DONE(om_spectral_basis_init_part(&c->b, all, 15, &a));
    OM_TRY_DONE(om_spectral_basis_init(&c->b, 15, &b));
    OM_TRY_DONE(om_spectral_map_from_landmarks(&a, &b, 10, 2, mark, mark, c->map));
    OM_TRY_DONE(om_spectral_map_from_nearest(&a, c->b.x, &b, c->b.x, c->map));
    // the arrays of shape a, which is larger, take the results
    c->map[0] = -1;
    OM_TRY_DONE(om_spectral_zoomout(&def, &a, &b, c->map, NULL));
    OM_TRY_DONE(om_spectral_map_to_surface(&def, &a, &c->b, &b, c->map, c->a.tri_vert, c->a.x));
done:
    om_spectral_basis_done(&a);
    om_spectral_basis_done(&b);
    return status;
}

static void every_failing_allocation_is_told(void** state) {
    (void)state;
    Case c = {0};
    make_case(6, 0.4, true, &c);
    assert_true(test_failing_allocations(map_once, &c, 1) >= 60);
    case_done(&c);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(zoomout_finds_the_rolled_sheet),
        cmocka_unit_test(zoomout_finds_a_part_of_the_sheet),
        cmocka_unit_test(landmarks_give_a_first_map),
        cmocka_unit_test(landmarks_need_no_bases_of_one_size),
        cmocka_unit_test(identity_has_the_identity_matrix),
        cmocka_unit_test(neighbours_are_those_of_a_plain_search),
        cmocka_unit_test(points_are_the_nearest_of_a_plain_search),
        cmocka_unit_test(map_does_not_depend_on_the_workers),
        cmocka_unit_test(crumbs_of_a_scan_have_no_row),
        cmocka_unit_test(wrong_arguments_are_refused),
        cmocka_unit_test(every_failing_allocation_is_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
