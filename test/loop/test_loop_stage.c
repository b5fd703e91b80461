// test_loop_stage.c: every edge of the stages is walked, and the drawing in the manual is that of the code.
//
// A loop after its first tick is put into a stage with the evidence that leads to the next one; the loop then decides.
#include <math.h>
#include <string.h>

#include "loop/loop_state.h"
#include "warn_rig.h"

static Course course;
static unsigned walked[NSTAGE];

static int open_rig(void** state) {
    (void)state;
    OmScene scene = warn_scene(2e-3, 4e-3, 6e-3);
    course_begin(&course, scene, true, true);
    return 0;
}

static int close_rig(void** state) {
    (void)state;
    om_loop_destroy(course.loop);
    om_updater_destroy(course.updater);
    om_monitor_destroy(course.monitor);
    rig_destroy(&course.g);
    return 0;
}

// A loop after its first tick, with one arm that holds tissue of block 0, in the middle of a plan of two releases.
static OmLoop* stand(Stage stage) {
    OmLoop* loop = course.loop;
    om_loop_destroy(loop);
    rig_start(&course.g);
    OmLoopDef def =
        om_loop_default_def(&course.g.scene.task, course.g.world, course.g.twin, course.g.planner);
    def.updater = course.updater;
    def.monitor = course.monitor;
    def.is_attended = true;
    assert_ok(om_loop_create(&def, &course.loop));
    loop = course.loop;
    assert_ok(om_loop_tick(loop));
    assert_true(loop->stage == STAGE_ACTION);
    om__act_stop(&loop->act);
    loop->stage = stage;
    memset(loop->walked, 0, sizeof loop->walked);
    const OmPlanAction release = {OM_PLAN_RELEASE, 0, -1, 0};
    loop->plan.naction = 2;
    loop->plan.action[0] = loop->plan.action[1] = release;
    loop->action_index = 0;
    loop->act.visibility = 0;
    loop->act.action = (Action){.plan = release, .step = 3, .nwait = 1, .outcome = OM_ACTION_DONE};
    loop->belief.look_begin = loop->belief.learn_begin = loop->act.time - 100;
    return loop;
}

static void decide(OmLoop* loop, Stage from, Stage to) {
    assert_true(om__loop_decide(loop) >= 0);
    assert_false(loop->astray[0]);
    if (!(loop->walked[from] >> to & 1)) fail_msg("no step from stage %d to %d", from, to);
    for (int k = 0; k < NSTAGE; ++k) walked[k] |= loop->walked[k];
}

static void see(OmLoop* loop) {
    loop->act.visibility = 1;
    loop->visible_since = loop->verify_begin = loop->act.time - 1;
    loop->look_age = 0;
}

static void make_last(OmLoop* loop) { loop->plan.naction = 1; }

// An action that a warning stopped, with tissue in hand.
static OmLoop* stand_warned(OmPlanVerb verb, int state) {
    OmLoop* loop = stand(STAGE_ACTION);
    loop->act.action = (Action){.plan = {verb, 0, 0, 0}, .outcome = OM_ACTION_DONE};
    loop->act.arm[0].in_hand = 0;
    loop->act.arm[0].lift = 0.05;
    loop->act.motion.is_easing = false;
    loop->belief.warn.state = state;
    loop->belief.warning_action = state;
    return loop;
}

// ---- rows ---------------------------------------------------------------------------------------------------------

static void at_the_begin(void** state) {
    (void)state;
    see(stand(STAGE_BEGIN));
    decide(course.loop, STAGE_BEGIN, STAGE_VERIFY);
    decide(stand(STAGE_BEGIN), STAGE_BEGIN, STAGE_PLAN);
}

static void verification(void** state) {
    (void)state;
    OmLoop* loop = stand(STAGE_VERIFY);  // before any action
    see(loop);
    decide(loop, STAGE_VERIFY, STAGE_ENDED);
    assert_int_equal(loop->result.outcome, OM_RETRACT_IN_VIEW);
    loop = stand(STAGE_VERIFY);
    loop->verify_begin = loop->act.time - 2 * VERIFY_LIMIT;
    decide(loop, STAGE_VERIFY, STAGE_PLAN);
    loop = stand(STAGE_VERIFY);  // after one
    loop->result.naction = 1;
    see(loop);
    decide(loop, STAGE_VERIFY, STAGE_ENDED);
    assert_int_equal(loop->result.outcome, OM_RETRACT_EXPOSED);
    loop = stand(STAGE_VERIFY);  // it closed: the motion continues
    loop->result.naction = 1;
    loop->act.action.outcome = OM_ACTION_EXPOSED;
    loop->verify_begin = loop->act.time - 2 * VERIFY_LIMIT;
    decide(loop, STAGE_VERIFY, STAGE_NEXT_ACTION);
    assert_int_equal(loop->act.ncontinued, 1);
    loop = stand(STAGE_VERIFY);  // it stays for a moment: the loop waits
    see(loop);
    loop->visible_since = loop->act.time;
    loop->verify_begin = loop->act.time;
    assert_ok(om__loop_decide(loop));
    assert_true(loop->stage == STAGE_VERIFY);
}

