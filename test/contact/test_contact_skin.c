// test_contact_skin.c: tissue on a body whose smooth surface rides on its mesh. On a stiff body the tissue lies as on a
// rigid organ of the same surface; the body feels what lies on it; facets are not felt; the state alone decides.
#include "self_rig.h"
#include "test_alloc.h"

#define RADIUS 0.04

typedef struct Scene {
    TestRig r;
    OmSdf sdf;
    int ball;  // first vertex of the ball
    OmMaterial material[2];
    double density[2];
    OmContactSkin skin;
    OmTissueObstacle organ;
} Scene;

typedef struct Setting {
    double young;     // Pa, of the ball; 0: it is rigid
    double gap;       // m, of the sheet above it
    double friction;  //
    double tilt;      // rad, of gravity
    int nworker;
    bool is_free;   // nothing holds the ball, and there is no gravity
    bool is_apart;  // the two do not touch
    bool is_linear;
    double edge;  // m, of the ball's mesh; 0: 16 mm
} Setting;

static double ball_fn(void* ctx, OmVec3 p) { return om_norm(p) - *(double*)ctx; }

static void make_field(OmSdf* sdf) {
    double radius = RADIUS, r = 1.3 * RADIUS;
    OmSdfDef def = om_sdf_default_def(0.002);
    assert_ok(
        om_sdf_from_function(ball_fn, &radius, om_vec3(-r, -r, -r), om_vec3(r, r, r), &def, sdf));
}

// A sheet of 36 x 36 x 6 mm and 3 kPa over a ball with edges of 16 mm, whose lower half is held. The middles of the
// ball's triangles are 0.8 mm inside the smooth ball.
static void start(Scene* s, Setting set) {
    memset(s, 0, sizeof *s);
    make_field(&s->sdf);
    double z = RADIUS + set.gap;
    rig_box(&s->r, om_vec3(-0.018, -0.018, z), om_vec3(0.018, 0.018, z + 0.006), 4, 4, 1);
    s->ball = s->r.mesh.nvert;
    s->material[0] = (OmMaterial){.law = OM_NEO_HOOKEAN, .young = 3000, .poisson = 0.45};
    s->material[1] = (OmMaterial){.law = OM_NEO_HOOKEAN, .young = set.young, .poisson = 0.45};
    s->density[0] = s->density[1] = 1000;
    if (set.young > 0) {
        OmTetMesh ball;
        self_ball(om_vec3(0, 0, 0), RADIUS, set.edge > 0 ? set.edge : 0.016, &ball);
        int *low = om_alloc((size_t)ball.nvert, sizeof *low), num = 0;
        for (int i = 0; i < ball.nvert; ++i)
            if (ball.x[3 * i + 2] < 0) low[num++] = s->ball + i;
        self_append(&s->r.mesh, &ball);
        if (!set.is_free) assert_ok(om_tet_mesh_add_set(&s->r.mesh, "attachment", low, num));
        om_free(low);
        s->r.def.nmaterial = 2;
        s->r.def.material = s->material;
        s->r.def.material_density = s->density;
    } else {
        s->r.def.material_default = s->material[0];
    }
    s->r.def.element = set.is_linear ? OM_ELEMENT_LINEAR : OM_ELEMENT_QUADRATIC;
    s->r.def.rayleigh_stiffness = set.is_free ? 0 : 0.01;
    s->r.def.rayleigh_mass = set.is_free ? 0 : 0.1;
    s->r.def.gravity = om_vec3(9.81 * sin(set.tilt), 0, -9.81 * cos(set.tilt));
    if (set.is_free) s->r.def.gravity = om_vec3(0, 0, 0);
    s->r.def.nown = set.young > 0 ? s->ball : 0;
    s->r.def.solver.tolerance = set.is_free ? 1e-6 : 1e-4;
    s->r.def.solver.nworker = set.nworker;
    rig_start(&s->r);
    OmContactDef def = om_contact_default_def();
    s->organ = om_sdf_obstacle(&s->sdf);
    s->skin = (OmContactSkin){&s->sdf, s->ball, s->r.mesh.nvert};
    if (set.young > 0 && !set.is_apart) def.nskin = 1, def.skin = &s->skin;
    if (set.young <= 0) def.nobstacle = 1, def.obstacle = &s->organ;
    def.friction = set.friction;
    rig_contact(&s->r, &def);
}

static void done(Scene* s) {
    rig_done(&s->r);
    om_sdf_done(&s->sdf);
}

static OmContactReport step(Scene* s, int nstep) {
    OmContactReport report;
    for (int n = 0; n < nstep; ++n)
        assert_ok(om_contact_step(s->r.cw, s->r.m, s->r.s, s->r.w, 0.02, &report));
    return report;
}

