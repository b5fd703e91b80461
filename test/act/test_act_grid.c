// test_act_grid.c: the blocks of the grid and their grasping points. The finest grid of a scene fits the arrays, and a
// finer one is refused.
#include "act/act_state.h"
#include "easy_scene.h"
#include "linear_sheet.h"
#include "test_common.h"

// 120 x 120 mm in 4 x 4 blocks of 30 mm: block 0 is at -x, -y; x runs first. 8 x 8 cells of 15 mm put a vertex in the
// middle of every block.
static void blocks_and_their_points(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    scene.task.grid = 4;
    scene.roi.center = om_vec3(0.04, -0.01, 0);
    scene.attach.lo = om_vec3(-0.061, 0.031, -1);  // the two last rows of vertices
    OmSite site;
    OmBody* body;
    Grid grid;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    assert_ok(om_body_create(&scene, &site, 1, &body));
    assert_ok(om__grid_build(&scene.task, &site, &grid));
    for (int b = 0; b < 16; ++b) {
        double x = -0.045 + 0.03 * (b % 4), y = -0.045 + 0.03 * (b / 4);
        assert_near(grid.center[3 * b], x, 1e-12);
        assert_near(grid.center[3 * b + 1], y, 1e-12);
        OmVec3 p = om_load3(site.mesh.x, grid.vert[b]);
        OmVec3 q = om_pose_apply(om_pose_inverse(site.pose_world_task), p);
        assert_near(om_distance(q, om_vec3(x, y, 0.005)), 0, 1e-9);
        assert_near(om_distance(grid.tip[b], q), 0, 1e-12);
        assert_true(om__grid_is_fixed(&grid, body, b) == (b >= 12));
    }
    assert_int_equal(grid.roi_block, 1 * 4 + 3);
    // What counts are the attachments of the body's state, not the set of its mesh.
    int vert = grid.vert[5];
    assert_ok(om_body_set_attachment(body, 1, &vert, NULL, NULL));
    for (int b = 0; b < 16; ++b) assert_true(om__grid_is_fixed(&grid, body, b) == (b == 5));
    om_body_destroy(body);
    om_site_done(&site);
}

// Shells are grasped in the middle of a face: of 16 cells of 7.5 mm, middles of blocks of 24 mm are at most 3 mm away.
static void points_of_shells(void** state) {
    (void)state;
    static const double nearest[5] = {-0.04875, -0.02625, 0.00375, 0.02625,
                                      0.04875};  // or its mirror image
    OmScene scene = easy_scene();
    scene.tissue.element = OM_ELEMENT_SHELL;
    scene.tissue.cells = om_vec3(16, 16, 2);  // only faces on top count
    scene.task.grid = 5;
    OmSite site;
    OmBody* body;
    Grid grid;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    assert_int_equal(site.element, OM_ELEMENT_SHELL);
    assert_ok(om__grid_build(&scene.task, &site, &grid));
    for (int b = 0; b < 25; ++b) {
        const OmVec3 p = grid.tip[b];
        assert_near(fabs(p.x), fabs(nearest[b % 5]), 1e-9);
        assert_near(fabs(p.y), fabs(nearest[b / 5]), 1e-9);
        assert_true(b % 5 == 2 || p.x * nearest[b % 5] > 0);
        assert_near(p.z, 0.005, 1e-9);
        const OmVec3 q = om__grid_point(&grid, site.mesh.x, b);
        assert_near(om_distance(om_pose_apply(grid.task, p), q), 0, 1e-9);
        assert_near(om_distance(q, om_load3(site.mesh.x, grid.vert[b])), 0.00375 * sqrt(2), 1e-9);
    }
    // The body holds the face, and nothing else.
    scene.tissue.cells = om_vec3(16, 16, 1);
    om_site_done(&site);
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    assert_ok(om__grid_build(&scene.task, &site, &grid));
    assert_ok(om_body_create(&scene, &site, 1, &body));
    int nheld;
    const OmPose pose = {om_pose_apply(grid.task, grid.tip[7]), grid.task.q};
    assert_ok(om_body_grasp(body, 0, pose, 0.005, &nheld));
    assert_int_equal(nheld, 4);
    for (int k = 0; k < 4; ++k) assert_int_equal(om_body_held_by(body)[grid.face[7][k]], 0);
    om_body_destroy(body);
    om_site_done(&site);
}

static void the_finest_grid_fits(void** state) {
    (void)state;
    OmScene scene = linear_sheet();
    scene.tissue.cells = om_vec3(40, 40, 1);  // a vertex for each block
    scene.task.grid = OM_SCENE_MAX_GRID;
    OmSite site;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    Grid* grid = om_alloc(1, sizeof *grid);  // the sanitizer watches its end
    assert_non_null(grid);
    assert_ok(om__grid_build(&scene.task, &site, grid));
    for (int b = 0; b < OM_SCENE_MAX_GRID * OM_SCENE_MAX_GRID; ++b) {
        int ix = b % OM_SCENE_MAX_GRID, iy = b / OM_SCENE_MAX_GRID;
        assert_true(grid->vert[b] >= 0);
        // the middle of the block; its height is that of the grasping point
        assert_near(grid->center[3 * b], 0.12 * ((ix + 0.5) / OM_SCENE_MAX_GRID - 0.5), 1e-12);
        assert_near(grid->center[3 * b + 1], 0.12 * ((iy + 0.5) / OM_SCENE_MAX_GRID - 0.5), 1e-12);
        assert_near(grid->center[3 * b + 2], grid->tip[b].z, 0);
    }
    for (int n = OM_SCENE_MAX_GRID + 1; n <= 20; ++n) {
        scene.task.grid = n;
        assert_status(om__grid_build(&scene.task, &site, grid), OM_INVALID);
        assert_non_null(strstr(om_error_message(), "1 to 16"));
    }
    om_free(grid);
    om_site_done(&site);
}

static void a_scene_states_the_range(void** state) {
    (void)state;
    for (int n = 2; n <= 20; ++n) {
        char text[256];
        OmScene scene;
        int len =
            snprintf(text, sizeof text, "name: a\ntissue: {source: sheet}\ntask: {grid: %d}\n", n);
        OmStatus status = om_scene_parse(text, (size_t)len, "s.yaml", &scene);
        assert_int_equal(status, n <= OM_SCENE_MAX_GRID ? OM_OK : OM_INVALID);
        if (status < 0) assert_non_null(strstr(om_error_message(), "grid: "));
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(blocks_and_their_points),
        cmocka_unit_test(points_of_shells),
        cmocka_unit_test(the_finest_grid_fits),
        cmocka_unit_test(a_scene_states_the_range),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
