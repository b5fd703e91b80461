// test_contact_self.c: tissue in contact with itself, and bodies of one mesh with each other: balance, weight, no
// passing through, friction, what is refused, and that the state alone decides.
#include "self_rig.h"

// A small block above a larger one, `gap` m apart, on the floor; not one vertex above another.
static void rig_blocks(TestRig* r, double gap, int n, int nworker, double friction) {
    OmTetMesh small;
    rig_box(r, om_vec3(0, 0, 0), om_vec3(0.04, 0.04, 0.02), n, n, n / 2);
    assert_ok(om_tet_mesh_box(om_vec3(0.011, 0.009, 0.02 + gap), om_vec3(0.031, 0.029, 0.04 + gap),
                              n / 2, n / 2, n / 2, &small));
    self_append(&r->mesh, &small);
    r->def.solver.nworker = nworker;
    r->def.solver.tolerance = 1e-4;
    rig_start(r);
    OmTissueObstacle board = om_plane_obstacle(&self_floor);
    OmContactDef def = rig_on(&board);
    def.self_contact = true;
    def.self_friction = friction;
    rig_contact(r, &def);
}

static double lowest(const TestRig* r, int body) {
    double z = INFINITY;
    for (int i = 0; i < om_tissue_mesh(r->m)->nvert; ++i)
        if (om_contact_body_of(r->c, i) == body) z = fmin(z, om_tissue_x(r->s)[3 * i + 2]);
    return z;
}

static OmVec3 center(const TestRig* r, int body) { return self_mean(r, body, om_tissue_x(r->s)); }

// A block falls on another: it comes to rest on it, the force between them is its weight, and the forces of both sides
// are opposite to rounding.
static void test_a_block_rests_on_another(void** state) {
    (void)state;
    TestRig r;
    rig_blocks(&r, 0.01, 4, 1, 0.3);
    assert_int_equal(om_contact_body_count(r.c), 2);
    double weight = 0, gain = 0;
    for (int i = 0; i < om_tissue_mesh(r.m)->nvert; ++i)
        if (om_contact_body_of(r.c, i) == 1) weight += 9.81 * om_tissue_mass(r.m)[i];
    OmContactReport report;
    OmVec3 place = {0, 0, 0};
    for (int n = 0; n < 150; ++n) {
        assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, &report));
        if (n == 100) place = om_sub(center(&r, 1), center(&r, 0));
        OmVec3 f = om_contact_body_force(r.cw, 1, 0), g = om_contact_body_force(r.cw, 0, 1);
        assert_true(om_norm(om_add(f, g)) <= 1e-15 * om_norm(f));
        gain = fmax(gain, report.tissue.energy_gain);
        if (n % 10 == 9) self_assert_no_crossing(&r);
    }
    assert_below(gain, 0.01 * weight * 0.01);  // of the energy of the fall
    // in 1 s; friction is viscous below 0.01 mm/s
    assert_below(om_distance(om_sub(center(&r, 1), center(&r, 0)), place), 2e-5);
    assert_near_rel(om_contact_body_force(r.cw, 1, 0).z, weight, 1e-3);
    double edge = 0.009;  // about the mean edge of the surfaces; the default thickness is a tenth
    assert_true(report.ntouch > 0);
    for (int k = 0; k < report.ntouch; ++k) {
        const OmContactTouch* t = &report.touch[k];
        double sum = t->weight[0] + t->weight[1] + t->weight[2] + t->weight[3];
        assert_near(sum, 0, 1e-12);
        assert_true(fabs(t->gap) < 0.01 * 0.1 * edge);
        assert_true(om_dot(t->force, t->normal) > 0);
    }
    assert_below(report.self_penetration, 0.01 * 0.1 * edge);
    // forces on vertices sum to those of the floor: contact inside the tissue cancels
    OmVec3 sum = {0, 0, 0};
    for (int i = 0; i < om_tissue_mesh(r.m)->nvert; ++i)
        sum = om_add(sum, om_load3(om_tissue_contact_force(r.s), i));
    assert_true(om_distance(sum, report.obstacle[0].force) < 1e-9);
    rig_done(&r);
}

