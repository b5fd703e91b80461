// test_banet_fuse.c: several views, by cases whose results are known.
#include "test_common.h"

#include "omentum/banet_fuse.h"

static double odds(double p) { return p / (1 - p); }

static double fuse_one(const OmBanetFuseDef* def, int nview, const OmBanetView* view) {
    double p = -1;
    assert_ok(om_banet_fuse(def, nview, view, 1, &p));
    return p;
}

// Bayes' rule by hand: posterior odds are prior odds times the likelihood ratio of each grasp.
static void test_bayes(void** state) {
    (void)state;
    OmBanetFuseDef def = om_banet_fuse_default_def();
    def.base = 0.2;
    const double a = 0.6, b = 0.3;
    OmBanetView view[3] = {{.probability = &a, .grasp = 4}, {.probability = &b, .grasp = 9}};
    double want = odds(0.2) * (odds(a) / odds(0.2)) * (odds(b) / odds(0.2));
    assert_near(odds(fuse_one(&def, 2, view)), want, 1e-12);
    assert_near(fuse_one(&def, 0, view), 0.2, 1e-12);
    assert_near(fuse_one(&def, 1, view), 0.6, 1e-12);
    // A view that says the base rate changes nothing.
    const double base = 0.2;
    view[1].probability = &base;
    assert_near(fuse_one(&def, 2, view), 0.6, 1e-12);
}

// Frames of one grasp count as their mean, those of other grasps add up.
static void test_grasps(void** state) {
    (void)state;
    OmBanetFuseDef def = om_banet_fuse_default_def();
    def.base = 0.5;
    const double p = 0.8, q = 0.6;
    OmBanetView same[3] = {{.probability = &p}, {.probability = &p}, {.probability = &p}};
    OmBanetView other[3] = {
        {.probability = &p}, {.probability = &p, .grasp = 1}, {.probability = &p, .grasp = 2}};
    assert_near(fuse_one(&def, 3, same), 0.8, 1e-12);
    assert_near(odds(fuse_one(&def, 3, other)), pow(odds(0.8), 3), 1e-9);
    same[1].probability = &q;
    assert_near(log(odds(fuse_one(&def, 2, same))), 0.5 * (log(odds(p)) + log(odds(q))), 1e-12);
    same[1].probability = &p;
    def.same = 0.5;
    def.other = 0.5;
    assert_near(log(odds(fuse_one(&def, 3, same))), sqrt(3) * log(odds(p)), 1e-12);
    assert_near(log(odds(fuse_one(&def, 3, other))), sqrt(3) * log(odds(p)), 1e-12);
    // The order of the views does not matter.
    OmBanetView mixed[3] = {
        {.probability = &p, .grasp = 1}, {.probability = &q}, {.probability = &q, .grasp = 1}};
    OmBanetView turned[3] = {mixed[2], mixed[1], mixed[0]};
    assert_near(fuse_one(&def, 3, mixed), fuse_one(&def, 3, turned), 1e-12);
}

static void test_forgetting(void** state) {
    (void)state;
    OmBanetFuseDef def = om_banet_fuse_default_def();
    def.base = 0.5;
    def.half_life = 2;
    const double p = 0.9, q = 0.1;
    OmBanetView view[2] = {{.probability = &p, .age = 4}, {.probability = &q}};
    // One grasp: the frame of 4 s has a quarter of the weight.
    assert_near(log(odds(fuse_one(&def, 2, view))), (0.25 - 1) / 1.25 * log(odds(p)), 1e-12);
    view[1].grasp = 1;
    assert_near(log(odds(fuse_one(&def, 2, view))), (0.25 - 1) * log(odds(p)), 1e-12);
    def.half_life = 0;
    assert_near(fuse_one(&def, 2, view), 0.5, 1e-12);
}

// A frame that does not show a place says little about it, but not nothing: what moves beside it is seen.
static void test_shown(void** state) {
    (void)state;
    OmBanetFuseDef def = om_banet_fuse_default_def();
    def.base = 0.5;
    const double p[2] = {0.9, 0.9}, shown[2] = {1, 0};
    double out[2];
    OmBanetView view = {.probability = p, .shown = shown};
    assert_ok(om_banet_fuse(&def, 1, &view, 2, out));
    assert_near(out[0], 0.9, 1e-12);
    assert_near(log(odds(out[1])), def.unseen * log(odds(0.9)), 1e-12);
    // Certain values of a network are limited, and nothing is infinite.
    const double sure[2] = {0, 1};
    view = (OmBanetView){.probability = sure};
    assert_ok(om_banet_fuse(&def, 1, &view, 2, out));
    assert_near(log(odds(out[0])), -def.limit, 1e-9);
    assert_near(log(odds(out[1])), def.limit, 1e-9);
}

static void test_intersections(void** state) {
    (void)state;
    const double a[3] = {0.9, 0.9, 0.2}, b[3] = {0.9, 0.4, 0.9}, c[3] = {0.9, 0.9, 0.9};
    OmBanetView view[3] = {{.probability = b, .age = 2, .grasp = 0},
                           {.probability = a, .age = 1, .grasp = 0},
                           {.probability = c, .age = 0, .grasp = 1}};
    unsigned char got[3];
    assert_ok(om_banet_intersect(3, view, OM_BANET_LATEST, 0.5, 3, got));
    assert_memory_equal(got, ((unsigned char[]){1, 0, 0}), 3);
    assert_ok(om_banet_intersect(3, view, 2, 0.5, 3, got));  // without the oldest
    assert_memory_equal(got, ((unsigned char[]){1, 1, 0}), 3);
    assert_ok(om_banet_intersect(3, view, 1, 0.5, 3, got));
    assert_memory_equal(got, ((unsigned char[]){1, 1, 1}), 3);
    // Of grasp 0 the newer frame, a, counts.
    assert_ok(om_banet_intersect_grasps(3, view, 0.5, 3, got));
    assert_memory_equal(got, ((unsigned char[]){1, 1, 0}), 3);
    assert_ok(om_banet_intersect_grasps(3, view, 0.95, 3, got));
    assert_memory_equal(got, ((unsigned char[]){0, 0, 0}), 3);
    assert_ok(om_banet_intersect(0, NULL, 30, 0.5, 3, got));
    assert_memory_equal(got, ((unsigned char[]){0, 0, 0}), 3);
}

