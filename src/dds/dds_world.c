// dds_world.c: a robot behind topics as a world.
//
// A motion is a straight line from the setpoint, cut into one goal for each advance, as a simulated world moves its
// arms; each goal is sent by servo_cp. Between two advances messages are taken as they come. In lock-step an advance
// is a tick of the robot: the answers of the arms and the pictures are waited for by their stamps. Otherwise an
// advance lasts dt of the wall clock.
//
// Poses come in the frame that their header names, and commands go out in the frame of measured_cp. tf_static says
// where frames are in "world", the frame of the scene.
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include "dds/dds_link.h"

#define COOKIE 0xdd5003u
#define MAX_FRAMES 128
#define NAME 40           // bytes of a name of an arm or a camera
#define SAME_TIME 1e-6    // s: stamps count nanoseconds
#define HOME_TIME 60.0    // s that homing may take
#define TICK_TIME 10.0    // s that a simulated robot may take for a tick
#define NEW_PICTURE 0.15  // s, age of a picture that is one of now
#define PICTURE_TIME 1.0  // s that are waited for one
#define MAX_TURN 0.5      // rad between two measured poses of an arm
#define UNIT 1e-3         // by which the length of a quaternion may differ from 1
#define GRACE 0.5         // s to find out whether the robot is in lock-step, or has no points
#define HINT "start omentum dvrk in another terminal, or the robot, with the same domain"

typedef struct Limb {  // an arm as its topics show it
    const char* name;
    OmPsm psm;
    int measured_js, measured_cp, setpoint_cp, jaw_measured, jaw_setpoint, wrench;
    int state, error, error_stamped, tool_type;
    int state_command, servo_cp, jaw_move, hold;
    OmArmObservation now;
    // s, of the last messages
    double stamp_js, stamp_cp, stamp_jaw, stamp_jaw_goal, stamp_wrench;
    double heard;  // s of the wall clock, when measured_cp came last
    bool has_cp, has_js, has_jaw, has_setpoint, has_state;
    char frame[64];  // of measured_cp
    char tool[64];   // tool_type
    OmPose pose_world_frame;
    OmPose setpoint;  // pose_world_tip, the last that was sent or read
    double q[OM_PSM_NJOINT];
    OmPose goal;
    double speed;
    bool is_moving;
    char mode[32];
    bool is_homed, is_ours;  // ours: this world has homed it, so it must stay so
} Limb;

typedef struct Sight {  // a camera as its topics show it
    int info, data;
    int image;  // of a depth camera without points; -1: not read
    OmCamera camera;
    bool has_info;
    OmWorldPicture picture;  // of the endoscope
    OmDepthPicture depth;    // of the depth camera
    double stamp;            // s, of the last picture; -INFINITY: none
    char frame[64];
} Sight;

typedef struct DdsWorld {
    OmWorld head;
    OmDdsWorldDef def;
    Link* link;
    Limb limb[OM_MAX_ARM];
    Sight endoscope, depth;
    bool has_points;  // of the depth camera: PointCloud2; otherwise a depth image
    int tf_static, tick_out, tick_in;
    LinkFrame frame[MAX_FRAMES];  // with pose_world_child
    int nframe;
    bool is_lock_step;
    uint32_t client, number, ncommand;
    double time;       // s, of the robot's clock
    double next;       // s of the wall clock, of the next advance
    double taken;      // s of the wall clock, when messages were taken last
    char failed[400];  // "": not; every later call repeats it
} DdsWorld;

OmDdsWorldDef om_dds_world_default_def(const OmScene* scene) {
    return (OmDdsWorldDef){.cookie = COOKIE,
                           .dds = om_dds_default_def(),
                           .scene = scene,
                           .wait = 5,
                           .stale = 0.1,
                           .max_speed = 0.25,
                           .max_jump = 0.02,
                           .reach = 0.15,
                           .arm = {"PSM1", "PSM2"},
                           .endoscope = "endoscope",
                           .depth = "depth"};
}

// ---- frames -------------------------------------------------------------------------------------------------------

// Whether the network sent a pose: finite, with a quaternion of length 1.
static bool is_pose(OmPose p) {
    const double n = sqrt(p.q.x * p.q.x + p.q.y * p.q.y + p.q.z * p.q.z + p.q.w * p.q.w);
    return om_is_finite3(p.p) && fabs(n - 1) < UNIT;
}

static bool find_frame(const DdsWorld* w, const char* name, OmPose* pose) {
    *pose = om_pose_identity();
    if (strcmp(name, "world") == 0 || strcmp(name, "/world") == 0) return true;
    for (int i = 0; i < w->nframe; ++i)
        if (strcmp(w->frame[i].child, name) == 0) {
            *pose = w->frame[i].pose;
            return true;
        }
    return false;
}

// Frames whose parent is not known yet come again: tf_static is latched, and each message is whole.
static void take_frames(DdsWorld* w) {
    LinkMessage m;
    while (om__link_take(w->link, w->tf_static, &m))
        for (int i = 0; i < m.tf.n; ++i) {
            LinkFrame* f = &m.tf.frame[i];
            OmPose parent, old;
            if (!find_frame(w, f->parent, &parent) || w->nframe == MAX_FRAMES) continue;
            if (!is_pose(f->pose)) continue;
            if (strcmp(f->parent, "world") != 0) f->pose = om_pose_mul(parent, f->pose);
            if (!find_frame(w, f->child, &old)) w->frame[w->nframe++] = *f;
        }
}

// ---- messages of an arm -------------------------------------------------------------------------------------------

static OmStatus fail(DdsWorld* w, const char* format, ...) OM_PRINTF(2, 3);

// Every arm stops: a hold for each, no goal any more.
static void stop_all(DdsWorld* w) {
    for (int a = 0; a < w->head.narm; ++a) {
        Limb* l = &w->limb[a];
        l->is_moving = false;
        if (l->hold >= 0) (void)om__link_write(w->link, l->hold, &(LinkMessage){0});
    }
}

