// test_scene_site.c: scene files, and the operating sites built from them.
#include "test_alloc.h"
#include "test_files.h"

#include "linear_sheet.h"
#include "omentum/scene.h"
#include "omentum/shape_file.h"
#include "scene/scene_keys.h"

static const OmYamlField whole = {"scene", OM_YAML_STRUCT, 0, .sub = &om__scene_schema};

// ---- files ---------------------------------------------------------------------------------------------

static void test_the_sheet_is_the_default(void** state) {
    (void)state;
    OmScene file, plain = om_scene_default();
    assert_ok(om_scene_load("scenes/sheet.yaml", &file));
    assert_string_equal(file.data_root, "scenes");
    // But for where it came from, the committed scene and the built-in one are the same.
    memcpy(plain.path, file.path, sizeof plain.path);
    memcpy(plain.data_root, file.data_root, sizeof plain.data_root);
    assert_int_equal(file.seed, plain.seed);
    assert_near(file.tissue.size.x, plain.tissue.size.x, 1e-12);
    assert_near(file.tissue.cells.x, plain.tissue.cells.x, 0);
    assert_int_equal(om_scene_element(&plain, OM_SITE_TWIN), OM_ELEMENT_SHELL);
    assert_int_equal(om_scene_element(&file, OM_SITE_TWIN), OM_ELEMENT_SHELL);
    assert_near(file.tissue.young, plain.tissue.young, 0);
    assert_near(file.task.force_threshold, plain.task.force_threshold, 0);
    assert_near(file.task.max_height, plain.task.max_height, 1e-12);
    assert_near(file.roi.radius, plain.roi.radius, 1e-12);
    assert_near(file.endoscope.elevation, plain.endoscope.elevation, 1e-12);
    assert_near(file.world.young_factor, plain.world.young_factor, 0);
}

static void test_all_scenes_load(void** state) {
    (void)state;
    static const char* const path[] = {"scenes/sheet.yaml", "scenes/silicone.yaml",
                                       "scenes/kidney.yaml"};
    for (int i = 0; i < 3; ++i) {
        OmScene scene;
        assert_ok(om_scene_load(path[i], &scene));
    }
}

static void expect_refusal(const char* text, const char* words) {
    OmScene scene;
    assert_status(om_scene_parse(text, strlen(text), "s.yaml", &scene), OM_INVALID);
    if (!strstr(om_error_message(), words))
        fail_msg("\"%s\" does not say \"%s\"", om_error_message(), words);
}

static void test_wrong_scenes_are_explained(void** state) {
    (void)state;
    expect_refusal("name: x\n", "tissue");
    expect_refusal("name: x\ntissue: {source: sheat}\n", "sheet");
    expect_refusal("name: x\ntissue:\n  source: sheet\n  yuong: 3\n", "did you mean \"young\"");
    expect_refusal("name: x\ntissue:\n  source: sheet\n  mesh_factor: 0.5\n",
                   "4: tissue: mesh_factor is gone: the default `element` bends as the "
                   "tissue does; delete the line");
    expect_refusal("name: x\ntissue:\n  source: sheet\n  yuong: 3\n", "s.yaml:4");
    expect_refusal("name: x\ntissue: {source: sheet, young: soft}\n", "young");
    expect_refusal("name: x\ntissue: {source: sheet, poisson: 0.5}\n", "poisson");
    expect_refusal("name: x\ntissue: {source: mesh}\n", "\"file\" is missing");
    expect_refusal("name: x\ntissue: {source: sheet, cells: [2.5, 2, 1]}\n", "whole numbers");
    expect_refusal("name: x\ntissue: {source: sheet}\n"
                   "attachments: {kind: random_patch, share_min: 0.5, share_max: 0.2}\n",
                   "share_min");
    expect_refusal("name: x\ntissue: {source: sheet, up: [0, 0, 0]}\n", "up");
    // what nothing would use
    expect_refusal("name: x\ntissue: {source: sheet, up: [0, 1, 0]}\n", "up has no effect");
    expect_refusal("name: x\ntissue: {source: sheet, view: [0, 1, 0]}\n", "view has no effect");
    expect_refusal("name: x\ntissue: {source: sheet, file: a.vtu}\n", "file has no effect");
    expect_refusal("name: x\ntissue: {source: mesh, file: a.vtu, cells: [9, 9, 1]}\n", "cells");
    expect_refusal("name: x\ntissue: {source: sheet}\nmodel: {label: 7}\n", "model has no effect");
    expect_refusal("name: x\ntissue: {source: patient, file: p.yaml, board: false}\n", "board");
    expect_refusal("name: x\ntissue: {source: patient, file: p.yaml}\nroi: {radius_mm: 3}\n",
                   "roi has no effect on tissue of source patient");
    expect_refusal("name: x\ntissue: {source: patient, file: p.yaml}\n"
                   "attachments: {kind: box, lo_mm: [0, 0, 0], hi_mm: [1, 1, 1]}\n",
                   "hi_mm has no effect");
    expect_refusal("name: x\ntissue: {source: patient, file: p.yaml}\nattachments: {kind: box}\n",
                   "a patient has its own");
    expect_refusal("name: x\ntissue: {source: sheet}\n"
                   "attachments: {kind: random_patch, lo_mm: [1, 0, 0]}\n",
                   "without kind: box");
    expect_refusal("name: x\ntissue: {source: sheet}\nroi: {center_mm: [1, 0, 0]}\n",
                   "say random: false");
}

