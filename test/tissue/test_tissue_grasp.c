// test_tissue_grasp.c: tools take, carry and release (thesis 6.4.7); attachments hold.
#include "test_rig.h"

static const OmVec3 lo = {0, 0, 0}, hi = {0.06, 0.03, 0.01};

static void start(TestRig* r) {
    rig_box(r, lo, hi, 12, 6, 2);
    rig_attach_plane(r, 0, 0);
    r->def.solver.tolerance = 1e-4;
    rig_start(r);
}

static OmPose tip_at(double x, double y, double z) {
    OmPose pose = {om_vec3(x, y, z), om_quat_identity()};
    return pose;
}

// Every vertex held is where the pose carries its place of the moment of grasping: exactly.
static void check_rigid(const TestRig* r, int arm, OmPose from, OmPose to, const double* x0) {
    OmPose carry = om_pose_mul(to, om_pose_inverse(from));
    for (int i = 0; i < r->mesh.nvert; ++i) {
        if (om_tissue_held_by(r->s)[i] != arm) continue;
        OmVec3 p = om_pose_apply(carry, om_load3(x0, i));
        assert_near(om_norm(om_sub(om_load3(om_tissue_x(r->s), i), p)), 0, 1e-15);
    }
}

static void test_reach(void** context) {
    (void)context;
    TestRig r;
    start(&r);
    OmPose tip = tip_at(0.041, 0.014, 0.011);
    int nheld, expected = 0;
    assert_ok(om_tissue_grasp(r.m, r.s, 1, tip, 0, &nheld));
    for (int i = 0; i < r.mesh.nvert; ++i) {
        bool is_near = om_norm(om_sub(om_load3(r.mesh.x, i), tip.p)) <= 0.005;
        assert_int_equal(om_tissue_held_by(r.s)[i], is_near ? 1 : -1);
        assert_true(om_tissue_is_prescribed(r.m, r.s, i) ==
                    (is_near || om_tissue_attached(r.s)[i]));
        expected += is_near;
    }
    assert_true(expected > 0);
    assert_int_equal(nheld, expected);
    assert_int_equal(om_tissue_nheld(r.s, 1), expected);
    assert_int_equal(om_tissue_nheld(r.s, 0), 0);
    rig_done(&r);
}

// Of shells the face under the tip is held, where it is nearer than the radius, and no vertex: jaws hold an area.
static void test_face(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, lo, om_vec3(0.06, 0.06, 0.005), 4, 4, 1);  // cells of 15 mm
    r.def.element = OM_ELEMENT_SHELL;
    rig_start(&r);
    int nheld;
    assert_ok(om_tissue_grasp(r.m, r.s, 0, tip_at(0.023, 0.021, 0.009), 0.005, &nheld));
    assert_int_equal(nheld, 4);
    for (int i = 0; i < r.mesh.nvert; ++i) {
        const double* x = r.mesh.x + 3 * i;
        bool is_corner = fabs(x[0] - 0.0225) < 0.008 && fabs(x[1] - 0.0225) < 0.008 && x[2] > 0;
        assert_int_equal(om_tissue_held_by(r.s)[i], is_corner ? 0 : -1);
    }
    // the face beside it: the other arm has two of its corners
    assert_ok(om_tissue_grasp(r.m, r.s, 1, tip_at(0.038, 0.021, 0.009), 0.005, &nheld));
    assert_int_equal(nheld, 2);
    assert_int_equal(om_tissue_nheld(r.s, 0), 4);
    om_tissue_release(r.s, 1);
    assert_int_equal(om_tissue_grasp(r.m, r.s, 1, tip_at(0.038, 0.021, 0.0101), 0.005, NULL),
                     OM_INVALID);
    // vertices within the radius come with it
    assert_ok(om_tissue_grasp(r.m, r.s, 1, tip_at(0.046, 0.046, 0.005), 0.005, &nheld));
    assert_int_equal(nheld, 4);
    assert_ok(om_tissue_grasp(r.m, r.s, 1, tip_at(0.046, 0.046, 0.005), 0.006, &nheld));
    assert_int_equal(nheld, 5);
    rig_done(&r);
}

