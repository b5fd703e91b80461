// test_heuristic_spring.c: springs stretch as their lattice says, turn freely, keep momentum and stay finite.
#include "test_alloc.h"
#include "test_rig.h"

#include "omentum/contact_tool.h"
#include "omentum/heuristic.h"
#include "omentum/shape_meshing.h"

#define YOUNG 3000.0

static const OmVec3 nothing = {0, 0, 0};

static void box(TestRig* r, OmVec3 size, int nx, int ny, int nz) {
    rig_box(r, nothing, size, nx, ny, nz);
    r->def.engine = om_spring_engine();
    r->def.material_default.young = YOUNG;
}

// Interior vertices moved by up to a fifth of a cell, so that no two elements are alike.
static void shake_inside(OmTetMesh* mesh, double cell) {
    OmSurface skin;
    int* on_skin;
    assert_ok(om_tet_mesh_boundary(mesh, &skin, &on_skin));
    unsigned char* still = om_calloc((size_t)mesh->nvert, 1);
    for (int n = 0; n < skin.nvert; ++n) still[on_skin[n]] = 1;
    rig_shake(mesh, still, 0.2 * cell, mesh->x);
    om_free(still);
    om_free(on_skin);
    om_surface_done(&skin);
}

// ---- what lattice theory says -------------------------------------------------------------------------

// Invert a symmetric positive definite 6 x 6 matrix (Gauss and Jordan).
static void invert6(double a[6][6], double inverse[6][6]) {
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) inverse[i][j] = i == j;
    for (int i = 0; i < 6; ++i) {
        double pivot = a[i][i];
        for (int j = 0; j < 6; ++j) a[i][j] /= pivot, inverse[i][j] /= pivot;
        for (int k = 0; k < 6; ++k) {
            double s = a[k][i];
            for (int j = 0; j < 6 && k != i; ++j)
                a[k][j] -= s * a[i][j], inverse[k][j] -= s * inverse[i][j];
        }
    }
}

// An element's tensor sum (k l^2 / V) n n n n with k = E V / l^2, in Mandel's notation.
static void element_tensor(const OmTetMesh* mesh, int e, double C[6][6]) {
    memset(C, 0, 36 * sizeof(double));
    const int* v = mesh->tet_vert + 4 * (size_t)e;
    for (int a = 0; a < 4; ++a) {
        for (int b = a + 1; b < 4; ++b) {
            OmVec3 n = om_normalize(om_sub(om_load3(mesh->x, v[b]), om_load3(mesh->x, v[a])));
            double r = sqrt(2), nn[6] = {n.x * n.x,     n.y * n.y,     n.z * n.z,
                                         r * n.y * n.z, r * n.z * n.x, r * n.x * n.y};
            for (int i = 0; i < 6; ++i)
                for (int j = 0; j < 6; ++j) C[i][j] += YOUNG * nn[i] * nn[j];
        }
    }
}

typedef struct Bounds {
    // Young's modulus along x: all elements under one stress, all in one strain
    double min, max;
    double poisson;  // in one strain, mean of y and z
} Bounds;

static double volume_of(const OmTetMesh* mesh, int e) {
    const int* v = mesh->tet_vert + 4 * (size_t)e;
    OmVec3 o = om_load3(mesh->x, v[0]);
    OmVec3 a = om_sub(om_load3(mesh->x, v[1]), o), b = om_sub(om_load3(mesh->x, v[2]), o);
    return om_dot(om_cross(a, b), om_sub(om_load3(mesh->x, v[3]), o)) / 6;
}

static Bounds lattice_bounds(const OmTetMesh* mesh) {
    double C[6][6], S[6][6], mean_C[6][6] = {{0}}, volume = 0, compliance = 0;
    for (int e = 0; e < mesh->ntet; ++e) {
        double V = volume_of(mesh, e);
        element_tensor(mesh, e, C);
        for (int i = 0; i < 36; ++i) mean_C[i / 6][i % 6] += V * C[i / 6][i % 6];
        invert6(C, S);
        compliance += V * S[0][0];
        volume += V;
    }
    for (int i = 0; i < 36; ++i) mean_C[i / 6][i % 6] /= volume;
    invert6(mean_C, S);
    return (Bounds){volume / compliance, 1 / S[0][0], -0.5 * (S[0][1] + S[0][2]) / S[0][0]};
}

