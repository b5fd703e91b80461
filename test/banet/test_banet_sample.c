// test_banet_sample.c: random samples: balance of forces, ranges, and the same bytes from (seed, index) alone.
#include "omentum/banet_sample.h"
#include "test_common.h"

static void test_def(void** state) {
    (void)state;
    OmBanetSampleDef def = om_banet_sample_default_def(1);
    assert_ok(om_banet_sample_def_validate(&def));
    def.share[0] = 0.6;
    assert_int_equal(om_banet_sample_def_validate(&def), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "share[0]"));
    def = (OmBanetSampleDef){0};
    assert_int_equal(om_banet_sample_def_validate(&def), OM_INVALID);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_def),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
