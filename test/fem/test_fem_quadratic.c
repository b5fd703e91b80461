// test_fem_quadratic.c: tetrahedra of ten nodes in the engine: forces are slopes of the energy, uniform strain is
// exact, steps see the same forces and tangents, no shape but rigid motion is without stiffness, the equilibrium is
// that of om_fem_static_solve, and beams, membranes and thin sheets of few cells bend as they should.
#include <time.h>

#include "test_alloc.h"
#include "test_dense.h"
#include "test_element.h"

static const int small[3] = {2, 1, 1}, large[3] = {4, 3, 3}, middle[3] = {3, 2, 2};

static void test_force_is_slope(void** context) {
    (void)context;
    check_force_is_slope(&quadratic_element, small);
}

static void test_step_sees_the_same(void** context) {
    (void)context;
    check_step_sees_the_same(&quadratic_element, small);
}

static void test_drag(void** context) {
    (void)context;
    check_drag(&linear_element, small);
    check_drag(&quadratic_element, small);
}

static void test_workers(void** context) {
    (void)context;
    check_workers(&quadratic_element, large);
}

static void test_inverted(void** context) {
    (void)context;
    check_inverted(&quadratic_element, middle, 0.003, 1, 0);
}

static void test_step_is_close(void** context) {
    (void)context;
    check_step_is_close(&linear_element);
    check_step_is_close(&quadratic_element);
}

// Under a uniform F the energy is that of linear elements, and inner nodes feel no force.
static void test_uniform(void** context) {
    (void)context;
    for (int law = 0; law < NLAW; ++law) {
        TestRig plain, r;
        OmMaterial two[2], same[2];
        element_start(&r, &quadratic_element, small, two, every_law[law]);
        two[1] = two[0];
        element_start(&plain, &quadratic_element, small, same, every_law[law]);
        om_tissue_work_destroy(plain.w);
        om_tissue_state_destroy(plain.s);
        om_tissue_destroy(plain.m);
        plain.def.element = OM_ELEMENT_LINEAR;
        rig_start(&plain);
        size_t n = 3 * (size_t)element_nodes(&r)->nvert;
        double *x = om_alloc(n, sizeof *x), largest = 0, worst = 0, *f = om_alloc(n, sizeof *f);
        element_deform(&r, 0, x);
        // vertices come first: the same array serves both
        double energy = element_energy(&plain, x);
        assert_near_rel(element_energy(&r, x), energy, 1e-12);
        rig_done(&r);
        element_start(&r, &quadratic_element, small, two, every_law[law]);
        om_tissue_work_destroy(r.w);
        om_tissue_state_destroy(r.s);
        om_tissue_destroy(r.m);
        r.def.nmaterial = 0;
        r.def.material_default = every_law[law];
        rig_start(&r);
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        assert_ok(om_tissue_get_internal_force(r.m, r.s, f));
        for (int i = 0; i < element_nodes(&r)->nvert; ++i) {
            OmVec3 p = om_load3(element_nodes(&r)->x, i);
            bool is_inside = p.x > 1e-9 && p.x < element_hi.x - 1e-9 && p.y > 1e-9 &&
                             p.y < element_hi.y - 1e-9 && p.z > 1e-9 && p.z < element_hi.z - 1e-9;
            double size = om_norm(om_load3(f, i));
            largest = fmax(largest, size);
            if (is_inside) worst = fmax(worst, size);
        }
        assert_true(largest > 0);
        assert_below(worst, 1e-12 * largest);
        // the density is the law's own in every part, at any Poisson's ratio
        double* density = om_alloc((size_t)element_nodes(&r)->ntet, sizeof *density);
        OmTissueEnergy whole;
        assert_ok(om_tissue_get_energy(r.m, r.s, &whole));
        assert_ok(om_tissue_get_measure(r.m, r.s, OM_ENERGY_DENSITY, density));
        for (int e = 0; e < element_nodes(&r)->ntet; ++e)
            assert_near_rel(density[e] * element_hi.x * element_hi.y * element_hi.z, whole.elastic,
                            1e-9);
        om_free(density);
        om_free(x);
        om_free(f);
        rig_done(&r);
        rig_done(&plain);
    }
}

