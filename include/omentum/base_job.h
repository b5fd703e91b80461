/// omentum/base_job.h: one computation in the background (floor 0).
///
/// A job runs a function in a thread of its own while the caller continues, for example an estimate that takes longer
/// than a tick of the loop. The job reports progress and can be cancelled; its status and error message arrive at the
/// thread that joins it. A job must not share mutable data with the caller until it is joined.
///
///     OmJob* job;
///     om_job_start(estimate, &input, &job);
///     while (!om_job_is_finished(job)) ...                  // one tick of other work
///     OmStatus status = om_job_join(job);                   // frees the job
///     if (status < 0) puts(om_error_message());
#ifndef OMENTUM_BASE_JOB_H
#define OMENTUM_BASE_JOB_H

#include "omentum/base.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmJob OmJob;

/// The work of a job. It returns soon after om_progress_report has returned OM_CANCELLED.
typedef OmStatus (*OmJobFn)(void* ctx, const OmProgress* progress);

/// Start a thread that calls fn(ctx, progress).
/// @param ctx  borrowed until the job is joined
/// @return OM_OK; OM_NO_MEMORY; OM_UNAVAILABLE (the system refuses another thread)
OM_API OmStatus om_job_start(OmJobFn fn, void* ctx, OmJob** job);
/// True if the function has returned; om_job_join then does not wait.
OM_API bool om_job_is_finished(const OmJob* job);
/// Progress of the job's present stage, 0 to 1; 0 before the first report.
OM_API double om_job_progress(const OmJob* job);
/// Ask the job to stop: its next om_progress_report returns OM_CANCELLED. Returns at once.
OM_API void om_job_cancel(OmJob* job);
/// Wait for the job, free it, and set this thread's error message to that of the job.
/// @return what the function returned; OM_OK for a null job
OM_API OmStatus om_job_join(OmJob* job);

#ifdef __cplusplus
}
#endif
#endif
