// nn_internal.h: shared by the files of room nn.
//
//   nn_net.c     the description: layers, shapes, the table of parameters
//   nn_unet.c    the U-Net of the thesis, written in layers
//   nn_compile.c a network compiled for one batch: fusion, layouts, kernels, memory
//   nn_run.c     upload of parameters, forward, backward
//   nn_plan.c    offsets of pieces of memory with limited lives
//   nn_dnnl.c    one oneDNN primitive with its memories; the only file that uses oneDNN
//   nn_blocks.c  loops over tensors that oneDNN lacks or does more slowly: concatenation, masks, dropout
//   nn_winograd.c  transforms around a cheaper 3x3x3 convolution
//   nn_norm.c    batch and group normalisation
#ifndef OMENTUM_NN_INTERNAL_H
#define OMENTUM_NN_INTERNAL_H

#include "omentum/nn.h"

struct OmNet {
    OmLayer* layer;
    int nlayer, layer_cap;
    OmNetParameter* param;
    int nparam, param_cap;
    int output;
    bool is_finished;
    OmStatus status;  // of the first om_net_add_* that failed
    char error[512];  // its message
};

static inline int64_t om__net_cells(OmNetShape s) { return (int64_t)s.d * s.h * s.w; }
static inline int64_t om__net_values(OmNetShape s) { return s.c * om__net_cells(s); }

// ---- tensors -----------------------------------------------------------------------------------------

// Values (sample n, channel c, cell s) in blocks of channels, at ((n nblock + c / B) ncell + s) B + c % B with
// nblock = ceil(c / B). B = 1 is NCDHW, B = c is NDHWC, B = 16 is oneDNN's nCdhw16c; the channels
// that fill up the last block are zero.
typedef struct OmBlocks {
    int n;  // samples
    OmNetShape shape;
    int block;     // B
    bool is_last;  // channels last: B = c; oneDNN tells it from blocks of c
    OmNetType type;
    void* data;
} OmBlocks;

static inline int om__blocks_count(const OmBlocks* t) {
    return (t->shape.c + t->block - 1) / t->block;
}
/// Number of values of one sample, unused channels of the last block included.
static inline int64_t om__blocks_stride(const OmBlocks* t) {
    return (int64_t)om__blocks_count(t) * t->block * om__net_cells(t->shape);
}
static inline size_t om__type_size(OmNetType type) { return type == OM_F32 ? 4 : 2; }
static inline size_t om__blocks_bytes(const OmBlocks* t) {
    return (size_t)t->n * (size_t)om__blocks_stride(t) * om__type_size(t->type);
}

// Loops of nn_blocks.c. Results do not depend on the number of workers.
void om__blocks_from_plain(int nworker, const float* plain, const OmBlocks* t);
void om__blocks_to_plain(int nworker, const OmBlocks* t, float* plain);
/// sum += x, of equal layouts.
void om__blocks_add(int nworker, const OmBlocks* x, const OmBlocks* sum);
/// Channels [0, num) of `from` beginning at from_c into those of `to` beginning at to_c.
void om__blocks_copy_channels(int nworker, const OmBlocks* from, int from_c, const OmBlocks* to,
                              int to_c, int num);
/// Channels (k, c) of `from`, where k is a cell of a window of `kernel` cells, to the cells of that window
/// in `to`. Whole blocks of channels: `to` is channels last, or its channels fill its blocks.
void om__blocks_unfold(int nworker, const OmBlocks* from, const int kernel[3], const OmBlocks* to);
/// y = mask * x; may be the same tensor.
void om__blocks_mask(int nworker, const OmBlocks* x, const float* mask, const OmBlocks* y);
/// y = x where it is kept, by 1 / (1 - rate), else 0; the same choice whenever seed and first are the same.
/// `first` is the number of the first sample. Not the same tensor.
void om__blocks_dropout(int nworker, const OmBlocks* x, float rate, uint64_t seed, int64_t first,
                        const OmBlocks* y);

/// `num` values of a tensor from `at` as float: in place, or converted into `buffer`.
const float* om__blocks_read(const OmBlocks* t, int64_t at, int num, float* buffer);
/// Where the caller puts float values for om__blocks_write, which stores them: in place, or `buffer`.
float* om__blocks_place(const OmBlocks* t, int64_t at, float* buffer);
void om__blocks_write(const OmBlocks* t, int64_t at, int num, const float* value);

// ---- norms -------------------------------------------------------------------------------------------

