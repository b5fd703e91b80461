// test_fem_octet.c: hexahedra eight at a time against one at a time.
#include "fem/fem_solid.h"
#include "test_common.h"

typedef struct Sums {
    double energy;
    double* f;
    OmBsr A;
} Sums;

static Sums eval(OmFemSolid* solid, const double* x) {
    Sums s;
    s.f = om_alloc(3 * (size_t)solid->mesh.nnode, sizeof *s.f);
    assert_ok(om_fem_matrix_create(solid, &s.A));
    assert_ok(om_fem_eval_force(solid, x, s.f, &s.energy));
    assert_ok(om_fem_eval_tangent(solid, x, &s.A));
    return s;
}

static void sums_done(Sums* s) {
    om_free(s->f);
    om_bsr_destroy(&s->A);
}

static void assert_close(const double* a, const double* b, size_t n, double tol) {
    double max = 0;
    for (size_t i = 0; i < n; ++i) max = fmax(max, fabs(b[i]));
    for (size_t i = 0; i < n; ++i)
        assert_near(a[i], b[i], tol * max + 1e-15);  // at rest all is rounding
}

// A skewed block of 3 x 3 x 3 elements (colours of 8, 4, 2 and 1), two materials, deformed at random.
static void check(OmLaw law, double size) {
    OmFemMesh mesh;
    assert_ok(
        om_fem_mesh_box(OM_HEX8, om_vec3(0, 0, 0), om_vec3(3, 3, 3), (int[]){3, 3, 3}, &mesh));
    OmRng rng = om_rng_init(1, (uint64_t)law);
    for (int i = 0; i < 3 * mesh.nnode; ++i) mesh.x[i] += om_rng_range(&rng, -0.1, 0.1);
    for (int e = 0; e < mesh.nelem; ++e) mesh.elem_material[e] = e % 2;
    OmMaterial material[2] = {{.young = 3, .poisson = 0.45, .law = law},
                              {.young = 1, .poisson = 0.3, .law = OM_NEO_HOOKEAN}};
    OmFemDef def = om_fem_default_def(&mesh, 2, material);
    OmFemSolid* solid;
    assert_ok(om_fem_create(&def, &solid));
    assert_true(solid->has_octets);
    size_t n = 3 * (size_t)mesh.nnode;
    double* x = om_alloc(n, sizeof *x);
    for (size_t i = 0; i < n; ++i) x[i] = mesh.x[i] + om_rng_range(&rng, -size, size);
    Sums eight = eval(solid, x);
    solid->has_octets = false;
    Sums one = eval(solid, x);
    // sums of some hundred terms that cancel
    assert_near(eight.energy, one.energy, 1e-12 * fabs(one.energy) + 1e-14);
    assert_close(eight.f, one.f, n, 1e-13);
    assert_close(eight.A.exact, one.A.exact, 9 * (size_t)one.A.nblock, 1e-13);
    // the same bits for any number of workers
    solid->has_octets = true;
    solid->nworker = 3;
    Sums three = eval(solid, x);
    assert_memory_equal(three.f, eight.f, n * sizeof *x);
    assert_memory_equal(three.A.exact, eight.A.exact, 9 * (size_t)one.A.nblock * sizeof(double));
    sums_done(&eight);
    sums_done(&one);
    sums_done(&three);
    om_free(x);
    om_fem_destroy(solid);
    om_fem_mesh_done(&mesh);
}

static void test_same(void** state) {
    (void)state;
    check(OM_NEO_HOOKEAN, 0.15);
    check(OM_STABLE_NEO_HOOKEAN, 0.15);
    check(OM_NEO_HOOKEAN, 0.6);  // some are inverted
    check(OM_NEO_HOOKEAN, 0);
}

static void test_others(void** state) {
    (void)state;
    const OmLaw law[] = {OM_ST_VENANT_KIRCHHOFF, OM_MOONEY_RIVLIN, OM_OGDEN, OM_COROTATIONAL};
    OmFemMesh mesh;
    assert_ok(
        om_fem_mesh_box(OM_HEX8, om_vec3(0, 0, 0), om_vec3(1, 1, 1), (int[]){1, 1, 1}, &mesh));
    for (int k = 0; k < 4; ++k) {
        OmMaterial material = {.young = 1, .poisson = 0.3, .law = law[k]};
        OmFemDef def = om_fem_default_def(&mesh, 1, &material);
        OmFemSolid* solid;
        assert_ok(om_fem_create(&def, &solid));
        assert_false(solid->has_octets);
        om_fem_destroy(solid);
    }
    om_fem_mesh_done(&mesh);
}

int main(void) {
    const struct CMUnitTest test[] = {cmocka_unit_test(test_same), cmocka_unit_test(test_others)};
    return cmocka_run_group_tests(test, NULL, NULL);
}
