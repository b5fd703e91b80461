// image_dicom.c: DICOM series by the program dcm2niix, a package of its own; segmentations are refused with the remedy.
//
// Libraries that read DICOM (GDCM, DCMTK) have no C interface, bring a dozen packages, and leave the assembly
// of a series to their caller: order and spacing of slices, tilted gantries, files of many frames. dcm2niix
// does all of this. It is run with a vector of arguments, not by a shell, and writes into a temporary folder.
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "image/image_internal.h"

extern char** environ;

enum { PREAMBLE = 128, HEAD = 2048, MAX_ENTRY = 64, MAX_DEPTH = 3, MAX_FILE = 32, MAX_SAID = 1000 };

typedef enum Kind { KIND_NONE, KIND_STRUCTURES, KIND_SEGMENTATION, KIND_IMAGES } Kind;

// ---- recognising ----------------------------------------------------------------------------------------

// The kind of a DICOM file, by its class in the file's meta information: (0002,0002), "UI", length, text.
static Kind kind_of_head(const char* head, size_t size) {
    static const char tag[] = {2, 0, 2, 0, 'U', 'I'};
    static const struct {
        const char* uid;
        Kind kind;
    } table[] = {{"1.2.840.10008.5.1.4.1.1.66.4", KIND_SEGMENTATION},
                 {"1.2.840.10008.5.1.4.1.1.66.5", KIND_SEGMENTATION},
                 {"1.2.840.10008.5.1.4.1.1.66.7", KIND_SEGMENTATION},
                 {"1.2.840.10008.5.1.4.1.1.481.3", KIND_STRUCTURES}};
    for (size_t at = PREAMBLE + 4; at + 8 <= size; at++) {
        if (memcmp(head + at, tag, sizeof tag) != 0) continue;
        size_t len =
            (size_t)(unsigned char)head[at + 6] + 256 * (size_t)(unsigned char)head[at + 7];
        const char* uid = head + at + 8;
        if (len > size - at - 8) return KIND_IMAGES;
        while (len > 0 && (uid[len - 1] == 0 || uid[len - 1] == ' ')) len--;
        for (size_t i = 0; i < sizeof table / sizeof *table; i++)
            if (strlen(table[i].uid) == len && memcmp(uid, table[i].uid, len) == 0)
                return table[i].kind;
        return KIND_IMAGES;
    }
    return KIND_IMAGES;
}

static Kind kind_of_file(const char* path) {
    char head[HEAD];
    struct stat info;
    if (stat(path, &info) != 0 || !S_ISREG(info.st_mode)) return KIND_NONE;
    FILE* file = fopen(path, "rb");
    if (!file) return KIND_NONE;
    size_t size = fread(head, 1, sizeof head, file);
    fclose(file);
    const bool is_dicom = size >= PREAMBLE + 4 && memcmp(head + PREAMBLE, "DICM", 4) == 0;
    return is_dicom ? kind_of_head(head, size) : KIND_NONE;
}

// Look at the first entries of a folder, and of folders in it: on a disc, series lie below DICOM/PAT0/STU0. Images
// go before other kinds.
static Kind find_kind(const char* path, int depth, int* budget) {
    Kind kind = kind_of_file(path);
    DIR* dir = kind == KIND_NONE && depth < MAX_DEPTH ? opendir(path) : NULL;
    for (struct dirent* e;
         dir && kind != KIND_IMAGES && *budget > 0 && (e = readdir(dir)) != NULL;) {
        char entry[2048];
        if (e->d_name[0] == '.') continue;
        --*budget;
        if (om_path_join(path, e->d_name, entry, sizeof entry) != OM_OK) continue;
        Kind found = find_kind(entry, depth + 1, budget);
        if (found > kind) kind = found;
    }
    if (dir) closedir(dir);
    return kind;
}

static Kind kind_of(const char* path) {
    int budget = MAX_ENTRY;
    return find_kind(path, 0, &budget);
}

bool om_dicom_is_there(const char* path) { return kind_of(path) != KIND_NONE; }

static OmStatus refuse_labels(const char* path, Kind kind) {
    if (kind == KIND_SEGMENTATION)
        return om_error(
            OM_INVALID,
            "%s: a DICOM segmentation (DICOM-SEG) is not read: convert it with segimage2itkimage "
            "--inputDICOM FILE --outputDirectory DIR -t nrrd (package dcmqi), or load it in 3D "
            "Slicer (extension QuantitativeReporting) and export it as .seg.nrrd",
            path);
    if (kind == KIND_STRUCTURES)
        return om_error(
            OM_INVALID,
            "%s: DICOM contours (RTSTRUCT) are not read: load them in 3D Slicer (extension "
            "SlicerRT) and export them as .seg.nrrd",
            path);
    return OM_OK;
}

