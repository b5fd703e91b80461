// test_world_cloud.c: pictures of a world say when and from where; the points on the tissue found in them.
#include "test_alloc.h"
#include "test_field.h"

#include "omentum/world_cloud.h"
#include "scene/scene_site.h"
#include "world/world_view.h"

#define TOP 0.005  // m, of the sheet

static OmCloud find_cloud(Field* f, const OmCloudDef* def) {
    OmObservation obs = observe(f, OM_OBSERVE_DEPTH);
    OmCloud cloud;
    assert_ok(om_cloud_init(def, &obs, &cloud));
    assert_near(cloud.time, obs.time, 0);
    om_observation_done(&obs);
    return cloud;
}

// Pixels of the depth camera whose rays meet the top of the sheet at rest.
static int count_top_pixels(const Field* f, const OmCamera* camera) {
    OmPose task = om_pose_inverse(f->site.pose_world_task);
    OmVec3 half = f->site.half_size, eye = om_pose_apply(task, camera->pose_world_camera.p);
    int n = 0;
    for (int i = 0; i < camera->width * camera->height; ++i) {
        OmVec3 ray = om_camera_ray(camera, i % camera->width + 0.5, i / camera->width + 0.5);
        ray = om_quat_rotate(task.q, ray);
        OmVec3 p = om_madd(eye, (TOP - eye.z) / ray.z, ray);
        n += ray.z < 0 && fabs(p.x) < half.x && fabs(p.y) < half.y;
    }
    return n;
}

static double red_less_blue(const OmPicture* color, int pixel) {
    return color->pixel[3 * pixel] - color->pixel[3 * pixel + 2];
}

// Depth and colour are of the same pixels: pixels on the sheet by depth are orange, those on the board are not.
static void check_registered(const OmDepthPicture* d, OmPose pose_world_task) {
    OmPose task = om_pose_inverse(pose_world_task);
    int nsheet = 0, nboard = 0, norange_sheet = 0, norange_board = 0;
    OmVec3 axis = om_quat_rotate(d->camera.pose_world_camera.q, om_vec3(0, 0, 1));
    for (int i = 0; i < d->camera.width * d->camera.height; ++i) {
        double u = i % d->camera.width + 0.5, v = i / d->camera.width + 0.5;
        OmVec3 ray = om_camera_ray(&d->camera, u, v);
        double t = (double)d->depth[i] / om_dot(ray, axis);
        OmVec3 p = om_pose_apply(task, om_madd(d->camera.pose_world_camera.p, t, ray));
        bool is_orange = red_less_blue(&d->color, i) > 20;
        bool is_sheet = fabs(p.z - TOP) < 5e-4, is_board = fabs(p.z) < 5e-4;
        nsheet += is_sheet, norange_sheet += is_sheet && is_orange;
        nboard += is_board, norange_board += is_board && is_orange;
    }
    assert_true(nsheet > 2000 && nboard > 500);
    assert_true(norange_sheet > 0.95 * nsheet);
    assert_true(norange_board < 0.05 * nboard);
}

