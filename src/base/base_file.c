// base_file.c: read a whole file; write a file so that it appears complete or not at all.
//
// A file is written under a temporary name in its folder, synced, and renamed. The rename replaces only a regular
// file. A link is followed. Bytes for a device, a pipe or a file of /dev/fd are written directly, without a rename.
// Any other kind of file is refused. In a growing folder (base_folder.c) a file is replaced only if omentum wrote
// it.
#define _GNU_SOURCE  // realpath
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/base_internal.h"

// bytes at the beginning of a file that are searched for a mark
#define MARK_WITHIN ((size_t)64 << 20)
#define MAX_LINK 8  // links followed to a file that does not exist yet

// ---- reading --------------------------------------------------------------------------------------------

// Read regular files only: a pipe without a writer, a terminal or /dev/zero would block the reader for
// ever.
static OmStatus check_regular(const char* path, mode_t mode) {
    const char* kind = S_ISDIR(mode)    ? "folder"
                       : S_ISFIFO(mode) ? "pipe"
                       : S_ISSOCK(mode) ? "socket"
                                        : "device";
    OM_CHECK(S_ISREG(mode), OM_IO, "%s: is a %s, a file is wanted", path, kind);
    return OM_OK;
}

OmStatus om_file_open(const char* path, FILE** stream, uint64_t* size) {
    struct stat st;
    *stream = NULL;
    if (size) *size = 0;
    // check before opening, because opening a device may act on it, and after, because the name may now mean
    // another file
    OM_CHECK(stat(path, &st) == 0, OM_IO, "%s: cannot open: %s", path, strerror(errno));
    OM_TRY(check_regular(path, st.st_mode));
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    OM_CHECK(fd >= 0, OM_IO, "%s: cannot open: %s", path, strerror(errno));
    OmStatus status = fstat(fd, &st) == 0 ? check_regular(path, st.st_mode)
                                          : om_error(OM_IO, "%s: %s", path, strerror(errno));
    FILE* f = status == OM_OK ? fdopen(fd, "rb") : NULL;
    if (status == OM_OK && !f) status = om_error(OM_NO_MEMORY, "%s: out of memory", path);
    if (!f) {
        close(fd);
        return status;
    }
    *stream = f;
    if (size) *size = (uint64_t)st.st_size;
    return OM_OK;
}

OmStatus om_file_read(const char* path, size_t max_size, char** data, size_t* size) {
    *data = NULL;
    *size = 0;
    FILE* f;
    uint64_t stored;
    OM_TRY(om_file_open(path, &f, &stored));
    OmStatus status = OM_OK;
    char* bytes = NULL;
    OM_CHECK_DONE(stored <= max_size, OM_INVALID, "%s: %llu bytes, at most %zu are read", path,
                  (unsigned long long)stored, max_size);
    OM_ALLOC_DONE(bytes, (size_t)stored + 1);
    size_t got = fread(bytes, 1, (size_t)stored, f);
    OM_CHECK_DONE(!ferror(f), OM_IO, "%s: cannot read: %s", path, strerror(errno));
    bytes[got] = 0;
    *data = bytes;
    *size = got;
    bytes = NULL;
done:
    om_free(bytes);
    fclose(f);
    return status;
}

// ---- where to write -------------------------------------------------------------------------------------

// The descriptor that the name stands for (/dev/fd/N of this process); -1 if none.
static int descriptor_of(const char* path) {
    static const char* const head[] = {"/dev/fd/", "/proc/self/fd/"};
    if (strcmp(path, "/dev/stdout") == 0) return STDOUT_FILENO;
    if (strcmp(path, "/dev/stderr") == 0) return STDERR_FILENO;
    for (int i = 0; i < 2; ++i) {
        size_t n = strlen(head[i]);
        char* end;
        if (strncmp(path, head[i], n) != 0) continue;
        long fd = strtol(path + n, &end, 10);
        if (end > path + n && *end == 0 && fd >= 0 && fd < INT_MAX) return (int)fd;
    }
    return -1;
}

