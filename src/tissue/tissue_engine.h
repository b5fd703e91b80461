// tissue_engine.h: what an engine is, and the inside of model, state and work that engines see.
//
// An engine of the matrix kind fills `assemble`: it writes A and b of A dv = b at the state's positions;
// tools, attachments, contact and the solve are done above it, alike for all. An engine that moves
// vertices its own way (position based dynamics, a network) fills `step` instead and leaves `assemble`
// null. Engines register by a line in the table of tissue_model.c, or by OmTissueDef.custom.
#ifndef OMENTUM_TISSUE_ENGINE_H
#define OMENTUM_TISSUE_ENGINE_H

#include "omentum/tissue.h"

/// What an engine is to assemble: A = mass M + stiffness K + spring k, b = force f(x + lag v) to first order.
typedef struct OmAssembly {
    const double *x, *v;  // (nvert x 3)
    double mass;          // of masses: 1 + h a, 0 at rest
    double stiffness;     // of K: h^2 + h b
    double force;         // of all forces: h
    double lag;           // s, of elastic forces: h + b
    double spring;        // of the springs of attachments: h^2
    double spring_lag;    // s, of their forces: h
    bool is_exact;        // the tangent as it is; else its negative eigenvalues are zero
    bool is_turned;  // of the corotational law with the same constants, forces too: a predictor
} OmAssembly;

typedef struct OmTissueCheck {  // what a step does to the elements
    int ncrushed;               // flattened or inverted farther than a step may leave them
    int nbarrier;               // of these, elements whose law resists it without bound
    int ninverted;              // det F <= 0 at its end
    double elastic_begin;       // J, in floats: off by about 1e-7 of sum V mu
    double elastic_end;
} OmTissueCheck;

typedef struct OmTissueEngine {
    const char* name;
    bool has_matrix;  // work gets A and a solver
    // Attachments may be springs: the engine reads om__state_stiffness. False: springs are refused.
    bool has_springs;
    /// Make model->data from the checked model->mesh and model->def.
    OmStatus (*create)(OmTissueModel* model);
    void (*destroy)(OmTissueModel* model);
    /// Make work->data; both may be null.
    OmStatus (*create_work)(const OmTissueModel* model, OmTissueWork* work);
    void (*destroy_work)(OmTissueWork* work);
    /// w->A and w->b.
    OmStatus (*assemble)(const OmTissueModel* model, const OmTissueState* state, OmTissueWork* work,
                         const OmAssembly* at);
    /// A whole step, tools and obstacles included; null for engines of the matrix kind. It leaves in OM__F_TOOL
    /// what holds each prescribed vertex, by a tool or an attachment, and in OM__F_TOUCH what obstacles push.
    OmStatus (*step)(const OmTissueModel* model, OmTissueState* state, OmTissueWork* work, double h,
                     int nobstacle, OmTissueObstacle* obstacle, OmTissueReport* report);
    /// For engines that take meshes without elements: masses of their vertices; else null.
    OmStatus (*lump_mass)(const OmTissueModel* model, double* mass);
    /// Bytes behind the state's arrays that are the engine's, and how they follow from positions that were
    /// set from outside; both may be null.
    size_t (*get_state_size)(const OmTissueModel* model);
    void (*sync_state)(const OmTissueModel* model, OmTissueState* state);
    /// Elastic forces at x in double. With a mask only those of its vertices count: added to *sum, and
    /// to force (nvert x 3) unless it is null. May be null with `step`, as may all that follow.
    OmStatus (*add_internal_force)(const OmTissueModel* model, const double* x,
                                   const unsigned char* mask, double* force, OmVec3* sum);
    OmStatus (*get_measure)(const OmTissueModel* model, const double* x, OmTissueMeasure measure,
                            double* value);
    OmStatus (*get_energy)(const OmTissueModel* model, const double* x, double* energy);  // J
    /// The same forces and energy for Newton's method: by all workers, force (nvert x 3) overwritten.
    OmStatus (*eval_balance)(const OmTissueModel* model, OmTissueWork* work, const double* x,
                             double* force, double* energy);
    /// What a step from x_begin to x_end does to the elements; null where nothing is guarded.
    void (*check)(const OmTissueModel* model, const OmTissueWork* work, const double* x_begin,
                  const double* x_end, bool is_solved, OmTissueCheck* check);
    /// Bytes of model->data and work->data.
    size_t (*get_memory)(const OmTissueModel* model, const OmTissueWork* work);
} OmTissueEngine;

