// base_folder.c: output folders, complete or growing; only files that omentum wrote are replaced.
//
// Each output folder holds a list, .omentum, of the files that omentum wrote:
//
//     omentum 1 whole retraction run          or: omentum 1 growing contact study
//     name out
//     file 4711 0123456789abcdef report.html  size, hash, name below the folder
//
// A complete folder (a model, a run) is written under a temporary name beside its destination; the list is written
// last. Then it is exchanged with an older folder of that name. The older folder is removed if every file in it
// stands in its own list with the same size and hash. Otherwise the exchange is undone, so that no file of another
// program is removed.
//
// A growing folder (a study, a calibration, data, a training) is written in place, and a later run continues it. A
// line is appended to its list before each file gets its name, so that after a kill at any moment the list names
// every file of omentum. A file is replaced only if one of its lines matches it. A lock on the folder keeps a
// second run out.
#define _GNU_SOURCE  // flock, renameat2, realpath
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/base_internal.h"

#define MAX_LIST ((size_t)64 << 20)  // bytes of a list
#define MAX_DEPTH 16                 // folders below an output folder
// Bytes. Larger files are checked by size alone when a folder is opened.
#define CHECK_WITHIN ((int64_t)16 << 20)
#define REMEDY "move it away, or name another folder"

static const char head_whole[] = "omentum 1 whole ", head_growing[] = "omentum 1 growing ";

// ---- entries of a folder --------------------------------------------------------------------------------

static bool hash_file(const char* path, int64_t* size, uint64_t* hash) {
    unsigned char chunk[1 << 15];
    struct stat st;
    int fd = open(path, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) return false;
    bool is_good = fstat(fd, &st) == 0 && S_ISREG(st.st_mode);
    *size = 0;
    *hash = OM_HASH_SEED;
    for (size_t n = 1; is_good && n > 0;) {
        n = 0;
        while (is_good && n < sizeof chunk) {
            ssize_t got = read(fd, chunk + n, sizeof chunk - n);
            if (got == 0) break;
            is_good = got > 0 || errno == EINTR;
            if (got > 0) n += (size_t)got;
        }
        *hash = om_hash(chunk, n, *hash);
        *size += (int64_t)n;
    }
    close(fd);
    return is_good;
}

static bool is_plain(const char* name) {
    for (; *name; ++name)
        if ((unsigned char)*name < ' ') return false;
    return true;
}

// ---- lists ----------------------------------------------------------------------------------------------

typedef struct Line {
    const char* name;  // points into the text
    int len;
    int64_t size;
    uint64_t hash;
    uint64_t key;  // hash of the name
} Line;

typedef struct List {
    char* text;  // null: none
    size_t len;
    bool is_growing;
    const char* kind;  // up to the end of the line
    Line* line;
    int nline;
} List;

static void list_done(List* list) {
    om_free(list->text);
    om_free(list->line);
    *list = (List){0};
}

static bool read_line(const char* at, const char* end, Line* line) {
    char *after, *last;
    if (end - at < 24 || strncmp(at, "file ", 5) != 0) return false;
    line->size = strtoll(at + 5, &after, 10);
    if (*after != ' ') return false;
    line->hash = strtoull(after + 1, &last, 16);
    if (last != after + 17 || *last != ' ' || last + 1 >= end) return false;
    line->name = last + 1;
    line->len = (int)(end - line->name);
    line->key = om_hash(line->name, (size_t)line->len, OM_HASH_SEED);
    return true;
}

// Read the list of `dir`; text is null if there is none, or if the file is not a list of omentum.
static OmStatus list_read(const char* dir, List* list) {
    char path[OM__PATH];
    struct stat st;
    *list = (List){0};
    OM_TRY(om_path_join(dir, OM__LIST, path, sizeof path));
    if (lstat(path, &st) != 0 || !S_ISREG(st.st_mode)) return OM_OK;
    OM_TRY(om_file_read(path, MAX_LIST, &list->text, &list->len));
    size_t nw = strlen(head_whole), ng = strlen(head_growing);
    char* end = memchr(list->text, '\n', list->len);
    list->is_growing = strncmp(list->text, head_growing, ng) == 0;
    if (!end || (!list->is_growing && strncmp(list->text, head_whole, nw) != 0)) {
        list_done(list);
        return OM_OK;
    }
    list->kind = list->text + (list->is_growing ? ng : nw);
    int n = 0;
    for (const char* p = end; (p = strchr(p, '\n')) != NULL; ++p) ++n;
    list->line = om_alloc((size_t)n, sizeof *list->line);
    if (!list->line) {
        list_done(list);
        return OM_NO_MEMORY;
    }
    for (char *at = end + 1, *stop; (stop = strchr(at, '\n')) != NULL; at = stop + 1)
        list->nline += read_line(at, stop, &list->line[list->nline]);
    return OM_OK;
}

