// contact_press_internal.h: what the files of pressing share.
//
//   contact_probe.c, contact_probe_mesh.c   shapes and their distances
//   contact_surface.c                       the triangle mesh whose vertices touch
//   contact_press.c                         detection, the step, the report
//   contact_penalty.c, contact_multiplier.c, contact_prescribed.c   what happens inside a step
#ifndef OMENTUM_CONTACT_PRESS_INTERNAL_H
#define OMENTUM_CONTACT_PRESS_INTERNAL_H

#include "omentum/contact_tool.h"

#define OM_PRESS_RECOVER 0.1  // m/s, how fast tissue that began inside a probe is pushed out
#define OM_PRESS_SLOW 1e-3    // m/s, friction is viscous below it
#define OM_PRESS_TAKE 1e-6    // of the model's size: went in
#define OM_PRESS_LET_GO 1e-8  // of the model's size: pulled
#define OM_PRESS_FLAT 2e-5    // of the model's size: a plane farther from the probe is laid again
#define OM_PRESS_ANGLE 2e-3   // rad, and one that is turned by more
#define OM_PRESS_SHARE 0.01   // of the friction coefficient, the same angle where there is friction

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
    double thickness;  // m; a path is looked at in pieces shorter than half of it
};

// ---- pressing -----------------------------------------------------------------------------------------

typedef struct OmTouch {  // a point of the contact surface near the probe, in one (sub)step
    int point;
    OmVec3 x;     // at the beginning of the step, m
    OmVec3 n;     // from the probe to the tissue, unit, at the end of the step
    double gap;   // m, of x by the plane that stands for the probe at the end of the step
    double goal;  // m, the gap asked for, <= 0
    OmVec3 at;    // m, displacement of the point at which the plane was linearised
    OmVec3 was_at, was_miss;  // m, the same of the plane before, and the error of its prediction
    int nlaid;                // times the plane was linearised again in this step
    OmVec3 guess;             // m, predicted displacement of the point
    OmVec3 slip;              // m, displacement of the probe's surface there in the step
    double k;                 // N/m, penalty
    double damp;              // N/m, against moves along the plane from `at`
    bool is_active;
    bool
        is_through;  // its predicted position is behind the probe, where the nearest face is a wrong one
    bool is_glued;    // held at x + slip by a spring in all directions
    double in, rate;  // m, penetration at the beginning of a line search, and its decrease along it
    double multiplier;  // N, normal force that the spring adds to; 0 but for augmented Lagrangians
    double push;        // N, normal force of the last solve
    double bound;       // N, friction of the penalty method at most, by the push before the solve
    OmVec3 rub, f;      // N, friction in the next solve, and all: what they are if the point stays;
    OmMat3 rub_K, K;    // N/m, and how they fall as it moves
    OmVec3 rel,
        rel_way;   // m, slip along the plane at the beginning of a way, and what the way adds
    OmVec3 force;  // N, on the tissue
} OmTouch;

typedef struct OmPressLcp OmPressLcp;  // contact_multiplier.c

struct OmPress {
    OmPressDef def;
    const OmTissueModel* model;
    OmSurface surface;
    OmEmbedding embedding;
    double size;  // m, of the model
    double edge;  // m, mean edge of the contact surface
    bool is_placed;
    OmPose pose;
    // the path of the step
    OmPose begin, end;
    double time, h;             // when it began, and how long it is
    double substep_time;        // when its substep begins
    bool has_settled;           // in its substeps before that
    OmPose from, to;            // of the substep
    OmMat3 turn_from, turn_to;  // their rotations
    double seen_time,
        seen_h;        // of the last linear problem: one of the same step goes on from its solution
    int ntouch;        //
    OmTouch* touch;    //                                                  (points)
    int* touch_of;     // of each point, -1 if none                        (points)
    int narea;         // prescribed: points that move with the probe
    int* area;         //                                                  (points)
    double* grip;      // where they are in its frame                      (points x 3)
    double* tri_area;  // m^2, a third of the triangles at each point      (points)
    double *last, *way, *scratch;  // a solution, the way from it to the next  (nvert x 3)
    OmPressLcp* lcp;               // of OM_PRESS_MULTIPLIERS
    OmPressReport report;
    int* out_vert;  // what the report shows                                  (points)
    double *out_point, *out_normal, *out_push, *out_gap;
};