// Every picture has its camera: a point of the tissue projects to where the depth camera measured it.
static void check_pictures(OmScene scene) {
    Field f;
    scene.world.has_depth_noise = false;
    scene.endoscope.width = 200, scene.endoscope.height = 150;
    setup(&f, scene);
    for (int i = 0; i < 3; ++i) assert_ok(om_world_advance(f.world, 0.02));
    OmObservation obs = observe(&f, OM_OBSERVE_IMAGE | OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR);
    assert_near(obs.endoscope.time, 0.06, 1e-12);
    assert_near(obs.rgbd.time, 0.06, 1e-12);
    assert_int_equal(obs.endoscope.color.width, scene.endoscope.width);
    assert_int_equal(obs.endoscope.camera.height, scene.endoscope.height);
    assert_int_equal(obs.rgbd.color.width, scene.rgbd.width);
    const OmCamera* camera = &obs.rgbd.camera;
    OmVec3 middle = om_pose_apply(f.site.pose_world_task, om_vec3(0, 0, TOP));
    double u, v;
    assert_true(om_camera_project(camera, middle, &u, &v));
    OmVec3 eye = camera->pose_world_camera.p;
    OmVec3 axis = om_quat_rotate(camera->pose_world_camera.q, om_vec3(0, 0, 1));
    double depth = om_dot(om_sub(middle, eye), axis);
    int pixel = (int)v * camera->width + (int)u;
    assert_near((double)obs.rgbd.depth[pixel], depth, 1.5e-3);  // half a pixel at a slant
    // Tissue is orange: red above blue. The two cameras look from opposite sides.
    const unsigned char* c = &obs.rgbd.color.pixel[3 * pixel];
    assert_true(c[0] > c[2] + 20);
    check_registered(&obs.rgbd, f.site.pose_world_task);
    OmVec3 other = obs.endoscope.camera.pose_world_camera.p;
    OmPose task = om_pose_inverse(f.site.pose_world_task);
    assert_true(om_pose_apply(task, eye).x > 0.05 && om_pose_apply(task, other).x < -0.05);
    om_observation_done(&obs);
    obs = observe(&f, OM_OBSERVE_VISIBILITY);
    assert_near(obs.endoscope.time, 0.06, 1e-12);
    om_observation_done(&obs);
    obs = observe(&f, OM_OBSERVE_DEPTH);  // what is not requested is not made
    assert_null(obs.rgbd.color.pixel);
    assert_null(obs.endoscope.color.pixel);
    om_observation_done(&obs);
    assert_null(obs.rgbd.depth);
    teardown(&f);
}

static void test_pictures_have_time_and_camera(void** state) {
    (void)state;
    check_pictures(half_held());
}

// The same with a calibrated depth camera: the lens bends lines by up to 9 pixels in the corners.
static OmScene bent_camera(void) {
    OmScene scene = half_held();
    const double distortion[5] = {-0.25, 0.08, 5e-4, -4e-4, 0};
    scene.rgbd.focal[0] = 156, scene.rgbd.focal[1] = 155;
    scene.rgbd.center[0] = 81, scene.rgbd.center[1] = 58.5;
    memcpy(scene.rgbd.distortion, distortion, sizeof distortion);
    return scene;
}

static void test_pictures_of_a_bent_lens(void** state) {
    (void)state;
    check_pictures(bent_camera());
}

static void check_cloud(OmScene scene) {
    Field f;
    setup(&f, scene);
    assert_ok(om_world_advance(f.world, 0.02));
    OmCloudDef def = om_cloud_default_def(f.world, &f.site);
    OmCloud cloud = find_cloud(&f, &def);
    OmObservation obs = observe(&f, OM_OBSERVE_DEPTH);
    double expected = count_top_pixels(&f, &obs.rgbd.camera);
    // 0.5 % of the pixels have no depth, tools hide some, and the near side of the sheet adds some.
    assert_true(expected > 2000);
    assert_true(cloud.n > 0.9 * expected && cloud.n < 1.05 * expected);
    double worst = 0, sum = 0;
    OmPose task = om_pose_inverse(f.site.pose_world_task);
    for (int i = 0; i < cloud.n; ++i) {
        OmVec3 p = om_pose_apply(task, om_load3(cloud.x, i));
        assert_true(fabs(p.x) < 0.063 && fabs(p.y) < 0.063);
        worst = fmax(worst, fabs(p.z - TOP));
        sum += fabs(p.z - TOP);
        // The pixel is where the point projects to.
        double u, v;
        assert_true(om_camera_project(&obs.rgbd.camera, om_load3(cloud.x, i), &u, &v));
        assert_int_equal(cloud.pixel[i], (int)v * obs.rgbd.camera.width + (int)u);
    }
    assert_below(sum / cloud.n, 0.0006);  // noise of 0.34 mm along the ray
    assert_below(worst, 0.003);           // and the side of the sheet, above the clearance
    om_observation_done(&obs);
    om_cloud_done(&cloud);
    teardown(&f);
}

static void test_cloud_lies_on_the_tissue(void** state) {
    (void)state;
    check_cloud(half_held());
    check_cloud(bent_camera());
}

// Points above the sheet by more than 3 mm, where the tissue lies flat: of a tool.
static int count_above(const Field* f, const OmCloud* cloud) {
    OmPose task = om_pose_inverse(f->site.pose_world_task);
    int n = 0;
    for (int i = 0; i < cloud->n; ++i)
        n += om_pose_apply(task, om_load3(cloud->x, i)).z > TOP + 0.003;
    return n;
}

