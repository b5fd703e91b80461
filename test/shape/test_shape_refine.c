// Uniform refinement and bisection: volume, counts, closed boundary, sets, shapes.
#include <limits.h>

#include "omentum/shape.h"
#include "test_common.h"

static void boxes_stay_boxes(void** state) {
    (void)state;
    OmTetMesh mesh;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(3, 2, 1), 3, 2, 1, &mesh));
    int bottom[12];
    for (int i = 0; i < 12; ++i) bottom[i] = i;
    assert_ok(om_tet_mesh_add_set(&mesh, "bottom", bottom, 12));
    int ntet = mesh.ntet;
    assert_ok(om_tet_mesh_refine(&mesh));
    assert_int_equal(mesh.ntet, 8 * ntet);
    assert_int_equal(mesh.nvert, 7 * 5 * 3);  // a Kuhn box refines into the box of half the step
    assert_ok(om_tet_mesh_validate(&mesh));
    assert_near(om_tet_mesh_volume(&mesh), 6.0, 1e-12);
    for (int t = 0; t < mesh.ntet; ++t) {
        const int* v = &mesh.tet_vert[4 * t];
        OmVec3 a = om_load3(mesh.x, v[0]);
        double v6 =
            om_dot(om_cross(om_sub(om_load3(mesh.x, v[1]), a), om_sub(om_load3(mesh.x, v[2]), a)),
                   om_sub(om_load3(mesh.x, v[3]), a));
        assert_near(v6, 1.0 / 8, 1e-14);
    }
    const OmMeshSet* set = om_tet_mesh_find_set(&mesh, "bottom");
    assert_int_equal(set->nvert, 7 * 5);
    for (int i = 0; i < set->nvert; ++i) assert_near(om_load3(mesh.x, set->vert[i]).z, 0, 0);
    OmSurface surface;
    assert_ok(om_tet_mesh_boundary(&mesh, &surface, NULL));
    assert_near(om_surface_volume(&surface), 6.0, 1e-12);
    om_surface_done(&surface);
    om_tet_mesh_done(&mesh);
}

static int failing_after;
static void* fail_later(void* ctx, size_t size, size_t align) {
    (void)ctx;
    return failing_after-- > 0 ? aligned_alloc(align, (size + align - 1) / align * align) : NULL;
}
static void release(void* ctx, void* ptr) {
    (void)ctx;
    free(ptr);
}

// Every face inside belongs to two tetrahedra: a vertex that hangs on an edge would leave faces of one.
static double boundary_area(const OmTetMesh* mesh) {
    OmSurface s;
    double area = 0;
    assert_ok(om_tet_mesh_boundary(mesh, &s, NULL));
    for (int t = 0; t < s.ntri; ++t) {
        const int* v = &s.tri_vert[3 * t];
        OmVec3 a = om_load3(s.x, v[0]);
        area +=
            0.5 * om_norm(om_cross(om_sub(om_load3(s.x, v[1]), a), om_sub(om_load3(s.x, v[2]), a)));
    }
    om_surface_done(&s);
    return area;
}

static double edge_longest(const OmTetMesh* mesh) {
    double longest = 0;
    for (int t = 0; t < mesh->ntet; ++t)
        for (int a = 0; a < 4; ++a)
            for (int b = 0; b < a; ++b)
                longest = fmax(longest, om_distance(om_load3(mesh->x, mesh->tet_vert[4 * t + a]),
                                                    om_load3(mesh->x, mesh->tet_vert[4 * t + b])));
    return longest;
}

