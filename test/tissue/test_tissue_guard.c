// What a step may not do in silence: turn elements inside out, make energy out of nothing, claim a tolerance
// that it did not meet.
#include "test_rig.h"

#include "omentum/contact.h"
#include "tissue/tissue_internal.h"

static const OmLaw every_law[] = {OM_COROTATIONAL,       OM_ST_VENANT_KIRCHHOFF, OM_NEO_HOOKEAN,
                                  OM_STABLE_NEO_HOOKEAN, OM_MOONEY_RIVLIN,       OM_OGDEN};
#define NLAW ((int)(sizeof every_law / sizeof every_law[0]))

static int count_inverted(const TestRig* r) {
    double* J = om_alloc((size_t)r->mesh.ntet, sizeof *J);
    int num = 0;
    assert_non_null(J);
    assert_ok(om_tissue_get_measure(r->m, r->s, OM_VOLUME_RATIO, J));
    for (int e = 0; e < r->mesh.ntet; ++e) num += !(J[e] > 1e-6);
    om_free(J);
    return num;
}

static double total_energy(const TestRig* r) {
    OmTissueEnergy e;
    assert_ok(om_tissue_get_energy(r->m, r->s, &e));
    return e.elastic + e.kinetic + e.gravity + e.spring;
}

// The status of a step and its report say what the state is.
static void check_honest(const TestRig* r, OmStatus status, const OmTissueReport* report) {
    if (status < 0) fail_msg("step at %g s: %s", om_tissue_time(r->s), om_error_message());
    int num = count_inverted(r);
    // The count of the step is taken in floats: it may differ where det F is rounding.
    if ((num > 0) != (report->ninverted > 0))
        fail_msg("%d elements are inverted, the report says %d", num, report->ninverted);
    if (num > 0) assert_int_equal(status, OM_NOT_CONVERGED);
}

// ---- elements -----------------------------------------------------------------------------------------------

// A cube is pulled by two opposite corners to three times its diagonal.
static int pull_corners(OmLaw law, int nstep) {
    TestRig r;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.04, 0.04, 0.04), 5, 5, 5);
    r.def.material_default = (OmMaterial){.young = 3000, .poisson = 0.45, .law = law};
    r.def.gravity = om_vec3(0, 0, 0);
    rig_start(&r);
    OmPose low = {om_vec3(0, 0, 0), om_quat_identity()};
    OmPose high = {om_vec3(0.04, 0.04, 0.04), om_quat_identity()};
    assert_ok(om_tissue_grasp(r.m, r.s, 0, low, 0.002, NULL));
    assert_ok(om_tissue_grasp(r.m, r.s, 1, high, 0.002, NULL));
    for (int k = 1; k <= nstep; ++k) {
        double t = 0.04 * k / nstep;
        low.p = om_vec3(-t, -t, -t);
        high.p = om_vec3(0.04 + t, 0.04 + t, 0.04 + t);
        assert_ok(om_tissue_move_grasp(r.s, 0, low));
        assert_ok(om_tissue_move_grasp(r.s, 1, high));
        OmTissueReport report;
        OmStatus status = om_tissue_step(r.m, r.s, r.w, 0.02, &report);
        check_honest(&r, status, &report);
    }
    int num = count_inverted(&r);
    rig_done(&r);
    return num;
}

static void test_pulled_corners(void** context) {
    (void)context;
    for (int k = 0; k < NLAW; ++k)
        for (int nstep = test_is_slow() ? 1 : 5; nstep <= (test_is_slow() ? 25 : 5); nstep *= 5) {
            int num = pull_corners(every_law[k], nstep);
            printf("%s, %d steps: %d elements inverted\n", om_law_name(every_law[k]), nstep, num);
            bool is_soft =
                every_law[k] == OM_COROTATIONAL || every_law[k] == OM_ST_VENANT_KIRCHHOFF;
            if (!is_soft) assert_int_equal(num, 0);
        }
}

