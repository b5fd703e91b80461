// fuzz_dds_motion.c: the reader of the motion of an arm in a recording.
#include <math.h>

#include "fuzz_common.h"
#include "omentum/dds.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    OmDdsMotion m;
    const OmStatus status = om_dds_motion_parse((const char*)data, size, "fuzz.mcap", "PSM2", &m);
    if (status != OM_OK) {
        FUZZ_EXPECT(status < 0 && om_error_message()[0] != '\0' && m.n == 0 && !m.tip);
        return 0;
    }
    FUZZ_EXPECT(m.n > 0);
    for (int i = 0; i < m.n; ++i) {
        const OmQuat q = m.tip[i].q;
        FUZZ_EXPECT(om_is_finite3(m.tip[i].p) && isfinite(m.jaw[i]));
        FUZZ_EXPECT(fabs(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z - 1) < 0.01);
        FUZZ_EXPECT(i == 0 || m.time[i] > m.time[i - 1]);
    }
    om_dds_motion_done(&m);
    return 0;
}
