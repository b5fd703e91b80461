// trial_kept.h: the finished trials of a plan before an operation, kept in a file.
#ifndef OMENTUM_TRIAL_KEPT_H
#define OMENTUM_TRIAL_KEPT_H

#include "omentum/base.h"

typedef struct Kept {
    char path[1024];
    int fd;      // -1: nothing is kept
    char* data;  // of the file when it was opened
    size_t size;
} Kept;

// Open or make the file. Trials of another key are discarded with a warning. A null path keeps nothing.
// @return OM_OK; OM_INVALID (another file, or another run writes into it); OM_IO; OM_NO_MEMORY
OmStatus om__kept_open(const char* path, uint64_t key, Kept* kept);
void om__kept_done(Kept* kept);
// The record of a trial in the file that was opened, null: none. Any thread may call it.
const void* om__kept_find(const Kept* kept, int index, size_t* size);
// Append the record of a finished trial. Any thread may call it.
// @return OM_OK; OM_IO; OM_NO_MEMORY
OmStatus om__kept_add(const Kept* kept, int index, const void* data, size_t size);

#endif