// Tension s on both ends, as external forces of vertices.
static void pull_ends(const TestRig* r, double length, double s, double* f) {
    OmSurface skin;
    int* vert;
    assert_ok(om_tet_mesh_boundary(&r->mesh, &skin, &vert));
    for (int t = 0; t < skin.ntri; ++t) {
        const int* c = skin.tri_vert + 3 * (size_t)t;
        OmVec3 p[3];
        int nleft = 0, nright = 0;
        for (int k = 0; k < 3; ++k) {
            p[k] = om_load3(skin.x, c[k]);
            nleft += p[k].x < 1e-9;
            nright += p[k].x > length - 1e-9;
        }
        if (nleft < 3 && nright < 3) continue;
        double area = 0.5 * om_norm(om_cross(om_sub(p[1], p[0]), om_sub(p[2], p[0])));
        for (int k = 0; k < 3; ++k) f[3 * vert[c[k]]] += (nright == 3 ? s : -s) * area / 3;
    }
    om_free(vert);
    om_surface_done(&skin);
}

// Slope of a displacement over the coordinate, both of axis c.
static double mean_strain(const TestRig* r, int c) {
    double sx = 0, sxx = 0, su = 0, sxu = 0, n = r->mesh.nvert;
    for (int i = 0; i < r->mesh.nvert; ++i) {
        double x = r->mesh.x[3 * i + c], u = om_tissue_x(r->s)[3 * i + c] - x;
        sx += x, sxx += x * x, su += u, sxu += x * u;
    }
    return (n * sxu - sx * su) / (n * sxx - sx * sx);
}

// A bar pulled by both ends, free at its sides: the energy it takes gives Young's modulus, which must lie between
// the bounds of Reuss and Voigt. They hold exactly: at small strain the network is linear finite elements.
static void test_bar_stretches(void** state) {
    (void)state;
    for (int k = 0; k < 3; ++k) {
        TestRig r;
        const double L = 0.08, stress = 1e-4 * YOUNG;
        box(&r, om_vec3(L, 0.03, 0.03), 16 >> (k == 0), 6 >> (k == 0), 6 >> (k == 0));
        if (k == 2) shake_inside(&r.mesh, 0.005);
        r.def.gravity = nothing;
        r.def.rayleigh_mass = 0;
        rig_start(&r);
        double* f = om_tissue_external_force(r.s);
        pull_ends(&r, L, stress, f);
        for (int n = 0; n < 20; ++n) assert_ok(om_tissue_step(r.m, r.s, r.w, 1, NULL));
        double work = 0, volume = L * 0.03 * 0.03;
        for (int i = 0; i < 3 * r.mesh.nvert; ++i)
            work += f[i] * (om_tissue_x(r.s)[i] - r.mesh.x[i]);
        double young = stress * stress * volume / work;
        double poisson = -0.5 * (mean_strain(&r, 1) + mean_strain(&r, 2)) / mean_strain(&r, 0);
        Bounds bound = lattice_bounds(&r.mesh);
        print_message("bar %d: modulus %.4f E (lattice: %.4f to %.4f), Poisson's ratio %.3f "
                      "(lattice: %.3f)\n",
                      k, young / YOUNG, bound.min / YOUNG, bound.max / YOUNG, poisson,
                      bound.poisson);
        double give = 1e-3 * test_tol_scale();  // strains of 1e-4 are not infinitely small
        assert_true(young > bound.min * (1 - give) && young < bound.max * (1 + give));
        // Cells that are alike stretch alike; others do as they please.
        assert_near(poisson, bound.poisson, k < 2 ? 0.01 : 0.1);
        rig_done(&r);
    }
}

static double ball(void* ctx, OmVec3 p) {
    (void)ctx;
    return om_norm(p) - 0.02;
}

