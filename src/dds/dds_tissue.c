// dds_tissue.c: by the wall clock the tissue steps in a thread of its own, and follows the newest poses of the arms: a
// robot's arms do not wait for the tissue.
//
//   arms  | tick | tick | tick | tick | tick | tick |      `rate` a second, in the thread of om_dds_robot_run
//   tissue       |---- step 1 ----|      |-- step 2 --|    a job each, begun at a tick
//
// A step lasts as long as the arms have moved since the last one began, but no longer than the scene's time_step or
// a period of the arms. Tissue that needs longer falls behind. Nothing is shared while a step is under way: arms
// come as a snapshot, the answer is taken at the tick that finds the job finished.
#ifdef __linux__
#define _GNU_SOURCE  // SCHED_RESET_ON_FORK
#endif
#include "dds/dds_robot.h"

#include <sched.h>
#include <string.h>
#include <sys/resource.h>

#define JOB_NICE 5  // of the threads of tissue and pictures
#define WINDOW 1.0  // s of the arms, over which the tissue must keep up
#define KEEPS_UP 0.9

// ---- priorities ---------------------------------------------------------------------------------------------------

#ifdef __linux__
// On a machine that other programs use, a thread of the usual kind wakes up 20 to 40 ms late. Real-time priority, as
// the controllers of robots have it, is granted to root, and to users with a limit (ulimit -r) of 1 or more; a tick
// takes 0.2 ms. Threads that the thread makes do not inherit it.
void om__robot_hurry(OmDdsRobot* r) {
    const struct sched_param first = {.sched_priority = 1};
    r->nice = getpriority(PRIO_PROCESS, 0);
    r->policy = sched_getscheduler(0) & ~SCHED_RESET_ON_FORK;
    r->is_hurried = r->def.eyes && r->policy == SCHED_OTHER &&
                    sched_setscheduler(0, SCHED_RR | SCHED_RESET_ON_FORK, &first) == 0;
}

void om__robot_rest(OmDdsRobot* r) {
    const struct sched_param usual = {0};
    // a user who may not clear the flag may keep it
    if (r->is_hurried) (void)sched_setscheduler(0, SCHED_OTHER | SCHED_RESET_ON_FORK, &usual);
}

// Of the calling thread, and of the threads that it makes.
void om__robot_yield(const OmDdsRobot* r) {
    (void)setpriority(PRIO_PROCESS, 0, r->nice + JOB_NICE);
}
#else  // a priority may be that of the whole program
void om__robot_hurry(OmDdsRobot* r) { (void)r; }
void om__robot_rest(OmDdsRobot* r) { (void)r; }
void om__robot_yield(const OmDdsRobot* r) { (void)r; }
#endif

// ---- steps --------------------------------------------------------------------------------------------------------

static OmStatus step(void* ctx, const OmProgress* progress) {
    OmDdsRobot* r = ctx;
    const double start = om_clock_now();
    (void)progress;
    om__robot_yield(r);
    OM_TRY(om_world_set_arms(r->def.world, r->pose));
    OM_TRY(om_world_advance_tissue(r->def.world, r->step_dt));
    OM_TRY(om_world_observe(r->def.world, 0, &r->felt));
    r->step_taken = om_clock_now() - start;
    return OM_OK;
}

// Say once where the tissue does not keep up with the arms.
static void watch_pace(OmDdsRobot* r) {
    const double arms = r->obs.time - r->window_begun, tissue = r->window_tissue;
    if (arms < WINDOW) return;
    if (tissue < KEEPS_UP * arms && !r->has_said_slow) {
        r->has_said_slow = true;
        om__robot_say(r,
                      "the tissue is slower than time on this machine: %.2f s of it in %.2f s; the "
                      "arms are not. A coarser world_cells would be faster",
                      tissue, arms);
    }
    r->window_begun = r->obs.time;
    r->window_tissue = 0;
}

OmStatus om__robot_end_step(OmDdsRobot* r) {
    if (!r->step) return OM_OK;
    const OmStatus status = om_job_join(r->step);
    r->step = NULL;
    if (status < 0) return status;
    const OmBody* truth = om_world_truth(r->def.world);
    for (int a = 0; a < r->narm; ++a) r->is_holding[a] = om_body_is_holding(truth, a);
    if (r->x) memcpy(r->x, om_body_x(truth), 3 * (size_t)om_body_mesh(truth)->nvert * sizeof *r->x);
    memcpy(r->load, r->felt.arm, sizeof r->load);
    ++r->report.nstep;
    r->report.tissue_time += r->step_dt;
    r->report.step_max = fmax(r->report.step_max, r->step_taken);
    r->window_tissue += r->step_dt;
    if (r->fresh) OM_TRY(om_world_save(r->def.world, r->fresh));
    r->is_fresh = r->fresh != NULL;
    return om_world_answer_arms(r->def.world, r->arms);
}

OmStatus om__robot_follow(OmDdsRobot* r) {
    watch_pace(r);
    if (r->step && !om_job_is_finished(r->step)) return OM_OK;
    OM_TRY(om__robot_end_step(r));
    r->step_dt =
        fmin(r->obs.time - r->step_begun, fmax(r->def.scene->task.time_step, 1 / r->def.rate));
    if (!(r->step_dt > 0)) return OM_OK;
    r->step_begun = r->obs.time;
    OM_TRY(om_world_save(r->arms, r->pose));
    return om_job_start(step, r, &r->step);
}

void om__robot_feel(OmDdsRobot* r) {
    for (int a = 0; a < r->narm; ++a) {
        OmArmObservation* o = &r->obs.arm[a];
        const OmArmObservation* felt = &r->load[a];
        o->has_wrench = felt->has_wrench;
        o->force = felt->force;
        o->torque = felt->torque;
    }
}
