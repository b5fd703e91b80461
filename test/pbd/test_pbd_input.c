// test_pbd_input.c: clusters cover everything, wrong definitions name their field, forces balance, contact holds.
#include "pbd_rig.h"

static void expect(PbdRig* p, const char* word) {
    OmTissueModel* m;
    p->r.def.engine = om_pbd_engine();
    p->r.def.options = &p->pbd;
    p->r.def.mesh = &p->r.mesh;
    assert_status(om_tissue_create(&p->r.def, &m), OM_INVALID);
    if (!strstr(om_error_message(), word))
        fail_msg("\"%s\" does not name %s", om_error_message(), word);
    assert_null(m);
}

static void test_definitions(void** state) {
    (void)state;
    PbdRig p;
    pbd_sheet(&p, 0.03);
    OmPbdDef good = p.pbd;
    p.pbd.cluster_radius = 0.49 * p.pbd.cluster_spacing, expect(&p, "half of cluster_spacing");
    p.pbd = good, p.pbd.cluster_stiffness = 1.1, expect(&p, "cluster_stiffness");
    p.pbd = good, p.pbd.cluster_stiffness = NAN, expect(&p, "cluster_stiffness");
    p.pbd = good, p.pbd.cluster_radius = INFINITY, expect(&p, "cluster_radius");
    p.pbd = good, p.pbd.substeps = -1, expect(&p, "substeps");
    p.pbd = good, p.pbd.iterations = 0, expect(&p, "iterations");
    p.pbd = good, p.pbd.damping = -1, expect(&p, "damping");
    p.pbd = good, p.pbd.friction = NAN, expect(&p, "friction");
    p.pbd = good, p.pbd.particle_volume = 0, expect(&p, "particle_volume");
    p.pbd = good, p.pbd.cookie = 0, expect(&p, "om_pbd_default_def");
    p.pbd = good, p.pbd.kind = (OmPbdKind)7, expect(&p, "kind");
    p.pbd = good, p.pbd.kind = OM_PBD_ELASTIC, expect(&p, "elements");
    OmTissueDef fem = om_tissue_default_def(om_fem_engine(), &p.r.mesh);
    OmTissueModel* m;
    assert_status(om_tissue_create(&fem, &m), OM_INVALID);
    om_tet_mesh_done(&p.r.mesh);
    double volume;
    assert_status(om_pbd_sample_sheet(0, 1, 1, 0.1, &p.r.mesh, &volume), OM_INVALID);
    assert_status(om_pbd_sample_sheet(1, 1, 1, 1e-5, &p.r.mesh, &volume), OM_INVALID);
}

// Any spacing and radius: each particle in a cluster, and the body in one piece.
static void test_clusters_cover(void** state) {
    (void)state;
    for (int k = 0; k < 60; ++k) {
        OmRng rng = om_rng_init(5, (uint64_t)k);
        PbdRig p;
        pbd_sheet(&p, 0.045);
        p.pbd.cluster_spacing = om_rng_range(&rng, 0.005, 0.035);
        p.pbd.cluster_radius = fmax(0.0045, om_rng_range(&rng, 0.5, 1.5) * p.pbd.cluster_spacing);
        pbd_start(&p);
        const int *adr, *vert;
        int ncluster = om_pbd_clusters(p.r.m, &adr, &vert), n = p.r.mesh.nvert;
        int* part = om_alloc((size_t)n, sizeof *part);
        for (int i = 0; i < n; ++i) part[i] = -1;
        for (int c = 0; c < ncluster; ++c)
            for (int a = adr[c]; a < adr[c + 1]; ++a) part[vert[a]] = 0;
        for (int i = 0; i < n; ++i) assert_int_equal(part[i], 0);
        part[0] = 1;  // spread over clusters until nothing changes
        for (bool grows = true; grows;) {
            grows = false;
            for (int c = 0; c < ncluster; ++c) {
                int top = 0;
                for (int a = adr[c]; a < adr[c + 1]; ++a) top |= part[vert[a]];
                for (int a = adr[c]; a < adr[c + 1]; ++a)
                    if (part[vert[a]] != top) part[vert[a]] = top, grows = true;
            }
        }
        for (int i = 0; i < n; ++i) assert_int_equal(part[i], 1);
        om_free(part);
        pbd_done(&p);
    }
}

