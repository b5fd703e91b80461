// dds_publish.c: messages of the simulated robot about its arms.
#include "dds/dds_robot.h"

#include <stdarg.h>
#include <string.h>

void om__robot_say(OmDdsRobot* r, const char* format, ...) {
    char text[400];
    va_list args;
    if (!r->def.say) return;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    r->def.say(r->def.say_ctx, text);
}

double om__robot_stamp(const OmDdsRobot* r) { return r->stamp_origin + r->obs.time; }

// Only where somebody listens, or the recording does.
static OmStatus send(OmDdsRobot* r, int id, const LinkMessage* m) {
    if (id < 0) return OM_OK;  // an instrument without a jaw
    return om__link_is_wanted(r->link, id) ? om__link_write(r->link, id, m) : OM_OK;
}

static LinkMessage message_in(const OmDdsRobot* r, const char* frame) {
    LinkMessage m = {.time = om__robot_stamp(r)};
    snprintf(m.frame, sizeof m.frame, "%s", frame);
    return m;
}

OmStatus om__robot_words(OmDdsRobot* r, int id, const char* words) {
    LinkMessage m = message_in(r, "");
    snprintf(m.text, sizeof m.text, "%s", words);
    return om__link_write(r->link, id, &m);
}

OmStatus om__robot_state(OmDdsRobot* r, Hand* hand) {
    LinkMessage m = message_in(r, hand->name);
    snprintf(m.state.name, sizeof m.state.name, "%s", om__arm_mode_name(hand->core.mode));
    m.state.is_homed = hand->core.is_homed;
    m.state.is_busy = hand->was_busy = hand->core.motion == ARM_MOVE;
    return om__link_write(r->link, hand->state, &m);
}

static LinkMessage joints_message(const OmDdsRobot* r, int n, const double* position,
                                  const double* velocity) {
    LinkMessage m = message_in(r, "");
    LinkJoints* j = &m.joints;
    j->nname = j->nposition = n;
    j->nvelocity = velocity ? n : 0;
    for (int i = 0; i < n; ++i) {
        snprintf(j->name[i], sizeof j->name[i], "%s", n == 1 ? "jaw" : om__arm_joint_name(i));
        j->position[i] = position[i];
        if (velocity) j->velocity[i] = velocity[i];
    }
    return m;
}

static OmStatus send_pose(OmDdsRobot* r, int id, const char* frame, OmPose pose) {
    LinkMessage m = message_in(r, frame);
    m.pose = pose;
    return send(r, id, &m);
}

static OmStatus send_forces(OmDdsRobot* r, Hand* hand, const OmArmObservation* o) {
    if (!o->has_wrench) return OM_OK;
    const OmQuat back = om_quat_conj(o->tip.q);
    LinkMessage m = message_in(r, WORLD);
    m.wrench.force = o->force, m.wrench.torque = o->torque;
    OM_TRY(send(r, hand->spatial_cf, &m));
    m = message_in(r, hand->name);
    m.wrench.force = om_quat_rotate(back, o->force);
    m.wrench.torque = om_quat_rotate(back, o->torque);
    return send(r, hand->body_cf, &m);
}

// Between the last two measured poses, in the frame of measured_cp.
static OmStatus send_speed(OmDdsRobot* r, Hand* hand, OmPose tip, double dt) {
    LinkMessage m = message_in(r, WORLD);
    if (hand->has_last && dt > 0) {
        m.twist.linear = om_scale(1 / dt, om_sub(tip.p, hand->last_tip.p));
        m.twist.angular = om_scale(1 / dt, om__arm_turn(hand->last_tip.q, tip.q));
    }
    hand->last_tip = tip;
    return send(r, hand->measured_cv, &m);
}

