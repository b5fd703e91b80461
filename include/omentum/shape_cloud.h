/// omentum/shape_cloud.h: files of point clouds (room `shape`, floor 1).
///
/// Clouds of depth cameras and scanners: points, with normals and triangles if the file has them. PLY, VTK XML .vtp and
/// .csv are read and written; from the surface files of shape_file.h the points and triangles are read.
///
///     OmPointCloud cloud;
///     om_point_cloud_load("view.ply", (OmMeshFrame){OM_UNIT_M, OM_SPACE_RAS}, &cloud, NULL);
///     om_point_cloud_done(&cloud);
#ifndef OMENTUM_SHAPE_CLOUD_H
#define OMENTUM_SHAPE_CLOUD_H

#include "omentum/shape_file.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmPointCloud {  // om_point_cloud_done frees
    int npoint, ntri;          //
    double* x;       // m                                                        (npoint x 3)
    double* normal;  // of length 1, or 0 where the file has none; null: no normals  (npoint x 3)
    int* tri_vert;   // points                                                   (ntri x 3)
    int nduplicate;  // points of the file at the place of an earlier one: merged with it
    int ndropped;    // points of the file that are not finite: left out, with their triangles
} OmPointCloud;

/// Read .ply, .vtp, .csv, or a file that om_surface_load reads. Polygons become fans; triangles with two equal points
/// are left out. A .csv has a line of column names with x, y and z, and nx, ny, nz if there are normals (or the names
/// that ParaView writes, Points:0 and Normals:0); commas, semicolons or tabs separate; an empty field is a point that
/// is not finite. Lines that begin with # are comments and may state unit and space, as "UNIT=mm SPACE=RAS".
/// @param given   zero fields leave it to the file; then millimetres and RAS
/// @param stated  receives what the file says; may be null
/// @return OM_OK; OM_INVALID (no such format, no finite point, a decimal comma; the message names line or field);
///         OM_NO_MEMORY; OM_IO
OM_API OmStatus om_point_cloud_load(const char* path, OmMeshFrame given, OmPointCloud* cloud,
                                    OmMeshFrame* stated);
/// Write .ply (binary), .vtp (compressed) or .csv (without triangles). All state unit and space.
/// @param frame  unit > 0; OM_SPACE_NONE is RAS
/// @return OM_OK; OM_INVALID (an ending that names no format, a unit that is no length); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_point_cloud_save(const OmPointCloud* cloud, const char* path, OmMeshFrame frame);
OM_API void om_point_cloud_done(OmPointCloud* cloud);

#ifdef __cplusplus
}
#endif
#endif
