// solve_rows.c: rows of blocks as rows of numbers with ascending columns, for factors of unsymmetric matrices.
//
// Prescribed degrees of freedom become rows and columns of the identity, so that the pattern never changes.
#include "solve/solve_internal.h"

int om__row_count_lower(const OmBsr* A, int i) {
    int num = 0;
    for (int k = A->row_adr[i] + 1; k < A->row_adr[i + 1] && A->col[k] < i; ++k) ++num;
    return num;
}

int om__row_block(const OmBsr* A, int i, int m, int nlower) {
    if (m == nlower) return A->row_adr[i];
    return A->row_adr[i] + (m < nlower ? m + 1 : m);
}

OmStatus om__rows_write(const OmBsr* A, const unsigned char* fixed, double* out) {
    bool is_finite = true;
    for (int i = 0; i < A->nvert; ++i) {
        int nlower = om__row_count_lower(A, i), num = A->row_adr[i + 1] - A->row_adr[i];
        for (int r = 0; r < 3; ++r) {
            bool is_fixed = fixed[3 * i + r];
            for (int m = 0; m < num; ++m) {
                int k = om__row_block(A, i, m, nlower), j = A->col[k];
                for (int c = 0; c < 3; ++c) {
                    size_t at = 9 * (size_t)k + (size_t)(3 * c + r);
                    double e = A->exact ? A->exact[at] : (double)A->value[at];
                    is_finite = is_finite && e * 0.0 == 0.0;
                    if (is_fixed || fixed[3 * j + c]) e = i == j && r == c ? 1.0 : 0.0;
                    *out++ = e;
                }
            }
        }
    }
    OM_CHECK(is_finite, OM_INVALID, "om_solver_refresh: the matrix has a value that is not finite");
    return OM_OK;
}