static int count_from(int n, const double* p, double t) {
    int count = 0;
    for (int i = 0; i < n; ++i) count += p[i] >= t;
    return count;
}

// Mean DSC of the set p >= t over drawn truths.
static double mean_dsc(int n, const double* p, double t, uint64_t seed) {
    OmRng rng = om_rng_init(seed, 0);
    double sum = 0;
    const int ndraw = 400;
    for (int d = 0; d < ndraw; ++d) {
        int both = 0, either = 0;
        for (int i = 0; i < n; ++i) {
            bool is_true = om_rng_uniform(&rng) < p[i], is_in = p[i] >= t;
            both += is_true && is_in;
            either += is_true + is_in;
        }
        sum += either > 0 ? 2.0 * both / either : 1;
    }
    return sum / ndraw;
}

// Of sets p >= t, on drawn truths: no other is better by 0.01, and a larger one is worse by 0.004 or more.
static void test_choice(void** state) {
    (void)state;
    enum { N = 300 };
    double p[N], t;
    for (int kind = 0; kind < 3; ++kind) {  // sure, vague, and hardly anything attached
        OmRng rng = om_rng_init(5, (uint64_t)kind);
        for (int i = 0; i < N; ++i) {
            double r = om_rng_uniform(&rng);
            p[i] = kind == 0   ? (r < 0.3 ? 0.97 : 0.02) + 0.02 * r
                   : kind == 1 ? 0.6 * r
                               : 0.1 * r * r;
        }
        assert_ok(om_banet_choose_threshold(N, p, OM_BANET_NEARLY, &t));
        double chosen = mean_dsc(N, p, t, 9), best;
        assert_ok(om_banet_choose_threshold(N, p, 0, &best));
        assert_true(best >= t && mean_dsc(N, p, best, 9) > chosen - 0.002);
        for (int k = 1; k < 60; ++k) {
            double other = mean_dsc(N, p, k / 60.0, 9);
            assert_true(other <= chosen + 0.01);
            if (k / 60.0 < 0.85 * t) assert_true(other < chosen + 0.006);
        }
        if (kind == 0) assert_true(count_from(N, p, t) <= count_from(N, p, 0.5) + 2);
        if (kind == 1) assert_true(t > 0.1 && t < 0.3);
        if (kind == 2) assert_true(t < 0.06);
    }
    // All alike: all or nothing. Zeros are never attached.
    for (int i = 0; i < N; ++i) p[i] = i < N / 2 ? 0.2 : 0;
    assert_ok(om_banet_choose_threshold(N, p, OM_BANET_NEARLY, &t));
    assert_true(t == 0.2);
    memset(p, 0, sizeof p);
    assert_ok(om_banet_choose_threshold(N, p, OM_BANET_NEARLY, &t));
    assert_true(t == 1);
    assert_int_equal(om_banet_choose_threshold(N, p, -0.1, &t), OM_INVALID);
    p[7] = -0.1;
    assert_int_equal(om_banet_choose_threshold(N, p, OM_BANET_NEARLY, &t), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "probability[7]"));
}

static void test_invalid(void** state) {
    (void)state;
    const OmBanetFuseDef good = om_banet_fuse_default_def();
    const double p = 0.5, nan = (double)NAN, big = 1.5;
    double out;
    unsigned char set;
    OmBanetView view = {.probability = &p};
    OmBanetFuseDef def = {0};
    assert_int_equal(om_banet_fuse(&def, 1, &view, 1, &out), OM_INVALID);
    def = good, def.base = 0;
    assert_int_equal(om_banet_fuse(&def, 1, &view, 1, &out), OM_INVALID);
    def = good, def.same = 2;
    assert_int_equal(om_banet_fuse(&def, 1, &view, 1, &out), OM_INVALID);
    def = good, def.half_life = -1;
    assert_int_equal(om_banet_fuse(&def, 1, &view, 1, &out), OM_INVALID);
    def = good, def.limit = 0;
    assert_int_equal(om_banet_fuse(&def, 1, &view, 1, &out), OM_INVALID);
    view.probability = &nan;
    assert_int_equal(om_banet_fuse(&good, 1, &view, 1, &out), OM_INVALID);
    view = (OmBanetView){.probability = &p, .shown = &big};
    assert_int_equal(om_banet_fuse(&good, 1, &view, 1, &out), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "view 0"));
    view = (OmBanetView){.probability = &p, .age = -1};
    assert_int_equal(om_banet_fuse(&good, 1, &view, 1, &out), OM_INVALID);
    assert_int_equal(om_banet_intersect(1, &view, 30, 0.5, 1, &set), OM_INVALID);
    view.age = 0;
    assert_int_equal(om_banet_intersect(1, &view, 0, 0.5, 1, &set), OM_INVALID);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bayes),         cmocka_unit_test(test_grasps),
        cmocka_unit_test(test_forgetting),    cmocka_unit_test(test_shown),
        cmocka_unit_test(test_intersections), cmocka_unit_test(test_choice),
        cmocka_unit_test(test_invalid)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
