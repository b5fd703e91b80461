// dds_link.c: the only file that includes Cyclone DDS and the types that idlc makes of dds_types.idl.
//
// Topics have ROS 2's names: rt/NAME, and types pkg::msg::dds_::Name_. Each reader and writer carries the hash of its
// type in USER_DATA, "typehash=RIHS01_...;", by which ROS 2 from Iron on recognises the type. All of it is reliable,
// as ROS 2 has it by default. A conversion between a message of DDS and a LinkMessage is a pair of functions, pack and
// unpack; type_table names them. Buffers of a packed message belong to the LinkMessage (_release is false).
//
// Settings of the domain: without CYCLONEDDS_URI and without a network or peers, the loopback interface without
// multicast, which is what ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST does. Fragments are large there: a picture in
// packets of 8 kB overflows the receive buffer of a socket.
#include "dds/dds_link.h"

#define asm __asm__  // ddsrt uses the name that C17 does not have
#include <dds/dds.h>
#include <dds/ddsi/ddsi_cdrstream.h>
#undef asm
#include <dds_types.h>
#include <stdlib.h>
#include <string.h>

#include "base/base_grow.h"
#include "dds/dds_tape.h"

#define COOKIE 0xdd5001u
#define MAX_SEQUENCE 65536
#define MAX_READER 64  // of a writer that are looked at

typedef builtin_interfaces_msg_dds__Time_ Time;
typedef std_msgs_msg_dds__Header_ Header;
typedef sensor_msgs_msg_dds__JointState_ JointState;
typedef geometry_msgs_msg_dds__PoseStamped_ PoseStamped;
typedef geometry_msgs_msg_dds__TwistStamped_ TwistStamped;
typedef geometry_msgs_msg_dds__WrenchStamped_ WrenchStamped;
typedef std_msgs_msg_dds__String_ String;
typedef std_msgs_msg_dds__Empty_ Empty;
typedef std_msgs_msg_dds__Float64_ Float64;
typedef std_msgs_msg_dds__Bool_ Bool;
typedef crtk_msgs_msg_dds__StringStamped_ StringStamped;
typedef crtk_msgs_msg_dds__OperatingState_ OperatingState;
typedef rosgraph_msgs_msg_dds__Clock_ Clock;
typedef geometry_msgs_msg_dds__TransformStamped_ TransformStamped;
typedef tf2_msgs_msg_dds__TFMessage_ TfMessage;
typedef sensor_msgs_msg_dds__CameraInfo_ CameraInfo;
typedef sensor_msgs_msg_dds__Image_ Image;
typedef sensor_msgs_msg_dds__PointField_ PointField;
typedef sensor_msgs_msg_dds__PointCloud2_ PointCloud2;
typedef omentum_msgs_msg_dds__Tick_ Tick;
typedef omentum_msgs_msg_dds__Tock_ Tock;

typedef union Packed {
    JointState joints;
    PoseStamped pose;
    TwistStamped twist;
    WrenchStamped wrench;
    String string;
    Empty empty;
    Float64 number;
    Bool is_on;
    StringStamped stamped;
    OperatingState state;
    Clock clock;
    TfMessage tf;
    CameraInfo info;
    Image image;
    PointCloud2 cloud;
    Tick tick;
    Tock tock;
} Packed;

typedef struct Scratch {  // that a packed message points to
    char* name[LINK_MAX_JOINT];
    TransformStamped transform[LINK_MAX_FRAME];
    PointField field[LINK_MAX_FIELD];
    double d[5];
} Scratch;

typedef struct Endpoint {
    char name[120];
    LinkType type;
    bool is_reader;
    unsigned flags;
    int depth;
    dds_entity_t entity, topic;
    int channel;          // of the recording; -1: not recorded
    unsigned char* data;  // of the last picture taken
    size_t capacity;
} Endpoint;

struct Link {
    dds_entity_t domain, participant, waitset;  // domain 0: another link of this process has it
    Endpoint* end;
    int nend, capacity;
    Tape* tape;  // null: no recording
    bool records_pictures;
};

// ---- conversions ------------------------------------------------------------------------------------------------

static Time time_of(double t) {
    const double sec = floor(t);
    int64_t nano = (int64_t)llround(1e9 * (t - sec));
    const int64_t carry = nano >= 1000000000;
    return (Time){.sec = (int32_t)((int64_t)sec + carry),
                  .nanosec = (uint32_t)(nano - carry * 1000000000)};
}

static double seconds_of(Time t) { return (double)t.sec + 1e-9 * (double)t.nanosec; }

static Header header_of(const LinkMessage* m) {
    return (Header){.stamp = time_of(m->time), .frame_id = (char*)(uintptr_t)m->frame};
}