static void test_tools_are_left_out(void** state) {
    (void)state;
    Field f;
    OmScene scene = half_held();
    scene.world.tool_noise = 0.0005;
    setup(&f, scene);
    for (int a = 0; a < 2; ++a) {
        OmVec3 over = om_vec3(0.01, a == 0 ? -0.02 : 0.02, TOP + 0.012);
        assert_ok(om_world_move(f.world, a, to_world(&f, a, over), 0.1));
    }
    assert_ok(om_world_set_jaw(f.world, 0, 0));
    for (int i = 0; i < 60; ++i) assert_ok(om_world_advance(f.world, 0.02));
    assert_false(observe(&f, 0).arm[0].is_moving);
    OmCloudDef def = om_cloud_default_def(f.world, &f.site);
    OmCloud cloud = find_cloud(&f, &def);
    assert_int_equal(count_above(&f, &cloud), 0);
    int n = cloud.n;
    om_cloud_done(&cloud);
    for (int a = 0; a < 2; ++a) {  // without the kinematics of one arm its tool is seen as tissue
        def = om_cloud_default_def(f.world, &f.site);
        def.psm[a] = NULL;
        cloud = find_cloud(&f, &def);
        assert_true(count_above(&f, &cloud) > 50);
        om_cloud_done(&cloud);
    }
    OmObservation obs = observe(&f, OM_OBSERVE_DEPTH);
    assert_true(n > 0.6 * count_top_pixels(&f, &obs.rgbd.camera));
    om_observation_done(&obs);
    teardown(&f);
}

// A lifted corner: its points are in the cloud, each beside a vertex of the truth, and none lies on the board.
static void test_cloud_of_lifted_tissue(void** state) {
    (void)state;
    Field f;
    setup(&f, half_held());
    assert_ok(om_world_reset(f.world));
    grasp_at(&f, 0, om_vec3(-0.048, -0.048, TOP));
    assert_ok(om_world_move(f.world, 0, to_world(&f, 0, om_vec3(-0.04, -0.048, 0.035)), 0.02));
    for (int i = 0; i < 100; ++i) assert_ok(om_world_advance(f.world, 0.02));
    assert_true(is_holding(&f, 0));
    OmCloudDef def = om_cloud_default_def(f.world, &f.site);
    OmCloud cloud = find_cloud(&f, &def);
    const double* x = om_body_x(om_world_truth(f.world));
    OmPose task = om_pose_inverse(f.site.pose_world_task);
    int nhigh = 0;
    double sum = 0;
    for (int i = 0; i < cloud.n; ++i) {
        OmVec3 p = om_load3(cloud.x, i);
        double nearest = 1;
        for (int v = 0; v < f.site.mesh.nvert; ++v)
            nearest = fmin(nearest, om_distance(p, om_load3(x, v)));
        sum += nearest;
        assert_below(nearest, 0.008);  // vertices are 6.7 mm apart
        nhigh += om_pose_apply(task, p).z > 0.015;
    }
    assert_true(nhigh > 100);
    assert_below(sum / cloud.n, 0.004);
    om_cloud_done(&cloud);
    teardown(&f);
}

// A ROI that lies beside the place where it is known is measured like one that does not; far away it is none.
static void check_beside(Field* f) {
    OmObservation obs = observe(f, OM_OBSERVE_VISIBILITY | OM_OBSERVE_IMAGE);
    OmSite known;
    assert_ok(om_site_build(&f->scene, OM_SITE_TWIN, NULL, &known));
    const double shift[] = {0.004, -0.008, 0.041};
    for (int k = 0; k < 3; ++k) {
        double share, moved = shift[k] - (k > 0 ? shift[k - 1] : 0);
        for (int i = 0; i < known.nroi; ++i) known.roi_x[3 * i + 1] += moved;
        for (int v = 0; v < known.roi.nvert; ++v) known.roi.x[3 * v + 1] += moved;
        assert_ok(om_roi_visibility(&obs.endoscope, &known, &share));
        assert_near(share, k < 2 ? obs.visibility : 0, 0.04);
    }
    om_site_done(&known);
    om_observation_done(&obs);
}

