// test_element.h: what elements of the engine have in common: forces are slopes of the energy, steps see the same
// forces, workers do not matter, inverted elements come back, one linearisation is close to Newton's method, beams
// bend.
#ifndef OMENTUM_TEST_ELEMENT_H
#define OMENTUM_TEST_ELEMENT_H

#include "test_materials.h"
#include "test_random.h"
#include "test_rig.h"

#include "fem/fem_internal.h"

static const OmVec3 element_lo = {0, 0, 0}, element_hi = {0.03, 0.02, 0.02};

typedef struct ElementKind {
    const char* name;
    OmTissueElement element;
} ElementKind;
static const ElementKind linear_element = {"linear", OM_ELEMENT_LINEAR},
                         quadratic_element = {"quadratic", OM_ELEMENT_QUADRATIC},
                         shell_element = {"shell", OM_ELEMENT_SHELL};

static inline void element_choose(TestRig* r, const ElementKind* kind) {
    r->def.element = kind->element;
}

/// Two materials of one law, tissue and something stiffer.
static inline void element_start(TestRig* r, const ElementKind* kind, const int cells[3],
                                 OmMaterial* two, OmMaterial material) {
    rig_box(r, element_lo, element_hi, cells[0], cells[1], cells[2]);
    two[0] = two[1] = material;
    two[1].young = 9000;
    two[1].poisson = 0.2;
    two[1].bulk = 0;
    r->def.nmaterial = 2;
    r->def.material = two;
    int per = kind->element == OM_ELEMENT_SHELL ? 6 : 1;  // tetrahedra of an element
    for (int e = 0; e < r->mesh.ntet; ++e) r->mesh.tet_label[e] = e / per % 5 == 0;
    r->def.gravity = om_vec3(0, 0, 0);
    element_choose(r, kind);
    rig_start(r);
}

/// Vertices, and midpoints of quadratic elements.
static inline const OmTetMesh* element_nodes(const TestRig* r) { return om_tissue_mesh(r->m); }

static inline void element_deform(const TestRig* r, double shake, double* x) {
    OmMat3 F = {{0.4, 0.9, 0.1}, {-1.0, 0.5, 0.2}, {0.1, -0.2, 1.2}};
    for (int i = 0; i < element_nodes(r)->nvert; ++i)
        om_store3(x, i, om_mat3_apply(F, om_load3(element_nodes(r)->x, i)));
    rig_shake(element_nodes(r), NULL, shake, x);
}

static inline double element_energy(const TestRig* r, const double* x) {
    OmTissueEnergy energy;
    assert_ok(om_tissue_set_x(r->m, r->s, x, NULL));
    assert_ok(om_tissue_get_energy(r->m, r->s, &energy));
    return energy.elastic;
}

/// Largest |f + dE/dx| over the coordinates x, by central differences.
static inline double worst_slope(const TestRig* r, double* x, const double* f, double step) {
    double worst = 0;
    for (int k = 0; k < 3 * element_nodes(r)->nvert; ++k) {
        double place = x[k];
        x[k] = place + step;
        double above = element_energy(r, x);
        x[k] = place - step;
        double below = element_energy(r, x);
        x[k] = place;
        worst = fmax(worst, fabs(f[k] + (above - below) / (2 * step)));
    }
    return worst;
}

