// test_match_track.c: material points followed through pictures of a sheet whose motion is known exactly.
#include "match_sheet.h"
#include "omentum/match_track.h"
#include "omentum/scan_picture.h"
#include "test_alloc.h"

#define THICK 0.005
#define MM 1e-3

typedef struct Rig {
    OmScene scene;
    OmSite site;
    OmMatch* match;
    OmMatchLive* live;
    OmMatchTracker* tracker;
    const OmMatchView* view;
    OmSenseScene* sense;
    int tissue;
    OmCamera camera;
    double* x;  // where the sheet is          (nvert x 3)
    OmScan scan;
    OmPicture color;
} Rig;

static void add_sheet_and_board(Rig* r) {
    OmSenseLook look = om_sense_look(OM_PART_TISSUE), wood = om_sense_look(OM_PART_BOARD);
    OmSurface board;
    int id;
    assert_ok(om_sense_scene_create(&r->sense));
    assert_ok(om_sense_scene_add(r->sense, r->view->surface, &look, &r->tissue));
    assert_ok(om_surface_init(&board, 4, 2));
    for (int i = 0; i < 4; ++i)
        om_store3(board.x, i, om_vec3(i % 3 ? 0.3 : -0.3, i > 1 ? 0.3 : -0.3, -1e-4));
    memcpy(board.tri_vert, (int[6]){0, 1, 2, 0, 2, 3}, 6 * sizeof(int));
    assert_ok(om_sense_scene_add(r->sense, &board, &wood, &id));
    om_surface_done(&board);
}

static void begin(Rig* r, int n) {
    memset(r, 0, sizeof *r);
    build_sheet(n, &r->scene, &r->site);
    OmMatchDef def = om_match_default_def(&r->scene, &r->site);
    def.nhypothesis = 0;  // no update is made here
    assert_ok(om_match_create(&def, &r->match));
    OmMatchLiveDef how = om_match_live_default_def(r->match);
    assert_ok(om_match_live_create(&how, &r->live));
    OmMatchTrackerDef follow = om_match_tracker_default_def(r->match);
    assert_ok(om_match_tracker_create(&follow, &r->tracker));
    r->view = om_match_view(r->match);
    r->camera = camera_at(om_vec3(0.06, 0, 0.29));
    size_t nx = 3 * (size_t)r->view->mesh->nvert;
    r->x = malloc(sizeof(double) * nx);
    memcpy(r->x, r->view->mesh->x, sizeof(double) * nx);
    assert_ok(om_picture_init(&r->color, r->camera.width, r->camera.height, 3));
    add_sheet_and_board(r);
}

static void end(Rig* r) {
    om_match_tracker_destroy(r->tracker);
    om_match_live_destroy(r->live);
    om_match_destroy(r->match);
    om_site_done(&r->site);
    om_sense_scene_destroy(r->sense);
    om_scan_done(&r->scan);
    om_picture_done(&r->color);
    free(r->x);
}

// A motion of the sheet: a shift that grows from `left` at its left border to `right` at its right one.
static OmVec3 moved(OmVec3 X, OmVec3 left, OmVec3 right) {
    double share = fmax(0, fmin(1, (X.x + 0.06) / 0.12));
    return om_add(X, om_madd(om_scale(1 - share, left), share, right));
}

static void move(Rig* r, OmVec3 left, OmVec3 right) {
    for (int v = 0; v < r->view->mesh->nvert; ++v)
        om_store3(r->x, v, moved(om_load3(r->view->mesh->x, v), left, right));
}

// The scan of the sheet at r->x, with the noise of the world's depth camera.
static void look(Rig* r, uint64_t frame) {
    size_t npixel = (size_t)r->camera.width * (size_t)r->camera.height;
    float *depth = malloc(sizeof *depth * npixel), *normal = malloc(sizeof *normal * 3 * npixel);
    om_sense_scene_update(r->sense, r->tissue, r->x, r->view->surface_vert);
    assert_ok(om_sense_scene_commit(r->sense));
    assert_ok(om_sense_depth(r->sense, &r->camera, 1, depth, NULL, normal));
    OmDepthNoise noise = om_depth_noise_default(3);
    noise.nworker = 1;
    om_depth_add_noise(&noise, &r->camera, frame, normal, depth);
    OmSenseOptions options = om_sense_options_default();
    options.nworker = 1;
    assert_ok(om_sense_render(r->sense, &r->camera, &options, &r->color));
    OmScanDef def = om_scan_default_def(0.005);
    OmScanField field = {.pose_task_world = om_pose_identity(),
                         .lo = {-0.12, -0.12, -0.06},
                         .hi = {0.12, 0.12, 0.06},
                         .has_ground = true,
                         .clearance = 0.002,
                         .tool_margin = 0.002};
    OmDepthPicture picture = {.camera = r->camera, .depth = depth, .color = r->color};
    om_scan_done(&r->scan);
    assert_ok(om_scan_from_picture(&def, &field, &picture, &r->scan));
    free(depth);
    free(normal);
}

