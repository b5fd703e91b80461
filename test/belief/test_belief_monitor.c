// test_belief_monitor.c: distance, rest, warning state and timing of the monitor.
#include "test_alloc.h"

#include "hidden_world.h"
#include "loop_rig.h"

#include "omentum/belief_monitor.h"
#include "omentum/retract.h"
#include "omentum/shape_closest.h"

#define RADIUS 0.011  // m, of the grasp

// A simulated world and a twin, one arm that lifts both.
typedef struct Pair {
    OmScene scene;
    OmSite twin_site, world_site;
    const OmSite* site;  // of the twin
    OmWorld* world;
    OmBody* twin;
    OmMonitor* monitor;
    OmObservation obs;
    bool has_grasped;
    double time;  // s
} Pair;

// `is_equal`: the twin has the world's own mesh and numbers.
static void pair_create_with(Pair* p, OmScene scene, bool is_equal, int nworker) {
    *p = (Pair){.scene = scene};
    assert_ok(om_site_build(&p->scene, OM_SITE_WORLD, NULL, &p->world_site));
    assert_ok(om_site_build(&p->scene, OM_SITE_TWIN, NULL, &p->twin_site));
    p->site = is_equal ? &p->world_site : &p->twin_site;
    assert_ok(om_body_create(&p->scene, p->site, nworker, &p->twin));
    assert_ok(om_world_create_simulated(&p->scene, &p->world_site, nworker, &p->world));
    assert_true(om_body_settle(p->twin, scene.task.time_step, OM_WORLD_SETTLE_SPEED,
                               OM_WORLD_SETTLE_TIME) >= 0);
    assert_true(om_world_reset(p->world) >= 0);
    OmMonitorDef def = om_monitor_default_def(&p->scene, p->world, p->site);
    assert_ok(om_monitor_create(&def, &p->monitor));
}

static void pair_create(Pair* p, OmScene scene, bool is_equal) {
    pair_create_with(p, scene, is_equal, 1);
}

static void pair_destroy(Pair* p) {
    om_observation_done(&p->obs);
    om_monitor_destroy(p->monitor);
    om_world_destroy(p->world);
    om_body_destroy(p->twin);
    om_site_done(&p->twin_site);
    om_site_done(&p->world_site);
}

static void pair_look(Pair* p, OmMonitorFrame* frame) {
    assert_ok(om_world_observe(p->world, om_monitor_sources(p->monitor, p->world), &p->obs));
    assert_ok(om_monitor_frame(p->monitor, &p->obs, om_body_x(p->twin), p->has_grasped, frame));
}

static void pair_step(Pair* p) {
    assert_ok(om_world_advance(p->world, p->scene.task.time_step));
    assert_ok(om_world_observe(p->world, 0, &p->obs));
    if (om_body_is_holding(p->twin, 0)) {
        OmPose tip = {p->obs.arm[0].tip.p, p->site->pose_world_task.q};
        assert_ok(om_body_move(p->twin, 0, tip));
    }
    OmBodyReport report;
    assert_true(om_body_step(p->twin, p->scene.task.time_step, &report) >= 0);
}

// PSM1 moves to a point of the task frame.
static void pair_move(Pair* p, OmVec3 at) {
    assert_ok(om_world_observe(p->world, 0, &p->obs));
    OmPose goal = {om_pose_apply(p->site->pose_world_task, at), p->obs.arm[0].tip.q};
    assert_ok(om_world_move(p->world, 0, goal, 0.05));
    do pair_step(p);
    while (p->obs.arm[0].is_moving);
}

static void pair_grasp(Pair* p, OmVec3 at) {
    pair_move(p, at);
    assert_ok(om_world_set_jaw(p->world, 0, 0));
    for (int i = 0; i < 20; ++i) pair_step(p);
    int nheld;
    OmPose tip = {p->obs.arm[0].tip.p, p->site->pose_world_task.q};
    assert_ok(om_body_grasp(p->twin, 0, tip, RADIUS, &nheld));
    p->has_grasped = true;
}

static const OmVec3 corner = {-0.045, -0.03, 0.005};

static void test_lift(OmScene scene, bool is_equal, double bound, const char* name) {
    Pair p;
    OmMonitorFrame f;
    pair_create(&p, scene, is_equal);
    for (int i = 0; i < 5; ++i) {
        pair_step(&p);
        pair_look(&p, &f);
    }
    pair_grasp(&p, corner);
    double most = 0;
    for (int lift = 1; lift <= 4; ++lift) {
        pair_move(&p, om_madd(corner, 0.01 * lift, om_vec3(0, 0, 1)));
        pair_look(&p, &f);
        assert_int_equal(f.state, 0);
        assert_true(f.npoint >= 500 && !f.is_stale && !f.is_blind);
        most = fmax(most, fabs(f.mu));
    }
    printf("%s: rest %.3f mm, largest mu %.3f mm, %d points\n", name, 1e3 * f.rest, 1e3 * most,
           f.npoint);
    assert_below(most, bound);
    pair_destroy(&p);
}

static OmScene exact_scene(void) {
    OmScene s = easy_scene();
    s.world.young_factor = 1;
    s.world.tool_noise = 0;
    s.world.has_depth_noise = false;
    return s;
}

static void a_lift_of_an_equal_twin_has_no_discrepancy(void** state) {
    (void)state;
    test_lift(exact_scene(), true, 0.05e-3, "equal, no noise");
}

static void a_lift_of_another_mesh_with_noise_has_little(void** state) {
    (void)state;
    test_lift(easy_scene(), false, 1e-3, "other mesh, stiffness and noise");
}

