/// omentum/world_cloud.h: points and scans of the tissue, and the visibility of the ROI, from pictures of any world
/// (floor 4).
///
/// A depth camera sees tissue, tools and the anatomy around, and pixels have no labels. A robot knows the poses of its
/// tools, from measured joints, and the fixed anatomy, from the patient model. Points near tools or fixed anatomy, and
/// points far from the task, are left out; the other points are tissue.
///
///     OmCloudDef def = om_cloud_default_def(world, &twin_site);
///     om_world_observe(world, OM_OBSERVE_DEPTH, &obs);
///     OmCloud cloud;
///     om_cloud_init(&def, &obs, &cloud);
///     ... om_cloud_done(&cloud);
///
/// A scan (scan_picture.h) is the surface of the tissue, by colour and by space:
///
///     OmScanDef how = om_scan_default_def(om_site_spacing(&twin_site));
///     om_world_observe(world, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR, &obs);
///     om_scan_from_observation(&how, &def, &obs, &scan);
#ifndef OMENTUM_WORLD_CLOUD_H
#define OMENTUM_WORLD_CLOUD_H

#include "omentum/scan_picture.h"
#include "omentum/world.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmCloudDef {
    OmCookie cookie;               // set by om_cloud_default_def
    const OmSite* site;            // board, organ and task frame as known before the operation
    const OmPsm* psm[OM_MAX_ARM];  // kinematics of the arms; null: the arm's tool is not left out
    // Points nearer to board or organ are left out, m; default 2 mm, six standard deviations of the noise at 0.3 m.
    double clearance;
    double tool_margin;  // points nearer to a tool are left out, m; default 2 mm
    // Largest expected displacement of tissue from rest, along each axis of the task, m; default 60 mm.
    double reach;
} OmCloudDef;

/// The arms of `world` (null: none is known), and the anatomy of `site`: the robot's own, of role OM_SITE_TWIN.
OM_API OmCloudDef om_cloud_default_def(const OmWorld* world, const OmSite* site);

/// The field of an observation: arms at the time of the depth picture. It borrows the site.
/// @return OM_OK; OM_INVALID (a definition out of range: the message names the field)
OM_API OmStatus om_cloud_field_init(const OmCloudDef* def, const OmObservation* observation,
                                    OmScanField* field);

typedef struct OmCloud {
    double time;  // s, of the depth picture
    int n;        //
    double* x;    // world frame, m                              (n x 3)
    int* pixel;   // column + width * row of the depth picture   (n)
} OmCloud;

/// Find the points on the tissue in the depth picture of an observation, which has the arms of the same moment.
/// @return OM_OK (n may be 0); OM_INVALID (a definition out of range, or an observation without depth); OM_NO_MEMORY
OM_API OmStatus om_cloud_init(const OmCloudDef* def, const OmObservation* observation,
                              OmCloud* cloud);
OM_API void om_cloud_done(OmCloud* cloud);

/// The scan of the depth picture of an observation (OM_OBSERVE_DEPTH, and OM_OBSERVE_COLOR where the world has it),
/// which has the arms of the same moment.
/// @param def  default om_scan_default_def(om_site_spacing(site))
/// @return OM_OK (npoint may be 0); OM_INVALID (a definition out of range, an observation without depth, a colour
///         picture of another size); OM_NO_MEMORY
OM_API OmStatus om_scan_from_observation(const OmScanDef* def, const OmCloudDef* space,
                                         const OmObservation* observation, OmScan* scan);

/// Measures the visible fraction of the ROI in the endoscope's pictures (thesis 6.5.3): the pixels with a colour of the
/// ROI (om_sense_range) over its pixels in a picture without tissue and tools, times the fraction of its
/// points that such a picture shows. Size, place and surroundings of the ROI are those of `site`, as known before the
/// operation; the camera is the picture's. A ROI that lies up to OM_ROI_MARGIN beside its known place still counts.
typedef struct OmRoiMeter OmRoiMeter;
#define OM_ROI_MARGIN 0.010  // m
/// @param site  borrowed until destroy
/// @return OM_OK; OM_INVALID (no ROI); OM_NO_MEMORY
OM_API OmStatus om_roi_meter_create(const OmSite* site, OmRoiMeter** meter);
OM_API void om_roi_meter_destroy(OmRoiMeter* meter);
/// The part of the picture that the meter reads, for om_world_set_window; before the first look the whole picture.
OM_API OmWindow om_roi_meter_window(const OmRoiMeter* meter);
/// The first look through a camera takes some milliseconds longer.
/// @param visibility  out: 0 to 1
/// @return OM_OK; OM_INVALID (no picture, or a picture of another size than its window); OM_NO_MEMORY; OM_UNAVAILABLE
///         (Embree failed)
OM_API OmStatus om_roi_meter_look(OmRoiMeter* meter, const OmWorldPicture* picture,
                                  double* visibility);
/// The same for one picture.
/// @return OM_OK; OM_INVALID (no picture, or no ROI); OM_NO_MEMORY; OM_UNAVAILABLE (Embree failed)
OM_API OmStatus om_roi_visibility(const OmWorldPicture* picture, const OmSite* site,
                                  double* visibility);

#ifdef __cplusplus
}
#endif
#endif
