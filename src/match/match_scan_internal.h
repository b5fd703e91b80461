// match_scan_internal.h: a picture on its way to a scan.
#ifndef OMENTUM_MATCH_SCAN_INTERNAL_H
#define OMENTUM_MATCH_SCAN_INTERNAL_H

#include "omentum/match_scan_picture.h"

typedef struct ScanPicture {
    int width, height, npixel;
    const float* depth;    // m along the camera's z
    double* x;             // of pixels with depth, world frame, m (npixel x 3)
    unsigned char* class;  // OmScanPixel (npixel)
    double angle;          // between the rays of neighbouring pixels in the middle, rad
    double max_jump;       // m, of linked pixels
} ScanPicture;

static inline bool om__has_depth(const ScanPicture* p, int i) {
    return p->depth[i] > 0 && isfinite(p->depth[i]);
}

// Neighbour k of pixel i: 0 to 3 share a side, 4 to 7 a corner; -1 outside the picture.
static inline int om__neighbour(const ScanPicture* p, int i, int k) {
    static const signed char step[8][2] = {{1, 0}, {-1, 0}, {0, 1},  {0, -1},
                                           {1, 1}, {-1, 1}, {1, -1}, {-1, -1}};
    int column = i % p->width + step[k][0], row = i / p->width + step[k][1];
    bool is_inside = column >= 0 && row >= 0 && column < p->width && row < p->height;
    return is_inside ? row * p->width + column : -1;
}

static inline bool om__is_near(const ScanPicture* p, int i, int j) {
    return fabs((double)p->depth[i] - (double)p->depth[j]) <= p->max_jump;
}

// Whether the surface of the tissue is continuous between two neighbouring pixels.
static inline bool om__is_linked(const ScanPicture* p, int i, int j) {
    return p->class[i] == OM_SCAN_TISSUE && p->class[j] == OM_SCAN_TISSUE && om__is_near(p, i, j);
}

// Choose points on the pixels of class OM_SCAN_TISSUE, with normals and triangles, into an empty scan.
OmStatus om__scan_decimate(const OmScanDef* def, OmVec3 eye, const ScanPicture* picture,
                           OmScan* scan);

#endif
