// world_roi.c: visible fraction of the ROI in a picture, by colour.
//
// A point of the ROI counts as seen where its pixel has a colour of the ROI (om_sense_range). Where a highlight is so
// bright that no hue is left, the point counts as hidden.
#include "omentum/world_cloud.h"

static bool is_roi_pixel(const OmPicture* color, int column, int row) {
    ptrdiff_t at = (ptrdiff_t)row * color->width + column;
    return om_sense_part_of(&color->pixel[color->nchannel * at]) == OM_PART_ROI;
}

OmStatus om_roi_visibility(const OmWorldPicture* picture, const OmSite* site, double* visibility) {
    *visibility = 0;
    const OmPicture* color = &picture->color;
    OM_CHECK(color->pixel && color->nchannel >= 3, OM_INVALID,
             "the endoscope's picture is missing");
    OM_CHECK(site->nroi > 0, OM_INVALID, "the site has no ROI");
    OmVec3 eye = picture->camera.pose_world_camera.p;
    int nseen = 0;
    for (int i = 0; i < site->nroi; ++i) {
        OmVec3 p = om_load3(site->roi_x, i);
        double u, v;
        if (om_dot(om_load3(site->roi_n, i), om_sub(eye, p)) <= 0) continue;
        if (!om_camera_project(&picture->camera, p, &u, &v)) continue;
        bool is_inside = u >= 0 && v >= 0 && u < color->width && v < color->height;
        nseen += is_inside && is_roi_pixel(color, (int)u, (int)v);
    }
    *visibility = (double)nseen / site->nroi;
    return OM_OK;
}
