// defras_step.c: one step of world and twin, and its measurements.
//
// From SLOW_FROM of the force limit (the threshold less the margin) on the motion slows down, to SLOW_RATE at the
// limit; above it the tip almost stops, and moving tissue comes to rest.
#include <string.h>

#include "base/base_grow.h"
#include "defras/defras_internal.h"

#define SLOW_FROM 0.75   // fraction of the limit above which a motion slows down
#define RATE_STEP 0.125  // the rate changes in steps of this size
#define STILL_RATE 0.02  // fraction of the nominal speed above the limit

static OmStatus step_twin(OmLoop* loop, const OmObservation* obs, double dt) {
    double start = om_clock_now();
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        if (!om_body_is_holding(loop->twin, a)) continue;
        om__cloud_draw(loop, a);
        OmPose tip = om__twin_pose(loop, a, obs->arm[a].tip);
        tip.p = om_add(tip.p, loop->arm[a].twin_off);
        OM_TRY(om_body_move(loop->twin, a, tip));
    }
    if (loop->adoption) OM_TRY(om_match_adoption_step(loop->adoption, loop->twin, dt));
    OmBodyReport report;
    OmStatus status = om_body_step(loop->twin, dt, &report);
    if (status < 0) return om_error_prefix(status, "twin at %.2f s", loop->time);
    OmBodyForces forces;
    OM_TRY(om_body_get_forces(loop->twin, &forces));
    om__force_add(loop, obs, &forces);
    OM_TRY(om__modulus_step(loop, obs, &forces));
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        const double factor = loop->result.force_factor;
        loop->force[a] = om_body_is_holding(loop->twin, a) ? factor * om_norm(forces.pull[a]) : 0.0;
    }
    loop->twin_wall += om_clock_now() - start;
    return OM_OK;
}

// The force in the truth is recorded; the arms do not use it.
static OmStatus watch_truth(OmLoop* loop) {
    OmRetractResult* r = &loop->result;
    OmBody* truth = loop->truth;
    loop->force_world = NAN;
    if (!truth) return OM_OK;
    double was = loop->force_world_last, largest = 0;
    OmBodyForces forces = {0};
    if (om_body_is_holding(truth, 0) || om_body_is_holding(truth, 1))
        OM_TRY(om_body_get_forces(truth, &forces));
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        double force = om_norm(forces.pull[a]);
        largest = fmax(largest, force);
        // While the jaws open, the twin has already released the tissue: compare only while both grasp it.
        if (!om_body_is_holding(loop->twin, a) || !om_body_is_holding(truth, a)) continue;
        if (!loop->has_forces) continue;
        r->force_more = fmax(r->force_more, force - loop->force[a]);
        r->force_less = fmax(r->force_less, loop->force[a] - force);
    }
    double epsilon = loop->task.force_threshold;
    if (largest > epsilon && !(was > epsilon)) ++r->nforce_world;
    loop->force_world = loop->force_world_last = largest;
    loop->force_world_action = fmax(loop->force_world_action, largest);
    r->force_world_max = fmax(r->force_world_max, largest);
    return OM_OK;
}

double om__force_rate(double force, double limit) {
    double slowing = fmax(0, (force / limit - SLOW_FROM) / (1 - SLOW_FROM));
    double rate = 1 - RATE_STEP * ceil((1 - SLOW_RATE) * fmin(slowing, 1) / RATE_STEP);
    return force > limit ? STILL_RATE : rate;
}

static void watch_force(OmLoop* loop) {
    if (!loop->has_forces || loop->is_waiting) return;  // springs of a following are no pull
    double limit = om__force_limit(&loop->task), largest = 0;
    for (int a = 0; a < OM_MAX_ARM; ++a) largest = fmax(largest, loop->force[a]);
    loop->force_action = fmax(loop->force_action, largest);
    loop->result.force_max = fmax(loop->result.force_max, largest);
    if (!loop->task.watch_force) return;
    bool is_over = largest > limit;
    if (is_over && !loop->is_over) ++loop->result.nforce;
    if (is_over && !loop->is_paused) loop->over_time += loop->task.time_step;
    loop->is_over = is_over;
    loop->rate = om__force_rate(largest, limit);
}

