// fuzz_rl_trace.c: tables of a recorded robot's tip, and the moves that follow them.
//
// The reader must refuse the table, or return rows that a path can be made of. A point without tissue follows the path:
// its deviation must stay below the half diagonal of a cube of two moves.
#include "../test/rl/point_task.h"
#include "fuzz_common.h"
#include "omentum/rl_trace.h"

static void check(const OmRlTrace* t) {
    FUZZ_EXPECT(t->n >= 2);
    for (int i = 0; i < t->n; ++i) {
        FUZZ_EXPECT(isfinite(t->time[i]) && isfinite(t->jaw[i]));
        FUZZ_EXPECT(i == 0 || (t->time[i] > t->time[i - 1] && t->line[i] > t->line[i - 1]));
        for (int k = 0; k < 3; ++k) FUZZ_EXPECT(fabs(t->tip[3 * i + k]) <= 10);
    }
}

static void follow(const OmRlTrace* t, bool has_jaw) {
    PointTask task = point_task(0.001, 2000, has_jaw);
    OmRlDrive* drive;
    OmRlFollow f;
    OmRlDemos demos = {0};
    FUZZ_EXPECT(om_rl_drive_create(&task.head, 1, &drive) == OM_OK);
    OmStatus status = om_rl_trace_follow(t, 0.01, drive, &f);
    FUZZ_EXPECT(status == OM_OK || status == OM_INVALID);
    if (status == OM_OK) {
        FUZZ_EXPECT(f.nstep >= 20 && f.nstep <= 2000 && f.deviation <= 0.001733);
        FUZZ_EXPECT(om_rl_drive_keep(drive, &demos) == OM_OK);
        om_rl_demos_done(&demos);
    } else {
        FUZZ_EXPECT(om_error_message()[0] != '\0');
    }
    om_rl_drive_destroy(drive);
}

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    OmRlTrace t;
    OmStatus status = om_rl_trace_parse((const char*)data, size, "fuzz.csv", &t);
    FUZZ_EXPECT(status == OM_OK || status == OM_INVALID);
    if (status == OM_OK) {
        check(&t);
        follow(&t, false);
        follow(&t, true);
    } else {
        FUZZ_EXPECT(t.tip == NULL && om_error_message()[0] != '\0');
    }
    om_rl_trace_done(&t);
    return 0;
}
