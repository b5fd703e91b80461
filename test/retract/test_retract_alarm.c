// test_retract_alarm.c: runs of the loop beside a monitor. With attachments known, and all other errors on, the monitor
// must not warn; with wrong ones it must.
//
// test_retract_alarm [FIRST [COUNT [BELIEF]]]: layouts FIRST ... of scenes/belief.yaml, one line each; BELIEF same
// (default), none, fewer, more, patch.
#include "test_common.h"

#include "omentum/belief_monitor.h"
#include "omentum/loop.h"

typedef struct Watcher {
    OmWorld* world;
    OmBody* twin;
    OmMonitor* monitor;
    OmObservation obs;
    bool has_grasped, is_far;  // is_far: mu above the first limit
    OmMonitorFrame last;
    double most, least;  // m, of mu after the first grasp
    int state, nframe, nalarm;
    double first;  // s, of the first state above 0
} Watcher;

static OmStatus watch(void* ctx, const OmLoop* loop, const OmRetractSample* now) {
    (void)loop;
    Watcher* w = ctx;
    for (int a = 0; a < OM_MAX_ARM; ++a) w->has_grasped |= om_body_is_holding(w->twin, a);
    if (!om_monitor_is_due(w->monitor, now->time)) return OM_OK;
    OmMonitorFrame f;
    OM_TRY(om_world_observe(w->world, om_monitor_sources(w->monitor, w->world), &w->obs));
    OM_TRY(om_monitor_frame(w->monitor, &w->obs, om_body_x(w->twin), w->has_grasped, &f));
    ++w->nframe;
    if (!w->has_grasped) return OM_OK;
    w->nalarm += f.state > w->last.state;
    if (f.state > 0 && w->state == 0) w->first = f.time;
    w->state = f.state > w->state ? f.state : w->state;
    w->most = fmax(w->most, f.mu);
    w->least = fmin(w->least, f.mu);
    w->last = f;
    return OM_OK;
}

static OmScene alarm_scene(int seed, const char* belief) {
    OmScene s;
    assert_ok(om_scene_load("scenes/belief.yaml", &s));
    s.seed = seed;
    s.believed = (OmSceneBelief){.ratio = 1, .share = 0.3, .stiffness = -1, .foundation = -1};
    if (!strcmp(belief, "none")) s.believed.kind = OM_BELIEF_NONE;
    if (!strcmp(belief, "fewer")) s.believed.ratio = 0.4;
    if (!strcmp(belief, "more")) s.believed.ratio = 1.5;
    if (!strcmp(belief, "patch")) s.believed.kind = OM_BELIEF_PATCH, s.believed.seed = seed + 1;
    // errors of the kinds that a robot has: registration, ROI, law, stiffness, Poisson's ratio, density, friction,
    // tools, depth
    OmRng rng = om_rng_init(5, (uint64_t)seed);
    double e[8];
    for (int i = 0; i < 8; ++i) e[i] = 2 * om_rng_uniform(&rng) - 1;
    s.registration.shift = om_vec3(0.0015 * e[0], 0.0015 * e[1], 0.001 * e[2]);
    s.registration.turn = om_scale(0.01, om_vec3(e[3], e[4], e[5]));
    s.believed_roi.shift = om_vec3(0.002 * e[6], 0.002 * e[7], 0);
    s.world.law = OM_NEO_HOOKEAN;
    s.world.young_factor = seed % 2 ? 0.85 : 1.15;
    s.world.poisson = 0.42;
    s.world.density_factor = 0.97;
    s.world.friction = 0.2;
    s.world.tool_noise = 0.0005;
    s.monitor.rate = 10;
    s.task.max_actions = 24;  // tissue of all grasps looks alike
    return s;
}

static void run(int seed, const char* belief, Watcher* w) {
    OmScene scene = alarm_scene(seed, belief);
    OmSite twin_site, world_site;
    OmPlanner* planner;
    OmLoop* loop;
    *w = (Watcher){0};
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &twin_site));
    assert_ok(om_site_build(&scene, OM_SITE_WORLD, NULL, &world_site));
    assert_ok(om_body_create(&scene, &twin_site, 1, &w->twin));
    assert_ok(om_world_create_simulated(&scene, &world_site, 1, &w->world));
    OmPlannerDef planner_def = om_planner_default_def();
    planner_def.max_lift = 5;
    assert_ok(om_planner_create(&planner_def, &planner));
    assert_true(om_body_settle(w->twin, 0.02, OM_WORLD_SETTLE_SPEED, OM_WORLD_SETTLE_TIME) >= 0);
    assert_true(om_world_reset(w->world) >= 0);
    OmMonitorDef def = om_monitor_default_def(&scene, w->world, &twin_site);
    assert_ok(om_monitor_create(&def, &w->monitor));
    OmLoopDef loop_def = om_loop_default_def(&scene.task, w->world, w->twin, planner);
    OmLoopListener listener = {.ctx = w, .on_tick = watch};
    loop_def.listener = &listener;
    loop_def.nlistener = 1;
    assert_ok(om_loop_create(&loop_def, &loop));
    while (om_loop_phase(loop) != OM_LOOP_ENDED) assert_ok(om_loop_tick(loop));
    const OmRetractResult* r = om_loop_result(loop);
    printf("seed %d belief %s: state %d, mu %.2f to %.2f mm "
           "first %.1f s, %d alarms, rest %.3f mm, "
           "%d frames of %d points, %d actions, %s, force %.2f N, %.0f s\n",
           seed, belief, w->state, 1e3 * w->least, 1e3 * w->most, w->first, w->nalarm,
           1e3 * w->last.rest, w->nframe, w->last.npoint, r->naction,
           om_retract_outcome_text(r->outcome), r->twin.force, r->time);
    fflush(stdout);
    om_loop_destroy(loop);
    om_monitor_destroy(w->monitor);
    om_observation_done(&w->obs);
    om_world_destroy(w->world);
    om_body_destroy(w->twin);
    om_planner_destroy(planner);
    om_site_done(&twin_site);
    om_site_done(&world_site);
}

static int first_seed = 2000, count = 3;
static const char* belief = "same";

static void known_attachments_give_no_alarm(void** state) {
    (void)state;
    int nalarm = 0;
    for (int i = 0; i < count; ++i) {
        Watcher w;
        run(first_seed + i, belief, &w);
        nalarm += w.state > 0;
    }
    printf("%d of %d runs with an alarm\n", nalarm, count);
    if (!strcmp(belief, "same")) assert_int_equal(nalarm, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(known_attachments_give_no_alarm)};
    if (test_argc > 3) first_seed = (int)strtol(test_argv[2], NULL, 10);
    if (test_argc > 3) count = (int)strtol(test_argv[3], NULL, 10);
    if (test_argc > 4) belief = test_argv[4];
    return cmocka_run_group_tests(tests, NULL, NULL);
}
