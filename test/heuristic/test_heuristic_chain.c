// test_heuristic_chain.c: links are kept after any drag, vertices move no farther than links ask for.
#include "test_alloc.h"
#include "test_rig.h"

#include "omentum/contact_tool.h"
#include "omentum/heuristic.h"

#define KEPT 1e-12  // m, rounding

static const OmVec3 nothing = {0, 0, 0};

typedef struct Mail {
    TestRig r;
    OmChainDef chain;
} Mail;

static void mail_box(Mail* p, OmVec3 size, int nx, int ny, int nz) {
    rig_box(&p->r, nothing, size, nx, ny, nz);
    p->chain = om_chain_default_def();
    p->r.def.engine = om_chain_engine();
}

static void mail_start(Mail* p) {
    p->r.def.options = &p->chain;
    rig_start(&p->r);
}

static void mail_step(Mail* p) { assert_ok(om_tissue_step(p->r.m, p->r.s, p->r.w, 0.02, NULL)); }

static double excess(const Mail* p) {
    return om_heuristic_eval_excess(p->r.m, om_tissue_x(p->r.s));
}

static OmVec3 way_of(const Mail* p, int i) {
    return om_sub(om_load3(om_tissue_x(p->r.s), i), om_load3(p->r.mesh.x, i));
}

// The end face of a bar moved along, against and across it: every layer follows by what its links do not give.
static void test_drag_is_exact(void** state) {
    (void)state;
    const OmVec3 way[3] = {{0.004, 0, 0}, {-0.004, 0, 0}, {0, 0, 0.004}};
    const double cell = 0.005, share[3] = {0.1, 0.2, 0.05};
    for (int k = 0; k < 3; ++k) {
        Mail p;
        mail_box(&p, om_vec3(0.05, 0.01, 0.01), 10, 2, 2);
        p.chain.stretch = share[0], p.chain.compress = share[1], p.chain.shear = share[2];
        p.chain.sweeps = 0;
        mail_start(&p);
        // A sphere so large that it is flat at the face.
        OmPose tip = {om_vec3(1000.05 - 1e-5, 0.005, 0.005), om_quat_identity()};
        int nheld;
        assert_ok(om_tissue_grasp(p.r.m, p.r.s, 0, tip, 1000, &nheld));
        assert_int_equal(nheld, 9);
        tip.p = om_add(tip.p, way[k]);
        assert_ok(om_tissue_move_grasp(p.r.s, 0, tip));
        mail_step(&p);
        for (int i = 0; i < p.r.mesh.nvert; ++i) {
            double layer = 10 - round(p.r.mesh.x[3 * i] / cell);
            double left = fmax(0, 0.004 - share[k] * cell * layer);
            OmVec3 want = om_scale(left / 0.004, way[k]);
            assert_near(om_distance(way_of(&p, i), want), 0, 1e-11);  // places 1 km from the tip
        }
        rig_done(&p.r);
    }
}

// Both ends drawn apart by 8 mm where links give 5: what the two ask of a layer between them contradicts itself, and
// it goes to the middle, -4 + l / 2 from one end and 4 - (10 - l) / 2 from the other.
static void test_torn_between_two_tools(void** state) {
    (void)state;
    Mail p;
    mail_box(&p, om_vec3(0.05, 0.01, 0.01), 10, 2, 2);
    p.chain.stretch = 0.1, p.chain.compress = 0.2, p.chain.shear = 0.05;
    p.chain.sweeps = 0;
    mail_start(&p);
    OmPose tip[2] = {{om_vec3(-1000 + 1e-5, 0.005, 0.005), om_quat_identity()},
                     {om_vec3(1000.05 - 1e-5, 0.005, 0.005), om_quat_identity()}};
    for (int a = 0; a < 2; ++a) {
        int nheld;
        assert_ok(om_tissue_grasp(p.r.m, p.r.s, a, tip[a], 1000, &nheld));
        assert_int_equal(nheld, 9);
        tip[a].p.x += a ? 0.004 : -0.004;
        assert_ok(om_tissue_move_grasp(p.r.s, a, tip[a]));
    }
    mail_step(&p);
    for (int i = 0; i < p.r.mesh.nvert; ++i) {
        double layer = round(p.r.mesh.x[3 * i] / 0.005);
        double want = layer == 0 ? -0.004 : layer == 10 ? 0.004 : 0.0005 * (layer - 5);
        assert_near(om_distance(way_of(&p, i), om_vec3(want, 0, 0)), 0, 1e-11);
    }
    rig_done(&p.r);
}

