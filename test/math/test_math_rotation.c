// Quaternions, poses and inverses against their definitions.
#include "test_common.h"

static OmQuat random_rotation(OmRng* rng) {
    OmQuat q = {om_rng_normal(rng), om_rng_normal(rng), om_rng_normal(rng), om_rng_normal(rng)};
    return om_quat_normalize(q);
}
static OmVec3 random_vector(OmRng* rng) {
    return om_vec3(om_rng_normal(rng), om_rng_normal(rng), om_rng_normal(rng));
}

static void quaternions_are_rotations(void** state) {
    (void)state;
    OmRng rng = om_rng_init(1, 0);
    for (int i = 0; i < 1000; ++i) {
        OmQuat a = random_rotation(&rng), b = random_rotation(&rng);
        OmVec3 v = random_vector(&rng);
        OmVec3 twice = om_quat_rotate(a, om_quat_rotate(b, v));
        assert_near(om_distance(twice, om_quat_rotate(om_quat_mul(a, b), v)), 0,
                    1e-14 * (1 + om_norm(v)));
        OmMat3 r = om_quat_to_mat3(a);
        assert_near(om_mat3_det(r), 1, 1e-14);
        OmQuat back = om_quat_from_mat3(r);
        double dot = a.x * back.x + a.y * back.y + a.z * back.z + a.w * back.w;
        assert_near(fabs(dot), 1, 1e-14);
    }
    OmVec3 y = om_quat_rotate(om_quat_axis_angle(om_vec3(0, 0, 2), OM_PI / 2), om_vec3(1, 0, 0));
    assert_near(om_distance(y, om_vec3(0, 1, 0)), 0, 1e-15);
}

static void half_turns_survive_the_matrix(void** state) {
    (void)state;
    const OmVec3 axis[4] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.6, 0, 0.8}};
    for (int i = 0; i < 4; ++i) {
        OmQuat q = om_quat_axis_angle(axis[i], OM_PI);
        OmQuat back = om_quat_from_mat3(om_quat_to_mat3(q));
        assert_near(fabs(q.x * back.x + q.y * back.y + q.z * back.z + q.w * back.w), 1, 1e-14);
    }
}

static void poses_compose_and_invert(void** state) {
    (void)state;
    OmRng rng = om_rng_init(2, 0);
    for (int i = 0; i < 1000; ++i) {
        OmPose a = {random_vector(&rng), random_rotation(&rng)};
        OmPose b = {random_vector(&rng), random_rotation(&rng)};
        OmVec3 v = random_vector(&rng);
        assert_near(
            om_distance(om_pose_apply(om_pose_mul(a, b), v), om_pose_apply(a, om_pose_apply(b, v))),
            0, 1e-13);
        assert_near(om_distance(om_pose_apply(om_pose_inverse(a), om_pose_apply(a, v)), v), 0,
                    1e-13);
    }
}

static void slerp_is_even(void** state) {
    (void)state;
    OmQuat a = om_quat_axis_angle(om_vec3(0, 1, 0), 0.2),
           b = om_quat_axis_angle(om_vec3(0, 1, 0), 1.4);
    OmQuat minus_b = {-b.x, -b.y, -b.z, -b.w};
    OmQuat m = om_quat_slerp(a, minus_b, 0.25);
    OmQuat expect = om_quat_axis_angle(om_vec3(0, 1, 0), 0.5);
    assert_near(fabs(m.y), fabs(expect.y), 1e-14);
    assert_near(fabs(m.w), fabs(expect.w), 1e-14);
}

