// tissue_internal.h: fields of model, state and work, for room tissue and the engines of this floor.
//
// The interface of engines is omentum/tissue_engine.h; engines of other rooms include only that header.
#ifndef OMENTUM_TISSUE_INTERNAL_H
#define OMENTUM_TISSUE_INTERNAL_H

#include "omentum/tissue_engine.h"

struct OmTissueModel {
    const OmTissueEngine* engine;
    void* data;           // the engine's own
    const void* options;  // of the engine: borrowed, or `loaded`
    void* loaded;         // made by engine->load; or null
    OmTissueDef def;      // its pointers are not used, but for `material`, which is a copy
    OmTetMesh mesh;
    int ncorner;            // vertices of the definition's mesh, the first ones
    int nelem, nelem_node;  // elements that couple their nodes; linear: those of the mesh
    int ntet_per;           // tetrahedra of the mesh in each: 1, 8 (quadratic), 6 (shell)
    int* elem_node;         // null: linear elements                       (nelem x nelem_node)
    // vertices at the ends of the edge of each midpoint, or null       ((nvert - ncorner) x 2)
    int* mid_end;
    unsigned char* own;  // of the tissue itself: see OmTissueDef.nown; null: all  (nvert)
    double* mass;        // kg                                                        (nvert)
    double* volume;      // of elements at rest, m^3                                  (ntet)
    int nsurface;
    int* surface_vert;      // vertices of the boundary, ascending                (nsurface)
    const OmMeshSet* held;  // set "attachment", or null
    double* stiffness;      // default stiffness of attachments, N/m        (nvert)
    int nbond;              //
    OmTissueBond* bond;     //                                                     (nbond)
    double size;            // diagonal of the bounding box, m
    double total_mass;      // kg
    double total_mu;        // J, sum of V mu over elements
};

// Of elements that are inverted: the remedy.
#define OM__INVERTED                                                                                \
    "the load is more than its law bears there; law neo-Hookean resists, and a larger grasp, more " \
    "attachments, stiffer tissue or smaller loads help"
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
    // 1: the stiffness of an attachment differs from the model's; the array is then part of the hash
    int32_t is_own_stiffness;
    double time;  // s
    OmTissueArm arm[OM_MAX_ARM];
};

enum {            // arrays of 3 doubles a vertex, in this order behind the head
    OM__X,        // positions
    OM__V,        // velocities
    OM__F_EXT,    // external forces, written by the caller
    OM__F_TOOL,   // forces of tools, computed by end_step or the engine's own step
    OM__F_TOUCH,  // contact forces, written by the contact method
    OM__ANCHOR,   // anchors of attached vertices
    OM__GRIP,     // position in the frame of the tool that grasps the vertex
    OM__NARRAY3  // then bytes: attached (nvert), held_by (nvert); the engine's; doubles: stiffness (nvert)
};
#define OM__STATE_HEAD 320  // bytes of the head, room to grow, a multiple of 64

/// Nodes of the elements (nelem x nelem_node).
static inline const int* om__elem_node(const OmTissueModel* m) {
    return m->elem_node ? m->elem_node : m->mesh.tet_vert;
}
static inline bool om__has_matrix(const OmTissueModel* m) { return m->engine->assemble != NULL; }
static inline double* om__state_array(const OmTissueState* s, int k) {
    return (double*)((char*)(uintptr_t)s + OM__STATE_HEAD) + 3 * (size_t)s->nvert * (size_t)k;
}
static inline unsigned char* om__state_attached(const OmTissueState* s) {
    return (unsigned char*)om__state_array(s, OM__NARRAY3);
}
static inline signed char* om__state_held_by(const OmTissueState* s) {
    return (signed char*)om__state_attached(s) + s->nvert;
}
/// Offset of the engine's bytes in a state.
static inline size_t om__state_size(int nvert) {
    size_t size = OM__STATE_HEAD + (size_t)nvert * (OM__NARRAY3 * 3 * sizeof(double) + 2);
    return (size + 63) / 64 * 64;
}
static inline void* om__state_engine(const OmTissueState* s) {
    return (char*)(uintptr_t)s + om__state_size(s->nvert);
}
/// Stiffness of the spring of each attached vertex, N/m; 0: fixed, or not attached.
static inline double* om__state_stiffness(const OmTissueState* s) {
    return (double*)((char*)(uintptr_t)s + s->size);
}
/// Bytes of the whole block.
static inline size_t om__state_bytes(const OmTissueState* s) {
    return (s->size + (size_t)s->nvert * sizeof(double) + 63) / 64 * 64;
}
/// True if the vertex is attached without a spring (fixed).
static inline bool om__is_held_still(const OmTissueState* s, int i) {
    return om__state_attached(s)[i] && om__state_stiffness(s)[i] <= 0;
}
/// True if the position of the vertex is prescribed: by a tool, or by an attachment without a spring.
static inline bool om__is_prescribed(const OmTissueState* s, int i) {
    return om__state_held_by(s)[i] >= 0 || om__is_held_still(s, i);
}

