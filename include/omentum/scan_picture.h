/// omentum/scan_picture.h: a scan from the pictures of a depth camera (floor 3; thesis 4.2).
///
/// Every pixel is classified by colour and by space: tissue, tool, or anything else. Neighbouring pixels of tissue are
/// connected where the surface is continuous. Points about one spacing apart are then chosen on this surface, so that
/// their density is that of the model's surface also where the surface is oblique. Each point is a mean of pixels near
/// it, with a normal from a plane through them, or from its triangles where they lie on a line. Triangles connect
/// points whose neighbourhoods touch. On a narrow strip of tissue, without triangles, the normal is zero: not known.
///
///     OmScanDef def = om_scan_default_def(0.004);
///     OmScanField field = {.hi = ..., .clearance = 0.002, .tool_margin = 0.002};
///     OmScan scan;
///     om_scan_from_picture(&def, &field, &picture, &scan);
///     ... om_scan_done(&scan);
///
/// om_scan_from_observation (world_cloud.h) fills in the field from a world and a site.
#ifndef OMENTUM_SCAN_PICTURE_H
#define OMENTUM_SCAN_PICTURE_H

#include "omentum/robot.h"
#include "omentum/scan.h"
#include "omentum/shape_sdf.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- space: where the tissue can be ------------------------------------------------------------------------------

typedef enum OmScanPlace {  // of a point
    OM_PLACE_FREE,          // near the task, away from tools and fixed anatomy
    OM_PLACE_FIXED,         // nearer than `clearance` to board or organ
    OM_PLACE_FAR,           // outside the reach of the tissue
    OM_PLACE_TOOL           // nearer than `tool_margin` to a tool, also outside the reach
} OmScanPlace;

typedef struct OmScanField {  // tools, fixed anatomy and limits at the time of a picture
    OmPose pose_task_world;
    OmVec3 lo, hi;        // reach of the tissue, task frame, m
    bool has_ground;      // a board at the task frame's z = 0
    const OmSdf* organ;   // fixed anatomy; null: none; borrowed
    double clearance;     // points nearer to board or organ are fixed, m
    double tool_margin;   // points nearer to a tool are of the tool, m
    bool has_every_tool;  // `capsule` has all tools of the field
    int ncapsule;
    OmPsmCapsule capsule[OM_MAX_ARM * OM_PSM_NCAPSULE];  // tools at their measured tips
} OmScanField;

/// Place of a point of the world. A point that is at two of them has the later one in OmScanPlace.
OM_API OmScanPlace om_scan_field_eval(const OmScanField* field, OmVec3 p);

// ---- a scan ------------------------------------------------------------------------------------------------------

typedef struct OmScanDef {
    OmCookie cookie;      // set by om_scan_default_def
    bool use_color;       // default true; a picture without colour is segmented by space alone
    OmSenseRange tissue;  // colours of the tissue; default om_sense_range(OM_PART_TISSUE)
    OmSenseRange tool;    // colours of tools and highlights; default om_sense_range(OM_PART_TOOL)
    double spacing;       // m, mean distance of neighbouring points, above 0
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

OM_API OmScanDef om_scan_default_def(double spacing);

/// The surface of the tissue in a depth picture, with its colour where it has one. `pixel` of the scan is filled in.
/// @param field  of the same moment. With colour, `clearance` is not used and `tool_margin` only for grey pixels: a
///               sheet lies on the board, and grasped tissue lies beside the jaws
/// @return OM_OK (npoint may be 0); OM_INVALID (a definition out of range, no depth, a colour picture of another
///         size); OM_NO_MEMORY
OM_API OmStatus om_scan_from_picture(const OmScanDef* def, const OmScanField* field,
                                     const OmDepthPicture* picture, OmScan* scan);

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