// A tool between camera and ROI hides it from the picture and from the rays.
static void check_behind_a_tool(Field* f) {
    OmObservation before = observe(f, OM_OBSERVE_VISIBILITY | OM_OBSERVE_IMAGE), after;
    OmVec3 eye = before.endoscope.camera.pose_world_camera.p;
    OmVec3 p =
        om_add(f->site.roi_center, om_scale(0.035, om_normalize(om_sub(eye, f->site.roi_center))));
    assert_ok(om_world_move(f->world, 1, goal_of(f, 1, p), 0.2));
    for (int i = 0; i < 60; ++i) assert_ok(om_world_advance(f->world, 0.02));
    after = observe(f, OM_OBSERVE_VISIBILITY | OM_OBSERVE_IMAGE);
    double share;
    assert_ok(om_roi_visibility(&after.endoscope, &f->site, &share));
    assert_true(after.visibility < before.visibility - 0.2);
    assert_near(share, after.visibility, 0.04);
    om_observation_done(&before);
    om_observation_done(&after);
}

// The visibility by colour against rays at the true geometry, from hidden to exposed.
static void test_visibility_by_colour(void** state) {
    (void)state;
    Field f;
    OmScene scene = half_held();
    scene.roi.center = om_vec3(-0.042, -0.042, 0);  // near the free corner
    scene.endoscope.width = 640, scene.endoscope.height = 480;
    setup(&f, scene);
    assert_ok(om_world_reset(f.world));
    grasp_at(&f, 0, om_vec3(-0.048, -0.048, TOP));
    OmPose goal = to_world(&f, 0, om_vec3(0.01, -0.02, 0.04));
    assert_ok(om_world_move(f.world, 0, goal, 0.05));
    double largest = 0, worst = 0;
    int nbetween = 0;
    for (int look = 0; look < 16; ++look) {
        OmObservation obs = observe(&f, OM_OBSERVE_VISIBILITY | OM_OBSERVE_IMAGE);
        double share;
        assert_ok(om_roi_visibility(&obs.endoscope, &f.site, &share));
        assert_near(share, obs.visibility, 0.025);  // 200 rays, some 600 pixels
        worst = fmax(worst, fabs(share - obs.visibility));
        largest = fmax(largest, share);
        nbetween += share > 0.1 && share < 0.8;
        if (look == 0) assert_near(share, 0, 0);
        om_observation_done(&obs);
        for (int i = 0; i < 5; ++i) assert_ok(om_world_advance(f.world, 0.02));
    }
    printf("visibility by colour: off the rays by at most %.4f\n", worst);
    assert_true(largest > 0.8 && nbetween > 1);
    check_beside(&f);
    check_behind_a_tool(&f);
    OmWorldPicture none = {0};
    double share = 1;
    assert_status(om_roi_visibility(&none, &f.site, &share), OM_INVALID);
    assert_near(share, 0, 0);
    teardown(&f);
}

static void paint(OmPicture* color, int from, int to, const unsigned char rgb[3]) {
    for (int i = 0; i < color->width * color->height; ++i)
        if (i % color->width >= from && i % color->width < to) memcpy(&color->pixel[3 * i], rgb, 3);
}

// The point of the ROI's dome that a pixel shows, from the centre of its rim.
static OmVec3 find_on_dome(const Field* f, const OmCamera* camera, int column, int row) {
    OmVec3 eye = camera->pose_world_camera.p, d = om_vec3(0, 0, 0);
    OmVec3 ray = om_camera_ray(camera, column + 0.5, row + 0.5);
    for (int turn = 0; turn < 4; ++turn) {
        double r = fmin(1, hypot(d.x, d.y) / f->scene.roi.radius), height = 6e-4 * (1 - r * r);
        double t = (f->site.roi_center.z + height - eye.z) / ray.z;
        d = om_sub(om_madd(eye, t, ray), f->site.roi_center);
    }
    return d;
}

