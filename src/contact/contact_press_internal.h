// contact_press_internal.h: shared by the files of pressing. Each file calls only files above it in this list:
//
//   contact_probe_mesh.c, contact_probe.c   shapes and their distances
//   contact_surface.c                       the triangle mesh whose vertices are contact points
//   contact_face.c                          deepest points of edges and triangles
//   contact_point.c                         contact points near a probe and their planes
//   contact_prescribed.c                    the area that moves with the probe
//   contact_penalty.c                       penalty and augmented Lagrangian inside a step
//   contact_multiplier.c                    multipliers with a Delassus matrix inside a step
//   contact_press.c                         definition, memory, pose, report
//   contact_step.c                          the step
#ifndef OMENTUM_CONTACT_PRESS_INTERNAL_H
#define OMENTUM_CONTACT_PRESS_INTERNAL_H

#include "contact/contact_internal.h"
#include "omentum/contact_tool.h"

#define OM_PRESS_RECOVER 0.1  // m/s, speed at which tissue that began inside a probe is pushed out
#define OM_PRESS_SLOW 1e-3    // m/s, friction is viscous below it
#define OM_PRESS_ACTIVATE \
    1e-6  // of the model's size: penetration at which a free point becomes active
#define OM_PRESS_RELEASE 1e-8      // of the model's size: gap at which an active point is released
#define OM_PRESS_PLANE_GAP 2e-5    // of the model's size: error of a plane that is linearised again
#define OM_PRESS_PLANE_ANGLE 2e-3  // rad, the same of its normal
#define OM_PRESS_ANGLE_BY_FRICTION \
    0.01  // of the friction coefficient, the same where there is friction

// ---- contact_probe_mesh.c ---------------------------------------------------------------------------

typedef struct OmProbeMesh OmProbeMesh;
OmStatus om__probe_mesh_create(const OmSurface* surface, OmProbeMesh** mesh);
void om__probe_mesh_destroy(OmProbeMesh* mesh);
double om__probe_mesh_distance(const OmProbeMesh* mesh, OmVec3 p, OmVec3* normal);
const OmSurface* om__probe_mesh_surface(const OmProbeMesh* mesh);

struct OmProbe {
    OmProbeDef def;
    OmProbeMesh* mesh;  // of OM_PROBE_MESH
    OmVec3 lo, hi;
    double thickness;  // m; a path is checked in pieces shorter than half of it
};

// ---- pressing -----------------------------------------------------------------------------------------

typedef struct OmPressPoint {  // a point of the contact surface near the probe, in one (sub)step
    int vert;                  // of the contact surface
    OmVec3 x;                  // at the beginning of the step, m
    OmVec3 n;                  // from the probe to the tissue, unit, at the end of the step
    double gap;                // m, of x to the probe's tangent plane at the end of the step
    double goal;               // m, gap required at the end of the step, <= 0
    // linearisation
    OmVec3 at;                   // m, displacement of the point at which the plane was linearised
    OmVec3 last_at, last_error;  // m, the same of the plane before, and the error of its prediction
    int nlinear;                 // times the plane was linearised again in this step
    OmVec3 predicted;            // m, displacement of the point before the first solve
    OmVec3 probe_move;           // m, displacement of the probe's surface at the point in the step
    double k;                    // N/m, penalty
    double damp;                 // N/m, against displacements along the plane from `at`
    bool is_active;              //
    bool is_parked;              // not at the deepest place of its edge or triangle
    // predicted behind the probe, where the nearest face is not the one it entered
    bool is_crossing;
    bool is_prescribed;        // held at x + probe_move by a spring in all directions
    double depth, depth_rate;  // m, penetration at the start of a line search, and its decrease
    double multiplier;  // N, normal force besides the spring; above 0 in augmented Lagrangians only
    double push;        // N, normal force of the last solve
    double friction_max;     // N, Coulomb's bound by the normal force before the solve
    OmVec3 friction, f;      // N, friction and total force in the next solve at zero displacement
    OmMat3 friction_K, K;    // N/m, and their decrease with the displacement
    OmVec3 slip, slip_step;  // m, slip along the plane at the start of a line search, and its step
    OmVec3 force;            // N, on the tissue
} OmPressPoint;

