// dds_mcap.c: MCAP (mcap.dev/spec, version 0), without compression: records of opcode, 8 bytes of length, content.
//
//   magic Header | Chunk MessageIndex...  Chunk MessageIndex... | DataEnd Schema.. Channel.. Statistics ChunkIndex..
//                | at ->                                        | Footer magic: the ending
//
// A file is whole after each chunk: the chunk is written over the last ending, with a new ending behind it, by one
// write. A program that is killed leaves a file that any reader opens; what it loses is the chunk in memory. On a full
// disk the old ending is written again. Only a kill in the middle of a write leaves a file without an ending: its
// whole chunks can be read in order from the front ("mcap recover" does it), and the CRC of a torn one is wrong.
//
// The ending grows by a line of index for each chunk. A chunk is written once it is CHUNK_TIME old and twice as long
// as the ending: rewritten endings are never more than a third of all that is written. Channels are in the first chunk.
#include "dds/dds_mcap.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <unistd.h>
#include <zlib.h>

#include "base/base_grow.h"

#define CHUNK_TIME 1.0        // s of the wall clock
#define CHUNK_SIZE (4 << 20)  // bytes

enum {  // opcodes
    HEADER = 1,
    FOOTER = 2,
    SCHEMA = 3,
    CHANNEL = 4,
    MESSAGE = 5,
    CHUNK = 6,
    MESSAGE_INDEX = 7,
    CHUNK_INDEX = 8,
    STATISTICS = 11,
    DATA_END = 15
};

static const char magic[8] = {(char)0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};

typedef struct Channel {
    uint32_t nmessage;
    OmText index;  // of the chunk in memory: time and offset of each message
} Channel;

struct Mcap {
    int fd;
    char path[256];
    uint64_t at;      // where the next chunk goes
    OmText records;   // of the chunk in memory
    OmText channels;  // all records of schemas and channels
    OmText chunks;    // all records of ChunkIndex
    OmText out, ending;
    Channel* channel;
    int nchannel, capacity;
    bool has_schema[LINK_NTYPE];
    int nschema;
    uint32_t nchunk;
    uint64_t kept_first, kept_last;         // ns, of the file
    uint64_t nmessage, first, last;         // ns
    uint64_t nheld, held_first, held_last;  // of the chunk in memory
    double written;                         // s of the wall clock
};

// ---- types --------------------------------------------------------------------------------------------------------

#define LINE "================================================================================\n"
#define MSG(name, fields) LINE "MSG: " name "\n" fields
#define TIME MSG("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n")
#define HEAD MSG("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n") TIME
#define VECTOR MSG("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n")
#define TURN MSG("geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n")

static const struct {
    const char *name, *text;
} schema[LINK_NTYPE] = {
    [LINK_JOINTS] = {"sensor_msgs/msg/JointState",
                     "std_msgs/Header header\nstring[] name\nfloat64[] position\n"
                     "float64[] velocity\nfloat64[] effort\n" HEAD},
    [LINK_POSE] = {"geometry_msgs/msg/PoseStamped",
                   "std_msgs/Header header\ngeometry_msgs/Pose pose\n" HEAD MSG(
                       "geometry_msgs/Pose",
                       "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n")
                       MSG("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n") TURN},
    [LINK_TWIST] = {"geometry_msgs/msg/TwistStamped",
                    "std_msgs/Header header\ngeometry_msgs/Twist twist\n" HEAD MSG(
                        "geometry_msgs/Twist",
                        "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n") VECTOR},
    [LINK_WRENCH] = {"geometry_msgs/msg/WrenchStamped",
                     "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n" HEAD MSG(
                         "geometry_msgs/Wrench",
                         "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n") VECTOR},
    [LINK_STRING] = {"std_msgs/msg/String", "string data\n"},
    [LINK_STAMPED] = {"crtk_msgs/msg/StringStamped",
                      "std_msgs/Header header\nstring string\n" HEAD},
    [LINK_STATE] = {"crtk_msgs/msg/OperatingState",
                    "std_msgs/Header header\nstring state\nbool is_homed\nbool is_busy\n" HEAD},
    [LINK_CLOCK] = {"rosgraph_msgs/msg/Clock", "builtin_interfaces/Time clock\n" TIME},
    [LINK_TF] = {"tf2_msgs/msg/TFMessage",
                 "geometry_msgs/TransformStamped[] transforms\n" MSG(
                     "geometry_msgs/TransformStamped",
                     "std_msgs/Header header\nstring child_frame_id\n"
                     "geometry_msgs/Transform transform\n")
                     HEAD MSG("geometry_msgs/Transform", "geometry_msgs/Vector3 translation\n"
                                                         "geometry_msgs/Quaternion rotation\n")
                         VECTOR TURN},
    [LINK_INFO] = {"sensor_msgs/msg/CameraInfo",
                   "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\n"
                   "float64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\n"
                   "uint32 binning_y\nsensor_msgs/RegionOfInterest roi\n" HEAD MSG(
                       "sensor_msgs/RegionOfInterest",
                       "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\n"
                       "bool do_rectify\n")},
    [LINK_IMAGE] = {"sensor_msgs/msg/Image",
                    "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\n"
                    "uint8 is_bigendian\nuint32 step\nuint8[] data\n" HEAD},
    [LINK_CLOUD] = {"sensor_msgs/msg/PointCloud2",
                    "std_msgs/Header header\nuint32 height\nuint32 width\n"
                    "sensor_msgs/PointField[] fields\nbool is_bigendian\nuint32 point_step\n"
                    "uint32 row_step\nuint8[] data\nbool is_dense\n" HEAD MSG(
                        "sensor_msgs/PointField",
                        "string name\nuint32 offset\nuint8 datatype\nuint32 count\n")},
};

