/// omentum/scan.h: a scan, the part of the tissue's surface that a camera sees (floor 3; thesis 4.2).
///
/// The thesis calls it the intra-operative surface (IOS): points with normals, and triangles between neighbouring
/// pixels. A scan comes from pictures of a world, from a file, or from a stereo pair. Every method of
/// the room match takes a scan.
///
///     OmScan scan;
///     om_scan_init(npoint, ntri, &scan);
///     ... write scan.x, scan.normal, scan.tri_vert ...
///     om_scan_check(&scan);
///     om_scan_done(&scan);
#ifndef OMENTUM_SCAN_H
#define OMENTUM_SCAN_H

#include "omentum/base.h"
#include "omentum/sense.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum OmScanPixel {  // class of a pixel of the camera
    // no depth, one out of the camera's range (too near, too far, a value for "no data"), or not classified
    OM_SCAN_UNKNOWN,
    OM_SCAN_TISSUE,  // the tissue
    OM_SCAN_TOOL,    // an instrument: tissue may lie behind it
    OM_SCAN_OTHER    // board, organ or anything else, at a measured place: no tissue lies before it
} OmScanPixel;

typedef struct OmScan {  // om_scan_done frees
    double time;         // s, of the exposure
    int npoint, ntri;    //
    double* x;           // world frame, m                                             (npoint x 3)
    double* normal;      // unit, towards the camera; zero: not known                  (npoint x 3)
    int* tri_vert;       // counter-clockwise seen from the camera, cut at depth jumps (ntri x 3)
    double noise;        // m, standard deviation of a point along its ray; 0: not known
    bool has_camera;     // `camera` is the camera of the picture
    OmCamera camera;
    unsigned char* pixel;  // OmScanPixel of each pixel, or null  (camera.height x camera.width)
    float* depth;          // m along the camera's z, 0: none; null: not known         (the same)
} OmScan;

/// Allocate arrays for the counts, all zero; `pixel` and `depth` are null.
/// @return OM_OK; OM_INVALID (a negative count); OM_NO_MEMORY
OM_API OmStatus om_scan_init(int npoint, int ntri, OmScan* scan);
OM_API void om_scan_done(OmScan* scan);
/// Check counts, finite positions, normals of length 1 or 0, and vertices of triangles.
/// @return OM_OK; OM_INVALID (the message names the first point or triangle)
OM_API OmStatus om_scan_check(const OmScan* scan);

#ifdef __cplusplus
}
#endif
#endif