// Follow the present picture and register from the rest shape, with or without tracks; adopt.
static int step(Rig* r, bool uses, OmMatchPairs* pairs) {
    OmMatchTracks tracks;
    assert_ok(om_match_tracker_follow(r->tracker, &r->scan, &r->color, &tracks));
    assert_ok(om_match_find_pairs_with(r->live, &r->scan, 0, NULL, r->view->mesh->x,
                                       uses ? &tracks : NULL, pairs));
    assert_false(pairs->is_lost);
    assert_ok(om_match_tracker_adopt(r->tracker, pairs));
    return tracks.n;
}

// Error of the displacement along the board, m: median over the vertices of the underside, away from the border.
static double error_of(const Rig* r, const OmMatchPairs* p, double* shift) {
    double* error = malloc(sizeof *error * (size_t)p->nvert);
    int n = 0;
    *shift = 0;
    for (int v = 0; v < p->nvert; ++v) {
        OmVec3 X = om_load3(r->view->mesh->x, v);
        if (X.z > 1e-9 || fabs(X.x) > 0.045 || fabs(X.y) > 0.045) continue;
        OmVec3 e = om_sub(om_load3(p->x, v), om_load3(r->x, v));
        *shift += om_load3(p->x, v).y - X.y;
        error[n++] = hypot(e.x, e.y);
    }
    assert_true(n > 10);
    *shift /= n;
    om_sort_doubles(error, n);
    double median = error[n / 2];
    free(error);
    return median;
}

// A sheet that slides along the board, which the twin believes held: distances are blind, tracks are not.
static void test_slide(void** state) {
    (void)state;
    static const double slide[] = {0, 0.2 * MM, 1 * MM};
    for (int k = 0; k < 3; ++k) {
        Rig r;
        OmMatchPairs pairs;
        double shift, blind, error;
        begin(&r, 12);
        om_match_live_set_attached(r.live, NULL);
        look(&r, 0);
        step(&r, true, &pairs);
        om_match_pairs_done(&pairs);
        for (int i = 1; i <= 3; ++i) {
            double y = slide[k] * i / 3;
            move(&r, om_vec3(0, y, 0), om_vec3(0, y, 0));
            look(&r, (uint64_t)i);
            if (i < 3) {
                step(&r, true, &pairs);
                om_match_pairs_done(&pairs);
            }
        }
        assert_ok(om_match_find_pairs(r.live, &r.scan, 0, NULL, r.view->mesh->x, &pairs));
        blind = error_of(&r, &pairs, &shift);
        om_match_pairs_done(&pairs);
        int n = step(&r, true, &pairs);
        error = error_of(&r, &pairs, &shift);
        printf("slid %.1f mm: %d tracks, %.3f mm seen, error %.3f mm, without tracks %.3f mm\n",
               1e3 * slide[k], n, 1e3 * shift, 1e3 * error, 1e3 * blind);
        om_match_pairs_done(&pairs);
        assert_true(n > 100);
        assert_below(error, 0.3 * MM);
        end(&r);
    }
}