// Lifted by 12 mm and turned by 40 degrees in 30 steps; between steps it follows a straight line.
static void test_follows_rigidly(void** context) {
    (void)context;
    TestRig r;
    start(&r);
    size_t bytes = 3 * (size_t)r.mesh.nvert * sizeof(double);
    double* x0 = om_alloc(bytes, 1);
    OmPose from = tip_at(0.055, 0.015, 0.01), tip = from;
    from.q = tip.q = om_quat_axis_angle(om_vec3(1, 2, 3), 1);
    memcpy(x0, om_tissue_x(r.s), bytes);
    assert_ok(om_tissue_grasp(r.m, r.s, 0, from, 0.006, NULL));
    for (int n = 1; n <= 30; ++n) {
        OmQuat turn = om_quat_axis_angle(om_vec3(0, 1, 0), -0.7 * n / 30);
        tip.p = om_add(from.p, om_vec3(-0.0001 * n, 0.0001 * n, 0.0004 * n));
        tip.q = om_quat_mul(turn, from.q);
        assert_ok(om_tissue_move_grasp(r.s, 0, tip));
        assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, NULL));
        check_rigid(&r, 0, from, tip, x0);
    }
    for (int i = 0; i < r.mesh.nvert; ++i)
        if (om_tissue_attached(r.s)[i])
            assert_memory_equal(om_tissue_x(r.s) + 3 * i, x0 + 3 * i, 3 * sizeof *x0);
    // released: nothing is held, no tool force is left, and it falls
    om_tissue_release(r.s, 0);
    om_tissue_release(r.s, 0);
    assert_int_equal(om_tissue_nheld(r.s, 0), 0);
    OmTissueForces f;
    assert_ok(om_tissue_get_forces(r.m, r.s, &f));
    assert_near(om_norm(f.grasp[0]), 0, 0);
    double z = om_tissue_x(r.s)[3 * 12 + 2];
    for (int n = 0; n < 15; ++n) assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, NULL));
    assert_below(om_tissue_x(r.s)[3 * 12 + 2], z - 0.005);
    om_free(x0);
    rig_done(&r);
}

// Two arms on two patches, then on overlapping ones: who comes second takes what is left.
static void test_two_arms(void** context) {
    (void)context;
    TestRig r;
    start(&r);
    OmPose a = tip_at(0.05, 0.005, 0.01), b = tip_at(0.05, 0.025, 0.01);
    int na, nb, total;
    size_t bytes = 3 * (size_t)r.mesh.nvert * sizeof(double);
    double* x0 = om_alloc(bytes, 1);
    memcpy(x0, om_tissue_x(r.s), bytes);
    assert_ok(om_tissue_grasp(r.m, r.s, 0, a, 0.006, &na));
    assert_ok(om_tissue_grasp(r.m, r.s, 1, b, 0.006, &nb));
    OmPose up = a, side = b;
    for (int n = 0; n < 20; ++n) {
        up.p.z += 0.0005;
        side.p.y += 0.0003;
        assert_ok(om_tissue_move_grasp(r.s, 0, up));
        assert_ok(om_tissue_move_grasp(r.s, 1, side));
        assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, NULL));
        check_rigid(&r, 0, a, up, x0);
        check_rigid(&r, 1, b, side, x0);
    }
    om_tissue_release(r.s, 0);
    assert_int_equal(om_tissue_nheld(r.s, 1), nb);
    om_tissue_release(r.s, 1);
    om_tissue_state_reset(r.m, r.s);
    assert_ok(om_tissue_grasp(r.m, r.s, 0, a, 0.012, &total));
    assert_ok(om_tissue_grasp(r.m, r.s, 1, a, 0.014, &nb));
    assert_int_equal(om_tissue_nheld(r.s, 0), total);
    for (int i = 0; i < r.mesh.nvert; ++i) {
        double d = om_norm(om_sub(om_load3(r.mesh.x, i), a.p));
        assert_int_equal(om_tissue_held_by(r.s)[i], d <= 0.012 ? 0 : d <= 0.014 ? 1 : -1);
    }
    // an arm that grasps again releases its vertices first
    assert_ok(om_tissue_grasp(r.m, r.s, 1, tip_at(0.03, 0.015, 0.01), 0.006, &nb));
    assert_int_equal(om_tissue_nheld(r.s, 1), nb);
    om_free(x0);
    rig_done(&r);
}