const char* om__mcap_type_name(LinkType type) { return schema[type].name; }
const char* om__mcap_schema(LinkType type) { return schema[type].text; }

// ---- records ------------------------------------------------------------------------------------------------------

static OmStatus add_number(OmText* out, uint64_t value, int nbyte) {
    char bytes[8];
    for (int i = 0; i < nbyte; ++i) bytes[i] = (char)(value >> 8 * i & 0xff);
    return om_text_append_raw(out, bytes, (size_t)nbyte);
}

static void put_number(OmText* out, size_t at, uint64_t value) {
    for (size_t i = 0; i < 8; ++i) out->str[at + i] = (char)(value >> 8 * i & 0xff);
}

static OmStatus add_string(OmText* out, const char* text) {
    const size_t n = strlen(text);
    OM_TRY(add_number(out, n, 4));
    return om_text_append_raw(out, text, n);
}

static OmStatus begin_record(OmText* out, int opcode, size_t* from) {
    OM_TRY(add_number(out, (uint64_t)opcode, 1));
    *from = out->len;
    return add_number(out, 0, 8);
}

static void end_record(OmText* out, size_t from) { put_number(out, from, out->len - from - 8); }

static OmStatus add_schema(Mcap* m, LinkType type) {
    size_t from;
    OM_TRY(begin_record(&m->channels, SCHEMA, &from));
    OM_TRY(add_number(&m->channels, (uint64_t)type + 1, 2));  // 0 means none
    OM_TRY(add_string(&m->channels, schema[type].name));
    OM_TRY(add_string(&m->channels, "ros2msg"));
    OM_TRY(add_string(&m->channels, schema[type].text));
    end_record(&m->channels, from);
    return OM_OK;
}

// The queue as rosbag2 of Jazzy writes it: a player offers the topic in the same way.
static OmStatus print_qos(const McapTopic* topic, OmText* yaml) {
    static const char forever[] = "    sec: 9223372036\n    nsec: 854775807\n";
    return om_text_append(yaml,
                          "- history: keep_last\n  depth: %d\n  reliability: reliable\n"
                          "  durability: %s\n  deadline:\n%s  lifespan:\n%s"
                          "  liveliness: automatic\n  liveliness_lease_duration:\n%s"
                          "  avoid_ros_namespace_conventions: false\n",
                          topic->depth, topic->is_latched ? "transient_local" : "volatile", forever,
                          forever, forever);
}

