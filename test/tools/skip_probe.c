// skip_probe.c: what test_common.h makes of skipped cases, of missing data, and of a test that never ends.
// test_skip.sh runs it; no test by itself.
#include "test_common.h"

static const char* mode;

static void first(void** state) {
    (void)state;
    if (strcmp(mode, "all") == 0 || strcmp(mode, "some") == 0) test_skip("no %s here", "first");
    if (strcmp(mode, "data") == 0) (void)test_data("a/b.txt");
    if (strcmp(mode, "skip and fail") == 0) test_skip("not needed");
    for (volatile int i = 0; strcmp(mode, "spin") == 0; i = !i) continue;
}

static void second(void** state) {
    (void)state;
    if (strcmp(mode, "all") == 0) skip();
    if (strcmp(mode, "data") == 0) (void)test_data("c.txt");
    if (strcmp(mode, "skip and fail") == 0) fail_msg("as it should");
}

int main(int argc, char** argv) {
    mode = argc > 1 ? argv[1] : "";
    const struct CMUnitTest tests[] = {cmocka_unit_test(first), cmocka_unit_test(second)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
