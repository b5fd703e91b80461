// test_scan_color.c: colours learnt from a click separate the tissue in pictures of other light.
#include "scan/scan_truth.h"
#include "test_alloc.h"

// The same picture with another exposure and white balance.
static OmPicture relight(const OmPicture* from, const double gain[3]) {
    OmPicture p;
    assert_ok(om_picture_init(&p, from->width, from->height, 3));
    for (int i = 0; i < 3 * p.width * p.height; ++i)
        p.pixel[i] = (unsigned char)fmin(255, gain[i % 3] * from->pixel[i]);
    return p;
}

typedef struct Shares {
    double found, claimed;  // of the tissue's pixels; of the others
} Shares;

static Shares count(const Truth* t, const OmPicture* p, const OmSenseRange* range) {
    int n[2] = {0}, nin[2] = {0};
    for (int i = 0; i < t->npixel; ++i) {
        double hsv[3];
        om_sense_hsv(&p->pixel[3 * i], hsv);
        bool is_tissue = t->id[i] == 0;
        ++n[is_tissue];
        nin[is_tissue] += om_sense_range_has(range, hsv);
    }
    return (Shares){(double)nin[1] / n[1], (double)nin[0] / n[0]};
}

// A click on the sheet and a box on it; both in five lights, beside the ROI, the board and the tools.
static void test_click_and_box(void** state) {
    (void)state;
    static const double gain[5][3] = {
        {1, 1, 1}, {0.5, 0.5, 0.5}, {0.25, 0.25, 0.25}, {1, 0.9, 0.8}, {0.8, 0.9, 1}};
    Field f;
    OmScene scene = half_held();
    scene.rgbd = om_scene_default().rgbd;
    setup(&f, scene);
    assert_ok(om_world_reset(f.world));
    grasp_at(&f, 0, om_vec3(-0.048, -0.048, 0.005));
    assert_ok(om_world_move(f.world, 0, to_world(&f, 0, om_vec3(0.0, -0.02, 0.045)), 0.04));
    for (int i = 0; i < 100; ++i) assert_ok(om_world_advance(f.world, 0.02));
    OmObservation obs = observe(&f, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR);
    Truth t = truth_init(&f, &obs.rgbd.camera);
    double u, v;
    OmVec3 at = om_pose_apply(f.site.pose_world_task, om_vec3(0.03, 0.01, 0.005));
    assert_true(om_camera_project(&obs.rgbd.camera, at, &u, &v));
    const OmScanRegion region[2] = {
        {.u = u, .v = v, .radius = 12},
        {.is_box = true, .column = (int)u - 10, .row = (int)v - 8, .width = 20, .height = 16}};
    for (int k = 0; k < 10; ++k) {
        OmPicture p = relight(&obs.rgbd.color, gain[k / 2]);
        OmSenseRange range;
        assert_ok(om_scan_learn_range(&p, &region[k % 2], &range));
        Shares s = count(&t, &p, &range);
        print_message("light %d, %s: hue %.0f to %.0f, saturation %.2f, value %.2f: %.4f of the "
                      "tissue, %.5f of the rest\n",
                      k / 2, k % 2 ? "box" : "click", range.hue_min, range.hue_max,
                      range.saturation_min, range.value_min, s.found, s.claimed);
        assert_true(s.found > 0.97);
        assert_below(s.claimed, 0.005);
        om_picture_done(&p);
    }
    // Over-exposed by a third, the click has another hue: it is refused.
    OmPicture bright = relight(&obs.rgbd.color, (double[3]){1.33, 1.33, 1.33});
    OmSenseRange range;
    assert_status(om_scan_learn_range(&bright, &region[0], &range), OM_INVALID);
    om_picture_done(&bright);
    truth_done(&t);
    om_observation_done(&obs);
    teardown(&f);
}

enum { SIDE = 20 };

static void fill(OmPicture* p, int first, int last, int red, int green, int blue) {
    for (int i = 3 * first; i < 3 * last; i += 3) {
        int shade = i / 3 % 7;  // light and dark of one hue: red, green and blue by one factor
        p->pixel[i] = (unsigned char)(red * (10 - shade) / 10);
        p->pixel[i + 1] = (unsigned char)(green * (10 - shade) / 10);
        p->pixel[i + 2] = (unsigned char)(blue * (10 - shade) / 10);
    }
}

