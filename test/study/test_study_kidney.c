// test_study_kidney.c: fat over the kidney: its shape, attachments before and after dissection, a lift and its views.
#include "studies/study_kidney_case.h"
#include "studies/study_match_case.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "omentum/body.h"
#include "test_files.h"

static char dir[] = "/tmp/om_kidney_XXXXXX";
static OmScene scene;
static OmSite twin;

static void make_scene(void) {
    if (twin.mesh.nvert) return;
    assert_ok(om__kidney_make_scene(test_data("ct_abdomen/labels.nii.gz"), true, &scene));
    assert_ok(om__kidney_build_site(&scene, OM_SITE_TWIN, -1, &twin));
}

static void test_without_data(void** unused) {
    (void)unused;
    OmScene s;
    assert_status(om__kidney_make_scene("/no/such/file.nii.gz", true, &s), OM_UNAVAILABLE);
    assert_non_null(strstr(om_error_message(), "/no/such/file.nii.gz"));
}

// Each stage of dissection frees a part of what was attached, and no more.
static void test_stages(void** unused) {
    (void)unused;
    int count[KIDNEY_NSTATE] = {0};
    for (int i = -45; i <= 45; ++i) {
        for (int j = -45; j <= 45; ++j) {
            OmVec3 p = om_vec3(1e-3 * i, 1e-3 * j, 0.01);
            for (int s = 0; s < KIDNEY_NSTATE; ++s) {
                bool is_in = om__kidney_is_attached(s, p);
                count[s] += is_in;
                if (s > 0 && is_in) assert_true(om__kidney_is_attached(s - 1, p));
            }
        }
    }
    assert_near(count[0], OM_PI * 17 * 23, 20);  // mm^2, the ellipse
    for (int s = 1; s < KIDNEY_NSTATE; ++s) {
        assert_true(count[s] < 0.8 * count[s - 1]);
        assert_true(count[s] > 0.4 * count[s - 1]);
    }
    for (int g = 0; g < KIDNEY_NGRASP; ++g) {  // the jaw closes beside what is attached
        const double* at = om__kidney_grasp[g];
        for (int k = 0; k < 16; ++k) {
            double a = k * OM_PI / 8;
            OmVec3 p = om_vec3(at[0] + 0.006 * cos(a), at[1] + 0.006 * sin(a), 0);
            assert_false(om__kidney_is_attached(0, p));
        }
    }
}

static int compare(const void* a, const void* b) {
    double x = *(const double*)a, y = *(const double*)b;
    return (x > y) - (x < y);
}

static void test_shape(void** unused) {
    (void)unused;
    make_scene();
    const char* const name[] = {"underside", "top"};
    double median[2];
    for (int k = 0; k < 2; ++k) {
        const OmMeshSet* set = om_tet_mesh_find_set(&twin.mesh, name[k]);
        double* d = calloc((size_t)set->nvert, sizeof *d);
        for (int i = 0; i < set->nvert; ++i)
            d[i] = om_sdf_eval(&twin.organ_sdf, om_load3(twin.mesh.x, set->vert[i]), NULL);
        qsort(d, (size_t)set->nvert, sizeof *d, compare);
        median[k] = d[set->nvert / 2];
        assert_true(d[0] > -0.001);  // outside of the kidney, by what its field resolves
        free(d);
    }
    assert_near(median[0], 0, 0.001);
    assert_near(median[1], 0.010, 0.001);
    assert_int_equal(om_tet_mesh_find_set(&twin.mesh, "attachment")->nvert, 0);
}

// The truth has more vertices, another law, and the attachments of its state.
static void test_sites(void** unused) {
    (void)unused;
    make_scene();
    OmScene truth = scene;
    om__kidney_set_truth(&truth);
    assert_true(truth.tissue.law != scene.tissue.law);
    int last = 0;
    for (int s = 0; s < KIDNEY_NSTATE; ++s) {
        OmSite site;
        assert_ok(om__kidney_build_site(&truth, OM_SITE_WORLD, s, &site));
        assert_true(site.mesh.nvert >= 2 * twin.mesh.nvert);
        double share = om_tet_mesh_find_set(&site.mesh, "attachment")->nvert /
                       (double)om_tet_mesh_find_set(&site.mesh, "underside")->nvert;
        int nheld = om_tet_mesh_find_set(&site.mesh, "attachment")->nvert;
        printf("state %d: %.0f %% of the underside\n", s + 1, 100 * share);
        assert_true(share > 0.05 && share < 0.5);
        if (s > 0) assert_true(nheld < last);
        last = nheld;
        om_site_done(&site);
    }
}