typedef struct OmPressLcp OmPressLcp;  // contact_multiplier.c

struct OmPress {
    OmPressDef def;
    const OmTissueModel* model;
    OmSurface surface;
    OmEmbedding embedding;
    int nedge;    // of has_face_contact: edges of the surface
    int npoint;   // contact points: vertices, edges, triangles
    double size;  // m, of the model
    double edge;  // m, mean edge of the contact surface
    // of the probe: INFINITY where the obstacle has none
    double thickness, radius;  // m; radius of a ball around the probe
    OmVec3 middle;             // of that ball, in the probe's frame
    bool is_placed;
    OmPose pose;
    OmPose goal;  // pose at the end of the next step, where has_goal or is_placed
    bool has_goal;
    // the path of the step
    OmPose begin, end;
    double time, h;             // start and length of the step
    double substep_time;        // when its substep begins
    bool has_settled;           // in its substeps before that
    OmPose from, to;            // of the substep
    OmMat3 turn_from, turn_to;  // their rotations
    // substep of the last detection: a second detection in one substep predicts from its solution
    double detect_time, detect_h;
    int nnear;           //
    OmPressPoint* near;  // points near the probe                                (points)
    int* near_of;        // entry of each point in `near`, -1 if none            (points)
    int narea;           // prescribed: points that move with the probe
    int* area;           //                                                      (points)
    double* area_place;  // positions of these points in the probe's frame  (points x 3)
    double* tri_area;    // m^2, a third of the triangles at each point          (points)
    double *last, *increment,
        *scratch;     // a solution, and the step from it to the next  (nvert x 3)
    OmPressLcp* lcp;  // of OM_PRESS_MULTIPLIERS
    OmPressReport report;
    int* out_vert;  // arrays of the report                                  (points)
    double *out_point, *out_normal, *out_push, *out_gap;
};

static inline OmVec3 om__press_local(OmPose pose, OmVec3 x) {
    return om_quat_rotate(om_quat_conj(pose.q), om_sub(x, pose.p));
}

// ---- contact_face.c

/// The boundary of the volume as surface, its edges, and the embedding of all points.
OmStatus om__press_make_faces(OmPress* press);
typedef enum OmPressPlace {
    OM_PRESS_FAR,      // the edge or triangle cannot touch the probe
    OM_PRESS_PARKED,   // a corner or another point is deeper
    OM_PRESS_DEEPEST,  // the point is at the deepest place
    OM_PRESS_MOVED     // it slid there, and its plane is linearised again
} OmPressPlace;
/// Slide point i of an edge or a triangle to where it is deepest in the probe at the end of the substep, as predicted.
OmPressPlace om__press_place(OmPress* press, const OmTissueState* state, const OmTissueWork* work,
                             int i, double h, bool is_first);
/// The same by the last solution.
OmPressPlace om__press_follow(OmPress* press, OmPressPoint* point, const OmTissueState* state,
                              const OmTissueWork* work, double h);
static inline bool om__press_is_sliding(const OmPress* press, int i) {
    return i >= press->surface.nvert;
}

// ---- contact_point.c

/// Signed distance of q, in the probe's frame, to the probe.
double om__press_distance(const OmPress* press, OmVec3 q);
/// True if tools and attachments prescribe all vertices that determine the point.
bool om__press_is_still(const OmPress* press, const OmTissueState* state, int i);
/// Begin a (sub)step of length h: poses of the probe at its begin and its end.
void om__press_path(OmPress* press, const OmTissueState* state, double h);
/// Position of point i when vertices are at x.
OmVec3 om__press_position(const OmPress* press, const double* x, int i);
/// Displacement of point i in the step by the last solution.
OmVec3 om__press_displacement(const OmPress* press, const OmTissueState* state,
                              const OmTissueWork* work, int i, double h);
