/// omentum/tissue.h: soft tissue as a table of operators (floor 2).
///
/// A *model* is mesh, material and engine; it is constant and shared. A *state* is everything that changes, one
/// flat block. A *work* is the scratch and the linear solver of one thread. An *engine* computes how tissue deforms:
/// finite elements (fem.h), particles (pbd.h), springs and links (heuristic.h), a network (umesh_net.h), or your own
/// (tissue_engine.h). With any of them a caller grasps, moves, steps, and reads positions (m) and forces (N).
/// Implicit Euler (thesis (3.3)-(3.6), signs as in the errata):
/// (M + h C + h^2 K) dv = h f - h^2 K v.
///
///     OmTissueDef def = om_tissue_default_def(om_fem_engine(), &mesh);  // fixes the set "attachment" of the mesh
///     om_tissue_create(&def, &model);
///     om_tissue_state_create(model, &state);
///     om_tissue_work_create(model, &work);
///     om_tissue_grasp(model, state, 0, pose_world_tip, 0.005, &nheld);
///     om_tissue_move_grasp(state, 0, pose_world_tip_later);
///     om_tissue_step(model, state, work, 0.02, &report);
///     om_tissue_get_forces(model, state, &forces);
///
/// Counts of arrays (nvert, ntet) are those of om_tissue_mesh(model), not of the caller's mesh: by default finite
/// elements have midpoints behind its vertices, and eight tetrahedra for each of its own.
#ifndef OMENTUM_TISSUE_H
#define OMENTUM_TISSUE_H

#include "omentum/shape_tet10.h"
#include "omentum/solve.h"
#include "omentum/tissue_material.h"
#include "omentum/vec.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- model ----------------------------------------------------------------------------------------

typedef enum OmTissueElement {
    OM_ELEMENT_LINEAR,     // tetrahedra of four nodes; far too stiff in bending on few elements
    OM_ELEMENT_QUADRATIC,  // tetrahedra of ten nodes: vertices and midpoints of edges
    OM_ELEMENT_SHELL,      // solid-shell hexahedra: cells of a sheet, as om_tet_mesh_box makes them
    OM_NTISSUE_ELEMENT
} OmTissueElement;
OM_API const char* om_tissue_element_name(OmTissueElement element);  // "quadratic"; null: no such

#define OM_BOND_VERT 5

/// A spring between two places of the mesh, such as a patch of one body that another one holds: with p = sum weight[a]
/// x[vert[a]], vertex vert[a] feels -weight[a] stiffness p. The two places coincide at rest, p = 0, and the weights
/// sum to 0: a vertex of one body against the point of the other one's tetrahedron where it lies, (1, -bary), inside
/// it or near it. Bodies that turn together feel no force.
typedef struct OmTissueBond {
    int vert[OM_BOND_VERT];  // of the definition's mesh; different ones where the weight is not 0
    double weight[OM_BOND_VERT];
    double stiffness;  // N/m, above 0
} OmTissueBond;

