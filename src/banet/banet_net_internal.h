// banet_net_internal.h: types and functions that the files of the network share.
#ifndef OMENTUM_BANET_NET_INTERNAL_H
#define OMENTUM_BANET_NET_INTERNAL_H

#include <math.h>

#include "omentum/banet_data.h"
#include "omentum/banet_net.h"
#include "omentum/nn_file.h"

#define BANET_NINPUT 16  // channels of om__banet_features: oneDNN processes sixteen at a time
#define BANET_MAX_IMAGE 8

struct OmBanetNet {
    int channel[OM_BANET_NLEVEL];
    int ngroup;      // of group norm; 0: no norm
    double dropout;  // in training
    int nimage;      // mirror images whose outputs are averaged
    OmNet* net;      // for the smallest grid; its parameters are those of any grid
    float* param;
    double slope, offset;  // probability = sigmoid(slope * output + offset)
    double threshold;
    double side;  // of the training samples, m; 0: not stated
    OmFacts facts;
};

// ---- banet_net.c ------------------------------------------------------------------------------------

typedef struct BanetLayers {
    int channel[OM_BANET_NLEVEL], ngroup;
    double dropout;
    int nimage;
} BanetLayers;
// A network without weights: slope 1, offset 0, threshold 0.5.
OmStatus om__banet_net_create(const BanetLayers* layers, OmBanetNet** net);
// The layers for a grid.
OmStatus om__banet_net_layers(const OmBanetNet* net, const int dim[3], OmNet** layers);
OmStatus om__banet_net_save(const OmBanetNet* net, const char* path);

// ---- banet_origin.c ---------------------------------------------------------------------------------

#define OM_BANET_WIDE 0.3  // m, side of the grid: om_banet_default_side
// of a thin body; a sheet of 120 mm has 38 cells: with 51, of 0.15 m, it exceeds the training bodies
#define OM_BANET_NARROW 0.2

void om__banet_generator_name(char name[OM_BANET_ORIGIN]);
// What the samples state, for the file of weights.
OmStatus om__banet_origin_add(const OmBanetData* data, OmFacts* facts);
// Take the side from the facts; `path` is for messages.
OmStatus om__banet_origin_read(const char* path, OmBanetNet* net);

// ---- banet_predict.c --------------------------------------------------------------------------------

// What the layers read, from the channels of om_banet_voxelize. All channels are 0 far outside of the body, like the
// padding of convolutions.
// @param out  (BANET_NINPUT x dim[2] x dim[1] x dim[0])
void om__banet_features(const int dim[3], const float* in, float* out);
static inline double om__banet_probability(const OmBanetNet* net, double logit) {
    return 1 / (1 + exp(-(net->slope * logit + net->offset)));
}
// The mean output before calibration, a logit.
OmStatus om__banet_predict_logit(OmBanetPredictor* predictor, const float* in, float* logit);

// ---- banet_eval.c -----------------------------------------------------------------------------------

typedef struct
    BanetOutputs {         // of the cells that hold a surface vertex; om__banet_outputs_done frees
    int n;                 // samples
    int64_t* begin;        // of each sample's cells           (n + 1)
    float* logit;          //                              (begin[n])
    unsigned char* truth;  // whether it is attached       (begin[n])
    double* ms;            // time of each prediction                (n)
} BanetOutputs;
OmStatus om__banet_outputs_make(const OmBanetNet* net, const OmBanetData* data, int first, int n,
                                int nworker, const OmProgress* progress, BanetOutputs* outputs);
void om__banet_outputs_done(BanetOutputs* outputs);
// Set slope, offset and threshold.
OmStatus om__banet_calibrate(OmBanetNet* net, const BanetOutputs* outputs);
OmStatus om__banet_eval_outputs(const OmBanetNet* net, const BanetOutputs* outputs,
                                OmBanetEval* eval);

// ---- banet_train_report.c ---------------------------------------------------------------------------

struct OmTrainResult;
OmStatus om__banet_report_training(const OmBanetTrainDef* def, const OmBanetNet* net,
                                   const struct OmTrainResult* result, const OmBanetEval* eval);

#endif
