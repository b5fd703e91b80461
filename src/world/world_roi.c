// world_roi.c: visible fraction of the ROI in a picture, by colour.
//
// The ROI has a hue that tissue, organ, tools and board lack. Highlights and shadows change saturation and value, but
// not the hue. Where a highlight is so bright that no hue is left, the point counts as hidden.
#include "omentum/world_cloud.h"

#define HUE_RANGE 25.0      // degrees, to either side
#define SATURATION_MIN 0.3  // below it a pixel is grey or a highlight
#define VALUE_MIN 20        // of 255: below it a pixel is black

// Hue in degrees, 0 to 360; -1 for a pixel without a hue.
static double hue_of(double r, double g, double b) {
    double high = fmax(r, fmax(g, b)), low = fmin(r, fmin(g, b)), range = high - low;
    if (high < VALUE_MIN || range < SATURATION_MIN * high) return -1;
    double h = high == r ? (g - b) / range : high == g ? 2 + (b - r) / range : 4 + (r - g) / range;
    return 60 * (h < 0 ? h + 6 : h);
}

static double encode(double linear) { return 255 * pow(linear, 1 / 2.2); }

static double roi_hue(void) {
    OmSenseLook look = om_sense_look(OM_PART_ROI);
    return hue_of(encode(look.red), encode(look.green), encode(look.blue));
}

static bool is_roi_pixel(const OmPicture* color, int column, int row, double hue) {
    const unsigned char* c =
        &color->pixel[color->nchannel * ((ptrdiff_t)row * color->width + column)];
    double h = hue_of(c[0], c[1], c[2]);
    double off = fabs(h - hue);
    return h >= 0 && fmin(off, 360 - off) <= HUE_RANGE;
}

OmStatus om_roi_visibility(const OmWorldPicture* picture, const OmSite* site, double* share) {
    *share = 0;
    const OmPicture* color = &picture->color;
    OM_CHECK(color->pixel && color->nchannel >= 3, OM_INVALID,
             "the endoscope's picture is missing");
    OM_CHECK(site->nroi > 0, OM_INVALID, "the site has no ROI");
    OmVec3 eye = picture->camera.pose_world_camera.p;
    double hue = roi_hue();
    int nseen = 0;
    for (int i = 0; i < site->nroi; ++i) {
        OmVec3 p = om_load3(site->roi_x, i);
        double u, v;
        if (om_dot(om_load3(site->roi_n, i), om_sub(eye, p)) <= 0) continue;
        if (!om_camera_project(&picture->camera, p, &u, &v)) continue;
        bool is_inside = u >= 0 && v >= 0 && u < color->width && v < color->height;
        nseen += is_inside && is_roi_pixel(color, (int)u, (int)v, hue);
    }
    *share = (double)nseen / site->nroi;
    return OM_OK;
}