// Pictures painted here: all of the ROI's colour, none, and the left half of the ROI; and through the window alone.
static void test_visibility_of_painted_pictures(void** state) {
    (void)state;
    static const unsigned char roi[3] = {200, 40, 160}, fat[3] = {220, 170, 60};
    Field f;
    OmScene scene = half_held();
    scene.endoscope.width = 640, scene.endoscope.height = 480;
    // in the plane of the camera: left and right are the same
    scene.roi.center = om_vec3(-0.03, 0, 0);
    setup(&f, scene);
    OmObservation obs = observe(&f, OM_OBSERVE_IMAGE);
    OmRoiMeter* meter;
    double share, u, v;
    assert_ok(om_roi_meter_create(&f.site, &meter));
    assert_int_equal(om_roi_meter_window(meter).width, 0);
    assert_true(om_camera_project(&obs.endoscope.camera, f.site.roi_center, &u, &v));
    paint(&obs.endoscope.color, 0, 640, fat);
    assert_ok(om_roi_meter_look(meter, &obs.endoscope, &share));
    assert_near(share, 0, 0);
    paint(&obs.endoscope.color, 0, (int)(u + 0.5), roi);
    assert_ok(om_roi_meter_look(meter, &obs.endoscope, &share));
    assert_in_range(100 * share, 99,
                    101);  // beside it too: half of the margin's disc is more than all of it
    OmWindow w = om_roi_meter_window(meter);
    assert_true(w.width > 30 && w.height > 20 && w.width * w.height < 10000 && w.column % 8 == 0);
    assert_true(w.column < u && u < w.column + w.width && w.row < v && v < w.row + w.height);
    // The world's own pixels: the window is a part of the whole picture, and gives the same share.
    om_observation_done(&obs);
    om_world_set_window(f.world, w);
    OmObservation whole = observe(&f, OM_OBSERVE_IMAGE | OM_OBSERVE_WINDOW);
    obs = observe(&f, OM_OBSERVE_WINDOW);
    assert_true(whole.endoscope.window.width == 0 && whole.endoscope.color.width == 640);
    assert_memory_equal(&obs.endoscope.window, &w, sizeof w);
    for (int row = 0; row < w.height; ++row)
        assert_memory_equal(&obs.endoscope.color.pixel[3 * row * w.width],
                            &whole.endoscope.color.pixel[3 * ((row + w.row) * 640 + w.column)],
                            3 * (size_t)w.width);
    // Half of the ROI, all around it fat: one side; the near half, which has more pixels; one side in the window.
    double half[3];
    for (int k = 0; k < 3; ++k) {
        OmWorldPicture* picture = k < 2 ? &whole.endoscope : &obs.endoscope;
        OmPicture* color = &picture->color;
        for (int i = 0; i < color->width * color->height; ++i) {
            int column = i % color->width + picture->window.column;
            int row = i / color->width + picture->window.row;
            OmVec3 d = find_on_dome(&f, &picture->camera, column, row);
            bool is_roi = hypot(d.x, d.y) < scene.roi.radius && (k == 1 ? d.x < 0 : d.y > 0);
            memcpy(&color->pixel[3 * i], is_roi ? roi : fat, 3);
        }
        assert_ok(om_roi_meter_look(meter, picture, &half[k]));
        assert_near(half[k], 0.5, 0.015);
    }
    assert_near(half[0], half[2], 0);
    obs.endoscope.window.width = 8;  // a picture of another size than its window
    assert_status(om_roi_meter_look(meter, &obs.endoscope, &share), OM_INVALID);
    assert_near(share, 0, 0);
    om_roi_meter_destroy(meter);
    om_observation_done(&obs);
    om_observation_done(&whole);
    teardown(&f);
}

#define BALL 0.025  // m
enum { NRING = 60, NSECTOR = 120, NBALL = 4000 };

