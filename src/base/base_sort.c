// base_sort.c: numbers in ascending order, and their quantiles.
#include <stdlib.h>

#include "omentum/base.h"

static int compare_ints(const void* a, const void* b) {
    int x = *(const int*)a, y = *(const int*)b;
    return (x > y) - (x < y);
}

static int compare_doubles(const void* a, const void* b) {
    double x = *(const double*)a, y = *(const double*)b;
    return (x > y) - (x < y);
}

void om_sort_ints(int* value, int n) {
    if (n > 1) qsort(value, (size_t)n, sizeof *value, compare_ints);
}

void om_sort_doubles(double* value, int n) {
    if (n > 1) qsort(value, (size_t)n, sizeof *value, compare_doubles);
}

double om_quantile(const double* sorted, int n, double share) {
    double at = share * (n - 1);
    int i = (int)at;
    return i + 1 < n ? sorted[i] + (at - i) * (sorted[i + 1] - sorted[i]) : sorted[n - 1];
}
