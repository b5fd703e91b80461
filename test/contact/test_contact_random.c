// test_contact_random.c: falls, folds and pulls of random bodies: their surfaces never go through each other, no step
// fails, energy does not rise. OM_TEST_FROM and OM_TEST_TO choose cases.
#include "self_rig.h"

#define H 0.02

enum { FALL, FOLD, PULL, NKIND };
static const char* const kind_name[NKIND] = {"fall", "fold", "pull"};

typedef struct Tally {
    int nstep, nfar, ntouch;        // steps, not OK, those with contact
    int nsubstep, nrefused, nback;  // of tools: steps refused, steps held back
    double worst_gain;              // J over the energy at the beginning, of steps that are OK
} Tally;

typedef struct Play {
    TestRig r;
    OmRng rng;
    int at, kind;
    double friction;
    Tally* tally;
    double scale;  // J, of a fall
} Play;

static double between(Play* p, double lo, double hi) { return om_rng_range(&p->rng, lo, hi); }

// A rotation of any axis and angle.
static OmQuat any_rotation(Play* p) {
    return om_quat_normalize((OmQuat){om_rng_normal(&p->rng), om_rng_normal(&p->rng),
                                      om_rng_normal(&p->rng), om_rng_normal(&p->rng)});
}

// A box, a ball or a ring, turned at random, whose lowest point is at height z above (x, y).
static void add_body(Play* p, double x, double y, double z) {
    OmTetMesh mesh;
    uint32_t shape = om_rng_below(&p->rng, 4);
    double size = between(p, 0.012, 0.022);
    if (shape == 0)
        self_ball(om_vec3(0, 0, 0), 0.5 * size, 0.3 * size, &mesh);
    else if (shape == 1)
        self_ring(0.8 * size, 0.4 * size, 1, 10, &mesh);
    else
        assert_ok(om_tet_mesh_box(om_vec3(-0.5 * size, -0.5 * size, -0.3 * size),
                                  om_vec3(0.5 * size, 0.5 * size, 0.3 * size), 2, 2, 1, &mesh));
    OmPose turn = {om_vec3(0, 0, 0), any_rotation(p)};
    double lowest = INFINITY;
    for (int i = 0; i < mesh.nvert; ++i) {
        OmVec3 q = om_pose_apply(turn, om_load3(mesh.x, i));
        om_store3(mesh.x, i, q);
        lowest = fmin(lowest, q.z);
    }
    for (int i = 0; i < mesh.nvert; ++i)
        om_store3(mesh.x, i, om_add(om_load3(mesh.x, i), om_vec3(x, y, z - lowest)));
    self_append(&p->r.mesh, &mesh);
}

static bool is_left(OmVec3 q) { return q.x < 1e-9; }
static bool is_rim(OmVec3 q) {
    return q.z < 0.0099 && (fabs(q.x - 0.03) > 0.0299 || fabs(q.y - 0.03) > 0.0299);
}

static void begin(Play* p, const OmTissueObstacle* board) {
    uint32_t element = om_rng_below(&p->rng, 2);
    // quick: folds alone have quadratic elements
    bool is_quadratic = element && (test_is_slow() || p->kind == FOLD);
    self_default(&p->r, is_quadratic ? OM_ELEMENT_QUADRATIC : OM_ELEMENT_LINEAR);
    p->r.def.material_default.young = between(p, 1500, 8000);
    p->r.def.material_default.law =
        om_rng_below(&p->rng, 2) ? OM_COROTATIONAL : OM_STABLE_NEO_HOOKEAN;
    rig_start(&p->r);
    OmContactDef def = om_contact_default_def();
    if (board) def = rig_on(board);
    def.self_contact = true;
    def.self_friction = p->friction = om_rng_below(&p->rng, 3) ? between(p, 0, 0.6) : 0;
    def.friction = 0;
    rig_contact(&p->r, &def);
    self_assert_no_crossing(&p->r);
}