// The twin 1.5 mm and 1 degree beside the tissue: the rest has the error, also after the lift.
static void an_error_of_registration_is_in_the_rest(void** state) {
    (void)state;
    OmScene s = easy_scene();
    s.registration.shift = om_vec3(0.001, -0.0005, 0.001);
    s.registration.turn = om_vec3(0.01, 0.01, 0.01);
    test_lift(s, false, 1e-3, "registration 1.5 mm and 1 degree off");
}

// The tool error of the laboratory (6.5.3), 1.7 mm along each axis.
static void an_error_of_the_tools_gives_no_warning(void** state) {
    (void)state;
    OmScene s = easy_scene();
    s.world.tool_noise = 0.0017;
    test_lift(s, false, 2e-3, "tools 1.7 mm off");
}

// ---- pictures made here ------------------------------------------------------------------------------------------

enum { W = 80, H = 60 };

// A sheet without board, a camera above it, and depth pictures of surfaces made by the test. No tools, no colour.
typedef struct Table {
    OmScene scene;
    OmSite site;
    OmMonitorDef def;
    OmMonitor* monitor;
    OmCamera camera;
    float depth[W * H];
    OmObservation obs;
    double* x;  // of the twin (nvert x 3)
} Table;

static void table_create(Table* t) {
    *t = (Table){.scene = easy_scene()};
    t->scene.tissue.has_board = false;
    assert_ok(om_site_build(&t->scene, OM_SITE_TWIN, NULL, &t->site));
    t->def = om_monitor_default_def(&t->scene, NULL, &t->site);
    assert_ok(om_monitor_create(&t->def, &t->monitor));
    OmVec3 eye = {0.05, 0, 0.25}, target = {0, 0, 0};
    t->camera = (OmCamera){om_pose_look_at(eye, target, om_vec3(0, 0, 1)), W, H, 0.6, 0.01, 1};
    t->x = malloc(3 * (size_t)t->site.mesh.nvert * sizeof *t->x);
    memcpy(t->x, t->site.mesh.x, 3 * (size_t)t->site.mesh.nvert * sizeof *t->x);
    t->obs.rgbd.camera = t->camera;
    t->obs.rgbd.depth = t->depth;
}

static void table_destroy(Table* t) {
    om_monitor_destroy(t->monitor);
    om_site_done(&t->site);
    free(t->x);
}

// The picture of the sheet's surface with its vertices at `x`.
static void table_see(Table* t, const double* x) {
    OmSenseScene* scene;
    OmSurface surface;
    int *vert, id;
    OmSenseLook look = {.red = 1};
    assert_ok(om_tet_mesh_boundary(&t->site.mesh, &surface, &vert));
    assert_ok(om_sense_scene_create(&scene));
    assert_ok(om_sense_scene_add(scene, &surface, &look, &id));
    om_sense_scene_update(scene, id, x, vert);
    assert_ok(om_sense_scene_commit(scene));
    assert_ok(om_sense_depth(scene, &t->camera, 1, t->depth, NULL, NULL));
    om_sense_scene_destroy(scene);
    om_surface_done(&surface);
    om_free(vert);
}

// The picture of the sheet at rest, moved by dz.
static void table_see_moved(Table* t, double dz) {
    double* x = malloc(3 * (size_t)t->site.mesh.nvert * sizeof *x);
    for (int i = 0; i < t->site.mesh.nvert; ++i)
        om_store3(x, i, om_add(om_load3(t->site.mesh.x, i), om_vec3(0, 0, dz)));
    table_see(t, x);
    free(x);
}

static OmMonitorFrame table_frame(Table* t, bool has_grasped) {
    OmMonitorFrame f;
    t->obs.time = t->obs.rgbd.time += 1.0 / 30;
    assert_ok(om_monitor_frame(t->monitor, &t->obs, t->x, has_grasped, &f));
    return f;
}

static OmVec3 point_of(const Table* t, int pixel) {
    OmVec3 ray = om_camera_ray(&t->camera, pixel % W + 0.5, pixel / W + 0.5);
    OmVec3 axis = om_quat_rotate(t->camera.pose_world_camera.q, om_vec3(0, 0, 1));
    return om_madd(t->camera.pose_world_camera.p, (double)t->depth[pixel] / om_dot(ray, axis), ray);
}

// A twin of quadratic elements: with its own mesh in the definition the monitor sees midpoints 4 mm above the sheet,
// with the mesh of the site the vertices alone, which are where the picture has them.
static void midpoints_of_the_twin_count(void** state) {
    (void)state;
    Table t;
    OmTetMesh fine;
    OmMonitorFrame f[2];
    table_create(&t);
    assert_ok(om_tet_mesh_copy(&t.site.mesh, &fine));
    assert_ok(om_tet_mesh_refine(&fine));
    free(t.x);
    t.x = malloc(3 * (size_t)fine.nvert * sizeof *t.x);
    memcpy(t.x, fine.x, 3 * (size_t)fine.nvert * sizeof *t.x);
    table_see_moved(&t, 0);
    OmMonitor* plain = t.monitor;
    t.def.mesh = &fine;
    assert_ok(om_monitor_create(&t.def, &t.monitor));
    for (int raised = 0; raised < 2; ++raised) {
        for (int i = t.site.mesh.nvert; raised && i < fine.nvert; ++i) t.x[3 * i + 2] += 0.004;
        f[0] = table_frame(&t, true);
        assert_ok(om_monitor_frame(plain, &t.obs, t.x, true, &f[1]));
        assert_below(f[1].distance, 1e-5);
        if (!raised) assert_below(f[0].distance, 1e-5);
    }
    assert_true(f[0].distance > 0.001 && f[0].distance < 0.004);
    om_monitor_destroy(plain);
    om_tet_mesh_done(&fine);
    table_destroy(&t);
}

