// test_domain.h: a DDS domain that no test beside this one uses.
#ifndef TEST_DOMAIN_H
#define TEST_DOMAIN_H

#include <stdlib.h>
#include <unistd.h>

// tools/run_tests.py gives each of its jobs domains of its own; a test that is run by hand draws one.
static inline int test_domain(void) {
    const char* given = getenv("OM_TEST_DOMAIN");
    return given ? atoi(given) : 100 + (int)(getpid() % 100);
}

#endif
