// test_fem_membrane.c: Cook's membrane, nearly incompressible, with linear and quadratic elements of the engine.
#include "test_element.h"

#define COOK_PARTS 10  // of the load
#define COOK_STEPS 20  // of Newton's method in each

typedef struct Cook {  // plane strain: x = 0 held, no node moves along z
    TestRig r;
    const OmTetMesh* mesh;
    size_t n;
    int nfree, *free_dof;  // components that move, by x
    double *load, *x, *f;
} Cook;

static bool is_cook_held(const Cook* c, int k) {
    return k % 3 == 2 || c->mesh->x[k - k % 3] < 1e-9;
}

// Unknowns in the order of x, so that the matrix has a narrow band.
static void number_unknowns(Cook* c) {
    c->free_dof = om_alloc(c->n, sizeof *c->free_dof);
    for (int k = 0; k < (int)c->n; ++k) {
        if (is_cook_held(c, k)) continue;
        double x = c->mesh->x[k - k % 3];
        int at = c->nfree++;
        for (; at > 0 && c->mesh->x[c->free_dof[at - 1] / 3 * 3] > x + 1e-9; --at)
            c->free_dof[at] = c->free_dof[at - 1];
        c->free_dof[at] = k;
    }
}

// f: what is out of balance under a share of the load; its norm over that of the load.
static double cook_residual(Cook* c, double share) {
    double sum = 0, whole = 0;
    assert_ok(om_tissue_set_x(c->r.m, c->r.s, c->x, NULL));
    assert_ok(om_tissue_get_internal_force(c->r.m, c->r.s, c->f));
    for (size_t k = 0; k < c->n; ++k) {
        c->f[k] = is_cook_held(c, (int)k) ? 0 : c->f[k] + share * c->load[k];
        sum += c->f[k] * c->f[k];
        whole += c->load[k] * c->load[k];
    }
    return sqrt(sum / whole);
}

// The exact tangent of the unknowns, n x n.
static double* cook_tangent(Cook* c) {
    size_t n = (size_t)c->nfree;
    double *K = om_calloc(n * n, sizeof *K), *still = om_calloc(c->n, sizeof *still);
    OmAssembly at = {.x = c->x, .v = still, .stiffness = 1, .force = 1, .is_exact = true};
    assert_ok(c->r.m->engine->assemble(c->r.m, c->r.s, c->r.w, &at));
    const OmBsr* A = om_engine_matrix(c->r.w);
    for (size_t i = 0; i < n; ++i)
        for (size_t j = 0; j < n; ++j) {
            int row = c->free_dof[i], col = c->free_dof[j],
                block = om_bsr_find(A, row / 3, col / 3);
            if (block >= 0) K[n * i + j] = (double)A->value[9 * block + 3 * (col % 3) + row % 3];
        }
    om_free(still);
    return K;
}

// x += K^-1 f, eliminated without pivots.
static void cook_newton(Cook* c) {
    size_t n = (size_t)c->nfree, *last = om_calloc(n, sizeof *last);
    double *K = cook_tangent(c), *b = om_alloc(n, sizeof *b);
    for (size_t i = 0; i < n; ++i) {
        b[i] = c->f[c->free_dof[i]];
        for (size_t j = 0; j < n; ++j)
            if (K[n * i + j] != 0) last[i] = j;
        if (i > 0 && last[i] < last[i - 1]) last[i] = last[i - 1];  // fill-in
    }
    for (size_t k = 0; k < n; ++k)
        for (size_t i = k + 1; i <= last[k]; ++i) {
            double m = K[n * i + k] / K[n * k + k];
            for (size_t j = k; j <= last[k]; ++j) K[n * i + j] -= m * K[n * k + j];
            b[i] -= m * b[k];
        }
    for (size_t k = n; k-- > 0;) {
        for (size_t j = k + 1; j <= last[k]; ++j) b[k] -= K[n * k + j] * b[j];
        b[k] /= K[n * k + k];
        c->x[c->free_dof[k]] += b[k];
    }
    om_free(K), om_free(b), om_free(last);
}

