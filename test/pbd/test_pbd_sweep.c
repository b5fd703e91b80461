// test_pbd_sweep.c: absurd inputs stay finite and bounded; same bytes for any worker count; snapshots; memory.
#include "pbd_rig.h"

#include "test_alloc.h"

#define NSCENE 1000
#define NSTEP 12

static OmVec3 anywhere(OmRng* rng, double size) {
    OmVec3 p = {om_rng_range(rng, -size, size), om_rng_range(rng, -size, size),
                om_rng_range(rng, -size, size)};
    return p;
}

static OmPose any_pose(OmRng* rng, double size) {
    OmVec3 axis = om_normalize(om_vec3(om_rng_normal(rng), om_rng_normal(rng), om_rng_normal(rng)));
    OmVec3 at = anywhere(rng, size);
    return (OmPose){at, om_quat_axis_angle(axis, om_rng_range(rng, -OM_PI, OM_PI))};
}

static double pick(OmRng* rng, const double* value, int count) {
    return value[om_rng_below(rng, (uint32_t)count)];
}

// A body of a few dozen particles with parameters at the ends of their ranges.
static void make_scene(OmRng* rng, PbdRig* p) {
    static const double ends[] = {0, 0.3, 1}, drag[] = {0, 12, 1e6};
    if (om_rng_below(rng, 2)) {
        pbd_sheet(p, 0.018);
        if (om_rng_below(rng, 2)) rig_attach_plane(&p->r, 0, p->r.mesh.x[0]);
    } else {
        pbd_box(p, om_vec3(0.02, 0.03, 0.02), 2, 3, 2);
        if (om_rng_below(rng, 2)) rig_attach_plane(&p->r, 2, 0);
    }
    p->pbd.kind = (OmPbdKind)(p->r.mesh.ntet > 0 ? om_rng_below(rng, 3) : 0);
    if (p->pbd.kind != OM_PBD_CLUSTERS) p->pbd = om_pbd_default_def(p->pbd.kind);
    p->pbd.edge_stiffness = pow(10, om_rng_range(rng, -9, 9));
    p->pbd.volume_stiffness = om_rng_below(rng, 3) ? pow(10, om_rng_range(rng, -3, 12)) : 0;
    p->pbd.cluster_stiffness = pick(rng, ends, 3);
    p->pbd.linear_stretch = pick(rng, ends, 3);
    p->pbd.damping = pick(rng, drag, 3);
    p->pbd.cluster_spacing = om_rng_range(rng, 0.003, 0.03);
    p->pbd.cluster_radius = om_rng_range(rng, 0.5, 3) * p->pbd.cluster_spacing;
    p->pbd.substeps = 1 + (int)om_rng_below(rng, 4);
    p->pbd.iterations = 1 + (int)om_rng_below(rng, 10);
    p->pbd.collision_distance = om_rng_below(rng, 2) ? 0.003 : 0;
    p->pbd.has_self_collision = om_rng_below(rng, 2);
    p->r.def.material_default.young = pow(10, om_rng_range(rng, 1, 8));
    p->r.def.material_default.poisson = om_rng_range(rng, 0, 0.499);
    p->r.def.attachment_stiffness = om_rng_below(rng, 2) ? pow(10, om_rng_range(rng, -2, 8)) : 0;
    pbd_start(p);
}

// Collapsed, scattered, or as made.
static void place_absurdly(OmRng* rng, PbdRig* p) {
    int how = (int)om_rng_below(rng, 4), n = p->r.mesh.nvert;
    if (how == 0) return;
    double *x = om_alloc((size_t)n, 24), *v = om_alloc((size_t)n, 24);
    for (int i = 0; i < n; ++i) {
        OmVec3 at = om_load3(p->r.mesh.x, i);
        if (how == 1) at = om_vec3(0, 0, 0);
        if (how == 2) at = om_vec3(at.x, 0, 0);
        if (how == 3) at = anywhere(rng, 0.1);
        om_store3(x, i, at);
        om_store3(v, i, how == 3 ? anywhere(rng, 1000) : om_vec3(0, 0, 0));
    }
    assert_ok(om_tissue_set_x(p->r.m, p->r.s, x, v));
    om_free(x), om_free(v);
}

static void run_scene(int index, const OmProbe* probe) {
    OmRng rng = om_rng_init(77, (uint64_t)index);
    PbdRig p;
    make_scene(&rng, &p);
    place_absurdly(&rng, &p);
    double h = pow(10, om_rng_range(&rng, -4, -1)), time = 0;
    OmPose from = any_pose(&rng, 0.05);
    (void)om_tissue_grasp(p.r.m, p.r.s, 0, any_pose(&rng, 0.02), 0.01, NULL);
    for (int step = 0; step < NSTEP; ++step) {
        OmPose to = any_pose(&rng, 0.5);  // teleports
        (void)om_tissue_move_grasp(p.r.s, 0, any_pose(&rng, 0.5));
        om_store3(om_tissue_external_force(p.r.s), (int)om_rng_below(&rng, 30),
                  anywhere(&rng, 100));
        OmTissueObstacle tool = om_probe_obstacle(probe, from, to, om_rng_range(&rng, 0, 10));
        assert_ok(om_tissue_step_among(p.r.m, p.r.s, p.r.w, h, 1, &tool, NULL));
        from = to;
        time += h;
    }
    // tools reach 1 m, particles 10 m/s, from within 0.2 m
    double bound = 2 + p.pbd.max_speed * time;
    for (int i = 0; i < p.r.mesh.nvert; ++i) {
        double r = om_norm(om_load3(om_tissue_x(p.r.s), i)),
               v = om_norm(om_load3(om_tissue_v(p.r.s), i));
        if (!(r < bound) || !(v <= p.pbd.max_speed * (1 + 1e-9)))
            fail_msg("scene %d: particle %d at %g m (bound %g), %g m/s", index, i, r, bound, v);
    }
    pbd_done(&p);
}

