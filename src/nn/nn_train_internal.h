// nn_train_internal.h: what the parts of training share.
#ifndef OMENTUM_NN_TRAIN_INTERNAL_H
#define OMENTUM_NN_TRAIN_INTERNAL_H

#include "omentum/nn_train.h"

OmStatus om__schedule_check(const OmSchedule* schedule);
OmStatus om__optim_check(const OmOptimDef* def);
OmStatus om__loss_check(const OmLoss* loss, int nsample, OmNetShape shape, double* weight_sum);

/// Everything of an optimiser that changes, for checkpoints.
typedef struct OmOptimState {
    int64_t* step;
    float *m, *v;  // (parameters)
    float* mean;   // averaged weights, or null
} OmOptimState;
OmOptimState om__optim_state(OmOptim* optim);

/// Everything of a training that changes: what a checkpoint holds.
typedef struct OmTrainState {
    float* param;  // the weights                                  (parameters), the caller's
    float* best;   // those to be kept, once best_epoch > 0         (parameters)
    OmOptim* optim;
    OmTrainEpoch* row;  // ended epochs                                 (nrow of def->nepoch)
    int nrow;
    int64_t nbatch_done;        // of the epoch under way, which is nrow
    double loss_sum, norm_sum;  // over them
    double rate;                // of the last step
    double seconds;             // until the last checkpoint
    int best_epoch, nworse;     // from 1; validations since
    double best_value;
    bool is_ended, is_early;
} OmTrainState;

/// Write `dir`/checkpoint.safetensors and `dir`/metrics.csv.
OmStatus om__train_save(const OmTrainDef* def, const OmTrainState* state);
OmStatus om__train_save_metrics(const OmTrainDef* def, const OmTrainState* state);
/// Read the checkpoint if there is one; *is_found says so. OM_INVALID for that of another training.
OmStatus om__train_load(const OmTrainDef* def, OmTrainState* state, bool* is_found);

#endif