typedef struct OmTissueDef {              // made by om_tissue_default_def
    const struct OmTissueEngine* engine;  // by om_tissue_default_def; borrowed, a constant table
    // Options of the engine: OmPbdDef, OmChainDef, OmUmeshNet ...; null (default): the engine's defaults. Each engine's
    // header says whether it copies or borrows them.
    const void* options;
    // Instead of `options`: a file and numbers from which the engine makes options, owned by the model; default null
    const struct OmEngineInput* input;
    const OmTetMesh* mesh;  // copied by create
    // The first vertices of the mesh, which are the tissue; the others belong to bodies around it, such as an organ
    // that gives way. Tools do not grasp these, and om_tissue_get_forces leaves them out. Default 0: all are.
    int nown;
    int nmaterial;  // tet_label must be below it; default 0: every label has `material_default`
    const OmMaterial* material;   // by tet_label                                  (nmaterial)
    OmMaterial material_default;  // used if nmaterial is 0
    double density;               // kg/m^3, > 0; default 1000
    // kg/m^3 by tet_label, in place of `density`; null (default): `density` everywhere
    // (nmaterial)
    const double* material_density;
    double rayleigh_mass;       // 1/s, >= 0; default 0.1
    double rayleigh_stiffness;  // s, >= 0; default 0
    OmVec3 gravity;             // m/s^2; default (0, 0, -9.81)
    // N/m, stiffness of the spring at each vertex of the set "attachment"; default 0: fixed. A state may change it.
    double attachment_stiffness;
    // N/m, a stiffness for each vertex of the set, in the set's order, instead of attachment_stiffness; copied; null
    // (default): all equal
    const double* attachment_springs;
    // Springs inside the tissue, for engines with a matrix and CG as the solver; copied                       (nbond)
    int nbond;
    const OmTissueBond* bond;
    int max_newton;  // 1: one linearisation (thesis (3.5)); > 1: maximum of Newton's iterations; default 1
    double newton_tolerance;  // relative to the residual at the first linearisation; default 1e-3
    // Largest work of a step with all its substeps and Newton iterations, in CG iterations; each solve counts ten more
    // for its matrix and its checks. Then the step ends with OM_NOT_CONVERGED. At least 1; default 20000.
    int max_work;
    // OM_ELEMENT_QUADRATIC, default of om_fem_engine: om_tissue_mesh, so each array of vertices, has midpoints of edges
    // behind the vertices of `mesh`, and eight tetrahedra for each; a midpoint is attached if both ends are held still.
    // Other engines accept OM_ELEMENT_LINEAR alone, their default. OM_ELEMENT_SHELL: the vertices of `mesh`, six
    // tetrahedra of one label a hexahedron (om_tet_mesh_find_cells); for sheets of one layer, in a fraction of the time
    OmTissueElement element;
    OmSolverDef solver;  // max_iterations, tolerance, nworker ...; default as om_solver_default_def
    OmCookie cookie;     // set by om_tissue_default_def
} OmTissueDef;

typedef struct OmTissueModel OmTissueModel;  // constant; may be used by any number of threads
typedef struct OmTissueState OmTissueState;  // one flat block
typedef struct OmTissueWork OmTissueWork;    // one per thread that steps

OM_API OmTissueDef om_tissue_default_def(const struct OmTissueEngine* engine,
                                         const OmTetMesh* mesh);
/// @return OM_OK; OM_INVALID (the message names the field, the element or the vertex); OM_NO_MEMORY
OM_API OmStatus om_tissue_create(const OmTissueDef* def, OmTissueModel** model);
OM_API void om_tissue_destroy(OmTissueModel* model);
/// The model's own copy of the mesh; x of it is the rest shape. With quadratic elements it is the definition's mesh
/// after om_tet_mesh_refine: arrays of vertices have its nvert.
OM_API const OmTetMesh* om_tissue_mesh(const OmTissueModel* model);
/// Vertices of the definition's mesh; they come first in om_tissue_mesh.
OM_API int om_tissue_corner_count(const OmTissueModel* model);
/// Nodes, elements, labels and sets of a model of quadratic elements, for files and recordings.
/// @param x  positions of its vertices, m (nvert x 3); null: at rest
/// @return OM_OK; OM_UNAVAILABLE (elements are linear); OM_NO_MEMORY
OM_API OmStatus om_tissue_make_tet10(const OmTissueModel* model, const double* x,
                                     OmTet10Mesh* mesh);
/// Forces on all nodes as forces on the definition's vertices: that on a midpoint goes in halves to the ends of its
/// edge.
/// @param of_node    (nvert x 3)
/// @param of_corner  out: (om_tissue_corner_count x 3); may be of_node
OM_API void om_tissue_gather_corners(const OmTissueModel* model, const double* of_node,
                                     double* of_corner);
/// Lumped masses, kg (nvert).
OM_API const double* om_tissue_mass(const OmTissueModel* model);
OM_API OmVec3 om_tissue_gravity(const OmTissueModel* model);
/// Vertices of the mesh's boundary, ascending.
OM_API const int* om_tissue_surface_vert(const OmTissueModel* model, int* nvert);
/// Bytes of model, one state and one work; by ntet it is the memory per element.
OM_API size_t om_tissue_memory(const OmTissueModel* model, const OmTissueWork* work);

