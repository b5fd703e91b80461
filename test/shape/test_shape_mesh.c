// Boxes, boundaries, sets and checks of tetrahedral meshes against exact counts and volumes.
#include "test_alloc.h"

#include "omentum/shape.h"
#include "omentum/shape_meshing.h"

static void test_box_fills_its_volume(void** unused) {
    (void)unused;
    OmTetMesh m;
    assert_ok(om_tet_mesh_box(om_vec3(-1, 0, 2), om_vec3(1, 3, 2.5), 4, 5, 3, &m));
    assert_int_equal(m.nvert, 5 * 6 * 4);
    assert_int_equal(m.ntet, 6 * 60);
    assert_ok(om_tet_mesh_validate(&m));
    assert_near_rel(om_tet_mesh_volume(&m), 3.0, 1e-13);  // sums of 360 terms
    OmVec3 last = om_load3(m.x, 4 + 5 * (5 + 6 * 3));
    assert_near(om_distance(last, om_vec3(1, 3, 2.5)), 0, 0);
    om_tet_mesh_done(&m);
}

// Two triangles a cell face, closed, outward: the same volume, and chi = 2.
static void test_boundary_of_box_is_a_closed_sphere(void** unused) {
    (void)unused;
    OmTetMesh m;
    OmSurface s;
    int* vert = NULL;
    OmMeshQuality quality;
    for (int n = 1; n <= 8; n *= 2) {  // layers through the thinnest side
        assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(1, 2, 3), n, 9, 9, &m));
        assert_ok(om_tet_mesh_quality(&m, &quality));
        assert_int_equal(quality.nlayer, n);
        om_tet_mesh_done(&m);
    }
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(1, 2, 3), 2, 3, 4, &m));
    assert_ok(om_tet_mesh_boundary(&m, &s, &vert));
    int nface = 2 * 2 * (2 * 3 + 3 * 4 + 2 * 4);
    assert_int_equal(s.ntri, nface);
    assert_int_equal(s.nvert - s.ntri * 3 / 2 + s.ntri, 2);
    assert_near_rel(om_surface_volume(&s), 6.0, 1e-13);
    for (int v = 0; v < s.nvert; v++) {
        assert_near(om_distance(om_load3(s.x, v), om_load3(m.x, vert[v])), 0, 0);
    }
    om_free(vert);
    om_surface_done(&s);
    om_tet_mesh_done(&m);
}

// Two corners of a cube that share a face: nine edges, four of length L and five of sqrt(2) L; right angles at the
// corner's edges, acos(1 / sqrt(3)) at the others.
static void test_quality_by_hand(void** unused) {
    (void)unused;
    const double L = 0.01;
    const double x[15] = {0, 0, 0, L, 0, 0, 0, L, 0, 0, 0, L, -L, 0, 0};
    const int tet[8] = {0, 1, 2, 3, 0, 2, 4, 3};
    OmTetMesh m;
    OmMeshQuality q;
    assert_ok(om_tet_mesh_init(&m, 5, 2));
    memcpy(m.x, x, sizeof x);
    memcpy(m.tet_vert, tet, sizeof tet);
    assert_ok(om_tet_mesh_quality(&m, &q));
    assert_int_equal(q.npart, 1);
    assert_int_equal(q.nboundary_tri, 6);
    assert_near_rel(q.volume, L * L * L / 3, 1e-12);
    assert_near_rel(q.edge_min, L, 1e-12);
    assert_near_rel(q.edge_max, sqrt(2) * L, 1e-12);
    assert_near_rel(q.edge_mean, (4 + 5 * sqrt(2)) / 9 * L, 1e-12);
    assert_near(q.dihedral_min, acos(1 / sqrt(3)), 1e-12);
    assert_near(q.dihedral_max, OM_PI / 2, 1e-12);
    om_tet_mesh_done(&m);
}

