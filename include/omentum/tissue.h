/// omentum/tissue.h: one interface to soft tissue, whatever computes it (floor 2).
///
/// An *engine* is a table of operators: internal force, system matrix, solve. Above it this room has what
/// every tissue shares: attachments, grasps, the implicit Euler step (thesis 3.3-3.6), forces in newtons.
/// A model never changes; a state is one block (snapshot: memcpy); a workspace is scratch.
///
///     OmTissueDef def = om_tissue_default_def(om_fem_engine(), &mesh);
///     OmTissueModel* m;      om_tissue_create_model(&def, &m);
///     OmTissueState* s;      om_tissue_create_state(m, &s);
///     OmTissueWorkspace* w;  om_tissue_create_workspace(m, &w);
///     om_tissue_grasp(m, s, 0, pose_world_tip, 0.005, &nheld);
///     om_tissue_move_grasp(m, s, 0, next_pose);
///     om_tissue_step(m, s, w, 0.02, &report);
#ifndef OMENTUM_TISSUE_H
#define OMENTUM_TISSUE_H

#include "omentum/shape.h"
#include "omentum/solve.h"
#include "omentum/vec.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_TISSUE_NARM 2
#define OM_TISSUE_MAX_MATERIAL 16

typedef struct OmTissueEngine OmTissueEngine;
typedef struct OmTissueModel OmTissueModel;
typedef struct OmTissueWorkspace OmTissueWorkspace;

typedef struct OmTissueMaterial {
    int label;       // elements of this tet_label; the first material also takes labels of no other
    double young;    // Pa, > 0
    double poisson;  // 0 to 0.499
    double density;  // kg/m^3, > 0
} OmTissueMaterial;

typedef struct OmTissueDef {       // made by om_tissue_default_def
    const OmTissueEngine* engine;  // om_fem_engine(), ...
    const OmTetMesh* mesh;         // copied; its set "attachment" is attached at first
    OmTissueMaterial material[OM_TISSUE_MAX_MATERIAL];
    int nmaterial;         // default 1: 3 kPa, 0.45, 1000 kg/m^3 (adipose tissue, thesis 6.4.7)
    double rayleigh_mass;  // 1/s; default 0.1
    double rayleigh_stiffness;  // s; default 0
    OmVec3 gravity;             // m/s^2; default (0, 0, -9.81)
    double
        attachment_stiffness;  // N/m of a spring at each attached vertex; 0 (default) holds it still
    OmSolverDef solver;        // default: multigrid CG to 1e-3
    int nworker;               // 0 (default): one a processor
    uint32_t cookie;
} OmTissueDef;

/// Everything that changes; one block of om_tissue_state_size bytes. Arrays are views into it.
typedef struct OmTissueState {
    double time;                   // s
    OmPose grasp[OM_TISSUE_NARM];  // pose_world_tip the grasped vertices follow
    int ngrasped[OM_TISSUE_NARM];  // vertices held by each arm
    double* x;                // vertex positions, m                                   (nvert x 3)
    double* v;                // vertex velocities, m/s                                (nvert x 3)
    double* f_ext;            // forces added by the caller, N; cleared by a step      (nvert x 3)
    double* anchor;           // where attachment springs pull to, m                   (nvert x 3)
    double* grasp_local;      // grasped vertices in their tip's frame, m              (nvert x 3)
    unsigned char* attached;  // 1 where attached                                     (nvert)
    unsigned char* holder;    // 0 free, arm + 1 where grasped                        (nvert)
} OmTissueState;

typedef struct OmTissueReport {  // of one step
    int iterations;              // of the linear solver, all substeps and contact rounds
    double residual;             // |b - A x| / |b| in double, the worst
    int substeps;                // 1, or more where the step had to be cut
} OmTissueReport;

// ---- creation -----------------------------------------------------------------------------------------------