static OmStatus fail(DdsWorld* w, const char* format, ...) {
    va_list args;
    va_start(args, format);
    vsnprintf(w->failed, sizeof w->failed, format, args);
    va_end(args);
    stop_all(w);
    return om_error(OM_IO, "%s", w->failed);
}

// `is_late`: the messages waited while this program was busy, so they do not show that the robot lives.
static OmStatus take_pose(DdsWorld* w, Limb* l, bool is_late) {
    LinkMessage m;
    while (om__link_take(w->link, l->measured_cp, &m)) {
        const OmPose before = l->now.tip;
        if (m.time < l->stamp_cp) continue;  // out of order
        if (!l->has_cp || strcmp(l->frame, m.frame) != 0) {
            if (!find_frame(w, m.frame, &l->pose_world_frame)) continue;  // tf_static is on its way
            snprintf(l->frame, sizeof l->frame, "%s", m.frame);
        }
        if (!is_pose(m.pose))
            return fail(w, "%s: a measured pose is not finite, or its quaternion has not length 1",
                        l->name);
        const bool is_world = strcmp(l->frame, "world") == 0;
        l->now.tip = is_world ? m.pose : om_pose_mul(l->pose_world_frame, m.pose);
        // a message with the stamp of the last one may be an old one sent again
        if (!is_late && m.time > l->stamp_cp) l->heard = om_clock_now();
        const double jump = om_distance(before.p, l->now.tip.p);
        const double turn = om_quat_angle(before.q, l->now.tip.q);
        if (l->has_cp && l->is_ours && (jump > w->def.max_jump || turn > MAX_TURN))
            return fail(
                w, "%s: the measured pose jumped by %.0f mm and %.0f degrees; motion has stopped",
                l->name, 1e3 * jump, turn * 180 / OM_PI);
        l->has_cp = true;
        l->stamp_cp = m.time;
    }
    return OM_OK;
}

static bool is_finite_all(int n, const double* x) {
    for (int i = 0; i < n; ++i)
        if (!isfinite(x[i])) return false;
    return true;
}

static void take_joints(DdsWorld* w, Limb* l) {
    LinkMessage m;
    while (om__link_take(w->link, l->measured_js, &m)) {
        if (m.joints.nposition != OM_PSM_NJOINT || m.time < l->stamp_js) continue;
        if (!is_finite_all(OM_PSM_NJOINT, m.joints.position)) continue;
        memcpy(l->now.q, m.joints.position, sizeof l->now.q);
        l->stamp_js = m.time;
        l->has_js = true;
    }
    while (om__link_take(w->link, l->jaw_setpoint, &m))
        if (m.joints.nposition == 1 && isfinite(m.joints.position[0])) {
            l->now.jaw_goal = m.joints.position[0];
            l->stamp_jaw_goal = m.time;
        }
    while (om__link_take(w->link, l->jaw_measured, &m)) {
        if (m.joints.nposition != 1 || !isfinite(m.joints.position[0])) continue;
        l->now.jaw = m.joints.position[0];
        l->now.jaw_speed = m.joints.nvelocity == 1 ? m.joints.velocity[0] : 0;
        l->stamp_jaw = m.time;
        l->has_jaw = true;
    }
}

static void take_setpoint(DdsWorld* w, Limb* l) {
    LinkMessage m;
    while (om__link_take(w->link, l->setpoint_cp, &m)) {
        OmPose frame;
        // afterwards it is what we sent
        if (l->is_ours || !find_frame(w, m.frame, &frame) || !is_pose(m.pose)) continue;
        l->setpoint = strcmp(m.frame, "world") == 0 ? m.pose : om_pose_mul(frame, m.pose);
        l->has_setpoint = true;
    }
}

static OmStatus take_state(DdsWorld* w, Limb* l) {
    LinkMessage m;
    while (om__link_take(w->link, l->state, &m)) {
        snprintf(l->mode, sizeof l->mode, "%s", m.state.name);
        l->is_homed = m.state.is_homed;
        l->has_state = true;
    }
    if (l->is_ours && (strcmp(l->mode, "ENABLED") != 0 || !l->is_homed))
        return fail(w, "%s is %s%s; motion has stopped", l->name, l->mode,
                    l->is_homed ? "" : ", not homed");
    // std_msgs/String of a robot, crtk_msgs/StringStamped of a simulator; what was said before homing is past
    while (om__link_take(w->link, l->error, &m) || om__link_take(w->link, l->error_stamped, &m))
        if (l->is_ours) return fail(w, "%s reports an error: %s", l->name, m.text);
    return OM_OK;
}

static void take_wrench(DdsWorld* w, Limb* l) {
    LinkMessage m;
    while (om__link_take(w->link, l->wrench, &m)) {
        OmPose frame;
        if (!find_frame(w, m.frame, &frame)) continue;
        if (!om_is_finite3(m.wrench.force) || !om_is_finite3(m.wrench.torque)) continue;
        l->now.has_wrench = true;
        l->stamp_wrench = m.time;
        l->now.force = om_quat_rotate(frame.q, m.wrench.force);
        l->now.torque = om_quat_rotate(frame.q, m.wrench.torque);
    }
}