static double distance_to_cloud(const OmScan* scan, OmVec3 p) {
    double best = HUGE_VAL;
    for (int i = 0; i < scan->npoint; ++i) best = fmin(best, om_distance(om_load3(scan->x, i), p));
    return best;
}

static void test_lift(void** unused) {
    (void)unused;
    make_scene();
    KidneyTruth t;
    OmAcquisition rest, low, again, other;
    bool is_new;
    const int g = 2, top = KIDNEY_LIFTED + 1;
    assert_ok(om__kidney_truth_open(&scene, true, 1, 1, &t));
    assert_ok(om__kidney_truth_lift(&t, dir, g, &is_new));
    assert_true(is_new);
    assert_true(t.lift[g].nlevel >= 2);
    assert_int_equal(t.lift[g].nbad, 0);
    assert_true(t.lift[g].force[1] > t.lift[g].force[0]);
    assert_ok(om__kidney_truth_look(&t, g, KIDNEY_REST, 0, &twin, &rest));
    assert_int_equal(rest.ngrasp, 0);
    assert_true(rest.scan.npoint > 100);
    assert_ok(om__kidney_truth_look(&t, g, top, 0, &twin, &low));
    const OmMatchGrasp* held = &low.grasp[0];
    double way = om_distance(held->pose_world_now.p, held->pose_world_grasp.p);
    assert_near(way, 2 * KIDNEY_STEP, 1e-4);  // noise of one run has the same offset
    assert_below(distance_to_cloud(&low.scan, held->pose_world_now.p), 0.01);
    // Material points: carried on, they are the points of the scan again.
    int n = low.scan.npoint;
    double* point = calloc(6 * (size_t)n, sizeof *point);
    assert_ok(om__match_find_scanned(&t.surface, t.vert, t.mesh.x, &low.scan, t.shift, point));
    assert_ok(om__match_carry_by(&t.mesh, t.x, n, point, point + 3 * n));
    double far = 0;
    for (int i = 0; i < n; ++i)
        far += om_distance(om_load3(point + 3 * n, i), om_load3(low.scan.x, i)) / n;
    printf("%d points, %.2f mm from the truth\n", n, 1e3 * far);
    assert_below(far, 0.003);  // calibration and noise
    assert_true(far > 1e-4);
    free(point);
    // From the file: the same bytes; another run: another noise.
    om__kidney_truth_close(&t);
    assert_ok(om__kidney_truth_open(&scene, true, 1, 2, &t));
    assert_ok(om__kidney_truth_lift(&t, dir, g, &is_new));
    assert_false(is_new);
    assert_ok(om__kidney_truth_look(&t, g, top, 0, &twin, &again));
    assert_int_equal(again.scan.npoint, n);
    assert_memory_equal(again.scan.x, low.scan.x, 3 * (size_t)n * sizeof(double));
    assert_ok(om__kidney_truth_look(&t, g, top, 1, &twin, &other));
    assert_true(om_distance(other.scan.camera.pose_world_camera.p,
                            low.scan.camera.pose_world_camera.p) > 1e-5);
    assert_status(om__kidney_truth_show(&t, 0, KIDNEY_LIFTED), OM_INVALID);
    om_scan_done(&rest.scan);
    om_scan_done(&low.scan);
    om_scan_done(&again.scan);
    om_scan_done(&other.scan);
    om__kidney_truth_close(&t);
}

static OmStudyKidneyDef study_def(const char* out) {
    OmStudyKidneyDef d = om_study_kidney_default_def(out, test_data("ct_abdomen/labels.nii.gz"));
    d.is_quick = true;
    d.weights = "";
    d.nsample = 0;
    d.nrun = 2;
    d.nworker = 1;
    return d;
}

