// test_match_spectral_data.c: functional maps of cat, lion and camels of the data folder (pyFM; Sumner and Popovic).
//
// Errors are geodesic distances along edges, in percent of the root of the area. The expected values are those of other
// programs on the same files: eigenvalues of robust_laplacian 1.1.0 with SciPy 1.17, errors after ZoomOut of pyfmaps
// 1.3.1 with the same first maps and the same rounds.
#include "omentum/match_spectral.h"
#include "omentum/shape_file.h"
#include "omentum/shape_meshing.h"
#include "test_common.h"

typedef struct Shape {
    OmSurface surface;
    OmSpectralBasis basis;
} Shape;

static void shape_load(const char* name, int npair, Shape* shape) {
    char path[128];
    snprintf(path, sizeof path, "functional_maps/%s.off", name);
    assert_ok(
        om_surface_load_flags(test_data(path), OM_UNIT_M, OM_MESH_KEEP_UNUSED, &shape->surface));
    assert_ok(om_spectral_basis_init(&shape->surface, npair, &shape->basis));
}
static void shape_done(Shape* shape) {
    om_surface_done(&shape->surface);
    om_spectral_basis_done(&shape->basis);
}

// Integers of a text file; the caller frees.
static int* load_ints(const char* name, int num) {
    char path[128];
    snprintf(path, sizeof path, "functional_maps/%s", name);
    FILE* in = fopen(test_data(path), "r");
    assert_non_null(in);
    int* value = om_alloc((size_t)num, sizeof *value);
    for (int i = 0; i < num; ++i) assert_int_equal(fscanf(in, "%d", &value[i]), 1);
    fclose(in);
    return value;
}

static double percent(const Shape* shape, int i, int j) {
    double* distance = om_alloc((size_t)shape->surface.nvert, sizeof(double));
    assert_ok(om_surface_geodesic(&shape->surface, i, distance));
    double d = distance[j];
    om_free(distance);
    return 100 * d / sqrt(shape->basis.total_area);
}

// Mean over landmarks `first` to 19.
static double landmark_error(const Shape* cat, const int* mark, int first, const int* map) {
    double sum = 0;
    for (int k = first; k < 20; ++k) sum += percent(cat, mark[2 * k], map[mark[2 * k + 1]]);
    return sum / (20 - first);
}

static void check_eigenvalues(const Shape* shape, double second, double middle, double last) {
    const OmSpectralBasis* s = &shape->basis;
    assert_near(s->eigenvalue[0] * s->total_area, 0, 1e-8);
    assert_near_rel(s->eigenvalue[1] * s->total_area, second, 1e-8);
    assert_near_rel(s->eigenvalue[20] * s->total_area, middle, 1e-8);
    assert_near_rel(s->eigenvalue[99] * s->total_area, last, 1e-8);
}

static void cat_and_lion(void** state) {
    (void)state;
    Shape cat, lion;
    OmSpectralReport report;
    shape_load("cat-00", 100, &cat);
    shape_load("lion-00", 100, &lion);
    int n = lion.surface.nvert;
    int *map = load_ints("lion2cat", n), *mark = load_ints("landmarks.txt", 40), mark_cat[20],
        mark_lion[20];
    for (int k = 0; k < 20; ++k) {
        mark_cat[k] = mark[2 * k];
        mark_lion[k] = mark[2 * k + 1];
    }
    check_eigenvalues(&cat, 6.27034190077005, 216.9829597188783, 1223.588574298508);
    check_eigenvalues(&lion, 5.877680267449933, 205.85458847902274, 1113.2475365685084);
    OmSpectralDef def = om_spectral_default_def();
    def.first = 20;
    def.last = 100;
    def.step = 10;
    // the map of the data was made from the landmarks: exact there, rough elsewhere
    assert_near(landmark_error(&cat, mark, 0, map), 0, 0);
    assert_ok(om_spectral_zoomout(&def, &cat.basis, &lion.basis, map, &report));
    double after = landmark_error(&cat, mark, 0, map);
    print_message("map of the data, after ZoomOut 20 to 100: %.2f %% at the landmarks\n", after);
    assert_near(after, 2.67, 0.05);
    // from five landmarks; the error at the other fifteen
    assert_ok(
        om_spectral_map_from_landmarks(&cat.basis, &lion.basis, 20, 5, mark_cat, mark_lion, map));
    double before = landmark_error(&cat, mark, 5, map);
    assert_ok(om_spectral_zoomout(&def, &cat.basis, &lion.basis, map, &report));
    after = landmark_error(&cat, mark, 5, map);
    print_message("from five landmarks: %.2f %% at the others, after ZoomOut %.2f %%\n", before,
                  after);
    assert_below(after, 6);
    assert_below(after, 0.6 * before);
    om_free(map);
    om_free(mark);
    shape_done(&cat);
    shape_done(&lion);
}

// Mean distance between every 50th vertex of p and its image in q and back.
static double cycle_error(const Shape* p, const int* to_q, const int* to_p) {
    double sum = 0;
    int num = 0;
    for (int i = 0; i < p->surface.nvert; i += 50, ++num) sum += percent(p, i, to_p[to_q[i]]);
    return sum / num;
}

static void camels(void** state) {
    (void)state;
    Shape camel[2];
    const char* name[2][3] = {{"camel-gallop-01", "camel_map_1_to_3", "camel_map_3_to_1"},
                              {"camel-gallop-02", "camel_map_2_to_3", "camel_map_3_to_2"}};
    shape_load("camel-gallop-03", 80, &camel[1]);
    for (int k = 0; k < 2; ++k) {
        shape_load(name[k][0], 80, &camel[0]);
        int* there = load_ints(name[k][1], camel[0].surface.nvert);
        int* back = load_ints(name[k][2], camel[1].surface.nvert);
        double before = cycle_error(&camel[0], there, back);
        OmSpectralDef def = om_spectral_default_def();
        def.first = 20;
        def.last = 80;
        def.step = 10;
        // a map from p to q has an entry for each vertex of p: p is b, q is a
        assert_ok(om_spectral_zoomout(&def, &camel[1].basis, &camel[0].basis, there, NULL));
        assert_ok(om_spectral_zoomout(&def, &camel[0].basis, &camel[1].basis, back, NULL));
        double after = cycle_error(&camel[0], there, back);
        print_message("camel %d to 3 and back: %.2f %%, after ZoomOut 20 to 80 %.2f %%\n", k + 1,
                      before, after);
        assert_near(after, k == 0 ? 1.32 : 1.13, 0.05);
        om_free(there);
        om_free(back);
        shape_done(&camel[0]);
    }
    shape_done(&camel[1]);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cat_and_lion),
        cmocka_unit_test(camels),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
