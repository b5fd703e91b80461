// test_record_audit.c: the audit of a loop, and its events in a surgeon's words.
#include "test_alloc.h"

#include "hidden_world.h"
#include "loop_rig.h"

#include "loop/loop_state.h"
#include "omentum/record_audit.h"
#include "omentum/record_words.h"

// ---- a run with an audit ----------------------------------------------------------------------------------------

static OmAudit* make_audit(OmPlanner* planner) {
    OmAuditDef def = om_audit_default_def(planner);
    OmAudit* audit;
    assert_ok(om_audit_create(&def, &audit));
    return audit;
}

// What a listener saw, for comparison with the lines.
typedef struct Seen {
    int nplan, nbegin, nend;
    OmSituation first;
    OmPlan plan;
    uint64_t twin;  // hash at the last end of an action
    const OmBody* body;
} Seen;

static OmStatus seen_plan(void* ctx, const OmLoop* loop, const OmSituation* s, const OmPlan* plan) {
    Seen* seen = ctx;
    (void)loop;
    if (seen->nplan++ == 0) {
        seen->first = *s;
        seen->plan = *plan;
    }
    return OM_OK;
}
static OmStatus seen_begin(void* ctx, const OmLoop* loop, const OmPlanAction* action) {
    (void)loop, (void)action;
    ++((Seen*)ctx)->nbegin;
    return OM_OK;
}
static OmStatus seen_end(void* ctx, const OmLoop* loop, const OmRetractAction* action) {
    Seen* seen = ctx;
    (void)loop, (void)action;
    ++seen->nend;
    seen->twin = om_body_hash(seen->body);
    return OM_OK;
}

static int count(const char* text, const char* part) {
    int num = 0;
    for (; (text = strstr(text, part)) != NULL; text += strlen(part)) ++num;
    return num;
}

static char* run_audited(Rig* g, OmWorld* world, OmBody* truth, Seen* seen) {
    OmAudit* audit = make_audit(g->planner);
    OmLoopListener listener[2] = {om_audit_listener(audit),
                                  {.ctx = seen,
                                   .on_plan = seen_plan,
                                   .on_action_begin = seen_begin,
                                   .on_action_end = seen_end}};
    OmLoopDef def = om_loop_default_def(&g->scene.task, world, g->twin, g->planner);
    OmLoop* loop;
    *seen = (Seen){.body = g->twin};
    def.truth = truth;
    def.listener = listener;
    def.nlistener = 2;
    assert_ok(om_loop_create(&def, &loop));
    tick_to_end(loop);
    om_loop_destroy(loop);
    char* text = strdup(om_audit_text(audit));
    const char* story = om_audit_story(audit);  // a line for each sentence but those of begins
    assert_int_equal(count(story, "\n"),
                     count(text, "\"words\"") - count(text, "{\"event\": \"begin\""));
    assert_non_null(strstr(story, " s  The region of interest is exposed: "));
    om_audit_destroy(audit);
    return text;
}

// Braces and brackets match outside of strings, and a line ends where its object ends.
static void check_lines(const char* text) {
    int depth = 0;
    bool is_string = false;
    for (const char* p = text; *p; ++p) {
        if (is_string && *p == '\\') {
            ++p;
            continue;
        }
        if (*p == '"') is_string = !is_string;
        if (is_string) {
            assert_true((unsigned char)*p >= ' ');
            continue;
        }
        depth += (*p == '{') + (*p == '[') - (*p == '}') - (*p == ']');
        assert_true(depth >= 0 && (*p != '\n' || depth == 0));
        if (depth == 0 && *p == '}') assert_true(p[1] == '\n');
    }
    assert_true(depth == 0 && !is_string);
}

