// test_study_retraction.c: cases of the retraction study, random states of Table 6.4, and a quick study, resumed.
#include "studies/study_match_case.h"
#include "studies/study_retraction_internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "test_files.h"

static char dir[] = "/tmp/om_retraction_XXXXXX";
static const OmStudyDraw published;

// Vertices of the twin's set "attachment".
static int find_attached(const RetractionCase* c, RetractionKnowledge knowledge,
                         unsigned char* held) {
    OmScene scene;
    OmSite site;
    assert_ok(om__retraction_scene(c, knowledge, &scene));
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    const OmMeshSet* set = om_tet_mesh_find_set(&site.mesh, "attachment");
    const int n = set->nvert;
    memset(held, 0, 1000);
    for (int i = 0; i < n; ++i) held[set->vert[i]] = 1;
    if (c->group != RETRACTION_LAB) {  // the ROI is clear of what is attached in truth
        OmVec3 roi = om_pose_apply(site.pose_world_task, c->roi);
        for (int i = 0; knowledge == RETRACTION_TRUE && i < n; ++i)
            assert_true(om_distance(roi, om_load3(site.mesh.x, set->vert[i])) > 0.012);
    }
    om_site_done(&site);
    return n;
}

// Numbers that were committed before any run: the first draws never change.
static void test_draws(void** unused) {
    (void)unused;
    static const double believed[8] = {0.269, 0.110, 0.154, 0.132, 0.104, 0.225, 0.143, 0.172};
    static const double more[8] = {1.424, 1.455, 1.462, 1.533, 1.588, 1.408, 1.429, 1.504};
    static const double fewer[8] = {0.273, 0.583, 0.211, 0.222, 0.583, 0.342, 0.291, 0.457};
    // beside vertices of the twin, which has 8 x 8 cells
    static const double roi[8][2] = {{-15, -45}, {0, 30},   {-45, -15}, {-45, 15},
                                     {15, 45},   {15, -30}, {15, 15},   {0, 45}};
    for (int k = 0; k < 8; ++k) {
        RetractionCase f, m;
        assert_ok(om__retraction_scenario(k + 1, RETRACTION_FEWER, false, &f));
        assert_ok(om__retraction_scenario(k + 1, RETRACTION_MORE, false, &m));
        assert_near(f.believed, believed[k], 5e-4);
        assert_near(f.share / f.believed, fewer[k], 5e-4);
        assert_near(m.share / m.believed, more[k], 5e-4);
        assert_near(1e3 * m.roi.x, roi[k][0], 1e-6);
        assert_near(1e3 * m.roi.y, roi[k][1], 1e-6);
        assert_near(f.roi.x, m.roi.x, 0);
        assert_near(f.roi.y, m.roi.y, 0);
        assert_int_equal(f.seed, m.seed);
        assert_int_equal(m.attempt, 0);
    }
}

// Fewer: the truth lies in the belief; more: the belief lies in the truth; with the shares of the case.
static void test_beliefs(void** unused) {
    (void)unused;
    static unsigned char truth[1000], belief[1000];
    for (int k = 1; k <= 8; ++k)
        for (int kind = RETRACTION_FEWER; kind <= RETRACTION_MORE; ++kind) {
            RetractionCase c;
            assert_ok(om__retraction_scenario(k, (RetractionKind)kind, false, &c));
            const int ntrue = find_attached(&c, RETRACTION_TRUE, truth);
            const int nbelieved = find_attached(&c, RETRACTION_BELIEVED, belief);
            assert_near(ntrue, 81 * c.share, 0.51);  // 9 x 9 vertices of the underside
            assert_near(nbelieved, 81 * c.believed, 0.51);
            assert_true(kind == RETRACTION_FEWER ? ntrue < nbelieved : ntrue > nbelieved);
            for (int i = 0; i < 1000; ++i)
                assert_false(kind == RETRACTION_FEWER ? truth[i] && !belief[i]
                                                      : belief[i] && !truth[i]);
        }
}

static void test_pairs(void** unused) {
    (void)unused;
    static unsigned char truth[1000], belief[1000];
    static const RetractionKind kind[10] = {0, 0, 0, 1, 1, 1, 3, 3, 4, 2};
    for (int k = 0; k < 10; ++k) {
        RetractionCase c;
        assert_ok(om__retraction_pair(RETRACTION_FIRST_PAIR + k, &published, false, &c));
        assert_int_equal(c.kind, kind[(1 + k) % 10]);
        find_attached(&c, RETRACTION_TRUE, truth);
        const int nbelieved = find_attached(&c, RETRACTION_BELIEVED, belief);
        const bool is_same = memcmp(truth, belief, sizeof truth) == 0;
        assert_true(is_same == (c.kind == RETRACTION_SAME));
        assert_true((nbelieved == 0) == (c.kind == RETRACTION_NONE));
    }
}

