// test_study_interval.c: intervals against published values, and how often they hold the truth; columns of values.
#include "base/base_rng.h"
#include "studies/study_stats.h"
#include "test_alloc.h"

// Newcombe 1998, Statistics in Medicine 17, 857-872, table I, method 3.
static void shares_are_those_of_newcombe(void** unused) {
    (void)unused;
    static const struct {
        int k, n;
        double lo, hi;
    } row[] = {{81, 263, 0.2553, 0.3662},
               {15, 148, 0.0624, 0.1605},
               {0, 20, 0, 0.1611},
               {1, 29, 0.0061, 0.1718}};
    for (size_t i = 0; i < sizeof row / sizeof *row; ++i) {
        const StudyInterval s = om__interval_share(row[i].k, row[i].n);
        assert_near(s.value, (double)row[i].k / row[i].n, 1e-15);
        assert_near(s.lo, row[i].lo, 5e-5);
        assert_near(s.hi, row[i].hi, 5e-5);
    }
    const StudyInterval all = om__interval_share(29, 29), none = om__interval_share(0, 29);
    assert_near(all.lo, 1 - none.hi, 1e-12);
    assert_near(all.hi, 1, 1e-12);
}

// Of 4,000 draws of pairs with known shares about 95 % have the true difference inside, of few pairs a little less.
static void differences_hold_the_truth(void** unused) {
    (void)unused;
    static const double only[][2] = {{0.3, 0.1}, {0.25, 0.02}, {0.1, 0.1}};
    for (int kind = 0; kind < 3; ++kind)
        for (int n = 15; n <= 60; n += 45) {
            int nheld = 0;
            for (int draw = 0; draw < 4000; ++draw) {
                OmRng r = om_rng_init(61, (uint64_t)(10000 * (10 * kind + n) + draw));
                int first = 0, second = 0;
                for (int i = 0; i < n; ++i) {
                    const double u = om_rng_uniform(&r);
                    first += u < only[kind][0];
                    second += u > 1 - only[kind][1];
                }
                const StudyInterval d = om__interval_paired(first, second, n);
                assert_near(d.value, (double)(first - second) / n, 1e-15);
                const double truth = only[kind][0] - only[kind][1];
                nheld += d.lo <= truth && truth <= d.hi;
            }
            printf("%d pairs, %.2f less %.2f: %.1f %% of 4000 intervals hold the difference\n", n,
                   only[kind][0], only[kind][1], nheld / 40.0);
            assert_true(nheld > (n < 30 ? 0.91 : 0.94) * 4000 && nheld < 0.985 * 4000);
        }
}

static void differences_change_sign_with_the_order(void** unused) {
    (void)unused;
    const StudyInterval a = om__interval_paired(7, 2, 30), b = om__interval_paired(2, 7, 30);
    assert_near(a.value, -b.value, 1e-15);
    assert_near(a.lo, -b.hi, 1e-15);
    assert_true(a.lo < 0 && a.hi > 0.3);
}

// Squares and cubes of 0 to N - 1, in closed form: a mean of a column is neither the other's nor of fewer values.
static OmStatus fill(void* unused) {
    (void)unused;
    enum { N = 201 };
    StudyColumns c = {0};
    StudySample square, cube, one;
    for (int i = 0; i < N; ++i) {
        const double x = N - 1 - i;  // descending: medians need an order
        om__columns_add(&c, 2, (double[]){x * x, x * x * x});
    }
    om__column_add(&c, 2, 7);
    OM_TRY(om__columns_end(&c, 3, (StudySample*[]){&square, &cube, &one}));
    const double n = N - 1;
    assert_int_equal(square.n, N);
    assert_int_equal(cube.n, N);
    assert_int_equal(one.n, 1);
    assert_near(square.mean, n * (2 * n + 1) / 6, 1e-9);
    assert_near(cube.mean, n * n * (n + 1) / 4, 1e-6);
    assert_near(cube.median, 1e6, 1e-9);
    assert_near(one.median, 7, 0);
    return OM_OK;
}

static void columns_are_kept_apart(void** unused) {
    (void)unused;
    assert_ok(fill(NULL));
    StudyColumns none = {0};
    StudySample s = {.n = 3};
    assert_ok(om__columns_end(&none, 1, (StudySample*[]){&s}));
    assert_int_equal(s.n, 0);
}

// 201 values need 64, 192 and 448 places: three times for each of two columns, and once for the third.
static void columns_without_memory(void** unused) {
    (void)unused;
    assert_int_equal(test_failing_allocations(fill, NULL, 1), 7);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(shares_are_those_of_newcombe),
        cmocka_unit_test(differences_hold_the_truth),
        cmocka_unit_test(differences_change_sign_with_the_order),
        cmocka_unit_test(columns_are_kept_apart),
        cmocka_unit_test(columns_without_memory),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
