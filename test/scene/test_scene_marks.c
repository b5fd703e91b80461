// Pictures of patients: the letters at the borders against projected directions, bars against projected lengths.
#include "scene/scene_model_marks.h"
#include "test_common.h"

static OmVec3 direction_of(char letter) {
    switch (letter) {
    case 'R': return om_vec3(1, 0, 0);
    case 'L': return om_vec3(-1, 0, 0);
    case 'A': return om_vec3(0, 1, 0);
    case 'P': return om_vec3(0, -1, 0);
    case 'S': return om_vec3(0, 0, 1);
    case 'I': return om_vec3(0, 0, -1);
    default: fail_msg("'%c' is no letter of a direction", letter); return om_vec3(0, 0, 0);
    }
}

// How far a step of 1 mm from the middle of the view moves in the picture, by om_camera_project.
static void step_of(const OmModelView* view, OmVec3 direction, double* du, double* dv) {
    const OmCamera* c = &view->camera;
    double u0, v0, u1, v1;
    OmVec3 ray = om_camera_ray(c, 0.5 * c->width, 0.5 * c->height);
    OmVec3 middle = om_madd(c->pose_world_camera.p, view->distance, ray);
    assert_true(om_camera_project(c, middle, &u0, &v0));
    assert_near(u0, 0.5 * c->width, 1e-6);
    assert_true(om_camera_project(c, om_madd(middle, 1e-3, direction), &u1, &v1));
    *du = u1 - u0;
    *dv = v1 - v0;
}

// Each letter points to its border, the letters come in order, and none that should be there is missing.
static void check_mark(const OmModelView* view, const char* mark, double su, double sv) {
    static const char all[] = "RLAPSI";
    double du, dv, last = HUGE_VAL, full;
    OmVec3 across = om_quat_rotate(view->camera.pose_world_camera.q, om_vec3(1, 0, 0));
    step_of(view, across, &full, &dv);  // pixels of 1 mm across the view
    assert_true(strlen(mark) >= 1 && strlen(mark) <= 3);
    for (const char* c = mark; *c; c++) {
        step_of(view, direction_of(*c), &du, &dv);
        double towards = (su * du + sv * dv) / full;
        assert_true(towards >
                    (c == mark ? 0.57 : 0.36));  // 1 / sqrt 3; perspective shortens by 1 %
        assert_true(towards < last + 0.02);
        last = towards;
    }
    for (const char* c = all; *c; c++) {
        if (strchr(mark, *c)) continue;
        step_of(view, direction_of(*c), &du, &dv);
        assert_true((su * du + sv * dv) / full < 0.41);
    }
}

static void make_patient(OmPatient* p, OmVec3 up, bool has_organ) {
    memset(p, 0, sizeof *p);
    assert_ok(
        om_tet_mesh_box(om_vec3(0.01, 0.1, 0.2), om_vec3(0.08, 0.16, 0.25), 3, 3, 3, &p->mesh));
    p->up = om_normalize(up);
    if (has_organ) assert_ok(om_tet_mesh_boundary(&p->mesh, &p->organ, NULL));
}

static void test_letters_point_where_they_say(void** unused) {
    (void)unused;
    static const OmVec3 up[] = {{0, 1, 0}, {-1, 0, 0}, {1, 0, 0}, {0, 0, 1}, {0.5, -0.3, 0.6}};
    for (int k = 0; k < 10; k++) {
        OmPatient p;
        OmModelView view[OM_MODEL_VIEWS];
        make_patient(&p, up[k % 5], k >= 5);
        om__model_views(&p, view);
        for (int i = 0; i < OM_MODEL_VIEWS; i++) {
            OmViewMarks m = om__view_marks(&view[i].camera, view[i].distance);
            check_mark(&view[i], m.left, -1, 0);
            check_mark(&view[i], m.right, 1, 0);
            check_mark(&view[i], m.top, 0, -1);
            check_mark(&view[i], m.bottom, 0, 1);
        }
        om_patient_done(&p);
    }
}