// Follow links to the name that the file is written under; the file need not exist.
static OmStatus follow(const char* path, char* out, size_t size) {
    char at[1024], link[1024], dir[1024];
    struct stat st;
    snprintf(at, sizeof at, "%s", path);
    for (int i = 0; lstat(at, &st) == 0 && S_ISLNK(st.st_mode); ++i) {
        ssize_t n = readlink(at, link, sizeof link - 1);
        OM_CHECK(i < MAX_LINK && n > 0 && n < (ssize_t)sizeof link - 1, OM_IO,
                 "%s: is a link to a missing file; name the file itself", path);
        link[n] = 0;
        OM_TRY(om_path_dir(at, dir, sizeof dir));
        OM_TRY(om_path_join(dir, link, at, sizeof at));
    }
    int n = snprintf(out, size, "%s", at);
    OM_CHECK((size_t)n < size, OM_INVALID, "file name of %d letters: at most %zu", n, size - 1);
    return OM_OK;
}

// A device, a pipe or an open descriptor: bytes are written directly and nothing is renamed.
static OmStatus begin_through(const char* path, int open_fd, OmAtomicFile* file) {
    // an open file keeps its position; opening a pipe without a reader fails at once instead of
    // blocking
    int fd = open_fd >= 0 ? fcntl(open_fd, F_DUPFD_CLOEXEC, 3)
                          : open(path, O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    OM_CHECK(fd >= 0, OM_IO, "%s: cannot write: %s", path,
             errno == ENXIO ? "no program reads from it" : strerror(errno));
    if (open_fd < 0) (void)fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) & ~O_NONBLOCK);
    file->stream = fdopen(fd, "wb");
    if (file->stream) return OM_OK;
    close(fd);
    return om_error(OM_NO_MEMORY, "%s: cannot write: %s", path, strerror(errno));
}

static OmStatus check_target(const char* path, const struct stat* st) {
    OM_CHECK(!S_ISDIR(st->st_mode), OM_IO, "%s: is a folder, a file is wanted", path);
    OM_CHECK(S_ISREG(st->st_mode), OM_IO, "%s: is %s, not a file; name another output", path,
             S_ISBLK(st->st_mode) ? "a disk" : "a socket");
    OM_CHECK(access(path, W_OK) == 0, OM_IO, "%s: cannot write: %s", path, strerror(errno));
    return om__folder_check_replace(path);
}

OmStatus om_file_begin(const char* path, OmAtomicFile* file) {
    memset(file, 0, sizeof *file);
    file->lock = -1;
    size_t len = strlen(path);
    OM_CHECK(len > 0 && len < sizeof file->path, OM_INVALID,
             "file name of %zu letters: at most %zu", len, sizeof file->path - 1);
    memcpy(file->path, path, len + 1);
    struct stat st;
    bool is_there = stat(path, &st) == 0;
    int open_fd = descriptor_of(path);
    if (open_fd >= 0 || (is_there && (S_ISCHR(st.st_mode) || S_ISFIFO(st.st_mode))))
        return begin_through(path, open_fd, file);
    OM_TRY(follow(path, file->path, sizeof file->path));
    if (is_there) OM_TRY(check_target(file->path, &st));
    char dir[1024];
    int fd;
    OM_TRY(om_path_dir(file->path, dir, sizeof dir));
    errno = 0;
    if (om__temp_make_file(dir, file->temp, sizeof file->temp, &fd) < 0) {
        file->temp[0] = 0;
        return om_error(OM_IO, "%s: cannot write: %s", path, strerror(errno));
    }
    if (is_there) (void)fchmod(fd, st.st_mode & 0777);  // keep the access rights of the old file
    file->lock = fcntl(fd, F_DUPFD_CLOEXEC, 3);  // the lock lasts until the file has its final name
    file->stream = fdopen(fd, "wb");
    if (file->stream) return OM_OK;
    int error = errno;
    close(fd);
    om_file_abort(file);
    return om_error(OM_IO, "%s: cannot write: %s", path, strerror(error));
}

