// study_estimate.h: how long a study takes, before it starts.
#ifndef OMENTUM_STUDY_ESTIMATE_H
#define OMENTUM_STUDY_ESTIMATE_H

#include "omentum/base.h"

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
