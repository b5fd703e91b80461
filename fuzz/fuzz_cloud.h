// fuzz_cloud.h: what must hold of every point cloud that a reader accepts.
#ifndef OMENTUM_FUZZ_CLOUD_H
#define OMENTUM_FUZZ_CLOUD_H

#include "fuzz_common.h"
#include "omentum/shape_cloud.h"

/// What was read is written and read again: the same points and normals, and, but for tables, the same triangles.
static inline void fuzz_save_cloud(const OmPointCloud* cloud, const char* suffix) {
    const char* path = fuzz_file((const uint8_t*)"", 0, suffix);
    OmPointCloud back;
    FUZZ_EXPECT(om_point_cloud_save(cloud, path, (OmMeshFrame){OM_UNIT_M, OM_SPACE_RAS}) == OM_OK);
    FUZZ_EXPECT(om_point_cloud_load(path, (OmMeshFrame){0}, &back, NULL) == OM_OK);
    fuzz_file_done(path);
    size_t n = 3 * (size_t)cloud->npoint;
    FUZZ_EXPECT(back.npoint == cloud->npoint && back.nduplicate == 0 && back.ndropped == 0);
    FUZZ_EXPECT(memcmp(back.x, cloud->x, n * sizeof(double)) == 0);
    FUZZ_EXPECT((back.normal != NULL) == (cloud->normal != NULL));
    bool has_tri = strcmp(suffix, ".csv") != 0;
    FUZZ_EXPECT(back.ntri == (has_tri ? cloud->ntri : 0));
    FUZZ_EXPECT(memcmp(back.tri_vert, cloud->tri_vert, 3 * (size_t)back.ntri * sizeof(int)) == 0);
    om_point_cloud_done(&back);
}

static inline void fuzz_cloud(const uint8_t* data, size_t size, const char* suffix) {
    const char* path = fuzz_file(data, size, suffix);
    OmPointCloud cloud;
    OmStatus status = om_point_cloud_load(path, (OmMeshFrame){0}, &cloud, NULL);
    fuzz_file_done(path);
    FUZZ_EXPECT(status <= 0);
    if (status != OM_OK) {
        FUZZ_EXPECT(cloud.x == NULL && om_error_message()[0] != '\0');
        return;
    }
    FUZZ_EXPECT(cloud.npoint >= 1 && cloud.ntri >= 0);
    for (int i = 0; i < cloud.npoint; ++i) {
        FUZZ_EXPECT(om_is_finite3(om_load3(cloud.x, i)));
        double length = cloud.normal ? om_norm(om_load3(cloud.normal, i)) : 0;
        FUZZ_EXPECT(length == 0 || (length > 1 - 1e-12 && length < 1 + 1e-12));
    }
    for (int i = 0; i < 3 * cloud.ntri; ++i)
        FUZZ_EXPECT(cloud.tri_vert[i] >= 0 && cloud.tri_vert[i] < cloud.npoint);
    fuzz_save_cloud(&cloud, suffix);
    om_point_cloud_done(&cloud);
}

#endif