// No allocation may fail unseen, and nothing is left behind.
static void test_no_memory(void** context) {
    (void)context;
    TestRig r;
    OmMaterial two[2];
    element_start(&r, &quadratic_element, small, two, every_law[3]);
    assert_true(test_failing_allocations(rig_create_and_step, &r.def, 1) > 40);
    rig_done(&r);
}

// A vertex pushed through its element: the step does not say OM_OK.
static void test_says_inverted(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, element_lo, element_hi, 1, 1, 1);
    r.def.element = OM_ELEMENT_QUADRATIC;
    r.def.gravity = om_vec3(0, 0, 0);
    rig_start(&r);
    size_t n = 3 * (size_t)element_nodes(&r)->nvert;
    double* x = om_alloc(n, sizeof *x);
    memcpy(x, element_nodes(&r)->x, n * sizeof *x);
    for (int i = 0; i < element_nodes(&r)->nvert;
         ++i)  // the box turned inside out near the vertex at its origin
        if (x[3 * i] + x[3 * i + 1] < 0.016) x[3 * i + 2] *= -1;
    assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
    OmTissueReport report;
    OmStatus status = om_tissue_step(r.m, r.s, r.w, 1e-6, &report);
    assert_int_equal(status, OM_NOT_CONVERGED);
    assert_true(report.ninverted > 0);
    om_free(x);
    rig_done(&r);
}

// ---- the element -----------------------------------------------------------------------------------------

// One element of any shape; the matrix of a step is h^2 K.
static void start_one(TestRig* r, OmRng* rng, OmMaterial material) {
    *r = (TestRig){0};
    assert_ok(om_tet_mesh_init(&r->mesh, 4, 1));
    double volume;
    do {
        for (int k = 0; k < 12; ++k) r->mesh.x[k] = 0.01 * om_rng_uniform(rng);
        for (int k = 0; k < 4; ++k) r->mesh.tet_vert[k] = k;
        OmVec3 o = om_load3(r->mesh.x, 0);
        volume =
            om_dot(om_cross(om_sub(om_load3(r->mesh.x, 1), o), om_sub(om_load3(r->mesh.x, 2), o)),
                   om_sub(om_load3(r->mesh.x, 3), o));
    } while (volume < 5e-8);
    r->def = om_tissue_default_def(om_fem_engine(), &r->mesh);
    r->def.element = OM_ELEMENT_QUADRATIC;
    r->def.material_default = material;
    r->def.rayleigh_mass = 0;
    r->def.density = 1e-9;
    rig_start(r);
}

static void get_stiffness(TestRig* r, double K[900]) {
    assert_ok(om_tissue_begin_step(r->m, r->s, r->w, 1));
    OmBsr* A = om_engine_matrix(r->w);
    assert_int_equal(A->nvert, 10);
    for (int i = 0; i < 10; ++i)
        for (int j = 0; j < 10; ++j) {
            int at = om_bsr_find(A, i, j);
            for (int c = 0; c < 9; ++c)
                K[30 * (3 * i + c % 3) + 3 * j + c / 3] = (double)A->value[9 * at + c];
        }
}

// Stiffness for every motion but the six rigid ones, at rest; multigrid's bound of D^-1 A.
static void test_no_spurious_mode(void** context) {
    (void)context;
    OmRng rng = om_rng_init(4, 0);
    double least = 1, most = 0;
    for (int trial = 0; trial < 40; ++trial) {
        TestRig r;
        start_one(&r, &rng, every_law[trial % 5]);
        double K[900], value[30], D[900], scaled[900];
        get_stiffness(&r, K);
        memcpy(scaled, K, sizeof K);
        test_jacobi(30, K, value);
        for (int k = 0; k < 6; ++k) assert_near(value[k], 0, 2e-6 * value[29]);
        assert_true(value[6] > 100 * fabs(value[5]));
        least = fmin(least, value[6] / value[29]);
        memset(D, 0, sizeof D);
        for (int i = 0; i < 30; ++i)
            for (int c = 3 * (i / 3); c < 3 * (i / 3) + 3; ++c) D[30 * i + c] = scaled[30 * i + c];
        test_reduce_to_standard(30, D, scaled);
        test_jacobi(30, scaled, value);
        most = fmax(most, value[29]);
        rig_done(&r);
    }
    printf("smallest stiffness over the largest %.2g, largest eigenvalue of D^-1 K %.3g\n", least,
           most);
    assert_below(most, 6);  // QUADRATIC_BOUND of tissue_step.c
}

