// test_fem_solid.c: elements: derivatives, patch tests, rigid motion, masses, meshes, the same bytes.
#include "test_alloc.h"
#include "test_common.h"

#include "omentum/fem.h"

typedef struct Case {
    OmElement kind;
    OmLocking locking;
    OmMaterial material;
} Case;

static const Case cases[] = {
    {OM_TET4, OM_LOCKING_NONE, {.young = 3000, .poisson = 0.45, .law = OM_NEO_HOOKEAN}},
    {OM_TET4, OM_NODAL_VOLUME, {.young = 3000, .poisson = 0.45, .law = OM_NEO_HOOKEAN}},
    {OM_TET4, OM_NODAL_VOLUME, {.young = 3000, .poisson = 0.49, .law = OM_MOONEY_RIVLIN}},
    {OM_TET4, OM_SMOOTHED, {.young = 3000, .poisson = 0.49, .law = OM_MOONEY_RIVLIN}},
    {OM_TET4, OM_SMOOTHED, {.young = 3000, .poisson = 0.45, .law = OM_NEO_HOOKEAN}},
    {OM_TET10, OM_LOCKING_NONE, {.young = 3000, .poisson = 0.3, .law = OM_ST_VENANT_KIRCHHOFF}},
    {OM_TET10, OM_LOCKING_NONE, {.young = 3000, .poisson = 0.45, .law = OM_OGDEN}},
    {OM_HEX8, OM_LOCKING_NONE, {.young = 3000, .poisson = 0.45, .law = OM_COROTATIONAL}},
    {OM_HEX8, OM_LOCKING_NONE, {.young = 3000, .poisson = 0.4, .law = OM_LINEAR}},
    {OM_HEX8_MEAN, OM_LOCKING_NONE, {.young = 3000, .poisson = 0.49, .law = OM_MOONEY_RIVLIN}},
    {OM_HEX8_MEAN, OM_LOCKING_NONE, {.young = 3000, .poisson = 0.45, .law = OM_NEO_HOOKEAN}},
};
#define NCASE ((int)(sizeof cases / sizeof *cases))

static bool is_border(const double* x, int i, double size) {
    bool is = false;
    for (int k = 0; k < 3; ++k) is |= x[3 * i + k] < 1e-9 || x[3 * i + k] > size - 1e-9;
    return is;
}

// A cube whose inner nodes are shaken; mid-edge nodes of quadratic elements follow the corners.
static void shaken_cube(OmElement kind, int cells, double size, OmFemMesh* mesh) {
    OmRng rng = om_rng_init(7, 1);
    int num[3] = {cells, cells, cells};
    double shake = 0.15 * size / cells;
    if (kind == OM_TET4 || kind == OM_TET10) {
        OmTetMesh tet;
        assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(size, size, size), cells, cells, cells,
                                  &tet));
        for (int i = 0; i < tet.nvert; ++i)
            for (int k = 0; k < 3 && !is_border(tet.x, i, size); ++k)
                tet.x[3 * i + k] += om_rng_range(&rng, -shake, shake);
        assert_ok(om_fem_mesh_from_tet(&tet, kind, mesh));
        om_tet_mesh_done(&tet);
    } else {
        assert_ok(om_fem_mesh_box(kind, om_vec3(0, 0, 0), om_vec3(size, size, size), num, mesh));
        OmFemMesh copy = *mesh;
        for (int i = 0; i < copy.nnode; ++i) {
            if (is_border(mesh->x, i, size)) continue;
            for (int k = 0; k < 3; ++k) mesh->x[3 * i + k] += om_rng_range(&rng, -shake, shake);
        }
    }
    assert_ok(om_fem_mesh_validate(mesh));
}

static OmFemSolid* make_solid(const Case* c, const OmFemMesh* mesh, int nworker) {
    OmFemDef def = om_fem_default_def(mesh, 1, &c->material);
    OmFemSolid* solid;
    def.locking = c->locking;
    def.nworker = nworker;
    assert_ok(om_fem_create(&def, &solid));
    return solid;
}