// ---- sites ---------------------------------------------------------------------------------------------

static bool has(const OmMeshSet* set, int vert) {
    for (int i = 0; i < set->nvert; ++i)
        if (set->vert[i] == vert) return true;
    return false;
}

static void test_seventeen_layouts(void** state) {
    (void)state;
    OmScene scene = linear_sheet();
    for (int seed = 1; seed <= 17; ++seed) {
        scene.seed = seed;
        OmSite site;
        assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
        const OmMeshSet* under = om_tet_mesh_find_set(&site.mesh, "underside");
        const OmMeshSet* held = om_tet_mesh_find_set(&site.mesh, "attachment");
        double share = (double)held->nvert / under->nvert;
        // A patch is a whole number of vertices; the underside has 441.
        if (share < 0.1 - 2.0 / 441 || share > 0.5 + 2.0 / 441)
            fail_msg("layout %d holds %g of the underside", seed, share);
        for (int i = 0; i < held->nvert; ++i) assert_true(has(under, held->vert[i]));
        // The ROI lies on the board, its margin clear of what is held.
        for (int i = 0; i < held->nvert; ++i) {
            OmVec3 p = om_load3(site.mesh.x, held->vert[i]);
            double gap = om_distance(p, site.roi_center) - scene.roi.radius;
            if (gap < scene.roi.margin - 1e-3)
                fail_msg("layout %d: the ROI is %g mm from an attachment", seed, 1e3 * gap);
        }
        for (int i = 0; i < site.nroi; ++i) {
            OmVec3 p = om_load3(site.roi_x, i);
            assert_true(p.z > 0 && p.z < 1e-3);
            assert_true(om_distance(p, site.roi_center) <= scene.roi.radius + 1e-3);
        }
        om_site_done(&site);
    }
}

// Each number of the truth is the twin's times its own factor; a second material keeps its ratio to the first.
static void test_numbers_of_a_site(void** state) {
    (void)state;
    OmScene scene = linear_sheet();
    scene.tissue.young = 3200;
    scene.tissue.density = 1050;
    scene.world.young_factor = 0.75;
    scene.world.density_factor = 1.2;
    OmSite site;
    memset(&site, 0, sizeof site);
    site.role = OM_SITE_TWIN;
    om_site_set_numbers(&scene, &site);
    assert_near(site.young, 3200, 1e-9);
    assert_near(site.density, 1050, 1e-9);
    site.role = OM_SITE_WORLD;
    om_site_set_numbers(&scene, &site);
    assert_near(site.young, 2400, 1e-9);
    assert_near(site.density, 1260, 1e-9);

    site.nmaterial = 2;
    site.material[0] = (OmSiteMaterial){"fat", 3000, 0.45, 900};
    site.material[1] = (OmSiteMaterial){"gland", 9000, 0.48, 1080};
    om_site_set_numbers(&scene, &site);  // the scene's numbers are those of the first
    OmSiteMaterial first = om_site_get_material(&site, 0), second = om_site_get_material(&site, 1);
    assert_near(first.young, 2400, 1e-9);
    assert_near(first.density, 1260, 1e-9);
    assert_near(second.young, 7200, 1e-9);
    assert_near(second.density, 1512, 1e-9);
    scene.tissue.young = scene.tissue.density = scene.tissue.poisson = -1;  // each its own
    om_site_set_numbers(&scene, &site);
    second = om_site_get_material(&site, 1);
    assert_near(second.young, 6750, 1e-9);
    assert_near(second.density, 1296, 1e-9);
    assert_near(second.poisson, 0.48, 0);
    assert_near(om_site_get_material(&site, 0).young, 2250, 1e-9);
}