// An element that is inverted from the start does not disarm the guard of the others: a block whose corner was
// pushed through its element is crushed by a weight.
static void test_each_by_itself(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.03, 0.03, 0.03), 3, 3, 3);
    rig_attach_plane(&r, 2, 0);
    r.def.material_default = (OmMaterial){.young = 3000, .poisson = 0.45, .law = OM_MOONEY_RIVLIN};
    rig_start(&r);
    size_t n = 3 * (size_t)r.mesh.nvert;
    double* x = om_alloc(n, sizeof *x);
    int* was = om_calloc((size_t)r.mesh.ntet, sizeof *was);
    double* J = om_alloc((size_t)r.mesh.ntet, sizeof *J);
    assert_true(x && was && J);
    memcpy(x, r.mesh.x, n * sizeof *x);
    for (int i = 0; i < r.mesh.nvert; ++i)
        if (om_norm(om_sub(om_load3(x, i), om_vec3(0.03, 0.03, 0.03))) < 1e-9)
            om_store3(x, i, om_vec3(0.012, 0.012, 0.012));
    assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
    double* f = om_tissue_external_force(r.s);
    for (int i = 0; i < r.mesh.nvert; ++i)
        if (r.mesh.x[3 * i + 2] > 0.0299) f[3 * i + 2] = -0.2;
    for (int step = 0; step < 20; ++step) {
        assert_ok(om_tissue_get_measure(r.m, r.s, OM_VOLUME_RATIO, J));
        for (int e = 0; e < r.mesh.ntet; ++e) was[e] = !(J[e] > 1e-6);
        OmTissueReport report;
        OmStatus status = om_tissue_step(r.m, r.s, r.w, 0.02, &report);
        check_honest(&r, status, &report);
        assert_ok(om_tissue_get_measure(r.m, r.s, OM_VOLUME_RATIO, J));
        int nnew = 0;
        for (int e = 0; e < r.mesh.ntet; ++e) nnew += !was[e] && !(J[e] > 0);
        assert_int_equal(nnew, 0);
    }
    om_free(x);
    om_free(was);
    om_free(J);
    rig_done(&r);
}

// The mirror image of a St Venant-Kirchhoff body has no stress: it is in equilibrium, and not what was asked.
static void test_rest_inverted(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.03, 0.03, 0.03), 3, 3, 3);
    r.def.material_default =
        (OmMaterial){.young = 3000, .poisson = 0.45, .law = OM_ST_VENANT_KIRCHHOFF};
    r.def.gravity = om_vec3(0, 0, 0);
    rig_attach_plane(&r, 2, 0);
    rig_start(&r);
    size_t n = 3 * (size_t)r.mesh.nvert;
    double* x = om_alloc(n, sizeof *x);
    assert_non_null(x);
    memcpy(x, r.mesh.x, n * sizeof *x);
    for (int i = 0; i < r.mesh.nvert; ++i) x[3 * i + 2] *= -1;
    assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
    OmTissueReport report;
    assert_status(om_tissue_find_rest(r.m, r.s, r.w, 1e-4, 50, &report), OM_NOT_CONVERGED);
    assert_int_equal(report.ninverted, r.mesh.ntet);
    assert_non_null(strstr(om_error_message(), "inverted"));
    om_tissue_state_reset(r.m, r.s);
    assert_ok(om_tissue_find_rest(r.m, r.s, r.w, 1e-4, 50, &report));
    assert_int_equal(report.ninverted, 0);
    om_free(x);
    rig_done(&r);
}

// ---- energy -------------------------------------------------------------------------------------------------

typedef struct Drop {
    OmLaw law;
    double young;   // Pa
    double height;  // m, of the fall before the impact
    double gap;     // m, to the board at the beginning
    double tilt;    // rad
    double h;       // s
    int max_newton;
} Drop;

