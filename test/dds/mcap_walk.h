// mcap_walk.h: a walk over the records of a recording, as MCAP's specification has them.
#ifndef OMENTUM_TEST_MCAP_WALK_H
#define OMENTUM_TEST_MCAP_WALK_H

#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "test_common.h"

typedef struct Bytes {
    unsigned char* at;
    size_t size;
} Bytes;

static inline const char* path(const char* name) {
    static char text[2][200];
    static int turn;
    turn = !turn;
    snprintf(text[turn], sizeof text[turn], "/tmp/om_mcap_%d_%s", (int)getpid(), name);
    return text[turn];
}

static inline Bytes read_file(const char* name) {
    struct stat s;
    const int fd = open(name, O_RDONLY);
    assert_true(fd >= 0 && fstat(fd, &s) == 0);
    Bytes b = {malloc((size_t)s.st_size + 1), (size_t)s.st_size};
    assert_true(read(fd, b.at, b.size) == (ssize_t)b.size);
    close(fd);
    return b;
}

static inline uint64_t number(const unsigned char* at, int nbyte) {
    uint64_t x = 0;
    for (int i = nbyte - 1; i >= 0; --i) x = x << 8 | at[i];
    return x;
}

// CRC-32 of IEEE 802.3, bit by bit.
static inline uint32_t crc_of(const unsigned char* at, size_t n) {
    uint32_t crc = ~0u;
    for (size_t i = 0; i < n; ++i) {
        crc ^= at[i];
        for (int k = 0; k < 8; ++k) crc = crc & 1 ? crc >> 1 ^ 0xedb88320u : crc >> 1;
    }
    return ~crc;
}

typedef struct Seen {  // of a whole file
    int nrecord[16];   // by opcode, chunks included
    uint64_t nmessage, first, last, newest;
    bool is_sorted;                // by time
    const unsigned char* data[8];  // of the first messages
    size_t size[8];
} Seen;

static inline void see_message(Seen* s, const unsigned char* at, size_t n) {
    const uint64_t time = number(at + 6, 8);
    assert_int_equal(time, number(at + 14, 8));
    if (s->nmessage == 0 || time < s->first) s->first = time;
    if (s->nmessage == 0 || time > s->last) s->last = time;
    s->is_sorted = s->is_sorted && time >= s->newest;
    s->newest = time;
    if (s->nmessage < 8) s->data[s->nmessage] = at + 22, s->size[s->nmessage] = n - 22;
    ++s->nmessage;
}

// The records of a chunk; each index entry behind it must point to a message of that time.
static inline void see_chunk(Seen* s, const unsigned char* at) {
    const size_t n = (size_t)number(at + 16, 8);
    const unsigned char* r = at + 40;
    assert_int_equal(number(at + 24, 4), crc_of(r, n));
    assert_int_equal(number(at + 28, 4), 0);  // no compression
    assert_int_equal(number(at + 32, 8), n);
    for (size_t k = 0; k < n; k += 9 + (size_t)number(r + k + 1, 8)) {
        ++s->nrecord[r[k]];
        if (r[k] == 5) see_message(s, r + k + 9, (size_t)number(r + k + 1, 8));
    }
}

static inline void see_index(const unsigned char* at, const unsigned char* chunk) {
    const size_t n = (size_t)number(at + 2, 4);
    assert_true(n > 0);
    for (size_t k = 0; k < n; k += 16) {
        const unsigned char* message = chunk + 40 + number(at + 6 + k + 8, 8);
        assert_int_equal(message[0], 5);
        assert_int_equal(number(message + 9, 2), number(at, 2));
        assert_int_equal(number(message + 9 + 6, 8), number(at + 6 + k, 8));
    }
}

static inline Seen see(Bytes b) {
    static const unsigned char magic[8] = {0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};
    Seen s = {.is_sorted = true};
    const unsigned char* chunk = NULL;
    size_t summary = 0, k = 8;
    assert_true(b.size > 37);
    assert_memory_equal(b.at, magic, 8);
    assert_memory_equal(b.at + b.size - 8, magic, 8);
    assert_memory_equal(b.at + 8 + 9, "\4\0\0\0ros2", 8);
    for (; k < b.size - 8; k += 9 + (size_t)number(b.at + k + 1, 8)) {
        const unsigned char* at = b.at + k + 9;
        ++s.nrecord[b.at[k]];
        if (b.at[k] == 6) see_chunk(&s, chunk = at);
        if (b.at[k] == 7) see_index(at, chunk);
        if (b.at[k] == 8)  // ChunkIndex: the chunk is where it says
            assert_memory_equal(b.at + number(at + 16, 8) + 9, at, 16);
        if (b.at[k] == 11) {
            assert_int_equal(number(at, 8), s.nmessage);
            assert_int_equal(number(at + 26, 8), s.first);
            assert_int_equal(number(at + 34, 8), s.last);
        }
        if (b.at[k] == 15) summary = k + 13;
        if (b.at[k] == 2) {
            assert_int_equal(number(at, 8), summary);
            assert_int_equal(number(at + 16, 4), crc_of(b.at + summary, k + 25 - summary));
        }
    }
    assert_int_equal(k, b.size - 8);
    assert_int_equal(s.nrecord[2], 1);
    assert_int_equal(s.nrecord[8], s.nrecord[6]);
    return s;
}

#endif
