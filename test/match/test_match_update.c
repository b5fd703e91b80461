// test_match_update.c: attachments found again from scans of another, finer and softer body.
#include "test_common.h"

#include "match/match_internal.h"
#include "match/match_lift.h"
#include "test_alloc.h"

static void test_half(void** state) {
    (void)state;
    Rig rig;
    begin(&rig);
    OmMatchEstimate one, two, swapped;
    double found;
    assert_ok(om_match_update(rig.match, 1, rig.acq, NULL, &one));
    double dice = score(&rig, &one, &found);
    printf("one: dice %.2f found %.2f seen %.2f moved %.2f, %.2f/%.2f -> %.2f/%.2f mm, %s\n", dice,
           found, one.seen_share, one.moved_share, 1e3 * one.before_median, 1e3 * one.before_p90,
           1e3 * one.after_median, 1e3 * one.after_p90, one.reason);
    assert_true(one.is_accepted);
    assert_true(dice > 0.6);
    assert_ok(om_match_update(rig.match, 2, rig.acq, NULL, &two));
    dice = score(&rig, &two, &found);
    printf("two: dice %.2f found %.2f\n", dice, found);
    assert_true(two.is_accepted);
    assert_true(dice > 0.8 && found > 0.75);
    // The order of acquisitions does not matter.
    OmAcquisition back[NCASE] = {rig.acq[1], rig.acq[0]};
    assert_ok(om_match_update(rig.match, 2, back, NULL, &swapped));
    for (int v = 0; v < two.nvert; ++v)
        assert_near(two.probability[v], swapped.probability[v], 1e-9);
    // The mirrored acquisition gives the mirrored evidence (vertex (i, j) and (i, 12 - j) of a layer).
    OmMatchEstimate mirror;
    assert_ok(om_match_update(rig.match, 1, rig.acq + 1, NULL, &mirror));
    int differ = 0;
    for (int v = 0; v < 169; ++v) {
        int w = v % 13 + 13 * (12 - v / 13);
        differ += fabs(one.uncertainty[v] - mirror.uncertainty[w]) > 0.5;
    }
    printf("mirrored: %d of 169 vertices differ\n", differ);
    assert_true(differ <= 8);  // tetrahedra are not mirrored
    om_match_estimate_done(&one);
    om_match_estimate_done(&two);
    om_match_estimate_done(&swapped);
    om_match_estimate_done(&mirror);
    end(&rig);
}

static void refuse(Rig* rig, const OmAcquisition* a, const char* reason) {
    OmMatchEstimate e;
    assert_ok(om_match_update(rig->match, 1, a, NULL, &e));
    if (e.is_accepted || !strstr(e.reason, reason))
        fail_msg("reason \"%s\", expected \"%s\"", e.reason, reason);
    om_match_estimate_done(&e);
}

// The vertex of the twin nearest to p.
static int view_vertex(const Rig* rig, OmVec3 p) {
    int best = 0;
    for (int v = 1; v < rig->view->mesh->nvert; ++v)
        if (om_distance(om_load3(rig->view->mesh->x, v), p) <
            om_distance(om_load3(rig->view->mesh->x, best), p))
            best = v;
    return best;
}