/// Bonds that hold vertices of one body on another one: each with the tetrahedron of the other body in which it lies,
/// or whose barycentric coordinates say that it lies nearest.
/// @param vert        vertices of one body                                                         (nvert)
/// @param tet_begin   tetrahedra of the other body: [tet_begin, tet_end), as om_tet_mesh_join leaves them
/// @param stiffness   N/m, of each bond
/// @param bond        out                                                                          (nvert)
/// @return OM_OK; OM_INVALID (a vertex or a tetrahedron out of range, a vertex of the other body)
OM_API OmStatus om_tissue_make_bonds(const OmTetMesh* mesh, int nvert, const int* vert,
                                     int tet_begin, int tet_end, double stiffness,
                                     OmTissueBond* bond);

// ---- state ----------------------------------------------------------------------------------------

/// A state in the rest shape, at rest. The mesh's set "attachment", if any, is attached as the definition says.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_tissue_state_create(const OmTissueModel* model, OmTissueState** state);
OM_API void om_tissue_state_destroy(OmTissueState* state);
OM_API void om_tissue_state_reset(const OmTissueModel* model, OmTissueState* state);
/// A snapshot is a memcpy of this many bytes from or to the state of the same model.
OM_API size_t om_tissue_state_size(const OmTissueModel* model);
OM_API uint64_t om_tissue_state_hash(const OmTissueState* state);
/// Views (nvert x 3 of om_tissue_mesh), m and m/s; valid until the state is destroyed.
OM_API const double* om_tissue_x(const OmTissueState* state);
OM_API const double* om_tissue_v(const OmTissueState* state);
OM_API double om_tissue_time(const OmTissueState* state);
/// Replace positions and velocities; null v is zero velocity.
/// @return OM_OK; OM_INVALID (a value is not finite; state unchanged)
OM_API OmStatus om_tissue_set_x(const OmTissueModel* model, OmTissueState* state, const double* x,
                                const double* v);
/// External forces, N (nvert x 3), written by the caller, kept until changed; zero at first.
OM_API double* om_tissue_external_force(OmTissueState* state);

// ---- attachments ----------------------------------------------------------------------------------

/// Replace all attachments, between two steps. An attached vertex is fixed at its anchor, or a spring pulls it to the
/// anchor. A fixed vertex reaches its anchor in the next step, at any distance.
/// @param vert       attached vertices, in any order                                      (nvert)
/// @param anchor     m, in the order of vert; null: the rest positions                    (nvert x 3)
/// @param stiffness  N/m, of the spring of each vertex, 0: fixed; null: as the definition  (nvert)
/// @return OM_OK; OM_INVALID (an index, a value out of range or not finite, or a vertex to fix that an arm
///         grasps); OM_UNAVAILABLE (a spring, but the engine has no springs); state unchanged on error
OM_API OmStatus om_tissue_set_attachment(const OmTissueModel* model, OmTissueState* state,
                                         int nvert, const int* vert, const double* anchor,
                                         const double* stiffness);
/// Anchors with which om_tissue_set_attachment changes the kind or the stiffness of attachments without a jump: every
/// vertex stays where it is, and a spring begins with the force of the attachment that it replaces (0 if none).
/// @param stiffness  as of om_tissue_set_attachment
/// @param anchor     out, in the order of vert                                            (nvert x 3)
/// @return OM_OK; OM_NO_MEMORY; as om_tissue_set_attachment; errors of om_tissue_get_attachment_force
OM_API OmStatus om_tissue_eval_anchor(const OmTissueModel* model, const OmTissueState* state,
                                      int nvert, const int* vert, const double* stiffness,
                                      double* anchor);
/// Nonzero where attached (nvert).
OM_API const unsigned char* om_tissue_attached(const OmTissueState* state);
/// Stiffness of the spring of each attached vertex, N/m; 0: fixed, or not attached (nvert).
OM_API const double* om_tissue_attachment_stiffness(const OmTissueState* state);
/// Anchor of each attached vertex, m (nvert x 3).
OM_API const double* om_tissue_anchor(const OmTissueState* state);

/// True if the position of vertex i is prescribed: by a tool, or by an attachment without a spring.
OM_API bool om_tissue_is_prescribed(const OmTissueModel* model, const OmTissueState* state, int i);