// As after a fall from that height, a little above the board.
static void start_fall(TestRig* r, const Drop* d) {
    size_t n = 3 * (size_t)r->mesh.nvert;
    double *x = om_alloc(n, sizeof *x), *v = om_calloc(n, sizeof *v), low = INFINITY;
    assert_true(x && v);
    OmQuat q = om_quat_axis_angle(om_normalize(om_vec3(1, 0.3, 0.2)), d->tilt);
    for (int i = 0; i < r->mesh.nvert; ++i) {
        OmVec3 p = om_quat_rotate(q, om_load3(r->mesh.x, i));
        om_store3(x, i, p);
        low = fmin(low, p.z);
        v[3 * i + 2] = -sqrt(2 * 9.81 * d->height);
    }
    for (int i = 0; i < r->mesh.nvert; ++i) x[3 * i + 2] += d->gap - low;
    assert_ok(om_tissue_set_x(r->m, r->s, x, v));
    om_free(x);
    om_free(v);
}

// The largest rise of the energy in a step, over the energy of the fall. The board is still: it does no work, but
// for what pushes out tissue that is inside, and nothing is.
static double measure_rise(const Drop* d) {
    TestRig r;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.06, 0.04, 0.04), 6, 4, 4);
    r.def.material_default = (OmMaterial){.young = d->young, .poisson = 0.45, .law = d->law};
    r.def.rayleigh_mass = 0;
    r.def.max_newton = d->max_newton;
    rig_start(&r);
    OmContactPlane plane = {om_vec3(0, 0, 0), om_vec3(0, 0, 1)};
    OmTissueObstacle board = om_plane_obstacle(&plane);
    OmContactDef def = rig_on(&board);
    rig_contact(&r, &def);
    start_fall(&r, d);
    double fall = 0, rise = 0, first, before;
    for (int i = 0; i < r.mesh.nvert; ++i) fall += om_tissue_mass(r.m)[i] * 9.81 * d->height;
    first = before = total_energy(&r);
    for (int n = 0; n < (int)(0.4 / d->h); ++n) {
        OmContactReport report;
        OmStatus status = om_contact_step(r.cw, r.m, r.s, r.w, d->h, &report);
        check_honest(&r, status, &report.tissue);
        double now = total_energy(&r);
        rise = fmax(rise, fmax(now - before, now - first) / fall);
        before = now;
    }
    rig_done(&r);
    return rise;
}

static void test_drops(void** context) {
    (void)context;
    for (int k = 0; k < NLAW; ++k) {
        double worst = 0;
        int num = 0;
        for (int h = 0; h < 2; ++h)
            for (int t = 0; t < 4; ++t) {
                if (!test_is_slow() && t != (h ? 1 : 2)) continue;
                Drop d = {.law = every_law[k],
                          .young = t % 2 ? 10000 : 3000,
                          .height = h ? 0.3 : 1,
                          .gap = t % 2 ? 0.041 : 0.001,
                          .tilt = t < 2 ? 0 : 0.5,
                          .h = h ? 0.01 : 0.02,
                          .max_newton = 1};
                worst = fmax(worst, measure_rise(&d));
                ++num;
            }
        printf("%s: energy rises by %.2g of the fall's in the worst step of %d drops\n",
               om_law_name(every_law[k]), worst, num);
        assert_below(worst, 0.01);
    }
}

// ---- a step that breaks a rule ------------------------------------------------------------------------------

typedef struct Swing {  // of om_tissue_step, and of one linearisation alone from the same states
    // largest rise of the energy in a step, over the bound that tissue_guard.c names
    double worst, worst_alone;
    int nrise;  // steps in which one linearisation alone breaks the bound
    int nnewton, nsubstep, niteration, nstep;
} Swing;

// The rise of kinetic, elastic and gravitational energy in a step, over 1 % of the first two and rounding.
static double rise_of(const TestRig* r, double young, const OmTissueEnergy* before) {
    OmTissueEnergy now;
    assert_ok(om_tissue_get_energy(r->m, r->s, &now));
    double rise = now.elastic - before->elastic + now.kinetic - before->kinetic + now.gravity -
                  before->gravity;
    double rounding = 1e-6 * 9e-5 * young / 2.9;  // 1e-6 of volume times mu, J
    return rise / (0.01 * (before->elastic + before->kinetic) + rounding);
}

