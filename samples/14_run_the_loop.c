// 14_run_the_loop.c: the deliberative loop, one tick at a time, with a listener that prints plans and actions.
//
// The loop takes a world, a twin and a planner. The world here is simulated; a real robot fills the same table of
// functions (OmWorldOps). The loop is paused for a second and resumed, as a person at the robot may do.
#include <stdio.h>

#include "omentum/omentum.h"

#define PAUSE_AT 2.0    // s
#define PAUSE_TIME 1.0  // s

// ---- a listener: functions that the loop calls; unused ones are null ---------------------

static OmStatus on_plan(void* ctx, const OmLoop* loop, const OmSituation* situation,
                        const OmPlan* plan) {
    (void)ctx, (void)situation;
    printf("%5.1f s  a plan of %d actions\n", om_loop_sample(loop).time, plan->naction);
    return OM_OK;
}

static OmStatus on_action_begin(void* ctx, const OmLoop* loop, const OmPlanAction* action) {
    (void)ctx;
    const OmPlan* plan = om_loop_plan(loop);
    OmText text = {0};
    OmStatus status = om_plan_print_action(plan, (int)(action - plan->action), &text);
    if (status == OM_OK) printf("%5.1f s  %s\n", om_loop_sample(loop).time, text.str);
    om_text_done(&text);
    return status;  // an error would end the tick
}

static OmStatus on_action_end(void* ctx, const OmLoop* loop, const OmRetractAction* action) {
    (void)loop;
    ++*(int*)ctx;
    printf("%5.1f s    %s; at most %.2f N, %.0f %% of the region seen\n", action->end,
           om_action_outcome_text(action->outcome), action->force_max, 100 * action->visibility);
    return OM_OK;
}

// ---- the operation ----------------------------------------------------------------------------------------

// Tick to the end. A tick is one time step, so other work fits between two ticks.
static OmStatus operate(OmLoop* loop) {
    OmStatus status = OM_OK;
    bool was_paused = false;
    while (status >= 0 && om_loop_phase(loop) != OM_LOOP_ENDED) {
        double time = om_loop_sample(loop).time;
        if (!was_paused && time >= PAUSE_AT) {
            printf("%5.1f s  pause\n", time);
            status = om_loop_command(loop, &(OmLoopCommand){OM_LOOP_PAUSE});
            was_paused = true;
        } else if (om_loop_is_paused(loop) && time >= PAUSE_AT + PAUSE_TIME) {
            printf("%5.1f s  resume\n", time);
            status = om_loop_command(loop, &(OmLoopCommand){OM_LOOP_RESUME});
        }
        if (status >= 0) status = om_loop_tick(loop);
    }
    return status;
}

// What a loop needs, made from one scene.
typedef struct Parts {
    OmSite twin_site, world_site;
    OmBody* twin;
    OmWorld* world;
    OmPlanner* planner;
    OmLoop* loop;
} Parts;

static void parts_done(Parts* p) {
    om_loop_destroy(p->loop);
    om_planner_destroy(p->planner);
    om_world_destroy(p->world);
    om_body_destroy(p->twin);
    om_site_done(&p->world_site);
    om_site_done(&p->twin_site);
}

static OmStatus parts_build(const OmScene* scene, const OmLoopListener* listener, Parts* p) {
    OmPlannerDef planner = om_planner_default_def();
    OmStatus status = om_site_build(scene, OM_SITE_TWIN, NULL, &p->twin_site);
    if (status >= 0) status = om_site_build(scene, OM_SITE_WORLD, NULL, &p->world_site);
    if (status >= 0) status = om_body_create(scene, &p->twin_site, 0, &p->twin);
    if (status >= 0) status = om_world_create_simulated(scene, &p->world_site, 0, &p->world);
    if (status >= 0) status = om_planner_create(&planner, &p->planner);
    // the tissue comes to rest on its ground, in the twin and in the world
    if (status >= 0)
        status = om_body_settle(p->twin, scene->task.time_step, OM_WORLD_SETTLE_SPEED,
                                OM_WORLD_SETTLE_TIME);
    if (status >= 0) status = om_world_reset(p->world);
    if (status < 0) return status;
    OmLoopDef def = om_loop_default_def(&scene->task, p->world, p->twin, p->planner);
    def.listener = listener;
    def.nlistener = 1;
    return om_loop_create(&def, &p->loop);
}

int main(void) {
    OmScene scene = om_scene_default();
    scene.seed = 2;
    scene.tissue.cells = om_vec3(6, 6, 1);  // smaller than by default: a second
    int naction = 0;
    OmLoopListener listener = {.ctx = &naction,
                               .on_plan = on_plan,
                               .on_action_begin = on_action_begin,
                               .on_action_end = on_action_end};
    Parts parts = {0};
    OmStatus status = parts_build(&scene, &listener, &parts);
    if (status >= 0) status = operate(parts.loop);
    bool is_exposed = false;
    if (status >= 0) {
        const OmRetractResult* r = om_loop_result(parts.loop);
        is_exposed = r->is_exposed && r->naction == naction;
        printf("%5.1f s  %s\n", r->time, r->reason);
    } else {
        fprintf(stderr, "%s\n", om_error_message());
    }
    parts_done(&parts);
    return is_exposed ? 0 : 1;
}
