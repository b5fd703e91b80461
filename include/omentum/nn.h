/// omentum/nn.h: neural networks on oneDNN (floor 2).
///
/// A network is a constant description: layers appended one by one, each named by its index, which is also
/// the name of its output. Tensors are batch x channels x depth x height x width (NCDHW, width fastest); those
/// of dense layers have depth = height = width = 1. Parameters are one flat array of float with a table of
/// names and shapes, laid out as PyTorch does, so that files and optimisers need not know about layers.
/// A run compiles a network for one batch size, type and worker count, plans its memory once, and keeps
/// values between layers in the layout oneDNN likes best. Values outside are plain float.
///
///     OmNet* net; OmNetRun* run;
///     om_net_create(&net);
///     int x = om_net_add_input(net, "input", (OmNetShape){3, 32, 24, 16});
///     x = om_net_add_conv(net, "first", x, om_net_conv(16, 3));
///     x = om_net_add_activation(net, x, OM_RELU, 0);
///     x = om_net_add_conv(net, "head", x, om_net_conv(3, 1));
///     if (om_net_finish(net, x) < 0) puts(om_error_message());
///     float* param = om_alloc(om_net_parameter_size(net), sizeof *param);
///     om_net_init_parameters(net, 1, param);
///     OmNetRunDef def = om_net_run_default_def(1);
///     om_net_run_create(net, &def, &run);
///     om_net_run_set_parameters(run, param);
///     om_net_run_forward(run, in, out);
///
/// A net may be shared between threads once finished; a run belongs to one thread at a time.
#ifndef OMENTUM_NN_H
#define OMENTUM_NN_H

#include "omentum/base.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- the description --------------------------------------------------------------------------------

#define OM_NET_NAME 64  // bytes of a name with its end

typedef struct OmNet OmNet;

typedef struct OmNetShape {  // of one sample
    int c, d, h, w;          // channels, depth, height, width (fastest), each > 0
} OmNetShape;

typedef enum OmActivation { OM_IDENTITY, OM_RELU, OM_LEAKY_RELU, OM_TANH, OM_SIGMOID } OmActivation;

typedef enum OmLayerKind {
    OM_LAYER_INPUT,
    OM_LAYER_CONV,     // weight (out, in, kd, kh, kw), bias (out)
    OM_LAYER_CONV_UP,  // transposed convolution: weight (in, out, kd, kh, kw), bias (out)
    OM_LAYER_UPSAMPLE,  // trilinear by whole factors (scale), cell centres kept (align_corners = false)
    OM_LAYER_MAX_POOL,    // windows `kernel`, steps `stride`, padded with minus infinity
    OM_LAYER_DENSE,       // weight (out, c d h w of the input), bias (out)
    OM_LAYER_ACTIVATION,  //
    OM_LAYER_DROPOUT,  // training: zero with probability `rate`, else 1 / (1 - rate) times; else nothing
    OM_LAYER_BATCH_NORM,  // weight (c), bias (c), running_mean (c), running_var (c)
    OM_LAYER_GROUP_NORM,  // weight (c), bias (c)
    OM_LAYER_CONCAT,      // channels of the inputs, one after the other
    OM_LAYER_MASK         // every channel times a constant field (d, h, w)
} OmLayerKind;
#define OM_LAYER_NKIND ((int)OM_LAYER_MASK + 1)

#define OM_LAYER_MAX_INPUT 4

typedef struct OmLayer {  // fields a kind does not use are zero
    OmLayerKind kind;
    char name[OM_NET_NAME];
    int ninput;
    int input[OM_LAYER_MAX_INPUT];  // layers whose outputs are read, each before this one
    OmNetShape shape;               // of the output
    int kernel[3], stride[3];       // d, h, w
    int padding[3];                 // zeros before and behind
    int scale[3];                   // upsample
    OmActivation activation;
    float slope;         // of leaky ReLU for x < 0
    float rate;          // of dropout
    int ngroup;          // of group norm
    float epsilon;       // of norms, added to the variance
    float momentum;      // of batch norm: share of the new batch in the running statistics
    const float* mask;   // (d h w), owned by the net
    int weight, bias;    // indices of the table of parameters, or -1
    int mean, variance;  // running statistics of batch norm, or -1
} OmLayer;

/// An empty network.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_net_create(OmNet** net);
OM_API void om_net_destroy(OmNet* net);

// Each om_net_add_* appends one layer and returns its index. After a failure, also of an earlier layer, they
// return -1 and do nothing; om_net_finish reports the first failure, naming the layer. `name` is the prefix
// of its parameters ("enc0.conv1" gives "enc0.conv1.weight"): unique, at most 50 of A-Z a-z 0-9 _ . - ;
// layers without one are called by kind and index ("concat_7").