// By how much end b of an edge may be above end a along axis c.
static double limit(const OmChainDef* def, OmVec3 d, int c) {
    const double e[3] = {d.x, d.y, d.z};
    double aside = def->shear * (fabs(e[(c + 1) % 3]) + fabs(e[(c + 2) % 3]));
    return aside + (e[c] > 0 ? def->stretch * e[c] : -def->compress * e[c]);
}

// Lower every vertex to what its neighbours allow until none has to be: bound (nvert x 3), for all three axes.
static void find_bounds(const Mail* p, double sign, double* bound) {
    const OmTetMesh* mesh = &p->r.mesh;
    for (bool goes_on = true; goes_on;) {
        goes_on = false;
        for (int k = 0; k < 16 * mesh->ntet; ++k) {
            int a = mesh->tet_vert[4 * (k / 16) + k % 4];
            int b = mesh->tet_vert[4 * (k / 16) + k / 4 % 4];
            OmVec3 d = om_scale(sign, om_sub(om_load3(mesh->x, b), om_load3(mesh->x, a)));
            for (int c = 0; c < 3 && a != b; ++c) {
                double max = bound[3 * a + c] + limit(&p->chain, d, c);
                if (!(bound[3 * b + c] > max)) continue;
                bound[3 * b + c] = max;
                goes_on = true;
            }
        }
    }
}

// Random drags of one vertex after another, against plain search over all links.
static void test_drag_against_search(void** state) {
    (void)state;
    Mail p;
    mail_box(&p, om_vec3(0.04, 0.03, 0.03), 4, 3, 3);
    rig_shake(&p.r.mesh, NULL, 0.002, p.r.mesh.x);
    p.chain.stretch = 0.15, p.chain.shear = 0.07;
    p.chain.sweeps = 0;
    mail_start(&p);
    int n = p.r.mesh.nvert;
    double *u = om_calloc((size_t)n, 24), *side[2], worst = 0;
    for (int s = 0; s < 2; ++s) side[s] = om_alloc((size_t)n, 24);
    OmRng rng = om_rng_init(5, 6);
    for (int k = 0; k < 40; ++k) {
        int held = (int)(n * om_rng_uniform(&rng));
        OmPose tip = {om_load3(om_tissue_x(p.r.s), held), om_quat_identity()};
        OmVec3 from = tip.p;
        assert_ok(om_tissue_grasp(p.r.m, p.r.s, 0, tip, 1e-6, NULL));
        for (int c = 0; c < 3; ++c) (&tip.p.x)[c] += 0.02 * om_rng_uniform(&rng) - 0.01;
        assert_ok(om_tissue_move_grasp(p.r.s, 0, tip));
        mail_step(&p);
        om_store3(u, held, om_add(om_load3(u, held), om_sub(tip.p, from)));
        for (int s = 0; s < 2; ++s) {
            for (int i = 0; i < 3 * n; ++i) side[s][i] = i / 3 == held ? (s ? -1 : 1) * u[i] : 1e9;
            find_bounds(&p, s ? -1 : 1, side[s]);
        }
        for (int i = 0; i < 3 * n; ++i) u[i] = fmin(fmax(u[i], -side[1][i]), side[0][i]);
        for (int i = 0; i < n; ++i) worst = fmax(worst, om_distance(way_of(&p, i), om_load3(u, i)));
        assert_below(excess(&p), KEPT);
    }
    assert_below(worst, 1e-11);  // rounding of 40 drags
    om_free(u);
    om_free(side[0]);
    om_free(side[1]);
    rig_done(&p.r);
}

