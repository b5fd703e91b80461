// base_job.c: a job is one POSIX thread.
//
// Three atomic variables connect the job with its owner: the request to cancel, the progress, and the end. The error
// message is per thread, so the job copies it at its end for the thread that joins.
#include "omentum/base_job.h"

#include <pthread.h>
#include <stdatomic.h>
#include <string.h>

#define MESSAGE_SIZE 1024

struct OmJob {
    OmJobFn fn;
    void* ctx;
    pthread_t thread;
    OmStatus status;             // written by the job before is_finished
    char message[MESSAGE_SIZE];  // written by the job before is_finished
    _Atomic double progress;
    atomic_bool is_cancelled, is_finished;
};

static bool report(void* ctx, const char* stage, double done, double total) {
    (void)stage;
    OmJob* job = ctx;
    double share = total > 0 && done > 0 ? done / total : 0;
    atomic_store_explicit(&job->progress, share < 1 ? share : 1, memory_order_relaxed);
    return !atomic_load_explicit(&job->is_cancelled, memory_order_relaxed);
}

static void* run(void* ctx) {
    OmJob* job = ctx;
    OmProgress progress = {report, job};
    job->status = job->fn(job->ctx, &progress);
    if (job->status != OM_OK) snprintf(job->message, sizeof job->message, "%s", om_error_message());
    atomic_store_explicit(&job->is_finished, true, memory_order_release);
    return NULL;
}

OmStatus om_job_start(OmJobFn fn, void* ctx, OmJob** out) {
    *out = NULL;
    OmJob* job = om_calloc(1, sizeof *job);
    if (!job) return OM_NO_MEMORY;
    job->fn = fn;
    job->ctx = ctx;
    int code = pthread_create(&job->thread, NULL, run, job);
    if (code != 0) {
        om_free(job);
        return om_error(OM_UNAVAILABLE, "background job: cannot start a thread: %s",
                        strerror(code));
    }
    *out = job;
    return OM_OK;
}

bool om_job_is_finished(const OmJob* job) {
    return atomic_load_explicit(&job->is_finished, memory_order_acquire);
}

double om_job_progress(const OmJob* job) {
    return atomic_load_explicit(&job->progress, memory_order_relaxed);
}

void om_job_cancel(OmJob* job) {
    atomic_store_explicit(&job->is_cancelled, true, memory_order_relaxed);
}

OmStatus om_job_join(OmJob* job) {
    if (!job) return OM_OK;
    pthread_join(job->thread, NULL);
    OmStatus status = job->status;
    if (status != OM_OK) om_error(status, "%s", job->message);
    om_free(job);
    return status;
}