// A part of 6 elements beside one of 48, a ninth of all: kept from a share of 0.1 on, dropped at 0.12.
static void test_parts_by_their_share(void** unused) {
    (void)unused;
    for (int k = 0; k < 2; k++) {
        OmTetMesh large, small, m;
        int nkept, nfound;
        assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(1, 1, 1), 2, 2, 2, &large));
        assert_ok(om_tet_mesh_box(om_vec3(5, 5, 5), om_vec3(6, 6, 6), 1, 1, 1, &small));
        assert_int_equal(large.ntet, 8 * small.ntet);
        assert_ok(om_tet_mesh_init(&m, large.nvert + small.nvert, large.ntet + small.ntet));
        memcpy(m.x, large.x, 3 * (size_t)large.nvert * sizeof *m.x);
        memcpy(m.x + 3 * large.nvert, small.x, 3 * (size_t)small.nvert * sizeof *m.x);
        memcpy(m.tet_vert, large.tet_vert, 4 * (size_t)large.ntet * sizeof *m.tet_vert);
        for (int i = 0; i < 4 * small.ntet; i++)
            m.tet_vert[4 * large.ntet + i] = large.nvert + small.tet_vert[i];
        assert_ok(om_tet_mesh_keep_parts(&m, k ? 0.12 : 0.1, &nkept, &nfound));
        assert_int_equal(nfound, 2);
        assert_int_equal(nkept, k ? 1 : 2);
        assert_int_equal(m.ntet, large.ntet + (k ? 0 : small.ntet));
        assert_near_rel(om_tet_mesh_volume(&m), k ? 1 : 2, 1e-12);
        om_tet_mesh_done(&large);
        om_tet_mesh_done(&small);
        om_tet_mesh_done(&m);
    }
}

static void test_sets_are_sorted_and_replaced(void** unused) {
    (void)unused;
    OmTetMesh m, copy;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(1, 1, 1), 1, 1, 1, &m));
    const int vert[] = {7, 3, 3, 0};
    assert_ok(om_tet_mesh_add_set(&m, "attachment", vert, 4));
    const OmMeshSet* set = om_tet_mesh_find_set(&m, "attachment");
    assert_int_equal(set->nvert, 3);
    assert_int_equal(set->vert[0], 0);
    assert_int_equal(set->vert[2], 7);
    assert_ok(om_tet_mesh_add_set(&m, "attachment", vert, 1));
    assert_int_equal(om_tet_mesh_find_set(&m, "attachment")->nvert, 1);
    assert_int_equal(m.nset, 1);
    assert_ok(om_tet_mesh_copy(&m, &copy));
    assert_int_equal(om_tet_mesh_find_set(&copy, "attachment")->vert[0], 7);
    assert_null(om_tet_mesh_find_set(&m, "roi"));
    const int wrong[] = {8};
    assert_status(om_tet_mesh_add_set(&m, "x", wrong, 1), OM_INVALID);
    assert_status(om_tet_mesh_add_set(&m, "", vert, 1), OM_INVALID);
    om_tet_mesh_done(&copy);
    om_tet_mesh_done(&m);
}

// Two bodies of one mesh: the first one's vertices and tetrahedra come first, sets of one name are joined.
static void test_join(void** unused) {
    (void)unused;
    OmTetMesh a, b, m;
    const int one[] = {0, 3}, two[] = {1}, three[] = {2};
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(1, 1, 1), 1, 1, 1, &a));
    assert_ok(om_tet_mesh_box(om_vec3(2, 0, 0), om_vec3(4, 1, 1), 2, 1, 1, &b));
    for (int t = 0; t < b.ntet; ++t) b.tet_label[t] = 5;
    assert_ok(om_tet_mesh_add_set(&a, "attachment", one, 2));
    assert_ok(om_tet_mesh_add_set(&b, "attachment", two, 1));
    assert_ok(om_tet_mesh_add_set(&b, "roi", three, 1));
    assert_ok(om_tet_mesh_join(&a, &b, &m));
    assert_ok(om_tet_mesh_validate(&m));
    assert_int_equal(m.nvert, a.nvert + b.nvert);
    assert_near(om_tet_mesh_volume(&m), 1 + 2, 1e-12);
    assert_int_equal(m.tet_label[a.ntet - 1], 0);
    assert_int_equal(m.tet_label[a.ntet], 5);
    const OmMeshSet* set = om_tet_mesh_find_set(&m, "attachment");
    assert_int_equal(m.nset, 2);
    assert_int_equal(set->nvert, 3);
    assert_int_equal(set->vert[1], 3);
    assert_int_equal(set->vert[2], 1 + a.nvert);
    assert_int_equal(om_tet_mesh_find_set(&m, "roi")->vert[0], 2 + a.nvert);
    om_tet_mesh_done(&a);
    om_tet_mesh_done(&b);
    om_tet_mesh_done(&m);
}

static void test_validate_names_the_offender(void** unused) {
    (void)unused;
    OmTetMesh m;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(1, 1, 1), 1, 1, 1, &m));
    int keep = m.tet_vert[4 * 3];
    m.tet_vert[4 * 3] = m.tet_vert[4 * 3 + 1];
    assert_status(om_tet_mesh_validate(&m), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "element 3 is flat"));
    m.tet_vert[4 * 3] = 99;
    assert_status(om_tet_mesh_validate(&m), OM_INVALID);
    m.tet_vert[4 * 3] = keep;
    m.x[5] = NAN;
    assert_status(om_tet_mesh_validate(&m), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "vertex 1"));
    om_tet_mesh_done(&m);
}

