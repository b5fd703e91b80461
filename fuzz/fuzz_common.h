// fuzz_common.h: what every fuzz target shares. A target is one function; libFuzzer calls it with inputs of
// its own making (make fuzz), fuzz_replay.c with the corpus and simple damage to it (every test run).
#ifndef OMENTUM_FUZZ_COMMON_H
#define OMENTUM_FUZZ_COMMON_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "omentum/base.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

/// Stop as a found bug does: a property that must hold for every input does not.
#define FUZZ_EXPECT(cond)                                                                      \
    do {                                                                                       \
        if (!(cond)) {                                                                         \
            fprintf(stderr, "%s:%d: %s does not hold; last message: %s\n", __FILE__, __LINE__, \
                    #cond, om_error_message());                                                \
            abort();                                                                           \
        }                                                                                      \
    } while (0)

/// Write the input to a file of this process in memory-backed storage where there is some, for the readers
/// that take a path. The name ends in `suffix` (".nii.gz"). Valid until the next call; removed by
/// fuzz_file_done.
static inline const char* fuzz_file(const uint8_t* data, size_t size, const char* suffix) {
    static char path[128];
    const char* dir = access("/dev/shm", W_OK) == 0 ? "/dev/shm" : "/tmp";
    snprintf(path, sizeof path, "%s/omentum-fuzz-%ld%s", dir, (long)getpid(), suffix);
    FILE* file = fopen(path, "wb");
    FUZZ_EXPECT(file != NULL);
    FUZZ_EXPECT(size == 0 || fwrite(data, 1, size, file) == size);
    FUZZ_EXPECT(fclose(file) == 0);
    return path;
}

static inline void fuzz_file_done(const char* path) { remove(path); }

/// For targets that change a good file: `num` changes of `size` bytes each, from `data`. @return whether they are those
/// of the call before; the file is the same, then, and a cut within a change needs no second run.
static inline bool fuzz_is_known(const uint8_t* data, size_t num, size_t size) {
    static uint8_t last[256];
    static size_t nlast;
    static bool has_last;
    const size_t n = num * size;
    FUZZ_EXPECT(n <= sizeof last);
    const bool is_known = has_last && n == nlast && (n == 0 || memcmp(last, data, n) == 0);
    if (n > 0) memcpy(last, data, n);
    nlast = n;
    has_last = true;
    return is_known;
}

/// Give what was written to the file of fuzz_file to a target, and remove the file.
static inline void fuzz_file_again(const char* path,
                                   void (*parse)(const uint8_t* data, size_t size)) {
    char* bytes;
    size_t length;
    FUZZ_EXPECT(om_file_read(path, 1 << 24, &bytes, &length) == OM_OK);
    fuzz_file_done(path);
    parse((const uint8_t*)bytes, length);
    om_free(bytes);
}

#endif
