// test_study_match_case.c: the cases of correspondence and attachments: tables, true material points, views, files.
#include "studies/study_match_case.h"

#include <math.h>
#include <string.h>

#include "test_files.h"

enum { QUICK = MATCH_NSETUP - 1 };
static char dir[] = "/tmp/om_match_case_XXXXXX";
static MatchTruth truth;
static MatchSetup quick[2];  // the last two setups; of linear elements where a test must be quick
static const MatchSetup* setup = &quick[0];

// Distance in the plane from a grasping point to the nearest attached vertex.
static double distance_to_held(const OmSite* site, const double grasp[2]) {
    const OmMeshSet* held = om_tet_mesh_find_set(&site->mesh, "attachment");
    double best = INFINITY;
    for (int k = 0; k < held->nvert; ++k) {
        OmVec3 p = om_load3(site->mesh.x, held->vert[k]);
        best = fmin(best, hypot(p.x - grasp[0], p.y - grasp[1]));
    }
    return best;
}

static void test_layouts(void** unused) {
    (void)unused;
    int ntwo = 0;
    for (int i = 0; i < MATCH_NSET * MATCH_NLAYOUT; ++i) {
        const MatchLayout* l = &om__match_layout[i];
        MatchSetup s = om__match_layout_setup(i, 0, 20);
        OmScene scene;
        OmSite site;
        assert_true(l->layout[0] > 200 && l->lift >= 0.03 && l->lift <= 0.05);
        assert_ok(om__match_build_site(&s, BELIEF_RIGHT, OM_SITE_TWIN, &scene, &site));
        for (int g = 0; g < MATCH_NGRASP; ++g)
            assert_true(distance_to_held(&site, l->grasp[g]) >= 0.012);
        int nheld = om_tet_mesh_find_set(&site.mesh, "attachment")->nvert;
        double share = nheld / (double)om_tet_mesh_find_set(&site.mesh, "underside")->nvert;
        bool is_two = l->layout[1] > 0;
        ntwo += is_two;
        // two patches may overlap
        assert_true(share > (is_two ? 1.2 : 0.97) * l->share &&
                    share < (is_two ? 2.05 : 1.03) * l->share);
        om_site_done(&site);
        assert_ok(om__match_build_site(&s, BELIEF_NONE, OM_SITE_TWIN, &scene, &site));
        assert_int_equal(om_tet_mesh_find_set(&site.mesh, "attachment")->nvert, 0);
        om_site_done(&site);
    }
    assert_int_equal(ntwo, 2 * MATCH_NSET);
}

// The centre of a triangle that faces the camera lies on the true surface: its material point is the triangle's centre
// at rest, and is carried back to where it is.
static void test_material(void** unused) {
    (void)unused;
    const OmSurface* s = &truth.surface;
    OmVec3 eye = truth.head.camera.pose_world_camera.p;
    double worst = 0, back = 0, moved = 0;
    int n = 0;
    for (int t = 0; t < s->ntri; t += test_count(5, 1)) {
        OmVec3 now[3], rest[3];
        for (int k = 0; k < 3; ++k) {
            int v = s->tri_vert[3 * t + k];
            now[k] = om_load3(s->x, v);
            rest[k] = om_load3(truth.mesh.x, truth.vert[v]);
        }
        OmVec3 normal = om_cross(om_sub(now[1], now[0]), om_sub(now[2], now[0]));
        if (om_dot(normal, om_sub(eye, now[0])) <= 0) continue;
        double x[3], at[3], again[3], distance;
        om_store3(x, 0, om_scale(1.0 / 3, om_add(now[0], om_add(now[1], now[2]))));
        OmVec3 want = om_scale(1.0 / 3, om_add(rest[0], om_add(rest[1], rest[2])));
        assert_ok(om__match_find_material(&truth, 1, x, at, &distance));
        worst = fmax(worst, om_distance(om_load3(at, 0), want));
        moved = fmax(moved, om_distance(om_load3(x, 0), want));
        if (n++ % 50 == 0) {
            assert_ok(om__match_carry(&truth, 1, at, again));
            back = fmax(back, om_distance(om_load3(again, 0), om_load3(x, 0)));
        }
    }
    printf("%d points: material %.3g m, carried back %.3g m, moved up to %.3g m\n", n, worst, back,
           moved);
    assert_true(n > test_count(100, 500) && moved > 0.035);
    assert_near(worst, 0, 1e-9);
    assert_near(back, 0, 1e-9);
}

