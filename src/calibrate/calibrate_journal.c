// calibrate_journal.c: file of evaluations, one JSON line each, appended with one write.
//
// A killed process loses at most the line that it was writing. A power failure may lose the last lines, which
// are evaluated again. Numbers have 17 digits, so they are read back as the same doubles.
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "calibrate/calibrate_internal.h"

#define MAX_SIZE ((size_t)1 << 30)

// ---- writing --------------------------------------------------------------------------------------

static OmStatus append_number(OmText* t, double v) {
    char word[OM_NUMBER_SIZE];
    if (!isfinite(v)) return om_text_append(t, "null");
    return om_text_append_raw(t, word, (size_t)om_number_write(word, v));
}

static OmStatus append_list(OmText* t, const char* key, const double* v, int n) {
    OM_TRY(om_text_append(t, ",\"%s\":[", key));
    for (int i = 0; i < n; ++i) {
        if (i) OM_TRY(om_text_append(t, ","));
        OM_TRY(append_number(t, v[i]));
    }
    return om_text_append(t, "]");
}

static OmStatus write_all(const OmJournal* j, const char* data, size_t size) {
    while (size > 0) {
        ssize_t n = write(j->fd, data, size);
        if (n < 0 && errno == EINTR) continue;
        OM_CHECK(n > 0, OM_IO, "%s: cannot write: %s", j->path, strerror(errno));
        data += n, size -= (size_t)n;
    }
    return OM_OK;
}

static OmStatus append_record(OmText* t, const OmJournal* j, int k, const char* stage,
                              const double* param, double cost, const double* error) {
    OM_TRY(om_text_append(t, "{\"k\":%d,\"stage\":\"%s\",\"cost\":", k, stage));
    OM_TRY(append_number(t, cost));
    OM_TRY(append_list(t, "p", param, j->nparam));
    if (error) OM_TRY(append_list(t, "error", error, j->nerror));
    return om_text_append(t, "}\n");
}

OmStatus om__journal_put(const OmJournal* j, int k, const char* stage, const double* param,
                         double cost, const double* error) {
    if (j->fd < 0) return OM_OK;
    OmText t = {0};
    OmStatus status = append_record(&t, j, k, stage, param, cost, error);
    if (status == OM_OK) status = write_all(j, t.str, t.len);
    om_text_done(&t);
    return status;
}

// ---- reading --------------------------------------------------------------------------------------

// Move *at past `word` if it is next.
static bool take(const char** at, const char* end, const char* word) {
    size_t n = strlen(word);
    if ((size_t)(end - *at) < n || memcmp(*at, word, n) != 0) return false;
    *at += n;
    return true;
}

static bool take_number(const char** at, const char* end, double* v) {
    if (take(at, end, "null")) {
        *v = INFINITY;
        return true;
    }
    return om_number_parse(at, end, v);
}

static bool take_list(const char** at, const char* end, double* v, int n) {
    for (int i = 0; i < n; ++i)
        if ((i && !take(at, end, ",")) || !take_number(at, end, &v[i])) return false;
    return take(at, end, "]");
}

// Parse line k; its errors stay text until they are read.
static bool read_record(OmJournal* j, int k, char* line, const char* end) {
    const char* at = line;
    int64_t number;
    if (!take(&at, end, "{\"k\":") || !om_integer_parse(&at, end, &number) || number != k ||
        !take(&at, end, ",\"stage\":\""))
        return false;
    while (at < end && *at != '"') ++at;
    if (!take(&at, end, "\",\"cost\":") || !take_number(&at, end, &j->cost[k]) ||
        !take(&at, end, ",\"p\":[") ||
        !take_list(&at, end, j->param + (size_t)k * (size_t)j->nparam, j->nparam))
        return false;
    j->error[k] = take(&at, end, ",\"error\":[") ? line + (at - line) : NULL;
    return j->error[k] ? end[-1] == '}' : take(&at, end, "}") && at == end;
}

static OmStatus read_records(OmJournal* j, char* at, char* end) {
    int n = 0;
    for (char* p = at; p < end; ++p) n += *p == '\n';
    OM_ALLOC(j->param, (size_t)n * (size_t)j->nparam);
    OM_ALLOC(j->cost, n);
    OM_ALLOC(j->error, n);
    for (; j->nold < n; ++j->nold) {
        char* stop = memchr(at, '\n', (size_t)(end - at));
        OM_CHECK(read_record(j, j->nold, at, stop), OM_INVALID,
                 "%s:%d: not a line of a journal; remove the file to begin anew", j->path,
                 j->nold + 2);
        at = stop + 1;
    }
    return OM_OK;
}

