// rl_internal.h: declarations that the files of room rl share.
#ifndef OM_RL_INTERNAL_H
#define OM_RL_INTERNAL_H

#include "omentum/nn_train.h"
#include "omentum/rl.h"
#include "omentum/rl_demo.h"
#include "omentum/rl_drive.h"
#include "omentum/rl_policy.h"
#include "omentum/rl_train.h"

// ---- tasks

enum { OM__RL_MAX_EPISODE = 10000 };  // of an evaluation

// Kinds of tasks, each in its own file.
OmStatus om__rl_approach_create(const OmRlSetting* setting, int nsetting, OmRlTask** task);
OmStatus om__rl_cart_pole_create(const OmRlSetting* setting, int nsetting, OmRlTask** task);
OmStatus om__rl_reach_create(const OmRlSetting* setting, int nsetting, OmRlTask** task);
OmStatus om__rl_expose_create(const OmRlSetting* setting, int nsetting, OmRlTask** task);
OmStatus om__rl_press_create(const OmRlSetting* setting, int nsetting, OmRlTask** task);
OmStatus om__rl_retract_create(const OmRlSetting* setting, int nsetting, OmRlTask** task);

// The observation of a state, within obs_lo and obs_hi.
void om__rl_observe(const OmRlTask* task, const void* state, float* obs);

// OM_INVALID where the bounds of an observation are not set.
OmStatus om__rl_check_bounds(const OmRlTask* task);

// Read a setting as a number from lo to hi.
OmStatus om__rl_setting_number(const char* task, const OmRlSetting* setting, double lo, double hi,
                               double* value);
// The error of a key that the task does not have; `known` ends with null.
OmStatus om__rl_setting_unknown(const char* task, const OmRlSetting* setting,
                                const char* const* known);

// Add a line KEY=VALUE to a text of `size` bytes; the text is not changed where it has no room.
OmStatus om__rl_settings_add(char* text, size_t size, const char* key, const char* value);
// Fill task->settings, and task->values if the task has none of its own.
OmStatus om__rl_settings_fill(OmRlTask* task, const OmRlSetting* setting, int nsetting);
// The policy is trained further on this task.
void om__rl_policy_set_task(OmRlPolicy* policy, const OmRlTask* task);

// ---- keys of a person

// Six directions of a tip whose components of the action begin at `first`: the left hand has w s a d e c, the right
// hand i k j l o m and the keys of the cursor. `tool` is a text before the direction. Pictures are seen from -x: +y is
// to the left.
#define OM__RL_LEFT_HAND(tool, first, backward, forward)        \
    {'w', first, forward, tool "away from the camera (+x)"},    \
        {'s', first, backward, tool "towards the camera (-x)"}, \
        {'a', (first) + 1, forward, tool "to the left (+y)"},   \
        {'d', (first) + 1, backward, tool "to the right (-y)"}, \
        {'e', (first) + 2, forward, tool "up (+z)"}, {          \
        'c', (first) + 2, backward, tool "down (-z)"            \
    }
#define OM__RL_RIGHT_HAND(tool, first, backward, forward)                   \
    {OM_RL_KEY_UP, first, forward, tool "away from the camera (+x)"},       \
        {'i', first, forward, tool "away from the camera (+x)"},            \
        {OM_RL_KEY_DOWN, first, backward, tool "towards the camera (-x)"},  \
        {'k', first, backward, tool "towards the camera (-x)"},             \
        {OM_RL_KEY_LEFT, (first) + 1, forward, tool "to the left (+y)"},    \
        {'j', (first) + 1, forward, tool "to the left (+y)"},               \
        {OM_RL_KEY_RIGHT, (first) + 1, backward, tool "to the right (-y)"}, \
        {'l', (first) + 1, backward, tool "to the right (-y)"},             \
        {OM_RL_KEY_PAGE_UP, (first) + 2, forward, tool "up (+z)"},          \
        {'o', (first) + 2, forward, tool "up (+z)"},                        \
        {OM_RL_KEY_PAGE_DOWN, (first) + 2, backward, tool "down (-z)"}, {   \
        'm', (first) + 2, backward, tool "down (-z)"                        \
    }

// ---- demonstrations

// Memory for demonstrations of these sizes.
OmStatus om__rl_demos_alloc(int ndemo, int nstep, int nobservation, int naction, OmRlDemos* demos);
typedef struct OmRlDemoEpisode {
    int n;           // steps
    float* obs;      // before each (n x nobservation)
    int* action;     // (n x naction)
    double* reward;  // (n)
    double score;
} OmRlDemoEpisode;
// Append episodes of n > 0 steps; zero demonstrations: they are the first ones.
OmStatus om__rl_demos_append(OmRlDemos* demos, const OmRlTask* task, const OmRlDemoEpisode* episode,
                             int nepisode);
