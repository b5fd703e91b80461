// sense_stereo_internal.h: the stages of stereo matching on rectified pictures.
#ifndef OMENTUM_SENSE_STEREO_INTERNAL_H
#define OMENTUM_SENSE_STEREO_INTERNAL_H

#include "omentum/sense_stereo.h"

typedef struct Rectified {  // a pair of rectified pictures
    int width, height;      // pixels
    int min_disparity;      // the first candidate
    int ndisparity;         // candidates, a multiple of 16
    float *left, *right;    // grey, 0 to 255; below 0: outside of the picture  (height x width)
    float* disparity;       // of the left picture; below 0: none               (height x width)
} Rectified;

// Semi-global matching with sub-pixel parabola, check of left against right, and removal of small patches.
OmStatus om__stereo_match(const OmStereoDef* def, Rectified* r);
// Improve disparities on the grey values.
OmStatus om__stereo_refine(const OmStereoDef* def, Rectified* r);

#endif