static bool has_kind(const List* list, const char* kind) {
    size_t n = strlen(kind);
    return strncmp(list->kind, kind, n) == 0 && list->kind[n] == '\n';
}

typedef enum Fit { FIT_FOREIGN, FIT_CHANGED, FIT_SAME } Fit;

static Fit list_fit(const List* list, const char* name, int len, int64_t size, uint64_t hash) {
    Fit fit = FIT_FOREIGN;
    uint64_t key = om_hash(name, (size_t)len, OM_HASH_SEED);
    for (int i = 0; i < list->nline; ++i) {
        const Line* l = &list->line[i];
        if (l->key != key || l->len != len || memcmp(l->name, name, (size_t)len) != 0) continue;
        if (l->size == size && l->hash == hash) return FIT_SAME;
        fit = FIT_CHANGED;
    }
    return fit;
}

// ---- all files of a folder ------------------------------------------------------------------------------

static int compare_words(const void* a, const void* b) {
    return strcmp(*(char* const*)a, *(char* const*)b);
}

// The names in a folder, sorted, one after the other in `text`, without the list and temporary files.
static OmStatus read_names(const char* dir, bool is_top, OmText* text, char*** name, int* n) {
    *name = NULL;
    *n = 0;
    DIR* folder = opendir(dir);
    OM_CHECK(folder, OM_IO, "%s: cannot open: %s", dir, strerror(errno));
    OmStatus status = OM_OK;
    for (struct dirent* e; status == OM_OK && (e = readdir(folder)) != NULL;) {
        const char* w = e->d_name;
        if (strcmp(w, ".") == 0 || strcmp(w, "..") == 0 || om__temp_is_name(w)) continue;
        if (is_top && strcmp(w, OM__LIST) == 0) continue;
        status = om_text_append_raw(text, w, strlen(w) + 1);
        ++*n;
    }
    closedir(folder);
    OM_TRY(status);
    OM_ALLOC(*name, *n);
    char* at = text->str;
    for (int i = 0; i < *n; ++i, at += strlen(at) + 1) (*name)[i] = at;
    if (*n) qsort(*name, (size_t)*n, sizeof **name, compare_words);
    return OM_OK;
}

typedef OmStatus (*VisitFn)(void* ctx, const char* path, const char* name, bool is_file);

// Visit every file below `dir`, and every entry that omentum never writes: links, pipes, empty
// folders.
static OmStatus walk(const char* dir, const char* below, int depth, VisitFn visit, void* ctx) {
    OmText text = {0};
    char** name;
    int n;
    OmStatus status = read_names(dir, depth == 0, &text, &name, &n);
    if (status == OM_OK && n == 0 && depth > 0) status = visit(ctx, dir, below, false);
    for (int i = 0; i < n && status == OM_OK; ++i) {
        char path[OM__PATH], rel[OM__PATH];
        struct stat st;
        OM_TRY_DONE(om_path_join(dir, name[i], path, sizeof path));
        OM_TRY_DONE(om_path_join(below, name[i], rel, sizeof rel));
        OM_CHECK_DONE(lstat(path, &st) == 0, OM_IO, "%s: %s", path, strerror(errno));
        if (S_ISDIR(st.st_mode) && depth < MAX_DEPTH)
            status = walk(path, rel, depth + 1, visit, ctx);
        else
            status = visit(ctx, path, rel, S_ISREG(st.st_mode));
    }
done:
    om_free(name);
    om_text_done(&text);
    return status;
}

// Is there a line of this name and size? Compares no hash, so that a foreign file of many gigabytes
// is not read.
static bool has_size(const List* list, const char* name, int64_t size) {
    size_t len = strlen(name);
    for (int i = 0; i < list->nline; ++i) {
        const Line* l = &list->line[i];
        if (l->size == size && (size_t)l->len == len && memcmp(l->name, name, len) == 0)
            return true;
    }
    return false;
}