/// f = -dE/dx by central differences, every law, two materials; no resultant, no moment.
static inline void check_force_is_slope(const ElementKind* kind, const int cells[3]) {
    for (int law = 0; law < NLAW; ++law) {
        TestRig r;
        OmMaterial two[2];
        element_start(&r, kind, cells, two, every_law[law]);
        size_t n = 3 * (size_t)element_nodes(&r)->nvert;
        double *x = om_alloc(n, sizeof *x), *f = om_alloc(n, sizeof *f), largest = 0;
        element_deform(&r, 0.0015, x);
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        assert_ok(om_tissue_get_internal_force(r.m, r.s, f));
        OmVec3 sum = {0, 0, 0}, moment = sum;
        for (int i = 0; i < element_nodes(&r)->nvert; ++i) {
            sum = om_add(sum, om_load3(f, i));
            moment = om_add(moment, om_cross(om_load3(x, i), om_load3(f, i)));
        }
        for (size_t k = 0; k < n; ++k) largest = fmax(largest, fabs(f[k]));
        double worst = worst_slope(&r, x, f, 1e-7);
        printf("%s: force against slope %.2g of the largest\n", om_law_name(every_law[law].law),
               worst / largest);
        assert_below(worst, 2e-7 * largest);
        assert_near(om_norm(sum), 0, 1e-13 * largest);
        if (every_law[law].law != OM_LINEAR) assert_near(om_norm(moment), 0, 1e-14 * largest);
        om_free(x);
        om_free(f);
        rig_done(&r);
    }
}

/// What a step sees in float is what is computed in double: b = h (f + ...) at rest and, moving, h f(x + h v) to
/// first order in v.
static inline void check_step_sees_the_same(const ElementKind* kind, const int cells[3]) {
    for (int law = 0; law < NLAW; ++law) {
        TestRig r;
        OmMaterial two[2];
        element_start(&r, kind, cells, two, every_law[law]);
        size_t n = 3 * (size_t)element_nodes(&r)->nvert;
        double *x = om_alloc(n, sizeof *x), *f = om_alloc(n, sizeof *f),
               *v = om_calloc(n, sizeof *v), *still = om_alloc(n, sizeof *still), largest = 0,
               worst = 0, moved = 0, h = 0.02;
        for (int i = 0; i < element_nodes(&r)->nvert; ++i)
            om_store3(x, i, om_load3(element_nodes(&r)->x, i));
        rig_shake(element_nodes(&r), NULL, 0.0008, x);
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        assert_ok(om_tissue_get_internal_force(r.m, r.s, f));
        OmTissueCheck check;
        om__fem_check(r.m, r.w, x, element_nodes(&r)->x, false, &check);
        assert_near_rel(check.elastic_begin, element_energy(&r, x), 1e-4);
        assert_near(check.elastic_end, 0, 1e-4 * check.elastic_begin);
        assert_ok(om_tissue_begin_step(r.m, r.s, r.w, h));
        for (size_t k = 0; k < n; ++k) largest = fmax(largest, h * fabs(f[k]));
        for (size_t k = 0; k < n; ++k) worst = fmax(worst, fabs(r.w->b[k] - h * f[k]));
        memcpy(still, r.w->b, n * sizeof *still);
        // small velocities about the undeformed shape, where no tangent is projected
        OmRng rng = om_rng_init(8, 0);
        for (size_t k = 0; k < n; ++k) v[k] = 2e-4 * om_rng_normal(&rng);
        for (size_t k = 0; k < n; ++k) x[k] = element_nodes(&r)->x[k] + h * v[k];
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        assert_ok(om_tissue_get_internal_force(r.m, r.s, f));
        assert_ok(om_tissue_set_x(r.m, r.s, element_nodes(&r)->x, v));
        assert_ok(om_tissue_begin_step(r.m, r.s, r.w, h));
        double size = 0;
        for (size_t k = 0; k < n; ++k) size = fmax(size, h * fabs(f[k]));
        for (size_t k = 0; k < n; ++k) {
            double mass = om_tissue_mass(r.m)[k / 3];
            moved = fmax(moved, fabs(r.w->b[k] - h * f[k] + h * 0.1 * mass * v[k]));
        }
        printf("%s: float against double %.2g, moving %.2g of the largest\n",
               om_law_name(every_law[law].law), worst / largest, moved / size);
        assert_below(worst, 1e-5 * largest);
        assert_below(moved, 0.01 * size);  // strains of 4e-4, the second order
        om_free(x), om_free(f), om_free(v), om_free(still);
        rig_done(&r);
    }
}

