/// omentum/belief.h: what the robot believes of the tissue during an operation, and what changed it (floor 7; thesis
/// 6.4.5, 6.4.6).
///
/// The monitor (belief_monitor.h) compares the twin with the depth camera; a warning leads to an acquisition and an
/// estimate of the attachments (belief_update.h); the twin takes an accepted one over. Here is the record of it.
#ifndef OMENTUM_BELIEF_H
#define OMENTUM_BELIEF_H

#include "omentum/belief_monitor.h"
#include "omentum/belief_update.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_LOOP_MAX_FAILED 3  // estimates in a row that end in an error

typedef struct OmRetractUpdate {  // one estimate of the twin's attachments
    // adopted, refused or cancelled; started while it runs
    OmUpdateStage stage;
    char reason[256];          // of a refusal
    int nacquisition;          // that it was made from
    int start_tick, end_tick;  // end_tick: of adoption or refusal, -1: none, also if cancelled
    double start, end;         // s of the operation
    int nattached_before, nattached_after;  // vertices of the twin
    double seen_share;                      // OmMatchEstimate.seen_share
    double before_median, after_median;     // m, of the scan from the twin
    double estimate_ms;                     // wall time; NAN if cancelled
    // m, mu when the estimate was started, and when the twin had adopted it, or it was refused; NAN: not measured
    double mu_before, mu_after;
    // m, the same of OmMonitorFrame.part, less its value before the grasp
    double part_before, part_after;
} OmRetractUpdate;

typedef struct OmBeliefRecord {  // of one operation
    // Factor on the twin's forces, learnt where the arms measure force; 1: nothing was learnt.
    double force_factor;
    int nmonitor;      // frames compared with the twin
    int nwarning[3];   // times that the warning state rose to 1, 2, 3
    double mu_max;     // m, while tissue was held; 0 without a monitor
    int nacquisition;  // taken during the operation
    int nupdate;       // estimates
    OmRetractUpdate* update;
} OmBeliefRecord;

#ifdef __cplusplus
}
#endif
#endif
