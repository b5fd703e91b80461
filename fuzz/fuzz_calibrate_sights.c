// fuzz_calibrate_sights.c: the reader of observations.
#include <math.h>

#include "calibrate/calibrate_problem_internal.h"
#include "fuzz_common.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    enum { NPATH = 2 };
    static const PathItem path[NPATH] = {{.name = "press"}, {.name = "lift"}};
    static Sights s;
    OmStatus status =
        om__calibrate_parse_sights((const char*)data, size, "fuzz.csv", NPATH, path, &s);
    if (status != OM_OK) {
        FUZZ_EXPECT(status < 0 && om_error_message()[0] != '\0' && !s.seen);
        return 0;
    }
    // What was accepted keeps its promises.
    FUZZ_EXPECT(s.nlandmark >= 0 && s.nlandmark <= OM_CALIBRATION_MAX_LANDMARK && s.nseen > 0);
    for (int p = 0; p < NPATH; ++p) {
        FUZZ_EXPECT(s.nlevel[p] >= 1 && s.nlevel[p] <= OM_CALIBRATION_MAX_LEVEL);
        for (int l = 0; l < s.nlevel[p]; ++l)
            FUZZ_EXPECT(s.level[p][l] >= 0 && (!l || s.level[p][l] > s.level[p][l - 1]));
    }
    for (int i = 0; i < s.nseen; ++i) {
        const OmCalibrationSeen* o = &s.seen[i];
        FUZZ_EXPECT(o->path >= 0 && o->path < NPATH && o->level >= 0);
        FUZZ_EXPECT(o->level < s.nlevel[o->path] && o->landmark < s.nlandmark);
        FUZZ_EXPECT(o->landmark >= OM_SEEN_FORCE && om_is_finite3(o->x));
    }
    om_free(s.seen);
    return 0;
}
