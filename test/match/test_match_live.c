// test_match_live.c: the material points of a scan, where the map from rest is known exactly.
#include "match_sheet.h"

#include "match/match_internal.h"
#include "omentum/match_live.h"
#include "test_alloc.h"

#define THICK 0.005
#define RADIUS 0.012  // m, of the bend

typedef struct Rig {
    OmScene scene;
    OmSite site;
    OmMatch* match;
    OmMatchLive* live;
    const OmMatchView* view;
    double* x;  // the twin
    OmScan scan;
    double* truth;  // rest positions of the scan's points
    OmMatchGrasp grasp;
    int* held;  // grasped vertices
} Rig;

static void begin(Rig* rig, int n, int npoint, int nworker) {
    memset(rig, 0, sizeof *rig);
    build_sheet(n, &rig->scene, &rig->site);
    OmMatchDef def = om_match_default_def(&rig->scene, &rig->site);
    def.nhypothesis = 0;  // no update is made here
    assert_ok(om_match_create(&def, &rig->match));
    OmMatchLiveDef how = om_match_live_default_def(rig->match);
    how.nworker = nworker;
    assert_ok(om_match_live_create(&how, &rig->live));
    rig->view = om_match_view(rig->match);
    rig->x = malloc(sizeof(double) * 3 * (size_t)rig->view->mesh->nvert);
    assert_ok(om_scan_init(npoint, 0, &rig->scan));
    rig->truth = malloc(sizeof(double) * 3 * (size_t)(npoint + 1));
}

static void end(Rig* rig) {
    om_match_live_destroy(rig->live);
    om_match_destroy(rig->match);
    om_site_done(&rig->site);
    om_scan_done(&rig->scan);
    free(rig->x);
    free(rig->truth);
    free(rig->held);
}

// Bend about the line x = 0 by `angle`: an arc of RADIUS, then a plane. Lengths of the middle surface do not change.
static OmVec3 bend(OmVec3 X, double angle, OmVec3* normal) {
    double s = fmax(X.x, 0), phi = fmin(s / RADIUS, angle), rest = s - RADIUS * phi;
    OmVec3 n = om_vec3(-sin(phi), 0, cos(phi));
    OmVec3 p = om_vec3(fmin(X.x, 0) + RADIUS * sin(phi) + rest * cos(phi), X.y,
                       0.5 * THICK + RADIUS * (1 - cos(phi)) + rest * sin(phi));
    *normal = n;
    return om_madd(p, X.z - 0.5 * THICK, n);
}

// A scan of both faces of the bent sheet, a twin that is bent less, and the tool at the edge.
static void bend_rig(Rig* rig, double angle, double twin_angle) {
    OmRng rng = om_rng_init(11, 0);
    OmVec3 n;
    for (int i = 0; i < rig->scan.npoint; ++i) {
        OmVec3 X = om_vec3(om_rng_range(&rng, -0.058, 0.058), om_rng_range(&rng, -0.058, 0.058),
                           i % 2 ? THICK : 0);
        om_store3(rig->truth, i, X);
        om_store3(rig->scan.x, i, bend(X, angle, &n));
        om_store3(rig->scan.normal, i, om_scale(i % 2 ? 1 : -1, n));
    }
    for (int v = 0; v < rig->view->mesh->nvert; ++v)
        om_store3(rig->x, v, bend(om_load3(rig->view->mesh->x, v), twin_angle, &n));
    // The tool holds a strip along the edge: a bend of constant curvature is no equilibrium of a sheet held at a point.
    int nheld = 0;
    if (!rig->held) rig->held = malloc(sizeof(int) * (size_t)rig->view->mesh->nvert);
    for (int v = 0; v < rig->view->mesh->nvert; ++v)
        if (rig->view->mesh->x[3 * v] > 0.04) rig->held[nheld++] = v;
    OmVec3 tip = om_vec3(0.06, 0, THICK);
    rig->grasp = (OmMatchGrasp){
        .nvert = nheld,
        .vert = rig->held,
        .pose_world_grasp = {tip, om_quat_identity()},
        .pose_world_now = {bend(tip, angle, &n), om_quat_axis_angle(om_vec3(0, -1, 0), angle)},
    };
}

