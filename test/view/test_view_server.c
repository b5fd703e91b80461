// test_view_server.c: the server by clients of a few lines: pages, refusals, controls, bad messages, a slow reader.
#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <poll.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>

#include "base/base_rng.h"
#include "omentum/view_server.h"
#include "test_common.h"

static OmViewServer* server;
static int port;

static int open_server(void** unused) {
    (void)unused;
    OmViewServerDef def = om_view_server_default_def();
    def.port = 0;
    def.title = "a <b>";
    if (om_view_server_create(&def, &server) < 0) return -1;
    const char* url = om_view_server_url(server);
    return sscanf(url, "http://127.0.0.1:%d/", &port) == 1 ? 0 : -1;
}

static int close_server(void** unused) {
    (void)unused;
    om_view_server_destroy(server);
    return 0;
}

// ---- a client -----------------------------------------------------------------------------------------------

static int open_socket(int to) {
    const struct sockaddr_in at = {.sin_family = AF_INET,
                                   .sin_port = htons((uint16_t)to),
                                   .sin_addr = {htonl(INADDR_LOOPBACK)}};
    const int fd = socket(AF_INET, SOCK_STREAM, 0);
    assert_int_equal(connect(fd, (const struct sockaddr*)&at, sizeof at), 0);
    return fd;
}

// Up to `size` bytes, until the other side closes or is silent for `ms`.
static size_t read_some(int fd, char* text, size_t size, int ms) {
    size_t n = 0;
    while (n < size) {
        struct pollfd p = {.fd = fd, .events = POLLIN};
        if (poll(&p, 1, ms) <= 0) break;
        const ssize_t k = read(fd, text + n, size - n);
        if (k <= 0) break;
        n += (size_t)k;
    }
    return n;
}

static void write_all(int fd, const char* data, size_t size) {
    while (size > 0) {
        const ssize_t k = send(fd, data, size, MSG_NOSIGNAL);
        if (k <= 0) return;  // the server may have closed it
        data += k, size -= (size_t)k;
    }
}

// The head of the answer to a request.
static void get_at(int to, const char* path, const char* headers, char answer[4000]) {
    char text[600];
    const int fd = open_socket(to);
    snprintf(text, sizeof text, "GET %s HTTP/1.1\r\n%s\r\n", path, headers);
    write_all(fd, text, strlen(text));
    answer[read_some(fd, answer, 3999, 300)] = 0;
    close(fd);
}

static void get(const char* path, const char* headers, char answer[4000]) {
    get_at(port, path, headers, answer);
}

// A WebSocket with this Host and Origin; -1: it was refused.
static int open_page_as(const char* host, const char* origin) {
    char text[600], answer[400] = "";
    const int fd = open_socket(port);
    snprintf(
        text, sizeof text,
        "GET / HTTP/1.1\r\nHost: %s:%d\r\nOrigin: http://%s:%d\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Protocol: omentum\r\n\r\n",
        host, port, origin, port);
    write_all(fd, text, strlen(text));
    for (size_t n = 0; n < sizeof answer - 1 && !strstr(answer, "\r\n\r\n"); ++n)
        if (read_some(fd, answer + n, 1, 500) == 0) break;
    if (strstr(answer, " 101 ")) return fd;
    close(fd);
    return -1;
}

static int open_page(void) {
    const int fd = open_page_as("127.0.0.1", "127.0.0.1");
    assert_true(fd >= 0);
    return fd;
}

// A message of a page is masked; the mask is 0 here.
static void send_message(int fd, int opcode, const char* data, size_t size) {
    char head[8] = {(char)(0x80 | opcode), (char)(0x80 | size)};
    size_t n = 2;
    if (size >= 126) {
        head[1] = (char)(0x80 | 126);
        head[2] = (char)(size >> 8), head[3] = (char)size;
        n = 4;
    }
    memset(head + n, 0, 4);
    write_all(fd, head, n + 4 <= sizeof head ? n + 4 : sizeof head);
    write_all(fd, data, size);
}

static void send_line(int fd, const char* line) { send_message(fd, 1, line, strlen(line)); }

// The next message of the server. @return its bytes, 0: none came
static size_t next_message(int fd, char* data, size_t size) {
    unsigned char head[8];
    if (read_some(fd, (char*)head, 2, 1000) < 2) return 0;
    size_t n = head[1] & 127;
    const int more = n == 126 ? 2 : n == 127 ? 8 : 0;
    if (more && read_some(fd, (char*)head, (size_t)more, 1000) < (size_t)more) return 0;
    for (int i = 0; i < more; ++i) n = i == 0 ? head[0] : n << 8 | head[i];
    assert_true(n < size);
    assert_int_equal(read_some(fd, data, n, 1000), n);
    data[n] = 0;
    return n;
}