// What a mesh stands for depends on the direction in which it is pulled: bars of cubes cut in six have preferred
// ones, lattices cut from body-centred cubes (om_tet_mesh_stuff) hardly.
static void test_directions(void** state) {
    (void)state;
    const OmVec3 axis[3] = {{1, 0, 0}, {1, 1, 0}, {1, 1, 1}};
    for (int k = 0; k < 2; ++k) {
        OmTetMesh mesh;
        OmStuffDef def = om_stuff_default_def(0.004, ball, NULL, om_vec3(-0.03, -0.03, -0.03),
                                              om_vec3(0.03, 0.03, 0.03));
        if (k == 0)
            assert_ok(om_tet_mesh_box(nothing, om_vec3(1, 1, 1), 1, 1, 1, &mesh));
        else
            assert_ok(om_tet_mesh_stuff(&def, &mesh));
        double* rest = om_alloc((size_t)mesh.nvert, 24);
        memcpy(rest, mesh.x, (size_t)mesh.nvert * 24);
        for (int d = 0; d < 3; ++d) {
            // Turned so that the direction comes to lie along x.
            OmVec3 n = om_normalize(axis[d]), x = {1, 0, 0}, c = om_cross(n, x);
            OmQuat q = om_quat_identity();
            if (d > 0) q = om_quat_axis_angle(om_normalize(c), acos(om_dot(n, x)));
            for (int i = 0; i < mesh.nvert; ++i)
                om_store3(mesh.x, i, om_quat_rotate(q, om_load3(rest, i)));
            Bounds b = lattice_bounds(&mesh);
            print_message("%s along (%g %g %g): modulus %.3f to %.3f E, Poisson's ratio %.3f\n",
                          k == 0 ? "cube cut in six" : "stuffed ball", axis[d].x, axis[d].y,
                          axis[d].z, b.min / YOUNG, b.max / YOUNG, b.poisson);
            assert_true(b.min < b.max * (1 + 1e-12) && b.min > 0.4 * YOUNG);
            if (k == 1) assert_near(b.poisson, 0.25, 0.05);
            if (k == 1) assert_near_rel(b.max, YOUNG, 0.15);
        }
        om_free(rest);
        om_tet_mesh_done(&mesh);
    }
}

// Springs against their own energy, and against the tensors of elements.
static void test_energy(void** state) {
    (void)state;
    TestRig r;
    box(&r, om_vec3(0.03, 0.02, 0.02), 3, 2, 2);
    shake_inside(&r.mesh, 0.01);
    rig_start(&r);
    int n = r.mesh.nvert;
    double *x = om_alloc((size_t)n, 24), *f = om_alloc((size_t)n, 24), want = 0, C[6][6];
    // A small strain of all.
    const double e[6] = {3e-6, -1e-6, 2e-6, 1e-6, -2e-6, 1.5e-6}, r2 = sqrt(2);
    for (int i = 0; i < n; ++i) {
        OmVec3 p = om_load3(r.mesh.x, i);
        OmVec3 u = {e[0] * p.x + (e[5] * p.y + e[4] * p.z) / r2,
                    e[1] * p.y + (e[5] * p.x + e[3] * p.z) / r2,
                    e[2] * p.z + (e[4] * p.x + e[3] * p.y) / r2};
        om_store3(x, i, om_add(p, u));
    }
    for (int t = 0; t < r.mesh.ntet; ++t) {
        element_tensor(&r.mesh, t, C);
        for (int k = 0; k < 36; ++k)
            want += 0.5 * volume_of(&r.mesh, t) * e[k / 6] * C[k / 6][k % 6] * e[k % 6];
    }
    assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
    OmTissueEnergy energy;
    assert_ok(om_tissue_get_energy(r.m, r.s, &energy));
    assert_near_rel(energy.elastic, want, 1e-4);  // the next order is the strain times a few
    // A large one: forces are the energy's slope.
    rig_shake(&r.mesh, NULL, 0.003, x);
    assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
    assert_ok(om_tissue_get_internal_force(r.m, r.s, f));
    for (int k = 0; k < 3 * n; k += 7) {
        double keep = x[k], d = 1e-7, side[2];
        for (int s = 0; s < 2; ++s) {
            x[k] = keep + (s ? d : -d);
            assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
            assert_ok(om_tissue_get_energy(r.m, r.s, &energy));
            side[s] = energy.elastic;
        }
        x[k] = keep;
        // central differences: rounding of the energy over d
        assert_near(-(side[1] - side[0]) / (2 * d), f[k], 1e-6 * (1 + fabs(f[k])));
    }
    om_free(x);
    om_free(f);
    rig_done(&r);
}

