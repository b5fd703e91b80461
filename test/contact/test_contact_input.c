// test_contact_input.c: bad definitions, memory, allocations, workers, snapshots.
#include "test_rig.h"

#include "test_alloc.h"

static const OmContactPlane plane = {{0, 0, 0}, {0, 0, 1}};

static double wall(const void* ctx, OmVec3 p, OmVec3* gradient) {
    (void)ctx;
    *gradient = om_vec3(-1, 0, 0);
    return 0.021 - p.x;
}

static OmContactDef board_and_wall(OmTissueObstacle obstacle[2]) {
    OmContactDef def = om_contact_default_def();
    obstacle[0] = om_plane_obstacle(&plane);
    obstacle[1] = om_field_obstacle(wall, NULL);
    def.nobstacle = 2;
    def.obstacle = obstacle;
    return def;
}

static void start(TestRig* r, int nworker) {
    rig_box(r, om_vec3(-0.02, -0.02, 0.001), om_vec3(0.02, 0.02, 0.021), 4, 4, 2);
    r->def.solver.nworker = nworker;
    r->def.solver.tolerance = 1e-2;
    rig_start(r);
    OmTissueObstacle obstacle[2];
    OmContactDef def = board_and_wall(obstacle);
    rig_contact(r, &def);
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
    OmTissueObstacle o[2];
#define REFUSE(change, word) \
    def = board_and_wall(o); \
    change;                  \
    refuse(&r, &def, word)
    REFUSE(def.cookie = 0, "om_contact_default_def");
    REFUSE(def.nobstacle = -1, "nobstacle is -1");
    REFUSE(def.obstacle = NULL, "nobstacle");
    REFUSE(o[0] = om_plane_obstacle(NULL), "obstacle[0]: the plane is null");
    REFUSE(o[0] = om_plane_obstacle(&flat), "obstacle[0]: the plane's normal");
    REFUSE(o[0] = om_plane_obstacle(&blind), "obstacle[0]: the plane's normal");
    REFUSE(o[0] = om_plane_obstacle(&lost), "obstacle[0]: the plane's point");
    REFUSE(o[1] = om_sdf_obstacle(NULL), "obstacle[1]: the distance field");
    REFUSE(o[1].distance = NULL, "obstacle[1].distance");
    REFUSE(o[1].offset = -1e-3, "obstacle[1].offset");
    REFUSE(o[1].friction = 11, "obstacle[1].friction");
    REFUSE(o[1].friction = nan, "obstacle[1].friction");
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
    assert_status(om_contact_step(r.cw, r.m, r.s, r.w, -1, NULL), OM_INVALID);
    assert_status(om_contact_settle(r.cw, r.m, r.s, r.w, 0.02, 0, 1), OM_INVALID);
    assert_status(om_contact_settle(r.cw, r.m, r.s, r.w, 0, 1e-3, 1), OM_INVALID);
    assert_status(om_contact_settle(r.cw, r.m, r.s, r.w, -1, 1e-3, 1), OM_INVALID);
    assert_true(om_tissue_state_hash(r.s) == before);
    assert_status(om_contact_settle(r.cw, r.m, r.s, r.w, 0.02, 1e-3, 0.04), OM_NOT_CONVERGED);
    om_contact_work_destroy(NULL);
    om_contact_destroy(NULL);
    rig_done(&r);
}

static OmStatus make_contact(void* ctx) {
    const TestRig* r = ctx;
    OmTissueObstacle obstacle[2];
    OmContactDef def = board_and_wall(obstacle);
    OmContact* c;
    OmContactWork* cw = NULL;
    OmStatus status = om_contact_create(&def, r->m, &c);
    if (status == OM_OK) status = om_contact_work_create(c, &cw);
    if (status == OM_OK) status = om_contact_step(cw, r->m, r->s, r->w, 0.02, NULL);
    om_contact_work_destroy(cw);
    om_contact_destroy(c);
    return status;
}

static void test_memory(void** context) {
    (void)context;
    TestRig r;
    start(&r, 1);
    assert_int_equal(test_failing_allocations(make_contact, &r, 1), 19);
    test_count_begin();
    for (int n = 0; n < 20; ++n) assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, NULL));
    assert_int_equal(test_count_end(), 0);
    rig_done(&r);
}

// One contact serves two threads: bodies that are stepped in turn, each with scratch of its own, end as one alone.
static void test_shared(void** context) {
    (void)context;
    TestRig r;
    start(&r, 1);
    OmTissueState* other;
    OmTissueWork* work;
    OmContactWork* scratch;
    assert_ok(om_tissue_state_create(r.m, &other));
    assert_ok(om_tissue_work_create(r.m, &work));
    assert_ok(om_contact_work_create(r.c, &scratch));
    uint64_t hash[6];
    for (int n = 0; n < 6; ++n) {
        assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, NULL));
        hash[n] = om_tissue_state_hash(r.s);
    }
    om_tissue_state_reset(r.m, r.s);
    for (int n = 0; n < 6; ++n) {
        assert_ok(om_contact_step(scratch, r.m, other, work, 0.02, NULL));
        if (n > 0) assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, NULL));
        assert_true(om_tissue_state_hash(other) == hash[n]);
        if (n > 0) assert_true(om_tissue_state_hash(r.s) == hash[n - 1]);
    }
    om_contact_work_destroy(scratch);
    om_tissue_work_destroy(work);
    om_tissue_state_destroy(other);
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
        for (int n = 0; n < 3; ++n) assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, NULL));
        memcpy(copy, r.s, size);
        for (int n = 0; n < 4; ++n) assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, NULL));
        hash[k] = om_tissue_state_hash(r.s);
        om_contact_work_destroy(r.cw);
        om_contact_destroy(r.c);
        OmTissueObstacle obstacle[2];
        OmContactDef def = board_and_wall(obstacle);
        rig_contact(&r, &def);
        memcpy((void*)r.s, copy, size);
        for (int n = 0; n < 4; ++n) assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, NULL));
        assert_true(om_tissue_state_hash(r.s) == hash[k]);
        om_free(copy);
        rig_done(&r);
    }
    assert_true(hash[0] == hash[1]);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_definitions),
                                       cmocka_unit_test(test_memory), cmocka_unit_test(test_shared),
                                       cmocka_unit_test(test_same_bytes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