// The loaded face, 16 mm by 1 mm, in n pairs of triangles: a third of a triangle's force to each of its midpoints, of a
// linear element's face by trapezoids.
static double face_share(const Cook* c, int i, int n) {
    OmVec3 p = om_load3(c->mesh->x, i);
    bool is_end = p.y < 44e-3 + 1e-9 || p.y > 60e-3 - 1e-9,
         is_side = p.z < 1e-9 || p.z > 1e-3 - 1e-9;
    if (c->r.def.element == OM_ELEMENT_LINEAR) return (is_end ? 0.25 : 0.5) / n;
    if (i < om_tissue_corner_count(c->r.m)) return 0;
    return (is_end || is_side ? 1.0 : 2.0) / 6 / n;
}

// u_y of (48, 60), mm.
static double cook(const ElementKind* kind, int n, double nu) {
    Cook c = {0};
    rig_box(&c.r, om_vec3(0, 0, 0), om_vec3(1, 1, 1), n, n, 1);
    double force = 100, worst = 1, whole = 0;
    for (int i = 0; i < c.r.mesh.nvert; ++i) {
        OmVec3 p = om_load3(c.r.mesh.x, i);
        double low = 44 * p.x, high = 44 + 16 * p.x;
        om_store3(c.r.mesh.x, i, om_scale(1e-3, om_vec3(48 * p.x, low + (high - low) * p.y, p.z)));
    }
    c.r.def.material_default =
        (OmMaterial){.young = 240.565e6 * (1 + nu) / 1.499, .poisson = nu, .law = OM_MOONEY_RIVLIN};
    element_choose(&c.r, kind);
    rig_start(&c.r);
    c.mesh = element_nodes(&c.r);
    c.n = 3 * (size_t)c.mesh->nvert;
    number_unknowns(&c);
    double** array[] = {&c.load, &c.x, &c.f};
    for (int k = 0; k < 3; ++k) *array[k] = om_calloc(c.n, sizeof(double));
    for (int i = 0; i < c.mesh->nvert; ++i) {
        if (c.mesh->x[3 * i] < 48e-3 - 1e-9) continue;
        c.load[3 * i + 1] = force * face_share(&c, i, n);
        whole += c.load[3 * i + 1];
    }
    assert_near_rel(whole, force, 1e-12);
    memcpy(c.x, c.mesh->x, c.n * sizeof *c.x);
    for (int part = 1; part <= COOK_PARTS; ++part) {
        double share = (double)part / COOK_PARTS;
        worst = cook_residual(&c, share);
        for (int it = 0; it < COOK_STEPS && worst > 1e-6; ++it) {
            cook_newton(&c);
            worst = cook_residual(&c, share);
        }
        assert_below(worst, 1e-6);
    }
    double u = 0;
    for (int i = 0; i < c.mesh->nvert; ++i) {
        OmVec3 p = om_load3(c.mesh->x, i);
        if (p.x > 48e-3 - 1e-9 && p.y > 60e-3 - 1e-9 && p.z < 1e-9)
            u = 1e3 * (c.x[3 * i + 1] - p.y);
    }
    for (int k = 0; k < 3; ++k) om_free(*array[k]);
    om_free(c.free_dof);
    rig_done(&c.r);
    return u;
}

// Against OpenGeoSys, as test_fem_cook.c.
static void test_cook(void** context) {
    (void)context;
    double reference = 6.891409184641067;
    for (int n = 4; n <= (test_is_slow() ? 8 : 4); n *= 2) {
        double linear = cook(&linear_element, n, 0.499),
               quadratic = cook(&quadratic_element, n, 0.499);
        printf(
            "Cook, nu 0.499, %d cells: linear %.4f mm (%+.1f %%), quadratic %.4f mm (%+.1f %%)\n",
            n, linear, 100 * (linear / reference - 1), quadratic,
            100 * (quadratic / reference - 1));
        assert_true(linear < 0.4 * reference);
        assert_near_rel(quadratic, reference, n == 4 ? 0.1 : 0.03);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cook),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