// The matrix of a step against differences of forces, where all springs are stretched: A dv = M dv - h^2 df.
static void test_tangent(void** state) {
    (void)state;
    TestRig r;
    box(&r, om_vec3(0.03, 0.02, 0.02), 3, 2, 2);
    r.def.rayleigh_mass = 0;
    rig_start(&r);
    int n = 3 * r.mesh.nvert;
    double *x = om_alloc((size_t)n, 8), *way = om_calloc((size_t)n, 8);
    double *f[2], *Ad = om_alloc((size_t)n, 8), h = 0.02, d = 1e-6, worst = 0, scale = 0;
    for (int i = 0; i < n; ++i) x[i] = 1.4 * r.mesh.x[i];
    rig_shake(&r.mesh, NULL, 0.0005, x);
    rig_shake(&r.mesh, NULL, 1, way);
    assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
    assert_ok(om_tissue_begin_step(r.m, r.s, r.w, h));
    assert_ok(om_tissue_apply(r.m, r.w, 1, way, Ad));
    for (int s = 0; s < 2; ++s) {
        f[s] = om_alloc((size_t)n, 8);
        for (int i = 0; i < n; ++i) x[i] += (s ? 2 : -1) * d * way[i];
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        assert_ok(om_tissue_get_internal_force(r.m, r.s, f[s]));
    }
    for (int i = 0; i < n; ++i) {
        double want = om_tissue_mass(r.m)[i / 3] * way[i] - h * h * (f[1][i] - f[0][i]) / (2 * d);
        worst = fmax(worst, fabs(Ad[i] - want));
        scale = fmax(scale, fabs(want));
    }
    assert_below(worst, 1e-6 * scale * test_tol_scale());  // A is made of floats
    om_free(x);
    om_free(way);
    om_free(Ad);
    om_free(f[0]);
    om_free(f[1]);
    rig_done(&r);
}

// A turned body feels nothing, a free one keeps its momentum.
static void test_rigid_motion(void** state) {
    (void)state;
    for (int k = 0; k < 2; ++k) {
        TestRig r;
        box(&r, om_vec3(0.04, 0.02, 0.02), 4, 2, 2);
        r.def.gravity = nothing;
        r.def.rayleigh_mass = 0;
        rig_start(&r);
        int n = r.mesh.nvert;
        double *x = om_alloc((size_t)n, 24), *v = om_calloc((size_t)n, 24), worst = 0, scale = 0;
        OmQuat turned = om_quat_axis_angle(om_normalize(om_vec3(1, 2, -1)), 2.9);
        OmVec3 t = {0.3, -0.2, 0.1}, v0 = {0.1, 0.05, -0.2}, before, after;
        for (int i = 0; i < n; ++i) {
            om_store3(x, i, om_add(om_quat_rotate(turned, om_load3(r.mesh.x, i)), t));
            om_store3(v, i, v0);
        }
        if (k == 1) rig_shake(&r.mesh, NULL, 0.5, v);
        assert_ok(om_tissue_set_x(r.m, r.s, x, v));
        om_tissue_get_momentum(r.m, r.s, &before, NULL);
        for (int s = 0; s < 50; ++s) assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, NULL));
        om_tissue_get_momentum(r.m, r.s, &after, NULL);
        for (int i = 0; i < n; ++i) {
            OmVec3 want = om_madd(om_load3(x, i), 1, v0);  // 50 steps are 1 s
            worst = fmax(worst, om_distance(want, om_load3(om_tissue_x(r.s), i)));
            scale += om_tissue_mass(r.m)[i] * om_norm(om_load3(v, i));
        }
        if (k == 0) assert_below(worst, 1e-9 * test_tol_scale());  // rounding of 50 steps
        // what the linear solver's tolerance of 1e-6 leaves in 50 steps
        assert_below(om_distance(before, after), 1e-5 * scale * test_tol_scale());
        om_free(x);
        om_free(v);
        rig_done(&r);
    }
}