// A sheet seen 5 mm too low lies where the twin's underside is: the underside must not count.
static void a_shift_after_the_grasp_is_its_state(void** state) {
    (void)state;
    static const double shift[] = {1.5, -1.5, 3, -3, 5, -5, 7, -7};  // mm
    static const int expected[] = {0, 0, 1, 1, 2, 2, 3, 3};
    for (int k = 0; k < 8; ++k) {
        Table t;
        table_create(&t);
        table_see_moved(&t, 0);
        for (int i = 0; i < 3; ++i) assert_below(table_frame(&t, false).distance, 1e-6);
        table_see_moved(&t, 1e-3 * shift[k]);
        OmMonitorFrame f = table_frame(&t, true);
        assert_near(f.mu, 1e-3 * fabs(shift[k]), 2e-6);  // float depths
        assert_int_equal(f.state, expected[k]);
        assert_int_equal(f.nrest, 3);
        assert_true(f.npoint > 900 && f.npoint <= 1000);
        table_destroy(&t);
    }
}

// Tissue that was let go lies elsewhere than in the twin: of that the third limit is not counted, what is beyond is.
static void a_rest_is_bounded(void** state) {
    (void)state;
    Table t;
    table_create(&t);
    table_see_moved(&t, 0.001);
    table_frame(&t, false);
    table_frame(&t, true);
    const double limit = t.def.settings.limit[2];
    for (int k = 0; k < 2; ++k) {
        const double off = 0.001 + limit + (k ? 0.003 : -0.001);
        table_see_moved(&t, off);
        OmMonitorFrame f = table_frame(&t, false);
        assert_near(f.rest, off, 2e-6);
        assert_int_equal(f.state, 0);
        f = table_frame(&t, true);
        assert_near(f.mu, k ? 0.003 : 0, 4e-6);
        assert_int_equal(f.state, k);
    }
    table_destroy(&t);
}

static void a_shift_before_the_grasp_is_in_the_rest(void** state) {
    (void)state;
    Table t;
    table_create(&t);
    table_see_moved(&t, 0.002);  // the tissue falls: only where it comes to rest counts
    OmMonitorFrame f = table_frame(&t, false);
    assert_near(f.mu, 0, 1e-15);
    table_see_moved(&t, 0.0076);
    table_frame(&t, false);
    table_see_moved(&t, 0.008);
    f = table_frame(&t, false);
    assert_near(f.distance, 0.008, 2e-6);
    assert_near(f.rest, 0.0078, 2e-6);
    assert_int_equal(f.nrest, 2);
    assert_near(f.mu, 0.0002, 4e-6);
    assert_int_equal(f.state, 0);
    table_see_moved(&t, 0.0108);
    f = table_frame(&t, true);
    assert_near(f.mu, 0.003, 4e-6);
    assert_int_equal(f.state, 1);
    f = table_frame(&t, true);  // fixed while tissue is held
    assert_near(f.rest, 0.0078, 2e-6);
    f = table_frame(&t, false);  // measured anew after a release
    assert_int_equal(f.nrest, 1);
    assert_near(f.rest, 0.0108, 2e-6);
    assert_int_equal(f.state, 0);
    f = table_frame(&t, true);
    assert_near(f.mu, 0, 1e-15);
    table_see_moved(&t, 0.0104);  // 0.4 mm alone do not begin another mean, the grasp does
    f = table_frame(&t, false);
    assert_int_equal(f.nrest, 1);
    assert_near(f.rest, 0.0104, 2e-6);
    table_see_moved(&t, 0.009);
    om_monitor_reset(t.monitor);
    f = table_frame(&t, false);
    assert_true(f.nrest == 1 && f.state == 0 && f.mu == 0);
    om_monitor_reset(t.monitor);
    f = table_frame(&t, true);  // no frame before the grasp: all of the distance counts
    assert_near(f.mu, 0.009, 2e-6);
    assert_true(f.nrest == 0 && f.rest == 0 && f.state == 3);
    table_destroy(&t);
}

static int compare(const void* a, const void* b) {
    const double x = *(const double*)a, y = *(const double*)b;
    return (x > y) - (x < y);
}

// A measured bump against a flat twin: closest distances of all pixels to all triangles of the top, one by one. The
// monitor takes 1,000 of the pixels.
static void the_distance_is_that_of_brute_force(void** state) {
    (void)state;
    Table t;
    static double d[W * H];
    table_create(&t);
    double* x = malloc(3 * (size_t)t.site.mesh.nvert * sizeof *x);
    for (int i = 0; i < t.site.mesh.nvert; ++i) {
        OmVec3 p = om_load3(t.site.mesh.x, i);
        p.z += 0.012 * exp(-(p.x * p.x + p.y * p.y) / (0.04 * 0.04));
        om_store3(x, i, p);
    }
    table_see(&t, x);
    OmMonitorFrame f = table_frame(&t, true);
    int* vert;
    OmSurface s;
    int n = 0;
    assert_ok(om_tet_mesh_boundary(&t.site.mesh, &s, &vert));
    for (int i = 0; i < W * H; ++i) {
        if (!(t.depth[i] > 0)) continue;
        OmVec3 p = point_of(&t, i);
        d[n] = INFINITY;
        for (int k = 0; k < s.ntri; ++k) {
            const int* v = &s.tri_vert[3 * k];
            OmVec3 a = om_load3(s.x, v[0]), b = om_load3(s.x, v[1]), c = om_load3(s.x, v[2]);
            OmVec3 normal = om_cross(om_sub(b, a), om_sub(c, a));
            if (om_dot(normal, om_sub(t.camera.pose_world_camera.p, a)) <= 0) continue;
            d[n] = fmin(d[n], om_distance(p, om_triangle_closest(p, a, b, c, NULL)));
        }
        ++n;
    }
    qsort(d, (size_t)n, sizeof *d, compare);
    printf("brute force: %d pixels, median %.4f mm, 48 to 52 %%: %.4f to %.4f; monitor %.4f\n", n,
           1e3 * d[n / 2], 1e3 * d[(int)(0.48 * n)], 1e3 * d[(int)(0.52 * n)], 1e3 * f.distance);
    assert_true(n > 1500 && d[n / 2] > 0.001 && d[n - 1] > 0.01);
    assert_true(f.distance >= d[(int)(0.48 * n)] && f.distance <= d[(int)(0.52 * n)]);
    om_surface_done(&s);
    om_free(vert);
    free(x);
    table_destroy(&t);
}

