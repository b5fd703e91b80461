// scan_internal.h: a picture on its way to a scan.
#ifndef OMENTUM_SCAN_INTERNAL_H
#define OMENTUM_SCAN_INTERNAL_H

#include "omentum/scan_picture.h"

typedef struct ScanPicture {
    int width, height, npixel;
    const float* depth;    // m along the camera's z
    double* x;             // of pixels with depth, world frame, m (npixel x 3)
    unsigned char* class;  // OmScanPixel (npixel)
    double angle;          // between the rays of neighbouring pixels in the middle, rad
    double max_jump;       // m, of linked pixels
    OmVec3 eye;
    double noise_a, noise_b;  // standard deviation of a depth, a + b z^2
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

static inline double om__depth_noise(const ScanPicture* p, double z) {
    return p->noise_a + p->noise_b * z * z;
}

// The noise of two depths alone seldom makes a difference of six standard deviations.
static inline bool om__is_near(const ScanPicture* p, int i, int j) {
    double a = (double)p->depth[i], b = (double)p->depth[j];
    return fabs(a - b) <= fmax(p->max_jump, 6 * om__depth_noise(p, a));
}

// Whether the surface of the tissue is continuous between two neighbouring pixels.
static inline bool om__is_linked(const ScanPicture* p, int i, int j) {
    return p->class[i] == OM_SCAN_TISSUE && p->class[j] == OM_SCAN_TISSUE && om__is_near(p, i, j);
}

// Radius that a point covers over the mean distance of neighbours: tests of scans hold this distance.
#define OM__SCAN_COVER 0.85

typedef struct ScanEdges {  // directed edges of triangles, by their first point
    int *head, *next, *to;
    int n;
} ScanEdges;
// Room for the edges of `ntri` triangles.
OmStatus om__edges_init(ScanEdges* e, int npoint, int ntri);
void om__edges_done(ScanEdges* e);
// Take the edges of a triangle; false, with nothing taken, if one of them is in use.
bool om__edges_take(ScanEdges* e, const int v[3]);

// Keep points `spacing` apart in the mean, each the mean of the points around it.
OmStatus om__scan_thin(double spacing, OmScan* scan, int* nthinned);

// Normal of the plane through some points, of either direction, and their mean; zero if they are fewer than six or lie
// on a line.
OmVec3 om__plane_normal(const double* x, int n, const int* point, OmVec3* mean);

// Estimate the normals of length 0 of a scan without camera or triangles; `eye` null: they agree with their
// neighbours, and those of a piece point up in the mean.
OmStatus om__scan_estimate_normals(const OmVec3* eye, OmVec3 up, OmScan* scan, int* nestimated);

// Choose points on the pixels of class OM_SCAN_TISSUE, with normals and triangles, into an empty scan.
OmStatus om__scan_decimate(const OmScanDef* def, const ScanPicture* picture, OmScan* scan);

#endif