static void test_world_is_another_body(void** state) {
    (void)state;
    OmScene scene = linear_sheet();
    OmSite twin, world, again;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &twin));
    assert_ok(om_site_build(&scene, OM_SITE_WORLD, NULL, &world));
    assert_ok(om_site_build(&scene, OM_SITE_WORLD, NULL, &again));
    assert_true(world.mesh.nvert >= 2 * twin.mesh.nvert);
    assert_near_rel(world.young, scene.world.young_factor * twin.young, 1e-12);
    assert_near_rel(om_tet_mesh_volume(&world.mesh), om_tet_mesh_volume(&twin.mesh), 1e-9);
    assert_memory_equal(world.roi_x, twin.roi_x, 3 * (size_t)twin.nroi * sizeof(double));
    assert_memory_equal(world.mesh.x, again.mesh.x, 3 * (size_t)world.mesh.nvert * sizeof(double));
    // Both hold the same part of the underside: every held vertex of one has one of the other near.
    const OmMeshSet* a = om_tet_mesh_find_set(&twin.mesh, "attachment");
    const OmMeshSet* b = om_tet_mesh_find_set(&world.mesh, "attachment");
    assert_true(b && b->nvert > a->nvert);
    for (int i = 0; i < b->nvert; ++i) {
        double nearest = INFINITY;
        for (int k = 0; k < a->nvert; ++k)
            nearest = fmin(nearest, om_distance(om_load3(world.mesh.x, b->vert[i]),
                                                om_load3(twin.mesh.x, a->vert[k])));
        assert_below(nearest, 0.0043);  // half the diagonal of the twin's 6 mm squares
    }
    om_site_done(&twin);
    om_site_done(&world);
    om_site_done(&again);
}

// Save the mesh in millimetres, and a scene that reads it; the mesh is freed.
static OmScene scene_of_mesh(OmTetMesh* mesh, const char* path) {
    OmScene scene = linear_sheet();
    assert_ok(om_tet_mesh_save(mesh, path, OM_UNIT_MM));
    om_tet_mesh_done(mesh);
    scene.tissue.source = OM_SOURCE_MESH;
    snprintf(scene.tissue.file, sizeof scene.tissue.file, "%s", path);
    scene.tissue.unit = OM_UNIT_MM;
    return scene;
}

static void test_a_mesh_lies_on_its_board(void** state) {
    (void)state;
    // A box with y up, in millimetres: the scene's task frame turns it upright.
    OmTetMesh box;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.08, 0.006, 0.06), 8, 2, 6, &box));
    const char* path = temp_path("site.vtu");
    OmScene scene = scene_of_mesh(&box, path);
    scene.tissue.up = om_vec3(0, 1, 0);
    scene.tissue.view = om_vec3(0, 0, 1);
    OmSite site;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    assert_near(site.half_size.x, 0.03, 1e-9);  // z of the file, away from the camera
    assert_near(site.half_size.y, 0.04, 1e-9);
    assert_near(site.half_size.z, 0.003, 1e-9);
    OmVec3 away = om_quat_rotate(site.pose_world_task.q, om_vec3(1, 0, 0));
    assert_near(om_dot(away, om_vec3(0, 0, -1)), 1, 1e-9);
    assert_near(om_dot(site.gravity, om_vec3(0, -1, 0)), 9.81, 1e-9);
    assert_true(om_tet_mesh_find_set(&site.mesh, "underside")->nvert >= 63);
    om_site_done(&site);
    remove(path);
}