// A corner of the sheet, lifted by up to `height`.
static void lift_corner(const Table* t, double height, double* x) {
    for (int i = 0; i < t->site.mesh.nvert; ++i) {
        OmVec3 p = om_load3(t->site.mesh.x, i);
        double part = fmax(0, -(p.x + p.y) / 0.12);
        om_store3(x, i, om_add(p, om_vec3(0, 0, height * part)));
    }
}

// The quantile 1 - share of the lift at all pixels; `x` of the twin or of the picture, whichever is lifted.
static double lift_of_pixels(const Table* t, double share, double height, bool is_picture) {
    static double lift[W * H];
    int n = 0;
    const double top = t->scene.tissue.size.z;
    for (int i = 0; i < W * H; ++i) {
        if (!(t->depth[i] > 0)) continue;
        OmVec3 p = point_of(t, i);
        lift[n++] = is_picture ? p.z - top : height * fmax(0, -(p.x + p.y) / 0.12);
    }
    qsort(lift, (size_t)n, sizeof *lift, compare);
    return lift[(int)((1 - share) * n)];
}

// A corner lifted by the picture or by the twin alone is a part of this lift; lifted by both it is none.
static void a_part_is_lifted_where_the_other_lies_still(void** state) {
    (void)state;
    Table t;
    table_create(&t);
    double* x = malloc(3 * (size_t)t.site.mesh.nvert * sizeof *x);
    table_see_moved(&t, 0);
    OmMonitorFrame f = table_frame(&t, false);
    assert_below(f.part, 1e-6);
    lift_corner(&t, 0.02, t.x);
    f = table_frame(&t, true);
    double lo = lift_of_pixels(&t, 0.03, 0.02, false), hi = lift_of_pixels(&t, 0.01, 0.02, false);
    printf("twin lifted: part %.2f mm, 1 to 3 %% of the pixels %.2f to %.2f\n", 1e3 * f.part,
           1e3 * lo, 1e3 * hi);
    assert_true(lo > 0.006 && f.part > lo && f.part < hi);
    assert_below(fabs(f.mu), 1e-3);
    lift_corner(&t, 0.02, x);
    table_see(&t, x);
    f = table_frame(&t, true);
    assert_below(f.part, 1e-6);
    memcpy(t.x, t.site.mesh.x, 3 * (size_t)t.site.mesh.nvert * sizeof *t.x);
    f = table_frame(&t, true);
    lo = lift_of_pixels(&t, 0.03, 0.02, true), hi = lift_of_pixels(&t, 0.01, 0.02, true);
    printf("picture lifted: part %.2f mm, 1 to 3 %% of the pixels %.2f to %.2f\n", 1e3 * f.part,
           1e3 * lo, 1e3 * hi);
    assert_true(lo > 0.006 && f.part > lo && f.part < hi);
    free(x);
    table_destroy(&t);
}

// Tissue and twin rest 10 mm above the twin's mesh; then the twin alone rises by 5 mm. The picture lies still, so that
// the part is the twin's whole lift.
static void a_part_is_over_the_place_before_the_grasp(void** state) {
    (void)state;
    Table t;
    table_create(&t);
    for (int i = 0; i < t.site.mesh.nvert; ++i) t.x[3 * i + 2] += 0.01;
    table_see_moved(&t, 0.01);
    OmMonitorFrame f = table_frame(&t, false);
    assert_below(f.part, 1e-6);
    for (int i = 0; i < t.site.mesh.nvert; ++i) t.x[3 * i + 2] += 0.005;
    f = table_frame(&t, true);
    assert_near(f.part, 0.005, 2e-6);  // float depths
    table_destroy(&t);
}

// The twin's far half lies folded 10 mm above its near half; the near half is measured. It is hidden in the twin.
static void hidden_tissue_of_the_twin_does_not_count(void** state) {
    (void)state;
    Table t;
    table_create(&t);
    table_see_moved(&t, 0);
    for (int i = 0; i < W * H; ++i)
        if (t.depth[i] > 0 && fabs(point_of(&t, i).x + 0.03) > 0.01) t.depth[i] = 0;
    OmMonitorFrame f = table_frame(&t, false);
    assert_below(f.distance, 1e-6);
    for (int i = 0; i < t.site.mesh.nvert; ++i)
        if (t.x[3 * i] > 0) t.x[3 * i] *= -1, t.x[3 * i + 2] = 0.0175 - t.x[3 * i + 2];
    f = table_frame(&t, true);
    assert_true(f.npoint > 200 && f.distance > 0.006);
    assert_int_equal(f.state, 3);
    table_destroy(&t);
}