// The task of a drive, and its state.
const OmRlTask* om__rl_drive_task(const OmRlDrive* drive);
void* om__rl_drive_state(OmRlDrive* drive);

// ---- distributions and networks

// Logarithms of the softmax of n numbers.
void om__rl_choice_log(int n, const float* logit, double* log_prob);
// Choose an action, by `rng` or the most probable one. Returns the logarithm of its probability.
double om__rl_choice_draw(int naction, const int* nchoice, const float* logit, OmRng* rng,
                          int* action);
// Layers NAME.0, NAME.1, .., NAME.head.
OmStatus om__rl_perceptron(const char* name, int nin, int nlayer, int width,
                           OmActivation activation, int nout, OmNet** net);
// Multiply the actor's logits by sharpness: the most probable actions stay, their probabilities rise where it is > 1.
void om__rl_policy_sharpen(OmRlPolicy* policy, double sharpness);

// A run with one worker.
OmStatus om__rl_run_create(const OmNet* net, int n, bool is_training, OmNetRun** run);

// ---- losses

typedef struct RlBatch {  // samples of a descent
    int n;
    const float* obs;        // (n x nobservation)
    const int* action;       // (n x naction)
    const float* log_prob;   // of the action, by the policy that acted (n)
    const float* value;      // of the critic at that time (n)
    const float* advantage;  // (n)
    const float* target;     // discounted return (n)
} RlBatch;

typedef struct RlLoss {
    double policy, value, entropy;  // without their weights
    double divergence, clip_fraction;
} RlLoss;

// The losses of PPO and their weighted derivatives by the outputs of both networks.
// advantage: already normalised if it is to be
void om__rl_ppo_loss(const OmRlTrainDef* def, const RlBatch* b, const float* logit,
                     const float* value, float* dlogit, float* dvalue, RlLoss* loss);
// Minus the mean logarithm of the actions' probability, and its derivatives; the share of most probable ones.
double om__rl_clone_loss(const OmRlPolicyDef* def, int n, const int* action, const float* logit,
                         float* dlogit, double* right);
// (x - mean) / (standard deviation + 1e-8), with n - 1 as PyTorch has it.
void om__rl_normalise(int n, float* x);
// Generalised advantage estimation (Schulman et al. 2016, eq. 16) over nstep x nenv rewards.
// value: (nstep + 1) x nenv; is_end: the episode ended after the step
void om__rl_gae(int nstep, int nenv, double gamma, double lambda, const double* reward,
                const bool* is_end, const float* value, float* advantage, float* target);

// ---- the learner: networks, optimisers, compiled runs

typedef struct RlLearner {
    const OmRlTrainDef* def;
    OmRlPolicy* policy;
    OmNetRun *act, *judge;                         // actor and critic for nenv observations
    OmNetRun* train[2];                            // actor and critic for a batch
    OmOptim* optim[2];                             //
    float* grad[2];                                //
    float *out[2], *dout[2];                       // of a batch
    float* obs;                                    // of a batch
    int* action;                                   // of a batch
    float *log_prob, *value, *advantage, *target;  // of a batch
    int* order;                                    // of the samples (nenv x horizon)
} RlLearner;

OmStatus om__rl_learner_init(const OmRlTrainDef* def, RlLearner* learner);
void om__rl_learner_done(RlLearner* learner);
// Copy the parameters into all runs.
OmStatus om__rl_learner_update(RlLearner* learner);
// A permutation of 0 .. n - 1, a function of (seed, index).
void om__rl_shuffle(uint64_t seed, uint64_t index, int n, int* order);
// Descend the batch in the learner's arrays once.
OmStatus om__rl_learner_step(RlLearner* learner, double rate, RlLoss* loss);
// Epochs of cloning over the demonstrations: one descent after the other, from epoch `begin` to `end`.
OmStatus om__rl_clone(RlLearner* learner, const OmRlDemos* demos, int begin, int end,
                      const OmProgress* progress, double* loss, double* right);

// ---- the samples of an iteration

typedef struct RlRollout {  // step by step, the environments of a step after each other
    int nstep, nenv;
    float* obs;       // (nstep x nenv x nobservation)
    int* action;      // (nstep x nenv x naction)
    float* log_prob;  // (nstep x nenv)
    float* value;     // ((nstep + 1) x nenv)
    double* reward;   // the task's, then the mixed and normalised one (nstep x nenv)
    double* bonus;  // gamma V of the last observation where an episode was truncated (nstep x nenv)
    bool* is_end;   // (nstep x nenv)
    float* advantage;  // (nstep x nenv)
    float* target;     // (nstep x nenv)
    // of the step in progress
    float *logit, *final_obs;  // (nenv x ...)
    double *final_return, *final_info;
    int* final_length;
    bool *is_terminated, *is_truncated;
} RlRollout;

