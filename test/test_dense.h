// test_dense.h: eigenvalues of small dense matrices, for comparison.
#ifndef OMENTUM_TEST_DENSE_H
#define OMENTUM_TEST_DENSE_H

#include <math.h>

#include "omentum/base.h"

/// Cyclic Jacobi on a dense symmetric matrix: the eigenvalues, ascending, in `value`.
static inline void test_jacobi(int n, double* M, double* value) {
    for (int sweep = 0; sweep < 60; ++sweep)
        for (int p = 0; p < n; ++p)
            for (int q = p + 1; q < n; ++q) {
                double apq = M[p * n + q];
                if (fabs(apq) < 1e-300) continue;
                double theta = (M[q * n + q] - M[p * n + p]) / (2 * apq);
                double t = (theta >= 0 ? 1 : -1) / (fabs(theta) + sqrt(theta * theta + 1));
                double c = 1 / sqrt(t * t + 1), s = t * c;
                for (int k = 0; k < n; ++k) {
                    double a = M[k * n + p], b = M[k * n + q];
                    M[k * n + p] = c * a - s * b;
                    M[k * n + q] = s * a + c * b;
                }
                for (int k = 0; k < n; ++k) {
                    double a = M[p * n + k], b = M[q * n + k];
                    M[p * n + k] = c * a - s * b;
                    M[q * n + k] = s * a + c * b;
                }
            }
    for (int i = 0; i < n; ++i) value[i] = M[i * n + i];
    om_sort_doubles(value, n);
}

/// Eigenvalues of M x = lambda B x are those of the new M: the Cholesky factor of B in place, M = L^-1 M L^-T.
static inline void test_reduce_to_standard(int n, double* B, double* M) {
    for (int j = 0; j < n; ++j)
        for (int i = j; i < n; ++i) {
            double s = B[i * n + j];
            for (int k = 0; k < j; ++k) s -= B[i * n + k] * B[j * n + k];
            B[i * n + j] = i == j ? sqrt(s) : s / B[j * n + j];
        }
    for (int pass = 0; pass < 2; ++pass) {
        for (int c = 0; c < n; ++c)
            for (int i = 0; i < n; ++i) {
                double s = M[i * n + c];
                for (int k = 0; k < i; ++k) s -= B[i * n + k] * M[k * n + c];
                M[i * n + c] = s / B[i * n + i];
            }
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < i; ++j) {
                double t = M[i * n + j];
                M[i * n + j] = M[j * n + i];
                M[j * n + i] = t;
            }
    }
}

#endif
