/// omentum/scan_picture.h: a scan from the pictures of a depth camera (floor 5; thesis 4.2).
///
/// Every pixel is classified by colour and by space: tissue, tool, or anything else. Neighbouring pixels of tissue are
/// connected where the surface is continuous. Points about one spacing apart are then chosen on this surface, so that
/// their density is that of the model's surface also where the surface is oblique. Each point is a mean of pixels near
/// it, with a normal from a plane through them. Triangles connect points whose neighbourhoods touch.
///
///     OmScanDef def = om_scan_default_def(world, &twin_site);
///     om_world_observe(world, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR, &obs);
///     OmScan scan;
///     om_scan_from_observation(&def, &obs, &scan);
///     ... om_scan_done(&scan);
#ifndef OMENTUM_SCAN_PICTURE_H
#define OMENTUM_SCAN_PICTURE_H

#include "omentum/scan.h"
#include "omentum/world_cloud.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmScanDef {
    OmCookie cookie;  // set by om_scan_default_def
    // Tools, fixed anatomy and reach. With colour, `clearance` is not used and `tool_margin` only for grey pixels:
    // a sheet lies on the board, and grasped tissue lies beside the jaws.
    OmCloudDef space;
    bool use_color;       // default true; a picture without colour is segmented by space alone
    OmSenseRange tissue;  // colours of the tissue; default om_sense_range(OM_PART_TISSUE)
    OmSenseRange tool;    // colours of tools and highlights; default om_sense_range(OM_PART_TOOL)
    // m, mean distance of neighbouring points, above 0; default the mean edge of the site's mesh
    double spacing;
    // m, above 0: neighbouring pixels whose depths differ by more are not connected; default 4 mm
    double max_jump;
    // Triangles with a smaller cosine between normal and ray are left out, 0 to 1; default 0.1.
    double min_cosine;
    // m^2, 0 or more: smaller pieces of tissue are left out; default 25 mm^2
    double min_area;
    int margin;  // pixels around a tool that are not tissue, 0 to 16; default 1
    // Noise of a depth, a + b z^2 for z in m: m and 1/m, 0 or more; default om_depth_noise_default. If neighbouring
    // pixels of the tissue show more noise, more is taken.
    double noise_a, noise_b;
} OmScanDef;

/// The arms of `world`, which may be null (no tools are known), and the anatomy of `site`: the robot's own, of role
/// OM_SITE_TWIN.
OM_API OmScanDef om_scan_default_def(const OmWorld* world, const OmSite* site);

/// The surface of the tissue in the depth picture of an observation (OM_OBSERVE_DEPTH, and OM_OBSERVE_COLOR where
/// the world has it), which has the arms of the same moment. `pixel` of the scan is filled in.
/// @return OM_OK (npoint may be 0); OM_INVALID (a definition out of range, an observation without depth, a colour
///         picture of another size); OM_NO_MEMORY
OM_API OmStatus om_scan_from_observation(const OmScanDef* def, const OmObservation* observation,
                                         OmScan* scan);

// ---- colours of a tissue ------------------------------------------------------------------------------------

typedef struct OmScanRegion {  // pixels of a picture: a disc around a click, or a box
    bool is_box;
    double u, v, radius;             // of the disc: centre in pixel coordinates, pixels
    int column, row, width, height;  // of the box: its first pixel and its size
} OmScanRegion;

/// Bounds of the colours of a tissue, for OmScanDef.tissue, from pixels that show it: 5 and 95 % quantiles of the hue,
/// extended by half their distance, 6 degrees or more. Grey pixels (highlights), dark pixels and over-exposed pixels do
/// not count. The lower bounds of saturation and value are 0.35 of the median and 0.12 of the darkest tenth, for gloss
/// and for folds that turn away from the light.
/// @param picture  RGB or RGBA
/// @return OM_OK; OM_INVALID (no part of the region is in the picture, fewer than 50 pixels have a colour, more than
///         a third of them are grey or over-exposed, or they have the colours of two materials: the message says
///         which); OM_NO_MEMORY
OM_API OmStatus om_scan_learn_range(const OmPicture* picture, const OmScanRegion* region,
                                    OmSenseRange* range);

#ifdef __cplusplus
}
#endif
#endif