// A beam, fixed at one end, falls from its rest shape and swings: nothing but the weight works.
static Swing swing(OmLaw law, double young, int max_iterations) {
    TestRig r;
    Swing out = {.nstep = 50};
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.1, 0.03, 0.03), 13, 4, 4);
    rig_attach_plane(&r, 0, 0);
    r.def.material_default = (OmMaterial){.young = young, .poisson = 0.45, .law = law};
    r.def.element = OM_ELEMENT_LINEAR;
    r.def.rayleigh_mass = 0;
    if (max_iterations > 0) {
        r.def.solver.preconditioner = OM_BLOCK_JACOBI;
        r.def.solver.max_iterations = max_iterations;
        r.def.solver.tolerance = 0;
    }
    rig_start(&r);
    void* before = om_alloc(1, om_tissue_state_size(r.m));
    assert_non_null(before);
    for (int step = 0; step < out.nstep; ++step) {
        OmTissueEnergy energy;
        OmTissueReport report;
        memcpy(before, r.s, om_tissue_state_size(r.m));
        assert_ok(om_tissue_get_energy(r.m, r.s, &energy));
        assert_ok(om_tissue_begin_step(r.m, r.s, r.w, 0.02));
        assert_ok(om_tissue_solve_step(r.m, r.s, r.w, NULL));
        assert_ok(om_tissue_end_step(r.m, r.s, r.w));
        double rise = rise_of(&r, young, &energy);
        uint64_t hash = om_tissue_state_hash(r.s);
        memcpy((void*)r.s, before, om_tissue_state_size(r.m));
        assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, &report));
        out.worst_alone = fmax(out.worst_alone, rise);
        out.worst = fmax(out.worst, rise_of(&r, young, &energy));
        out.nrise += rise > 1.001;
        out.nnewton += report.newton;
        out.nsubstep += report.substeps;
        out.niteration = report.iterations > out.niteration ? report.iterations : out.niteration;
        if (rise < 0.999) assert_true(om_tissue_state_hash(r.s) == hash);  // unchanged
    }
    om_free(before);
    rig_done(&r);
    printf("%s, %d iterations: %d steps gain energy, up to %.3g of the bound; guarded %.3g, %d "
           "linearisations more\n",
           om_law_name(law), max_iterations, out.nrise, out.worst_alone, out.worst, out.nnewton);
    assert_true(out.nrise > 0);
    assert_below(out.worst, 1.001);  // energies in floats
    assert_int_equal(out.nsubstep, out.nstep);
    return out;
}

// With the linear law one linearisation is exact: energy that few iterations gain is the work of the residual. Such a
// step needs neither Newton's method nor another solve.
static void test_residual_works(void** context) {
    (void)context;
    for (int num = 16; num <= 24; num += 8) {
        Swing s = swing(OM_LINEAR, 30000, num);
        assert_int_equal(s.nnewton, 0);
        assert_int_equal(s.niteration, num);
    }
}

// r.v and r.dv, r = rhs - A dv, over |r| |v| and |r| |dv|, at free vertices.
static void residual_along(const TestRig* r, double* v_share, double* dv_share) {
    size_t n = 3 * (size_t)r->mesh.nvert;
    double *y = om_alloc(n, sizeof *y), along[2] = {0, 0}, norm[3] = {0, 0, 0};
    assert_non_null(y);
    assert_ok(om_tissue_apply(r->m, r->w, 1, r->w->dv, y));
    for (size_t i = 0; i < n; ++i) {
        if (r->w->fixed[i]) continue;
        double left = r->w->rhs[i] - y[i], v = om_tissue_v(r->s)[i], dv = r->w->dv[i];
        along[0] += left * v;
        along[1] += left * dv;
        norm[0] += left * left;
        norm[1] += v * v;
        norm[2] += dv * dv;
    }
    *v_share = norm[1] > 0 ? fabs(along[0]) / sqrt(norm[0] * norm[1]) : 0;
    *dv_share = fabs(along[1]) / sqrt(norm[0] * norm[2]);
    om_free(y);
}

