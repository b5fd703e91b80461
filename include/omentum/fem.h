/// omentum/fem.h: solids of any element and law, in double precision (floor 2).
///
/// Energy, force and tangent of a hyperelastic body; static equilibrium by Newton's method with load
/// steps; implicit and explicit dynamics. These solids are written for precision and for reading. om_fem_engine is
/// fast: an engine of tissue.h for linear tetrahedra in floats. Tests compare the two.
///
///     om_fem_mesh_from_tet(&tet, OM_TET10, &mesh);
///     OmFemDef def = om_fem_default_def(&mesh, 1, &material);
///     om_fem_create(&def, &solid);
///     OmFemLoad load = {.body = {0, 0, -9.81}, .fixed = fixed};
///     OmFemStaticDef how = om_fem_static_default_def(solid);
///     memcpy(x, mesh.x, 3 * (size_t)mesh.nnode * sizeof *x);
///     om_fem_static_solve(solid, &load, &how, x, reaction, &report);   // x: equilibrium
#ifndef OMENTUM_FEM_H
#define OMENTUM_FEM_H

#include "omentum/shape_sdf.h"
#include "omentum/shape_tet10.h"
#include "omentum/solve.h"
#include "omentum/tissue_material.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The engine "fem" of tissue.h: linear tetrahedra, corotational or hyperelastic, implicit Euler. It has no options.
OM_API const struct OmTissueEngine* om_fem_engine(void);

// ---- meshes -----------------------------------------------------------------------------------------

typedef enum OmElement {
    OM_TET4,       // linear tetrahedron, one quadrature point
    OM_TET10,      // quadratic; nodes 4..9 on edges 01 12 02 03 13 23; four points
    OM_HEX8,       // nodes counter-clockwise below, then above; 2 x 2 x 2 points
    OM_HEX8_MEAN,  // the same with one volume ratio in U(J), v / V (Simo, Taylor and Pister 1985)
    OM_NELEMENT
} OmElement;
#define OM_MAX_ELEM_NODE 10

typedef struct OmFemMesh {  // om_fem_mesh_done frees
    OmElement kind;
    int nnode, nelem, nelem_node;  // nelem_node: 4, 10 or 8
    double* x;                     // node positions, m                          (nnode x 3)
    int* elem_node;                //                                   (nelem x nelem_node)
    int* elem_material;            // index of the material                          (nelem)
} OmFemMesh;

typedef struct OmFemFaces {  // boundary faces, om_fem_faces_done frees
    int nface, nface_node;   // 3 (tet4), 6 (tet10: corners, then edges 01 12 20) or 4
    int* face_node;          // counter-clockwise seen from outside    (nface x nface_node)
    int* face_elem;          // the element behind                                 (nface)
} OmFemFaces;

OM_API const char* om_element_name(OmElement kind);  // "tet10"; null if there is no such element
OM_API void om_fem_mesh_done(OmFemMesh* mesh);
OM_API void om_fem_faces_done(OmFemFaces* faces);
/// Vertices keep their numbers; mid-edge nodes (tet10), on straight edges, follow. Labels become materials.
/// @param kind  OM_TET4 or OM_TET10
/// @return OM_OK; OM_INVALID (a kind that is no tetrahedron, or an empty mesh); OM_NO_MEMORY
OM_API OmStatus om_fem_mesh_from_tet(const OmTetMesh* tet, OmElement kind, OmFemMesh* mesh);
/// Solid of quadratic tetrahedra (OM_TET10), also with curved edges; labels become materials.
/// @return OM_OK; OM_INVALID (as om_fem_mesh_validate: an element that is inverted at a quadrature point); OM_NO_MEMORY
OM_API OmStatus om_fem_mesh_from_tet10(const OmTet10Mesh* tet, OmFemMesh* mesh);
/// The same from a mesh that om_tet_mesh_refine_nodes refined; its vertices may have moved since.
/// @param node  nodes of each element (fine->ntet / 8 x 10); null: linear elements, om_fem_mesh_from_tet of `fine`
/// @return as om_fem_mesh_from_tet10
OM_API OmStatus om_fem_mesh_from_nodes(const OmTetMesh* fine, const int* node, OmFemMesh* mesh);
/// Its inverse: nodes and elements of a mesh of OM_TET10, for files and recordings; materials become labels.
/// @param x  positions of its nodes, m (nnode x 3); null: at rest
/// @return OM_OK; OM_INVALID (another kind of element); OM_NO_MEMORY
OM_API OmStatus om_fem_mesh_get_tet10(const OmFemMesh* mesh, const double* x, OmTet10Mesh* tet);
/// Box [lo, hi] of num[0] x num[1] x num[2] cells, x fastest; tetrahedra as in om_tet_mesh_box.
/// @return OM_OK; OM_INVALID (counts below 1, corners in the wrong order); OM_NO_MEMORY
OM_API OmStatus om_fem_mesh_box(OmElement kind, OmVec3 lo, OmVec3 hi, const int num[3],
                                OmFemMesh* mesh);