// The facts of the first plan are those of the situation, each under its source.
static void check_facts(const char* text, const Seen* seen) {
    const OmSituation* s = &seen->first;
    const char* plan = strstr(text, "{\"event\": \"plan\"");
    char* line = strndup(plan, strcspn(plan, "\n"));
    const char* twin = strstr(line, "\"twin\": {");
    const char* patient = strstr(line, "\"patient\": {");
    assert_true(twin && patient && twin < patient);
    char* from_twin = strndup(twin, (size_t)(patient - twin));
    int nfixed = 0;
    for (int b = 0; b < s->n * s->n; ++b) {
        char block[32];
        snprintf(block, sizeof block, "[%d, %d]", b % s->n + 1, b / s->n + 1);
        assert_int_equal(strstr(from_twin, block) != NULL, s->is_fixed[b]);
        nfixed += s->is_fixed[b];
    }
    assert_true(nfixed > 0 && nfixed < s->n * s->n);
    int nreach = 0;
    for (int b = 0; b < s->n * s->n; ++b)
        nreach += (s->reachable[b] & 1) + (s->reachable[b] >> 1 & 1) + s->is_above_roi[b];
    const char* memory = strstr(patient, "\"memory\"");
    char* from_patient = strndup(patient, (size_t)(memory - patient));
    // blocks and the brackets around the three lists
    assert_int_equal(count(from_patient, "["), nreach + 3);
    assert_int_equal(count(line, "{\"action\": "), seen->plan.naction);
    free(from_patient);
    free(from_twin);
    free(line);
}

static void test_a_line_for_each_decision(void** state) {
    (void)state;
    Rig g;
    Seen seen, again;
    rig_create(&g, object_scene());
    char* text = run_audited(&g, g.world, om_world_truth(g.world), &seen);
    check_lines(text);
    check_facts(text, &seen);
    assert_int_equal(count(text, "{\"event\": \"head\""), 1);
    assert_int_equal(count(text, "{\"event\": \"plan\""), seen.nplan);
    assert_int_equal(count(text, "{\"event\": \"begin\""), seen.nbegin);
    assert_int_equal(count(text, "{\"event\": \"action\""), seen.nend);
    assert_int_equal(count(text, "{\"event\": \"end\""), 1);
    char hash[40];
    snprintf(hash, sizeof hash, "\"twin\": \"%016llx\"", (unsigned long long)seen.twin);
    assert_true(count(text, hash) >= 1);
    assert_true(strncmp(text, "{\"event\": \"head\"", 16) == 0);
    // Another run, whose truth is hidden: no line comes from it.
    rig_start(&g);
    HiddenWorld hidden = hidden_world(g.world, om_world_sources(g.world));
    char* same = run_audited(&g, &hidden.head, NULL, &again);
    assert_string_equal(text, same);
    free(text);
    free(same);
    rig_destroy(&g);
}

static void test_a_file_of_its_own(void** state) {
    (void)state;
    Rig g;
    OmAudit* audit;
    char path[64];
    snprintf(path, sizeof path, "/tmp/omentum-test-audit-%ld", (long)getpid());
    rig_create(&g, object_scene());
    OmAuditDef def = om_audit_default_def(g.planner);
    def.path = path;
    for (int k = 0; k < 2; ++k) {
        assert_ok(om_audit_create(&def, &audit));
        OmLoopListener listener = om_audit_listener(audit);
        rig_start(&g);
        OmLoop* loop = make_loop(&g, &listener);
        assert_status(om_loop_tick(loop), k ? OM_IO : OM_OK);  // the file exists
        if (k == 0) {
            char* text;
            size_t size;
            assert_ok(om_file_read(path, 1 << 20, &text, &size));  // flushed
            assert_string_equal(text, om_audit_text(audit));
            assert_true(count(text, "\n") >= 3);
            om_free(text);
        }
        om_loop_destroy(loop);
        om_audit_destroy(audit);
    }
    remove(path);
    def.cookie = 0;
    assert_status(om_audit_create(&def, &audit), OM_INVALID);
    rig_destroy(&g);
}