/// The values given to om_net_run_forward; the first layer, and the only one of its kind.
OM_API int om_net_add_input(OmNet* net, const char* name, OmNetShape shape);

typedef struct OmNetConv {
    int channels;  // of the output
    int kernel[3], stride[3], padding[3];
    bool has_bias;
} OmNetConv;
/// Cubic kernel, stride 1, padding (kernel - 1) / 2: the shape is kept by odd kernels. With bias.
OM_API OmNetConv om_net_conv(int channels, int kernel);
/// Cubic kernel with its own stride and padding. With bias.
OM_API OmNetConv om_net_conv_strided(int channels, int kernel, int stride, int padding);

/// Output extent (in + 2 padding - kernel) / stride + 1, rounded down.
OM_API int om_net_add_conv(OmNet* net, const char* name, int x, OmNetConv conv);
/// Output extent (in - 1) stride + kernel - 2 padding.
OM_API int om_net_add_conv_up(OmNet* net, const char* name, int x, OmNetConv conv);
OM_API int om_net_add_upsample(OmNet* net, int x, const int scale[3]);
/// Padding at most half the kernel.
OM_API int om_net_add_max_pool(OmNet* net, int x, const int kernel[3], const int stride[3],
                               const int padding[3]);
/// Reads its input as one row in the order channel, depth, height, width.
OM_API int om_net_add_dense(OmNet* net, const char* name, int x, int nout);
/// `slope` of leaky ReLU in [0, 1); ignored by the others.
OM_API int om_net_add_activation(OmNet* net, int x, OmActivation activation, float slope);
/// rate in [0, 1)
OM_API int om_net_add_dropout(OmNet* net, int x, float rate);
/// epsilon 1e-5, momentum 0.1
OM_API int om_net_add_batch_norm(OmNet* net, const char* name, int x);
/// epsilon 1e-5; ngroup divides the channels
OM_API int om_net_add_group_norm(OmNet* net, const char* name, int x, int ngroup);
/// 2 to OM_LAYER_MAX_INPUT inputs with the same depth, height and width.
OM_API int om_net_add_concat(OmNet* net, int ninput, const int* x);
/// `mask` has d h w values of the input's shape; copied.
OM_API int om_net_add_mask(OmNet* net, int x, const float* mask);

/// Close the description: `output` is the layer whose values om_net_run_forward returns. Layers it does not
/// depend on are refused. OM_OK, or the first failure of any om_net_add_*.
/// @return OM_OK; OM_INVALID (the first error of the layers added, or an output that does not exist);
///        OM_NO_MEMORY
OM_API OmStatus om_net_finish(OmNet* net, int output);

typedef struct OmUnetDef {
    OmCookie cookie;
    OmNetShape in;     // channels and grid; each extent a multiple of 4, or 2 for one level
    int out_channels;  //
    int nlevel;        // halvings of the grid, of axes that are even by then; 1 to 6, default 3
    int base_channels;  // of the first level, doubled by each; fast when a multiple of 16, default 16
    OmActivation activation;  // default OM_RELU
    float slope;              // of leaky ReLU, default 0.01
    OmLayerKind norm;         // between convolution and activation: OM_LAYER_BATCH_NORM,
                              // OM_LAYER_GROUP_NORM, or 0 for none (default)
    int ngroup;               // of group norm, default 8
    float dropout;            // rate at the bottom, default 0
    const float* mask;        // (d h w) multiplied to the output, or null (default)
} OmUnetDef;
OM_API OmUnetDef om_unet_default_def(OmNetShape in, int out_channels);
/// The U-Net of Fig. 3.7b: per level two 3x3x3 convolutions and a 2x2x2 max pooling, two at the bottom; back up
/// by 2x2x2 transposed convolutions, the skipped level's values before the risen ones, two convolutions; a
/// 1x1x1 convolution at the end. Layers are enc0.conv1 ... bottom.conv1 ... dec0.up, dec0.conv1 ... head.
/// @return OM_OK; OM_INVALID (the message names the field); OM_NO_MEMORY
OM_API OmStatus om_unet_create(const OmUnetDef* def, OmNet** net);

// ---- looking at it --------------------------------------------------------------------------------------

OM_API int om_net_layer_count(const OmNet* net);
/// Layer i of the description, in an order in which each comes after what it reads. Lives as long as the net.
OM_API const OmLayer* om_net_layer(const OmNet* net, int i);
/// The layer given to om_net_finish.
OM_API int om_net_output(const OmNet* net);
/// Values of one sample of the input and the output.
OM_API int64_t om_net_in_size(const OmNet* net);
OM_API int64_t om_net_out_size(const OmNet* net);
OM_API const char* om_layer_kind_name(OmLayerKind kind);  // "conv", "max_pool", ...
OM_API const char* om_activation_name(OmActivation a);    // "relu", ...
/// Equal for networks of the same layers, shapes, names and masks, on any machine.
OM_API uint64_t om_net_hash(const OmNet* net);