// Without friction the block slides off another and lies beside it.
static void test_without_friction_it_slides_off(void** state) {
    (void)state;
    TestRig r;
    rig_blocks(&r, 0.002, 4, 1, 0);
    self_throw(&r, 1, om_vec3(0.1, 0, 0));
    double x = 0;
    for (int n = 0; n < 60; ++n) {
        assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, NULL));
        if (n == 40) x = lowest(&r, 1);
        if (n % 10 == 9) self_assert_no_crossing(&r);
    }
    assert_below(lowest(&r, 1), 1e-3);
    assert_true(x >= -1e-4);
    rig_done(&r);
}

static bool is_low(OmVec3 p) { return p.z < 0.0051; }

static bool is_border(OmVec3 p) {
    return p.z < 0.01 && (fabs(p.x - 0.03) > 0.0299 || fabs(p.y - 0.03) > 0.0299);
}

static double strongest(const OmContactReport* report) {
    double push = 0;
    for (int k = 0; k < report->ntouch; ++k)
        push = fmax(push, om_dot(report->touch[k].force, report->touch[k].normal));
    return push;
}

// On a slope of 14 degrees, tan 0.25: it slides with g (sin - mu cos) at mu 0.1, and stays at 0.5. Coulomb's bound
// holds to 2 %.
static void test_friction_on_a_slope(void** state) {
    (void)state;
    const double mu[2] = {0.1, 0.5}, slope = 0.25;
    for (int k = 0; k < 2; ++k) {
        TestRig r;
        OmTetMesh small;
        rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.12, 0.03, 0.005), 12, 3, 1);
        assert_ok(om_tet_mesh_box(om_vec3(0.096, 0.007, 0.0059), om_vec3(0.112, 0.023, 0.0099), 2,
                                  2, 1, &small));
        self_append(&r.mesh, &small);
        self_attach(&r, is_low);
        r.def.gravity = om_scale(9.81, om_normalize(om_vec3(-slope, 0, -1)));
        r.def.rayleigh_mass = 0;
        r.def.solver.tolerance = 1e-5;
        rig_start(&r);
        OmContactDef def = om_contact_default_def();
        def.self_contact = true;
        def.self_friction = mu[k];
        rig_contact(&r, &def);
        double x[2] = {0, 0}, h = 0.01;
        OmContactReport report;
        for (int n = 0; n < 30; ++n) {
            double before = center(&r, 1).x;
            assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, h, &report));
            for (int q = 0; q < report.ntouch; ++q) {
                const OmContactTouch* t = &report.touch[q];
                double push = om_dot(t->force, t->normal);
                double drag = om_norm(om_madd(t->force, -push, t->normal));
                assert_true(drag <= 1.02 * mu[k] * fmax(push, 0.05 * strongest(&report)) + 1e-12);
            }
            if (n == 9) x[0] = (center(&r, 1).x - before) / h;
            if (n == 29) x[1] = (center(&r, 1).x - before) / h;
        }
        double a = (x[0] - x[1]) / (20 * h), g = 9.81 / sqrt(1 + slope * slope);
        if (k == 0) assert_near_rel(a, g * (slope - mu[0]), 0.03);
        if (k == 1) assert_below(fabs(x[1]), 2e-4);
        rig_done(&r);
    }
}