// An organ between camera and the strip of tissue that is measured: the simulated camera sees the organ.
static void tissue_behind_the_organ_does_not_count(void** state) {
    (void)state;
    Table t;
    OmTetMesh box;
    table_create(&t);
    table_see_moved(&t, 0);
    for (int i = 0; i < W * H; ++i)
        if (t.depth[i] > 0 && fabs(point_of(&t, i).x + 0.03) > 0.005) t.depth[i] = 0;
    OmMonitorFrame f = table_frame(&t, true);
    assert_below(f.distance, 1e-6);
    assert_ok(
        om_tet_mesh_box(om_vec3(-0.05, -0.1, 0.03), om_vec3(0.005, 0.1, 0.035), 1, 1, 1, &box));
    assert_ok(om_tet_mesh_boundary(&box, &t.site.organ, NULL));
    OmSdfDef sdf = om_sdf_default_def(0.002);
    assert_ok(om_sdf_from_surface(&t.site.organ, &sdf, &t.site.organ_sdf));
    t.site.has_organ = true;
    om_monitor_destroy(t.monitor);
    assert_ok(om_monitor_create(&t.def, &t.monitor));
    f = table_frame(&t, true);
    assert_true(f.npoint > 50 && f.distance > 0.005);
    om_tet_mesh_done(&box);
    table_destroy(&t);
}

static void nothing_seen_changes_nothing(void** state) {
    (void)state;
    Table t;
    table_create(&t);
    table_see_moved(&t, 0);
    table_frame(&t, false);
    table_see_moved(&t, 0.003);
    OmMonitorFrame good = table_frame(&t, true), f;
    assert_int_equal(good.state, 1);
    // no points: no returns, and returns that are not numbers
    for (int k = 0; k < 2; ++k) {
        for (int i = 0; i < W * H; ++i) t.depth[i] = k ? (i % 2 ? NAN : INFINITY) : 0;
        f = table_frame(&t, true);
        assert_true(f.is_blind && !f.is_stale && f.npoint == 0 && f.nblind == k + 1);
        assert_true(f.state == 1 && f.mu == good.mu && f.distance == good.distance);
    }
    // the twin beside the picture
    table_see_moved(&t, 0.007);
    double* at_home = t.x;
    t.x = malloc(3 * (size_t)t.site.mesh.nvert * sizeof *t.x);
    for (int i = 0; i < 3 * t.site.mesh.nvert; ++i) t.x[i] = at_home[i] + (i % 3 == 1);
    f = table_frame(&t, true);
    assert_true(f.is_blind && f.nblind == 3 && f.npoint > 500 && f.state == 1);
    free(t.x);
    t.x = at_home;
    // an old picture
    t.obs.time += 0.25;
    assert_ok(om_monitor_frame(t.monitor, &t.obs, t.x, true, &f));
    assert_true(f.is_stale && !f.is_blind && f.nstale == 1 && f.state == 1 && f.mu == good.mu);
    assert_near(f.age, 0.25, 1e-9);
    t.obs.rgbd.time = t.obs.time - 0.15;
    assert_ok(om_monitor_frame(t.monitor, &t.obs, t.x, true, &f));
    assert_true(!f.is_stale && f.state == 3 && f.nstale == 1 && f.nblind == 3);
    // a tool whose pose is not a number
    t.obs.rgbd.time = t.obs.time;
    for (int k = 0; k < 2; ++k) {
        t.obs.narm = 1;
        t.obs.arm[0] = (OmArmObservation){.jaw = k ? 0 : NAN};
        if (k) t.obs.arm[0].q[4] = INFINITY;
        f = table_frame(&t, true);
        assert_true(f.is_blind && f.state == 3 && f.nblind == 4 + k);
        assert_near(f.unseen, (k + 1) / 30.0, 1e-9);
    }
    t.obs.narm = 0;
    assert_true(!table_frame(&t, true).is_blind);
    // before the grasp an old picture is not in the rest
    om_monitor_reset(t.monitor);
    t.obs.rgbd.time = t.obs.time - 0.3;
    assert_ok(om_monitor_frame(t.monitor, &t.obs, t.x, false, &f));
    assert_true(f.is_stale && f.nrest == 0 && f.rest == 0 && f.mu == 0 && f.nstale == 1);
    table_destroy(&t);
}

static void wrong_input_is_refused(void** state) {
    (void)state;
    Table t;
    OmMonitorFrame f;
    table_create(&t);
    table_see_moved(&t, 0);
    OmMonitorFrame first = table_frame(&t, false);
    t.x[7] = NAN;
    assert_status(om_monitor_frame(t.monitor, &t.obs, t.x, false, &f), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "vertex 2 of the twin"));
    t.x[7] = t.site.mesh.x[7];
    t.obs.rgbd.depth = NULL;
    assert_status(om_monitor_frame(t.monitor, &t.obs, t.x, false, &f), OM_INVALID);
    t.obs.rgbd.depth = t.depth;
    unsigned char pixel[12] = {0};
    t.obs.rgbd.color = (OmPicture){.width = 2, .height = 2, .nchannel = 3, .pixel = pixel};
    assert_status(om_monitor_frame(t.monitor, &t.obs, t.x, false, &f), OM_INVALID);
    t.obs.rgbd.color = (OmPicture){0};
    t.obs.narm = OM_MAX_ARM + 1;
    assert_status(om_monitor_frame(t.monitor, &t.obs, t.x, false, &f), OM_INVALID);
    t.obs.narm = 0;
    f = table_frame(&t, false);  // nothing was counted
    assert_true(f.nrest == first.nrest + 1);
    OmMonitor* none;
    struct {
        OmMonitorDef def;
        const char* field;
    } wrong[] = {{t.def, "default_def"}, {t.def, "limit"}, {t.def, "hysteresis"}, {t.def, "rate"},
                 {t.def, "npoint"},      {t.def, "nray"},  {t.def, "max_age"},    {t.def, "site"}};
    wrong[0].def.cookie = 0;
    wrong[1].def.settings.limit[2] = 0.004;
    wrong[2].def.settings.hysteresis = 0.002;
    wrong[3].def.settings.rate = NAN;
    wrong[4].def.settings.npoint = 49;
    wrong[5].def.nray = 255;
    wrong[6].def.max_age = 0;
    wrong[7].def.space.site = NULL;
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; ++i) {
        assert_status(om_monitor_create(&wrong[i].def, &none), OM_INVALID);
        assert_null(none);
        if (!strstr(om_error_message(), wrong[i].field)) fail_msg("%s", om_error_message());
    }
    table_destroy(&t);
}

