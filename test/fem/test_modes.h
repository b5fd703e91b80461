// test_modes.h: frequencies of a body from its matrix.
#ifndef OMENTUM_TEST_MODES_H
#define OMENTUM_TEST_MODES_H

#include "test_common.h"

#include "omentum/solve.h"
#include "omentum/solve_eigen.h"

// Squared angular frequencies of a body of stiffness K and lumped masses, ascending. `is_held` nodes: null is none.
static inline void find_modes(const OmBsr* K, const double* mass, const unsigned char* is_held,
                              double shift, int nmode, double* lambda) {
    int nnode = K->nvert, n = 0, *place = om_alloc((size_t)nnode, sizeof *place),
        *row = om_alloc(9 * (size_t)K->nblock, sizeof *row),
        *col = om_alloc(9 * (size_t)K->nblock, sizeof *col), at = 0;
    double *value = om_alloc(9 * (size_t)K->nblock, sizeof *value),
           *diagonal = om_alloc(3 * (size_t)nnode, sizeof *diagonal);
    for (int i = 0; i < nnode; ++i) place[i] = is_held && is_held[i] ? -1 : n++;
    for (int i = 0; i < nnode; ++i)
        for (int k = K->row_adr[i]; k < K->row_adr[i + 1]; ++k)
            for (int c = 0; c < 9 && place[i] >= 0 && place[K->col[k]] >= 0; ++c, ++at) {
                row[at] = 3 * place[i] + c % 3;
                col[at] = 3 * place[K->col[k]] + c / 3;
                value[at] = K->exact ? K->exact[9 * k + c] : (double)K->value[9 * k + c];
            }
    for (int i = 0; i < 3 * nnode; ++i)
        if (place[i / 3] >= 0) diagonal[3 * place[i / 3] + i % 3] = mass[i / 3];
    OmCsr A, B;
    assert_ok(om_csr_init(3 * n, at, row, col, value, &A));
    assert_ok(om_csr_init_diagonal(3 * n, diagonal, &B));
    double* shape = om_alloc((size_t)nmode * 3 * (size_t)n, sizeof *shape);
    OmEigenDef how = om_eigen_default_def(nmode, shift);
    if (om_eigen_smallest(&how, &A, &B, lambda, shape, NULL) != OM_OK)
        fail_msg("%s", om_error_message());
    om_csr_done(&A), om_csr_done(&B);
    om_free(place), om_free(row), om_free(col), om_free(value), om_free(diagonal), om_free(shape);
}

#endif