// After the projection the residual of three iterations works neither along v nor along dv, up to rounding.
// At rest (v = 0) dv alone is left.
static void test_residual_is_removed(void** context) {
    (void)context;
    for (int moves = 0; moves < 2; ++moves) {
        TestRig r;
        rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.1, 0.03, 0.03), 8, 3, 3);
        rig_attach_plane(&r, 0, 0);
        r.def.solver.preconditioner = OM_BLOCK_JACOBI;
        r.def.solver.max_iterations = 3;
        r.def.solver.tolerance = 0;
        rig_start(&r);
        for (int step = 0; step < 3 * moves; ++step)
            assert_true(om_tissue_step(r.m, r.s, r.w, 0.02, NULL) >= 0);
        assert_ok(om_tissue_begin_step(r.m, r.s, r.w, 0.02));
        assert_true(om_tissue_solve_step(r.m, r.s, r.w, NULL) >= 0);
        // CG leaves r.dv = 0, so dv is spoilt: it is half as long as it should be.
        for (int i = 0; i < 3 * r.mesh.nvert; ++i) r.w->dv[i] *= 0.5;
        double v_before, dv_before, v_after, dv_after, growth;
        residual_along(&r, &v_before, &dv_before);
        OmGuard guard = {.is_bad = true, .gain = 0, .bound = 1};
        assert_true(om__guard_project(r.m, r.s, r.w, &guard, &growth));
        residual_along(&r, &v_after, &dv_after);
        printf("moves %d: along v %.3g, now %.3g; along dv %.3g, now %.3g\n", moves, v_before,
               v_after, dv_before, dv_after);
        assert_true(dv_before > 0.1);
        assert_true(!moves || v_before > 0.1);
        assert_below(dv_after, 1e-6);
        assert_below(v_after, 1e-6);
        rig_done(&r);
    }
}

// Energy that rises because rotations changed in the step is still refused; one more linearisation is enough.
static void test_rotation_works(void** context) {
    (void)context;
    Swing s = swing(OM_COROTATIONAL, 15000, 0);
    assert_int_equal(s.nnewton, s.nrise);
    swing(OM_COROTATIONAL, 30000, 24);
}

// A second linearisation is an iteration of Newton's method on the step with its inertia: it is closer to the converged
// step by a factor of four at least.
static void test_second_linearisation(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.1, 0.03, 0.03), 8, 3, 3);
    rig_attach_plane(&r, 0, 0);
    r.def.material_default.young = 15000;
    r.def.rayleigh_mass = 0;
    rig_start(&r);
    TestRig exact = r;
    exact.def.max_newton = 40;
    exact.def.newton_tolerance = 1e-8;
    rig_start(&exact);
    for (int step = 0; step < 8; ++step) {
        OmTissueReport report = {0};
        memcpy((void*)exact.s, r.s, om_tissue_state_size(r.m));
        assert_true(om_tissue_step(exact.m, exact.s, exact.w, 0.02, NULL) >= 0);
        size_t n = 3 * (size_t)r.mesh.nvert;
        assert_ok(om_tissue_begin_step(r.m, r.s, r.w, 0.02));
        assert_ok(om_tissue_solve_step(r.m, r.s, r.w, NULL));
        double far[2] = {0, 0};
        for (int turn = 0; turn < 2; ++turn) {
            for (size_t i = 0; i < n; ++i) {
                double v = om_tissue_v(r.s)[i] + r.w->dv[i];
                far[turn] = fmax(far[turn], fabs(v - om_tissue_v(exact.s)[i]));
            }
            if (turn == 0) assert_ok(om__relinearise(r.m, r.s, r.w, &report));
        }
        printf("step %d: %.3g m/s off after one linearisation, %.3g after two\n", step, far[0],
               far[1]);
        assert_below(far[1], 0.25 * far[0] + 1e-5);
        memcpy((void*)r.s, exact.s, om_tissue_state_size(r.m));
        assert_int_equal(report.newton, 1);
    }
    om_tissue_work_destroy(exact.w);
    om_tissue_state_destroy(exact.s);
    om_tissue_destroy(exact.m);
    rig_done(&r);
}