// Hung up, at rest: found by Newton's method and by stepping; its attachments carry its weight.
static void test_hangs(void** state) {
    (void)state;
    TestRig r;
    box(&r, om_vec3(0.02, 0.02, 0.04), 2, 2, 4);
    rig_attach_plane(&r, 2, 0.04);
    r.def.rayleigh_mass = 5;
    rig_start(&r);
    OmTissueReport report;
    assert_ok(om_tissue_find_rest(r.m, r.s, r.w, 1e-5, 50, &report));
    double low = om_tissue_x(r.s)[2];
    OmTissueForces f;
    assert_ok(om_tissue_get_forces(r.m, r.s, &f));
    assert_below(om_norm(om_add(f.attachment, f.weight)), 1e-4 * om_norm(f.weight));  // of Newton
    om_tissue_state_reset(r.m, r.s);
    for (int n = 0; n < 300; ++n) assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, NULL));
    assert_near(om_tissue_x(r.s)[2], low, 1e-6);  // m, 30 times the damping's time
    double sag = 1000 * 9.81 * 0.04 * 0.04 / (2 * YOUNG);
    print_message("hangs by %.3f mm; a bar of E %.3f mm\n", -1e3 * low, 1e3 * sag);
    rig_done(&r);
}

// A block on a board bears its weight there; the same held at its underside and pressed by a ball takes less than
// finite elements with Poisson's ratio 1/4 take, for the mesh has directions in which it is soft.
static double press(const OmTissueEngine* engine, double poisson) {
    TestRig r;
    box(&r, om_vec3(0.06, 0.06, 0.03), 8, 8, 4);
    rig_attach_plane(&r, 2, 0);
    r.def.engine = engine;
    r.def.gravity = nothing;
    r.def.material_default.poisson = poisson;
    rig_start(&r);
    OmProbeDef shape = om_probe_default_def(OM_PROBE_SPHERE);
    OmProbe* ball;
    OmPress* pressing;
    assert_ok(om_probe_create(&shape, &ball));
    OmPressDef def = om_press_default_def(ball);
    assert_ok(om_press_create(&def, r.m, &pressing));
    OmPressReport report;
    for (int n = 0; n < 12; ++n) {
        double depth = 0.0005 * fmin(n, 8);
        OmPose pose = {om_vec3(0.03, 0.03, 0.03 + shape.radius - depth), om_quat_identity()};
        assert_ok(om_press_step(pressing, r.m, r.s, r.w, pose, n < 9 ? 0.02 : 5, &report));
    }
    OmTissueForces f;
    assert_ok(om_tissue_get_forces(r.m, r.s, &f));
    assert_near(f.attachment.z, report.force.z, 1e-3 * report.force.z);  // at rest
    om_press_destroy(pressing);
    om_probe_destroy(ball);
    rig_done(&r);
    return report.force.z;
}

static void test_contact(void** state) {
    (void)state;
    double springs = press(om_spring_engine(), 0.45), alike = press(om_fem_engine(), 0.25),
           soft = press(om_fem_engine(), 0.45);
    print_message("a ball pressed in by 4 mm takes %.4f N; finite elements %.4f N (ratio 0.25), "
                  "%.4f N (0.45)\n",
                  springs, alike, soft);
    assert_true(springs > 0.5 * alike && springs < alike);  // the mesh's soft directions
    TestRig r;
    box(&r, om_vec3(0.04, 0.04, 0.02), 4, 4, 2);
    r.def.rayleigh_mass = 5;
    rig_start(&r);
    OmContactPlane plane = {nothing, om_vec3(0, 0, 1)};
    OmTissueObstacle board = om_plane_obstacle(&plane);
    OmContactDef def = rig_on(&board);
    rig_contact(&r, &def);
    for (int n = 0; n < 200; ++n) assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, NULL));
    OmTissueForces f;
    assert_ok(om_tissue_get_forces(r.m, r.s, &f));
    assert_below(om_norm(om_add(f.contact, f.weight)), 1e-3 * om_norm(f.weight));  // of the solver
    rig_done(&r);
}

