/// omentum/banet_data.h: sets of samples on disk, as BA-Net reads them (room `banet`, floor 6).
///
/// Thesis 4.2.1. Of each sample the cells near the body are stored, not the mesh: om_banet_sample_make makes that again
/// from definition and index. A file holds some samples and is called a shard; a folder of shards is a data set.
///
///     OmBanetDataDef def = om_banet_data_default_def(1, "data");
///     om_banet_generate(&def, progress, &summary);              // data/samples_000000.h5, ..
///     om_banet_data_load("data", 0, &data);
///     om_banet_cells_expand(&data.sample[7], (int[3]){48, 48, 16}, NULL, 0, in, target, weight);
///     om_banet_data_done(&data);
#ifndef OMENTUM_BANET_DATA_H
#define OMENTUM_BANET_DATA_H

#include "omentum/banet_grid.h"
#include "omentum/banet_sample.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- one sample, as the network sees it -------------------------------------------------------------

/// Bits of `kind`.
#define OM_BANET_ATTACHED 1  // the cell holds an attached surface vertex: the truth
#define OM_BANET_SURFACE 2   // it holds a surface vertex
#define OM_BANET_NEAR \
    4  // its centre is inside the body or within a voxel of it: it enters the loss

#define OM_BANET_UNIT 256  // stored values are multiples of 1 / OM_BANET_UNIT

typedef struct OmBanetFacts {  // how a sample was drawn and solved
    int index;
    int is_camera, has_board;  // 0 or 1
    int nregion;               // of attachments
    int nvert, ntet;           // of the mesh
    int nsurface, nattached;   // surface vertices; attached ones
    int nattempt, nfail;       // draws; draws whose solve failed
    double young, poisson;     // Pa
    double force;              // resultant, N
    double share, visible;     // attached and seen part of the surface vertices
    double max_u;              // largest displacement of a vertex, m
    double min_volume, residual;
    double seconds;  // wall clock; not stored
} OmBanetFacts;

typedef struct OmBanetCells {  // om_banet_cells_done frees
    OmBanetFacts fact;
    OmBanetGrid grid;
    int ncell;            // cells with a signed distance below OM_BANET_CLIP
    int* cell;            // index in one channel of the grid, ascending  (ncell)
    int16_t* value;       // in 1/OM_BANET_UNIT       (OM_BANET_NCHANNEL x ncell)
    unsigned char* kind;  //                                              (ncell)
} OmBanetCells;

/// Cells of a sample: om_banet_grid_fit, om_banet_voxelize.
/// @param side  m, OmBanetSampleDef.side
/// @return OM_OK; OM_INVALID (the surface has no grid; a displacement above 127 voxels); OM_NO_MEMORY
OM_API OmStatus om_banet_cells_make(const OmBanetSample* sample, double side, OmBanetCells* cells);
OM_API void om_banet_cells_done(OmBanetCells* cells);

#define OM_BANET_NSYMMETRY 16

/// The place of a cell after a symmetry: quarter turns about z (symmetry % 4), then a mirror image in x (bit 2) and in
/// z (bit 3), in the middle of a grid of `to` cells, moved by `shift`.
/// @param from   dim of the cell's grid
/// @param shift  cells; null: none
/// @return whether the place is inside the new grid
OM_API bool om_banet_cell_turn(const int from[3], const int to[3], const int shift[3], int symmetry,
                               const int at[3], int out[3]);

/// Fill the arrays of a grid of `dim` cells. Displacements turn with the symmetry.
/// @param in      (OM_BANET_NCHANNEL x dim[2] x dim[1] x dim[0])
/// @param target  1 at attached cells, else 0; may be null           (dim[2] x dim[1] x dim[0])
/// @param weight  1 at cells that enter the loss, else 0; may be null
/// @return OM_OK; OM_INVALID (a cell is outside of the grid)
OM_API OmStatus om_banet_cells_expand(const OmBanetCells* cells, const int dim[3],
                                      const int shift[3], int symmetry, float* in, float* target,
                                      float* weight);

// ---- sets -------------------------------------------------------------------------------------------

