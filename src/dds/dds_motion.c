// dds_motion.c: the motion of an arm in a recording: MCAP without compression, as dds_mcap.c and rosbag2 write it.
//
//   magic | records: opcode, 8 bytes of length, content; a Chunk has records again: Schema, Channel, Message
//
// Records are read in order, without the index: a file whose end is missing has its whole chunks. Messages are CDR,
// little endian: numbers are aligned to their size, counted from behind the four bytes in front.
#include <math.h>
#include <string.h>

#include "base/base_grow.h"
#include "dds/dds_mcap.h"

#define MAX_FILE ((size_t)1 << 32)
#define UNIT 1e-3  // by which the length of a quaternion may differ from 1
enum { SCHEMA = 3, CHANNEL = 4, MESSAGE = 5, CHUNK = 6, MAX_TOPIC = 160 };
static const char magic[8] = {(char)0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};

typedef struct Cursor {  // behind an end that was passed everything is 0
    const unsigned char *at, *end, *begin;
    bool is_short;
} Cursor;

typedef struct Reader {
    const char *name, *arm;
    OmDdsMotion* motion;
    int capacity;
    int pose_schema, joint_schema, pose_channel, jaw_channel;  // -1: not seen
    double jaw;                                                // the last one
    int npose;                                                 // messages of poses
} Reader;

// ---- bytes --------------------------------------------------------------------------------------------------------

static Cursor cursor(const void* data, size_t size) {
    const unsigned char* at = data;
    return (Cursor){.at = at, .end = at + size, .begin = at};
}

static const unsigned char* take(Cursor* c, size_t n) {
    if (c->is_short || (size_t)(c->end - c->at) < n) {
        c->is_short = true;
        return NULL;
    }
    c->at += n;
    return c->at - n;
}

static uint64_t take_number(Cursor* c, size_t nbyte) {
    const unsigned char* p = take(c, nbyte);
    uint64_t value = 0;
    for (size_t i = 0; p && i < nbyte; ++i) value |= (uint64_t)p[i] << 8 * i;
    return value;
}

// A string of 4 bytes of length; `text` has its first bytes.
static void take_string(Cursor* c, char* text, size_t room) {
    const size_t n = (size_t)take_number(c, 4);
    const unsigned char* p = take(c, n);
    const size_t kept = p ? (n < room - 1 ? n : room - 1) : 0;
    if (kept > 0) memcpy(text, p, kept);
    text[kept] = 0;
}

static void align(Cursor* c, size_t size) {
    const size_t over = (size_t)(c->at - c->begin) % size;
    if (over > 0) take(c, size - over);
}

