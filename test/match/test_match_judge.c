// test_match_judge.c: scans of a sheet at rest with known errors of the camera. Depths and classes of pixels come from
// the intersection of rays with a box and a plane, not from the renderer.
#include "match/match_judge.h"
#include "match_sheet.h"
#include "test_alloc.h"

#define WIDTH 160
#define HEIGHT 120
#define DEG (OM_PI / 180)

typedef struct Rig {
    OmScene scene;
    OmSite site;
    OmMatch* match;
    OmCamera camera;  // the true one
} Rig;

static void begin(Rig* rig) {
    memset(rig, 0, sizeof *rig);
    build_sheet(8, &rig->scene, &rig->site);
    OmMatchDef def = om_match_default_def(&rig->scene, &rig->site);
    def.nhypothesis = 0;
    assert_ok(om_match_create(&def, &rig->match));
    rig->camera =
        (OmCamera){.width = WIDTH, .height = HEIGHT, .fov = 50 * DEG, .near_m = 0.05, .far_m = 1};
    rig->camera.pose_world_camera =
        om_pose_look_at(om_vec3(-0.14, 0.05, 0.16), om_vec3(0.01, -0.02, 0), om_vec3(0, 0, 1));
}

static void end(Rig* rig) {
    om_match_destroy(rig->match);
    om_site_done(&rig->site);
}

// Way along a ray to the box of the sheet, HUGE_VAL: none.
static double to_sheet(OmVec3 o, OmVec3 d) {
    const double lo[3] = {-0.06, -0.06, 0}, hi[3] = {0.06, 0.06, 0.005};
    const double p[3] = {o.x, o.y, o.z}, q[3] = {d.x, d.y, d.z};
    double from = 0, to = HUGE_VAL;
    for (int k = 0; k < 3; ++k) {
        double a = (lo[k] - p[k]) / q[k], b = (hi[k] - p[k]) / q[k];
        from = fmax(from, fmin(a, b));
        to = fmin(to, fmax(a, b));
    }
    return from < to ? from : HUGE_VAL;
}

typedef struct Error {
    OmPose pose;  // stated, of the camera
    double focal, scale;
    bool is_range, is_mirrored;
    double lift;  // m, of the side x > 0, as a ramp
} Error;

static Error no_error(const Rig* rig) {
    return (Error){.pose = rig->camera.pose_world_camera, .focal = 1, .scale = 1};
}

// The picture of the true camera, read with a wrong one: points from every 13th pixel of tissue.
static void look(const Rig* rig, const Error* e, OmScan* scan) {
    const OmCamera* c = &rig->camera;
    OmVec3 eye = c->pose_world_camera.p,
           axis = om_quat_rotate(c->pose_world_camera.q, om_vec3(0, 0, 1));
    OmRng rng = om_rng_init(3, 0);
    float* depth = malloc(WIDTH * HEIGHT * sizeof *depth);
    unsigned char* class = malloc(WIDTH * HEIGHT);
    int n = 0;
    for (int i = 0; i < WIDTH * HEIGHT; ++i) {
        OmVec3 ray = om_camera_ray(c, i % WIDTH + 0.5, i / WIDTH + 0.5);
        double board = ray.z < 0 ? -eye.z / ray.z : HUGE_VAL, sheet = to_sheet(eye, ray);
        double t = fmin(board, sheet);
        OmVec3 x = om_madd(eye, t, ray);
        if (sheet <= board && x.x > 0) t -= e->lift * x.x / 0.06 / -ray.z;  // raised, seen earlier
        double z = t * om_dot(ray, axis) + om_rng_normal(&rng) * 1e-4;
        depth[i] = (float)(e->scale * (e->is_range ? t : z));
        class[i] =
            isfinite(t) ? (sheet <= board ? OM_SCAN_TISSUE : OM_SCAN_OTHER) : OM_SCAN_UNKNOWN;
        if (!isfinite(t)) depth[i] = 0;
    }
    for (int i = 0; i < WIDTH * HEIGHT && e->is_mirrored; ++i) {
        int u = i % WIDTH, j = i - u + WIDTH - 1 - u;
        if (u >= WIDTH / 2) continue;
        unsigned char kept = class[i];
        class[i] = class[j], class[j] = kept;
    }
    for (int i = 0; i < WIDTH * HEIGHT; i += 13) n += class[i] == OM_SCAN_TISSUE && depth[i] > 0;
    assert_ok(om_scan_init(n, 0, scan));
    scan->has_camera = true;
    scan->camera = *c;
    scan->camera.pose_world_camera = e->pose;
    scan->camera.lens = om_camera_lens(c);
    scan->camera.lens.fx *= e->focal;
    scan->camera.lens.fy *= e->focal;
    scan->noise = 1e-4;
    scan->pixel = class;
    scan->depth = depth;
    OmVec3 forward = om_quat_rotate(e->pose.q, om_vec3(0, 0, 1));
    n = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i += 13) {
        if (class[i] != OM_SCAN_TISSUE || !(depth[i] > 0)) continue;
        OmVec3 ray = om_camera_ray(&scan->camera, i % WIDTH + 0.5, i / WIDTH + 0.5);
        om_store3(scan->x, n++, om_madd(e->pose.p, (double)depth[i] / om_dot(ray, forward), ray));
    }
}

