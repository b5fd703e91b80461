// test_contact_input.c: bad definitions, memory, allocations, workers, snapshots.
#include "test_rig.h"

#include "test_alloc.h"

static const OmContactPlane board = {{0, 0, 0}, {0, 0, 1}};

static double wall(const void* ctx, OmVec3 p, OmVec3* gradient) {
    (void)ctx;
    *gradient = om_vec3(-1, 0, 0);
    return 0.021 - p.x;
}
static const OmContactField field = {wall, NULL};

static OmContactDef board_and_wall(void) {
    OmContactDef def = om_contact_default_def();
    def.nplane = 1;
    def.plane = &board;
    def.nfield = 1;
    def.field = &field;
    return def;
}

static void start(TestRig* r, int nworker) {
    rig_box(r, om_vec3(-0.02, -0.02, 0.001), om_vec3(0.02, 0.02, 0.021), 4, 4, 2);
    r->def.solver.nworker = nworker;
    r->def.solver.tolerance = 1e-2;
    rig_start(r);
    OmContactDef def = board_and_wall();
    assert_ok(om_contact_create(&def, r->m, &r->c));
}

static void refuse(const TestRig* r, const OmContactDef* def, const char* word) {
    OmContact* c = NULL;
    int64_t alive = om_alloc_alive();
    assert_status(om_contact_create(def, r->m, &c), OM_INVALID);
    assert_null(c);
    if (!strstr(om_error_message(), word)) fail_msg("no \"%s\" in: %s", word, om_error_message());
    assert_true(om_alloc_alive() == alive);
}

static void test_definitions(void** context) {
    (void)context;
    TestRig r;
    start(&r, 1);
    const double nan = (double)NAN;
    OmContactDef def;
    OmContactPlane flat = {{0, 0, 0}, {0, 0, 0}}, lost = {{0, nan, 0}, {0, 0, 1}},
                   blind = {{0, 0, 0}, {nan, 0, 1}};
    const OmSdf* none[1] = {NULL};
    const OmContactField empty = {NULL, NULL};
#define REFUSE(change, word) \
    def = board_and_wall();  \
    change;                  \
    refuse(&r, &def, word)
    REFUSE(def.cookie = 0, "om_contact_default_def");
    REFUSE(def.nplane = -1, "nplane is -1");
    REFUSE(def.plane = NULL, "nplane");
    REFUSE(def.plane = &flat, "plane[0].normal");
    REFUSE(def.plane = &blind, "plane[0].normal");
    REFUSE(def.plane = &lost, "plane[0].point");
    REFUSE(def.nsdf = 1, "nsdf");
    REFUSE((def.nsdf = 1, def.sdf = none), "sdf[0]");
    REFUSE(def.field = &empty, "field[0]");
    REFUSE(def.offset = -1e-3, "offset");
    REFUSE(def.offset = nan, "offset");
    REFUSE(def.stiffness = 0, "stiffness");
    REFUSE(def.recover_speed = 0, "recover_speed");
    REFUSE(def.friction = 11, "friction");
    REFUSE(def.friction = nan, "friction");
    REFUSE(def.max_iterations = 0, "max_iterations");
#undef REFUSE
    OmContact* c = NULL;
    assert_status(om_contact_create(NULL, r.m, &c), OM_INVALID);
    uint64_t before = om_tissue_state_hash(r.s);
    assert_status(om_contact_step(r.c, r.m, r.s, r.w, -1, NULL), OM_INVALID);
    assert_status(om_contact_settle(r.c, r.m, r.s, r.w, 0.02, 0, 1), OM_INVALID);
    assert_status(om_contact_settle(r.c, r.m, r.s, r.w, 0, 1e-3, 1), OM_INVALID);
    assert_status(om_contact_settle(r.c, r.m, r.s, r.w, -1, 1e-3, 1), OM_INVALID);
    assert_true(om_tissue_state_hash(r.s) == before);
    assert_status(om_contact_settle(r.c, r.m, r.s, r.w, 0.02, 1e-3, 0.04), OM_NOT_CONVERGED);
    om_contact_destroy(NULL);
    rig_done(&r);
}

static OmStatus make_contact(void* ctx) {
    const TestRig* r = ctx;
    OmContactDef def = board_and_wall();
    OmContact* c;
    OmStatus status = om_contact_create(&def, r->m, &c);
    if (status == OM_OK) status = om_contact_step(c, r->m, r->s, r->w, 0.02, NULL);
    om_contact_destroy(c);
    return status;
}

static void test_memory(void** context) {
    (void)context;
    TestRig r;
    start(&r, 1);
    assert_int_equal(test_failing_allocations(make_contact, &r, 1), 8);
    test_count_begin();
    for (int n = 0; n < 20; ++n) assert_ok(om_contact_step(r.c, r.m, r.s, r.w, 0.02, NULL));
    assert_int_equal(test_count_end(), 0);
    rig_done(&r);
}

// The state holds everything: from a copy, with another contact object and 1 or 2 workers, the same bytes.
static void test_same_bytes(void** context) {
    (void)context;
    uint64_t hash[2];
    for (int k = 0; k < 2; ++k) {
        TestRig r;
        start(&r, k + 1);
        size_t size = om_tissue_state_size(r.m);
        void* copy = om_alloc(size, 1);
        for (int n = 0; n < 3; ++n) assert_ok(om_contact_step(r.c, r.m, r.s, r.w, 0.02, NULL));
        memcpy(copy, r.s, size);
        for (int n = 0; n < 4; ++n) assert_ok(om_contact_step(r.c, r.m, r.s, r.w, 0.02, NULL));
        hash[k] = om_tissue_state_hash(r.s);
        om_contact_destroy(r.c);
        OmContactDef def = board_and_wall();
        assert_ok(om_contact_create(&def, r.m, &r.c));
        memcpy((void*)r.s, copy, size);
        for (int n = 0; n < 4; ++n) assert_ok(om_contact_step(r.c, r.m, r.s, r.w, 0.02, NULL));
        assert_true(om_tissue_state_hash(r.s) == hash[k]);
        om_free(copy);
        rig_done(&r);
    }
    assert_true(hash[0] == hash[1]);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_definitions),
                                       cmocka_unit_test(test_memory),
                                       cmocka_unit_test(test_same_bytes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
