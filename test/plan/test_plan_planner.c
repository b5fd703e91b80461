// test_plan_planner.c: plans against an independent search, and the honest answers at the edges.
//
// The second implementation is a plain Dijkstra search in C over what the two arms hold and where they are, with
// no windows of time and no idea of answer sets: the laws of asp/tissue_retraction.lp read again by hand.
#include <unistd.h>

#include "omentum/plan.h"
#include "test_alloc.h"

// ---- the second implementation ---------------------------------------------------------------------------

typedef struct Node {
    OmArmSituation arm[2];  // at: block the tool is on the tissue at, ready to grasp; -1 else
    bool is_visible;
    int64_t cost[5];  // grasps, hidden, roi, attachments, actions
    int depth;
    int first_block;  // grasped first, -1 none
} Node;

static int compare_cost(const int64_t* a, const int64_t* b) {
    for (int i = 0; i < 5; i++) {
        if (a[i] != b[i]) return a[i] < b[i] ? -1 : 1;
    }
    return 0;
}

static int distance_to(const OmSituation* s, int block, const bool* mark) {
    double best = -1;
    for (int b = 0; b < s->n * s->n; b++) {
        double dx = b % s->n - block % s->n, dy = b / s->n - block / s->n;
        double d = sqrt(dx * dx + dy * dy) * s->spacing;
        if (s->center) {
            const double *p = s->center + 3 * b, *q = s->center + 3 * block;
            d = sqrt((p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1]) +
                     (p[2] - q[2]) * (p[2] - q[2]));
        }
        if (mark[b] && (best < 0 || d < best)) best = d;
    }
    return best < 0 ? 0 : (int)lround(best * 1e4);
}

typedef struct Search {
    const OmSituation* s;
    bool has_both;
    int max_lift, horizon;
    Node queue[20000];
    bool is_done[20000];
    int count;
} Search;

static bool is_same_node(const Node* a, const Node* b) {
    return memcmp(a->arm, b->arm, sizeof a->arm) == 0 && a->is_visible == b->is_visible;
}

// Add a node unless its state is known at no more cost.
static void push(Search* q, Node node) {
    node.cost[4]++;
    node.depth++;
    for (int i = 0; i < q->count; i++) {
        if (!is_same_node(&q->queue[i], &node)) continue;
        if (compare_cost(q->queue[i].cost, node.cost) <= 0) return;
        q->queue[i] = node;  // costs only fall before it is expanded
        return;
    }
    assert_true(q->count < 20000);
    q->queue[q->count++] = node;
}

// The known exposure of a block, null if there is none or the world has shown that it is wrong.
static const OmExposure* law_of(const Search* q, int arm, int block) {
    const OmSituation* s = q->s;
    const OmExposure* e = &s->exposure[block];
    if (!e->is_known || !e->exposes) return NULL;
    if (e->fold == OM_PLAN_MOVE_ROI) return s->tried[block] & OM_TRIED_MOVE_ROI ? NULL : e;
    if (e->fold == OM_PLAN_MOVE_AWAY) return s->tried[block] & OM_TRIED_MOVE_AWAY ? NULL : e;
    if (s->tried[block] & (OM_TRIED_MOVE_ROI | OM_TRIED_MOVE_AWAY)) return NULL;
    const OmArmSituation* a = &s->arm[arm];
    if (a->in_hand != block) return e;
    int nlift = a->nlift < q->max_lift ? a->nlift : q->max_lift - 1;
    return a->is_max_height || a->is_max_force || nlift >= e->npull ? NULL : e;
}

