// test_shape_skin.c: a smooth surface that rides on a coarse one: exact for rigid motions and for a plate that is
// stretched in its plane, continuous along a bent surface, and its map back is the inverse of its map.
#include "omentum/shape_meshing.h"
#include "omentum/shape_skin.h"
#include "test_alloc.h"

#define RADIUS 0.04

static double ball_fn(void* ctx, OmVec3 p) {
    (void)ctx;
    return om_norm(p) - RADIUS;
}

// The boundary of a ball of edges of 12 mm, 0.45 mm inside the ball in the middle of its triangles.
static void make_ball(OmSurface* surface) {
    OmTetMesh mesh;
    double r = 1.2 * RADIUS;
    OmStuffDef def =
        om_stuff_default_def(0.012, ball_fn, NULL, om_vec3(-r, -r, -r), om_vec3(r, r, r));
    def.nworker = 1;
    assert_ok(om_tet_mesh_stuff(&def, &mesh));
    assert_ok(om_tet_mesh_boundary(&mesh, surface, NULL));
    om_tet_mesh_done(&mesh);
}

static void make_field(double spacing, OmSdf* sdf) {
    OmSdfDef def = om_sdf_default_def(spacing);
    double r = 1.3 * RADIUS;
    assert_ok(
        om_sdf_from_function(ball_fn, NULL, om_vec3(-r, -r, -r), om_vec3(r, r, r), &def, sdf));
}

static OmVec3 direction(OmRng* rng) {
    double x = om_rng_normal(rng), y = om_rng_normal(rng);
    return om_normalize(om_vec3(x, y, om_rng_normal(rng)));
}

// Points around the ball have the field's distance and normal, before and after the ball has moved as a whole.
static void test_rigid_motion(void** state) {
    (void)state;
    OmSurface ball;
    OmSdf sdf;
    OmSkin* skin;
    make_ball(&ball);
    make_field(0.002, &sdf);
    assert_ok(om_skin_create(&ball, &skin));
    OmPose motion = {om_vec3(0.1, -0.2, 0.05),
                     om_quat_axis_angle(om_normalize(om_vec3(1, 2, -1)), 2.5)};
    OmSkinPlace bound[20], q;
    OmRng rng = om_rng_init(1, 0);
    OmVec3 rest[20];
    for (int i = 0; i < 20; ++i) {
        rest[i] = om_scale(RADIUS + om_rng_range(&rng, -0.003, 0.003), direction(&rng));
        om_skin_bind(skin, rest[i], &bound[i]);
        assert_near(om_distance(om_skin_put(skin, &bound[i], NULL), rest[i]), 0, 1e-15);
    }
    double* x = om_alloc(3 * (size_t)ball.nvert, sizeof *x);
    for (int i = 0; i < ball.nvert; ++i)
        om_store3(x, i, om_pose_apply(motion, om_load3(ball.x, i)));
    om_skin_move(skin, x);
    for (int i = 0; i < 20; ++i) {
        OmMat3 turn;
        OmVec3 now = om_pose_apply(motion, rest[i]), n;
        assert_near(om_distance(om_skin_put(skin, &bound[i], &turn), now), 0, 1e-13);
        assert_near(om_mat3_det(turn), 1, 1e-12);
        assert_true(om_skin_find(skin, now, 0.01, &q));
        assert_near(om_distance(q.rest, rest[i]), 0, 1e-13);
        double d = om_skin_eval(&q, &sdf, 1e-4, &n);
        assert_near(d, om_sdf_eval(&sdf, rest[i], NULL), 1e-12);
        // the field is sampled: a ball of 20 cells has normals of 1 degree
        OmVec3 out = om_quat_rotate(motion.q, om_normalize(rest[i]));
        assert_true(om_dot(n, out) > 0.999);
        assert_false(om_skin_find(skin, om_madd(now, 0.02, out), 0.01, &q));
    }
    om_free(x);
    om_skin_destroy(skin);
    om_sdf_done(&sdf);
    om_surface_done(&ball);
}

