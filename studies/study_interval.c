// study_interval.c: closed forms. Intervals of differences hold the truth in 95 % of 60 cases, in 92 to 94 % of 15
// (test_study_interval).
#include "studies/study_interval.h"

#include <math.h>

#define Z 1.959963984540054  // of 95 %

StudyInterval om__interval_share(int k, int n) {
    const double p = (double)k / n, z2 = Z * Z, whole = 1 + z2 / n;
    const double middle = (p + z2 / (2 * n)) / whole;
    const double half = Z * sqrt(p * (1 - p) / n + z2 / (4.0 * n * n)) / whole;
    return (StudyInterval){p, fmax(0, middle - half), fmin(1, middle + half)};
}

StudyInterval om__interval_paired(int first_only, int second_only, int n) {
    const double b = first_only + 0.5, c = second_only + 0.5, m = n + 2;
    const double middle = (b - c) / m;
    const double half = Z * sqrt(b + c - (b - c) * (b - c) / m) / m;
    return (StudyInterval){(double)(first_only - second_only) / n, fmax(-1, middle - half),
                           fmin(1, middle + half)};
}
