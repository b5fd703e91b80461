/// omentum/umesh_net.h: U-Mesh trained, and asked (floor 5).
///
/// A network for one organ in its grid (thesis 3.6, Fig. 3.7b): displacements of the nodes that a probe moves in,
/// displacements of all nodes out. It knows what it was trained on, and says when an input is outside of that. A
/// file holds the weights and the grid, so that nothing else is needed to predict.
///
///     OmUmeshTrainDef def = om_umesh_default_train_def(&data, "out/phantom");
///     om_umesh_train(&def, progress, &summary);               // out/phantom/weights.safetensors
///     om_umesh_load_net("out/phantom/weights.safetensors", &net);
///     om_umesh_create_predictor(net, 0, &predictor);
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

/// Read weights, grid and region of trust. Files of another kind, damaged, or with tensors that do not fit each
/// other are refused: OM_INVALID, with the file and the tensor.
/// @return OM_OK; OM_INVALID (not such a file, or damaged: the message names the field); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_umesh_load_net(const char* path, OmUmeshNet** net);
OM_API void om_umesh_destroy_net(OmUmeshNet* net);
OM_API const OmUmeshGrid* om_umesh_net_grid(const OmUmeshNet* net);
/// The network itself, and its parameters.
OM_API const OmNet* om_umesh_net_layers(const OmUmeshNet* net, const float** param);
/// A line of the file's metadata ("seed", "mean_error_mm", ...), or null.
OM_API const char* om_umesh_net_fact(const OmUmeshNet* net, const char* key);
/// Write it as ONNX. Channels are, with a the largest displacement of the patch: displacement over a (3), patch, organ,
/// held, place from -1 to 1 (3), linear answer over a (3), a over "scale_m", forces of second order over "second" (3),
/// zeros; what comes out, times a and "correction", is added to the linear answer.
/// @return OM_OK; OM_INVALID; OM_NO_MEMORY; OM_IO
OM_API OmStatus om_umesh_save_onnx(const OmUmeshNet* net, const char* path);

// ---- prediction -----------------------------------------------------------------------------------------

/// Is an input like those of training? Each measure is a share of the most that training saw, so that 1 is its
/// limit; the score is the largest. Limits but that of `rough` are widened, once, until 99 % of the samples kept
/// for validation are inside, but never to more than double.
typedef struct OmUmeshTrust {
    double score;  // inside if at most 1
    // Of the displacement of a node, relative to the largest at that place and its neighbours; huge
    // where no sample moved any of them.
    double way;
    double stretch;  // of the departure of the displacements from their mean
    double rough;    // of the difference between neighbours, over the largest displacement
    double size;     // of the number of nodes, over the most or under the least
    double angle;    // between the mean displacement and the inward normal
    bool is_inside;
    char why[128];  // what is outside, for people; "" if nothing is
} OmUmeshTrust;

/// How an answer was brought to equilibrium.
typedef struct OmUmeshRefinement {
    int ncycle;         // 0: the network's answer as it is; the others say nothing then
    double left;        // estimate of the mean distance that is left to equilibrium, m
    double min_volume;  // least det F at a Gauss point; not above 0: an element is turned over
} OmUmeshRefinement;

/// Memory of one thread for one sample at a time.
typedef struct OmUmeshPredictor OmUmeshPredictor;

/// @param net      borrowed
/// @param nworker  0: one per processor
/// @return OM_OK; OM_NO_MEMORY; OM_UNAVAILABLE (the library of layers refused)
OM_API OmStatus om_umesh_create_predictor(const OmUmeshNet* net, int nworker,
                                          OmUmeshPredictor** predictor);
OM_API void om_umesh_destroy_predictor(OmUmeshPredictor* predictor);
#define OM_UMESH_TOLERANCE 5e-5  // m, the default
#define OM_UMESH_MAX_CYCLE 40
/// Stop refining when the mean distance left is estimated below `tolerance`, or after max_cycle cycles; 0 cycles: the
/// network alone. What does not refine: networks of samples of another law than the neo-Hookean, and grids of more than
/// 3,800 points of twice the spacing.
OM_API void om_umesh_set_refinement(OmUmeshPredictor* predictor, double tolerance, int max_cycle);
/// Refine the linear elastic answer instead (default false): some cycles more, and no network to run.
OM_API void om_umesh_set_linear(OmUmeshPredictor* predictor, bool is_linear);
/// Of the last prediction.
OM_API OmUmeshRefinement om_umesh_refinement(const OmUmeshPredictor* predictor);
/// Held nodes stay, masked ones go where they are told, the network says the rest; then elements are brought to
/// equilibrium, by the law of the samples.
/// @param mask   1 where the displacement is given (nnode)
/// @param u      in: at masked nodes; out: everywhere, m (nnode x 3)
/// @param trust  may be null
/// @return OM_OK, also outside of what was trained; OM_INVALID (a displacement is not finite, no node is masked)
OM_API OmStatus om_umesh_predict(OmUmeshPredictor* predictor, const unsigned char* mask, float* u,
                                 OmUmeshTrust* trust);
/// The test alone.
OM_API void om_umesh_judge(const OmUmeshNet* net, const unsigned char* mask, const float* u,
                           OmUmeshTrust* trust);