// A plate that is stretched to twice its length and sheared in its plane: places above it go with it, at their height.
static void test_plate_in_its_plane(void** state) {
    (void)state;
    OmSurface plate;
    OmSkin* skin;
    assert_ok(om_surface_init(&plate, 9, 8));
    for (int i = 0; i < 9; ++i) om_store3(plate.x, i, om_vec3(i % 3, i / 3, 0));
    for (int c = 0; c < 4; ++c) {
        int a = c % 2 + 3 * (c / 2);
        memcpy(plate.tri_vert + 6 * c, (int[6]){a, a + 1, a + 4, a, a + 4, a + 3}, 6 * sizeof(int));
    }
    assert_ok(om_skin_create(&plate, &skin));
    double x[27];
    for (int i = 0; i < 9; ++i) {
        OmVec3 p = om_load3(plate.x, i);
        om_store3(x, i, om_vec3(2 * p.x + 0.3 * p.y, p.y, 0));
    }
    om_skin_move(skin, x);
    OmSkinPlace q;
    assert_true(om_skin_find(skin, om_vec3(2 * 0.7 + 0.3 * 1.4, 1.4, 0.25), 1, &q));
    assert_near(om_distance(q.rest, om_vec3(0.7, 1.4, 0.25)), 0, 1e-14);
    om_skin_destroy(skin);
    om_surface_done(&plate);
}

// A ball that is squeezed: along a path above it the place at rest has no jumps, though it crosses many triangles, and
// what is put at a place is found there.
static void test_continuous_on_a_squeezed_ball(void** state) {
    (void)state;
    OmSurface ball;
    OmSdf sdf;
    OmSkin* skin;
    make_ball(&ball);
    make_field(0.001, &sdf);
    assert_ok(om_skin_create(&ball, &skin));
    OmSkinPlace bound[200];
    for (int i = 0; i < 200; ++i) {
        double angle = 2 * OM_PI * i / 200;
        OmVec3 p = om_vec3(cos(angle), 0.6 * sin(angle), 0.8 * sin(angle));
        om_skin_bind(skin, om_scale(RADIUS + 0.001, p), &bound[i]);
    }
    double* x = om_alloc(3 * (size_t)ball.nvert, sizeof *x);
    for (int i = 0; i < ball.nvert; ++i) {
        OmVec3 p = om_load3(ball.x, i);
        om_store3(x, i, om_vec3(1.15 * p.x, 1.05 * p.y, 0.8 * p.z + 2 * p.x * p.x));
    }
    om_skin_move(skin, x);
    double worst = 0, jump = 0;
    OmVec3 n;
    for (int i = 0; i < 200; ++i) {
        OmSkinPlace q;
        OmVec3 at = om_skin_put(skin, &bound[i], NULL);
        assert_true(om_skin_find(skin, at, 0.01, &q));
        worst = fmax(worst, fabs(om_skin_eval(&q, &sdf, 1e-4, &n) - 0.001));
        // along the path to the next place, in steps of 10 um: 1.3 mm
        OmVec3 next = om_skin_put(skin, &bound[(i + 1) % 200], NULL);
        OmVec3 was = {0, 0, 0};
        for (int k = 0; k <= 128; ++k) {
            assert_true(om_skin_find(skin, om_lerp(at, next, k / 128.0), 0.01, &q));
            if (k > 0) jump = fmax(jump, om_distance(q.rest, was));
            was = q.rest;
        }
    }
    assert_below(worst, 1e-4);   // a tenth of its height over the skin
    assert_below(jump, 2.5e-5);  // of steps of 10 um
    om_free(x);
    om_skin_destroy(skin);
    om_sdf_done(&sdf);
    om_surface_done(&ball);
}

static void test_refuses(void** state) {
    (void)state;
    OmSkin* skin;
    double x[9] = {0, 0, 0, 1, 0, 0, 2, 0, 0};
    int tri[3] = {0, 1, 2};
    OmSurface flat = {.nvert = 3, .ntri = 1, .x = x, .tri_vert = tri};
    assert_status(om_skin_create(&flat, &skin), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "triangle 0 of the surface is flat"));
    assert_null(skin);
    x[7] = NAN;
    assert_status(om_skin_create(&flat, &skin), OM_INVALID);
    flat.ntri = 0;
    assert_status(om_skin_create(&flat, &skin), OM_INVALID);
    om_skin_destroy(NULL);
}

static OmStatus create(void* ctx) {
    OmSkin* skin;
    OmStatus status = om_skin_create(ctx, &skin);
    om_skin_destroy(skin);
    return status;
}

static void test_allocations(void** state) {
    (void)state;
    OmSurface ball;
    make_ball(&ball);
    assert_true(test_failing_allocations(create, &ball, 1) > 6);
    om_surface_done(&ball);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rigid_motion),
        cmocka_unit_test(test_plate_in_its_plane),
        cmocka_unit_test(test_continuous_on_a_squeezed_ball),
        cmocka_unit_test(test_refuses),
        cmocka_unit_test(test_allocations),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
