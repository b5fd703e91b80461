// test_common.h: what every test includes first: cmocka and assertions that print both values.
#ifndef OMENTUM_TEST_COMMON_H
#define OMENTUM_TEST_COMMON_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "omentum/base.h"
#include "omentum/vec.h"

#define SKIP_TEST_CODE 77  // what a test program returns when it needs files that are not here

// Tolerances are scaled by OM_TOL_SCALE; 0 shows every residual as a failure.
static inline double test_tol_scale(void) {
    const char* s = getenv("OM_TOL_SCALE");
    return s ? atof(s) : 1.0;
}

#define assert_ok(call)                                                                     \
    do {                                                                                    \
        OmStatus s_ = (call);                                                               \
        if (s_ != OM_OK) fail_msg("%s: status %d, %s", #call, (int)s_, om_error_message()); \
    } while (0)

#define assert_status(call, expected)                                                   \
    do {                                                                                \
        OmStatus s_ = (call);                                                           \
        if (s_ != (expected))                                                           \
            fail_msg("%s: status %d, expected %d, %s", #call, (int)s_, (int)(expected), \
                     om_error_message());                                               \
    } while (0)

/// |a - b| <= tol (1 + max(|a|, |b|) is not used: give an absolute tolerance with its reason)
#define assert_near(a, b, tol)                                                           \
    do {                                                                                 \
        double a_ = (a), b_ = (b), t_ = (tol)*test_tol_scale();                          \
        if (!(fabs(a_ - b_) <= t_))                                                      \
            fail_msg("%s = %.17g, %s = %.17g, |difference| %.3g > %.3g", #a, a_, #b, b_, \
                     fabs(a_ - b_), t_);                                                 \
    } while (0)

/// |a - b| <= tol max(|a|, |b|)
#define assert_near_rel(a, b, tol)                               \
    do {                                                         \
        double ra_ = (a), rb_ = (b);                             \
        assert_near(ra_, rb_, (tol)*fmax(fabs(ra_), fabs(rb_))); \
    } while (0)

#define assert_below(a, bound)                                                            \
    do {                                                                                  \
        double a_ = (a), b_ = (bound);                                                    \
        if (!(a_ < b_)) fail_msg("%s = %.9g is not below %s = %.9g", #a, a_, #bound, b_); \
    } while (0)

// The data folder beside the checkout, or where OM_DATA says; null if it is not there (skip, and say so).
static inline const char* test_data_dir(void) {
    static char dir[512];
    const char* env = getenv("OM_DATA");
    snprintf(dir, sizeof dir, "%s", env ? env : "../shared/data");
    return om_path_exists(dir) ? dir : NULL;
}

#endif
