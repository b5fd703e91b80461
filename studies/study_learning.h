/// studies/study_learning.h: a policy learns to retract: thesis 5.5 and 5.6, Figs 5.7, 5.8, 5.10.
///
/// PPO with the thesis's reward, PPO with reward (b), GAIL and behaviour cloning are trained from several seeds. Each
/// policy acts deterministically from every start of the evaluation, in the task of the training and in "reality".
/// Trainings and evaluations that are finished are kept; an interrupted study continues.
///
///     OmStudyLearningDef def = om_study_learning_default_def("out/learning");
///     om_study_learning_run(&def, progress, &summary);          // out/learning/report.html, study.json
#ifndef OMENTUM_STUDY_LEARNING_H
#define OMENTUM_STUDY_LEARNING_H

#include "omentum/rl_train.h"
#include "studies/study.h"

typedef enum OmStudyLearner {
    OM_LEARNER_THESIS,  // PPO, reward (a); only where the task has the setting reward=thesis
    OM_LEARNER_PPO,     // PPO, reward (b)
    OM_LEARNER_GAIL,    // reward (b) and demonstrations
    OM_LEARNER_CLONE,   // demonstrations alone
    OM_NLEARNER
} OmStudyLearner;

typedef struct OmStudyLearningDef {  // made by om_study_learning_default_def
    const char* out_dir;             // borrowed
    const char* task;                // default "retract"
    const OmRlSetting* setting;      // of the task; default none (nsetting)
    int nsetting;                    //
    // more settings, for PPO's training alone; default move_mm=2, max_step=150 (ntrain_setting)
    const OmRlSetting* train_setting;
    int ntrain_setting;  //
    // more settings, for evaluation alone; default still=100 (neval_setting)
    const OmRlSetting* eval_setting;
    int neval_setting;  //
    // more settings, for demonstrations, for trainings but the thesis's, and for the evaluations that choose a policy
    // of a training: bodies and errors of the tip are drawn, so that a policy bears what it does not know (5.6);
    // default variants=6, vary_thickness=0.1, vary_softness=0.6, vary_kidney_mm=2, tip_error_mm=1.7 (nvaried_setting)
    const OmRlSetting* varied_setting;
    int nvaried_setting;
    bool has[OM_NLEARNER];  // default all
    int nseed;              // 1 to 9; seeds 1, 2, ..; default 3
    int64_t nstep;          // of a training of PPO, default 262,144
    double rate;            // learning rate; default 7e-4
    // more settings, for the training of PPO with reward (b) alone, both parts; default margin_mm=10 (nppo_setting)
    const OmRlSetting* ppo_setting;
    int nppo_setting;
    // of PPO with reward (b) a second part with drawn bodies follows; default 327,680 steps, 5e-4; 0: none
    int64_t varied_nstep;
    double varied_rate;
    // more settings, for this part's training alone; default step_cost=0.02 (nvaried_train_setting)
    const OmRlSetting* varied_train_setting;
    int nvaried_train_setting;
    double varied_sharpness;  // OmRlTrainDef.sharpness of it; default 32
    double varied_entropy;    // weight of the entropy in it; default 0
    double entropy;           // its weight; default 1e-3
    int nenv;                 // environments side by side, default 32
    int horizon, batch;       // default 64, 256
    int nepoch;               // passes over the samples of an iteration; default 10
    // more settings, for demonstrations, GAIL and cloning; default max_step=700: the moves are those of the evaluation
    const OmRlSetting* gail_setting;
    int ngail_setting;             //
    int64_t gail_nstep;            // of GAIL: default 32,768
    double gail_rate;              // default 3e-5
    double gail_clone_rate;        // of cloning before GAIL; default 3e-4
    double gail_entropy;           // default 0
    int gail_nenv;                 // default 16
    int gail_horizon, gail_batch;  // default 64, 128
    int clone_epoch;               // epochs of cloning before GAIL; default 100
    // Evaluations during the trainings of PPO and GAIL, from drawn starts with the moves of the evaluation: the policy
    // with the best one is the result (OmRlTrainDef).
    int eval_period, gail_eval_period;  // iterations; 0: none; default 16, 0
    int eval_nepisode;                  // default 96
    int ndemo;                          // default 35
    bool has_reality;                   // evaluate with world=reality too; default true
    int nworker;                        // default 0: one a processor
    OmCookie cookie;
} OmStudyLearningDef;

typedef struct OmStudyLearning {  // of a learner; means over its seeds
    bool is_there;
    double mean, least_mean;  // score over all starts; of the seed where it is lowest
    double lowest;            // score of a start, of any seed
    // of starts in the third at the fixed side and in the third far from it; NaN unless there are 7 x 7 starts
    double near_third, far_third;
    double reality_mean, reality_lowest;  // NaN: not evaluated
    double steps90;  // until 90 % of the rise of the return; NaN without a curve
    double seconds;  // of a training
} OmStudyLearning;

typedef struct OmStudyLearningSummary {
    OmStudyLearning by[OM_NLEARNER];
    bool is_met;       // every bound of doc/notes/rl_learning.md that was measured
    char missed[512];  // the missed bounds with their values; "": none
} OmStudyLearningSummary;

OmStudyLearningDef om_study_learning_default_def(const char* out_dir);
/// "ppo-thesis", "ppo", "gail", "clone"
const char* om_study_learner_name(OmStudyLearner learner);
/// @return OM_OK; OM_INVALID (the message names the field); OM_CANCELLED (the same call continues); OM_NO_MEMORY; OM_IO
OmStatus om_study_learning_run(const OmStudyLearningDef* def, const OmProgress* progress,
                               OmStudyLearningSummary* summary);

#endif