// A latched message comes once; the frame that it needs may come later.
static OmStatus take_tool(DdsWorld* w, int a) {
    Limb* l = &w->limb[a];
    LinkMessage m;
    char name[80];
    OmPose base;
    while (om__link_take(w->link, l->tool_type, &m))
        snprintf(l->tool, sizeof l->tool, "%.63s", m.text);
    const bool is_needle = strstr(l->tool, "LARGE_NEEDLE_DRIVER") != NULL;
    const bool is_known = is_needle || strstr(l->tool, "PROGRASP") || w->def.instrument_file;
    snprintf(name, sizeof name, "%s_base", l->name);
    if (w->head.psm[a] || !is_known || !find_frame(w, name, &base)) return OM_OK;
    l->psm = om_psm_default(is_needle ? OM_LARGE_NEEDLE_DRIVER : OM_PROGRASP, base);
    if (w->def.instrument_file) OM_TRY(om_psm_load_instrument(w->def.instrument_file, &l->psm));
    if (w->def.arm_file) OM_TRY(om_psm_load_arm(w->def.arm_file, &l->psm));
    OM_CHECK(l->psm.njoint == OM_PSM_NJOINT && l->psm.has_jaw, OM_UNAVAILABLE,
             "%s: an instrument of %d joints %s jaw: this loop needs six joints and a jaw",
             w->def.instrument_file, l->psm.njoint, l->psm.has_jaw ? "with a" : "without a");
    w->head.psm[a] = &l->psm;
    return OM_OK;
}

// ---- pictures -----------------------------------------------------------------------------------------------------

static OmStatus take_info(DdsWorld* w, Sight* s, const OmSceneCamera* as) {
    LinkMessage m;
    while (om__link_take(w->link, s->info, &m)) {
        OmCamera c = om_scene_camera_place(as, om_pose_identity());
        c.width = m.info.width, c.height = m.info.height;
        c.lens = m.info.lens;
        if (!(c.lens.fx > 0) || !find_frame(w, m.frame, &c.pose_world_camera)) continue;
        c.fov = 2 * atan(0.5 * c.height / c.lens.fy);
        if (om_camera_check(&c) < 0) continue;
        if (s->has_info && (c.width != s->camera.width || c.height != s->camera.height))
            return fail(
                w,
                "%s: pictures of %d x %d pixels have become %d x %d; motion has stopped: start again",
                om__link_name(w->link, s->info), s->camera.width, s->camera.height, c.width,
                c.height);
        s->camera = c;
        s->has_info = true;
        snprintf(s->frame, sizeof s->frame, "%s", m.frame);
    }
    return OM_OK;
}

static OmStatus take_image(DdsWorld* w) {
    Sight* s = &w->endoscope;
    LinkMessage m;
    while (om__link_take(w->link, s->data, &m)) {
        const LinkPicture* p = &m.picture;
        const bool is_rgb = strcmp(p->encoding, "rgb8") == 0;
        const int n = is_rgb ? 3 : 1;
        if (!is_rgb && strcmp(p->encoding, "mono8") != 0) continue;
        if (p->width != s->camera.width || p->height != s->camera.height || p->width < 1) continue;
        if (p->step < n * p->width || (size_t)p->step * (size_t)p->height > p->size) continue;
        om_picture_done(&s->picture.color);
        OM_TRY(om_picture_init(&s->picture.color, p->width, p->height, n));
        for (int row = 0; row < p->height; ++row)
            memcpy(s->picture.color.pixel + (size_t)row * (size_t)n * (size_t)p->width,
                   p->data + (size_t)row * (size_t)p->step, (size_t)n * (size_t)p->width);
        s->stamp = m.time;
    }
    return OM_OK;
}

static bool is_cloud_of(const LinkPicture* p, const OmCamera* c) {
    return p->width == c->width && p->height == c->height && !p->is_bigendian && p->z >= 0 &&
           p->point_step >= p->z + 4 && (p->rgb < 0 || p->point_step >= p->rgb + 4) &&
           p->step >= p->width * p->point_step && (size_t)p->step * (size_t)p->height <= p->size;
}

static OmStatus read_cloud(Sight* s, const LinkPicture* p) {
    OmDepthPicture* d = &s->depth;
    const size_t n = (size_t)p->width * (size_t)p->height;
    if (!d->depth) OM_ALLOC(d->depth, n);
    if (p->rgb >= 0 && !d->color.pixel) OM_TRY(om_picture_init(&d->color, p->width, p->height, 3));
    for (int row = 0, i = 0; row < p->height; ++row)
        for (int column = 0; column < p->width; ++column, ++i) {
            const unsigned char* at =
                p->data + (size_t)row * (size_t)p->step + (size_t)column * (size_t)p->point_step;
            float z;
            uint32_t rgb;
            memcpy(&z, at + p->z, sizeof z);
            d->depth[i] = z > 0 && isfinite(z) ? z : 0.0f;
            if (p->rgb < 0) continue;
            memcpy(&rgb, at + p->rgb, sizeof rgb);
            unsigned char* c = d->color.pixel + 3 * (size_t)i;
            c[0] = (unsigned char)(rgb >> 16), c[1] = (unsigned char)(rgb >> 8);
            c[2] = (unsigned char)rgb;
        }
    return OM_OK;
}

// Bytes of a pixel of a depth image (REP 118): m as float32, or mm as uint16; 0: it is none.
static int depth_bytes(const LinkPicture* p) {
    if (p->is_bigendian) return 0;
    return strcmp(p->encoding, "32FC1") == 0 ? 4 : strcmp(p->encoding, "16UC1") == 0 ? 2 : 0;
}

static bool is_depth_of(const LinkPicture* p, const OmCamera* c) {
    const int n = depth_bytes(p);
    return n > 0 && p->width == c->width && p->height == c->height && p->step >= n * p->width &&
           (size_t)p->step * (size_t)p->height <= p->size;
}

static float depth_at(const unsigned char* at, int nbyte) {
    float z = 0;
    uint16_t mm = 0;
    if (nbyte == 2) memcpy(&mm, at, sizeof mm);
    if (nbyte == 4) memcpy(&z, at, sizeof z);
    if (nbyte == 2) z = 1e-3f * (float)mm;
    return z > 0 && isfinite(z) ? z : 0.0f;
}

static OmStatus read_depth(Sight* s, const LinkPicture* p) {
    const int n = depth_bytes(p);
    if (!s->depth.depth) OM_ALLOC(s->depth.depth, (size_t)p->width * (size_t)p->height);
    for (int row = 0, i = 0; row < p->height; ++row)
        for (int column = 0; column < p->width; ++column, ++i)
            s->depth.depth[i] = depth_at(p->data + (size_t)row * (size_t)p->step + n * column, n);
    return OM_OK;
}

