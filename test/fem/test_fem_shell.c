// test_fem_shell.c: the pinched hemisphere and the pinched cylinder as solids of quadratic tetrahedra with straight
// edges, one layer, as the engine has them (the element is that of om_fem below a Poisson's ratio of 1/3), against the
// same with curved edges on a fine mesh.
#include "test_common.h"

#include "omentum/fem.h"

typedef struct Shell {
    const char* name;
    OmVec3 (*place)(double u, double v,
                    double depth);  // u, v in [0, 1], depth in m from the middle
    double radius, young, force;
    // of a node with the box coordinates p: directions held
    void (*hold)(OmVec3 p, unsigned char fixed[3]);
    int npoint;
    OmVec3 point[2], pull[2];  // box coordinates of the loaded edges, forces
} Shell;

// Quarter of a hemisphere with a hole of 18 degrees: u along the equator, v up.
static OmVec3 on_sphere(double u, double v, double depth) {
    double a = u * OM_PI / 2, b = v * 72 * OM_PI / 180, r = 10 + depth;
    return om_vec3(r * cos(b) * cos(a), r * cos(b) * sin(a), r * sin(b));
}
static void hold_sphere(OmVec3 p, unsigned char fixed[3]) {
    fixed[1] = p.x < 1e-9;      // symmetric to y = 0
    fixed[0] = p.x > 1 - 1e-9;  // and to x = 0
    // one ring of nodes keeps it from moving along the axis
    fixed[2] = p.y < 1e-9 && p.x < 1e-9 && fabs(p.z - 0.5) < 1e-9;
}

// An eighth of a cylinder along x between two diaphragms: u along it from the middle, v around.
static OmVec3 on_cylinder(double u, double v, double depth) {
    double a = v * OM_PI / 2, r = 300 + depth;
    return om_vec3(300 * u, r * sin(a), r * cos(a));
}
static void hold_cylinder(OmVec3 p, unsigned char fixed[3]) {
    fixed[0] = p.x < 1e-9;  // symmetric to the middle
    fixed[1] = p.y < 1e-9;
    fixed[2] = p.y > 1 - 1e-9;
    if (p.x > 1 - 1e-9) fixed[1] = fixed[2] = 1;  // the diaphragm
}

static const Shell hemisphere = {"hemisphere",
                                 on_sphere,
                                 10,
                                 6.825e7,
                                 1,
                                 hold_sphere,
                                 2,
                                 {{0, 0, 0}, {1, 0, 0}},
                                 {{1, 0, 0}, {0, -1, 0}}},
                   cylinder = {"cylinder",    on_cylinder, 300,         3e6,         0.25,
                               hold_cylinder, 1,           {{0, 0, 0}}, {{0, 0, -1}}};

// The loads spread over the volume of an eighth by an eighth of the side at their points: consistent forces.
static void spread(const Shell* shell, const OmFemMesh* mesh, const double* at, double* force) {
    for (int k = 0; k < shell->npoint; ++k) {
        double whole = 0;
        for (int pass = 0; pass < 2; ++pass)
            for (int e = 0; e < mesh->nelem; ++e) {
                const int* node = mesh->elem_node + 10 * (size_t)e;
                OmVec3 p = {0, 0, 0}, a = om_load3(mesh->x, node[0]);
                for (int i = 0; i < 4; ++i) p = om_madd(p, 0.25, om_load3(at, node[i]));
                if (fmax(fabs(p.x - shell->point[k].x), fabs(p.y - shell->point[k].y)) > 0.125)
                    continue;
                double volume = om_dot(om_cross(om_sub(om_load3(mesh->x, node[1]), a),
                                                om_sub(om_load3(mesh->x, node[2]), a)),
                                       om_sub(om_load3(mesh->x, node[3]), a));
                if (pass == 0) whole += volume;
                for (int i = 0; i < 10 && pass == 1; ++i) {
                    double share = (i < 4 ? -0.05 : 0.2) * volume / whole * shell->force;
                    om_store3(force, node[i],
                              om_madd(om_load3(force, node[i]), share, shell->pull[k]));
                }
            }
    }
}