// The projected tangent of one element is never below zero, shaken, turned, inverted, or of many times its volume: a
// fold under a tool had 52 times its volume at a point, and no step of any length had a solution.
static void test_never_negative(void** context) {
    (void)context;
    static const double size[] = {0.5, 1, 1.5, 2, 3};
    OmRng rng = om_rng_init(6, 0);
    double worst = 0;
    for (int trial = 0; trial < 10 * NLAW; ++trial) {
        TestRig r;
        double K[900], value[30], x[30];
        start_one(&r, &rng, every_law[trial % NLAW]);
        OmMat3 F = om_mat3_scale(size[trial / NLAW % 5], random_rotation(&rng));
        for (int i = 0; i < 10; ++i)
            om_store3(x, i, om_mat3_apply(F, om_load3(element_nodes(&r)->x, i)));
        rig_shake(element_nodes(&r), NULL, trial < 5 * NLAW ? 0.0005 : 0.003, x);
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        get_stiffness(&r, K);
        test_jacobi(30, K, value);
        worst = fmin(worst, value[0] / value[29]);
        rig_done(&r);
    }
    printf("smallest stiffness over the largest %.2g\n", worst);
    assert_true(worst > -1e-6);  // floats
}

static void test_mass(void** context) {
    (void)context;
    TestRig r;
    OmMaterial two[2];
    element_start(&r, &quadratic_element, small, two, every_law[0]);
    const OmTetMesh* mesh = element_nodes(&r);
    assert_int_equal(om_tissue_corner_count(r.m), r.mesh.nvert);
    assert_int_equal(mesh->ntet, 8 * r.mesh.ntet);
    assert_memory_equal(mesh->x, r.mesh.x, 3 * (size_t)r.mesh.nvert * sizeof(double));
    double sum = 0, far = 0;
    for (int i = 0; i < mesh->nvert; ++i) {
        assert_true(om_tissue_mass(r.m)[i] > 0);
        sum += om_tissue_mass(r.m)[i];
        far += om_tissue_mass(r.m)[i] * mesh->x[3 * i];
    }
    assert_near_rel(sum, 1000 * element_hi.x * element_hi.y * element_hi.z, 1e-12);
    assert_near_rel(far / sum, 0.5 * element_hi.x, 1e-3);
    rig_done(&r);
}

