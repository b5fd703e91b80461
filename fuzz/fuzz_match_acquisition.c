// fuzz_match_acquisition.c: the reader of acquisition files.
#include <math.h>

#include "fuzz_common.h"
#include "omentum/match_acquisition.h"

static void expect_pose(OmPose pose) {
    double w2 =
        pose.q.x * pose.q.x + pose.q.y * pose.q.y + pose.q.z * pose.q.z + pose.q.w * pose.q.w;
    FUZZ_EXPECT(om_is_finite3(pose.p) && fabs(w2 - 1) < 1e-9);
}

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static OmAcquisitionFile file;
    OmStatus status = om_acquisition_parse((const char*)data, size, "fuzz.yaml", &file);
    if (status != OM_OK) {
        FUZZ_EXPECT(status < 0 && om_error_message()[0] != '\0');
        return 0;
    }
    // What was accepted keeps its promises.
    FUZZ_EXPECT((file.cloud[0] != '\0') != (file.series[0] != '\0'));
    FUZZ_EXPECT(memchr(file.cloud, 0, sizeof file.cloud) && file.frame_index >= 0);
    FUZZ_EXPECT(file.ngrasp >= 0 && file.ngrasp <= OM_MAX_ARM);
    FUZZ_EXPECT(file.noise >= 0 && isfinite(file.noise) && isfinite(file.time));
    FUZZ_EXPECT(file.frame.unit >= 0 && file.frame.unit <= 1);
    for (int i = 0; i < file.ngrasp; ++i) {
        FUZZ_EXPECT(file.grasp[i].arm >= 0 && file.grasp[i].arm < OM_MAX_ARM);
        FUZZ_EXPECT(file.grasp[i].radius >= 0 && !file.grasp[i].vert);
        expect_pose(file.grasp[i].pose_world_grasp);
        expect_pose(file.grasp[i].pose_world_now);
    }
    if (!file.has_camera) return 0;
    FUZZ_EXPECT(om_camera_check(&file.camera) == OM_OK);
    expect_pose(file.camera.pose_world_camera);
    return 0;
}
