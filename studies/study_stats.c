// study_stats.c: statistics of a set of values.
#include "studies/study_stats.h"

#include <math.h>
#include <stdio.h>

StudySample om__study_sample(double* value, int n) {
    StudySample s = {.n = n};
    if (!n) return s;
    om_sort_doubles(value, n);
    double sum = 0, square = 0;
    for (int i = 0; i < n; ++i) sum += value[i];
    s.mean = sum / n;
    for (int i = 0; i < n; ++i) square += (value[i] - s.mean) * (value[i] - s.mean);
    s.sd = n > 1 ? sqrt(square / (n - 1)) : 0;
    s.min = value[0];
    s.lower = om_quantile(value, n, 0.25);
    s.median = om_quantile(value, n, 0.5);
    s.upper = om_quantile(value, n, 0.75);
    s.max = value[n - 1];
    return s;
}

void om__sample_print(char* text, size_t size, double scale, const char* format, StudySample s) {
    char a[24], b[24], c[24];
    if (s.n == 0) {
        snprintf(text, size, "-");
        return;
    }
    snprintf(a, sizeof a, format, scale * s.median);
    snprintf(b, sizeof b, format, scale * s.lower);
    snprintf(c, sizeof c, format, scale * s.upper);
    snprintf(text, size, "%s (%s-%s)", a, b, c);
}

void om__put_quartiles(OmJson* json, const char* key, double scale, StudySample s) {
    const double v[3] = {scale * s.lower, scale * s.median, scale * s.upper};
    om_json_numbers(json, key, v, 3);
}

// ---- columns of values ------------------------------------------------------------------------------

void om__column_add(StudyColumns* c, int k, double value) {
    if (c->n[k] == c->room[k] && c->status == OM_OK) {
        const int room = 2 * c->room[k] + 64;
        double* more = om_realloc(c->value[k], (size_t)c->room[k], (size_t)room, sizeof *more);
        if (!more) c->status = OM_NO_MEMORY;
        if (more) c->value[k] = more, c->room[k] = room;
    }
    if (c->status == OM_OK) c->value[k][c->n[k]++] = value;
}

void om__columns_add(StudyColumns* c, int n, const double* value) {
    for (int k = 0; k < n; ++k) om__column_add(c, k, value[k]);
}

OmStatus om__columns_end(StudyColumns* c, int n, StudySample* const* sample) {
    for (int k = 0; k < n; ++k) *sample[k] = om__study_sample(c->value[k], c->n[k]);
    for (int k = 0; k < STUDY_MAX_COLUMN; ++k) om_free(c->value[k]);
    return c->status;
}

// ---- intervals: closed forms ------------------------------------------------------------------------
//
// Those of differences hold the truth in 95 % of 60 cases, in 92 to 94 % of 15 (test_study_interval).

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
