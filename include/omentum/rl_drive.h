/// omentum/rl_drive.h: one environment that is driven step by step, and its demonstrations (floor 7).
///
/// A drive keeps every step of the episode in progress. A finished episode may be appended to demonstrations.
///
///     OmRlDrive* drive; OmRlDemos demos = {0};
///     om_rl_drive_create(task, 1, &drive);
///     om_rl_drive_reset(drive, -1);
///     while (!om_rl_drive_now(drive)->is_over) om_rl_drive_step(drive, action);
///     om_rl_drive_keep(drive, &demos);
///     om_rl_demos_save(&demos, "demos.hdf5");
#ifndef OMENTUM_RL_DRIVE_H
#define OMENTUM_RL_DRIVE_H

#include "omentum/rl_demo.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmRlDrive OmRlDrive;

typedef struct OmRlDriveNow {  // of the episode in progress
    int episode;               // counts from 0
    int nstep;                 //
    double sum;                // of the rewards
    bool is_over;              // the task ended it, or the limit of steps
    bool is_terminated;        // the task ended it
} OmRlDriveNow;

/// @param task  borrowed until the drive is destroyed
/// @return OM_OK; OM_NO_MEMORY; an error of the task
OM_API OmStatus om_rl_drive_create(const OmRlTask* task, uint64_t seed, OmRlDrive** drive);
OM_API void om_rl_drive_destroy(OmRlDrive* drive);
/// Begin the next episode; the one in progress is dropped. Episode k is a function of the seed, k and the actions.
/// @param start  0 to nstart - 1, a start of the evaluation; -1: drawn
/// @return OM_OK; OM_INVALID (no such start); an error of the task
OM_API OmStatus om_rl_drive_reset(OmRlDrive* drive, int start);
/// @param action  (naction)
/// @return OM_OK; OM_INVALID (no reset, the episode is over, an action out of range: nothing was changed);
///         OM_NO_MEMORY; an error of the task
OM_API OmStatus om_rl_drive_step(OmRlDrive* drive, const int* action);
OM_API const OmRlDriveNow* om_rl_drive_now(const OmRlDrive* drive);
/// The infos now (ninfo); none if the task has none. `score` (may be null): the task's score, or the sum of rewards.
/// @return OM_OK; an error of the task
OM_API OmStatus om_rl_drive_info(OmRlDrive* drive, double* value, double* score);
/// Draw into an empty picture, of its width and height if both are set.
/// @return OM_OK; OM_UNAVAILABLE (the task has no picture); an error of the task
OM_API OmStatus om_rl_drive_render(OmRlDrive* drive, OmPicture* picture);
/// Append the steps of the episode so far to demonstrations of the same task; zero: none yet.
/// @return OM_OK; OM_INVALID (no step, or demonstrations of another task), OM_NO_MEMORY: nothing was changed
OM_API OmStatus om_rl_drive_keep(OmRlDrive* drive, OmRlDemos* demos);

#ifdef __cplusplus
}
#endif
#endif
