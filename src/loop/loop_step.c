// loop_step.c: one step of world and twin, and its measurements.
#include <string.h>

#include "base/base_grow.h"
#include "loop/loop_state.h"

static OmStatus step_twin(OmLoop* loop, const OmObservation* obs, double dt) {
    double start = om_clock_now();
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        if (!om_body_is_holding(loop->twin, a)) continue;
        om__cloud_draw(&loop->act, a);
        OmPose tip = om__twin_pose(&loop->act, a, obs->arm[a].tip);
        tip.p = om_add(tip.p, loop->act.arm[a].twin_off);
        OM_TRY(om_body_move(loop->twin, a, tip));
    }
    if (loop->belief.adoption)
        OM_TRY(om_match_adoption_step(loop->belief.adoption, loop->twin, dt));
    OmBodyReport report;
    OmStatus status = om_body_step(loop->twin, dt, &report);
    if (status < 0) return om_error_prefix(status, "twin at %.2f s", loop->act.time);
    OmBodyForces forces;
    OM_TRY(om_body_get_forces(loop->twin, &forces));
    om__force_add(&loop->belief, obs, &forces);
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        const double factor = loop->result.belief.force_factor;
        const double twin =
            om_body_is_holding(loop->twin, a) ? factor * om_norm(forces.pull[a]) : 0.0;
        loop->act.force[a] = fmax(twin, om_norm(loop->belief.felt[a]));
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
        r->truth.more = fmax(r->truth.more, force - loop->act.force[a]);
        r->truth.less = fmax(r->truth.less, loop->act.force[a] - force);
    }
    double epsilon = loop->task.force_threshold;
    if (largest > epsilon && !(was > epsilon)) ++r->truth.nforce;
    loop->force_world = loop->force_world_last = largest;
    loop->force_world_action = fmax(loop->force_world_action, largest);
    r->truth.force = fmax(r->truth.force, largest);
    return OM_OK;
}

static void watch_force(OmLoop* loop) {
    if (!loop->has_forces) return;
    double limit = om__force_limit(&loop->task), largest = 0;
    for (int a = 0; a < OM_MAX_ARM; ++a) largest = fmax(largest, loop->act.force[a]);
    loop->force_action = fmax(loop->force_action, largest);
    loop->result.twin.force = fmax(loop->result.twin.force, largest);
    if (!loop->task.watch_force) return;
    bool is_over = largest > limit;
    if (is_over && !loop->act.is_over) ++loop->result.twin.nforce;
    if (is_over && !loop->is_paused) loop->act.over_time += loop->task.time_step;
    loop->act.is_over = is_over;
    loop->act.rate = om__force_rate(largest, limit);
}

OmRetractSample om__loop_sample(const OmLoop* loop) {
    OmRetractSample s = {.time = loop->act.time,
                         .visibility = loop->act.visibility,
                         .visibility_world = loop->visibility_world,
                         .force_world = loop->force_world,
                         .speed_rate = loop->act.rate,
                         .mu = loop->belief.monitor ? loop->belief.frame.mu : (double)NAN,
                         .warning = loop->belief.warn.state};
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        s.force = fmax(s.force, loop->act.force[a]);
        if (loop->act.arm[a].in_hand >= 0) s.height = fmax(s.height, loop->act.arm[a].lift);
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
        const ArmState* arm = &loop->act.arm[a];
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
    loop->act.visibility = obs->visibility;
    if (!loop->meter) return OM_OK;
    OmStatus status = om_roi_meter_look(loop->meter, &obs->endoscope, &loop->act.visibility);
    om_world_set_window(loop->world, om_roi_meter_window(loop->meter));
    return status;
}

OmStatus om__loop_step(OmLoop* loop) {
    double dt = loop->task.time_step;
    OmStatus status = om_world_advance(loop->world, dt);
    if (status < 0) return om_error_prefix(status, "world at %.2f s", loop->act.time);
    bool is_look = loop->act.tick % LOOK_EVERY == 0;
    OmObservation obs = {0};
    const bool is_frame = om__warn_is_due(&loop->belief);
    unsigned what = is_look ? sources_of_look(loop) : 0;
    if (is_frame) what |= om_monitor_sources(loop->belief.monitor, loop->world);
    OM_TRY(om_world_observe(loop->world, what, &obs));
    // The operation begins one step before the first observation.
    if (loop->act.tick == 0) loop->belief.time_origin = obs.time - dt;
    loop->act.time = obs.time - loop->belief.time_origin;
    if (is_look) status = take_look(loop, &obs);
    om__loop_check_observation(loop, &obs, is_look);
    keep_lost_tips(loop, &obs);
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        ArmState* arm = &loop->act.arm[a];
        arm->tip = om__to_task(&loop->grid, obs.arm[a].tip.p);
        arm->q = obs.arm[a].tip.q;
        memcpy(arm->joint, obs.arm[a].q, sizeof arm->joint);
        arm->jaw = obs.arm[a].jaw;
        arm->is_moving = obs.arm[a].is_moving;
        arm->lift = arm->in_hand >= 0 ? arm->tip.z - arm->grasp_tip.z : 0.0;
    }
    if (status >= 0) status = om__slip_watch(loop, &obs);
    if (status >= 0) status = step_twin(loop, &obs, dt);
    if (status >= 0 && is_frame) status = om__warn_frame(&loop->belief, &obs);
    om_observation_done(&obs);
    OM_TRY(status);
    watch_force(loop);
    OM_TRY(watch_truth(loop));
    if (is_look) OM_TRY(add_sample(loop));
    ++loop->act.tick;
    loop->result.time = loop->act.time;
    loop->result.visibility_end = loop->act.visibility;
    loop->result.truth.visibility = loop->visibility_world;
    return OM_OK;
}