static void expect_refused(TestRig* r, int arm, OmPose tip, double radius, const char* word) {
    uint64_t before = om_tissue_state_hash(r->s);
    int nheld = -5;
    assert_status(om_tissue_grasp(r->m, r->s, arm, tip, radius, &nheld), OM_INVALID);
    if (!strstr(om_error_message(), word)) fail_msg("%s: no \"%s\"", om_error_message(), word);
    assert_true(om_tissue_state_hash(r->s) == before);
}

static void test_refused(void** context) {
    (void)context;
    TestRig r;
    start(&r);
    assert_ok(om_tissue_grasp(r.m, r.s, 1, tip_at(0.05, 0.015, 0.01), 0.006, NULL));
    expect_refused(&r, 0, tip_at(0.05, 0.015, 0.04), 0, "30.0 mm");  // the nearest is 30 mm away
    expect_refused(&r, 0, tip_at(0, 0.015, 0.01), 0.003, "attached");
    expect_refused(&r, 0, tip_at(0.05, 0.015, 0.01), 0.003, "other arm");
    expect_refused(&r, 2, tip_at(0.05, 0.015, 0.01), 0, "arm");
    expect_refused(&r, -1, tip_at(0.05, 0.015, 0.01), 0, "arm");
    expect_refused(&r, 0, tip_at((double)NAN, 0, 0), 0, "finite");
    expect_refused(&r, 0, tip_at(0.05, 0.015, 0.01), -1, "radius");
    expect_refused(&r, 0, tip_at(0.05, 0.015, 0.01), (double)NAN, "radius");
    // a refused grasp keeps what the arm holds
    expect_refused(&r, 1, tip_at(0.05, 0.015, 0.04), 0, "no tissue");
    assert_true(om_tissue_nheld(r.s, 1) > 0);
    uint64_t before = om_tissue_state_hash(r.s);
    assert_status(om_tissue_move_grasp(r.s, 1, tip_at(0, (double)INFINITY, 0)), OM_INVALID);
    assert_status(om_tissue_move_grasp(r.s, 7, tip_at(0, 0, 0)), OM_INVALID);
    assert_ok(om_tissue_move_grasp(r.s, 0, tip_at(0, 0, 0)));  // holds nothing: ignored
    om_tissue_release(r.s, 9);
    assert_true(om_tissue_state_hash(r.s) == before);
    rig_done(&r);
}

// Held elsewhere than at rest, by anchors; then by other vertices.
static void test_attachments(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, lo, hi, 12, 6, 2);
    rig_attach_plane(&r, 0, 0);
    r.def.material_default.young = 30000;  // three vertices carry all: softer, an element inverts
    rig_start(&r);
    const int vert[3] = {20, 5, 40};
    double anchor[9];
    for (int k = 0; k < 3; ++k)
        om_store3(anchor, k, om_add(om_load3(r.mesh.x, vert[k]), om_vec3(0, 0.001 * k, 0.002)));
    assert_ok(om_tissue_set_attachment(r.m, r.s, 3, vert, anchor, NULL));
    for (int n = 0; n < 5; ++n) assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, NULL));
    for (int k = 0; k < 3; ++k)
        assert_memory_equal(om_tissue_x(r.s) + 3 * vert[k], anchor + 3 * k, 3 * sizeof *anchor);
    assert_false(om_tissue_attached(r.s)[0]);
    uint64_t before = om_tissue_state_hash(r.s);
    const int wrong = r.mesh.nvert;
    assert_status(om_tissue_set_attachment(r.m, r.s, 1, &wrong, NULL, NULL), OM_INVALID);
    anchor[4] = (double)NAN;
    assert_status(om_tissue_set_attachment(r.m, r.s, 3, vert, anchor, NULL), OM_INVALID);
    assert_true(om_tissue_state_hash(r.s) == before);
    assert_ok(om_tissue_set_attachment(r.m, r.s, 0, NULL, NULL, NULL));
    for (int i = 0; i < r.mesh.nvert; ++i) assert_false(om_tissue_attached(r.s)[i]);
    rig_done(&r);
}