typedef struct OmTissuePoint {  // a force on a point inside an element
    int vert[4];
    double weight[4];
    OmVec3 f;       // N
    OmMat3 K;       // N/m
    bool has_K;     // not zero
    int block[16];  // indices of the blocks of A that K changes; used if has_K
} OmTissuePoint;

typedef struct OmTissueTie {  // a force between places of the tissue
    int vert[4];
    double weight[4];
    OmVec3 f;  // N
    OmMat3 K;  // N/m
} OmTissueTie;

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
    double h;              // s, of the step begun; 0 outside a step
    int64_t work;          // CG iterations of this step, and SOLVE_WORK for each solve
    double share;          // fraction of the motion to the tools' goals in this step; 1 unless cut
    bool is_fresh;         // no solve since begin_step
    bool is_stale;         // A was assembled again since the solver's last refresh
    bool is_changed;       // added forces changed A since the refresh, diagonal blocks only
    unsigned char* key;    // prescribed vertices at the last set_fixed                (nvert)
    unsigned char* fixed;  // the same for each degree of freedom                   (nvert x 3)
    double* b;             // by assemble                                           (nvert x 3)
    double* rhs;           // b plus added forces                                   (nvert x 3)
    double* dv;            // the solution                                          (nvert x 3)
    int nextra;            // vertices with added forces
    int* extra;            //                                                       (nvert)
    unsigned char* is_extra;  //                                                    (nvert)
    OmVec3* extra_f;          // N                                                  (nvert)
    OmMat3* extra_K;          // N/m                                                (nvert)
    float* extra_diag;        // diagonal blocks of A without added forces          (nvert x 9)
    int npoint, max_point;    // forces on points, tissue_point.c
    OmTissuePoint* point;     //                                                    (max_point)
    int nundo;                // blocks of A changed by forces on points
    OmTissueUndo* undo;       //                                                    (max_point x 16)
    int ntie, max_tie;        // forces between places, tissue_tie.c
    OmTissueTie* tie;         //                                                        (max_tie)
    OmTies* ties;             // their matrix; null before the first tie
    OmTies* bonds;            // matrix of the bonds; null without bonds
    OmPose next[OM_MAX_ARM];  // tools at the end of the step begun
    bool is_static;           // statics: no inertia, h is 1
    double force_scale;       // N, added to b where residuals are scaled
    double reference;         // norm that scales the residual of a solve; 0: the norm of rhs
    double *x_end, *v_end;    // trial positions and velocities                    (nvert x 3)
    double *from, *trial, *start;  // velocity changes of Newton's method               (nvert x 3)
    double* elastic;               // elastic force at the last trial, N                (nvert x 3)
    void* backup;                  // copy of a state, for steps that are cut
};

/// True if the step may not continue its iterations.
static inline bool om__is_spent(const OmTissueModel* m, const OmTissueWork* w) {
    return w->work >= m->def.max_work;
}

// ---- tissue_engine.c ------------------------------------------------------------------------------

/// @return OM_OK; OM_INVALID (a table without a function that it needs, or of another version)
OmStatus om__engine_check(const OmTissueEngine* engine);

// ---- tissue_guard.c -------------------------------------------------------------------------------

typedef struct OmGuard {  // checks of the outcome of a step
    bool is_bad;          // elements are crushed, or the energy rose too much
    int ncrushed;         // as in OmTissueCheck
    int nbarrier;         //
    int ninverted;        //
    double gain;          // J, rise of the energy beyond the work done on the tissue
    double bound;         // J, the gain that a step may have
} OmGuard;