static void plans(void** state) {
    (void)state;
    decide(stand(STAGE_PLAN), STAGE_PLAN, STAGE_NEXT_ACTION);
    assert_true(course.loop->walked[STAGE_NEXT_ACTION] >> STAGE_ACTION & 1);
    OmLoop* loop = stand(STAGE_PLAN);
    loop->needs_approval = true;
    decide(loop, STAGE_PLAN, STAGE_CONSENT);
    loop = stand(STAGE_PLAN);
    loop->result.naction = loop->task.max_actions;
    decide(loop, STAGE_PLAN, STAGE_ENDED);
    assert_int_equal(loop->result.outcome, OM_RETRACT_GAVE_UP);
    // no point is left: every one was tried
    loop = stand(STAGE_PLAN);
    for (int b = 0; b < OM_PLAN_MAX_BLOCK; ++b) loop->belief.tried[b] = OM_TRIED_GRASP;
    decide(loop, STAGE_PLAN, STAGE_ENDED);
    assert_int_equal(loop->result.outcome, OM_RETRACT_NO_PLAN);
    // all are attached, by an estimate
    loop = stand(STAGE_PLAN);
    loop->belief.updater->nestimate = 1;
    const OmMeshSet* under = om_tet_mesh_find_set(&om_body_site(loop->twin)->mesh, "underside");
    assert_ok(om_body_set_attachment(loop->twin, under->nvert, under->vert, NULL, NULL));
    decide(loop, STAGE_PLAN, STAGE_DOUBT);
    loop = stand(STAGE_DOUBT);
    decide(loop, STAGE_DOUBT, STAGE_PLAN);
    loop = stand(STAGE_NEXT_ACTION);
    assert_ok(give(loop, OM_LOOP_REPLAN));
    decide(loop, STAGE_NEXT_ACTION, STAGE_PLAN);
}

static void consent(void** state) {
    (void)state;
    OmLoop* loop = stand(STAGE_CONSENT);
    assert_ok(give(loop, OM_LOOP_APPROVE));
    decide(loop, STAGE_CONSENT, STAGE_NEXT_ACTION);
    loop = stand(STAGE_CONSENT);
    assert_ok(give(loop, OM_LOOP_REJECT));
    decide(loop, STAGE_CONSENT, STAGE_PLAN);
}

static void after_an_action(void** state) {
    (void)state;
    decide(stand(STAGE_ACTION), STAGE_ACTION, STAGE_NEXT_ACTION);
    make_last(stand(STAGE_ACTION));
    decide(course.loop, STAGE_ACTION, STAGE_PLAN);
    see(stand(STAGE_ACTION));
    decide(course.loop, STAGE_ACTION, STAGE_VERIFY);
    decide(stand_warned(OM_PLAN_PULL, 2), STAGE_ACTION, STAGE_LOOK);
    OmLoop* loop = stand_warned(OM_PLAN_PULL, 2);
    loop->act.arm[0].lift = 0;
    decide(loop, STAGE_ACTION, STAGE_LEARN);
}

static void after_a_look(void** state) {
    (void)state;
    OmLoop* loop = stand(STAGE_LOOK);
    loop->belief.warning_action = 1;
    decide(loop, STAGE_LOOK, STAGE_LEARN);                     // it is answered
    decide(stand(STAGE_LOOK), STAGE_LOOK, STAGE_NEXT_ACTION);  // without a warning it waits for one
    loop = stand(STAGE_LOOK);
    loop->belief.warning_action = 1;
    loop->plan.action[1].verb = OM_PLAN_PULL;  // waits, too
    decide(loop, STAGE_LOOK, STAGE_LEARN);
    see(stand(STAGE_LOOK));
    decide(course.loop, STAGE_LOOK, STAGE_VERIFY);
    loop = stand(STAGE_LOOK);
    loop->has_slipped = loop->belief.is_looking = true;
    decide(loop, STAGE_LOOK, STAGE_PLAN);
    assert_false(loop->belief.is_looking);  // nothing is awaited any more
}

