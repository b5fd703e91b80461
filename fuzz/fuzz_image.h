// fuzz_image.h: a reader of volumes, from memory.
#ifndef OMENTUM_FUZZ_IMAGE_H
#define OMENTUM_FUZZ_IMAGE_H

#include "fuzz_common.h"
#include "image/image_internal.h"

static inline int fuzz_volume(OmStatus (*parse)(OmSource* src, const OmVolumeTask* task),
                              const uint8_t* data, size_t size) {
    OmVolume volume = {0};
    OmVolumeInfo info = {0};
    const OmVolumeTask task = {NULL, 0, OM_VOLUME_MAX_SIZE, &volume, &info};
    OmSource src;
    om__source_open_memory(&src, data, size);
    OmStatus status = parse(&src, &task);
    om__source_done(&src);
    FUZZ_EXPECT(status <= 0);
    for (int s = 0; s < info.nsegment && status == OM_OK; ++s) {
        FUZZ_EXPECT(info.segment[s].layer >= 0 && info.segment[s].layer < info.nentry);
        FUZZ_EXPECT(info.segment[s].value >= 0 && strlen(info.segment[s].name) < OM_SEGMENT_NAME);
    }
    om_volume_info_done(&info);
    if (status != OM_OK) {
        FUZZ_EXPECT(volume.voxel == NULL && om_error_message()[0] != '\0');
        return 0;
    }
    // An accepted volume has voxels, all finite, and axes that span space.
    size_t count = om_volume_count(&volume);
    FUZZ_EXPECT(count > 0);
    for (size_t i = 0; i < count; ++i) FUZZ_EXPECT(isfinite(om_volume_value(&volume, i)));
    FUZZ_EXPECT(isfinite(om_mat3_det(volume.grid.axis)) && om_mat3_det(volume.grid.axis) != 0);
    FUZZ_EXPECT(isfinite(volume.grid.origin.x + volume.grid.origin.y + volume.grid.origin.z));
    om_volume_done(&volume);
    return 0;
}

#endif
