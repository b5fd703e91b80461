// fuzz_dds_frames.c: the reader of files of frames.
#include <math.h>

#include "fuzz_common.h"
#include "omentum/dds.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    OmDdsFrame frame[OM_DDS_MAX_FRAME];
    int n = -1;
    const OmStatus status = om_dds_frames_parse((const char*)data, size, "fuzz.json", frame, &n);
    if (status != OM_OK) {
        FUZZ_EXPECT(status < 0 && om_error_message()[0] != '\0' && n == 0);
        return 0;
    }
    FUZZ_EXPECT(n >= 0 && n <= OM_DDS_MAX_FRAME);
    for (int i = 0; i < n; ++i) {
        const OmPose* pose = &frame[i].pose_world_frame;
        const OmQuat q = pose->q;
        FUZZ_EXPECT(frame[i].name[0] && om_is_finite3(pose->p));
        FUZZ_EXPECT(fabs(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z - 1) < 1e-9);
    }
    return 0;
}