// The bottom of a block on a held sheet is 5.5 mm above a board, near enough to be watched. The board bears nothing:
// without it the steps are the same to the bit, with as many solves.
static void test_a_board_below_has_no_effect(void** state) {
    (void)state;
    uint64_t hash[2];
    int nsolve[2] = {0, 0};
    for (int k = 0; k < 2; ++k) {
        TestRig r;
        OmTetMesh small;
        rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.12, 0.03, 0.004), 12, 3, 1);
        assert_ok(om_tet_mesh_box(om_vec3(0.05, 0.007, 0.0052), om_vec3(0.066, 0.023, 0.0092), 2, 2,
                                  1, &small));
        self_append(&r.mesh, &small);
        self_attach(&r, is_low);
        rig_start(&r);
        const OmContactPlane below = {{0, 0, -0.0005}, {0, 0, 1}};
        OmTissueObstacle board = om_plane_obstacle(&below);
        OmContactDef def = k ? rig_on(&board) : om_contact_default_def();
        def.self_contact = true;
        def.self_friction = 0.3;
        rig_contact(&r, &def);
        OmContactReport report;
        for (int n = 0; n < 10; ++n) {
            assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.01, &report));
            nsolve[k] += report.nsolve;
        }
        assert_true(report.ntouch > 0);
        assert_int_equal(report.ncontact, 0);
        hash[k] = om_tissue_state_hash(r.s);
        rig_done(&r);
    }
    assert_int_equal(nsolve[0], nsolve[1]);
    assert_true(hash[0] == hash[1]);
}

static bool is_sheet(OmVec3 p) { return p.z < 0.00401; }

// A tilted block hits a held flat sheet with a corner, 0.05 mm beside an edge of the sheet's triangles: what is nearest
// in a flat face lies along its normal.
static void test_a_flat_face_pushes_along_its_normal(void** state) {
    (void)state;
    TestRig r;
    OmTetMesh small;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.04, 0.04, 0.004), 16, 16, 1);
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.008, 0.008, 0.008), 4, 4, 4, &small));
    const OmQuat tilt = om_quat_axis_angle(om_normalize(om_vec3(3, -2, 0)), 0.8);
    OmVec3 tip = om_vec3(0, 0, INFINITY);
    for (int i = 0; i < small.nvert; ++i) {
        const OmVec3 p = om_quat_rotate(tilt, om_load3(small.x, i));
        om_store3(small.x, i, p);
        if (p.z < tip.z) tip = p;
    }
    for (int i = 0; i < small.nvert; ++i)
        om_store3(small.x, i,
                  om_add(om_vec3(0.01755, 0.0163, 0.0044), om_sub(om_load3(small.x, i), tip)));
    self_append(&r.mesh, &small);
    self_attach(&r, is_sheet);
    rig_start(&r);
    OmContactDef def = om_contact_default_def();
    def.self_contact = true;
    rig_contact(&r, &def);
    self_throw(&r, 1, om_vec3(0, 0, -0.1));
    int ntouch = 0;
    double slant = 0;
    for (int n = 0; n < 10; ++n) {
        OmContactReport report;
        assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.001, &report));
        ntouch += report.ntouch;
        for (int k = 0; k < report.ntouch; ++k)
            slant = fmax(slant, 1 - fabs(report.touch[k].normal.z));
    }
    assert_true(ntouch > 0);
    assert_below(slant, 1e-4);  // 0.8 degrees: the sheet gives way a little
    rig_done(&r);
}

// A step is a function of the state: copies of it, other workers and an interruption give the same bytes.
static void test_a_step_depends_on_the_state_alone(void** state) {
    (void)state;
    uint64_t first = 0;
    for (int nworker = 1; nworker <= 4; nworker *= 2) {
        TestRig r;
        rig_blocks(&r, 0.002, 4, nworker, 0.2);
        size_t size = om_tissue_state_size(r.m);
        void* copy = om_alloc(1, size);
        for (int n = 0; n < 12; ++n) {
            if (n == 6) memcpy(copy, r.s, size);
            assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, NULL));
        }
        uint64_t hash = om_tissue_state_hash(r.s);
        if (nworker == 1) first = hash;
        assert_true(hash == first);
        memcpy((void*)r.s, copy, size);
        for (int n = 6; n < 12; ++n) assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, NULL));
        assert_true(om_tissue_state_hash(r.s) == first);
        om_free(copy);
        rig_done(&r);
    }
}

