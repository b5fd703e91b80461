// study_attach_protocol.h: the protocol of thesis 4.3, common to Tables 4.1, 4.2 and 4.3.
//
// A body is deformed by the displacement of its grasped vertices, with a set of attached vertices held still, and the
// result is compared with the truth at every vertex of the volume. The attached set is compared with the true one.
//
//     AttachModelDef def = om__attach_model_default_def(&mesh, material);
//     om__attach_model_create(&def, &model);
//     AttachMove move = {.ngrasp = n, .grasp = vert, .goal = position, .attached = attached};
//     om__attach_model_solve(model, &move, x, &solve);    // x: deformed; solve.is_converged
//     om__attach_error(mesh.nvert, x, truth, &ave, &mve);
#ifndef OMENTUM_STUDY_ATTACH_PROTOCOL_H
#define OMENTUM_STUDY_ATTACH_PROTOCOL_H

#include "omentum/fem.h"
#include "omentum/report.h"
#include "studies/study_match.h"

// ---- the deformed body ------------------------------------------------------------------------------

typedef struct AttachModelDef {  // made by om__attach_model_default_def
    // Borrowed until create returns. Of quadratic elements its vertices are the nodes, as in om_fem_mesh_from_nodes.
    const OmTetMesh* mesh;
    // Nodes of each element (mesh->ntet / 8 x 10), borrowed likewise; null (default): linear elements.
    const int* node;
    OmMaterial material;
    // m/s^2; default none, as in the thesis. Attached vertices stay where the mesh has them
    OmVec3 gravity;
    double density;    // kg/m^3; default 1000; of no effect without gravity
    double tolerance;  // of OmFemStaticDef; default 1e-4
    int nstep;         // load steps at first; default 4
    int nworker;       // default 1
} AttachModelDef;

typedef struct AttachMove {
    int ngrasp;
    const int* grasp;    // grasped vertices of the mesh                               (ngrasp)
    const double* goal;  // where they are in the end, m                            (ngrasp x 3)
    // nonzero: held at rest; a vertex that is also grasped follows the grasp; null: none  (nvert)
    const unsigned char* attached;
} AttachMove;

typedef struct AttachSolve {
    bool is_converged;  // false: x is the equilibrium at `load`, with the grasp part of the way
    bool is_loose;      // prescribed vertices on a line or fewer: springs hold the body, see the .c
    double load;        // share of the grasp's way
    double min_volume;  // smallest det F
    double ms;          // processor time of the calling thread
    int nnewton;
    char reason[160];  // why load 1 was not reached; "" if it was
} AttachSolve;

// A body prepared for many solves, for one thread at a time.
typedef struct AttachModel AttachModel;

AttachModelDef om__attach_model_default_def(const OmTetMesh* mesh, OmMaterial material);
OmStatus om__attach_model_create(const AttachModelDef* def, AttachModel** model);
// Quadratic elements with the tetrahedra of `mesh`; nodes have the numbers of OmMatchView.mesh.
OmStatus om__attach_model_create_bending(const OmTetMesh* mesh, OmMaterial material,
                                         AttachModel** model);
void om__attach_model_destroy(AttachModel* model);
// x: out, m (nvert x 3). OM_OK, also if not converged: `solve` says so. OM_INVALID: no vertex is grasped, or an index
// or a goal is not valid; OM_NO_MEMORY.
OmStatus om__attach_model_solve(AttachModel* model, const AttachMove* move, double* x,
                                AttachSolve* solve);

// Processor time of the calling thread, ms.
double om__attach_thread_ms(void);

// ---- scores -----------------------------------------------------------------------------------------

// (4.3) and (4.6) of n vertices or cells by `weight`, for example areas; null: by number. Without a true one both are
// 0.
void om__attach_score(int n, const double* weight, const unsigned char* found,
                      const unsigned char* truth, double* dsc, double* tpr);
// The same over cells: a cell is attached if one of its vertices is. Vertices of cell -1 do not count.
OmStatus om__attach_score_cells(int n, const int* cell, const unsigned char* found,
                                const unsigned char* truth, double* dsc, double* tpr);
// (4.5) and (4.7) of n points: mean and largest distance, m.
void om__attach_error(int n, const double* x, const double* truth, double* ave, double* mve);
// A third of the area of the triangles around each vertex, m^2.
void om__attach_areas(const OmSurface* surface, double* area);

#endif
