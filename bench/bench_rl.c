// bench_rl.c: steps of the task "retract" in one environment: fat asleep, and fat lifted from the kidney to p_T. 3
// substeps of 9 iterations, reward (b). Without pictures, and with the endoscope's picture as observation.
#include <stdio.h>

#include "bench.h"

#define NSLEEP 2000
#define NMOST 2000
#define NPICTURE 300
#define START 45         // in the middle of the row farthest from the fixed side
#define AWAKE_HZ 1500.0  // goals: steps a second on one core
#define ASLEEP_HZ 20000.0

// Time of a step before the grasp, and after it.
static OmStatus run_once(const OmRlTask* task, void* state, double* asleep, double* awake,
                         int* nawake) {
    const OmRlTaskOps* ops = task->ops;
    double reward, begin = bench_now();
    bool is_end = false;
    OM_TRY(ops->reset(task, state, om_rng_init(1, 0), START));
    for (int k = 0; k < NSLEEP; ++k)
        OM_TRY(ops->step(task, state, (int[3]){1 + k % 2, 1 + k / 2 % 2, 0}, &reward, &is_end));
    *asleep = (bench_now() - begin) / NSLEEP;
    OmRng rng = om_rng_init(1, 1);
    float obs[12] = {0};
    *nawake = 0;
    for (int k = 0; k < NMOST && !is_end; ++k) {
        int action[OM_RL_MAX_ACTION];
        ops->expert(task, state, &rng, action);
        begin = bench_now();
        OM_TRY(ops->step(task, state, action, &reward, &is_end));
        ops->observe(task, state, obs);
        if (obs[11] > 0) *awake += bench_now() - begin, ++*nawake;  // fat is grasped
    }
    *awake /= *nawake > 0 ? *nawake : 1;
    return OM_OK;
}

// A step with fat asleep and its observation, the endoscope's picture of 84 x 84.
static OmStatus bench_picture(const BenchOptions* options) {
    OmRlTask* task = NULL;
    void* state = NULL;
    float* obs = NULL;
    OmStatus status = OM_OK;
    double reward, *time = om_calloc((size_t)options->nrun, sizeof *time);
    bool is_end;
    if (!time) return OM_NO_MEMORY;
    OM_TRY_DONE(om_rl_task_create("retract", &(OmRlSetting){"picture", "1"}, 1, &task));
    OM_TRY_DONE(task->ops->state_create(task, &state));
    OM_ALLOC_DONE(obs, task->nobservation);
    for (int run = 0; run < options->nrun; ++run) {
        OM_TRY_DONE(task->ops->reset(task, state, om_rng_init(1, 0), START));
        double begin = bench_now();
        for (int k = 0; k < NPICTURE; ++k) {
            int action[3] = {1 + k % 2, 1 + k / 2 % 2, 0};
            OM_TRY_DONE(task->ops->step(task, state, action, &reward, &is_end));
            task->ops->observe(task, state, obs);
        }
        time[run] = (bench_now() - begin) / NPICTURE;
    }
    BenchRow row = {.bench = "rl",
                    .scene = "retract",
                    .work = "step, nothing touches the fat, observed as a picture of 84 x 84",
                    .size = 84 * 84,
                    .nworker = 1,
                    .steps = NPICTURE,
                    .nrun = options->nrun};
    bench_times(time, options->nrun, &row);
    status = bench_print(&row);
done:
    if (state) task->ops->state_destroy(task, state);
    om_rl_task_destroy(task);
    om_free(obs);
    om_free(time);
    return status;
}

OmStatus bench_rl(const BenchOptions* options) {
    OmRlTask* task = NULL;
    void* state = NULL;
    int nawake = 0;
    OmStatus status = OM_OK;
    double* time = om_calloc(2 * (size_t)options->nrun, sizeof *time);
    if (!time) return OM_NO_MEMORY;
    OM_TRY_DONE(om_rl_task_create("retract", NULL, 0, &task));
    OM_TRY_DONE(task->ops->state_create(task, &state));
    for (int run = 0; run < options->nrun; ++run)
        OM_TRY_DONE(run_once(task, state, &time[run], &time[options->nrun + run], &nawake));
    BenchRow row = {.bench = "rl",
                    .scene = "retract",
                    .work = "step, nothing touches the fat",
                    .size = 900,
                    .nworker = 1,
                    .steps = NSLEEP,
                    .nrun = options->nrun,
                    .goal_ms = 1e3 / ASLEEP_HZ};
    bench_times(time, options->nrun, &row);
    OM_TRY_DONE(bench_print(&row));
    row.work = "step, fat lifted from the kidney, 3 substeps of 9 iterations";
    row.steps = nawake;
    row.goal_ms = 1e3 / AWAKE_HZ;
    bench_times(time + options->nrun, options->nrun, &row);
    OM_TRY_DONE(bench_print(&row));
    status = bench_picture(options);
done:
    if (state) task->ops->state_destroy(task, state);
    om_rl_task_destroy(task);
    om_free(time);
    return status;
}
