// base_file.c: files that appear whole or not at all, and paths.
#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "omentum/base.h"

// Only a regular file ends: a pipe without a writer, a terminal or /dev/zero would keep a reader for ever.
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
    // before it is opened, for opening a device may act on it, and after, for the name may have changed hands
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

OmStatus om_file_begin(const char* path, OmAtomicFile* file) {
    memset(file, 0, sizeof *file);
    int n = snprintf(file->path, sizeof file->path, "%s", path);
    OM_CHECK(n > 0 && (size_t)n < sizeof file->path, OM_INVALID,
             "file name of %d letters: at most %zu", n, sizeof file->path - 1);
    snprintf(file->temp, sizeof file->temp, "%s.part-%ld", path, (long)getpid());
    file->stream = fopen(file->temp, "wb");
    OM_CHECK(file->stream, OM_IO, "%s: cannot write: %s", path, strerror(errno));
    return OM_OK;
}

// Make the renaming itself durable. Some file systems cannot sync folders; that is no failure.
static void sync_folder(const char* path) {
    char dir[1024];
    if (om_path_dir(path, dir, sizeof dir) != OM_OK) return;
    int fd = open(dir, O_RDONLY | O_DIRECTORY);
    if (fd < 0) return;
    (void)fsync(fd);
    close(fd);
}

OmStatus om_file_commit(OmAtomicFile* file) {
    OM_ASSERT(file->stream);
    bool is_good = !ferror(file->stream) && fflush(file->stream) == 0;
    is_good = is_good && (fsync(fileno(file->stream)) == 0 || errno == EINVAL);
    int error = errno;
    if (fclose(file->stream) != 0 && is_good) {
        is_good = false;
        error = errno;
    }
    file->stream = NULL;
    if (is_good && rename(file->temp, file->path) != 0) {
        is_good = false;
        error = errno;
    }
    if (!is_good) {
        unlink(file->temp);
        return om_error(OM_IO, "%s: cannot write: %s", file->path, strerror(error));
    }
    file->temp[0] = 0;
    sync_folder(file->path);
    return OM_OK;
}

void om_file_abort(OmAtomicFile* file) {
    if (file->stream) fclose(file->stream);
    file->stream = NULL;
    if (file->temp[0]) unlink(file->temp);
    file->temp[0] = 0;
}

OmStatus om_file_write(const char* path, const void* data, size_t size) {
    OmAtomicFile file;
    OM_TRY(om_file_begin(path, &file));
    if (size) fwrite(data, 1, size, file.stream);
    return om_file_commit(&file);
}

// ---- paths --------------------------------------------------------------------------------------------

bool om_path_exists(const char* path) {
    struct stat st;
    return stat(path, &st) == 0;
}

OmStatus om_path_make_dir(const char* path) {
    char part[1024];
    int n = snprintf(part, sizeof part, "%s", path);
    OM_CHECK(n > 0 && (size_t)n < sizeof part, OM_INVALID, "folder name of %d letters: at most %zu",
             n, sizeof part - 1);
    for (char* p = part + 1;; ++p) {
        if (*p != '/' && *p != 0) continue;
        char kept = *p;
        *p = 0;
        if (mkdir(part, 0777) != 0 && errno != EEXIST) {
            return om_error(OM_IO, "%s: cannot make the folder: %s", path, strerror(errno));
        }
        *p = kept;
        if (kept == 0) break;
    }
    struct stat st;
    OM_CHECK(stat(path, &st) == 0 && S_ISDIR(st.st_mode), OM_IO,
             "%s: is a file, a folder is wanted", path);
    return OM_OK;
}

OmStatus om_path_remove(const char* path) {
    struct stat st;
    if (lstat(path, &st) != 0) return OM_OK;
    if (S_ISDIR(st.st_mode)) {
        DIR* dir = opendir(path);
        OM_CHECK(dir, OM_IO, "%s: cannot open: %s", path, strerror(errno));
        OmStatus status = OM_OK;
        for (struct dirent* e; status == OM_OK && (e = readdir(dir)) != NULL;) {
            if (strcmp(e->d_name, ".") == 0 || strcmp(e->d_name, "..") == 0) continue;
            char child[2048];
            status = om_path_join(path, e->d_name, child, sizeof child);
            if (status == OM_OK) status = om_path_remove(child);
        }
        closedir(dir);
        OM_TRY(status);
    }
    OM_CHECK(remove(path) == 0, OM_IO, "%s: cannot remove: %s", path, strerror(errno));
    return OM_OK;
}

OmStatus om_path_join(const char* dir, const char* name, char* out, size_t size) {
    bool is_alone = name[0] == '/' || dir[0] == 0;
    size_t nd = strlen(dir);
    const char* slash = nd > 0 && dir[nd - 1] == '/' ? "" : "/";
    int n = is_alone ? snprintf(out, size, "%s", name)
                     : snprintf(out, size, "%s%s%s", dir, slash, name);
    OM_CHECK(n >= 0 && (size_t)n < size, OM_INVALID, "path of %d letters: at most %zu", n,
             size - 1);
    return OM_OK;
}

OmStatus om_path_dir(const char* path, char* out, size_t size) {
    const char* slash = strrchr(path, '/');
    int len = !slash ? 1 : slash == path ? 1 : (int)(slash - path);
    OM_CHECK((size_t)len < size, OM_INVALID, "path of %d letters: at most %zu", len, size - 1);
    memcpy(out, slash ? path : ".", (size_t)len);
    out[len] = 0;
    return OM_OK;
}

void om_path_extension(const char* path, char* out, size_t size) {
    const char* name = strrchr(path, '/');
    name = name ? name + 1 : path;
    const char* dot = strrchr(name, '.');
    if (dot && dot > name && strcmp(dot, ".gz") == 0) {
        const char* before = dot;
        while (before > name && before[-1] != '.') --before;
        if (before > name) dot = before - 1;
    }
    size_t n = 0;
    for (const char* p = dot ? dot + 1 : ""; *p && n + 1 < size; ++p) {
        out[n++] = (char)tolower((unsigned char)*p);
    }
    if (size) out[n] = 0;
}
