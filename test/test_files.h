// test_files.h: temporary files of tests.
#ifndef OMENTUM_TEST_FILES_H
#define OMENTUM_TEST_FILES_H

#include <unistd.h>

#include "test_common.h"

/// A path of this process's own in the temporary folder; valid for two calls.
static inline const char* temp_path(const char* name) {
    static char path[2][512];
    static int turn;
    turn = !turn;
    snprintf(path[turn], sizeof path[turn], "/tmp/omentum-%ld-%s", (long)getpid(), name);
    return path[turn];
}

static inline void write_bytes(const char* path, const void* data, size_t size) {
    FILE* file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

#endif
