// nn_train_internal.h: shared by the files of training.
#ifndef OMENTUM_NN_TRAIN_INTERNAL_H
#define OMENTUM_NN_TRAIN_INTERNAL_H

#include "omentum/nn_train.h"

OmStatus om__schedule_check(const OmSchedule* schedule);
OmStatus om__optim_check(const OmOptimDef* def);
OmStatus om__loss_check(const OmLoss* loss, int nsample, OmNetShape shape, double* weight_sum);

/// The complete state of an optimiser, for checkpoints.
typedef struct OmOptimState {
    int64_t* step;
    float *m, *v;  // (parameters)
    float* mean;   // averaged weights, or null
} OmOptimState;
OmOptimState om__optim_state(OmOptim* optim);

/// The complete state of a training: the contents of a checkpoint.
typedef struct OmTrainState {
    float* param;  // the weights                                  (parameters), the caller's
    float* best;   // best weights so far, if best_epoch > 0         (parameters)
    OmOptim* optim;
    OmTrainEpoch* row;  // finished epochs                                 (nrow of def->nepoch)
    int nrow;
    int64_t nbatch_done;        // of the current epoch, which is nrow
    double loss_sum, norm_sum;  // sums over these batches
    double rate;                // of the last step
    double seconds;             // until the last checkpoint
    int best_epoch, nworse;     // from 1; number of validations since
    double best_value;
    bool is_ended, is_early;
} OmTrainState;

/// Write `dir`/checkpoint.safetensors and `dir`/metrics.csv.
OmStatus om__train_save(const OmTrainDef* def, const OmTrainState* state);
OmStatus om__train_save_metrics(const OmTrainDef* def, const OmTrainState* state);
/// Read the checkpoint if there is one; *is_found is then true. OM_INVALID if it belongs to another training.
OmStatus om__train_load(const OmTrainDef* def, OmTrainState* state, bool* is_found);

#endif
