// contact_pair.h: two places of the tissue that touch, and their forces in a step.
//
// With w the weights of the vertices, gap = n . sum w x - thickness, the pair has the force k (goal - gap) n at the end
// of the step, and friction, on both sides in shares: the two sums of forces are opposite to rounding, and the pair is
// a tie of the system (tissue.h). k is STIFF times the resistance against moving the two apart alone.
#ifndef OM_CONTACT_PAIR_H
#define OM_CONTACT_PAIR_H

#include "omentum/contact.h"
#include "omentum/tissue_engine.h"

struct OmContactWork;
struct OmContactLine;

typedef struct OmSelfPair {  // a vertex and a triangle, or two edges, near each other in a step
    int vert[4];             // vertex, then the triangle's; or two and two
    int first, second;       // edges; of a vertex: -1 and its triangle
    bool is_dead;            // on the wrong side at the beginning: in contact only if caught
    bool is_caught;          // its path led through the other side: a small gap is kept
    double apart;            // m, distance at the beginning of the step
    bool is_active, is_closed;
    // of two edges: towards the first one, by the surface around them at the beginning
    OmVec3 side;
    double weight[4];       // of the closest points; the first side is positive
    OmVec3 n;               // from the second side to the first, unit
    double thickness;       // m
    double gap;             // m, n . sum weight x at the beginning of the step, less thickness
    double goal;            // m, gap required at its end
    double k;               // N/m
    double push, was_push;  // N, of the last two solves
    OmVec3 slip;            // m, tangential, of the last solve
    OmVec3 friction;        // N in the next solve at zero displacement
    OmMat3 friction_K;      // N/m, its decrease with the displacement
    OmVec3 force;           // N on the first side, of the last solve
    double depth, depth_rate;
} OmSelfPair;

typedef struct OmPairSums {  // of the pairs of one kind, in a substep
    int nactive, nswitch;
    int nsolve;                             // in this substep
    double strongest;                       // N, push in the last solve
    double friction_error, friction_bound;  // N, sums over the active pairs
    int nslip;                              // pairs that changed by friction alone
} OmPairSums;

// ---- contact_pair.c

/// sum w x.
OmVec3 om__pair_relative(const OmSelfPair* pair, const double* x);
OmVec3 om__pair_tangential(const OmSelfPair* pair, OmVec3 d);
/// k of a pair by its weights; 0: all its vertices are held.
double om__pair_stiffness(const OmTissueModel* model, OmTissueState* state,
                          const OmTissueWork* work, const OmSelfPair* pair);
/// The friction for a first solve of h seconds, from the pair's push and slip.
void om__pair_begin_friction(OmSelfPair* pair, double mu, double h);
/// Gap less goal at the positions `end` of the last solve, by the closest points that it had; x: at its beginning.
double om__pair_gap_at_end(const OmSelfPair* pair, const double* x, const double* end);
OmStatus om__pairs_add_forces(int npair, const OmSelfPair* pair, OmTissueWork* work);
/// Pairs that are free stay free for the rest of this step.
void om__pairs_close_set(int npair, OmSelfPair* pair);
/// Start the sums for the update after a solve.
void om__pairs_begin_update(OmPairSums* sums, int npair, const OmSelfPair* pair, const double* x,
                            const double* end);
/// Push and force of an active pair in the last solve; friction for the next one.
/// @return whether friction must be solved for again
bool om__pair_take_solution(OmPairSums* sums, OmSelfPair* pair, double mu, const double* x,
                            const double* end, double h);
void om__pair_activate(OmPairSums* sums, OmSelfPair* pair);
void om__pair_release(OmPairSums* sums, OmSelfPair* pair);
/// Pairs that changed: without pairs that stick and slip by turns, where their sum is right.
int om__pairs_count_changes(const OmPairSums* sums, int nchange);
void om__pairs_begin_line(int npair, OmSelfPair* pair, const OmTissueState* state,
                          const double* last, const double* increment, double h,
                          struct OmContactLine* line);
void om__pairs_add_line(int npair, const OmSelfPair* pair, double at, double* slope);
/// Add a pair to the report of a step and its forces to the state.
/// @param nfirst  vertices of its first side
/// @param gap     m, after the step
OmStatus om__pair_report(struct OmContactWork* cw, OmTissueState* state, const OmSelfPair* pair,
                         int nfirst, const double* end, double gap);

#endif