// Keep what a camera above sees of the sheet bent by `angle`, by rays.
static void see(Rig* rig, double angle) {
    const OmCamera camera = camera_at(om_vec3(0, 0, 0.3));
    size_t npixel = (size_t)camera.width * (size_t)camera.height;
    OmSurface s;
    OmSenseScene* scene;
    OmSenseLook look = om_sense_look(OM_PART_TISSUE);
    OmVec3 n;
    int id;
    assert_ok(om_surface_init(&s, rig->view->surface->nvert, rig->view->surface->ntri));
    for (int i = 0; i < s.nvert; ++i)
        om_store3(s.x, i, bend(om_load3(rig->view->surface->x, i), angle, &n));
    memcpy(s.tri_vert, rig->view->surface->tri_vert, sizeof(int) * 3 * (size_t)s.ntri);
    float* depth = malloc(npixel * sizeof *depth);
    assert_ok(om_sense_scene_create(&scene));
    assert_ok(om_sense_scene_add(scene, &s, &look, &id));
    assert_ok(om_sense_scene_commit(scene));
    assert_ok(om_sense_depth(scene, &camera, 1, depth, NULL, NULL));
    rig->scan.has_camera = true;
    rig->scan.camera = camera;
    om_free(rig->scan.pixel);
    rig->scan.pixel = om_alloc(npixel, 1);
    for (size_t i = 0; i < npixel; ++i)
        rig->scan.pixel[i] = depth[i] > 0 ? OM_SCAN_TISSUE : OM_SCAN_OTHER;
    int kept = 0;
    for (int i = 0; i < rig->scan.npoint; ++i) {
        OmVec3 p = om_load3(rig->scan.x, i);
        double u, v, z = camera.pose_world_camera.p.z - p.z;
        if (!om_camera_project(&camera, p, &u, &v) || u < 0 || v < 0) continue;
        size_t column = (size_t)u, row = (size_t)v;
        if (column >= 320 || row >= 240 || z > (double)depth[row * 320 + column] + 1e-3) continue;
        om_store3(rig->truth, kept, om_load3(rig->truth, i));
        om_store3(rig->scan.x, kept, p);
        om_store3(rig->scan.normal, kept++, om_load3(rig->scan.normal, i));
    }
    rig->scan.npoint = kept;
    om_sense_scene_destroy(scene);
    om_surface_done(&s);
    free(depth);
}

// Errors of the pairs in the rest shape, m, sorted; their number.
static int errors_of(const Rig* rig, const OmMatchPairs* p, double* error) {
    int n = 0;
    for (int i = 0; i < p->npoint; ++i) {
        OmVec3 X = om_load3(p->x_rest, i);
        assert_int_equal(p->tri[i] >= 0, om_is_finite3(X));
        assert_int_equal(p->tri[i] >= 0, p->weight[i] > 0);
        if (p->tri[i] < 0) continue;
        const int* v = rig->view->surface->tri_vert + 3 * p->tri[i];
        OmVec3 q = om_vec3(0, 0, 0);
        for (int k = 0; k < 3; ++k)
            q = om_madd(q, p->bary[3 * i + k], om_load3(rig->view->surface->x, v[k]));
        assert_near(om_distance(q, X), 0, 1e-12);
        error[n++] = om_distance(X, om_load3(rig->truth, i));
    }
    om_sort_doubles(error, n);
    return n;
}

static void check(Rig* rig, double median, double p90) {
    OmMatchPairs p;
    double* error = malloc(sizeof *error * (size_t)rig->scan.npoint);
    assert_ok(om_match_find_pairs(rig->live, &rig->scan, 1, &rig->grasp, rig->x, &p));
    int n = errors_of(rig, &p, error);
    assert_false(p.is_lost);
    assert_string_equal(p.reason, "");
    assert_true(n >= 0.98 * p.npoint);
    assert_below(error[n / 2], median);
    assert_below(error[9 * n / 10], p90);
    om_match_pairs_done(&p);
    free(error);
}