// y = a x + b with a, b for each (sample, channel); one set of statistics a (sample, group), or a channel.
typedef struct OmNorm {
    int n, c, ngroup;
    bool is_batch;       // statistics over samples, one group a channel
    float epsilon;       //
    double *mean, *var;  // (n x ngroup), or (c); of the last forward pass
    double* part;        // (n x c x nchunk x 2) sums over pieces of a channel
    float* coef;         // (n x c x 3): y = coef0 x + coef1; dx = coef0 dy + coef1 x + coef2
    int nchunk;          // pieces of a channel
} OmNorm;

OmStatus om__norm_create(const OmBlocks* x, const OmLayer* layer, OmNorm* norm);
void om__norm_done(OmNorm* norm);
size_t om__norm_memory(const OmNorm* norm);
/// Mean and variance of x.
void om__norm_measure(int nworker, OmNorm* norm, const OmBlocks* x);
/// y = (x - mean) / sqrt(var + epsilon) weight + bias; y may be x.
void om__norm_apply(int nworker, OmNorm* norm, const OmBlocks* x, const float* weight,
                    const float* bias, const OmBlocks* y);
/// Derivatives by x (null: not wanted), weight and bias after a forward pass that measured x; dx may be dy.
void om__norm_backward(int nworker, OmNorm* norm, const OmBlocks* x, const OmBlocks* dy,
                       const float* weight, const OmBlocks* dx, float* dweight, float* dbias);

// ---- oneDNN ---------------------------------------------------------------------------------------------

typedef struct OmEngine OmEngine;  // where kernels run, and with how many threads

OmStatus om__engine_create(int nworker, OmEngine** engine);
void om__engine_destroy(OmEngine* engine);
/// Between begin and end oneDNN uses the engine's threads. OM_INVALID inside a parallel region.
OmStatus om__engine_begin(OmEngine* engine);
void om__engine_end(OmEngine* engine);
/// The channel block size of this processor's kernels: 16, 8, or 0 for none (then channels last).
int om__engine_block(OmNetType type);
/// Does the processor multiply bfloat16 (AVX-512 BF16)?
bool om__engine_multiplies_bf16(void);

typedef enum OmPass { OM_PASS_FORWARD, OM_PASS_DATA, OM_PASS_WEIGHTS } OmPass;

typedef enum OmSlot {  // an argument of a kernel
    OM_SLOT_SRC,
    OM_SLOT_DST,
    OM_SLOT_WEIGHTS,
    OM_SLOT_BIAS,
    OM_SLOT_DIFF_SRC,
    OM_SLOT_DIFF_DST,
    OM_SLOT_DIFF_WEIGHTS,
    OM_SLOT_DIFF_BIAS,
    OM_SLOT_WORKSPACE,
    OM_SLOT_SCRATCH,
    OM_SLOT_COUNT
} OmSlot;

typedef struct OmKernel OmKernel;  // one primitive and its memories

typedef struct OmKernelDef {
    const OmLayer* layer;       // kind, kernel, stride, padding
    OmPass pass;                //
    bool is_training;           // of a forward pass: leave what backward wants in the workspace
    const OmBlocks *src, *dst;  // layouts; data are bound later
    int ngroup;                 // of a convolution; 0 is one
    OmActivation activation;    // applied to the output of a convolution or dense layer
    float slope;
} OmKernelDef;

/// Convolutions, dense, pooling, up-sampling and activation. A backward activation reads DST, the activated.
OmStatus om__kernel_create(OmEngine* engine, const OmKernelDef* def, OmKernel** kernel);
/// From a slot of `owner` to the plain parameters of its layer, or back; float outside. Slots SRC and DST.
OmStatus om__kernel_create_reorder(OmEngine* engine, const OmKernel* owner, OmSlot slot,
                                   bool is_to_plain, OmKernel** kernel);
void om__kernel_destroy(OmKernel* kernel);
/// Bytes behind an argument, 0 where the kernel has none.
size_t om__kernel_bytes(const OmKernel* kernel, OmSlot slot);
/// Do both keep this argument in the same layout?
bool om__kernel_is_same(const OmKernel* a, OmSlot a_slot, const OmKernel* b, OmSlot b_slot);
OmStatus om__kernel_bind(OmKernel* kernel, OmSlot slot, const void* data);
OmStatus om__kernel_run(OmKernel* kernel);
/// What oneDNN calls the implementation; "ref..." is its slow one.
const char* om__kernel_name(const OmKernel* kernel);

// ---- Winograd's convolution ------------------------------------------------------------------------------

#define OM_WINOGRAD_BLOCK 16   // channels
#define OM_WINOGRAD_POINTS 36  // of a transformed tile

typedef struct OmDetour {  // the transformed values of one sample, before and after the convolution
    bool is_on;
    OmBlocks in, out;
    int in_piece, out_piece;
} OmDetour;