static void step(Play* p, bool is_driven) {
    OmContactReport report;
    double before = is_driven ? 0 : self_energy(&p->r);
    OmStatus status = om_contact_step(p->r.cw, p->r.m, p->r.s, p->r.w, H, &report);
    // counted: a tool that would push tissue through tissue is held back, not refused
    if (status == OM_INVALID && is_driven && om_tissue_nheld(p->r.s, 0) > 0) {
        ++p->tally->nrefused;
        om_tissue_release(p->r.s, 0);
        return;
    }
    if (status < 0)
        fail_msg("case %d, %s, step %d: %s", p->at, kind_name[p->kind],
                 (int)(om_tissue_time(p->r.s) / H + 0.5), om_error_message());
    Tally* t = p->tally;
    ++t->nstep;
    t->nsubstep += report.tissue.substeps;
    t->ntouch += report.ntouch > 0;
    if (getenv("OM_TEST_SHOW") && (status || report.tissue.substeps > 8))
        printf("case %d step %d: status %d, %d substeps, %d solves, %d places: %s\n", p->at,
               (int)(om_tissue_time(p->r.s) / H + 0.5), (int)status, report.tissue.substeps,
               report.nsolve, report.ntouch, status ? om_error_message() : "");
    t->nback += report.is_held_back;
    if (status != OM_OK) {
        ++t->nfar;
        return;
    }
    // where a tool moves, the step itself compares the gain with the work
    assert_false(report.tissue.is_unguarded);
    double gain = is_driven ? 0 : self_energy(&p->r) - before;
    t->worst_gain = fmax(t->worst_gain, gain / p->scale);
    if (gain > 0.01 * p->scale)
        fail_msg("case %d, %s: %.3g J gained, %.3g of the energy of the motion", p->at,
                 kind_name[p->kind], gain, gain / p->scale);
}

// One or two bodies thrown on a sheet or a block that is held at its rim, or on one that lies on a board.
static void play_fall(Play* p) {
    OmTissueObstacle board = om_plane_obstacle(&self_floor);
    double thick = between(p, 0.003, 0.0095);
    bool is_held = om_rng_below(&p->rng, 2) == 0;
    rig_box(&p->r, om_vec3(0, 0, 0), om_vec3(0.06, 0.06, thick), 4, 4, 1);
    uint32_t nbody = 1 + om_rng_below(&p->rng, 2);
    for (uint32_t k = 0; k < nbody; ++k)
        add_body(p, between(p, 0.02, 0.04), between(p, 0.02, 0.04), thick + 0.002 + 0.042 * k);
    if (is_held) self_attach(&p->r, is_rim);
    begin(p, is_held ? NULL : &board);
    double mass = self_mass(&p->r, 0);  // it sags, too
    for (uint32_t k = 1; k <= nbody; ++k) {
        double speed = between(p, 0, 0.5);
        self_throw(&p->r, (int)k, om_vec3(between(p, -0.2, 0.2), between(p, -0.2, 0.2), -speed));
        mass += self_mass(&p->r, (int)k);
    }
    p->scale = mass * (9.81 * 0.03 + 0.5 * 0.25);
    for (int n = 0; n < 30; ++n) step(p, false);
}

// Part of its way that a tool has gone after n of nstep steps: it reaches its speed in two steps and stops in two.
static double ramp(int n, int nstep) {
    double left = nstep - n, at = n < 2 ? 0.25 * n * n : n - 1;
    if (left < 2) at = nstep - 2 - 0.25 * left * left;
    return at / (nstep - 2);
}

// A strip, held at one end, is grasped at the other and carried over in a half circle, beyond it, and released.
static void play_fold(Play* p) {
    OmTissueObstacle board = om_plane_obstacle(&self_floor);
    double length = between(p, 0.05, 0.08), width = between(p, 0.01, 0.02),
           thick = between(p, 0.002, 0.005), speed = between(p, 0.15, 0.5);
    rig_box(&p->r, om_vec3(0, 0, 0), om_vec3(length, width, thick), 8, 2, 1);
    self_attach(&p->r, is_left);
    begin(p, &board);
    double middle = between(p, 0.3, 0.6) * length, arm = length - 0.002 - middle,
           turn = between(p, 0.8, 1.05) * OM_PI;
    OmPose tip = {om_vec3(middle + arm, 0.5 * width, 0.5 * thick), om_quat_identity()};
    assert_ok(om_tissue_grasp(p->r.m, p->r.s, 0, tip, 0.007, NULL));
    int nstep = 2 + (int)ceil(turn * arm / (speed * H));
    for (int n = 1; n <= nstep; ++n) {
        double angle = turn * ramp(n, nstep);
        tip.p = om_vec3(middle + arm * cos(angle), 0.5 * width,
                        0.5 * thick + fmax(arm * sin(angle), 2 * thick * n / nstep));
        tip.q = om_quat_axis_angle(om_vec3(0, 1, 0), -angle);
        assert_ok(om_tissue_move_grasp(p->r.s, 0, tip));
        step(p, true);
    }
    om_tissue_release(p->r.s, 0);
    for (int n = 0; n < 12; ++n) step(p, true);
}

