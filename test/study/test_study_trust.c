// test_study_trust.c: errors of acquisitions, and the counts of the study of trust, by hand on made-up results.
#include <string.h>

#include "omentum/match_acquisition.h"
#include "studies/study_trust_internal.h"
#include "test_alloc.h"
#include "test_folder.h"

#define DEG (OM_PI / 180)
#define NDRAW 12000

// ---- errors ---------------------------------------------------------------------------------------------------------

typedef struct Range {
    TrustError error;
    double lo, hi;  // of the size
} Range;

// Every kind is drawn equally often, within its bounds, and comes near to both of them.
static void test_draws(void** unused) {
    (void)unused;
    static const Range range[] = {{TRUST_SHIFT, 0.0001, 0.03},
                                  {TRUST_TILT, 0.05 * DEG, 20 * DEG},
                                  {TRUST_AIM, 0.02 * DEG, 10 * DEG},
                                  {TRUST_FOCAL, 0.6703200, 1.4918247},  // exp(-0.4), exp(0.4)
                                  {TRUST_SCALE, 0.6065307, 1.6487213},
                                  {TRUST_MISSING, 0.05, 0.7}};
    int n[TRUST_NERROR] = {0}, variant[6] = {0};
    double lo[TRUST_NERROR], hi[TRUST_NERROR];
    for (int e = 0; e < TRUST_NERROR; ++e) lo[e] = HUGE_VAL, hi[e] = -HUGE_VAL;
    for (int i = 0; i < NDRAW; ++i) {
        TrustCase c = om__trust_case(7, i);
        assert_in_range(c.error, 1, TRUST_NERROR - 1);
        assert_in_range(c.variant, 0, 5);
        assert_near(om_norm(c.axis), 1, 1e-12);
        ++n[c.error];
        ++variant[c.variant];
        lo[c.error] = fmin(lo[c.error], c.size);
        hi[c.error] = fmax(hi[c.error], c.size);
    }
    assert_int_equal(n[TRUST_RIGHT], 0);
    // 1000 each, standard deviation 30
    for (int e = 1; e < TRUST_NERROR; ++e) assert_in_range(n[e], 850, 1150);
    for (int k = 0; k < 6; ++k) assert_in_range(variant[k], 1800, 2200);
    for (size_t k = 0; k < sizeof range / sizeof *range; ++k) {
        const Range* r = &range[k];
        assert_true(lo[r->error] >= r->lo && lo[r->error] < 1.05 * r->lo);
        assert_true(hi[r->error] <= r->hi && hi[r->error] > r->hi / 1.05);
    }
    assert_true(lo[TRUST_OTHER] == 0 && hi[TRUST_OTHER] == 0);
}

// Sizes are even in their logarithm: half of the shifts are below the geometric mean of the bounds.
static void test_sizes(void** unused) {
    (void)unused;
    int n = 0, nsmall = 0, nshort = 0;
    for (int i = 0; i < NDRAW; ++i) {
        TrustCase c = om__trust_case(8, i);
        n += c.error == TRUST_SHIFT;
        nsmall += c.error == TRUST_SHIFT && c.size < sqrt(0.0001 * 0.03);
        nshort += c.error == TRUST_FOCAL && c.size < 1;
    }
    assert_near(nsmall / (double)n, 0.5, 0.06);
    assert_near(nshort / (double)(NDRAW / (TRUST_NERROR - 1)), 0.5, 0.06);
}

// A case is the same at any time; another seed has others.
static void test_seeds(void** unused) {
    (void)unused;
    int nsame = 0;
    for (int i = 0; i < 100; ++i) {
        TrustCase a = om__trust_case(7, i), b = om__trust_case(7, i), c = om__trust_case(8, i);
        assert_true(a.error == b.error && a.size == b.size && a.axis.x == b.axis.x);
        nsame += a.axis.x == c.axis.x;
    }
    assert_int_equal(nsame, 0);
}

static void test_names(void** unused) {
    (void)unused;
    assert_true(om__trust_is_named(TRUST_AIM, OM_MATCH_MOVED));
    assert_true(om__trust_is_named(TRUST_FOCAL, OM_MATCH_FOCAL));
    assert_true(om__trust_is_named(TRUST_ORDER, OM_MATCH_ORDER));
    assert_true(om__trust_is_named(TRUST_OTHER, OM_MATCH_UNKNOWN));
    assert_false(om__trust_is_named(TRUST_SCALE, OM_MATCH_FOCAL));
    assert_false(om__trust_is_named(TRUST_SHIFT, OM_MATCH_FITS));
}

