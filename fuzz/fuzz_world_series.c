// fuzz_world_series.c: the reader of recorded series.
#include <math.h>

#include "fuzz_common.h"
#include "omentum/world_series.h"

static void expect_pose(OmPose p) {
    double norm = p.q.w * p.q.w + p.q.x * p.q.x + p.q.y * p.q.y + p.q.z * p.q.z;
    FUZZ_EXPECT(om_is_finite3(p.p) && fabs(norm - 1) < 1e-6);
}

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static OmSeries s;
    OmStatus status = om_series_parse((const char*)data, size, "fuzz.yaml", ".", &s);
    if (status != OM_OK) {
        FUZZ_EXPECT(status < 0 && om_error_message()[0] != '\0' && !s.frame);
        return 0;
    }
    // What was accepted keeps its promises.
    FUZZ_EXPECT(om_camera_check(&s.camera) == OM_OK && s.depth_unit > 0);
    if (s.has_right) FUZZ_EXPECT(om_camera_check(&s.right) == OM_OK);
    if (s.has_right) expect_pose(s.right.pose_world_camera);
    FUZZ_EXPECT(s.nframe >= 0 && s.nframe <= OM_SERIES_MAX);
    for (int i = 0; i < s.nframe; ++i) {
        const OmSeriesFrame* f = &s.frame[i];
        FUZZ_EXPECT(isfinite(f->time) && (i == 0 || f->time > f[-1].time));
        FUZZ_EXPECT(f->narm >= 0 && f->narm <= OM_MAX_ARM);
        FUZZ_EXPECT(f->color[0] || f->depth[0]);
        FUZZ_EXPECT(!f->right[0] || s.has_right);
        expect_pose(f->pose_world_camera);
        for (int a = 0; a < f->narm; ++a) expect_pose(f->arm[a].tip);
    }
    om_series_done(&s);
    return 0;
}
