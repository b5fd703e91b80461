/// omentum/match.h: the twin as a static problem, and the attachments that explain a scan (floor 5; thesis 4.2).
///
/// OmMatch is made once and serves every update of a twin: the tissue as finite elements, its surface, the
/// vertices that may be attached (candidates), contact with board and organ, matrix and factors. Equilibria are found
/// under springs at the candidates, grasps, and pulls of surface points towards measured points. om_match_update
/// estimates from one or several acquisitions which candidates hold the tissue. A vertex that moved is free. A vertex
/// behind the free ones is attached as far as the scan and the patches of thesis 4.2.1 make it probable.
///
///     OmMatchDef def = om_match_default_def(&scene, &twin_site);
///     om_match_create(&def, &match);
///     om_body_get_nodes(twin, x);  // (om_body_node_count(twin) x 3)
///     OmAcquisition acquisition = {.scan = scan, .ngrasp = 1, .grasp = {grasp}, .x_twin = x};
///     om_match_update(match, 1, &acquisition, NULL, &estimate);
///     if (estimate.is_accepted) ... estimate.attached[v] ...
///     om_match_estimate_done(&estimate);
#ifndef OMENTUM_MATCH_H
#define OMENTUM_MATCH_H

#include "omentum/scan.h"
#include "omentum/scene.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- the twin as a static problem ---------------------------------------------------------------------------

#define OM_MATCH_MAX_ADVICE 8

typedef struct OmMatchDef {  // made by om_match_default_def
    const OmScene* scene;    // law of the tissue, radius of a grasp; borrowed
    const OmSite* site;      // of role OM_SITE_TWIN; borrowed until destroy
    int ncandidate;
    // vertices that may be attached; copied; null (default): the set "underside", else the surface  (ncandidate)
    const int* candidate;
    // N/m^3, stiffness by area of a full attachment; default 0: 20 times Young's modulus over the mean edge
    double foundation;
    double contact;   // N/m^3, penalty of board and organ; default 0: as foundation
    int nhypothesis;  // random patches of the prior, 0 to 20,000; default 2000
    uint64_t seed;    // of these patches; default 1
    // m, displacement of a candidate above which it counts as moved; default 2.5 mm
    double moved;
    // An update is refused below this seen share of the candidates' area; default 0.1
    double min_seen;
    // ... below this displacement of the grasp, m; default 5 mm
    double min_motion;
    // ... above this median distance of the scan from the updated twin and five standard deviations of its noise, m;
    // default 1.2 mm
    double max_residual;
    // ... if its picture shows something else on more than this share of the updated twin's visible surface; default
    // 0.08
    double max_other;
    // ... or has no depth on more than this share of it; default 0.45
    double max_empty;
    // Adopt an estimate without asking whether the updated twin is closer to the scan; default false. For comparisons.
    bool is_unchecked;
    int nworker;  // threads; default 1
    OmCookie cookie;
} OmMatchDef;

/// For one thread at a time.
typedef struct OmMatch OmMatch;

OM_API OmMatchDef om_match_default_def(const OmScene* scene, const OmSite* site);
/// @return OM_OK; OM_INVALID (the message names the field); OM_NO_MEMORY
OM_API OmStatus om_match_create(const OmMatchDef* def, OmMatch** match);
OM_API void om_match_destroy(OmMatch* match);

typedef struct OmMatchView {  // constant, valid until om_match_destroy
    // Of the site; where the twin's elements are quadratic refined, with the midpoints of edges behind the site's
    // vertices as in om_tissue_mesh. Arrays of vertices here are of this mesh.
    const OmTetMesh* mesh;
    int ncorner;  // vertices of the site's mesh; candidates are among them
    // vertices at the ends of each midpoint's edge                        ((mesh->nvert - ncorner) x 2)
    const int* mid_end;
    const OmSurface* surface;  // boundary in the rest shape
    const int* surface_vert;   // vertex of the mesh of each vertex of `surface`
    const int* surface_of;     // the reverse, -1: inside                       (mesh->nvert)
    int ncandidate;
    const int* candidate;  // vertices of the mesh, ascending                   (ncandidate)
    const double* area;    // m^2, share of each candidate                      (ncandidate)
    double edge;           // m, mean edge of the surface
    double foundation;     // N/m^3, stiffness by area of a full attachment
} OmMatchView;
OM_API const OmMatchView* om_match_view(const OmMatch* match);

