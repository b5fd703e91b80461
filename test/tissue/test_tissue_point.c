// test_tissue_point.c: forces on points inside elements.
#include "test_rig.h"

#include "tissue/tissue_internal.h"

static const double weight[4] = {0.4, 0.3, 0.2, 0.1};

static void make_rig(TestRig* r) {
    rig_box(r, om_vec3(0, 0, 0), om_vec3(0.04, 0.03, 0.03), 4, 3, 3);
    r->def.gravity = om_vec3(0, 0, 0);
    rig_attach_plane(r, 2, 0);
    rig_start(r);
    assert_ok(om_tissue_reserve_points(r->w, 3));
}

static OmMat3 some_stiffness(void) {
    OmVec3 n = om_normalize(om_vec3(1, 2, 3));
    return om_mat3_add(om_mat3_scale(40, om_mat3_outer(n, n)),
                       om_mat3_scale(7, om_mat3_identity()));
}

// A point that is a vertex is that vertex.
static void test_point_at_vertex(void** test) {
    (void)test;
    TestRig r;
    make_rig(&r);
    const int* v = r.mesh.tet_vert + 4 * 60;
    const double corner[4] = {0, 0, 1, 0};
    size_t n3 = 3 * (size_t)r.mesh.nvert;
    double* dv = om_alloc(n3, sizeof *dv);
    assert_ok(om_tissue_begin_step(r.m, r.s, r.w, 0.02));
    om_tissue_add_force(r.w, v[2], om_vec3(0.1, -0.2, 0.3), some_stiffness());
    assert_ok(om_tissue_solve_step(r.m, r.s, r.w, NULL));
    memcpy(dv, om_tissue_dv(r.w), n3 * sizeof *dv);
    assert_ok(om_tissue_begin_step(r.m, r.s, r.w, 0.02));
    assert_ok(om_tissue_add_point_force(r.w, v, corner, om_vec3(0.1, -0.2, 0.3), some_stiffness()));
    assert_ok(om_tissue_solve_step(r.m, r.s, r.w, NULL));
    assert_memory_equal(dv, om_tissue_dv(r.w), n3 * sizeof *dv);
    om_free(dv);
    rig_done(&r);
}

// The solution satisfies the equations of motion with the force the point has at the end; clearing is exact.
static void test_equation(void** test) {
    (void)test;
    TestRig r;
    make_rig(&r);
    const int *v = r.mesh.tet_vert + 4 * 60, *u = r.mesh.tet_vert + 4 * 61;
    double h = 0.02;
    OmVec3 f = om_vec3(0.1, -0.2, 0.3), fixed = om_vec3(0.05, 0, 0);
    OmMat3 K = some_stiffness(), none = om_mat3_scale(0, K);
    size_t n3 = 3 * (size_t)r.mesh.nvert, size = 9 * (size_t)r.w->A.nblock * sizeof(float);
    for (int i = 0; i < r.mesh.nvert; ++i)  // something moves already
        if (r.mesh.x[3 * i + 2] > 0) om_store3(om__state_array(r.s, OM__V), i, om_vec3(0, 0, 0.1));
    assert_ok(om_tissue_begin_step(r.m, r.s, r.w, h));
    float* A = om_alloc(1, size);
    double *b = om_alloc(n3, sizeof *b), *y = om_alloc(n3, sizeof *y);
    memcpy(A, r.w->A.value, size);
    memcpy(b, r.w->b, n3 * sizeof *b);
    om_tissue_add_force(r.w, v[1], fixed, K);  // the two kinds share blocks
    assert_ok(om_tissue_add_point_force(r.w, v, weight, f, K));
    assert_ok(om_tissue_add_point_force(r.w, u, weight, f, none));
    assert_ok(om_tissue_solve_step(r.m, r.s, r.w, NULL));
    om_tissue_clear_forces(r.w);
    assert_memory_equal(A, r.w->A.value, size);
    // A dv = b + h (forces at the end of the step), at every free vertex
    const double *dv = om_tissue_dv(r.w), *vel = om_tissue_v(r.s);
    assert_ok(om_tissue_apply(r.m, r.w, 1, dv, y));
    OmVec3 move = om_vec3(0, 0, 0);
    for (int a = 0; a < 4; ++a)
        move = om_madd(move, h * weight[a], om_add(om_load3(vel, v[a]), om_load3(dv, v[a])));
    OmVec3 at_point = om_sub(f, om_mat3_apply(K, move));
    OmVec3 own = om_scale(h, om_add(om_load3(vel, v[1]), om_load3(dv, v[1])));
    OmVec3 at_vert = om_sub(fixed, om_mat3_apply(K, own));
    om_store3(b, v[1], om_madd(om_load3(b, v[1]), h, at_vert));
    for (int a = 0; a < 4; ++a) {
        om_store3(b, v[a], om_madd(om_load3(b, v[a]), h * weight[a], at_point));
        om_store3(b, u[a], om_madd(om_load3(b, u[a]), h * weight[a], f));
    }
    double error = 0, scale = 0;
    for (int i = 0; i < r.mesh.nvert; ++i) {
        if (om_tissue_is_prescribed(r.m, r.s, i)) continue;
        error += om_norm2(om_sub(om_load3(b, i), om_load3(y, i)));
        scale += om_norm2(om_load3(b, i));
    }
    assert_near(sqrt(error), 0,
                3e-6 * sqrt(scale));  // the rig's tolerance is 1e-6 of a smaller norm
    om_free(A);
    om_free(b);
    om_free(y);
    rig_done(&r);
}

static void test_input(void** test) {
    (void)test;
    TestRig r;
    make_rig(&r);
    OmVec3 f = om_vec3(0, 0, 1);
    OmMat3 K = om_mat3_identity();
    assert_ok(om_tissue_begin_step(r.m, r.s, r.w, 0.02));
    int apart[4] = {0, 1, 2, r.mesh.nvert - 1}, outside[4] = {0, 1, 2, r.mesh.nvert};
    assert_int_equal(om_tissue_add_point_force(r.w, apart, weight, f, K), OM_INVALID);
    assert_int_equal(om_tissue_add_point_force(r.w, outside, weight, f, K), OM_INVALID);
    for (int k = 0; k < 3; ++k)
        assert_ok(om_tissue_add_point_force(r.w, r.mesh.tet_vert, weight, f, K));
    assert_int_equal(om_tissue_add_point_force(r.w, r.mesh.tet_vert, weight, f, K), OM_INVALID);
    assert_int_equal(om_tissue_reserve_points(r.w, -1), OM_INVALID);
    rig_done(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_point_at_vertex),
        cmocka_unit_test(test_equation),
        cmocka_unit_test(test_input),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