// All one arm can do in a state.
static void expand_arm(Search* q, const Node* from, int i) {
    const OmSituation* s = q->s;
    const OmArmSituation *a = &from->arm[i], *other = &from->arm[1 - i];
    bool is_strained[2];
    for (int k = 0; k < 2; k++)
        is_strained[k] = from->arm[k].is_max_force && from->arm[k].in_hand >= 0;
    bool must_let_go = is_strained[0] || is_strained[1];
    if (a->is_closed && (!must_let_go || is_strained[i])) {  // release
        Node to = *from;
        if (a->in_hand >= 0) to.arm[i].at = -1;  // off the tissue
        to.arm[i].in_hand = -1;
        to.arm[i].is_closed = to.arm[i].is_max_force = false;
        push(q, to);
    }
    if (must_let_go && !is_strained[i]) return;
    const bool is_alone = other->in_hand < 0 || (q->has_both && !s->is_fixed[other->in_hand]);
    if (!must_let_go && !a->is_closed && is_alone) {
        for (int b = 0; b < s->n * s->n; b++) {  // reach, which is only for the grasp that follows
            bool is_there = a->at == b && !a->is_max_height;
            bool is_good = !s->is_fixed[b] && !s->is_forbidden[b] &&
                           !(s->tried[b] & OM_TRIED_GRASP) && (s->reachable[b] >> i & 1) &&
                           s->arm[0].in_hand != b && s->arm[1].in_hand != b;
            if (!is_good) continue;
            Node to = *from;
            to.arm[i] = (OmArmSituation){.at = -1, .in_hand = b, .is_closed = true};
            if (is_there) {
                to.arm[i].is_max_force = a->is_max_force;
                to.arm[i].nlift = a->nlift;
            } else {
                to.cost[4]++;
                to.depth++;
            }
            to.cost[0]++;
            to.cost[1] += s->exposure[b].is_known && !s->exposure[b].exposes;
            to.cost[2] += distance_to(s, b, s->is_above_roi);
            to.cost[3] -= distance_to(s, b, s->is_fixed);
            if (to.first_block < 0) to.first_block = b;
            push(q, to);
        }
    }
    if (a->in_hand < 0 || s->is_fixed[a->in_hand]) return;
    const OmExposure* law = law_of(q, i, a->in_hand);
    if (!a->is_max_height && !is_strained[i]) {  // pull
        Node to = *from;
        to.is_visible = to.arm[i].is_max_height = ++to.arm[i].nlift >= q->max_lift;
        if (law) to.is_visible = law->fold == OM_PLAN_PULL && to.arm[i].nlift == law->npull;
        push(q, to);
        if (!law || law->fold == OM_PLAN_PULL || a->nlift < law->npull) return;
    }
    int tried = s->tried[a->in_hand] & (OM_TRIED_MOVE_AWAY | OM_TRIED_MOVE_ROI);
    bool exposes =
        law ? law->fold != OM_PLAN_PULL : tried != (OM_TRIED_MOVE_AWAY | OM_TRIED_MOVE_ROI);
    if (exposes) {  // fold
        Node to = *from;
        to.is_visible = true;
        push(q, to);
    }
}

// OM_OK with the best cost, or OM_UNSAT.
static OmStatus search(Search* q, const OmSituation* s, Node* best) {
    Node start;
    memset(&start, 0, sizeof start);
    q->s = s;
    q->count = 0;
    memset(q->is_done, 0, sizeof q->is_done);
    start.depth = -1;
    start.cost[4] = -1;
    start.first_block = -1;
    for (int i = 0; i < 2; i++) {
        memset(&start.arm[i], 0, sizeof start.arm[i]);
        start.arm[i].in_hand = s->arm[i].in_hand;
        start.arm[i].at = s->arm[i].in_hand >= 0 ? -1 : s->arm[i].at;
        start.arm[i].is_closed = s->arm[i].is_closed || s->arm[i].in_hand >= 0;
        start.arm[i].is_max_height = s->arm[i].is_max_height;
        start.arm[i].is_max_force = s->arm[i].is_max_force;
        start.arm[i].nlift = s->arm[i].nlift < q->max_lift ? s->arm[i].nlift : q->max_lift - 1;
    }
    start.is_visible = s->is_visible;
    push(q, start);
    for (;;) {
        int at = -1;
        for (int i = 0; i < q->count; i++) {
            if (q->is_done[i]) continue;
            if (at < 0 || compare_cost(q->queue[i].cost, q->queue[at].cost) < 0) at = i;
        }
        if (at < 0) return OM_UNSAT;
        q->is_done[at] = true;
        *best = q->queue[at];
        if (best->depth > q->horizon) continue;
        if (best->is_visible) return OM_OK;
        Node from = *best;
        for (int i = 0; i < 2; i++) expand_arm(q, &from, i);
    }
}

// ---- random situations -----------------------------------------------------------------------------------------

static OmSituation random_situation(uint64_t index, int n) {
    OmRng r = om_rng_init(20, index);
    OmSituation s;
    om_situation_init(&s, n, 0.12 / n);
    int nb = n * n;
    double share = om_rng_uniform(&r) * 0.9, tried = om_rng_below(&r, 2) * om_rng_uniform(&r) * 0.8;
    for (int b = 0; b < nb; b++) {
        s.is_fixed[b] = om_rng_uniform(&r) < share;
        if (om_rng_uniform(&r) < tried) s.tried[b] |= OM_TRIED_GRASP;
        if (om_rng_uniform(&r) < 0.3) s.tried[b] |= OM_TRIED_MOVE_AWAY;
        if (om_rng_uniform(&r) < 0.3) s.tried[b] |= OM_TRIED_MOVE_ROI;
        if (om_rng_uniform(&r) < 0.1) s.reachable[b] = (uint8_t)om_rng_below(&r, 4);
    }
    for (uint32_t k = 0; k <= om_rng_below(&r, 3); k++)
        s.is_above_roi[om_rng_below(&r, (uint32_t)nb)] = true;
    for (int i = 0; i < 2; i++) {
        OmArmSituation* a = &s.arm[i];
        uint32_t kind = om_rng_below(&r, 4);
        int b = (int)om_rng_below(&r, (uint32_t)nb);
        if (kind == 0) a->is_closed = true;
        if (kind == 1) a->at = b;
        if (kind == 2) {
            a->at = a->in_hand = b;
            a->is_closed = true;
            a->nlift = (int)om_rng_below(&r, 7);
            a->is_max_height = om_rng_below(&r, 2);
            a->is_max_force = om_rng_below(&r, 3) == 0;
        }
    }
    if (s.arm[1].in_hand >= 0 && s.arm[1].in_hand == s.arm[0].in_hand) {
        s.arm[1] = (OmArmSituation){.at = -1, .in_hand = -1};
    }
    return s;
}

