// test_match_adopt.c: a body takes over new attachments without a jump.
#include "match_sheet.h"

#include "omentum/match_adopt.h"
#include "test_alloc.h"

#define DT 0.02

typedef struct Rig {
    OmScene scene;
    OmSite site;
    OmBody* body;
    OmMatchAdoption* adoption;
    int nvert;
    unsigned char* attached;
    double* stiffness;
} Rig;

// A sheet held at x < -20 mm, its edge x > 0 lifted by 25 mm.
static void begin(Rig* rig) {
    build_sheet(12, &rig->scene, &rig->site);
    assert_int_equal(om_body_create(&rig->scene, &rig->site, 1, &rig->body), OM_OK);
    rig->nvert = rig->site.mesh.nvert;
    assert_int_equal(om_match_adoption_create(rig->nvert, &rig->adoption), OM_OK);
    rig->attached = calloc((size_t)rig->nvert, 1);
    rig->stiffness = calloc((size_t)rig->nvert, sizeof(double));
    OmPose from = {om_vec3(0.055, 0, 0.005), om_quat_identity()}, to = from;
    to.p.z += 0.025;
    OmBodyReport report;
    int nheld;
    assert_true(om_body_settle(rig->body, DT, 1e-3, 3) >= 0);
    assert_int_equal(om_body_grasp(rig->body, 0, from, 0.012, &nheld), OM_OK);
    for (int k = 1; k <= 60; ++k) {
        assert_int_equal(om_body_move(rig->body, 0, om_pose_lerp(from, to, k / 60.0)), OM_OK);
        assert_true(om_body_step(rig->body, DT, &report) >= 0);
    }
    assert_true(om_body_settle(rig->body, DT, 2e-4, 3) >= 0);
}

static void end(Rig* rig) {
    om_match_adoption_destroy(rig->adoption);
    om_body_destroy(rig->body);
    om_site_done(&rig->site);
    free(rig->attached);
    free(rig->stiffness);
}

// Vertices of the underside with lo <= y and x <= hi, by springs of 300 N/m.
static void want(Rig* rig, double lo, double hi, double stiffness) {
    const OmMeshSet* under = om_tet_mesh_find_set(&rig->site.mesh, "underside");
    memset(rig->attached, 0, (size_t)rig->nvert);
    for (int i = 0; i < under->nvert; ++i) {
        OmVec3 p = om_load3(rig->site.mesh.x, under->vert[i]);
        rig->attached[under->vert[i]] = p.y >= lo && p.x <= hi;
        rig->stiffness[under->vert[i]] = stiffness;
    }
}

// Step and measure: the largest displacement of a vertex in the step, and the resultant of the tool.
static double step(Rig* rig, double* force) {
    size_t n = 3 * (size_t)rig->nvert;
    double* before = malloc(n * sizeof *before);
    double most = 0;
    OmBodyReport report;
    OmBodyForces f;
    memcpy(before, om_body_x(rig->body), n * sizeof *before);
    assert_ok(om_match_adoption_step(rig->adoption, rig->body, DT));
    assert_true(om_body_step(rig->body, DT, &report) >= 0);
    for (int v = 0; v < rig->nvert; ++v)
        most = fmax(most, om_distance(om_load3(before, v), om_load3(om_body_x(rig->body), v)));
    assert_ok(om_body_get_forces(rig->body, &f));
    *force = fmax(om_norm(f.grasp[0]), om_norm(f.attachment));
    free(before);
    return most;
}

// Take the attachments over and check motion in the step of the change, forces and arrival.
static void adopt(Rig* rig, const char* name) {
    double force, first, most = 0, fastest = 0, before, after;
    step(rig, &before);
    assert_ok(
        om_match_adoption_begin(rig->adoption, rig->body, rig->attached, rig->stiffness, 0.5));
    first = step(rig, &force);
    int n = 1;
    for (; om_match_adoption_is_active(rig->adoption); ++n) {
        fastest = fmax(fastest, step(rig, &force));
        most = fmax(most, force);
    }
    assert_int_equal(n, 25);  // 0.5 s
    for (int k = 0; k < 100; ++k) {
        step(rig, &after);
        most = fmax(most, after);
    }
    double lag = 0;
    for (int v = 0; v < rig->nvert; ++v) {
        assert_int_equal(om_body_attached(rig->body)[v] != 0, rig->attached[v] != 0);
        double d = om_distance(om_load3(om_body_x(rig->body), v), om_load3(rig->site.mesh.x, v));
        if (rig->attached[v]) lag = fmax(lag, d);
    }
    printf(
        "%s: first step %.3f mm, fastest %.2f mm, force %.2f N, at most %.2f, then %.2f; lag %.2f mm\n",
        name, 1e3 * first, 1e3 * fastest, before, most, after, 1e3 * lag);
    assert_below(first, 5e-4);
    assert_below(most, 2 * fmax(before, after));
    assert_below(lag, 1e-3);
}

