// test_scan_data.c: a scan as data.
#include "test_common.h"

#include "omentum/scan.h"
#include "test_alloc.h"

static void set_triangle(OmScan* scan) {
    const double x[9] = {0, 0, 0, 0.01, 0, 0, 0, 0.01, 0};
    const double normal[9] = {0, 0, 1, 0, 0.6, 0.8, 0, 0, 0};  // the last one is not known
    const int tri[3] = {0, 1, 2};
    memcpy(scan->x, x, sizeof x);
    memcpy(scan->normal, normal, sizeof normal);
    memcpy(scan->tri_vert, tri, sizeof tri);
}

static void test_good(void** state) {
    (void)state;
    OmScan scan;
    for (int k = 0; k < 3; ++k) {  // memory of the scan before is used again: it is cleared
        assert_int_equal(om_scan_init(3, 1, &scan), OM_OK);
        for (int i = 0; i < 9; ++i) assert_near(fabs(scan.x[i]) + fabs(scan.normal[i]), 0, 0);
        assert_int_equal(scan.tri_vert[0] + scan.tri_vert[1] + scan.tri_vert[2], 0);
        set_triangle(&scan);
        if (k < 2) om_scan_done(&scan);
    }
    assert_int_equal(om_scan_check(&scan), OM_OK);
    om_scan_done(&scan);
    assert_null(scan.x);
    assert_int_equal(om_scan_init(0, 0, &scan), OM_OK);
    assert_int_equal(om_scan_check(&scan), OM_OK);  // nothing seen is a scan, too
    om_scan_done(&scan);
    om_scan_done(NULL);
}

static void test_bad(void** state) {
    (void)state;
    OmScan scan;
    assert_int_equal(om_scan_init(-1, 0, &scan), OM_INVALID);
    assert_int_equal(om_scan_init(3, 1, &scan), OM_OK);
    set_triangle(&scan);
    scan.tri_vert[1] = 3;
    assert_int_equal(om_scan_check(&scan), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "triangle 0"));
    scan.tri_vert[1] = -1;
    assert_int_equal(om_scan_check(&scan), OM_INVALID);
    scan.tri_vert[1] = 1;
    scan.normal[5] = 0.7;
    assert_int_equal(om_scan_check(&scan), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "normal of point 1"));
    scan.normal[5] = 0.8;
    scan.x[8] = (double)NAN;
    assert_int_equal(om_scan_check(&scan), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "point 2"));
    scan.x[8] = 0;
    scan.noise = -1e-3;
    assert_int_equal(om_scan_check(&scan), OM_INVALID);
    scan.noise = 0;
    assert_int_equal(om_scan_check(&scan), OM_OK);
    om_scan_done(&scan);
}

static OmStatus make_and_free(void* ctx) {
    (void)ctx;
    OmScan scan;
    OmStatus status = om_scan_init(5, 2, &scan);
    om_scan_done(&scan);
    return status;
}

static void test_memory(void** state) {
    (void)state;
    assert_int_equal(test_failing_allocations(make_and_free, NULL, 1), 3);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_good),
        cmocka_unit_test(test_bad),
        cmocka_unit_test(test_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