// A load that flattens the top of a block in one step of one linearisation.
static OmStatus crush(int max_work, OmTissueReport* report) {
    TestRig r;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.03, 0.03, 0.03), 3, 3, 3);
    rig_attach_plane(&r, 2, 0);
    r.def.material_default = (OmMaterial){.young = 3000, .poisson = 0.45, .law = OM_NEO_HOOKEAN};
    r.def.element = OM_ELEMENT_LINEAR;
    if (max_work > 0) r.def.max_work = max_work;
    rig_start(&r);
    double* f = om_tissue_external_force(r.s);
    for (int i = 0; i < r.mesh.nvert; ++i)
        if (r.mesh.x[3 * i + 2] > 0.0299) f[3 * i + 2] = -8;
    OmStatus status = om_tissue_step(r.m, r.s, r.w, 0.02, report);
    check_honest(&r, status, report);
    assert_near(om_tissue_time(r.s), 0.02, 1e-12);
    rig_done(&r);
    return status;
}

// The bound of the work ends a step that needs more, says so, and inverts nothing.
static void test_work_bound(void** context) {
    (void)context;
    OmTissueReport free, bound;
    assert_ok(crush(0, &free));
    assert_true(!free.is_work_spent && free.newton >= 1);
    for (int max_work = 1; max_work <= 16; max_work *= 4) {
        assert_status(crush(max_work, &bound), OM_NOT_CONVERGED);
        printf("max_work %d: %d iterations (%d without), %d of Newton\n", max_work,
               bound.iterations, free.iterations, bound.newton);
        assert_non_null(strstr(om_error_message(), "max_work"));
        assert_true(bound.is_work_spent && !bound.is_unguarded);
        assert_int_equal(bound.ninverted, 0);
        assert_true(bound.iterations < free.iterations);
    }
    TestRig r;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.03, 0.03, 0.03), 1, 1, 1);
    r.def.max_work = 0;
    assert_status(om_tissue_create(&r.def, &r.m), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "max_work"));
    om_tet_mesh_done(&r.mesh);
}

// ---- Newton's method ----------------------------------------------------------------------------------------

// A tolerance below rounding ends at the floor, in one step, and says so.
static void test_floor(void** context) {
    (void)context;
    for (int k = 0; k < NLAW; ++k) {
        TestRig r;
        rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.1, 0.02, 0.02), 10, 2, 2);
        rig_attach_plane(&r, 0, 0);
        r.def.material_default = (OmMaterial){.young = 30000, .poisson = 0.45, .law = every_law[k]};
        r.def.max_newton = 40;
        r.def.newton_tolerance = 1e-15;
        rig_start(&r);
        for (int n = 0; n < 3; ++n) {
            OmTissueReport report;
            OmStatus status = om_tissue_step(r.m, r.s, r.w, 0.02, &report);
            printf("%s: %d iterations, residual %.2g\n", om_law_name(every_law[k]), report.newton,
                   report.newton_residual);
            assert_int_equal(status, OM_NOT_CONVERGED);
            assert_non_null(strstr(om_error_message(), "newton_tolerance"));
            assert_int_equal(report.substeps, 1);
            assert_true(report.newton <= 40);
            assert_below(report.newton_residual, 1e-11);
        }
        rig_done(&r);
    }
}

