/// omentum/umesh_net.h: U-Mesh: training and prediction (floor 5).
///
/// A network for one organ in its grid (thesis 3.6, Fig. 3.7b). Input: displacements of the nodes under a probe.
/// Output: displacements of all nodes. A test flags inputs that are unlike the training data. One file holds weights
/// and grid, and is enough to predict.
///
///     OmUmeshTrainDef def = om_umesh_train_default_def(&data, "out/phantom");
///     om_umesh_train(&def, progress, &summary);               // out/phantom/weights.safetensors
///     om_umesh_net_load("out/phantom/weights.safetensors", &net);
///     om_umesh_predictor_create(net, 0, &predictor);
///     om_umesh_predict(predictor, mask, u, &trust);           // u: in at masked nodes, out everywhere
#ifndef OMENTUM_UMESH_NET_H
#define OMENTUM_UMESH_NET_H

#include "omentum/nn.h"
#include "omentum/umesh.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- the trained network ------------------------------------------------------------------------------

typedef struct OmUmeshNet OmUmeshNet;  // constant; may be used by any number of threads

/// Read weights, grid and the limits of the test.
/// @return OM_OK; OM_INVALID (not such a file, or damaged: the message names the field); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_umesh_net_load(const char* path, OmUmeshNet** net);
OM_API void om_umesh_net_destroy(OmUmeshNet* net);
OM_API const OmUmeshGrid* om_umesh_net_grid(const OmUmeshNet* net);
/// The network itself, and its parameters.
OM_API const OmNet* om_umesh_net_layers(const OmUmeshNet* net, const float** param);
/// A line of the file's metadata ("seed", "mean_error_mm", ...), or null.
OM_API const char* om_umesh_net_fact(const OmUmeshNet* net, const char* key);
/// Write an ONNX file. With a the largest displacement of the patch, input channels are: displacement / a (3), patch,
/// organ, fixed nodes, position from -1 to 1 (3), linear elastic solution / a (3), a / "scale_m", second-order forces /
/// "second" (3), zeros. The prediction is the linear solution plus output * a * "correction".
/// @return OM_OK; OM_INVALID; OM_NO_MEMORY; OM_IO
OM_API OmStatus om_umesh_net_save_onnx(const OmUmeshNet* net, const char* path);

// ---- prediction -----------------------------------------------------------------------------------------

/// Similarity of an input to the training data. Each measure is relative to its largest value in training, so its limit
/// is 1; the score is the largest measure. All limits except that of `rough` are widened once until 99 % of the
/// validation samples are inside, at most to twice their value.
typedef struct OmUmeshTrust {
    double score;  // the input is inside if this is at most 1
    // Displacement of a node, relative to the largest in training at this place and its neighbours;
    // huge where no sample moved any of them.
    double way;
    double stretch;  // deviation of the displacements from their mean
    double rough;    // difference between neighbouring nodes, relative to the largest displacement
    double size;     // number of nodes, relative to the largest or smallest number in training
    double angle;    // angle between the mean displacement and the inward normal
    bool is_inside;
    char why[128];  // the measure that is outside, as a sentence; "" if none is
} OmUmeshTrust;

/// Memory for predictions, for one thread at a time.
typedef struct OmUmeshPredictor OmUmeshPredictor;

/// @param net      borrowed
/// @param nworker  0: one per processor
/// @return OM_OK; OM_NO_MEMORY; OM_UNAVAILABLE (oneDNN failed)
OM_API OmStatus om_umesh_predictor_create(const OmUmeshNet* net, int nworker,
                                          OmUmeshPredictor** predictor);
OM_API void om_umesh_predictor_destroy(OmUmeshPredictor* predictor);
#define OM_UMESH_TOLERANCE 5e-5  // m, the default
#define OM_UMESH_MAX_CYCLE 40
/// Stop refining when the mean distance left is estimated below `tolerance`, or after max_cycle cycles; 0 cycles: the
/// network alone. There is no refinement if the samples have another law than the neo-Hookean, or if the grid has more
/// than 3,800 points of twice the spacing.
OM_API void om_umesh_predictor_set_refinement(OmUmeshPredictor* predictor, double tolerance,
                                              int max_cycle);
/// Relax the linear elastic solution in place of the network's output (default false): no network, but more cycles.
OM_API void om_umesh_predictor_set_linear(OmUmeshPredictor* predictor, bool is_linear);
/// Relaxation of the last prediction.
OM_API OmFemGridReport om_umesh_predictor_refinement(const OmUmeshPredictor* predictor);
/// Predict: fixed nodes do not move, masked nodes have the given displacement, the network gives the others. Then the
/// elements are relaxed towards equilibrium with the law of the samples.
/// @param mask   1 where the displacement is given (nnode)
/// @param u      in: at masked nodes; out: everywhere, m (nnode x 3)
/// @param trust  may be null
/// @return OM_OK, also for inputs unlike the training data; OM_INVALID (a displacement is not finite, no node is
/// masked)
OM_API OmStatus om_umesh_predict(OmUmeshPredictor* predictor, const unsigned char* mask, float* u,
                                 OmUmeshTrust* trust);
/// Test the input only.
OM_API void om_umesh_judge(const OmUmeshNet* net, const unsigned char* mask, const float* u,
                           OmUmeshTrust* trust);

