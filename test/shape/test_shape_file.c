// Files of meshes and surfaces: what is written is read back, number for number.
#include "test_common.h"

#include <unistd.h>

#include "omentum/shape_file.h"

// A path of this process's own in the temporary folder.
static const char* temp_path(const char* name) {
    static char path[2][256];
    static int turn;
    turn = !turn;
    snprintf(path[turn], sizeof path[turn], "/tmp/omentum-%ld-%s", (long)getpid(), name);
    return path[turn];
}

// A box of odd numbers, with labels and sets whose names try the escapes of XML.
static void make_mesh(OmTetMesh* mesh) {
    assert_ok(
        om_tet_mesh_box(om_vec3(-1.0 / 3, 0.1, 1e-7), om_vec3(2.0 / 7, 1.0, 3), 3, 4, 5, mesh));
    OmRng rng = om_rng_init(3, 0);
    for (int i = 0; i < 3 * mesh->nvert; i++) mesh->x[i] += om_rng_range(&rng, -0.01, 0.01);
    for (int e = 0; e < mesh->ntet; e++) mesh->tet_label[e] = e % 5 - 1;
    const int few[] = {3, 77, 12};
    assert_ok(om_tet_mesh_add_set(mesh, "attachment", few, 3));
    const int one[] = {mesh->nvert - 1};
    assert_ok(om_tet_mesh_add_set(mesh, "a<b>&\"c\"", one, 1));
}

static void assert_same_sets(const OmTetMesh* a, const OmTetMesh* b) {
    assert_int_equal(a->nset, b->nset);
    for (int s = 0; s < a->nset; s++) {
        const OmMeshSet* other = om_tet_mesh_find_set(b, a->set[s].name);
        assert_non_null(other);
        assert_int_equal(other->nvert, a->set[s].nvert);
        assert_memory_equal(other->vert, a->set[s].vert, (size_t)other->nvert * sizeof(int));
    }
}

static void assert_same_mesh(const OmTetMesh* a, const OmTetMesh* b) {
    assert_int_equal(a->nvert, b->nvert);
    assert_int_equal(a->ntet, b->ntet);
    assert_memory_equal(a->x, b->x, 3 * (size_t)a->nvert * sizeof(double));
    assert_memory_equal(a->tet_vert, b->tet_vert, 4 * (size_t)a->ntet * sizeof(int));
    assert_memory_equal(a->tet_label, b->tet_label, (size_t)a->ntet * sizeof(int));
    assert_same_sets(a, b);
}

static void test_meshes_round_trip(void** unused) {
    (void)unused;
    static const struct {
        const char* name;
        OmMeshFormat format;
    } table[] = {{"a.vtu", OM_MESH_VTU},   {"b.vtu", OM_MESH_VTU_ASCII},
                 {"a.vtk", OM_MESH_VTK},   {"b.vtk", OM_MESH_VTK_ASCII},
                 {"a.msh", OM_MESH_MSH41}, {"b.msh", OM_MESH_MSH22}};
    OmTetMesh mesh, back;
    make_mesh(&mesh);
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
        const char* path = temp_path(table[i].name);
        assert_ok(om_tet_mesh_save_format(&mesh, path, OM_UNIT_M, table[i].format, NULL, 0));
        assert_ok(om_tet_mesh_load(path, OM_UNIT_M, &back));
        assert_same_mesh(&mesh, &back);
        om_tet_mesh_done(&back);
        remove(path);
    }
    om_tet_mesh_done(&mesh);
}

static void test_units_scale_positions(void** unused) {
    (void)unused;
    OmTetMesh mesh, mm, m;
    make_mesh(&mesh);
    const char* path = temp_path("unit.vtu");
    assert_ok(om_tet_mesh_save(&mesh, path, OM_UNIT_MM));
    assert_ok(om_tet_mesh_load(path, OM_UNIT_MM, &mm));
    assert_ok(om_tet_mesh_load(path, OM_UNIT_M, &m));
    for (int i = 0; i < 3 * mesh.nvert; i++) {
        assert_near_rel(mm.x[i], mesh.x[i], 4e-16);  // two roundings
        assert_near_rel(m.x[i], 1000 * mesh.x[i], 4e-16);
    }
    remove(path);
    om_tet_mesh_done(&mesh);
    om_tet_mesh_done(&mm);
    om_tet_mesh_done(&m);
}

// Surfaces keep their triangles and positions; an STL has floats and an order of its own.
static void test_surfaces_round_trip(void** unused) {
    (void)unused;
    static const char* const name[] = {"s.obj", "s.ply", "s.off", "s.vtk", "s.stl"};
    OmTetMesh mesh;
    OmSurface surface, back;
    make_mesh(&mesh);
    assert_ok(om_tet_mesh_boundary(&mesh, &surface, NULL));
    double volume = om_surface_volume(&surface);
    for (size_t i = 0; i < sizeof name / sizeof name[0]; i++) {
        const char* path = temp_path(name[i]);
        assert_ok(om_surface_save(&surface, path, OM_UNIT_M));
        assert_ok(om_surface_load(path, OM_UNIT_M, &back));
        assert_int_equal(back.nvert, surface.nvert);
        assert_int_equal(back.ntri, surface.ntri);
        assert_ok(om_surface_require_closed(&back));
        if (i < 4) {
            assert_memory_equal(back.x, surface.x, 3 * (size_t)back.nvert * sizeof(double));
            assert_memory_equal(back.tri_vert, surface.tri_vert,
                                3 * (size_t)back.ntri * sizeof(int));
        }
        assert_near_rel(om_surface_volume(&back), volume, 1e-6);  // floats
        om_surface_done(&back);
        remove(path);
    }
    om_surface_done(&surface);
    om_tet_mesh_done(&mesh);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_meshes_round_trip),
        cmocka_unit_test(test_units_scale_positions),
        cmocka_unit_test(test_surfaces_round_trip),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
