// What keeps a surface from bounding a volume: holes, fins and triangles the wrong way round.
#include "shape_file_common.h"

static void make_surface(OmSurface* surface) {
    OmTetMesh mesh;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(1, 1, 1), 2, 2, 2, &mesh));
    assert_ok(om_tet_mesh_boundary(&mesh, surface, NULL));
    om_tet_mesh_done(&mesh);
}

static void test_a_box_is_closed(void** unused) {
    (void)unused;
    OmSurface s;
    OmSurfaceCheck c;
    make_surface(&s);
    assert_ok(om_surface_check(&s, &c));
    assert_int_equal(c.nopen_edge + c.nmanifold_edge + c.nflipped_edge, 0);
    assert_int_equal(c.ncomponent, 1);
    assert_int_equal(c.neuler, 2);
    assert_int_equal(c.first_tri, -1);
    assert_ok(om_surface_require_closed(&s));
    om_surface_done(&s);
}

static void test_a_hole_has_three_open_edges(void** unused) {
    (void)unused;
    OmSurface s;
    OmSurfaceCheck c;
    make_surface(&s);
    int a = s.tri_vert[3 * s.ntri - 3], b = s.tri_vert[3 * s.ntri - 2];
    s.ntri--;
    assert_ok(om_surface_check(&s, &c));
    assert_int_equal(c.nopen_edge, 3);
    assert_int_equal(c.nmanifold_edge + c.nflipped_edge, 0);
    assert_int_equal(c.neuler, 1);
    assert_true(c.first_edge[0] >= 0 && c.first_edge[0] < c.first_edge[1]);
    assert_true(a >= 0 && b >= 0 && c.first_tri >= 0 && c.first_tri < s.ntri);
    assert_status(om_surface_require_closed(&s), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "open edges 3,"));
    om_surface_done(&s);
}

static void test_a_flipped_triangle_has_three_edges(void** unused) {
    (void)unused;
    OmSurface s;
    OmSurfaceCheck c;
    make_surface(&s);
    int t = s.tri_vert[3 * 7];
    s.tri_vert[3 * 7] = s.tri_vert[3 * 7 + 1];
    s.tri_vert[3 * 7 + 1] = t;
    assert_ok(om_surface_check(&s, &c));
    assert_int_equal(c.nflipped_edge, 3);
    assert_int_equal(c.nopen_edge + c.nmanifold_edge, 0);
    assert_status(om_surface_require_closed(&s), OM_INVALID);
    om_surface_done(&s);
}

// A third triangle on an edge: one edge of three, two open ones.
static void test_a_fin_is_not_manifold(void** unused) {
    (void)unused;
    OmSurface s, fin;
    OmSurfaceCheck c;
    make_surface(&s);
    assert_ok(om_surface_init(&fin, s.nvert + 1, s.ntri + 1));
    memcpy(fin.x, s.x, 3 * (size_t)s.nvert * sizeof *s.x);
    om_store3(fin.x, s.nvert, om_vec3(3, 3, 3));
    memcpy(fin.tri_vert, s.tri_vert, 3 * (size_t)s.ntri * sizeof *s.tri_vert);
    int* last = fin.tri_vert + 3 * s.ntri;
    last[0] = s.tri_vert[0];
    last[1] = s.tri_vert[1];
    last[2] = s.nvert;
    assert_ok(om_surface_check(&fin, &c));
    assert_int_equal(c.nmanifold_edge, 1);
    assert_int_equal(c.nopen_edge, 2);
    last[2] = fin.nvert;
    assert_status(om_surface_check(&fin, &c), OM_INVALID);
    om_surface_done(&s);
    om_surface_done(&fin);
}

static void test_pieces_are_counted(void** unused) {
    (void)unused;
    OmSurface s, two;
    OmSurfaceCheck c;
    make_surface(&s);
    assert_ok(om_surface_init(&two, 2 * s.nvert + 1, 2 * s.ntri));  // and a vertex of no triangle
    for (int i = 0; i < 2 * s.nvert; i++)
        om_store3(two.x, i, om_add(om_load3(s.x, i % s.nvert), om_vec3(i / s.nvert * 5, 0, 0)));
    om_store3(two.x, 2 * s.nvert, om_vec3(0, 0, 0));
    for (int i = 0; i < 6 * s.ntri; i++)
        two.tri_vert[i] = s.tri_vert[i % (3 * s.ntri)] + (i >= 3 * s.ntri ? s.nvert : 0);
    assert_ok(om_surface_check(&two, &c));
    assert_int_equal(c.ncomponent, 2);
    assert_int_equal(c.neuler, 4);
    assert_ok(om_surface_require_closed(&two));
    om_surface_done(&s);
    om_surface_done(&two);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_a_box_is_closed),
        cmocka_unit_test(test_a_hole_has_three_open_edges),
        cmocka_unit_test(test_a_flipped_triangle_has_three_edges),
        cmocka_unit_test(test_a_fin_is_not_manifold),
        cmocka_unit_test(test_pieces_are_counted),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