static void copy_text(char* to, size_t size, const char* from) {
    snprintf(to, size, "%s", from ? from : "");
}

static void unpack_header(const Header* h, LinkMessage* m) {
    m->time = seconds_of(h->stamp);
    copy_text(m->frame, sizeof m->frame, h->frame_id);
}

static dds_sequence_double doubles(const double* x, int n) {
    return (dds_sequence_double){
        ._maximum = (uint32_t)n, ._length = (uint32_t)n, ._buffer = (double*)(uintptr_t)x};
}

static int copy_doubles(const dds_sequence_double* s, double* x, int room) {
    for (int i = 0; i < room && i < (int)s->_length; ++i) x[i] = s->_buffer[i];
    return s->_length < MAX_SEQUENCE ? (int)s->_length : MAX_SEQUENCE;
}

static void pack_joints(const LinkMessage* m, Scratch* s, Packed* p) {
    const LinkJoints* j = &m->joints;
    for (int i = 0; i < j->nname; ++i) s->name[i] = (char*)(uintptr_t)j->name[i];
    p->joints = (JointState){
        .header = header_of(m),
        .name = {._maximum = (uint32_t)j->nname, ._length = (uint32_t)j->nname, ._buffer = s->name},
        .position = doubles(j->position, j->nposition),
        .velocity = doubles(j->velocity, j->nvelocity),
        .effort = doubles(j->effort, j->neffort)};
}

static void unpack_joints(const Packed* p, LinkMessage* m) {
    LinkJoints* j = &m->joints;
    const JointState* from = &p->joints;
    unpack_header(&from->header, m);
    j->nname = from->name._length < MAX_SEQUENCE ? (int)from->name._length : MAX_SEQUENCE;
    for (int i = 0; i < j->nname && i < LINK_MAX_JOINT; ++i)
        copy_text(j->name[i], sizeof j->name[i], from->name._buffer[i]);
    j->nposition = copy_doubles(&from->position, j->position, LINK_MAX_JOINT);
    j->nvelocity = copy_doubles(&from->velocity, j->velocity, LINK_MAX_JOINT);
    j->neffort = copy_doubles(&from->effort, j->effort, LINK_MAX_JOINT);
}

static void pack_pose(const LinkMessage* m, Scratch* s, Packed* p) {
    (void)s;
    p->pose = (PoseStamped){
        .header = header_of(m),
        .pose = {.position = {m->pose.p.x, m->pose.p.y, m->pose.p.z},
                 .orientation = {m->pose.q.x, m->pose.q.y, m->pose.q.z, m->pose.q.w}}};
}

static void unpack_pose(const Packed* p, LinkMessage* m) {
    const geometry_msgs_msg_dds__Pose_* from = &p->pose.pose;
    unpack_header(&p->pose.header, m);
    m->pose.p = om_vec3(from->position.x, from->position.y, from->position.z);
    m->pose.q = (OmQuat){.w = from->orientation.w,
                         .x = from->orientation.x,
                         .y = from->orientation.y,
                         .z = from->orientation.z};
}

static void pack_twist(const LinkMessage* m, Scratch* s, Packed* p) {
    const OmVec3 v = m->twist.linear, w = m->twist.angular;
    (void)s;
    p->twist = (TwistStamped){.header = header_of(m),
                              .twist = {.linear = {v.x, v.y, v.z}, .angular = {w.x, w.y, w.z}}};
}

static void unpack_twist(const Packed* p, LinkMessage* m) {
    const geometry_msgs_msg_dds__Twist_* t = &p->twist.twist;
    unpack_header(&p->twist.header, m);
    m->twist.linear = om_vec3(t->linear.x, t->linear.y, t->linear.z);
    m->twist.angular = om_vec3(t->angular.x, t->angular.y, t->angular.z);
}

static void pack_wrench(const LinkMessage* m, Scratch* s, Packed* p) {
    const OmVec3 f = m->wrench.force, t = m->wrench.torque;
    (void)s;
    p->wrench = (WrenchStamped){.header = header_of(m),
                                .wrench = {.force = {f.x, f.y, f.z}, .torque = {t.x, t.y, t.z}}};
}

static void unpack_wrench(const Packed* p, LinkMessage* m) {
    const geometry_msgs_msg_dds__Wrench_* w = &p->wrench.wrench;
    unpack_header(&p->wrench.header, m);
    m->wrench.force = om_vec3(w->force.x, w->force.y, w->force.z);
    m->wrench.torque = om_vec3(w->torque.x, w->torque.y, w->torque.z);
}

