// test_fem_static.c: bodies at rest against exact solutions, beam theory and another code's answers.
#include "test_calculix.h"
#include "test_element.h"

// A mesh of distorted elements whose border is moved linearly: so is its inside, exactly, and every element
// has the same stress. Corotational strain keeps this for any linear map, here a turn with 20 % of strain.
static void test_patch(void** context) {
    (void)context;
    TestRig r;
    OmVec3 lo = {0, 0, 0}, hi = {0.04, 0.04, 0.04};
    rig_box(&r, lo, hi, 4, 4, 4);
    int n = r.mesh.nvert;
    unsigned char* is_border = om_calloc((size_t)n, 1);
    int *border = om_alloc((size_t)n, sizeof *border), num = 0;
    for (int i = 0; i < n; ++i)
        for (int k = 0; k < 3; ++k)
            is_border[i] |= r.mesh.x[3 * i + k] < 1e-9 || r.mesh.x[3 * i + k] > 0.04 - 1e-9;
    for (int i = 0; i < n; ++i)
        if (is_border[i]) border[num++] = i;
    rig_shake(&r.mesh, is_border, 0.002, r.mesh.x);
    r.def.gravity = om_vec3(0, 0, 0);
    r.def.solver.preconditioner = OM_CHOLESKY;
    rig_start(&r);
    OmMat3 F = {{0.9, 0.5, 0}, {-0.5, 0.8, 0.1}, {0.1, 0, 1.2}};
    double *goal = om_alloc(3 * (size_t)n, sizeof *goal), *anchor = om_alloc(3 * (size_t)num, 8);
    for (int i = 0; i < n; ++i) om_store3(goal, i, om_mat3_apply(F, om_load3(r.mesh.x, i)));
    for (int k = 0; k < num; ++k) om_store3(anchor, k, om_load3(goal, border[k]));
    assert_ok(om_tissue_set_attachment(r.m, r.s, num, border, anchor, NULL));
    assert_ok(om_tissue_set_x(r.m, r.s, goal, NULL));
    double* x = om_alloc(3 * (size_t)n, sizeof *x);
    memcpy(x, goal, 3 * (size_t)n * sizeof *x);
    rig_shake(&r.mesh, is_border, 0.004, x);
    assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
    rig_relax(&r, 20);
    // strains in float, 1e-7 of 40 mm, and more in elements that came out thin
    for (int k = 0; k < 3 * n; ++k) assert_near(om_tissue_x(r.s)[k], goal[k], 1e-7);
    double* stress = om_alloc((size_t)r.mesh.ntet, sizeof *stress);
    assert_ok(om_tissue_get_measure(r.m, r.s, OM_VON_MISES, stress));
    for (int e = 1; e < r.mesh.ntet; ++e) assert_near_rel(stress[e], stress[0], 5e-5);
    om_free(is_border);
    om_free(border);
    om_free(goal);
    om_free(anchor);
    om_free(x);
    om_free(stress);
    rig_done(&r);
}

// A bar hangs from its top, nu = 0: u = rho g / E (L s - s^2 / 2) downward at distance s from the top.
// Returns the root mean square error over the error-free root mean square.
static double hang_error(int cells) {
    TestRig r;
    double L = 0.08, young = 1e5, g = 9.81;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.02, 0.02, L), cells, cells, 4 * cells);
    rig_attach_plane(&r, 2, L);
    r.def.material_default = (OmMaterial){.young = young, .poisson = 0};
    rig_start(&r);
    rig_relax(&r, 4);
    double error = 0, size = 0;
    for (int i = 0; i < r.mesh.nvert; ++i) {
        double s = L - r.mesh.x[3 * i + 2], u = 1000 * g / young * (L * s - s * s / 2);
        double d = om_tissue_x(r.s)[3 * i + 2] - r.mesh.x[3 * i + 2] + u;
        error += d * d;
        size += u * u;
    }
    rig_done(&r);
    return sqrt(error / size);
}

static void test_hanging_bar(void** context) {
    (void)context;
    double coarse = hang_error(2), middle = hang_error(4), fine = hang_error(8);
    printf("bar: errors %.3g, %.3g, %.3g; orders %.2f, %.2f\n", coarse, middle, fine,
           log2(coarse / middle), log2(middle / fine));
    assert_below(fine, 4e-3);
    assert_true(log2(middle / fine) > 1.7);
}

// Deflection of the free end of a cantilever after four seconds, over Timoshenko's.
static double fallen_cantilever(int cells) {
    TestRig r;
    double L = 0.1, a = 0.02, young = 3e6, nu = 0.3, g = 9.81;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(L, a, a), 5 * cells, cells, cells);
    rig_attach_plane(&r, 0, 0);
    r.def.material_default = (OmMaterial){.young = young, .poisson = nu};
    r.def.gravity = om_vec3(0, 0, -g);
    rig_start(&r);
    rig_relax(&r, 4);
    double w = end_sag(&r, L);
    rig_done(&r);
    return w / timoshenko(L, a, young, nu, g);
}

// Linear tetrahedra are too stiff in bending; what is missing falls ever faster, towards the square of the
// cell.
static void test_cantilever(void** context) {
    (void)context;
    double a = 1 - fallen_cantilever(2), b = 1 - fallen_cantilever(4), c = 1 - fallen_cantilever(8);
    printf("cantilever: %.3f, %.3f, %.3f of Timoshenko's deflection missing; orders %.2f, %.2f\n",
           a, b, c, log2(a / b), log2(b / c));
    assert_true(c > 0 && log2(a / b) > 1 && log2(b / c) > log2(a / b));
    assert_below(c, 0.1);
}