static OmMatchVerdict judge(const Rig* rig, const Error* e, bool is_rest, MatchGuess* right) {
    MatchJudge j;
    OmScan scan;
    OmMatchVerdict v;
    look(rig, e, &scan);
    assert_ok(om__match_judge_begin(rig->match, &j));
    assert_ok(om__match_judge(&j, &scan, is_rest, &v, right));
    om__match_judge_done(&j);
    om_scan_done(&scan);
    printf("    good %d corrected %d, %s %.4g, chi-square %.2f of %d: %s\n", v.is_good, v.is_moved,
           om_match_cause_name(v.cause), v.size, v.chi2, v.npatch, v.reason);
    return v;
}

static OmPose turned(OmPose pose, OmVec3 at, OmVec3 axis, double angle) {
    OmQuat q = om_quat_axis_angle(axis, angle);
    return (OmPose){om_add(at, om_quat_rotate(q, om_sub(pose.p, at))),
                    om_quat_normalize(om_quat_mul(q, pose.q))};
}

static void test_right(void** state) {
    (void)state;
    Rig rig;
    MatchGuess right;
    begin(&rig);
    Error e = no_error(&rig);
    OmMatchVerdict v = judge(&rig, &e, true, &right);
    assert_true(v.is_good && !v.is_moved && v.cause == OM_MATCH_FITS && v.reason[0] == 0);
    assert_true(v.chi2 < 0.5 && v.npatch > 40);
    e.lift = 0.03;  // half of it is lifted: not at rest, but the rest of it is
    v = judge(&rig, &e, false, &right);
    assert_true(v.is_good && !v.is_moved);
    v = judge(&rig, &e, true, &right);
    assert_true(!v.is_good && v.chi2 > 3);
    end(&rig);
}

// Small errors are estimated: where the corrected camera puts points against where they are.
static void test_small_errors(void** state) {
    (void)state;
    Rig rig;
    MatchGuess right;
    begin(&rig);
    Error e = no_error(&rig);
    e.pose.p.z += 0.002;  // the issue's cloud, 2 mm too high
    OmMatchVerdict v = judge(&rig, &e, true, &right);
    assert_true(v.is_good && v.is_moved && v.cause == OM_MATCH_MOVED);
    assert_near(v.shift, 0.002, 3e-4);
    assert_true(v.sigma_shift > 0 && v.chi2 > 1 && v.chi2_moved < 0.5);
    OmVec3 x = om_pose_apply(v.pose_right_scan, om_vec3(0.02, 0.01, 0.007));
    assert_near(x.z, 0.005, 2e-4);
    e = no_error(&rig);
    e.pose = turned(e.pose, om_vec3(0, 0, 0), om_vec3(0, 1, 0), 0.7 * DEG);
    v = judge(&rig, &e, true, &right);
    assert_true(v.is_good && v.is_moved);
    OmVec3 wrong =
        om_pose_apply(turned(om_pose_identity(), om_vec3(0, 0, 0), om_vec3(0, 1, 0), 0.7 * DEG),
                      om_vec3(0.05, 0, 0.005));
    assert_near(om_pose_apply(v.pose_right_scan, wrong).z, 0.005, 3e-4);
    e = no_error(&rig);
    e.focal = 1.03;
    v = judge(&rig, &e, true, &right);
    assert_true(v.is_good && v.is_moved && v.cause == OM_MATCH_FOCAL);
    assert_near(right.focal, 1.03, 0.004);
    end(&rig);
}

static void named(const Rig* rig, const Error* e, OmMatchCause cause, double size, double tol) {
    MatchGuess right;
    OmMatchVerdict v = judge(rig, e, true, &right);
    assert_false(v.is_good);
    assert_int_equal(v.cause, cause);
    assert_true(v.reason[0] != 0);
    if (size > 0) assert_near(v.size, size, tol);
}

static void test_named_causes(void** state) {
    (void)state;
    Rig rig;
    begin(&rig);
    const OmPose pose = rig.camera.pose_world_camera;
    Error e = no_error(&rig);
    e.pose = turned(pose, om_vec3(0, 0, 0), om_vec3(0.6, 0.8, 0), 5 * DEG);
    named(&rig, &e, OM_MATCH_MOVED, 5 * DEG, 0.3 * DEG);
    e = no_error(&rig);
    e.focal = 0.75;
    named(&rig, &e, OM_MATCH_FOCAL, 0.75, 0.01);
    e = no_error(&rig);
    e.scale = 1.5;
    named(&rig, &e, OM_MATCH_SCALE, 1.5, 0.01);
    e.scale = 1000;
    named(&rig, &e, OM_MATCH_SCALE, 1000, 1e-9);
    e = no_error(&rig);
    e.is_range = true;
    named(&rig, &e, OM_MATCH_RANGE, 0, 0);
    e = no_error(&rig);
    e.is_mirrored = true;
    named(&rig, &e, OM_MATCH_MIRRORED, 0, 0);
    e = no_error(&rig);
    e.pose = om_pose_inverse(pose);
    named(&rig, &e, OM_MATCH_INVERSE, 0, 0);
    e.pose = pose;
    e.pose.q = om_quat_mul(pose.q, (OmQuat){.x = 1, .y = 0, .z = 0, .w = 0});
    named(&rig, &e, OM_MATCH_OPENGL, 0, 0);
    e.pose.q = (OmQuat){.x = pose.q.w, .y = pose.q.x, .z = pose.q.y, .w = pose.q.z};
    named(&rig, &e, OM_MATCH_ORDER, 0, 0);
    end(&rig);
}