static OmStatus folder_of(const char* path, char* dir, size_t size) {
    struct stat info;
    const bool is_folder = stat(path, &info) == 0 && S_ISDIR(info.st_mode);
    OM_TRY(is_folder ? om_path_join(path, "", dir, size) : om_path_dir(path, dir, size));
    size_t len = strlen(dir);
    while (len > 1 && dir[len - 1] == '/') dir[--len] = 0;
    return OM_OK;
}

OmStatus om_volume_refuse_dicom(const char* path) {
    const Kind kind = kind_of(path);
    if (kind == KIND_NONE) return OM_OK;
    OM_TRY(refuse_labels(path, kind));
    char dir[1024];
    OM_TRY(folder_of(path, dir, sizeof dir));
    return om_error(OM_INVALID,
                    "%s: DICOM is not read; convert the series with: dcm2niix -z y -f %%d_%%s -o . "
                    "\"%s\" (package dcm2niix), and give the .nii.gz that it writes",
                    path, dir);
}

// ---- running dcm2niix -----------------------------------------------------------------------------------

typedef struct Talk {  // lines of the program
    OmDicomSay say;
    void* ctx;
    int nsaid;
    size_t len;
    char line[400], last[400];
} Talk;

static void end_line(Talk* t) {
    t->line[t->len] = 0;
    if (t->len > 0) {
        memcpy(t->last, t->line, t->len + 1);
        if (t->say && t->nsaid++ < MAX_SAID) t->say(t->ctx, t->line);
    }
    t->len = 0;
}

// What it prints may repeat bytes of the files: letters of ASCII are passed on.
static void hear(Talk* t, const char* bytes, size_t n) {
    for (size_t i = 0; i < n; i++) {
        const unsigned char c = (unsigned char)bytes[i];
        if (c == '\n' || c == '\r')
            end_line(t);
        else if (t->len + 1 < sizeof t->line)
            t->line[t->len++] = (char)(c < 32 ? ' ' : c >= 127 ? '?' : c);
    }
}

static OmStatus not_installed(const char* path, const char* dir) {
    return om_error(
        OM_UNAVAILABLE,
        "%s: DICOM is read by dcm2niix, which is not installed: install the package dcm2niix, or convert "
        "the series elsewhere with: dcm2niix -z y -f %%d_%%s -o . \"%s\" and give the .nii.gz that it "
        "writes",
        path, dir);
}

// Start the program with its output in a pipe; `*fd` is the end to read.
static OmStatus start(char* const* argv, const char* path, const char* dir, pid_t* pid, int* fd) {
    int ends[2];
    posix_spawn_file_actions_t act;
    OM_CHECK(pipe(ends) == 0, OM_IO, "dcm2niix: no pipe: %s", strerror(errno));
    if (posix_spawn_file_actions_init(&act) != 0) {
        close(ends[0]);
        close(ends[1]);
        return OM_NO_MEMORY;
    }
    int code = fcntl(ends[0], F_SETFD, FD_CLOEXEC) < 0 ? errno : 0;
    if (code == 0) code = posix_spawn_file_actions_addopen(&act, 0, "/dev/null", O_RDONLY, 0);
    if (code == 0) code = posix_spawn_file_actions_adddup2(&act, ends[1], 1);
    if (code == 0) code = posix_spawn_file_actions_adddup2(&act, ends[1], 2);
    if (code == 0 && ends[1] > 2) code = posix_spawn_file_actions_addclose(&act, ends[1]);
    if (code == 0) code = posix_spawnp(pid, argv[0], &act, NULL, argv, environ);
    posix_spawn_file_actions_destroy(&act);
    close(ends[1]);
    *fd = ends[0];
    if (code == 0) return OM_OK;
    close(ends[0]);
    if (code == ENOENT || code == EACCES) return not_installed(path, dir);
    return om_error(OM_IO, "dcm2niix: %s", strerror(code));
}

static OmStatus run(const char* path, const char* out, Talk* talk) {
    char input[1100], dir[1024];
    OM_TRY(folder_of(path, dir, sizeof dir));
    // a name that begins with a dash is no option
    OM_CHECK(snprintf(input, sizeof input, "%s%s", path[0] == '-' ? "./" : "", path) <
                 (int)sizeof input,
             OM_INVALID, "%s: the path is too long", path);
    char program[] = "dcm2niix", b[] = "-b", z[] = "-z", no[] = "n", f[] = "-f", name[] = "%s_%d",
         o[] = "-o", to[256];
    snprintf(to, sizeof to, "%s", out);
    char* const argv[] = {program, b, no, z, no, f, name, o, to, input, NULL};
    pid_t pid = -1;
    int fd = -1, state = 0;
    OM_TRY(start(argv, path, dir, &pid, &fd));
    for (;;) {
        char bytes[4096];
        ssize_t n = read(fd, bytes, sizeof bytes);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) break;
        hear(talk, bytes, (size_t)n);
    }
    end_line(talk);
    close(fd);
    pid_t got;
    do {
        got = waitpid(pid, &state, 0);
    } while (got < 0 && errno == EINTR);
    const bool is_done = got < 0 || (WIFEXITED(state) && WEXITSTATUS(state) == 0);
    if (got == pid && WIFEXITED(state) && WEXITSTATUS(state) == 127)
        return not_installed(path, dir);  // where the system finds it out only in the new process
    OM_CHECK(is_done, OM_INVALID, "%s: dcm2niix failed (%s %d): %s", path,
             WIFSIGNALED(state) ? "signal" : "code",
             WIFSIGNALED(state) ? WTERMSIG(state) : WEXITSTATUS(state),
             talk->last[0] ? talk->last : "it says nothing");
    return OM_OK;
}

