// test_scan_scenes.c: scans of the scenes that come with omentum, at rest, and folded with the tool in view.
#include "scan/scan_truth.h"

static void check_scene(const char* path, int seed, OmVec3 from, OmVec3 to, const char* name) {
    Field f;
    OmScene scene;
    assert_ok(om_scene_load(path, &scene));
    if (seed > 0) scene.seed = seed;
    if (scene.tissue.source == OM_SOURCE_VOLUME)
        snprintf(scene.data_root, sizeof scene.data_root, "%s", test_data_dir());
    setup(&f, scene);
    OmSite twin;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &twin));
    assert_true(om_world_reset(f.world) >= 0);
    const OmScanDef def = om_scan_default_def(om_site_spacing(&twin));
    char text[100];
    snprintf(text, sizeof text, "%s at rest", name);
    check_view(&f, &def, &twin, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR, text);
    from.z += 2 * f.site.half_size.z;
    grasp_at(&f, 0, from);
    assert_ok(om_world_move(f.world, 0, to_world(&f, 0, to), 0.02));
    for (int i = 0; i < 200; ++i) assert_true(om_world_advance(f.world, 0.02) >= 0);
    snprintf(text, sizeof text, "%s %s", name, is_holding(&f, 0) ? "folded" : "with a tool");
    check_view(&f, &def, &twin, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR, text);
    om_site_done(&twin);
    teardown(&f);
}

static void test_sheets(void** state) {
    (void)state;
    check_scene("scenes/sheet.yaml", 2, om_vec3(-0.045, 0.045, 0), om_vec3(0, 0.02, 0.05),
                "seed 2");
    check_scene("scenes/sheet.yaml", 5, om_vec3(0.045, 0.045, 0), om_vec3(0, 0, 0.05), "seed 5");
}

static void test_kidney(void** state) {
    (void)state;
    test_data("ct_abdomen/labels.nii.gz");
    check_scene("scenes/kidney.yaml", 0, om_vec3(0.02, 0, 0), om_vec3(0, -0.01, 0.05), "kidney");
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_sheets),
                                       cmocka_unit_test(test_kidney)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
