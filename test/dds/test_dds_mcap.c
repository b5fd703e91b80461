// test_dds_mcap.c: the bytes of a recording, read by a walk over its records as MCAP's specification has them; and the
// bytes of messages against the ones of a reader of Cyclone DDS.
#include <signal.h>
#include <string.h>
#include <sys/resource.h>
#define asm __asm__  // ddsrt uses the name that C17 does not have
#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#undef asm
#include <dds_types.h>

#include "dds/dds_tape.h"
#include "mcap_walk.h"
#include "test_alloc.h"
#include "test_common.h"
#include "test_domain.h"

#define NTOPIC 3

static OmStatus add_topics(Mcap* mcap, int channel[NTOPIC]) {
    static const McapTopic topic[NTOPIC] = {{"PSM1/status", LINK_STRING, 5, false, "RIHS01_0"},
                                            {"PSM1/hold", LINK_EMPTY, 5, false, "RIHS01_1"},
                                            {"tf_static", LINK_TF, 1, true, "RIHS01_2"}};
    for (int i = 0; i < NTOPIC; ++i) OM_TRY(om__mcap_add(mcap, &topic[i], &channel[i]));
    return OM_OK;
}

static void bytes(void** unused) {
    (void)unused;
    const char* name = path("bytes");
    Mcap* mcap;
    int channel[NTOPIC];
    assert_ok(om__mcap_open(name, &mcap));
    assert_ok(add_topics(mcap, channel));
    assert_int_equal(channel[1], -1);  // a type that the robot does not publish
    assert_ok(om__mcap_write(mcap, channel[0], 2.5, "first", 5));
    assert_ok(om__mcap_write(mcap, channel[2], 1.25, "second one", 10));
    assert_ok(om__mcap_write(mcap, channel[0], 3.999999999, "", 0));
    assert_ok(om__mcap_close(mcap));
    Bytes b = read_file(name);
    const Seen s = see(b);
    assert_int_equal(s.nmessage, 3);
    assert_int_equal(s.first, 1250000000);
    assert_int_equal(s.last, 3999999999);
    assert_int_equal(s.size[1], 10);
    assert_memory_equal(s.data[1], "second one", 10);
    assert_int_equal(s.nrecord[3], 4);  // two schemas, in the chunk and in the summary
    assert_int_equal(s.nrecord[4], 4);
    assert_int_equal(s.nrecord[7], 2);
    free(b.at);
    // a recording is not written over another one
    assert_status(om__mcap_open(name, &mcap), OM_IO);
    assert_null(mcap);
    unlink(name);
    assert_status(om__mcap_open("/nowhere/at/all", &mcap), OM_IO);
}

// A program that is killed ends here, between two writes: the file is whole, up to its last chunk. If the ending were
// written at the end alone, it would not be.
static void killed(void** unused) {
    (void)unused;
    enum { SIZE = 100000 };
    const char* name = path("killed");
    static char text[SIZE];
    Mcap* mcap;
    int channel[NTOPIC];
    uint64_t before = 0;
    assert_ok(om__mcap_open(name, &mcap));
    Bytes b = read_file(name);
    assert_int_equal(see(b).nmessage, 0);
    free(b.at);
    assert_ok(add_topics(mcap, channel));
    for (int i = 0; i < 100; ++i) {
        assert_ok(om__mcap_write(mcap, channel[0], 0.01 * i, text, SIZE));
        if (i % 33 != 32) continue;
        b = read_file(name);
        const Seen s = see(b);
        assert_true(s.nmessage <= (uint64_t)i + 1 && s.nmessage + 43 > (uint64_t)i);
        assert_true(i < 42 || s.nmessage > before);
        before = s.nmessage;
        free(b.at);
    }
    assert_ok(om__mcap_close(mcap));
    b = read_file(name);
    assert_int_equal(see(b).nmessage, 100);
    free(b.at);
    unlink(name);
}

// A disk that is full within a chunk: an error, and a file that is whole with the chunks before.
static void full_disk(void** unused) {
    (void)unused;
    enum { SIZE = 1000000 };
    const char* name = path("full");
    char* text = calloc(SIZE, 1);
    struct rlimit before, small;
    Mcap* mcap;
    int channel[NTOPIC], n = 0;
    OmStatus status = OM_OK;
    assert_ok(om__mcap_open(name, &mcap));
    assert_ok(add_topics(mcap, channel));
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    small = before;
    small.rlim_cur = 7000000;
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
    while (status == OM_OK && n < 20)
        status = om__mcap_write(mcap, channel[0], 1 + n++, text, SIZE);
    assert_status(status, OM_IO);
    assert_non_null(strstr(om_error_message(), name));
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    Bytes b = read_file(name);
    const Seen s = see(b);
    assert_int_equal(s.nmessage, 5);  // the first chunk: 4 MiB and a bit
    assert_int_equal(s.last, 5000000000);
    assert_int_equal(n, 10);
    free(b.at);
    assert_ok(om__mcap_close(mcap));
    unlink(name);
    free(text);
}

static OmDdsDef make_def(void) {
    OmDdsDef def = om_dds_default_def();
    def.domain = test_domain();
    return def;
}

