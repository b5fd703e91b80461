// test_act_law.c: reaches and pulls by a motion law in place of straight lines.
#include "loop_rig.h"

#include "omentum/retract.h"

#define PIECE 0.004  // m

// A law that goes to the goal in pieces: first above it, then down.
typedef struct Law {
    int ncall, nreach, npull, nmotion;
    double straight;  // m, from the begin of each motion to its goal
    OmVec3 begin, goal;
    double step;      // m, of a place
    OmStatus answer;  // from call `at` on
    int at;
} Law;

static OmStatus next(void* ctx, const OmLoopMotion* m, OmVec3* place) {
    Law* law = ctx;
    ++law->ncall;
    if (m->nplace == 0) {
        ++law->nmotion;
        law->nreach += m->verb == OM_PLAN_REACH;
        law->npull += m->verb == OM_PLAN_PULL;
        law->straight += om_distance(m->tip, m->goal);
        law->begin = m->tip;
        if (m->verb == OM_PLAN_PULL) {  // straight up
            assert_near(m->goal.x, m->tip.x, 1e-3);
            assert_near(m->goal.y, m->tip.y, 1e-3);
            assert_true(m->goal.z > m->tip.z);
        }
    } else {
        assert_near(om_distance(m->goal, law->goal), 0, 1e-12);  // the same motion
    }
    law->goal = m->goal;
    OmVec3 way = om_sub(m->goal, m->tip);
    *place = om_norm(way) <= law->step ? m->goal : om_madd(m->tip, law->step / om_norm(way), way);
    return law->ncall > law->at ? law->answer : OM_OK;
}

static OmLoop* make_law_loop(Rig* g, Law* law) {
    OmLoopDef def = om_loop_default_def(&g->scene.task, g->world, g->twin, g->planner);
    def.truth = om_world_truth(g->world);
    def.law = (OmMotionLaw){law, next};
    OmLoop* loop;
    assert_ok(om_loop_create(&def, &loop));
    return loop;
}

static int count(const OmRetractResult* r, OmPlanVerb verb) {
    int n = 0;
    for (int i = 0; i < r->naction; ++i) n += r->action[i].verb == verb;
    return n;
}

// The law carries out every reach and pull, and the tips' way is that of its pieces.
static void test_pieces(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    Law law = {.step = PIECE, .at = 1000000};
    OmLoop* loop = make_law_loop(&g, &law);
    tick_to_end(loop);
    const OmRetractResult* r = om_loop_result(loop);
    print_message("%s: %d calls, %d reaches, %d pulls, way %.1f mm, straight %.1f mm\n", r->reason,
                  law.ncall, law.nreach, law.npull, 1e3 * r->effort.path, 1e3 * law.straight);
    assert_int_equal(r->outcome, OM_RETRACT_EXPOSED);
    assert_int_equal(law.nreach, count(r, OM_PLAN_REACH));
    assert_int_equal(law.npull, count(r, OM_PLAN_PULL));
    assert_true(law.ncall > 3 * law.nmotion);
    // no fold in this scene; the last pull may stop before its goal where the ROI is seen
    assert_int_equal(count(r, OM_PLAN_MOVE_AWAY) + count(r, OM_PLAN_MOVE_ROI), 0);
    assert_true(r->effort.path <= law.straight + 1e-3 * law.nmotion);
    assert_true(r->effort.path >= law.straight - g.scene.task.pull_step - 1e-3 * law.nmotion);
    om_loop_destroy(loop);
    rig_destroy(&g);
}

// A run with straight lines has a way, too: up, across and down are longer than the straight way of a reach.
static void test_lines(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    OmLoop* loop = make_loop(&g, NULL);
    tick_to_end(loop);
    double lines = om_loop_result(loop)->effort.path;
    om_loop_destroy(loop);
    rig_start(&g);
    Law law = {.step = PIECE, .at = 1000000};
    loop = make_law_loop(&g, &law);
    tick_to_end(loop);
    print_message("lines %.1f mm, law %.1f mm\n", 1e3 * lines,
                  1e3 * om_loop_result(loop)->effort.path);
    assert_true(lines > om_loop_result(loop)->effort.path + 0.002);
    assert_true(lines < 1);
    om_loop_destroy(loop);
    rig_destroy(&g);
}

// Run until a tick fails.
static OmStatus run_to_failure(Rig* g, Law* law) {
    OmStatus status = OM_OK;
    rig_start(g);
    OmLoop* loop = make_law_loop(g, law);
    while (status == OM_OK && om_loop_phase(loop) != OM_LOOP_ENDED) status = om_loop_tick(loop);
    om_loop_destroy(loop);
    return status;
}

// A place too far from the tip, and an error of the law, end the run; a run with records of observations is refused.
static void test_refused(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    Law far = {.step = 0.03, .at = 1000000}, failing = {.step = PIECE, .at = 5, .answer = OM_IO};
    assert_status(run_to_failure(&g, &far), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "the motion law gives a place 30 mm"));
    assert_status(run_to_failure(&g, &failing), OM_IO);
    OmRetractDef def = om_retract_default_def(&g.scene);
    OmRetractResult result;
    def.law = (OmMotionLaw){&far, next};
    def.out_dir = "/tmp/omentum-law-is-not-written";
    def.records_observations = true;
    assert_status(om_retract_run(&def, NULL, &result), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "cannot be replayed"));
    assert_false(om_path_exists(def.out_dir));
    rig_destroy(&g);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_pieces), cmocka_unit_test(test_lines),
                                       cmocka_unit_test(test_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