typedef struct OmMatchGrasp {
    int arm;
    OmPose pose_world_grasp;  // tip when the jaw closed
    OmPose pose_world_now;
    double radius;  // m; 0: of the scene
    int nvert;
    // grasped vertices of the twin; null: those within `radius` of pose_world_grasp in the rest shape  (nvert).
    // A vertex of two grasps follows the first one. The tissue was at rest where it was grasped: om_match_update
    // refuses a grasp of displaced tissue.
    const int* vert;
} OmMatchGrasp;

/// A spring between a point of the twin's surface and a measured point.
typedef struct OmMatchPull {
    int tri;         // of OmMatchView.surface
    double bary[3];  // weights of its vertices
    OmVec3 goal;     // m
    OmVec3 normal;   // unit; zero if `across` is 0
    double across;   // N/m, along the normal
    double along;    // N/m, in every direction
} OmMatchPull;

typedef struct OmMatchLoad {  // zero-initialise
    const double* spring;  // N/m, of each candidate to its rest position; null: none  (ncandidate)
    int ngrasp;
    const OmMatchGrasp* grasp;  // grasped vertices follow the tool
    int npull;
    const OmMatchPull* pull;
    // of the tissue over that of the scene; springs, contact and pulls change with it; default 0: 1
    double young;
    int max_newton;    // default 0: 60
    double tolerance;  // m, of the largest displacement in an iteration; default 0: 1e-5
} OmMatchLoad;

typedef struct OmMatchRest {
    int nnewton;      // iterations
    double motion;    // m, largest displacement of a vertex in the last iteration
    double residual;  // N, largest unbalanced force on a vertex
    double energy;    // J
} OmMatchRest;

/// Find the equilibrium under weight, contact, springs, grasps and pulls: Newton's method with line search.
/// @param x     in: first guess; out: equilibrium, m (mesh->nvert x 3)
/// @param rest  may be null
/// @return OM_OK; OM_NOT_CONVERGED (x is the best iterate); OM_INVALID (an argument, or no vertex within the radius of
///         a grasp; x unchanged); OM_NO_MEMORY
OM_API OmStatus om_match_find_rest(OmMatch* match, const OmMatchLoad* load, double* x,
                                   OmMatchRest* rest);
/// Energy of om_match_find_rest at x, J, and its gradient, N (mesh->nvert x 3; may be null).
/// @return OM_OK; OM_INVALID (as om_match_find_rest); OM_NO_MEMORY
OM_API OmStatus om_match_eval(OmMatch* match, const OmMatchLoad* load, const double* x,
                              double* energy, double* gradient);
/// Factorise the second derivative of the energy at x, for om_match_solve. If it is not positive definite, elements are
/// projected, and derivatives of the equilibrium are approximate.
/// @return OM_OK; OM_NOT_SPD (also after the projection); OM_INVALID (as om_match_find_rest); OM_NO_MEMORY
OM_API OmStatus om_match_factorize(OmMatch* match, const OmMatchLoad* load, const double* x);
/// Displacements by forces: solve with the factors of om_match_factorize or of the last iteration of
/// om_match_find_rest. The matrix is symmetric: it also solves the adjoint problem.
/// @param force  N (nrhs x mesh->nvert x 3)
/// @param dx     m (nrhs x mesh->nvert x 3)
/// @return OM_OK; OM_INVALID (a value is not finite, or there are no factors)
OM_API OmStatus om_match_solve(OmMatch* match, int nrhs, const double* force, double* dx);

// ---- attachments from physics -------------------------------------------------------------------------------