/// Faces of one element only, in the order of elements.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_fem_mesh_boundary(const OmFemMesh* mesh, OmFemFaces* faces);
/// Two bodies as one mesh: nodes and elements of b follow those of a, of the same kind.
/// @return OM_OK; OM_INVALID (different kinds of element); OM_NO_MEMORY
OM_API OmStatus om_fem_mesh_join(const OmFemMesh* a, const OmFemMesh* b, OmFemMesh* mesh);
/// Check indices, finite positions, positive volume at every quadrature point.
/// @return OM_OK; OM_INVALID (the message names the element)
OM_API OmStatus om_fem_mesh_validate(const OmFemMesh* mesh);
/// Locate points: the element that contains each point, or the nearest element, and the weights of its nodes. Newton's
/// method in curved or skewed elements.
/// @param p       (n x 3), m
/// @param elem    (n)
/// @param weight  (n x nelem_node)
/// @return OM_OK, OM_INVALID (a point is not finite), OM_NO_MEMORY
OM_API OmStatus om_fem_mesh_embed(const OmFemMesh* mesh, int n, const double* p, int* elem,
                                  double* weight);

// ---- the solid --------------------------------------------------------------------------------------

typedef enum OmLocking {  // remedies against locking of linear tetrahedra, nu > 0.45
    OM_LOCKING_NONE,
    OM_NODAL_VOLUME,  // U(J) of the volume ratio of each node's patch (Bonet and Burton 1998)
    OM_SMOOTHED  // the same, and the rest of W of the mean F around each edge (Liu and Nguyen 2010)
} OmLocking;

/// Frictionless contact between two sets of faces: the pressure is `stiffness` times the depth. Points of both sides
/// are checked, and both sides are treated alike. Contact has an energy, so the forces of both sides balance. The
/// tangent couples each node of one side with each node of the other, so a set has up to about a thousand nodes. A
/// set should be larger than the area of contact: faces outside of it are not checked.
typedef struct OmFemContact {
    int nface[2];
    const int* face_node[2];  // rows of om_fem_mesh_boundary; the sides share no node
    // Pa/m; 0 (default): 100 times Young's modulus over height of the softer body
    double stiffness;
    double reach;  // m, largest depth of a contact point; 0 (default): the edge of a face
} OmFemContact;

typedef struct OmFemDef {         // made by om_fem_default_def; create copies everything
    const OmFemMesh* mesh;        // borrowed until create returns
    int nmaterial;                // elem_material < nmaterial
    const OmMaterial* material;   // (nmaterial)
    const double* density;        // kg/m^3, > 0 (nmaterial); null, the default: 1000
    OmLocking locking;            // default OM_LOCKING_NONE; the others are for OM_TET4
    int ncontact;                 // default 0
    const OmFemContact* contact;  // part of the solid's energy                     (ncontact)
    bool is_projected;  // tangents of elements projected to positive semidefinite; default false
    int nworker;        // threads, 0 is one per processor; default 0
    OmCookie cookie;
} OmFemDef;