// For files: the engine's elements with the nodes on their edges, at rest and moved; refused for linear ones.
static void test_nodes_for_files(void** context) {
    (void)context;
    static const int edge[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
    TestRig r;
    OmMaterial two[2];
    OmTet10Mesh ten;
    element_start(&r, &quadratic_element, small, two, every_law[0]);
    const OmTetMesh* mesh = element_nodes(&r);
    assert_ok(om_tissue_make_tet10(r.m, NULL, &ten));
    assert_int_equal(ten.nnode, mesh->nvert);
    assert_int_equal(ten.nelem, r.mesh.ntet);
    assert_int_equal(ten.nset, mesh->nset);
    assert_memory_equal(ten.elem_label, r.mesh.tet_label, (size_t)ten.nelem * sizeof(int));
    for (int e = 0; e < ten.nelem; ++e) {
        const int* node = ten.elem_node + 10 * e;
        assert_memory_equal(node, r.mesh.tet_vert + 4 * e, 4 * sizeof(int));
        for (int k = 0; k < 6; ++k) {
            OmVec3 p = om_load3(ten.x, node[edge[k][0]]), q = om_load3(ten.x, node[edge[k][1]]);
            assert_near(om_distance(om_load3(ten.x, node[4 + k]), om_lerp(p, q, 0.5)), 0, 1e-17);
        }
    }
    om_tet10_mesh_done(&ten);
    double* x = om_calloc(3 * (size_t)mesh->nvert, sizeof *x);
    for (int i = 0; i < 3 * mesh->nvert; ++i) x[i] = i;
    assert_ok(om_tissue_make_tet10(r.m, x, &ten));
    assert_memory_equal(ten.x, x, 3 * (size_t)mesh->nvert * sizeof *x);
    om_tet10_mesh_done(&ten);
    om_free(x);
    rig_done(&r);
    rig_box(&r, element_lo, element_hi, 1, 1, 1);
    rig_start(&r);
    assert_status(om_tissue_make_tet10(r.m, NULL, &ten), OM_UNAVAILABLE);
    rig_done(&r);
}

// A midpoint is held still where both ends are, half-way between their anchors; springs stay at the vertices.
static void test_attachment(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, element_lo, element_hi, 3, 2, 2);
    rig_attach_plane(&r, 0, 0);
    r.def.element = OM_ELEMENT_QUADRATIC;
    rig_start(&r);
    const OmTetMesh* mesh = element_nodes(&r);
    for (int i = 0; i < mesh->nvert; ++i)
        assert_int_equal(om_tissue_attached(r.s)[i], mesh->x[3 * i] < 1e-9);
    // one edge alone, its ends moved
    int vert[2] = {0, 1};
    double anchor[6] = {0, 0, 0.001, 0.01, 0, 0.003}, spring[2] = {0, 0};
    assert_ok(om_tissue_set_attachment(r.m, r.s, 2, vert, anchor, spring));
    int num = 0;
    for (int i = 0; i < mesh->nvert; ++i) {
        if (!om_tissue_attached(r.s)[i]) continue;
        ++num;
        if (i < 2) continue;
        assert_near(mesh->x[3 * i], 0.005, 1e-12);
        assert_near(om_tissue_anchor(r.s)[3 * i + 2], 0.002, 1e-12);
        assert_true(om_tissue_is_prescribed(r.m, r.s, i));
    }
    assert_int_equal(num, 3);
    spring[1] = 10;
    assert_ok(om_tissue_set_attachment(r.m, r.s, 2, vert, anchor, spring));
    num = 0;
    for (int i = 0; i < mesh->nvert; ++i) num += om_tissue_attached(r.s)[i];
    assert_int_equal(num, 2);
    rig_done(&r);
}