// A ball in place of the organ, its ROI a cap whose far side is steep as seen by the camera.
static void put_ball(OmSite* site, double* x, double* n) {
    OmSurface* organ = &site->organ;
    assert_ok(om_surface_init(organ, (NRING + 1) * NSECTOR, 2 * NRING * NSECTOR));
    for (int r = 0; r <= NRING; ++r)
        for (int s = 0; s < NSECTOR; ++s) {
            double a = OM_PI * r / NRING, b = 2 * OM_PI * s / NSECTOR;
            OmVec3 u = om_vec3(sin(a) * cos(b), sin(a) * sin(b), cos(a));
            om_store3(organ->x, r * NSECTOR + s, om_scale(BALL, u));
        }
    for (int r = 0, t = 0; r < NRING; ++r)
        for (int s = 0; s < NSECTOR; ++s, t += 2) {
            int a = r * NSECTOR + s, b = r * NSECTOR + (s + 1) % NSECTOR;
            int tri[6] = {a, a + NSECTOR, b, b, a + NSECTOR, b + NSECTOR};
            memcpy(&organ->tri_vert[3 * t], tri, sizeof tri);
        }
    site->has_organ = true, site->has_ground = false;
    site->roi_center = om_vec3(0, 0, BALL);
    om_surface_done(&site->roi);
    assert_ok(om__site_draw_roi(0.012, site));
    om_free(site->roi_x);
    om_free(site->roi_n);
    site->nroi = 0, site->roi_x = x, site->roi_n = n;
    const double top = BALL - 0.012 * 0.012 / (2 * BALL);  // equal areas have equal heights
    for (int i = 0; i < NBALL; ++i, ++site->nroi) {
        double z = BALL - (BALL - top) * (i + 0.5) / NBALL, a = i * OM_PI * (3 - sqrt(5));
        OmVec3 p =
            om_vec3(sqrt(BALL * BALL - z * z) * cos(a), sqrt(BALL * BALL - z * z) * sin(a), z);
        om_store3(x, i, p);
        om_store3(n, i, om_scale(1 / BALL, p));
    }
}

// A quarter of the ROI's points face away from the camera: all that can be seen is seen, and that is three quarters.
static void test_a_roi_that_no_camera_sees_whole(void** state) {
    (void)state;
    static double x[3 * NBALL], n[3 * NBALL];
    OmScene scene = half_held();
    OmSite site;
    OmView* view;
    OmWorldPicture picture = {0};
    double share;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    put_ball(&site, x, n);
    for (int i = 0; i < NBALL; i += 4) om_store3(n, i, om_scale(-1, om_load3(n, i)));
    picture.camera = om__world_camera(&site, &scene.endoscope, -1);
    const OmWindow whole = {0, 0, picture.camera.width, picture.camera.height};
    assert_ok(om__view_create(&picture.camera, &site, &view));
    assert_ok(om__view_render_bare(view, whole, &picture.color));
    assert_ok(om_roi_visibility(&picture, &site, &share));
    assert_near(share, 0.75, 0.01);
    om_picture_done(&picture.color);
    om_view_destroy(view);
    site.roi_x = site.roi_n = NULL;
    om_site_done(&site);
}

// On a ball, whose far side has few pixels, half of the ROI is measured by its area.
static void test_visibility_on_an_organ(void** state) {
    (void)state;
    static const unsigned char fat[3] = {220, 170, 60};
    static double x[3 * NBALL], n[3 * NBALL];
    OmScene scene = half_held();
    scene.endoscope.width = 640, scene.endoscope.height = 480;
    OmSite site;
    OmView* view;
    OmRoiMeter* meter;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    put_ball(&site, x, n);
    OmCamera camera = om__world_camera(&site, &scene.endoscope, -1);
    assert_ok(om__view_create(&camera, &site, &view));
    assert_ok(om_roi_meter_create(&site, &meter));
    double u, v, unweighted[2] = {0, 0};
    assert_true(om_camera_project(&camera, site.roi_center, &u, &v));
    const int middle = (int)v;
    for (int far = 0; far < 2; ++far) {
        OmWorldPicture picture = {.camera = camera};
        assert_ok(om__view_render_bare(view, (OmWindow){0, 0, 640, 480}, &picture.color));
        int nseen = 0, nall = 0;
        for (int i = 0; i < 640 * 480; ++i) {
            bool is_roi = om_sense_part_of(&picture.color.pixel[3 * i]) == OM_PART_ROI;
            bool is_hidden = (i / 640 < middle) != (far == 1);
            nall += is_roi, unweighted[far] += is_roi && !is_hidden;
            if (is_hidden) memcpy(&picture.color.pixel[3 * i], fat, 3);
        }
        unweighted[far] /= nall;
        for (int i = 0; i < NBALL; ++i) {
            assert_true(om_camera_project(&camera, om_load3(x, i), &u, &v));
            nseen += (v < middle) == (far == 1);
        }
        double share, wanted = (double)nseen / NBALL;
        assert_ok(om_roi_meter_look(meter, &picture, &share));
        assert_near(share, wanted, 0.02);
        assert_true(fabs(unweighted[far] - wanted) > 0.1);
        om_picture_done(&picture.color);
    }
    om_roi_meter_destroy(meter);
    om_view_destroy(view);
    site.roi_x = site.roi_n = NULL;
    om_site_done(&site);
}