/// om_fem_grid_untangle with the network's grid and Poisson's ratio: no tetrahedron of om_fem_grid_make_tet_mesh stays
/// inverted.
/// @param mask  as for om_umesh_predict (nnode)
/// @param u     in/out: a prediction of om_umesh_predict, m (nnode x 3)
/// @return OM_OK; OM_NOT_CONVERGED (no valid shape was found: u is not changed, only `ninverted` is set); OM_NO_MEMORY
OM_API OmStatus om_umesh_untangle(const OmUmeshNet* net, const unsigned char* mask, float* u,
                                  OmFemGridUntangling* untangling);

/// The place on the organ's free surface nearest to p, with the outward normal of the surface around it.
OM_API OmUmeshPatch om_umesh_find_place(const OmUmeshGrid* grid, OmVec3 p);

// ---- training -------------------------------------------------------------------------------------------

typedef struct OmUmeshTrainDef {  // made by om_umesh_train_default_def
    const OmUmeshData* data;      // borrowed
    const char* out_dir;  // checkpoint, metrics.csv, weights.safetensors, report.html; borrowed
    const char* command;  // command line, stored in the file; may be null
    int nvalid;           // number of validation samples, the last ones; default a tenth
    int base_channels;    // default 16
    int nlevel;           // default 3
    OmNetType type;       // default OM_F32; OM_BF16 is faster where the processor has it
    int batch, nepoch;    // default 4 and 100
    // Poisson's ratio of the linear solution that the network corrects; default 0.45
    double poisson;
    double rate;    // peak of the one-cycle schedule; default 1e-3
    uint64_t seed;  // default 1
    int nworker;    // default 0: one a processor
    OmCookie cookie;
} OmUmeshTrainDef;

typedef struct OmUmeshTrainSummary {
    double valid_error;   // mean norm error of the best epoch on the validation samples, m
    double linear_error;  // the same of the linear solution alone
    int best_epoch, nepoch;
    int64_t nstep;
    double seconds;  // of all calls
    bool is_resumed;
} OmUmeshTrainSummary;

#define OM_UMESH_NET_KIND "U-Mesh network"  // kind of the folder; may also have an evaluation
OM_API OmUmeshTrainDef om_umesh_train_default_def(const OmUmeshData* data, const char* out_dir);
/// Train, or resume from the checkpoint, and write the weights of the best epoch.
/// @return OM_OK; OM_INVALID (the message names the field); OM_CANCELLED (the checkpoint stays); OM_IO; OM_NO_MEMORY
OM_API OmStatus om_umesh_train(const OmUmeshTrainDef* def, const OmProgress* progress,
                               OmUmeshTrainSummary* summary);

// ---- evaluation -------------------------------------------------------------------------------------------

// Mean norm errors (3.17) over the free nodes, m. Nodes of the patch are included; their error is 0.
typedef struct OmUmeshEval {
    int n;
    double mean, sd, worst;
    int worst_sample;                    // counted from `first`
    double network_mean, network_worst;  // the network alone, not relaxed
    double alone_mean, alone_worst;      // the linear solution, not relaxed
    double linear_mean, linear_worst;    // the linear solution, relaxed
    double linear_ms;                    // median time of a relaxed linear solution
    double mean_cycle;                   // mean number of relaxation cycles
    int max_cycle;                       // largest number of relaxation cycles
    int ninverted;                       // relaxed predictions with an inverted element
    int nbeyond;   // relaxed predictions whose error exceeds both the tolerance and the estimate
    double max_u;  // largest displacement of a node in the data
    double ms_median, ms_min, ms_max;  // time of a prediction: median, smallest, largest
    int ninside;                       // samples that the test accepts
    double* error;                     // of each sample (n); freed by om_umesh_eval_done
    double* score;                     // of the test, for each sample (n)
} OmUmeshEval;

/// Predict the data's samples `first` .. `first + n - 1`, refined to `tolerance` (m).
/// @return OM_INVALID if the data is of another grid
OM_API OmStatus om_umesh_eval(const OmUmeshNet* net, const OmUmeshData* data, int first, int n,
                              double tolerance, int nworker, OmUmeshEval* eval);
OM_API void om_umesh_eval_done(OmUmeshEval* eval);
/// Write the network again with the results of a test in its metadata: "test_seed", "test_samples", "test_error_mm",
/// "test_worst_mm" and "test_network_error_mm".
/// @return OM_OK; OM_INVALID; OM_NO_MEMORY; OM_IO
OM_API OmStatus om_umesh_record_test(const OmUmeshNet* net, const OmUmeshData* test,
                                     const OmUmeshEval* eval, const char* path);

// ---- as tissue --------------------------------------------------------------------------------------------

/// The trained network as an engine of tissue.h:
///     OmTissueDef def = om_tissue_default_def(om_umesh_engine(), &mesh);
///     def.options = net;
/// The net is borrowed until the model is destroyed; a scene's `weights` is loaded. The mesh may be any mesh of the
/// organ; its vertices follow the grid. Surface nodes that a tool grasps move with the tool; nodes in contact move with
/// the obstacle, until it leaves their rest position. The engine is quasi-static and has no forces on tools and
/// obstacles.
/// Attachments are those of the training. A step with an input unlike the training data is carried out and returns
/// OM_NOT_CONVERGED with the reason; report->residual is the score of the test.
OM_API const struct OmTissueEngine* om_umesh_engine(void);

#ifdef __cplusplus
}
#endif
#endif
