// test_world_belief.c: what the twin believes apart from the truth: the place of the ROI, the registration, the
// numbers of the tissue; and that nothing of the true ones reaches it.
#include "linear_sheet.h"
#include "scene/scene_site.h"
#include "test_field.h"
#include "world/world_body.h"

#define DEG (OM_PI / 180.0)

static uint64_t hash_doubles(const double* x, size_t n, uint64_t h) {
    return x ? om_hash(x, n * sizeof *x, h) : h;
}

// Everything of a site but padding and pointers.
static uint64_t hash_site(const OmSite* s) {
    const OmTetMesh* m = &s->mesh;
    const OmMeshSet* held = om_tet_mesh_find_set(m, "attachment");
    const size_t nheld = held ? (size_t)held->nvert : 0;
    uint64_t h = hash_doubles(m->x, 3 * (size_t)m->nvert, OM_HASH_SEED);
    h = om_hash(m->tet_vert, 4 * (size_t)m->ntet * sizeof *m->tet_vert, h);
    h = om_hash(m->tet_label, (size_t)m->ntet * sizeof *m->tet_label, h);
    for (int i = 0; i < m->nset; ++i) {
        h = om_hash(m->set[i].name, strlen(m->set[i].name), h);
        h = om_hash(m->set[i].vert, (size_t)m->set[i].nvert * sizeof(int), h);
    }
    h = hash_doubles(s->attach_area, nheld, h);
    h = hash_doubles(s->attach_spring, nheld, h);
    h = hash_doubles(s->roi_x, 3 * (size_t)s->nroi, h);
    h = hash_doubles(s->roi_n, 3 * (size_t)s->nroi, h);
    h = hash_doubles(s->roi.x, 3 * (size_t)s->roi.nvert, h);
    h = om_hash(&s->pose_world_task, sizeof s->pose_world_task, h);
    h = om_hash(&s->half_size, sizeof s->half_size, h);
    h = om_hash(&s->roi_center, sizeof s->roi_center, h);
    h = om_hash(&s->gravity, sizeof s->gravity, h);
    const double number[] = {s->attach_stiffness, s->attach_foundation, s->young, s->density,
                             s->poisson};
    return hash_doubles(number, sizeof number / sizeof *number, h);
}

static uint64_t hash_of(const OmScene* scene, OmSiteRole role) {
    OmSite site;
    assert_ok(om_site_build(scene, role, NULL, &site));
    uint64_t h = hash_site(&site);
    om_site_done(&site);
    return h;
}

// The twin's body after it settled: also law and friction.
static uint64_t hash_settled(const OmScene* scene) {
    OmSite site;
    OmBody* body;
    assert_ok(om_site_build(scene, OM_SITE_TWIN, NULL, &site));
    assert_ok(om_body_create(scene, &site, 1, &body));
    assert_true(om_body_settle(body, 0.02, 1e-3, 0.2) >= 0);
    uint64_t h = om_body_hash(body);
    om_body_destroy(body);
    om_site_done(&site);
    return h;
}

static OmScene other_truth(OmScene s) {
    s.world = (OmSceneWorld){.young_factor = 0.4,
                             .density_factor = 1.7,
                             .law = OM_NEO_HOOKEAN,
                             .poisson = 0.3,
                             .friction = 0.9,
                             .tool_noise = 0.001,
                             .narm = 1,
                             .force_noise = 0.1,
                             .grip_friction = 0.2,
                             .grip_force = 3,
                             .tear_strength = 500};
    s.tissue.world_cells = om_vec3(19, 20, 3);
    return s;
}

static OmScene wrong_belief(OmScene s) {
    s.believed.ratio = 0.5;
    s.believed_roi.shift = om_vec3(0.004, -0.003, 1);
    s.registration.shift = om_vec3(0.002, -0.001, 0.0015);
    s.registration.turn = om_vec3(1 * DEG, -2 * DEG, 3 * DEG);
    return s;
}