// Wait for something that the server's thread does.
static void nap(void) {
    const struct timespec t = {0, 10000000};
    nanosleep(&t, NULL);
}

static bool wait_for(bool (*is_so)(void)) {
    bool is = false;
    for (int i = 0; i < 200 && !(is = is_so()); ++i) nap();
    return is;
}

static char line[OM_VIEW_MAX_LINE + 1];
static bool has_line(void) { return om_view_server_next(server, line, sizeof line); }
static bool has_no_page(void) { return om_view_server_count(server) == 0; }
static bool has_page(void) { return om_view_server_count(server) > 0; }

static void begin(void) {
    assert_true(wait_for(has_no_page));
    while (has_line()) {
    }
    om_view_server_clear(server);
}

static void expect_text(int fd, const char* text) {
    char data[4000];
    assert_true(next_message(fd, data, sizeof data) > 0);
    assert_string_equal(data, text);
}

// A page with the controls, and one that watches.
static void open_two(int* first, int* second) {
    begin();
    *first = open_page();
    expect_text(*first, "{\"control\":true}");
    *second = open_page();
    expect_text(*second, "{\"control\":false}");
}

// ---- tests --------------------------------------------------------------------------------------------------

static void files_come_with_their_rules(void** unused) {
    (void)unused;
    char a[4000];
    get("/", "Host: localhost:1\r\n", a);
    assert_non_null(strstr(a, "200 OK"));
    assert_non_null(strstr(a, "script-src 'self'"));
    assert_non_null(strstr(a, "nosniff"));
    assert_non_null(strstr(a, "<title>a &lt;b&gt;: omentum</title>"));
    assert_null(strstr(a, "<script>"));
    get("/page.js", "Host: 127.0.0.1\r\n", a);
    assert_non_null(strstr(a, "text/javascript"));
    get("/../etc/passwd", "Host: 127.0.0.1\r\n", a);
    assert_null(strstr(a, "200 OK"));
    get("/no", "Host: 127.0.0.1\r\n", a);
    assert_non_null(strstr(a, "404"));
}

static void strangers_are_refused(void** unused) {
    (void)unused;
    char a[4000];
    get("/", "Host: evil.example\r\n", a);
    assert_non_null(strstr(a, "403"));
    get("/", "Host: 127.0.0.1.evil.example\r\n", a);
    assert_non_null(strstr(a, "403"));
    get("/page.js", "Host: 127.0.0.1\r\nOrigin: http://evil.example\r\n", a);
    assert_non_null(strstr(a, "403"));
    char origin[300] = "Host: 127.0.0.1\r\nOrigin: http://";  // one that is longer than any of ours
    for (size_t n = strlen(origin); n < 280; ++n) origin[n] = n % 60 ? 'a' : '.';
    strcpy(origin + 280, ".example\r\n");
    get("/page.js", origin, a);
    assert_non_null(strstr(a, "403"));
    assert_int_equal(open_page_as("127.0.0.1", "evil.example"), -1);
    assert_int_equal(open_page_as("evil.example", "evil.example"), -1);
    assert_true(has_no_page());
}

static void a_page_gets_what_lasts_and_the_newest(void** unused) {
    (void)unused;
    begin();
    const char *one = "{\"words\":\"one\"}", *two = "{\"words\":\"two\"}";
    const char old[] = "\4\0\0\0old!", new[] = "\4\0\0\0new!";
    assert_ok(om_view_server_publish(server, OM_VIEW_LASTING, one, strlen(one)));
    assert_ok(om_view_server_publish(server, OM_VIEW_NEWEST, old, 8));
    assert_ok(om_view_server_publish(server, OM_VIEW_NEWEST, new, 8));
    assert_ok(om_view_server_publish(server, OM_VIEW_LASTING, two, strlen(two)));
    const int fd = open_page();
    expect_text(fd, "{\"control\":true}");
    expect_text(fd, one);
    expect_text(fd, two);
    expect_text(fd, "new!");
    assert_ok(om_view_server_publish(server, OM_VIEW_NEWEST, old, 8));
    expect_text(fd, "old!");
    // a status does not take the place of a frame, and the last one counts
    const char *slow = "{\"rate\":1}", *fast = "{\"rate\":2}";
    assert_ok(om_view_server_publish(server, OM_VIEW_STATUS, slow, strlen(slow)));
    assert_ok(om_view_server_publish(server, OM_VIEW_STATUS, fast, strlen(fast)));
    const int late = open_page();
    expect_text(late, "{\"control\":false}");
    expect_text(late, one);
    expect_text(late, two);
    expect_text(late, fast);
    expect_text(late, "old!");
    close(late);
    char text[64];
    size_t n = next_message(fd, text, sizeof text - 1);
    text[n] = 0;
    if (strcmp(text, slow) == 0) expect_text(fd, fast);
    om_view_server_clear(server);
    assert_ok(om_view_server_publish(server, OM_VIEW_LASTING, two, strlen(two)));
    expect_text(fd, "{\"clear\":true}");
    expect_text(fd, two);
    close(fd);
}

