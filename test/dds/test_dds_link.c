// test_dds_link.c: messages of every type from a writer to a reader, names and hashes of types.
#include <string.h>

#include "dds/dds_link.h"
#include "test_alloc.h"
#include "test_common.h"
#include "test_domain.h"

static OmDdsDef make_def(void) {
    OmDdsDef def = om_dds_default_def();
    def.domain = test_domain();
    return def;
}

static Link* link_a;  // the domain's owner

static int open_link(void** unused) {
    (void)unused;
    const OmDdsDef def = make_def();
    unsetenv("CYCLONEDDS_URI");
    return om__link_create(&def, &link_a) < 0 ? -1 : 0;
}

static int close_link(void** unused) {
    (void)unused;
    om__link_destroy(link_a);
    return 0;
}

static void expect_same_message(LinkType type, const LinkMessage* a, const LinkMessage* b) {
    const bool has_time = type != LINK_STRING && type != LINK_EMPTY && type != LINK_NUMBER &&
                          type != LINK_BOOL && type != LINK_TICK;
    if (has_time) assert_near(a->time, b->time, 1e-9);
    switch (type) {
    case LINK_JOINTS: assert_memory_equal(&a->joints, &b->joints, sizeof a->joints); break;
    case LINK_POSE: assert_memory_equal(&a->pose, &b->pose, sizeof a->pose); break;
    case LINK_TWIST: assert_memory_equal(&a->twist, &b->twist, sizeof a->twist); break;
    case LINK_WRENCH: assert_memory_equal(&a->wrench, &b->wrench, sizeof a->wrench); break;
    case LINK_STRING:
    case LINK_STAMPED: assert_string_equal(a->text, b->text); break;
    case LINK_STATE:
        assert_string_equal(a->state.name, b->state.name);
        assert_true(a->state.is_homed == b->state.is_homed);
        assert_true(a->state.is_busy == b->state.is_busy);
        break;
    case LINK_TF:
        assert_int_equal(a->tf.n, b->tf.n);
        for (int i = 0; i < a->tf.n; ++i) {
            assert_string_equal(a->tf.frame[i].parent, b->tf.frame[i].parent);
            assert_string_equal(a->tf.frame[i].child, b->tf.frame[i].child);
            assert_memory_equal(&a->tf.frame[i].pose, &b->tf.frame[i].pose, sizeof(OmPose));
        }
        break;
    case LINK_INFO: assert_memory_equal(&a->info, &b->info, sizeof a->info); break;
    case LINK_IMAGE:
    case LINK_CLOUD:
        assert_int_equal(a->picture.width, b->picture.width);
        assert_int_equal(a->picture.height, b->picture.height);
        assert_int_equal(a->picture.step, b->picture.step);
        assert_int_equal(a->picture.size, b->picture.size);
        assert_memory_equal(a->picture.data, b->picture.data, a->picture.size);
        if (type == LINK_IMAGE) assert_string_equal(a->picture.encoding, b->picture.encoding);
        if (type == LINK_IMAGE) break;
        assert_int_equal(a->picture.point_step, b->picture.point_step);
        assert_int_equal(a->picture.z, b->picture.z);
        assert_int_equal(a->picture.rgb, b->picture.rgb);
        break;
    case LINK_BOOL: assert_true(a->is_on && b->is_on); break;
    case LINK_NUMBER: assert_near(a->number, b->number, 0); break;
    case LINK_TOCK: assert_string_equal(a->tick.error, b->tick.error); break;
    case LINK_TICK:
        assert_int_equal(a->tick.ncommand, b->tick.ncommand);
        assert_int_equal(a->tick.what, b->tick.what);
        assert_near(a->tick.dt, b->tick.dt, 0);
        break;
    default: break;
    }
}

// Numbers that no default has.
static LinkMessage make_message(LinkType type, const unsigned char* bytes, size_t size) {
    LinkMessage m = {.time = 12.345678901, .frame = "world"};
    const OmPose pose = {{0.1, -0.2, 0.3}, {0.5, -0.5, 0.5, -0.5}};
    switch (type) {
    case LINK_JOINTS:
        m.joints = (LinkJoints){.nname = 2, .nposition = 2, .nvelocity = 2, .neffort = 1};
        strcpy(m.joints.name[0], "yaw"), strcpy(m.joints.name[1], "pitch");
        m.joints.position[0] = 0.25, m.joints.position[1] = -1e-9;
        m.joints.velocity[1] = 3, m.joints.effort[0] = 7;
        break;
    case LINK_POSE: m.pose = pose; break;
    case LINK_TWIST: m.twist.linear = om_vec3(1, 2, 3), m.twist.angular.z = -5; break;
    case LINK_WRENCH: m.wrench.force = om_vec3(1, 2, 3), m.wrench.torque.y = -4; break;
    case LINK_STRING:
    case LINK_STAMPED: strcpy(m.text, "a sentence"); break;
    case LINK_STATE: strcpy(m.state.name, "ENABLED"), m.state.is_busy = true; break;
    case LINK_TF:
        m.tf.n = 20;  // a robot has more frames than arms
        for (int i = 0; i < m.tf.n; ++i) {
            strcpy(m.tf.frame[i].parent, "world");
            snprintf(m.tf.frame[i].child, 64, "PSM%d", i + 1);
            m.tf.frame[i].pose = pose;
        }
        break;
    case LINK_INFO:
        m.info.width = 320, m.info.height = 240;
        m.info.lens = (OmLens){400, 410, 160.5, 120.25, 0.1, -0.2, 0.01, 0.02, 0.3};
        break;
    case LINK_IMAGE:
    case LINK_CLOUD:
        m.picture = (LinkPicture){.width = 320,
                                  .height = (int)(size / 5120),
                                  .step = 5120,
                                  .point_step = 16,
                                  .y = 4,
                                  .z = 8,
                                  .rgb = 12,
                                  .data = bytes,
                                  .size = size};
        strcpy(m.picture.encoding, "rgb8");
        break;
    case LINK_BOOL: m.is_on = true; break;
    case LINK_NUMBER: m.number = 0.25; break;
    case LINK_TOCK: strcpy(m.tick.error, "why"); break;
    case LINK_TICK: m.tick.ncommand = 3, m.tick.what = 6, m.tick.dt = 0.02; break;
    default: break;
    }
    return m;
}

