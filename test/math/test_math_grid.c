// Indices and positions of regular grids, against loops that count.
#include "omentum/math_grid.h"

#include "test_common.h"

static void indices_count_the_points(void** state) {
    (void)state;
    const int dim[3] = {4, 3, 5};
    size_t n = 0, stride[3];
    om_grid_stride(dim, stride);
    for (int k = 0; k < dim[2]; ++k)
        for (int j = 0; j < dim[1]; ++j)
            for (int i = 0; i < dim[0]; ++i, ++n) {
                int at[3];
                assert_int_equal(om_grid_index(dim, i, j, k), n);
                om_grid_unpack(dim, n, at);
                assert_int_equal(at[0], i);
                assert_int_equal(at[1], j);
                assert_int_equal(at[2], k);
                assert_int_equal(
                    (size_t)i * stride[0] + (size_t)j * stride[1] + (size_t)k * stride[2], n);
                assert_true(om_grid_has(dim, i, j, k));
            }
    assert_int_equal(om_grid_count(dim), n);
    for (int c = 0; c < 3; ++c) {
        int below[3] = {0, 0, 0}, above[3] = {0, 0, 0};
        below[c] = -1, above[c] = dim[c];
        assert_false(om_grid_has(dim, below[0], below[1], below[2]));
        assert_false(om_grid_has(dim, above[0], above[1], above[2]));
    }
}

static void corners_are_those_of_a_hexahedron(void** state) {
    (void)state;
    const int dim[3] = {4, 3, 5};
    size_t corner[8];
    int at[8][3];
    om_grid_corners(dim, om_grid_index(dim, 1, 0, 2), corner);
    for (int a = 0; a < 8; ++a) om_grid_unpack(dim, corner[a], at[a]);
    const int expected[8][3] = {{1, 0, 2}, {2, 0, 2}, {2, 1, 2}, {1, 1, 2},
                                {1, 0, 3}, {2, 0, 3}, {2, 1, 3}, {1, 1, 3}};
    for (int a = 0; a < 8; ++a)
        for (int c = 0; c < 3; ++c) assert_int_equal(at[a][c], expected[a][c]);
}

static void points_and_cells_agree(void** state) {
    (void)state;
    const OmGrid g = {{4, 3, 5}, 0.5, {1, -2, 3}};
    OmRng rng = om_rng_init(7, 0);
    assert_near(om_distance(om_grid_point(&g, 1, 2, 3), om_vec3(1.5, -1, 4.5)), 0, 1e-15);
    assert_near(om_distance(om_grid_end(&g), om_vec3(2.5, -1, 5)), 0, 1e-15);
    for (int n = 0; n < 1000; ++n) {
        int at[3];
        OmVec3 p = {4 * om_rng_uniform(&rng), 4 * om_rng_uniform(&rng) - 3,
                    2 + 5 * om_rng_uniform(&rng)};
        om_grid_cell(&g, p, at);
        OmVec3 q = om_grid_point(&g, at[0], at[1], at[2]);
        const double offset[3] = {p.x - q.x, p.y - q.y, p.z - q.z};
        for (int c = 0; c < 3; ++c) {
            assert_true(at[c] >= 0 && at[c] < g.dim[c]);
            if (at[c] > 0) assert_true(offset[c] >= 0);
            if (at[c] < g.dim[c] - 1) assert_true(offset[c] < g.spacing);
        }
    }
    int at[3];
    om_grid_cell(&g, om_vec3(NAN, INFINITY, -INFINITY), at);
    assert_int_equal(at[0], 0);
    assert_int_equal(at[1], g.dim[1] - 1);
    assert_int_equal(at[2], 0);
}

static void voxels_follow_their_axes(void** state) {
    (void)state;
    const OmVoxelGrid g = {{2, 2, 2}, {{0, 2, 0}, {-1, 0, 0}, {0, 0.5, 3}}, {10, 20, 30}};
    OmVec3 p = om_voxel_grid_point(&g, om_vec3(1, 2, 0.5));
    assert_near(om_distance(p, om_vec3(10 - 2, 20 + 2 + 0.25, 30 + 1.5)), 0, 1e-14);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(indices_count_the_points),
        cmocka_unit_test(corners_are_those_of_a_hexahedron),
        cmocka_unit_test(points_and_cells_agree),
        cmocka_unit_test(voxels_follow_their_axes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
