// test_fem_unseen.c: quadratic elements on unstructured meshes of organs: a liver, and fat over its front, with edges
// of 8 and of 4 mm, held at a part and lifted at a patch; the force against that of the same mesh refined.
#include "test_element.h"

#include "omentum/scene_model.h"

#define UNIT 0.015  // m, of the livers' files: half the size of an organ, 130 mL
#define RISE 0.01   // m, of the patch
#define HELD "held"

// Vertices whose distance to `p` is below `reach` become the set "patch".
static void add_patch(OmTetMesh* mesh, OmVec3 p, double reach) {
    int num = 0, *vert = om_alloc((size_t)mesh->nvert, sizeof *vert);
    for (int i = 0; i < mesh->nvert; ++i)
        if (om_distance(om_load3(mesh->x, i), p) < reach) vert[num++] = i;
    assert_true(num >= 3);
    assert_ok(om_tet_mesh_add_set(mesh, "patch", vert, num));
    om_free(vert);
}

static int farthest(const OmTetMesh* mesh, OmVec3 direction) {
    int best = 0;
    for (int i = 1; i < mesh->nvert; ++i)
        if (om_dot(om_load3(mesh->x, i), direction) > om_dot(om_load3(mesh->x, best), direction))
            best = i;
    return best;
}

// Force on the patch, N, along the direction in which it rises.
static double lift_patch(OmTetMesh* mesh, OmVec3 up, const ElementKind* kind, int* nnode) {
    TestRig r = {.mesh = *mesh};
    r.def = om_tissue_default_def(om_fem_engine(), mesh);
    r.def.solver.nworker = 1;
    r.def.solver.tolerance = 1e-5;
    r.def.solver.max_iterations = 500;
    r.def.gravity = om_vec3(0, 0, 0);
    r.def.material_default =
        (OmMaterial){.young = 3000, .poisson = 0.45, .law = OM_STABLE_NEO_HOOKEAN};
    element_choose(&r, kind);
    rig_start(&r);
    const OmMeshSet* set[2] = {om_tet_mesh_find_set(mesh, HELD),
                               om_tet_mesh_find_set(mesh, "patch")};
    int num = 0, *vert = om_alloc((size_t)mesh->nvert, sizeof *vert);
    double* anchor = om_alloc(3 * (size_t)mesh->nvert, sizeof *anchor);
    unsigned char* is_patch = om_calloc((size_t)mesh->nvert, 1);
    for (int k = 1; k >= 0; --k)
        for (int n = 0; n < set[k]->nvert; ++n) {
            int i = set[k]->vert[n];
            if (is_patch[i]) continue;
            is_patch[i] = (unsigned char)k;
            vert[num] = i;
            om_store3(anchor, num++, om_madd(om_load3(mesh->x, i), k ? RISE : 0, up));
        }
    assert_ok(om_tissue_set_attachment(r.m, r.s, num, vert, anchor, NULL));
    OmTissueReport report;
    OmStatus status = om_tissue_find_rest(r.m, r.s, r.w, 1e-7, 60, &report);
    if (status != OM_OK) fail_msg("%s (%.2g)", om_error_message(), report.newton_residual);
    *nnode = element_nodes(&r)->nvert;
    double *f = om_alloc(3 * (size_t)*nnode, sizeof *f), force = 0;
    assert_ok(om_tissue_get_attachment_force(r.m, r.s, f));
    om_tissue_gather_corners(r.m, f, f);  // a midpoint of the patch lies between vertices of it
    for (int i = 0; i < mesh->nvert; ++i)
        if (is_patch[i]) force += om_dot(om_load3(f, i), up);
    double all = 0;
    for (int i = 0; i < mesh->nvert; ++i) all += om_dot(om_load3(f, i), up);
    assert_near(all, 0, 1e-4 * fabs(force));
    om_free(f), om_free(vert), om_free(anchor), om_free(is_patch);
    memset(&r.mesh, 0, sizeof r.mesh);
    rig_done(&r);
    return force;
}