static OmStatus take_depth(DdsWorld* w) {
    Sight* s = &w->depth;
    LinkMessage m;
    while (s->image >= 0 && om__link_take(w->link, s->image, &m)) {
        if (!s->has_info || w->has_points) continue;
        if (!is_depth_of(&m.picture, &s->camera))
            return fail(
                w,
                "%s: %d x %d pixels of \"%s\"; it must be 32FC1 or 16UC1, little endian, with the %d x %d "
                "pixels of camera_info",
                om__link_name(w->link, s->image), m.picture.width, m.picture.height,
                m.picture.encoding, s->camera.width, s->camera.height);
        OM_TRY(read_depth(s, &m.picture));
        s->stamp = m.time;
    }
    return OM_OK;
}

static OmStatus take_cloud(DdsWorld* w) {
    Sight* s = &w->depth;
    LinkMessage m;
    while (om__link_take(w->link, s->data, &m)) {
        if (!s->has_info) continue;
        if (!is_cloud_of(&m.picture, &s->camera))
            return fail(
                w,
                "%s: a cloud of %d x %d points; it must have a point for each of the %d x %d pixels "
                "of camera_info, in rows, with x, y, z as float32",
                om__link_name(w->link, s->data), m.picture.width, m.picture.height, s->camera.width,
                s->camera.height);
        OM_TRY(read_cloud(s, &m.picture));
        s->stamp = m.time;
    }
    return OM_OK;
}

// ---- all messages -------------------------------------------------------------------------------------------------

static OmStatus take_messages(DdsWorld* w, bool is_late) {
    take_frames(w);
    for (int a = 0; a < w->head.narm; ++a) {
        Limb* l = &w->limb[a];
        OM_TRY(take_tool(w, a));
        OM_TRY(take_pose(w, l, is_late));
        take_joints(w, l);
        take_setpoint(w, l);
        take_wrench(w, l);
        OM_TRY(take_state(w, l));
    }
    OM_TRY(take_info(w, &w->endoscope, &w->def.scene->endoscope));
    OM_TRY(take_info(w, &w->depth, &w->def.scene->rgbd));
    OM_TRY(take_image(w));
    OM_TRY(take_depth(w));
    return take_cloud(w);
}

// Whether every arm was heard since a time of the wall clock.
static bool is_heard(const DdsWorld* w, double since) {
    for (int a = 0; a < w->head.narm; ++a)
        if (w->limb[a].heard < since) return false;
    return true;
}

// Take what has come. After a pause of this program the messages that wait are old: new ones must come before the arms
// count as heard.
static OmStatus take_all(DdsWorld* w) {
    const double now = om_clock_now();
    const bool is_late = !w->is_lock_step && now - w->taken > w->def.stale;
    OmStatus status = take_messages(w, is_late);
    while (is_late && status >= 0 && !is_heard(w, now) && om_clock_now() < now + w->def.stale) {
        om__link_wait(w->link, 0.01);
        status = take_messages(w, false);
    }
    w->taken = om_clock_now();
    return status;
}

// A person's Ctrl-C: the arms stop first.
static OmStatus check_stop(DdsWorld* w) {
    const OmStatus status = om_stop_poll();
    if (status < 0) stop_all(w);
    return status;
}

static OmStatus check_alive(DdsWorld* w) {
    const double now = om_clock_now();
    for (int a = 0; a < w->head.narm; ++a) {
        const Limb* l = &w->limb[a];
        if (om__link_count(w->link, l->measured_cp) == 0)
            return fail(w, "%s: the robot is gone; motion has stopped", l->name);
        const int nrobot = om__link_count(w->link, l->state);
        if (nrobot > 1)
            return fail(w,
                        "%s: %d robots answer on domain %d; motion has stopped: give each a domain",
                        l->name, nrobot, w->def.dds.domain);
        if (!w->is_lock_step && now - l->heard > w->def.stale)
            return fail(w, "%s/measured_cp: nothing for %.2f s, at most %.2f s; motion has stopped",
                        l->name, now - l->heard, w->def.stale);
    }
    return OM_OK;
}

static OmStatus check_failed(const DdsWorld* w) {
    OM_CHECK(!w->failed[0], OM_IO, "%s", w->failed);
    return OM_OK;
}

// ---- lock-step ----------------------------------------------------------------------------------------------------

static bool is_at(double stamp, double time) { return stamp >= time - SAME_TIME; }

// All that follows a tick is there.
static bool has_answers(const DdsWorld* w, unsigned what, double time) {
    for (int a = 0; a < w->head.narm; ++a) {
        const Limb* l = &w->limb[a];
        if (!is_at(l->stamp_cp, time) || !is_at(l->stamp_js, time) || !is_at(l->stamp_jaw, time) ||
            !is_at(l->stamp_jaw_goal, time) || (l->now.has_wrench && !is_at(l->stamp_wrench, time)))
            return false;
    }
    if (what & OM_OBSERVE_IMAGE && !is_at(w->endoscope.stamp, time)) return false;
    return !(what & (OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR)) || is_at(w->depth.stamp, time);
}

// Let the robot advance by dt (0: not), and wait for the answers.
static OmStatus make_tick(DdsWorld* w, double dt, unsigned what) {
    const double begin = om_clock_now();
    LinkMessage m = {.tick = {.client = w->client,
                              .number = ++w->number,
                              .ncommand = w->ncommand,
                              .what = what,
                              .dt = dt}};
    OM_TRY(om__link_write(w->link, w->tick_out, &m));
    double time = NAN;
    while (isnan(time) || !has_answers(w, what, time)) {
        OM_TRY(check_stop(w));
        om__link_wait(w->link, 0.1);
        while (om__link_take(w->link, w->tick_in, &m)) {
            if (m.tick.client != w->client || m.tick.number != w->number) continue;
            if (m.tick.error[0]) return fail(w, "the robot's simulation: %s", m.tick.error);
            time = m.time;
        }
        OM_TRY(take_all(w));
        OM_TRY(check_alive(w));
        if (om_clock_now() - begin > TICK_TIME)
            return fail(w, "the robot makes no tick for %.0f s; motion has stopped", TICK_TIME);
    }
    w->time = time;
    return OM_OK;
}

