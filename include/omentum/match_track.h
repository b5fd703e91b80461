/// omentum/match_track.h: material points of the tissue that are followed from picture to picture (floor 5).
///
/// Distances to a surface do not show a shift along it; the texture of the tissue does. A tracker finds corners of the
/// texture (sense_track.h), keeps the material point of each from the registration of the picture in which it was
/// found, and follows it through later pictures. The depth of a picture gives its place in space, with a covariance;
/// om_match_find_pairs_with ties the twin to these places.
///
///     OmMatchTrackerDef def = om_match_tracker_default_def(match);
///     om_match_tracker_create(&def, &tracker);
///     for (each picture) {
///         om_match_tracker_follow(tracker, &scan, &color, &tracks);
///         om_match_find_pairs_with(live, &scan, ngrasp, grasp, x_twin, &tracks, &pairs);
///         om_match_tracker_adopt(tracker, &pairs);
///     }
///
/// The first picture shows the tissue at rest, or where the twin knows it: what it finds is where pairs.x says.
#ifndef OMENTUM_MATCH_TRACK_H
#define OMENTUM_MATCH_TRACK_H

#include "omentum/match_live.h"
#include "omentum/sense_track.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmMatchTrackerDef {  // made by om_match_tracker_default_def
    const OmMatch* match;           // borrowed until destroy; only its constant part is used
    OmTrackDef track;               // of corners and windows
    int max;                        // tracks at a time, 1 to 10,000; default 400
    double max_jump;  // m, between the depths of neighbouring pixels of a window; default 2.5 mm
    // m, between a place and the surface of the twin, for a new track; default 2 mm
    double max_distance;
    // m, standard deviation along the surface of a material point that is found; default 0.5 mm
    double anchor;
    // A track that is farther from its material point than this, m, and than three times the median of all, ends;
    // default 4 mm
    double max_off;
    OmCookie cookie;
} OmMatchTrackerDef;
OM_API OmMatchTrackerDef om_match_tracker_default_def(const OmMatch* match);

typedef struct OmMatchTracker OmMatchTracker;  // for one thread at a time
/// @return OM_OK; OM_INVALID (the message names the field); OM_NO_MEMORY
OM_API OmStatus om_match_tracker_create(const OmMatchTrackerDef* def, OmMatchTracker** tracker);
OM_API void om_match_tracker_destroy(OmMatchTracker* tracker);
/// Forget all tracks and the last picture.
OM_API void om_match_tracker_reset(OmMatchTracker* tracker);
/// Follow all tracks to a new picture. A track ends where it is lost, leaves the tissue, or has no depth.
/// @param scan    with camera, `pixel` and `depth`
/// @param color   of the same pixels
/// @param tracks  out: views, valid until the next call for this tracker
/// @return OM_OK (tracks->n may be 0); OM_INVALID (a scan without these, or a picture of another size); OM_NO_MEMORY
OM_API OmStatus om_match_tracker_follow(OmMatchTracker* tracker, const OmScan* scan,
                                        const OmPicture* color, OmMatchTracks* tracks);
/// End tracks that contradict the registration of the picture just followed, and find new ones, whose material points
/// are where the registered twin shows them. A lost registration changes nothing.
/// @return OM_OK; OM_INVALID (no picture was followed, or pairs of another twin); OM_NO_MEMORY
OM_API OmStatus om_match_tracker_adopt(OmMatchTracker* tracker, const OmMatchPairs* pairs);

#ifdef __cplusplus
}
#endif
#endif
