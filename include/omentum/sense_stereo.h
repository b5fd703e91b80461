/// omentum/sense_stereo.h: depth from the two pictures of a stereo endoscope (floor 3).
///
/// The pictures are rectified by the known poses and lenses of the cameras, matched by semi-global matching, and the
/// disparities become depth along z of the left camera, in the pixels of the left picture: the same picture as that of
/// a depth camera (om_sense_depth), with 0 where no match is certain.
///
///     OmStereoDef def = om_stereo_default_def();
///     OmStereoPair pair = {left_camera, right_camera, &left, &right};
///     om_stereo_depth(&def, &pair, depth, &report);        // depth: left height x width
#ifndef OMENTUM_SENSE_STEREO_H
#define OMENTUM_SENSE_STEREO_H

#include "omentum/sense.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_STEREO_MAX_DISPARITY 512  // candidates of a pixel

typedef struct OmStereoPair {  // borrowed
    // Intrinsics and poses. The right camera stands on the right of the left one: the baseline is within 30 degrees of
    // the left camera's x axis, and both axes of view are within 60 degrees of its normal.
    OmCamera left, right;
    const OmPicture *left_picture, *right_picture;  // of the cameras' sizes, 1, 3 or 4 channels
} OmStereoPair;

typedef struct OmStereoDef {
    OmCookie cookie;       // set by om_stereo_default_def
    double near_m, far_m;  // range of depth that is searched, m; default 40 mm to 400 mm
    int penalty_one;       // P1: disparities of neighbours differ by one; default 8, 1 to 60
    int penalty_jump;      // P2 > P1: they differ by more; default 96, to 120
    // The best sum of costs is below the next best, not its neighbour, by this share; default 0.02, 0 to 1.
    double min_gain;
    double max_twist;  // pixels, between the disparities of left and right; default 1
    int min_patch;     // pixels: smaller islands of disparity are noise; default 100
    bool is_refined;   // improve the disparities below a pixel on the grey values; default true
    int nworker;       // 0: one a processor; the depth does not depend on it
} OmStereoDef;
OM_API OmStereoDef om_stereo_default_def(void);

typedef struct OmStereoReport {
    double share;     // pixels with depth, 0 to 1
    int ndisparity;   // candidates of a pixel
    double baseline;  // m
    double focal;     // pixels, of the rectified pictures: depth is focal x baseline / disparity
    double ms_rectify, ms_match, ms_refine, ms_total;
} OmStereoReport;

/// Depth along z of the left camera, m (left.height x left.width); 0 where there is no match, or where depth is out of
/// the range of the definition or of the left camera.
/// Memory: 5 bytes for each pixel and candidate, 8 GiB at most.
/// @param report  may be null
/// @return OM_OK; OM_INVALID (the message names the field: a camera, a picture of another size or without 1, 3 or 4
///         channels, a baseline that is not to the right, more than OM_STEREO_MAX_DISPARITY candidates or 8 GiB);
///         OM_NO_MEMORY
OM_API OmStatus om_stereo_depth(const OmStereoDef* def, const OmStereoPair* pair, float* depth,
                                OmStereoReport* report);

/// Rectified cameras: ideal pinholes of one orientation and focal length, x along the baseline, so that a point is in
/// the same row of both pictures and its disparity, left u less right u, is focal x baseline / depth. The left one
/// sees what the left camera of the pair sees.
/// @return OM_OK; OM_INVALID (as om_stereo_depth)
OM_API OmStatus om_stereo_rectify(const OmStereoPair* pair, OmCamera* left, OmCamera* right);

#ifdef __cplusplus
}
#endif
#endif