// The worlds of random pairs: each number lies in its range, and the numbers fill most of it.
static void test_worlds(void** unused) {
    (void)unused;
    double lo[4] = {INFINITY, INFINITY, INFINITY, INFINITY}, hi[4] = {0};
    bool has_law[2] = {false};
    for (int k = 0; k < 40; ++k) {
        const RetractionCase c = {.group = RETRACTION_PAIR, .number = 2501 + k, .seed = 5};
        OmScene s, again;
        assert_ok(om__retraction_scene(&c, RETRACTION_BELIEVED, &s));
        assert_ok(om__retraction_scene(&c, RETRACTION_TRUE, &again));
        const double value[4] = {s.world.friction, s.world.young_factor,
                                 om_norm(s.registration.turn) * 180 / OM_PI, 1e3 * s.roi.margin};
        for (int i = 0; i < 4; ++i) {
            lo[i] = fmin(lo[i], value[i]);
            hi[i] = fmax(hi[i], value[i]);
        }
        assert_near(again.world.young_factor, s.world.young_factor, 0);
        assert_true(s.tissue.world_cells.x >= 12 && s.tissue.world_cells.x <= 14);
        assert_near(s.world.tool_noise * sqrt(8 / OM_PI), 0.0017,
                    1e-6);  // mean of a normal's length
        assert_true(s.world.law == OM_NEO_HOOKEAN || s.world.law == OM_STABLE_NEO_HOOKEAN);
        has_law[s.world.law == OM_STABLE_NEO_HOOKEAN] = true;
        assert_near(s.tissue.friction, 0.2, 0);  // the twin knows nothing of it
    }
    static const double least[4] = {0.1, 0.5, 0, 0}, most[4] = {0.5, 2, 2, 5};
    for (int i = 0; i < 4; ++i) {
        assert_true(lo[i] >= least[i] && hi[i] <= most[i]);
        assert_true(hi[i] - lo[i] > 0.6 * (most[i] - least[i]));
    }
    assert_true(has_law[0] && has_law[1]);
}

static void test_laboratory(void** unused) {
    (void)unused;
    static unsigned char truth[1000], belief[1000];
    for (int i = 0; i < RETRACTION_NLAB; ++i) {
        const RetractionCase c = om__retraction_lab(i, false);
        const int ntrue = find_attached(&c, RETRACTION_TRUE, truth);
        const int nbelieved = find_attached(&c, RETRACTION_BELIEVED, belief);
        assert_near(nbelieved, (i % 3 == 0 ? 0.4 : i % 3 == 1 ? 1.5 : 1) * ntrue, 0.51);
    }
}

// Sheets of the false alarms: attachments are right, everything else is wrong by a little.
static void test_alarms(void** unused) {
    (void)unused;
    static unsigned char truth[1000], belief[1000];
    double largest = 0;
    for (int k = 0; k < 10; ++k) {
        RetractionCase c;
        OmScene believed, known;
        assert_ok(om__retraction_alarm(RETRACTION_FIRST_ALARM + k, &published, false, &c));
        assert_int_equal(c.kind, RETRACTION_SAME);
        find_attached(&c, RETRACTION_TRUE, truth);
        find_attached(&c, RETRACTION_BELIEVED, belief);
        assert_memory_equal(truth, belief, sizeof truth);
        assert_ok(om__retraction_scene(&c, RETRACTION_BELIEVED, &believed));
        assert_ok(om__retraction_scene(&c, RETRACTION_TRUE, &known));
        assert_true(om_norm(known.registration.shift) + om_norm(known.registration.turn) == 0);
        const OmVec3 shift = believed.registration.shift;
        largest = fmax(largest, fabs(shift.x));
        assert_true(fabs(shift.x) <= 0.001 && fabs(shift.y) <= 0.001 && fabs(shift.z) <= 0.001);
        assert_true(om_norm(believed.registration.turn) > 0);
        assert_true(om_norm(believed.believed_roi.shift) > 0);
        assert_near(believed.tissue.friction, 0.5 * known.tissue.friction, 1e-15);
        assert_near(believed.world.friction, known.tissue.friction, 0);
    }
    assert_true(largest > 0.0005);
}

