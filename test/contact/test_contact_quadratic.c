// test_contact_quadratic.c: contact of tissue of quadratic elements. Uniform pressure on a face of six nodes gives its
// vertices nothing and its midpoints a third each; contact acts on the four triangles of a face and must not leave a
// pattern of this in the stress.
#include "test_press_rig.h"

// A block under a plate that covers it, by nu = 0 without any sideways motion: the stress is F / A everywhere.
static void press_flat(OmPressMethod method, int ntri, OmTissueElement element) {
    const double lo = 0.02, width = 0.06, height = 0.03, depth = 0.0006;
    PressRig p = {0};
    rig_box(&p.r, om_vec3(lo, lo, 0), om_vec3(lo + width, lo + width, height), 3, 3, 2);
    rig_attach_plane(&p.r, 2, 0);
    p.r.def.gravity = om_vec3(0, 0, 0);
    p.r.def.material_default.poisson = 0;
    p.r.def.material_default.law = OM_COROTATIONAL;
    p.r.def.element = element;
    p.r.def.solver.max_rhs = 8;
    p.r.def.solver.tolerance = 1e-7;
    rig_start(&p.r);
    OmProbeDef plate = om_probe_default_def(OM_PROBE_BOX);
    plate.size = om_vec3(0.12, 0.12, 0.02);
    assert_ok(om_probe_create(&plate, &p.probe));
    OmPressDef def = om_press_default_def(p.probe);
    def.method = method;
    def.ntri = ntri;  // 0: the four triangles of each face themselves
    def.friction = 0;
    assert_ok(om_press_create(&def, p.r.m, &p.press));
    OmPose pose = {om_vec3(lo + 0.5 * width, lo + 0.5 * width, height), om_quat_identity()};
    OmPressReport report = {0};
    assert_ok(om_press_place(p.press, p.r.m, p.r.s, pose));
    for (int n = 0; n < 12; ++n) {
        if (n < 3) pose.p.z -= depth / 3;
        assert_ok(om_press_step(p.press, p.r.m, p.r.s, p.r.w, pose, 10, &report));
    }
    const double stress = report.force.z / (width * width);
    const double young = p.r.def.material_default.young;
    const OmTetMesh* mesh = om_tissue_mesh(p.r.m);
    double* mises = om_calloc((size_t)mesh->ntet, sizeof *mises);
    double lowest = HUGE_VAL, highest = 0;
    assert_ok(om_tissue_get_measure(p.r.m, p.r.s, OM_VON_MISES, mises));
    for (int e = 0; e < mesh->ntet; ++e) {
        OmVec3 c = om_vec3(0, 0, 0);
        for (int k = 0; k < 4; ++k)
            c = om_madd(c, 0.25, om_load3(mesh->x, mesh->tet_vert[4 * e + k]));
        // the middle: a quarter of the width and of the height away from the sides
        if (fabs(c.x - pose.p.x) > 0.25 * width || fabs(c.y - pose.p.y) > 0.25 * width) continue;
        if (c.z < 0.25 * height || c.z > 0.75 * height) continue;
        lowest = fmin(lowest, mises[e] / stress);
        highest = fmax(highest, mises[e] / stress);
    }
    printf(
        "method %d, %s: F / A is %.4f of E times the strain; stress of elements %.5f to %.5f of it\n",
        (int)method, om_tissue_element_name(element), stress / (young * depth / height), lowest,
        highest);
    assert_near_rel(lowest, 1, 0.01);
    assert_near_rel(highest, 1, 0.01);
    assert_near_rel(stress, young * depth / height, 0.03);  // less the springs of contact
    om_free(mises);
    done(&p);
}

static void test_flat_press(void** context) {
    (void)context;
    const OmPressMethod method[] = {OM_PRESS_PENALTY, OM_PRESS_MULTIPLIERS, OM_PRESS_PRESCRIBED};
    for (int k = 0; k < 6; ++k) press_flat(method[k % 3], k < 3 ? 0 : 1004, OM_ELEMENT_QUADRATIC);
}

typedef struct Slid {
    double friction;  // half the difference of the ratios of force aside and up, there and back
    double up;        // N, mean
    double bound;  // the largest tangential force of a point over friction times its normal force
} Slid;

// A sphere 3 mm deep slides 18 mm there and back. The places that count are as long as a side of a quadratic element's
// triangles, and the same both ways: what the slope of facets adds cancels.
static Slid slide(OmTissueElement element, int nx, int ny, int nz, double mu) {
    enum { NSTEP = 18 };
    PressRig p;
    make_block(&p, nx, ny, nz);
    p.r.def.element = element;
    rig_start(&p.r);
    OmProbeDef ball = om_probe_default_def(OM_PROBE_SPHERE);
    assert_ok(om_probe_create(&ball, &p.probe));
    OmPressDef def = om_press_default_def(p.probe);
    def.friction = mu;
    assert_ok(om_press_create(&def, p.r.m, &p.press));
    const double top = 0.05 + ball.radius;
    OmPose pose = {om_vec3(0.051, 0.05, top), om_quat_identity()};
    OmPressReport r = {0};
    Slid out = {0};
    double aside[2] = {0}, up[2] = {0};
    assert_ok(om_press_place(p.press, p.r.m, p.r.s, pose));
    for (int n = 0; n < 6 + 2 * NSTEP; ++n) {
        const int way = n >= 6 + NSTEP, k = (n - 6) % NSTEP + 1;
        const int place = way ? NSTEP - k : k;  // mm, the same ones there and back
        if (n < 3)
            pose.p.z -= 0.001;
        else if (n >= 6)
            pose.p.x += way ? -0.001 : 0.001;
        assert_ok(om_press_step(p.press, p.r.m, p.r.s, p.r.w, pose, H, &r));
        if (n < 6) continue;
        for (int c = 0; c < r.ncontact; ++c) {
            OmVec3 f = om_load3(r.push, c), normal = om_load3(r.normal, c);
            double along = om_dot(f, normal);
            if (along > 0.01 * r.force.z)
                out.bound = fmax(out.bound, om_norm(om_madd(f, -along, normal)) / (mu * along));
        }
        if (place < 5 || place > 14) continue;
        aside[way] += r.force.x, up[way] += r.force.z;
    }
    out.friction = 0.5 * (aside[1] / up[1] - aside[0] / up[0]);
    out.up = (up[0] + up[1]) / 20;
    printf("%s %dx%dx%d, mu %.2f: %.4f aside, %.4f N up, bound %.3f\n",
           om_tissue_element_name(element), nx, ny, nz, mu, out.friction, out.up, out.bound);
    done(&p);
    return out;
}

static void test_sliding_sphere(void** context) {
    (void)context;
    const double mu = 0.1;
    Slid quadratic = slide(OM_ELEMENT_QUADRATIC, 6, 5, 3, mu);
    Slid linear = slide(OM_ELEMENT_LINEAR, 12, 10, 6, mu);
    // All points slide. The ratio is above mu as the dent leans against the ball: 0.108 to 0.110 for linear elements
    // of 18x15x9 cells and quadratic ones of 9x8x5, whether steps take 20 ms or 0.5 s.
    assert_near_rel(quadratic.friction, mu, 0.12);
    assert_near_rel(quadratic.friction, linear.friction, 0.03);
    assert_below(quadratic.bound, 1.02);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_flat_press),
        cmocka_unit_test(test_sliding_sphere),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