// With relaxation and a side that is held: links are kept as long as that is possible, and again after.
static void test_links_are_kept(void** state) {
    (void)state;
    Mail p;
    mail_box(&p, om_vec3(0.05, 0.02, 0.01), 10, 4, 2);
    rig_attach_plane(&p.r, 0, 0);
    mail_start(&p);
    OmPose tip = {om_vec3(0.05, 0.01, 0.01), om_quat_identity()};
    int nheld;
    assert_ok(om_tissue_grasp(p.r.m, p.r.s, 0, tip, 0.006, &nheld));
    assert_true(nheld > 3);
    OmVec3 start = tip.p;
    // Between a tenth farther, a tenth nearer and a tenth aside anything can be reached.
    for (int k = 0; k < 60; ++k) {
        tip.p = om_madd(start, 0.004 * sin(0.3 * k), om_vec3(1, 0, cos(0.2 * k)));
        assert_ok(om_tissue_move_grasp(p.r.s, 0, tip));
        mail_step(&p);
        assert_below(excess(&p), KEPT);
    }
    tip.p = om_add(start, om_vec3(0.03, 0, 0));  // half of the bar's length
    assert_ok(om_tissue_move_grasp(p.r.s, 0, tip));
    mail_step(&p);
    print_message("a pull by 30 mm of 5 that links give: %.2f mm beyond on a link of 5 mm\n",
                  1e3 * excess(&p));
    assert_true(excess(&p) > 0.002 && excess(&p) < 0.03);
    const signed char* by = om_tissue_held_by(p.r.s);
    for (int i = 0; i < p.r.mesh.nvert; ++i) {
        if (om_tissue_attached(p.r.s)[i]) assert_near(om_norm(way_of(&p, i)), 0, 1e-15);
        if (by[i] == 0) assert_near(om_distance(way_of(&p, i), om_vec3(0.03, 0, 0)), 0, 1e-12);
    }
    om_tissue_release(p.r.s, 0);
    mail_step(&p);
    assert_below(excess(&p), KEPT);
    rig_done(&p.r);
}

// Differences between neighbours, squared, over the edges of all elements.
static double difference(const Mail* p) {
    double sum = 0;
    for (int k = 0; k < 16 * p->r.mesh.ntet; ++k) {
        int a = p->r.mesh.tet_vert[4 * (k / 16) + k % 4];
        int b = p->r.mesh.tet_vert[4 * (k / 16) + k / 4 % 4];
        sum += om_norm2(om_sub(way_of(p, a), way_of(p, b)));
    }
    return sum;
}

// A body pulled at a corner relaxes to its shape at rest, moved.
static void test_relaxation(void** state) {
    (void)state;
    Mail p;
    mail_box(&p, om_vec3(0.04, 0.02, 0.02), 4, 2, 2);
    mail_start(&p);
    OmVec3 way = {0.01, 0.02, -0.01};
    OmPose tip = {nothing, om_quat_identity()};
    assert_ok(om_tissue_grasp(p.r.m, p.r.s, 0, tip, 1e-6, NULL));
    tip.p = way;
    assert_ok(om_tissue_move_grasp(p.r.s, 0, tip));
    mail_step(&p);
    double begin = difference(&p), worst = 0;
    for (int k = 0; k < 200; ++k) {
        mail_step(&p);
        assert_below(excess(&p), KEPT);
    }
    for (int i = 0; i < p.r.mesh.nvert; ++i) worst = fmax(worst, om_distance(way_of(&p, i), way));
    assert_true(begin > 1e-6 && difference(&p) < 1e-12 * begin);
    assert_below(worst, 1e-8);  // 2,000 sweeps over 5 x 3 x 3 vertices
    OmTissueForces f;
    assert_ok(om_tissue_get_forces(p.r.m, p.r.s, &f));
    assert_near(om_norm(f.grasp[0]), 0, 0);  // there are none
    rig_done(&p.r);
}

// Limits are along the axes of space: a body that was turned is not left so. For any limits the rule is that
// the outcome keeps its links, and stays where it is then.
static void test_knows_no_rotation(void** state) {
    (void)state;
    Mail p;
    mail_box(&p, om_vec3(0.04, 0.02, 0.02), 4, 2, 2);
    p.chain.sweeps = 0;
    mail_start(&p);
    int n = p.r.mesh.nvert;
    double *x = om_alloc((size_t)n, 24), moved = 0;
    OmQuat q = om_quat_axis_angle(om_vec3(0, 0, 1), 1.5);
    for (int i = 0; i < n; ++i) om_store3(x, i, om_quat_rotate(q, om_load3(p.r.mesh.x, i)));
    assert_ok(om_tissue_set_x(p.r.m, p.r.s, x, NULL));
    mail_step(&p);
    assert_below(excess(&p), KEPT);
    double off = om_distance(om_load3(x, n - 1), om_load3(om_tissue_x(p.r.s), n - 1));
    assert_true(off > 0.005);
    memcpy(x, om_tissue_x(p.r.s), (size_t)n * 24);
    mail_step(&p);
    for (int i = 0; i < n; ++i)
        moved = fmax(moved, om_distance(om_load3(x, i), om_load3(om_tissue_x(p.r.s), i)));
    assert_below(moved, 1e-15);
    om_free(x);
    rig_done(&p.r);
}

