// rl_gail.c: the discriminator of GAIL (Ho and Ermon 2016; thesis 5.3.2, 5.4.2).
//
// A perceptron D tells states of demonstrations (1) from states of the policy (0); its loss is the binary cross entropy
// of a batch of each. The reward is w_r r + w_g log D, at most 0: like the task's own rewards it is a cost of time, so
// a policy that reaches the end soon is better off. The usual -log(1 - D) is positive, and a policy with it stays away
// from the end of the episode. 35 demonstrations are few: noise on the discriminator's input and weight decay keep it
// from learning them by heart (a gradient penalty would need second derivatives).
#include <math.h>
#include <string.h>

#include "rl/rl_internal.h"

#define DECAY 1e-3
#define LOWEST (-10.0)  // of log D
#define NOISE_STREAM 0x6761696c00000000ull

OmStatus om__rl_judge_init(const OmRlTrainDef* def, RlJudge* j) {
    const size_t batch = 2 * (size_t)def->batch;
    OmOptimDef optim = om_optim_default_def();
    optim.weight_decay = DECAY;
    optim.nworker = 1;
    j->def = def;
    j->nin = def->task->nobservation + (def->gail_actions ? om_rl_task_nlogit(def->task) : 0);
    OM_TRY(om__rl_perceptron("judge", j->nin, def->policy.nlayer, def->policy.width,
                             def->policy.activation, 1, &j->net));
    const size_t n = om_net_parameter_size(j->net);
    OM_ALLOC(j->param, n);
    OM_ALLOC(j->grad, n);
    om_net_init_parameters(j->net, def->seed + 104729, j->param);
    OM_TRY(om_optim_create(&optim, j->net, &j->optim));
    OM_TRY(om__rl_run_create(j->net, (int)batch, true, &j->train));
    OM_TRY(om__rl_run_create(j->net, def->nenv, false, &j->all));
    const size_t rows = batch > (size_t)def->nenv ? batch : (size_t)def->nenv;
    OM_ALLOC(j->in, rows * (size_t)j->nin);
    OM_ALLOC(j->out, rows);
    OM_ALLOC(j->dout, rows);
    return om__rl_judge_update(j);
}

void om__rl_judge_done(RlJudge* j) {
    om_optim_destroy(j->optim);
    om_net_run_destroy(j->train);
    om_net_run_destroy(j->all);
    om_net_destroy(j->net);
    om_free(j->param);
    om_free(j->grad);
    om_free(j->in);
    om_free(j->out);
    om_free(j->dout);
}

OmStatus om__rl_judge_update(RlJudge* j) {
    OM_TRY(om_net_run_set_parameters(j->train, j->param));
    return om_net_run_set_parameters(j->all, j->param);
}

// One row of input: the observation with noise, and the action as ones and zeros.
static void fill_row(const RlJudge* j, const float* obs, const int* action, OmRng* rng, float* in) {
    const OmRlTask* task = j->def->task;
    const int nobs = task->nobservation;
    for (int k = 0; k < nobs; ++k)
        in[k] = obs[k] + (rng ? (float)(j->def->gail_noise * om_rng_normal(rng)) : 0);
    if (!j->def->gail_actions) return;
    float* at = in + nobs;
    for (int k = 0; k < task->naction; at += task->nchoice[k++])
        for (int c = 0; c < task->nchoice[k]; ++c) at[c] = action[k] == c ? 1 : 0;
}

// max(x, 0) + log(1 + exp(-|x|)) without overflow
static double softplus(double x) { return fmax(x, 0) + log1p(exp(-fabs(x))); }

// A descent on the first half (demonstrations) and the second half (policy) of the batch.
static OmStatus descend(RlJudge* j, double rate, double* right_demo, double* right_policy) {
    const int n = j->def->batch;
    OM_TRY(om_net_run_forward(j->train, j->in, j->out));
    for (int i = 0; i < 2 * n; ++i) {
        const double x = (double)j->out[i], p = exp(-softplus(-x));  // sigmoid
        bool is_demo = i < n;
        j->dout[i] = (float)((p - is_demo) / (2 * n));
        *(is_demo ? right_demo : right_policy) += ((x > 0) == is_demo) / (double)n;
    }
    OM_TRY(om_net_run_backward(j->train, j->dout, j->grad, NULL));
    OM_TRY(om_optim_step(j->optim, rate, j->grad, j->param, NULL));
    return om_net_run_set_parameters(j->train, j->param);
}

static OmStatus learn(RlJudge* j, const OmRlDemos* demos, int64_t iteration, double rate,
                      const RlRollout* r, double* right_demo, double* right_policy) {
    const OmRlTrainDef* def = j->def;
    const int total = r->nstep * r->nenv, n = def->batch;
    const int nobs = def->task->nobservation, naction = def->task->naction;
    int* order = NULL;
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(order, total);
    for (int epoch = 0; epoch < def->gail_epoch; ++epoch) {
        uint64_t index = (uint64_t)iteration * (uint64_t)def->gail_epoch + (uint64_t)epoch;
        OmRng rng = om_rng_init(def->seed ^ NOISE_STREAM, index);
        om__rl_shuffle(def->seed + 29, index, total, order);
        for (int begin = 0; begin + n <= total; begin += n) {
            for (int i = 0; i < n; ++i) {
                ptrdiff_t d = om_rng_below(&rng, (uint32_t)demos->nstep), p = order[begin + i];
                fill_row(j, demos->obs + d * nobs, demos->action + d * naction, &rng,
                         j->in + (ptrdiff_t)i * j->nin);
                fill_row(j, r->obs + p * nobs, r->action + p * naction, &rng,
                         j->in + (ptrdiff_t)(n + i) * j->nin);
            }
            OM_TRY_DONE(descend(j, rate, right_demo, right_policy));
        }
    }
    const double num = (double)def->gail_epoch * (total / n);  // total is a multiple of n
    *right_demo /= num;
    *right_policy /= num;
done:
    om_free(order);
    return status;
}

OmStatus om__rl_judge_run(RlJudge* j, const OmRlDemos* demos, int64_t iteration, double rate,
                          RlRollout* r, double* right_demo, double* right_policy) {
    const OmRlTrainDef* def = j->def;
    const int nobs = def->task->nobservation, naction = def->task->naction;
    *right_demo = *right_policy = 0;
    OM_TRY(learn(j, demos, iteration, rate, r, right_demo, right_policy));
    OM_TRY(om__rl_judge_update(j));
    for (int t = 0; t < r->nstep; ++t) {
        const ptrdiff_t at = (ptrdiff_t)t * r->nenv;
        for (int i = 0; i < r->nenv; ++i)
            fill_row(j, r->obs + (at + i) * nobs, r->action + (at + i) * naction, NULL,
                     j->in + (ptrdiff_t)i * j->nin);
        OM_TRY(om_net_run_forward(j->all, j->in, j->out));
        for (int i = 0; i < r->nenv; ++i) {
            double log_d = fmax(-softplus(-(double)j->out[i]), LOWEST);
            r->reward[at + i] = def->weight_reward * r->reward[at + i] + def->weight_gail * log_d;
        }
    }
    return OM_OK;
}