// Forces against differences of energy, tangent against differences of forces, both of random positions.
static void test_derivatives(void** context) {
    (void)context;
    for (int n = 0; n < NCASE; ++n) {
        OmFemMesh mesh;
        shaken_cube(cases[n].kind, 2, 0.04, &mesh);
        OmFemSolid* s = make_solid(&cases[n], &mesh, 1);
        OmRng rng = om_rng_init(11, (uint64_t)n);
        int ndof = 3 * mesh.nnode;
        double *x = om_alloc((size_t)ndof, 8), *f = om_alloc((size_t)ndof, 8);
        double *hi = om_alloc((size_t)ndof, 8), *lo = om_alloc((size_t)ndof, 8);
        OmBsr A;
        assert_ok(om_fem_matrix_create(s, &A));
        for (int i = 0; i < ndof; ++i) x[i] = mesh.x[i] + om_rng_range(&rng, -2e-3, 2e-3);
        assert_ok(om_fem_eval_force(s, x, f, NULL));
        assert_ok(om_fem_eval_tangent(s, x, &A));
        double max = 0, stiff = 0, h = 1e-7;
        for (int i = 0; i < ndof; ++i) max = fmax(max, fabs(f[i]));
        for (int k = 0; k < 9 * A.nblock; ++k) stiff = fmax(stiff, fabs(A.exact[k]));
        double worst_f = 0, worst_A = 0;
        for (int i = 0; i < ndof; i += 7) {
            double was = x[i], up, down;
            x[i] = was + h;
            assert_ok(om_fem_eval_force(s, x, hi, &up));
            x[i] = was - h;
            assert_ok(om_fem_eval_force(s, x, lo, &down));
            x[i] = was;
            worst_f = fmax(worst_f, fabs((up - down) / (2 * h) - f[i]) / max);
            for (int j = 0; j < ndof; ++j) {
                int k = om_bsr_find(&A, j / 3, i / 3);
                double a = k < 0 ? 0 : A.exact[9 * k + 3 * (i % 3) + j % 3];
                worst_A = fmax(worst_A, fabs((hi[j] - lo[j]) / (2 * h) - a) / stiff);
            }
        }
        assert_below(worst_f, 1e-7);  // energy's rounding over h
        assert_below(worst_A, 1e-7);
        om_bsr_destroy(&A);
        om_fem_destroy(s);
        om_fem_mesh_done(&mesh);
        om_free(x), om_free(f), om_free(hi), om_free(lo);
    }
}

// The border of a distorted mesh is moved linearly, so is the inside, and stress is the same everywhere.
static void test_patch(void** context) {
    (void)context;
    for (int n = 0; n < NCASE; ++n) {
        double size = 0.04, worst = 0;
        OmFemMesh mesh;
        shaken_cube(cases[n].kind, 3, size, &mesh);
        OmFemSolid* s = make_solid(&cases[n], &mesh, 1);
        size_t ndof = 3 * (size_t)mesh.nnode;
        double *x = om_alloc(ndof, 8), *goal = om_calloc(ndof, 8);
        unsigned char* fixed = om_calloc(ndof, 1);
        OmMat3 F = {{1.02, 0.1, 0}, {-0.05, 0.9, 0.1}, {0.1, 0, 1.1}};
        for (int i = 0; i < mesh.nnode; ++i) {
            OmVec3 X = om_load3(mesh.x, i);
            om_store3(goal, i, om_sub(om_mat3_apply(F, X), X));
            for (int k = 0; k < 3; ++k) fixed[3 * i + k] = is_border(mesh.x, i, size);
        }
        memcpy(x, mesh.x, ndof * sizeof *x);
        OmFemLoad load = {.fixed = fixed, .goal = goal};
        OmFemStaticDef def = om_fem_static_default_def(s);
        OmFemReport report;
        def.tolerance = 1e-13;
        assert_ok(om_fem_static_solve(s, &load, &def, x, NULL, &report));
        for (int i = 0; i < mesh.nnode; ++i)
            for (int k = 0; k < 3; ++k)
                worst = fmax(worst, fabs(x[3 * i + k] - mesh.x[3 * i + k] - goal[3 * i + k]));
        assert_below(worst / size, 1e-12);
        OmMat3 first, other;
        for (int e = 0; e < mesh.nelem && cases[n].locking == OM_LOCKING_NONE; ++e) {
            assert_ok(om_fem_eval_stress(s, x, e, NULL, e == 0 ? &first : &other, NULL));
            if (e == 0) continue;
            OmMat3 d = om_mat3_add(first, om_mat3_scale(-1, other));
            assert_below(om_mat3_norm(d), 1e-11 * om_mat3_norm(first));
        }
        om_fem_destroy(s);
        om_fem_mesh_done(&mesh);
        om_free(x), om_free(goal), om_free(fixed);
    }
}

// A turn and a shift change neither energy nor forces, except of small-strain elasticity.
static void test_rigid_motion(void** context) {
    (void)context;
    for (int n = 0; n < NCASE; ++n) {
        if (cases[n].material.law == OM_LINEAR) continue;
        OmFemMesh mesh;
        shaken_cube(cases[n].kind, 2, 0.04, &mesh);
        OmFemSolid* s = make_solid(&cases[n], &mesh, 1);
        double *x = om_alloc(3 * (size_t)mesh.nnode, 8), *f = om_alloc(3 * (size_t)mesh.nnode, 8);
        OmPose pose = {{0.3, -0.2, 0.1}, om_quat_axis_angle(om_vec3(0.36, 0.48, 0.8), 2)};
        double energy;
        for (int i = 0; i < mesh.nnode; ++i)
            om_store3(x, i, om_pose_apply(pose, om_load3(mesh.x, i)));
        assert_ok(om_fem_eval_force(s, x, f, &energy));
        double size = 3000 * 0.04 * 0.04;
        for (int i = 0; i < 3 * mesh.nnode; ++i) assert_near(f[i], 0, 1e-12 * size);
        assert_near(energy, 0, 1e-12 * size * 0.04);
        om_fem_destroy(s);
        om_fem_mesh_done(&mesh);
        om_free(x), om_free(f);
    }
}