// The twin is built from the belief alone, the truth without the belief.
static void test_neither_reaches_the_other(void** state) {
    (void)state;
    OmScene honest = half_held(), truth = other_truth(honest), wrong = wrong_belief(honest);
    assert_true(hash_of(&honest, OM_SITE_TWIN) == hash_of(&truth, OM_SITE_TWIN));
    assert_true(hash_settled(&honest) == hash_settled(&truth));
    assert_true(hash_of(&honest, OM_SITE_WORLD) == hash_of(&wrong, OM_SITE_WORLD));
    assert_true(hash_of(&honest, OM_SITE_WORLD) != hash_of(&truth, OM_SITE_WORLD));
    assert_true(hash_of(&honest, OM_SITE_TWIN) != hash_of(&wrong, OM_SITE_TWIN));
    OmScene both = wrong_belief(truth);
    assert_true(hash_of(&both, OM_SITE_TWIN) == hash_of(&wrong, OM_SITE_TWIN));
    assert_true(hash_of(&both, OM_SITE_WORLD) == hash_of(&truth, OM_SITE_WORLD));
    // Beside mesh and stiffness each of these numbers differs, and each of them alone.
    OmSite twin, world;
    assert_ok(om_site_build(&both, OM_SITE_TWIN, NULL, &twin));
    assert_ok(om_site_build(&both, OM_SITE_WORLD, NULL, &world));
    assert_near_rel(world.young / twin.young, 0.4, 1e-12);
    assert_near_rel(world.density / twin.density, 1.7, 1e-12);
    assert_near(world.poisson, 0.3, 0);
    assert_near(twin.poisson, honest.tissue.poisson, 0);
    assert_true(world.mesh.nvert >= 2 * twin.mesh.nvert);
    assert_true(om_distance(world.roi_center, twin.roi_center) > 0.003);
    assert_true(om_site_attached_area(&twin) < 0.6 * om_site_attached_area(&world));
    om_site_done(&twin);
    om_site_done(&world);
}

// Every point of the twin is turned and shifted by the error, about the task frame's origin; computed here.
static void test_registration(void** state) {
    (void)state;
    OmScene honest = half_held(), wrong = honest;
    const double a = 4 * DEG;
    wrong.registration.shift = om_vec3(0.002, -0.001, 0.0015);
    wrong.registration.turn = om_vec3(0, 0, a);
    OmSite was, is;
    assert_ok(om_site_build(&honest, OM_SITE_TWIN, NULL, &was));
    assert_ok(om_site_build(&wrong, OM_SITE_TWIN, NULL, &is));
    for (int v = 0; v < was.mesh.nvert; ++v) {  // the sheet's task frame is the world's
        OmVec3 p = om_load3(was.mesh.x, v);
        OmVec3 q = om_vec3(cos(a) * p.x - sin(a) * p.y + 0.002, sin(a) * p.x + cos(a) * p.y - 0.001,
                           p.z + 0.0015);
        assert_near(om_distance(om_load3(is.mesh.x, v), q), 0, 1e-12);
    }
    // Seen from its own task frame nothing has changed; cameras and arms keep their frame.
    OmPose task = om_pose_inverse(is.pose_world_task);
    for (int i = 0; i < is.nroi; ++i)
        assert_near(om_distance(om_pose_apply(task, om_load3(is.roi_x, i)), om_load3(was.roi_x, i)),
                    0, 1e-12);
    assert_near(om_distance(om_pose_apply(task, is.roi_center), was.roi_center), 0, 1e-12);
    assert_memory_equal(&is.pose_world_field, &was.pose_world_task, sizeof was.pose_world_task);
    om_site_done(&was);
    om_site_done(&is);
    // A tilted twin comes to rest like the honest one: board and gravity are tilted with it.
    wrong.registration.turn = om_vec3(3 * DEG, -2 * DEG, 0);
    const OmScene* scene[] = {&honest, &wrong};
    OmVec3 mean[2];
    for (int k = 0; k < 2; ++k) {
        OmBody* body;
        assert_ok(om_site_build(scene[k], OM_SITE_TWIN, NULL, &is));
        assert_ok(om_body_create(scene[k], &is, 1, &body));
        assert_ok(om_body_settle(body, 0.02, 1e-3, 3));
        task = om_pose_inverse(is.pose_world_task);
        mean[k] = om_vec3(0, 0, 0);
        for (int v = 0; v < is.mesh.nvert; ++v)
            mean[k] = om_madd(mean[k], 1.0 / is.mesh.nvert,
                              om_pose_apply(task, om_load3(om_body_x(body), v)));
        om_body_destroy(body);
        om_site_done(&is);
    }
    assert_near(om_distance(mean[0], mean[1]), 0, 1e-5);
}

