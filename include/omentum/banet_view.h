/// omentum/banet_view.h: the displacement field that a robot measures, for BA-Net (floor 6; thesis 4.2).
///
/// The network is trained on fields that come out of the robot's own measurement: a depth picture with noise, a tool
/// and holes, and pairs found through a twin whose attachments are wrong. A field at run time has the same form: the
/// pairs of a scan, and how well the camera saw each vertex.
///
///     om_match_find_pairs(live, &scan, 1, &grasp, om_body_x(twin), &pairs);
///     om_banet_measure(om_match_view(match), &pairs, u, seen);
#ifndef OMENTUM_BANET_VIEW_H
#define OMENTUM_BANET_VIEW_H

#include "omentum/match_live.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The field that the network reads, from the pairs of a scan whose points are about one edge of the twin apart.
/// @param u     displacement from rest of each vertex of OmMatchView.surface, m    (surface->nvert x 3)
/// @param seen  0: no point of the scan is near the vertex; 1: well seen           (surface->nvert)
OM_API void om_banet_measure(const OmMatchView* view, const OmMatchPairs* pairs, double* u,
                             double* seen);

#ifdef __cplusplus
}
#endif
#endif
