// dds_cloud.c: a depth picture as the points of a PointCloud2: x, y, z and rgb, 16 bytes each.
#include "dds/dds_cloud.h"

#include <math.h>
#include <string.h>

enum { POINT = 16 };  // bytes: x, y, z, rgb

OmStatus om__cloud_init(const OmCamera* camera, Cloud* cloud) {
    const OmCamera* c = camera;
    const OmQuat back = om_quat_conj(c->pose_world_camera.q);
    const size_t n = (size_t)c->width * (size_t)c->height;
    OM_ALLOC(cloud->slope, 2 * n);
    OM_ALLOC(cloud->bytes, POINT * n);
    for (int row = 0, i = 0; row < c->height; ++row)
        for (int column = 0; column < c->width; ++column, ++i) {
            const OmVec3 ray = om_quat_rotate(back, om_camera_ray(c, column + 0.5, row + 0.5));
            cloud->slope[2 * i] = (float)(ray.z > 0 ? ray.x / ray.z : 0);
            cloud->slope[2 * i + 1] = (float)(ray.z > 0 ? ray.y / ray.z : 0);
        }
    return OM_OK;
}

void om__cloud_done(Cloud* cloud) {
    om_free(cloud->slope);
    om_free(cloud->bytes);
}

static uint32_t color_of(const OmPicture* color, int i) {
    const unsigned char* c = color->pixel + (size_t)color->nchannel * (size_t)i;
    return color->nchannel == 3 ? (uint32_t)c[0] << 16 | (uint32_t)c[1] << 8 | c[2]
                                : 0x10101u * c[0];
}

LinkPicture om__cloud_pack(Cloud* cloud, const OmDepthPicture* picture) {
    const OmDepthPicture* p = picture;
    const int n = p->camera.width * p->camera.height;
    for (int i = 0; i < n; ++i) {
        const float z = p->depth[i] > 0 && isfinite(p->depth[i]) ? p->depth[i] : NAN;
        const float xyz[3] = {z * cloud->slope[2 * i], z * cloud->slope[2 * i + 1], z};
        const uint32_t rgb = p->color.pixel ? color_of(&p->color, i) : 0;
        memcpy(cloud->bytes + POINT * (size_t)i, xyz, sizeof xyz);
        memcpy(cloud->bytes + POINT * (size_t)i + 12, &rgb, sizeof rgb);
    }
    return (LinkPicture){.width = p->camera.width,
                         .height = p->camera.height,
                         .point_step = POINT,
                         .step = POINT * p->camera.width,
                         .x = 0,
                         .y = 4,
                         .z = 8,
                         .rgb = p->color.pixel ? 12 : -1,
                         .data = cloud->bytes,
                         .size = POINT * (size_t)n};
}