// ---- acquisitions ---------------------------------------------------------------------------------------------------

enum { WIDTH = 64, HEIGHT = 48, NPIXEL = WIDTH * HEIGHT };

// A sheet at rest, seen askew from above; the picture has no noise and no tool.
static TrustTruth sheet;

static void take_picture(TrustShot* shot) {
    const OmPose to_task = om_pose_inverse(sheet.twin.pose_world_task);
    const OmPose camera = om_pose_mul(to_task, sheet.camera.pose_world_camera);
    const double f = 0.5 * HEIGHT / tan(0.5 * sheet.camera.fov);
    const OmVec3 half = sheet.twin.half_size;
    shot->depth = om_calloc(NPIXEL, sizeof *shot->depth);
    shot->color = om_calloc(NPIXEL, 3);
    for (int i = 0; i < NPIXEL; ++i) {
        OmVec3 ray =
            om_vec3((i % WIDTH + 0.5 - 0.5 * WIDTH) / f, (i / WIDTH + 0.5 - 0.5 * HEIGHT) / f, 1);
        OmVec3 d = om_quat_rotate(camera.q, ray);
        double z = (2 * half.z - camera.p.z) / d.z;
        OmVec3 p = om_madd(camera.p, z, d);
        const bool is_tissue = fabs(p.x) < half.x && fabs(p.y) < half.y;
        if (!is_tissue) z = -camera.p.z / d.z;
        const unsigned char tissue[3] = {230, 190, 80}, board[3] = {40, 120, 90};
        memcpy(shot->color + 3 * i, is_tissue ? tissue : board, 3);
        shot->depth[i] = (float)z;
    }
}

static int make_sheet(void** state) {
    sheet.scene = om_scene_default();
    sheet.scene.believed.kind = OM_BELIEF_NONE;
    sheet.scene.rgbd.width = WIDTH;
    sheet.scene.rgbd.height = HEIGHT;
    sheet.scene.world.narm = 0;
    if (om_site_build(&sheet.scene, OM_SITE_TWIN, NULL, &sheet.twin) != OM_OK) return -1;
    const OmPose task = sheet.twin.pose_world_task;
    sheet.camera =
        (OmCamera){.width = WIDTH, .height = HEIGHT, .fov = 0.7, .near_m = 0.05, .far_m = 1};
    sheet.camera.pose_world_camera =
        om_pose_look_at(om_pose_apply(task, om_vec3(0.03, -0.1, 0.25)),
                        om_pose_apply(task, om_vec3(0.01, 0, 0)), om_vec3(0, 0, 1));
    sheet.nlift = 1;
    take_picture(&sheet.rest);
    take_picture(&sheet.lift[0]);
    return make_dir(state);
}

static int remove_sheet(void** state) {
    om__trust_truth_done(&sheet);
    return remove_dir(state);
}

static void acquire(TrustError error, double size, OmAcquisition* a, OmScan* rest) {
    TrustCase c = {.error = error, .size = size, .axis = om_normalize(om_vec3(1, 2, -2))};
    assert_ok(om__trust_acquire(&sheet, 0, &c, &sheet, a, rest));
    assert_true(a->scan.npoint > 50 || error > TRUST_RANGE);
}

static double turn_between(OmPose a, OmPose b) {
    OmQuat q = om_quat_mul(a.q, om_quat_conj(b.q));
    return 2 * acos(fmin(1, fabs(q.w)));
}

