// study_stats.h: statistics of a set of values, and how reports and files show them.
#ifndef OMENTUM_STUDY_STATS_H
#define OMENTUM_STUDY_STATS_H

#include "omentum/base.h"

typedef struct StudySample {  // all 0 if n is 0
    int n;
    double mean, sd, min, lower, median, upper, max;  // lower, upper: quartiles
} StudySample;

// Sorts `value`.
StudySample om__study_sample(double* value, int n);
// "median (lower-upper)" of scaled values; "-" if n is 0.
void om__sample_print(char* text, size_t size, double scale, const char* format, StudySample s);
// [lower, median, upper], scaled.
void om__put_quartiles(OmJson* json, const char* key, double scale, StudySample s);

// ---- columns of values ------------------------------------------------------------------------------

#define STUDY_MAX_COLUMN 6

typedef struct StudyColumns {  // zero-initialise
    double* value[STUDY_MAX_COLUMN];
    int n[STUDY_MAX_COLUMN], room[STUDY_MAX_COLUMN];
    OmStatus status;  // the first failure, which om__columns_end returns
} StudyColumns;

// Append one value to each of the first n columns, or to column `k`.
void om__columns_add(StudyColumns* c, int n, const double* value);
void om__column_add(StudyColumns* c, int k, double value);
// The statistics of the first n columns; frees all.
OmStatus om__columns_end(StudyColumns* c, int n, StudySample* const* sample);

// ---- 95 % confidence intervals, of shares and of differences between two ways on the same cases ---------------------

typedef struct StudyInterval {
    double value, lo, hi;
} StudyInterval;

// k of n, 0 <= k <= n, n > 0: Wilson's score interval (Wilson 1927).
StudyInterval om__interval_share(int k, int n);
// The share of the first way less that of the second on n > 0 cases that both were tried on; `first_only` and
// `second_only` count the cases where one alone succeeded. Agresti and Min 2005: Wald's interval with half a case more
// in each of the four cells.
StudyInterval om__interval_paired(int first_only, int second_only, int n);

#endif