// The equilibrium of om_fem_static_solve, which computes in double with its own code, below a Poisson's ratio of 1/3,
// from which on the engine integrates in two parts: a sheet that is held at one side.
static void test_static_solid(void** context) {
    (void)context;
    static const OmLaw law[] = {OM_NEO_HOOKEAN, OM_ST_VENANT_KIRCHHOFF, OM_COROTATIONAL};
    for (int k = 0; k < 3; ++k) {
        TestRig r;
        rig_box(&r, element_lo, om_vec3(0.04, 0.02, 0.004), 4, 2, 1);
        rig_attach_plane(&r, 0, 0);
        r.def.element = OM_ELEMENT_QUADRATIC;
        r.def.material_default = (OmMaterial){.young = 3000, .poisson = 0.3, .law = law[k]};
        rig_start(&r);
        OmTissueReport report;
        double* f = om_tissue_external_force(r.s);
        OmVec3 weight = om_vec3(0, 0, 9.81);  // against gravity
        for (int i = 0; i < element_nodes(&r)->nvert; ++i) {
            OmVec3 push = om_scale(om_tissue_mass(r.m)[i], weight);
            push.z -= element_nodes(&r)->x[3 * i] > 0.04 - 1e-9 ? 1e-5 : 0;
            om_store3(f, i, push);
        }
        assert_ok(om_tissue_find_rest(r.m, r.s, r.w, 1e-6, 40, &report));
        OmFemMesh solid_mesh;
        assert_ok(om_fem_mesh_from_tet(&r.mesh, OM_TET10, &solid_mesh));
        assert_int_equal(solid_mesh.nnode, element_nodes(&r)->nvert);
        OmFemDef def = om_fem_default_def(&solid_mesh, 1, &r.def.material_default);
        def.nworker = 1;
        OmFemSolid* solid;
        assert_ok(om_fem_create(&def, &solid));
        size_t n = 3 * (size_t)solid_mesh.nnode;
        unsigned char* fixed = om_calloc(n, 1);
        double *force = om_calloc(n, sizeof *force), *x = om_alloc(n, sizeof *x), worst = 0,
               largest = 0;
        for (int i = 0; i < solid_mesh.nnode; ++i) {
            for (int c = 0; c < 3; ++c) fixed[3 * i + c] = solid_mesh.x[3 * i] < 1e-9;
            force[3 * i + 2] = solid_mesh.x[3 * i] > 0.04 - 1e-9 ? -1e-5 : 0;
        }
        OmFemLoad load = {.fixed = fixed, .force = force};
        OmFemStaticDef how = om_fem_static_default_def(solid);
        memcpy(x, solid_mesh.x, n * sizeof *x);
        assert_ok(om_fem_static_solve(solid, &load, &how, x, NULL, NULL));
        for (int i = 0; i < solid_mesh.nnode; ++i) {  // nodes by their place
            int j = 0;
            while (om_distance(om_load3(element_nodes(&r)->x, j), om_load3(solid_mesh.x, i)) > 1e-9)
                ++j;
            double moved = om_distance(om_load3(x, i), om_load3(solid_mesh.x, i));
            worst = fmax(worst, om_distance(om_load3(x, i), om_load3(om_tissue_x(r.s), j)));
            largest = fmax(largest, moved);
        }
        printf("%s: %.2f mm, apart %.2g of it\n", om_law_name(law[k]), 1e3 * largest,
               worst / largest);
        assert_true(largest > 1e-3);
        assert_below(worst, 2e-5 * largest);
        om_free(fixed), om_free(force), om_free(x);
        om_fem_destroy(solid);
        om_fem_mesh_done(&solid_mesh);
        rig_done(&r);
    }
}

// ---- bending ------------------------------------------------------------------------------------------

static void test_cantilever(void** context) {
    (void)context;
    static const double poisson[] = {0.3, 0.45, 0.49};
    for (int k = 0; k < 3; ++k) {
        double linear = cantilever_ratio(&linear_element, 4, poisson[k], OM_COROTATIONAL);
        double one = cantilever_ratio(&quadratic_element, 1, poisson[k], OM_COROTATIONAL);
        double two = cantilever_ratio(&quadratic_element, 2, poisson[k], OM_STABLE_NEO_HOOKEAN);
        printf(
            "cantilever, nu %.2f: linear, 4 cells %+.1f %%; quadratic, 1 cell %+.1f %%, 2 cells %+.1f %%\n",
            poisson[k], 100 * (linear - 1), 100 * (one - 1), 100 * (two - 1));
        assert_near_rel(two, 1, 0.065);
        assert_near_rel(one, 1, 0.065);
        assert_true(linear < 0.8);
    }
}

// A strip of 60 x 30 x 5 mm held at one end: how far the middle of the other end's lower edge sinks, mm; the mean of
// the end where no node is there.
static double strip(const ElementKind* kind, int nx, int ny, int nz, double young, double gravity) {
    TestRig r;
    rig_box(&r, element_lo, om_vec3(0.06, 0.03, 0.005), nx, ny, nz);
    rig_attach_plane(&r, 0, 0);
    r.def.gravity = om_vec3(0, 0, -gravity);
    r.def.material_default =
        (OmMaterial){.young = young, .poisson = 0.45, .law = OM_STABLE_NEO_HOOKEAN};
    element_choose(&r, kind);
    rig_start(&r);
    OmTissueReport report;
    if (om_tissue_find_rest(r.m, r.s, r.w, 1e-5, 60, &report) != OM_OK)
        fail_msg("%s", om_error_message());
    double w[2] = {0, 0};
    int num[2] = {0, 0};
    for (int i = 0; i < element_nodes(&r)->nvert; ++i) {
        OmVec3 p = om_load3(element_nodes(&r)->x, i);
        if (p.x < 0.06 - 1e-9) continue;
        int is_mark = fabs(p.y - 0.015) < 1e-9 && p.z < 1e-9;
        w[is_mark] += p.z - om_tissue_x(r.s)[3 * i + 2];
        ++num[is_mark];
    }
    rig_done(&r);
    return 1e3 * (num[1] > 0 ? w[1] / num[1] : w[0] / num[0]);
}