static OmStatus send_joints(OmDdsRobot* r, Hand* hand, const OmArmObservation* o, double dt) {
    double speed[OM_PSM_NJOINT] = {0};
    for (int i = 0; hand->has_last && dt > 0 && i < OM_PSM_NJOINT; ++i)
        speed[i] = (o->q[i] - hand->last_q[i]) / dt;
    memcpy(hand->last_q, o->q, sizeof hand->last_q);
    hand->has_last = true;
    const int n = hand->core.psm.njoint;
    LinkMessage m = joints_message(r, n, o->q, speed);
    OM_TRY(send(r, hand->measured_js, &m));
    m = joints_message(r, n, hand->core.q, NULL);
    OM_TRY(send(r, hand->setpoint_js, &m));
    m = joints_message(r, 1, &o->jaw, &o->jaw_speed);
    OM_TRY(send(r, hand->jaw_measured, &m));
    m = joints_message(r, 1, &o->jaw_goal, NULL);
    return send(r, hand->jaw_setpoint, &m);
}

static OmStatus publish_arm(OmDdsRobot* r, int a, double dt) {
    Hand* hand = &r->hand[a];
    const OmArmObservation* o = &r->obs.arm[a];
    const OmPose back = om_pose_inverse(hand->core.psm.pose_world_rcm);
    char base[32];
    snprintf(base, sizeof base, "%s_base", hand->name);
    OM_TRY(send_forces(r, hand, o));
    OM_TRY(send_speed(r, hand, o->tip, dt));
    OM_TRY(send_joints(r, hand, o, dt));
    OM_TRY(send_pose(r, hand->measured_cp, WORLD, o->tip));
    OM_TRY(send_pose(r, hand->setpoint_cp, WORLD, hand->core.setpoint));
    OM_TRY(send_pose(r, hand->local_measured, base, om_pose_mul(back, o->tip)));
    return send_pose(r, hand->local_setpoint, base, om_pose_mul(back, hand->core.setpoint));
}

static void add_frame(LinkMessage* m, const char* child, OmPose pose_world_child) {
    LinkFrame* f = &m->tf.frame[m->tf.n++];
    snprintf(f->parent, sizeof f->parent, "%s", WORLD);
    snprintf(f->child, sizeof f->child, "%s", child);
    f->pose = pose_world_child;
}

OmStatus om__robot_publish_arms(OmDdsRobot* r, double dt) {
    LinkMessage m = message_in(r, "");
    OM_TRY(om__link_write(r->link, r->clock, &m));
    for (int a = 0; a < r->narm; ++a) {
        add_frame(&m, r->hand[a].name, r->obs.arm[a].tip);
        OM_TRY(publish_arm(r, a, dt));
    }
    add_frame(&m, r->ecm.name, r->endoscope.camera.pose_world_camera);
    OM_TRY(send_pose(r, r->ecm.measured_cp, WORLD, r->endoscope.camera.pose_world_camera));
    OM_TRY(send_pose(r, r->ecm.setpoint_cp, WORLD, r->endoscope.camera.pose_world_camera));
    return send(r, r->tf, &m);
}

OmStatus om__robot_publish_info(OmDdsRobot* r) {
    const Eye* eyes[2] = {&r->endoscope, &r->depth};
    for (int k = 0; k < 2; ++k) {
        LinkMessage m = message_in(r, eyes[k]->frame);
        m.info.width = eyes[k]->camera.width;
        m.info.height = eyes[k]->camera.height;
        m.info.lens = om_camera_lens(&eyes[k]->camera);
        OM_TRY(send(r, eyes[k]->info, &m));
    }
    return OM_OK;
}

OmStatus om__robot_publish_static(OmDdsRobot* r) {
    LinkMessage m = message_in(r, "");
    char base[32];
    for (int a = 0; a < r->narm; ++a) {
        snprintf(base, sizeof base, "%s_base", r->hand[a].name);
        add_frame(&m, base, r->hand[a].core.psm.pose_world_rcm);
    }
    add_frame(&m, r->endoscope.frame, r->endoscope.camera.pose_world_camera);
    add_frame(&m, r->depth.frame, r->depth.camera.pose_world_camera);
    OM_TRY(om__link_write(r->link, r->tf_static, &m));
    for (int a = 0; a < r->narm; ++a) {
        OM_TRY(om__robot_state(r, &r->hand[a]));
        OM_TRY(om__robot_words(r, r->hand[a].tool_type, r->def.tool_type));
    }
    return om__robot_state(r, &r->ecm);
}