// Errors of the camera's pose: by how much, and what stays.
static void test_poses(void** unused) {
    (void)unused;
    static const struct {
        TrustError error;
        double size;
        double shift, turn;  // of the camera; below 0: not tested
    } row[] = {{TRUST_RIGHT, 0, 0, 0},       {TRUST_SHIFT, 0.003, 0.003, 0},
               {TRUST_TILT, 0.05, -1, 0.05}, {TRUST_AIM, 0.04, 0, 0.04},
               {TRUST_OPENGL, 0, 0, OM_PI},  {TRUST_ORDER, 0, 0, -1},
               {TRUST_INVERSE, 0, -1, -1}};
    const OmPose right = sheet.camera.pose_world_camera;
    const OmVec3 middle = sheet.twin.pose_world_task.p;
    for (size_t k = 0; k < sizeof row / sizeof *row; ++k) {
        OmAcquisition a;
        OmScan rest;
        acquire(row[k].error, row[k].size, &a, &rest);
        const OmPose pose = a.scan.camera.pose_world_camera;
        assert_memory_equal(&pose, &rest.camera.pose_world_camera, sizeof pose);
        if (row[k].shift >= 0) assert_near(om_distance(pose.p, right.p), row[k].shift, 1e-12);
        if (row[k].turn >= 0) assert_near(turn_between(pose, right), row[k].turn, 1e-7);
        if (row[k].error == TRUST_TILT)  // it turns about the tissue
            assert_near(om_distance(om_pose_apply(om_pose_inverse(pose), middle),
                                    om_pose_apply(om_pose_inverse(right), middle)),
                        0, 1e-12);
        if (row[k].error == TRUST_ORDER) assert_near(pose.q.x, right.q.w, 1e-12);
        if (row[k].error == TRUST_INVERSE)
            assert_near(om_norm(om_pose_apply(pose, right.p)), 0, 1e-12);
        om_acquisition_done(&a);
        om_scan_done(&rest);
    }
}

// Errors of depth and of the lens, pixel by pixel.
static void test_depths(void** unused) {
    (void)unused;
    static const TrustError error[] = {TRUST_SCALE, TRUST_RANGE, TRUST_MISSING, TRUST_FOCAL};
    const double f = 0.5 * HEIGHT / tan(0.5 * sheet.camera.fov);
    for (size_t k = 0; k < sizeof error / sizeof *error; ++k) {
        OmAcquisition a;
        OmScan rest;
        int nchanged = 0;
        acquire(error[k], 0.25 + (error[k] != TRUST_MISSING), &a, &rest);
        for (int i = 0; i < NPIXEL; ++i) {
            const double z = (double)a.scan.depth[i], right = (double)sheet.rest.depth[i];
            const double x = (i % WIDTH + 0.5 - 0.5 * WIDTH) / f,
                         y = (i / WIDTH + 0.5 - 0.5 * HEIGHT) / f;
            if (error[k] == TRUST_SCALE) assert_near_rel(z, 1.25 * right, 1e-6);
            if (error[k] == TRUST_RANGE) assert_near_rel(z, right * sqrt(1 + x * x + y * y), 1e-6);
            nchanged += fabs(z - right) > 1e-6;
        }
        if (error[k] == TRUST_MISSING) assert_near(nchanged / (double)NPIXEL, 0.25, 0.5 / HEIGHT);
        if (error[k] == TRUST_FOCAL) {
            assert_int_equal(nchanged, 0);
            assert_near_rel(a.scan.camera.lens.fx, 1.25 * f, 1e-9);
        }
        om_acquisition_done(&a);
        om_scan_done(&rest);
    }
}

// Colours mirrored from left to right, and twice: none.
static void test_mirror(void** unused) {
    (void)unused;
    OmAcquisition right, wrong;
    OmScan rest[2];
    acquire(TRUST_RIGHT, 0, &right, &rest[0]);
    acquire(TRUST_MIRRORED, 0, &wrong, &rest[1]);
    int nsame = 0, nmirrored = 0;
    for (int i = 0; i < NPIXEL; ++i) {
        const int mirrored = i / WIDTH * WIDTH + WIDTH - 1 - i % WIDTH;
        const bool is_tissue = right.scan.pixel[i] == OM_SCAN_TISSUE;
        nsame += is_tissue && wrong.scan.pixel[i] == OM_SCAN_TISSUE;
        nmirrored += om_sense_part_of(sheet.rest.color + 3 * mirrored) == OM_PART_TISSUE &&
                     wrong.scan.pixel[i] == OM_SCAN_TISSUE;
    }
    assert_true(nmirrored > 50 && nsame < nmirrored);
    for (int k = 0; k < 2; ++k) om_scan_done(&rest[k]);
    om_acquisition_done(&right);
    om_acquisition_done(&wrong);
}