// The mesh has the sets HELD and "patch"; it is freed. `expected` is the force on the refined mesh, N, which the
// slow run computes; 0: only there.
static void compare(const char* name, OmTetMesh* mesh, OmVec3 up, double expected, double bound) {
    OmMeshQuality quality;
    assert_ok(om_tet_mesh_quality(mesh, &quality));
    int num[3] = {0, 0, 0}, nheld = om_tet_mesh_find_set(mesh, HELD)->nvert,
        npatch = om_tet_mesh_find_set(mesh, "patch")->nvert;
    double linear = lift_patch(mesh, up, &linear_element, &num[0]),
           coarse = lift_patch(mesh, up, &quadratic_element, &num[1]), fine = expected;
    if (test_is_slow()) {
        assert_ok(om_tet_mesh_refine(mesh));
        fine = lift_patch(mesh, up, &quadratic_element, &num[2]);
        if (expected > 0) assert_near_rel(fine, expected, 1e-3);
    }
    printf("%s, edges of %.1f mm, angles %.0f to %.0f degrees, %d held, %d lifted: %.3f mN on %d "
           "nodes, refined %.3f mN on %d, %+.1f %%; linear %+.1f %%\n",
           name, 1e3 * quality.edge_mean, quality.dihedral_min * 180 / OM_PI,
           quality.dihedral_max * 180 / OM_PI, nheld, npatch, 1e3 * coarse, num[1], 1e3 * fine,
           num[2], 100 * (coarse / fine - 1), 100 * (linear / fine - 1));
    om_tet_mesh_done(mesh);
    assert_near_rel(coarse, fine, bound);
    assert_true(fabs(linear - fine) > fabs(coarse - fine));
}

static void hold(OmTetMesh* mesh, OmVec3 direction, double share) {
    double lo = om_dot(om_load3(mesh->x, farthest(mesh, om_scale(-1, direction))), direction),
           hi = om_dot(om_load3(mesh->x, farthest(mesh, direction)), direction);
    int num = 0, *vert = om_alloc((size_t)mesh->nvert, sizeof *vert);
    for (int i = 0; i < mesh->nvert; ++i)
        if (om_dot(om_load3(mesh->x, i), direction) > hi - share * (hi - lo)) vert[num++] = i;
    assert_ok(om_tet_mesh_add_set(mesh, HELD, vert, num));
    om_free(vert);
}

// The liver is held at its right third and lifted at the tip of the left lobe.
static void liver(double edge, double expected) {
    OmModelDef def = om_model_default_def(test_data("livers/liver-smooth.obj"), edge);
    def.unit = UNIT;
    def.nworker = 1;
    OmPatient p;
    assert_ok(om_model_build(&def, NULL, &p, NULL));
    hold(&p.mesh, om_vec3(1, 0, 0), 0.3);
    add_patch(&p.mesh, om_load3(p.mesh.x, farthest(&p.mesh, om_vec3(-1, 0, 0))), 0.012);
    compare("liver", &p.mesh, om_vec3(0, 0, 1), expected, 0.05);
    om_patient_done(&p);
}

// Fat of 8 mm over the front of the liver, held at a quarter of it, or at a quarter of its rim alone, lifted at the
// other side.
static void fat(double edge, bool at_rim, double expected, double bound) {
    OmModelDef def = om_model_default_def(test_data("livers/liver-smooth.obj"), edge);
    def.unit = 2 * UNIT;
    def.nworker = 1;
    def.sheet.thickness = 0.008;
    def.sheet.keep_edge = def.allow_loss = true;  // elements as long as the fat is thick
    def.sheet.half_length = def.sheet.half_width = 0.04;
    OmPatient p;
    assert_ok(om_model_build(&def, NULL, &p, NULL));
    const OmMeshSet* rim = om_tet_mesh_find_set(&p.mesh, "attachment");
    OmVec3 held = {0, 0, 0}, all = {0, 0, 0};
    for (int n = 0; n < rim->nvert; ++n)
        held = om_madd(held, 1.0 / rim->nvert, om_load3(p.mesh.x, rim->vert[n]));
    for (int i = 0; i < p.mesh.nvert; ++i)
        all = om_madd(all, 1.0 / p.mesh.nvert, om_load3(p.mesh.x, i));
    if (at_rim)
        assert_ok(om_tet_mesh_add_set(&p.mesh, HELD, rim->vert, rim->nvert));
    else
        hold(&p.mesh, om_sub(held, all), 0.25);
    add_patch(&p.mesh, om_load3(p.mesh.x, farthest(&p.mesh, om_sub(all, held))), 0.012);
    compare(at_rim ? "fat at its rim" : "fat", &p.mesh, p.up, expected, bound);
    om_patient_done(&p);
}

static void test_liver(void** context) {
    (void)context;
    liver(0.008, 0.028686);
    if (test_is_slow()) liver(0.004, 0);
}

static void test_fat(void** context) {
    (void)context;
    // on this mesh the goal of 5 % is missed by half a percent (doc/fem.md)
    fat(0.008, false, 0.011917, 0.06);
    if (!test_is_slow()) return;
    fat(0.004, false, 0, 0.05);
    fat(0.004, true, 0, 0.05);
    // 25 vertices of the rim, a ragged edge, are held by too many nodes: 5 % is missed (doc/fem.md)
    fat(0.008, true, 0, 0.13);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_liver), cmocka_unit_test(test_fat)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