// A sheet that begins inside a board, and a ball pressed into one that is held at a side.
static void test_obstacles(void** state) {
    (void)state;
    for (int k = 0; k < 2; ++k) {
        Mail p;
        mail_box(&p, om_vec3(0.08, 0.08, 0.005), 16, 16, 1);
        if (k == 1) rig_attach_plane(&p.r, 0, 0);
        mail_start(&p);
        OmContactPlane plane = {om_vec3(0, 0, 0.002), om_vec3(0, 0, 1)};
        OmTissueObstacle board = om_plane_obstacle(&plane);
        OmContactDef def = rig_on(&board);
        def.nobstacle = k == 0;
        rig_contact(&p.r, &def);
        OmContactReport report;
        if (k == 0) {
            assert_ok(om_contact_step(p.r.cw, p.r.m, p.r.s, p.r.w, 0.02, &report));
            assert_int_equal(report.ncontact, 17 * 17);
            assert_below(report.penetration, 1e-15);
            for (int i = 0; i < p.r.mesh.nvert; ++i)
                assert_true(om_tissue_x(p.r.s)[3 * i + 2] > 0.002 - 1e-15);
        } else {
            OmProbeDef shape = om_probe_default_def(OM_PROBE_SPHERE);
            OmProbe* ball;
            assert_ok(om_probe_create(&shape, &ball));
            double radius = -om_probe_eval_distance(ball, nothing, &(OmVec3){0});
            for (int n = 0; n < 40; ++n) {
                OmPose pose = {om_vec3(0.05, 0.04, 0.005 + radius - 0.0001 * n),
                               om_quat_identity()};
                OmTissueObstacle o = om_probe_obstacle(ball, pose, pose, 0);
                assert_ok(om_tissue_step_among(p.r.m, p.r.s, p.r.w, 0.02, 1, &o, NULL));
                assert_below(o.penetration,
                             1e-4);  // what pushes drag in, pushed out by the next step
                assert_near(om_norm(o.force), 0, 0);
            }
            om_probe_destroy(ball);
        }
        assert_below(excess(&p), KEPT);
        rig_done(&p.r);
    }
}

// Limits of any size, tools that jump and turn, starts in one point or scattered.
static void test_absurd_inputs(void** state) {
    (void)state;
    OmRng rng = om_rng_init(7, 8);
    for (int k = 0; k < 60; ++k) {
        Mail p;
        mail_box(&p, om_vec3(0.04, 0.03, 0.02), 4, 3, 2);
        p.chain.stretch = k % 4 ? 10 * om_rng_uniform(&rng) : 0;
        p.chain.compress = k % 5 ? om_rng_uniform(&rng) : 0;
        p.chain.shear = k % 3 ? 10 * om_rng_uniform(&rng) : 0;
        p.chain.relaxation = om_rng_uniform(&rng);
        if (k % 2) rig_attach_plane(&p.r, 0, 0);
        mail_start(&p);
        int n = p.r.mesh.nvert;
        double* x = om_calloc((size_t)n, 24);
        if (k % 7 > 1) memcpy(x, p.r.mesh.x, (size_t)n * 24);
        if (k % 7 == 2) rig_shake(&p.r.mesh, NULL, 100, x);
        assert_ok(om_tissue_set_x(p.r.m, p.r.s, x, NULL));
        OmPose tip = {om_load3(x, n - 1), om_quat_identity()};
        assert_ok(om_tissue_grasp(p.r.m, p.r.s, 0, tip, 0.015, NULL));
        for (int s = 0; s < 20; ++s) {
            for (int c = 0; c < 3; ++c) (&tip.p.x)[c] = 2000 * om_rng_uniform(&rng) - 1000;
            if (k % 4 == 0) tip.q = om_quat_axis_angle(om_vec3(0, 1, 0), 6 * om_rng_uniform(&rng));
            assert_ok(om_tissue_move_grasp(p.r.s, 0, tip));
            if (s == 15) om_tissue_release(p.r.s, 0);
            assert_ok(om_tissue_step(p.r.m, p.r.s, p.r.w, 1e-4 + 0.1 * om_rng_uniform(&rng), NULL));
        }
        // No tool holds it now, and its attachments are at rest: rounding is that of kilometres.
        assert_below(excess(&p), 1e-9);
        for (int i = 0; i < 3 * n; ++i) assert_true(fabs(om_tissue_x(p.r.s)[i]) < 3000);
        om_free(x);
        rig_done(&p.r);
    }
}

