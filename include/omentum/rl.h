/// omentum/rl.h: tasks to learn and environments that run side by side (floor 7).
///
/// A task is a constant object with a table of functions: it creates states, resets them, and steps them. One state is
/// one environment. An action is a vector of integers, action[k] from 0 to nchoice[k] - 1 (MultiDiscrete). A vector of
/// environments steps many states of one task on worker threads, draws the start of each episode, cuts episodes at the
/// task's limit, and begins the next episode in the same step.
///
///     OmRlTask* task; OmRlVec* vec;
///     om_rl_task_create("cart-pole", NULL, 0, &task);
///     OmRlVecDef def = om_rl_vec_default_def(task);
///     def.nenv = 16;
///     om_rl_vec_create(&def, &vec);
///     om_rl_vec_reset(vec, obs);                                  // obs[16][task->nobservation]
///     om_rl_vec_step(vec, action, &(OmRlStep){.obs = obs, .reward = reward, .is_terminated = done});
///
/// Episode k of environment i is a function of (seed, i, k) and the actions, for any number of workers.
#ifndef OMENTUM_RL_H
#define OMENTUM_RL_H

#include "omentum/base.h"
#include "omentum/image.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- tasks ------------------------------------------------------------------------------------------

#define OM_RL_MAX_ACTION 8   // components of an action
#define OM_RL_MAX_CHOICE 64  // choices of all components together
#define OM_RL_MAX_INFO 8     // named values beside the observation
#define OM_RL_NAME 32        // bytes of a name with its end
#define OM_RL_SETTINGS 2048  // bytes of OmRlTask.settings and values with their ends
#define OM_RL_MEANING 160    // bytes of OmRlTask.meaning with its end

typedef struct OmRlTask OmRlTask;

enum {
    OM_RL_KEY_UP = 256,
    OM_RL_KEY_DOWN,
    OM_RL_KEY_LEFT,
    OM_RL_KEY_RIGHT,
    OM_RL_KEY_PAGE_UP,
    OM_RL_KEY_PAGE_DOWN
};
/// A key of a person who drives a task.
typedef struct OmRlKey {
    int key;                // a character, or OM_RL_KEY_UP and the following ones
    int component, choice;  // of the action
    const char* about;      // one sentence
} OmRlKey;

/// Functions of one kind of task. Calls on different states of one task run at the same time on several threads.
/// Functions marked optional may be null.
typedef struct OmRlTaskOps {
    void (*destroy)(OmRlTask* task);
    /// Memory of one environment; reset comes before any other call.
    OmStatus (*state_create)(const OmRlTask* task, void** state);
    void (*state_destroy)(const OmRlTask* task, void* state);
    /// Begin an episode. All that is drawn, also later in the episode, comes from `rng` (keep a copy).
    /// `start`: -1 draws one; 0 to nstart - 1 is a start of the evaluation.
    OmStatus (*reset)(const OmRlTask* task, void* state, OmRng rng, int start);
    /// One step. `action` is in range. The limit of steps is not the task's business.
    OmStatus (*step)(const OmRlTask* task, void* state, const int* action, double* reward,
                     bool* is_terminated);
    /// Write nobservation finite values; the vector cuts them to obs_lo and obs_hi.
    void (*observe)(const OmRlTask* task, const void* state, float* obs);
    /// Write ninfo values. May be slow (a picture): called at the end of an episode and on request. Optional.
    OmStatus (*info)(const OmRlTask* task, void* state, double* value);
    /// Draw the scene into an empty picture, RGB. Its width and height, if they are set, are the wanted size. Optional.
    OmStatus (*render)(const OmRlTask* task, void* state, OmPicture* picture);
    /// The action of a scripted expert with the noise of a person; its noise comes from `rng`. Optional.
    void (*expert)(const OmRlTask* task, const void* state, OmRng* rng, int* action);
    /// Where the tip of a tool is, m. Optional; a task has all of tip, place and steer, or none.
    void (*tip)(const OmRlTask* task, const void* state, double tip[3]);
    /// Right after a reset: put the tip at a place. It stays off obstacles.
    /// @return OM_OK; OM_INVALID (outside of the workspace, or out of reach: nothing was changed)
    OmStatus (*place)(const OmRlTask* task, void* state, const double tip[3]);
    /// The action that brings the tip nearest to a place; is_closed: the wish of a gripper, if there is one.
    void (*steer)(const OmRlTask* task, const void* state, const double to[3], bool is_closed,
                  int* action);
    /// Bytes of a state: after restore every later step gives the bytes of the saved state. Where a state is one block
    /// of memory without pointers, save and restore may be null: the block is copied.
    size_t (*state_size)(const OmRlTask* task);
    void (*save)(const OmRlTask* task, const void* state, void* block);
    void (*restore)(const OmRlTask* task, void* state, const void* block);
} OmRlTaskOps;