static int count_part(const OmObservation* obs, OmSensePart part, bool needs_depth) {
    int n = 0, npixel = obs->rgbd.camera.width * obs->rgbd.camera.height;
    for (int i = 0; i < npixel; ++i)
        n += om_sense_part_of(obs->rgbd.color.pixel + 3 * (size_t)i) == part &&
             (!needs_depth || obs->rgbd.depth[i] > 0);
    return n;
}

static void test_views(void** unused) {
    (void)unused;
    OmObservation full, near, far, bare;
    assert_ok(
        om__match_observe_way(&truth, &setup->move, VIEW_FULL, 1, false, MATCH_MAX_WAY, &full));
    assert_ok(
        om__match_observe_way(&truth, &setup->move, VIEW_FULL, 0.4, false, MATCH_MAX_WAY, &near));
    assert_ok(
        om__match_observe_way(&truth, &setup->move, VIEW_FULL, 0.4, true, MATCH_MAX_WAY, &far));
    assert_ok(
        om__match_observe_way(&truth, &setup->move, VIEW_BARE, 1, false, MATCH_MAX_WAY, &bare));
    int all = count_part(&full, OM_PART_TISSUE, true),
        kept = count_part(&near, OM_PART_TISSUE, true);
    assert_near(kept / (double)all, 0.4, 0.01);
    assert_near(count_part(&far, OM_PART_TISSUE, true) / (double)all, 0.4, 0.01);
    int nboth = 0;
    for (int i = 0; i < full.rgbd.camera.width * full.rgbd.camera.height; ++i)
        nboth += near.rgbd.depth[i] > 0 && far.rgbd.depth[i] > 0 &&
                 om_sense_part_of(full.rgbd.color.pixel + 3 * (size_t)i) == OM_PART_TISSUE;
    assert_int_equal(nboth, 0);
    assert_true(count_part(&full, OM_PART_TOOL, false) > 500);
    assert_true(count_part(&bare, OM_PART_TOOL, false) < 100);
    assert_true(count_part(&bare, OM_PART_TISSUE, true) > all);
    om_observation_done(&full);
    om_observation_done(&near);
    om_observation_done(&far);
    om_observation_done(&bare);
}

// Mean place of the tissue's pixels along x of the task, which is the world's x here.
static double mean_x(const OmObservation* obs) {
    const OmCamera* c = &obs->rgbd.camera;
    OmVec3 z = om_quat_rotate(c->pose_world_camera.q, om_vec3(0, 0, 1));
    double sum = 0;
    int n = 0;
    for (int i = 0; i < c->width * c->height; ++i) {
        double depth = (double)obs->rgbd.depth[i];
        if (!(depth > 0) ||
            om_sense_part_of(obs->rgbd.color.pixel + 3 * (size_t)i) != OM_PART_TISSUE)
            continue;
        OmVec3 ray = om_camera_ray(c, i % c->width + 0.5, i / c->width + 0.5);
        sum += c->pose_world_camera.p.x + depth / om_dot(ray, z) * ray.x;
        ++n;
    }
    assert_true(n > 100);
    return sum / n;
}

