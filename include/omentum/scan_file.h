/// omentum/scan_file.h: scans from files and into files (floor 3).
///
/// A cloud of a scanner or of another program becomes a scan: it comes into the world frame, normals that the file does
/// not have are estimated, and all normals point to the camera, if its place is known.
///
///     OmScanFileDef def = om_scan_file_default_def();
///     def.frame.unit = OM_UNIT_MM;
///     OmScan scan;
///     om_scan_load("view.ply", &def, &scan, NULL);
///     om_scan_check_model(&scan, &model, 0.05, NULL);     // another unit? another place?
///     ... om_scan_done(&scan);
#ifndef OMENTUM_SCAN_FILE_H
#define OMENTUM_SCAN_FILE_H

#include "omentum/scan.h"
#include "omentum/shape_cloud.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmScanFileDef {
    OmCookie cookie;         // set by om_scan_file_default_def
    OmMeshFrame frame;       // unit and space of the file; default: the file, else mm and RAS
    OmPose pose_world_file;  // maps the file's coordinates, in m, to the world; default identity
    bool has_eye;            // default false
    OmVec3 eye;              // place of the camera, world frame, m
    OmVec3 up;               // without a camera most normals of a piece point up; default +z
    double spacing;  // m, mean distance of neighbouring points that are kept; 0 (default): all are
    double noise;    // m, of a point of the file, for OmScan.noise; default 0: not known
} OmScanFileDef;
OM_API OmScanFileDef om_scan_file_default_def(void);

typedef struct OmScanFileReport {
    int npoint;      // points of the file
    int nduplicate;  // merged with an equal point
    int ndropped;    // left out: not finite
    int nestimated;  // normals that were estimated
    int nthinned;    // left out by OmScanFileDef.spacing
} OmScanFileReport;

/// Read a scan by om_point_cloud_load. Normals that the file does not give are those of its triangles, or of planes
/// through 16 neighbouring points. With a camera all normals point to it and triangles are counter-clockwise seen from
/// it; otherwise estimated normals agree with their neighbours, and those of a piece point up in the mean. A cloud
/// without triangles has none in the scan.
/// @param report  may be null
/// @return OM_OK; OM_INVALID (a definition out of range, or errors of om_point_cloud_load); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_scan_load(const char* path, const OmScanFileDef* def, OmScan* scan,
                             OmScanFileReport* report);
/// Write points, normals and triangles as .ply, .vtp or .csv (without triangles); unit and space are stated.
/// @param frame  unit > 0; OM_SPACE_NONE is RAS
/// @return OM_OK; OM_INVALID (an ending that names no format, a unit that is no length); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_scan_save(const OmScan* scan, const char* path, OmMeshFrame frame);

typedef struct OmScanFit {  // sizes of a scan and a model
    double ratio;           // diagonal of the scan's box over that of the model's
    double gap;             // m, between their boxes; 0: they overlap
} OmScanFit;

/// Check that a scan can show a model: enough points, a similar size, a place within reach.
/// @param reach  largest gap between their boxes, m; INFINITY: the place is not checked, as before registration
/// @param fit    may be null
/// @return OM_OK; OM_INVALID (fewer than 20 points, a model without surface, another unit, another size, or far away:
///         the message has the remedy)
OM_API OmStatus om_scan_check_model(const OmScan* scan, const OmSurface* model, double reach,
                                    OmScanFit* fit);

#ifdef __cplusplus
}
#endif
#endif
