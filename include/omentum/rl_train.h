/// omentum/rl_train.h: learning a task: PPO, GAIL and behaviour cloning (floor 7).
///
/// PPO (Schulman et al. 2017) collects `horizon` steps of every environment, estimates advantages (GAE), and descends
/// the clipped loss for some epochs. GAIL (Ho and Ermon 2016) adds the judgement of a discriminator to the
/// reward; it learns to distinguish demonstrations from the policy. Behaviour cloning fits the policy to
/// demonstrations alone.
///
///     OmRlTrainDef def = om_rl_train_default_def(task, "out/reach");
///     def.nstep = 200000;
///     OmRlTrainResult result;
///     om_rl_train_run(&def, NULL, &result);          // policy.safetensors, policy.onnx, metrics.csv, report.html
///
/// The policy is written with each checkpoint. With `eval_period` it is the best one of all evaluations, otherwise the
/// last one. The same call continues from the checkpoint and ends with the bytes of
/// an uninterrupted training. The result is a function of definition, task and seed, for any number of workers.
#ifndef OMENTUM_RL_TRAIN_H
#define OMENTUM_RL_TRAIN_H

#include "omentum/rl_policy.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum OmRlMethod { OM_RL_PPO, OM_RL_GAIL, OM_RL_CLONE } OmRlMethod;
#define OM_RL_NMETHOD 3
/// "ppo", "gail", "clone"
OM_API const char* om_rl_method_name(OmRlMethod method);

typedef struct OmRlTrainRow {  // of metrics.csv, one an iteration
    int64_t step;              // of all environments together
    int64_t nepisode;          // finished so far
    double mean_return;        // of the last 100 episodes; NaN before the first
    double mean_length;        // the same
    double mean_score;         // the same
    double loss_policy, loss_value, entropy;
    double divergence;     // approximate KL of the update
    double clip_fraction;  // samples whose ratio left the clip range
    double rate;           // learning rate
    // GAIL: share of samples that the discriminator judges right, demonstrations and the policy's
    double right_demo, right_policy;
    // of the evaluation after this iteration; NaN: there was none
    double eval_score, eval_return, eval_least;  // mean score, mean return, lowest score
    double seconds;  // of training, without the time between a stop and its resumption
} OmRlTrainRow;

typedef struct OmRlTrainDef {
    OmCookie cookie;
    const OmRlTask* task;
    const char* out_dir;   // null: no files
    OmRlMethod method;     // default OM_RL_PPO
    int64_t nstep;         // steps of all environments together, default 1,000,000
    int nenv;              // default 16
    int nworker;           // 0 (default): one per processor; the same bytes for any
    uint64_t seed;         // default 1
    OmRlPolicyDef policy;  // its networks
    const char* start;     // file of a policy whose weights are used at the start; default null
    // PPO
    int horizon;        // steps of each environment an iteration, default 64
    int batch;          // samples a descent; divides nenv x horizon; default 256
    int nepoch;         // passes over the samples of an iteration, default 3
    double rate;        // learning rate, falls linearly to 0; default 3e-4
    double gamma;       // discount, default 0.99
    double lambda;      // of GAE, default 0.95
    double clip;        // of the ratio, default 0.2
    double clip_value;  // of the change of the value; 0: none; default 0.2
    double entropy;     // weight of the entropy, default 5e-3
    // The actor's logits are multiplied by it over the third quarter of the training, 0.01 to 100. Above 1 drawn
    // actions become the most probable ones, which a user takes; default 1
    double sharpness;
    double value;              // weight of the value's loss, default 0.5
    double max_norm;           // of the gradient of both networks; 0: any; default 0.5
    bool normalise_advantage;  // in each batch; default true
    bool normalise_reward;     // by the standard deviation of discounted returns; default true
    // Demonstrations: GAIL and cloning
    const char* demos;     // file of om_rl_demos_save
    double weight_reward;  // of the task's reward beside GAIL's, default 0.2
    double weight_gail;    // default 0.8
    int clone_epoch;       // epochs of cloning: before GAIL (default 0), or alone (0: 200)
    double clone_rate;     // learning rate of cloning; default 0: `rate`
    double gail_rate;      // learning rate of the discriminator, default 3e-4
    double gail_noise;     // standard deviation added to its observations, default 0.02
    int gail_epoch;        // passes over the samples of an iteration, default 1
    bool gail_actions;     // it sees actions beside observations; default false
    // Evaluations during PPO and GAIL: episodes of the most probable actions. The policy with the highest mean score
    // is kept (then the highest mean return, then the later one) and is the result.
    int eval_period;     // iterations; the last one is always evaluated; 0 (default): none
    int eval_nepisode;   // of an evaluation, from drawn starts, always the same; default 32
    uint64_t eval_seed;  // of these episodes; default 2000
    // evaluations in a row in which every episode reaches the task's target: the training ends; 0 (default): never
    int eval_stop;
    const OmRlTask* eval_task;  // with the same observations and actions; null (default): `task`
    //
    double checkpoint_period;                            // s, default 30; 0: after each iteration
    const char* command;                                 // for the metadata; default null
    void (*on_row)(void* ctx, const OmRlTrainRow* row);  // after each iteration; may be null
    void* ctx;
} OmRlTrainDef;
OM_API OmRlTrainDef om_rl_train_default_def(const OmRlTask* task, const char* out_dir);

typedef struct OmRlTrainResult {  // om_rl_train_result_done frees
    OmRlPolicy* policy;
    OmRlTrainRow* row;  // (nrow)
    int nrow;
    bool is_resumed;
    int64_t kept_step;  // steps before the kept policy; 0: the last one, there were no evaluations
    double seconds;
} OmRlTrainResult;

/// Train. With a checkpoint in out_dir the training continues there; a checkpoint of other settings is refused.
/// @return OM_OK; OM_CANCELLED (the checkpoint is written); OM_INVALID (the message names the field); OM_NO_MEMORY;
///        OM_IO; an error of the task
OM_API OmStatus om_rl_train_run(const OmRlTrainDef* def, const OmProgress* progress,
                                OmRlTrainResult* result);
OM_API void om_rl_train_result_done(OmRlTrainResult* result);

#ifdef __cplusplus
}
#endif
#endif