typedef struct OmAcquisition {
    OmScan scan;
    // The tissue before the tools moved it, by the same camera; null: not known. Errors of a camera show here.
    const OmScan* rest;
    // of om_acquisition_load, then also `rest`; om_acquisition_done frees it; else null
    OmScan* owned_rest;
    int ngrasp;
    OmMatchGrasp grasp[OM_MAX_ARM];
    double time;  // s
    // the twin's vertex positions at that time, m, as om_body_get_nodes gives them; null: at rest under the grasps,
    // with the attachments of the site                                         (mesh->nvert x 3)
    const double* x_twin;
    // Nonzero where the twin is attached at that time; null: not stated. om_banet_update believes the newest. (ncorner)
    const unsigned char* attached;
} OmAcquisition;

typedef enum OmMatchCause {  // why a scan does not fit the model
    OM_MATCH_FITS,
    OM_MATCH_MOVED,     // the camera is turned or shifted against its calibration
    OM_MATCH_FOCAL,     // another focal length
    OM_MATCH_SCALE,     // another scale of depth: unit, or calibration of the sensor
    OM_MATCH_RANGE,     // depth is the distance along the ray
    OM_MATCH_MIRRORED,  // colour and depth are mirrored against each other
    OM_MATCH_INVERSE,   // the pose of the camera is the inverse one
    OM_MATCH_OPENGL,    // its y points up and its z backwards
    OM_MATCH_ORDER,     // the quaternion has another order
    OM_MATCH_EMPTY,     // too much of the tissue has no depth, or there are too few points
    OM_MATCH_UNKNOWN    // none of these: other tissue, or a model of another patient
} OmMatchCause;
OM_API const char* om_match_cause_name(OmMatchCause cause);  // "focal"; null: no such

typedef struct OmMatchVerdict {  // on one acquisition
    bool is_good;                // it is used
    bool is_moved;               // a small error of the camera was estimated, and corrected
    OmMatchCause cause;
    double size;  // of the cause: rad, or the stated value over the true one; 0: it has none
    // Maps points of the scan to where they are, where the camera was moved; else identity.
    OmPose pose_right_scan;
    double turn, shift;  // rad and m, of this motion, about the middle of the scan
    // rad and m, standard deviations in the least known directions; 0: not estimated
    double sigma_turn, sigma_shift;
    // Of what is at rest, mean over `npatch` independent patches of the surface: at most 1 where it fits.
    double chi2;
    double chi2_moved;  // ... after the correction
    int npatch;
    // m, mean distance of the scan from the twin, each 5 mm at most; 0: not fitted
    double before, after;
    double empty;      // share of the twin's visible surface where the picture has no depth
    double other;      // ... where it shows something else
    char reason[256];  // "" if it is good and nothing was corrected
} OmMatchVerdict;
/// Where is the tissue that a scan shows at rest, before any tool has moved it? As an update judges OmAcquisition.rest,
/// but with other limits for a motion that counts as a small error.
/// @param max_turn, max_shift  rad and m, of such a motion
/// @param verdict  is_moved with cause OM_MATCH_MOVED: pose_right_scan brings the scan to the model, its inverse
///                 the model (om_site_move) to the scan. Otherwise it is good and fits, or `reason` says what is wrong
/// @return OM_OK, also if the scan is not good; OM_NO_MEMORY; OM_UNAVAILABLE (Embree failed)
OM_API OmStatus om_match_register(OmMatch* match, const OmScan* rest, double max_turn,
                                  double max_shift, OmMatchVerdict* verdict);

typedef struct OmMatchEstimate {  // om_match_estimate_done frees
    int nvert;                    // of the site's mesh
    int nnode;                    // of OmMatchView.mesh
    double* probability;          // of being attached; 0 where no candidate        (nvert)
    // 0: scans and advice decide; 1: they say nothing about this vertex             (nvert)
    double* uncertainty;
    double* stiffness;  // N/m, of the spring of each attached vertex          (nvert)
    // the set with the largest expected Dice coefficient, or the set that `choice` names  (nvert)
    unsigned char* attached;
    int nacquisition;
    // On each acquisition. One that is not good is left out.                (nacquisition)
    OmMatchVerdict* verdict;
    // The twin at rest with these attachments, m; of an acquisition that was left out: as given, or the mesh at rest.
    double* x;           // (nacquisition x nnode x 3)
    double seen_share;   // of the candidates' area, below which the scans show the surface
    double moved_share;  // of the candidates' area, that the scans show as moved
    // m, distances of scan points from the twin: as believed before, and with these attachments
    double before_median, before_p90, after_median, after_p90;
    double before_mean, after_mean;  // m, the same, of distances that count 5 mm at most
    // 0: `attached` is the most probable set; 1: that of the scans alone; 2 + k: set k of the advice; 2 + nset: the
    // corrected `present`
    int choice;
    bool is_accepted;
    char reason[256];  // why not; "" if accepted
    // centroid of the vertices about which the scans say least: a grasp or view there informs most
    bool has_look_next;
    OmVec3 look_next;
    double judge_ms, fit_ms, infer_ms, check_ms, total_ms;  // times of the stages
} OmMatchEstimate;