static void test_refusals(void** state) {
    (void)state;
    Rig rig;
    begin(&rig);
    OmMatchEstimate e;
    OmAcquisition a = rig.acq[0];
    a.scan.npoint = 0;
    refuse(&rig, &a, "0 points show the tissue");
    a = rig.acq[0];
    a.ngrasp = 0;
    refuse(&rig, &a, "nothing is grasped");
    a = rig.acq[0];
    a.grasp[0].pose_world_now = a.grasp[0].pose_world_grasp;
    refuse(&rig, &a, "moved by 0.0 mm only");
    a = rig.acq[0];
    a.scan.npoint = 2;
    refuse(&rig, &a, "2 points show the tissue");
    OmScan spot;  // almost all is hidden
    assert_int_equal(om_scan_init(20, 0, &spot), OM_OK);
    for (int i = 0; i < 20; ++i) om_store3(spot.x, i, om_load3(a.scan.x, 0));
    spot.has_camera = true;
    spot.camera = a.scan.camera;
    a.scan = spot;
    refuse(&rig, &a, "of the surface");
    om_scan_done(&spot);
    a = rig.acq[0];  // the tissue was lifted by 30 mm when it was grasped
    int held = view_vertex(&rig, a.grasp[0].pose_world_grasp.p);
    a.grasp[0].vert = &held;
    a.grasp[0].nvert = 1;
    a.grasp[0].pose_world_grasp.p.z += 0.03;
    a.grasp[0].pose_world_now.p.z += 0.06;
    refuse(&rig, &a, "had moved by");
    // Another organ: a ball of 30 mm, 80 mm above the board.
    a = rig.acq[0];
    OmScan ball;
    assert_int_equal(om_scan_init(400, 0, &ball), OM_OK);
    for (int i = 0; i < 400; ++i) {
        double z = (i + 0.5) / 400, r = sqrt(1 - z * z), w = 2.4 * i;
        om_store3(ball.x, i, om_vec3(0.03 * r * cos(w), 0.03 * r * sin(w), 0.08 + 0.03 * z));
    }
    ball.has_camera = true;
    ball.camera = a.scan.camera;
    a.scan = ball;
    refuse(&rig, &a, "does not fit the model");
    om_scan_done(&ball);
    a = rig.acq[0];
    a.grasp[0].pose_world_grasp.p.x = 1;
    assert_int_equal(om_match_update(rig.match, 1, &a, NULL, &e), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "within 12.0 mm"));
    assert_null(e.x);
    assert_int_equal(om_match_update(rig.match, 0, NULL, NULL, &e), OM_INVALID);
    om_match_estimate_done(NULL);
    end(&rig);
}

// Advice decides where the scans say little, its weight counts, and no advice changes nothing.
static void test_advice(void** state) {
    (void)state;
    Rig rig;
    begin(&rig);
    int nvert = rig.twin.mesh.nvert;
    unsigned char* truth = malloc((size_t)nvert);
    double* p = malloc((size_t)nvert * sizeof *p);
    mark_true(&rig, truth);
    for (int v = 0; v < nvert; ++v) p[v] = truth[v] ? 0.9 : 0.1;
    OmMatchEstimate plain, none, right, wrong;
    OmMatchAdvice advice = {.probability = p, .weight = 0};
    double found;
    assert_ok(om_match_update(rig.match, 1, rig.acq, NULL, &plain));
    assert_ok(om_match_update_with(rig.match, 1, rig.acq, &advice, NULL, &none));
    for (int v = 0; v < nvert; ++v) {
        assert_near(none.probability[v], plain.probability[v], 1e-12);
        assert_int_equal(none.attached[v], plain.attached[v]);
    }
    assert_int_equal(none.choice, 0);
    advice.weight = 1;
    assert_ok(om_match_update_with(rig.match, 1, rig.acq, &advice, NULL, &right));
    double dice = score(&rig, &right, &found), before = score(&rig, &plain, &found);
    printf("advice: dice %.3f, %.3f without, choice %d\n", dice, before, right.choice);
    assert_true(right.is_accepted && dice > 0.95 && dice > before);
    int nclear = 0;
    for (int i = 0; i < rig.view->ncandidate; ++i) {
        int v = rig.view->candidate[i];
        assert_true(right.uncertainty[v] >= 0 && right.uncertainty[v] <= 1);
        nclear += right.uncertainty[v] < plain.uncertainty[v];
    }
    assert_true(nclear > rig.view->ncandidate / 4);  // the advice lowers the uncertainty
    // What the scans show as moved stays free although the advice has it attached.
    for (int v = 0; v < nvert; ++v) p[v] = 0.9;
    assert_ok(om_match_update_with(rig.match, 1, rig.acq, &advice, NULL, &wrong));
    int held = view_vertex(&rig, om_vec3(0.05, 0.05, 0));
    assert_true(wrong.probability[held] < 0.25);
    p[rig.view->candidate[3]] = 1.5;
    OmMatchEstimate e;
    assert_int_equal(om_match_update_with(rig.match, 1, rig.acq, &advice, NULL, &e), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "probability of vertex"));
    advice = (OmMatchAdvice){.weight = 2};
    assert_int_equal(om_match_update_with(rig.match, 1, rig.acq, &advice, NULL, &e), OM_INVALID);
    advice = (OmMatchAdvice){.nset = 1};
    assert_int_equal(om_match_update_with(rig.match, 1, rig.acq, &advice, NULL, &e), OM_INVALID);
    om_match_estimate_done(&plain);
    om_match_estimate_done(&none);
    om_match_estimate_done(&right);
    om_match_estimate_done(&wrong);
    free(truth);
    free(p);
    end(&rig);
}

