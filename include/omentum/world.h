/// omentum/world.h: one interface to an operating field (floor 4).
///
/// A world is known by observations and moved by commands; a controller cannot distinguish a simulated field from a
/// real one. The simulated field has its own mesh and stiffness, and noise on measurements. A *body* is soft tissue
/// with its contact on fixed anatomy, ready to be stepped. The robot's twin is a body, the simulated world contains
/// another.
///
///     OmWorld* world;
///     om_world_create_simulated(&scene, &site, 0, &world);
///     om_world_move(world, 0, p_world, 0.02);              // PSM1's tip, at 20 mm/s
///     om_world_advance(world, 0.02);
///     om_world_observe(world, OM_OBSERVE_VISIBILITY, &obs);
///     om_world_destroy(world);
#ifndef OMENTUM_WORLD_H
#define OMENTUM_WORLD_H

#include "omentum/image.h"
#include "omentum/pbd.h"
#include "omentum/scene.h"
#include "omentum/sense.h"
#include "omentum/tissue.h"
#include "omentum/vec.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- bodies ---------------------------------------------------------------------------------------------

/// Soft tissue with its contact. The twin is one, the simulated world contains another.
typedef struct OmBody OmBody;

typedef struct OmBodyForces {  // N; world frame
    OmVec3 grasp[OM_MAX_ARM];  // force the tool exerts on the patch it holds
    OmVec3 pull[OM_MAX_ARM];   // the same less the weight taken over from the ground
    OmVec3 attachment;         // of what the tissue is attached to, on the tissue
    OmVec3 contact;            // of ground and organ, on the tissue
    OmVec3 weight;             // of the tissue
} OmBodyForces;

typedef struct OmBodyReport {  // of the last step
    int iterations;            // of the linear solver, all substeps
    double residual;           // |b - A x| / |b|, the worst
    int substeps;              // 1 unless the step had to be cut
    int ncontact;              // vertices in contact
    double penetration;        // m, the deepest
    int ninverted;             // elements that are inverted at its end
    double energy_gain;        // J, rise of energy beyond the work done; 0: none
} OmBodyReport;

typedef struct OmBodyParts {  // data that a definition of tissue borrows
    OmPbdDef pbd;
    OmMaterial material[OM_SITE_MATERIALS];
    double density[OM_SITE_MATERIALS];
} OmBodyParts;

/// Definition of a scene's tissue on a site, for om_tissue_create. It borrows the site's mesh and `parts`, which this
/// function fills.
OM_API OmTissueDef om_body_tissue_def(const OmScene* scene, const OmSite* site, OmBodyParts* parts);
/// Engine, law and materials as text, for example "finite elements, neo-hookean, Young's modulus 3000 Pa, Poisson's
/// ratio 0.45".
OM_API void om_body_describe(const OmScene* scene, const OmSite* site, char* text, size_t size);
/// @param site  borrowed until destroy
/// @return OM_OK; OM_INVALID (the message names the field of the scene); OM_NO_MEMORY
OM_API OmStatus om_body_create(const OmScene* scene, const OmSite* site, int nworker,
                               OmBody** body);
OM_API void om_body_destroy(OmBody* body);
/// Hold the vertices within `radius` of the tip; 0 held is OM_INVALID with the nearest distance.
/// @return OM_OK; OM_INVALID (no such arm, or no vertex within the radius)
OM_API OmStatus om_body_grasp(OmBody* body, int arm, OmPose pose_world_tip, double radius,
                              int* nheld);
/// Set the goal of what the arm holds, for the next step.
/// @return OM_OK; OM_INVALID (no such arm, or a pose that is not finite)
OM_API OmStatus om_body_move(OmBody* body, int arm, OmPose pose_world_tip);
OM_API void om_body_release(OmBody* body, int arm);
OM_API bool om_body_is_holding(const OmBody* body, int arm);
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
/// Force on each vertex by tools, attachments and contact, N (nvert x 3).
/// @return OM_OK; errors of om_tissue_get_holding_force
OM_API OmStatus om_body_get_vertex_forces(OmBody* body, double* force);
/// A measure of every element of the body's mesh (ntet).
/// @return as om_tissue_get_measure
OM_API OmStatus om_body_get_measure(const OmBody* body, OmTissueMeasure measure, double* value);
OM_API const OmSite* om_body_site(const OmBody* body);
OM_API uint64_t om_body_hash(const OmBody* body);
/// Snapshots: a block of om_body_state_size bytes. It includes the contact forces before the first grasp, the
/// reference of OmBodyForces.pull.
OM_API size_t om_body_state_size(const OmBody* body);
OM_API void om_body_save(const OmBody* body, void* block);
OM_API void om_body_restore(OmBody* body, const void* block);

// ---- worlds ---------------------------------------------------------------------------------------------

typedef struct OmArmObservation {
    OmVec3 tip;       // measured position, world frame, m
    double jaw;       // opening, rad
    bool is_moving;   // a commanded motion is under way
    bool is_holding;  // tissue between the jaws
} OmArmObservation;

