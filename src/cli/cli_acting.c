// cli_acting.c: reaches and pulls of `omentum retract` by a policy of the task "approach".
//
// Each motion gets a box: of a reach 0.2 m or one and a half times its longest side, with the goal at 0.3 of its
// height, so that the policy keeps 25 mm above the tissue until it is near the goal; of a pull four times its length.
// Each action moves the tip by 0.02 of the box. Within a step and a half of the goal the rest is straight.
#include "cli_acting.h"

#include <math.h>

#define STEP 0.02        // share of the box, as the task has it by default
#define REACH_SIDE 0.20  // m, at least
#define REACH_SHARE 1.5  // side of the box over the longest side of the way
#define GOAL_HEIGHT 0.3  // share of the box
#define PULL_SHARE 4.0   // side of the box over the length of a pull
#define PULL_LEAST 0.01  // m

static void choose_box(OmCliActing* a, const OmLoopMotion* m) {
    OmVec3 way = om_sub(m->goal, m->tip), middle = om_lerp(m->tip, m->goal, 0.5);
    if (m->verb == OM_PLAN_REACH) {
        double longest = fmax(fabs(way.x), fmax(fabs(way.y), fabs(way.z)));
        a->side = fmax(REACH_SIDE, REACH_SHARE * longest);
        middle.z = m->goal.z + (0.5 - GOAL_HEIGHT) * a->side;
    } else {
        a->side = fmax(PULL_LEAST, PULL_SHARE * om_norm(way));
    }
    a->corner = om_sub(middle, om_scale(0.5 * a->side, om_vec3(1, 1, 1)));
}

static OmStatus next(void* ctx, const OmLoopMotion* m, OmVec3* place) {
    OmCliActing* a = ctx;
    double tip[3], goal[3];
    float obs[OM_RL_NAPPROACH];
    int action[3];
    if (m->nplace == 0) choose_box(a, m);
    *place = m->goal;
    if (om_distance(m->tip, m->goal) < 1.5 * STEP * a->side) return OM_OK;
    om_store3(tip, 0, om_scale(1 / a->side, om_sub(m->tip, a->corner)));  // side >= PULL_LEAST
    om_store3(goal, 0, om_scale(1 / a->side, om_sub(m->goal, a->corner)));
    om_rl_approach_observe(tip, goal, m->verb == OM_PLAN_REACH, obs);
    OM_TRY(om_rl_actor_act(a->actor, obs, NULL, action, NULL));
    OmVec3 way = om_vec3(action[0] - 1, action[1] - 1, action[2] - 1);
    if (om_norm2(way) > 0) *place = om_madd(m->tip, STEP * a->side, way);
    return OM_OK;
}

OmStatus om_cli_acting_load(const char* path, OmCliActing* acting) {
    OmRlTask* task = NULL;
    *acting = (OmCliActing){0};
    OM_TRY(om_rl_policy_load(path, &acting->policy));
    OmStatus status = om_rl_task_create("approach", NULL, 0, &task);
    if (status >= 0) {
        status = om_rl_policy_check(acting->policy, task);
        if (status < 0)
            status = om_error_prefix(
                status, "%s: motions need a policy of `omentum rl train -t approach`", path);
    }
    om_rl_task_destroy(task);
    if (status >= 0) status = om_rl_actor_create(acting->policy, 1, &acting->actor);
    if (status < 0) om_cli_acting_done(acting);
    return status;
}

void om_cli_acting_done(OmCliActing* acting) {
    om_rl_actor_destroy(acting->actor);
    om_rl_policy_destroy(acting->policy);
    *acting = (OmCliActing){0};
}

OmMotionLaw om_cli_acting_law(OmCliActing* acting) { return (OmMotionLaw){acting, next}; }
