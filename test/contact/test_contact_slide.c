// test_contact_slide.c: a probe pressed and slid there and back: without friction nothing pulls aside, with friction
// no point is pulled by more than Coulomb's bound.
#include "test_slide.h"

// There and back differ by less than 1 % of the force up at steps of 1 mm, and holding changes as little. Planes were
// placed again by distance alone before: 4 to 16 % for the boxes. What is left at 6 mm comes from the tissue's one
// linearisation a step, not from contact: Newton's method leaves 0.2 %.
static void test_frictionless(void** test) {
    (void)test;
    const Slide table[] = {
        {"sphere, 3 mm deep", OM_PROBE_SPHERE, OM_PRESS_PENALTY, 0, 0, 0.003, 0.02, false, 1},
        {"the same, multipliers", OM_PROBE_SPHERE, OM_PRESS_MULTIPLIERS, 0, 0, 0.003, 0.02, false,
         1},
        {"sphere, 6 mm deep, Newton", OM_PROBE_SPHERE, OM_PRESS_PENALTY, 0, 0, 0.006, 0.5, true,
         20},
        {"box, 1 mm deep", OM_PROBE_BOX, OM_PRESS_PENALTY, 0, 0, 0.001, 0.5, true, 1},
        {"box with edges of 5 mm, 3 mm deep", OM_PROBE_BOX, OM_PRESS_PENALTY, 0.005, 0, 0.003, 0.5,
         true, 1},
        {"the same, multipliers", OM_PROBE_BOX, OM_PRESS_MULTIPLIERS, 0.005, 0, 0.003, 0.5, true,
         1},
    };
    for (size_t k = 0; k < sizeof table / sizeof *table; ++k) {
        Slid out = run(&table[k]);
        assert_below(fabs(out.aside[0] - out.aside[1]), 0.01);
        assert_below(fabs(out.held[0] - out.held[1]), 0.01);
    }
}

// Coulomb's bound in every step, of every point that carries a thousandth of the largest force: within 2 %. It was
// exceeded by 1.35 under the sphere and 2.8 at the box's edge, where a step took 53 solves.
static void test_bound(void** test) {
    (void)test;
    const Slide table[] = {
        {"sphere, mu 0.1", OM_PROBE_SPHERE, OM_PRESS_PENALTY, 0, 0.1, 0.006, 0.02, false, 1},
        {"the same, multipliers", OM_PROBE_SPHERE, OM_PRESS_MULTIPLIERS, 0, 0.1, 0.006, 0.02, false,
         1},
        {"box, mu 0.1", OM_PROBE_BOX, OM_PRESS_PENALTY, 0, 0.1, 0.006, 0.02, false, 1},
        {"the same, multipliers", OM_PROBE_BOX, OM_PRESS_MULTIPLIERS, 0, 0.1, 0.006, 0.02, false,
         1},
    };
    for (size_t k = 0; k < sizeof table / sizeof *table; ++k) {
        Slid out = run(&table[k]);
        assert_below(out.bound, 1.02);
        assert_below(out.nsolve, 20);
        assert_true(out.aside[1] - out.aside[0] > 0.1);  // it does drag
    }
}

// A single solve a step cannot settle: no step says that it did.
static void test_not_settled(void** test) {
    (void)test;
    const Slide slide = {"", OM_PROBE_SPHERE, OM_PRESS_PENALTY, 0, 0.1, 0.006, 0.02, false, 1};
    PressRig p;
    start(&p, &slide);
    OmPressDef def = om_press_default_def(p.probe);
    def.max_iterations = 1;
    om_press_destroy(p.press);
    assert_ok(om_press_create(&def, p.r.m, &p.press));
    OmPose pose = {om_vec3(0.06, 0.05, 0.075), om_quat_identity()};
    assert_ok(om_press_place(p.press, p.r.m, p.r.s, pose));
    int nunsettled = 0;
    for (int k = 0; k < 10; ++k) {
        OmPressReport report;
        pose.p.z -= 0.0005;
        OmStatus status = om_press_step(p.press, p.r.m, p.r.s, p.r.w, pose, H, &report);
        assert_true(status >= 0);
        assert_true(report.is_settled ? status == OM_OK : status == OM_NOT_CONVERGED);
        nunsettled += !report.is_settled;
    }
    assert_true(nunsettled > 0);
    done(&p);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_frictionless),
                                       cmocka_unit_test(test_bound),
                                       cmocka_unit_test(test_not_settled)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
