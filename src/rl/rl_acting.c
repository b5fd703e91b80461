// rl_acting.c: motions of an arm by a policy of the task "approach".
#include "omentum/rl_acting.h"

#include <math.h>

#include "omentum/rl_policy.h"

#define REACH_SIDE 0.20  // m, at least
#define REACH_SHARE 1.5  // side of the box over the longest side of the way
#define GOAL_HEIGHT 0.3  // share of the box
#define PULL_SHARE 4.0   // side of the box over the length of a pull
#define PULL_LEAST 0.01  // m

struct OmRlActing {
    OmRlPolicy* policy;
    OmRlActor* actor;
    OmVec3 corner;  // of the policy's box in this motion, m
    double side;    // of it, m
};

static void choose_box(OmRlActing* a, bool is_reach, OmVec3 tip, OmVec3 goal) {
    OmVec3 way = om_sub(goal, tip), middle = om_lerp(tip, goal, 0.5);
    if (is_reach) {
        double longest = fmax(fabs(way.x), fmax(fabs(way.y), fabs(way.z)));
        a->side = fmax(REACH_SIDE, REACH_SHARE * longest);
        middle.z = goal.z + (0.5 - GOAL_HEIGHT) * a->side;
    } else {
        a->side = fmax(PULL_LEAST, PULL_SHARE * om_norm(way));
    }
    a->corner = om_sub(middle, om_scale(0.5 * a->side, om_vec3(1, 1, 1)));
}

OmStatus om_rl_acting_next(OmRlActing* a, bool is_reach, bool is_first, OmVec3 tip, OmVec3 goal,
                           OmVec3* place) {
    double p[3], q[3];
    float obs[OM_RL_NAPPROACH];
    int action[3];
    if (is_first || !(a->side > 0)) choose_box(a, is_reach, tip, goal);
    *place = goal;
    if (om_distance(tip, goal) < 1.5 * OM_RL_ACTING_STEP * a->side) return OM_OK;
    om_store3(p, 0, om_scale(1 / a->side, om_sub(tip, a->corner)));  // side >= PULL_LEAST
    om_store3(q, 0, om_scale(1 / a->side, om_sub(goal, a->corner)));
    om_rl_approach_observe(p, q, is_reach, obs);
    OM_TRY(om_rl_actor_act(a->actor, obs, NULL, action, NULL));
    OmVec3 way = om_vec3(action[0] - 1, action[1] - 1, action[2] - 1);
    if (om_norm2(way) > 0) *place = om_madd(tip, OM_RL_ACTING_STEP * a->side, way);
    return OM_OK;
}

double om_rl_acting_side(const OmRlActing* a) { return a->side; }

// Motions have the step of the task's default.
static OmStatus warn_of_settings(const char* path, const OmRlPolicy* policy, const OmRlTask* task) {
    OmText text = {0};
    const OmStatus status = om_rl_policy_differ(policy, task, &text);
    if (status >= 0 && text.len)
        om_log(OM_LOG_WARNING, "%s: trained with other settings than motions have: %s", path,
               text.str);
    om_text_done(&text);
    return status;
}

OmStatus om_rl_acting_load(const char* path, OmRlActing** out) {
    OmRlTask* task = NULL;
    *out = NULL;
    OmRlActing* a = om_calloc(1, sizeof *a);
    if (!a) return OM_NO_MEMORY;
    OmStatus status = om_rl_policy_load(path, &a->policy);
    if (status >= 0) status = om_rl_task_create("approach", NULL, 0, &task);
    if (status >= 0) {
        status = om_rl_policy_check(a->policy, task);
        if (status < 0)
            status = om_error_prefix(
                status, "%s: motions need a policy of `omentum rl train -t approach`", path);
    }
    if (status >= 0) status = warn_of_settings(path, a->policy, task);
    om_rl_task_destroy(task);
    if (status >= 0) status = om_rl_actor_create(a->policy, 1, &a->actor);
    if (status < 0) {
        om_rl_acting_destroy(a);
        return status;
    }
    *out = a;
    return OM_OK;
}

void om_rl_acting_destroy(OmRlActing* a) {
    if (!a) return;
    om_rl_actor_destroy(a->actor);
    om_rl_policy_destroy(a->policy);
    om_free(a);
}