// A mesh alone: the lowest layer of a box of 9 x 4 x 7 vertices, with y up, is its 63 vertices at y = 0, on a board.
// One that has a set "attachment" is held there and nowhere else, in the air.
static void test_a_mesh_alone_is_held(void** state) {
    (void)state;
    OmTetMesh box;
    OmSite site;
    bool is_lowest;
    const OmVec3 size = om_vec3(0.08, 0.03, 0.06);
    const char* path = temp_path("alone.vtu");
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), size, 8, 3, 6, &box));
    OmScene scene = scene_of_mesh(&box, path);
    scene.tissue.up = om_vec3(0, 1, 0);
    scene.attach.kind = OM_ATTACH_SET;
    assert_ok(om_site_build_tissue(&scene, NULL, &site, &is_lowest));
    const OmMeshSet* held = om_tet_mesh_find_set(&site.mesh, "attachment");
    assert_true(is_lowest && site.has_ground && site.nroi == 0);
    assert_int_equal(held->nvert, 63);
    for (int k = 0; k < held->nvert; ++k) assert_near(site.mesh.x[3 * held->vert[k] + 1], 0, 1e-9);
    assert_near(om_site_attached_area(&site), size.x * size.z, 1e-9);
    om_site_done(&site);
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), size, 8, 3, 6, &box));
    assert_ok(om_tet_mesh_add_set(&box, "attachment", (int[3]){5, 7, 2}, 3));
    scene = scene_of_mesh(&box, path);
    assert_ok(om_site_build_tissue(&scene, NULL, &site, &is_lowest));
    assert_true(!is_lowest && !site.has_ground);
    assert_int_equal(om_tet_mesh_find_set(&site.mesh, "attachment")->nvert, 3);
    om_site_done(&site);
    scene.tissue.source = OM_SOURCE_SHEET;
    assert_status(om_site_build_tissue(&scene, NULL, &site, NULL), OM_INVALID);
    remove(path);
}

// A mesh whose own attachments are two vertices of the top has no area to spread a foundation on.
static void test_foundation_needs_area(void** state) {
    (void)state;
    OmTetMesh box;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.08, 0.06, 0.006), 8, 6, 1, &box));
    int vert[2] = {-1, -1};
    for (int i = 0; i < box.nvert; ++i) {
        OmVec3 p = om_load3(box.x, i);
        if (p.z > 0.005 && p.y < 1e-9 && p.x < 1e-9) vert[0] = i;
        if (p.z > 0.005 && p.y < 1e-9 && p.x > 0.079) vert[1] = i;
    }
    assert_ok(om_tet_mesh_add_set(&box, "attachment", vert, 2));
    const char* path = temp_path("dots.msh");
    OmScene scene = scene_of_mesh(&box, path);
    scene.attach.kind = OM_ATTACH_SET;
    scene.roi.is_random = false;
    OmSite site;
    scene.attach.stiffness = 20;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    om_site_done(&site);
    scene.attach.stiffness = 0;
    scene.attach.foundation = 3e4;
    assert_status(om_site_build(&scene, OM_SITE_TWIN, NULL, &site), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "no area"));
    remove(path);
}

static void test_impossible_sites_are_explained(void** state) {
    (void)state;
    OmScene scene = linear_sheet();
    OmSite site;
    scene.roi.radius = 0.058;
    assert_status(om_site_build(&scene, OM_SITE_TWIN, NULL, &site), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "radius_mm"));
    scene = linear_sheet();
    scene.roi.is_random = false;
    scene.roi.center = om_vec3(0.2, 0, 0);
    assert_status(om_site_build(&scene, OM_SITE_TWIN, NULL, &site), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "not under the tissue"));
    scene = linear_sheet();
    scene.attach.kind = OM_ATTACH_BOX;
    scene.attach.lo = scene.attach.hi = om_vec3(1, 1, 1);
    assert_status(om_site_build(&scene, OM_SITE_TWIN, NULL, &site), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "box holds no vertex"));
    scene = linear_sheet();
    scene.tissue.world_cells = scene.tissue.cells;
    assert_status(om_site_build(&scene, OM_SITE_WORLD, NULL, &site), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "world_cells"));
    // with midpoints the same cells have more than twice the nodes
    scene.world.element = OM_ELEMENT_QUADRATIC;
    assert_ok(om_site_build(&scene, OM_SITE_WORLD, NULL, &site));
    om_site_done(&site);
    scene = linear_sheet();
    scene.tissue.source = OM_SOURCE_VOLUME;
    snprintf(scene.tissue.file, sizeof scene.tissue.file, "none.nii.gz");
    assert_status(om_site_build(&scene, OM_SITE_TWIN, NULL, &site), OM_IO);
    assert_non_null(strstr(om_error_message(), "none.nii.gz"));
}

