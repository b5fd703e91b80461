// belief_updater.h: the updater, shared by its object (belief_update.c) and the loop (belief_look.c).
#ifndef OMENTUM_BELIEF_UPDATER_H
#define OMENTUM_BELIEF_UPDATER_H

#include "omentum/base_job.h"
#include "omentum/belief_update.h"
#include "omentum/body.h"

// An acquisition with its arrays. The kept ones and those of the running job share it; only the loop's thread counts.
typedef struct Taken {
    OmAcquisition data;
    double* x_twin;           // of data
    unsigned char* attached;  // of data
    int* vert[OM_MAX_ARM];    // of data.grasp
    int number[OM_MAX_ARM];   // of the grasp of each arm, counted from 1; 0: none
    bool is_folded;           // of tissue that was folded since it was grasped
    int nref;
} Taken;

typedef struct HeldGrasp {  // what an arm holds since its last grasp
    int number;             // counts from 1; 0: nothing
    OmPose pose_world_tip;
    double radius;  // m
    int nvert;
    int* vert;  // of the twin's nodes, see om_body_get_nodes  (nnode)
} HeldGrasp;

struct OmUpdater {
    OmUpdateDef def;
    int* replay_tick;  // (def.nreplay)
    int nvert;         // of the twin's site
    int nnode;         // of the twin, see om_body_get_nodes; 0 before the first grasp

    // of the present loop
    OmScan rest;  // of the first picture, before any arm grasped; no pixels: none
    HeldGrasp grasp[OM_MAX_ARM];
    int ngrasp, ntaken, nestimate;
    Taken* kept[OM_UPDATE_MAX_KEEP];  // oldest first
    int nkept;
    bool is_due;  // an acquisition arrived after the last estimate was started

    // the running job
    OmJob* job;
    Taken* given[OM_UPDATE_MAX_KEEP];
    OmAcquisition acquisition[OM_UPDATE_MAX_KEEP];  // data of `given`
    int ngiven;
    int start_tick;
    double start;  // s of the operation
    double wall;   // s that the estimate took, written by the job
    OmMatchEstimate estimate;
};

/// Forget the last loop. A job that still runs is cancelled.
void om__updater_reset(OmUpdater* updater);
/// An arm has grasped: the twin's vertices that it holds.
void om__updater_grasp(OmUpdater* updater, int arm, OmPose pose_world_tip, double radius,
                       const OmBody* twin);
void om__updater_release(OmUpdater* updater, int arm);
/// Take over a scan of the first picture, if no arm has grasped yet and there is none.
void om__updater_take_rest(OmUpdater* updater, OmScan* scan);
/// Take an acquisition from an observation with depth; `tip`: pose of each tool in the twin, world frame. The newest
/// of the same grasps is replaced, or the oldest of too many. `is_wanted`: an estimate is due then.
/// @return OM_OK; errors of om_scan_from_observation; OM_NO_MEMORY
OmStatus om__updater_take(OmUpdater* updater, const OmObservation* observation, double time,
                          const OmPose tip[OM_MAX_ARM], const OmBody* twin,
                          const unsigned char* attached, bool is_folded, bool is_wanted);
/// Start the job with the kept acquisitions. @return OM_OK; OM_NO_MEMORY; OM_UNAVAILABLE
OmStatus om__updater_start(OmUpdater* updater, int tick, double time);
/// True if the job's result is to be taken in this tick. The loop then joins the job, and may wait.
bool om__updater_is_ripe(const OmUpdater* updater, int tick, double time_step);
/// Wait for the job. Its estimate is valid until om__updater_drop.
OmStatus om__updater_join(OmUpdater* updater);
void om__updater_drop(OmUpdater* updater);
/// Take the estimate's shapes of the twin as first guesses for the next one.
void om__updater_refresh(OmUpdater* updater);
/// Cancel the job and wait until it has returned.
void om__updater_cancel(OmUpdater* updater);

#endif