static void one_page_has_the_controls(void** unused) {
    (void)unused;
    int first, second;
    open_two(&first, &second);
    send_line(second, "abort");
    send_line(first, "beat");
    send_line(first, "pause");
    assert_true(wait_for(has_line));
    assert_string_equal(line, "pause");
    assert_false(has_line());
    assert_true(om_view_server_silence(server) < 1);
    close(first);
    const char* word = "{\"words\":\"x\"}";
    for (int i = 0; i < 100 && om_view_server_count(server) > 1; ++i) nap();
    assert_int_equal(om_view_server_count(server), 1);
    assert_ok(om_view_server_publish(server, OM_VIEW_LASTING, word, strlen(word)));
    expect_text(second, "{\"control\":true}");
    send_line(second, "go");
    assert_true(wait_for(has_line));
    assert_string_equal(line, "go");
    close(second);
}

// A page that is silent for two seconds loses the controls to one that speaks.
static void a_silent_page_loses_the_controls(void** unused) {
    (void)unused;
    int first, second;
    open_two(&first, &second);
    for (int i = 0; i < 210; ++i) {
        if (i % 50 == 0) send_line(first, "beat");
        nap();
    }
    send_line(second, "pause");  // the first was heard 0.6 s ago
    for (int i = 0; i < 20; ++i) nap();
    assert_false(has_line());
    for (int i = 0; i < 190; ++i) nap();
    send_line(second, "pause");
    assert_true(wait_for(has_line));
    assert_string_equal(line, "pause");
    expect_text(second, "{\"control\":true}");
    expect_text(first, "{\"control\":false}");
    close(first);
    close(second);
    assert_true(wait_for(has_no_page));
    assert_true(om_view_server_silence(server) < 1);  // since it was closed
}

// Of moves that wait in a row the last one is kept, and what follows is not lost.
static void the_last_move_counts(void** unused) {
    (void)unused;
    begin();
    const int fd = open_page();
    char text[40];
    send_line(fd, "grasp 0 0 0");
    for (int k = 0; k < 500; ++k) {
        snprintf(text, sizeof text, "move %d 0 0", k);
        send_line(fd, text);
    }
    send_line(fd, "release");
    for (int i = 0; i < 30; ++i) nap();
    static const char* const want[] = {"grasp 0 0 0", "move 499 0 0", "release"};
    for (int k = 0; k < 3; ++k) {
        assert_true(has_line());
        assert_string_equal(line, want[k]);
    }
    assert_false(has_line());
    close(fd);
}

// Of lines that are not taken 60 wait. Each further one is answered, and what stops the run has a place of its own.
static void a_stop_finds_a_place_among_many_lines(void** unused) {
    (void)unused;
    static const char* const stop[] = {"pause", "release", "cancel", "abort"};
    const char* left_out =
        "{\"say\":\"too many commands; the last was left out\",\"is_error\":true}";
    begin();
    const int fd = open_page();
    char text[40];
    expect_text(fd, "{\"control\":true}");
    for (int k = 0; k < 63; ++k) {
        snprintf(text, sizeof text, "forbid %d 1", k);
        send_line(fd, text);
    }
    for (int k = 0; k < 3; ++k) expect_text(fd, left_out);
    for (int k = 0; k < 4; ++k) send_line(fd, stop[k]);
    send_line(fd, "pause");  // the 65th
    expect_text(fd, left_out);
    for (int k = 0; k < 60; ++k) {
        assert_true(has_line());
        snprintf(text, sizeof text, "forbid %d 1", k);
        assert_string_equal(line, text);
    }
    for (int k = 0; k < 4; ++k) {
        assert_true(has_line());
        assert_string_equal(line, stop[k]);
    }
    assert_false(has_line());
    send_line(fd, "go");  // there is place again
    assert_true(wait_for(has_line));
    assert_string_equal(line, "go");
    close(fd);
}

