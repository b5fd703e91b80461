// test_main.c: the program of the tests of one room.
//
//     tests_fem                                 the files there are
//     tests_fem test_fem_energy                 the cases of test_fem_energy.c, from the source root
//     tests_fem test_fem_energy "test_memory*"  only the cases whose names fit
//
// With OM_TEST_CASES=memory only the cases run whose names contain "memory" or "alloc" (test_common.h).
#include "test_common.h"
#undef main

#define TEST(name) int name(void);
#include OM_TEST_LIST
#undef TEST

static const struct TestFile {
    const char* name;
    int (*run)(void);
} files[] = {
#define TEST(name) {#name, name},
#include OM_TEST_LIST
};

int test_argc;
char** test_argv;

int main(int argc, char** argv) {
    test_argc = argc;
    test_argv = argv;
    for (size_t i = 0; argc > 1 && i < sizeof files / sizeof files[0]; ++i) {
        if (strcmp(files[i].name, argv[1]) != 0) continue;
        if (argc == 3) cmocka_set_test_filter(argv[2]);
        return files[i].run();
    }
    fprintf(stderr, "usage: %s FILE [PATTERN]; the files are\n", argv[0]);
    for (size_t i = 0; i < sizeof files / sizeof files[0]; ++i)
        fprintf(stderr, "    %s\n", files[i].name);
    return 2;
}
