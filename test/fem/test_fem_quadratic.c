// test_fem_quadratic.c: tetrahedra of ten nodes in the engine: forces are slopes of the energy, uniform strain is
// exact, steps see the same forces and tangents, no shape but rigid motion is without stiffness, the equilibrium is
// that of om_fem_static_solve, and beams, membranes and thin sheets of few cells bend as they should.
#include "test_alloc.h"
#include "test_materials.h"
#include "test_random.h"
#include "test_rig.h"

#include "fem/fem_internal.h"

static const OmVec3 lo = {0, 0, 0}, hi = {0.03, 0.02, 0.02};

// Two materials of one law, tissue and something stiffer.
static void start(TestRig* r, OmMaterial* two, OmMaterial material) {
    rig_box(r, lo, hi, 2, 1, 1);
    two[0] = two[1] = material;
    two[1].young = 9000;
    two[1].poisson = 0.2;
    two[1].bulk = 0;
    r->def.nmaterial = 2;
    r->def.material = two;
    for (int e = 0; e < r->mesh.ntet; ++e) r->mesh.tet_label[e] = e % 5 == 0;
    r->def.gravity = om_vec3(0, 0, 0);
    r->def.element = OM_ELEMENT_QUADRATIC;
    rig_start(r);
}

// Vertices and midpoints.
static const OmTetMesh* nodes(const TestRig* r) { return om_tissue_mesh(r->m); }

static void deform(const TestRig* r, double shake, double* x) {
    OmMat3 F = {{0.4, 0.9, 0.1}, {-1.0, 0.5, 0.2}, {0.1, -0.2, 1.2}};
    for (int i = 0; i < nodes(r)->nvert; ++i)
        om_store3(x, i, om_mat3_apply(F, om_load3(nodes(r)->x, i)));
    rig_shake(nodes(r), NULL, shake, x);
}

static double elastic_at(const TestRig* r, const double* x) {
    OmTissueEnergy energy;
    assert_ok(om_tissue_set_x(r->m, r->s, x, NULL));
    assert_ok(om_tissue_get_energy(r->m, r->s, &energy));
    return energy.elastic;
}