// Lines of a loop that is not run.
static OmStatus write_lines(void* ctx) {
    const OmLoop* loop = ctx;
    OmAudit* audit;
    OmAuditDef def = om_audit_default_def(NULL);
    const OmPlan plan = {.n = loop->grid.n, .grasp_block = -1};
    OM_TRY(om_audit_create(&def, &audit));
    OmLoopListener l = om_audit_listener(audit);
    OmSituation s;
    om_situation_init(&s, loop->grid.n, 0.02);
    OmStatus status = l.on_begin(l.ctx, loop);
    if (status >= 0) status = l.on_plan(l.ctx, loop, &s, &plan);
    if (status >= 0) status = l.on_command(l.ctx, loop, &(OmLoopCommand){OM_LOOP_ABORT});
    if (status >= 0) status = l.on_hold(l.ctx, loop, OM_HOLD_TOOL, "it is lost");
    if (status >= 0) status = l.on_end(l.ctx, loop, &loop->result);
    om_audit_destroy(audit);
    return status;
}

static void test_every_failing_allocation_returns(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    OmLoop* loop = make_loop(&g, NULL);
    assert_true(test_failing_allocations(write_lines, loop, 1) >= 5);
    om_loop_destroy(loop);
    rig_destroy(&g);
}

// ---- words ------------------------------------------------------------------------------------------------------

#define EXPECT_WORDS(call, expected)          \
    do {                                      \
        OmText t = {0};                       \
        assert_ok(call);                      \
        assert_string_equal(t.str, expected); \
        om_text_done(&t);                     \
    } while (0)

static void test_words_of_plans_and_actions(void** state) {
    (void)state;
    static OmLoop loop;  // a mock: the words read its limits and what is forbidden
    static OmPreplan before;
    loop.grid.n = 3;
    loop.task.force_threshold = 2.5, loop.task.force_margin = 0.5, loop.task.max_height = 0.05;
    OmSituation s;
    om_situation_init(&s, 3, 0.04);
    s.is_fixed[8] = s.is_fixed[7] = true;
    s.tried[4] = OM_TRIED_GRASP;
    loop.belief.is_forbidden[0] = true;
    OmPlan plan = {.n = 3, .naction = 2, .grasp_block = 3, .grasp_arm = 1, .is_optimal = true};
    plan.cost[0] = 1, plan.cost[1] = 400, plan.cost[2] = -566;
    EXPECT_WORDS(om_words_plan(&loop, &s, &plan, &t),
                 "PSM2 grasps point (1,2), 40 mm from the point over the region of interest, 57 mm "
                 "from the nearest attachment; no point that may be grasped is nearer to the "
                 "region. Ruled out: 1 forbidden by a person, 2 over or beside an attachment, 1 "
                 "tried without success or too near to such a point.");
    plan.cost[1] = plan.cost[2] = 0, plan.is_optimal = false;
    s.is_fixed[8] = s.is_fixed[7] = loop.belief.is_forbidden[0] = false;
    s.tried[4] = 0;
    EXPECT_WORDS(om_words_plan(&loop, &s, &plan, &t),
                 "PSM2 grasps point (1,2), which lies over the region of interest.");
    loop.preplan = &before, loop.is_preplan = true;
    snprintf(before.reason, sizeof before.reason, "it needs little force");
    EXPECT_WORDS(om_words_plan(&loop, &s, &plan, &t),
                 "The plan made before the operation is followed: it needs little force.");
    loop.is_preplan = false;
    loop.result.nplan = 1;  // the first plan is another one
    before.chosen = 5, loop.act.point[5].source = GRASP_NONE;
    EXPECT_WORDS(om_words_plan(&loop, &s, &plan, &t),
                 "The plan made before the operation grasps (3,2) and is not followed: the depth "
                 "camera sees no tissue there. PSM2 grasps point (1,2), which lies over the region "
                 "of interest.");
    loop.result.nplan = 2;
    plan.grasp_block = -1;
    plan.action[0] = (OmPlanAction){OM_PLAN_MOVE_AWAY, 0, 5, 0};
    EXPECT_WORDS(om_words_plan(&loop, &s, &plan, &t),
                 "The tissue in hand is kept; next: PSM1 folds (3,2) away from the camera.");
    plan = (OmPlan){.n = 3, .outcome = OM_UNSAT, .grasp_block = -1};
    for (int b = 0; b < 9; ++b) s.reachable[b] = 0;
    EXPECT_WORDS(om_words_plan(&loop, &s, &plan, &t),
                 "No plan is left: no point may be grasped. Ruled out: 9 out of reach or without "
                 "tissue.");
    OmRetractAction a = {.verb = OM_PLAN_PULL, .arm = 0, .block = 1, .visibility = 0.345};
    EXPECT_WORDS(om_words_action(&loop, &a, &t),
                 "PSM1 pulls (2,1) up: done; 34 % of the region of interest is seen.");
    a.outcome = OM_ACTION_FORCE, a.force_max = 2.034;
    EXPECT_WORDS(om_words_action(&loop, &a, &t),
                 "PSM1 pulls (2,1) up: stopped, because the robot estimates 2.03 N on the "
                 "tissue, and slowing down did not bring it below the limit of 2.00 N.");
    a.outcome = OM_ACTION_HEIGHT;
    EXPECT_WORDS(om_words_action(&loop, &a, &t),
                 "PSM1 pulls (2,1) up: stopped at the largest height allowed, 50 mm.");
    for (int k = OM_ACTION_DONE; k <= OM_ACTION_HELD; ++k) {
        OmText t = {0};
        a.outcome = (OmActionOutcome)k;
        assert_ok(om_words_action(&loop, &a, &t));
        assert_true(t.len > 40 && t.str[t.len - 1] == '.');
        om_text_done(&t);
    }
}