// The cut keeps the side of the grasp: of a fold, the side where the flap was.
static void test_cut(void** unused) {
    (void)unused;
    for (int k = 0; k < 2; ++k) {
        const MatchSetup* s = &quick[k];
        MatchTruth t;
        OmObservation near, far;
        bool is_new;
        assert_ok(om__match_truth_get(s, dir, 1, &is_new, &t));
        assert_true(s->move.grasp[0].x > 0.04);
        assert_ok(om__match_observe_way(&t, &s->move, VIEW_FULL, 0.3, false, MATCH_MAX_WAY, &near));
        assert_ok(om__match_observe_way(&t, &s->move, VIEW_FULL, 0.3, true, MATCH_MAX_WAY, &far));
        assert_true(mean_x(&near) > mean_x(&far) + 0.02);
        om_observation_done(&near);
        om_observation_done(&far);
        om__match_truth_done(&t);
    }
}

// Without noise depth differs from that with noise by its standard deviation, 0.2 mm and 1.5 mm z^2.
static void test_noise(void** unused) {
    (void)unused;
    int n = 0, npixel = truth.head.camera.width * truth.head.camera.height;
    double sum = 0;
    for (int i = 0; i < npixel; ++i) {
        double a = (double)truth.depth[VIEW_FULL][i], b = (double)truth.depth[VIEW_EXACT][i];
        if (!(a > 0) || !(b > 0)) continue;
        double sigma = 0.0002 + 0.0015 * b * b;
        sum += (a - b) * (a - b) / (sigma * sigma);
        ++n;
    }
    assert_true(n > 10000);
    assert_near(sum / n, 1, 0.05);
}

static void test_files_again(void** unused) {
    (void)unused;
    bool is_new;
    MatchTruth again;
    assert_ok(om__match_truth_get(setup, dir, 1, &is_new, &again));
    assert_false(is_new);
    size_t n = 3 * (size_t)truth.mesh.nvert;
    assert_memory_equal(again.x, truth.x, n * sizeof *truth.x);
    assert_memory_equal(&again.head, &truth.head, sizeof truth.head);
    om__match_truth_done(&again);
    // a file of another setup, or a damaged one, is made again
    MatchSetup other = *setup;
    other.move.shift.z = 0.01;
    assert_ok(om__match_truth_get(&other, dir, 1, &is_new, &again));
    assert_true(is_new);
    assert_true(memcmp(again.x, truth.x, n * sizeof *truth.x) != 0);
    om__match_truth_done(&again);
    if (!test_is_slow()) return;
    assert_ok(om__match_truth_get(setup, dir, 1, &is_new, &again));
    assert_true(is_new);
    // made again by one worker: the same bytes
    assert_memory_equal(again.x, truth.x, n * sizeof *truth.x);
    assert_memory_equal(again.depth[VIEW_BARE], truth.depth[VIEW_BARE], 4 * n);
    om__match_truth_done(&again);
}

// The twin with the right attachments comes near the truth, the one with none does not where tissue is held; 70 % of
// the way is between rest and the end.
static void test_twin(void** unused) {
    (void)unused;
    MatchTwin whole, part, none;
    assert_ok(om__match_twin_get(setup, BELIEF_RIGHT, &truth, 1, 1, &whole));
    assert_ok(om__match_twin_get(setup, BELIEF_RIGHT, &truth, 0.7, 1, &part));
    assert_ok(om__match_twin_get(setup, BELIEF_NONE, &truth, 1, 1, &none));
    int n = whole.site.mesh.nvert;
    double *x = om_alloc(3 * (size_t)n, sizeof *x), error = 0, wrong = 0, top = 0, top_part = 0;
    assert_ok(om__match_carry(&truth, n, whole.site.mesh.x, x));
    for (int i = 0; i < n; ++i) {
        error += om_distance(om_load3(x, i), om_load3(whole.x, i)) / n;
        assert_true(om_distance(om_load3(whole.nodes, i), om_load3(whole.x, i)) == 0);
        wrong += om_distance(om_load3(x, i), om_load3(none.x, i)) / n;
        top = fmax(top, whole.x[3 * i + 2]);
        top_part = fmax(top_part, part.x[3 * i + 2]);
    }
    printf(
        "mean error: %.2f mm with the right attachments, %.2f mm with none; height %.1f, %.1f mm\n",
        1e3 * error, 1e3 * wrong, 1e3 * top, 1e3 * top_part);
    assert_true(error < 0.002 && wrong > error);
    assert_near(top - 0.005, 0.040, 0.002);
    assert_near(top_part - 0.005, 0.028, 0.003);
    om_free(x);
    om__match_twin_done(&whole);
    om__match_twin_done(&part);
    om__match_twin_done(&none);
}

