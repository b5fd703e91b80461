// test_belief_fold.c: when a fold is judged.
#include "warn_rig.h"

static bool is_first_fold(const OmLoop* loop) {
    const OmPlanVerb verb = loop->act.action.plan.verb;
    const OmRetractResult* r = om_loop_result(loop);
    for (int i = 0; i + 1 < r->naction; ++i)
        if (r->action[i].verb == OM_PLAN_MOVE_ROI || r->action[i].verb == OM_PLAN_MOVE_AWAY)
            return false;
    return verb == OM_PLAN_MOVE_ROI || verb == OM_PLAN_MOVE_AWAY;
}

// World and twin differ by nothing, but in the first fold the twin's tool is kept `aside` m aside. It is drawn back at
// 20 mm/s: with the end of the motion, or never. Alg. 5 warns at once. Judged at rest, only what remains warns.
typedef struct FoldCase {
    bool at_rest, remains;
    double second, aside;  // m, limit of state 2
    double fold;           // factor on the limits in folds; 0: 1
} FoldCase;

typedef struct FoldSeen {
    double end, warned, mu, before;  // s, s, m, m
    int nstop, nfold;                // of the first plan with a fold
} FoldSeen;

static FoldSeen watch_fold(Course* c, const FoldCase* f) {
    FoldSeen s = {.end = NAN, .warned = NAN};
    while (om_loop_phase(c->loop) != OM_LOOP_ENDED && !(c->loop->act.time > s.end + 2)) {
        const bool is_moving = c->loop->stage == STAGE_ACTION;
        const bool is_still = c->loop->stage == STAGE_SETTLE && f->remains;
        const bool is_fold = is_first_fold(c->loop);
        const int n = om_loop_result(c->loop)->naction;
        if (is_fold && ((is_moving && isnan(s.end)) || is_still))
            c->loop->act.arm[c->loop->act.action.plan.arm].twin_off = om_vec3(f->aside, 0, 0);
        assert_ok(om_loop_tick(c->loop));
        if (is_fold) s.mu = fmax(s.mu, c->loop->belief.frame.mu);
        if (!is_fold && isnan(s.end)) s.before = fmax(s.before, c->loop->belief.frame.mu);
        const bool has_ended = om_loop_result(c->loop)->naction > n;
        if (is_fold && is_moving && has_ended && isnan(s.end)) s.end = c->loop->act.time;
        if (isnan(s.warned) && om_loop_warning(c->loop) > 0) s.warned = c->loop->act.time;
    }
    const OmRetractResult* r = om_loop_result(c->loop);
    for (int i = 0; i < r->naction; ++i) {
        s.nfold += r->action[i].verb == OM_PLAN_MOVE_ROI || r->action[i].verb == OM_PLAN_MOVE_AWAY;
        s.nstop += r->action[i].outcome == OM_ACTION_WARNED;
    }
    printf("at rest %d, remains %d: mu %.2f mm, in the fold %.2f mm; it ends at %.2f s, warning at "
           "%.2f s; %d folds, %d stopped\n",
           f->at_rest, f->remains, 1e3 * s.before, 1e3 * s.mu, s.end, s.warned, s.nfold, s.nstop);
    return s;
}

static void test_a_fold_at_rest(void** state) {
    (void)state;
    static const FoldCase f[] = {{false, false, 0.05, 0.015},
                                 {true, false, 0.05, 0.015},
                                 {true, true, 0.05, 0.015},
                                 {true, false, 0.5e-3, 0.015},
                                 {true, false, 0.5e-3, 0.015, 4}};
    FoldSeen s[5];
    int ntaken[5];
    const bool is_slow = test_is_slow();  // a quick run has the three that judge a fold at rest
    for (int k = 0; k < 5; ++k) {
        if (!is_slow && (k == 0 || k == 3)) continue;
        Course c;
        OmScene scene = warn_scene(0.3e-3, f[k].second, 0.06);
        scene.believed = om_scene_default().believed;
        scene.monitor.is_fold_at_rest = f[k].at_rest;
        scene.monitor.fold_factor = f[k].fold > 0 ? f[k].fold : 1;
        scene.task.visibility = 1.5;  // nothing exposes it
        course_begin_as(&c, scene, OM_SITE_TWIN, true, false);
        s[k] = watch_fold(&c, &f[k]);
        ntaken[k] = c.seen.ntaken;
        course_end(&c);
        assert_true(s[k].before < 0.05e-3 && s[k].mu > 0.5e-3);
    }
    if (is_slow) assert_true(s[0].warned < s[0].end);
    assert_true(isnan(s[1].warned) && ntaken[1] == 0);
    assert_near(s[2].warned - s[2].end, 1.5, 0.11);
    assert_true(ntaken[2] > 0);
    // state 2: at once
    if (is_slow) assert_true(s[3].warned <= s[3].end && s[3].nstop == 1 && ntaken[3] > 0);
    assert_true(isnan(s[4].warned) && s[4].nstop == 0 && ntaken[4] == 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_fold_at_rest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