static bool is_sheet(const Scene* s, int i) { return om_contact_body_of(s->r.c, i) == 0; }

// On a ball of 10 MPa: forces balance, and each vertex that touches is at the smooth radius, though triangles are up
// to 0.8 mm inside; on the rigid field the middle of the sheet is at the same height.
static void test_rests_as_on_a_rigid_organ(void** state) {
    (void)state;
    Scene stiff, rigid;
    start(&stiff, (Setting){.young = 1e7, .gap = 5e-5, .friction = 0.3, .nworker = 1});
    assert_int_equal(om_contact_body_count(stiff.r.c), 2);
    OmContactReport report = step(&stiff, test_count(25, 120));
    double weight = 9.81 * self_mass(&stiff.r, 0);
    OmVec3 f = om_contact_body_force(stiff.r.cw, 0, 1), g = om_contact_body_force(stiff.r.cw, 1, 0);
    assert_near_rel(f.z, weight, 2e-3);
    assert_true(om_norm(om_add(f, g)) <= 1e-15 * om_norm(f));
    OmVec3 on[2] = {{0, 0, 0}, {0, 0, 0}};  // forces on the vertices of both
    for (int i = 0; i < om_tissue_mesh(stiff.r.m)->nvert; ++i) {
        OmVec3* sum = &on[om_contact_body_of(stiff.r.c, i)];
        *sum = om_add(*sum, om_load3(om_tissue_contact_force(stiff.r.s), i));
    }
    assert_near(om_norm(om_sub(on[0], f)), 0, 1e-12);
    assert_near(om_norm(om_add(on[0], on[1])), 0, 1e-12);
    assert_true(report.ntouch > 20);
    assert_below(report.self_penetration, 5e-6);
    assert_int_equal(report.nsolve, 1);
    for (int k = 0; k < report.ntouch; ++k) {
        const OmContactTouch* t = &report.touch[k];
        assert_int_equal(t->body[0], 0);
        assert_int_equal(t->body[1], 1);
        // trilinear on 2 mm: h^2 / 4 R = 25 um
        assert_near(om_norm(t->point), RADIUS, 4e-5);
        assert_true(om_dot(t->normal, om_normalize(t->point)) > 0.999);
    }
    // what om_tissue_get_forces says of the sheet alone
    OmTissueForces forces;
    assert_ok(om_tissue_get_forces(stiff.r.m, stiff.r.s, &forces));
    assert_near_rel(-forces.weight.z, weight, 1e-9);
    assert_near_rel(forces.contact.z, f.z, 1e-9);
    assert_near(om_norm(forces.attachment), 0, 1e-12);
    // as on the rigid field
    start(&rigid, (Setting){.gap = 5e-5, .friction = 0.3, .nworker = 1});
    for (int n = 0; n < test_count(25, 120); ++n)
        assert_true(om_contact_step(rigid.r.cw, rigid.r.m, rigid.r.s, rigid.r.w, 0.02, NULL) >= 0);
    const int middle = 12;  // of the underside
    assert_near(om_tissue_x(stiff.r.s)[3 * middle + 2], om_tissue_x(rigid.r.s)[3 * middle + 2],
                5e-6);
    done(&stiff);
    done(&rigid);
}

// Linear elements of half the radius: the middles of their triangles are 2.5 mm inside the smooth ball, and the sheet
// lies on the ball all the same. A sheet that begins inside of it comes out.
static void test_coarse_and_deep(void** state) {
    (void)state;
    for (int k = 0; k < 2; ++k) {
        Scene s;
        start(&s, (Setting){.young = 1e6,
                            .gap = k ? -15e-3 : 5e-5,
                            .friction = 0.3,
                            .nworker = 1,
                            .is_linear = true,
                            .edge = 0.02});
        OmContactReport report = step(&s, k ? 30 : 20);
        assert_int_equal(report.nsolve, 1);
        assert_below(report.self_penetration, 5e-6);
        assert_near_rel(om_contact_body_force(s.r.cw, 0, 1).z, 9.81 * self_mass(&s.r, 0), 0.02);
        for (int i = 0; i < s.ball; ++i)
            assert_true(om_norm(om_load3(om_tissue_x(s.r.s), i)) > RADIUS - 1e-4);
        done(&s);
    }
}

