/// omentum/rl_demo.h: demonstrations of a task (floor 7).
///
/// A demonstration is an episode of an expert: an observation and an action for each step. Files are HDF5 in the layout
/// of robomimic: data/demo_0/obs/state, data/demo_0/actions, rewards, dones. Actions are the numbers of the choices.
///
///     OmRlDemos demos;
///     om_rl_demos_record(task, 35, 1, NULL, &demos);       // by the task's scripted expert
///     om_rl_demos_save(&demos, "demos.hdf5");
///     om_rl_demos_done(&demos);
#ifndef OMENTUM_RL_DEMO_H
#define OMENTUM_RL_DEMO_H

#include "omentum/rl.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmRlDemos {  // om_rl_demos_done frees
    char task[OM_RL_NAME];  // empty: the file does not say
    char meaning
        [OM_RL_MEANING];  // of the task (rl.h); empty: the file does not say, or there is none
    int nobservation, naction;
    int nchoice[OM_RL_MAX_ACTION];
    int ndemo;
    int nstep;       // of all demonstrations
    int* adr;        // first step of each, and nstep (ndemo + 1)
    float* obs;      // before each step (nstep x nobservation)
    int* action;     // (nstep x naction)
    double* reward;  // (nstep)
    double* score;   // of each demonstration: the task's score, or the return (ndemo)
    // the first demonstrations of a recording that was cancelled, and its seed: om_rl_demos_continue
    bool is_partial;
    uint64_t seed;
} OmRlDemos;

/// Episodes of the task's expert from drawn starts.
/// @param ndemo  > 0
/// @return OM_OK; OM_INVALID; OM_UNAVAILABLE (the task has no expert); OM_NO_MEMORY; OM_CANCELLED; an error of the task
OM_API OmStatus om_rl_demos_record(const OmRlTask* task, int ndemo, uint64_t seed,
                                   const OmProgress* progress, OmRlDemos* demos);
/// The same, which continues a cancelled recording and keeps what is finished: the result of om_rl_demos_record.
/// @param demos  in/out: zero, or the demonstrations of a cancelled call with this task and seed
/// @return as om_rl_demos_record; OM_CANCELLED (demos has the first demonstrations of the recording, maybe none, and is
///         partial unless it has none); OM_INVALID also for demonstrations of another recording, or more than ndemo.
///         After another error demos is unchanged.
OM_API OmStatus om_rl_demos_continue(const OmRlTask* task, int ndemo, uint64_t seed,
                                     const OmProgress* progress, OmRlDemos* demos);
OM_API void om_rl_demos_done(OmRlDemos* demos);
/// Whether they can be used for this task. What a file of another tool does not say (task, meaning) is not compared:
/// observations and actions must then be those of the task.
/// @return OM_OK; OM_INVALID (another task, other sizes, or another meaning; the message names both)
OM_API OmStatus om_rl_demos_check(const OmRlDemos* demos, const OmRlTask* task);

/// @return OM_OK; OM_NO_MEMORY; OM_IO
OM_API OmStatus om_rl_demos_save(const OmRlDemos* demos, const char* path);
/// Read a file of om_rl_demos_save or of robomimic.
/// @return OM_OK; OM_INVALID (the message names the part); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_rl_demos_load(const char* path, OmRlDemos* demos);
/// The same from memory; `name` stands for the file in messages.
/// @return OM_OK; OM_INVALID (the message names the part); OM_NO_MEMORY
OM_API OmStatus om_rl_demos_parse(const char* data, size_t size, const char* name,
                                  OmRlDemos* demos);

#ifdef __cplusplus
}
#endif
#endif