/// Check the velocity change w->dv of the current step. w->x_end, w->v_end and w->elastic are overwritten.
/// @param share      length of this substep as a fraction of the whole step; scales the slack
/// @param is_solved  Newton's method converged: the lower limit of det F is then smaller
OmGuard om__guard_step(const OmTissueModel* model, const OmTissueState* state, OmTissueWork* work,
                       double share, bool is_solved);
/// Where a linear solve stopped early, r = rhs - A dv is an impulse that is missing, and it works: -r.d / h, d the
/// displacement. If this work is why the energy rises too much, dv moves to the best solution along the velocity and dv
/// at free vertices: there r.d = 0, and the energy of the linear system is lower. w->from, start, trial, x_end and
/// v_end are overwritten.
/// @param guard   of the same dv
/// @param growth  out, if true: factor of |r|; above 1 only if no tolerance is required
/// @return false: dv is unchanged
bool om__guard_project(const OmTissueModel* model, const OmTissueState* state, OmTissueWork* work,
                       const OmGuard* guard, double* growth);
/// The check of elements alone, for any velocity change: true if it crushes one. w->x_end is overwritten.
bool om__is_crushing(const OmTissueModel* model, const OmTissueState* state, OmTissueWork* work,
                     const double* dv);
/// Return OM_INVALID, with a message that names the broken rule.
OmStatus om__guard_refuse(const OmGuard* guard);
/// Row i of A times dv.
OmVec3 om__apply_row(const OmBsr* A, const double* dv, int i);

// ---- tissue_newton.c ------------------------------------------------------------------------------

typedef struct OmNewton {
    double tolerance;    // of the norm of the residual, relative to `scale`
    double scale;        // N; 0: the norm of the residual at the beginning
    int max_iterations;  //
    bool predicts;       // start with iterations of the corotational law
    OmTissueStepFn fn;   // solves a linearised problem with contact; null: om_tissue_solve_step
    void* ctx;           //
    // of the whole step; above 0: stop at the first iterate that breaks no rule of tissue_guard.c and inverts nothing
    double share;
    // out: the residual is at the level of rounding; shorter steps do not help
    bool is_at_floor;
    bool is_guarded;  // out: `guard` is that of the solution
    OmGuard guard;    // out
} OmNewton;

/// Solve a step by Newton's method; the solution is w->dv. The step has begun and, unless in statics, was solved once.
/// @return OM_OK; OM_NOT_CONVERGED (w->dv is the last iterate); errors of the solve
OmStatus om__newton(const OmTissueModel* model, OmTissueState* state, OmTissueWork* work,
                    OmNewton* newton, OmTissueReport* report);
/// Solve the step once more, linearised at the velocity change w->dv, with the projected tangent, no line search.
/// @return as om_tissue_solve_step
OmStatus om__relinearise(const OmTissueModel* model, OmTissueState* state, OmTissueWork* work,
                         OmTissueReport* report);
/// Norm of the residual at the beginning of a step that has been solved once.
double om__newton_scale(const OmTissueModel* model, OmTissueWork* work);

// ---- tissue_point.c -------------------------------------------------------------------------------

/// Add forces on points to A and rhs, and remove them from A.
void om__points_apply(const OmTissueState* state, OmTissueWork* work);
void om__points_undo(OmTissueWork* work);

// ---- tissue_embed.c -------------------------------------------------------------------------------

/// Barycentric coordinates of p in the tetrahedron v of positions x; returns the least of them. It must not be flat.
double om__barycentric(const double* x, const int* v, OmVec3 p, double bary[4]);

// ---- tissue_tie.c ---------------------------------------------------------------------------------

/// Add forces between places to A and rhs.
OmStatus om__ties_apply(const OmTissueModel* model, const OmTissueState* state, OmTissueWork* work);
/// The engine's assembly, and the bonds.
OmStatus om__assemble(const OmTissueModel* model, const OmTissueState* state, OmTissueWork* work,
                      const OmAssembly* at);
/// Add the forces of bonds at x (nvert x 3) to those of the vertices in a mask (null: all); their energy, J. force may
/// be null.
double om__bonds_add(const OmTissueModel* model, const double* x, const unsigned char* mask,
                     double* force);
/// @return OM_OK; OM_INVALID (the message names bond and field); OM_NO_MEMORY
OmStatus om__bonds_copy(const OmTissueDef* def, OmTissueModel* model);
/// Work of these forces, at the end of the step, along the displacements d (nvert x 3), J.
double om__ties_work(const OmTissueWork* work, const double* d);

#endif
