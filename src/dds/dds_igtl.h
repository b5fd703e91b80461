// dds_igtl.h: messages of OpenIGTLink, version 1, as 3D Slicer reads them: big endian, mm.
#ifndef OMENTUM_DDS_IGTL_H
#define OMENTUM_DDS_IGTL_H

#include "omentum/shape.h"
#include "omentum/vec.h"

// Append a message to `out`. @return OM_OK; OM_NO_MEMORY
OmStatus om__igtl_transform(const char* name, double time, OmPose pose, OmText* out);
// Triangles; vertex i of the surface is vert[i] of x (m).
OmStatus om__igtl_surface(const char* name, double time, const OmSurface* surface, const double* x,
                          const int* vert, OmText* out);
// CRC-64 of ECMA-182, from 0, as the protocol wants it of a body.
uint64_t om__igtl_crc(const char* data, size_t size);

#endif