// The box's particles: cell centres, all of the volume.
static void test_sampling(void** state) {
    (void)state;
    OmTetMesh box, particles;
    OmSurface skin;
    double volume;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.155, 0.1, 0.07), 2, 2, 2, &box));
    assert_ok(om_tet_mesh_boundary(&box, &skin, NULL));
    assert_ok(om_pbd_sample_surface(&skin, 0.005, &particles, &volume));
    assert_int_equal(particles.nvert, 31 * 20 * 14);
    assert_near_rel(volume * particles.nvert, 0.155 * 0.1 * 0.07, 1e-12);
    assert_near(om_distance(om_load3(particles.x, 0), om_vec3(0.0025, 0.0025, 0.0025)), 0, 1e-12);
    om_tet_mesh_done(&particles);
    OmSdf sdf;
    OmSdfDef def = om_sdf_default_def(0.0025);
    assert_ok(om_sdf_from_surface(&skin, &def, &sdf));
    assert_ok(om_pbd_sample_sdf(&sdf, 0.005, &particles, &volume));
    // the field rounds edges off by its spacing: a particle layer more or less there
    assert_near_rel(volume * particles.nvert, 0.155 * 0.1 * 0.07, 0.02);
    om_sdf_done(&sdf);
    om_tet_mesh_done(&particles);
    om_surface_done(&skin);
    om_tet_mesh_done(&box);
}

// At rest the attachments and the board carry a body's weight, whatever its stiffness; nothing is below the board.
static void test_forces_balance(void** state) {
    (void)state;
    PbdRig p;
    pbd_sheet(&p, 0.06);
    rig_attach_plane(&p.r, 0, p.r.mesh.x[0]);
    pbd_start(&p);
    OmContactPlane plane = {om_vec3(0, 0, -0.02), om_vec3(0, 0, 1)};
    OmTissueObstacle board = om_plane_obstacle(&plane);
    OmContactDef def = rig_on(&board);
    rig_contact(&p.r, &def);
    OmVec3 tip = om_load3(p.r.mesh.x, 19);
    OmPose pose = {tip, om_quat_identity()};
    assert_ok(om_tissue_grasp(p.r.m, p.r.s, 0, pose, 0.004, NULL));
    OmContactReport report;
    for (int n = 0; n < 1000; ++n)
        assert_ok(om_contact_step(p.r.cw, p.r.m, p.r.s, p.r.w, 0.02, &report));
    OmTissueForces f;
    assert_ok(om_tissue_get_forces(p.r.m, p.r.s, &f));
    OmVec3 sum = om_add(om_add(f.grasp[0], f.attachment), om_add(f.contact, f.weight));
    assert_below(om_norm(sum), 1e-6 * om_norm(f.weight) * test_tol_scale());  // 20 s of damping
    assert_near_rel(om_norm(f.weight), 9.81 * 1000 * 0.06 * 0.06 * 0.003, 1e-12);
    assert_true(report.ncontact > 50 && f.contact.z > 0.1 * -f.weight.z);
    assert_near(om_distance(report.force, f.contact), 0, 1e-12);
    assert_below(report.penetration, 1e-5);
    for (int i = 0; i < p.r.mesh.nvert; ++i)
        assert_true(om_load3(om_tissue_x(p.r.s), i).z > -0.017 - 1e-5);  // 3 mm kept
    assert_false(om_engine_capabilities(om_tissue_engine(p.r.m)) & OM_ENGINE_FORCES);
    double* value = om_alloc(1, 8);
    assert_status(om_tissue_get_internal_force(p.r.m, p.r.s, value), OM_UNAVAILABLE);
    om_free(value);
    pbd_done(&p);
}

// A block on a slope stays below the angle of friction and slides above it, as fast as Coulomb has it. The engine's
// own coefficient holds where the contact gives none, the contact's where it gives one; 0 is none.
static void test_friction(void** state) {
    (void)state;
    for (int k = 0; k < 3; ++k) {
        PbdRig p;
        pbd_box(&p, om_vec3(0.04, 0.04, 0.02), 4, 4, 2);
        p.pbd.damping = 0;
        p.pbd.friction = 0.35;
        p.pbd.cluster_spacing = p.pbd.cluster_radius = 0.1;
        p.pbd.cluster_stiffness = 1;
        double angle = k == 0 ? atan(0.3) : atan(0.6);
        p.r.def.gravity = om_vec3(9.81 * sin(angle), 0, -9.81 * cos(angle));
        pbd_start(&p);
        OmContactPlane plane = {om_vec3(0, 0, 0), om_vec3(0, 0, 1)};
        OmTissueObstacle board = om_plane_obstacle(&plane);
        OmContactDef def = rig_on(&board);
        if (k == 2) def.friction = 0;
        rig_contact(&p.r, &def);
        for (int n = 0; n < 50; ++n)
            assert_ok(om_contact_step(p.r.cw, p.r.m, p.r.s, p.r.w, 0.01, NULL));
        double way = om_tissue_x(p.r.s)[0] - p.r.mesh.x[0], t = 0.5;
        double a = 9.81 * (sin(angle) - (k == 2 ? 0 : 0.35) * cos(angle));
        if (k == 0)
            assert_near(way, 0, 1e-4);
        else
            assert_near_rel(way, 0.5 * a * t * t, 0.03);  // first order in the substep
        pbd_done(&p);
    }
}