// A sheet without attachments that the tool carries along: the map is a motion, and the twin has not moved yet.
static void test_rigid_motion(void** state) {
    (void)state;
    Rig rig;
    begin(&rig, 8, 800, 1);
    om_match_live_set_attached(rig.live, NULL);
    bend_rig(&rig, 0, 0);
    rig.grasp.radius = 0.2;  // all of it
    rig.grasp.vert = NULL;
    OmPose motion = {om_vec3(0.004, -0.006, 0.02), om_quat_axis_angle(om_vec3(0, 0.6, 0.8), 0.2)};
    rig.grasp.pose_world_now = om_pose_mul(motion, rig.grasp.pose_world_grasp);
    for (int i = 0; i < rig.scan.npoint; ++i) {
        om_store3(rig.scan.x, i, om_pose_apply(motion, om_load3(rig.scan.x, i)));
        om_store3(rig.scan.normal, i, om_quat_rotate(motion.q, om_load3(rig.scan.normal, i)));
    }
    check(&rig, 1e-5, 1e-4);  // what the springs of the scan and the tool leave
    end(&rig);
}

static void test_bend(void** state) {
    (void)state;
    Rig rig;
    begin(&rig, 16, 1000, 1);
    bend_rig(&rig, 1.2, 0.7 * 1.2);
    check(&rig, 1e-3, 2e-3);
    see(&rig, 1.2);
    assert_true(rig.scan.npoint > 250 && rig.scan.npoint < 500);
    check(&rig, 1e-3, 2e-3);
    for (int i = 0; i < rig.scan.npoint; i += 2)  // a normal is not known everywhere
        om_store3(rig.scan.normal, i, om_vec3(0, 0, 0));
    check(&rig, 1e-3, 2e-3);
    end(&rig);
}

// The underside, seen 4 mm higher than the twin believes: the top is nearer, but its normal is another.
static void test_sides(void** state) {
    (void)state;
    Rig rig;
    begin(&rig, 8, 400, 1);
    om_match_live_set_attached(rig.live, NULL);
    bend_rig(&rig, 0, 0);
    for (int i = 0; i < rig.scan.npoint; ++i) {
        rig.scan.x[3 * i + 2] = 0.8 * THICK;
        rig.scan.normal[3 * i + 2] = -1;
        rig.truth[3 * i + 2] = 0;
    }
    rig.grasp.pose_world_now.p.z += 0.8 * THICK;
    OmMatchPairs p;
    assert_ok(om_match_find_pairs(rig.live, &rig.scan, 1, &rig.grasp, rig.x, &p));
    for (int i = 0; i < p.npoint; ++i) {
        assert_true(p.tri[i] >= 0);
        assert_near(p.x_rest[3 * i + 2], 0, 1e-12);
        assert_near(p.x[3 * rig.view->surface_vert[0] + 2],
                    rig.x[3 * rig.view->surface_vert[0] + 2] + 0.8 * THICK, 5e-4);
    }
    om_match_pairs_done(&p);
    end(&rig);
}

// The twin has been pulled away as a whole, because it believes in no attachment.
static void test_restart(void** state) {
    (void)state;
    Rig rig;
    begin(&rig, 16, 1000, 1);
    om_match_live_set_attached(rig.live, NULL);
    bend_rig(&rig, 1.2, 1);
    for (int v = 0; v < rig.view->mesh->nvert; ++v)
        om_store3(rig.x, v, om_add(om_load3(rig.view->mesh->x, v), om_vec3(0, 0.09, 0.05)));
    see(&rig, 1.2);
    check(&rig, 1e-3, 2e-3);
    OmMatchPairs p;
    assert_ok(om_match_find_pairs(rig.live, &rig.scan, 1, &rig.grasp, rig.x, &p));
    assert_true(p.is_restarted);
    om_match_pairs_done(&p);
    end(&rig);
}

