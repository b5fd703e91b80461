// test_contact_fold.c: tissue that lies on itself: a sheet carried over and released, a ring pressed together, and
// starts in which surfaces already go through each other.
#include "self_rig.h"

// m, thickness of the sheet
static double thick(void) { return test_is_slow() ? 0.005 : 0.003; }

static bool is_left(OmVec3 p) { return p.x < 1e-9; }

// A sheet that is held at its left edge on a board, grasped at the other edge, carried over in a half circle and
// released. 100 x 60 x 5 mm in cells of 10 mm; quick: 80 x 20 x 3 mm.
static void rig_fold(TestRig* r, double* length) {
    int nx = test_count(8, 10), ny = test_count(2, 6);
    *length = 0.01 * nx;
    rig_box(r, om_vec3(0, 0, 0), om_vec3(*length, 0.01 * ny, thick()), nx, ny, 1);
    self_attach(r, is_left);
    self_default(r, OM_ELEMENT_QUADRATIC);
    rig_start(r);
    OmTissueObstacle board = om_plane_obstacle(&self_floor);
    OmContactDef def = rig_on(&board);
    def.self_contact = true;
    def.self_thickness = 0.0005;
    def.self_friction = 0.3;
    rig_contact(r, &def);
}

// Height of the upper face near the free edge, which lies at x < 0.4 length after folding.
static double top_of(const TestRig* r, double length) {
    double top = 0;
    int num = 0;
    for (int i = 0; i < om_tissue_mesh(r->m)->nvert; ++i) {
        OmVec3 rest = om_load3(om_tissue_mesh(r->m)->x, i);
        if (rest.x < length - 0.0051 || rest.z > 1e-9)
            continue;  // the underside comes to lie on top
        top += om_tissue_x(r->s)[3 * i + 2];
        ++num;
    }
    return top / num;
}

static void test_a_fold_rests_on_its_sheet(void** state) {
    (void)state;
    TestRig r;
    double length;
    rig_fold(&r, &length);
    double middle = 0.5 * length, arm = length - 0.002 - middle,
           width = r.mesh.x[3 * r.mesh.nvert - 2];
    OmPose tip = {om_vec3(middle + arm, 0.5 * width, 0.5 * thick()), om_quat_identity()};
    assert_ok(om_tissue_grasp(r.m, r.s, 0, tip, 0.007, NULL));
    int nfar = 0, nstep = 0, ncarry = test_count(30, 100);
    for (int n = 1; n <= ncarry; ++n) {
        double angle = OM_PI * n / ncarry;
        tip.p = om_vec3(middle + arm * cos(angle), 0.5 * width,
                        0.5 * thick() + arm * sin(angle) + 1.4 * thick() * n / ncarry);
        tip.q = om_quat_axis_angle(om_vec3(0, 1, 0), -angle);
        assert_ok(om_tissue_move_grasp(r.s, 0, tip));
        nfar += om_contact_step(r.cw, r.m, r.s, r.w, 0.02, NULL) != OM_OK;
        ++nstep;
    }
    om_tissue_release(r.s, 0);
    int nrest = test_count(75, 200), nlast = test_count(25, 100);
    double *then = om_alloc(3 * (size_t)om_tissue_mesh(r.m)->nvert, sizeof *then), creep = 0;
    OmContactReport report;
    for (int n = 0; n < nrest; ++n) {
        if (n % 20 == 0)
            printf("%d: fastest %g mm/s top %g\n", n, 1e3 * self_speed(&r),
                   1e3 * top_of(&r, length));
        if (n == nrest - nlast)
            memcpy(then, om_tissue_x(r.s), 3 * (size_t)om_tissue_mesh(r.m)->nvert * sizeof *then);
        nfar += om_contact_step(r.cw, r.m, r.s, r.w, 0.02, &report) != OM_OK;
        ++nstep;
        if (n % 10 == 9) self_assert_no_crossing(&r);
    }
    for (int i = 0; i < om_tissue_mesh(r.m)->nvert; ++i)
        creep = fmax(creep, om_distance(om_load3(then, i), om_load3(om_tissue_x(r.s), i)));
    double height = top_of(&r, length);
    printf(
        "fold: %d vertices, top at %.3f mm, two sheets and the thickness between are %.3f mm; moved "
        "%.2g mm in the last %.1f s; %d of %d steps not OK, %d places, in by %.2g um\n",
        om_tissue_mesh(r.m)->nvert, 1e3 * height, 1e3 * (2 * thick() + 0.0005), 1e3 * creep,
        0.02 * nlast, nfar, nstep, report.ntouch, 1e6 * report.self_penetration);
    assert_near(height, 2 * thick() + 0.0005,
                0.05 * thick());  // weight presses both sheets together
    assert_below(creep, 5e-5);
    assert_int_equal(nfar, 0);
    assert_true(report.ntouch > 0);
    self_assert_no_crossing(&r);
    om_free(then);
    rig_done(&r);
}