// Points follow: in a turned body exactly, whether elements or particles carry them.
static void test_embedded_points(void** state) {
    (void)state;
    for (int k = 0; k < 2; ++k) {
        PbdRig p;
        pbd_box(&p, om_vec3(0.04, 0.04, 0.04), 4, 4, 4);
        if (k == 1) {
            p.r.mesh.ntet = 0;
            p.pbd.particle_volume = 1e-6;
        }
        pbd_start(&p);
        double point[6] = {0.013, 0.021, 0.017, 0.041, 0.01, 0.03}, out[6];
        OmEmbedding e;
        assert_ok(om_tissue_embed(p.r.m, 2, point, &e));
        OmPose pose = {om_vec3(0.1, 0.2, 0.3),
                       om_quat_axis_angle(om_normalize(om_vec3(1, 1, 0)), 2)};
        double* x = om_alloc(3 * (size_t)p.r.mesh.nvert, 8);
        for (int i = 0; i < p.r.mesh.nvert; ++i)
            om_store3(x, i, om_pose_apply(pose, om_load3(p.r.mesh.x, i)));
        om_embedding_eval(&e, x, out);
        for (int i = 0; i < 2; ++i) {
            OmVec3 want = om_pose_apply(pose, om_load3(point, i));
            assert_near(om_distance(om_load3(out, i), want), 0, 1e-14);
        }
        om_free(x);
        om_embedding_done(&e);
        if (k == 1) p.r.mesh.ntet = 384;
        pbd_done(&p);
    }
}

// What needs a system matrix or stresses says that it is not there, and changes nothing.
static void test_not_available(void** state) {
    (void)state;
    PbdRig p;
    pbd_box(&p, om_vec3(0.03, 0.03, 0.03), 3, 3, 3);
    rig_attach_plane(&p.r, 2, 0);
    pbd_start(&p);
    uint64_t hash = om_tissue_state_hash(p.r.s);
    assert_true(om_tissue_moves_itself(p.r.m));
    assert_status(om_tissue_find_rest(p.r.m, p.r.s, p.r.w, 1e-3, 10, NULL), OM_UNAVAILABLE);
    assert_status(om_tissue_begin_step(p.r.m, p.r.s, p.r.w, 0.02), OM_UNAVAILABLE);
    double value[162];
    assert_status(om_tissue_get_measure(p.r.m, p.r.s, OM_VON_MISES, value), OM_UNAVAILABLE);
    OmProbeDef shape = om_probe_default_def(OM_PROBE_SPHERE);
    OmProbe* ball;
    OmPress* press;
    assert_ok(om_probe_create(&shape, &ball));
    OmPressDef def = om_press_default_def(ball);
    def.ntri = 0;
    assert_ok(om_press_create(&def, p.r.m, &press));
    OmPose pose = {om_vec3(0, 0, 0.05), om_quat_identity()};
    assert_status(om_press_step(press, p.r.m, p.r.s, p.r.w, pose, 0.02, NULL), OM_UNAVAILABLE);
    om_press_destroy(press);
    OmTissueObstacle bad = om_probe_obstacle(ball, pose, pose, 0);
    bad.pose_end.q.w = 2;
    assert_status(om_tissue_step_among(p.r.m, p.r.s, p.r.w, 0.02, 1, &bad, NULL), OM_INVALID);
    om_tissue_external_force(p.r.s)[5] = NAN;
    assert_status(om_tissue_step(p.r.m, p.r.s, p.r.w, 0.02, NULL), OM_INVALID);
    om_tissue_external_force(p.r.s)[5] = 0;
    assert_true(hash == om_tissue_state_hash(p.r.s));
    om_probe_destroy(ball);
    TestRig fem;
    rig_box(&fem, om_vec3(0, 0, 0), om_vec3(0.01, 0.01, 0.01), 1, 1, 1);
    rig_start(&fem);
    assert_status(om_tissue_step_among(fem.m, fem.s, fem.w, 0.02, 0, NULL, NULL), OM_UNAVAILABLE);
    rig_done(&fem);
    pbd_done(&p);
}