static void test_states(void** unused) {
    (void)unused;
    OmSituation a, b;
    for (int n = 5; n <= 10; ++n)
        for (int k = 0; k < 3; ++k) {
            int nfixed = 0, nroi = 0;
            om__retraction_random_state(n, 0.3, k, &a);
            om__retraction_random_state(n, 0.3, k, &b);
            assert_memory_equal(&a, &b, sizeof a);
            om__retraction_random_state(n, 0.3, k + 1, &b);
            assert_memory_not_equal(&a, &b, sizeof a);
            for (int i = 0; i < n * n; ++i) {
                nfixed += a.is_fixed[i];
                nroi += a.is_above_roi[i];
                assert_false(a.is_fixed[i] && a.is_above_roi[i]);
            }
            assert_int_equal(nfixed, lround(0.3 * n * n));
            assert_int_equal(nroi, 1);
        }
}

static void test_picture(void** unused) {
    (void)unused;
    RetractionCase c;
    OmPicture picture;
    int green = 0, magenta = 0;
    assert_ok(om__retraction_scenario(1, RETRACTION_SAME, false, &c));
    assert_ok(om__retraction_draw(&c, NULL, &picture));
    const int n = picture.width * picture.height;
    for (int k = 0; k < n; ++k) {
        const unsigned char* p = picture.pixel + 3 * (size_t)k;
        green += p[1] > 170 && p[0] < 100;
        magenta += p[0] > 200 && p[1] < 60 && p[2] > 150;
    }
    // The outline takes some of the true area. A vertex owns at most one of 64 cells, and there are 81 vertices. The
    // disc has a radius of 8 mm on 120 mm.
    printf("green %.3f of the picture, share %.3f\n", (double)green / n, c.share);
    const double most = round(81 * c.share) / 64 * n;
    assert_true(green > 0.6 * most && green < most);
    assert_near(magenta, OM_PI * 8 * 8 / (120 * 120) * n, 0.03 * magenta);
    om_picture_done(&picture);
}

// A pair counts if its plan fails without looking and the search succeeds; a push that is too hard is a failure, too.
static void test_which_pairs_count(void** unused) {
    (void)unused;
    OmStudyRetractionDef def = om_study_retraction_default_def(dir);
    const Retraction s = {.def = &def};
    RetractionResult* r = calloc(1, sizeof *r);
    r->c.group = RETRACTION_PAIR;
    assert_false(om__retraction_counts(&s, r));  // nothing is known yet
    r->has_run[OM_RETRACTION_OPEN_LOOP] = true;
    assert_true(om__retraction_is_searched(r));
    assert_false(om__retraction_counts(&s, r));
    r->has_ceiling = true;
    assert_false(om__retraction_counts(&s, r));
    r->ceiling.is_possible = true;
    assert_true(om__retraction_counts(&s, r));
    r->run[OM_RETRACTION_OPEN_LOOP].is_success = true;  // a harmless belief
    assert_false(om__retraction_is_searched(r) || om__retraction_counts(&s, r));
    r->c.group = RETRACTION_SCENARIO;
    assert_true(om__retraction_counts(&s, r));
    free(r);
}

static void test_definitions(void** unused) {
    (void)unused;
    OmStudyRetractionSummary sum;
    OmStudyRetractionDef raw = {0}, d = om_study_retraction_default_def(dir);
    assert_status(om_study_retraction_run(&raw, NULL, &sum), OM_INVALID);
    d.parts = 512;
    assert_status(om_study_retraction_run(&d, NULL, &sum), OM_INVALID);
    d.parts = 0;
    assert_status(om_study_retraction_run(&d, NULL, &sum), OM_INVALID);
    d = om_study_retraction_default_def(dir), d.ncase = -1;
    assert_status(om_study_retraction_run(&d, NULL, &sum), OM_INVALID);
    d = om_study_retraction_default_def(dir), d.first = 100;
    assert_status(om_study_retraction_run(&d, NULL, &sum), OM_INVALID);
    d = om_study_retraction_default_def(dir), d.nworker = -1;
    assert_status(om_study_retraction_run(&d, NULL, &sum), OM_INVALID);
    d = om_study_retraction_default_def(dir), d.parts = OM_RETRACTION_KIDNEY;
    assert_status(om_study_retraction_run(&d, NULL, &sum), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "ct_abdomen"));
}