// Pressed to a point, scattered, torn by tools in long steps, of any stiffness: nothing is lost but the shape.
static void test_absurd_inputs(void** state) {
    (void)state;
    OmRng rng = om_rng_init(3, 4);
    for (int k = 0; k < 60; ++k) {
        TestRig r;
        box(&r, om_vec3(0.04, 0.03, 0.02), 4, 3, 2);
        r.def.material_default.young = pow(10, 1 + 7 * om_rng_uniform(&rng));
        rig_attach_plane(&r, 0, 0);
        rig_start(&r);
        int n = r.mesh.nvert;
        double *x = om_calloc((size_t)n, 24), h = 0.1 * om_rng_uniform(&rng) + 1e-4, max = 0;
        if (k % 3 != 0) memcpy(x, r.mesh.x, (size_t)n * 24);
        if (k % 3 == 1) rig_shake(&r.mesh, NULL, 0.1, x);
        assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
        OmPose tip = {om_load3(x, n - 1), om_quat_identity()};
        bool holds = om_tissue_grasp(r.m, r.s, 0, tip, 1e-6, NULL) == OM_OK;
        for (int s = 0; s < 30; ++s) {
            for (int c = 0; c < 3; ++c) (&tip.p.x)[c] = 2 * om_rng_uniform(&rng) - 1;
            if (holds) assert_ok(om_tissue_move_grasp(r.s, 0, tip));
            if (s == 20) om_tissue_release(r.s, 0);
            OmStatus status = om_tissue_step(r.m, r.s, r.w, h, NULL);
            if (status < 0) fail_msg("scene %d, step %d: %s", k, s, om_error_message());
        }
        for (int i = 0; i < 3 * n; ++i) max = fmax(max, fabs(om_tissue_x(r.s)[i]));
        assert_true(max < 20);  // m; not a number fails too
        om_free(x);
        rig_done(&r);
    }
}

static uint64_t run_with_workers(int nworker) {
    TestRig r;
    box(&r, om_vec3(0.06, 0.04, 0.02), 12, 8, 4);
    rig_attach_plane(&r, 0, 0);
    r.def.solver.nworker = nworker;
    rig_start(&r);
    OmPose tip = {om_vec3(0.06, 0.02, 0.01), om_quat_identity()};
    assert_ok(om_tissue_grasp(r.m, r.s, 0, tip, 0.006, NULL));
    for (int s = 0; s < 10; ++s) {
        tip.p.z += 0.001;
        assert_ok(om_tissue_move_grasp(r.s, 0, tip));
        assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, NULL));
    }
    assert_true(om_tissue_find_rest(r.m, r.s, r.w, 1e-3, 20, NULL) >= 0);
    uint64_t hash = om_tissue_state_hash(r.s);
    rig_done(&r);
    return hash;
}

static void test_same_bytes(void** state) {
    (void)state;
    uint64_t hash = run_with_workers(1);
    for (int n = 1; n <= 3; ++n) assert_true(run_with_workers(n) == hash);
}

// Each spring once at either end, the sum of E V / l^2 over its elements.
static void test_views(void** state) {
    (void)state;
    TestRig r;
    box(&r, om_vec3(0.01, 0.01, 0.01), 1, 1, 1);
    r.def.nmaterial = 2;
    const OmMaterial soft[2] = {{.young = 1000, .poisson = 0.3}, {.young = 3000, .poisson = 0.45}};
    r.def.material = soft;
    for (int e = 0; e < r.mesh.ntet; ++e) r.mesh.tet_label[e] = e % 2;
    rig_start(&r);
    const int* adr;
    const OmSpring* spring;
    int num = om_heuristic_springs(r.m, &adr, &spring);
    assert_int_equal(num,
                     2 * 19);  // 12 edges of the cube, 6 diagonals of its faces, one of the cube
    double sum = 0, want = 0;
    for (int k = 0; k < num; ++k) sum += 0.5 * spring[k].stiffness * pow(spring[k].length, 2);
    for (int e = 0; e < r.mesh.ntet; ++e) want += 6 * soft[e % 2].young * volume_of(&r.mesh, e);
    assert_near_rel(sum, want, 1e-12);
    rig_done(&r);
    rig_box(&r, nothing, om_vec3(0.01, 0.01, 0.01), 1, 1, 1);
    rig_start(&r);
    assert_int_equal(om_heuristic_springs(r.m, &adr, &spring), 0);
    rig_done(&r);
}

static void test_failing_memory(void** state) {
    (void)state;
    TestRig r;
    box(&r, om_vec3(0.02, 0.02, 0.02), 2, 2, 2);
    assert_true(test_failing_allocations(rig_create_and_step, &r.def, 1) > 10);
    om_tet_mesh_done(&r.mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bar_stretches),  cmocka_unit_test(test_directions),
        cmocka_unit_test(test_energy),         cmocka_unit_test(test_tangent),
        cmocka_unit_test(test_rigid_motion),   cmocka_unit_test(test_hangs),
        cmocka_unit_test(test_absurd_inputs),  cmocka_unit_test(test_same_bytes),
        cmocka_unit_test(test_views),          cmocka_unit_test(test_contact),
        cmocka_unit_test(test_failing_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
