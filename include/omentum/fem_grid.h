/// omentum/fem_grid.h: bodies made of equal cubes, and fast equilibrium on them (room `fem`, floor 2).
///
/// The elements are active cells of a regular grid. All are alike, so the shape functions are one table, the organ's
/// compliance at rest is computed once, and coarse corrections need no assembly. One law: the compressible neo-Hookean
/// W = mu/2 (F:F - 3 - 2 ln J) + lambda/2 (ln J)^2. Loads are prescribed displacements of a patch of nodes; fixed nodes
/// stay; every other node is free of load. The result does not depend on mu.
///
///     om_fem_grid_init(&points, active, &grid);                      // then set grid.fixed
///     om_fem_grid_linear_create(&grid, is_surface, 0.45, 0, &linear);  // linear elasticity: a few ms a solve
///     om_fem_grid_linear_solve(linear, mask, u_patch, 0, u);
///     om_fem_grid_model_create(&grid, 0.45, 0, &model);              // large deformations, from a guess u
///     om_fem_grid_work_create(model, &work);
///     om_fem_grid_solve(work, &patch, mask, &stop, u, &report);
#ifndef OMENTUM_FEM_GRID_H
#define OMENTUM_FEM_GRID_H

#include "omentum/fem.h"
#include "omentum/math_grid.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- the grid -----------------------------------------------------------------------------------------

/// Nodes are the points that are corners of active cells, in the order of points; elements are the active cells, in the
/// order of cells. A cell has the index of its lowest point.
///
///     points  0 1 2 3 4 5 6 7     x  point without a node
///             x x o-o-o-o x x     o  node
///             x o-o-o-o-o-o x     -  edge of an element
typedef struct OmFemGrid {  // om_fem_grid_done frees
    OmGrid grid;            // of the points
    int npoint;             //
    OmFemMesh mesh;         // OM_HEX8; rest positions of the nodes
    int* cell_elem;         // element of a cell, or -1                                    (npoint)
    int* point_node;        // node at a point, or -1                                      (npoint)
    int* node_point;        // point of a node                                         (mesh.nnode)
    unsigned char* fixed;   // 1: the node does not move; 0 after init                 (mesh.nnode)
} OmFemGrid;

/// The grid of the active cells.
/// @param points  at most INT_MAX / 24 of them, at least 1 along each axis; spacing > 0
/// @param active  1 for each active cell, else 0 (number of points)
/// @return OM_OK; OM_INVALID (points or `active` out of range: the message names the field; no active cell, or one on
///         the upper border of the grid); OM_NO_MEMORY
OM_API OmStatus om_fem_grid_init(const OmGrid* points, const unsigned char* active,
                                 OmFemGrid* grid);
/// Cubes of side `spacing` that overlap the inside of the field, which is sampled at its own spacing (thesis 3.6). The
/// grid starts at the lowest corner of the inside, less half a cell on average.
/// @return OM_OK; OM_INVALID (no cell is inside, or too many cells); OM_NO_MEMORY
OM_API OmStatus om_fem_grid_from_sdf(const OmSdf* sdf, double spacing, OmFemGrid* grid);
OM_API void om_fem_grid_done(OmFemGrid* grid);
/// The grid as tetrahedra, six for each element, for files, pictures and other engines. Vertices are nodes; the set
/// "attachment" has the fixed nodes. om_tet_mesh_done frees it.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_fem_grid_make_tet_mesh(const OmFemGrid* grid, OmTetMesh* mesh);

// ---- linear elasticity --------------------------------------------------------------------------------

/// The compliance of the body at rest: displacements of all nodes for unit forces on the nodes that a patch may
/// prescribe. Constant after create, may be shared between threads.
typedef struct OmFemGridLinear OmFemGridLinear;

typedef struct OmFemGridPatch {  // prescribed nodes; om_fem_grid_patch_done frees
    int num;                     // their unknowns
    double* factor;              // Cholesky factor of the patch's compliance     (num x num)
    const float** column;        // their columns of the compliance, borrowed           (num)
    int* dof;                    // 3 * node + component                                (num)
} OmFemGridPatch;

/// @param is_surface  1 for each node that a patch may prescribe (mesh.nnode); fixed nodes must be 0
/// @param poisson     Poisson's ratio, above -1 and below 0.5
/// @param nworker     threads, 0: one per processor
/// @return OM_OK; OM_INVALID (`poisson` out of range, no fixed node, or a compliance of more than 2 GiB); OM_NO_MEMORY
OM_API OmStatus om_fem_grid_linear_create(const OmFemGrid* grid, const unsigned char* is_surface,
                                          double poisson, int nworker, OmFemGridLinear** linear);
OM_API void om_fem_grid_linear_destroy(OmFemGridLinear* linear);
/// Factor the patch of the masked surface nodes. It is empty if there are none, or more than 1,024.
/// @param linear  borrowed until om_fem_grid_patch_done
/// @param mask    1 for each prescribed node (mesh.nnode)
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_fem_grid_patch_init(const OmFemGridLinear* linear, const unsigned char* mask,
                                       OmFemGridPatch* patch);
