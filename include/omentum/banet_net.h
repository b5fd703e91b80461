/// omentum/banet_net.h: BA-Net: the network, its training and its predictions (room `banet`, floor 6).
///
/// A U-Net over the voxels around a body (thesis 4.2.1, Fig. 4.3c). Input: the rest shape and the displacement of the
/// visible part of the surface. Output: for each cell the probability that it holds an attached vertex. It means what
/// it says, measured on samples that were not trained on (om_banet_eval), and counts only in cells that hold a vertex
/// of the surface. One network fits grids of any size.
///
///     om_banet_net_load(NULL, &net);                                       // the weights that come along
///     om_banet_estimate(net, 0.3, &surface, u, seen, probability);         // of the vertices of a surface
///     om_banet_choose_threshold(surface.nvert, probability, OM_BANET_NEARLY, &threshold);   // banet_fuse.h
///     attached = probability[i] >= threshold;
#ifndef OMENTUM_BANET_NET_H
#define OMENTUM_BANET_NET_H

#include "omentum/banet_data.h"
#include "omentum/nn_train.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- the trained network ------------------------------------------------------------------------------

#define OM_BANET_NLEVEL 5  // grids of the U-Net: four poolings

typedef struct OmBanetNet OmBanetNet;  // constant; may be used by any number of threads

/// Read weights and calibration.
/// @param path  null: weights/banet.safetensors that comes along with the program
/// @return OM_OK; OM_INVALID (not such a file, or damaged: the message names the field); OM_NO_MEMORY; OM_IO (no such
///         file; the message says how to make one)
OM_API OmStatus om_banet_net_load(const char* path, OmBanetNet** net);
/// The network of a setting.
/// @param name  "none" or "": *net is null; "installed": the weights that come along; null: these where they are
///              installed, else *net is null; else a file
/// @param root  folder that the file is relative to; may be null
/// @return as om_banet_net_load
OM_API OmStatus om_banet_net_find(const char* name, const char* root, OmBanetNet** net);
OM_API void om_banet_net_destroy(OmBanetNet* net);
/// One threshold for all bodies, chosen on validation samples: of the thesis's intersections of views (banet_fuse.h).
OM_API double om_banet_net_threshold(const OmBanetNet* net);
/// A line of the file's metadata ("command", "seed", "data", "validation_dsc", ...), or null.
OM_API const char* om_banet_net_fact(const OmBanetNet* net, const char* key);
/// Side of the grid of its training samples, m; 0: the file does not state it.
OM_API double om_banet_net_side(const OmBanetNet* net);
/// Compare what the file states of its training with a use.
/// @param side  of the grid of this use, m; 0: not compared
/// @param data  samples of this use; may be null
/// @param note  a line is added for each reason to trust the probabilities less, and for what is not stated
/// @return OM_OK; OM_INVALID (another size of voxels by more than a factor of 2: the result would be wrong);
///         OM_NO_MEMORY
OM_API OmStatus om_banet_net_check(const OmBanetNet* net, double side, const OmBanetData* data,
                                   OmText* note);
/// Append voxel, side, generator, way, law, element and data of its training, or "not stated".
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_banet_net_describe(const OmBanetNet* net, OmText* text);
/// Hash of weights and calibration.
OM_API uint64_t om_banet_net_hash(const OmBanetNet* net);
/// Number of weights.
OM_API size_t om_banet_net_size(const OmBanetNet* net);

// ---- prediction -----------------------------------------------------------------------------------------

/// Memory and code for grids of one size; for one thread at a time.
typedef struct OmBanetPredictor OmBanetPredictor;

/// @param net      borrowed
/// @param dim      cells of the grid, multiples of OM_BANET_MULTIPLE
/// @param nworker  0: one per processor
/// @return OM_OK; OM_INVALID (dim); OM_NO_MEMORY; OM_UNAVAILABLE (oneDNN failed)
OM_API OmStatus om_banet_predictor_create(const OmBanetNet* net, const int dim[3], int nworker,
                                          OmBanetPredictor** predictor);
OM_API void om_banet_predictor_destroy(OmBanetPredictor* predictor);
/// @param in           as om_banet_voxelize writes it
/// @param probability  of each cell; it counts in cells that hold a vertex of the surface  (dim[2] x dim[1] x dim[0])
/// @return OM_OK; OM_INVALID (an input or output is not finite); OM_UNAVAILABLE (oneDNN failed)
OM_API OmStatus om_banet_predict(OmBanetPredictor* predictor, const float* in, float* probability);

