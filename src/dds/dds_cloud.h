// dds_cloud.h: a depth picture as the points of a PointCloud2, in rows.
#ifndef OMENTUM_DDS_CLOUD_H
#define OMENTUM_DDS_CLOUD_H

#include "dds/dds_link.h"

typedef struct Cloud {
    float* slope;          // of the rays: x / z and y / z  (npixel x 2)
    unsigned char* bytes;  // of the last picture           (npixel x 16)
} Cloud;

OmStatus om__cloud_init(const OmCamera* camera, Cloud* cloud);
void om__cloud_done(Cloud* cloud);
// A point for each pixel, NaN where there is no depth; z is the depth to the last bit. The bytes belong to `cloud`.
LinkPicture om__cloud_pack(Cloud* cloud, const OmDepthPicture* picture);

#endif
