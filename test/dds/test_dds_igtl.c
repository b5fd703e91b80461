// test_dds_igtl.c: messages of OpenIGTLink, byte by byte, and the stream that carries them.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "dds/dds_igtl.h"
#include "dds/dds_udp.h"
#include "test_common.h"

static uint64_t number_at(const OmText* t, size_t at, int nbyte) {
    uint64_t value = 0;
    for (int i = 0; i < nbyte; ++i) value = value << 8 | (unsigned char)t->str[at + (size_t)i];
    return value;
}

static double float_at(const OmText* t, size_t at) {
    const uint32_t bits = (uint32_t)number_at(t, at, 4);
    float f;
    memcpy(&f, &bits, sizeof f);
    return (double)f;
}

// The check value of CRC-64/ECMA-182 in catalogues of CRCs.
static void crc(void** unused) {
    (void)unused;
    assert_true(om__igtl_crc("123456789", 9) == 0x6C40DF5F0B497347u);
    assert_true(om__igtl_crc("", 0) == 0);
}

// A quarter turn about z: x to y.
static void transform(void** unused) {
    (void)unused;
    static const double rotation[9] = {0, 1, 0, -1, 0, 0, 0, 0, 1};  // columns
    OmText t = {0};
    const OmPose pose = {om_vec3(0.01, -0.02, 0.03),
                         om_quat_axis_angle(om_vec3(0, 0, 1), OM_PI / 2)};
    assert_ok(om__igtl_transform("PSM1", 12.75, pose, &t));
    assert_int_equal(t.len, 58 + 48);
    assert_int_equal(number_at(&t, 0, 2), 1);
    assert_string_equal(t.str + 2, "TRANSFORM");
    assert_string_equal(t.str + 14, "PSM1");
    assert_int_equal(number_at(&t, 34, 4), 12);
    assert_int_equal(number_at(&t, 38, 4), 0xc0000000u);
    assert_int_equal(number_at(&t, 42, 8), 48);
    assert_true(number_at(&t, 50, 8) == om__igtl_crc(t.str + 58, 48));
    for (int i = 0; i < 9; ++i) assert_near(float_at(&t, 58 + 4 * (size_t)i), rotation[i], 1e-7);
    assert_near(float_at(&t, 58 + 36), 10, 1e-5);
    assert_near(float_at(&t, 58 + 40), -20, 1e-5);
    assert_near(float_at(&t, 58 + 44), 30, 1e-5);
    om_text_done(&t);
}

static void surface(void** unused) {
    (void)unused;
    double x[12] = {9, 9, 9, 0, 0, 0, 0.001, 0, 0, 0, 0.002, 0};
    int tri[3] = {0, 1, 2}, vert[3] = {1, 2, 3};
    const OmSurface s = {.nvert = 3, .ntri = 1, .tri_vert = tri};
    OmText t = {0};
    assert_ok(om__igtl_surface("Tissue", 1, &s, x, vert, &t));
    assert_int_equal(t.len, 58 + 40 + 36 + 16);
    assert_string_equal(t.str + 2, "POLYDATA");
    static const int count[10] = {3, 0, 0, 0, 0, 1, 16, 0, 0, 0};
    for (int i = 0; i < 10; ++i) assert_int_equal(number_at(&t, 58 + 4 * (size_t)i, 4), count[i]);
    assert_near(float_at(&t, 98 + 12), 1, 1e-6);      // mm
    assert_near(float_at(&t, 98 + 24 + 4), 2, 1e-6);  //
    static const int cell[4] = {3, 0, 1, 2};
    for (int i = 0; i < 4; ++i) assert_int_equal(number_at(&t, 134 + 4 * (size_t)i, 4), cell[i]);
    om_text_done(&t);
}

static int connect_to(int port) {
    const struct sockaddr_in at = {.sin_family = AF_INET,
                                   .sin_port = htons((uint16_t)port),
                                   .sin_addr = {htonl(INADDR_LOOPBACK)}};
    const int fd = socket(AF_INET, SOCK_STREAM, 0);
    assert_int_equal(connect(fd, (const struct sockaddr*)&at, sizeof at), 0);
    return fd;
}

// A slow client gets whole messages, and misses those in between; a client that is gone is forgotten.
static void stream(void** unused) {
    (void)unused;
    enum { SIZE = 30000000 };
    Stream *s, *same;
    int port = 42000 + getpid() % 5000;
    while (om__stream_open(port, &s) != OM_OK) ++port;
    assert_status(om__stream_open(port, &same), OM_IO);
    const int fd = connect_to(port), gone = connect_to(port);
    while (om__stream_count(s) < 2) poll(NULL, 0, 1);
    close(gone);
    while (om__stream_count(s) > 1) poll(NULL, 0, 1);
    char* data = malloc(SIZE);
    for (int k = 0; k < 4; ++k) {
        memset(data, 'a' + k, SIZE);
        assert_ok(om__stream_send(s, data, SIZE));
    }
    memset(data, 0, SIZE);
    size_t got = 0;
    while (got < SIZE) {
        const ssize_t n = recv(fd, data + got, SIZE - got, MSG_DONTWAIT);
        if (n > 0) got += (size_t)n;
        om__stream_count(s);
    }
    assert_int_equal(data[0], 'a');
    assert_int_equal(data[SIZE - 1], 'a');
    assert_ok(om__stream_send(s, "next", 4));
    assert_int_equal(recv(fd, data, 4, 0), 4);
    assert_memory_equal(data, "next", 4);
    free(data);
    close(fd);
    om__stream_close(s);
}

// A client that sends without end is read in parts of 16 kB, and dropped after 64; one that says little stays.
static void flood(void** unused) {
    (void)unused;
    static const char bytes[20000];
    Stream* s;
    int port = 42000 + getpid() % 5000, ncall = 0;
    while (om__stream_open(port, &s) != OM_OK) ++port;
    const int fd = connect_to(port), quiet = connect_to(port);
    while (om__stream_count(s) < 2) poll(NULL, 0, 1);
    assert_int_equal(send(quiet, bytes, 1000, 0), 1000);
    for (int k = 0; k < 6; ++k) (void)!send(fd, bytes, sizeof bytes, MSG_DONTWAIT | MSG_NOSIGNAL);
    while (om__stream_count(s) == 2 && ncall < 2000) {
        ++ncall;
        (void)!send(fd, bytes, sizeof bytes, MSG_DONTWAIT | MSG_NOSIGNAL);
        poll(NULL, 0, 1);
    }
    assert_true(ncall >= 4 && ncall < 2000);  // the fifth call reads beyond 64 kB
    for (int k = 0; k < 5; ++k) assert_int_equal(om__stream_count(s), 1);
    close(fd);
    close(quiet);
    om__stream_close(s);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(crc), cmocka_unit_test(transform),
                                       cmocka_unit_test(surface), cmocka_unit_test(stream),
                                       cmocka_unit_test(flood)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
