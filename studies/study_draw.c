// study_draw.c: judged cases follow from the measured sources.
//
// git's id of a file is the SHA-1 of "blob SIZE", a zero byte and its bytes; that of a folder is of "tree SIZE", a zero
// byte and its entries "MODE NAME", a zero byte and the id, sorted by name (a folder as if its name ended with "/").
// Files that git does not track count too: the draw is of what lies in the folders.
#include "studies/study_draw.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "studies/study_sha1.h"

#define MAX_PATH 1024
#define MAX_FILE ((size_t)256 << 20)
#define MAX_ENTRY 4096  // of one folder
#define NFOLDER 5

static const char* const folder_name[NFOLDER] = {"src", "studies", "scenes", "asp", "weights"};

// ---- ids of files and folders -----------------------------------------------------------------------

typedef struct Entry {
    char name[256];
    bool is_folder;
    const char* mode;
    unsigned char id[20];
} Entry;

static void hash_object(const char* kind, const void* data, size_t size, unsigned char id[20]) {
    char head[64];
    StudySha1 s;
    int n = snprintf(head, sizeof head, "%s %zu", kind, size);
    om__sha1_begin(&s);
    om__sha1_add(&s, head, (size_t)n + 1);
    om__sha1_add(&s, data, size);
    om__sha1_end(&s, id);
}

static double changed_at(const struct stat* info) {
    return (double)info->st_mtim.tv_sec + 1e-9 * (double)info->st_mtim.tv_nsec;
}

static int by_name(const void* a, const void* b) {
    const Entry *x = a, *y = b;
    char p[260], q[260];
    snprintf(p, sizeof p, "%s%s", x->name, x->is_folder ? "/" : "");
    snprintf(q, sizeof q, "%s%s", y->name, y->is_folder ? "/" : "");
    return strcmp(p, q);
}

static OmStatus hash_file(const char* path, unsigned char id[20]) {
    char* data;
    size_t size;
    OM_TRY(om_file_read(path, MAX_FILE, &data, &size));
    hash_object("blob", data, size, id);
    om_free(data);
    return OM_OK;
}

static OmStatus hash_link(const char* path, unsigned char id[20]) {
    char target[MAX_PATH];
    ssize_t n = readlink(path, target, sizeof target);
    OM_CHECK(n >= 0 && (size_t)n < sizeof target, OM_IO, "%s: cannot read the link", path);
    hash_object("blob", target, (size_t)n, id);
    return OM_OK;
}

static OmStatus hash_folder(const char* path, double* newest, int* nentry, unsigned char id[20]);

// One entry of a folder; an empty folder is none.
static OmStatus hash_entry(const char* path, double* newest, Entry* e, bool* is_there) {
    struct stat info;
    int n = 1;
    OM_CHECK(lstat(path, &info) == 0, OM_IO, "%s: cannot be read", path);
    e->is_folder = S_ISDIR(info.st_mode);
    e->mode = e->is_folder             ? "40000"
              : S_ISLNK(info.st_mode)  ? "120000"
              : info.st_mode & S_IXUSR ? "100755"
                                       : "100644";
    if (!e->is_folder) *newest = fmax(*newest, changed_at(&info));
    OmStatus status = e->is_folder            ? hash_folder(path, newest, &n, e->id)
                      : S_ISLNK(info.st_mode) ? hash_link(path, e->id)
                                              : hash_file(path, e->id);
    *is_there = n > 0;
    return status;
}

static OmStatus list_folder(DIR* dir, const char* path, double* newest, Entry* entry, int* n) {
    struct dirent* item;
    while ((item = readdir(dir)) != NULL) {
        char below[MAX_PATH];
        bool is_there = false;
        if (strcmp(item->d_name, ".") == 0 || strcmp(item->d_name, "..") == 0) continue;
        OM_CHECK(*n < MAX_ENTRY, OM_INVALID, "%s: more than %d files", path, MAX_ENTRY);
        Entry* e = &entry[*n];
        snprintf(e->name, sizeof e->name, "%s", item->d_name);
        OM_TRY(om_path_join(path, e->name, below, sizeof below));
        OM_TRY(hash_entry(below, newest, e, &is_there));
        *n += is_there;
    }
    return OM_OK;
}