// 0.5 m/s at steps of 20 ms: 10 mm a step against a sheet of 4 mm, which is held at its border.
static void test_fast_bodies_do_not_pass_through(void** state) {
    (void)state;
    TestRig r;
    OmTetMesh small;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.06, 0.06, 0.004), 6, 6, 1);
    assert_ok(om_tet_mesh_box(om_vec3(0.022, 0.021, 0.02), om_vec3(0.037, 0.036, 0.035), 2, 2, 2,
                              &small));
    self_append(&r.mesh, &small);
    self_attach(&r, is_border);
    r.def.solver.tolerance = 1e-4;
    rig_start(&r);
    OmContactDef def = om_contact_default_def();
    def.self_contact = true;
    rig_contact(&r, &def);
    self_throw(&r, 1, om_vec3(0, 0, -0.5));
    for (int n = 0; n < 40; ++n) {
        OmStatus status = om_contact_step(r.cw, r.m, r.s, r.w, 0.02, NULL);
        if (status < 0) fail_msg("step %d: %s", n, om_error_message());
        self_assert_no_crossing(&r);
    }
    // it lies in the sag of the sheet
    assert_true(om_contact_body_force(r.cw, 1, 0).z > 0);
    rig_done(&r);
}

// Through a sheet in a slant, 30 mm aside and 14 mm down in one step: at its end the body would be beside the sheet.
static void test_a_path_through_a_sheet(void** state) {
    (void)state;
    TestRig r;
    OmTetMesh small;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.06, 0.06, 0.004), 6, 6, 1);
    self_attach(&r, is_low);  // all of it
    assert_ok(om_tet_mesh_box(om_vec3(0.035, 0.021, 0.008), om_vec3(0.05, 0.036, 0.018), 2, 2, 2,
                              &small));
    self_append(&r.mesh, &small);
    r.def.gravity = om_vec3(0, 0, 0);
    r.def.solver.tolerance = 1e-4;
    rig_start(&r);
    OmContactDef def = om_contact_default_def();
    def.self_contact = true;
    rig_contact(&r, &def);
    self_throw(&r, 1, om_vec3(1.5, 0, -0.7));
    assert_true(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, NULL) >= 0);
    assert_true(lowest(&r, 1) > -0.001);  // -0.006 without contact
    rig_done(&r);
}

// The two sides of a sheet are nearer to each other than the thickness, through the tissue: they are not in contact.
// Nor are neighbours of one body that were as near at rest.
static void test_a_thin_sheet_is_left_alone(void** state) {
    (void)state;
    TestRig r;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.04, 0.04, 0.001), 8, 8, 1);
    r.def.gravity = om_vec3(0, 0, 0);
    rig_start(&r);
    OmContactDef def = om_contact_default_def();
    def.self_contact = true;
    def.self_thickness = 0.002;
    rig_contact(&r, &def);
    OmContactReport report;
    for (int n = 0; n < 5; ++n) {
        assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, &report));
        assert_int_equal(report.ntouch, 0);
    }
    for (int i = 0; i < 3 * om_tissue_mesh(r.m)->nvert; ++i)
        assert_near(om_tissue_x(r.s)[i], om_tissue_mesh(r.m)->x[i], 1e-8);  // floats
    rig_done(&r);
}