// What trying the blocks in the simulation showed, of about half of them; of the held ones nearly always.
static void add_exposures(uint64_t index, OmSituation* s) {
    static const OmPlanVerb fold[3] = {OM_PLAN_PULL, OM_PLAN_MOVE_ROI, OM_PLAN_MOVE_AWAY};
    OmRng r = om_rng_init(22, index);
    for (int b = 0; b < s->n * s->n; b++) {
        bool is_held = s->arm[0].in_hand == b || s->arm[1].in_hand == b;
        s->exposure[b] =
            (OmExposure){om_rng_uniform(&r) < (is_held ? 0.9 : 0.5), om_rng_uniform(&r) < 0.6,
                         1 + (int)om_rng_below(&r, 5), fold[om_rng_below(&r, 3)]};
    }
}

static OmPlanner* new_planner_with(bool has_both) {
    OmPlannerDef def = om_planner_default_def();
    def.has_both_arms = has_both;
    def.time_limit = 0;  // what is right does not depend on how busy the machine is
    OmPlanner* p;
    assert_ok(om_planner_create(&def, &p));
    return p;
}

static OmPlanner* new_planner(void) { return new_planner_with(false); }

static void compare_with_search(bool has_both) {
    static Search q;
    q.max_lift = 5;
    q.horizon = 12;
    q.has_both = has_both;
    OmPlanner* p = new_planner_with(has_both);
    int nplan = 0, nunsat = 0, nhold = 0, nkept = 0, stride = test_count(11, 1);
    for (int k = 0; k < 480; k += stride) {  // 11 meets every cycle of k below
        OmSituation s = random_situation((uint64_t)k, 1 + k % 5);
        if (k >= 240) add_exposures((uint64_t)k, &s);
        for (int b = 0; k % 3 == 1 && b < s.n * s.n; b += 3) s.is_forbidden[b] = true;
        const int held = s.arm[0].in_hand;
        if (has_both && held >= 0 && k % 2 == 0) {  // nothing is left to do with the tissue in hand
            s.tried[held] |= OM_TRIED_MOVE_ROI | OM_TRIED_MOVE_AWAY;
            s.exposure[held].is_known = false;
            s.arm[0].is_max_height = true;
            s.arm[0].is_max_force = false;
            if (s.arm[1].in_hand >= 0) s.arm[1] = (OmArmSituation){.at = -1, .in_hand = -1};
        }
        OmPlan plan;
        Node best;
        OmStatus status = om_planner_solve(p, &s, &plan), expected = search(&q, &s, &best);
        if (status != expected)
            fail_msg("situation %d: status %d, expected %d", k, status, expected);
        if (status != OM_OK) {
            nunsat++;
            assert_int_equal(plan.naction, 0);
            continue;
        }
        assert_true(plan.is_optimal);
        for (int c = 0; c < 5; c++) {
            if (plan.cost[c] != best.cost[c]) {
                fail_msg("situation %d: cost[%d] %lld, expected %lld", k, c,
                         (long long)plan.cost[c], (long long)best.cost[c]);
            }
        }
        assert_int_equal(plan.naction, best.cost[4]);
        assert_true((plan.grasp_block < 0) == (best.first_block < 0));
        bool is_let_go[2] = {false, false};
        for (int a = 0; a < plan.naction; a++)
            if (plan.action[a].verb == OM_PLAN_RELEASE) is_let_go[plan.action[a].arm] = true;
        const int other = 1 - plan.grasp_arm;
        nkept += plan.grasp_block >= 0 && s.arm[other].in_hand >= 0 && !is_let_go[other];
        nplan++;
        nhold += plan.grasp_block < 0;
    }
    om_planner_destroy(p);
    print_message("%d plans, %d of them with tissue in hand, and %d times none\n", nplan, nhold,
                  nunsat);
    assert_true(nplan > 250 / stride && nunsat > 30 / stride && nhold > 20 / stride);
    print_message("%d plans keep tissue in the other hand\n", nkept);
    assert_true(has_both ? nkept > 5 / stride : nkept == 0);
}

