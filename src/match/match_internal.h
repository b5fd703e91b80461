// match_internal.h: data that the files of the room `match` share.
#ifndef OM_MATCH_INTERNAL_H
#define OM_MATCH_INTERNAL_H

#include "omentum/fem.h"
#include "omentum/match.h"

#define OM__MATCH_BEFORE 0.0025  // m: another thing this much before a place of the tissue hides it

#define OM__MATCH_MIN_POINTS 20  // of a scan
#define OM__MATCH_HOLD 1e3  // spring of a grasped vertex over Young's modulus times the mean edge

typedef struct MatchHeld {  // the grasped vertices of a load, with their goals
    int nvert;
    int* vert;     // (nvert of the mesh)
    double* goal;  // (nvert of the mesh x 3)
} MatchHeld;

struct OmMatch {
    OmMatchDef def;
    OmMatchView view;
    // of the site; of quadratic elements refined: midpoints of edges behind its vertices
    OmTetMesh mesh;
    int ncorner;  // vertices of the site's mesh
    // vertices at the ends of each midpoint's edge, or null        ((mesh.nvert - ncorner) x 2)
    int* mid_end;
    int* candidate_of;  // of each vertex of the site's mesh, -1: none                  (ncorner)
    OmSurface surface;
    int *surface_vert, *surface_of, *candidate;
    double* area;       // of candidates
    double* vert_area;  // share of the boundary of each vertex of the mesh
    double* spring;     // scratch: of each vertex of the mesh
    // at rest under its weight, by om__match_rest_shape; null: not yet            (nvert x 3)
    double* x_rest;
    OmFemSolid* solid;
    OmFemSolid* projected;  // the same, with tangents projected element by element
    OmBsr A;
    OmSolver* solver;
    bool has_factors;
    double hold;                // N/m, of the spring of a grasped vertex
    MatchHeld held;             // written by om__match_set_load
    double *r, *dx, *y;         // (nvert x 3)
    unsigned char* hypothesis;  // random patches of candidates       (nhypothesis x ncandidate)
};

/// The grasped vertices and their goals. `held` has room for all vertices; the scratch of `match` is not used.
OmStatus om__match_find_held(const OmMatch* match, int ngrasp, const OmMatchGrasp* grasp,
                             MatchHeld* held);
/// Check a load, and find the grasped vertices with their goals.
OmStatus om__match_set_load(OmMatch* match, const OmMatchLoad* load, const double* x);
/// The twin under its weight alone, once; `x` lives as long as `match`. What is believed holds it, and elsewhere a soft
/// support: tissue that lies somewhere is held somehow. Without an equilibrium it is the shape of the mesh.
/// @return OM_OK; OM_NO_MEMORY
OmStatus om__match_rest_shape(OmMatch* match, const double** x);
OmVec3 om__match_pull_point(const OmMatch* match, const OmMatchPull* pull, const double* x);
/// Distance to board and organ, m, and its gradient; HUGE_VAL: neither.
double om__match_gap(const OmMatch* match, OmVec3 p, OmVec3* normal);

// ---- the twin deformed onto a scan ---------------------------------------------------------------------------

typedef struct MatchFit {  // om__match_fit_done frees
    OmMatch* match;
    struct OmSurfaceTree* tree;
    double* xs;          // positions of the surface's vertices                  (nvert x 3)
    double* normal;      // of the surface's vertices in the rest shape          (nvert x 3)
    unsigned char* use;  // triangles that face the camera                       (ntri)
    int* tri;            // triangle of each point of the scan, -1: none         (npoint)
    double* bary;        //                                                      (npoint x 3)
    double* distance;    // m, HUGE_VAL without triangle                         (npoint)
    OmMatchPull* pull;   //                                                      (npoint)
    int nnewton;
} MatchFit;

OmStatus om__match_fit_begin(OmMatch* match, int npoint, MatchFit* fit);
void om__match_fit_done(MatchFit* fit);
// Nearest points of the twin at x on the surface that faces the camera.
OmStatus om__match_pairs(MatchFit* fit, const OmScan* scan, const double* x);
// Deform the twin from x onto the scan; `spring` as in OmMatchLoad. The pairs are those of the new x.
OmStatus om__match_fit(MatchFit* fit, const OmAcquisition* acquisition, const double* spring,
                       double* x);

// ---- the twin at rest with stated attachments ------------------------------------------------------------------