/// Voxelize, predict, and look up the cell of each vertex. A predictor of the right size is made for the call: tens of
/// milliseconds that a caller with many frames saves by om_banet_predict.
/// @param side         of the thesis's grid, m: om_banet_default_side (0.3; 0.2 for bodies thinner than 6 mm)
/// @param u, seen      as for om_banet_voxelize                        (surface->nvert x 3, surface->nvert)
/// @param probability  of attachment                                              (surface->nvert)
/// @return OM_OK; OM_INVALID (as om_banet_grid_fit, om_banet_voxelize and om_banet_net_check); OM_NO_MEMORY;
///         OM_UNAVAILABLE
OM_API OmStatus om_banet_estimate(const OmBanetNet* net, double side, const OmSurface* surface,
                                  const double* u, const double* seen, double* probability);

// ---- training -------------------------------------------------------------------------------------------

typedef struct OmBanetTrainDef {  // made by om_banet_train_default_def
    const OmBanetData* data;      // borrowed
    const char* out_dir;  // checkpoint, metrics.csv, weights.safetensors, report.html; borrowed
    const char* command;  // command line, stored in the file; may be null
    const char* start;  // file of weights of the same channels to begin with; default null: random
    int nvalid;         // number of validation samples, the last ones; default a tenth
    int ntrain;  // training samples, the first ones; default 0: all that are not for validation
    int channel[OM_BANET_NLEVEL];  // of the five grids, multiples of 16; default 16 32 64 96 128
    int ngroup;                    // of group norm; 0 (default): no norm
    double dropout;  // behind poolings and interpolations; default 0.1, the thesis has 0.5
    int dim[3];  // cells of the grid in training, multiples of OM_BANET_MULTIPLE; default 48 32 16
    int nimage;  // mirror images that a prediction averages, 1 to 8; default 4
    OmNetType type;     // default OM_F32; OM_BF16 is faster where the processor has it
    int batch, nepoch;  // default 32 and 40
    double rate;        // peak of the one-cycle schedule; default 7e-4
    double shell;       // weight in the loss of near cells without a vertex; default 0.25
    uint64_t seed;      // default 1
    int nworker;        // of each rank; default 0: one a processor
    // Ranks that train together, each with its part of every batch; rank 0 alone writes files. Borrowed;
    // default null.
    const OmTrainGroup* group;
    OmCookie cookie;
} OmBanetTrainDef;

typedef struct OmBanetTrainSummary {
    double dsc, tpr;  // means over the validation samples as in OmBanetEval, best epoch
    double ece;       // expected calibration error on them, which also gave the calibration
    double threshold;
    int best_epoch, nepoch;
    int64_t nstep;
    double seconds;  // of all calls
    bool is_resumed;
} OmBanetTrainSummary;

#define OM_BANET_NET_KIND "BA-Net"  // kind of the folder
OM_API OmBanetTrainDef om_banet_train_default_def(const OmBanetData* data, const char* out_dir);
/// Train with loss (4.2), or resume from the checkpoint, and write the weights of the best epoch. Calibration and
/// threshold come from the validation samples. On a rank above 0 the summary has no metrics.
/// @return OM_OK; OM_INVALID (the message names the field); OM_CANCELLED (the checkpoint stays); OM_IO; OM_NO_MEMORY
OM_API OmStatus om_banet_train(const OmBanetTrainDef* def, const OmProgress* progress,
                               OmBanetTrainSummary* summary);

// ---- evaluation -----------------------------------------------------------------------------------------

#define OM_BANET_NBIN 15

typedef struct OmBanetEval {  // of cells that hold a surface vertex; om_banet_eval_done frees
    int n;                    // samples
    double *dsc, *tpr;  // (4.3) and (4.6) of each sample, cut by om_banet_choose_threshold     (n)
    double mean_dsc, mean_tpr;
    double dsc_quartile[3], tpr_quartile[3];  // lower, median, upper
    double bin_predicted[OM_BANET_NBIN];      // mean probability of bins of equal count, ascending
    double bin_true[OM_BANET_NBIN];           // share of attached cells in them
    double ece;  // expected calibration error: mean difference of the two
    int64_t ncell;
    double ms;  // median time of a prediction
} OmBanetEval;

/// Predict the data's samples `first` .. `first + n - 1`, each on its own grid.
/// @return OM_OK; OM_INVALID (no such samples; as om_banet_net_check); OM_NO_MEMORY; OM_UNAVAILABLE; OM_CANCELLED
OM_API OmStatus om_banet_eval(const OmBanetNet* net, const OmBanetData* data, int first, int n,
                              int nworker, const OmProgress* progress, OmBanetEval* eval);
OM_API void om_banet_eval_done(OmBanetEval* eval);

/// Reliability of the probabilities. In bins of equal count, ascending: mean probability and share of the true ones.
/// @param ece  expected calibration error: mean difference of the two over all n
/// @return OM_OK (n = 0: all are 0); OM_NO_MEMORY
OM_API OmStatus om_banet_reliability(int64_t n, const double* probability,
                                     const unsigned char* truth, double predicted[OM_BANET_NBIN],
                                     double attached[OM_BANET_NBIN], double* ece);

#ifdef __cplusplus
}
#endif
#endif
