// Numbers of files: exact round trips against strtod, ends that are respected, other locales.
#include <locale.h>

#include "test_common.h"

static double parsed(const char* text, int used) {
    const char* p = text;
    double v = -12345;
    assert_true(om_number_parse(&p, text + strlen(text), &v));
    assert_int_equal(p - text, used);
    return v;
}

static void test_numbers_are_read(void** unused) {
    (void)unused;
    assert_near(parsed("12", 2), 12, 0);
    assert_near(parsed("-0.5e1x", 6), -5, 0);
    assert_near(parsed("+.25 ", 4), 0.25, 0);
    assert_near(parsed("3.", 2), 3, 0);
    assert_near(parsed("1e", 1), 1, 0);  // the letter belongs to what follows
    assert_near(parsed("1d3", 3), 1000, 0);
    assert_near(parsed("0e99999999999", 13), 0, 0);
    assert_true(isinf(parsed("1e400", 5)) && isinf(parsed("-Infinity", 9)));
    assert_true(isnan(parsed("NaN", 3)));
    assert_near(parsed("1e-400", 6), 0, 0);
    assert_near(parsed("00000000000000000000000001", 26), 1, 0);
    assert_near_rel(parsed("123456789012345678901234567890", 30), 1.2345678901234568e29, 1e-16);
    double v;
    for (const char* const* t = (const char* const[]){"", "-", ".", "e5", "x", "na", NULL}; *t;
         ++t) {
        const char* p = *t;
        assert_false(om_number_parse(&p, *t + strlen(*t), &v));
        assert_ptr_equal(p, *t);
    }
    const char* p = "1234";
    assert_true(om_number_parse(&p, p + 2, &v));
    assert_near(v, 12, 0);
}

static void test_integers_are_read(void** unused) {
    (void)unused;
    int64_t v = 0;
    const char *text = "-9223372036854775807,", *p = text;
    assert_true(om_integer_parse(&p, text + strlen(text), &v));
    assert_true(v == -INT64_MAX && *p == ',');
    text = p = "9223372036854775808";
    assert_false(om_integer_parse(&p, text + strlen(text), &v));
}

// Every bit pattern that is finite comes back, under a locale with a decimal comma too.
static void test_round_trip(void** unused) {
    (void)unused;
    const char* const locale[] = {"C", "de_DE.UTF-8", "fr_FR.UTF-8"};
    for (int l = 0; l < 3; ++l) {
        if (!setlocale(LC_NUMERIC, locale[l])) continue;
        OmRng rng = om_rng_init(7, (uint64_t)l);
        for (int i = 0; i < 20000; ++i) {
            uint64_t bits = (uint64_t)om_rng_u32(&rng) << 32 | om_rng_u32(&rng);
            double v, back = 0;
            memcpy(&v, &bits, sizeof v);
            if (!isfinite(v)) continue;
            char text[OM_NUMBER_SIZE];
            int n = om_number_write(text, v);
            const char* p = text;
            assert_true(om_number_parse(&p, text + n, &back));
            assert_true(p == text + n && back == v);
        }
        // short decimals take the exact path; strtod is the second implementation
        if (l > 0) continue;
        for (int i = 0; i < 20000; ++i) {
            char text[40];
            snprintf(text, sizeof text, "%.*g", 1 + (int)om_rng_below(&rng, 17),
                     om_rng_normal(&rng) * pow(10, om_rng_range(&rng, -30, 30)));
            const char* p = text;
            double v = 0;
            assert_true(om_number_parse(&p, text + strlen(text), &v));
            assert_true(v == strtod(text, NULL));
        }
    }
    setlocale(LC_NUMERIC, "C");
}

// By hand, definition 7 of Hyndman & Fan: the quantiles of numpy.
static void test_quantiles(void** unused) {
    (void)unused;
    const double value[] = {1, 2, 4, 8};
    assert_near(om_quantile(value, 4, 0), 1, 0);
    assert_near(om_quantile(value, 4, 0.25), 1.75, 1e-15);
    assert_near(om_quantile(value, 4, 0.5), 3, 1e-15);
    assert_near(om_quantile(value, 4, 0.75), 5, 1e-15);
    assert_near(om_quantile(value, 4, 1), 8, 0);
    assert_near(om_quantile(value, 1, 0.75), 1, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_numbers_are_read),
        cmocka_unit_test(test_integers_are_read),
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_quantiles),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