OM_API OmTissueDef om_tissue_default_def(const OmTissueEngine* engine, const OmTetMesh* mesh);
/// @return OM_OK; OM_INVALID names the field; OM_NO_MEMORY
OM_API OmStatus om_tissue_create_model(const OmTissueDef* def, OmTissueModel** model);
OM_API void om_tissue_destroy_model(OmTissueModel* model);
OM_API const OmTetMesh* om_tissue_mesh(const OmTissueModel* model);
/// Lumped masses, kg (nvert).
OM_API const double* om_tissue_mass(const OmTissueModel* model);
OM_API OmVec3 om_tissue_gravity(const OmTissueModel* model);
/// Bytes of the model, and of a workspace made for it.
OM_API size_t om_tissue_model_memory(const OmTissueModel* model);
OM_API size_t om_tissue_workspace_memory(const OmTissueWorkspace* workspace);

/// At rest, in the mesh's positions.
OM_API OmStatus om_tissue_create_state(const OmTissueModel* model, OmTissueState** state);
OM_API void om_tissue_destroy_state(OmTissueState* state);
/// Snapshots: copy the whole state to or from another state of the same model, or a plain block.
OM_API size_t om_tissue_state_size(const OmTissueModel* model);
OM_API void om_tissue_save_state(const OmTissueModel* model, const OmTissueState* state,
                                 void* block);
OM_API void om_tissue_restore_state(const OmTissueModel* model, OmTissueState* state,
                                    const void* block);
OM_API uint64_t om_tissue_hash_state(const OmTissueModel* model, const OmTissueState* state);

/// Scratch for steps of one state at a time; used by one thread.
OM_API OmStatus om_tissue_create_workspace(const OmTissueModel* model,
                                           OmTissueWorkspace** workspace);
OM_API void om_tissue_destroy_workspace(OmTissueWorkspace* workspace);

// ---- holding it ----------------------------------------------------------------------------------------------

/// Replace all attachments by these vertices, held where they are now.
OM_API OmStatus om_tissue_set_attachments(const OmTissueModel* model, OmTissueState* state,
                                          const int* vert, int nvert);
/// Hold every free vertex within `radius` m of the tip: they follow it rigidly (6.4.7).
/// @return OM_OK; OM_INVALID: arm, or nothing in reach (the message gives the nearest distance)
OM_API OmStatus om_tissue_grasp(const OmTissueModel* model, OmTissueState* state, int arm,
                                OmPose pose_world_tip, double radius, int* nheld);
/// Where the tip will be at the end of the next step.
OM_API OmStatus om_tissue_move_grasp(const OmTissueModel* model, OmTissueState* state, int arm,
                                     OmPose pose_world_tip);
OM_API void om_tissue_release(const OmTissueModel* model, OmTissueState* state, int arm);

// ---- stepping --------------------------------------------------------------------------------------------------

/// One implicit Euler step, linearised once. A step that cannot be solved is cut in halves, at most
/// OM_TISSUE_MAX_CUT times.
/// @param dt  s, > 0
/// @return OM_OK (also if CG stopped at its iteration limit: see report); negative: state unchanged
OM_API OmStatus om_tissue_step(const OmTissueModel* model, OmTissueState* state,
                               OmTissueWorkspace* ws, double dt, OmTissueReport* report);
#define OM_TISSUE_MAX_CUT 5

// The same in stages, for contact and other methods above. begin: forces and the matrix
// A = (1 + dt a) M + (dt^2 + dt b) K of A dv = b. add: terms of one vertex, replaced by the next clear.
// solve: dv from a zero guess (is_warm: from the last solution). end: v += dv, x += dt v.
OM_API OmStatus om_tissue_begin_step(const OmTissueModel* model, OmTissueState* state,
                                     OmTissueWorkspace* ws, double dt);
OM_API void om_tissue_clear_terms(OmTissueWorkspace* ws);
OM_API void om_tissue_add_term(OmTissueWorkspace* ws, int vert, OmMat3 block, OmVec3 rhs);
OM_API OmStatus om_tissue_solve_step(const OmTissueModel* model, OmTissueWorkspace* ws,
                                     bool is_warm, OmSolveInfo* info);