// A set of the advice is taken if it brings the twin clearly nearer to the scan, and only then.
static void test_sets(void** state) {
    (void)state;
    Rig rig;
    begin(&rig);
    size_t nvert = (size_t)rig.twin.mesh.nvert;
    unsigned char *truth = malloc(nvert), *all = malloc(nvert), *free_set = calloc(nvert, 1);
    double *p = malloc(nvert * sizeof *p), *x = malloc(3 * nvert * sizeof *x);
    mark_true(&rig, truth);
    memset(all, 1, nvert);
    // A belief that everything is free leads the inference astray; the set of the truth explains the scan.
    for (size_t v = 0; v < nvert; ++v) p[v] = 0;
    OmMatchAdvice advice = {.probability = p, .weight = 1, .nset = 2, .set = {free_set, truth}};
    OmMatchEstimate e;
    OmMatchTrial right, wrong, none;
    assert_ok(om_match_update_with(rig.match, 1, rig.acq, &advice, NULL, &e));
    printf("sets: choice %d, after %.2f mm: %s\n", e.choice, 1e3 * e.after_median, e.reason);
    assert_true(e.is_accepted && e.choice != 0 && e.choice != 2);
    om_match_estimate_done(&e);
    for (size_t v = 0; v < nvert; ++v) p[v] = truth[v] ? 0.98 : 0.02;
    advice.set[1] = all;
    assert_ok(om_match_update_with(rig.match, 1, rig.acq, &advice, NULL, &e));
    assert_int_equal(e.choice, 0);
    assert_true(e.is_accepted);
    // The trial of the truth is that of the estimate; others are farther.
    memcpy(x, rig.x_twin[0], 3 * nvert * sizeof *x);
    assert_ok(om_match_try(rig.match, 1, rig.acq, truth, x, &right));
    assert_true(right.is_at_rest);
    assert_near(right.median, e.after_median, 2e-4);  // the tolerance of a rest
    double worst = 0;
    for (size_t i = 0; i < 3 * nvert; ++i) worst = fmax(worst, fabs(x[i] - e.x[i]));
    printf("trial: %.2f mm from the estimate's twin\n", 1e3 * worst);
    assert_true(worst < 2e-3);  // one Dice of 0.98 apart
    OmStatus status = om_match_try(rig.match, 1, rig.acq, all, x, &wrong);
    assert_true(status == OM_OK || status == OM_NOT_CONVERGED);
    memcpy(x, rig.x_twin[0], 3 * nvert * sizeof *x);
    status = om_match_try(rig.match, 1, rig.acq, free_set, x, &none);
    assert_true(status == OM_OK || status == OM_NOT_CONVERGED);
    printf("mean distance: true %.2f, all %.2f, none %.2f mm\n", 1e3 * right.mean, 1e3 * wrong.mean,
           1e3 * none.mean);
    assert_true(right.mean < 0.7 * wrong.mean && right.mean < 0.7 * none.mean);
    assert_true(right.median <= right.p90 && right.mean <= 0.005);
    assert_int_equal(om_match_try(rig.match, 0, NULL, truth, x, &none), OM_INVALID);
    om_match_estimate_done(&e);
    // A twin attached everywhere, and advice that agrees: tissue that moved is free all the same.
    for (size_t v = 0; v < nvert; ++v) p[v] = 0.98;
    advice = (OmMatchAdvice){.probability = p, .weight = 1, .present = all};
    assert_ok(om_match_update_with(rig.match, 1, rig.acq, &advice, NULL, &e));
    int nattached = 0, ntrue = 0;
    for (size_t v = 0; v < nvert; ++v)
        nattached += e.attached[v] != 0, ntrue += e.attached[v] && truth[v];
    printf("corrected: choice %d, %d attached, %d of them in truth\n", e.choice, nattached, ntrue);
    assert_true(e.is_accepted);
    assert_int_equal(e.attached[view_vertex(&rig, om_vec3(0.05, 0.05, 0))], 0);
    int nall = 0;
    for (size_t v = 0; v < nvert; ++v) nall += truth[v];
    assert_true(ntrue > 0.9 * nall);
    om_match_estimate_done(&e);
    free(truth);
    free(all);
    free(free_set);
    free(p);
    free(x);
    end(&rig);
}

