// test_fem_smooth.c: faces of quadratic elements stay smooth, without a pattern from node to node, where the tissue is
// squeezed: the side of a block pressed to 60 %, the inner face of a bent strip. Linear elements on the same nodes
// beside.
#include "test_element.h"

#define MAX_TERM 49

// Value of the Legendre polynomial of degree n.
static double legendre(int n, double x) {
    double p = 1, last = 0;
    for (int k = 1; k <= n; ++k) {
        double next = ((2 * k - 1) * x * p - (k - 1) * last) / k;
        last = p, p = next;
    }
    return p;
}

typedef struct Rough {
    double rms;      // of the distance from the fit, m
    double pattern;  // its part that changes sign from node to node, m
} Rough;

// Fit of f (num points) by products of polynomials of a, b in [-1, 1] up to the degrees; sign is that of the node.
static Rough fit(int num, const double* a, const double* b, const double* f, const double* sign,
                 int degree_a, int degree_b) {
    int n = (degree_a + 1) * (degree_b + 1);
    assert_true(n <= MAX_TERM && n < num);
    double K[MAX_TERM * MAX_TERM] = {0}, g[MAX_TERM] = {0}, row[MAX_TERM];
    for (int p = 0; p < num; ++p) {
        for (int t = 0; t < n; ++t)
            row[t] = legendre(t / (degree_b + 1), a[p]) * legendre(t % (degree_b + 1), b[p]);
        for (int s = 0; s < n; ++s) {
            g[s] += row[s] * f[p];
            for (int t = 0; t < n; ++t) K[s * n + t] += row[s] * row[t];
        }
    }
    for (int j = 0; j < n; ++j)  // Gauss's elimination of a positive definite matrix
        for (int i = j + 1; i < n; ++i) {
            double factor = K[i * n + j] / K[j * n + j];
            for (int k = j; k < n; ++k) K[i * n + k] -= factor * K[j * n + k];
            g[i] -= factor * g[j];
        }
    for (int i = n - 1; i >= 0; --i) {
        for (int k = i + 1; k < n; ++k) g[i] -= K[i * n + k] * g[k];
        g[i] /= K[i * n + i];
    }
    Rough out = {0};
    for (int p = 0; p < num; ++p) {
        double r = f[p];
        for (int t = 0; t < n; ++t)
            r -= g[t] * legendre(t / (degree_b + 1), a[p]) * legendre(t % (degree_b + 1), b[p]);
        out.rms += r * r / num;
        out.pattern += sign[p] * r / num;
    }
    out.rms = sqrt(out.rms);
    out.pattern = fabs(out.pattern);
    return out;
}

// Roughness of the displacement `component` on the inner part of the face where coordinate `axis` is `at`; the nodes
// are a grid of `spacing`, `margin` of it is left out at each edge.
static Rough face(const TestRig* r, OmVec3 hi, int axis, double at, int component,
                  const OmVec3 spacing, int margin, int degree_a, int degree_b) {
    const OmTetMesh* mesh = element_nodes(r);
    size_t room = (size_t)mesh->nvert;
    double *a = om_alloc(room, sizeof *a), *b = om_alloc(room, sizeof *b),
           *f = om_alloc(room, sizeof *f), *sign = om_alloc(room, sizeof *sign);
    double size[3] = {hi.x, hi.y, hi.z}, step[3] = {spacing.x, spacing.y, spacing.z};
    int num = 0, p = axis == 0 ? 1 : 0, q = axis == 2 ? 1 : 2;
    for (int i = 0; i < mesh->nvert; ++i) {
        const double* x = mesh->x + 3 * (size_t)i;
        int ip = (int)lround(x[p] / step[p]), iq = (int)lround(x[q] / step[q]);
        int np = (int)lround(size[p] / step[p]), nq = (int)lround(size[q] / step[q]);
        if (fabs(x[axis] - at) > 1e-9 || ip < margin || iq < margin || ip > np - margin ||
            iq > nq - margin)
            continue;
        a[num] = (2.0 * ip - np) / (np - 2 * margin);
        b[num] = (2.0 * iq - nq) / (nq - 2 * margin);
        f[num] = om_tissue_x(r->s)[3 * i + component] - x[component];
        sign[num++] = (ip + iq) % 2 ? -1 : 1;
    }
    Rough out = fit(num, a, b, f, sign, degree_a, degree_b);
    om_free(a), om_free(b), om_free(f), om_free(sign);
    return out;
}

