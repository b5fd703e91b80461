// test_match_register_doubt.c: registrations that are not reliable, and say so; wrong input.
#include "match/register_shapes.h"
#include "test_alloc.h"

// ---- poses that the shape does not tell ---------------------------------------------------------------

static void register_shape(OmShapeFn model, OmShapeFn truth, uint64_t seed, OmRegistration* r) {
    OrganCase c;
    OmScan scan;
    OmPose pose;
    make_surface(model, 0.003, &c.model);
    make_surface(truth, test_is_slow() ? 0.0016 : 0.0025, &c.truth);
    case_prepare(&c);
    case_look(&c, seed, &scan, &pose);
    OmRegisterDef def = def_near(&scan, pose, seed);
    if (!test_is_slow()) def.npoint = 600, def.start_angle = def.start_shift = 0;  // one start
    assert_ok(om_scan_register(&def, &c.model, &scan, r));
    om_scan_done(&scan);
    case_done(&c);
}

static void test_round_shapes(void** state) {
    (void)state;
    for (uint64_t seed = 1; seed < 2; ++seed) {
        OmRegistration r;
        if (test_is_slow()) {
            register_shape(ball, ball, seed, &r);
            assert_false(r.is_reliable);
            assert_true(r.sigma_angle > OM_PI / 180);
            assert_below(r.residual, 0.0003);
        }
        register_shape(egg, egg, seed, &r);
        assert_false(r.is_reliable);
        assert_true(r.sigma_angle > OM_PI / 180);
        assert_true(fabs(r.axis_angle.z) > 0.9);  // it is round about z
        // One start: runs from 6 degrees beside the result stay there, nearly; half of that is what is known.
        if (!test_is_slow()) assert_near(r.sigma_angle * 180 / OM_PI, 3, 0.6);
    }
}

static void test_another_organ(void** state) {
    (void)state;
    for (uint64_t seed = 1; seed < (test_is_slow() ? 3 : 2); ++seed) {
        OmRegistration r;
        if (test_is_slow()) {
            register_shape(potato, plate, seed, &r);
            assert_false(r.is_reliable);
        }
        register_shape(egg, potato, seed, &r);
        assert_false(r.is_reliable);
        assert_true(r.reason[0] != 0);
    }
}

// ---- input ----------------------------------------------------------------------------------------------

static void test_bad_input(void** state) {
    (void)state;
    OrganCase c;
    OmScan scan;
    OmPose truth;
    OmRegistration r;
    make_case(potato, 0.006, &c);
    case_look(&c, 1, &scan, &truth);
    OmRegisterDef good = def_near(&scan, truth, 1), def = good;
    def.cookie = 0;
    assert_status(om_scan_register(&def, &c.model, &scan, &r), OM_INVALID);
    def = good, def.npoint = 99;
    assert_status(om_scan_register(&def, &c.model, &scan, &r), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "npoint"));
    def = good, def.pose_model_scan.q.w += 0.5;
    assert_status(om_scan_register(&def, &c.model, &scan, &r), OM_INVALID);
    OmSurface empty = {0};
    assert_status(om_scan_register(&good, &empty, &scan, &r), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "no surface"));
    int n = scan.npoint;
    scan.npoint = 29;
    assert_status(om_scan_register(&good, &c.model, &scan, &r), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "29 points"));
    scan.npoint = n;
    double kept = scan.x[10];
    scan.x[10] = (double)NAN;
    assert_status(om_scan_register(&good, &c.model, &scan, &r), OM_INVALID);
    scan.x[10] = kept;
    def = good, def.pose_model_scan.p.x += 2;
    assert_ok(om_scan_register(&def, &c.model, &scan, &r));
    assert_false(r.is_reliable);
    assert_non_null(strstr(r.reason, "outside the model"));
    for (int i = 0; i < 3 * n; ++i) scan.x[i] *= 1e3;  // millimetres taken for metres
    def = good, def.has_start = false;
    assert_ok(om_scan_register(&def, &c.model, &scan, &r));
    assert_false(r.is_reliable);
    assert_non_null(strstr(r.reason, "unit"));
    om_scan_done(&scan);
    case_done(&c);
}

typedef struct Run {
    OmRegisterDef def;
    const OmSurface* model;
    const OmScan* scan;
    OmRegistration r;
} Run;

static OmStatus run_once(void* ctx) {
    Run* run = ctx;
    return om_scan_register(&run->def, run->model, run->scan, &run->r);
}

static void test_workers_and_memory(void** state) {
    (void)state;
    OrganCase c;
    OmScan scan;
    OmPose truth;
    make_case(potato, 0.006, &c);
    case_look(&c, 1, &scan, &truth);
    Run run = {.def = def_near(&scan, truth, 1), .model = &c.model, .scan = &scan};
    run.def.npoint = 300;
    if (!test_is_slow()) run.def.start_angle = run.def.start_shift = 0;
    assert_ok(run_once(&run));
    OmRegistration first = run.r;
    run.def.nworker = 3;
    assert_ok(run_once(&run));
    run.r.ms = first.ms;
    assert_memory_equal(&first.pose_model_scan, &run.r.pose_model_scan, sizeof(OmPose));
    assert_true(first.sigma_angle == run.r.sigma_angle && first.residual == run.r.residual);
    assert_int_equal(first.niteration, run.r.niteration);
    run.def.start_angle = run.def.start_shift = 0;  // one start: fewer runs
    assert_true(test_failing_allocations(run_once, &run, test_stride(37)) > 0);
    om_scan_done(&scan);
    case_done(&c);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_shapes),
        cmocka_unit_test(test_another_organ),
        cmocka_unit_test(test_bad_input),
        cmocka_unit_test(test_workers_and_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
