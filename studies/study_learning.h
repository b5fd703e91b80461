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

// Settings of the task and of the methods are constants of study_learning.c.
typedef struct OmStudyLearningDef {  // made by om_study_learning_default_def
    const char* out_dir;             // borrowed
    const char* task;                // default "retract"
    const OmRlSetting* setting;      // of the task; default none (nsetting)
    int nsetting;
    // train in the task of the evaluation, without drawn bodies; default false. varied_nstep is then 0
    bool is_same_task;
    bool has[OM_NLEARNER];  // default all
    int nseed;              // 1 to 9; seeds 1, 2, ..; default 3
    int64_t nstep;          // of a training of PPO, default 262,144
    int64_t varied_nstep;   // of the second part of PPO with reward (b); default 327,680; 0: none
    int64_t gail_nstep;     // of GAIL: default 32,768
    bool has_reality;       // evaluate with world=reality too; default true
    int nworker;            // default 0: one a processor
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
OmStatus om_study_learning_run(const OmStudyLearningDef* def, const OmProgress* progress,
                               OmStudyLearningSummary* summary);

#endif
