// test_solve_bsr.c: the pattern against a dense table, addresses, and the product.
#include "solve/solve_problem.h"

static void pattern_is_that_of_the_elements(void** state) {
    (void)state;
    OmTetMesh mesh;
    OmBsr A;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(1, 1, 1), 4, 3, 2, &mesh));
    assert_ok(om_bsr_create(mesh.nvert, mesh.ntet, 4, mesh.tet_vert, &A));
    int n = mesh.nvert, count = 0;
    unsigned char* is_pair = om_calloc((size_t)(n * n), 1);
    for (int e = 0; e < mesh.ntet; ++e)
        for (int a = 0; a < 4; ++a)
            for (int b = 0; b < 4; ++b)
                is_pair[mesh.tet_vert[4 * e + a] * n + mesh.tet_vert[4 * e + b]] = 1;
    for (int i = 0; i < n; ++i) {
        assert_int_equal(A.col[A.row_adr[i]], i);
        for (int k = A.row_adr[i] + 2; k < A.row_adr[i + 1]; ++k)
            assert_true(A.col[k - 1] < A.col[k]);
        for (int j = 0; j < n; ++j) {
            int k = om_bsr_find(&A, i, j);
            assert_int_equal(k >= 0, is_pair[i * n + j]);
            if (k >= 0) assert_int_equal(A.col[k], j);
            count += is_pair[i * n + j];
        }
    }
    assert_int_equal(A.nblock, count);
    assert_int_equal(A.nblock, n + 2 * A.nedge);
    for (int e = 0; e < A.nedge; ++e) {
        int i = A.edge_vert[2 * e], j = A.edge_vert[2 * e + 1];
        assert_true(i < j);
        assert_int_equal(A.edge_adr[2 * e], om_bsr_find(&A, i, j));
        assert_int_equal(A.edge_adr[2 * e + 1], om_bsr_find(&A, j, i));
    }
    int* adr = om_alloc(16 * (size_t)mesh.ntet, sizeof(int));
    assert_ok(om_bsr_find_elements(&A, mesh.ntet, 4, mesh.tet_vert, adr));
    assert_int_equal(adr[16 * 5 + 4 * 1 + 3],
                     om_bsr_find(&A, mesh.tet_vert[4 * 5 + 1], mesh.tet_vert[4 * 5 + 3]));
    const int far[2] = {0, n - 1};
    assert_status(om_bsr_find_elements(&A, 1, 2, far, adr), OM_INVALID);
    om_free(adr);
    om_free(is_pair);
    om_bsr_destroy(&A);
    om_tet_mesh_done(&mesh);
}

static void product_matches_dense(void** state) {
    (void)state;
    Elastic el = elastic_tissue();
    Problem p;
    problem_init(&p, beam_size(), 4, 2, 3, &el, 1);
    double* D = dense_matrix(&p.A);
    double* y = om_alloc(p.n, sizeof(double));
    double* ref = om_calloc(p.n, sizeof(double));
    for (size_t r = 0; r < p.n; ++r)
        for (size_t c = 0; c < p.n; ++c) {
            ref[r] += D[r * p.n + c] * p.b[c];
            assert_near_rel(D[r * p.n + c], D[c * p.n + r], 1e-6);  // float assembly
        }
    om_bsr_apply(&p.A, 2, p.b, y);
    assert_below(max_difference(y, ref, p.n), 1e-13 * test_tol_scale());
    om_free(D);
    om_free(y);
    om_free(ref);
    problem_done(&p);
}

static void bad_indices_are_named(void** state) {
    (void)state;
    OmBsr A;
    const int bad[4] = {0, 1, 2, 9};
    assert_status(om_bsr_create(4, 1, 4, bad, &A), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "vertex 9"));
    assert_status(om_bsr_create(0, 1, 4, bad, &A), OM_INVALID);
    assert_null(A.value);
    om_bsr_destroy(&A);
    om_bsr_destroy(NULL);
    // A vertex without elements keeps its diagonal block.
    const int edge[2] = {2, 0};
    assert_ok(om_bsr_create(4, 1, 2, edge, &A));
    assert_int_equal(A.nblock, 6);
    assert_int_equal(om_bsr_find(&A, 3, 3), A.row_adr[3]);
    assert_int_equal(om_bsr_find(&A, 1, 2), -1);
    om_bsr_destroy(&A);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(pattern_is_that_of_the_elements),
                                       cmocka_unit_test(product_matches_dense),
                                       cmocka_unit_test(bad_indices_are_named)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