// ---- lost ------------------------------------------------------------------------------------------------------

static void check_lost(Rig* rig, const char* why) {
    OmMatchPairs p;
    assert_ok(om_match_find_pairs(rig->live, &rig->scan, 1, &rig->grasp, rig->x, &p));
    assert_true(p.is_lost);
    if (!strstr(p.reason, why)) fail_msg("\"%s\" does not say \"%s\"", p.reason, why);
    for (int i = 0; i < 3 * p.nvert; ++i) assert_true(isfinite(p.x[i]));
    om_match_pairs_done(&p);
    assert_null(p.x);
}

static void test_lost(void** state) {
    (void)state;
    Rig rig;
    begin(&rig, 8, 400, 1);
    bend_rig(&rig, 0.5, 0.4);
    int npoint = rig.scan.npoint;
    rig.scan.npoint = 0;
    check_lost(&rig, "no point");
    rig.scan.npoint = 10;
    check_lost(&rig, "20 are needed");
    rig.scan.npoint = npoint;
    for (int i = 0; i < npoint; ++i) rig.scan.x[3 * i] += 0.3;  // another place
    check_lost(&rig, "no point");
    for (int i = 0; i < npoint; ++i) rig.scan.x[3 * i] -= 0.3;
    for (int i = 0; i < npoint / 2; ++i) rig.scan.x[3 * i] += 0.3;
    check_lost(&rig, "50 % of the scan's points");
    for (int i = 0; i < npoint / 2; ++i) rig.scan.x[3 * i] -= 0.3;
    OmRng rng = om_rng_init(5, 0);  // a cloud of another shape around the same place
    for (int i = 0; i < npoint; ++i)
        om_store3(rig.scan.x, i,
                  om_vec3(om_rng_range(&rng, -0.06, 0.06), om_rng_range(&rng, -0.06, 0.06),
                          om_rng_range(&rng, -0.025, 0.03)));
    check_lost(&rig, "mm from the deformed twin");
    end(&rig);
}

// A tool before the whole picture, a picture of the board alone, and a cloth before the tissue.
static void test_hidden(void** state) {
    (void)state;
    Rig rig;
    begin(&rig, 8, 400, 1);
    bend_rig(&rig, 0, 0);
    rig.scan.has_camera = true;
    rig.scan.camera = camera_at(om_vec3(0, 0, 0.3));
    size_t npixel = 320 * 240;
    rig.scan.pixel = om_alloc(npixel, 1);
    memset(rig.scan.pixel, OM_SCAN_TOOL, npixel);
    check_lost(&rig, "no point");
    for (int i = 0; i < rig.scan.npoint; ++i)
        rig.scan.x[3 * i + 2] = THICK, rig.scan.normal[3 * i + 2] = 1;
    memset(rig.scan.pixel, OM_SCAN_OTHER, npixel);
    check_lost(&rig, "no tissue in 100 %");
    rig.scan.depth = om_alloc(npixel, sizeof *rig.scan.depth);
    for (size_t i = 0; i < npixel; ++i) rig.scan.depth[i] = 5;  // the board, behind
    check_lost(&rig, "no tissue in 100 %");
    for (size_t i = 0; i < npixel; ++i) rig.scan.depth[i] = 0.01F;  // a cloth hides all, as a tool
    check_lost(&rig, "no point");
    memset(rig.scan.pixel, OM_SCAN_TISSUE, npixel);
    OmMatchPairs p;
    assert_ok(om_match_find_pairs(rig.live, &rig.scan, 1, &rig.grasp, rig.x, &p));
    assert_false(p.is_lost);
    assert_true(p.empty == 0);
    om_match_pairs_done(&p);
    end(&rig);
}