static OmStatus acquire_again(void* ctx) {
    (void)ctx;
    const TrustCase c = {.error = TRUST_MIRRORED};
    OmAcquisition a;
    OmScan rest;
    OmStatus status = om__trust_acquire(&sheet, 0, &c, &sheet, &a, &rest);
    if (status < 0) return status;
    om_acquisition_done(&a);
    om_scan_done(&rest);
    return OM_OK;
}

static void test_acquire_memory(void** unused) {
    (void)unused;
    assert_true(test_failing_allocations(acquire_again, NULL, 1) > 10);
}

// ---- probabilities --------------------------------------------------------------------------------------------------

// Ten vertices of 0.1, two attached; four of 0.5, one attached; two of 1, both attached. The set has those of 0.5 and
// more, so 2 + 3 vertices are wrong.
static void test_reliability(void** unused) {
    (void)unused;
    float p[16];
    unsigned char attached[16], truth[16] = {1, 1, [10] = 1, [14] = 1, 1};
    for (int i = 0; i < 16; ++i) {
        p[i] = i < 10 ? 0.1f : i < 14 ? 0.5f : 1.0f;
        attached[i] = i >= 10;
    }
    OmStudyReliability r = {0};
    om__trust_reliability_add(&r, 6, p, attached, truth);
    om__trust_reliability_add(&r, 10, p + 6, attached + 6, truth + 6);
    om__trust_reliability_end(&r);
    assert_int_equal(r.n, 16);
    assert_int_equal(r.count[1], 10);
    assert_int_equal(r.count[7], 4);
    assert_int_equal(r.count[14], 2);
    assert_near(r.mean[1], 0.1, 1e-7);
    assert_near(r.share[1], 0.2, 1e-12);
    assert_near(r.share[7], 0.25, 1e-12);
    // (10 |0.1 - 0.2| + 4 |0.5 - 0.25|) / 16
    assert_near(r.ece, 0.125, 1e-7);
    // (2 x 0.81 + 8 x 0.01 + 4 x 0.25) / 16
    assert_near(r.brier, 0.16875, 1e-7);
    assert_near(r.brier_hard, 5.0 / 16, 1e-12);
    OmStudyReliability none = {0};
    om__trust_reliability_end(&none);
    assert_near(none.ece, 0, 0);
}

// ---- counts ---------------------------------------------------------------------------------------------------------

static TrustUpdate made(bool is_accepted, double dice, int cause) {
    TrustUpdate u = {.is_there = 1, .is_accepted = is_accepted, .dice = dice, .cause = cause};
    u.ms = 100 * dice;
    // two vertices, of which the first is attached
    u.probability[0] = is_accepted ? 0.75f : 0.25f;
    u.probability[1] = 0.25f;
    u.attached[0] = is_accepted;
    return u;
}

// Truth 0 has all lifts, truth 1 three of them; the second one's other tissue has two.
static void make_results(TrustResult* r) {
    static const TrustError error[2][TRUST_NLIFT] = {
        {TRUST_SHIFT, TRUST_SHIFT, TRUST_SHIFT, TRUST_FOCAL, TRUST_OTHER},
        {TRUST_FOCAL, TRUST_ORDER, TRUST_OTHER}};
    memset(r, 0, 2 * sizeof *r);
    for (int i = 0; i < 2; ++i) {
        r[i].nlift = i ? 3 : 5;
        r[i].nnode = 2;
        r[i].share = 0.5;
        r[i].truth[0] = 1;
        for (int k = 0; k < r[i].nlift; ++k) {
            r[i].c[k].error = error[i][k];
            r[i].c[k].size = 0.001 * (k + 1);
            r[i].right[k] = made(true, 0.8 + 0.01 * k, OM_MATCH_FITS);
        }
    }
    r[1].right[2].is_accepted = 0;
    snprintf(r[1].right[2].reason, 64, "too far, \"far\"");
    r[0].wrong[0] = made(true, 0.65, OM_MATCH_FITS);   // 0.15 below 0.80: not more
    r[0].wrong[1] = made(true, 0.65, OM_MATCH_MOVED);  // 0.16 below 0.81
    r[0].wrong[1].is_moved = 1;
    r[0].wrong[0].dice += 1e-9;
    r[0].wrong[2] = made(false, 0, OM_MATCH_MOVED);
    r[0].wrong[3] = made(false, 0, OM_MATCH_SCALE);
    r[0].wrong[4] = made(true, 0.5, OM_MATCH_FITS);
    r[1].wrong[0] = made(false, 0, OM_MATCH_FOCAL);
    r[1].wrong[1] = made(false, 0, OM_MATCH_ORDER);
    r[0].two[0] = made(true, 0.7, OM_MATCH_FITS);
    r[0].two[1] = made(true, 0.6, OM_MATCH_FITS);
    r[0].two[2] = made(true, 0.7, OM_MATCH_UNKNOWN);
    r[0].two[2].is_left_out = 1;
    r[0].two[3] = made(false, 0, OM_MATCH_UNKNOWN);
    r[1].two[0] = made(false, 0, OM_MATCH_UNKNOWN);
}