static void test_absurd_scenes(void** state) {
    (void)state;
    OmProbeDef def = om_probe_default_def(OM_PROBE_SPHERE);
    def.radius = 0.02;
    OmProbe* probe;
    assert_ok(om_probe_create(&def, &probe));
    for (int k = 0; k < test_count(600, NSCENE); ++k) run_scene(k, probe);
    om_probe_destroy(probe);
}

// A sheet on a ball and a board, lifted at a corner.
static uint64_t run_busy(int nworker, int nstep, OmPbdKind kind, bool is_restored) {
    PbdRig p;
    if (kind == OM_PBD_CLUSTERS)
        pbd_sheet(&p, 0.15);  // large enough to be shared among workers
    else
        pbd_box(&p, om_vec3(0.12, 0.12, 0.01), 24, 24, 4);
    if (kind != OM_PBD_CLUSTERS) p.pbd = om_pbd_default_def(kind);
    p.pbd.has_self_collision = kind == OM_PBD_CLUSTERS;
    p.r.def.solver.nworker = nworker;
    pbd_start(&p);
    OmProbeDef ball = om_probe_default_def(OM_PROBE_SPHERE);
    OmProbe* probe;
    assert_ok(om_probe_create(&ball, &probe));
    OmPose at = {om_vec3(0, 0, -0.03), om_quat_identity()};
    OmVec3 tip = om_load3(p.r.mesh.x, p.r.mesh.nvert - 1);
    assert_ok(om_tissue_grasp(p.r.m, p.r.s, 0, (OmPose){tip, om_quat_identity()}, 0.01, NULL));
    void* block = om_alloc(1, om_tissue_state_size(p.r.m));
    for (int n = 0; n < nstep; ++n) {
        if (is_restored && n == nstep / 2) {  // some other way and back
            memcpy(block, p.r.s, om_tissue_state_size(p.r.m));
            pbd_run(&p, test_count(2, 7), 0.03);
            memcpy((void*)p.r.s, block, om_tissue_state_size(p.r.m));
        }
        OmPose pose = {om_add(tip, om_vec3(0, -2e-4 * n, 3e-4 * n)), om_quat_identity()};
        assert_ok(om_tissue_move_grasp(p.r.s, 0, pose));
        OmTissueObstacle tool = om_probe_obstacle(probe, at, at, -1);
        assert_ok(om_tissue_step_among(p.r.m, p.r.s, p.r.w, 0.02, 1, &tool, NULL));
    }
    uint64_t hash = om_tissue_state_hash(p.r.s);
    om_free(block);
    om_probe_destroy(probe);
    pbd_done(&p);
    return hash;
}

static void test_same_bytes(void** state) {
    (void)state;
    for (int kind = 0; kind < 3; ++kind) {
        // colours meet often, slowly on a busy machine
        int nstep = kind == OM_PBD_CLUSTERS ? test_count(10, 20) : test_count(2, 3);
        uint64_t one = run_busy(1, nstep, (OmPbdKind)kind, false);
        assert_true(one == run_busy(2, nstep, (OmPbdKind)kind, false));
        assert_true(one == run_busy(1, nstep, (OmPbdKind)kind, true));
    }
}

static OmStatus make_particles(void* ctx) {
    OmTetMesh particles;
    double volume;
    OmStatus status = om_pbd_sample_surface(ctx, 0.005, &particles, &volume);
    om_tet_mesh_done(&particles);
    return status;
}

static void test_memory(void** state) {
    (void)state;
    for (int kind = 0; kind < 3; ++kind) {
        PbdRig p;
        pbd_box(&p, om_vec3(0.03, 0.03, 0.02), 3, 3, 2);
        if (kind > 0) p.pbd = om_pbd_default_def((OmPbdKind)kind);
        p.pbd.has_self_collision = true;
        pbd_start(&p);
        assert_true(test_failing_allocations(rig_create_and_step, &p.r.def, 1) > 20);
        pbd_run(&p, 1, 0.02);
        test_count_begin();
        pbd_run(&p, 3, 0.02);
        assert_int_equal(test_count_end(), 0);
        assert_true(om_tissue_memory(p.r.m, p.r.w) > 1000);
        OmSurface skin;
        assert_ok(om_tet_mesh_boundary(&p.r.mesh, &skin, NULL));
        assert_true(test_failing_allocations(make_particles, &skin, 1) > 3);
        om_surface_done(&skin);
        pbd_done(&p);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_absurd_scenes),
        cmocka_unit_test(test_same_bytes),
        cmocka_unit_test(test_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