// Displacement of the first loaded edge along its force, the mean through the thickness.
static double pinch(const Shell* shell, double ratio, int n, int layers, bool is_curved,
                    bool is_spread) {
    OmFemMesh box, mesh;
    OmTetMesh tet;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(1, 1, 1), n, n, layers, &tet));
    assert_ok(om_fem_mesh_from_tet(&tet, OM_TET10, &box));
    double thickness = shell->radius / ratio;
    for (int i = 0; i < tet.nvert; ++i) {
        OmVec3 p = om_load3(tet.x, i);
        om_store3(tet.x, i, shell->place(p.x, p.y, (p.z - 0.5) * thickness));
    }
    // a map may turn the box inside out
    if (om_tet_mesh_volume(&tet) < 0)
        for (int e = 0; e < tet.ntet; ++e) {
            int* v = tet.tet_vert + 4 * (size_t)e;
            int swap = v[0];
            v[0] = v[1], v[1] = swap;
        }
    assert_ok(om_fem_mesh_from_tet(&tet, OM_TET10, &mesh));
    size_t n3 = 3 * (size_t)mesh.nnode;
    unsigned char* fixed = om_calloc(n3, 1);
    double *x = om_alloc(n3, sizeof *x), *force = om_calloc(n3, sizeof *force), w = 0,
           *at = om_alloc(n3, sizeof *at);
    // box coordinates of the nodes: vertices keep their numbers, a midpoint is between its ends
    memcpy(at, box.x, 3 * (size_t)tet.nvert * sizeof *at);
    static const int edge[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
    for (int e = 0; e < mesh.nelem; ++e)
        for (int k = 0; k < 6; ++k) {
            const int* node = mesh.elem_node + 10 * (size_t)e;
            om_store3(at, node[4 + k],
                      om_lerp(om_load3(at, node[edge[k][0]]), om_load3(at, node[edge[k][1]]), 0.5));
        }
    for (int i = 0; i < mesh.nnode; ++i) {
        OmVec3 p = om_load3(at, i);
        if (is_curved) om_store3(mesh.x, i, shell->place(p.x, p.y, (p.z - 0.5) * thickness));
        shell->hold(p, fixed + 3 * (size_t)i);
        int half = (int)lround(2 * layers * p.z);  // Simpson's rule along a loaded edge
        double weight = (half % 2 ? 4 : half == 0 || half == 2 * layers ? 1 : 2) / (6.0 * layers);
        for (int k = 0; k < shell->npoint; ++k)
            if (!is_spread && hypot(p.x - shell->point[k].x, p.y - shell->point[k].y) < 1e-9)
                om_store3(force, i, om_scale(weight * shell->force, shell->pull[k]));
    }
    if (is_spread) spread(shell, &mesh, at, force);
    OmMaterial material = {.young = shell->young, .poisson = 0.3, .law = OM_LINEAR};
    OmFemDef def = om_fem_default_def(&mesh, 1, &material);
    OmFemSolid* solid;
    def.nworker = 1;
    assert_ok(om_fem_create(&def, &solid));
    OmFemLoad load = {.force = force, .fixed = fixed};
    OmFemStaticDef how = om_fem_static_default_def(solid);
    how.tolerance = 1e-7;
    how.solver.preconditioner = OM_CHOLESKY;
    memcpy(x, mesh.x, n3 * sizeof *x);
    if (om_fem_static_solve(solid, &load, &how, x, NULL, NULL) != OM_OK)
        fail_msg("%s", om_error_message());
    // the work of all loads is that of the first, once or twice
    for (size_t i = 0; i < n3; ++i)
        w += force[i] * (x[i] - mesh.x[i]) / (shell->force * shell->npoint);
    om_free(fixed), om_free(x), om_free(force), om_free(at);
    om_fem_destroy(solid);
    om_fem_mesh_done(&mesh);
    om_fem_mesh_done(&box);
    om_tet_mesh_done(&tet);
    return w;
}

// R/t = 20 is judged, the standard thickness printed beside the displacement of thin shells.
static void check_shell(const Shell* shell, bool is_spread, double expected, const double bound[2],
                        double thin_ratio, double thin) {
    static const int cells[2] = {8, 16};
    double fine = expected;
    if (test_is_slow()) {
        double half = pinch(shell, 20, 16, 2, true, is_spread);
        fine = pinch(shell, 20, 32, 2, true, is_spread);
        printf("%s, %s load, R/t 20, curved: %.6g with 16x16x2 cells, %.6g with 32x32x2\n",
               shell->name, is_spread ? "spread" : "point", half, fine);
        assert_near_rel(fine, expected, 1e-4);
    }
    for (int k = 0; k < test_count(1, 2); ++k) {
        double w = pinch(shell, 20, cells[k], 1, false, is_spread);
        printf("%s, %s load, R/t 20, %dx%dx1: %.6g, %+.1f %%\n", shell->name,
               is_spread ? "spread" : "point", cells[k], cells[k], w, 100 * (w / fine - 1));
        assert_near_rel(w, fine, bound[k]);
    }
    for (int k = 0; k < 2 && test_is_slow() && !is_spread; ++k) {
        double w = pinch(shell, thin_ratio, cells[k], 1, false, false);
        printf("%s, R/t %g, %dx%dx1: %.6g, %+.1f %% of the thin shell\n", shell->name, thin_ratio,
               cells[k], cells[k], w, 100 * (w / thin - 1));
    }
}

static void test_hemisphere(void** context) {
    (void)context;
    static const double goal[2] = {0.1, 0.03};
    check_shell(&hemisphere, false, 5.22582e-5, goal, 250, 0.0940);
    check_shell(&hemisphere, true, 3.70038e-5, goal, 250, 0.0940);
}

static void test_cylinder(void** context) {
    (void)context;
    // under a point load the goal is missed, but no mesh of a solid converges there (doc/fem.md)
    static const double goal[2] = {0.1, 0.03}, missed[2] = {0.15, 0.05};
    check_shell(&cylinder, false, 5.28252e-7, missed, 100, 1.8248e-5);
    check_shell(&cylinder, true, 3.36753e-7, goal, 100, 1.8248e-5);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_hemisphere),
                                       cmocka_unit_test(test_cylinder)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