static bool stop(void* ctx, const char* stage, double done, double total) {
    (void)ctx, (void)stage, (void)done, (void)total;
    return false;
}

static void test_definitions(void** unused) {
    (void)unused;
    const OmProgress cancel = {.report = stop};
    char other[64];
    OmStudyKidneySummary sum;
    OmStudyKidneyDef d = study_def(dir), raw = {0};
    assert_status(om_study_kidney_run(&raw, NULL, &sum), OM_INVALID);
    d.nrun = 0;
    assert_status(om_study_kidney_run(&d, NULL, &sum), OM_INVALID);
    d.nrun = OM_STUDY_KIDNEY_MAX_RUN + 1;
    assert_status(om_study_kidney_run(&d, NULL, &sum), OM_INVALID);
    d = study_def(dir);
    d.nworker = -1;
    assert_status(om_study_kidney_run(&d, NULL, &sum), OM_INVALID);
    d = study_def(dir);
    d.volume = "/no/such/file.nii.gz";
    assert_status(om_study_kidney_run(&d, NULL, &sum), OM_UNAVAILABLE);
    d = study_def(dir);
    snprintf(other, sizeof other, "%s/cancelled", dir);
    d.out_dir = other;
    assert_status(om_study_kidney_run(&d, &cancel, &sum), OM_CANCELLED);
    d = study_def(dir);  // it has a truth, and no list of a study
    assert_status(om_study_kidney_run(&d, NULL, &sum), OM_INVALID);
}

static OmStatus attach_all(void* ctx, const OmSurface* surface, const double* u, const double* seen,
                           double* probability) {
    (void)ctx, (void)u, (void)seen;
    for (int i = 0; i < surface->nvert; ++i) probability[i] = 1;
    return OM_OK;
}

// Samples of the fat without a network: Same comes back to the truth, Zero does not.
static void check_samples(const OmStudyKidneySummary* sum) {
    assert_int_equal(sum->nsample, 2);
    assert_int_equal(sum->dsc.n, 0);
    printf("samples: pulled by %.1f mm, same %.2f, zero %.1f mm\n", 1e3 * sum->input,
           1e3 * sum->same.median, 1e3 * sum->zero.median);
    assert_true(sum->input > 0.005);
    assert_below(sum->same.upper, 0.001);
    assert_true(sum->zero.lower > 0.003);
}

// A network that knows the truth finds it in samples, too.
static void test_samples(void** unused) {
    (void)unused;
    make_scene();
    OmStudyKidneyDef d = study_def(dir);
    d.nsample = 3;
    KidneySample one[KIDNEY_CHUNK], two[KIDNEY_CHUNK];  // room for a file
    Kidney s = {.def = &d, .scene = scene, .twin = twin, .sample = one};
    assert_ok(om__kidney_run_samples(&s));
    assert_int_equal(s.sum.nnew, 3);
    s.sample = two;  // from the file
    assert_ok(om__kidney_run_samples(&s));
    assert_int_equal(s.sum.nnew, 3);
    assert_memory_equal(one, two, 3 * sizeof *one);
    d.nworker = 2;  // the same with two workers, and a network that attaches everything
    s.estimate = attach_all;
    s.net_hash = 9;
    assert_ok(om__kidney_run_samples(&s));
    assert_int_equal(s.sum.nnew, 6);
    assert_ok(om__kidney_summarise_samples(&s));
    for (int i = 0; i < 3; ++i) {
        assert_near(two[i].same, one[i].same, 0);
        assert_near(two[i].zero, one[i].zero, 0);
        assert_near(two[i].tpr, 1, 0);
        assert_true(two[i].dsc > 0.05 && two[i].dsc < 0.9);
        assert_true(two[i].ave > one[i].same);
    }
    assert_int_equal(s.sum.dsc.n, 3);
    OmBanetSampleDef def = om__kidney_sample_def(&s);
    assert_int_equal(def.seed, 4005);
    assert_int_equal(def.way, OM_BANET_EXACT);
    assert_ptr_equal(def.body, &s.twin.mesh);
}

