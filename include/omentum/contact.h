/// omentum/contact.h: one-sided contact of tissue with rigid obstacles (floor 3).
///
/// Vertices of the tissue's surface may not enter obstacles: a plane (a board), a signed distance field (an
/// organ), any distance function, or a probe (contact_tool.h). A step is solved with an implicit penalty along
/// the normal of each contact vertex, much stiffer than the tissue, and solved again until each contact vertex
/// is pushed and no free vertex penetrates (active set). Forces only push; tissue does not stick on release.
/// Only om_tissue_* functions are used.
///
///     OmContactPlane plane = {om_vec3(0, 0, 0), om_vec3(0, 0, 1)};
///     OmTissueObstacle board = om_plane_obstacle(&plane);
///     OmContactDef def = om_contact_default_def();
///     def.nobstacle = 1, def.obstacle = &board;
///     om_contact_create(&def, model, &contact);
///     om_contact_work_create(contact, &contact_work);
///     om_contact_step(contact_work, model, state, work, 0.02, &report);
#ifndef OMENTUM_CONTACT_H
#define OMENTUM_CONTACT_H

#include "omentum/shape_sdf.h"
#include "omentum/tissue.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmContactPlane {
    OmVec3 point;   // on the plane, m
    OmVec3 normal;  // towards the free side; any length but zero
} OmContactPlane;

/// An obstacle that stays where the plane is. om_contact_create copies the plane; without it the plane is borrowed.
OM_API OmTissueObstacle om_plane_obstacle(const OmContactPlane* plane);
/// An obstacle given by a distance field, which is borrowed.
OM_API OmTissueObstacle om_sdf_obstacle(const OmSdf* sdf);
/// An obstacle given by a distance function.
/// @param ctx  first argument of the function, borrowed
OM_API OmTissueObstacle om_field_obstacle(OmDistanceFn distance, const void* ctx);

/// The smooth surface of a body of the mesh, such as an organ that a coarse mesh simulates: it rides on the body's
/// boundary (shape_skin.h), and the body feels what pushes it. Where the smooth surface is far from the boundary, as in
/// parts too thin for the mesh, nothing is felt.
typedef struct OmContactSkin {
    const OmSdf* sdf;  // distance from the surface in the body's rest shape, borrowed
    // The body's vertices in the mesh of the model's definition: whole pieces of the mesh, one or several, which no
    // other skin has.
    int vert_begin, vert_end;
} OmContactSkin;

typedef struct OmContactDef {  // made by om_contact_default_def
    int nobstacle;
    // copied; distance fields, functions and probes stay borrowed   (nobstacle)
    const OmTissueObstacle* obstacle;
    double offset;         // m, distance kept from every obstacle besides its own, >= 0; default 0
    double stiffness;      // penalty over the vertex's own stiffness, 1 to 1e6; default 1000
    double recover_speed;  // m/s, at which tissue that starts inside is pushed out; default 0.1
    // Coulomb's coefficient of obstacles whose own is negative, at most 10, regularised below 1 mm/s. Negative
    // (default): OmPbdDef.friction for engine "pbd", no friction for the other engines.
    double friction;
    int max_iterations;  // largest number of solves in a step, >= 1; default 12
    // Surfaces of the tissue keep apart: of one body that folds, and of bodies, the pieces of the mesh. Needs an engine
    // with a matrix and CG as its solver; default false
    bool self_contact;
    // m, distance that they keep, at most 0.1; 0 (default): a tenth of the mean edge of the surface, bodies with a
    // skin left out
    double self_thickness;
    double self_friction;  // Coulomb's between them, 0 to 10, viscous below 0.01 mm/s; default 0
    // Smooth surfaces of bodies of the mesh, against vertices of bodies without one; copied. They need what
    // self_contact needs, take its place between such bodies, and their friction is `friction`.        (nskin)
    int nskin;
    const OmContactSkin* skin;
    OmCookie cookie;  // set by om_contact_default_def
} OmContactDef;

typedef struct OmContactTouch {  // two places of the tissue that push each other
    int vert[4];                 // a vertex and a triangle, or the ends of two edges
    double weight[4];  // vert[a] has the force weight[a] * force; of the first side positive, sum 0
    int body[2];       // of the first and the second side, om_contact_body_of
    OmVec3 point;      // m, on the first side
    OmVec3 normal;     // from the second side to the first
    OmVec3 force;      // N, on the first side
    double gap;        // m, distance less thickness after the step
} OmContactTouch;