/// The shape of transformed values of that shape.
OmNetShape om__winograd_shape(OmNetShape shape);
/// (out, in, 3, 3, 3) to (36, out, in, 3); or to (36, in, out, 3) with the taps turned round, which is what the
/// gradient goes through.
void om__winograd_weights(int nworker, const float* plain, int nout, int nin, bool is_back,
                          float* to);
/// x through the transforms and the kernel between w->in and w->out, sample by sample; with bias (or null), and
/// where is_bent with `slope` for negative values.
OmStatus om__winograd_run(int nworker, const OmDetour* w, OmKernel* kernel, const OmBlocks* x,
                          const float* bias, bool is_bent, float slope, const OmBlocks* y);

/// The gradients by weight (out, in, 3, 3, 3) and bias (out, or null), of x and the gradient dy of the result.
/// `weights` leaves the kernel's own, which `store` brings into staging (36, out, in, 3).
/// @param slice  room for a block's channels x blocks x depth
OmStatus om__winograd_gradient(int nworker, const OmDetour* w, OmKernel* weights, OmKernel* store,
                               const OmBlocks* x, const OmBlocks* dy, float* slice, float* staging,
                               float* dweight, float* dbias);

// ---- memory -----------------------------------------------------------------------------------------------

typedef struct OmPiece {  // memory needed from step `begin` to step `end`, both included
    size_t bytes;
    int begin, end;
    size_t at;  // its offset: multiple of 64
} OmPiece;

/// Choose offsets such that pieces needed at the same step do not overlap. Total bytes in *size.
OmStatus om__plan_pieces(int num, OmPiece* piece, size_t* size);

// ---- a compiled network -------------------------------------------------------------------------------------

typedef struct OmOp {  // one layer of the compiled network, with a fused activation if there is one
    const OmLayer* layer;
    OmActivation activation;
    float slope;
    int out;                     // layer whose output it writes: its own, or the fused activation
    int nin;                     //
    int in[OM_LAYER_MAX_INPUT];  // layers whose outputs it reads
    // concatenation: the input is written directly into the output
    bool is_placed[OM_LAYER_MAX_INPUT];
    OmKernel *forward, *data, *weights;  // kernels of the passes
    OmKernel* activate_back;             // gradient through the fused activation, in place
    OmKernel *load, *load_back, *store;  // plain weights into forward and data; gradient to plain
    bool is_extra[OM_LAYER_MAX_INPUT];   // its gradient is added to an existing one
    OmBlocks extra[OM_LAYER_MAX_INPUT];  // and is first written here
    int extra_piece[OM_LAYER_MAX_INPUT];
    int workspace_piece, grad_piece, bias_piece;  // or -1
    size_t weight_at, weight_back_at;             // bytes in the parameters' memory
    // A transposed convolution whose windows do not overlap is computed as one of 1 x 1 x 1 with all cells of
    // the window as channels, which are then copied to their cells: several times faster than oneDNN's own.
    bool is_unfolded;
    OmDetour winograd, winograd_back;  // forward and data passes by Winograd's convolution
    OmDetour winograd_grad;  // weights: transformed values, transformed gradient of the result
    OmDetour turned;         // weights pass in channels last, where blocks have no fast kernel
    int slice_piece;         // sums of that gradient over slices, for the bias
    OmBlocks folded;         // result of the 1 x 1 x 1 convolution
    int folded_piece;        //
    size_t folded_bias_at;   // its bias, one copy a cell of the window
    OmNorm norm;
} OmOp;

struct OmNetRun {
    const OmNet* net;
    OmNetRunDef def;
    int nworker;
    OmEngine* engine;
    int nop;
    OmOp* op;
    // layer whose tensor holds the output of a layer: its own, unless layers are fused or a layer
    // does nothing
    int* held_by;
    OmBlocks* value;    // (nlayer)
    OmBlocks* grad;     // (nlayer), training
    bool* needs_grad;   // (nlayer)
    int* placed_in;     // (nlayer) the concatenation whose tensor its output is part of, or -1
    size_t* placed_at;  // bytes
    int *value_piece, *grad_piece;  // (nlayer) or -1
    OmPiece* piece;
    int npiece, piece_cap;
    int scratch_piece;
    char *memory, *weights;  // planned memory; parameters in the kernels' layouts
    size_t memory_size, weights_size;
    size_t staging_at;  // in weights: room to reorder the largest unfolded ones
    float* small;       // parameters that kernels read in plain layout: biases and norms
    int64_t* small_at;  // (nparam) or -1
    size_t small_size;
    uint64_t step;
    int64_t first_sample;
    bool has_parameters, has_forward;
};

/// Compile everything but the parameters; on failure the caller destroys the partial run.
OmStatus om__net_compile(OmNetRun* run);

#endif