static void after_learning(void** state) {
    (void)state;
    decide(stand(STAGE_LEARN), STAGE_LEARN, STAGE_NEXT_ACTION);
    make_last(stand(STAGE_LEARN));
    decide(course.loop, STAGE_LEARN, STAGE_PLAN);
    see(stand(STAGE_LEARN));
    decide(course.loop, STAGE_LEARN, STAGE_VERIFY);
}

// Every stage may be left for a person, who continues or ends the operation.
static void every_stage_may_be_held(void** state) {
    (void)state;
    for (int s = 0; s < STAGE_HOLD; ++s) {
        OmLoop* loop = stand((Stage)s);
        loop->act.action.plan.verb = OM_PLAN_PULL;  // a jaw would complete its motion
        loop->act.action.plan.block = 0;
        om__loop_alarm(loop, OM_HOLD_STALE, "a test");
        assert_ok(om__loop_check_hold(loop));
        assert_true(loop->stage == STAGE_HOLD);
        assert_ok(om__loop_end_hold(loop));
        assert_true(loop->stage == (s == STAGE_ACTION ? STAGE_PLAN : (Stage)s));
        loop = stand((Stage)s);
        assert_ok(om__loop_stop(loop, OM_RETRACT_ABORTED));
        assert_true(loop->stage == STAGE_ENDED);
        assert_false(loop->astray[0]);
    }
}

// A motion that is resumed after a pause may find its goal out of reach: its next check says so.
static void a_goal_out_of_reach_stays_so(void** state) {
    (void)state;
    OmLoop* loop = stand_warned(OM_PLAN_PULL, 0);
    bool is_done = false;
    loop->act.motion = (Motion){.arm = 0,
                                .is_holding = true,
                                .outcome = OM_ACTION_UNREACHED,
                                .nplace = -1,
                                .watch = {1, 0.05, 0}};
    loop->act.arm[0].is_moving = false;
    assert_ok(om__motion_check(&loop->act, &is_done));
    assert_true(is_done);
    assert_int_equal(loop->act.motion.outcome, OM_ACTION_UNREACHED);
}

static void every_edge_was_walked(void** state) {
    (void)state;
    int n, nwalked = 0;
    const StageEdge* e = om__loop_edges(&n);
    for (int k = 0; k < n; ++k) {
        if (!(walked[e[k].from] >> e[k].to & 1))
            fail_msg("nothing leads from stage %d to %d (%s)", e[k].from, e[k].to, e[k].when);
    }
    // and no other one, but to HOLD and ENDED
    for (int from = 0; from < NSTAGE; ++from)
        for (int to = 0; to < STAGE_HOLD; ++to) nwalked += walked[from] >> to & 1;
    int nother = 0;
    for (int k = 0; k < n; ++k) nother += e[k].to < STAGE_HOLD;
    assert_int_equal(nwalked, nother);
}

static void an_edge_that_is_none_ends_the_run(void** state) {
    (void)state;
    OmLoop* loop = stand(STAGE_ACTION);
    om__loop_go(loop, STAGE_DOUBT);
    assert_status(om_loop_tick(loop), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "DOUBT"));
}

static void the_manual_has_the_drawing(void** state) {
    (void)state;
    OmText text = {0};
    char* page = NULL;
    size_t size;
    assert_ok(om__loop_draw(&text));
    assert_ok(om_file_read("doc/defras.md", 1 << 20, &page, &size));
    if (!strstr(page, text.str)) fail_msg("doc/defras.md should have:\n%s", text.str);
    om_free(page);
    om_text_done(&text);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(at_the_begin),
        cmocka_unit_test(verification),
        cmocka_unit_test(plans),
        cmocka_unit_test(consent),
        cmocka_unit_test(after_an_action),
        cmocka_unit_test(after_a_look),
        cmocka_unit_test(after_learning),
        cmocka_unit_test(every_stage_may_be_held),
        cmocka_unit_test(a_goal_out_of_reach_stays_so),
        cmocka_unit_test(every_edge_was_walked),  // by those above
        cmocka_unit_test(an_edge_that_is_none_ends_the_run),
        cmocka_unit_test(the_manual_has_the_drawing),
    };
    return cmocka_run_group_tests(tests, open_rig, close_rig);
}