// ---- grasping (thesis 6.4.7) ----------------------------------------------------------------------

/// Grasp the vertices within `radius` (0: 5 mm) of the tip, of shells also the four of the nearest face that is within
/// it: jaws hold an area. They follow the tool rigidly. Vertices that are fixed, or that the other arm grasps, are left
/// out, and so are midpoints of quadratic elements beside a fixed vertex where anything else is in reach. An arm that
/// already grasps tissue is released first.
/// @param nheld  out: number of grasped vertices; may be null
/// @return OM_OK; OM_INVALID (nothing in reach: the message has the nearest distance; state unchanged)
OM_API OmStatus om_tissue_grasp(const OmTissueModel* model, OmTissueState* state, int arm,
                                OmPose pose_world_tip, double radius, int* nheld);
/// Goal of the tool for the end of the next step. No effect on an arm that grasps nothing.
/// @return OM_OK; OM_INVALID (no such arm, or a pose that is not finite)
OM_API OmStatus om_tissue_move_grasp(OmTissueState* state, int arm, OmPose pose_world_tip);
OM_API void om_tissue_release(OmTissueState* state, int arm);
/// Number of vertices that the arm grasps.
OM_API int om_tissue_nheld(const OmTissueState* state, int arm);
/// The arm that grasps each vertex, -1 if none (nvert).
OM_API const signed char* om_tissue_held_by(const OmTissueState* state);

// ---- stepping -------------------------------------------------------------------------------------

typedef struct OmTissueReport {
    int iterations;          // CG iterations of all substeps and solves; 0 for a direct solver
    double residual;         // |b - A x| / |b|, recomputed in double; the worst
    int substeps;            // 1 unless the step had to be cut
    int newton;              // iterations of Newton's method; 0 where one linearisation did
    double newton_residual;  // relative to the residual at the first linearisation
    // elements with det F <= 1e-6 at the end, of quadratic ones at a quadrature point; counted by finite elements only
    int ninverted;
    // J, largest rise of energy in a substep beyond the work done and rounding.
    double energy_gain;
    bool is_work_spent;  // the step reached def.max_work: OM_NOT_CONVERGED
    // An accepted substep crushes an element or gains energy; of a network: the input is unlike its training data.
    bool is_unguarded;
} OmTissueReport;

/// Scratch for steps of `model`: matrix, solver, arrays.
/// @return OM_OK; OM_NO_MEMORY; errors of om_solver_create
OM_API OmStatus om_tissue_work_create(const OmTissueModel* model, OmTissueWork** work);
OM_API void om_tissue_work_destroy(OmTissueWork* work);
/// One implicit Euler step, one linearisation unless def.max_newton asks for more. The outcome must keep two rules:
/// the step flattens or inverts no element, and the energy rises by no more than the work done on the tissue and 1 %.
/// A step that breaks a rule is solved again by Newton's method with line search. With contact, or if that fails too,
/// the step is cut: to h / 1024, or to h / 4 if every crushed element has a law with finite energy at det F = 0. When
/// def.max_work is spent, what is left of the step is one more substep, held back as far as the rules require.
/// @param report  may be null
/// @return OM_OK; OM_NOT_CONVERGED (advanced with the best iterate: an iteration stopped early, elements are
///         inverted, energy was gained, or the work is spent; the message says which, the report how much);
///         OM_INVALID (a bad argument, or the step cannot be solved: the message has the reason; state unchanged)
OM_API OmStatus om_tissue_step(const OmTissueModel* model, OmTissueState* state, OmTissueWork* work,
                               double h, OmTissueReport* report);

/// Static equilibrium under weight, external forces and attachments, tools at their goals: Newton's
/// method with line search on the energy. Velocities become zero, time stays.
/// @param tolerance  of the norm of unbalanced forces, relative to the beginning, in (0, 1); 1e-5 can be reached
/// @param report  may be null: newton, newton_residual, iterations of the linear solver
/// @return OM_OK; OM_NOT_CONVERGED (state is the last iterate: report->newton_residual says how good, and
///         report->ninverted how many elements are inverted); OM_INVALID, OM_UNAVAILABLE (state unchanged)
OM_API OmStatus om_tissue_find_rest(const OmTissueModel* model, OmTissueState* state,
                                    OmTissueWork* work, double tolerance, int max_iterations,
                                    OmTissueReport* report);

