// rl_best.c: evaluations during a training; the policy with the best one is kept.
//
// A training draws its actions; a user takes the most probable ones. The two may differ: a policy that moves by drawn
// actions may stand still by the most probable ones. An evaluation tries the most probable ones, from drawn starts that
// are the same each time. It changes nothing but the kept policy: with or without evaluations the iterations have the
// same bytes.
#include <math.h>
#include <string.h>

#include "rl/rl_internal.h"

OmStatus om__rl_best_init(RlSession* s) {
    const OmRlTrainDef* def = s->def;
    if (def->eval_period == 0) return OM_OK;
    OmRlPolicyDef policy = *om_rl_policy_def(s->learner.policy);
    if (def->eval_task) OM_TRY(om_rl_policy_check(s->learner.policy, def->eval_task));
    return om_rl_policy_create(&policy, &s->best);
}

bool om__rl_best_is_over(const RlSession* s) {
    const bool is_stopped = s->def->eval_stop > 0 && s->c.nperfect >= s->def->eval_stop;
    return is_stopped || s->c.iteration >= (double)om__rl_count_iterations(s->def);
}

bool om__rl_best_is_due(const RlSession* s) {
    const OmRlTrainDef* def = s->def;
    if (!s->best || s->c.iteration == 0 || s->c.eval_iteration == s->c.iteration) return false;
    return fmod(s->c.iteration, def->eval_period) == 0 ||
           s->c.iteration >= (double)om__rl_count_iterations(def);
}

OmRlPolicy* om__rl_best_policy(const RlSession* s) {
    return s->c.best_step > 0 ? s->best : s->learner.policy;
}

static void copy_policy(OmRlPolicy* from, OmRlPolicy* to) {
    static const OmRlNet net[] = {OM_RL_ACTOR, OM_RL_CRITIC};
    for (int k = 0; k < 2; ++k)
        memcpy(om_rl_policy_parameters(to, net[k]), om_rl_policy_parameters(from, net[k]),
               om_net_parameter_size(om_rl_policy_net(from, net[k])) * sizeof(float));
}

static bool is_best(const RlCounters* c, const OmRlEval* e) {
    if (c->best_step == 0 || e->mean_score > c->best_score) return true;
    return e->mean_score == c->best_score && e->mean_return >= c->best_return;
}

OmStatus om__rl_best_run(RlSession* s, const OmProgress* progress) {
    const OmRlTrainDef* def = s->def;
    OmRlTrainRow* row = &s->row[s->nrow - 1];
    OmRlEval e;
    if (!om__rl_best_is_due(s)) return OM_OK;
    const OmRlTask* task = def->eval_task ? def->eval_task : def->task;
    OmRlEvalDef how = om_rl_eval_default_def(task, s->learner.policy);
    how.nepisode = def->eval_nepisode;
    how.is_drawn = true;
    how.nworker = def->nworker;
    how.seed = def->eval_seed;
    const OmStatus status = om_rl_eval_run(&how, progress, &e);
    if (status < 0) {
        om_rl_eval_done(&e);
        return status;
    }
    row->eval_score = e.mean_score;
    row->eval_return = e.mean_return;
    row->eval_least = e.min_score;
    s->c.nperfect = e.min_score >= task->target ? s->c.nperfect + 1 : 0;
    s->c.eval_iteration = s->c.iteration;
    if (is_best(&s->c, &e)) {
        copy_policy(s->learner.policy, s->best);
        s->c.best_score = e.mean_score;
        s->c.best_return = e.mean_return;
        s->c.best_step = s->c.nstep;
    }
    om_rl_eval_done(&e);
    return OM_OK;
}