OM_API void om_fem_grid_patch_done(OmFemGridPatch* patch);
/// Displacements of all nodes if the patch's nodes have the displacements u; zero for an empty patch.
/// @param u    m, read at the patch's nodes (mesh.nnode x 3)
/// @param out  m (mesh.nnode x 3)
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_fem_grid_linear_eval(const OmFemGridLinear* linear, const OmFemGridPatch* patch,
                                        const float* u, int nworker, float* out);
/// The same for a patch that is used once.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_fem_grid_linear_solve(const OmFemGridLinear* linear, const unsigned char* mask,
                                         const float* u, int nworker, float* out);

// ---- large deformations -------------------------------------------------------------------------------

/// Tables of the elements and the inverse of the coarse stiffness. Constant after create, may be shared between
/// threads.
typedef struct OmFemGridModel OmFemGridModel;
/// Memory for solves, for one thread at a time.
typedef struct OmFemGridWork OmFemGridWork;

typedef struct OmFemGridStop {  // when a solve ends
    double tolerance;           // of the estimated mean distance to equilibrium, m
    int max_cycle;              // 0: u is not changed
    int nworker;                // threads, 0: one per processor; the result does not depend on it
} OmFemGridStop;

typedef struct OmFemGridReport {
    int ncycle;         // cycles made; with 0 the other fields are 0
    double left;        // estimated mean distance to equilibrium, m
    double min_volume;  // smallest det F at a Gauss point; not above 0: an element is inverted
} OmFemGridReport;

/// @param grid     borrowed
/// @param poisson  Poisson's ratio, above -1 and below 0.5
/// @return OM_OK; OM_UNAVAILABLE (more than 3,800 points of twice the spacing); OM_INVALID (`poisson` out of range, or
///         no fixed node); OM_NO_MEMORY
OM_API OmStatus om_fem_grid_model_create(const OmFemGrid* grid, double poisson, int nworker,
                                         OmFemGridModel** model);
OM_API void om_fem_grid_model_destroy(OmFemGridModel* model);
/// @param model  borrowed
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_fem_grid_work_create(const OmFemGridModel* model, OmFemGridWork** work);
OM_API void om_fem_grid_work_destroy(OmFemGridWork* work);
/// Size in bytes.
OM_API size_t om_fem_grid_work_memory(const OmFemGridWork* work);
/// Relax a guess towards equilibrium; masked and fixed nodes do not move. Inverted elements in the guess are allowed.
/// @param patch  of the masked nodes
/// @param mask   1 for each prescribed node (mesh.nnode)
/// @param u      in: the guess, with the prescribed displacements; out: the result, m (mesh.nnode x 3)
/// @return OM_OK, also where `left` is above the tolerance; OM_NO_MEMORY
OM_API OmStatus om_fem_grid_solve(OmFemGridWork* work, const OmFemGridPatch* patch,
                                  const unsigned char* mask, const OmFemGridStop* stop, float* u,
                                  OmFemGridReport* report);

/// Norm of the residual forces at free nodes, divided by mu V / 8 with V the volume of a cell, for n displacements.
/// @param mask  1 for each prescribed node (n x mesh.nnode)
/// @param u     m (n x mesh.nnode x 3)
/// @param norm  1/m (n)
/// @return OM_OK; OM_INVALID (`poisson` out of range); OM_NO_MEMORY
OM_API OmStatus om_fem_grid_eval_residual(const OmFemGrid* grid, double poisson, int n,
                                          const unsigned char* mask, const float* u, double* norm);
/// Nodal forces of second order in u, over mu spacing^2, times spacing / size (mesh.nnode x 3).
/// @param poisson  above -1 and below 0.5; not checked
/// @param size  scale of the displacements, m, > 0
OM_API void om_fem_grid_second_order(const OmFemGrid* grid, double poisson, double size,
                                     const float* u, float* force);

// ---- tetrahedra without inversion ---------------------------------------------------------------------

typedef struct OmFemGridUntangling {
    int ninverted;      // tetrahedra that were inverted before
    int nmoved;         // nodes moved by more than 0.01 mm
    double max, mean;   // displacement by untangling: largest, and mean over all nodes, m
    double min_volume;  // smallest det F of a tetrahedron afterwards
} OmFemGridUntangling;

/// Move nodes until no tetrahedron of om_fem_grid_make_tet_mesh is inverted, for files and pictures. At equilibrium
/// det F is above 0 at the Gauss points of an element, but a corner may be folded. Masked and fixed nodes stay;
/// displacements without inverted tetrahedra are not changed.
/// @param mask  1 for each prescribed node (mesh.nnode)
/// @param u     in/out: m (mesh.nnode x 3)
/// @return OM_OK; OM_NOT_CONVERGED (no valid shape was found: u is not changed, only `ninverted` is set); OM_INVALID
///         (`poisson` out of range); OM_NO_MEMORY
OM_API OmStatus om_fem_grid_untangle(const OmFemGrid* grid, double poisson,
                                     const unsigned char* mask, float* u,
                                     OmFemGridUntangling* untangling);

#ifdef __cplusplus
}
#endif
#endif
