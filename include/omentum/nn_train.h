/// omentum/nn_train.h: training of networks (floor 2): losses, Adam, schedules, and the loop that uses them.
///
/// The caller fills batches. The loop shuffles the samples by (seed, epoch), descends, validates, keeps the best
/// weights, stops without improvement, and writes a table of metrics and a checkpoint. The same call resumes from the
/// checkpoint and ends with the same bytes as an uninterrupted training.
///
///     OmTrainDef def = om_train_default_def(net, fill, data);
///     def.ntrain = 900;
///     def.nvalid = 100;
///     def.dir = "out/training";                 // checkpoint.safetensors, metrics.csv
///     om_net_init_parameters(net, 1, param);
///     OmTrainResult result;
///     if (om_train_run(&def, NULL, param, &result) < 0) puts(om_error_message());
///     om_train_result_done(&result);            // param holds the best weights
#ifndef OMENTUM_NN_TRAIN_H
#define OMENTUM_NN_TRAIN_H

#include "omentum/base.h"
#include "omentum/nn.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- losses -----------------------------------------------------------------------------------------

/// Of outputs y and targets t of a batch. w is the weight of a cell, 1 without weights; means over cells are
/// weighted means. Dice and BCE take targets in [0, 1] and p = sigmoid(y): the network ends without activation.
typedef enum OmLossKind {
    OM_LOSS_MSE,  // mean over samples, channels and cells of (y - t)^2
    OM_LOSS_NORM,  // mean over samples and cells of |y - t|, the length across channels: a mean norm error
    OM_LOSS_DICE,  // 1 - (2 sum w p t + 1) / (sum w p + sum w t + 1), mean over samples and channels (eq. 4.3)
    OM_LOSS_SLOPE,  // mean over samples and cells of |grad (y - t)|: forward differences across channels and axes,
                    // between cells of weight; a Sobolev loss beside OM_LOSS_NORM
    OM_LOSS_BCE  // mean over samples, channels and cells of -t log p - (1 - t) log(1 - p) (eq. 4.4)
} OmLossKind;
#define OM_LOSS_NKIND ((int)OM_LOSS_BCE + 1)
#define OM_LOSS_MAX_TERM 8

typedef struct OmLoss {  // the sum of its terms
    int nterm;
    struct {
        OmLossKind kind;
        double scale;  // > 0
    } term[OM_LOSS_MAX_TERM];
    const float* weight;  // of each cell, >= 0 and not all 0 (d h w), or null; borrowed
    // Weights of each sample's own cells, >= 0, in place of `weight`; null: none. Means over cells are those of each
    // sample; a sample whose weights are all 0 adds nothing to them. (nsample x d h w), borrowed.
    const float* cell_weight;
    // Weight of each sample in means over samples, >= 0; null: all alike. Borrowed.
    const float* sample_weight;
} OmLoss;

/// One term of scale 1.
OM_API OmLoss om_loss(OmLossKind kind);

/// @param shape  of one sample of y
/// @param y      nsample x shape
/// @param t      nsample x shape
/// @param value  the loss
/// @param dy     its derivative by each y; null if not wanted
/// @param nworker  0: one per processor; the same bytes for any
/// @return OM_OK; OM_INVALID (the message names the field of `loss`); OM_NO_MEMORY
OM_API OmStatus om_loss_eval(const OmLoss* loss, int nsample, OmNetShape shape, const float* y,
                             const float* t, int nworker, double* value, float* dy);

// ---- schedules --------------------------------------------------------------------------------------

typedef enum OmScheduleKind {
    OM_SCHEDULE_CONSTANT,  // after the warm-up
    OM_SCHEDULE_COSINE,  // linear warm-up, then half a cosine (Loshchilov and Hutter 2017, without restarts)
    OM_SCHEDULE_ONE_CYCLE  // half a cosine up, half a cosine down (Smith and Topin 2018; PyTorch's OneCycleLR)
} OmScheduleKind;

typedef struct OmSchedule {  // of the learning rate
    OmScheduleKind kind;
    double peak;    // > 0
    double start;   // rate of the first step, as a share of peak
    double end;     // of the last step
    double warmup;  // share of the steps that go up, [0, 1)
} OmSchedule;

