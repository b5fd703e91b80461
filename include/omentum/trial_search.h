/// omentum/trial_search.h: what a scene allows, found by trying it in simulation (floor 8; thesis 6.5.1).
///
/// The force threshold from the forces of retractions, and the ceiling: can the region of interest be exposed at all?
#ifndef OMENTUM_TRIAL_SEARCH_H
#define OMENTUM_TRIAL_SEARCH_H

#include "omentum/trial_preplan.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The force threshold of a scene (6.5.1): every grasping point of `nlayout` layouts (seeds 1, 2, ...) is grasped by
/// the twin, pulled to the height limit and, while the ROI is hidden, folded both ways, measured forces ignored; as in
/// a run a motion ends where the ROI is seen. Epsilon is twice the median of the largest pull of each grasp. A quarter
/// of the grasps of free tissue is repeated on the simulated truth, until the twin's pull is above the threshold. The
/// arms act at the limit, the threshold less the margin: the largest for which the truth stays below the threshold in
/// 95 % of the instants at which the twin's pull is between three quarters of the limit, where motions slow down, and
/// the limit. Steps of the truth that are not right do not count, nor what follows ten of them in a row. A motion of
/// the twin ends at twice the scene's threshold, one of the truth at twice the measured one.
typedef struct OmForceCalibration {
    int nrun;                                            // grasps that held free tissue
    double median, lower_quartile, upper_quartile, max;  // N, of the largest pulls
    double threshold;                                    // N, 2 x median
    int nheld;           // grasps above attachments, which the threshold leaves out
    double held_median;  // N, of their largest pulls; 0: none
    double margin;       // N, for OmSceneTask.force_margin
    double more_median;  // N, the median of truth less twin, at the instants of npair
    int npair;           // instants between three quarters of the limit and the limit
} OmForceCalibration;
/// Measure threshold and margin of a scene, as above.
/// @param young  the truth's modulus over the twin's, from and to, even in its logarithm over the layouts; null: the
///               scene's young_factor
/// @return OM_OK; OM_INVALID (no grasp succeeds, half of the grasps reach twice the threshold, or the truth bears more
///        than the threshold at every limit); OM_NO_MEMORY; OM_CANCELLED
OM_API OmStatus om_retract_calibrate_force(const OmScene* scene, const double young[2], int nlayout,
                                           int nworker, const OmProgress* progress,
                                           OmForceCalibration* calibration);

/// Can a layout be exposed at all? Try, from rest on the simulated truth, every sequence of the planner's actions for
/// one grasp (pulls until the ROI is exposed or to the height or force limit, then no fold, either fold, or both in
/// either order), for every grasping point that is not above an attachment; without noise and without tools in view.
typedef struct OmSearchResult {
    int ngrasp, nsequence;     // grasping points and sequences tried
    int nexposed;              // sequences that exposed the ROI
    int first_block;           // that the other arm holds meanwhile; -1: one arm
    double visibility;         // the largest of all sequences, 0 to 1
    double force;              // N, the largest pull of that sequence, in the truth
    int block;                 // grasping point of that sequence, -1: nothing can be grasped
    OmPlanVerb first, second;  // folds of that sequence; OM_PLAN_PULL: none
    int naction;  // fewest actions of a sequence that exposes the ROI, with reach and grasp; 0: none
} OmSearchResult;
/// @param force_limit  N; a motion ends there
/// @return OM_OK, also if nothing exposes the ROI; OM_INVALID (a scene that cannot be run); OM_NO_MEMORY;
///        OM_IO; OM_CANCELLED
OM_API OmStatus om_retract_search(const OmScene* scene, double force_limit, int nworker,
                                  const OmProgress* progress, OmSearchResult* result);
/// As om_retract_search, without the sequences that cannot need fewer actions than one that was found: `naction` is the
/// same, and `nexposed` is 0 where it would be; the other figures are of the sequences that were tried.
/// @return as om_retract_search
OM_API OmStatus om_retract_search_fewest(const OmScene* scene, double force_limit, int nworker,
                                         const OmProgress* progress, OmSearchResult* result);
/// As om_retract_search. Where no sequence exposes the ROI, the `nfirst` grasps with the largest visibility are held by
/// one arm while the other tries every other block in the same way, until a pair exposes the ROI. The result then also
/// counts these sequences; if `first_block` is not -1, `naction` counts the actions of both arms.
/// @return as om_retract_search
OM_API OmStatus om_retract_search_both(const OmScene* scene, double force_limit, int nfirst,
                                       int nworker, const OmProgress* progress,
                                       OmSearchResult* result);

/// Does a wrong belief matter? The plan before an operation carried out open loop: the grasp, its pulls and its fold,
/// on the simulated truth, from rest; no limit of force, no monitor and no second plan. Pulls have their full length.
/// A fold ends as its action does, where further steps gain no visibility.
typedef struct OmOpenLoop {
    bool is_held;       // the jaw closed on free tissue
    bool is_exposed;    // the wanted share of the ROI is seen for 0.5 s at the end
    double visibility;  // the least share seen in that time, 0 to 1
    double force;       // N, the largest pull
    int naction;        // with reach and grasp
} OmOpenLoop;
/// @param plan  of om_preplan_run for this scene
/// @return OM_OK, also if nothing is exposed; OM_INVALID (a plan of another grid or without a chosen point, or a scene
///        that cannot be run); OM_NO_MEMORY; OM_CANCELLED
OM_API OmStatus om_retract_open_loop(const OmScene* scene, const OmPreplan* plan, int nworker,
                                     const OmProgress* progress, OmOpenLoop* result);

#ifdef __cplusplus
}
#endif
#endif