// Places of tracks against the sheet that was drawn: their material points, where they are, and the covariance.
static void test_places(void** state) {
    (void)state;
    Rig r;
    OmMatchPairs pairs;
    OmMatchTracks tracks;
    begin(&r, 12);
    OmMatchTrackerDef def = om_match_tracker_default_def(r.match);
    // Windows of a drawn texture are off by 0.2 pixels, more than by their noise.
    def.anchor = 0.25 * MM;
    om_match_tracker_destroy(r.tracker);
    assert_ok(om_match_tracker_create(&def, &r.tracker));
    look(&r, 0);
    assert_int_equal(step(&r, true, &pairs), 0);
    om_match_pairs_done(&pairs);
    const OmVec3 left = {0, 0, 0}, right = {0.7e-3, -0.4e-3, 1.2e-3};
    move(&r, left, right);
    look(&r, 1);
    assert_ok(om_match_tracker_follow(r.tracker, &r.scan, &r.color, &tracks));
    double *error = malloc(sizeof *error * (size_t)(tracks.n + 1)), sum = 0;
    for (int i = 0; i < tracks.n; ++i) {
        const OmMatchTrack* t = &tracks.track[i];
        OmVec3 q = om_vec3(0, 0, 0);
        for (int k = 0; k < 3; ++k) {
            int v = r.view->surface->tri_vert[3 * t->tri + k];
            q = om_madd(q, t->bary[k], om_load3(r.view->surface->x, v));
        }
        OmVec3 e = om_sub(t->x, moved(q, left, right));
        error[i] = om_norm(e);
        OmMat3 inverse;
        assert_ok(om_mat3_inverse(t->covariance, &inverse));
        sum += fmin(50, om_dot(e, om_mat3_apply(inverse, e)));
        assert_near(t->bary[0] + t->bary[1] + t->bary[2], 1, 1e-9);
    }
    om_sort_doubles(error, tracks.n);
    printf("%d tracks, errors of places: median %.3f mm, 90 %% %.3f mm; mean of chi-square %.2f\n",
           tracks.n, 1e3 * error[tracks.n / 2], 1e3 * error[9 * tracks.n / 10], sum / tracks.n);
    assert_true(tracks.n > 150);
    assert_below(error[tracks.n / 2], 0.2 * MM);
    assert_below(error[9 * tracks.n / 10], 0.4 * MM);
    assert_true(sum / tracks.n > 0.5 && sum / tracks.n < 6);  // 3 where all noise is white
    free(error);
    end(&r);
}

// Tracks that are wrong lose their weight; a track on a pixel that is no tissue, or has no depth, ends.
static void test_outliers(void** state) {
    (void)state;
    Rig r;
    OmMatchPairs pairs, again;
    OmMatchTracks tracks;
    begin(&r, 8);
    look(&r, 0);
    step(&r, true, &pairs);
    om_match_pairs_done(&pairs);
    assert_ok(om_match_tracker_follow(r.tracker, &r.scan, &r.color, &tracks));
    int n = tracks.n;
    assert_true(n > 100);
    assert_ok(om_match_find_pairs_with(r.live, &r.scan, 0, NULL, r.x, &tracks, &pairs));
    assert_below(pairs.track_median, 0.2 * MM);
    OmMatchTrack* wrong = malloc(sizeof *wrong * (size_t)n);
    memcpy(wrong, tracks.track, sizeof *wrong * (size_t)n);
    for (int i = 0; i < n; i += 5) wrong[i].x.x += 0.02;
    OmMatchTracks some = {n, wrong};
    assert_ok(om_match_find_pairs_with(r.live, &r.scan, 0, NULL, r.x, &some, &again));
    double far = 0;
    for (int v = 0; v < pairs.nvert; ++v)
        far = fmax(far, om_distance(om_load3(pairs.x, v), om_load3(again.x, v)));
    printf("a fifth of %d tracks 20 mm off moves the twin by %.3f mm\n", n, 1e3 * far);
    assert_below(far, 0.2 * MM);
    free(wrong);
    om_match_pairs_done(&again);
    // The left half of the picture is a tool, the upper quarter has no depth.
    int w = r.camera.width, h = r.camera.height, nleft = 0;
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
            if (x < w / 2) r.scan.pixel[y * w + x] = OM_SCAN_TOOL;
            if (y < h / 4) r.scan.depth[y * w + x] = 0;
        }
    assert_ok(om_match_tracker_follow(r.tracker, &r.scan, &r.color, &tracks));
    for (int i = 0; i < tracks.n; ++i) {
        double u, v;
        assert_true(om_camera_project(&r.camera, tracks.track[i].x, &u, &v));
        assert_true(u >= w / 2 - 1 && v >= h / 4 - 1);
        ++nleft;
    }
    assert_true(nleft > 20 && nleft < 0.7 * n);
    om_match_pairs_done(&pairs);
    end(&r);
}