typedef struct OmNetParameter {
    char name[OM_NET_NAME];  // "enc0.conv1.weight"
    int ndim;                // 1 to 5
    int dim[5];              // as in PyTorch; the last is fastest
    int64_t adr, num;        // its values are param[adr .. adr + num)
    int layer;
    bool is_trained;  // false for running statistics: no gradient, nothing for an optimiser to do
    bool is_decayed;  // weights of convolutions and dense layers: where weight decay belongs
} OmNetParameter;

OM_API int om_net_parameter_count(const OmNet* net);
OM_API const OmNetParameter* om_net_parameter(const OmNet* net, int i);
/// The index of a name, -1 if there is none.
OM_API int om_net_find_parameter(const OmNet* net, const char* name);
/// Values in the flat array: the sum of num; entries follow each other without gaps.
OM_API size_t om_net_parameter_size(const OmNet* net);
/// He's uniform initialisation for the activation that follows (He et al. 2015), biases 0, norms 1 and 0; each
/// entry a function of (seed, its index).
OM_API void om_net_init_parameters(const OmNet* net, uint64_t seed, float* param);

// ---- running it -----------------------------------------------------------------------------------------

typedef struct OmNetRun OmNetRun;

typedef enum OmNetType {
    OM_F32,
    OM_BF16  // values between layers and their gradients in bfloat16, sums and parameters in float
} OmNetType;

typedef enum OmNetLayout { OM_LAYOUT_AUTO, OM_LAYOUT_BLOCKED, OM_LAYOUT_CHANNELS_LAST } OmNetLayout;

typedef struct OmNetRunDef {
    OmCookie cookie;
    int batch;       // samples a call, > 0
    OmNetType type;  // default OM_F32
    // Keep what the backward pass needs; dropout is active, batch norm uses the batch. Default
    // false.
    bool is_training;
    bool has_input_gradient;  // backward can give the gradient of the input; default false
    int nworker;  // 0 (default): one per processor. oneDNN promises the same bytes at a fixed count
    uint64_t seed;       // of dropout, default 1
    OmNetLayout layout;  // of values between layers; the default is the faster one
} OmNetRunDef;
OM_API OmNetRunDef om_net_run_default_def(int batch);
/// The type in which a forward pass is fastest on this processor: OM_BF16 on AMD's processors that multiply it, else
/// OM_F32 (measured, doc/notes/nn.md).
OM_API OmNetType om_net_fast_type(void);

/// Compile: generate code, plan and allocate memory. The calls below allocate nothing.
/// @param net  finished; borrowed until the run is destroyed
/// @return OM_OK, OM_INVALID, OM_NO_MEMORY, OM_UNAVAILABLE (bf16 on a processor without it)
OM_API OmStatus om_net_run_create(const OmNet* net, const OmNetRunDef* def, OmNetRun** run);
OM_API void om_net_run_destroy(OmNetRun* run);
/// Bytes of everything it holds.
OM_API size_t om_net_run_memory(const OmNetRun* run);

/// Copy the parameters into the layouts of the layers: before the first forward pass, and after each change.
/// @return OM_OK; OM_NO_MEMORY; OM_UNAVAILABLE (the library of layers refused)
OM_API OmStatus om_net_run_set_parameters(OmNetRun* run, const float* param);

/// Random numbers of dropout are a function of (seed, step, first_sample + index in the batch) for any batch size, so
/// parts of a batch on several machines get the same numbers as on one machine. Default 0, 0.
OM_API void om_net_run_set_step(OmNetRun* run, uint64_t step, int64_t first_sample);

/// @param in   batch x shape of the input
/// @param out  batch x shape of the output
/// With more than one worker not from within a parallel loop: OM_INVALID.
/// @return OM_OK; OM_INVALID (no parameters are set); OM_UNAVAILABLE (the library of layers failed)
OM_API OmStatus om_net_run_forward(OmNetRun* run, const float* in, float* out);

/// Gradients of a sum over the last forward of a training run.
/// @param dout  derivative by each output
/// @param grad  om_net_parameter_size values, overwritten; 0 for running statistics
/// @param din   derivative by each input; null unless the run has_input_gradient, may be null then
/// @return OM_OK; OM_INVALID (not made for training, or no forward pass before); OM_UNAVAILABLE (the library of
///        layers failed)
OM_API OmStatus om_net_run_backward(OmNetRun* run, const float* dout, float* grad, float* din);

/// Move the running statistics in `param` towards those of the last forward of a training run; nothing
/// without batch norm. The variance is that of n - 1 samples, as in PyTorch.
OM_API void om_net_run_update_statistics(const OmNetRun* run, float* param);

#ifdef __cplusplus
}
#endif
#endif