// ---- a made-up field: exact -----------------------------------------------------------------------------------

enum { WIDTH = 20, HEIGHT = 4 };

// Distance from an organ that fills z < 9 mm.
static double half_space(void* ctx, OmVec3 p) {
    (void)ctx;
    return p.z - 0.009;
}

typedef struct Made {
    OmSite site;
    OmObservation obs;
    float depth[WIDTH * HEIGHT];
} Made;

// A camera 200 mm above the origin looks down on five strips of different height, four pixels wide.
static void make_field(Made* m) {
    static const double height[5] = {0.001, 0.010, 0.012, 0.065, 0.090};
    memset(m, 0, sizeof *m);
    m->site.pose_world_task = om_pose_identity();
    m->site.half_size = om_vec3(0.06, 0.06, 0.0025);
    m->obs.narm = 1;
    m->obs.rgbd.depth = m->depth;
    m->obs.rgbd.time = 7;
    OmPose pose = om_pose_look_at(om_vec3(0, 0, 0.2), om_vec3(0, 0, 0), om_vec3(0, 1, 0));
    m->obs.rgbd.camera = (OmCamera){pose, WIDTH, HEIGHT, 0.1, 0.01, 1};
    for (int i = 0; i < WIDTH * HEIGHT; ++i) m->depth[i] = (float)(0.2 - height[i % WIDTH / 4]);
    m->depth[9] = 0;  // no return
    m->depth[11] = NAN;
    m->depth[20] = INFINITY;
    m->depth[WIDTH + 2] = -INFINITY;
}

static void check_strips(const Made* m, const OmCloudDef* def, int first, int last) {
    OmCloud cloud;
    assert_ok(om_cloud_init(def, &m->obs, &cloud));
    assert_near(cloud.time, 7, 0);
    int n = 0;
    for (int i = 0; i < WIDTH * HEIGHT; ++i) {
        int strip = i % WIDTH / 4;
        bool has_depth = i != 9 && i != 11 && i != 20 && i != WIDTH + 2;
        if (strip < first || strip > last || !has_depth) continue;
        assert_int_equal(cloud.pixel[n], i);
        assert_near(om_load3(cloud.x, n).z, 0.2 - (double)m->depth[i], 1e-12);
        ++n;
    }
    assert_int_equal(cloud.n, n);
    om_cloud_done(&cloud);
}

static void test_anatomy_and_distance_are_left_out(void** state) {
    (void)state;
    Made m;
    make_field(&m);
    const OmWorldOps ops = {0};
    OmWorld world = {.ops = &ops, .narm = 1};
    OmCloudDef def = om_cloud_default_def(&world, &m.site);
    check_strips(&m, &def, 0, 3);  // 90 mm is beyond the reach of 60 mm over a sheet of 5 mm
    m.site.has_ground = true;
    check_strips(&m, &def, 1, 3);  // 1 mm over the board
    def.reach = 0.1;
    check_strips(&m, &def, 1, 4);
    m.site.has_organ = true;
    OmVec3 lo = om_vec3(-0.05, -0.05, -0.01), hi = om_vec3(0.05, 0.05, 0.1);
    OmSdfDef sdf = om_sdf_default_def(0.005);
    assert_ok(om_sdf_from_function(half_space, NULL, lo, hi, &sdf, &m.site.organ_sdf));
    check_strips(&m, &def, 2, 4);  // 10 mm is 1 mm over the organ
    om_sdf_done(&m.site.organ_sdf);
}