// ---- motion -------------------------------------------------------------------------------------------------------

static OmStatus write_command(DdsWorld* w, int id, const LinkMessage* m) {
    ++w->ncommand;
    return om__link_write(w->link, id, m);
}

static void dds_stop(OmWorld* world, int index) {
    DdsWorld* w = (DdsWorld*)world;
    w->limb[index].goal = w->limb[index].setpoint;
    w->limb[index].is_moving = false;
}

// A box around the tissue, down to its underside.
static OmStatus check_workspace(const DdsWorld* w, const Limb* l, OmVec3 p_world) {
    const OmSite* site = w->def.site;
    if (!site) return OM_OK;
    const OmVec3 half = site->half_size;
    const OmVec3 p = om_pose_apply(om_pose_inverse(site->pose_world_task), p_world);
    const bool is_in = fabs(p.x) <= half.x + w->def.reach && fabs(p.y) <= half.y + w->def.reach &&
                       p.z >= -0.01 && p.z <= 2 * half.z + w->def.reach;
    OM_CHECK(is_in, OM_INVALID,
             "%s: point (%.0f, %.0f, %.0f) mm of the tissue's frame is outside of the workspace, "
             "%.0f mm around the tissue",
             l->name, 1e3 * p.x, 1e3 * p.y, 1e3 * p.z, 1e3 * w->def.reach);
    return OM_OK;
}

static OmStatus check_ours(const DdsWorld* w, const Limb* l) {
    OM_TRY(check_failed(w));
    OM_CHECK(l->is_ours, OM_INVALID, "%s: call om_world_reset first, which homes the arms",
             l->name);
    return OM_OK;
}

static OmStatus dds_move(OmWorld* world, int index, OmPose goal, double speed) {
    DdsWorld* w = (DdsWorld*)world;
    Limb* l = &w->limb[index];
    double q[OM_PSM_NJOINT];
    OM_TRY(check_ours(w, l));
    OM_CHECK(speed <= w->def.max_speed, OM_INVALID,
             "%s: a speed of %.0f mm/s; this world's limit is %.0f", l->name, 1e3 * speed,
             1e3 * w->def.max_speed);
    OM_TRY(check_workspace(w, l, goal.p));
    if (world->psm[index]) {
        const OmStatus status = om_psm_inverse(&l->psm, goal, l->q, q);
        if (status < 0) return om_error_prefix(status, "%s", l->name);
    }
    l->goal = goal;
    l->speed = speed;
    l->is_moving = true;
    return OM_OK;
}

static OmStatus dds_set_jaw(OmWorld* world, int index, double angle) {
    DdsWorld* w = (DdsWorld*)world;
    Limb* l = &w->limb[index];
    LinkMessage m = {.time = w->time, .joints = {.nname = 1, .nposition = 1}};
    OM_TRY(check_ours(w, l));
    snprintf(m.joints.name[0], sizeof m.joints.name[0], "jaw");
    m.joints.position[0] = angle;
    return write_command(w, l->jaw_move, &m);
}

static OmStatus send_goal(DdsWorld* w, int index, double dt) {
    Limb* l = &w->limb[index];
    if (!l->is_moving) return OM_OK;
    bool is_there;
    const OmPose next = om_world_straight_step(l->setpoint, l->goal, l->speed, dt, &is_there);
    l->is_moving = !is_there;
    // The goal is in reach, but a point of the path may be out of reach: the arm then stops.
    if (w->head.psm[index] && om_psm_inverse(&l->psm, next, l->q, l->q) < 0) {
        dds_stop(&w->head, index);
        return OM_OK;
    }
    l->setpoint = next;
    LinkMessage m = {.time = w->time};
    snprintf(m.frame, sizeof m.frame, "%s", l->frame);
    const bool is_world = strcmp(l->frame, "world") == 0;
    m.pose = is_world ? next : om_pose_mul(om_pose_inverse(l->pose_world_frame), next);
    return write_command(w, l->servo_cp, &m);
}

// Take messages until a time of the wall clock.
static OmStatus take_until(DdsWorld* w, double time) {
    do {
        OM_TRY(check_stop(w));
        om__link_wait(w->link, time - om_clock_now());
        OM_TRY(take_all(w));
    } while (om_clock_now() < time);
    return OM_OK;
}

// An arm that does not go where it is sent: goals that are refused, another client, an emergency stop.
static OmStatus check_follows(DdsWorld* w) {
    for (int a = 0; a < w->head.narm; ++a) {
        const Limb* l = &w->limb[a];
        const double behind = om_distance(l->setpoint.p, l->now.tip.p);
        if (l->is_ours && behind > w->def.max_jump)
            return fail(
                w,
                "%s is measured %.0f mm from where it was sent, at most %.0f mm; motion has stopped",
                l->name, 1e3 * behind, 1e3 * w->def.max_jump);
    }
    return OM_OK;
}

static OmStatus dds_advance(OmWorld* world, double dt) {
    DdsWorld* w = (DdsWorld*)world;
    OM_TRY(check_failed(w));
    OM_TRY(take_all(w));
    OM_TRY(check_alive(w));
    OM_TRY(check_follows(w));
    for (int a = 0; a < world->narm; ++a) OM_TRY(send_goal(w, a, dt));
    if (w->is_lock_step) return make_tick(w, dt, 0);
    const double now = om_clock_now();
    // after a pause, or where the program is slower than time: no hurry
    if (w->next < now - dt) w->next = now;
    w->next += dt;
    OM_TRY(take_until(w, w->next));
    OM_TRY(check_alive(w));
    w->time = w->limb[0].stamp_cp;
    return OM_OK;
}