static void test_optimum_is_that_of_another_search(void** state) {
    (void)state;
    compare_with_search(false);
    compare_with_search(true);
}

// The program in use bounds the steps at which an action may occur, and knows only the distances that decide.
// asp/tissue_retraction_plain.lp has neither of these: any action at any step, all distances at all steps.
static void test_bounds_keep_the_optimum(void** state) {
    (void)state;
    OmPlannerDef def = om_planner_default_def();
    def.time_limit = 0;
    def.program = "asp/tissue_retraction_plain.lp";
    def.has_all_distances = true;
    OmPlanner *plain, *bounded = new_planner();
    assert_ok(om_planner_create(&def, &plain));
    const int until[4] = {20, 140, 190, 200};  // situations up to 1 x 1, 2 x 2, .. 4 x 4 blocks
    int nplan = 0, nunsat = 0, nhold = 0, stride = test_count(11, 1);
    const int last = until[test_count(2, 3)];
    for (int k = 0, n = 1; k < last; k += stride) {
        while (k >= until[n - 1]) n++;
        OmSituation s = random_situation(3000 + (uint64_t)k, n);
        if (k % 2) add_exposures(3000 + (uint64_t)k, &s);
        OmPlan a, b;
        OmStatus status = om_planner_solve(bounded, &s, &a);
        OmStatus expected = om_planner_solve(plain, &s, &b);
        if (status != expected)
            fail_msg("situation %d: status %d, %d without bounds", k, status, expected);
        for (int i = 0; i < OM_PLAN_NCOST; i++) {
            if (a.cost[i] != b.cost[i]) {
                fail_msg("situation %d: cost[%d] %lld, %lld without bounds", k, i,
                         (long long)a.cost[i], (long long)b.cost[i]);
            }
        }
        assert_true(status != OM_OK || (a.is_optimal && b.is_optimal));
        assert_int_equal(a.naction, b.naction);
        assert_memory_equal(a.action, b.action, sizeof a.action);  // the optimum is unique
        nplan += status == OM_OK;
        nunsat += status == OM_UNSAT;
        nhold += status == OM_OK && a.naction > 0 && a.grasp_block < 0;
    }
    om_planner_destroy(plain);
    om_planner_destroy(bounded);
    print_message("%d plans, %d of them with tissue in hand, and %d times none\n", nplan, nhold,
                  nunsat);
    assert_true(nplan > 100 / stride && nunsat > 10 / stride && nhold > 10 / stride);
}

// Far from the flat grid: centres given, as on lifted tissue.
static void test_given_centers_decide(void** state) {
    (void)state;
    static Search q;
    q.max_lift = 5;
    q.horizon = 12;
    OmPlanner* p = new_planner();
    for (int k = 0; k < test_count(12, 40); k++) {
        OmSituation s = random_situation(1000 + (uint64_t)k, 4);
        OmRng r = om_rng_init(21, (uint64_t)k);
        double center[16 * 3];
        for (int i = 0; i < 48; i++) center[i] = om_rng_range(&r, -0.06, 0.06);
        s.center = center;
        OmPlan plan;
        Node best;
        OmStatus expected = search(&q, &s, &best);
        assert_status(om_planner_solve(p, &s, &plan), expected);
        for (int i = 0; i < 5 && expected == OM_OK; i++)
            assert_int_equal(plan.cost[i], best.cost[i]);
    }
    om_planner_destroy(p);
}

// The same situation gives the same plan whatever was planned before, and with any seed: the optimum is unique.
static void test_plan_does_not_depend_on_history(void** state) {
    (void)state;
    OmPlanner* used = new_planner();
    for (int k = 0; k < test_count(5, 30); k++) {
        OmSituation s = random_situation(2000 + (uint64_t)k, 3 + k % 3);
        OmPlannerDef def = om_planner_default_def();
        def.seed = (uint32_t)k + 7;
        OmPlanner* fresh;
        OmPlan a, b;
        assert_ok(om_planner_create(&def, &fresh));
        OmStatus status = om_planner_solve(fresh, &s, &a);
        assert_status(om_planner_solve(used, &s, &b), status);
        assert_int_equal(a.naction, b.naction);
        assert_memory_equal(a.action, b.action, sizeof a.action);
        assert_memory_equal(a.cost, b.cost, sizeof a.cost);
        om_planner_destroy(fresh);
    }
    om_planner_destroy(used);
}

// ---- what a retraction asks, step by step -----------------------------------------------------------------------