static OmStatus update(void* ctx) {
    Rig* rig = ctx;
    OmMatchEstimate e;
    double* p = calloc((size_t)rig->twin.mesh.nvert, sizeof *p);
    OmMatchAdvice advice = {.probability = p, .weight = 0.5};
    OmStatus status = om_match_update_with(rig->match, 1, rig->acq, &advice, NULL, &e);
    free(p);
    om_match_estimate_done(&e);
    return status;
}

static void test_memory(void** state) {
    (void)state;
    Rig rig;
    begin(&rig);
    assert_ok(update(&rig));  // the shape at rest is kept
    test_failing_allocations(update, &rig, test_stride(7));
    end(&rig);
}

// A twin without attachments, and advice that agrees: tissue that stayed although the twin moved it is attached.
static void test_the_present_set_gains(void** state) {
    (void)state;
    Rig rig;
    begin(&rig);
    const int nvert = rig.twin.mesh.nvert;
    unsigned char *none = calloc((size_t)nvert, 1), *truth = malloc((size_t)nvert);
    double* p = malloc((size_t)nvert * sizeof *p);
    mark_true(&rig, truth);
    for (int v = 0; v < nvert; ++v) p[v] = 0.02;
    OmMatchAdvice advice = {.probability = p, .weight = 1, .present = none};
    OmMatchEstimate e;
    assert_ok(om_match_update_with(rig.match, 1, rig.acq, &advice, NULL, &e));
    int nright = 0, nwrong = 0;
    for (int v = 0; v < nvert; ++v) {
        nright += e.attached[v] && truth[v];
        nwrong += e.attached[v] && !truth[v];
    }
    printf("gained: choice %d, %d attached in truth, %d not\n", e.choice, nright, nwrong);
    assert_true(e.is_accepted && e.choice == 2 && nright > 5);
    // All that is attached now bears load, as springs by area do: at least a 25th of the largest.
    double most = 0, least = 1;
    for (int i = 0; i < rig.view->ncandidate; ++i) {
        const int v = rig.view->candidate[i];
        const double load =
            rig.view->area[i] * om_distance(om_load3(e.x, v), om_load3(rig.view->mesh->x, v));
        if (e.attached[v]) most = fmax(most, load), least = fmin(least, load);
    }
    printf("least load %.4f of the largest\n", least / most);
    assert_true(least > 0.04 * most);
    om_match_estimate_done(&e);
    free(none);
    free(truth);
    free(p);
    end(&rig);
}