// ---- observation --------------------------------------------------------------------------------------------------

// Pictures not older than `since` (s of the robot's clock).
static bool has_pictures(const DdsWorld* w, unsigned what, double since) {
    return (!(what & OM_OBSERVE_IMAGE) || w->endoscope.stamp >= since) &&
           (!(what & (OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR)) || w->depth.stamp >= since);
}

// Until there are pictures of now: young ones, or ones that were taken since the arms have held for them, however long
// they were on their way. A robot's controller must not act on what was.
static OmStatus wait_for_pictures(DdsWorld* w, unsigned what) {
    const double end = om_clock_now() + PICTURE_TIME, held = w->limb[0].stamp_cp;
    if (!(what & (OM_OBSERVE_IMAGE | OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR))) return OM_OK;
    if (w->is_lock_step) return make_tick(w, 0, what);
    while (!has_pictures(w, what, fmin(held, w->limb[0].stamp_cp - NEW_PICTURE))) {
        const int depth = w->has_points ? w->depth.data : w->depth.image;
        if (om_clock_now() > end)
            return fail(w, "%s: no new picture within %.0f s; motion has stopped",
                        om__link_name(w->link, what & OM_OBSERVE_IMAGE ? w->endoscope.data : depth),
                        PICTURE_TIME);
        OM_TRY(check_stop(w));
        om__link_wait(w->link, 0.01);
        OM_TRY(take_all(w));
        OM_TRY(check_alive(w));
        w->time = w->limb[0].stamp_cp;
    }
    return OM_OK;
}

static double time_of(const DdsWorld* w, double stamp) {
    return fabs(stamp - w->time) < SAME_TIME ? w->time : stamp;
}

static OmStatus copy_picture(const OmPicture* from, OmPicture* to) {
    if (!from->pixel) return OM_OK;
    OM_TRY(om_picture_init(to, from->width, from->height, from->nchannel));
    memcpy(to->pixel, from->pixel,
           (size_t)from->width * (size_t)from->height * (size_t)from->nchannel);
    return OM_OK;
}

static OmStatus copy_depth(const DdsWorld* w, unsigned what, OmDepthPicture* to) {
    const Sight* s = &w->depth;
    const size_t n = (size_t)s->camera.width * (size_t)s->camera.height;
    OM_ALLOC(to->depth, n);
    memcpy(to->depth, s->depth.depth, n * sizeof *to->depth);
    to->camera = s->camera;
    to->time = time_of(w, s->stamp);
    return what & OM_OBSERVE_COLOR ? copy_picture(&s->depth.color, &to->color) : OM_OK;
}

static OmStatus dds_observe(OmWorld* world, unsigned what, OmObservation* obs) {
    DdsWorld* w = (DdsWorld*)world;
    om_observation_done(obs);
    OM_TRY(check_failed(w));
    OM_TRY(take_all(w));
    OM_TRY(wait_for_pictures(w, what));
    obs->time = w->time;
    obs->narm = world->narm;
    for (int a = 0; a < world->narm; ++a) {
        const Limb* l = &w->limb[a];
        obs->arm[a] = l->now;
        obs->arm[a].time = time_of(w, l->stamp_cp);
        obs->arm[a].is_moving = l->is_moving;
    }
    OmStatus status = OM_OK;
    if (what & OM_OBSERVE_IMAGE) {
        obs->endoscope.time = time_of(w, w->endoscope.stamp);
        obs->endoscope.camera = w->endoscope.camera;
        status = copy_picture(&w->endoscope.picture.color, &obs->endoscope.color);
    }
    if (status == OM_OK && what & (OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR))
        status = copy_depth(w, what, &obs->rgbd);
    if (status < 0) om_observation_done(obs);
    return status;
}

// ---- begin --------------------------------------------------------------------------------------------------------

// The first arm that is not enabled and homed; null: none.
static const Limb* find_unhomed(const DdsWorld* w) {
    for (int a = 0; a < w->head.narm; ++a)
        if (strcmp(w->limb[a].mode, "ENABLED") != 0 || !w->limb[a].is_homed) return &w->limb[a];
    return NULL;
}

// Home the arms that are not; the tissue is as a person has prepared it.
static OmStatus dds_reset(OmWorld* world) {
    DdsWorld* w = (DdsWorld*)world;
    OM_TRY(check_failed(w));
    OM_TRY(take_all(w));
    for (int a = 0; a < world->narm; ++a) {
        Limb* l = &w->limb[a];
        LinkMessage m = {.time = w->time};
        const bool is_paused = strcmp(l->mode, "PAUSED") == 0,
                   is_fault = strcmp(l->mode, "FAULT") == 0;
        OM_CHECK(!is_paused && !is_fault, OM_INVALID,
                 "%s is %s: send it state_command \"%s\", then run again", l->name, l->mode,
                 is_fault ? "clear_fault" : "resume");
        snprintf(m.text, sizeof m.text, "home");
        if (strcmp(l->mode, "ENABLED") != 0 || !l->is_homed)
            OM_TRY(write_command(w, l->state_command, &m));
    }
    const double end = om_clock_now() + HOME_TIME;
    for (const Limb* l; (l = find_unhomed(w));) {
        OM_TRY(check_stop(w));
        om__link_wait(w->link, 0.05);
        OM_TRY(take_all(w));
        OM_TRY(check_alive(w));
        if (om_clock_now() > end)
            return fail(w, "%s is not homed after %.0f s: it is %s; home it by its own console",
                        l->name, HOME_TIME, l->mode);
    }
    if (w->is_lock_step) OM_TRY(make_tick(w, 0, 0));
    for (int a = 0; a < world->narm; ++a) {
        Limb* l = &w->limb[a];
        if (!l->has_setpoint) l->setpoint = l->now.tip;
        memcpy(l->q, l->now.q, sizeof l->q);
        l->goal = l->setpoint;
        l->is_ours = true;
    }
    OM_TRY(check_follows(w));
    w->next = om_clock_now();
    return OM_OK;
}