OM_API OmSchedule om_schedule_constant(double rate);
/// From nothing, and to nothing.
OM_API OmSchedule om_schedule_cosine(double peak, double warmup);
/// PyTorch's defaults: from peak / 25, the first 30 % up, to peak / 250,000.
OM_API OmSchedule om_schedule_one_cycle(double peak);
/// The rate of step `step` of 0 .. nstep - 1.
OM_API double om_schedule_rate(const OmSchedule* schedule, int64_t step, int64_t nstep);

// ---- optimisers -------------------------------------------------------------------------------------

typedef enum OmOptimKind {
    OM_OPTIM_ADAM,  // Kingma and Ba 2015; weight decay is added to the gradient
    OM_OPTIM_ADAMW  // Loshchilov and Hutter 2019: weight decay shrinks the weights themselves
} OmOptimKind;

typedef struct OmOptimDef {
    OmCookie cookie;
    OmOptimKind kind;     // default OM_OPTIM_ADAMW
    double beta1, beta2;  // decay of the moments a step, [0, 1), default 0.9, 0.999
    double epsilon;       // added to the root of the second moment, > 0, default 1e-8
    double weight_decay;  // of entries that are is_decayed, >= 0, default 0.01
    double clip_norm;     // gradients longer than this are shortened to it; 0 (default): never
    // Decay of the exponential moving average of the weights, per step, in [0, 1); 0 (default): no
    // average.
    double average;
    int nworker;  // 0 (default): one per processor; the same bytes for any
} OmOptimDef;
OM_API OmOptimDef om_optim_default_def(void);

/// Moments in float, one of each kind a parameter; the net is borrowed.
typedef struct OmOptim OmOptim;
/// Create an optimiser for the parameters of `net`.
/// @return OM_OK; OM_INVALID (the message names the field); OM_NO_MEMORY
OM_API OmStatus om_optim_create(const OmOptimDef* def, const OmNet* net, OmOptim** optim);
OM_API void om_optim_destroy(OmOptim* optim);
/// One step with this rate; running statistics are not touched.
/// @param norm  length of the gradient before clipping; may be null
/// @return OM_INVALID where the gradient is not finite: nothing was changed
OM_API OmStatus om_optim_step(OmOptim* optim, double rate, const float* grad, float* param,
                              double* norm);
/// The averaged weights (running statistics are those of `param`) into out; `param` itself without average.
/// The share kept grows with the steps, min(average, (1 + n) / (10 + n)), so that the start is forgotten.
OM_API void om_optim_get_average(const OmOptim* optim, const float* param, float* out);
/// Values that om_optim_save writes: the moments, and the averaged weights where there are any.
OM_API size_t om_optim_size(const OmOptim* optim);
/// Copy the state of the optimiser, for checkpoints of other loops than om_train_run.
OM_API void om_optim_save(const OmOptim* optim, int64_t* step, float* value);
/// Continue from a copy: later steps give the same bytes.
/// @return OM_OK; OM_INVALID (a negative step or a value that is not finite: nothing was changed)
OM_API OmStatus om_optim_restore(OmOptim* optim, int64_t step, const float* value);

// ---- training on several ranks --------------------------------------------------------------------------

/// Ranks that train one network: each takes its part of every batch, gradients are averaged. All make the same
/// calls with the same definition.
typedef struct OmTrainGroup {
    int rank, size;
    /// Replace each value by its mean over the ranks: the same bytes on all.
    OmStatus (*mean)(void* ctx, float* value, int64_t count);
    void* ctx;
} OmTrainGroup;

/// The processes started together by mpirun; starts MPI where the program has not. OM_UNAVAILABLE in a build
/// without OM_WITH_MPI.
/// @return OM_OK; OM_UNAVAILABLE (built without MPI); OM_NO_MEMORY; OM_IO (MPI failed)
OM_API OmStatus om_train_group_begin_mpi(OmTrainGroup* group);
/// One status for all ranks: every rank calls it where one of them alone may have failed, so that none waits for it.
/// Null group: returns `status`.
/// @return `status` if it is an error; OM_INVALID (another rank failed); OM_IO (MPI failed); OM_OK
OM_API OmStatus om_train_group_agree(const OmTrainGroup* group, OmStatus status);
/// Ends MPI where om_train_group_begin_mpi started it.
OM_API void om_train_group_end_mpi(OmTrainGroup* group);