// The nodes of one point are attached, those of two others are freed.
static void test_words_of_an_update(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    OmLoop* loop = make_loop(&g, NULL);
    const OmTetMesh* mesh = &g.twin_site.mesh;
    const size_t n = (size_t)mesh->nvert;
    unsigned char* was = calloc(n, 1);
    OmMatchEstimate e = {.nvert = mesh->nvert, .before_median = 0.0041, .after_median = 0.00125};
    e.attached = calloc(n, 1);
    int nmore = 0, nless = 0;
    OmPose to_task = om_pose_inverse(g.twin_site.pose_world_task);
    for (size_t v = 0; v < n; ++v) {
        OmVec3 p = om_pose_apply(to_task, om_load3(mesh->x, (int)v));
        // blocks of 24 mm on 120 mm: (5,3) is in the middle of the far side, (1,1) and (1,5) are near corners
        bool is_far = p.x > 0.037 && fabs(p.y) < 0.011, is_near = p.x < -0.037 && fabs(p.y) > 0.037;
        e.attached[v] = is_far;
        was[v] = is_near;
        nmore += is_far;
        nless += is_near;
    }
    assert_true(nmore > 0 && nless > 1);
    OmUpdateEvent event = {.stage = OM_UPDATE_ADOPTED,
                           .nacquisition = 2,
                           .estimate = &e,
                           .reason = "",
                           .was_attached = was};
    char expected[400];
    snprintf(
        expected, sizeof expected,
        "The model has changed: the tissue is attached under point (5,3), and it is free under "
        "points (1,1) and (1,5) (%d nodes attached that were free, %d freed). The seen "
        "surface was 4.10 mm from the model, and is 1.25 mm from the new one (median).",
        nmore, nless);
    EXPECT_WORDS(om_words_update(loop, &event, &t), expected);
    event = (OmUpdateEvent){.stage = OM_UPDATE_REFUSED, .nacquisition = 1, .reason = "too little"};
    EXPECT_WORDS(om_words_update(loop, &event, &t),
                 "The model is kept; the estimate from 1 view was refused: too little.");
    free(was);
    free(e.attached);
    om_loop_destroy(loop);
    rig_destroy(&g);
}