// ---- opening --------------------------------------------------------------------------------------

static OmStatus append_header(OmText* t, const OmCalibrationDef* def, uint64_t problem) {
    OM_TRY(om_text_append(t, "{\"journal\":1,\"problem\":\"%016llx\",\"parameters\":[",
                          (unsigned long long)problem));
    for (int i = 0; i < def->nparam; ++i)
        OM_TRY(om_text_append(t, "%s\"%s\"", i ? "," : "", def->param[i].name));
    return om_text_append(t, "]}\n");
}

// Bytes after the last complete line must be the beginning of a line of this format; only then they are cut off.
static OmStatus check_rest(const OmJournal* j, const OmText* header, size_t whole, size_t size) {
    static const char record[] = "{\"k\":";
    const char* ours = whole ? record : header->str;
    size_t max = whole ? sizeof record - 1 : header->len, n = size - whole;
    OM_CHECK(memcmp(j->text + whole, ours, n < max ? n : max) == 0 && (whole || n < max),
             OM_INVALID, "%s: its last line is not of a journal; move the file away", j->path);
    return OM_OK;
}

// Open a regular file; a link is refused, because it may lead to a file of another program.
static OmStatus check_file(const OmJournal* j, bool* is_there) {
    struct stat st;
    *is_there = lstat(j->path, &st) == 0;
    OM_CHECK(!*is_there || (S_ISREG(st.st_mode) && st.st_nlink == 1), OM_INVALID,
             "%s: is %s, so nothing is appended to it; move it away", j->path,
             S_ISREG(st.st_mode) ? "a file with two names" : "a link or no file");
    return OM_OK;
}

static OmStatus open_with_header(OmJournal* j, const OmText* header) {
    size_t size = 0, all, whole = 0;
    bool is_there;
    OM_TRY(check_file(j, &is_there));
    if (is_there) OM_TRY(om_file_read(j->path, MAX_SIZE, &j->text, &size));
    all = size;
    while (size > 0 && j->text[size - 1] != '\n') --size;  // ignore an incomplete last line
    if (all > size) OM_TRY(check_rest(j, header, size, all));
    if (size > 0) {
        whole = size;
        OM_CHECK(size >= header->len && memcmp(j->text, header->str, header->len) == 0, OM_INVALID,
                 "%s: the journal of another problem; give another folder, or remove the file",
                 j->path);
        OM_TRY(read_records(j, j->text + header->len, j->text + size));
    }
    j->fd = open(j->path, O_WRONLY | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666);
    OM_CHECK(j->fd >= 0, OM_IO, "%s: cannot open: %s", j->path, strerror(errno));
    OM_CHECK(ftruncate(j->fd, (off_t)whole) == 0 && lseek(j->fd, 0, SEEK_END) >= 0, OM_IO,
             "%s: cannot write: %s", j->path, strerror(errno));
    return whole ? OM_OK : write_all(j, header->str, header->len);
}

OmStatus om__journal_open(OmJournal* j, const char* dir, const OmCalibrationDef* def,
                          uint64_t problem) {
    *j = (OmJournal){.fd = -1, .nparam = def->nparam, .nerror = def->nerror};
    if (!dir) return OM_OK;
    OM_TRY(om_path_make_dir(dir));
    OM_TRY(om_path_join(dir, "journal.jsonl", j->path, sizeof j->path));
    OmText header = {0};
    OmStatus status = append_header(&header, def, problem);
    if (status == OM_OK) status = open_with_header(j, &header);
    om_text_done(&header);
    if (status != OM_OK) om__journal_close(j);
    return status;
}

void om__journal_close(OmJournal* j) {
    if (j->fd >= 0) close(j->fd);
    om_free(j->param);
    om_free(j->cost);
    om_free(j->error);
    om_free(j->text);
    *j = (OmJournal){.fd = -1};
}

OmStatus om__journal_get(const OmJournal* j, int k, const double* param, double* cost,
                         double* error) {
    const double* p = j->param + (size_t)k * (size_t)j->nparam;
    OM_CHECK(memcmp(p, param, (size_t)j->nparam * sizeof *p) == 0, OM_INVALID,
             "%s:%d: this evaluation has other parameters than this search; remove the file to "
             "begin anew",
             j->path, k + 2);
    *cost = j->cost[k];
    if (!error) return OM_OK;
    const char* at = j->error[k];
    OM_CHECK(at && take_list(&at, at + strcspn(at, "\n"), error, j->nerror), OM_INVALID,
             "%s:%d: the list of errors is damaged; remove the file to begin anew", j->path, k + 2);
    return OM_OK;
}