/// The matrix and what drags are of one stiffness, also where tangents are projected and corners crushed: b(v) - b(0) =
/// M v - A v. A part of the matrix that does not drag is inertia without energy. Returns the error at x, relative.
static inline double drag_error(const TestRig* r, const double* x) {
    size_t n = 3 * (size_t)element_nodes(r)->nvert;
    double *v = om_alloc(n, sizeof *v), *still = om_alloc(n, sizeof *still),
           *Av = om_alloc(n, sizeof *Av), largest = 0, worst = 0;
    assert_ok(om_tissue_set_x(r->m, r->s, x, NULL));
    assert_ok(om_tissue_begin_step(r->m, r->s, r->w, 0.02));
    memcpy(still, r->w->b, n * sizeof *still);
    OmRng rng = om_rng_init(8, 0);
    for (size_t k = 0; k < n; ++k) v[k] = om_rng_normal(&rng);
    assert_ok(om_tissue_set_x(r->m, r->s, x, v));
    assert_ok(om_tissue_begin_step(r->m, r->s, r->w, 0.02));
    assert_ok(om_tissue_apply(r->m, r->w, 1, v, Av));
    for (size_t k = 0; k < n; ++k) {
        double drag = om_tissue_mass(r->m)[k / 3] * v[k] - Av[k];
        worst = fmax(worst, fabs(r->w->b[k] - still[k] - drag));
        largest = fmax(largest, fabs(drag));
    }
    om_free(v), om_free(still), om_free(Av);
    return worst / largest;
}

static inline void check_drag(const ElementKind* kind, const int cells[3]) {
    for (int law = 0; law < NLAW; ++law) {
        TestRig r;
        OmMaterial two[2];
        element_start(&r, kind, cells, two, every_law[law]);
        double* x = om_alloc(3 * (size_t)element_nodes(&r)->nvert, sizeof *x);
        element_deform(&r, 0.0015, x);
        double error = drag_error(&r, x);
        printf("%s, %s: drag against matrix %.2g\n", kind->name, om_law_name(every_law[law].law),
               error);
        assert_below(error, 1e-5);
        om_free(x);
        rig_done(&r);
    }
}

/// The same bytes with any number of workers.
static inline void check_workers(const ElementKind* kind, const int cells[3]) {
    static const OmLaw law[] = {OM_COROTATIONAL, OM_NEO_HOOKEAN};
    for (int k = 0; k < 2; ++k) {
        uint64_t hash = 0;
        for (int nworker = 1; nworker <= 8; nworker += nworker > 2 ? 5 : 1) {
            TestRig r;
            rig_box(&r, element_lo, element_hi, cells[0], cells[1], cells[2]);
            rig_attach_plane(&r, 0, 0);
            r.def.material_default.law = law[k];
            element_choose(&r, kind);
            r.def.solver.nworker = nworker;
            rig_start(&r);
            for (int step = 0; step < 5; ++step)
                assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, NULL));
            OmTissueReport report;
            assert_ok(om_tissue_find_rest(r.m, r.s, r.w, 1e-4, 20, &report));
            if (nworker == 1) hash = om_tissue_state_hash(r.s);
            assert_true(om_tissue_state_hash(r.s) == hash);
            rig_done(&r);
        }
    }
}

