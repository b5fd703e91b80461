/// omentum/banet_fuse.h: attachments from several views (room `banet`, floor 6).
///
/// A view is the network's probability of each vertex from one frame. Frames of one grasp have the same errors; another
/// grasp pulls at other attachments. om_banet_fuse therefore adds log-odds over grasps and averages them over the
/// frames of a grasp; old frames and places that a frame does not show count less. The thesis intersects: the last 30
/// predictions (6.4.6), or one prediction of each grasping point (4.4).
///
///     OmBanetFuseDef def = om_banet_fuse_default_def();
///     OmBanetView view[2] = {{.probability = p0, .grasp = 0}, {.probability = p1, .grasp = 1}};
///     om_banet_fuse(&def, 2, view, nvert, probability);
#ifndef OMENTUM_BANET_FUSE_H
#define OMENTUM_BANET_FUSE_H

#include "omentum/base.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_BANET_LATEST 30  // predictions that thesis 6.4.6 intersects

typedef struct OmBanetView {
    const double* probability;  // of being attached, by the network                    (n)
    // How well the frame shows the surroundings of each vertex, 0 to 1; null: 1 everywhere  (n)
    const double* shown;
    int grasp;   // number of the grasp; frames with one number belong together
    double age;  // s since the frame, at least 0
} OmBanetView;

typedef struct OmBanetFuseDef {  // made by om_banet_fuse_default_def
    // Probability of a vertex of which no view says anything, above 0, below 1. The default, 0.275, is the mean
    // attached share of the first training samples. With 0.2, that of the present ones, medians of DSC change by less
    // than 0.01 (development shapes of the phantoms).
    double base;
    // Frames of one grasp count together as (sum of their weights)^same, 0 to 1: 0 as one, 1 as independent. Default 0.
    double same;
    double other;      // the same for grasps; default 1
    double half_life;  // s after which a frame has half of its weight; default 0: frames do not age
    double unseen;     // weight of a frame where it shows nothing, 0 to 1; default 0.3
    double limit;      // largest log-odds of a single frame, above 0; default 4
    OmCookie cookie;
} OmBanetFuseDef;

OM_API OmBanetFuseDef om_banet_fuse_default_def(void);
/// Probability of each vertex from all views, in any order.
/// @param n            vertices
/// @param probability  (n)
/// @return OM_OK; OM_INVALID (the message names the field or the view)
OM_API OmStatus om_banet_fuse(const OmBanetFuseDef* def, int nview, const OmBanetView* view, int n,
                              double* probability);

/// Vertices above `threshold` in each of the `nlatest` views of least age (thesis 6.4.6).
/// @param attached  1 or 0; all 0 without a view                                       (n)
/// @return OM_OK; OM_INVALID
OM_API OmStatus om_banet_intersect(int nview, const OmBanetView* view, int nlatest,
                                   double threshold, int n, unsigned char* attached);
/// Vertices above `threshold` in the newest view of each grasp (thesis 4.4).
/// @param attached  1 or 0; all 0 without a view                                       (n)
/// @return OM_OK; OM_INVALID
OM_API OmStatus om_banet_intersect_grasps(int nview, const OmBanetView* view, double threshold,
                                          int n, unsigned char* attached);

#define OM_BANET_NEARLY 0.0075  // of the expected DSC, see om_banet_choose_threshold

/// Where calibrated probabilities are cut to give the attached set of greatest expected DSC: that of the set p >= t is
/// 2 S(t) / (n(t) + S(0)), with its number n and the sum S of its probabilities (Lipton et al. 2014, of F1). A sure
/// estimate is cut near 0.5, a vague one lower.
/// @param probability  0 to 1; of vertices that may be attached                            (n)
/// @param nearly       of sets whose expected DSC is at most this below the best the largest is taken, for its TPR;
///                     0: the best, OM_BANET_NEARLY: as scores of the network alone
/// @param threshold    above 0; 1 where all probabilities are 0
/// @return OM_OK; OM_INVALID (a probability that is none: the message names its vertex); OM_NO_MEMORY
OM_API OmStatus om_banet_choose_threshold(int n, const double* probability, double nearly,
                                          double* threshold);

#ifdef __cplusplus
}
#endif
#endif
