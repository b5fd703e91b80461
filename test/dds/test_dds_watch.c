// test_dds_watch.c: what a program that watches gets, and when: a box and one tool, over a socket.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "omentum/dds.h"
#include "test_alloc.h"
#include "test_common.h"

static int port(void) { return 47100 + getpid() % 3000; }

static OmTetMesh make_box(void) {
    OmTetMesh mesh;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(1, 1, 1), 1, 1, 1, &mesh));
    return mesh;
}

static int call(void) {
    const struct sockaddr_in to = {.sin_family = AF_INET,
                                   .sin_port = htons((uint16_t)port()),
                                   .sin_addr = {htonl(INADDR_LOOPBACK)}};
    const int fd = socket(AF_INET, SOCK_STREAM, 0);
    assert_int_equal(connect(fd, (const struct sockaddr*)&to, sizeof to), 0);
    return fd;
}

static bool wait_until_due(OmWatch* watch) {
    const double end = om_clock_now() + 5;
    bool is_due = false;
    while (!(is_due = om_watch_is_due(watch)) && om_clock_now() < end)
        nanosleep(&(struct timespec){0, 1000000}, NULL);
    return is_due;
}

// The next message: its body's size, and its type.
static int read_message(int fd, char type[13]) {
    unsigned char head[58], body[2000];
    assert_int_equal(recv(fd, head, sizeof head, MSG_WAITALL), sizeof head);
    memcpy(type, head + 2, 12);
    type[12] = 0;
    const int size = head[48] << 8 | head[49];
    assert_true(size > 0 && size <= (int)sizeof body);
    assert_int_equal(recv(fd, body, (size_t)size, MSG_WAITALL), size);
    return size;
}

// Nothing is due without a client. Then a tool 30 times a second, the surface with the first and the sixth: a cube has
// 8 vertices and 12 triangles, whatever its tetrahedra.
static void messages(void** unused) {
    (void)unused;
    const OmWatchTool tool = {"PSM1", om_pose_identity()};
    OmTetMesh mesh = make_box();
    OmWatch *watch, *other;
    char type[13];
    assert_ok(om_watch_create(port(), &mesh, &watch));
    assert_status(om_watch_create(port(), &mesh, &other), OM_IO);
    assert_null(other);
    assert_false(om_watch_is_due(watch));
    const int fd = call();
    const double start = om_clock_now();
    for (int i = 0; i < 7; ++i) {
        assert_true(wait_until_due(watch));
        assert_false(om_watch_is_due(watch));
        assert_ok(om_watch_send(watch, 1.5 * i, &tool, 1, mesh.x));
        assert_int_equal(read_message(fd, type), 48);
        assert_string_equal(type, "TRANSFORM");
        if (i % 5 != 0) continue;
        assert_int_equal(read_message(fd, type), 40 + 12 * 8 + 16 * 12);
        assert_string_equal(type, "POLYDATA");
    }
    assert_true(om_clock_now() - start > 5.9 / 30);  // six periods
    assert_int_equal(recv(fd, type, 1, MSG_DONTWAIT), -1);
    close(fd);
    om_watch_destroy(watch);
    om_tet_mesh_done(&mesh);
}

static OmStatus make_watch(void* ctx) {
    OmWatch* watch;
    OM_TRY(om_watch_create(port(), ctx, &watch));
    om_watch_destroy(watch);
    return OM_OK;
}

static void memory(void** unused) {
    (void)unused;
    OmTetMesh mesh = make_box();
    assert_true(test_failing_allocations(make_watch, &mesh, 1) > 2);
    om_tet_mesh_done(&mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(messages), cmocka_unit_test(memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