OM_API OmStatus om_tissue_end_step(const OmTissueModel* model, OmTissueState* state,
                                   OmTissueWorkspace* ws);
/// Velocity change the last solve found, m/s (nvert x 3).
OM_API const double* om_tissue_dv(const OmTissueWorkspace* ws);
/// A third of the trace of the vertex's diagonal block, for automatic penalties.
OM_API double om_tissue_diagonal(const OmTissueWorkspace* ws, int vert);
/// y = A x (nvert x 3), and A x = b for `nrhs` right-hand sides of this step's matrix (nrhs x nvert x 3); held
/// vertices keep the x they are given.
OM_API void om_tissue_apply(const OmTissueModel* model, OmTissueWorkspace* ws, const double* x,
                            double* y);
OM_API OmStatus om_tissue_solve(const OmTissueModel* model, OmTissueWorkspace* ws, int nrhs,
                                const double* b, double* x, OmSolveInfo* info);
/// Where the tips of the grasps are while a step is cut: the share of their way, 0 to 1, that this substep
/// ends at. Set by whoever cuts; 1 otherwise.
OM_API void om_tissue_set_grasp_share(OmTissueWorkspace* ws, double share);

// ---- reading -----------------------------------------------------------------------------------------------------

/// Elastic force of the elements on the vertices at the state's positions, N (nvert x 3).
OM_API void om_tissue_internal_force(const OmTissueModel* model, const OmTissueState* state,
                                     OmTissueWorkspace* ws, double* force);
/// Force that the tool of an arm exerted on its patch in the last step, N: what the held rows of the
/// equations of motion lack (inertia included). Zero if it holds nothing.
OM_API OmVec3 om_tissue_grasp_force(const OmTissueModel* model, const OmTissueState* state,
                                    const OmTissueWorkspace* ws, int arm);
/// Force of the attachments on the tissue, N, from the stresses of the elements (springs: from their
/// length) and the weight of the attached vertices; per vertex into `force` (nvert x 3) if not null.
OM_API OmVec3 om_tissue_attachment_force(const OmTissueModel* model, const OmTissueState* state,
                                         OmTissueWorkspace* ws, double* force);
/// Mass times gravity, N.
OM_API OmVec3 om_tissue_weight(const OmTissueModel* model);
/// Kinetic, gravitational (zero at the origin) and elastic energy, J.
OM_API void om_tissue_energy(const OmTissueModel* model, const OmTissueState* state,
                             OmTissueWorkspace* ws, double* kinetic, double* gravitational,
                             double* elastic);
/// Largest principal stretch less 1 of each element (ntet).
OM_API void om_tissue_stretch(const OmTissueModel* model, const OmTissueState* state,
                              double* stretch);

typedef struct OmEmbedding {  // a point in an element
    int tet;
    double weight[4];  // barycentric
} OmEmbedding;
/// The element that holds, or is nearest to, a point of the rest shape.
OM_API OmEmbedding om_tissue_embed(const OmTissueModel* model, OmVec3 p_rest);
OM_API OmVec3 om_tissue_embedded_point(const OmTissueModel* model, const OmTissueState* state,
                                       OmEmbedding e);

// ---- engines -------------------------------------------------------------------------------------------------------

/// What an engine provides. `data` is its own, made by create from the def.
struct OmTissueEngine {
    const char* name;
    OmStatus (*create)(const OmTissueDef* def, const double* mass, void** data);
    void (*destroy)(void* data);
    OmStatus (*create_scratch)(const void* data, const OmTissueDef* def, void** scratch);
    void (*destroy_scratch)(void* scratch);
    /// Forces at x into `force`, and A = mass_factor M + stiffness_factor K.
    OmStatus (*assemble)(const void* data, void* scratch, const double* x, double mass_factor,
                         double stiffness_factor, double* force);
    void (*force)(const void* data, void* scratch, const double* x, double* force);
    double (*energy)(const void* data, const double* x);
    OmBsr* (*matrix)(void* scratch);
    size_t (*memory)(const void* data);
};

#ifdef __cplusplus
}
#endif
#endif