// ---- states and time ---------------------------------------------------------------------------------------------

static void states_are_those_of_the_algorithm(void** state) {
    (void)state;
    const OmSceneMonitor s = om_scene_default().monitor;
    // from state, mu in mm, to state: Alg. 5 from state 0, upwards at once, downwards with 0.5 mm of hysteresis
    static const struct {
        int from;
        double mu;
        int to;
    } row[] = {{0, -1, 0},  {0, 0, 0},     {0, 2, 0},   {0, 2.001, 1}, {0, 4, 1},     {0, 4.001, 2},
               {0, 6, 2},   {0, 6.001, 3}, {0, 99, 3},  {1, 2, 1},     {1, 1.501, 1}, {1, 1.499, 0},
               {1, 4.1, 2}, {2, 3.6, 2},   {2, 3.4, 1}, {2, 1.6, 1},   {2, 1.4, 0},   {3, 5.6, 3},
               {3, 5.4, 2}, {3, 3.4, 1},   {3, 1.4, 0}, {1, 6.1, 3},   {3, 3.6, 2}};
    for (size_t i = 0; i < sizeof row / sizeof *row; ++i) {
        int to = om_monitor_next_state(&s, row[i].from, 1e-3 * row[i].mu);
        if (to != row[i].to)
            fail_msg("from %d at %.3f mm: %d, expected %d", row[i].from, row[i].mu, to, row[i].to);
    }
}

static void states_of_a_part_end_at_two(void** state) {
    (void)state;
    OmSceneMonitor s = om_scene_default().monitor;
    static const struct {
        int from;
        double part;
        int to;
    } row[] = {{0, -1, 0},  {0, 4, 0},   {0, 4.001, 1}, {0, 8, 1},   {0, 8.001, 2}, {0, 99, 2},
               {1, 3.6, 1}, {1, 3.4, 0}, {2, 7.6, 2},   {2, 7.4, 1}, {2, 3.6, 1},   {2, 3.4, 0}};
    for (size_t i = 0; i < sizeof row / sizeof *row; ++i) {
        int to = om_monitor_next_part_state(&s, row[i].from, 1e-3 * row[i].part);
        if (to != row[i].to)
            fail_msg("from %d at %.3f mm: %d, expected %d", row[i].from, row[i].part, to,
                     row[i].to);
    }
    s.part_limit[0] = s.part_limit[1] = 0;
    assert_int_equal(om_monitor_next_part_state(&s, 0, 0.1), 0);
}

// Ticks of 20 ms: tick i is in the frame period 3 i / 5, by integers.
static void frames_are_due_once_a_period(void** state) {
    (void)state;
    Table t;
    table_create(&t);
    table_see_moved(&t, 0);
    for (int start = 0; start < 100000000; start = 10 * start + 7) {
        om_monitor_reset(t.monitor);
        double time = 0.02 * start;
        assert_true(om_monitor_is_due(t.monitor, time));
        for (int64_t i = start; i < start + 100; ++i, time += 0.02) {
            bool is_due = i == start || 3 * i / 5 != 3 * (i - 1) / 5;
            assert_int_equal(om_monitor_is_due(t.monitor, time), is_due);
            OmMonitorFrame f;
            t.obs.time = t.obs.rgbd.time = time;
            if (is_due) assert_ok(om_monitor_frame(t.monitor, &t.obs, t.x, false, &f));
            assert_false(om_monitor_is_due(t.monitor, time));
        }
    }
    table_destroy(&t);
}

// ---- worlds: tools, workers, memory ------------------------------------------------------------------------------