static OmStatus add_channel(Mcap* m, const McapTopic* topic, const char* qos) {
    OmText* out = &m->channels;
    char name[130];
    size_t from;
    snprintf(name, sizeof name, "/%s", topic->name);
    OM_TRY(begin_record(out, CHANNEL, &from));
    OM_TRY(add_number(out, (uint64_t)m->nchannel, 2));
    OM_TRY(add_number(out, (uint64_t)topic->type + 1, 2));
    OM_TRY(add_string(out, name));
    OM_TRY(add_string(out, "cdr"));
    const size_t map = out->len;
    OM_TRY(add_number(out, 0, 4));
    OM_TRY(add_string(out, "offered_qos_profiles"));
    OM_TRY(add_string(out, qos));
    OM_TRY(add_string(out, "topic_type_hash"));
    OM_TRY(add_string(out, topic->hash));
    const size_t size = out->len - map - 4;
    for (size_t i = 0; i < 4; ++i) out->str[map + i] = (char)(size >> 8 * i & 0xff);
    end_record(out, from);
    return OM_OK;
}

OmStatus om__mcap_add(Mcap* mcap, const McapTopic* topic, int* channel) {
    OmText qos = {0};
    *channel = -1;
    if (!schema[topic->type].text) return OM_OK;
    OM_GROW(mcap->channel, mcap->nchannel, mcap->capacity, 64);
    OmText* all = &mcap->channels;
    const size_t from = all->len;
    const bool is_new = !mcap->has_schema[topic->type];
    OmStatus status = is_new ? add_schema(mcap, topic->type) : OM_OK;
    if (status == OM_OK) status = print_qos(topic, &qos);
    if (status == OM_OK) status = add_channel(mcap, topic, qos.str);
    if (status == OM_OK)
        status = om_text_append_raw(&mcap->records, all->str + from, all->len - from);
    om_text_done(&qos);
    if (status < 0) {
        all->len = from;
        return status;
    }
    mcap->has_schema[topic->type] = true;
    mcap->nschema += is_new;
    *channel = mcap->nchannel;
    mcap->channel[mcap->nchannel++] = (Channel){0};
    return OM_OK;
}

uint32_t om__mcap_crc(const void* data, size_t size) {
    return (uint32_t)crc32_z(0, (const Bytef*)data, size);
}

// ---- the file -----------------------------------------------------------------------------------------------------

static OmStatus print_statistics(Mcap* m, OmText* out) {
    size_t from;
    OM_TRY(begin_record(out, STATISTICS, &from));
    OM_TRY(add_number(out, m->nmessage, 8));
    OM_TRY(add_number(out, (uint64_t)m->nschema, 2));
    OM_TRY(add_number(out, (uint64_t)m->nchannel, 4));
    OM_TRY(add_number(out, 0, 4));  // attachments
    OM_TRY(add_number(out, 0, 4));  // metadata
    OM_TRY(add_number(out, m->nchunk, 4));
    OM_TRY(add_number(out, m->first, 8));
    OM_TRY(add_number(out, m->last, 8));
    OM_TRY(add_number(out, 10 * (uint64_t)m->nchannel, 4));
    for (int c = 0; c < m->nchannel; ++c) {
        OM_TRY(add_number(out, (uint64_t)c, 2));
        OM_TRY(add_number(out, m->channel[c].nmessage, 8));
    }
    end_record(out, from);
    return OM_OK;
}

// The records behind the last chunk, which end at `at`.
static OmStatus print_ending(Mcap* m, uint64_t at, OmText* out) {
    size_t from;
    out->len = 0;
    OM_TRY(begin_record(out, DATA_END, &from));
    OM_TRY(add_number(out, 0, 4));  // no CRC
    end_record(out, from);
    const size_t summary = out->len;
    OM_TRY(om_text_append_raw(out, m->channels.str, m->channels.len));
    OM_TRY(print_statistics(m, out));
    OM_TRY(om_text_append_raw(out, m->chunks.str, m->chunks.len));
    OM_TRY(begin_record(out, FOOTER, &from));
    OM_TRY(add_number(out, at + summary, 8));
    OM_TRY(add_number(out, 0, 8));  // no table of groups
    put_number(out, from, 20);
    const uint32_t crc = om__mcap_crc(out->str + summary, out->len - summary);
    OM_TRY(add_number(out, crc, 4));
    return om_text_append_raw(out, magic, sizeof magic);
}