static void test_other_things(void** state) {
    (void)state;
    Rig rig;
    MatchGuess right;
    MatchJudge j;
    OmMatchVerdict v;
    OmScan ball;
    begin(&rig);
    assert_ok(om__match_judge_begin(rig.match, &j));
    assert_ok(om_scan_init(400, 0, &ball));
    for (int i = 0; i < 400; ++i) {
        double z = (i + 0.5) / 400, r = sqrt(1 - z * z), w = 2.4 * i;
        om_store3(ball.x, i, om_vec3(0.03 * r * cos(w), 0.03 * r * sin(w), 0.08 + 0.03 * z));
    }
    assert_ok(om__match_judge(&j, &ball, true, &v, &right));
    assert_true(!v.is_good && v.cause == OM_MATCH_UNKNOWN);
    assert_non_null(strstr(v.reason, "(0, 0, 95) mm"));  // the mean of its points, and of the model
    assert_non_null(strstr(v.reason, "unit, pose or axes"));
    ball.npoint = 3;
    assert_ok(om__match_judge(&j, &ball, true, &v, &right));
    assert_true(!v.is_good && v.cause == OM_MATCH_EMPTY);
    ball.npoint = 400;
    om_scan_done(&ball);
    om__match_judge_done(&j);
    for (int k = 0; k <= OM_MATCH_UNKNOWN; ++k)
        assert_non_null(om_match_cause_name((OmMatchCause)k));
    assert_null(om_match_cause_name((OmMatchCause)(OM_MATCH_UNKNOWN + 1)));
    end(&rig);
}

typedef struct Memory {
    Rig rig;
    OmScan scan;
} Memory;

static OmStatus judge_work(void* ctx) {
    Memory* m = ctx;
    MatchJudge j;
    OmMatchVerdict v;
    MatchGuess right;
    OmStatus status = om__match_judge_begin(m->rig.match, &j);
    if (status >= 0) status = om__match_judge(&j, &m->scan, true, &v, &right);
    if (status >= 0)
        status = om__match_judge_view(&j, &m->scan, om_match_view(m->rig.match)->mesh->x, &v);
    om__match_judge_done(&j);
    return status;
}

static void test_memory(void** state) {
    (void)state;
    Memory m;
    begin(&m.rig);
    Error e = no_error(&m.rig);
    e.focal = 0.75;
    look(&m.rig, &e, &m.scan);
    assert_ok(judge_work(&m));  // the shape at rest is kept
    assert_true(test_failing_allocations(judge_work, &m, test_stride(3)) > 4);
    om_scan_done(&m.scan);
    end(&m.rig);
}

// Shares of the twin's visible surface where the picture has no depth, and where it shows something else.
static void test_view(void** state) {
    (void)state;
    Memory m;
    MatchJudge j;
    OmMatchVerdict v;
    begin(&m.rig);
    const double* x = om_match_view(m.rig.match)->mesh->x;
    Error e = no_error(&m.rig);
    look(&m.rig, &e, &m.scan);
    assert_ok(om__match_judge_begin(m.rig.match, &j));
    assert_ok(om__match_judge_view(&j, &m.scan, x, &v));
    assert_true(v.empty == 0 && v.other < 0.01);
    int n = 0, nempty = 0;
    for (int i = 0; i < WIDTH * HEIGHT; ++i) {
        if (m.scan.pixel[i] != OM_SCAN_TISSUE) continue;
        ++n;
        if (i % WIDTH >= WIDTH / 2) continue;
        ++nempty;
        m.scan.pixel[i] = OM_SCAN_UNKNOWN;
        m.scan.depth[i] = 0;
    }
    assert_ok(om__match_judge_view(&j, &m.scan, x, &v));
    printf("    without depth %.3f, by pixels %.3f\n", v.empty, (double)nempty / n);
    assert_near(v.empty, (double)nempty / n, 0.05);  // pixels of two triangles count twice
    om__match_judge_done(&j);
    om_scan_done(&m.scan);
    end(&m.rig);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_right),        cmocka_unit_test(test_small_errors),
        cmocka_unit_test(test_named_causes), cmocka_unit_test(test_other_things),
        cmocka_unit_test(test_view),         cmocka_unit_test(test_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