static void assert_kind(const OmStudyTrustSummary* sum, TrustError error, int n, int nclean,
                        int ncorrected, int nrefused, int nnamed, int nbad) {
    const OmStudyTrustKind* k = &sum->kind[error - 1];
    assert_string_equal(k->name, om__trust_error_name[error]);
    const int got[] = {k->n, k->nclean, k->ncorrected, k->nrefused, k->nnamed, k->nbad};
    const int want[] = {n, nclean, ncorrected, nrefused, nnamed, nbad};
    for (int i = 0; i < 6; ++i)
        if (got[i] != want[i]) fail_msg("%s, %d: %d, not %d", k->name, i, got[i], want[i]);
}

static void test_counts(void** unused) {
    (void)unused;
    TrustResult* r = om_alloc(2, sizeof *r);
    OmStudyTrustSummary sum = {0};
    make_results(r);
    assert_ok(om__trust_summarise(2, r, &sum));
    assert_int_equal(sum.ntruth, 2);
    assert_int_equal(sum.nlost, 2);
    assert_int_equal(sum.nright, 8);
    assert_int_equal(sum.nright_refused, 1);
    assert_int_equal(sum.nwrong, 7);
    assert_int_equal(sum.nabsent, 1);
    assert_int_equal(sum.nwrong_refused, 4);
    assert_int_equal(sum.nbad, 2);
    assert_kind(&sum, TRUST_SHIFT, 3, 1, 1, 1, 1, 1);
    assert_kind(&sum, TRUST_FOCAL, 2, 0, 0, 2, 1, 0);
    assert_kind(&sum, TRUST_ORDER, 1, 0, 0, 1, 1, 0);
    assert_kind(&sum, TRUST_OTHER, 1, 1, 0, 0, 0, 1);
    assert_kind(&sum, TRUST_RANGE, 0, 0, 0, 0, 0, 0);
    assert_int_equal(sum.ntwo, 5);
    assert_int_equal(sum.ntwo_refused, 2);
    assert_int_equal(sum.ntwo_out, 3);
    assert_int_equal(sum.ntwo_bad, 1);
    // 0.80 to 0.84, 0.80, 0.81
    assert_near(sum.dice_right, 0.81, 1e-6);
    assert_near(sum.dice_wrong, 0.65, 1e-6);
    assert_near(sum.kind[TRUST_SHIFT - 1].dice_right, 0.805, 1e-6);
    assert_near(sum.kind[TRUST_OTHER - 1].dice, 0.5, 1e-6);
    assert_near(sum.ms, 81.5, 1e-6);  // of 80 to 84 and 80 to 82
    // Accepted: 0.75 is attached, 0.25 is not. Refused: 0.25, of which half is.
    assert_int_equal(sum.right.n, 14);
    assert_int_equal(sum.all.n, 20);
    assert_int_equal(sum.every.n, 30);
    assert_near(sum.all.ece, 0.25, 1e-7);
    assert_near(sum.all.brier, 0.0625, 1e-7);
    assert_near(sum.all.brier_hard, 0, 0);
    assert_near(sum.every.brier_hard, 4.0 / 30, 1e-12);
    assert_false(sum.is_met);
    om_free(r);
}

