/// omentum/contact_tool.h: rigid moving tools that press on tissue (room `contact`, floor 3).
///
/// A tool is a closed rigid shape; a press carries it along a path, one pose a step, and keeps the tissue
/// out of it by one of the thesis's three methods: penalty (3.7), Lagrange multipliers (3.8)-(3.12) or
/// prescribed displacement (3.4.3). Contacts are vertices of a contact surface, a triangle mesh of its own
/// (1,004 triangles whatever the volume mesh, 3.4.4) that the elements carry.
///
///     OmToolDef probe = om_tool_default_def(OM_TOOL_BOX);         // 50 x 10 mm, presses along its -z
///     om_tool_create(&probe, &tool);
///     OmPressDef def = om_press_default_def(tool);
///     om_press_create(&def, model, &press);
///     om_press_place(press, model, state, pose_first_touch);
///     om_press_step(press, model, state, work, pose_next, 0.02, &report);   // report.force, N
///     om_press_step(press, model, state, work, pose_after, 0.02, &report);
#ifndef OMENTUM_CONTACT_TOOL_H
#define OMENTUM_CONTACT_TOOL_H

#include "omentum/shape.h"
#include "omentum/tissue.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- tools ----------------------------------------------------------------------------------------

typedef enum OmToolShape {
    OM_TOOL_BOX,      // its pressing face has its centre at the origin, its body lies at z >= 0
    OM_TOOL_SPHERE,   // its centre is the origin
    OM_TOOL_CAPSULE,  // all within radius of the segment from the origin to (0, 0, length)
    OM_TOOL_MESH      // a closed surface in the tool's own frame
} OmToolShape;

typedef struct OmToolDef {  // made by om_tool_default_def; lengths in m
    OmToolShape shape;      //
    OmVec3 size;            // box: its sides; default 50 x 10 x 60 mm
    double rounding;        // box: radius of its edges, >= 0, at most half its sides; default 1 mm
    double radius;          // sphere and capsule; default 25 mm and 5 mm
    double length;          // capsule, >= 0; default 50 mm
    const OmSurface* surface;  // mesh: closed, outward; copied by create
    uint32_t cookie;           // set by om_tool_default_def
} OmToolDef;

typedef struct OmTool OmTool;  // constant; may be used by any number of threads

OM_API OmToolDef om_tool_default_def(OmToolShape shape);
/// @return OM_OK; OM_INVALID (the message names the field, or the edge that leaves a mesh open); OM_NO_MEMORY
OM_API OmStatus om_tool_create(const OmToolDef* def, OmTool** tool);
OM_API void om_tool_destroy(OmTool* tool);
/// Exact signed distance of p to the tool's surface in the tool's frame, m, negative inside.
/// @param normal  unit, the direction in which the distance grows; may be null
OM_API double om_tool_eval_distance(const OmTool* tool, OmVec3 p, OmVec3* normal);
/// Triangles to draw, in the tool's frame; the caller frees with om_surface_done.
OM_API OmStatus om_tool_get_surface(const OmTool* tool, OmSurface* surface);
/// The box around it, in its frame.
OM_API void om_tool_get_bounds(const OmTool* tool, OmVec3* lo, OmVec3* hi);

// ---- contact surfaces -----------------------------------------------------------------------------

/// The boundary of a mesh as about `ntri` triangles of like size: edges are collapsed, shortest first and
/// away from ridges, or split, longest first. Its vertices lie on or near the boundary.
/// @param ntri  4 to 10 million
OM_API OmStatus om_contact_surface_make(const OmTetMesh* mesh, int ntri, OmSurface* surface);

// ---- pressing -------------------------------------------------------------------------------------

typedef enum OmPressMethod {
    OM_PRESS_PENALTY,  // stiff one-sided springs, implicit, the touching set iterated in the step
    OM_PRESS_MULTIPLIERS,  // Signorini's law met exactly: free motion, detection, correction
    OM_PRESS_PRESCRIBED    // the area under the tool at first touch moves as the tool does
} OmPressMethod;

