// contact_internal.h: shared by the files of the room. Each file calls only files above it in this list:
//
//   contact_obstacle.c   obstacles and their distances
//   contact_vertex.c     contact of vertices inside a step
//   contact_self.h       contact of the tissue with itself
//   contact_skin.h       contact with smooth surfaces that ride on bodies
//   contact_model.c      definition and memory
//   contact_step.c       the step
#ifndef OMENTUM_CONTACT_INTERNAL_H
#define OMENTUM_CONTACT_INTERNAL_H

#include "contact/contact_self.h"
#include "contact/contact_skin.h"

typedef struct OmContactPair {  // a vertex near an obstacle, in one step
    int vert, obstacle;
    OmVec3 n;     // from the obstacle to the tissue, unit
    double gap;   // m, at the beginning of the step, by the tangent plane of the obstacle
    double goal;  // m, gap required at the end of the step, <= 0
    OmVec3 at;    // m, displacement of the vertex at which the plane was linearised
    OmMat3 C;     // 1/m, rotation of the plane: n - C (d - at) at a displacement d; where is_curved
    bool is_curved;            //
    double was_push;           // N, in the last solve
    OmVec3 force;              // N, of the last solve
    double k;                  // N/m
    double push;               // N, normal force of the last solve
    double drag;               // N s/m, friction in the next solve
    double was_drag;           // N s/m, in the last solve
    bool is_active;            //
    OmVec3 obstacle_move;      // m, displacement of the obstacle at the vertex in the step
    bool is_moving;            // it is not zero
    double depth, depth_rate;  // m, penetration at the start of a line search, and its decrease
    bool is_closed;            // stays free for the rest of this step
} OmContactPair;

struct OmContact {          // constant
    OmContactDef def;       // its obstacles are those below
    OmContactPlane* plane;  // normals of unit length; of obstacles that are planes  (nobstacle)
    OmTissueObstacle* obstacle;  // offset and friction include the contact's       (nobstacle)
    double size;                 // m, of the model, which scales tolerances
    double ring;        // m, radius around a point over which the normal of an obstacle is averaged
    int nvert;          // of the model
    int nsurface;       //
    int* surface_vert;  // vertices that may be in contact                          (nsurface)
    int ntri;           // of the boundary; 0 without tetrahedra
    int* tri_vert;      // vertices, counter-clockwise seen from outside             (ntri x 3)
    int nbody;          // pieces of the mesh, in the order of their first vertices
    int* body;          // of each vertex; null without self_contact and skins          (nvert)
    int* skin_of;  // the skin of each body, -1: none                                    (nbody)
    OmSelf* self;  // null without self_contact
    int nskin;
    OmRide* skin;          //                                                            (nskin)
    double skin_friction;  // not below 0
};

typedef struct OmContactFrame {  // an obstacle in a substep
    OmPose begin, end;           // pose_world_obstacle
    OmPose inverse_begin, inverse_end;
    bool is_identity;  // all of these
} OmContactFrame;

typedef struct OmContactLine {  // a line search: the step of dv from one solution to the next
    double slope, curve;        // J, of the part of Phi that is a parabola
    double farthest;            // m, displacement of a contact point in the whole step
} OmContactLine;

struct OmContactWork {
    const OmContact* contact;
    OmTissueObstacle* obstacle;  // copies; a step writes their outcome             (nobstacle)
    int npair;                   //
    OmContactPair* pair;         //                                       (nsurface x nobstacle)
    OmContactFrame* frame;       //                                                 (nobstacle)
    double* normal;          // outward, area-weighted, at the beginning of the substep  (nvert x 3)
    bool has_normal;         // `normal` is that of this substep
    int nactive;             // active pairs in the next solve
    int nswitch;             // pairs that the last update activated or released
    double time, h;          // s, start and length of the step
    double substep_time;     // s, when its substep begins
    bool has_settled;        // in its substeps before that
    OmContactReport report;  // of the step
    OmSelfWork* self;        // null without self_contact
    OmRideWork* ride;        // null without skins
    int ntouch, max_touch;   // places of the last substep
    OmContactTouch* touch;
    int npress;  // probes that act in the same step
    struct OmPress* const* press;
};

// ---- contact_obstacle.c

OmStatus om__contact_check_obstacles(const OmContactDef* def);
/// Make the obstacles of the contact from those of its definition; memory for them was allocated before.
void om__contact_copy_obstacles(OmContact* contact, const OmContactDef* def);
bool om__contact_is_pose(OmPose pose);
/// Pose at the fraction t of the path from begin to end.
OmPose om__contact_pose_at(OmPose begin, OmPose end, double t);
/// Poses of the obstacles in a substep of h seconds that begins at `time`.
void om__contact_begin_substep(OmContactWork* cw, double time, double h);
/// Signed distance of p to an obstacle less the offset, and the unit normal, at the begin or the end of a substep.
double om__contact_gap(const OmContactWork* cw, int obstacle, bool is_end, OmVec3 p, OmVec3* n);
/// Displacement in the substep of the point of an obstacle that is at p at its begin.
OmVec3 om__contact_obstacle_move(const OmContactWork* cw, int obstacle, OmVec3 p);

// ---- contact_vertex.c

/// Fill `pair` with the vertices near obstacles; a pair is active if the last step pushed it, if the vertex is inside,
/// or if it would be inside at x + h v and the surface there looks at the obstacle.
/// Each of these also does the work of its siblings in contact_skin.h and contact_self.h, or that of contact_pair.h for
/// the pairs of both.
/// @return OM_OK; OM_NO_MEMORY
OmStatus om__contact_find_pairs(OmContactWork* cw, const OmTissueModel* model, OmTissueState* state,
                                const OmTissueWork* work, double h);
/// True if the surface around vertex i at the beginning looks against the normal n of what it may touch.
bool om__contact_is_facing(OmContactWork* cw, const double* x, int i, OmVec3 n);
/// Estimate of the contact force, N: the force that moves each penetrating vertex alone out of obstacles that move.
double om__contact_estimate_force(const OmContactWork* cw, const OmTissueState* state, double h);
/// Add the forces of active pairs to the system.
OmStatus om__contact_add_forces(OmContactWork* cw, OmTissueWork* work, double h);
/// Compare the pairs with the last solution; out: how many changed.
OmStatus om__contact_update_pairs(OmContactWork* cw, const OmTissueModel* model,
                                  OmTissueState* state, const OmTissueWork* work, double h,
                                  bool is_damped, int* nchange);
/// Begin a line search from the solution `last` along `increment`: subtract the springs of the pairs from the parabola.
void om__contact_begin_line(OmContactWork* cw, const OmTissueState* state, const double* last,
                            const double* increment, double h, OmContactLine* line);
/// Subtract from the slope at the fraction `at` of the increment the springs of the pairs.
void om__contact_add_line(const OmContactWork* cw, double at, double* slope);
/// Free pairs stay free from now on.
void om__contact_close_set(OmContactWork* cw);
/// Write forces to the state; number of contacts, resultant and penetration to the report.
OmStatus om__contact_report_pairs(OmContactWork* cw, const OmTissueModel* model,
                                  OmTissueState* state, const OmTissueWork* work, double h);

#endif