static void pack_string(const LinkMessage* m, Scratch* s, Packed* p) {
    (void)s;
    p->string = (String){.data = (char*)(uintptr_t)m->text};
}

static void unpack_string(const Packed* p, LinkMessage* m) {
    copy_text(m->text, sizeof m->text, p->string.data);
}

static void pack_empty(const LinkMessage* m, Scratch* s, Packed* p) {
    (void)m, (void)s;
    p->empty = (Empty){0};
}

static void unpack_empty(const Packed* p, LinkMessage* m) { (void)p, (void)m; }

static void pack_number(const LinkMessage* m, Scratch* s, Packed* p) {
    (void)s;
    p->number = (Float64){.data = m->number};
}

static void unpack_number(const Packed* p, LinkMessage* m) { m->number = p->number.data; }

static void pack_bool(const LinkMessage* m, Scratch* s, Packed* p) {
    (void)s;
    p->is_on = (Bool){.data = m->is_on};
}

static void unpack_bool(const Packed* p, LinkMessage* m) { m->is_on = p->is_on.data; }

static void pack_stamped(const LinkMessage* m, Scratch* s, Packed* p) {
    (void)s;
    p->stamped = (StringStamped){.header = header_of(m), .text = (char*)(uintptr_t)m->text};
}

static void unpack_stamped(const Packed* p, LinkMessage* m) {
    unpack_header(&p->stamped.header, m);
    copy_text(m->text, sizeof m->text, p->stamped.text);
}

static void pack_state(const LinkMessage* m, Scratch* s, Packed* p) {
    (void)s;
    p->state = (OperatingState){.header = header_of(m),
                                .state = (char*)(uintptr_t)m->state.name,
                                .is_homed = m->state.is_homed,
                                .is_busy = m->state.is_busy};
}

static void unpack_state(const Packed* p, LinkMessage* m) {
    unpack_header(&p->state.header, m);
    copy_text(m->state.name, sizeof m->state.name, p->state.state);
    m->state.is_homed = p->state.is_homed;
    m->state.is_busy = p->state.is_busy;
}

static void pack_clock(const LinkMessage* m, Scratch* s, Packed* p) {
    (void)s;
    p->clock = (Clock){.clock = time_of(m->time)};
}

static void unpack_clock(const Packed* p, LinkMessage* m) { m->time = seconds_of(p->clock.clock); }

static void pack_tf(const LinkMessage* m, Scratch* s, Packed* p) {
    for (int i = 0; i < m->tf.n; ++i) {
        const LinkFrame* f = &m->tf.frame[i];
        s->transform[i] = (TransformStamped){
            .header = {.stamp = time_of(m->time), .frame_id = (char*)(uintptr_t)f->parent},
            .child_frame_id = (char*)(uintptr_t)f->child,
            .transform = {.translation = {f->pose.p.x, f->pose.p.y, f->pose.p.z},
                          .rotation = {f->pose.q.x, f->pose.q.y, f->pose.q.z, f->pose.q.w}}};
    }
    p->tf.transforms = (dds_sequence_geometry_msgs_msg_dds__TransformStamped_){
        ._maximum = (uint32_t)m->tf.n, ._length = (uint32_t)m->tf.n, ._buffer = s->transform};
}

// Of more frames than fit the first are kept.
static void unpack_tf(const Packed* p, LinkMessage* m) {
    m->tf.n = 0;
    for (uint32_t i = 0; i < p->tf.transforms._length && m->tf.n < LINK_MAX_FRAME; ++i) {
        const TransformStamped* t = &p->tf.transforms._buffer[i];
        LinkFrame* f = &m->tf.frame[m->tf.n++];
        m->time = seconds_of(t->header.stamp);
        copy_text(f->parent, sizeof f->parent, t->header.frame_id);
        copy_text(f->child, sizeof f->child, t->child_frame_id);
        f->pose.p = om_vec3(t->transform.translation.x, t->transform.translation.y,
                            t->transform.translation.z);
        f->pose.q = (OmQuat){.w = t->transform.rotation.w,
                             .x = t->transform.rotation.x,
                             .y = t->transform.rotation.y,
                             .z = t->transform.rotation.z};
    }
}

static void pack_info(const LinkMessage* m, Scratch* s, Packed* p) {
    const OmLens* l = &m->info.lens;
    const double d[5] = {l->k1, l->k2, l->p1, l->p2, l->k3};
    static const char model[] = "plumb_bob";
    memcpy(s->d, d, sizeof d);
    p->info = (CameraInfo){.header = header_of(m),
                           .height = (uint32_t)m->info.height,
                           .width = (uint32_t)m->info.width,
                           .distortion_model = (char*)(uintptr_t)model,
                           .d = doubles(s->d, 5),
                           .k = {l->fx, 0, l->cx - 0.5, 0, l->fy, l->cy - 0.5, 0, 0, 1},
                           .r = {1, 0, 0, 0, 1, 0, 0, 0, 1},
                           .p = {l->fx, 0, l->cx - 0.5, 0, 0, l->fy, l->cy - 0.5, 0, 0, 0, 1, 0}};
}

