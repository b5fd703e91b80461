// base_sort.c: numbers in ascending order.
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