/// The grid as tetrahedra, six an element, for files, pictures and engines: vertices are nodes, set "attachment" the
/// held ones. The caller frees it with om_tet_mesh_done.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_umesh_make_tet_mesh(const OmUmeshGrid* grid, OmTetMesh* mesh);
typedef struct OmUmeshOpening {
    int ninverted;      // tetrahedra that were inverted
    int nmoved;         // nodes moved by more than 0.01 mm
    double most, mean;  // how far: the farthest node, the mean over all nodes, m
    double min_volume;  // least det F of a tetrahedron now
} OmUmeshOpening;

/// Change an answer beside the probe until it inverts no tetrahedron of om_umesh_make_tet_mesh: for files and pictures.
/// At equilibrium det F is above 0 at the Gauss points of an element, but a corner of it may be folded. Masked and held
/// nodes stay; an answer that inverts none is not changed.
/// @param mask  as for om_umesh_predict (nnode)
/// @param u     in/out: an answer of om_umesh_predict, m (nnode x 3)
/// @return OM_OK; OM_NOT_CONVERGED: no such answer was found, u is not changed, only `ninverted` is known; OM_NO_MEMORY
OM_API OmStatus om_umesh_open(const OmUmeshNet* net, const unsigned char* mask, float* u,
                              OmUmeshOpening* opening);

/// The place on the skin that is nearest to p, with the outward normal of the surface around it.
OM_API OmUmeshPatch om_umesh_find_place(const OmUmeshGrid* grid, OmVec3 p);

// ---- training -------------------------------------------------------------------------------------------

typedef struct OmUmeshTrainDef {  // made by om_umesh_default_train_def
    const OmUmeshData* data;      // borrowed
    const char* out_dir;  // checkpoint, metrics.csv, weights.safetensors, report.html; borrowed
    const char* command;  // kept in the file; may be null
    int nvalid;           // the last samples are kept for validation; default a tenth
    int base_channels;    // default 16
    int nlevel;           // default 3
    OmNetType type;       // default OM_F32; OM_BF16 is faster where the processor has it
    int batch, nepoch;    // default 4 and 100
    double poisson;       // of the linear answer that the network corrects; default 0.45
    double rate;          // peak of the one-cycle schedule; default 1e-3
    uint64_t seed;        // default 1
    int nworker;          // default 0: one a processor
    uint32_t cookie;
} OmUmeshTrainDef;

typedef struct OmUmeshTrainSummary {
    double valid_error;   // mean norm error of the best epoch on the validation samples, m
    double linear_error;  // of the linear answer alone, the same
    int best_epoch, nepoch;
    int64_t nstep;
    double seconds;  // of all calls
    bool is_resumed;
} OmUmeshTrainSummary;

OM_API OmUmeshTrainDef om_umesh_default_train_def(const OmUmeshData* data, const char* out_dir);
/// Train, or go on where it stopped, and write the weights of the best epoch.
/// @return OM_OK; OM_INVALID (the message names the field); OM_CANCELLED (the checkpoint stays); OM_IO; OM_NO_MEMORY
OM_API OmStatus om_umesh_train(const OmUmeshTrainDef* def, const OmProgress* progress,
                               OmUmeshTrainSummary* summary);

// ---- evaluation -------------------------------------------------------------------------------------------

// Mean norm errors (3.17) over the nodes that are not held, m; those of the patch are among them, without error.
typedef struct OmUmeshEval {
    int n;
    double mean, sd, worst;
    int worst_sample;                    // from `first` on
    double network_mean, network_worst;  // of the network's answers, not refined
    double alone_mean, alone_worst;      // of linear answers, not refined
    double linear_mean, linear_worst;    // of linear answers, refined
    double linear_ms;                    // of these, median
    double mean_cycle;                   // of the refinement
    int most_cycle;
    int ninverted;  // refined answers with an element turned over
    int nbeyond;    // refined answers farther off than the tolerance and what was estimated
    double max_u;   // largest displacement of a node in the data
    double ms_median, ms_least, ms_most;  // of a prediction, all in
    int ninside;                          // samples that the test takes for known
    double* error;                        // of each sample (n); freed by om_umesh_eval_done
    double* score;                        // of the test (n)
} OmUmeshEval;

/// Predict the data's samples `first` .. `first + n - 1`, refined to `tolerance` (m).
/// @return OM_INVALID if the data is of another grid
OM_API OmStatus om_umesh_eval(const OmUmeshNet* net, const OmUmeshData* data, int first, int n,
                              double tolerance, int nworker, OmUmeshEval* eval);
OM_API void om_umesh_eval_done(OmUmeshEval* eval);
/// Write the network again, with what a test measured: facts "test_seed", "test_samples", "test_error_mm",
/// "test_worst_mm" and "test_network_error_mm".
/// @return OM_OK; OM_INVALID; OM_NO_MEMORY; OM_IO
OM_API OmStatus om_umesh_record_test(const OmUmeshNet* net, const OmUmeshData* test,
                                     const OmUmeshEval* eval, const char* path);

// ---- as tissue --------------------------------------------------------------------------------------------

/// The trained network as an engine of tissue.h:
///     def.custom = om_umesh_engine(), def.custom_data = net;
/// The net is borrowed as long as the model lives. The mesh is any in the place of the organ; its vertices go
/// where the grid does. Skin that a tool holds, or an obstacle has touched, moves with it and sticks until the
/// obstacle leaves the place where the skin is at rest. Quasi-static, without forces: a tool or an obstacle feels
/// nothing. Attachments are those of training. A step outside of what was trained is made and returns
/// OM_NOT_CONVERGED with the reason; report->residual is the test's score.
OM_API const struct OmTissueEngine* om_umesh_engine(void);

#ifdef __cplusplus
}
#endif
#endif