// Masses add up, consistent ones give the momentum of a linear field, lumped ones are positive.
static void test_mass(void** context) {
    (void)context;
    for (int kind = 0; kind < OM_NELEMENT; ++kind) {
        Case c = {.kind = (OmElement)kind,
                  .material = {.young = 3000, .poisson = 0.4, .law = OM_NEO_HOOKEAN}};
        OmFemMesh mesh;
        shaken_cube(c.kind, 3, 0.1, &mesh);
        OmFemSolid* s = make_solid(&c, &mesh, 1);
        double sum = 0, *y = om_alloc(3 * (size_t)mesh.nnode, 8), xx = 0;
        for (int i = 0; i < mesh.nnode; ++i) {
            sum += om_fem_mass(s)[i];
            assert_true(om_fem_mass(s)[i] > 0);
        }
        assert_near_rel(sum, 1.0, 1e-13);
        om_fem_apply_mass(s, true, mesh.x, y);
        for (int i = 0; i < mesh.nnode; ++i) xx += y[3 * i] * mesh.x[3 * i];
        assert_near_rel(xx, 1e-2 / 3, 1e-12);  // rho int x^2
        om_fem_destroy(s);
        om_fem_mesh_done(&mesh);
        om_free(y);
    }
}

// One and four workers: the same bytes.
static void test_determinism(void** context) {
    (void)context;
    for (int n = 0; n < NCASE; ++n) {
        OmFemMesh mesh;
        uint64_t hash[2];
        shaken_cube(cases[n].kind, 5, 0.04, &mesh);
        size_t ndof = 3 * (size_t)mesh.nnode;
        double *x = om_alloc(ndof, 8), *f = om_alloc(ndof, 8), energy;
        OmRng rng = om_rng_init(2, 2);
        for (size_t i = 0; i < ndof; ++i) x[i] = mesh.x[i] + om_rng_range(&rng, -1e-3, 1e-3);
        for (int k = 0; k < 2; ++k) {
            OmFemSolid* s = make_solid(&cases[n], &mesh, k == 0 ? 1 : 4);
            OmBsr A;
            assert_ok(om_fem_matrix_create(s, &A));
            assert_ok(om_fem_eval_force(s, x, f, &energy));
            assert_ok(om_fem_eval_tangent(s, x, &A));
            hash[k] = om_hash(f, ndof * sizeof *f, om_hash(&energy, sizeof energy, OM_HASH_SEED));
            hash[k] = om_hash(A.exact, 9 * (size_t)A.nblock * sizeof(double), hash[k]);
            om_bsr_destroy(&A);
            om_fem_destroy(s);
        }
        assert_true(hash[0] == hash[1]);
        om_fem_mesh_done(&mesh);
        om_free(x), om_free(f);
    }
}

// Meshes of shape_tet10.h: the same elements as om_fem_mesh_from_tet makes; there and back the same numbers.
static void test_tet10_meshes(void** context) {
    (void)context;
    OmTetMesh tet;
    OmTet10Mesh ten, back;
    OmFemMesh made, mesh, linear;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(1, 2, 3), 2, 2, 1, &tet));
    for (int e = 0; e < tet.ntet; ++e) tet.tet_label[e] = e % 3;
    assert_ok(om_tet10_mesh_from_tet(&tet, &ten));
    assert_ok(om_fem_mesh_from_tet10(&ten, &mesh));
    assert_ok(om_fem_mesh_from_tet(&tet, OM_TET10, &made));
    assert_int_equal(mesh.nnode, made.nnode);
    assert_int_equal(mesh.nelem, made.nelem);
    for (int i = 0; i < 10 * mesh.nelem; ++i)
        assert_memory_equal(mesh.x + 3 * mesh.elem_node[i], made.x + 3 * made.elem_node[i],
                            3 * sizeof(double));
    assert_memory_equal(mesh.elem_material, made.elem_material, (size_t)mesh.nelem * sizeof(int));
    for (int i = 0; i < 3 * mesh.nnode; ++i) made.x[i] = 2 * mesh.x[i];
    for (int moved = 0; moved < 2; ++moved) {
        assert_ok(om_fem_mesh_get_tet10(&mesh, moved ? made.x : NULL, &back));
        assert_memory_equal(back.elem_node, ten.elem_node, 10 * (size_t)ten.nelem * sizeof(int));
        assert_memory_equal(back.elem_label, ten.elem_label, (size_t)ten.nelem * sizeof(int));
        for (int i = 0; i < 3 * ten.nnode; ++i) assert_near(back.x[i], (1 + moved) * ten.x[i], 0);
        om_tet10_mesh_done(&back);
    }
    assert_ok(om_fem_mesh_from_tet(&tet, OM_TET4, &linear));
    assert_status(om_fem_mesh_get_tet10(&linear, NULL, &back), OM_INVALID);
    assert_null(back.x);
    om_fem_mesh_done(&linear);
    om_fem_mesh_done(&mesh);
    om_fem_mesh_done(&made);
    om_tet10_mesh_done(&ten);
    om_tet_mesh_done(&tet);
}