// A scan that the twin explains to 0.1 mm: attachments that explain it wholly do not replace its own.
static void test_nearly_right(void** state) {
    (void)state;
    Rig rig;
    begin(&rig);
    const OmTetMesh* mesh = rig.view->mesh;
    const OmMeshSet* top = om_tet_mesh_find_set(&rig.twin.mesh, "top");
    unsigned char *truth = malloc((size_t)mesh->nvert), *more = calloc((size_t)mesh->nvert, 1);
    double* x = malloc(3 * sizeof *x * (size_t)mesh->nvert);
    OmMatchTrial trial;
    OmMatchEstimate e;
    OmAcquisition a = rig.acq[0];
    mark_true(&rig, truth);
    memcpy(x, rig.x_twin[0], 3 * sizeof *x * (size_t)mesh->nvert);
    assert_ok(om_match_try(rig.match, 1, &a, truth, x, &trial));
    for (int i = 0; i < top->nvert; ++i) om_store3(a.scan.x, i, om_load3(x, top->vert[i]));
    // only what faces the camera
    MatchTrier trier;
    assert_ok(om__match_trier_begin(rig.match, 1, &a, &trier));
    assert_ok(om__match_measure(&trier, x, &trial));
    a.scan.npoint = 0;
    for (int i = 0; i < top->nvert; ++i)
        if (trier.fit.distance[i] < 1e-5)
            om_store3(a.scan.x, a.scan.npoint++, om_load3(x, top->vert[i]));
    om__match_trier_done(&trier);
    assert_true(a.scan.npoint > top->nvert / 2);
    for (int is_far = 0; is_far < 2; ++is_far) {  // 10 and 30 mm too many
        for (int i = 0; i < rig.view->ncandidate; ++i) {
            const int v = rig.view->candidate[i];
            more[v] = mesh->x[3 * v] <= (is_far ? 0.025 : 0.005);
        }
        a.attached = more;
        OmMatchAdvice advice = {.nset = 1, .set = {truth}, .present = more};
        assert_ok(om_match_update_with(rig.match, 1, &a, &advice, NULL, &e));
        printf("%.2f -> %.2f mm: %s\n", 1e3 * e.before_mean, 1e3 * e.after_mean, e.reason);
        assert_true(e.after_mean < 1e-5 && e.before_mean > 1e-4);
        assert_int_equal(e.is_accepted, is_far);
        om_match_estimate_done(&e);
    }
    free(truth);
    free(more);
    free(x);
    end(&rig);
}

// A scan of softer tissue, held where the twin believes: other attachments imitate it, and do not replace these.
static void test_the_modulus_explains(void** state) {
    (void)state;
    Rig rig;
    begin(&rig);
    unsigned char* truth = malloc((size_t)rig.twin.mesh.nvert);
    OmScene scene = rig.scene;
    OmSite soft;
    scene.world.young_factor *= 0.5;
    assert_ok(om_site_build(&scene, OM_SITE_WORLD, NULL, &soft));
    OmAcquisition a = rig.acq[0];
    OmBody* body = lift(&scene, &soft, 1, &a.grasp[0]);
    om_scan_done(&rig.acq[0].scan);
    scan_body(body, &rig.acq[0].scan);
    om_body_destroy(body);
    om_site_done(&soft);
    mark_true(&rig, truth);
    a.scan = rig.acq[0].scan;
    a.attached = truth;
    a.x_twin = NULL;
    OmMatchAdvice advice = {.present = truth};
    OmMatchEstimate e;
    assert_ok(om_match_update_with(rig.match, 1, &a, &advice, NULL, &e));
    printf("softer: %s; before %.2f mm\n", e.reason, 1e3 * e.before_mean);
    assert_false(e.is_accepted);
    assert_true(e.after_mean < 0.5 * e.before_mean);  // others are much nearer
    assert_non_null(strstr(e.reason, "0.5 times the modulus"));
    om_match_estimate_done(&e);
    free(truth);
    end(&rig);
}

// Tissue that the scan shows 3 mm above its place is not at rest.
static void test_what_counts_as_still(void** state) {
    (void)state;
    Rig rig;
    begin(&rig);
    OmAcquisition a = rig.acq[0];
    const OmMeshSet* top = om_tet_mesh_find_set(&rig.twin.mesh, "top");
    OmScan scan;
    assert_ok(om_scan_init(top->nvert, 0, &scan));
    scan.has_camera = true;
    scan.camera = a.scan.camera;
    for (int i = 0; i < top->nvert; ++i) {
        OmVec3 x = om_load3(rig.twin.mesh.x, top->vert[i]);
        x.z += x.x < 0 ? 0.003 : 0.0008;
        om_store3(scan.x, i, x);
    }
    a.scan = scan;
    MatchTrier trier;
    MatchEvidence evidence;
    assert_ok(om__match_trier_begin(rig.match, 1, &a, &trier));
    assert_ok(om__match_evidence_begin(&trier, &evidence));
    assert_ok(om__match_find_evidence(&evidence, NULL));
    for (int i = 0; i < rig.view->ncandidate; ++i) {
        OmVec3 x = om_load3(rig.view->mesh->x, rig.view->candidate[i]);
        const bool is_resting = evidence.status[i] == 1;
        if (x.x < -0.02) assert_false(is_resting);
        if (x.x > 0.02 && fabs(x.x) < 0.055 && fabs(x.y) < 0.055) assert_true(is_resting);
    }
    om__match_evidence_done(&evidence);
    om__match_trier_done(&trier);
    om_scan_done(&scan);
    end(&rig);
}