static OmStatus write_all(Mcap* m, const OmText* out) {
    size_t done = 0;
    while (done < out->len) {
        const ssize_t n = pwrite(m->fd, out->str + done, out->len - done, (off_t)(m->at + done));
        if (n < 0 && errno == EINTR) continue;
        OM_CHECK(n > 0, OM_IO, "%s: %s", m->path, n < 0 ? strerror(errno) : "nothing is written");
        done += (size_t)n;
    }
    return OM_OK;
}

static OmStatus print_chunk(Mcap* m, OmText* out) {
    size_t from;
    OM_TRY(begin_record(out, CHUNK, &from));
    OM_TRY(add_number(out, m->held_first, 8));
    OM_TRY(add_number(out, m->held_last, 8));
    OM_TRY(add_number(out, m->records.len, 8));
    OM_TRY(add_number(out, om__mcap_crc(m->records.str, m->records.len), 4));
    OM_TRY(add_string(out, ""));  // no compression
    OM_TRY(add_number(out, m->records.len, 8));
    OM_TRY(om_text_append_raw(out, m->records.str, m->records.len));
    end_record(out, from);
    return OM_OK;
}

static OmStatus print_index(Mcap* m, int c, OmText* out) {
    const OmText* index = &m->channel[c].index;
    size_t from;
    OM_TRY(begin_record(out, MESSAGE_INDEX, &from));
    OM_TRY(add_number(out, (uint64_t)c, 2));
    OM_TRY(add_number(out, index->len, 4));
    OM_TRY(om_text_append_raw(out, index->str, index->len));
    end_record(out, from);
    return OM_OK;
}

// The chunk in memory with its indexes, and its line in the summary.
static OmStatus print_held(Mcap* m) {
    OmText *out = &m->out, *line = &m->chunks;
    uint64_t nindex = 0;
    size_t from;
    out->len = 0;
    OM_TRY(print_chunk(m, out));
    const uint64_t size = out->len;
    for (int c = 0; c < m->nchannel; ++c) nindex += m->channel[c].index.len > 0;
    OM_TRY(begin_record(line, CHUNK_INDEX, &from));
    OM_TRY(add_number(line, m->held_first, 8));
    OM_TRY(add_number(line, m->held_last, 8));
    OM_TRY(add_number(line, m->at, 8));
    OM_TRY(add_number(line, size, 8));
    OM_TRY(add_number(line, 10 * nindex, 4));
    for (int c = 0; c < m->nchannel; ++c) {
        if (m->channel[c].index.len == 0) continue;
        OM_TRY(add_number(line, (uint64_t)c, 2));
        OM_TRY(add_number(line, m->at + out->len, 8));
        OM_TRY(print_index(m, c, out));
    }
    OM_TRY(add_number(line, out->len - size, 8));
    OM_TRY(add_string(line, ""));
    OM_TRY(add_number(line, m->records.len, 8));
    OM_TRY(add_number(line, m->records.len, 8));
    end_record(line, from);
    return OM_OK;
}

static OmStatus write_held(Mcap* m) {
    if (m->records.len > 0) {
        OM_TRY(print_held(m));
        ++m->nchunk;
    }
    const size_t size = m->out.len;
    OM_TRY(print_ending(m, m->at + size, &m->ending));
    OM_TRY(om_text_append_raw(&m->out, m->ending.str, m->ending.len));
    OM_TRY(write_all(m, &m->out));
    m->at += size;
    return OM_OK;
}

static void forget_held(Mcap* m) {
    m->records.len = m->out.len = 0;
    for (int c = 0; c < m->nchannel; ++c) m->channel[c].index.len = 0;
    m->nheld = 0;
}

// A full disk: the ending of the whole chunks has room where the last one was.
static void mend(Mcap* m) {
    for (int c = 0; c < m->nchannel; ++c)
        m->channel[c].nmessage -= (uint32_t)(m->channel[c].index.len / 16);
    m->nmessage -= m->nheld;
    m->first = m->kept_first, m->last = m->kept_last;
    forget_held(m);
    if (print_ending(m, m->at, &m->ending) == OM_OK && ftruncate(m->fd, (off_t)m->at) == 0)
        (void)write_all(m, &m->ending);
}

