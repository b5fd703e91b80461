// fuzz_robot_instrument.c: the reader of instruments of the dVRK.
#include <math.h>

#include "fuzz_common.h"
#include "omentum/robot.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const OmPsm before = om_psm_default(OM_PROGRASP, om_pose_identity());
    OmPsm psm = before;
    OmStatus status = om_psm_parse_instrument((const char*)data, size, "fuzz.json", &psm);
    if (status != OM_OK) {
        FUZZ_EXPECT(status < 0 && om_error_message()[0] != '\0');
        FUZZ_EXPECT(memcmp(&psm, &before, sizeof psm) == 0);
        return 0;
    }
    FUZZ_EXPECT(psm.wrist >= 0 && isfinite(psm.wrist) && psm.njoint >= 4 && psm.njoint <= 6);
    FUZZ_EXPECT(psm.has_jaw ? psm.jaw_min < psm.jaw_max : psm.jaw_max == 0);
    for (int k = 0; k < psm.njoint; ++k)
        FUZZ_EXPECT(isfinite(psm.q_min[k]) && psm.q_min[k] < psm.q_max[k]);
    return 0;
}