struct OmRlTask {  // head of every kind of task; constant after creation
    const OmRlTaskOps* ops;
    char name[OM_RL_NAME];
    int nobservation;  // values of an observation, > 0
    // Least and largest value of an observation, finite, lo < hi; what a task writes beyond them is cut to them.
    float obs_lo, obs_hi;
    // Of an observation that is an RGB picture: its rows from the top, 3 values of 0 to 1 a pixel; 0: it is no picture.
    int picture_width, picture_height;
    int naction;                    // components of an action, 1 to OM_RL_MAX_ACTION
    int nchoice[OM_RL_MAX_ACTION];  // choices of each, >= 2
    int max_step;                   // steps after which an episode is truncated, > 0
    int nstart;                     // starts of the evaluation; 0: none
    int ninfo;                      // named values
    const char* info_name[OM_RL_MAX_INFO];
    const char* score_name;  // the info that an evaluation reports; null: the return
    double target;           // score at which the task counts as solved; NaN: none
    // For a person. Without a key a component of the action has its choice `rest`; -1: it keeps the last one.
    const OmRlKey* key;  // (nkey)
    int nkey;
    int rest[OM_RL_MAX_ACTION];
    double period;  // of a step in real time, s, > 0
    double move;    // of the tip along an axis in a step, m; 0: the task has no tip, place, steer
    bool has_jaw;   // steer uses is_closed
    // Settings that change what observations and actions mean, as KEY=VALUE with spaces between: demonstrations of
    // other ones are refused. Empty: there are none.
    char meaning[OM_RL_MEANING];
    // Lines KEY=VALUE: the settings that the task was created with (om_rl_task_create), and all values that follow.
    char settings[OM_RL_SETTINGS], values[OM_RL_SETTINGS];
    uint64_t hash;  // of all settings: checkpoints of other settings are refused
};

typedef struct OmRlSetting {  // of a task, as written by a user
    const char *key, *value;
} OmRlSetting;

/// A kind of task.
typedef struct OmRlTaskKind {
    const char *name, *about;
    OmStatus (*create)(const OmRlSetting* setting, int nsetting, OmRlTask** task);
} OmRlTaskKind;
/// Kind i, or null behind the last one.
OM_API const OmRlTaskKind* om_rl_task_kind(int i);

/// Create a task by name.
/// @param setting  (nsetting), may be null if there are none
/// @return OM_OK; OM_INVALID (no such task, key or value; the message names it); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_rl_task_create(const char* name, const OmRlSetting* setting, int nsetting,
                                  OmRlTask** task);
OM_API void om_rl_task_destroy(OmRlTask* task);
#define OM_RL_NAPPROACH 8  // values of an observation of the task "approach"
/// The observation of the task "approach", for programs that carry out motions by a policy trained on it.
/// @param p, goal    of tip and goal, as shares of the box (3)
/// @param is_tissue  the goal is on tissue, which a free tip comes to from above; false: the way is free
/// @param obs        receives OM_RL_NAPPROACH values
OM_API void om_rl_approach_observe(const double* p, const double* goal, bool is_tissue, float* obs);
/// All choices of an action together: the sum of nchoice.
OM_API int om_rl_task_nlogit(const OmRlTask* task);
/// The action without a key: where a component keeps its last choice, that of `action` stays.
OM_API void om_rl_task_rest(const OmRlTask* task, int* action);
/// Put a key into an action. @return false: the task has no such key
OM_API bool om_rl_task_press(const OmRlTask* task, int key, int* action);

// ---- environments side by side ----------------------------------------------------------------------

typedef struct OmRlVec OmRlVec;