// Two arms press a ring together from outside until it lies on itself: its inner faces keep the thickness, and the ring
// that is released opens again.
static void test_a_ring_closed_on_itself(void** state) {
    (void)state;
    TestRig r;
    const double radius = 0.012, side = 0.004;
    int nside = test_count(2, 3), nround = test_count(20, 32);
    memset(&r, 0, sizeof r);
    self_ring(radius, side, nside, nround, &r.mesh);
    self_default(&r, OM_ELEMENT_LINEAR);
    r.def.gravity = om_vec3(0, 0, 0);
    rig_start(&r);
    OmContactDef def = om_contact_default_def();
    def.self_contact = true;
    def.self_thickness = 0.0004;
    rig_contact(&r, &def);
    OmPose tip[2] = {{om_vec3(0, -radius - 0.5 * side, 0), om_quat_identity()},
                     {om_vec3(0, radius + 0.5 * side, 0), om_quat_identity()}};
    for (int a = 0; a < 2; ++a) assert_ok(om_tissue_grasp(r.m, r.s, a, tip[a], 0.003, NULL));
    int npull = test_count(50, 100), nfar = 0;
    OmContactReport report = {0};
    for (int n = 1; n <= npull; ++n) {
        // at last the strands are pressed into each other by 0.2 mm
        double part = (double)n / npull,
               y = (1 - part) * (radius + 0.5 * side) + part * (side - 0.001);
        tip[0].p.y = -y;
        tip[1].p.y = y;
        for (int a = 0; a < 2; ++a) assert_ok(om_tissue_move_grasp(r.s, a, tip[a]));
        OmStatus status = om_contact_step(r.cw, r.m, r.s, r.w, 0.02, &report);
        if (status < 0) fail_msg("step %d: %s", n, om_error_message());
        nfar += status != OM_OK;
        if (n % 10 == 0) self_assert_no_crossing(&r);
    }
    double worst = 0, push = 0;
    for (int k = 0; k < report.ntouch; ++k) {
        worst = fmax(worst, fabs(report.touch[k].gap));
        push += om_norm(report.touch[k].force);
    }
    printf("ring: %d places, %.4f N, gap off by %.2g of the thickness, %d of %d steps not OK\n",
           report.ntouch, push, worst / 0.0004, nfar, npull);
    assert_true(report.ntouch > 0 && push > 1e-3);
    assert_below(worst, 0.02 * 0.0004);
    // a body exerts no force on itself
    assert_below(om_norm(om_contact_body_force(r.cw, 0, 0)), 1e-15);
    assert_int_equal(nfar, 0);
    om_tissue_release(r.s, 0);
    om_tissue_release(r.s, 1);
    for (int n = 0; n < 50; ++n)
        nfar += om_contact_step(r.cw, r.m, r.s, r.w, 0.02, &report) != OM_OK;
    assert_int_equal(report.ntouch, 0);
    assert_int_equal(nfar, 0);
    self_assert_no_crossing(&r);
    rig_done(&r);
}

// Surfaces that cross at the start are refused with their place, at the first step of a state that was set; the state
// stays. Moved apart they are accepted, and a state that was restored is what it was.
static void test_tangled_starts(void** state) {
    (void)state;
    TestRig r;
    OmTetMesh more;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.02, 0.02, 0.02), 2, 2, 2);
    assert_ok(om_tet_mesh_box(om_vec3(0.003, 0.004, 0.025), om_vec3(0.023, 0.024, 0.045), 3, 3, 3,
                              &more));
    self_append(&r.mesh, &more);
    rig_start(&r);
    OmTissueObstacle board = om_plane_obstacle(&self_floor);
    OmContactDef def = rig_on(&board);
    def.self_contact = true;
    rig_contact(&r, &def);
    int nvert = om_tissue_mesh(r.m)->nvert;
    double* x = om_alloc(3 * (size_t)nvert, sizeof *x);
    assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, NULL));
    for (int k = 0; k < 2; ++k) {
        // 7 mm into each other, then with faces in one plane
        for (int i = 0; i < nvert; ++i) {
            OmVec3 p = om_load3(om_tissue_mesh(r.m)->x, i);
            if (om_contact_body_of(r.c, i) == 1) p.z -= k == 0 ? 0.012 : 0.005;
            om_store3(x, i, p);
        }
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        uint64_t hash = om_tissue_state_hash(r.s);
        OmContactReport report;
        for (int n = 0; n < 2; ++n)
            assert_status(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, &report), OM_INVALID);
        assert_true(om_tissue_state_hash(r.s) == hash);
        assert_int_equal(report.nsolve, 0);
        assert_non_null(strstr(om_error_message(), "start of the step"));
        assert_non_null(strstr(om_error_message(), "mm; move the bodies apart"));
        assert_status(om_contact_settle(r.cw, r.m, r.s, r.w, 0.02, 1e-3, 1), OM_INVALID);
    }
    assert_ok(om_tissue_set_x(r.m, r.s, om_tissue_mesh(r.m)->x, NULL));
    for (int n = 0; n < 10; ++n) assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, NULL));
    self_assert_no_crossing(&r);
    om_free(x);
    rig_done(&r);
}

static bool is_low(OmVec3 p) { return p.z < 0.0101; }

