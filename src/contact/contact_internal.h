// contact_internal.h: shared by the files of the room. Each file calls only files above it in this list:
//
//   contact_obstacle.c   obstacles and their distances
//   contact_vertex.c     contact of vertices inside a step
//   contact_model.c      definition and memory
//   contact_step.c       the step
#ifndef OMENTUM_CONTACT_INTERNAL_H
#define OMENTUM_CONTACT_INTERNAL_H

#include "omentum/contact.h"

typedef struct OmContactPair {  // a vertex near an obstacle, in one step
    int vert, obstacle;
    OmVec3 n;     // from the obstacle to the tissue, unit
    double gap;   // m, at the beginning of the step, by the tangent plane of the obstacle
    double goal;  // m, gap required at the end of the step, <= 0
    OmVec3 at;    // m, displacement of the vertex at which the plane was linearised
    OmMat3 C;     // 1/m, rotation of the plane: n - C (d - at) at a displacement d; where is_curved
    bool is_curved;   //
    double was_push;  // N, in the last solve
    OmVec3 force;     // N, of the last solve
    double k;         // N/m
    double push;      // N, normal force of the last solve
    double drag;      // N s/m, friction in the next solve
    double was_drag;  // N s/m, in the last solve
    bool is_active;   //
    bool is_closed;   // stays free for the rest of this step
} OmContactPair;

struct OmContact {          // constant
    OmContactDef def;       // its obstacles are those below
    OmContactPlane* plane;  // normals of unit length; of obstacles that are planes  (nobstacle)
    OmTissueObstacle* obstacle;  // offset and friction include the contact's       (nobstacle)
    double size;                 // m, of the model, which scales tolerances
    double ring;        // m, radius around a point over which the normal of an obstacle is averaged
    int nsurface;       //
    int* surface_vert;  // vertices that may be in contact                          (nsurface)
};

struct OmContactWork {
    const OmContact* contact;
    OmTissueObstacle* obstacle;  // copies; a step writes their outcome             (nobstacle)
    int npair;                   //
    OmContactPair* pair;         //                                       (nsurface x nobstacle)
    double h;                    // s, of the step
    double seen_time;            // s, when its substep begins
    bool has_settled;            // in its substeps before that
    OmContactReport report;      // of the step
};

// ---- contact_obstacle.c

OmStatus om__contact_check_obstacles(const OmContactDef* def);
/// Make the obstacles of the contact from those of its definition; memory for them was allocated before.
void om__contact_copy_obstacles(OmContact* contact, const OmContactDef* def);
/// Signed distance of p to an obstacle less the offset, and the unit normal.
double om__contact_gap(const OmContact* contact, int obstacle, OmVec3 p, OmVec3* n);

// ---- contact_vertex.c

/// Fill `pair` with the vertices near obstacles; active where the last step pushed, or the vertex would penetrate if
/// nothing else acted.
void om__contact_find_pairs(OmContactWork* cw, const OmTissueModel* model, OmTissueState* state,
                            const OmTissueWork* work, double h);
/// Add the forces of active pairs to the system.
void om__contact_add_forces(OmContactWork* cw, OmTissueWork* work, double h);
/// Compare the pairs with the last solution; returns how many changed.
int om__contact_update_pairs(OmContactWork* cw, const OmTissueState* state,
                             const OmTissueWork* work, double h, bool is_damped);
/// Free pairs stay free from now on.
void om__contact_close_set(OmContactWork* cw);
/// Forces into the state; count, resultant and penetration into the report.
void om__contact_report_pairs(OmContactWork* cw, const OmTissueModel* model, OmTissueState* state,
                              const OmTissueWork* work, double h);

#endif