// Reds on both sides of hue 0 give a range over it.
static void test_range_over_zero(void** state) {
    (void)state;
    OmPicture p;
    assert_ok(om_picture_init(&p, SIDE, SIDE, 3));
    for (int i = 0; i < SIDE * SIDE; ++i) fill(&p, i, i + 1, 200, 60 - i % 3 * 15, 15 + i % 4 * 15);
    const OmScanRegion all = {.is_box = true, .width = SIDE, .height = SIDE};
    OmSenseRange r;
    assert_ok(om_scan_learn_range(&p, &all, &r));
    assert_true(r.hue_min > 330 && r.hue_max < 30);
    const double red[3] = {359, 0.8, 0.7}, orange[3] = {40, 0.8, 0.7}, violet[3] = {310, 0.8, 0.7};
    assert_true(om_sense_range_has(&r, red));
    assert_false(om_sense_range_has(&r, orange));
    assert_false(om_sense_range_has(&r, violet));
    om_picture_done(&p);
}

static void assert_refused(const OmPicture* p, const OmScanRegion* region, const char* word) {
    OmSenseRange r;
    assert_status(om_scan_learn_range(p, region, &r), OM_INVALID);
    if (!strstr(om_error_message(), word)) fail_msg("\"%s\" has no %s", om_error_message(), word);
}

static void test_bad_samples(void** state) {
    (void)state;
    OmPicture p, empty = {0};
    assert_ok(om_picture_init(&p, SIDE, SIDE, 3));
    const OmScanRegion all = {.is_box = true, .width = SIDE, .height = SIDE};
    const OmScanRegion small = {.u = 10, .v = 10, .radius = 3},
                       away = {.u = -50, .v = 0, .radius = 5};
    const OmScanRegion bad = {.u = NAN, .v = 0, .radius = 5};
    OmSenseRange r;
    fill(&p, 0, SIDE * SIDE, 200, 130, 50);
    assert_ok(om_scan_learn_range(&p, &all, &r));
    assert_refused(&p, &small, "larger");
    assert_refused(&p, &away, "no pixel");
    const OmScanRegion far = {.is_box = true, .column = INT32_MIN, .width = 9, .height = 9};
    assert_refused(&p, &far, "0 or more");
    assert_refused(&p, &bad, "radius");
    assert_refused(&empty, &all, "empty");
    fill(&p, 0, 60, 200, 70, 60);  // a sixth of another material, 25 degrees away
    assert_refused(&p, &all, "two materials");
    fill(&p, 0, SIDE * SIDE, 120, 118, 121);
    assert_refused(&p, &all, "grey");
    fill(&p, 0, SIDE * SIDE, 255, 200, 90);
    for (int i = 0; i < 3 * SIDE * SIDE; i += 3) p.pixel[i] = 255;
    assert_refused(&p, &all, "too bright");
    fill(&p, 0, SIDE * SIDE, 5, 2, 1);
    assert_refused(&p, &all, "dark");
    fill(&p, 0, SIDE * SIDE, 200, 130, 50);
    fill(&p, 0, 12, 40, 140, 120);  // three pixels in a hundred of the board do not count
    assert_ok(om_scan_learn_range(&p, &all, &r));
    const double board[3] = {165, 0.7, 0.5};
    assert_false(om_sense_range_has(&r, board));
    om_picture_done(&p);
}

static OmStatus learn(void* ctx) {
    const OmScanRegion all = {.is_box = true, .width = SIDE, .height = SIDE};
    OmSenseRange r;
    return om_scan_learn_range(ctx, &all, &r);
}

static void test_no_memory(void** state) {
    (void)state;
    OmPicture p;
    assert_ok(om_picture_init(&p, SIDE, SIDE, 3));
    fill(&p, 0, SIDE * SIDE, 200, 130, 50);
    assert_true(test_failing_allocations(learn, &p, 1) == 3);
    om_picture_done(&p);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_click_and_box),
        cmocka_unit_test(test_range_over_zero),
        cmocka_unit_test(test_bad_samples),
        cmocka_unit_test(test_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