// Lines arrive whole or not at all, whatever is sent; the server stays.
static void bad_messages_do_no_harm(void** unused) {
    (void)unused;
    begin();
    OmRng rng = om_rng_init(39, 1);
    char data[1500];
    for (int k = 0; k < 1000; ++k) {
        static int fd = -1;
        if (fd < 0) fd = open_page();
        const size_t n = (size_t)om_rng_below(&rng, k % 10 ? 40 : 1400);
        for (size_t i = 0; i < n; ++i) data[i] = (char)om_rng_below(&rng, 256);
        if (k % 3 == 0)
            write_all(fd, data, n);  // no frame at all
        else
            send_message(fd, k % 3, data, n);
        if (k % 5 == 0) {
            close(fd);
            fd = -1;
        }
        while (has_line()) {
            assert_true(strlen(line) <= OM_VIEW_MAX_LINE);
            assert_true(om_text_is_plain(line, strlen(line), NULL));
        }
        if (k == 999 && fd >= 0) close(fd);
    }
    assert_true(wait_for(has_no_page));
    const int fd = open_page();
    memset(data, 'x', sizeof data);
    send_message(fd, 1, data, OM_VIEW_MAX_LINE);
    assert_true(wait_for(has_line));
    assert_int_equal(strlen(line), OM_VIEW_MAX_LINE);
    send_message(fd, 1, data, OM_VIEW_MAX_LINE + 1);  // one byte too many: the page is closed
    assert_true(wait_for(has_no_page));
    close(fd);
}

// A page that reads nothing costs neither time nor memory.
static void a_slow_page_gets_fewer_frames(void** unused) {
    (void)unused;
    begin();
    static char frame[200004];
    const int fd = open_page();
    assert_true(wait_for(has_page));
    const int64_t alive = om_alloc_alive();
    const double start = om_clock_now();
    for (int k = 0; k < 300; ++k) {
        memcpy(frame + 4, &k, sizeof k);
        assert_ok(om_view_server_publish(server, OM_VIEW_NEWEST, frame, sizeof frame));
    }
    assert_true(om_clock_now() - start < 1);
    assert_true(om_alloc_alive() <= alive + 4);
    static char data[300000];
    int n = 0, last = -1;
    expect_text(fd, "{\"control\":true}");
    while (last != 299 && next_message(fd, data, sizeof data) > 0) {
        memcpy(&last, data, sizeof last);
        ++n;
    }
    assert_int_equal(last, 299);
    assert_true(n < 300);
    close(fd);
}

static void other_machines_need_a_token(void** unused) {
    (void)unused;
    OmViewServer* other;
    OmViewServerDef def = om_view_server_default_def();
    char a[4000], path[64];
    int its;
    def.address = "0.0.0.0";
    def.port = 0;
    assert_status(om_view_server_create(&def, &other), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "token"));
    def.token = "a b";
    assert_status(om_view_server_create(&def, &other), OM_INVALID);
    def.token = "abcabc";
    assert_ok(om_view_server_create(&def, &other));
    assert_int_equal(sscanf(om_view_server_url(other), "http://0.0.0.0:%d/?token=abcabc", &its), 1);
    get_at(its, "/", "Host: host\r\n", a);
    assert_non_null(strstr(a, "403"));
    snprintf(path, sizeof path, "/?token=abc");
    get_at(its, path, "Host: host\r\n", a);
    assert_non_null(strstr(a, "403"));
    get_at(its, "/?token=abcabc", "Host: host\r\n", a);
    assert_non_null(strstr(a, "200 OK"));
    assert_non_null(strstr(a, "omentum_token=abcabc; HttpOnly; SameSite=Strict"));
    get_at(its, "/page.js", "Host: host\r\nCookie: csrftoken=x; omentum_token=abcabc\r\n", a);
    assert_non_null(strstr(a, "200 OK"));
    get_at(its, "/page.js", "Host: host\r\nCookie: token=abcabc; xomentum_token=abcabc\r\n", a);
    assert_non_null(strstr(a, "403"));
    om_view_server_destroy(other);
}

static void a_taken_port_is_an_error(void** unused) {
    (void)unused;
    OmViewServer* other;
    OmViewServerDef raw = {0}, def = om_view_server_default_def();
    assert_status(om_view_server_create(&raw, &other), OM_INVALID);
    def.port = port;
    const int64_t alive = om_alloc_alive();
    assert_status(om_view_server_create(&def, &other), OM_IO);
    assert_non_null(strstr(om_error_message(), "--port 0"));
    assert_int_equal(om_alloc_alive(), alive);
    def.file = "/no/view.html";
    assert_status(om_view_server_create(&def, &other), OM_IO);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(files_come_with_their_rules),
        cmocka_unit_test(strangers_are_refused),
        cmocka_unit_test(a_page_gets_what_lasts_and_the_newest),
        cmocka_unit_test(one_page_has_the_controls),
        cmocka_unit_test(a_silent_page_loses_the_controls),
        cmocka_unit_test(the_last_move_counts),
        cmocka_unit_test(a_stop_finds_a_place_among_many_lines),
        cmocka_unit_test(bad_messages_do_no_harm),
        cmocka_unit_test(a_slow_page_gets_fewer_frames),
        cmocka_unit_test(other_machines_need_a_token),
        cmocka_unit_test(a_taken_port_is_an_error),
    };
    return cmocka_run_group_tests(test, open_server, close_server);
}