static void assert_text(const OmPlan* plan, const char* expected) {
    OmText t = {0};
    assert_ok(om_plan_print(plan, &t));
    assert_string_equal(t.str, expected);
    om_text_done(&t);
}

static void test_replanning_does_not_loop(void** state) {
    (void)state;
    OmPlanner* p = new_planner();
    OmSituation s;
    OmPlan plan;
    om_situation_init(&s, 5, 0.024);
    s.is_above_roi[om_block_at(&s, 3, 3)] = true;
    assert_ok(om_planner_solve(p, &s, &plan));
    assert_text(&plan, "1. PSM1 reaches grasping point (3,3)\n"
                       "2. PSM1 grasps the tissue at (3,3)\n"
                       "3. PSM1 pulls (3,3) up\n"
                       "4. PSM1 pulls (3,3) up\n"
                       "5. PSM1 pulls (3,3) up\n"
                       "6. PSM1 pulls (3,3) up\n"
                       "7. PSM1 pulls (3,3) up\n");
    // lifted to the limit, still hidden: fold; then fold the other way; then another grasp
    int b = plan.grasp_block;
    s.arm[0] = (OmArmSituation){
        .at = b, .in_hand = b, .is_closed = true, .is_max_height = true, .nlift = 5};
    s.tried[b] |= OM_TRIED_GRASP;
    assert_ok(om_planner_solve(p, &s, &plan));
    assert_text(&plan, "1. PSM1 folds (3,3) towards the region of interest\n");
    s.tried[b] |= OM_TRIED_MOVE_ROI;
    assert_ok(om_planner_solve(p, &s, &plan));
    assert_text(&plan, "1. PSM1 folds (3,3) away from the camera\n");
    s.tried[b] |= OM_TRIED_MOVE_AWAY;
    assert_ok(om_planner_solve(p, &s, &plan));
    assert_int_equal(plan.action[0].verb, OM_PLAN_RELEASE);
    assert_int_equal(plan.grasp_block, om_block_at(&s, 3, 2));
    // every block in turn: one plan each, then none
    int nplan = 1;
    for (OmStatus status = OM_OK; status == OM_OK; nplan++) {
        s.arm[0] = s.arm[1] = (OmArmSituation){.at = -1, .in_hand = -1};
        int arm = plan.grasp_arm;
        b = plan.grasp_block;
        assert_false(s.tried[b] & OM_TRIED_GRASP);
        s.arm[arm] = (OmArmSituation){
            .at = b, .in_hand = b, .is_closed = true, .is_max_force = true, .nlift = 2};
        s.tried[b] |= OM_TRIED_GRASP;
        // above the force limit it is folded both ways before another block is grasped
        assert_ok(om_planner_solve(p, &s, &plan));
        assert_int_equal(plan.naction, 1);
        assert_int_equal(plan.action[0].verb, OM_PLAN_MOVE_ROI);
        s.tried[b] |= OM_TRIED_MOVE_AWAY | OM_TRIED_MOVE_ROI;
        status = om_planner_solve(p, &s, &plan);
    }
    assert_int_equal(nplan, 25);
    assert_int_equal(plan.naction, 0);
    om_planner_destroy(p);
}

static void test_visible_needs_nothing(void** state) {
    (void)state;
    OmPlanner* p = new_planner();
    OmSituation s;
    OmPlan plan;
    om_situation_init(&s, 5, 0.024);
    s.is_visible = true;
    assert_ok(om_planner_solve(p, &s, &plan));
    assert_int_equal(plan.naction, 0);
    assert_true(plan.is_optimal);
    om_planner_destroy(p);
}

static void assert_says(const char* text, const char* what) {
    if (!strstr(text, what)) fail_msg("\"%s\" is not in:\n%s", what, text);
}

static void test_horizon_too_short_is_an_answer(void** state) {
    (void)state;
    OmPlannerDef def = om_planner_default_def();
    def.horizon = 6;  // reach, grasp and five pulls take seven
    OmPlanner* p;
    OmSituation s;
    OmPlan plan;
    OmText t = {0};
    assert_ok(om_planner_create(&def, &p));
    om_situation_init(&s, 3, 0.04);
    s.is_above_roi[0] = true;
    assert_status(om_planner_solve(p, &s, &plan), OM_UNSAT);
    assert_ok(om_planner_explain(p, &s, &plan, -1, &t));
    assert_says(t.str, "forbidden, since it takes more steps than the horizon of the plan has");
    om_text_done(&t);
    om_planner_destroy(p);
}