typedef struct Check {
    const List* list;
    const char* shown;  // the folder's name in messages
} Check;

static OmStatus check_file(void* ctx, const char* path, const char* name, bool is_file) {
    const Check* c = ctx;
    int64_t size = 0;
    uint64_t hash = 0;
    Fit fit = FIT_FOREIGN;
    struct stat st;
    is_file = is_file && lstat(path, &st) == 0;
    if (is_file && (!has_size(c->list, name, st.st_size) || hash_file(path, &size, &hash)))
        fit = list_fit(c->list, name, (int)strlen(name), size, hash);
    OM_CHECK(fit != FIT_FOREIGN, OM_INVALID, "%s holds %s, which omentum did not write: " REMEDY,
             c->shown, name);
    OM_CHECK(fit == FIT_SAME, OM_INVALID, "%s/%s was changed after omentum wrote it: " REMEDY,
             c->shown, name);
    return OM_OK;
}

OmStatus om__folder_check_ours(const char* dir, const char* shown) {
    List list;
    OM_TRY(list_read(dir, &list));
    Check c = {&list, shown};
    OmStatus status = walk(dir, "", 0, check_file, &c);
    list_done(&list);
    return status;
}

static OmStatus append_file(void* ctx, const char* path, const char* name, bool is_file) {
    int64_t size;
    uint64_t hash;
    OM_CHECK(is_file && is_plain(name) && hash_file(path, &size, &hash), OM_IO,
             "%s: cannot be listed", path);
    return om_text_append(ctx, "file %lld %016llx %s\n", (long long)size, (unsigned long long)hash,
                          name);
}

bool om__folder_name(const char* dir, char* out, size_t size) {
    List list;
    if (list_read(dir, &list) < 0 || !list.text) return false;
    const char* at = strstr(list.text, "\nname ");
    size_t n = at ? strcspn(at + 6, "\n") : 0;
    bool is_whole = !list.is_growing && n > 0 && n < size;
    if (is_whole) {
        memcpy(out, at + 6, n);
        out[n] = 0;
    }
    list_done(&list);
    return is_whole;
}

// ---- files in a folder that grows -----------------------------------------------------------------------

// Find the growing folder that contains `path`, its list, and the name of `path` below it. The nearest list
// decides. A folder with a temporary name does not count. list->text is null if there is none.
static OmStatus find_growing(const char* path, char root[OM__PATH], const char** name, List* list) {
    char dir[OM__PATH], at[OM__PATH];
    *list = (List){0};
    if (strcmp(om__path_name(path), OM__LIST) == 0) return OM_OK;
    OM_TRY(om_path_dir(path, dir, sizeof dir));
    if (!realpath(dir, at)) return OM_OK;  // the caller's next step reports the error
    int n = snprintf(root, OM__PATH, "%s/%s", strcmp(at, "/") == 0 ? "" : at, om__path_name(path));
    if (n >= OM__PATH) return OM_OK;
    for (char* slash; (slash = strrchr(at, '/')) != NULL && slash > at; *slash = 0) {
        if (om__temp_is_name(slash + 1)) return OM_OK;
        OM_TRY(list_read(at, list));
        if (!list->text) continue;
        if (!list->is_growing) list_done(list);
        *name = root + strlen(at) + 1;
        root[strlen(at)] = 0;
        return OM_OK;
    }
    return OM_OK;
}

OmStatus om__folder_check_replace(const char* path) {
    char root[OM__PATH];
    const char* name;
    List list;
    int64_t size;
    uint64_t hash;
    OM_TRY(find_growing(path, root, &name, &list));
    if (!list.text) return OM_OK;
    Fit fit = hash_file(path, &size, &hash) ? list_fit(&list, name, (int)strlen(name), size, hash)
                                            : FIT_FOREIGN;
    list_done(&list);
    OM_CHECK(fit == FIT_SAME, OM_INVALID, "%s was %s: " REMEDY, path,
             fit == FIT_CHANGED ? "changed after omentum wrote it" : "not written by omentum");
    return OM_OK;
}

