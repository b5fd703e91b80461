// contact_internal.h: what the files of the room share.
#ifndef OMENTUM_CONTACT_INTERNAL_H
#define OMENTUM_CONTACT_INTERNAL_H

#include "omentum/contact.h"

typedef struct OmContactPair {  // a vertex near an obstacle, in one step
    int vert, obstacle;
    OmVec3 n;         // from the obstacle to the tissue, unit
    double gap;       // m, at the beginning of the step, by the plane that stands for the obstacle
    double goal;      // m, the gap that is asked for at its end, <= 0
    OmVec3 at;        // m, the move for which the plane was laid
    OmMat3 C;         // 1/m, how the plane turns: n - C (d - at) at a move d; where is_bent
    bool is_bent;     //
    double was_push;  // N, in the last solve
    OmVec3 force;     // N, of the last solve
    double k;         // N/m
    double push;      // N, normal force of the last solve
    double drag;      // N s/m, friction in the next solve
    double was_drag;  // N s/m, in the last solve
    bool is_active;   //
    bool was_let_go;  // left the active set in this step
} OmContactPair;

typedef struct OmContactAmong {  // which obstacle of which contact
    const OmContact* contact;
    int obstacle;
} OmContactAmong;

struct OmContact {
    OmContactDef def;        // its arrays are the copies below; friction >= 0
    bool has_own_friction;   // the engine's own was wanted, where it has one
    OmContactPlane* plane;   // normals of unit length
    const OmSdf** sdf;       //
    OmContactField* field;   //
    int nobstacle;           // planes, then sdfs, then fields
    double size;             // m, of the model, which scales tolerances
    int nsurface;            //
    int* surface_vert;       // vertices that may touch                        (nsurface)
    int npair;               //
    OmContactPair* pair;     //                                    (nsurface x nobstacle)
    OmContactAmong* among;   //                                              (nobstacle)
    OmTissueObstacle* body;  // the obstacles for engines that move vertices themselves (nobstacle)
    double ring;             // m, around a place, over which the normal of an obstacle is averaged
    double h;                // s, of the step
    double seen_time;        // s, when its substep begins
    bool has_settled;        // in its substeps before that
    // computed by the last step
    OmContactReport report;
};

/// Distance of p to an obstacle less the offset, and the unit normal.
double om__contact_gap(const OmContact* contact, int obstacle, OmVec3 p, OmVec3* n);

// ---- contact_among.c

OmStatus om__contact_among_create(OmContact* contact);
/// A step of an engine that moves vertices itself, into contact->report.
OmStatus om__contact_step_among(OmContact* contact, const OmTissueModel* model,
                                OmTissueState* state, OmTissueWork* work, double h,
                                OmTissueReport* tissue);

#endif