// Without tracks the result is that of om_match_find_pairs, byte for byte.
static void test_none(void** state) {
    (void)state;
    Rig r;
    OmMatchPairs a, b;
    begin(&r, 6);
    move(&r, om_vec3(0, 0, 0), om_vec3(0, 0, 2e-3));
    look(&r, 0);
    OmMatchTracks none = {0, NULL};
    assert_ok(om_match_find_pairs(r.live, &r.scan, 0, NULL, r.view->mesh->x, &a));
    for (int k = 0; k < 2; ++k) {
        assert_ok(om_match_find_pairs_with(r.live, &r.scan, 0, NULL, r.view->mesh->x,
                                           k ? &none : NULL, &b));
        assert_memory_equal(a.x, b.x, sizeof *a.x * 3 * (size_t)a.nvert);
        assert_memory_equal(a.tri, b.tri, sizeof *a.tri * (size_t)a.npoint);
        assert_near(b.track_median + b.track_p90, 0, 0);
        om_match_pairs_done(&b);
    }
    om_match_pairs_done(&a);
    end(&r);
}

static void assert_refused(OmStatus status, const char* why) {
    assert_status(status, OM_INVALID);
    if (!strstr(om_error_message(), why))
        fail_msg("\"%s\" and not \"%s\"", om_error_message(), why);
}

static OmStatus follow_and_adopt(void* ctx) {
    Rig* r = ctx;
    OmMatchTrackerDef def = om_match_tracker_default_def(r->match);
    OmMatchTracker* tracker;
    OmMatchTracks tracks;
    OmMatchPairs pairs = {.nvert = r->view->mesh->nvert, .x = r->x};
    OM_TRY(om_match_tracker_create(&def, &tracker));
    OmStatus status = OM_OK;
    for (int k = 0; k < 2 && status == OM_OK; ++k) {
        status = om_match_tracker_follow(tracker, &r->scan, &r->color, &tracks);
        if (status == OM_OK) status = om_match_tracker_adopt(tracker, &pairs);
    }
    om_match_tracker_destroy(tracker);
    return status;
}

static void test_bad_input_and_memory(void** state) {
    (void)state;
    Rig r;
    OmMatchTracks tracks;
    begin(&r, 4);
    look(&r, 0);
    assert_true(test_failing_allocations(follow_and_adopt, &r, 1) > 15);
    OmMatchPairs pairs = {.nvert = r.view->mesh->nvert, .x = r.x};
    assert_refused(om_match_tracker_adopt(r.tracker, &pairs), "no picture was followed");
    assert_ok(om_match_tracker_follow(r.tracker, &r.scan, &r.color, &tracks));
    pairs.nvert = 5;
    assert_refused(om_match_tracker_adopt(r.tracker, &pairs), "5 vertices");
    // A lost registration finds nothing.
    pairs = (OmMatchPairs){.nvert = r.view->mesh->nvert, .x = r.x, .is_lost = true};
    assert_ok(om_match_tracker_adopt(r.tracker, &pairs));
    assert_ok(om_match_tracker_follow(r.tracker, &r.scan, &r.color, &tracks));
    assert_int_equal(tracks.n, 0);
    OmPicture small;
    assert_ok(om_picture_init(&small, 100, 80, 3));
    assert_refused(om_match_tracker_follow(r.tracker, &r.scan, &small, &tracks), "100 x 80");
    om_picture_done(&small);
    r.scan.has_camera = false;
    assert_refused(om_match_tracker_follow(r.tracker, &r.scan, &r.color, &tracks), "camera");
    r.scan.has_camera = true;
    OmMatchTrackerDef def = om_match_tracker_default_def(r.match);
    OmMatchTracker* tracker;
    def.max = 0;
    assert_refused(om_match_tracker_create(&def, &tracker), "max is 0");
    assert_null(tracker);
    def = om_match_tracker_default_def(r.match);
    def.track.radius = 99;
    assert_refused(om_match_tracker_create(&def, &tracker), "radius 99");
    OmMatchTrack track = {.tri = 100000};
    OmMatchTracks one = {1, &track};
    assert_refused(om_match_find_pairs_with(r.live, &r.scan, 0, NULL, r.x, &one, &pairs),
                   "triangle 100000");
    track = (OmMatchTrack){.bary = {1, 0, 0}, .x = {(double)NAN, 0, 0}};
    assert_refused(om_match_find_pairs_with(r.live, &r.scan, 0, NULL, r.x, &one, &pairs),
                   "track 0");
    end(&r);
    om_match_tracker_destroy(NULL);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_slide),
        cmocka_unit_test(test_places),
        cmocka_unit_test(test_outliers),
        cmocka_unit_test(test_none),
        cmocka_unit_test(test_bad_input_and_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