// What cannot work is refused by the reader, before any mesh is built; what is left out follows the twin's mesh.
static void test_world_mesh_follows_the_twin(void** state) {
    (void)state;
    OmScene scene = linear_sheet();
    OmSite twin, world;
    const double cells[4][3] = {{1, 1, 1}, {5, 3, 1}, {20, 20, 1}, {7, 9, 2}};
    for (int i = 0; i < 4; ++i) {
        scene.tissue.cells = om_load3(cells[i], 0);
        if (i == 0) scene.roi.is_random = false, scene.attach.kind = OM_ATTACH_BOX;
        if (i == 0) scene.attach.lo = om_vec3(-1, -1, -1), scene.attach.hi = om_vec3(1, 1, 1);
        if (i == 1) scene = linear_sheet(), scene.tissue.cells = om_load3(cells[i], 0);
        if (i == 1) scene.roi.margin = scene.roi.radius = 0.001;
        assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &twin));
        assert_ok(om_site_build(&scene, OM_SITE_WORLD, NULL, &world));
        assert_true(world.mesh.nvert >= 2 * twin.mesh.nvert);
        assert_true(world.mesh.nvert <= 6 * twin.mesh.nvert);
        om_site_done(&twin);
        om_site_done(&world);
    }
    expect_refusal(
        "name: x\ntissue: {source: sheet, element: quadratic, cells: [4, 4, 1], world_cells: [5, 5, 1]}\n",
        "make 363 nodes, cells 243: the truth needs at least twice as many");
    expect_refusal("name: x\ntissue: {source: sheet}\nrgbd: {focal_px: [200, 0]}\n",
                   "rgbd: focal_px, center_px, distortion: camera: focal lengths");
    expect_refusal("name: x\ntissue: {source: sheet}\nendoscope: {distortion: [-2, 0, 0, 0, 0]}\n",
                   "endoscope: focal_px, center_px, distortion: camera: distortion k1 -2, k2 0");
    const char* volume = "name: x\ntissue: {source: volume, file: none.nii}\n"
                         "model: {label: 3, edge_mm: 4.5, world_edge_mm: 3.8}\n";
    expect_refusal(volume, "world_edge_mm 3.8 is too near edge_mm 4.5");
    expect_refusal(volume, "say 3.15 or leave it out");
    expect_refusal("name: x\ntissue: {source: volume, file: none.nii}\n"
                   "model: {label: 3, world_edge_mm: 0.3}\n",
                   "world_edge_mm 0.3 is outside its range");
}

// A volume's twin at any edge has a truth without a word on its edge.
static void test_world_edge_is_derived(void** state) {
    (void)state;
    (void)test_data("ct_abdomen");
    const double edge[2] = {0.009, 0.0045};
    for (int i = 0; i < 2; ++i) {
        OmScene scene;
        assert_ok(om_scene_load("scenes/kidney.yaml", &scene));
        snprintf(scene.data_root, sizeof scene.data_root, "%s", test_data_dir());
        scene.model.label = 2;
        scene.model.edge = edge[i];
        scene.model.world_edge = 0;
        OmSite twin, world;
        assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &twin));
        assert_ok(om_site_build(&scene, OM_SITE_WORLD, NULL, &world));
        assert_true(world.mesh.nvert >= 2 * twin.mesh.nvert);
        assert_true(world.mesh.nvert <= 4 * twin.mesh.nvert);
        om_site_done(&twin);
        om_site_done(&world);
    }
}

// A printed scene reads again as the same scene, bit by bit, and prints the same text.
static void expect_round_trip(const OmScene* scene) {
    OmScene again;
    OmText text = {0}, second = {0};
    assert_ok(om_scene_print(scene, true, &text));
    assert_ok(om_scene_parse(text.str, text.len, "printed.yaml", &again));
    assert_ok(om_scene_print(&again, true, &second));
    assert_string_equal(text.str, second.str);
    assert_true(om_yaml_is_equal(&whole, scene, &again));
    om_text_done(&second);  // without comments
    assert_ok(om_scene_print(scene, false, &second));
    assert_null(strstr(second.str, "# of the scene"));
    assert_ok(om_scene_parse(second.str, second.len, "printed.yaml", &again));
    assert_true(om_yaml_is_equal(&whole, scene, &again));
    om_text_done(&text);
    om_text_done(&second);
}