/// A body at rest: constant after create, may be shared between threads.
typedef struct OmFemSolid OmFemSolid;

OM_API OmFemDef om_fem_default_def(const OmFemMesh* mesh, int nmaterial,
                                   const OmMaterial* material);
/// OM_HEX8_MEAN, OM_NODAL_VOLUME and OM_SMOOTHED need a law with a term in J alone: any but OM_COROTATIONAL,
/// OM_LINEAR and OM_ST_VENANT_KIRCHHOFF.
/// @return OM_OK; OM_INVALID (the message names element or field); OM_NO_MEMORY
OM_API OmStatus om_fem_create(const OmFemDef* def, OmFemSolid** solid);
OM_API void om_fem_destroy(OmFemSolid* solid);
OM_API const OmFemMesh* om_fem_mesh(const OmFemSolid* solid);
OM_API const double* om_fem_mass(const OmFemSolid* solid);  // lumped, kg (nnode)

/// The pattern of the tangent, with double values (OmBsr.exact).
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_fem_matrix_create(const OmFemSolid* solid, OmBsr* A);
/// Energy of elements and contacts at node positions x (nnode x 3), J.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_fem_eval_energy(const OmFemSolid* solid, const double* x, double* energy);
/// f = dW/dx, N (nnode x 3): the forces that hold the nodes at x. Any finite x gives finite forces. `energy` may be
/// null.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_fem_eval_force(const OmFemSolid* solid, const double* x, double* f,
                                  double* energy);
/// A = d2W/dx2, by the option is_projected. A (of om_fem_matrix_create) is overwritten.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_fem_eval_tangent(const OmFemSolid* solid, const double* x, OmBsr* A);
/// A += scale M, consistent or lumped.
OM_API void om_fem_add_mass(const OmFemSolid* solid, double scale, bool is_consistent, OmBsr* A);
/// y = M x (nnode x 3).
OM_API void om_fem_apply_mass(const OmFemSolid* solid, bool is_consistent, const double* x,
                              double* y);
/// Volume of each element over its rest volume (nelem; may be null).
/// @return the smallest det F at a quadrature point; an element is inverted if it is not above 0
OM_API double om_fem_eval_volume(const OmFemSolid* solid, const double* x, double* ratio);
/// Cauchy stress, Pa, and deformation gradient inside an element; either may be null.
/// @param weight  of its nodes at the point, as from om_fem_mesh_embed; null: mean over quadrature points
/// @return OM_OK; OM_INVALID (no such element, one of singular shape, or the stress of OM_NODAL_VOLUME)
OM_API OmStatus om_fem_eval_stress(const OmFemSolid* solid, const double* x, int elem,
                                   const double* weight, OmMat3* stress, OmMat3* F);

typedef struct OmFemTouch {  // on side 0 of a contact; forces on side 1 are opposite
    OmVec3 force, torque;    // N; N m about the origin
    double area;             // rest area in contact, mean of both sides, m^2
    double depth;            // of the deepest point, m
    double energy;           // J
} OmFemTouch;

/// Contact number `contact` of the definition at positions x.
/// @param f  its part of om_fem_eval_force (nnode x 3); may be null
/// @return OM_OK; OM_INVALID (no such contact); OM_NO_MEMORY
OM_API OmStatus om_fem_eval_contact(const OmFemSolid* solid, const double* x, int contact,
                                    OmFemTouch* touch, double* f);

// ---- loads ------------------------------------------------------------------------------------------

/// An additional energy E of the caller, for example contact with a tool whose depth grows with `load`. `eval` adds E
/// to *energy, its gradient dE/dx to f (nnode x 3), and its second derivative to A by om_bsr_add on blocks of the
/// pattern (nodes of one element, symmetric: both (i, j) and (j, i)). Each pointer is null if that part is not
/// needed. If the second derivative is not positive semidefinite, it is projected node by node where Newton's method
/// needs it. Springs much stiffer than the elements need more iterations. `finish` is called at equilibrium and may
/// change quantities that are constant during Newton's method (multipliers, friction); it returns OM_NOT_CONVERGED to
/// solve again at the same load. An error of either function ends the solve with that error.
typedef struct OmFemExtra {
    OmStatus (*eval)(void* ctx, const double* x, double load, double* energy, double* f, OmBsr* A);
    OmStatus (*finish)(void* ctx, const double* x, double load);  // may be null
    void* ctx;
} OmFemExtra;