OmStatus om__folder_note(const char* path, const char* temp) {
    char root[OM__PATH], at[OM__PATH], line[OM__PATH + 64];
    const char* name;
    List list;
    int64_t size;
    uint64_t hash;
    OM_TRY(find_growing(path, root, &name, &list));
    if (!list.text) return OM_OK;
    list_done(&list);
    if (!is_plain(name)) return OM_OK;
    OM_CHECK(hash_file(temp, &size, &hash), OM_IO, "%s: cannot read: %s", temp, strerror(errno));
    int n = snprintf(line, sizeof line, "file %lld %016llx %s\n", (long long)size,
                     (unsigned long long)hash, name);
    OM_TRY(om_path_join(root, OM__LIST, at, sizeof at));
    int fd = open(at, O_WRONLY | O_APPEND | O_NOFOLLOW | O_CLOEXEC);
    bool is_good = fd >= 0 && write(fd, line, (size_t)n) == n && fdatasync(fd) == 0;
    int error = errno;
    if (fd >= 0) close(fd);
    OM_CHECK(is_good, OM_IO, "%s: cannot write: %s", at, strerror(error));
    return OM_OK;
}

// ---- destination of an output folder --------------------------------------------------------------------

static OmStatus set_place(const char* dir, const char* kind, OmFolder* f) {
    memset(f, 0, sizeof *f);
    f->lock = -1;
    snprintf(f->kind, sizeof f->kind, "%s", kind);
    size_t len = strlen(dir);
    OM_CHECK(len > 0 && len < sizeof f->place - 128, OM_INVALID,
             "output folder: a name of %zu letters; 1 to %zu", len, sizeof f->place - 129);
    memcpy(f->place, dir, len + 1);
    while (len > 1 && f->place[len - 1] == '/') f->place[--len] = 0;
    struct stat st;
    const char* name = om__path_name(f->place);
    bool is_there = lstat(f->place, &st) == 0;
    bool is_link = is_there && S_ISLNK(st.st_mode);
    OM_CHECK(!is_link || stat(f->place, &st) == 0, OM_IO,
             "%s: is a link to a missing folder; name the folder itself", f->place);
    OM_CHECK(!is_there || S_ISDIR(st.st_mode), OM_IO, "%s: is a file, a folder is wanted",
             f->place);
    if (!is_link && strcmp(name, ".") != 0 && strcmp(name, "..") != 0) return OM_OK;
    char real[OM__PATH];
    OM_TRY(om__path_resolve(f->place, real));
    len = strlen(real);
    OM_CHECK(len < sizeof f->place - 128, OM_INVALID, "%s: path too long", dir);
    memcpy(f->place, real, len + 1);
    return OM_OK;
}

// The first entry of a folder besides the list and temporary files; "" if there is none.
static OmStatus first_entry(const char* dir, char* out, size_t size) {
    OmText text = {0};
    char** name;
    int n;
    out[0] = 0;
    OmStatus status = read_names(dir, true, &text, &name, &n);
    if (status == OM_OK && n > 0) snprintf(out, size, "%s", name[0]);
    om_free(name);
    om_text_done(&text);
    return status;
}

// A folder that is not empty and has no list, or a list of another kind.
static OmStatus refuse(const OmFolder* f, const List* list, const char* first) {
    if (list->text)
        return om_error(OM_INVALID, "%s holds a %.*s, not a %s: " REMEDY, f->place,
                        (int)strcspn(list->kind, "\n"), list->kind, f->kind);
    return om_error(OM_INVALID,
                    "%s holds %s and no list (" OM__LIST
                    ") of what omentum wrote, so nothing there is replaced: " REMEDY,
                    f->place, first);
}

static OmStatus check_replaceable(const OmFolder* f, const char* dir) {
    char first[256];
    List list;
    OM_TRY(first_entry(dir, first, sizeof first));
    OM_TRY(list_read(dir, &list));
    Check c = {&list, f->place};
    OmStatus status = OM_OK;
    bool is_ours = list.text && !list.is_growing && has_kind(&list, f->kind);
    if (is_ours)
        status = walk(dir, "", 0, check_file, &c);
    else if (first[0] || list.text)
        status = refuse(f, &list, first);
    list_done(&list);
    return status;
}