typedef struct OmBanetDataDef {  // made by om_banet_data_default_def
    OmBanetSampleDef sample;     // default: two_share and board_share 0.15 each
    const char* out_dir;         // borrowed
    int nsample;                 // default 5000
    int first;  // samples before this one are not made, a multiple of shard; default 0
    int shard;  // samples in one file; default 50
    // Folders with parts of the same set, of the same `shard`: their files are copied, not made again. Borrowed;
    // default none.
    const char* const* part;
    int npart;
    int npicture;  // samples shown in the report; default 6
    int nworker;   // default 0: one a processor
    OmCookie cookie;
} OmBanetDataDef;

/// The test sets. Their seeds are not for training or development.
typedef enum OmBanetTest {
    OM_BANET_TEST_EXACT,   // 380 samples of way (a), seed 4001: Test of the thesis
    OM_BANET_TEST_CAMERA,  // 380 of way (b), seed 4002
    OM_BANET_TEST_BOARD,   // 190 mixed, on a board, seed 4003
    OM_BANET_TEST_TWO,     // 190 mixed, two regions, seed 4004
    OM_BANET_NTEST
} OmBanetTest;

OM_API OmBanetDataDef om_banet_data_default_def(uint64_t seed, const char* out_dir);
/// The definition of a test set, complete but for the number of workers.
OM_API OmBanetDataDef om_banet_data_test_def(OmBanetTest test, const char* out_dir);
/// The name of a test set: "test", "test-camera", "board", "two".
OM_API const char* om_banet_test_name(OmBanetTest test);

typedef struct OmBanetSummary {
    int nsample, nmade;   // samples from def.first on; samples made by this call
    int nattempt, nfail;  // draws and failed solves of all samples
    int ncamera, nboard, ntwo;
    double median_u, max_u;  // of the largest displacement of samples, m
    double median_visible;
    int64_t ncell, nbyte;   // cells of all samples; bytes of the shards
    double seconds;         // of this call
    double sample_seconds;  // mean of the samples made by this call, wall clock of one worker
} OmBanetSummary;

/// Make the missing samples of a data set: shards samples_NNNNNN.h5 (NNNNNN: their first sample), summary.json,
/// report.html. A file appears complete or not at all. The same bytes for any number of workers.
/// @return OM_OK; OM_INVALID (a field; a shard of another seed or settings is in the folder), OM_NOT_CONVERGED (no draw
///         of a sample succeeded), OM_UNAVAILABLE (a way), OM_IO, OM_CANCELLED (finished shards stay), OM_NO_MEMORY
OM_API OmStatus om_banet_generate(const OmBanetDataDef* def, const OmProgress* progress,
                                  OmBanetSummary* summary);

// Of om_banet_sample_make and of what is stored of a sample: raised where the same definition and index give another
// sample.
#define OM_BANET_GENERATOR 3
#define OM_BANET_ORIGIN 32  // bytes of a text

typedef struct OmBanetData {  // a data set in memory; om_banet_data_done frees
    int nsample;
    int first;  // index of the first sample
    uint64_t seed;
    uint64_t hash;  // of settings and seed
    double side;    // m
    // As the files state it: "omentum banet 1", "mixed", "neo-hookean", "linear" or "quadratic"; "": not stated.
    char generator[OM_BANET_ORIGIN], way[OM_BANET_ORIGIN];
    char law[OM_BANET_ORIGIN], element[OM_BANET_ORIGIN];
    OmBanetCells* sample;  // (nsample)
} OmBanetData;

/// Read the first max_sample samples (0: all) of a folder.
/// @return OM_OK; OM_INVALID (a shard is missing, truncated, corrupted or of another set; the message says
///         which), OM_UNAVAILABLE (another format), OM_IO, OM_NO_MEMORY
OM_API OmStatus om_banet_data_load(const char* dir, int max_sample, OmBanetData* data);
/// Move the samples of `more`, another part of the same set, to the end of `data`; `more` is empty then.
/// @return OM_OK; OM_INVALID (another set, or samples that `data` has or that come before them: nothing is moved);
///         OM_NO_MEMORY
OM_API OmStatus om_banet_data_join(OmBanetData* data, OmBanetData* more);
OM_API void om_banet_data_done(OmBanetData* data);

#ifdef __cplusplus
}
#endif
#endif
