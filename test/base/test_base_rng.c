// Philox against its published answers, and the distributions built on it.
#include "test_common.h"

// Random123's known answers for philox4x32-10 (kat_vectors).
static void published_vectors(void** state) {
    (void)state;
    OmRng zero = om_rng_init(0, 0);
    const uint32_t expect_zero[4] = {0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8};
    for (int i = 0; i < 4; ++i) assert_int_equal(om_rng_u32(&zero), expect_zero[i]);
    OmRng ones = om_rng_init(UINT64_MAX, UINT64_MAX);
    ones.counter[0] = ones.counter[1] = UINT32_MAX;
    const uint32_t expect_ones[4] = {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd};
    for (int i = 0; i < 4; ++i) assert_int_equal(om_rng_u32(&ones), expect_ones[i]);
}

static void streams_are_functions_of_seed_and_index(void** state) {
    (void)state;
    OmRng a = om_rng_init(7, 3), b = om_rng_init(7, 3), c = om_rng_init(7, 4);
    int same = 0;
    for (int i = 0; i < 100; ++i) {
        uint32_t u = om_rng_u32(&a);
        assert_int_equal(u, om_rng_u32(&b));
        same += u == om_rng_u32(&c);
    }
    assert_true(same < 2);
}

static void moments(void** state) {
    (void)state;
    // 200,000 draws: the standard error of a mean is sd / 447; five of them is the tolerance.
    enum { N = 200000 };
    OmRng rng = om_rng_init(1, 0);
    double sum = 0, sum2 = 0, nsum = 0, nsum2 = 0;
    int bins[7] = {0};
    for (int i = 0; i < N; ++i) {
        double u = om_rng_uniform(&rng), z = om_rng_normal(&rng);
        assert_true(u >= 0.0 && u < 1.0);
        sum += u, sum2 += u * u, nsum += z, nsum2 += z * z;
        ++bins[om_rng_below(&rng, 7)];
    }
    assert_near(sum / N, 0.5, 5 * 0.2887 / 447);
    assert_near(sum2 / N, 1.0 / 3, 5 * 0.2981 / 447);
    assert_near(nsum / N, 0.0, 5 * 1.0 / 447);
    assert_near(nsum2 / N, 1.0, 5 * 1.4142 / 447);
    for (int i = 0; i < 7; ++i) assert_near(bins[i], N / 7.0, 5 * sqrt(N / 7.0));
}

// A uniform number has all 53 bits of a double's fraction: every one of them is set in some draw, and clear in some.
static void test_uniform_has_53_bits(void** state) {
    (void)state;
    OmRng rng = om_rng_init(7, 0);
    uint64_t set = 0, clear = 0, all = (1ull << 53) - 1;
    for (int i = 0; i < 1000; i++) {
        double u = om_rng_uniform(&rng);
        assert_true(u >= 0 && u < 1);
        uint64_t bits = (uint64_t)(u * 0x1p53);
        set |= bits;
        clear |= ~bits & all;
    }
    assert_true(set == all && clear == all);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_uniform_has_53_bits),
        cmocka_unit_test(published_vectors),
        cmocka_unit_test(streams_are_functions_of_seed_and_index),
        cmocka_unit_test(moments),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