// Two small sheets, one body: the upper falls on the lower, which is held. It rests 3 mm above, and does not without
// self-collision. Pairs give and take the same momentum.
static void test_self_collision(void** state) {
    (void)state;
    for (int k = 0; k < 2; ++k) {
        PbdRig p;
        pbd_sheet(&p, 0.03);
        int n = p.r.mesh.nvert, held[200];
        OmTetMesh two;
        assert_ok(om_tet_mesh_init(&two, 2 * n, 0));
        for (int i = 0; i < n; ++i) {
            OmVec3 q = om_load3(p.r.mesh.x, i);
            om_store3(two.x, i, q);
            om_store3(two.x, n + i, om_add(q, om_vec3(0.0011, 0.0007, 0.02)));
            held[i] = i;
        }
        assert_ok(om_tet_mesh_add_set(&two, "attachment", held, n));
        om_tet_mesh_done(&p.r.mesh);
        p.r.mesh = two;
        p.pbd.cluster_radius = 0.007;  // the sheets share no cluster
        p.pbd.has_self_collision = k == 1;
        pbd_start(&p);
        pbd_run(&p, 100, 0.02);
        double lowest = 1;
        for (int i = 0; i < n; ++i) lowest = fmin(lowest, om_tissue_x(p.r.s)[3 * (n + i) + 2]);
        if (k == 0)
            assert_true(lowest < -0.01);
        else  // in the hollows between four, sqrt(3^2 - 2.12^2) = 2.12 mm up, less what iterations leave
            assert_true(lowest > 0.0016 && lowest < 0.003);
        pbd_done(&p);
    }
    PbdRig p;
    pbd_sheet(&p, 0.03);
    p.r.def.gravity = om_vec3(0, 0, 0);
    p.pbd.damping = 0;
    p.pbd.has_self_collision = true;
    pbd_start(&p);
    double* x = om_alloc(3 * (size_t)p.r.mesh.nvert, 8);
    for (int i = 0; i < p.r.mesh.nvert; ++i) {  // folded in the middle, 1.5 mm apart
        OmVec3 q = om_load3(p.r.mesh.x, i);
        om_store3(x, i, om_vec3(fabs(q.x), q.y, q.x > 0 ? 0.0015 : 0));
    }
    assert_ok(om_tissue_set_x(p.r.m, p.r.s, x, NULL));
    OmVec3 momentum;
    pbd_run(&p, 20, 0.02);
    om_tissue_get_momentum(p.r.m, p.r.s, &momentum, NULL);
    assert_below(om_norm(momentum), 1e-12 * test_tol_scale());  // kg m/s of 3 g at up to 1 m/s
    om_free(x);
    pbd_done(&p);
}

// Two free sheets, particle over particle, meet with `speed` from `gap` apart in one step of 2 ms; returned is the mean
// height of the upper over the lower after it.
static double meet(double gap, double speed, int substeps) {
    PbdRig p;
    pbd_sheet(&p, 0.03);
    int n = p.r.mesh.nvert;
    OmTetMesh two;
    assert_ok(om_tet_mesh_init(&two, 2 * n, 0));
    for (int i = 0; i < n; ++i) {
        OmVec3 q = om_load3(p.r.mesh.x, i);
        om_store3(two.x, i, q);
        om_store3(two.x, n + i, om_add(q, om_vec3(0, 0, 0.02)));
    }
    om_tet_mesh_done(&p.r.mesh);
    p.r.mesh = two;
    p.r.def.gravity = om_vec3(0, 0, 0);
    p.pbd.cluster_radius = 0.007;
    p.pbd.collision_distance = 0.003;
    p.pbd.damping = 0;
    p.pbd.has_self_collision = true;
    p.pbd.substeps = substeps;
    pbd_start(&p);
    double *x = om_alloc(6 * (size_t)n, 8), *v = om_calloc(6 * (size_t)n, 8), above = 0;
    memcpy(x, p.r.mesh.x, 6 * (size_t)n * 8);
    for (int i = 0; i < n; ++i) {
        x[3 * (n + i) + 2] = x[3 * i + 2] + gap;
        v[3 * i + 2] = 0.5 * speed, v[3 * (n + i) + 2] = -0.5 * speed;
    }
    assert_ok(om_tissue_set_x(p.r.m, p.r.s, x, v));
    pbd_run(&p, 1, 0.002);
    const double* y = om_tissue_x(p.r.s);
    for (int i = 0; i < n; ++i) above += (y[3 * (n + i) + 2] - y[3 * i + 2]) / n;
    om_free(x), om_free(v);
    pbd_done(&p);
    return above;
}