static inline OmVec3 om__press_local(OmPose pose, OmVec3 x) {
    return om_quat_rotate(om_quat_conj(pose.q), om_sub(x, pose.p));
}
/// Is the point carried by vertices that are held or attached only?
bool om__press_is_still(const OmPress* press, const OmTissueState* state, int i);
/// Begin a (sub)step of length h: where the probe goes in it.
void om__press_path(OmPress* press, const OmTissueState* state, double h);
/// Place of point i when vertices are at x.
OmVec3 om__press_point(const OmPress* press, const double* x, int i);
/// How far the point goes in the step by the last solution.
OmVec3 om__press_move(const OmPress* press, const OmTissueState* state, const OmTissueWork* work,
                      int i, double h);
/// Fill `touch` with the points near the probe, planes laid where the last solution expects them.
void om__press_detect(OmPress* press, const OmTissueState* state, const OmTissueWork* work,
                      double h);
/// Lay the plane of a touch for a point expected at p, and tell the true gap there.
double om__press_linearise(const OmPress* press, OmTouch* touch, OmVec3 p);
/// Lay the plane anew if at p it is not the probe any more, by distance or by angle; whether it was laid.
/// @param lean  rad, by which something else than friction turns the force on the touch away from its normal
bool om__press_bend(const OmPress* press, OmTouch* touch, OmVec3 p, double lean);
/// True gap of a point expected at p at the end of the step.
double om__press_gap(const OmPress* press, OmVec3 p);
/// Will a shorter substep than this one be tried?
bool om__press_may_cut(const OmPress* press, double h);
/// Are all touches where they should be, not only by the planes that stood for the probe? Says so, and asks for a
/// shorter step while there is one.
OmStatus om__press_check_depth(const OmPress* press, const OmTissueState* state,
                               const OmTissueWork* work, double h);
/// What resists moving point i alone, N/m.
double om__press_stiffness(const OmPress* press, const OmTissueWork* work, int i);
/// About the force that the touches will need, N: what moves each point alone as far as it must go.
double om__press_guess_force(const OmPress* press, const OmTissueWork* work);
OmStatus om__press_add_force(const OmPress* press, OmTissueWork* work, int i, OmVec3 f, OmMat3 K);

/// Methods, each an OmTissueStepFn with the press as its context.
OmStatus om__press_penalty(void* ctx, const OmTissueModel* model, OmTissueState* state,
                           OmTissueWork* work, double h, OmTissueReport* report);
/// Signorini's law by the penalty method: springs that give what multipliers miss, which then take it over
/// (augmented Lagrangian, Simo and Laursen 1992), until def.tolerance is met.
OmStatus om__press_augmented(OmPress* press, const OmTissueModel* model, OmTissueState* state,
                             OmTissueWork* work, double h, OmTissueReport* report);
OmStatus om__press_multipliers(void* ctx, const OmTissueModel* model, OmTissueState* state,
                               OmTissueWork* work, double h, OmTissueReport* report);

// ---- contact_prescribed.c ---------------------------------------------------------------------------

/// The points that face the probe at that pose.
OmStatus om__press_take_area(OmPress* press, const OmTissueState* state, OmPose pose);
/// Turn the touches of the area into springs to their places at the end of the step.
void om__press_glue(OmPress* press, const OmTissueState* state);

OmStatus om__press_lcp_create(OmPressLcp** lcp);
void om__press_lcp_destroy(OmPressLcp* lcp);
void om__press_lcp_forget(OmPressLcp* lcp);

#endif
