// test_dds_tape.c: a recording whose disk is slow, stopped or full.
#include "dds/dds_tape.h"

#include <signal.h>
#include <stdatomic.h>
#include <sys/resource.h>
#include <time.h>

#include "mcap_walk.h"
#include "test_alloc.h"

static const McapTopic topic = {"PSM1/status", LINK_STRING, 5, false, "RIHS01_0"};

// A disk that does not answer until the gate opens.
typedef struct Gate {
    atomic_bool is_open, has_given_up;
    atomic_int nwaiting;
} Gate;

static void nap(void) { nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL); }

static void wait_at(void* ctx) {
    Gate* g = ctx;
    const double end = om_clock_now() + 20;
    atomic_fetch_add(&g->nwaiting, 1);
    while (!atomic_load(&g->is_open) && om_clock_now() < end) nap();
    if (!atomic_load(&g->is_open)) atomic_store(&g->has_given_up, true);
    atomic_fetch_sub(&g->nwaiting, 1);
}

static void begin(const char* name, size_t most, Gate* gate, Tape** tape, int* channel) {
    assert_ok(om__tape_open(name, tape));
    assert_ok(om__tape_add(*tape, &topic, channel));
    om__tape_hinder(*tape, most, wait_at, gate);
}

// 3,000 messages, large ones among them, go into memory while the disk stands; all are in the file then, in their
// order. A message that waited for the disk would wait until the gate gives up.
static void stopped_disk(void** unused) {
    (void)unused;
    enum { STOPPED = 3000, N = 3200, LONG = 300000 };
    const char* name = path("stopped");
    static char text[LONG];
    Gate gate = {false};
    Tape* tape;
    int channel;
    begin(name, TAPE_MOST, &gate, &tape, &channel);
    assert_ok(om__tape_write(tape, channel, 0.5, "first", 5));
    while (atomic_load(&gate.nwaiting) == 0) nap();
    for (int i = 1; i < STOPPED; ++i)
        assert_ok(om__tape_write(tape, channel, 0.5 + i, text, i % 50 == 0 ? LONG : 500));
    assert_int_equal(atomic_load(&gate.nwaiting), 1);
    atomic_store(&gate.is_open, true);
    // the disk keeps up: blocks are used again
    for (int i = STOPPED; i < N; ++i, nap())
        assert_ok(om__tape_write(tape, channel, 0.5 + i, text, 60000));
    assert_ok(om__tape_close(tape));
    assert_false(atomic_load(&gate.has_given_up));
    Bytes b = read_file(name);
    const Seen s = see(b);
    assert_int_equal(s.nmessage, N);
    assert_true(s.is_sorted);
    assert_int_equal(s.first, 500000000);
    assert_int_equal(s.last, 500000000 + (N - 1) * 1000000000ull);
    assert_memory_equal(s.data[0], "first", 5);
    assert_int_equal(s.size[1], 500);
    free(b.at);
    unlink(name);
}

// Nothing is left out without an error: what is behind by more than the bound is refused, and the rest is written.
static void too_slow(void** unused) {
    (void)unused;
    enum { SIZE = 100000, MOST = 5 << 20 };
    const char* name = path("too_slow");
    static char text[SIZE];
    Gate gate = {false};
    Tape* tape;
    int channel, n = 0;
    begin(name, MOST, &gate, &tape, &channel);
    OmStatus status = OM_OK;
    while (status == OM_OK && n < 100) status = om__tape_write(tape, channel, n++, text, SIZE);
    assert_status(status, OM_IO);
    assert_non_null(strstr(om_error_message(), "the disk is too slow: 4 MB wait"));
    assert_int_equal(n, MOST / SIZE + 1);  // a message has some bytes more
    atomic_store(&gate.is_open, true);
    assert_ok(om__tape_close(tape));
    Bytes b = read_file(name);
    assert_int_equal(see(b).nmessage, n - 1);
    free(b.at);
    unlink(name);
}

// The error of the thread that writes is that of a later message, and of the end.
static void full_disk(void** unused) {
    (void)unused;
    enum { SIZE = 1000000 };
    const char* name = path("full_tape");
    char* text = calloc(SIZE, 1);
    struct rlimit before, small;
    Tape* tape;
    int channel;
    OmStatus status = OM_OK;
    assert_ok(om__tape_open(name, &tape));
    assert_ok(om__tape_add(tape, &topic, &channel));
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    small = before;
    small.rlim_cur = 7000000;
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
    for (int n = 0; status == OM_OK && n < 100; ++n, nap())
        status = om__tape_write(tape, channel, 1 + n, text, SIZE);
    for (int k = 0; status == OM_OK && k < 10000; ++k, nap())
        status = om__tape_write(tape, channel, 200, "", 0);
    assert_status(status, OM_IO);
    assert_non_null(strstr(om_error_message(), name));
    assert_status(om__tape_write(tape, channel, 200, "", 0), OM_IO);
    assert_status(om__tape_close(tape), OM_IO);
    assert_non_null(strstr(om_error_message(), name));
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    Bytes b = read_file(name);
    assert_int_equal(see(b).nmessage, 5);  // the first chunk: 4 MiB and a bit
    free(b.at);
    unlink(name);
    free(text);
}

static OmStatus make_tape(void* ctx) {
    static char text[100000];
    const char* name = path("memory_tape");
    Tape* tape;
    int channel;
    (void)ctx;
    unlink(name);
    OM_TRY(om__tape_open(name, &tape));
    OmStatus status = om__tape_add(tape, &topic, &channel);
    if (status == OM_OK) status = om__tape_write(tape, channel, 1, "text", 4);
    if (status == OM_OK) status = om__tape_write(tape, channel, 1, text, sizeof text);
    const OmStatus closed = om__tape_close(tape);
    unlink(name);
    return status < 0 ? status : closed;
}

static void memory(void** unused) {
    (void)unused;
    assert_true(test_failing_allocations(make_tape, NULL, 1) > 8);
    assert_status(om__tape_open("/nowhere/at/all", &(Tape*){NULL}), OM_IO);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(stopped_disk), cmocka_unit_test(too_slow),
                                       cmocka_unit_test(full_disk), cmocka_unit_test(memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