// One of tissue that had slid before it was grasped is left out, too: the others still tell.
static void test_slid_tissue_is_left_out(void** state) {
    (void)state;
    Rig rig;
    begin(&rig);
    OmMatchEstimate one, two;
    OmAcquisition acq[2] = {rig.acq[1], rig.acq[0]};
    const int held = view_vertex(&rig, acq[0].grasp[0].pose_world_grasp.p);
    acq[0].grasp[0].vert = &held;
    acq[0].grasp[0].nvert = 1;
    acq[0].grasp[0].pose_world_grasp.p.x += 0.03;
    acq[0].grasp[0].pose_world_now.p.x += 0.03;
    assert_ok(om_match_update(rig.match, 1, acq + 1, NULL, &one));
    assert_ok(om_match_update(rig.match, 2, acq, NULL, &two));
    assert_true(one.is_accepted && two.is_accepted);
    assert_true(!two.verdict[0].is_good && two.verdict[1].is_good);
    assert_non_null(strstr(two.verdict[0].reason, "had moved by"));
    assert_memory_equal(one.attached, two.attached, (size_t)one.nvert);
    assert_memory_equal(one.probability, two.probability, (size_t)one.nvert * sizeof(double));
    om_match_estimate_done(&one);
    om_match_estimate_done(&two);
    end(&rig);
}

// Of two acquisitions, one whose camera has moved since the other is left out, and the estimate is that of the other.
static void test_one_is_left_out(void** state) {
    (void)state;
    Rig rig;
    begin(&rig);
    OmMatchEstimate one, two;
    OmAcquisition acq[2] = {rig.acq[0], rig.acq[1]};
    OmScan rest[2];
    const OmMeshSet* top = om_tet_mesh_find_set(&rig.twin.mesh, "top");
    for (int k = 0; k < 2; ++k) {
        assert_ok(om_scan_init(top->nvert, 0, &rest[k]));
        for (int i = 0; i < top->nvert; ++i) {
            OmVec3 x = om_load3(rig.twin.mesh.x, top->vert[i]);
            om_store3(rest[k].x, i, k ? om_add(x, om_vec3(0.004, 0, 0.012)) : x);
        }
        rest[k].has_camera = true;
        rest[k].camera = acq[k].scan.camera;
        acq[k].rest = &rest[k];
    }
    assert_ok(om_match_update(rig.match, 1, acq, NULL, &one));
    assert_ok(om_match_update(rig.match, 2, acq, NULL, &two));
    assert_true(one.is_accepted && two.is_accepted);
    assert_true(two.verdict[0].is_good && !two.verdict[1].is_good);
    assert_int_equal(two.verdict[1].cause, OM_MATCH_MOVED);
    assert_near(two.verdict[1].shift, 0.012,
                0.003);  // along the sheet a shift shows at its border alone
    assert_memory_equal(one.attached, two.attached, (size_t)one.nvert);
    assert_memory_equal(one.probability, two.probability, (size_t)one.nvert * sizeof(double));
    assert_memory_equal(one.x, two.x, 3 * (size_t)one.nnode * sizeof(double));
    om_match_estimate_done(&one);
    om_match_estimate_done(&two);
    const OmAcquisition swapped[2] = {acq[1], acq[0]};  // the wrong one first
    assert_ok(om_match_update(rig.match, 2, swapped, NULL, &two));
    assert_true(two.is_accepted && !two.verdict[0].is_good && two.verdict[1].is_good);
    om_match_estimate_done(&two);
    assert_ok(
        om_match_update(rig.match, 1, swapped, NULL, &two));  // alone: refused, with its reason
    assert_false(two.is_accepted);
    assert_non_null(strstr(two.reason, "calibrate the camera"));
    om_match_estimate_done(&two);
    om_scan_done(&rest[0]);
    om_scan_done(&rest[1]);
    end(&rig);
}