static void test_words_of_persons_and_ends(void** state) {
    (void)state;
    static OmLoop loop;
    loop.grid.n = 4;
    loop.belief.warn.state = 2;
    loop.act.arm[1].in_hand = -1;
    OmMonitorFrame frame = {.mu = 0.00456};
    EXPECT_WORDS(om_words_warning(&loop, 1, &frame, &t),
                 "Warning 2, after 1: the tissue is 4.6 mm from where the model expects it. The "
                 "robot stops, measures, and plans anew.");
    loop.belief.warn.state = 0;
    EXPECT_WORDS(om_words_warning(&loop, 2, &frame, &t),
                 "Warning 2 ends: the tissue is 4.6 mm from where the model expects it. The robot "
                 "works at its usual speed.");
    loop.act.arm[0].in_hand = -1;
    EXPECT_WORDS(om_words_warning(&loop, 2, &frame, &t), "Warning 2 ends: no tissue is held.");
    OmLoopCommand c = {.kind = OM_LOOP_FORBID, .block = 6};
    EXPECT_WORDS(om_words_command(&loop, &c, &t), "A person forbade point (3,2).");
    for (int k = 0; k < OM_LOOP_NCOMMAND; ++k) {
        OmText t = {0};
        c.kind = (OmLoopCommandKind)k;
        assert_ok(om_words_command(&loop, &c, &t));
        assert_true(t.len > 20 && t.str[t.len - 1] == '.');
        om_text_done(&t);
    }
    EXPECT_WORDS(om_words_force(1.256, &t),
                 " By the forces that the arms measure, the tissue pulls 1.26 times as hard as the "
                 "model says; the robot now counts with this.");
    EXPECT_WORDS(om_words_hold(OM_HOLD_TOOL, "the tip of PSM1 is not measured", &t),
                 "The robot waits for a person: the tip of PSM1 is not measured. Check this arm "
                 "and its connection.");
    OmRetractResult r = {
        .outcome = OM_RETRACT_EXPOSED, .visibility_end = 0.87, .naction = 7, .time = 12.34};
    EXPECT_WORDS(om_words_end(&r, &t),
                 "The region of interest is exposed: 87 % is seen, after 7 actions in 12.3 s.");
    r = (OmRetractResult){.outcome = OM_RETRACT_NO_PLAN, .reason = "no plan is left"};
    EXPECT_WORDS(om_words_end(&r, &t),
                 "The region of interest is not exposed, 0 % is seen: no plan is left.");
}

// Consent names its plan: the line of the command has the name of the plan before it, and a plan with the same actions
// that is made later has another name.
static void test_consent_names_its_plan(void** unused) {
    (void)unused;
    Rig g;
    OmLoop* loop;
    char first[OM_AUDIT_NAME], second[OM_AUDIT_NAME], line[80];
    rig_create(&g, object_scene());
    OmAudit* audit = make_audit(g.planner);
    const OmLoopListener listener = om_audit_listener(audit);
    OmLoopDef def = om_loop_default_def(&g.scene.task, g.world, g.twin, g.planner);
    def.listener = &listener;
    def.nlistener = 1;
    def.needs_approval = def.is_attended = true;
    assert_ok(om_loop_create(&def, &loop));
    while (om_loop_phase(loop) != OM_LOOP_CONSENT) assert_ok(om_loop_tick(loop));
    om_audit_plan_name(loop, first);
    const OmPlan before = *om_loop_plan(loop);
    assert_ok(give(loop, OM_LOOP_REPLAN));
    do {
        assert_ok(om_loop_tick(loop));
    } while (om_loop_phase(loop) != OM_LOOP_CONSENT);
    om_audit_plan_name(loop, second);
    assert_memory_equal(before.action, om_loop_plan(loop)->action, sizeof before.action);
    assert_string_not_equal(first, second);
    assert_ok(give(loop, OM_LOOP_APPROVE));
    const char* text = om_audit_text(audit);
    snprintf(line, sizeof line, "\"name\": \"%s\"", first);
    assert_int_equal(count(text, line), 1);
    snprintf(line, sizeof line, "\"command\": \"yes\",\"plan\": \"%s\"", second);
    assert_int_equal(count(text, line), 1);
    om_loop_destroy(loop);
    om_audit_destroy(audit);
    rig_destroy(&g);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_line_for_each_decision),
        cmocka_unit_test(test_a_file_of_its_own),
        cmocka_unit_test(test_consent_names_its_plan),
        cmocka_unit_test(test_every_failing_allocation_returns),
        cmocka_unit_test(test_words_of_plans_and_actions),
        cmocka_unit_test(test_words_of_an_update),
        cmocka_unit_test(test_words_of_persons_and_ends),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