// A sheet that begins 12 mm and more below the surface, all of it deeper than a step could bring it, comes out.
static void test_all_of_it_deep_inside(void** state) {
    (void)state;
    Scene s;
    start(&s, (Setting){.young = 1e6, .gap = -28e-3, .nworker = 1, .is_linear = true});
    double deepest = -INFINITY;
    for (int i = 0; i < s.ball; ++i)
        deepest = fmax(deepest, om_norm(om_load3(om_tissue_x(s.r.s), i)));
    assert_below(deepest, RADIUS - 0.008);
    assert_true(step(&s, 1).ntouch > 20);  // before it falls, and searches farther by its speed
    step(&s, 12);
    for (int i = 0; i < s.ball; ++i)
        assert_true(om_norm(om_load3(om_tissue_x(s.r.s), i)) > RADIUS - 1e-4);
    done(&s);
}

// A ball of 3 kPa gives way where the sheet lies on it, and only downwards in the mean.
static void test_a_soft_body_gives_way(void** state) {
    (void)state;
    double top[2];
    for (int with = 0; with < 2; ++with) {
        Scene s;
        start(&s,
              (Setting){
                  .young = 3000, .gap = 5e-5, .friction = 0.3, .nworker = 1, .is_apart = !with});
        step(&s, 25);
        top[with] = -INFINITY;
        for (int i = 0; i < om_tissue_mesh(s.r.m)->nvert; ++i)
            if (!is_sheet(&s, i)) top[with] = fmax(top[with], om_tissue_x(s.r.s)[3 * i + 2]);
        if (with)
            assert_near_rel(om_contact_body_force(s.r.cw, 0, 1).z, 9.81 * self_mass(&s.r, 0), 3e-3);
        done(&s);
    }
    // 0.14 N on about 10 cm^2 of 3 kPa, 40 mm thick: 1 to 2 mm
    assert_true(top[0] - top[1] > 5e-4 && top[0] - top[1] < 3e-3);
}

// In flight the two collide: momentum is kept, angular momentum too, and no energy is gained.
static void test_momentum_of_a_collision(void** state) {
    (void)state;
    Scene s;
    start(&s,
          (Setting){.young = 20000, .gap = 1e-3, .friction = 0.2, .nworker = 1, .is_free = true});
    self_throw(&s.r, 0, om_vec3(0.05, 0, -0.3));
    OmVec3 p0, l0, p, l;
    om_tissue_get_momentum(s.r.m, s.r.s, &p0, &l0);
    double energy = self_energy(&s.r), push = 0;
    for (int n = 0; n < 12; ++n) {
        step(&s, 1);
        push = fmax(push, om_norm(om_contact_body_force(s.r.cw, 0, 1)));
        assert_true(self_energy(&s.r) <= energy * 1.001);
    }
    assert_true(push > 0.03);
    om_tissue_get_momentum(s.r.m, s.r.s, &p, &l);
    assert_below(om_distance(p, p0), 1e-4 * om_norm(p0));
    assert_below(om_distance(l, l0), 0.02 * om_norm(p0) * RADIUS);
    done(&s);
}

// Gravity is tilted: with enough friction the sheet stays, with less it slides; the bound of friction is kept.
static void test_friction(void** state) {
    (void)state;
    OmVec3 way[2];
    for (int k = 0; k < 2; ++k) {
        Scene s;
        start(
            &s,
            (Setting){
                .young = 1e6, .gap = 1e-4, .friction = k ? 0.1 : 0.5, .tilt = 0.25, .nworker = 1});
        step(&s, k ? 4 : 10);
        OmVec3 begin = self_mean(&s.r, 0, om_tissue_x(s.r.s));
        OmContactReport report = step(&s, k ? 2 : 10);
        way[k] = om_sub(self_mean(&s.r, 0, om_tissue_x(s.r.s)), begin);
        double mu = k ? 0.1 : 0.5, push = 0, drag = 0;
        for (int n = 0; n < report.ntouch; ++n) {
            const OmContactTouch* t = &report.touch[n];
            double normal = om_dot(t->force, t->normal);
            double along = om_norm(om_madd(t->force, -normal, t->normal));
            push += normal;
            drag += along;
            assert_true(along <= 1.02 * mu * normal + 1e-4);
        }
        if (k) {  // it slides everywhere, 3 mm a step, and follows the ball
            assert_true(drag > 0.9 * mu * push);
            assert_below(report.self_penetration, 5e-6);
        }
        done(&s);
    }
    assert_below(om_norm(way[0]), 2e-5);
    assert_true(way[1].x > 5e-3);
}

