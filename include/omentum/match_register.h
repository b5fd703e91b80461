/// omentum/match_register.h: the pose of a scan on a model, without deformation (room `match`, floor 5).
///
/// The scan sees a part of the surface, from one side; the model is the whole surface. Starts around a known pose, or
/// from principal axes, are refined by trimmed point-to-plane ICP. A triangle of the model that the scan's camera could
/// not see is no partner of a point. The result says how well the shape determines the pose.
///
///     OmRegisterDef def = om_register_default_def();
///     def.has_start = true, def.pose_model_scan = guess;
///     OmRegistration r;
///     om_scan_register(&def, &model, &scan, &r);
///     if (r.is_reliable) p_model = om_pose_apply(r.pose_model_scan, p_scan);
///     else puts(r.reason);
#ifndef OMENTUM_MATCH_REGISTER_H
#define OMENTUM_MATCH_REGISTER_H

#include "omentum/scan.h"
#include "omentum/shape.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_REGISTER_MIN_POINT 30  // a scan of fewer points is refused

typedef struct OmRegisterDef {
    OmCookie cookie;  // set by om_register_default_def
    bool has_start;   // pose_model_scan is known roughly; default false: principal axes
    // maps points of the scan (world) to the frame of the model; default identity
    OmPose pose_model_scan;
    // The start may be off by this much: a turn about the scan's centre, rad, default 30 degrees, and a shift, m,
    // default 30 mm. Both 0: no other starts are tried.
    double start_angle, start_shift;
    int npoint;          // points of the scan that are used, 100 to 100000; default 2000
    double min_overlap;  // smallest share of the scan that lies on the model, 0.2 to 1; default 0.6
    double max_residual;  // m, of the median residual; default 2 mm
    // Largest standard deviations of a reliable pose, rad and m; defaults 0.2 degrees and 0.2 mm.
    double max_sigma_angle, max_sigma_shift;
    int nworker;  // default 0: one a processor; the result does not depend on it
} OmRegisterDef;

OM_API OmRegisterDef om_register_default_def(void);

typedef struct OmRegistration {
    OmPose pose_model_scan;  // maps points of the scan (world) to the frame of the model
    double residual;         // median distance of the kept points to the model's tangent planes, m
    double overlap;          // share of the points that were kept, 0 to 1
    // Standard deviation in the least known direction: a turn about the scan's centre, rad, a shift of this centre, m
    double sigma_angle, sigma_shift;
    OmVec3 axis_angle, axis_shift;  // this direction in the frame of the model, unit
    OmVec3 center;                  // of the scan's points, world, m
    bool is_reliable;        // false: `reason` says why not, pose_model_scan is the best found
    char reason[256];        // "" if reliable
    int nstart, niteration;  // starts tried; iterations of all of them
    double ms;               // wall clock
} OmRegistration;

/// Register a scan to a model. The result is unreliable if too few points lie on the model, if the residual is large,
/// if another pose fits as well, or if the shape leaves a direction open.
/// @param model  closed or open; triangles counter-clockwise seen from outside
/// @param scan   om_scan_check holds; with a camera, only triangles that it could see are partners
/// @return OM_OK, also if the result is not reliable; OM_INVALID (a field of def, too few points, a model without
///         surface: the message says which); OM_NO_MEMORY; OM_UNAVAILABLE (Embree failed)
OM_API OmStatus om_scan_register(const OmRegisterDef* def, const OmSurface* model,
                                 const OmScan* scan, OmRegistration* out);

#ifdef __cplusplus
}
#endif
#endif