// A beam that is lifted, brought back and at rest again: there is almost nothing left to solve, relative to which the
// tolerance is below rounding. No step is cut for it.
static void test_floor_at_rest(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.1, 0.03, 0.03), 10, 3, 3);
    rig_attach_plane(&r, 0, 0);
    r.def.element = OM_ELEMENT_LINEAR;
    r.def.gravity = om_vec3(0, 0, 0);
    r.def.max_newton = 40;
    r.def.newton_tolerance = 1e-8;
    rig_start(&r);
    OmPose tip = {om_vec3(0.1, 0.015, 0.015), om_quat_identity()};
    assert_ok(om_tissue_grasp(r.m, r.s, 0, tip, 0.022, NULL));
    int newton = 0, nfloor = 0;
    for (int step = 0; step < 240; ++step) {
        OmTissueReport report;
        double t = (step + 1) / 40.0;
        tip.p.z = 0.015 + 0.02 * fmax(0, t < 1 ? t : 2 - t);
        assert_ok(om_tissue_move_grasp(r.s, 0, tip));
        OmStatus status = om_tissue_step(r.m, r.s, r.w, 0.02, &report);
        assert_true(status >= 0);
        assert_int_equal(report.substeps, 1);
        // the residual is relative to the first one, of which less and less is left when the beam rests again
        if (step < 100) assert_below(report.newton_residual, 1e-5);
        newton = report.newton > newton ? report.newton : newton;
        nfloor += status == OM_NOT_CONVERGED;
    }
    double off = 0;  // m, from the rest shape, to which the beam has come back
    for (int i = 0; i < r.m->mesh.nvert; ++i)
        off = fmax(off, om_distance(om_load3(om_tissue_x(r.s), i), om_load3(r.m->mesh.x, i)));
    printf(
        "at most %d iterations of Newton, %d of 240 steps end at the floor, %.2g m off at the end\n",
        newton, nfloor, off);
    assert_below(off, 1e-9);
    assert_true(newton <= 12);
    rig_done(&r);
}

// Inertia, stress, contact and weight of a step that Newton's method has solved, in double and with nothing of the
// step's own: they balance. At rest the residual of the first linearisation is rounding: no step is cut for it.
static void test_balance_with_contact(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.06, 0.06, 0.03), 6, 6, 3);
    r.def.material_default = (OmMaterial){.young = 3000, .poisson = 0.45, .law = OM_NEO_HOOKEAN};
    r.def.rayleigh_mass = 0;
    r.def.max_newton = 20;
    r.def.newton_tolerance = 1e-5;
    r.def.solver.tolerance = 1e-3;
    rig_start(&r);
    OmContactPlane plane = {om_vec3(0, 0, 0), om_vec3(0, 0, 1)};
    OmTissueObstacle board = om_plane_obstacle(&plane);
    OmContactDef def = rig_on(&board);
    rig_contact(&r, &def);
    size_t n = 3 * (size_t)r.mesh.nvert;
    double *f = om_alloc(n, sizeof *f), *v = om_alloc(n, sizeof *v), worst = 0;
    const double* mass = om_tissue_mass(r.m);
    int max = 0, nok = 0;
    assert_true(f && v);
    for (int step = 0; step < 60; ++step) {
        OmContactReport report;
        memcpy(v, om_tissue_v(r.s), n * sizeof *v);
        OmStatus status = om_contact_step(r.cw, r.m, r.s, r.w, 0.02, &report);
        assert_true(status >= 0);
        nok += status == OM_OK;
        max = report.tissue.substeps > max ? report.tissue.substeps : max;
        // v is that of the last substep's beginning; what is not OK has said so
        if (report.tissue.substeps > 1 || status > 0) continue;
        assert_ok(om_tissue_get_internal_force(r.m, r.s, f));
        double left = 0, weight = 0;
        for (int i = 0; i < r.mesh.nvert; ++i) {
            OmVec3 dv = om_sub(om_load3(om_tissue_v(r.s), i), om_load3(v, i));
            OmVec3 sum = om_add(om_load3(f, i), om_load3(om_tissue_contact_force(r.s), i));
            sum = om_madd(sum, mass[i], om_sub(om_tissue_gravity(r.m), om_scale(1 / 0.02, dv)));
            left += om_norm2(sum);
            weight += om_norm2(om_scale(mass[i], om_tissue_gravity(r.m)));
        }
        worst = fmax(worst, sqrt(left / weight));
    }
    printf("%d of 60 steps OK, out of balance %.2g of the weight, at most %d substeps\n", nok,
           worst, max);
    assert_true(nok >= 30);  // at rest contacts may come and go: such steps say so
    assert_below(worst, 1e-4);
    assert_true(max <= 4);
    om_free(f);
    om_free(v);
    rig_done(&r);
}

