/// omentum/world_log.h: a log of all that passes between a controller and a world (floor 4).
///
/// A recorded world stands around another world: it passes every call on and writes call and answer to a file. A
/// replayed world reads this file: the same calls get the same answers, byte for byte, without the first world.
///
///     OmWorld* recorded;
///     om_world_create_recorded(world, "run/observations.log", &recorded);
///     ... a controller commands and observes `recorded` ...
///     om_world_log_end(recorded);
///     om_world_destroy(recorded);
///
///     OmWorld* replayed;
///     om_world_create_replayed("run/observations.log", &replayed);
///     ... the same controller again ...
///
/// Depth is recorded in counts of 0.1 mm; the recorded world hands out these rounded values, so that the controller
/// of the first run and that of the replay see the same numbers.
#ifndef OMENTUM_WORLD_LOG_H
#define OMENTUM_WORLD_LOG_H

#include "omentum/world.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_WORLD_LOG_UNIT 1e-4  // m, a count of depth; beyond 65,535 counts: no return

/// A world that passes every call to `inner` and writes it to a new file. It has the arms, the sources and the
/// kinematics of `inner`, no truth and no snapshots. Every call is flushed to the file: after a kill the log can be
/// read up to there. A call fails with OM_IO where the file cannot be written, and with OM_INVALID where a
/// time, a camera or the visibility that `inner` hands out is not finite; arms may be, a tool is not always measured.
/// @param inner  borrowed until destroy; observe it directly only where this does not change its later answers
/// @return OM_OK; OM_INVALID (calibrated kinematics that are not finite); OM_IO (the file exists, or cannot be
///         written); OM_NO_MEMORY
OM_API OmStatus om_world_create_recorded(OmWorld* inner, const char* path, OmWorld** world);
/// Complete the log and close the file. Afterwards the world can only be destroyed. A log of a world that is destroyed
/// without this call counts as cut off.
/// @return OM_OK, also if the log is complete already; OM_INVALID (not a recorded world); OM_IO
OM_API OmStatus om_world_log_end(OmWorld* world);

/// A world that answers from a log. A call that is not the next call of the log is OM_IO: the message names the tick,
/// the call in the log and the call now; so is the first call beyond the end of a log that was cut off. It has no truth
/// and no snapshots.
/// @return OM_OK; OM_INVALID (not a log, damaged, or cut off before its head ends); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_world_create_replayed(const char* path, OmWorld** world);

typedef struct OmWorldLogInfo {
    int narm;
    unsigned sources;  // OM_OBSERVE_ flags
    int64_t size;      // bytes of the file
    int nadvance;      // ticks
    int nobserve;      // observations
    int npicture;      // depth and colour pictures in them
    double time;       // s that all ticks take together
    bool is_complete;  // false: cut off, by a kill or a full disk
} OmWorldLogInfo;
/// Read a log whole and check every record.
/// @return OM_OK, also if the log is cut off after its head; OM_INVALID (not a log, or damaged: the message names the
///         record); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_world_log_check(const char* path, OmWorldLogInfo* info);

#ifdef __cplusplus
}
#endif
#endif