// Springs at the attached face: the stiffer, the nearer to a face held still; the difference falls as 1 / k.
static double lowest(double stiffness) {
    TestRig r;
    rig_box(&r, lo, hi, 6, 3, 1);
    rig_attach_plane(&r, 0, 0);
    r.def.material_default.young = 30000;
    r.def.attachment_stiffness = stiffness;
    rig_start(&r);
    rig_relax(&r, 25);
    double z = om_tissue_x(r.s)[3 * 6 + 2];
    rig_done(&r);
    return z;
}

static void test_stiff_springs(void** context) {
    (void)context;
    double held = lowest(0), soft = lowest(1e3), stiff = lowest(1e4), stiffest = lowest(1e5);
    printf("free end: held %.4f mm, springs of 1e3, 1e4, 1e5 N/m %.4f, %.4f, %.4f mm\n", 1e3 * held,
           1e3 * soft, 1e3 * stiff, 1e3 * stiffest);
    assert_near((soft - held) / (stiff - held), 10, 1.5);
    assert_near((stiff - held) / (stiffest - held), 10, 1.5);
    assert_near(stiffest, held, 5e-5);
}

// A sheet of n x n quadratic cells, its underside held up to x = 10 mm, is grasped 8 mm beside that by jaws that reach
// 6 mm, pulled 50 mm up and then 30 mm away. @return the largest force on the tool, N
static double force_beside(int n) {
    TestRig r;
    OmTissueForces f;
    rig_box(&r, lo, om_vec3(0.06, 0.06, 0.005), n, n, 1);
    r.def.element = OM_ELEMENT_QUADRATIC;
    r.def.material_default = (OmMaterial){.young = 6000, .poisson = 0.45, .law = OM_NEO_HOOKEAN};
    r.def.solver.tolerance = 1e-3;
    rig_start(&r);
    int nvert = 0, *vert = om_alloc((size_t)r.mesh.nvert * sizeof *vert, 1);
    for (int v = 0; v < r.mesh.nvert; ++v)
        if (r.mesh.x[3 * v] < 0.011 && r.mesh.x[3 * v + 2] < 1e-9) vert[nvert++] = v;
    assert_ok(om_tissue_set_attachment(r.m, r.s, nvert, vert, NULL, NULL));
    OmPose tip = tip_at(0.018, 0.03, 0.003);
    assert_ok(om_tissue_grasp(r.m, r.s, 0, tip, 0.006, NULL));
    double most = 0;
    for (int k = 1; k <= 80; ++k) {
        tip.p.z = 0.003 + 0.001 * (k < 50 ? k : 50);
        tip.p.x = 0.018 + 0.001 * (k > 50 ? k - 50 : 0);
        assert_ok(om_tissue_move_grasp(r.s, 0, tip));
        assert_true(om_tissue_step(r.m, r.s, r.w, 0.02, NULL) >= 0);
        assert_ok(om_tissue_get_forces(r.m, r.s, &f));
        most = fmax(most, om_norm(f.grasp[0]));
    }
    om_free(vert);
    rig_done(&r);
    return most;
}

// Midpoints between held vertices and jaws are free: held, they turn the elements there inside out, and the tool feels
// 60 N.
static void test_beside_an_attachment(void** context) {
    (void)context;
    const double coarse = force_beside(6), fine = force_beside(12);
    printf("grasp beside an attachment: cells of 10 mm %.2f N, of 5 mm %.2f N\n", coarse, fine);
    assert_near_rel(coarse, fine, 0.25);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_reach),           cmocka_unit_test(test_face),
        cmocka_unit_test(test_follows_rigidly), cmocka_unit_test(test_two_arms),
        cmocka_unit_test(test_refused),         cmocka_unit_test(test_attachments),
        cmocka_unit_test(test_stiff_springs),   cmocka_unit_test(test_beside_an_attachment)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