static OmStatus hash_folder(const char* path, double* newest, int* nentry, unsigned char id[20]) {
    OmText text = {0};
    Entry* entry = NULL;
    OmStatus status;
    DIR* dir = opendir(path);
    *nentry = 0;
    OM_CHECK(dir, OM_IO, "%s: the folder cannot be read", path);
    OM_ALLOC_DONE(entry, MAX_ENTRY);
    OM_TRY_DONE(list_folder(dir, path, newest, entry, nentry));
    qsort(entry, (size_t)*nentry, sizeof *entry, by_name);
    for (int i = 0; i < *nentry; ++i) {
        OM_TRY_DONE(om_text_append(&text, "%s %s", entry[i].mode, entry[i].name));
        OM_TRY_DONE(om_text_append_raw(&text, "", 1));
        OM_TRY_DONE(om_text_append_raw(&text, (const char*)entry[i].id, 20));
    }
    hash_object("tree", text.str ? text.str : "", text.len, id);
    status = OM_OK;
done:
    closedir(dir);
    om_free(entry);
    om_text_done(&text);
    return status;
}

// ---- the hash -----------------------------------------------------------------------------------------

static void print_hex(const unsigned char* id, int n, char* out) {
    for (int k = 0; k < n; ++k) snprintf(out + 2 * k, 3, "%02x", id[k]);
}

// The first 16 digits of the SHA-1 of five lines "FOLDER ID".
static void hash_lines(char id[NFOLDER][41], char hash[20]) {
    unsigned char digest[20];
    StudySha1 s;
    om__sha1_begin(&s);
    for (int k = 0; k < NFOLDER; ++k) {
        char line[64];
        int n = snprintf(line, sizeof line, "%s %s\n", folder_name[k], id[k]);
        om__sha1_add(&s, line, (size_t)n);
    }
    om__sha1_end(&s, digest);
    print_hex(digest, 8, hash);
}

OmStatus om__study_draw_hash(const char* root, char hash[20], double* newest) {
    char id[NFOLDER][41];
    double latest = 0;
    for (int k = 0; k < NFOLDER; ++k) {
        char path[MAX_PATH];
        unsigned char folder[20];
        int n;
        OM_TRY(om_path_join(root, folder_name[k], path, sizeof path));
        OM_TRY(hash_folder(path, &latest, &n, folder));
        print_hex(folder, 20, id[k]);
    }
    hash_lines(id, hash);
    if (newest) *newest = latest;
    return OM_OK;
}

// The first line that `git -C ROOT rev-parse WORD` prints; `word` has digits, letters and a colon only.
static OmStatus ask_git(const char* root, const char* word, char* out, size_t size) {
    char command[2 * MAX_PATH];
    OM_CHECK(!strchr(root, '\''), OM_INVALID, "%s: a path with ' cannot be given to git", root);
    snprintf(command, sizeof command, "git -C '%s' rev-parse --verify --quiet '%s' 2> /dev/null",
             root, word);
    FILE* f = popen(command, "r");
    bool is_read = f && fgets(out, (int)size, f);
    if (f) (void)pclose(f);
    OM_CHECK(is_read, OM_IO, "git has no %s in %s", word, root);
    out[strcspn(out, "\n")] = 0;
    return OM_OK;
}

static OmStatus hash_commit(const char* root, const char* commit, char hash[20]) {
    char id[NFOLDER][41];
    for (int k = 0; k < NFOLDER; ++k) {
        char word[96], line[64];
        snprintf(word, sizeof word, "%s:%s", commit, folder_name[k]);
        OM_TRY(ask_git(root, word, line, sizeof line));
        snprintf(id[k], sizeof id[k], "%.40s", line);
    }
    hash_lines(id, hash);
    return OM_OK;
}

// ---- draws --------------------------------------------------------------------------------------------

#ifndef OM_SOURCE_DIR
#define OM_SOURCE_DIR ""
#endif

OmStatus om_study_draw_root(char* out, size_t size) {
    char path[MAX_PATH];
    OM_TRY(om_path_join(OM_SOURCE_DIR, "studies/study_draw.c", path, sizeof path));
    OM_CHECK(om_path_exists(path), OM_IO,
             "judged cases are drawn from the sources, which are no longer in \"%s\"",
             OM_SOURCE_DIR);
    snprintf(out, size, "%s", OM_SOURCE_DIR);
    return OM_OK;
}