// A model of another name leaves fx at 0.
static void unpack_info(const Packed* p, LinkMessage* m) {
    const CameraInfo* c = &p->info;
    double d[5] = {0};
    unpack_header(&c->header, m);
    m->info.width = c->width < MAX_SEQUENCE ? (int)c->width : 0;
    m->info.height = c->height < MAX_SEQUENCE ? (int)c->height : 0;
    m->info.lens = (OmLens){0};
    const bool is_plain = c->d._length == 0;
    if (!is_plain && (strcmp(c->distortion_model, "plumb_bob") != 0 || c->d._length != 5)) return;
    copy_doubles(&c->d, d, 5);
    m->info.lens = (OmLens){.fx = c->k[0],
                            .fy = c->k[4],
                            .cx = c->k[2] + 0.5,
                            .cy = c->k[5] + 0.5,
                            .k1 = d[0],
                            .k2 = d[1],
                            .p1 = d[2],
                            .p2 = d[3],
                            .k3 = d[4]};
}

static dds_sequence_octet octets(const LinkPicture* c) {
    return (dds_sequence_octet){._maximum = (uint32_t)c->size,
                                ._length = (uint32_t)c->size,
                                ._buffer = (uint8_t*)(uintptr_t)c->data};
}

static void unpack_octets(const dds_sequence_octet* s, LinkPicture* c) {
    c->data = s->_buffer;  // om__link_take copies them
    c->size = s->_length;
}

static void pack_image(const LinkMessage* m, Scratch* s, Packed* p) {
    const LinkPicture* c = &m->picture;
    (void)s;
    p->image = (Image){.header = header_of(m),
                       .height = (uint32_t)c->height,
                       .width = (uint32_t)c->width,
                       .encoding = (char*)(uintptr_t)c->encoding,
                       .step = (uint32_t)c->step,
                       .data = octets(c)};
}

static int size_of(uint32_t n) { return n < MAX_SEQUENCE ? (int)n : MAX_SEQUENCE; }

static void unpack_image(const Packed* p, LinkMessage* m) {
    LinkPicture* c = &m->picture;
    const Image* i = &p->image;
    unpack_header(&i->header, m);
    *c = (LinkPicture){.width = size_of(i->width), .height = size_of(i->height)};
    c->step = i->step < INT32_MAX ? (int)i->step : 0;
    c->is_bigendian = i->is_bigendian;
    copy_text(c->encoding, sizeof c->encoding, i->encoding);
    unpack_octets(&i->data, c);
}

static void pack_cloud(const LinkMessage* m, Scratch* s, Packed* p) {
    static const char* const name[4] = {"x", "y", "z", "rgb"};
    const LinkPicture* c = &m->picture;
    const int offset[4] = {c->x, c->y, c->z, c->rgb};
    uint32_t n = 0;
    for (int i = 0; i < 4; ++i)
        if (offset[i] >= 0)
            s->field[n++] = (PointField){(char*)(uintptr_t)name[i], (uint32_t)offset[i], 7, 1};
    p->cloud = (PointCloud2){.header = header_of(m),
                             .height = (uint32_t)c->height,
                             .width = (uint32_t)c->width,
                             .fields = {._maximum = n, ._length = n, ._buffer = s->field},
                             .point_step = (uint32_t)c->point_step,
                             .row_step = (uint32_t)c->step,
                             .data = octets(c)};
}

// Fields that are float32 (7); rgb also as uint32 (6).
static int find_field(const PointCloud2* c, const char* name, int other_type) {
    for (uint32_t i = 0; i < c->fields._length; ++i) {
        const PointField* f = &c->fields._buffer[i];
        if (f->name && strcmp(f->name, name) == 0 &&
            (f->datatype == 7 || f->datatype == other_type) && f->offset < MAX_SEQUENCE)
            return (int)f->offset;
    }
    return -1;
}

static void unpack_cloud(const Packed* p, LinkMessage* m) {
    LinkPicture* c = &m->picture;
    const PointCloud2* from = &p->cloud;
    unpack_header(&from->header, m);
    *c = (LinkPicture){.width = size_of(from->width), .height = size_of(from->height)};
    c->point_step = size_of(from->point_step);
    c->step = from->row_step < INT32_MAX ? (int)from->row_step : 0;
    c->is_bigendian = from->is_bigendian;
    c->x = find_field(from, "x", 7), c->y = find_field(from, "y", 7);
    c->z = find_field(from, "z", 7), c->rgb = find_field(from, "rgb", 6);
    unpack_octets(&from->data, c);
}