// The pictures of the world do not depend on the belief. The twin's own view has the same camera: it counts the points
// of the ROI outside of the picture, which cuts the ROI, as the world's camera does.
static void test_cameras_stand_still(void** state) {
    (void)state;
    OmScene scene[2] = {half_held(), half_held()};
    uint64_t hash[2];
    int noutside[2];
    for (int k = 0; k < 2; ++k) {
        scene[k].roi.center = om_vec3(0, -0.02, 0);
        scene[k].endoscope.focal[0] = scene[k].endoscope.focal[1] = 700;
        if (k) scene[k] = wrong_belief(scene[k]);
        Field f;
        setup(&f, scene[k]);
        OmObservation obs =
            observe(&f, OM_OBSERVE_IMAGE | OM_OBSERVE_DEPTH | OM_OBSERVE_VISIBILITY);
        OmCamera camera = obs.endoscope.camera;
        hash[k] = om_hash(&camera, sizeof camera, hash_pictures(&obs, OM_HASH_SEED));
        om_observation_done(&obs);
        teardown(&f);
        OmSite twin;
        OmView* view;
        OmVisibility seen;
        assert_ok(om_site_build(&scene[k], OM_SITE_TWIN, NULL, &twin));
        noutside[k] = 0;
        for (int i = 0; i < twin.nroi; ++i) {
            double u, v;
            assert_true(om_camera_project(&camera, om_load3(twin.roi_x, i), &u, &v));
            noutside[k] += u < 0 || v < 0 || u >= camera.width || v >= camera.height;
        }
        assert_ok(om_view_create(&scene[k], &twin, &view));
        assert_ok(om_view_look(view, NULL, &seen));
        assert_int_equal(seen.noutside, noutside[k]);
        om_view_destroy(view);
        om_site_done(&twin);
    }
    assert_true(hash[0] == hash[1]);
    assert_true(noutside[0] > 10 && noutside[0] < 190 && noutside[0] != noutside[1]);
}

static void test_believed_roi(void** state) {
    (void)state;
    OmScene honest = half_held(), wrong = honest;
    wrong.believed_roi.shift = om_vec3(0.006, -0.004, 7);
    OmSite was, is;
    assert_ok(om_site_build(&honest, OM_SITE_TWIN, NULL, &was));
    assert_ok(om_site_build(&wrong, OM_SITE_TWIN, NULL, &is));
    for (int i = 0; i < is.nroi; ++i) {
        OmVec3 d = om_sub(om_load3(is.roi_x, i), om_load3(was.roi_x, i));
        assert_near(om_distance(d, om_vec3(0.006, -0.004, 0)), 0, 1e-12);
    }
    assert_near(om_distance(om_sub(is.roi_center, was.roi_center), om_vec3(0.006, -0.004, 0)), 0,
                1e-12);
    assert_memory_equal(is.mesh.x, was.mesh.x, 3 * (size_t)is.mesh.nvert * sizeof(double));
    om_site_done(&is);
    wrong.believed_roi.shift = om_vec3(0.2, 0, 0);
    assert_status(om_site_build(&wrong, OM_SITE_TWIN, NULL, &is), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "believed_roi"));
    om_site_done(&was);
}