// What a search found, and the setup in its file.
static RetractionCeiling load_search(const char* name, uint64_t* setup) {
    char path[600], *data;
    size_t size;
    RetractionCeiling found;
    assert_ok(om_path_join(dir, name, path, sizeof path));
    assert_ok(om_file_read(path, 1 << 20, &data, &size));
    memcpy(setup, data + sizeof *setup, sizeof *setup);  // after the mark of the file
    om_free(data);
    assert_true(om__match_load_result(dir, name, *setup, &found, sizeof found));
    return found;
}

// Make the file of a search say that one arm cannot expose the case.
static void forget_exposure(const char* name) {
    uint64_t setup;
    RetractionCeiling found = load_search(name, &setup);
    found.is_possible = false;
    found.best.nexposed = 0;
    assert_ok(om__match_save_result(dir, name, setup, &found, sizeof found));
}

// One pair with two workers, then with one: the second time nothing is made again.
static void test_study(void** unused) {
    (void)unused;
    OmStudyRetractionSummary one, two;
    OmStudyRetractionDef d = om_study_retraction_default_def(dir);
    d.is_quick = true;
    d.parts = OM_RETRACTION_RANDOM | OM_RETRACTION_REPLANNING;
    d.nworker = 2;
    assert_ok(om_study_retraction_run(&d, NULL, &one));
    assert_int_equal(one.nnew, one.nrun);
    assert_int_equal(one.random[OM_RETRACTION_DEFRAS].nrun, 1);
    assert_int_equal(one.random[OM_RETRACTION_OPEN_LOOP].nrun, 1);
    assert_int_equal(one.pairs.ndrawn, 1);
    const OmRetractionPairs* p = &one.pairs;
    assert_int_equal(p->nharmless + p->nimpossible + p->ncounting, 1);
    assert_true((p->nharmless == 1) == (one.random[OM_RETRACTION_OPEN_LOOP].nsuccess == 1));
    assert_int_equal(one.scenario[OM_RETRACTION_DEFRAS].nrun, 0);
    assert_true(isnan(one.scenario[OM_RETRACTION_DEFRAS].visibility));
    assert_true(one.replan[0][0] > 0 && one.replan[0][0] < 1);
    d.nworker = 1;
    assert_ok(om_study_retraction_run(&d, NULL, &two));
    assert_int_equal(two.nnew, 0);
    assert_near(two.random[OM_RETRACTION_DEFRAS].visibility,
                one.random[OM_RETRACTION_DEFRAS].visibility, 0);
    // Searches of a scenario's two cases and of one case of the laboratory, and of the pair if DEFRAS did not expose
    // it; no run is made. Where one arm cannot expose a case, both arms are tried.
    const OmRetractionScore* pair = &one.random[OM_RETRACTION_DEFRAS];
    d.parts = OM_RETRACTION_SEARCHES;
    assert_ok(om_study_retraction_run(&d, NULL, &two));
    static const char* const search[] = {"scenario-1-fewer-search.bin",
                                         "scenario-1-more-search.bin",
                                         "laboratory-a-belief-fewer-search.bin"};
    int nboth = 0;
    for (int k = 0; k < 3; ++k) {
        uint64_t setup;
        nboth += !load_search(search[k], &setup).is_possible;
    }
    assert_int_equal(pair->nrun, 1);
    assert_true(nboth < 3);
    assert_int_equal(two.nnew, 3 + nboth);
    assert_int_equal(two.scenario[OM_RETRACTION_DEFRAS].nrun, 0);
    forget_exposure("scenario-1-fewer-search.bin");
    assert_ok(om_study_retraction_run(&d, NULL, &two));
    assert_int_equal(two.nnew, 1);
    assert_ok(om_study_retraction_run(&d, NULL, &two));
    assert_int_equal(two.nnew, 0);
}

static int make_dir(void** unused) {
    (void)unused;
    return mkdtemp(dir) ? 0 : -1;
}

static int remove_dir(void** unused) {
    (void)unused;
    return om_path_remove(dir) == OM_OK ? 0 : -1;
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_draws),
                                       cmocka_unit_test(test_beliefs),
                                       cmocka_unit_test(test_pairs),
                                       cmocka_unit_test(test_worlds),
                                       cmocka_unit_test(test_laboratory),
                                       cmocka_unit_test(test_alarms),
                                       cmocka_unit_test(test_states),
                                       cmocka_unit_test(test_picture),
                                       cmocka_unit_test(test_which_pairs_count),
                                       cmocka_unit_test(test_definitions),
                                       cmocka_unit_test(test_study)};
    return cmocka_run_group_tests(tests, make_dir, remove_dir);
}