typedef struct OmFemPressure {  // on faces of om_fem_mesh_boundary
    int nface, nface_node;
    const int* face_node;  // (nface x nface_node)
    OmVec3 traction;       // dead: N per m^2 of the rest area
    // Follower pressure, Pa, against the outward normal of the deformed face. On a surface with a
    // free rim the tangent is unsymmetric: UMFPACK takes the place of CHOLMOD, GMRES that of CG.
    double pressure;
} OmFemPressure;

typedef struct OmFemLoad {  // zero-initialise; values are those at load = 1
    OmVec3 body;            // force per mass, m/s^2: gravity
    const double* force;    // dead, N (nnode x 3), or null
    int npressure;
    const OmFemPressure* pressure;  // (npressure)
    const unsigned char* fixed;     // nonzero where prescribed (nnode x 3), or null
    const double* goal;             // displacement there, m (nnode x 3); null: 0
    const OmFemExtra* extra;        // or null
} OmFemLoad;

// ---- statics ----------------------------------------------------------------------------------------

typedef struct OmFemStaticDef {  // made by om_fem_static_default_def
    double load_begin;           // load factor at the start; default 0
    int nstep;                   // initial number of load steps, >= 1; default 1
    double min_step;             // a step that fails is halved, down to this; default 1/4096
    int max_newton;              // iterations of a load step, default 30
    // Of |residual| over the norm of loads and reactions, or over rounding; default 1e-9.
    double tolerance;
    bool is_plain;               // whole steps of Newton's method, no line search; default false
    OmSolverDef solver;          // default OM_CHOLESKY up to 3,000 nodes, else OM_MULTIGRID to 1e-3
    const OmProgress* progress;  // "load" from 0 to 1, at every iteration; may be null
    OmCookie cookie;
} OmFemStaticDef;

typedef struct OmFemReport {
    double load;         // load factor reached: 1, or less if not converged
    double residual;     // |forces at free degrees of freedom| over the norm of loads and reactions
    double force_scale;  // that norm, N
    int nstep, ncut;     // load steps made, and steps that failed and were halved
    int nnewton;         // Newton iterations in all
    int ncg;             // CG iterations in all
    double min_volume;   // smallest det F
    // The last tangent was not positive definite: the equilibrium may be unstable, as a straight column above its
    // buckling load. False where GMRES solves, because it is not known there.
    bool is_unstable;
    double history[32];  // residuals, N, of the last load step: at its start, after each iteration
    int nhistory;
    char reason[160];  // why load 1 was not reached; "" if it was
} OmFemReport;

OM_API OmFemStaticDef om_fem_static_default_def(const OmFemSolid* solid);
/// Equilibrium under a load that grows from load_begin to 1. Prescribed degrees of freedom move from their value in x
/// to rest + goal. Newton's method takes full steps first (unless there is `extra`), and uses a line search if they
/// fail. A tangent that is not positive definite is projected. A load step that fails, or ends with an inverted
/// element, is halved.
/// @param x         in: equilibrium at load_begin (at 0: the rest positions); out: at report->load
/// @param reaction  force on prescribed degrees of freedom, N (nnode x 3), 0 elsewhere; may be null
/// @param report    may be null
/// @return OM_OK; OM_NOT_CONVERGED (x is the last equilibrium, report->load < 1 its load); OM_INVALID,
///         OM_NO_MEMORY, OM_CANCELLED (x unchanged)
OM_API OmStatus om_fem_static_solve(const OmFemSolid* solid, const OmFemLoad* load,
                                    const OmFemStaticDef* def, double* x, double* reaction,
                                    OmFemReport* report);

/// The same for many loads on one body: matrix, solver and scratch memory are made once. For one thread at a time; the
/// solid is borrowed.
typedef struct OmFemStatics OmFemStatics;