static double ball(void* ctx, OmVec3 p) { return om_norm(p) - *(double*)ctx; }

// On a ball the region stays on the ball, with the ball's normals.
static void test_believed_roi_on_an_organ(void** state) {
    (void)state;
    double radius = 0.05;
    OmScene scene = linear_sheet();
    OmSite site = {
        .pose_world_task = om_pose_identity(), .half_size = {0.05, 0.05, 0.003}, .has_organ = true};
    OmSdfDef def = om_sdf_default_def(0.001);
    assert_ok(om_sdf_from_function(ball, &radius, om_vec3(-0.06, -0.06, -0.06),
                                   om_vec3(0.06, 0.06, 0.06), &def, &site.organ_sdf));
    enum { N = 30 };
    double x[3 * N], n[3 * N];
    for (int i = 0; i < N; ++i) {
        double tilt = 0.006 * i, turn = 2.4 * i;
        OmVec3 u = om_vec3(sin(tilt) * cos(turn), sin(tilt) * sin(turn), cos(tilt));
        om_store3(n, i, u);
        om_store3(x, i, om_scale(radius, u));
    }
    site.nroi = N, site.roi_x = x, site.roi_n = n;
    site.roi_center = om_vec3(0, 0, radius);
    scene.believed_roi.shift = om_vec3(0.012, 0.009, 0);
    assert_ok(om__site_shift_roi(&scene, &site));
    OmVec3 middle = om_vec3(0, 0, 0);
    for (int i = 0; i < N; ++i) {
        OmVec3 p = om_load3(x, i);
        assert_near(om_norm(p), radius, 1e-4);
        assert_near(om_distance(om_load3(n, i), om_normalize(p)), 0, 0.02);
        middle = om_madd(middle, 1.0 / N, p);
    }
    assert_near(middle.x, 0.012, 0.001);
    assert_near(middle.y, 0.009, 0.001);
    assert_near(om_norm(site.roi_center), radius, 1e-4);
    om_sdf_done(&site.organ_sdf);
}

static void test_keys(void** state) {
    (void)state;
    static const char yaml[] =
        "name: x\ntissue: {source: sheet}\nattachments: {kind: random_patch}\n"
        "believed_roi: {shift_mm: [4, -5, 0]}\n"
        "registration: {shift_mm: [1, 2, -3], turn_deg: [1.5, 0, -2]}\n"
        "world: {grip_friction: 0.25, grip_force: 6, tear_strength: 1200}\n";
    OmScene s, again;
    OmText text = {0};
    assert_ok(om_scene_parse(yaml, strlen(yaml), "s.yaml", &s));
    assert_near(om_distance(s.believed_roi.shift, om_vec3(0.004, -0.005, 0)), 0, 1e-15);
    assert_near(om_distance(s.registration.shift, om_vec3(0.001, 0.002, -0.003)), 0, 1e-15);
    assert_near(om_distance(s.registration.turn, om_vec3(1.5 * DEG, 0, -2 * DEG)), 0, 1e-15);
    assert_near(s.world.grip_friction, 0.25, 0);
    assert_near(s.world.grip_force, 6, 0);
    assert_near(s.world.tear_strength, 1200, 0);
    assert_ok(om_scene_print(&s, true, &text));
    assert_ok(om_scene_parse(text.str, text.len, "again.yaml", &again));
    assert_memory_equal(&again.believed_roi, &s.believed_roi, sizeof s.believed_roi);
    assert_memory_equal(&again.registration, &s.registration, sizeof s.registration);
    assert_near(again.world.tear_strength, 1200, 0);
    om_text_done(&text);
    OmScene plain = om_scene_default();
    assert_true(plain.world.grip_friction < 0 && plain.world.tear_strength == 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_neither_reaches_the_other), cmocka_unit_test(test_registration),
        cmocka_unit_test(test_cameras_stand_still),       cmocka_unit_test(test_believed_roi),
        cmocka_unit_test(test_believed_roi_on_an_organ),  cmocka_unit_test(test_keys)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
