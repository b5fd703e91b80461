/// omentum/contact_tool.h: rigid moving probes that press on tissue (room `contact`, floor 3).
///
/// A probe is a closed rigid shape. A press moves it along a path, one pose in each step, and keeps the tissue
/// outside by one of the thesis's three methods: penalty (3.7), Lagrange multipliers (3.8)-(3.12) or
/// prescribed displacement (3.4.3). Contact points are the vertices of a contact surface: a triangle mesh that
/// is embedded in the elements, by default of 1,004 triangles for any volume mesh (3.4.4).
///
///     OmProbeDef shape = om_probe_default_def(OM_PROBE_BOX);         // 50 x 10 mm, presses along its -z
///     om_probe_create(&shape, &probe);
///     OmPressDef def = om_press_default_def(probe);
///     om_press_create(&def, model, &press);
///     om_press_place(press, model, state, pose_first_touch);
///     om_press_step(press, model, state, work, pose_next, 0.02, &report);   // report.force, N
///     om_press_step(press, model, state, work, pose_after, 0.02, &report);
#ifndef OMENTUM_CONTACT_TOOL_H
#define OMENTUM_CONTACT_TOOL_H

#include "omentum/contact.h"
#include "omentum/shape.h"
#include "omentum/tissue.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- probes ----------------------------------------------------------------------------------------

typedef enum OmProbeShape {
    OM_PROBE_BOX,      // the origin is the centre of the pressing face, the body is at z >= 0
    OM_PROBE_SPHERE,   // its centre is the origin
    OM_PROBE_CAPSULE,  // points within `radius` of the segment from the origin to (0, 0, length)
    OM_PROBE_MESH      // a closed surface in the probe's own frame
} OmProbeShape;

typedef struct OmProbeDef {  // made by om_probe_default_def; lengths in m
    OmProbeShape shape;      //
    OmVec3 size;             // box: its sides; default 50 x 10 x 60 mm
    double rounding;         // box: radius of its edges, >= 0, at most half its sides; default 1 mm
    double radius;           // sphere and capsule; default 25 mm and 5 mm
    double length;           // capsule, >= 0; default 50 mm
    const OmSurface* surface;  // mesh: closed, outward; copied by create
    OmCookie cookie;           // set by om_probe_default_def
} OmProbeDef;

typedef struct OmProbe OmProbe;  // constant; may be used by any number of threads

OM_API OmProbeDef om_probe_default_def(OmProbeShape shape);
/// @return OM_OK; OM_INVALID (the message names the field, or the edge that leaves a mesh open); OM_NO_MEMORY
OM_API OmStatus om_probe_create(const OmProbeDef* def, OmProbe** probe);
OM_API void om_probe_destroy(OmProbe* probe);
/// Exact signed distance of p to the probe's surface in the probe's frame, m, negative inside.
/// @param normal  unit, the direction in which the distance grows; may be null
OM_API double om_probe_eval_distance(const OmProbe* probe, OmVec3 p, OmVec3* normal);
/// Triangles to draw, in the probe's frame; the caller frees with om_surface_done.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_probe_get_surface(const OmProbe* probe, OmSurface* surface);
/// The box around it, in its frame.
OM_API void om_probe_get_bounds(const OmProbe* probe, OmVec3* lo, OmVec3* hi);

/// The probe as an obstacle that moves during a step, for om_tissue_step_among. Engine "pbd" is pressed in this way.
/// @param friction  Coulomb's coefficient; negative: the default of the engine
OM_API OmTissueObstacle om_probe_obstacle(const OmProbe* probe, OmPose begin, OmPose end,
                                          double friction);

// ---- contact surfaces -----------------------------------------------------------------------------

/// The boundary of a mesh as about `ntri` triangles of like size: edges are collapsed, shortest first and
/// away from ridges, or split, longest first. Its vertices lie on or near the boundary.
/// @param ntri  4 to 10 million
/// @return OM_OK; OM_INVALID (ntri is not in 4 to 10,000,000); OM_NO_MEMORY
OM_API OmStatus om_contact_surface_make(const OmTetMesh* mesh, int ntri, OmSurface* surface);

// ---- pressing -------------------------------------------------------------------------------------

typedef enum OmPressMethod {
    OM_PRESS_PENALTY,      // stiff one-sided springs, implicit; the active set is iterated
    OM_PRESS_MULTIPLIERS,  // Signorini's law exactly: free motion, detection, correction
    OM_PRESS_PRESCRIBED    // the area under the probe at first contact moves with the probe
} OmPressMethod;

