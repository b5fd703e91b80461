// Eigen, SVD and polar decompositions on random, degenerate, inverted, huge and tiny matrices.
#include "test_common.h"

static OmMat3 random_matrix(OmRng* rng) {
    OmMat3 m;
    double* p = &m.cx.x;
    for (int i = 0; i < 9; ++i) p[i] = om_rng_normal(rng);
    return m;
}

// The cases a mesh produces on a bad day.
static OmMat3 make_case(int i, OmRng* rng) {
    OmMat3 m = random_matrix(rng);
    OmVec3 a = m.cx, b = m.cy;
    switch (i % 12) {
    case 1: return om_mat3_outer(a, b);           // rank 1
    case 2: m.cz = om_add(m.cx, m.cy); return m;  // rank 2
    case 3: return om_mat3_identity();
    case 4: return (OmMat3){0};
    case 5: return om_mat3_scale(-1, om_mat3_identity());  // inverted
    case 6: return om_mat3_diag(om_vec3(1, 1 + 1e-15, 1 - 1e-15));
    case 7: return om_mat3_scale(1e150, m);
    case 8: return om_mat3_scale(1e-150, m);
    case 9: return om_mat3_diag(om_vec3(1e-12, 5, -5));
    case 10: m.cz = om_vec3(0, 0, 0); return m;                             // a flat element
    case 11: return om_mat3_mul(m, om_mat3_diag(om_vec3(1, 1e-9, 1e-17)));  // nearly a line
    default: return m;
    }
}

static void assert_rotation(OmMat3 r) {
    OmMat3 e =
        om_mat3_add(om_mat3_mul(om_mat3_transpose(r), r), om_mat3_scale(-1, om_mat3_identity()));
    assert_near(om_mat3_norm(e), 0, 1e-13);
    assert_near(om_mat3_det(r), 1, 1e-13);
}

static void svd_rebuilds_the_matrix(void** state) {
    (void)state;
    OmRng rng = om_rng_init(11, 0);
    for (int i = 0; i < 12000; ++i) {
        OmMat3 a = make_case(i, &rng), u, v;
        OmVec3 s;
        om_mat3_svd(a, &u, &s, &v);
        assert_rotation(u);
        assert_rotation(v);
        assert_true(s.x >= s.y && s.y >= fabs(s.z));
        OmMat3 usv = om_mat3_mul(om_mat3_mul(u, om_mat3_diag(s)), om_mat3_transpose(v));
        double err = om_mat3_norm(om_mat3_add(usv, om_mat3_scale(-1, a)));
        assert_near(err, 0, 2e-15 * 9 * om_mat3_norm(a));
    }
}

static void eigen_rebuilds_the_matrix(void** state) {
    (void)state;
    OmRng rng = om_rng_init(12, 0);
    for (int i = 0; i < 12000; ++i) {
        OmMat3 a = make_case(i, &rng), v;
        a = om_mat3_scale(0.5, om_mat3_add(a, om_mat3_transpose(a)));
        OmVec3 w;
        om_mat3_eigen_symmetric(a, &w, &v);
        assert_rotation(v);
        assert_true(w.x <= w.y && w.y <= w.z);
        OmMat3 vwv = om_mat3_mul(om_mat3_mul(v, om_mat3_diag(w)), om_mat3_transpose(v));
        double err = om_mat3_norm(om_mat3_add(vwv, om_mat3_scale(-1, a)));
        assert_near(err, 0, 2e-15 * 9 * om_mat3_norm(a));
    }
}

static void polar_is_the_nearest_rotation(void** state) {
    (void)state;
    OmRng rng = om_rng_init(13, 0);
    for (int i = 0; i < 2400; ++i) {
        OmMat3 f = make_case(i, &rng);
        OmMat3 r = om_mat3_polar(f);
        assert_rotation(r);
        // No random rotation is nearer: the defining property, true for inverted f as well.
        double best = om_mat3_norm(om_mat3_add(f, om_mat3_scale(-1, r)));
        for (int k = 0; k < 20; ++k) {
            OmVec3 axis = om_vec3(om_rng_normal(&rng), om_rng_normal(&rng), om_rng_normal(&rng));
            OmMat3 other =
                om_mat3_mul(r, om_quat_to_mat3(om_quat_axis_angle(axis, om_rng_normal(&rng))));
            double d = om_mat3_norm(om_mat3_add(f, om_mat3_scale(-1, other)));
            assert_true(best <= d * (1 + 1e-14));
        }
    }
}

static void not_finite_input_gives_a_rotation(void** state) {
    (void)state;
    OmMat3 f = om_mat3_identity();
    f.cy.z = NAN;
    assert_true(isfinite(om_mat3_norm(om_mat3_polar(om_mat3_scale(INFINITY, om_mat3_identity())))));
    OmMat3 r = om_mat3_polar(f);
    (void)r;  // must return; what it is worth is the caller's to check
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(svd_rebuilds_the_matrix),
        cmocka_unit_test(eigen_rebuilds_the_matrix),
        cmocka_unit_test(polar_is_the_nearest_rotation),
        cmocka_unit_test(not_finite_input_gives_a_rotation),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