// A plane 50 mm above the origin, 3.75 mm a pixel, and a vertical tool 40 mm beside where its joints say: points beside
// the measured tip are left out, the others stay. A tool that ends 30 mm above the plane hides no point of it.
static void test_tools_stand_at_the_measured_tip(void** state) {
    (void)state;
    Made m;
    make_field(&m);
    for (int i = 0; i < WIDTH * HEIGHT; ++i) m.depth[i] = 0.15F;
    OmPsm psm = om_psm_default(OM_PROGRASP, om_pose_identity());
    const double q[OM_PSM_NJOINT] = {0, 0, 0.1, 0, 0, 0};
    psm.pose_world_rcm.p = om_sub(om_vec3(0.02, 0, 0.05), om_psm_forward(&psm, q).p);
    const OmWorldOps ops = {0};
    OmWorld world = {.ops = &ops, .narm = 1, .psm = {&psm}};
    OmCloudDef def = om_cloud_default_def(&world, &m.site);
    memcpy(m.obs.arm[0].q, q, sizeof q);
    for (int k = 0; k < 2; ++k) {
        OmVec3 tip = om_vec3(-0.02, 0, k == 0 ? 0.05 : 0.08);
        m.obs.arm[0].tip = (OmPose){tip, om_psm_forward(&psm, q).q};
        OmCloud cloud;
        assert_ok(om_cloud_init(&def, &m.obs, &cloud));
        int nbeside = 0;
        for (int i = 0; i < cloud.n; ++i) {
            OmVec3 p = om_load3(cloud.x, i);
            nbeside += hypot(p.x - tip.x, p.y - tip.y) < 0.004;
        }
        if (k == 0) assert_int_equal(nbeside, 0);
        if (k == 0) assert_true(cloud.n < WIDTH * HEIGHT && cloud.n > WIDTH * HEIGHT - 12);
        if (k == 1) assert_true(nbeside > 1);
        if (k == 1) assert_int_equal(cloud.n, WIDTH * HEIGHT);
        om_cloud_done(&cloud);
    }
}

static void test_definitions_out_of_range(void** state) {
    (void)state;
    Made m;
    make_field(&m);
    OmWorld world = {.narm = 1};
    OmCloud cloud;
    OmCloudDef def = om_cloud_default_def(&world, &m.site), bad = def;
    bad.cookie = 0;
    assert_status(om_cloud_init(&bad, &m.obs, &cloud), OM_INVALID);
    bad = def, bad.site = NULL;
    assert_status(om_cloud_init(&bad, &m.obs, &cloud), OM_INVALID);
    bad = def, bad.clearance = -1;
    assert_status(om_cloud_init(&bad, &m.obs, &cloud), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "clearance"));
    bad = def, bad.tool_margin = NAN;
    assert_status(om_cloud_init(&bad, &m.obs, &cloud), OM_INVALID);
    bad = def, bad.reach = INFINITY;
    assert_status(om_cloud_init(&bad, &m.obs, &cloud), OM_INVALID);
    m.obs.rgbd.depth = NULL;
    assert_status(om_cloud_init(&def, &m.obs, &cloud), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "depth"));
    assert_null(cloud.x);
    om_cloud_done(&cloud);
    om_cloud_done(NULL);
}

static OmStatus make_cloud(void* ctx) {
    Made* m = ctx;
    OmWorld world = {.narm = 1};
    OmCloudDef def = om_cloud_default_def(&world, &m->site);
    OmCloud cloud;
    OmStatus status = om_cloud_init(&def, &m->obs, &cloud);
    om_cloud_done(&cloud);
    return status;
}

static void test_failing_allocations_leak_nothing(void** state) {
    (void)state;
    Made m;
    make_field(&m);
    assert_int_equal(test_failing_allocations(make_cloud, &m, 1), 2);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pictures_have_time_and_camera),
        cmocka_unit_test(test_pictures_of_a_bent_lens),
        cmocka_unit_test(test_cloud_lies_on_the_tissue),
        cmocka_unit_test(test_tools_are_left_out),
        cmocka_unit_test(test_cloud_of_lifted_tissue),
        cmocka_unit_test(test_visibility_by_colour),
        cmocka_unit_test(test_visibility_of_painted_pictures),
        cmocka_unit_test(test_a_roi_that_no_camera_sees_whole),
        cmocka_unit_test(test_visibility_on_an_organ),
        cmocka_unit_test(test_anatomy_and_distance_are_left_out),
        cmocka_unit_test(test_tools_stand_at_the_measured_tip),
        cmocka_unit_test(test_definitions_out_of_range),
        cmocka_unit_test(test_failing_allocations_leak_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
