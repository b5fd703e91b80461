// test_contact_still.c: tissue on bumps comes to rest outside of them, and `is_settled` says so only then.
#include "test_rig.h"

// z = amplitude sin(kx) sin(ky), the distance to first order.
typedef struct Bumps {
    double amplitude, wavelength;  // m
} Bumps;

static double bumps_distance(const void* ctx, OmVec3 p, OmVec3* gradient) {
    const Bumps* b = ctx;
    double k = 2 * OM_PI / b->wavelength, a = b->amplitude;
    double sx = sin(k * p.x), sy = sin(k * p.y);
    OmVec3 g = om_vec3(-a * k * cos(k * p.x) * sy, -a * k * sx * cos(k * p.y), 1);
    double steep = om_norm(g);  // 1 or more
    *gradient = om_scale(1 / steep, g);
    return (p.z - a * sx * sy) / steep;
}

static double bumps_shape(void* ctx, OmVec3 p) {
    OmVec3 g;
    return bumps_distance(ctx, p, &g);
}

static double fastest(const TestRig* r) {
    double max = 0;
    for (int i = 0; i < r->mesh.nvert; ++i)
        max = fmax(max, om_norm(om_load3(om_tissue_v(r->s), i)));
    return max;
}

// A block of 3 kPa, `half` the half of its side, n x n x n/2 cells, 1 mm above the valleys at the beginning.
static void start(TestRig* r, int n, double half) {
    rig_box(r, om_vec3(-half, -half, 0.0005), om_vec3(half, 0.93 * half, 0.0005 + half), n, n,
            n / 2);
    r->def.material_default.young = 3000;
    rig_start(r);
}

// Six seconds; the last step must be still, settled and not inside. A plane may be off by 1e-5 of the model's size,
// a touching vertex sinks in by its share of the weight over k: bound is three times the first.
static void rest(TestRig* r, const OmContactDef* def, const char* name) {
    double size = 0;
    for (int i = 0; i < r->mesh.nvert; ++i)
        size = fmax(size, om_distance(om_load3(r->mesh.x, i), om_load3(r->mesh.x, 0)));
    rig_contact(r, def);
    OmContactReport report;
    int nsolve = 0, nsubstep = 0;
    for (int k = 0; k < 300; ++k) {
        OmStatus status = om_contact_step(r->cw, r->m, r->s, r->w, 0.02, &report);
        if (status < 0) fail_msg("step %d: %s", k, om_error_message());
        assert_true(report.is_settled);
        nsolve += report.nsolve;
        nsubstep += report.tissue.substeps;
    }
    double weight = 0;
    for (int i = 0; i < r->mesh.nvert; ++i) weight += 9.81 * om_tissue_mass(r->m)[i];
    printf("%s: %.3g mm/s, in by %.3g um; %.2f solves and %.2f substeps a step\n", name,
           1e3 * fastest(r), 1e6 * report.penetration, nsolve / 300.0, nsubstep / 300.0);
    assert_below(fastest(r), 1e-3);
    assert_below(report.penetration, 3e-5 * size);
    assert_near_rel(report.force.z, weight, 0.01);
}

// Without friction; 15, 41, 20 and 304 mm/s and 0.1, 0.4, 0.09 and 1.1 mm inside when planes were laid once a step.
static void test_bumps(void** context) {
    (void)context;
    const struct {
        int n;
        double half, amplitude;
    } table[] = {
        {6, 0.0213, 0.6e-3}, {10, 0.0213, 0.6e-3}, {10, 0.0213, 0.3e-3}, {6, 0.0517, 0.6e-3}};
    for (int k = 0; k < 4; ++k) {
        if (table[k].n > 6 && !test_is_slow()) continue;
        TestRig r;
        start(&r, table[k].n, table[k].half);
        Bumps bumps = {table[k].amplitude, 0.004};
        OmTissueObstacle field = om_field_obstacle(bumps_distance, &bumps);
        OmContactDef def = rig_on(&field);
        char name[80];
        snprintf(name, sizeof name, "block of %.0f mm on bumps of %.1f mm", 2e3 * table[k].half,
                 1e3 * bumps.amplitude);
        rest(&r, &def, name);
        rig_done(&r);
    }
}

// The same bumps as a distance field of 0.5 mm cells, whose normals jump from cell to cell.
static void test_sampled_bumps(void** context) {
    (void)context;
    Bumps bumps = {0.6e-3, 0.004};
    OmSdfDef sdf_def = om_sdf_default_def(0.0005);
    OmSdf sdf;
    assert_ok(om_sdf_from_function(bumps_shape, &bumps, om_vec3(-0.03, -0.03, -0.004),
                                   om_vec3(0.03, 0.03, 0.004), &sdf_def, &sdf));
    OmTissueObstacle organ = om_sdf_obstacle(&sdf);
    TestRig r;
    start(&r, test_is_slow() ? 10 : 6, 0.0213);
    OmContactDef def = rig_on(&organ);
    rest(&r, &def, "block of 43 mm on sampled bumps");
    om_sdf_done(&sdf);
    rig_done(&r);
}

// One solve a step cannot settle: no step says that it did.
static void test_not_settled(void** context) {
    (void)context;
    TestRig r;
    start(&r, 6, 0.0213);
    Bumps bumps = {0.6e-3, 0.004};
    OmTissueObstacle field = om_field_obstacle(bumps_distance, &bumps);
    OmContactDef def = rig_on(&field);
    def.max_iterations = 1;
    rig_contact(&r, &def);
    int nunsettled = 0;
    for (int k = 0; k < 20; ++k) {
        OmContactReport report;
        OmStatus status = om_contact_step(r.cw, r.m, r.s, r.w, 0.02, &report);
        assert_true(status >= 0);
        assert_true(report.is_settled || status == OM_NOT_CONVERGED);
        nunsettled += !report.is_settled;
    }
    assert_true(nunsettled > 0);
    rig_done(&r);
}

// A block thrown up is slow where it turns back: it is not at rest there.
static void test_settle(void** context) {
    (void)context;
    TestRig r;
    start(&r, 4, 0.02);
    const OmContactPlane plane = {{0, 0, 0}, {0, 0, 1}};
    OmTissueObstacle board = om_plane_obstacle(&plane);
    OmContactDef def = rig_on(&board);
    rig_contact(&r, &def);
    double* v = om_calloc(3 * (size_t)r.mesh.nvert, sizeof *v);
    assert_non_null(v);
    for (int i = 0; i < r.mesh.nvert; ++i) v[3 * i + 2] = 5 * 9.81 * 0.02;  // turns back in step 5
    assert_ok(om_tissue_set_x(r.m, r.s, om_tissue_x(r.s), v));
    om_free(v);
    assert_ok(om_contact_settle(r.cw, r.m, r.s, r.w, 0.02, 0.05, 4));
    OmTissueForces f;
    assert_ok(om_tissue_get_forces(r.m, r.s, &f));
    assert_near_rel(f.contact.z, -f.weight.z, 0.3);
    rig_done(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bumps), cmocka_unit_test(test_sampled_bumps),
        cmocka_unit_test(test_not_settled), cmocka_unit_test(test_settle)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