// Tissue measured in the shadow of a tool, on which the simulated camera sees the tool alone.
static void the_twin_is_seen_behind_the_measured_tools(void** state) {
    (void)state;
    Pair p;
    OmMonitorFrame f;
    pair_create(&p, exact_scene(), true);
    pair_look(&p, &f);
    assert_below(f.distance, 1e-5);
    OmArmObservation* arm = &p.obs.arm[0];
    arm->tip.p = om_pose_apply(p.site->pose_world_task, om_vec3(0.02, 0, 0.05));
    OmPsm psm = *om_world_psm(p.world, 0);
    psm.pose_world_rcm.p =
        om_add(psm.pose_world_rcm.p, om_sub(arm->tip.p, om_psm_forward(&psm, arm->q).p));
    OmSurface tool;
    OmSenseScene* scene;
    int id;
    OmSenseLook look = {.red = 1};
    assert_ok(om_psm_surface(&psm, arm->q, arm->jaw, &tool));
    assert_ok(om_sense_scene_create(&scene));
    assert_ok(om_sense_scene_add(scene, &tool, &look, &id));
    assert_ok(om_sense_scene_commit(scene));
    OmDepthPicture* d = &p.obs.rgbd;
    const int npixel = d->camera.width * d->camera.height;
    float* shade = malloc((size_t)npixel * sizeof *shade);
    assert_ok(om_sense_depth(scene, &d->camera, 1, shade, NULL, NULL));
    for (int i = 0; i < npixel; ++i)
        if (!(shade[i] > 0)) d->depth[i] = 0;
    int nshade = 0;
    for (int i = 0; i < npixel; ++i) nshade += d->depth[i] > 0;
    OmMonitorFrame bare = {0};
    assert_ok(om_monitor_frame(p.monitor, &p.obs, om_body_x(p.twin), true, &f));
    p.obs.narm = 0;
    assert_ok(om_monitor_frame(p.monitor, &p.obs, om_body_x(p.twin), true, &bare));
    printf("in the shadow of a tool: %d pixels, %d points, %.3f mm, %.3f mm without the tool\n",
           nshade, f.npoint, 1e3 * f.distance, 1e3 * bare.distance);
    assert_true(f.npoint > 100 && !f.is_blind && !bare.is_blind);
    assert_true(f.distance > 0.2e-3 && bare.distance < 1e-5);
    free(shade);
    om_sense_scene_destroy(scene);
    om_surface_done(&tool);
    pair_destroy(&p);
}

// Tissue within 2 mm of a measured tool is left out, whatever its colour.
static void points_at_a_tool_do_not_count(void** state) {
    (void)state;
    Pair p;
    OmMonitorFrame f;
    pair_create(&p, exact_scene(), true);
    pair_look(&p, &f);
    OmDepthPicture* d = &p.obs.rgbd;
    OmVec3 tip = om_pose_apply(p.site->pose_world_task, om_vec3(0, 0, 0.005));
    double u, v;
    assert_true(om_camera_project(&d->camera, tip, &u, &v));
    int npixel = d->camera.width * d->camera.height, near = 0;
    for (int i = 0; i < npixel; ++i) {  // 9 x 9 pixels of 1 mm around the tip
        bool is_near = fabs(i % d->camera.width - u) < 4.5 && fabs(i / d->camera.width - v) < 4.5;
        near += is_near && d->depth[i] > 0;
        if (!is_near) d->depth[i] = 0;
    }
    assert_int_equal(near, 81);
    p.scene.monitor.npoint = 10000;  // every pixel is looked at
    OmMonitorDef def = om_monitor_default_def(&p.scene, p.world, p.site);
    om_monitor_destroy(p.monitor);
    assert_ok(om_monitor_create(&def, &p.monitor));
    assert_ok(om_monitor_frame(p.monitor, &p.obs, om_body_x(p.twin), false, &f));
    int before = f.npoint;
    p.obs.arm[0].tip.p = tip;
    assert_ok(om_monitor_frame(p.monitor, &p.obs, om_body_x(p.twin), false, &f));
    printf("around a tip: %d points, %d with the tool there\n", before, f.npoint);
    assert_true(before > 60 && f.npoint < before / 2);
    pair_destroy(&p);
}

static void frames_repeat_with_any_number_of_workers(void** state) {
    (void)state;
    OmMonitorFrame f[2];
    for (int k = 0; k < 2; ++k) {
        Pair p;
        pair_create_with(&p, easy_scene(), false, 1 + k);
        memset(&f[k], 0, sizeof f[k]);
        pair_look(&p, &f[k]);
        for (int i = 0; i < 3; ++i) pair_step(&p);
        pair_look(&p, &f[k]);
        pair_destroy(&p);
    }
    assert_memory_equal(&f[0], &f[1], sizeof *f);
}

// A whole run with a small limit, so that the state rises; its numbers are in the result, in run.json and the report.
static void a_run_tells_of_its_frames(void** state) {
    (void)state;
    char dir[] = "/tmp/om_monitor_XXXXXX", path[64], text[128], *json, *html;
    size_t size;
    assert_non_null(mkdtemp(dir));
    snprintf(path, sizeof path, "%s/run", dir);
    OmScene scene = easy_scene();
    scene.monitor.is_enabled = true;
    scene.monitor.limit[0] = 1e-5;
    scene.monitor.limit[1] = 1e-2;
    scene.monitor.limit[2] = 2e-2;
    scene.monitor.hysteresis = 0;
    scene.task.max_actions = 4;
    scene.rgbd.width = 96, scene.rgbd.height = 72;
    OmRetractDef def = om_retract_default_def(&scene);
    OmRetractResult r;
    def.nworker = 1;
    def.out_dir = path;
    assert_ok(om_retract_run(&def, NULL, &r));
    assert_true(r.belief.nwarning[0] > 0 && r.belief.nwarning[1] == 0 && r.belief.mu_max > 1e-5 &&
                r.belief.mu_max < 1e-2);
    assert_near(r.belief.nmonitor, 30 * r.time, 3);
    snprintf(text, sizeof text, "%s/run.json", path);
    assert_ok(om_file_read(text, 1u << 24, &json, &size));
    snprintf(text, sizeof text, "%s/report.html", path);
    assert_ok(om_file_read(text, 1u << 26, &html, &size));
    snprintf(text, sizeof text, "\"times_state_1\": %d", r.belief.nwarning[0]);
    if (!strstr(json, text)) fail_msg("run.json does not have %s", text);
    assert_non_null(strstr(json, "\"warning\": 1"));
    assert_non_null(strstr(json, "\"mu_m\""));
    snprintf(text, sizeof text, "%d frames of the depth camera were compared", r.belief.nmonitor);
    if (!strstr(html, text)) fail_msg("the report does not have: %s", text);
    assert_non_null(strstr(html, "Warning state while tissue is held"));
    om_retract_result_done(&r);
    om_free(json);
    om_free(html);
    assert_ok(om_path_remove(path));
    assert_int_equal(rmdir(dir), 0);
}