/// Fill `near` with the points near the probe; their planes are linearised at the predicted positions.
void om__press_detect(OmPress* press, const OmTissueState* state, const OmTissueWork* work,
                      double h);
/// Linearise the plane of a point predicted at p; returns the true gap there.
double om__press_linearise(const OmPress* press, OmPressPoint* point, OmVec3 p);
/// Linearise the plane again if its gap or its angle at p is off; returns whether that was done.
/// @param tilt  rad, angle of the point's force to its normal besides that of friction
bool om__press_update_plane(const OmPress* press, OmPressPoint* point, OmVec3 p, double tilt);
/// True gap of a point predicted at p at the end of the step.
double om__press_gap(const OmPress* press, OmVec3 p);
/// True if a shorter substep than this one is available.
bool om__press_may_cut(const OmPress* press, double h);
/// Compare true gaps of all points with their goals, and ask for a shorter step where one is available.
/// @return OM_OK; OM_INVALID (a point is too deep)
OmStatus om__press_check_depth(const OmPress* press, const OmTissueState* state,
                               const OmTissueWork* work, double h);
/// Resistance against moving point i alone, N/m.
double om__press_stiffness(const OmPress* press, const OmTissueWork* work, int i);
/// Estimate of the contact force, N: the force that moves each point alone to its goal.
double om__press_estimate_force(const OmPress* press, const OmTissueWork* work);
OmStatus om__press_add_force(const OmPress* press, OmTissueWork* work, int i, OmVec3 f, OmMat3 K);

// ---- contact_prescribed.c

/// Select the points that face the probe at that pose.
OmStatus om__press_select_area(OmPress* press, const OmTissueState* state, OmPose pose);
/// Turn the points of the area into springs to their positions at the end of the step.
void om__press_prescribe(OmPress* press, const OmTissueState* state);

// ---- contact_penalty.c

typedef struct OmContactGroup {  // everything that acts in one step
    OmContactWork* contact;      // vertices against obstacles; null: none
    int npress;                  // at least 1
    OmPress* const* press;
} OmContactGroup;

/// Springs of all members; the paths of obstacles and probes are set.
OmStatus om__contact_penalty(const OmContactGroup* group, const OmTissueModel* model,
                             OmTissueState* state, OmTissueWork* work, double h,
                             OmTissueReport* report);
/// Signorini's law by an augmented Lagrangian (Simo and Laursen 1992): the multipliers are increased by the forces of
/// the penalty springs until def.tolerance is met.
/// Probes of the other methods, and vertices, keep their springs.
OmStatus om__contact_augmented(const OmContactGroup* group, const OmTissueModel* model,
                               OmTissueState* state, OmTissueWork* work, double h,
                               OmTissueReport* report);

// ---- contact_multiplier.c

OmStatus om__press_lcp_create(OmPressLcp** lcp);
void om__press_lcp_destroy(OmPressLcp* lcp);
void om__press_lcp_forget(OmPressLcp* lcp);
/// A group with multipliers. The Delassus matrix serves a single probe without other obstacles.
OmStatus om__contact_multipliers(const OmContactGroup* group, const OmTissueModel* model,
                                 OmTissueState* state, OmTissueWork* work, double h,
                                 OmTissueReport* report);

// ---- contact_press.c

/// @return OM_OK; OM_INVALID (not finite, or the quaternion is not of unit length)
OmStatus om__press_check_pose(OmPose pose);
/// Add the forces of the points to the contact forces of the state.
void om__press_write_forces(const OmPress* press, OmTissueState* state);
/// The report of a finished step.
void om__press_report_points(OmPress* press, const OmTissueState* state);

#endif
