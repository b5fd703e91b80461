// contact_self.h: contact of tissue with itself, and between bodies of one mesh. Each file calls only files above it:
//
//   contact_pair.h     two places of the tissue that touch
//   contact_near.c     vertex and triangle, edge and edge: closest points, paths
//   contact_tree.c     edges, owners and the tree of boxes; pairs whose boxes meet
//   contact_self.c     contact inside a step
#ifndef OMENTUM_CONTACT_SELF_H
#define OMENTUM_CONTACT_SELF_H

#include "contact/contact_pair.h"

struct OmContact;

typedef struct OmSelfNode {  // of the tree; the first child of an inner node follows it
    int right;               // the other child; leaf: 0
    int tri;                 // of a leaf
} OmSelfNode;

typedef struct OmSelf {   // constant
    const int* tri_vert;  // of the contact                                          (ntri x 3)
    int ntri, nedge, nvert;
    int* edge_vert;      // smaller vertex first                                     (nedge x 2)
    int* edge_tri;       // its triangles                                            (nedge x 2)
    int* tri_edge;       // edge k joins corners k and k + 1                         (ntri x 3)
    unsigned char* own;  // bits: corners 0 to 2, edges 3 to 5; one triangle owns each  (ntri)
    int *near_adr, *near_vert;  // ends of the edges around each vertex       (nvert + 1), (2 nedge)
    const int* body;            // of the contact                               (nvert)
    const int* skin_of;         // of the contact                               (nbody)
    int nnode;
    OmSelfNode* node;  //                                                            (nnode)
    double* rest;      // positions at rest                                          (nvert x 3)
    double thickness, friction, size;
    double edge;  // m, mean length at rest
} OmSelf;

typedef struct OmSelfBox {  // of a node
    double lo[3], hi[3];    // of the path in the step
    double nlo[3], nhi[3];  // of the unit normals around its vertices
} OmSelfBox;

typedef struct OmNear {  // closest points of a pair
    double weight[4];
    OmVec3 n;
    double apart;     // m, distance
    double distance;  // m, the same, negative behind; infinite where another pair has the contact
    bool is_front;    // the first side is in front of the second
} OmNear;

typedef struct OmSelfFound {  // a candidate of a search, as in OmSelfPair
    int vert[4], first, second;
} OmSelfFound;

typedef struct OmSelfWork {
    OmSelfBox* box;     //                                                           (nnode)
    double* normal;     // of triangles, unit; zero if flat                          (ntri x 3)
    double* fan;        // boxes of the normals around each vertex                   (nvert x 6)
    double* swept;      // boxes of the paths of the vertices                       (nvert x 6)
    double *x, *end;    // positions at the ends of the step                         (nvert x 3)
    double* predicted;  // displacements for which the pairs were searched           (nvert x 3)
    double* way;  // m, length of the displacement less the mean one, of the last solve  (nvert)
    double predicted_mean[3], mean[3];  // m, of these displacements, and of those of the last solve
    double* last;  // positions at the end of the last step of this work        (nvert x 3)
    bool has_last;
    int nfound, max_found;
    OmSelfFound* found;
    int npair, max_pair;
    OmSelfPair* pair;
    int nold, max_old;
    OmSelfPair* old;  // pairs of the last search
    int* stack;       // of a search                                                 (max_stack)
    int max_stack;
    OmPairSums sums;
} OmSelfWork;

// ---- contact_near.c

/// Closest points of a pair at positions x; of two edges `side` is set.
void om__near_eval(const OmSelf* self, const OmSelfPair* pair, const double* x, OmNear* near);
/// Distance of a pair, of any kind.
double om__near_distance(const OmSelfPair* pair, const double* x);
/// A distance, m, that the two keep in the step, from the lengths of their vertices' ways alone.
double om__near_bound(const OmSelfPair* pair, const double* way);
/// True if the path from x to end keeps the two apart by more than `least`.
bool om__near_is_free(const OmSelfPair* pair, const double* x, const double* end, double least);
/// Fraction of the path from x to end at which the distance falls to `least`, 1: it does not; and the closest points
/// there, for a path that begins in front.
double om__near_impact(const OmSelfPair* pair, const double* x, const double* end, double least,
                       OmNear* near);
/// True if the edge a b goes through the triangle t at positions x.
bool om__near_crosses(const int edge[2], const int tri[3], const double* x);

// ---- contact_tree.c

OmStatus om__self_create(const struct OmContact* contact, const OmTissueModel* model,
                         OmSelf** self);
void om__self_destroy(OmSelf* self);
OmStatus om__self_work_create(const OmSelf* self, OmSelfWork** work);
void om__self_work_destroy(OmSelfWork* work);
/// Boxes for paths from x along `move` (null: none), wider by `reach` on all sides.
void om__self_refit(const OmSelf* self, OmSelfWork* sw, const double* x, const double* move,
                    double reach);
typedef OmStatus (*OmSelfMeetFn)(void* ctx, int tri_a, int tri_b);
/// Call `meet` for each two triangles whose boxes meet. Triangles that look the same way are left out if `skips`.
OmStatus om__self_search(const OmSelf* self, OmSelfWork* sw, bool skips, OmSelfMeetFn meet,
                         void* ctx);

// ---- contact_self.c; as their siblings in contact_internal.h

OmStatus om__self_find_pairs(struct OmContactWork* cw, const OmTissueModel* model,
                             OmTissueState* state, const OmTissueWork* work, double h);
/// @param nchange  out: how many pairs changed
OmStatus om__self_update_pairs(struct OmContactWork* cw, const OmTissueModel* model,
                               OmTissueState* state, const OmTissueWork* work, double h,
                               bool is_damped, int* nchange);
/// A tool whose tissue would pass in a short substep is held back: it stands still for the rest of the step. Where
/// def.max_work is spent, or the substep is the shortest, a solution that would pass is replaced by one in which tools
/// and all free vertices stop.
/// @return OM_OK; OM_INVALID (surfaces pass through each other in this step)
OmStatus om__self_check_paths(struct OmContactWork* cw, const OmTissueModel* model,
                              OmTissueState* state, OmTissueWork* work, double h);
/// At the beginning of a step: refuse a state that the last step did not make, and whose surfaces cross. Steps keep
/// surfaces apart, so states of their own need no check; nor are crossings of neighbours in one body found here.
/// @return OM_OK; OM_INVALID (surfaces cross)
OmStatus om__self_check_start(struct OmContactWork* cw, const OmTissueState* state);
/// Remember the positions at the end of a step.
void om__self_end_step(struct OmContactWork* cw, const OmTissueState* state);
OmStatus om__self_report_pairs(struct OmContactWork* cw, OmTissueState* state);

#endif