typedef struct MatchTrier {  // om__match_trier_done frees
    OmMatch* match;
    int nacq;
    const OmAcquisition* acq;
    MatchFit fit;
    double* spring;    // scratch, of candidates
    double* distance;  // scratch, of the points of all scans
    double* mean;      // m, of each scan, by the last measurement       (nacq)
    double young;      // as OmMatchLoad has it
    bool needs_rest;   // a trial ends, without distances, at the first acquisition without rest
} MatchTrier;

/// As om_match_update has them. @return OM_OK; OM_INVALID
OmStatus om__match_check_acquisition(OmMatch* match, const OmAcquisition* acquisition, int k);
OmStatus om__match_trier_begin(OmMatch* match, int nacq, const OmAcquisition* acq,
                               MatchTrier* trier);
void om__match_trier_done(MatchTrier* trier);
/// Distance of the scans from the twin at x (nacq x nvert x 3).
OmStatus om__match_measure(MatchTrier* trier, const double* x, OmMatchTrial* trial);
/// om_match_try, for acquisitions that are checked. OM_OK also where no rest was found.
OmStatus om__match_try(MatchTrier* trier, const unsigned char* attached, double* x,
                       OmMatchTrial* trial);

// ---- evidence ---------------------------------------------------------------------------------------------------

typedef struct MatchEvidence {  // om__match_evidence_done frees
    OmMatch* match;
    MatchTrier* trier;
    int nacq;
    const OmAcquisition* acq;
    double* ratio;     // log-likelihood ratio of each candidate, attached against free
    double* x_before;  // the twin as believed                    (nacq x nvert x 3)
    double* x;         // the twin deformed onto each scan        (nacq x nvert x 3)
    double seen_share, moved_share;
    double area;  // m^2, of the candidates
    // scratch
    double* spring;    // the trier's
    double* facing_x;  // rest positions of surface vertices that face the camera
    int* nearest;      // surface vertex of each candidate that the camera sees over it
    unsigned char *status, *seen, *moved;  // of candidates; seen and moved: by any acquisition
    unsigned char* stayed;  // ... where the twin as believed moved, by any acquisition
    unsigned char* went;    // moved, or their place is empty, by any acquisition
} MatchEvidence;

OmStatus om__match_evidence_begin(MatchTrier* trier, MatchEvidence* evidence);
void om__match_evidence_done(MatchEvidence* evidence);
OmStatus om__match_find_evidence(MatchEvidence* evidence, const OmProgress* progress);

// ---- the prior ------------------------------------------------------------------------------------------------

// Make the bank of hypotheses.
OmStatus om__match_make_prior(OmMatch* match);
// Probability of each candidate by its log-likelihood ratios, attached against free, and a belief of `weight`; the
// belief may be null.
OmStatus om__match_infer(const OmMatch* match, const double* evidence, const double* belief,
                         double weight, double* probability);
// From the inference to shares of vertices that are attached in truth.
void om__match_calibrate(int n, double* probability);
// Log-odds of a probability that is kept away from 0 and 1.
double om__match_logit(double probability);
// Level above which the candidates are the set with the largest expected Dice coefficient.
double om__match_choose_level(const OmMatch* match, const double* probability);

// ---- what a camera sees of the twin -------------------------------------------------------------------------

typedef struct MatchBuffer {  // depth buffer of a scan's camera; om__match_buffer_done frees
    const OmScan* scan;       // borrowed, with a camera
    int step;                 // pixels of the picture a pixel of the buffer
    int width, height;        //
    float* depth;             // m                                                (height x width)
    double* corner;           // column, row, inverse depth of each vertex              (nvert x 3)
    // pixels with the twin in view where the picture shows tissue, and other things
    int ntissue, nother;
    int nempty;  // ... and pixels where it has no depth
} MatchBuffer;

/// @return OM_OK; OM_NO_MEMORY
OmStatus om__match_buffer_init(const OmScan* scan, int nvert, MatchBuffer* buffer);
void om__match_buffer_done(MatchBuffer* buffer);
/// Mark the triangles of `surface`, with vertices at xs, that the camera sees. A point counts as seen up to `slack` m
/// behind the nearest surface.
void om__match_mark_visible(MatchBuffer* buffer, const OmSurface* surface, const double* xs,
                            double slack, unsigned char* use);

#endif