struct OmTissueModel {
    const OmTissueEngine* engine;
    void* data;       // the engine's own
    OmTissueDef def;  // its pointers are not used, but for `material`, which is a copy
    OmTetMesh mesh;
    double* mass;    // kg                                                        (nvert)
    double* volume;  // of elements at rest, m^3                                  (ntet)
    int nsurface;
    int* surface_vert;      // vertices of the boundary, ascending                (nsurface)
    const OmMeshSet* held;  // set "attachment", or null
    double size;            // diagonal of the bounding box, m
    double total_mass;      // kg
    double total_mu;        // J, sum of V mu over elements
};

#define OM__MAX_STIFFNESS 1e9  // N/m, of the spring of an attached vertex

typedef struct OmTissueArm {
    int32_t nheld;  // 0: the arm holds nothing
    int32_t reserved;
    OmPose pose;  // now
    OmPose goal;  // at the end of the next step
} OmTissueArm;

struct OmTissueState {  // head of the block; arrays follow, nothing in it is a pointer
    uint64_t size;      // bytes before the stiffness of attachments, the last array
    int32_t nvert;
    int32_t
        is_own_stiffness;  // 1: some attachment's stiffness is not the model's; then it is hashed
    double time;           // s
    OmTissueArm arm[OM_MAX_ARM];
};

enum {            // arrays of 3 doubles a vertex, in this order behind the head
    OM__X,        // positions
    OM__V,        // velocities
    OM__F_EXT,    // external forces, by the caller
    OM__F_TOOL,   // by tools, computed by end_step or the engine's own step
    OM__F_TOUCH,  // by contact, written by the contact method
    OM__ANCHOR,   // where attached vertices are drawn to
    OM__GRIP,     // place in the frame of the tool that holds the vertex
    OM__NARRAY3  // then bytes: attached (nvert), held_by (nvert); the engine's; doubles: stiffness (nvert)
};
#define OM__STATE_HEAD 320  // bytes of the head, room to grow, a multiple of 64

static inline double* om__state_array(const OmTissueState* s, int k) {
    return (double*)((char*)(uintptr_t)s + OM__STATE_HEAD) + 3 * (size_t)s->nvert * (size_t)k;
}
static inline unsigned char* om__state_attached(const OmTissueState* s) {
    return (unsigned char*)om__state_array(s, OM__NARRAY3);
}
static inline signed char* om__state_held_by(const OmTissueState* s) {
    return (signed char*)om__state_attached(s) + s->nvert;
}
/// Bytes of a state before those of the engine.
static inline size_t om__state_size(int nvert) {
    size_t size = OM__STATE_HEAD + (size_t)nvert * (OM__NARRAY3 * 3 * sizeof(double) + 2);
    return (size + 63) / 64 * 64;
}
static inline void* om__state_engine(const OmTissueState* s) {
    return (char*)(uintptr_t)s + om__state_size(s->nvert);
}
/// Of the spring of each attached vertex, N/m; 0 where a vertex is held still or not attached.
static inline double* om__state_stiffness(const OmTissueState* s) {
    return (double*)((char*)(uintptr_t)s + s->size);
}
/// Bytes of the whole block.
static inline size_t om__state_bytes(const OmTissueState* s) {
    return (s->size + (size_t)s->nvert * sizeof(double) + 63) / 64 * 64;
}
/// Is the vertex attached without a spring?
static inline bool om__is_held_still(const OmTissueState* s, int i) {
    return om__state_attached(s)[i] && om__state_stiffness(s)[i] <= 0;
}
/// Is the vertex moved by a tool or held still, rather than by forces?
static inline bool om__is_prescribed(const OmTissueState* s, int i) {
    return om__state_held_by(s)[i] >= 0 || om__is_held_still(s, i);
}

typedef struct OmTissuePoint {  // a force on a point inside an element
    int vert[4];
    double weight[4];
    OmVec3 f;       // N
    OmMat3 K;       // N/m
    bool has_K;     // not zero
    int block[16];  // of A, if so
} OmTissuePoint;

typedef struct OmTissueUndo {  // a block of A before it was changed
    int block;
    float value[9];
} OmTissueUndo;

