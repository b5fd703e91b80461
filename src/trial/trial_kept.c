// trial_kept.c: the finished trials of a plan before an operation, kept in a file.
//
//     head    16 bytes of magic, the key
//     record  index, number of bytes, hash of all of these and of the bytes; the bytes
//
// Each record is appended with one write, so threads need no lock, and a killed process loses at most the record that
// it was writing. A record with a wrong hash ends the file. The key is a hash of all that a trial depends on.
#include "trial/trial_kept.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#define MAX_SIZE ((size_t)1 << 31)

static const char magic[16] = "omentum trials\n";

typedef struct Head {
    char magic[16];
    uint64_t key;
} Head;

typedef struct Record {
    int64_t index;
    uint64_t size, hash;
} Record;

static uint64_t hash_of(const Record* r, const void* data) {
    const uint64_t number[] = {(uint64_t)r->index, r->size};
    return om_hash(data, r->size, om_hash(number, sizeof number, OM_HASH_SEED));
}

// The record at byte `at`; false: no whole record is there.
static bool read_record(const Kept* k, size_t at, Record* r) {
    if (k->size - at < sizeof *r) return false;
    memcpy(r, k->data + at, sizeof *r);
    return r->size <= k->size - at - sizeof *r && hash_of(r, k->data + at + sizeof *r) == r->hash;
}

// Bytes up to the end of the last whole record.
static size_t whole_size(const Kept* k) {
    size_t at = sizeof(Head);
    for (Record r; read_record(k, at, &r);) at += sizeof r + r.size;
    return at;
}

static OmStatus write_all(const Kept* k, const void* data, size_t size) {
    ssize_t n;
    do {
        n = write(k->fd, data, size);
    } while (n < 0 && errno == EINTR);
    OM_CHECK(n >= 0, OM_IO, "%s: cannot write: %s", k->path, strerror(errno));
    OM_CHECK((size_t)n == size, OM_IO, "%s: the disk is full", k->path);
    return OM_OK;
}

static OmStatus begin_anew(Kept* k, uint64_t key) {
    Head head = {.key = key};
    memcpy(head.magic, magic, sizeof magic);
    k->size = 0;
    OM_CHECK(ftruncate(k->fd, 0) == 0, OM_IO, "%s: cannot write: %s", k->path, strerror(errno));
    return write_all(k, &head, sizeof head);
}

static OmStatus read_kept(Kept* k, uint64_t key) {
    Head head;
    OM_TRY(om_file_read(k->path, MAX_SIZE, &k->data, &k->size));
    const size_t known = k->size < sizeof magic ? k->size : sizeof magic;
    OM_CHECK(memcmp(k->data, magic, known) == 0, OM_INVALID,
             "%s: this file does not hold trials of a plan; move it away", k->path);
    if (k->size < sizeof head) return begin_anew(k, key);
    memcpy(&head, k->data, sizeof head);
    if (head.key != key) {
        om_log(OM_LOG_WARNING,
               "%s: its trials are of another scene, other settings or another version; all "
               "points are tried again",
               k->path);
        return begin_anew(k, key);
    }
    k->size = whole_size(k);
    OM_CHECK(ftruncate(k->fd, (off_t)k->size) == 0, OM_IO, "%s: cannot write: %s", k->path,
             strerror(errno));
    return OM_OK;
}

static OmStatus open_locked(Kept* k, uint64_t key) {
    struct stat st;
    k->fd = open(k->path, O_RDWR | O_APPEND | O_CREAT | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK, 0666);
    OM_CHECK(k->fd >= 0, OM_IO, "%s: cannot open: %s", k->path, strerror(errno));
    OM_CHECK(fstat(k->fd, &st) == 0 && S_ISREG(st.st_mode), OM_IO, "%s: not a regular file",
             k->path);
    OM_CHECK(flock(k->fd, LOCK_EX | LOCK_NB) == 0, OM_INVALID,
             "%s: another run writes into this file", k->path);
    return st.st_size > 0 ? read_kept(k, key) : begin_anew(k, key);
}

OmStatus om__kept_open(const char* path, uint64_t key, Kept* k) {
    *k = (Kept){.fd = -1};
    if (!path) return OM_OK;
    OM_CHECK(snprintf(k->path, sizeof k->path, "%s", path) < (int)sizeof k->path, OM_INVALID,
             "the path of the kept trials is too long");
    const OmStatus status = open_locked(k, key);
    if (status < 0) om__kept_done(k);
    return status;
}

void om__kept_done(Kept* k) {
    if (k->fd >= 0) close(k->fd);
    om_free(k->data);
    *k = (Kept){.fd = -1};
}

const void* om__kept_find(const Kept* k, int index, size_t* size) {
    size_t at = sizeof(Head);
    for (Record r; k->fd >= 0 && at < k->size && read_record(k, at, &r); at += sizeof r + r.size) {
        if (r.index != index) continue;
        *size = r.size;
        return k->data + at + sizeof r;
    }
    return NULL;
}

OmStatus om__kept_add(const Kept* k, int index, const void* data, size_t size) {
    if (k->fd < 0) return OM_OK;
    Record r = {.index = index, .size = size};
    r.hash = hash_of(&r, data);
    char* whole = om_alloc(sizeof r + size, 1);
    if (!whole) return OM_NO_MEMORY;
    memcpy(whole, &r, sizeof r);
    memcpy(whole + sizeof r, data, size);
    const OmStatus status = write_all(k, whole, sizeof r + size);
    om_free(whole);
    return status;
}