// ---- what it wrote --------------------------------------------------------------------------------------

static bool is_volume(const char* dir, const char* name) {
    char path[1100];
    struct stat info;
    size_t len = strlen(name);
    return len > 4 && strcmp(name + len - 4, ".nii") == 0 &&
           om_path_join(dir, name, path, sizeof path) == OM_OK && lstat(path, &info) == 0 &&
           S_ISREG(info.st_mode);
}

static int compare_names(const void* a, const void* b) { return strcmp(a, b); }

// Of one series: the volume, and corrected ones for a tilted gantry (_Tilt) and uneven slices (_Eq).
static bool is_corrected(const char* name, const char* first) {
    const size_t stem = strlen(first) - 4;
    return strncmp(name, first, stem) == 0 &&
           (strncmp(name + stem, "_Tilt", 5) == 0 || strncmp(name + stem, "_Eq", 3) == 0);
}

static OmStatus choose(const char* path, const Talk* talk, OmDicomSeries* series) {
    char name[MAX_FILE][256];
    int n = 0, best = 0;
    DIR* dir = opendir(series->dir);
    OM_CHECK(dir, OM_IO, "%s: %s", series->dir, strerror(errno));
    for (struct dirent* e; n < MAX_FILE && (e = readdir(dir)) != NULL;)
        if (strlen(e->d_name) < sizeof name[0] && is_volume(series->dir, e->d_name))
            snprintf(name[n++], sizeof name[0], "%s", e->d_name);
    closedir(dir);
    OM_CHECK(n > 0, OM_INVALID, "%s: dcm2niix wrote no volume: %s", path,
             talk->last[0] ? talk->last : "it says nothing");
    qsort(name, (size_t)n, sizeof name[0], compare_names);
    int shortest = 0;
    for (int i = 1; i < n; i++)
        if (strlen(name[i]) < strlen(name[shortest])) shortest = i;
    bool is_one = true;
    for (int i = 0; i < n; i++) {
        is_one = is_one && (i == shortest || is_corrected(name[i], name[shortest]));
        if (strlen(name[i]) > strlen(name[best])) best = i;
    }
    if (!is_one) {
        char list[400] = "", word[OM_SEGMENT_NAME];
        size_t len = 0;
        for (int i = 0; i < n && i < 8 && len + 1 < sizeof list; i++) {
            om__segment_name(name[i], strlen(name[i]) - 4, word);
            len += (size_t)snprintf(list + len, sizeof list - len, "%s%.60s", i ? ", " : "", word);
        }
        return om_error(
            OM_INVALID,
            "%s holds several series (number_description): %s%s: put one into a folder of its own, or convert "
            "them with dcm2niix and give one of the volumes",
            path, list, n > 8 ? " and more" : "");
    }
    return om_path_join(series->dir, name[best], series->path, sizeof series->path);
}

OmStatus om_dicom_convert(const char* path, OmDicomSay say, void* ctx, OmDicomSeries* series) {
    memset(series, 0, sizeof *series);
    const Kind kind = kind_of(path);
    OM_CHECK(kind != KIND_NONE, OM_INVALID, "%s: neither a DICOM file nor a folder with one", path);
    OM_TRY(refuse_labels(path, kind));
    const char* place = getenv("TMPDIR");
    char dir[sizeof series->dir];
    int len =
        snprintf(dir, sizeof dir, "%s/omentum-dicom-XXXXXX", place && place[0] ? place : "/tmp");
    OM_CHECK(len < (int)sizeof dir, OM_INVALID, "TMPDIR: the path is too long");
    OM_CHECK(mkdtemp(dir), OM_IO, "%s: no temporary folder: %s", dir, strerror(errno));
    memcpy(series->dir, dir, sizeof dir);
    Talk talk = {.say = say, .ctx = ctx};
    OmStatus status = run(path, dir, &talk);
    if (status == OM_OK) status = choose(path, &talk, series);
    if (status < 0) om_dicom_done(series);
    return status;
}

void om_dicom_done(OmDicomSeries* series) {
    if (!series) return;
    if (series->dir[0]) (void)om_path_remove(series->dir);
    memset(series, 0, sizeof *series);
}