// ---- every allocation failing in turn ------------------------------------------------------------------

static OmStatus build_everything(void) {
    OmTetMesh m = {0}, copy = {0};
    OmSurface s = {0};
    int* vert = NULL;
    const int pick[] = {1, 2};
    OmStatus status = OM_OK;
    OM_TRY_DONE(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(1, 1, 1), 2, 2, 2, &m));
    OM_TRY_DONE(om_tet_mesh_add_set(&m, "a", pick, 2));
    OM_TRY_DONE(om_tet_mesh_add_set(&m, "b", pick, 2));
    OM_TRY_DONE(om_tet_mesh_copy(&m, &copy));
    om_tet_mesh_done(&copy);
    OM_TRY_DONE(om_tet_mesh_join(&m, &m, &copy));
    OM_TRY_DONE(om_tet_mesh_boundary(&m, &s, &vert));
done:
    om_free(vert);
    om_surface_done(&s);
    om_tet_mesh_done(&copy);
    om_tet_mesh_done(&m);
    return status;
}

static void test_failing_allocations_leak_nothing(void** unused) {
    (void)unused;
    int64_t alive = om_alloc_alive();
    const OmAllocator failing = {test_alloc_get, test_alloc_free, NULL};
    om_allocator_set(&failing);
    int nfail = 0;
    for (;; nfail++) {
        test_alloc_countdown = nfail;
        OmStatus status = build_everything();
        if (status == OM_OK) break;
        assert_int_equal(status, OM_NO_MEMORY);
        assert_int_equal(om_alloc_alive(), alive);
    }
    om_allocator_set(NULL);
    assert_true(nfail > 15);
}

// Cells of a box in every position of its thin side: eight nodes counter-clockwise, the third axis through it.
static void test_cells(void** unused) {
    (void)unused;
    static const int num[3][3] = {{1, 4, 3}, {3, 1, 4}, {4, 3, 1}};
    for (int axis = 0; axis < 3; ++axis) {
        OmTetMesh mesh;
        int* node;
        const int* n = num[axis];
        assert_ok(
            om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(n[0], n[1], n[2]), n[0], n[1], n[2], &mesh));
        assert_ok(om_tet_mesh_find_cells(&mesh, &node));
        for (int c = 0; c < mesh.ntet / 6; ++c) {
            OmVec3 x[8];
            for (int a = 0; a < 8; ++a) x[a] = om_load3(mesh.x, node[8 * c + a]);
            OmVec3 u = om_sub(x[1], x[0]), v = om_sub(x[3], x[0]), w = om_sub(x[4], x[0]);
            assert_near(om_dot(om_cross(u, v), w), 1, 1e-12);
            const double through[3] = {w.x, w.y, w.z};
            assert_near(through[axis], 1, 1e-12);
            // a parallelepiped: every node is where the three sides put it, and in the tetrahedra of the cell
            static const int sides[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                            {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
            for (int a = 0; a < 8; ++a) {
                OmVec3 p =
                    om_madd(om_madd(om_madd(x[0], sides[a][0], u), sides[a][1], v), sides[a][2], w);
                int found = 0;
                assert_near(om_distance(p, x[a]), 0, 1e-12);
                for (int k = 0; k < 24; ++k) found += mesh.tet_vert[24 * c + k] == node[8 * c + a];
                assert_true(found > 0);
            }
        }
        om_free(node);
        mesh.tet_vert[24 + 3] = mesh.tet_vert[3];  // a vertex of another cell
        assert_int_equal(om_tet_mesh_find_cells(&mesh, &node), OM_INVALID);
        assert_non_null(strstr(om_error_message(), "tetrahedra 6 to 11"));
        assert_null(node);
        mesh.ntet -= 1;
        assert_int_equal(om_tet_mesh_find_cells(&mesh, &node), OM_INVALID);
        mesh.ntet += 1;
        om_tet_mesh_done(&mesh);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_box_fills_its_volume),
        cmocka_unit_test(test_boundary_of_box_is_a_closed_sphere),
        cmocka_unit_test(test_quality_by_hand),
        cmocka_unit_test(test_parts_by_their_share),
        cmocka_unit_test(test_sets_are_sorted_and_replaced),
        cmocka_unit_test(test_join),
        cmocka_unit_test(test_validate_names_the_offender),
        cmocka_unit_test(test_cells),
        cmocka_unit_test(test_failing_allocations_leak_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