static OmStatus check_movable(const char* place, const char* parent) {
    struct stat st, up;
    char here[OM__PATH], real[OM__PATH];
    OM_CHECK(stat(place, &st) == 0 && stat(parent, &up) == 0, OM_IO, "%s: %s", place,
             strerror(errno));
    OM_CHECK(access(place, W_OK) == 0, OM_IO, "%s: cannot write: %s", place, strerror(errno));
    OM_CHECK(st.st_dev == up.st_dev, OM_INVALID,
             "%s is where a disk is mounted, so it cannot be replaced whole; name a folder in it",
             place);
    if (!getcwd(here, sizeof here) || !realpath(place, real)) return OM_OK;
    size_t n = strlen(real);
    OM_CHECK(strncmp(here, real, n) != 0 || (here[n] != '/' && here[n] != 0), OM_INVALID,
             "%s is the folder that the program was started in; name a folder in it", place);
    return OM_OK;
}

// ---- complete folders -----------------------------------------------------------------------------------

static OmStatus check_place(const OmFolder* f, const char* parent) {
    if (!om_path_exists(f->place)) return OM_OK;
    OM_TRY(check_movable(f->place, parent));
    return check_replaceable(f, f->place);
}

OmStatus om_folder_check(const char* dir, const char* kind) {
    OmFolder f;
    char parent[1024];
    OM_TRY(set_place(dir, kind, &f));
    OM_TRY(om_path_dir(f.place, parent, sizeof parent));
    return check_place(&f, parent);
}

OmStatus om_folder_begin(const char* dir, const char* kind, OmFolder* f) {
    char parent[1024];
    OM_TRY(set_place(dir, kind, f));
    OM_TRY(om_path_dir(f->place, parent, sizeof parent));
    OM_TRY(check_place(f, parent));
    OM_TRY(om_path_make_dir(parent));
    om_path_clean(parent, false);
    errno = 0;
    if (om__temp_make_folder(parent, f->path, sizeof f->path, &f->lock) < 0) {
        f->path[0] = 0;
        f->lock = -1;
        return om_error(OM_IO, "%s: cannot make the folder: %s", f->place, strerror(errno));
    }
    return OM_OK;
}

static OmStatus write_list(const OmFolder* f, const char* dir, bool is_growing,
                           const OmText* files) {
    char path[OM__PATH];
    OmText text = {0};
    const char* name = om__path_name(f->place);
    OmStatus status;
    OM_TRY(om_path_join(dir, OM__LIST, path, sizeof path));
    OM_TRY_DONE(om_text_append(&text, "%s%s\n", is_growing ? head_growing : head_whole, f->kind));
    if (!is_growing && is_plain(name)) OM_TRY_DONE(om_text_append(&text, "name %s\n", name));
    if (files->len) OM_TRY_DONE(om_text_append_raw(&text, files->str, files->len));
    status = om_file_write(path, text.str, text.len);
done:
    om_text_done(&text);
    return status;
}

// Exchange two folders. Without RENAME_EXCHANGE (some network disks) the old folder is renamed first: a kill
// between the two renames leaves both under temporary names with their lists, and om_path_clean restores one.
static bool exchange(const char* a, const char* b, char* aside, size_t size) {
    if (renameat2(AT_FDCWD, a, AT_FDCWD, b, RENAME_EXCHANGE) == 0) {
        snprintf(aside, size, "%s", a);
        return true;
    }
    if (errno != EINVAL && errno != ENOSYS) return false;
    char parent[1024];
    if (om_path_dir(b, parent, sizeof parent) < 0 || om__temp_path(parent, aside, size) < 0)
        return false;
    if (rename(b, aside) != 0) return false;
    if (rename(a, b) == 0) return true;
    int error = errno;
    (void)rename(aside, b);
    errno = error;
    return false;
}

// The destination cannot be replaced: the result gets another name beside it.
static OmStatus put_beside(OmFolder* f) {
    char beside[sizeof f->place];
    const char* random = om__path_name(f->path) + strlen(".omentum-");
    snprintf(beside, sizeof beside, "%.*s.new-%.8s", (int)sizeof beside - 16, f->place, random);
    OM_CHECK(renameat2(AT_FDCWD, f->path, AT_FDCWD, beside, RENAME_NOREPLACE) == 0 ||
                 (errno != EEXIST && rename(f->path, beside) == 0),
             OM_IO, "%s: cannot make the folder: %s", beside, strerror(errno));
    memcpy(f->place, beside, sizeof f->place);
    f->path[0] = 0;
    return OM_OK;
}