// 500 right and 500 wrong cases with these numbers of failures; `p` of the attached vertex.
static bool is_met(int nbad, int nrefused, float p) {
    enum { N = 100 };
    TrustResult* r = om_calloc(N, sizeof *r);
    OmStudyTrustSummary sum = {0};
    assert_non_null(r);
    for (int i = 0; i < N; ++i) {
        r[i].nlift = TRUST_NLIFT;
        r[i].nnode = 1;
        r[i].truth[0] = 1;
        for (int k = 0; k < TRUST_NLIFT; ++k) {
            const int number = TRUST_NLIFT * i + k;
            r[i].c[k].error = TRUST_SHIFT;
            r[i].right[k] = made(number >= nrefused, 0.8, OM_MATCH_FITS);
            r[i].wrong[k] = made(true, number < 500 - nbad ? 0.8 : 0.6, OM_MATCH_FITS);
            r[i].right[k].probability[0] = r[i].wrong[k].probability[0] = p;
        }
    }
    assert_ok(om__trust_summarise(N, r, &sum));
    om_free(r);
    return sum.is_met;
}

static void test_goal(void** unused) {
    (void)unused;
    assert_true(is_met(2, 5, 0.96f));
    assert_false(is_met(3, 5, 0.96f));
    assert_false(is_met(2, 6, 0.96f));
    assert_false(is_met(2, 5, 0.94f));
}

// ---- files ----------------------------------------------------------------------------------------------------------

static void assert_has(const char* text, const char* part) {
    if (!strstr(text, part)) fail_msg("no \"%s\" in %.3000s", part, text);
}

static void test_files(void** unused) {
    (void)unused;
    OmStudyTrustDef def = om_study_trust_default_def(dir);
    TrustResult* r = om_alloc(2, sizeof *r);
    Trust s = {.def = &def, .ntruth = 2, .result = r};
    make_results(r);
    assert_ok(om__trust_summarise(2, r, &s.sum));
    assert_ok(om__trust_write(&s));
    char* text;
    size_t size;
    assert_ok(om_file_read(in_dir("cases.csv"), 1 << 20, &text, &size));
    assert_has(text, "\nwrong,0,1,shift,2,mm,1,1,0,moved,0.650000,0.810000,1,65.0,\"\"\n");
    assert_has(text,
               "\nright,1,2,right,0,,0,0,0,fits,0.820000,0.820000,0,82.0,\"too far, 'far'\"\n");
    assert_has(text, "\ntwo,0,2,other,0,,1,0,1,unknown,0.700000,0.820000,0,70.0,\"\"\n");
    assert_null(strstr(text, "\nwrong,1,2,"));
    om_free(text);
    assert_ok(om_file_read(in_dir("report.html"), 1 << 20, &text, &size));
    assert_has(text, "and 7 wrong acquisitions: ");
    assert_has(text, ">2</td><td>at most 0</td><td></td><td>missed<");
    assert_has(text, "camera shifted, 2.00 mm");
    assert_has(text, "1 to 3 mm");
    assert_has(text, "too far, &quot;far&quot;");
    om_free(text);
    om_free(r);
}

static void test_def(void** unused) {
    (void)unused;
    OmStudyTrustSummary sum;
    OmStudyTrustDef def = om_study_trust_default_def(in_dir("none"));
    def.ntruth = 0;
    assert_status(om_study_trust_run(&def, NULL, &sum), OM_INVALID);
    assert_has(om_error_message(), "ntruth is 0");
    def = om_study_trust_default_def(in_dir("none"));
    def.draw.kind = OM_DRAW_PUBLISHED;
    assert_status(om_study_trust_run(&def, NULL, &sum), OM_INVALID);
    assert_has(om_error_message(), "development");
    assert_false(om_path_exists(in_dir("none")));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_draws),       cmocka_unit_test(test_sizes),
        cmocka_unit_test(test_seeds),       cmocka_unit_test(test_names),
        cmocka_unit_test(test_poses),       cmocka_unit_test(test_depths),
        cmocka_unit_test(test_mirror),      cmocka_unit_test(test_acquire_memory),
        cmocka_unit_test(test_reliability), cmocka_unit_test(test_counts),
        cmocka_unit_test(test_goal),        cmocka_unit_test(test_files),
        cmocka_unit_test(test_def),
    };
    return cmocka_run_group_tests(tests, make_sheet, remove_sheet);
}