static void test_strip(void** context) {
    (void)context;
    static const struct {
        const ElementKind* kind;
        int cells[3];
        double lo, hi;  // of the error
    } row[] = {{&linear_element, {6, 3, 1}, -0.95, -0.85},
               {&linear_element, {12, 6, 2}, -0.80, -0.70},
               {&shell_element, {6, 3, 1}, -0.03, 0.03},
               {&shell_element, {12, 6, 1}, -0.02, 0.02},
               {&quadratic_element, {6, 3, 1}, -0.02, 0.02},
               {&quadratic_element, {12, 6, 1}, -0.04, 0.04},
               {&quadratic_element, {24, 12, 2}, -0.01, 0.01}};
    double reference = 11.40;  // mm, doc/fem.md
    for (int k = 0; k < (test_is_slow() ? 7 : 6); ++k) {
        const int* n = row[k].cells;
        double w = strip(row[k].kind, n[0], n[1], n[2], 3000, 0.05), error = w / reference - 1;
        printf("strip, %s %dx%dx%d: %.2f mm, %+.1f %%\n", row[k].kind->name, n[0], n[1], n[2], w,
               100 * error);
        assert_true(error > row[k].lo && error < row[k].hi);
    }
    // under its whole weight: 24x12x2 sinks 53.19 mm
    double coarse = strip(&quadratic_element, 6, 3, 1, 20000, 9.81),
           fine = strip(&quadratic_element, 12, 6, 1, 20000, 9.81),
           shell = strip(&shell_element, 6, 3, 1, 20000, 9.81),
           fine_shell = strip(&shell_element, 12, 6, 1, 20000, 9.81);
    printf("20 kPa, 9.81 m/s2: shells 6x3x1 %.2f mm, 12x6x1 %.2f mm\n", shell, fine_shell);
    printf("20 kPa, 9.81 m/s2: quadratic 6x3x1 %.2f mm, 12x6x1 %.2f mm, linear 6x3x1 %.2f mm\n",
           coarse, fine, strip(&linear_element, 6, 3, 1, 20000, 9.81));
    assert_near(coarse, 53.19, 1);
    assert_near(fine, 53.19, 0.3);
    assert_near(shell, 53.19, 1);
    assert_near(fine_shell, 53.19, 1);
    if (test_is_slow()) assert_near(strip(&quadratic_element, 24, 12, 2, 20000, 9.81), 53.19, 0.02);
}

// ---- a sheet that is lifted ----------------------------------------------------------------------------

typedef struct Lift {
    double force[2];     // N, at 20 and at 50 mm
    double least, mean;  // processor time of a step, s
} Lift;

