/// omentum/rl_policy.h: a policy and its value function as networks (floor 7).
///
/// The actor maps an observation to one number for each choice of each component of an action; the probabilities of a
/// component are the softmax of its numbers (a multi-discrete categorical policy). The critic maps an observation to
/// the expected discounted return. Both are perceptrons (Fig. 5.5 of the thesis); where the observation is a picture,
/// three convolutions come first (Mnih et al. 2015).
///
///     OmRlPolicyDef def = om_rl_policy_default_def(task);
///     OmRlPolicy* policy; OmRlActor* actor;
///     om_rl_policy_create(&def, &policy);
///     om_rl_actor_create(policy, 1, &actor);
///     om_rl_actor_act(actor, obs, NULL, action, NULL);      // the most probable action
#ifndef OMENTUM_RL_POLICY_H
#define OMENTUM_RL_POLICY_H

#include "omentum/nn.h"
#include "omentum/nn_file.h"
#include "omentum/rl.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_RL_MIN_SIDE 36  // of a picture for the convolutions

typedef struct OmRlPolicyDef {
    OmCookie cookie;
    char task[OM_RL_NAME];          // its name
    int nobservation;               // values of an observation
    int naction;                    // components of an action
    int nchoice[OM_RL_MAX_ACTION];  // choices of each
    int nlayer;                     // hidden layers, 1 to 8, default 2
    int width;                      // of each, 1 to 4096, default 128
    OmActivation activation;        // of each, default OM_TANH; of a picture OM_RELU
    // Sides of the picture that is observed, at least OM_RL_MIN_SIDE: convolutions. 0 (default where the task's
    // observation is no picture, or a smaller one): a perceptron reads the values.
    int picture_width, picture_height;
    // Of the task that it is trained on: OmRlTask.settings and values; "" in a file that does not state them.
    char settings[OM_RL_SETTINGS], values[OM_RL_SETTINGS];
    uint64_t seed;  // of the weights, default 1
} OmRlPolicyDef;
OM_API OmRlPolicyDef om_rl_policy_default_def(const OmRlTask* task);

typedef struct OmRlPolicy OmRlPolicy;
typedef enum OmRlNet { OM_RL_ACTOR, OM_RL_CRITIC } OmRlNet;

/// @return OM_OK; OM_INVALID (the message names the field); OM_NO_MEMORY
OM_API OmStatus om_rl_policy_create(const OmRlPolicyDef* def, OmRlPolicy** policy);
OM_API void om_rl_policy_destroy(OmRlPolicy* policy);
OM_API const OmRlPolicyDef* om_rl_policy_def(const OmRlPolicy* policy);
OM_API const OmNet* om_rl_policy_net(const OmRlPolicy* policy, OmRlNet which);
/// The parameters of a network: om_net_parameter_size values, to be read and changed.
OM_API float* om_rl_policy_parameters(OmRlPolicy* policy, OmRlNet which);
/// Whether the policy observes and acts as the task wants.
/// @return OM_OK; OM_INVALID (another task or other sizes)
OM_API OmStatus om_rl_policy_check(const OmRlPolicy* policy, const OmRlTask* task);

/// The task that the policy was trained on, with other settings: a setting that is not given is the policy's.
/// @param setting  (nsetting), may be null if there are none
/// @return as om_rl_task_create
OM_API OmStatus om_rl_policy_task(const OmRlPolicy* policy, const OmRlSetting* setting,
                                  int nsetting, OmRlTask** task);
/// Whether the file states the settings of its training; older ones do not.
OM_API bool om_rl_policy_is_stated(const OmRlPolicy* policy);
/// Append each value that differs from training, as "move_mm 0.5 (here 2), repeat 1 (here 4)".
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_rl_policy_differ(const OmRlPolicy* policy, const OmRlTask* task, OmText* text);

/// Write both networks into one safetensors file with `meta` and lines that om_rl_policy_load needs.
/// @return OM_OK; OM_INVALID (a value that is not finite); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_rl_policy_save(const OmRlPolicy* policy, const OmTextPair* meta, int nmeta,
                                  const char* path);
/// @return OM_OK; OM_INVALID (no such file of a policy, or damaged); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_rl_policy_load(const char* path, OmRlPolicy** policy);
/// Write the actor as ONNX: input "input" (n x nobservation x 1 x 1 x 1, of a picture n x 1 x height x width x 3),
/// output the numbers before the softmax.
/// @return OM_OK; OM_INVALID; OM_NO_MEMORY; OM_IO
OM_API OmStatus om_rl_policy_save_onnx(const OmRlPolicy* policy, const char* path);

/// A network of a policy compiled for a number of observations.
typedef struct OmRlActor OmRlActor;
/// @param n  observations a call, > 0
/// @return OM_OK; OM_INVALID; OM_NO_MEMORY
OM_API OmStatus om_rl_actor_create(OmRlPolicy* policy, int n, OmRlActor** actor);
OM_API void om_rl_actor_destroy(OmRlActor* actor);
/// Use the policy's present parameters; to be called after each change.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_rl_actor_update(OmRlActor* actor);
/// Choose actions.
/// @param obs       (n x nobservation)
/// @param rng       a stream for each observation (n); null: the most probable action, the first of equals
/// @param action    (n x naction)
/// @param log_prob  of the action; may be null (n)
/// @return OM_OK; OM_INVALID (the network gives a value that is not finite)
OM_API OmStatus om_rl_actor_act(OmRlActor* actor, const float* obs, OmRng* rng, int* action,
                                float* log_prob);

// ---- evaluation -------------------------------------------------------------------------------------

typedef struct OmRlEval {  // om_rl_eval_done frees
    int nepisode;
    int* episode;    // number of each, 0, 1 ..; a cancelled run lacks some (nepisode)
    double* ret;     // sum of rewards of each episode (nepisode)
    double* score;   // the task's score; the return where the task names none (nepisode)
    int* length;     // steps (nepisode)
    bool* is_ended;  // the task ended the episode, not the limit of steps (nepisode)
    double* info;    // the task's infos at the end of each episode (nepisode x ninfo of the task)
    double mean_return, mean_score, min_score, mean_length;
} OmRlEval;

typedef struct OmRlEvalDef {
    OmCookie cookie;
    const OmRlTask* task;
    OmRlPolicy* policy;  // null: the task's expert, or without one random actions
    int nepisode;   // 0 (default): one from each start of the evaluation, or 100 drawn episodes
    bool is_drawn;  // episodes begin at drawn starts, not at those of the evaluation; default false
    bool is_random;  // actions are drawn from the policy; default false: the most probable action
    bool is_expert;  // the task's expert acts; default false
    int nworker;     // 0 (default): one per processor; the same bytes for any
    uint64_t seed;   // default 1000
} OmRlEvalDef;
OM_API OmRlEvalDef om_rl_eval_default_def(const OmRlTask* task, OmRlPolicy* policy);
/// Run episodes to their end.
/// @return OM_OK; OM_INVALID; OM_NO_MEMORY; OM_CANCELLED (eval has the finished episodes, maybe none, and their
///         figures; om_rl_eval_done frees it); an error of the task
OM_API OmStatus om_rl_eval_run(const OmRlEvalDef* def, const OmProgress* progress, OmRlEval* eval);
OM_API void om_rl_eval_done(OmRlEval* eval);

#ifdef __cplusplus
}
#endif
#endif