/// Prepare static problems of one solid: matrix, solver, scratch.
/// @return OM_OK; OM_INVALID (the message names the field); OM_NO_MEMORY
OM_API OmStatus om_fem_statics_create(const OmFemSolid* solid, const OmFemStaticDef* def,
                                      OmFemStatics** statics);
OM_API void om_fem_statics_destroy(OmFemStatics* statics);
/// As om_fem_static_solve.
/// @return as om_fem_static_solve
OM_API OmStatus om_fem_statics_solve(OmFemStatics* statics, const OmFemLoad* load, double* x,
                                     double* reaction, OmFemReport* report);

// ---- dynamics ---------------------------------------------------------------------------------------

typedef enum OmIntegrator {
    OM_IMPLICIT_EULER,     // damps
    OM_IMPLICIT_MIDPOINT,  // keeps momenta and, to second order, energy
    OM_CENTRAL_DIFFERENCE  // explicit (total Lagrangian, thesis 2.3.1; Miller et al. 2007)
} OmIntegrator;

typedef struct OmFemDynamicDef {  // made by om_fem_dynamic_default_def
    OmIntegrator integrator;      // default OM_IMPLICIT_EULER
    bool is_consistent_mass;      // default false: lumped; OM_CENTRAL_DIFFERENCE needs lumped
    double mass_damping;          // Rayleigh's: force -mass_damping M v, 1/s, >= 0; default 0
    double min_step;     // a step that fails is halved, down to this part of h; default 1/64
    int max_newton;      // default 30
    double tolerance;    // as in statics, inertia among the loads; default 1e-9
    OmSolverDef solver;  // as in statics
    OmCookie cookie;
} OmFemDynamicDef;

typedef struct OmFemMotion {  // caller's arrays
    double* x;                // m (nnode x 3)
    double* v;                // m/s (nnode x 3); of OM_CENTRAL_DIFFERENCE: half a step earlier
    double time;              // s
} OmFemMotion;

/// Scratch memory and matrices of a motion, for one thread at a time.
typedef struct OmFemDynamics OmFemDynamics;

OM_API OmFemDynamicDef om_fem_dynamic_default_def(const OmFemSolid* solid);
/// @return OM_OK; OM_INVALID (the message names the field); OM_NOT_SPD (the mass matrix cannot be factorised);
///        OM_NO_MEMORY
OM_API OmStatus om_fem_dynamics_create(const OmFemSolid* solid, const OmFemDynamicDef* def,
                                       OmFemDynamics** dynamics);
OM_API void om_fem_dynamics_destroy(OmFemDynamics* dynamics);
/// Advance by h under full loads; prescribed degrees of freedom go to rest + goal. An implicit step that fails is cut
/// (report->ncut). An explicit step that is too long for stability returns OM_INVALID when a value is not finite.
/// @return OM_OK; OM_NOT_CONVERGED (advanced to motion->time only); OM_INVALID (motion unchanged); OM_NO_MEMORY
OM_API OmStatus om_fem_step(OmFemDynamics* dynamics, const OmFemLoad* load, double h,
                            OmFemMotion* motion, OmFemReport* report);
/// Longest stable step of OM_CENTRAL_DIFFERENCE at positions x: 2 / omega less 2 %, where omega is the highest
/// frequency of tangent and lumped mass (Lanczos). Compressed elements make it shorter.
/// @param fixed  (nnode x 3) or null
/// @return OM_OK; OM_INVALID (every node is prescribed, or the solid has no stiffness); OM_NO_MEMORY
OM_API OmStatus om_fem_eval_stable_step(const OmFemSolid* solid, const double* x,
                                        const unsigned char* fixed, double* h);
/// Kinetic energy, J; linear and angular momentum about the origin (either may be null).
OM_API double om_fem_eval_momentum(const OmFemSolid* solid, bool is_consistent,
                                   const OmFemMotion* motion, OmVec3* linear, OmVec3* angular);

#ifdef __cplusplus
}
#endif
#endif