// ---- CalculiX ---------------------------------------------------------------------------------------

// Hold and move what the case says, in ten parts, and find the rest. Reaction: of the moved vertices.
static void solve_case(TestRig* r, const CalculixCase* c, OmVec3* reaction) {
    int n = r->mesh.nvert, num = 0, newton = 0;
    int* vert = om_alloc((size_t)n, sizeof *vert);
    double* anchor = om_alloc(3 * (size_t)n, sizeof *anchor);
    double* f = om_alloc(3 * (size_t)n, sizeof *f);
    rig_start(r);
    for (int part = 1; part <= 10; ++part) {
        num = 0;
        for (int i = 0; i < n; ++i) {
            OmVec3 p = om_load3(r->mesh.x, i);
            Role k = c->role(p);
            if (k == FREE) continue;
            if (k == MOVED) p = om_madd(p, 0.1 * part, c->travel);
            om_store3(anchor, num, p);
            vert[num++] = i;
        }
        OmTissueReport report;
        assert_ok(om_tissue_set_attachment(r->m, r->s, num, vert, anchor, NULL));
        assert_ok(om_tissue_find_rest(r->m, r->s, r->w, 1e-8, 50, &report));
        newton += report.newton;
    }
    printf("%d iterations of Newton in ten parts\n", newton);
    assert_ok(om_tissue_get_holding_force(r->m, r->s, f));
    *reaction = om_vec3(0, 0, 0);
    for (int i = 0; i < n; ++i)
        if (c->role(om_load3(r->mesh.x, i)) == MOVED) *reaction = om_add(*reaction, om_load3(f, i));
    om_free(vert);
    om_free(anchor);
    om_free(f);
}

// The largest difference of displacements, over the largest displacement.
static double field_difference(const TestRig* r, const double* u) {
    double worst = 0, largest = 0;
    for (int i = 0; i < r->mesh.nvert; ++i) {
        OmVec3 d = om_sub(om_load3(om_tissue_x(r->s), i), om_load3(r->mesh.x, i));
        worst = fmax(worst, om_norm(om_sub(d, om_load3(u, i))));
        largest = fmax(largest, om_norm(om_load3(u, i)));
    }
    return worst / largest;
}

static void compare_case(const CalculixCase* c, OmMaterial material) {
    TestRig r;
    memset(&r, 0, sizeof r);
    calculix_load_mesh(c, &r.mesh);
    double* u = calculix_load_field(c, r.mesh.nvert);
    OmVec3 f;
    r.def = om_tissue_default_def(om_fem_engine(), &r.mesh);
    r.def.element = OM_ELEMENT_LINEAR;
    r.def.gravity = om_vec3(0, 0, 0);
    r.def.solver.nworker = 1;
    r.def.material_default = material;
    solve_case(&r, c, &f);
    double difference = field_difference(&r, u);
    double force = om_norm(om_sub(f, c->reaction)) / om_norm(c->reaction);
    printf("displacements differ by %.1e of the largest, reaction (%.6g, %.6g, %.6g) N by %.1e\n",
           difference, f.x, f.y, f.z, force);
    assert_below(difference, 1e-5);
    assert_below(force, 1e-4);
    om_free(u);
    rig_done(&r);
}

// Another code, the same mesh and law: every vertex, and the reaction. It prints seven digits.
static void test_calculix_block(void** context) {
    (void)context;
    OmMaterial material = {.young = 3000, .poisson = 0.45, .law = OM_ST_VENANT_KIRCHHOFF};
    compare_case(&calculix_block, material);
}
static void test_calculix_slab(void** context) {
    (void)context;
    OmMaterial material = {
        .young = 3000, .poisson = 0.45, .law = OM_MOONEY_RIVLIN, .c10 = 5.172413793e2, .bulk = 1e4};
    compare_case(&calculix_slab, material);
}

// A sheet of 0.1 mm with cells of 10 mm, held along a side, swings for two seconds: its steps are solved, and it
// goes where it goes with a direct solver. Returns the place of the far corner.
static OmVec3 swing_sheet(OmPreconditioner kind) {
    TestRig r;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.1, 0.1, 1e-4), 10, 10, 1);
    rig_attach_plane(&r, 0, 0);
    r.def.solver = om_solver_default_def();
    r.def.solver.preconditioner = kind;
    r.def.solver.nworker = 1;
    r.def.material_default.law = OM_STABLE_NEO_HOOKEAN;
    rig_start(&r);
    for (int n = 0; n < 100; ++n) assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, NULL));
    OmVec3 corner = om_load3(om_tissue_x(r.s), r.mesh.nvert - 1);
    rig_done(&r);
    return corner;
}

static void test_flat_elements(void** context) {
    (void)context;
    OmVec3 a = swing_sheet(OM_CHOLESKY), b = swing_sheet(OM_MULTIGRID);
    printf("flat sheet: corner at (%.2f, %.2f, %.2f) mm, %.2f mm from Cholesky's\n", 1e3 * b.x,
           1e3 * b.y, 1e3 * b.z, 1e3 * om_distance(a, b));
    assert_below(om_distance(a, b), 2e-3);  // a residual of 1e-3 a step, over 120 mm of way
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_patch),         cmocka_unit_test(test_hanging_bar),
        cmocka_unit_test(test_cantilever),    cmocka_unit_test(test_calculix_block),
        cmocka_unit_test(test_calculix_slab), cmocka_unit_test(test_flat_elements),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