static void dds_destroy(OmWorld* world) {
    DdsWorld* w = (DdsWorld*)world;
    om__link_destroy(w->link);
    om_picture_done(&w->endoscope.picture.color);
    om_picture_done(&w->depth.depth.color);
    om_free(w->depth.depth.depth);
    om_free(w);
}

static const OmWorldOps dds_ops = {.destroy = dds_destroy,
                                   .move = dds_move,
                                   .set_jaw = dds_set_jaw,
                                   .stop = dds_stop,
                                   .advance = dds_advance,
                                   .observe = dds_observe,
                                   .reset = dds_reset};

typedef struct Topic {
    size_t offset;
    unsigned flags;
    LinkType type;
    const char* name;
    int depth;
} Topic;

static const Topic limb_topic[] = {
    {offsetof(Limb, measured_cp), LINK_IN, LINK_POSE, "measured_cp", 5},
    {offsetof(Limb, measured_js), LINK_IN, LINK_JOINTS, "measured_js", 5},
    {offsetof(Limb, setpoint_cp), LINK_IN, LINK_POSE, "setpoint_cp", 5},
    {offsetof(Limb, jaw_measured), LINK_IN, LINK_JOINTS, "jaw/measured_js", 5},
    {offsetof(Limb, jaw_setpoint), LINK_IN, LINK_JOINTS, "jaw/setpoint_js", 5},
    {offsetof(Limb, wrench), LINK_IN, LINK_WRENCH, "spatial/measured_cf", 5},
    {offsetof(Limb, state), LINK_IN | LINK_LATCHED, LINK_STATE, "operating_state", 10},
    {offsetof(Limb, error), LINK_IN, LINK_STRING, "error", 10},
    {offsetof(Limb, error_stamped), LINK_IN, LINK_STAMPED, "error", 10},
    {offsetof(Limb, tool_type), LINK_IN | LINK_LATCHED, LINK_STRING, "tool_type", 1},
    {offsetof(Limb, state_command), LINK_OUT, LINK_STAMPED, "state_command", 10},
    {offsetof(Limb, servo_cp), LINK_OUT, LINK_POSE, "servo_cp", 10},
    {offsetof(Limb, jaw_move), LINK_OUT, LINK_JOINTS, "jaw/move_jp", 10},
    {offsetof(Limb, hold), LINK_OUT, LINK_EMPTY, "hold", 1},
};

static OmStatus add_camera(DdsWorld* w, const char* camera, const char* leaf, LinkType type,
                           int* id) {
    char name[120];
    snprintf(name, sizeof name, "%s/%s", camera, leaf);
    return om__link_add(w->link, LINK_IN, type, name, 1, id);
}

static OmStatus add_all(DdsWorld* w) {
    char name[120];
    for (int a = 0; a < w->head.narm; ++a)
        for (size_t k = 0; k < sizeof limb_topic / sizeof *limb_topic; ++k) {
            const Topic* t = &limb_topic[k];
            snprintf(name, sizeof name, "%s/%s", w->limb[a].name, t->name);
            OM_TRY(om__link_add(w->link, t->flags, t->type, name, t->depth,
                                (int*)(void*)((char*)&w->limb[a] + t->offset)));
        }
    Link* l = w->link;
    const unsigned latched = LINK_IN | LINK_LATCHED;
    OM_TRY(om__link_add(l, latched, LINK_TF, "tf_static", 10, &w->tf_static));
    OM_TRY(add_camera(w, w->def.endoscope, "camera_info", LINK_INFO, &w->endoscope.info));
    OM_TRY(add_camera(w, w->def.endoscope, "image_raw", LINK_IMAGE, &w->endoscope.data));
    OM_TRY(add_camera(w, w->def.depth, "camera_info", LINK_INFO, &w->depth.info));
    OM_TRY(add_camera(w, w->def.depth, "points", LINK_CLOUD, &w->depth.data));
    OM_TRY(om__link_add(l, LINK_OUT, LINK_TICK, "omentum/tick", 10, &w->tick_out));
    return om__link_add(l, LINK_IN, LINK_TOCK, "omentum/tock", 10, &w->tick_in);
}

// The first thing that is missing, in `text`, and whether it is the depth camera's picture, which comes last.
// @return false: nothing is
static bool find_missing(const DdsWorld* w, char* text, size_t size, bool* is_last) {
    *is_last = false;
    for (int a = 0; a < w->head.narm; ++a) {
        const Limb* l = &w->limb[a];
        const struct {
            bool has;
            const char* name;
        } need[] = {{l->has_cp, "measured_cp"},        {l->has_js, "measured_js"},
                    {l->has_jaw, "jaw/measured_js"},   {l->has_setpoint, "setpoint_cp"},
                    {l->has_state, "operating_state"}, {w->head.psm[a], "tool_type"}};
        for (size_t k = 0; k < sizeof need / sizeof *need; ++k)
            if (!need[k].has) {
                snprintf(text, size, "%s/%s", l->name, need[k].name);
                return true;
            }
    }
    const Sight *d = &w->depth, *e = &w->endoscope;
    if (!d->has_info || !e->has_info) {
        snprintf(text, size, "%s", om__link_name(w->link, d->has_info ? e->info : d->info));
        return true;
    }
    const bool has_image = d->image >= 0 && om__link_count(w->link, d->image) > 0;
    *is_last = !has_image && om__link_count(w->link, d->data) == 0;
    snprintf(text, size, "%s/points or /%s/image_raw", w->def.depth, w->def.depth);
    return *is_last;
}