// What a tool exerts is inertia less stress and weight of the vertices it holds, also where Newton's method found the
// step.
static void test_tool_force(void** context) {
    (void)context;
    for (int k = 0; k < 2; ++k) {
        TestRig r;
        rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.06, 0.03, 0.03), 6, 3, 3);
        rig_attach_plane(&r, 0, 0);
        r.def.material_default =
            (OmMaterial){.young = 3000, .poisson = 0.45, .law = OM_NEO_HOOKEAN};
        r.def.rayleigh_mass = 0;
        r.def.max_newton = 20;
        r.def.element = k == 1 ? OM_ELEMENT_QUADRATIC : OM_ELEMENT_LINEAR;
        rig_start(&r);
        OmPose tip = {om_vec3(0.06, 0.015, 0.015), om_quat_identity()};
        assert_ok(om_tissue_grasp(r.m, r.s, 0, tip, 0.016, NULL));
        int nvert = om_tissue_mesh(r.m)->nvert;
        size_t n = 3 * (size_t)nvert;
        double *f = om_alloc(n, sizeof *f), *v = om_alloc(n, sizeof *v), worst = 0;
        assert_true(f && v);
        for (int step = 0; step < 10; ++step) {
            OmTissueReport report;
            OmTissueForces forces;
            memcpy(v, om_tissue_v(r.s), n * sizeof *v);
            tip.p.z += 0.001;
            assert_ok(om_tissue_move_grasp(r.s, 0, tip));
            assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, &report));
            assert_int_equal(report.substeps, 1);
            assert_ok(om_tissue_get_internal_force(r.m, r.s, f));
            assert_ok(om_tissue_get_forces(r.m, r.s, &forces));
            OmVec3 sum = {0, 0, 0};
            for (int i = 0; i < nvert; ++i) {
                if (om_tissue_held_by(r.s)[i] != 0) continue;
                OmVec3 a = om_scale(50, om_sub(om_load3(om_tissue_v(r.s), i), om_load3(v, i)));
                a = om_scale(om_tissue_mass(r.m)[i], om_sub(a, om_tissue_gravity(r.m)));
                sum = om_add(sum, om_sub(a, om_load3(f, i)));
            }
            worst = fmax(worst, om_distance(sum, forces.grasp[0]) / om_norm(sum));
        }
        printf("%s: tool force off by %.2g\n", om_tissue_element_name(r.def.element), worst);
        assert_below(worst, 1e-4);  // the tangent is in floats
        om_free(f);
        om_free(v);
        rig_done(&r);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pulled_corners),
        cmocka_unit_test(test_each_by_itself),
        cmocka_unit_test(test_rest_inverted),
        cmocka_unit_test(test_drops),
        cmocka_unit_test(test_floor),
        cmocka_unit_test(test_balance_with_contact),
        cmocka_unit_test(test_tool_force),
        cmocka_unit_test(test_residual_works),
        cmocka_unit_test(test_rotation_works),
        cmocka_unit_test(test_work_bound),
        cmocka_unit_test(test_floor_at_rest),
        cmocka_unit_test(test_residual_is_removed),
        cmocka_unit_test(test_second_linearisation),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
