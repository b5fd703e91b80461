/// omentum/umesh.h: U-Mesh, the deformation of a whole organ from that of a patch of its surface (floor 5).
///
/// Thesis 3.6. An organ is immersed in a regular grid of hexahedra, finite elements deform it thousands of
/// times, and a U-Net learns what all nodes do when those under the probe do what the probe makes them. This
/// header has the grid and the data (Algorithm 2); a sample is a function of (seed, index).
///
///     OmUmeshOrganDef organ_def = om_umesh_default_organ_def();       // the breast phantom
///     om_umesh_create_organ(&organ_def, &organ);
///     OmUmeshDataDef def = om_umesh_default_data_def(organ, "data");
///     om_umesh_generate(&def, progress, &summary);                    // data/samples_000000.h5, ..
///     om_umesh_load_data("data", 0, &data);
#ifndef OMENTUM_UMESH_H
#define OMENTUM_UMESH_H

#include "omentum/fem.h"
#include "omentum/scene_model.h"
#include "omentum/shape_sdf.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- the grid ---------------------------------------------------------------------------------------

/// Points of the grid are what the network has; nodes are the points that are corners of an active element,
/// in the order of points. Point (i, j, k) has index i + dim[0] (j + dim[1] k); cell (i, j, k), that of its
/// lowest corner.
typedef struct OmUmeshGrid {  // om_umesh_grid_done frees
    int dim[3];               // points, padding included
    int npoint;               // dim[0] dim[1] dim[2]
    double spacing;           // m
    OmVec3 origin;            // point (0, 0, 0), m
    OmVec3 up;                // unit; the probe comes from there
    OmFemMesh mesh;   // OM_HEX8: active elements, in the order of cells; rest positions of nodes
    int* cell_elem;   // element of a cell, or -1                               (npoint)
    int* point_node;  // node at a point, or -1                                 (npoint)
    int* node_point;  // point of a node                                   (mesh.nnode)
    unsigned char* fixed;    // nodes that are held                               (mesh.nnode)
    unsigned char* is_skin;  // nodes of the free boundary: a probe can touch them (mesh.nnode)
    // Places on the organ's surface of nodes of the skin, m   (mesh.nnode x 3)
    double* skin_x;
    uint64_t hash;  // of all of this
} OmUmeshGrid;

OM_API void om_umesh_grid_done(OmUmeshGrid* grid);

/// The probe's face: where it is pressed, and how much of the surface it takes along.
typedef struct OmUmeshPatch {
    OmVec3 center;  // on the organ's surface, m
    OmVec3 normal;  // outward there, unit
    OmVec3 along;   // of the long side, unit, across the normal
    double size
        [3];  // long side, short side, m; and how far from the plane of the face a point may be, either way
} OmUmeshPatch;

/// The face of the thesis's probe, 50 x 10 mm, points within 10 mm of its plane.
OM_API OmUmeshPatch om_umesh_default_patch(OmVec3 center, OmVec3 normal, OmVec3 along);
/// Nodes of the skin whose place on the surface lies under the patch: those that it moves.
/// @param mask  1 where they are (mesh.nnode)
/// @return their number
OM_API int om_umesh_select_patch(const OmUmeshGrid* grid, const OmUmeshPatch* patch,
                                 unsigned char* mask);

/// From nodes to points, one component after the other: out[c npoint + point]; 0 at points that are no node, or
/// where `mask` (mesh.nnode; may be null) is 0.
/// @param u    (mesh.nnode x 3)
/// @param out  (3 x npoint)
OM_API void om_umesh_scatter(const OmUmeshGrid* grid, const float* u, const unsigned char* mask,
                             float* out);
/// And back.
OM_API void om_umesh_gather(const OmUmeshGrid* grid, const float* in, float* u);

// ---- the organ --------------------------------------------------------------------------------------

typedef struct OmUmeshOrganDef {  // made by om_umesh_default_organ_def
    // A patient of one material, borrowed until create returns; null (default): the phantom, a half
    // ellipsoid of 150 x 120 x 72 mm on its flat side.
    const OmPatient* patient;
    const OmSurface* surface;  // or a closed surface; borrowed; default null
    OmVec3 up;                 // away from what holds the organ; default 0: the patient's, else +z
    int nelem;       // active elements wanted, met within 1 % from 200 on; default 2174 (thesis)
    double spacing;  // of the grid, m; default 0: by nelem
    int dim[3];      // points of the padded grid at least; default 0: as few as there can be
    int multiple;  // dim are multiples of this, the longest of twice this; default 4, for a U-Net of 3 levels
    // An element is active if this part of its volume is inside the organ, in (0, 1); default 0.5.
    double min_fill;
    // Nodes in this lowest part of the height are held; 0 (default): the patient's set
    // "attachment", without one the lowest nodes (phantom) or the lowest tenth (other organs).
    double held_height;
    uint32_t cookie;
} OmUmeshOrganDef;

/// An organ in its grid, and its surface.
typedef struct OmUmeshOrgan OmUmeshOrgan;