// ---- finishing a file -----------------------------------------------------------------------------------

static void unlock(OmAtomicFile* file) {
    if (file->lock >= 0 && file->temp[0]) close(file->lock);
    file->lock = -1;
}

OmStatus om_file_commit(OmAtomicFile* file) {
    OM_ASSERT(file->stream);
    bool is_good = !ferror(file->stream) && fflush(file->stream) == 0;
    is_good = is_good && (fsync(fileno(file->stream)) == 0 || errno == EINVAL || !file->temp[0]);
    int error = errno;
    if (fclose(file->stream) != 0 && is_good) {
        is_good = false;
        error = errno;
    }
    file->stream = NULL;
    OmStatus status = OM_OK;
    if (is_good && file->temp[0]) {
        status = om__folder_note(file->path, file->temp);
        if (status >= 0 && rename(file->temp, file->path) != 0) {
            is_good = false;
            error = errno;
        }
    }
    if (!is_good || status < 0) {
        if (file->temp[0]) unlink(file->temp);
        unlock(file);
        if (!is_good) status = om_error(OM_IO, "%s: cannot write: %s", file->path, strerror(error));
        return status;
    }
    if (file->temp[0]) om__sync_folder_of(file->path);
    unlock(file);
    file->temp[0] = 0;
    return OM_OK;
}

void om_file_abort(OmAtomicFile* file) {
    if (file->stream) fclose(file->stream);
    file->stream = NULL;
    if (file->temp[0]) unlink(file->temp);
    unlock(file);
    file->temp[0] = 0;
}

OmStatus om_file_write(const char* path, const void* data, size_t size) {
    OmAtomicFile file;
    OM_TRY(om_file_begin(path, &file));
    if (size) fwrite(data, 1, size, file.stream);
    return om_file_commit(&file);
}

// ---- files named by a user ------------------------------------------------------------------------------

#define SEAL_HEAD "# written by omentum, seal "

OmStatus om_text_seal(OmText* text) {
    uint64_t hash = om_hash(text->str, text->len, OM_HASH_SEED);
    return om_text_append(text, SEAL_HEAD "%016llx\n", (unsigned long long)hash);
}

static bool is_sealed(const char* data, size_t size) {
    size_t n = strlen(SEAL_HEAD) + 17;
    char seal[64];
    if (size < n) return false;
    snprintf(seal, sizeof seal, SEAL_HEAD "%016llx\n",
             (unsigned long long)om_hash(data, size - n, OM_HASH_SEED));
    return memcmp(data + size - n, seal, n) == 0;
}

static bool has_mark(const char* data, size_t size, const char* mark) {
    size_t n = strlen(mark);
    for (size_t i = 0; i + n <= size; ++i)
        if (memcmp(data + i, mark, n) == 0) return true;
    return false;
}

OmStatus om_file_check_ours(const char* path, const char* mark) {
    struct stat st;
    if (stat(path, &st) != 0 || !S_ISREG(st.st_mode) || st.st_size == 0 || descriptor_of(path) >= 0)
        return OM_OK;
    FILE* f = fopen(path, "rb");
    OM_CHECK(f, OM_IO, "%s: cannot open: %s", path, strerror(errno));
    size_t size = (size_t)st.st_size;
    if (mark && size > MARK_WITHIN) size = MARK_WITHIN;
    char* data = om_alloc(size, 1);
    bool is_ours = false;
    if (data) {
        size = fread(data, 1, size, f);
        is_ours = mark ? has_mark(data, size, mark) : is_sealed(data, size);
    }
    fclose(f);
    if (!data) return OM_NO_MEMORY;
    om_free(data);
    OM_CHECK(
        is_ours, OM_INVALID,
        "%s exists and was not written by omentum, or was changed since; name another file, or move it away",
        path);
    return OM_OK;
}