/// Nodes moved at random by `shake`, one face held, and 5 s of steps: the largest distance from rest, m. out: elements
/// inverted at first, and left.
static inline double shake_and_wait(const ElementKind* kind, const int cells[3], OmLaw law,
                                    double shake, uint64_t seed, int* ninverted, int* nleft) {
    TestRig r;
    rig_box(&r, element_lo, element_hi, cells[0], cells[1], cells[2]);
    rig_attach_plane(&r, 0, 0);
    r.def.material_default.law = law;
    element_choose(&r, kind);
    r.def.gravity = om_vec3(0, 0, 0);
    r.def.rayleigh_mass = 2;
    rig_start(&r);
    const OmTetMesh* mesh = element_nodes(&r);
    size_t n = 3 * (size_t)mesh->nvert;
    double *x = om_alloc(n, sizeof *x), *J = om_alloc((size_t)mesh->ntet, sizeof *J), far = 0;
    memcpy(x, mesh->x, n * sizeof *x);
    rig_shake_by(mesh, om_tissue_attached(r.s), shake, seed, x);
    assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
    assert_ok(om_tissue_get_measure(r.m, r.s, OM_VOLUME_RATIO, J));
    *ninverted = *nleft = 0;
    for (int e = 0; e < mesh->ntet; ++e) *ninverted += J[e] < 0;
    for (int step = 0; step < 250; ++step) {
        OmStatus status = om_tissue_step(r.m, r.s, r.w, 0.02, NULL);
        if (status < 0) fail_msg("%s", om_error_message());
    }
    assert_ok(om_tissue_get_measure(r.m, r.s, OM_VOLUME_RATIO, J));
    for (int e = 0; e < mesh->ntet; ++e) *nleft += J[e] < 0;
    for (size_t i = 0; i < n; ++i) far = fmax(far, fabs(om_tissue_x(r.s)[i] - mesh->x[i]));
    om_free(x);
    om_free(J);
    rig_done(&r);
    return far;
}

/// Elements, at least one in twenty, inverted at random `ntrial` times: all but `nlost` come back to rest.
static inline void check_inverted(const ElementKind* kind, const int cells[3], double shake,
                                  int ntrial, int nlost) {
    static const OmLaw law[] = {OM_COROTATIONAL, OM_NEO_HOOKEAN, OM_STABLE_NEO_HOOKEAN};
    const int ntet = 6 * cells[0] * cells[1] * cells[2];
    for (int k = 0; k < 3; ++k) {
        int nback = 0, sum = 0;
        for (int trial = 0; trial < ntrial; ++trial) {
            int ninverted, nleft;
            double far =
                shake_and_wait(kind, cells, law[k], shake, 1 + (uint64_t)trial, &ninverted, &nleft);
            nback += far < 1e-4 && nleft == 0;
            sum += ninverted;
        }
        printf("%s: %d of %d inverted at first, %d of %d are at rest after 5 s\n",
               om_law_name(law[k]), sum, ntrial * ntet, nback, ntrial);
        assert_true(20 * sum > ntrial * ntet);
        assert_true(nback >= ntrial - nlost);
    }
}

/// A beam of 100 x 30 x 30 mm released under a tenth of its weight, half a second: tip after each step.
static inline void element_fall(const ElementKind* kind, int max_newton, double* tip,
                                double* gain) {
    TestRig r;
    rig_box(&r, element_lo, om_vec3(0.1, 0.03, 0.03), 10, 3, 3);
    rig_attach_plane(&r, 0, 0);
    element_choose(&r, kind);
    r.def.gravity = om_vec3(0, 0, -0.981);
    r.def.max_newton = max_newton;
    r.def.newton_tolerance = 1e-4;
    rig_start(&r);
    *gain = 0;
    for (int step = 0; step < 25; ++step) {
        OmTissueEnergy e;
        OmStatus status = om_tissue_step(r.m, r.s, r.w, 0.02, NULL);
        if (status != OM_OK) fail_msg("%s", om_error_message());
        assert_ok(om_tissue_get_energy(r.m, r.s, &e));
        double rest = -0.981 * r.m->total_mass * 0.015;
        *gain = fmax(*gain, e.elastic + e.kinetic + e.gravity + rest);
        tip[step] = om_tissue_x(r.s)[3 * r.mesh.nvert - 1] - r.mesh.x[3 * r.mesh.nvert - 1];
    }
    rig_done(&r);
}

