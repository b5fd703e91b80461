// solve_lu_pattern.h: rows of blocks as compressed columns, for UMFPACK and for SuperLU. They count with other
// integers: the file that includes this defines LuIndex before.
#ifndef OMENTUM_SOLVE_LU_PATTERN_H
#define OMENTUM_SOLVE_LU_PATTERN_H

#include "solve/solve_internal.h"

/// The pattern of the transpose of A.
/// @param begin  of each column                     (3 nvert + 1)
/// @param row    of each entry                         (9 nblock)
static inline void om__lu_fill_pattern(const OmBsr* A, LuIndex* begin, LuIndex* row) {
    LuIndex at = 0;
    for (int i = 0; i < A->nvert; ++i) {
        const int nlower = om__row_count_lower(A, i), num = A->row_adr[i + 1] - A->row_adr[i];
        for (int r = 0; r < 3; ++r) {
            begin[3 * i + r] = at;
            for (int m = 0; m < num; ++m)
                for (int c = 0; c < 3; ++c)
                    row[at++] = 3 * A->col[om__row_block(A, i, m, nlower)] + c;
        }
    }
    begin[3 * A->nvert] = at;
}

#endif