typedef struct OmContactReport {
    OmTissueReport tissue;  // of the linear solver, all solves
    int nsolve;             // solves, all substeps
    int ncontact;           // vertices that obstacles and presses push
    double penetration;     // m, the deepest into these after the step
    OmVec3 force;           // N, resultant of obstacles and presses on the tissue
    // The obstacles with their force, torque, ncontact and penetration, of the last substep; a view, valid until the
    // next step. Presses have reports of their own (om_press_report).
    int nobstacle;
    const OmTissueObstacle* obstacle;
    // With self_contact or skins: the places of the last substep, a view as above, and the deepest penetration, m
    int ntouch;
    const OmContactTouch* touch;
    double self_penetration;
    bool is_settled;  // in all substeps: contact vertices, planes of curved obstacles and friction
                      // stopped changing; false only with OM_NOT_CONVERGED
    // With self_contact: a tool stopped short of its goal, where its tissue would pass through other tissue. Then
    // is_settled is false, and forces are those of the last solve, which do not balance. The next step moves the tool
    // further.
    bool is_held_back;
} OmContactReport;

/// Obstacles and settings for one model; constant, shared by any number of bodies and threads.
typedef struct OmContact OmContact;
/// Scratch memory of one thread; serves any state of the model. Besides motions of obstacles (om_contact_work_move) and
/// presses (om_contact_work_set_presses) nothing in it lives longer than a step.
typedef struct OmContactWork OmContactWork;

OM_API OmContactDef om_contact_default_def(void);
/// @return OM_OK; OM_INVALID (the message names the field); OM_UNAVAILABLE (self_contact or skins, see there);
///         OM_NO_MEMORY
OM_API OmStatus om_contact_create(const OmContactDef* def, const OmTissueModel* model,
                                  OmContact** contact);
OM_API void om_contact_destroy(OmContact* contact);
/// @param contact  borrowed until the work is destroyed
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_contact_work_create(const OmContact* contact, OmContactWork** contact_work);
OM_API void om_contact_work_destroy(OmContactWork* contact_work);
/// Move an obstacle from `begin` to `end` in each of the following steps, until it is called again. Substeps follow the
/// path; friction is against the moving surface. A vertex must not pass through the obstacle in a step: presses
/// (contact_tool.h) detect that.
/// @return OM_OK; OM_INVALID (no such obstacle, or a pose is not finite)
OM_API OmStatus om_contact_work_move(OmContactWork* contact_work, int obstacle, OmPose begin,
                                     OmPose end);
/// As om_tissue_step, with contact: obstacles, and the presses of om_contact_work_set_presses, in one system.
/// What a step changes is in the state, but for the pose of a press. om_tissue_contact_force and
/// om_tissue_get_forces give the contact forces of the last solve.
/// With self_contact a state that the last step of this work did not make (a new one, one that was set or restored) is
/// searched for surfaces that cross: 1 ms for 2,000 vertices.
/// @return as om_tissue_step; OM_INVALID also for a model with another number of vertices than the contact's, and where
///         surfaces of the tissue cross at the start (the message has the place);
///         OM_NOT_CONVERGED also where contact has not settled (the state advanced)
OM_API OmStatus om_contact_step(OmContactWork* contact_work, const OmTissueModel* model,
                                OmTissueState* state, OmTissueWork* work, double h,
                                OmContactReport* report);
/// Edges of the tissue's surface that go through another part of it, between two steps. om_contact_step refuses a start
/// with any, but for crossings of neighbours in a crumpled part of one body: it keeps surfaces on
/// the side where they are.
/// @param num  out
/// @param at   out: middle of the first, m; may be null
/// @return OM_OK; OM_UNAVAILABLE (no self_contact)
OM_API OmStatus om_contact_find_crossing(OmContactWork* contact_work, const OmTissueState* state,
                                         int* num, OmVec3* at);
/// With self_contact or skins: bodies, the pieces of the mesh in the order of their first vertices; else 0.
OM_API int om_contact_body_count(const OmContact* contact);
/// The body of a vertex; -1 without self_contact and skins.
OM_API int om_contact_body_of(const OmContact* contact, int vert);
/// Force of body b on body a in the last substep, N; of a body on itself it is 0.
OM_API OmVec3 om_contact_body_force(const OmContactWork* contact_work, int a, int b);
/// Step until contact has settled and no vertex is faster than `speed` m/s in three steps in a row (at a turning point
/// of a vibration one step is slow, too), for at most `seconds`.
/// @return OM_OK; OM_NOT_CONVERGED (still moving); errors of om_contact_step
OM_API OmStatus om_contact_settle(OmContactWork* contact_work, const OmTissueModel* model,
                                  OmTissueState* state, OmTissueWork* work, double h, double speed,
                                  double seconds);
/// The obstacles with the contact's offset and friction, for om_tissue_step_among. A view, valid until destroy.
/// @return number of obstacles
OM_API int om_contact_get_obstacles(const OmContact* contact, const OmTissueObstacle** obstacle);
/// Distance of a point to the nearest obstacle, m; positive when free. Infinite without obstacles.
OM_API double om_contact_eval_distance(const OmContact* contact, OmVec3 p);

#ifdef __cplusplus
}
#endif
#endif