/// Estimate the attachments that explain the scans.
/// @return OM_OK (is_accepted says whether to use the estimate); OM_INVALID (an acquisition that is not valid: the
///         message names it); OM_NO_MEMORY; OM_CANCELLED
OM_API OmStatus om_match_update(OmMatch* match, int nacquisition, const OmAcquisition* acquisition,
                                const OmProgress* progress, OmMatchEstimate* estimate);
/// What is known of the attachments besides the scans, by a network or from the last estimate.
typedef struct OmMatchAdvice {  // zero-initialise
    // of being attached, of each vertex of the site's mesh; null: not known        (ncorner)
    const double* probability;
    double weight;  // of `probability` against the random patches of the prior, 0 to 1
    // sets to try beside the most probable one, nonzero where attached             (nset x ncorner)
    int nset;  // at most OM_MATCH_MAX_ADVICE
    const unsigned char* set[OM_MATCH_MAX_ADVICE];
    // Attachments that the twin has, those of the newest acquisition, believed until a scan contradicts them; null: not
    // known. One set more is tried: these, attached where the scans show that tissue stayed and the twin moved it, and
    // free where they show that it moved; if it is chosen, of that only what they have or what bears load. An estimate
    // is refused if they explain the scans as well, with 0.5 to 2 times the scene's modulus   (ncorner)
    const unsigned char* present;
} OmMatchAdvice;

/// As om_match_update, with advice. Besides the most probable set, the set of the scans alone and those of the advice
/// are tried in the twin; one of them is taken if it brings the twin clearly nearer to the scans.
/// @param advice  may be null
/// @return as om_match_update; OM_INVALID also for advice that is not valid
OM_API OmStatus om_match_update_with(OmMatch* match, int nacquisition,
                                     const OmAcquisition* acquisition, const OmMatchAdvice* advice,
                                     const OmProgress* progress, OmMatchEstimate* estimate);
OM_API void om_match_estimate_done(OmMatchEstimate* estimate);
/// Judge one acquisition before any fit, as an update does; with OmMatchDef.is_unchecked it is good.
/// @return OM_OK (the verdict says whether it is good); OM_INVALID (an acquisition that is not valid); OM_NO_MEMORY
OM_API OmStatus om_match_judge(OmMatch* match, const OmAcquisition* acquisition,
                               OmMatchVerdict* verdict);

typedef struct OmMatchTrial {
    double median, p90;  // m, distances of scan points from the twin
    double mean;         // m, with each distance at most 5 mm
    bool is_at_rest;
} OmMatchTrial;

/// Bring the twin to rest with these attachments, under the grasps of each acquisition, and measure its distance from
/// the scans.
/// @param attached  nonzero where attached; vertices that are no candidates are free     (ncorner)
/// @param x         in: first guesses; out: the twin at rest, m  (nacquisition x mesh->nvert x 3)
/// @return OM_OK; OM_NOT_CONVERGED (no rest was found; x is the best iterate, and `trial` is of it); OM_INVALID (the
///         message names the acquisition); OM_NO_MEMORY
OM_API OmStatus om_match_try(OmMatch* match, int nacquisition, const OmAcquisition* acquisition,
                             const unsigned char* attached, double* x, OmMatchTrial* trial);

#ifdef __cplusplus
}
#endif
#endif