// Pictures on the way: the first of the tissue at rest before the grasp; each shows the tissue where it is kept to be.
static void test_way(void** unused) {
    (void)unused;
    static const MatchCase whole = {.name = "whole", .view = VIEW_FULL, .seen = 1};
    MatchTwin twin;
    assert_ok(om__match_twin_get(setup, BELIEF_RIGHT, &truth, 0, 1, &twin));
    OmSurface s = truth.surface;
    s.x = om_alloc(3 * (size_t)s.nvert, sizeof *s.x);
    assert_int_equal(truth.way[0].tick, 0);
    double top[2] = {0, 0}, time = -1;
    for (int k = 0; k <= truth.nway; k += k < truth.nway - 1 ? truth.nway - 1 : 1) {
        OmObservation obs;
        OmScan scan;
        OmMatchGrasp grasp[OM_MAX_ARM];
        const double* x =
            k < truth.nway ? truth.way_x + 3 * (size_t)truth.mesh.nvert * (size_t)k : truth.x;
        for (int i = 0; i < s.nvert; ++i) om_store3(s.x, i, om_load3(x, truth.vert[i]));
        assert_ok(om__match_scan_way(&truth, &twin.site, &setup->move, &whole, 0, k, &obs, &scan));
        double* rest = om_alloc(4 * (size_t)scan.npoint, sizeof *rest);
        double *distance = rest + 3 * (size_t)scan.npoint, mean = 0;
        assert_ok(om__match_find_on_surface(&s, truth.vert, truth.mesh.x,
                                            truth.head.camera.pose_world_camera.p, scan.npoint,
                                            scan.x, rest, distance));
        for (int i = 0; i < scan.npoint; ++i) mean += distance[i] / scan.npoint;
        assert_true(scan.npoint > 80);
        assert_below(mean, 5e-4);
        top[k > 0] = 0;
        for (int i = 0; i < s.nvert; ++i) top[k > 0] = fmax(top[k > 0], s.x[3 * i + 2]);
        assert_int_equal(om__match_grasps_way(&truth, &setup->move, k, grasp),
                         k > 0 ? setup->move.narm : 0);
        assert_true(obs.time > time);
        time = obs.time;
        om_free(rest);
        om_scan_done(&scan);
        om_observation_done(&obs);
    }
    assert_near(top[0], 0.005, 5e-4);
    assert_true(top[1] > 0.03);
    om_free(s.x);
    om__match_twin_done(&twin);
}

static int begin(void** unused) {
    (void)unused;
    bool is_new;
    for (int k = 0; k < 2; ++k) {
        quick[k] = om__match_setup[QUICK - k];
        if (test_is_slow()) continue;
        quick[k].element = OM_ELEMENT_LINEAR;
        quick[k].way = k ? 0 : 0.04;
        if (k) quick[k].cells = 8;
    }
    if (!mkdtemp(dir)) return 1;
    return om__match_truth_get(setup, dir, test_count(1, 2), &is_new, &truth) != OM_OK || !is_new;
}

static int end(void** unused) {
    (void)unused;
    om__match_truth_done(&truth);
    return om_path_remove(dir) == OM_OK ? 0 : 1;
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_twin),        cmocka_unit_test(test_cut),
        cmocka_unit_test(test_files_again), cmocka_unit_test(test_layouts),
        cmocka_unit_test(test_views),       cmocka_unit_test(test_material),
        cmocka_unit_test(test_noise),       cmocka_unit_test(test_way),
    };
    return cmocka_run_group_tests(test, begin, end);
}