static void test_time_limit_is_an_answer(void** state) {
    (void)state;
    OmPlannerDef def = om_planner_default_def();
    def.time_limit = 1e-9;
    OmPlanner* p;
    int ntimeout = 0;
    assert_ok(om_planner_create(&def, &p));
    for (int k = 0; k < test_count(10, 50); k++) {
        OmSituation s;
        OmPlan plan;
        om_situation_init(&s, 8, 0.02);
        s.is_above_roi[k] = s.is_fixed[k] = true;
        OmStatus status = om_planner_solve(p, &s, &plan);
        if (status != OM_OK && status != OM_TIMEOUT)
            fail_msg("status %d: %s", (int)status, om_error_message());
        assert_true(plan.is_optimal == (status == OM_OK) && plan.outcome == status);
        ntimeout += status == OM_TIMEOUT;
        if (plan.naction > 0) assert_int_equal(plan.action[plan.naction - 1].verb, OM_PLAN_PULL);
    }
    assert_true(ntimeout > 0);
    om_planner_destroy(p);
}

// A budget of conflicts: the same plans, and the same ends of the budget, at any speed of the machine.
static void test_budget_counts_conflicts(void** state) {
    (void)state;
    static const int limit[3] = {1, 40, 100000};
    int ntimeout[3] = {0};
    for (int i = 0; i < 3; ++i) {
        OmPlannerDef def = om_planner_default_def();
        def.conflict_limit = limit[i];
        OmPlanner *p, *q;
        assert_ok(om_planner_create(&def, &p));
        assert_ok(om_planner_create(&def, &q));
        for (int k = 0; k < test_count(3, 20); k++) {
            OmSituation s;
            OmPlan plan, again;
            om_situation_init(&s, 8, 0.02);
            s.is_above_roi[k] = s.is_fixed[k] = true;
            OmStatus status = om_planner_solve(p, &s, &plan);
            assert_status(om_planner_solve(q, &s, &again), status);
            assert_int_equal(plan.naction, again.naction);
            assert_memory_equal(plan.action, again.action, sizeof plan.action);
            assert_memory_equal(plan.cost, again.cost, sizeof plan.cost);
            assert_true(status == OM_OK || status == OM_TIMEOUT);
            if (status == OM_TIMEOUT) assert_says(om_error_message(), "conflicts");
            ntimeout[i] += status == OM_TIMEOUT;
        }
        om_planner_destroy(p);
        om_planner_destroy(q);
    }
    assert_int_equal(ntimeout[2], 0);
    assert_true(ntimeout[0] >= ntimeout[1] && ntimeout[0] > 0);
    OmPlannerDef def = om_planner_default_def();
    OmPlanner* p;
    def.conflict_limit = -1;
    assert_status(om_planner_create(&def, &p), OM_INVALID);
}

// ---- why -----------------------------------------------------------------------------------------------------------

static void test_explanation_names_costs_and_rules(void** state) {
    (void)state;
    OmPlanner* p = new_planner();
    OmSituation s;
    OmPlan plan, again;
    OmText t = {0};
    om_situation_init(&s, 5, 0.024);
    s.is_above_roi[om_block_at(&s, 3, 3)] = true;
    s.is_fixed[om_block_at(&s, 3, 3)] = s.is_fixed[om_block_at(&s, 2, 3)] = true;
    s.tried[om_block_at(&s, 4, 3)] = OM_TRIED_GRASP;
    s.reachable[om_block_at(&s, 3, 2)] = 0;
    assert_ok(om_planner_solve(p, &s, &plan));
    assert_int_equal(plan.grasp_block, om_block_at(&s, 3, 4));
    assert_ok(om_planner_explain(p, &s, &plan, -1, &t));
    assert_says(t.str, "It grasps (3,4) with PSM2");
    assert_says(t.str, "(3,3): forbidden: it is above attachment points");
    assert_says(t.str, "(4,3): forbidden: it was grasped before");
    assert_says(t.str, "(3,2): forbidden: no free arm reaches it");
    assert_says(t.str, "(2,2): allowed, but it is 9.9 mm farther from the region of interest");
    om_text_done(&t);
    // asking leaves no trace in the next plan
    assert_ok(om_planner_solve(p, &s, &again));
    assert_memory_equal(plan.action, again.action, sizeof plan.action);
    assert_false(again.is_reground);
    om_planner_destroy(p);
}