// Bodies that begin nearer than the thickness are pushed apart at recover_speed, not at once, to the thickness.
static void test_bodies_too_near_at_the_beginning(void** state) {
    (void)state;
    TestRig r;
    OmTetMesh other;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.02, 0.02, 0.01), 4, 4, 2);
    assert_ok(om_tet_mesh_box(om_vec3(0.001, 0.002, 0.0102), om_vec3(0.019, 0.018, 0.0202), 3, 3, 2,
                              &other));
    self_append(&r.mesh, &other);
    r.def.gravity = om_vec3(0, 0, 0);
    r.def.rayleigh_mass = 50;  // they stop where nothing pushes them
    rig_start(&r);
    OmContactDef def = om_contact_default_def();
    def.self_contact = true;
    def.self_thickness = 0.001;
    def.recover_speed = 0.01;
    rig_contact(&r, &def);
    double begin = center(&r, 1).z - center(&r, 0).z, before = begin;
    for (int n = 0; n < 60; ++n) {
        assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.01, NULL));
        double now = center(&r, 1).z - center(&r, 0).z;
        assert_true(now - before < 1.5 * 0.01 * 0.01);
        before = now;
    }
    assert_near(before - begin, 0.001,
                0.0002);  // from 0.2 mm to 1 mm, and on until its speed is damped
    rig_done(&r);
}

static void test_what_is_refused(void** state) {
    (void)state;
    TestRig r;
    rig_blocks(&r, 0.01, 2, 1, 0);
    OmContactDef def = om_contact_default_def();
    OmContact* c;
    def.self_contact = true;
    def.self_thickness = -1;
    assert_status(om_contact_create(&def, r.m, &c), OM_INVALID);
    def.self_thickness = 0;
    def.self_friction = 11;
    assert_status(om_contact_create(&def, r.m, &c), OM_INVALID);
    assert_null(c);
    // factors of a matrix take no terms outside its pattern
    OmTissueDef tissue = r.def;
    OmTissueModel* m;
    tissue.solver.preconditioner = OM_CHOLESKY;
    tissue.mesh = &r.mesh;
    assert_ok(om_tissue_create(&tissue, &m));
    def.self_friction = 0;
    assert_status(om_contact_create(&def, m, &c), OM_UNAVAILABLE);
    om_tissue_destroy(m);
    // one block pushed into the other: crossings are found, with their place
    double* x = om_alloc(3 * (size_t)om_tissue_mesh(r.m)->nvert, sizeof *x);
    for (int i = 0; i < om_tissue_mesh(r.m)->nvert; ++i) {
        OmVec3 p = om_load3(om_tissue_x(r.s), i);
        om_store3(x, i, om_contact_body_of(r.c, i) == 1 ? om_sub(p, om_vec3(0, 0, 0.018)) : p);
    }
    assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
    int num;
    OmVec3 at;
    assert_ok(om_contact_find_crossing(r.cw, r.s, &num, &at));
    assert_true(num > 0);
    assert_true(at.x > 0 && at.x < 0.04 && at.z > 0 && at.z < 0.04);
    om_free(x);
    rig_done(&r);
    // without self_contact there are no bodies and no crossings
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.04, 0.04, 0.02), 2, 2, 1);
    rig_start(&r);
    def = om_contact_default_def();
    rig_contact(&r, &def);
    assert_status(om_contact_find_crossing(r.cw, r.s, &num, &at), OM_UNAVAILABLE);
    assert_int_equal(om_contact_body_count(r.c), 0);
    assert_int_equal(om_contact_body_of(r.c, 0), -1);
    rig_done(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_block_rests_on_another),
        cmocka_unit_test(test_without_friction_it_slides_off),
        cmocka_unit_test(test_friction_on_a_slope),
        cmocka_unit_test(test_a_step_depends_on_the_state_alone),
        cmocka_unit_test(test_a_board_below_has_no_effect),
        cmocka_unit_test(test_a_flat_face_pushes_along_its_normal),
        cmocka_unit_test(test_fast_bodies_do_not_pass_through),
        cmocka_unit_test(test_a_path_through_a_sheet),
        cmocka_unit_test(test_a_thin_sheet_is_left_alone),
        cmocka_unit_test(test_bodies_too_near_at_the_beginning),
        cmocka_unit_test(test_what_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
