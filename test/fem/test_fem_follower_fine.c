// test_fem_follower_fine.c: the bar of test_fem_follower.c on the finest mesh: no more iterations.
#include "test_follower.h"

static void test_finest(void** context) {
    (void)context;
    OmVec3 tip;
    int num = curl_bar(32, OM_CHOLESKY, &tip);
    assert_true(num <= 48);  // six a step, as on the coarse ones
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_finest)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