static void test_known_exposure_replaces_the_law(void** state) {
    (void)state;
    OmPlanner* p = new_planner();
    OmSituation s;
    OmPlan plan;
    OmText t = {0};
    om_situation_init(&s, 5, 0.024);
    int middle = om_block_at(&s, 3, 3), below = om_block_at(&s, 3, 2);
    s.is_above_roi[middle] = true;
    s.exposure[middle] = (OmExposure){.is_known = true};
    s.exposure[below] = (OmExposure){true, true, 2, OM_PLAN_MOVE_ROI};
    assert_ok(om_planner_solve(p, &s, &plan));
    assert_text(&plan, "1. PSM1 reaches grasping point (3,2)\n"
                       "2. PSM1 grasps the tissue at (3,2)\n"
                       "3. PSM1 pulls (3,2) up\n"
                       "4. PSM1 pulls (3,2) up\n"
                       "5. PSM1 folds (3,2) towards the region of interest\n");
    assert_ok(om_planner_explain(p, &s, &plan, 2, &t));
    assert_says(t.str, "In the simulation 2 pulls and a fold towards it exposed the region");
    assert_says(t.str, "Exposes the region in the simulation: (3,2).");
    assert_says(t.str, "Tried in the simulation in vain: (3,3).");
    assert_says(t.str, "(3,3): allowed, but trying it in the simulation did not expose the region");
    om_text_done(&t);
    // the world proved it wrong: the assumed law
    s.tried[below] = OM_TRIED_MOVE_ROI;
    s.arm[0] = (OmArmSituation){.at = below, .in_hand = below, .is_closed = true, .nlift = 2};
    assert_ok(om_planner_solve(p, &s, &plan));
    assert_int_equal(plan.naction, 3);
    assert_int_equal(plan.action[2].verb, OM_PLAN_PULL);
    // a hidden block is no forbidden one
    s.arm[0] = (OmArmSituation){.at = -1, .in_hand = -1};
    for (int b = 0; b < 25; b++) s.is_fixed[b] = b != middle;
    assert_ok(om_planner_solve(p, &s, &plan));
    assert_int_equal(plan.grasp_block, middle);
    assert_ok(om_planner_explain(p, &s, &plan, 0, &t));
    assert_says(t.str, "Trying it in the simulation did not expose the region of interest; no");
    om_text_done(&t);
    s.exposure[middle] = (OmExposure){.is_known = true, .exposes = true, .npull = 0};
    assert_status(om_planner_solve(p, &s, &plan), OM_INVALID);
    assert_says(om_error_message(), "exposure of block 12: 0 pulls");
    om_planner_destroy(p);
}

static void test_explanation_of_no_plan(void** state) {
    (void)state;
    OmPlanner* p = new_planner();
    OmSituation s;
    OmPlan plan;
    OmText t = {0};
    om_situation_init(&s, 3, 0.04);
    s.is_above_roi[4] = true;
    for (int b = 0; b < 9; b++) {
        s.is_fixed[b] = b != 2;
        if (b == 2) s.tried[b] = OM_TRIED_GRASP;
    }
    assert_status(om_planner_solve(p, &s, &plan), OM_UNSAT);
    assert_non_null(strstr(om_error_message(), "no plan"));
    assert_ok(om_planner_explain(p, &s, &plan, 0, &t));
    assert_says(
        t.str,
        "Grasping (1,1), (2,1), (1,2), (2,2), (3,2), (1,3), (2,3), (3,3): forbidden, since it is above");
    assert_says(t.str, "Grasping (3,1): forbidden, since it was grasped before");
    om_text_done(&t);
    om_planner_destroy(p);
}

// ---- bad input ------------------------------------------------------------------------------------------------------

// Tests of several builds may run at once.
static void temporary_path(const char* name, char* path, size_t size) {
    const char* dir = getenv("TMPDIR");
    snprintf(path, size, "%s/omentum_%d_%s", dir ? dir : "/tmp", (int)getpid(), name);
}

static void test_bad_program_is_told_with_file_and_line(void** state) {
    (void)state;
    char path[256];
    temporary_path("test_plan_bad.lp", path, sizeof path);
    const char* text = "block(b(1..n,1..n)).\n\na(X :- b(X).\n";
    assert_ok(om_file_write(path, text, strlen(text)));
    OmPlannerDef def = om_planner_default_def();
    def.program = path;
    OmPlanner* p;
    assert_status(om_planner_create(&def, &p), OM_INVALID);
    assert_null(p);
    assert_says(om_error_message(), "test_plan_bad.lp:3:5-7: error: syntax error");

    // it parses but cannot be grounded
    text = "a(X) :- not b(X).\n";
    assert_ok(om_file_write(path, text, strlen(text)));
    assert_status(om_planner_create(&def, &p), OM_INVALID);
    assert_says(om_error_message(), "test_plan_bad.lp:1:1-18: error: unsafe variables");

    // it grounds but does not listen to what is sensed
    text = "a.\n";
    assert_ok(om_file_write(path, text, strlen(text)));
    assert_ok(om_planner_create(&def, &p));
    OmSituation s;
    OmPlan plan;
    om_situation_init(&s, 2, 0.05);
    s.is_above_roi[0] = true;
    assert_status(om_planner_solve(p, &s, &plan), OM_INVALID);
    assert_says(om_error_message(), "no external atom above_ROI");
    om_planner_destroy(p);
    assert_ok(om_path_remove(path));
    assert_status(om_planner_create(&def, &p), OM_IO);
}