// Vertices that bear the tool's pull become fixed: they creep to the rest position, without a jump at the end.
static void test_loaded(void** state) {
    (void)state;
    Rig rig;
    begin(&rig);
    want(&rig, -1, 0.03, 0);
    double force, last = 0, lag = 0;
    assert_ok(om_match_adoption_begin(rig.adoption, rig.body, rig.attached, NULL, 0.5));
    for (int k = 0; k < 40; ++k) {
        double moved = step(&rig, &force);
        if (k >= 20) last = fmax(last, moved);
    }
    for (int v = 0; v < rig.nvert; ++v)
        if (rig.attached[v])
            lag = fmax(lag,
                       om_distance(om_load3(om_body_x(rig.body), v), om_load3(rig.site.mesh.x, v)));
    printf("loaded: at most %.2f mm in a step about the arrival, lag %.1e mm\n", 1e3 * last,
           1e3 * lag);
    assert_below(last, 1e-4);  // 0.2 mm if the vertices jump when their springs have arrived
    assert_below(lag, 1e-9);
    end(&rig);
}

static void test_change(void** state) {
    (void)state;
    Rig rig;
    begin(&rig);
    want(&rig, -1, 0.001, 300);
    adopt(&rig, "more, fixed to springs");
    want(&rig, 0.015, 0.025, 300);
    adopt(&rig, "elsewhere");
    want(&rig, -1, -0.02, 0);
    adopt(&rig, "the first, held still");
    end(&rig);
}

// A newer estimate in the middle of an adoption; a snapshot in the middle gives the same bytes again.
static void test_replace(void** state) {
    (void)state;
    Rig rig;
    begin(&rig);
    double force, most = 0;
    want(&rig, -1, 0.03, 300);
    assert_ok(om_match_adoption_begin(rig.adoption, rig.body, rig.attached, rig.stiffness, 0.5));
    for (int k = 0; k < 12; ++k) step(&rig, &force);
    void* body = malloc(om_body_state_size(rig.body));
    void* adoption = malloc(om_match_adoption_state_size(rig.adoption));
    om_body_save(rig.body, body);
    om_match_adoption_save(rig.adoption, adoption);
    uint64_t hash[2];
    for (int turn = 0; turn < 2; ++turn) {
        om_body_restore(rig.body, body);
        om_match_adoption_restore(rig.adoption, adoption);
        for (int k = 0; k < 20; ++k) step(&rig, &force);
        hash[turn] = om_body_hash(rig.body) ^ om_match_adoption_hash(rig.adoption);
    }
    assert_true(hash[0] == hash[1]);
    om_body_restore(rig.body, body);
    om_match_adoption_restore(rig.adoption, adoption);
    // The same step without a newer estimate.
    double going = step(&rig, &force);
    om_body_restore(rig.body, body);
    om_match_adoption_restore(rig.adoption, adoption);
    want(&rig, 0, 0, 300);
    assert_ok(om_match_adoption_begin(rig.adoption, rig.body, rig.attached, rig.stiffness, 0.5));
    double first = step(&rig, &force);
    printf("replaced: %.3f mm in the step, %.3f without\n", 1e3 * first, 1e3 * going);
    assert_below(first, going + 5e-4);
    while (om_match_adoption_is_active(rig.adoption)) most = fmax(most, step(&rig, &force));
    om_match_adoption_cancel(rig.adoption);
    assert_false(om_match_adoption_is_active(rig.adoption));
    free(body);
    free(adoption);
    end(&rig);
}

static void test_refusals(void** state) {
    (void)state;
    Rig rig;
    begin(&rig);
    want(&rig, -1, 0, 300);
    uint64_t hash = om_body_hash(rig.body);
    assert_status(om_match_adoption_begin(rig.adoption, rig.body, rig.attached, NULL, 0),
                  OM_INVALID);
    assert_status(om_match_adoption_begin(rig.adoption, rig.body, NULL, NULL, 1), OM_INVALID);
    rig.stiffness[0] = -1;
    assert_status(om_match_adoption_begin(rig.adoption, rig.body, rig.attached, rig.stiffness, 1),
                  OM_INVALID);
    assert_status(om_match_adoption_step(rig.adoption, rig.body, (double)NAN), OM_INVALID);
    assert_ok(om_match_adoption_step(rig.adoption, rig.body, DT));  // nothing is under way
    assert_true(om_body_hash(rig.body) == hash);
    OmMatchAdoption* other;
    assert_status(om_match_adoption_create(0, &other), OM_INVALID);
    assert_ok(om_match_adoption_create(5, &other));
    assert_status(om_match_adoption_begin(other, rig.body, rig.attached, NULL, 1), OM_INVALID);
    om_match_adoption_destroy(other);
    om_match_adoption_destroy(NULL);
    end(&rig);
}

static OmStatus make_and_begin(void* ctx) {
    Rig* rig = ctx;
    OmMatchAdoption* a;
    OM_TRY(om_match_adoption_create(rig->nvert, &a));
    OmStatus status = om_match_adoption_begin(a, rig->body, rig->attached, rig->stiffness, 0.5);
    if (status == OM_OK) status = om_match_adoption_step(a, rig->body, DT);
    om_match_adoption_destroy(a);
    return status;
}

static void test_memory(void** state) {
    (void)state;
    Rig rig;
    begin(&rig);
    want(&rig, -1, 0, 300);
    assert_true(test_failing_allocations(make_and_begin, &rig, 1) >= 5);
    end(&rig);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_change), cmocka_unit_test(test_loaded),
                                       cmocka_unit_test(test_replace),
                                       cmocka_unit_test(test_refusals),
                                       cmocka_unit_test(test_memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
