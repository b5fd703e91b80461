// rl_ppo.c: the losses of PPO, their gradients, and the descent.
//
// With r = exp(log pi(a) - log pi_old(a)), advantage A, value V, return R, entropy H:
//
//     L = - mean min(r A, clamp(r, 1 - c, 1 + c) A)                       (Schulman et al. 2017, eq. 7)
//         + w_v mean (V_old + clamp(V - V_old, -c_v, c_v) - R)^2 - w_h mean H
//
// as in Stable-Baselines3, whose numbers test_rl_ppo compares. The policy is a product of softmaxes of probabilities
// p and logarithms l: d log pi / d logit = 1[a] - p, d H / d logit = - p (l + H) for each component. Both networks
// share one norm for clipping the gradient.
#include <math.h>
#include <string.h>

#include "rl/rl_internal.h"

// ---- losses -------------------------------------------------------------------------------------------

typedef struct Point {  // of the policy at one sample
    double log_prob, entropy;
    double l[OM_RL_MAX_CHOICE];  // logarithms of all probabilities
    double component_entropy[OM_RL_MAX_ACTION];
} Point;

static Point eval_policy(int naction, const int* nchoice, const int* action, const float* logit) {
    Point p = {0};
    double* l = p.l;
    for (int k = 0; k < naction; ++k) {
        om__rl_choice_log(nchoice[k], logit, l);
        p.log_prob += l[action[k]];
        for (int j = 0; j < nchoice[k]; ++j) p.component_entropy[k] -= exp(l[j]) * l[j];
        p.entropy += p.component_entropy[k];
        l += nchoice[k];
        logit += nchoice[k];
    }
    return p;
}

// by_log: derivative of the loss by log_prob; by_entropy: by the entropy.
static void policy_gradient(int naction, const int* nchoice, const int* action, const Point* p,
                            double by_log, double by_entropy, float* dlogit) {
    const double* l = p->l;
    for (int k = 0; k < naction; ++k) {
        for (int j = 0; j < nchoice[k]; ++j) {
            double prob = exp(l[j]);
            dlogit[j] = (float)(by_log * ((j == action[k]) - prob) -
                                by_entropy * prob * (l[j] + p->component_entropy[k]));
        }
        l += nchoice[k];
        dlogit += nchoice[k];
    }
}

void om__rl_ppo_loss(const OmRlTrainDef* def, const RlBatch* b, const float* logit,
                     const float* value, float* dlogit, float* dvalue, RlLoss* loss) {
    const int naction = def->policy.naction, *nchoice = def->policy.nchoice;
    const double n = b->n;
    int nlogit = 0;
    for (int k = 0; k < naction; ++k) nlogit += nchoice[k];
    *loss = (RlLoss){0};
    for (int i = 0; i < b->n; ++i) {
        const int* action = b->action + (ptrdiff_t)i * naction;
        const Point p = eval_policy(naction, nchoice, action, logit + (ptrdiff_t)i * nlogit);
        const double a = (double)b->advantage[i], change = p.log_prob - (double)b->log_prob[i];
        const double ratio = exp(change);
        const double kept = fmin(fmax(ratio, 1 - def->clip), 1 + def->clip);
        bool is_free = ratio * a <= kept * a;  // the minimum is the term that is not clipped
        loss->policy -= fmin(ratio * a, kept * a) / n;
        loss->entropy += p.entropy / n;
        loss->divergence += (ratio - 1 - change) / n;
        loss->clip_fraction += (fabs(ratio - 1) > def->clip) / n;
        policy_gradient(naction, nchoice, action, &p, is_free ? -ratio * a / n : 0,
                        -def->entropy / n, dlogit + (ptrdiff_t)i * nlogit);

        const double old = (double)b->value[i], move = (double)value[i] - old;
        bool is_inside = def->clip_value <= 0 || fabs(move) <= def->clip_value;
        double v = is_inside ? (double)value[i] : old + copysign(def->clip_value, move);
        double error = v - (double)b->target[i];
        loss->value += error * error / n;
        dvalue[i] = is_inside ? (float)(def->value * 2 * error / n) : 0;
    }
}

double om__rl_clone_loss(const OmRlPolicyDef* def, int n, const int* action, const float* logit,
                         float* dlogit, double* right) {
    double sum = 0;
    int nlogit = 0, nright = 0;
    for (int k = 0; k < def->naction; ++k) nlogit += def->nchoice[k];
    for (int i = 0; i < n; ++i) {
        const int* a = action + (ptrdiff_t)i * def->naction;
        const Point p = eval_policy(def->naction, def->nchoice, a, logit + (ptrdiff_t)i * nlogit);
        int best[OM_RL_MAX_ACTION], nsame = 0;
        sum -= p.log_prob / n;
        policy_gradient(def->naction, def->nchoice, a, &p, -1.0 / n, 0,
                        dlogit + (ptrdiff_t)i * nlogit);
        om__rl_choice_draw(def->naction, def->nchoice, logit + (ptrdiff_t)i * nlogit, NULL, best);
        for (int k = 0; k < def->naction; ++k) nsame += best[k] == a[k];
        nright += nsame;
    }
    *right = (double)nright / ((double)n * def->naction);
    return sum;
}