// A cube of 40 mm pressed to 24 mm between plates that it sticks to: how far a side bulges, and how smooth.
static Rough squeeze(const ElementKind* kind, int n, double* bulge) {
    TestRig r;
    const double side = 0.04;
    OmVec3 hi = om_vec3(side, side, side);
    rig_box(&r, om_vec3(0, 0, 0), hi, n, n, n);
    r.def.material_default =
        (OmMaterial){.young = 5000, .poisson = 0.45, .law = OM_STABLE_NEO_HOOKEAN};
    r.def.gravity = om_vec3(0, 0, 0);
    r.def.rayleigh_mass = 4;
    r.def.solver.tolerance = 1e-4;
    element_choose(&r, kind);
    rig_start(&r);
    const OmTetMesh* mesh = element_nodes(&r);
    int* vert = om_alloc((size_t)mesh->nvert, sizeof *vert);
    double* anchor = om_alloc(3 * (size_t)mesh->nvert, sizeof *anchor);
    for (int k = 1; k <= 30; ++k) {
        int num = 0;
        for (int i = 0; i < mesh->nvert; ++i) {
            OmVec3 p = om_load3(mesh->x, i);
            if (p.z > 1e-9 && p.z < side - 1e-9) continue;
            if (p.z > 1e-9) p.z -= 0.4 * side * fmin(1, k / 20.0);
            vert[num] = i;
            om_store3(anchor, num++, p);
        }
        assert_ok(om_tissue_set_attachment(r.m, r.s, num, vert, anchor, NULL));
        assert_int_equal(om_tissue_step(r.m, r.s, r.w, k > 20 ? 0.2 : 0.04, NULL), OM_OK);
    }
    *bulge = 0;
    for (int i = 0; i < mesh->nvert; ++i) *bulge = fmax(*bulge, om_tissue_x(r.s)[3 * i] - side);
    double h = side / (kind->element == OM_ELEMENT_QUADRATIC ? 2 * n : n);
    Rough out = face(&r, hi, 0, side, 0, om_vec3(h, h, h), 2, 4, 4);
    om_free(vert), om_free(anchor);
    rig_done(&r);
    return out;
}

// The strip of doc/fem.md under its whole weight; the inner face is the lower one. Roughness along z.
static Rough bend(const ElementKind* kind, int nx, int ny, int nz) {
    TestRig r;
    OmVec3 hi = om_vec3(0.06, 0.03, 0.005);
    rig_box(&r, om_vec3(0, 0, 0), hi, nx, ny, nz);
    rig_attach_plane(&r, 0, 0);
    r.def.material_default =
        (OmMaterial){.young = 20000, .poisson = 0.45, .law = OM_STABLE_NEO_HOOKEAN};
    element_choose(&r, kind);
    rig_start(&r);
    OmTissueReport report;
    if (om_tissue_find_rest(r.m, r.s, r.w, 1e-5, 60, &report) != OM_OK)
        fail_msg("%s", om_error_message());
    int fine = kind->element == OM_ELEMENT_QUADRATIC ? 2 : 1;
    OmVec3 h = om_vec3(hi.x / (fine * nx), hi.y / (fine * ny), hi.z / (fine * nz));
    Rough out = face(&r, hi, 2, 0, 2, h, 2, 5, 3);
    rig_done(&r);
    return out;
}

static void test_squeeze(void** context) {
    (void)context;
    double bulge[2];
    int n = test_count(5, 8);
    Rough linear = squeeze(&linear_element, 2 * n, &bulge[0]),
          quadratic = squeeze(&quadratic_element, n, &bulge[1]);
    printf("squeezed to 60 %%: linear bulges %.2f mm, from a smooth side %.1f um, pattern %.2f um; "
           "quadratic %.2f mm, %.1f um, %.2f um\n",
           1e3 * bulge[0], 1e6 * linear.rms, 1e6 * linear.pattern, 1e3 * bulge[1],
           1e6 * quadratic.rms, 1e6 * quadratic.pattern);
    // parts of the bulge; the rest of the distance shrinks with the cells
    assert_below(quadratic.rms, 0.01 * bulge[1]);
    assert_below(quadratic.pattern, 0.001 * bulge[1]);
}

static void test_bend(void** context) {
    (void)context;
    Rough linear = bend(&linear_element, 24, 12, 2), quadratic = bend(&quadratic_element, 12, 6, 1);
    printf("inner face of the strip: linear %.1f um from a smooth face, pattern %.2f um; quadratic "
           "%.1f um, %.2f um\n",
           1e6 * linear.rms, 1e6 * linear.pattern, 1e6 * quadratic.rms, 1e6 * quadratic.pattern);
    assert_below(quadratic.rms, 2.5e-5);      // 0.5 % of the thickness
    assert_below(quadratic.pattern, 2.5e-6);  // 0.05 % of it
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_squeeze), cmocka_unit_test(test_bend)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