struct OmTissueWork {
    int nvert;
    const OmTissueEngine* engine;
    void* data;  // the engine's own
    OmBsr A;
    OmSolver* solver;
    double h;            // s, of the step begun; 0 outside a step
    double share;        // of the way to the tools' goals that this step goes; 1 unless it was cut
    bool is_fresh;       // no solve since begin_step
    bool is_stale;       // A is another one than at the solver's last refresh
    bool is_changed;     // forces changed A since then: diagonal blocks are enough
    unsigned char* key;  // vertices prescribed at the last set_fixed                (nvert)
    unsigned char* fixed;     // the same a degree of freedom                          (nvert x 3)
    double* b;                // by assemble                                           (nvert x 3)
    double* rhs;              // b with what was added                                 (nvert x 3)
    double* dv;               // the solution                                          (nvert x 3)
    int nextra;               // vertices with added forces
    int* extra;               //                                                       (nvert)
    unsigned char* is_extra;  //                                                    (nvert)
    OmVec3* extra_f;          // N                                                  (nvert)
    OmMat3* extra_K;          // N/m                                                (nvert)
    float* extra_diag;        // diagonal blocks of A without them                  (nvert x 9)
    int npoint, max_point;    // forces on points, tissue_point.c
    OmTissuePoint* point;     //                                                    (max_point)
    int nundo;                // blocks of A that they changed
    OmTissueUndo* undo;       //                                                    (max_point x 16)
    OmPose next[OM_MAX_ARM];  // tools at the end of the step begun
    bool is_static;           // a body at rest is sought: no inertia, h is 1
    double force_scale;       // N, that solves are measured against besides b
    double reference;         // norm that a solve is measured against; 0: as it sees fit
    double *x_end, *v_end;    // where the step would end                          (nvert x 3)
    double *from, *trial, *start;  // velocity changes of Newton's method               (nvert x 3)
    double* elastic;               // elastic force at the last one looked at, N        (nvert x 3)
    double* refine;                // of tissue_refine.c, null where A is the tangent
    void* backup;                  // a state, for steps that are cut
};

// ---- tissue_newton.c ------------------------------------------------------------------------------

typedef struct OmNewton {
    double tolerance;    // of the norm of what is left
    double scale;        // that norm's unit; 0: what is left at the beginning
    int max_iterations;  //
    bool predicts;       // begin with the corotational law
    OmTissueStepFn fn;   // solves a linearised problem with contact; null: om_tissue_solve_step
    void* ctx;           //
    // out: the residual is at the level of rounding; shorter steps do not help
    bool is_at_floor;
} OmNewton;

/// From the step begun and, unless at rest, solved: w->dv to Newton's solution.
/// @return OM_OK; OM_NOT_CONVERGED (w->dv is the last iterate); errors of the solve
OmStatus om__newton(const OmTissueModel* model, OmTissueState* state, OmTissueWork* work,
                    OmNewton* newton, OmTissueReport* report);
/// Of the step begun and solved once: the norm that its solution had to bring to zero.
double om__newton_scale(const OmTissueModel* model, OmTissueWork* work);

// ---- tissue_guard.c -------------------------------------------------------------------------------

typedef struct OmGuard {  // the outcome of a step, held against what a step may do
    bool is_bad;          // elements are crushed, or energy came out of nothing
    int ncrushed;         // as in OmTissueCheck
    int nbarrier;         //
    int ninverted;        //
    double gain;          // J, rise of the energy beyond the work done on the tissue
    double bound;         // J, the gain that a step may have
} OmGuard;

/// Judge the velocity change w->dv of the step begun. w->x_end, w->v_end and w->elastic are overwritten.
/// @param share      of the whole step that this one is: so much of the slack belongs to it
/// @param is_solved  by Newton's method: then elements may be as flat as it finds them
OmGuard om__guard_step(const OmTissueModel* model, const OmTissueState* state, OmTissueWork* work,
                       double share, bool is_solved);
/// The same of elements alone, for any velocity change: would it crush one? w->x_end is overwritten.
bool om__is_crushing(const OmTissueModel* model, const OmTissueState* state, OmTissueWork* work,
                     const double* dv);
/// OM_INVALID, with a message that says what is wrong.
OmStatus om__guard_refuse(const OmGuard* guard);
/// Row i of A times dv.
OmVec3 om__apply_row(const OmBsr* A, const double* dv, int i);

// ---- tissue_refine.c ------------------------------------------------------------------------------

OmStatus om__refine_create(OmTissueWork* work);
/// As om_tissue_solve_step for the problem linearised at work->from, whose x_end is the last one looked at, with
/// the tangent of the forces themselves.
OmStatus om__refine(const OmTissueModel* model, const OmTissueState* state, OmTissueWork* work,
                    OmTissueReport* report);

// ---- tissue_point.c -------------------------------------------------------------------------------

/// Forces on points into A and rhs, and out of A again.
void om__points_apply(const OmTissueState* state, OmTissueWork* work);
void om__points_undo(OmTissueWork* work);

#endif