// The convention of radiology: who looks stands before the patient, or at the feet.
static void test_convention(void** unused) {
    (void)unused;
    static const char* const wanted[][4] = {
        {"R", "L", "S", "I"}, {"R", "L", "A", "P"}, {"A", "P", "S", "I"}};
    OmPatient p;
    OmModelView view[OM_MODEL_VIEWS];
    make_patient(&p, om_vec3(0, 1, 0), false);
    om__model_views(&p, view);
    for (int i = 0; i < 3; i++) {
        OmViewMarks m = om__view_marks(&view[i].camera, view[i].distance);
        assert_string_equal(m.left, wanted[i][0]);
        assert_string_equal(m.right, wanted[i][1]);
        assert_string_equal(m.top, wanted[i][2]);
        assert_string_equal(m.bottom, wanted[i][3]);
    }
    om_patient_done(&p);
}

// 22.5 degrees from an axis: one letter; a little more: two.
static void test_oblique_letters(void** unused) {
    (void)unused;
    for (int degrees = 0; degrees <= 45; degrees += 5) {
        double a = degrees * OM_PI / 180;
        OmVec3 eye = om_vec3(sin(a), cos(a), 0);  // from the front, turned towards the right
        OmCamera c = {
            om_pose_look_at(eye, om_vec3(0, 0, 0), om_vec3(0, 0, 1)), 400, 300, 0.5, 0.1, 9};
        OmViewMarks m = om__view_marks(&c, 1);
        assert_string_equal(m.top, "S");
        if (degrees == 45) continue;
        assert_string_equal(m.left, degrees <= 20 ? "R" : "RP");
        assert_string_equal(m.right, degrees <= 20 ? "L" : "LA");
    }
}

static void test_bars(void** unused) {
    (void)unused;
    for (double distance = 0.013; distance < 9; distance *= 1.37) {
        OmModelView view = {.distance = distance};
        OmVec3 eye = om_vec3(0.3, -0.2, 0.1);
        OmVec3 target = om_add(eye, om_vec3(0, distance, 0));
        OmCamera c = {om_pose_look_at(eye, target, om_vec3(0, 0, 1)), 440, 340, 0.45, 1e-3, 99};
        view.camera = c;
        OmViewMarks m = om__view_marks(&c, distance);
        double du, dv, mantissa = m.bar / pow(10, floor(log10(m.bar) + 1e-9));
        step_of(&view, om_vec3(1, 0, 0), &du, &dv);
        assert_near_rel(m.bar_pixels, fabs(du) * m.bar * 1e3, 1e-9);
        assert_true(fabs(mantissa - 1) < 1e-6 || fabs(mantissa - 2) < 1e-6 ||
                    fabs(mantissa - 5) < 1e-6);
        assert_true(m.bar_pixels <= 0.3 * 440 && m.bar_pixels > 0.3 * 440 / 2.51);
    }
}

// A bar of 40 pixels and the letters, on grey: the bar 8 pixels from the corner, 3 high, with a black rim; the leftmost
// column of an L of 5 x 3 pixels, 15 + 8 from the right.
static void test_drawing(void** unused) {
    (void)unused;
    enum { W = 200, H = 120 };
    OmPicture p;
    assert_ok(om_picture_init(&p, W, H, 3));
    memset(p.pixel, 128, 3 * W * H);
    const OmViewMarks m = {"R", "L", "S", "I", 0.01, 39.6};
    om__draw_marks(&p, &m);
    int nwhite = 0, nblack = 0, first = -1;
    for (int i = 0; i < 60; ++i) {
        const int shade = p.pixel[3 * ((H - 10) * W + i)];
        nwhite += shade == 255;
        nblack += shade == 0;
        if (shade == 255 && first < 0) first = i;
    }
    assert_int_equal(nwhite, 40);
    assert_int_equal(nblack, 2);
    assert_int_equal(first, 8);
    for (int j = (H - 21) / 2; j < (H - 21) / 2 + 21; ++j) {
        assert_int_equal(p.pixel[3 * (j * W + W - 23)], 255);
        assert_int_equal(p.pixel[3 * (j * W + W - 24)], 0);
        assert_int_equal(p.pixel[3 * (j * W + W - 25)], 128);
    }
    om_picture_done(&p);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_letters_point_where_they_say),
        cmocka_unit_test(test_convention),
        cmocka_unit_test(test_oblique_letters),
        cmocka_unit_test(test_bars),
        cmocka_unit_test(test_drawing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