enum { RL_RECENT = 100 };  // episodes in the means

typedef struct RlCounters {  // all that changes beside networks and environments; saved as doubles
    double nstep, iteration, nepisode;
    double ret[RL_RECENT], length[RL_RECENT], score[RL_RECENT];  // rings
    double norm_count, norm_mean, norm_square;  // of the discounted return (Welford)
    double clone_epoch;
    double seconds;
    double eval_iteration;           // of the last evaluation; 0: none yet
    double best_score, best_return;  // of the kept policy
    double best_step;                // steps before it; 0: no policy is kept
    double nperfect;                 // perfect evaluations in a row
} RlCounters;

// Index of the score among the infos; -1: the return.
int om__rl_score_index(const OmRlTask* task);
OmStatus om__rl_rollout_init(const OmRlTrainDef* def, RlRollout* r);
void om__rl_rollout_done(RlRollout* r);
// Collect def->horizon steps. obs: of all environments, before and after.
OmStatus om__rl_rollout_run(RlLearner* learner, OmRlVec* vec, float* obs, RlCounters* c,
                            RlRollout* r);
// Normalise the rewards, add the bonus, estimate advantages. running: discounted returns so far (nenv)
void om__rl_rollout_finish(const OmRlTrainDef* def, double* running, RlCounters* c, RlRollout* r);

// ---- the discriminator of GAIL

typedef struct RlJudge {
    const OmRlTrainDef* def;
    int nin;
    OmNet* net;
    float *param, *grad;
    OmOptim* optim;
    OmNetRun *train, *all;   // for 2 x batch; for nenv
    float *in, *out, *dout;  //
} RlJudge;

OmStatus om__rl_judge_init(const OmRlTrainDef* def, RlJudge* judge);
void om__rl_judge_done(RlJudge* judge);
OmStatus om__rl_judge_update(RlJudge* judge);
// Learn from the samples of an iteration, then replace their rewards by the mixture.
OmStatus om__rl_judge_run(RlJudge* judge, const OmRlDemos* demos, int64_t iteration, double rate,
                          RlRollout* r, double* right_demo, double* right_policy);

// ---- files

typedef struct RlSession {  // everything of a training
    const OmRlTrainDef* def;
    OmRlVec* vec;
    RlLearner learner;
    RlRollout rollout;
    RlJudge judge;
    OmRlDemos demos;
    RlCounters c;
    float* obs;        // of the environments (nenv x nobservation)
    double* running;   // discounted returns (nenv)
    OmRlPolicy* best;  // of the evaluations; null: def->eval_period is 0
    OmRlTrainRow* row;
    int nrow, max_row;
    bool is_resumed;
} RlSession;

// ---- rl_best.c: evaluations during a training

OmStatus om__rl_best_init(RlSession* s);
// Whether an evaluation is to follow the iterations so far.
bool om__rl_best_is_due(const RlSession* s);
// Evaluate the policy if that is due, and keep it if it is the best one so far.
OmStatus om__rl_best_run(RlSession* s, const OmProgress* progress);
// The policy of the training so far: the kept one, if there is one.
OmRlPolicy* om__rl_best_policy(const RlSession* s);
// Whether all iterations are over, or `eval_stop` ends the training.
bool om__rl_best_is_over(const RlSession* s);
int64_t om__rl_count_iterations(const OmRlTrainDef* def);

OmStatus om__rl_checkpoint_save(const RlSession* s);
// Read the checkpoint if there is one; sets is_resumed.
OmStatus om__rl_checkpoint_load(RlSession* s);
OmStatus om__rl_save_metrics(const RlSession* s);
OmStatus om__rl_save_report(const RlSession* s);

/// Tasks without memory of their own, whose state is one block.
void om__rl_plain_destroy(OmRlTask* task);
OmStatus om__rl_plain_state_create(const OmRlTask* task, void** state);
void om__rl_plain_state_destroy(const OmRlTask* task, void* state);

/// An expert's action of three components: by `step` along each axis towards a goal at d, a fifth of them random.
static inline void om__rl_straight(const double d[3], double step, OmRng* rng, int action[3]) {
    for (int k = 0; k < 3; ++k) {
        action[k] = 1 + (d[k] > step / 2) - (d[k] < -step / 2);
        if (om_rng_uniform(rng) < 0.2) action[k] = (int)om_rng_below(rng, 3);
    }
}

#endif
