// Uniform refinement: volume, counts, closed boundary, sets.
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

static void refused_memory_leaves_the_mesh(void** state) {
    (void)state;
    OmTetMesh mesh;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(1, 1, 1), 1, 1, 1, &mesh));
    int64_t alive = om_alloc_alive();
    OmAllocator failing = {fail_later, release, NULL};
    int tries = 0;
    OmStatus status;
    do {
        failing_after = tries++;
        om_allocator_set(&failing);
        status = om_tet_mesh_refine(&mesh);
        om_allocator_set(NULL);
        if (status != OM_OK) {
            assert_int_equal(status, OM_NO_MEMORY);
            assert_int_equal(om_alloc_alive(), alive);
            assert_int_equal(mesh.ntet, 6);
        }
    } while (status != OM_OK);
    assert_true(tries > 3);
    assert_int_equal(mesh.ntet, 48);
    om_tet_mesh_done(&mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(boxes_stay_boxes),
        cmocka_unit_test(refused_memory_leaves_the_mesh),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
