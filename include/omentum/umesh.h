/// omentum/umesh.h: U-Mesh, the deformation of a whole organ from that of a patch of its surface (floor 5).
///
/// Thesis 3.6. An organ is immersed in a regular grid of hexahedra. Finite elements deform it thousands of times, and a
/// U-Net learns the displacement of all nodes from that of the nodes under the probe. This header has the grid and the
/// data (Algorithm 2); a sample is a function of (seed, index).
///
///     OmUmeshOrganDef organ_def = om_umesh_organ_default_def();       // the breast phantom
///     om_umesh_organ_create(&organ_def, &organ);
///     OmUmeshDataDef def = om_umesh_data_default_def(organ, "data");
///     om_umesh_generate(&def, progress, &summary);                    // data/samples_000000.h5, ..
///     om_umesh_data_load("data", 0, &data);
#ifndef OMENTUM_UMESH_H
#define OMENTUM_UMESH_H

#include "omentum/fem_grid.h"
#include "omentum/scene_model.h"
#include "omentum/shape_sdf.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- the grid ---------------------------------------------------------------------------------------

/// The network works on all points of the grid, padding included.
typedef struct OmUmeshGrid {    // om_umesh_grid_done frees
    OmFemGrid fem;              // points, nodes, elements, fixed nodes
    OmVec3 up;                  // unit, towards the side from which the probe comes
    unsigned char* is_surface;  // nodes of the free boundary             (fem.mesh.nnode)
    double* surface_x;          // their nearest points on the organ, m   (fem.mesh.nnode x 3)
    uint64_t hash;              // of all fields
} OmUmeshGrid;

OM_API void om_umesh_grid_done(OmUmeshGrid* grid);

/// The pressing face of the probe on the organ's surface.
typedef struct OmUmeshPatch {
    OmVec3 center;  // on the organ's surface, m
    OmVec3 normal;  // outward there, unit
    OmVec3 along;   // of the long side, unit, across the normal
    // Long side and short side, m; and the largest distance of a point from the plane of the face, on either side, m.
    double size[3];
} OmUmeshPatch;

/// The face of the thesis's probe: 50 x 10 mm, points within 10 mm of its plane.
OM_API OmUmeshPatch om_umesh_patch_default(OmVec3 center, OmVec3 normal, OmVec3 along);
/// Nodes of the free boundary under the patch, which the probe moves.
/// @param mask  1 for these nodes, else 0 (fem.mesh.nnode)
/// @return number of these nodes
OM_API int om_umesh_patch_select(const OmUmeshGrid* grid, const OmUmeshPatch* patch,
                                 unsigned char* mask);

/// Copy from nodes to points, one component after the other: out[c npoint + point]. 0 at points without a node and at
/// nodes whose `mask` (fem.mesh.nnode; may be null) is 0.
/// @param u    (fem.mesh.nnode x 3)
/// @param out  (3 x npoint)
OM_API void om_umesh_scatter(const OmUmeshGrid* grid, const float* u, const unsigned char* mask,
                             float* out);
/// Copy from points to nodes.
OM_API void om_umesh_gather(const OmUmeshGrid* grid, const float* in, float* u);

// ---- the organ --------------------------------------------------------------------------------------

typedef struct OmUmeshOrganDef {  // made by om_umesh_organ_default_def
    // A patient of one material, borrowed until create returns; null (default): the phantom, a half
    // ellipsoid of 150 x 120 x 72 mm on its flat side.
    const OmPatient* patient;
    const OmSurface* surface;  // or a closed surface; borrowed; default null
    OmVec3 up;                 // away from the fixed side; default 0: the patient's, else +z
    int nelem;       // number of active elements, within 1 % if >= 200; default 2174 (thesis)
    double spacing;  // of the grid, m; default 0: computed from nelem
    int dim[3];      // smallest number of points of the padded grid; default 0: no lower bound
    int multiple;  // dim are multiples of this, the longest of twice this; default 4: U-Net of 3 levels
    // An element is active if this part of its volume is inside the organ, in (0, 1); default 0.5.
    double min_fill;
    // Nodes in this lowest part of the height are fixed; 0 (default): the patient's set
    // "attachment", without one the lowest nodes (phantom) or the lowest tenth (other organs).
    double held_height;
    OmCookie cookie;
} OmUmeshOrganDef;

/// An organ in its grid, and its surface.
typedef struct OmUmeshOrgan OmUmeshOrgan;

OM_API OmUmeshOrganDef om_umesh_organ_default_def(void);
/// Cells with enough volume inside become elements. Of these the largest part connected over faces is kept.
/// @return OM_OK, OM_INVALID (no cell inside, no fixed node, an element count that no spacing gives), OM_NO_MEMORY
OM_API OmStatus om_umesh_organ_create(const OmUmeshOrganDef* def, OmUmeshOrgan** organ);
OM_API void om_umesh_organ_destroy(OmUmeshOrgan* organ);
OM_API const OmUmeshGrid* om_umesh_organ_grid(const OmUmeshOrgan* organ);
OM_API const OmSurface* om_umesh_organ_surface(const OmUmeshOrgan* organ);

// ---- data -------------------------------------------------------------------------------------------