static void test_the_state_alone_decides(void** state) {
    (void)state;
    uint64_t hash[3];
    for (int k = 0; k < 3; ++k) {
        Scene s;
        start(&s,
              (Setting){.young = 10000, .gap = 5e-4, .friction = 0.3, .nworker = k == 1 ? 2 : 1});
        step(&s, 4);
        if (k == 2) {  // a new work continues from the same state
            om_contact_work_destroy(s.r.cw);
            om_tissue_work_destroy(s.r.w);
            assert_ok(om_tissue_work_create(s.r.m, &s.r.w));
            assert_ok(om_contact_work_create(s.r.c, &s.r.cw));
        }
        step(&s, 2);
        hash[k] = om_tissue_state_hash(s.r.s);
        done(&s);
    }
    assert_true(hash[0] == hash[1]);
    assert_true(hash[0] == hash[2]);
}

// A tool grasps the sheet alone, though vertices of the ball are as near.
static void test_tools_leave_the_body(void** state) {
    (void)state;
    Scene s;
    int nheld;
    start(&s, (Setting){.young = 10000, .gap = 5e-4, .nworker = 1});
    OmPose tip = {om_vec3(0, 0, RADIUS), om_quat_identity()};
    assert_ok(om_tissue_grasp(s.r.m, s.r.s, 0, tip, 0.012, &nheld));
    assert_true(nheld > 0);
    for (int i = 0; i < om_tissue_mesh(s.r.m)->nvert; ++i)
        if (om_tissue_held_by(s.r.s)[i] >= 0) assert_true(is_sheet(&s, i));
    tip.p.z = -RADIUS;
    assert_status(om_tissue_grasp(s.r.m, s.r.s, 0, tip, 0.012, &nheld), OM_INVALID);
    done(&s);
}

// A tool that starts at once drags the sheet by 4 mm in a step: places that were predicted are 4 mm beside those at the
// end, where the ball is 0.2 mm lower.
static void test_a_sudden_pull_follows_the_ball(void** state) {
    (void)state;
    Scene s;
    start(&s, (Setting){.young = 1e6, .gap = 5e-5, .friction = 0.1, .nworker = 1});
    step(&s, 6);
    OmPose tip = {om_vec3(0.018, 0, 0.039), om_quat_identity()};
    assert_ok(om_tissue_grasp(s.r.m, s.r.s, 0, tip, 0.008, NULL));
    for (int n = 0; n < 3; ++n) {
        tip.p.x += 0.004;
        assert_ok(om_tissue_move_grasp(s.r.s, 0, tip));
        OmContactReport report = step(&s, 1);
        assert_true(report.ntouch > 10);
        assert_int_equal(report.tissue.substeps, 1);
        assert_below(report.self_penetration, 1e-5);
    }
    done(&s);
}

static OmStatus create(void* ctx) {
    Scene* s = ctx;
    OmContactDef def = om_contact_default_def();
    OmContact* c = NULL;
    OmContactWork* cw = NULL;
    def.nskin = 1, def.skin = &s->skin;
    OmStatus status = om_contact_create(&def, s->r.m, &c);
    if (status == OM_OK) status = om_contact_work_create(c, &cw);
    om_contact_work_destroy(cw);
    om_contact_destroy(c);
    return status;
}

static void test_what_is_refused(void** state) {
    (void)state;
    Scene s;
    start(&s, (Setting){.young = 10000, .gap = 5e-4, .nworker = 1});
    OmContactSkin good = s.skin;
    assert_ok(create(&s));
    s.skin.vert_end = s.r.mesh.nvert + 1;
    assert_status(create(&s), OM_INVALID);
    s.skin = good, s.skin.vert_begin = -1;
    assert_status(create(&s), OM_INVALID);
    s.skin = good, s.skin.vert_begin = s.ball + 1;  // not the whole ball
    assert_status(create(&s), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "not a whole piece"));
    s.skin = good, s.skin.sdf = NULL;
    assert_status(create(&s), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "skin[0]"));
    done(&s);
}

static void test_allocations(void** state) {
    (void)state;
    Scene s;
    start(&s, (Setting){.young = 10000, .gap = 5e-4, .nworker = 1});
    assert_true(test_failing_allocations(create, &s, test_stride(5)) > 2);
    done(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rests_as_on_a_rigid_organ),
        cmocka_unit_test(test_coarse_and_deep),
        cmocka_unit_test(test_all_of_it_deep_inside),
        cmocka_unit_test(test_a_soft_body_gives_way),
        cmocka_unit_test(test_momentum_of_a_collision),
        cmocka_unit_test(test_friction),
        cmocka_unit_test(test_the_state_alone_decides),
        cmocka_unit_test(test_tools_leave_the_body),
        cmocka_unit_test(test_a_sudden_pull_follows_the_ball),
        cmocka_unit_test(test_what_is_refused),
        cmocka_unit_test(test_allocations),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