static void pack_tick(const LinkMessage* m, Scratch* s, Packed* p) {
    (void)s;
    p->tick = (Tick){m->tick.client, m->tick.number, m->tick.ncommand, m->tick.what, m->tick.dt};
}

static void unpack_tick(const Packed* p, LinkMessage* m) {
    m->tick.client = p->tick.client;
    m->tick.number = p->tick.number;
    m->tick.ncommand = p->tick.ncommand;
    m->tick.what = p->tick.what;
    m->tick.dt = p->tick.dt;
}

static void pack_tock(const LinkMessage* m, Scratch* s, Packed* p) {
    (void)s;
    p->tock = (Tock){m->tick.client, m->tick.number, m->time, (char*)(uintptr_t)m->tick.error};
}

static void unpack_tock(const Packed* p, LinkMessage* m) {
    m->tick.client = p->tock.client;
    m->tick.number = p->tock.number;
    m->time = p->tock.time;
    copy_text(m->tick.error, sizeof m->tick.error, p->tock.error);
}

typedef struct Type {
    const dds_topic_descriptor_t* desc;
    const char* hash;  // REP 2016, of the .msg; test_dds_link holds it against another program's
    void (*pack)(const LinkMessage* m, Scratch* s, Packed* p);
    void (*unpack)(const Packed* p, LinkMessage* m);
} Type;

static const Type type_table[LINK_NTYPE] = {
    [LINK_JOINTS] = {&sensor_msgs_msg_dds__JointState__desc,
                     "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e",
                     pack_joints, unpack_joints},
    [LINK_POSE] = {&geometry_msgs_msg_dds__PoseStamped__desc,
                   "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8",
                   pack_pose, unpack_pose},
    [LINK_TWIST] = {&geometry_msgs_msg_dds__TwistStamped__desc,
                    "RIHS01_5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64",
                    pack_twist, unpack_twist},
    [LINK_WRENCH] = {&geometry_msgs_msg_dds__WrenchStamped__desc,
                     "RIHS01_8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77",
                     pack_wrench, unpack_wrench},
    [LINK_STRING] = {&std_msgs_msg_dds__String__desc,
                     "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
                     pack_string, unpack_string},
    [LINK_EMPTY] = {&std_msgs_msg_dds__Empty__desc,
                    "RIHS01_20b625256f32d5dbc0d04fee44f43c41e51c70d3502f84b4a08e7a9c26a96312",
                    pack_empty, unpack_empty},
    [LINK_NUMBER] = {&std_msgs_msg_dds__Float64__desc,
                     "RIHS01_705ba9c3d1a09df43737eb67095534de36fd426c0587779bda2bc51fe790182a",
                     pack_number, unpack_number},
    [LINK_BOOL] = {&std_msgs_msg_dds__Bool__desc,
                   "RIHS01_feb91e995ff9ebd09c0cb3d2aed18b11077585839fb5db80193b62d74528f6c9",
                   pack_bool, unpack_bool},
    [LINK_STAMPED] = {&crtk_msgs_msg_dds__StringStamped__desc,
                      "RIHS01_83efb802e6596e03f69ac322e3231037329946f2bd13ed48874d97f5b8f5db1d",
                      pack_stamped, unpack_stamped},
    [LINK_STATE] = {&crtk_msgs_msg_dds__OperatingState__desc,
                    "RIHS01_5cc57eea589b217fe5194bf2735b91d4a7f2dd5ac1245ae657f7ea7590c2c80e",
                    pack_state, unpack_state},
    [LINK_CLOCK] = {&rosgraph_msgs_msg_dds__Clock__desc,
                    "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564",
                    pack_clock, unpack_clock},
    [LINK_TF] = {&tf2_msgs_msg_dds__TFMessage__desc,
                 "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087", pack_tf,
                 unpack_tf},
    [LINK_INFO] = {&sensor_msgs_msg_dds__CameraInfo__desc,
                   "RIHS01_b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275",
                   pack_info, unpack_info},
    [LINK_IMAGE] = {&sensor_msgs_msg_dds__Image__desc,
                    "RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47",
                    pack_image, unpack_image},
    [LINK_CLOUD] = {&sensor_msgs_msg_dds__PointCloud2__desc,
                    "RIHS01_9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5",
                    pack_cloud, unpack_cloud},
    [LINK_TICK] = {&omentum_msgs_msg_dds__Tick__desc,
                   "RIHS01_f0c06ce19220702b6605bc46a5140e6aa405deebf8c9ba57bfd58fc7951a6418",
                   pack_tick, unpack_tick},
    [LINK_TOCK] = {&omentum_msgs_msg_dds__Tock__desc,
                   "RIHS01_597245afafc63b392fd214e64830cfb6dbab4685e109d0bf2dc634eb742fba47",
                   pack_tock, unpack_tock}};