// A refined mesh whose vertices have moved: the elements of om_fem_mesh_from_tet, moved likewise; curved edges stay so.
static void test_meshes_of_nodes(void** context) {
    (void)context;
    OmTetMesh tet, fine;
    OmFemMesh made, mesh;
    int* node;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(1, 2, 3), 2, 2, 1, &tet));
    for (int e = 0; e < tet.ntet; ++e) tet.tet_label[e] = e % 3;
    assert_ok(om_fem_mesh_from_tet(&tet, OM_TET10, &made));
    assert_ok(om_tet_mesh_copy(&tet, &fine));
    assert_ok(om_tet_mesh_refine_nodes(&fine, &node));
    for (int i = 0; i < fine.nvert; ++i) fine.x[3 * i + 1] += 0.02 * fine.x[3 * i] * fine.x[3 * i];
    assert_ok(om_fem_mesh_from_nodes(&fine, node, &mesh));
    assert_true(mesh.kind == OM_TET10 && mesh.nelem == made.nelem && mesh.nnode == made.nnode);
    for (int i = 0; i < 10 * mesh.nelem; ++i) {
        OmVec3 at = om_load3(mesh.x, mesh.elem_node[i]), x = om_load3(made.x, made.elem_node[i]);
        x.y += 0.02 * x.x * x.x;
        assert_true(om_distance(at, x) < 1e-15);
    }
    assert_memory_equal(mesh.elem_material, made.elem_material, (size_t)mesh.nelem * sizeof(int));
    om_fem_mesh_done(&mesh);
    assert_ok(om_fem_mesh_from_nodes(&fine, NULL, &mesh));
    assert_true(mesh.kind == OM_TET4 && mesh.nelem == 8 * tet.ntet && mesh.nnode == fine.nvert);
    om_fem_mesh_done(&mesh);
    om_fem_mesh_done(&made);
    om_free(node);
    om_tet_mesh_done(&fine);
    om_tet_mesh_done(&tet);
}

// One tetrahedron of edge a whose edge 01, along x, bends by d against y. x = X + 4 L0 L1 d e_y gives the volume
// V - d V / a by the integral of 4 d (L0 L1),y = -4 d x / a^2, as the mean of x is a / 4.
static void test_volume_of_a_curved_element(void** context) {
    (void)context;
    const double a = 0.02, d = -0.003, V = a * a * a / 6;
    OmTetMesh tet;
    OmTet10Mesh ten;
    OmFemMesh mesh;
    assert_ok(om_tet_mesh_init(&tet, 4, 1));
    tet.x[3] = tet.x[7] = tet.x[11] = a;
    memcpy(tet.tet_vert, (int[4]){0, 1, 2, 3}, sizeof(int[4]));
    assert_ok(om_tet10_mesh_from_tet(&tet, &ten));
    ten.x[3 * ten.elem_node[4] + 1] += d;
    assert_ok(om_fem_mesh_from_tet10(&ten, &mesh));
    OmFemSolid* solid = make_solid(&cases[5], &mesh, 1);
    double mass = 0;
    for (int i = 0; i < mesh.nnode; ++i) mass += om_fem_mass(solid)[i];
    assert_near_rel(mass, 1000 * (V - d * V / a), 1e-13);
    om_fem_destroy(solid);
    om_fem_mesh_done(&mesh);
    ten.x[3 * ten.elem_node[4] + 1] = 2 * a;  // inverts a corner
    assert_status(om_fem_mesh_from_tet10(&ten, &mesh), OM_INVALID);
    assert_null(mesh.x);
    om_tet10_mesh_done(&ten);
    om_tet_mesh_done(&tet);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_tet10_meshes),
        cmocka_unit_test(test_meshes_of_nodes),
        cmocka_unit_test(test_volume_of_a_curved_element),
        cmocka_unit_test(test_derivatives),
        cmocka_unit_test(test_patch),
        cmocka_unit_test(test_rigid_motion),
        cmocka_unit_test(test_mass),
        cmocka_unit_test(test_determinism),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