OM_API OmUmeshOrganDef om_umesh_default_organ_def(void);
/// Cells with enough inside become elements, of which the largest part that hangs together over faces stays.
/// @return OM_OK, OM_INVALID (nothing inside, nothing held, an element count that no spacing gives), OM_NO_MEMORY
OM_API OmStatus om_umesh_create_organ(const OmUmeshOrganDef* def, OmUmeshOrgan** organ);
OM_API void om_umesh_destroy_organ(OmUmeshOrgan* organ);
OM_API const OmUmeshGrid* om_umesh_grid(const OmUmeshOrgan* organ);
OM_API const OmSurface* om_umesh_surface(const OmUmeshOrgan* organ);

// ---- data -------------------------------------------------------------------------------------------

/// How samples are drawn and solved. A patch is centred on a random point of the free surface, turned at random
/// about the normal. Either its nodes share a force, |f| uniform in [0, max_force], whose direction is the
/// inward normal tilted by an angle uniform in [-max_tilt, max_tilt] about a random tangent (Algorithm 2 with
/// its line 9 put right), or the probe moves them all along such a direction, by a way uniform in [0, max_press].
/// With 1800 Pa 0.8 N reach the thesis's deformations of the phantom; the network's task, displacements from
/// displacements, does not depend on Young's modulus.
typedef struct OmUmeshDataDef {  // made by om_umesh_default_data_def
    const OmUmeshOrgan* organ;   // borrowed
    const char* out_dir;         // borrowed
    int nsample;                 // default 1000
    uint64_t seed;               // default 1
    // Default: neo-Hookean with the patient's modulus and Poisson's ratio; without a patient 1800
    // Pa and 0.45.
    OmMaterial material;
    double max_force;    // N, default 0.8
    double max_tilt;     // rad, default 45 degrees
    double press_share;  // of samples that the probe moves instead; default 0.5
    // m, default 0.035; never more than 0.6 of the distance to the nearest held node.
    double max_press;
    double pull_share;     // of samples that are drawn outwards; default 0
    double patch_size[3];  // OmUmeshPatch.size, m; default 0.05, 0.01, 0.01
    int min_patch;         // nodes of a patch at least, else it is redrawn; default 4
    double tolerance;      // of the residual, relative to loads and reactions; default 1e-5
    double min_volume;     // least det F of a sample; default 0.05
    int max_attempt;       // draws of one sample; default 64
    int shard;             // samples of a file; default 100
    int npicture;          // of the report; default 4
    int nworker;           // default 0: one a processor
    uint32_t cookie;
} OmUmeshDataDef;

typedef struct OmUmeshSample {  // what is known of a sample besides displacements
    OmUmeshPatch patch;
    OmVec3 force;       // resultant on the patch, N
    OmVec3 direction;   // unit, of the force or the way
    double tilt;        // between it and the normal, rad
    double press;       // way of the probe, m; 0: a force was applied
    int npatch;         // nodes
    int nattempt;       // draws: 1 and those that failed
    int nfail;          // of which solves without a valid equilibrium
    int nnewton;        // Newton iterations of the last draw
    double residual;    // relative
    double min_volume;  // least det F
    double max_u;       // largest displacement of a node, m
    double seconds;     // wall clock; not stored
} OmUmeshSample;

/// What solves need; not to be used by two threads at once.
typedef struct OmUmeshSolver OmUmeshSolver;

OM_API OmUmeshDataDef om_umesh_default_data_def(const OmUmeshOrgan* organ, const char* out_dir);
/// The solver that makes samples: grid, linear system, scratch.
/// @return OM_OK; OM_INVALID (the message names the field); OM_NO_MEMORY
OM_API OmStatus om_umesh_create_solver(const OmUmeshDataDef* def, OmUmeshSolver** solver);
OM_API void om_umesh_destroy_solver(OmUmeshSolver* solver);
/// Sample `index` of the seed of the definition.
/// @param mask  nodes of the patch (mesh.nnode)
/// @param u     displacements, m (mesh.nnode x 3)
/// @return OM_OK, OM_NOT_CONVERGED (no draw succeeded), OM_NO_MEMORY
OM_API OmStatus om_umesh_make_sample(OmUmeshSolver* solver, int64_t index, OmUmeshSample* sample,
                                     unsigned char* mask, double* u);
/// Displacements of all nodes when those of the mask are moved as u says and the rest is free: the reference.
/// @param u  in: at masked nodes; out: everywhere, m (mesh.nnode x 3)
/// @return OM_OK, OM_NOT_CONVERGED (u is not changed), OM_INVALID, OM_NO_MEMORY
OM_API OmStatus om_umesh_solve(OmUmeshSolver* solver, const unsigned char* mask, double* u,
                               OmFemReport* report);

typedef struct OmUmeshSummary {
    int nsample, nmade;    // in the folder; made by this call
    int nattempt, nfail;   // of all samples
    double max_u, mean_u;  // largest displacement of a node; mean of samples' largest, m
    double max_force;      // largest resultant, N
    double seconds;        // of this call
    double solve_seconds;  // mean of the samples made by this call, of one worker
} OmUmeshSummary;

/// Make the data set, or what is missing of it: shards samples_NNNNNN.h5 (the number of their first sample), each
/// whole or not at all, summary.json and report.html. The same bytes for any number of workers.
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
OM_API OmStatus om_umesh_load_data(const char* dir, int max_sample, OmUmeshData* data);
OM_API void om_umesh_data_done(OmUmeshData* data);

#ifdef __cplusplus
}
#endif
#endif