// Above a sheet with a wall on its right half: the camera sees the top, not the underside, and not the floor that the
// wall hides.
static void test_visible(void** state) {
    (void)state;
    Rig rig;
    begin(&rig, 16, 0, 1);
    bend_rig(&rig, 3, 3);  // folded over: the right part lies above the left one
    rig.scan.has_camera = true;
    rig.scan.camera = camera_at(om_vec3(0, 0, 0.3));
    const OmSurface* s = rig.view->surface;
    double* xs = malloc(sizeof *xs * 3 * (size_t)s->nvert);
    unsigned char* use = malloc((size_t)s->ntri);
    for (int i = 0; i < s->nvert; ++i) om_store3(xs, i, om_load3(rig.x, rig.view->surface_vert[i]));
    MatchBuffer buffer;
    assert_ok(om__match_buffer_init(&rig.scan, s->nvert, &buffer));
    om__match_mark_visible(&buffer, s, xs, 1e-3, use);
    int nseen = 0;
    for (int t = 0; t < s->ntri; ++t) {
        OmVec3 X = om_vec3(0, 0, 0);
        for (int k = 0; k < 3; ++k) X = om_madd(X, 1.0 / 3, om_load3(s->x, s->tri_vert[3 * t + k]));
        bool is_top = X.z > THICK - 1e-9, is_under = X.z < 1e-9, is_left = X.x < -0.03;
        bool is_flap = X.x > 0.045 && X.x < 0.058;  // above x of -28 to -1 mm
        if (is_top && is_left) assert_true(use[t]);
        if (is_under && X.x < 0) assert_false(use[t]);
        if (is_flap && is_under) assert_true(use[t]);
        if (is_flap && is_top) assert_false(use[t]);
        if (is_top && X.x < -0.002 && X.x > -0.012) assert_false(use[t]);  // below the flap
        nseen += use[t];
    }
    assert_true(nseen > 0 && buffer.ntissue == 0 && buffer.nother == 0);
    om__match_buffer_done(&buffer);
    free(xs);
    free(use);
    end(&rig);
}

// The twin follows the tool in steps: none where it is there already, all of them where it is far behind.
static void test_follow_step(void** state) {
    (void)state;
    for (int far = 0; far < 2; ++far) {
        double* x[2];
        size_t size = 0;
        for (int k = 0; k < 2; ++k) {
            Rig rig;
            OmMatchPairs p;
            begin(&rig, 8, 400, 1);
            OmMatchLiveDef def = om_match_live_default_def(rig.match);
            if (!k) def.follow_step = 0;
            if (!k && !far) def.nfollow = 0;
            om_match_live_destroy(rig.live);
            assert_ok(om_match_live_create(&def, &rig.live));
            bend_rig(&rig, 1.2, far ? 0.1 : 1.2);
            assert_ok(om_match_find_pairs(rig.live, &rig.scan, 1, &rig.grasp, rig.x, &p));
            size = sizeof *p.x * 3 * (size_t)p.nvert;
            x[k] = malloc(size);
            memcpy(x[k], p.x, size);
            om_match_pairs_done(&p);
            end(&rig);
        }
        assert_memory_equal(x[0], x[1], size);
        free(x[0]);
        free(x[1]);
    }
}

// ---- the rest --------------------------------------------------------------------------------------------------

static void test_workers(void** state) {
    (void)state;
    double* x[2];
    size_t size = 0;
    for (int k = 0; k < 2; ++k) {
        Rig rig;
        begin(&rig, 8, 500, 1 + k);
        bend_rig(&rig, 1.2, 0.8);
        OmMatchPairs p;
        for (int run = k; run < 2;
             ++run) {  // an earlier call, of another shape, leaves nothing behind
            bend_rig(&rig, 1.2, run == 0 ? 1.1 : 0.8);
            assert_ok(om_match_find_pairs(rig.live, &rig.scan, 1, &rig.grasp, rig.x, &p));
            if (run == 0) om_match_pairs_done(&p);
        }
        size = sizeof *p.x * 3 * (size_t)p.nvert;
        x[k] = malloc(size);
        memcpy(x[k], p.x, size);
        om_match_pairs_done(&p);
        end(&rig);
    }
    assert_memory_equal(x[0], x[1], size);
    free(x[0]);
    free(x[1]);
}

