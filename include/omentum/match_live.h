/// omentum/match_live.h: which point of the twin is a point of the scan, while the twin runs (floor 5; thesis 4.2).
///
/// A running twin follows the tool, so it is near the tissue that the camera sees, even if its attachments are wrong.
/// om_match_find_pairs therefore starts from the twin: it deforms the twin onto the scan with the twin's own mechanics
/// and takes nearest points on the part of its surface that a camera at the same pose sees. Grasped vertices follow the
/// tool; attachments are springs that break where the scan contradicts them.
///
///     OmMatchLiveDef def = om_match_live_default_def(match);
///     om_match_live_create(&def, &live);
///     om_match_find_pairs(live, &scan, 1, &grasp, om_body_x(twin), &pairs);
///     if (!pairs.is_lost) ... pairs.tri[i], pairs.bary + 3 * i, pairs.x_rest + 3 * i ...
///     om_match_pairs_done(&pairs);
#ifndef OMENTUM_MATCH_LIVE_H
#define OMENTUM_MATCH_LIVE_H

#include "omentum/match.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmMatchLiveDef {  // made by om_match_live_default_def
    const OmMatch* match;        // borrowed until destroy; only its constant part is used
    int nfollow;  // iterations towards the tool's pose without the scan, 0 to 100; default 10
    // m of the tool's way from x_twin for one of them, >= 0: a twin that is there already does not follow, because it
    // bends more easily than the linear elements of this search; 0: always all; default 4 mm
    double follow_step;
    int nfit;  // iterations with the scan, 1 to 100; default 5
    // Stiffness of the springs to the scan over that of the tissue, per vertex of the surface, > 0; default 1.
    double fit_stiffness;
    double along;  // share of this stiffness along the surface, 0 to 1; default 0.01
    // m, displacement at which an attachment has a quarter of its stiffness; default 3 mm
    double release;
    // Stiffness of the spring of an exact track over that of the springs to the scan at a vertex, >= 0; default 1.
    double track_stiffness;
    double max_distance;  // m, of a pair, in iterations; default 30 mm
    double min_cosine;    // between the normals of a pair, -1 to 1; default 0.3
    // The result is lost if the median distance of pairs is above this and above three times the noise, m; default 1 mm
    double max_median;
    double max_p95;     // ... if the distance of 5 % of the pairs is; default 3 mm
    double min_paired;  // ... if less than this share of the points has a partner; default 0.6
    // ... if the camera sees something else than tissue in more than this share of the twin's view; default 0.06
    double max_empty;
    // Steps along the tool's way in a restart from the rest shape, after a lost result; 0: no restart. Default 12.
    int nrestart;
    int nworker;  // threads; default 1
    OmCookie cookie;
} OmMatchLiveDef;

OM_API OmMatchLiveDef om_match_live_default_def(const OmMatch* match);

/// The twin's tissue with linear solver and scratch. For one thread at a time; om_match_update of the same OmMatch may
/// run in another thread.
typedef struct OmMatchLive OmMatchLive;
/// @return OM_OK; OM_INVALID (the message names the field); OM_NO_MEMORY
OM_API OmStatus om_match_live_create(const OmMatchLiveDef* def, OmMatchLive** live);
OM_API void om_match_live_destroy(OmMatchLive* live);
/// The twin's attachments from now on. At first they are those of the site.
/// @param attached  nonzero where attached, as om_body_attached; copied; null: none  (nvert of the mesh)
OM_API void om_match_live_set_attached(OmMatchLive* live, const unsigned char* attached);

/// A material point that was followed through pictures to where it is now (match_track.h).
typedef struct OmMatchTrack {
    int tri;            // triangle of OmMatchView.surface
    double bary[3];     // weights of its vertices
    OmVec3 x;           // m, the measured place
    OmMat3 covariance;  // m^2, of x minus the material point
} OmMatchTrack;

typedef struct OmMatchTracks {  // borrowed
    int n;
    const OmMatchTrack* track;  // (n)
} OmMatchTracks;

typedef struct OmMatchPairs {  // om_match_pairs_done frees
    int npoint;                // of the scan
    int* tri;        // triangle of OmMatchView.surface of each point, -1: none    (npoint)
    double* bary;    // weights of its vertices                                    (npoint x 3)
    double* weight;  // trust, 0 to 1; 0 without partner                           (npoint)
    double* x_rest;  // the material point in the rest shape, m; NaN without one   (npoint x 3)
    int nvert;       // of the mesh
    double* x;       // the twin deformed onto the scan, m                         (nvert x 3)
    double median, p90, p95;  // m, distances of points with a partner from that surface
    double paired;            // share of points with a partner
    double empty;  // share of the twin's view where the camera sees no tissue; 0: not known
    // m, distances of tracks from their material points on the deformed twin; 0 without tracks
    double track_median, track_p90;
    bool is_restarted;  // lost from x_twin; this result is of a restart
    bool is_lost;       // do not use the pairs
    char reason[256];   // why lost; "" if not
    double ms;          // time of the call
} OmMatchPairs;

/// Find the material point of every point of the scan.
/// @param grasp   tools that hold tissue, their poses at the grasp and at the scan              (ngrasp)
/// @param x_twin  the twin's vertex positions, m                              (nvert of the mesh x 3)
/// @return OM_OK (is_lost says whether to use the pairs); OM_INVALID (an argument: the message names it); OM_NO_MEMORY
OM_API OmStatus om_match_find_pairs(OmMatchLive* live, const OmScan* scan, int ngrasp,
                                    const OmMatchGrasp* grasp, const double* x_twin,
                                    OmMatchPairs* pairs);
/// The same with material points that were followed through pictures: a spring ties each to its measured place, in all
/// directions, weighted by its covariance; one that does not fit the others loses its weight.
/// @param tracks  may be null: as om_match_find_pairs
/// @return as om_match_find_pairs; OM_INVALID also for a track that is not valid
OM_API OmStatus om_match_find_pairs_with(OmMatchLive* live, const OmScan* scan, int ngrasp,
                                         const OmMatchGrasp* grasp, const double* x_twin,
                                         const OmMatchTracks* tracks, OmMatchPairs* pairs);
OM_API void om_match_pairs_done(OmMatchPairs* pairs);
/// The displacement field on the twin's surface.
/// @param u     displacement from rest of each vertex of OmMatchView.surface, m    (surface->nvert x 3)
/// @param seen  sum of the weights of the pairs at each vertex; 0: no point of the scan is near it, and `u` comes from
///              the mechanics alone; may be null                                   (surface->nvert)
OM_API void om_match_pairs_displacement(const OmMatchView* view, const OmMatchPairs* pairs,
                                        double* u, double* seen);

#ifdef __cplusplus
}
#endif
#endif
