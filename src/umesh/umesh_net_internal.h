// umesh_net_internal.h: functions and types that the files of the trained network share.
#ifndef OMENTUM_UMESH_NET_INTERNAL_H
#define OMENTUM_UMESH_NET_INTERNAL_H

#include "omentum/nn_file.h"
#include "omentum/umesh_net.h"

// displacement (3), patch, organ, held, place (3), linear answer (3), size, forces of second order (3); one of zeros:
// oneDNN processes channels in groups of sixteen
#define UMESH_NCHANNEL 16

typedef struct UmeshRegion {  // limits of the training data, and the margin that widens them
    float* way;               // largest displacement of a node and its neighbours, m      (nnode)
    float* inward;            // mean inward normal of the surface around a node       (nnode x 3)
    double stretch;           // m
    double rough;             // m / m
    double angle;             // rad
    double max, min;          // nodes
    double margin;            // >= 1
} UmeshRegion;

struct OmUmeshNet {
    OmUmeshGrid grid;
    OmFemGridLinear* linear;
    OmFemGridModel* model;  // null if the samples follow another law, or the grid is too large
    double poisson;         // Poisson's ratio of both
    double balance;         // residual of the samples over that of their linear solutions
    OmNet* net;
    float* param;
    int base_channels, nlevel;
    double scale;       // m, scale of the size of inputs
    double correction;  // scale of the output, relative to the size of the input
    double second;      // scale of the forces of second order
    UmeshRegion region;
    OmFacts facts;
};

// ---- umesh_net.c ------------------------------------------------------------------------------------

// Make the layers for a copy of the grid, without weights and region.
OmStatus om__umesh_net_create(const OmUmeshGrid* grid, double poisson, int base_channels,
                              int nlevel, OmUmeshNet** net);
// Set the imbalance of the samples, which decides whether predictions are refined.
OmStatus om__umesh_net_set_balance(OmUmeshNet* net, double balance);
OmStatus om__umesh_net_save(const OmUmeshNet* net, const char* path);
// Make the grid from its active cells, fixed nodes and surface points.
OmStatus om__umesh_grid_copy(const OmUmeshGrid* from, OmUmeshGrid* to);

// ---- umesh_predict.c --------------------------------------------------------------------------------

// Channels that do not depend on the input: organ, fixed nodes, position; else 0. in: (UMESH_NCHANNEL x npoint)
void om__umesh_fill_fixed_channels(const OmUmeshGrid* grid, float* in);
// Channels that depend on the input; the fixed channels are not written.
// @param work  (nnode x 3)
void om__umesh_fill_input(const OmUmeshNet* net, const unsigned char* mask, const float* u,
                          const float* linear, int nworker, float* work, float* in);
// The size of an input: its largest displacement, m; above 0.
double om__umesh_size(const OmUmeshGrid* grid, const unsigned char* mask, const float* u);
size_t om__umesh_predictor_memory(const OmUmeshPredictor* predictor);
// Mean norm error over free nodes, m.
double om__umesh_mean_error(const OmUmeshGrid* grid, const float* a, const float* b);

// ---- umesh_train.c ----------------------------------------------------------------------------------

// Imbalance of samples `first` .. first + n - 1 under the law of fem_grid.h: the median of the norm of the residual
// over that of the linear solution. (In small samples the residual is rounding, in strong presses the residual of the
// linear solution is huge; the median excludes both.)
OmStatus om__umesh_measure_balance(const OmUmeshData* data, double poisson, const float* linear,
                                   int first, int n, double* balance);

// ---- umesh_trust.c ----------------------------------------------------------------------------------

// Compute the limits from the first `ntrain` samples, the margin from the samples after them.
OmStatus om__umesh_region_make(OmUmeshNet* net, const OmUmeshData* data, int ntrain);
OmStatus om__umesh_region_alloc(OmUmeshNet* net);

// ---- umesh_symmetry.c -------------------------------------------------------------------------------

// The mirror image of each node in the plane normal to each axis; null if the grid has no such plane of symmetry.
// @param mirror  freed by the caller, also on failure (nnode each)
OmStatus om__umesh_find_mirrors(const OmUmeshGrid* grid, int* mirror[3]);
// Displacements of the mirror image; `is_on` only for planes that exist. (nnode x 3)
void om__umesh_reflect(const OmUmeshGrid* grid, int* const mirror[3], const bool is_on[3],
                       const float* from, float* to);

// ---- umesh_train_report.c ---------------------------------------------------------------------------

struct OmTrainResult;
OmStatus om__umesh_report_training(const OmUmeshTrainDef* def, const OmUmeshNet* net,
                                   const struct OmTrainResult* result, const OmUmeshEval* eval);

#endif