static void test_displacement(void** state) {
    (void)state;
    Rig rig;
    begin(&rig, 8, 400, 1);
    bend_rig(&rig, 0, 0);
    for (int i = 0; i < rig.scan.npoint; ++i)  // one corner is seen
        for (int k = 0; k < 2; ++k) rig.scan.x[3 * i + k] = 0.03 + 0.4 * rig.scan.x[3 * i + k];
    OmMatchPairs p;
    assert_ok(om_match_find_pairs(rig.live, &rig.scan, 1, &rig.grasp, rig.x, &p));
    int n = rig.view->surface->nvert;
    double *u = malloc(sizeof *u * 3 * (size_t)n), *seen = malloc(sizeof *seen * (size_t)n),
           sum = 0;
    om_match_pairs_displacement(rig.view, &p, u, seen);
    for (int i = 0; i < n; ++i) {
        OmVec3 X = om_load3(rig.view->surface->x, i);
        assert_below(om_norm(om_load3(u, i)), 4e-4);  // the body sinks by its weight
        if (X.x < -0.01 || X.y < -0.01) assert_true(seen[i] == 0);
        sum += seen[i];
    }
    double weights = 0;
    for (int i = 0; i < p.npoint; ++i) weights += p.weight[i];
    assert_near(sum, weights, 1e-9);
    om_match_pairs_displacement(rig.view, &p, u, NULL);
    om_match_pairs_done(&p);
    free(u);
    free(seen);
    end(&rig);
}

static OmStatus make_and_find(void* ctx) {
    Rig* rig = ctx;
    OmMatchLive* live;
    OmMatchPairs p = {0};
    OmMatchLiveDef def = om_match_live_default_def(rig->match);
    OM_TRY(om_match_live_create(&def, &live));
    OmStatus status = om_match_find_pairs(live, &rig->scan, 1, &rig->grasp, rig->x, &p);
    om_match_pairs_done(&p);
    om_match_live_destroy(live);
    return status;
}

static void test_bad_input_and_memory(void** state) {
    (void)state;
    Rig rig;
    begin(&rig, 4, 50, 1);
    bend_rig(&rig, 0.3, 0.2);
    assert_true(test_failing_allocations(make_and_find, &rig, 1) > 20);
    OmMatchLive* live;
    OmMatchLiveDef def = om_match_live_default_def(rig.match);
    def.nfit = 0;
    assert_status(om_match_live_create(&def, &live), OM_INVALID);
    assert_null(live);
    def = om_match_live_default_def(NULL);
    assert_status(om_match_live_create(&def, &live), OM_INVALID);
    OmMatchPairs p;
    rig.x[7] = (double)NAN;
    assert_status(om_match_find_pairs(rig.live, &rig.scan, 1, &rig.grasp, rig.x, &p), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "vertex 2"));
    rig.x[7] = 0;
    rig.grasp.radius = 1e-6;
    rig.grasp.vert = NULL;
    rig.grasp.pose_world_grasp.p.x = 1;
    assert_status(om_match_find_pairs(rig.live, &rig.scan, 1, &rig.grasp, rig.x, &p), OM_INVALID);
    assert_null(p.x);
    end(&rig);
    om_match_live_destroy(NULL);
    om_match_pairs_done(NULL);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rigid_motion),
        cmocka_unit_test(test_bend),
        cmocka_unit_test(test_sides),
        cmocka_unit_test(test_restart),
        cmocka_unit_test(test_lost),
        cmocka_unit_test(test_hidden),
        cmocka_unit_test(test_visible),
        cmocka_unit_test(test_workers),
        cmocka_unit_test(test_displacement),
        cmocka_unit_test(test_follow_step),
        cmocka_unit_test(test_bad_input_and_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