void om__rl_normalise(int n, float* x) {
    double mean = 0, square = 0;
    for (int i = 0; i < n; ++i) mean += (double)x[i] / n;
    for (int i = 0; i < n; ++i) square += ((double)x[i] - mean) * ((double)x[i] - mean);
    double sd = sqrt(square / (n > 1 ? n - 1 : 1));
    for (int i = 0; i < n; ++i) x[i] = (float)(((double)x[i] - mean) / (sd + 1e-8));
}

void om__rl_gae(int nstep, int nenv, double gamma, double lambda, const double* reward,
                const bool* is_end, const float* value, float* advantage, float* target) {
    for (int i = 0; i < nenv; ++i) {
        double sum = 0;
        for (int t = nstep - 1; t >= 0; --t) {
            ptrdiff_t at = (ptrdiff_t)t * nenv + i;
            double keep = is_end[at] ? 0 : gamma;
            double delta = reward[at] + keep * (double)value[at + nenv] - (double)value[at];
            sum = delta + keep * lambda * sum;
            advantage[at] = (float)sum;
            target[at] = (float)(sum + (double)value[at]);
        }
    }
}

// ---- the learner --------------------------------------------------------------------------------------

OmStatus om__rl_learner_init(const OmRlTrainDef* def, RlLearner* l) {
    const size_t batch = (size_t)def->batch, total = (size_t)def->nenv * (size_t)def->horizon;
    OmOptimDef optim = om_optim_default_def();
    optim.kind = OM_OPTIM_ADAM;
    optim.weight_decay = 0;
    optim.epsilon = 1e-5;  // of Stable-Baselines3 and ML-Agents' predecessors
    optim.nworker = 1;
    l->def = def;
    if (def->start) {
        OM_TRY(om_rl_policy_load(def->start, &l->policy));
        OM_TRY(om_rl_policy_check(l->policy, def->task));
        om__rl_policy_set_task(l->policy, def->task);
    } else {
        OM_TRY(om_rl_policy_create(&def->policy, &l->policy));
    }
    for (int i = 0; i < 2; ++i) {
        const OmNet* net = om_rl_policy_net(l->policy, i ? OM_RL_CRITIC : OM_RL_ACTOR);
        const size_t nout = (size_t)om_net_out_size(net);
        OM_TRY(om__rl_run_create(net, def->nenv, false, i ? &l->judge : &l->act));
        OM_TRY(om__rl_run_create(net, def->batch, true, &l->train[i]));
        OM_TRY(om_optim_create(&optim, net, &l->optim[i]));
        OM_ALLOC(l->grad[i], om_net_parameter_size(net));
        OM_ALLOC(l->out[i], batch * nout);
        OM_ALLOC(l->dout[i], batch * nout);
    }
    OM_ALLOC(l->obs, batch * (size_t)def->task->nobservation);
    OM_ALLOC(l->action, batch * (size_t)def->task->naction);
    OM_ALLOC(l->log_prob, batch);
    OM_ALLOC(l->value, batch);
    OM_ALLOC(l->advantage, batch);
    OM_ALLOC(l->target, batch);
    OM_ALLOC(l->order, total);
    return om__rl_learner_update(l);
}

void om__rl_learner_done(RlLearner* l) {
    om_rl_policy_destroy(l->policy);
    om_net_run_destroy(l->act);
    om_net_run_destroy(l->judge);
    for (int i = 0; i < 2; ++i) {
        om_net_run_destroy(l->train[i]);
        om_optim_destroy(l->optim[i]);
        om_free(l->grad[i]);
        om_free(l->out[i]);
        om_free(l->dout[i]);
    }
    om_free(l->obs);
    om_free(l->action);
    om_free(l->log_prob);
    om_free(l->value);
    om_free(l->advantage);
    om_free(l->target);
    om_free(l->order);
}

OmStatus om__rl_learner_update(RlLearner* l) {
    const float* actor = om_rl_policy_parameters(l->policy, OM_RL_ACTOR);
    const float* critic = om_rl_policy_parameters(l->policy, OM_RL_CRITIC);
    OM_TRY(om_net_run_set_parameters(l->act, actor));
    OM_TRY(om_net_run_set_parameters(l->judge, critic));
    OM_TRY(om_net_run_set_parameters(l->train[0], actor));
    return om_net_run_set_parameters(l->train[1], critic);
}

void om__rl_shuffle(uint64_t seed, uint64_t index, int n, int* order) {
    OmRng rng = om_rng_init(seed, index);
    for (int i = 0; i < n; ++i) order[i] = i;
    for (int i = n - 1; i > 0; --i) {
        int j = (int)om_rng_below(&rng, (uint32_t)i + 1), keep = order[i];
        order[i] = order[j];
        order[j] = keep;
    }
}

