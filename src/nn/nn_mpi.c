// nn_mpi.c: training on several ranks over MPI. The only file that uses MPI; without OM_WITH_MPI it is unavailable.
#include <limits.h>

#include "omentum/nn_train.h"

#ifdef OM_WITH_MPI
#include <mpi.h>

typedef struct Mpi {
    MPI_Comm comm;  // a duplicate: messages of the program cannot mix with ours
    bool is_ours;   // we initialised MPI, and finalise it
} Mpi;

static OmStatus failed(int code, const char* what) {
    char text[MPI_MAX_ERROR_STRING];
    int len = 0;
    if (MPI_Error_string(code, text, &len) != MPI_SUCCESS) text[0] = 0;
    return om_error(OM_IO, "MPI: %s: %.200s", what, text);
}

static OmStatus mean(void* ctx, float* value, int64_t count) {
    const Mpi* mpi = ctx;
    int size = 1;
    MPI_Comm_size(mpi->comm, &size);
    for (int64_t at = 0; at < count;) {
        int n = count - at < INT_MAX ? (int)(count - at) : INT_MAX;
        int code = MPI_Allreduce(MPI_IN_PLACE, value + at, n, MPI_FLOAT, MPI_SUM, mpi->comm);
        if (code != MPI_SUCCESS) return failed(code, "the ranks cannot be averaged");
        at += n;
    }
    for (int64_t i = 0; i < count; ++i) value[i] /= (float)size;  // size >= 1
    return OM_OK;
}

OmStatus om_train_group_begin_mpi(OmTrainGroup* group) {
    int is_running = 0, given = 0;
    *group = (OmTrainGroup){.size = 1};
    Mpi* mpi = om_calloc(1, sizeof *mpi);
    if (!mpi) return OM_NO_MEMORY;
    MPI_Initialized(&is_running);
    // Only the training thread communicates.
    int code = is_running ? MPI_SUCCESS : MPI_Init_thread(NULL, NULL, MPI_THREAD_FUNNELED, &given);
    mpi->is_ours = !is_running && code == MPI_SUCCESS;
    if (code == MPI_SUCCESS) code = MPI_Comm_dup(MPI_COMM_WORLD, &mpi->comm);
    if (code != MPI_SUCCESS) {
        om_free(mpi);
        return failed(code, "it cannot be started");
    }
    MPI_Comm_set_errhandler(mpi->comm, MPI_ERRORS_RETURN);
    MPI_Comm_rank(mpi->comm, &group->rank);
    MPI_Comm_size(mpi->comm, &group->size);
    group->mean = mean;
    group->ctx = mpi;
    return OM_OK;
}

void om_train_group_end_mpi(OmTrainGroup* group) {
    Mpi* mpi = group->ctx;
    if (!mpi) return;
    MPI_Comm_free(&mpi->comm);
    if (mpi->is_ours) MPI_Finalize();
    om_free(mpi);
    *group = (OmTrainGroup){.size = 1};
}

#else

OmStatus om_train_group_begin_mpi(OmTrainGroup* group) {
    *group = (OmTrainGroup){.size = 1};
    return om_error(OM_UNAVAILABLE,
                    "this build cannot train on several ranks; configure it with -DOM_WITH_MPI=ON");
}

void om_train_group_end_mpi(OmTrainGroup* group) { *group = (OmTrainGroup){.size = 1}; }

#endif

OmStatus om_train_group_agree(const OmTrainGroup* group, OmStatus status) {
    if (!group) return status;
    float share = status < 0;
    OmStatus sent = group->mean(group->ctx, &share, 1);
    OM_TRY(status);
    OM_TRY(sent);
    OM_CHECK(!(share > 0), OM_INVALID, "training: another rank failed");
    return OM_OK;
}