static bool is_hex(const char* word, size_t least, size_t most) {
    const size_t n = strspn(word, "0123456789abcdef");
    return word[n] == 0 && n >= least && n <= most;
}

// The program must be newer than the files whose hash it uses.
static OmStatus check_age(double newest) {
    struct stat program;
    OM_CHECK(stat("/proc/self/exe", &program) != 0 || changed_at(&program) >= newest, OM_INVALID,
             "the sources have changed since this program was built; build it before a draw");
    return OM_OK;
}

// The files below root, and the commit that has them.
static OmStatus read_here(const char* root, OmStudyDraw* draw) {
    char head[64], hash[20];
    double newest;
    OM_TRY(om__study_draw_hash(root, draw->hash, &newest));
    OM_TRY(check_age(newest));
    if (ask_git(root, "HEAD", head, sizeof head) < 0) return OM_OK;
    OM_TRY(hash_commit(root, head, hash));
    snprintf(draw->commit, sizeof draw->commit, "%.10s%s", head,
             strcmp(hash, draw->hash) == 0 ? "" : "+");
    return OM_OK;
}

OmStatus om_study_draw_read(const char* word, int number, const char* root, OmStudyDraw* draw) {
    *draw = (OmStudyDraw){.kind = OM_DRAW_PUBLISHED};
    if (!word) return OM_OK;
    draw->kind = OM_DRAW_DEVELOPMENT;
    if (strcmp(word, "development") == 0) return OM_OK;
    OM_CHECK(number >= 1 && number <= OM_STUDY_NDRAW, OM_INVALID, "draw %d: 1 to %d", number,
             OM_STUDY_NDRAW);
    const bool is_here = strcmp(word, "here") == 0, is_hash = is_hex(word, 16, 16);
    OM_CHECK(
        is_here || is_hash || is_hex(word, 7, 40), OM_INVALID,
        "\"%s\" is none of development, here, a commit (7 to 40 digits) and a hash (16 digits)",
        word);
    draw->kind = OM_DRAW_JUDGED;
    draw->number = number;
    snprintf(draw->commit, sizeof draw->commit, "%s", is_here || is_hash ? "-" : word);
    if (is_here)
        OM_TRY(read_here(root, draw));
    else if (is_hash)
        snprintf(draw->hash, sizeof draw->hash, "%s", word);
    else
        OM_TRY(hash_commit(root, word, draw->hash));
    const uint64_t n = (uint64_t)number;
    draw->seed = om_hash(&n, sizeof n, strtoull(draw->hash, NULL, 16));
    return OM_OK;
}

// ---- the table ----------------------------------------------------------------------------------------

OmStatus om_study_draw_table(const char* file, const char* root, char* out, size_t size) {
    char git[MAX_PATH];
    if (file) {
        snprintf(out, size, "%s", file);
        return OM_OK;
    }
    OM_TRY(om_path_join(root, ".git", git, sizeof git));
    OM_CHECK(om_path_exists(git), OM_INVALID,
             "%s is no checkout with a doc/draws.csv: name a table with --draws FILE", root);
    return om_path_join(root, "doc/draws.csv", out, size);
}

OmStatus om_study_draw_append(const char* table, const OmStudyDraw* draw, const char* study,
                              const char* part, const char* cases, const char* result) {
    static const char heading[] = "study,part,hash,draw,commit,cases,result\n";
    char line[512];
    char* old = NULL;
    size_t size = 0;
    OmText text = {0};
    OmStatus status;
    if (draw->kind != OM_DRAW_JUDGED) return OM_OK;
    snprintf(line, sizeof line, "%s,%s,%s,%d,%s,%s,%s\n", study, part, draw->hash, draw->number,
             draw->commit, cases, result);
    if (om_path_exists(table)) OM_TRY(om_file_read(table, MAX_FILE, &old, &size));
    OM_TRY_DONE(old ? om_text_append_raw(&text, old, size)
                    : om_text_append_raw(&text, heading, sizeof heading - 1));
    status = OM_OK;
    if (strstr(text.str, line)) goto done;
    OM_TRY_DONE(om_text_append_raw(&text, line, strlen(line)));
    status = om_file_write(table, text.str, text.len);
done:
    om_free(old);
    om_text_done(&text);
    return status;
}
