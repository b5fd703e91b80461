// register_shapes.h: shapes with a formula, for tests of registration.
#ifndef OMENTUM_TEST_REGISTER_SHAPES_H
#define OMENTUM_TEST_REGISTER_SHAPES_H

#include "match/register_cases.h"

// An egg with a bump on one side and a dent on another: no symmetry.
static inline double potato(void* ctx, OmVec3 p) {
    (void)ctx;
    OmVec3 q = om_vec3(p.x / 0.050, p.y / 0.036, p.z / 0.028);
    double bump = exp(-om_norm2(om_sub(p, om_vec3(0.025, 0.025, 0.012))) / (0.016 * 0.016));
    double dent = exp(-om_norm2(om_sub(p, om_vec3(-0.025, 0.010, 0.025))) / (0.014 * 0.014));
    return 0.030 * (om_norm(q) - 1) - 0.008 * bump + 0.006 * dent;
}

static inline double egg(void* ctx, OmVec3 p) {  // round about z
    (void)ctx;
    return 0.030 * (om_norm(om_vec3(p.x / 0.030, p.y / 0.030, p.z / (p.z > 0 ? 0.06 : 0.04))) - 1);
}

static inline double ball(void* ctx, OmVec3 p) {
    (void)ctx;
    return om_norm(p) - 0.035;
}

// A plate of 4 mm in the shape of an L, bent: front and back are near each other.
static inline double plate(void* ctx, OmVec3 p) {
    (void)ctx;
    double z = p.z - 4 * p.x * p.x - 2 * p.y * p.y * p.y / 0.04;
    double a = fmax(fabs(p.x) - 0.045, fabs(p.y + 0.015) - 0.012);
    double b = fmax(fabs(p.x + 0.030) - 0.015, fabs(p.y) - 0.035);
    return fmax(fmin(a, b), fabs(z) - 0.002);
}

static inline void make_surface(OmShapeFn shape, double spacing, OmSurface* s) {
    OmSdfDef def = om_sdf_default_def(spacing);
    OmVec3 hi = om_vec3(0.060, 0.052, 0.066);
    OmSdf sdf;
    assert_ok(om_sdf_from_function(shape, NULL, om_scale(-1, hi), hi, &def, &sdf));
    assert_ok(om_surface_from_sdf(&sdf, 0, s));
    om_sdf_done(&sdf);
}

static inline void make_case(OmShapeFn shape, double spacing, OrganCase* c) {
    make_surface(shape, spacing, &c->model);
    make_surface(shape, test_is_slow() ? 0.0016 : 0.002, &c->truth);
    case_prepare(c);
}

static inline OmRegisterDef def_near(const OmScan* scan, OmPose truth, uint64_t seed) {
    OmRegisterDef def = om_register_default_def();
    def.has_start = true;
    def.pose_model_scan = case_start(scan, truth, OM_PI / 6, 0.03, seed);
    def.nworker = 1;
    return def;
}

#endif