/// Signed distance of p to an obstacle, in the obstacle's frame, m, negative inside, and the unit normal (the direction
/// in which the distance grows). Points without a normal return infinity. May be called by several threads.
typedef double (*OmDistanceFn)(const void* ctx, OmVec3 p, OmVec3* normal);
/// A rigid body that tissue may not enter: its shape, how it moves in a step, and the outcome of the step. contact.h
/// and contact_tool.h make obstacles of planes, distance fields, functions and probes. Fields left zero mean none.
typedef struct OmTissueObstacle {
    OmDistanceFn distance;
    const void* ctx;    // borrowed
    double offset;      // m, distance that is kept from the surface
    double thickness;   // m, a path is checked in pieces shorter than half of it; 0: one piece
    bool is_plane;      // the distance is linear in p
    bool has_bounds;    // lo and hi are set
    OmVec3 lo, hi;      // box around the obstacle, in its frame
    OmPose pose_begin;  // pose_world_obstacle at the beginning of the step
    OmPose pose_end;    // the same at its end
    double friction;    // Coulomb's; negative: of the contact, or of the engine
    // computed by the step
    // N, N m on the tissue; torque about pose_end.p. The mean over the step for engines that move vertices
    // themselves, else of the last substep.
    OmVec3 force, torque;
    int ncontact;        // vertices pushed in the last substep
    double penetration;  // m, largest of these vertices after the step
} OmTissueObstacle;
/// True if the engine moves vertices and resolves obstacles itself, without stages and system matrix.
OM_API bool om_tissue_moves_itself(const OmTissueModel* model);
/// As om_tissue_step among obstacles, for such an engine only.
/// @return as om_tissue_step; OM_UNAVAILABLE (an engine that does not resolve obstacles itself)
OM_API OmStatus om_tissue_step_among(const OmTissueModel* model, OmTissueState* state,
                                     OmTissueWork* work, double h, int nobstacle,
                                     OmTissueObstacle* obstacle, OmTissueReport* report);

/// Callback for a method that solves more than once in a step (contact): it adds vertex forces, solves, checks the
/// outcome and repeats. On return the work has the last solution.
typedef OmStatus (*OmTissueStepFn)(void* ctx, const OmTissueModel* model, OmTissueState* state,
                                   OmTissueWork* work, double h, OmTissueReport* report);
/// As om_tissue_step, but each (sub)step calls `solve` instead of om_tissue_solve_step.
/// @return as om_tissue_step; errors of `solve`
OM_API OmStatus om_tissue_step_with(const OmTissueModel* model, OmTissueState* state,
                                    OmTissueWork* work, double h, OmTissueStepFn solve, void* ctx,
                                    OmTissueReport* report);

// The stages of a step. begin_step makes A and b at the state's positions, end_step advances the state.
/// Assemble A and b at the state's positions for a step of h seconds.
/// @return OM_OK; OM_INVALID (h is not in (0, 10] s); OM_UNAVAILABLE (an engine without stages)
OM_API OmStatus om_tissue_begin_step(const OmTissueModel* model, OmTissueState* state,
                                     OmTissueWork* work, double h);
/// Add to vertex i a force that at the end of the step is f - K (x_end - x_begin); K symmetric positive
/// semidefinite, N/m. Added forces may be cleared and added again between solves.
OM_API void om_tissue_add_force(OmTissueWork* work, int i, OmVec3 f, OmMat3 K);
OM_API void om_tissue_clear_forces(OmTissueWork* work);
/// Reserve room for forces on points sum weight[a] x[vert[a]] of an element's vertices, for all points of a step; call
/// it before the first om_tissue_add_point_force of a step. It allocates once.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_tissue_reserve_points(OmTissueWork* work, int npoint);
/// Add a force on a point inside an element, see om_tissue_reserve_points; cleared with the forces on vertices.
/// @return OM_OK; OM_INVALID (vertices that share no element, or no room: nothing was added)
OM_API OmStatus om_tissue_add_point_force(OmTissueWork* work, const int vert[4],
                                          const double weight[4], OmVec3 f, OmMat3 K);
