// study_cases.c: files of results, and cases side by side.
//
// A file has a head (mark, setup, hash of all that follows) and the parts. Each thread writes the file of its case, so
// that cases are kept that end before another one fails.
#include "studies/study_cases.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define MAX_PATH 1024
#define MAX_FILE ((size_t)256 << 20)
#define MARK 0x4d41544348303033ull  // of a file, with its version

OmStatus om__study_check(const char* study, bool is_made, const char* out_dir, int nworker,
                         const StudyRange* range, int nrange) {
    OM_CHECK(is_made, OM_INVALID, "%s: a definition not made by its default_def", study);
    OM_CHECK(out_dir, OM_INVALID, "%s: no folder", study);
    OM_CHECK(nworker >= 0 && nworker <= OM_MAX_WORKER, OM_INVALID, "%s: nworker is %d: 0 to %d",
             study, nworker, OM_MAX_WORKER);
    for (int i = 0; i < nrange; ++i)
        OM_CHECK(range[i].value >= range[i].least && range[i].value <= range[i].most, OM_INVALID,
                 "%s: %s is %.10g: %.10g to %.10g", study, range[i].name, range[i].value,
                 range[i].least, range[i].most);
    return OM_OK;
}

typedef struct FileHead {
    uint64_t mark, setup, hash;  // hash of the parts
} FileHead;

OmStatus om__study_save_parts(const char* dir, const char* name, uint64_t setup,
                              const StudyPart* part, int npart) {
    char path[MAX_PATH];
    OmText text = {0};
    FileHead head = {.mark = MARK, .setup = setup};
    OmStatus status;
    OM_TRY_DONE(om_path_join(dir, name, path, sizeof path));
    OM_TRY_DONE(om_text_append_raw(&text, (const char*)&head, sizeof head));
    for (int i = 0; i < npart; ++i)
        if (part[i].size > 0) OM_TRY_DONE(om_text_append_raw(&text, part[i].data, part[i].size));
    head.hash = om_hash(text.str + sizeof head, text.len - sizeof head, OM_HASH_SEED);
    memcpy(text.str, &head, sizeof head);
    status = om_file_write(path, text.str, text.len);
done:
    om_text_done(&text);
    return status;
}

char* om__study_load_block(const char* dir, const char* name, uint64_t setup, size_t* size) {
    char path[MAX_PATH], *data;
    FileHead head = {0};
    if (om_path_join(dir, name, path, sizeof path) < 0 || !om_path_exists(path)) return NULL;
    if (om_file_read(path, MAX_FILE, &data, size) < 0) return NULL;
    if (*size >= sizeof head) {
        memcpy(&head, data, sizeof head);
        *size -= sizeof head;
        memmove(data, data + sizeof head, *size);
    }
    if (head.mark == MARK && head.setup == setup && head.hash == om_hash(data, *size, OM_HASH_SEED))
        return data;
    om_free(data);
    return NULL;
}

bool om__study_load_parts(const char* dir, const char* name, uint64_t setup, const StudyPart* part,
                          int npart) {
    size_t size, sum = 0;
    for (int i = 0; i < npart; ++i) sum += part[i].size;
    char *data = om__study_load_block(dir, name, setup, &size), *at = data;
    const bool is_good = data && size == sum;
    for (int i = 0; i < npart && is_good; at += part[i++].size)
        memcpy(part[i].data, at, part[i].size);
    om_free(data);
    return is_good;
}

bool om__match_load_result(const char* dir, const char* name, uint64_t setup, void* result,
                           size_t size) {
    return om__study_load_parts(dir, name, setup, &(StudyPart){result, size}, 1);
}

OmStatus om__match_save_result(const char* dir, const char* name, uint64_t setup,
                               const void* result, size_t size) {
    return om__study_save_parts(dir, name, setup, &(StudyPart){(void*)result, size}, 1);
}

uint64_t om__study_hash_method(int method) {
    const uint64_t hash = om_hash(OM_VERSION, strlen(OM_VERSION), OM_HASH_SEED);
    return om_hash(&method, sizeof method, hash);
}

// ---- estimates --------------------------------------------------------------------------------------
//
// Processor times of one piece of work are constants of each study, measured on the 2-core reference machine. Pieces
// that one thread makes run side by side; the last round is full, whatever is left for it.

double om__study_estimate(const StudyWork* work, int nwork, int nworker) {
    const int ncore = om_worker_count(nworker);
    double seconds = 0;
    for (int k = 0; k < nwork; ++k)
        seconds += work[k].seconds * (work[k].is_shared ? (double)work[k].n / ncore
                                                        : ceil((double)work[k].n / ncore));
    return seconds;
}