static bool take(Link* link, int id, LinkMessage* m) {
    const double end = om_clock_now() + 5;
    while (om_clock_now() < end) {
        if (om__link_take(link, id, m)) return true;
        om__link_wait(link, 0.05);
    }
    return false;
}

// A picture is 1.2 MB, as a cloud of 320 x 240 points.
static void every_type(void** unused) {
    (void)unused;
    const size_t size = 5120 * 240;
    unsigned char* bytes = malloc(size);
    for (size_t i = 0; i < size; ++i) bytes[i] = (unsigned char)(i * 7 + i / 256);
    Link* link_b;
    const OmDdsDef def = make_def();
    assert_ok(om__link_create(&def, &link_b));
    for (int type = 0; type < LINK_NTYPE; ++type) {
        char name[40];
        int out, in;
        snprintf(name, sizeof name, "test/type_%d", type);
        assert_ok(om__link_add(link_a, LINK_OUT, (LinkType)type, name, 2, &out));
        assert_ok(om__link_add(link_b, LINK_IN, (LinkType)type, name, 2, &in));
        const double end = om_clock_now() + 5;
        while (om__link_count(link_a, out) == 0 && om_clock_now() < end)
            om__link_wait(link_b, 0.01);
        assert_int_equal(om__link_count(link_a, out), 1);
        assert_int_equal(om__link_count(link_b, in), 1);
        const LinkMessage sent = make_message((LinkType)type, bytes, size);
        LinkMessage got;
        assert_ok(om__link_write(link_a, out, &sent));
        assert_true(take(link_b, in, &got));
        expect_same_message((LinkType)type, &sent, &got);
        assert_false(om__link_take(link_b, in, &got));
    }
    om__link_destroy(link_b);
    free(bytes);
}

// What a volatile reader that comes late must not get, and a latched one must.
static void latched(void** unused) {
    (void)unused;
    int out, in_volatile, in_latched;
    LinkMessage m = {.text = "enable"}, got;
    assert_ok(om__link_add(link_a, LINK_OUT | LINK_LATCHED, LINK_STAMPED, "test/l", 1, &out));
    assert_ok(om__link_write(link_a, out, &m));
    assert_ok(om__link_add(link_a, LINK_IN, LINK_STAMPED, "test/l", 1, &in_volatile));
    assert_ok(om__link_add(link_a, LINK_IN | LINK_LATCHED, LINK_STAMPED, "test/l", 1, &in_latched));
    assert_true(take(link_a, in_latched, &got));
    assert_string_equal(got.text, "enable");
    assert_false(om__link_take(link_a, in_volatile, &got));
}

static void names(void** unused) {
    (void)unused;
    assert_string_equal(om__link_type_name(LINK_JOINTS), "sensor_msgs::msg::dds_::JointState_");
    assert_string_equal(om__link_type_name(LINK_STATE), "crtk_msgs::msg::dds_::OperatingState_");
    for (int type = 0; type < LINK_NTYPE; ++type) {
        const char* hash = om__link_type_hash((LinkType)type);
        assert_int_equal(strlen(hash), 7 + 64);
        assert_int_equal(strspn(hash + 7, "0123456789abcdef"), 64);
    }
}

static void wrong_fields(void** unused) {
    (void)unused;
    Link* link;
    OmDdsDef def = {0};
    assert_status(om__link_create(&def, &link), OM_INVALID);
    def = make_def();
    def.domain = 233;
    assert_status(om__link_create(&def, &link), OM_INVALID);
    def = make_def();
    def.network = "lo\"/><x";
    assert_status(om__link_create(&def, &link), OM_INVALID);
}

static OmStatus make_link(void* ctx) {
    Link* link;
    int id;
    (void)ctx;
    const OmDdsDef def = make_def();
    OM_TRY(om__link_create(&def, &link));
    const OmStatus status = om__link_add(link, LINK_OUT, LINK_POSE, "test/memory", 1, &id);
    om__link_destroy(link);
    return status;
}

static void memory(void** unused) {
    (void)unused;
    assert_true(test_failing_allocations(make_link, NULL, 1) > 1);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_type), cmocka_unit_test(latched),
                                       cmocka_unit_test(names), cmocka_unit_test(wrong_fields),
                                       cmocka_unit_test(memory)};
    return cmocka_run_group_tests(tests, open_link, close_link);
}