/// Add a force between places of the tissue, which need share no element: with p = sum weight[a] x[vert[a]], vertex
/// vert[a] feels weight[a] (f - K (p_end - p_begin)). Weights that sum to zero make an internal force, such as contact
/// of tissue with itself. Cleared with the forces on vertices.
/// @param K  symmetric positive semidefinite, N/m
/// @return OM_OK; OM_INVALID (a vertex out of range); OM_NO_MEMORY
OM_API OmStatus om_tissue_add_tie(OmTissueWork* work, const int vert[4], const double weight[4],
                                  OmVec3 f, OmMat3 K);
/// Solve for dv. The first solve of a step starts from zero, later ones from the last solution.
/// @return OM_OK; OM_NOT_CONVERGED (dv is the best iterate); OM_INVALID (no step has begun, or the system has
///        no finite solution)
OM_API OmStatus om_tissue_solve_step(const OmTissueModel* model, const OmTissueState* state,
                                     OmTissueWork* work, OmTissueReport* report);
/// True if the step in progress has used def.max_work: a method that solves more than once should end.
OM_API bool om_tissue_is_spent(const OmTissueModel* model, const OmTissueWork* work);
/// Tolerance of the linear solver in later solves of this step, in (0, 1); any other value restores the model's.
OM_API void om_tissue_set_tolerance(OmTissueWork* work, double tolerance);
/// The next solve of this step makes the solver's coarse matrices again: for added forces that differ much from those
/// of the first solve, where each solve needs more iterations. By default only the first solve of a step makes them.
OM_API void om_tissue_renew_solver(OmTissueWork* work);
/// A force, N, that counts beside b in the scale of the residuals of this step's solves: for forces of this step that
/// are not yet in b. 0: none.
OM_API void om_tissue_set_force_scale(OmTissueWork* work, double force);
/// Velocity change of the last solve, m/s (nvert x 3); x_end = x + h (v + dv).
OM_API const double* om_tissue_dv(const OmTissueWork* work);
/// Add a correction found by om_tissue_solve to this velocity change (nvert x 3); zero at prescribed vertices.
OM_API void om_tissue_add_dv(OmTissueWork* work, const double* correction);
/// Let the tools stand still until the end of the step or substep that has begun: the velocity change of what they hold
/// is set so. The next one moves them further.
OM_API void om_tissue_stop_tools(const OmTissueModel* model, const OmTissueState* state,
                                 OmTissueWork* work);
/// y = A x for nrhs vectors (nrhs x nvert x 3).
/// @return OM_OK; OM_INVALID (no step has begun, or nrhs < 1)
OM_API OmStatus om_tissue_apply(const OmTissueModel* model, OmTissueWork* work, int nrhs,
                                const double* x, double* y);
/// Solve A x = b with x = 0 at prescribed vertices; x: in: initial guess, out: solution (nrhs x nvert x 3).
/// @return OM_OK; OM_NOT_CONVERGED (x is the best iterate); OM_INVALID (no step has begun, nrhs < 1, or the
///        matrix is not positive definite)
OM_API OmStatus om_tissue_solve(const OmTissueModel* model, OmTissueWork* work, int nrhs,
                                const double* b, double* x, OmSolveInfo* info);
/// Diagonal block of A / h^2 at vertex i: the stiffness against a displacement of this vertex alone, N/m.
OM_API double om_tissue_vertex_stiffness(const OmTissueWork* work, int i);
/// Advance the state by the last solution.
/// @return OM_OK; OM_INVALID (no solve in this step)
OM_API OmStatus om_tissue_end_step(const OmTissueModel* model, OmTissueState* state,
                                   OmTissueWork* work);

// ---- forces and measures --------------------------------------------------------------------------

typedef struct OmTissueForces {  // N, resultants of forces on the tissue
    OmVec3 grasp[OM_MAX_ARM];    // by each tool, from the constrained rows of the last step
    OmVec3 pull[OM_MAX_ARM];     // grasp minus the weight of the grasped patch
    OmVec3 attachment;           // by the attachments, from element stresses (or their springs)
    OmVec3 contact;              // by ground and organs, from the last contact step
    OmVec3 external;             // om_tissue_external_force
    OmVec3 weight;               // of all tissue (OmTissueDef.nown)
} OmTissueForces;

