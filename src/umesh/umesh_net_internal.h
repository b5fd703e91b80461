// umesh_net_internal.h: what the files of the trained network share.
#ifndef OMENTUM_UMESH_NET_INTERNAL_H
#define OMENTUM_UMESH_NET_INTERNAL_H

#include "omentum/nn_file.h"
#include "omentum/umesh_net.h"

// displacement (3), patch, organ, held, place (3), linear answer (3), size, forces of second order (3); one of zeros:
// oneDNN works on channels by sixteens
#define UMESH_NCHANNEL 16
#define UMESH_NFACT 12  // lines of metadata that are kept

typedef struct UmeshRegion {  // what training saw, and by how much its limits are widened
    float* way;               // largest displacement of a node, its neighbours' too, m    (nnode)
    float* inward;            // mean inward normal of the skin around a node          (nnode x 3)
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
    double poisson;         // of both
    double balance;         // forces left in samples, by that law, over those in linear answers
    OmNet* net;
    float* param;
    int base_channels, nlevel;
    double scale;       // m, of the size of inputs
    double correction;  // of what comes out, over the size of the input
    double second;      // of the forces of second order
    UmeshRegion region;
    int nfact;
    OmTextPair fact[UMESH_NFACT];  // strings of its own
};

// ---- umesh_net.c ------------------------------------------------------------------------------------

// Without weights and region: the layers for a copy of the grid.
OmStatus om__umesh_net_create(const OmUmeshGrid* grid, double poisson, int base_channels,
                              int nlevel, OmUmeshNet** net);
// What is left of forces in the samples decides whether answers are refined.
OmStatus om__umesh_net_set_balance(OmUmeshNet* net, double balance);
OmStatus om__umesh_net_add_fact(OmUmeshNet* net, const char* key, const char* format, ...)
    OM_PRINTF(3, 4);
OmStatus om__umesh_net_save(const OmUmeshNet* net, const char* path);
// The grid from where its cells, held nodes and skin are.
OmStatus om__umesh_grid_copy(const OmUmeshGrid* from, OmUmeshGrid* to);

// ---- umesh_predict.c --------------------------------------------------------------------------------

// Channels that no input changes: organ, held, place; zeros elsewhere. in: (UMESH_NCHANNEL x npoint)
void om__umesh_fill_fixed_channels(const OmUmeshGrid* grid, float* in);
// What an input changes, but for the fixed channels.
// @param work  (nnode x 3)
void om__umesh_fill_input(const OmUmeshNet* net, const unsigned char* mask, const float* u,
                          const float* linear, int nworker, float* work, float* in);
// The size of an input: its largest displacement, m; above 0.
double om__umesh_size(const OmUmeshGrid* grid, const unsigned char* mask, const float* u);
size_t om__umesh_predictor_memory(const OmUmeshPredictor* predictor);
// Mean norm error over the nodes that are not held, m.
double om__umesh_mean_error(const OmUmeshGrid* grid, const float* a, const float* b);

// ---- umesh_train.c ----------------------------------------------------------------------------------

// How far samples `first` .. first + n - 1 are from equilibrium by the law of fem_grid.h: the norm of their residual
// over that of the linear solutions, the median. (In small samples the residual is rounding, in strong presses the
// residual of the linear solution is huge.)
OmStatus om__umesh_measure_balance(const OmUmeshData* data, double poisson, const float* linear,
                                   int first, int n, double* balance);

// ---- umesh_trust.c ----------------------------------------------------------------------------------

// From the first `ntrain` samples; the margin from the samples after them.
OmStatus om__umesh_region_make(OmUmeshNet* net, const OmUmeshData* data, int ntrain);
OmStatus om__umesh_region_alloc(OmUmeshNet* net);

// ---- umesh_symmetry.c -------------------------------------------------------------------------------

// The image of each node in the plane square to each axis, or null where the grid has no such plane.
// @param mirror  freed by the caller, also on failure (nnode each)
OmStatus om__umesh_find_mirrors(const OmUmeshGrid* grid, int* mirror[3]);
// Displacements of the mirror image; `is_on` only where there is a plane. (nnode x 3)
void om__umesh_reflect(const OmUmeshGrid* grid, int* const mirror[3], const bool is_on[3],
                       const float* from, float* to);

// ---- umesh_train_report.c ---------------------------------------------------------------------------

struct OmTrainResult;
OmStatus om__umesh_report_training(const OmUmeshTrainDef* def, const OmUmeshNet* net,
                                   const struct OmTrainResult* result, const OmUmeshEval* eval);

#endif