// They stop 3 mm apart, each having gone half of the way back; also where a step would have let them pass each other.
static void test_pairs_part(void** state) {
    (void)state;
    assert_near(meet(0.004, 0, 1), 0.004, 1e-12);
    assert_near(meet(0.0032, 0.4, 1), 0.003, 2e-5);
    assert_near(meet(0.0032, 2.5, 1), 0.003, 1e-4);  // 1.8 mm past each other, and back
}

// What is near at rest may be as near as it likes: a sheet that is pressed together does as without self-collision.
static void test_neighbours_are_no_pairs(void** state) {
    (void)state;
    double* after[2];
    int n = 0;
    for (int k = 0; k < 2; ++k) {
        PbdRig p;
        pbd_sheet(&p, 0.03);
        p.pbd.has_self_collision = k == 1;
        pbd_start(&p);
        n = 3 * p.r.mesh.nvert;
        double* x = om_alloc((size_t)n, 8);
        for (int i = 0; i < n; ++i) x[i] = 0.85 * p.r.mesh.x[i];
        assert_ok(om_tissue_set_x(p.r.m, p.r.s, x, NULL));
        pbd_run(&p, 1, 0.01);
        after[k] = x;
        memcpy(x, om_tissue_x(p.r.s), (size_t)n * 8);
        pbd_done(&p);
    }
    for (int i = 0; i < n; ++i) assert_near(after[1][i], after[0][i], 0);
    om_free(after[0]), om_free(after[1]);
}

// A sheet falls askew on another that is held, particle on particle: friction takes some of its speed along it.
static void test_self_friction(void** state) {
    (void)state;
    double way[2];
    for (int k = 0; k < 2; ++k) {
        PbdRig p;
        pbd_sheet(&p, 0.03);
        int n = p.r.mesh.nvert, held[200];
        OmTetMesh two;
        assert_ok(om_tet_mesh_init(&two, 2 * n, 0));
        for (int i = 0; i < n; ++i) {
            OmVec3 q = om_load3(p.r.mesh.x, i);
            om_store3(two.x, i, q);
            om_store3(two.x, n + i, om_add(q, om_vec3(0, 0, 0.01)));
            held[i] = i;
        }
        assert_ok(om_tet_mesh_add_set(&two, "attachment", held, n));
        om_tet_mesh_done(&p.r.mesh);
        p.r.mesh = two;
        p.pbd.cluster_radius = 0.007;
        p.pbd.damping = 0;
        p.pbd.has_self_collision = true;
        p.pbd.particle_friction = k ? 0.3 : 0;
        pbd_start(&p);
        double *x = om_alloc(6 * (size_t)n, 8), *v = om_calloc(6 * (size_t)n, 8);
        memcpy(x, p.r.mesh.x, 6 * (size_t)n * 8);
        for (int i = n; i < 2 * n; ++i) x[3 * i + 2] = 0.003, v[3 * i] = 0.2, v[3 * i + 2] = -0.2;
        assert_ok(om_tissue_set_x(p.r.m, p.r.s, x, v));
        pbd_run(&p, 1, 0.002);
        way[k] = 0;
        for (int i = n; i < 2 * n; ++i) way[k] += (om_tissue_x(p.r.s)[3 * i] - x[3 * i]) / n;
        om_free(x), om_free(v);
        pbd_done(&p);
    }
    printf("slides by %.3f mm without friction, by %.3f mm with it\n", 1e3 * way[0], 1e3 * way[1]);
    assert_true(way[1] < 0.98 * way[0] && way[1] > 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_definitions),    cmocka_unit_test(test_clusters_cover),
        cmocka_unit_test(test_sampling),       cmocka_unit_test(test_forces_balance),
        cmocka_unit_test(test_friction),       cmocka_unit_test(test_embedded_points),
        cmocka_unit_test(test_self_collision), cmocka_unit_test(test_self_friction),
        cmocka_unit_test(test_pairs_part),     cmocka_unit_test(test_neighbours_are_no_pairs),
        cmocka_unit_test(test_not_available),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