OmRetractSample om__loop_sample(const OmLoop* loop) {
    OmRetractSample s = {.time = loop->time,
                         .visibility = loop->visibility,
                         .visibility_world = loop->visibility_world,
                         .force_world = loop->force_world,
                         .speed_rate = loop->rate,
                         .mu = loop->monitor ? loop->frame.mu : (double)NAN,
                         .warning = loop->warning};
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        s.force = fmax(s.force, loop->force[a]);
        if (loop->arm[a].in_hand >= 0) s.height = fmax(s.height, loop->arm[a].lift);
    }
    if (!loop->has_forces) s.force = NAN;
    return s;
}

static OmStatus add_sample(OmLoop* loop) {
    OmRetractResult* r = &loop->result;
    OM_GROW(r->sample, r->nsample, loop->sample_capacity, 256);
    r->sample[r->nsample++] = om__loop_sample(loop);
    return OM_OK;
}

// An arm that is not measured stays where it was last measured.
static void keep_lost_tips(const OmLoop* loop, OmObservation* obs) {
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        const ArmState* arm = &loop->arm[a];
        OmPose* tip = &obs->arm[a].tip;
        if (om_is_finite3(tip->p)) continue;
        *tip = (OmPose){om_pose_apply(loop->grid.task, arm->tip), arm->q};
    }
}

// What a look observes: the ROI in the picture, and the visibility by rays for the record. Both are observed
// without a truth, too: a replay makes the same calls.
static unsigned sources_of_look(const OmLoop* loop) {
    unsigned has = om_world_sources(loop->world), judge = has & OM_OBSERVE_VISIBILITY;
    if (!loop->meter) return judge;
    return judge | (has & OM_OBSERVE_WINDOW ? OM_OBSERVE_WINDOW : OM_OBSERVE_IMAGE);
}

static OmStatus take_look(OmLoop* loop, const OmObservation* obs) {
    double age = obs->time - obs->endoscope.time;
    bool has_judge = loop->truth && om_world_sources(loop->world) & OM_OBSERVE_VISIBILITY;
    loop->look_age = age < 0 ? 0 : age;
    loop->visibility_world = has_judge ? obs->visibility : (double)NAN;
    loop->visibility = obs->visibility;
    if (!loop->meter) return OM_OK;
    OmStatus status = om_roi_meter_look(loop->meter, &obs->endoscope, &loop->visibility);
    om_world_set_window(loop->world, om_roi_meter_window(loop->meter));
    return status;
}

OmStatus om__loop_step(OmLoop* loop) {
    double dt = loop->task.time_step;
    OmStatus status = om_world_advance(loop->world, dt);
    if (status < 0) return om_error_prefix(status, "world at %.2f s", loop->time);
    bool is_look = loop->tick % LOOK_EVERY == 0;
    OmObservation obs = {0};
    const bool is_frame = om__warn_is_due(loop);
    unsigned what = is_look ? sources_of_look(loop) : 0;
    if (is_frame) what |= om_monitor_sources(loop->monitor, loop->world);
    OM_TRY(om_world_observe(loop->world, what, &obs));
    // The operation begins one step before the first observation.
    if (loop->tick == 0) loop->time_origin = obs.time - dt;
    loop->time = obs.time - loop->time_origin;
    if (is_look) status = take_look(loop, &obs);
    om__loop_check_observation(loop, &obs, is_look);
    keep_lost_tips(loop, &obs);
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        ArmState* arm = &loop->arm[a];
        arm->tip = om__to_task(&loop->grid, obs.arm[a].tip.p);
        arm->q = obs.arm[a].tip.q;
        memcpy(arm->joint, obs.arm[a].q, sizeof arm->joint);
        arm->jaw = obs.arm[a].jaw;
        arm->is_moving = obs.arm[a].is_moving;
        arm->lift = arm->in_hand >= 0 ? arm->tip.z - arm->grasp_tip.z : 0.0;
    }
    if (status >= 0) status = om__slip_watch(loop, &obs);
    if (status >= 0) status = step_twin(loop, &obs, dt);
    if (status >= 0 && is_frame) status = om__warn_frame(loop, &obs);
    om_observation_done(&obs);
    OM_TRY(status);
    watch_force(loop);
    OM_TRY(watch_truth(loop));
    if (is_look) OM_TRY(add_sample(loop));
    ++loop->tick;
    loop->result.time = loop->time;
    loop->result.visibility_end = loop->visibility;
    loop->result.visibility_world_end = loop->visibility_world;
    return OM_OK;
}
