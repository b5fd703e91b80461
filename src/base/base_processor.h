// base_processor.h: number of processors that this process may use, and number of free ones.
#ifndef OMENTUM_BASE_PROCESSOR_H
#define OMENTUM_BASE_PROCESSOR_H

#include "omentum/base.h"

/// Processors of the affinity mask and of the quota of control groups, at least 1. Read once per process, so
/// that arrays with a place for each worker stay large enough.
int om__processor_limit(void);

/// Processors of the limit that no other thread is using, at least 1. `own` threads of the caller are running.
/// Reads the load at most every 20 ms; a load counts when two readings in a row show it.
int om__processor_free(int own);

/// As om__processor_free, for a decision that lasts: reads the load three times within some
/// milliseconds.
int om__processor_free_now(int own);

/// Processors of the quota in a tree of control groups (/sys/fs/cgroup) for the groups that `self`
/// (/proc/self/cgroup) names, versions 1 and 2; rounded up. INT_MAX: there is no quota.
int om__processor_quota(const char* root, const char* self);

/// Number of running threads of the machine from the text of /proc/loadavg; 0 if the text is
/// malformed.
int om__processor_running(const char* text);

#endif