/// At equilibrium all but `pull` sum to zero. Needs no work; attachments of both kinds in one state
/// allocate for the call.
/// @return OM_OK; OM_NO_MEMORY; errors of the engine
OM_API OmStatus om_tissue_get_forces(const OmTissueModel* model, const OmTissueState* state,
                                     OmTissueForces* forces);
/// Elastic force on each vertex, in double from element stresses, N (nvert x 3).
/// @return OM_OK; OM_UNAVAILABLE (an engine without elastic forces); OM_NO_MEMORY
OM_API OmStatus om_tissue_get_internal_force(const OmTissueModel* model, const OmTissueState* state,
                                             double* force);
/// Force on each vertex by its attachment, N (nvert x 3); zero where there is none.
/// @return OM_OK; OM_NO_MEMORY; errors of the engine
OM_API OmStatus om_tissue_get_attachment_force(const OmTissueModel* model,
                                               const OmTissueState* state, double* force);
/// Force on each vertex by tools, attachments and contact, N (nvert x 3).
/// @return OM_OK; OM_NO_MEMORY; errors of the engine
OM_API OmStatus om_tissue_get_holding_force(const OmTissueModel* model, const OmTissueState* state,
                                            double* force);
/// Force of bond k on its first vertex over its weight, N; zero for no such bond.
OM_API OmVec3 om_tissue_bond_force(const OmTissueModel* model, const OmTissueState* state, int k);
/// Contact force on each vertex in the last step, N (nvert x 3); a contact method writes it.
OM_API double* om_tissue_contact_force(OmTissueState* state);

typedef enum OmTissueMeasure {
    OM_VON_MISES,          // von Mises stress, Pa
    OM_PRINCIPAL_STRETCH,  // largest singular value of F
    OM_STRAIN,             // largest eigenvalue, by magnitude, of the corotational strain
    OM_VOLUME_RATIO,       // det F; negative where inverted
    OM_ENERGY_DENSITY      // J/m^3
} OmTissueMeasure;
/// One measure of every element of om_tissue_mesh: with quadratic elements eight for each of the definition's mesh.
/// @param value  out, (om_tissue_mesh(model)->ntet)
/// @return OM_OK; OM_INVALID (no such measure); OM_UNAVAILABLE (an engine without elements)
OM_API OmStatus om_tissue_get_measure(const OmTissueModel* model, const OmTissueState* state,
                                      OmTissueMeasure measure, double* value);

typedef struct OmTissueEnergy {  // J
    double elastic, kinetic, gravity, spring;
} OmTissueEnergy;
/// Energies of the state.
/// @return OM_OK; errors of the engine
OM_API OmStatus om_tissue_get_energy(const OmTissueModel* model, const OmTissueState* state,
                                     OmTissueEnergy* energy);
/// kg m/s, and about the origin kg m^2/s; either may be null.
OM_API void om_tissue_get_momentum(const OmTissueModel* model, const OmTissueState* state,
                                   OmVec3* linear, OmVec3* angular);

// ---- embedded points ------------------------------------------------------------------------------

typedef struct OmEmbedding {  // points carried by elements; om_embedding_done frees
    int npoint;
    int* tet;       // element that carries each point, -1 for particles         (npoint)
    double* bary;   // barycentric coordinates, any sign outside the mesh        (npoint x 4)
    int* tet_vert;  // its vertices, or the particles                            (npoint x 4)
} OmEmbedding;
/// Bind points of the rest shape to the elements that contain them, or to the nearest elements; in a mesh without
/// elements to the nearest particles. In a single layer of particles the projection on the layer is bound.
/// @return OM_OK; OM_INVALID (a point that is not finite); OM_NO_MEMORY
OM_API OmStatus om_tissue_embed(const OmTissueModel* model, int npoint, const double* point,
                                OmEmbedding* embedding);
OM_API void om_embedding_done(OmEmbedding* embedding);
/// Positions of the points for vertex positions x (npoint x 3).
OM_API void om_embedding_eval(const OmEmbedding* embedding, const double* x, double* point);

#ifdef __cplusplus
}
#endif
#endif