// Two workers give the bytes of one.
static void test_workers(void** state) {
    (void)state;
    Rig rig;
    begin(&rig);
    OmMatchEstimate a, b;
    assert_ok(om_match_update(rig.match, 1, rig.acq, NULL, &a));
    OmMatchDef def = om_match_default_def(&rig.scene, &rig.twin);
    def.nhypothesis = 500;
    def.nworker = 2;
    OmMatch* two;
    assert_int_equal(om_match_create(&def, &two), OM_OK);
    assert_ok(om_match_update(two, 1, rig.acq, NULL, &b));
    size_t size = (size_t)a.nvert * sizeof(double);
    assert_memory_equal(a.probability, b.probability, size);
    assert_memory_equal(a.x, b.x, 3 * size);
    om_match_estimate_done(&a);
    om_match_estimate_done(&b);
    om_match_destroy(two);
    end(&rig);
}

// Cover a part of the picture of the tissue: a class at a depth; returns the estimate.
static OmMatchEstimate covered(const Rig* rig, int class, float depth) {
    OmAcquisition acq = rig->acq[0];
    const int w = acq.scan.camera.width, h = acq.scan.camera.height;
    acq.scan.pixel = om_alloc((size_t)(w * h), 1);
    acq.scan.depth = om_calloc((size_t)(w * h), sizeof *acq.scan.depth);
    memset(acq.scan.pixel, OM_SCAN_TISSUE, (size_t)(w * h));
    for (int y = h / 4; y < 3 * h / 4; ++y)
        for (int x = w / 4; x < w / 2; ++x) {
            acq.scan.pixel[y * w + x] = (unsigned char)class;
            acq.scan.depth[y * w + x] = depth;
        }
    OmMatchEstimate e;
    OmStatus status = om_match_update(rig->match, 1, &acq, NULL, &e);
    assert_true(status >= 0);
    om_free(acq.scan.pixel);
    om_free(acq.scan.depth);
    return e;
}

// A cloth before the tissue hides it, as a tool does; the board behind it says that the tissue is gone.
static void test_what_lies_before_the_tissue(void** state) {
    (void)state;
    Rig rig;
    begin(&rig);
    OmMatchEstimate tool = covered(&rig, OM_SCAN_TOOL, 0.1F),
                    cloth = covered(&rig, OM_SCAN_OTHER, 0.1F),
                    board = covered(&rig, OM_SCAN_OTHER, 0.5F);
    const size_t size = (size_t)tool.nvert * sizeof *tool.probability;
    assert_memory_equal(tool.probability, cloth.probability, size);
    assert_memory_equal(tool.attached, cloth.attached, (size_t)tool.nvert);
    assert_memory_equal(tool.x, cloth.x, 3 * size);
    assert_true(tool.seen_share == cloth.seen_share && tool.after_mean == cloth.after_mean);
    assert_true(memcmp(tool.probability, board.probability, size) != 0);
    double sum[2] = {0, 0};
    for (int i = 0; i < tool.nvert; ++i)
        sum[0] += tool.probability[i], sum[1] += board.probability[i];
    assert_true(sum[1] < sum[0]);
    om_match_estimate_done(&tool);
    om_match_estimate_done(&cloth);
    om_match_estimate_done(&board);
    end(&rig);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_half),
                                       cmocka_unit_test(test_refusals),
                                       cmocka_unit_test(test_advice),
                                       cmocka_unit_test(test_sets),
                                       cmocka_unit_test(test_the_present_set_gains),
                                       cmocka_unit_test(test_the_modulus_explains),
                                       cmocka_unit_test(test_nearly_right),
                                       cmocka_unit_test(test_what_counts_as_still),
                                       cmocka_unit_test(test_one_is_left_out),
                                       cmocka_unit_test(test_slid_tissue_is_left_out),
                                       cmocka_unit_test(test_memory),
                                       cmocka_unit_test(test_workers),
                                       cmocka_unit_test(test_what_lies_before_the_tissue)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
