// test_dds_period.c: quantiles of periods that are known.
#include "dds/dds_period.h"
#include "test_common.h"

// 99 periods of 10 ms and one of 40 ms; then one that no bin is long enough for.
static void quantiles(void** unused) {
    (void)unused;
    Periods p = {0};
    assert_true(isnan(om__periods_quantile(&p, 0.5)));
    double now = 1000;
    om__periods_count(&p, now, 0.01);
    assert_true(isnan(om__periods_quantile(&p, 0.5)));
    for (int i = 0; i < 100; ++i) om__periods_count(&p, now += i == 50 ? 0.04 : 0.01, 0.01);
    assert_int_equal(p.n, 100);
    assert_int_equal(p.nlate, 1);
    assert_near(p.longest, 0.04, 1e-9);
    assert_near(om__periods_quantile(&p, 0.5), 0.01, 1e-4);  // a bin
    assert_near(om__periods_quantile(&p, 0.99), 0.01, 1e-4);
    assert_near(om__periods_quantile(&p, 0.995), 0.04, 1e-4);
    om__periods_count(&p, now + 7, 0.01);
    assert_near(om__periods_quantile(&p, 1), 0.2, 1e-4);
    assert_near(p.longest, 7, 1e-9);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(quantiles)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