// Cameras often send without reliability.
static OmStatus relax(DdsWorld* w) {
    const int topic[] = {w->endoscope.info, w->endoscope.data, w->depth.info, w->depth.data,
                         w->depth.image};
    for (size_t k = 0; k < sizeof topic / sizeof *topic; ++k)
        if (topic[k] >= 0) OM_TRY(om__link_relax(w->link, topic[k]));
    return OM_OK;
}

static OmStatus wait_for_robot(DdsWorld* w) {
    char missing[200];
    bool is_missing = true, is_last;
    const double end = om_clock_now() + w->def.wait;
    double since = INFINITY;  // when all but the depth camera's picture was there
    while (is_missing) {
        OM_TRY(om_stop_poll());
        om__link_wait(w->link, 0.02);
        OM_TRY(take_all(w));
        OM_TRY(relax(w));
        is_missing = find_missing(w, missing, sizeof missing, &is_last);
        since = is_last ? fmin(since, om_clock_now()) : (double)INFINITY;
        if (w->depth.image < 0 && om_clock_now() > since + GRACE)
            OM_TRY(add_camera(w, w->def.depth, "image_raw", LINK_IMAGE, &w->depth.image));
        if (!is_missing || om_clock_now() < end) continue;
        for (int a = 0; a < w->head.narm; ++a)
            OM_CHECK(
                w->head.psm[a] || !w->limb[a].tool[0] || !strstr(missing, "tool_type"),
                OM_UNAVAILABLE,
                "%s has the instrument \"%s\": give its file of the dVRK by --instrument, and that "
                "of its arm by --arm; or /tf_static lacks %s_base",
                w->limb[a].name, w->limb[a].tool, w->limb[a].name);
        bool has_frame = w->nframe > 0;
        return om_error(OM_UNAVAILABLE,
                        "nothing usable on topic /%s of domain %d after %.0f s%s: " HINT
                        "; a ROS 2 side with rmw_zenoh is not heard, it needs "
                        "RMW_IMPLEMENTATION=rmw_cyclonedds_cpp",
                        missing, w->def.dds.domain, w->def.wait,
                        has_frame ? "" : ", and no frames on /tf_static");
    }
    const double grace = om_clock_now() + GRACE;
    while (om__link_count(w->link, w->tick_out) == 0 && om_clock_now() < grace) {
        om__link_wait(w->link, 0.02);
        OM_TRY(take_all(w));
    }
    w->is_lock_step = om__link_count(w->link, w->tick_out) > 0;
    w->has_points = om__link_count(w->link, w->depth.data) > 0;
    w->head.sources = OM_OBSERVE_IMAGE | OM_OBSERVE_DEPTH | (w->has_points ? OM_OBSERVE_COLOR : 0);
    w->head.waits = w->is_lock_step;
    return w->is_lock_step ? make_tick(w, 0, 0) : OM_OK;
}

static OmStatus check_def(const OmDdsWorldDef* def) {
    OM_CHECK(def->cookie == COOKIE, OM_INVALID, "OmDdsWorldDef was not made by default_def");
    OM_CHECK(def->scene, OM_INVALID, "OmDdsWorldDef.scene is null");
    OM_CHECK(def->wait > 0 && def->stale > 0 && def->max_speed > 0 && def->max_jump > 0 &&
                 def->reach > 0,
             OM_INVALID, "OmDdsWorldDef: wait, stale, max_speed, max_jump and reach are above 0");
    OM_CHECK(def->nframe >= 0 && def->nframe <= OM_DDS_MAX_FRAME && (def->frame || !def->nframe),
             OM_INVALID, "OmDdsWorldDef.nframe is %d; 0 to %d", def->nframe, OM_DDS_MAX_FRAME);
    const int narm = def->scene->world.narm;
    OM_CHECK(narm >= 1 && narm <= OM_MAX_ARM, OM_INVALID, "world: %d arms; 1 to %d", narm,
             OM_MAX_ARM);
    for (int a = 0; a < narm; ++a)
        OM_CHECK(om__link_is_name(def->arm[a], NAME), OM_INVALID,
                 "OmDdsWorldDef.arm[%d] is no name", a);
    OM_CHECK(om__link_is_name(def->endoscope, NAME) && om__link_is_name(def->depth, NAME),
             OM_INVALID, "OmDdsWorldDef.endoscope or depth is no name");
    return OM_OK;
}

OmStatus om_world_create_dds(const OmDdsWorldDef* def, OmWorld** world) {
    *world = NULL;
    OM_TRY(check_def(def));
    DdsWorld* w = om_calloc(1, sizeof *w);
    if (!w) return OM_NO_MEMORY;
    w->def = *def;
    w->head = (OmWorld){.ops = &dds_ops, .narm = def->scene->world.narm};
    w->endoscope.stamp = w->depth.stamp = -INFINITY;
    w->endoscope.image = w->depth.image = -1;
    w->taken = om_clock_now();
    // a number that another client hardly has
    w->client = (uint32_t)(1e6 * fmod(om_clock_now(), 4000)) | 1u;
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        w->limb[a].name = def->arm[a];
        w->limb[a].hold = -1;
        w->limb[a].heard = om_clock_now();
        w->limb[a].stamp_cp = w->limb[a].stamp_js = w->limb[a].stamp_jaw = -INFINITY;
        w->limb[a].stamp_jaw_goal = w->limb[a].stamp_wrench = -INFINITY;
    }
    for (int i = 0; i < def->nframe; ++i) {
        LinkFrame* f = &w->frame[w->nframe++];
        snprintf(f->child, sizeof f->child, "%s", def->frame[i].name);
        f->pose = def->frame[i].pose_world_frame;
    }
    OmStatus status = om__link_create(&def->dds, &w->link);
    if (status == OM_OK) status = add_all(w);
    if (status == OM_OK) status = wait_for_robot(w);
    if (status < 0)
        dds_destroy(&w->head);
    else
        *world = &w->head;
    return status;
}