static OmStatus replace(OmFolder* f) {
    char aside[1100], back[1100], why[600];
    struct stat st;
    if (stat(f->place, &st) == 0) (void)chmod(f->path, st.st_mode & 07777);
    if (rename(f->path, f->place) == 0) return OM_OK;  // there is nothing, or an empty folder
    OM_CHECK(errno == EEXIST || errno == ENOTEMPTY, OM_IO, "%s: cannot make the folder: %s",
             f->place, strerror(errno));
    OM_CHECK(exchange(f->path, f->place, aside, sizeof aside), OM_IO, "%s: cannot replace: %s",
             f->place, strerror(errno));
    if (check_replaceable(f, aside) == OM_OK) {
        (void)om_path_remove(aside);  // a later run removes the rest
        return OM_OK;
    }
    // Another program wrote into the old folder in the meantime: undo the exchange.
    snprintf(why, sizeof why, "%s", om_error_message());
    f->path[0] = 0;
    OM_CHECK(exchange(aside, f->place, back, sizeof back), OM_IO, "%s; the old folder is now %s",
             why, aside);
    memcpy(f->path, back, sizeof f->path);
    return om_error(OM_INVALID, "%s", why);
}

static OmStatus finish(OmFolder* f, bool is_beside) {
    OmText files = {0};
    char within[1200];
    OM_ASSERT(f->path[0]);
    OmStatus status = walk(f->path, "", 0, append_file, &files);
    if (status == OM_OK) status = write_list(f, f->path, false, &files);
    om_text_done(&files);
    if (status == OM_OK) status = om_path_join(f->path, OM__LIST, within, sizeof within);
    if (status < 0) return status;
    om__sync_folder_of(within);
    char first[256] = "";
    if (is_beside && om_path_exists(f->place)) OM_TRY(first_entry(f->place, first, sizeof first));
    status = first[0] ? put_beside(f) : replace(f);
    // keep the result of hours of work although its destination is lost
    if (status < 0 && f->path[0]) {
        char why[600];
        snprintf(why, sizeof why, "%s", om_error_message());
        OM_TRY(put_beside(f));
        status = om_error(status, "%s; the result is in %s", why, f->place);
    }
    f->path[0] = 0;
    om__sync_folder_of(f->place);
    return status;
}

OmStatus om_folder_commit(OmFolder* f) {
    OmStatus status = finish(f, false);
    om_folder_end(f);
    return status;
}

OmStatus om_folder_commit_beside(OmFolder* f) {
    OmStatus status = finish(f, true);
    om_folder_end(f);
    return status;
}

// ---- growing folders ------------------------------------------------------------------------------------

// Is line i the last line of its name?
static bool is_last(const List* list, int i) {
    for (int k = i + 1; k < list->nline; ++k) {
        const Line *a = &list->line[i], *b = &list->line[k];
        if (a->key == b->key && a->len == b->len && !memcmp(a->name, b->name, (size_t)a->len))
            return false;
    }
    return true;
}

// Check at the start, not after an hour of work, that files which the run may replace are unchanged.
static OmStatus check_unchanged(const OmFolder* f, const List* list) {
    for (int i = 0; i < list->nline; ++i) {
        const Line* l = &list->line[i];
        char name[OM__PATH], path[OM__PATH];
        struct stat st;
        if (!is_last(list, i) || l->len >= OM__PATH) continue;
        memcpy(name, l->name, (size_t)l->len);
        name[l->len] = 0;
        OM_TRY(om_path_join(f->place, name, path, sizeof path));
        if (lstat(path, &st) != 0) continue;
        int64_t size = 0;
        uint64_t hash = 0;
        bool is_same = S_ISREG(st.st_mode);
        if (is_same && st.st_size <= CHECK_WITHIN)
            is_same = hash_file(path, &size, &hash) &&
                      list_fit(list, name, l->len, size, hash) == FIT_SAME;
        OM_CHECK(is_same, OM_INVALID, "%s was changed after omentum wrote it: " REMEDY, path);
    }
    return OM_OK;
}