static void test_printed_scenes_read_again(void** state) {
    (void)state;
    static const char* const path[] = {"scenes/sheet.yaml", "scenes/silicone.yaml",
                                       "scenes/kidney.yaml", "scenes/calibrate/gel.yaml"};
    OmScene s;
    for (int i = 0; i < 4; ++i) {
        assert_ok(om_scene_load(path[i], &s));
        expect_round_trip(&s);
    }
    // Numbers that no short decimal hits, and text that YAML would take for something else.
    const char* odd =
        "name: \"a: \\\"b\\\" # \\\\ c\"\nseed: 2147483647\n"
        "tissue: {source: mesh, file: 'true', young: 3333.3333333333335, up: [0.1, 0.2, 0.9],"
        " size_mm: [120, 120, 5], unit_mm: 0.1, gravity: 9.80665}\n"
        "endoscope: {elevation_deg: 33.333333333333336, fov_deg: 47.7}\n"
        "task: {time_step_ms: 16.666666666666668, speed_mm_s: 0.3}\n";
    assert_ok(om_scene_parse(odd, strlen(odd), "odd.yaml", &s));
    expect_round_trip(&s);
    OmRng rng = om_rng_init(5, 0);
    for (int i = 0; i < 200; ++i) {
        s.tissue.young = exp(om_rng_range(&rng, 0, 20));
        s.endoscope.elevation = om_rng_range(&rng, 1, 90) * (OM_PI / 180.0);
        s.attach.kind = OM_ATTACH_BOX;
        s.attach.lo = om_vec3(1e-3 * om_rng_range(&rng, -1e3, 1e3),
                              1e-3 * om_rng_range(&rng, -1e-9, 1e-9), 0);
        s.task.time_step = 1e-3 * om_rng_range(&rng, 1, 100);
        expect_round_trip(&s);
    }
}

// A scene that a program filled has values without effect, which the reader refuses: a print leaves them out, and keeps
// the values that the kinds use.
static void test_values_without_effect_are_not_printed(void** state) {
    (void)state;
    for (int k = 0; k < 2 * 4 * 3; ++k) {
        OmScene s = om_scene_default(), again;
        OmText text = {0};
        s.attach.kind = k % 2 ? OM_ATTACH_BOX : OM_ATTACH_RANDOM;
        s.believed.kind = (OmBeliefKind)(k / 2 % 4);
        s.tissue.source = (OmTissueSource)(k / 8);
        s.roi.is_random = k % 3 == 0;
        s.attach.lo.x = s.believed.lo.y = -0.01, s.attach.hi.x = s.believed.hi.y = 0.01;
        s.believed.shift.x = 0.02, s.believed.grow = 0.003, s.believed.ratio = 0.5;
        s.believed.seed = 9, s.believed.share = 0.2;
        s.roi.center.x = 0.04;
        snprintf(s.tissue.file, sizeof s.tissue.file, "a.vtu");
        assert_ok(om_scene_print(&s, false, &text));
        assert_ok(om_scene_parse(text.str, text.len, "printed.yaml", &again));
        const OmSceneBelief* b = &again.believed;
        assert_int_equal(b->kind, s.believed.kind);
        assert_true((b->lo.y == -0.01) == (b->kind == OM_BELIEF_BOX) && b->hi.y == -b->lo.y);
        assert_true((b->shift.x == 0.02) == (b->kind == OM_BELIEF_SAME));
        assert_true((b->grow == 0.003) == (b->kind == OM_BELIEF_SAME));
        assert_true((b->ratio == 0.5) == (b->kind == OM_BELIEF_SAME));
        assert_true((b->seed == 9) == (b->kind == OM_BELIEF_PATCH));
        assert_true((b->share == 0.2) == (b->kind == OM_BELIEF_PATCH));
        assert_true((again.roi.center.x == 0.04) == !again.roi.is_random);
        assert_true((again.attach.lo.x == -0.01) == (again.attach.kind == OM_ATTACH_BOX));
        om_text_done(&text);
    }
}