const char* om__link_type_name(LinkType type) { return type_table[type].desc->m_typename; }
const char* om__link_type_hash(LinkType type) { return type_table[type].hash; }

// ---- domain -----------------------------------------------------------------------------------------------------

OmDdsDef om_dds_default_def(void) { return (OmDdsDef){.cookie = COOKIE}; }

static bool is_word(const char* text) {
    return text[strspn(text,
                       "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._:-")] == 0;
}

static OmStatus check_def(const OmDdsDef* def) {
    OM_CHECK(def->cookie == COOKIE, OM_INVALID, "OmDdsDef was not made by default_def");
    OM_CHECK(def->domain >= 0 && def->domain <= 232, OM_INVALID, "OmDdsDef.domain is %d; 0 to 232",
             def->domain);
    OM_CHECK(!def->network || is_word(def->network), OM_INVALID,
             "OmDdsDef.network \"%s\" is no interface: a name such as eth0", def->network);
    OM_CHECK(!def->peer || is_word(def->peer), OM_INVALID, "OmDdsDef.peer \"%s\" is no address",
             def->peer);
    return OM_OK;
}

// The settings in Cyclone's XML. A peer that is named is asked directly, and multicast is not used.
static OmStatus print_settings(const OmDdsDef* def, OmText* xml) {
    const bool is_local = !def->network && !def->peer;
    OM_TRY(om_text_append(xml, "<Domain Id=\"any\"><General><Interfaces><NetworkInterface "));
    OM_TRY(def->network ? om_text_append(xml, "name=\"%s\"", def->network)
                        : om_text_append(xml, is_local ? "name=\"lo\"" : "autodetermine=\"true\""));
    OM_TRY(om_text_append(xml, "/></Interfaces><AllowMulticast>%s</AllowMulticast>",
                          is_local || def->peer ? "false" : "true"));
    if (is_local)
        OM_TRY(om_text_append(xml, "<MaxMessageSize>65500B</MaxMessageSize>"
                                   "<FragmentSize>65000B</FragmentSize>"));
    OM_TRY(om_text_append(xml, "</General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
                               "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
                               "<LeaseDuration>3s</LeaseDuration>"));
    if (is_local || def->peer)
        OM_TRY(om_text_append(xml, "<Peers><Peer Address=\"%s\"/></Peers>",
                              def->peer ? def->peer : "127.0.0.1"));
    return om_text_append(xml, "</Discovery></Domain>");
}

static OmStatus fail(const char* what, dds_return_t code) {
    return om_error(code == DDS_RETCODE_OUT_OF_RESOURCES ? OM_NO_MEMORY : OM_IO,
                    "Cyclone DDS: %s: %s", what, dds_strretcode(code));
}

// Settings of the environment are those of a user of Cyclone: they stay. A domain that another link of this process has
// made is shared.
static OmStatus create_domain(const OmDdsDef* def, Link* l) {
    OmText xml = {0};
    if (getenv("CYCLONEDDS_URI") && !def->network && !def->peer) return OM_OK;
    OmStatus status = print_settings(def, &xml);
    if (status == OM_OK) {
        const dds_entity_t domain = dds_create_domain((dds_domainid_t)def->domain, xml.str);
        if (domain >= 0)
            l->domain = domain;
        else if (domain != DDS_RETCODE_PRECONDITION_NOT_MET)
            status = fail("the domain", domain);
    }
    om_text_done(&xml);
    return status;
}

// What Cyclone has to say goes to the log.
static void take_log(void* ctx, const dds_log_data_t* data) {
    (void)ctx;
    const size_t n =
        data->size > 0 && data->message[data->size - 1] == '\n' ? data->size - 1 : data->size;
    om_log(OM_LOG_WARNING, "%.*s", (int)n, data->message);
}

