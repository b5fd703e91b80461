/// omentum/sense_track.h: points of a texture followed from picture to picture (floor 3).
///
/// Corners of a texture are found where the smallest eigenvalue of the structure matrix is large (J. Shi, C. Tomasi,
/// "Good features to track", CVPR 1994). They are followed by the method of Lucas and Kanade on a pyramid of pictures
/// (J.-Y. Bouguet, "Pyramidal implementation of the Lucas Kanade feature tracker", Intel 2001), forwards and back: a
/// point that does not come back is lost. Each place has a covariance.
///
///     OmTrackDef def = om_track_default_def();
///     om_track_picture_init(&def, &first, &a);
///     om_track_picture_init(&def, &second, &b);
///     om_track_find_corners(&def, &a, NULL, 0, NULL, 300, at, &n);
///     om_track_follow(&def, &a, &b, n, at, NULL, track);     // track[i].u, track[i].v, unless track[i].is_lost
///
/// Places are pixel coordinates as in sense.h: the centre of the first pixel is (0.5, 0.5).
#ifndef OMENTUM_SENSE_TRACK_H
#define OMENTUM_SENSE_TRACK_H

#include "omentum/image.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_TRACK_MAX_LEVEL 8

typedef struct OmTrackDef {  // made by om_track_default_def
    int nlevel;              // pictures of a pyramid, each half as large; 1 to 8; default 3
    int radius;          // px, half the side of a point's window, 2 to 16; default 4: 9 x 9 pixels
    int max_iterations;  // on each picture of the pyramid, 1 to 100; default 15
    double tolerance;    // px, of an iteration; > 0; default 0.01
    // Corners: smallest eigenvalue of the mean of g g^T over the window, for the gradient g of the grey value
    // (0 to 255), px^-2; >= 0; default 6
    double min_corner;
    double share;            // ... and over that of the strongest corner, 0 to 1; default 0.01
    double spacing;          // px, between corners; >= 1; default 5
    double max_back;         // px, between a point and where it comes back to; > 0; default 0.5
    double min_correlation;  // between the two windows, -1 to 1; default 0.85
    double noise;            // grey values, least standard deviation of a pixel; > 0; default 1
    int nworker;             // 0: one a processor; the result does not depend on it; default 1
    OmCookie cookie;
} OmTrackDef;
OM_API OmTrackDef om_track_default_def(void);
/// @return OM_OK; OM_INVALID (the message names the field)
OM_API OmStatus om_track_check_def(const OmTrackDef* def);

typedef struct OmTrackLevel {  // grey values and their gradient
    int width, height;
    float *grey, *gu, *gv;  // (height x width)
} OmTrackLevel;

typedef struct OmTrackPicture {  // om_track_picture_done frees
    int nlevel;                  // fewer than in the definition if the picture is small
    OmTrackLevel level[OM_TRACK_MAX_LEVEL];
    float* block;  // the arrays of all levels
} OmTrackPicture;

/// The pyramid of a picture of 1, 3 or 4 channels; colours become grey values 0.299 R + 0.587 G + 0.114 B (BT.601).
/// @return OM_OK; OM_INVALID (the definition, or a picture without pixels or smaller than a window: the message names
///         it); OM_NO_MEMORY
OM_API OmStatus om_track_picture_init(const OmTrackDef* def, const OmPicture* picture,
                                      OmTrackPicture* out);
OM_API void om_track_picture_done(OmTrackPicture* picture);

typedef struct OmTrackWhere {  // where corners may be
    // nonzero: allowed, with nine tenths of the window; null: everywhere    (height x width)
    const unsigned char* mask;
    int nold;           // places that have a corner already
    const double* old;  // (nold x 2)
} OmTrackWhere;

/// The strongest corners first, at centres of pixels, `spacing` away from each other and from old ones.
/// @param where  null: everywhere
/// @param max    room in `at`                      (max x 2)
/// @return OM_OK (n may be 0); OM_INVALID (the message names the field); OM_NO_MEMORY
OM_API OmStatus om_track_find_corners(const OmTrackDef* def, const OmTrackPicture* picture,
                                      const OmTrackWhere* where, int max, double* at, int* n);

typedef struct OmTrack {  // of a point, in the second picture
    double u, v;          // px
    // px^2, covariance of (u, v): uu, uv, vv. It holds noise of both pictures, not what the window shows beside a
    // shift: turns, stretches, changes of the light
    double covariance[3];
    double back;         // px, between the point and where it comes back to
    double residual;     // grey values, root mean square over the window
    double correlation;  // of the two windows, to 1
    bool is_lost;        // the other fields are not set
} OmTrack;

/// Follow n points from one picture to another of the same size.
/// @param at     places in the first picture                             (n x 2)
/// @param guess  where the search begins; null: at the same places       (n x 2)
/// @param track  out                                                     (n)
/// @return OM_OK; OM_INVALID (the definition, or pictures of two sizes: the message names it)
OM_API OmStatus om_track_follow(const OmTrackDef* def, const OmTrackPicture* from,
                                const OmTrackPicture* to, int n, const double* at,
                                const double* guess, OmTrack* track);

#ifdef __cplusplus
}
#endif
#endif