static void print_time(double seconds, char* out, size_t size) {
    if (seconds < 90)
        snprintf(out, size, "%.0f s", fmax(1, seconds));
    else if (seconds < 90 * 60)
        snprintf(out, size, "%.0f min", seconds / 60);
    else
        snprintf(out, size, "%.1f h", seconds / 3600);
}

void om__study_estimate_print(const StudyWork* work, int nwork, int nworker, char* out,
                              size_t size) {
    char time[32];
    size_t at = 0;
    out[0] = 0;
    for (int k = 0; k < nwork; ++k)
        if (work[k].n > 0 && at < size)
            at += (size_t)snprintf(out + at, size - at, "%s%d %s", at ? ", " : "", work[k].n,
                                   work[k].what);
    print_time(om__study_estimate(work, nwork, nworker), time, sizeof time);
    const int ncore = om_worker_count(nworker);
    if (at > 0 && at < size)
        snprintf(out + at, size - at, ": about %s on %d core%s", time, ncore,
                 ncore == 1 ? "" : "s");
}

OmStatus om__study_estimate_tell(const StudyWork* work, int nwork, int nworker,
                                 const OmProgress* progress) {
    char text[200];
    om__study_estimate_print(work, nwork, nworker, text, sizeof text);
    return text[0] ? om_progress_report(progress, text, 0, -1) : OM_OK;
}

bool om__study_has_file(const char* dir, const char* name) {
    char path[1024];
    return om_path_join(dir, name, path, sizeof path) == OM_OK && om_path_exists(path);
}

// ---- cases side by side -----------------------------------------------------------------------------

typedef struct Task {
    OmStatus status;
    char message[512];  // of an error: messages are of their thread
} Task;

typedef struct Batch {
    StudyCaseFn* fn;
    void* ctx;
    int first;
    Task* task;
} Batch;

static void run_range(void* ctx, int begin, int end, int block) {
    (void)block;
    Batch* b = ctx;
    for (int k = begin; k < end; ++k) {
        Task* t = &b->task[k];
        t->status = b->fn(b->ctx, b->first + k);
        if (t->status < 0) snprintf(t->message, sizeof t->message, "%s", om_error_message());
    }
}

OmStatus om__study_each(int n, int batch, int nworker, StudyCaseFn* fn, void* ctx, const char* what,
                        const OmProgress* progress) {
    Task* task;
    OM_ALLOC(task, batch);
    OmStatus status = OM_OK;
    for (int i = 0; i < n && status >= 0; i += batch) {
        const int m = n - i < batch ? n - i : batch;
        if (what) status = om_progress_report(progress, what, i, n);
        if (status < 0) break;
        Batch b = {fn, ctx, i, task};
        if (batch == 1)
            run_range(&b, 0, m, 0);  // not in a loop, in which a case would have one worker
        else
            om_parallel_for(nworker, m, 1, run_range, &b);
        for (int k = 0; k < m && status >= 0; ++k)
            if (task[k].status < 0) status = om_error(task[k].status, "%s", task[k].message);
    }
    om_free(task);
    return status < 0 ? status : OM_OK;
}

static void* result_of(const StudyCases* c, int i) {
    return (char*)c->result + (size_t)i * c->size;
}

OmStatus om__cases_find(StudyCases* c) {
    c->nmissing = 0;
    OM_ALLOC(c->missing, c->n);
    for (int i = 0; i < c->n; ++i) {
        char name[64];
        uint64_t hash;
        OM_TRY(c->name(c->ctx, i, name, &hash));
        if (!om__match_load_result(c->dir, name, hash, result_of(c, i), c->size))
            c->missing[c->nmissing++] = i;
    }
    return OM_OK;
}

static OmStatus make_one(void* ctx, int k) {
    StudyCases* c = ctx;
    const int i = c->missing[k];
    char name[64];
    uint64_t hash;
    memset(result_of(c, i), 0, c->size);
    OM_TRY(c->make(c->ctx, i, result_of(c, i)));
    OM_TRY(c->name(c->ctx, i, name, &hash));
    return om__match_save_result(c->dir, name, hash, result_of(c, i), c->size);
}

OmStatus om__cases_make(StudyCases* c, const OmProgress* progress) {
    const int nworker = om_worker_count(c->nworker);
    return om__study_each(c->nmissing, nworker, nworker, make_one, c, c->what, progress);
}

void om__cases_done(StudyCases* c) {
    om_free(c->missing);
    c->missing = NULL;
}

OmStatus om__cases_run(StudyCases* c, const OmProgress* progress) {
    OmStatus status = om__cases_find(c);
    const StudyWork work = {c->what, c->nmissing, c->seconds, false};
    if (status >= 0 && c->seconds > 0)
        status = om__study_estimate_tell(&work, 1, c->nworker, progress);
    if (status >= 0) status = om__cases_make(c, progress);
    om__cases_done(c);
    return status;
}