// The mean of the table, computed anew from views.csv: two runs of two views.
static void check_views(const char* path, double mean) {
    char *text, *line;
    size_t size;
    double sum = 0;
    int n = 0;
    assert_ok(om_file_read(path, 1 << 20, &text, &size));
    for (line = strchr(text, '\n') + 1; *line; line = strchr(line, '\n') + 1) {
        int state, run, lift;
        double rest, error;
        char grasp, way[16];
        assert_int_equal(sscanf(line, "%d,%d,%lf,%c,%d,%15[a-z],%lf", &state, &run, &rest, &grasp,
                                &lift, way, &error),
                         7);
        if (strcmp(way, "physics") != 0) continue;
        assert_true(state == 2 && grasp == 'C');
        sum += error - rest;
        ++n;
    }
    assert_int_equal(n, 4);
    assert_near(sum / n, 1e3 * mean, 1e-4);
    om_free(text);
}

// A quick run: the errors of the ways are in the order of what they know, and a second call computes nothing.
static void test_quick(void** unused) {
    (void)unused;
    char out[64], file[128];
    OmStudyKidneySummary sum, again;
    snprintf(out, sizeof out, "%s/study", dir);
    OmStudyKidneyDef d = study_def(out);
    d.nsample = 2;
    assert_ok(om_study_kidney_run(&d, NULL, &sum));
    assert_int_equal(sum.nnew, 4);
    check_samples(&sum);
    assert_int_equal(sum.nrow, 1);
    assert_int_equal(sum.nview, 2);
    assert_false(sum.has_network);
    assert_false(sum.is_met);  // not without a network
    const OmStudyKidneyTable *zero = &sum.by[OM_STUDY_KIDNEY_ZERO],
                             *same = &sum.by[OM_STUDY_KIDNEY_SAME],
                             *physics = &sum.by[OM_STUDY_KIDNEY_PHYSICS];
    assert_true(zero->is_there && same->is_there && physics->is_there);
    assert_false(sum.by[OM_STUDY_KIDNEY_ALL].is_there);
    printf("rest %.2f mm; zero %.2f, same %.2f, physics %.2f mm\n", 1e3 * sum.rest,
           1e3 * zero->mean, 1e3 * same->mean, 1e3 * physics->mean);
    assert_near(zero->mean, 0.012, 0.005);  // the free twin follows lifts of 10 and 20 mm
    assert_near(zero->ratio, 1, 1e-12);
    const OmStudyKidneyTable* under = &sum.by[OM_STUDY_KIDNEY_UNDER];
    assert_true(under->is_there && under->tpr == 1 && under->dsc < 0.7);
    assert_true(under->volume > same->volume && under->mean < zero->mean);
    assert_near(zero->dsc, 0, 0);
    assert_near(same->dsc, 1, 0);
    assert_near(same->tpr, 1, 0);
    assert_true(zero->row[0].ave[1] > 1.5 * zero->row[0].ave[0]);
    assert_true(sum.rest > 0.0003 && sum.rest < 0.002);  // calibration of 1 mm, noise
    assert_below(same->mean, 0.001);
    assert_below(same->volume, 0.0015);
    assert_true(physics->mean < 0.5 * zero->mean);
    assert_true(physics->dsc > 0.2);
    assert_near(physics->row[0].mean, 0.5 * (physics->row[0].ave[0] + physics->row[0].ave[1]),
                1e-12);
    assert_near(physics->ratio, physics->mean / zero->mean, 1e-12);
    assert_int_equal(zero->nloose + same->nloose, 0);
    const char* const name[] = {"report.html", "study.json", "lift-C2-quick.png", "samples.csv",
                                "views.csv"};
    for (int i = 0; i < 5; ++i) {
        snprintf(file, sizeof file, "%s/%s", out, name[i]);
        assert_true(om_path_exists(file));
    }
    check_views(file, physics->mean);
    assert_ok(om_study_kidney_run(&d, NULL, &again));
    assert_int_equal(again.nnew, 0);
    assert_near(again.by[OM_STUDY_KIDNEY_PHYSICS].mean, physics->mean, 0);
}