static OmStatus lock_folder(OmFolder* f) {
    f->lock = open(f->place, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    OM_CHECK(f->lock >= 0, OM_IO, "%s: cannot open: %s", f->place, strerror(errno));
    OM_CHECK(flock(f->lock, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK, OM_INVALID,
             "%s: another run of omentum writes into it; wait for its end, or name another folder",
             f->place);
    return OM_OK;
}

// A kill cut off the last line of the list: start the next line on a new one.
static OmStatus end_last_line(const char* dir, const List* list) {
    char path[OM__PATH];
    if (list->text[list->len - 1] == '\n') return OM_OK;
    OM_TRY(om_path_join(dir, OM__LIST, path, sizeof path));
    int fd = open(path, O_WRONLY | O_APPEND | O_NOFOLLOW | O_CLOEXEC);
    bool is_good = fd >= 0 && write(fd, "\n", 1) == 1;
    if (fd >= 0) close(fd);
    OM_CHECK(is_good, OM_IO, "%s: cannot write: %s", path, strerror(errno));
    return OM_OK;
}

static OmStatus open_list(OmFolder* f) {
    char first[256], root[OM__PATH], inside[OM__PATH];
    const char* name;
    List list;
    const OmText none = {0};
    OM_TRY(list_read(f->place, &list));
    OmStatus status = OM_OK;
    if (list.text) {
        f->has_list = list.is_growing && has_kind(&list, f->kind);
        status = f->has_list ? check_unchanged(f, &list) : refuse(f, &list, "");
        if (status == OM_OK) status = end_last_line(f->place, &list);
        list_done(&list);
        return status;
    }
    OM_TRY(first_entry(f->place, first, sizeof first));
    f->has_list = first[0] == 0;
    if (f->has_list) return write_list(f, f->place, true, &none);
    // a part of a growing folder, such as a search of a study
    OM_TRY(om_path_join(f->place, first, inside, sizeof inside));
    OM_TRY(find_growing(inside, root, &name, &list));
    if (!list.text) status = refuse(f, &list, first);
    list_done(&list);
    return status;
}

OmStatus om_folder_open(const char* dir, const char* kind, OmFolder* f) {
    OM_TRY(set_place(dir, kind, f));
    OM_TRY(om_path_make_dir(f->place));
    snprintf(f->path, sizeof f->path, "%s", f->place);
    f->is_growing = true;
    OmStatus status = lock_folder(f);
    if (status == OM_OK) status = open_list(f);
    if (status < 0)
        om_folder_end(f);
    else
        om_path_clean(f->place, true);
    return status;
}

// One line for each file.
static void shorten_list(OmFolder* f) {
    List list;
    OmText files = {0};
    OmStatus status = list_read(f->place, &list);
    bool is_longer = false;
    for (int i = 0; i < list.nline && status == OM_OK; ++i) {
        const Line* l = &list.line[i];
        char path[OM__PATH];
        struct stat st;
        int n = snprintf(path, sizeof path, "%s/%.*s", f->place, l->len, l->name);
        bool is_kept = is_last(&list, i) && n < OM__PATH && lstat(path, &st) == 0;
        is_longer |= !is_kept;
        if (is_kept)
            status = om_text_append(&files, "file %lld %016llx %.*s\n", (long long)l->size,
                                    (unsigned long long)l->hash, l->len, l->name);
    }
    if (status == OM_OK && list.text && is_longer) (void)write_list(f, f->place, true, &files);
    om_text_done(&files);
    list_done(&list);
}

// Messages name the destination, not the temporary name.
static void show_place(const OmFolder* f) {
    char message[1024];
    snprintf(message, sizeof message, "%s", om_error_message());
    char* at = strstr(message, f->path);
    if (!at) return;
    *at = 0;
    (void)om_error(OM_IO, "%s%s%s", message, f->place, at + strlen(f->path));
}

void om_folder_end(OmFolder* f) {
    if (!f->kind[0]) return;
    if (f->is_growing) {
        if (f->lock >= 0 && f->has_list) {
            char message[1024];  // the message of the first error
            snprintf(message, sizeof message, "%s", om_error_message());
            shorten_list(f);
            if (message[0]) (void)om_error(OM_IO, "%s", message);
        }
    } else if (f->path[0]) {
        show_place(f);
        char message[1024];
        snprintf(message, sizeof message, "%s", om_error_message());
        if (om_path_remove(f->path) < 0) (void)om_error(OM_IO, "%s", message);
    }
    if (f->lock >= 0) close(f->lock);
    f->lock = -1;
    f->path[0] = f->kind[0] = 0;
}