static LinkMessage make_message(LinkType type) {
    static const unsigned char pixel[48] = {1, 2, 3};
    LinkMessage m = {.time = 12.345678901, .frame = "world"};
    switch (type) {
    case LINK_JOINTS:
        m.joints = (LinkJoints){.nname = 2, .nposition = 2, .nvelocity = 1};
        strcpy(m.joints.name[0], "yaw"), strcpy(m.joints.name[1], "pitch");
        m.joints.position[1] = -1e-9;
        break;
    case LINK_STATE: strcpy(m.state.name, "ENABLED"), m.state.is_busy = true; break;
    case LINK_TF:
        m.tf.n = 2;
        strcpy(m.tf.frame[0].child, "a"), strcpy(m.tf.frame[1].child, "longer");
        break;
    case LINK_INFO: m.info.width = 320, m.info.lens.fx = 400, m.info.lens.k3 = 0.3; break;
    default:
        m.picture = (LinkPicture){.width = 3, .height = 1, .step = 48, .point_step = 16};
        m.picture.y = 4, m.picture.z = 8, m.picture.rgb = 12;
        m.picture.data = pixel, m.picture.size = sizeof pixel;
        break;
    }
    return m;
}

// What a reader gets of Cyclone, without its padding to 4 bytes.
static size_t take_wire(dds_entity_t reader, unsigned char* at, size_t room) {
    struct ddsi_serdata* data = NULL;
    dds_sample_info_t info;
    const double end = om_clock_now() + 5;
    while (dds_takecdr(reader, &data, 1, &info, DDS_ANY_STATE) <= 0 && om_clock_now() < end)
        dds_sleepfor(DDS_MSECS(1));
    assert_non_null(data);
    const size_t size = ddsi_serdata_size(data);
    assert_true(size <= room);
    ddsi_serdata_to_ser(data, 0, size, at);
    ddsi_serdata_unref(data);
    return size - (at[3] & 3);
}

// A field of a type that is left out, or another encoding, would be noticed.
static void wire(void** unused) {
    (void)unused;
    static const struct {
        LinkType type;
        const dds_topic_descriptor_t* desc;
    } row[] = {{LINK_JOINTS, &sensor_msgs_msg_dds__JointState__desc},
               {LINK_STATE, &crtk_msgs_msg_dds__OperatingState__desc},
               {LINK_TF, &tf2_msgs_msg_dds__TFMessage__desc},
               {LINK_INFO, &sensor_msgs_msg_dds__CameraInfo__desc},
               {LINK_CLOUD, &sensor_msgs_msg_dds__PointCloud2__desc}};
    enum { NROW = sizeof row / sizeof *row };
    const OmDdsDef def = make_def();
    const char* name = path("wire");
    Tape* tape;
    Link* link;
    unsigned char got[NROW][2000];
    size_t size[NROW];
    unsetenv("CYCLONEDDS_URI");
    assert_ok(om__tape_open(name, &tape));
    assert_ok(om__link_create(&def, &link));
    om__link_record(link, tape, true);
    const dds_entity_t other = dds_create_participant((dds_domainid_t)def.domain, NULL, NULL);
    dds_qos_t* qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
    for (int i = 0; i < NROW; ++i) {
        char topic[20];
        int id;
        snprintf(topic, sizeof topic, "rt/t%d", i);
        const dds_entity_t t = dds_create_topic(other, row[i].desc, topic, NULL, NULL);
        const dds_entity_t reader = dds_create_reader(other, t, qos, NULL);
        assert_true(reader > 0);
        assert_ok(om__link_add(link, LINK_OUT, row[i].type, topic + 3, 1, &id));
        assert_true(om__link_is_wanted(link, id));
        for (int k = 0; k < 500 && om__link_count(link, id) == 0; ++k) dds_sleepfor(DDS_MSECS(10));
        const LinkMessage m = make_message(row[i].type);
        assert_ok(om__link_write(link, id, &m));
        size[i] = take_wire(reader, got[i], sizeof got[i]);
    }
    dds_delete_qos(qos);
    dds_delete(other);
    om__link_destroy(link);
    assert_ok(om__tape_close(tape));
    Bytes b = read_file(name);
    const Seen s = see(b);
    assert_int_equal(s.nmessage, NROW);
    assert_int_equal(s.first, 12345678901);
    for (int i = 0; i < NROW; ++i) {
        assert_int_equal(s.size[i], size[i]);
        assert_memory_equal(s.data[i], got[i], 2);  // the options behind it count Cyclone's padding
        assert_memory_equal(s.data[i] + 4, got[i] + 4, size[i] - 4);
    }
    free(b.at);
    unlink(name);
}

static OmStatus make_recording(void* ctx) {
    const char* name = path("memory");
    Mcap* mcap;
    int channel[NTOPIC];
    (void)ctx;
    unlink(name);
    OM_TRY(om__mcap_open(name, &mcap));
    OmStatus status = add_topics(mcap, channel);
    if (status == OM_OK) status = om__mcap_write(mcap, channel[0], 1, "text", 4);
    const OmStatus closed = om__mcap_close(mcap);
    unlink(name);
    return status < 0 ? status : closed;
}

static void memory(void** unused) {
    (void)unused;
    assert_true(test_failing_allocations(make_recording, NULL, 1) > 5);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(bytes), cmocka_unit_test(killed),
                                       cmocka_unit_test(full_disk), cmocka_unit_test(wire),
                                       cmocka_unit_test(memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