// Actor and critic are independent until the gradient's norm: one worker each.
typedef struct Pass {
    RlLearner* l;
    OmStatus status[2];
    bool is_forward;
} Pass;

static void run_pass(void* ctx, int begin, int end, int block) {
    (void)block;
    Pass* p = ctx;
    RlLearner* l = p->l;
    for (int i = begin; i < end; ++i)
        p->status[i] = p->is_forward
                           ? om_net_run_forward(l->train[i], l->obs, l->out[i])
                           : om_net_run_backward(l->train[i], l->dout[i], l->grad[i], NULL);
}

static OmStatus run_both(RlLearner* l, bool is_forward) {
    Pass p = {.l = l, .is_forward = is_forward};
    om_parallel_for(l->def->nworker, 2, 1, run_pass, &p);
    for (int i = 0; i < 2; ++i)
        if (p.status[i] < 0)
            return om_error(p.status[i], "the %s's %s pass failed", i ? "critic" : "actor",
                            is_forward ? "forward" : "backward");
    return OM_OK;
}

static void clip_gradients(RlLearner* l) {
    double sum = 0, most = l->def->max_norm;
    size_t n[2];
    for (int i = 0; i < 2; ++i) {
        n[i] = om_net_parameter_size(om_rl_policy_net(l->policy, i ? OM_RL_CRITIC : OM_RL_ACTOR));
        for (size_t k = 0; k < n[i]; ++k) sum += (double)l->grad[i][k] * (double)l->grad[i][k];
    }
    double norm = sqrt(sum);
    if (most <= 0 || !(norm > most))
        return;  // a norm that is not finite is refused by the optimiser
    for (int i = 0; i < 2; ++i)
        for (size_t k = 0; k < n[i]; ++k) l->grad[i][k] *= (float)(most / (norm + 1e-6));
}

OmStatus om__rl_learner_step(RlLearner* l, double rate, RlLoss* loss) {
    const OmRlTrainDef* def = l->def;
    RlBatch b = {.n = def->batch,
                 .obs = l->obs,
                 .action = l->action,
                 .log_prob = l->log_prob,
                 .value = l->value,
                 .advantage = l->advantage,
                 .target = l->target};
    if (def->normalise_advantage) om__rl_normalise(b.n, l->advantage);
    OM_TRY(run_both(l, true));
    om__rl_ppo_loss(def, &b, l->out[0], l->out[1], l->dout[0], l->dout[1], loss);
    OM_TRY(run_both(l, false));
    clip_gradients(l);
    for (int i = 0; i < 2; ++i) {
        float* param = om_rl_policy_parameters(l->policy, i ? OM_RL_CRITIC : OM_RL_ACTOR);
        OM_TRY(om_optim_step(l->optim[i], rate, l->grad[i], param, NULL));
        OM_TRY(om_net_run_set_parameters(l->train[i], param));
    }
    return OM_OK;
}

// ---- cloning ------------------------------------------------------------------------------------------

OmStatus om__rl_clone(RlLearner* l, const OmRlDemos* demos, int begin, int end,
                      const OmProgress* progress, double* loss, double* right) {
    const OmRlTrainDef* def = l->def;
    const double rate = def->clone_rate > 0 ? def->clone_rate : def->rate;
    const size_t nobs = (size_t)demos->nobservation, naction = (size_t)demos->naction;
    float* param = om_rl_policy_parameters(l->policy, OM_RL_ACTOR);
    OmStatus status = OM_OK;
    int* order = NULL;
    // The last batch begins anew at the front.
    int nbatch = (demos->nstep + def->batch - 1) / def->batch;
    OM_ALLOC_DONE(order, demos->nstep);
    for (int epoch = begin; epoch < end; ++epoch) {
        OM_TRY_DONE(om_progress_report(progress, "cloning", epoch, end));
        om__rl_shuffle(def->seed + 17, (uint64_t)epoch, demos->nstep, order);
        *loss = *right = 0;
        for (int b = 0; b < nbatch; ++b) {
            double share;
            for (int i = 0; i < def->batch; ++i) {
                size_t at = (size_t)order[((int64_t)b * def->batch + i) % demos->nstep];
                memcpy(l->obs + (size_t)i * nobs, demos->obs + at * nobs, nobs * sizeof(float));
                memcpy(l->action + (size_t)i * naction, demos->action + at * naction,
                       naction * sizeof(int));
            }
            OM_TRY_DONE(om_net_run_forward(l->train[0], l->obs, l->out[0]));
            *loss += om__rl_clone_loss(&def->policy, def->batch, l->action, l->out[0], l->dout[0],
                                       &share) /
                     nbatch;
            *right += share / nbatch;
            OM_TRY_DONE(om_net_run_backward(l->train[0], l->dout[0], l->grad[0], NULL));
            OM_TRY_DONE(om_optim_step(l->optim[0], rate, l->grad[0], param, NULL));
            OM_TRY_DONE(om_net_run_set_parameters(l->train[0], param));
        }
    }
done:
    om_free(order);
    return status < 0 ? status : om__rl_learner_update(l);
}
