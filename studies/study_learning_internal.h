// study_learning_internal.h: shared by the files of the study of learning.
#ifndef OM_STUDY_LEARNING_INTERNAL_H
#define OM_STUDY_LEARNING_INTERNAL_H

#include "omentum/rl_demo.h"
#include "studies/study_learning.h"

enum { LEARNING_MAX_SEED = 9, LEARNING_WORLD = 2 };  // worlds: of the training, "reality"

typedef struct LearningRun {  // a learner from a seed
    bool is_there;
    int nrow;
    double *step, *ret;             // the curve (nrow)
    double* score[LEARNING_WORLD];  // of each start (nstart); null: not evaluated
    double seconds;
} LearningRun;

typedef struct Learning {
    const OmStudyLearningDef* def;
    int nstart;
    const char* score_name;
    LearningRun run[OM_NLEARNER][LEARNING_MAX_SEED];
} Learning;

// Mean over starts begin to end - 1 of a run in a world.
double om__learning_mean(const Learning* s, const LearningRun* run, int world, int begin, int end);
OmStatus om__learning_report(const Learning* s, const OmStudyLearningSummary* r);

#endif