// ---- faults ------------------------------------------------------------------------------------------------------

static double fault_from;  // s of the world's clock
static bool is_arm_lost;   // else: the depth camera is covered

static OmStatus faulty_observe(OmWorld* world, unsigned what, OmObservation* obs) {
    OM_TRY(om_world_observe(((HiddenWorld*)world)->inner, what, obs));
    if (obs->time < fault_from) return OM_OK;
    if (is_arm_lost) obs->arm[0].q[2] = NAN, obs->arm[0].tip.p.z = NAN;
    for (int i = 0; obs->rgbd.depth && i < obs->rgbd.camera.width * obs->rgbd.camera.height; ++i)
        if (!is_arm_lost) obs->rgbd.depth[i] = 0;
    return OM_OK;
}

// The loop holds, with the reason in a sentence; it does not fail.
static void a_lost_camera_or_tool_ends_in_a_hold(void** state) {
    (void)state;
    Rig g;
    OmWorldOps ops = hidden_ops;
    ops.observe = faulty_observe;
    OmScene scene = object_scene();
    scene.rgbd.width = 96, scene.rgbd.height = 72;
    rig_create(&g, scene);
    OmMonitorDef monitor_def = om_monitor_default_def(&g.scene, g.world, &g.twin_site);
    for (int k = 0; k < 2; ++k) {
        rig_start(&g);
        OmMonitor* monitor;
        HiddenWorld w =
            hidden_world(g.world, OM_OBSERVE_VISIBILITY | OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR);
        w.head.ops = &ops;
        assert_ok(om_monitor_create(&monitor_def, &monitor));
        OmLoopDef def = om_loop_default_def(&g.scene.task, &w.head, g.twin, g.planner);
        def.monitor = monitor;
        OmLoop* loop;
        assert_ok(om_loop_create(&def, &loop));
        fault_from = INFINITY;
        is_arm_lost = k == 1;
        while (om_loop_phase(loop) != OM_LOOP_ENDED) {
            assert_ok(om_loop_tick(loop));
            if (isinf(fault_from) && om_body_is_holding(g.twin, 0))
                fault_from = om_loop_sample(loop).time + 0.2;
        }
        const OmRetractResult* r = om_loop_result(loop);
        printf("%s: %s\n", om_hold_text(r->hold), r->reason);
        assert_int_equal(r->outcome, OM_RETRACT_HELD);
        assert_int_equal(r->hold, k ? OM_HOLD_TOOL : OM_HOLD_STALE);
        assert_non_null(strstr(r->reason, k ? "PSM1 is not measured" : "has shown no tissue"));
        assert_true(r->time - fault_from < 0.35);
        om_loop_destroy(loop);
        om_monitor_destroy(monitor);
    }
    rig_destroy(&g);
}

static OmStatus create_again(void* ctx) {
    const Table* t = ctx;
    OmMonitor* m;
    OmMonitorFrame f;
    OM_TRY(om_monitor_create(&t->def, &m));
    OmStatus status = om_monitor_frame(m, &t->obs, t->x, false, &f);
    om_monitor_destroy(m);
    return status;
}

static void every_allocation_may_fail(void** state) {
    (void)state;
    Table t;
    table_create(&t);
    table_see_moved(&t, 0);
    assert_true(test_failing_allocations(create_again, &t, 1) > 10);
    table_frame(&t, false);
    test_count_begin();
    OmMonitorFrame f = table_frame(&t, true);
    assert_int_equal(test_count_end(), 0);
    assert_false(f.is_blind);
    table_destroy(&t);
    om_monitor_destroy(NULL);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_are_due_once_a_period),
        cmocka_unit_test(a_run_tells_of_its_frames),
        cmocka_unit_test(a_lift_of_an_equal_twin_has_no_discrepancy),
        cmocka_unit_test(a_lost_camera_or_tool_ends_in_a_hold),
        cmocka_unit_test(frames_repeat_with_any_number_of_workers),
        cmocka_unit_test(a_lift_of_another_mesh_with_noise_has_little),
        cmocka_unit_test(an_error_of_registration_is_in_the_rest),
        cmocka_unit_test(points_at_a_tool_do_not_count),
        cmocka_unit_test(the_twin_is_seen_behind_the_measured_tools),
        cmocka_unit_test(tissue_behind_the_organ_does_not_count),
        cmocka_unit_test(an_error_of_the_tools_gives_no_warning),
        cmocka_unit_test(the_distance_is_that_of_brute_force),
        cmocka_unit_test(every_allocation_may_fail),
        cmocka_unit_test(midpoints_of_the_twin_count),
        cmocka_unit_test(wrong_input_is_refused),
        cmocka_unit_test(a_shift_after_the_grasp_is_its_state),
        cmocka_unit_test(nothing_seen_changes_nothing),
        cmocka_unit_test(a_shift_before_the_grasp_is_in_the_rest),
        cmocka_unit_test(a_rest_is_bounded),
        cmocka_unit_test(states_of_a_part_end_at_two),
        cmocka_unit_test(hidden_tissue_of_the_twin_does_not_count),
        cmocka_unit_test(states_are_those_of_the_algorithm),
        cmocka_unit_test(a_part_is_lifted_where_the_other_lies_still),
        cmocka_unit_test(a_part_is_over_the_place_before_the_grasp),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