static double take_double(Cursor* c) {
    const uint64_t bits = take_number(c, 8);
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

// ---- messages -----------------------------------------------------------------------------------------------------

static double take_header(Cursor* c, char* frame, size_t room) {
    const int32_t sec = (int32_t)(uint32_t)take_number(c, 4);
    const double nano = (double)take_number(c, 4);
    take_string(c, frame, room);
    return (double)sec + 1e-9 * nano;
}

static OmStatus begin_message(const Reader* r, Cursor* c) {
    const unsigned char* head = take(c, 4);
    OM_CHECK(head && head[0] == 0 && head[1] == 1, OM_UNAVAILABLE,
             "%s: a message of %s is not CDR in little endian", r->name, r->arm);
    *c = cursor(c->at, (size_t)(c->end - c->at));
    return OM_OK;
}

static OmStatus read_pose(Reader* r, Cursor c) {
    OmDdsMotion* m = r->motion;
    char frame[sizeof m->frame];
    double x[7];
    OM_TRY(begin_message(r, &c));
    const double time = take_header(&c, frame, sizeof frame);
    ++r->npose;
    align(&c, 8);
    for (int i = 0; i < 7; ++i) x[i] = take_double(&c);
    const OmQuat q = {.w = x[6], .x = x[3], .y = x[4], .z = x[5]};
    const double norm = sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    OM_CHECK(!c.is_short && om_is_finite3(om_load3(x, 0)) && fabs(norm - 1) < UNIT, OM_INVALID,
             "%s: message %d of /%s/measured_cp is no pose", r->name, r->npose, r->arm);
    OM_CHECK(m->n == 0 || strcmp(frame, m->frame) == 0, OM_INVALID,
             "%s: message %d of /%s/measured_cp is in frame \"%s\", and those before in \"%s\"",
             r->name, r->npose, r->arm, frame, m->frame);
    // in a pause of lock-step the same pose is published again
    if (m->n > 0 && time == m->time[m->n - 1]) return OM_OK;
    OM_CHECK(
        m->n == 0 || time > m->time[m->n - 1], OM_INVALID,
        "%s: message %d of /%s/measured_cp: its time goes back from %.3f s to %.3f s: two robots, or "
        "a clock that began again",
        r->name, r->npose, r->arm, m->time[m->n - 1], time);
    if (m->n == r->capacity) {
        int capacity = r->capacity;
        OM_GROW(m->time, m->n, capacity, 1024);
        capacity = r->capacity;
        OM_GROW(m->tip, m->n, capacity, 1024);
        capacity = r->capacity;
        OM_GROW(m->jaw, m->n, capacity, 1024);
        capacity = r->capacity;
        OM_GROW(m->message, m->n, capacity, 1024);
        r->capacity = capacity;
    }
    memcpy(m->frame, frame, sizeof frame);
    m->time[m->n] = time;
    m->message[m->n] = r->npose;
    m->tip[m->n] = (OmPose){om_load3(x, 0), q};
    m->jaw[m->n++] = r->jaw;
    return OM_OK;
}

// Of poses before the first angle the jaw is that of the first one.
static OmStatus read_jaw(Reader* r, Cursor c) {
    char name[2];
    OM_TRY(begin_message(r, &c));
    (void)take_header(&c, name, sizeof name);
    align(&c, 4);
    uint64_t nname = take_number(&c, 4);
    for (; nname > 0 && !c.is_short; --nname) {
        align(&c, 4);
        take_string(&c, name, sizeof name);
    }
    align(&c, 4);
    const uint64_t n = take_number(&c, 4);
    align(&c, 8);
    const double jaw = take_double(&c);
    OM_CHECK(!c.is_short && n == 1 && isfinite(jaw), OM_INVALID,
             "%s: a message of /%s/jaw/measured_js has not one angle", r->name, r->arm);
    OmDdsMotion* m = r->motion;
    for (int i = 0; !m->has_jaw && i < m->n; ++i) m->jaw[i] = jaw;
    m->has_jaw = true;
    r->jaw = jaw;
    return OM_OK;
}

// ---- records ------------------------------------------------------------------------------------------------------

static void read_schema(Reader* r, Cursor c) {
    char name[64];
    const int id = (int)take_number(&c, 2);
    take_string(&c, name, sizeof name);
    if (c.is_short) return;
    if (strcmp(name, "geometry_msgs/msg/PoseStamped") == 0) r->pose_schema = id;
    if (strcmp(name, "sensor_msgs/msg/JointState") == 0) r->joint_schema = id;
}

static OmStatus read_channel(Reader* r, Cursor c) {
    char name[MAX_TOPIC], pose[MAX_TOPIC], jaw[MAX_TOPIC], encoding[8];
    const int id = (int)take_number(&c, 2), type = (int)take_number(&c, 2);
    take_string(&c, name, sizeof name);
    take_string(&c, encoding, sizeof encoding);
    snprintf(pose, sizeof pose, "/%.100s/measured_cp", r->arm);
    snprintf(jaw, sizeof jaw, "/%.100s/jaw/measured_js", r->arm);
    const bool is_pose = strcmp(name, pose) == 0, is_jaw = strcmp(name, jaw) == 0;
    if (c.is_short || (!is_pose && !is_jaw)) return OM_OK;
    OM_CHECK(type == (is_pose ? r->pose_schema : r->joint_schema) && strcmp(encoding, "cdr") == 0,
             OM_INVALID, "%s: %s must be %s in CDR", r->name, name,
             is_pose ? "geometry_msgs/msg/PoseStamped" : "sensor_msgs/msg/JointState");
    int* channel = is_pose ? &r->pose_channel : &r->jaw_channel;
    OM_CHECK(*channel < 0 || *channel == id, OM_INVALID, "%s: two channels have the topic %s",
             r->name, name);
    *channel = id;
    return OM_OK;
}

static OmStatus read_message(Reader* r, Cursor c) {
    const int id = (int)take_number(&c, 2);
    take(&c, 4 + 8 + 8);  // number, times
    if (c.is_short) return OM_OK;
    if (id == r->pose_channel) return read_pose(r, c);
    return id == r->jaw_channel ? read_jaw(r, c) : OM_OK;
}

// Records up to the first that is not whole.
static OmStatus read_records(Reader* r, Cursor c, bool is_chunk);

// The last chunk of a file whose program was killed may be torn; one with records behind it is damaged.
static OmStatus read_chunk(Reader* r, Cursor c, bool is_last, bool* is_torn) {
    char compression[16];
    take(&c, 8 + 8);  // times
    const uint64_t size = take_number(&c, 8);
    const uint32_t crc = (uint32_t)take_number(&c, 4);
    take_string(&c, compression, sizeof compression);
    OM_CHECK(!compression[0], OM_UNAVAILABLE,
             "%s is compressed (%s); \"mcap compress --compression none\" writes it without",
             r->name, compression);
    const uint64_t stored = take_number(&c, 8);
    *is_torn = c.is_short || stored != size || stored != (uint64_t)(c.end - c.at) ||
               (crc != 0 && om__mcap_crc(c.at, (size_t)stored) != crc);
    OM_CHECK(!*is_torn || is_last, OM_INVALID,
             "%s: a chunk is damaged: its size or its sum is wrong", r->name);
    return *is_torn ? OM_OK : read_records(r, cursor(c.at, (size_t)stored), true);
}

static OmStatus read_records(Reader* r, Cursor c, bool is_chunk) {
    bool is_torn = false;
    while (c.at < c.end && !is_torn) {
        const int opcode = (int)take_number(&c, 1);
        const uint64_t size = take_number(&c, 8);
        const unsigned char* content = take(&c, (size_t)size);
        if (c.is_short) break;
        const Cursor in = cursor(content, (size_t)size);
        if (opcode == SCHEMA) read_schema(r, in);
        if (opcode == CHANNEL) OM_TRY(read_channel(r, in));
        if (opcode == MESSAGE) OM_TRY(read_message(r, in));
        if (opcode == CHUNK && !is_chunk) OM_TRY(read_chunk(r, in, c.at == c.end, &is_torn));
    }
    return OM_OK;
}

static OmStatus read_all(Reader* r, const char* data, size_t size) {
    OM_CHECK(size >= sizeof magic && memcmp(data, magic, sizeof magic) == 0, OM_INVALID,
             "%s is no recording in MCAP", r->name);
    OM_TRY(read_records(r, cursor(data + sizeof magic, size - sizeof magic), false));
    OM_CHECK(r->motion->n > 0, OM_INVALID, "%s: no message on topic /%s/measured_cp", r->name,
             r->arm);
    return OM_OK;
}

OmStatus om_dds_motion_parse(const char* data, size_t size, const char* name, const char* arm,
                             OmDdsMotion* motion) {
    *motion = (OmDdsMotion){0};
    Reader r = {.name = name,
                .arm = arm,
                .motion = motion,
                .pose_schema = -1,
                .joint_schema = -1,
                .pose_channel = -1,
                .jaw_channel = -1};
    const OmStatus status = read_all(&r, data, size);
    if (status < 0) om_dds_motion_done(motion);
    return status;
}

OmStatus om_dds_motion_load(const char* path, const char* arm, OmDdsMotion* motion) {
    char* data;
    size_t size;
    *motion = (OmDdsMotion){0};
    OM_TRY(om_file_read(path, MAX_FILE, &data, &size));
    const OmStatus status = om_dds_motion_parse(data, size, path, arm, motion);
    om_free(data);
    return status;
}

void om_dds_motion_done(OmDdsMotion* motion) {
    om_free(motion->time);
    om_free(motion->tip);
    om_free(motion->jaw);
    om_free(motion->message);
    *motion = (OmDdsMotion){0};
}
