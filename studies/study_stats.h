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

#endif
