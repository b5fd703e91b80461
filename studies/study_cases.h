// study_cases.h: cases of a study, each with a result in a file of its own; several are made at once.
//
//     StudyCases c = {.dir = dir, .what = "layouts", .n = n, .size = sizeof *result, .result = result,
//                     .name = name_layout, .make = make_layout, .ctx = &study};
//     om__cases_run(&c, progress);
//
// A result of other settings, of another version of omentum or of the method has another hash and is made anew.
#ifndef OMENTUM_STUDY_CASES_H
#define OMENTUM_STUDY_CASES_H

#include "omentum/base.h"

// ---- definitions ------------------------------------------------------------------------------------

typedef struct StudyRange {  // a field of a definition, and its bounds
    const char* name;
    double value, least, most;
} StudyRange;

// OM_INVALID, with a message that names study and field: a definition that no default_def made, without a folder, or
// with a field out of its range.
#define STUDY_CHECK(study, def, made, range)                                               \
    om__study_check(study, (def)->cookie == (made), (def)->out_dir, (def)->nworker, range, \
                    (int)(sizeof(range) / sizeof *(range)))
OmStatus om__study_check(const char* study, bool is_made, const char* out_dir, int nworker,
                         const StudyRange* range, int nrange);

// ---- files ------------------------------------------------------------------------------------------

typedef struct StudyPart {  // a block of memory in a file
    void* data;
    size_t size;
} StudyPart;

// Write the parts one behind the other, whole or not at all; `setup` is a hash of everything that they depend on.
OmStatus om__study_save_parts(const char* dir, const char* name, uint64_t setup,
                              const StudyPart* part, int npart);
// Read them. False: no such file, or it is of another setup or was changed; then the parts are not defined.
bool om__study_load_parts(const char* dir, const char* name, uint64_t setup, const StudyPart* part,
                          int npart);
// The same bytes in one block, which om_free frees; null: no such file, or out of memory.
char* om__study_load_block(const char* dir, const char* name, uint64_t setup, size_t* size);
// One part.
bool om__match_load_result(const char* dir, const char* name, uint64_t setup, void* result,
                           size_t size);
OmStatus om__match_save_result(const char* dir, const char* name, uint64_t setup,
                               const void* result, size_t size);
// Hash of the version of omentum and of a number of the method, with which the hash of a result begins.
uint64_t om__study_hash_method(int method);

// ---- cases ------------------------------------------------------------------------------------------

typedef OmStatus StudyCaseFn(void* ctx, int i);
// fn(ctx, i) of 0 to n - 1, `batch` at once on the workers, with a report of progress before each batch: null `what` or
// `progress`: none. Several threads call `fn`.
// Returns the first failure of the first batch that has one, with its message.
OmStatus om__study_each(int n, int batch, int nworker, StudyCaseFn* fn, void* ctx, const char* what,
                        const OmProgress* progress);

typedef struct StudyCases {
    const char* dir;
    const char* what;  // "layouts", for progress
    int n;
    int nworker;     // cases at once; 0: one a processor
    double seconds;  // processor time of one, for the estimate; 0: none
    size_t size;     // of a result
    void* result;    // (n x size)
    void* ctx;
    // The file of case i, and the hash of everything that its result depends on.
    OmStatus (*name)(const void* ctx, int i, char name[64], uint64_t* hash);
    // Make result i, zero before. Several threads at a time, if nworker is not 1.
    OmStatus (*make)(void* ctx, int i, void* result);
    int nmissing;  // out of om__cases_find
    int* missing;  // (nmissing)
} StudyCases;

// Read the results that the folder has.
OmStatus om__cases_find(StudyCases* c);
// Make the missing ones and write their files.
OmStatus om__cases_make(StudyCases* c, const OmProgress* progress);
void om__cases_done(StudyCases* c);
// All of it, with an estimate of the time between. c->nmissing: cases that were made now.
OmStatus om__cases_run(StudyCases* c, const OmProgress* progress);

// ---- how long a study takes, before it starts -------------------------------------------------------

typedef struct StudyWork {  // what a study is about to make: only what its folder does not have
    const char* what;       // "runs"
    int n;
    double seconds;  // processor time of one, measured on the 2-core reference machine
    bool is_shared;  // made by all workers together; else by one thread
} StudyWork;

// Wall time in s with this many workers on idle cores, at most as many as there are processors.
double om__study_estimate(const StudyWork* work, int nwork, int nworker);
// "38 runs, 4 searches: about 42 min on 2 cores"
void om__study_estimate_print(const StudyWork* work, int nwork, int nworker, char* out,
                              size_t size);
// Say it to the listener, as a stage with a total below 0: a sentence for people. Nothing missing: nothing is said.
// OM_CANCELLED: the listener requests an end.
OmStatus om__study_estimate_tell(const StudyWork* work, int nwork, int nworker,
                                 const OmProgress* progress);

// Is a file of this name in the folder?
bool om__study_has_file(const char* dir, const char* name);

#endif
