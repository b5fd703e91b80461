// The finest grid of a scene fits the arrays of the loop, and a finer one is refused.
#include "defras/defras_internal.h"
#include "linear_sheet.h"
#include "test_common.h"

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
        cmocka_unit_test(the_finest_grid_fits),
        cmocka_unit_test(a_scene_states_the_range),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