// A network that knows the truth and is not quite sure.
static OmStatus know(void* ctx, const OmSurface* surface, const double* u, const double* seen,
                     double* probability) {
    const int* state = ctx;
    OmPose task = om_pose_inverse(twin.pose_world_task);
    double most = 0;
    for (int i = 0; i < surface->nvert; ++i) {
        OmVec3 p = om_load3(surface->x, i);
        bool is_under = om_sdf_eval(&twin.organ_sdf, p, NULL) < 0.002;
        bool is_in = is_under && om__kidney_is_attached(*state, om_pose_apply(task, p));
        probability[i] = is_in ? 0.9 : 0.1;
        most = fmax(most, seen[i] * om_norm(om_load3(u, i)));
    }
    assert_true(most > 0.005);  // the lift is in the displacement
    return OM_OK;
}

// The ways of the network take what it says.
static void test_network(void** unused) {
    (void)unused;
    make_scene();
    OmStudyKidneyDef d = study_def(dir);
    d.nrun = 1;
    KidneyResult result;
    KidneyCases cases = om__kidney_make_cases(true);
    Kidney s = {.def = &d,
                .cases = cases,
                .scene = scene,
                .twin = twin,
                .result = &result,
                .estimate = know,
                .estimate_ctx = &cases.state[0],
                .net_hash = 7};
    assert_ok(om__kidney_run_lifts(&s));
    assert_ok(om__kidney_summarise_lifts(&s));
    const OmStudyKidneyTable *same = &s.sum.by[OM_STUDY_KIDNEY_SAME],
                             *one = &s.sum.by[OM_STUDY_KIDNEY_NETWORK],
                             *fusion = &s.sum.by[OM_STUDY_KIDNEY_FUSION],
                             *all = &s.sum.by[OM_STUDY_KIDNEY_ALL];
    printf("same %.2f, network %.2f, fusion %.2f, all %.2f mm (DSC %.2f)\n", 1e3 * same->mean,
           1e3 * one->mean, 1e3 * fusion->mean, 1e3 * all->mean, all->dsc);
    assert_true(one->is_there && fusion->is_there && all->is_there);
    assert_int_equal(s.sum.nlost, 0);
    assert_true(one->dsc > 0.95 && one->tpr > 0.95);
    assert_near(one->mean, same->mean, 0.0002);
    assert_true(fusion->dsc > 0.95);
    assert_true(all->dsc > 0.5);
    assert_true(all->mean < 0.001);
    // The row of physics is what it is without a network: what the others believe is not its belief.
    KidneyResult plain;
    s.result = &plain;
    s.estimate = NULL;
    s.net_hash = 0;
    assert_ok(om__kidney_run_lifts(&s));
    assert_int_equal(plain.nview, result.nview);
    for (int k = 0; k < plain.nview; ++k) {
        const KidneyGuess *a = &plain.view[k].by[OM_STUDY_KIDNEY_PHYSICS],
                          *b = &result.view[k].by[OM_STUDY_KIDNEY_PHYSICS];
        assert_false(plain.view[k].by[OM_STUDY_KIDNEY_ALL].is_there);
        assert_near(a->ave, b->ave, 0);
        assert_near(a->dsc, b->dsc, 0);
        assert_near(result.view[k].by[OM_STUDY_KIDNEY_NETWORK].ave,
                    result.view[k].by[OM_STUDY_KIDNEY_SAME].ave, 0.0003);
    }
}

static int leave(void** unused) {
    (void)unused;
    om_site_done(&twin);
    om_path_remove(dir);
    return 0;
}

int main(void) {
    if (!mkdtemp(dir)) return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_without_data), cmocka_unit_test(test_stages),
        cmocka_unit_test(test_shape),        cmocka_unit_test(test_sites),
        cmocka_unit_test(test_lift),         cmocka_unit_test(test_definitions),
        cmocka_unit_test(test_quick),        cmocka_unit_test(test_network),
        cmocka_unit_test(test_samples),
    };
    return cmocka_run_group_tests(tests, NULL, leave);
}