// f = -dE/dx by central differences, every law, two materials; no resultant, no moment.
static void test_force_is_slope(void** context) {
    (void)context;
    for (int law = 0; law < NLAW; ++law) {
        TestRig r;
        OmMaterial two[2];
        start(&r, two, every_law[law]);
        size_t n = 3 * (size_t)nodes(&r)->nvert;
        double *x = om_alloc(n, sizeof *x), *f = om_alloc(n, sizeof *f), largest = 0, worst = 0;
        deform(&r, 0.0015, x);
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        assert_ok(om_tissue_get_internal_force(r.m, r.s, f));
        OmVec3 sum = {0, 0, 0}, moment = sum;
        for (int i = 0; i < nodes(&r)->nvert; ++i) {
            sum = om_add(sum, om_load3(f, i));
            moment = om_add(moment, om_cross(om_load3(x, i), om_load3(f, i)));
        }
        for (size_t k = 0; k < n; ++k) largest = fmax(largest, fabs(f[k]));
        for (size_t k = 0; k < n; ++k) {
            double place = x[k], step = 1e-7;
            x[k] = place + step;
            double above = elastic_at(&r, x);
            x[k] = place - step;
            double below = elastic_at(&r, x);
            x[k] = place;
            worst = fmax(worst, fabs(f[k] + (above - below) / (2 * step)));
        }
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

// Under a uniform F the energy is that of linear elements, and inner nodes feel no force.
static void test_uniform(void** context) {
    (void)context;
    for (int law = 0; law < NLAW; ++law) {
        TestRig plain, r;
        OmMaterial two[2], same[2];
        start(&r, two, every_law[law]);
        two[1] = two[0];
        start(&plain, same, every_law[law]);
        om_tissue_work_destroy(plain.w);
        om_tissue_state_destroy(plain.s);
        om_tissue_destroy(plain.m);
        plain.def.element = OM_ELEMENT_LINEAR;
        rig_start(&plain);
        size_t n = 3 * (size_t)nodes(&r)->nvert;
        double *x = om_alloc(n, sizeof *x), largest = 0, worst = 0, *f = om_alloc(n, sizeof *f);
        deform(&r, 0, x);
        // vertices come first: the same array serves both
        double energy = elastic_at(&plain, x);
        assert_near_rel(elastic_at(&r, x), energy, 1e-12);
        rig_done(&r);
        start(&r, two, every_law[law]);
        om_tissue_work_destroy(r.w);
        om_tissue_state_destroy(r.s);
        om_tissue_destroy(r.m);
        r.def.nmaterial = 0;
        r.def.material_default = every_law[law];
        rig_start(&r);
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        assert_ok(om_tissue_get_internal_force(r.m, r.s, f));
        for (int i = 0; i < nodes(&r)->nvert; ++i) {
            OmVec3 p = om_load3(nodes(&r)->x, i);
            bool is_inside = p.x > 1e-9 && p.x < hi.x - 1e-9 && p.y > 1e-9 && p.y < hi.y - 1e-9 &&
                             p.z > 1e-9 && p.z < hi.z - 1e-9;
            double size = om_norm(om_load3(f, i));
            largest = fmax(largest, size);
            if (is_inside) worst = fmax(worst, size);
        }
        assert_true(largest > 0);
        assert_below(worst, 1e-12 * largest);
        // the density is the law's own in every part, at any Poisson's ratio
        double* density = om_alloc((size_t)nodes(&r)->ntet, sizeof *density);
        OmTissueEnergy whole;
        assert_ok(om_tissue_get_energy(r.m, r.s, &whole));
        assert_ok(om_tissue_get_measure(r.m, r.s, OM_ENERGY_DENSITY, density));
        for (int e = 0; e < nodes(&r)->ntet; ++e)
            assert_near_rel(density[e] * hi.x * hi.y * hi.z, whole.elastic, 1e-9);
        om_free(density);
        om_free(x);
        om_free(f);
        rig_done(&r);
        rig_done(&plain);
    }
}

// What a step sees in float is what is computed in double: b = h (f + ...) at rest and, moving, h f(x + h v) to
// first order in v.
static void test_step_sees_the_same(void** context) {
    (void)context;
    for (int law = 0; law < NLAW; ++law) {
        TestRig r;
        OmMaterial two[2];
        start(&r, two, every_law[law]);
        size_t n = 3 * (size_t)nodes(&r)->nvert;
        double *x = om_alloc(n, sizeof *x), *f = om_alloc(n, sizeof *f),
               *v = om_calloc(n, sizeof *v), *still = om_alloc(n, sizeof *still), largest = 0,
               worst = 0, moved = 0, h = 0.02;
        for (int i = 0; i < nodes(&r)->nvert; ++i) om_store3(x, i, om_load3(nodes(&r)->x, i));
        rig_shake(nodes(&r), NULL, 0.0008, x);
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        assert_ok(om_tissue_get_internal_force(r.m, r.s, f));
        assert_ok(om_tissue_begin_step(r.m, r.s, r.w, h));
        for (size_t k = 0; k < n; ++k) largest = fmax(largest, h * fabs(f[k]));
        for (size_t k = 0; k < n; ++k) worst = fmax(worst, fabs(r.w->b[k] - h * f[k]));
        memcpy(still, r.w->b, n * sizeof *still);
        // small velocities about the undeformed shape, where no tangent is projected
        OmRng rng = om_rng_init(8, 0);
        for (size_t k = 0; k < n; ++k) v[k] = 2e-4 * om_rng_normal(&rng);
        for (size_t k = 0; k < n; ++k) x[k] = nodes(&r)->x[k] + h * v[k];
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        assert_ok(om_tissue_get_internal_force(r.m, r.s, f));
        assert_ok(om_tissue_set_x(r.m, r.s, nodes(&r)->x, v));
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

// No allocation may fail unseen, and nothing is left behind.
static void test_no_memory(void** context) {
    (void)context;
    TestRig r;
    OmMaterial two[2];
    start(&r, two, every_law[3]);
    assert_true(test_failing_allocations(rig_create_and_step, &r.def, 1) > 40);
    rig_done(&r);
}

// The same bytes with any number of workers.
static void test_workers(void** context) {
    (void)context;
    static const OmLaw law[] = {OM_COROTATIONAL, OM_NEO_HOOKEAN};
    for (int k = 0; k < 2; ++k) {
        uint64_t hash = 0;
        for (int nworker = 1; nworker <= 8; nworker += nworker > 2 ? 5 : 1) {
            TestRig r;
            rig_box(&r, lo, hi, 4, 3, 3);
            rig_attach_plane(&r, 0, 0);
            r.def.material_default.law = law[k];
            r.def.element = OM_ELEMENT_QUADRATIC;
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

// Elements inverted by nodes moved at random, one face held: all come back to rest.
static void test_inverted(void** context) {
    (void)context;
    static const OmLaw law[] = {OM_COROTATIONAL, OM_NEO_HOOKEAN, OM_STABLE_NEO_HOOKEAN};
    for (int k = 0; k < 3; ++k) {
        TestRig r;
        rig_box(&r, lo, hi, 3, 2, 2);
        rig_attach_plane(&r, 0, 0);
        r.def.material_default.law = law[k];
        r.def.element = OM_ELEMENT_QUADRATIC;
        r.def.gravity = om_vec3(0, 0, 0);
        r.def.rayleigh_mass = 2;
        rig_start(&r);
        size_t n = 3 * (size_t)nodes(&r)->nvert;
        double *x = om_alloc(n, sizeof *x), *J = om_alloc((size_t)nodes(&r)->ntet, sizeof *J);
        memcpy(x, nodes(&r)->x, n * sizeof *x);
        rig_shake(nodes(&r), om_tissue_attached(r.s), 0.003, x);
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        assert_ok(om_tissue_get_measure(r.m, r.s, OM_VOLUME_RATIO, J));
        int ninverted = 0;
        for (int e = 0; e < nodes(&r)->ntet; ++e) ninverted += J[e] < 0;
        for (int step = 0; step < 250; ++step) {
            OmStatus status = om_tissue_step(r.m, r.s, r.w, 0.02, NULL);
            if (status < 0) fail_msg("%s", om_error_message());
        }
        assert_ok(om_tissue_get_measure(r.m, r.s, OM_VOLUME_RATIO, J));
        int left = 0;
        double far = 0;
        for (int e = 0; e < nodes(&r)->ntet; ++e) left += J[e] < 0;
        for (size_t i = 0; i < n; ++i) far = fmax(far, fabs(om_tissue_x(r.s)[i] - nodes(&r)->x[i]));
        printf("%s: %d of %d inverted at first, %d after 5 s, %.2g m from rest\n",
               om_law_name(law[k]), ninverted, nodes(&r)->ntet, left, far);
        assert_true(ninverted > nodes(&r)->ntet / 20);
        assert_int_equal(left, 0);
        assert_below(far, 1e-4);
        om_free(x);
        om_free(J);
        rig_done(&r);
    }
}

// A vertex pushed through its element: the step does not say OM_OK.
static void test_says_inverted(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, lo, hi, 1, 1, 1);
    r.def.element = OM_ELEMENT_QUADRATIC;
    r.def.gravity = om_vec3(0, 0, 0);
    rig_start(&r);
    size_t n = 3 * (size_t)nodes(&r)->nvert;
    double* x = om_alloc(n, sizeof *x);
    memcpy(x, nodes(&r)->x, n * sizeof *x);
    for (int i = 0; i < nodes(&r)->nvert;
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

// A beam of 100 x 30 x 30 mm released under a tenth of its weight, half a second: tip after each step.
static void fall(OmTissueElement element, int max_newton, double* tip, double* gain) {
    TestRig r;
    rig_box(&r, lo, om_vec3(0.1, 0.03, 0.03), 10, 3, 3);
    rig_attach_plane(&r, 0, 0);
    r.def.element = element;
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

// One linearisation against Newton's method: as near as with linear elements; no energy from nowhere.
static void test_step_is_close(void** context) {
    (void)context;
    for (int element = 0; element < OM_NTISSUE_ELEMENT; ++element) {
        double one[25], many[25], gain, none, worst = 0;
        fall((OmTissueElement)element, 1, one, &gain);
        fall((OmTissueElement)element, 30, many, &none);
        for (int k = 0; k < 25; ++k) worst = fmax(worst, fabs(one[k] - many[k]));
        printf(
            "falling beam, %s: tip %.3f mm, one linearisation differs by %.3f mm, energy gained %.2g J\n",
            om_tissue_element_name((OmTissueElement)element), 1e3 * many[24], 1e3 * worst, gain);
        assert_below(worst, 0.03 * fabs(many[24]));
        assert_below(gain, 1e-9);
    }
}

// ---- the element -----------------------------------------------------------------------------------------

// Eigenvalues of a symmetric matrix by Jacobi rotations, ascending.
static void eigenvalues(double* A, int n, double* value) {
    for (int sweep = 0; sweep < 30; ++sweep)
        for (int p = 0; p < n; ++p)
            for (int q = p + 1; q < n; ++q) {
                double apq = A[n * p + q];
                if (fabs(apq) < 1e-300) continue;
                double theta = (A[n * q + q] - A[n * p + p]) / (2 * apq);
                double t = (theta < 0 ? -1 : 1) / (fabs(theta) + sqrt(1 + theta * theta));
                double c = 1 / sqrt(1 + t * t), d = t * c;
                for (int k = 0; k < n; ++k) {
                    double kp = A[n * k + p], kq = A[n * k + q];
                    A[n * k + p] = c * kp - d * kq;
                    A[n * k + q] = d * kp + c * kq;
                }
                for (int k = 0; k < n; ++k) {
                    double pk = A[n * p + k], qk = A[n * q + k];
                    A[n * p + k] = c * pk - d * qk;
                    A[n * q + k] = d * pk + c * qk;
                }
            }
    for (int k = 0; k < n; ++k) value[k] = A[n * k + k];
    for (int k = 1; k < n; ++k)
        for (int j = k; j > 0 && value[j] < value[j - 1]; --j) {
            double swap = value[j];
            value[j] = value[j - 1];
            value[j - 1] = swap;
        }
}

// One element of any shape: stiffness for every motion but the six rigid ones, at rest and, of projected tangents,
// never below zero; multigrid's bound of D^-1 A.
static void test_no_spurious_mode(void** context) {
    (void)context;
    OmRng rng = om_rng_init(4, 0);
    double least = 1, most = 0;
    for (int trial = 0; trial < 40; ++trial) {
        TestRig r = {0};
        assert_ok(om_tet_mesh_init(&r.mesh, 4, 1));
        double volume;
        do {
            for (int k = 0; k < 12; ++k) r.mesh.x[k] = 0.01 * om_rng_uniform(&rng);
            for (int k = 0; k < 4; ++k) r.mesh.tet_vert[k] = k;
            OmVec3 o = om_load3(r.mesh.x, 0);
            volume =
                om_dot(om_cross(om_sub(om_load3(r.mesh.x, 1), o), om_sub(om_load3(r.mesh.x, 2), o)),
                       om_sub(om_load3(r.mesh.x, 3), o));
        } while (volume < 5e-8);
        r.def = om_tissue_default_def(om_fem_engine(), &r.mesh);
        r.def.element = OM_ELEMENT_QUADRATIC;
        r.def.material_default = every_law[trial % 5];
        r.def.rayleigh_mass = 0;
        r.def.density = 1e-9;  // a step's matrix is then h^2 K
        rig_start(&r);
        assert_ok(om_tissue_begin_step(r.m, r.s, r.w, 1));
        OmBsr* A = om_engine_matrix(r.w);
        double K[900], value[30], D[900], scaled[900];
        assert_int_equal(A->nvert, 10);
        for (int i = 0; i < 10; ++i)
            for (int j = 0; j < 10; ++j) {
                int at = om_bsr_find(A, i, j);
                for (int c = 0; c < 9; ++c)
                    K[30 * (3 * i + c % 3) + 3 * j + c / 3] = (double)A->value[9 * at + c];
            }
        memcpy(scaled, K, sizeof K);
        memcpy(D, K, sizeof K);
        eigenvalues(D, 30, value);
        for (int k = 0; k < 6; ++k) assert_near(value[k], 0, 2e-6 * value[29]);
        assert_true(value[6] > 100 * fabs(value[5]));
        least = fmin(least, value[6] / value[29]);
        // D^-1/2 K D^-1/2, D block diagonal, by Cholesky factors of the blocks
        for (int side = 0; side < 2; ++side)
            for (int i = 0; i < 10; ++i) {
                double L[3][3] = {{0}};
                for (int c = 0; c < 3; ++c)
                    for (int q = c; q < 3; ++q) {
                        double sum = K[30 * (3 * i + q) + 3 * i + c];
                        for (int k = 0; k < c; ++k) sum -= L[q][k] * L[c][k];
                        L[q][c] = q == c ? sqrt(sum) : sum / L[c][c];
                    }
                for (int j = 0; j < 30; ++j)
                    for (int q = 0; q < 3; ++q) {
                        int own = side == 0 ? 30 * (3 * i + q) + j : 30 * j + 3 * i + q;
                        for (int k = 0; k < q; ++k)
                            scaled[own] -=
                                L[q][k] *
                                scaled[side == 0 ? 30 * (3 * i + k) + j : 30 * j + 3 * i + k];
                        scaled[own] /= L[q][q];
                    }
            }
        eigenvalues(scaled, 30, value);
        most = fmax(most, value[29]);
        rig_done(&r);
    }
    printf("smallest stiffness over the largest %.2g, largest eigenvalue of D^-1 K %.3g\n", least,
           most);
    assert_below(most, 6);  // QUADRATIC_BOUND of tissue_step.c
}

static void test_mass(void** context) {
    (void)context;
    TestRig r;
    OmMaterial two[2];
    start(&r, two, every_law[0]);
    const OmTetMesh* mesh = nodes(&r);
    assert_int_equal(om_tissue_corner_count(r.m), r.mesh.nvert);
    assert_int_equal(mesh->ntet, 8 * r.mesh.ntet);
    assert_memory_equal(mesh->x, r.mesh.x, 3 * (size_t)r.mesh.nvert * sizeof(double));
    double sum = 0, far = 0;
    for (int i = 0; i < mesh->nvert; ++i) {
        assert_true(om_tissue_mass(r.m)[i] > 0);
        sum += om_tissue_mass(r.m)[i];
        far += om_tissue_mass(r.m)[i] * mesh->x[3 * i];
    }
    assert_near_rel(sum, 1000 * hi.x * hi.y * hi.z, 1e-12);
    assert_near_rel(far / sum, 0.5 * hi.x, 1e-3);
    rig_done(&r);
}

// A midpoint is held still where both ends are, half-way between their anchors; springs stay at the vertices.
static void test_attachment(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, lo, hi, 3, 2, 2);
    rig_attach_plane(&r, 0, 0);
    r.def.element = OM_ELEMENT_QUADRATIC;
    rig_start(&r);
    const OmTetMesh* mesh = nodes(&r);
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
        rig_box(&r, lo, om_vec3(0.04, 0.02, 0.004), 4, 2, 1);
        rig_attach_plane(&r, 0, 0);
        r.def.element = OM_ELEMENT_QUADRATIC;
        r.def.material_default = (OmMaterial){.young = 3000, .poisson = 0.3, .law = law[k]};
        rig_start(&r);
        OmTissueReport report;
        double* f = om_tissue_external_force(r.s);
        OmVec3 weight = om_vec3(0, 0, 9.81);  // against gravity
        for (int i = 0; i < nodes(&r)->nvert; ++i) {
            OmVec3 push = om_scale(om_tissue_mass(r.m)[i], weight);
            push.z -= nodes(&r)->x[3 * i] > 0.04 - 1e-9 ? 1e-5 : 0;
            om_store3(f, i, push);
        }
        assert_ok(om_tissue_find_rest(r.m, r.s, r.w, 1e-6, 40, &report));
        OmFemMesh solid_mesh;
        assert_ok(om_fem_mesh_from_tet(&r.mesh, OM_TET10, &solid_mesh));
        assert_int_equal(solid_mesh.nnode, nodes(&r)->nvert);
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
            while (om_distance(om_load3(nodes(&r)->x, j), om_load3(solid_mesh.x, i)) > 1e-9) ++j;
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

// Deflection of a cantilever five times as long as high under its own weight over Timoshenko's, as in
// test_fem_static.c.
static double cantilever_ratio(int cells, double nu, OmLaw law, OmTissueElement element) {
    TestRig r;
    double L = 0.1, a = 0.02, young = 3e6, g = 9.81;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(L, a, a), 5 * cells, cells, cells);
    rig_attach_plane(&r, 0, 0);
    r.def.material_default = (OmMaterial){.young = young, .poisson = nu, .law = law};
    r.def.gravity = om_vec3(0, 0, -g);
    r.def.element = element;
    rig_start(&r);
    OmTissueReport report;
    OmStatus status = om_tissue_find_rest(r.m, r.s, r.w, 1e-4, 30, &report);
    if (status != OM_OK) fail_msg("%s", om_error_message());
    double w = 0;
    int num = 0;
    for (int i = 0; i < r.mesh.nvert; ++i) {
        if (r.mesh.x[3 * i] < L - 1e-9) continue;
        w += r.mesh.x[3 * i + 2] - om_tissue_x(r.s)[3 * i + 2];
        ++num;
    }
    rig_done(&r);
    double load = 1000 * g * a * a, inertia = a * a * a * a / 12;
    double k = 10 * (1 + nu) / (12 + 11 * nu), shear = young / (2 * (1 + nu));
    double beam = load * pow(L, 4) / (8 * young * inertia) + load * L * L / (2 * k * shear * a * a);
    return w / num / beam;
}

static void test_cantilever(void** context) {
    (void)context;
    static const double poisson[] = {0.3, 0.45, 0.49};
    for (int k = 0; k < 3; ++k) {
        double linear = cantilever_ratio(4, poisson[k], OM_COROTATIONAL, OM_ELEMENT_LINEAR);
        double one = cantilever_ratio(1, poisson[k], OM_COROTATIONAL, OM_ELEMENT_QUADRATIC);
        double two = cantilever_ratio(2, poisson[k], OM_STABLE_NEO_HOOKEAN, OM_ELEMENT_QUADRATIC);
        printf(
            "cantilever, nu %.2f: linear, 4 cells %+.1f %%; quadratic, 1 cell %+.1f %%, 2 cells %+.1f %%\n",
            poisson[k], 100 * (linear - 1), 100 * (one - 1), 100 * (two - 1));
        assert_near_rel(two, 1, 0.065);
        assert_near_rel(one, 1, 0.065);
        assert_true(linear < 0.8);
    }
}

// A strip of 60 x 30 x 5 mm held at one end, tip under a small weight, mm.
static double strip(int nx, int ny, int nz, OmTissueElement element) {
    TestRig r;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.06, 0.03, 0.005), nx, ny, nz);
    rig_attach_plane(&r, 0, 0);
    r.def.gravity = om_vec3(0, 0, -0.05);
    r.def.element = element;
    rig_start(&r);
    OmTissueReport report;
    if (om_tissue_find_rest(r.m, r.s, r.w, 1e-5, 40, &report) != OM_OK)
        fail_msg("%s", om_error_message());
    double w = 0;
    int num = 0;
    for (int i = 0; i < r.mesh.nvert; ++i) {
        OmVec3 p = om_load3(r.mesh.x, i);
        if (p.x < 0.06 - 1e-9 || (nodes(&r)->nvert > r.mesh.nvert && fabs(p.y - 0.015) > 1e-9))
            continue;
        w += r.mesh.x[3 * i + 2] - om_tissue_x(r.s)[3 * i + 2];
        ++num;
    }
    rig_done(&r);
    return 1e3 * w / num;
}

static void test_strip(void** context) {
    (void)context;
    double reference = 11.40;  // mm, see doc/fem.md
    double linear = strip(6, 3, 1, OM_ELEMENT_LINEAR), wide = strip(6, 2, 1, OM_ELEMENT_QUADRATIC),
           fine = strip(12, 6, 1, OM_ELEMENT_QUADRATIC);
    printf("strip: linear, 10 mm %+.1f %%; quadratic, 10 mm %+.1f %%, 5 mm %+.1f %%\n",
           100 * (linear / reference - 1), 100 * (wide / reference - 1),
           100 * (fine / reference - 1));
    assert_near_rel(wide, reference, 0.04);
    assert_near_rel(fine, reference, 0.04);
    assert_true(linear < 0.2 * reference);
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
static void test_elastica(void** context) {
    (void)context;
    static const double load[4][2] = {{1, 0}, {5, 0}, {10, 0}, {0, 10}};  // P L^2 / EI, w L^3 / EI
    for (int k = 0; k < 4; ++k) {
        if (!test_is_slow() && k != 2) continue;
        TestRig r;
        double L = 0.1, a = 0.002, young = 1e6, EI = young * a * a * a * a / 12;
        rig_box(&r, om_vec3(0, 0, 0), om_vec3(L, a, a), 20, 1, 1);
        rig_attach_plane(&r, 0, 0);
        r.def.element = OM_ELEMENT_QUADRATIC;
        r.def.material_default = (OmMaterial){.young = young, .poisson = 0};
        r.def.rayleigh_mass = 6;
        r.def.solver.tolerance = 1e-4;
        r.def.gravity = om_vec3(0, 0, -load[k][1] * EI / (L * L * L) / (1000 * a * a));
        rig_start(&r);
        double mass = 0, *f = om_tissue_external_force(r.s);
        const OmTetMesh* mesh = nodes(&r);
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
        printf("elastica, end %g, weight %g: tip (%.4f, %.4f), exact (%.4f, %.4f), %.2f %% apart\n",
               load[k][0], load[k][1], tip.x, tip.z, exact.x, exact.z, 100 * apart);
        assert_below(apart, 0.01);
        rig_done(&r);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_force_is_slope),
        cmocka_unit_test(test_uniform),
        cmocka_unit_test(test_step_sees_the_same),
        cmocka_unit_test(test_no_memory),
        cmocka_unit_test(test_workers),
        cmocka_unit_test(test_inverted),
        cmocka_unit_test(test_says_inverted),
        cmocka_unit_test(test_step_is_close),
        cmocka_unit_test(test_no_spurious_mode),
        cmocka_unit_test(test_mass),
        cmocka_unit_test(test_attachment),
        cmocka_unit_test(test_static_solid),
        cmocka_unit_test(test_cantilever),
        cmocka_unit_test(test_strip),
        cmocka_unit_test(test_elastica),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