OmStatus om__link_create(const OmDdsDef* def, Link** link) {
    *link = NULL;
    OM_TRY(check_def(def));
    Link* l = om_calloc(1, sizeof *l);
    if (!l) return OM_NO_MEMORY;
    dds_set_log_sink(take_log, NULL);
    OmStatus status = create_domain(def, l);
    if (status == OM_OK) {
        l->participant = dds_create_participant((dds_domainid_t)def->domain, NULL, NULL);
        if (l->participant < 0) status = fail("the participant", l->participant);
    }
    if (status == OM_OK) {
        l->waitset = dds_create_waitset(l->participant);
        if (l->waitset < 0) status = fail("a waitset", l->waitset);
    }
    if (status < 0)
        om__link_destroy(l);
    else
        *link = l;
    return status;
}

void om__link_destroy(Link* link) {
    if (!link) return;
    if (link->participant > 0) dds_delete(link->participant);
    if (link->domain > 0) dds_delete(link->domain);
    for (int i = 0; i < link->nend; ++i) om_free(link->end[i].data);
    om_free(link->end);
    om_free(link);
}

static dds_qos_t* make_qos(unsigned flags, LinkType type, int depth) {
    char text[120];
    dds_qos_t* qos = dds_create_qos();
    snprintf(text, sizeof text, "typehash=%s;", type_table[type].hash);
    dds_qset_reliability(
        qos, flags & LINK_LOSSY ? DDS_RELIABILITY_BEST_EFFORT : DDS_RELIABILITY_RELIABLE,
        DDS_SECS(1));
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, depth);
    dds_qset_durability(qos, flags & LINK_LATCHED ? DDS_DURABILITY_TRANSIENT_LOCAL
                                                  : DDS_DURABILITY_VOLATILE);
    if (flags & LINK_LATCHED)
        dds_qset_durability_service(qos, 0, DDS_HISTORY_KEEP_LAST, depth, -1, -1, -1);
    dds_qset_userdata(qos, text, strlen(text));
    return qos;
}

static OmStatus begin_endpoint(Link* link, Endpoint* e) {
    dds_qos_t* qos = make_qos(e->flags, e->type, e->depth);
    e->entity = e->is_reader ? dds_create_reader(link->participant, e->topic, qos, NULL)
                             : dds_create_writer(link->participant, e->topic, qos, NULL);
    dds_delete_qos(qos);
    if (e->entity < 0) return fail(e->name, e->entity);
    if (!e->is_reader) return OM_OK;
    dds_set_status_mask(e->entity, DDS_DATA_AVAILABLE_STATUS);
    const dds_return_t code = dds_waitset_attach(link->waitset, e->entity, e->entity);
    return code < 0 ? fail(e->name, code) : OM_OK;
}

OmStatus om__link_add(Link* link, unsigned flags, LinkType type, const char* name, int depth,
                      int* id) {
    *id = -1;
    OM_GROW(link->end, link->nend, link->capacity, 32);
    Endpoint e = {.type = type, .is_reader = flags & LINK_IN, .channel = -1};
    e.flags = flags, e.depth = depth;
    char topic[130];
    snprintf(e.name, sizeof e.name, "%s", name);
    snprintf(topic, sizeof topic, "rt/%s", name);
    e.topic = dds_create_topic(link->participant, type_table[type].desc, topic, NULL, NULL);
    if (e.topic < 0) return fail(topic, e.topic);
    OM_TRY(begin_endpoint(link, &e));
    const bool is_picture = type == LINK_IMAGE || type == LINK_CLOUD;
    if (link->tape && !e.is_reader && (link->records_pictures || !is_picture)) {
        const McapTopic of = {name, type, depth, flags & LINK_LATCHED, type_table[type].hash};
        OM_TRY(om__tape_add(link->tape, &of, &e.channel));
    }
    *id = link->nend;
    link->end[link->nend++] = e;
    return OM_OK;
}

void om__link_record(Link* link, Tape* tape, bool has_pictures) {
    link->tape = tape;
    link->records_pictures = has_pictures;
    for (int i = 0; i < link->nend && !tape; ++i) link->end[i].channel = -1;
}

OmStatus om__link_relax(Link* link, int id) {
    Endpoint* e = &link->end[id];
    dds_requested_incompatible_qos_status_t status;
    if (e->flags & LINK_LOSSY || om__link_count(link, id) > 0) return OM_OK;
    if (dds_get_requested_incompatible_qos_status(e->entity, &status) < 0) return OM_OK;
    if (status.total_count == 0 || status.last_policy_id != DDS_RELIABILITY_QOS_POLICY_ID)
        return OM_OK;
    dds_delete(e->entity);
    e->flags |= LINK_LOSSY;
    return begin_endpoint(link, e);
}