// A body that lies on a block is grasped and dragged over it, down into it and away.
static void play_pull(Play* p) {
    OmTissueObstacle board = om_plane_obstacle(&self_floor);
    rig_box(&p->r, om_vec3(0, 0, 0), om_vec3(0.06, 0.06, 0.0095), 4, 4, 1);
    add_body(p, 0.03, 0.03, 0.0095 + 0.0015);
    self_attach(&p->r, is_rim);
    begin(p, &board);
    for (int n = 0; n < 6; ++n) step(p, true);
    OmPose tip = {self_mean(&p->r, 1, om_tissue_x(p->r.s)), om_quat_identity()};
    double top = 0;
    for (int i = 0; i < om_tissue_mesh(p->r.m)->nvert; ++i) {
        OmVec3 q = om_load3(om_tissue_x(p->r.s), i);
        if (om_contact_body_of(p->r.c, i) != 1 || q.z < top) continue;
        top = q.z;
        tip.p = q;
    }
    assert_ok(om_tissue_grasp(p->r.m, p->r.s, 0, tip, 0.006, NULL));
    double speed = between(p, 0.05, 0.5), angle = between(p, 0, 2 * OM_PI),
           down = between(p, 0, 0.006);
    int nstep = 2 + (int)ceil(0.04 / (speed * H));
    for (int n = 1; n <= nstep; ++n) {
        double part = ramp(n, nstep);
        OmPose at = tip;
        at.p = om_add(tip.p, om_vec3(0.04 * part * cos(angle), 0.04 * part * sin(angle),
                                     -down * sin(OM_PI * part)));
        assert_ok(om_tissue_move_grasp(p->r.s, 0, at));
        step(p, true);
    }
    om_tissue_release(p->r.s, 0);
    for (int n = 0; n < 10; ++n) step(p, true);
}

// No surface goes through another or, but for neighbours in a crumpled part, through itself: a step of new memory
// refuses such a state. Returns whether neighbours cross.
static bool assert_apart(Play* p) {
    OmContactWork* fresh;
    int num;
    OmVec3 at;
    assert_ok(om_contact_work_create(p->r.c, &fresh));
    assert_ok(om_contact_find_crossing(fresh, p->r.s, &num, &at));
    OmStatus status = om_contact_step(fresh, p->r.m, p->r.s, p->r.w, H, NULL);
    if (status < 0) fail_msg("case %d, %s: %s", p->at, kind_name[p->kind], om_error_message());
    om_contact_work_destroy(fresh);
    return num > 0;
}

static void test_random_falls_folds_and_pulls(void** state) {
    (void)state;
    Tally tally[NKIND] = {{0}};
    int ncrumpled = 0, nstep = 0, nfar = 0, nrefused = 0, nback = 0;
    const char *from = getenv("OM_TEST_FROM"), *to = getenv("OM_TEST_TO");
    int begin_at = from ? atoi(from) : 0, end = to ? atoi(to) : test_count(12, 500);
    for (int k = begin_at; k < end; ++k) {
        Play p = {.rng = om_rng_init(3600, (uint64_t)k), .at = k, .kind = k % NKIND};
        p.tally = &tally[p.kind];
        if (p.kind == FALL) play_fall(&p);
        if (p.kind == FOLD) play_fold(&p);
        if (p.kind == PULL) play_pull(&p);
        ncrumpled += assert_apart(&p);
        if (getenv("OM_TEST_SHOW")) printf("case %d done\n", k);
        rig_done(&p.r);
    }
    for (int k = 0; k < NKIND; ++k) {
        const Tally* t = &tally[k];
        printf(
            "%s: %d steps, %d with contact, %.2f substeps each, %d (%.2f %%) not OK, energy gain at "
            "most %.2g\n",
            kind_name[k], t->nstep, t->ntouch, (double)t->nsubstep / t->nstep, t->nfar,
            100.0 * t->nfar / t->nstep, t->worst_gain);
        nstep += t->nstep;
        nfar += t->nfar;
        nrefused += t->nrefused;
        nback += t->nback;
    }
    printf("%d cases; neighbours cross in %d, tools are refused in %d, held back in %d steps\n",
           end - begin_at, ncrumpled, nrefused, nback);
    assert_true(nfar <= 0.02 * nstep);
    assert_int_equal(nrefused, 0);
    assert_int_equal(ncrumpled, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_random_falls_folds_and_pulls)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