typedef struct OmRlVecDef {
    OmCookie cookie;
    const OmRlTask* task;  // borrowed until the vector is destroyed
    int nenv;              // environments, 1 to 65536, default 8
    int nworker;           // 0 (default): one per processor; the same bytes for any
    uint64_t seed;         // default 1
    bool has_info;         // final_info is computed; default true
    // Where an episode ends, the next one begins in the same step; default true. If false, the environment keeps its
    // last state, and must be reset before the next step.
    bool has_autoreset;
} OmRlVecDef;
OM_API OmRlVecDef om_rl_vec_default_def(const OmRlTask* task);

/// @return OM_OK; OM_INVALID (the message names the field); OM_NO_MEMORY; an error of the task
OM_API OmStatus om_rl_vec_create(const OmRlVecDef* def, OmRlVec** vec);
OM_API void om_rl_vec_destroy(OmRlVec* vec);
OM_API const OmRlTask* om_rl_vec_task(const OmRlVec* vec);
OM_API int om_rl_vec_nenv(const OmRlVec* vec);

/// Begin the next episode of every environment; the first call begins episode 0.
/// @param obs  (nenv x nobservation)
/// @return OM_OK; an error of the task, the message names the environment
OM_API OmStatus om_rl_vec_reset(OmRlVec* vec, float* obs);
/// Another seed: the next reset begins episode 0 of this seed, as in a new vector.
OM_API void om_rl_vec_set_seed(OmRlVec* vec, uint64_t seed);
/// Begin the next episode of one environment at a start of the evaluation.
/// @param start  0 to nstart - 1; -1: drawn
/// @param obs    (nobservation)
/// @return OM_OK; OM_INVALID (no such environment or start); an error of the task
OM_API OmStatus om_rl_vec_reset_one(OmRlVec* vec, int env, int start, float* obs);

/// Arrays of the caller; null: not wanted. Those named final_ are written where an episode ended, others stay.
typedef struct OmRlStep {
    float* obs;            // after the step, or the start of the next episode (nenv x nobservation)
    double* reward;        // (nenv)
    bool* is_terminated;   // the task ended the episode (nenv)
    bool* is_truncated;    // the limit of steps ended the episode (nenv)
    float* final_obs;      // last observation of an episode (nenv x nobservation)
    double* final_info;    // last infos (nenv x ninfo)
    double* final_return;  // sum of the rewards (nenv)
    int* final_length;     // steps (nenv)
} OmRlStep;
#define OM_RL_WAIT (-1)  // first component of an action: the environment is not stepped
/// Step every environment. Where an episode ends, the next one begins in the same call (has_autoreset). An environment
/// that waits has reward 0 and no end.
/// @param action  (nenv x naction)
/// @return OM_OK; OM_INVALID (an action out of range, or no reset before or after an end without autoreset: nothing was
///         changed); an error of the task
OM_API OmStatus om_rl_vec_step(OmRlVec* vec, const int* action, const OmRlStep* out);

/// The infos of an environment now (ninfo values).
/// @return OM_OK; OM_INVALID (no such environment, or no infos); an error of the task
OM_API OmStatus om_rl_vec_info(OmRlVec* vec, int env, double* value);
/// Draw an environment into an empty picture, of its width and height if both are set.
/// @return OM_OK; OM_INVALID (no such environment); OM_UNAVAILABLE (the task has no picture); an error of the task
OM_API OmStatus om_rl_vec_render(OmRlVec* vec, int env, OmPicture* picture);
/// The action of the task's expert in an environment (naction values).
/// @return OM_OK; OM_INVALID (no such environment); OM_UNAVAILABLE (the task has no expert)
OM_API OmStatus om_rl_vec_expert(OmRlVec* vec, int env, OmRng* rng, int* action);

/// Everything that changes, for resuming: om_rl_vec_size bytes.
OM_API size_t om_rl_vec_size(const OmRlVec* vec);
OM_API void om_rl_vec_save(const OmRlVec* vec, void* block);
/// @return OM_OK; OM_INVALID (a block of another task, seed or number of environments: nothing was changed)
OM_API OmStatus om_rl_vec_restore(OmRlVec* vec, const void* block);
/// Write the observations of all environments (nenv x nobservation).
OM_API void om_rl_vec_observe(const OmRlVec* vec, float* obs);

#ifdef __cplusplus
}
#endif
#endif
