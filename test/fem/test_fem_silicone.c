// test_fem_silicone.c: a real silicone cylinder that sags under its weight; its tip was measured.
#include "test_rig.h"
#include "test_solid.h"

#include "omentum/shape_file.h"

// PDMS, R 4.25 mm, L 182 mm, clamped at z = 0, gravity along -y; Mooney-Rivlin of its makers.
static const OmMaterial silicone = {.young = 6 * (151065.46 + 101709.668),
                                    .law = OM_MOONEY_RIVLIN,
                                    .c10 = 101709.668,
                                    .c01 = 151065.46,
                                    .bulk = 1e7};

static double tip_distance(const OmTetMesh* tet, OmElement kind, OmLocking locking,
                           double tolerance) {
    TestSolid t = {.material = silicone, .density = 965, .locking = locking};
    assert_ok(om_fem_mesh_from_tet(tet, kind, &t.mesh));
    for (int e = 0; e < t.mesh.nelem; ++e) t.mesh.elem_material[e] = 0;
    solid_start(&t);
    double end = 0, num = 0;
    for (int i = 0; i < t.mesh.nnode; ++i) {
        end = fmax(end, t.mesh.x[3 * i + 2]);
        for (int k = 0; k < 3 && t.mesh.x[3 * i + 2] < 1e-6; ++k) t.fixed[3 * i + k] = 1;
    }
    t.load.body = om_vec3(0, -9.81, 0);
    double start = om_clock_now();
    OmFemStaticDef def = om_fem_static_default_def(t.solid);
    def.nstep = 6;
    def.tolerance = tolerance;
    def.solver.preconditioner = OM_CHOLESKY;  // a needle: few fill-ins, many turns of CG
    assert_ok(om_fem_static_solve(t.solid, &t.load, &def, t.x, t.reaction, &t.report));
    OmVec3 tip = {0, 0, 0}, measured = {0, -0.11625, 0.128};
    for (int i = 0; i < t.mesh.nnode; ++i) {
        if (t.mesh.x[3 * i + 2] < end - 1e-6) continue;
        tip = om_add(tip, om_load3(t.x, i));
        ++num;
    }
    tip = om_scale(1 / num, tip);
    double d = om_distance(tip, measured);
    printf("silicone, %s%s: tip (%.5f, %.5f, %.5f) m, %.2f mm from the measured one; %d Newton "
           "iterations, %d of CG, %.1f s\n",
           om_element_name(kind), locking ? " with nodal volumes" : "", tip.x, tip.y, tip.z,
           1e3 * d, t.report.nnewton, t.report.ncg, om_clock_now() - start);
    solid_done(&t);
    return d;
}

static void test_silicone(void** context) {
    (void)context;
    const char* path = test_data("silicone_beam/cylinderPDMS12724Vol.vtk");
    OmTetMesh tet;
    assert_ok(om_tet_mesh_load(path, OM_UNIT_M, &tet));
    assert_below(tip_distance(&tet, OM_TET10, OM_LOCKING_NONE, 1e-5), 4e-3);
    om_tet_mesh_done(&tet);
}

// The same in the engine, which lets the cylinder settle in short steps: a matrix of floats does not hold the statics
// of a needle, and from a step of 16 ms on multigrid does not converge.
static void test_engine(void** context) {
    (void)context;
    TestRig r = {0};
    assert_ok(
        om_tet_mesh_load(test_data("silicone_beam/cylinderPDMS12724Vol.vtk"), OM_UNIT_M, &r.mesh));
    r.def = om_tissue_default_def(om_fem_engine(), &r.mesh);
    r.def.element = OM_ELEMENT_QUADRATIC;
    r.def.material_default = silicone;
    r.def.density = 965;
    r.def.gravity = om_vec3(0, -9.81, 0);
    r.def.rayleigh_mass = 15;
    r.def.solver.nworker = 1;
    r.def.solver.tolerance = 1e-4;
    r.def.solver.max_iterations = 500;
    double end = 0, start = om_clock_now(), speed = 1;
    for (int i = 0; i < r.mesh.nvert; ++i) end = fmax(end, r.mesh.x[3 * i + 2]);
    int num = 0, nstep = 0, nbad = 0, *vert = om_alloc((size_t)r.mesh.nvert, sizeof *vert);
    for (int i = 0; i < r.mesh.nvert; ++i)
        if (r.mesh.x[3 * i + 2] < 1e-6) vert[num++] = i;
    assert_ok(om_tet_mesh_add_set(&r.mesh, "attachment", vert, num));
    om_free(vert);
    rig_start(&r);
    const OmTetMesh* mesh = om_tissue_mesh(r.m);
    for (; nstep < 300 && speed > 1e-4; ++nstep) {
        OmStatus status = om_tissue_step(r.m, r.s, r.w, 0.008, NULL);
        if (status < 0) fail_msg("%s", om_error_message());
        nbad += status != OM_OK;
        speed = 0;
        for (int i = 0; i < 3 * mesh->nvert; ++i) speed = fmax(speed, fabs(om_tissue_v(r.s)[i]));
    }
    OmVec3 tip = {0, 0, 0}, measured = {0, -0.11625, 0.128};
    num = 0;
    for (int i = 0; i < r.mesh.nvert; ++i) {
        if (r.mesh.x[3 * i + 2] < end - 1e-6) continue;
        tip = om_add(tip, om_load3(om_tissue_x(r.s), i));
        ++num;
    }
    tip = om_scale(1.0 / num, tip);
    double d = om_distance(tip, measured);
    printf("silicone, engine, %d nodes: tip (%.5f, %.5f, %.5f) m, %.2f mm from the measured one; "
           "%d of %d steps not OM_OK, at last %.2g m/s, %.1f s\n",
           mesh->nvert, tip.x, tip.y, tip.z, 1e3 * d, nbad, nstep, speed, om_clock_now() - start);
    rig_done(&r);
    assert_below(speed, 1e-3);
    assert_int_equal(nbad, 0);
    assert_below(d, 4e-3);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_silicone),
                                       cmocka_unit_test(test_engine)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