// A tool that holds all of a block moves it into a block that is held still: it stops where the two touch, the status
// says so, and it comes back to its goal as soon as that is free.
static void test_a_tool_is_held_back(void** state) {
    (void)state;
    TestRig r;
    OmTetMesh more;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.02, 0.02, 0.01), 2, 2, 1);
    assert_ok(om_tet_mesh_box(om_vec3(0.003, 0.004, 0.012), om_vec3(0.013, 0.014, 0.017), 1, 1, 1,
                              &more));
    self_append(&r.mesh, &more);
    // one that is free, beside them
    assert_ok(om_tet_mesh_box(om_vec3(0.03, 0, 0.0103), om_vec3(0.04, 0.01, 0.02), 1, 1, 1, &more));
    self_append(&r.mesh, &more);
    self_attach(&r, is_low);
    self_default(&r, OM_ELEMENT_LINEAR);
    r.def.gravity = om_vec3(0, 0, 0);
    rig_start(&r);
    OmContactDef def = om_contact_default_def();
    def.self_contact = true;
    rig_contact(&r, &def);
    OmPose tip = {om_vec3(0.008, 0.009, 0.0145), om_quat_identity()};
    int nheld, nback = 0, nmost = 0;
    assert_ok(om_tissue_grasp(r.m, r.s, 0, tip, 0.01, &nheld));
    assert_int_equal(nheld, 8);
    for (int n = 1; n <= 20; ++n) {
        OmContactReport report;
        tip.p.z += n <= 10 ? -0.001 : 0.001;
        assert_ok(om_tissue_move_grasp(r.s, 0, tip));
        OmStatus status = om_contact_step(r.cw, r.m, r.s, r.w, 0.02, &report);
        if (status < 0) fail_msg("step %d: %s", n, om_error_message());
        double low = INFINITY;
        for (int i = 0; i < om_tissue_mesh(r.m)->nvert; ++i)
            if (om_contact_body_of(r.c, i) == 1) low = fmin(low, om_tissue_x(r.s)[3 * i + 2]);
        assert_true(low > 0.01);
        self_assert_no_crossing(&r);
        assert_int_equal(report.is_held_back, status != OM_OK);
        assert_int_equal(report.is_settled, status == OM_OK);
        if (report.is_held_back) assert_non_null(strstr(om_error_message(), "held back"));
        nback += report.is_held_back;
        if (report.tissue.substeps > nmost) nmost = report.tissue.substeps;
        if (n == 1 || n == 20) assert_near(low, tip.p.z - 0.0025, 1e-12);
    }
    printf("held back in %d of 20 steps, at most %d substeps\n", nback, nmost);
    assert_int_equal(nback, 17);
    assert_true(nmost <= 8);  // the tool waits for the end of the step
    rig_done(&r);
}

static bool is_side(OmVec3 p) { return p.z < 1e-9 && p.x > 0.019; }

// A sheet is pulled far by few vertices of its underside, over itself: elements beside the tool are drawn out and
// turned, and top and underside, which look away from each other, come near. They do not cross.
static void test_a_drawn_sheet(void** state) {
    (void)state;
    TestRig r;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.06, 0.06, 0.005), 5, 5, 1);
    self_attach(&r, is_side);
    self_default(&r, OM_ELEMENT_QUADRATIC);
    r.def.material_default.law = OM_NEO_HOOKEAN;
    r.def.material_default.young = 3000;
    rig_start(&r);
    OmTissueObstacle board = om_plane_obstacle(&self_floor);
    OmContactDef def = rig_on(&board);
    def.self_contact = true;
    rig_contact(&r, &def);
    OmVec3 way[] = {{-0.005, 0, 0.03}, {0.06, 0, 0}};
    OmPose tip = {om_vec3(0.012, 0.024, 0), om_quat_identity()};
    int nheld, nstep = 0, nsubstep = 0;
    assert_ok(om_tissue_grasp(r.m, r.s, 0, tip, 0.005, &nheld));
    assert_int_equal(nheld, 3);
    OmContactReport report;
    for (int leg = 0; leg < 2; ++leg) {
        int n = (int)ceil(om_norm(way[leg]) / 0.003);
        for (int k = 0; k < n; ++k, ++nstep) {
            tip.p = om_madd(tip.p, 1.0 / n, way[leg]);
            assert_ok(om_tissue_move_grasp(r.s, 0, tip));
            assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, &report));
            assert_true(report.is_settled && !report.is_held_back);
            nsubstep += report.tissue.substeps;
            if (nstep % 2) self_assert_no_crossing(&r);
        }
    }
    printf("drawn sheet: %d steps, %d substeps, %d places touch at its end\n", nstep, nsubstep,
           report.ntouch);
    assert_true(report.ntouch > 0);
    assert_int_equal(nsubstep, nstep);  // no step is cut
    rig_done(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_fold_rests_on_its_sheet),
        cmocka_unit_test(test_a_ring_closed_on_itself),
        cmocka_unit_test(test_tangled_starts),
        cmocka_unit_test(test_a_tool_is_held_back),
        cmocka_unit_test(test_a_drawn_sheet),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