static double processor_time(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

// A sheet of 120 x 120 x 8 mm without weight, lifted in steps of 20 ms and left to settle.
static Lift lift(const ElementKind* kind, int n, int layers) {
    TestRig r;
    Lift out = {.least = 1};
    int nstep = 0;
    rig_box(&r, element_lo, om_vec3(0.12, 0.12, 0.008), n, n, layers);
    r.def.material_default =
        (OmMaterial){.young = 20000, .poisson = 0.43, .law = OM_STABLE_NEO_HOOKEAN};
    r.def.gravity = om_vec3(0, 0, 0);
    r.def.rayleigh_mass = 4;
    r.def.solver.tolerance = 1e-3;
    element_choose(&r, kind);
    rig_start(&r);
    size_t nvert = (size_t)element_nodes(&r)->nvert;
    unsigned char* is_patch = om_alloc(nvert, 1);
    double* force = om_alloc(3 * nvert, sizeof *force);
    for (int high = 0; high < 2; ++high) {
        for (int k = 1; k <= 60; ++k) {
            raise_patch(&r, high ? 0.02 + 0.03 * fmin(1, k / 30.0) : 0.02 * fmin(1, k / 20.0),
                        is_patch);
            double start = processor_time();
            assert_int_equal(om_tissue_step(r.m, r.s, r.w, 0.02, NULL), OM_OK);
            double time = processor_time() - start;
            out.least = fmin(out.least, time);
            out.mean += time;
            ++nstep;
        }
        for (int k = 0; k < 80; ++k) assert_ok(om_tissue_step(r.m, r.s, r.w, 0.1, NULL));
        assert_ok(om_tissue_get_attachment_force(r.m, r.s, force));
        for (size_t i = 0; i < nvert; ++i)
            if (is_patch[i]) out.force[high] += force[3 * i + 2];
    }
    out.mean /= nstep;
    printf("lift, %s %dx%dx%d: %.4f N, %.4f N; a step %.2f ms at least, %.2f ms in the mean\n",
           kind->name, n, n, layers, out.force[0], out.force[1], 1e3 * out.least, 1e3 * out.mean);
    om_free(is_patch), om_free(force);
    rig_done(&r);
    return out;
}

// One layer of 10 mm is nearer to finer meshes than linear elements of 2.5 mm, which take longer.
static void test_lift(void** context) {
    (void)context;
    lift(&linear_element, 12, 1);
    lift(&linear_element, 24, 2);
    Lift linear = lift(&linear_element, 48, 4), quadratic = lift(&quadratic_element, 12, 1),
         fine = lift(&quadratic_element, 24, 2);
    lift(&shell_element, 12, 1);
    Lift shell = lift(&shell_element, 24, 1);
    for (int k = 0; k < 2; ++k) {
        assert_near_rel(quadratic.force[k], fine.force[k], 0.03);
        assert_near_rel(shell.force[k], fine.force[k], k ? 0.05 : 0.03);
        assert_true(linear.force[k] > quadratic.force[k]);
    }
    assert_true(quadratic.least < 0.5 * linear.least);
}

// ---- the elastica -------------------------------------------------------------------------------------

#define ROD_STEPS 2000

// The exact curve of a rod of length 1 that is clamped along x, under a dead load p at its end and q along its length,
// both down, over EI: theta'' = (p + q (1 - s)) cos theta by Runge and Kutta, theta'(1) = 0 by bisection.
static double shoot(double curvature, double p, double q, OmVec3* tip) {
    double y[4] = {0, curvature, 0, 0}, h = 1.0 / ROD_STEPS;  // theta, theta', x, z
    for (int n = 0; n < ROD_STEPS; ++n) {
        double k[4][4], at[4];
        for (int stage = 0; stage < 4; ++stage) {
            double step = stage == 0 ? 0 : stage < 3 ? 0.5 * h : h;
            for (int i = 0; i < 4; ++i) at[i] = y[i] + (stage > 0 ? step * k[stage - 1][i] : 0);
            k[stage][0] = at[1];
            k[stage][1] = (p + q * (1 - (n * h + step))) * cos(at[0]);
            k[stage][2] = cos(at[0]);
            k[stage][3] = sin(at[0]);
        }
        for (int i = 0; i < 4; ++i) y[i] += h / 6 * (k[0][i] + 2 * k[1][i] + 2 * k[2][i] + k[3][i]);
    }
    *tip = om_vec3(y[2], 0, y[3]);
    return y[1];
}

static OmVec3 exact_tip(double p, double q) {
    double lo_c = -(p + q), hi_c = 0;  // theta'(0) is the moment of the load, at most p + q / 2
    OmVec3 tip;
    for (int k = 0; k < 60; ++k) {
        double mid = 0.5 * (lo_c + hi_c);
        if (shoot(mid, p, q, &tip) > 0)
            hi_c = mid;
        else
            lo_c = mid;
    }
    return tip;
}

// A rod of 100 x 2 x 2 mm, nu 0, 20 cells of 5 mm, against the exact curve: end load and own weight.
static void check_elastica(const ElementKind* kind) {
    static const double load[4][2] = {{1, 0}, {5, 0}, {10, 0}, {0, 10}};  // P L^2 / EI, w L^3 / EI
    for (int k = 0; k < 4; ++k) {
        if (!test_is_slow() && k != 2) continue;
        TestRig r;
        double L = 0.1, a = 0.002, young = 1e6, EI = young * a * a * a * a / 12;
        rig_box(&r, om_vec3(0, 0, 0), om_vec3(L, a, a), 20, 1, 1);
        rig_attach_plane(&r, 0, 0);
        element_choose(&r, kind);
        r.def.material_default = (OmMaterial){.young = young, .poisson = 0};
        r.def.rayleigh_mass = 6;
        r.def.solver.tolerance = 1e-4;
        r.def.gravity = om_vec3(0, 0, -load[k][1] * EI / (L * L * L) / (1000 * a * a));
        rig_start(&r);
        double mass = 0, *f = om_tissue_external_force(r.s);
        const OmTetMesh* mesh = element_nodes(&r);
        for (int i = 0; i < mesh->nvert; ++i)
            if (mesh->x[3 * i] > L - 1e-9) mass += om_tissue_mass(r.m)[i];
        for (int i = 0; i < mesh->nvert; ++i)
            if (mesh->x[3 * i] > L - 1e-9)
                f[3 * i + 2] = -load[k][0] * EI / (L * L) * om_tissue_mass(r.m)[i] / mass;
        // let it settle: a matrix of floats cannot hold the statics of so slender a rod
        for (int step = 0; step < 250; ++step)
            assert_int_equal(om_tissue_step(r.m, r.s, r.w, 0.04, NULL), OM_OK);
        OmVec3 tip = {0, 0, 0};
        int num = 0;
        for (int i = 0; i < mesh->nvert; ++i)
            if (mesh->x[3 * i] > L - 1e-9) {
                tip = om_add(tip, om_load3(om_tissue_x(r.s), i));
                ++num;
            }
        tip = om_scale(1 / L / num, tip);
        tip.y = 0;
        tip.z -= 0.5 * a / L;
        OmVec3 exact = exact_tip(load[k][0], load[k][1]);
        double apart = om_distance(tip, exact), speed = 0;
        for (int i = 0; i < 3 * mesh->nvert; ++i) speed = fmax(speed, fabs(om_tissue_v(r.s)[i]));
        assert_below(speed, 1e-4);
        printf("elastica, %s, end %g, weight %g: tip (%.4f, %.4f), exact (%.4f, %.4f), %.2f %%\n",
               kind->name, load[k][0], load[k][1], tip.x, tip.z, exact.x, exact.z, 100 * apart);
        assert_below(apart, 0.01);
        rig_done(&r);
    }
}

static void test_elastica(void** context) {
    (void)context;
    check_elastica(&quadratic_element);
    check_elastica(&shell_element);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_force_is_slope),
        cmocka_unit_test(test_uniform),
        cmocka_unit_test(test_step_sees_the_same),
        cmocka_unit_test(test_no_memory),
        cmocka_unit_test(test_drag),
        cmocka_unit_test(test_workers),
        cmocka_unit_test(test_inverted),
        cmocka_unit_test(test_says_inverted),
        cmocka_unit_test(test_step_is_close),
        cmocka_unit_test(test_no_spurious_mode),
        cmocka_unit_test(test_never_negative),
        cmocka_unit_test(test_mass),
        cmocka_unit_test(test_nodes_for_files),
        cmocka_unit_test(test_attachment),
        cmocka_unit_test(test_static_solid),
        cmocka_unit_test(test_cantilever),
        cmocka_unit_test(test_strip),
        cmocka_slow_test(test_lift),
        cmocka_unit_test(test_elastica),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