static void test_own_program_replaces_the_built_in(void** state) {
    (void)state;
    char path[256];
    temporary_path("test_plan_own.lp", path, sizeof path);
    OmText t = {0};
    // nothing within 41 mm of the middle, where the nearest point would be
    assert_ok(om_text_append(&t, "%s\n:- chosen(B), distance(B,b(2,2),X,0), X < 410.\n",
                             om_planner_program()));
    assert_ok(om_file_write(path, t.str, t.len));
    OmPlannerDef def = om_planner_default_def();
    def.program = path;
    def.has_all_distances = true;
    OmPlanner* p;
    OmSituation s;
    OmPlan plan;
    om_situation_init(&s, 3, 0.04);
    s.is_above_roi[om_block_at(&s, 2, 2)] = true;
    assert_ok(om_planner_create(&def, &p));
    assert_ok(om_planner_solve(p, &s, &plan));
    assert_int_equal(plan.grasp_block, om_block_at(&s, 1, 1));
    assert_int_equal(plan.cost[2], 566);  // 40 mm sqrt(2)
    om_planner_destroy(p);
    om_text_done(&t);
    assert_ok(om_path_remove(path));
}

static void test_bad_situations_and_defs(void** state) {
    (void)state;
    OmPlannerDef def = {0};
    OmPlanner* p;
    assert_status(om_planner_create(&def, &p), OM_INVALID);
    def = om_planner_default_def();
    def.horizon = 0;
    assert_status(om_planner_create(&def, &p), OM_INVALID);
    assert_says(om_error_message(), "horizon is 0");
    def.horizon = 12;
    def.max_lift = 1000;
    assert_status(om_planner_create(&def, &p), OM_INVALID);
    p = new_planner();
    OmSituation s;
    OmPlan plan;
    om_situation_init(&s, 5, 0.02);
    assert_status(om_planner_solve(p, &s, &plan), OM_INVALID);
    assert_says(om_error_message(), "no block is above the ROI");
    s.is_above_roi[0] = true;
    s.arm[1].in_hand = 25;
    assert_status(om_planner_solve(p, &s, &plan), OM_INVALID);
    assert_says(om_error_message(), "arm[1].in_hand is 25");
    s.arm[1].in_hand = -1;
    s.n = 17;
    assert_status(om_planner_solve(p, &s, &plan), OM_INVALID);
    s.n = 5;
    s.spacing = nan("");
    assert_status(om_planner_solve(p, &s, &plan), OM_INVALID);
    om_planner_destroy(p);
    om_planner_destroy(NULL);
    assert_int_equal(om_block_at(&s, 0, 3), -1);
}

// ---- memory ----------------------------------------------------------------------------------------

static OmStatus plan_once(void* unused) {
    (void)unused;
    OmPlannerDef def = om_planner_default_def();
    OmPlanner* p;
    OmSituation s;
    OmPlan plan;
    OmText t = {0};
    om_situation_init(&s, 2, 0.06);
    s.is_above_roi[0] = s.is_fixed[0] = true;
    OM_TRY(om_planner_create(&def, &p));
    OmStatus status = om_planner_solve(p, &s, &plan);
    if (status == OM_OK) status = om_plan_print(&plan, &t);
    if (status == OM_OK) status = om_planner_explain(p, &s, &plan, -1, &t);
    om_text_done(&t);
    om_planner_destroy(p);
    return status;
}

static void test_every_allocation_failing(void** state) {
    (void)state;
    assert_true(test_failing_allocations(plan_once, NULL, test_stride(3)) > 5);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_optimum_is_that_of_another_search),
        cmocka_unit_test(test_bounds_keep_the_optimum),
        cmocka_unit_test(test_given_centers_decide),
        cmocka_unit_test(test_plan_does_not_depend_on_history),
        cmocka_unit_test(test_replanning_does_not_loop),
        cmocka_unit_test(test_visible_needs_nothing),
        cmocka_unit_test(test_horizon_too_short_is_an_answer),
        cmocka_unit_test(test_time_limit_is_an_answer),
        cmocka_unit_test(test_budget_counts_conflicts),
        cmocka_unit_test(test_explanation_names_costs_and_rules),
        cmocka_unit_test(test_known_exposure_replaces_the_law),
        cmocka_unit_test(test_explanation_of_no_plan),
        cmocka_unit_test(test_bad_program_is_told_with_file_and_line),
        cmocka_unit_test(test_own_program_replaces_the_built_in),
        cmocka_unit_test(test_bad_situations_and_defs),
        cmocka_unit_test(test_every_allocation_failing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