// The example is the built-in scene, and names every key of every table.
static void test_example_and_keys(void** state) {
    (void)state;
    OmScene s, plain = om_scene_default();
    OmText text = {0}, page = {0};
    assert_ok(om_scene_print_example(&text));
    assert_ok(om_scene_parse(text.str, text.len, "example.yaml", &s));
    snprintf(plain.name, sizeof plain.name, "example");
    assert_true(om_yaml_is_equal(&whole, &s, &plain));
    assert_ok(om_scene_print_keys(&page));
    int nkey = 0;
    for (int i = 0; i < om__scene_schema.nfield; ++i) {
        const OmYamlField* f = &om__scene_schema.field[i];
        int n = f->kind == OM_YAML_STRUCT ? f->sub->nfield : 0;
        for (int k = -1; k < n; ++k, ++nkey) {
            const OmYamlField* g = k < 0 ? f : &f->sub->field[k];
            char line[128];
            snprintf(line, sizeof line, "\n%s%s%s:", "", k < 0 ? "" : "  ", g->key);
            bool is_there = strstr(text.str, line) != NULL;
            snprintf(line, sizeof line, "\n# %s%s:", k < 0 ? "" : "  ", g->key);
            if (!is_there && !strstr(text.str, line)) fail_msg("the example has no %s", g->key);
            snprintf(line, sizeof line, g->kind == OM_YAML_STRUCT ? "## `%s:`" : "| `%s` |",
                     g->key);
            if (!strstr(page.str, line)) fail_msg("the page has no %s", g->key);
            assert_non_null(g->help);
            bool is_bounded = g->kind != OM_YAML_DOUBLE || g->min != 0 || g->max != 0;
            if (!is_bounded) fail_msg("%s has no range", g->key);
        }
    }
    assert_true(nkey > 70);
    om_text_done(&text);
    om_text_done(&page);
}

static void test_kidney(void** state) {
    (void)state;
    (void)test_data("ct_abdomen");
    OmScene scene;
    assert_ok(om_scene_load("scenes/kidney.yaml", &scene));
    snprintf(scene.data_root, sizeof scene.data_root, "%s", test_data_dir());
    OmSite site;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    assert_true(site.has_organ && !site.has_ground && site.nroi > 100 && site.roi.ntri > 10);
    // The tissue is outside the organ; the ROI is under the tissue.
    for (int i = 0; i < site.mesh.nvert; ++i)
        assert_true(om_sdf_eval(&site.organ_sdf, om_load3(site.mesh.x, i), NULL) > -1e-3);
    OmPose task = om_pose_inverse(site.pose_world_task);
    OmVec3 roi = om_pose_apply(task, site.roi_center);
    assert_true(fabs(roi.x) < site.half_size.x && fabs(roi.y) < site.half_size.y);
    om_site_done(&site);
}

// ---- failing allocations -----------------------------------------------------------------------------------

static OmStatus build_world_site(void* scene) {
    OmSite site;
    OmStatus status = om_site_build(scene, OM_SITE_WORLD, NULL, &site);
    om_site_done(&site);
    return status;
}

static void test_failing_allocations_leak_nothing(void** state) {
    (void)state;
    OmScene scene = linear_sheet();
    scene.tissue.cells = om_vec3(12, 12, 1);
    scene.tissue.world_cells = om_vec3(18, 18, 2);
    assert_true(test_failing_allocations(build_world_site, &scene, 1) > 30);
}

static OmStatus build_tissue(void* scene) {
    OmSite site;
    OmStatus status = om_site_build_tissue(scene, NULL, &site, NULL);
    om_site_done(&site);
    return status;
}

static void test_failing_allocations_of_a_mesh_alone(void** state) {
    (void)state;
    OmTetMesh box;
    const char* path = temp_path("alone.msh");
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.02, 0.02, 0.01), 2, 2, 1, &box));
    OmScene scene = scene_of_mesh(&box, path);
    assert_true(test_failing_allocations(build_tissue, &scene, 1) > 10);
    remove(path);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_sheet_is_the_default),
        cmocka_unit_test(test_all_scenes_load),
        cmocka_unit_test(test_wrong_scenes_are_explained),
        cmocka_unit_test(test_seventeen_layouts),
        cmocka_unit_test(test_numbers_of_a_site),
        cmocka_unit_test(test_world_is_another_body),
        cmocka_unit_test(test_a_mesh_lies_on_its_board),
        cmocka_unit_test(test_a_mesh_alone_is_held),
        cmocka_unit_test(test_foundation_needs_area),
        cmocka_unit_test(test_impossible_sites_are_explained),
        cmocka_unit_test(test_printed_scenes_read_again),
        cmocka_unit_test(test_values_without_effect_are_not_printed),
        cmocka_unit_test(test_example_and_keys),
        cmocka_unit_test(test_world_mesh_follows_the_twin),
        cmocka_slow_test(test_world_edge_is_derived),
        cmocka_slow_test(test_kidney),
        cmocka_unit_test(test_failing_allocations_leak_nothing),
        cmocka_unit_test(test_failing_allocations_of_a_mesh_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