static void bisection_keeps_the_body(void** state) {
    (void)state;
    OmTetMesh mesh, box;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(3, 2, 1), 3, 2, 1, &mesh));
    int bottom[12];
    for (int i = 0; i < 12; ++i) bottom[i] = i;
    assert_ok(om_tet_mesh_add_set(&mesh, "bottom", bottom, 12));
    for (int t = 0; t < mesh.ntet; ++t)
        mesh.tet_label[t] = om_load3(mesh.x, mesh.tet_vert[4 * t]).x < 0.5;
    assert_ok(om_tet_mesh_copy(&mesh, &box));
    double labelled[2] = {0, 0};
    for (int target = 30; target < 4000; target = target * 2 - 3) {
        assert_ok(om_tet_mesh_bisect(&mesh, target));
        assert_int_equal(mesh.nvert, target);  // a round halves no more edges than it needs
        assert_ok(om_tet_mesh_validate(&mesh));
        assert_near(om_tet_mesh_volume(&mesh), 6.0, 1e-12);
        assert_near(boundary_area(&mesh), 22.0, 1e-11);
        assert_memory_equal(mesh.x, box.x, 3 * (size_t)box.nvert * sizeof(double));
        labelled[0] = labelled[1] = 0;
        double smallest = 1;
        for (int t = 0; t < mesh.ntet; ++t) {
            const int* v = &mesh.tet_vert[4 * t];
            OmVec3 a = om_load3(mesh.x, v[0]), e[3];
            for (int k = 0; k < 3; ++k) e[k] = om_sub(om_load3(mesh.x, v[k + 1]), a);
            double v6 = om_dot(om_cross(e[0], e[1]), e[2]);
            labelled[mesh.tet_label[t]] += v6 / 6;
            double edge = 0;
            for (int k = 0; k < 3; ++k)
                edge = fmax(edge, fmax(om_norm(e[k]), om_distance(e[k], e[(k + 1) % 3])));
            smallest = fmin(smallest, v6 / (edge * edge * edge));
        }
        // a Kuhn tetrahedron has 1 / 3^1.5 = 0.19, and bisection goes through three shapes
        assert_true(smallest > 0.125);
        // of as many equal pieces as there are tetrahedra, none has an edge twice as long as the mean one
        assert_below(edge_longest(&mesh), 2.7 * cbrt(6.0 / mesh.ntet * 6));
    }
    double label[2] = {0, 0};
    for (int t = 0; t < box.ntet; ++t) label[box.tet_label[t]] += 1.0 / 6;
    for (int k = 0; k < 2; ++k) assert_near(labelled[k], label[k], 1e-12);
    const OmMeshSet* set = om_tet_mesh_find_set(&mesh, "bottom");
    int on_bottom = 0;
    for (int i = 0; i < mesh.nvert; ++i) on_bottom += om_load3(mesh.x, i).z == 0;
    assert_int_equal(set->nvert, on_bottom);
    for (int i = 0; i < set->nvert; ++i) assert_near(om_load3(mesh.x, set->vert[i]).z, 0, 0);
    int nvert = mesh.nvert;
    assert_ok(om_tet_mesh_bisect(&mesh, nvert - 5));  // it has as many
    assert_int_equal(mesh.nvert, nvert);
    assert_status(om_tet_mesh_bisect(&mesh, INT_MAX), OM_INVALID);
    om_tet_mesh_done(&mesh);
    om_tet_mesh_done(&box);
}

static OmStatus refine(OmTetMesh* mesh, int k) {
    return k ? om_tet_mesh_bisect(mesh, 19) : om_tet_mesh_refine(mesh);
}

static void check_refused_memory(int k, int ntet) {
    OmTetMesh mesh;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(1, 1, 1), 1, 1, 1, &mesh));
    int64_t alive = om_alloc_alive();
    OmAllocator failing = {fail_later, release, NULL};
    int tries = 0;
    OmStatus status;
    do {
        failing_after = tries++;
        om_allocator_set(&failing);
        status = refine(&mesh, k);
        om_allocator_set(NULL);
        if (status != OM_OK) {
            assert_int_equal(status, OM_NO_MEMORY);
            assert_int_equal(om_alloc_alive(), alive);
            assert_int_equal(mesh.ntet, 6);
        }
    } while (status != OM_OK);
    assert_true(tries > 3);
    assert_int_equal(mesh.ntet, ntet);
    om_tet_mesh_done(&mesh);
}

static void refused_memory_leaves_the_mesh(void** state) {
    (void)state;
    check_refused_memory(0, 48);
    check_refused_memory(1, 32);  // the diagonal, six of faces, four edges: 6 + 6 + 12 + 8
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(boxes_stay_boxes),
        cmocka_unit_test(bisection_keeps_the_body),
        cmocka_unit_test(refused_memory_leaves_the_mesh),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
