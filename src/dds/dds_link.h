// dds_link.h: topics of ROS 2 over Cyclone DDS, as plain structs.
//
//     om__link_create(&def, &link);
//     om__link_add(link, LINK_OUT, LINK_POSE, "PSM1/measured_cp", 5, &id);
//     om__link_write(link, id, &(LinkMessage){.time = t, .frame = "world", .pose = tip});
//     while (om__link_take(link, goal, &message)) ...
#ifndef OMENTUM_DDS_LINK_H
#define OMENTUM_DDS_LINK_H

#include "omentum/dds.h"

typedef enum LinkType {
    LINK_JOINTS,   // sensor_msgs/JointState
    LINK_POSE,     // geometry_msgs/PoseStamped
    LINK_TWIST,    // geometry_msgs/TwistStamped
    LINK_WRENCH,   // geometry_msgs/WrenchStamped
    LINK_STRING,   // std_msgs/String
    LINK_EMPTY,    // std_msgs/Empty
    LINK_NUMBER,   // std_msgs/Float64
    LINK_BOOL,     // std_msgs/Bool
    LINK_STAMPED,  // crtk_msgs/StringStamped
    LINK_STATE,    // crtk_msgs/OperatingState
    LINK_CLOCK,    // rosgraph_msgs/Clock
    LINK_TF,       // tf2_msgs/TFMessage
    LINK_INFO,     // sensor_msgs/CameraInfo
    LINK_IMAGE,    // sensor_msgs/Image
    LINK_CLOUD,    // sensor_msgs/PointCloud2
    LINK_TICK,     // omentum_msgs/Tick
    LINK_TOCK,     // omentum_msgs/Tock
    LINK_NTYPE
} LinkType;

enum {
    // joints of a message; of a longer one the first are kept, and the counts are true
    LINK_MAX_JOINT = 8,
    LINK_MAX_FRAME = 64,
    LINK_MAX_FIELD = 8
};

typedef struct LinkJoints {
    int nname, nposition, nvelocity, neffort;
    char name[LINK_MAX_JOINT][32];
    double position[LINK_MAX_JOINT];  // rad, m
    double velocity[LINK_MAX_JOINT];  // rad/s, m/s
    double effort[LINK_MAX_JOINT];    // N m, N
} LinkJoints;

typedef struct LinkFrame {
    char parent[64], child[64];
    OmPose pose;  // pose_parent_child
} LinkFrame;

typedef struct LinkPicture {  // of an image or a cloud
    int width, height;
    char encoding[16];          // of an image: "rgb8", "32FC1"
    int step, point_step;       // bytes of a row; of a point of a cloud
    int x, y, z, rgb;           // of a cloud: offsets of the fields in a point, -1: not there
    bool is_bigendian;          //
    const unsigned char* data;  // written: borrowed; taken: valid until the next take of this topic
    size_t size;                // bytes
} LinkPicture;

typedef struct LinkMessage {
    double time;      // s, of the header; of a clock, of a tock
    char frame[64];   // of the header
    uint64_t writer;  // of a taken message
    union {
        LinkJoints joints;
        OmPose pose;
        struct {
            OmVec3 linear, angular;  // m/s, rad/s
        } twist;
        struct {
            OmVec3 force, torque;
        } wrench;
        char text[256];
        double number;
        bool is_on;
        struct {
            char name[32];
            bool is_homed, is_busy;
        } state;
        struct {
            int n;
            LinkFrame frame[LINK_MAX_FRAME];
        } tf;
        struct {
            int width, height;
            OmLens lens;  // cx and cy as in OmLens, not as on the wire
        } info;
        LinkPicture picture;
        struct {
            uint32_t client, number, ncommand, what;
            double dt;
            char error[256];
        } tick;
    };
} LinkMessage;

typedef struct Link Link;
typedef struct Mcap Mcap;  // dds_mcap.h
typedef struct Tape Tape;  // dds_tape.h

// Flags of om__link_add. LINK_LOSSY: best effort, as many cameras send; a reader that is not lossy does not hear them.
enum { LINK_OUT = 0, LINK_IN = 1, LINK_LATCHED = 2, LINK_LOSSY = 4 };

OmStatus om__link_create(const OmDdsDef* def, Link** link);
void om__link_destroy(Link* link);
// A writer or a reader of a topic. `name` is without the slash in front; `depth` of the queue.
OmStatus om__link_add(Link* link, unsigned flags, LinkType type, const char* name, int depth,
                      int* id);
OmStatus om__link_write(Link* link, int id, const LinkMessage* message);
// Writers added from now on also write to a recording (borrowed); without pictures: no images and clouds. Null: no
// writer does any more.
void om__link_record(Link* link, Tape* tape, bool has_pictures);
// Has a writer a reader, or is it recorded?
bool om__link_is_wanted(const Link* link, int id);
// The next message. @return false: there is none
bool om__link_take(Link* link, int id, LinkMessage* message);
// Readers of a writer, writers of a reader.
int om__link_count(const Link* link, int id);
// The program (participant) that a writer belongs to, which a message of this reader came from; 0: it is gone.
uint64_t om__link_program(const Link* link, int id, uint64_t writer);
// The programs that read a writer, to those of `program` (n of them, room for `max`) that are not there yet.
// @return how many there are now
int om__link_add_programs(const Link* link, int id, int n, int max, uint64_t program[]);
// Make a reader lossy where all that it hears of its topic are writers that are.
OmStatus om__link_relax(Link* link, int id);
// Until a reader has a message, at most so many seconds. @return false: none has
bool om__link_wait(Link* link, double seconds);
// Is it a name of a topic: letters, digits, _ and /, fewer than `size` of them?
bool om__link_is_name(const char* text, size_t size);
const char* om__link_name(const Link* link, int id);
// For tests: "sensor_msgs::msg::dds_::JointState_", and its hash as rmw writes it, "RIHS01_...".
const char* om__link_type_name(LinkType type);
const char* om__link_type_hash(LinkType type);

#endif