/// How samples are drawn and solved. The centre of a patch is a random point of the free surface, its rotation about
/// the normal is random. The direction of a load is the inward normal, tilted about a random tangent by an angle
/// uniform in [-max_tilt, max_tilt]. Either the nodes of the patch share a force in this direction, |f| uniform in
/// [0, max_force] (Algorithm 2, line 9 corrected), or the probe moves them in this direction by a distance uniform in
/// [0, max_press]. 0.8 N at 1800 Pa gives the deformations of the thesis on the phantom. The network maps
/// displacements to displacements, so it does not depend on Young's modulus.
typedef struct OmUmeshDataDef {  // made by om_umesh_data_default_def
    const OmUmeshOrgan* organ;   // borrowed
    const char* out_dir;         // borrowed
    int nsample;                 // default 1000
    uint64_t seed;               // default 1
    // Default: neo-Hookean with the patient's modulus and Poisson's ratio; without a patient 1800
    // Pa and 0.45.
    OmMaterial material;
    double max_force;    // N, default 0.8
    double max_tilt;     // rad, default 45 degrees
    double press_share;  // fraction of samples with a prescribed displacement; default 0.5
    // m, default 0.035; never more than 0.6 of the distance to the nearest fixed node.
    double max_press;
    double pull_share;     // fraction of samples that are pulled outwards; default 0
    double patch_size[3];  // OmUmeshPatch.size, m; default 0.05, 0.01, 0.01
    int min_patch;         // a patch with fewer nodes is drawn again; default 4
    double tolerance;      // of the residual, relative to loads and reactions; default 1e-5
    double min_volume;     // smallest det F allowed in a sample; default 0.05
    int max_attempt;       // largest number of draws for one sample; default 64
    int shard;             // samples in one file; default 100
    int npicture;          // pictures in the report; default 4
    int nworker;           // default 0: one a processor
    OmCookie cookie;
} OmUmeshDataDef;

typedef struct OmUmeshSample {  // how a sample was drawn and solved
    OmUmeshPatch patch;
    OmVec3 force;       // resultant on the patch, N
    OmVec3 direction;   // unit, of the force or the displacement
    double tilt;        // angle between `direction` and the normal, rad
    double press;       // displacement of the probe, m; 0: a force was applied
    int npatch;         // nodes of the patch
    int nattempt;       // draws, failed ones included
    int nfail;          // draws whose solve found no valid equilibrium
    int nnewton;        // Newton iterations of the last draw
    double residual;    // relative
    double min_volume;  // smallest det F
    double max_u;       // largest displacement of a node, m
    double seconds;     // wall clock; not stored
} OmUmeshSample;

/// Memory and linear system for solves, for one thread at a time.
typedef struct OmUmeshSolver OmUmeshSolver;

OM_API OmUmeshDataDef om_umesh_data_default_def(const OmUmeshOrgan* organ, const char* out_dir);
/// The solver that makes samples: grid, linear system, scratch.
/// @return OM_OK; OM_INVALID (the message names the field); OM_NO_MEMORY
OM_API OmStatus om_umesh_solver_create(const OmUmeshDataDef* def, OmUmeshSolver** solver);
OM_API void om_umesh_solver_destroy(OmUmeshSolver* solver);
/// Sample `index` of the seed of the definition.
/// @param mask  nodes of the patch (fem.mesh.nnode)
/// @param u     displacements, m (fem.mesh.nnode x 3)
/// @return OM_OK, OM_NOT_CONVERGED (no draw succeeded), OM_NO_MEMORY
OM_API OmStatus om_umesh_sample_make(OmUmeshSolver* solver, int64_t index, OmUmeshSample* sample,
                                     unsigned char* mask, double* u);
/// Reference solution: displacements of all nodes, prescribed by u at masked nodes, free elsewhere.
/// @param u  in: at masked nodes; out: everywhere, m (fem.mesh.nnode x 3)
/// @return OM_OK, OM_NOT_CONVERGED (u is not changed), OM_INVALID, OM_NO_MEMORY
OM_API OmStatus om_umesh_solve(OmUmeshSolver* solver, const unsigned char* mask, double* u,
                               OmFemReport* report);

typedef struct OmUmeshSummary {
    int nsample, nmade;    // samples in the folder; samples made by this call
    int nattempt, nfail;   // draws and failed solves of all samples
    double max_u, mean_u;  // m: largest displacement of a node; mean over samples of their largest
    double max_force;      // largest resultant, N
    double seconds;        // of this call
    double solve_seconds;  // mean of the samples made by this call, of one worker
} OmUmeshSummary;

/// Make the missing samples of a data set: shards samples_NNNNNN.h5 (NNNNNN: their first sample), summary.json,
/// report.html. A file appears complete or not at all. The same bytes for any number of workers.
/// @return OM_OK; OM_INVALID (a field; a shard of another seed or settings is in the folder), OM_NOT_CONVERGED,
///         OM_IO, OM_CANCELLED (finished shards stay), OM_NO_MEMORY
OM_API OmStatus om_umesh_generate(const OmUmeshDataDef* def, const OmProgress* progress,
                                  OmUmeshSummary* summary);

typedef struct OmUmeshData {  // a data set in memory; om_umesh_data_done frees
    OmUmeshGrid grid;
    int nsample;
    uint64_t seed;
    uint64_t hash;          // of the grid, the settings and the seed
    OmUmeshSample* sample;  //                                                        (nsample)
    unsigned char* mask;    // nodes of the patch                          (nsample x mesh.nnode)
    float* u;               // displacements, m                        (nsample x mesh.nnode x 3)
} OmUmeshData;

/// Read the first max_sample samples (0: all) of a folder.
/// @return OM_OK; OM_INVALID (a shard is missing, truncated, corrupted or of another set; the message says
///         which), OM_IO, OM_NO_MEMORY
OM_API OmStatus om_umesh_data_load(const char* dir, int max_sample, OmUmeshData* data);
OM_API void om_umesh_data_done(OmUmeshData* data);

#ifdef __cplusplus
}
#endif
#endif
