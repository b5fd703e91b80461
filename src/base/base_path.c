// base_path.c: paths, temporary names, and the removal of files that killed runs left behind.
//
// A temporary name is .omentum-R-C.part: R are 16 random digits, C is computed from R. The writer locks the file or
// folder (flock), and the system releases the lock when the writer ends for any reason. So a file of such a name
// that belongs to this user and is not locked was left by a killed run and may be removed.
#define _GNU_SOURCE  // flock, getrandom, renameat2, realpath
#include <ctype.h>
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/base_internal.h"

#define TEMP_HEAD ".omentum-"
#define TEMP_TAIL ".part"
// tries; another run takes or removes a name that we are about to lock very rarely
#define MAX_TRY 100
#define MAX_DEPTH 8  // folders below an output folder that are searched for files of killed runs

// ---- names ----------------------------------------------------------------------------------------------

bool om_path_exists(const char* path) {
    struct stat st;
    return stat(path, &st) == 0;
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

static const char place_of_library[] = "";  // an address inside of the library, for dladdr

// The first place below the folder of `file` that has `name`; out is "" if none has.
static OmStatus find_beside(const char* file, const char* const* place, const char* name, char* out,
                            size_t size) {
    char dir[1024], base[2048];
    OM_TRY(om_path_dir(file, dir, sizeof dir));
    for (; *place; ++place) {
        OM_TRY(om_path_join(dir, *place, base, sizeof base));
        OM_TRY(om_path_join(base, name, out, size));
        if (om_path_exists(out)) return OM_OK;
    }
    out[0] = 0;
    return OM_OK;
}

OmStatus om_path_share(const char* name, char* out, size_t size) {
    // installed, or in the build tree
    static const char* const by_program[] = {"../share/omentum", "../../..", "../../../..", ".",
                                             NULL};
    // installed in lib or lib/<architecture>, in the Python package, or in the build tree
    static const char* const by_library[] = {"../share/omentum", "../../share/omentum", "../share",
                                             "../..", NULL};
    char exe[1024];
    ssize_t n = readlink("/proc/self/exe", exe, sizeof exe - 1);
    exe[n > 0 ? n : 0] = 0;
    OM_TRY(find_beside(exe, by_program, name, out, size));
    if (out[0]) return OM_OK;
    Dl_info library;
    // of a static library it is the program by the name of its call, which may be relative to the current folder
    if (dladdr(place_of_library, &library) && library.dli_fname && library.dli_fname[0] == '/') {
        OM_TRY(find_beside(library.dli_fname, by_library, name, out, size));
        if (out[0]) return OM_OK;
    }
    return om_error(OM_IO, "%s is not installed beside %s", name, exe);
}

const char* om__path_name(const char* path) {
    const char* slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

void om_path_extension(const char* path, char* out, size_t size) {
    const char* name = om__path_name(path);
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

// Resolve the longest existing part; the rest is kept as written.
OmStatus om__path_resolve(const char* path, char out[OM__PATH]) {
    char head[OM__PATH], tail[OM__PATH] = "";
    int n = snprintf(head, sizeof head, "%s", path);
    OM_CHECK(n > 0 && n < OM__PATH, OM_INVALID, "path of %d letters: at most %d", n, OM__PATH - 1);
    for (;;) {
        if (realpath(head[0] ? head : "/", out)) break;
        OM_CHECK(errno == ENOENT, OM_IO, "%s: %s", path, strerror(errno));
        char rest[OM__PATH];
        char* slash = strrchr(head, '/');
        const char* name = slash ? slash + 1 : head;
        if (*name) {
            n = snprintf(rest, sizeof rest, "/%s%s", name, tail);
            OM_CHECK(n < OM__PATH, OM_INVALID, "%s: path too long", path);
            memcpy(tail, rest, (size_t)n + 1);
        }
        if (slash)
            *slash = 0;
        else
            strcpy(head, ".");
    }
    size_t len = strcmp(out, "/") == 0 ? 0 : strlen(out);
    n = snprintf(out + len, OM__PATH - len, "%s", tail);
    OM_CHECK(len + (size_t)n < OM__PATH, OM_INVALID, "%s: path too long", path);
    if (!out[0]) strcpy(out, "/");
    return OM_OK;
}

OmStatus om_path_check_apart(const char* input, const char* output) {
    struct stat in, out;
    if (stat(input, &in) != 0) return OM_OK;  // the reader of the input reports the error
    OM_CHECK(stat(output, &out) != 0 || in.st_dev != out.st_dev || in.st_ino != out.st_ino,
             OM_INVALID, "%s is an input and cannot be the output too; name another output", input);
    char from[OM__PATH], to[OM__PATH];
    OM_TRY(om__path_resolve(input, from));
    OM_TRY(om__path_resolve(output, to));
    size_t n = strcmp(to, "/") == 0 ? 0 : strlen(to);
    OM_CHECK(strncmp(from, to, n) != 0 || (from[n] != '/' && from[n] != 0), OM_INVALID,
             "the input %s lies in the output folder %s; name another folder", input, output);
    return OM_OK;
}

// ---- creating and removing ------------------------------------------------------------------------------

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
            // a folder may exist although its disk refuses writing
            int error = errno;
            OM_CHECK(om_path_exists(part), OM_IO, "%s: cannot make the folder: %s", path,
                     strerror(error));
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

void om__sync_folder_of(const char* path) {
    char dir[1100];
    if (om_path_dir(path, dir, sizeof dir) != OM_OK) return;
    int fd = open(dir, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0) return;
    (void)fsync(fd);  // some file systems cannot sync folders; this is not an error
    close(fd);
}

// ---- temporary names ------------------------------------------------------------------------------------

static unsigned check_number(uint64_t random) {
    return (unsigned)(om_hash(&random, sizeof random, OM_HASH_SEED) & 0xffffffffu);
}

bool om__temp_is_name(const char* name) {
    char again[OM__TEMP_NAME], *end;
    size_t head = strlen(TEMP_HEAD);
    if (strncmp(name, TEMP_HEAD, head) != 0 || !isxdigit((unsigned char)name[head])) return false;
    uint64_t random = strtoull(name + head, &end, 16);
    snprintf(again, sizeof again, TEMP_HEAD "%016llx-%08x" TEMP_TAIL, (unsigned long long)random,
             check_number(random));
    return strcmp(name, again) == 0;
}

OmStatus om__temp_path(const char* dir, char* out, size_t size) {
    uint64_t random;
    char name[OM__TEMP_NAME];
    OM_CHECK(getrandom(&random, sizeof random, 0) == (ssize_t)sizeof random, OM_IO,
             "no random number for a temporary name: %s", strerror(errno));
    snprintf(name, sizeof name, TEMP_HEAD "%016llx-%08x" TEMP_TAIL, (unsigned long long)random,
             check_number(random));
    return om_path_join(dir, name, out, size);
}

// Lock the new file or folder. False if another run took it for left behind and removes it.
static bool lock_new(const char* path, int fd) {
    struct stat mine, there;
    if (flock(fd, LOCK_EX | LOCK_NB) != 0) return errno != EWOULDBLOCK;  // a disk without locks
    return fstat(fd, &mine) == 0 && lstat(path, &there) == 0 && mine.st_ino == there.st_ino &&
           mine.st_dev == there.st_dev;
}

OmStatus om__temp_make_file(const char* dir, char* path, size_t size, int* fd) {
    for (int i = 0; i < MAX_TRY; ++i) {
        OM_TRY(om__temp_path(dir, path, size));
        *fd = open(path, O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
        if (*fd < 0 && errno == EEXIST) continue;
        if (*fd < 0) return OM_IO;  // the caller reads errno and knows the name for the message
        if (lock_new(path, *fd)) return OM_OK;
        close(*fd);
    }
    errno = EBUSY;
    return OM_IO;
}

OmStatus om__temp_make_folder(const char* dir, char* path, size_t size, int* fd) {
    for (int i = 0; i < MAX_TRY; ++i) {
        OM_TRY(om__temp_path(dir, path, size));
        if (mkdir(path, 0777) != 0) {
            if (errno == EEXIST) continue;
            return OM_IO;
        }
        *fd = open(path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
        if (*fd < 0) continue;
        if (lock_new(path, *fd)) return OM_OK;
        close(*fd);
    }
    errno = EBUSY;
    return OM_IO;
}

// ---- files of killed runs -------------------------------------------------------------------------------

// If a run was killed just before its complete folder got its name, the folder gets the name now if the name is
// free. A folder that was being removed is removed, unless another program put a file into it.
static void clean_folder(const char* dir, const char* path) {
    char name[256], place[2048];
    if (!om__folder_name(path, name, sizeof name)) {
        (void)om_path_remove(path);
        return;
    }
    bool is_name =
        name[0] && !strchr(name, '/') && strcmp(name, ".") != 0 && strcmp(name, "..") != 0;
    if (is_name && om_path_join(dir, name, place, sizeof place) == OM_OK &&
        renameat2(AT_FDCWD, path, AT_FDCWD, place, RENAME_NOREPLACE) == 0)
        return;
    if (om__folder_check_ours(path, path) == OM_OK) (void)om_path_remove(path);
}

static void clean(const char* dir, int depth) {
    DIR* folder = opendir(dir);
    if (!folder) return;
    for (struct dirent* e; (e = readdir(folder)) != NULL;) {
        char path[2048];
        struct stat st;
        if (strcmp(e->d_name, ".") == 0 || strcmp(e->d_name, "..") == 0) continue;
        if (om_path_join(dir, e->d_name, path, sizeof path) < 0 || lstat(path, &st) != 0) continue;
        bool is_folder = S_ISDIR(st.st_mode);
        if (!om__temp_is_name(e->d_name)) {
            if (is_folder && depth > 0) clean(path, depth - 1);
            continue;
        }
        if (st.st_uid != geteuid() || !(is_folder || (S_ISREG(st.st_mode) && st.st_nlink == 1)))
            continue;
        int fd = open(path, O_RDONLY | O_NOFOLLOW | O_CLOEXEC | (is_folder ? O_DIRECTORY : 0));
        if (fd < 0) continue;
        if (flock(fd, LOCK_EX | LOCK_NB) == 0) {
            if (is_folder)
                clean_folder(dir, path);
            else
                (void)unlink(path);
        }
        close(fd);
    }
    closedir(folder);
}

void om_path_clean(const char* dir, bool is_deep) { clean(dir, is_deep ? MAX_DEPTH : 0); }
