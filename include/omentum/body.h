/// omentum/body.h: soft tissue of a scene with its contact on fixed anatomy, ready to be stepped (floor 4).
///
/// A body is made from a scene and a site: the site has mesh, board and organ, the scene has engine, law and friction.
/// The robot's twin is a body, the simulated world (world.h) contains another.
///
///     OmBody* body;
///     om_body_create(&scene, &site, 0, &body);
///     om_body_settle(body, 0.02, 1e-3, 5);                 // until speeds are below 1 mm/s
///     om_body_grasp(body, 0, pose_world_tip, 0.005, &nheld);
///     om_body_move(body, 0, pose_world_tip_later);
///     om_body_step(body, 0.02, &report);
///     om_body_get_forces(body, &forces);
///     om_body_destroy(body);
#ifndef OMENTUM_BODY_H
#define OMENTUM_BODY_H

#include "omentum/scene.h"
#include "omentum/tissue_engine.h"
#include "omentum/vec.h"

#ifdef __cplusplus
extern "C" {
#endif

struct OmPress;  // of contact_tool.h

/// Soft tissue with its contact. The twin is one, the simulated world contains another.
typedef struct OmBody OmBody;

typedef struct OmBodyForces {  // N; world frame
    OmVec3 grasp[OM_MAX_ARM];  // force of the tool on the grasped patch
    OmVec3 pull[OM_MAX_ARM];   // grasp minus the weight that the ground no longer carries
    OmVec3 attachment;         // by attachments, on the tissue
    OmVec3 contact;            // by ground and organ, on the tissue
    OmVec3 weight;             // of the tissue
} OmBodyForces;

typedef struct OmBodyReport {  // of the last step
    int iterations;            // of the linear solver, all substeps
    double residual;           // |b - A x| / |b|, the worst
    int substeps;              // 1 unless the step had to be cut
    int ncontact;              // vertices in contact
    double penetration;        // m, largest
    int ninverted;             // elements that are inverted at its end
    double energy_gain;        // J, rise of energy beyond the work done; 0: none
} OmBodyReport;

#define OM_BODY_NUMBERS 8
typedef struct OmBodyParts {  // data that a definition of tissue borrows
    OmEngineInput input;
    OmEngineNumber number[OM_BODY_NUMBERS];
    char file[2 * OM_SCENE_PATH];
    OmMaterial material[OM_SITE_MATERIALS];
    double density[OM_SITE_MATERIALS];
} OmBodyParts;

/// The engines of the library below this header: fem, pbd, xpbd, springs, chainmail. Add om_umesh_engine and your own
/// with om_engine_set_add, and set OmScene.engines to the set.
OM_API OmEngineSet om_engine_set_default(void);
/// The engine of a scene on a site: for the twin from `tissue: engine`, for the simulated world om_fem_engine.
/// @return OM_OK; OM_INVALID (the scene's engines have none of this name)
OM_API OmStatus om_body_find_engine(const OmScene* scene, OmSiteRole role,
                                    const OmTissueEngine** engine);
/// Definition of a scene's tissue on a site, for om_tissue_create. It borrows the site's mesh and `parts`, which this
/// function fills.
/// @return OM_OK; OM_INVALID (no such engine, or its file is missing: the message names the key of the scene)
OM_API OmStatus om_body_make_tissue_def(const OmScene* scene, const OmSite* site,
                                        OmBodyParts* parts, OmTissueDef* def);
/// Engine, law and materials as text, for example "finite elements, neo-hookean, Young's modulus 3000 Pa, Poisson's
/// ratio 0.45".
OM_API void om_body_describe(const OmScene* scene, const OmSite* site, char* text, size_t size);
/// Tissue model, contact and site, shared by all bodies of one scene and site. Constant; any number of bodies and
/// threads may use it.
typedef struct OmBodyModel OmBodyModel;
/// Matrix, solver and scratch of one thread, for any body of its model.
typedef struct OmBodyWork OmBodyWork;

/// @param site     borrowed until destroy
/// @param nworker  threads of one step, 0: one a processor. 1 where bodies are stepped in parallel
/// @return OM_OK; OM_INVALID (the message names the field of the scene); OM_NO_MEMORY; errors of om_tissue_create
OM_API OmStatus om_body_model_create(const OmScene* scene, const OmSite* site, int nworker,
                                     OmBodyModel** model);
OM_API void om_body_model_destroy(OmBodyModel* model);
/// @param model  borrowed until destroy
/// @return OM_OK; OM_NO_MEMORY; errors of om_tissue_work_create
OM_API OmStatus om_body_work_create(const OmBodyModel* model, OmBodyWork** work);
OM_API void om_body_work_destroy(OmBodyWork* work);
/// A body of a shared model: it takes no more memory than its state.
/// @param model  borrowed until destroy
/// @param work   borrowed; null: om_body_set_work or om_body_step_many lends one later
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_body_create_shared(const OmBodyModel* model, OmBodyWork* work, OmBody** body);
/// Lend the body the work of the thread that steps it next; null takes it back.
OM_API void om_body_set_work(OmBody* body, OmBodyWork* work);
/// Step many bodies of one model, each with the work of the thread that steps it. The outcome of a body does not depend
/// on the number of works. Bodies have no work afterwards.
/// @param body    each body once                           (nbody)
/// @param work    one a thread, of the bodies' model       (nwork)
/// @param status  out, as om_body_step of each body        (nbody)
/// @return OM_OK; OM_NOT_CONVERGED (of some body); OM_INVALID (a list is null, or a work is of another model); the
///         first error of a body, the others have been stepped
OM_API OmStatus om_body_step_many(int nbody, OmBody* const* body, int nwork,
                                  OmBodyWork* const* work, double dt, OmStatus* status);
/// A body with a model and a work of its own.
/// @param site  borrowed until destroy
/// @return OM_OK; OM_INVALID (the message names the field of the scene); OM_NO_MEMORY
OM_API OmStatus om_body_create(const OmScene* scene, const OmSite* site, int nworker,
                               OmBody** body);
/// Set Young's modulus of every material to `factor` times that of the site. Positions, grasps and attachments stay;
/// forces change at once.
/// @param scene  as om_body_create was given it
/// @return OM_OK; OM_INVALID (a body of om_body_create_shared, factor not above 0); OM_NO_MEMORY; unchanged on error
OM_API OmStatus om_body_set_young(OmBody* body, const OmScene* scene, double factor);
OM_API void om_body_destroy(OmBody* body);
/// The engine that computes the body; om_engine_capabilities says what it can do.
OM_API const OmTissueEngine* om_body_engine(const OmBody* body);
/// The model of its tissue, until om_body_set_young or destroy. om_tissue_mesh of it has a vertex for each position of
/// om_body_x: those of the site's mesh, those of an organ that deforms, then, of quadratic elements, the midpoints of
/// edges.
OM_API const OmTissueModel* om_body_tissue(const OmBody* body);
/// The tissue that pictures and recordings show: om_tissue_mesh with the elements of the site's mesh alone. A view,
/// until om_body_set_young or destroy.
OM_API const OmTetMesh* om_body_mesh(const OmBody* body);

/// Nodes of the tissue that tools grasp: the vertices of the site's mesh and, of quadratic elements and shells, the
/// midpoints of its edges, as om_tet_mesh_refine orders them; those of shells are between the vertices. Of other
/// elements, without an organ that deforms, they are those of om_body_x.
OM_API int om_body_node_count(const OmBody* body);
/// The nodes that an arm grasps, ascending, into `node` (om_body_node_count). Returns how many, 0: it grasps nothing.
/// Shells are held by a whole face, which reaches beyond the jaws on one side: of their nodes those within `radius`
/// (m) of `tip` count, or all that are held where none is.
OM_API int om_body_find_held_nodes(const OmBody* body, int arm, OmVec3 tip, double radius,
                                   int* node);
/// Positions of these nodes, m (om_body_node_count x 3).
OM_API void om_body_get_nodes(const OmBody* body, double* x);

/// Organ and ROI of a site where the vertices of a body are: they ride on an organ that deforms, and stay where they
/// are on one that does not. Views, which om_anatomy_move changes.
typedef struct OmAnatomy {
    const OmSurface *organ, *roi;
    const double *roi_x, *roi_n;  // as OmSite                                     (nroi x 3)
    bool moves;                   // the organ deforms
} OmAnatomy;

/// @param body  gives site and model, which are borrowed until destroy
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_anatomy_create(const OmBody* body, OmAnatomy** anatomy);
OM_API void om_anatomy_destroy(OmAnatomy* anatomy);
/// @param x  as om_body_x, of any body of the model
OM_API void om_anatomy_move(OmAnatomy* anatomy, const double* x);
/// Back to the rest shape and the attachments of the model, at time 0; nothing is grasped.
OM_API void om_body_reset(OmBody* body);
/// Grasp the vertices within `radius` of the tip.
/// @return OM_OK; OM_INVALID (no such arm, a pose that is not finite, a radius below 0 or not finite, or no vertex to
///         grasp within the radius: the message has the nearest distance); errors of om_tissue_get_forces
OM_API OmStatus om_body_grasp(OmBody* body, int arm, OmPose pose_world_tip, double radius,
                              int* nheld);
/// Set the goal of the grasped tissue, for the end of the next step.
/// @return OM_OK; OM_INVALID (no such arm, or a pose that is not finite)
OM_API OmStatus om_body_move(OmBody* body, int arm, OmPose pose_world_tip);
/// Let go.
OM_API void om_body_release(OmBody* body, int arm);
OM_API bool om_body_is_holding(const OmBody* body, int arm);
/// A probe that presses on the body in its steps from now on, by om_press_move; om_press_report has its force.
/// @param press  made for om_body_tissue, borrowed until the next call or om_body_set_young; null: none
/// @return OM_OK; OM_INVALID (a body of om_body_create_shared); OM_UNAVAILABLE (an engine without a matrix: pbd, ...)
OM_API OmStatus om_body_set_press(OmBody* body, struct OmPress* press);
/// The arm that grasps each vertex, -1 if none (nvert); valid until the body is destroyed.
OM_API const signed char* om_body_held_by(const OmBody* body);
/// Replace all attachments between two steps, as om_tissue_set_attachment; those of an organ that deforms stay, and so
/// do springs to the organ (OmSceneAttach.on_organ). Above an organ that deforms attachments by area
/// (OmSceneAttach.foundation) need `stiffness`.
/// @param vert  of the site's mesh                                               (nvert)
/// @return as om_tissue_set_attachment
OM_API OmStatus om_body_set_attachment(OmBody* body, int nvert, const int* vert,
                                       const double* anchor, const double* stiffness);
/// Anchors that change kind or stiffness of attachments without a jump, as om_tissue_eval_anchor.
/// @return as om_tissue_eval_anchor
OM_API OmStatus om_body_eval_anchor(const OmBody* body, int nvert, const int* vert,
                                    const double* stiffness, double* anchor);
/// Nonzero where a vertex is attached now, also to an organ that deforms (nvert); valid until it is called again or the
/// body is destroyed. Not by two threads at a time on one body.
OM_API const unsigned char* om_body_attached(const OmBody* body);
/// Stiffness of the spring of each attached vertex now, N/m; 0: fixed, or not attached (nvert).
OM_API const double* om_body_attachment_stiffness(const OmBody* body);
/// A step that stopped at the iteration limit of the linear solver is OM_OK: the report has its residual.
/// @return OM_OK; OM_NOT_CONVERGED (advanced, but contact has not settled, elements are inverted or energy was gained:
///         the message says which; om_body_nbad counts such steps); errors of om_contact_step
OM_API OmStatus om_body_step(OmBody* body, double dt, OmBodyReport* report);
/// Calls of om_body_step since the body was created that returned OM_NOT_CONVERGED.
OM_API int om_body_nbad(const OmBody* body);
/// Step until the body is at rest (speeds below `speed` m/s), for at most `seconds`.
/// @return OM_OK; OM_NOT_CONVERGED (it still moves); errors of om_contact_step
OM_API OmStatus om_body_settle(OmBody* body, double dt, double speed, double seconds);
/// Vertex positions, m (nvert x 3); valid until the next step.
OM_API const double* om_body_x(const OmBody* body);
/// Forces of the last step.
/// @return OM_OK; errors of om_tissue_get_forces
OM_API OmStatus om_body_get_forces(OmBody* body, OmBodyForces* forces);
/// Force of contact on each vertex of om_body_tissue in the last step, by ground, organ and other tissue, N
/// (nvert x 3); valid until the next step.
OM_API const double* om_body_contact_force(const OmBody* body);
/// Force on each vertex by tools, attachments and contact, N (nvert x 3).
/// @return OM_OK; errors of om_tissue_get_holding_force
OM_API OmStatus om_body_get_vertex_forces(OmBody* body, double* force);
/// Force on each vertex by its attachment, N (nvert x 3); zero where there is none.
/// @return OM_OK; errors of om_tissue_get_attachment_force
OM_API OmStatus om_body_get_attachment_force(OmBody* body, double* force);
/// A measure of every element of the body's mesh (ntet).
/// @return as om_tissue_get_measure
OM_API OmStatus om_body_get_measure(const OmBody* body, OmTissueMeasure measure, double* value);
OM_API const OmSite* om_body_site(const OmBody* body);
/// Hash of the tissue's state. It leaves out the contact forces before the first grasp, which snapshots include, and
/// om_body_nbad.
OM_API uint64_t om_body_hash(const OmBody* body);
/// Snapshots: a block of om_body_state_size bytes. It includes the contact forces before the first grasp, the
/// reference of OmBodyForces.pull.
OM_API size_t om_body_state_size(const OmBody* body);
OM_API void om_body_save(const OmBody* body, void* block);
OM_API void om_body_restore(OmBody* body, const void* block);

#ifdef __cplusplus
}
#endif
#endif