static uint64_t run_with_workers(int nworker, int* nalloc) {
    Mail p;
    mail_box(&p, om_vec3(0.06, 0.04, 0.02), 12, 8, 4);
    rig_attach_plane(&p.r, 0, 0);
    p.r.def.solver.nworker = nworker;
    mail_start(&p);
    OmPose tip = {om_vec3(0.06, 0.02, 0.01), om_quat_identity()};
    assert_ok(om_tissue_grasp(p.r.m, p.r.s, 0, tip, 0.006, NULL));
    test_count_begin();
    for (int s = 0; s < 10; ++s) {
        tip.p.z += 0.001;
        assert_ok(om_tissue_move_grasp(p.r.s, 0, tip));
        mail_step(&p);
    }
    *nalloc = test_count_end();
    uint64_t hash = om_tissue_state_hash(p.r.s);
    rig_done(&p.r);
    return hash;
}

static void test_same_bytes(void** state) {
    (void)state;
    int nalloc;
    uint64_t hash = run_with_workers(1, &nalloc);
    for (int n = 1; n <= 3; ++n) {
        assert_true(run_with_workers(n, &nalloc) == hash);
        assert_int_equal(nalloc, 0);
    }
}

static void refuse(OmChainDef chain, const char* what) {
    Mail p;
    mail_box(&p, om_vec3(0.01, 0.01, 0.01), 1, 1, 1);
    p.chain = chain;
    p.r.def.options = &p.chain;
    assert_status(om_tissue_create(&p.r.def, &p.r.m), OM_INVALID);
    assert_non_null(strstr(om_error_message(), what));
    om_tet_mesh_done(&p.r.mesh);
}

static void test_definitions(void** state) {
    (void)state;
    OmChainDef def = om_chain_default_def(), d;
    d = def, d.cookie = 0, refuse(d, "om_chain_default_def");
    d = def, d.stretch = -0.1, refuse(d, "stretch");
    d = def, d.compress = 1, refuse(d, "compress");
    d = def, d.shear = NAN, refuse(d, "shear");
    d = def, d.relaxation = 1.1, refuse(d, "relaxation");
    d = def, d.sweeps = -1, refuse(d, "sweeps");
    Mail p;
    mail_box(&p, om_vec3(0.01, 0.01, 0.01), 1, 1, 1);
    mail_start(&p);
    assert_true(om_tissue_moves_itself(p.r.m));
    double value[24];
    assert_status(om_tissue_get_internal_force(p.r.m, p.r.s, value), OM_UNAVAILABLE);
    assert_status(om_tissue_get_measure(p.r.m, p.r.s, OM_VON_MISES, value), OM_UNAVAILABLE);
    assert_status(om_tissue_find_rest(p.r.m, p.r.s, p.r.w, 1e-3, 10, NULL), OM_UNAVAILABLE);
    uint64_t hash = om_tissue_state_hash(p.r.s);
    OmTissueObstacle bad = {.pose_end = om_pose_identity()};
    assert_status(om_tissue_step_among(p.r.m, p.r.s, p.r.w, 0.02, 1, &bad, NULL), OM_INVALID);
    assert_true(hash == om_tissue_state_hash(p.r.s));
    rig_done(&p.r);
    mail_box(&p, om_vec3(0.01, 0.01, 0.01), 1, 1, 1);
    p.r.mesh.ntet = 0;
    assert_status(om_tissue_create(&p.r.def, &p.r.m), OM_INVALID);
    p.r.mesh.ntet = 6;
    om_tet_mesh_done(&p.r.mesh);
}

static void test_failing_memory(void** state) {
    (void)state;
    Mail p;
    mail_box(&p, om_vec3(0.02, 0.02, 0.02), 2, 2, 2);
    assert_true(test_failing_allocations(rig_create_and_step, &p.r.def, 1) > 10);
    om_tet_mesh_done(&p.r.mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_drag_is_exact),       cmocka_unit_test(test_torn_between_two_tools),
        cmocka_unit_test(test_drag_against_search), cmocka_unit_test(test_links_are_kept),
        cmocka_unit_test(test_relaxation),          cmocka_unit_test(test_knows_no_rotation),
        cmocka_unit_test(test_obstacles),           cmocka_unit_test(test_absurd_inputs),
        cmocka_unit_test(test_same_bytes),          cmocka_unit_test(test_definitions),
        cmocka_unit_test(test_failing_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