bool om__link_is_name(const char* text, size_t size) {
    static const char letter[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_/";
    const size_t n = text ? strlen(text) : 0;
    const bool is_open = n > 0 && (text[0] == '/' || text[n - 1] == '/');
    return n > 0 && n < size && !is_open && strspn(text, letter) == n;
}

const char* om__link_name(const Link* link, int id) { return link->end[id].name; }

int om__link_count(const Link* link, int id) {
    const Endpoint* e = &link->end[id];
    dds_instance_handle_t peer[1];
    const dds_return_t n = e->is_reader ? dds_get_matched_publications(e->entity, peer, 1)
                                        : dds_get_matched_subscriptions(e->entity, peer, 1);
    return n > 0 ? (int)n : 0;
}

// 0: not there any more.
static uint64_t program_of(dds_builtintopic_endpoint_t* end) {
    if (!end) return 0;
    const uint64_t program = end->participant_instance_handle;
    dds_builtintopic_free_endpoint(end);
    return program;
}

uint64_t om__link_program(const Link* link, int id, uint64_t writer) {
    return program_of(dds_get_matched_publication_data(link->end[id].entity, writer));
}

int om__link_add_programs(const Link* link, int id, int n, int max, uint64_t program[]) {
    const dds_entity_t entity = link->end[id].entity;
    dds_instance_handle_t reader[MAX_READER];
    const dds_return_t found = dds_get_matched_subscriptions(entity, reader, MAX_READER);
    for (int i = 0; i < found && i < MAX_READER; ++i) {
        const uint64_t p = program_of(dds_get_matched_subscription_data(entity, reader[i]));
        int k = 0;
        while (k < n && program[k] != p) ++k;
        if (p && k == n && n < max) program[n++] = p;
    }
    return n;
}

bool om__link_is_wanted(const Link* link, int id) {
    return link->end[id].channel >= 0 || om__link_count(link, id) > 0;
}

// ---- messages ---------------------------------------------------------------------------------------------------

// The bytes that the wire has: little endian, XCDR 1, behind four bytes that say so.
static OmStatus record(const Link* link, const Endpoint* e, double time, const Packed* packed) {
    static const unsigned char little_endian[4] = {0, 1, 0, 0};
    dds_ostreamLE_t out;
    dds_ostreamLE_init(&out, 0, CDR_ENC_VERSION_1);
    OmText cdr = {0};
    OmStatus status = OM_OK;
    if (!dds_stream_writeLE(&out, (const char*)packed, type_table[e->type].desc->m_ops))
        status = om_error(OM_IO, "Cyclone DDS cannot serialise a message of %s", e->name);
    if (status == OM_OK) status = om_text_append_raw(&cdr, (const char*)little_endian, 4);
    if (status == OM_OK)
        status = om_text_append_raw(&cdr, (const char*)out.x.m_buffer, out.x.m_index);
    if (status == OM_OK) status = om__tape_write(link->tape, e->channel, time, cdr.str, cdr.len);
    dds_ostreamLE_fini(&out);
    om_text_done(&cdr);
    return status;
}

OmStatus om__link_write(Link* link, int id, const LinkMessage* message) {
    const Endpoint* e = &link->end[id];
    Scratch scratch;
    Packed packed;
    type_table[e->type].pack(message, &scratch, &packed);
    if (e->channel >= 0) OM_TRY(record(link, e, message->time, &packed));
    const dds_return_t code = dds_write(e->entity, &packed);
    return code < 0 ? fail(e->name, code) : OM_OK;
}

// The bytes of a picture outlive the loan.
static bool keep_data(Endpoint* e, LinkPicture* c) {
    if (c->size > e->capacity) {
        om_free(e->data);
        e->data = om_alloc(c->size, 1);
        e->capacity = e->data ? c->size : 0;
        if (!e->data) return false;
    }
    if (c->size > 0) memcpy(e->data, c->data, c->size);
    c->data = e->data;
    return true;
}

bool om__link_take(Link* link, int id, LinkMessage* message) {
    Endpoint* e = &link->end[id];
    const bool is_picture = e->type == LINK_IMAGE || e->type == LINK_CLOUD;
    dds_sample_info_t info;
    void* loan = NULL;
    bool is_there = false;
    while (!is_there && dds_take(e->entity, &loan, &info, 1, 1) > 0) {
        if (info.valid_data) {
            memset(message, 0, sizeof *message);
            type_table[e->type].unpack(loan, message);
            message->writer = info.publication_handle;
            is_there = !is_picture || keep_data(e, &message->picture);
        }
        dds_return_loan(e->entity, &loan, 1);
        loan = NULL;
    }
    return is_there;
}

bool om__link_wait(Link* link, double seconds) {
    const dds_duration_t ns = (dds_duration_t)(1e9 * (seconds > 0 ? seconds : 0));
    return dds_waitset_wait(link->waitset, NULL, 0, ns) > 0;
}