typedef struct OmPressDef {  // made by om_press_default_def
    const OmTool* tool;      // borrowed until destroy
    OmPressMethod method;    // default OM_PRESS_PENALTY
    const OmSurface*
        surface;       // contact surface in the rest shape, copied; null: made from the boundary
    int ntri;          // triangles of one that is made; default 1004; 0: the boundary as it is
    double stiffness;  // N/m a contact, penalty and prescribed; default 0: 1000 times what resists
                       // moving the point alone, so that tissue sinks in by micrometres
    double friction;   // Coulomb's coefficient, 0 to 10, not for prescribed; default 0
    double tolerance;  // multipliers: largest |min(lambda / lambda_max, gap / edge)|; default 1e-4;
                       // 1e-8 is the test mode and needs a linear solver as exact (1e-10)
    int max_iterations;  // solves of a (sub)step at most, >= 1; default 20
    int reuse;  // multipliers: steps that share one Delassus matrix, the thesis's variant: 5;
                // default 1. Above 1 a step depends on those before it
    OmVec3 direction;  // prescribed: where the tool presses to, in its frame; default (0, 0, -1)
    double reach;      // prescribed: how far before the tool its area lies, m; default 0.01
    uint32_t cookie;   // set by om_press_default_def
} OmPressDef;

typedef struct OmPressReport {
    OmTissueReport tissue;  // of the linear solver, all solves; substeps
    int nsolve;             // solves with the system matrix, columns of W not counted
    int ncolumn;            // multipliers: columns of W solved for
    int ncontact;           // points that are pushed
    bool is_settled;        // the set of touching points stopped changing, tolerance met
    OmVec3 force;           // N, by the tissue on the tool, world axes
    OmVec3 torque;          // N m, about the tool's origin, world axes
    double area;            // m^2, of the contact surface at those points
    double
        penetration;  // m, the deepest point of the contact surface inside the tool after the step
    double complementarity;  // multipliers: max |min(lambda / lambda_max, gap / edge)|
    // views (ncontact), valid until the next step
    const int* vert;       // contact surface vertex
    const double* point;   // m, world                                    (ncontact x 3)
    const double* normal;  // from the tool to the tissue, world          (ncontact x 3)
    const double* push;    // N, on the tissue                            (ncontact x 3)
    const double* gap;     // m, negative inside                          (ncontact)
} OmPressReport;

/// A tool, a contact surface and scratch for one model; not to be used by two threads at once.
typedef struct OmPress OmPress;

OM_API OmPressDef om_press_default_def(const OmTool* tool);
/// @return OM_OK; OM_INVALID (the message names the field); OM_NO_MEMORY
OM_API OmStatus om_press_create(const OmPressDef* def, const OmTissueModel* model, OmPress** press);
OM_API void om_press_destroy(OmPress* press);
/// Put the tool down at a pose, without a path that leads there. With OM_PRESS_PRESCRIBED this takes the
/// contact area: the points that face the tool within `reach` before it.
/// @return OM_OK; OM_INVALID (pose; prescribed: no point under the tool: the message has the distance)
OM_API OmStatus om_press_place(OmPress* press, const OmTissueModel* model,
                               const OmTissueState* state, OmPose pose_world_tool);
/// As om_tissue_step while the tool moves from where it is to `pose_end`; substeps go along the path. The
/// first step without a place puts the tool at pose_end. Forces are also in om_tissue_contact_force.
/// @return OM_OK; OM_NOT_CONVERGED (advanced; is_settled or tissue.residual say how good);
///         OM_INVALID (state and tool unchanged); OM_NO_MEMORY (only the first step allocates)
OM_API OmStatus om_press_step(OmPress* press, const OmTissueModel* model, OmTissueState* state,
                              OmTissueWork* work, OmPose pose_end, double h, OmPressReport* report);
/// Where the tool is.
OM_API OmPose om_press_pose(const OmPress* press);
/// The contact surface in the rest shape, and what carries its vertices.
OM_API const OmSurface* om_press_surface(const OmPress* press);
OM_API const OmEmbedding* om_press_embedding(const OmPress* press);
/// Distance of the tool at `pose` to the nearest point of the contact surface as the state has it, m,
/// negative inside: how far a tool may come before it touches.
OM_API double om_press_eval_gap(const OmPress* press, const OmTissueState* state,
                                OmPose pose_world_tool);

#ifdef __cplusplus
}
#endif
#endif