// The chunk in memory goes to the file; after an error of the disk it is lost, and the file is whole without it.
static OmStatus flush(Mcap* m) {
    const size_t nline = m->chunks.len;
    const uint32_t nchunk = m->nchunk;
    const OmStatus status = write_held(m);
    m->written = om_clock_now();
    if (status < 0) {
        m->chunks.len = nline;
        m->nchunk = nchunk;
        m->out.len = 0;
        if (status == OM_IO) {
            char why[300];
            snprintf(why, sizeof why, "%s", om_error_message());
            mend(m);
            return om_error(OM_IO, "%s", why);
        }
        return status;
    }
    m->kept_first = m->first, m->kept_last = m->last;
    forget_held(m);
    return OM_OK;
}

static OmStatus begin(Mcap* m) {
    size_t from;
    OM_TRY(om_text_append_raw(&m->out, magic, sizeof magic));
    OM_TRY(begin_record(&m->out, HEADER, &from));
    OM_TRY(add_string(&m->out, "ros2"));
    OM_TRY(add_string(&m->out, "omentum"));
    end_record(&m->out, from);
    return flush(m);
}

static void destroy(Mcap* m) {
    if (m->fd >= 0) close(m->fd);
    for (int c = 0; c < m->nchannel; ++c) om_text_done(&m->channel[c].index);
    om_free(m->channel);
    OmText* all[] = {&m->records, &m->channels, &m->chunks, &m->out, &m->ending};
    for (size_t k = 0; k < sizeof all / sizeof *all; ++k) om_text_done(all[k]);
    om_free(m);
}

OmStatus om__mcap_open(const char* path, Mcap** mcap) {
    *mcap = NULL;
    Mcap* m = om_calloc(1, sizeof *m);
    if (!m) return OM_NO_MEMORY;
    snprintf(m->path, sizeof m->path, "%s", path);
    m->fd = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    OmStatus status = OM_OK;
    if (m->fd < 0)
        status = om_error(OM_IO, "%s: %s%s", path, strerror(errno),
                          errno == EEXIST ? "; a recording needs a new file" : "");
    if (status == OM_OK) {
        status = begin(m);
        if (status < 0) unlink(path);
    }
    if (status < 0)
        destroy(m);
    else
        *mcap = m;
    return status;
}

static OmStatus print_message(Mcap* m, int channel, uint64_t time, const void* cdr, size_t size) {
    Channel* c = &m->channel[channel];
    const size_t offset = m->records.len;
    size_t from;
    OM_TRY(begin_record(&m->records, MESSAGE, &from));
    OM_TRY(add_number(&m->records, (uint64_t)channel, 2));
    OM_TRY(add_number(&m->records, c->nmessage, 4));
    OM_TRY(add_number(&m->records, time, 8));
    OM_TRY(add_number(&m->records, time, 8));
    OM_TRY(om_text_append_raw(&m->records, cdr, size));
    end_record(&m->records, from);
    OM_TRY(add_number(&c->index, time, 8));
    return add_number(&c->index, offset, 8);
}

static void count(uint64_t* n, uint64_t* first, uint64_t* last, uint64_t time) {
    if (*n == 0 || time < *first) *first = time;
    if (*n == 0 || time > *last) *last = time;
    ++*n;
}

static OmStatus append(Mcap* m, int channel, uint64_t time, const void* cdr, size_t size) {
    Channel* c = &m->channel[channel];
    const size_t nrecord = m->records.len, nindex = c->index.len;
    const OmStatus status = print_message(m, channel, time, cdr, size);
    if (status < 0) {
        m->records.len = nrecord;
        c->index.len = nindex;
        return status;
    }
    ++c->nmessage;
    count(&m->nheld, &m->held_first, &m->held_last, time);
    count(&m->nmessage, &m->first, &m->last, time);
    const bool is_old = om_clock_now() - m->written >= CHUNK_TIME;
    const bool is_long = m->records.len >= CHUNK_SIZE;
    return (is_old || is_long) && m->records.len >= 2 * m->ending.len ? flush(m) : OM_OK;
}

OmStatus om__mcap_write(Mcap* mcap, int channel, double time, const void* cdr, size_t size) {
    const double second = floor(time);
    const uint64_t ns = (uint64_t)llround(1e9 * (time - second));
    return append(mcap, channel, (uint64_t)second * 1000000000u + ns, cdr, size);
}

OmStatus om__mcap_close(Mcap* mcap) {
    if (!mcap) return OM_OK;
    const OmStatus status = flush(mcap);
    destroy(mcap);
    return status;
}
