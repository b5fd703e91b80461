// test_folder.h: a temporary folder for all cases of a program.
#ifndef OMENTUM_TEST_FOLDER_H
#define OMENTUM_TEST_FOLDER_H

#include <stdlib.h>

#include "test_common.h"

static char dir[] = "/tmp/omentum-folder-XXXXXX";

static inline int make_dir(void** state) {
    (void)state;
    return mkdtemp(dir) ? 0 : -1;
}
static inline int remove_dir(void** state) {
    (void)state;
    return om_path_remove(dir);
}

// A few names live at a time.
static inline const char* in_dir(const char* name) {
    static char path[8][512];
    static int k;
    k = (k + 1) % 8;
    assert_ok(om_path_join(dir, name, path[k], sizeof path[k]));
    return path[k];
}

#endif