/// One linearisation against Newton's method: as near as with linear elements; no energy from nowhere.
static inline void check_step_is_close(const ElementKind* kind) {
    double one[25], many[25], gain, none, worst = 0;
    element_fall(kind, 1, one, &gain);
    element_fall(kind, 30, many, &none);
    for (int k = 0; k < 25; ++k) worst = fmax(worst, fabs(one[k] - many[k]));
    printf(
        "falling beam, %s: tip %.3f mm, one linearisation differs by %.3f mm, energy gained %.2g J\n",
        kind->name, 1e3 * many[24], 1e3 * worst, gain);
    assert_below(worst, 0.03 * fabs(many[24]));
    assert_below(gain, 1e-9);
}

/// Deflection of the free end of a cantilever of 1000 kg/m^3 under its own weight, m: bending rho g A L^4 / (8 E I)
/// and shear rho g A L^2 / (2 k G A), k = 10 (1 + nu) / (12 + 11 nu).
static inline double timoshenko(double L, double a, double young, double nu, double g) {
    double load = 1000 * g * a * a, inertia = a * a * a * a / 12;
    double k = 10 * (1 + nu) / (12 + 11 * nu), shear = young / (2 * (1 + nu));
    return load * pow(L, 4) / (8 * young * inertia) + load * L * L / (2 * k * shear * a * a);
}

/// How far the vertices at x = L have sunk, mean, m.
static inline double end_sag(const TestRig* r, double L) {
    double w = 0;
    int num = 0;
    for (int i = 0; i < r->mesh.nvert; ++i) {
        if (r->mesh.x[3 * i] < L - 1e-9) continue;
        w += r->mesh.x[3 * i + 2] - om_tissue_x(r->s)[3 * i + 2];
        ++num;
    }
    return w / num;
}

/// Deflection of a cantilever five times as long as high under its own weight over Timoshenko's, as in
/// test_fem_static.c.
static inline double cantilever_ratio(const ElementKind* kind, int cells, double nu, OmLaw law) {
    TestRig r;
    double L = 0.1, a = 0.02, young = 3e6, g = 9.81;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(L, a, a), 5 * cells, cells, cells);
    rig_attach_plane(&r, 0, 0);
    r.def.material_default = (OmMaterial){.young = young, .poisson = nu, .law = law};
    r.def.gravity = om_vec3(0, 0, -g);
    element_choose(&r, kind);
    rig_start(&r);
    OmTissueReport report;
    OmStatus status = om_tissue_find_rest(r.m, r.s, r.w, 1e-4, 30, &report);
    if (status != OM_OK) fail_msg("%s", om_error_message());
    double w = end_sag(&r, L);
    rig_done(&r);
    return w / timoshenko(L, a, young, nu, g);
}

/// Of a sheet of 120 x 120 mm, attach the half below x = 60 mm, and a patch of 20 mm of the other half, raised by z.
static inline void raise_patch(TestRig* r, double z, unsigned char* is_patch) {
    const OmTetMesh* mesh = element_nodes(r);
    int num = 0, *vert = om_alloc((size_t)mesh->nvert, sizeof *vert);
    double* anchor = om_alloc(3 * (size_t)mesh->nvert, sizeof *anchor);
    for (int i = 0; i < mesh->nvert; ++i) {
        OmVec3 p = om_load3(mesh->x, i);
        is_patch[i] = p.x > 0.1 - 1e-9 && fabs(p.y - 0.06) < 0.01 + 1e-9;
        if (p.x > 0.06 + 1e-9 && !is_patch[i]) continue;
        if (is_patch[i]) p.z += z;
        vert[num] = i;
        om_store3(anchor, num++, p);
    }
    assert_ok(om_tissue_set_attachment(r->m, r->s, num, vert, anchor, NULL));
    om_free(vert), om_free(anchor);
}

#endif
