// test_fem_calculix.c: every node of CalculiX's solutions, on the same meshes with the same laws.
#include "test_calculix.h"
#include "test_solid.h"

static void compare(const CalculixCase* c, OmMaterial material) {
    TestSolid t = {.material = material};
    OmTetMesh tet;
    calculix_load_mesh(c, &tet);
    double* u = calculix_load_field(c, tet.nvert);
    assert_ok(om_fem_mesh_from_tet(&tet, OM_TET4, &t.mesh));
    for (int e = 0; e < t.mesh.nelem; ++e) t.mesh.elem_material[e] = 0;
    solid_start(&t);
    for (int i = 0; i < t.mesh.nnode; ++i) {
        Role role = c->role(om_load3(t.mesh.x, i));
        for (int k = 0; k < 3; ++k) t.fixed[3 * i + k] = role != FREE;
        if (role == MOVED) om_store3(t.goal, i, c->travel);
    }
    solid_solve(&t, 10, 1e-10);
    double worst = 0, largest = 0;
    OmVec3 f = {0, 0, 0}, all = {0, 0, 0};
    for (int i = 0; i < t.mesh.nnode; ++i) {
        worst = fmax(worst, om_distance(solid_displacement(&t, i), om_load3(u, i)));
        largest = fmax(largest, om_norm(om_load3(u, i)));
        all = om_add(all, om_load3(t.reaction, i));
        if (c->role(om_load3(t.mesh.x, i)) == MOVED) f = om_add(f, om_load3(t.reaction, i));
    }
    double force = om_distance(f, c->reaction) / om_norm(c->reaction);
    printf(
        "%s: nodes within %.2g of the largest displacement, reaction (%.7g, %.7g, %.7g) N within "
        "%.2g; %d Newton iterations, %d cuts\n",
        c->field, worst / largest, f.x, f.y, f.z, force, t.report.nnewton, t.report.ncut);
    assert_below(worst / largest, 1e-5);
    assert_below(force, 1e-4);
    assert_below(om_norm(all), 1e-8 * om_norm(f));  // held and moved balance
    om_free(u);
    om_tet_mesh_done(&tet);
    solid_done(&t);
}

static void test_block(void** context) {
    (void)context;
    compare(&calculix_block,
            (OmMaterial){.young = 3000, .poisson = 0.45, .law = OM_ST_VENANT_KIRCHHOFF});
}
static void test_slab(void** context) {
    (void)context;
    compare(&calculix_slab, (OmMaterial){.young = 3000, .poisson = 0.45, .law = OM_MOONEY_RIVLIN});
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_block), cmocka_unit_test(test_slab)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