// A quarter of a motion, checked against the exact pose; the ends are the given poses bit by bit.
static void poses_interpolate(void** state) {
    (void)state;
    OmVec3 axis = om_normalize(om_vec3(1, 2, -2));
    OmPose a = {om_vec3(0.3, -1, 2), om_quat_axis_angle(axis, 0.2)};
    OmPose b = {om_vec3(1.1, 3, -6), om_quat_axis_angle(axis, 1.4)};
    OmPose m = om_pose_lerp(a, b, 0.25),
           expect = {om_vec3(0.5, 0, 0), om_quat_axis_angle(axis, 0.5)};
    OmVec3 v = om_vec3(0.7, -0.4, 1.3);
    assert_near(om_distance(om_pose_apply(m, v), om_pose_apply(expect, v)), 0, 1e-14);
    const double below[3] = {-0.5, 0, -0.0}, above[3] = {1, 1.5, 2};
    for (int k = 0; k < 3; ++k) {
        OmPose begin = om_pose_lerp(a, b, below[k]), end = om_pose_lerp(a, b, above[k]);
        assert_memory_equal(&begin, &a, sizeof a);
        assert_memory_equal(&end, &b, sizeof b);
    }
    OmPose tilted = om_pose_identity(), moved = om_pose_identity();
    tilted.q = om_quat_axis_angle(axis, 1e-6);
    moved.p.z = 1e-9;
    assert_true(om_pose_is_identity(om_pose_identity()));
    assert_false(om_pose_is_identity(tilted));
    assert_false(om_pose_is_identity(moved));
}

static void look_at_has_y_down(void** state) {
    (void)state;
    OmPose cam = om_pose_look_at(om_vec3(0, -1, 1), om_vec3(0, 0, 0), om_vec3(0, 0, 1));
    OmVec3 forward = om_quat_rotate(cam.q, om_vec3(0, 0, 1));
    assert_near(om_distance(forward, om_normalize(om_vec3(0, 1, -1))), 0, 1e-14);
    assert_near(om_distance(om_quat_rotate(cam.q, om_vec3(1, 0, 0)), om_vec3(1, 0, 0)), 0, 1e-14);
    assert_true(om_quat_rotate(cam.q, om_vec3(0, 1, 0)).z < 0);
    cam = om_pose_look_at(om_vec3(0, 0, 1), om_vec3(0, 0, 0), om_vec3(0, 0, 1));
    assert_true(om_is_finite3(om_quat_rotate(cam.q, om_vec3(1, 1, 1))));
}

static void inverses(void** state) {
    (void)state;
    OmRng rng = om_rng_init(3, 0);
    for (int i = 0; i < 200; ++i) {
        OmMat3 m = {random_vector(&rng), random_vector(&rng), random_vector(&rng)}, inv;
        if (fabs(om_mat3_det(m)) < 1e-3) continue;
        assert_ok(om_mat3_inverse(m, &inv));
        OmMat3 e = om_mat3_add(om_mat3_mul(m, inv), om_mat3_scale(-1, om_mat3_identity()));
        assert_near(om_mat3_norm(e), 0, 1e-11);  // condition numbers up to about 1e4
    }
    OmMat3 inv, singular = om_mat3_outer(om_vec3(1, 2, 3), om_vec3(1, 0, 1));
    assert_status(om_mat3_inverse(singular, &inv), OM_INVALID);
    OmVec3 n = om_normalize(om_vec3(0.1, -0.2, -0.97));
    assert_near(om_dot(om_orthogonal(n), n), 0, 1e-15);
    assert_near(om_norm(om_orthogonal(n)), 1, 1e-15);
}

// Turns about one axis differ by the difference of their angles, also small ones, and q and -q are one orientation.
static void test_angle_between(void** state) {
    (void)state;
    const OmVec3 axis = om_normalize(om_vec3(1, -2, 0.5));
    const OmQuat a = om_quat_axis_angle(axis, 0.4);
    for (double turn = 1e-9; turn < 3; turn *= 10) {
        OmQuat b = om_quat_axis_angle(axis, 0.4 + turn);
        assert_near(om_quat_angle(a, b), turn, 1e-15 + 1e-9 * turn + 2e-16);
        b = (OmQuat){-b.x, -b.y, -b.z, -b.w};
        assert_near(om_quat_angle(b, a), turn, 1e-15 + 1e-9 * turn + 2e-16);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_angle_between),
        cmocka_unit_test(quaternions_are_rotations),
        cmocka_unit_test(half_turns_survive_the_matrix),
        cmocka_unit_test(poses_compose_and_invert),
        cmocka_unit_test(slerp_is_even),
        cmocka_unit_test(poses_interpolate),
        cmocka_unit_test(look_at_has_y_down),
        cmocka_unit_test(inverses),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