typedef struct OmPressDef {  // made by om_press_default_def
    // The probe; any other obstacle serves, too. Copied, its ctx is borrowed until destroy. Poses and friction in it
    // are not used.
    OmTissueObstacle obstacle;
    OmPressMethod method;  // default OM_PRESS_PENALTY
    // The contact surface in the rest shape, copied; null: made from the boundary of the mesh.
    const OmSurface* surface;
    int ntri;  // triangles of one that is made; default 1004; 0: the unchanged boundary
    // Contact of the faces of the volume's boundary, not of vertices alone: also the deepest points of its edges and
    // triangles. For convex probes with edges sharper than the faces. Default false. Penalty only; `surface` must be
    // null, and `ntri` is ignored.
    bool has_face_contact;
    // Penalty and prescribed: N/m for each contact point. 0 (default): 100 times the stiffness against moving the
    // point alone, which lets the tissue penetrate by some hundredths of a millimetre.
    double stiffness;
    double friction;  // Coulomb's coefficient, 0 to 10, not for prescribed; default 0
    // Multipliers: largest |min(lambda / lambda_max, gap / edge)|; default 1e-4. 1e-8 is for tests, and needs a linear
    // solver of tolerance 1e-10.
    double tolerance;
    int max_iterations;  // largest number of solves in a substep, >= 1; default 40
    // Multipliers. 0 (default): an augmented Lagrangian; with friction the same as 1. 1: a Delassus matrix in each
    // step. n > 1: n steps share one matrix (thesis: 5); then a step depends on the steps before it.
    int reuse;
    OmVec3 direction;  // prescribed: direction of pressing in the probe's frame; default (0, 0, -1)
    double reach;      // prescribed: depth of the area before the probe, m; default 0.01
    OmCookie cookie;   // set by om_press_default_def
} OmPressDef;

typedef struct OmPressReport {
    OmTissueReport tissue;  // of the linear solver, all solves; substeps
    int nsolve;             // solves with the system matrix, columns of W not counted
    int ncolumn;            // multipliers: columns of W solved for
    int ncontact;           // points that are pushed
    // In all substeps the contact points, the planes that stand for the probe, and friction stopped
    // changing, and the tolerance was met. False only with OM_NOT_CONVERGED.
    bool is_settled;
    OmVec3 force;            // N, by the tissue on the probe, world axes
    OmVec3 torque;           // N m, about the probe's origin, world axes
    double area;             // m^2, of the contact surface at those points that are vertices
    double penetration;      // m, of the deepest point of the contact surface after the step
    double complementarity;  // multipliers: max |min(lambda / lambda_max, gap / edge)|
    // views (ncontact), valid until the next step
    const int* vert;       // contact surface vertex; -1: a point of an edge or a triangle
    const double* point;   // m, world                                    (ncontact x 3)
    const double* normal;  // from the probe to the tissue, world          (ncontact x 3)
    const double* push;    // N, on the tissue                            (ncontact x 3)
    const double* gap;     // m, negative inside                          (ncontact)
} OmPressReport;

/// A probe, a contact surface and scratch memory for one model, for one thread at a time.
typedef struct OmPress OmPress;

OM_API OmPressDef om_press_default_def(const OmProbe* probe);
/// @return OM_OK; OM_INVALID (the message names the field); OM_NO_MEMORY
OM_API OmStatus om_press_create(const OmPressDef* def, const OmTissueModel* model, OmPress** press);
OM_API void om_press_destroy(OmPress* press);
/// Set the pose of the probe, without a path. With OM_PRESS_PRESCRIBED this selects the contact area: the points that
/// face the probe within `reach`.
/// @return OM_OK; OM_INVALID (pose; prescribed: no point under the probe: the message has the distance)
OM_API OmStatus om_press_place(OmPress* press, const OmTissueModel* model,
                               const OmTissueState* state, OmPose pose_world_probe);
/// As om_tissue_step while the probe moves from its pose to `pose_end`; substeps follow the path. Without
/// om_press_place the first step sets the probe to pose_end. om_tissue_contact_force has the forces, too.
/// @return OM_OK; OM_NOT_CONVERGED (advanced; is_settled and tissue.residual give the quality);
///         OM_INVALID (state and probe unchanged); OM_NO_MEMORY (only the first step allocates)
OM_API OmStatus om_press_step(OmPress* press, const OmTissueModel* model, OmTissueState* state,
                              OmTissueWork* work, OmPose pose_end, double h, OmPressReport* report);
/// The pose of the probe at the end of the next step of om_contact_step. Without om_press_place the first step sets the
/// probe there.
/// @return OM_OK; OM_INVALID (pose)
OM_API OmStatus om_press_move(OmPress* press, OmPose pose_end);
/// Probes that act in the following steps of om_contact_step, each by its own method, together with the obstacles of
/// the contact and with each other. Multipliers are then those of the augmented Lagrangian.
/// @param press  borrowed, with the array, until the next call; npress 0: none
OM_API void om_contact_work_set_presses(OmContactWork* contact_work, int npress,
                                        OmPress* const* press);
/// The report of the last step, also of om_contact_step; a view.
OM_API const OmPressReport* om_press_report(const OmPress* press);
/// The current pose of the probe.
OM_API OmPose om_press_pose(const OmPress* press);
/// The contact surface in the rest shape, and the embedding of its vertices in the elements.
OM_API const OmSurface* om_press_surface(const OmPress* press);
OM_API const OmEmbedding* om_press_embedding(const OmPress* press);
/// Distance of the probe at a pose to the nearest point of the deformed contact surface, m, negative inside: how far
/// the probe may still move before contact. Of vertices alone, also with has_face_contact.
OM_API double om_press_eval_gap(const OmPress* press, const OmTissueState* state,
                                OmPose pose_world_probe);

#ifdef __cplusplus
}
#endif
#endif