enum {                          // what to observe beside the arms
    OM_OBSERVE_VISIBILITY = 1,  // share of the ROI that the endoscope sees
    OM_OBSERVE_IMAGE = 2,       // the endoscope's picture
    OM_OBSERVE_CLOUD = 4        // the depth camera's points on the tissue
};

typedef struct OmObservation {  // om_observation_done frees; zero-initialise
    double time;                // s
    OmArmObservation arm[OM_MAX_ARM];
    double visibility;  // 0 to 1
    OmPicture image;    //
    int ncloud;         //
    double* cloud;      // m, world frame  (ncloud x 3)
} OmObservation;

typedef struct OmWorld OmWorld;

/// Functions of a kind of world; an interface to a real robot fills the same table.
typedef struct OmWorldOps {
    void (*destroy)(OmWorld* world);
    OmStatus (*move)(OmWorld* world, int arm, OmVec3 tip, double speed);
    OmStatus (*set_jaw)(OmWorld* world, int arm, double angle);
    void (*stop)(OmWorld* world, int arm);
    OmStatus (*advance)(OmWorld* world, double dt);
    OmStatus (*observe)(OmWorld* world, unsigned what, OmObservation* observation);
} OmWorldOps;

struct OmWorld {  // head of every kind of world
    const OmWorldOps* ops;
};

/// Command a straight motion of the tip, orientation kept, at `speed` m/s; returns at once.
/// @return OM_OK; OM_INVALID (the arm cannot reach the goal: the message names the joint)
OM_API OmStatus om_world_move(OmWorld* world, int arm, OmVec3 tip, double speed);
/// Command the jaw angle, rad. Below 20 degrees the jaw grasps the tissue at the tip, above it releases the tissue.
/// @return OM_OK; OM_INVALID (no such arm, an angle that is not finite)
OM_API OmStatus om_world_set_jaw(OmWorld* world, int arm, double angle);
OM_API void om_world_stop(OmWorld* world, int arm);
/// Let `dt` seconds pass.
/// @return OM_OK; OM_INVALID (dt out of range); errors of the world, of a simulated one those of om_body_step
OM_API OmStatus om_world_advance(OmWorld* world, double dt);
/// Observe the arms, and OM_OBSERVE_ flags `what` beside them.
/// @return OM_OK; errors of the world
OM_API OmStatus om_world_observe(OmWorld* world, unsigned what, OmObservation* observation);
OM_API void om_world_destroy(OmWorld* world);
OM_API void om_observation_done(OmObservation* observation);

/// A simulated operating field; `site` (of role OM_SITE_WORLD) is borrowed.
/// @param nworker  threads of the tissue, 0: one a processor; the outcome does not depend on it
/// @return OM_OK; OM_INVALID (the message names the field of the scene); OM_NO_MEMORY; OM_UNAVAILABLE (Embree
///        failed)
OM_API OmStatus om_world_create_simulated(const OmScene* scene, const OmSite* site, int nworker,
                                          OmWorld** world);
/// The endoscope's view of the ROI over fixed anatomy and tissue, without tools: to try motions on a body alone.
typedef struct OmView OmView;
/// @param site  borrowed until destroy
/// @return OM_OK; OM_NO_MEMORY; OM_UNAVAILABLE (Embree failed)
OM_API OmStatus om_view_create(const OmScene* scene, const OmSite* site, OmView** view);
OM_API void om_view_destroy(OmView* view);
/// @param x  vertex positions of the site's mesh, m (nvert x 3); null: without tissue, which gives the largest
///           visibility that a retraction can reach
/// @return OM_OK; OM_NO_MEMORY; OM_UNAVAILABLE (Embree failed)
OM_API OmStatus om_view_look(OmView* view, const double* x, OmVisibility* visibility);
/// Check that the ROI could be seen with the tissue removed.
/// @return OM_OK; OM_INVALID if less than OM_WORLD_LEAST_VISIBLE of the ROI, or less than the task's own
///         `visibility`, could be seen: the message names the reason and the remedy; OM_NO_MEMORY
OM_API OmStatus om_world_check_visible(const OmScene* scene, const OmSite* site);
#define OM_WORLD_LEAST_VISIBLE 0.9
/// The truth inside a simulated world, for recordings and for judging; null for any other world.
OM_API OmBody* om_world_truth(OmWorld* world);
/// Shaft, wrist and jaws of an arm where they are now, always the same triangles; valid until the next call. Null for a
/// world that is not simulated.
OM_API const OmSurface* om_world_tool(OmWorld* world, int arm);
/// The endoscope's view of a simulated world at any size, for reports.
/// @return OM_OK; OM_INVALID (a size out of range); OM_NO_MEMORY; OM_UNAVAILABLE (not a simulated world)
OM_API OmStatus om_world_render(OmWorld* world, int width, int height, OmPicture* picture);

#ifdef __cplusplus
}
#endif
#endif