// ---- the loop -------------------------------------------------------------------------------------------

typedef struct OmTrainBatch {
    bool is_validation;
    int epoch;              // from 0
    int count;              // samples wanted
    const int64_t* sample;  // which ones, of 0 .. ntrain - 1 or 0 .. nvalid - 1        (count)
    // Random stream of each sample in this epoch, for augmentation: om_rng_init(draw[i], ...)
    // (count)
    const uint64_t* draw;
    float* in;      // to fill: count x shape of the input
    float* target;  // to fill: count x shape of the output
    float* weight;  // of the samples in the loss, 1 unless changed (count)
    // Weights of the samples' cells in the loss, to fill: count x d h w of the output; null unless the definition
    // has_cell_weight.
    float* cell_weight;
} OmTrainBatch;
typedef OmStatus (*OmTrainFillFn)(void* ctx, const OmTrainBatch* batch);

typedef struct OmTrainEpoch {  // a row of metrics.csv
    int epoch;                 // from 1
    int64_t step;              // descents so far
    double train;              // mean loss over the epoch's batches
    double valid;              // metric over the validation samples; NaN where it was not measured
    double rate;               // of the last step
    double grad_norm;          // mean, before clipping
    double seconds;  // since the start, without the time between a stop and its resumption
} OmTrainEpoch;

typedef struct OmTrainDef {
    OmCookie cookie;
    const OmNet* net;    // finished; borrowed
    OmTrainFillFn fill;  // a failure ends the training
    void* ctx;           // of fill, metric and on_epoch
    int ntrain, nvalid;  // samples; ntrain >= batch x ranks, nvalid may be 0
    int batch;  // samples a step on each rank, default 4. The rest of an epoch that fills no batch waits
    int nepoch;       // default 100
    int valid_every;  // epochs between validations, default 1; the last one always has one
    int patience;     // stop after this many validations without a better one; 0 (default): never
    OmLoss loss;      // default OM_LOSS_MSE; cell_weight and sample_weight come from `fill`
    bool has_cell_weight;  // `fill` gives a weight for every cell of every sample; default false
    OmOptimDef optim;
    OmSchedule schedule;  // over all nepoch epochs; default one cycle to 1e-3
    OmNetType type;       // of the runs, default OM_F32
    int nworker;          // 0 (default): one per processor
    uint64_t seed;        // of order, draws and dropout, default 1
    /// What validation measures, the smaller the better: the sum over `count` samples, whose numbers are in
    /// `sample`; null: the loss.
    double (*metric)(void* ctx, const int64_t* sample, const float* out, const float* target,
                     int count);
    void (*on_epoch)(void* ctx,
                     const OmTrainEpoch* row);  // after each epoch, on rank 0; may be null
    const char* dir;  // of metrics.csv and checkpoint.safetensors, made if missing; null: no files
    double checkpoint_period;   // s between checkpoints, default 60; 0: after every step
    uint64_t data_hash;         // a checkpoint of other data is refused; default 0
    const OmTrainGroup* group;  // null (default): alone
} OmTrainDef;
OM_API OmTrainDef om_train_default_def(const OmNet* net, OmTrainFillFn fill, void* ctx);

typedef struct OmTrainResult {
    OmTrainEpoch* epoch;  // (nepoch)
    int nepoch;
    int64_t nstep;
    int best_epoch;     // whose weights were kept, from 1
    double best_value;  // its validation; NaN without validation samples
    double seconds;
    bool is_early;    // patience ran out
    bool is_resumed;  // from a checkpoint
} OmTrainResult;

/// Train. With a checkpoint in `dir` it continues there; one of other settings, data or network is
/// refused.
/// @param param  in: weights to start from; out: the best ones (averaged, with optim.average), of validation or
///               else of the last step
/// @return OM_CANCELLED when progress asks to stop: the checkpoint is written; OM_INVALID also when the loss is no
///         longer finite
OM_API OmStatus om_train_run(const OmTrainDef* def, const OmProgress* progress, float* param,
                             OmTrainResult* result);
OM_API void om_train_result_done(OmTrainResult* result);

#ifdef __cplusplus
}
#endif
#endif
